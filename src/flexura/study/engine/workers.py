"""Who works blocks of designs out: processes of this machine, or the workers of a dask cluster.

Processes are programs of their own, not copies of this one, so that a script needs no guard around what it does, and
their linear algebra has one thread each. They read pickles from their standard input, the work first, and answer each
number of a block on their standard output. A cluster is sent the work once, and blocks in bundles.
"""

from __future__ import annotations

import os
import pickle
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
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from typing import Any, NamedTuple

from flexura._version import __version__
from flexura.errors import FlexuraError, OptionError, SolverError, need
from flexura.sizes import ENVIRONMENT, LIMITS, size_limit
from flexura.study.engine.work import Blocks, Columns

LARGEST_BUNDLE = 64
BUNDLE_SECONDS = 2.0
"""Seconds of work that blocks are bundled to, which makes what a task costs by itself small."""


class Answer(NamedTuple):
    """The columns of a block; or why there are none, in words, with the `trace` of what was not foreseen."""

    columns: Columns | None
    words: str = ""
    trace: str = ""

    def error(self, designs: str) -> Exception:
        """What is raised in place of the columns of these designs."""
        if not self.trace:
            return SolverError(f"{designs}: {self.words}")
        error = RuntimeError(f"{designs}: {self.words}")
        error.add_note(self.trace)
        return error


class Bundle(NamedTuple):
    """Answers to blocks, and the seconds that they took."""

    answers: list[Answer]
    seconds: float


def answered(work: Blocks, number: int) -> Answer:
    """What a block comes to, errors as words: they are raised by another process."""
    try:
        return Answer(work(number))
    except FlexuraError as error:
        return Answer(None, str(error))
    except Exception as error:
        return Answer(None, f"{type(error).__name__}: {error}", traceback.format_exc())


def blocks_by(workers: _Processes | _Cluster, work: Blocks, numbers: Iterable[int]) -> Iterator[tuple[int, Columns]]:
    """Blocks of these numbers, in the order in which they are done, in bundles of which as many as are `in_flight` are
    asked for at a time, each of `largest_bundle` blocks at most. Raises SolverError for what a block raises, when
    workers are lost, and for bundles that they die of, which raise what is `deadly`."""
    left, size, numbers = work.blocks, 1, iter(numbers)
    pending: dict[Future[Bundle], list[int]] = {}
    try:
        while True:
            most = workers.in_flight
            while len(pending) < most and (bundle := list(islice(numbers, min(size, -(-left // most))))):
                left -= len(bundle)
                pending[workers.submit(bundle)] = bundle
            if not pending:
                return
            done, _ = wait(pending, timeout=1, return_when=FIRST_COMPLETED)
            workers.check()
            while done:
                future = done.pop()
                bundle = pending.pop(future)
                try:
                    answers = future.result()
                except workers.deadly:
                    text = f"workers die at {work.designs(*bundle)}; is there too little memory?"
                    raise SolverError(text) from None
                seconds = max(answers.seconds / len(bundle), 1e-6)
                size = min(max(int(BUNDLE_SECONDS / seconds), 1), workers.largest_bundle)
                for number, answer in zip(bundle, answers.answers, strict=True):
                    if answer.columns is None:
                        raise answer.error(work.designs(number))
                    yield number, answer.columns
    finally:
        workers.end()


THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")

WAITING_BLOCKS = 2
"""Blocks for each process that may wait for it, or for being written."""

LAST_WORDS = 2000
"""Bytes of what a process that died has written."""

PARENT_CHECK_SECONDS = 0.5
"""Seconds between two looks at whether the process that asks is still there."""


def cpu_count() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def on_processes(
    work: Blocks, numbers: Iterable[int], workers: int, say: Callable[[str], None]
) -> Iterator[tuple[int, Columns]]:
    """Blocks of these numbers by so many processes, as `blocks_by`.

    A process that dies is named to `say`, and its block asked once more. Raises SolverError when that dies too.
    Processes end with the iterator.
    """
    yield from blocks_by(_Processes(work, workers, say), work, numbers)


class _Processes:
    """A thread for each process, which asks it for one block after another."""

    largest_bundle = 1
    deadly: tuple[type[Exception], ...] = ()

    def __init__(self, work: Blocks, workers: int, say: Callable[[str], None]) -> None:
        self.in_flight: int = (1 + WAITING_BLOCKS) * workers
        self._work, self._say = work, say
        self._payload = pickle.dumps(work, protocol=pickle.HIGHEST_PROTOCOL)
        self._threads, self._own = ThreadPoolExecutor(workers), threading.local()
        self._lock, self._closed, self._started = threading.Lock(), False, list[_Process]()

    def submit(self, numbers: list[int]) -> Future[Bundle]:
        """Ask for blocks of these numbers."""
        return self._threads.submit(lambda: Bundle([self._answer(number) for number in numbers], 0.0))

    def check(self) -> None:
        """Threads see by themselves."""

    def end(self) -> None:
        """End all processes, whatever they are at."""
        with self._lock:
            self._closed = True
        for process in self._started:
            process.popen.kill()
        self._threads.shutdown(cancel_futures=True)
        for process in self._started:
            process.end()

    def _answer(self, number: int) -> Answer:
        """The answer to a number, of a new process where the one of this thread dies."""
        if not hasattr(self._own, "process"):
            self._start()
        answer = self._own.process.ask(number)
        if answer is None and not self._closed:
            words = f"worker {self._own.process.last_words()} at {self._work.designs(number)}"
            self._say(f"{words}, which another worker worked out again")
            self._own.process.end()
            self._start()
            answer = self._own.process.ask(number)
            if answer is None:
                also = self._own.process.last_words()
                raise SolverError(f"{words}, and so did another: {also}; is there too little memory?")
        return answer or Answer(None, "stopped")

    def _start(self) -> None:
        process = self._own.process = _Process(self._payload)
        with self._lock:
            self._started.append(process)
            if self._closed:
                process.popen.kill()


class _Process:
    """A worker, which has been sent the work: packages from where they come from here, the same limits of size, one
    thread."""

    def __init__(self, payload: bytes) -> None:
        command = [sys.executable, "-P", "-c", "from flexura.study.engine.workers import serve; serve()"]
        limits = ",".join(f"{name}={size_limit(name)}" for name in LIMITS)
        path = os.pathsep.join(folder for folder in sys.path if folder)
        environment = {**os.environ, **dict.fromkeys(THREADS, "1"), ENVIRONMENT: limits, "PYTHONPATH": path}
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115  closed with the process
        pipe = subprocess.PIPE
        try:
            self.popen = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=self._errors, env=environment)
        except OSError as error:
            self._errors.close()
            raise SolverError(f"no process to work in: {error}") from None
        self._in: Any = self.popen.stdin
        self._out: Any = self.popen.stdout
        with suppress(OSError):
            self._in.write(payload)

    def ask(self, number: int) -> Answer | None:
        """The answer to a number; None of a process that has died."""
        try:
            self._in.write(pickle.dumps(number))
            self._in.flush()
            return pickle.load(self._out)
        except (OSError, EOFError, pickle.UnpicklingError):
            return None

    def last_words(self) -> str:
        """How a process has died, and the last line that it wrote."""
        status = self.popen.wait()
        end = f"was killed by signal {-status}" if status < 0 else f"ended with status {status}"
        self._errors.seek(max(self._errors.seek(0, os.SEEK_END) - LAST_WORDS, 0))
        line = self._errors.read().decode("utf-8", "replace").strip().rpartition("\n")[2]
        return f"{self.popen.pid} {end}" + (f" ({line})" if line else "")

    def end(self) -> None:
        """Let it go."""
        self.popen.kill()
        with suppress(OSError):
            self._in.close()
        self._out.close()
        self.popen.wait()
        self._errors.close()


def serve() -> None:
    """Answer, as a process, until the input ends, or the process that asks is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interruption of the terminal is for the process that asks
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    numbers, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print
    with suppress(EOFError, BrokenPipeError):
        work = pickle.load(numbers)
        while True:
            pickle.dump(answered(work, pickle.load(numbers)), answers, protocol=pickle.HIGHEST_PROTOCOL)
            answers.flush()


def _end_with(parent: int) -> None:
    """End in the middle of a block when the process that asked for it is gone."""
    while os.getppid() == parent:
        time.sleep(PARENT_CHECK_SECONDS)
    os._exit(1)


ANSWER_SECONDS = 10.0
"""Seconds in which a scheduler answers."""

LOST_SECONDS = 30.0
"""Seconds without any worker, or without a scheduler, after which a study ends."""

BUNDLES_PER_WORKER = 2
"""Bundles for each worker that are asked for at a time."""

LONGEST_GREETING = 1_000_000
"""Bytes, at most, of what a scheduler says first."""

_ADDRESS = re.compile(r"(?:tcp|tls|ws|wss)://\[?([\w.:%-]+?)\]?:(\d{1,5})")

_ONE_BLOCK = threading.Lock()
"""One block at a time in each process: a plan remembers what it has worked out last."""


def unpacked(payload: bytes) -> Blocks:
    """The work, as a worker has it."""
    return pickle.loads(payload)


def bundle_of(work: Blocks, numbers: list[int]) -> Bundle:
    """Answers to blocks of these numbers, on a worker."""
    with _ONE_BLOCK:
        begun = time.monotonic()
        return Bundle([answered(work, number) for number in numbers], time.monotonic() - begun)


def version() -> str:
    """That of flexura on a worker."""
    return __version__


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A client of the scheduler with this address, which has workers with the same flexura.

    Raises OptionError when it does not answer, has no workers, or other versions there.
    """
    distributed = need("distributed", "cluster")
    parts = _ADDRESS.fullmatch(address)
    if parts is None:
        raise OptionError(f"{address!r} is no address of a scheduler, such as tcp://192.168.0.7:8786")
    with ExitStack() as stack:
        try:
            with socket.create_connection((parts[1], int(parts[2])), timeout=ANSWER_SECONDS) as connection:
                if address.startswith("tcp:"):  # what dask says begins with a length
                    length = connection.recv(8, socket.MSG_WAITALL)
                    if len(length) < 8 or int.from_bytes(length, "little") > LONGEST_GREETING:
                        raise ConnectionError
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                client = distributed.Client(address, timeout=ANSWER_SECONDS, set_as_default=False)
            stack.callback(_close, client)
            if not client.nthreads():
                raise OptionError(f"the scheduler at {address} has no workers; start some with `dask worker {address}`")
            for worker, answer in client.run(version, on_error="return").items():
                if answer != __version__:
                    what = f"flexura {answer}" if isinstance(answer, str) else f"no flexura ({answer})"
                    raise OptionError(f"worker {worker} of {address} has {what}; this is flexura {__version__}")
        except OSError as error:
            hint = "start one with `dask scheduler`, and `dask worker` on every machine"
            why = error.strerror or "it is no dask"
            raise OptionError(f"no scheduler answers at {address} ({why}); {hint}") from None
        yield client


def _close(client: Any) -> None:
    with suppress(Exception):
        client.close(timeout=1)


def on_cluster(
    client: Any, work: Blocks, numbers: Iterable[int], say: Callable[[str], None]
) -> Generator[tuple[int, Columns]]:
    """Blocks of these numbers by the workers of a cluster, as `blocks_by`.

    Workers that are lost are named to `say`. Raises SolverError when the scheduler or all workers are.
    """
    distributed = need("distributed", "cluster")
    try:
        yield from blocks_by(_Cluster(client, work, say), work, numbers)
    except (CancelledError, distributed.CancelledError, OSError):  # of whatever is asked, and of what it answers
        raise SolverError(f"the scheduler {client.scheduler.address} is lost") from None


class _Cluster:
    """The workers of a dask cluster, as an executor."""

    largest_bundle = LARGEST_BUNDLE

    def __init__(self, client: Any, work: Blocks, say: Callable[[str], None]) -> None:
        self.deadly: tuple[type[Exception], ...] = (need("distributed", "cluster").KilledWorker,)
        self._client, self._say = client, say
        self._executor: Executor = client.get_executor(pure=False)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a large plan
            # as a task, which is done again when the worker that has it is lost
            payload = pickle.dumps(work, protocol=pickle.HIGHEST_PROTOCOL)
            self._work = client.submit(unpacked, payload, pure=False)
        self._workers = set(client.nthreads())
        self._seen = time.monotonic()

    @property
    def in_flight(self) -> int:
        """Bundles that are asked for at a time."""
        return BUNDLES_PER_WORKER * max(len(self._workers), 1)

    def submit(self, numbers: list[int]) -> Future[Bundle]:
        """Ask for blocks of these numbers."""
        return self._executor.submit(bundle_of, self._work, numbers)

    def check(self) -> None:
        """See who is there. Raises SolverError when nobody is for too long."""
        now, address = time.monotonic(), self._client.scheduler.address
        if self._client.status != "running":
            raise SolverError(f"the scheduler {address} is lost")
        workers = set(self._client.nthreads())
        for lost in sorted(self._workers - workers):
            self._say(f"worker {lost} was lost, and others work its blocks out again")
        self._workers = workers
        if workers:
            self._seen = now
        elif now - self._seen > LOST_SECONDS:
            raise SolverError(f"all workers of {address} are lost")

    def end(self) -> None:
        """Let nobody work on what is still on its way."""
        with suppress(Exception):
            self._executor.shutdown(wait=False)
            self._client.cancel([self._work])


def blocks_of(
    work: Blocks, numbers: Iterable[int], workers: int | None, scheduler: str | None, say: Callable[[str], None]
) -> Generator[tuple[int, Columns]]:
    """Blocks of these numbers by processes of this machine, by default as many as there are processors, or by the
    workers of the cluster whose `scheduler` has this address; `say` is told of workers that are lost."""
    if scheduler is None:
        yield from on_processes(work, numbers, workers or cpu_count(), say)
        return
    with connected(scheduler) as client:
        yield from on_cluster(client, work, numbers, say)
