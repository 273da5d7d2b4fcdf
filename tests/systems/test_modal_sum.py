"""Sums over modes by the kernel and in NumPy, beside the sum written out."""

from __future__ import annotations

import numpy as np
import pytest

from flexura.systems.modal_sum import modal_sum
from helpers.kernels import both, compiled

rng = np.random.default_rng(7)


SIZES = [(1, 1, 1, 1), (7, 5, 2, 3), (64, 130, 6, 6), (3, 65, 1, 9), (0, 3, 2, 2)]


def modes(r, p, m):
    omega = np.sort(rng.uniform(10.0, 900.0, r))
    return omega**2, 0.02 * omega, 1e-3 * omega**2, rng.standard_normal((p, r)), rng.standard_normal((r, m))


def written_out(w, square, damping, loss, C, B):
    H = np.zeros((len(w), len(C), B.shape[1]), dtype=complex)
    for i, at in enumerate(w):
        for k in range(len(square)):
            H[i] += np.outer(C[:, k], B[k]) / (square[k] - at**2 + 1j * (at * damping[k] + np.sign(at) * loss[k]))
    return H


@compiled
@pytest.mark.parametrize(
    ("n", "r", "p", "m"), [(1, 1, 1, 1), (7, 5, 2, 3), (64, 130, 6, 6), (3, 65, 1, 9), (0, 3, 2, 2)]
)
def test_kernel_numpy_and_the_sum_written_out(n, r, p, m):
    given = modes(r, p, m)
    w = rng.uniform(-1000.0, 1000.0, n)
    kernel, numpy = both(lambda: modal_sum(w, *given))
    expected = written_out(w, *given)
    scale = np.abs(expected).max(initial=1e-300)
    assert kernel.shape == numpy.shape == (n, p, m)
    assert np.abs(kernel - numpy).max(initial=0.0) < 1e-13 * scale
    assert np.abs(kernel - expected).max(initial=0.0) < 1e-13 * scale


@compiled
def test_outputs_where_inputs_are_make_a_symmetric_response():
    square, damping, loss, C, _ = modes(20, 5, 5)
    w = np.linspace(0.0, 500.0, 33)
    kernel, numpy = both(lambda: modal_sum(w, square, damping, loss, C, C.T.copy()))
    assert np.array_equal(kernel, np.swapaxes(kernel, 1, 2))
    assert np.abs(kernel - numpy).max() < 1e-13 * np.abs(numpy).max()


@compiled
def test_undamped_modes_at_their_frequency_are_infinite_or_no_number_either_way():
    omega = np.array([10.0, 20.0])
    given = omega**2, np.zeros(2), np.zeros(2), np.ones((1, 2)), np.ones((2, 1))
    kernel, numpy = both(lambda: modal_sum(np.array([0.0, 10.0, 15.0]), *given))
    assert np.array_equal(np.isfinite(kernel), np.isfinite(numpy))
    assert not np.isfinite(kernel[1]).any()
