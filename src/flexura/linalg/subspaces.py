"""Lowest eigenpairs of stacks of small dense pencils, and groups of nearly equal ones of a sparse pencil.

Stacks, one pencil a design, go through subspace iteration (Bathe 1996, sec. 11.6) without a Python loop over designs.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray
from scipy.linalg import lapack

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.kernels import Kernel, is_compiled, packed, scratch
from flexura.linalg.bounds import stable_count
from flexura.linalg.eigen import lowest
from flexura.linalg.factor import DENSE_LIMIT, SINGULAR_PIVOT, pivoted
from flexura.linalg.krylov import LANCZOS_BLOCKS, lowest_by_blocks
from flexura.linalg.pencil import Eigenpairs, scaled, unit_scale

GUARD = 4
"""Iteration vectors beyond the wanted ones (Bathe 1996, sec. 11.6)."""

SUBSPACE_STEPS = 8

SUBSPACE_ERROR = 1e-11
"""Estimated relative error at which an eigenvalue is accepted."""

LARGEST_TURNED = 16
"""Largest small pencils that the kernel's rotations solve: beyond, LAPACK's reflections take less."""

_compiled = Kernel("small_pencils", "aaaaaaa")

COUNTED_ABOVE = 0.01
"""Farthest above the last eigenvalue, relative, that those up to it are counted."""


def lowest_values(K: Array, M: Array, count: int, start: Eigenpairs | None = None) -> Array:
    """The `count` lowest eigenvalues (..., count), ascending, of K x = lambda M x, both (..., n, n).

    Subspace iteration (Bathe 1996, sec. 11.6) from `start`, the count + GUARD lowest eigenpairs of a design like these
    (default: of the one in the middle of the stack). The remaining error of each eigenvalue is estimated from the ratio
    of its last two changes; designs in which it has not fallen below 1e-11, or K is singular, are solved one by one.
    Raises SolverError where K + M is singular.
    """
    n, lead = K.shape[-1], K.shape[:-2]
    K, M = K.reshape(-1, n, n), M.reshape(-1, n, n)
    if n <= 2 * (count + GUARD) or (start is None and len(K) < 4):
        return _one_by_one(K, M, count).values.reshape(*lead, count)
    if start is None:
        start = lowest(K[len(K) // 2], M[len(K) // 2], count + GUARD)
    K, M, d = _scaled(K, M)
    pairs, error = _iterate(K, M, Eigenpairs(start.values, start.vectors / d[:, :, None]), count, SUBSPACE_ERROR)
    slow = ~(error < SUBSPACE_ERROR)
    if slow.any():
        pairs.values[slow, :count] = _one_by_one(K[slow], M[slow], count).values
    return pairs.values[:, :count].reshape(*lead, count)


def lowest_pairs(K: Array, M: Array, count: int, start: Eigenpairs, tolerance: float) -> Eigenpairs:
    """Approximations (designs, p), (designs, n, p) of the p = min(count + GUARD, n) lowest eigenpairs of stacks
    K x = lambda M x, the first `count` eigenvalues to about `tolerance`; both (designs, n, n).

    `start` holds eigenpairs of a design like these. Designs whose K + M is singular to working accuracy have NaN.
    """
    n = K.shape[-1]
    p = min(count + GUARD, n)
    if n <= 2 * p or start.vectors.shape[-1] < p:
        return _each(K, M, p)
    K, M, d = _scaled(K, M)
    pairs, error = _iterate(K, M, Eigenpairs(start.values, start.vectors / d[:, :, None]), count, tolerance)
    slow = ~(error < tolerance)
    if slow.any():
        alone = _each(K[slow], M[slow], p)
        pairs.values[slow], pairs.vectors[slow] = alone.values, alone.vectors
    return Eigenpairs(pairs.values, pairs.vectors * d[:, :, None])


def _scaled(K: Array, M: Array) -> tuple[Array, Array, Array]:
    """K and M scaled to unit diagonal of K, and the scale (designs, n)."""
    d = unit_scale(K)
    return scaled(K, d), scaled(M, d), d


def _iterate(K: Array, M: Array, start: Eigenpairs, count: int, tolerance: float) -> tuple[Eigenpairs, Array]:
    """Subspace iteration from the pairs of one design: pairs (designs, p), (designs, n, p), errors (designs,).

    Those of a design are of the step at which it has converged, however many more the others take.
    """
    MX = M @ start.vectors
    values = np.broadcast_to(start.values[:count], (len(M), count))
    change, error = np.ones(len(M)), np.full(len(M), np.inf)
    solve, definite = _solver(K)
    pairs, reached = Eigenpairs(np.empty(MX.shape[::2]), np.empty_like(MX)), np.full(len(M), np.inf)
    for step in range(SUBSPACE_STEPS):
        Y = solve(MX)
        Yt = np.swapaxes(Y, -1, -2)
        MY = M @ Y
        # Ritz pairs of the inverse, both matrices small: (Y' M X) z = lambda (Y' M Y) z
        new, Z = small_pencils(Yt @ MX, Yt @ MY)
        with np.errstate(invalid="ignore", divide="ignore"):
            # infinite where M Y is not positive enough: never accepted
            before, change = change, np.max(np.abs(new[:, :count] / values - 1), axis=-1)
            ratio = np.minimum(change / np.maximum(before, 1e-300), 0.99)
            error = np.where(definite, change * ratio / (1 - ratio), np.inf)
        values = new[:, :count]
        ended = ~(reached < tolerance) & ((error < tolerance) | (step == SUBSPACE_STEPS - 1))
        if ended.all():
            return Eigenpairs(new.copy(), Y @ Z), error
        pairs.values[ended], pairs.vectors[ended], reached[ended] = new[ended], (Y @ Z)[ended], error[ended]
        if (reached < tolerance).all():
            break
        MX = MY @ Z
    return pairs, reached


def _solver(K: Array) -> tuple[Callable[[Array], Array], NDArray[np.bool_]]:
    """The function that solves K Y = X for stacks of X, and for which designs (designs,) K is positive definite: for
    others Y is X. LAPACK's Cholesky factors one by one, which serve every step, take a quarter of the time of NumPy's
    stacked LU."""
    factored = [lapack.dpotrf(stiffness.T) for stiffness in K]
    factors = [np.eye(K.shape[-1]) if failed else factor for factor, failed in factored]

    def solve(X: Array) -> Array:
        return np.stack([lapack.dpotrs(factor, x)[0] for factor, x in zip(factors, X, strict=True)])

    return solve, np.array([not failed for _, failed in factored])


def small_pencils(A: Array, B: Array) -> tuple[Array, Array]:
    """Eigenpairs of small pencils A z = lambda B z (k, n, n), ascending, vectors B-orthonormal; B positive definite.

    Where a B is not, those of its largest leading part that is, with zeros below, then infinite ones with unit vectors.
    """
    if is_compiled() and A.shape[-1] <= LARGEST_TURNED:
        return _by_kernel(A, B)
    if len(A) == 1:
        # LAPACK knows the pencil as a whole, but not stacks of it
        values, Z, failed = lapack.dsygv(A[0], B[0], uplo="U")
        if not failed:
            return values[None], Z[None]
    d = unit_scale(B)
    L, good = factors(scaled(B, d))
    bad = np.flatnonzero(~good)
    L[bad] = np.eye(B.shape[-1])
    Li = np.linalg.inv(L)
    C = Li @ scaled(A, d) @ np.swapaxes(Li, -1, -2)
    C[bad] = 0.0
    values, Z = np.linalg.eigh(C, UPLO="U")
    Z = d[:, :, None] * (np.swapaxes(Li, -1, -2) @ Z)
    for k in bad:
        values[k], Z[k] = _leading(A[k], B[k])
    return values, Z


def _by_kernel(A: Array, B: Array) -> tuple[Array, Array]:
    """The same by the kernel."""
    count, n, _ = A.shape
    values, Z, good = np.empty((count, n)), np.empty((count, n, n)), np.empty(count, dtype=np.int64)
    sizes, room = packed(count, n), scratch(6 * n * n + 2 * n)
    if _compiled(np.ascontiguousarray(A), np.ascontiguousarray(B), sizes, room, values, Z, good):
        for k in np.flatnonzero(good == 0):
            values[k], Z[k] = _leading(A[k], B[k])
    return values, Z


def _leading(A: Array, B: Array) -> tuple[Array, Array]:
    """Eigenpairs of a pencil (n, n) as far as B is positive definite."""
    values, Z = np.full(len(B), np.inf), np.diag(unit_scale(B))
    for n in range(len(B) - 1, 0, -1):
        if np.isfinite(A[:n, :n]).all() and factors(scaled(B[:n, :n], unit_scale(B[:n, :n]))[None])[1].all():
            eigenvalues, vectors = small_pencils(A[None, :n, :n], B[None, :n, :n])
            values[:n], Z[:n, :n] = eigenvalues[0], vectors[0]
            break
    return values, Z


def factors(A: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Cholesky factors of matrices (k, n, n), NaN where there is none, and where there is one (k,)."""
    try:
        L = np.asarray(np.linalg.cholesky(A), dtype=np.float64)
        return L, np.asarray(np.isfinite(L).all(axis=(-1, -2)))  # what is no number is not always refused
    except np.linalg.LinAlgError:
        if len(A) == 1:
            return np.full(A.shape, np.nan), np.zeros(1, dtype=bool)
        halves = [factors(half) for half in np.array_split(A, 2)]
        return np.concatenate([L for L, _ in halves]), np.concatenate([good for _, good in halves])


def _one_by_one(K: Array, M: Array, count: int) -> Eigenpairs:
    pairs = [lowest(k, m, count) for k, m in zip(K, M, strict=True)]
    return Eigenpairs(np.stack([f.values for f in pairs]), np.stack([f.vectors for f in pairs]))


def _each(K: Array, M: Array, count: int) -> Eigenpairs:
    """The same, NaN for designs that cannot be solved."""
    designs, n = K.shape[:2]
    pairs = Eigenpairs(np.full((designs, count), np.nan), np.full((designs, n, count), np.nan))
    for k in range(designs):
        with suppress(SolverError):
            alone = lowest(K[k], M[k], count)
            pairs.values[k], pairs.vectors[k] = alone.values, alone.vectors
    return pairs


def lowest_groups(
    K: Any, M: Any, count: int, *, guard: int, gap: float, forces: Callable[[Array], Array]
) -> Eigenpairs | None:
    """The `count` lowest eigenpairs of sparse symmetric K and M (n, n), and up to `guard - 1` more that follow without
    a relative gap wider than `gap`; an inertia count proves that there are no others below.

    `forces` gives K X (n, k) to more digits than the sums that K holds have: the pairs are those of it.

    None where that does not come out: for full or small matrices, K that is not definite, a search that does not
    converge, more that follow.
    """
    if isinstance(K, np.ndarray) or K.shape[0] <= max(DENSE_LIMIT, LANCZOS_BLOCKS * (count + guard)):
        return None
    pivot, factors = pivoted(K)
    if factors is None or pivot <= SINGULAR_PIVOT:
        return None
    d = factors.scale
    found = lowest_by_blocks(factors.solve_scaled, scaled(M, d), count, guard, gap)
    if found is None:
        return None
    stop, values, vectors = found
    last = values[stop - 1]
    level = min((last + values[stop]) / 2, (1 + COUNTED_ABOVE) * last)
    if stable_count((K - level * M).tocsc()) != stop:
        return None
    found = Eigenpairs(values[:stop], d[:, None] * vectors)
    return _refined(found, forces(found.vectors), M, factors.solve)


def _refined(pairs: Eigenpairs, KX: Array, M: Any, solve: Callable[[Array], Array]) -> Eigenpairs:
    """Eigenpairs after a step of inverse iteration from vectors X of which K X (n, k) is known; the factors solve for
    what is missing alone, so that their round-off is a part of it (Dongarra, Moler, Wilkinson 1983)."""
    forces = (M @ pairs.vectors) * pairs.values
    X = pairs.vectors + solve(forces - KX)
    A = X.T @ forces
    values, turn = la.eigh((A + A.T) / 2, X.T @ (M @ X))
    return Eigenpairs(values, X @ turn)
