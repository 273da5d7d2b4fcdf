"""What is wrong with a description that no single part of it can see.

Checks of values that instances have of their own, and of the parts with these values.

Checks of studies: the parameters that vary exist, their ranges hold something, and their bounds are kept.

Checks of inertia tensors, spring matrices and of joints that lie apart.

Check that all parts hang together, prototype by prototype, so that thousands of copies cost little.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from flexura.errors import Path, Problem
from flexura.expressions import Expression
from flexura.mechanism.checks.assembly import check_assembly
from flexura.mechanism.checks.members import check_members
from flexura.mechanism.checks.references import check_not_empty, check_references
from flexura.mechanism.checks.survey import Survey, prefix, shown, suggestion
from flexura.mechanism.checks.values import Known, check_values, defaults, invalid_at, outside_bounds
from flexura.mechanism.evaluation import evaluated
from flexura.mechanism.layout import TOP, Layout
from flexura.mechanism.parameters import Parameter
from flexura.mechanism.placement import copies
from flexura.mechanism.positions import Point, node_positions
from flexura.mechanism.studies import Range, Spread
from flexura.mechanism.substructure import Instance, Mechanism, Substructure


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
        interface = set(survey.layout.interface(name)) if name != TOP else set()
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
    own = layout.own_nodes(name)
    groups = _Groups(dict.fromkeys([*own, *layout.exposed(name)]))
    size = dict.fromkeys(own, 1)
    used = dict.fromkeys(layout.prototypes[name].bodies, True)
    for child in layout.children[name]:
        for island in open_[child.prototype]:
            inside = set(island.nodes)
            nodes = [f"{child.name}.{n}" for n in layout.interface(child.prototype) if n in inside]
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
    return (*here, "instances", head) if head else here


RELATIVE = 1e-9
SINGULAR = 1e-12
JOINT_DISTANCE = 1e-9
"""Distance in m within which joined nodes are at one place, besides 1e-6 of the size of the mechanism."""


def check_bodies(survey: Survey) -> None:
    """Report inertia tensors and spring matrices that are impossible, and joints that gape."""
    for name, prototype in survey.layout.prototypes.items():
        path = prefix(name)
        for kind in ("bodies", "masses"):
            for key, part in getattr(prototype, kind).items():
                if part.inertia is not None:
                    _inertia(survey, (*path, kind, key, "inertia"), part.inertia)
        for key, spring in prototype.springs.items():
            if spring.matrix is not None:
                _stiffness(survey, (*path, "springs", key, "matrix"), np.array(spring.matrix))
        _joints(survey, name, prototype)


def _inertia(survey: Survey, path: Path, entries: tuple[float, ...]) -> None:
    if not np.isfinite(entries).all():
        return
    largest = max(map(abs, entries)) or 1.0
    xx, yy, zz, xy, xz, yz = (entry / largest for entry in (*entries, 0.0, 0.0, 0.0)[:6])
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    low, middle, high = (largest * np.linalg.eigvalsh(tensor)).tolist()
    moments = f"principal moments {shown(low)}, {shown(middle)}, {shown(high)} kg*m^2"
    if low <= SINGULAR * abs(high):
        survey.report(path, moments, "an inertia tensor is positive definite", _ORDER)
    elif low + middle < high * (1 - RELATIVE):
        rule = "no principal moment of inertia is larger than the sum of the other two"
        survey.report(path, moments, rule, _ORDER)


_ORDER = "the entries are Ixx, Iyy, Izz and then the tensor's Ixy, Ixz, Iyz (minus the products of inertia)"


def _stiffness(survey: Survey, path: Path, K: NDArray[np.float64]) -> None:
    if not np.isfinite(K).all():
        return
    scale = np.sqrt(np.abs(np.diag(K)))
    unit = np.outer(scale, scale)
    i, j = np.unravel_index(np.argmax(np.abs(K - K.T) - RELATIVE * unit), K.shape)
    if abs(K[i, j] - K[j, i]) > RELATIVE * max(unit[i, j], abs(K[i, j])):
        rule = f"the matrix of a spring is symmetric; entries ({i + 1}, {j + 1}) and ({j + 1}, {i + 1}) differ"
        survey.report(path, f"{K[i, j]:g} and {K[j, i]:g}", rule)
        return
    scaled = np.divide(K, unit, out=np.zeros((6, 6)), where=unit > 0)
    impossible = np.diag(K).min() < 0 or K[unit == 0].any()
    if impossible or np.linalg.eigvalsh(scaled).min() < -RELATIVE:
        hint = "no motion of the spring may release energy"
        survey.report(path, "", "the matrix of a spring has no negative eigenvalue", hint)


def _joints(survey: Survey, name: str, prototype: Substructure) -> None:
    positions = survey.positions[name]
    for i, (a, b) in enumerate(prototype.joints):
        if a in positions and b in positions:
            distance = math.dist(positions[a], positions[b])
            if distance > JOINT_DISTANCE + 1e-6 * survey.size:
                survey.report(
                    (*prefix(name), "joints", i),
                    f"{a}, {b}",
                    f"joined nodes are at one place; these are {shown(distance * 1e3)} mm apart",
                    "a rigid body carries nodes on arms: let one carry both",
                )


def check_studies(mechanism: Mechanism, values: Known, ignored: Collection[str]) -> list[Problem]:
    """What is wrong with the studies of a mechanism at the default values of its parameters."""
    found: list[Problem] = []
    for name, study in mechanism.studies.items():
        for key, varied in study.own.vary.items():
            path = ("studies", name, study.kind, "vary", key)
            parameter = mechanism.parameters.get(key)
            if parameter is None:
                if key not in ignored:
                    hint = suggestion(key, mechanism.parameters, "parameters")
                    found.append(Problem(path, key, "there is no such parameter", hint))
                continue
            own = evaluated(varied, values) if isinstance(varied, Range | Spread) else varied
            bounded = evaluated(parameter, values)
            if isinstance(own, Range):
                found += _range(path, own, bounded)
            elif isinstance(own, Spread):
                found += _spread(path, own, bounded)
            else:
                numbers = [float(x.evaluate(values)) if isinstance(x, Expression) else float(x) for x in own]
                found += [p for i, x in enumerate(numbers) for p in _outside((*path, i), x, bounded)]
    return found


def _range(path: Path, own: Range, parameter: Parameter) -> Iterator[Problem]:
    ends = {"from": own.from_, "to": own.to}
    bounds = {"from": parameter.minimum, "to": parameter.maximum}
    for key, end in ends.items():
        if end is None and bounds[key] is None:
            side = "minimum" if key == "from" else "maximum"
            yield Problem(path, "", f"the range has no {key}, and the parameter no {side}", "e.g. {from: ..., to: ...}")
        elif isinstance(end, float):
            yield from _outside((*path, key), end, parameter)
    low, high = (bounds[key] if end is None else end for key, end in ends.items())
    if isinstance(low, float) and isinstance(high, float):
        if low >= high:
            rule = f"there is nothing between {shown(low)} and {shown(high)}"
            yield Problem(path, "", rule, "a range goes from the smaller value to the larger one")
        elif own.scale == "log" and low <= 0:
            yield Problem(path, shown(low), "a range with equal ratios has positive ends", "write scale: linear")
        elif own.integer and math.ceil(low) > math.floor(high):
            yield Problem(path, "", f"there is no whole number between {shown(low)} and {shown(high)}")


def _spread(path: Path, own: Spread, parameter: Parameter) -> Iterator[Problem]:
    """Deviations move with the value of the parameter: how far they reach is a question when the study is asked."""
    for i, value in enumerate(own.measured or ()):
        if isinstance(value, float):
            yield from _outside((*path, "measured", i), value, parameter)


def _outside(path: Path, value: float, parameter: Parameter) -> Iterator[Problem]:
    """The problem of a value that the bounds of the parameter leave out."""
    low, high = parameter.minimum, parameter.maximum
    unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
    if isinstance(low, float) and value < low:
        yield Problem(path, f"{value:g}{unit}", f"this is below the minimum {low:g}{unit} of the parameter")
    elif isinstance(high, float) and value > high:
        yield Problem(path, f"{value:g}{unit}", f"this is above the maximum {high:g}{unit} of the parameter")


def check_own_values(layout: Layout, values: Known, ignored: Collection[str]) -> list[Problem]:
    """What is wrong with values that instances have of their own; these are added to the values of parameters."""
    described = layout.specialised.mechanism
    found = [
        problem
        for name, part in {"": described, **described.substructures}.items()
        for key, instance in part.instances.items()
        for problem in _of_instance(layout, (*prefix(name), "instances", key), instance, ignored)
    ]
    own = layout.specialised.parameters
    known, _ = defaults({**layout.mechanism.parameters, **own})
    for name in own:
        if name in known:
            values[name] = known[name]
            for problem in outside_bounds(name, own[name], known):
                found.append(Problem(layout.specialised.places[name], problem.value, problem.rule, problem.hint))
    for name, part in layout.specialised.substructures.items():
        found += invalid_at(part, prefix(name), values)
    return found


def _of_instance(layout: Layout, path: Path, instance: Instance, ignored: Collection[str]) -> Iterator[Problem]:
    names = [copy for copy, _ in copies(str(path[-1]), instance)] if instance.copies else []
    for copy in instance.copies:
        if copy not in names:
            hint = suggestion(copy, names, "copies")
            yield Problem((*path, "copies", copy), copy, "there is no such copy", hint)
    depends = layout.specialised.depends(instance.of)
    groups = {(*path, "with"): instance.with_, **{(*path, "copies", c): own for c, own in instance.copies.items()}}
    for place, own in groups.items():
        for name in own:
            if name in ignored:
                continue
            if name not in layout.mechanism.parameters:
                hint = suggestion(name, layout.mechanism.parameters, "parameters")
                yield Problem((*place, name), name, "there is no such parameter", hint)
            elif name not in depends:
                hint = suggestion(name, sorted(depends), "parameters that it depends on")
                yield Problem((*place, name), name, f"the substructure {instance.of} does not depend on it", hint)


def problems(mechanism: Mechanism, *, ignore_missing: Collection[str] = (), partial: bool = False) -> list[Problem]:
    """Everything wrong with the mechanism as a whole, at the default values of its parameters.

    Names in `ignore_missing` are known to be missing, so that references to them are no news. With `partial`
    some of the description is absent: nothing is said about unused nodes, patterns without a match and
    disconnected parts.
    """
    values, found = check_values(mechanism, ignore_missing)
    found += check_studies(mechanism, values, ignore_missing)
    layout, lost, more = check_assembly(mechanism, ignore_missing)
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
        check_bodies(survey)
    if not partial:
        check_not_empty(survey)
    if sound:
        check_connection(survey)
    return list(dict.fromkeys([*found, *survey.problems]))


def _size(positions: dict[str, dict[str, Point]]) -> float:
    """Diagonal of the largest prototype, m."""
    largest = 0.0
    for nodes in positions.values():
        points = np.array([p for p in nodes.values() if all(map(math.isfinite, p))])
        if len(points):
            largest = max(largest, float(np.linalg.norm(np.ptp(points, axis=0))))
    return largest if math.isfinite(largest) else 0.0
