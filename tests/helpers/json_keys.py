"""The page of what results are as JSON, from a sample of each: PYTHONPATH=src:tests python -m helpers.json_keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from flexura.results import Result
from helpers.doc_snippets import ROOT
from helpers.every_result import RESULTS

PAGE = ROOT / "docs" / "json.md"
HEAD = """# Results as JSON

What `to_dict()` gives and `--json` prints, result by result. Numbers are in SI units, and `null` where they are not
finite or not known; keys of frequencies end in `_hz`. *By name*: keys that are names of yours: of parts,
parameters, or designs. Every result has `warnings`, a list of `kind`, `place`, `value`, `limit`, `unit` and `text`,
of `check` also of `places`, and `notes`, a list of texts. How arrays, complex numbers and sparse matrices are written:
[results](results.md#plain-data).
"""
COMMON = ("notes", "warnings")
DEPTH = 2


def page() -> str:
    """The text of the page."""
    return "\n".join([HEAD, *(part for name in sorted(RESULTS) for part in _section(name, RESULTS[name]()))])


def _section(name: str, result: Result) -> Iterator[str]:
    """The keys of a result, by what their values are."""
    kinds: dict[str, list[str]] = {}
    for key, value in result.to_dict().items():
        if key not in COMMON:
            by_name = isinstance(value, dict) and isinstance(getattr(result, key, None), Mapping)
            kinds.setdefault(kind(value, by_name), []).append(f"`{key}`")
    yield f"## {name}\n"
    yield from (f"* {what}: {', '.join(keys)}" for what, keys in kinds.items())
    yield ""


def kind(value: Any, is_by_name: bool = False, depth: int = DEPTH) -> str:
    """What a value is, in words."""
    match value:
        case bool():
            return "true or false"
        case None:
            return "may be `null`"
        case int() | float():
            return "number"
        case str():
            return "text"
        case dict() if is_by_name:
            return f"by name, {kind(next(iter(value.values())), depth=depth)} each" if value else "by name"
        case dict():
            keys = ", ".join(f"`{key}`" for key in value)
            return f"object of {keys}" if depth else "object"
        case list():
            inner = next((own for own in value if own is not None), None)
            if inner is None:
                return "list"
            return f"list: {kind(inner, depth=depth - 1 if isinstance(inner, dict) else depth)}"
    raise TypeError(type(value).__name__)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
