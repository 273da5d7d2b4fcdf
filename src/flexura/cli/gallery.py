"""The commands `new` and `examples`: files to begin with."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

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

    from flexura.cli.tables import console_of_width
    from flexura.gallery import entries

    table = Table(box=None, pad_edge=False, show_header=False)
    for own in entries():
        table.add_row(own.name, own.line)
    console = console_of_width()
    console.print(table)
    console.print(hint, markup=False)
