"""Factors on a geometric stiffness at which a stiffness becomes singular."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse.linalg as spla

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg.factor import DENSE_LIMIT, Matrix, factorise, is_definite
from flexura.linalg.inertia import count_below
from flexura.linalg.scaling import scaled, unit_scale
from flexura.linalg.search import toarray

DENSE = 1200
"""Up to this order several buckling loads come from a dense solver, which misses no copies."""

BASIS = 30
"""Vectors of Lanczos' method beyond two for each factor."""

SETTLED = 1e-8
"""Relative error of factors that Lanczos' method finds: neighbours may be close."""

STRIDE = 16
"""Ratio of factors that are tried one after another."""

LEFT = 1e-5
"""Forces that a buckling shape leaves, relative to those of the stiffness, diagonals scaled to one."""

ROUNDING = 1e-8
"""Relative size of an eigenvalue of K_g beside K that is round-off: a load that buckles nothing."""


def critical_factors(K: Matrix, K_g: Matrix, n: int) -> Array:
    """The `n` lowest positive factors (k,) at which K + factor K_g is singular (theory eq. P7), fewer if there are.

    K, K_g: (n, n) symmetric, full or sparse, K definite. The first that is searched for by Lanczos is confirmed by
    inertia counts on both sides. Raises SolverError when K is not definite or the counts contradict.
    """
    return _critical(K, K_g, n, shapes=False)[0]


def critical_shapes(K: Matrix, K_g: Matrix, n: int) -> tuple[Array, Array]:
    """The same factors (k,), each with its shape x (order, k): (K + factor K_g) x = 0, x' K x = 1.

    Shapes of equal factors are some that span them all. Raises SolverError as `critical_factors`, and when a shape
    leaves more than `LEFT` of the forces K x.
    """
    factors, x = _critical(K, K_g, n, shapes=True)
    forces = np.asarray(K @ x)
    d = unit_scale(K)[:, None]
    sizes = (np.linalg.norm(d * own, axis=0) for own in (forces + factors * np.asarray(K_g @ x), forces))
    if any(left > LEFT * whole for left, whole in zip(*sizes, strict=True)):
        raise SolverError("buckling shapes were not found: their forces do not vanish at the factors found")
    return factors, x / np.sqrt(np.einsum("ik,ik->k", x, forces))


def _critical(K: Matrix, K_g: Matrix, n: int, shapes: bool) -> tuple[Array, Array]:
    """Factors (k,), and their shapes (order, k), of any size; no shapes where these are not asked for."""
    if not is_definite(K):
        raise SolverError("something can move freely without load: there is nothing to buckle")
    d = unit_scale(K)
    Ks, Gs = scaled(K, d), scaled(K_g, d)
    order = K.shape[0]
    count = min(n, order)
    least = ROUNDING * float(abs(Gs).max())
    if not least > 0:
        return np.empty(0), np.empty((order, 0))
    searched = order > (DENSE_LIMIT if count == 1 else DENSE)
    near = _near(Ks, Gs, 1 / least) if searched else 0.0
    if searched:
        Ks = Ks + near * Gs
        inverse = spla.LinearOperator(Ks.shape, matvec=factorise(Ks).solve, dtype=float)
        options = {"v0": np.cos(np.arange(order)), "ncv": min(order, 2 * count + BASIS), "tol": SETTLED}
        found = spla.eigsh(Gs, k=count, M=Ks, Minv=inverse, which="SA", return_eigenvectors=shapes, **options)
    else:
        found = la.eigh(toarray(Gs), toarray(Ks), eigvals_only=not shapes, subset_by_index=[0, count - 1])
    mu, y = (found[0], found[1]) if shapes else (np.asarray(found), np.empty((0, count)))
    ranked = np.argsort(mu)
    ranked = ranked[mu[ranked] < 0]
    factors = near - 1 / mu[ranked]
    kept = factors < 1 / least
    factors, y = factors[kept], y[:, ranked[kept]]
    if searched and len(factors):
        below, above = (count_below((K + f * factors[0] * K_g).tocsc(), K, 0.0) for f in (1 - 1e-4, 1 + 1e-4))
        if below or not above:
            raise SolverError("inertia counts do not confirm the buckling factor")
    return factors, d[:, None] * y if shapes else y


def _near(K: Matrix, K_g: Matrix, most: float) -> float:
    """A factor below the lowest one, K definite: next to it Lanczos' method finds that quickly."""
    factor = 0.0
    while is_definite(K + max(1.0, STRIDE * factor) * K_g):
        factor = max(1.0, STRIDE * factor)
        if factor > most:
            break
    return factor
