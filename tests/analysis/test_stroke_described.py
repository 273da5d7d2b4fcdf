"""The stroke that a file describes."""

import pytest

import flexura as fx
from helpers.shell import flexura, refused

LEAF = """flexura: 1
name: leaf
parameters: {reach: 10 mm}
nodes: {a: [0, 0, 0], b: [100 mm, 0, 0]}
flexures:
  leaf:
    nodes: [a, b]
    material: spring-steel
    reference: z
    elements: 6
    profile: {type: leaf, width: 10 mm, thickness: 0.5 mm}
corrections: none
actuators:
  coil: {type: force, nodes: [b], direction: x}
ground: {a: clamped}
"""

MOTION = (
    LEAF
    + """motion:
  move:
    b: {z: [-reach, reach]}
    coil: {force: [0, 2 N]}
  loads:
    b: {force: [0, 1 N, 0]}
  steps: 5
  modes: 2
  nodes: [b]
"""
)


def test_it_is_the_stroke_in_these_words():
    described = fx.stroke(fx.loads(MOTION))
    asked = fx.stroke(
        fx.loads(LEAF), move={"b.z": (-0.01, 0.01)}, actuators={"coil": (0.0, 2.0)},
        loads={"b": ([0.0] * 6, [0, 1.0, 0, 0, 0, 0])}, steps=5, n=2, nodes=["b"],
    )  # fmt: skip
    assert described.to_dict()["poses"] == asked.to_dict()["poses"]
    other = fx.stroke(fx.loads(MOTION), {"reach": 0.004}, steps=3, n=1)
    assert [pose.move["b.z"] for pose in other.poses] == [-0.004, 0.0, 0.004]
    assert [len(pose.frequency_hz) for pose in other.poses] == [1, 1, 1]
    (single,) = fx.stroke(fx.loads(MOTION), move={"b.y": 1e-4}).poses
    assert list(single.move) == ["b.y"]


def test_it_is_written_and_read_again(tmp_path):
    mechanism = fx.loads(MOTION)
    assert fx.loads(fx.dumps(mechanism)) == mechanism
    (tmp_path / "leaf.yaml").write_text(MOTION, encoding="utf-8")
    (tmp_path / "more.yaml").write_text("flexura: 1\nextends: leaf.yaml\nmotion: {steps: 3}\n", encoding="utf-8")
    assert len(fx.stroke(fx.load(tmp_path / "more.yaml")).poses) == 3
    assert "b.z [mm]" in flexura("stroke", tmp_path / "leaf.yaml").stdout


@pytest.mark.parametrize(
    ("motion", "said"),
    [
        ("motion: {move: {b: {z: [0, 10]}}}", ":16: motion.move.b.z.1: a length carries a unit"),
        ("motion: {move: {b: {z: [0, 10 N]}}}", ":16: motion.move.b.z.1: a length is expected"),
        ("motion: {move: {c: {z: 10 mm}}}", ":16: motion.move.c: there is no"),
        ("motion: {move: {a: {z: 10 mm}}}", ":16: motion.move.a.z: it cannot move here: it is held"),
        ("motion: {move: {coil: {expansion: 10 um}}}", "coil has no command of this kind"),
        ("motion: {move: {b: {z: [1 mm, 2 mm, 3 mm]}}}", ":16: motion.move.b.z"),
        ("motion: {move: {b: {z: 1 mm}}, steps: 1}", ":16: motion.steps"),
        ("motion: {steps: 5}", "a motion has move, loads or follower"),
        ("motion: {move: {b: {z: 1 mm}}, nodes: [c]}", ":16: motion.nodes.0"),
    ],
)
def test_what_makes_no_sense_is_named(motion, said, tmp_path):
    file = tmp_path / "leaf.yaml"
    file.write_text(LEAF + motion + "\n", encoding="utf-8")
    refused(flexura("stroke", file), said)
