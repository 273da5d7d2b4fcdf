"""Runs the shell command in a process of its own, a fork where that says the same, within limits of memory and time."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import IO

from helpers import forked

GUIDE = Path(__file__).parents[2] / "examples" / "guide" / "guide.yaml"
SECONDS = 120
LIMITS = {"AS": 3 << 30, "CPU": SECONDS, "CORE": 0}


OF_THE_INTERPRETER = ("PYTHON", "LANG", "LC_")
"""Beginnings of the variables that Python reads when it starts."""


def bounded() -> None:
    """Limits of a child process: memory and processor time."""
    for name, most in LIMITS.items():
        resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (most, most))


def flexura(*args: object, stdout: IO[str] | None = None, **env: str) -> subprocess.CompletedProcess[str]:
    """Run `flexura ARGS`; stdout and stderr as text."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", **env}
    if not any(name.startswith(OF_THE_INTERPRETER) for name in env):
        out = None if stdout is None else stdout.fileno()
        return forked.completed(*args, env=environment, stdout=out, timeout=2 * SECONDS, **LIMITS)
    return subprocess.run(
        [sys.executable, "-m", "flexura", *map(str, args)],
        capture_output=True,
        text=True,
        errors="replace",
        timeout=2 * SECONDS,
        check=False,
        preexec_fn=bounded,
        env=environment,
    )


def refused(result: subprocess.CompletedProcess[str], *words: str) -> None:
    """Assert that a command ended with a sentence and status 2."""
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr and "not foreseen" not in result.stderr, result.stderr
    assert all(word in result.stderr for word in words), result.stderr
