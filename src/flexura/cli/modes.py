"""The commands `modes`, `buckling`, `compare` and `published`: natural frequencies, and what to hold them against."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from flexura.cli.amounts import CommandReader, gravity_of, limit_of, loads_of, names_of, time_of
from flexura.cli.options import Answer, Commands, Gravity, Loads, Order, command
from flexura.errors import OptionError

if TYPE_CHECKING:
    from flexura.mechanism import Mechanism


@command("at", "plot", "animate", "magnify", "names", "dpi", "strict", plot="Write pictures of the modes here.")
def modes_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    n: Annotated[int, typer.Option("-n", min=1, max=1000, help="Number of modes.")] = 6,
    order: Annotated[Order, typer.Option(help="Low-order beside full, or the full model alone.")] = "low",
    keep: Annotated[
        int | None,
        typer.Option(min=0, help="Normal modes kept in each substructure; 0: constraint modes alone, as in the paper."),
    ] = None,
    keep_below: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="Keep all normal modes below this frequency, e.g. '3 kHz'.")
    ] = None,
    reduction: Annotated[
        Literal["craig_bampton", "rubin"] | None,
        typer.Option(help="Kept modes: fixed-interface, or free-interface with residual flexibility."),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(metavar="REL", help="Find the smallest model proven to this relative error. By default 1e-3."),
    ] = None,
    up_to: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="All modes up to this frequency, whatever -n is.")
    ] = None,
) -> Answer:
    """Natural frequencies and mode shapes, low-order and full-order side by side, with evidence."""
    from flexura.analysis import modes

    reduced = {
        "keep": keep,
        "keep_below": limit_of("--keep-below", keep_below),
        "reduction": reduction,
        "tolerance": tolerance,
        "up_to": limit_of("--up-to", up_to),
    }
    if order == "full" and any(value is not None for value in reduced.values()):
        raise OptionError(
            "full order is not reduced: --keep, --keep-below, --reduction, --tolerance, --up-to belong to --order low"
        )
    result = modes(mechanism, parameters, n=n, order=order, **reduced)
    return Answer(result, pictures="save_modes")


@command("plot", "dpi", "strict")
def buckling_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    gravity: Gravity = None,
    load: Loads = None,
    actuator: Commands = None,
    n: Annotated[int, typer.Option("-n", min=1, max=100, help="Number of frequencies and buckling factors.")] = 6,
) -> Answer:
    """Axial forces, frequencies about the state under gravity and dead loads, and the load at which it buckles."""
    from flexura.analysis import preload

    result = preload(
        mechanism,
        parameters,
        gravity=gravity_of(gravity),
        loads=loads_of(load),
        actuators=CommandReader(mechanism, parameters).values("--actuator", actuator),
    )
    return Answer(result, result.presentation(n), "save_preload", data=lambda: result.to_dict(n))


@command()
def compare_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    n: Annotated[int, typer.Option("-n", min=1, max=1000, help="Number of modes.")] = 6,
    methods: Annotated[
        str | None, typer.Option(metavar="A,B", help="Only these methods, beside the exact dynamic stiffness.")
    ] = None,
    budget: Annotated[
        str, typer.Option(metavar="TIME", help="Time that every method is given, e.g. 10 s or 5 min; none: no end.")
    ] = "60 s",
) -> Answer:
    """Natural frequencies by every method, with their errors against the exact ones and their times."""
    from flexura.cli.progress import steps_shown
    from flexura.methods import progressively

    names = names_of(methods)
    limit = None if budget == "none" else time_of("--budget", budget, "10 s or 5 min")
    done, interrupted = None, False
    try:
        with steps_shown() as show:
            for so_far in progressively(mechanism, parameters, n=n, methods=names, budget=limit, progress=show):
                done = so_far
    except KeyboardInterrupt:
        interrupted = True
        done = None if done is None else done.ended(names, "interrupted before it was done")
    return Answer(done, is_interrupted=interrupted)


@command("strict", out="Write the table: .csv or .parquet.")
def published_command(mechanism: Mechanism, parameters: dict[str, float]) -> Answer:
    """What a mechanism has beside the numbers that papers, handbooks and closed forms give for it."""
    from flexura.study.published import published

    return Answer(published(mechanism, parameters))
