"""Commands of statics and response: loads and actuators in; motions, stresses, poses and responses out."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from flexura.cli.amounts import (
    CommandReader,
    add_once,
    band_of,
    from_to,
    gravities_of,
    gravity_of,
    hertz_of,
    limit_of,
    loads_of,
    moves_of,
    quantity_of,
    seconds_of,
    time_of,
)
from flexura.cli.options import Answer, Commands, Gravity, Hold, Inputs, Loads, Loop, Order, Outputs, Ratio, command
from flexura.errors import OptionError
from flexura.tables import quantity

if TYPE_CHECKING:
    from flexura.mechanism import Mechanism


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
    return Answer(result, result.presentation(node), "save_statics", data=lambda: result.to_dict(node))


Between = Annotated[
    str | None, typer.Option(metavar="NODE,NODE", help="Only what lies between two bodies, e.g. 'ground,table'.")
]


@command("strict", out="Write the table of members: .csv or .parquet.")
def constraints_command(mechanism: Mechanism, parameters: dict[str, float], *, between: Between = None) -> Answer:
    """Freedoms, constraints and over-constraints: who competes with whom, and what would make it exact."""
    from flexura.analysis import constraints

    return Answer(constraints(mechanism, parameters, between=_pair(between)))


def _pair(between: str | None) -> list[str] | None:
    return None if between is None else [name.strip() for name in between.split(",")]


@command(
    *("plot", "dpi", "strict"),
    out="Write the table of screws, .csv or .parquet, or a page to look around, .html.",
    page=True,
)
def free_command(mechanism: Mechanism, parameters: dict[str, float], *, between: Between = None) -> Answer:
    """Freedom and constraint spaces of bodies as screws, named, with how pure they are in energy and compliance."""
    from flexura.analysis import free

    return Answer(free(mechanism, parameters, between=_pair(between)), pictures="save_free")


@command("strict", out="Write the drift of nodes: .csv or .parquet.")
def heat_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    state: Annotated[
        list[str] | None,
        typer.Option(
            metavar="STATE", help="One of the states described, or `temperature`: everything 1 K warmer. Repeatable."
        ),
    ] = None,
    node: Nodes = None,
    n: Annotated[int, typer.Option("--n", "-n", min=1, help="Number of frequencies.")] = 3,
) -> Answer:
    """What temperatures do: drift of points, stress, buckling and frequencies, and how soon they are reached."""
    from flexura.analysis import heat

    return Answer(heat(mechanism, parameters, states=state, nodes=node, n=n))


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
    return Answer(result, pictures="save_kinetostatics", drawn={"model": model})


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
    return Answer(result, result.presentation(nodes), "save_stroke", is_interrupted=result.interrupted)


@command("strict")
def scheduled_plant_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    move: Annotated[
        list[str],
        typer.Option("--move", metavar="NODE.AXIS=FROM:TO", help="Displacement that schedules it, and its stroke."),
    ],
    input: Inputs = None,
    output: Outputs = None,
    n: Annotated[int, typer.Option("-n", min=1, help="Deviations from the equilibria that are kept.")] = 6,
    up_to: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="Highest frequency that it is for, with its unit.")
    ] = None,
    tolerance: Annotated[
        float, typer.Option(metavar="REL", help="Largest relative error of responses between poses.")
    ] = 0.01,
    damping: Ratio = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the plant: .fmu, .mat, .npz or .h5.")] = None,
    format: Annotated[str | None, typer.Option(metavar="FORMAT", help="Format, where the suffix has none.")] = None,
) -> Answer:
    """A gain-scheduled plant (LPV): state spaces along the stroke of one displacement, with errors between poses."""
    from flexura.analysis import scheduled_plant
    from flexura.io import export

    result = scheduled_plant(
        mechanism,
        parameters,
        move=moves_of(move),
        inputs=input,
        outputs=output,
        n=n,
        up_to=limit_of("--up-to", up_to),
        tolerance=tolerance,
        damping=damping,
    )
    return Answer(result, write=lambda: [] if out is None else export(result, out, format=format))


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
    loop: Loop = "open",
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
        loop=loop,
    )
    return Answer(result, pictures="save_frequency_response")


Harmonics = Annotated[int, typer.Option(min=1, help="Harmonics of which motions consist.")]
TurningOrder = Annotated[Order, typer.Option(help="Corotational superelements, or all elements.")]


@command("at", "plot", "strict", out="Write the motions along the curve: .csv or .parquet.")
def backbone_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    amplitude: Annotated[
        str, typer.Option(metavar="NAME=VALUE", help="An output and its largest amplitude, e.g. 'carriage.tx=2mm'.")
    ],
    mode: Annotated[int, typer.Option(min=1, help="Number of the mode.")] = 1,
    harmonics: Harmonics = 5,
    order: TurningOrder = "low",
) -> Answer:
    """The backbone curve of a mode: its frequency over the amplitude, with large displacements and no damping."""
    from flexura.analysis import backbone

    largest = CommandReader(mechanism, parameters).values("--amplitude", [amplitude], output=True)
    result = backbone(mechanism, parameters, amplitude=largest, mode=mode, harmonics=harmonics, order=order)
    return Answer(result, pictures="draw_backbone")


@command("at", "plot", "strict", out="Write the motions along the curve: .csv or .parquet.")
def nonlinear_response_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    input: Annotated[
        list[str],
        typer.Option("--input", "-i", metavar="NAME=AMPLITUDE", help="A sine, e.g. 'coil=0.5 N'. May be repeated."),
    ],
    band: Annotated[str, typer.Option(metavar="FROM,TO", help="Band of frequencies, e.g. '20,60 Hz'.")],
    output: Outputs = None,
    harmonics: Harmonics = 5,
    damping: Ratio = None,
    order: TurningOrder = "low",
) -> Answer:
    """Steady response with large displacements to a sine at named inputs, over a band of frequencies, Hz."""
    from flexura.analysis import nonlinear_response

    result = nonlinear_response(
        mechanism,
        parameters,
        inputs=CommandReader(mechanism, parameters).values("--input", input),
        outputs=output,
        band=band_of(band) or (0.0, 0.0),
        harmonics=harmonics,
        damping=damping,
        order=order,
    )
    return Answer(result, pictures="draw_nonlinear_response")


@command("at", "plot", "strict", out="Write densities and cumulative amplitudes: .csv or .parquet.")
def budget_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    output: Outputs = None,
    source: Annotated[
        list[str] | None,
        typer.Option("--source", metavar="NAME", help="Disturbance (* allowed); all by default. May be repeated."),
    ] = None,
    band: Annotated[
        str | None, typer.Option(metavar="FROM,TO", help="Frequencies of the curves alone, e.g. '1,500 Hz'.")
    ] = None,
    points: Annotated[int, typer.Option(min=2, help="Least number of these; resonances get more.")] = 400,
    loop: Annotated[
        Literal["open", "closed"] | None, typer.Option(help="Closed where controllers are described, by default.")
    ] = None,
    move: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="How long does it ring after, e.g. 'servo.reference=10 um'?"),
    ] = None,
    over: Annotated[str | None, typer.Option(metavar="TIME", help="That a move takes, e.g. 5ms; none.")] = None,
    within: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Band to settle in, e.g. 'gauge=20 nm'; 3 sigma by default."),
    ] = None,
    order: Annotated[Order, typer.Option(help="Proven low order, or full order.")] = "low",
    damping: Ratio = None,
) -> Answer:
    """Dynamic error budget: RMS and 3 sigma of outputs under the disturbances described, by source and by mode."""
    from flexura.analysis import budget

    amounts = CommandReader(mechanism, parameters)
    result = budget(
        mechanism,
        parameters,
        outputs=output,
        sources=source,
        band=None if band is None else band_of(band),
        points=points,
        moves=amounts.values("--move", move),
        over=time_of("--over", over, "5ms") or 0.0,
        within=amounts.values("--within", within, output=True),
        loop=loop,
        order=order,
        damping=damping,
    )
    return Answer(result, pictures="draw_budget")


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
    move: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="CSV with time and displacements of large motion, carriage.x, m and rad."),
    ] = None,
    output: Outputs = None,
    hold: Annotated[Hold, typer.Option(help="Straight lines between samples, or held.")] = "foh",
    damping: Ratio = None,
    motion: Annotated[Literal["small", "large"], typer.Option(help="Linear, or as large as it gets.")] = "small",
    loop: Loop = "open",
    order: Annotated[Order, typer.Option(help="Proven low order, or full order.")] = "low",
    rho_infinity: Annotated[
        float,
        typer.Option(metavar="FACTOR", min=0.0, max=1.0, help="Spectral radius at high frequencies in large motion."),
    ] = 0.9,
    local_error: Annotated[
        float | None,
        typer.Option(metavar="REL", help="Local error of a step of large motion, over the motion, e.g. 1e-4."),
    ] = None,
) -> Answer:
    """Time response to signals at actuators or any DOFs, exact for signals that are linear or held between samples."""
    from flexura.analysis import signals as waves
    from flexura.analysis import time_response

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
        read = _in_steps(signals, h)
        for name, samples in read.signals.items():
            add_once(inputs, name, samples, rule)
        total = read.time[-1] if total is None else total
    moved = None if move is None else _in_steps(move, h)
    if moved is not None and total is None:
        total = moved.time[-1]
    result = time_response(
        mechanism,
        parameters,
        inputs=inputs,
        move=None if moved is None else moved.signals,
        outputs=output,
        dt=h,
        duration=total if total is not None or not inputs else None,
        hold=hold,
        impulses=commands.values("--impulse", impulse, impulse=True),
        start=commands.values("--start", start),
        damping=damping,
        motion=motion,
        order=order,
        loop=loop,
        rho_infinity=rho_infinity,
        local_error=local_error,
    )
    return Answer(result, pictures="draw_time")


def _in_steps(file: Path, dt: float) -> Any:
    """The signals of a file. Raises OptionError where they are not in steps of `dt`, s."""
    from flexura.analysis import read_signals

    read = read_signals(file)
    if abs(read.dt - dt) > 1e-6 * dt:
        dts = f"{quantity(read.dt, 's', 6)}, not {quantity(dt, 's', 6)}"
        raise OptionError(f"{file} is in steps of {dts}: give --dt {read.dt:.6g}s")
    return read
