"""Harmonic balance against Duffing's equation, by elliptic functions, and orbits of SciPy's integration: through folds,
through an internal resonance, past a branch, and with a stiff coordinate that follows."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from flexura.errors import SolverError
from flexura.linalg import Balance, Orbit, Series, along, located
from helpers.over import over


class Duffing:
    """x'' + c x' + x + e x^3 = f cos w t."""

    def __init__(self, c: float = 0.0, e: float = 1.0, f: float = 0.0) -> None:
        self.c, self.e, self.f = c, e, f
        self.frequencies = np.ones(1)

    def forces(self, q, v, a, drive):
        return a + self.c * v + q + self.e * q**3 - self.f * drive[:, None]

    def slopes(self, q, v, a, drive, slow):
        del a, drive, slow
        one = np.ones((*v.shape, 1))
        return (1 + 3 * self.e * q**2)[..., None], self.c * one, one


def free(harmonics: int, up_to: float) -> tuple[Balance, list[Orbit]]:
    balance = Balance.of(Duffing(), Series.of(harmonics, even=True), False, 1.0, 1.0, 1.0)
    X, direction = np.zeros((harmonics + 1, 1)), np.zeros(harmonics + 2)
    X[1], direction[1] = 0.05, 1.0
    orbits = []
    for orbit in along(balance, balance.near(balance.linear(X, 1.0), direction)[0], 0.05, lambda _: 0.3):
        orbits.append(orbit)
        if orbit.motion.X.sum() > up_to:
            break
    return balance, orbits


def exact(amplitude: np.ndarray) -> np.ndarray:
    """The frequency of x'' + x + x^3 = 0 (complete elliptic integral of the first kind)."""
    square = amplitude**2
    return np.pi * np.sqrt(1 + square) / (2 * ellipk(square / (2 + 2 * square)))


@over("harmonics", (5, 7, 9))
def test_the_backbone_of_duffing_is_that_of_elliptic_functions(harmonics):
    """Off by no more than is estimated, with each pair of harmonics some thirty times less."""
    balance, orbits = free(harmonics, 2.0)
    amplitude = np.array([orbit.motion.X.sum() for orbit in orbits])
    omega = np.array([orbit.omega for orbit in orbits])
    off = np.abs(omega / exact(amplitude) - 1)
    motion, _ = balance.error(orbits[-1])
    assert off[-1] < motion < 30 * off[-1]
    assert off.max() < 4e-5 * 30.0 ** ((5 - harmonics) / 2)


def test_free_motions_of_duffing_are_neutral():
    balance, orbits = free(7, 2.0)
    assert np.abs(balance.exponents(orbits[-1])).max() < 1e-3 * orbits[-1].omega


DRIVEN = Duffing(0.05, 0.5, 0.1)


@pytest.fixture(scope="module")
def driven() -> tuple[Balance, list[Orbit]]:
    balance = Balance.of(DRIVEN, Series.of(9), True, 1.0, 0.3, 2.0)
    direction = np.zeros(20)
    direction[-1] = 1.0
    orbits = []
    for orbit in along(balance, balance.near(balance.linear(np.zeros((19, 1)), 0.6), direction)[0], 0.1, lambda _: 0.4):
        orbits.append(orbit)
        if orbit.omega > 2.0:
            break
    return balance, orbits


def start(orbit: Orbit) -> np.ndarray:
    """Displacement and velocity at time zero."""
    order = np.arange(1, len(orbit.motion.X) // 2 + 1)
    return np.array(
        [orbit.motion.X[0, 0] + orbit.motion.X[1::2, 0].sum(), orbit.omega * (order @ orbit.motion.X[2::2, 0])]
    )


def period(omega: float, start: np.ndarray) -> np.ndarray:
    """What a motion and two small ones beside it become after a period (SciPy)."""

    def rate(t, y):
        x, v, *beside = y
        out = [v, DRIVEN.f * np.cos(omega * t) - DRIVEN.c * v - x - DRIVEN.e * x**3]
        for a, b in np.reshape(beside, (2, 2)):
            out += [b, -DRIVEN.c * b - (1 + 3 * DRIVEN.e * x**2) * a]
        return out

    y = [*start, 1.0, 0.0, 0.0, 1.0]
    return solve_ivp(rate, (0, 2 * np.pi / omega), y, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]


def test_driven_motions_close_and_have_the_multipliers_of_an_integration(driven):
    balance, orbits = driven
    for orbit in orbits[::6]:
        x, v = start(orbit)
        after = period(orbit.omega, np.array([x, v]))
        assert after[:2] == pytest.approx([x, v], abs=2e-6)
        multipliers = np.linalg.eigvals(after[2:].reshape(2, 2).T)
        found = np.exp(balance.exponents(orbit) * 2 * np.pi / orbit.omega)
        assert np.sort_complex(found) == pytest.approx(np.sort_complex(multipliers), abs=1e-5)


def test_folds_have_a_multiplier_of_one_and_bound_what_is_unstable(driven):
    balance, orbits = driven
    pairs = [(a, b) for a, b in pairwise(orbits) if a.turning * b.turning < 0]
    assert len(pairs) == 2
    for before, after in pairs:
        fold = located(balance, before, after, lambda orbit: orbit.turning)
        multipliers = np.linalg.eigvals(period(fold.omega, start(fold))[2:].reshape(2, 2))
        assert np.abs(multipliers - 1).min() < 1e-5
    unstable = [balance.exponents(orbit).real.max() > 1e-6 for orbit in orbits]
    assert unstable == [orbit.turning < 0 for orbit in orbits]


def test_what_has_no_motion_near_is_said():
    balance = Balance.of(Duffing(0.0, 0.0, 1.0), Series.of(1), True, 1.0, 1.0, 1.0)
    direction = np.zeros(4)
    direction[-1] = 1.0
    with pytest.raises(SolverError):
        balance.near(balance.linear(np.zeros((3, 1)), 1.0), direction)


class Coupled:
    """x'' + x + dV/dx = 0, y'' + w^2 y + dV/dy = 0 in coordinates x, w y of unit stiffness; V by its derivatives."""

    def __init__(self, w, gradient, hessian) -> None:
        self.frequencies, self.gradient, self.hessian = np.array([1.0, w]), gradient, hessian

    def forces(self, q, v, a, drive):
        del v, drive
        x = q / self.frequencies
        return a / self.frequencies**2 + q + np.stack(self.gradient(*x.T), axis=1) / self.frequencies

    def slopes(self, q, v, a, drive, slow):
        del a, drive, slow
        w = self.frequencies
        K = np.eye(2) + np.moveaxis(np.array(self.hessian(*(q / w).T)), 2, 0) / (w[:, None] * w)
        return K, np.zeros((*v.shape, 2)), np.tile(np.diag(w**-2), (len(q), 1, 1))

    def after(self, start: np.ndarray, time: float) -> np.ndarray:
        """Displacements and velocities (4,) and those of small motions beside, from rest at `start` (SciPy)."""
        w = self.frequencies**2

        def rate(_, y):
            x, v, beside = y[:2], y[2:4], y[4:].reshape(4, 4)
            K = np.diag(w) + np.array(self.hessian(*x))
            return np.concatenate([v, -w * x - self.gradient(*x), beside[2:].ravel(), (-K @ beside[:2]).ravel()])

        y = np.concatenate([start, np.zeros(2), np.eye(4).ravel()])
        return solve_ivp(rate, (0, time), y, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]


def backbone(oscillator: Coupled, harmonics: int, longest: float, up_to: float) -> tuple[Balance, list[Orbit]]:
    """Motions from the first mode on, until one is as large."""
    balance = Balance.of(oscillator, Series.of(harmonics, even=True), False, 1.0, 1.0, 1.0)
    X, direction = np.zeros((harmonics + 1, 2)), np.zeros((harmonics + 1) * balance.slow + 1)
    X[1, 0], direction[balance.slow] = 0.05, 1.0
    orbits = []
    for orbit in along(balance, balance.near(balance.linear(X, 1.0), direction)[0], 0.05, lambda _: longest):
        orbits.append(orbit)
        if np.abs(balance.instants(orbit.motion)[0][0]).max() > up_to:
            break
    return balance, orbits


def closes(balance: Balance, oscillator: Coupled, orbit: Orbit) -> float:
    """How far from its start, over this, a motion is a period later."""
    start = balance.instants(orbit.motion)[0][0] / oscillator.frequencies
    after = oscillator.after(start, 2 * np.pi / orbit.omega)
    return float(np.abs(after[:2] - start).max() / np.abs(start).max())


def test_an_internal_resonance_is_followed_where_the_third_harmonic_meets_a_mode():
    """V = (x + y)^4 / 40, w = 3.1: from 3 omega = 3.1 on the second coordinate takes over, at three times the rate."""
    system = Coupled(3.1, lambda x, y: [(x + y) ** 3 / 10] * 2, lambda x, y: [[0.3 * (x + y) ** 2] * 2] * 2)
    balance, orbits = backbone(system, 9, 0.1, 1.5)
    joined = [orbit for orbit in orbits if abs(orbit.motion.X[3, 1]) > 0.3 * abs(orbit.motion.X[1, 0])]
    assert joined
    assert 3 * joined[0].omega == pytest.approx(3.1, rel=0.03)
    assert max(closes(balance, system, orbit) for orbit in (orbits[3], joined[0], orbits[-1])) < 1e-5


def test_the_determinant_changes_its_sign_where_another_curve_branches_off():
    """Two equal masses on springs 1 + x^2, coupled by -0.1, in their sum and difference: motions in phase are those of
    Duffing's equation, and where one of the two masses alone begins to take over, a multiplier is one (SciPy)."""
    r = np.sqrt(0.5)

    def gradient(s, d):
        a, b = r * (s + d), r * (s - d)
        return [r * (a**3 + b**3), r * (a**3 - b**3)]

    def hessian(s, d):
        a, b = 1.5 * (s + d) ** 2, 1.5 * (s - d) ** 2
        return [[(a + b) / 2, (a - b) / 2], [(a - b) / 2, (a + b) / 2]]

    system = Coupled(0.9, gradient, hessian)
    balance, orbits = backbone(system, 7, 0.1, 1.2)
    ((before, after),) = [(a, b) for a, b in pairwise(orbits) if a.side != b.side]
    traces, sums = [], []
    for orbit in (before, after):
        start = balance.instants(orbit.motion)[0][0] / system.frequencies
        beside = system.after(start, 2 * np.pi / orbit.omega)[4:].reshape(4, 4)[1::2, 1::2]
        traces.append(float(np.trace(beside)))
        sums.append(start[0])
    assert (traces[0] - 2) * (traces[1] - 2) < 0
    assert sums[0] < np.sqrt(0.19 / 0.75) * 1.05  # by one harmonic: 1 + 3/8 s^2 = 0.9^2 + 9/8 s^2
    assert sums[1] > np.sqrt(0.19 / 0.75) * 0.95


def test_what_follows_a_square_needs_twice_the_harmonics_and_has_them():
    """V = 10^4 (y - x^2)^2 / 2 less its part of second degree: y follows x^2, as the ends of leaves that bend do."""
    S = 1e4
    system = Coupled(
        np.sqrt(S),
        lambda x, y: [-2 * S * (y - x * x) * x, -S * x * x],
        lambda x, y: [[-2 * S * (y - 3 * x * x), -2 * S * x], [-2 * S * x, 0 * x]],
    )
    balance, orbits = backbone(system, 5, 0.2, 40.0)
    assert balance.slow == 1
    assert all(orbit.side == orbits[0].side for orbit in orbits)
    assert max(closes(balance, system, orbit) for orbit in orbits[2::3]) < 1e-4
