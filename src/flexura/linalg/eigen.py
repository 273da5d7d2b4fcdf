"""Lowest eigenpairs of K x = lambda M x, accurate and complete, of things that are held and of things that float.

What floats has a singular K: it is shifted by a negative value next to its lowest elastic eigenvalue, which a first
search finds. Eigenvalues of a `Pencil` are Rayleigh quotients of energies.
"""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg.factor import SINGULAR_PIVOT, Matrix, SuperLU, pivoted
from flexura.linalg.pencil import Pencil
from flexura.linalg.residual_bounds import solution
from flexura.linalg.search import Eigenpairs, next_to

COARSE = 1e-9
"""First shift of something that floats, over the largest ratio of stiffness to mass."""

UNKNOWN = 2e-5
"""Part of that shift below which values of matrices whose history is not known are round-off."""

DEPENDENT = 1e-8
"""Squared part of a vector beside rigid motions below which it is one of them."""

CLEAR = 10.0
"""An eigenvalue so many times above its own round-off shows where the elastic ones begin."""

ROUNDS = 8
"""Attempts to find a shift next to the lowest elastic eigenvalue."""


def lowest(K: Matrix, M: Matrix, count: int) -> Eigenpairs:
    """The `count` lowest eigenpairs of symmetric positive semidefinite K and M, both (n, n); K + M positive definite.

    As `lowest_modes` for matrices as they are stored. Raises SolverError when the search does not converge or K + M is
    singular.
    """
    n = K.shape[0]
    count = min(count, n)
    if count <= 0:
        return Eigenpairs(np.empty(0), np.empty((n, 0)))
    definite, factors = _definite(K)
    if definite:
        return next_to(K, M, count, 0.0, factors)
    # matrices of unknown history: what is small beside their largest ratio may be round-off
    coarse = coarse_shift(K, M)
    values = next_to(K, M, min(n, max(count, 6) + 1), -coarse).values
    elastic = values[(values > UNKNOWN * coarse) & np.isfinite(values)]
    first = min(float(elastic[0]), coarse / COARSE) if len(elastic) else 1e5 * coarse
    pairs = next_to(K, M, count, -first)
    zero = abs(pairs.values) < max(1e-7 * first, UNKNOWN * coarse)
    return Eigenpairs(np.where(zero, 0.0, pairs.values), pairs.vectors)


def lowest_modes(pencil: Pencil, count: int, rigid: Array | None = None) -> Eigenpairs:
    """The `count` lowest eigenpairs of a pencil, K and M positive semidefinite and K + M positive definite, finite ones
    only.

    Eigenvalues are Rayleigh quotients of energies (`Pencil.ritz`) and come out as exactly zero where these are not
    above their own round-off. When K is singular a negative shift next to the lowest elastic eigenvalue is used;
    `rigid` (n, r) are motions that may strain nothing. Raises SolverError when the search does not converge or K + M is
    singular.
    """
    count = min(count, pencil.order)
    if count <= 0:
        return Eigenpairs(np.empty(0), np.empty((pencil.order, 0)))
    definite, factors = _definite(pencil.K)
    if not definite:
        return _floating(pencil, count, rigid)
    found = _finite(next_to(pencil.K, pencil.M, count, 0.0, factors)).vectors
    pairs = ritz_pairs(pencil, _polished(pencil, found, 0.0, factors), rigid)
    # fewer: there are no more with mass, or the first is so soft that the others are lost beside it
    return pairs if len(pairs.values) == count else _floating(pencil, count, rigid)


def coarse_shift(K: Matrix, M: Matrix) -> float:
    """A first shift, without its sign, of K and M (n, n) that float."""
    stiff, mass = K.diagonal(), M.diagonal()
    return COARSE * float(np.max(stiff[mass > 0] / mass[mass > 0], initial=1.0))


def _definite(K: Matrix) -> tuple[bool, SuperLU | None]:
    """Whether K is definite, as `is_definite`, and its factors where they are sparse."""
    pivot, factors = pivoted(K)
    return pivot > SINGULAR_PIVOT, factors


def _polished(pencil: Pencil, X: Array, shift: float, factors: SuperLU | None = None) -> Array:
    """X (n, k) after one inverse iteration with the true stiffness: that which is factorised only preconditions it."""
    if pencil.strain is None or not X.shape[1]:
        return X
    Y = solution(pencil, pencil.M @ X, shift, factors)
    return Y / np.linalg.norm(Y, axis=0)


def _finite(pairs: Eigenpairs) -> Eigenpairs:
    finite = np.isfinite(pairs.values)
    return Eigenpairs(pairs.values[finite], pairs.vectors[:, finite])


def _floating(pencil: Pencil, count: int, rigid: Array | None) -> Eigenpairs:
    """The lowest pairs of a singular or very soft problem: the shift is moved until it stands next to the lowest
    eigenvalue that is not zero."""
    shift = coarse_shift(pencil.K, pencil.M)
    wanted = min(pencil.order, max(count, 6) + 1)
    seen: set[float] = set()
    pairs = None
    for _ in range(ROUNDS):
        try:
            found = next_to(pencil.K, pencil.M, wanted, -shift)
        except SolverError:
            if pairs is None:
                raise
            break  # so far down round-off in K is in the way
        fresh = ritz_pairs(pencil, _polished(pencil, _finite(found).vectors, -shift), rigid)
        pairs = fresh if pairs is None else _together(pencil, fresh, pairs, wanted)
        elastic = pairs.values[pairs.values > CLEAR * pencil.margin(pairs.vectors)]
        near = float(elastic[0]) if len(elastic) else 1e5 * shift  # else all that is elastic lies far above
        if shift / 3 <= near <= 3 * shift or round(np.log10(near)) in seen:
            break
        seen.add(round(np.log10(near)))
        shift = near
    assert pairs is not None
    return Eigenpairs(pairs.values[:count], pairs.vectors[:, :count])


def _together(pencil: Pencil, pairs: Eigenpairs, others: Eigenpairs, count: int) -> Eigenpairs:
    """The `count` lowest Ritz pairs in the span of some pairs and of what `others` add to it: a shift next to a very
    soft motion loses those far above it, which another has found."""
    Y = others.vectors
    for _ in range(2):
        Y = Y - pairs.vectors @ (pairs.vectors.T @ (pencil.M @ Y))
    Y = Y[:, np.einsum("ik,ik->k", Y, pencil.M @ Y) > DEPENDENT]
    if len(pairs.values) >= count or not Y.shape[1]:
        return pairs
    own = _zeroed(pencil, Eigenpairs(*pencil.ritz(np.hstack([pairs.vectors, Y]))))
    return Eigenpairs(own.values[:count], own.vectors[:, :count])


def ritz_pairs(pencil: Pencil, X: Array, rigid: Array | None = None) -> Eigenpairs:
    """The lowest Ritz pairs in the span of X (n, k), and of those `rigid` motions (n, r) that strain nothing, as many
    as X has columns; values not above their own round-off are zero.

    Rigid motions that strain nothing stand as they are and are taken out of X, so that nothing is mixed with them.
    """
    k = X.shape[1]
    if rigid is None or not rigid.shape[1]:
        return _zeroed(pencil, Eigenpairs(*pencil.ritz(X)))
    size = np.sqrt(np.einsum("ik,ik->k", rigid, pencil.M @ rigid))
    R = _zeroed(pencil, Eigenpairs(*pencil.ritz(rigid[:, size > 0] / size[size > 0])))
    free = R.vectors[:, R.values == 0]
    X = X / np.sqrt(np.einsum("ik,ik->k", X, pencil.M @ X))
    for _ in range(2):
        X = X - free @ (free.T @ (pencil.M @ X))
    X = X[:, np.einsum("ik,ik->k", X, pencil.M @ X) > DEPENDENT]
    pairs = _zeroed(pencil, Eigenpairs(*pencil.ritz(X))) if X.shape[1] else Eigenpairs(np.empty(0), X)
    values, vectors = np.concatenate([np.zeros(free.shape[1]), pairs.values]), np.hstack([free, pairs.vectors])
    order = np.argsort(values, kind="stable")[:k]
    return Eigenpairs(values[order], vectors[:, order])


def _zeroed(pencil: Pencil, pairs: Eigenpairs) -> Eigenpairs:
    """M-orthonormal pairs with the values that are not above their own round-off set to zero."""
    return Eigenpairs(np.where(pairs.values <= pencil.margin(pairs.vectors), 0.0, pairs.values), pairs.vectors)
