"""Variables of MATLAB files: version 4 to 7 by SciPy, in a process of its own, and 7.3, which is HDF5, by h5py."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from flexura.errors import OptionError
from flexura.files import read_bytes
from flexura.io.apart import Take, read_apart, serve
from flexura.io.hdf5 import read_datasets
from flexura.sizes import within

Arrays = dict[str, Any]

_HEADER, _TAG, _COMPRESSED, _PIECE = 128, 8, 15, 1 << 20


def read_variables(path: Path) -> Arrays:
    """Variables and fields of structs by name, with dots between, in MATLAB's order of dimensions; texts as arrays.

    Raises OptionError for files that are damaged, cut off, or unpack to more than the limits of size.
    """
    from scipy.io.matlab import matfile_version

    stream: Any = BytesIO(read_bytes(path))
    try:
        version = matfile_version(stream)[0]
    except Exception:
        raise OptionError(f"{path}: not a MATLAB file, or cut off in its first bytes") from None
    return dict(_of_datasets(read_datasets(path))) if version == 2 else read_apart(__name__, path)


def give(path: Path, take: Take) -> None:
    """Give the variables of a file of version 4 to 7 to `take`. Raises OptionError."""
    from scipy.io import loadmat

    content = read_bytes(path)
    if content[126:128] in (b"IM", b"MI"):
        _refuse_cut_off(content, str(path))
    try:
        stream: Any = BytesIO(content)
        held = loadmat(stream, squeeze_me=True, struct_as_record=False)
    except Exception as error:  # SciPy has one of its own for every kind of damage
        raise OptionError(f"{path}: not a MATLAB file, or damaged: {error}") from None
    for name, value in _flat({name: value for name, value in held.items() if not name.startswith("__")}):
        take(name, value)


def _refuse_cut_off(content: bytes, place: str) -> None:
    """Raise OptionError for a file of version 5 that ends within a variable, or unpacks to more than the limit."""
    order = "<" if content[126:128] == b"IM" else ">"
    at = _HEADER
    unpacked = 0
    while at < len(content):
        kind, size = np.frombuffer(content[at : at + _TAG].ljust(_TAG, b"\0"), f"{order}u4").tolist()
        begin, at = at + _TAG, at + _TAG + size
        if at > len(content):
            raise OptionError(f"{place}: the file ends {at - len(content)} bytes too soon: is it complete?")
        if kind == _COMPRESSED:
            unpack, packed = zlib.decompressobj(), content[begin:at]
            while packed and not unpack.eof:
                try:
                    unpacked += len(unpack.decompress(packed, _PIECE))
                except zlib.error as error:
                    raise OptionError(f"{place}: damaged: {error}") from None
                within("file_bytes", unpacked, f"{place}, unpacked")
                packed = unpack.unconsumed_tail


def _flat(fields: Arrays) -> Iterator[tuple[str, Any]]:
    """Numbers and texts in nested structs; elements of arrays of structs are counted from 1."""
    for name, value in fields.items():
        if hasattr(value, "_fieldnames"):
            inside = {field: getattr(value, field) for field in value._fieldnames}
            yield from ((f"{name}.{own}", array) for own, array in _flat(inside))
        elif isinstance(value, np.ndarray) and value.dtype.hasobject:
            if all(isinstance(text, str) for text in value.ravel()):
                yield name, value.astype(str)
            else:
                elements = {f"{name}{k + 1}": one for k, one in enumerate(value.ravel())}
                yield from _flat({own: one for own, one in elements.items() if hasattr(one, "_fieldnames")})
        elif isinstance(value, str) or np.asarray(value).dtype.kind in "biufcU":
            yield name, np.asarray(value)


def _of_datasets(datasets: Arrays) -> Iterator[tuple[str, Any]]:
    """The same of version 7.3, whose texts are numbers, whose cells are references, and whose dimensions go backwards.

    Elements of arrays of structs are references, too, without the class `cell`.
    """

    def class_of(name: str) -> str:
        kind = datasets.get(f"{name}.MATLAB_class", np.array(b""))
        return np.asarray(kind).astype(str).ravel()[0] if np.asarray(kind).dtype.kind == "S" else str(kind)

    def value_of(name: str) -> Any:
        value = datasets[name]
        if f"{name}.MATLAB_empty" in datasets:
            return np.array("") if class_of(name) == "char" else np.zeros(0)
        if class_of(name) == "char":
            return np.array("".join(map(chr, np.asarray(value).ravel().tolist())))
        if value.dtype.names == ("real", "imag"):
            value = value["real"] + 1j * value["imag"]
        return np.squeeze(value.T)

    for name, value in datasets.items():
        if name.startswith("#") or ".#" in name or name.rpartition(".")[2].startswith("MATLAB_"):
            continue
        if value.dtype.kind == "U" and class_of(name) == "cell":
            cells = [value_of(own) for own in value.T.ravel().tolist()]
            if all(cell.dtype.kind == "U" for cell in cells):
                yield name, np.array([str(cell) for cell in cells])
        elif value.dtype.kind == "U":
            struct, _, field = name.rpartition(".")
            inside = enumerate(value.T.ravel().tolist())
            yield from ((f"{struct}{k + 1}.{field}", value_of(own)) for k, own in inside if own in datasets)
        elif value.dtype.kind in "biufcV":
            yield name, value_of(name)


if __name__ == "__main__":
    serve(give)
