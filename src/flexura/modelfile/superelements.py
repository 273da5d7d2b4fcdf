"""Superelement matrices in a model file: from a Matrix Market file, and in other units than SI."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.errors import ExpressionError, OptionError, Path, Problem
from flexura.expressions import LENGTH, MASS, Dimension
from flexura.files import MISSING, read_bytes
from flexura.modelfile.matrix_market import read_entries, read_header
from flexura.sizes import beyond
from flexura.units import parse_unit

_TIME = Dimension(time=LENGTH.length)
_UNITS = {"length": LENGTH, "mass": MASS, "time": _TIME}


class _RefusedError(Exception):
    """A matrix or a unit that cannot be used: path below the superelement, value, rule and hint."""

    def __init__(self, path: Path, value: str, rule: str, hint: str = "") -> None:
        super().__init__(rule)
        self.problem = Problem(path, value, rule, hint)


def prepare_superelement(entry: dict[str, Any], directory: FilePath) -> Problem | None:
    """Replace `{file: NAME}` and `units` by matrices in SI, in place; the problem when that fails.

    Paths are relative to `directory`. The problem's path starts below the superelement.
    """
    try:
        length, mass, time = _units(entry.pop("units", None))
        for key in ("stiffness", "mass", "stiffness_error"):
            if isinstance(entry.get(key), dict):
                entry[key] = _from_file(entry[key], (key,), directory, _order(entry))
        if (length, mass, time) != (1.0, 1.0, 1.0):
            force = mass / time**2
            for key, scale in (("stiffness", force), ("mass", mass), ("stiffness_error", force)):
                if key in entry:
                    entry[key] = _scaled(entry[key], scale, length, entry.get("amplitudes", 0))
    except _RefusedError as refused:
        return refused.problem
    return None


def unit_factors(units: Mapping[str, str] | None) -> tuple[float, float, float]:
    """Length, mass and time of `units`, such as `{"length": "mm", "mass": "t"}`, in SI; those left out are SI.

    Raises OptionError for other keys, and for texts that are no units of these.
    """
    try:
        return _units(units)
    except _RefusedError as refused:
        raise OptionError(str(refused.problem)) from None


def _units(raw: Any) -> tuple[float, float, float]:
    if raw is None:
        return 1.0, 1.0, 1.0
    hint = "e.g. {length: mm, mass: t, time: s}"
    if not isinstance(raw, Mapping):
        raise _RefusedError(("units",), repr(raw), "the units of a superelement are a mapping", hint)
    factors = {"length": 1.0, "mass": 1.0, "time": 1.0}
    for key, text in raw.items():
        if key not in _UNITS:
            raise _RefusedError(("units", key), "", "unknown key", "allowed: length, mass, time")
        try:
            factor, exponents = parse_unit(str(text))
        except ExpressionError as error:
            raise _RefusedError(("units", key), repr(text), error.rule, error.hint) from None
        if Dimension(*exponents) != _UNITS[key]:
            raise _RefusedError(("units", key), repr(text), f"a unit of {key} is expected here", hint)
        factors[key] = float(factor)
    return factors["length"], factors["mass"], factors["time"]


def _scaled(raw: Any, scale: float, length: float, amplitudes: Any) -> Any:
    """A stiffness or mass matrix in SI: rows and columns of rotations carry a length each, amplitudes none."""
    try:
        matrix = np.array(raw, dtype=float)
    except (TypeError, ValueError):
        return raw
    amplitudes = amplitudes if isinstance(amplitudes, int) and amplitudes > 0 else 0
    nodes, rest = divmod(matrix.shape[0] - amplitudes, 6) if matrix.ndim == 2 else (0, 1)
    if rest or nodes < 0 or matrix.shape[0] != matrix.shape[1]:
        return raw
    arms = np.append(np.tile([1.0, 1.0, 1.0, length, length, length], nodes), np.ones(amplitudes))
    return scale * np.outer(arms, arms) * matrix


def _order(entry: dict[str, Any]) -> int | None:
    """Rows that the matrices of a superelement have, where the description says it."""
    nodes, amplitudes = entry.get("nodes"), entry.get("amplitudes", 0)
    if isinstance(nodes, list) and isinstance(amplitudes, int) and amplitudes >= 0:
        return 6 * len(nodes) + amplitudes
    return None


def _from_file(raw: dict[str, Any], path: Path, directory: FilePath, order: int | None) -> NDArray[np.float64]:
    hint = "e.g. stiffness: {file: part_K.mtx}, a real Matrix Market file"
    if set(raw) != {"file"} or not isinstance(raw["file"], str):
        raise _RefusedError(path, "", "a matrix is a list of rows, or {file: NAME}", hint)
    name = raw["file"]
    try:
        return _read(read_bytes(directory / name), order)
    except _RefusedError as refused:
        own = refused.problem
        raise _RefusedError((*path, "file"), own.value or repr(name), own.rule, own.hint) from None
    except OptionError as error:
        rule, _, more = str(error).removeprefix(f"{directory / name}: ").partition("\n    hint: ")
        more = f"looked in {directory}" if rule == MISSING else more
        raise _RefusedError((*path, "file"), repr(name), rule, more) from None
    except (ValueError, MemoryError) as error:
        rule = f"not a real square Matrix Market file: {' '.join(str(error).split())[:160]}"
        raise _RefusedError((*path, "file"), repr(name), rule, hint) from None


def _read(content: bytes, order: int | None) -> NDArray[np.float64]:
    """The matrix of a Matrix Market file, whose header is held against the order and the bytes that there are."""
    header = read_header(content)
    rows, columns = header.rows, header.columns
    if rows != columns:
        raise ValueError(f"it is {rows} x {columns}; a square one is expected")
    if order is not None and rows != order:
        rule = f"the matrices of this part are {order} x {order}: six DOFs for each node, and its amplitudes"
        raise _RefusedError((), f"{rows} x {columns}", rule)
    if found := beyond("dense_entries", rows * columns):
        raise _RefusedError((), *found)
    if (5 if header.is_coordinate else 1) * header.entries > len(content):
        raise ValueError(f"its header says {header.entries} entries, and its {len(content)} bytes cannot hold them")
    return read_entries(content, header)
