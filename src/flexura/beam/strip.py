"""Wide strips with ends held flat: how far into the strip anticlastic bending and warping are suppressed.

Factors are relative to beam theory and are means over a stretch of the member, so that elements with them add up to
the member's exact flexibility under a constant moment or torque. Lengths run from the middle of `span`: the member
itself when both ends are clamped, twice the member when one is, because the other end then is a line of symmetry.
All arguments broadcast against each other; nothing here raises.
"""

import numpy as np
import scipy.special
from numpy.typing import ArrayLike

from flexura.beam._columns import FloatArray, Real, ordered
from flexura.duals import real

_SUM_INVERSE_ODD_SIXTH_POWERS = np.pi**6 / 960
_SUM_INVERSE_ODD_SEVENTH_POWERS = 1.0004715486529963  # (127/128) zeta(7)


def anticlastic_compliance(nu: Real, width: Real, span: Real, start: Real, stop: Real) -> FloatArray:
    """Return the mean bending compliance of a strip over [start, stop], as a factor of 1/EI (theory eqs. F1-F5).

    w = w0(x) + f(x) (y^2 - b^2/12) in the Kirchhoff plate energy, f = f' = 0 at clamped ends; the factor is 1 far from
    them and 1 - nu^2 in a strip that is short for its width.

    nu: -1 < nu <= 0.5, -; width b: m; span: m; start < stop: m from the middle of the span. Returns (...), -.
    Holds for rotations small enough that the anticlastic deflection stays below the thickness, b^2/(radius thickness)
    of a few (Ashwell 1950); an antisymmetric moment is met within 1.1 %.
    """
    nu = real(nu)
    p = (1 - nu) / 6
    d = np.sqrt(p * p - (1 - nu * nu) / 180)
    slow, fast = np.sqrt(360 * (p - d)), np.sqrt(360 * (p + d))
    half = span / (2 * width)
    at_slow, at_fast = slow * np.tanh(slow * half), fast * np.tanh(fast * half)
    of_slow = at_fast * mean_cosh(slow / width, span, start, stop)
    of_fast = at_slow * mean_cosh(fast / width, span, start, stop)
    return 1 - nu * nu * (of_slow - of_fast) / (at_fast - at_slow)


def warping_compliance(
    nu: Real, J: Real, warping: Real, secondary: Real, span: Real, start: Real, stop: Real
) -> FloatArray:
    """Return the mean twist per torque of a bar over [start, stop], as a factor of 1/GJ (theory eqs. F6-F9).

    theta' = T/GJ [1 - kappa cosh(lambda x)/cosh(lambda span/2)], lambda^2 = kappa (1 - nu) J / 2 Gamma and
    kappa = 1/(1 + J/Js): warping is held at clamped ends (Vlasov 1961; Reissner and Stein 1951 for the plate).

    nu: -; J: Saint-Venant constant, m^4; warping Gamma: m^6; secondary Js: m^4; span, start, stop as in the module
    docstring, m. Returns (...), -, between 0 and 1.
    """
    decay, kappa = warping_decay(nu, J, warping, secondary)
    return 1 - kappa * mean_cosh(decay, span, start, stop)


def warping_moments(
    nu: Real, J: Real, warping: Real, secondary: Real, span: Real, start: Real, stop: Real
) -> FloatArray:
    """Return the means (..., 5) over [start, stop] of the twist per torque of `warping_compliance` times Legendre's
    polynomials of degree 0 to 4, which run from -1 to 1 there."""
    decay, kappa = warping_decay(nu, J, warping, secondary)
    moments = -real(kappa)[..., None] * _cosh_moments(decay, span, start, stop)
    moments[..., 0] += 1.0
    return moments


def warping_decay(nu: Real, J: Real, warping: Real, secondary: Real) -> tuple[FloatArray, FloatArray]:
    """Return lambda, 1/m, and kappa, -, of `warping_compliance` (theory eq. F8)."""
    kappa = 1 / (1 + real(J) / secondary)
    return np.sqrt(kappa * (1 - nu) * J / (2 * warping)), kappa


def mean_cosh(decay: Real, span: Real, start: Real, stop: Real) -> FloatArray:
    """Return the mean of cosh(decay x)/cosh(decay span/2) over [start, stop], with |x| <= span/2.

    decay: 1/m; others m. Exponentials of negative numbers only, so that long spans do not overflow.
    """
    half = real(decay * span / 2)
    ends = []
    for x in (start, stop):
        at = np.abs(decay * x)
        ends.append(np.sign(x) * np.exp(at - half) * -np.expm1(-2 * at) / (1 + np.exp(-2 * half)))
    return (ends[1] - ends[0]) / (decay * (stop - start))


def _cosh_moments(decay: Real, span: Real, start: Real, stop: Real) -> FloatArray:
    """Return the means (..., 5) of P_n cosh(decay x)/cosh(decay span/2), as `mean_cosh` that of P_0.

    Those of P_n exp(z s) over -1 < s < 1 are the modified spherical Bessel functions (Abramowitz and Stegun 1964,
    eq. 10.2.36).
    """
    decay, middle, half = real(decay), real(start + stop) / 2, (stop - start) / 2
    n = np.arange(5)
    z, at = (decay * half)[..., None], np.abs(decay * middle)[..., None]
    bessel = np.sqrt(np.pi / (2 * z)) * scipy.special.ive(n + 0.5, z)
    size = np.exp(z + at - (decay * span)[..., None] / 2) / (1 + np.exp(-(decay * span)[..., None]))
    even, odd = 1 + np.exp(-2 * at), -np.sign(middle)[..., None] * np.expm1(-2 * at)
    return size * bessel * np.where(n % 2 == 0, even, odd)


def warping_constant(width: ArrayLike, thickness: ArrayLike) -> FloatArray:
    """Return the warping constant Gamma of solid rectangles, m^6 (theory eq. F7).

    With sides b >= t and T_n = tanh(n pi b/2t), Gamma = b^3 t^3/144 - 32 t^5/pi^6 sum_{n odd} [b (3 - T_n^2)/2 -
    3 t T_n/(n pi)]/n^6: the square of Saint-Venant's warping function (Timoshenko & Goodier 1970, Sec. 109) over the
    section. Thin strips have b^3 t^3/144.

    width, thickness: (...) m. The terms beyond n = 7 are summed with T_n = 1, below 1e-9 of the whole.
    """
    t, b = ordered(real(width), real(thickness))
    series = _SUM_INVERSE_ODD_SIXTH_POWERS * b - 3 / np.pi * _SUM_INVERSE_ODD_SEVENTH_POWERS * t
    for n in (1, 3, 5, 7):
        q = np.exp(-n * np.pi * b / t)
        missing = 2 * q / (1 + q)  # 1 - tanh(n pi b / 2t)
        series = series + (b * missing * (2 - missing) / 2 + 3 * t * missing / (n * np.pi)) / n**6
    return b**3 * t**3 / 144 - 32 * t**5 / np.pi**6 * series


def secondary_constant(nu: Real, J: Real, width: ArrayLike, thickness: ArrayLike, span: Real) -> FloatArray:
    """Return the constant Js of solid rectangles for shear that comes with held warping, m^4 (theory eq. F8).

    Js = (Ip - J) / [1 + (1 - tanh z/z)/5], Ip the polar second moment: with Saint-Venant's warping function the energy
    of shear is GJ theta'^2 + G (Ip - J) (theta' - psi)^2; shear across the thickness adds a warping of its own, which
    held ends suppress, z = sqrt(70 (1 - nu)) span/2t. 5 b^3 t/72 for long thin strips. J + Js is never above Ip, the
    stiffness without any warping.

    nu: -; J: Saint-Venant constant, m^4; width, thickness, span as in the module docstring, m. Returns (...), m^4.
    """
    t, b = ordered(real(width), real(thickness))
    z = np.sqrt(70 * (1 - real(nu))) * span / (2 * t)
    small = z < 1e-3
    safe = np.where(small, 1.0, z)
    held = np.where(small, z * z / 3, 1 - np.tanh(safe) / safe)
    return (b * t * (b * b + t * t) / 12 - J) / (1 + held / 5)
