"""Examples of public names, taken from the pages of the Python API, where they are run."""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

DOCS = Path(__file__).parents[1] / "_examples"
PAGES = ("verbs.md", "parts.md")
WHOLE = 9
"""Lines up to which a block is shown whole; of longer ones what calls the name."""

BLOCK = re.compile(r"^```(python|py)\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.MULTILINE | re.DOTALL)


class Example(NamedTuple):
    """Lines of a page below a heading of a section that call a name, and what they print; `is_run` with the page."""

    page: str
    section: str
    heading: str
    code: str
    printed: str
    is_run: bool

    def markdown(self) -> str:
        """The example as it stands below a docstring."""
        text = f"Example:\n\n```python\n{self.code}```\n"
        return text + (f"\n```text\n{self.printed}```\n" if self.printed else "")


def example(name: str) -> Example | None:
    """An example of a name such as `modes` or `view.draw_mode`: that below its own heading, or else the first."""
    found = [own for page in PAGES for own in _examples(name, page)]
    return next((own for own in found if own.heading == name), next(iter(found), None))


def _examples(name: str, page: str) -> Iterator[Example]:
    call = re.compile(rf"\bfx\.{re.escape(name)}(?:\.parse)?\(")
    text = (DOCS / page).read_text(encoding="utf-8")
    for match in BLOCK.finditer(text):
        above = text[: match.start()]
        sections = re.findall(r"^## (.+)$", above, re.MULTILINE)
        if sections and call.search(match[2]):
            heading = re.findall(r"^##+ `?([\w.]*)", above, re.MULTILINE)[-1]
            is_short = match[2].count("\n") <= WHOLE
            code = match[2] if is_short else _calling(match[2], call)
            printed = (match[3] or "") if is_short else ""
            yield Example(page, sections[-1], heading, code, printed, match[1] == "python")


def _calling(code: str, call: re.Pattern[str]) -> str:
    """The statements of a block that call a name, or of a long one the call alone."""
    lines = code.splitlines(keepends=True)
    statements = [own for own in ast.parse(code).body if call.search(_text(lines, own))]
    if sum(_text(lines, own).count("\n") for own in statements) <= WHOLE:
        return "".join(_text(lines, own) for own in statements)
    calls = [own for own in ast.walk(statements[0]) if isinstance(own, ast.Call)]
    texts = (ast.get_source_segment(code, own, padded=True) or "" for own in calls)
    return textwrap.dedent(next(text for text in texts if call.match(text.strip()))) + "\n"


def _text(lines: list[str], statement: ast.stmt) -> str:
    """The lines of a statement."""
    return "".join(lines[statement.lineno - 1 : statement.end_lineno])
