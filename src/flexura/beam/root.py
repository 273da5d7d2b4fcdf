"""Elastic roots: what a member and the thicker block that it ends in give together beyond each with a rigid face.

The rotation of a cantilever's root on a half plane is known since W. J. O'Donnell, J. Appl. Mech. 27 (1960) 461. Blocks
that are not large, leaves off their middle and the other directions have no closed forms: `roots.csv` holds solid
finite elements of them (benchmarks/roots.py), between which is interpolated here. Elements take roots in at their ends
(theory eqs. F23-F24).
"""

from __future__ import annotations

import csv
import math
from functools import cache
from importlib.resources import files

import numpy as np

from flexura.arrays import Array
from flexura.beam.element import END_FLEXIBILITY_BASIS
from flexura.beam.fitted import Fit, between, fitted, over, powers, within
from flexura.beam.frames import Real, basis_of, columns, symmetric
from flexura.duals import plain

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

FAR = 12.0
"""Distance from the middle of the leaf to the block's faces, over the thickness, from which it counts as far."""

NEAR_FAR = 0.5
"""How far from there that is rounded, over the thickness."""

NEAR_WIDE = 8.0
"""How far from the end of the largest width that is rounded, over the thickness."""

WIDTHS = (0.7, 40.0)
"""Least and largest width over thickness that is known."""

RATIOS = (0.2, 0.4)
"""Least and largest Poisson's ratio that is known."""

THINNEST = 0.15
"""Least block beside the leaf's faces, over its thickness, that is known."""

_HALF = 0.7
"""Distance of a face from the leaf, over its thickness, that lies in the middle of the scale."""

_GROUPS = ((7, 6, 5, 9, 8, 0), (4, 3, 2, 11, 10, 1))
"""Entries of the two planes in the order of `_factor`: ry, w, u and rz, v, rx."""

_POWERS = (1, 1, 1, 2, 3, 1, 1, 1, 1, 1, 1, 2)
"""Powers of width over thickness in the unit of every entry."""

_LENGTHS = (1, 3, 1, 2, 3, 1, 2, 3, 1, 2, 2, 3)
"""Powers of the thickness in the unit of every entry."""

CUBE = 2.0
"""Block beside the leaf's faces, over its thickness, that goes with `_WIDE`; more of a wide block hardly gives."""

NEAR_CUBE = 0.2
"""How far from there that is rounded, over the thickness."""

NEAR_POINT = 0.05
"""How far from a column of `_WIDE` its corner is rounded, in the logarithm of width over thickness."""

NEAR_SIDE = 0.1
"""Block beside the leaf's sides, over its thickness, from which half of it counts as wide."""

_WIDE_AT = (0.7, 1.0, 2.0, 3.0, 10.0)
"""Width over thickness of the columns of `_WIDE`."""

_WIDE = {
    0: (0.66, 0.76, 0.93, 0.99, 1.03),
    1: (0.25, 0.36, 0.77, 1.02, 0.96),
    2: (0.080, 0.156, 0.47, 0.72, 0.91),
    4: (0.44, 0.525, 0.73, 0.85, 1.0),
    5: (1.13, 1.12, 1.31, 1.56, 1.56),
    7: (0.66, 0.71, 0.82, 0.88, 0.98),
}
"""Flexibility on a block that reaches `CUBE` thicknesses beyond the leaf on all sides, over that on one as wide as the
leaf, by its place (benchmarks/roots.py --wide)."""

_COUPLED = {3: (2, 4), 6: (5, 7), 8: (0, 5), 9: (0, 7), 10: (2, 1), 11: (1, 4)}
"""Places of couplings, by those of what they couple; those of shift along the width are lost to narrow leaves."""

FILLET = (0.6, 0.25)
"""How fast fillets, radius over thickness of both sides together, take rotation (and twist) and stretch from a root."""

FILLET_AT = (0.4, 0.2)
"""How far out a root with fillets turns, over the radius of the larger and of the smaller one."""

GAUSS = np.polynomial.legendre.leggauss(16)
"""Points and weights over fillets."""

LEAST_FILLET = 1e-30
"""What gives fillets of no radius slopes."""

LEAST_FLEXIBILITY = 1e-9
"""What keeps a root that does not give regular, without units."""

LEAF = (6.0, 0.4)
"""Length of the leaves of the table: over their thickness, or over their width where that is more."""

FLUSH = -1e-9
"""Block beside the leaf's face, over its thickness, that counts as flush but for round-off."""

_MIRRORED = np.array([1.0, 1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1])
"""Signs of a joint upside down."""


def root_flexibility(
    E: Real,
    nu: Real,
    b: Real,
    t: Real,
    L: Real,
    up: Real,
    down: Real,
    wider: Real = 0.0,
    fillets: tuple[Real, Real] | None = None,
) -> Array:
    """Return the flexibility of the elastic root of a leaf, beyond leaf and block with rigid faces (theory eq. F21).

    It is interpolated between roots of solid elements as products of factors, so that no load does negative work.
    What lies outside of `FAR`, `WIDTHS` and `RATIOS` counts as there, within `MARGIN`: narrower and wider leaves
    bend and stretch their roots as those with the same load per width, and narrower ones twist them as rods that are as
    thick, with the cube of their width. The twist of a wide leaf
    warps its root the more the longer it is, up to its width: as the warping of a strip of length L (theory eq. F22).

    A block that is wider than the leaf is not the plate that one as wide is beside a narrow leaf: it gives as one that
    reaches `CUBE` thicknesses, times what solids say of that for every direction (`_WIDE`).

    E: Pa; nu: -; b, t, L: width, thickness and length of the leaf, m; up, down: how far the block reaches beyond its
    faces along z and against it, and how far at least on both sides of it, `wider`, m; fillets: their radii along z and
    against it, m, beside a leaf that is as thick there as `fillet_shares` has it (theory eq. F25); all (...). Returns
    (..., 12), x leading from the block into the leaf: u_u, rx_rx, v_v, v_rz, rz_rz, w_w, w_ry, ry_ry, u_w, u_ry, v_rx,
    rx_rz in m/N, 1/N and 1/(N m). Raises nothing.
    """
    slender = b / t
    width, nu = within(slender, *WIDTHS, NEAR_WIDE), within(nu, *RATIOS)
    above, below = (between(beyond / t, FLUSH, FAR - 0.5 + NEAR_FAR) for beyond in (up, down))
    above, below = (own - over(own - (FAR - 0.5), NEAR_FAR) for own in (above, below))
    if np.any(plain(wider) > 0):
        room = between(wider / t, 0.0, FAR + NEAR_FAR)
        room = room - over(room - FAR, NEAR_FAR)
        entries = _beside(room * (1 + NEAR_SIDE / FAR) / (room + NEAR_SIDE), nu, width, above, below)
    else:
        entries = _entries(nu, width, above, below)
    if fillets is not None:
        _fillet(entries, *(radius / t for radius in fillets))
    _warp(entries, 1.0 / _twisted(entries, width, _warping(nu, b, L)))
    narrow = np.where(plain(slender) < plain(width), width / slender, 1.0)
    _warp(entries, narrow * narrow)
    along, across = (powers(1.0 / own, 4) for own in (slender, t))
    soft = 1.0 / E
    return columns(*(own * (soft * along[w] * across[n]) for own, w, n in zip(entries, _POWERS, _LENGTHS, strict=True)))


def _entries(nu: Real, width: Real, up: Real, down: Real) -> list[Real]:
    """The 12 flexibilities without units of a leaf on a block as wide, from ratios within their ranges."""
    factors = _fitted().at(nu, np.log(width), _scale(up), _scale(down))
    entries: list[Real] = [0.0] * 12
    for first, group in zip((0, 6), _GROUPS, strict=True):
        a, c, d, e, f, g = factors[first : first + 6]
        products = (
            a * a + LEAST_FLEXIBILITY,
            a * c,
            c * c + d * d + LEAST_FLEXIBILITY,
            a * e,
            c * e + d * f,
            e * e + f * f + g * g + LEAST_FLEXIBILITY,
        )
        for place, value in zip(group, products, strict=True):
            entries[place] = value
    return entries


def _beside(share: Real, nu: Real, width: Real, up: Real, down: Real) -> list[Real]:
    """Flexibilities without units of a leaf on a wider block, from 0, as wide as the leaf, to 1, wide."""
    far = CUBE + over(width - CUBE, NEAR_CUBE)
    up, down = (beyond - share * over(beyond - far, NEAR_CUBE) for beyond in (up, down))
    entries = _entries(nu, width, up, down)
    cube = ((up + down) / CUBE) ** 3
    away = share * cube * 1.03125 / (cube + 0.25)  # half of it where both faces are some 0.6 thicknesses away
    at, ratios = np.log(width), np.log([*_WIDE.values()]) / 2  # of displacements, half of those of flexibilities
    scale = {place: np.exp(away * own) for place, own in zip(_WIDE, _linear(at, np.log(_WIDE_AT), ratios), strict=True)}
    (beside,) = _linear(at, np.log([3.0, 8.0]), np.array([[0.0, 1.0]]))
    plate = 1.0 + share * (beside - 1.0)
    for place, (first, second) in _COUPLED.items():
        entries[place] = entries[place] * (scale[first] * scale[second] * (plate if first == 2 else 1.0))
    for place, own in scale.items():
        entries[place] = entries[place] * (own * own)
    return entries


def _linear(x: Real, points: Array, values: Array) -> list[Real]:
    """Linear between values (n, points), n of them, rounded at the points; beyond the ends as there."""
    corners = [over(x - point, NEAR_POINT) for point in points.tolist()]
    slopes = np.pad(np.diff(values) / np.diff(points), ((0, 0), (1, 1)))
    turns = np.diff(slopes).tolist()
    return [
        first + sum(turn * corner for turn, corner in zip(weights, corners, strict=True))
        for first, weights in zip(values[:, 0].tolist(), turns, strict=True)
    ]


def fillet_shares(radii: Array, step: Real, n: int) -> tuple[Array, Array]:
    """Return the flexibility of n elements from an end with fillets on, over that of elements without: in stretch and
    bending across the width, and in bending across the thickness and twist, as of beams that are as thick as leaf and
    fillets.

    radii: (..., 2), over the thickness, on both sides; step: (...), length of an element over the thickness. Returns
    two (..., n). The fillets end within the elements.
    """
    step = columns(step)
    longest = np.where(plain(radii[..., 0]) > plain(radii[..., 1]), radii[..., 0], radii[..., 1])[..., None]
    start = step * np.arange(n)
    end = start + step
    end = np.where(plain(end) > plain(longest), longest, end)
    covered = np.where(plain(end) > plain(start), end - start, 0.0 * start)
    x = start[..., None] + covered[..., None] * (GAUSS[0] + 1) / 2
    h: Real = 1.0
    for side in (0, 1):
        r = radii[..., side, None, None]
        left = np.where(plain(r) > plain(x), r - x, 0.0 * x)
        h = h + r - np.sqrt(r * r - left * left + LEAST_FILLET)
    share = covered / step
    weights = GAUSS[1] / 2
    thin, thick = (1.0 - share * ((1.0 - h**-power) * weights).sum(axis=-1) for power in (1, 3))
    return thin, thick


def _fillet(entries: list[Real], up: Real, down: Real) -> None:
    """Let a root with fillets, of radii over the thickness, turn and stretch less and farther out, in place."""
    both = up + down
    turn, stretch = 1 / (1 + FILLET[0] * both), 1 / (1 + FILLET[1] * both)
    for one, factor in ((7, turn), (0, stretch), (1, turn)):
        entries[one] = entries[one] * factor
    pairs = ((6, turn), (9, turn * stretch), (8, stretch), (10, turn), (11, turn))
    for one, factor in pairs:
        entries[one] = entries[one] * np.sqrt(factor)
    wide, slim = (np.where((plain(up) > plain(down)) == first, up, down) for first in (True, False))
    out = FILLET_AT[0] * wide + FILLET_AT[1] * slim
    entries[5] = entries[5] + out * (2 * entries[6] + out * entries[7])
    entries[6] = entries[6] + out * entries[7]
    entries[8] = entries[8] + out * entries[9]


def _warping(nu: Real, b: Real, L: Real) -> Real:
    """Share of its full effect that warping of the root has on the twist of a strip of length L (theory eq. F22)."""
    share = np.tanh(np.sqrt(24 * (1 - nu)) * L / (2 * b))
    return share * share


def _twisted(entries: list[Real], width: Real, share: Real, back: bool = False) -> Real:
    """Twist of the root of a long strip over that where warping has a share of its effect, from entries without units
    of the former, or `back` from those of the latter; all but what shifts the strip's parts across is warping."""
    shift = 12 * entries[5] / width**2
    if back:
        return (shift + (entries[1] - shift) / share) / entries[1]
    return entries[1] / (shift + (entries[1] - shift) * share)


def _warp(entries: list[Real], factor: Real) -> None:
    """Let the root twist so many times as far, and what is coupled with it by the root of that."""
    entries[1] = entries[1] * factor
    entries[10], entries[11] = (entries[k] * np.sqrt(factor) for k in (10, 11))


def _scale(beyond: Real) -> Real:
    """From 0, flush with a face of the block, to 1, infinitely far."""
    return beyond / (beyond + _HALF)


@cache
def _fitted() -> Fit:
    """The polynomials that go through all rows of the table."""
    with files("flexura.beam").joinpath("roots.csv").open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    names = list(rows[0])[4:]
    known = {}
    for row in rows:
        nu, width, up, down = (float(row[key]) for key in ("nu", "width", "up", "down"))
        C = np.array([float(row[name]) for name in names]) * width ** np.array(_POWERS)
        L = max(LEAF[0], LEAF[1] * width)
        entries = list(C)
        _warp(entries, _twisted(entries, width, _warping(nu, width, L), back=True))
        known[nu, width, up, down] = _factors(np.array(entries))
        known[nu, width, down, up] = _factors(np.array(entries) * _MIRRORED)
    return fitted(known, len(names), (None, math.log, _scale, _scale))  # flush on both sides: none


def _factors(C: Array) -> Array:
    """The entries (12,) of Cholesky factors of both planes, of the flexibility (12,) without units."""
    factors = []
    for qq, wq, ww, uq, uw, uu in (C[list(group)] for group in _GROUPS):
        a = np.sqrt(max(qq, 0.0))
        c, e = (wq / a, uq / a) if a else (0.0, 0.0)
        d = np.sqrt(max(ww - c * c, 0.0))
        f = (uw - c * e) / d if d else 0.0
        factors += [a, c, d, e, f, np.sqrt(max(uu - e * e - f * f, 0.0))]
    return np.array(factors)


def root_coefficients(root: Array, length: Real, end: int) -> Array:
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


def in_planes(A: Array) -> Array:
    """Matrices (..., 6, 6) or (..., 12, 12) in the planes that the xz plane as one of symmetry keeps apart, first that
    of tx, tz, ry, then that of ty, rx, rz, of end i and of end j: (k, k, 2, n), k 3 or 6, leading axes in one."""
    k = A.shape[-1] // 2
    rows, columns = (index[:, :k, :k].transpose(1, 2, 0) for index in _IN_PLANES)
    return np.moveaxis(A[..., rows, columns].reshape(-1, k, k, 2), 0, -1)


def rooted_stiffness(C: Array, L: Real) -> Array:
    """Return the stiffness of elements between nodes that their ends are joined to by elastic roots (theory eq. F23).

    With C of element and roots in series it is K = B^T C^-1 B, B = [-D, I], which has the rigid motions of any element.

    Both `in_planes`: C (3, 3, 2, n), flexibility with the roots, as of `flexibility`; L: (n,) m. Returns (6, 6, 2, n),
    which `PLANE_BASIS` takes to (12, 12).
    """
    return _spread(np.swapaxes(_spread(_inverse_of_three(C), L), 0, 1), L)


def root_mass(C: Array, M: Array, L: Real, roots: Array) -> Array:
    """Return what elastic roots change of the mass of elements (theory eq. F24).

    With K of `rooted_stiffness` the ends are T u = u - R K u of the nodes' displacements u, so that the mass is
    T^T M T; rigid motions keep theirs.

    All `in_planes`: C (3, 3, 2, n) and L (n,) as of `rooted_stiffness`; M (6, 6, 2, n), mass of the element itself;
    roots: (2, 3, 3, 2, n), flexibility of those at ends i and j, element axes. Returns the change of M (6, 6, 2, n).
    """
    W = _inverse_of_three(C)
    Z = np.concatenate([-_product(roots[0], np.swapaxes(_moved(W, L), 0, 1)), _product(roots[1], W)])
    Y = _product(M, Z)
    P = np.einsum("kign,kjgn->ijgn", Z, Y) / 2
    Y = Y + np.concatenate([np.swapaxes(_moved(P, L), 0, 1), -P])
    change = _spread(Y, L)
    return -(change + np.swapaxes(change, 0, 1))


def _product(A: Array, B: Array) -> Array:
    return np.einsum("ikgn,kjgn->ijgn", A, B)


def _moved(A: Array, L: Real) -> Array:
    """A D of planes A (k, 3, 2, n), D the arm of length L (n,) from end i to end j."""
    last = np.stack([A[:, 2, 0] - L * A[:, 1, 0], A[:, 2, 1] + L * A[:, 0, 1]], axis=1)
    return np.stack([A[:, 0], A[:, 1], last], axis=1)


def _spread(A: Array, L: Real) -> Array:
    """A B (k, 6, 2, n) of planes A (k, 3, 2, n)."""
    return np.concatenate([-_moved(A, L), A], axis=1)


def _inverse_of_three(A: Array) -> Array:
    """Inverses of symmetric matrices (3, 3, ...) by their cofactors; not finite where there is none."""
    a, b, c, d, e, f = A[0, 0], A[0, 1], A[0, 2], A[1, 1], A[1, 2], A[2, 2]
    cofactors = (d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b)
    with np.errstate(all="ignore"):
        share = 1.0 / (a * cofactors[0] + b * cofactors[1] + c * cofactors[2])
        p, q, r, s, t, u = (share * x for x in cofactors)
    return np.stack([np.stack(row) for row in ((p, q, r), (q, s, t), (r, t, u))])
