"""The face that all results have: plain data, a table, warnings and notes, and a view for notebooks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from html import escape
from math import isfinite
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from flexura.errors import Diagnostic, LimitError, foremost, need
from flexura.records import Record
from flexura.tables import Item, Table, counted, html_of

if TYPE_CHECKING:
    from pandas import DataFrame

R = TypeVar("R", bound="Result")

WARNINGS, NOTES = 5, 5
"""Warnings and notes that a notebook shows of a result."""

MOST_OF_A_KIND = 3
"""Of these, so many of one kind."""

_BAR = "border-left:3px solid;padding-left:0.6em"
"""Marks a warning in the colour of the text, whatever that is."""


class Displayed:
    """What a notebook shows at the end of a cell: a heading, a few facts and short tables, warnings and notes."""

    def _repr_html_(self) -> str:
        parts = filter(None, map(html_of, self.presentation()))
        return "\n".join([self._heading(), *parts, *self._remarks()])

    @property
    def headline(self) -> str:
        """Its name and what it is, in a few words."""
        return ": ".join(filter(None, (str(getattr(self, "name", "")), self._title()))) or type(self).__name__

    def _heading(self) -> str:
        named, said = str(getattr(self, "name", "")), self._title()
        text = type(self).__name__ + (f": {named}" if named else "")
        return f"<p><strong>{escape(text)}</strong>{f' ({escape(said)})' if said else ''}</p>"

    def _title(self) -> str:
        """What stands beside the name, in a few words."""
        return ""

    def presentation(self) -> Iterator[Item]:
        """What is below the heading, as data: notebooks and the shell write it."""
        raise NotImplementedError

    def _remarks(self) -> Iterator[str]:
        """Warnings and notes, as HTML."""
        yield from ()


def _warned(texts: Sequence[str]) -> Iterator[str]:
    """What must not be overlooked, the first few of it."""
    for text in texts[:WARNINGS]:
        yield f'<p style="{_BAR}"><strong>warning:</strong> {escape(text)}</p>'
    if len(texts) > WARNINGS:
        yield f"<p>and {len(texts) - WARNINGS} more warnings</p>"


def _folded(notes: Sequence[str]) -> Iterator[str]:
    """Notes that unfold."""
    if notes:
        told = "".join(f"<p>{escape(note)}</p>" for note in notes[:NOTES])
        more = f"<p>and {len(notes) - NOTES} more notes</p>" if len(notes) > NOTES else ""
        yield f"<details><summary>{counted(len(notes), 'note')}</summary>{told}{more}</details>"


class Result(Record, Displayed):
    """What a verb returns: `warnings` say where it stops holding, `notes` how it was found and what to beware of."""

    warnings: tuple[Diagnostic, ...] = ()
    notes: tuple[str, ...] = ()

    _told: ClassVar[tuple[str, ...]] = ()
    """Attributes that `to_dict` gives, by default the fields of the dataclass."""

    def raise_warnings(self: R) -> R:
        """The result itself. Raises LimitError when it has warnings."""
        if self.warnings:
            raise LimitError(self.warnings)
        return self

    def to_dict(self) -> dict[str, Any]:
        """Plain data that `json.dumps` takes as it is, SI; see `plain` for arrays and complex numbers."""
        return plain({**self._data(), "notes": self.notes, "warnings": self.warnings})

    def _data(self) -> Mapping[str, Any]:
        """What `to_dict` gives beside notes and warnings."""
        return {name: getattr(self, name) for name in self._told or _names(self)}

    def _remarks(self) -> Iterator[str]:
        yield from _warned(self._warned())
        yield from _folded(self.notes)

    def _warned(self) -> list[str]:
        """Warnings in words, those of each kind that are furthest beyond their limit first."""
        return foremost(self.warnings, MOST_OF_A_KIND)


class Tabular(Result):
    """A result that is a table."""

    _listed: ClassVar[tuple[str, ...]] = ()
    """Columns that a notebook shows, by default all."""

    def _columns(self) -> Mapping[str, Any]:
        """The columns by name, each with its unit in brackets unless it is a plain number."""
        raise NotImplementedError

    def to_columns(self) -> dict[str, Any]:
        """The table as lists or arrays by name, with SI units in brackets."""
        return dict(self._columns())

    def to_frame(self) -> DataFrame:
        """A pandas DataFrame; columns have their SI units in brackets. Raises OptionError without pandas."""
        return need("pandas", "pandas").DataFrame(self.to_columns())

    def presentation(self) -> Iterator[Item]:
        columns = self._columns()
        yield Table({name: columns[name] for name in self._listed or columns})


def plain(value: Any) -> Any:
    """Data of strings, numbers, truth values, None, lists and dicts, as JSON has them.

    Numbers that are not finite are None. Arrays are nested lists by their axes; a sparse matrix is a dict of its
    `shape` and the `rows`, `columns` and `values` of its entries. A complex number or array of a dict or dataclass
    under `name` becomes two, `name_real` and `name_imaginary`; elsewhere it is a dict of `real` and `imaginary`.
    Results are what their `to_dict` gives, other dataclasses dicts of their fields.
    """
    if value is None or type(value) in (bool, int, str):
        return value
    if isinstance(value, float):
        return float(value) if isfinite(value) else None
    if isinstance(value, Mapping):
        return _plain_dict(value)
    if hasattr(value, "to_dict"):
        return _plain_dict(value.to_dict())
    if is_dataclass(value):
        return _plain_dict({name: getattr(value, name) for name in _names(value)})
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(own) for own in value]
    if hasattr(value, "tocoo"):
        own = value.tocoo()
        places = {"shape": list(own.shape), "rows": own.row.tolist(), "columns": own.col.tolist()}
        return {**places, **_parts("values", own.data)}
    if isinstance(value, str | PathLike):
        return str(fspath(value))
    return _plain_numbers(value)


def _plain_dict(value: Mapping[Any, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, own in value.items():
        found |= _parts(str(name), own)
    return found


def _parts(name: str, value: Any) -> dict[str, Any]:
    """An entry under its name; real and imaginary part under two where it is complex."""
    if isinstance(value, complex | np.ndarray | np.generic) and np.iscomplexobj(value):
        return {f"{name}_{what}": part for what, part in _plain_numbers(value).items()}
    return {name: plain(value)}


def _plain_numbers(value: Any) -> Any:
    """Numbers and arrays of them; None for what is not finite."""
    A = np.asarray(value)
    if A.dtype.kind == "c":
        return {"real": _plain_numbers(np.real(A)), "imaginary": _plain_numbers(np.imag(A))}
    if A.dtype.kind not in "fiubU":
        raise TypeError(f"{type(value).__name__} is no plain data")
    if A.dtype.kind != "f" or np.isfinite(A).all():
        return A.tolist()
    return _finite_or_none(A.tolist())


def _finite_or_none(value: Any) -> Any:
    if isinstance(value, list):
        return [_finite_or_none(own) for own in value]
    return value if isfinite(value) else None


def _names(value: Any) -> list[str]:
    return [own.name for own in fields(value) if own.repr]
