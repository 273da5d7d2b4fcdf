"""Responses between the same two channels that a file gives more than once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from flexura.errors import OptionError

Repeated = Literal["average", "first", "last"]
"""What to make of them: their mean, or the one that comes first or last."""

MOST_NAMED = 3
"""Pairs that are named in a note."""

T = TypeVar("T")


def checked(how: str | None) -> None:
    """Raise OptionError for what is no way of merging; None is to refuse them."""
    if how is not None and how not in get_args(Repeated):
        raise OptionError(f"repeated is one of {', '.join(get_args(Repeated))}, not {how!r}")


def merged(values: Sequence[NDArray[Any]], how: Repeated) -> NDArray[Any]:
    """One of several arrays of a shape: their mean, the first or the last."""
    return np.mean(values, axis=0) if how == "average" else values[0 if how == "first" else -1]


def said_of(again: Sequence[tuple[str, int]], how: Repeated) -> str:
    """A note on pairs, each with how often it is given."""
    named = ", ".join(f"{pair} ({count} times)" for pair, count in again[:MOST_NAMED])
    more = f" and {len(again) - MOST_NAMED} more" if len(again) > MOST_NAMED else ""
    done = {"average": "averaged", "first": "the first one is used", "last": "the last one is used"}[how]
    return f"given more than once, {done}: {named}{more}"


def grouped(items: Sequence[T], key: Callable[[T], Any]) -> dict[Any, list[T]]:
    """Items of one key together, in their order."""
    found: dict[Any, list[T]] = {}
    for item in items:
        found.setdefault(key(item), []).append(item)
    return found
