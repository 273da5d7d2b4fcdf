"""`python -m flexura` and the shell command `flexura`; an interruption ends both without a word of Python."""

import os
import signal
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line. Until it stands, which takes a second, an interruption leaves at once."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    from flexura.cli import main as command

    command()


if __name__ == "__main__":
    main()
