"""Intervals of means, shares, percentiles and Sobol indices against closed forms, and how often they hold."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import scipy.stats as st
from scipy.stats import qmc

from flexura.study.tolerances.nets import (
    clopper_pearson,
    indices_of,
    mean_interval,
    order_statistics,
    percentile_interval,
    share_interval,
)

SEEDS = 300
CONFIDENCE = 0.95


@cache
def nets(seed: int, R: int, n: int, d: int) -> np.ndarray:
    return np.stack([qmc.Sobol(d, rng=np.random.default_rng([seed, r])).random(n) for r in range(R)])


def held(hits: int) -> None:
    """So often as an interval of 95 % must hold over the seeds, but for one chance in a thousand."""
    assert hits >= st.binom.ppf(1e-3, SEEDS, CONFIDENCE), hits / SEEDS


def total(u: np.ndarray) -> np.ndarray:
    """A sum of normal numbers with deviations 1, 2, 3: normal, with deviation sqrt(14)."""
    return st.norm.ppf(u) @ np.array([1.0, 2.0, 3.0])[: u.shape[-1]]


@pytest.mark.parametrize("d", [1, 3])
@pytest.mark.parametrize("share", [0.01, 0.05, 0.5, 0.7503, 0.99])
def test_percentile_intervals_hold(d: int, share: float) -> None:
    truth = st.norm.ppf(share) * np.sqrt([1, 5, 14][d - 1])
    found = [percentile_interval(total(nets(k, 16, 64, d)), share, CONFIDENCE) for k in range(SEEDS)]
    held(sum(own.low <= truth <= own.high for own in found))


@pytest.mark.parametrize("d", [1, 3])
@pytest.mark.parametrize("share", [0.002, 0.02, 0.2503, 0.5, 0.97, 0.9999])
def test_yield_intervals_hold(d: int, share: float) -> None:
    limit = st.norm.ppf(share) * np.sqrt([1, 5, 14][d - 1])
    found = [share_interval(total(nets(k, 16, 64, d)) <= limit, CONFIDENCE) for k in range(SEEDS)]
    held(sum(own.low <= share <= own.high for own in found))


def test_mean_intervals_hold_and_are_narrower_than_those_of_independent_samples() -> None:
    found = [mean_interval(np.exp(nets(k, 16, 64, 3) @ [1.0, 1.0, 1.0]), CONFIDENCE) for k in range(SEEDS)]
    truth = (np.e - 1) ** 3
    held(sum(own.low <= truth <= own.high for own in found))
    deviation = np.sqrt(((np.e**2 - 1) / 2) ** 3 - truth**2)
    assert np.median([own.high - own.low for own in found]) < 0.1 * 2 * 1.96 * deviation / np.sqrt(1024)


@pytest.mark.parametrize("share", [0.05, 0.5, 0.99])
def test_intervals_of_independent_samples_hold(share: float) -> None:
    samples = [np.random.default_rng(k).standard_normal((400, 1)) for k in range(SEEDS)]
    truth = st.norm.ppf(share)
    found = [percentile_interval(own, share, CONFIDENCE) for own in samples]
    assert {own.method for own in found} == {"order statistics"}
    held(sum(own.low <= truth <= own.high for own in found))
    shares = [share_interval(own <= truth, CONFIDENCE) for own in samples]
    assert {own.method for own in shares} == {"Clopper-Pearson"}
    held(sum(own.low <= share <= own.high for own in shares))


def test_no_failures_leave_what_three_divided_by_their_number_says() -> None:
    low, high = clopper_pearson(3000, 3000, 0.90)
    assert high == 1.0
    assert 1 - low == pytest.approx(3 / 3000, rel=2e-3)
    assert clopper_pearson(0, 3000, 0.90) == (0.0, pytest.approx(1 - low, rel=1e-9))


@pytest.mark.parametrize(("count", "of"), [(0, 10), (3, 10), (10, 10), (1, 4096), (4000, 4096)])
def test_clopper_and_pearson_as_scipy_has_them(count: int, of: int) -> None:
    truth = st.binomtest(count, of).proportion_ci(0.95, method="exact")
    assert clopper_pearson(count, of, 0.95) == (
        pytest.approx(truth.low, abs=1e-12),
        pytest.approx(truth.high, abs=1e-12),
    )


@pytest.mark.parametrize("count", [10, 59, 400])
@pytest.mark.parametrize("share", [0.01, 0.3, 0.5, 0.95])
def test_order_statistics_hold_at_least_so_often_and_one_rank_less_does_not(count: int, share: float) -> None:
    low, high = order_statistics(count, share, 0.95)
    below = st.binom(count, share).cdf  # of k: probability that at most k samples lie below the quantile
    assert below(low - 1) <= 0.025
    assert below(low) > 0.025
    assert 1 - below(high - 1) <= 0.025
    assert 1 - below(high - 2) > 0.025


def test_a_percentile_beyond_the_samples_has_no_bound() -> None:
    own = percentile_interval(np.arange(100.0)[:, None], 0.9999, 0.95)
    assert own.high == np.inf
    assert np.isfinite(own.low)


def test_without_a_value_there_is_no_percentile() -> None:
    assert np.isnan(percentile_interval(np.full((4, 8), np.nan), 0.5, 0.95).value)


def ishigami(x: np.ndarray) -> np.ndarray:
    return np.sin(x[..., 0]) + 7 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0])


def matrices(seed: int, R: int, n: int, d: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    u = nets(seed, R, n, 2 * d)
    A, B = u[..., :d], u[..., d:]
    AB = np.stack([np.where(np.arange(d) == i, B, A) for i in range(d)])
    return A, B, AB


def test_indices_of_ishigamis_function() -> None:
    """Ishigami and Homma 1990, a = 7, b = 0.1."""
    A, B, AB = (ishigami(np.pi * (2 * own - 1))[..., None] for own in matrices(0, 16, 1024, 3))
    found = indices_of(A, B, AB, 0.95)
    first, whole = np.array([0.3139, 0.4424, 0.0]), np.array([0.5576, 0.4424, 0.2437])
    np.testing.assert_allclose(found.first[:, 0], first, atol=0.003)
    np.testing.assert_allclose(found.total[:, 0], whole, atol=0.003)
    assert np.all(found.first_half < 0.01)
    assert found.used[0] == 16384


def test_intervals_of_ishigamis_indices_hold() -> None:
    b = 0.1
    variance = 7**2 / 8 + b * np.pi**4 / 5 + b**2 * np.pi**8 / 18 + 0.5
    first = np.array([0.5 * (1 + b * np.pi**4 / 5) ** 2, 7**2 / 8, 0.0]) / variance
    whole = first + np.array([1, 0, 1]) * b**2 * np.pi**8 * 8 / 225 / variance
    hits = np.zeros((2, 3), dtype=int)
    for seed in range(SEEDS):
        A, B, AB = (ishigami(np.pi * (2 * own - 1))[..., None] for own in matrices(seed, 16, 64, 3))
        found = indices_of(A, B, AB, CONFIDENCE)
        hits[0] += np.abs(found.first[:, 0] - first) <= found.first_half[:, 0]
        hits[1] += np.abs(found.total[:, 0] - whole) <= found.total_half[:, 0]
    for own in hits.ravel():
        held(own)


def test_the_estimators_are_those_of_scipy_but_for_their_variance() -> None:
    A, B, AB = (ishigami(own) for own in matrices(1, 2, 64, 3))
    theirs = st.sobol_indices(
        func={"f_A": A.reshape(1, -1), "f_B": B.reshape(1, -1), "f_AB": AB.reshape(3, 1, -1)}, n=128
    )
    ours = indices_of(A[..., None], B[..., None], AB[..., None], 0.95)
    scale = np.var([A, B]) / (0.5 * np.mean((A - B) ** 2))
    np.testing.assert_allclose(ours.first[:, 0], scale * np.ravel(theirs.first_order), rtol=1e-12)
    np.testing.assert_allclose(ours.total[:, 0], scale * np.ravel(theirs.total_order), rtol=1e-12)


def test_a_tolerance_that_answers_for_all_has_one_whatever_the_samples() -> None:
    A, B, AB = (own[..., :1] for own in matrices(4, 12, 4, 2))
    found = indices_of(A, B, AB, 0.95)
    np.testing.assert_allclose(found.total[:, 0], [1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.total_half[:, 0], 0.0, atol=1e-12)


def test_what_failed_is_left_out_and_what_is_constant_has_no_index() -> None:
    A, B, AB = (np.stack([own.sum(-1), np.full(own.shape[:-1], 3.0)], axis=-1) for own in matrices(2, 8, 128, 2))
    B[3, 5, 0] = np.nan
    AB[1, 0, 7, 0] = np.nan
    found = indices_of(A, B, AB, 0.95)
    assert found.used.tolist() == [8 * 128 - 2, 8 * 128]
    np.testing.assert_allclose(found.first[:, 0], 0.5, atol=0.01)
    assert np.isnan(found.first[:, 1]).all()
