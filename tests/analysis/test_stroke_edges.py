"""Strokes that make no sense are refused in words, and those at the edges of sense are right."""

import re
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.mechanism import with_rigid_bodies

GUIDE = Path(__file__).parents[2] / "examples/guide/guide.yaml"


def rigid_guide() -> fx.Mechanism:
    """The guide with a rigid carriage, whose nodes move as it does."""
    return with_rigid_bodies(fx.load(GUIDE))


LEAF = """
flexura: 1
name: leaf
nodes: {{a: [0, 0, 0], b: [{size}, 0, 0]}}
flexures:
  leaf:
    nodes: [a, b]
    material: spring-steel
    reference: z
    elements: {elements}
    profile: {{type: leaf, width: 0.02*{size}, thickness: 0.01*{size}}}
masses: {{tip: {{node: b, mass: 1e-15 kg}}}}
ground: {{a: clamped}}
"""


@pytest.mark.parametrize(
    ("move", "words"),
    [
        ({}, "at least one displacement"),
        ({"carriage.q": 0.01}, "write NODE.AXIS"),
        ({"carriage": 0.01}, "write NODE.AXIS"),
        ({"cariage.x": 0.01}, "no node 'cariage'"),
        ({"leaf1.foot.x": 0.01}, "held by the ground"),
        ({"carriage.x": "far"}, "not 'far'"),
        ({"carriage.x": (0, np.nan)}, "from one to another"),
        ({"carriage.x": (0, 1, 2)}, "from one to another"),
        ({"carriage.ry": (-1, 4)}, "component of a rotation vector"),
        ({"carriage.x": 0.01, "carriage.tx": 0.01}, "carriage.tx already follows from carriage.x"),
        ({"carriage.rx": 0.01, "leaf1.head.rx": 0.01}, "leaf1.head.rx already follows from carriage.rx"),
        (
            {**{f"carriage.{axis}": 0.0 for axis in ("x", "y", "z", "rx", "ry", "rz")}, "leaf1.head.x": 0.01},
            "leaf1.head.x already follows",
        ),
    ],
)
def test_moves_that_make_no_sense(move, words):
    with pytest.raises(fx.OptionError, match=re.escape(words)):
        fx.stroke(rigid_guide(), move=move)


@pytest.mark.parametrize("steps", [0, 1, 2.5, True])
def test_ranges_without_steps(steps):
    with pytest.raises(fx.OptionError, match="at least 2 steps"):
        fx.stroke(fx.load(GUIDE), move={"carriage.x": (0, 0.01)}, steps=steps)


def test_two_nodes_of_a_body_may_turn_it():
    stroke = fx.stroke(rigid_guide(), move={"carriage.z": 0.0, "leaf1.head.z": 1e-5}, nodes=["carriage"])
    assert stroke.poses[0].displacement["carriage"][4] == pytest.approx(1e-5 / 0.025, rel=1e-3)


def test_support_of_any_size():
    """The stiffness of a leaf goes with its size, its torsional one with the cube, between 1 um and 100 m."""
    found = []
    for size in (1e-6, 1e-3, 100.0):
        leaf = fx.loads(LEAF.format(size=f"{size!r} m", elements=6))
        (pose,) = fx.stroke(leaf, move={"b.z": 0.3 * size}, n=2).poses
        found.append(np.array(pose.support_stiffness) / (size ** np.repeat([1, 3], 3)))
    assert np.isnan(found[0]).tolist() == [False, False, True, False, False, False]
    for other in found[1:]:
        assert other == pytest.approx(found[0], rel=1e-6, nan_ok=True)


@pytest.mark.parametrize(
    ("elements", "far", "said"),
    [(1, 0.03, False), (1, 0.1, True), (2, 0.3, False), (2, 0.6, True), (3, 0.75, True), (8, 0.75, False)],
)
def test_members_that_bend_too_far_for_their_elements(elements, far, said):
    """A warning with the place, where the stiffness at the tip is wrong by more than 1 % or may be."""
    leaf, fine = (fx.loads(LEAF.format(size="0.1 m", elements=n) + "corrections: none\n") for n in (elements, 24))
    own, other = (fx.stroke(of, move={"b.z": far * 0.1}, n=1) for of in (leaf, fine))
    assert [w.place for w in own.warnings if w.kind == "mesh"] == ["leaf"] * said
    assert not [w for w in other.warnings if w.kind == "mesh"]
    if not said:
        stiffness = np.array(own.poses[0].support_stiffness)
        assert stiffness == pytest.approx(other.poses[0].support_stiffness, rel=0.01, nan_ok=True)


def test_superelements_that_turn_within_themselves():
    imported = fx.load(GUIDE.parents[1] / "imported/guide.yaml")
    near, far = (fx.stroke(imported, move={"carriage.ry": angle}, n=1) for angle in (0.05, 0.2))
    assert not [w for w in near.warnings if w.kind == "rotation"]
    turned = [w for w in far.warnings if w.kind == "rotation"]
    assert [w.place for w in turned] == ["leaf1.part", "leaf2.part"]
    assert turned[0].value == pytest.approx(0.2, rel=0.02)
    # one leaf is pushed by far more than a beam would bear
    assert any("would have lost its stability" in w.text for w in near.warnings)


@pytest.mark.parametrize(
    ("stroke", "least", "most"), [(1e-4, 0, 0), (1e-3, 0.03, 0.08), (3e-3, 0.2, 0.4), (9e-3, 0.7, 0.9)]
)
def test_superelements_that_bend_are_judged_as_beams(stroke, least, most):
    """What is told is what guides of the same leaves, as beams, lose of their support stiffness."""
    of_beams, of_parts = (fx.load(GUIDE.parents[1] / name) for name in ("guide/guide.yaml", "imported/guide.yaml"))
    found = fx.stroke(of_parts, move={"carriage.x": stroke}, n=1)
    told = [w.value for w in found.warnings if w.kind == "mesh"]
    assert len(told) == (2 if most else 0)
    assert all(least < error < most for error in told)
    if most:
        rest, there = (np.array(fx.stroke(of_beams, move={"carriage.x": x}, n=1).poses[0].support_stiffness)[1:]
                       for x in (0.0, stroke))  # fmt: skip
        assert max(told) == pytest.approx(float((1 - there / rest).max()), rel=0.3)


def test_a_node_of_which_one_rotation_is_held():
    """About which axes it turns depends on the way, when it turns about both others."""
    leaf = fx.loads(LEAF.format(size="0.1 m", elements=6).replace("a: clamped}", "a: clamped, b: {fixed: [rx]}}"))
    both = fx.stroke(leaf, loads={"b": [0, 0, 0, 0, -0.15, 0]}, move={"b.rz": 0.3}, n=1)
    one = fx.stroke(leaf, move={"b.z": 0.03}, n=1)
    assert "b: the ground holds its rotation about x alone" in " ".join(map(str, both.warnings))
    assert not [w for w in one.warnings if w.kind == "rotation"]


def test_a_pose_says_what_its_stroke_does():
    """Of a strip that is twisted, and of a node of which one rotation is held."""
    wide = LEAF.format(size="0.1 m", elements=2).replace("0.02*", "0.3*")
    leaf = fx.loads(wide.replace("{a: clamped}", "{a: clamped, b: {fixed: [rz]}}"))
    turned = {"b.ry": -0.1, "b.rx": 0.3}
    said = fx.stroke(leaf, move=turned, n=1).warnings
    assert {own.kind for own in said} == {"twist", "rotation"}
    assert {own.text for own in said} <= {own.text for own in fx.modes(fx.at(leaf, turned), n=1).warnings}
    (one,) = (own for own in said if own.kind == "rotation")
    assert one.value == pytest.approx(0.1 * 0.3 / 2, rel=1e-6)


def test_what_depends_on_the_way_is_as_large_as_is_told():
    """Both rotations in proportion, or one after the other: the third differs by half their product, nearly."""
    leaf = fx.loads(LEAF.format(size="0.1 m", elements=4).replace("{a: clamped}", "{a: clamped, b: {fixed: [rz]}}"))
    straight = fx.stroke(leaf, move={"b.rx": 0.2, "b.ry": 0.1}, n=1, nodes=["b"])
    after = fx.stroke(leaf, move={"b.rx": (0, 0.2), "b.ry": (0.1, 0.1)}, steps=2, n=1, nodes=["b"])
    apart = after.poses[-1].displacement["b"][5] - straight.poses[-1].displacement["b"][5]
    (told,) = (own for own in straight.warnings if own.kind == "rotation")
    assert told.value == pytest.approx(apart, rel=0.01)


def test_what_is_free_to_move_at_rest_says_so():
    floating = fx.loads(LEAF.format(size="0.1 m", elements=2).replace("ground: {a: clamped}", ""))
    for of in (lambda: fx.stroke(floating, move={"b.z": 1e-3}), lambda: fx.modes(fx.at(floating, {"b.z": 1e-3}))):
        with pytest.raises(fx.SolverError, match="undeformed mechanism is free"):
            of()


def test_a_pose_whose_displacements_follow_from_each_other_is_refused():
    with pytest.raises(fx.OptionError, match=re.escape("leaf1.head.rx already follows from carriage.rx")):
        fx.modes(fx.at(rigid_guide(), {"carriage.rx": 0.01, "leaf1.head.rx": 0.01}))


def test_warnings_of_one_loaded_pose_have_a_place():
    pulled = fx.stroke(fx.loads(LEAF.format(size="0.1 m", elements=2)), loads={"b": [1e9, 0, 0, 0, 0, 0]}, n=1)
    assert any("first at these loads and most at these loads" in own.text for own in pulled.warnings)


def test_members_are_refined_on_request():
    """As if the file said so."""
    coarse, fine = (fx.loads(LEAF.format(size="0.1 m", elements=n) + "corrections: none\n") for n in (3, 6))
    own, other = fx.stroke(coarse, move={"b.z": 0.03}, refine=2, n=2), fx.stroke(fine, move={"b.z": 0.03}, n=2)
    assert own.poses[0].frequency_hz == other.poses[0].frequency_hz
    assert own.model.order == 2 * fx.assemble(coarse).order
    for wrong in (0, -1, 1.5, "2"):
        with pytest.raises(fx.OptionError, match="times their elements"):
            fx.stroke(coarse, move={"b.z": 0.03}, refine=wrong)


@pytest.mark.parametrize(
    ("elements", "asked", "why"),
    [
        (
            1,
            {"loads": {"b": ([0] * 6, [0, 0, 0, 0, -100.0, 0])}},
            "leaf turns by 3.14 rad between the ends of an element",
        ),
        (10, {"move": {"b.z": 0.2}}, "the force at b.z grows without limit there"),
    ],
)
def test_why_a_way_ends(elements, asked, why):
    """An element that is rolled up further than is known, and a leaf that is stretched straight."""
    leaf = fx.loads(LEAF.format(size="0.1 m", elements=elements) + "corrections: none\n")
    found = fx.stroke(leaf, steps=5, n=1, **asked)
    assert len(found.stopped) == 1 and why in found.stopped[0]
