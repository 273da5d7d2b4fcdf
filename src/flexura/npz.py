"""NumPy archives from anywhere: what they claim is checked before it is made, and nothing is unpickled."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from flexura.errors import FlexuraError, OptionError
from flexura.files import open_ordinary
from flexura.sizes import within

_SUFFIX = ".npy"


def read_arrays(path: str | Path) -> dict[str, NDArray[Any]]:
    """The arrays of a NumPy archive by name.

    Raises OptionError when it is none, is damaged, holds Python objects, or claims more than the limits of size or
    more than it has.
    """
    try:
        with open_ordinary(path) as stream, zipfile.ZipFile(stream) as archive:
            entries = archive.infolist()
            within("arrays", len(entries), str(path))
            within("file_bytes", sum(entry.file_size for entry in entries), f"{path}, unpacked")
            return {entry.filename.removesuffix(_SUFFIX): _array(archive, entry) for entry in entries}
    except FlexuraError:
        raise
    except Exception as error:  # zipfile, zlib, tokenize and ast each have their own
        raise OptionError(f"{path}: not a NumPy archive of arrays: {error}") from None


def _array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> NDArray[Any]:
    """One array, whose header is held against the bytes that follow it."""
    with archive.open(entry) as stream:
        shape, dtype, begin = _header(stream)  # pyright: ignore[reportArgumentType]
        claimed = math.prod(shape) * dtype.itemsize
        if dtype.hasobject:
            raise ValueError(f"{entry.filename} holds Python objects")
        if begin + claimed != entry.file_size:
            raise ValueError(f"{entry.filename} claims {claimed} bytes by its shape, it has {entry.file_size - begin}")
    with archive.open(entry) as stream:
        return np.asarray(np.lib.format.read_array(stream, allow_pickle=False))


def _header(stream: BinaryIO) -> tuple[tuple[int, ...], np.dtype[Any], int]:
    """Shape, type, and where the data begin."""
    version = np.lib.format.read_magic(stream)
    read = {(1, 0): np.lib.format.read_array_header_1_0}.get(version, np.lib.format.read_array_header_2_0)
    shape, _, dtype = read(stream)
    return shape, dtype, stream.tell()
