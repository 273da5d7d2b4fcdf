"""Stresses of sections under internal forces, and how much notches raise them.

Internal forces are (..., 6): N, Vy, Vz, N; T, My, Mz, N m, on the section whose outward normal is local +x. Nothing
here raises. Elementary beam theory: slender members, sections far from where loads enter.
"""

import numpy as np
from numpy.typing import ArrayLike

from flexura.beam._columns import FloatArray, Real
from flexura.beam.section import rectangle, tube
from flexura.duals import real

CATALAN = 0.915965594177219
"""1 - 1/3^2 + 1/5^2 - ..."""

Factors = tuple[Real, Real, Real]


def rectangle_torsion_stress(width: ArrayLike, thickness: ArrayLike) -> tuple[FloatArray, FloatArray]:
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


def flat_notch_factors(ratio: ArrayLike) -> tuple[FloatArray, FloatArray]:
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


def round_notch_factors(ratio: ArrayLike, nu: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
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


def rectangle_von_mises(
    force: FloatArray, width: Real, thickness: Real, factors: Factors = (1.0, 1.0, 1.0)
) -> FloatArray:
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
    for own in (sums - over_width, rests + over_width, rests - over_width):
        corner = np.maximum(corner, abs(own))
    on_z, on_y = rectangle_torsion_stress(width, thickness)
    slide_y, slide_z = 1.5 * Vy / A, 1.5 * Vz / A
    found = np.maximum(corner**2, (N / A) ** 2 + 3 * (slide_y**2 + slide_z**2))
    for side in (1, -1):
        at_z = (stretch + side * over_thickness) ** 2 + 3 * (slide_y - side * on_z * T) ** 2
        at_y = (stretch - side * over_width) ** 2 + 3 * (slide_z + side * on_y * T) ** 2
        found = np.maximum(found, np.maximum(at_z, at_y))
    return np.sqrt(found)


def round_von_mises(force: FloatArray, outer: Real, inner: Real, factors: Factors = (1.0, 1.0, 1.0)) -> FloatArray:
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
    found = np.zeros(np.shape(N))
    for y, z in ((-Mz / by_bending, My / by_bending), (Vz / by_shear, -Vy / by_shear)):
        bent, slid = _raised(kM, (My * z - Mz * y) * c / section.Iy), slide * (Vz * y - Vy * z)
        for side in (1, -1):
            found = np.maximum(found, (stretch + side * bent) ** 2 + 3 * (twist + side * slid) ** 2)
    return np.sqrt(found)


def _raised(factor: Real, stress: FloatArray) -> FloatArray:
    """The factor times the stress, where nothing times infinity is nothing."""
    factor, stress = np.broadcast_arrays(real(factor), stress)
    return np.where(np.isinf(factor) & (stress == 0), 0.0, factor) * stress
