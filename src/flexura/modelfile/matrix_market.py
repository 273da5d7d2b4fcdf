"""Real square matrices out of Matrix Market files (Boisvert, Pozo and Remington 1996), checked number by number."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from io import BytesIO

import numpy as np

from flexura.arrays import Array

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
    found = np.zeros((header.rows, header.columns))
    if header.is_coordinate:
        place = table[:, :2]
        if not ((place >= 1) & (place <= (header.rows, header.columns)) & (place == np.round(place))).all():
            raise ValueError(f"an entry lies outside {header.rows} x {header.columns}; rows and columns count from 1")
        row, column = place.astype(np.intp).T - 1
        seen = np.sort(np.minimum(row, column) * header.rows + np.maximum(row, column) if header.is_symmetric else
                       row * header.columns + column)  # fmt: skip
        if (np.diff(seen) == 0).any():
            raise ValueError("an entry is given twice")
        found[row, column] = table[:, 2]
        if header.is_symmetric:
            found[column, row] = table[:, 2]
    elif header.is_symmetric:  # the lower triangle, column by column
        column, row = np.triu_indices(header.rows)
        found[row, column] = found[column, row] = table[:, 0]
    else:
        found[:] = table[:, 0].reshape(header.columns, header.rows).T
    return found


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
        if cells and not (len(cells) == width and all(map(_is_number, cells))):
            what = "row, column and number are" if width == 3 else "one number is"
            return f"line {number}: {what} expected, not {_shown(line.decode('ascii', 'replace').strip())}"
    return ""


def _is_number(text: bytes) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False


def _line_end(content: bytes, begin: int) -> int:
    end = content.find(b"\n", begin)
    return len(content) if end < 0 else end


def _shown(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")
