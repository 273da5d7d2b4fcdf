"""Stiffness about displaced states and the drift of axes against closed forms and buckling loads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import flexura as fx
from flexura.analysis.strain.tangent import drift, screw_axis, tangent_stiffness
from flexura.linalg import is_definite

EXAMPLES = Path(__file__).parents[2] / "examples"
STEEL = fx.describe.Material(E=200e9, nu=0.3, rho=7800.0)
L, B, T = 0.05, 0.01, 0.0005
EI = 200e9 * B * T**3 / 12


def leaf(a, b, elements=1, width=B, thickness=T, **more):
    """A leaf whose thickness is along global y."""
    section = fx.describe.Rectangle(width=width, thickness=thickness)
    return fx.describe.Link(
        nodes=(a, b), material="steel", section=section, reference=(0, 1, 0), elements=elements, **more
    )


def built(nodes, links, **more):
    """A mechanism clamped at `a`."""
    data = {"theory": "euler_bernoulli", "ground": {"a": "clamped"}}
    return fx.Mechanism(materials={"steel": STEEL}, corrections="none", nodes=nodes, links=links, **(data | more))


def cantilever(elements=1, length=L, **more):
    """A leaf from a along x to b."""
    return built({"a": (0, 0, 0), "b": (length, 0, 0)}, {"leaf": leaf("a", "b", elements)}, **more)


def guide(elements=1):
    """A stage on two parallel leaves along x, 40 mm apart."""
    nodes = {"a": (0, 0, 0), "b": (L, 0, 0), "c": (0, 0.04, 0), "d": (L, 0.04, 0)}
    stage = fx.describe.RigidBody(centre=(L + 0.01, 0.02, 0), carries=("b", "d"), mass=0.1, inertia=(1e-5, 1e-5, 1e-5))
    links = {"one": leaf("a", "b", elements), "two": leaf("c", "d", elements)}
    return built(nodes, links, bodies={"stage": stage}, ground={"a": "clamped", "c": "clamped"})


def displaced(mechanism, **loads):
    """Model and linear displacements under loads by node."""
    state = fx.preload(mechanism, loads=loads)
    return state.model, state.displacement_vector


@pytest.mark.parametrize("elements", [1, 4])
@pytest.mark.parametrize("d", [1e-4, 2e-3])
def test_parallel_guide_sinks_by_three_fifths(elements, d):
    """x = -3/5 d^2/L, whose slope is -6/5 d/L."""
    model, u = displaced(guide(elements), stage=(0, 24 * EI / L**3 * d, 0, 0, 0, 0))
    found = drift(model, u, node="stage", load=(0, 1.0, 0, 0, 0, 0))
    x, y = found.twists[1][:2]
    assert x / y == pytest.approx(-6 / 5 * d / L, rel=5e-4)
    assert found.twists[1][1] == pytest.approx(found.twists[0][1], rel=5e-4)


def test_translation_tilts():
    """A guide that turns nothing at all: its one freedom is a translation, whose direction tilts by 6 d/5 L."""
    stiff = fx.describe.Spring(nodes=("stage",), stiffness=fx.describe.DiagonalStiffness(rx=1e12, ry=1e12, rz=1e12))
    mechanism = guide().model_copy(update={"springs": {"hold": stiff}})
    d = 1e-3
    model, u = displaced(mechanism, stage=(0, 24 * EI / L**3 * d, 0, 0, 0, 0))
    found = drift(model, u, node="stage", load=(0, 1.0, 0, 0, 0, 0))
    assert found.rest.is_translation and found.displaced.is_translation
    assert found.tilt == pytest.approx(np.arctan(6 / 5 * d / L), rel=1e-3)
    assert found.shift == (0, 0, 0) and found.distance == 0
    np.testing.assert_allclose(found.rest.direction, (0, 1, 0), atol=1e-6)


@pytest.mark.parametrize("elements", [1, 4])
def test_cantilever_tip_path(elements):
    """Under a force the tip sinks by 3/5 d^2/L as well, and turns by 3/2 d/L."""
    d = 1e-3
    model, u = displaced(cantilever(elements), b=(0, 3 * EI / L**3 * d, 0, 0, 0, 0))
    x, y, *_, turn = drift(model, u, node="b", load=(0, 1.0, 0, 0, 0, 0)).twists[1]
    assert x / y == pytest.approx(-6 / 5 * d / L, rel=1e-3)
    assert turn / y == pytest.approx(3 / (2 * L), rel=1e-3)


@pytest.mark.parametrize("elements", [1, 4])
def test_leaf_pivot_drifts_by_a_sixth(elements):
    """A leaf bent into an arc: its end turns about (L/2, 0) at rest and (L/2, L theta/6) then, with theta small."""
    angle = 0.02
    model, u = displaced(cantilever(elements), b=(0, 0, 0, 0, 0, EI * angle / L))
    found = drift(model, u, node="b", load=(0, 0, 0, 0, 0, 1.0))
    np.testing.assert_allclose(found.rest.point, (L / 2, 0, 0), atol=1e-9)
    np.testing.assert_allclose(found.rest.direction, (0, 0, 1), atol=1e-9)
    np.testing.assert_allclose(found.shift, (0, L * angle / 6, 0), atol=L * angle**2 / 10)
    assert found.distance == pytest.approx(L * angle / 6, rel=1e-3)
    assert found.tilt < 1e-9 and abs(found.displaced.pitch) < 1e-9


@pytest.mark.parametrize("web", [0.3e-3, 1e-3])
def test_notch_pivot_stays_at_the_notch(web):
    """A body on a notch of rotation density w(s) turns about its middle, and when turned about a point
    theta/2 int int |s - s'| w w' aside: far less than the notch is long."""
    R, angle = 4e-3, 0.02
    profile = fx.describe.Notch(width=B, contour=fx.describe.CircularContour(radius=R, web=web))
    flexure = fx.describe.Flexure(
        nodes=("a", "b"), material="steel", profile=profile, reference=(0, 1, 0), elements=40, integration="tapered"
    )
    body = fx.describe.RigidBody(centre=(0.04, 0.01, 0), carries=("b",), mass=0.1, inertia=(1e-5, 1e-5, 1e-5))
    nodes = {"a": (0, 0, 0), "b": (2 * R, 0, 0)}
    model = fx.assemble(built(nodes, {}, flexures={"notch": flexure}, bodies={"body": body}))
    s = (np.arange(800) + 0.5) / 400 * R
    w = (web + 2 * (R - np.sqrt(R**2 - (s - R) ** 2))) ** -3
    w /= w.sum()
    load = np.zeros(model.order)
    load[model.dof_names.index("body.rz")] = 1.0
    u = np.linalg.solve(model.K.toarray(), load)
    u *= angle / u[model.dof_names.index("body.rz")]
    found = drift(model, u, node="body", load=(0, 0, 0, 0, 0, 1.0))
    np.testing.assert_allclose(found.rest.point[:2], (R, 0), atol=1e-8)
    aside = angle / 2 * (w[:, None] * w * np.abs(s[:, None] - s)).sum()
    assert found.shift[1] == pytest.approx(aside, rel=2e-3)
    assert aside < 2 * R * angle / 12


def test_blade_bent_in_its_plane_buckles_sideways():
    """4.0126 sqrt(EI GJ)/L^2 at the tip of a deep cantilever, Timoshenko & Gere (1961), Sec. 6.3."""
    length, width, thickness = 0.3, 0.02, 0.0002
    G, I = 200e9 / 2.6, width * thickness**3 / 12  # noqa: E741
    exact = 4.0126 * np.sqrt(200e9 * I * G * width * thickness**3 / 3 * (1 - 0.63 * thickness / width)) / length**2
    errors = []
    for elements in (4, 8, 16):
        blade = {"blade": leaf("a", "b", elements, width, thickness)}
        model, u = displaced(built({"a": (0, 0, 0), "b": (length, 0, 0)}, blade), b=(0, 0, exact, 0, 0, 0))
        low, high = 0.9, 1.3
        for _ in range(14):
            middle = (low + high) / 2
            low, high = (middle, high) if is_definite(tangent_stiffness(model, middle * u)) else (low, middle)
        errors.append(low - 1)
    assert errors[0] / errors[1] == pytest.approx(4, abs=0.4)
    assert errors[2] + (errors[2] - errors[1]) / 3 == pytest.approx(0, abs=6e-4)


@pytest.mark.parametrize("arm", [0.03, 0.1])
def test_dead_load_on_a_rigid_arm(arm):
    """A column with a rigid arm beyond its tip, pushed at the end of the arm: x a tan(x L) = 1."""
    head = fx.describe.RigidBody(centre=(L + arm / 3, 0, 0), carries=("b", "end"), mass=0.1, inertia=(1e-5, 1e-5, 1e-5))
    nodes = {"a": (0, 0, 0), "b": (L, 0, 0), "end": (L + arm, 0, 0)}
    column = built(nodes, {"leaf": leaf("a", "b", 8)}, bodies={"head": head})
    k = brentq(lambda x: x * arm * np.tan(x * L) - 1, 1e-6, 0.999 * np.pi / (2 * L))
    for factor, stands in ((0.999, True), (1.001, False)):
        push = {"end": (-factor * k**2 * EI, 0, 0, 0, 0, 0)}
        model, u = displaced(column, **push)
        assert is_definite(tangent_stiffness(model, u, loads=push)) == stands


def test_a_free_mechanism_stays_free():
    """However far it is turned as a whole, an ungrounded mechanism keeps six motions without stiffness, and no more."""
    model = fx.assemble(guide(2).model_copy(update={"ground": {}}))
    u = model.rigid_body_motions() @ np.array([0.1, 0.2, 0.3, 0.3, -0.2, 0.4])
    scale = 1 / np.sqrt(model.K.diagonal())
    values = np.linalg.eigvalsh(scale[:, None] * tangent_stiffness(model, u).toarray() * scale)
    assert np.abs(values[:6]).max() < 1e-12
    assert values[6] > 1e-6


def test_mirrored_copies_drift_alike():
    """A guide of which one half is the mirror image of the other."""
    half = fx.describe.Substructure(
        nodes={"foot": (0, 0.02, 0), "top": (L, 0.02, 0)},
        links={"leaf": leaf("foot", "top")},
        interface=("foot", "top"),
    )
    stage = fx.describe.RigidBody(centre=(L + 0.01, 0, 0), carries=("half*.top",), mass=0.1, inertia=(1e-5, 1e-5, 1e-5))
    mechanism = fx.Mechanism(
        materials={"steel": STEEL},
        theory="euler_bernoulli",
        corrections="none",
        substructures={"half": half},
        instances={"half": fx.describe.Instance(of="half", pattern=fx.describe.MirrorPattern(normal=(0, 1, 0)))},
        bodies={"stage": stage},
        ground={"half*.foot": "clamped"},
    )
    d = 1e-3
    load = {"stage": (0, 24 * EI / L**3 * d, 0, 1e-3, 2e-3, 0)}
    model, u = displaced(mechanism, **load)
    other_model, other_u = displaced(guide(), **load)
    for own in np.eye(6):
        found, expected = drift(model, u, node="stage", load=own), drift(other_model, other_u, node="stage", load=own)
        np.testing.assert_allclose(found.twists, expected.twists, rtol=1e-6, atol=1e-9 * np.abs(expected.twists).max())


@pytest.mark.parametrize(
    ("file", "move", "far"),
    [
        ("pivot/pivot.yaml", "arm.ry", 1e-3),
        ("guide/guide.yaml", "carriage.x", 1e-4),
        ("rpr/rpr.yaml", "platform.rx", 1e-3),
        ("rpr/rpr.yaml", "platform.ry", 1e-3),
    ],
)
def test_drift_is_the_derivative_of_a_stroke(file, move, far):
    """Differences of axes between the ends of a small stroke, whose states are in equilibrium."""
    model = fx.assemble(fx.load(EXAMPLES / file))
    node, axis = move.split(".")
    load = np.array([axis == name for name in ("x", "y", "z", "rx", "ry", "rz")], dtype=float)
    u = fx.preload(model, loads={node: load}).displacement_vector
    u *= far / (load @ model.design.node_rows(model.plan.topology.numbers([node])) @ u)
    points = [np.array(drift(model, sign * u, node=node, load=load).displaced.point) for sign in (-1, 1)]
    ends = fx.stroke(model, move={move: (-far, far)}, steps=3, n=1).poses[::2]
    exact = [np.array(pose.screw_axis[move].point) for pose in ends]
    apart = np.subtract(*points) - np.subtract(*exact)
    assert np.abs(apart).max() < 1e-3 * np.abs(np.subtract(*exact)).max()


def test_screw_axis_of_a_helix():
    axis = screw_axis((0, 0.2, 0.03, 0, 0, 1.0), at=(0.5, 0, 0), near=(9, 9, 7))
    assert axis.point == pytest.approx((0.3, 0, 7))
    assert axis.direction == (0, 0, 1) and axis.pitch == pytest.approx(0.03)
    assert not axis.is_translation


def test_screw_axis_does_not_depend_on_the_point():
    rng = np.random.default_rng(3)
    twist, at, other, near = rng.normal(size=6), *rng.normal(size=(3, 3))
    moved = np.hstack([twist[:3] + np.cross(twist[3:], other - at), twist[3:]])
    one, two = screw_axis(twist, near, at=at), screw_axis(2 * moved, near, at=other)
    np.testing.assert_allclose(one.point, two.point, atol=1e-12)
    assert one.pitch == pytest.approx(two.pitch)
    assert np.dot(np.subtract(near, one.point), one.direction) == pytest.approx(0, abs=1e-12)
    velocity = twist[:3] + np.cross(twist[3:], np.array(one.point) - at)
    np.testing.assert_allclose(velocity, one.pitch * twist[3:], atol=1e-12)


def test_pure_translation():
    axis = screw_axis((0, -2.0, 0, 1e-9, 0, 0), near=(1, 2, 3))
    assert axis.is_translation and axis.direction == (0, -1, 0) and axis.point == (1, 2, 3)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: screw_axis((0, 0, 0, 0, 0, 0)), "no axis"),
        (lambda m: screw_axis((1, 2)), "6 finite numbers"),
        (lambda m: tangent_stiffness(m, np.zeros(2)), "6 finite numbers"),
        (lambda m: drift(m, np.zeros(6), node="nowhere", load=np.ones(6)), "there is no node"),
        (lambda m: drift(m, np.zeros(6), node="b", load=np.ones(5)), "6 finite numbers"),
        (lambda m: tangent_stiffness(m, np.zeros(6), loads={"nowhere": np.ones(6)}), "there is no node"),
    ],
)
def test_what_cannot_be_is_refused(call, words):
    with pytest.raises(fx.OptionError, match=words):
        call(fx.assemble(cantilever()))


def test_springs_on_arms_are_refused():
    stage = fx.describe.Spring(nodes=("d",), stiffness=fx.describe.DiagonalStiffness(tx=1e3))
    model = fx.assemble(guide().model_copy(update={"springs": {"side": stage}}))
    with pytest.raises(fx.OptionError, match="off a body's centre"):
        tangent_stiffness(model, np.zeros(model.order))


def test_what_moves_freely_has_no_drift():
    model = fx.assemble(cantilever(ground={}))
    with pytest.raises(fx.SolverError, match="move freely"):
        drift(model, np.zeros(model.order), node="b", load=(0, 1, 0, 0, 0, 0))
