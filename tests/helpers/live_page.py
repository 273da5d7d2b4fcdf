"""The live page served by the command, and what a page would say to it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from websockets.sync.client import ClientConnection, connect

ROOT = Path(__file__).parents[2]
PATIENCE = 60


class Served:
    """A running `flexura live`: its process, and the address that it printed."""

    def __init__(self, file: Path, *options: str) -> None:
        command = [sys.executable, "-m", "flexura", "live", str(file), "--no-browser", *options]
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "PYTHONUNBUFFERED": "1"}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        self.process = subprocess.Popen(command, **pipes, text=True, env=environment, cwd=ROOT)
        assert self.process.stdout is not None
        self.said = self.process.stdout.readline()
        found = re.search(r"http://\S+", self.said)
        assert found, self.said + self.process.communicate()[1]
        self.url = found[0]

    @property
    def host(self) -> str:
        return urlsplit(self.url).netloc

    @property
    def path(self) -> str:
        return urlsplit(self.url).path

    def interrupt(self) -> tuple[int, str]:
        """Ctrl-C: the exit status, and what was said on stderr."""
        self.process.send_signal(signal.SIGINT)
        _, said = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, said

    def end(self) -> None:
        self.process.kill()
        self.process.communicate(timeout=PATIENCE)


@contextmanager
def served(file: Path, *options: str) -> Iterator[Served]:
    own = Served(file, *options)
    try:
        yield own
    finally:
        own.end()


class Talk:
    """A page's end of the WebSocket."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket, self.serial = socket, 0

    def next(self, timeout: float = PATIENCE) -> dict[str, Any]:
        """The next message; of one in bytes its header, with the message under `bytes`."""
        data = self.socket.recv(timeout=timeout)
        if isinstance(data, str):
            return json.loads(data)
        length = int.from_bytes(data[:4], "little")
        return {**json.loads(data[4 : 4 + length]), "bytes": data}

    def until(self, *kinds: str) -> dict[str, Any]:
        """The next message of some kinds."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            message = self.next()
            if message["type"] in kinds:
                return message
        raise AssertionError(f"no {kinds}")

    def ask(self, values: dict[str, float], **others: Any) -> int:
        """Ask for a design; its number."""
        self.serial += 1
        self.say({"type": "design", "serial": self.serial, "values": values, **others})
        return self.serial

    def say(self, message: object) -> None:
        self.socket.send(message if isinstance(message, str | bytes) else json.dumps(message))

    def all_of(self, serial: int) -> dict[str, dict[str, Any]]:
        """All that is told of a design until it is settled or refused, by kind."""
        found: dict[str, dict[str, Any]] = {}
        while "settled" not in found and "refused" not in found:
            message = self.next()
            if message.get("serial") == serial:
                found[message["type"]] = message
        return found


@contextmanager
def talk(own: Served, **others: Any) -> Iterator[tuple[Talk, dict[str, Any]]]:
    """Connect as the page does; the talk, and what the page is told first."""
    origin = others.pop("origin", f"http://{own.host}")
    headers = others.pop("headers", {})
    url = f"ws://{own.host}{others.pop('path', own.path)}socket"
    with connect(url, origin=origin, additional_headers=headers, max_size=None, compression=None) as socket:
        own_talk = Talk(socket)
        yield own_talk, own_talk.until("opened")
