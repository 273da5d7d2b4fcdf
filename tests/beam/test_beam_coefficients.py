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
def test_kernel_and_numpy(lead, n):
    E, G, rho, section, L, shear = beams(lead, n)
    phi = element.phi(E, G, section, L, shear)
    for calculate in (
        lambda: element.flexibility_coefficients(E, G, section, L, shear),
        lambda: element.mass_coefficients(rho, section, L, 0.0, 0.0, shear),
        lambda: element.mass_coefficients(rho, section, L, *phi, shear),
        lambda: element.mass_coefficients(rho, section, np.broadcast_to(L, (*lead, n)), *phi, shear),
    ):
        kernel, numpy = both(calculate)
        assert kernel.shape == numpy.shape
        np.testing.assert_allclose(kernel, numpy, rtol=1e-14)


def test_stations_and_slopes_are_left_to_numpy():
    E, G, _, section, L, shear = beams((), 4)
    stations = [np.broadcast_to(one[:, None], (4, 6)) for one in section]
    several = element.flexibility_coefficients(E[:, None], G[:, None], stations, L[:, None], shear[:, None])
    np.testing.assert_allclose(several[:, 2], element.flexibility_coefficients(E, G, section, L, shear), rtol=1e-14)
    sloped = element.flexibility_coefficients(Dual(E, np.ones((1, 4))), G, section, L, shear)
    assert isinstance(sloped, Dual)
    np.testing.assert_allclose(sloped.value, element.flexibility_coefficients(E, G, section, L, shear), rtol=1e-14)
