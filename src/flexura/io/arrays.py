"""NumPy archives and HDF5 files of state spaces, second-order models and frequency responses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from flexura._version import __version__
from flexura.extras import need
from flexura.files import write_file
from flexura.io.contents import contents, is_sparse


def write_npz(what: Any, path: str | Path, damping: Any | None = None) -> Path:
    """Write a NumPy archive, which needs no pickling to be read; see `contents` for the names of its arrays.

    A sparse matrix K is `K.data`, `K.indices`, `K.indptr` (by columns) and `K.shape`. Continuous models have dt = 0.
    Raises OptionError for things that have no arrays and when the file cannot be written.
    """
    arrays: dict[str, Any] = {"flexura": np.array(__version__)}
    value: Any
    for name, value in contents(what, damping).items():
        if is_sparse(value):
            arrays |= {f"{name}.{part}": np.asarray(getattr(value, part)) for part in ("data", "indices", "indptr")}
            arrays[f"{name}.shape"] = np.array(value.shape)
        else:
            arrays[name] = np.array(value, dtype=str) if isinstance(value, list) else np.asarray(value)

    def write(file: Path) -> None:
        with file.open("wb") as stream:
            np.savez_compressed(stream, **arrays)

    return write_file(path, write)


def write_hdf5(what: Any, path: str | Path, damping: Any | None = None) -> Path:
    """Write an HDF5 file with a dataset for every array and list of texts, and numbers and texts as attributes.

    A sparse matrix is a group with `data`, `indices`, `indptr` (by columns) and the attribute `shape`. Continuous
    models have dt = 0. Raises OptionError without h5py, for things that have no arrays, and when the file cannot be
    written.
    """
    h5py = need("h5py", "export")
    items = contents(what, damping)

    def write(file: Path) -> None:
        with h5py.File(file, "w") as root:
            root.attrs["flexura"] = __version__
            for name, value in items.items():
                if is_sparse(value):
                    group = root.create_group(name)
                    group.attrs["shape"] = value.shape
                    for part in ("data", "indices", "indptr"):
                        group[part] = getattr(value, part)
                elif isinstance(value, list):
                    root.create_dataset(name, (len(value),), h5py.string_dtype(), value)
                elif isinstance(value, np.ndarray):
                    root[name] = value
                else:
                    root.attrs[name] = value

    return write_file(path, write)
