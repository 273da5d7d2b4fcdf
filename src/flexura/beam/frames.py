"""Rotation matrices, member frames and rigid arms."""

import numpy as np
from numpy.typing import ArrayLike

from flexura.beam._columns import FloatArray
from flexura.duals import real

_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]


def _skew_basis() -> FloatArray:
    basis = np.zeros((3, 3, 3))
    for k, (i, j) in enumerate([(1, 2), (2, 0), (0, 1)]):
        basis[k, i, j], basis[k, j, i] = -1.0, 1.0
    return basis.reshape(3, 9)


def _arm_basis() -> FloatArray:
    basis = np.zeros((3, 6, 6))
    basis[:, :3, 3:] = -_SKEW_BASIS.reshape(3, 3, 3)
    return basis.reshape(3, 36)


_SKEW_BASIS = _skew_basis()
_ARM_BASIS = _arm_basis()
_I6_FLAT = np.eye(6).ravel()


def skew(v: ArrayLike) -> FloatArray:
    """Return the matrix of the cross product, skew(v) w = v x w.

    v: (..., 3), any unit. Returns (..., 3, 3), the unit of v. Raises nothing.
    """
    v = real(v)
    return (v @ _SKEW_BASIS).reshape(*v.shape, 3)


def rigid_arm(d: ArrayLike) -> FloatArray:
    """Return D(d), which carries a node's motion to the point p + d rigidly attached to the node at p (theory eq. 4).

    u(p + d) = D(d) u(p) with D(d) = [[I, -skew(d)], [0, I]]; a load F at p + d acts at p as D(d)^T F. This is
    D_k of eq. 11 of the RPR paper, whose hat is there the transpose of `skew`, and the arm of its eqs. 21-24.

    d: (..., 3) m. Returns (..., 6, 6): ones and m. Raises nothing. Holds for small rotations.
    """
    d = real(d)
    return (d @ _ARM_BASIS + _I6_FLAT).reshape(*d.shape[:-1], 6, 6)


def member_frame(axis: ArrayLike, reference: ArrayLike) -> FloatArray:
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


def block_rotation(R: ArrayLike) -> FloatArray:
    """Return diag(R, R), which rotates the six freedoms of a node.

    R: (..., 3, 3), -. Returns (..., 6, 6), -. Raises nothing.
    """
    R = real(R)
    T = np.zeros((*R.shape[:-2], 6, 6), like=R)
    T[..., :3, :3] = R
    T[..., 3:, 3:] = R
    return T


def _unit(v: FloatArray) -> FloatArray:
    return v / np.sqrt((v * v).sum(axis=-1, keepdims=True))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross product a x b of vectors (..., 3), in the unit of their product. Raises nothing."""
    return a[..., _NEXT] * b[..., _AFTER] - a[..., _AFTER] * b[..., _NEXT]
