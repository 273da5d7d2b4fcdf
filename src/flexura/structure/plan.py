"""The plan of a mechanism: everything that depends on topology alone, ready to be evaluated for many designs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array, Index
from flexura.duals import Dual, moves, plain, with_slopes_of, zeros
from flexura.errors import ModelError, OptionError, Problem
from flexura.mechanism import (
    TOP,
    Affine,
    Composite,
    Layout,
    Mechanism,
    ParameterTable,
    matching,
    origin_of,
    problems,
    sheets,
    solid_members,
)
from flexura.records import Kept, Latest, Record
from flexura.results import Displayed
from flexura.structure.body_places import BodyPlaces, cannot_bend
from flexura.structure.children import Children
from flexura.structure.discrete_elements import Hold, described_hold
from flexura.structure.elastic_bodies import Bending, seat
from flexura.structure.elements import Elements
from flexura.structure.members import Members
from flexura.structure.part import Part, PartGeometry, settle_ends
from flexura.structure.roots import Roots
from flexura.structure.temperatures import Temperatures
from flexura.structure.topology import Geometry, Topology, Transforms
from flexura.structure.values import DeadLoads, DescribedMotion, DescribedPose, ValueTable, common, joined_along
from flexura.tables import Facts, Item


def one_design(parameters: Mapping[str, ArrayLike] | None) -> dict[str, float]:
    """Parameters of a single design as floats. Raises OptionError when there are arrays or no numbers."""
    single = {}
    if parameters is not None and not isinstance(parameters, Mapping):
        raise OptionError(f"parameters are given by name, as {{'width': 0.01}}; not as {parameters!r}")
    for name, value in (parameters or {}).items():
        if np.ndim(value):
            raise OptionError(f"one design is expected here, but parameter {name} has {np.size(value)} values")
        try:
            single[name] = float(np.asarray(value))
        except (TypeError, ValueError):
            raise OptionError(f"parameter {name}: {value!r} is not a number in SI") from None
    return single


def _refuse_unmeshed(layout: Layout) -> None:
    """Raise ModelError for members that are to be superelements of solid meshes, and composites, and are not yet."""
    refused, rule = [], "a solid member has to be reduced to a superelement first"
    for name, prototype in layout.prototypes.items():
        above = () if name == TOP else ("substructures", origin_of(name))
        for key in solid_members(layout.mechanism, name):
            kind = "links" if key in prototype.links else "flexures"
            hint = "flexura.with_solid_parts(mechanism)"
            refused.append(Problem((*above, kind, key, "fidelity"), "solid", rule, hint))
        for key in sheets(layout.mechanism, name):
            rule = "a sheet, of a flat spring or a diaphragm, has to be reduced to a superelement first"
            kind = "diaphragms" if key in prototype.diaphragms else "flat_springs"
            refused.append(Problem((*above, kind, key), "", rule, "flexura.with_solid_parts(mechanism)"))
        for key, body in prototype.bodies.items():
            if isinstance(body.solid, Composite) and body.solid.meshed is None:
                rule, hint = "a composite has to be meshed first", "flexura.with_solid_parts(mechanism)"
                refused.append(Problem((*above, "bodies", key, "solid"), "", rule, hint))
    if refused:
        raise ModelError(refused)


HANGS = "it hangs on another body by its own node or is clamped by a node, which says nothing of the face that is held"
FACE = "let both bodies carry a node on the face that they share, or give `held: {face: ...}`"


class Plan(Record, Displayed):
    """A mechanism laid out once: prototypes, instances, numbering; evaluated by pure functions of values.

    Raises ModelError with every problem of the description.
    """

    _shown = ("name",)

    def __init__(self, mechanism: Mechanism) -> None:
        if wrong := problems(mechanism):
            raise ModelError(wrong)
        self.mechanism = mechanism
        self.layout: Layout = Layout(mechanism)
        _refuse_unmeshed(self.layout)
        self.value_table: ValueTable = ValueTable()
        bending: dict[str, dict[str, Hold | None]] = {
            name: {key: described_hold(body) for key, body in prototype.bodies.items() if body.may_bend}
            for name, prototype in self.layout.prototypes.items()
        }
        self._describe(bending)
        self._children = {name: Children(children, self.value_table) for name, children in self.layout.children.items()}
        self.loads: DeadLoads = DeadLoads(self.layout, self.value_table)
        self.temperatures: Temperatures = Temperatures(self.layout, self.value_table)
        self.pose: DescribedPose = DescribedPose(self.layout, self.value_table)
        self.motion: DescribedMotion = DescribedMotion(self.layout, self.value_table)
        specialised = self.layout.specialised
        self._parameters = ParameterTable(mechanism, specialised.parameters, specialised.follows)
        self.value_table.close(self._parameters.defaults)
        self._lay_out()
        while any(bending.values()) and (left := self._bending()) != bending:
            bending = left
            self._describe(bending)
            self._lay_out()

    def _describe(self, bending: Mapping[str, Mapping[str, Hold | None]]) -> None:
        """The parts and members of all prototypes, of whose bodies those bend that are named."""
        seated: dict[str, set[str]] = {name: set() for name in bending}
        seats: dict[str, dict[str, str]] = {name: {} for name in bending}
        children = self.layout.children.items()
        within = {name: {child.name: child.prototype for child in own} for name, own in children}
        for name, prototype in self.layout.prototypes.items():
            exposed = self.layout.exposed(name)
            for node in (
                n for body in prototype.bodies.values() for text in body.carries for n in matching(text, exposed)
            ):
                *steps, own = node.split(".")
                source = name
                for step in steps:
                    source = within[source][step]
                if own in bending[source]:
                    seated[source].add(own)
                    seats[name][node] = seat(node)
        self.parts: dict[str, Part] = {
            name: Part(self.layout, name, self.value_table, Bending(own, frozenset(seated[name]), seats[name]))
            for name, own in bending.items()
        }
        members = [m for part in self.parts.values() for m in part.members.values()]
        driven = [is_driven for part in self.parts.values() for is_driven in part.driven]
        self.members: Members = Members(members, self.layout.mechanism, self.value_table, driven)

    def _lay_out(self) -> None:
        """Number everything, and settle what depends on the default parameters."""
        self.topology: Topology = Topology(self.layout, self.parts)
        self._levels = self._group_by_level()
        self._foreign = {name: self._foreign_sources(name) for name in self.parts}
        self._latest: Latest[Geometry] = Latest()
        self._turned: Latest[Array] = Latest()
        self.prepared: Kept = Kept()
        """What later steps have worked out from this plan alone, to be used again."""
        placements = [group.entries for children in self._children.values() for group in children.groups]
        self._geometry_entries: Index = np.intersect1d(
            np.concatenate([*placements, *(part.geometry_entries for part in self.parts.values())]),
            self.value_table.varying(),
        )
        """Entries with expressions on which positions, lengths and orientations depend."""
        rooted = {name: part.table.corrections.rooted for name, part in self.parts.items()}
        self.roots: Roots = Roots(self.parts, self.topology, self.members, rooted)
        self._settle_corrections()

    def _bending(self) -> dict[str, dict[str, Hold | None]]:
        """The bodies that bend, by prototype, of those that may, with how they are held; settles what pulls at them."""
        values = self.values()
        geometry = self.geometry(values)
        places = BodyPlaces(self.parts, self.members, geometry, values, self.elements(values, geometry))
        left: dict[str, dict[str, Hold | None]] = {}
        for name, part in self.parts.items():
            left[name] = {}
            for key, body in part.elastic.items():
                is_known, hold = places.hold(name, body)
                if not is_known and body.body.elastic is True:
                    raise ModelError([cannot_bend(name, key, HANGS, FACE)])
                if is_known and (places.settle(name, body) or body.body.elastic is True):
                    left[name][key] = hold
        return left

    def elements(self, values: Array, geometry: Geometry) -> Elements:
        """The elements of all prototypes in one table, for values (..., s)."""
        roots = self.roots.of(values, geometry), self.roots.fillets(values, geometry)
        return self.members.elements(values, geometry.lengths, *roots)

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.mechanism.name

    def presentation(self) -> Iterator[Item]:
        copies = self.topology.copies
        members = sum(len(part.members) * len(copies[name].paths) for name, part in self.parts.items())
        counts = {"nodes": self.topology.n_nodes, "free DOFs": self.topology.n_dof, "members": members}
        yield Facts({**counts, "bodies": len(self.body_names), "parameters": ", ".join(self.parameter_values())})

    @property
    def body_names(self) -> list[str]:
        """Bodies of all instances, by the names of their nodes."""
        copies = self.topology.copies.values()
        return [".".join((*path, key)) for own in copies for path in own.paths for key in own.part.bodies]

    @property
    def moving_bodies(self) -> list[str]:
        """Those of them that the ground does not hold."""
        topology = self.topology
        return [name for name in self.body_names if not topology.grounded[topology.numbers([name])].any()]

    @property
    def is_loaded(self) -> bool:
        """Whether loads or gravity are described, about whose state stiffness then is."""
        return self.loads.any

    @property
    def is_posed(self) -> bool:
        """Whether a pose away from rest is described, about which everything linear then is."""
        return self.pose.any

    def at_rest(self) -> Plan:
        """The plan without the pose that is described."""
        return (
            self.prepared.once("at rest", lambda: Plan(self.mechanism.replaced({"at": {}}))) if self.is_posed else self
        )

    def refuse_loads(self, what: str, values: Array | None = None) -> None:
        """Raise OptionError where `what` takes no account of loads, gravity and a pose that are described; loads that
        are zero at values (..., s), if they are given, are none."""
        self.refuse_pose(what)
        if self.is_loaded and (values is None or self.loads.act(values)):
            raise OptionError(f"{what}: not under the loads and gravity that are described; take these out for it")

    def refuse_pose(self, what: str) -> None:
        """Raise OptionError where `what` knows the mechanism at rest alone, and a pose away from it is described."""
        if self.is_posed:
            raise OptionError(
                f"{what}: of the undeformed mechanism alone, not at the pose that is described; take `at` out for it"
            )

    @cached_property
    def roots_left_out(self) -> Roots:
        """The roots that corrections leave out of the model, though nothing says that they are rigid."""
        unrooted = {name: part.table.corrections.unrooted for name, part in self.parts.items()}
        roots = Roots(self.parts, self.topology, self.members, unrooted)
        values = self.values()
        roots.settle(values, self.geometry(values))
        return roots

    def _settle_corrections(self) -> None:
        """Work out how far ends are clamped at the default parameters, where a correction asks for it."""
        if not self.members.corrections.wanted.any():
            return
        values = self.values()
        geometry = self.geometry(values)
        settled = [settle_ends(self.layout, p, values, geometry.parts[name]) for name, p in self.parts.items()]
        self.roots.settle(values, geometry)
        is_described = [[m.ends is not None] for part in self.parts.values() for m in part.members.values()]
        held = np.where(is_described, 0.0, self.roots.held)
        clamped = np.maximum(np.concatenate(settled), held)
        has_root = np.isin(np.arange(len(self.members.counts)), self.roots.members)
        first = np.cumsum([len(part.members) for part in self.parts.values()])[:-1]
        split = zip(np.split(clamped, first), np.split(has_root, first), strict=True)
        tables = [self.members, *(part.table for part in self.parts.values())]
        for table, (ends, rooted) in zip(tables, [(clamped, has_root), *split], strict=True):
            table.corrections.settle(ends, rooted)
        start = 0
        for part in self.parts.values():
            stop, first = start + len(part.connectivity), self.members.first
            part.strips = []
            for group, n, own in self.members.corrections.coupled:
                elements = first[group.index[own]][:, None] + np.arange(n) - start
                elements = elements[(elements[:, 0] >= 0) & (elements[:, 0] < stop - start)]
                if len(elements):
                    nodes = part.connectivity[elements, 0], part.connectivity[elements[:, -1:], 1]
                    part.strips.append(np.concatenate(nodes, axis=1))
            start = stop

    def _group_by_level(self) -> list[tuple[str, int, Index, Index, Index]]:
        """Instances grouped as (parent prototype, group of alike children, instances, their parents, their places in
        the group), parents first."""
        prototypes = dict(self.layout.instances())
        groups: dict[tuple[int, str, int], list[tuple[int, int]]] = {}
        for instance, path in enumerate(prototypes):
            if path:
                name = prototypes[path[:-1]]
                group, place = self._children[name].place[path[-1]]
                groups.setdefault((len(path), name, group), []).append((instance, place))
        parent = np.array(self.topology.parent)
        levels = []
        for (_, name, group), own in sorted(groups.items(), key=lambda item: item[0][0]):
            instances, places = np.array(own).T
            levels.append((name, group, instances, parent[instances], places))
        return levels

    def _foreign_sources(self, name: str) -> list[tuple[list[str], str, str]]:
        """For each foreign node of a prototype: the children that lead to it, and its prototype and name there."""
        sources = []
        for reference in self.parts[name].foreign:
            *steps, node = reference.split(".")
            source = name
            for step in steps:
                source = self._children[source].prototype[step]
            sources.append((steps, source, node))
        return sources

    def values(self, parameters: Mapping[str, ArrayLike] | None = None) -> Array:
        """Values (s,), or (designs, s) when a parameter is given as an array over designs.

        Raises OptionError for unknown parameters and values outside their bounds.
        """
        resolved, changed = self._parameters(parameters or {})
        designs = {int(np.shape(resolved[name])[0]) for name in changed if np.ndim(resolved[name])}
        return self.value_table.fill(resolved, changed, designs.pop() if designs else None)

    def parameter_values(self, parameters: Mapping[str, ArrayLike] | None = None) -> dict[str, Any]:
        """Values of all parameters in SI, with some replaced. Raises OptionError as `values` does."""
        values = self.scoped_values(parameters)
        return {name: values[name] for name in self.mechanism.parameters}

    def scoped_values(self, parameters: Mapping[str, ArrayLike] | None = None) -> dict[str, Any]:
        """As `parameter_values`, with the parameters that instances have for themselves: what prototypes depend on."""
        return self._parameters(parameters or {})[0]

    def verify(self, parameters: Mapping[str, ArrayLike]) -> None:
        """Raise ModelError with everything that replacing these parameters breaks in the description, one design."""
        resolved, changed = self._parameters(parameters)
        if changed:
            replaced = {
                name: p.replaced({"value": float(plain(resolved[name])), "minimum": None, "maximum": None})
                for name, p in self.mechanism.parameters.items()
            }
            if broken := problems(self.mechanism.replaced({"parameters": replaced, "studies": {}})):
                named = ", ".join(f"{name} = {resolved[name]:g}" for name in sorted(changed))
                raise ModelError(replace(problem, hint=f"with {named}") for problem in broken)

    def placing(self, parameters: Mapping[str, ArrayLike]) -> Index:
        """Entries on which positions, lengths or orientations depend, and which depend on any of these parameters."""
        return np.intersect1d(self._geometry_entries, self.value_table.depending(self._parameters(parameters)[1]))

    @cached_property
    def _sizes(self) -> Index:
        """Entries that vary and place nothing, and are positive by default."""
        sizes = np.setdiff1d(self.value_table.varying(), self._geometry_entries)
        return sizes[self.values()[sizes] > 0]

    @cached_property
    def _fitting(self) -> tuple[Index, Array]:
        """Entries with which contours may stop fitting their members, and their default values, with which all fit."""
        groups = [group for part in self.parts.values() for group, _, _ in part.table.groups]
        entries = [at for group in groups for at in group.fitting]
        found = np.union1d(self._geometry_entries, np.concatenate(entries)) if entries else np.empty(0, dtype=np.intp)
        return found, self.values()[found]

    def turned(self, values: Array) -> Index:
        """Designs, of values (designs, s), with a size, no coordinate, that has gone through zero, or with a contour
        that does not fit its member."""
        bad: Any = (values.take(self._sizes, axis=1) <= 0).any(axis=1)
        entries, fitting = self._fitting
        if (values.take(entries, axis=1) == fitting).all():
            return bad.nonzero()[0]
        geometry = self.geometry(values)
        for name, part in self.parts.items():
            for group, _, _ in part.table.groups:
                if group.fitting:
                    length = geometry.parts[name].length
                    bad |= ~group.fits(values, length[..., group.index]).all(axis=-1)
        return np.flatnonzero(bad)

    def geometry(self, values: Array) -> Geometry:
        """Geometry for values; remembered while the numbers that it depends on stay the same.

        What does not vary along the design axis lacks it.
        """
        varying: Any = values[..., self._geometry_entries]
        if isinstance(values, Dual):
            return self._compute_geometry(values) if moves(varying) else self.geometry(values.value)
        if varying.ndim > 1 and (len(varying) == 1 or (varying == varying[0]).all()):
            values, varying = values[0], varying[0]
        key = varying.tobytes() + str(varying.shape).encode()
        return self._latest.get(key, lambda: self._compute_geometry(values))

    def _compute_geometry(self, values: Array) -> Geometry:
        affines = {
            name: [group.affine(values) for group in children.groups] for name, children in self._children.items()
        }
        parts: dict[str, PartGeometry] = {}
        for name, part in self.parts.items():
            foreign = [np.empty((0, 3), like=values)]
            for steps, source, node in self._foreign[name]:
                at = self.parts[source].node_number[node]
                foreign.append(self._outward(name, steps, affines, parts[source].positions[..., at : at + 1, :]))
            parts[name] = part.geometry(values, common(joined_along(foreign, -2), 2))
        Q, t = self._placed(values, affines)
        return Geometry(parts, Transforms(self.parts, parts), Q, t, self.topology)

    def _placed(self, values: Array, affines: dict[str, list[Affine]]) -> tuple[Array, Array]:
        """Q (..., i, 3, 3) and t (..., i, 3) of all instances; Q has slopes where it turns."""
        count, used = len(self.topology.parent), [affines[name][group] for name, group, *_ in self._levels]
        if not any(moves(step.Q) for step in used):
            used = [step._replace(Q=plain(step.Q)) for step in used]
        turned = np.broadcast_shapes((), *(step.Q.shape[:-3] for step in used))
        moved = np.broadcast_shapes(turned, *(step.t.shape[:-2] for step in used))
        Q, t = zeros((*turned, count, 3, 3), *(step.Q for step in used)), np.empty((*moved, count, 3), like=values)
        Q[..., 0, :, :], t[..., 0, :] = np.eye(3), 0.0
        for step, (_, _, instances, parents, places) in zip(used, self._levels, strict=True):
            Q[..., instances, :, :] = Q[..., parents, :, :] @ step.Q[..., places, :, :]
            arm = np.einsum("...nij,...nj->...ni", Q[..., parents, :, :], step.t[..., places, :])
            t[..., instances, :] = arm + t[..., parents, :]
        if not turned and with_slopes_of(Q) is None:
            Q = self._turned.get(Q.tobytes(), lambda: Q)  # one object while nothing turns
        return Q, t

    def _outward(self, name: str, steps: list[str], affines: dict[str, list[Affine]], x: Array) -> Array:
        """Carry points out of a nested instance into the prototype `name`."""
        if not steps:
            return x
        first, *others = steps
        children = self._children[name]
        x = self._outward(children.prototype[first], others, affines, x)
        return children.placement(first, affines[name]).points(x)
