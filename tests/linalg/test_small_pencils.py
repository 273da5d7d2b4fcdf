"""Small pencils by the kernel and in NumPy, beside SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la

from flexura.linalg import small_pencils
from helpers.kernels import both, compiled

pytestmark = compiled


def pencils(count, n, seed=1):
    rng = np.random.default_rng(seed)
    X, Y = rng.standard_normal((2, count, n, 2 * n))
    return X @ X.mT, Y @ Y.mT


@pytest.mark.parametrize(("count", "n"), [(1, 1), (1, 6), (3, 2), (4, 6), (7, 10), (2, 16), (2, 17)])
def test_pairs_are_those_of_scipy(count, n):
    """Units that differ by decades change nothing."""
    A, B = pencils(count, n)
    d = 10.0 ** np.random.default_rng(4).uniform(-3, 3, (count, n))
    both_ways = d[:, :, None] * d[:, None, :]
    for values, Z in both(lambda: small_pencils(A * both_ways, B * both_ways)):
        assert (np.diff(values, axis=1) >= 0).all()
        for k in range(count):
            np.testing.assert_allclose(values[k], la.eigh(A[k], B[k], eigvals_only=True), rtol=1e-11)
            X = d[k][:, None] * Z[k]
            assert abs(X.T @ B[k] @ X - np.eye(n)).max() < 1e-12
            assert abs(A[k] @ X - B[k] @ X * values[k]).max() < 1e-11 * abs(A[k] @ X).max()


def test_small_values_keep_their_digits_beside_large_ones():
    """Of a graded matrix D C D, with C well conditioned, Jacobi's rotations find each value to its own digits."""
    d, C = 10.0 ** -np.arange(0, 12, 2.0), np.eye(6) + 0.1
    values = small_pencils((C * d[:, None] * d)[None], np.eye(6)[None])[0][0]
    np.testing.assert_allclose(values[-1], la.eigvalsh(C * d[:, None] * d)[-1], rtol=1e-13)
    # the inverse is graded the other way round, so that its largest is the smallest
    np.testing.assert_allclose(values[0], 1 / la.eigvalsh(la.inv(C) / d[:, None] / d)[-1], rtol=1e-13)


def test_repeated_values():
    Q = la.qr(np.random.default_rng(2).standard_normal((6, 6)))[0]
    true = np.array([1.0, 2.0, 2.0, 2.0, 5.0, 5.0])
    values, Z = small_pencils((Q * true @ Q.T)[None], np.eye(6)[None])
    np.testing.assert_allclose(values[0], true, rtol=1e-13)
    assert abs(Z[0].T @ Z[0] - np.eye(6)).max() < 1e-13


def test_a_semidefinite_stiffness_has_zeros():
    X = np.random.default_rng(3).standard_normal((6, 3))
    kernel, numpy = both(lambda: small_pencils((X @ X.T)[None], np.eye(6)[None]))
    for values, _ in (kernel, numpy):
        assert abs(values[0, :3]).max() < 1e-13
    np.testing.assert_allclose(kernel[0][0, 3:], numpy[0][0, 3:], rtol=1e-13)


@pytest.mark.parametrize("wrong", [-1.0, np.nan])
def test_of_an_indefinite_mass_the_leading_part_is_solved(wrong):
    A, B = pencils(6, 5)
    B[2, 3, 3] = B[4, 0, 0] = wrong
    kernel, numpy = both(lambda: small_pencils(A, B))
    assert np.array_equal(np.isfinite(kernel[0]), np.isfinite(numpy[0]))
    finite = np.isfinite(numpy[0])
    assert finite[2].sum() == 3 and not finite[4].any() and finite[[0, 1, 3, 5]].all()
    np.testing.assert_allclose(kernel[0][finite], numpy[0][finite], rtol=1e-9)


def test_none_depends_on_its_neighbours():
    """To the last bit: a diagonal one is at rest at once beside others that are turned for long."""
    A, B = pencils(7, 6)
    A[2], B[2] = np.diag(np.arange(6.0)), np.eye(6)
    values, Z = small_pencils(A, B)
    for k in range(7):
        alone = small_pencils(A[k : k + 1], B[k : k + 1])
        assert np.array_equal(alone[0][0], values[k]) and np.array_equal(alone[1][0], Z[k])
