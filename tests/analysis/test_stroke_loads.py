"""Actuators and loads in large motion: against the linear model where they are small, geometry and dead loads where
not."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flexura as fx
from flexura.motion.elements import turned
from flexura.motion.model import MovingModel
from helpers.shell import flexura, refused

EXAMPLES = Path(__file__).parents[2] / "examples"

TRUSS = """
flexura: 1
name: truss of two stacks
nodes: {left: [-0.8 m, 0, 0], right: [0.8 m, 0, 0], top: [0, 0.6 m, 0]}
masses: {top: {node: top, mass: 1 kg}}
actuators:
  a: {type: piezo, nodes: [left, top], stiffness: 1e7 N/m, gain: 1 mm/V}
  b: {type: piezo, nodes: [top, right], stiffness: 1e7 N/m}
  push: {type: force, nodes: [top], direction: x}
ground:
  left: clamped
  right: clamped
  top: {fixed: [tz, rx, ry, rz]}
"""

LEAF = """
flexura: 1
name: leaf
nodes: {{a: [0, 0, 0], b: [0.1 m, 0, 0], away: [0.05 m, 0, 0.1 m]}}
flexures:
  leaf: {{nodes: [a, b], material: spring-steel, reference: z, elements: 8, profile: {{type: leaf, width: 5 mm,
    thickness: 0.5 mm}}}}
corrections: none
masses: {{tip: {{node: b, mass: 0.01 kg}}, other: {{node: away, mass: 0.01 kg}}}}
springs:
  own:
    nodes: [a, away]
    stiffness: {{tx: 100 N/m, ty: 100 N/m, tz: 100 N/m, rx: 0.1 N*m/rad, ry: 0.1 N*m/rad, rz: 0.1 N*m/rad}}
actuators: {{drive: {{{drive}}}}}
ground: {{a: clamped{held}}}
"""


def test_pinned_stacks_are_a_triangle():
    """The top of a triangle lies where both stacks are as long as they want to be."""
    stroke = fx.stroke(fx.loads(TRUSS), actuators={"a": (0.0, 100.0), "b": (0.0, -0.05)}, steps=5, n=2, nodes=["top"])
    assert not stroke.warnings
    for pose in stroke.poses:
        left, right = 1 + 1e-3 * pose.actuators["a"], 1 + pose.actuators["b"]
        x = (left**2 - right**2) / (4 * 0.8)
        y = np.sqrt(left**2 - (x + 0.8) ** 2)
        assert pose.displacement["top"][:2] == pytest.approx((x, y - 0.6), abs=1e-9)
        assert pose.energy < 1e-9
    assert stroke.units == {"a": "V", "b": "m"}


def test_a_bonded_stack_moves_its_end():
    text = LEAF.format(held=", away: clamped", drive="type: piezo, nodes: [a, b], stiffness: 1e9 N/m, section: "
                       "{shape: rectangle, width: 5 mm, thickness: 5 mm}")  # fmt: skip
    text = text.replace("5 mm,\n    thickness: 0.5 mm", "1 mm,\n    thickness: 1 um")
    (pose,) = fx.stroke(fx.loads(text), actuators={"drive": 1e-4}, n=1, nodes=["b"]).poses
    assert pose.displacement["b"] == pytest.approx((1e-4, 0, 0, 0, 0, 0), abs=1e-8)


@pytest.mark.parametrize(
    ("file", "command", "nodes"),
    [
        ("rpr/rpr_piezo.yaml", {"*.piezo": 1e-3}, ["platform"]),
        ("amplifier/amplifier.yaml", {"piezo": 1e-10}, ["output"]),
    ],
)
def test_small_commands_are_those_of_statics(file, command, nodes):
    model = fx.load(EXAMPLES / file)
    linear = fx.statics(model, actuators=command)
    (pose,) = fx.stroke(model, actuators=command, n=1, nodes=nodes).poses
    for node in nodes:
        expected = linear.displacement(node)
        np.testing.assert_allclose(pose.displacement[node], expected, atol=1e-5 * np.abs(expected).max())


DRIVES = {
    "line": "type: force, nodes: [away, b]",
    "direction": "type: force, nodes: [away, b], direction: [0, 1, 0.5]",
    "moment": "type: moment, nodes: [away, b], direction: [0, 0.4, 1]",
    "one node": "type: force, nodes: [b], direction: [0, -1, 3]",
}


@pytest.mark.parametrize("kind", DRIVES)
def test_what_actuators_exert_is_a_dead_load_where_they_have_turned(kind):
    command = 2e-2 if kind == "moment" else 1.0
    driven, bare = (fx.loads(LEAF.format(drive=DRIVES[kind], held="")) for _ in range(2))
    (pose,) = fx.stroke(driven, actuators={"drive": command}, n=1, nodes=["b", "away"]).poses
    x = {node: np.array(own[:3]) for node, own in pose.displacement.items()}
    turn = np.array(pose.displacement["away"][3:])
    R = Rotation.from_rotvec(turn).as_matrix()
    wrench = np.zeros(6)
    if kind == "line":
        line = np.array([0.1, 0, 0]) + x["b"] - np.array([0.05, 0, 0.1]) - x["away"]
        wrench[:3] = line / np.linalg.norm(line)
    elif kind == "direction":
        wrench[:3] = R @ np.array([0, 1, 0.5]) / np.sqrt(1.25)
    elif kind == "moment":
        wrench[3:] = command * R @ np.array([0, 0.4, 1]) / np.sqrt(1.16)
    else:
        wrench[:3] = np.array([0, -1, 3]) / np.sqrt(10)
    assert np.linalg.norm(x["b"]) > 1e-3
    loads = {"b": wrench} if kind == "one node" else {"b": wrench, "away": -wrench}
    (other,) = fx.stroke(bare, loads=loads, n=1, nodes=["b", "away"]).poses
    for node in ("b", "away"):
        assert other.displacement[node] == pytest.approx(pose.displacement[node], abs=1e-9)


@pytest.mark.parametrize("kind", [kind for kind in DRIVES if kind != "one node"])
def test_tangents_of_actuators_are_derivatives(kind):
    model = MovingModel.of(fx.assemble(fx.loads(LEAF.format(drive=DRIVES[kind], held=""))).design)
    actuator = model.elements[model.actuators["drive"]].driven(0.3)
    rng = np.random.default_rng(1)
    frames = model.rest.moved(0.3 * rng.standard_normal(model.dof.shape))
    v = rng.standard_normal(model.dof.shape)

    def force(h: float) -> np.ndarray:
        return actuator.response(frames.moved(h * v)).force[0]

    h = 1e-3
    slope = (8 * (force(h) - force(-h)) - (force(2 * h) - force(-2 * h))) / (12 * h)
    at = actuator.response(frames)
    expected = at.tangent[0] @ v[actuator.node[0]].ravel()
    for end, own in enumerate(turned(at.force.reshape(2, 6))):
        expected[6 * end : 6 * end + 6] += own @ v[actuator.node[0, end]]
    np.testing.assert_allclose(slope, expected, atol=1e-8 * np.abs(expected).max())


def test_follower_loads_turn_with_their_node():
    """As the dead load that they are in the end."""
    leaf = fx.loads(LEAF.format(drive=DRIVES["one node"], held=", away: clamped"))
    follower = np.array([-0.5, 0, 4.0, 0, 0, 0])
    (pose,) = fx.stroke(leaf, follower={"b": follower}, n=1, nodes=["b"]).poses
    angle = -pose.displacement["b"][4]
    assert angle > 1
    c, s = np.cos(angle), np.sin(angle)
    dead = {"b": np.array([c * -0.5 - s * 4.0, 0, s * -0.5 + c * 4.0, 0, 0, 0])}
    along = fx.stroke(leaf, move={"b.z": pose.displacement["b"][2]}, loads={"b": [dead["b"][0], 0, 0, 0, 0, 0]}, n=1)
    assert along.poses[0].reaction["b.z"] == pytest.approx(dead["b"][2], rel=1e-6)


def test_loads_and_moves_go_together():
    leaf = fx.loads(LEAF.format(drive=DRIVES["one node"], held=", away: clamped"))
    stroke = fx.stroke(
        leaf,
        move={"b.z": (0.0, 0.02)},
        loads={"b": ([0.0] * 6, [2.0, 0, 0, 0, 0, 0])},
        gravity=[0, 0, -9.81],
        steps=3,
        n=2,
    )
    assert [pose.varied for pose in stroke.poses] == [{"b.z": 0.01 * k, "b.Fx": 1.0 * k} for k in range(3)]
    (last,) = fx.stroke(leaf, move={"b.z": 0.02}, loads={"b": [2.0, 0, 0, 0, 0, 0]}, gravity=[0, 0, -9.81], n=2).poses
    assert stroke.poses[2].reaction["b.z"] == pytest.approx(last.reaction["b.z"], rel=1e-9)
    assert {"b.z [m]", "b.Fx [N]"} <= set(stroke.to_columns())


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"actuators": {"c": 1.0}}, "there is no input 'c'"),
        ({"actuators": {"a": "much"}}, "the command of a is a number"),
        ({"actuators": {"a": 1.0, "?": 2.0}}, "the input a is named twice"),
        ({"actuators": {"ground.tx": 1.0}}, "accelerates the base"),
        ({"follower": {"top": [1.0]}}, "follower load on top is 6 finite numbers"),
        ({"actuators": {"a": (0.0, 1.0)}, "steps": 1}, "at least 2 steps"),
        ({"loads": {"nowhere": [0.0] * 6}}, "no node 'nowhere'"),
    ],
)
def test_what_makes_no_sense(given, words):
    with pytest.raises(fx.OptionError, match=re.escape(words)):
        fx.stroke(fx.loads(TRUSS), **given)


def test_the_shell_says_the_same(tmp_path):
    file = tmp_path / "truss.yaml"
    file.write_text(TRUSS, encoding="utf-8")
    options = ("--actuator", "a=0:100V", "--load", "top=0,0,0:0,-5,0 N", "--follower", "top=1 N,0,0", "--steps", 3)
    told = json.loads(flexura("stroke", file, *options, "--node", "top", "-n", 1, "--json").stdout)
    own = fx.stroke(
        fx.loads(TRUSS), actuators={"a": (0, 100)}, loads={"top": ([0.0] * 6, [0, -5.0, 0, 0, 0, 0])},
        follower={"top": [1.0, 0, 0, 0, 0, 0]}, steps=3, nodes=["top"], n=1,
    )  # fmt: skip
    assert told["poses"] == own.to_dict()["poses"]
    assert "top.Fy" in flexura("stroke", file, *options, "-n", 1).stdout
    refused(flexura("stroke", file, "--actuator", "a=0:3mm"), "mm is no unit of a")
    refused(flexura("stroke", file, "--actuator", "a=1V", "--actuator", "a=2V"), "has a value already")
