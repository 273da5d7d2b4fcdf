"""Virtual points: a free rigid body of known receptances, what rigid motion does not explain, and bad interfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from flexura.structure import Channel
from flexura.testing import MeasuredChannel, MeasuredFRF
from helpers.coupled_parts import DOFS, given

HZ = np.linspace(10.0, 200.0, 20)
W = 2 * np.pi * HZ
POINT = np.array([0.04, 0.01, 0.062])
TRIAXIAL = [(0.01, 0.008, 0.006), (0.012, -0.009, -0.004), (-0.008, 0.007, -0.009)]
HITS = [(0.01, 0.01, 0.0), (0.01, -0.01, 0.004), (-0.009, 0.002, 0.01)]
MASS = np.diag([0.4, 0.4, 0.4, 2e-5, 3e-5, 4e-5])


def rigid(arms, directions):
    """Motion of each channel by that of the point: e . (u + theta x r)."""
    return np.array([np.concatenate([e, np.cross(r, e)]) for r, e in zip(arms, directions, strict=True)])


def channels(name, quantity, places, sign=1.0):
    """Three along x, y and z at every place."""
    return [
        Channel(f"{name}{k + 1}.{axis}", quantity, "tip", tuple(sign * e), tuple(POINT + np.array(arm)))
        for k, arm in enumerate(places)
        for axis, e in zip("xyz", np.eye(3), strict=True)
    ]


SENSORS, IMPACTS = channels("s", "acceleration", TRIAXIAL), channels("h", "force", HITS, -1.0)


def measured(sensors=SENSORS, impacts=IMPACTS, wrong=()):
    """Accelerances of the free body; sensors that are `wrong` have the sign of their channel against them."""
    Ru, Rf = (
        rigid([np.subtract(c.position, POINT) for c in side], [np.array(c.direction) for c in side])
        for side in (sensors, impacts)
    )
    H = np.broadcast_to(Ru @ np.linalg.inv(MASS) @ Rf.T, (len(HZ), len(sensors), len(impacts))).astype(complex)
    flip = np.array([-1.0 if c.name in wrong else 1.0 for c in sensors])
    return given(HZ, H * flip[:, None], impacts, sensors)


def test_a_free_body_has_the_receptances_of_its_mass_and_inertia():
    found = fx.virtual_points(measured(), {"tip": tuple(POINT)})
    assert [c.name for c in found.outputs] == [c.name for c in found.inputs] == [f"tip.{dof}" for dof in DOFS]
    assert np.allclose(found.response, np.linalg.inv(MASS), rtol=1e-10, atol=1e-10 * 5e4)
    assert [c.quantity for c in found.outputs] == ["acceleration"] * 3 + ["angular_acceleration"] * 3
    assert [c.quantity for c in found.inputs] == ["force"] * 3 + ["moment"] * 3
    assert found.counts == {"tip": (9, 9, 6)}
    assert min(own.min() for own in found.sensor_consistency.values()) > 1 - 1e-12
    assert min(own.min() for own in found.impact_consistency.values()) > 1 - 1e-12
    assert not found.warnings


def test_a_described_body_is_the_same_at_its_node():
    text = """
bodies: {block: {centre: [40 mm, 10 mm, 62 mm], mass: 0.4 kg, inertia: [20 kg*mm^2, 30 kg*mm^2, 40 kg*mm^2]}}
nodes: {floor: [40 mm, 10 mm, 0]}
springs: {soft: {nodes: [floor, block], stiffness: {tx: 1 mN/m}}}
ground: {floor: clamped}
"""
    names = [f"block.{dof}" for dof in DOFS]
    body = fx.frequency_response(
        fx.loads(text),
        frequency_hz=HZ,
        inputs=names,
        outputs=names,
        quantity="accelerance",
        order="full",
        method="direct",
    )
    point = fx.virtual_points(measured(), {"tip": tuple(POINT)})
    assert np.allclose(body.response, point.response, rtol=1e-3, atol=1e-2)


def test_a_measured_body_at_a_virtual_point_adds_its_mass_to_another():
    point = fx.virtual_points(measured(), {"tip": tuple(POINT)})
    other = np.diag([0.1, 0.2, 0.3, 1e-5, 1e-5, 2e-5])
    Y = np.broadcast_to(np.linalg.inv(other), (len(HZ), 6, 6)) / -(W[:, None, None] ** 2)
    described = given(
        *(HZ, Y.astype(complex)),
        [Channel(f"base.{dof}", "force" if dof[0] == "t" else "moment") for dof in DOFS],
        [Channel(f"base.{dof}", "displacement" if dof[0] == "t" else "rotation") for dof in DOFS],
    )
    found = fx.couple({"A": point, "B": described}, joins=[("A.tip", "B.base")])
    assert np.allclose(found.response, np.linalg.inv(MASS + other), rtol=1e-8, atol=1e-4)


def test_channels_that_are_not_at_a_point_stay_as_they_are():
    far = MeasuredChannel("far", "acceleration", "end", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    H = np.concatenate([measured().response, np.full((len(HZ), 1, 9), 2.0)], axis=1)
    found = fx.virtual_points(given(HZ, H, IMPACTS, [*SENSORS, far]), {"tip": tuple(POINT)})
    assert found.outputs[0].name == "far" and len(found.outputs) == 7
    Rf = rigid([np.subtract(c.position, POINT) for c in IMPACTS], [np.array(c.direction) for c in IMPACTS])
    assert np.allclose(found.response[:, 0], 2.0 * np.linalg.pinv(Rf) @ np.ones(9), atol=1e-9)


def test_a_sensor_with_a_wrong_sign_is_the_least_consistent_and_is_named():
    found = fx.virtual_points(measured(wrong=("s2.y",)), {"tip": tuple(POINT)})
    kinds = [(w.kind, w.place) for w in found.warnings]
    assert kinds[0] == ("consistency", "s2.y")
    means = {name: own.mean() for name, own in found.sensor_consistency.items()}
    assert min(means, key=lambda name: means[name]) == "s2.y"


def test_as_many_sensors_as_dofs_say_nothing_of_consistency_and_it_is_said():
    six = [SENSORS[k] for k in (0, 1, 2, 4, 5, 6)]
    found = fx.virtual_points(measured(six), {"tip": tuple(POINT)})
    assert any("as many sensors as DOFs, 6" in note for note in found.notes)
    assert np.allclose(found.response, np.linalg.inv(MASS), rtol=1e-8, atol=1e-3)


def test_points_with_fewer_dofs_and_named_channels():
    point = fx.VirtualPoint(tuple(POINT), ("tx", "ty", "tz"), ("s1.*",), ("h1.*",))
    centred = [replace(c, position=tuple(POINT)) for c in (*SENSORS[:3],)]
    hits = [replace(c, position=tuple(POINT)) for c in IMPACTS[:3]]
    found = fx.virtual_points(measured(centred, hits), {"tip": point})
    assert [c.name for c in found.outputs] == ["tip.tx", "tip.ty", "tip.tz"]
    assert np.allclose(found.response, np.eye(3) / 0.4)


def test_rotations_that_are_measured_take_part():
    gyros = [
        Channel(f"g.{axis}", "angular_acceleration", "tip", tuple(e), tuple(POINT))
        for axis, e in zip("xyz", np.eye(3), strict=True)
    ]
    centred = [replace(c, position=tuple(POINT)) for c in SENSORS[:3]]
    Rf = rigid([np.subtract(c.position, POINT) for c in IMPACTS], [np.array(c.direction) for c in IMPACTS])
    H = np.broadcast_to(np.linalg.inv(MASS) @ Rf.T, (len(HZ), 6, 9)).astype(complex)
    found = fx.virtual_points(given(HZ, H, IMPACTS, [*centred, *gyros]), {"tip": tuple(POINT)})
    assert np.allclose(found.response, np.linalg.inv(MASS), rtol=1e-8, atol=1e-3)


def test_scatter_at_the_point_is_that_of_repeated_noise():
    """2000 draws as so many lines."""
    rng, count = np.random.default_rng(5), 2000
    hz = np.full(count, 50.0) * (1 + 1e-9 * np.arange(count))
    true = np.repeat(measured().response[:1], count, axis=0)
    noise = (rng.standard_normal(true.shape) + 1j * rng.standard_normal(true.shape)) / np.sqrt(2)
    noisy = given(hz, true + 0.01 * np.abs(true) * noise, IMPACTS, SENSORS)
    told = fx.virtual_points(given(hz, true, IMPACTS, SENSORS), {"tip": tuple(POINT)}, noise=0.01)
    found = fx.virtual_points(noisy, {"tip": tuple(POINT)})
    assert told.sigma is not None
    spread = np.sqrt((np.abs(found.response - told.response) ** 2).mean(axis=0))
    assert np.abs(spread / told.sigma[0] - 1).max() < 0.1


def line(quantity, name, e):
    return [Channel(f"{name}{k}", quantity, "tip", e, (0.04 + 0.01 * k, 0.01, 0.062)) for k in range(7)]


SLANTED = tuple(np.ones(3) / np.sqrt(3))
ON_A_LINE = [c for axis in np.eye(3) for c in line("acceleration", f"s{axis.argmax()}", tuple(axis))]
BAD = [
    (SENSORS[:5], "5 sensors for 6 DOFs (tx, ty, tz, rx, ry, rz): it takes 6 at least"),
    (ON_A_LINE, "its 21 sensors do not tell apart rx: they are on one line"),
    ([replace(c, direction=(0.0, 0.0, 1.0)) for c in SENSORS], "do not tell apart tx, ty, rz"),
    ([replace(SENSORS[0], position=None), *SENSORS[1:]], "output s1.x has no position"),
    ([replace(SENSORS[0], direction=None), *SENSORS[1:]], "output s1.x has no direction"),
    ([replace(SENSORS[0], quantity="stress"), *SENSORS[1:]], "output s1.x is no a motion of one place, but stress"),
    ([replace(SENSORS[0], quantity="velocity"), *SENSORS[1:]], "of several kinds: velocity, acceleration"),
    ([replace(c, node="top") for c in SENSORS], "no output is at a node of this name; nodes: top"),
]


@pytest.mark.parametrize(("sensors", "text"), BAD)
def test_interfaces_that_do_not_determine_a_point_are_refused_with_their_place(sensors, text):
    data = given(HZ, np.ones((len(HZ), len(sensors), 9), dtype=complex), IMPACTS, sensors)
    with pytest.raises(fx.OptionError) as error:
        fx.virtual_points(data, {"tip": tuple(POINT)})
    assert "virtual point tip: " in str(error.value) and text in str(error.value)


def test_sensors_nearly_on_a_line_are_warned_of():
    near = [replace(c, position=(c.position[0], 0.01 + 1e-4 * (k % 2), 0.062)) for k, c in enumerate(ON_A_LINE)]
    found = fx.virtual_points(measured(near), {"tip": tuple(POINT)})
    assert [(w.kind, w.place) for w in found.warnings] == [("condition", "tip")]


@pytest.mark.parametrize(
    ("points", "text"),
    [
        ({}, "there is no virtual point"),
        ({"tip": (0.0, 1.0)}, "a position is three numbers"),
        ({"tip": fx.VirtualPoint(tuple(POINT), ("tx", "tx"))}, "DOFs are some of"),
        ({"tip": fx.VirtualPoint(tuple(POINT), DOFS, ("p*",))}, "there is no output 'p*'"),
        ({"tip": tuple(POINT), "two": fx.VirtualPoint(tuple(POINT), DOFS, ("s*",))}, "belongs to virtual point tip"),
    ],
)
def test_points_that_make_no_sense_are_refused(points, text):
    with pytest.raises(fx.OptionError) as error:
        fx.virtual_points(measured(), points)
    assert text in str(error.value)


def test_measured_data_of_a_file_have_what_it_takes():
    inputs, outputs = (
        tuple(MeasuredChannel(c.name, c.quantity, c.node, c.direction, c.position) for c in side)
        for side in (IMPACTS, SENSORS)
    )
    test = fx.Measurement("body", (), (MeasuredFRF(HZ, measured().response, inputs, outputs),))
    found = fx.virtual_points(test, {"tip": tuple(POINT)})
    assert found.name == "body" and np.allclose(found.response, np.linalg.inv(MASS), rtol=1e-8, atol=1e-3)
