"""The commands `modes`, `buckling`, `compare` and `published`: natural frequencies, and what to hold them against."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.console import RenderableType
from rich.text import Text

from flexura.cli.amounts import CommandReader, gravity_of, limit_of, loads_of, names_of, time_of
from flexura.cli.options import Answer, Commands, Gravity, Loads, Order, command
from flexura.cli.terminal import grid, heading
from flexura.errors import OptionError
from flexura.tables import ends, number, quantity, scale_for, text_columns

if TYPE_CHECKING:
    from flexura.analysis import Evidence, Modes
    from flexura.mechanism import Mechanism
    from flexura.methods import Comparison, ComparisonRow

MOST_MISSED = 12
"""Missed modes that are listed."""

BLOCK = 8
"""So many modes side by side."""


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
    return Answer(result, modes_text(result), "save_modes")


def modes_text(result: Modes) -> Iterator[RenderableType]:
    """Frequencies of both models, what moves, and the evidence."""
    full_only = result.evidence.low_residual is None
    beside = any(mode.full_frequency_hz is not None for mode in result.modes) and not full_only
    meshed = any(mode.mesh_error is not None for mode in result.modes)
    title = f"{result.name}: {'full model' if full_only else 'low-order model'}, order {result.order}"
    yield heading(title + ("" if full_only else f" (full model {result.full_order})"))
    hertz = {"frequency [Hz]": [mode.frequency_cell for mode in result.modes]}
    if beside:
        full = [mode.full_frequency_hz for mode in result.modes]
        hertz["full [Hz]"] = ["none" if hz is None else hz for hz in full]
    (name, frequencies), *others = text_columns(hertz).items()
    columns: dict[str, list[Any]] = {
        "mode": [mode.number for mode in result.modes],
        name: frequencies,
        "rad/s": [number(mode.angular_frequency) for mode in result.modes],
    }
    for name, cells in others:
        columns |= {name: cells, "difference": [mode.difference_text for mode in result.modes]}
    columns["proven"] = [mode.proven_text for mode in result.modes]
    columns["model error"] = [*result.model_errors.texts]
    if meshed:
        errors = [mode.mesh_error for mode in result.modes]
        columns["meshes"] = ["" if error is None else f"within {100 * error:.2g} %" for error in errors]
    table = grid(*columns, left=0)
    table.add_column("what moves", overflow="fold")
    for cells in zip(*columns.values(), (mode.motion.summary for mode in result.modes), strict=True):
        table.add_row(*map(str, cells))
    yield table
    yield from _evidence(result.evidence)


def _evidence(evidence: Evidence) -> Iterator[RenderableType]:
    yield heading("evidence")
    yield from (f"  {line}" for line in evidence.lines)
    if evidence.complete:
        yield Text("  no mode is missing in this range", style="green")
        return
    if not evidence.is_counted:
        yield Text("  round-off hides whether a mode is missing in this range", style="red")
        return
    count = len(evidence.missed) + evidence.more_missed
    modes = "mode in this range is" if count == 1 else "modes in this range are"
    yield Text(f"  {count} {modes} MISSING from the low-order model:", style="red")
    for missed in evidence.missed[:MOST_MISSED]:
        yield f"    {quantity(missed.frequency_hz, 'Hz')}: {missed.summary}"
    if count > MOST_MISSED:
        yield f"    and {count - MOST_MISSED} more"
    yield "  keep fixed-interface normal modes to see them: --tolerance 1e-3 --up-to 'F Hz', or --keep 2"


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
    data = result.to_dict(n)
    return Answer(result, buckling_text(data), "save_preload", data=lambda: data)


def buckling_text(data: dict[str, Any]) -> Iterator[RenderableType]:
    """Frequencies with and without load, buckling factors, and the members that carry most."""
    from flexura.linalg import ranked
    from flexura.reduction import proven_text

    states = [state for state in (data["loaded"], data["unloaded"]) if state is not None]  # none beyond buckling
    table = grid("mode", *("Hz", "proven", "unloaded Hz", "proven")[-2 * len(states) :], left=0)
    for k in range(min(len(state["frequency_hz"]) for state in states)):
        cells = []
        for state in states:
            hz, lower, upper = state["frequency_hz"][k], state["lower_hz"][k], state["upper_hz"][k]
            cells += [number(hz), proven_text(hz, (lower, upper), state["is_indexed"][k], upper == 0)]
        table.add_row(str(k + 1), *cells)
    yield table
    factors = ", ".join(number(f) for f in data["buckling_factors"]) or "none: no load of this direction buckles it"
    yield f"buckling factors on all loads: {factors}"
    forces = list(data["axial_force"].items())
    for i in ranked([max(abs(f) for f in interval) for _, interval in forces])[:10]:
        name, (least, most) = forces[i]
        yield f"axial force in {name}: {ends((least, most), 'N')}"


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
    return Answer(done, () if done is None else comparison_text(done), is_interrupted=interrupted)


def comparison_text(result: Comparison) -> Iterator[RenderableType]:
    """One row a method: order, the frequency of every mode compared, worst error, time; then the notes."""
    against = f"errors against {result.reference}" if result.reference else "nothing to hold them against"
    scale = scale_for([hz for row in result.rows for hz in row.frequency_hz], "Hz")
    yield heading(f"{result.name}: frequencies in {scale.unit}, {against}")
    rows = [row for row in result.rows if not row.failure]
    # the highest mode compared that any row has, or has missed
    seen = [k for row in result.rows for k in (*row.counterpart, *row.missed) if k is not None and k <= result.n]
    count = max(seen, default=0)
    for first in range(0, count, BLOCK):
        modes = range(first, min(first + BLOCK, count))
        table = grid("method", *(["order"] if first == 0 else []), *(f"mode {k + 1}" for k in modes))
        is_last = first + BLOCK >= count
        for name in ("worst error", "time") if is_last else ():
            table.add_column(name, justify="right")
        for column in table.columns[1:]:
            column.no_wrap = True
        for row in rows:
            hz = dict(zip(row.counterpart, row.frequency_hz, strict=True))
            cells = [("" if row.order is None else str(row.order))] if first == 0 else []
            cells += [number(hz[k + 1] / scale.size) if k + 1 in hz else "-" for k in modes]
            if is_last:
                worst = "-" if row.worst_error is None else f"{100 * row.worst_error:+.2g} %"
                cells += ["" if row.method == result.reference else worst, quantity(row.seconds, "s", 3)]
            table.add_row(row.method, *cells)
        yield table
    for row in result.rows:
        yield from (f"{row.method}: {text}" for text in _remarks(row, count))


def _remarks(row: ComparisonRow, count: int) -> Iterable[str]:
    """What a row cannot show in its columns."""
    if row.failure:
        yield row.failure
        return
    if row.note:
        yield row.note
    if row.missed:
        yield f"has no mode {', '.join(map(str, row.missed))}"
    pairs = zip(row.frequency_hz, row.counterpart, strict=True)
    if strange := [quantity(f, "Hz") for f, k in pairs if k is None or k > count]:
        yield f"has {', '.join(strange)} beside the modes compared"


@command("strict", out="Write the table: .csv or .parquet.")
def published_command(mechanism: Mechanism, parameters: dict[str, float]) -> Answer:
    """What a mechanism has beside the numbers that papers, handbooks and closed forms give for it."""
    from flexura.study.published import published

    result = published(mechanism, parameters)
    table = grid(left=0)
    for name in result.cells:
        table.add_column(name, justify="left" if name in ("quantity", "source") else "right")
    for row in zip(*result.cells.values(), strict=True):
        table.add_row(*row)
    return Answer(result, [heading(result.name), table])
