"""Thickness of flexure hinges along their axis.

Every function takes the signed distance `xi` from the notch centre and broadcasts its arguments against each
other; all are symmetric two-sided notches except `tabulated`. None raises anything. Beyond the notch the
formulas are continued smoothly, or by the end value where they have a vertical tangent; thicknesses there
have no meaning. A contour only gives a thickness: beam theory on it assumes plane sections, which fails where
the profile is steep. Against plane-stress finite elements the beam integral of a right-circular notch is too
stiff in rotation by 3 % at t/R = 0.075 and 15 % at t/R = 0.5, and along the axis by 12 % and 22 %; see
`flexura.beam.wedge`.
"""

import numpy as np
from numpy.typing import ArrayLike

from flexura.beam._columns import FloatArray, Real
from flexura.duals import real


def circular(xi: Real, radius: Real, web: Real) -> FloatArray:
    """Return the thickness of a right-circular notch, h = t + 2 (R - sqrt(R^2 - xi^2)) (theory eq. 22).

    Paros & Weisbord (1965). xi: (...) m; radius R: (...) m; web t, the least thickness: (...) m.
    Returns h: (...) m. The notch ends at |xi| = R with h = t + 2R.
    """
    return web + 2 * _arc_rise(xi, radius)


def elliptical(xi: Real, half_length: Real, depth: Real, web: Real) -> FloatArray:
    """Return the thickness of an elliptical notch, h = t + 2 b (1 - sqrt(1 - (xi/a)^2)) (theory eq. 23).

    Smith, Badami, Dale & Xu (1997). xi: (...) m; half_length a and depth b, the semi-axes along and across
    the member: (...) m; web t: (...) m. Returns h: (...) m. The notch ends at |xi| = a with h = t + 2b.
    """
    inside = _within(xi, half_length) / half_length
    return web + 2 * depth * (1.0 - np.sqrt((1.0 - inside) * (1.0 + inside)))


def parabolic(xi: Real, half_length: Real, depth: Real, web: Real) -> FloatArray:
    """Return the thickness of a parabolic notch, h = t + 2 b (xi/a)^2 (theory eq. 24).

    Lobontiu (2002). xi: (...) m; half_length a, depth b at |xi| = a, web t: (...) m. Returns h: (...) m.
    """
    return real(web + 2 * depth * (xi / half_length) ** 2)


def hyperbolic(xi: Real, half_length: Real, depth: Real, web: Real) -> FloatArray:
    """Return the thickness of a hyperbolic notch, h = sqrt(t^2 + 4 b (b + t) (xi/a)^2) (theory eq. 25).

    Lobontiu (2002). xi: (...) m; half_length a, depth b at |xi| = a, web t: (...) m. Returns h: (...) m.
    """
    return np.sqrt(web * web + 4 * depth * (depth + web) * (xi / half_length) ** 2)


def corner_filleted(xi: Real, half_length: Real, fillet_radius: Real, web: Real) -> FloatArray:
    """Return the thickness of a leaf with circular fillets: t, plus 2 (r - sqrt(r^2 - s^2)) in the fillets.

    s = |xi| - (a - r) is the distance into the fillet, which takes up the last r before each end; Lobontiu,
    Paine, Garcia & Goldfarb (2001; theory eq. 26). xi: (...) m; half_length a >= r, fillet_radius r (may be 0), web t:
    (...) m. Returns h: (...) m; h(a) = t + 2r.
    """
    into = np.abs(xi) - (half_length - fillet_radius)
    return web + 2 * _arc_rise(np.where(into > 0, into, 0.0), fillet_radius)


def v_shaped(xi: Real, angle: Real, root_radius: Real, web: Real) -> FloatArray:
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


def tabulated(xi: ArrayLike, positions: ArrayLike, thicknesses: ArrayLike) -> FloatArray:
    """Return thicknesses interpolated linearly in a table, held at the end values outside it (theory eq. 28).

    xi: (...) m; positions, strictly increasing, and thicknesses: (..., n) m with n >= 2, whose leading axes
    broadcast against those of xi and of each other. Returns h: (...) m.
    """
    xi, x, h = (real(v) for v in (xi, positions, thicknesses))
    left = x[..., :-1]
    width = x[..., 1:] - left
    ahead = np.clip(xi[..., None] - left, 0.0, width)  # lengths, whose slopes are beyond their round-off
    return h[..., 0] + (ahead / width * (h[..., 1:] - h[..., :-1])).sum(axis=-1)


def _arc_rise(x: Real, radius: Real) -> FloatArray:
    """Return r - sqrt(r^2 - x^2), and r beyond |x| = r."""
    inside = _within(x, radius)
    return real(radius - np.sqrt((radius - inside) * (radius + inside)))


def _within(x: Real, end: Real) -> FloatArray:
    """Return |x|, and `end` beyond it."""
    return np.minimum(x * np.sign(x), end)
