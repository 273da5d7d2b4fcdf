"""The live page served to those who know its token: one file, an address of this machine, a browser, and an end."""

from __future__ import annotations

import asyncio
import os
import secrets
import socket
import sys
import time
import webbrowser
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager, suppress
from hmac import compare_digest
from html import escape
from pathlib import Path
from threading import Thread
from typing import Any

from flexura.arguments import verb
from flexura.errors import FlexuraError, OptionError, need
from flexura.files import scratch_folder
from flexura.io import is_measured
from flexura.pages.live.bodies import MODEL, TEST
from flexura.pages.live.designs import LARGEST, MOST_MODES, told
from flexura.pages.live.opened import Opened, problems_of, signature
from flexura.pages.live.session import Outbox, PageSession, Session, Worker
from flexura.pages.live.tested import OpenedTest, PickSession
from flexura.pages.viewer import page
from flexura.testing.measurement import Repeated

Subject = Opened | OpenedTest
"""What a page shows: a mechanism, or a test."""


def live_page(opened: Subject, connect: Sequence[str]) -> str:
    """The HTML of the page of a file; it may connect to the addresses given, and nowhere else."""
    kind, body = ("live", MODEL) if isinstance(opened, Opened) else ("test", TEST)
    filled = body.format(name=escape(opened.name), file=escape(opened.path.name))
    return page(f"{opened.name}: live", filled, kind, connect=" ".join(connect))


def redirection(address: str) -> str:
    """A page that leads to an address."""
    return f'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={escape(address)}">'


POLL = 0.25
"""Seconds between looks at the files; a file is read when it was the same at two of them."""

GRACE = 5.0
"""Seconds without any page after which the server ends; a page that is loaded again is back before."""

MOST_PAGES = 16
MOST_MISTAKES = 20
"""Messages that are not understood after which a page is no longer listened to."""

HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}

FORBIDDEN, TOO_MANY, NOT_UNDERSTOOD = 4403, 4429, 4400
"""Why a WebSocket is closed."""


class Site:
    """The application: a page and a WebSocket below a token, for names of this machine alone.

    `ended` is called when all pages are closed, unless the server is to be kept.
    """

    def __init__(self, opened: Subject, token: str, port: int, ended: Callable[[], None], keep: bool) -> None:
        self.opened: Subject = opened
        self._token, self._ended, self._keep = token, ended, keep
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
        self._sessions: set[PageSession] = set()
        self._left: float | None = None
        self._worker = Worker()
        self._file: str | None = None
        """What the pages are told of a file that is broken or gone."""
        self._files = opened.files
        self._seen = signature(self._files)

    def application(self) -> Any:
        """The application, as servers run it."""
        need("starlette", "live")
        from starlette.applications import Starlette
        from starlette.routing import Route, WebSocketRoute

        routes = [Route("/{token}/", self._page), WebSocketRoute("/{token}/socket", self._socket)]
        own = Starlette(routes=routes, lifespan=self._running)
        own.router.redirect_slashes = False
        return own

    def close(self) -> None:
        """End what is worked on: a thread that works while Python ends aborts the process."""
        self._worker.close()

    @asynccontextmanager
    async def _running(self, _: Any) -> AsyncIterator[None]:
        task = asyncio.create_task(self._watch())
        try:
            yield
        finally:
            task.cancel()
            await asyncio.to_thread(self._worker.close)

    def _admits(self, asked: Any) -> bool:
        """Whether a request names this machine, comes from this page, and knows the token."""
        headers, token = asked.headers, asked.path_params["token"]
        origin = headers.get("origin")
        if headers.get("host") not in self._hosts:
            return False
        if origin is not None and origin.removeprefix("http://") not in self._hosts:
            return False
        if asked.scope["type"] == "websocket" and origin is None:
            return False
        return compare_digest(token.encode(), self._token.encode())

    async def _page(self, request: Any) -> Any:
        from starlette.responses import HTMLResponse, PlainTextResponse

        if not self._admits(request):
            return PlainTextResponse("not for you", status_code=403, headers=HEADERS)
        text = live_page(self.opened, sorted(f"ws://{host}" for host in self._hosts))
        return HTMLResponse(text, headers=HEADERS)

    async def _socket(self, socket: Any) -> None:
        if not self._admits(socket):
            await socket.close(FORBIDDEN)
            return
        await socket.accept()
        if len(self._sessions) >= MOST_PAGES:
            await socket.close(TOO_MANY)
            return
        outbox = Outbox(asyncio.get_running_loop())
        own: Any = lambda: self.opened  # noqa: E731
        session = (Session if isinstance(self.opened, Opened) else PickSession)(self._worker, own, outbox)
        self._sessions.add(session)
        sender = asyncio.create_task(_send(socket, outbox))
        try:
            self._open(outbox)
            if self._file is not None:
                outbox.put("file", self._file)
            await self._listen(socket, session)
        finally:
            sender.cancel()
            session.close()
            self._sessions.discard(session)
            self._left = time.monotonic()

    async def _listen(self, socket: Any, session: PageSession) -> None:
        """Take messages until the page goes."""
        mistakes = 0
        while (message := await socket.receive())["type"] == "websocket.receive":
            text = message.get("text")
            try:
                if text is None or len(text) > LARGEST:
                    raise OptionError("a message is text of bounded size")
                session.receive(session.read(text))
            except OptionError as error:
                mistakes += 1
                session.outbox.put("misunderstood", told("misunderstood", text=str(error)))
                if mistakes >= MOST_MISTAKES:
                    await socket.close(NOT_UNDERSTOOD)
                    return

    async def _watch(self) -> None:
        """Look at the files, and whether any page is left."""
        before = self._seen
        while True:
            await asyncio.sleep(POLL)
            now = signature(self._files)
            if now == before and now != self._seen:
                self._seen = now
                self._worker.submit("file", self._read)
            before = now
            gone = self._left is not None and not self._sessions and time.monotonic() - self._left > GRACE
            if gone and not self._keep:
                self._ended()
                return

    def _read(self) -> None:
        """Read the file again, and tell all pages; what was read last is kept where it cannot be."""
        path = self.opened.path
        self._files = tuple(dict.fromkeys((*self.opened.files_now(), *self.opened.files)))
        self._seen = signature(self._files)
        try:
            self.opened, self._file = self.opened.again(), None
        except Exception as error:
            found = error if isinstance(error, FlexuraError) else OptionError(f"the file cannot be used: {error}")
            self._file = told("file", gone=not path.exists(), problems=problems_of(found))
        for session in list(self._sessions):
            if self._file is None:
                self._open(session.outbox)
            else:
                session.outbox.put("file", self._file)

    def _open(self, outbox: Outbox) -> None:
        """Give a page what was read of the file."""
        for kind, message in self.opened.greetings():
            outbox.put(kind, message)


async def _send(socket: Any, outbox: Outbox) -> None:
    """Send what is put in the outbox, until the page goes."""
    with suppress(Exception):
        while True:
            message = await outbox.next()
            if isinstance(message, bytes):
                await socket.send_bytes(message)
            else:
                await socket.send_text(message)


FIRST, TRIED = 8650, 50
"""The port that is tried first, and how many from there."""

TURN = 5e-4
"""Seconds after which threads take turns: the page is heard while its designs are worked out."""


MODES = 6
"""Modes of a mechanism that are shown, where no number is given."""


@verb
def live(
    path: str | Path,
    *,
    port: int | None = None,
    browser: bool = True,
    keep: bool = False,
    n: int | None = None,
    channels: str | Path | None = None,
    repeated: Repeated | None = None,
) -> None:
    """Serve a page on this machine: a model file with its parameters as sliders, or a test whose modes are picked.

    Of a mechanism the page shows the mechanism in 3-D, its `n` lowest frequencies (6) with their proven intervals, a
    frequency response and stresses, and all follow the sliders. Of measured data, read with `channels` and `repeated`
    as `read_measurement` does, it shows the stabilisation diagram, in which poles are picked, and the modes that
    `identify` makes of these, with their shapes, beside what was measured. Files are read again whenever they are
    written. The address, which is printed, holds a secret token and answers to this machine alone, at `port`, by
    default the first from 8650 that is free. With `browser` it is opened there. The server ends some seconds after the
    last page is closed, unless it is to `keep` on; until then, or Ctrl-C, it is waited for. Raises ModelError for a
    file that cannot be used, and OptionError for data that cannot, for options of the other kind of file, for a port
    that is busy and without the packages of the extra `live`.
    """
    if n is not None and not (isinstance(n, int) and 1 <= n <= MOST_MODES):
        raise OptionError(f"the number of modes is a whole number from 1 to {MOST_MODES}, not {n!r}")
    for name in ("starlette", "uvicorn", "websockets"):
        need(name, "live")
    opened = _opened(Path(path), n, None if channels is None else Path(channels), repeated)
    with _listening(port) as own:
        number, token = own.getsockname()[1], secrets.token_urlsafe(24)
        address = f"http://127.0.0.1:{number}/{token}/"
        with _turns(), scratch_folder() as folder:
            sys.stdout.write(f"{opened.name}: {address}\n")
            sys.stdout.flush()
            if browser and not _shown(address, folder):
                sys.stdout.write("no browser could be opened: open the address in one on this machine\n")
                sys.stdout.flush()
            _serve(opened, own, token, keep)


def _opened(path: Path, n: int | None, channels: Path | None, repeated: Repeated | None) -> Subject:
    """What is in a file. Raises FlexuraError for one that cannot be used."""
    if is_measured(path):
        if n is not None:
            raise OptionError("n is the number of modes of a mechanism: those of a test are picked")
        return OpenedTest.of(path, channels, repeated)
    if channels is not None or repeated is not None:
        raise OptionError(f"channels and repeated are for measured data; {path.name} is read as a mechanism")
    return Opened.of(path, 1, n or MODES)


def _serve(opened: Subject, own: socket.socket, token: str, keep: bool) -> None:
    """Serve until the pages are closed; an interruption ends the server first."""
    uvicorn = need("uvicorn", "live")
    site = Site(opened, token, own.getsockname()[1], lambda: setattr(server, "should_exit", True), keep)
    config = uvicorn.Config(
        site.application(),
        log_config=None,
        log_level="error",  # what is no request is answered, and not worth a word
        access_log=False,
        lifespan="on",
        server_header=False,
        ws_max_size=LARGEST,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(config)
    thread = Thread(target=server.run, kwargs={"sockets": [own]}, name="flexura server", daemon=True)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(0.2)
    finally:
        server.should_exit = True
        thread.join()
        site.close()


@contextmanager
def _listening(port: int | None) -> Iterator[socket.socket]:
    """A socket of this machine alone that listens at a port. Raises OptionError where it is busy."""
    if port is not None and not (isinstance(port, int) and 1 <= port <= 65535):
        raise OptionError(f"a port is a whole number from 1 to 65535, not {port!r}")
    for number in [*range(FIRST, FIRST + TRIED), 0] if port is None else [port]:
        own = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if os.name == "posix":  # where it does not let two listen at one port
            own.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            own.bind(("127.0.0.1", number))
            own.listen(16)
        except OSError as error:
            own.close()
            reason = error.strerror or error
            continue
        with own:
            yield own
        return
    raise OptionError(f"port {port} cannot be listened at: {reason}; without a port the next that is free is taken")


def _shown(address: str, folder: Path) -> bool:
    """Open the address in a browser, by a file that only this user can read: arguments of programs are seen by all."""
    if sys.platform.startswith("linux") and not {"DISPLAY", "WAYLAND_DISPLAY", "BROWSER"} & os.environ.keys():
        return False
    file = folder / "live.html"
    file.write_text(redirection(address), encoding="utf-8")
    file.chmod(0o600)
    try:
        return webbrowser.open(file.as_uri())
    except webbrowser.Error:
        return False


@contextmanager
def _turns() -> Iterator[None]:
    """Let threads take turns more often than they do."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(TURN)
    try:
        yield
    finally:
        sys.setswitchinterval(before)
