"""Stresses, energies, axes and ground reactions over a stroke: the linear limit, closed forms, balance."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.strain.internal_forces import end_forces
from helpers.frames import mirrored_frame

EXAMPLES = Path(__file__).parents[2] / "examples"
STEEL = fx.describe.Material(E=200e9, nu=0.3, rho=7800, yield_stress=500e6)


def blade(**section) -> fx.Mechanism:
    """A flexure 100 mm long along x, clamped at a."""
    return fx.Mechanism(
        materials={"steel": STEEL},
        theory="timoshenko",
        corrections="none",
        nodes={"a": (0, 0, 0), "b": (0.1, 0, 0)},
        links={
            "bar": fx.describe.Link(nodes=("a", "b"), material="steel", reference=(0, 1, 0), elements=10, **section)
        },
        ground={"a": "clamped"},
    )


CASES = {
    "guide": (lambda: fx.load(EXAMPLES / "guide" / "guide.yaml"), "carriage.x", 3e-5),
    "pivot": (lambda: fx.load(EXAMPLES / "pivot" / "pivot.yaml"), "arm.ry", 3e-5),
    "rpr": (lambda: fx.load(EXAMPLES / "rpr" / "rpr.yaml"), "platform.z", 1e-4),
    "mirrored": (lambda: mirrored_frame(STEEL), "seat.y", 3e-5),
}


@pytest.mark.parametrize("name", CASES)
def test_internal_forces_of_a_tiny_stroke_are_those_of_linear_statics(name):
    """Half the difference of two opposite strokes has no part of second order. Beside it are parts of third order, and
    what positions are rounded to."""
    make, move, close = CASES[name]
    mechanism, node, component = make(), *move.split(".")
    axis = ("x", "y", "z", "rx", "ry", "rz").index(component)
    gravity, wrench = np.array([0.1, 0.2, -0.3]), np.array([2e-2, 1e-2, 3e-2, 1e-4, 2e-4, 1e-4])
    one, other = (
        fx.stroke(mechanism, move={move: sign * 2e-6}, n=1, loads={node: sign * wrench}, gravity=sign * gravity)
        for sign in (1, -1)
    )
    held = wrench.copy()
    held[axis] += (one.poses[0].reaction[move] - other.poses[0].reaction[move]) / 2
    linear = fx.statics(one.model, loads={node: held}, gravity=gravity)
    u = linear.displacement_vector[:, None]
    assert one.end_forces
    for part, own in one.end_forces.items():
        opposite, expected = other.end_forces[part], end_forces(one.model, part, u, gravity)
        for own_end, opposite_end, expected_end in zip(own, opposite, expected, strict=True):
            for kind in (slice(0, 3), slice(3, 6)):
                most = np.abs(expected_end[:, :, kind]).max()
                found = (own_end - opposite_end)[:, :, kind] / 2
                np.testing.assert_allclose(found, expected_end[:, :, kind], rtol=0, atol=close * most)
    stresses, strokes = linear.stresses(), (one.stresses(0), other.stresses(0))
    if stresses.factor_to_yield is not None:
        ratio = sum(1 / own.poses[0].stress_margin for own in (one, other)) / 2
        assert ratio == pytest.approx(1 / stresses.factor_to_yield, rel=1e-3)
    for member in stresses.members:
        if member.von_mises is not None and member.von_mises > 0.1 * stresses.members[0].von_mises:
            mean = sum(own[member.name].von_mises for own in strokes) / 2
            assert mean == pytest.approx(member.von_mises, rel=1e-3)


def test_a_roll_up_is_stressed_by_its_curvature():
    """Pure bending to an arc: E t / 2R at all stations, and the margin with it."""
    t, angle = 0.2e-3, np.pi / 2
    found = fx.stroke(blade(section=fx.describe.Rectangle(width=5e-3, thickness=t)), move={"b.rz": angle}, n=1)
    stress = 200e9 * t / 2 * angle / 0.1
    for member in found.stresses(0).members:
        assert member.von_mises == pytest.approx(stress, rel=1e-5)
        np.testing.assert_allclose(member.force, 0, atol=1e-6 * np.abs(member.moment).max() / t)
    (pose,) = found.poses
    assert pose.stress_margin == pytest.approx(500e6 / stress, rel=1e-5)
    assert pose.stress_member == "bar"
    EI = 200e9 * 5e-3 * t**3 / 12
    assert pose.energy_by_part == {"bar": pytest.approx(EI * angle**2 / 0.2, rel=1e-5)}
    assert pose.ground_reaction[5] == pytest.approx(-EI * angle / 0.1, rel=1e-5)


def test_yield_is_warned_of_once_for_each_member():
    bar = blade(section=fx.describe.Rectangle(width=5e-3, thickness=0.2e-3))
    # yield at a rotation of 500e6 * 2 * 0.1 / (200e9 * 0.2e-3) = 2.5 rad
    assert not [w for w in fx.stroke(bar, move={"b.rz": 2.45}, n=1).warnings if w.kind == "stress"]
    found = fx.stroke(bar, move={"b.rz": (-2.8, 2.8)}, steps=15, n=1)
    (warning,) = [w for w in found.warnings if w.kind == "stress"]
    assert warning.place == "bar"
    assert warning.value == pytest.approx(2.8 / 2.5, rel=1e-4)
    assert "first at b.rz = -2.8 rad" in str(warning)
    assert found.stresses()["bar"].factor_to_yield == pytest.approx(2.5 / 2.8, rel=1e-4)
    with pytest.raises(fx.OptionError, match="no pose 15 of 15"):
        found.stresses(15)


def test_without_yield_stress_there_is_no_margin():
    bar = blade(section=fx.describe.SectionConstants(A=1e-6, Iy=1e-12, Iz=1e-12, J=1e-12, ky=0.8, kz=0.8))
    (pose,) = fx.stroke(bar, move={"b.y": 1e-3}, n=1).poses
    assert (pose.stress_margin, pose.stress_member, pose.stress_position) == (None, None, None)


def test_the_ground_holds_what_is_loaded():
    mechanism, node = mirrored_frame(STEEL), "seat"
    g, wrench = np.array([0.0, 3.0, -9.81]), np.array([20.0, -10.0, 30.0, 0.1, 0.2, 0.3])
    (pose,) = fx.stroke(mechanism, move={"seat.y": 2e-3}, n=1, loads={node: wrench}, gravity=g).poses
    applied = wrench[:3] + np.array([0, pose.reaction["seat.y"], 0])
    mass = fx.check(mechanism).mass.mass
    np.testing.assert_allclose(pose.ground_reaction[:3], -applied - mass * g, atol=1e-6)
    light = fx.stroke(mechanism, move={"seat.y": 2e-3}, n=1, loads={node: wrench}).poses[0]
    here = np.array([0, 0, 0.08]) + light.displacement["seat"][:3]
    applied = wrench[:3] + np.array([0, light.reaction["seat.y"], 0])
    np.testing.assert_allclose(light.ground_reaction[3:], -np.cross(here, applied) - wrench[3:], atol=1e-6)


def test_energies_of_parts_are_the_energy_of_the_whole():
    (pose,) = fx.stroke(mirrored_frame(STEEL), move={"seat.y": 2e-3}, n=1).poses
    assert sum(pose.energy_by_part.values()) == pytest.approx(pose.energy, rel=1e-12)
    assert len(pose.energy_by_part) == 2


def test_the_screw_axis_is_that_of_neighbouring_poses():
    """The displacement of the driven node between two poses, as a twist, has the axis of the pose in the middle."""
    pivot, h = CASES["pivot"][0](), 1e-4
    before, middle, after = fx.stroke(pivot, move={"arm.ry": (0.2 - h, 0.2 + h)}, steps=3, n=1).poses
    step = np.subtract(after.displacement["arm"], before.displacement["arm"]) / (2 * h)
    axis = middle.screw_axis["arm.ry"]
    # middles of the leaves at rest are the origin; the arm's centre is 10 mm above their ends
    here = np.array([0, 0, 0.04 / 2 * np.sqrt(0.5) + 0.01]) + middle.displacement["arm"][:3]
    direction = np.array(axis.direction)
    assert direction[1] == pytest.approx(1, abs=1e-3)
    # a rotation vector's rate is the rate of rotation where the axis is the same; here it tilts a little
    np.testing.assert_allclose(np.cross(direction, here - axis.point) + axis.pitch * direction, step[:3], atol=1e-6)
