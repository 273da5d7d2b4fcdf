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
from flexura.modelfile import files_of
from flexura.pages.live.designs import LARGEST, MOST_MODES, read_message, told
from flexura.pages.live.opened import Opened, problems_of, signature
from flexura.pages.live.session import Outbox, Session, Worker
from flexura.pages.viewer import page

_BODY = """<div class="live">
<header class="live-head">
  <h1 id="live-title">{name}</h1>
  <p class="soft" id="live-file">{file}</p>
  <p id="live-status" role="status">The page is connecting.</p>
  <p class="soft" id="live-time" title="from the hand to the picture"></p>
  <div class="live-tools" role="toolbar" aria-label="design">
    <button type="button" id="live-undo" title="Ctrl+Z" disabled>Undo</button>
    <button type="button" id="live-redo" title="Ctrl+Y" disabled>Redo</button>
    <button type="button" id="live-reset" disabled>Reset all</button>
    <button type="button" id="live-pin" disabled>Pin</button>
    <button type="button" id="live-save" disabled>Save as…</button>
    <button type="button" id="live-theme" aria-label="dark or light">◐</button>
  </div>
</header>
<div class="live-extra">
  <noscript><p class="bad">This page needs scripts, which are turned off.</p></noscript>
  <section id="live-problems" class="live-problems" aria-label="problems" hidden></section>
  <form id="live-saving" class="live-saving" aria-label="save as a new file" hidden></form>
  <section id="live-pins" class="live-pins" aria-label="pinned designs"></section>
</div>
<div class="live-sliders"><section aria-label="requirements" id="live-requirements" hidden></section>
<section aria-label="parameters" id="live-sliders"></section></div>
<main class="live-stage" aria-label="mechanism">
  <div id="live-viewer" class="live-viewer"></div>
  <p id="live-notes" class="soft"></p>
</main>
<section class="live-results" aria-label="results" id="live-results"></section>
</div>"""


def live_page(opened: Opened, connect: Sequence[str]) -> str:
    """The HTML of the page of a file; it may connect to the addresses given, and nowhere else."""
    body = _BODY.format(name=escape(opened.plan.name), file=escape(opened.path.name))
    return page(f"{opened.plan.name}: live", body, "live", connect=" ".join(connect))


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

    def __init__(self, opened: Opened, token: str, port: int, ended: Callable[[], None], keep: bool) -> None:
        self.opened: Opened = opened
        self._token, self._ended, self._keep = token, ended, keep
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
        self._sessions: set[Session] = set()
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
        session = Session(self._worker, lambda: self.opened, outbox)
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

    async def _listen(self, socket: Any, session: Session) -> None:
        """Take messages until the page goes."""
        mistakes = 0
        while (message := await socket.receive())["type"] == "websocket.receive":
            text = message.get("text")
            try:
                if text is None or len(text) > LARGEST:
                    raise OptionError("a message is text of bounded size")
                session.receive(read_message(text))
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
        self._files = tuple(dict.fromkeys((*files_of(path), *self.opened.files)))
        self._seen = signature(self._files)
        try:
            self.opened, self._file = Opened.of(path, self.opened.revision + 1, self.opened.modes), None
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
        outbox.put("scene", self.opened.scene)
        outbox.put("opened", told("opened", **self.opened.greeting))


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


@verb
def live(path: str | Path, *, port: int | None = None, browser: bool = True, keep: bool = False, n: int = 6) -> None:
    """Serve a page on this machine whose sliders are the parameters of a model file; until it is closed, or Ctrl-C.

    The page shows the mechanism in 3-D, its `n` lowest frequencies with their proven intervals, a frequency response
    and stresses, and all follow the sliders. The file is read again whenever it is written. The address, which is
    printed, holds a secret token and answers to this machine alone, at `port`, by default the first from 8650 that is
    free. With `browser` it is opened there. The server ends some seconds after the last page is closed, unless it is to
    `keep` on. Raises ModelError for a file that cannot be used, and OptionError for a port that is busy and without the
    packages of the extra `live`.
    """
    if not isinstance(n, int) or not 1 <= n <= MOST_MODES:
        raise OptionError(f"the number of modes is a whole number from 1 to {MOST_MODES}, not {n!r}")
    for name in ("starlette", "uvicorn", "websockets"):
        need(name, "live")
    opened = Opened.of(Path(path), 1, n)
    with _listening(port) as own:
        number, token = own.getsockname()[1], secrets.token_urlsafe(24)
        address = f"http://127.0.0.1:{number}/{token}/"
        with _turns(), scratch_folder() as folder:
            sys.stdout.write(f"{opened.plan.name}: {address}\n")
            sys.stdout.flush()
            if browser and not _shown(address, folder):
                sys.stdout.write("no browser could be opened: open the address in one on this machine\n")
                sys.stdout.flush()
            _serve(opened, own, token, keep)


def _serve(opened: Opened, own: socket.socket, token: str, keep: bool) -> None:
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
