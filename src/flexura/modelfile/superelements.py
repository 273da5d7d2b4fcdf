"""Superelement matrices in a model file: from a Matrix Market file, and in other units than SI."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.errors import ExpressionError, OptionError, Path, Problem
from flexura.mechanism.dimension import LENGTH, MASS, Dimension
from flexura.units import parse_unit

MAX_ORDER = 6000
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
                entry[key] = _from_file(entry[key], (key,), directory)
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
    return (scale * np.outer(arms, arms) * matrix).tolist()


def _from_file(raw: dict[str, Any], path: Path, directory: FilePath) -> list[list[float]]:
    hint = "e.g. stiffness: {file: part_K.mtx}, a real Matrix Market file"
    if set(raw) != {"file"} or not isinstance(raw["file"], str):
        raise _RefusedError(path, "", "a matrix is a list of rows, or {file: NAME}", hint)
    name = raw["file"]
    try:
        return _read(directory / name).tolist()
    except FileNotFoundError:
        raise _RefusedError((*path, "file"), repr(name), "the file does not exist", f"looked in {directory}") from None
    except (OSError, MemoryError) as error:
        rule = f"the file cannot be read: {getattr(error, 'strerror', None) or error}"
        raise _RefusedError((*path, "file"), repr(name), rule) from None
    except (ValueError, OverflowError, TypeError, KeyError, IndexError) as error:
        rule = f"not a real square Matrix Market file: {' '.join(str(error).split())[:120]}"
        raise _RefusedError((*path, "file"), repr(name), rule, hint) from None


def _read(file: FilePath) -> NDArray[np.float64]:
    from scipy.io import mminfo, mmread

    with file.open("rb") as stream:
        stream.read(1)
    rows, columns, _, _, kind, _ = mminfo(str(file))
    if kind not in ("real", "integer"):
        raise ValueError(f"its entries are {kind}")
    if rows != columns or rows > MAX_ORDER:
        raise ValueError(f"it is {rows} x {columns}; square and at most {MAX_ORDER} is expected")
    matrix: Any = mmread(str(file), spmatrix=False)
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix, dtype=float)
