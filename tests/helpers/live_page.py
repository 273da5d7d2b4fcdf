"""The live page served by the command, and what a page would say to it."""

from __future__ import annotations

import json
import os
import re
import signal
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from websockets.sync.client import ClientConnection, connect

from helpers import forked

ROOT = Path(__file__).parents[2]
PATIENCE = 60


class Served:
    """A running `flexura live`: its process, and the address that it printed."""

    def __init__(self, file: Path, *options: str) -> None:
        said, stdout = os.pipe()
        self.errors = tempfile.TemporaryFile()  # noqa: SIM115
        environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
        words = ("live", file, "--no-browser", *options)
        self.process = forked.Command(*words, env=environment, stdout=stdout, stderr=self.errors.fileno())
        os.close(stdout)
        self.stdout = os.fdopen(said)
        self.said = self.stdout.readline()
        found = re.search(r"http://\S+", self.said)
        if found is None:
            errors = self.interrupt()[1]
            self.end()
            raise AssertionError(self.said + errors)
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
        status = self.process.wait(PATIENCE)
        return status, forked.text_of(self.errors)

    def end(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait(PATIENCE)
        self.stdout.close()
        self.errors.close()


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
