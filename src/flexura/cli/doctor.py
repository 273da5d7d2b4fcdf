"""The command `doctor`: which optional parts are there."""

from __future__ import annotations

import platform
import re
import shutil
import sys
from collections.abc import Iterator
from importlib import metadata
from typing import NamedTuple

import typer

EXTRAS = {
    "ansys": "matrices and meshes of Ansys",
    "cluster": "studies on a dask cluster",
    "control": "systems of python-control",
    "experiment": "measured data in UFF and HDF5",
    "export": "models for MATLAB, HDF5, ParaView and UFF",
    "fmi": "FMUs run as a check",
    "live": "the live page: flexura live",
    "notebook": "three dimensions in notebooks",
    "pandas": "to_frame of results",
    "parquet": "tables as Parquet files",
    "solid": "meshes of solids by gmsh, and a quicker sparse solver",
    "study": "studies kept in folders, and Pareto fronts",
}
"""What flexura can be installed with beside what it always needs, and what each is for."""

PROGRAMS = {
    "cc": ("FMUs", "a C compiler; on Debian: apt-get install gcc libc6-dev"),
    "ccx": ("solids solved by CalculiX, a second solver", "on Debian: apt-get install calculix-ccx"),
}
"""Programs of the system: what they are for, and how they are had."""


class Part(NamedTuple):
    """Something that flexura can use: whether it is there, what it is for, and what stands there or is to be done."""

    name: str
    is_there: bool
    purpose: str
    said: str


def doctor_command() -> None:
    """List which optional parts are installed, what they are for, and how to get the others."""
    from rich.table import Table
    from rich.text import Text

    from flexura import __version__
    from flexura.cli.tables import console_of_width
    from flexura.tables import counted

    console = console_of_width()
    python = f"Python {platform.python_version()}, {platform.system()} {platform.machine()}"
    console.print(f"flexura {__version__}, {python}: {sys.prefix}", markup=False, highlight=False)
    table = Table(box=None, pad_edge=False, show_header=False)
    missing = 0
    for part in parts():
        missing += not part.is_there
        table.add_row(part.name, "yes" if part.is_there else "no", part.purpose, Text(part.said))
    console.print(table)
    typer.echo(f"{counted(missing, 'optional part')} missing; all else works" if missing else "everything is there")


def parts() -> Iterator[Part]:
    """All optional parts: extras of the installation, and programs."""
    for extra, purpose in EXTRAS.items():
        found = {name: _version(name) for name in packages_of(extra)}
        lacking = [name for name, version in found.items() if version is None]
        told = ", ".join(f"{name} {version}" for name, version in found.items() if version is not None)
        said = f"pip install 'flexura[{extra}]'" if lacking else told
        yield Part(extra, bool(found) and not lacking, purpose, said)
    for program, (purpose, how) in PROGRAMS.items():
        path = shutil.which(program)
        yield Part(program, path is not None, purpose, path or how)


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def packages_of(extra: str) -> list[str]:
    """Packages that an extra installs on this system, as the installation says."""
    listed = metadata.requires("flexura") or []
    own = (line.partition(";") for line in listed)
    chosen = [(name, marker) for name, _, marker in own if re.search(rf"extra\s*==\s*['\"]{extra}['\"]", marker)]
    return [re.split(r"[\s<>=!~\[(]", name.strip())[0] for name, marker in chosen if _holds(marker)]


def _holds(marker: str) -> bool:
    """Whether what a requirement says of the system, beside the extra, is so here."""
    here = {"platform_system": platform.system(), "platform_machine": platform.machine()}
    return all(here[key] == value for key, value in re.findall(r"(platform_\w+)\s*==\s*['\"]([^'\"]*)['\"]", marker))
