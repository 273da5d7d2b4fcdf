"""Equations of the theory pages are numbered in order, and the code cites only those that exist.

Those of docs/theory.md are 1, 2, ..., those of a page in docs/theory/ have a letter: F1, F2, ... A page may go on where
another one with the same letter, or with none, has ended.
"""

import re
from pathlib import Path

from helpers.over import over

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "docs" / "theory.md", *sorted((ROOT / "docs" / "theory").glob("*.md"))]
NUMBER = r"[A-Z]?\d+"
CITATION = re.compile(rf"theory,?\s+eqs?\.\s+({NUMBER}(?:(?:\s*[-,]\s*|\s+and\s+){NUMBER})*)")


def tags(page: Path) -> list[str]:
    """Numbers of the equations in the order of the page."""
    return re.findall(rf"\\tag\{{({NUMBER})\}}", page.read_text(encoding="utf-8"))


def cited(text: str) -> set[str]:
    """Numbers of the equations that a text cites as `theory eq. 3` or `theory eqs. F3-F5, 7`."""
    found: set[str] = set()
    for numbers in CITATION.findall(text):
        for part in re.split(r",|and", numbers):
            first, _, last = (number.strip() for number in part.partition("-"))
            letter = first[:1] if first[:1].isalpha() else ""
            start, stop = (int(number.lstrip(letter)) for number in (first, last or first))
            found |= {f"{letter}{k}" for k in range(start, stop + 1)}
    return found


def letter_of(page: Path) -> str:
    """The letter of a page's equations."""
    return tags(page)[0].rstrip("0123456789")


def numbers(page: Path) -> list[int]:
    """Numbers of its equations without the letter."""
    return [int(tag.removeprefix(letter_of(page))) for tag in tags(page)]


@over("letter", sorted({letter_of(page) for page in PAGES}))
def test_equations_are_numbered_in_order(letter):
    """From page to page, each of which goes on where another one has ended."""
    pages = sorted(numbers(page) for page in PAGES if letter_of(page) == letter)
    assert [number for page in pages for number in page] == list(range(1, 1 + sum(map(len, pages))))


def test_code_cites_existing_equations():
    known = {number for page in PAGES for number in tags(page)}
    wrong, count = {}, 0
    for path in sorted((ROOT / "src").rglob("*.py")):
        numbers = cited(" ".join(path.read_text(encoding="utf-8").split()))
        count += len(numbers)
        if numbers - known:
            wrong[path.name] = sorted(numbers - known)
    assert not wrong
    assert count >= 10


@over("page", PAGES)
def test_pages_cite_existing_equations(page):
    own = set(re.findall(rf"\(({NUMBER})\)", page.read_text(encoding="utf-8")))
    known = {number for other in PAGES for number in tags(other)}
    assert {n for n in own if not (n.isdigit() and int(n) >= 1000)} <= known


def test_citations_are_read():
    text = "as in theory eq. 7, and theory eqs. 3-5, 9 and 12; theory eqs. F3-F5 and R1."
    assert cited(text) == {"3", "4", "5", "7", "9", "12", "F3", "F4", "F5", "R1"}
