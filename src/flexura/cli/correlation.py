"""Commands that hold a test against a model, and that say where to put sensors."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from flexura.cli.options import (
    Channels,
    File,
    Json,
    Plot,
    Repeated,
    Settings,
    band_of,
    print_result,
    quantity_of,
    read,
    selected,
)
from flexura.cli.tables import console_of_width

if TYPE_CHECKING:
    from flexura.testing.correlation import Correlation, ModePair
    from flexura.testing.virtual import SensorPlacement

MOST_CHANNELS = 40
"""Channels that are listed."""


class ReducedMass(StrEnum):
    """How the mass matrix is reduced to the sensors."""

    serep = "serep"
    guyan = "guyan"


def correlate_command(
    file: File,
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Measured data (UFF, CSV, npz, HDF5).")],
    n: Annotated[int | None, typer.Option("-n", min=1, max=200, help="Modes of the model that are compared.")] = None,
    within: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Farthest a sensor may be from the model, e.g. '2 mm'.")
    ] = None,
    close: Annotated[
        float, typer.Option(min=0.0, max=0.5, help="Modes nearer than this, relative, are compared as a space.")
    ] = 0.02,
    reduced_mass: Annotated[
        ReducedMass, typer.Option(help="Mass matrix over the sensors: by the modes, or static.")
    ] = ReducedMass.serep,
    band: Annotated[
        str | None, typer.Option(metavar="FROM,TO", help="Identify modes in this band, e.g. '5,200 Hz'.")
    ] = None,
    select: Annotated[
        str | None,
        typer.Option(metavar="F1,F2", help="Identify the modes nearest to these frequencies, e.g. '12,40 Hz'."),
    ] = None,
    channels: Channels = None,
    repeated: Repeated = None,
    plot: Plot = None,
    set: Settings = None,
    as_json: Json = False,
) -> None:
    """Test against model: pairs of modes with MAC and frequency error, channels that disagree, FRFs, pictures."""
    from flexura.io import read_measurement
    from flexura.testing.correlation import correlate, identified_modes

    mechanism, parameters = read(file, set)
    measurement = read_measurement(data, channels=channels, repeated=None if repeated is None else repeated.value)
    identified = identified_modes(
        measurement,
        band=None if band is None else band_of(band),
        select=selected(select),
    )
    result = correlate(
        mechanism,
        test=identified,
        measurement=measurement,
        parameters=parameters,
        n=n,
        within=None if within is None else quantity_of("--within", within, "m", "'2 mm'"),
        close=close,
        reduced_mass=reduced_mass.value,
    )
    written: list[Path] = []
    if plot is not None:
        from flexura.view import save_correlation

        written = save_correlation(result, plot)
    if as_json:
        print_result(result.to_dict(), written)
    else:
        print_correlation(result, written)


def place_sensors_command(
    file: File,
    sensors: Annotated[int, typer.Option(min=1, help="Number of sensors.")],
    n: Annotated[int, typer.Option("-n", min=1, max=200, help="Modes that they have to distinguish.")] = 6,
    candidate: Annotated[
        list[str] | None,
        typer.Option("--candidate", metavar="NAME", help="Sensor or DOF, e.g. 'platform.t*'. May be repeated."),
    ] = None,
    plot: Plot = None,
    set: Settings = None,
    as_json: Json = False,
) -> None:
    """The best places for so many sensors among the candidates, by effective independence."""
    from flexura.testing.virtual import place_sensors

    mechanism, parameters = read(file, set)
    result = place_sensors(mechanism, sensors=sensors, n=n, candidates=candidate, parameters=parameters)
    written: list[Path] = []
    if plot is not None:
        from flexura.view import draw_sensors, save_figures

        written = save_figures({"sensors.png": draw_sensors(result)}, plot)
    if as_json:
        print_result(result.to_dict(), written)
    else:
        print_placement(result, written)


def print_correlation(result: Correlation, written: list[Path]) -> None:
    """Print pairs of modes, what has no counterpart, channels, responses and notes."""
    console = console_of_width()
    title = f"{result.test_name} against {result.name}: {len(result.pairs)} of {len(result.test_hz)} test modes paired"
    console.print(title, style="bold", markup=False)
    table = _table("test", "Hz", "damping", "model", "Hz", "difference", "MAC", "in space", "not represented")
    for pair in result.pairs:
        table.add_row(*_cells(pair))
    console.print(table)
    if result.unpaired_test:
        found = ", ".join(f"{k} ({result.test_hz[k - 1]:.5g} Hz)" for k in result.unpaired_test)
        console.print(f"test modes without a counterpart: {found}", style="red", markup=False)
    if result.unpaired_model:
        found = ", ".join(f"{k} ({result.model_hz[k - 1]:.5g} Hz)" for k in result.unpaired_model)
        console.print(f"modes of the model that the test has not: {found}", style="red", markup=False)
    if len(result.pairs) > 1:
        for name, values in (("test", result.self_orthogonality), ("test and model", result.cross_orthogonality)):
            off = float((values - np_diagonal(values)).max())
            kind = f"orthogonality of {name}, mass reduced by {result.reduced_mass}"
            console.print(f"{kind}: at most {off:.2f} off the diagonal", markup=False)
    _print_channels(console, result)
    for overlay in result.frfs:
        own = overlay.frac
        setup = f" ({overlay.measured.setup})" if overlay.measured.setup else ""
        text = f"FRAC of {own.size} responses{setup}: {own.min():.2f} to {own.max():.2f}, damping {overlay.damping}"
        console.print(text, markup=False)
    for note in result.notes:
        console.print(note, markup=False)
    for path in written:
        console.print(f"wrote {path}", markup=False)


def np_diagonal(values: Any) -> Any:
    """The diagonal alone."""
    import numpy as np

    return np.diag(np.diagonal(values))


def _cells(pair: ModePair) -> list[str]:
    space = "" if len(pair.model_space) == len(pair.test_space) == 1 else f"{pair.space_mac:.3f}"
    return [
        str(pair.test),
        f"{pair.test_hz:.5g}",
        f"{100 * pair.damping_ratio:.2g} %",
        str(pair.model),
        f"{pair.model_hz:.5g}",
        f"{100 * pair.error:+.2f} %",
        f"{pair.mac:.3f}",
        space,
        f"{100 * pair.expansion_error:.2g} %",
    ]


def _print_channels(console: Console, result: Correlation) -> None:
    """Where channels sit in the model, and which disagree."""
    table = _table("channel", "reads", "found by", "mm away", "CoMAC", "gain", left=(0, 1, 2))
    rows = list(zip(result.matched, result.comac, result.gain, result.used, strict=True))
    for match, own, gain, used in rows[:MOST_CHANNELS]:
        away = "" if match.distance is None else f"{1e3 * match.distance:.3g}"
        table.add_row(
            match.channel.name,
            match.node,
            match.how,
            away,
            f"{own:.3f}",
            f"{gain:.2f}" + ("" if used else "  left out"),
        )
    console.print(table)
    if len(rows) > MOST_CHANNELS:
        console.print(f"and {len(rows) - MOST_CHANNELS} more channels", markup=False)
    for lost in result.unmatched:
        near = "" if lost.distance is None else f"; nearest is {lost.nearest}, {1e3 * lost.distance:.3g} mm away"
        console.print(f"{lost.channel.name} is left out: {lost.reason}{near}", style="red", markup=False)


def print_placement(result: SensorPlacement, written: list[Path]) -> None:
    """Print the chosen sensors and how well they tell the modes apart."""
    console = console_of_width()
    count, modes = len(result.sensors), len(result.frequency_hz)
    title = f"{result.name}: {count} of {len(result.candidates)} candidates for the first {modes} modes"
    console.print(title, style="bold", markup=False)
    table = _table("", "sensor", "at, mm", "direction", "independence", left=(1, 2, 3))
    for k, name in enumerate(result.sensors):
        at, way = (_vector(v, factor) for v, factor in ((result.positions[k], 1e3), (result.directions[k], 1.0)))
        turn = "about " if result.turns[k] else ""
        table.add_row(str(k + 1), name, at, turn + way, f"{result.independence[k]:.3f}")
    console.print(table)
    console.print(
        f"largest MAC of two modes {result.worst_mac:.3f}, condition {result.condition:.3g};"
        f" {100 * result.information:.3g} % of the information of all candidates; {result.exchanges} exchanges",
        markup=False,
    )
    for note in result.notes:
        console.print(note, markup=False)
    for path in written:
        console.print(f"wrote {path}", markup=False)


def _table(*headings: str, left: tuple[int, ...] = ()) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, heading in enumerate(headings):
        table.add_column(heading, justify="left" if k in left else "right", overflow="fold")
    return table


def _vector(values: Any, factor: float) -> str:
    """Three numbers; nothing where they are not known."""
    numbers = [round(factor * float(v), 6) + 0.0 for v in values]
    return ", ".join(f"{v:.4g}" for v in numbers) if all(map(math.isfinite, numbers)) else ""
