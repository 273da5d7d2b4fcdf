"""Rows of the table of the gallery: freedoms, stroke, first frequency and numbers of others of every mechanism."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

import flexura as fx
from flexura.describe import MotionSensor
from flexura.mechanism import evaluated
from flexura.tables import quantity

MOVED = {"x": "m", "y": "m", "z": "m", "rx": "rad", "ry": "rad", "rz": "rad"}
COMMANDS = {"expansion": "m", "voltage": "V", "force": "N", "moment": "N*m"}
READ = {"displacement": ("", "m", slice(0, 3)), "rotation": ("r", "rad", slice(3, 6))}
"""What stands before the axis, unit, and which of the six displacements of a node it is, by type of sensor."""


def row(name: str, mechanism: fx.Mechanism) -> str:
    """The row of a mechanism in the table."""
    plan = fx.Plan(mechanism)
    cells = (
        f":doc:`{mechanism.name} </gallery/plot_{name}>`",
        freedoms(plan),
        stroke(plan),
        _frequency(float(fx.modes(plan, n=1).frequency_hz[0])),
        str(len(mechanism.published)),
    )
    return "\n   * - " + "\n     - ".join(cells) + "\n"


def _frequency(hz: float) -> str:
    """A frequency in Hz or kHz."""
    return f"{hz:.4g} Hz" if hz < 1e4 else f"{hz / 1e3:.4g} kHz"


def freedoms(plan: fx.Plan) -> str:
    """Such as 2R1T of the platform, or that none stands out from the other compliances."""
    found = fx.kinetostatics(plan, platform=platform(plan))
    return found.kind if found.is_clear else "none stands out"


def platform(plan: fx.Plan) -> str:
    """The body or node that the described motion moves or sensors read, or else of which the numbers of others are."""
    motion, listed = plan.mechanism.motion, plan.mechanism.published
    moved = [name for name in (motion.move if motion else ()) if name not in plan.mechanism.actuators]
    read = [own.nodes[-1] for own in _sensors(plan).values()]
    asked = re.findall(r"([\w.]+)\.r?[xyz]\b", " ".join(own.ask for own in listed))
    return [*moved, *read, *asked][0]


def stroke(plan: fx.Plan) -> str:
    """The furthest ends of the described motion; of what actuators drive, what sensors read at their limits."""
    motion = plan.mechanism.motion
    if motion is None:
        return ", ".join(_workspace(plan)) or "none"
    values = {name: float(own) for name, own in plan.parameter_values().items()}
    told = []
    for name, moved in motion.move.items():
        ends = {what: getattr(evaluated(moved, values), what) for what in MOVED | COMMANDS}
        told += [f"{name}.{what} {_ends(ends[what], unit)}" for what, unit in MOVED.items() if ends[what]]
        commands = [f"{name} {_ends(ends[what], unit)}" for what, unit in COMMANDS.items() if ends[what]]
        told += [f"{', '.join(_driven(plan))} by {command}" for command in commands]
    return ", ".join(told)


def _ends(ends: Sequence[float], unit: str) -> str:
    """The end that is furthest from rest, or both where they are as far."""
    if len(ends) == 2 and np.isclose(ends[0], -ends[1], rtol=1e-3, atol=0.0):
        return f"± {quantity(abs(ends[0]), unit, 3)}"
    return quantity(max(ends, key=abs), unit, 3)


def _sensors(plan: fx.Plan) -> dict[str, MotionSensor]:
    """Sensors of displacements and rotations."""
    found = plan.mechanism.sensors.items()
    return {name: own for name, own in found if isinstance(own, MotionSensor) and own.type in READ}


def _driven(plan: fx.Plan) -> Iterator[str]:
    """What sensors read at the end of the described motion."""
    nodes = list(dict.fromkeys(node for own in _sensors(plan).values() for node in own.nodes))
    last = fx.stroke(plan, steps=3, n=1, nodes=nodes).poses[-1].displacement
    for name, sensor in _sensors(plan).items():
        label, unit, part, direction = _read(name, sensor)
        moved = np.array(last[sensor.nodes[-1]])
        if len(sensor.nodes) == 2:
            moved -= last[sensor.nodes[0]]
        yield f"{label} {quantity(float(direction @ moved[part]), unit, 3)}"


def _workspace(plan: fx.Plan) -> Iterator[str]:
    """Between which values sensors on one node read within the limits of the actuators, one sensor at a time."""
    for name, sensor in _sensors(plan).items():
        label, unit, part, direction = _read(name, sensor)
        reached = fx.kinetostatics(plan, platform=sensor.nodes[0]).vertices()[:, part] @ direction
        yield f"{label} {_range(reached.min(), reached.max(), unit)}"


def _range(low: float, high: float, unit: str) -> str:
    """Between two ends, of which the one at rest is left out."""
    one_sided = min(-low, high) < 1e-6 * max(-low, high)
    if one_sided or np.isclose(-low, high, rtol=1e-3, atol=0.0):
        return _ends((low, high), unit)
    return f"{quantity(low, unit, 3)} to {quantity(high, unit, 3)}"


def _read(name: str, sensor: MotionSensor) -> tuple[str, str, slice, np.ndarray]:
    """How a sensor is told, its unit, which displacements it reads, and along what."""
    assert sensor.direction is not None, f"the sensor {name} of a mechanism of the gallery has a direction"
    direction = np.array(sensor.direction, dtype=float)
    before, unit, part = READ[sensor.type]
    axis = "xyz"[int(np.argmax(np.abs(direction)))]
    label = f"{sensor.nodes[0]}.{before}{axis}" if len(sensor.nodes) == 1 else name
    return label, unit, part, direction / np.linalg.norm(direction)
