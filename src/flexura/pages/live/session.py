"""One page: what it asked for last, what it is told, and the one thread that works for all pages."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Hashable
from contextvars import copy_context
from itertools import count
from pathlib import Path
from threading import Condition, Thread
from typing import Any

from flexura.errors import FlexuraError
from flexura.pages.live.described import FollowedModes
from flexura.pages.live.designs import Ask, Designs, Save, Shown, Steps, read_message, told
from flexura.pages.live.opened import Opened

Work = Callable[[], None]


class Worker:
    """Works in a thread of its own: of every key the latest work alone, and the keys by turns.

    What it is given must not raise. It sees the size limits that hold where it is made.
    """

    def __init__(self) -> None:
        self._waiting: dict[Hashable, Work] = {}
        self._changed = Condition()
        self._closed = False
        self._thread = Thread(target=copy_context().run, args=(self._run,), name="flexura live", daemon=True)
        self._thread.start()

    def submit(self, key: Hashable, work: Work) -> None:
        """Have work done, in place of what of the same key has not begun."""
        with self._changed:
            self._waiting[key] = work
            self._changed.notify()

    def resume(self, key: Hashable, work: Work) -> None:
        """Have work done that was put off, unless there is newer of the same key."""
        with self._changed:
            self._waiting.setdefault(key, work)
            self._changed.notify()

    def is_waiting(self, key: Hashable = None) -> bool:
        """Whether work of a key is waiting, or any: what is done now should then end soon."""
        return self._closed or (key in self._waiting if key is not None else bool(self._waiting))

    def drop(self, key: Hashable) -> None:
        """Forget what of a key has not begun."""
        with self._changed:
            self._waiting.pop(key, None)

    def close(self) -> None:
        """End when what has begun is done."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            self._changed.notify()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                work = self._waiting.pop(next(iter(self._waiting)))
            work()


FRAME = 0.04
"""Seconds after which a picture is drawn although the hand has moved on."""

PATIENCE = 0.12
"""Seconds after which a step of what takes longer is worked on although the hand still moves."""

BRIEF = 0.05
"""Seconds up to which a step is one that is worked on while the hand moves: the next picture waits for it."""

AT_REST = ("facts", "model errors")
"""Steps that wait until the hand rests."""

_NUMBER = count()


class Outbox:
    """Messages to a page, from any thread; of each kind in `REPLACED` the latest alone."""

    REPLACED = ("numbers", "picture", "motions", "stress", "response", "model errors", "holds")

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._waiting: list[tuple[str, str | bytes]] = []
        self._filled = asyncio.Event()

    def put(self, kind: str, message: str | bytes) -> None:
        """Have a message sent."""
        self._loop.call_soon_threadsafe(self._add, kind, message)

    def _add(self, kind: str, message: str | bytes) -> None:
        if kind in self.REPLACED:
            self._waiting = [own for own in self._waiting if own[0] != kind]
        self._waiting.append((kind, message))
        self._filled.set()

    async def next(self) -> str | bytes:
        """The next message, once there is one."""
        while not self._waiting:
            self._filled.clear()
            await self._filled.wait()
        return self._waiting.pop(0)[1]


class PageSession:
    """A page that is open: what it asks for is worked out one after another, in the one thread for all pages.

    `read` makes a message of a text, and `receive` has done what it asks for.
    """

    read: Callable[[str], Any]
    receive: Callable[[Any], None]

    def __init__(self, worker: Worker, outbox: Outbox) -> None:
        self.outbox = outbox
        self._worker = worker
        self._key = next(_NUMBER)

    def close(self) -> None:
        """Nothing is worked out for this page any more."""
        self._worker.drop(self._key)

    def _say(self, kind: str, **data: Any) -> None:
        self.outbox.put(kind, told(kind, **data))

    def _saved(self, file: str, save: Callable[[], Path]) -> None:
        """Say what became of a file that is saved."""
        try:
            path = save()
        except FileExistsError:
            self._say("exists", file=file)
        except FlexuraError as error:
            self._say("not saved", file=file, text=str(error))
        else:
            self._say("saved", file=path.name)


class Session(PageSession):
    """A page of a mechanism: its designs are worked out."""

    read: Callable[[str], Any] = staticmethod(read_message)

    def __init__(self, worker: Worker, opened: Callable[[], Opened], outbox: Outbox) -> None:
        super().__init__(worker, outbox)
        self._opened = opened
        self._followed = FollowedModes()
        self._designs = Designs(opened(), self._followed)
        self._held: dict[str, float] = {}
        self._step, self._drawn, self._rested = 0, 0.0, 0.0
        self._took: dict[str, float] = {}

    def receive(self, message: Ask | Save) -> None:
        """Have done what the page asks for."""
        if isinstance(message, Save):
            own = message
            save = lambda: self._opened().save(own.file, own.values, own.overwrite)  # noqa: E731
            self._worker.submit((self._key, "save"), lambda: self._saved(own.file, save))
        else:
            self._worker.submit(self._key, lambda: self._design(message))

    def _design(self, ask: Ask) -> None:
        opened = self._opened()
        if opened is not self._designs.described:
            self._designs = Designs(opened, self._followed)
        try:
            numbers, shown = self._designs.numbers(ask)
            self.outbox.put("numbers", numbers)
            if self._worker.is_waiting(self._key) and time.monotonic() - self._drawn < FRAME:
                return
            *scenes, picture = self._designs.picture(shown)
        except Exception as error:  # whatever it is, the page is told and the others go on
            self._refused(ask, error)
            return
        for scene in scenes:
            self.outbox.put("scene", scene)
        self.outbox.put("picture", picture)
        self._drawn = time.monotonic()
        self._details(shown, self._designs.details(shown))

    def _details(self, shown: Shown, left: Steps) -> None:
        """The steps that are left of what takes longer, as long as nobody waits for something else.

        While the hand moves a brief one is taken now and then, another one each time; once it rests all are, in order.
        """
        is_moving = self._worker.is_waiting(self._key)
        if is_moving:
            left = [own for own in left if own[0] not in AT_REST and self._took.get(own[0], 0.0) < BRIEF]
            if time.monotonic() - self._rested < PATIENCE:
                return
        while left:
            kind, step = left.pop(self._step % len(left) if is_moving else 0)
            self._step += 1
            begun = time.monotonic()
            try:
                self.outbox.put(kind, step())
            except Exception as error:
                self._refused(shown.ask, error)
                return
            self._rested = time.monotonic()
            self._took[kind] = self._rested - begun
            if self._worker.is_waiting(self._key):
                return
            if left and self._worker.is_waiting():
                self._worker.resume(self._key, lambda: self._details(shown, left))
                return
        self._held = shown.ask.values
        self._say("settled", serial=shown.ask.serial)

    def _refused(self, ask: Ask, error: Exception) -> None:
        """Say what is wrong with a design, and at which sliders."""
        self._say("refused", serial=ask.serial, problems=self._designs.problems(ask, error, self._held))
