"""The viewer in a browser, on a scene written by hand whose colours and sizes are known."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from playwright.sync_api import Page

from flexura.pages.viewer import page as page_of
from helpers.browser import DESKTOP, Opened, pixels, shot
from helpers.two_boxes import BODY, FLEXURE, two_boxes

Open = Callable[..., Page]


@pytest.fixture
def show(browser, tmp_path) -> Iterator[Open]:
    """Opens a page with a scene, at rest unless asked otherwise, holds that nothing failed or was asked for."""
    every: list[Opened] = []

    def opened(scene: dict | None = None, *, viewport: dict = DESKTOP, motion: str = "reduce", **more) -> Page:
        own = Opened(browser.new_context(viewport=viewport, reduced_motion=motion, accept_downloads=True, **more))
        every.append(own)
        text = page_of(
            "two boxes",
            '<main><figure data-viewer="own"></figure></main>',
            "viewer",
            {"viewer": {"own": scene or two_boxes()}},
        )
        path = tmp_path / "page.html"
        path.write_text(text, encoding="utf-8")
        own.page.goto(path.as_uri())
        own.page.wait_for_selector(".fx-motion")
        settle(own.page)
        return own.page

    yield opened
    for own in every:
        assert own.errors == [] and own.outside == []
        own.page.context.close()


def settle(page: Page) -> None:
    """Wait until what was asked for is drawn."""
    page.evaluate(
        "() => new Promise(done => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(done)), 60))"
    )


def front(page: Page) -> None:
    """At rest, from the front, in parallel projection, without labels: x to the right, z up, at one scale."""
    page.get_by_role("radio", name="at rest").check()
    page.get_by_role("checkbox", name="marks of doubts").uncheck()
    page.locator("canvas").first.focus()
    page.keyboard.press("o")
    page.keyboard.press("1")
    settle(page)


def picture(page: Page) -> np.ndarray:
    """The picture between the title and the triad."""
    return pixels(page.locator(".fx-picture").screenshot())[100:-100]


def like(image: np.ndarray, colour: str) -> np.ndarray:
    """Where an image shows a colour in some light: its hue, and neither too dark nor pale."""
    wanted = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], dtype=float)
    wanted /= np.linalg.norm(wanted)
    size = np.linalg.norm(image, axis=-1)
    cosine = image @ wanted / np.maximum(size, 1)
    return (cosine > 0.985) & (size > 90)


def across(mask: np.ndarray) -> tuple[int, int]:
    """First and last column of what is found."""
    columns = np.flatnonzero(mask.sum(axis=0) > 5)
    assert columns.size, "not found in the picture"
    return int(columns[0]), int(columns[-1])


def test_parts_stand_where_they_are_in_their_colours(show):
    page = show()
    shot(page, "viewer-two-boxes")
    front(page)
    image = picture(page)
    blue, orange = across(like(image, BODY)), across(like(image, FLEXURE))
    scale = (orange[1] - blue[0] + 1) / 100  # of 100 mm
    assert scale > 4
    assert abs((blue[1] - blue[0] + 1) / scale - 45) < 1 and abs((orange[1] - orange[0] + 1) / scale - 45) < 1
    middle = (orange[1] + blue[0]) / 2
    assert abs(middle - image.shape[1] / 2) < 3


def test_a_mode_moves_what_it_moves(show):
    page = show(motion="no-preference")
    first = picture(page)
    assert page.get_by_role("button", name="pause").is_visible()
    page.wait_for_timeout(400)
    assert (np.abs(picture(page) - first).max(axis=-1) > 40).sum() > 2000


def test_nothing_moves_for_who_prefers_less_motion(show):
    page = show()
    first = picture(page)
    page.wait_for_timeout(400)
    assert np.array_equal(picture(page), first)
    assert page.get_by_role("button", name="play").is_visible()
