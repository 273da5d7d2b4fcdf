"""Frequency response against closed forms: one and two degrees of freedom, cantilevers, moving and turning ground."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from helpers.oscillators import (
    AREA,
    DOFS,
    INERTIA,
    LENGTH,
    MASS,
    RHO,
    SIZE,
    STIFFNESS,
    E,
    K,
    beam,
    body,
    natural,
    oscillator,
    pair,
    pair_poles,
    pair_receptance,
    stiffness,
    tip_receptance,
    tip_transmissibility,
)
from helpers.over import over

HZ = np.array([0.5, 3.0, 11.0, 15.7, 20.0, 27.0, 45.0, 300.0])
W = 2 * np.pi * HZ
DASH = (5.0, 2.0, 9.0, 1e-3, 4e-3, 2e-3)
ROUTES = [("low", "modal"), ("full", "modal"), ("low", "direct"), ("full", "direct"), ("exact", "modal")]
RIGHT = 1e-11


def worst(found, reference):
    """The largest relative difference."""
    return float(np.max(np.abs(found - reference) / np.abs(reference)))


@pytest.mark.parametrize(("order", "method"), ROUTES)
@over(("quantity", "power"), [("receptance", 0), ("mobility", 1), ("accelerance", 2)])
def test_oscillator_on_dashpots(order, method, quantity, power):
    """(i w)^p / (k - m w^2 + i w c) along and about every axis."""
    found = fx.frequency_response(oscillator(DASH), frequency_hz=HZ, quantity=quantity, order=order, method=method)
    for dof, c in zip(DOFS, DASH, strict=True):
        reference = (1j * W) ** power / (STIFFNESS[dof] - SIZE[dof] * W**2 + 1j * W * c)
        assert worst(found.of(f"mass.{dof}", f"mass.{dof}"), reference) < RIGHT
    assert abs(found.of("mass.tx", "mass.ty")).max() < 1e-14 * abs(found.response).max()


@pytest.mark.parametrize(("order", "method"), ROUTES)
def test_oscillator_with_structural_damping(order, method):
    """1 / (k (1 + i eta) - m w^2)."""
    found = fx.frequency_response(
        oscillator(damping={"loss_factor": 0.06}), frequency_hz=HZ, order=order, method=method
    )
    for dof in DOFS:
        reference = 1 / (STIFFNESS[dof] * (1 + 0.06j) - SIZE[dof] * W**2)
        assert worst(found.of(f"mass.{dof}", f"mass.{dof}"), reference) < RIGHT


@pytest.mark.parametrize(("order", "method"), ROUTES)
def test_oscillator_with_rayleigh_damping(order, method):
    """c = alpha m + beta k with zeta = (alpha/w + beta w)/2 at both frequencies."""
    low, high = 2 * np.pi * np.array([10.0, 40.0])
    beta = 2 * (0.05 * high - 0.03 * low) / (high**2 - low**2)
    alpha = 2 * 0.03 * low - beta * low**2
    damping = {"rayleigh": {"frequencies": (10.0, 40.0), "ratios": (0.03, 0.05)}}
    found = fx.frequency_response(oscillator(damping=damping), frequency_hz=HZ, order=order, method=method)
    for dof in DOFS:
        c = alpha * SIZE[dof] + beta * STIFFNESS[dof]
        reference = 1 / (STIFFNESS[dof] - SIZE[dof] * W**2 + 1j * W * c)
        assert worst(found.of(f"mass.{dof}", f"mass.{dof}"), reference) < RIGHT


@pytest.mark.parametrize("order", ["low", "full"])
@pytest.mark.parametrize("damping", [0.02, {"ratio": 0.02}, fx.describe.Damping(ratio=0.02)])
def test_oscillator_with_modal_damping(order, damping):
    """1 / (m (w0^2 + 2 i zeta w0 w - w^2))."""
    found = fx.frequency_response(oscillator(), frequency_hz=HZ, order=order, damping=damping)
    for dof in DOFS:
        w0 = natural(dof)
        reference = 1 / (SIZE[dof] * (w0**2 + 2j * 0.02 * w0 * W - W**2))
        assert worst(found.of(f"mass.{dof}", f"mass.{dof}"), reference) < RIGHT
    assert found.ratios == pytest.approx(np.full(6, 0.02), rel=1e-12)
    assert found.resonances_hz == pytest.approx(sorted(natural(d) / (2 * np.pi) for d in DOFS), rel=1e-12)


@pytest.mark.parametrize(("order", "method"), ROUTES)
@over("dof", DOFS)
def test_transmissibility_of_an_oscillator(order, method, dof):
    """(k + i w c)/(k - m w^2 + i w c): absolute motion of a body over that of the ground it stands on."""
    found = fx.frequency_response(
        oscillator(DASH),
        frequency_hz=HZ,
        inputs=f"ground.{dof}",
        outputs=f"mass.{dof}",
        quantity="transmissibility",
        order=order,
        method=method,
    )
    k = STIFFNESS[dof] + 1j * W * DASH[DOFS.index(dof)]
    assert worst(found.response[:, 0, 0], k / (k - SIZE[dof] * W**2)) < RIGHT
    assert found.unit(f"mass.{dof}", f"ground.{dof}") == "1"


@pytest.mark.parametrize(("order", "method"), ROUTES)
def test_relative_displacement_and_absolute_acceleration_over_a_moving_ground(order, method):
    """A seismometer: z = -1/(w0^2 - w^2 + i w c/m) per unit acceleration, and a = 1 - w^2 z."""
    found = fx.frequency_response(
        oscillator(DASH), frequency_hz=HZ, inputs=["ground.ty"],
        outputs=["mass.ty", "mass.ty:velocity", "mass.ty:acceleration"],
        order=order, method=method,
    )  # fmt: skip
    z = -MASS / (STIFFNESS["ty"] - MASS * W**2 + 1j * W * DASH[1])
    assert worst(found.of("mass.ty", "ground.ty"), z) < RIGHT
    assert worst(found.of("mass.ty:velocity", "ground.ty"), 1j * W * z) < RIGHT
    assert worst(found.of("mass.ty:acceleration", "ground.ty"), 1 - W**2 * z) < RIGHT


@pytest.mark.parametrize(("order", "method"), ROUTES)
def test_ground_turning_about_a_point(order, method):
    """Points of the ground move along d x (x - p); the body follows as it follows translations and rotations."""
    at, p, d = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.4, -0.3]), np.array([2.0, -1.0, 0.5])
    turn = fx.describe.BaseRotation(direction=tuple(d), point=tuple(p))
    described = oscillator(DASH, tuple(at), actuators={"shake": turn})
    outputs = [f"mass.{dof}:acceleration" for dof in DOFS]
    found = fx.frequency_response(
        described, frequency_hz=HZ, inputs="shake", outputs=outputs, order=order, method=method
    )
    d = d / np.linalg.norm(d)
    carried = np.concatenate([np.cross(d, at - p), d])
    for dof, c, a in zip(DOFS, DASH, carried, strict=True):
        k = STIFFNESS[dof] + 1j * W * c
        assert worst(found.of(f"mass.{dof}:acceleration", "shake"), a * k / (k - SIZE[dof] * W**2)) < RIGHT
    about = fx.frequency_response(
        described, frequency_hz=HZ, inputs="ground.rx", outputs="mass.tz", quantity="transmissibility", order=order
    )
    k = STIFFNESS["tz"] + 1j * W * DASH[2]
    assert worst(about.response[:, 0, 0], at[1] * k / (k - MASS * W**2)) < RIGHT


@pytest.mark.parametrize(("order", "method"), ROUTES)
def test_two_bodies_with_damping_that_couples_modes(order, method):
    """The inverse of the 2 x 2 dynamic stiffness."""
    nodes = ["one.tx", "two.tx"]
    found = fx.frequency_response(pair(), frequency_hz=HZ, inputs=nodes, outputs=nodes, order=order, method=method)
    assert np.abs(found.response - pair_receptance(W)).max(axis=0) == pytest.approx(0, abs=1e-11 * 1e-3)
    assert worst(found.response, pair_receptance(W)) < 1e-10


def test_poles_of_two_bodies():
    """Complex poles are the roots of the characteristic polynomial of fourth degree."""
    modes = fx.system(pair(), inputs=["one.tx"], outputs=["two.tx"]).modal()
    assert not modes.is_proportional
    for pole in pair_poles():
        assert np.abs(modes.complex_modes.poles - pole).min() < 1e-11 * abs(pole)
    found = fx.frequency_response(pair(), band=(1.0, 40.0), inputs="one.tx", outputs="two.tx")
    for pole in pair_poles():
        k = np.abs(found.resonances_hz - abs(pole) / (2 * np.pi)).argmin()
        assert found.resonances_hz[k] == pytest.approx(abs(pole) / (2 * np.pi), rel=1e-11)
        assert found.ratios[k] == pytest.approx(-pole.real / abs(pole), rel=1e-10)
        assert found.resonances_hz[k] in found.frequency_hz


@pytest.mark.parametrize(("order", "method"), ROUTES)
@over("c2", [0.0, 6.0, 60.0])
def test_floating_pair(order, method, c2):
    """Two bodies in space: (k2 - m2 w^2)/(-w^2 (k2 (m1 + m2) - m1 m2 w^2)) and so on, with k2 + i w c2."""
    m1, m2 = 0.4, 0.15
    k = 2.5e3 + 1j * W * c2
    below = -(W**2) * (k * (m1 + m2) - m1 * m2 * W**2)
    nodes = ["one.tx", "two.tx"]
    found = fx.frequency_response(
        pair(c2=c2, grounded=False), frequency_hz=HZ, inputs=nodes, outputs=nodes, order=order, method=method
    )
    assert worst(found.of("one.tx", "one.tx"), (k - m2 * W**2) / below) < 1e-10
    assert worst(found.of("two.tx", "one.tx"), k / below) < 1e-10


@pytest.mark.parametrize(("order", "method"), ROUTES)
def test_critically_damped_oscillator(order, method):
    """1/(m (w0 + i w)^2), where no complex modes exist."""
    c = tuple(2 * np.sqrt(STIFFNESS[d] * SIZE[d]) for d in DOFS)
    found = fx.frequency_response(oscillator(c), frequency_hz=HZ, order=order, method=method)
    for dof in DOFS:
        assert worst(found.of(f"mass.{dof}", f"mass.{dof}"), 1 / (SIZE[dof] * (natural(dof) + 1j * W) ** 2)) < RIGHT


BEAM_HZ = np.array([1.0, 60.0, 180.0, 250.0, 700.0, 1500.0, 3500.0])
BEAM_W = 2 * np.pi * BEAM_HZ
EXACT = 1e-9


@pytest.mark.parametrize(("eta", "alpha", "beta"), [(0.0, 0, 0), (0.05, 0, 0), (0.0, 40.0, 3e-6), (0.02, 40.0, 3e-6)])
def test_tip_of_a_cantilever_is_exact(eta, alpha, beta):
    """Bishop and Johnson's receptance, whatever the number of elements."""
    low, high = 2 * np.pi * np.array([100.0, 2000.0])
    ratios = [float(alpha / w + beta * w) / 2 for w in (low, high)]
    damping = {"rayleigh": {"frequencies": (100.0, 2000.0), "ratios": ratios}, "loss_factor": eta}
    described = beam(2, damping=damping if alpha or eta else {})
    found = fx.frequency_response(described, frequency_hz=BEAM_HZ, inputs="b.tz", outputs="b.tz", order="exact")
    assert worst(found.response[:, 0, 0], tip_receptance(BEAM_W, eta, alpha, beta)) < EXACT


def test_cantilever_with_a_loss_factor_of_its_material_is_exact():
    """The loss factor of a material means the same as that of everything."""
    found = fx.frequency_response(beam(2, eta=0.04), frequency_hz=BEAM_HZ, inputs="b.tz", outputs="b.tz", order="exact")
    assert worst(found.response[:, 0, 0], tip_receptance(BEAM_W, 0.04)) < EXACT


def test_cantilever_on_a_moving_clamp_is_exact():
    """Bending and stretching: (cos x + cosh x)/(1 + cos x cosh x) and 1/cos(w L/c)."""
    described = beam(2, eta=0.03)
    found = fx.frequency_response(
        described, frequency_hz=BEAM_HZ, inputs="ground.tz", outputs="b.tz", quantity="transmissibility", order="exact"
    )
    assert worst(found.response[:, 0, 0], tip_transmissibility(BEAM_W, 0.03)) < EXACT
    hz = BEAM_HZ * 10
    found = fx.frequency_response(
        described, frequency_hz=hz, inputs="ground.tx", outputs="b.tx", quantity="transmissibility", order="exact"
    )
    x = 2 * np.pi * hz * LENGTH / np.sqrt(E * (1 + 0.03j) / RHO)
    assert worst(found.response[:, 0, 0], 1 / np.cos(x)) < EXACT


def test_stretching_bar_is_exact():
    """tan(x)/(E A x/L)."""
    hz = np.array([10.0, 4e3, 2e4, 5e4])
    x = 2 * np.pi * hz * LENGTH / np.sqrt(E / RHO)
    found = fx.frequency_response(beam(1), frequency_hz=hz, inputs="b.tx", outputs="b.tx", order="exact")
    assert worst(found.response[:, 0, 0], np.tan(x) / (E * AREA * x / LENGTH)) < EXACT


@pytest.mark.parametrize("every_mode", [True, False])
def test_cantilever_of_elements_converges(every_mode):
    """Cubic elements: relative errors of receptance fall with the fourth power of their length."""
    errors = []
    for elements in (8, 16, 32):
        built = fx.system(beam(elements, eta=0.05), inputs="b.tz", outputs="b.tz", order="full")
        if every_mode:
            H = built.modal().response(BEAM_HZ)
        else:
            H = fx.frequency_response(built, frequency_hz=BEAM_HZ, method="direct").response
        errors.append(worst(H[:, 0, 0], tip_receptance(BEAM_W, 0.05)))
    assert errors[2] < 3e-5
    assert 13 < errors[0] / errors[1] < 19 and 13 < errors[1] / errors[2] < 19


@pytest.mark.parametrize("order", ["low", "full"])
def test_cantilever_with_few_modes(order):
    """Modes up to a few times the highest frequency asked for, and the static gain of the others."""
    found = fx.frequency_response(beam(16), frequency_hz=BEAM_HZ, inputs="b.tz", outputs="b.tz", order=order)
    reference = tip_receptance(BEAM_W).real
    error = np.abs(found.response[:, 0, 0] - reference) / np.abs(reference)
    assert error[0] < 1e-10 and error[:-1].max() < 3e-4 and error[-1] < 3e-3
    assert found.order < 40 < fx.assemble(beam(16)).order
    moved = fx.frequency_response(
        beam(16), frequency_hz=BEAM_HZ, inputs="ground.tz", outputs="b.tz", quantity="transmissibility", order=order
    )
    assert worst(moved.response[:, 0, 0], tip_transmissibility(BEAM_W)) < 1e-3


@pytest.mark.parametrize("order", ["low", "full", "exact"])
def test_everything_follows_a_slow_ground(order):
    """Absolute transmissibility of what stands on springs and beams goes to one at low frequency."""
    far = (LENGTH, 0.02, 0.01)
    bodies = {"stage": fx.describe.RigidBody(centre=far, carries=("b",), mass=0.2, inertia=INERTIA)}
    springs = {"prop": fx.describe.Spring(nodes=("stage",), stiffness=stiffness())}
    described = beam(4, bodies=bodies, springs=springs, damping={"loss_factor": 0.02})
    inputs, outputs = [f"ground.{d}" for d in DOFS], [f"stage.{d}" for d in DOFS]
    found = fx.frequency_response(
        described, frequency_hz=1e-2, inputs=inputs, outputs=outputs, quantity="transmissibility", order=order
    )
    arm = np.array([[0, far[2], -far[1]], [-far[2], 0, far[0]], [far[1], -far[0], 0]])
    rigid = np.block([[np.eye(3), arm], [np.zeros((3, 3)), np.eye(3)]])
    assert np.abs(found.response[0] - rigid).max() < 1e-6


def test_unit_and_plain_data():
    """Units of motion over force, and lists that hold what the arrays do."""
    found = fx.frequency_response(
        oscillator(DASH), frequency_hz=HZ, inputs=["mass.tx", "mass.rx"], outputs=["mass.tx", "mass.rx:velocity"]
    )
    assert found.unit("mass.tx", "mass.tx") == "m/N"
    assert found.unit("mass.rx:velocity", "mass.rx") == "(rad/s)/(N*m)"
    data = found.to_dict()
    assert np.array_equal(np.array(data["real"]) + 1j * np.array(data["imaginary"]), found.response)
    assert data["frequency_hz"] == HZ.tolist() and data["resonances_hz"] == found.resonances_hz.tolist()


def test_undamped_resonance_is_refused():
    """At its own frequency an undamped oscillator has no finite response."""
    even = {"s": fx.describe.Spring(nodes=("mass",), stiffness=stiffness((4 * MASS, *K[1:])))}
    described = oscillator(bodies={"mass": body()}, springs=even)
    for method in ("modal", "direct"):
        near = fx.frequency_response(
            described, frequency_hz=2.1 / (2 * np.pi), inputs="mass.tx", outputs="mass.tx", method=method
        )
        assert near.response[0, 0, 0] == pytest.approx(1 / (MASS * (4 - 2.1**2)), rel=1e-12)
        with pytest.raises(fx.SolverError, match="undamped resonance"):
            fx.frequency_response(
                described, frequency_hz=2 / (2 * np.pi), inputs="mass.tx", outputs="mass.tx", method=method
            )


@over(
    ("arguments", "message"),
    [
        ({"frequency_hz": [1.0, 0.0]}, "positive finite"),
        ({"frequency_hz": [1.0, -2.0]}, "-2"),
        ({"frequency_hz": [np.inf]}, "positive finite"),
        ({"frequency_hz": [np.nan]}, "positive finite"),
        ({"frequency_hz": []}, "positive finite"),
        ({"frequency_hz": [[1.0, 2.0]]}, "positive finite"),
        ({}, "either frequencies or a band"),
        ({"frequency_hz": 1.0, "band": (1, 2)}, "either frequencies or a band"),
        ({"band": (5.0, 1.0)}, "0 < from < to"),
        ({"band": (0.0, 1.0)}, "0 < from < to"),
        ({"band": (1.0, np.nan)}, "0 < from < to"),
        ({"band": (1.0, 2.0), "points": 1}, "points"),
        ({"frequency_hz": 1.0, "inputs": "mass.tw"}, "no input 'mass.tw'"),
        ({"frequency_hz": 1.0, "inputs": "body.tx"}, "no input 'body.tx'"),
        ({"frequency_hz": 1.0, "outputs": "ground.tx"}, "ground.tx is an input"),
        ({"frequency_hz": 1.0, "outputs": "mass.tx:jerk"}, "after the colon"),
        ({"frequency_hz": 1.0, "inputs": ["mass.tx", "mass.tx"]}, "named twice"),
        ({"frequency_hz": 1.0, "outputs": "mas*"}, "no output matches"),
        ({"frequency_hz": 1.0, "inputs": [3]}, "named by text"),
        ({"frequency_hz": 1.0, "quantity": "jerk"}, "quantity is one of"),
        ({"frequency_hz": 1.0, "quantity": "transmissibility"}, "ground.tx"),
        ({"frequency_hz": 1.0, "order": "medium"}, "order is low, full or exact"),
        ({"frequency_hz": 1.0, "method": "magic"}, "method is modal or direct"),
        ({"frequency_hz": 1.0, "order": "exact", "damping": 0.01}, "damping ratios"),
        ({"frequency_hz": 1.0, "damping": 1.0}, "damping"),
        ({"frequency_hz": 1.0, "damping": -0.1}, "damping"),
        ({"frequency_hz": 1.0, "damping": {"ratoi": 0.1}}, "damping"),
        ({"frequency_hz": 1.0, "damping": float("nan")}, "damping"),
        ({"frequency_hz": 1.0, "order": "full", "tolerance": 1e-3}, "belongs to order low"),
    ],
)
def test_impossible_arguments(arguments, message):
    """Each is refused with what is wrong with it."""
    with pytest.raises(fx.OptionError) as caught:
        fx.frequency_response(oscillator(), **arguments)
    assert message in str(caught.value)
