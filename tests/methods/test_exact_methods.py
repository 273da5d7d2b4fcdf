"""Methods that solve beams exactly agree with each other and with closed forms."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import flexura as fx
from flexura.linalg import lowest
from flexura.mechanism import with_rigid_bodies
from flexura.methods.chain_equations import (
    reverberation_ray,
    spectral_element,
    spectral_response,
    transfer_matrix,
)
from flexura.methods.discrete_models import finite_elements
from flexura.methods.dynamic_stiffness import DynamicStiffness, dynamic_stiffness

EXAMPLES = Path(__file__).parents[2] / "examples"
STEEL = fx.describe.Material(E=200e9, nu=0.3, rho=7800.0)
METHODS = {
    "dynamic stiffness": dynamic_stiffness,
    "transfer matrix": transfer_matrix,
    "spectral element": spectral_element,
    "reverberation-ray": reverberation_ray,
}


def cantilever(elements=1, theory="euler_bernoulli"):
    """A square cantilever 10 x 6 mm, 200 mm long."""
    return fx.Mechanism(
        theory=theory,
        corrections="none",
        materials={"steel": STEEL},
        nodes={"root": (0, 0, 0), "tip": (0.2, 0, 0)},
        links={
            "beam": fx.describe.Link(
                nodes=("root", "tip"),
                material="steel",
                section=fx.describe.Rectangle(width=0.01, thickness=0.006),
                reference=(0, 0, 1),
                elements=elements,
            )
        },
        ground={"root": "clamped"},
    )


def frame():
    """A spatial loop of three bars with an offset, a rigid body, a spring and a mass."""
    bar = {"material": "steel", "section": fx.describe.Rectangle(width=0.012, thickness=0.005), "elements": 2}
    return fx.Mechanism(
        corrections="none",
        materials={"steel": STEEL},
        nodes={"a": (0, 0, 0), "b": (0.1, 0, 0.02), "c": (0.1, 0.12, 0), "d": (0, 0.1, 0.03)},
        links={
            "ab": fx.describe.Link(nodes=("a", "b"), reference=(0, 0, 1), end_offset=(0, 0.01, 0), **bar),
            "bc": fx.describe.Link(nodes=("b", "c"), reference=(0, 0, 1), **bar),
            "cd": fx.describe.Link(nodes=("c", "d"), reference=(0, 0, 1), **bar),
            "da": fx.describe.Link(nodes=("d", "a"), reference=(1, 0, 0), **bar),
        },
        bodies={
            "block": fx.describe.RigidBody(
                centre=(0.1, 0.12, 0.02), mass=0.2, inertia=(1e-4, 2e-4, 1e-4), carries=("c",)
            )
        },
        masses={"bob": fx.describe.PointMass(node="d", mass=0.05)},
        springs={
            "stay": fx.describe.Spring(
                nodes=("b", "d"), stiffness=fx.describe.DiagonalStiffness(tx=1e4, ty=2e4, tz=1e4)
            )
        },
        ground={"a": "clamped"},
    )


def clamped_free_roots(count):
    """Roots of cos x cosh x + 1 = 0."""
    return np.array(
        [brentq(lambda x: np.cos(x) + 1 / np.cosh(x), (k + 0.1) * np.pi, (k + 0.95) * np.pi) for k in range(count)]
    )


@pytest.mark.parametrize("method", METHODS)
def test_cantilever_by_its_closed_form(method):
    E, rho, L, b, t, nu = 200e9, 7800.0, 0.2, 0.01, 0.006, 0.3
    k = clamped_free_roots(6) / L
    thin, wide = (k**2 * np.sqrt(E * depth**2 / (12 * rho)) for depth in (t, b))
    series = sum(np.tanh(n * np.pi * b / (2 * t)) / n**5 for n in range(1, 60, 2))
    J = b * t**3 / 3 * (1 - 192 / np.pi**5 * t / b * series)
    odd = (2 * np.arange(3) + 1) * np.pi / (2 * L)
    twist = odd * np.sqrt(E / (2 * (1 + nu)) * J / (rho * (b * t**3 + t * b**3) / 12))
    stretch = odd * np.sqrt(E / rho)
    exact = np.sort(np.concatenate([thin, wide, twist, stretch]))[:10] / (2 * np.pi)
    found = METHODS[method](fx.assemble(cantilever()), 10)
    np.testing.assert_allclose(found.frequency_hz, exact, rtol=1e-8)


@pytest.mark.parametrize(
    ("method", "theory", "count"),
    [
        pytest.param("transfer matrix", "euler_bernoulli", 8, marks=pytest.mark.slow),
        ("transfer matrix", "rayleigh", 8),
        pytest.param("transfer matrix", "timoshenko", 8, marks=pytest.mark.slow),
        ("spectral element", "timoshenko", 6),
        pytest.param("reverberation-ray", "rayleigh", 3, marks=pytest.mark.slow),
        ("reverberation-ray", "timoshenko", 3),
    ],
)
def test_methods_agree_on_a_spatial_loop(method, theory, count):
    model = fx.assemble(frame().model_copy(update={"theory": theory}))
    exact = dynamic_stiffness(model, count).frequency_hz
    np.testing.assert_allclose(METHODS[method](model, count).frequency_hz, exact, rtol=1e-8)


@pytest.mark.parametrize(
    ("name", "method", "count"),
    [
        pytest.param("guide", "transfer matrix", 12, marks=pytest.mark.slow),
        ("guide", "spectral element", 6),
        pytest.param("guide", "reverberation-ray", 6, marks=pytest.mark.slow),
        pytest.param("pivot", "transfer matrix", 6, marks=pytest.mark.slow),
        ("amplifier", "transfer matrix", 6),
    ],
)
def test_methods_agree_on_examples(name, method, count):
    model = fx.assemble(fx.load(EXAMPLES / name / f"{name}.yaml"))
    exact = dynamic_stiffness(model, count).frequency_hz
    np.testing.assert_allclose(METHODS[method](model, count).frequency_hz, exact, rtol=1e-8)


def test_transfer_matrices_agree_on_the_rpr_mechanism():
    model = fx.assemble(fx.load(EXAMPLES / "rpr" / "rpr.yaml"))
    np.testing.assert_allclose(
        transfer_matrix(model, 6).frequency_hz, dynamic_stiffness(model, 6).frequency_hz, rtol=1e-8
    )


def test_repeated_frequencies_are_all_found_and_counted():
    model = fx.assemble(with_rigid_bodies(fx.load(EXAMPLES / "tip_tilt" / "tip_tilt.yaml")))
    exact = dynamic_stiffness(model, 8)
    hz = exact.frequency_hz
    np.testing.assert_allclose(hz[[1, 3, 6]], hz[[2, 4, 7]], rtol=1e-9)
    method = DynamicStiffness(model)
    for n, f in ((1, hz[0]), (3, hz[2]), (5, hz[4]), (8, hz[7])):
        assert method.count_below(f * (1 + 1e-6)) == n
        assert method.count_below(f * (1 - 1e-6)) < n


@pytest.mark.parametrize("theory", ["euler_bernoulli", "rayleigh"])
def test_finite_elements_converge_to_it_from_above_at_fourth_order(theory):
    model = fx.assemble(cantilever(4, theory))
    exact = dynamic_stiffness(model, 3).frequency_hz
    errors = [finite_elements(model, 3, pieces).frequency_hz / exact - 1 for pieces in (1, 2, 4)]
    assert (np.array(errors) > 0).all()
    for coarse, fine in pairwise(errors):
        np.testing.assert_allclose(np.log2(coarse / fine), 4.0, atol=0.15)


def test_cutting_members_changes_nothing():
    one, five = (dynamic_stiffness(fx.assemble(cantilever(n, "timoshenko")), 8).frequency_hz for n in (1, 5))
    np.testing.assert_allclose(one, five, rtol=1e-10)


def test_an_ungrounded_mechanism_has_six_zero_frequencies():
    loose = frame().model_copy(update={"ground": {}})
    hz = dynamic_stiffness(fx.assemble(loose), 8).frequency_hz
    assert (hz[:6] == 0).all() and hz[6] > 1


@pytest.mark.parametrize("name", ["guide", "xy_stage", "rpr"])
def test_shapes_are_those_of_the_full_model(name):
    model = fx.assemble(fx.load(EXAMPLES / name / f"{name}.yaml"))
    found = dynamic_stiffness(model, 6)
    dof = model.plan.topology.dof
    x = np.zeros((model.order, 6))
    x[dof[dof >= 0]] = found.shapes[dof >= 0]
    rayleigh = np.einsum("ik,ik->k", x, model.K @ x) / np.einsum("ik,ik->k", x, model.M @ x)
    full = np.sqrt(lowest(model.K, model.M, 6).values) / (2 * np.pi)
    np.testing.assert_allclose(np.sqrt(rayleigh) / (2 * np.pi), full, rtol=1e-4)
    gram = x.T @ (model.M @ x)
    size = np.sqrt(np.diagonal(gram))
    assert np.linalg.cond(gram / size / size[:, None]) < 1e3


@pytest.mark.slow
def test_response_to_a_step_is_that_of_the_modes():
    """A force (1 - cos)/2 that ends in a constant, on a cantilever's tip, against the sum over exact modes."""
    rise, L, E, rho, b, t = 2e-3, 0.2, 200e9, 7800.0, 0.01, 0.006
    area, stiff = b * t, E * b * t**3 / 12
    model = fx.assemble(cantilever())

    def force(time):
        return np.where(time < rise, (1 - np.cos(np.pi * time / rise)) / 2, 1.0)

    time, u = spectral_response(model, force, ("tip", (0, 0, 1, 0, 0, 0)), ["tip"], duration=0.02, steps=800)
    # the force is the sum of two rises of one half, the second delayed
    expected, a = np.zeros_like(time), np.pi / rise
    for root in clamped_free_roots(9):
        w = (root / L) ** 2 * np.sqrt(stiff / (rho * area))
        for s in (time, np.maximum(time - rise, 0.0)):
            own = (1 - np.cos(w * s)) / w**2 - (np.cos(a * s) - np.cos(w * s)) / (w**2 - a**2)
            # a mode of unit mean square has the tip deflection 2
            expected += 4 / (rho * area * L) * own / 2
    scale = L**3 / (3 * stiff)
    np.testing.assert_allclose(u[:, 0, 2] / scale, expected / scale, atol=2e-3)


def test_a_pulse_travels_along_a_rod_at_the_speed_of_sound():
    model = fx.assemble(cantilever())
    speed = np.sqrt(200e9 / 7800.0)
    pulse = 4e-6

    def force(time):
        return np.where(time < pulse, 1 - np.cos(2 * np.pi * time / pulse), 0.0)

    time, u = spectral_response(model, force, ("tip", (1, 0, 0, 0, 0, 0)), ["tip"], duration=1.5e-4, steps=600)
    # a free end moves by c/(EA) times the impulse when the pulse leaves, and stands still until the echo is back
    impulse = pulse
    step = speed * impulse / (200e9 * 0.01 * 0.006)
    echo = 2 * 0.2 / speed
    between = (time > 2 * pulse) & (time < echo - pulse)
    np.testing.assert_allclose(u[between, 0, 0], step, rtol=5e-3)
    late = (time > echo + 2 * pulse) & (time < 2 * echo - pulse)
    # the clamped end turns the pulse round: the free end is back where it was before, and goes as far beyond
    np.testing.assert_allclose(u[late, 0, 0], -step, rtol=5e-3)


def test_impossible_responses_are_refused():
    model = fx.assemble(cantilever(3))
    with pytest.raises(fx.OptionError, match="positive duration"):
        spectral_response(model, np.sin, ("tip", (1, 0, 0, 0, 0, 0)), ["tip"], duration=-1.0)
    with pytest.raises(fx.OptionError, match="there is no node"):
        spectral_response(model, np.sin, ("nowhere", (1, 0, 0, 0, 0, 0)), ["tip"], duration=1.0)
