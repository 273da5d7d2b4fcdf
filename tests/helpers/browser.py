"""Pages in Debian's chromium, without a display and without a network."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

ROOT = Path(__file__).parents[2]
SCREENSHOTS = ROOT / "out" / "screenshots"
AXE = ROOT / "src" / "flexura" / "pages" / "web" / "node_modules" / "axe-core" / "axe.min.js"
CHROMIUM = shutil.which("chromium")
SOFTWARE_WEBGL = ("--no-sandbox", "--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader")
"""Without these pages are blank here, and tests would pass on nothing."""
QUIET = ("--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run")
DESKTOP, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}


@contextmanager
def started(*flags: str) -> Iterator[Browser]:
    """A browser with WebGL in software, or with other flags than these."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*(flags or SOFTWARE_WEBGL), *QUIET])
        try:
            yield browser
        finally:
            browser.close()


class Opened:
    """A page with what it asked the network for, and the errors of its scripts."""

    def __init__(self, context: BrowserContext) -> None:
        self.asked: list[str] = []
        self.errors: list[str] = []
        self.page: Page = context.new_page()
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda said: self.errors.append(said.text) if said.type == "error" else None)

    @property
    def outside(self) -> list[str]:
        """Requests that leave the file and its own data."""
        return [url for url in self.asked if not url.startswith(("file:", "data:", "blob:", "about:"))]


def pixels(png: bytes) -> np.ndarray:
    """A screenshot as an array (height, width, 3), 0 to 255."""
    return np.round(255 * imread(io.BytesIO(png), format="png")[..., :3]).astype(int)


def shot(page: Page, name: str) -> np.ndarray:
    """A screenshot of the window, kept as an artefact, as an array."""
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    return pixels(page.screenshot(path=SCREENSHOTS / f"{name}.png"))


def serious_findings(page: Page) -> list[str]:
    """What axe-core finds serious or critical on a page, a line each; skips where it is not installed."""
    if not AXE.is_file():
        pytest.skip("no axe-core: `make viewer` installs it")
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("() => axe.run().then(found => found.violations)")
    return [
        f"{own['id']}: {own['help']}: {own['nodes'][0]['html']}"
        for own in found
        if own["impact"] in ("serious", "critical")
    ]
