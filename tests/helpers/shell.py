"""Runs the shell command in a process of its own, within limits of memory and time."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

GUIDE = Path(__file__).parents[2] / "examples" / "guide" / "guide.yaml"
ADDRESS_SPACE = 3 << 30
SECONDS = 120


def bounded() -> None:
    """Limits of a child process: memory and processor time."""
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def flexura(*args: object, stdout: object = subprocess.PIPE, **env: str) -> subprocess.CompletedProcess[str]:
    """Run `flexura ARGS`; stdout and stderr as text."""
    return subprocess.run(
        [sys.executable, "-m", "flexura", *map(str, args)],
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        timeout=2 * SECONDS,
        check=False,
        preexec_fn=bounded,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", **env},
    )


def refused(result: subprocess.CompletedProcess[str], *words: str) -> None:
    """Assert that a command ended with a sentence and status 2."""
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr and "not foreseen" not in result.stderr, result.stderr
    assert all(word in result.stderr for word in words), result.stderr
