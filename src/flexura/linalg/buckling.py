"""Factors on a geometric stiffness at which a stiffness becomes singular."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from flexura.errors import SolverError
from flexura.linalg.factor import DENSE_LIMIT, Matrix, factorise, is_definite
from flexura.linalg.inertia import count_below
from flexura.linalg.scaling import scaled, unit_scale
from flexura.linalg.search import toarray

Array = NDArray[np.float64]

DENSE = 1200
"""Up to this order several buckling loads come from a dense solver, which misses no copies."""

BASIS = 30
"""Vectors of Lanczos' method beyond two for each factor."""

SETTLED = 1e-8
"""Relative error of factors that Lanczos' method finds: neighbours may be close."""

STRIDE = 16
"""Ratio of factors that are tried one after another."""

ROUNDING = 1e-8
"""Relative size of an eigenvalue of K_g beside K that is round-off: a load that buckles nothing."""


def critical_factors(K: Matrix, K_g: Matrix, n: int) -> Array:
    """The `n` lowest positive factors (k,) at which K + factor K_g is singular (theory eq. P7), fewer if there are.

    K, K_g: (n, n) symmetric, full or sparse, K definite. The first that is searched for by Lanczos is confirmed by
    inertia counts on both sides. Raises SolverError when K is not definite or the counts contradict.
    """
    if not is_definite(K):
        raise SolverError("something can move freely without load: there is nothing to buckle")
    d = unit_scale(K)
    Ks, Gs = scaled(K, d), scaled(K_g, d)
    order = K.shape[0]
    count = min(n, order)
    least = ROUNDING * max(float(abs(Gs).max()), 1e-300)
    if order <= (DENSE_LIMIT if count == 1 else DENSE):
        mu = la.eigh(toarray(Gs), toarray(Ks), eigvals_only=True, subset_by_index=[0, count - 1])
        return np.sort(-1 / mu[mu < -least])
    near = _near(Ks, Gs, 1 / least)
    Ks = Ks + near * Gs
    inverse = spla.LinearOperator(Ks.shape, matvec=factorise(Ks).solve, dtype=float)
    start, basis = np.cos(np.arange(order)), min(order, 2 * count + BASIS)
    mu = spla.eigsh(
        Gs, k=count, M=Ks, Minv=inverse, which="SA", return_eigenvectors=False, v0=start, ncv=basis, tol=SETTLED
    )
    factors = near + np.sort(-1 / mu[mu < 0])
    factors = factors[factors < 1 / least]
    if len(factors):
        below, above = (count_below((K + f * factors[0] * K_g).tocsc(), K, 0.0) for f in (1 - 1e-4, 1 + 1e-4))
        if below or not above:
            raise SolverError("inertia counts do not confirm the buckling factor")
    return factors


def _near(K: Matrix, K_g: Matrix, most: float) -> float:
    """A factor below the lowest one, K definite: next to it Lanczos' method finds that quickly."""
    factor = 0.0
    while is_definite(K + max(1.0, STRIDE * factor) * K_g):
        factor = max(1.0, STRIDE * factor)
        if factor > most:
            break
    return factor
