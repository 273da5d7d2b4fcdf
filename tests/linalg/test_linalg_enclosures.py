"""Bounds of eigenvalues where the energies of motions cancel, against eigenvalues with 60 digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from flexura.errors import SolverError
from flexura.linalg import Pencil, enclose, upper_bounds

SEEDS = 12


def on_arms(seed: int, arm: float, stiffness: float) -> tuple[np.ndarray, np.ndarray]:
    """K and M of two bodies on springs, displacement and rotation each, in the DOFs of nodes at the ends of long arms:
    in x' M x of a rotation about a body's centre two terms cancel that are (arm / radius of gyration)^2 as large."""
    rng = np.random.default_rng(seed)
    mass = np.array([1.0, 1e-6, 2.0, 3e-6]) * rng.uniform(0.5, 2, 4)
    spring = np.array([1.0, 4e-6, 3.0, 9e-6]) * rng.uniform(0.5, 2, 4) * stiffness
    reach, between = np.eye(4), np.eye(4)
    reach[0, 1], reach[2, 3] = arm * rng.uniform(0.5, 2, 2)
    between[0, 2], between[1, 3] = 0.3, 0.2
    strain = between @ reach
    K, M = strain.T @ np.diag(spring) @ strain, reach.T @ np.diag(mass) @ reach
    return (K + K.T) / 2, (M + M.T) / 2


def exact_pairs(K: np.ndarray, M: np.ndarray) -> tuple[list[mpmath.mpf], np.ndarray]:
    """Eigenvalues, ascending, of the matrices as they are stored, and the nearest vectors in double precision."""
    with mpmath.workdps(60):
        inverse = mpmath.cholesky(mpmath.matrix(M.tolist())) ** -1
        values, Q = mpmath.eigsy(inverse * mpmath.matrix(K.tolist()) * inverse.T)
        vectors = np.array((inverse.T * Q).tolist(), dtype=float)
    order = sorted(range(len(values)), key=lambda k: values[k])
    return [values[k] for k in order], vectors[:, order]


@pytest.mark.parametrize("stiffness", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("arm", [1.0, 1e2, 1e3, 1e4])
def test_cancellation_in_the_mass_widens_the_bounds(arm, stiffness) -> None:
    for seed in range(SEEDS):
        K, M = on_arms(seed, arm, stiffness)
        exact, vectors = exact_pairs(K, M)
        pencil = Pencil.of(K, M)
        upper, _ = upper_bounds(pencil, *pencil.ritz(vectors[:, :3]))
        assert all(u >= e for u, e in zip(upper, exact, strict=False))
        if arm < 1e4:
            assert all(u <= e * (1 + 1e-7 * arm**2) for u, e in zip(upper, exact, strict=False))
        found = enclose(pencil, vectors[:, :3], float(exact[2] + exact[3]) / 2)
        assert not found.is_complete or all(low <= e for low, e in zip(found.lower, exact, strict=False))


@pytest.mark.parametrize("arm", [1e5, 1e6, 1e7])
def test_a_mass_that_is_lost_in_round_off_is_told(arm) -> None:
    """In words, wherever there is no bound: the mass matrix as it is stored need not be positive."""
    told = 0
    for seed in range(SEEDS):
        K, M = on_arms(seed, arm, 1.0)
        try:
            found = enclose(Pencil.of(K, M), np.linalg.eigh(K)[1][:, :3], 1.0)
        except SolverError as error:
            assert "lost in the round-off of the mass matrix" in str(error)
            told += 1
        else:
            assert not np.isnan([*found.upper, *found.lower]).any()
    assert told


def test_bounds_hold_for_vectors_that_are_nearly_one() -> None:
    K, M = np.diag([1.0, 2.0, 3.0]), np.eye(3)
    vectors = np.array([[1.0, 1.0], [0.0, 1e-5], [1e-6, 2e-6]])
    pencil = Pencil.of(K, M)
    upper, _ = upper_bounds(pencil, *pencil.ritz(vectors))
    assert 1 <= upper[0] <= 1 + 1e-5
    assert 2 <= upper[1] <= 2.1
