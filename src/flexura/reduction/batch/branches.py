"""Branches of a mechanism: instances at top level that meet the rest in a few nodes, equal ones found.

The nodes of a plan fall into a core and the insides of branches, so that K and M are an arrow: the inside of a branch
meets the core alone. In axes of their own, branches of one prototype that are held and attached alike are equal,
however they are turned and mirrored.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.structure import Design, Plan

Copy = tuple[str, int]
"""A prototype, and the number among its copies."""


@dataclass
class Kind:
    """Branches that are equal in their own axes.

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
class Branches:
    """How the nodes that are used, by prototype, make up kinds of branches and a core.

    `core` (nodes, 6) numbers the `n_core` coordinates of roots in the core, -1 elsewhere; `core_copies` are the parts
    that belong to no branch.
    """

    kinds: list[Kind]
    core: Index
    n_core: int
    core_copies: list[Copy]


def find_branches(plan: Plan, used: Mapping[str, Index]) -> Branches:
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
    found: dict[tuple[object, ...], Kind] = {}
    instance = {path: n for own in topology.copies.values() for path, n in zip(own.paths, own.number, strict=True)}
    prototype = {path: name for name, own in topology.copies.items() for path in own.paths}
    for branch, copies in inside_of.items():
        if not is_inside[_roots(plan, used, copies)].any():
            top = [*top, *copies]
            continue
        place, meets, inside, nodes = _numbered(plan, used, copies, is_inside)
        relative = tuple((name, topology.copies[name].paths[k][1:]) for name, k in copies)
        pattern = tuple(own.tobytes() for own in (*place, *meets))
        like = found.setdefault(
            (prototype[(branch,)], relative, pattern),
            Kind([], copies, place, meets, inside, np.empty((0, len(nodes)), int)),
        )
        like.instances.append(instance[(branch,)])
        like.nodes = np.vstack([like.nodes, nodes])
    return Branches(list(found.values()), core, int(in_core.sum()), top)


def _roots(plan: Plan, used: Mapping[str, Index], copies: list[Copy]) -> Index:
    """Roots of the nodes used of some copies."""
    topology = plan.topology
    found = [topology.root[topology.copies[name].offset[k] + used[name]] for name, k in copies]
    return np.unique(np.concatenate(found)) if found else np.empty(0, dtype=np.intp)


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
    own = {branch: _roots(plan, used, copies) for branch, copies in inside_of.items()}
    for branch, roots in own.items():
        users[roots] += 1
        alone[roots] |= lies[roots] == number[branch]
    users[_roots(plan, used, top)] += 1
    is_inside = alone & (users == 1) & free.any(axis=1) & ~partly
    for roots in own.values():
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
    for root in dict.fromkeys(int(r) for own in numbers for r in topology.root[own] if is_inside[r]):
        local[root] = np.where(free[root], first + np.cumsum(free[root]) - 1, -1)
        first += int(free[root].sum())
    inside, nodes, met = first, [], {}
    place, meets = [], []
    for own in numbers:
        rows, flags = [], []
        for node in own.tolist():
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
    design: Design, name: str, which: list[int], nodes: Index, base: list[int], meets: NDArray[np.bool_]
) -> Array:
    """G (..., k, nodes, 6, 6): displacements of nodes of the copies `which` (k,) of a prototype, in its frame, from
    those of their roots in the axes of the instances `base` (k,); nodes that meet the core (k, nodes) stand for
    themselves."""
    topology, copies = design.plan.topology, design.plan.topology.copies[name]
    turning = design.geometry.turning
    own, onto = turning[..., [copies.number[k] for k in which], :, :], turning[..., base, :, :]
    turn = np.swapaxes(own, -1, -2) @ onto
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


def interface_maps(design: Design, kind: Kind, branches: Branches) -> Array:
    """T (..., branches, 6 i, c): displacements of the interface of each branch, in its axes, from coordinates of the
    core."""
    topology, geometry = design.plan.topology, design.geometry
    count, i = kind.nodes.shape
    node = kind.nodes.ravel()
    root = topology.root[node]
    arm = np.where(topology.is_rigid[node][:, None], geometry.at(node) - geometry.at(root), 0.0)
    onto = np.repeat(geometry.turning[..., kind.instances, :, :], i, axis=-3)
    D = np.swapaxes(onto, -1, -2) @ rigid_arm(arm)
    D[..., ~topology.has_position[node], :, :] = np.eye(6)
    out = np.zeros((*D.shape[:-2], branches.n_core + 1, 6))
    out[..., np.arange(len(node))[:, None], branches.core[root], :] = np.swapaxes(D, -1, -2)
    maps = np.swapaxes(out[..., :-1, :], -1, -2)
    return maps.reshape(*D.shape[:-3], count, 6 * i, branches.n_core)
