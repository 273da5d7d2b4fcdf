"""How the matrices of a low-order model change with its parameters: by the full order, and by what is recovered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.linalg import factorise, inverse_roots, scaled
from flexura.modal import REPEATED_EIGENVALUES, close_groups
from flexura.reduction import LowOrderModel, reduce
from flexura.sensitivity.variation import Change, FullOrderFamily, Loads, Rows
from flexura.structure import FullOrderModel, Plan, unloaded


@dataclass(frozen=True)
class Matrices:
    """K and M (n, n) of one design in the coordinates of its family."""

    K: Array
    M: Array

    @property
    def order(self) -> int:
        """Number of coordinates."""
        return len(self.K)


class LowOrderFamily:
    """The low-order models of a plan over its parameters, with constraint modes and `keep` normal modes each.

    Amplitudes of normal modes are turned so that the modes stay as near as they can to those of the design `at`:
    coordinates mean the same in all designs, and matrices are smooth functions of the sizes.
    """

    def __init__(
        self, plan: Plan, at: Mapping[str, float], keep: int | Mapping[str, int] = 0, rows: Rows | None = None
    ) -> None:
        self.plan = plan
        self._keep, self._rows = keep, rows
        self._full, self._elastic = FullOrderFamily(plan, rows), FullOrderFamily(plan, loaded=False)
        self._at = self._last = reduce(plan, at, keep=keep)

    def model(self, parameters: Mapping[str, float]) -> Matrices:
        """The matrices for one design."""
        low = self._reduced(parameters)
        Q = self._turn(low)
        return Matrices(Q.T @ low.K @ Q, Q.T @ low.M @ Q)

    def _reduced(self, parameters: Mapping[str, float]) -> LowOrderModel:
        """The model for one design, in coordinates of its own; the last one is remembered."""
        if dict(parameters) != dict(self._last.parameters):
            self._last = reduce(self.plan, parameters, keep=self._keep)
        return self._last

    def _turn(self, low: LowOrderModel) -> Array:
        """Q (n, n) that leads from the coordinates of the family to those of a model."""
        blocks = [np.eye(low.order - sum(len(p.frequencies) * self._copies(name) for name, p in low.parts.items()))]
        for name, part in low.parts.items():
            k, before = len(part.frequencies), self._at.parts[name]
            if k != len(before.frequencies):
                raise OptionError(f"{name or 'mechanism'} keeps another number of modes nearby: {k}; keep another one")
            if k:
                U, _, Vt = np.linalg.svd(part.T[:, -k:].T @ before.T[:, -k:])
                blocks += [U @ Vt] * self._copies(name)
        return la.block_diag(*blocks)

    def _copies(self, name: str) -> int:
        return len(self.plan.topology.copies[name].paths)

    def products(self, parameters: Mapping[str, float], X: Array) -> tuple[Array, Array, Array]:
        """K X, M X (n, k) and readings (o, k) of coordinate vectors X for one design."""
        low = self._reduced(parameters)
        Q = self._turn(low)
        QX = Q @ X
        return Q.T @ (low.K @ QX), Q.T @ (low.M @ QX), self._read(low, QX)

    def changes(
        self, parameters: Mapping[str, float], names: Sequence[str], X: Array, loads: Loads | None = None
    ) -> list[Change]:
        """Derivatives of the products with X (n, k) by each of some parameters (theory eqs. K2-K3), with masses of
        `loads` on top."""
        low = self._reduced(parameters)
        Q = self._turn(low)
        own = Q @ X
        model = self._full.model(parameters)
        recovery = _Recovery(low, unloaded(self.plan, parameters))
        T = recovery.T
        u = T @ own
        Ku, Mu, _ = self._full.products(parameters, u)
        if loads is not None:
            Mu = Mu + loads(low.design, u)
        found = []
        for name, fixed in zip(names, self._full.changes(parameters, names, u, loads), strict=True):
            whole = self._elastic.changes(parameters, [name], T)[0]
            if not whole.is_smooth:
                found.append(Change(np.zeros(X.shape), np.zeros(X.shape), np.zeros(fixed.Y.shape), False))
                continue
            slope = recovery.slope(whole)
            moved = slope @ own
            K_moved, M_moved = model.K @ moved, model.M @ moved
            if loads is not None:
                M_moved = M_moved + loads(low.design, moved)
            KX, MX = (
                Q.T @ (T.T @ (change + across) + slope.T @ still)
                for change, across, still in ((fixed.K, K_moved, Ku), (fixed.M, M_moved, Mu))
            )
            Y = fixed.Y + (moved if self._rows is None else self._rows(low.design) @ moved)
            found.append(Change(KX, MX, Y))
        return found

    def readings(self, parameters: Mapping[str, float], X: Array) -> Array:
        """What the rows read off coordinate vectors X: (o, k)."""
        low = self._reduced(parameters)
        return self._read(low, self._turn(low) @ X)

    def rows(self, parameters: Mapping[str, float]) -> Array:
        """The rows themselves over the coordinates: (o, n)."""
        return self.readings(parameters, np.eye(self._reduced(parameters).order))

    def over_coordinates(self, parameters: Mapping[str, float], rows: Any) -> Array:
        """Rows (q, N) over the DOFs of the full-order model, over the coordinates."""
        low = self._reduced(parameters)
        return np.asarray(rows @ low.recover(self._turn(low)))

    def _read(self, low: LowOrderModel, coordinates: Array) -> Array:
        u = low.recover(coordinates)
        return u if self._rows is None else np.asarray(self._rows(low.design) @ u)


class _Recovery:
    """T (N, n) that recovers the displacements of the elastic full-order model, and how it moves (theory eq. K3).

    The first columns are constraint modes, the others kept normal modes. The basis of these that does not turn within
    them is the one differentiated: it spans the same, whatever parameter moves.
    """

    def __init__(self, low: LowOrderModel, model: FullOrderModel) -> None:
        self.T = np.asarray(low.recover(np.eye(low.order)))
        topology = low.plan.topology
        inner = [
            topology.dof[np.array(copies.offset)[:, None] + low.plan.parts[name].interior].ravel()
            for name, copies in topology.copies.items()
        ]
        found = np.concatenate(inner)
        self._inner: Index = np.sort(found[found >= 0])
        self._count = low.order - sum(len(p.frequencies) * len(topology.copies[n].paths) for n, p in low.parts.items())
        self._K, self._M = (sp.csc_matrix(A[self._inner][:, self._inner]) for A in (model.K, model.M))
        self._solve = factorise(self._K).solve if len(self._inner) else None
        modes = self.T[self._inner, self._count :]
        self._modes, self._border = modes, self._M @ modes
        values = (modes * (self._K @ modes)).sum(axis=0)
        order = np.argsort(values)
        self._groups = [order[group] for group in close_groups(values[order], REPEATED_EIGENVALUES)]
        self._bordered = [(at, float(values[at].mean()), self._factor(float(values[at].mean()))) for at in self._groups]

    def _factor(self, value: float) -> Any:
        """K - value M of the interior, bordered by all kept modes."""
        d = inverse_roots(self._K.diagonal() + abs(value) * self._M.diagonal())
        edge = d[:, None] * self._border
        size = np.linalg.norm(edge, axis=0)
        A = sp.bmat([[scaled(sp.csc_matrix(self._K - value * self._M), d), edge / size], [(edge / size).T, None]])
        factor = spla.splu(A.tocsc())

        def solve(force: Array) -> Array:
            right = np.concatenate([d[:, None] * force, np.zeros((len(size), force.shape[1]))])
            return d[:, None] * factor.solve(right)[: len(d)]

        return solve

    def slope(self, change: Change) -> Array:
        """T' (N, n) for the change of T by a parameter."""
        found = np.zeros(self.T.shape)
        if self._solve is None:
            return found
        K, M = change.K[self._inner], change.M[self._inner]
        found[self._inner, : self._count] = -self._solve(K[:, : self._count])
        mass = self._modes.T @ M[:, self._count :]
        for at, value, solve in self._bordered:
            own = self._count + at
            outer = -solve(K[:, own] - value * M[:, own])
            found[np.ix_(self._inner, own)] = outer - self._modes @ mass[:, at] / 2
        return found


Family = FullOrderFamily | LowOrderFamily
ModelOrder = Literal["low", "full"]
