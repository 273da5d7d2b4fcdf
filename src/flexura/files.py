"""Files in and out: ordinary ones of bounded size are read, and new ones appear in one step.

What NumPy archives claim is checked before it is made, and nothing in them is unpickled. What was there before stays
until a new file is complete.
"""

from __future__ import annotations

import csv
import math
import os
import platform
import re
import shutil
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from flexura.errors import FlexuraError, OptionError, need
from flexura.sizes import within

_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a directory",
}
_PIECE = 1 << 20
_MACHINE = re.sub(r"\W", "_", platform.node())[:40]
SCRATCH = "flexura-"
"""How names of temporary folders begin; those in a folder of results are hidden, too."""

MISSING = "the file does not exist"


def refuse_unreadable(path: str | Path, limit: str = "file_bytes") -> int:
    """Bytes of an ordinary file. Raises OptionError for one that is missing, larger than the limit of size, or no
    ordinary file: folders, pipes and devices, which may wait or run without end.
    """
    with open_ordinary(path, limit) as stream:
        return os.fstat(stream.fileno()).st_size


def open_ordinary(path: str | Path, limit: str = "file_bytes") -> BinaryIO:
    """Open an ordinary file for reading. Raises OptionError as `refuse_unreadable`."""
    try:
        # without O_NONBLOCK a pipe that nobody writes to would be waited for
        number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise OptionError(f"{path}: {MISSING}") from None
    except (OSError, ValueError) as error:
        raise OptionError(f"{path}: the file cannot be read: {_reason(error)}") from None
    found = os.fstat(number)
    if not stat.S_ISREG(found.st_mode):
        os.close(number)
        kind = _KINDS.get(stat.S_IFMT(found.st_mode), "no ordinary file")
        raise OptionError(f"{path}: the file cannot be read: an ordinary file is expected, this is {kind}")
    try:
        within(limit, found.st_size, str(path))
    except OptionError:
        os.close(number)
        raise
    return os.fdopen(number, "rb")


def read_bytes(path: str | Path, limit: str = "file_bytes") -> bytes:
    """Content of an ordinary file; that of NAME.gz is unpacked, up to the limit of size.

    Raises OptionError as `refuse_unreadable`, and for packed files that are damaged or unpack to more.
    """
    with open_ordinary(path, limit) as stream:
        try:
            content = stream.read()
        except OSError as error:
            raise OptionError(f"{path}: the file cannot be read: {_reason(error)}") from None
    return _unpacked(content, str(path), limit) if str(path).endswith(".gz") else content


def read_text(path: str | Path, limit: str = "file_bytes", encoding: str = "utf-8-sig") -> str:
    """Text of an ordinary file. Raises OptionError as `read_bytes`, and where it is not in that encoding."""
    try:
        return read_bytes(path, limit).decode(encoding)
    except UnicodeDecodeError as error:
        raise OptionError(f"{path}: the file cannot be read: {error}") from None


def _unpacked(content: bytes, place: str, limit: str) -> bytes:
    """Content of gzip members, one behind the other."""
    found, size = [], 0
    while content:
        unpack = zlib.decompressobj(wbits=31)
        try:
            while not unpack.eof:
                piece = unpack.decompress(content, _PIECE)
                size += len(piece)
                within(limit, size, f"{place}, unpacked")
                found.append(piece)
                content = unpack.unconsumed_tail
                if not piece and not content and not unpack.eof:
                    raise OptionError(f"{place}: the packed file ends too soon: is it complete?")
        except zlib.error as error:
            raise OptionError(f"{place}: not a packed file, or damaged: {error}") from None
        content = unpack.unused_data.lstrip(b"\0")
    return b"".join(found)


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


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
            return {entry.filename.removesuffix(".npy"): _array(archive, entry) for entry in entries}
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


@contextmanager
def complete_file(path: str | Path) -> Iterator[Path]:
    """A path to write to, which takes the place of `path` when all went well and is removed otherwise.

    It has the suffix of `path`; a device or a pipe is written to itself. Raises OptionError when the file cannot be
    written.
    """
    try:
        target = Path(path).expanduser().resolve()
        if target.is_dir():
            raise OptionError(f"{path} cannot be written: it is a folder, not a file")
        if not target.parent.is_dir():
            raise OptionError(f"{path} cannot be written: there is no folder {target.parent}")
        if target.exists() and not target.is_file():
            yield target
            return
        with complete_files(target.parent) as folder:
            yield folder / target.name
    except (OSError, ValueError) as error:
        raise _refused(path, error) from None


@contextmanager
def complete_files(folder: str | Path, make: bool = False) -> Iterator[Path]:
    """A scratch folder whose files are moved into `folder`, each in one step, when all went well.

    With `make` the folder is made when it is missing. Raises OptionError when it cannot be written to.
    """
    try:
        target = Path(folder).expanduser().resolve()
        made = make and not target.exists()
        if made:
            target.mkdir(parents=True)
        elif not target.is_dir():
            raise OptionError(f"there is no folder {folder}")
        try:
            with scratch_folder(target, f".{SCRATCH}") as scratch:
                yield scratch
                for file in sorted(scratch.iterdir()):
                    _flush(file)
                for file in sorted(scratch.iterdir()):
                    file.replace(target / file.name)
        finally:
            if made and not any(target.iterdir()):
                target.rmdir()
    except (OSError, ValueError) as error:
        raise _refused(folder, error) from None


@contextmanager
def scratch_folder(parent: str | Path | None = None, prefix: str = SCRATCH) -> Iterator[Path]:
    """A folder of one's own, by default among the temporary files of the system, that is removed at the end.

    Those that processes of this machine have left there, because they were killed, are removed before. A folder in use
    is locked, which a killed process no longer holds. Raises OSError when no folder can be made.
    """
    parent = Path(tempfile.gettempdir() if parent is None else parent)
    prefix += f"{_MACHINE}-"
    for left in parent.glob(f"{prefix}*"):
        lock = _locked(left)
        if lock is not None:
            shutil.rmtree(left, ignore_errors=True)
            os.close(lock)
    folder = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
    while (lock := _locked(folder)) is None and not folder.exists():  # it was taken for one that was left
        folder = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def _locked(folder: Path) -> int | None:
    """Number of a lock on a folder that is there and that nobody uses; None otherwise, and where there are no locks."""
    try:
        import fcntl

        number = os.open(folder, os.O_RDONLY | os.O_NOFOLLOW)
    except (ImportError, OSError):
        return None
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.fstat(number).st_ino == folder.lstat().st_ino:
            return number
    except OSError:
        pass
    os.close(number)
    return None


def write_file(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Let `write` make a file that appears complete or not at all; returns its path."""
    with complete_file(path) as temporary:
        write(temporary)
    return Path(path)


def _flush(file: Path) -> None:
    with file.open("rb") as stream:
        os.fsync(stream.fileno())


def _refused(path: str | Path, error: Exception) -> OptionError:
    return OptionError(f"{path} cannot be written: {_reason(error)}")


TABLES = (".csv", ".parquet")
"""Suffixes of tables."""


def write_table(blocks: Iterable[Mapping[str, Any]], path: Path, as_arrow: Callable[..., Any] | None = None) -> Path:
    """Write columns by their headings, block by block, as .csv or .parquet, in one step.

    What is not known is an empty cell; `as_arrow` makes an Arrow table of a block where its columns have types of their
    own. Raises OptionError for other names, and without pyarrow for .parquet.
    """

    def as_csv(file: Path) -> None:
        with file.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            for k, block in enumerate(blocks):
                if k == 0:
                    writer.writerow(block)
                lists = [
                    ["" if isinstance(x, float) and math.isnan(x) else x for x in _list(own)] for own in block.values()
                ]
                writer.writerows(zip(*lists, strict=True))

    def as_parquet(file: Path) -> None:
        make, writer = as_arrow or need("pyarrow", "parquet").table, None
        try:
            for block in blocks:
                table = make({name: x if isinstance(x, np.ndarray) else [*x] for name, x in block.items()})
                writer = writer or need("pyarrow.parquet", "parquet").ParquetWriter(file, table.schema)
                writer.write_table(table)
        finally:
            if writer is not None:
                writer.close()

    if path.suffix.lower() not in TABLES:
        raise OptionError(f"{path} is no name of a table: it must be named {' or '.join(TABLES)}")
    return write_file(path, as_csv if path.suffix.lower() == ".csv" else as_parquet)


def _list(column: Any) -> list[Any]:
    return column.tolist() if isinstance(column, np.ndarray) else list(column)
