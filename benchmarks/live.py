"""From a moved slider to its numbers and to the picture that shows it, on the live page, in Debian's chromium.

    python benchmarks/live.py [FILE] [--parameter leaf_thickness] [--moves 200] [--playing] [--hardware]

The server is asked alone first, without a browser, for one design after another: from a message to its numbers, to its
picture, and until all is told of it. Then a slider of the page is moved each 150 ms, and measured is, by the clock of
the browser, from the event of the input to the numbers, to the picture, to the frame that draws it and to its end; and
what the server works on. Without --hardware frames are drawn in software, on the processor that the server works on,
too; --playing lets the mode vibrate meanwhile.
"""  # fmt: skip

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from helpers.browser import DESKTOP, SOFTWARE_WEBGL, started
from helpers.live_page import served, talk

RPR = Path(__file__).parents[1] / "examples" / "rpr" / "rpr.yaml"
MEASURE, TO_NUMBERS = "flexura slider to picture", "flexura slider to numbers"
MOVE = """([name, position]) => {
  const own = document.querySelector(`[data-name="${name}"] input[type="range"]`);
  own.value = String(position);
  own.dispatchEvent(new Event("input", {bubbles: true}));
}"""
FOUND = """name => performance.getEntriesByName(name).map(own => ({whole: own.duration, ...own.detail}))"""


def answered(file: Path, parameter: str, moves: int) -> list[dict[str, float]]:
    """Milliseconds from messages to answers of the server, each message once all is told of the one before."""
    found = []
    with served(file) as own, talk(own) as (page, opened):
        low, high = next((own["low"], own["high"]) for own in opened["sliders"] if own["name"] == parameter)
        for k in range(moves):
            begun = time.perf_counter()
            page.ask({parameter: low + (high - low) * (0.2 + 0.6 * (k + 1) / moves)}, modes=opened["modes"])
            took = {}
            for kind in ("numbers", "picture", "settled"):
                page.until(kind)
                took[f"message to {kind}"] = 1e3 * (time.perf_counter() - begun)
            found.append(took)
    return found


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
        numbers = {own["serial"]: own["whole"] for own in page.evaluate(FOUND, TO_NUMBERS)}
    return [
        {
            **{f"server: {name}": own["server"][name] for name in own["server"]},
            "slider to numbers": numbers.get(own["serial"], np.nan),
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
    asked = answered(own.file, own.parameter, own.moves)
    found = measured(own.file, own.parameter, own.moves, own.playing, flags)
    print(f"{own.file.name}, {own.parameter}: {len(found)} pictures of {own.moves} moves")
    print(f"{'ms':28s}{'median':>8s}{'95 %':>8s}")
    for rows in (asked, found):
        for name in rows[0]:
            values = [each[name] for each in rows]
            print(f"{name:28s}{np.nanmedian(values):8.1f}{np.nanpercentile(values, 95):8.1f}")


if __name__ == "__main__":
    main()
