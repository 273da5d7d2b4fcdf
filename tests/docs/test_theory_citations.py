"""Equations of the theory page are numbered in order, and the code cites only those that exist."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
THEORY = ROOT / "docs" / "theory.md"
CITATION = re.compile(r"theory,?\s+eqs?\.\s+((?:\d+)(?:(?:\s*[-,]\s*|\s+and\s+)\d+)*)")


def tags() -> list[int]:
    """Numbers of the equations in the order of the page."""
    return [int(n) for n in re.findall(r"\\tag\{(\d+)\}", THEORY.read_text(encoding="utf-8"))]


def cited(text: str) -> set[int]:
    """Numbers of the equations that a text cites as `theory eq. 3` or `theory eqs. 3-5, 7`."""
    found: set[int] = set()
    for numbers in CITATION.findall(text):
        for part in re.split(r",|and", numbers):
            first, _, last = part.partition("-")
            found |= set(range(int(first), int(last or first) + 1))
    return found


def test_equations_are_numbered_in_order():
    assert tags() == list(range(1, len(tags()) + 1))


def test_code_cites_existing_equations():
    known = set(tags())
    wrong, count = {}, 0
    for path in sorted((ROOT / "src").rglob("*.py")):
        numbers = cited(" ".join(path.read_text(encoding="utf-8").split()))
        count += len(numbers)
        if numbers - known:
            wrong[path.name] = sorted(numbers - known)
    assert not wrong
    assert count >= 10


def test_pages_cite_existing_equations():
    own = set(re.findall(r"\((\d+)\)", THEORY.read_text(encoding="utf-8")))
    assert {n for n in map(int, own) if n < 1000} <= set(tags())


def test_citations_are_read():
    assert cited("as in theory eq. 7, and theory eqs. 3-5, 9 and 12.") == {3, 4, 5, 7, 9, 12}
