"""The workers of a dask cluster: blocks in bundles, so many at a time, the work sent once."""

from __future__ import annotations

import pickle
import queue
import re
import socket
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from typing import Any, NamedTuple

from flexura._version import __version__
from flexura.errors import OptionError, SolverError
from flexura.extras import need
from flexura.study.engine.work import Columns, Work
from flexura.study.engine.worker import Answer, answered

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
