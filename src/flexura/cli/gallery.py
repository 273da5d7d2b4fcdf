"""The commands `new` and `examples`, files to begin with, and `doctor`, which optional parts are there."""

from __future__ import annotations

import json
import platform
import re
import shutil
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

SCHEMA = "flexura.schema.json"
EDITORS = f"# yaml-language-server: $schema={SCHEMA}\n"
"""The line by which editors know what a file may hold."""


def new_command(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Of the gallery; without one all are listed.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The file to write, NAME.yaml where you are if left out.")
    ] = None,
    schema: Annotated[
        bool, typer.Option("--schema", help=f"With {SCHEMA} beside it, and the line by which editors complete keys.")
    ] = False,
) -> None:
    """Write a file of a mechanism to change into your own, or list those that there are."""
    from flexura.gallery import entry

    if name is None:
        _list("flexura new NAME writes one of these")
        return
    own = entry(name)
    path = out or Path(f"{own.name}.yaml")
    texts = {path.name: (EDITORS if schema else "") + own.text}
    if schema:
        from flexura.modelfile import schema as of_files

        texts[SCHEMA] = json.dumps(of_files(), indent=1) + "\n"
    _write(path.parent, texts, again=SCHEMA)
    typer.echo(f"wrote {path}; next: flexura check {path}")


def examples_command(
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Write all of them into this folder.")] = None,
) -> None:
    """List the mechanisms of the gallery, or write all of their files."""
    from flexura.gallery import entries

    if out is None:
        _list("flexura new NAME writes one of these, flexura examples --out DIR all")
        return
    texts = {own.path.name: own.text for own in entries()}
    _write(out, texts)
    typer.echo(f"wrote {len(texts)} files in {out}")


def _write(folder: Path, texts: dict[str, str], again: str = "") -> None:
    """Write files by name, all or none, where there are none yet; one of the name `again` may be replaced."""
    from flexura.errors import OptionError
    from flexura.files import complete_files

    there = next((name for name in texts if name != again and (folder / name).exists()), None)
    if there is not None:
        raise OptionError(f"{folder / there} is there already, and nothing is overwritten; --out names another place")
    with complete_files(folder, make=True) as scratch:
        for name, text in texts.items():
            (scratch / name).write_text(text, encoding="utf-8")


def _list(hint: str) -> None:
    """Print names and what they are."""
    from rich.table import Table

    from flexura.cli.terminal import console_of_width
    from flexura.gallery import entries

    table = Table(box=None, pad_edge=False, show_header=False)
    for own in entries():
        table.add_row(own.name, own.line)
    console = console_of_width()
    console.print(table)
    console.print(hint, markup=False)


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
    "solid": "meshes of solids by netgen and NGSolve, and a quicker sparse solver",
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
    from flexura.cli.terminal import console_of_width
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
    from flexura.kernels import is_compiled

    for extra, purpose in EXTRAS.items():
        found = {name: _version(name) for name in packages_of(extra)}
        lacking = [name for name, version in found.items() if version is None]
        told = ", ".join(f"{name} {version}" for name, version in found.items() if version is not None)
        said = f"pip install 'flexura[{extra}]'" if lacking else told
        yield Part(extra, bool(found) and not lacking, purpose, said)
    how = "NumPy does the same, more slowly; python -m flexura.kernels.build, with a C compiler, makes them"
    yield Part("kernels", is_compiled(), "small steps of arithmetic in C", "compiled" if is_compiled() else how)
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
