"""Certificates hold: every interval is checked against all eigenvalues of the full-order model.

The reference is LAPACK's dense solver, each eigenvalue then evaluated as a Rayleigh quotient in extended precision: its
error is the square of that of the eigenvector, while stiffnesses spread over ten decades leave a dense solver six to
eight digits of the lowest eigenvalues.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.linalg import Pencil, enclose, lowest
from flexura.reduction.certificates import certificate, lowest_pairs
from flexura.reduction.chained_model import chained
from flexura.reduction.model import certify
from helpers.random_mechanisms import FEW, mechanisms
from helpers.true_frequencies import holds, true_frequencies

MANY = settings(FEW, max_examples=300)
EXAMPLES = Path(__file__).parents[2] / "examples"


def _certificates_hold(mechanism, keep, n):
    plan = fx.Plan(mechanism)
    low, model = fx.reduce(plan, keep=keep), fx.assemble(plan)
    assume(low.order > 0 and model.order < 700)
    assert holds(certify(low, model, n=n), true_frequencies(model))


@FEW
@given(mechanisms(), st.integers(0, 3), st.integers(1, 12))
def test_certificates_hold(mechanism, keep, n):
    _certificates_hold(mechanism, keep, n)


@pytest.mark.slow
@MANY
@given(mechanisms(), st.integers(0, 3), st.integers(1, 12))
def test_hundreds_of_certificates_hold(mechanism, keep, n):
    _certificates_hold(mechanism, keep, n)


@FEW
@given(mechanisms(grounded=False), st.integers(7, 12))
def test_certificates_hold_for_floating_mechanisms(mechanism, n):
    low, model = fx.reduce(mechanism, keep=1), fx.assemble(mechanism)
    assume(model.order < 500)
    proof = certify(low, model, n=n)
    true = true_frequencies(model)
    assert proof.count == int((true < proof.below_hz).sum())
    elastic = true[6 : len(proof.frequency_hz)]
    assert (proof.lower_hz[6:] <= elastic).all() or not proof.is_complete
    if proof.is_complete:
        assert (elastic <= proof.upper_hz[6:]).all()


@FEW
@given(mechanisms(), st.floats(1.2, 8.0), st.sampled_from([1e-2, 1e-4, 1e-6]))
def test_reduction_to_a_tolerance_meets_it(mechanism, reach, tolerance):
    model = fx.assemble(mechanism)
    assume(model.order < 500)
    true = true_frequencies(model)
    up_to = reach * true[0]
    low = fx.reduce(mechanism, tolerance=tolerance, up_to=up_to)
    hz = np.sqrt(lowest(low.K, low.M, low.order).values) / (2 * np.pi)
    wanted = true[true <= up_to]
    assert len(wanted) <= low.order
    assert (np.abs(hz / true[: low.order] - 1) <= 1.01 * tolerance + 1e-7).all()
    assert low.order - len(wanted) <= (np.diff(true[: low.order + 1]) < 2e-4 * true[: low.order]).sum() + 1


def test_intervals_are_as_narrow_as_the_error_of_the_reduction():
    mechanism = fx.load(EXAMPLES / "rpr" / "rpr.yaml")
    proof = certify(fx.reduce(mechanism), n=6)
    true = true_frequencies(fx.assemble(mechanism), 6)
    error = proof.frequency_hz / true - 1
    assert proof.is_complete
    assert np.median(proof.error_bound / error) < 1.1


def test_a_blind_reduction_is_told_apart():
    mechanism = fx.load(EXAMPLES / "rpr" / "rpr.yaml")
    proof = certify(fx.reduce(mechanism), n=12)
    assert (proof.found, proof.missing) == (12, 6)
    assert proof.is_indexed.tolist() == [True] * 6 + [False] * 6
    assert proof.upper_hz[10] / proof.lower_hz[10] > 1.2
    complete = certify(fx.reduce(mechanism, keep=2), n=12)
    assert complete.is_complete and complete.error_bound.max() < 3e-4


def test_shift_between_eigenvalues_counts_and_bounds_a_chain():
    # fixed-free chain of n equal masses and springs: lambda_k = 4 sin^2((2k - 1) pi / (4n + 2))
    n = 40
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[-1, -1] = 1.0
    exact = 4 * np.sin((2 * np.arange(1, n + 1) - 1) * np.pi / (4 * n + 2)) ** 2
    x = (np.arange(n) + 1.0) / n
    trial = np.sin(np.pi / 2 * np.outer(x, [1, 3, 5]))
    found = enclose(Pencil.of(K, np.eye(n)), trial, (exact[2] + exact[3]) / 2)
    assert found.most == 3
    assert (found.lower <= exact[:3]).all() and (exact[:3] <= found.upper).all()
    assert (found.lower > 0.9 * exact[:3]).all() and (found.upper < 1.1 * exact[:3]).all()


def test_pairs_of_the_full_model_are_certified_to_round_off():
    model = fx.assemble(fx.load(EXAMPLES / "xy_stage" / "xy_stage.yaml"))
    full = chained(model)
    proof = certificate(full, lowest_pairs(full, 12), 6)
    assert proof.is_complete and proof.error_bound.max() < 1e-9


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tolerance": 1e-3}, "belong together"),
        ({"up_to": 100.0}, "belong together"),
        ({"tolerance": 2.0, "up_to": 100.0}, "between 0 and 1"),
        ({"tolerance": 1e-3, "up_to": -1.0}, "positive frequency"),
        ({"tolerance": 1e-3, "up_to": 1e-3}, "the lowest is"),
        ({"tolerance": 1e-3, "up_to": 100.0, "keep": 2}, "either"),
        ({"tolerance": 1e-3, "up_to": 100.0, "coordinates": "vague"}, "vague"),
        ({"static_at": ["nowhere"]}, "nowhere"),
    ],
)
def test_impossible_options_are_refused(options, words):
    mechanism = fx.load(EXAMPLES / "pivot" / "pivot.yaml")
    with pytest.raises(fx.OptionError, match=words):
        fx.reduce(mechanism, **options)


def test_tolerance_beyond_round_off_is_refused():
    with pytest.raises(fx.SolverError, match=r"of order low: .* ask for order full, or a larger tolerance"):
        fx.reduce(fx.load(EXAMPLES / "pivot" / "pivot.yaml"), tolerance=1e-15, up_to=1000.0)
