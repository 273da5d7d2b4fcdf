"""Energies of substructures by their deformation, up to the fourth order, all inside in equilibrium (Koiter 1945)."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations, permutations

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.motion.substructures import Substructure
from flexura.motion.superelements import Polynomial

MOST_DEFORMATIONS = {2: 60, 3: 30}
"""Deformations of a substructure up to which terms of forces of an order are worked out."""

STIFFNESS_CHANGE = 0.01
"""Relative change of the stiffness at the deformations from which derivatives are differences."""

LARGEST_TURN = 0.02
"""Rotations there at most, rad, and displacements over the size of the substructure."""

SOFTEST = 1e-10
"""Stiffness over the largest one, of what deforms without resistance."""

ATTEMPTS = 6


def expanded(substructure: Substructure, order: int) -> Polynomial:
    """The energy with forces of so high an order, 1 to 3, in the deformations.

    Third and fourth derivatives are central differences of exact condensed stiffnesses, in directions of equal energy
    and symmetrised (theory eq. G28). Raises SolverError when there is no equilibrium inside near rest.
    """
    n = 6 * (substructure.k - 1)
    undeformed = substructure.condensed(np.zeros((1, n))).tangent[0]
    if not np.isfinite(undeformed).all():
        raise SolverError(f"{substructure.name} has no equilibrium inside, undeformed already")
    if order < 2 or n > MOST_DEFORMATIONS[2]:
        return Polynomial.linear(undeformed[None])
    unit = np.tile([substructure.size] * 3 + [1.0] * 3, substructure.k - 1)
    values, vectors = np.linalg.eigh(unit[:, None] * undeformed * unit)
    root = np.sqrt(np.maximum(values, SOFTEST * values[-1]))
    V, back = unit[:, None] * vectors / root, (vectors * root).T / unit
    none = V.T @ undeformed @ V
    size, sides = _amplitude(substructure, V, unit, none)
    cubic = (sides[0] - sides[1]) / (2 * size)
    c = _symmetric(np.moveaxis(cubic, 0, -1))
    for axis in range(3):
        c = np.moveaxis(np.tensordot(c, back, axes=(axis, 0)), -1, axis)
    if order < 3 or n > MOST_DEFORMATIONS[3]:
        return Polynomial(undeformed[None], c[None], np.empty((0,) * 5))
    q = _quartic(substructure, V, size, sides, none)
    for axis in range(4):
        q = np.moveaxis(np.tensordot(q, back, axes=(axis, 0)), -1, axis)
    return Polynomial(undeformed[None], c[None], q[None])


def _amplitude(substructure: Substructure, V: Array, unit: Array, none: Array) -> tuple[float, Array]:
    """How far to go along the columns of V, and stiffnesses (2, d, d, d) that far to both sides."""
    size = LARGEST_TURN / float(np.abs(V / unit[:, None]).max())
    for _ in range(ATTEMPTS):
        sides = _stiffness(substructure, np.concatenate([size * V.T, -size * V.T]), V).reshape(2, *(len(V),) * 3)
        change = float(np.abs(sides - none).max())
        if change < 2 * STIFFNESS_CHANGE:
            return size, sides
        size *= 0.1 if not np.isfinite(change) else max(STIFFNESS_CHANGE / change, 0.1)
    raise SolverError(f"{substructure.name} changes its stiffness at once as it deforms")


def _stiffness(substructure: Substructure, d: Array, V: Array) -> Array:
    """Stiffnesses at deformations (m, d) by the columns of V."""
    return V.T @ substructure.condensed(d).tangent @ V


def _quartic(substructure: Substructure, V: Array, size: float, sides: Array, none: Array) -> Array:
    """Fourth derivatives (d, d, d, d) by the columns of V.

    Indices fall into three classes, so that of any four two are of one class: stiffnesses along the sums of such pairs
    are enough.
    """
    n = len(V)
    pairs = [(i, j) for i, j in combinations(range(n), 2) if i % 3 == j % 3]
    both = np.array([V[:, i] + V[:, j] for i, j in pairs]).reshape(-1, n)
    mixed = _stiffness(substructure, size * np.concatenate([both, -both]), V).reshape(2, -1, n, n)
    q, known = np.zeros((n,) * 4), np.zeros((n, n))
    second = sides.sum(axis=0) - 2 * none
    for i in range(n):
        q[i, i], known[i, i] = second[i] / size**2, 1.0
    for (i, j), one, other in zip(pairs, *mixed, strict=True):
        q[i, j] = q[j, i] = (one + other - 2 * none - second[i] - second[j]) / (2 * size**2)
        known[i, j] = known[j, i] = 1.0
    weight = _symmetric(np.broadcast_to(known[:, :, None, None], q.shape))
    return _symmetric(q) / weight


def _symmetric(tensor: Array) -> Array:
    """The mean over all orders of the indices."""
    orders: Iterable[tuple[int, ...]] = permutations(range(tensor.ndim))
    transposed = [np.transpose(tensor, order) for order in orders]
    return np.asarray(sum(transposed) / len(transposed))
