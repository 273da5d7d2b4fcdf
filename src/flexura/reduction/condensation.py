"""Further steps from a low-order model: to very few coordinates, to modes of its interface, to a part of another.

Guyan, IRS, SEREP and modal condensation: every physical displacement stays recoverable, and static response exact at
the static nodes. Characteristic constraint modes (Castanier, Tan and Pierre 2001; theory eq. R6). Superelements of
nodes and amplitudes (theory eqs. R11-R13).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
import scipy.linalg as la

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.errors import OptionError
from flexura.linalg import count_below, lowest, scaled, unit_scale
from flexura.mechanism import DOF_NAMES, Matrix, Substructure, Superelement
from flexura.reduction.assembly import SubstructureBasis
from flexura.reduction.model import LowOrderModel
from flexura.results import Result
from flexura.sizes import within
from flexura.structure import FullOrderModel
from flexura.tables import Facts, Item

Condensation = Literal["guyan", "irs", "iterated_irs", "serep", "modal"]

MASTER_PIVOT = 1e-7
"""Relative size of the last pivot below which coordinates do not tell the modes apart."""

IRS_ROUNDS = 30
"""Most rounds of iterated IRS."""

IRS_SETTLED = 1e-12
"""Relative change of the squared frequencies at which iterated IRS ends."""

NESTED_PART = "reduced"
"""Name of the superelement in the substructure that is made of a reduced mechanism."""

NODE_PIVOT = 1e-9
"""Relative size of the last pivot below which displacements of nodes depend on each other."""

RIGID_STRAIN = 1e-12
"""Strain energy of a rigid motion below this part of the sum of its terms' sizes is round-off."""

MOST_NODES_NAMED = 6
"""Nodes that a notebook names."""

DEPENDENT_NODES = (
    "the coordinates of this model do not move these nodes independently; name fewer nodes, or nodes at the interface"
    " before condensing"
)


@verb
def condense(
    low: LowOrderModel,
    to: int | Sequence[str],
    *,
    method: Condensation = "serep",
    modes: Sequence[int] | None = None,
) -> LowOrderModel:
    """Condense a low-order model to very few of its coordinates (theory eqs. R7-R10).

    `to` names coordinates (`platform.tz`) or nodes with all six (`platform`), or is the number of coordinates, which
    are then chosen among those of rigid bodies, or where these do not suffice among all displacements. Methods: `guyan`
    (1965), `irs` (O'Callahan 1989), `iterated_irs` (Friswell, Garvey and Penny 1995), `serep` (O'Callahan, Avitabile
    and Riemer 1989), which has the lowest frequencies of the model exactly, and `modal`, the same in coordinates of
    the modes. These two have the lowest modes, or those numbered in `modes`, from 1, as many as coordinates. Raises
    OptionError for coordinates that are not there or do not tell the modes apart, and for modes that are not there.
    """
    if method not in get_args(Condensation):
        raise OptionError(f"method is one of {', '.join(get_args(Condensation))}, not {method!r}")
    K, M = low.K, low.M
    if isinstance(to, int | np.integer):
        masters, m = None, int(to)
    else:
        masters = _coordinates_named(low, to)
        m = len(masters)
    if not 1 <= m <= low.order:
        raise OptionError(
            f"a model of order {low.order} is condensed to between 1 and {low.order} coordinates, not {m}"
        )
    numbers = np.arange(m) if modes is None else _mode_positions(modes, m, low.order, method)
    weight = np.sqrt(M.diagonal())
    if masters is None or method in ("serep", "modal"):
        pairs = lowest(K, M, int(numbers[-1]) + 1)
        if not np.isfinite(pairs.values).all():
            raise OptionError(f"the model has only {np.isfinite(pairs.values).sum()} modes; ask for fewer coordinates")
        vectors = pairs.vectors[:, numbers]
        if method == "modal":
            return low.projected(vectors, [f"mode {k + 1}" for k in numbers], f"{m} modal coordinates")
        masters = _telling_coordinates(low, vectors, weight) if masters is None else masters
        if method == "serep":
            return low.projected(_serep(vectors, masters, weight), *_naming(low, masters, method))
    within("dense_entries", low.order**2, f"{method.replace('_', ' ')} of a model of order {low.order}")
    K, M = (np.asarray(A.toarray() if hasattr(A, "toarray") else A) for A in (K, M))
    return low.projected(_reduced_system(K, M, masters, method), *_naming(low, masters, method))


def _naming(low: LowOrderModel, masters: Index, method: str) -> tuple[list[str], str]:
    """Names of the coordinates, and the step in words."""
    step = f"{method.replace('_', ' ')} to {len(masters)} coordinates"
    return [low.coordinate_names[k] for k in masters], step


def _mode_positions(modes: Sequence[int], count: int, order: int, method: str) -> Index:
    """Positions of modes that are numbered from 1."""
    if method not in ("serep", "modal"):
        raise OptionError(f"modes are chosen for serep and modal; {method} finds its own")
    numbers = sorted(set(modes))
    if len(numbers) != len(modes) or len(numbers) != count:
        raise OptionError(f"{count} coordinates have {count} different modes, not {', '.join(map(str, modes))}")
    if not all(isinstance(k, int | np.integer) and 1 <= k <= order for k in numbers):
        raise OptionError(f"modes are numbered from 1 to {order}, not {', '.join(map(str, modes))}")
    return np.array(numbers, dtype=np.intp) - 1


def _serep(modes: Array, masters: Index, weight: Array) -> Array:
    at = modes[masters] * weight[masters, None]
    pivots = np.abs(np.diagonal(la.qr(at, pivoting=True)[1]))
    if pivots[-1] < MASTER_PIVOT * pivots[0]:
        raise OptionError(
            "these coordinates do not distinguish the lowest modes; name others, or give only their number"
        )
    return modes @ np.linalg.solve(at, np.diag(weight[masters]))


def _reduced_system(K: Array, M: Array, masters: Index, method: str) -> Array:
    """T (n, m) of Guyan and of the improved reduced system."""
    n, m = len(K), len(masters)
    slaves = np.setdiff1d(np.arange(n), masters)
    T = np.zeros((n, m))
    T[masters, np.arange(m)] = 1.0
    if not len(slaves):
        return T
    K_ss = K[np.ix_(slaves, slaves)]
    d = unit_scale(K_ss)
    try:
        factor = la.cho_factor(scaled(K_ss, d))
    except la.LinAlgError:
        raise OptionError("with these coordinates held something can still move freely; name more of them") from None

    def flexible(forces: Array) -> Array:
        return d[:, None] * la.cho_solve(factor, d[:, None] * forces)

    guyan = -flexible(K[np.ix_(slaves, masters)])
    T[slaves] = guyan
    if method == "guyan":
        return T
    before = np.zeros(m)
    for _ in range(IRS_ROUNDS if method == "iterated_irs" else 1):
        K_r, M_r = T.T @ K @ T, T.T @ M @ T
        T[slaves] = guyan + flexible((M @ T)[slaves] @ np.linalg.solve(M_r, K_r))
        values = lowest(T.T @ K @ T, T.T @ M @ T, m).values
        if np.abs(values - before).max() <= IRS_SETTLED * values.max():
            break
        before = values
    return T


def _coordinates_named(low: LowOrderModel, names: Sequence[str]) -> Index:
    known = {name: k for k, name in enumerate(low.coordinate_names)}
    masters: list[int] = []
    for name in [names] if isinstance(names, str) else names:
        of_node = [k for text, k in known.items() if text.rpartition(".")[0] == name]
        positions = [known[name]] if name in known else of_node
        if not positions:
            raise OptionError(f"the model has no coordinate of {name!r}; `coordinate_names` lists those it has")
        masters += positions
    if not masters or len(set(masters)) < len(masters):
        raise OptionError("name at least one coordinate, and each only once")
    return np.array(masters, dtype=np.intp)


def _telling_coordinates(low: LowOrderModel, modes: Array, weight: Array) -> Index:
    """As many coordinates as modes (n, m) that tell them apart best: pivoted QR of the modes there, bodies first."""
    count = modes.shape[1]
    weighted = modes * weight[:, None]
    plan, names = low.plan, low.coordinate_names
    bodies = {
        ".".join((*path, key))
        for name, part in plan.parts.items()
        for path in plan.topology.copies[name].paths
        for key in part.bodies
    }
    of_bodies = np.array([k for k, name in enumerate(names) if name.rpartition(".")[0] in bodies], dtype=np.intp)
    n = len(low.basis.assembler.physical) if isinstance(low.basis, SubstructureBasis) else low.order
    for candidates in (of_bodies, np.arange(n), np.arange(low.order)):
        if len(candidates) >= count:
            _, R, order = la.qr(weighted[candidates].T, mode="economic", pivoting=True)
            pivots = np.abs(np.diagonal(R))
            if pivots[count - 1] > MASTER_PIVOT * pivots[0]:
                return np.sort(candidates[order[:count]])
    raise OptionError(f"no {count} coordinates distinguish the lowest modes; use method modal")


@verb
def interface_reduction(low: LowOrderModel, *, n: int = 0, up_to: float = 0.0) -> LowOrderModel:
    """Replace the interface displacements of a model from `reduce` by their lowest normal modes.

    The lowest `n` characteristic constraint modes are kept, and all up to `up_to` Hz if that is more; amplitudes of
    substructures' normal modes stay. Static response stays exact at the static nodes. Raises OptionError when nothing
    is to be kept, or for a model whose coordinates are not those of substructures.
    """
    if not isinstance(low.basis, SubstructureBasis):
        raise OptionError("interface reduction is for the coordinates of substructures: apply it before other steps")
    if n < 0 or not (np.isfinite(up_to) and up_to >= 0) or not (n or up_to):
        raise OptionError("say how many characteristic constraint modes to keep, or up to which frequency in Hz")
    size = len(low.basis.assembler.physical)
    K, M = low.K[:size][:, :size], low.M[:size][:, :size]
    if up_to:
        n = max(n, count_below(K, M, (2 * np.pi * up_to) ** 2))
    n = min(max(n, 1), size)
    modes = lowest(K, M, n).vectors
    T = la.block_diag(modes, np.eye(low.order - size))
    names = [f"characteristic constraint mode {k + 1}" for k in range(n)] + low.coordinate_names[size:]
    return low.projected(T, names, f"{n} of {size} characteristic constraint modes of the interface")


@dataclass(frozen=True, repr=False)
class NestedModel(Result):
    """A low-order model in the coordinates of a superelement: displacements of nodes, then amplitudes.

    `names` are those of the nodes outside, by their names in the mechanism that was reduced.
    """

    model: LowOrderModel
    names: Mapping[str, str]

    _told = ("names", "amplitudes", "model")

    def presentation(self) -> Iterator[Item]:
        nodes = ", ".join(list(self.names)[:MOST_NODES_NAMED])
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
        model = self.model
        x = model.geometry.positions[model.plan.topology.numbers(list(self.names))].tolist()
        nodes = {name: (a, b, c) for name, (a, b, c) in zip(self.names.values(), x, strict=True)}
        return Substructure(nodes=nodes, superelements={NESTED_PART: self.superelement}, interface=tuple(nodes))

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
    count = len(K_rr) if keep is None else min(keep, len(K_rr))
    modes = lowest((K_rr + K_rr.T) / 2, (M_rr + M_rr.T) / 2, count).finite
    amplitudes = len(modes.values)
    T = np.hstack([P, N @ modes.vectors])
    labels = [f"{name}.{dof}" for name in names for dof in DOF_NAMES]
    labels += [f"amplitude {k + 1}" for k in range(amplitudes)]
    model = low.projected(T, labels, f"superelement of {len(names)} nodes and {amplitudes} amplitudes")
    b = P.shape[1]
    condensed = _without_strain(low, list(names), model.K[:b, :b], model.M[:b, :b], np.abs(P).T @ np.abs(K) @ np.abs(P))
    stiffness = la.block_diag(condensed, np.diag(modes.values))
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
        raise OptionError(DEPENDENT_NODES)
    _, R, order = la.qr(scaled / length[:, None], mode="economic", pivoting=True)
    pivots = np.abs(np.diagonal(R))
    if pivots[-1] < NODE_PIVOT * pivots[0]:
        raise OptionError(DEPENDENT_NODES)
    out: Index = np.sort(order[:m]).astype(np.intp)
    rest = np.setdiff1d(np.arange(n), out)
    P, N = np.zeros((n, m)), np.zeros((n, n - m))
    P[out] = np.linalg.inv(B[:, out])
    N[rest, np.arange(n - m)] = 1.0
    N[out] = -P[out] @ B[:, rest]
    return P, N


def _without_strain(low: LowOrderModel, nodes: list[str], K: Array, M: Array, size: Array) -> Array:
    """The condensed stiffness K (b, b), made exact for rigid motions of the nodes where these strain it by round-off
    alone (theory eq. R13): a floating part then has zero frequencies, not small ones.

    `size` (b, b) is K summed from the absolute values of its terms.
    """
    x = low.geometry.positions[low.plan.topology.numbers(nodes)]
    R = rigid_arm(x - x.mean(axis=0)).reshape(-1, 6)
    noise = RIGID_STRAIN * np.einsum("ik,ij,jk->k", np.abs(R), size, np.abs(R))
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
