"""Moments of chains, their places and branches by kernels and in NumPy; a chain beside SciPy's condensation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from hypothesis import given
from hypothesis import strategies as st

import flexura as fx
from flexura.reduction.arrow_bounds import _arrow_has_fewer, _core_pairs, _projected_arrow, _projected_by_kernel, _ritz
from flexura.reduction.batch_bounds import cholesky_rounding
from flexura.reduction.branches import Arrow, Block, EndMatrices
from flexura.reduction.chain_assembler import chain_assembler
from flexura.reduction.chain_moments import moments, stiffness_and_mass
from flexura.structure import Design
from helpers.kernels import both, compiled
from helpers.random_mechanisms import FEW, mechanisms

RPR = Path(__file__).parents[2] / "examples" / "rpr" / "rpr.yaml"
SECTIONS, LENGTHS = {"leaf_thickness": 4e-4, "r_web": 3e-4}, {"leaf_length": 5e-3, "arm_length": 30e-3}
SAME = 1e-13
"""Of the largest entry of a matrix."""

pytestmark = compiled


@pytest.fixture(scope="module")
def plan():
    return fx.Plan(fx.load(RPR))


def designs(plan, count, names):
    rng = np.random.default_rng(count)
    return Design.of(plan, {name: value * rng.uniform(0.8, 1.2, count) for name, value in names.items()})


def apart(one, other):
    """Largest difference of matrices (..., n, n), over the largest entry of each."""
    scale = abs(other).max(axis=(-1, -2), keepdims=True)
    return float((abs(one - other) / np.where(scale > 0, scale, 1.0)).max(initial=0.0))


def frames(plan, design, kept):
    chains = chain_assembler(plan, dict.fromkeys(chain_assembler(plan).forces, kept)) if kept else None
    chains = chains or chain_assembler(plan)
    for kinds in chains._sets.values():
        yield chains._frame(kinds, design)[0], np.concatenate([chains.forces[kind] for kind in kinds])


@pytest.mark.parametrize("count", [1, 3, 4, 9])
@pytest.mark.parametrize("kept", [0, 1, 4])
@pytest.mark.parametrize("names", [SECTIONS, SECTIONS | LENGTHS])
def test_moments(plan, count, kept, names):
    design = designs(plan, count, names)
    for frame, forces in frames(plan, design, kept):
        kernel, numpy = both(lambda frame=frame, forces=forces: moments(frame, design.elements, forces))
        assert kernel.A.shape == numpy.A.shape
        assert apart(kernel.A[:2], numpy.A[:2]) < SAME
        # what is left out is a small difference beside kept motions
        assert apart(kernel.A[2], numpy.A[2]) < (1e-12 if not kept else 1e-10)
        np.testing.assert_allclose(kernel.slowness, numpy.slowness, rtol=1e-6)
        np.testing.assert_allclose(kernel.loss, numpy.loss, rtol=0.05)


def test_a_flexibility_that_is_not_positive_is_left_to_numpy(plan):
    """The designs beside it stay the same to the last bit."""
    good, soft = (designs(plan, 5, SECTIONS) for _ in range(2))
    soft.elements.flexibility_coefficients[2] *= -1.0
    for frame, forces in frames(plan, good, 0):
        expected, found = (moments(frame, design.elements, forces) for design in (good, soft))
        _, numpy = both(lambda frame=frame, forces=forces: moments(frame, soft.elements, forces))
        rest = [0, 1, 3, 4]
        assert np.array_equal(found.A[:, rest], expected.A[:, rest]) and np.array_equal(found.A[:, 2], numpy.A[:, 2])
        assert np.array_equal(found.loss[rest], expected.loss[rest]) and np.array_equal(found.loss[2], numpy.loss[2])
        alone = stiffness_and_mass(frame, soft.elements), stiffness_and_mass(frame, good.elements)
        assert np.array_equal(alone[0][:, rest], alone[1][:, rest]) and np.isfinite(alone[0]).all()


@pytest.mark.parametrize("names", [SECTIONS, SECTIONS | LENGTHS])
def test_constraint_modes_alone(plan, names):
    design = designs(plan, 5, names)
    for frame, _ in frames(plan, design, 0):
        kernel, numpy = both(lambda frame=frame: stiffness_and_mass(frame, design.elements))
        assert kernel.shape == numpy.shape and apart(kernel, numpy) < SAME


def test_a_chain_is_what_scipy_condenses():
    """A cantilever's chain of six elements beside all its nodes condensed by LAPACK."""
    wire = fx.describe.Circle(diameter=1e-3)
    link = fx.describe.Link(nodes=("a", "b"), material="spring-steel", section=wire, elements=6)
    mechanism = fx.Mechanism(
        nodes={"a": (0, 0, 0), "b": (0.03, 0.04, 0.02)},
        links={"link": link},
        masses={"tip": fx.describe.PointMass(node="b", mass=0.1)},
        ground={"a": "clamped"},
    )
    plan = fx.Plan(mechanism)
    full = fx.assemble(plan)
    K, M = full.K.toarray(), full.M.toarray()
    end = plan.topology.dof[plan.topology.numbers(["b"])[0]]
    inner = np.setdiff1d(np.arange(len(K)), end)
    T = np.zeros((len(K), 6))
    T[end] = np.eye(6)
    T[inner] = -la.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, end)], assume_a="pos")
    arrow = chain_assembler(plan).unproven(Design.of(plan).stacked())
    assert apart(arrow.core.A[0, 0], T.T @ K @ T) < 1e-9
    assert apart(arrow.core.A[1, 0], T.T @ M @ T) < 1e-9


@pytest.mark.parametrize("count", [1, 6])
@pytest.mark.parametrize("names", [SECTIONS, SECTIONS | LENGTHS])
def test_places(plan, count, names):
    design = designs(plan, count, names)
    for kept in (0, 1):
        chains = chain_assembler(plan, dict.fromkeys(chain_assembler(plan).forces, kept))
        kernel, numpy = both(lambda chains=chains: chains(design))
        ours, theirs = ([arrow.core, *arrow.blocks] for arrow in (kernel, numpy))
        for one, other in zip(ours, theirs, strict=True):
            assert apart(one.A[:2], other.A[:2]) < SAME and apart(one.A[2], other.A[2]) < 1e-10
            np.testing.assert_allclose(one.slack, other.slack, rtol=1e-9, atol=1e-12 * abs(other.slack).max())


def random_arrow(rng, count, q, r, inside, ends, c, *, soft=(), lost=1e-15):
    """Branches and a core of random matrices; the insides of the `soft` designs are indefinite."""
    n = inside + ends

    def matrices(*shape):
        X = rng.standard_normal((*shape, n if len(shape) > 2 else c, 2 * n))
        return X @ np.swapaxes(X, -1, -2)

    A = matrices(3, count, q) * np.array([1.0, 1e-2, 1e-5])[:, None, None, None, None]
    A[0, soft, 0, 0, 0] = -1.0
    slack = lost * abs(np.einsum("...ii->...i", A))
    core = matrices(3, count) * np.array([1.0, 1e-2, 1e-5])[:, None, None, None]
    T = rng.standard_normal((q, r, ends, c)) if count % 2 else rng.standard_normal((count, q, r, ends, c))
    whole = EndMatrices(core, lost * abs(np.einsum("...ii->...i", core)), np.full(count, 1e-4), np.full(count, 1e-12))
    return Arrow((Block(A, slack, inside, T),), whole, {})


SHAPES = [(1, 1, 1, 1, 1, 1), (5, 2, 3, 7, 6, 6), (4, 1, 2, 3, 12, 8), (6, 3, 1, 13, 5, 9)]


@pytest.mark.parametrize("shape", SHAPES)
def test_branches_follow_and_are_projected(shape):
    rng = np.random.default_rng(5)
    arrow = random_arrow(rng, *shape)

    def fresh():
        return Arrow(tuple(Block(b.A, b.slack, b.inside, b.T) for b in arrow.blocks), arrow.core, {})

    kernel, numpy = both(lambda: fresh().blocks[0]._following)
    for one, other in zip(kernel[:3], numpy[:3], strict=True):
        assert apart(one, other) < 1e-11
    np.testing.assert_allclose(kernel[3], numpy[3], rtol=1e-10)
    ours, theirs = both(lambda: fresh().followed)
    assert max(apart(a, b) for a, b in zip(ours, theirs, strict=True)) < 1e-11
    ritz = _ritz(arrow)
    small, same = _projected_by_kernel(arrow, (ritz.values, ritz.core)), _projected_arrow(arrow, ritz)
    for one, other in ((small.K, same.K), (small.M, same.M), (small.R, same.R)):
        assert apart(one, other) < SAME
    np.testing.assert_allclose(small.off, same.off, rtol=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_same_is_proven(shape):
    """From far below to far above the eigenvalues, and nothing where the inside of a branch is indefinite."""
    rng = np.random.default_rng(6)
    soft = [shape[0] - 1] if shape[0] > 1 else []
    arrow = random_arrow(rng, *shape, soft=soft)
    values, V = _core_pairs(arrow)
    proven = 0
    for factor in (1e-3, 0.5, 0.9, 1.0, 1.1, 30.0):
        ell = np.maximum(values, 0.0) * factor
        kernel, numpy = both(lambda ell=ell: _arrow_has_fewer(arrow, ell, V))
        assert np.array_equal(kernel, numpy)
        assert not kernel[soft].any()
        proven += int(kernel.sum())
    assert proven


@pytest.mark.parametrize("shape", SHAPES)
def test_margins_are_the_same(shape, monkeypatch):
    """With round-off a million times as large, the highest values that are proven."""
    monkeypatch.setattr("flexura.reduction.arrow_bounds.PLACING_ROUNDING", 1e-6)
    monkeypatch.setattr(
        "flexura.reduction.arrow_bounds.cholesky_rounding", lambda n, lifted=0: 1e6 * cholesky_rounding(n, lifted)
    )
    arrow = random_arrow(np.random.default_rng(7), *shape, lost=1e-6)
    values, V = _core_pairs(arrow)

    def highest():
        least, most = np.zeros(values.shape), 2 * values
        for _ in range(50):
            middle = (least + most) / 2
            proven = _arrow_has_fewer(arrow, middle, V)
            least, most = np.where(proven, middle, least), np.where(proven, most, middle)
        return least

    kernel, numpy = both(highest)
    np.testing.assert_allclose(kernel, numpy, rtol=1e-9)
    assert (kernel < values).all() and (kernel > 0).any()


@FEW
@given(mechanisms(nested=True), st.integers(1, 6))
def test_random_mechanisms(mechanism, count):
    plan = fx.Plan(mechanism)
    kernel, numpy = both(lambda: _found(plan, count))
    if isinstance(kernel, str) or isinstance(numpy, str):
        assert kernel == numpy
        return
    for one, other in ((kernel, numpy), (numpy, kernel)):
        assert (one.lower_hz <= other.upper_hz).all()
    both_proven = kernel.is_proven & numpy.is_proven
    np.testing.assert_allclose(
        kernel.frequency_hz * both_proven, numpy.frequency_hz * both_proven, rtol=2 * kernel.tolerance
    )


def _found(plan, count):
    try:
        return fx.natural_frequencies(fx.Plan(plan.mechanism), n=count)
    except fx.errors.FlexuraError as error:
        return type(error).__name__
