"""Factors on a geometric stiffness at which a stiffness becomes singular."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from flexura.errors import SolverError
from flexura.linalg.factor import factorise, is_definite
from flexura.linalg.inertia import count_below
from flexura.linalg.scaling import scaled, unit_scale

Array = NDArray[np.float64]

DENSE = 1200
"""Up to this order buckling loads come from a dense solver."""

ROUNDING = 1e-8
"""Relative size of an eigenvalue of K_g beside K that is round-off: a load that buckles nothing."""


def critical_factors(K: sp.csc_matrix, K_g: sp.csc_matrix, n: int) -> Array:
    """The `n` lowest positive factors (k,) at which K + factor K_g is singular (theory eq. P7), fewer if there are.

    K, K_g: (n, n) symmetric, K definite. The first is confirmed by inertia counts on both sides. Raises SolverError
    when K is not definite or the counts contradict.
    """
    if not is_definite(K):
        raise SolverError("something can move freely without load: there is nothing to buckle")
    d = unit_scale(K)
    Ks, Gs = scaled(K, d), scaled(K_g, d)
    count = min(n, K.shape[0])
    if K.shape[0] <= DENSE:
        mu = la.eigh(Gs.toarray(), Ks.toarray(), eigvals_only=True, subset_by_index=[0, count - 1])
    else:
        inverse = spla.LinearOperator(Ks.shape, matvec=factorise(Ks).solve, dtype=float)
        start = np.cos(np.arange(K.shape[0]))
        mu = spla.eigsh(Gs, k=count, M=Ks, Minv=inverse, which="SA", return_eigenvectors=False, v0=start)
    factors = np.sort(-1 / mu[mu < -ROUNDING * max(float(abs(Gs).max()), 1e-300)])
    if len(factors):
        below, above = (count_below((K + f * factors[0] * K_g).tocsc(), K, 0.0) for f in (1 - 1e-4, 1 + 1e-4))
        if below or not above:
            raise SolverError("inertia counts do not confirm the buckling factor")
    return factors
