"""Scenes that are tiny, huge, far away, empty, or of many parts are shown; broken ones say so."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
import pytest

from flexura.pages.viewer import page as page_of
from helpers.browser import Opened
from helpers.two_boxes import BODY, FLEXURE, buffer, part, two_boxes
from helpers.viewer_page import extent, front, like, picture, press, settle


def scaled(by: float, to: tuple[float, float, float] = (0, 0, 0)) -> dict[str, Any]:
    """The two boxes larger or smaller, and elsewhere."""
    scene = two_boxes()
    own = np.frombuffer(zlib.decompress(base64.b64decode(scene["points"]["data"])), "<f4").reshape(-1, 3)
    scene["points"] = buffer(own.astype(float) * by + to, "f32")
    scene["bounds"] = (np.array(scene["bounds"]) * by + to).tolist()
    scene["size"] *= by
    for motion in scene["motions"]:
        motion["displacement"]["scale"] *= by
    return scene


@pytest.mark.parametrize("by", [1e-6, 1e4])
def test_size_changes_nothing_but_numbers(show, by):
    page = show(scaled(by))
    front(page)
    image = picture(page)
    blue, orange = extent(like(image, BODY)), extent(like(image, FLEXURE))
    assert (blue[1] - blue[0]) == pytest.approx(orange[1] - orange[0], rel=0.01)
    assert orange[1] - blue[0] > 0.5 * image.shape[1]
    page.get_by_role("radio", name="mode 1").check()
    settle(page)
    raised = orange[2] - extent(like(picture(page), FLEXURE))[2]
    assert raised / (orange[1] - orange[0] + 1) == pytest.approx(20 / 45, abs=0.02)


def test_far_from_the_origin(show):
    page = show(scaled(1.0, (40.0, -7.0, 3.0)))
    front(page)
    image = picture(page)
    blue, orange = extent(like(image, BODY)), extent(like(image, FLEXURE))
    assert abs((orange[1] + blue[0]) / 2 - image.shape[1] / 2) < 4
    press(page, "x")
    assert page.get_by_text("x = 40000 mm").is_visible()


def test_scaled_up_a_hundredfold_nothing_is_clipped(show):
    """At a hundred times its scale the box of mode 1 is 20 sizes further up: all of it is there to be looked for."""
    page = show()
    front(page)
    page.get_by_role("radio", name="mode 2").check()
    page.get_by_role("slider", name="scale of the displacement").fill("2")
    settle(page)
    assert like(picture(page), BODY).sum() > 5000


@pytest.mark.parametrize("what", ["motions", "parts", "everything"])
def test_what_is_empty_is_shown_as_such(show, what):
    scene = two_boxes() | {"motions": [], "sequences": [], "marks": []}
    if what != "motions":
        scene |= {"parts": [], "kinds": []}
    if what == "everything":
        scene |= {"size": 0.0, "bounds": [[0, 0, 0], [0, 0, 0]], "points": buffer(np.empty((0, 3)), "f32")}
        scene |= {name: buffer(np.empty((0, n)), "u32") for name, n in (("triangles", 3), ("lines", 2), ("dots", 1))}
    page = show(scene)
    assert page.get_by_role("radio", name="undeformed").is_checked()
    assert page.get_by_role("button", name="play").is_disabled()
    if what == "motions":
        assert like(picture(page), BODY).sum() > 5000
    press(page, "n", "]", "c", "x", "f", " ", "ArrowLeft")


def test_many_parts_are_few_draw_calls(show):
    scene = two_boxes()
    count = 20000
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]]) * 4e-4
    at = np.stack([np.arange(count) % 200, np.zeros(count), np.arange(count) // 200], axis=-1) * 5e-4 - [0.05, 0, 0.02]
    points = (at[:, None] + corners).reshape(-1, 3)
    scene |= {
        "points": buffer(points, "f32"),
        "triangles": buffer(np.arange(3 * count).reshape(-1, 3), "u32"),
        "lines": buffer(np.empty((0, 2)), "u32"),
        "dots": buffer(np.empty(0), "u32"),
        "parts": [part(f"cell {k}", "body", [], triangles=[k, 1]) for k in range(count)],
        "motions": [],
        "sequences": [],
        "marks": [],
    }
    page = show(scene)
    front(page)
    assert like(picture(page), BODY).sum() > 20000
    calls = page.evaluate(
        """() => new Promise(done => {
          let calls = 0;
          const gl = WebGL2RenderingContext.prototype, real = gl.drawElements;
          gl.drawElements = function (...own) { calls += 1; return real.apply(this, own); };
          const press = new KeyboardEvent("keydown", { key: "f", bubbles: true });
          document.querySelector(".fx-picture > canvas").dispatchEvent(press);
          setTimeout(() => { gl.drawElements = real; done(calls); }, 1500);
        })"""
    )
    assert 1 <= calls <= 12


def test_a_scene_that_cannot_be_read_says_so(browser, tmp_path):
    scene = two_boxes()
    scene["points"]["shape"] = [7, 3]
    path = tmp_path / "page.html"
    body = '<main><figure data-viewer="own"><p>what stood here</p></figure></main>'
    path.write_text(page_of("two boxes", body, "viewer", {"viewer": {"own": scene}}), encoding="utf-8")
    with browser.new_context() as context:
        own = Opened(context)
        own.page.goto(path.as_uri())
        own.page.locator(".fx-why").wait_for()
        assert "a buffer of shape 7,3 holds" in own.page.locator(".fx-why").inner_text()
        assert own.page.get_by_text("what stood here").is_visible()
