"""One thread that works for all pages, and drops what nobody waits for any more."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from contextvars import copy_context
from threading import Condition, Thread

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
