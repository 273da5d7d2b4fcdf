"""The site as it is built: without warnings, of itself alone, every link and anchor there, readable by all."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlparse

import pytest

from flexura.cli.app import COMMANDS
from helpers.browser import DESKTOP, PHONE, serious_findings
from helpers.doc_snippets import ROOT

pytestmark = pytest.mark.slow

LOOKED_AT = (
    *("index", "start/first", "start/numbers", "how-to/index", "gallery/index", "gallery/plot_parallelogram"),
    *("studies", "file-format", "reference/commands", "reference/python/questions", "theory/statics"),
)
REPORTED = "parallelogram"


class Read(HTMLParser):
    """What a page names: its anchors, links, what it loads, and pictures without words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors, self.links, self.loads, self.wordless = set[str](), set[str](), set[str](), list[str]()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        own = dict(attrs)
        self.anchors |= {value for key in ("id", "name") if (value := own.get(key))}
        if tag == "a" and own.get("href"):
            self.links.add(str(own["href"]))
        if (tag in ("img", "script") and own.get("src")) or (tag == "link" and own.get("rel") == "stylesheet"):
            self.loads.add(str(own.get("src") or own.get("href")))
        if tag == "img" and (own.get("alt") is None or str(own["alt"]).startswith("plot ")):
            self.wordless.append(str(own.get("src")))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built anew with warnings as errors, with the report of one mechanism."""
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "sphinx",
            "-W",
            "--keep-going",
            "-q",
            "-E",
            "-b",
            "html",
            "-d",
            folder / "d",
            "docs",
            folder / "html",
        ],
        cwd=ROOT,
        env={**os.environ, "FLEXURA_REPORTS": REPORTED},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-4000:]
    return folder / "html"


@cache
def read(page: Path) -> Read:
    return Read(page.read_text(encoding="utf-8"))


def pages(site: Path) -> list[Path]:
    """All pages that Sphinx has made."""
    return [page for page in sorted(site.rglob("*.html")) if not page.name.endswith(".report.html")]


def test_links_and_anchors_are_there(site: Path) -> None:
    broken = []
    for page in pages(site):
        for link in read(page).links:
            parts = urlparse(link)
            if parts.scheme or parts.netloc:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            anchor = unquote(parts.fragment)
            missing = not target.exists() or (
                anchor
                and target.suffix == ".html"
                and anchor not in read(target).anchors
                and not (
                    anchor.startswith("mjx-eqn:") and rf"\tag{{{anchor[8:]}}}" in target.read_text(encoding="utf-8")
                )
            )
            if missing:
                broken.append(f"{page.relative_to(site)}: {link}")
    assert not broken


def test_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    elsewhere = {f"{page.name}: {own}" for page in pages(site) for own in read(page).loads if urlparse(own).netloc}
    assert not elsewhere


def test_pictures_have_words(site: Path) -> None:
    assert not {page.name: own for page in pages(site) if (own := read(page).wordless)}


def test_the_search_knows_the_words_of_users(site: Path) -> None:
    index = (site / "searchindex.js").read_text(encoding="utf-8").lower()
    assert all(re.search(rf'"?{word}"?:', index) for word in ("parallelogram", "leaf", "piezo", "stroke"))


def test_commands_are_there_with_their_options(site: Path) -> None:
    page = (site / "reference" / "commands.html").read_text(encoding="utf-8")
    for name in COMMANDS:
        section = page.split(f'<section id="flexura-{name}">')[1].split("</section>")[0]
        assert f'<span class="pre">flexura</span> <span class="pre">{name}</span>' in section
        assert section.count("<tr") != 1 and "None" not in section
    assert "--keep-below FREQUENCY" in re.sub(r"<[^>]*>", "", page)


def test_mechanisms_of_the_gallery_have_their_numbers(site: Path) -> None:
    for page in (site / "gallery").glob("plot_*.html"):
        text = page.read_text(encoding="utf-8")
        assert re.search(r"<th[^>]*>published</th>", text) and "differs by" not in text
    assert (site / "gallery" / f"{REPORTED}.report.html").is_file()


@pytest.mark.parametrize("name", LOOKED_AT)
def test_pages_are_readable_by_all_at_two_widths(site: Path, browser, name: str) -> None:
    found = []
    for viewport in (DESKTOP, PHONE):
        for scheme in ("light", "dark"):
            with browser.new_context(viewport=viewport, color_scheme=scheme) as context:
                page = context.new_page()
                page.goto((site / f"{name}.html").as_uri())
                page.wait_for_load_state("load")
                found += [f"{viewport['width']} {scheme}: {own}" for own in serious_findings(page)]
                wide = page.evaluate(
                    "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
                )
                found += [f"{viewport['width']} {scheme}: wider than the window by {wide}"] if wide > 1 else []
    assert not found, "\n".join(found)
