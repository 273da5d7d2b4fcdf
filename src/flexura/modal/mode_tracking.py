"""Modes tracked by their shapes from one step of a model to the next, through crossings and repeated frequencies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array, Index
from flexura.modal.assignment import assignment
from flexura.modal.close_modes import close_groups
from flexura.modal.criteria import space_mac

REPEATED_EIGENVALUES = 1e-6
"""Eigenvalues closer than this, relative, are taken as repeated."""

OWN_SHARE = 1e-3
"""What the shapes one by one count beside the spaces, where modes are close: they decide within a space."""


@dataclass(frozen=True)
class TrackedModes:
    """What the modes of the step before have become.

    `number` (k,): the mode of this step, from 0, for every one of the step before; -1 where this step has too few.
    `mac` (k,): its modal assurance criterion, of close modes that of their space; 0 without one. `shapes` (p, n): all
    shapes of this step, those of repeated frequencies turned to be most like the step before.
    """

    number: Index
    mac: Array
    shapes: Array


def track_modes(
    before: ArrayLike, values: ArrayLike, shapes: ArrayLike, mass: Any = None, *, close: float = 0.0
) -> TrackedModes:
    """Which of the modes of this step each mode of the step before, with shapes `before` (p, k), has become.

    `values` (n,) are this step's eigenvalues in ascending order, and `shapes` (p, n) its shapes, which are orthonormal
    with respect to `mass` (p, p), or to the identity without it. Tracked modes go one to one where the sum of their
    MACs is largest, so that two of them may cross. Shapes of repeated eigenvalues are arbitrary in their space: they
    are turned to be nearest to those before (the orthogonal Procrustes problem, Schoenemann 1966). With `close` modes
    whose eigenvalues differ by no more than this, relative, may have mixed, as where frequencies veer: they are
    compared as a space, and within it by their own shapes.
    """
    x, lam, y = np.asarray(before, dtype=float), np.asarray(values, dtype=float), np.array(shapes, dtype=float)
    weighted = x if mass is None else mass @ x
    overlap = weighted.T @ y / np.sqrt(np.einsum("ik,ik->k", x, weighted))[:, None]
    for group in close_groups(lam, REPEATED_EIGENVALUES):
        if len(group) > 1 and len(overlap):
            turn = _turn(overlap[:, group])
            y[:, group], overlap[:, group] = y[:, group] @ turn, overlap[:, group] @ turn
    likeness = overlap**2
    gain = likeness.copy()
    for group in close_groups(lam, close):
        if len(group) > 1:
            likeness[:, group] = space_mac(x, y[:, group], mass)[:, None]
            gain[:, group] = likeness[:, group] + OWN_SHARE * overlap[:, group] ** 2
    rows, columns = assignment(-gain)
    number, found = np.full(len(overlap), -1, dtype=np.intp), np.zeros(len(overlap))
    number[rows], found[rows] = columns, likeness[rows, columns]
    return TrackedModes(number, found, y)


def _turn(overlap: Array) -> Array:
    """Rotation (m, m) of shapes of one eigenvalue that brings them nearest to the modes before, overlap (k, m).

    Those of the k modes that lie most in the space have a part in it.
    """
    nearest = np.sort(np.argsort(-(overlap**2).sum(axis=1))[: overlap.shape[1]])
    U, _, Vt = np.linalg.svd(overlap[nearest], full_matrices=True)
    turn = Vt.T.copy()
    turn[:, : len(nearest)] = turn[:, : len(nearest)] @ U.T
    return turn
