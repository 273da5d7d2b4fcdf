"""Commands that hold a test against a model, and that say where to put sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

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
from flexura.cli.tables import columns_table, console_of_width
from flexura.tables import percent, quantity

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
    console.print(columns_table(_pair_columns(result.pairs), left=0))
    if result.unpaired_test:
        found = ", ".join(f"{k} ({quantity(result.test_hz[k - 1], 'Hz')})" for k in result.unpaired_test)
        console.print(f"test modes without a counterpart: {found}", style="red", markup=False)
    if result.unpaired_model:
        found = ", ".join(f"{k} ({quantity(result.model_hz[k - 1], 'Hz')})" for k in result.unpaired_model)
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


def _pair_columns(pairs: Sequence[ModePair]) -> dict[str, list[Any]]:
    is_space = [len(own.model_space) > 1 or len(own.test_space) > 1 for own in pairs]
    return {
        "test": [own.test for own in pairs],
        "measured [Hz]": [own.test_hz for own in pairs],
        "damping": [percent(own.damping_ratio, 2) for own in pairs],
        "model": [own.model for own in pairs],
        "computed [Hz]": [own.model_hz for own in pairs],
        "difference": [f"{100 * own.error:+.2f} %" for own in pairs],
        "MAC": [f"{own.mac:.3f}" for own in pairs],
        "in space": [f"{own.space_mac:.3f}" if space else "" for own, space in zip(pairs, is_space, strict=True)],
        "not represented": [percent(own.expansion_error, 2) for own in pairs],
    }


def _print_channels(console: Console, result: Correlation) -> None:
    """Where channels sit in the model, and which disagree."""
    rows = list(zip(result.matched, result.comac, result.gain, result.used, strict=True))
    shown = rows[:MOST_CHANNELS]
    columns = {
        "channel": [match.channel.name for match, *_ in shown],
        "reads": [match.node for match, *_ in shown],
        "found by": [match.how for match, *_ in shown],
        "away [m]": [match.distance for match, *_ in shown],
        "CoMAC": [f"{own:.3f}" for _, own, _, _ in shown],
        "gain": [f"{gain:.2f}" + ("" if used else "  left out") for _, _, gain, used in shown],
    }
    console.print(columns_table(columns, left=3))
    if len(rows) > MOST_CHANNELS:
        console.print(f"and {len(rows) - MOST_CHANNELS} more channels", markup=False)
    for lost in result.unmatched:
        near = "" if lost.distance is None else f"; nearest is {lost.nearest}, {quantity(lost.distance, 'm', 3)} away"
        console.print(f"{lost.channel.name} is left out: {lost.reason}{near}", style="red", markup=False)


def print_placement(result: SensorPlacement, written: list[Path]) -> None:
    """Print the chosen sensors and how well they tell the modes apart."""
    console = console_of_width()
    count, modes = len(result.sensors), len(result.frequency_hz)
    title = f"{result.name}: {count} of {len(result.candidates)} candidates for the first {modes} modes"
    console.print(title, style="bold", markup=False)
    turned = ["about " if turns else "" for turns in result.turns]
    columns = {
        "": [str(k + 1) for k in range(count)],
        "sensor": result.sensors,
        "at, mm": [_vector(own, 1e3) for own in result.positions],
        "direction": [turn + _vector(own, 1.0) for turn, own in zip(turned, result.directions, strict=True)],
        "independence": [f"{own:.3f}" for own in result.independence],
    }
    console.print(columns_table(columns, left=4))
    console.print(
        f"largest MAC of two modes {result.worst_mac:.3f}, condition {result.condition:.3g};"
        f" {percent(result.information)} of the information of all candidates; {result.exchanges} exchanges",
        markup=False,
    )
    for note in result.notes:
        console.print(note, markup=False)
    for path in written:
        console.print(f"wrote {path}", markup=False)


def _vector(values: Any, factor: float) -> str:
    """Three numbers; nothing where they are not known."""
    numbers = [round(factor * float(v), 6) + 0.0 for v in values]
    return ", ".join(f"{v:.4g}" for v in numbers) if all(map(math.isfinite, numbers)) else ""
