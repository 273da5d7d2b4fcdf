"""A design at the pose that its description names, and what is linear about it (theory eqs. G25-G26)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.errors import OptionError, SolverError
from flexura.linalg import is_definite
from flexura.mechanism import DISPLACEMENTS, FORCES
from flexura.motion.elements import Group, PoseElements
from flexura.motion.equilibrium import Drive, Equations
from flexura.motion.model import NO_LOADS, Loads, MovingModel, described_loads
from flexura.motion.path import Path, Point, Stopped
from flexura.motion.pose import (
    Ends,
    Pose,
    end_force_changes,
    end_forces,
    part_motion_changes,
    part_motions,
    with_members,
)
from flexura.records import Latest, Record
from flexura.structure import Design, InputPort, OfDesign, Ports, Scatter


class Lever(NamedTuple):
    """What one unit of an input is: of an actuator between frames by its name, or a dead load (6,) on a node."""

    name: str
    node: int | None
    unit: Any


def commanded(model: MovingModel, port: InputPort) -> Lever:
    """What an input does to a mechanism that moves. Raises OptionError for motions of the base."""
    name = port.channel.name
    if port.warms:
        return Lever(name, None, 1.0)
    if port.base is not None:
        raise OptionError(
            f"{name} accelerates the base, which is at rest here: commands are of forces, moments and piezo stacks; a"
            " steady acceleration is gravity the other way"
        )
    Ports(model.design).refuse_stretching(port)
    if name in model.actuators:
        return Lever(name, None, port.stroke if port.stiffness is not None else 1.0)
    d, none = np.array(port.channel.direction), np.zeros(3)
    return Lever(name, port.nodes[0], np.append(none, d) if port.channel.quantity == "moment" else np.append(d, none))


@dataclass(frozen=True, repr=False)
class PosedDesign(Record):
    """A design where it has moved, the actuators free under the dead forces that hold it there."""

    _shown = ("words",)

    pose: Pose
    words: str

    @property
    def model(self) -> MovingModel:
        """The model that has moved there."""
        return self.pose.equations.model

    @property
    def _elements(self) -> Sequence[Group]:
        """The elements, those of actuators under their commands."""
        return self.model.commanded(self.pose.state.loads.actuators)

    @cached_property
    def K(self) -> sp.csc_matrix:
        """Tangent stiffness (n, n), N/m, N, N m, symmetric."""
        return sp.csc_matrix(self.pose.K)

    @cached_property
    def is_stable(self) -> bool:
        """Whether it stays there with actuators free under the forces that hold it."""
        return is_definite(self.pose.K)

    @cached_property
    def M(self) -> sp.csc_matrix:
        """Mass (n, n), kg, kg m, kg m^2."""
        return sp.csc_matrix(self.pose.M)

    @cached_property
    def positions(self) -> Array:
        """Positions (n_nodes, 3) of all nodes, m."""
        state = self.pose.state
        return self.model.positions(state.frames, state.loads.actuators)

    @cached_property
    def base_inertia_forces(self) -> Array:
        """Forces (n, 6) on the DOFs that accelerate everything, what is held included, in unit rigid motions of and
        about the global origin: kg, kg m, kg m^2."""
        model, frames = self.model, self.pose.state.frames
        rigid = rigid_arm(frames.x) * frames.placed[:, None, None]
        forces = np.zeros((model.n_dof + 1, 6))
        np.add.at(forces, model.dof, model.carried_inertia(frames) @ rigid)
        for group in model.elements:
            M = group.masses(frames)
            force = M @ rigid[group.node].reshape(*M.shape[:2], 6)
            np.add.at(forces, model.dof[group.node].reshape(M.shape[:2]), force)
        return forces[:-1]

    def dissipation(self, default: float) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """C (N s/m, N s, N m s) of dashpots and H (N/m, N, N m) of structural damping, K + i H, both (n, n).

        Dashpots turn with their nodes. H sums the stiffness that material gives every part, not that of forces, times
        its loss factor, `default` where it has none.
        """
        model, frames = self.model, self.pose.state.frames
        H: list[Array] = []
        places: list[Index] = []
        for group, loss in zip(self._elements, model.loss_factors(default), strict=True):
            own, *together = group.material(frames)
            H.append(loss[:, None, None] * own)
            members = group.strain.members if isinstance(group, PoseElements) else ()
            H += [loss[rows[:, 0], None, None] * added for rows, added in zip(members, together, strict=True)]
            places += [model.dof[node].reshape(len(node), -1) for node in (group.node, *group.coupled)]
        return sp.csc_matrix(model.viscous(frames)), Scatter(places, model.n_dof).sparse(H)

    @cached_property
    def rotations(self) -> Array:
        """Rotations (n_nodes, 3, 3) of all nodes from rest."""
        return self.pose.state.frames.R[self.model.root[:-1]]

    def member_ends(self) -> tuple[list[str], Index, Array, Array]:
        """Names (m,) of all members, the frames (m, 2) that carry their ends, and arms from there and positions
        (m, 2, 3) of these, m."""
        group, names = self.model.elements[0], self.model.names[0]
        if not with_members(self.model):
            return [], np.empty((0, 2), dtype=np.intp), np.empty((0, 2, 3)), np.empty((0, 2, 3))
        assert isinstance(group, PoseElements)
        ends = group.ends(self.pose.state.frames)
        first: dict[str, int] = {}
        last: dict[str, int] = {}
        for e, name in enumerate(names):
            first.setdefault(name, e)
            last[name] = e
        at = np.array([list(first.values()), list(last.values())]).T
        both = np.arange(2)
        return list(first), group.node[at, both], ends.arm[at, both], ends.position[at, both]

    @cached_property
    def end_forces(self) -> dict[str, Ends]:
        """Internal forces of members at the pose: (i, e, 6, 1) at the first and the second end of the elements of the i
        copies of each prototype, in axes that turn with these ends (theory eq. G15)."""
        return end_forces(self.model, [self.pose.state])

    def end_force_changes(self, vectors: Array) -> dict[str, Ends]:
        """What small displacements from the pose, DOF vectors (n, k), change of `end_forces`, (i, e, 6, k) (theory eq.
        G26)."""
        padded = np.concatenate([vectors, np.zeros((1, vectors.shape[1]))])
        return end_force_changes(self.model, self.pose.state, padded[self.model.dof])

    def part_motions(self, names: Collection[str]) -> dict[str, Array]:
        """How superelements of some names are deformed at the pose, (d, 1) each, in right-handed axes: displacements
        and rotations of their nodes as seen from the first, and amplitudes."""
        return part_motions(self.model, [self.pose.state], names)

    def part_motion_changes(self, vectors: Array, names: Collection[str]) -> dict[str, Array]:
        """What small displacements from the pose, DOF vectors (n, k), change of `part_motions`, (d, k)."""
        padded = np.concatenate([vectors, np.zeros((1, vectors.shape[1]))])
        return part_motion_changes(self.model, self.pose.state, padded[self.model.dof], names)

    def works(self, displacements: Array) -> Iterator[tuple[tuple[str, ...], Array | None, Array]]:
        """For each kind of elements: names (e,), of beams the strain energy (e, 6, k) by the components u, s2, s3, phi,
        theta2, theta3 of their deformation, else None, and all of it (e, k); J, for small displacements (n_nodes, 6, k)
        of all nodes from the pose.

        What forces at the pose add to the stiffness is not in it.
        """
        frames = self.pose.state.frames
        moved = np.concatenate([displacements, np.zeros((1, *displacements.shape[1:]))])
        for group, names in zip(self._elements, self.model.names, strict=True):
            u = moved[group.node].reshape(len(group.node), 6 * group.node.shape[1], moved.shape[-1])
            if isinstance(group, PoseElements) and group.are_beams:
                parts = group.works(frames, u)
                yield names, parts, parts.sum(axis=1)
            else:
                yield names, None, np.einsum("eik,eij,ejk->ek", u, group.material(frames)[0], u) / 2


def at_pose(design: Design) -> Design:
    """One design at the pose that its description names; as it is where none is, or where it is at one already.

    Raises as `reached`, and SolverError where the pose is unstable with actuators free under the forces that hold it.
    """
    if design.pose is not None or not design.plan.is_posed:
        return design
    there = reached(design)
    if not there.is_stable:
        place = there.words.removeprefix("about the pose ").partition(", actuators free")[0]
        raise SolverError(f"at {place} the mechanism is unstable: nothing stays linear about that pose for long")
    return replace(design, pose=there)


def reached(
    design: Design, near: PosedDesign | None = None, model: Callable[[], MovingModel] | None = None
) -> PosedDesign:
    """A design at the pose that its description names, reached from rest by a path of equilibria under the loads and
    gravity that are described, or from a pose `near` with the same displacements; the last one is kept with the plan.
    A `model` of the design without its pose need not be worked out again.

    Raises OptionError for what cannot turn, and SolverError where the path ends before, with the pose that it reached.
    """
    latest: Latest[PosedDesign] = design.plan.prepared.once("reached", Latest)
    return latest.get(design.values.tobytes(), lambda: _reached(design, near, model))


def _reached(design: Design, near: PosedDesign | None, known: Callable[[], MovingModel] | None) -> PosedDesign:
    plan = design.plan
    moved = plan.pose.moved(design.values)
    model = MovingModel.of(design) if known is None else known().under(design)
    names = [name.rpartition(".") for name in moved]
    numbers = plan.topology.numbers([node for node, _, _ in names]).tolist()
    drives = [
        Drive(name, number, int(model.root[number]), DISPLACEMENTS.index(axis))
        for name, number, (_, _, axis) in zip(moved, numbers, names, strict=True)
    ]
    for drive in drives:
        drive.refuse_half_turn(moved[drive.name])
        if model.dof[drive.root, drive.component] < 0:
            raise OptionError(f"at: {drive.name} cannot move: it is held by the ground")
    equations = Equations(model, drives)
    equations.independent()
    loads, commands = _loads(model)
    units = ["rad" if drive.component >= 3 else "m" for drive in drives]
    moves = [f"{name} = {value:.4g} {unit}" for (name, value), unit in zip(moved.items(), units, strict=True)]
    described = ", ".join([*moves, *commands])
    there, zero = Point(np.array(list(moved.values())), loads), np.zeros(len(drives))
    if near is None:
        state = equations.at_rest()
        path, points = Path(equations, state, Point(zero, NO_LOADS)), [Point(zero, loads), there][not loads.any :]
    else:
        state = near.pose.state
        path, points = Path(equations, state, Point(equations.travelled(state.frames), state.loads)), [there]
    for at in path.through(points):
        if isinstance(at, Stopped):
            of = "the displacements" if at.point == len(points) - 1 and drives else "the loads and commands"
            raise SolverError(
                f"at {described}: no equilibrium is found on the path there beyond {100 * at.share:.3g} % of {of};"
                " flexura stroke shows how far it goes"
            )
        state = at
    held = ", actuators free under the forces that hold it" if drives else ""
    return PosedDesign(Pose(equations, state), f"about the pose {described}{held}")


def _loads(model: MovingModel) -> tuple[Loads, list[str]]:
    """The loads, gravity, forces of the pose and commands that are described, and the latter two in words."""
    design = model.design
    plan = design.plan
    forces, commands = plan.pose.forces(design.values), plan.pose.commands(design.values)
    ports = _inputs(design, commands)
    units = ["N m" if name.rpartition(".")[2] in FORCES[3:] else "N" for name in forces]
    texts = [f"{name} = {size:.4g} {unit}" for (name, size), unit in zip(forces.items(), units, strict=True)]
    texts += [
        f"{p.channel.name} = {c:.4g} {p.channel.unit}".removesuffix(" 1")
        for p, c in zip(ports, commands.values(), strict=True)
    ]
    return loads_with(model, forces, commands), texts


def _inputs(design: Design, commands: Mapping[str, Any]) -> Sequence[InputPort]:
    return Ports(Design.of(design.plan.at_rest(), design.parameters)).commands(list(commands)) if commands else []


def loads_with(model: MovingModel, force: Mapping[str, Any], command: Mapping[str, Any]) -> Loads:
    """The loads and gravity that are described, with dead forces and moments, N and N m, `carriage.Fy`, and commands of
    actuators by name. Raises OptionError for commands that move the base."""
    design, described = model.design, described_loads(model.design)
    dead, actuators = dict(described.dead), dict[str, Any]()
    wrenches: dict[int, Any] = {}
    for name, size in force.items():
        node, _, axis = name.rpartition(".")
        number = int(design.plan.topology.numbers([node])[0])
        wrenches[number] = wrenches.get(number, 0.0) + size * np.eye(6)[FORCES.index(axis)]
    for port, size in zip(_inputs(design, command), command.values(), strict=True):
        lever = commanded(model, port)
        if lever.node is None:
            actuators[lever.name] = size * lever.unit
        else:
            wrenches[lever.node] = wrenches.get(lever.node, 0.0) + size * lever.unit
    for number, wrench in wrenches.items():
        dead[number] = dead[number] + wrench if number in dead else wrench
    return Loads(dead, {}, described.gravity, actuators)


def warming_load(design: Design, state: str) -> tuple[Array, Array]:
    """Forces (n,) by one unit of a state of temperature on a design where it is, N and N m, and what nodes (n_nodes, 6)
    move by it beside the frames that they follow, m and rad, global axes, both linear (theory eqs. W15-W16).

    Raises as `Temperatures.of`, and OptionError for what expands in a way that is not known.
    """
    if design.posed is None:
        model = MovingModel.of(design)
        load, growth = model.load_of(state, model.rest)
        return load, growth[:-1]
    posed = design.posed
    assert isinstance(posed, PosedDesign)
    model, there = posed.model, posed.pose.state
    load, growth = model.load_of(state, there.frames, there.loads.actuators)
    turned = there.frames.R[model.root][:, None] @ growth.reshape(-1, 2, 3, 1)
    return load, turned.reshape(-1, 6)[:-1]


def pose_of(model: OfDesign) -> PosedDesign | None:
    """The pose about which a model is linear; None at rest."""
    posed = model.design.posed
    assert posed is None or isinstance(posed, PosedDesign)
    return posed
