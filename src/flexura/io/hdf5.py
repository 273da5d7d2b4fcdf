"""HDF5 files from anywhere, read by a process of its own: the library can crash or hang on a damaged file.

What files claim is counted before it is read, and they lead to no other file. A process takes a quarter of a second.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from flexura.errors import FlexuraError, OptionError, need
from flexura.files import refuse_unreadable
from flexura.sizes import ENVIRONMENT, size_limit, within

LIMITS = ("arrays", "file_bytes")
"""Limits of size that hold for the file."""

SECONDS = 10.0
"""Processor time that a file may take, beside what its bytes take."""

BYTES_PER_SECOND = 20e6
"""Speed at which a file is read at least."""

MEMORY = 4 << 30
"""Bytes of address space that reading may take, beside three times those that a file may unpack to."""

_ARRAY, _REFUSED, _END = b"a", b"r", b"."


def read_datasets(path: Path) -> dict[str, NDArray[Any]]:
    """Datasets and attributes by name, with dots between groups.

    Raises OptionError without h5py, for files that are damaged, keep data in other files, or claim more than the
    limits of size.
    """
    size = refuse_unreadable(path)
    limits = ",".join(f"{name}={size_limit(name)}" for name in LIMITS)
    where = os.pathsep.join(folder for folder in sys.path if folder)
    command = [sys.executable, "-P", "-m", __name__, str(path), str(SECONDS + size / BYTES_PER_SECOND)]
    env = {**os.environ, ENVIRONMENT: limits, "PYTHONPATH": where, "OPENBLAS_NUM_THREADS": "1"}
    try:
        with subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=env
        ) as process:
            try:
                return _received(process.stdout, str(path))
            finally:
                process.kill()
    except OSError as error:
        raise OptionError(f"{path}: no process to read it in: {error}") from None


def _received(stream: Any, place: str) -> dict[str, NDArray[Any]]:
    """Arrays as `_send` has written them. Raises OptionError in the words of the process, and where it has died."""
    arrays: dict[str, NDArray[Any]] = {}
    pipe: Any = SimpleNamespace(read=stream.read)  # NumPy does not take it for a file in which it can seek
    while (kind := pipe.read(1)) == _ARRAY:
        with suppress(ValueError):  # of an array that was cut short
            name = str(np.lib.format.read_array(pipe, allow_pickle=False))
            arrays[name] = np.lib.format.read_array(pipe, allow_pickle=False)
    if kind == _END:
        return arrays
    if kind == _REFUSED:
        raise OptionError(pipe.read(-1).decode())
    raise OptionError(f"{place}: damaged: the HDF5 library fails, or does not end, while it reads the file")


def _send(name: str, array: NDArray[Any], stream: BinaryIO) -> None:
    pipe: Any = SimpleNamespace(write=stream.write)
    stream.write(_ARRAY)
    np.lib.format.write_array(pipe, np.array(name), allow_pickle=False)
    np.lib.format.write_array(pipe, array, allow_pickle=False)


def _serve(path: Path, seconds: float) -> None:
    """Write the arrays of a file, or why it is refused, to stdout; within limits of memory and processor time."""
    with suppress(ImportError):  # Windows has none
        import resource

        memory, used = MEMORY + 3 * size_limit("file_bytes"), int(time.process_time() + seconds) + 1
        for what, most in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, used), (resource.RLIMIT_CORE, 0)):
            hard = resource.getrlimit(what)[1]
            least = most if hard == resource.RLIM_INFINITY else min(most, hard)
            resource.setrlimit(what, (least, least))
    stream = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what the library prints
    try:
        _read(path, lambda name, array: _send(name, array, stream))
        stream.write(_END)
    except FlexuraError as error:
        stream.write(_REFUSED + str(error).encode("utf-8", "replace"))
    stream.flush()


def _read(path: Path, take: Callable[[str, NDArray[Any]], None]) -> None:
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

    def __init__(self, h5py: Any, root: Any, place: str, take: Callable[[str, NDArray[Any]], None]) -> None:
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
    _serve(Path(sys.argv[1]), float(sys.argv[2]))
