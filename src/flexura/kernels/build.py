"""Build the library of kernels where they stand: `python -m flexura.kernels.build`, which installations do, too.

Nothing but Python and a C compiler is needed.
"""

from __future__ import annotations

import hashlib
import tempfile
from pathlib import Path

from flexura.compilers import PLATFORMS, build_library, this_platform

SOURCES = Path(__file__).parent / "sources"

FLAGS = ("-std=c11", "-O3", "-fno-math-errno", "-ffp-contract=fast", "-fPIC", "-Wall", "-Wextra", "-Wno-psabi")


def library_path(name: str | None = None) -> Path:
    """Where the library for a platform stands, by default this one; Python takes no file with two dots for a module."""
    name = name or this_platform()
    return SOURCES.parent / f"kernels.{name}{PLATFORMS[name].suffix if name in PLATFORMS else ''}"


def digest() -> str:
    """Of all sources, by which a library is told from one of other sources."""
    texts = (path.name.encode() + path.read_bytes() for path in sorted(SOURCES.iterdir()))
    return hashlib.sha256(b"\0".join(texts)).hexdigest()


def build(name: str | None = None) -> Path:
    """Compile for a platform by zig, by default for this one by its own compiler, whose warnings end nothing.

    Raises OptionError when no compiler is there, or when it fails.
    """
    path = library_path(name)
    with tempfile.TemporaryDirectory(prefix="flexura-", dir=path.parent) as scratch:
        folder = Path(scratch)
        for source in SOURCES.iterdir():
            (folder / source.name).write_bytes(source.read_bytes())
        (folder / "digest.c").write_text(f'const char *flexura_digest(void) {{ return "{digest()}"; }}\n')
        compiled = sorted(source.name for source in folder.glob("*.c"))
        built = build_library(folder, compiled, name or this_platform(), FLAGS, by_zig=name is not None)
        built.replace(path)
    return path


if __name__ == "__main__":
    print(build())
