"""A scene opened in a browser, and what its picture shows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Browser, Page

from flexura.pages.viewer import page as page_of
from helpers.browser import DESKTOP, Opened, pixels
from helpers.two_boxes import two_boxes


@contextmanager
def viewer(browser: Browser, path: Path, scene: dict[str, Any] | None = None, **context: Any) -> Iterator[Page]:
    """The page of a scene, the two boxes unless given, that stands still unless asked otherwise.

    Holds, once left, that no script failed and that nothing was asked of a network.
    """
    body = '<main><h1>two boxes</h1><figure data-viewer="own"></figure></main>'
    path.write_text(page_of("two boxes", body, "viewer", {"viewer": {"own": scene or two_boxes()}}), encoding="utf-8")
    with browser.new_context(**{"viewport": DESKTOP, "reduced_motion": "reduce", **context}) as own:
        opened = Opened(own)
        opened.page.goto(path.as_uri())
        opened.page.wait_for_selector(".fx-motion", state="attached")
        settle(opened.page)
        yield opened.page
        assert opened.errors == [] and opened.outside == []


def settle(page: Page) -> None:
    """Wait until what was asked for is drawn."""
    twice = "requestAnimationFrame(() => requestAnimationFrame(done))"
    page.evaluate(f"() => new Promise(done => setTimeout(() => {twice}, 60))")


def press(page: Page, *keys: str) -> None:
    """Press keys with the picture in focus."""
    page.locator(".fx-picture > canvas").first.focus()
    for key in keys:
        page.keyboard.press(key)
    settle(page)


def front(page: Page) -> None:
    """At rest, from the front, in parallel projection, without labels: x to the right, z up, at one scale."""
    page.get_by_role("radio", name="undeformed").check()
    page.get_by_role("checkbox", name="warning marks").uncheck()
    press(page, "o", "1")


TOP = 100


def picture(page: Page) -> np.ndarray:
    """The picture below the title (TOP pixels), without the triad."""
    own = pixels(page.locator(".fx-picture").screenshot())[TOP:]
    own[-100:, :100] = own[0, 0]
    return own


def like(image: np.ndarray, colour: str) -> np.ndarray:
    """Where an image shows a colour in some light: its hue, and neither too dark nor pale."""
    wanted = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], dtype=float)
    wanted /= np.linalg.norm(wanted)
    size = np.linalg.norm(image, axis=-1)
    return (image @ wanted / np.maximum(size, 1) > 0.985) & (size > 90)


def extent(mask: np.ndarray) -> tuple[int, int, int, int]:
    """First and last column, first and last row of what is found; fails where nothing is."""
    columns, rows = (np.flatnonzero(mask.sum(axis=axis) > 5) for axis in (0, 1))
    assert columns.size and rows.size, "not found in the picture"
    return int(columns[0]), int(columns[-1]), int(rows[0]), int(rows[-1])


def middle(mask: np.ndarray) -> tuple[float, float]:
    """The middle of what is found, in pixels of the picture with its title."""
    left, right, top, bottom = extent(mask)
    return (left + right) / 2, (top + bottom) / 2 + TOP


def changed(a: np.ndarray, b: np.ndarray) -> int:
    """How many pixels differ plainly."""
    return int((np.abs(a - b).max(axis=-1) > 40).sum())
