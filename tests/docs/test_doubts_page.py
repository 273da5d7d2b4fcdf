"""The page about doubts has a row for every kind that `check` has."""

import re

from helpers.doc_snippets import ROOT

PAGE = ROOT / "docs/how-to/doubts.md"


def test_every_kind_of_doubt_has_its_row():
    kinds = set()
    for path in (ROOT / "src/flexura/analysis").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        kinds |= set(re.findall(r'(?:Diagnostic\.about|_of_whole|Clash|Assumption)\(\s*"(\w+)"', text))
        kinds |= {kind for pair in re.findall(r'kind = "(\w+)" if \S+ else "(\w+)"', text) for kind in pair}
        kinds |= set(re.findall(r'replace\(blank, kind="(\w+)"', text))
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    named = [kind for row in rows for kind in re.findall(r"\w+", row)]
    assert len(kinds) > 20
    assert sorted(named) == sorted(kinds)
