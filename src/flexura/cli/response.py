"""Commands of statics and response: loads and actuators in; motions, stresses, poses and responses out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import typer
from rich.console import RenderableType

from flexura.cli.amounts import (
    CommandReader,
    add_once,
    band_of,
    from_to,
    gravities_of,
    gravity_of,
    hertz_of,
    loads_of,
    moves_of,
    quantity_of,
    seconds_of,
    time_of,
)
from flexura.cli.options import Answer, Commands, Gravity, Hold, Inputs, Loads, Order, Outputs, Ratio, command
from flexura.cli.terminal import columns_table, heading
from flexura.errors import OptionError
from flexura.mechanism import DOF_NAMES, UNITS
from flexura.tables import counted, ends, number, quantity, scale_for
from flexura.thresholds import STILL

if TYPE_CHECKING:
    from flexura.analysis import FrequencyResponse, Kinetostatics, Statics, Stroke, TimeResponse
    from flexura.mechanism import Mechanism

MOST_ROWS = 12
"""Members, and pairs of channels, that are listed."""

MOST_POSES, MOST_FREQUENCIES = 41, 6
"""Of a stroke."""

Nodes = Annotated[
    list[str] | None, typer.Option("--node", metavar="NAME", help="Print this node's displacement. May be repeated.")
]


@command("at", "plot", "dpi", "scale", "strict")
def statics_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    gravity: Gravity = None,
    load: Loads = None,
    actuator: Commands = None,
    node: Nodes = None,
) -> Answer:
    """Static response to loads, gravity and actuators: displacements, readings, forces, and what yields first."""
    from flexura.analysis import statics

    commands = CommandReader(mechanism, parameters).values("--actuator", actuator)
    loads = loads_of(load)
    result = statics(mechanism, parameters, loads=loads, gravity=gravity_of(gravity), actuators=commands)
    return Answer(result, statics_text(result, node or list(loads)), "save_statics", data=lambda: result.to_dict(node))


def statics_text(result: Statics, nodes: list[str]) -> Iterator[RenderableType]:
    """Displacements of nodes, readings, actuators, and the members with the largest stress."""
    from flexura.analysis import interval_text

    yield heading(f"{result.model.plan.mechanism.name}: static response, linear")
    if nodes:
        moved = np.array([result.displacement(node) for node in nodes])
        columns = {f"{dof} [{UNITS[k > 2]}]": moved[:, k] for k, dof in enumerate(DOF_NAMES)}
        yield columns_table({"node": nodes, **columns})
    for columns in (result.reading_columns(), result.actuator_columns()):
        if columns[next(iter(columns))]:
            yield columns_table(columns)
    stresses = result.stresses()
    if loaded := [member for member in stresses.members if member.von_mises]:
        columns = {
            "member": [m.name for m in loaded],
            "von Mises [Pa]": [m.von_mises for m in loaded],
            "factor to yield": ["" if m.factor_to_yield is None else number(m.factor_to_yield, 4) for m in loaded],
            "at": [f"{m.position:.2f} of its length" for m in loaded],
        }
        yield columns_table(columns, most=MOST_ROWS)
        if len(loaded) > MOST_ROWS:
            yield f"and {counted(len(loaded) - MOST_ROWS, 'member')} with less"
        yield f"model error of stresses: {interval_text(result.stress_error)}"
    factor = stresses.factor_to_yield
    if factor is not None and np.isfinite(factor):
        if result.model.plan.is_posed:
            yield f"with what the pose stresses: {factor:.4g} times to yield"
        else:
            yield f"yields at {factor:.4g} times these loads and commands"


@command("plot", "dpi", "strict")
def kinetostatics_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    platform: Annotated[str | None, typer.Option(metavar="NODE", help="The only body by default.")] = None,
    actuator: Annotated[
        list[str] | None,
        typer.Option("--actuator", metavar="NAME", help="Input (* allowed); all that are described by default."),
    ] = None,
) -> Answer:
    """How actuators move a platform: freedoms and their screw axes, coupling, amplification, stiffness, workspace."""
    from flexura.analysis import kinetostatics
    from flexura.full_order import assemble

    model = assemble(mechanism, parameters)
    result = kinetostatics(model, platform=platform, actuators=actuator)
    return Answer(result, kinetostatics_text(mechanism.name, result), "save_kinetostatics", {"model": model})


def kinetostatics_text(name: str, result: Kinetostatics) -> Iterator[RenderableType]:
    """Freedoms with their screw axes, the coupling matrix, stiffness and workspace."""
    freedoms = f"has {result.kind}" if result.is_clear else "has no freedoms that are clear cut"
    yield heading(f"{name}: {result.platform} {freedoms}")
    for columns in (result.freedom_columns(), result.coupling_columns()):
        if columns.get("freedom", result.inputs):
            yield columns_table(columns)
    if not result.inputs:
        scale = scale_for(result.spectrum.compliance, "m/N")
        values = [number(c / scale.size, 4) for c in result.spectrum.compliance]
        if result.is_clear:
            values.insert(result.spectrum.count, f"(gap {number(result.spectrum.gap, 3)})")
        length = f"rotations counted at {quantity(result.spectrum.length, 'm', 4)}"
        yield f"compliances {scale.unit}, {length}: {' '.join(values)}"
    yield columns_table(result.stiffness_columns())
    if result.inputs:
        gain, turning = result.amplification(), all(c.quantity == "moment" for c in result.inputs)
        clean = ", ".join(
            f"{dof} {quantity(g, '' if turning == (k > 2) else f'{UNITS[k > 2]}/{UNITS[turning]}', 4)}"
            for k, (dof, g) in enumerate(zip(DOF_NAMES, gain.tolist(), strict=True))
            if abs(g) > 1e-9 * abs(gain).max()
        )
        yield f"all actuators driven alike, per elongation of each: {clean}"


@command("plot", "animate", "dpi", "strict", out="Write the table of poses: .csv or .parquet.")
def stroke_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    move: Annotated[
        list[str] | None,
        typer.Option(
            "--move",
            metavar="NODE.AXIS=FROM:TO",
            help="Prescribed displacement, e.g. carriage.y=-20mm:20mm. May be repeated.",
        ),
    ] = None,
    steps: Annotated[int | None, typer.Option(min=2, help="Number of poses from FROM to TO: 21.")] = None,
    n: Annotated[int | None, typer.Option("-n", min=1, help="Number of modes at each pose: 6.")] = None,
    load: Annotated[
        list[str] | None,
        typer.Option(
            "--load",
            metavar="NODE=FX,FY,FZ[,MX,MY,MZ]",
            help="Dead load at a node, with units, e.g. 'table=0,0,-5 N', or FROM:TO. May be repeated.",
        ),
    ] = None,
    follower: Annotated[
        list[str] | None,
        typer.Option(
            "--follower", metavar="NODE=FX,FY,FZ[,MX,MY,MZ]", help="Load that turns with its node. May be repeated."
        ),
    ] = None,
    gravity: Gravity = None,
    actuator: Annotated[
        list[str] | None,
        typer.Option(
            "--actuator",
            metavar="NAME=FROM:TO",
            help="Command with its unit, e.g. '*.piezo=0:75 V' or '*.piezo=75 V'. * allowed. May be repeated.",
        ),
    ] = None,
    node: Nodes = None,
    compliance: Annotated[
        bool, typer.Option("--compliance", help="6x6 compliance and stiffness of these nodes.")
    ] = False,
    branch: Annotated[
        int, typer.Option(min=-1, max=1, help="Follow the buckled path at the first bifurcation: 1 or -1, its side.")
    ] = 0,
    refine: Annotated[int, typer.Option(min=1, help="Cut every member into so many times its elements.")] = 1,
    order: Annotated[Order, typer.Option(help="All elements, or corotational superelements.")] = "full",
) -> Answer:
    """A mechanism over its stroke, however far: equilibria, frequencies, drive forces and support stiffness."""
    from flexura.analysis import stroke

    commands = partial(CommandReader(mechanism, parameters).values, "--actuator")
    result = stroke(
        mechanism,
        parameters,
        move=moves_of(move or []),
        steps=steps,
        n=n,
        loads=from_to("--load", load, loads_of),
        follower=from_to("--follower", follower, partial(loads_of, option="--follower")),
        gravity=gravities_of(gravity),
        actuators=from_to("--actuator", actuator, commands),
        nodes=node,
        compliance=compliance,
        branch=branch,
        refine=refine,
        order=order,
    )
    known = result.poses[0].displacement if result.poses else {}
    described = () if mechanism.motion is None else mechanism.motion.nodes
    nodes = node or [name for name in described if name in known]
    return Answer(result, stroke_text(result, nodes), "save_stroke", is_interrupted=result.interrupted)


def stroke_text(result: Stroke, nodes: Sequence[str]) -> Iterator[RenderableType]:
    """A row for every pose: what moves, what holds it, frequencies and support stiffness, and displacements of some
    nodes."""
    yield heading(f"{result.name}: over its stroke, large displacements")
    if not result.poses:
        return
    columns = result.short_columns(MOST_POSES, MOST_FREQUENCIES)
    yield columns_table(columns, left=0)
    support = " k: support stiffness, actuators locked;" if "kx [N/m]" in columns else ""
    factors = "to yield, to buckle: factors on what is there"
    yield f"f: actuators free under the forces that hold the pose;{support} {factors}"
    if result.model_errors:
        yield f"model error over all poses: {', '.join(_model_errors(result))}"
    for node in nodes:
        yield columns_table(_moved(result, node), left=0)


def _model_errors(result: Stroke) -> Iterator[str]:
    """How far the part may be from the model, of each frequency at any of the poses."""
    from flexura.analysis import interval_text

    for k in range(min([MOST_FREQUENCIES, *(len(errors.low) for errors in result.model_errors)])):
        intervals = [errors.intervals[k] for errors in result.model_errors]
        known = [interval for interval in intervals if interval is not None]
        whole = (min(low for low, _ in known), max(high for _, high in known)) if known == intervals else None
        yield f"f{k + 1} {interval_text(whole)}"


def _moved(result: Stroke, node: str) -> dict[str, Any]:
    """Displacement of a node in every pose, without what is round-off beside the largest of its kind."""
    poses = result.poses[:: max(1, -(-len(result.poses) // MOST_POSES))]
    columns: dict[str, Any] = {
        f"{name} [{result.units[name]}]": [pose.varied[name] for pose in poses] for name in poses[0].varied
    }
    moved = np.array([pose.displacement[node] for pose in poses])
    for kind in (slice(0, 3), slice(3, 6)):
        moved[:, kind] *= np.abs(moved[:, kind]) > STILL * np.abs(moved[:, kind]).max()
    names = (dof[1:] if k < 3 else dof for k, dof in enumerate(DOF_NAMES))
    return columns | {f"{node}.{name} [{UNITS[k > 2]}]": moved[:, k] for k, name in enumerate(names)}


@command("at", "plot", "strict", out="Write magnitudes and phases: .csv or .parquet.")
def frequency_response_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    band: Annotated[str, typer.Option(metavar="FROM,TO", help="Band of frequencies, e.g. '5,200 Hz'.")],
    points: Annotated[int, typer.Option(min=2, help="Least number of frequencies; resonances get more.")] = 400,
    input: Inputs = None,
    output: Outputs = None,
    quantity: Annotated[
        Literal["receptance", "mobility", "accelerance", "transmissibility"] | None,
        typer.Option(help="Read all motions as this."),
    ] = None,
    order: Annotated[
        Literal["low", "full", "exact"], typer.Option(help="Proven low-order, full-order, or exact beams.")
    ] = "low",
    method: Annotated[
        Literal["modal", "direct"], typer.Option(help="Modal sum, or solved at every frequency.")
    ] = "modal",
    damping: Ratio = None,
) -> Answer:
    """Frequency response between actuators and sensors, or any DOFs."""
    from flexura.analysis import frequency_response

    result = frequency_response(
        mechanism,
        parameters,
        inputs=input,
        outputs=output,
        band=band_of(band),
        points=points,
        quantity=quantity,
        order=order,
        method=method,
        damping=damping,
    )
    return Answer(result, frequency_response_text(result), "save_frequency_response")


def frequency_response_text(result: FrequencyResponse) -> Iterator[RenderableType]:
    """What was computed, the resonances, and the gains and peaks of the pairs."""
    from flexura.analysis import interval_text

    p, m = len(result.outputs), len(result.inputs)
    hz = result.frequency_hz
    yield heading(
        f"{result.name}: {p} x {m} responses at {counted(len(hz), 'frequency')}, {ends((hz[0], hz[-1]), 'Hz')}"
    )
    if len(result.resonances_hz):
        yield columns_table(
            {
                "resonance": list(range(1, len(result.resonances_hz) + 1)),
                "frequency [Hz]": result.resonances_hz,
                "model error": [interval_text(error) for error in result.model_error],
                "damping ratio": [number(zeta, 4) for zeta in result.ratios],
            }
        )
    columns = result.gain_columns()
    yield columns_table(columns, left=2, most=MOST_ROWS)
    if (more := len(columns["peak"]) - MOST_ROWS) > 0:
        yield f"and {counted(more, 'more pair')}; --json or --out has all"


@command("at", "plot", "strict", out="Write time, inputs and outputs: .csv or .parquet.")
def time_response_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
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
    hold: Annotated[Hold, typer.Option(help="Straight lines between samples, or held.")] = "foh",
    damping: Ratio = None,
    motion: Annotated[Literal["small", "large"], typer.Option(help="Linear, or as large as it gets.")] = "small",
    order: Annotated[Order, typer.Option(help="Proven low order, or full order.")] = "low",
    rho_infinity: Annotated[
        float,
        typer.Option(metavar="FACTOR", min=0.0, max=1.0, help="Spectral radius at high frequencies in large motion."),
    ] = 0.9,
) -> Answer:
    """Time response to signals at actuators or any DOFs, exact for signals that are linear or held between samples."""
    from flexura.analysis import read_signals, time_response
    from flexura.analysis import signals as waves

    h = quantity_of("--dt", dt, "s", "0.1ms")
    total = time_of("--duration", duration, "0.5s")
    commands = CommandReader(mechanism, parameters)
    rule = "has a signal already; give one"
    inputs: dict[str, Any] = {name: waves.step(value) for name, value in commands.values("--step", step).items()}
    for text in hammer or []:
        name, (peak, width) = commands.amounts("--hammer", text, "NAME=PEAK,WIDTH", [seconds_of])
        add_once(inputs, name, waves.half_sine(peak, width), rule)
    for text in sweep or []:
        form = "NAME=AMPLITUDE,FROM,TO"
        name, (amplitude, first, last) = commands.amounts("--sweep", text, form, [hertz_of, hertz_of])
        if total is None:
            raise OptionError("a sweep has no end without --duration, e.g. --duration 2s")
        add_once(inputs, name, waves.sweep(amplitude, first, last, total), rule)
    for text in noise or []:
        form = "NAME=RMS[,FROM,TO]"
        name, (rms, *limits) = commands.amounts("--noise", text, form, [hertz_of, hertz_of], optional=True)
        add_once(inputs, name, waves.random(rms, (limits[0], limits[1]) if limits else None), rule)
    if signals is not None:
        read = read_signals(signals)
        if abs(read.dt - h) > 1e-6 * h:
            dts = f"{quantity(read.dt, 's', 6)}, not {quantity(h, 's', 6)}"
            raise OptionError(f"{signals} is in steps of {dts}: give --dt {read.dt:.6g}s")
        for name, samples in read.signals.items():
            add_once(inputs, name, samples, rule)
        total = read.time[-1] if total is None else total
    result = time_response(
        mechanism,
        parameters,
        inputs=inputs,
        outputs=output,
        dt=h,
        duration=total if total is not None or not inputs else None,
        hold=hold,
        impulses=commands.values("--impulse", impulse, impulse=True),
        start=commands.values("--start", start),
        damping=damping,
        motion=motion,
        order=order,
        rho_infinity=rho_infinity,
    )
    return Answer(result, time_response_text(result), "draw_time")


def time_response_text(result: TimeResponse) -> Iterator[RenderableType]:
    """Extremes and final values of the outputs."""
    yield heading(f"{result.name}: {counted(len(result.time), 'sample')} up to {quantity(float(result.time[-1]), 's')}")
    yield columns_table(result.output_columns())
    if result.neglected is not None:
        yield result.neglected.text
    yield from result.model_error_notes
