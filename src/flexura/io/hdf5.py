"""Datasets and attributes of HDF5 files from anywhere.

What files claim is counted before it is read, and they lead to no other file.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.errors import FlexuraError, OptionError, need
from flexura.io.apart import Take, read_apart, serve
from flexura.sizes import within


def read_datasets(path: Path) -> dict[str, NDArray[Any]]:
    """Datasets and attributes by name, with dots between groups.

    Raises OptionError without h5py, for files that are damaged, keep data in other files, or claim more than the
    limits of size.
    """
    return read_apart(__name__, path)


def give(path: Path, take: Take) -> None:
    """Give the datasets and attributes of a file to `take`. Raises OptionError."""
    h5py = need("h5py", "experiment")
    try:
        with h5py.File(path, "r") as root:
            arrays = _Arrays(h5py, root, str(path), take)
            arrays.add("", root)
            _refuse_links(h5py, root, str(path))
            root.visititems(arrays.add)
    except FlexuraError:
        raise
    except Exception as error:  # the library has errors of its own and of every kind of damage
        raise OptionError(f"{path}: not an HDF5 file, or damaged: {error}") from None


class _Arrays:
    """Takes arrays within the limits of size."""

    def __init__(self, h5py: Any, root: Any, place: str, take: Take) -> None:
        self.h5py, self.root, self.place, self.give = h5py, root, place, take
        self.count = self.bytes = 0

    def add(self, name: str, item: Any) -> None:
        """The attributes of a group or dataset, and its data."""
        for key in item.attrs:
            attribute = item.attrs.get_id(key)
            self.take(
                f"{name}/{key}" if name else key, attribute.shape, attribute.dtype, lambda key=key: item.attrs[key]
            )
        if isinstance(item, self.h5py.Dataset):
            if item.external or item.is_virtual:
                raise OptionError(f"{self.place}: {name} keeps its data in another file, which is not followed")
            text = self.h5py.check_string_dtype(item.dtype) is not None
            self.take(name, item.shape, item.dtype, lambda: item.asstr()[()] if text else item[()])
        elif isinstance(item, self.h5py.Group):
            _refuse_links(self.h5py, item, self.place)

    def take(self, name: str, shape: tuple[int, ...] | None, dtype: Any, read: Callable[[], Any]) -> None:
        """Read one array when there is room for it; objects other than texts and references are left out."""
        place = f"{self.place}: {name}"
        self.count += 1
        if self.h5py.check_ref_dtype(dtype) is self.h5py.Reference:
            self.take_references(name, shape, read)
            return
        within("arrays", self.count, self.place)
        count = int(np.prod(shape or (), dtype=object))
        if self.h5py.check_vlen_dtype(dtype) is not None or self.h5py.check_string_dtype(dtype) is not None:
            within("arrays", count, f"{place}: texts")
        self.bytes += count * dtype.itemsize
        within("file_bytes", self.bytes, f"{place}, unpacked")
        array = np.asarray(read())
        if array.dtype.hasobject and all(isinstance(x, str) for x in array.ravel().tolist()):
            within("file_bytes", self.bytes + 4 * array.size * max(map(len, array.ravel().tolist()), default=0), place)
            array = array.astype(str)
        if not array.dtype.hasobject:
            self.give(name.replace("/", "."), array)

    def take_references(self, name: str, shape: tuple[int, ...] | None, read: Callable[[], Any]) -> None:
        """Names of what references lead to, as of the cells of MATLAB."""
        within("arrays", self.count + int(np.prod(shape or (), dtype=object)), f"{self.place}: {name}: references")
        found = np.asarray(read())
        names = [self.root[ref].name.strip("/").replace("/", ".") if ref else "" for ref in found.ravel()]
        self.give(name.replace("/", "."), np.array(names, dtype=str).reshape(found.shape))


def _refuse_links(h5py: Any, group: Any, place: str) -> None:
    for name in group:
        if isinstance(group.get(name, getlink=True), h5py.ExternalLink):
            where = f"{group.name.rstrip('/')}/{name}"
            raise OptionError(f"{place}: {where} is a link to another file, which is not followed")


if __name__ == "__main__":
    serve(give)
