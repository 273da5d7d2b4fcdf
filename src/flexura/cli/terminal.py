"""What commands print on a terminal, and the tables that they write."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import rich.table
from rich.console import Console, RenderableType
from rich.text import Text

from flexura.errors import Diagnostic, foremost
from flexura.tables import Facts, Item, Line, Table, is_right, number, text_columns

MOST_OF_A_KIND = 3
"""Warnings of a kind that are printed; `--json` has all."""

MOST_FACTS = 10
"""Of one kind that are printed."""

GAP, LEAST_FOLDED = 2, 24
"""Blanks between columns; a last column of texts folds when it has so many characters at least."""

WHOLE = 10_000
"""Characters of a cell: it folds, and is not cut."""

MOST_BLOCKS = 4
"""Of columns, below each other."""

_STYLES = {"": "", "good": "green", "bad": "red"}

PAGES = (".html",)
"""Suffixes of pages."""


def console_of_width() -> Console:
    """A console; a pipe is given a width."""
    console = Console(highlight=False, soft_wrap=False)
    # a pipe has no width; wide tables are easier to read there than wrapped ones
    return console if console.is_terminal else Console(highlight=False, width=140)


def print_all(parts: Iterable[Item | RenderableType]) -> None:
    """Print what is presented, in the order given."""
    console = console_of_width()
    for part in parts:
        for line in _printed(part, console.width) if isinstance(part, Item) else [part]:
            console.print(line, markup=False)


def _printed(part: Item, width: int) -> Iterator[RenderableType]:
    """A sentence, a line for each fact, or a table, in blocks of as many columns as fit side by side."""
    if isinstance(part, Line):
        yield Text(part.text, style=_STYLES[part.news])
    elif isinstance(part, Facts):
        for name, value in part.values.items():
            several = isinstance(value, Mapping)
            values = [(f"{name} {of}", text) for of, text in value.items()] if several else [(name, value)]
            texts = [f"{of}: {_fact(text)}" for of, text in values[:MOST_FACTS] if text not in (None, "")]
            yield from texts
            if len(values) > MOST_FACTS:
                yield f"{name}: and {len(values) - MOST_FACTS} more"
    else:
        yield from _table_printed(part, width)


def _fact(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return number(value) if isinstance(value, float) else str(value)


def _table_printed(part: Table, width: int) -> Iterator[RenderableType]:
    shown = part.shown()
    if not any(shown.values()):
        return
    columns = text_columns(shown, WHOLE)
    right = dict(zip(columns, map(is_right, shown.values()), strict=True))
    sizes = {name: GAP + max(map(len, (*name.splitlines(), *cells))) for name, cells in columns.items()}
    first, *names = columns
    if part.title:
        yield part.title
    for blocks in range(1, MOST_BLOCKS + 1):
        block, room = [first], width + GAP - sizes[first]
        while names and (len(block) == 1 or sizes[names[0]] <= room or _may_fold(names, sizes, room)):
            room -= sizes[names[0]]
            block.append(names.pop(0))
        table = rich.table.Table(box=None, pad_edge=False, header_style="bold")
        for name in block:
            # the last column folds where it is long
            folds = name == block[-1] and not right[name]
            table.add_column(name, justify="right" if right[name] else "left", no_wrap=not folds, overflow="fold")
        for cells in zip(*(columns[name] for name in block), strict=True):
            table.add_row(*cells)
        yield table
        if not names:
            break
        yield "" if blocks < MOST_BLOCKS else f"and {len(names)} more columns: --out writes all of them"
    yield from part.left_out(shown)


def _may_fold(names: Sequence[str], sizes: Mapping[str, int], room: int) -> bool:
    """Whether the last column fits when its cells are folded."""
    return len(names) == 1 and room >= min(sizes[names[0]], LEAST_FOLDED)


def print_end(notes: Iterable[str], warnings: Iterable[Diagnostic], written: Iterable[Path]) -> None:
    """Print notes, warnings, and which files were written."""
    print_all(f"note: {note}" for note in notes)
    print_all(Text.assemble(("warning:", "yellow"), f" {text}") for text in foremost(warnings, MOST_OF_A_KIND))
    print_all(f"wrote {path}" for path in written)


def heading(text: str) -> Text:
    """A line in bold."""
    return Text(text, style="bold")
