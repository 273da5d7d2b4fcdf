"""HDF5 files from anywhere: what they claim is counted before it is read, and they lead to no other file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.errors import FlexuraError, OptionError
from flexura.extras import need
from flexura.files import refuse_unreadable
from flexura.sizes import within


def read_datasets(path: Path) -> dict[str, NDArray[Any]]:
    """Datasets and attributes by name, with dots between groups.

    Raises OptionError without h5py, for files that are damaged, keep data in other files, or claim more than the
    limits of size.
    """
    h5py = need("h5py", "experiment")
    refuse_unreadable(path)
    found = _Found(h5py, str(path))
    try:
        with h5py.File(path, "r") as root:
            found.add("", root)
            _refuse_links(h5py, root, str(path))
            root.visititems(found.add)
    except FlexuraError:
        raise
    except Exception as error:  # the library has errors of its own and of every kind of damage
        raise OptionError(f"{path}: not an HDF5 file, or damaged: {error}") from None
    return found.arrays


class _Found:
    """Collects arrays within the limits of size."""

    def __init__(self, h5py: Any, place: str) -> None:
        self.h5py, self.place = h5py, place
        self.arrays: dict[str, NDArray[Any]] = {}
        self.bytes = 0

    def add(self, name: str, item: Any) -> None:
        """The attributes of a group or dataset, and its data."""
        for key in item.attrs:
            own = item.attrs.get_id(key)
            self.take(f"{name}/{key}" if name else key, own.shape, own.dtype, lambda key=key: item.attrs[key])
        if isinstance(item, self.h5py.Dataset):
            if item.external or item.is_virtual:
                raise OptionError(f"{self.place}: {name} keeps its data in another file, which is not followed")
            text = self.h5py.check_string_dtype(item.dtype) is not None
            self.take(name, item.shape, item.dtype, lambda: item.asstr()[()] if text else item[()])
        elif isinstance(item, self.h5py.Group):
            _refuse_links(self.h5py, item, self.place)

    def take(self, name: str, shape: tuple[int, ...] | None, dtype: Any, read: Any) -> None:
        """Read one array when there is room for it."""
        place = f"{self.place}: {name}"
        within("arrays", len(self.arrays) + 1, self.place)
        count = int(np.prod(shape or (), dtype=object))
        if self.h5py.check_vlen_dtype(dtype) is not None or self.h5py.check_string_dtype(dtype) is not None:
            within("arrays", count, f"{place}: texts")
        self.bytes += count * dtype.itemsize
        within("file_bytes", self.bytes, f"{place}, unpacked")
        self.arrays[name.replace("/", ".")] = np.asarray(read())


def _refuse_links(h5py: Any, group: Any, place: str) -> None:
    for name in group:
        if isinstance(group.get(name, getlink=True), h5py.ExternalLink):
            where = f"{group.name.rstrip('/')}/{name}"
            raise OptionError(f"{place}: {where} is a link to another file, which is not followed")
