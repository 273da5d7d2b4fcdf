"""`python -m flexura` and the shell command `flexura`; an interruption ends both without a word of Python."""

import gc
import os
import signal
from typing import NoReturn

GARBAGE = 5000, 10, 10
"""Thresholds of the search for garbage: at Python's own, all that imports make is searched again and again."""


def main() -> NoReturn:
    """Run the command line. Until it stands, which takes a second, an interruption leaves at once."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    gc.set_threshold(*GARBAGE)
    from flexura.cli import main as command

    try:
        command()
    finally:
        gc.freeze()  # what ends with the process is not searched for garbage first


if __name__ == "__main__":
    main()
