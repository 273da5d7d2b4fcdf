"""Where the release check tries things: what is built of a clean checkout, and environments of their own."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
SCRIPT = "src/flexura/pages/web/"
"""Source of the pages' script, of which the wheel has what is built alone."""
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
KERNELS = "flexura/kernels/kernels."
"""How what is compiled when a wheel is built begins."""
MOST = 3_000_000
"""Bytes that a wheel may have."""
CALLER = ("PYTHONPATH", "PYTHONHOME", "PYTHONDONTWRITEBYTECODE", "VIRTUAL_ENV")
"""Variables of whoever runs the check that would lead into another environment, or slow it."""
OPTIONAL = {"CalculiX": "GPL", "MKL": "not open source"}
"""What is not under a permissive licence, and the word that a notice of it has."""


def run(command: list[object], cwd: Path, **variables: object) -> str:
    """Run a command without the caller's paths; its output. Raises RuntimeError with it where the command fails."""
    env = {name: text for name, text in os.environ.items() if name not in CALLER}
    env |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MPLBACKEND": "agg", "COLUMNS": "150"}
    env |= {name: str(value) for name, value in variables.items()}
    words = [str(word) for word in command]
    done = subprocess.run(words, cwd=cwd, env=env, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(
            f"{shlex.join(words)} ended with {done.returncode}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
        )
    return done.stdout


def last_line(text: str) -> str:
    """The last line of an output."""
    return (text.strip().splitlines() or [""])[-1].strip()


def pythons() -> dict[str, Path]:
    """Pythons that are found, by their versions: on the search path, of pyenv, and the one that runs this."""
    folder = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    found: dict[str, Path] = {}
    for version in PYTHONS:
        own = [sys.executable] if version == "{}.{}".format(*sys.version_info) else []
        for place in (*own, shutil.which(f"python{version}"), *sorted(folder.glob(f"{version}.*/bin/python"))):
            said = "import sys, venv, ensurepip; print('%d.%d' % sys.version_info[:2])"
            if place is not None and version not in found:
                done = subprocess.run([place, "-c", said], capture_output=True, text=True, check=False)
                if done.returncode == 0 and done.stdout.strip() == version:
                    found[version] = Path(place)
    return found


@dataclass(frozen=True)
class Built:
    """A clean checkout, and the files to publish that were made of it."""

    source: Path
    sdist: Path
    wheel: Path


@dataclass(frozen=True)
class Place:
    """A folder with a virtual environment of its own, and copies of the examples and of small files of other kinds."""

    folder: Path
    python: Path
    built: Built

    @classmethod
    def new(cls, folder: Path, python: Path, built: Built) -> Place:
        """Made anew, with nothing installed."""
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "out").mkdir(parents=True)
        for own in ("examples", "tests/fuzz"):
            shutil.copytree(built.source / own, folder / own)
        return cls(folder, environment(python, folder / "environment"), built)

    def install(self, *what: object) -> None:
        """Install packages, by words of pip."""
        run([self.python, "-m", "pip", "install", "--quiet", *what], self.folder)

    def flexura(self, line: str) -> str:
        """Run flexura as from the shell."""
        return run([self.python.with_name("flexura"), *shlex.split(line)], self.folder)

    def execute(self, code: str) -> str:
        """Run Python, from a file, as processes that it starts read it again."""
        script = self.folder / "code.py"
        script.write_text(code, encoding="utf-8")
        return run([self.python, script], self.folder)

    def unpacked(self, *left_out: str) -> Path:
        """The sdist's files but some."""
        with tarfile.open(self.built.sdist) as archive:
            archive.extractall(self.folder, filter="data")
        own = self.folder / self.built.sdist.name.removesuffix(".tar.gz")
        for name in left_out:
            shutil.rmtree(own / name)
        return own


def environment(python: Path, folder: Path) -> Path:
    """A new virtual environment; its Python."""
    run([python, "-m", "venv", "--clear", folder], folder.parent)
    return folder / ("Scripts" if os.name == "nt" else "bin") / "python"


def commit() -> str:
    """The commit that is checked out. Raises RuntimeError where files that it has were changed since."""
    if changed := run(["git", "status", "--porcelain", "--untracked-files=no"], ROOT).strip():
        raise RuntimeError(f"a commit is checked, and these files differ from it:\n{changed}")
    return run(["git", "rev-parse", "HEAD"], ROOT).strip()


def build(folder: Path) -> Built:
    """Make the sdist and, from it, the wheel, of a clean checkout; look at what is inside."""
    source, dist = folder / "source", folder / "dist"
    for old in (source, dist):
        shutil.rmtree(old, ignore_errors=True)
    run(["git", "clone", "--quiet", ROOT, source], folder)
    python = environment(Path(sys.executable), folder / "build")
    run([python, "-m", "pip", "install", "--quiet", "build", "twine"], folder)
    run([python, "-m", "build", "--outdir", dist, source], folder)
    run([python, "-m", "twine", "check", "--strict", *dist.iterdir()], folder)
    shutil.rmtree(folder / "build")
    tracked = set(run(["git", "ls-files"], source).splitlines())
    return Built(source, look_at_sdist(dist, tracked), look_at_wheel(dist, tracked))


def built_before(folder: Path) -> Built:
    """What `build` has left in a folder."""
    (wheel,), (sdist,) = (folder / "dist").glob("*.whl"), (folder / "dist").glob("*.tar.gz")
    return Built(folder / "source", sdist, wheel)


def look_at_sdist(dist: Path, tracked: set[str]) -> Path:
    """The sdist. Raises RuntimeError where it has not what is tracked and nothing else, or a notice is missing."""
    (sdist,) = dist.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {own.name.partition("/")[2] for own in archive.getmembers() if own.isfile()}
    if other := (tracked | {"PKG-INFO"}) ^ names:
        raise RuntimeError(f"the sdist differs from what is tracked: {sorted(other)[:9]}")
    for name in ("README.md", "docs/releasing.md", "Dockerfile"):
        look_for_notices(name, (ROOT / name).read_text(encoding="utf-8"))
    print(f"    {sdist.name}: {sdist.stat().st_size / 1e6:.2f} MB, {len(names)} files", flush=True)
    return sdist


def look_at_wheel(dist: Path, tracked: set[str]) -> Path:
    """The wheel. Raises RuntimeError where it has other files than the package, is too large, or lacks a notice."""
    (wheel,) = dist.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        files = [name for name in archive.namelist() if not name.startswith(KERNELS)]
        packed = {name for name in files if ".dist-info/" not in name}
        about = {name.partition(".dist-info/")[2]: name for name in archive.namelist() if ".dist-info/" in name}
        look_for_notices("the wheel", archive.read(about["METADATA"]).decode())
    size = wheel.stat().st_size
    if size > MOST:
        raise RuntimeError(f"{wheel.name} has {size} bytes, more than {MOST}")
    inside = {name for name in tracked if name.startswith("src/flexura/")}
    shipped = {name for name in inside if not name.startswith(SCRIPT) or name.startswith(f"{SCRIPT}dist/")}
    if other := {name.removeprefix("src/") for name in shipped} ^ packed:
        raise RuntimeError(f"the wheel differs from src/flexura: {sorted(other)[:9]}")
    licences = {Path(name).name for name in about if name.startswith("licenses/")}
    if licences != {"LICENSE", "THIRD-PARTY.txt"}:
        raise RuntimeError(f"licences of the wheel: {sorted(licences)}")
    print(f"    {wheel.name}: {size / 1e6:.2f} MB, {len(packed)} files", flush=True)
    return wheel


def look_for_notices(name: str, text: str) -> None:
    """Raise RuntimeError where a text does not say what is optional and not under a permissive licence."""
    words = " ".join(re.sub(r"^[#\s]+", "", line) for line in text.splitlines())
    if silent := [own for own, licence in OPTIONAL.items() if own not in words or licence not in words]:
        raise RuntimeError(f"{name} does not say under what licence there is {silent}")
