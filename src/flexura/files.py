"""Files that appear in one step: what was there before stays until the new one is complete."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from flexura.errors import OptionError


@contextmanager
def complete_file(path: str | Path) -> Iterator[Path]:
    """A path to write to, which takes the place of `path` when all went well and is removed otherwise.

    It has the suffix of `path`. Raises OptionError when the file cannot be written.
    """
    try:
        target = Path(path).expanduser().resolve()
        if target.is_dir():
            raise OptionError(f"{path} cannot be written: it is a folder, not a file")
        if not target.parent.is_dir():
            raise OptionError(f"{path} cannot be written: there is no folder {target.parent}")
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
        scratch = Path(tempfile.mkdtemp(prefix=".flexura-", dir=target))
        try:
            yield scratch
            for file in sorted(scratch.iterdir()):
                _flush(file)
            for file in sorted(scratch.iterdir()):
                file.replace(target / file.name)
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
            if made and not any(target.iterdir()):
                target.rmdir()
    except (OSError, ValueError) as error:
        raise _refused(folder, error) from None


def write_file(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Let `write` make a file that appears complete or not at all; returns its path."""
    with complete_file(path) as temporary:
        write(temporary)
    return Path(path)


def _flush(file: Path) -> None:
    with file.open("rb") as stream:
        os.fsync(stream.fileno())


def _refused(path: str | Path, error: Exception) -> OptionError:
    return OptionError(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}")
