"""Shared libraries of C sources, by the compiler of this machine, or for others by zig, which has all their headers."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from flexura.errors import OptionError

FLAGS = ("-std=c99", "-O2", "-fPIC", "-Wall", "-Wextra", "-Werror")


class Platform(NamedTuple):
    """What FMI 2 calls a platform (None where it has no name), the suffix of its libraries, and its name for zig."""

    fmi2: str | None
    suffix: str
    target: str


PLATFORMS = {
    "x86_64-linux": Platform("linux64", ".so", "x86_64-linux-gnu.2.17"),
    "aarch64-linux": Platform(None, ".so", "aarch64-linux-gnu.2.17"),
    "x86_64-windows": Platform("win64", ".dll", "x86_64-windows-gnu"),
    "x86_64-darwin": Platform("darwin64", ".dylib", "x86_64-macos"),
    "aarch64-darwin": Platform(None, ".dylib", "aarch64-macos"),
}
"""Platforms by the names of FMI 3 (section 2.5.1.4.1)."""


def this_platform() -> str:
    """The name of this machine's."""
    system = "linux" if sys.platform.startswith("linux") else {"win32": "windows"}.get(sys.platform, sys.platform)
    machine = platform.machine().lower()
    return f"{ {'amd64': 'x86_64', 'arm64': 'aarch64'}.get(machine, machine) }-{system}"


def platform_of(name: str) -> Platform:
    """A platform by its name. Raises OptionError for one that nothing is known of."""
    if name not in PLATFORMS:
        raise OptionError(f"there is no platform {name!r} to build for; platforms: {', '.join(PLATFORMS)}")
    return PLATFORMS[name]


def build_library(
    folder: Path, compiled: Sequence[str], name: str, flags: Sequence[str] = FLAGS, *, by_zig: bool = False
) -> Path:
    """The library of C sources in a folder for a platform: on this machine by its C compiler unless `by_zig` is asked
    for, or else by zig.

    Raises OptionError when there is none, or when it fails, and for unknown platforms.
    """
    library = folder / f"model{platform_of(name).suffix}"
    is_own = not by_zig and name == this_platform() and not name.endswith("windows")
    compiler = _system_compiler() if is_own else _zig(name)

    def run(*words: str) -> None:
        command, own = [*compiler, *flags, *words], _environment(folder)
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=own)
        if done.returncode:
            hint = " (Debian: apt install gcc libc6-dev has all it needs)" if is_own else f" for {name}"
            raise OptionError(f"the C compiler {compiler[0]} failed{hint}: {' '.join(done.stderr.split())[:300]}")

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda source: run("-c", source, "-o", f"{source}.o"), compiled))
    last = [*([] if is_own else ["-s"]), *(["-lm"] if name.endswith("linux") else [])]
    run("-shared", "-o", library.name, *(f"{source}.o" for source in compiled), *last)
    return library


def _environment(folder: Path) -> dict[str, str]:
    """The compiler's own files go with the folder; zig keeps what it has built of other platforms."""
    return {**os.environ, "TMPDIR": str(folder), "ZIG_LOCAL_CACHE_DIR": str(folder)}


def _system_compiler() -> list[str]:
    name = os.environ.get("CC", "cc")
    compiler = shutil.which(name) or shutil.which("gcc")
    if compiler is None:
        raise OptionError(
            f"there is no C compiler {name!r}: install one (Debian: apt install gcc libc6-dev), or write FMUs with"
            " sources alone (`binary=False`)"
        )
    return [compiler]


def _zig(name: str) -> list[str]:
    """The zig of the package ziglang, or the one on the path."""
    found = shutil.which("zig")
    if importlib.util.find_spec("ziglang") is not None:
        command = [sys.executable, "-m", "ziglang"]
    elif found is not None:
        command = [found]
    else:
        raise OptionError(
            f"nothing here compiles for {name}: pip install ziglang, a C compiler for all platforms, or write the FMU"
            " with sources alone (`binary=False`)"
        )
    return [*command, "cc", "-target", PLATFORMS[name].target]
