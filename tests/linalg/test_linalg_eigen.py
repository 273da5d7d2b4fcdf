"""Eigenvalues against matrices whose spectrum is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from flexura.linalg import Pencil, count_below, is_definite, lowest, residuals
from flexura.linalg.subspaces import lowest_values

SIZES = [40, 600]
"""One size on the dense route, one on the sparse route."""


def chain(n: int, ends: str) -> tuple[sp.csc_matrix, np.ndarray]:
    """Stiffness of n unit masses in a row with unit springs, and its exact eigenvalues 4 sin^2(theta/2)."""
    K = sp.diags([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], [-1, 0, 1]).tolil()
    if ends == "free":
        K[0, 0] = K[n - 1, n - 1] = 1.0
        theta = np.pi * np.arange(n) / n
    else:
        theta = np.pi * np.arange(1, n + 1) / (n + 1)
    return sp.csc_matrix(K), 4 * np.sin(theta / 2) ** 2


@pytest.mark.parametrize("n", SIZES)
def test_fixed_chain(n: int) -> None:
    K, exact = chain(n, "fixed")
    pairs = lowest(K, sp.identity(n, format="csc"), 8)
    np.testing.assert_allclose(pairs.values, exact[:8], rtol=1e-9)
    np.testing.assert_allclose(pairs.vectors.T @ pairs.vectors, np.eye(8), atol=1e-9)


@pytest.mark.parametrize("n", SIZES)
def test_free_chain_has_one_exact_zero(n: int) -> None:
    K, exact = chain(n, "free")
    assert not is_definite(K)
    pairs = lowest(K, sp.identity(n, format="csc"), 5)
    assert pairs.values[0] == 0.0
    np.testing.assert_allclose(pairs.values[1:], exact[1:5], rtol=1e-7)


@pytest.mark.parametrize("copies", [3, 7, 12])
@pytest.mark.parametrize("n", [20, 120])
def test_repeated_eigenvalues_are_all_found(copies: int, n: int) -> None:
    """Equal chains side by side: every eigenvalue `copies` times."""
    K, exact = chain(n, "fixed")
    K_all = sp.block_diag([K] * copies, format="csc")
    pairs = lowest(K_all, sp.identity(n * copies, format="csc"), 2 * copies + 1)
    expected = np.repeat(exact[:3], copies)[: 2 * copies + 1]
    np.testing.assert_allclose(pairs.values, expected, rtol=1e-8)


def test_six_zeros_among_repeated_free_chains() -> None:
    K, exact = chain(100, "free")
    K_all = sp.block_diag([K] * 6, format="csc")
    pairs = lowest(K_all, sp.identity(600, format="csc"), 9)
    assert (pairs.values[:6] == 0.0).all()
    np.testing.assert_allclose(pairs.values[6:], exact[1], rtol=1e-7)


@pytest.mark.parametrize("n", SIZES)
def test_graded_units_do_not_cost_accuracy(n: int) -> None:
    """A congruence with factors from 1e-6 to 1e6 leaves the spectrum alone."""
    K, exact = chain(n, "fixed")
    d = sp.diags(10.0 ** np.linspace(-6, 6, n))
    pairs = lowest((d @ K @ d).tocsc(), (d @ d).tocsc(), 6)
    np.testing.assert_allclose(pairs.values, exact[:6], rtol=1e-8)


@pytest.mark.parametrize("n", SIZES)
def test_inertia_counts_eigenvalues_below_any_value(n: int) -> None:
    K, exact = chain(n, "fixed")
    M = sp.identity(n, format="csc")
    for value in (exact[0] * 0.5, (exact[4] + exact[5]) / 2, (exact[-2] + exact[-1]) / 2, 5.0):
        assert count_below(K, M, value) == int((exact < value).sum())
    assert count_below(K.toarray(), M.toarray(), float(exact[3] + exact[4]) / 2) == 4


def test_residual_bounds_the_error_of_a_spoiled_eigenvalue() -> None:
    K, exact = chain(50, "fixed")
    M = sp.identity(50, format="csc")
    pairs = lowest(K, M, 3)
    assert residuals(Pencil.of(K, M), pairs).max() < 1e-9
    spoiled = type(pairs)(pairs.values * 1.01, pairs.vectors)
    bound = residuals(Pencil.of(K, M), spoiled)
    assert (bound >= np.abs(spoiled.values / exact[:3] - 1) * 0.999).all()
    np.testing.assert_allclose(bound, 0.01, rtol=0.02)


def test_stack_agrees_with_one_by_one_and_falls_back_where_designs_differ_much() -> None:
    rng = np.random.default_rng(5)
    K, M = [], []
    for scale in rng.uniform(0.2, 5.0, 24):
        A = rng.normal(size=(60, 60))
        K.append(scale * (A @ A.T + np.diag(np.linspace(1, 400, 60))))
        M.append(np.diag(rng.uniform(0.5, 2.0, 60)))
    found = lowest_values(np.array(K), np.array(M), 5)
    expected = [lowest(k, m, 5).values for k, m in zip(K, M, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-8)
