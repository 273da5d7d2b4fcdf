"""The mechanism over its stroke: equilibria with displacements prescribed, and what it is about each of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.analysis.doubts import corrected
from flexura.analysis.numbers import finite_numbers
from flexura.analysis.stress import Stresses, YieldRatios, ratios_to_yield, worst_stresses
from flexura.analysis.stroke_columns import stroke_columns
from flexura.analysis.stroke_pose import Asked, StrokePose, stroke_poses
from flexura.arguments import verb
from flexura.deadline import Listener, Progress, checkpoint
from flexura.errors import Exceeded, OptionError, SolverError
from flexura.linalg import leading
from flexura.mechanism import DOF_NAMES, Mechanism
from flexura.motion import (
    NO_LOADS,
    Bend,
    Drive,
    Equations,
    Equilibrium,
    Frames,
    Loads,
    MovingModel,
    Path,
    Point,
    Pose,
    Stopped,
    bends,
    end_forces,
)
from flexura.results import Tabular
from flexura.structure import Design, FullOrderModel, Plan, assemble

Array = NDArray[np.float64]

AXES = {"x": 0, "y": 1, "z": 2, **{name: k for k, name in enumerate(DOF_NAMES)}}

HALF_TURN = 3.1
"""Largest component, rad, of a rotation vector that is prescribed; it ends at half a turn."""

INDEPENDENT = 1e-9
"""What of a prescribed displacement others must leave free, over its own size."""

NO_YIELD = YieldRatios((), np.empty((0, 0)), np.empty((0, 0)))

UNSTABLE = "is not stable: whatever holds it would have to hold it against its own springing away"


@dataclass(frozen=True, repr=False)
class Stroke(Tabular):
    """Poses of a mechanism, in the order in which they were asked for. `stopped` says why some may be missing,
    `bent` which members bend further within an element than is accurate.

    `yield_ratios` has stress over yield stress by member and pose. `end_forces` are the internal forces (i, e, 6,
    poses) at the first and the second end of the elements of all copies of prototypes, N and N m, in the axes of the
    members. `frames` are those of all nodes at each pose.
    """

    _shown = ("name", "poses")
    _told = ("poses",)

    model: FullOrderModel
    poses: tuple[StrokePose, ...]
    stopped: tuple[str, ...]
    bent: tuple[Exceeded, ...]
    yield_ratios: YieldRatios
    end_forces: dict[str, tuple[Array, Array]]
    frames: tuple[Frames, ...]

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.model.name

    @cached_property
    def warnings(self) -> tuple[Exceeded, ...]:
        """Poses that are not there, not stable or not proven, and members that bend too far for their elements or are
        stressed beyond yield."""
        found = [Exceeded("equilibrium", "", np.nan, np.nan, "1", text) for text in self.stopped]
        for pose in self.poses:
            if pose.frequency_hz_held and pose.frequency_hz_held[0] < 0:
                text = f"at {_words(pose.move)} the mechanism {UNSTABLE}"
                found.append(Exceeded("buckling", "", pose.frequency_hz_held[0], 0.0, "Hz", text))
            if not pose.proven:
                text = f"at {_words(pose.move)} natural frequencies are not proven, and some may be missed"
                found.append(Exceeded("proof", "", np.nan, np.nan, "Hz", text))
        return (*found, *self.bent, *self._beyond_yield())

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Members whose corrections converge slowly with their elements away from rest."""
        held = [name for name, own in corrected(self.model)[0].items() if "warping" in own]
        if not held:
            return ()
        return (
            f"{', '.join(held[:3])}{' and others' if len(held) > 3 else ''}: stiffened near the ends by held warping."
            " Away from rest, support stiffness and frequencies then converge with the square of the elements' length:"
            " at 0.16 of the length of a leaf 50 x 15 x 0.4 mm stiffness across is 10 % off with 8, 3 % with 16, 0.8 %"
            " with 32. Compare with twice as many",
        )

    def _beyond_yield(self) -> Iterator[Exceeded]:
        """A warning for every member that yields, with the pose nearest to rest where it does, and the worst one."""
        if not self.poses:
            return
        travel = np.array([list(pose.move.values()) for pose in self.poses])
        away = (np.abs(travel) / np.maximum(np.abs(travel).max(axis=0, initial=0.0), 1e-300)).sum(axis=1)
        for name, ratio in zip(self.yield_ratios.names, self.yield_ratios.ratio, strict=True):
            beyond = np.flatnonzero(ratio > 1)
            if len(beyond):
                first, worst = int(beyond[away[beyond].argmin()]), int(leading(ratio))
                text = (
                    f"{name} is stressed beyond its yield stress, first at {_words(self.poses[first].move)} and most at"
                    f" {_words(self.poses[worst].move)}, {ratio[worst]:.3g} times"
                )
                yield Exceeded("stress", name, float(ratio[worst]), 1.0, "1", text)

    def stresses(self, pose: int | None = None) -> Stresses:
        """The largest stress in every link and flexure at a pose, by its number, or over all poses, of which `state`
        then is the number. Raises OptionError where there is no such pose."""
        count = len(self.poses)
        if pose is None and count:
            return worst_stresses(self.model, self.end_forces.__getitem__)
        if pose is None or not 0 <= pose < count:
            raise OptionError(f"there is no pose {pose!r} of {count}")

        def forces(name: str) -> tuple[Array, Array]:
            start, end = self.end_forces[name]
            return start[..., pose : pose + 1], end[..., pose : pose + 1]

        return worst_stresses(self.model, forces)

    @property
    def frequencies_hz(self) -> Array:
        """Natural frequencies (poses, n), the drives free, each column tracked by shape from the first pose on."""
        rows = [[pose.frequency_hz[k] if k >= 0 else np.nan for k in pose.tracked] for pose in self.poses]
        return np.array(rows).reshape(len(rows), -1)

    def _columns(self) -> dict[str, Any]:
        return stroke_columns(self.poses)


@verb
def stroke(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    move: Mapping[str, float | tuple[float, float]],
    steps: int = 21,
    n: int = 6,
    loads: Mapping[str, ArrayLike] | None = None,
    gravity: Sequence[float] | None = None,
    nodes: Sequence[str] | None = None,
    compliance: bool = False,
    progress: Listener | None = None,
) -> Stroke:
    """The mechanism over the stroke of some displacements, with large displacements and rotations.

    `move` prescribes displacements by name, `carriage.y` or `platform.rz`, from rest: (from, to), m or rad, in `steps`
    poses at equal distances, or a single number for one pose. Several move together. Rotations are components of the
    rotation vector. `loads`, (6,) N and N m by node, and `gravity`, (3,) m/s^2, are dead and on all the way, beside
    those that are described. At each pose the `n` lowest modes are about the deformed state, none missed; `nodes` are
    those whose displacements are told, by default those that move, with `compliance` also their compliances and
    stiffnesses, (6, 6) each. `progress` is told of every pose.

    Every state is reached from rest by a way of equilibria. Where one ends, the poses beyond are missing, with the
    reason among the warnings. Members bend, twist and turn as far as they like, with small strains; material is
    elastic, sections keep their shape, and nothing touches (theory eqs. G1-G19).

    Raises ModelError, OptionError for unknown nodes and axes, displacements that are held or follow from each
    other, ranges without steps, and SolverError when nothing moves at all.
    """
    full = assemble(model, parameters)
    if not isinstance(n, int | np.integer) or n < 1:
        raise OptionError(f"the number of modes is a whole number, at least 1, not {n!r}")
    moving = MovingModel.of(full.design)
    drives = [_drive(moving, name) for name in move]
    if not drives:
        raise OptionError("move names at least one displacement, as in {'carriage.y': (-0.01, 0.01)}")
    targets = _targets(move, steps)
    asked = [d.name.rsplit(".", 1)[0] for d in drives] if nodes is None else list(nodes)
    asked = list(dict.fromkeys(asked))
    numbers = dict(zip(asked, full.plan.topology.numbers(asked).tolist(), strict=True))
    equations = Equations(moving, drives)
    applied = _loads(full.design, loads, gravity)
    _independent(equations)
    start = _start(equations, applied)
    states: dict[int, Equilibrium] = {}
    stopped: list[str] = []
    for way in _ways(targets):
        points = [Point(targets[k], applied) for k in way]
        path = Path(equations, start, Point(np.zeros(len(drives)), applied))
        for k, state in zip(way, path.through(points), strict=False):
            checkpoint()
            if isinstance(state, Stopped):
                stopped.append(_why(state, equations, way, targets))
                break
            states[k] = state
            if progress is not None:
                progress(Progress("poses", len(states), len(targets)))
    order = sorted(states)
    reached = [states[k] for k in order]
    forces = end_forces(moving, reached, applied.gravity)
    yields = ratios_to_yield(full, forces.__getitem__, len(reached)) if reached else NO_YIELD
    poses = stroke_poses(equations, reached, targets[order], applied, yields, Asked(n, numbers, compliance))
    frames = tuple(state.frames for state in reached)
    return Stroke(full, tuple(poses), tuple(stopped), _bent(moving, reached), yields, forces, frames)


def _component(name: str) -> int:
    return AXES[name.rsplit(".", 1)[1]]


def _drive(model: MovingModel, name: str) -> Drive:
    """The prescribed displacement of a name such as `carriage.y`. Raises OptionError where there is none."""
    node, _, axis = name.rpartition(".")
    if not node or axis not in AXES:
        raise OptionError(f"{name!r} is no displacement: write NODE.AXIS, an axis of {', '.join(AXES)}")
    number = int(model.design.plan.topology.numbers([node])[0])
    root, component = int(model.root[number]), AXES[axis]
    if model.dof[root, component] < 0:
        raise OptionError(f"{name} cannot move: it is held by the ground")
    return Drive(name, number, root, component)


def _targets(move: Mapping[str, float | tuple[float, float]], steps: int) -> Array:
    """Displacements (poses, drives). Raises OptionError for what is no range."""
    ends = []
    for name, given in move.items():
        try:
            values = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            values = np.array(np.nan)
        if values.shape not in ((), (2,)) or not np.isfinite(values).all():
            raise OptionError(f"{name} moves to a number, or from one to another, not {given!r}")
        if _component(name) >= 3 and np.abs(values).max() > HALF_TURN:
            raise OptionError(
                f"{name} is a component of a rotation vector, up to {HALF_TURN} rad, not {given!r}: beyond it,"
                " a displacement of what turns may be moved, or a moment put on"
            )
        ends.append(values)
    if all(own.ndim == 0 for own in ends):
        return np.array([[float(own) for own in ends]])
    if not isinstance(steps, int | np.integer) or steps < 2:
        raise OptionError(f"a range has at least 2 steps, not {steps!r}")
    share = np.linspace(0.0, 1.0, steps)[:, None]
    low, high = (np.array([float(own.ravel()[k]) for own in ends]) for k in (0, -1))
    return low + share * (high - low)


def _ways(targets: Array) -> Iterator[list[int]]:
    """Ways from rest through all poses: from the one that is nearest to rest to both sides."""
    size = np.abs(targets).max(axis=0)
    first = int(np.argmin((np.abs(targets) / np.where(size > 0, size, 1.0)).sum(axis=1)))
    yield list(range(first, len(targets)))
    if first:
        yield list(range(first - 1, -1, -1))


def _independent(equations: Equations) -> None:
    """Raise OptionError where displacements that are prescribed cannot be, all by themselves, at rest."""
    rows = equations.tangent(equations.model.rest, NO_LOADS, np.zeros(len(equations.drives)))[0].rows / equations.scale
    for k, drive in enumerate(equations.drives):
        others = rows[:k]
        left = rows[k] - np.linalg.lstsq(others.T, rows[k], rcond=None)[0] @ others
        if np.linalg.norm(left) < INDEPENDENT * np.linalg.norm(rows[k]):
            before = ", ".join(own.name for own in equations.drives[:k])
            raise OptionError(f"{drive.name} already follows from {before}: one of them is enough")


def _loads(design: Design, loads: Mapping[str, ArrayLike] | None, gravity: Sequence[float] | None) -> Loads:
    """Dead loads and gravity, those that are described and those that are given."""
    plan = design.plan
    g = plan.loads.gravity(design.values) if gravity is None else finite_numbers("gravity", gravity, 3)
    wrenches: dict[str, Array] = dict(plan.loads.wrenches(design.values))
    for node, value in (loads or {}).items():
        wrenches[node] = wrenches.get(node, np.zeros(6)) + finite_numbers(f"load on {node}", value, 6)
    numbers = plan.topology.numbers(list(wrenches)).tolist()
    return Loads(dict(zip(numbers, wrenches.values(), strict=True)), {}, g)


def _start(equations: Equations, loads: Loads) -> Equilibrium:
    """The state with nothing moved and the loads on. Raises SolverError where there is none."""
    zero = np.zeros(len(equations.drives))
    start = equations.solve(equations.model.rest, NO_LOADS, zero)
    if not loads.any:
        return start
    path = Path(equations, start, Point(zero, NO_LOADS))
    state = next(iter(path.through([Point(zero, loads)])))
    if isinstance(state, Stopped):
        raise SolverError(f"the loads are too large: no equilibrium is found beyond {100 * state.share:.3g} % of them")
    return state


def _why(stopped: Stopped, equations: Equations, way: list[int], targets: Array) -> str:
    """Where a way ends, in words."""
    reached = equations.travelled(stopped.last.frames)
    names = [drive.name for drive in equations.drives]
    last = _words(dict(zip(names, reached.tolist(), strict=True)))
    aim = _words(dict(zip(names, targets[way[stopped.point]].tolist(), strict=True)))
    pose = Pose(equations, stopped.last)
    held = pose.modes(1, held=True).values
    state = "there it is not stable" if len(held) and held[0] < 0 else "there it is stable"
    return (
        f"no equilibrium is found beyond {last}, on the way to {aim}: {state}; where the drive has to turn back, as in"
        " a snap-through, another displacement may be moved, and members that bend sharply want more elements"
    )


def _bent(model: MovingModel, states: Sequence[Equilibrium]) -> tuple[Exceeded, ...]:
    """Members and superelements that bend further within an element than is accurate, each at its worst."""
    worst: dict[str, Bend] = {}
    for state in states:
        for bend in bends(model, state.frames):
            if bend.name not in worst or bend.share > worst[bend.name].share:
                worst[bend.name] = bend
    found = []
    for name, bend in worst.items():
        if bend.elements:
            kind = "mesh"
            text = (
                f"member {name}: one of its elements, {bend.elements} in all, bends by {bend.angle:.3g} rad, more than"
                f" the {bend.limit} rad up to which stiffnesses are accurate: it wants more elements"
            )
        else:
            kind = "rotation"
            text = (
                f"superelement {name}: it turns by {bend.angle:.3g} rad within itself, more than {bend.limit} rad;"
                " it is linear inside"
            )
        found.append(Exceeded(kind, name, bend.angle, bend.limit, "rad", text))
    return tuple(found)


def _words(move: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.6g} {'rad' if _component(name) >= 3 else 'm'}" for name, value in move.items())
