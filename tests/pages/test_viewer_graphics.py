"""The viewer where graphics are missing, go away, or are many."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from flexura.pages.viewer import page as page_of
from helpers.browser import CHROMIUM, DESKTOP, Opened
from helpers.two_boxes import BODY, two_boxes
from helpers.viewer_page import like, picture, settle, viewer

PIXEL = (
    "data:image/png;base64,"
    + base64.b64encode(
        bytes.fromhex(
            "89504e470d0a1a0a0000000d4948445200000001000000010802000000907753de0000000c49444154789c63606060000000040001f61738550000000049454e44ae426082"
        )
    ).decode()
)


@pytest.fixture
def without_webgl(browser) -> Iterator[Browser]:
    own = browser.browser_type.launch(
        executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu", "--disable-3d-apis"]
    )
    yield own
    own.close()


def test_without_webgl_a_still_picture_says_why(without_webgl, tmp_path):
    scene = two_boxes() | {"picture": PIXEL}
    body = '<main><h1>two boxes</h1><figure data-viewer="own"></figure></main>'
    path = tmp_path / "page.html"
    path.write_text(page_of("two boxes", body, "viewer", {"viewer": {"own": scene}}), encoding="utf-8")
    with without_webgl.new_context() as context:
        own = Opened(context)
        own.page.goto(path.as_uri())
        why = own.page.locator(".fx-why")
        why.wait_for()
        assert "no WebGL 2" in why.inner_text()
        image = own.page.get_by_alt_text("picture of two boxes")
        assert image.evaluate("own => own.complete && own.naturalWidth") == 1
        assert own.page.locator("canvas").count() == 0 and own.outside == []


def lose(page: Page, what: str) -> None:
    """Take the graphics of the viewer away, or give them back."""
    page.evaluate(
        """what => {
          const canvas = document.querySelector(".fx-picture > canvas");
          window.own ??= canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
          window.own[what]();
        }""",
        what,
    )
    page.wait_for_timeout(200)


def test_graphics_that_go_away_come_back(browser, tmp_path):
    with viewer(browser, tmp_path / "page.html", two_boxes() | {"picture": PIXEL}) as page:
        assert like(picture(page), BODY).sum() > 5000
        lose(page, "loseContext")
        assert page.get_by_text("took its 3-D graphics away").is_visible()
        assert page.get_by_alt_text("picture of two boxes").is_visible()
        lose(page, "restoreContext")
        settle(page)
        assert not page.get_by_text("took its 3-D graphics away").is_visible()
        assert like(picture(page), BODY).sum() > 5000


def many(path: Path, count: int) -> str:
    scene = two_boxes()
    figures = "".join(f'<figure data-viewer="{k}"></figure>' for k in range(count))
    path.write_text(
        page_of("many", f"<main>{figures}</main>", "viewer", {"viewer": {str(k): scene for k in range(count)}}),
        encoding="utf-8",
    )
    return path.as_uri()


LOST = """() => [...document.querySelectorAll(".fx-picture > canvas:first-child")].map(
  own => own.getContext("webgl2").isContextLost())"""


@pytest.mark.slow
def test_viewers_out_of_sight_give_their_graphics_back(browser, tmp_path):
    """Browsers keep some 16 contexts: of 20 viewers none may stay dark once it is looked at."""
    with browser.new_context(viewport=DESKTOP, reduced_motion="reduce") as context:
        own = Opened(context)
        own.page.goto(many(tmp_path / "many.html", 20))
        own.page.locator(".fx-viewer").nth(19).wait_for()
        own.page.wait_for_function(
            f"() => (lost => lost.length === 20 && !lost[0] && lost.slice(4).every(Boolean))(({LOST})())"
        )
        for k in (19, 7, 0):
            figure = own.page.locator(".fx-picture").nth(k)
            figure.scroll_into_view_if_needed()
            own.page.wait_for_function(f"k => !({LOST})()[k]", arg=k)
            own.page.locator(".fx-still-view").nth(k).wait_for(state="hidden")
        assert sum(not lost for lost in own.page.evaluate(LOST)) < 8


COUNTED = """() => {
  window.drawn = 0;
  const gl = WebGL2RenderingContext.prototype;
  const real = gl.drawElements;
  gl.drawElements = function (...own) { window.drawn += 1; return real.apply(this, own); };
}"""
REST = """() => new Promise(done => {
  let [seen, still, before] = [0, 0, window.drawn];
  const look = () => {
    still = window.drawn === before ? still + 1 : 0;
    before = window.drawn;
    if (still >= 30 || ++seen > 600) done(still); else requestAnimationFrame(look);
  };
  look();
})"""
"""Frames in a row without anything drawn: thirty, or fewer where something is drawn again and again."""


def test_nothing_is_drawn_while_nothing_changes(show):
    page = show()
    page.evaluate(COUNTED)
    assert page.evaluate(REST) >= 30
    before = page.evaluate("window.drawn")
    page.get_by_role("button", name="play").click()
    page.wait_for_function("before => window.drawn > before + 10", arg=before)


def test_on_paper_the_static_picture_stands_again(browser, tmp_path):
    path = tmp_path / "page.html"
    body = f'<main><figure data-viewer="own"><img src="{PIXEL}" alt="static"></figure></main>'
    path.write_text(page_of("two boxes", body, "viewer", {"viewer": {"own": two_boxes()}}), encoding="utf-8")
    with browser.new_context(viewport=DESKTOP, reduced_motion="reduce") as context:
        own = Opened(context)
        own.page.goto(path.as_uri())
        own.page.locator(".fx-viewer").wait_for()
        static = own.page.get_by_alt_text("static")
        assert not static.is_visible()
        own.page.emulate_media(media="print")
        assert static.is_visible() and not own.page.locator(".fx-viewer").is_visible()
