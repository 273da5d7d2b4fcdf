"""From a moved slider to the picture that shows it, on the live page, in Debian's chromium.

    python benchmarks/live.py [FILE] [--parameter leaf_thickness] [--moves 200] [--playing] [--hardware]

Measured is from the event of the input to the end of the frame in which the picture is drawn, by the clock of the
browser, with one move after another each 150 ms; and of it what the server works on, until the answer has arrived, and
until the frame begins. Without --hardware frames are drawn in software, on the processor that the server works on, too;
--playing lets the mode vibrate meanwhile.
"""  # fmt: skip

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from helpers.browser import DESKTOP, SOFTWARE_WEBGL, started
from helpers.live_page import served

RPR = Path(__file__).parents[1] / "examples" / "rpr" / "rpr.yaml"
MEASURE = "flexura slider to picture"
MOVE = """([name, position]) => {
  const own = document.querySelector(`[data-name="${name}"] input[type="range"]`);
  own.value = String(position);
  own.dispatchEvent(new Event("input", {bubbles: true}));
}"""
FOUND = """name => performance.getEntriesByName(name).map(own => ({whole: own.duration, ...own.detail}))"""


def measured(file: Path, parameter: str, moves: int, playing: bool, flags: tuple[str, ...]) -> list[dict[str, float]]:
    """Milliseconds of each move, by what they are spent on."""
    with served(file) as own, started(*flags) as browser, browser.new_context(viewport=DESKTOP) as context:
        page = context.new_page()
        page.emulate_media(reduced_motion="no-preference" if playing else "reduce")
        page.goto(own.url)
        page.wait_for_selector(".live-viewer canvas", timeout=60_000)
        page.wait_for_timeout(3000)
        page.evaluate("name => performance.clearMeasures(name)", MEASURE)
        for k in range(moves):
            page.evaluate(MOVE, [parameter, 200 + 600 * (k + 1) // moves])
            page.wait_for_timeout(150)
        found = page.evaluate(FOUND, MEASURE)
    return [
        {
            **{f"server: {name}": own["server"][name] for name in own["server"]},
            "to the answer": own["arrived"],
            "to the frame": own["moved"],
            "slider to picture": own["whole"],
        }
        for own in found
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure how soon the live page follows.")
    parser.add_argument("file", nargs="?", type=Path, default=RPR)
    parser.add_argument("--parameter", default="leaf_thickness")
    parser.add_argument("--moves", type=int, default=200)
    parser.add_argument("--playing", action="store_true", help="while the mode vibrates")
    parser.add_argument("--hardware", action="store_true", help="draw with the graphics card, if there is one")
    own = parser.parse_args()
    flags = ("--no-sandbox", "--enable-gpu") if own.hardware else SOFTWARE_WEBGL
    found = measured(own.file, own.parameter, own.moves, own.playing, flags)
    print(f"{own.file.name}, {own.parameter}: {len(found)} pictures of {own.moves} moves")
    print(f"{'ms':28s}{'median':>8s}{'95 %':>8s}")
    for name in found[0]:
        values = [each[name] for each in found]
        print(f"{name:28s}{np.median(values):8.1f}{np.percentile(values, 95):8.1f}")


if __name__ == "__main__":
    main()
