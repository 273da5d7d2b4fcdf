"""How smoothly the viewer moves: frames a second, draw calls and JavaScript time of a frame, in Debian's chromium.

    python benchmarks/viewer.py [--triangles 100000] [--parts 1000] [--seconds 5]

The scene is a field of boxes that vibrate. Where the browser draws in software, as it does without a graphics card,
frames a second say how quick that is; JavaScript time, until all commands of a frame are submitted, is the viewer's.
"""  # fmt: skip

from __future__ import annotations

import argparse
import itertools
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from flexura.pages.viewer import page
from helpers.two_boxes import CORNERS, QUADS, SIZE, buffer, motion, part, two_boxes

FLAGS = ("--no-sandbox", "--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader")
COUNTED = """(() => {
  window.counted = { frames: 0, calls: 0, milliseconds: [] };
  const real = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = act => real(now => {
    const calls = counted.calls, start = performance.now();
    act(now);
    if (counted.calls > calls) { counted.frames += 1; counted.milliseconds.push(performance.now() - start); }
  });
  const gl = WebGL2RenderingContext.prototype;
  for (const name of ["drawElements", "drawArrays", "drawElementsInstanced", "drawArraysInstanced"]) {
    const draw = gl[name];
    gl[name] = function (...own) { counted.calls += 1; return draw.apply(this, own); };
  }
})()"""
RESET = "() => { counted.frames = counted.calls = 0; counted.milliseconds = []; counted.start = performance.now(); }"
FOUND = """() => ({ frames: counted.frames, calls: counted.calls, seconds: (performance.now() - counted.start) / 1000,
  milliseconds: counted.milliseconds.sort((a, b) => a - b) })"""


def field(triangles: int, parts: int) -> dict[str, Any]:
    """Boxes in a square, and a wave through them."""
    count = triangles // 12
    side = int(np.ceil(np.sqrt(count)))
    at = np.stack([np.arange(count) % side, np.arange(count) // side, np.zeros(count)], axis=-1) / side - 0.5
    points = ((at[:, None] + CORNERS * 0.6 / side) * SIZE).reshape(-1, 3)
    faces = np.array([[q[a], q[b], q[c]] for q in QUADS for a, b, c in ((0, 1, 2), (0, 2, 3))])
    cells = (faces + 8 * np.arange(count)[:, None, None]).reshape(-1, 3)
    wave = np.zeros_like(points)
    wave[:, 2] = 0.02 * np.sin(points[:, 0] / SIZE * 6)
    ends = np.linspace(0, count, min(parts, count) + 1).astype(int)
    kinds = ("body", "flexure")
    return two_boxes("field") | {
        "bounds": [[-SIZE / 2, -SIZE / 2, -0.02], [SIZE / 2, SIZE / 2, 0.02]],
        "points": buffer(points, "f32"),
        "triangles": buffer(cells, "u32"),
        "lines": buffer(np.empty((0, 2)), "u32"),
        "dots": buffer(np.empty(0), "u32"),
        "parts": [
            part(f"part {k}", kinds[k % 2], [], triangles=[12 * int(a), 12 * int(b - a)])
            for k, (a, b) in enumerate(itertools.pairwise(ends))
        ],
        "motions": [motion("wave", wave, title="wave")],
        "sequences": [],
        "marks": [],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure how smoothly the viewer moves.")
    parser.add_argument("--triangles", type=int, default=100_000)
    parser.add_argument("--parts", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--hardware", action="store_true", help="draw with the graphics card, if there is one")
    own = parser.parse_args()
    body = '<main><figure data-viewer="own"></figure></main>'
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = Path(folder) / "page.html"
        path.write_text(page("field", body, "viewer", {"viewer": {"own": field(own.triangles, own.parts)}}))
        flags = ["--no-sandbox"] if own.hardware else list(FLAGS)
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=flags)
        window = browser.new_page(viewport={"width": 1280, "height": 800})
        window.add_init_script(COUNTED)
        window.goto(path.as_uri())
        window.locator(".fx-motion").first.wait_for()
        window.wait_for_timeout(2000)
        window.evaluate(RESET)
        window.wait_for_timeout(1000 * own.seconds)
        found = window.evaluate(FOUND)
        browser.close()
    times = found["milliseconds"]
    frames = found["frames"]
    print(f"{own.triangles} triangles in {own.parts} parts, 1280 x 800")
    print(f"  {frames / found['seconds']:.1f} frames a second, {found['calls'] / frames:.1f} draw calls a frame")
    print(f"  JavaScript a frame: median {times[len(times) // 2]:.2f} ms, at most {times[-1]:.2f} ms")


if __name__ == "__main__":
    main()
