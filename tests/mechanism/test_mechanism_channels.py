"""Actuators, sensors, dashpots and damping in a description: units, defaults, round trips, and what is refused."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import flexura as fx
from helpers.over import over

MODEL = """\
flexura: 1
damping:
  ratio: zeta
  bands:
    - {up_to: 50 Hz, ratio: 2 %}
    - {up_to: 1 kHz, ratio: 2*zeta}
  ratios: [0.03, zeta]
  rayleigh: {frequencies: [10 Hz, f2], ratios: [1 %, 0.02]}
  loss_factor: 1e-3
parameters:
  zeta: {value: 0.01, minimum: 0, maximum: 0.1}
  f2: 200 Hz
  c: 3 N*s/m
  volts: 120 V
nodes:
  a: [0, 0, 0]
  b: [100 mm, 0, 0]
links:
  beam: {nodes: [a, b], material: Al-6061-T6, section: {shape: circle, diameter: 2 mm}}
bodies:
  stage: {centre: [120 mm, 0, 0], mass: 0.2 kg, inertia: [1e-5 kg*m^2, 1e-5 kg*m^2, 1e-5 kg*m^2], carries: [b]}
dashpots:
  ground: {nodes: [stage], damping: {tx: c, ty: 5 N*s/mm, rz: 2 mN*m*s/rad}, at: [1 cm, 0, 0]}
  between: {nodes: [a, stage], damping: {rx: 0.1 N*m*s/rad}, rotate: {axis: [1, 1, 0], angle: 30 deg}}
actuators:
  push: {type: force, nodes: [stage], direction: -y, limit: 20 N}
  squeeze: {type: force, nodes: [a, stage]}
  twist: {type: moment, nodes: [stage], direction: [0, 1, 1], limit: 50 mN*m}
  shake: {type: base, direction: z}
  roll: {type: base_rotation, direction: x, point: [0, 10 mm, 0]}
  stack:
    type: piezo
    nodes: [a, stage]
    stiffness: 25 N/um
    blocked_force: 800 N
    gain: 0.3 um/V
    mass: 12 g
    section: {shape: rectangle, width: 5 mm, thickness: 4 mm}
    nu: 0.25
  plain: {type: piezo, nodes: [a, b], stiffness: 1 N/um, free_stroke: 20 um}
sensors:
  x: {type: displacement, nodes: [stage], direction: x}
  v: {type: velocity, nodes: [a, stage]}
  a: {type: acceleration, nodes: [stage], direction: [1, 2, 3], mass: 5 g}
  phi: {type: rotation, nodes: [stage], direction: y}
  omega: {type: angular_velocity, nodes: [a, stage], direction: y}
  alpha: {type: angular_acceleration, nodes: [stage], direction: -z}
  load: {type: force, actuator: stack}
ground: {a: clamped}
"""


@pytest.fixture(scope="module")
def described():
    """Everything there is."""
    return fx.loads(MODEL)


def test_units(described):
    """Numbers arrive in SI."""
    damping = described.damping
    assert [(b.up_to, str(b.ratio)) for b in damping.bands] == [(50.0, "0.02"), (1000.0, "2 * zeta")]
    assert damping.rayleigh.frequencies[0] == 10.0 and damping.rayleigh.ratios == (0.01, 0.02)
    ground = described.dashpots["ground"]
    assert ground.damping.ty == pytest.approx(5e3) and ground.damping.rz == pytest.approx(2e-3)
    assert ground.damping.tz == 0 and ground.at[0] == pytest.approx(0.01)
    stack = described.actuators["stack"]
    assert [stack.stiffness, stack.blocked_force, stack.gain, stack.mass, stack.nu] == pytest.approx(
        [25e6, 800.0, 0.3e-6, 12e-3, 0.25]
    )
    assert stack.free_stroke is None and stack.section.width == pytest.approx(5e-3)
    assert described.actuators["plain"].free_stroke == pytest.approx(20e-6)
    assert described.actuators["push"].direction == (0, -1, 0) and described.actuators["squeeze"].direction is None
    assert described.actuators["twist"].limit == pytest.approx(0.05)
    assert described.actuators["roll"].point == pytest.approx((0, 0.01, 0))
    assert described.sensors["a"].mass == pytest.approx(5e-3)
    assert described.parameters["c"].value == pytest.approx(3.0)


def test_round_trip(described, tmp_path):
    """Text and files read back as the same description."""
    assert fx.loads(fx.dumps(described)) == described
    fx.save(described, tmp_path / "model.yaml")
    assert fx.load(tmp_path / "model.yaml") == described
    assert fx.dumps(fx.load(tmp_path / "model.yaml")) == fx.dumps(described)


def test_everything_is_used(described):
    """The system has all of it, named and with its unit."""
    built = fx.system(described, order="full")
    assert [str(c) for c in built.inputs] == [
        *("push [N]", "squeeze [N]", "twist [N*m]", "shake [m/s^2]", "roll [rad/s^2]", "stack [V]", "plain [m]"),
    ]
    assert [str(c) for c in built.outputs] == [
        *("x [m]", "v [m/s]", "a [m/s^2]", "phi [rad]", "omega [rad/s]", "alpha [rad/s^2]", "load [N]"),
    ]
    assert built.limits[5] == pytest.approx((0, 800 / 25e6 / 0.3e-6))
    assert built.derivative.tolist() == [0, 1, 2, 0, 1, 2, 0]
    assert built.C.diagonal().max() > 5e3


def test_short_damping():
    """A number is the ratio of all modes, in files too."""
    head = MODEL.split("damping:", maxsplit=1)[0]
    tail = "parameters:" + MODEL.split("parameters:", 1)[1]
    for text, ratio in (("0.02", 0.02), ("2 %", 0.02), ("2*zeta", "2 * zeta")):
        found = fx.loads(f"{head}damping: {text}\n{tail}")
        assert str(found.damping.ratio) == str(ratio)
        assert fx.loads(fx.dumps(found)) == found


def test_substructures_round_trip():
    """Channels of substructures are written with them."""
    unit = fx.describe.Substructure(
        nodes={"a": (0, 0, 0), "b": (0.1, 0, 0)},
        links={"l": fx.describe.Link(nodes=("a", "b"), material="silicon", section=fx.describe.Circle(diameter=1e-3))},
        actuators={"f": fx.describe.ForceActuator(nodes=("b",), direction=(0, 0.6, 0.8))},
        sensors={"s": fx.describe.MotionSensor(type="velocity", nodes=("a", "b"))},
        dashpots={"d": fx.describe.Dashpot(nodes=("a", "b"), damping={"tz": 2.0})},
        interface=("a",),
    )
    described = fx.Mechanism(
        substructures={"unit": unit}, instances={"u": fx.describe.Instance(of="unit")}, ground={"u.a": "clamped"}
    )
    assert fx.loads(fx.dumps(described)) == described


def changed(old: str, new: str) -> str:
    """The model with one thing different."""
    assert MODEL.count(old) == 1, old
    return MODEL.replace(old, new)


def line_of(text: str, part: str) -> int:
    """Number of the line that holds a part."""
    return text[: text.index(part)].count("\n") + 1


REFUSED = {
    "ratio of one": ("ratio: zeta\n", "ratio: 1\n", "damping.ratio", "damping ratio must be at least 0 and below 1"),
    "negative ratio": ("ratios: [0.03, zeta]", "ratios: [-0.03, zeta]", "damping.ratios.0", "at least 0 and below 1"),
    "ratio with a unit": ("ratios: [0.03, zeta]", "ratios: [3 Hz, 0.1]", "damping.ratios.0", "damping ratio"),
    "bare frequency": ("up_to: 50 Hz", "up_to: 50", "damping.bands.0.up_to", ""),
    "no frequency": ("up_to: 50 Hz", "up_to: 0 Hz", "damping.bands.0.up_to", "must be positive"),
    "bands out of order": ("up_to: 50 Hz", "up_to: 5 kHz", "damping", "in order"),
    "Rayleigh out of order": ("[10 Hz, f2]", "[10 Hz, 5 Hz]", "damping.rayleigh", "the lower one first"),
    "one Rayleigh ratio": ("ratios: [1 %, 0.02]", "ratios: [1 %]", "damping.rayleigh.ratios", ""),
    "negative loss factor": ("loss_factor: 1e-3", "loss_factor: -1e-3", "damping.loss_factor", "non-negative"),
    "unknown key": ("loss_factor: 1e-3", "lossfactor: 1e-3", "damping.lossfactor", "unknown key"),
    "length for damping": ("ty: 5 N*s/mm", "ty: 5 mm", "dashpots.ground.damping.ty", "damping coefficient"),
    "negative damping": ("ty: 5 N*s/mm", "ty: -5 N*s/mm", "dashpots.ground.damping.ty", "non-negative"),
    "node of a dashpot": (
        "ground: {nodes: [stage]",
        "ground: {nodes: [stag]",
        *("dashpots.ground.nodes.0", "no such node"),
    ),
    "one node twice": (
        "between: {nodes: [a, stage]",
        "between: {nodes: [a, a]",
        *("dashpots.between.nodes", "named twice"),
    ),
    "kind of actuator": (
        "type: force, nodes: [stage]",
        "type: push, nodes: [stage]",
        *("actuators.push", "type is one of"),
    ),
    "no direction": (", direction: -y, limit: 20 N", "", "actuators.push", "a direction is needed"),
    "no length of direction": ("direction: -y", "direction: [0, 0, 0]", "actuators.push.direction", "not zero"),
    "limit of zero": ("limit: 20 N", "limit: 0 N", "actuators.push.limit", "positive"),
    "limit of a moment": ("limit: 50 mN*m", "limit: 50 N", "actuators.twist.limit", "moment"),
    "node of an actuator": (
        "squeeze: {type: force, nodes: [a, stage]",
        "squeeze: {type: force, nodes: [a, c]",
        *("actuators.squeeze.nodes.1", "no such node"),
    ),
    "three nodes": (
        "squeeze: {type: force, nodes: [a, stage]",
        "squeeze: {type: force, nodes: [a, b, stage]",
        *("actuators.squeeze.nodes", "at most 2"),
    ),
    "actuator of one node": (
        "plain: {type: piezo, nodes: [a, b]",
        "plain: {type: piezo, nodes: [a]",
        *("actuators.plain.nodes", "2 entries"),
    ),
    "stack on one node": (
        "plain: {type: piezo, nodes: [a, b]",
        "plain: {type: piezo, nodes: [a, a]",
        *("actuators.plain.nodes", "named twice"),
    ),
    "two ranges": (
        "blocked_force: 800 N",
        "blocked_force: 800 N\n    free_stroke: 5 um",
        *("actuators.stack", "free_stroke or blocked_force"),
    ),
    "no stiffness": ("    stiffness: 25 N/um\n", "", "actuators.stack.stiffness", "required"),
    "stiffness of zero": ("stiffness: 25 N/um", "stiffness: 0 N/um", "actuators.stack.stiffness", "positive"),
    "gain in N": ("gain: 0.3 um/V", "gain: 0.3 N/V", "actuators.stack.gain", "stroke per volt"),
    "Poisson's ratio": ("nu: 0.25", "nu: 0.6", "actuators.stack", "Poisson"),
    "kind of sensor": ("type: velocity", "type: speed", "sensors.v", "type is one of"),
    "direction of a sensor": (
        "type: displacement, nodes: [stage], direction: x",
        "type: displacement, nodes: [stage], direction: w",
        *("sensors.x.direction", "a direction is"),
    ),
    "mass of a sensor": ("mass: 5 g", "mass: -5 g", "sensors.a.mass", "non-negative"),
    "sensed actuator": ("actuator: stack", "actuator: stuck", "sensors.load.actuator", "no such actuator"),
    "sensed moment": ("actuator: stack", "actuator: twist", "sensors.load.actuator", "exerts no force"),
    "undefined parameter": ("ratio: zeta\n", "ratio: zetta\n", "damping.ratio", "parameter 'zetta' is not defined"),
    "wrong parameter": ("ratio: zeta\n", "ratio: f2/1e3\n", "damping.ratio", "damping ratio"),
    "parameter too large": ("ratio: zeta\n", "ratio: 200*zeta\n", "damping.ratio", "at least 0 and below 1"),
    "stiffness of a parameter": ("tx: c,", "tx: zeta,", "dashpots.ground.damping.tx", "damping coefficient"),
}


@over("case", REFUSED)
def test_what_is_refused(case):
    """One problem, at its place, on its line."""
    old, new, place, rule = REFUSED[case]
    text = changed(old, new)
    with pytest.raises(fx.ModelError) as caught:
        fx.loads(text, "model.yaml")
    assert len(caught.value.problems) == 1, str(caught.value)
    problem = caught.value.problems[0]
    assert ".".join(map(str, problem.path)) == place
    assert rule in problem.rule
    own = str(problem.where).removeprefix("model.yaml:")
    start = line_of(MODEL, old)
    assert own.isdigit() and (place.startswith("damping") or abs(int(own) - start) <= 8)


def test_hints():
    """Names that are nearly right are suggested."""
    for old, new, hint in (
        ("actuator: stack", "actuator: stuck", "did you mean stack?"),
        ("squeeze: {type: force, nodes: [a, stage]", "squeeze: {type: force, nodes: [a, stags]", "did you mean stage?"),
    ):
        with pytest.raises(fx.ModelError, match=r"did you mean") as caught:
            fx.loads(changed(old, new))
        assert caught.value.problems[0].hint == hint


def test_everything_wrong_at_once():
    """Several slips are reported together, in the order of the file."""
    text = MODEL
    for old, new in (("limit: 20 N", "limit: 20 m"), ("gain: 0.3 um/V", "gain: 0 um/V"), ("mass: 5 g", "mass: 5 m")):
        text = text.replace(old, new)
    with pytest.raises(fx.ModelError) as caught:
        fx.loads(text, "model.yaml")
    lines = [int(str(p.where).split(":")[1]) for p in caught.value.problems]
    assert lines == [line_of(text, part) for part in ("limit: 20 m", "gain: 0 um/V", "mass: 5 m")]
    assert all(a < b for a, b in pairwise(lines))


def test_python_says_the_same():
    """Parts made in Python are held to the same rules."""
    with pytest.raises(fx.ModelError, match="a direction is needed"):
        fx.describe.ForceActuator(nodes=("a",))
    with pytest.raises(fx.ModelError, match="free_stroke or blocked_force"):
        fx.describe.PiezoStack(nodes=("a", "b"), stiffness=1.0, free_stroke=1.0, blocked_force=1.0)
    with pytest.raises(fx.ModelError, match="below 1"):
        fx.describe.Damping(ratio=1.0)
    for ratio in (np.nan, np.inf):
        with pytest.raises(fx.ModelError, match="finite"):
            fx.describe.Damping(ratio=ratio)
    with pytest.raises(fx.ModelError, match="lower one first"):
        fx.describe.Rayleigh(frequencies=(20.0, 10.0), ratios=(0.1, 0.1))
    with pytest.raises(fx.ModelError, match="unknown key"):
        fx.describe.MotionSensor(type="velocity", nodes=("a",), direction="x", range=3)
