"""The page of the Python API says of every verb the first sentence of its docstring and what it returns.

To bring its tables up to date: PYTHONPATH=tests python -m helpers.api_page
"""

from __future__ import annotations

import inspect
import re

from helpers.doc_snippets import ROOT
from helpers.public_names import public_names

PAGE = ROOT / "docs" / "api.md"
ROW = re.compile(r"^\| `([\w.]+)` \| .* \| .* \|$", re.MULTILINE)
"""A row of a table of verbs."""


def row(name: str) -> str:
    """The row of a verb: name, first sentence, classes that it returns."""
    verb = public_names()[name]
    text = " ".join((inspect.getdoc(verb) or "").split("\n\n")[0].split())
    text = re.sub(r" \(theory[^)]*\)|, e\.g\. .*$", "", text)
    sentence = re.split(r"(?<=\.)\s+(?=[A-Z`])", text)[0].rstrip(".").replace("|", "\\|").replace("*", "\\*")
    annotation = str(inspect.signature(verb).return_annotation)  # pyright: ignore[reportArgumentType]
    classes = [part for part in re.findall(r"[A-Z]\w+", annotation) if part not in _COMMON]
    return f"| `{name}` | {sentence} | {', '.join(f'`{part}`' for part in dict.fromkeys(classes))} |"


_COMMON = {"None", "Array", "Path", "Any", "Figure", "Literal", "Sequence", "Mapping", "Callable", "Iterator", "Self"}
"""What annotations name that no page of results has."""


def current(text: str) -> str:
    """The page with its rows as the code has them."""
    names = public_names()
    return ROW.sub(lambda match: row(match[1]) if inspect.isfunction(names.get(match[1])) else match[0], text)


if __name__ == "__main__":
    PAGE.write_text(current(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
