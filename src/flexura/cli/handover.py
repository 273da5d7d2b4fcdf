"""The command that writes models for other programs."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from flexura.cli.options import (
    At,
    File,
    Inputs,
    Json,
    Outputs,
    Ratio,
    Settings,
    Strict,
    band_of,
    limit_of,
    print_json,
    quantity_of,
    read,
)
from flexura.cli.response import Hold
from flexura.errors import LimitError, OptionError


class What(StrEnum):
    """What is written."""

    state_space = "state-space"
    low = "low"
    full = "full"
    modes = "modes"
    response = "response"


DEFAULTS = {"simscape": What.low, "matrix-market": What.full, "vtu": What.modes, "uff": What.modes}
"""What a format gets when nothing is said; the others get a state space."""


def export_command(
    file: File,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Write this file, in the format of its suffix.")],
    format: Annotated[str | None, typer.Option(metavar="FORMAT", help="Format, where the suffix has none.")] = None,
    what: Annotated[
        What | None, typer.Option(help="State space, low- or full-order matrices, modes, response.")
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
    hold: Annotated[Hold, typer.Option(help="Inputs between steps.")] = Hold.zoh,
    delay: Annotated[str, typer.Option(metavar="TIME", help="Dead time of the inputs with its unit.")] = "0 s",
    band: Annotated[
        str | None,
        typer.Option(metavar="FROM,TO", help="Band of a response, or that a state space is for, e.g. '5,200 Hz'."),
    ] = None,
    damping: Ratio = None,
    keep: Annotated[
        int | None,
        typer.Option(min=0, help="Normal modes kept in each substructure of a low-order model, not to a tolerance."),
    ] = None,
    at: At = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Write a state space (full-order, static gain kept), matrices, modes or responses for other tools."""
    from flexura.io import export, format_of, scalar_notes

    own = what or DEFAULTS.get(format_of(out, format), What.state_space)
    mechanism, parameters = read(file, set, at)
    limit = limit_of("--up-to", up_to)
    thing: Any
    if own is What.state_space:
        how = {
            "residual_modes": residual_modes,
            "balanced": balanced,
            "band": None if band is None else band_of(band),
            "delay": quantity_of("--delay", delay, "s", "0.1ms"),
        }
        thing = _state_space(mechanism, parameters, (input, output), n, limit, damping, how)
        if dt is not None:
            thing = thing.discretised(quantity_of("--dt", dt, "s", "0.1ms"), hold.value)
    elif own is What.modes:
        from flexura.analysis import modes

        thing = modes(mechanism, parameters, n=n or 6)
    elif own is What.response:
        from flexura.analysis import frequency_response

        if band is None:
            raise OptionError("a response needs a --band FROM,TO, e.g. '5,200 Hz'")
        thing = frequency_response(
            mechanism, parameters, inputs=input, outputs=output, band=band_of(band), damping=damping
        )
    else:
        thing = _matrices(mechanism, parameters, own is What.full, keep, n, limit)
    warnings = getattr(thing, "warnings", ())
    if strict and warnings:
        raise LimitError(warnings)
    written = [str(path) for path in export(thing, out, format=format)]
    notes = list(getattr(thing, "notes", ()))
    if format_of(out, format) == "uff":
        notes += scalar_notes(thing)
    if as_json:
        lost = getattr(thing, "neglected", None)
        more = {} if lost is None else {"neglected": lost.to_dict()}
        print_json({"files": written, "notes": notes, "warnings": [w.to_dict() for w in warnings], **more})
    else:
        for line in (*notes, *(f"warning: {w}" for w in warnings), *(f"wrote {path}" for path in written)):
            typer.echo(line)


def _matrices(
    mechanism: Any, parameters: dict[str, float], is_full: bool, keep: int | None, n: int | None, up_to: float | None
) -> Any:
    """The full-order model, or the low-order one in the coordinates of its substructures."""
    from flexura.reduction import reduce, reduction_of
    from flexura.structure import assemble, plan_of

    if is_full:
        return assemble(mechanism, parameters)
    how = reduction_of(plan_of(mechanism), {"keep": keep}, n or 6, up_to)
    return reduce(mechanism, parameters, **({"coordinates": "substructures"} if "tolerance" in how else {}), **how)


def _state_space(
    mechanism: Any,
    parameters: dict[str, float],
    channels: tuple[list[str] | None, list[str] | None],
    n: int | None,
    up_to: float | None,
    damping: float | None,
    how: dict[str, Any],
) -> Any:
    from flexura.systems import state_space, system

    inputs, outputs = channels
    full = system(mechanism, parameters, inputs=inputs, outputs=outputs, order="full", damping=damping)
    count = 6 if n is None and up_to is None else n
    return state_space(full, n=count, up_to=up_to, **how)
