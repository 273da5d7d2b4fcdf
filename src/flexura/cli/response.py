"""Commands of statics and response: loads and actuators in, motions and stresses out."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from flexura.cli.commands import CommandReader
from flexura.cli.modes import ModelOrder
from flexura.cli.options import (
    At,
    Commands,
    Dpi,
    File,
    Gravity,
    Inputs,
    Json,
    Loads,
    Outputs,
    Plot,
    Ratio,
    Settings,
    Strict,
    band_of,
    gravity_of,
    hertz_of,
    loads_of,
    of_pictures,
    print_result,
    quantity_of,
    read,
    seconds_of,
)
from flexura.errors import OptionError
from flexura.tables import quantity


class ResponseOrder(StrEnum):
    """Which model answers."""

    low = "low"
    full = "full"
    exact = "exact"


class Method(StrEnum):
    """How frequency response is worked out."""

    modal = "modal"
    direct = "direct"


class Quantity(StrEnum):
    """As what motions are read."""

    receptance = "receptance"
    mobility = "mobility"
    accelerance = "accelerance"
    transmissibility = "transmissibility"


class Motion(StrEnum):
    """How far a mechanism moves."""

    small = "small"
    large = "large"


class Hold(StrEnum):
    """How inputs go on between samples."""

    foh = "foh"
    zoh = "zoh"


def statics_command(
    file: File,
    gravity: Gravity = None,
    load: Loads = None,
    actuator: Commands = None,
    node: Annotated[
        list[str] | None,
        typer.Option("--node", metavar="NAME", help="Print this node's displacement. May be repeated."),
    ] = None,
    plot: Plot = None,
    dpi: Dpi = None,
    scale: Annotated[
        float | None, typer.Option(metavar="FACTOR", help="Draw displacements so many times as large as they are.")
    ] = None,
    at: At = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Static response to loads, gravity and actuators: displacements, readings, forces, and what yields first."""
    from flexura.analysis import statics
    from flexura.cli.response_tables import print_statics

    pictured = of_pictures(plot, scale=scale, dpi=dpi)
    mechanism, parameters = read(file, set, at)
    commands = CommandReader(mechanism, parameters).values("--actuator", actuator)
    loads = loads_of(load)
    g = gravity_of(gravity)
    result = statics(mechanism, parameters, loads=loads, gravity=g, actuators=commands)
    if strict:
        result.raise_warnings()
    pictures: list[Path] = []
    if plot is not None:
        from flexura.view import save_statics

        pictures = save_statics(result, plot, **pictured)
    if as_json:
        print_result(result.to_dict(node), pictures)
    else:
        print_statics(result, node or list(loads), pictures)


def kinetostatics_command(
    file: File,
    platform: Annotated[str | None, typer.Option(metavar="NODE", help="The only body by default.")] = None,
    actuator: Annotated[
        list[str] | None,
        typer.Option("--actuator", metavar="NAME", help="Input (* allowed); all that are described by default."),
    ] = None,
    plot: Plot = None,
    dpi: Dpi = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """How actuators move a platform: freedoms and their screw axes, coupling, amplification, stiffness, workspace."""
    from flexura.analysis import kinetostatics
    from flexura.cli.response_tables import print_kinetostatics
    from flexura.structure import assemble

    pictured = of_pictures(plot, dpi=dpi)
    mechanism, parameters = read(file, set)
    model = assemble(mechanism, parameters)
    result = kinetostatics(model, platform=platform, actuators=actuator)
    if strict:
        result.raise_warnings()
    pictures: list[Path] = []
    if plot is not None:
        from flexura.view import save_kinetostatics

        pictures = save_kinetostatics(result, plot, model=model, **pictured)
    if as_json:
        print_result(result.to_dict(), pictures)
    else:
        print_kinetostatics(mechanism.name, result, pictures)


def frequency_response_command(
    file: File,
    band: Annotated[str, typer.Option(metavar="FROM,TO", help="Band of frequencies, e.g. '5,200 Hz'.")],
    points: Annotated[int, typer.Option(min=2, help="Least number of frequencies; resonances get more.")] = 400,
    input: Inputs = None,
    output: Outputs = None,
    quantity: Annotated[Quantity | None, typer.Option(help="Read all motions as this.")] = None,
    order: Annotated[
        ResponseOrder, typer.Option(help="Proven low-order, full-order, or exact beams.")
    ] = ResponseOrder.low,
    method: Annotated[Method, typer.Option(help="Modal sum, or solved at every frequency.")] = Method.modal,
    damping: Ratio = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Magnitudes and phases: .csv or .parquet.")] = None,
    plot: Plot = None,
    at: At = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Frequency response between actuators and sensors, or any DOFs."""
    from flexura.analysis import frequency_response
    from flexura.cli.response_tables import print_frequency_response, write_frequency_table

    mechanism, parameters = read(file, set, at)
    result = frequency_response(
        mechanism,
        parameters,
        inputs=input,
        outputs=output,
        band=band_of(band),
        points=points,
        quantity=None if quantity is None else quantity.value,
        order=order.value,
        method=method.value,
        damping=damping,
    )
    if strict:
        result.raise_warnings()
    written = [] if out is None else [write_frequency_table(result, out)]
    if plot is not None:
        from flexura.view import save_frequency_response

        written += save_frequency_response(result, plot)
    if as_json:
        print_result(result.to_dict(), written)
    else:
        print_frequency_response(result, written)


def time_response_command(
    file: File,
    dt: Annotated[str, typer.Option(metavar="STEP", help="Time step with its unit, e.g. 0.1ms.")],
    duration: Annotated[str | None, typer.Option(metavar="TIME", help="With its unit, e.g. 0.5s.")] = None,
    step: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="A step at time zero, e.g. 'coil=2 N'.")
    ] = None,
    impulse: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="An impulse at time zero, e.g. 'coil=5 mN*s'."),
    ] = None,
    hammer: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=PEAK,WIDTH", help="A half-sine pulse, e.g. 'coil=50 N,2 ms'."),
    ] = None,
    sweep: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=AMPLITUDE,FROM,TO", help="A sine sweep over the duration, e.g. 'coil=1 N,5 Hz,200 Hz'."
        ),
    ] = None,
    noise: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=RMS[,FROM,TO]", help="Random, in a band, e.g. 'coil=1 N,5 Hz,200 Hz'."),
    ] = None,
    signals: Annotated[
        Path | None, typer.Option(metavar="FILE", help="CSV with time and columns named as inputs.")
    ] = None,
    start: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Start from the static state under this, let go at time zero."),
    ] = None,
    output: Outputs = None,
    hold: Annotated[Hold, typer.Option(help="Straight lines between samples, or held.")] = Hold.foh,
    damping: Ratio = None,
    motion: Annotated[Motion, typer.Option(help="Linear, or as large as it gets.")] = Motion.small,
    order: Annotated[ModelOrder, typer.Option(help="Proven low order, or full order.")] = ModelOrder.low,
    rho_infinity: Annotated[
        float,
        typer.Option(metavar="FACTOR", min=0.0, max=1.0, help="Spectral radius at high frequencies in large motion."),
    ] = 0.9,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Time, inputs and outputs: .csv or .parquet.")
    ] = None,
    plot: Plot = None,
    at: At = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Time response to signals at actuators or any DOFs, exact for signals that are linear or held between samples."""
    from flexura.analysis import read_signals, time_response
    from flexura.cli.response_tables import print_time_response, write_time_table

    mechanism, parameters = read(file, set, at)
    h = quantity_of("--dt", dt, "s", "0.1ms")
    total = None if duration is None else quantity_of("--duration", duration, "s", "0.5s")
    commands = CommandReader(mechanism, parameters)
    inputs: dict[str, Any] = _signals(commands, step, hammer, sweep, noise, total)
    if signals is not None:
        found = read_signals(signals)
        if abs(found.dt - h) > 1e-6 * h:
            raise OptionError(
                f"{signals} is in steps of {quantity(found.dt, 's', 6)}, not"
                f" {quantity(h, 's', 6)}: give --dt {found.dt:.6g}s"
            )
        for name, samples in found.signals.items():
            _add(inputs, name, samples)
        total = found.time[-1] if total is None else total
    result = time_response(
        mechanism,
        parameters,
        inputs=inputs,
        outputs=output,
        dt=h,
        duration=total if total is not None or not inputs else None,
        hold=hold.value,
        impulses=commands.values("--impulse", impulse, impulse=True),
        start=commands.values("--start", start),
        damping=damping,
        motion=motion.value,
        order=order.value,
        rho_infinity=rho_infinity,
    )
    if strict:
        result.raise_warnings()
    written = [] if out is None else [write_time_table(result, out)]
    if plot is not None:
        from flexura.view import draw_time

        written += _save({"time.png": draw_time(result)}, plot)
    if as_json:
        print_result(result.to_dict(), written)
    else:
        print_time_response(result, written)


def _signals(
    commands: CommandReader,
    step: list[str] | None,
    hammer: list[str] | None,
    sweep: list[str] | None,
    noise: list[str] | None,
    total: float | None,
) -> dict[str, Any]:
    from flexura.analysis import signals as s

    found: dict[str, Any] = {}
    band = [hertz_of, hertz_of]
    for name, value in commands.values("--step", step).items():
        _add(found, name, s.step(value))
    for text in hammer or []:
        name, (peak, width) = commands.amounts("--hammer", text, "NAME=PEAK,WIDTH", [seconds_of])
        _add(found, name, s.half_sine(peak, width))
    for text in sweep or []:
        name, (amplitude, first, last) = commands.amounts("--sweep", text, "NAME=AMPLITUDE,FROM,TO", band)
        if total is None:
            raise OptionError("a sweep has no end without --duration, e.g. --duration 2s")
        _add(found, name, s.sweep(amplitude, first, last, total))
    for text in noise or []:
        name, numbers = commands.amounts("--noise", text, "NAME=RMS[,FROM,TO]", band, optional=True)
        _add(found, name, s.random(numbers[0], (numbers[1], numbers[2]) if len(numbers) == 3 else None))
    return found


def _add(found: dict[str, Any], name: str, signal: Any) -> None:
    if name in found:
        raise OptionError(f"two signals are given for {name}")
    found[name] = signal


def _save(figures: dict[str, Any], folder: Path) -> list[Path]:
    from flexura.view import save_figures

    return save_figures(figures, folder)
