"""Eigenvalues: none missing, repeated ones included, residuals small, counts by inertia right.

Symmetric mechanisms have repeated frequencies: n equal branches on a heavy stage vibrate almost alone, and every
motion of one of them comes n-fold. Single-vector Lanczos methods may lose some of them.
"""

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st

from flexura.full_order import assemble
from flexura.linalg import count_below, lowest
from flexura.linalg.factor import DENSE_LIMIT
from flexura.mechanism import Circle, CircularPattern, Instance, Link, Material, Mechanism, RigidBody, Substructure
from helpers.random_mechanisms import FEW, mechanisms


def dense(model):
    """Return all eigenvalues by a dense solver on diagonally scaled matrices."""
    K, M = model.K.toarray(), model.M.toarray()
    d = 1 / np.sqrt(np.diagonal(K))
    return np.sort(1 / la.eigh(M * np.outer(d, d), K * np.outer(d, d), eigvals_only=True))


@FEW
@given(mechanisms(), st.integers(1, 20))
def test_lowest_are_the_lowest_with_small_residuals(mechanism, count):
    model = assemble(mechanism)
    pairs = lowest(model.K, model.M, count)
    np.testing.assert_allclose(pairs.values, dense(model)[: len(pairs.values)], rtol=1e-7)
    d = np.sqrt(model.K.diagonal())[:, None]
    residual = (model.K @ pairs.vectors - model.M @ pairs.vectors * pairs.values) / d
    assert (np.linalg.norm(residual, axis=0) <= 1e-7 * np.linalg.norm(d * pairs.vectors, axis=0)).all()
    gram = pairs.vectors.T @ (model.M @ pairs.vectors)
    np.testing.assert_allclose(gram, np.eye(len(gram)), atol=1e-6)


@FEW
@given(mechanisms(), st.data())
def test_counts_by_inertia_are_those_of_the_eigenvalues(mechanism, data):
    model = assemble(mechanism)
    values = dense(model)
    k = data.draw(st.integers(0, len(values) - 1))
    below = values[k - 1] if k else 0.0
    if values[k] > below * (1 + 1e-5):
        value = np.sqrt(max(below, 0.01 * values[k]) * values[k])
        assert count_below(model.K, model.M, value) == k
        assert count_below(model.K.toarray(), model.M.toarray(), value) == k


def wheel(spokes, elements, free=False):
    """Return a heavy hub with equal round spokes; the hub is clamped unless it is free."""
    spoke = Substructure(
        nodes={"root": (0.02, 0, 0), "tip": (0.12, 0, 0)},
        links={"beam": Link(nodes=("root", "tip"), material="m", section=Circle(diameter=3e-3), elements=elements)},
        interface=("root",),
    )
    return Mechanism(
        materials={"m": Material(E=70e9, nu=0.33, rho=2800.0)},
        substructures={"spoke": spoke},
        instances={"spoke": Instance(of="spoke", pattern=CircularPattern(count=spokes))},
        bodies={"hub": RigidBody(carries=("spoke*.root",), mass=0.1, inertia=(1e-5, 1e-5, 2e-5))},
        ground={} if free else {"hub": "clamped"},
    )


@pytest.mark.parametrize("elements", [3, 30])
@pytest.mark.parametrize("spokes", [3, 4, 8])
def test_every_copy_of_a_repeated_frequency_is_found(spokes, elements):
    """Each of the first three bending frequencies of a round spoke comes 2 n times."""
    model = assemble(wheel(spokes, elements))
    assert (model.order > DENSE_LIMIT) == (elements == 30)
    one = assemble(wheel(1, elements))
    for count in (1, spokes, 2 * spokes - 1, 2 * spokes, 4 * spokes + 1, 6 * spokes):
        expected = np.repeat(dense(one)[:6], spokes)[:count]
        np.testing.assert_allclose(lowest(model.K, model.M, count).values, expected, rtol=1e-7)


@pytest.mark.parametrize("spokes", [3, 4, 8])
def test_free_wheels_have_six_zeros_and_pairs(spokes):
    model = assemble(wheel(spokes, 30, free=True))
    assert model.order > DENSE_LIMIT
    values = lowest(model.K, model.M, 6 + 4 * spokes).values
    assert (values[:6] == 0).all() and (values[6:] > 0).all()
    reference = la.eigh(model.K.toarray(), model.M.toarray(), eigvals_only=True, subset_by_index=[6, 5 + 4 * spokes])
    np.testing.assert_allclose(values[6:], reference, rtol=1e-5)


@pytest.mark.parametrize("copies", [2, 3, 8, 20])
def test_decoupled_equal_blocks(copies):
    """Direct sums of one pencil: every eigenvalue is exactly repeated."""
    one = assemble(wheel(1, 10))
    K, M = (sp.block_diag([A] * copies, format="csc") for A in (one.K, one.M))
    expected = np.repeat(dense(one)[:3], copies)
    for count in (1, copies - 1, copies, copies + 1, 3 * copies):
        np.testing.assert_allclose(lowest(K, M, count).values, expected[:count], rtol=1e-7)
        assert count_below(K, M, expected[count - 1] * 1.001) >= count
