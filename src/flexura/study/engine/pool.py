"""A local pool of processes: each is sent the work once, then a number of a block at a time.

They are programs of their own, not copies of this one, so that a script needs no guard around what it does, and their
linear algebra has one thread each.
"""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

from flexura.errors import SolverError
from flexura.sizes import ENVIRONMENT, LIMITS, size_limit
from flexura.study.engine.work import Columns, Work
from flexura.study.engine.worker import Answer

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")

WAITING = 2
"""Blocks for each process that may wait for being written."""

LAST_WORDS = 2000
"""Bytes of what a process that died has said."""


def cpu_count() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def on_processes(
    work: Work, numbers: Iterable[int], workers: int, say: Callable[[str], None]
) -> Iterator[tuple[int, Columns]]:
    """Blocks of these numbers by so many processes, in the order in which they are done.

    A process that dies is named to `say`, and its block asked once more. Raises SolverError when that dies too, and for
    what a block raises. Processes end with the iterator.
    """
    pool = _Pool(work, numbers, workers, say)
    try:
        yield from pool.results()
    finally:
        pool.close()


class _Done(NamedTuple):
    """A block that is done, or an error that ends the study; nothing when a process has nothing left to do."""

    number: int = -1
    columns: Columns | None = None
    error: Exception | None = None


class _Pool:
    """Threads that each look after one process."""

    def __init__(self, work: Work, numbers: Iterable[int], workers: int, say: Callable[[str], None]) -> None:
        self.work, self.say = work, say
        self.payload, self.environment = pickle.dumps(work, protocol=pickle.HIGHEST_PROTOCOL), _environment()
        self._numbers, self._lock, self._closed = iter(numbers), threading.Lock(), False
        self._processes: list[_Process] = []
        self._done: queue.Queue[_Done] = queue.Queue(maxsize=WAITING * workers)
        self._threads = [threading.Thread(target=self._look_after, daemon=True) for _ in range(workers)]
        for thread in self._threads:
            thread.start()

    def results(self) -> Iterator[tuple[int, Columns]]:
        """Blocks as they are done."""
        left = len(self._threads)
        while left:
            done = self._done.get()
            if done.error is not None:
                raise done.error
            if done.columns is None:
                left -= 1
            else:
                yield done.number, done.columns

    def close(self) -> None:
        """End all processes, whatever they are at."""
        self._closed = True
        with self._lock:
            processes = list(self._processes)
        for process in processes:
            process.popen.kill()
        while any(thread.is_alive() for thread in self._threads):  # one may wait for its result to be taken
            with suppress(queue.Empty):
                self._done.get(timeout=0.05)
        for process in self._processes:
            process.end()

    def _next(self) -> int | None:
        with self._lock:
            return None if self._closed else next(self._numbers, None)

    def _look_after(self) -> None:
        """Have one process work until no block is left."""
        process = None
        try:
            while (number := self._next()) is not None:
                if process is None:
                    process = self._started()
                process, answer = self._asked(process, number)
                error = answer.error(self._designs(number)) if answer.columns is None else None
                self._done.put(_Done(number, answer.columns, error))
            self._done.put(_Done())
        except Exception as error:
            self._done.put(_Done(error=error))

    def _asked(self, process: _Process, number: int) -> tuple[_Process, Answer]:
        """The answer to a number, of a new process where the first one dies, and the process that gave it."""
        answer = process.ask(number)
        if answer is None and not self._closed:
            words = f"worker {process.said()} at {self._designs(number)}"
            self.say(f"{words}, which another worker worked out again")
            process.end()
            process = self._started()
            answer = process.ask(number)
            if answer is None:
                raise SolverError(f"{words}, and so did another: {process.said()}; is there too little memory?")
        return process, answer or Answer(None, "stopped")

    def _designs(self, number: int) -> str:
        start, stop = self.work.span(number)
        return f"designs {start} to {stop - 1}"

    def _started(self) -> _Process:
        process = _Process(self.payload, self.environment)
        with self._lock:
            self._processes.append(process)
            closed = self._closed
        if closed:
            process.popen.kill()
        return process


def _environment() -> dict[str, str]:
    """Variables of a worker: packages from where they come from here, the same limits of size, one thread."""
    limits = ",".join(f"{name}={size_limit(name)}" for name in LIMITS)
    where = os.pathsep.join(folder for folder in sys.path if folder)
    return {**os.environ, **dict.fromkeys(_THREADS, "1"), ENVIRONMENT: limits, "PYTHONPATH": where}


class _Process:
    """A worker, which has been sent the work."""

    def __init__(self, payload: bytes, environment: Mapping[str, str]) -> None:
        command = [sys.executable, "-P", "-c", "from flexura.study.engine.worker import serve; serve()"]
        self._words = tempfile.TemporaryFile()  # noqa: SIM115  closed with the process
        try:
            self.popen = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._words, env=environment
            )
        except OSError as error:
            self._words.close()
            raise SolverError(f"no process to work in: {error}") from None
        with suppress(OSError):
            self._in.write(payload)

    @property
    def _in(self) -> Any:
        return self.popen.stdin

    def ask(self, number: int) -> Answer | None:
        """The answer to a number; None of a process that has died."""
        try:
            self._in.write(pickle.dumps(number))
            self._in.flush()
            return pickle.load(self.popen.stdout)  # pyright: ignore[reportArgumentType]
        except (OSError, EOFError, pickle.UnpicklingError):
            return None

    def said(self) -> str:
        """How a process has died, and its last words."""
        status = self.popen.wait()
        how = f"was killed by signal {-status}" if status < 0 else f"ended with status {status}"
        self._words.seek(max(self._words.seek(0, os.SEEK_END) - LAST_WORDS, 0))
        last = self._words.read().decode("utf-8", "replace").strip().rpartition("\n")[2]
        return f"{self.popen.pid} {how}" + (f" ({last})" if last else "")

    def end(self) -> None:
        """Let it go."""
        self.popen.kill()
        with suppress(OSError):
            self._in.close()
        if self.popen.stdout is not None:
            self.popen.stdout.close()
        self.popen.wait()
        self._words.close()
