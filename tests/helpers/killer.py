"""Kills a command at the steps of its writing, in the midst of a file, and at random times, and looks at what is left.

    python tests/helpers/killer.py SEED KILLS -- COMMAND ARGUMENTS   (OUT stands for a folder of results)

A result is there as it was before, or complete; beside results there are only folders that say that they are temporary,
and the next run removes them.
"""  # fmt: skip

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

OLD = b"what was there before\n"
WRITES = {"open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "shutil.rmtree", "tempfile.mkdtemp"}


class Killer:
    """Runs one command in forked processes; `faults` says what is wrong after their ends."""

    def __init__(self, command: list[str], place: Path, rng: Random) -> None:
        self.rng, self.place = rng, place
        self.out, self.cache, self.scratch = (place / name for name in ("out", "cache", "scratch"))
        self.command = [part.replace("OUT", str(self.out)) for part in command]
        os.environ |= {"FLEXURA_CACHE": str(self.cache), "TMPDIR": str(self.scratch)}
        self.faults: list[str] = []
        self.clear()

    def clear(self) -> None:
        """Folders as they are before the first run."""
        for folder in (self.out, self.cache, self.scratch):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
        tempfile.tempdir = None

    def run(self) -> None:
        """The command, to its end. Raises RuntimeError where it fails."""
        from flexura.cli import main

        sys.argv = ["flexura", *self.command]
        try:
            main()
        except SystemExit as end:
            if end.code:
                raise RuntimeError(f"{self.command} ended with {end.code}") from None

    def forked(self, prepare: Callable[[], object], after: float | None = None) -> int:
        """Run in a process of its own, killed `after` so many seconds where it is still there; how it ended."""
        sys.stdout.flush()
        child = os.fork()
        if not child:
            try:
                prepare()
                self.run()
                os._exit(0)
            except BaseException:
                os._exit(1)
        if after is not None:
            time.sleep(after)
            os.kill(child, signal.SIGKILL)
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

    def results(self) -> dict[str, int]:
        """Sizes of the files there are, by their place below the folder of results."""
        found = (file for file in self.out.rglob("*") if file.is_file())
        return {str(file.relative_to(self.out)): file.stat().st_size for file in found}

    def left(self) -> list[str]:
        """What killed runs have left, in all folders."""
        folders = (self.out, self.cache, self.scratch)
        return [str(own) for folder in folders for own in folder.rglob("*") if "flexura-" in own.name and own.is_dir()]

    def look(self, how: str, complete: dict[str, int]) -> None:
        """Find what is wrong with the results after a kill."""
        for name, size in self.results().items():
            file = self.out / name
            if any("flexura-" in part for part in Path(name).parts):
                continue
            if name not in complete:
                self.faults.append(f"{how}: {name} is no result")
            elif file.read_bytes() != OLD and (abs(file.stat().st_size - size) or not is_whole(file)):
                self.faults.append(f"{how}: {name} is neither as before nor complete")
            elif file.read_bytes() != OLD and abs(size - complete[name]) > 0.02 * complete[name]:
                self.faults.append(f"{how}: {name} has {size} bytes, complete {complete[name]}")
        for folder, kind in ((self.cache, "*.npz"), (self.scratch, None)):
            for file in folder.glob("*"):
                if "flexura-" not in file.name and not (kind and file.match(kind) and is_whole(file)):
                    self.faults.append(f"{how}: {file.name} is left in {folder.name}")

    def kill(self, count: int) -> int:
        """Kill at `count` points of three kinds; how many of them have met a run that was at work."""
        begin = time.monotonic()
        self.run()
        complete = self.results()
        warm = time.monotonic()
        self.clear()
        events = self.place / "events"
        if self.forked(lambda: _watch(self.place, None, events)):
            raise RuntimeError("a forked run fails")
        seconds, steps = min(time.monotonic() - warm, time.monotonic() - begin), int(events.read_text())
        met = 0
        for how, prepare, after in self.points(count, steps, seconds, max([*complete.values(), 1000])):
            self.clear()
            for name in complete:
                (self.out / name).parent.mkdir(parents=True, exist_ok=True)
                (self.out / name).write_bytes(OLD)
            met += self.forked(prepare, after) < 0
            self.look(how, complete)
        self.forked(lambda: None)
        if found := [*self.left(), *(name for name in complete if (self.out / name).read_bytes() == OLD)]:
            self.faults.append(f"the next run leaves {found}")
        if self.results().keys() != complete.keys():
            self.faults.append(f"the next run gives {self.results()}, not {complete}")
        return met

    def points(self, count: int, steps: int, seconds: float, size: int) -> Iterator[tuple[str, Any, float | None]]:
        """Points of killing: at steps, beyond so many bytes of a file, after a time; the last of the first kind."""
        for k in range(count):
            match k % 3:
                case 0:
                    at = self.rng.randint(1, steps)
                    yield f"step {at} of {steps}", lambda at=at: _watch(self.place, at, None), None
                case 1:
                    most = self.rng.randint(1, size)
                    yield f"{most} bytes of {size}", lambda most=most: _short_files(most), None
                case _:
                    after = self.rng.uniform(0, 1.1 * seconds)
                    yield f"{after:.3f} s of {seconds:.3f} s", lambda: None, after
        last = self.rng.randint(max(1, steps - 3), steps)
        yield f"step {last} of {steps}", lambda: _watch(self.place, last, None), None


def _watch(place: Path, at: int | None, events: Path | None) -> None:
    """Count steps of writing below a folder, kill this process at one, and keep the number in a file at the end."""
    count = 0

    def hook(event: str, given: tuple[Any, ...]) -> None:
        nonlocal count
        if event not in WRITES or not any(isinstance(x, str | os.PathLike) and str(place) in str(x) for x in given):
            return
        if (event == "open" and not (given[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT))) or events in map(_path, given):
            return
        count += 1
        if events is not None:
            events.write_text(str(count))
        if count == at:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)


def _path(what: object) -> Path | None:
    return Path(what) if isinstance(what, str | os.PathLike) else None


def _short_files(most: int) -> None:
    """Let the system end this process when a file grows beyond so many bytes."""
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))


def is_whole(file: Path) -> bool:
    """Whether the program that a file is for could read it to its end."""
    import h5py
    import numpy as np
    from matplotlib.image import imread
    from scipy.io import loadmat

    try:
        match file.suffix:
            case ".png":
                imread(file)
            case ".npz":
                with np.load(file) as archive:
                    return all(archive[name] is not None for name in archive.files)
            case ".fmu" | ".zip":
                return zipfile.ZipFile(file).testzip() is None
            case ".h5":
                with h5py.File(file) as root:
                    root.visititems(lambda _, item: item[()] if isinstance(item, h5py.Dataset) else None)
            case ".mat":
                loadmat(file)
            case ".uff":
                return file.read_bytes().rstrip().endswith(b"-1")
            case _:
                return file.read_bytes().endswith((b"\n", b">", b"}", b";"))
    except Exception:
        return False
    return True


def main() -> None:
    """Kill the command of the arguments and print what was found as JSON."""
    at = sys.argv.index("--")
    seed, count, command = sys.argv[1], int(sys.argv[2]), sys.argv[at + 1 :]
    place = Path(tempfile.mkdtemp(prefix="killed-"))
    said, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    killer = Killer(command, place, Random(f"{seed} {command}"))
    try:
        met = killer.kill(count)
    finally:
        with suppress(OSError):
            shutil.rmtree(place)
    os.write(said, json.dumps({"met": met, "faults": killer.faults}).encode())


if __name__ == "__main__":
    main()
