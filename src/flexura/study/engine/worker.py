"""A process that works out blocks: it reads their numbers, and writes their columns, until nobody asks any more.

It reads pickles from its standard input, the work first, and answers each number on its standard output.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
import time
import traceback
from contextlib import suppress
from typing import Any, NamedTuple

from flexura.errors import FlexuraError, SolverError

LOOKED = 0.5
"""Seconds between two looks at whether the process that asks is still there."""


class Answer(NamedTuple):
    """The columns of a block; or why there are none, in words, with the `trace` of what was not foreseen."""

    columns: dict[str, Any] | None
    words: str = ""
    trace: str = ""

    def error(self, designs: str) -> Exception:
        """What is raised in place of the columns of these designs."""
        if not self.trace:
            return SolverError(f"{designs}: {self.words}")
        error = RuntimeError(f"{designs}: {self.words}")
        error.add_note(self.trace)
        return error


def answered(work: Any, number: int) -> Answer:
    """What a block comes to, errors as words: they are raised by another process."""
    try:
        return Answer(work(number))
    except FlexuraError as error:
        return Answer(None, str(error))
    except Exception as error:
        return Answer(None, f"{type(error).__name__}: {error}", traceback.format_exc())


def serve() -> None:
    """Answer until the input ends, or the process that asks is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interruption of the terminal is for the process that asks
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    asked, told = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print
    with suppress(EOFError, BrokenPipeError):
        work = pickle.load(asked)
        while True:
            pickle.dump(answered(work, pickle.load(asked)), told, protocol=pickle.HIGHEST_PROTOCOL)
            told.flush()


def _end_with(parent: int) -> None:
    """End in the middle of a block when the process that asked for it is gone."""
    while os.getppid() == parent:
        time.sleep(LOOKED)
    os._exit(1)
