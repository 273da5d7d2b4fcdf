"""The full-order model whose frames turn: every element of every copy of a part, wherever the mechanism has moved, and
what it is loaded with: dead and follower loads, gravity and actuators.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.duals import Dual, plain, without_slopes, zeros
from flexura.kernels import Kernel, is_compiled
from flexura.linalg import DENSE_LIMIT, Matrix
from flexura.motion.bars import Bars, Push
from flexura.motion.elements import (
    HALVES,
    Ends,
    Frames,
    Group,
    Kinetics,
    PoseElements,
    Rates,
    Response,
    accelerating,
    accelerating_bodies,
    products,
    turned,
)
from flexura.motion.layout import Laid, laid_out, laid_out_together
from flexura.motion.se3 import rotation
from flexura.motion.stops import Stops
from flexura.motion.superelements import Superelements
from flexura.motion.together import Together
from flexura.motion.warming import Warmed
from flexura.records import Latest
from flexura.structure import Design, Scatter

NO_COMMANDS: Mapping[str, float] = {}

_moved = Kernel("motion_moved", "aaaaaaaa")
_kinetics = Kernel("motion_kinetics", "aaaaaaxaa")

SMALL_SHARE = 1e-3
"""Share of a state of temperature to both sides of which its first effect is looked at."""


class Forces(NamedTuple):
    """Forces (n + 1, 6) on the frames that hold a state, N and N m, its energy, N m, the blocks of the derivatives
    of the forces by displacements, in the order of the model's pattern, and what each of `MovingModel.elements`
    answers with."""

    energy: float
    force: Array
    blocks: list[Array]
    responses: list[Response]


@dataclass(frozen=True)
class MovingModel(Laid):
    """A mechanism as frames and what lies between them, with what these answer with in any state."""

    @staticmethod
    def of(design: Design) -> MovingModel:
        """The model of a design. Raises OptionError for what cannot turn yet."""
        return MovingModel(**vars(laid_out(design)))

    @staticmethod
    def several(stack: Design) -> Iterator[MovingModel]:
        """The models of the designs of a stack, worked out together, each the same as by itself. Raises as `of`."""
        first: MovingModel | None = None
        for laid in laid_out_together(stack):
            model = MovingModel(**vars(laid))
            first = first or model
            yield model._numbered_as(first)

    @property
    def still(self) -> MovingModel:
        """The same without slopes."""
        own = {f.name: without_slopes(getattr(self, f.name)) for f in fields(self) if f.name != "design"}
        return replace(self, design=self.design.still, **own)

    def under(self, design: Design) -> MovingModel:
        """The same model of a design that differs in nothing but what moves it."""
        return replace(self, design=design)._numbered_as(self)

    def _numbered_as(self, other: MovingModel) -> MovingModel:
        """Itself, with the pattern of another model of the same topology."""
        vars(self)["pattern"] = other.pattern
        return self

    @property
    def n_dof(self) -> int:
        """Number of free displacements."""
        return int(self.dof.max(initial=-1)) + 1

    @cached_property
    def stops(self) -> tuple[Stops, ...]:
        """The elements that are stops, one kind of elements or none."""
        return tuple(elements for elements in self.elements if isinstance(elements, Stops))

    def meets_alike(self, one: Frames, other: Frames) -> bool:
        """Whether two states meet the same stops; a path between those that do not has a kink."""
        kinds = ([stops.depths(frames)[0] > 0 for frames in (one, other)] for stops in self.stops)
        return all((first == second).all() for first, second in kinds)

    @property
    def names_of_stops(self) -> tuple[str, ...]:
        """Names of the stops, as placed."""
        kinds = zip(self.elements, self.names, strict=True)
        return tuple(name for elements, names in kinds if isinstance(elements, Stops) for name in names)

    def name_at(self, frame: int) -> str:
        """The name of what a frame belongs to: of a node that follows it, or of the element that it lies inside."""
        topology = self.design.plan.topology
        nodes = np.flatnonzero(self.root[:-1] == frame)
        named = [topology.node_names[node] for node in nodes.tolist()]
        inside = (own[e] for group, own in zip(self.elements, self.names, strict=True)
                  for e in np.flatnonzero((group.node == frame).any(axis=1)).tolist())  # fmt: skip
        return next((name for name in (*named, *inside) if name), "it")

    @cached_property
    def pattern(self) -> Scatter:
        """Where derivatives by the free displacements go."""
        return Scatter(self._places, self.n_dof, symmetric=False)

    @cached_property
    def _places(self) -> list[Index]:
        """The displacements that blocks are by."""
        columns = [self.dof[node].reshape(len(node), -1) for e in self.elements for node in (e.node, *e.coupled)]
        return [*columns, self.dof[self.sagging.node].reshape(-1, 12), self.dof]

    def commanded(self, actuators: Mapping[str, float]) -> Sequence[Group]:
        """The elements, those of actuators under their commands, by name; all that is warmer under those of states of
        temperature."""
        if not actuators:
            return self.elements
        shares = self.shares(actuators)
        elements = list(self._warming(shares).elements if shares else self.elements)
        for name in actuators.keys() - shares.keys():
            number, command = self.actuators[name], actuators[name]
            element = elements[number]
            assert isinstance(element, Bars | PoseElements | Push)
            elements[number] = element.driven(command)
        return elements

    def _warming(self, shares: Mapping[str, Any]) -> Warmed:
        if any(isinstance(share, Dual) for share in shares.values()):
            return Warmed.of(self, shares)
        return self._latest_warmed.get(tuple(shares.items()), lambda: Warmed.of(self, shares))

    @cached_property
    def _latest_warmed(self) -> Latest[Warmed]:
        return Latest()

    def shares(self, actuators: Mapping[str, Any]) -> dict[str, Any]:
        """Those of some commands that are of states of temperature."""
        return {name: share for name, share in actuators.items() if name not in self.actuators}

    def growth(self, actuators: Mapping[str, float]) -> Array:
        """Displacements and rotations (n + 1, 6) of nodes as seen from the frames that they follow, by what is warmer
        under commands."""
        shares = self.shares(actuators)
        return self._warming(shares).growth if shares else np.zeros((len(self.dof), 6))

    def load_of(self, state: str, frames: Frames, actuators: Mapping[str, float] = NO_COMMANDS) -> tuple[Array, Array]:
        """Forces (n,) on the free displacements by one unit of a state of temperature in a state of the frames, N and
        N m, and the `growth` (n + 1, 6) of nodes by it, linear from there."""
        none, before = np.zeros(3), actuators.get(state, 0.0)
        commands = ({**actuators, state: before + sign * SMALL_SHARE} for sign in (-1, 1))
        less, more = ((self.forces(frames, none, own).force, self.growth(own)) for own in commands)
        change, growth = ((b - a) / (2 * SMALL_SHARE) for a, b in zip(less, more, strict=True))
        free = self.dof >= 0
        load = np.zeros(self.n_dof, like=change)
        load[self.dof[free]] = -change[free]
        return load, growth

    def forces(self, frames: Frames, gravity: Array, actuators: Mapping[str, float] = NO_COMMANDS) -> Forces:
        """What holds the mechanism in a state against its stiffness, its weight, g (3,) in m/s^2, and its actuators,
        m, N and N m by name."""
        responses = [elements.response(frames) for elements in self.commanded(actuators)]
        total = self._summed(frames, [response.force for response in responses])
        local = turned(np.where(frames.placed[:, None], total, 0.0))
        inside_slope = self._no_sagging
        if gravity.any():
            weight, slope, inside_slope = self._weights(frames, gravity)
            total, local = total - weight, local - slope
        energy = sum(response.energy.sum() for response in responses)
        blocks = (block for response in responses for block in (response.tangent, *response.coupled))
        return Forces(energy, total, [*blocks, -inside_slope, local], responses)

    def held(
        self, frames: Frames, gravity: Array, actuators: Mapping[str, float] = NO_COMMANDS
    ) -> tuple[Array, list[Array]]:
        """The forces (n + 1, 6) of `forces` alone, and those of each of `elements`."""
        own = [
            elements.held(frames)
            if isinstance(elements, PoseElements | Superelements)
            else elements.response(frames).force
            for elements in self.commanded(actuators)
        ]
        total = self._summed(frames, own)
        return (total - self._weights(frames, gravity)[0] if gravity.any() else total), own

    def _summed(self, frames: Frames, forces: Sequence[Array]) -> Array:
        """Forces of elements on all frames (n + 1, 6)."""
        total = zeros(self.dof.shape, frames.x, self.design.values)
        for elements, force in zip(self.elements, forces, strict=True):
            at = (6 * elements.node.reshape(-1, 1) + np.arange(6)).ravel()
            total += np.bincount(at, force.ravel(), total.size).reshape(total.shape)
        return total

    @property
    def _no_sagging(self) -> Array:
        return np.zeros((len(self.sagging.node), 12, 12))

    def matrix(self, blocks: Sequence[Array]) -> Matrix:
        """The symmetric part (n, n) of a sum of blocks, full up to an order of DENSE_LIMIT, else sparse by columns."""
        if self.n_dof > DENSE_LIMIT:
            return self.pattern.sparse(blocks, symmetric=True)
        A = self.pattern.dense(blocks)
        return (A + A.T) / 2

    def material(self, frames: Frames, actuators: Mapping[str, float] = NO_COMMANDS) -> Matrix:
        """Derivatives (n, n) of the forces of free displacements in a state, as if nothing were under force there."""
        return self.matrix(self.material_blocks(frames, actuators))

    def material_blocks(self, frames: Frames, actuators: Mapping[str, float] = NO_COMMANDS) -> list[Array]:
        """The blocks of `material`, in the order of the pattern."""
        none = np.zeros((*self.dof.shape, 6))
        blocks = (block for e in self.commanded(actuators) for block in e.material(frames))
        return [*blocks, self._no_sagging, none]

    def _weights(self, frames: Frames, gravity: Array) -> tuple[Array, Array, Array]:
        """Weights (n + 1, 6) in a state, and their derivatives by the displacements of the frames: (n + 1, 6, 6), and
        (k, 12, 12) of what sags."""
        Rt = np.swapaxes(frames.R, -1, -2)
        local = (self.weight @ (Rt @ gravity)[..., None])[..., 0]
        force = (frames.R[:, None] @ local.reshape(-1, 2, 3, 1)).reshape(-1, 6)
        slope = turned(force)
        # the direction of free fall in the frame's axes: d(R'g) = R' skew(g) dw
        slope[:, :, 3:] += (frames.R[:, None] @ (self.weight @ (Rt @ skew(gravity))).reshape(-1, 2, 3, 3)).reshape(
            -1, 6, 3
        )
        inside, inside_slope = self.sagging.response(frames, gravity)
        np.add.at(force, self.sagging.node.ravel(), inside.reshape(-1, 6))
        return force, slope, inside_slope

    def mass(self, frames: Frames) -> Matrix:
        """M (n, n) of the free displacements in a state, symmetric."""
        return self.matrix(self.mass_blocks(frames))

    def mass_blocks(self, frames: Frames) -> list[Array]:
        """The blocks of `mass`, in the order of the pattern."""
        return [*element_masses(self.elements, frames), self._no_sagging, self.carried_inertia(frames)]

    def form(self, blocks: Sequence[Array], X: Array) -> Array:
        """X' A X (k, k) for the symmetric part A of a sum of blocks and free displacements X (n, k)."""
        padded = np.concatenate([X, np.zeros((1, X.shape[1]))])
        whole = np.zeros((X.shape[1], X.shape[1]))
        for dofs, block in zip(self._places, blocks, strict=True):
            x = padded[dofs]
            whole = whole + np.einsum("eic,eid->cd", x, block @ x)
        return (whole + whole.T) / 2

    def carried_inertia(self, frames: Frames) -> Array:
        """The mass (n + 1, 6, 6) that frames carry, in global axes."""
        heavy, inertia = self._heavy, zeros(self.inertia.shape, frames.R, self.inertia)
        R = np.zeros((len(heavy), 6, 6), like=frames.R)
        R[:, :3, :3] = R[:, 3:, 3:] = frames.R[heavy]
        inertia[heavy] = R @ self.inertia[heavy] @ np.swapaxes(R, -1, -2)
        return inertia

    def viscous(self, frames: Frames) -> Matrix:
        """C (n, n), N s/m, N s, N m s, of the dashpots in a state, full or sparse as `matrix`."""
        C = [dashpot.material(frames)[0] for dashpot in self.dashpots]
        return self._viscous.dense(C) if self.n_dof <= DENSE_LIMIT else self._viscous.sparse(C)

    @cached_property
    def _viscous(self) -> Scatter:
        """Where the damping of dashpots goes."""
        return Scatter([self.dof[dashpot.node].reshape(len(dashpot.node), -1) for dashpot in self.dashpots], self.n_dof)

    def stopping(self, frames: Frames, velocity: Array, by_rate: float) -> Matrix:
        """What the damping of stops adds to the derivatives (n, n) of the forces by free displacements, to which
        velocities change by `by_rate`, 1/s, with the frames at velocities (n + 1, 6)."""
        blocks = [k + by_rate * c for k, c in (own.rate_tangents(frames, velocity) for own in self.stops)]
        pattern = self._stopping
        A = pattern.dense(blocks) if self.n_dof <= DENSE_LIMIT else pattern.sparse(blocks)
        return (A + A.T) / 2

    @cached_property
    def _stopping(self) -> Scatter:
        """Where the damping of stops goes."""
        return Scatter([self.dof[own.node].reshape(len(own.node), -1) for own in self.stops], self.n_dof)

    def displacements(self, step: Array) -> Array:
        """Displacements (..., n + 1, 6) of all frames from those that are free (..., n)."""
        held = np.zeros((*step.shape[:-1], step.shape[-1] + 1))  # the last one, which those that are held take
        held[..., :-1] = step
        return held.take(self.dof, axis=-1)

    def moved(self, start: Frames, step: Array) -> Frames:
        """The frames after free displacements (n,) from a state."""
        if not is_compiled():
            return start.moved(self.displacements(step))
        made = start.copy()
        _moved(self._together.struct.address, *start[:3], step, *made[:3])
        return made

    def kinetics(
        self, frames: Frames, rates: Rates, gravity: Array, actuators: Mapping[str, float] = NO_COMMANDS
    ) -> Kinetics:
        """Forces (n + 1, 6) on the frames that hold, damp and accelerate the mechanism in a state of motion against its
        weight and its actuators, and its strain energy and kinetic energy (theory eqs. G33-G34)."""
        elements, total = self.commanded(actuators), np.zeros(self.dof.shape)
        if is_compiled():
            (own, others), motion = self._taken_together(elements), (rates.velocity, rates.acceleration, rates.damping)
            energies = np.empty(own.memory)
            _kinetics(own.struct.address, frames.x, frames.R, frames.z, *motion, energies, total)
        else:
            energies, others = (0.0, self._add_bodies(total, frames, rates)), elements
        strain, kinetic = self._add_others(total, others, frames, rates, gravity)
        return Kinetics(total, float(energies[0]) + strain, float(energies[1]) + kinetic)

    def accelerating(self, frames: Frames, rates: Rates) -> Array:
        """The part of the forces (n + 1, 6) of `kinetics` that accelerates masses, and what dashpots resist."""
        total = np.zeros(self.dof.shape)
        self._add_bodies(total, frames, rates)
        self._add_dashpots(total, frames, rates)
        for group in self.elements:
            np.add.at(total, group.node.ravel(), _accelerating(group, frames, rates).reshape(-1, 6))
        return total

    def _add_bodies(self, total: Array, frames: Frames, rates: Rates) -> float:
        """Add to forces (n + 1, 6) those on what frames carry; return its kinetic energy."""
        heavy = self._heavy
        moving = rates.velocity[heavy], rates.acceleration[heavy]
        force, kinetic = accelerating_bodies(self.inertia[heavy], frames.R[heavy], *moving)
        total[heavy] += force
        return kinetic

    def _add_dashpots(self, total: Array, frames: Frames, rates: Rates) -> None:
        """Add to forces (n + 1, 6) those of dashpots."""
        for dashpot in self.dashpots:
            held = dashpot.material(frames)[0] @ rates.velocity[dashpot.node].reshape(len(dashpot.node), -1, 1)
            np.add.at(total, dashpot.node.ravel(), held.reshape(-1, 6))

    def _add_others(
        self, total: Array, elements: Sequence[Group], frames: Frames, rates: Rates, gravity: Array
    ) -> tuple[float, float]:
        """Add to forces (n + 1, 6) those of elements one by one, of dashpots and of weight; return the energies of the
        elements, strain and kinetic."""
        strain = kinetic = 0.0
        for group in elements:
            response = group.kinetics(frames, rates)
            np.add.at(total, group.node.ravel(), response.force.reshape(-1, 6))
            strain, kinetic = strain + response.strain, kinetic + response.kinetic
        self._add_dashpots(total, frames, rates)
        if gravity.any():
            total -= self._weights(frames, gravity)[0]
        return strain, kinetic

    @cached_property
    def all_together(self) -> Together | None:
        """What a kernel takes of all that moves, without commands; None where it does not take all."""
        return self._together if len(self._together.numbers) == len(self.elements) and not self.dashpots else None

    def _taken_together(self, elements: Sequence[Group]) -> tuple[Together, Sequence[Group]]:
        """What a kernel takes together of the elements, and the others."""
        own = self._together
        if elements is not self.elements:
            same = tuple(k for k in own.numbers if elements[k] is self.elements[k])
            own = self._latest_together.get(same, lambda: Together.of(self, same))
        return own, [group for k, group in enumerate(elements) if k not in own.numbers]

    @cached_property
    def _together(self) -> Together:
        """All that kernels take together."""
        return Together.of(self, range(len(self.elements)))

    @cached_property
    def _latest_together(self) -> Latest[Together]:
        return Latest()

    @cached_property
    def _heavy(self) -> Index:
        """Frames that carry mass."""
        return np.flatnonzero(plain(self.inertia).any(axis=(1, 2)))

    def positions(self, frames: Frames, actuators: Mapping[str, float] = NO_COMMANDS) -> Array:
        """Positions (n, 3), m, of all nodes."""
        root = self.root
        x = frames.x[root] + (frames.R[root] @ (self.arm + self.growth(actuators)[:, :3])[..., None])[..., 0]
        return x[:-1]

    def loss_factors(self, default: float) -> list[Array]:
        """Loss factors (e,) of the kinds of `elements`, `default` where there is none."""
        design = self.design
        loss: dict[str, float] = {}
        for name in design.matrices:
            part, paths = design.plan.parts[name], design.plan.topology.copies[name].paths
            losses = zip(part.discrete, part.discrete_losses(design.values, default), strict=True)
            members = part.table.loss_factors(design.values, default)[part.first[:-1]]
            by_name = dict(zip(part.members, members.tolist(), strict=True))
            by_name |= {name: eta for (name, _, element), eta in losses if element.has_stiffness}
            loss |= {".".join((*path, name)): eta for path in paths for name, eta in by_name.items()}
        return [np.array([loss.get(name, 0.0) for name in names]) for names in self.names]


def element_masses(elements: Sequence[Group], frames: Frames) -> Iterator[Array]:
    """The blocks of the mass of elements, in the order of a model's pattern; what couples members has none."""
    for group in elements:
        yield group.masses(frames)
        for node in group.coupled:
            yield np.zeros((len(node), 6 * node.shape[1], 6 * node.shape[1]))


def _accelerating(group: Group, frames: Frames, rates: Rates) -> Array:
    """Forces (e, 6k) on the frames of elements that accelerate them (theory eq. G33)."""
    e, k = group.node.shape
    if isinstance(group, Superelements):
        ends, turning = group.ends(frames), np.eye(group.count)[0]
        axes = ends.axes[:, 0]
    elif isinstance(group, PoseElements):
        ends, turning = group.ends(frames), HALVES
        axes = ends.axes[:, 0] @ rotation(ends.relative().e[:, 3:] / 2)
    elif isinstance(group, Bars):
        axes, turning = np.tile(np.eye(3), (e, 1, 1)), np.zeros(2)
        ends = Ends.of(frames, group.node, axes[:, None], group.arm)
    else:
        return np.zeros((e, 6 * k))
    velocity, acceleration = rates.velocity[group.node], rates.acceleration[group.node]
    return accelerating(group.mass, axes, ends.arm, turning, velocity, acceleration)[0]


@dataclass(frozen=True)
class Loads:
    """Dead loads (6,) by node, N and N m, follower loads likewise in the turning axes of the nodes, gravity (3,),
    m/s^2, and by the names of actuators as placed how far stacks would expand freely, m, and with what forces and
    moments, N and N m, others act between two nodes."""

    dead: Mapping[int, Array]
    follower: Mapping[int, Array]
    gravity: Array
    actuators: Mapping[str, float] = field(default_factory=dict)

    def mixed(self, other: Loads, share: float) -> Loads:
        """Loads between these and others, all in proportion."""
        return Loads(
            _mixed(self.dead, other.dead, share),
            _mixed(self.follower, other.follower, share),
            self.gravity + share * (other.gravity - self.gravity),
            _mixed(self.actuators, other.actuators, share),
        )

    def apart(self, other: Loads) -> float:
        """The largest difference from other loads, whatever its unit."""
        kinds = ((self.dead, other.dead), (self.follower, other.follower), (self.actuators, other.actuators))
        return max(*(_apart(*pair) for pair in kinds), float(np.abs(self.gravity - other.gravity).max()))

    @property
    def any(self) -> bool:
        """Whether anything is loaded."""
        return bool(self.dead or self.follower or self.actuators or self.gravity.any())

    def forces(self, model: MovingModel, frames: Frames) -> Array:
        """Dead and follower loads (n + 1, 6) on the frames."""
        total = np.zeros(model.dof.shape, like=frames.R)
        for node, wrench in self.dead.items():
            total[model.root[node]] += _at_root(model, frames, node, wrench[:3], wrench[3:])
        for node, wrench in self.follower.items():
            force, moment = frames.R[model.root[node]] @ wrench.reshape(2, 3, 1)
            total[model.root[node]] += _at_root(model, frames, node, force[:, 0], moment[:, 0])
        return total

    def external(self, model: MovingModel, frames: Frames) -> tuple[Array, Array]:
        """Dead and follower loads (n + 1, 6) on the frames, and their derivatives (n + 1, 6, 6) by displacements."""
        slope = np.zeros((*model.dof.shape, 6), like=frames.R)
        for node, wrench in self.dead.items():
            root = model.root[node]
            slope[root, 3:, 3:] += skew(wrench[:3]) @ skew(frames.R[root] @ model.arm[node])
        for node, wrench in self.follower.items():
            force, moment = frames.R[model.root[node]] @ wrench.reshape(2, 3, 1)
            wrench_at_root = _at_root(model, frames, node, force[:, 0], moment[:, 0])
            slope[model.root[node]] += turned(wrench_at_root[None])[0]
        return self.forces(model, frames), slope


def _at_root(model: MovingModel, frames: Frames, node: int, force: Array, moment: Array) -> Array:
    """A force and a moment (3,) at a node as they act (6,) on the frame that it follows."""
    arm = frames.R[model.root[node]] @ model.arm[node]
    return np.concatenate([force, moment + products(arm, force)])


def described_loads(design: Design) -> Loads:
    """The dead loads and the gravity that are described."""
    plan, values = design.plan, design.values
    wrenches = plan.loads.wrenches(values)
    numbers = plan.topology.numbers(list(wrenches)).tolist()
    return Loads(dict(zip(numbers, wrenches.values(), strict=True)), {}, plan.loads.gravity(values))


NO_LOADS = Loads({}, {}, np.zeros(3))


def _mixed(start: Mapping[Any, Any], end: Mapping[Any, Any], share: float) -> dict[Any, Any]:
    """Values by name or node between these and others; what is not there is zero."""
    keys = dict.fromkeys((*start, *end))
    return {key: (1 - share) * start.get(key, 0.0) + share * end.get(key, 0.0) for key in keys}


def _apart(one: Mapping[Any, Any], other: Mapping[Any, Any]) -> float:
    """The largest difference of values by name or node."""
    differences = [np.abs(np.subtract(one.get(key, 0.0), other.get(key, 0.0))).max() for key in (*one, *other)]
    return float(max(differences, default=0.0))
