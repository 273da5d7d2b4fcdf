"""What is wrong with a description that no single part of it can see.

That all parts hang together is checked here, prototype by prototype, so that thousands of copies cost little.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from flexura.errors import Path, Problem
from flexura.mechanism.checks.geometry import check_bodies, check_diaphragms, check_flat_springs, check_members
from flexura.mechanism.checks.references import check_not_empty, check_parts, check_references
from flexura.mechanism.checks.survey import Survey, check_assembly, prefix
from flexura.mechanism.checks.values import check_own_values, check_studies, check_values
from flexura.mechanism.description import Mechanism, with_parts_placed
from flexura.mechanism.layout import TOP, Point, node_positions


@dataclass(eq=False)
class _Island:
    """Nodes of a prototype that hang together: how many in all, and those exposed in it, in order."""

    prototype: str
    nodes: list[str]
    size: int
    used: bool
    copies: int = 1


class _Groups:
    """Disjoint sets of names."""

    def __init__(self, names: Iterable[str]) -> None:
        self.parent = {name: name for name in names}

    def root(self, name: str) -> str:
        parent = self.parent
        while parent[name] != name:
            parent[name] = parent[parent[name]]
            name = parent[name]
        return name

    def join(self, names: Iterable[str]) -> None:
        for a, b in pairwise(names):
            self.parent[self.root(a)] = self.root(b)


def check_connection(survey: Survey) -> None:
    """Report nodes that nothing uses, and parts that are not connected to the largest one."""
    sealed: list[_Island] = []
    open_: dict[str, list[_Island]] = {}
    placed = _times_placed(survey)
    for name in survey.layout.prototypes:
        if name not in placed:
            continue
        islands = _islands(survey, name, open_)
        interface = set(survey.layout.prototypes[name].interface) if name != TOP else set()
        open_[name] = [island for island in islands if interface.intersection(island.nodes)]
        for island in islands:
            if not interface.intersection(island.nodes):
                island.copies = placed[name]
                sealed.append(island)
    _report_unused(survey, [island for island in sealed if not island.used])
    _report_disconnected(survey, [island for island in sealed if island.used])


def _times_placed(survey: Survey) -> dict[str, int]:
    placed = {TOP: 1}
    for name in reversed(list(survey.layout.prototypes)):
        for child in survey.layout.children[name] if name in placed else ():
            placed[child.prototype] = placed.get(child.prototype, 0) + placed[name]
    return placed


def _islands(survey: Survey, name: str, open_: dict[str, list[_Island]]) -> list[_Island]:
    layout = survey.layout
    declared = layout.own_nodes(name)
    groups = _Groups(dict.fromkeys([*declared, *layout.exposed(name)]))
    size = dict.fromkeys(declared, 1)
    used = dict.fromkeys(layout.prototypes[name].bodies, True)
    for child in layout.children[name]:
        for island in open_[child.prototype]:
            inside = set(island.nodes)
            nodes = [f"{child.name}.{n}" for n in layout.prototypes[child.prototype].interface if n in inside]
            groups.join(nodes)
            size[nodes[0]] = size.get(nodes[0], 0) + island.size
            if island.used:
                used[nodes[0]] = True
    for use in survey.uses[name]:
        used.update(dict.fromkeys(use.nodes, True))
        if use.joins:
            groups.join(use.nodes)
    gathered: dict[str, list[str]] = {}
    for node in groups.parent:
        gathered.setdefault(groups.root(node), []).append(node)
    return [
        _Island(name, nodes, sum(size.get(n, 0) for n in nodes), any(n in used for n in nodes))
        for nodes in gathered.values()
    ]


def _by_place(survey: Survey, islands: list[_Island]) -> dict[Path, list[_Island]]:
    """Islands by where they come from: the copies of one instance share a place."""
    places: dict[Path, list[_Island]] = {}
    for island in islands:
        places.setdefault(_path(survey, island, island.nodes[0]), []).append(island)
    return places


def _report_unused(survey: Survey, islands: list[_Island]) -> None:
    for path, alike in _by_place(survey, islands).items():
        node, count = alike[0].nodes[0], len(alike)
        rule = f"the node {node} is used by nothing" + (f", and {count - 1} more like it" if count > 1 else "")
        survey.report(path, "", rule, "remove it, or tie it to a member, a body or a joint")


def _report_disconnected(survey: Survey, islands: list[_Island]) -> None:
    if not islands:
        return
    largest = max(islands, key=lambda island: island.size)
    others = [island for island in islands if island is not largest or island.copies > 1]
    for path, alike in _by_place(survey, others).items():
        island = alike[0]
        copies = sum(each.copies for each in alike)
        times = f", and {copies - 1} more like them" if copies > 1 else ""
        rule = f"disconnected parts: these nodes are not connected to {largest.nodes[0]}{times}"
        if largest in alike:
            rule = f"disconnected parts: {copies} copies of these nodes are not connected to each other"
        prototype = survey.layout.prototypes[island.prototype]
        hint = "add the joint, member or body that is missing"
        if island.prototype != TOP and not prototype.interface:
            hint = "give the substructure an interface, and join it to the others"
        shown = ", ".join(island.nodes[:4]) + (", ..." if len(island.nodes) > 4 else "")
        survey.report(path, shown, rule, hint)


def _path(survey: Survey, island: _Island, node: str) -> Path:
    """Where a node comes from: its own entry, its body's, or that of the instance it belongs to."""
    prototype = survey.layout.prototypes[island.prototype]
    here = prefix(island.prototype)
    for kind, entries in (("nodes", prototype.nodes), ("bodies", prototype.bodies)):
        if node in entries:
            return (*here, kind, node)
    head = node.partition(".")[0]
    while head and head not in prototype.instances:
        head = head[:-1]
    if not head:
        return here
    return (*here, "instances", head)


def problems(mechanism: Mechanism, *, ignore_missing: Collection[str] = (), partial: bool = False) -> list[Problem]:
    """Everything wrong with the mechanism as a whole, at the default values of its parameters.

    Names in `ignore_missing` are known to be missing, so that references to them are no news. With `partial`
    some of the description is absent: nothing is said about unused nodes, patterns without a match and
    disconnected parts.
    """
    values, found = check_values(mechanism, ignore_missing)
    found += check_studies(mechanism, values, ignore_missing)
    found += check_parts(mechanism, ignore_missing)
    layout, lost, more = check_assembly(with_parts_placed(mechanism), ignore_missing)
    found += more
    if layout is None:
        return found
    found += check_own_values(layout, values, ignore_missing)
    layout.evaluate(values)
    survey = Survey(layout, lost, ignore_missing, partial)
    check_references(survey)
    sound = not survey.problems and not any(lost.values()) and not partial
    with np.errstate(all="ignore"):
        survey.positions = node_positions(layout, values)
        survey.size = _size(survey.positions)
        check_members(survey)
        check_diaphragms(survey)
        check_flat_springs(survey)
        check_bodies(survey)
    if not partial:
        check_not_empty(survey)
    if sound:
        check_connection(survey)
    found += [replace(problem, path=_of_part(mechanism, problem.path)) for problem in survey.problems]
    return list(dict.fromkeys(found))


def _of_part(mechanism: Mechanism, path: Path) -> Path:
    """A path as it is described, where instances stand for parts."""
    holder, inside = (mechanism.substructures[str(path[1])], 2) if _is_in(mechanism, path) else (mechanism, 0)
    kind, key = (*path[inside:], None, None)[:2]
    if kind == "instances" and key in holder.parts and key not in holder.instances:
        return (*path[:inside], "parts", *path[inside + 1 :])
    return path


def _is_in(mechanism: Mechanism, path: Path) -> bool:
    return len(path) > 1 and path[0] == "substructures" and path[1] in mechanism.substructures


def _size(positions: dict[str, dict[str, Point]]) -> float:
    """Diagonal of the largest prototype, m."""
    largest = 0.0
    for nodes in positions.values():
        points = np.array([p for p in nodes.values() if all(map(math.isfinite, p))])
        if len(points):
            largest = max(largest, float(np.linalg.norm(np.ptp(points, axis=0))))
    return largest if math.isfinite(largest) else 0.0
