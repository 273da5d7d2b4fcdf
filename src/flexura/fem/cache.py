"""Arrays on disk under the SHA-256 digest of what they were computed from.

They lie in $XDG_CACHE_HOME/flexura (~/.cache/flexura); `FLEXURA_CACHE` names another folder, or is `off`. The cache is
only ever a saving of time: what cannot be read is computed again, and what cannot be written is left.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura._version import __version__
from flexura.errors import OptionError
from flexura.files import read_arrays, write_file
from flexura.sizes import size_limits

Arrays = dict[str, NDArray[Any]]

KEY = "content_key"
"""Name under which a file keeps the digest that it belongs to."""

MOST_BYTES = 2_000_000_000
"""Bytes beyond which what was not used for longest is deleted."""

CHECKSUM = "content_checksum"
"""Name under which a file keeps the digest of its arrays and of the digest that it belongs to."""


def cache_folder() -> Path | None:
    """Folder of the cache, which need not exist yet; None where FLEXURA_CACHE is `off`."""
    chosen = os.environ.get("FLEXURA_CACHE", "").strip()
    if chosen.lower() in {"off", "0", "no", "false"}:
        return None
    if chosen:
        return Path(chosen).expanduser()
    home = os.environ.get("XDG_CACHE_HOME", "").strip()
    return (Path(home) if home else Path("~/.cache").expanduser()) / "flexura"


def content_key(*parts: Any) -> str:
    """Digest of arrays, sparse matrices, numbers, texts, dataclasses, mappings and sequences, and of our version.

    Types and shapes count, the order of a mapping does not. Raises OptionError for anything else.
    """
    digest = hashlib.sha256(f"flexura {__version__}".encode())
    _feed(digest, parts)
    return digest.hexdigest()


def remembered(
    name: str, parts: Any, compute: Callable[[], Mapping[str, Any]], enough: Callable[[Arrays], bool] = lambda _: True
) -> Arrays:
    """The arrays by name that `compute` gives, from the cache where they were computed from equal `parts` before.

    `name` says in the file name what they are. What is kept and not `enough` is computed anew. Objects are not stored:
    raises OptionError for arrays of them.
    """
    key = content_key(name, parts)
    folder = cache_folder()
    if folder is None:
        return {k: np.asarray(a) for k, a in compute().items()}
    path = folder / f"{name}-{key[:40]}.npz"
    arrays = _read(path, key)
    if arrays is None or not enough(arrays):
        arrays = {k: np.asarray(a) for k, a in compute().items()}
        if any(a.dtype.hasobject for a in arrays.values()) or {KEY, CHECKSUM} & arrays.keys():
            raise OptionError(f"only arrays of numbers and texts are kept in the cache, none by the name {KEY}")
        _write(path, key, arrays)
    return arrays


def _read(path: Path, key: str) -> Arrays | None:
    try:
        with size_limits(file_bytes=MOST_BYTES):  # as much as the cache may hold
            arrays = read_arrays(path)
    except (OptionError, MemoryError):
        return None
    stored_key, checksum = (str(arrays.pop(name, "")) for name in (KEY, CHECKSUM))
    if stored_key != key or checksum != content_key(key, dict(arrays)):
        return None
    with suppress(OSError):
        path.touch()
    return arrays


def _write(path: Path, key: str, arrays: Arrays) -> None:
    """Written whole or not at all, so that nobody ever reads half a file; what cannot be written is left."""
    labels = {KEY: np.array(key), CHECKSUM: np.array(content_key(key, arrays))}
    with suppress(OSError, OptionError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, lambda file: np.savez(file, **labels, **arrays))  # pyright: ignore[reportArgumentType]
        _make_room(path)


def _make_room(newest: Path) -> None:
    """Delete files that were not used for longest, beyond the limit; the newest one stays."""
    files = [(file.stat(), file) for file in newest.parent.glob("*.npz") if file != newest]
    room = MOST_BYTES - newest.stat().st_size
    for stat, file in sorted(files, key=lambda item: -item[0].st_mtime_ns):
        room -= stat.st_size
        if room < 0:
            file.unlink(missing_ok=True)


def _feed(digest: Any, value: Any) -> None:
    """One value with its type and size, so that no two different ones give the same bytes."""
    if isinstance(value, np.ndarray | np.generic):
        array = np.ascontiguousarray(value)
        if array.dtype.hasobject:
            raise OptionError("arrays of objects have no content key")
        digest.update(f"array {array.dtype.str} {np.shape(value)}:".encode())
        digest.update(array.tobytes())
    elif sp.issparse(value):
        matrix: Any = value.tocsc(copy=True)  # pyright: ignore[reportAttributeAccessIssue]
        matrix.sum_duplicates()
        _feed(digest, ("sparse", np.array(matrix.shape), matrix.data, matrix.indices, matrix.indptr))
    elif value is None or isinstance(value, bool | int | float | complex):
        digest.update(f"{type(value).__name__} {value!r};".encode())
    elif isinstance(value, str | bytes):
        raw = value.encode() if isinstance(value, str) else value
        digest.update(f"{type(value).__name__} {len(raw)}:".encode() + raw)
    elif is_dataclass(value) and not isinstance(value, type):
        digest.update(f"dataclass {type(value).__name__}:".encode())
        _feed(digest, {field.name: getattr(value, field.name) for field in fields(value)})
    elif isinstance(value, Mapping):
        digest.update(f"mapping {len(value)}:".encode())
        for key in sorted(value, key=lambda k: (type(k).__name__, str(k))):
            _feed(digest, key)
            _feed(digest, value[key])
    elif isinstance(value, list | tuple | range):
        digest.update(f"sequence {len(value)}:".encode())
        for item in value:
            _feed(digest, item)
    else:
        raise OptionError(f"a {type(value).__name__} has no content key: give its arrays, numbers and texts")
