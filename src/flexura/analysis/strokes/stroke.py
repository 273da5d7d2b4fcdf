"""The mechanism over its stroke: equilibria with displacements prescribed, and what it is about each of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis.limits import coarse_mesh, has_stops, solids_that_meet, stops_met
from flexura.analysis.model_error import Assumptions, ModelError, frequency_errors, interval_text
from flexura.analysis.strain import (
    Deformations,
    EndForces,
    Stresses,
    StressProfiles,
    YieldRatios,
    edge_notes,
    moved_deformations,
    part_stresses,
    ratios_to_yield,
    stress_profiles,
    worst_stresses,
)
from flexura.analysis.strokes.equilibrium_path import (
    INTERRUPTED,
    Continuation,
    FromTo,
    Inputs,
    Prescribed,
    prescribed,
    values_text,
)
from flexura.analysis.strokes.low_order_motion import LowOrderMotion, low_order_motion
from flexura.analysis.strokes.pose import Requested, StrokePose, pose_columns, short_columns, stroke_poses
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import at_rest
from flexura.linalg import leading
from flexura.mechanism import DOF_NAMES, UNITS, ForceSensor, Mechanism
from flexura.motion import Equations, Equilibrium, Frames, MovingModel, beyond, end_force_changes, end_forces
from flexura.results import Tabular, plain
from flexura.structure import FullOrderModel, Plan
from flexura.systems import Order
from flexura.tables import Facts, Item, Line, Table, counted

STEPS, MODES = 21, 6
"""Poses of a stroke, and modes at each, where nothing else is requested."""

WATCHED_BODIES = 2
"""Bodies whose displacements are reported where nothing says of which nodes."""

LEFT_OUT = "not modelled: contact, plasticity, distortion of sections"

BUT_STOPS = LEFT_OUT.replace("contact", "contact but that of stops")

FLUTTER = "follower loads: stability and frequencies are of the symmetric part of the stiffness, flutter is not seen"

NO_YIELD = YieldRatios((), np.empty((0, 0)), np.empty((0, 0)), np.empty((0, 0, 3)))

OF_LOW_ORDER = (
    "intervals of frequencies are about the low order, which has no buckling factors; weight acts where substructures"
    " are attached, so that stresses lack the bending of members between by their own weight"
)

MOST_POSES = 41
"""Of a stroke, that are shown."""

STILL = 1e-7
"""Displacements below so much of the largest translation, or rotation, of a node are none."""


class Spectrum(NamedTuple):
    """Small motions about a state: eigenvalues (k,) and M-orthonormal vectors (n, k)."""

    state: Equilibrium
    values: Array
    vectors: Array


@dataclass(frozen=True, repr=False)
class Stroke(Tabular):
    """Poses of a mechanism, in the order in which they were asked for. `stopped` says why some may be missing,
    `critical` limit points and bifurcations, `doubts` which members bend further within an element than is
    accurate, or are stretched by twist, and which actuators are driven beyond their limits.

    `yield_ratios` has stress over yield stress by member and pose. `end_forces` are the internal forces (i, e, 6,
    poses) at the first and the second end of the elements of all copies of prototypes, N and N m, in the axes of the
    members, `deformed` (d, poses) how parts are deformed, by name. `frames` are those of all nodes at each pose,
    `units` those of all that is prescribed, by name. `low_order` is what represents the full order, where that was
    requested, `spectra` what `model_errors` need.
    """

    _shown = ("name", "poses")

    model: FullOrderModel
    poses: tuple[StrokePose, ...]
    stopped: tuple[str, ...]
    critical: tuple[Diagnostic, ...]
    doubts: tuple[Diagnostic, ...]
    yield_ratios: YieldRatios
    end_forces: dict[str, tuple[Array, Array]]
    deformed: Deformations
    frames: tuple[Frames, ...]
    units: dict[str, str]
    low_order: LowOrderMotion | None = None
    has_follower_loads: bool = False
    spectra: tuple[Spectrum, ...] = field(default=(), repr=False)

    @cached_property
    def model_errors(self) -> tuple[ModelError, ...]:
        """How far the part may be from the model, in `frequency_hz` of every pose; none at low order."""
        if not self.spectra:
            return ()
        assumptions = Assumptions(self.model)
        errors = []
        for state, values, vectors in self.spectra:
            moving, stable = state.tangent.model, np.flatnonzero(values > 0)
            padded = np.concatenate([vectors[:, stable], np.zeros((1, len(stable)))])
            wrenches = end_force_changes(moving, state, padded[moving.dof])
            known = assumptions.of(wrenches, vectors[:, stable])
            error = frequency_errors(self.model, values[stable], vectors[:, stable], len(stable), known)
            low, high = np.full((2, len(values)), np.nan)
            low[stable], high[stable] = error.low, error.high
            reasons = dict(zip(stable.tolist(), error.reason, strict=True))
            reason = tuple(reasons.get(k, "unstable") for k in range(len(values)))
            errors.append(replace(error, low=low, high=high, reason=reason))
        return tuple(errors)

    def _data(self) -> dict[str, Any]:
        errors = [error.intervals for error in self.model_errors] or [None] * len(self.poses)
        poses = zip(self.poses, errors, strict=True)
        return {"poses": [{**plain(pose), "model_error": error} for pose, error in poses]}

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.model.name

    @property
    def interrupted(self) -> bool:
        """Whether an interruption broke it off."""
        return any(text.startswith(INTERRUPTED) for text in self.stopped)

    @cached_property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Poses that are not there, unstable or not proven, members that bend too far for their elements or are
        stressed beyond yield, and solids that meet."""
        warnings = [Diagnostic("equilibrium", "", np.nan, np.nan, "1", text) for text in self.stopped]
        warnings += self.critical
        for run in self._runs(lambda pose: bool(pose.frequency_hz_held) and pose.frequency_hz_held[0] < 0):
            text = f"{self._where(run)} the mechanism is unstable, even with its actuators locked"
            lowest = min(pose.frequency_hz_held[0] for pose in run)
            warnings.append(Diagnostic("buckling", "", lowest, 0.0, "Hz", text))
        for run in self._runs(lambda pose: not pose.proven):
            text = f"{self._where(run)} natural frequencies are not proven, and some may be missed"
            warnings.append(Diagnostic("proof", "", np.nan, np.nan, "Hz", text))
        low = () if self.low_order is None else self.low_order.warnings
        return (*warnings, *low, *self.doubts, *self._coarse_meshes(), *self._beyond_yield(), *self._contacts())

    def _runs(self, holds: Callable[[StrokePose], bool]) -> list[list[StrokePose]]:
        """Poses one after another for which something holds."""
        return [list(run) for true, run in groupby(self.poses, holds) if true]

    def _where(self, run: list[StrokePose]) -> str:
        """The place of poses one after another."""
        first, last = self._text(run[0]), self._text(run[-1])
        return f"at {first}" if len(run) == 1 else f"from {first} to {last}, {len(run)} poses,"

    def _text(self, pose: StrokePose) -> str:
        """What is prescribed at a pose, in words."""
        return values_text(pose.varied, self.units)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What is left out, and what stands for the full order."""
        left_out = BUT_STOPS if has_stops(self.model) else LEFT_OUT
        notes = (left_out,) if self.low_order is None else (left_out, self.low_order.note, OF_LOW_ORDER)
        notes = (*notes, FLUTTER) if self.has_follower_loads else notes
        for met in stops_met(self.model, self.frames):
            first = self._text(self.poses[min(met.poses, key=self._travel.__getitem__)])
            notes = (*notes, f"{met.text}, first at {first}")
        return (*notes, *edge_notes(part_stresses(self.model, self.deformed)))

    def _coarse_meshes(self) -> Iterator[Diagnostic]:
        """A warning for every member and superelement that makes stiffnesses wrong, with the worst pose."""
        reported = {warning.place for warning in self.doubts if warning.kind == "mesh"}
        for name in dict.fromkeys(name for pose in self.poses for name in pose.mesh_error if name not in reported):
            worst = max(self.poses, key=lambda pose: pose.mesh_error.get(name, 0.0))
            warning = coarse_mesh(self.model, name, worst.mesh_error[name], f"at {self._text(worst)}")
            if warning is not None:
                yield warning

    def _beyond_yield(self) -> Iterator[Diagnostic]:
        """A warning for every member that yields, with the least displaced pose where it does, and the worst one."""
        for name, ratio in zip(self.yield_ratios.names, self.yield_ratios.ratio, strict=True):
            yielding = np.flatnonzero(ratio > 1)
            if len(yielding):
                first = yielding[self._travel[yielding].argmin()]
                first, worst = (self._text(self.poses[k]) for k in (first, leading(ratio)))
                most = float(ratio.max())
                where = f"first at {first} and most at {worst}, {most:.3g} times"
                text = f"{name} is stressed beyond its yield stress, {where}"
                yield Diagnostic("stress", name, most, 1.0, "1", text)

    def _contacts(self) -> Iterator[Diagnostic]:
        """A warning for every pair of solids that are apart when undeformed and meet, with the least displaced pose."""
        meetings, all_seen = solids_that_meet(self.model, self.frames)
        for meeting in meetings:
            where = self._text(self.poses[min(meeting.poses, key=self._travel.__getitem__)])
            text = f"{meeting.first} and {meeting.second} meet, first at {where}, and go through each other from there"
            yield Diagnostic("contact", meeting.first, np.nan, np.nan, "m", text)
        if not all_seen:
            text = "so many parts lie side by side that not all were looked at for whether they meet"
            yield Diagnostic("contact", "", np.nan, np.nan, "m", text)

    @cached_property
    def _travel(self) -> Array:
        """How far poses (p,) are from the undeformed configuration: the sum of what is prescribed, each over its
        largest value."""
        travel = np.abs([list(pose.varied.values()) for pose in self.poses])
        return (travel / np.maximum(travel.max(axis=0, initial=0.0), 1e-300)).sum(axis=-1)

    def stresses(self, pose: int | None = None) -> Stresses:
        """The largest stress in every link, flexure and part at a pose, by its number, or over all poses, of which
        `state` then is the number. Raises OptionError where there is no such pose."""
        if pose is None and self.poses:
            return worst_stresses(self.model, self.end_forces.__getitem__, self.deformed)
        return worst_stresses(self.model, self._forces(pose), self._deformed(pose))

    def stress_profiles(self, pose: int) -> StressProfiles:
        """Stresses along the members of every prototype, and over parts, at a pose, by its number. Raises OptionError
        where there is no such pose."""
        return stress_profiles(self.model, self.end_forces, self._forces(pose), self._deformed(pose))

    def _deformed(self, pose: int | None) -> Deformations:
        """How parts are deformed at a pose."""
        return {name: d[:, pose : pose + 1] for name, d in self.deformed.items()} if pose is not None else {}

    def _forces(self, pose: int | None) -> EndForces:
        """Internal forces at a pose."""
        if pose is None or not 0 <= pose < len(self.poses):
            raise OptionError(f"there is no pose {pose!r} of {len(self.poses)}")

        def forces(name: str) -> tuple[Array, Array]:
            start, end = self.end_forces[name]
            return start[..., pose : pose + 1], end[..., pose : pose + 1]

        return forces

    @property
    def frequencies_hz(self) -> Array:
        """Natural frequencies (poses, m), actuators free, each column one mode tracked by shape, those of the first
        pose first; NaN where it is not among the lowest that were requested."""
        hertz = np.full((len(self.poses), max((len(pose.tracked) for pose in self.poses), default=0)), np.nan)
        for row, pose in zip(hertz, self.poses, strict=True):
            row[: len(pose.tracked)] = [pose.frequency_hz[k] if k >= 0 else np.nan for k in pose.tracked]
        return hertz

    @property
    def frequency_changes(self) -> Array:
        """Relative change (poses, m) of `frequencies_hz` from the pose of least strain energy, or from the pose nearest
        to it at which a mode is known."""
        hz = self.frequencies_hz
        order = np.argsort([pose.energy for pose in self.poses], kind="stable")
        known = np.isfinite(hz[order]) & (hz[order] > 0)
        first = np.take_along_axis(hz[order], known.argmax(axis=0)[None], axis=0) if len(hz) else hz
        return np.where(hz > 0, hz, np.nan) / np.where(first > 0, first, np.nan) - 1

    @property
    def parasitic_shifts(self) -> dict[str, Array]:
        """By driven node, how far it shifts (poses,), m, in the directions in which it is not driven."""
        if not self.poses:
            return {}
        move, displacement = self.poses[0].move, self.poses[0].displacement
        shifts: dict[str, Array] = {}
        for node in dict.fromkeys(name.rpartition(".")[0] for name in move):
            if node in displacement:
                free = [k for k, axis in enumerate("xyz") if f"{node}.{axis}" not in move]
                moved = np.array([pose.displacement[node] for pose in self.poses])
                shifts[node] = np.linalg.norm(moved[:, free], axis=1)
        return shifts

    def _title(self) -> str:
        return f"{counted(len(self.poses), 'pose')}, large displacements"

    def presentation(self, nodes: Sequence[str] = ()) -> Iterator[Item]:
        """A row for every pose, evenly spread where there are many: what moves, what holds it, frequencies and support
        stiffness; then displacements of `nodes`."""
        if not self.poses:
            return
        columns = short_columns(self.poses, self.units, MODES)
        proven = [pose.proven for pose in self.poses]
        yield Table({**columns, "proven": proven}, "poses", most=MOST_POSES, is_spread=True)
        support = " k: support stiffness, actuators locked;" if "kx [N/m]" in columns else ""
        factors = "to yield, to buckle: factors on what is there"
        yield Line(f"f: actuators free under the forces that hold the pose;{support} {factors}")
        if self.model_errors:
            yield Facts({"model error over all poses": ", ".join(self._errors_over_all())})
        for node in nodes:
            yield Table(self._moved(node), "poses", most=MOST_POSES, is_spread=True)

    def _errors_over_all(self) -> Iterator[str]:
        """How far the part may be from the model, of each frequency at any of the poses."""
        for k in range(min([MODES, *(len(errors.low) for errors in self.model_errors)])):
            intervals = [errors.intervals[k] for errors in self.model_errors]
            known = [interval for interval in intervals if interval is not None]
            whole = (min(low for low, _ in known), max(high for _, high in known)) if known == intervals else None
            yield f"f{k + 1} {interval_text(whole)}"

    def _moved(self, node: str) -> dict[str, Any]:
        """Displacement of a node in every pose, without what is round-off beside the largest of its kind."""
        poses = self.poses
        columns = {f"{name} [{self.units[name]}]": [pose.varied[name] for pose in poses] for name in poses[0].varied}
        moved = np.array([pose.displacement[node] for pose in poses])
        for kind in (slice(0, 3), slice(3, 6)):
            moved[:, kind] *= np.abs(moved[:, kind]) > STILL * np.abs(moved[:, kind]).max()
        names = (dof[1:] if k < 3 else dof for k, dof in enumerate(DOF_NAMES))
        return columns | {f"{node}.{name} [{UNITS[k > 2]}]": moved[:, k] for k, name in enumerate(names)}

    def short_columns(self, most: int, modes: int) -> dict[str, Any]:
        """What readers see of at most so many poses, evenly spread, by headings with SI units."""
        return short_columns(self.poses[:: max(1, -(-len(self.poses) // most))], self.units, modes)

    def _columns(self) -> dict[str, Any]:
        return pose_columns(self.poses, self.units, self.model_errors)


@verb
def stroke(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    move: Mapping[str, FromTo] | None = None,
    steps: int | None = None,
    n: int | None = None,
    loads: Mapping[str, FromTo] | None = None,
    follower: Mapping[str, FromTo] | None = None,
    gravity: FromTo | None = None,
    actuators: Mapping[str, FromTo] | None = None,
    nodes: Sequence[str] | None = None,
    compliance: bool = False,
    branch: int = 0,
    refine: int = 1,
    order: Order = "full",
    progress: Listener | None = None,
) -> Stroke:
    """The mechanism over the stroke of some displacements, with large displacements and rotations.

    Without anything that moves or acts it is the stroke that is described as `motion`, with its steps, modes and nodes.

    `move` prescribes displacements by name, `carriage.y` or `platform.rz`, from rest: (from, to), m or rad, in `steps`
    poses at equal distances, or a single number for one pose. Several move together. Rotations are components of the
    rotation vector. `loads`, (6,) N and N m by node, and `gravity`, (3,) m/s^2, are dead, `follower` loads turn with
    their nodes, and `actuators` are commands by name, wildcards allowed, in the units of the inputs. They are on all
    the way, beside the loads that are described and, where it is not given, the gravity, or go in the `steps` from one
    value to another, as in {"stack": (0, 20e-6)}. A force between two nodes acts along the line between them, or along
    its direction, which turns with the first; one at a single node keeps its direction.

    At each pose the `n` lowest modes are about the deformed state, none missed; `nodes` are those whose displacements
    are told, by default those that `move` names, else those whose motion sensors read, else rigid bodies, with
    `compliance` also their compliances and stiffnesses, (6, 6) each.
    `progress` is told of every pose. Members are cut into `refine` times the elements that are described. At `order`
    "low" substructures are corotational superelements, with energies of fourth order in their deformation, finer where
    the motion asks for it; `low_order` says how far this is off.

    Where loads and commands alone change, the path of equilibria is followed by arc length, through limit points and
    snap-back: poses are where it passes the requested shares, as often as it does, and at limit points. Warnings report
    limit points and bifurcations; with `branch` 1 or -1 the path goes on along the first buckled one, to either side.

    Every state is reached from the undeformed configuration by a path of equilibria. Where one ends, the poses beyond
    are missing, with the reason among the warnings. Members bend, twist and turn as far as they like, with small
    strains; material is elastic, sections keep their shape, and nothing touches (theory eqs. G1-G31).

    Raises ModelError, OptionError for unknown nodes and axes, displacements that are held or follow from each
    other, ranges without steps, and SolverError when nothing moves at all.
    """
    if not isinstance(refine, int | np.integer) or refine < 1:
        raise OptionError(f"members are cut into a whole number of times their elements, at least 1, not {refine!r}")
    full = at_rest(model, parameters, int(refine))
    if isinstance(branch, bool) or branch not in (-1, 0, 1):
        raise OptionError(f"branch is 1 or -1, to either side, or 0 to go straight on, not {branch!r}")
    inputs = Inputs(move or {}, loads or {}, follower or {}, gravity, actuators or {})
    motion = None if inputs.any_but_gravity else full.plan.motion.motion
    if motion is not None:
        inputs = Inputs.described(full.design, gravity)
        nodes = nodes if nodes is not None or not motion.nodes else motion.nodes
    steps = steps if steps is not None else motion.steps if motion is not None else STEPS
    n = n if n is not None else motion.modes if motion is not None else MODES
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise OptionError(f"the number of modes is a whole number, at least 1, not {n!r}")
    if order not in ("full", "low"):
        raise OptionError(f"order is full or low, not {order!r}")
    moving = MovingModel.of(full.design)
    points = prescribed(moving, inputs, steps)
    if nodes is None:
        nodes = [drive.name.rsplit(".", 1)[0] for drive in points.drives] or _watched(full.plan)
    names = list(dict.fromkeys([nodes] if isinstance(nodes, str) else nodes))
    requested = Requested(n, dict(zip(names, full.plan.topology.numbers(names).tolist(), strict=True)), compliance)
    equations = Equations(moving, points.drives)
    equations.independent()

    def run(equations: Equations) -> Continuation:
        return Continuation(equations, points, requested, branch, progress).run()

    low: LowOrderMotion | None = None
    if order == "full":
        path = run(equations)
        states = [at.state for at in path.states]
        spectra = tuple(Spectrum(at.state, at.values, at.vectors) for at in path.states)
    else:
        path, states, low = _at_low_order(equations, points, requested, run)
        spectra = ()
    forces, deformed = end_forces(moving, states), moved_deformations(full, moving, states)
    yields = ratios_to_yield(full, forces.__getitem__, deformed, len(states)) if states else NO_YIELD
    frames = tuple(state.frames for state in states)
    return Stroke(
        model=full,
        poses=tuple(stroke_poses(path.states, yields)),
        stopped=tuple(path.stopped),
        critical=tuple(path.critical),
        doubts=(*beyond(moving, frames), *points.overdriven),
        yield_ratios=yields,
        end_forces=forces,
        deformed=deformed,
        frames=frames,
        units=points.units,
        low_order=low,
        has_follower_loads=any(state.loads.follower for state in states),
        spectra=spectra,
    )


def _watched(plan: Plan) -> list[str]:
    """Nodes whose motion tells how far a mechanism goes: those of displacement and rotation sensors, else of the bodies
    that are not held, the first few."""
    read = [
        ".".join((*path, sensor.nodes[0]))
        for path, name in plan.layout.instances()
        for sensor in plan.layout.prototypes[name].sensors.values()
        if not isinstance(sensor, ForceSensor)
    ]
    return list(dict.fromkeys(read)) or plan.moving_bodies[:WATCHED_BODIES]


def _at_low_order(
    full: Equations, points: Prescribed, requested: Requested, run: Callable[[Equations], Continuation]
) -> tuple[Continuation, list[Equilibrium], LowOrderMotion]:
    """The path at low order, and its states on the full order."""
    paths: list[Continuation] = []

    def states(equations: Equations) -> list[Equilibrium]:
        paths.append(path := run(equations))
        if path.interruption is not None:
            raise path.interruption
        return [at.state for at in path.states] + path.ended

    ends = (points.undeformed, points.first, points.last)
    if any(full.model.shares(point.loads.actuators) for point in ends):
        raise OptionError("states of temperature are known at full order alone: order='full'")
    loaded = [node for point in ends for node in (*point.loads.dead, *point.loads.follower)]
    best = low_order_motion(full, [*requested.nodes.values(), *loaded], states, requested.modes)
    path = paths[best.run]
    path.stopped[:] = [f"at low order {why}; the full order may go further" for why in path.stopped]
    return path, best.states[: len(path.states)], best.motion
