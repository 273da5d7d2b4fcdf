"""Notch contours: end values, tangency, table look-up."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from flexura.beam import notch

T, A, B, R = 0.4e-3, 5e-3, 2e-3, 3e-3
ANGLE = np.radians(35)
CASES = {  # name: (function of xi, half length, thickness at the end)
    "circular": (lambda xi: notch.circular(xi, R, T), R, T + 2 * R),
    "elliptical": (lambda xi: notch.elliptical(xi, A, B, T), A, T + 2 * B),
    "parabolic": (lambda xi: notch.parabolic(xi, A, B, T), A, T + 2 * B),
    "hyperbolic": (lambda xi: notch.hyperbolic(xi, A, B, T), A, T + 2 * B),
    "corner_filleted": (lambda xi: notch.corner_filleted(xi, A, 1e-3, T), A, T + 2e-3),
    "v_shaped": (
        lambda xi: notch.v_shaped(xi, ANGLE, 1e-3, T),
        A,
        T + 2e-3 * (1 - np.cos(ANGLE)) + 2 * (A - 1e-3 * np.sin(ANGLE)) * np.tan(ANGLE),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_contour_is_web_at_centre_symmetric_and_monotone(name):
    h, a, end = CASES[name]
    xi = np.linspace(0, a, 401)
    values = h(xi)
    assert_allclose(values[0], T, rtol=1e-14)
    assert_allclose(values[-1], end, rtol=1e-12)
    assert np.all(np.diff(values) >= 0)
    assert_allclose(h(-xi), values, rtol=0)
    assert_allclose(h(a * (1 + 1e-15)), end, rtol=1e-6)  # round-off at the end is no NaN
    step = 1e-9
    assert abs(h(step) - h(-step)) / step < 1e-9  # horizontal tangent in the middle


@pytest.mark.parametrize(
    ("name", "residual"),
    [  # the implicit equation of the profile, y the distance of the edge from the member axis
        ("circular", lambda x, y: (x**2 + (y - T / 2 - R) ** 2) / R**2 - 1),
        ("elliptical", lambda x, y: (x / A) ** 2 + ((y - T / 2 - B) / B) ** 2 - 1),
        ("parabolic", lambda x, y: (y - T / 2) / B - (x / A) ** 2),
        ("hyperbolic", lambda x, y: (2 * y / T) ** 2 - 1 - (x / A) ** 2 * ((1 + 2 * B / T) ** 2 - 1)),
    ],
)
def test_conic_profiles_lie_on_their_conics(name, residual):
    h, a, _ = CASES[name]
    xi = np.linspace(-a, a, 101)
    assert_allclose(residual(xi, h(xi) / 2), 0, rtol=0, atol=1e-11)


def test_v_notch_is_tangent_and_flanks_have_the_angle():
    h = CASES["v_shaped"][0]
    slope = np.diff(h(np.array([0.0, 1e-7]) + 2e-3)) / 1e-7
    assert_allclose(slope / 2, np.tan(ANGLE), rtol=1e-6)
    x, e = 1e-3 * np.sin(ANGLE), 1e-8
    left, right = (h(x) - h(x - e)) / e, (h(x + e) - h(x)) / e
    assert_allclose(left, right, rtol=1e-4)
    assert_allclose(notch.v_shaped(-2e-3, ANGLE, 0.0, T), T + 4e-3 * np.tan(ANGLE), rtol=1e-14)


def test_corner_fillet_leaves_the_leaf_straight_and_starts_tangent():
    h = CASES["corner_filleted"][0]
    assert np.all(h(np.linspace(-4e-3, 4e-3, 50)) == T)
    assert h(4e-3 + 1e-6) - T == pytest.approx(1e-12 / 1e-3, rel=1e-5)  # s^2/r
    assert notch.corner_filleted(A, A, 0.0, T) == T


def test_ellipse_of_equal_axes_is_a_circle():
    xi = np.linspace(-R, R, 31)
    assert_allclose(notch.elliptical(xi, R, R, T), notch.circular(xi, R, T), rtol=1e-12)


def test_contours_broadcast_over_designs_elements_and_stations():
    xi = np.linspace(-1e-3, 1e-3, 5)
    web = np.linspace(1e-4, 3e-4, 6).reshape(3, 2, 1)
    h = notch.hyperbolic(xi, A, B, web)
    assert h.shape == (3, 2, 5)
    assert h[1, 1, 4] == notch.hyperbolic(1e-3, A, B, web[1, 1, 0])


def test_table_against_numpy_interp_row_by_row():
    rng = np.random.default_rng(3)
    x = np.cumsum(rng.uniform(0.1, 1, size=(4, 7)), axis=-1)
    h = rng.uniform(1, 2, size=(4, 7))
    xi = rng.uniform(-1, 8, size=(4, 25))
    expected = np.array([np.interp(*row) for row in zip(xi, x, h, strict=True)])
    assert_allclose(notch.tabulated(xi, x[:, None, :], h[:, None, :]), expected, rtol=1e-13)
    assert_allclose(notch.tabulated(x[0], x[0], h[0]), h[0], rtol=1e-14)
    assert_allclose(notch.tabulated(0.5, [0, 1, 2], [1, 3, 4]), 2.0)
