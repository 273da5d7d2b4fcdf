"""One browser for all tests of pages of a process; without chromium they say that they were skipped."""

from collections.abc import Iterator

import pytest

from helpers.browser import CHROMIUM, DESKTOP, Opened, started


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
