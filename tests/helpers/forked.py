"""`python -m flexura` in forks of one process that has imported it: the same commands without a second of imports each.

The process serves one process of tests, on a socket, and ends with it. A command has its own arguments, environment,
folder and streams; what only a new interpreter shows is tested with `sys.executable`.
"""

from __future__ import annotations

import atexit
import json
import os
import resource
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import IO, Any

ROOT = Path(__file__).parents[2]
PRELOADED = ("cli", "analysis", "view", "modelfile", "study", "testing", "io")
"""Rooms whose faces are imported; a command loads by itself what else it needs."""

WIDTH = 12
"""Bytes in which a number is told."""


@cache
def server() -> socket.socket:
    """The process that forks, started once."""
    ours, theirs = socket.socketpair()
    command = [sys.executable, "-m", __name__, str(theirs.fileno())]
    environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'src'}{os.pathsep}{ROOT / 'tests'}"}
    environment |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    process = subprocess.Popen(command, pass_fds=[theirs.fileno()], env=environment, stdin=subprocess.DEVNULL)
    theirs.close()
    atexit.register(lambda: (ours.close(), process.wait(10)))
    return ours


class Command:
    """A running `flexura ARGS`, with what tests use of `subprocess.Popen`; `limits` are those of `resource`."""

    def __init__(self, *args: object, env: Mapping[str, str], stdout: int, stderr: int, **limits: int) -> None:
        request = {"arguments": [*map(str, args)], "env": dict(env), "cwd": str(Path.cwd()), "limits": limits}
        self.status, theirs = socket.socketpair()
        with tempfile.TemporaryFile() as body, theirs:
            body.write(json.dumps(request).encode())
            body.flush()
            socket.send_fds(server(), [b"!"], [stdout, stderr, theirs.fileno(), body.fileno()])
        self.pid = int(self.status.recv(WIDTH, socket.MSG_WAITALL))
        self.returncode: int | None = None

    def wait(self, timeout: float | None = None) -> int:
        """Its status; `TimeoutError` where it takes longer."""
        if self.returncode is None:
            if not select.select([self.status], [], [], timeout)[0]:
                raise TimeoutError
            self.returncode = int(self.status.recv(WIDTH, socket.MSG_WAITALL))
            self.status.close()
        return self.returncode

    def poll(self) -> int | None:
        """Its status, None while it runs."""
        with suppress(TimeoutError):
            self.wait(0)
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send it a signal unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)


def completed(*args: object, env: Mapping[str, str], stdout: int | None = None, timeout: float, **limits: int) -> Any:
    """The completed process of `flexura ARGS`, with stdout, unless it has a descriptor, and stderr as text."""
    with tempfile.TemporaryFile() as said, tempfile.TemporaryFile() as errors:
        out = said.fileno() if stdout is None else stdout
        command = Command(*args, env=env, stdout=out, stderr=errors.fileno(), **limits)
        try:
            status = command.wait(timeout)
        finally:
            command.send_signal(signal.SIGKILL)
        return subprocess.CompletedProcess(args, status, text_of(said), text_of(errors))


def text_of(stream: IO[bytes]) -> str:
    """All that was written to a file."""
    stream.seek(0)
    return stream.read().decode(errors="replace")


# --- in the process that forks


def serve(link: socket.socket) -> None:
    """Fork a process for every request until the other end is closed."""
    while True:
        word, descriptors, _, _ = socket.recv_fds(link, 1, 4)
        if not word:
            return
        if os.fork() == 0:
            link.close()
            watch(*descriptors)
        for descriptor in descriptors:
            os.close(descriptor)
        with suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass


def watch(out: int, errors: int, status: int, body: int) -> None:
    """Run a command in a process of its own, and tell its number and its status."""
    request = json.loads(os.pread(body, os.fstat(body).st_size, 0))
    child = os.fork()
    if child == 0:
        os.close(status)
        run(request, out, errors)
    link = socket.socket(fileno=status)
    for descriptor in (out, errors):
        os.close(descriptor)
    with suppress(OSError):
        link.send(f"{child:{WIDTH}d}".encode())
        link.send(f"{os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]):{WIDTH}d}".encode())
    os._exit(0)


def run(request: dict[str, Any], out: int, errors: int) -> None:
    """What `python -m flexura` does, with streams, environment and limits of its own."""
    status: Any = 0
    try:
        for number, descriptor in ((1, out), (2, errors)):
            os.dup2(descriptor, number)
        # as Python makes them for what they are now: a pipe, or a file
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False, buffering=1)  # noqa: SIM115
        if "PYTHONUNBUFFERED" in request["env"]:
            sys.stdout.reconfigure(line_buffering=True)
        os.environ.clear()
        os.environ.update(request["env"])
        os.chdir(request["cwd"])
        for name, most in request["limits"].items():
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (most, most))
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.argv = ["flexura", *request["arguments"]]
        runpy.run_module("flexura", run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        status = ended.code
    except BaseException:
        traceback.print_exc()
        status = 1
    with suppress(OSError):
        sys.stdout.flush()
    os._exit(status if isinstance(status, int) else int(status is not None))


if __name__ == "__main__":
    for room in PRELOADED:
        package = import_module(f"flexura.{room}")
        for public in getattr(package, "__all__", ()):
            getattr(package, public)  # which loads its module
    serve(socket.socket(fileno=int(sys.argv[1])))
