"""One substructure reduced to the nodes that are kept: constraint modes, and normal modes on request.

Normal modes are those with the interface held (Craig and Bampton 1968; the RPR paper, eqs. 1-7 and 28-29) or those of
the free substructure with residual flexibility (MacNeal 1971; Rubin 1975; theory eqs. R2-R5). Rubin's basis holds
elastic normal modes of the free substructure, the residual flexibility of the interface, and for a substructure that
floats its rigid motions, with inertia relief. In coordinates of interface displacements it spans the constraint modes
and, with the interface at rest, what is left of the normal modes and of inertia relief once their interface
displacement is taken off by constraint modes (Craig and Chang 1977). It is built that way here: no residual is a
difference of large numbers, static response is exact, and coordinates and assembly are those of Craig and Bampton.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.errors import OptionError, SolverError
from flexura.linalg import DENSE_LIMIT, Eigenpairs, count_below, factorise, lowest, scaled, unit_scale
from flexura.records import Latest, Record
from flexura.reduction.chains import (
    ChainGroup,
    ChainKinematics,
    chain_matrices,
    chain_stiffness,
    find_chains,
    kinematics,
)
from flexura.sizes import beyond
from flexura.structure import Geometry, Part, PartMatrices, Scatter, node_dofs
from flexura.thresholds import REPEATED_EIGENVALUES

ADDED_ENERGY = 1e-10
"""Relative size below which what a vector adds to the basis counts as round-off."""

SPARSE_GUYAN = 3000
"""Order beyond which what chains leave is condensed with sparse factors, one design at a time."""

MOST_KEPT_FREEDOMS = 900
"""Freedoms kept of a part beyond which modes of the full order are quicker than constraint modes."""


@dataclass(frozen=True, repr=False)
class ReducedPart(Record):
    """A substructure in Craig-Bampton coordinates: interface displacements, then amplitudes of kept normal modes.

    K, M: (b + k, b + k); T: (n, b + k) recovers all n displacements; `frequencies` (k,) of the kept fixed-interface
    normal modes, rad/s.
    """

    K: Array
    M: Array
    T: Array
    frequencies: Array


class CraigBampton:
    """Constraint modes and fixed-interface normal modes of K, M (n, n), SI, each worked out when first asked for.

    `stiffness_at_boundary` gives K (b, b) condensed to the boundary where that is known without the round-off of the
    assembled K, which rigid motions strain. Raises SolverError when part of the interior can move freely with the
    boundary held.
    """

    def __init__(
        self,
        K: Any,
        M: Any,
        interior: Index,
        boundary: Index,
        stiffness_at_boundary: Callable[[], Array] | None = None,
    ) -> None:
        self.K, self.M = (_workable(A) for A in (K, M))
        self.interior = interior
        self.boundary = boundary
        self._stiffness_at_boundary = stiffness_at_boundary
        if len(interior) and not (self.K.diagonal()[interior] > 0).all():
            raise SolverError("a node inside a substructure has no stiffness in some direction")
        rows = self.K[interior]
        self._K_ii, self._K_ib = rows[:, interior], rows[:, boundary]
        self._M_ii = self.M[interior][:, interior]
        self._found = Eigenpairs(np.empty(0), np.empty((len(interior), 0)))

    @property
    def stiffness(self) -> Any:
        """Stiffness (i, i) of the interior with the boundary held."""
        return self._K_ii

    @cached_property
    def _solve(self) -> Callable[[Array], Array]:
        if not isinstance(self._K_ii, np.ndarray):
            return factorise(self._K_ii).solve
        d = unit_scale(self._K_ii)
        try:
            factor = la.cho_factor(scaled(self._K_ii, d), check_finite=False)
        except la.LinAlgError:
            raise SolverError("the interior of a substructure can move freely with its interface held") from None
        return lambda x: d[:, None] * la.cho_solve(factor, d[:, None] * x, check_finite=False)

    def solve(self, forces: Array) -> Array:
        """Static displacements (i, k) of the interior under forces (i, k), boundary held."""
        return self._solve(forces)

    @cached_property
    def constraint_modes(self) -> Array:
        """Interior displacements (i, b) for unit displacements of each boundary DOF, eq. 6: -K_ii^-1 K_ib (theory
        eq. 39)."""
        if not len(self.interior):
            return np.zeros((0, len(self.boundary)))
        K_ib = self._K_ib
        return -self.solve(K_ib if isinstance(K_ib, np.ndarray) else K_ib.toarray())

    def count_below(self, hz: float) -> int:
        """Number of fixed-interface normal modes below a frequency, Hz."""
        return count_below(self._K_ii, self._M_ii, (2 * np.pi * hz) ** 2) if hz > 0 and len(self.interior) else 0

    def whole(self, count: int) -> int:
        """The least number of normal modes from `count` on that cuts no repeated frequency."""
        while 0 < count < len(self.interior):
            values = self.normal_modes(count + 1).values
            if len(values) <= count or values[count] - values[count - 1] > REPEATED_EIGENVALUES * values[count]:
                break
            count += 1
        return count

    def normal_modes(self, count: int) -> Eigenpairs:
        """The lowest `count` normal modes of the interior with the boundary held, eq. 2 (theory eq. 40): angular
        frequencies squared (k,) and modes (i, k); those without mass are left out."""
        count = min(count, len(self.interior))
        if count > len(self._found.values):
            self._found = lowest(self._K_ii, self._M_ii, count).finite
        return self._found.first(count)

    @cached_property
    def _condensed(self) -> tuple[Array, Array, Array]:
        """K (b, b) condensed, M times the constraint modes (n, b) and their mass (b, b)."""
        n, b = self.K.shape[0], len(self.boundary)
        T = np.zeros((n, b))
        T[self.boundary, np.arange(b)] = 1.0
        T[self.interior] = self.constraint_modes
        stiffness_known, MT = self._stiffness_at_boundary, self.M @ T
        K, M = T.T @ (self.K @ T) if stiffness_known is None else stiffness_known(), T.T @ MT
        return (K + K.T) / 2, MT, (M + M.T) / 2

    def reduced(self, count: int = 0) -> ReducedPart:
        """The reduction with the lowest `count` normal modes (theory eqs. 41-42)."""
        return self._assembled(self.normal_modes(count))

    def reduced_by(self, vectors: Array) -> ReducedPart:
        """The reduction with the Ritz vectors of interior displacements (i, k) in place of normal modes."""
        K, M = (vectors.T @ (A @ vectors) for A in (self._K_ii, self._M_ii))
        small = lowest((K + K.T) / 2, (M + M.T) / 2, len(K)).finite
        return self._assembled(Eigenpairs(small.values, vectors @ small.vectors))

    def _assembled(self, pairs: Eigenpairs) -> ReducedPart:
        b, k = len(self.boundary), len(pairs.values)
        T = np.zeros((self.K.shape[0], b + k))
        T[self.boundary, np.arange(b)] = 1.0
        T[self.interior, :b], T[self.interior, b:] = self.constraint_modes, pairs.vectors
        condensed, MT, mass = self._condensed
        K, M = np.zeros((b + k, b + k)), np.eye(b + k)
        K[:b, :b], M[:b, :b] = condensed, mass
        K[np.arange(b, b + k), np.arange(b, b + k)] = pairs.values
        M[b:, :b] = pairs.vectors.T @ MT[self.interior]
        M[:b, b:] = M[b:, :b].T
        return ReducedPart(K, M, T, np.sqrt(pairs.values))


def _workable(A: Any) -> Any:
    """A as a dense array when it is small, where sparse matrices cost more to index than to solve, else by columns."""
    if A.shape[0] > DENSE_LIMIT:
        return sp.csc_matrix(A)
    return A.toarray() if hasattr(A, "toarray") else np.asarray(A)


def free_interface(modes: CraigBampton, count: int = 0, below_hz: float = 0.0) -> ReducedPart:
    """Reduce by elastic normal modes of the free substructure and residual flexibility of its interface (Rubin 1975).

    The lowest `count` modes are kept, and all below `below_hz` Hz if that is more. The interior coordinates are
    decoupled; `frequencies` are their Ritz values with the interface held. With neither, these are the constraint modes
    alone. Raises SolverError when the interior is singular.
    """
    inner = modes.interior
    if not len(inner) or not (count or below_hz):
        return modes.reduced(0)
    # freedoms without stiffness and mass, such as those of nodes that others only pass through, are no part of this
    present = np.flatnonzero((modes.K.diagonal() > 0) | (modes.M.diagonal() > 0))
    K, M = modes.K[present][:, present], modes.M[present][:, present]
    rigid = _rigid_count(modes)
    if below_hz:
        count = max(count, count_below(K, M, (2 * np.pi * below_hz) ** 2) - rigid)
    pairs = lowest(K, M, min(rigid + count, len(present)))
    shapes = np.zeros((modes.K.shape[0], len(pairs.values)))
    shapes[present] = np.where(np.isfinite(pairs.values), pairs.vectors, 0.0)
    at_rest = shapes[inner, rigid:] - modes.constraint_modes @ shapes[modes.boundary, rigid:]
    relief = modes.solve((modes.M @ shapes[:, :rigid])[inner]) if rigid else np.empty((len(inner), 0))
    return modes.reduced_by(_independent(modes, np.hstack([at_rest, relief])))


def _rigid_count(modes: CraigBampton) -> int:
    """Number of motions of the substructure that strain nothing: those of its condensed stiffness, and of freedoms that
    have mass alone."""
    part = modes.reduced(0)
    b = len(modes.boundary)
    stiff, mass = np.diagonal(part.K)[:b], np.diagonal(part.M)[:b]
    loose = stiff <= 0
    held = np.flatnonzero(~loose)
    stiffness = part.K[np.ix_(held, held)]
    zeros = (la.eigvalsh(scaled(stiffness, unit_scale(stiffness))) < ADDED_ENERGY).sum()
    return int(zeros + (loose & (mass > 0)).sum())


def _independent(modes: CraigBampton, vectors: Array) -> Array:
    """Interior vectors (i, k) of unit strain energy, without those that the others already span."""
    energy = np.einsum("ik,ik->k", vectors, modes.stiffness @ vectors)
    vectors = vectors[:, energy > 0] / np.sqrt(energy[energy > 0])
    gram = vectors.T @ (modes.stiffness @ vectors)
    values, Z = la.eigh((gram + gram.T) / 2)
    kept = values > ADDED_ENERGY
    return vectors @ (Z[:, kept] / np.sqrt(values[kept]))


class PartReducer:
    """Reduces one prototype's own part to its boundary nodes, and `more` of its nodes, which are `kept` (k,).

    Chains end at every node of strips where these are not `in_chains`.
    """

    def __init__(self, part: Part, more: Sequence[int] = (), *, in_chains: bool = True) -> None:
        self.part = part
        self.kept: Index = np.array([*part.boundary, *sorted({*more} - set(part.boundary.tolist()))], dtype=np.intp)
        self._broken: list[tuple[int, Index]] = []
        for k, nodes in enumerate(part.strips):
            broken = np.flatnonzero(np.isin(nodes[:, 1:-1], self.kept).any(axis=1) | (not in_chains))
            if len(broken):
                self._broken.append((k, broken))
                if in_chains:
                    self.kept = np.concatenate([self.kept, np.setdiff1d(nodes[broken], self.kept)])
        self.boundary_dofs: Index = node_dofs(self.kept)
        self.interior_dofs: Index = node_dofs(np.setdiff1d(part.interior, self.kept))
        ends = [self.kept, *(part.strips[k][rows].ravel() for k, rows in self._broken)]
        self.chains: list[ChainGroup] = find_chains(part, np.concatenate(ends))
        self._latest: Latest[list[ChainKinematics]] = Latest()

    @cached_property
    def remaining(self) -> Index:
        """Nodes that are left after chains are condensed: those that are kept first, then the rest."""
        part = self.part
        ends = {int(n) for group in self.chains for n in group.nodes[:, [0, -1]].ravel()}
        ends |= {n for nodes, _, _ in part.discrete_nodes() for n in nodes}
        return np.array([*self.kept, *sorted(ends - set(self.kept.tolist()))], dtype=np.intp)

    @cached_property
    def _chain_stiffness(self) -> Scatter:
        broken = [self.part.strips[k][rows] for k, rows in self._broken]
        return self._scatter([group.nodes[:, [0, -1]] for group in self.chains], self.remaining, 1, broken)

    @cached_property
    def _chain_mass(self) -> Scatter:
        return self._scatter([group.nodes[:, [0, -1]] for group in self.chains], self.remaining, 2)

    @cached_property
    def _over_elements(self) -> tuple[Scatter, Scatter]:
        """The patterns of stiffness and mass over all nodes."""
        nodes = np.arange(self.part.n_nodes)
        members, strips = self.part.connectivity, self.part.strips
        return self._scatter([members], nodes, 1, strips), self._scatter([members], nodes, 2)

    def _scatter(self, connected: list[Index], nodes: Index, which: int, strips: Sequence[Index] = ()) -> Scatter:
        """The pattern over some nodes of what connects them, of the discrete elements that have stiffness (1) or
        mass (2), and of strips."""
        number = np.full(self.part.n_nodes, -1)
        number[nodes] = np.arange(len(nodes))
        discrete_elements = [
            node_dofs(number[element[0]])[None] for element in self.part.discrete_nodes() if element[which]
        ]
        before, after = (node_dofs(number[each]) for each in connected), (node_dofs(number[each]) for each in strips)
        return Scatter([*before, *discrete_elements, *after], 6 * len(nodes))

    def assembled(self, matrices: PartMatrices) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K and M (6n, 6n) of the part in its own frame, one design."""
        T, elements, discrete = matrices.T, matrices.elements, matrices.discrete_elements
        K = [T.mT @ elements.K @ T, *(e.K[None] for e in discrete if e.K is not None), *(s.K for s in matrices.strips)]
        M = [T.mT @ elements.M @ T, *(e.M[None] for e in discrete if e.M is not None)]
        stiffness, mass = self._over_elements
        return stiffness.sparse(K), mass.sparse(M)

    def assembled_chains(
        self, K: list[Any], slope: list[Any], lam: float | complex, matrices: PartMatrices
    ) -> tuple[Any, Any]:
        """Chains' matrices at one squared frequency lam (K and its derivative, (c, 12, 12) per group) assembled with
        discrete elements' K - lam M, and strips, over the `remaining` nodes."""
        discrete_elements = matrices.discrete_elements
        stiff = [discrete.K[None] for discrete in discrete_elements if discrete.K is not None]
        masses = [-discrete.M[None] for discrete in discrete_elements if discrete.M is not None]
        stiff += [matrices.strips[k].K[rows] for k, rows in self._broken]
        empty = [np.zeros(k.shape) for k in K]
        stiffness = self._chain_stiffness.dense([*K, *stiff])
        inertia = self._chain_mass.dense([*empty, *masses])
        return stiffness + lam * inertia, self._chain_mass.dense([*slope, *masses])

    def craig_bampton(self, matrices: PartMatrices, geometry: Geometry) -> CraigBampton:
        """Craig-Bampton modes, one design; the stiffness at the boundary is that of `condensed`."""
        self.refuse_too_large()
        K, M = self.assembled(matrices)
        return CraigBampton(
            K, M, self.interior_dofs, self.boundary_dofs, lambda: self.condensed(matrices, geometry, ())[0]
        )

    @property
    def kept_nodes(self) -> str:
        """How many nodes are kept, in words."""
        name = self.part.name or "mechanism"
        return f"{name}: {len(self.part.boundary)} of its {self.part.n_nodes} nodes are kept"

    @property
    def is_wide(self) -> bool:
        """True where so much is kept that modes of the full order come from sparse factors sooner than constraint
        modes."""
        kept = len(self.boundary_dofs)
        return kept > MOST_KEPT_FREEDOMS or beyond("dense_entries", kept * 6 * self.part.n_nodes) is not None

    def refuse_too_large(self) -> None:
        """Raise OptionError where the constraint modes of all that is kept are too large a matrix."""
        kept, n = len(self.boundary_dofs), 6 * self.part.n_nodes
        if excess := beyond("dense_entries", kept * n):
            rule = f"{self.kept_nodes}: {excess[1]}"
            advice = (
                "ask for a tolerance, which takes modes of the full order here; or divide it into substructures that"
                " share few nodes"
            )
            raise OptionError(f"{rule} (found {n} x {kept} constraint modes)\n    hint: {advice}; {excess[2]}")

    def kinematics(self, geometry: Geometry) -> list[ChainKinematics]:
        """What depends on geometry alone of every group of chains, kept while the part's stays the same."""
        part_geometry = geometry.parts[self.part.name]
        return self._latest.get(part_geometry, lambda: [kinematics(self.part, g, part_geometry) for g in self.chains])

    def condensed(self, matrices: PartMatrices, geometry: Geometry, lead: tuple[int, ...]) -> tuple[Array, Array]:
        """K and M (*lead, b, b) by constraint modes alone, for a stack of designs."""
        chains = zip(self.chains, self.kinematics(geometry), strict=True)
        pairs = [chain_matrices(group, kin, matrices.elements) for group, kin in chains]
        discrete = matrices.discrete_elements
        K = [*(k for k, _ in pairs), *(e.K[..., None, :, :] for e in discrete if e.K is not None)]
        K += [matrices.strips[k].K[..., rows, :, :] for k, rows in self._broken]
        M = [*(m for _, m in pairs), *(e.M[..., None, :, :] for e in discrete if e.M is not None)]
        b = len(self.boundary_dofs)
        if not lead and self._chain_stiffness.n > SPARSE_GUYAN:
            return _sparse_guyan(self._chain_stiffness.sparse(K), self._chain_mass.sparse(M), b)
        return _guyan(self._chain_stiffness.dense(K, lead), self._chain_mass.dense(M, lead), b)

    def stiffness(self, matrices: PartMatrices, geometry: Geometry, lead: tuple[int, ...]) -> Array:
        """K (*lead, n, n) over the `remaining` nodes, for a stack of designs."""
        chains = zip(self.chains, self.kinematics(geometry), strict=True)
        K = [chain_stiffness(group, kin, matrices.elements) for group, kin in chains]
        K += [e.K[..., None, :, :] for e in matrices.discrete_elements if e.K is not None]
        K += [matrices.strips[k].K[..., rows, :, :] for k, rows in self._broken]
        return np.asarray(self._chain_stiffness.dense(K, lead))


def _guyan(K: Array, M: Array, b: int) -> tuple[Array, Array]:
    """Statically condense everything behind the first b DOFs (Guyan 1965; theory eq. 52) of stacks (..., n, n)."""
    if K.shape[-1] == b:
        return K, M
    inner = K[..., b:, b:]
    d = unit_scale(inner)
    right = d[..., None] * K[..., b:, :b]
    psi = -d[..., None] * np.linalg.solve(scaled(inner, d), right)
    pt = psi.mT
    cross = M[..., :b, b:] @ psi
    M_r = M[..., :b, :b] + cross + cross.mT + pt @ M[..., b:, b:] @ psi
    K_r = K[..., :b, :b] + K[..., :b, b:] @ psi
    return (K_r + K_r.mT) / 2, M_r


def _sparse_guyan(K: sp.csc_matrix, M: sp.csc_matrix, b: int) -> tuple[Array, Array]:
    """The same of one large sparse pair (n, n)."""
    inner = sp.csc_matrix(K[b:, b:])
    psi = -factorise(inner).solve(K[b:, :b].toarray())
    cross = M[:b, b:] @ psi
    K_r = K[:b, :b].toarray() + K[:b, b:] @ psi
    return (K_r + K_r.T) / 2, M[:b, :b].toarray() + cross + cross.T + psi.T @ (M[b:, b:] @ psi)
