"""Ask pyright whether the type of every public name of the installed flexura is known; what is not is printed.

    python tools/public_types.py

The Python that runs this has flexura and pyright. Ends with status 1 where a type is not known.
"""  # fmt: skip

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def main() -> None:
    """Run from the shell."""
    own = Path(sys.executable).parent
    path = f"{own}{os.pathsep}{os.environ['PATH']}"  # packages are those of the first Python there
    command = [own / "pyright", "--verifytypes", "flexura", "--ignoreexternal"]
    done = subprocess.run(command, env={**os.environ, "PATH": path}, stdout=subprocess.PIPE, text=True, check=False)
    head, _, rest = done.stdout.partition("Public modules:")
    print(head + rest.partition("\n\n")[2] if done.returncode else done.stdout.strip().splitlines()[-3])
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
