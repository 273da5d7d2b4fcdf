"""Photograph the pages in chromium: python docs/figures/page_pictures.py."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import atan2
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Page, sync_playwright

import flexura as fx

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"
SOFTWARE_WEBGL = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader"]


def photograph(page: Page, address: str, name: str) -> None:
    """Open an address, let the scene be drawn, and keep what the window shows."""
    page.goto(address)
    page.wait_for_selector("canvas")
    page.wait_for_timeout(4000)
    page.screenshot(path=HERE / f"{name}.png")


def report(page: Page) -> None:
    """The first screen of the report on the paper's platform with its stacks."""
    file = EXAMPLES / "rpr" / "rpr_piezo.yaml"
    with TemporaryDirectory() as folder:
        out = Path(folder) / "report.html"
        fx.report(fx.load(file), file=file, out=out)
        photograph(page, out.as_uri(), "report_rpr")


def live(page: Page) -> None:
    """The live page of the same platform."""
    with served(EXAMPLES / "rpr" / "rpr_piezo.yaml") as address:
        photograph(page, address, "live_rpr")


def picks(page: Page) -> None:
    """The live page of the platform's hammer test, simulated, with poles that are picked."""
    test = fx.virtual_test(fx.load(EXAMPLES / "rpr" / "rpr_test.yaml")).measurement
    corners = {c.position for frf in test.frfs for c in frf.outputs if c.position is not None}
    around = sorted(corners, key=lambda at: atan2(at[1], at[0]))
    outline = (*around, around[0])
    with TemporaryDirectory() as folder:
        data = replace(test, recordings=(), traces=(outline,))
        with served(fx.write_measurement(data, Path(folder) / "platform.uff")) as address:
            page.set_viewport_size({"width": 1280, "height": 1000})
            page.goto(address)
            page.wait_for_selector("#live-status:has-text('by themselves')")
            page.fill("#test-picks input", "7.468@40, 8.375@40, 11.76@30, 18.1@36, 20.33@44, 21.46@20")
            page.press("#test-picks input", "Enter")
            page.wait_for_selector("#live-status:has-text('6 modes, picked')")
            page.wait_for_timeout(4000)
            page.screenshot(path=HERE / "live_picks.png")


@contextmanager
def served(file: Path) -> Iterator[str]:
    """The address of the live page of a file."""
    command = [sys.executable, "-m", "flexura", "live", str(file), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        found = re.search(r"http://\S+", server.stdout.readline())
        try:
            assert found is not None, "flexura live tells its address first"
            yield found.group()
        finally:
            server.terminate()


if __name__ == "__main__":
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=SOFTWARE_WEBGL)
        window = browser.new_page(viewport={"width": 1280, "height": 800})
        report(window)
        live(window)
        picks(window)
        browser.close()
