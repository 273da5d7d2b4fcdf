"""Properties of doubly symmetric cross-sections in their principal axes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.beam._columns import FloatArray, ordered
from flexura.duals import real

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

    A: FloatArray
    Iy: FloatArray
    Iz: FloatArray
    J: FloatArray
    ky: FloatArray
    kz: FloatArray


def rectangle(width: ArrayLike, thickness: ArrayLike, nu: ArrayLike) -> SectionProperties:
    """Return the properties of a solid rectangle, `width` along local y and `thickness` along local z.

    Iy = width thickness^3 / 12; with b >= t the two sides (Timoshenko & Goodier 1970, Sec. 109),
    J = b t^3/3 [1 - 192/pi^5 (t/b) sum_{n odd} tanh(n pi b / 2t) / n^5];
    ky = kz = 10 (1 + nu) / (12 + 11 nu) (Cowper 1966; theory eqs. 6-8).

    width, thickness: (...) m; nu: (...) Poisson's ratio, -. Raises nothing.

    Holds for free warping and an isotropic material: a short leaf with clamped ends is stiffer in torsion
    than J says, and a wide one is stiffer in bending (see `flexura.beam.strip`). The coefficients ignore the aspect
    ratio; for shear across a wide leaf, where it hardly matters, they are too high (Hutchinson 2001).
    """
    b, t, nu = _common_shape(width, thickness, nu)
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


def _common_shape(*values: ArrayLike) -> tuple[FloatArray, ...]:
    arrays = [real(v) for v in values]
    if all(a.shape == arrays[0].shape for a in arrays):
        return tuple(arrays)
    return tuple(np.broadcast_arrays(*arrays))


def _rectangle_torsion(a: FloatArray, b: FloatArray) -> FloatArray:
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
