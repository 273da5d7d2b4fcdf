"""Notches: thickness along the axis, and what steep flanks add to beam theory.

Contours take the signed distance `xi` from the notch centre and broadcast their arguments against each other; all are
symmetric two-sided notches except `tabulated`. None raises anything. Beyond the notch the formulas are continued
smoothly, or by the end value where they have a vertical tangent; thicknesses there have no meaning. Beam theory on a
contour assumes plane sections, which fails where the profile is steep: against plane-stress finite elements the beam
integral of a right-circular notch is too stiff in rotation by 3 % at t/R = 0.075 and 15 % at t/R = 0.5, and along the
axis by 12 % and 22 %.

`notch_flexibility` takes every slice between two sections as part of a wedge, with the wedge's exact stresses. In a
wedge the sections that stay free of hoop stress are arcs about its apex. Between straight flanks the stresses of a
moment (Carothers 1912) and of an axial force (Michell 1900) are exact; at a kink of the flanks the arc turns into the
next one, and the fan between the two belongs to the notch as well. Beam theory is the limit of a small angle.
"""

from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.beam.frames import Real
from flexura.duals import real


def circular(xi: Real, radius: Real, web: Real) -> Array:
    """Return the thickness of a right-circular notch, h = t + 2 (R - sqrt(R^2 - xi^2)) (theory eq. 22).

    Paros & Weisbord (1965). xi: (...) m; radius R: (...) m; web t, the least thickness: (...) m.
    Returns h: (...) m. The notch ends at |xi| = R with h = t + 2R.
    """
    return web + 2 * _arc_rise(xi, radius)


def elliptical(xi: Real, half_length: Real, depth: Real, web: Real) -> Array:
    """Return the thickness of an elliptical notch, h = t + 2 b (1 - sqrt(1 - (xi/a)^2)) (theory eq. 23).

    Smith, Badami, Dale & Xu (1997). xi: (...) m; half_length a and depth b, the semi-axes along and across
    the member: (...) m; web t: (...) m. Returns h: (...) m. The notch ends at |xi| = a with h = t + 2b.
    """
    inside = _within(xi, half_length) / half_length
    return web + 2 * depth * (1.0 - np.sqrt((1.0 - inside) * (1.0 + inside)))


def parabolic(xi: Real, half_length: Real, depth: Real, web: Real) -> Array:
    """Return the thickness of a parabolic notch, h = t + 2 b (xi/a)^2 (theory eq. 24).

    Lobontiu (2002). xi: (...) m; half_length a, depth b at |xi| = a, web t: (...) m. Returns h: (...) m.
    """
    return real(web + 2 * depth * (xi / half_length) ** 2)


def hyperbolic(xi: Real, half_length: Real, depth: Real, web: Real) -> Array:
    """Return the thickness of a hyperbolic notch, h = sqrt(t^2 + 4 b (b + t) (xi/a)^2) (theory eq. 25).

    Lobontiu (2002). xi: (...) m; half_length a, depth b at |xi| = a, web t: (...) m. Returns h: (...) m.
    """
    return np.sqrt(web * web + 4 * depth * (depth + web) * (xi / half_length) ** 2)


def corner_filleted(xi: Real, half_length: Real, fillet_radius: Real, web: Real) -> Array:
    """Return the thickness of a leaf with circular fillets: t, plus 2 (r - sqrt(r^2 - s^2)) in the fillets.

    s = |xi| - (a - r) is the distance into the fillet, which takes up the last r before each end; Lobontiu,
    Paine, Garcia & Goldfarb (2001; theory eq. 26). xi: (...) m; half_length a >= r, fillet_radius r (may be 0), web t:
    (...) m. Returns h: (...) m; h(a) = t + 2r.
    """
    into = np.abs(xi) - (half_length - fillet_radius)
    return web + 2 * _arc_rise(np.where(into > 0, into, 0.0), fillet_radius)


def v_shaped(xi: Real, angle: Real, root_radius: Real, web: Real) -> Array:
    """Return the thickness of a V notch: a root arc of radius r, tangent to straight flanks (theory eq. 27).

    h = t + 2 (r - sqrt(r^2 - xi^2)) for |xi| <= r sin(angle), from there on h grows by 2 tan(angle) per unit
    length; Tian, Shirinzadeh, Zhang & Zhong (2010). xi: (...) m; angle of the flanks to the member axis,
    0 <= angle < pi/2: (...) rad; root_radius r (0 for a sharp V), web t: (...) m. Returns h: (...) m.
    """
    x = np.abs(xi)
    tangent_point = root_radius * np.sin(angle)
    on_flank = x > tangent_point
    flank = np.where(on_flank, x - tangent_point, 0.0) * np.tan(angle)
    return web + 2 * (_arc_rise(np.where(on_flank, tangent_point, x), root_radius) + flank)


def tabulated(xi: ArrayLike, positions: ArrayLike, thicknesses: ArrayLike) -> Array:
    """Return thicknesses interpolated linearly in a table, held at the end values outside it (theory eq. 28).

    xi: (...) m; positions, strictly increasing, and thicknesses: (..., n) m with n >= 2, whose leading axes
    broadcast against those of xi and of each other. Returns h: (...) m.
    """
    xi, x, h = (real(v) for v in (xi, positions, thicknesses))
    left = x[..., :-1]
    width = x[..., 1:] - left
    ahead = np.clip(xi[..., None] - left, 0.0, width)  # lengths, whose slopes are beyond their round-off
    return h[..., 0] + (ahead / width * (h[..., 1:] - h[..., :-1])).sum(axis=-1)


def _arc_rise(x: Real, radius: Real) -> Array:
    """Return r - sqrt(r^2 - x^2), and r beyond |x| = r."""
    inside = _within(x, radius)
    return real(radius - np.sqrt((radius - inside) * (radius + inside)))


def _within(x: Real, end: Real) -> Array:
    """Return |x|, and `end` beyond it."""
    return np.minimum(x * np.sign(x), end)


_DEGREE = 14
"""Degree of the Chebyshev series, in the square of the angle, of the four functions of the angle: 1e-9 of each."""


def notch_flexibility(
    step: ArrayLike, thickness: ArrayLike, beam: tuple[Array, Array] | None = None
) -> tuple[Array, Array]:
    """Return rotation per moment and stretch per force of every slice of a symmetric notch (theory eqs. F10-F15).

    Twice the strain energy of a plate of unit width and E = 1 under a unit moment or force: per slice
    F(alpha) int dx / (h^3 cos alpha) and N(alpha) int dx / (h cos alpha), tan alpha = h'/2, and at every section
    [G(alpha+) - G(alpha-)]/h^2 and [P(alpha+) - P(alpha-)], half of it to either side; flanks go on straight beyond
    the ends. For small angles 12 int dx/h^3 and int dx/h. What exceeds these is shared out so that no slice has less:
    kinks to a smaller angle, as at the ends, take away from all slices alike.

    step: (...) m, distance of the sections; thickness h: (..., k + 1) m at k + 1 >= 2 of them; beam: what
    `beam_flexibility` says of these, if that is known. Returns two arrays (..., k): 1/m^2 and -.

    Against plane-stress finite elements, for circular, elliptical, parabolic, V-shaped and corner-filleted notches:
    rotation within 0.5 % up to web/radius = 0.2 and 2 % up to 0.5, stretch 4 % and 7 % too soft.
    """
    dx = real(step)[..., None]
    h = real(thickness)
    h0, h1 = h[..., :-1], h[..., 1:]
    half_rise = (h1 - h0) / 2
    angle = np.arctan2(half_rise, dx)
    flank = np.hypot(dx, half_rise)
    rotation, stretch, turn, fan = _of_angle(angle)
    square = 1 / (h * h)
    rotation = rotation * flank * (h0 + h1) / 2 * square[..., :-1] * square[..., 1:]
    beam = beam_flexibility(step, thickness) if beam is None else beam
    stretch = stretch * flank * beam[1] / dx
    return _with_kinks(rotation, turn, square, beam[0]), _with_kinks(stretch, fan, np.ones_like(h), beam[1])


def _with_kinks(slices: Array, kink: Array, weight: Array, beam: Array) -> Array:
    """Slices (..., k) with the fans at k + 1 sections, where the functions `kink` (..., k) jump, times `weight`."""
    none = 0.0 * kink[..., :1]
    jump = (np.concatenate([kink, none], axis=-1) - np.concatenate([none, kink], axis=-1)) * weight
    total = (slices - beam).sum(axis=-1, keepdims=True) + jump.sum(axis=-1, keepdims=True)
    slices = slices - beam
    slices[..., :-1] += jump[..., 1:-1] / 2
    slices[..., 1:] += jump[..., 1:-1] / 2
    excess = np.where(slices > 0, slices, 0.0)
    whole = excess.sum(axis=-1, keepdims=True)
    return beam + excess * np.where(total > 0, total, 0.0) / np.where(whole > 0, whole, 1.0)


def beam_flexibility(step: ArrayLike, thickness: ArrayLike) -> tuple[Array, Array]:
    """Return 12 int dx/h^3 and int dx/h of every slice, h linear in between: what beam theory has instead.

    Arguments and results as in `notch_flexibility`.
    """
    dx = real(step)[..., None]
    h = real(thickness)
    h0, h1 = h[..., :-1], h[..., 1:]
    return 6 * dx * (h0 + h1) / (h0 * h1) ** 2, dx * _mean_inverse(h0, h1)


def wedge_functions(angle: ArrayLike) -> tuple[Array, Array, Array, Array]:
    """Return F, N, dG/dalpha and dP/dalpha at half-angles 0 < alpha <= pi/2 by quadrature (theory eqs. F12-F14).

    With e_M = [4 sin^2 2theta + 2 (cos 2theta - cos 2alpha)^2] / (sin 2alpha - 2 alpha cos 2alpha)^2 and e_N =
    4 cos^2 theta / (2 alpha + sin 2alpha)^2: F = 8 sin^3 alpha int e_M, N = 2 sin alpha int e_N over |theta| < alpha,
    and the same with the weight (cos theta - cos alpha)/(2 sin^2 alpha).

    angle: (...) rad; digits are lost like 1e-16/alpha^2. Returns four arrays (...), -.
    """
    a = np.asarray(angle, dtype=np.float64)[..., None]
    points, weights = legendre.leggauss(24)
    theta = a * points
    s = np.sin(a)
    bending = 4 * np.sin(2 * theta) ** 2 + 2 * (np.cos(2 * theta) - np.cos(2 * a)) ** 2
    bending = bending / (np.sin(2 * a) - 2 * a * np.cos(2 * a)) ** 2 * 8 * s**3
    axial = 8 * s * np.cos(theta) ** 2 / (2 * a + np.sin(2 * a)) ** 2
    fan = (np.cos(theta) - np.cos(a)) / (2 * s * s)
    F, N, dG, dP = ((a * weights * f).sum(axis=-1) for f in (bending, axial, bending * fan, axial * fan))
    return F, N, dG, dP


def _mean_inverse(h0: Array, h1: Array) -> Array:
    """Mean of 1/h over a linear h: ln(h1/h0)/(h1 - h0)."""
    q = (h1 - h0) / (h1 + h0)
    small = np.abs(q) < 1e-3
    safe = np.where(small, 0.5, q)
    series = 1 + q * q * (1 / 3 + q * q / 5)  # artanh(q)/q
    return 2 / (h0 + h1) * np.where(small, series, np.arctanh(safe) / safe)


def _of_angle(angle: Array) -> tuple[Array, Array, Array, Array]:
    """F, N (even) and G, P (odd) of the half-angles (...), |alpha| <= pi/2."""
    square = (angle * (2 / np.pi)) ** 2
    F, N, G, P = _chebyshev_sums(2 * square - 1, _chebyshev_coefficients())
    return F, N, angle * G, angle * P


def _chebyshev_sums(x: Array, coefficients: Array) -> Array:
    """Sums (k, ...) of Chebyshev series, coefficients (degree + 1, k), at x (...)."""
    flat = x.reshape(-1)
    terms, twice = [1.0 + 0.0 * flat, flat], 2 * flat
    while len(terms) < len(coefficients):
        terms.append(twice * terms[-1] - terms[-2])
    sums: Array = coefficients.T @ np.stack(terms)
    return sums.reshape(-1, *x.shape)


@lru_cache(maxsize=1)
def _chebyshev_coefficients() -> Array:
    """Chebyshev coefficients (degree + 1, 4) of F, N, G/alpha and P/alpha in the square of the angle."""
    points = np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
    alpha = np.pi / 2 * np.sqrt((points + 1) / 2)
    F, N, _, _ = wedge_functions(alpha)
    inner, weights = legendre.leggauss(24)
    _, _, dG, dP = wedge_functions(alpha[:, None] * (inner + 1) / 2)
    values = np.stack([F, N, dG @ weights / 2, dP @ weights / 2], axis=-1)
    return np.asarray(np.linalg.solve(chebyshev.chebvander(points, _DEGREE), values), dtype=np.float64)
