"""Who works blocks of designs out: processes of this machine, or the workers of a dask cluster."""

from __future__ import annotations

import os
import pickle
import queue
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from typing import Any, NamedTuple

from flexura._version import __version__
from flexura.errors import FlexuraError, OptionError, SolverError
from flexura.extras import need
from flexura.sizes import ENVIRONMENT, LIMITS, size_limit
from flexura.study.engine.work import Columns, Work

LOOKED = 0.5
"""Seconds between two looks at whether the process that asks is still there."""


class Answer(NamedTuple):
    """The columns of a block; or why there are none, in words, with the `trace` of what was not foreseen."""

    columns: dict[str, Any] | None
    words: str = ""
    trace: str = ""

    def error(self, designs: str) -> Exception:
        """What is raised in place of the columns of these designs."""
        if not self.trace:
            return SolverError(f"{designs}: {self.words}")
        error = RuntimeError(f"{designs}: {self.words}")
        error.add_note(self.trace)
        return error


def answered(work: Any, number: int) -> Answer:
    """What a block comes to, errors as words: they are raised by another process."""
    try:
        return Answer(work(number))
    except FlexuraError as error:
        return Answer(None, str(error))
    except Exception as error:
        return Answer(None, f"{type(error).__name__}: {error}", traceback.format_exc())


def serve() -> None:
    """Answer until the input ends, or the process that asks is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interruption of the terminal is for the process that asks
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    asked, told = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print
    with suppress(EOFError, BrokenPipeError):
        work = pickle.load(asked)
        while True:
            pickle.dump(answered(work, pickle.load(asked)), told, protocol=pickle.HIGHEST_PROTOCOL)
            told.flush()


def _end_with(parent: int) -> None:
    """End in the middle of a block when the process that asked for it is gone."""
    while os.getppid() == parent:
        time.sleep(LOOKED)
    os._exit(1)


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
        command = [sys.executable, "-P", "-c", "from flexura.study.engine.workers import serve; serve()"]
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


ANSWERS = 10.0
"""Seconds in which a scheduler answers."""

LOST = 30.0
"""Seconds without any worker, or without a scheduler, after which a study ends."""

BUNDLE = 2.0
"""Seconds of work that blocks are bundled to, which makes what a task costs by itself small."""

MOST_OF_A_BUNDLE = 64
IN_FLIGHT = 2
"""Bundles for each worker that are asked for at a time."""

LONGEST_GREETING = 1_000_000
"""Bytes, at most, of what a scheduler says first."""

_ADDRESS = re.compile(r"(?:tcp|tls|ws|wss)://\[?([\w.:%-]+?)\]?:(\d{1,5})")

_ONE = threading.Lock()
"""One block at a time in each process: a plan remembers what it has worked out last."""


class _Bundle(NamedTuple):
    """Answers to blocks by their numbers, and the seconds that they took."""

    answers: list[tuple[int, Answer]]
    seconds: float


def unpacked(payload: bytes) -> Work:
    """The work, as a worker has it."""
    return pickle.loads(payload)


def bundle(work: Work, numbers: list[int]) -> _Bundle:
    """Answers to blocks of these numbers, on a worker."""
    with _ONE:
        begun = time.monotonic()
        return _Bundle([(number, answered(work, number)) for number in numbers], time.monotonic() - begun)


def version() -> str:
    """That of flexura on a worker."""
    return __version__


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A client of the scheduler with this address, which has workers with the same flexura.

    Raises OptionError when it does not answer, has no workers, or other versions there.
    """
    distributed = need("distributed", "cluster")
    found = _ADDRESS.fullmatch(address)
    if found is None:
        raise OptionError(f"{address!r} is no address of a scheduler, such as tcp://192.168.0.7:8786")
    with ExitStack() as stack:
        try:
            with socket.create_connection((found[1], int(found[2])), timeout=ANSWERS) as own:
                if address.startswith("tcp:"):
                    _greeted(own)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                client = distributed.Client(address, timeout=ANSWERS, set_as_default=False)
            stack.callback(_closed, client)
            _check_workers(client, address)
        except OSError as error:
            hint = "start one with `dask scheduler`, and `dask worker` on every machine"
            why = error.strerror or "it is no dask"
            raise OptionError(f"no scheduler answers at {address} ({why}); {hint}") from None
        yield client


def _closed(client: Any) -> None:
    with suppress(Exception):
        client.close(timeout=1)


def _greeted(own: socket.socket) -> None:
    """Raise OSError where what accepts a connection does not begin with a length, as dask does."""
    begun = own.recv(8, socket.MSG_WAITALL)
    if len(begun) < 8 or int.from_bytes(begun, "little") > LONGEST_GREETING:
        raise ConnectionError


def _check_workers(client: Any, address: str) -> None:
    """Raise OptionError where there is no worker, or one without the same flexura."""
    if not client.nthreads():
        raise OptionError(f"the scheduler at {address} has no workers; start some with `dask worker {address}`")
    for worker, found in client.run(version, on_error="return").items():
        if found != __version__:
            what = f"flexura {found}" if isinstance(found, str) else f"no flexura ({found})"
            raise OptionError(f"worker {worker} of {address} has {what}; this is flexura {__version__}")


def on_cluster(
    client: Any, work: Work, numbers: Iterable[int], say: Callable[[str], None]
) -> Generator[tuple[int, Columns]]:
    """Blocks of these numbers by the workers of a cluster, in the order in which they are done.

    Workers that are lost are said. Raises SolverError for what a block raises, and when the scheduler or all workers
    are lost.
    """
    distributed = need("distributed", "cluster")
    try:
        tasks = _Tasks(client, work, numbers, say)
        try:
            yield from tasks.results()
        finally:
            tasks.cancel()
    except (distributed.CancelledError, OSError):  # of whatever is asked, and of what it answers
        raise SolverError(f"the scheduler {client.scheduler.address} is lost") from None


class _Tasks:
    """Bundles on their way."""

    def __init__(self, client: Any, work: Work, numbers: Iterable[int], say: Callable[[str], None]) -> None:
        self.client, self.work, self.say = client, work, say
        self.numbers, self.size, self.left = iter(numbers), 1, work.blocks
        self.distributed = need("distributed", "cluster")
        # as a task, which is done again when the worker that has it is lost
        self.shared = self._submit(unpacked, pickle.dumps(work, protocol=pickle.HIGHEST_PROTOCOL))
        self.pending: dict[Any, list[int]] = {}
        self.ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.workers = set(client.nthreads())
        self.seen = time.monotonic()

    def _submit(self, function: Callable[..., Any], *arguments: Any) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a large plan
            return self.client.submit(function, *arguments, pure=False)

    def results(self) -> Iterator[tuple[int, Columns]]:
        """Blocks as they are done."""
        while self._fill():
            for future in self._done():
                numbers = self.pending.pop(future)
                found = self._result(future, numbers)
                future.release()
                seconds = max(found.seconds / len(found.answers), 1e-6)
                self.size = min(max(int(BUNDLE / seconds), 1), MOST_OF_A_BUNDLE)
                for number, answer in found.answers:
                    if answer.columns is None:
                        start, stop = self.work.span(number)
                        raise answer.error(f"designs {start} to {stop - 1}")
                    yield number, answer.columns

    def _fill(self) -> bool:
        """Ask for as many bundles as may be on their way; whether there are any."""
        most = IN_FLIGHT * max(len(self.workers), 1)
        while len(self.pending) < most and (own := list(islice(self.numbers, min(self.size, -(-self.left // most))))):
            self.left -= len(own)
            future = self._submit(bundle, self.shared, own)
            self.pending[future] = own
            future.add_done_callback(self.ended.put)
        return bool(self.pending)

    def _done(self) -> list[Any]:
        """Bundles that have ended, after a second at most."""
        found = []
        with suppress(queue.Empty):
            found.append(self.ended.get(timeout=1))
            while True:
                found.append(self.ended.get_nowait())
        self._look()
        return found

    def _look(self) -> None:
        """See who is there. Raises SolverError when nobody is for too long."""
        now = time.monotonic()
        if self.client.status != "running":
            raise SolverError(f"the scheduler {self.client.scheduler.address} is lost")
        found = set(self.client.nthreads())
        for lost in sorted(self.workers - found):
            self.say(f"worker {lost} was lost, and others work its blocks out again")
        self.workers = found
        if found:
            self.seen = now
        elif now - self.seen > LOST:
            raise SolverError(f"all workers of {self.client.scheduler.address} are lost")

    def _result(self, future: Any, numbers: list[int]) -> _Bundle:
        first, last = self.work.span(numbers[0])[0], self.work.span(numbers[-1])[1] - 1
        try:
            return future.result(timeout=ANSWERS)
        except self.distributed.KilledWorker:
            raise SolverError(f"workers die at designs {first} to {last}; is there too little memory?") from None

    def cancel(self) -> None:
        """Let nobody work on what is still on its way."""
        with suppress(Exception):
            self.client.cancel([*self.pending, self.shared])
