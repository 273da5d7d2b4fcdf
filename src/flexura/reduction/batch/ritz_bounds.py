"""Upper bounds on the eigenvalues of many designs from projections on Ritz vectors, whatever round-off these have.

Nothing of it is taken from how small pencils are solved: their vectors are trial vectors like any others, and what the
projections on them may be off by, in rows of the matrices that belong to the lowest ones, widens the bounds (theory
eqs. N6, N15, N16).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.linalg import small_pencils
from flexura.reduction.batch.chain_moments import EPS

CORRECTED = 0.45
"""Part of the lowest squared frequency left out up to which the response to their own inertia is added to Ritz
vectors."""

ZERO = 1e-3
"""A frequency that round-off alone makes, and that is below this part of the first elastic one, is zero."""

HIDDEN = 8.0
"""A vector whose mass is not so many times what round-off may amount to adds nothing."""

LAST = 1e3
"""Ratio of the value that such a vector is given, so that it comes last, to the highest of the others."""


def lost(A: Array, slack: Array, size: Array, terms: int) -> Array:
    """c^2 (..., 2, p) such that projections of K and M on p vectors, and their rotations, are right to c_i c_j, from
    A (3, ..., n, n), its `slack` (3, ..., n), and the sizes (..., n, p) of the vectors before digits cancel, in sums of
    `terms` terms."""
    n, p = size.shape[-2:]
    errors = slack[:2] + n * (terms + 2 * p + 16) * EPS * abs(np.einsum("...ii->...i", A[:2]))
    return np.asarray(np.moveaxis(errors, 0, -2) @ size**2)


def upper_bounds(
    K: Array, M: Array, R: Array, off: Array, values: Array, slowness: Array
) -> tuple[Array, Array, Array]:
    """Upper bounds (designs, p) on the p lowest eigenvalues of the full order, infinite where round-off hides them,
    the vectors (designs, p, p) that they belong to, and by how much the energy of these in K may be off (designs, p).

    K, M and R (designs, p, p) are projections on Ritz vectors of the squared frequencies `values` (designs, p); K and M
    are right to c_i c_j, with the squares `off` (designs, 2, p) of c.
    """
    # x'R x <= x'M x / mu, so that a factor below 1/2 keeps the mass positive, and twice what M has lost is enough
    scale = np.where(np.isfinite(values), values, 0.0)
    scale = np.where(scale * slowness[:, None] < CORRECTED, scale, 0.0)
    response = R * scale[:, None, :]
    # R, from above in lower bounds, must come from below in the mass
    stiff, massive = K + scale[:, :, None] * response, M + (1 - 1e-7) * (response + np.swapaxes(response, -1, -2))
    Z = _combined(stiff, massive, HIDDEN * off[:, 1] < np.einsum("dii->di", M))
    Zt = np.swapaxes(Z, -1, -2)
    k, m = ((abs(Zt) @ np.sqrt(own)[..., None])[..., 0] for own in (off[:, 0] + scale * off[:, 1], 2 * off[:, 1]))
    stiff, massive = Zt @ stiff @ Z, Zt @ massive @ Z
    highest = np.maximum.accumulate(np.einsum("dii->di", stiff), axis=1)
    eye = np.eye(K.shape[-1])
    of_K = _leading_sums(abs(stiff) * (1 - eye) + k[:, :, None] * k[:, None, :])
    of_M = _leading_sums(abs(massive - eye) + m[:, :, None] * m[:, None, :])
    known = np.isfinite(of_K) & (of_M < 1)
    upper = np.where(known, np.maximum(highest + of_K, of_K), np.inf) / np.where(known, 1 - of_M, 1.0)
    return upper, Z, k**2


def _combined(stiff: Array, massive: Array, known: NDArray[np.bool_]) -> Array:
    """Vectors (designs, p, p) of small pencils among those of p vectors that have a `known` mass (designs, p); no
    vector in the place of others, which come last."""
    a, b = (np.einsum("dii->di", own) for own in (stiff, massive))
    quotients = np.where(known, a / np.where(known, b, 1.0), np.inf)
    if (quotients[:, 1:] >= quotients[:, :-1]).all() and known.all():
        return small_pencils(stiff, massive)[1]
    # in ascending order small values keep their digits beside large ones
    order = quotients.argsort(axis=1, kind="stable")
    rows, columns = order[:, :, None], order[:, None, :]
    at = np.arange(len(order))[:, None, None]
    known = np.take_along_axis(known, order, axis=1)
    both = known[:, :, None] & known[:, None, :]
    A, B = (np.ascontiguousarray(np.where(both, own[at, rows, columns], 0.0)) for own in (stiff, massive))
    a, b = (np.einsum("dii->di", own) for own in (A, B))
    b[~known] = 1.0
    a[...] = np.where(known, a, LAST * (a / b).max(axis=1, keepdims=True))
    Z = np.empty(A.shape)
    Z[at, rows, np.arange(A.shape[-1])] = np.where(known[:, :, None], small_pencils(A, B)[1], 0.0)
    return Z


def _leading_sums(A: Array) -> Array:
    """Largest row sum (designs, p) of the first j rows and columns of A (designs, p, p), not negative, for every j."""
    return np.asarray(np.triu(A.cumsum(axis=-1)).max(axis=-2))


def settled(values: Array, upper: Array, margin: Array, rigid: int) -> tuple[NDArray[np.bool_], Array]:
    """Which eigenvalues (designs, p), of the `rigid` lowest, round-off of that `margin` alone makes, and upper bounds
    with that."""
    zero = (values < 4 * margin) & np.isfinite(upper) & (np.arange(values.shape[1]) < rigid)
    elastic = np.where(zero, np.inf, values).min(axis=1, keepdims=True)
    zero &= (4 * margin <= ZERO**2 * elastic) & np.isfinite(elastic)
    return zero, np.maximum.accumulate(np.maximum(upper, np.where(zero, 4 * margin, 0.0)), axis=1)
