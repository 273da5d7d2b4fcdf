"""Proven intervals for eigenvalues of K x = lambda M x from approximate eigenvectors and one factorisation.

Ritz values of K bound the lowest eigenvalues from above (Poincare; Parlett 1980, sec. 10.2). The inverse
C = (K - rho M)^-1 M, self-adjoint in the M-inner product, has the eigenvalues 1/(lambda - rho): its own Ritz values
bound those below rho from below (Lehmann 1949; Maehly 1952; Parlett 1980, sec. 10.5), once an inertia count has said
how many there are. Both bounds are second order in the error of the vectors. What decides the last digits is evaluated
in extended precision, where the machine has it, so that the bounds hold for the matrices as they are stored.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.linalg.inertia import shifted_factors

Array = NDArray[np.float64]

Extended = np.longdouble

PRODUCT = 64 * float(np.finfo(Extended).eps)
"""Relative error of K x in extended precision: as many terms as a row of K has, and some margin."""

DOT = 1e-13
"""Relative error of what is left in double precision: inner products of long vectors and small eigenproblems."""


@dataclass(frozen=True)
class Enclosures:
    """What one factorisation of K - rho M and k trial vectors prove about the eigenvalues below rho.

    `count` eigenvalues lie below `rho`. The lowest k are at most `upper` (k,); the i-th largest of those below rho is
    at least `lower[-1 - i]`. So when count is k, [lower, upper] encloses each of the k lowest, number by number.
    `remainder` (n, k) are the residuals C x - theta x of the directions x, of unit M-norm, that `lower` belongs to.
    """

    rho: float
    count: int
    lower: Array
    upper: Array
    remainder: Array

    @property
    def is_complete(self) -> bool:
        """True when as many eigenvalues lie below rho as there are trial vectors."""
        return self.count == len(self.upper)


def enclose(K: Any, M: Any, vectors: Array, rho: float) -> Enclosures:
    """Bounds on the eigenvalues of K x = lambda M x below about `rho` from k trial vectors (n, k) (theory eqs. C1-C4).

    K, M: (n, n) sparse, symmetric, M positive semidefinite; vectors independent in the M-norm. rho may be moved
    slightly where its factorisation would be unstable. Raises SolverError when there is none.
    """
    factors = shifted_factors(K, M, rho)
    rho = factors.value
    X, MX = vectors, M @ vectors
    Y = factors.solve(MX)
    Y += factors.solve(MX - (K @ Y - rho * (M @ Y)))
    KX, KY = np.hsplit(_product(K, np.hstack([X, Y])), 2)
    rest = MX - (KY - rho * (M @ Y))
    # x' M C x exactly: the error of Y comes in as rest' (K - rho M)^-1 rest
    inverse = Y.T @ MX + Y.T @ rest + rest.T @ factors.solve(rest)
    gram = X.T @ MX
    size = np.diagonal(gram)
    stiff = np.einsum("ik,ik->k", abs(X), abs(K) @ abs(X)) * PRODUCT
    left = np.einsum("ik,ik->k", abs(X), abs(KX) + rho * abs(MX)) * DOT
    slack = float(np.max((stiff + left) / size))
    upper, _ = _ritz(X.T @ KX, gram)
    theta, Z = _ritz(inverse, gram)
    with np.errstate(divide="ignore"):
        # an error DOT max|theta| of theta moves 1/theta by that over theta^2
        lower = np.where(theta < 0, rho + 1 / theta - DOT * np.abs(theta).max() / theta**2, -np.inf)
    order = np.argsort(lower, kind="stable")
    remainder = (Y @ Z - theta * (X @ Z))[:, order]
    return Enclosures(rho, factors.count, lower[order] - slack, upper + slack, remainder)


def _product(K: Any, X: Array) -> Array:
    """K X, which cancels, in extended precision and rounded to double; K symmetric."""
    wide: Any = K.astype(Extended)
    if sp.issparse(K):
        wide = wide.tocsc().T  # by rows, which are the columns
    return np.asarray(wide @ X.astype(Extended), dtype=np.float64)


def _ritz(A: Array, gram: Array) -> tuple[Array, Array]:
    """Eigenpairs (k,), (k, k), ascending, of A z = theta gram z."""
    d = 1 / np.sqrt(np.diagonal(gram))
    scale = d[:, None] * d
    theta, Z = la.eigh((A + A.T) / 2 * scale, (gram + gram.T) / 2 * scale)
    return theta, d[:, None] * Z
