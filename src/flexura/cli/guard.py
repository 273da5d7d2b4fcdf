"""What stands around every command: whatever goes wrong becomes a sentence on stderr and an exit status.

0 is success, 2 bad input and everything unforeseen, 130 an interruption, 1 an answer that could not be worked out or
did not hold, and output that nobody reads any more.
"""

from __future__ import annotations

import codecs
import io
import os
import re
import signal
import sys
import unicodedata
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, current_thread, main_thread
from typing import Any

TRACEBACK = "FLEXURA_TRACEBACK"
"""The variable that shows where an unforeseen error comes from."""

INTERRUPTED, CLOSED = 130, 1

_ASCII = {
    "²": "^2",
    "³": "^3",
    "…": "...",
    "–": "-",
    "—": "-",
    "−": "-",
    "×": "x",
    "·": "*",
    "±": "+-",
    "µ": "u",
    "μ": "u",
    "°": "deg",
}


def run(command: Callable[[], Any]) -> int:
    """Run a command; its exit status. Nothing is raised."""
    show = bool(os.environ.get(TRACEBACK, "").strip("0 ")) or "--traceback" in sys.argv
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by the caller
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115  as long as Python runs
    with _quiet(not show), _interruptible() as interrupted:
        try:
            status = _flushed(_status(command, show, interrupted))
        except KeyboardInterrupt:
            status = _interrupted()
        with suppress(OSError, ValueError):
            sys.stderr.flush()
        return status


@contextmanager
def _interruptible() -> Iterator[Event]:
    """An event that is set by an interruption, whatever it is turned into on its way here, and never lost."""
    happened = Event()

    def stop(*_: object) -> None:
        happened.set()
        raise KeyboardInterrupt

    def lost(unraisable: Any) -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):  # it fell into a place that cannot raise: once more
            signal.raise_signal(signal.SIGINT)

    if signal.getsignal(signal.SIGINT) in (signal.SIG_IGN, None) or current_thread() is not main_thread():
        yield happened
        return
    before, hook = signal.signal(signal.SIGINT, stop), sys.unraisablehook
    sys.unraisablehook = lost
    try:
        yield happened
    finally:
        signal.signal(signal.SIGINT, before)
        sys.unraisablehook = hook


def _status(command: Callable[[], Any], show: bool, interrupted: Event) -> int:
    try:
        status = command()
        if status == INTERRUPTED and interrupted.is_set():  # what typer makes of an interruption
            return _interrupted()
        return status if isinstance(status, int) else 0
    except BaseException as error:
        return _interrupted() if interrupted.is_set() else _told(error, show)


def _told(error: BaseException, show: bool) -> int:
    """Say what went wrong; the exit status."""
    from typer import Abort

    from flexura.errors import ExpressionError, FlexuraError, ModelError, OptionError

    gone = _of_output(error) if isinstance(error, OSError) else None
    if gone is not None:
        return gone
    match error:
        case SystemExit():
            return error.code if isinstance(error.code, int) else 1
        case ModelError():
            return _fail("\n".join(map(str, error.problems)) + f"\n{len(error.problems)} error(s)", 2)
        case OptionError() | ExpressionError():
            return _fail(f"flexura: {with_option(str(error), sys.argv[1:])}", 2)
        case FlexuraError():
            return _fail(f"flexura: {error}", 1)
        case KeyboardInterrupt():
            return _interrupted()
        case Abort():  # what typer makes of an end of file
            return _unforeseen(error.__context__ or error, show)
    if hasattr(error, "show") and hasattr(error, "exit_code"):  # an argument that is not understood
        error.show()  # pyright: ignore[reportAttributeAccessIssue]
        return int(error.exit_code)  # pyright: ignore[reportAttributeAccessIssue]
    return _unforeseen(error, show)


def _unforeseen(error: BaseException, show: bool) -> int:
    """Say what nobody has foreseen, and how to report it."""
    if show:
        import traceback

        return _fail("".join(traceback.format_exception(error)), 2)
    detail = " ".join(f"{type(error).__name__}: {error}".split())[:500].rstrip(": ")
    found = "an error that was not foreseen"
    if isinstance(error, MemoryError):
        found = "this needs more memory than there is"
    elif isinstance(error, RecursionError):
        found = "what is described is nested too deeply"
    elif isinstance(error, ArithmeticError) or type(error).__name__ == "LinAlgError":
        found = "the numbers of this mechanism lie too far apart for double precision"
    hint = f"please report it, with the files and what --traceback (or {TRACEBACK}=1) prints in place of this"
    return _fail(f"flexura: {found} ({detail})\n    hint: {hint}", 2)


def _fail(text: str, status: int) -> int:
    with suppress(OSError, ValueError):
        sys.stderr.write(text.rstrip() + "\n")
    return status


def _interrupted() -> int:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return _fail("flexura: interrupted; no file was left half written", INTERRUPTED)


def _flushed(status: int) -> int:
    """Everything printed has to arrive."""
    try:
        sys.stdout.flush()
    except OSError as error:
        gone = _of_output(error)
        return _fail(f"flexura: the output cannot be written: {error}", 2) if gone is None else gone
    return status


def _of_output(error: OSError) -> int | None:
    """Exit status where an error is one of the output: a pipe that is closed, a disk that is full."""
    import errno

    if isinstance(error, BrokenPipeError):
        _discard_output()
        return CLOSED
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG) and error.filename is None:
        _discard_output()
        return _fail(f"flexura: the output cannot be written: {error.strerror}", 2)
    return None


def _discard_output() -> None:
    """Let what is still in the buffer of stdout go nowhere, so that nothing fails when Python ends."""
    with suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


@contextmanager
def _quiet(silent: bool) -> Iterator[None]:
    """Our own words alone reach stderr, in characters that the terminal has; libraries' warnings and prints do not."""
    _in_its_characters(sys.stdout)
    if not silent:
        yield
        return
    with warnings.catch_warnings(), _alone_on_stderr():
        # results that are not finite are refused or shown as such; warnings would only name lines of the program
        warnings.simplefilter("ignore")
        yield


@contextmanager
def _alone_on_stderr() -> Iterator[None]:
    """sys.stderr keeps its place; what compiled libraries print to the same place goes nowhere."""
    before = sys.stderr
    try:
        is_real = before.fileno() == 2
    except (AttributeError, OSError, ValueError):
        is_real = False
    if not is_real:
        yield
        return
    before.flush()
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    os.close(nowhere)
    sys.stderr = os.fdopen(kept, "w", buffering=1, encoding=before.encoding, errors="backslashreplace", closefd=False)
    try:
        yield
    finally:
        with suppress(OSError):
            sys.stderr.flush()
        sys.stderr = before
        os.dup2(kept, 2)
        os.close(kept)


def _in_its_characters(stream: Any) -> None:
    """Replace characters that a stream's encoding lacks instead of failing on them."""
    codecs.register_error("flexura", _replaced)
    if isinstance(stream, io.TextIOWrapper):
        with suppress(OSError, ValueError):
            stream.reconfigure(errors="flexura")


def _replaced(error: UnicodeError) -> tuple[str, int]:
    """Something like the character that cannot be written, or its number."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    found = []
    for character in error.object[error.start : error.end]:
        plain = _ASCII.get(character) or unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
        found.append(plain or f"\\u{ord(character):04x}")
    return "".join(found), error.end


def with_option(text: str, arguments: Sequence[str]) -> str:
    """The text of an error with the option in front that gave what it is about; as it is where that is not clear.

    An error that quotes a value, or names a parameter, is about the one option with that value, or with that value
    before its `=`; one that begins with the name of an argument is about the option of that name.
    """
    if text.startswith("-"):
        return text
    given = list(_options(arguments))
    quoted = {a or b for a, b in re.findall(r"'([^']+)'|^parameter (\w+)", text)}
    about = [(o, v) for o, v in given if v in quoted or v.partition("=")[0] in quoted or quoted & set(v.split(","))]
    if not about:
        first = re.match(r"\w+", text)
        about = [(o, v) for o, v in given if first and o.lstrip("-").replace("-", "_") == first[0]]
    if len(set(about)) != 1:
        return text
    option, value = about[0]
    return f"{option} {value!r}: {text}"


def _options(arguments: Sequence[str]) -> list[tuple[str, str]]:
    """Options of a command line, each with the text that follows it."""
    found = []
    for option, after in zip(arguments, [*arguments, ""][1:], strict=True):
        if not re.match(r"--?[A-Za-z]", option):
            continue
        name, equals, value = option.partition("=")
        found.append((name, value if equals else after))
    return found
