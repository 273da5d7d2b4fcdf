"""Random walks against distributions known in closed form."""

import numpy as np
import pytest
import scipy.stats as st

from flexura.testing.updating.posterior import effective_draws, metropolis, split_r_hat

FREE = (np.full(2, -np.inf), np.full(2, np.inf))


def test_a_normal_posterior_from_a_wrong_covariance():
    """Correlated by 0.95 and ten times as wide as what the walk starts from."""
    cov = np.array([[4.0, 3.8], [3.8, 4.0]])
    inverse = np.linalg.inv(cov)
    found = metropolis(np.ones(2), 0.4 * np.eye(2), FREE, lambda z: float(z @ inverse @ z) / 2, 16000, 1)
    z = found.z.reshape(-1, 2)
    worth = effective_draws(found.z).min()
    assert found.z.shape == (4, 4000, 2)
    assert worth > 800
    assert split_r_hat(found.z).max() < 1.02
    assert 0.15 < found.acceptance < 0.5
    assert np.abs(z.mean(axis=0)).max() < 4 * 2.0 / np.sqrt(worth)
    assert np.cov(z.T) == pytest.approx(cov, rel=6 * np.sqrt(2 / worth))


def test_a_bound_cuts_the_posterior():
    """A half-normal distribution: mean sqrt(2/pi), 97.5 % quantile that of |N(0, 1)|."""
    bounds = (np.zeros(1), np.array([np.inf]))
    found = metropolis(np.zeros(1), np.eye(1), bounds, lambda z: float(z @ z) / 2, 20000, 2)
    worth = effective_draws(found.z)[0]
    assert found.z.min() >= 0
    assert found.z.mean() == pytest.approx(np.sqrt(2 / np.pi), abs=4 * 0.603 / np.sqrt(worth))
    assert np.quantile(found.z, 0.975) == pytest.approx(st.halfnorm.ppf(0.975), rel=0.06)


def test_effective_draws_of_an_autoregression():
    """x' = a x + noise: n draws are worth n (1 - a)/(1 + a)."""
    rng, a = np.random.default_rng(0), 0.8
    x = np.zeros((4, 20000, 1))
    noise = rng.standard_normal(x.shape)
    for k in range(1, x.shape[1]):
        x[:, k] = a * x[:, k - 1] + noise[:, k]
    assert effective_draws(x)[0] == pytest.approx(80000 * (1 - a) / (1 + a), rel=0.15)
    assert split_r_hat(x)[0] == pytest.approx(1, abs=2e-3)
    assert effective_draws(noise)[0] == pytest.approx(80000, rel=0.1)


def test_chains_that_differ_are_told():
    z = np.random.default_rng(1).standard_normal((4, 500, 1))
    z[0] += 3
    assert split_r_hat(z)[0] > 1.5
    assert effective_draws(z)[0] < 20


def test_diagnostics_are_those_of_their_definitions():
    """Split R-hat and effective sample size as Vehtari et al. (2021, eqs. 1-4 and 10-13) define them, without ranks,
    summed term by term."""
    rng = np.random.default_rng(5)
    noise = rng.standard_normal((4, 64))
    x = sum(noise[:, k : 60 + k] for k in range(5))
    halves = [own for chain in x for own in (chain[:30], chain[30:])]
    assert split_r_hat(x[..., None])[0] == pytest.approx(np.sqrt(_mixed(halves) / _within(halves)), rel=1e-12)

    def rho(t):
        covariances = [sum((c[: 60 - t] - c.mean()) * (c[t:] - c.mean())) / 60 for c in x]
        return 1 - (_within(x) - np.mean(covariances)) / _mixed(x)

    sums, t = [], 0
    while rho(t) + rho(t + 1) > 0:
        sums.append(min([rho(t) + rho(t + 1), *sums]))
        t += 2
    assert 4 <= t < 40, "there is something to sum, and it ends"
    assert effective_draws(x[..., None])[0] == pytest.approx(4 * 60 / (2 * sum(sums) - 1), rel=1e-12)


def _within(chains):
    return np.mean([np.var(c, ddof=1) for c in chains])


def _mixed(chains):
    """Variance of the target estimated over and under: (n - 1)/n W + B/n."""
    n = len(chains[0])
    return (n - 1) / n * _within(chains) + np.var([np.mean(c) for c in chains], ddof=1)


def test_an_interrupt_keeps_what_was_drawn():
    def stop(at):
        if at.done == at.of - 10:
            raise KeyboardInterrupt

    found = metropolis(np.zeros(1), np.eye(1), (FREE[0][:1], FREE[1][:1]), lambda z: float(z @ z) / 2, 400, 3, stop)
    assert not found.is_whole
    assert found.z.shape == (4, 90, 1)
    again = metropolis(np.zeros(1), np.eye(1), (FREE[0][:1], FREE[1][:1]), lambda z: float(z @ z) / 2, 400, 3)
    assert np.array_equal(found.z, again.z[:, :90])
