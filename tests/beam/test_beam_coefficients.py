"""Numbers of which flexibility and mass are made, by kernels and in NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flexura.beam import element
from flexura.beam.section import rectangle
from flexura.duals import Dual
from helpers.kernels import both, compiled

pytestmark = compiled


def beams(lead, n, seed=0):
    rng = np.random.default_rng(seed)
    E, G, rho = rng.uniform(1.0, 2.0, (3, *lead, n))
    b, t = rng.uniform(1e-3, 1e-2, (2, *lead, n))
    section = rectangle(b, t, np.full((*lead, n), 0.3))
    return E * 1e11, G * 4e10, rho * 5e3, section, rng.uniform(0.01, 0.1, n), rng.integers(0, 2, n).astype(float)


@pytest.mark.parametrize("lead", [(), (1,), (7,)])
@pytest.mark.parametrize("n", [1, 5])
def test_coefficients_by_kernel_and_numpy(lead, n):
    E, G, rho, section, L, shear = beams(lead, n)
    moduli, actual, rotary = np.stack([E, G, rho]), np.stack(section), shear[::-1].copy()
    stiff = actual * np.array([1.1, 0.9, 1.2, 1.3, 0.8, 0.7]).reshape(-1, *np.ones_like(actual.shape[1:]))
    for length in (L, L + np.zeros((*lead, n))):
        kernel, numpy = both(lambda length=length: element.coefficients(moduli, stiff, actual, length, shear, rotary))
        assert kernel[2] and not numpy[2]
        for one, other in zip(kernel[:2], numpy[:2], strict=True):
            assert one.shape == other.shape
            np.testing.assert_allclose(one, other, rtol=1e-14)


@pytest.mark.parametrize("row", range(6))
@pytest.mark.parametrize("value", [-1.0, 0.0, np.nan, np.inf])
def test_elements_that_cannot_be_are_told(row, value):
    """Of one section property of one design; a rigid one has no flexibility."""
    E, G, rho, section, L, _ = beams((3,), 4)
    moduli, wrong, ones = np.stack([E, G, rho]), np.stack(section), np.ones(4)
    wrong[row, 1, 2] = value if row < 4 else value * np.inf
    flexible, massive, is_sound = element.coefficients(moduli, wrong, wrong, L, ones, ones)
    diagonals = np.concatenate([flexible[..., [0, 1, 2, 4, 5, 7]], massive[..., [0, 1, 2, 6, 8, 12]]], axis=-1)
    good = (diagonals >= np.repeat([np.finfo(float).tiny, 0.0], 6)) & (diagonals < np.inf)
    assert is_sound == good.all()
    assert element.coefficients(moduli, np.stack(section), np.stack(section), L, ones, ones)[2]


@pytest.mark.parametrize("shape", [(), (1,), (7, 5)])
def test_rectangles_by_kernel_and_numpy(shape):
    b, t, nu = np.random.default_rng(3).uniform(0.1, 0.45, (3, *shape))
    kernel, numpy = both(lambda: rectangle(b, t / 20, nu))
    for one, other in zip(kernel, numpy, strict=True):
        assert np.shape(one) == np.shape(other)
        np.testing.assert_allclose(one, other, rtol=1e-14)


def test_slopes_are_left_to_numpy():
    E, G, rho, section, L, shear = beams((), 4)
    moduli, table = np.stack([E, G, rho]), np.stack(section)
    sloped = element.coefficients(Dual(moduli, np.ones((1, 3, 4))), table, table, L, shear, shear)
    plain = element.coefficients(moduli, table, table, L, shear, shear)
    for one, other in zip(sloped[:2], plain[:2], strict=True):
        assert isinstance(one, Dual)
        np.testing.assert_allclose(one.value, other, rtol=1e-14)
    assert isinstance(rectangle(Dual(E, np.ones((1, 4))), G, 0.3).J, Dual)
