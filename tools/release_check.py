"""Build flexura as it would be released and try it where nothing else is installed.

    python tools/release_check.py [--only clean,extras,lowest] [--extras NAMES] [--keep FOLDER]

The sdist is built, and from it the wheel. `clean` installs the wheel with its core dependencies alone into a new
environment for every Python that is found, imports every module and runs every command, which works or names the
extra that it needs. `extras` tries each extra in an environment of its own. `lowest` installs the least versions that
pyproject.toml allows and runs tests there. What is run stands in release_tries.py. Ends with status 1 where anything
fails.
"""  # fmt: skip

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from pathlib import Path

from release_tries import CODE, CORE, EXTRA, NAMED, WITH

ROOT = Path(__file__).parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
SCRIPT = "src/flexura/pages/web/"
"""Source of the pages' script, of which the wheel has what is built alone."""
STEPS = ("clean", "extras", "lowest")
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
MOST = 3_000_000
"""Bytes that a wheel may have."""
IMPORT_ALL = """
import importlib, pkgutil, flexura
names = [m.name for m in pkgutil.walk_packages(flexura.__path__, "flexura.") if not m.name.endswith("__main__")]
for name in names:
    importlib.import_module(name)
faces = [flexura, flexura.describe, flexura.modal, flexura.solid, flexura.testing, flexura.view]
public = [getattr(face, name) for face in faces for name in face.__all__]
print(f"{len(names)} modules, {len(public)} public names, numpy {__import__('numpy').__version__}")
"""
TESTS = (
    "tests/beam",
    "tests/units",
    "tests/mechanism",
    "tests/linalg",
    "tests/statics",
    "tests/cli/test_cli_commands.py",
)
"""Run with the least versions; none of them needs an extra."""


def run(command: list[object], cwd: Path, quiet: bool = True) -> str:
    """Run a command without the caller's paths; its output. Raises RuntimeError with it where the command fails."""
    env = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")}
    env |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MPLBACKEND": "agg", "COLUMNS": "150"}
    words = [str(word) for word in command]
    done = subprocess.run(words, cwd=cwd, env=env, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(
            f"{' '.join(words)} ended with {done.returncode}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
        )
    if not quiet:
        said = "every module" if words[-2] == "-c" else Path(words[0]).name + " " + " ".join(words[1:])
        print(f"    {said}: {(done.stdout.strip().splitlines() or [''])[-1]}", flush=True)
    return done.stdout


def interpreter(version: str) -> Path | None:
    """A Python of that version, from the search path or from pyenv; None where there is none that works."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    own = [sys.executable] if sys.version_info[:2] == tuple(map(int, version.split("."))) else []
    for place in (*own, shutil.which(f"python{version}"), *sorted(pyenv.glob(f"{version}.*/bin/python"))):
        if place is not None:
            found = subprocess.run(
                [place, "-c", "import sys, venv, ensurepip; print('%d.%d' % sys.version_info[:2])"],
                capture_output=True,
                text=True,
                check=False,
            )
            if found.returncode == 0 and found.stdout.strip() == version:
                return Path(place)
    return None


def environment(python: Path, folder: Path) -> Path:
    """A new virtual environment; its Python."""
    run([python, "-m", "venv", "--clear", folder], folder.parent)
    return folder / ("Scripts" if os.name == "nt" else "bin") / "python"


def build(folder: Path) -> Path:
    """Make the sdist and, from it, the wheel; look at what is inside; the wheel."""
    python = environment(Path(sys.executable), folder / "build")
    run([python, "-m", "pip", "install", "--quiet", "build"], folder)
    shutil.rmtree(folder / "dist", ignore_errors=True)
    run([python, "-m", "build", "--outdir", folder / "dist", ROOT], folder)
    (wheel,), (sdist,) = (folder / "dist").glob("*.whl"), (folder / "dist").glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as archive:
        packed = {name for name in archive.namelist() if ".dist-info/" not in name}
        licences = [name for name in archive.namelist() if name.endswith("/LICENSE")]
    size = wheel.stat().st_size
    if size > MOST:
        raise RuntimeError(f"{wheel.name} has {size} bytes, more than {MOST}")
    tracked = set(run(["git", "ls-files", "src/flexura"], ROOT).split())
    shipped = {name for name in tracked if not name.startswith(SCRIPT) or name.startswith(f"{SCRIPT}dist/")}
    other = {name.removeprefix("src/") for name in shipped} ^ packed
    if other or not licences:
        raise RuntimeError(f"the wheel differs from src/flexura: {sorted(other)}, licences {licences}")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    absent = {"pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md", "tests/conftest.py"} - names
    private = sorted(name for name in names if name.startswith((".venv", "out/", "dist/")))
    if absent or private:
        raise RuntimeError(f"the sdist lacks {sorted(absent)} and has {private[:5]}")
    said = {name: (ROOT / name).read_text(encoding="utf-8") for name in ("docs/releasing.md", "Dockerfile", "Makefile")}
    silent = [name for name, text in said.items() if "gmsh" not in text or "GPL" not in text]
    silent += [name for name in ("docs/releasing.md", "Dockerfile") if "MKL" not in said[name]]
    if silent:
        raise RuntimeError(f"what is not under a permissive licence is not named in {silent}")
    print(f"    {wheel.name}: {size / 1e6:.2f} MB, {len(packed)} files; {sdist.name}: {len(names)}")
    return wheel


def clean(wheel: Path, folder: Path) -> list[str]:
    """Try the wheel with its core dependencies alone on every Python found; the versions that were not found."""
    shutil.copytree(ROOT / "examples", folder / "examples", dirs_exist_ok=True)
    absent = []
    for version in PYTHONS:
        found = interpreter(version)
        if found is None:
            print(f"  Python {version}: not on this machine, SKIPPED", flush=True)
            absent.append(version)
            continue
        print(f"  Python {version}", flush=True)
        python = environment(found, folder / f"clean-{version}")
        run([python, "-m", "pip", "install", "--quiet", wheel], folder)
        run([python, "-W", "error::DeprecationWarning:flexura", "-c", IMPORT_ALL], folder, quiet=False)
        try_core(python, folder)
    return absent


def try_core(python: Path, folder: Path) -> None:
    """Every command, in an environment with core dependencies alone: it works, or names the extra that it needs."""
    lines = [*CORE, *(line for lines in EXTRA.values() for line in lines), *NAMED.values()]
    listed = "import flexura.cli.app as own; print(*own.COMMANDS)"
    untried = set(run([python, "-c", listed], folder).split()) - {shlex.split(line)[0] for line in lines}
    if untried:
        raise RuntimeError(f"commands that are not tried: {sorted(untried)}")
    flexura = python.with_name("flexura")
    for line in CORE:
        run([flexura, *shlex.split(line)], folder, quiet=False)
    without: dict[str, list[object]] = {extra: [flexura, *shlex.split(lines[0])] for extra, lines in EXTRA.items()}
    without |= {extra: [flexura, *shlex.split(line)] for extra, line in NAMED.items()}
    without |= {extra: [python, "-c", code] for extra, code in CODE.items()}
    for extra, command in without.items():
        try:
            run(command, folder)
        except RuntimeError as error:
            if f"flexura[{extra}]" not in str(error):
                raise RuntimeError(f"without the extra {extra}, which is not named: {error}") from None
        else:
            raise RuntimeError(f"{' '.join(map(str, command))} works without the extra {extra}")
    print(f"    named where they are missing: {', '.join(sorted(without))}", flush=True)


def extras(wheel: Path, folder: Path, asked: set[str]) -> None:
    """Each extra in an environment of its own, on the Python that runs this: what it is for works."""
    shutil.copytree(ROOT / "examples", folder / "examples", dirs_exist_ok=True)
    named = {*EXTRA, *CODE, *WITH}
    if untried := PYPROJECT["project"]["optional-dependencies"].keys() - {"all", "bench", "dev", "docs"} - named:
        raise RuntimeError(f"extras that are not tried: {sorted(untried)}")
    for extra in sorted(named & asked if asked else named):
        shutil.rmtree(folder / "out", ignore_errors=True)
        (folder / "out").mkdir()
        python = environment(Path(sys.executable), folder / f"extra-{extra}")
        run([python, "-m", "pip", "install", "--quiet", f"{wheel}[{extra}]"], folder)
        for line in EXTRA.get(extra, ()):
            run([python.with_name("flexura"), *shlex.split(line)], folder)
        for number, code in enumerate(own[extra] for own in (CODE, WITH) if extra in own):
            script = folder / f"extra_{extra}_{number}.py"
            script.write_text(code, encoding="utf-8")
            run([python, script], folder)
        print(f"  flexura[{extra}]: works", flush=True)


def least_versions() -> list[str]:
    """The core dependencies, pinned to the least versions that pyproject.toml allows."""
    wanted = PYPROJECT["project"]["dependencies"]
    unbounded = [text for text in wanted if not re.fullmatch(r"[\w.-]+>=[\d.]+", text)]
    if unbounded:
        raise RuntimeError(f"no lower bound alone: {unbounded}")
    return [text.replace(">=", "==") for text in wanted]


def lowest(wheel: Path, folder: Path) -> None:
    """Tests and commands with the least versions of core dependencies, on the least Python that is found."""
    pins = folder / "lowest.txt"
    pins.write_text("\n".join(least_versions()) + "\n", encoding="utf-8")
    python = environment(next(filter(None, map(interpreter, PYTHONS))), folder / "lowest")
    run([python, "-m", "pip", "install", "--quiet", "-c", pins, wheel, "pytest", "hypothesis", "mpmath"], folder)
    print(f"    {' '.join(least_versions())}", flush=True)
    shutil.copytree(ROOT / "examples", folder / "examples", dirs_exist_ok=True)
    for line in CORE:
        run([python.with_name("flexura"), *shlex.split(line)], folder, quiet=False)
    options = ["-p", "no:cacheprovider", "-W", "default"]  # libraries of then warn of their own ways
    with tarfile.open(next((folder / "dist").glob("*.tar.gz"))) as archive:
        archive.extractall(folder, filter="data")
    own = folder / wheel.name.partition("-py3")[0]
    shutil.rmtree(own / "src")  # the tests of the sdist, on the wheel
    run([python, "-m", "pytest", *options, *TESTS], own, quiet=False)


def main() -> None:
    """Run from the shell."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--only", default=",".join(STEPS), help="steps, separated by commas")
    asked.add_argument("--extras", default="", help="extras that are tried, separated by commas; otherwise all")
    asked.add_argument("--keep", type=Path, help="folder for what is built, kept; otherwise a temporary one")
    given = asked.parse_args()
    with tempfile.TemporaryDirectory(prefix="flexura-release-") as temporary:
        folder = (given.keep or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        absent: list[str] = []
        try:
            print("sdist and wheel", flush=True)
            wheel = build(folder)
            if "clean" in given.only:
                print("clean environments, core dependencies alone", flush=True)
                absent = clean(wheel, folder)
            if "extras" in given.only:
                print("each extra alone", flush=True)
                extras(wheel, folder, set(given.extras.split(",")) - {""})
            if "lowest" in given.only:
                print("least versions", flush=True)
                lowest(wheel, folder)
        except RuntimeError as error:
            sys.exit(f"release check FAILED: {error}")
    said = f"; not tried, as they are not here: Python {', '.join(absent)}" if absent else ""
    print(f"release check passed{said}")


if __name__ == "__main__":
    main()
