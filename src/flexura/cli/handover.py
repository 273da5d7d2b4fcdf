"""Commands that hand a model on: `export` to other programs, `report` as a page, `live` as one with sliders."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from flexura.cli.amounts import band_of, limit_of, prescribed_of, quantity_of
from flexura.cli.options import (
    Answer,
    At,
    Channels,
    File,
    Hold,
    Inputs,
    Json,
    Loop,
    Outputs,
    Ratio,
    Repeated,
    Settings,
    Strict,
    command,
    print_json,
    read,
    say,
    settings_of,
)
from flexura.errors import LimitError, OptionError

if TYPE_CHECKING:
    pass

What = Literal["state-space", "low", "full", "modes", "response", "observer", "shaper", "controller"]

KINDS: dict[str, What] = {
    "state space": "state-space",
    "low-order model": "low",
    "full-order model": "full",
    "modes": "modes",
    "frequency response": "response",
    "observer": "observer",
    "shaper": "shaper",
}
"""What a format takes, in the words of the shell; without a word it gets the first that it takes."""


FMUS = ("fmu", "fmi3")
"""Formats of models that keep their parameters."""

OTHERWISE = {"payloads": "payload"}
"""Options of the shell whose names in Python differ by more than their hyphens."""


def export_command(
    file: File,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Write this file, in the format of its suffix.")],
    format: Annotated[str | None, typer.Option(metavar="FORMAT", help="Format, where the suffix has none.")] = None,
    what: Annotated[
        What | None,
        typer.Option(help="State space, matrices, modes, response, Kalman observer, input shaper, controller."),
    ] = None,
    controller: Annotated[
        str | None, typer.Option(metavar="NAME", help="The controller that is written, of several.")
    ] = None,
    input: Inputs = None,
    output: Outputs = None,
    n: Annotated[int | None, typer.Option("-n", min=1, help="Modes that are kept (6).")] = None,
    up_to: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="Keep modes up to this frequency instead.")
    ] = None,
    residual_modes: Annotated[
        bool, typer.Option("--residual-modes", help="Add a mode for each input, of the static part of those left out.")
    ] = False,
    balanced: Annotated[int | None, typer.Option(min=1, help="Then truncate to so many balanced states.")] = None,
    dt: Annotated[
        str | None, typer.Option(metavar="STEP", help="Discretise in steps with their unit, e.g. 0.1ms.")
    ] = None,
    hold: Annotated[Hold, typer.Option(help="Inputs between steps.")] = "zoh",
    delay: Annotated[str, typer.Option(metavar="TIME", help="Dead time of the inputs with its unit.")] = "0 s",
    band: Annotated[
        str | None,
        typer.Option(metavar="FROM,TO", help="Band of a response, or that a state space is for, e.g. '5,200 Hz'."),
    ] = None,
    damping: Ratio = None,
    source: Annotated[
        list[str] | None,
        typer.Option("--source", metavar="NAME", help="Disturbance of an observer (* allowed). May be repeated."),
    ] = None,
    kind: Annotated[Literal["ZV", "ZVD", "EI"], typer.Option(help="Of shaper.")] = "ZV",
    mode: Annotated[
        list[int] | None, typer.Option("--mode", min=1, help="Mode that is shaped (1). May be repeated.")
    ] = None,
    vibration: Annotated[
        float, typer.Option(metavar="RATIO", help="Share that an EI shaper leaves at its frequency.")
    ] = 0.05,
    loop: Loop = "open",
    keep: Annotated[
        int | None,
        typer.Option(min=0, help="Normal modes kept in each substructure of a low-order model, not to a tolerance."),
    ] = None,
    payload: Annotated[
        list[str] | None, typer.Option(metavar="NODE", help="An FMU can be given a mass at this node; repeatable.")
    ] = None,
    platform: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Build an FMU's library for this platform, e.g. x86_64-windows; repeatable."),
    ] = None,
    at: At = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Write a state space (full-order, static gain kept), matrices, modes or responses for other tools."""
    from flexura.io import export, format_of, formats, scalar_notes
    from flexura.systems import single_precision

    wanted = what or KINDS[formats()[format_of(out, format)].takes[0]]
    mechanism, parameters = read(file, set, at)
    limit, span = limit_of("--up-to", up_to), band_of(band)
    refuse_misplaced(payload, controller, wanted, format_of(out, format))
    thing: Any
    if wanted == "state-space":
        ends = {"inputs": input, "outputs": output, "damping": damping}
        lag = quantity_of("--delay", delay, "s", "0.1ms")
        kept = {"n": n, "up_to": limit, "residual_modes": residual_modes, "balanced": balanced, "band": span}
        kept["payloads"] = payload or ()
        thing = state_space_of(mechanism, parameters, loop, ends, {**kept, "delay": lag})
        if dt is not None:
            thing = thing.discretised(quantity_of("--dt", dt, "s", "0.1ms"), hold)
    elif wanted in ("observer", "shaper", "controller"):
        ends = {"inputs": input, "outputs": output, "sources": source, "n": n, "up_to": limit, "delay": delay}
        shape = {"kind": kind, "modes": mode or (1,), "vibration": vibration}
        about = {"observer": {**ends, "damping": damping}, "shaper": {**shape, "damping": damping}}
        about["controller"] = {"controller": controller}
        thing = sampled(mechanism, parameters, wanted, dt, about[wanted])
    elif wanted == "modes":
        from flexura.analysis import modes

        thing = modes(mechanism, parameters, n=n or 6)
    elif wanted == "response":
        from flexura.analysis import frequency_response

        if span is None:
            raise OptionError("a response needs a --band FROM,TO, e.g. '5,200 Hz'")
        thing = frequency_response(
            mechanism, parameters, inputs=input, outputs=output, band=span, damping=damping, loop=loop
        )
    elif wanted == "full":
        from flexura.full_order import assemble

        thing = assemble(mechanism, parameters)
    else:
        thing = low_order(mechanism, parameters, keep, n, limit)
    told = thing
    if format_of(out, format) == "c" and wanted in ("state-space", "observer", "controller"):
        told = single_precision(thing.estimator if wanted == "observer" else thing)
    if strict and getattr(told, "warnings", ()):
        raise LimitError(told.warnings)
    written = [str(path) for path in export(thing, out, format=format, platforms=platform or None)]
    more = scalar_notes(thing) if format_of(out, format) == "uff" else ()
    print_written(told, written, more, as_json)


def refuse_misplaced(payload: list[str] | None, controller: str | None, wanted: What, format: str) -> None:
    """Raise OptionError for options of what is not written."""
    if payload and (wanted != "state-space" or format not in FMUS):
        raise OptionError("--payload belongs to FMUs, of which it is a parameter")
    if controller is not None and wanted != "controller":
        raise OptionError("--controller names what --what controller writes")


def print_written(told: Any, written: list[str], more: Iterable[str], as_json: bool) -> None:
    """Print the notes and warnings of what was written, and where it is."""
    notes, warnings = [*getattr(told, "notes", ()), *more], getattr(told, "warnings", ())
    if as_json:
        lost = getattr(told, "neglected", None)
        bound = {} if lost is None else {"neglected": lost.to_dict()}
        print_json({"files": written, "notes": notes, "warnings": [w.to_dict() for w in warnings], **bound})
    else:
        for line in (*notes, *(f"warning: {w}" for w in warnings), *(f"wrote {path}" for path in written)):
            typer.echo(line)


def state_space_of(
    mechanism: Any, parameters: dict[str, float], loop: str, ends: dict[str, Any], kept: dict[str, Any]
) -> Any:
    """The state space of a mechanism, or of its closed loops, of which only the number of modes is chosen. Raises
    OptionError for anything else."""
    from flexura.analysis import closed_model
    from flexura.systems import state_space, system

    if loop == "closed":
        other = next((name for name, value in kept.items() if value and name != "n"), None)
        if other is not None:
            raise OptionError(f"--{OTHERWISE.get(other, other.replace('_', '-'))} belongs to open loops")
        damping, n = ends["damping"], kept["n"]
        return closed_model(mechanism, parameters, ends["inputs"], ends["outputs"], damping=damping, n=n)
    if kept["n"] is None and kept["up_to"] is None:
        kept["n"] = 6
    return state_space(system(mechanism, parameters, order="full", **ends), **kept)


def sampled(mechanism: Any, parameters: dict[str, float], wanted: What, dt: str | None, about: dict[str, Any]) -> Any:
    """An observer or an input shaper in steps, or a controller, which may have its own. Raises OptionError without."""
    from flexura.analysis import controller_model, observer, shaper

    if wanted == "controller":
        own = None if dt is None else quantity_of("--dt", dt, "s", "0.1ms")
        return controller_model(mechanism, parameters, dt=own, **about)
    if dt is None:
        raise OptionError(f"--what {wanted} goes in steps: --dt 0.1ms")
    step = quantity_of("--dt", dt, "s", "0.1ms")
    if wanted == "shaper":
        return shaper(mechanism, parameters, dt=step, **about)
    return observer(
        mechanism, parameters, dt=step, **{**about, "delay": quantity_of("--delay", about["delay"], "s", "")}
    )


def low_order(
    mechanism: Any, parameters: dict[str, float], keep: int | None, n: int | None, up_to: float | None
) -> Any:
    """The low-order model in the coordinates of its substructures."""
    from flexura.full_order import plan_of
    from flexura.reduction import reduce, reduction_of

    chosen = reduction_of(plan_of(mechanism), {"keep": keep}, n or 6, up_to)
    coordinates = {"coordinates": "substructures"} if "tolerance" in chosen else {}
    return reduce(mechanism, parameters, **coordinates, **chosen)


@command("strict", reads=False)
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
) -> Answer:
    """One page about a mechanism: modes that move, freedoms, stroke, responses, stress, with all evidence."""
    from flexura.modelfile import load
    from flexura.pages.report import report

    mechanism = load(file)
    parameters = settings_of(mechanism, set)
    pose = prescribed_of(mechanism, at or [])
    begun = time.monotonic()
    page = report(mechanism, parameters, file=file, at=pose, n=n, solid=solid, title=title, progress=say)
    longest = sorted(page.seconds.items(), key=lambda item: -item[1])[:3]
    took = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in longest)
    say(f"{time.monotonic() - begun:.1f} s, most of it: {took}")
    return Answer(page, write=lambda: [page.write(out)], are_warnings_shown=True)


def live_command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Mechanism file (YAML), or measured data (UFF, ...).")],
    port: Annotated[
        int | None, typer.Option(min=1, max=65535, help="Port to listen at: the first from 8650 that is free.")
    ] = None,
    browser: Annotated[bool, typer.Option(help="Open the page in a browser.")] = True,
    keep: Annotated[bool, typer.Option("--keep", help="Do not end when the last page is closed.")] = False,
    n: Annotated[int | None, typer.Option("-n", min=1, max=30, help="Number of modes of a mechanism: 6.")] = None,
    channels: Channels = None,
    repeated: Repeated = None,
) -> None:
    """A page on this machine: a mechanism whose parameters are sliders, or a test whose modes are picked."""
    from flexura.pages.live import live

    live(file, port=port, browser=browser, keep=keep, n=n, channels=channels, repeated=repeated)
