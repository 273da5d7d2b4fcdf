"""Derivatives of eigenvalues and eigenvectors of K(p) x = lambda M(p) x, repeated eigenvalues included."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg import Eigenpairs, inverse_roots, lowest, scaled
from flexura.modal import REPEATED_EIGENVALUES, close_groups
from flexura.sensitivity.variation import Change

GUARD = 3
"""Eigenvalues computed beyond those wanted, to see whether the last one is repeated."""


def whole_clusters(K: Any, M: Any, n: int) -> Eigenpairs:
    """The lowest n eigenpairs, and further copies of the last where it is repeated."""
    count = n + GUARD
    while True:
        pairs = lowest(K, M, count)
        own = pairs.values[np.isfinite(pairs.values)]
        groups = clusters(own)
        stop = next((g[-1] + 1 for g in groups if g[-1] + 1 >= n), len(own))
        if stop < count or count >= K.shape[0]:
            return Eigenpairs(own[:stop], pairs.vectors[:, :stop])
        count *= 2


def clusters(values: Array) -> list[list[int]]:
    """Positions of ascending values, those that are repeated together."""
    return [group.tolist() for group in close_groups(values, REPEATED_EIGENVALUES)]


@dataclass(frozen=True)
class Cluster:
    """One eigenvalue of multiplicity m and how its eigenvectors X (n, m) move, for P parameters.

    `slope` (P, m, m) is X' (K' - lambda M') X, `mass` (P, m, m) X' M' X, and `outer` (P, n, m) the part of X' that is
    M-orthogonal to X (theory eqs. K4-K7).
    """

    at: list[int]
    value: float
    X: Array
    slope: Array
    mass: Array
    outer: Array


def moved_clusters(K: Any, M: Any, pairs: Eigenpairs, changes: Sequence[Change], shapes: bool = True) -> list[Cluster]:
    """Every eigenvalue of the pairs with its derivatives; without `shapes`, `outer` is left zero.

    Raises SolverError when an eigenvector cannot be told from its neighbours.
    """
    found = []
    for at in clusters(pairs.values):
        X, value = pairs.vectors[:, at], float(np.mean(pairs.values[at]))
        force = np.stack([c.K[:, at] - value * c.M[:, at] for c in changes]) if changes else np.empty((0, *X.shape))
        slope = X.T @ force
        slope = (slope + np.swapaxes(slope, -1, -2)) / 2
        mass = np.stack([X.T @ c.M[:, at] for c in changes]) if changes else slope
        outer = np.zeros_like(force)
        if shapes and len(changes):
            outer = _orthogonal_parts(K, M, value, X, M @ X @ slope - force)
        found.append(Cluster(at, value, X, slope, mass, outer))
    return found


def _orthogonal_parts(K: Any, M: Any, value: float, X: Array, force: Array) -> Array:
    """V (P, n, m) with (K - value M) V = force and X' M V = 0: a system bordered by M X (theory eq. K6)."""
    n, m = X.shape
    d = inverse_roots(np.abs(K.diagonal()) + abs(value) * M.diagonal())
    border = d[:, None] * (M @ X)
    border /= np.linalg.norm(border, axis=0)
    right = np.concatenate([d[:, None] * np.moveaxis(force, 0, 1).reshape(n, -1), np.zeros((m, len(force) * m))])
    try:
        if isinstance(K, np.ndarray):
            A = scaled(K - value * M, d)
            y = la.solve(np.block([[A, border], [border.T, np.zeros((m, m))]]), right, assume_a="sym")
        else:
            A = sp.bmat([[scaled((K - value * M).tocsc(), d), border], [border.T, None]], format="csc")
            y = spla.splu(A).solve(right)
    except (la.LinAlgError, RuntimeError):
        raise SolverError(
            "the shapes' sensitivities are undefined: K - lambda M is singular beyond its modes"
        ) from None
    return np.moveaxis((d[:, None] * y[:n]).reshape(n, len(force), m), 1, 0)


@dataclass(frozen=True)
class Branch:
    """The m branches into which one eigenvalue goes as one parameter moves: derivatives (m,) and those of vectors
    X Q (n, m), with the rotation Q (m, m) in which they are differentiable."""

    value: Array
    vectors: Array
    Q: Array


Bends = Callable[[Array], tuple[Array, Array]]
"""K'' X and M'' X (n, k) of vectors X (n, k), by one parameter."""


def branches(cluster: Cluster, change: Change, p: int, bends: Bends) -> Branch:
    """Derivatives of a cluster's eigenvalues and M-normalised eigenvectors for parameter p (theory eqs. K4-K9).

    Distinct derivatives part a repeated eigenvalue, and fix its vectors (Ojalvo 1988; Mills-Curran 1988; Dailey 1989);
    where they agree too the vectors are left as they are, turned least.
    """
    at, X, value = cluster.at, cluster.X, cluster.value
    slopes, Q = la.eigh(cluster.slope[p])
    Z, V = X @ Q, cluster.outer[p] @ Q
    mass = Q.T @ cluster.mass[p] @ Q
    C = -mass / 2
    if len(at) > 1:
        apart = slopes - slopes[:, None]
        scale = np.abs(slopes).max(initial=0.0)
        split = np.abs(apart) > 1e-5 * scale if scale else np.zeros_like(apart, dtype=bool)
        if split.any():
            K2, M2 = bends(X)
            force = (change.K[:, at] - value * change.M[:, at]) @ Q
            top = Q.T @ X.T @ (K2 - value * M2) @ Q + 2 * force.T @ V - 2 * mass * slopes
            C = np.where(split, top / (2 * np.where(split, apart, 1.0)), C)
    return Branch(slopes, V + Z @ C, Q)
