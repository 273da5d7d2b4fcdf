"""A moving model as an oscillator: rotation vectors, instants side by side, derivatives."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.motion import Damping, Equations, MovingModel, Oscillation
from flexura.motion.elements import Rates
from flexura.motion.oscillation import turning
from flexura.motion.se3 import rotation
from flexura.structure import Design
from helpers.over import over

GUIDE = fx.load(Path(__file__).parents[2] / "examples/guide/guide.yaml")


def test_rates_of_turning_are_those_of_the_rotations():
    """Central differences of exp(w(t)), and of the rates of turning themselves."""
    w, rate, second, h = np.array([0.3, -0.5, 0.8]), np.array([0.2, 0.1, -0.4]), np.array([0.5, -0.3, 0.2]), 1e-4

    def at(t):
        return w + rate * t + second * t**2 / 2, rate + second * t, second

    def spin(t):
        W = (rotation(at(t + h)[0]) - rotation(at(t - h)[0])) / (2 * h) @ rotation(at(t)[0]).T
        return np.array([W[2, 1], W[0, 2], W[1, 0]])

    _, omega, alpha = turning(*at(0.0))
    assert omega == pytest.approx(spin(0.0), abs=1e-8)
    assert alpha == pytest.approx((spin(h) - spin(-h)) / (2 * h), abs=1e-7)


@pytest.fixture(scope="module")
def guide() -> Oscillation:
    equations = Equations(MovingModel.of(Design.of(fx.Plan(GUIDE))))
    return Oscillation(equations, equations.at_rest())


def motion(guide: Oscillation, count: int) -> tuple[np.ndarray, ...]:
    """So many instants of a motion of 1 mm in the lowest three modes."""
    rng = np.random.default_rng(3)
    q = np.zeros((count, len(guide.frequencies)))
    q[:, :3] = rng.normal(size=(count, 3)) * 1e-3 / np.abs(guide.shapes[:, :3]).max(axis=0)
    return q, 300 * q[::-1], -(300**2) * q, np.zeros(count)


def test_instants_side_by_side_are_those_of_one_model(guide):
    q, v, a, drive = motion(guide, 3)
    model, equations = guide.equations.model, guide.equations
    together = guide.forces(q, v, a, drive)
    for k in range(3):
        x, rate, second = (equations.displacements(guide.shapes @ each[k]) for each in (q, v, a))
        J, omega, alpha = turning(x[:, 3:], rate[:, 3:], second[:, 3:])
        rate[:, 3:], second[:, 3:] = omega, alpha
        force = model.kinetics(model.rest.moved(x), Rates(rate, second, 0.0), np.zeros(3)).force
        force[:, 3:] = (force[:, None, 3:] @ J)[:, 0]
        assert together[k] == pytest.approx(guide.shapes.T @ equations.free(force), abs=1e-12 * np.abs(together).max())


def test_stiffness_is_one_and_mass_that_of_the_modes_at_rest(guide):
    none = np.zeros((1, len(guide.frequencies)))
    K, C, M = (own[0] for own in guide.slopes(none, none, none, np.zeros(1), 1))
    assert np.eye(len(K)) == pytest.approx(K, abs=1e-6)
    assert np.abs(C).max() * guide.frequencies[0] < 1e-6
    assert np.diag(guide.frequencies**-2) == pytest.approx(M, abs=1e-9 * M[0, 0])
    assert guide.frequencies[:4] / (2 * np.pi) == pytest.approx(fx.modes(GUIDE, n=4).frequency_hz, rel=1e-4)


@over("damping", (Damping(0.0, 0.0), Damping(1.0, 0.0), Damping(1.0, 1e-5)))
def test_slopes_are_differences_along_motions_that_quick_coordinates_follow(guide, damping):
    """Six coordinates, twice those that move; the others follow as in statics."""
    own, slow = replace(guide, damping=damping), 6
    q, v, a, drive = motion(guide, 2)
    K, C, M = own.slopes(q, v, a, drive, slow)
    still = guide.slopes(q, 0 * v, 0 * a, drive, slow)[0]
    follow = -np.linalg.solve(still[:, slow:, slow:], still[:, slow:, :slow])
    T = np.concatenate([np.tile(np.eye(slow), (2, 1, 1)), follow], axis=1)
    for k, slope in enumerate((K, C, M)):
        for column in (0, 2, 5):
            h = (1e-5, 0.1, 0.1)[k] * np.abs((q, v, a)[k]).max()
            up, down = ([x.copy() for x in (q, v, a)] for _ in range(2))
            up[k] += h * T[..., column]
            down[k] -= h * T[..., column]
            expected = (own.forces(*up, drive) - own.forces(*down, drive)) / (2 * h)
            found = (slope @ T)[..., column]
            assert found == pytest.approx(expected, abs=1e-5 * np.abs(found).max() + 1e-11 / 300**k)


def test_potential_is_the_strain_energy(guide):
    q = motion(guide, 1)[0][0]
    held = guide.equations.model.forces(guide.frames(q[None]), np.zeros(3)).energy
    assert guide.potential(q) == pytest.approx(held, rel=1e-6)
