"""The full-order model whose frames turn: every element of every copy of a part, wherever the mechanism has moved."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.beam import skew
from flexura.linalg import DENSE_LIMIT, Matrix
from flexura.mechanism import ForceActuator, MomentActuator
from flexura.motion.bars import Bars
from flexura.motion.clusters import Sagging, Superelements
from flexura.motion.elements import Ends, Frames, Group, Kinetics, PoseElements, Rates, Response, turned
from flexura.motion.inertia import accelerating
from flexura.motion.pushes import Push
from flexura.motion.strain import Strain, beam_strain, linear_strain, natural_stiffness
from flexura.structure import Copies, Design, Part, Scatter, SpringElement, Torsion

Array = NDArray[np.float64]
Index = NDArray[np.intp]

Named = tuple[Group, tuple[str, ...]]
"""Elements with the name of each."""

NO_COMMANDS: Mapping[str, float] = {}

PLAIN = Torsion(np.zeros((1, 4)), np.zeros(1), np.zeros(1))
"""How a uniform bar twists without corrections."""

MIRRORED = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])
"""Signs of displacements along and about axes that are made right-handed again by turning the third one round."""


class Forces(NamedTuple):
    """Forces (n + 1, 6) on the frames that hold a state, N and N m, its energy, N m, the blocks of the derivatives
    of the forces by displacements, in the order of the model's pattern, and what each of `MovingModel.elements`
    answers with."""

    energy: float
    force: Array
    blocks: list[Array]
    responses: list[Response]


@dataclass(frozen=True)
class MovingModel:
    """A mechanism as frames and what lies between them.

    `rest` are the frames at rest, one for every node and a last one for the ground; `dof` (n + 1, 6) numbers the free
    displacements, -1 where held and where a node follows another one. `inertia` (n + 1, 6, 6) is the mass that frames
    carry, in their own axes, and `weight` (n + 1, 6, 3) the forces in these axes per acceleration of free fall, of
    elements too; `sagging` is the weight of the amplitudes of superelements.
    """

    design: Design
    rest: Frames
    dof: Index
    elements: tuple[Group, ...]
    names: tuple[tuple[str, ...], ...]
    inertia: Array
    weight: Array
    sagging: Sagging
    actuators: Mapping[str, int]
    """Numbers of the elements that are actuators, piezo stacks and those between two nodes, by name as placed."""
    dashpots: tuple[PoseElements, ...]
    """Dashpots, with damping in place of stiffness."""
    arm: Array = field(repr=False)
    """From the frame that a node follows to the node (n + 1, 3), m, at rest."""

    @staticmethod
    def of(design: Design) -> MovingModel:
        """The model of a design. Raises OptionError for what cannot turn yet."""
        return _Builder(design).model()

    @property
    def n_dof(self) -> int:
        """Number of free displacements."""
        return int(self.dof.max(initial=-1)) + 1

    @cached_property
    def pattern(self) -> Scatter:
        """Where derivatives by the free displacements go."""
        columns = [self.dof[e.node].reshape(len(e.node), -1) for e in self.elements]
        dofs = [*columns, self.dof[self.sagging.node].reshape(-1, 12), self.dof]
        return Scatter(dofs, self.n_dof, symmetric=False)

    def commanded(self, actuators: Mapping[str, float]) -> Sequence[Group]:
        """The elements, those of actuators under their commands, by name."""
        elements = list(self.elements)
        for name, command in actuators.items():
            number = self.actuators[name]
            own = elements[number]
            assert isinstance(own, Bars | PoseElements | Push)
            elements[number] = own.driven(command)
        return elements

    def forces(self, frames: Frames, gravity: Array, actuators: Mapping[str, float] = NO_COMMANDS) -> Forces:
        """What holds the mechanism in a state against its stiffness, its weight, g (3,) in m/s^2, and its actuators,
        m, N and N m by name."""
        total = np.zeros(self.dof.shape)
        responses = [elements.response(frames) for elements in self.commanded(actuators)]
        for elements, own in zip(self.elements, responses, strict=True):
            at, flat = elements.node.ravel(), own.force.reshape(-1, 6)
            for column in range(6):
                total[:, column] += np.bincount(at, flat[:, column], len(total))
        local = turned(np.where(frames.placed[:, None], total, 0.0))
        inside_slope = self._no_sagging
        if gravity.any():
            weight, slope = self._weights(frames, gravity)
            inside, inside_slope = self.sagging.response(frames, gravity)
            np.add.at(weight, self.sagging.node.ravel(), inside.reshape(-1, 6))
            total, local = total - weight, local - slope
        energy = sum(float(own.energy.sum()) for own in responses)
        return Forces(energy, total, [*(own.tangent for own in responses), -inside_slope, local], responses)

    @property
    def _no_sagging(self) -> Array:
        return np.zeros((len(self.sagging.node), 12, 12))

    def matrix(self, blocks: Sequence[Array]) -> Matrix:
        """The symmetric part (n, n) of a sum of blocks, full up to an order of DENSE_LIMIT, else sparse by columns."""
        pattern = self.pattern
        A = pattern.dense(blocks) if self.n_dof <= DENSE_LIMIT else pattern.sparse(blocks)
        return (A + A.T) / 2

    def material(self, frames: Frames, actuators: Mapping[str, float] = NO_COMMANDS) -> Matrix:
        """Derivatives (n, n) of the forces of free displacements in a state, as if nothing were under force there."""
        none = np.zeros((*self.dof.shape, 6))
        return self.matrix([*(e.material(frames) for e in self.commanded(actuators)), self._no_sagging, none])

    def _weights(self, frames: Frames, gravity: Array) -> tuple[Array, Array]:
        """Weights (n + 1, 6) in a state, and their derivatives (n + 1, 6, 6) by the displacements of the frames."""
        Rt = np.swapaxes(frames.R, -1, -2)
        own = (self.weight @ (Rt @ gravity)[..., None])[..., 0]
        force = (frames.R[:, None] @ own.reshape(-1, 2, 3, 1)).reshape(-1, 6)
        slope = turned(force)
        # the direction of free fall in the frame's axes: d(R'g) = R' skew(g) dw
        slope[:, :, 3:] += (frames.R[:, None] @ (self.weight @ (Rt @ skew(gravity))).reshape(-1, 2, 3, 3)).reshape(
            -1, 6, 3
        )
        return force, slope

    def mass(self, frames: Frames) -> Matrix:
        """M (n, n) of the free displacements in a state, symmetric."""
        R = np.zeros((len(frames.R), 6, 6))
        R[:, :3, :3] = R[:, 3:, 3:] = frames.R
        inertia = R @ self.inertia @ np.swapaxes(R, -1, -2)
        return self.matrix([*(e.masses(frames) for e in self.elements), self._no_sagging, inertia])

    def kinetics(
        self, frames: Frames, rates: Rates, gravity: Array, actuators: Mapping[str, float] = NO_COMMANDS
    ) -> Kinetics:
        """Forces (n + 1, 6) on the frames that hold, damp and accelerate the mechanism in a state of motion against its
        weight and its actuators, and its strain energy and kinetic energy (theory eqs. G33-G34)."""
        total, strain, kinetic = np.zeros(self.dof.shape), 0.0, 0.0
        for elements in self.commanded(actuators):
            own = elements.kinetics(frames, rates)
            at, flat = elements.node.ravel(), own.force.reshape(-1, 6)
            for column in range(6):
                total[:, column] += np.bincount(at, flat[:, column], len(total))
            strain, kinetic = strain + own.strain, kinetic + own.kinetic
        for dashpot in self.dashpots:
            held = dashpot.material(frames) @ rates.velocity[dashpot.node].reshape(len(dashpot.node), -1, 1)
            np.add.at(total, dashpot.node.ravel(), held.reshape(-1, 6))
        heavy = self._heavy
        velocity, acceleration = rates.velocity[heavy, None], rates.acceleration[heavy, None]
        none = np.zeros((len(heavy), 1, 3))
        force, more = accelerating(self.inertia[heavy], frames.R[heavy], none, np.ones(1), velocity, acceleration)
        total[heavy] += force
        if gravity.any():
            total -= self._weights(frames, gravity)[0]
            inside, _ = self.sagging.response(frames, gravity)
            np.subtract.at(total, self.sagging.node.ravel(), inside.reshape(-1, 6))
        return Kinetics(total, strain, kinetic + more)

    @cached_property
    def _heavy(self) -> Index:
        """Frames that carry mass."""
        return np.flatnonzero(self.inertia.any(axis=(1, 2)))

    def positions(self, frames: Frames) -> Array:
        """Positions (n, 3), m, of all nodes."""
        root = self.root
        x = frames.x[root] + (frames.R[root] @ self.arm[..., None])[..., 0]
        return x[:-1]

    def loss_factors(self, default: float) -> list[Array]:
        """Loss factors (e,) of the kinds of `elements`, `default` where there is none."""
        design = self.design
        loss: dict[str, float] = {}
        for name in design.matrices:
            part, paths = design.plan.parts[name], design.plan.topology.copies[name].paths
            members = part.table.loss_factors(design.values, default)[part.first[:-1]].tolist()
            others = part.discrete_losses(design.values, default)[len(part.bodies) + len(part.points) :]
            keys = [*part.members, *part.springs, *part.superelements, *part.channels.piezos]
            for path in paths:
                prefixed = (".".join((*path, key)) for key in keys)
                loss.update(zip(prefixed, [*members, *others], strict=False))
        return [np.array([loss.get(name, 0.0) for name in names]) for names in self.names]

    @cached_property
    def root(self) -> Index:
        """The frame (n + 1,) that each node follows."""
        return np.append(self.design.plan.topology.root, len(self.dof) - 1)


def add_weight(weight: Array, elements: Group, rest: Frames) -> None:
    """Add what the mass of elements weighs to the weight (n + 1, 6, 3) of the frames at their ends."""
    M = elements.masses(rest)
    falling = rest.placed[elements.node]
    M = M.reshape(*M.shape[:2], -1, 6)[..., :3]
    force = np.einsum("eikj,ek->eij", M, falling).reshape(*elements.node.shape, 6, 3)
    np.add.at(weight, elements.node.ravel(), (force * falling[..., None, None]).reshape(-1, 6, 3))


class _Builder:
    """Lays out the elements of all copies of all parts in global axes."""

    def __init__(self, design: Design) -> None:
        self.design = design
        topology, geometry = design.plan.topology, design.geometry
        n = topology.n_nodes
        self.ground = n
        x = np.concatenate([geometry.positions, np.zeros((1, 3))])
        self.rest = Frames.at_rest(x, np.append(topology.has_position, True))
        self.dof = np.concatenate([topology.dof, np.full((1, 6), -1)])
        arm = geometry.positions - geometry.positions[topology.root]
        self.arm = np.concatenate([np.where(topology.is_rigid[:, None], arm, 0.0), np.zeros((1, 3))])
        self.inertia = np.zeros((n + 1, 6, 6))
        self.weight = np.zeros((n + 1, 6, 3))

    def model(self) -> MovingModel:
        passive, actuators = self._groups()
        groups = tuple(group for group, _ in (*passive, *actuators))
        names = tuple(own for _, own in (*passive, *actuators))
        for elements in groups:
            add_weight(self.weight, elements, self.rest)
        sagging = Sagging.of([group for group in groups if isinstance(group, Superelements)], self.rest)
        driven = {own[0]: len(passive) + k for k, (_, own) in enumerate(actuators)}
        return MovingModel(
            self.design,
            self.rest,
            self.dof,
            groups,
            names,
            self.inertia,
            self.weight,
            sagging,
            driven,
            tuple(dashpot for copy in self._copies() for dashpot in copy.dashpots()),
            self.arm,
        )

    def _copies(self) -> Iterator[_Copy]:
        for name in self.design.matrices:
            copies = self.design.plan.topology.copies[name]
            for copy in range(len(copies.paths)):
                yield _Copy(self, copies, name, copy)

    def _groups(self) -> tuple[list[Named], list[Named]]:
        """Elements with their names, and actuators one by one."""
        beams, springs = [], []
        others: list[Named] = []
        actuators: list[Named] = []
        for at in self._copies():
            beams += at.members()
            springs += at.springs()
            others += at.superelements()
            actuators += at.stacks()
            actuators += at.pushes()
            at.masses()
        joined = [(_joined([e for e, _ in kind]), tuple(n for _, own in kind for n in own))
                  for kind in (beams, springs) if kind]  # fmt: skip
        return [*joined, *others], actuators


class _Copy:
    """One copy of a part."""

    def __init__(self, builder: _Builder, copies: Copies, name: str, copy: int) -> None:
        design = builder.design
        self.builder, self.design = builder, design
        self.part: Part = copies.part
        self.own = design.matrices[name]
        self.local = design.geometry.parts[name]
        self.Q = design.geometry.Q[copies.number[copy]]
        self.mirrored = np.linalg.det(self.Q) < 0
        self.offset = copies.offset[copy]
        self.prefix = ".".join(copies.paths[copy]) + "." if copies.paths[copy] else ""

    def _frames(self, nodes: Index) -> Index:
        return self.design.plan.topology.root[self.offset + nodes]

    def _axes(self, rows: Array) -> Array:
        """Axes (..., 3, 3) as columns, global and right-handed, from axes of the part as rows."""
        axes = self.Q @ np.swapaxes(rows, -1, -2)
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
        return self.builder.arm[self.offset + nodes] + reach @ self.Q.T

    def members(self) -> list[tuple[PoseElements, tuple[str, ...]]]:
        """Beam elements of all members."""
        part, own = self.part, self.own
        if not len(part.connectivity):
            return []
        member = part.table.element_member
        reach = np.zeros((len(member), 2, 3))
        reach[part.first[:-1], 0] = self.local.offsets[:, 0]
        reach[part.first[1:] - 1, 1] = self.local.offsets[:, 1]
        axes = self._axes(self.local.R[member])
        axes = np.stack([axes, axes], axis=1)
        length = self.local.length[member] / part.counts[member]
        keys = list(part.members)
        names = tuple(self.prefix + keys[m] for m in member)
        K, M = self._signed(own.elements.K), self._signed(own.elements.M)
        return [(self._between(part.connectivity, axes, reach, K, M, (length, own.elements.torsion)), names)]

    def _between(
        self, nodes: Index, axes: Array, reach: Array, K: Array, M: Array, beam: tuple[Array, Torsion]
    ) -> PoseElements:
        """Beams with K and M (e, 12, 12) in the axes of their ends, lengths and torsion."""
        arm = self._arms(nodes, reach)
        frames = self._frames(nodes)
        log = Ends.of(self.builder.rest, frames, axes, arm).relative()
        k = natural_stiffness(K, log)
        return PoseElements(frames, axes, arm, log.e, beam_strain(k, *beam), M)

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

    def pushes(self) -> Iterator[Named]:
        """Forces and moments between two nodes: along a direction, which turns with the first, or the line between."""
        channels = self.part.channels
        for key, actuator in channels.actuators.items():
            nodes = np.array(channels.nodes["actuator", key])
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
                wrench = np.append(np.zeros(3), axis / length) if turns else np.append(axis / length, np.zeros(3))
            if length > 0:
                arm = self._arms(nodes, np.zeros((2, 3)))
                yield Push(self._frames(nodes)[None], arm[None], wrench), (self.prefix + key,)

    def stacks(self) -> Iterator[Named]:
        """Piezo stacks: bars between their nodes, or beams where they are bonded."""
        values = self.design.values
        for key, piezo in self.part.channels.piezos.items():
            x = self.local.positions[piezo.nodes]
            nodes = np.array([piezo.nodes])
            length = np.array([float(np.linalg.norm(x[1] - x[0]))])
            axes = self._axes(piezo.frame(x))
            axes = np.stack([axes, axes])[None]
            reach = np.zeros((1, 2, 3))
            K, M = self._stack_matrices(key)
            names = (self.prefix + key,)
            if piezo.section(values) is not None:
                yield self._between(nodes, axes, reach, K, M, (length, PLAIN)), names
                continue
            stiffness = np.array([float(piezo.stiffness(values))])
            yield Bars(self._frames(nodes), self._arms(nodes, reach), length, stiffness, M), names

    def _stack_matrices(self, key: str) -> tuple[Array, Array]:
        """K and M (1, 12, 12) of a stack in its own right-handed axes; M of a pinned one is the same in all axes."""
        piezo, x = self.part.channels.piezos[key], self.local.positions[self.part.channels.piezos[key].nodes]
        K, M = piezo.matrices(self.design.values, x)
        T = np.kron(np.eye(4), piezo.frame(x))
        return self._signed((T @ K @ T.T)[None]), self._signed((T @ M @ T.T)[None])

    def superelements(self) -> Iterator[Named]:
        """Superelements between nodes, and those of one node that has stiffness to the ground."""
        for key, (nodes, *matrices) in self.part.superelements.items():
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

    def masses(self) -> None:
        """Add what bodies, point masses and sensors weigh to the frames that carry them."""
        heavy = {*self.part.bodies, *self.part.points, *(key for key, _, _ in self.part.channels.masses)}
        for mass in self.own.discrete_elements:
            if mass.M is None or mass.name not in heavy:
                continue
            node = np.array(mass.nodes)
            axes = self._axes(np.eye(3))
            M = self._signed(mass.M)
            twist = Ends.of(self.builder.rest, self._frames(node), axes[None], self._arms(node, np.zeros((1, 3))))
            T = twist.twists()[0]
            M = T.T @ M @ T
            self.builder.inertia[self._frames(node)[0]] += M
            self.builder.weight[self._frames(node)[0]] += M[:, :3]


def _joined(groups: list[PoseElements]) -> PoseElements:
    """Elements of one kind in one table."""
    strain = Strain(*(np.concatenate([getattr(g.strain, f.name) for g in groups]) for f in fields(Strain)))
    node, axes, arm, rest, mass = (
        np.concatenate([getattr(g, name) for g in groups]) for name in ("node", "axes", "arm", "rest", "mass")
    )
    return PoseElements(node, axes, arm, rest, strain, mass)
