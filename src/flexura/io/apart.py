"""Files from anywhere, read by a process of their own: libraries can crash or hang on a damaged file.

What arrives are arrays by name. A process takes a quarter of a second.
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

from flexura.errors import FlexuraError, OptionError
from flexura.files import refuse_unreadable
from flexura.sizes import ENVIRONMENT, size_limit

LIMITS = ("arrays", "file_bytes")
"""Limits of size that hold for the file."""

SECONDS = 10.0
"""Processor time that a file may take, beside what its bytes take."""

BYTES_PER_SECOND = 20e6
"""Speed at which a file is read at least."""

MEMORY = 4 << 30
"""Bytes of address space that reading may take, beside three times those that a file may unpack to."""

_ARRAY, _REFUSED, _END = b"a", b"r", b"."

Take = Callable[[str, NDArray[Any]], None]
"""What takes an array and its name."""


def read_apart(module: str, path: Path) -> dict[str, NDArray[Any]]:
    """The arrays that a module, which serves when it is run, finds in a file, by name.

    Raises OptionError as that does, and for files at which it crashes or does not end.
    """
    size = refuse_unreadable(path)
    limits = ",".join(f"{name}={size_limit(name)}" for name in LIMITS)
    where = os.pathsep.join(folder for folder in sys.path if folder)
    command = [sys.executable, "-P", "-m", module, str(path), str(SECONDS + size / BYTES_PER_SECOND)]
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
    raise OptionError(f"{place}: damaged: the library fails, or does not end, while it reads the file")


def _send(name: str, array: NDArray[Any], stream: BinaryIO) -> None:
    pipe: Any = SimpleNamespace(write=stream.write)
    stream.write(_ARRAY)
    np.lib.format.write_array(pipe, np.array(name), allow_pickle=False)
    np.lib.format.write_array(pipe, array, allow_pickle=False)


def serve(give: Callable[[Path, Take], None]) -> None:
    """Write the arrays of the file of the command line, or why it is refused, to stdout; within its seconds of
    processor time and within limits of memory."""
    path, seconds = Path(sys.argv[1]), float(sys.argv[2])
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
        give(path, lambda name, array: _send(name, array, stream))
        stream.write(_END)
    except FlexuraError as error:
        stream.write(_REFUSED + str(error).encode("utf-8", "replace"))
    stream.flush()
