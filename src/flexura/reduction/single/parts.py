"""One prototype's own part reduced to its boundary nodes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.linalg import factorise, scaled, unit_scale
from flexura.records import Latest
from flexura.reduction.chains import ChainGroup, ChainKinematics, chain_stiffness, condense, find_chains, kinematics
from flexura.reduction.single.craig_bampton import CraigBampton
from flexura.sizes import beyond
from flexura.structure import DiscreteElement, Geometry, Part, PartMatrices, Scatter, node_dofs

SPARSE_FROM = 3000
"""Order beyond which what chains leave is condensed with sparse factors, one design at a time."""


WIDE = 900
"""Freedoms kept of a part beyond which modes of the full order are quicker than constraint modes."""


class PartReducer:
    """Reduces one prototype's own part to its boundary nodes, and `more` of its nodes, which are `kept` (k,)."""

    def __init__(self, part: Part, more: Sequence[int] = ()) -> None:
        self.part = part
        self.kept: Index = np.array([*part.boundary, *sorted({*more} - set(part.boundary.tolist()))], dtype=np.intp)
        self.boundary_dofs: Index = node_dofs(self.kept)
        self.interior_dofs: Index = node_dofs(np.setdiff1d(part.interior, self.kept))
        self.chains: list[ChainGroup] = find_chains(part, self.kept)
        self._latest: Latest[list[ChainKinematics]] = Latest()

    @cached_property
    def remaining(self) -> Index:
        """Nodes that are left after chains are condensed: those that are kept first, then the rest."""
        part = self.part
        ends = {int(n) for group in self.chains for n in group.nodes[:, [0, -1]].ravel()}
        ends |= {n for nodes, _, _ in part.discrete_nodes() for n in nodes}
        return np.array([*self.kept, *sorted(ends - set(self.kept.tolist()))], dtype=np.intp)

    @cached_property
    def _stiffness(self) -> Scatter:
        return self._scatter([self.part.connectivity], np.arange(self.part.n_nodes), 1)

    @cached_property
    def _mass(self) -> Scatter:
        return self._scatter([self.part.connectivity], np.arange(self.part.n_nodes), 2)

    @cached_property
    def _chain_stiffness(self) -> Scatter:
        return self._scatter([group.nodes[:, [0, -1]] for group in self.chains], self.remaining, 1)

    @cached_property
    def _chain_mass(self) -> Scatter:
        return self._scatter([group.nodes[:, [0, -1]] for group in self.chains], self.remaining, 2)

    def _scatter(self, connected: list[Index], nodes: Index, which: int) -> Scatter:
        """The pattern over some nodes of what connects them, and of the discrete elements that have stiffness (1) or
        mass (2)."""
        number = np.full(self.part.n_nodes, -1)
        number[nodes] = np.arange(len(nodes))
        discrete_elements = [node_dofs(number[own[0]])[None] for own in self.part.discrete_nodes() if own[which]]
        return Scatter([*(node_dofs(number[each]) for each in connected), *discrete_elements], 6 * len(nodes))

    def assembled(self, matrices: PartMatrices) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K and M (6n, 6n) of the part in its own frame, one design."""
        T = matrices.T
        Tt = np.swapaxes(T, -1, -2)
        K = [
            Tt @ matrices.elements.K @ T,
            *(e.K[None] for e in matrices.discrete_elements if e.K is not None),
        ]
        M = [
            Tt @ matrices.elements.M @ T,
            *(e.M[None] for e in matrices.discrete_elements if e.M is not None),
        ]
        return self._stiffness.sparse(K), self._mass.sparse(M)

    def assembled_chains(
        self, K: list[Any], slope: list[Any], lam: float | complex, discrete_elements: list[DiscreteElement]
    ) -> tuple[Any, Any]:
        """Chains' matrices at one squared frequency lam (K and its derivative, (c, 12, 12) per group) assembled with
        discrete elements' K - lam M over the `remaining` nodes."""
        stiff = [discrete.K[None] for discrete in discrete_elements if discrete.K is not None]
        masses = [-discrete.M[None] for discrete in discrete_elements if discrete.M is not None]
        empty = [np.zeros(k.shape) for k in K]
        stiffness = self._chain_stiffness.dense([*K, *stiff])
        inertia = self._chain_mass.dense([*empty, *masses])
        return stiffness + lam * inertia, self._chain_mass.dense([*slope, *masses])

    def craig_bampton(self, matrices: PartMatrices, geometry: Geometry) -> CraigBampton:
        """Craig-Bampton modes, one design; the stiffness at the boundary is that of `condensed`."""

        self.refuse_too_large()

        def stiffness() -> Array:
            return self.condensed(matrices, geometry, ())[0]

        return CraigBampton(*self.assembled(matrices), self.interior_dofs, self.boundary_dofs, stiffness)

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
        return kept > WIDE or beyond("dense_entries", kept * 6 * self.part.n_nodes) is not None

    def refuse_too_large(self) -> None:
        """Raise OptionError where the constraint modes of all that is kept are too large a matrix."""
        kept, n = len(self.boundary_dofs), 6 * self.part.n_nodes
        if found := beyond("dense_entries", kept * n):
            rule = f"{self.kept_nodes}: {found[1]}"
            advice = (
                "ask for a tolerance, which takes modes of the full order here; or divide it into substructures that"
                " share few nodes"
            )
            raise OptionError(f"{rule} (found {n} x {kept} constraint modes)\n    hint: {advice}; {found[2]}")

    def kinematics(self, geometry: Geometry) -> list[ChainKinematics]:
        """What depends on geometry alone of every group of chains, kept while the part's stays the same."""
        own = geometry.parts[self.part.name]
        return self._latest.get(own, lambda: [kinematics(self.part, g, own) for g in self.chains])

    def condensed(self, matrices: PartMatrices, geometry: Geometry, lead: tuple[int, ...]) -> tuple[Array, Array]:
        """K and M (*lead, b, b) by constraint modes alone, for a stack of designs."""
        K: list[Array] = []
        M: list[Array] = []
        for group, kin in zip(self.chains, self.kinematics(geometry), strict=True):
            k, m = condense(group, kin, matrices.elements)
            K.append(k)
            M.append(m)
        K += [discrete.K[..., None, :, :] for discrete in matrices.discrete_elements if discrete.K is not None]
        M += [discrete.M[..., None, :, :] for discrete in matrices.discrete_elements if discrete.M is not None]
        b = len(self.boundary_dofs)
        if not lead and self._chain_stiffness.n > SPARSE_FROM:
            return _sparse_guyan(self._chain_stiffness.sparse(K), self._chain_mass.sparse(M), b)
        return _guyan(self._chain_stiffness.dense(K, lead), self._chain_mass.dense(M, lead), b)

    def stiffness(self, matrices: PartMatrices, geometry: Geometry, lead: tuple[int, ...]) -> Array:
        """K (*lead, n, n) over the `remaining` nodes, for a stack of designs."""
        K: list[Array] = [
            chain_stiffness(group, kin, matrices.elements)
            for group, kin in zip(self.chains, self.kinematics(geometry), strict=True)
        ]
        K += [discrete.K[..., None, :, :] for discrete in matrices.discrete_elements if discrete.K is not None]
        return np.asarray(self._chain_stiffness.dense(K, lead))


def _guyan(K: Array, M: Array, b: int) -> tuple[Array, Array]:
    """Statically condense everything behind the first b DOFs (Guyan 1965; theory eq. 52) of stacks (..., n, n)."""
    if K.shape[-1] == b:
        return K, M
    inner = K[..., b:, b:]
    d = unit_scale(inner)
    right = d[..., None] * K[..., b:, :b]
    psi = -d[..., None] * np.linalg.solve(scaled(inner, d), right)
    pt = np.swapaxes(psi, -1, -2)
    cross = M[..., :b, b:] @ psi
    M_r = M[..., :b, :b] + cross + np.swapaxes(cross, -1, -2) + pt @ M[..., b:, b:] @ psi
    K_r = K[..., :b, :b] + K[..., :b, b:] @ psi
    return (K_r + np.swapaxes(K_r, -1, -2)) / 2, M_r


def _sparse_guyan(K: sp.csc_matrix, M: sp.csc_matrix, b: int) -> tuple[Array, Array]:
    """The same of one large sparse pair (n, n)."""
    inner = sp.csc_matrix(K[b:, b:])
    psi = -factorise(inner).solve(K[b:, :b].toarray())
    cross = M[:b, b:] @ psi
    K_r = K[:b, :b].toarray() + K[:b, b:] @ psi
    return (K_r + K_r.T) / 2, M[:b, :b].toarray() + cross + cross.T + psi.T @ (M[b:, b:] @ psi)
