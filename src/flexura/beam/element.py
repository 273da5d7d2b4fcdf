"""The uniform spatial beam element: flexibility, stiffness, shape functions and consistent mass.

One formula covers three theories. `shear` = 0, `rotary` = 0 is Euler-Bernoulli, `shear` = 0, `rotary` = 1 the
Rayleigh beam of the RPR paper (eqs. 12-18), `shear` = 1, `rotary` = 1 Timoshenko. The Timoshenko element is
exact for end loads: it does not lock and its nodal static displacements are those of the theory.

`UniformBeam` has the theory folded into its rigidities and inertias per length, all that the dynamics of a beam depends
on: without shear its shear flexibilities are zero, without rotary inertia its rotary inertias are, and effective
rigidities stand for effects beyond beam theory.

Arguments shared by the functions below; all broadcast against each other to the element shape (...):

E, G      Young's and shear modulus, Pa
rho       density, kg/m^3
section   SectionProperties, SI
length    L > 0, m
shear     0 or 1, -: whether shear deforms the element
rotary    0 or 1, -: whether the bending rotary inertia rho Iy, rho Iz counts

Matrices act on the freedoms (tx ty tz rx ry rz) of i, then of j, in local axes: their entries are N/m, N and
N m for stiffness; kg, kg m and kg m^2 for mass; m/N, 1/N and 1/(N m) for flexibility. Nothing here raises.

The theory holds for slender straight members, small strains and rotations, and doubly symmetric sections that
warp freely. Without shear and rotary inertia the frequencies are too high by about 7 (depth/wavelength)^2.
"""

from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.beam.frames import Real, arm_along_x, basis_of, columns, combine, symmetric
from flexura.beam.section import SectionProperties
from flexura.duals import plain, real, with_slopes_of
from flexura.kernels import Kernel, is_compiled
from flexura.linalg import unit_scale

# Freedoms of the one-dimensional parts of the element, as (freedom, sign). A rotation +ry lowers tz along +x,
# so bending in the xz plane is bending in the xy plane with the rotation reversed.
_AXIAL = ((0, 1), (6, 1))
_TORSION = ((3, 1), (9, 1))
_BENDING_XY = ((1, 1), (5, 1), (7, 1), (11, 1))
_BENDING_XZ = ((2, 1), (4, -1), (8, 1), (10, -1))

_STRETCH = symmetric({(0, 0): 1, (0, 1): -1, (1, 1): 1})
_BEND = (  # on (v_i, theta_i, v_j, theta_j)
    symmetric({(0, 0): 1, (0, 2): -1, (2, 2): 1}),  # 12 EI / L^3
    symmetric({(0, 1): 1, (0, 3): 1, (1, 2): -1, (2, 3): -1}),  # 6 EI / L^2
    symmetric({(1, 1): 1, (3, 3): 1}),  # (4 + phi) EI / L
    symmetric({(1, 3): 1}),  # (2 - phi) EI / L
)
STIFFNESS_BASIS = basis_of(
    12,
    [
        (_AXIAL, _STRETCH),
        (_TORSION, _STRETCH),
        *((_BENDING_XY, pattern) for pattern in _BEND),
        *((_BENDING_XZ, pattern) for pattern in _BEND),
    ],
)

_LINEAR = symmetric({(0, 0): 1 / 3, (0, 1): 1 / 6, (1, 1): 1 / 3})
_SWAY = (  # on (v_i, theta_i, v_j, theta_j), in the order of the columns of _MASS_POLYNOMIALS
    symmetric({(0, 0): 1, (2, 2): 1}),
    symmetric({(0, 1): 1, (2, 3): -1}),
    symmetric({(0, 2): 1}),
    symmetric({(0, 3): 1, (1, 2): -1}),
    symmetric({(1, 1): 1, (3, 3): 1}),
    symmetric({(1, 3): 1}),
)
MASS_BASIS = basis_of(
    12,
    [
        (_AXIAL, _LINEAR),
        (_TORSION, _LINEAR),
        *((_BENDING_XY, pattern) for pattern in _SWAY),
        *((_BENDING_XZ, pattern) for pattern in _SWAY),
    ],
)
_MASS_POLYNOMIALS = np.array(
    [  # v_i v_i, v_i theta_i, v_i v_j, v_i theta_j, theta_i theta_i, theta_i theta_j
        [13 / 35, 11 / 210, 9 / 70, -13 / 420, 1 / 105, -1 / 140],  # rho A L / (1 + phi)^2
        [7 / 10, 11 / 120, 3 / 10, -3 / 40, 1 / 60, -1 / 60],  # ... phi
        [1 / 3, 1 / 24, 1 / 6, -1 / 24, 1 / 120, -1 / 120],  # ... phi^2
        [6 / 5, 1 / 10, -6 / 5, 1 / 10, 2 / 15, -1 / 30],  # rho I / L / (1 + phi)^2
        [0, -1 / 2, 0, -1 / 2, 1 / 6, -1 / 6],  # ... phi
        [0, 0, 0, 0, 1 / 3, 1 / 6],  # ... phi^2
    ]
)

_compiled = Kernel("beam_coefficients", "aaaaaaannnaa")

_END_XY, _END_XZ = _BENDING_XY[:2], _BENDING_XZ[:2]
_DEFLECT = ({(0, 0): 1}, {(0, 1): 1}, {(1, 0): 1}, {(1, 1): 1})  # v per F, v per M, theta per F, theta per M
FLEXIBILITY_BASIS = basis_of(
    6,
    [
        (_AXIAL, {(0, 0): 1}),
        (_TORSION, {(0, 0): 1}),
        *((_END_XY, pattern) for pattern in _DEFLECT),
        *((_END_XZ, pattern) for pattern in _DEFLECT),
    ],
)

_PAIR = (symmetric({(0, 0): 1}), symmetric({(0, 1): 1}), symmetric({(1, 1): 1}))
END_FLEXIBILITY_BASIS = basis_of(
    6,
    [
        (_AXIAL, {(0, 0): 1}),
        (_TORSION, {(0, 0): 1}),
        *((_END_XY, pattern) for pattern in _PAIR),
        *((_END_XZ, pattern) for pattern in _PAIR),
    ],
)
_FOUR = [symmetric({(i, j): 1}) for i in range(4) for j in range(i, 4)]
MASS_ENTRIES = basis_of(
    12,
    [
        *((_AXIAL, pattern) for pattern in _PAIR),
        *((_TORSION, pattern) for pattern in _PAIR),
        *((_BENDING_XY, pattern) for pattern in _FOUR),
        *((_BENDING_XZ, pattern) for pattern in _FOUR),
    ],
)


def phi(E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> tuple[Real, Real]:
    """Return the shear parameters of the two bending planes (theory eq. 14).

    phi_y = 12 E Iz / (ky G A L^2) in the xy plane, phi_z = 12 E Iy / (kz G A L^2) in the xz plane, both times
    `shear` (Przemieniecki 1968, Sec. 5.6).

    Arguments as in the module docstring. Returns (phi_y, phi_z), each (...), -.
    """
    factor = 12 * shear * E / (G * section.A * (length * length))
    return factor * section.Iz / section.ky, factor * section.Iy / section.kz


def partial_flexibility(x: Real, E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> Array:
    """Return S(x), the displacement at x per unit load at end j, with end i clamped (theory eq. 11).

    In the xy plane, v = F [(L x^2/2 - x^3/6)/EIz + x/(ky G A)] + M x^2/2EIz, theta = F (L x - x^2/2)/EIz +
    M x/EIz; the xz plane alike with the rotation reversed (Timoshenko beam under end loads).

    x: (...) m, from i; other arguments as in the module docstring. Returns (..., 6, 6), row: displacement at
    x, column: load at j.
    """
    A, Iy, Iz, J, ky, kz = section
    half = x * x / 2
    force = x * (length - x / 2)  # integral of the lever arm L - x
    deflection = half * (length - x / 3)  # integral of `force`
    slide = shear * x / (G * A)
    by, bz = 1 / (E * Iy), 1 / (E * Iz)
    coefficients = columns(
        x / (E * A),
        x / (G * J),
        *(deflection * bz + slide / ky, half * bz, force * bz, x * bz),
        *(deflection * by + slide / kz, half * by, force * by, x * by),
    )
    return combine(coefficients, FLEXIBILITY_BASIS, 6)


def flexibility_coefficients(E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> Array:
    """Return the eight numbers of which the flexibility is the linear combination with END_FLEXIBILITY_BASIS.

    L/EA, L/GJ, then per bending plane (xy, xz) L^3/3EI + shear L/kGA, L^2/2EI, L/EI (theory eq. 12).

    Arguments as in the module docstring. Returns (..., 8): m/N, 1/(N m), then per plane m/N, 1/N, 1/(N m).
    """
    A, Iy, Iz, J, ky, kz = section
    half, third = length * length / 2, length * length * length / 3
    slide = shear * length / (G * A)
    by, bz = 1 / (E * Iy), 1 / (E * Iz)
    return columns(
        length / (E * A),
        length / (G * J),
        *(third * bz + slide / ky, half * bz, length * bz),
        *(third * by + slide / kz, half * by, length * by),
    )


def flexibility(E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> Array:
    """Return C, the displacement of end j per unit load there, with end i clamped: k_k^-1 of eq. 18 (theory eq. 12).

    C = S(L) of `partial_flexibility`; in the xy plane [[L^3/3EIz + L/(ky G A), L^2/2EIz], [L^2/2EIz, L/EIz]].

    Arguments as in the module docstring. Returns (..., 6, 6), symmetric.
    """
    return partial_flexibility(length, E, G, section, length, shear)


def stiffness_coefficients(E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> Array:
    """Return the ten numbers of which the stiffness is the linear combination with STIFFNESS_BASIS.

    EA/L, GJ/L, then per bending plane (xy, xz), with B = EI/(1 + phi): 12B/L^3, 6B/L^2, (4 + phi)B/L,
    (2 - phi)B/L (Przemieniecki 1968, Sec. 5.6).

    Arguments as in the module docstring. Returns (..., 10): N/m, N m, then per plane N/m, N, N m, N m.
    """
    A, Iy, Iz, J = section[:4]
    phi_y, phi_z = phi(E, G, section, length, shear)
    r = 1 / length
    Er = E * r
    by, bz = Er * Iy / (1 + phi_z), Er * Iz / (1 + phi_y)
    sy, sz = 6 * r * by, 6 * r * bz
    r2 = 2 * r
    return columns(
        Er * A,
        G * J * r,
        *(r2 * sz, sz, (4 + phi_y) * bz, (2 - phi_y) * bz),
        *(r2 * sy, sy, (4 + phi_z) * by, (2 - phi_z) * by),
    )


def stiffness(E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> Array:
    """Return the element stiffness K in closed form (theory eq. 15).

    K = `stiffness_coefficients` @ STIFFNESS_BASIS, which is eq. 18 of the RPR paper with the k_k of the beam
    with (shear = 1) or without shear deformation.

    Arguments as in the module docstring. Returns (..., 12, 12), exactly symmetric, with six rigid motions.
    """
    return combine(stiffness_coefficients(E, G, section, length, shear), STIFFNESS_BASIS, 12)


def stiffness_from_flexibility(C: Array, length: Real) -> Array:
    """Return the element stiffness of a given flexibility, K = [-D, I]^T C^-1 [-D, I] (RPR paper, eq. 18).

    D = rigid_arm((L, 0, 0)). The result has six rigid motions whatever C is (theory eq. 13).

    C: (..., 6, 6), displacement of j per load at j with i clamped; length: (...) m, the distance from i to j
    along local x. Returns (..., 12, 12), exactly symmetric. C must be positive definite; a singular one
    raises numpy.linalg.LinAlgError.
    """
    T = _deformation(length)
    K = np.swapaxes(T, -1, -2) @ (_inverse(C) @ T)
    return (K + np.swapaxes(K, -1, -2)) / 2


def _inverse(C: Array) -> Array:
    """Inverses (..., 6, 6) to their last digits, rows scaled alike; NaN where there is none."""
    d = unit_scale(plain(C))
    scale = d[..., :, None] * d[..., None, :]  # symmetric to the last bit
    scaled = C * scale
    inverse = np.full(C.shape, np.nan, like=C)
    try:
        inverse[...] = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:
        for at in np.ndindex(C.shape[:-2]):
            with suppress(np.linalg.LinAlgError):
                inverse[at] = np.linalg.inv(scaled[at])
    return inverse * scale


def interpolation(S: Array, C: Array, x: Real, length: Real) -> Array:
    """Return the shape functions of an element from its flexibilities, Nbar = [D(x), 0] + S C^-1 [-D(L), I].

    Eqs. 11 and 13 of the RPR paper, with N(x) = S C^-1 [-D(L), I] in place of the printed polynomials
    (theory eq. 16).

    S: (..., n, 6, 6), displacement at n stations per load at j; C: (..., 6, 6), the same at j; x: (..., n) m,
    where the stations are; length: (...) m. Returns (..., n, 6, 12): displacement at x per displacement of
    (i, j), NaN where C is singular.
    """
    P = _inverse(C) @ _deformation(length)
    stacked = S.reshape(*S.shape[:-3], 6 * S.shape[-3], 6) @ P  # all stations of an element in one product
    N = stacked.reshape(*stacked.shape[:-2], S.shape[-3], 6, 12)
    N[..., :6] += arm_along_x(x)
    return N


def shape_functions(x: Real, E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> Array:
    """Return Nbar(x) of the uniform element: linear axial and torsional, cubic bending functions (theory eq. 17).

    Eqs. 12-13 of the RPR paper, extended to shear; without shear they are the Hermite cubics. (In print the
    theta_jz entry of row 2 of eq. 12 reads x^3/L^2 - x^2/L^2; it must be x^3/L^2 - x^2/L.)

    x: (...) m, from i; other arguments as in the module docstring. Returns (..., 6, 12): displacement at x
    per displacement of (i, j).
    """
    S = partial_flexibility(x, E, G, section, length, shear)[..., None, :, :]
    C = flexibility(E, G, section, length, shear)
    return interpolation(S, C, real(x)[..., None], length)[..., 0, :, :]


def mass_coefficients(
    rho: Real, section: SectionProperties, length: Real, phi_y: Real, phi_z: Real, rotary: Real
) -> Array:
    """Return the fourteen numbers of which the mass is the linear combination with MASS_BASIS (theory eq. 19).

    rho A L and rho (Iy + Iz) L for the axial and torsional parts (the polar second moment, not J), then per
    bending plane (xy, xz) the entries v_i v_i, v_i theta_i, v_i v_j, v_i theta_j, theta_i theta_i,
    theta_i theta_j: rho A L and rotary rho I/L over (1 + phi)^2, times quadratics in phi
    (Przemieniecki 1968, Ch. 11; Friedman & Kosmatka 1993).

    phi_y, phi_z: (...), -, from `phi`; other arguments as in the module docstring. Returns (..., 14): kg,
    kg m^2, then per plane kg, kg m, kg, kg m, kg m^2, kg m^2.
    """
    A, Iy, Iz = section[:3]
    line = rho * length
    weights = []
    for p, I in ((phi_y, Iz), (phi_z, Iy)):  # noqa: E741
        scale = line / (1 + p) ** 2
        t, r = scale * A, rotary * scale * I / (length * length)
        tp, rp = t * p, r * p
        weights += [t, tp, tp * p, r, rp, rp * p]
    flat = columns(*weights)
    bending = flat.reshape(*flat.shape[:-1], 2, 6) @ _MASS_POLYNOMIALS
    L2 = length * length
    bending *= columns(1.0, length, 1.0, length, L2, L2)[..., None, :]
    coefficients = np.empty((*flat.shape[:-1], 14), like=flat)
    coefficients[..., 0] = line * A
    coefficients[..., 1] = line * (Iy + Iz)
    coefficients[..., 2:] = bending.reshape(flat.shape)
    return coefficients


def coefficients(
    moduli: Array, stiff: Array, actual: Array, length: Array, shear: Array, rotary: Array
) -> tuple[Array, Array, bool]:
    """Return `flexibility_coefficients` (..., n, 8) and `mass_coefficients` (..., n, 14) of n elements, and whether the
    diagonals of all flexibilities are known to be positive and finite, and those of masses finite and not negative.

    moduli: E, G and rho (3, ..., n); stiff, actual: the six section properties (6, ..., n) for stiffness and for mass;
    length: (n,) or (..., n); shear, rotary: (n,).
    """
    stacks = (moduli, stiff, actual)
    if is_compiled() and with_slopes_of(*stacks, length) is None and stiff.shape[1:] == moduli.shape[1:]:
        lead = moduli.shape[1:]
        flexible, massive = np.empty((*lead, 8)), np.empty((*lead, 14))
        given = (*map(np.ascontiguousarray, stacks), np.ascontiguousarray(length), shear, rotary)
        bad = _compiled(*given, _MASS_POLYNOMIALS, moduli[0].size, length.size, len(shear), flexible, massive)
        return flexible, massive, not bad
    (E, G, rho), section = moduli, SectionProperties(*stiff)
    factors = phi(E, G, section, length, shear) if shear.any() else (0.0, 0.0)
    return (
        flexibility_coefficients(E, G, section, length, shear),
        mass_coefficients(rho, SectionProperties(*actual), length, *factors, rotary),
        False,
    )


def mass(rho: Real, section: SectionProperties, length: Real, phi_y: Real, phi_z: Real, rotary: Real) -> Array:
    """Return the consistent element mass M in closed form (theory eqs. 18-19).

    M = `mass_coefficients` @ MASS_BASIS = int rho A N1^T N1 dx + int N2^T diag(rho (Iy + Iz), rotary rho Iy,
    rotary rho Iz) N2 dx, N1 and N2 the upper and lower three rows of Nbar (RPR paper, eqs. 14-17; both
    factors of eq. 15 are N2, and eq. 16 is written for any section).

    phi_y, phi_z: (...), -, from `phi`; other arguments as in the module docstring. Returns (..., 12, 12),
    exactly symmetric, with the exact inertia of rigid motions. Bending frequencies converge from above with
    the element length, to order 4 without shear and 2 with it; axial and torsional ones to order 2.
    """
    return combine(mass_coefficients(rho, section, length, phi_y, phi_z, rotary), MASS_BASIS, 12)


def _deformation(length: Real) -> Array:
    """Return [-D(L), I], (..., 6, 12), which takes the rigid motion with node i off the motion of j."""
    D = arm_along_x(length)
    T = np.empty((*D.shape[:-2], 6, 12), like=D)
    T[..., :6] = -D
    T[..., 6:] = np.eye(6)
    return T


class UniformBeam(NamedTuple):
    """Uniform beams; the fields are arrays (...) of one common shape.

    EA        axial rigidity, N
    GJ        torsional rigidity, N m^2
    EIy       bending rigidity about local y (bending in the xz plane), N m^2
    EIz       bending rigidity about local z (bending in the xy plane), N m^2
    shear_y   shear flexibility 1/(ky G A) along local y, 1/N; zero where shear is left out
    shear_z   shear flexibility 1/(kz G A) along local z, 1/N; zero where shear is left out
    mass      mass per length, kg/m
    polar     polar inertia per length, rho (Iy + Iz), kg m
    rotary_y  rotary inertia per length about local y, kg m; zero where it is left out
    rotary_z  rotary inertia per length about local z, kg m; zero where it is left out
    length    m
    """

    EA: Array
    GJ: Array
    EIy: Array
    EIz: Array
    shear_y: Array
    shear_z: Array
    mass: Array
    polar: Array
    rotary_y: Array
    rotary_z: Array
    length: Array

    def take(self, index: Any) -> "UniformBeam":
        """The beams at an index of the leading axes."""
        return UniformBeam(*(field[index] for field in self))

    def cut(self, pieces: int) -> "UniformBeam":
        """One of `pieces` equal lengths of each beam."""
        return self._replace(length=self.length / pieces)

    @property
    def section(self) -> SectionProperties:
        """Rigidities as a section of a material with E = G = 1 Pa."""
        flexible = [(shear > 0, shear * self.EA) for shear in (self.shear_y, self.shear_z)]
        ky, kz = (np.where(shears, 1 / np.where(shears, product, 1.0), np.inf) for shears, product in flexible)
        return SectionProperties(self.EA, self.EIy, self.EIz, self.GJ, ky, kz)


def element_stiffness(beam: UniformBeam) -> Array:
    """Return the static stiffness (..., 12, 12) of the beams as elements, N/m, N, N m (theory eq. 15)."""
    return stiffness(1.0, 1.0, beam.section, beam.length, 1.0)


def element_mass(beam: UniformBeam) -> Array:
    """Return the consistent mass (..., 12, 12) of the beams as elements, kg, kg m, kg m^2 (theory eq. 19)."""
    L2 = beam.length * beam.length
    phi_y, phi_z = 12 * beam.EIz * beam.shear_y / L2, 12 * beam.EIy * beam.shear_z / L2
    inertia = SectionProperties(beam.mass, beam.rotary_y, beam.rotary_z, beam.polar, beam.mass, beam.mass)
    coefficients = mass_coefficients(1.0, inertia, beam.length, phi_y, phi_z, 1.0)
    coefficients[..., 1] = beam.polar * beam.length
    return combine(coefficients, MASS_BASIS, 12)
