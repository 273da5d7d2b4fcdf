"""A mechanism condensed exactly to as few coordinates as it has natural frequencies below a limit.

Chains, then substructures, then the whole are condensed by what is positive definite at the limit and therefore below
it, so that no eliminated part has an eigenvalue there: K(lam) of what is left has no poles, and as many negative
eigenvalues as natural frequencies lie below lam (theory eqs. D9-D10). Its entries are summed as energies of branches,
in which rigid motion is split off, and keep the digits that assembled stiffness loses (theory eq. D12).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from flexura.arrays import Index
from flexura.beam import DynamicBeam, Joint
from flexura.deadline import checkpoint
from flexura.errors import SolverError
from flexura.linalg import inverse_roots, scaled, unit_scale
from flexura.methods.exact_chains import ExactBranches, branches_below, remaining_numbers
from flexura.reduction import LowOrderAssembler, exact_order, with_modes
from flexura.structure import TAPERED_PIECES, DiscreteElement, FullOrderModel, Scatter, node_dofs

Array = NDArray[Any]

LARGEST = 2000
"""Largest order of dense equations: beyond it a dozen matrices fill gigabytes and each factorisation takes minutes."""

NUMBERS_AT_ONCE = 4_000_000
"""About how many numbers matrices hold at once."""


def refuse_large(order: int, over: str) -> None:
    """Raise SolverError where there are more dense equations over something than are solved."""
    if order > LARGEST:
        hint = "the full-order model and finite elements are sparse and have no such limit"
        raise SolverError(f"{order} equations over {over} are more than the {LARGEST} that exact methods solve; {hint}")


def refuse_large_parts(assembler: LowOrderAssembler) -> None:
    """Raise SolverError, before any matrix is made, where junctions of a prototype or kept nodes are too many."""
    refuse_large(len(assembler.physical), "the nodes that substructures keep")
    for name, reducer in assembler.reducers.items():
        refuse_large(6 * len(reducer.remaining), f"the junctions of {name or 'the top level'!r}")


@dataclass(frozen=True)
class Pencil:
    """K and M = -dK/dlam, (l, n, n), at squared angular frequencies lam (l,)."""

    lam: NDArray[np.float64]
    K: Array
    M: Array

    def solve(self) -> tuple[Array, Array]:
        """Eigenvalues delta (l, n) of K x = delta M x, ascending, and vectors (l, n, n).

        lam + delta is never below the squared frequency of the same number, and equal to it to second order
        (theory eq. D11). Raises SolverError when M is not positive definite.
        """
        d = unit_scale(self.M)
        try:
            inverse = np.linalg.inv(np.linalg.cholesky(scaled(self.M, d)))
        except np.linalg.LinAlgError:
            raise SolverError("something that moves has no inertia at all") from None
        back = np.swapaxes(inverse, -1, -2)
        delta, y = np.linalg.eigh(inverse @ scaled(self.K, d) @ back)
        return delta, d[:, :, None] * (back @ y)


@dataclass(frozen=True)
class _Elimination:
    """Elimination of everything but the first `kept` DOFs and, of the rest, what is not positive definite at the limit
    (theory eq. D10).

    `scale` (r,) balances the rest y = x / scale, and `V` (r, m) are the directions of it that are kept.
    """

    kept: int
    scale: Array
    V: Array

    @classmethod
    def at(cls, K: Array, static: Array, kept: int) -> _Elimination:
        """From K (n, n) at the limit and at zero."""
        H = K[kept:, kept:]
        diagonal = np.maximum(np.abs(np.diagonal(H)), np.abs(np.diagonal(static)[kept:]))
        scale = inverse_roots(diagonal)
        values, vectors = la.eigh(scaled(H, scale)) if len(H) else (np.empty(0), np.empty((0, 0)))
        return cls(kept, scale, vectors[:, values <= 0])

    def shapes(self, K: Array) -> Array:
        """T (l, n, kept + m): all DOFs from those left, for K (l, n, n): the stationary ones."""
        b, (r, m) = self.kept, self.V.shape
        T = np.zeros((len(K), b + r, b + m))
        T[:, :b, :b] = np.eye(b)
        if not r:
            return T
        bordered = np.zeros((len(K), r + m, r + m))
        bordered[:, :r, :r] = K[:, b:, b:] * self.scale[:, None] * self.scale
        bordered[:, :r, r:], bordered[:, r:, :r] = self.V, self.V.T
        right = np.zeros((len(K), r + m, b + m))
        right[:, :r, :b] = -self.scale[:, None] * K[:, b:, :b]
        right[:, r:, b:] = np.eye(m)
        T[:, b:] = self.scale[:, None] * np.linalg.solve(bordered, right)[:, :r]
        return T


class _Part:
    """One prototype: where its branches and discrete elements go, and what its condensation keeps."""

    elimination: _Elimination

    def __init__(self, model: FullOrderModel, branches: ExactBranches, name: str) -> None:
        part_branches = branches.parts[name]
        self.branches, self.reducer = part_branches, part_branches.reducer
        n = 6 * part_branches.n_junctions
        refuse_large(n, f"the junctions and cuts of {name or 'the top level'!r}")
        number = remaining_numbers(self.reducer)
        self.span = branches.span[name]
        self.B: Array = branches.B[self.span]
        pairs = [branch.junctions for branch in part_branches.branches]
        self.ends: Index = node_dofs(np.array(pairs, dtype=np.intp).reshape(-1, 2))
        matrices = model.matrices[name]
        strips = [strip for strips in matrices.strips for strip in strips.each]
        self.discrete_elements: list[DiscreteElement] = [*matrices.discrete_elements, *strips]
        self.discrete_dofs: list[Index] = [node_dofs(number[element.nodes]) for element in self.discrete_elements]
        dofs = [*([self.ends] if len(self.ends) else []), *(dofs[None] for dofs in self.discrete_dofs)]
        self.scatter = Scatter(dofs, n)

    def stiffness(self, K: Array, lam: Array) -> Array:
        """K (l, n, n) over the junctions, in its own frame, from those of all branches."""
        matrices = [_discrete(element, lam)[:, None] for element in self.discrete_elements]
        if len(self.ends):
            B = self.B[:, None]
            matrices = [np.swapaxes(np.swapaxes(B, -1, -2) @ K[self.span] @ B, 0, 1), *matrices]
        return self.scatter.dense(matrices, (len(lam),))


@dataclass(frozen=True)
class _State:
    """Everything at squared angular frequencies lam (l,): branches, their joints, the condensation of every part and
    of the whole."""

    lam: NDArray[np.float64]
    branches: DynamicBeam
    joints: list[Joint]
    T: dict[str, Array]
    X: Array


class ExactCondensation:
    """A mechanism over as many coordinates as it has natural frequencies below `limit`, rad^2/s^2.

    `count` is their number. Good for any lam between zero and the limit. Tapered elements stand as at most
    `tapered_pieces` uniform beams; every uniform beam is cut into at least `pieces`, which changes nothing. Raises
    SolverError, also where there are more dense equations than are solved.
    """

    def __init__(
        self, model: FullOrderModel, limit: float, pieces: int = 1, tapered_pieces: int = TAPERED_PIECES
    ) -> None:
        self.model = model
        self.limit = limit
        self.assembler: LowOrderAssembler = exact_order(model.plan)
        refuse_large_parts(self.assembler)
        self.branches: ExactBranches = branches_below(model, self.assembler.reducers, limit, pieces, tapered_pieces)
        self._parts = {name: _Part(model, self.branches, name) for name in self.branches.parts}
        both = np.array([limit, 0.0])
        exact = self.branches(both)[0]
        T = {}
        for name, part in self._parts.items():
            K = part.stiffness(exact.K, both)
            part.elimination = _Elimination.at(K[0], K[1], len(part.reducer.boundary_dofs))
            T[name] = part.elimination.shapes(K)
        modes = sum(m * len(model.plan.topology.copies[name].paths) for name, m in zip(T, self._modes, strict=True))
        refuse_large(len(self.assembler.physical) + modes, "kept nodes and modes of substructures")
        K = self._global(self._condensed(exact.K, both, T))
        self._elimination = _Elimination.at(K[0], K[1], 0)

    @property
    def count(self) -> int:
        """Number of natural frequencies below the limit."""
        return self._elimination.V.shape[1]

    def pencils(self, lam: Array) -> Pencil:
        """K and M at squared angular frequencies lam (l,) from 0 to the limit."""
        energies = [self._energies(state) for state in self._states(lam)]
        K, M = (np.concatenate(each) for each in zip(*energies, strict=True))
        return Pencil(np.asarray(lam, dtype=float), K, M)

    def count_below(self, lam: Array) -> Index:
        """Numbers of natural frequencies below squared angular frequencies lam (l,) up to the limit
        (Wittrick and Williams 1971; theory eq. D9)."""
        pencil = self.pencils(lam)
        return (np.linalg.eigvalsh(scaled(pencil.K, unit_scale(pencil.M))) < 0).sum(axis=-1)

    def node_displacements(self, lam: Array, vectors: Array) -> Array:
        """Displacements (n_nodes, 6, l) of all nodes, global frame, for one vector (l, n) of coordinates at each of the
        squared angular frequencies lam (l,)."""
        displacements, start = [], 0
        for state in self._states(lam):
            stop = start + len(state.lam)
            x = (state.X @ vectors[start:stop, :, None])[..., 0]
            displacements.append(self._recovered(state, x))
            start = stop
        return np.concatenate(displacements, axis=-1)

    def _condensed(self, K: Array, lam: Array, T: dict[str, Array]) -> Iterator[Array]:
        """K (l, copies, b + m, b + m) of the copies of every part, boundary DOFs in the global frame."""
        for name, part in self._parts.items():
            reduced = np.swapaxes(T[name], -1, -2) @ part.stiffness(K, lam) @ T[name]
            G = self._transforms[name]
            yield np.swapaxes(G, -1, -2) @ reduced[:, None] @ G

    def _global(self, parts: Iterator[Array]) -> Array:
        blocks = list(parts)
        K = self.assembler.scatter(self._modes).dense(blocks, (len(blocks[0]),))
        return (K + np.swapaxes(K, -1, -2)) / 2

    @cached_property
    def _modes(self) -> tuple[int, ...]:
        """How many coordinates every part has beside its boundary."""
        return tuple(part.elimination.V.shape[1] for part in self._parts.values())

    @cached_property
    def _transforms(self) -> dict[str, Array]:
        transforms = self.assembler.transforms(self.model.design)
        return {name: with_modes(transforms[name], m) for name, m in zip(self._parts, self._modes, strict=True)}

    @cached_property
    def _coordinates(self) -> dict[str, Index]:
        """Coordinates (copies, b + m) of every part."""
        coordinates, first = {}, len(self.assembler.physical)
        for name, m in zip(self._parts, self._modes, strict=True):
            coordinates[name] = self.assembler.coordinates(name, m, first)
            first += m * len(coordinates[name])
        return coordinates

    def _states(self, lam: Array) -> Iterator[_State]:
        lam = np.asarray(lam, dtype=float)
        orders = (self.assembler.scatter(self._modes).n, *(part.scatter.n for part in self._parts.values()))
        size = max(1, NUMBERS_AT_ONCE // (288 * sum(b.size for b in self.branches.all) + sum(n * n for n in orders)))
        for start in range(0, len(lam), size):
            checkpoint()
            some = lam[start : start + size]
            exact, joints = self.branches(some)
            T = {name: part.elimination.shapes(part.stiffness(exact.K, some)) for name, part in self._parts.items()}
            X = self._elimination.shapes(self._global(self._condensed(exact.K, some, T)))
            yield _State(some, exact, joints, T, X)

    def _junctions(self, name: str, state: _State, x: Array) -> Array:
        """Displacements (l, copies, n, k) of a part's junctions, in its frame, from coordinates (l, n, k)."""
        padded = np.concatenate([x, np.zeros((len(x), 1, x.shape[2]))], axis=1)
        return state.T[name][:, None] @ (self._transforms[name] @ padded[:, self._coordinates[name]])

    def _energies(self, state: _State) -> tuple[Array, Array]:
        """K and M (l, n, n) from the energies of branches and discrete elements (theory eq. D12)."""
        K, M = np.zeros((2, len(state.lam), self.count, self.count))
        for name, part in self._parts.items():
            u = self._junctions(name, state, state.X)
            motion = part.B @ u[:, :, part.ends]
            K += _energy(motion, np.swapaxes(state.branches.K[part.span], 0, 1)[:, None])
            M -= _energy(motion, np.swapaxes(state.branches.slope[part.span], 0, 1)[:, None])
            for discrete, dofs in zip(part.discrete_elements, part.discrete_dofs, strict=True):
                K += _energy(u[:, :, dofs], _discrete(discrete, state.lam)[:, None])
                if discrete.M is not None:
                    M += _energy(u[:, :, dofs], discrete.M)
        return (K + np.swapaxes(K, -1, -2)) / 2, (M + np.swapaxes(M, -1, -2)) / 2

    def _recovered(self, state: _State, x: Array) -> Array:
        """Displacements (n_nodes, 6, l) of all nodes for one vector of coordinates (l, n) at each frequency."""
        topology = self.model.plan.topology
        displacements = np.zeros((topology.n_dof + 1, len(x)))  # DOF -1 goes to the last row
        displacements[topology.dof.ravel()[self.assembler.physical]] = x[:, : len(self.assembler.physical)].T
        u = {name: self._junctions(name, state, x[..., None])[..., 0] for name in self._parts}
        motion = np.zeros((len(self.branches.all), len(x), max((v.shape[1] for v in u.values()), default=0), 12))
        for name, part in self._parts.items():
            of_part = (part.B @ u[name][:, :, part.ends, None])[..., 0]
            motion[part.span, :, : of_part.shape[1]] = np.moveaxis(of_part, 2, 0)
        twists = self.branches.twists(state.joints, motion)
        for name, part in self._parts.items():
            interior = part.reducer.part.interior
            nodes = _node_displacements(part, u[name], twists[part.span])[:, :, interior]
            number = np.array(topology.copies[name].offset, dtype=np.intp)[:, None] + interior
            G = self.model.design.node_transforms(name, interior)
            outward = (np.swapaxes(G, -1, -2) @ nodes[..., None])[..., 0]
            displacements[topology.dof[number]] = np.moveaxis(outward, 0, -1)
        return self.model.node_displacements(displacements[:-1])


def _node_displacements(part: _Part, u: Array, twists: list[Array]) -> Array:
    """Displacements (l, copies, n, 6) of all nodes of a part that branches pass, in its frame."""
    junctions = u.reshape(*u.shape[:2], -1, 6)
    nodes = np.zeros((*u.shape[:2], part.reducer.part.n_nodes, 6))
    at = np.concatenate([part.reducer.remaining, np.array(part.branches.cut_nodes, dtype=np.intp)])
    nodes[:, :, at[at >= 0]] = junctions[:, :, at >= 0]
    for branch, twist in zip(part.branches.branches, twists, strict=True):
        number, passed, displaced = branch.nodes()
        inside = displaced[:, None, None] @ twist[passed, :, : u.shape[1], :, None]
        nodes[:, :, number] = np.moveaxis(inside[..., 0], 0, 2)
    return nodes


def _discrete(discrete: DiscreteElement, lam: Array) -> Array:
    """K - lam M (l, n, n) of a discrete element."""
    n = 6 * len(discrete.nodes)
    K = np.zeros((n, n)) if discrete.K is None else discrete.K
    return K - lam[:, None, None] * (0.0 if discrete.M is None else discrete.M) + np.zeros((len(lam), 1, 1))


def _energy(motion: Array, matrix: Array) -> Array:
    """Sum of x^T A x (l, k, k) for x (l, ..., n, k) and A that broadcasts to (l, ..., n, n)."""
    work = (matrix @ motion).reshape(len(motion), -1, motion.shape[-1])
    return np.swapaxes(motion.reshape(work.shape), -1, -2) @ work
