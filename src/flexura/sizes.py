"""How large what is read may be: checked before anything of that size is made, raised on purpose only.

A description of a few lines, or a file of a few bytes, can ask for any amount of memory and time. What it asks for is
counted first and refused beyond a limit; docs/limits.md has the table.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

from flexura.errors import OptionError

ENVIRONMENT = "FLEXURA_LIMITS"
"""The variable that raises limits: NAME=VALUE, separated by commas."""


class SizeLimit(NamedTuple):
    """The most of something, and what that is."""

    value: int
    of: str


LIMITS = {
    "model_bytes": SizeLimit(20_000_000, "bytes of a model file"),
    "model_values": SizeLimit(500_000, "values in a model file and those that it extends, aliases written out"),
    "copies": SizeLimit(200_000, "substructures placed"),
    "nodes": SizeLimit(50_000, "nodes placed, mesh nodes inside members too"),
    "elements": SizeLimit(50_000, "beam elements placed"),
    "dense_entries": SizeLimit(25_000_000, "entries of one full matrix"),
    "designs": SizeLimit(20_000_000, "designs of a study that is held in memory; a folder holds any number"),
    "file_bytes": SizeLimit(2_000_000_000, "bytes of a file of data or matrices, as it is and unpacked"),
    "drawing_bytes": SizeLimit(100_000_000, "bytes of a drawing"),
    "drawing_segments": SizeLimit(100_000, "lines and arcs of a drawing, blocks written out"),
    "arrays": SizeLimit(100_000, "arrays or datasets in one file of data"),
    "solid_bytes": SizeLimit(100_000_000, "bytes of a file of CAD or of a mesh"),
}
"""The limits by name, as they are unless they are raised."""

_raised: ContextVar[dict[str, int]] = ContextVar("flexura_size_limits", default={})  # noqa: B039  never changed


def size_limit(name: str) -> int:
    """The most of something: as given to `size_limits`, else in FLEXURA_LIMITS, else the default.

    Raises OptionError for a variable that cannot be read.
    """
    raised = _raised.get()
    if name in raised:
        return raised[name]
    text = os.environ.get(ENVIRONMENT, "").strip()
    given = parsed_limits(text.split(","), ENVIRONMENT) if text else {}
    return given.get(name, LIMITS[name].value)


@contextmanager
def size_limits(**limits: float) -> Iterator[None]:
    """Raise (or lower) limits of size by name for what is called within, e.g. `size_limits(nodes=1e6)`.

    Raises OptionError for unknown names and for values that are not positive.
    """
    given = {name: _checked(name, value, f"size_limits({name}={value!r})") for name, value in limits.items()}
    token = _raised.set({**_raised.get(), **given})
    try:
        yield
    finally:
        _raised.reset(token)


def beyond(name: str, value: float) -> tuple[str, str, str] | None:
    """Value, rule and hint where so many go beyond a limit; None within it."""
    most = size_limit(name)
    if value <= most:
        return None
    shown = f"{value:,.0f}".replace(",", " ") if value < 1e15 else f"{value:.1e}"
    rule = f"at most {most:,} {LIMITS[name].of}".replace(",", " ", str(f"{most:,}").count(","))
    needed = f"{value:.0f}" if value < 1e15 else "VALUE"
    hint = f"where that is meant: --limit {name}={needed}, {ENVIRONMENT}={name}={needed} or flexura.size_limits"
    return shown, rule, hint


def within(name: str, value: float, place: str) -> None:
    """Raise OptionError, with the place, where so many go beyond a limit."""
    found = beyond(name, value)
    if found is not None:
        shown, rule, hint = found
        raise OptionError(f"{place}: {rule} (found {shown})\n    hint: {hint}")


def parsed_limits(texts: Iterable[str], where: str = "--limit") -> dict[str, int]:
    """Limits by name out of texts NAME=VALUE. Raises OptionError, which names where they stand, for anything else."""
    found = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise OptionError(f"{where}: a limit is NAME=VALUE, not {text!r}; names: {', '.join(LIMITS)}")
        found[name] = _checked(name, value, f"{where} {text}")
    return found


def _checked(name: str, value: float | str, where: str) -> int:
    if name not in LIMITS:
        raise OptionError(f"{where}: there is no limit {name!r}; names: {', '.join(LIMITS)}")
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not (math.isfinite(number) and number >= 1):
        raise OptionError(f"{where}: a limit is a finite number, 1 or more")
    return int(number)
