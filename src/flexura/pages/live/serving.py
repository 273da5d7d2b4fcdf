"""The live page served: an address of this machine, a browser, and an end."""

from __future__ import annotations

import os
import secrets
import socket
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.files import scratch_folder
from flexura.lazy import need
from flexura.pages.live.layout import redirection
from flexura.pages.live.messages import LARGEST, MOST_MODES
from flexura.pages.live.opened import Opened
from flexura.pages.live.server import Site

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
