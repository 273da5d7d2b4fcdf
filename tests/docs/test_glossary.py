"""Symbols of the glossary are those of the equations that it names."""

import re

from helpers.doc_snippets import ROOT
from helpers.over import over

DOCS = ROOT / "docs"
PAGE = (DOCS / "glossary.md").read_text(encoding="utf-8")
ROW = re.compile(
    r"^\| (.+?) \| (.+?) \| (.+) \| (?:`.*`)? ?\| \[eq\. (\w+)\]\(([\w/.-]+)(?:#([\w-]+))?\) \|$", re.MULTILINE
)
SYMBOLS = PAGE[PAGE.index("## Symbols") : PAGE.index("## Words")]
ROWS = ROW.findall(SYMBOLS)
NEAR = 8
"""Lines above and below an equation that belong to it."""


FORMULA = re.compile(r"\$\$.+?\$\$|\$[^$]+\$", re.DOTALL)
SET = re.compile(r"\\(?:quad|qquad|left|right|mathrm|text|begin|end|bigl?|bigr|[,;! ])|[{}~&\s]|\\tag\{\w+\}")
"""What only sets a formula."""


def signs(formula):
    """Commands and characters of a formula one after another."""
    found = re.findall(r"\\[A-Za-z]+|\S", SET.sub(" ", formula))
    return f" {' '.join(found)} "


def test_every_row_of_symbols_names_its_equation():
    rows = [line for line in SYMBOLS.splitlines() if line.startswith("| ") and not line.startswith("| symbol")]
    assert len(rows) == len(ROWS) > 50


@over(("symbols", "unit", "meaning", "tag", "page", "anchor"), ROWS)
def test_symbols_stand_in_the_equation_and_around_it(symbols, unit, meaning, tag, page, anchor):
    text = (DOCS / page).read_text(encoding="utf-8")
    assert unit and meaning
    place = text.index(rf"\tag{{{tag}}}")
    above = re.findall(r"^##+ (.+)$", text[:place], re.MULTILINE)
    assert anchor == (re.sub(r"[^\w\- ]", "", above[-1].lower()).replace(" ", "-") if above else "")
    ends = [own.end() for own in re.finditer("\n", text)]
    at = text[:place].count("\n")
    low, high = ends[max(0, at - NEAR)], ends[min(len(ends) - 1, at + NEAR)]
    near = "".join(signs(own[0]) for own in FORMULA.finditer(text) if low <= own.start() < high)
    named = re.findall(r"\$([^$]+)\$", symbols) or symbols.split(", ")
    single = [own for part in named for own in part.split(", ")]
    assert [own for own in single if signs(own) not in near] == []
