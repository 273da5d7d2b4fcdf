"""Whether linear displacements are those that large ones would be: what bends between ends that cannot come nearer
stiffens, from motions of its own thickness on, and links that turn change the ratio of what they drive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis.limits.limits import States, largest, member_rows, motion_limits, stress_limits, times
from flexura.analysis.strain import bent_plates
from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.motion import Equations, Frames, Loads, MovingModel, Path, Point, Stopped, commanded, unstable
from flexura.structure import FullOrderModel, InputPort
from flexura.tables import quantity

DIFFERENT_SIZE = 0.02
"""Share of the motion by which large displacements make a difference that is reported."""

STIFFENING_DEFLECTION = 0.1
"""Deflection of a member over its thickness below which being held along stiffens it by less than 1 %: by 0.72 times
the square of it where both ends are clamped and one is shifted."""

RATIO_CHANGING_ROTATION = 2e-4
"""Rotation, rad, below which links inclined by one degree, as in bridges, change their ratio by less than 1 %."""

MOST_COORDINATES = 5000
"""Coordinates up to which large displacements are looked for, which takes some seconds then."""

NO_DISPLACEMENT = 1e-6
"""Displacement over rotation times size that is round-off of none."""

MOST_COMMANDS = 12
"""Commands of which all combinations of least and largest are looked at."""


class Bent(NamedTuple):
    """A state u (n,), of a number, that bends a member `share` times a tenth of its thickness, or turns a node by
    `share` times 0.2 mrad, and what is said of when."""

    share: float
    state: int
    u: Array
    when: str


def bent_most(states: States) -> Bent | None:
    """The state that bends a member most beside its thickness, or turns most; None where none is bent by a tenth of it
    and nothing turns by 0.2 mrad, so that linear displacements are right, about a pose, whose own motion is large, and
    of models that are too large (`not_looked_at`)."""
    if states.model.plan.is_posed or not states.columns.size or states.model.order > MOST_COORDINATES:
        return None
    names, _, bends = member_rows(states.model, states.columns)
    moved = states.model.node_displacements(states.columns)
    thickness, turns, plates = _thickness(states.model), moved[:, 3:], _plates(states.model, moved)
    scale = [
        STIFFENING_DEFLECTION * np.repeat([thickness.get(name, np.inf) for name in names], 2),
        np.full(len(turns), RATIO_CHANGING_ROTATION),
        np.full(len(plates), STIFFENING_DEFLECTION),
    ]
    worst = largest(np.concatenate([bends, turns, plates]), np.concatenate(scale), states)
    if worst is None:
        return None
    return Bent(worst.value, worst.state, states.at(np.array([worst.state]))[:, 0], states.when(worst.state))


def not_looked_at(model: FullOrderModel) -> tuple[str, ...]:
    """A note for models of so many coordinates that large displacements are not looked for."""
    if model.order <= MOST_COORDINATES or model.plan.is_posed:
        return ()
    return (f"whether it moves as far with large displacements was not looked at: {model.order} coordinates",)


def stiffening_limits(
    model: FullOrderModel, bent: Bent | None, inputs: Sequence[InputPort] = (), commands: ArrayLike = ()
) -> tuple[Diagnostic, ...]:
    """Warnings where large displacements are another size than the linear ones of the state that bends most, and where
    they lead to a state that is unstable, as of leaves that buckle sideways.

    Displacements are those from rest without loads, also where loads are described, about which the stiffness is. The
    forces that hold the linear state are put on the mechanism as dead loads, but for those of actuators between nodes
    among the inputs, which turn with these, and its equilibrium is sought from rest. Its size beside the linear state
    is that of the multiple of this that is nearest, in displacements of all nodes. It holds for statics alone: what
    inertia holds at an instant is no measure of a whole motion.
    """
    if bent is None:
        return ()
    try:
        equations = Equations(MovingModel.of(model.design))
        there = Point(np.empty(0), _holding(equations.model, model, bent.u, inputs, np.asarray(commands, dtype=float)))
        state = Path.from_rest(equations, there)
    except (OptionError, SolverError) as reason:
        text = f"whether it moves as far with large displacements is not known{bent.when}: {reason}"
        return (Diagnostic("stiffness", "", np.nan, 1.0, "1", text),)
    if isinstance(state, Stopped):
        text = f"with large displacements no equilibrium is found beyond {state.share:.3g} times this state{bent.when}"
        return (Diagnostic("stiffness", "", state.share, 1.0, "1", text),)
    warnings = _other_size(model, bent, _displacements(equations.model, state.frames), equations.size)
    if unstable_modes := unstable(equations, state):
        text = f"the state under large displacements is unstable{bent.when}"
        return (*warnings, Diagnostic("stiffness", "", float(unstable_modes), 0.0, "1", text))
    return warnings


def _other_size(model: FullOrderModel, bent: Bent, large: Array, size: float) -> tuple[Diagnostic, ...]:
    """The warning, if large displacements (n_nodes, 3) are of another size than the linear ones: by the multiple of
    these that is nearest to them, and at the node that differs most. What turns about an axis through all nodes,
    beside the size of the mechanism, m, moves none of them."""
    topology, moved = model.plan.topology, model.node_displacements(bent.u[:, None])[..., 0]
    linear = np.where(topology.has_position[:, None], moved[:, :3], 0.0)
    if np.abs(linear).max() <= NO_DISPLACEMENT * size * np.abs(moved[:, 3:]).max():
        return ()
    share = float((large * linear).sum() / (linear**2).sum())
    if abs(share - 1) <= DIFFERENT_SIZE:
        return ()
    far, near = (np.linalg.norm(u, axis=1) for u in (np.where(linear != 0, large, 0.0), linear))
    node = int(np.abs(far - near).argmax())
    name = topology.node_names[node].partition("[")[0]
    there, here = quantity(float(far[node]), "m", 4), quantity(float(near[node]), "m", 4)
    alone = f"{times(far[node] / near[node])} times as far, " if near[node] > 0 else ""
    text = (
        f"with large displacements all nodes together move {times(share)} times as far{bent.when}; {name}, which"
        f" differs most, moves {alone}{there} in place of {here}: flexura stroke follows them"
    )
    return (Diagnostic("stiffness", name, share, 1.0, "1", text),)


def _thickness(model: FullOrderModel) -> dict[str, float]:
    """The least thickness of placed members, m; of sections by constants that of the rectangle which has these."""
    thickness = dict[str, float]()
    for name in model.matrices:
        part = model.plan.parts[name]
        members, nu = list(part.members), part.table.moduli(model.values)[2]
        for group, _, _ in part.table.groups:
            length = model.geometry.parts[name].length[group.index]
            A, Iy, Iz, *_ = group.properties(model.values, nu[group.index], length, np.linspace(0, 1, 9))
            thin = np.broadcast_to(np.sqrt(12 * np.minimum(Iy, Iz) / A), (len(group.index), 9)).min(axis=1)
            for path in model.plan.topology.copies[name].paths:
                thickness |= {".".join((*path, members[k])): float(t) for k, t in zip(group.index, thin, strict=True)}
    return thickness


def _plates(model: FullOrderModel, moved: Array) -> Array:
    """Deflections (p, 3, c) of placed diaphragms over their thickness in displacements (n_nodes, 6, c)."""
    rows = [bent.deflection[None] for bent in bent_plates(model, moved) if bent.plate is not None]
    return np.concatenate([np.empty((0, 3, moved.shape[2])), *rows])


def _holding(
    moving: MovingModel, model: FullOrderModel, u: Array, inputs: Sequence[InputPort], commands: Array
) -> Loads:
    """What holds a linear state: commands of actuators between nodes, and all other forces as dead loads."""
    force, actuators = model.K @ u, dict[str, float]()
    for port, command in zip(inputs, commands.tolist(), strict=True):
        lever = None if port.base is not None or not command else commanded(moving, port)
        if lever is not None and lever.node is None:
            force = force - command * port.load
            actuators[lever.name] = command * float(lever.unit)
    topology, force = model.plan.topology, np.append(force, 0.0)
    roots = np.flatnonzero((topology.root == np.arange(topology.n_nodes)) & (topology.dof >= 0).any(axis=1))
    return Loads({int(node): force[topology.dof[node]] for node in roots}, {}, np.zeros(3), actuators)


def _displacements(model: MovingModel, frames: Frames) -> Array:
    """Displacements (n_nodes, 3) of all nodes in a state, m."""
    root = model.root
    turned = (frames.R[root] - model.rest.R[root]) @ model.arm[..., None]
    return (frames.x[root] - model.rest.x[root] + turned[..., 0])[:-1]


def workspace_limits(model: FullOrderModel, columns: Array, inputs: Sequence[InputPort]) -> tuple[Diagnostic, ...]:
    """Motion and stress at the corners of the range of inputs, `columns` (n, a) being displacements per command.

    These are largest at corners, as they are convex. Nothing is said without limits, nor for more than twelve inputs.
    """
    box = np.array([port.limits for port in inputs]).reshape(-1, 2)
    if not len(box) or len(box) > MOST_COMMANDS or not np.isfinite(box).all():
        return ()
    corners = np.stack(np.meshgrid(*box, indexing="ij"), axis=0).reshape(len(box), -1)
    states = States(model, columns, corners, lambda _: " at a corner of the range of commands")
    bent = None if model.plan.is_loaded else bent_most(states)  # commands move it from where loads have moved it
    commands = corners[:, bent.state] if bent is not None else corners[:, 0]
    return (*motion_limits(states), *stiffening_limits(model, bent, inputs, commands), *stress_limits(states))
