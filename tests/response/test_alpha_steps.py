"""Steps of generalised-alpha by the kernel and in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from flexura.analysis.responses.stepping import STEPS_AT_ONCE, generalised_alpha
from helpers.kernels import both, compiled

rng = np.random.default_rng(3)


def chain(n, massless=()):
    K = sp.diags([[-1e4] * (n - 1), [2.1e4] * n, [-1e4] * (n - 1)], [-1, 0, 1], format="csc")
    mass = np.ones(n)
    mass[list(massless)] = 0.0
    M = sp.diags(mass, format="csc")
    return M, 0.1 * M + 1e-4 * K, K


@compiled
@pytest.mark.parametrize(("rho", "massless"), [(0.0, ()), (0.0, (3, 4)), (0.8, (3, 4)), (1.0, ())])
@pytest.mark.parametrize("count", [1, 2, STEPS_AT_ONCE + 2])
def test_kernel_and_numpy(rho, massless, count):
    M, C, K = chain(30, massless)
    B, u = rng.standard_normal((30, 2)), rng.standard_normal((2, count))
    start = rng.standard_normal(2)
    rest = {"dt": 1e-3, "rho_infinity": rho, "start": start, "impulses": np.zeros(2)}
    kernel, numpy = both(lambda: generalised_alpha(M, C, K, B, u, **rest))
    for own, other in zip(kernel, numpy, strict=True):
        assert own.shape == (30, count)
        assert np.abs(own - other).max() <= 1e-11 * np.abs(other).max()


@compiled
def test_impulses_begin_alike():
    M, C, K = chain(12)
    rest = {"dt": 1e-3, "rho_infinity": 0.9, "start": np.zeros(1), "impulses": np.ones(1)}
    kernel, numpy = both(lambda: generalised_alpha(M, C, K, np.eye(12)[:, :1], np.zeros((1, 40)), **rest))
    assert np.abs(kernel[0] - numpy[0]).max() < 1e-12 * np.abs(numpy[0]).max()
