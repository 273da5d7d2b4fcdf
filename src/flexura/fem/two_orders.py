"""Equations of elements of a higher order, too large to be factorised, through those of a lower one on the same mesh.

Hierarchical shape functions have those of the lower order among them: its stiffness is a block, factorised in single
precision, and what is added is smoothed by two Chebyshev steps of node blocks, before and after (two-level Schwarz:
Babuska, Craig, Mandel and Pitkaranta 1991). That is the preconditioner of conjugate gradients (Hestenes and Stiefel
1952) and of the lowest modes (LOBPCG, Knyazev 2001).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from flexura.arrays import Array, Bools, Index
from flexura.deadline import checkpoint
from flexura.errors import SolverError
from flexura.linalg import Factor, SingularError, factorise_large

CLOSE, ROUGH = 1e-6, 1e-3
"""Error of a solution over itself, in the norm of energy, at which conjugate gradients end, and where but its energy,
which is off by the square, is asked for."""

CLOSE_MODES = 1e-8
"""Relative error of squared frequencies, estimated by residuals, at which modes are taken."""

MOST_STEPS = 200
"""Steps that are taken at most."""

FORGIVEN = 4.0
"""Energy of an error that is worked out anew over the one that steps tell, at most."""

HINT = "a mesh whose cells are less distorted, or more memory, for factors of all of it, may do"
"""What helps where steps do not end."""

SPARE_MODES = 3
"""Modes that are sought beside those that are wanted."""

BLOCK = 8
"""Right sides that are solved at a time, for what they take of memory."""

LOWEST = 0.1
"""Least eigenvalue that Chebyshev steps damp over the largest one."""

DEPENDENT = 1e-10
"""Part of a direction that others lack, squared, below which it is left out."""


class TwoOrders:
    """Symmetric positive semidefinite K (n, n), as blocks: of DOFs in `low` (n,), true for those of the lower order and
    any others whose equations are factorised, and of the rest, whose `nodes` (n,) are numbers of what shares a shape.
    """

    def __init__(self, K: sp.csr_matrix, low: Bools, nodes: Index) -> None:
        self.shape: tuple[int, int] = K.shape
        self._low, self._rest = np.flatnonzero(low), np.flatnonzero(~low)
        self._nodes = nodes
        rest = K[self._rest]
        self._cross, self._D = rest[:, self._low], rest[:, self._rest]
        del rest
        self._A = K[self._low][:, self._low]
        self._kept = np.ones(K.shape[0], dtype=bool)

    def __matmul__(self, x: Array) -> Array:
        low, rest = x[self._low], x[self._rest]
        out = np.empty(x.shape)
        out[self._low] = self._A @ low + self._cross.T @ rest
        out[self._rest] = self._cross @ low + self._D @ rest
        return out

    def hold(self, kept: Index) -> None:
        """Hold all DOFs but some, where equations are solved."""
        self.release()
        self._kept = np.zeros(self.shape[0], dtype=bool)
        self._kept[kept] = True

    def release(self) -> None:
        """Give back the memory of factors, which are made again when they are needed."""
        for name in ("_factor", "_smoothing"):
            self.__dict__.pop(name, None)

    @cached_property
    def _factor(self) -> Factor:
        kept = np.flatnonzero(self._kept[self._low])
        A = sp.csc_matrix(self._A[kept][:, kept])
        try:
            return factorise_large(A, single=True)
        except SingularError:  # for rounding to single precision
            return factorise_large(A)

    @cached_property
    def _smoothing(self) -> tuple[sp.csr_matrix, Array]:
        """Inverses of the blocks of nodes, zero where these are held, and the two steps of Chebyshev's."""
        count = len(self._rest)
        order = np.argsort(self._nodes[self._rest], kind="stable")
        node = np.unique(self._nodes[self._rest], return_inverse=True)[1]
        place = np.empty(count, dtype=np.intp)
        place[order] = np.arange(count) - np.searchsorted(node[order], node[order])
        size = int(place.max(initial=0)) + 1
        at = self._D.tocoo()
        own = node[at.row] == node[at.col]
        row, column, value = at.row[own], at.col[own], at.data[own]
        del at
        blocks = np.tile(np.eye(size), (int(node.max(initial=-1)) + 1, 1, 1))
        blocks[node[row], place[row], place[column]] = value
        inverse = np.linalg.inv(blocks)[node[row], place[row], place[column]]
        inverse *= self._kept[self._rest][row] & self._kept[self._rest][column]
        B = sp.csr_matrix((inverse, (row, column)), shape=(count, count))
        x: Any = np.cos(np.arange(count) ** 2.0)
        largest = 1.0
        for _ in range(12):
            x = B @ (self._D @ x)
            largest = float(np.linalg.norm(x)) or 1.0
            x /= largest
        middle, half = 1.1 * largest * (1 + LOWEST) / 2, 1.1 * largest * (1 - LOWEST) / 2
        return B, 1 / (middle + half * np.array([1.0, -1.0]) / np.sqrt(2))

    def _smoothed(self, r: Array) -> Array:
        B, (first, second) = self._smoothing
        x = first * (B @ r)
        return x + second * (B @ (r - self._D @ x))

    def precondition(self, r: Array) -> Array:
        """About K^-1 r of forces r (n, k), with what is not kept held."""
        if r.shape[1] > BLOCK:
            return np.hstack([self.precondition(r[:, :BLOCK]), self.precondition(r[:, BLOCK:])])
        low, rest = r[self._low], r[self._rest]
        kept = np.flatnonzero(self._kept[self._low])
        x = self._smoothed(rest)
        y = np.zeros(low.shape)
        y[kept] = self._factor.solve((low - self._cross.T @ x)[kept])
        x += self._smoothed(rest - self._cross @ y - self._D @ x)
        out = np.empty(r.shape)
        out[self._low], out[self._rest] = y, x
        return out

    def solve(self, forces: Array, close: float = CLOSE) -> Array:
        """Displacements (n, k) under forces (n, k), with what is not kept held, to an error over themselves. Raises
        SolverError where that is not reached."""
        out = np.empty(forces.shape)
        for first in range(0, forces.shape[1], BLOCK):
            out[:, first : first + BLOCK] = self._solved(forces[:, first : first + BLOCK], close)
        return out

    def _left(self, forces: Array, x: Array) -> tuple[Array, Array, Array]:
        """Forces (n, k) that displacements leave, what preconditioning makes of them, and their products (k,): energies
        of what is off, about."""
        r = (forces - self @ x) * self._kept[:, None]
        z = self.precondition(r)
        return r, z, _dots(r, z)

    def _solved(self, forces: Array, close: float) -> Array:
        x = np.zeros(forces.shape)
        r, p, left = self._left(forces, x)
        wanted, least = close**2 * np.abs(left), np.finfo(float).tiny
        steps = 0
        while steps < MOST_STEPS and (left >= -wanted).all():  # and what preconditions is definite
            checkpoint()
            steps += 1
            q = self @ p
            q[~self._kept] = 0.0
            going = left > wanted  # the others have but round-off left
            step = np.where(going, left / np.maximum(_dots(p, q), least), 0.0)
            x += step * p
            r -= step * q
            z = self.precondition(r)
            before, left = left, _dots(r, z)
            p = z + np.where(going, left / np.maximum(before, least), 0.0) * p
            if (np.abs(left) <= wanted).all():  # as steps tell, which lose digits
                r, p, left = self._left(forces, x)
                if (np.abs(left) <= FORGIVEN * wanted).all():
                    return x
        worst = np.sqrt(np.max(np.abs(left) / np.maximum(wanted, least))) * close
        raise SolverError(f"conjugate gradients are {worst:.1g} of a solution off after {steps} steps; {HINT}")


def _thrice(K: Any, M: Any, x: Array) -> list[Array]:
    return [x, K @ x, M @ x]


def _dots(a: Array, b: Array) -> Array:
    return np.einsum("ij,ij->j", a, b)


def lowest_modes(
    K: Any, M: Any, start: Array, count: int, kept: Bools, precondition: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Eigenvalues (m,) and M-orthonormal eigenvectors (n, m), the `count` lowest, from vectors `start` (n, j >= m).

    `precondition` makes of residuals directions in which to go on, all within what is allowed, as `start` is. What
    eigenvalues are off by, from above, is estimated by residuals of what is returned. Raises SolverError where that
    does not become small.
    """
    # X, what residuals add, and how X changed last: beside them what K and M make of each
    blocks = [_thrice(K, M, start)]
    for _ in range(MOST_STEPS):
        checkpoint()
        gram, energy = (np.block([[a[0].T @ b[k] for b in blocks] for a in blocks]) for k in (2, 1))
        size = 1 / np.sqrt(gram.diagonal())
        parts, turn = la.eigh(gram * np.outer(size, size))
        T = size[:, None] * turn[:, parts > DEPENDENT * parts[-1]]
        m = start.shape[1]
        values, turn = la.eigh(T.T @ energy @ T, T.T @ gram @ T, subset_by_index=(0, min(m, T.shape[1]) - 1))
        T = T @ turn
        moved = [np.zeros((len(start), T.shape[1])) for _ in range(3)]
        cuts = np.cumsum([block[0].shape[1] for block in blocks])
        for block, rows in zip(blocks[1:], np.split(T, cuts)[1:], strict=False):
            for k in range(3):
                moved[k] += block[k] @ rows
        X = [own @ T[: cuts[0]] + more for own, more in zip(blocks[0], moved, strict=True)]
        del blocks
        W = precondition((X[1] - X[2] * values) * kept[:, None])
        off = (_dots(X[1], W) - _dots(X[2], W) * values) / values
        if (np.abs(off[:count]) <= CLOSE_MODES).all():
            return values[:count], X[0][:, :count]
        if not np.isfinite(off).all():
            break
        going = off > CLOSE_MODES
        blocks = [X, _thrice(K, M, W[:, going]), [own[:, going] for own in moved]]
        if not moved[0].any():
            blocks.pop()
    worst = np.abs(off[:count]).max()
    raise SolverError(f"squared frequencies of modes are {worst:.1g} off after {MOST_STEPS} steps; {HINT}")
