"""How far the stiffness of a reduced piece may be off for its mesh, from that of a second mesh (theory eqs. B7-B8)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.errors import SolverError
from flexura.solid.fem.reduced import Announce, Piece, ReducedPiece, reduced_piece

ORDERS = (1.4, 1.0)
"""Orders with the length of cells to which the stiffness of members by themselves, and of fused ones, is taken to
converge: stresses at a held edge make it 1.42 (nu = 0.3), in a corner between members 1.09 (Williams, 1952)."""

APART = (2.0, 1.5)
"""Least ratio of the DOFs of a mesh to those of a coarser one, and of a finer one to its, at which the two tell an
error: others may differ in nothing that matters."""

SIZES = (0.05, 5.0)
"""Smallest and largest size of a mesh."""


def stiffness_error(piece: Piece, own: ReducedPiece, size: float, modes: int, announce: Announce) -> Array:
    """E (n, n), positive semidefinite: strain energy of displacements v is uncertain by half of v' E v (eq. B8).

    `own` is the piece in normal form, reduced from the mesh of a `size` with `modes` fixed-interface modes. Beside it
    stands a mesh of cells twice as long, or finer ones where that is hardly coarser. Raises SolverError when there is
    no second mesh, and errors as `reduced_piece` does.
    """
    for other, second in _others(piece, size, modes, announce):
        ratio = other.dofs / own.dofs
        if 1 / APART[0] < ratio < APART[1] or other.amplitudes < own.amplitudes:
            continue
        longer = min(max(ratio, 1 / ratio) ** (1 / 3), max(second / size, size / second))
        longer **= ORDERS[len(piece.members) > 1]
        off = (1 if ratio < 1 else longer) / (longer - 1)
        return off * _difference(piece, own, other)
    raise SolverError(f"no second mesh tells how fine that of size {size:g} is: the errors of others are not known")


def _others(piece: Piece, size: float, modes: int, announce: Announce) -> Iterator[tuple[ReducedPiece, float]]:
    """The piece reduced from other meshes, and their sizes: a coarser one, then finer ones."""
    finer = (2.0, 4.0, 8.0) if len(piece.members) == 1 else (1.5, 2.0, 4.0, 8.0)
    for second in (2 * size, *(size / factor for factor in finer)):
        if not SIZES[0] <= second <= SIZES[1]:
            continue
        words = f"{'coarser' if second > size else 'finer'} mesh, size {second:g}"
        try:
            own = reduced_piece(piece, second, modes, announce=partial(_told, announce, words))
        except SolverError:
            if second < size:
                raise
            continue  # a mesh may be too coarse for its solid
        yield own, second


def _told(announce: Announce, words: str, stage: str) -> None:
    announce(f"{words}: {stage}")


def _difference(piece: Piece, own: ReducedPiece, other: ReducedPiece) -> Array:
    """The absolute value of the difference of two stiffnesses, in the norm of the first (eq. B7)."""
    n, m = len(own.K), len(own.fixed_hz)
    b = n - m
    places = piece.places
    rigid = np.zeros((b, 6))
    rigid[: 6 * len(places)] = np.vstack([rigid_arm(place - places[0]) for place in places])
    stiff = np.sqrt(np.maximum(own.K.diagonal()[:b], 0.0))
    result = np.zeros((n, n))
    if b > 6:
        scaled, wanted = (A[:b, :b] / np.outer(stiff, stiff) for A in (own.K, other.K))
        Q = la.null_space((stiff[:, None] * rigid).T)
        values, vectors = la.eigh(Q.T @ (wanted - scaled) @ Q, Q.T @ scaled @ Q)
        half = stiff[:, None] * (scaled @ (Q @ vectors))
        result[:b, :b] = (half * np.abs(values)) @ half.T
    at = np.arange(b, n)
    result[at, at] = np.abs((other.fixed_hz[:m] / own.fixed_hz) ** 2 - 1) * own.K[at, at]
    return result
