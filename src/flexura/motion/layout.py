"""Elements of all copies of all parts, laid out between frames in global axes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from flexura.arrays import Array, Index
from flexura.duals import plain, zeros
from flexura.mechanism import ForceActuator, MomentActuator, StrainActuator
from flexura.motion.bars import Bars, Push
from flexura.motion.diaphragms import BentRings
from flexura.motion.elements import Ends, Frames, Group, PoseElements
from flexura.motion.stops import Stops
from flexura.motion.strain import Strain, beam_strain, linear_strain, natural_stiffness
from flexura.motion.superelements import Sagging, Superelements
from flexura.structure import Copies, Design, DiscreteElement, Distortion, Part, Plan, SpringElement

Named = tuple[Group, tuple[str, ...]]
"""Elements with the name of each."""

PLAIN = Distortion.even(np.zeros(1, dtype=np.intp), 0)
"""How a uniform bar twists without corrections."""

STACK, STACKED_ELEMENTS = 32, 2048
"""Designs that are laid out at once, and elements of these, all together, up to which they are so many."""

MIRRORED = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])
"""Signs of displacements along and about axes that are made right-handed again by turning the third one round."""


@dataclass(frozen=True)
class Laid:
    """A mechanism laid out: frames and what lies between them.

    `rest` are the frames at rest, one for every node and a last one for the ground; `dof` (n + 1, 6) numbers the free
    displacements, -1 where held and where a node follows another one. `inertia` (n + 1, 6, 6) is the mass that frames
    carry, in their own axes; `sagging` is the weight of the amplitudes of superelements.
    """

    design: Design
    rest: Frames
    dof: Index
    elements: tuple[Group, ...]
    names: tuple[tuple[str, ...], ...]
    inertia: Array
    sagging: Sagging
    actuators: Mapping[str, int]
    """Numbers of the elements that are actuators, piezo stacks and those between two nodes, by name as placed."""
    dashpots: tuple[PoseElements, ...]
    """Dashpots, with damping in place of stiffness."""
    arm: Array = field(repr=False)
    """From the frame that a node follows to the node (n + 1, 3), m, at rest."""

    @cached_property
    def root(self) -> Index:
        """The frame (n + 1,) that each node follows."""
        return np.append(self.design.plan.topology.root, len(self.dof) - 1)

    @cached_property
    def weight(self) -> Array:
        """Forces (n + 1, 6, 3) on the frames, in their own axes, per acceleration of free fall, of elements too."""
        weight = zeros((*self.inertia.shape[:-1], 3), self.inertia, self.rest.x)
        weight[...] = self.inertia[..., :3]
        for elements in self.elements:
            M = elements.masses(self.rest)
            falling = self.rest.placed[elements.node]
            M = M.reshape(*M.shape[:2], -1, 6)[..., :3]
            force = np.einsum("eikj,ek->eij", M, falling).reshape(*elements.node.shape, 6, 3)
            np.add.at(weight, elements.node.ravel(), (force * falling[..., None, None]).reshape(-1, 6, 3))
        return weight


def laid_out(design: Design) -> Laid:
    """All that moves in a design. Raises OptionError for what cannot turn yet."""
    return _Builder(design).laid()


def stack_size(plan: Plan) -> int:
    """So many designs of a plan are well laid out together."""
    elements = sum(len(own.part.connectivity) * len(own.paths) for own in plan.topology.copies.values())
    return max(min(STACK, STACKED_ELEMENTS // max(elements, 1)), 1)


def laid_out_together(stack: Design) -> Iterator[Laid]:
    """All that moves in the designs of a stack, one after another, each the same as by itself."""
    count, discrete = len(stack.values), stack.discrete_elements
    for k, beams in enumerate(_Builder(stack, None, discrete).beams(count)):
        own = {name: [element.one(k) for element in elements] for name, elements in discrete.items()}
        yield _Builder(stack.one(k), beams, own).laid()


class _Builder:
    """Lays out the elements of all copies of all parts in global axes; those of a stack of designs one design after
    another, as if they were one mechanism."""

    def __init__(
        self, design: Design, beams: Named | None = None, discrete: Mapping[str, list[DiscreteElement]] | None = None
    ) -> None:
        self.design = design
        self.known: Named | None = beams
        self.discrete: Mapping[str, list[DiscreteElement]] = (
            {name: own.discrete_elements for name, own in design.matrices.items()} if discrete is None else discrete
        )
        self.lead: tuple[int, ...] = design.values.shape[:-1]
        topology, geometry = design.plan.topology, design.geometry
        n, count = topology.n_nodes, math.prod(self.lead)
        self.ground = n
        self.shift: Index = (n + 1) * np.arange(count)
        """The first frame of each design."""
        self.rest = Frames.at_rest(
            self._with_ground(geometry.positions), np.tile(np.append(topology.has_position, True), count)
        )
        self.dof = np.concatenate([topology.dof, np.full((1, 6), -1)])
        arm = geometry.positions - geometry.positions[..., topology.root, :]
        self.arm = self._with_ground(np.where(topology.is_rigid[:, None], arm, 0.0))
        self.inertia = np.zeros((count * (n + 1), 6, 6), like=design.values)

    @cached_property
    def cases(self) -> int:
        """Cases in which ends warp, of all members."""
        own = (own.elements.torsion.cases for own in self.design.matrices.values() if len(own.connectivity))
        return max(own, default=0)

    def _with_ground(self, points: Array) -> Array:
        """Points (..., n, 3) of nodes, and a last one at the origin for the ground, of all designs."""
        return self.flat(np.concatenate([points, np.zeros((*points.shape[:-2], 1, 3))], axis=-2), 2)

    def flat(self, numbers: Array, axes: int) -> Array:
        """Numbers of so many own axes, of all designs one after another."""
        if not self.lead:
            return numbers
        own = numbers.shape[numbers.ndim - axes :]
        return np.broadcast_to(numbers, (*self.lead, *own)).reshape(len(self.shift) * own[0], *own[1:])

    def every(self, frames: Index) -> Index:
        """Frames of all designs, from those of one."""
        return np.add.outer(self.shift, frames).reshape(-1, *frames.shape[1:])

    def beams(self, count: int) -> Iterator[Named | None]:
        """The beams of each of the first designs of a stack, between its own frames; None without any."""
        groups = self._beams()
        if not groups:
            yield from [None] * count
            return
        copies = [len(self.shift) * len(at.part.connectivity) for at in self._copies()]
        first = np.cumsum([0, *copies])
        own = [start + np.arange(stop - start).reshape(len(self.shift), -1) for start, stop in pairwise(first)]
        rows, names = np.concatenate(own, axis=1), tuple(name for _, names in groups for name in names)
        whole, e = taken(joined([elements for elements, _ in groups]), rows.ravel()), len(names)
        for k in range(count):
            elements = taken(whole, np.arange(k * e, k * e + e))
            yield replace(elements, node=elements.node - self.shift[k]), names

    def laid(self) -> Laid:
        passive, actuators = self._groups()
        groups = tuple(group for group, _ in (*passive, *actuators))
        names = tuple(own for _, own in (*passive, *actuators))
        sagging = Sagging.of([group for group in groups if isinstance(group, Superelements)], self.rest)
        driven = {own[0]: len(passive) + k for k, (_, own) in enumerate(actuators)}
        return Laid(
            self.design,
            self.rest,
            self.dof,
            groups,
            names,
            self.inertia,
            sagging,
            driven,
            tuple(dashpot for copy in self._copies() for dashpot in copy.dashpots()),
            self.arm,
        )

    def _copies(self) -> Iterator[_Copy]:
        for name in self.discrete:
            copies = self.design.plan.topology.copies[name]
            for copy in range(len(copies.paths)):
                yield _Copy(self, copies, name, copy)

    def _beams(self) -> list[Named]:
        """Beam elements of the members of each part, one of its copies after another."""
        parts = (list(copies) for _, copies in groupby(self._copies(), key=lambda at: at.name))
        return [_members(copies) for copies in parts if len(copies[0].part.connectivity)]

    def _groups(self) -> tuple[list[Named], list[Named]]:
        """Elements with their names, and actuators one by one."""
        springs, stops = [], []
        others: list[Named] = []
        actuators: list[Named] = []
        for at in self._copies():
            springs += at.springs()
            stops += at.stops()
            others += at.diaphragms()
            others += at.superelements()
            actuators += at.stacks()
            actuators += at.pushes()
            at.masses()
        beams = self._beams() if self.known is None else [self.known]
        together = [(joined([e for e, _ in kind]), tuple(n for _, own in kind for n in own))
                  for kind in (beams, springs, stops) if kind]  # fmt: skip
        return [*together, *others], actuators


class _Copy:
    """One copy of a part."""

    def __init__(self, builder: _Builder, copies: Copies, name: str, copy: int) -> None:
        design = builder.design
        self.builder, self.design = builder, design
        self.part: Part = copies.part
        self.name = name
        self.local = design.geometry.parts[name]
        self.Q = design.geometry.Q[..., copies.number[copy], :, :]
        self.mirrored = bool((np.linalg.det(plain(self.Q)) < 0).all())
        self.offset = copies.offset[copy]
        self.prefix = ".".join(copies.paths[copy]) + "." if copies.paths[copy] else ""

    def _frames(self, nodes: Index) -> Index:
        return self.builder.every(self.design.plan.topology.root[self.offset + nodes])

    def _axes(self, rows: Array) -> Array:
        """Axes (3, 3), or (..., e, 3, 3), as columns, global and right-handed, from axes of the part as rows."""
        axes = (self.Q if rows.ndim == 2 else self.Q[..., None, :, :]) @ np.swapaxes(rows, -1, -2)
        if self.mirrored:
            axes = axes * np.array([1.0, 1.0, -1.0])
        return axes

    def _signed(self, matrix: Array) -> Array:
        """Matrices (..., 6k, 6k) in the part's axes, in axes that `_axes` has made right-handed."""
        if not self.mirrored:
            return matrix
        sign = np.tile(MIRRORED, matrix.shape[-1] // 6)
        return sign[:, None] * matrix * sign

    def _arms(self, nodes: Index, reach: Array) -> Array:
        """Arms (..., 3), global axes, from the frames of nodes to points; `reach` (..., 3) leads there, part's axes."""
        back = np.swapaxes(self.Q, -1, -2)
        turned = reach @ (back if nodes.ndim == 1 else back[..., None, :, :])
        return self.builder.arm[self.builder.every(self.offset + nodes)] + self.builder.flat(turned, nodes.ndim + 1)

    def member_ends(self, reach: Array) -> tuple[Index, Array, Array]:
        """Frames (e, 2), axes (e, 2, 3, 3) and arms (e, 2, 3) of the ends of all elements of members, which `reach`
        (..., e, 2, 3) leads to from the nodes, part's axes."""
        nodes, member = self.part.connectivity, self.part.table.element_member
        axes = self.builder.flat(self._axes(self.local.R[..., member, :, :]), 3)
        return self._frames(nodes), np.stack([axes, axes], axis=1), self._arms(nodes, reach)

    def member_matrices(self) -> tuple[Array, Array]:
        """K and M (e, 12, 12) of these elements."""
        elements, flat = self.design.matrices[self.name].elements, self.builder.flat
        return flat(self._signed(elements.K), 3), flat(self._signed(elements.M), 3)

    def springs(self) -> list[tuple[PoseElements, tuple[str, ...]]]:
        """Springs, one by one."""
        return [(self._spring(spring), (self.prefix + key,)) for key, spring in self.part.springs.items()]

    def dashpots(self) -> list[PoseElements]:
        """Dashpots, one by one."""
        return [self._spring(dashpot) for dashpot in self.part.dashpots.values()]

    def _spring(self, spring: SpringElement) -> PoseElements:
        values, here = self.design.values, self.local.positions[spring.nodes]
        k, _ = spring.relative(values, here)
        reach = spring.point(values, here) - here
        axes = self._axes(spring.axes(values).T)
        nodes = np.array(spring.nodes)
        frames, arm = self._frames(nodes), self._arms(nodes, reach)
        if len(nodes) == 1:
            at = self.builder.rest.x[frames] + arm
            frames, arm = np.array([self.builder.ground, frames[0]]), np.concatenate([at, arm])
        axes = np.stack([axes, axes])[None]
        rest = Ends.of(self.builder.rest, frames[None], axes, arm[None]).relative()
        return PoseElements(
            frames[None], axes, arm[None], rest.e, linear_strain(self._signed(k)[None]), np.zeros((1, 12, 12))
        )

    def stops(self) -> Iterator[tuple[Stops, tuple[str, ...]]]:
        """Stops, one by one."""
        for key, stop in self.part.stops.items():
            nodes = np.array(stop.nodes)
            frames, arm = self._frames(nodes), self._arms(nodes, np.zeros((len(nodes), 3)))
            if len(nodes) == 1:
                frames, arm = np.array([self.builder.ground, frames[0]]), np.concatenate([np.zeros((1, 3)), arm])
            direction = self.Q @ stop.direction(self.design.values)
            gap, stiffness, damping = (np.reshape(own, 1) for own in stop.numbers(self.design.values))
            x = self.builder.rest.x[frames] + arm
            reach = np.reshape(direction @ (x[1] - x[0]), 1) + gap
            yield Stops(frames[None], arm[None], direction[None], reach, stiffness, damping), (self.prefix + key,)

    def pushes(self) -> Iterator[Named]:
        """Forces and moments between two nodes: along a direction, which turns with the first, or the line between."""
        channels = self.part.channels
        for key, actuator in channels.actuators.items():
            nodes = np.array(channels.nodes["actuator", key])
            if isinstance(actuator, StrainActuator):
                yield self._bending(actuator, nodes), (self.prefix + key,)
            if not isinstance(actuator, ForceActuator | MomentActuator) or len(nodes) < 2:
                continue
            turns, d = (
                isinstance(actuator, MomentActuator),
                channels.number("actuator", key, "direction", self.design.values),
            )
            sign = -1 if turns and self.mirrored and d is not None else 1
            axis = sign * self.Q @ (np.diff(self.local.positions[nodes], axis=0)[0] if d is None else d)
            length = np.linalg.norm(axis)
            wrench = None
            if turns or d is not None:
                six = (np.zeros(3), axis / length) if turns else (axis / length, np.zeros(3))
                wrench = np.concatenate(six)
            if length > 0:
                arm = self._arms(nodes, np.zeros((2, 3)))
                yield (
                    Push(self._frames(nodes)[None], arm[None], None if wrench is None else wrench[None]),
                    (self.prefix + key,),
                )

    def _bending(self, actuator: StrainActuator, nodes: Index) -> Push:
        """The moment between the ends of a member whose layers strain."""
        member = list(self.part.members).index(actuator.member)
        _, M = self.part.table.blocking(member, actuator.by, self.design.values)
        sign = -1 if self.mirrored else 1
        wrench = np.concatenate([np.zeros(3), sign * M * self.Q @ self.local.R[member, 1]])
        arm = self._arms(nodes, self.local.offsets[member])
        return Push(self._frames(nodes)[None], arm[None], wrench[None])

    def stacks(self) -> Iterator[Named]:
        """Piezo stacks: bars between their nodes, or beams where they are bonded."""
        values = self.design.values
        for key, piezo in self.part.channels.piezos.items():
            x = self.local.positions[piezo.nodes]
            nodes = np.array([piezo.nodes])
            length: Any = np.reshape(np.linalg.norm(x[1] - x[0]), 1)
            axes = self._axes(piezo.frame(x))
            axes = np.stack([axes, axes])[None]
            reach = np.zeros((1, 2, 3))
            K, M = self._stack_matrices(key)
            names = (self.prefix + key,)
            if piezo.section(values) is not None:
                placed = self._frames(nodes), axes, self._arms(nodes, reach)
                yield _beams(self.builder.rest, placed, (K, M), (length, PLAIN)), names
                continue
            stiffness = np.reshape(piezo.stiffness(values), 1)
            yield Bars(self._frames(nodes), self._arms(nodes, reach), length, stiffness, M), names

    def _stack_matrices(self, key: str) -> tuple[Array, Array]:
        """K and M (1, 12, 12) of a stack in its own right-handed axes; M of a pinned one is the same in all axes."""
        piezo, x = self.part.channels.piezos[key], self.local.positions[self.part.channels.piezos[key].nodes]
        K, M = piezo.matrices(self.design.values, x)
        T, frame = np.zeros((12, 12), like=x), piezo.frame(x)
        for k in range(0, 12, 3):
            T[k : k + 3, k : k + 3] = frame
        return self._signed((T @ K @ T.T)[None]), self._signed((T @ M @ T.T)[None])

    def superelements(self) -> Iterator[Named]:
        """Superelements and bodies that bend, between nodes, and those of one node that has stiffness to the ground."""
        bodies = self.part.bent_bodies(self.builder.discrete[self.name])
        values, x = self.design.values, self.local.positions
        described = [
            (key, own.nodes, *own.matrices(values, x[own.nodes])) for key, own in self.part.superelements.items()
        ]
        for key, nodes, *matrices in (*described, *((own.name, own.body.nodes, own.K, own.M) for own in bodies)):
            at = np.array(nodes)
            positioned = at < self.part.n_positioned
            arm = self._arms(at, np.zeros((len(at), 3)))
            frames = self._frames(at)
            sign = np.concatenate([MIRRORED if own and self.mirrored else np.ones(6) for own in positioned])
            K, M = (sign[:, None] * matrix * sign for matrix in matrices)
            builder, axes = self.builder, self._axes(np.eye(3))
            yield (
                Superelements.of(builder.rest, builder.ground, frames, positioned, axes, arm, K, M),
                (self.prefix + key,),
            )

    def diaphragms(self) -> Iterator[Named]:
        """Diaphragms, one by one."""
        for key, diaphragm in self.part.diaphragms.items():
            nodes, x = np.array(diaphragm.nodes), self.local.positions[diaphragm.nodes]
            axes, values = self._axes(diaphragm.axes(self.design.values)), self.design.values
            frames, arm = self._frames(nodes), self._arms(nodes, x[1] - x)
            yield BentRings.bent(self.builder.rest, frames, axes, arm, diaphragm.plate(values)), (self.prefix + key,)

    def masses(self) -> None:
        """Add what bodies, point masses and sensors weigh to the frames that carry them."""
        heavy = {
            *(self.part.bodies.keys() - self.part.elastic),
            *self.part.points,
            *(key for key, _, _ in self.part.channels.masses),
        }
        for mass in self.builder.discrete[self.name]:
            if mass.M is None or mass.name not in heavy:
                continue
            node = np.array(mass.nodes)
            axes = self._axes(np.eye(3))
            M = self._signed(mass.M)
            twist = Ends.of(self.builder.rest, self._frames(node), axes[None], self._arms(node, np.zeros((1, 3))))
            T = twist.twists()[0]
            M = T.T @ M @ T
            self.builder.inertia[self._frames(node)[0]] += M


def _members(copies: Sequence[_Copy]) -> Named:
    """Beam elements of all members of the copies of a part, one copy after another."""
    first, count = copies[0], len(copies)
    part, builder, offsets = first.part, first.builder, first.local.offsets
    member = part.table.element_member
    reach = np.zeros((*offsets.shape[:-3], len(member), 2, 3), like=offsets)
    reach[..., part.first[:-1], 0, :] = offsets[..., 0, :]
    reach[..., part.first[1:] - 1, 1, :] = offsets[..., 1, :]
    length = builder.flat(first.local.length[..., member] / part.counts[member], 1)
    torsion = first.design.matrices[first.name].elements.torsion.padded(builder.cases)
    torsion = torsion.each(lambda field, axes: joined([builder.flat(field, axes + 1)] * count))
    placed = (joined(own) for own in zip(*(copy.member_ends(reach) for copy in copies), strict=True))
    matrices = (joined(own) for own in zip(*(copy.member_matrices() for copy in copies), strict=True))
    keys = list(part.members)
    names = tuple(copy.prefix + keys[m] for copy in copies for m in member)
    return _beams(builder.rest, tuple(placed), tuple(matrices), (joined([length] * count), torsion)), names


def _beams(
    rest: Frames, placed: tuple[Index, Array, Array], matrices: tuple[Array, Array], beam: tuple[Array, Distortion]
) -> PoseElements:
    """Beams between frames (e, 2) with axes and arms of their ends, K and M (e, 12, 12) in these axes, lengths and
    torsion."""
    (frames, axes, arm), (K, M) = placed, matrices
    log = Ends.of(rest, frames, axes, arm).relative()
    return PoseElements(frames, axes, arm, log.e, beam_strain(natural_stiffness(K, log), *beam), M)


def joined(groups: Sequence[Any]) -> Any:
    """Data of one kind in one table."""
    if len(groups) == 1:
        return groups[0]
    if not is_dataclass(groups[0]):
        return np.concatenate(groups)
    first: Any = groups[0]
    return replace(first, **{f.name: joined([getattr(g, f.name) for g in groups]) for f in fields(first)})


def taken(elements: Any, rows: Index) -> Any:
    """Elements by number, with all that they hold; members that are cut warp freely there."""
    values = {f.name: getattr(elements, f.name) for f in fields(elements)}
    of_rows = {k: taken(v, rows) if is_dataclass(v) else v[rows] for k, v in values.items()}
    if isinstance(elements, Strain):
        cut = (of_rows["place"] > 0) & (np.diff(rows, prepend=-1) != 1)
        of_rows["place"] = np.where(cut, 1, of_rows["place"])
    return replace(elements, **of_rows)
