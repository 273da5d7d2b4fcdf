"""Photograph the pages in chromium: python docs/figures/page_pictures.py."""

import re
import shutil
import subprocess
import sys
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
    command = [sys.executable, "-m", "flexura", "live", str(EXAMPLES / "rpr" / "rpr_piezo.yaml"), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        found = re.search(r"http://\S+", server.stdout.readline())
        try:
            assert found is not None, "flexura live tells its address first"
            photograph(page, found.group(), "live_rpr")
        finally:
            server.terminate()


if __name__ == "__main__":
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=SOFTWARE_WEBGL)
        window = browser.new_page(viewport={"width": 1280, "height": 800})
        report(window)
        live(window)
        browser.close()
