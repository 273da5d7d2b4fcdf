"""One browser for all tests of pages of a process; without chromium they say that they were skipped."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest
from playwright.sync_api import Page

from helpers.browser import CHROMIUM, DESKTOP, Opened, started
from helpers.viewer_page import viewer


@pytest.fixture(scope="session")
def browser():
    if CHROMIUM is None:
        pytest.skip("no chromium: `make packages` installs it")
    with started() as own:
        yield own


@pytest.fixture
def opened(browser) -> Iterator[Opened]:
    """A page of a window of its own, at the size of a desktop."""
    with browser.new_context(viewport=DESKTOP) as context:
        yield Opened(context)


@pytest.fixture
def show(browser, tmp_path) -> Iterator[Callable[..., Page]]:
    """Opens the page of a scene, the two boxes unless given."""
    with ExitStack() as stack:
        yield lambda scene=None, **context: stack.enter_context(
            viewer(browser, tmp_path / "page.html", scene, **context)
        )
