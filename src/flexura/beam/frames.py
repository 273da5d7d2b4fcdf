"""Member frames, rotations and rigid arms; and matrices as coefficients (..., n) of a constant basis (n, rows*cols)."""

from collections.abc import Iterable, Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.duals import real, with_slopes_of

Real: TypeAlias = float | Array
Pattern: TypeAlias = Mapping[tuple[int, int], float]
SignedDofs: TypeAlias = tuple[tuple[int, int], ...]

_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]

_SKEW_BASIS = np.zeros((3, 9))
"""Entries of skew(v) per component of v."""
_SKEW_BASIS[[0, 1, 2], [5, 6, 1]] = -1.0
_SKEW_BASIS[[0, 1, 2], [7, 2, 3]] = 1.0

_ARM_BASIS = np.pad(-_SKEW_BASIS.reshape(3, 3, 3), ((0, 0), (0, 3), (3, 0))).reshape(3, 36)
"""Entries of D(d) - I per component of d."""


def skew(v: ArrayLike) -> Array:
    """Return the matrix of the cross product, skew(v) w = v x w.

    v: (..., 3), any unit. Returns (..., 3, 3), the unit of v. Raises nothing.
    """
    v = real(v)
    return (v @ _SKEW_BASIS).reshape(*v.shape, 3)


def rigid_arm(d: ArrayLike) -> Array:
    """Return D(d), which carries a node's motion to the point p + d rigidly attached to the node at p (theory eq. 4).

    u(p + d) = D(d) u(p) with D(d) = [[I, -skew(d)], [0, I]]; a load F at p + d acts at p as D(d)^T F. This is
    D_k of eq. 11 of the RPR paper, whose hat is there the transpose of `skew`, and the arm of its eqs. 21-24.

    d: (..., 3) m. Returns (..., 6, 6): ones and m. Raises nothing. Holds for small rotations.
    """
    d = real(d)
    return (d @ _ARM_BASIS + np.eye(6).ravel()).reshape(*d.shape[:-1], 6, 6)


def arm_along_x(x: Real) -> Array:
    """Return D((x, 0, 0)) (..., 6, 6) of `rigid_arm` for x (...), m."""
    return rigid_arm(columns(x, 0.0, 0.0))


def member_frame(axis: ArrayLike, reference: ArrayLike) -> Array:
    """Return the frame of a member: local x along `axis`, local z towards `reference` (theory eq. 2).

    x = axis/|axis|; z is the normalised component of `reference` normal to x; y = z x x.

    axis, reference: (..., 3), any length and unit. Returns R (..., 3, 3), -, with the local axes as rows:
    v_local = R v_global. Raises nothing: a zero axis, or a reference along the axis, gives NaN or, through
    round-off, an arbitrary direction of z.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        x = _unit(real(axis))
        y = _unit(cross(real(reference), x))
        z = cross(x, y)
    R = np.empty((*z.shape, 3), like=z)
    R[..., 0, :], R[..., 1, :], R[..., 2, :] = x, y, z
    return R


def block_rotation(R: ArrayLike) -> Array:
    """Return diag(R, R), which rotates the six freedoms of a node.

    R: (..., 3, 3), -. Returns (..., 6, 6), -. Raises nothing.
    """
    R = real(R)
    T = np.zeros((*R.shape[:-2], 6, 6), like=R)
    T[..., :3, :3] = R
    T[..., 3:, 3:] = R
    return T


def _unit(v: Array) -> Array:
    return v / np.sqrt((v * v).sum(axis=-1, keepdims=True))


def cross(a: Array, b: Array) -> Array:
    """Return the cross product a x b of vectors (..., 3), in the unit of their product. Raises nothing."""
    return a[..., _NEXT] * b[..., _AFTER] - a[..., _AFTER] * b[..., _NEXT]


def columns(*values: Real) -> Array:
    """Broadcast n arrays (...) against each other and stack them on a new last axis: (..., n)."""
    like = with_slopes_of(*values)
    if like is None:
        out = np.empty((*np.broadcast(*values).shape, len(values)))
    else:
        out = np.empty((*np.broadcast_shapes(*map(np.shape, values)), len(values)), like=like)
    for i, value in enumerate(values):
        out[..., i] = value
    return out


def ordered(a: Array, b: Array) -> tuple[Array, Array]:
    """The smaller and the larger of two; of equal ones either, for functions in which they may change places."""
    swapped = a > b
    return np.where(swapped, b, a), np.where(swapped, a, b)


def combine(coefficients: Array, basis: Array, rows: int) -> Array:
    """Sum coefficients (..., n) times basis (n, rows*cols) in one matrix product: (..., rows, cols)."""
    flat = coefficients.reshape(-1, len(basis)) @ basis
    return flat.reshape(*coefficients.shape[:-1], rows, basis.shape[1] // rows)


def basis_of(size: int, terms: Iterable[tuple[SignedDofs, Pattern]]) -> Array:
    """Lay out one row per term: its pattern {(i, j): value}, at the freedoms of i and j, with their signs.

    `terms` holds (freedoms, pattern) pairs; freedoms lists (dof, sign) of the pattern's local indices.
    Returns (number of terms, size*size), read-only.
    """
    rows = []
    for dofs, pattern in terms:
        matrix = np.zeros((size, size))
        for (i, j), value in pattern.items():
            (row, row_sign), (col, col_sign) = dofs[i], dofs[j]
            matrix[row, col] = row_sign * col_sign * value
        rows.append(matrix.ravel())
    basis = np.array(rows)
    basis.flags.writeable = False
    return basis


def symmetric(pattern: Pattern) -> Pattern:
    """Complete a pattern given by its upper triangle."""
    return {**pattern, **{(j, i): value for (i, j), value in pattern.items()}}
