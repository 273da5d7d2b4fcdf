"""The face that all results have: plain data, a table, warnings and notes, and a view for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from html import escape
from itertools import islice
from math import isfinite, isnan
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from flexura.errors import Exceeded, LimitError
from flexura.extras import need
from flexura.records import SHORT, Record, in_words

if TYPE_CHECKING:
    from pandas import DataFrame

R = TypeVar("R", bound="Result")

ROWS, COLUMNS, WARNINGS = 12, 8, 5
"""Rows, columns and warnings that a notebook shows of a result."""


class Result(Record):
    """What a verb returns: `warnings` say where it stops holding, `notes` how it was found and what to beware of."""

    warnings: tuple[Exceeded, ...] = ()
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

    def _repr_html_(self) -> str:
        return "\n".join([*self._heading(), _html_table([], self._facts()), *self._remarks()])

    def _heading(self) -> list[str]:
        named = getattr(self, "name", "")
        text = type(self).__name__ + (f": {named}" if isinstance(named, str) and named else "")
        return [f"<p><strong>{escape(text)}</strong></p>"]

    def _facts(self) -> list[list[str]]:
        """What one line shows, a row for each value."""
        names = (name for name in self._shown or _names(self) if name not in ("name", "notes", "warnings"))
        shown = ((name, getattr(self, name)) for name in names)
        told = ([name, _cell(own) if isinstance(own, str) else in_words(own)] for name, own in shown)
        return [row for row in told if row[1]]

    def _remarks(self) -> list[str]:
        """Warnings and notes as paragraphs, the first few of each."""
        told = [("warning", self.warnings), ("note", self.notes)]
        lines = [f"{what}: {text}" for what, texts in told for text in texts[:WARNINGS]]
        lines += [f"and {len(texts) - WARNINGS} more {what}s" for what, texts in told if len(texts) > WARNINGS]
        return [f"<p>{escape(line)}</p>" for line in lines]


class Tabular(Result):
    """A result that is a table."""

    def _columns(self) -> Mapping[str, Any]:
        """The columns by name, each with its unit in brackets unless it is a plain number."""
        raise NotImplementedError

    def to_columns(self) -> dict[str, Any]:
        """The table as lists or arrays by name, with SI units in brackets."""
        return dict(self._columns())

    def to_frame(self) -> DataFrame:
        """A pandas DataFrame; columns have their SI units in brackets. Raises OptionError without pandas."""
        return need("pandas", "pandas").DataFrame(self.to_columns())

    def _repr_html_(self) -> str:
        columns = dict(self._columns())
        shown = list(islice(columns, COLUMNS))
        count = len(next(iter(columns.values()), ()))
        rows = [[_cell(columns[name][k]) for name in shown] for k in range(min(count, ROWS))]
        left = [(count - len(rows), "rows"), (len(columns) - len(shown), "columns")]
        more = [f"<p>and {n} more {what}</p>" for n, what in left if n > 0]
        return "\n".join([*self._heading(), _html_table(shown, rows), *more, *self._remarks()])


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


def _cell(value: Any) -> str:
    """A value of a table in few characters; empty where there is none."""
    if isinstance(value, str):
        return value if len(value) <= SHORT else f"{value[: SHORT - 3]}..."
    if isinstance(value, float):
        return "" if isnan(value) else f"{value:.6g}"
    return "" if value is None else str(value)


def _html_table(headings: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table of text, escaped."""
    head = "".join(f"<th>{escape(text)}</th>" for text in headings)
    body = "".join("<tr>" + "".join(f"<td>{escape(text)}</td>" for text in row) + "</tr>" for row in rows)
    return "<table>" + (f"<thead><tr>{head}</tr></thead>" if head else "") + f"<tbody>{body}</tbody></table>"
