"""How the matrices of a model change with its parameters: products with given vectors, exact.

Stiffness acts on deformations: the rigid motion of an element's first node is taken off before its matrix is applied.
Entries of K spread over many decades, and K x of a low mode would lose the digits of all the rest (theory eq. K1).
Those of a low-order model change by the full order, and by what is recovered.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.duals import Dual, slope_of, zeros
from flexura.errors import OptionError
from flexura.full_order import unloaded
from flexura.linalg import factorise, inverse_roots, scaled
from flexura.modal import close_groups
from flexura.reduction import LowOrderModel, reduce
from flexura.structure import (
    Design,
    FullOrderModel,
    PartGeometry,
    PartMatrices,
    Plan,
    dead_load,
    described_prestress,
    full_order,
    full_order_model,
    geometric_forces,
)
from flexura.thresholds import REPEATED_EIGENVALUES

Rows = Callable[[Design], Any]
"""Rows (o, n) over the DOFs of the full-order model that read something off it, for the sizes of a design."""

Loads = Callable[[Design, Array], Any]
"""Added mass times displacements X (n, k) of the full-order model, of a design that may have slopes."""

ModelOrder = Literal["low", "full"]


@dataclass(frozen=True)
class Change:
    """Derivatives with respect to one parameter for fixed vectors X: K' X, M' X (n, k) and readings Y' (o, k).

    Where the design is at a kink and there are none, `is_smooth` is false and they are zero.
    """

    K: Array
    M: Array
    Y: Array
    is_smooth: bool = True


def _slopes(x: Any, count: int) -> Array:
    """Slopes (count, ...) of a number with slopes, zero of one without."""
    return x.slope if isinstance(x, Dual) else np.zeros((count, *x.shape))


def _changes(slopes: Sequence[Array]) -> list[Change]:
    """Changes by every parameter from the slopes (P, ...) of products and readings."""
    changes = []
    for products in zip(*slopes, strict=True):
        smooth = all(bool(np.isfinite(x).all()) for x in products)
        changes.append(Change(*(x if smooth else np.zeros(x.shape) for x in products), is_smooth=smooth))
    return changes


def _solved(solve: Callable[[Array], Array], x: Any) -> Any:
    """Solutions of right sides (..., n), which may have slopes, of a system that has none."""
    if isinstance(x, Dual):
        return Dual(_solved(solve, x.value), _solved(solve, x.slope))
    return solve(x.reshape(-1, x.shape[-1]).T).T.reshape(x.shape)


def _bend(x: Any) -> Array:
    """Second slopes of something with slopes by one parameter, whose slopes have slopes by it."""
    return x.slope.slope[0, 0] if isinstance(x, Dual) else np.zeros(x.shape)


class _Placed(NamedTuple):
    """The copies of a part: transforms G (copies, nodes, 6, 6) into its axes, DOFs (copies, nodes, 6) and displacements
    u (copies, nodes, 6, k) in its axes."""

    G: Any
    dofs: Index
    u: Any

    def add(self, total: Any, nodes: Any, forces: Any) -> None:
        """Add forces on nodes, if there are any, in the part's axes, to those (n + 1, k) on all DOFs."""
        if forces is not None:
            on_dofs = np.swapaxes(self.G[:, nodes], -1, -2) @ forces.reshape(*self.u[:, nodes].shape)
            np.add.at(total, self.dofs[:, nodes], on_dofs)


class FullOrderFamily:
    """The full-order models of a plan over its parameters; not `loaded`, without what described loads do to them."""

    def __init__(self, plan: Plan, rows: Rows | None = None, loaded: bool = True) -> None:
        self.plan = plan
        self._rows = rows
        self._is_loaded = loaded and plan.is_loaded

    def model(self, parameters: Mapping[str, float]) -> FullOrderModel:
        """The model for one design."""
        return full_order_model(Design.of(self.plan, parameters))

    def products(self, parameters: Mapping[str, float], X: Array) -> tuple[Array, Array, Array]:
        """K X, M X (n, k) and readings (o, k) for one design, from its elements (theory eq. K1)."""
        return self.products_of(Design.of(self.plan, parameters), X)

    def products_of(self, design: Design, X: Array) -> tuple[Any, Any, Any]:
        """As `products`, of a design that may have slopes."""
        KX, MX = self._elastic(design, X)
        if self._is_loaded:
            KX = KX + self._geometric(design, X)
        return KX, MX, self._read(design, X)

    def changes(
        self, parameters: Mapping[str, float], names: Sequence[str], X: Array, loads: Loads | None = None
    ) -> list[Change]:
        """Derivatives of the products with X (n, k) by each of some parameters (theory eq. K2), with masses of `loads`
        on top."""
        return self.changes_of(Design.with_slopes(self.plan, parameters, names), X, loads)

    def changes_of(self, design: Design, X: Array, loads: Loads | None = None) -> list[Change]:
        """As `changes`, of a design made `with_slopes`."""
        KX, MX, Y = self.products_of(design, X)
        products = (KX, MX if loads is None else MX + loads(design, X), Y)
        return _changes([_slopes(x, len(slope_of(design.values))) for x in products])

    def bends(self, parameters: Mapping[str, float], name: str, X: Array) -> tuple[Array, Array]:
        """Second derivatives K'' X and M'' X (n, k) by one parameter."""
        KX, MX, _ = self.products_of(Design.with_slopes(self.plan, parameters, [name], order=2), X)
        return _bend(KX), _bend(MX)

    def _geometric(self, design: Design, X: Array) -> Any:
        """K_g X of the state under the loads that are described; where the design has slopes, so has its displacement:
        K u = f is solved once for every order of them."""
        if not isinstance(design.values, Dual):
            return described_prestress(design).K_g @ X
        bare = design.still
        model = FullOrderModel(design, *full_order(self.plan).elastic(bare))
        loads, solve = self.plan.loads, factorise(model.K).solve
        load = dead_load(model, loads.gravity(design.values), loads.wrenches(design.values))
        u = described_prestress(bare).displacement
        for _ in range(2):
            u = u + _solved(solve, load - self._elastic(design, u[:, None], massless=True)[0][:, 0])
        return geometric_forces(model, u, X)

    def forces_of(self, design: Design, X: Array) -> Array:
        """K X (n, k) of `products_of` alone."""
        KX = self._elastic(design, X, massless=True)[0]
        return KX + self._geometric(design, X) if self._is_loaded else KX

    def _elastic(self, design: Design, X: Any, massless: bool = False) -> tuple[Any, Any]:
        KX, MX = zeros((2, self.plan.topology.n_dof + 1, X.shape[1]), design.values, X)
        for name, placed in self._placed(design, X):
            for nodes, k, m in self._forces(design, name, placed, massless):
                placed.add(KX, nodes, k)
                placed.add(MX, nodes, m)
        return KX[:-1], MX[:-1]

    def dissipated(self, design: Design, X: Array, default: Any) -> tuple[Any, Any]:
        """C X of the dashpots and H X of structural damping (n, k) of a design that may have slopes, `default` the loss
        factor of what has none (theory eq. T5)."""
        CX, HX = zeros((2, self.plan.topology.n_dof + 1, X.shape[1]), design.values, default)
        for name, placed in self._placed(design, X):
            part, geometry = self.plan.parts[name], design.geometry.parts[name]
            losses: list[Any] = part.discrete_losses(design.values, default)
            if len(part.connectivity):
                of_elements = part.table.loss_factors(design.values, default)
                losses.insert(0, of_elements[:, None, None])
                for strips in design.matrices[name].strips:
                    losses += [of_elements[e] for e in strips.elements[:, 0].tolist()]
            for loss, (nodes, k, _) in zip(losses, self._forces(design, name, placed, massless=True), strict=True):
                placed.add(HX, nodes, None if k is None else loss * k)
            matrices = part.dashpot_matrices(design.values, geometry)
            for dashpot, matrix in zip(part.dashpots.values(), matrices, strict=True):
                v = placed.u[:, dashpot.nodes]
                placed.add(CX, np.array(dashpot.nodes), matrix @ v.reshape(len(v), 6 * len(dashpot.nodes), -1))
        return CX[:-1], HX[:-1]

    def _placed(self, design: Design, X: Any) -> Iterator[tuple[str, _Placed]]:
        """Every part with what its copies do in displacements X (n, k)."""
        topology = self.plan.topology
        padded = np.concatenate([X, np.zeros((1, X.shape[1]))])
        for name, G in full_order(self.plan).transforms(design).items():
            dofs = topology.dof[topology.root[topology.copies[name].numbers()]]
            yield name, _Placed(G, dofs, G @ padded[dofs])

    def _forces(
        self, design: Design, name: str, placed: _Placed, massless: bool
    ) -> list[tuple[Any, Array | None, Array | None]]:
        part, geometry = self.plan.parts[name], design.geometry.parts[name]
        return _forces(design.matrices[name], part.connectivity, part.n_positioned, geometry, placed.u, massless)

    def readings(self, parameters: Mapping[str, float], X: Array) -> Array:
        """What the rows read off DOF vectors X: (o, k)."""
        return self._read(Design.of(self.plan, parameters), X)

    def _read(self, design: Design, X: Array) -> Array:
        return X if self._rows is None else self._rows(design) @ X

    def rows(self, parameters: Mapping[str, float]) -> Array:
        """The rows themselves over the coordinates: (o, n)."""
        if self._rows is None:
            return np.eye(self.plan.topology.n_dof)
        return np.asarray(self._rows(Design.of(self.plan, parameters)))

    def over_coordinates(self, _parameters: Mapping[str, float], rows: Any) -> Any:
        """Rows (q, N) over the DOFs of the full-order model, over the coordinates."""
        return rows


def _forces(
    matrices: PartMatrices, connectivity: Index, n_positioned: int, geometry: PartGeometry, u: Array, massless: bool
) -> list[tuple[Any, Array | None, Array | None]]:
    """Nodes, K u and, unless they are asked for as `massless`, M u of the elements and of every discrete element of a
    part for displacements u (copies, nodes, 6, k)."""
    forces: list[tuple[Any, Array | None, Array | None]] = []
    if len(connectivity):
        local = matrices.T @ u[:, connectivity].reshape(len(u), len(connectivity), 12, -1)
        reach = zeros((len(connectivity), 3), matrices.elements.length)
        reach[:, 0] = matrices.elements.length
        strain = local[..., 6:, :] - rigid_arm(reach) @ local[..., :6, :]
        Tt = np.swapaxes(matrices.T, -1, -2)
        mass = None if massless else Tt @ (matrices.elements.M @ local)
        forces.append((connectivity, Tt @ (matrices.elements.K[..., 6:] @ strain), mass))
    for discrete in chain(matrices.discrete_elements, *(strips.each for strips in matrices.strips)):
        v, placed = u[:, discrete.nodes], [k for k, node in enumerate(discrete.nodes) if node < n_positioned]
        flat = v.reshape(len(u), 6 * len(discrete.nodes), -1)
        mass = None if massless or discrete.M is None else discrete.M @ flat
        force = None
        if discrete.K is not None and len(placed) > 1:
            arms = geometry.positions[[discrete.nodes[k] for k in placed]] - geometry.positions[discrete.nodes[0]]
            rigid = zeros(v.shape, arms, v)
            rigid[:, placed] = rigid_arm(arms) @ v[:, :1]
            force = discrete.K @ (v - rigid).reshape(flat.shape)
        elif discrete.K is not None:
            force = discrete.K @ flat
        forces.append((np.array(discrete.nodes), force, mass))
    return forces


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
        QX = Q @ X
        model = self._full.model(parameters)
        recovery = _Recovery(low, unloaded(self.plan, parameters))
        T = recovery.T
        u = T @ QX
        Ku, Mu, _ = self._full.products(parameters, u)
        if loads is not None:
            Mu = Mu + loads(low.design, u)
        changes = []
        for name, fixed in zip(names, self._full.changes(parameters, names, u, loads), strict=True):
            whole = self._elastic.changes(parameters, [name], T)[0]
            if not whole.is_smooth:
                changes.append(Change(np.zeros(X.shape), np.zeros(X.shape), np.zeros(fixed.Y.shape), False))
                continue
            slope = recovery.slope(whole)
            moved = slope @ QX
            K_moved, M_moved = model.K @ moved, model.M @ moved
            if loads is not None:
                M_moved = M_moved + loads(low.design, moved)
            KX, MX = (
                Q.T @ (T.T @ (change + across) + slope.T @ still)
                for change, across, still in ((fixed.K, K_moved, Ku), (fixed.M, M_moved, Mu))
            )
            Y = fixed.Y + (moved if self._rows is None else self._rows(low.design) @ moved)
            changes.append(Change(KX, MX, Y))
        return changes

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
        dofs = np.concatenate(inner)
        self._inner: Index = np.sort(dofs[dofs >= 0])
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
        slope = np.zeros(self.T.shape)
        if self._solve is None:
            return slope
        K, M = change.K[self._inner], change.M[self._inner]
        slope[self._inner, : self._count] = -self._solve(K[:, : self._count])
        mass = self._modes.T @ M[:, self._count :]
        for at, value, solve in self._bordered:
            columns = self._count + at
            outer = -solve(K[:, columns] - value * M[:, columns])
            slope[np.ix_(self._inner, columns)] = outer - self._modes @ mass[:, at] / 2
        return slope


Family = FullOrderFamily | LowOrderFamily
