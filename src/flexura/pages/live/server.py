"""The server of the live page: one file, on this machine, to those who know its token."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from hmac import compare_digest
from typing import Any

from flexura.errors import FlexuraError, OptionError
from flexura.lazy import need
from flexura.modelfile import files_of
from flexura.pages.live.layout import live_page
from flexura.pages.live.messages import LARGEST, read_message, told
from flexura.pages.live.opened import Opened, problems_of, signature
from flexura.pages.live.session import Outbox, Session
from flexura.pages.live.worker import Worker

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
