"""The command that writes one page about a mechanism."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flexura.cli.options import At, File, Json, Settings, Strict, prescribed_of, print_result, settings_of
from flexura.cli.tables import console_of_width
from flexura.tables import counted

if TYPE_CHECKING:
    from flexura.deadline import Progress
    from flexura.pages.report import Report


def report_command(
    file: File,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Write the page here, one HTML file.")] = Path(
        "report.html"
    ),
    n: Annotated[int, typer.Option("-n", min=1, max=100, help="Number of modes.")] = 6,
    solid: Annotated[
        bool, typer.Option("--solid", help="With solid finite elements beside the beams; seconds to minutes.")
    ] = False,
    title: Annotated[str | None, typer.Option(metavar="TEXT", help="Title; by default the name.")] = None,
    at: At = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """One page about a mechanism: modes that move, freedoms, stroke, responses, stress, with all evidence."""
    from flexura.modelfile import load
    from flexura.pages.report import report

    mechanism = load(file)
    parameters = settings_of(mechanism, set)
    pose = prescribed_of(mechanism, at or [])
    begun = time.monotonic()
    found = report(mechanism, parameters, file=file, at=pose, n=n, solid=solid, title=title, progress=_say)
    if strict:
        found.raise_warnings()
    path = found.write(out)
    if as_json:
        print_result(found.to_dict(), [path])
    else:
        print_report(found, path, time.monotonic() - begun)


def _say(step: Progress) -> None:
    sys.stderr.write(f"{step} ...\n")


def print_report(found: Report, path: Path, seconds: float) -> None:
    """Print what is in the page and what is not, and how long it took."""
    console = console_of_width()
    console.print(f"{found.name}: report", style="bold", markup=False)
    for state, words in (("shown", "in it"), ("absent", "not in it"), ("failed", "failed")):
        headings = [heading for heading, own in found.states.items() if own == state]
        if headings:
            console.print(f"{words}: {', '.join(headings)}", markup=False, style="red" if state == "failed" else "")
    longest = sorted(found.seconds.items(), key=lambda item: -item[1])[:3]
    if found.warnings:
        console.print(f"{counted(len(found.warnings), 'warning')}; see the page", markup=False)
    took = ", ".join(f"{name} {own:.1f} s" for name, own in longest)
    sys.stderr.write(f"{seconds:.1f} s, most of it: {took}\n")
    console.print(f"wrote {path}", markup=False)
