"""Cross-sections against published tables and closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.special import zeta

from flexura.beam import circle, rectangle, tube

SIDES = st.floats(min_value=1e-5, max_value=1e-1)


@pytest.mark.parametrize(
    ("aspect", "k1", "tolerance"),
    [
        # Timoshenko & Goodier (1970), Sec. 109: J = k1 (2a)^3 (2b)
        (1.0, 0.1406, 5e-5),
        (1.2, 0.166, 5.1e-4),
        (1.5, 0.196, 5e-4),
        (2.0, 0.229, 5e-4),
        (3.0, 0.263, 5e-4),
        (5.0, 0.291, 5e-4),
        (10.0, 0.312, 5e-4),
        (1e6, 0.333, 5e-4),
        (1.0, 0.140577014955153, 1e-14),  # more digits of the square
    ],
)
def test_torsion_constant_of_rectangle_against_the_table(aspect, k1, tolerance):
    assert abs(rectangle(aspect * 2e-3, 2e-3, 0.3).J / (aspect * 2e-3**4) - k1) < tolerance


@settings(max_examples=200, deadline=None)
@given(b=SIDES, t=SIDES)
def test_torsion_constant_of_rectangle_against_the_long_series(b, t):
    # The other of the two series of Saint-Venant: sides exchanged, 4000 terms and the integral of the rest.
    short, long = min(b, t), max(b, t)
    n = np.arange(1, 8001, 2)
    series = np.sum(np.tanh(n * np.pi * short / (2 * long)) / n**5.0) + 1 / (8 * 8000.0**4)
    scale = long**3 * short / 3  # of which the bracket leaves (short/long)^2: digits cancel
    J = scale * (1 - 192 / np.pi**5 * long / short * series)
    assert abs(rectangle(b, t, 0.3).J - J) < 1e-12 * scale * long / short
    assert rectangle(b, t, 0.3).J == rectangle(t, b, 0.3).J


def test_torsion_constant_of_thin_strip():
    ratio = np.array([1e2, 1e3, 1e4, 1e8])
    t = 1e-4
    J = rectangle(ratio * t, t, 0.3).J
    end_loss = 192 / np.pi**5 * 31 / 32 * zeta(5)  # the familiar 0.630 t/b
    assert_allclose(end_loss, 0.630, rtol=0, atol=5e-4)
    assert_allclose(J, ratio * t**4 / 3 * (1 - end_loss / ratio), rtol=1e-14)


def test_soft_axis_and_area_of_rectangle():
    s = rectangle(10e-3, 0.5e-3, 0.33)
    assert_allclose(s.A, 5e-6, rtol=1e-14)
    assert_allclose(s.Iy, 10e-3 * 0.5e-3**3 / 12, rtol=1e-14)
    assert_allclose(s.Iz, 0.5e-3 * 10e-3**3 / 12, rtol=1e-14)


def test_shear_coefficients_of_cowper():
    # Cowper (1966): values at nu = 0.3 printed to three digits, and the nu = 0 limits 5/6, 6/7, 1/2
    assert_allclose(rectangle(1.0, 2.0, 0.3).ky, 0.850, rtol=0, atol=5e-4)
    assert_allclose(circle(1.0, 0.3).ky, 0.886, rtol=0, atol=5e-4)
    assert_allclose(tube(1.0, 1.0 - 1e-9, 0.3).kz, 0.531, rtol=0, atol=5e-4)
    assert_allclose(rectangle(1.0, 2.0, 0.0).kz, 5 / 6, rtol=1e-14)
    assert_allclose(circle(1.0, 0.0).kz, 6 / 7, rtol=1e-14)
    assert_allclose(tube(1.0, 1.0 - 1e-12, 0.0).ky, 0.5, rtol=1e-9)


def test_tube_is_difference_of_circles_and_thin_tube_keeps_its_digits():
    D, d = 12e-3, 9e-3
    outer, inner, hollow = circle(D, 0.3), circle(d, 0.3), tube(D, d, 0.3)
    for field in ("A", "Iy", "Iz", "J"):
        assert_allclose(getattr(hollow, field), getattr(outer, field) - getattr(inner, field), rtol=1e-13)
    wall = 2.0**-40
    thin = tube(1.0, 1.0 - 2 * wall, 0.3)
    assert_allclose(thin.A, np.pi * (1 - wall) * wall, rtol=1e-14)
    assert_allclose(thin.J, np.pi / 4 * wall, rtol=1e-11)


def test_sections_broadcast_to_one_shape():
    s = rectangle(np.full((3, 1), 1e-2), np.linspace(1e-3, 2e-3, 4), 0.3)
    assert {np.shape(field) for field in s} == {(3, 4)}
    assert_allclose(s.J[2, 1], rectangle(1e-2, 1e-3 + 1e-3 / 3, 0.3).J, rtol=1e-15)
    assert rectangle(2, 1, 0).Iz == pytest.approx(8 / 12)  # integers are numbers too
