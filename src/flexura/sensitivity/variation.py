"""How the matrices of a model change with its parameters: products with given vectors, differenced to high order.

Stiffness acts on deformations: the rigid motion of an element's first node is taken off before its matrix is applied.
Entries of K spread over many decades, and K x of a low mode would lose the digits of all the rest (theory eq. K1).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, Protocol

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike, NDArray

from flexura.beam import rigid_arm
from flexura.errors import OptionError
from flexura.mechanism import Mechanism
from flexura.reduction import LowOrderModel, reduce
from flexura.structure import (
    Design,
    FullOrderModel,
    PartGeometry,
    PartMatrices,
    Plan,
    described_prestress,
    full_order_model,
    plan_of,
)

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Rows = Callable[[Design], Any]
"""Rows (o, n) over the DOFs of the full-order model that read something off it, for the sizes of a design."""

STEP = 0.02
"""First difference step, relative to the parameter; it is halved twice."""

LEVELS = 3
"""Steps h, h/2, h/4 of the extrapolation: an error of order h^6."""


@dataclass(frozen=True)
class Change:
    """Derivatives with respect to one parameter for fixed vectors X: K' X, M' X (n, k) and readings Y' (o, k);
    K'' X, M'' X; and the relative error estimated for K' X and M' X, the larger."""

    K: Array
    M: Array
    Y: Array
    K2: Array
    M2: Array
    error: float


def unbounded(mechanism: Mechanism | Plan, parameters: Mapping[str, ArrayLike] | None = None) -> Plan:
    """A plan whose parameters have no bounds, so that they can be differenced at these."""
    plan = plan_of(mechanism, parameters)
    plan.refuse_pose("sensitivities")
    own = plan.mechanism
    if all(p.minimum is None and p.maximum is None for p in own.parameters.values()):
        return plan
    free = {name: p.model_copy(update={"minimum": None, "maximum": None}) for name, p in own.parameters.items()}
    return Plan(own.model_copy(update={"parameters": free}))


class FullOrderFamily:
    """The full-order models of a plan over its parameters."""

    def __init__(self, plan: Plan, rows: Rows | None = None) -> None:
        self.plan, self._rows = plan, rows

    def model(self, parameters: Mapping[str, float]) -> FullOrderModel:
        """The model for one design."""
        return full_order_model(Design.of(self.plan, parameters))

    def products(self, parameters: Mapping[str, float], X: Array) -> tuple[Array, Array, Array]:
        """K X, M X (n, k) and readings (o, k) for one design, from its elements (theory eq. K1)."""
        design, topology = Design.of(self.plan, parameters), self.plan.topology
        KX, MX = np.zeros((2, topology.n_dof + 1, X.shape[1]))
        padded = np.concatenate([X, np.zeros((1, X.shape[1]))])
        for name, own in design.matrices.items():
            part = self.plan.parts[name]
            number = np.array(topology.copies[name].offset)[:, None] + np.arange(part.n_nodes)
            G = design.node_transforms(name, np.arange(part.n_nodes))
            dofs = topology.dof[topology.root[number]]
            u = G @ padded[dofs]
            for nodes, k, m in _forces(own, part.connectivity, part.n_positioned, design.geometry.parts[name], u):
                for into, f in ((KX, k), (MX, m)):
                    if f is not None:
                        back = np.swapaxes(G[:, nodes], -1, -2) @ f.reshape(*u[:, nodes].shape)
                        np.add.at(into, dofs[:, nodes], back)
        if self.plan.is_loaded:
            KX[:-1] += described_prestress(design).K_g @ X
        return KX[:-1], MX[:-1], self._read(design, X)

    def readings(self, parameters: Mapping[str, float], X: Array) -> Array:
        """What the rows read off DOF vectors X: (o, k)."""
        return self._read(Design.of(self.plan, parameters), X)

    def _read(self, design: Design, X: Array) -> Array:
        return X if self._rows is None else np.asarray(self._rows(design) @ X)

    def rows(self, parameters: Mapping[str, float]) -> Array:
        """The rows themselves over the coordinates: (o, n)."""
        if self._rows is None:
            return np.eye(self.plan.topology.n_dof)
        return np.asarray(self._rows(Design.of(self.plan, parameters)))

    def over_coordinates(self, _parameters: Mapping[str, float], rows: Any) -> Any:
        """Rows (q, N) over the DOFs of the full-order model, over the coordinates."""
        return rows


def _forces(
    own: PartMatrices, connectivity: Index, n_positioned: int, geometry: PartGeometry, u: Array
) -> list[tuple[Any, Array | None, Array | None]]:
    """Nodes, K u and M u of the elements and of every discrete element of a part for displacements u (copies, nodes,
    6, k)."""
    found: list[tuple[Any, Array | None, Array | None]] = []
    if len(connectivity):
        local = own.T @ u[:, connectivity].reshape(len(u), len(connectivity), 12, -1)
        reach = np.zeros((len(connectivity), 3))
        reach[:, 0] = own.elements.length
        strain = local[..., 6:, :] - rigid_arm(reach) @ local[..., :6, :]
        Tt = np.swapaxes(own.T, -1, -2)
        found.append((connectivity, Tt @ (own.elements.K[..., 6:] @ strain), Tt @ (own.elements.M @ local)))
    for discrete in own.discrete_elements:
        v, placed = u[:, discrete.nodes], [k for k, node in enumerate(discrete.nodes) if node < n_positioned]
        flat = v.reshape(len(u), 6 * len(discrete.nodes), -1)
        mass = None if discrete.M is None else discrete.M @ flat
        force = None
        if discrete.K is not None and len(placed) > 1:
            arms = geometry.positions[[discrete.nodes[k] for k in placed]] - geometry.positions[discrete.nodes[0]]
            rigid = np.zeros_like(v)
            rigid[:, placed] = rigid_arm(arms) @ v[:, :1]
            force = discrete.K @ (v - rigid).reshape(flat.shape)
        elif discrete.K is not None:
            force = discrete.K @ flat
        found.append((np.array(discrete.nodes), force, mass))
    return found


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
        self.plan, self._keep, self._rows = plan, keep, rows
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


Family = FullOrderFamily | LowOrderFamily
ModelOrder = Literal["low", "full"]


class Varied(Protocol):
    """Something whose products with fixed vectors change with parameters."""

    def products(self, parameters: Mapping[str, float], X: Array) -> tuple[Array, Array, Array]:
        """K X, M X and readings of X for one design."""
        ...


def changes_of(
    family: Varied, parameters: Mapping[str, float], names: Sequence[str], X: Array, levels: int = LEVELS
) -> list[Change]:
    """Derivatives of a family's products with X (n, k) with respect to each of some parameters (theory eqs. K2-K3).

    Central differences at steps h, h/2, h/4 ... extrapolated (Richardson 1911); the error is that between the last two.
    """
    middle = family.products(parameters, X)[:2]
    return [_change(family, parameters, name, X, middle, levels) for name in names]


def _change(
    family: Varied, parameters: Mapping[str, float], name: str, X: Array, middle: tuple[Array, ...], levels: int
) -> Change:
    value = float(parameters[name])
    h = STEP * (abs(value) or 1.0)
    first: list[list[Array]] = []
    second: list[list[Array]] = []
    for level in range(levels):
        step = h / 2**level
        up = family.products({**parameters, name: value + step}, X)
        down = family.products({**parameters, name: value - step}, X)
        first.append([(a - b) / (2 * step) for a, b in zip(up, down, strict=True)])
        second.append([(a - 2 * m + b) / step**2 for a, m, b in zip(up, middle, down, strict=False)])
    slopes, errors = zip(*(_extrapolated([level[k] for level in first]) for k in range(3)), strict=True)
    bends = [_extrapolated([level[k] for level in second])[0] for k in range(2)]
    return Change(*slopes, *bends, error=max(errors[:2]))


def _extrapolated(values: Sequence[Array]) -> tuple[Array, float]:
    """Limit of values at halved steps, error even in the step, and the relative error estimated."""
    table, before = list(values), values[-1]
    for power in range(1, len(values)):
        before = table[-1]
        table = [(4**power * b - a) / (4**power - 1) for a, b in pairwise(table)]
    size = float(np.abs(table[0]).max(initial=0.0))
    return table[0], float(np.abs(table[0] - before).max(initial=0.0)) / size if size else 0.0
