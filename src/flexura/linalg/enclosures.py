"""Proven intervals for eigenvalues of K x = lambda M x from approximate eigenvectors and factorisations.

Ritz values of K bound the lowest eigenvalues from above (Poincare; Parlett 1980, sec. 10.2). The inverse
C = (K - rho M)^-1 M, self-adjoint in the M-inner product, has the eigenvalues 1/(lambda - rho): its own Ritz values
bound those below rho from below (Lehmann 1949; Maehly 1952; Parlett 1980, sec. 10.5), once an inertia count has said
how many there are. Both bounds are second order in the error of the vectors. Energies are sums of squares of strains
(`Pencil`), and what round-off in them, in positions and in sums can amount to widens the bounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg.inertia import bracket
from flexura.linalg.pencil import MASS_LOST, Pencil
from flexura.linalg.scaling import scaled, unit_scale

DOT = 1e-13
"""Relative error of inner products of long vectors and of small eigenproblems."""

UNSOLVED = 1e-6
"""Relative residual of a solution beyond which the factors are no guide to the true matrix."""

CORRECTIONS = 2
"""Corrections of a solution by its residual, which is evaluated by strains."""


@dataclass(frozen=True)
class Enclosures:
    """What factorisations of K - rho M and k trial vectors prove about the eigenvalues below rho.

    Between `least` and `most` eigenvalues lie below `rho`. The lowest k are at most `upper` (k,), where their Rayleigh
    quotients are `values`; the i-th largest of those below rho is at least `lower[-1 - i]`. So when their number is
    proven to be k, [lower, upper] encloses each of the k lowest, number by number. `remainder` (n, k) are the residuals
    C x - theta x of the directions x, of unit M-norm, that `lower` belongs to.
    """

    rho: float
    least: int
    most: int
    values: Array
    lower: Array
    upper: Array
    remainder: Array

    @property
    def count(self) -> int:
        """How many eigenvalues lie below rho, at most."""
        return self.most

    @property
    def is_counted(self) -> bool:
        """True when the number of eigenvalues below rho is proven."""
        return self.least == self.most

    @property
    def is_complete(self) -> bool:
        """True when as many eigenvalues lie below rho as there are trial vectors."""
        return self.most == len(self.upper)


def upper_bounds(pencil: Pencil, values: Array, X: Array) -> tuple[Array, Array]:
    """Upper bounds (k,) of the k lowest eigenvalues from Ritz pairs of `Pencil.ritz`, and what round-off adds to each
    (k,) (theory eq. C9).

    The j-th bound is the largest eigenvalue of the first j rows and columns of X' K X z = mu X' M X z. With all that
    these may be off from `values` and one, the former is at most its largest row sum, the latter at least one less its.
    """
    stiff, massive = pencil.errors(X)
    eye = np.eye(len(values))
    stiff = stiff + np.abs(pencil.energies(X)) * (1 - eye)
    massive = massive + np.abs(X.T @ (pencil.M @ X) - eye) + DOT * eye
    highest, of_K, of_M = (np.maximum.accumulate(values), _leading_sums(stiff), _leading_sums(massive))
    with np.errstate(divide="ignore", invalid="ignore"):
        upper = np.where(of_M < 1, (highest * (1 + DOT) + of_K) / (1 - of_M), np.inf)
    return upper, upper - highest


def _leading_sums(A: Array) -> Array:
    """Largest row sum (k,) of the first j rows and columns of A (k, k), not negative, for every j."""
    return np.array([A[:j, :j].sum(axis=1).max() for j in range(1, len(A) + 1)])


def enclose(pencil: Pencil, vectors: Array, rho: float) -> Enclosures:
    """Bounds on the eigenvalues below about `rho` from k trial vectors (n, k) (theory eqs. C1-C4).

    Vectors independent in the M-norm. rho may be moved slightly where its count cannot be told. Raises SolverError when
    K - rho M cannot be factorised, and where M has lost the digits of what the vectors move.
    """
    values, X = pencil.ritz(vectors)
    if len(values) < vectors.shape[1]:
        raise SolverError(MASS_LOST)
    upper, margin = upper_bounds(pencil, values, X)
    factors = bracket(pencil, rho)
    rho = factors.value
    MX = pencil.M @ X
    Y, rest = np.zeros_like(X), MX
    for _ in range(1 + CORRECTIONS):
        Y = Y + factors.solve(rest)
        rest = MX - (pencil.stiffness(Y) - rho * (pencil.M @ Y))
    # x' M C x exactly: the error of Y comes in as rest' (K - rho M)^-1 rest
    left = rest.T @ factors.solve(rest)
    theta, Z = _ritz(Y.T @ MX + Y.T @ rest + left, X.T @ MX)
    error = DOT * np.abs(theta).max(initial=0.0) + 2 * np.abs(left).sum(axis=0).max(initial=0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        # an error of theta moves 1/theta by that over theta^2
        lower = np.where(theta < 0, rho + 1 / theta - error / theta**2, -np.inf)
    order = np.argsort(lower, kind="stable")
    remainder = (Y @ Z - theta * (X @ Z))[:, order]
    lower = lower[order] - 2 * margin
    least = max(factors.least, int((upper < rho).sum()))
    solved = np.linalg.norm(rest, axis=0) <= UNSOLVED * np.linalg.norm(MX, axis=0)
    crossed = lower > upper * (1 + UNSOLVED)
    if not factors.is_proven or not solved.all() or crossed.any():  # rho is too close to what round-off hides
        lower = np.full(len(lower), -np.inf)
    return Enclosures(rho, least, factors.most, values, np.minimum(lower, upper), upper, remainder)


def _ritz(A: Array, gram: Array) -> tuple[Array, Array]:
    """Eigenpairs (k,), (k, k), ascending, of A z = theta gram z."""
    d = unit_scale(gram)
    try:
        theta, Z = la.eigh(scaled((A + A.T) / 2, d), scaled((gram + gram.T) / 2, d))
    except la.LinAlgError as error:
        raise SolverError(MASS_LOST) from error
    return theta, d[:, None] * Z
