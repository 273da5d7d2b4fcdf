"""Superelement matrices in a model file: from a Matrix Market file, and in other units than SI.

Real square matrices out of Matrix Market files (Boisvert, Pozo and Remington 1996), checked number by number.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import ExpressionError, OptionError, Path, Problem
from flexura.expressions import LENGTH, MASS, Dimension
from flexura.files import MISSING, read_bytes
from flexura.sizes import beyond
from flexura.units import is_number, parse_unit

_COUNT = re.compile(rb"\d{1,15}")


@dataclass(frozen=True)
class MatrixHeader:
    """What a file says of its matrix; `entries` numbers, or `row column number`, follow from byte `begin` on."""

    rows: int
    columns: int
    entries: int
    is_coordinate: bool
    is_symmetric: bool
    begin: int


def read_header(content: bytes) -> MatrixHeader:
    """The banner and the line of sizes. Raises ValueError for a matrix that is not real and general or symmetric."""
    end = _line_end(content, 0)
    banner = content[:end].decode("ascii", "replace").lower().split()
    if len(banner) != 5 or banner[:2] != ["%%matrixmarket", "matrix"]:
        raise ValueError("its first line is not `%%MatrixMarket matrix FORMAT KIND SYMMETRY`")
    form, kind, symmetry = banner[2:]
    if form not in ("coordinate", "array"):
        raise ValueError(f"its format is {form[:40]}; coordinate or array is expected")
    if kind not in ("real", "integer"):
        raise ValueError(f"its entries are {kind[:40]}")
    if symmetry not in ("general", "symmetric"):
        raise ValueError(f"it is {symmetry[:40]}; general or symmetric is expected")
    line = b"%"
    while line[:1] == b"%" or (not line and end < len(content)):
        begin, end = end + 1, _line_end(content, end + 1)
        line = content[begin:end].strip()
    sizes = line.split()
    is_coordinate, is_symmetric = form == "coordinate", symmetry == "symmetric"
    if len(sizes) != 2 + is_coordinate or not all(_COUNT.fullmatch(size) for size in sizes):
        raise ValueError("its line of sizes is not `ROWS COLUMNS" + (" ENTRIES`" if is_coordinate else "`"))
    rows, columns = int(sizes[0]), int(sizes[1])
    dense = rows * (rows + 1) // 2 if is_symmetric else rows * columns
    return MatrixHeader(rows, columns, int(sizes[2]) if is_coordinate else dense, is_coordinate, is_symmetric, end + 1)


def read_entries(content: bytes, header: MatrixHeader) -> Array:
    """The matrix (rows, columns) of a header. Raises ValueError, with the line, for anything that it does not say."""
    width = 3 if header.is_coordinate else 1
    table = _numbers(content, header.begin, width)
    if len(table) != header.entries:
        raise ValueError(f"its header says {header.entries} entries, there are {len(table)}: is the file complete?")
    matrix = np.zeros((header.rows, header.columns))
    if header.is_coordinate:
        place = table[:, :2]
        if not ((place >= 1) & (place <= (header.rows, header.columns)) & (place == np.round(place))).all():
            raise ValueError(f"an entry lies outside {header.rows} x {header.columns}; rows and columns count from 1")
        row, column = place.astype(np.intp).T - 1
        seen = np.sort(np.minimum(row, column) * header.rows + np.maximum(row, column) if header.is_symmetric else
                       row * header.columns + column)  # fmt: skip
        if (np.diff(seen) == 0).any():
            raise ValueError("an entry is given twice")
        matrix[row, column] = table[:, 2]
        if header.is_symmetric:
            matrix[column, row] = table[:, 2]
    elif header.is_symmetric:  # the lower triangle, column by column
        column, row = np.triu_indices(header.rows)
        matrix[row, column] = matrix[column, row] = table[:, 0]
    else:
        matrix[:] = table[:, 0].reshape(header.columns, header.rows).T
    return matrix


def _numbers(content: bytes, begin: int, width: int) -> Array:
    """The numbers (n, width) of the lines from a byte on."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a file without a number
        try:
            table = np.loadtxt(BytesIO(content[begin:]), comments="%", ndmin=2, encoding="latin-1")
        except ValueError as error:
            raise ValueError(_wrong_line(content, begin, width) or str(error)) from None
    if table.size and (table.shape[1] != width or not np.isfinite(table).all()):
        raise ValueError(_wrong_line(content, begin, width) or f"{table.shape[1]} numbers in each line")
    return table.reshape(-1, width)


def _wrong_line(content: bytes, begin: int, width: int) -> str:
    """The first line that does not hold so many finite numbers, in words; nothing where there is none."""
    first = content.count(b"\n", 0, begin) + 1
    for number, line in enumerate(content[begin:].split(b"\n"), first):
        cells = line.partition(b"%")[0].split()
        if cells and not (len(cells) == width and all(map(is_number, cells))):
            what = "row, column and number are" if width == 3 else "one number is"
            return f"line {number}: {what} expected, not {_shown(line.decode('ascii', 'replace').strip())}"
    return ""


def _line_end(content: bytes, begin: int) -> int:
    end = content.find(b"\n", begin)
    return len(content) if end < 0 else end


def _shown(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")


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
            factor, dimension = parse_unit(str(text))
        except ExpressionError as error:
            raise _RefusedError(("units", key), repr(text), error.rule, error.hint) from None
        if dimension != _UNITS[key]:
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
        problem = refused.problem
        raise _RefusedError((*path, "file"), problem.value or repr(name), problem.rule, problem.hint) from None
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
    if excess := beyond("dense_entries", rows * columns):
        raise _RefusedError((), *excess)
    if (5 if header.is_coordinate else 1) * header.entries > len(content):
        raise ValueError(f"its header says {header.entries} entries, and its {len(content)} bytes cannot hold them")
    return read_entries(content, header)
