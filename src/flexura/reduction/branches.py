"""Branches of a mechanism, instances at top level that meet the rest in a few nodes, and matrices as an arrow of them.

The nodes of a plan fall into a core and the insides of branches, so that K and M are an arrow: the inside of a branch
meets the core alone. In axes of their own, branches of one prototype that are held and attached alike are equal,
however they are turned and mirrored, and are stored once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.kernels import Kernel, is_compiled, packed, scratch
from flexura.linalg import EPS, inverse_roots
from flexura.structure import Design, Plan

Copy = tuple[str, int]
"""A prototype, and the number among its copies."""

FIXED_MAP_AXES = 4
"""Axes of the maps of a block whose geometry is the same in all designs."""

PLACING_ROUNDING = 64 * EPS
"""Relative error of an entry of L' A L, as a part of |L|' |A| |L|: two products of some twenty terms and their sums
(theory eq. N10)."""


@dataclass
class BranchKind:
    """BranchLayout that are equal in their own axes.

    `instances` are their numbers among all instances. `copies` are the parts of the first one. `place` has, for every
    one of these, the local coordinates (nodes, 6) of the nodes that are used, -1 where held; those from `inside` on
    belong to the interface, whose `nodes` (branches, i) of each branch follow roots in the core. `meets` says which of
    the nodes used are such nodes.
    """

    instances: list[int]
    copies: list[Copy]
    place: list[Index]
    meets: list[NDArray[np.bool_]]
    inside: int
    nodes: Index


@dataclass
class BranchLayout:
    """How the nodes that are used, by prototype, make up kinds of branches and a core.

    `core` (nodes, 6) numbers the `n_core` coordinates of roots in the core, -1 elsewhere; `core_copies` are the parts
    that belong to no branch.
    """

    kinds: list[BranchKind]
    core: Index
    n_core: int
    core_copies: list[Copy]


def find_branches(plan: Plan, used: Mapping[str, Index]) -> BranchLayout:
    """The branches of a plan for the nodes (n,) that are `used` of each prototype."""
    topology = plan.topology
    inside_of: dict[str, list[Copy]] = {}
    for name in used:
        for k, path in enumerate(topology.copies[name].paths):
            inside_of.setdefault(path[0] if path else "", []).append((name, k))
    top = inside_of.pop("", [])
    is_inside = _insides(plan, used, top, inside_of)
    every = _roots(plan, used, [*top, *(copy for copies in inside_of.values() for copy in copies)])
    in_core = topology.dof >= 0
    in_core &= (~is_inside & np.isin(np.arange(topology.n_nodes), every))[:, None]
    core = np.full(topology.dof.shape, -1, dtype=np.intp)
    core[in_core] = np.arange(int(in_core.sum()))
    kinds: dict[tuple[object, ...], BranchKind] = {}
    instance, prototype = {}, {}
    for name, placed in topology.copies.items():
        instance |= zip(placed.paths, placed.number, strict=True)
        prototype |= dict.fromkeys(placed.paths, name)
    for branch, copies in inside_of.items():
        if not is_inside[_roots(plan, used, copies)].any():
            top = [*top, *copies]
            continue
        place, meets, inside, nodes = _numbered(plan, used, copies, is_inside)
        relative = tuple((name, topology.copies[name].paths[k][1:]) for name, k in copies)
        pattern = tuple(array.tobytes() for array in (*place, *meets))
        like = kinds.setdefault(
            (prototype[(branch,)], relative, pattern),
            BranchKind([], copies, place, meets, inside, np.empty((0, len(nodes)), int)),
        )
        like.instances.append(instance[(branch,)])
        like.nodes = np.vstack([like.nodes, nodes])
    return BranchLayout(list(kinds.values()), core, int(in_core.sum()), top)


def _roots(plan: Plan, used: Mapping[str, Index], copies: list[Copy]) -> Index:
    """Roots of the nodes used of some copies."""
    topology = plan.topology
    roots = [topology.root[topology.copies[name].offset[k] + used[name]] for name, k in copies]
    return np.unique(np.concatenate(roots)) if roots else np.empty(0, dtype=np.intp)


def _insides(
    plan: Plan, used: Mapping[str, Index], top: list[Copy], inside_of: Mapping[str, list[Copy]]
) -> NDArray[np.bool_]:
    """Roots (nodes,) that lie in a branch and that nothing else uses, in branches that meet anything else; none that is
    held in directions that do not turn with its branch."""
    topology = plan.topology
    number = {branch: k for k, branch in enumerate(inside_of)}
    lies = np.full(topology.n_nodes, -1)
    for name, copies in topology.copies.items():
        for path, offset in zip(copies.paths, copies.offset, strict=True):
            lies[offset : offset + plan.parts[name].n_nodes] = number.get(path[0], -1) if path else -1
    free = topology.dof >= 0
    partly = topology.has_position & free.any(axis=1) & ~free.all(axis=1)
    users = np.zeros(topology.n_nodes, dtype=np.intp)
    alone = np.zeros(topology.n_nodes, dtype=bool)
    roots_of = {branch: _roots(plan, used, copies) for branch, copies in inside_of.items()}
    for branch, roots in roots_of.items():
        users[roots] += 1
        alone[roots] |= lies[roots] == number[branch]
    users[_roots(plan, used, top)] += 1
    is_inside = alone & (users == 1) & free.any(axis=1) & ~partly
    for roots in roots_of.values():
        if not (free[roots].any(axis=1) & ~is_inside[roots]).any():
            is_inside[roots] = False
    return is_inside


def _numbered(
    plan: Plan, used: Mapping[str, Index], copies: list[Copy], is_inside: NDArray[np.bool_]
) -> tuple[list[Index], list[NDArray[np.bool_]], int, Index]:
    """Local coordinates of the nodes used of each copy, whether they are nodes that meet the core, the number of
    coordinates inside, and the nodes of the interface."""
    topology = plan.topology
    free = topology.dof >= 0
    numbers = [topology.copies[name].offset[k] + used[name] for name, k in copies]
    local: dict[int, Index] = {}
    first = 0
    for root in dict.fromkeys(int(r) for nodes_used in numbers for r in topology.root[nodes_used] if is_inside[r]):
        local[root] = np.where(free[root], first + np.cumsum(free[root]) - 1, -1)
        first += int(free[root].sum())
    inside, nodes, met = first, [], {}
    place, meets = [], []
    for nodes_used in numbers:
        rows, flags = [], []
        for node in nodes_used.tolist():
            root = int(topology.root[node])
            meet = not is_inside[root] and bool(free[root].any())
            if meet:
                key = node if topology.is_rigid[node] else -1 - root
                if key not in met:
                    met[key] = first + np.arange(6)
                    nodes.append(node)
                    first += 6
                rows.append(met[key])
            else:
                rows.append(local[root] if is_inside[root] else np.full(6, -1))
            flags.append(meet)
        place.append(np.array(rows, dtype=np.intp).reshape(-1, 6))
        meets.append(np.array(flags, dtype=bool))
    return place, meets, inside, np.array(nodes, dtype=np.intp)


def part_transforms(
    design: Design, name: str, which: list[int], nodes: Index, *, base: list[int], meets: NDArray[np.bool_]
) -> Array:
    """G (..., k, nodes, 6, 6): displacements of nodes of the copies `which` (k,) of a prototype, in its frame, from
    those of their roots in the axes of the instances `base` (k,); nodes that meet the core (k, nodes) stand for
    themselves."""
    topology, copies = design.plan.topology, design.plan.topology.copies[name]
    turning = design.geometry.turning
    of_copies, onto = turning[..., [copies.number[k] for k in which], :, :], turning[..., base, :, :]
    turn = of_copies.mT @ onto
    number = np.array([copies.offset[k] for k in which], dtype=np.intp)[:, None] + nodes
    G = np.repeat(turn[..., None, :, :], len(nodes), axis=-3)
    slaved = topology.is_rigid[number] & (topology.root[number] != number) & ~meets
    if slaved.any():
        at = number[slaved]
        arm = design.geometry.at(at) - design.geometry.at(topology.root[at])
        Q = design.geometry.Q[..., base, :, :][..., np.nonzero(slaved)[0], :, :]
        follows = G[..., slaved, :, :] @ rigid_arm(np.einsum("...ji,...j->...i", Q, arm))
        G = np.broadcast_to(G, (*follows.shape[:-3], *G.shape[-4:])).copy()
        G[..., slaved, :, :] = follows
    G[..., nodes >= design.plan.parts[name].n_positioned, :, :] = np.eye(6)
    return G


def interface_maps(design: Design, kind: BranchKind, branches: BranchLayout) -> Array:
    """T (..., branches, 6 i, c): displacements of the interface of each branch, in its axes, from coordinates of the
    core."""
    topology, geometry = design.plan.topology, design.geometry
    count, i = kind.nodes.shape
    node = kind.nodes.ravel()
    root = topology.root[node]
    arm = np.where(topology.is_rigid[node][:, None], geometry.at(node) - geometry.at(root), 0.0)
    onto = np.repeat(geometry.turning[..., kind.instances, :, :], i, axis=-3)
    D = onto.mT @ rigid_arm(arm)
    D[..., ~topology.has_position[node], :, :] = np.eye(6)
    out = np.zeros((*D.shape[:-2], branches.n_core + 1, 6))
    out[..., np.arange(len(node))[:, None], branches.core[root], :] = D.mT
    maps = out[..., :-1, :].mT
    return maps.reshape(*D.shape[:-3], count, 6 * i, branches.n_core)


class _Following(NamedTuple):
    """Flexibility, static motion, matrices of it, and sums of 1/omega^2 (designs, q), as of a block."""

    inverse: Array
    motion: Array
    followed: Array
    slowness: Array


_follow = Kernel("branches_followed", "aaaaaaa")

_place = Kernel("branches_placed", "aaaaa")


@dataclass(frozen=True)
class Block:
    """Kinds of branches of one shape: matrices A (3, designs, q, n, n), K, M and R, in axes of their own, `inside`
    coordinates first. The errors of K, M and R lie between the diagonals `slack` (3, designs, q, n) and minus these.

    T (..., q, r, n - inside, c) takes the core's coordinates to those of the interface of each of r branches of a kind;
    it is zero where a kind has fewer.
    """

    A: Array
    slack: Array
    inside: int
    T: Array

    @cached_property
    def _following(self) -> _Following:
        """How the branches follow their interfaces."""
        if not is_compiled():
            return self._following_in_numpy()
        found, missing = self._following_by_kernel()
        if missing:
            lost, own = np.isnan(found.slowness), self._following_in_numpy()
            found.inverse[lost], found.motion[lost] = own.inverse[lost], own.motion[lost]
            found.followed[:, lost], found.slowness[lost] = own.followed[:, lost], own.slowness[lost]
        return found

    def _following_in_numpy(self) -> _Following:
        m = self.inside
        inner = self.A[0, ..., :m, :m]
        d = inverse_roots(np.einsum("...ii->...i", inner))
        both = d[..., :, None] * d[..., None, :]
        inverse = np.asarray(np.linalg.inv(inner * both) * both)
        follows = -inverse @ self.A[0, ..., :m, m:]
        ends = np.eye(follows.shape[-1])
        motion = np.concatenate([follows, np.broadcast_to(ends, (*follows.shape[:-2], *ends.shape))], axis=-2)
        slowness = np.einsum("dqij,dqij->dq", inverse, self.A[1, ..., :m, :m])
        return _Following(inverse, motion, motion.mT @ (self.A @ motion), slowness)

    def _following_by_kernel(self) -> tuple[_Following, int]:
        """The same by the kernel, and how many branches are missing, whose stiffness inside is not positive
        definite."""
        matrices, designs, q, n, _ = self.A.shape
        m, i = self.inside, n - self.inside
        found = _Following(
            np.empty((designs, q, m, m)),
            np.empty((designs, q, n, i)),
            np.empty((matrices, designs, q, i, i)),
            np.empty((designs, q)),
        )
        sizes, room = packed(designs, matrices, q, n, m), scratch(7 * n * n + 3 * n)
        return found, _follow(np.ascontiguousarray(self.A), sizes, room, *found)

    @property
    def inverse(self) -> Array:
        """Flexibility (designs, q, inside, inside) of the insides with the interfaces held."""
        return self._following.inverse

    @cached_property
    def slowest(self) -> Array:
        """At least 1/omega^2 (designs,) of the lowest frequency of any branch with its interface held: the sum over all
        of its frequencies."""
        return np.asarray(self.slowness.max(axis=1))

    @property
    def slowness(self) -> Array:
        """Sum (designs, q) over the frequencies of each kind of branch, its interface held, of 1/omega^2."""
        return self._following.slowness

    @property
    def motion(self) -> Array:
        """Static motion (designs, q, n, n - inside) of a branch for unit displacements of its interface."""
        return self._following.motion

    @property
    def followed(self) -> Array:
        """K, M and R (3, designs, q, n - inside, n - inside) of that motion."""
        return self._following.followed

    def take(self, designs: Index) -> Block:
        """The same for some of the designs."""
        T = self.T[designs] if self.T.ndim > FIXED_MAP_AXES else self.T
        return Block(self.A[:, designs], self.slack[:, designs], self.inside, T)

    @property
    def step(self) -> int:
        """Numbers from T of one design to that of the next; none where it is the same for all."""
        return self.T[0].size if self.T.ndim > FIXED_MAP_AXES and len(self.T) > 1 else 0

    @property
    def branches(self) -> NDArray[np.bool_]:
        """Which (q, r) there are."""
        return np.asarray((self.T != 0).any(axis=(-1, -2)).reshape(-1, *self.T.shape[-4:-2]).any(axis=0))


@dataclass(frozen=True)
class EndMatrices:
    """Designs over the ends of their chains: A (3, designs, n, n), which are K, M and R of the dynamic stiffness
    K - lambda M - lambda^2 R + ... (theory eq. N2), SI, with `slack` (3, designs, n) as that of a block.

    `slowness` (designs,) is at least 1/mu for all motions left out, `loss` (designs,) bounds the relative error in
    energy of chains.
    """

    A: Array
    slack: Array
    slowness: Array
    loss: Array

    def take(self, designs: Index) -> EndMatrices:
        """The same for some of the designs."""
        return EndMatrices(self.A[:, designs], self.slack[:, designs], self.slowness[designs], self.loss[designs])

    @property
    def K(self) -> Array:
        """Stiffness (designs, n, n)."""
        return self.A[0]

    @property
    def M(self) -> Array:
        """Mass (designs, n, n)."""
        return self.A[1]

    @property
    def R(self) -> Array:
        """What the motions left out add (designs, n, n)."""
        return self.A[2]


@dataclass(frozen=True)
class Arrow:
    """Designs as `blocks` of branches and what the core has by itself; `slow` is the slowness by kind of chain."""

    blocks: tuple[Block, ...]
    core: EndMatrices
    slow: Mapping[tuple[str, int], float]

    def take(self, designs: Index) -> Arrow:
        """The same for some of the designs."""
        if len(designs) == self.core.A.shape[1]:
            return self
        return Arrow(tuple(block.take(designs) for block in self.blocks), self.core.take(designs), self.slow)

    @cached_property
    def followed(self) -> tuple[Array, Array]:
        """K and M (designs, c, c) of the core with static motions of the branches."""
        A = self.core.A[:2].copy()
        for block in self.blocks:
            if is_compiled():
                _add_placed_by_kernel(block.followed[:2], block.T, A)
            else:
                A += placed(block.followed[:2], block.T)
        K, M = (A + A.mT) / 2
        return K, M

    @property
    def dense(self) -> EndMatrices:
        """All coordinates in one matrix: those inside the branches, in their own axes, then those of the core."""
        core = self.core
        designs, c = core.A.shape[1:3]
        inside = [int(block.branches.sum()) * block.inside for block in self.blocks]
        n = sum(inside) + c
        if n == c:
            return core
        A, slack = np.zeros((3, designs, n, n)), np.zeros((3, designs, n))
        A[..., -c:, -c:], slack[..., -c:] = core.A, core.slack
        first = 0
        for block in self.blocks:
            m = block.inside
            for q, r in np.argwhere(block.branches):
                branch, T, at = block.A[:, :, q], block.T[..., q, r, :, :], slice(first, first + m)
                A[..., at, at] = branch[..., :m, :m]
                A[..., at, -c:] = side = branch[..., :m, m:] @ T
                A[..., -c:, at] = side.mT
                A[..., -c:, -c:] += T.mT @ branch[..., m:, m:] @ T
                slack[..., at] = block.slack[:, :, q, :m]
                size = np.sqrt(abs(np.einsum("...ii->...i", branch)))
                error = PLACING_ROUNDING * branch.shape[-1]
                slack[..., at] = block.slack[:, :, q, :m] + error * size[..., :m] ** 2
                slack[..., -c:] += spread(block.slack[:, :, q, m:], T)
                slack[..., -c:] += error * np.einsum("...ij,...i->...j", abs(T), size[..., m:]) ** 2
                first += m
        return EndMatrices(A, slack, core.slowness, core.loss)


def spread(slack: Array, T: Array) -> Array:
    """Diagonal (..., c) that bounds T' diag(slack) T, from slack (..., n) and T (..., n, c), each of whose rows has the
    six coordinates of one root at most."""
    return np.asarray(6 * np.einsum("...ij,...i->...j", T * T, slack))


def placed(A: Array, T: Array) -> Array:
    """Sum (..., c, c) of A (..., q, i, i) over the branches placed by T (..., q, r, i, c)."""
    return np.asarray((T.mT @ A[..., None, :, :] @ T).sum(axis=(-4, -3)))


def _add_placed_by_kernel(A: Array, T: Array, C: Array) -> None:
    """Add the same of A (matrices, designs, q, i, i) to C (matrices, designs, c, c)."""
    matrices, designs, q, i, _ = A.shape
    r, c = T.shape[-3], T.shape[-1]
    step = T[0].size if T.ndim > FIXED_MAP_AXES and len(T) > 1 else 0
    sizes, room = packed(matrices, designs, q, r, i, c, step), scratch(i * i + (r + 1) * i * c + c * c)
    _place(np.ascontiguousarray(A), np.ascontiguousarray(T), sizes, room, C)
