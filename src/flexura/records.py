"""What results have in common: one line to be shown by, and no more in a pickle than cannot be worked out again."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import fields
from functools import cached_property
from typing import Any, ClassVar, Generic, TypeVar, cast

T = TypeVar("T")

SHOWN = 160
"""Characters of an object that are shown."""

SHORT = 40
"""Characters of one of its values that are shown."""

SEVERAL = 2
"""Values of a collection that are shown one by one."""


class Record:
    """Data that is shown in one line, and pickled without its cached properties, which are worked out again.

    `_shown` names what is shown; by default the fields of a dataclass.
    """

    _shown: ClassVar[tuple[str, ...]] = ()

    def __repr__(self) -> str:
        names = self._shown or [f.name for f in fields(cast(Any, self)) if f.repr]
        parts = [f"{name}={text}" for name in names if (text := in_words(getattr(self, name)))]
        return _shortened(f"{type(self).__name__}({', '.join(parts)})", SHOWN)

    def __getstate__(self) -> dict[str, Any]:
        cached = {k for kind in type(self).__mro__ for k, v in vars(kind).items() if isinstance(v, cached_property)}
        return {name: value for name, value in vars(self).items() if name not in cached}


def in_words(value: Any) -> str:
    """A value in few characters: arrays by their shape, collections by their number; empty where there is nothing."""
    if value is None or (isinstance(value, tuple | list | Mapping) and not value):
        return ""
    shape = getattr(value, "shape", ())
    if shape:
        return "x".join(str(n) for n in shape)
    if isinstance(value, tuple | list | Mapping):
        kept = [in_words(entry) for entry in value] if len(value) <= SEVERAL and not isinstance(value, Mapping) else []
        return f"({', '.join(kept)})" if kept and all(kept) else f"{len(value)} of them"
    return _shortened(f"{value:.6g}" if type(value) is float else repr(value), SHORT)


def _shortened(text: str, most: int) -> str:
    text = " ".join(text.split())
    return text if len(text) <= most else f"{text[: most - 4]}...{text[-1]}"


class Kept:
    """What has been worked out from an object alone, by key, to be used again. Pickles empty.

    With `most`, only the so many that were asked for last are kept.
    """

    def __init__(self, most: int | None = None) -> None:
        self._most = most
        self._found: dict[Hashable, Any] = {}

    def once(self, key: Hashable, make: Callable[[], T], enough: Callable[[T], bool] = lambda _: True) -> T:
        """What `make` returned when this key was first asked for; it is made anew where that is not `enough`."""
        found = self._found[key] if key in self._found and enough(self._found[key]) else make()
        self._found.pop(key, None)
        self._found[key] = found  # at the end: the first is the one that was not asked for for longest
        if self._most is not None and len(self._found) > self._most:
            del self._found[next(iter(self._found))]
        return found

    def clear(self) -> None:
        """Keep nothing of what has been found."""
        self._found.clear()

    def __reduce__(self) -> tuple[type[Kept], tuple[int | None]]:
        return Kept, (self._most,)


class Latest(Generic[T]):
    """The last thing that was worked out, kept while what it depends on is the same object, a tuple of the same ones,
    or an equal one of bytes or of a frozenset. Pickles empty."""

    def __init__(self) -> None:
        self._of: object = None
        self._found: T | None = None

    def get(self, of: object, make: Callable[[], T]) -> T:
        """What `make` returned when it was last called, if that was for the same `of`."""
        if not _is_same(self._of, of) or self._found is None:
            self._of, self._found = of, make()
        return self._found

    def clear(self) -> None:
        """Keep nothing of what has been found."""
        self._of = self._found = None

    def __reduce__(self) -> tuple[type[Latest[Any]], tuple[()]]:
        return Latest, ()


def _is_same(before: object, now: object) -> bool:
    if isinstance(before, tuple) and isinstance(now, tuple):
        return len(before) == len(now) and all(a is b for a, b in zip(before, now, strict=True))
    return before is now or (isinstance(now, bytes | frozenset) and before == now)
