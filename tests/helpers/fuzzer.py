"""Reads damaged files in a process that may die: no other error than FlexuraError, within memory and processor time.

    make fuzz ARGS="--seconds 120 [--seed N] [--kinds model,measured] [--out FOLDER]"
    make fuzz ARGS="--again FILE --kinds measured [--smaller]"
"""  # fmt: skip

from __future__ import annotations

import argparse
import os
import pickle
import resource
import select
import signal
import struct
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from random import Random, SystemRandom
from typing import Any

from helpers.mutations import mutated

TESTS = Path(__file__).parents[1]
CORPUS = TESTS / "fuzz" / "corpus"
READERS = Path(__file__).with_name("fuzz_readers.py")
ELSEWHERE = {
    "model": ("examples/*/*.yaml",),
    "matrix": ("examples/*/*.mtx",),
    "measured": ("tests/testing/data/*.uff",),
    "frequencies": ("examples/*/*.csv",),
}
"""Files outside the corpus that belong to it, by kind."""

EXAMPLES = TESTS.parent / "examples"
BESIDE = (*EXAMPLES.glob("rpr/*.yaml"), *EXAMPLES.glob("imported/*.mtx"))
"""Files that others of the corpus name."""

MEMORY = 3 << 30
"""Bytes of address space of the process that reads, NumPy and its libraries included."""

SECONDS = 30.0
"""Processor time that one case may take."""

DEADLINE = 4 * SECONDS
"""Seconds after which a case that still runs is ended: it waits, or hangs."""

KINDS = ("model", "matrix", "expression", "measured", "frequencies", "signals", "channels")


@dataclass(frozen=True)
class Case:
    """The content of one file, and what it is read as; `name` is that of the file it was made from."""

    kind: str
    name: str
    content: bytes


@dataclass(frozen=True)
class Failure:
    """A case that ended in anything but an answer or a FlexuraError."""

    case: Case
    what: str

    def __str__(self) -> str:
        return f"{self.case.kind}, made from {self.case.name}: {self.what}"


@dataclass
class Tally:
    """How many cases were read, how many refused, and those that failed."""

    read: int = 0
    refused: int = 0
    failures: list[Failure] = field(default_factory=list)


class Reader:
    """Reads cases in a process of its own, which is made anew when it dies."""

    def __init__(self, memory: int = MEMORY, seconds: float = SECONDS, readers: Path = READERS) -> None:
        self.memory, self.seconds, self.readers = memory, seconds, readers
        self.process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Reader:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process = None

    def outcome(self, case: Case) -> str:
        """`read`, `refused`, or what went wrong."""
        if self.process is None:
            command = [sys.executable, "-m", __spec__.name, "--serve", str(self.memory), "--readers", str(self.readers)]
            paths = os.pathsep.join([str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])])
            env = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": paths}
            self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=env)
        try:
            _send(self.process.stdin, (case.kind, case.name, case.content))
            answer = _receive(self.process.stdout, DEADLINE)
        except (BrokenPipeError, EOFError):
            status = self.process.wait(DEADLINE)
            self.end()
            return f"the process died: {signal.Signals(-status).name if status < 0 else status}"
        except TimeoutError:
            self.end()
            return f"still at work after {DEADLINE:g} s"
        what, used = answer
        if what in ("read", "refused") and used > self.seconds:
            return f"{used:.1f} s of processor time, more than {self.seconds:g} s"
        return what

    def fails(self, case: Case) -> Failure | None:
        """The failure of a case, if it is one."""
        what = self.outcome(case)
        return None if what in ("read", "refused") else Failure(case, what)


def _send(stream: Any, value: object) -> None:
    content = pickle.dumps(value)
    stream.write(struct.pack("<Q", len(content)) + content)
    stream.flush()


def _receive(stream: Any, seconds: float) -> Any:
    if not select.select([stream], [], [], seconds)[0]:
        raise TimeoutError
    head = stream.read(8)
    if len(head) < 8:
        raise EOFError
    return pickle.loads(stream.read(struct.unpack("<Q", head)[0]))


def serve(memory: int, readers: str) -> None:
    """Read cases from stdin, with `read` of the file `readers`, and answer on stdout, until it ends."""
    spec = spec_from_file_location("readers", readers)
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)

    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    answers = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)  # libraries print there
    with tempfile.TemporaryDirectory(prefix="flexura-fuzz-") as folder:
        for file in BESIDE:
            (Path(folder) / file.name).symlink_to(file)
        while len(head := sys.stdin.buffer.read(8)) == 8:
            kind, name, content = pickle.loads(sys.stdin.buffer.read(struct.unpack("<Q", head)[0]))
            file = Path(folder) / f"case{Path(name).suffix}"
            file.write_bytes(content)
            before = _processor_time()
            try:
                what = module.read(kind, file)
            except MemoryError:
                what = f"more memory than {memory} bytes:\n{traceback.format_exc(limit=-6)}"
            except BaseException:
                what = traceback.format_exc(limit=-8)
            _send(answers, (what, _processor_time() - before))


def _processor_time() -> float:
    """Seconds of this process and of those that it has started."""
    return sum(os.times()[:4])


def corpus(kind: str) -> list[tuple[str, bytes]]:
    """Names and contents of the files that a kind of case starts from."""
    files = sorted(file for file in (CORPUS / kind).glob("*") if file.is_file())
    files += sorted(file for pattern in ELSEWHERE.get(kind, ()) for file in TESTS.parent.glob(pattern))
    return [(file.name, file.read_bytes()) for file in files]


def cases(kind: str, seed: int) -> Iterator[Case]:
    """The corpus as it is, then what is made of it, without end; the same for the same seed."""
    rng, own = Random(f"{kind} {seed}"), corpus(kind)
    for name, content in own:
        yield Case(kind, name, content)
    others = [content for _, content in own]
    while True:
        name, content = rng.choice(own)
        yield Case(kind, name, mutated(content, name, rng, others))


def fuzz(seconds: float, seed: int, kinds: tuple[str, ...] = KINDS) -> Tally:
    """Read cases of all kinds in turn until the time is over; the whole corpus in any case."""
    found, end = Tally(), time.monotonic() + seconds
    with Reader() as reader:
        running = {kind: cases(kind, seed) for kind in kinds}
        least = {kind: len(corpus(kind)) for kind in kinds}
        turn = 0
        while turn < max(least.values()) or time.monotonic() < end:
            for own in running.values():
                case = next(own)
                what = reader.outcome(case)
                if what in ("read", "refused"):
                    setattr(found, what, getattr(found, what) + 1)
                else:
                    found.failures.append(Failure(case, what))
            turn += 1
    return found


def smaller(failure: Failure) -> Case:
    """The shortest case found, by leaving out pieces, that ends in the same error."""
    case, last = failure.case, failure.what.strip().splitlines()[-1][:60]
    with Reader() as reader:
        size = max(1, len(case.content) // 2)
        while size:
            at = 0
            while at < len(case.content):
                less = Case(case.kind, case.name, case.content[:at] + case.content[at + size :])
                found = reader.fails(less)
                if found is not None and found.what.strip().splitlines()[-1][:60] == last:
                    case = less
                else:
                    at += size
            size //= 2
    return case


def kept(failures: list[Failure], folder: Path) -> list[str]:
    """Write the cases that failed into a folder; a line for each, with its file."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = []
    for k, failure in enumerate(failures):
        file = folder / f"{failure.case.kind}-{k}{Path(failure.case.name).suffix}"
        file.write_bytes(failure.case.content)
        lines.append(f"{failure}\n  kept as {file}")
    return lines


def main() -> None:
    """Run from the shell."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--serve", type=int, help=argparse.SUPPRESS)
    asked.add_argument("--readers", default=str(READERS), help=argparse.SUPPRESS)
    asked.add_argument("--seconds", type=float, default=120)
    asked.add_argument("--seed", type=int, default=SystemRandom().randrange(10**6))
    asked.add_argument("--kinds", default=",".join(KINDS))
    asked.add_argument("--out", type=Path, default=Path("out/fuzz"))
    asked.add_argument("--again", type=Path)
    asked.add_argument("--smaller", action="store_true")
    given = asked.parse_args()
    kinds = tuple(given.kinds.split(","))
    if given.serve:
        serve(given.serve, given.readers)
    elif given.again:
        with Reader() as reader:
            failure = reader.fails(Case(kinds[0], given.again.name, given.again.read_bytes()))
        print(failure or "read or refused")
        if failure and given.smaller:
            least = smaller(failure)
            print(repr(least.content))
            given.again.with_name(f"smaller-{given.again.name}").write_bytes(least.content)
    else:
        found = fuzz(given.seconds, given.seed, kinds)
        print(f"seed {given.seed}: {found.read} read, {found.refused} refused, {len(found.failures)} failed")
        print("\n".join(kept(found.failures, given.out)))
        sys.exit(bool(found.failures))


if __name__ == "__main__":
    main()
