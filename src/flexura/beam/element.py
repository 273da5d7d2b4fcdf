"""The uniform spatial beam element: flexibility, stiffness, shape functions and consistent mass.

One formula covers three theories. `shear` = 0, `rotary` = 0 is Euler-Bernoulli, `shear` = 0, `rotary` = 1 the
Rayleigh beam of the RPR paper (eqs. 12-18), `shear` = 1, `rotary` = 1 Timoshenko. The Timoshenko element is
exact for end loads: it does not lock and its nodal static displacements are those of the theory.

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

import numpy as np

from flexura.beam._columns import FloatArray, Real, basis_of, columns, combine, symmetric
from flexura.beam.frames import rigid_arm
from flexura.beam.section import SectionProperties
from flexura.duals import plain, real
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
COUPLED_FLEXIBILITY_BASIS = np.concatenate(
    [
        END_FLEXIBILITY_BASIS,
        basis_of(
            6,
            [
                (((0, 1), (2, 1)), symmetric({(0, 1): 1})),
                (((0, 1), (4, 1)), symmetric({(0, 1): 1})),
                (((1, 1), (3, 1)), symmetric({(0, 1): 1})),
                (((3, 1), (5, 1)), symmetric({(0, 1): 1})),
            ],
        ),
    ]
)
"""That of `END_FLEXIBILITY_BASIS`, and what couples it where the xz plane alone is one of symmetry: tx with tz and ry,
rx with ty and rz."""
_PLANES = np.array([[0, 2, 4, 6, 8, 10], [1, 3, 5, 7, 9, 11]])
_IN_PLANES = np.broadcast_arrays(_PLANES[:, :, None], _PLANES[:, None, :])
PLANE_BASIS = np.zeros((72, 144))
"""What takes matrices `in_planes` to (12, 12)."""
PLANE_BASIS[np.arange(72), np.ravel(np.moveaxis(12 * _IN_PLANES[0] + _IN_PLANES[1], 0, -1))] = 1.0
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


def partial_flexibility(x: Real, E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> FloatArray:
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


def flexibility_coefficients(E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> FloatArray:
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


def root_coefficients(root: FloatArray, length: Real, end: int) -> FloatArray:
    """Return what an elastic root at an end adds to the flexibility of an element, in COUPLED_FLEXIBILITY_BASIS.

    At end j it adds itself, turned about z so that x leads along the element. At end i it moves end j on the rigid arm
    of the element's length, D C D^T with D = rigid_arm((L, 0, 0)) (theory eq. F23).

    root: (..., 12) as of `root_flexibility`; length: (...) m; end: 0 for i, 1 for j. Returns (..., 12).
    """
    uu, tt, vv, vr, rr, ww, wq, qq, uw, uq, tv, tr = np.moveaxis(root, -1, 0)
    if end:
        return columns(uu, tt, vv, -vr, rr, ww, wq, qq, -uw, uq, tv, -tr)
    L = length
    plane_xy = (vv + L * (2 * vr + L * rr), vr + L * rr, rr)
    plane_xz = (ww + L * (L * qq - 2 * wq), L * qq - wq, qq)
    return columns(uu, tt, *plane_xy, *plane_xz, uw - L * uq, uq, tv + L * tr, tr)


def in_planes(A: FloatArray) -> FloatArray:
    """Matrices (..., 6, 6) or (..., 12, 12) in the planes that the xz plane as one of symmetry keeps apart, first that
    of tx, tz, ry, then that of ty, rx, rz, of end i and of end j: (k, k, 2, n), k 3 or 6, leading axes in one."""
    k = A.shape[-1] // 2
    rows, columns = (index[:, :k, :k].transpose(1, 2, 0) for index in _IN_PLANES)
    return np.moveaxis(A[..., rows, columns].reshape(-1, k, k, 2), 0, -1)


def rooted_stiffness(C: FloatArray, L: Real) -> FloatArray:
    """Return the stiffness of elements between nodes that their ends are joined to by elastic roots (theory eq. F23).

    With C of element and roots in series it is K = B^T C^-1 B, B = [-D, I], which has the rigid motions of any element.

    Both `in_planes`: C (3, 3, 2, n), flexibility with the roots, as of `flexibility`; L: (n,) m. Returns (6, 6, 2, n),
    which `PLANE_BASIS` takes to (12, 12).
    """
    return _spread(_turned(_spread(_inverse_of_three(C), L)), L)


def root_mass(C: FloatArray, M: FloatArray, L: Real, roots: FloatArray) -> FloatArray:
    """Return what elastic roots change of the mass of elements (theory eq. F24).

    With K of `rooted_stiffness` the ends are T u = u - R K u of the nodes' displacements u, so that the mass is
    T^T M T; rigid motions keep theirs.

    All `in_planes`: C (3, 3, 2, n) and L (n,) as of `rooted_stiffness`; M (6, 6, 2, n), mass of the element itself;
    roots: (2, 3, 3, 2, n), flexibility of those at ends i and j, element axes. Returns the change of M (6, 6, 2, n).
    """
    W = _inverse_of_three(C)
    Z = np.concatenate([-_product(roots[0], _turned(_moved(W, L))), _product(roots[1], W)])
    Y = _product(M, Z)
    P = np.einsum("kign,kjgn->ijgn", Z, Y) / 2
    Y = Y + np.concatenate([_turned(_moved(P, L)), -P])
    change = _spread(Y, L)
    return -(change + _turned(change))


def _product(A: FloatArray, B: FloatArray) -> FloatArray:
    return np.einsum("ikgn,kjgn->ijgn", A, B)


def _moved(A: FloatArray, L: Real) -> FloatArray:
    """A D of planes A (k, 3, 2, n), D the arm of length L (n,) from end i to end j."""
    last = np.stack([A[:, 2, 0] - L * A[:, 1, 0], A[:, 2, 1] + L * A[:, 0, 1]], axis=1)
    return np.stack([A[:, 0], A[:, 1], last], axis=1)


def _spread(A: FloatArray, L: Real) -> FloatArray:
    """A B (k, 6, 2, n) of planes A (k, 3, 2, n)."""
    return np.concatenate([-_moved(A, L), A], axis=1)


def _turned(A: FloatArray) -> FloatArray:
    return np.swapaxes(A, 0, 1)


def _inverse_of_three(A: FloatArray) -> FloatArray:
    """Inverses of symmetric matrices (3, 3, ...) by their cofactors; not finite where there is none."""
    a, b, c, d, e, f = A[0, 0], A[0, 1], A[0, 2], A[1, 1], A[1, 2], A[2, 2]
    own = (d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b)
    with np.errstate(all="ignore"):
        share = 1.0 / (a * own[0] + b * own[1] + c * own[2])
        p, q, r, s, t, u = (share * x for x in own)
    return np.stack([np.stack(row) for row in ((p, q, r), (q, s, t), (r, t, u))])


def flexibility(E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> FloatArray:
    """Return C, the displacement of end j per unit load there, with end i clamped: k_k^-1 of eq. 18 (theory eq. 12).

    C = S(L) of `partial_flexibility`; in the xy plane [[L^3/3EIz + L/(ky G A), L^2/2EIz], [L^2/2EIz, L/EIz]].

    Arguments as in the module docstring. Returns (..., 6, 6), symmetric.
    """
    return partial_flexibility(length, E, G, section, length, shear)


def stiffness_coefficients(E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> FloatArray:
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


def stiffness(E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> FloatArray:
    """Return the element stiffness K in closed form (theory eq. 15).

    K = `stiffness_coefficients` @ STIFFNESS_BASIS, which is eq. 18 of the RPR paper with the k_k of the beam
    with (shear = 1) or without shear deformation.

    Arguments as in the module docstring. Returns (..., 12, 12), exactly symmetric, with six rigid motions.
    """
    return combine(stiffness_coefficients(E, G, section, length, shear), STIFFNESS_BASIS, 12)


def stiffness_from_flexibility(C: FloatArray, length: Real) -> FloatArray:
    """Return the element stiffness of a given flexibility, K = [-D, I]^T C^-1 [-D, I] (RPR paper, eq. 18).

    D = rigid_arm((L, 0, 0)). The result has six rigid motions whatever C is (theory eq. 13).

    C: (..., 6, 6), displacement of j per load at j with i clamped; length: (...) m, the distance from i to j
    along local x. Returns (..., 12, 12), exactly symmetric. C must be positive definite; a singular one
    raises numpy.linalg.LinAlgError.
    """
    T = _deformation(length)
    K = np.swapaxes(T, -1, -2) @ (_inverse(C) @ T)
    return (K + np.swapaxes(K, -1, -2)) / 2


def _inverse(C: FloatArray) -> FloatArray:
    """Inverses (..., 6, 6) to their last digits, rows scaled alike; NaN where there is none."""
    d = unit_scale(plain(C))
    scale = d[..., :, None] * d[..., None, :]  # symmetric to the last bit
    own = C * scale
    found = np.full(C.shape, np.nan, like=C)
    try:
        found[...] = np.linalg.inv(own)
    except np.linalg.LinAlgError:
        for at in np.ndindex(C.shape[:-2]):
            with suppress(np.linalg.LinAlgError):
                found[at] = np.linalg.inv(own[at])
    return found * scale


def interpolation(S: FloatArray, C: FloatArray, x: Real, length: Real) -> FloatArray:
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
    N[..., :6] += _arm_along_x(x)
    return N


def shape_functions(x: Real, E: Real, G: Real, section: SectionProperties, length: Real, shear: Real) -> FloatArray:
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
) -> FloatArray:
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


def mass(rho: Real, section: SectionProperties, length: Real, phi_y: Real, phi_z: Real, rotary: Real) -> FloatArray:
    """Return the consistent element mass M in closed form (theory eqs. 18-19).

    M = `mass_coefficients` @ MASS_BASIS = int rho A N1^T N1 dx + int N2^T diag(rho (Iy + Iz), rotary rho Iy,
    rotary rho Iz) N2 dx, N1 and N2 the upper and lower three rows of Nbar (RPR paper, eqs. 14-17; both
    factors of eq. 15 are N2, and eq. 16 is written for any section).

    phi_y, phi_z: (...), -, from `phi`; other arguments as in the module docstring. Returns (..., 12, 12),
    exactly symmetric, with the exact inertia of rigid motions. Bending frequencies converge from above with
    the element length, to order 4 without shear and 2 with it; axial and torsional ones to order 2.
    """
    return combine(mass_coefficients(rho, section, length, phi_y, phi_z, rotary), MASS_BASIS, 12)


def _arm_along_x(x: Real) -> FloatArray:
    return rigid_arm(columns(x, 0.0, 0.0))


def _deformation(length: Real) -> FloatArray:
    """Return [-D(L), I], (..., 6, 12), which takes the rigid motion with node i off the motion of j."""
    D = _arm_along_x(length)
    T = np.empty((*D.shape[:-2], 6, 12), like=D)
    T[..., :6] = -D
    T[..., 6:] = np.eye(6)
    return T
