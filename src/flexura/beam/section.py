"""Doubly symmetric sections in their principal axes: properties, wide strips with ends held flat, and stresses.

Of wide strips, factors are relative to beam theory and are means over a stretch of the member, so that elements with
them add up to the member's exact flexibility under a constant moment or torque. Lengths run from the middle of `span`:
the member itself when both ends are clamped, twice the member when one is, because the other end then is a line of
symmetry.

Of stresses, internal forces are (..., 6): N, Vy, Vz, N; T, My, Mz, N m, on the section whose outward normal is local
+x; elementary beam theory for slender members, sections far from where loads enter, and factors for notches.

All arguments broadcast against each other; nothing here raises.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.beam.frames import Real, ordered
from flexura.duals import plain, real, with_slopes_of, zeros
from flexura.kernels import Kernel, is_compiled

_compiled = Kernel("rectangles", "aaana")

_SUM_INVERSE_ODD_FIFTH_POWERS = 1.0045237627951384  # 1 + 1/3^5 + 1/5^5 + ... = (31/32) zeta(5)


class SectionProperties(NamedTuple):
    """Section properties of beams; the fields are arrays (...) of one common shape.

    A   area, m^2
    Iy  second moment of area about local y (bending in the xz plane), m^4
    Iz  second moment of area about local z (bending in the xy plane), m^4
    J   Saint-Venant torsion constant, m^4
    ky  shear coefficient for shear along local y: shear stiffness ky G A
    kz  shear coefficient for shear along local z: shear stiffness kz G A
    """

    A: Array
    Iy: Array
    Iz: Array
    J: Array
    ky: Array
    kz: Array


def rectangle(width: ArrayLike, thickness: ArrayLike, nu: ArrayLike) -> SectionProperties:
    """Return the properties of a solid rectangle, `width` along local y and `thickness` along local z.

    Iy = width thickness^3 / 12; with b >= t the two sides (Timoshenko & Goodier 1970, Sec. 109),
    J = b t^3/3 [1 - 192/pi^5 (t/b) sum_{n odd} tanh(n pi b / 2t) / n^5];
    ky = kz = 10 (1 + nu) / (12 + 11 nu) (Cowper 1966; theory eqs. 6-8).

    width, thickness: (...) m; nu: (...) Poisson's ratio, -. Raises nothing.

    Holds for free warping and an isotropic material: a short leaf with clamped ends is stiffer in torsion
    than J says, and a wide one is stiffer in bending (see `flexura.beam.section`). The coefficients ignore the aspect
    ratio; for shear across a wide leaf, where it hardly matters, they are too high (Hutchinson 2001).
    """
    b, t, nu = _common_shape(width, thickness, nu)
    if is_compiled() and with_slopes_of(b, t, nu) is None:
        table: Array = np.empty((len(SectionProperties._fields), *b.shape))
        _compiled(*map(np.ascontiguousarray, (b, t, nu)), b.size, table)
        return SectionProperties(*table)
    A = b * t
    k = 10 * (1 + nu) / (12 + 11 * nu)
    return SectionProperties(A, A * t * t / 12, A * b * b / 12, _rectangle_torsion(b, t), k, k)


def circle(diameter: ArrayLike, nu: ArrayLike) -> SectionProperties:
    """Return the properties of a solid circle (theory eqs. 8-9).

    Iy = Iz = J/2 = pi d^4 / 64; ky = kz = 6 (1 + nu) / (7 + 6 nu) (Cowper 1966).

    diameter: (...) m; nu: (...) Poisson's ratio, -. Raises nothing. Torsion is exact (no warping).
    """
    return tube(diameter, 0.0, nu)


def tube(outer: ArrayLike, inner: ArrayLike, nu: ArrayLike) -> SectionProperties:
    """Return the properties of a hollow circle (theory eqs. 9-10).

    I = Iy = Iz = J/2 = pi (D^4 - d^4) / 64, factored so that a thin wall loses no digits; with m = d/D,
    ky = kz = 6 (1 + nu) (1 + m^2)^2 / [(7 + 6 nu) (1 + m^2)^2 + (20 + 12 nu) m^2] (Cowper 1966).

    outer, inner: diameters (...) m; nu: (...) Poisson's ratio, -. Raises nothing.
    Holds as long as the wall neither buckles nor ovalises.
    """
    D, d, nu = _common_shape(outer, inner, nu)
    A = np.pi / 4 * (D - d) * (D + d)
    I = A * (D * D + d * d) / 16  # noqa: E741
    m2 = (d / D) ** 2
    s = (1 + m2) ** 2
    k = 6 * (1 + nu) * s / ((7 + 6 * nu) * s + (20 + 12 * nu) * m2)
    return SectionProperties(A, I, I, 2 * I, k, k)


def _common_shape(*values: ArrayLike) -> tuple[Array, ...]:
    arrays = [real(v) for v in values]
    if all(a.shape == arrays[0].shape for a in arrays):
        return tuple(arrays)
    return tuple(np.broadcast_arrays(*arrays))


def _rectangle_torsion(a: Array, b: Array) -> Array:
    """Return J, m^4, of rectangles with sides a, b (...), m (theory eq. 7).

    The series is summed as sum 1/n^5 - sum (1 - tanh)/n^5: with b >= t the second sum is below 1e-17 from
    n = 9 on, so four terms give J to round-off for every aspect ratio.
    """
    t, b = ordered(a, b)
    q = np.exp(-np.pi * b / t)  # 1 - tanh(n pi b / 2t) = 2 q^n / (1 + q^n)
    q2 = q * q
    q3 = q2 * q
    q5 = q3 * q2
    q7 = q5 * q2
    tail = q / (1 + q) + q3 / (1 + q3) / 3**5 + q5 / (1 + q5) / 5**5 + q7 / (1 + q7) / 7**5
    series = _SUM_INVERSE_ODD_FIFTH_POWERS - 2 * tail
    return b * t**3 / 3 * (1 - 192 / np.pi**5 * t / b * series)


_SUM_INVERSE_ODD_SIXTH_POWERS = np.pi**6 / 960
_SUM_INVERSE_ODD_SEVENTH_POWERS = 1.0004715486529963  # (127/128) zeta(7)


def anticlastic_compliance(nu: Real, width: Real, span: Real, start: Real, stop: Real) -> Array:
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


def warping_compliance(decay: Real, kappa: Real, span: Real, start: Real, stop: Real) -> Array:
    """Return the mean twist per torque of a bar over [start, stop], as a factor of 1/GJ (theory eqs. F6-F9).

    theta' = T/GJ [1 - kappa cosh(lambda x)/cosh(lambda span/2)], lambda^2 = kappa (1 - nu) J / 2 Gamma and
    kappa = 1/(1 + J/Js): warping is held at clamped ends (Vlasov 1961; Reissner and Stein 1951 for the plate).

    decay lambda: 1/m, and kappa: -, of `warping_decay`; span, start, stop as in the module docstring, m. Returns (...),
    -, between 0 and 1.
    """
    return 1 - kappa * mean_cosh(decay, span, start, stop)


def warping_element(decay: Real, kappa: Real) -> tuple[Array, Array, Array]:
    """Return how elements of a bar twist between ends that may warp (theory eqs. G22, G36-G37).

    A torque t0 + t1 P1 + t2 P2 of Legendre's polynomials and the rates of warping psi, 1/m, at both ends twist it, in
    the means of its rate of twist with these polynomials, by A t length/GJ + B psi length; its ends resist warping
    with GJ (Z psi length - B't) (Vlasov 1961, with the secondary shear of eq. F6).

    decay: that of `warping_decay` over the length, -; kappa: -. Returns A (..., 3, 3), B (..., 3, 2), Z (..., 2, 2), -.
    """
    z, kappa = real(decay) / 2, real(kappa)
    share, tanh, ratio = 1 - kappa, np.tanh(z), _bessel_ratio(z)
    second = 1 / (3 + z * ratio)  # i1/sinh z, then i0/cosh z and i2/cosh z
    first = 1 / (1 + z * z * second)
    third = ratio * z * second * first
    lead = np.broadcast_shapes(z.shape, kappa.shape)
    A, B, Z = (zeros((*lead, *shape), z, kappa) for shape in ((3, 3), (3, 2), (2, 2)))
    A[..., 0, 0] = share + kappa * (1 - first)
    A[..., 1, 1] = share / 3 + kappa * (1 / 3 - second)
    A[..., 2, 2] = share / 5 + kappa * (1 / 5 - (1 + 3 / z**2) * third)
    A[..., 0, 2] = A[..., 2, 0] = -kappa * third
    for end, sign in ((0, -1.0), (1, 1.0)):
        B[..., 0, end], B[..., 1, end], B[..., 2, end] = kappa * first / 2, sign * kappa * second / 2, kappa * third / 2
    alike, opposite = kappa * tanh / (4 * z), kappa / (4 * z * tanh)
    Z[..., 0, 0] = Z[..., 1, 1] = alike + opposite
    Z[..., 0, 1] = Z[..., 1, 0] = alike - opposite
    return A, B, Z


def _bessel_ratio(z: Real) -> Array:
    """Return i2/i1 of the modified spherical Bessel functions of z > 0, -.

    By their recurrence, i[n-1] = i[n+1] + (2n + 1)/z i[n] (Abramowitz and Stegun 1964, eq. 10.2.18): downwards from
    nothing where z is small, upwards from i1/i0 = coth z - 1/z where it is not.
    """
    is_small = plain(z) < 2
    small, large = np.where(is_small, z, 1.0), np.where(is_small, 2.0, z)
    ratio = 0.0 * small
    for n in range(12, 1, -1):
        ratio = small / (2 * n + 1 + small * ratio)
    return np.where(is_small, ratio, 1 / (1 / np.tanh(large) - 1 / large) - 3 / large)


def warping_coupling(x: Real, kappa: Real, held: tuple[bool, bool]) -> Array:
    """Return how elements of a bar twist each other by the warping that they share (theory eq. F27).

    A torque t twists by theta' = [(1 - kappa) t + kappa w]/GJ with w - w''/lambda^2 = t, w = 0 at ends whose warping is
    held and w' = 0 at others (Vlasov 1961): a torque of one in one element twists another by H/(GJ lambda).

    x: lambda times where the elements begin and end (..., n + 1), -; kappa: (..., n) or (..., 1), -; held: which ends
    are. Returns H (..., n, n), -, zero on the diagonal.
    """
    x = real(x)
    start, stop = x[..., :-1], x[..., 1:]
    middle = (start + stop) / 2
    size = np.sqrt(real(kappa)) * -np.expm1(start - stop)
    low = size * _reflected(middle - x[..., :1], held[0])
    high = size * _reflected(x[..., -1:] - middle, held[1])
    whole = 2 * _reflected(x[..., -1:] - x[..., :1], held[0] == held[1])
    before = np.tri(middle.shape[-1], k=-1).T > 0
    apart = np.where(before, start[..., None, :] - stop[..., :, None], 0.0)
    H = np.where(before, low[..., :, None] * high[..., None, :] * np.exp(-apart) / whole[..., None], 0.0)
    return H + np.swapaxes(H, -1, -2)


def warping_shares(x: Real, end: int, both: bool) -> Array:
    """Return the shares of a torque's bimoment at a held end that elements make by it, theirs together being one.

    x as of `warping_coupling`; end: 0 or 1; both: whether the other end is held as well. Returns (..., n), -.
    """
    x = real(x)
    start, stop = x[..., :-1], x[..., 1:]
    middle = (start + stop) / 2
    away, beyond = (start - x[..., :1], x[..., -1:] - middle) if end == 0 else (x[..., -1:] - stop, middle - x[..., :1])
    shares = -np.expm1(start - stop) * _reflected(beyond, both) * np.exp(-away)
    return shares / shares.sum(axis=-1)[..., None]


def _reflected(x: Array, held: bool) -> Array:
    """sinh(x), or cosh(x) where nothing is held, over exp(x)/2."""
    return -np.expm1(-2 * x) if held else 1 + np.exp(-2 * x)


def warping_decay(nu: Real, J: Real, warping: Real, secondary: Real) -> tuple[Array, Array]:
    """Return lambda, 1/m, and kappa, -, of `warping_compliance` (theory eq. F8).

    nu: -; J: Saint-Venant constant, m^4; warping Gamma: m^6; secondary Js: m^4; each (...).
    """
    kappa = 1 / (1 + real(J) / secondary)
    return np.sqrt(kappa * (1 - nu) * J / (2 * warping)), kappa


def mean_cosh(decay: Real, span: Real, start: Real, stop: Real) -> Array:
    """Return the mean of cosh(decay x)/cosh(decay span/2) over [start, stop], with |x| <= span/2.

    decay: 1/m; others m. Exponentials of negative numbers only, so that long spans do not overflow.
    """
    half = real(decay * span / 2)
    ends = []
    for x in (start, stop):
        at = np.abs(decay * x)
        ends.append(np.sign(x) * np.exp(at - half) * -np.expm1(-2 * at) / (1 + np.exp(-2 * half)))
    return (ends[1] - ends[0]) / (decay * (stop - start))


def warping_constant(width: ArrayLike, thickness: ArrayLike) -> Array:
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


def secondary_constant(nu: Real, J: Real, width: ArrayLike, thickness: ArrayLike, span: Real) -> Array:
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


CATALAN = 0.915965594177219
"""1 - 1/3^2 + 1/5^2 - ..."""

Factors = tuple[Real, Real, Real]


def rectangle_torsion_stress(width: ArrayLike, thickness: ArrayLike) -> tuple[Array, Array]:
    """Return the shear stress per torque at the middles of the faces z = +-t/2 and y = +-b/2 (theory eq. S4).

    With s the short and l the long side, s/J [1 - 8/pi^2 sum_{n odd} 1/(n^2 cosh(n pi l/2s))] on the long sides and
    8 s/(pi^2 J) sum_{n odd} (-1)^((n-1)/2) tanh(n pi l/2s)/n^2 on the short ones (Timoshenko & Goodier 1970, Sec. 109).

    width, thickness: (...) m. Returns (...), 1/m^3. Free warping.
    """
    b, t = np.broadcast_arrays(real(width), real(thickness))
    flat = t <= b
    short, long = np.where(flat, t, b), np.where(flat, b, t)
    ratio = long / short
    over_long, over_short = np.zeros_like(short), np.full_like(short, CATALAN)
    for n, sign in ((1, 1), (3, -1), (5, 1), (7, -1), (9, 1), (11, -1), (13, 1), (15, -1)):
        q = np.exp(-n * np.pi * ratio)
        over_long += 2 * np.sqrt(q) / (1 + q) / n**2
        over_short -= sign * 2 * q / (1 + q) / n**2
    J = rectangle(b, t, 0.0).J
    on_long, on_short = short / J * (1 - 8 / np.pi**2 * over_long), short / J * 8 / np.pi**2 * over_short
    return np.where(flat, on_long, on_short), np.where(flat, on_short, on_long)


def flat_notch_factors(ratio: ArrayLike) -> tuple[Array, Array]:
    """Return the factors on the nominal stress at the root of a deep notch in both faces of a flat bar: in tension and
    in bending (theory eqs. S8-S9).

    Neuber (1937) for hyperbolic notches; Peterson's Stress Concentration Factors, ch. 2. ratio: (...) half the web
    over the radius of the root, -; 0 gives 1, infinity infinity.
    """
    x = real(ratio)
    sharp = ~np.isfinite(x)
    x = np.where(sharp, 1.0, x)
    s = np.sqrt(x)
    turn = np.arctan(s)
    with np.errstate(invalid="ignore", divide="ignore"):
        tension = 2 * (x + 1) * s / ((x + 1) * turn + s)
        bending = 4 * x * s / (3 * (s + (x - 1) * turn))
    smooth = x < 1e-5
    tension, bending = np.where(smooth, 1 + 2 * x / 3, tension), np.where(smooth, 1 + 0.4 * x, bending)
    return np.where(sharp, np.inf, tension), np.where(sharp, np.inf, bending)


def round_notch_factors(ratio: ArrayLike, nu: ArrayLike) -> tuple[Array, Array, Array]:
    """Return the factors on the nominal stress at the root of a deep groove around a round bar: in tension, bending
    and torsion (theory eqs. S10-S12).

    Neuber (1937) for hyperbolic grooves; Peterson's Stress Concentration Factors, ch. 2. ratio: (...) radius of the
    neck over the radius of the root, -; nu: (...) Poisson's ratio, -.
    """
    x, nu = np.broadcast_arrays(real(ratio), real(nu))
    sharp = ~np.isfinite(x)
    x = np.where(sharp, 1.0, x)
    s = np.sqrt(x + 1)
    tension = (x * s + (0.5 + nu) * x + (1 + nu) * (s + 1)) / (x + 2 * nu * s + 2)
    below = 3 * (x + 1) + (1 + 4 * nu) * s + (1 + nu) / (1 + s)
    bending = 0.75 * (s + 1) * (3 * x - (1 - 2 * nu) * s + 4 + nu) / below
    torsion = 0.75 * (1 + s) ** 2 / (1 + 2 * s)
    return np.where(sharp, np.inf, tension), np.where(sharp, np.inf, bending), np.where(sharp, np.inf, torsion)


def rectangle_von_mises(force: Array, width: Real, thickness: Real, factors: Factors = (1.0, 1.0, 1.0)) -> Array:
    """Return the largest von Mises stress, Pa, of corners, middles of faces and centre (theory eqs. S2-S4, S6-S7).

    force: (..., 6); width along y, thickness along z: (...) m; factors: on the stress of N, My and Mz.
    """
    N, Vy, Vz, T, My, Mz = np.moveaxis(force, -1, 0)
    A = width * thickness
    kN, ky, kz = factors
    stretch = _raised(kN, N / A)
    over_thickness, over_width = _raised(ky, 6 * My / (A * thickness)), _raised(kz, 6 * Mz / (A * width))
    sums, rests = stretch + over_thickness, stretch - over_thickness
    corner = abs(sums + over_width)
    for stress in (sums - over_width, rests + over_width, rests - over_width):
        corner = np.maximum(corner, abs(stress))
    on_z, on_y = rectangle_torsion_stress(width, thickness)
    slide_y, slide_z = 1.5 * Vy / A, 1.5 * Vz / A
    square = np.maximum(corner**2, (N / A) ** 2 + 3 * (slide_y**2 + slide_z**2))
    for side in (1, -1):
        at_z = (stretch + side * over_thickness) ** 2 + 3 * (slide_y - side * on_z * T) ** 2
        at_y = (stretch - side * over_width) ** 2 + 3 * (slide_z + side * on_y * T) ** 2
        square = np.maximum(square, np.maximum(at_z, at_y))
    return np.sqrt(square)


def round_von_mises(force: Array, outer: Real, inner: Real, factors: Factors = (1.0, 1.0, 1.0)) -> Array:
    """Return the largest von Mises stress, Pa, on the surface: where bending is largest and where shear is (theory eqs.
    S3, S5-S7).

    force: (..., 6); outer, inner: diameters (...) m; factors: on the stress of N, of bending and of T.
    """
    N, Vy, Vz, T, My, Mz = np.moveaxis(force, -1, 0)
    section = tube(outer, inner, 0.0)
    kN, kM, kT = factors
    c = real(outer) / 2
    stretch, twist = _raised(kN, N / section.A), _raised(kT, T * c / section.J)
    d = real(inner) / outer
    slide = 4 / 3 * (1 + d + d * d) / (1 + d * d) / section.A
    bending, shear = np.hypot(My, Mz), np.hypot(Vy, Vz)
    by_bending, by_shear = bending + (bending == 0), shear + (shear == 0)
    square = np.zeros(np.shape(N))
    for y, z in ((-Mz / by_bending, My / by_bending), (Vz / by_shear, -Vy / by_shear)):
        bent, slid = _raised(kM, (My * z - Mz * y) * c / section.Iy), slide * (Vz * y - Vy * z)
        for side in (1, -1):
            square = np.maximum(square, (stretch + side * bent) ** 2 + 3 * (twist + side * slid) ** 2)
    return np.sqrt(square)


def _raised(factor: Real, stress: Array) -> Array:
    """The factor times the stress, where nothing times infinity is nothing."""
    factor, stress = np.broadcast_arrays(real(factor), stress)
    return np.where(np.isinf(factor) & (stress == 0), 0.0, factor) * stress
