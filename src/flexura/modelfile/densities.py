"""Densities of disturbances in a model file: numbers with units that are densities, tables of them, and CSV files."""

from __future__ import annotations

import csv
import math
import re
from fractions import Fraction
from itertools import pairwise
from pathlib import Path as FilePath
from typing import Any

from flexura.errors import ExpressionError, OptionError, Path, Problem
from flexura.expressions import FREQUENCY, Dimension
from flexura.files import MISSING, read_text
from flexura.mechanism import density_base
from flexura.modelfile.parameters import entries
from flexura.units import parse_unit, split_quantity, to_si

_ROOT = re.compile(r"(?:sqrt\s*\(\s*Hz\s*\)|√\s*Hz)")
_SQUARE = re.compile(r"\((.+)\)\s*(?:\^|\*\*)\s*2\s*/\s*Hz")
_HEADING = re.compile(r"\s*([^\[\]]*?)\s*\[(.+)\]\s*")
_EXAMPLE = "e.g. 5 nV/sqrt(Hz), 2 um/s^2/sqrt(Hz) or 1e-12 (m/s^2)^2/Hz"


class _RefusedError(Exception):
    """What is no density: path below the disturbance, value, rule and hint."""

    def __init__(self, path: Path, value: Any, rule: str, hint: str = "") -> None:
        super().__init__(rule)
        self.problem = Problem(path, "" if value is None else repr(value), rule, hint)


def prepare_densities(data: dict[str, Any], directory: FilePath) -> list[Problem]:
    """Replace densities, tables of them and files of tables by numbers in SI, in place; what cannot be read.

    Files are relative to `directory`.
    """
    problems = []
    for name, entry in entries(data, "disturbances"):
        if not isinstance(entry, dict):
            continue
        try:
            _prepare(entry, directory)
        except _RefusedError as refused:
            own = refused.problem
            problems.append(Problem(("disturbances", name, *own.path), own.value, own.rule, own.hint))
    return problems


def _prepare(entry: dict[str, Any], directory: FilePath) -> None:
    if entry.get("density") is not None:
        value, unit = _amplitude(("density",), entry["density"])
        entry["density"] = {"value": value, "unit": unit}
    if "file" in entry:
        if entry.get("table") is not None:
            raise _RefusedError(("file",), entry["file"], "both are given: a table stands here or in a file")
        entry["table"] = _from_file(entry.pop("file"), directory)
    elif entry.get("table") is not None:
        entry["table"] = _table(entry["table"])


def _unit(text: str) -> tuple[Fraction, str, bool]:
    """Factor and SI unit of what a density is of, and whether it is one of power. Raises ExpressionError."""
    plain = _ROOT.sub("Hz^(1/2)", text.strip())
    squared = _SQUARE.fullmatch(plain)
    if squared is not None:
        factor, own = parse_unit(squared[1])
        factor, dimension = factor**2, own.power(Fraction(2)).times(FREQUENCY, -1)
    else:
        factor, dimension = parse_unit(plain)
    found = density_base(dimension)
    if found is None:
        raise ExpressionError(f"{text.strip()!r} is no unit of a density of motion, force or voltage", _EXAMPLE)
    return factor, *found


def _amplitude(path: Path, raw: Any) -> tuple[float, str]:
    """An amplitude density, SI, and the unit of what it is of."""
    if not isinstance(raw, str):
        raise _RefusedError(path, raw, "a density carries a unit", _EXAMPLE)
    try:
        number, text = split_quantity(raw)
        factor, unit, is_power = _unit(text)
        return _size(path, raw, to_si(number, factor), is_power), unit
    except ExpressionError as error:
        raise _RefusedError(path, raw, error.rule, error.hint) from None


def _size(path: Path, raw: Any, value: float, is_power: bool) -> float:
    if not (math.isfinite(value) and value >= 0):
        raise _RefusedError(path, raw, "a density is finite, and not negative")
    return math.sqrt(value) if is_power else value


def _table(raw: Any) -> dict[str, Any]:
    """The table of rows `[1 Hz, 5 nV/sqrt(Hz)]`."""
    hint = "e.g. table: [[1 Hz, 2 um/s^2/sqrt(Hz)], [100 Hz, 1 um/s^2/sqrt(Hz)]]"
    if not isinstance(raw, list) or len(raw) < 2:
        raise _RefusedError(("table",), None, "a table is a list of two rows or more", hint)
    rows = []
    for k, row in enumerate(raw):
        if not isinstance(row, list) or len(row) != 2:
            raise _RefusedError(("table", k), row, "a row is a frequency and a density", hint)
        try:
            number, unit = split_quantity(str(row[0]))
            factor, dimension = parse_unit(unit) if unit else (Fraction(1), Dimension())
        except ExpressionError as error:
            raise _RefusedError(("table", k, 0), row[0], error.rule, error.hint) from None
        hz = to_si(number, factor)
        if (hz and (dimension != FREQUENCY or "Hz" not in unit)) or hz < 0:
            raise _RefusedError(("table", k, 0), row[0], "a frequency in Hz is expected here", "e.g. 10 Hz")
        rows.append((hz, *_amplitude(("table", k, 1), row[1])))
    for k, (before, after) in enumerate(pairwise(rows), 1):
        if after[0] <= before[0]:
            raise _RefusedError(("table", k, 0), raw[k][0], "the frequencies of a table rise from row to row")
        if after[2] != rows[0][2]:
            raise _RefusedError(("table", k, 1), raw[k][1], f"it is not of {rows[0][2]}, as the first row is")
    return {"frequency_hz": [r[0] for r in rows], "values": [r[1] for r in rows], "unit": rows[0][2]}


def _from_file(name: Any, directory: FilePath) -> dict[str, Any]:
    """The table of a CSV file with a heading such as `frequency [Hz], density [(m/s^2)^2/Hz]`."""
    if not isinstance(name, str):
        raise _RefusedError(("file",), name, "the name of a CSV file is expected here")

    def refused(line: int, rule: str) -> _RefusedError:
        return _RefusedError(("file",), name, f"line {line}: {rule}")

    try:
        text = read_text(directory / name)
    except OptionError as error:
        rule, _, hint = str(error).removeprefix(f"{directory / name}: ").partition("\n    hint: ")
        raise _RefusedError(("file",), name, rule, f"looked in {directory}" if rule == MISSING else hint) from None
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if len(lines) < 3:
        raise refused(len(lines), "a heading and at least two rows are expected")
    separator = max(",;\t", key=lines[0][1].count)
    try:
        rows = [(n, next(csv.reader([line], delimiter=separator))) for n, line in lines]
    except csv.Error as error:
        raise refused(1, f"not a table: {error}") from None
    (first, heading), *body = rows
    units = [own[2] if (own := _HEADING.fullmatch(cell)) else "" for cell in heading]
    if len(heading) != 2 or units[0] != "Hz":
        raise refused(first, "the heading is expected to be frequency [Hz], density [UNIT], as [(m/s^2)^2/Hz]")
    try:
        factor, unit, is_power = _unit(units[1])
    except ExpressionError as error:
        raise refused(first, f"{error.rule}; {error.hint}") from None
    found: list[tuple[float, float]] = []
    for n, cells in body:
        try:
            hz, value = (float(cell) for cell in cells)
        except ValueError:
            raise refused(n, f"two numbers are expected, not {separator.join(cells)[:40]!r}") from None
        if not (math.isfinite(hz) and hz >= 0) or (found and hz <= found[-1][0]):
            raise refused(n, f"frequencies are not negative and rise from row to row; found {hz:g}")
        if not (math.isfinite(value) and value >= 0):
            raise refused(n, f"a density is finite, and not negative; found {value:g}")
        size = value * float(factor)
        found.append((hz, math.sqrt(size) if is_power else size))
    return {"frequency_hz": [hz for hz, _ in found], "values": [value for _, value in found], "unit": unit}
