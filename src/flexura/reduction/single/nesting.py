"""A reduced mechanism as a part of another: superelements of nodes and amplitudes (theory eqs. R11-R13)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.errors import OptionError
from flexura.linalg import lowest, scaled, unit_scale
from flexura.mechanism import DOF_NAMES, Matrix, Substructure, Superelement
from flexura.reduction.single.model import LowOrderModel
from flexura.results import Result
from flexura.sizes import within
from flexura.structure import FullOrderModel
from flexura.tables import Facts, Table

PART = "reduced"
"""Name of the superelement in the substructure that is made of a reduced mechanism."""

DEPENDENT = 1e-9
"""Relative size of the last pivot below which displacements of nodes depend on each other."""

ROUND_OFF = 1e-12
"""Strain energy of a rigid motion below this part of the sum of its terms' sizes is round-off."""


MOST_NAMED = 6
"""Nodes that a notebook names."""


@dataclass(frozen=True, repr=False)
class NestedModel(Result):
    """A low-order model in the coordinates of a superelement: displacements of nodes, then amplitudes.

    `names` are those of the nodes outside, by their names in the mechanism that was reduced.
    """

    model: LowOrderModel
    names: Mapping[str, str]

    _told = ("names", "amplitudes", "model")

    def _view(self) -> Iterator[Facts | Table]:
        nodes = ", ".join(list(self.names)[:MOST_NAMED])
        yield Facts(
            {"nodes": nodes, "amplitudes": self.amplitudes, "reduced from order": self.model.plan.topology.n_dof}
        )

    @property
    def amplitudes(self) -> int:
        """Number of coordinates that are not displacements of the nodes."""
        return self.model.order - 6 * len(self.names)

    @property
    def superelement(self) -> Superelement:
        """The matrices as a part for other mechanisms, over the nodes by their names outside."""
        nodes = tuple(self.names.values())
        stiffness, mass = Matrix(self.model.K), Matrix(self.model.M)
        return Superelement(nodes=nodes, amplitudes=self.amplitudes, stiffness=stiffness, mass=mass)

    @property
    def substructure(self) -> Substructure:
        """The nodes where they are, with the superelement `reduced` between them, as a substructure to be placed."""
        own = self.model
        x = own.geometry.positions[own.plan.topology.numbers(list(self.names))].tolist()
        nodes = {name: (a, b, c) for name, (a, b, c) in zip(self.names.values(), x, strict=True)}
        return Substructure(nodes=nodes, superelements={PART: self.superelement}, interface=tuple(nodes))

    def recover(self, model: FullOrderModel, vectors: Array, name: str) -> Array:
        """DOF vectors (full order of the mechanism that was reduced, k), in its own frame, of the copy that stands as
        superelement `name` in another, for DOF vectors (n, k) of that one's full-order model.

        Raises OptionError when there is no such superelement, or it has other nodes or amplitudes.
        """
        coordinates = model.superelement_coordinates(vectors, name)
        if len(coordinates) != self.model.order:
            raise OptionError(f"{name} has {len(coordinates)} coordinates, this model {self.model.order}")
        return self.model.recover(coordinates)


@verb
def nested(
    low: LowOrderModel, nodes: Sequence[str] | Mapping[str, str] | None = None, *, keep: int | None = None
) -> NestedModel:
    """Put a low-order model into the coordinates of a superelement over some of its nodes (theory eqs. R11-R12).

    The coordinates are the displacements of the `nodes` (default: those whose static response is exact) and amplitudes
    of the lowest `keep` normal modes with these held. With all of them, the default, nothing is lost; with fewer,
    static response at the nodes stays that of the coordinates. A mapping of nodes gives their names outside; else dots
    become underscores. Leave to the mechanism outside what holds the nodes. Raises OptionError for nodes that are held
    or move as one rigid body, or when something is free with the nodes held.
    """
    low.plan.refuse_loads("a superelement, which is to be placed in other states of load")
    names = _names(low, low.static_nodes if nodes is None else nodes)
    if keep is not None and (not isinstance(keep, int | np.integer) or keep < 0):
        raise OptionError(f"the number of amplitudes is a whole number, zero or more, not {keep!r}")
    within("dense_entries", low.order**2, f"a superelement of a model of order {low.order}")
    K, M = (np.asarray(A.toarray() if hasattr(A, "toarray") else A) for A in (low.K, low.M))
    P, N = _split(low, list(names), K, M)
    K_rr, M_rr = N.T @ K @ N, N.T @ M @ N
    P = P - N @ _static(K_rr, N.T @ (K @ P))
    modes = lowest((K_rr + K_rr.T) / 2, (M_rr + M_rr.T) / 2, len(K_rr) if keep is None else min(keep, len(K_rr)))
    finite = np.isfinite(modes.values)
    T = np.hstack([P, N @ modes.vectors[:, finite]])
    labels = [f"{name}.{dof}" for name in names for dof in DOF_NAMES]
    labels += [f"amplitude {k + 1}" for k in range(int(finite.sum()))]
    model = low.projected(T, labels, f"superelement of {len(names)} nodes and {int(finite.sum())} amplitudes")
    b = P.shape[1]
    condensed = _without_strain(low, list(names), model.K[:b, :b], model.M[:b, :b], np.abs(P).T @ np.abs(K) @ np.abs(P))
    stiffness = la.block_diag(condensed, np.diag(modes.values[finite]))
    return NestedModel(replace(model, K=stiffness), names)


def _names(low: LowOrderModel, nodes: Sequence[str] | Mapping[str, str]) -> dict[str, str]:
    """Names outside by names of nodes inside."""
    if isinstance(nodes, str):
        nodes = [nodes]
    names = dict(nodes) if isinstance(nodes, Mapping) else {node: node.replace(".", "_") for node in nodes}
    if not names or len(set(names.values())) < len(nodes):
        raise OptionError("name at least one node, and each only once, with a name of its own outside")
    topology = low.plan.topology
    first: dict[int, str] = {}
    for name, root in zip(names, topology.root[topology.numbers(list(names))].tolist(), strict=True):
        if topology.held[root].any():
            raise OptionError(f"node {name} is held; a superelement is held by the mechanism that it is a part of")
        if root in first:
            raise OptionError(f"{first[root]} and {name} move as one rigid body; name one of them")
        first[root] = name
    return names


def _split(low: LowOrderModel, nodes: list[str], K: Array, M: Array) -> tuple[Array, Array]:
    """P (n, 6k) and N (n, n - 6k) with q = P u + N r, in which u are the displacements of the nodes.

    The coordinates that are eliminated for u are found by pivoting (theory eq. R11).
    """
    B = low.node_rows(nodes)
    m, n = B.shape
    stiff, mass = np.diagonal(K), np.diagonal(M)
    both = (stiff > 0) & (mass > 0)
    weight = float(np.median(stiff[both] / mass[both])) if both.any() else 1.0
    size = np.sqrt(stiff + weight * mass)
    scaled = B / np.where(size > 0, size, 1.0)
    length = np.linalg.norm(scaled, axis=1)
    if m > n or not (length > 0).all():
        raise OptionError(_INDEPENDENT)
    _, R, order = la.qr(scaled / length[:, None], mode="economic", pivoting=True)
    pivots = np.abs(np.diagonal(R))
    if pivots[-1] < DEPENDENT * pivots[0]:
        raise OptionError(_INDEPENDENT)
    out: Index = np.sort(order[:m]).astype(np.intp)
    rest = np.setdiff1d(np.arange(n), out)
    P, N = np.zeros((n, m)), np.zeros((n, n - m))
    P[out] = np.linalg.inv(B[:, out])
    N[rest, np.arange(n - m)] = 1.0
    N[out] = -P[out] @ B[:, rest]
    return P, N


_INDEPENDENT = (
    "the coordinates of this model do not move these nodes independently; name fewer nodes, or nodes at the interface"
    " before condensing"
)


def _without_strain(low: LowOrderModel, nodes: list[str], K: Array, M: Array, size: Array) -> Array:
    """The condensed stiffness K (b, b), made exact for rigid motions of the nodes where these strain it by round-off
    alone (theory eq. R13): a floating part then has zero frequencies, not small ones.

    `size` (b, b) is K summed from the absolute values of its terms.
    """
    x = low.geometry.positions[low.plan.topology.numbers(nodes)]
    R = rigid_arm(x - x.mean(axis=0)).reshape(-1, 6)
    noise = ROUND_OFF * np.einsum("ik,ij,jk->k", np.abs(R), size, np.abs(R))
    if not (np.abs(np.einsum("ik,ij,jk->k", R, K, R)) <= noise).all():
        return K
    weighted = np.diagonal(M)[:, None] * R
    project = np.eye(len(K)) - R @ np.linalg.solve(R.T @ weighted, weighted.T)
    K = project.T @ K @ project
    return (K + K.T) / 2


def _static(K: Array, forces: Array) -> Array:
    """K^-1 times forces (r, b). Raises OptionError for a stiffness that is singular."""
    if not len(K):
        return forces
    d = unit_scale(K)
    try:
        if not (np.diagonal(K) > 0).all():
            raise la.LinAlgError
        return d[:, None] * la.cho_solve(la.cho_factor(scaled(K, d)), d[:, None] * forces)
    except la.LinAlgError:
        raise OptionError("with these nodes held something can still move freely; name more of them") from None
