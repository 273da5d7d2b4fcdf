"""What `make demo` shows: commands of the shell, each printed before its answer, in one process that starts once.

python examples/rpr/demo.py
"""

from __future__ import annotations

import gc
import shlex
import sys

from flexura.__main__ import GARBAGE
from flexura.cli import main

COMMANDS = """
flexura check examples/rpr/rpr.yaml
flexura modes examples/rpr/rpr.yaml -n 6 --plot out/rpr
flexura frequency-response examples/rpr/rpr.yaml --band '3,60 Hz' --damping 0.01 --plot out/rpr
flexura kinetostatics examples/rpr/rpr_piezo.yaml
flexura stroke examples/rpr/rpr.yaml --move platform.rx=-2deg:2deg --steps 9 -n 4 --plot out/rpr
flexura virtual-test examples/rpr/rpr_test.yaml --measured examples/rpr/table5.csv --plot out/rpr
"""

gc.set_threshold(*GARBAGE)
for line in COMMANDS.strip().splitlines():
    print(f"$ {line}", flush=True)
    sys.argv = shlex.split(line)
    try:
        main()
    except SystemExit as ended:
        if ended.code:
            raise
gc.freeze()  # as `flexura` does: what ends with the process is not searched for garbage first
