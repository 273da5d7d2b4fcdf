"""The equilibrium path of a stroke: what is prescribed over it, and its continuation from the undeformed configuration,
by prescribed displacements or by arc length, to where it ends, turns back, branches or is broken off."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis.limits import command_limits
from flexura.analysis.strokes.pose import PathState, Requested, path_state
from flexura.arrays import Array
from flexura.deadline import Listener, OutOfTime, Progress
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.mechanism import DOF_NAMES, FORCES
from flexura.motion import (
    Along,
    Arc,
    Drive,
    Equations,
    Equilibrium,
    Loads,
    Lost,
    MovingModel,
    Path,
    Point,
    Stopped,
    commanded,
    described_loads,
    unstable,
    why_it_ends,
)
from flexura.structure import Design, Ports

AXES = {"x": 0, "y": 1, "z": 2, **{name: k for k, name in enumerate(DOF_NAMES)}}

INTERRUPTED = "interrupted"

ARC_STEPS_PER_POSE = 60
"""Steps by arc length for each pose that is requested, after which a path is given up."""

LARGEST_TURN_BACK = 1.0
"""How far the path parameter may turn back beyond the ends of a path before this is given up."""

SAME_SHARE = 1e-9
"""Path parameters that differ by no more are the same."""

FromTo = ArrayLike
"""A constant, or the first and the last value of what changes over a stroke."""


class Inputs(NamedTuple):
    """What moves and loads a mechanism over a stroke, as in `stroke`: by name or node, constant or from one value to
    another."""

    move: Mapping[str, FromTo]
    loads: Mapping[str, FromTo]
    follower: Mapping[str, FromTo]
    gravity: FromTo | None
    actuators: Mapping[str, FromTo]

    @staticmethod
    def described(design: Design, gravity: FromTo | None) -> Inputs:
        """Those of the stroke that a description has."""
        motion, values = design.plan.motion, design.values
        loads, follower = (motion.wrenches(kind, values) for kind in ("loads", "follower"))
        return Inputs(motion.moved(values), loads, follower, gravity, motion.commands(values))

    @property
    def any_but_gravity(self) -> bool:
        """Whether anything moves or acts but gravity."""
        return bool(self.move or self.loads or self.follower or self.actuators)


class Prescribed(NamedTuple):
    """What is prescribed over a stroke: `drives` (d,) whose displacements are, the points at the `undeformed`
    configuration with the loads that do not change, at the `first` and at the `last` pose, and the `shares` (p,) of the
    way between these two, the path parameter, at which poses are requested.

    `ends` are first and last values by name, by kind as in `StrokePose`: `move`, displacements, m and rad, `load`,
    loads that change, N, N m, m/s^2, and `actuators`, commands that change, in the units of inputs; `units` has all.
    `overdriven` are commands beyond the range of their actuators.
    """

    drives: tuple[Drive, ...]
    undeformed: Point
    first: Point
    last: Point
    shares: Array
    ends: dict[str, dict[str, tuple[float, float]]]
    units: dict[str, str]
    overdriven: tuple[Diagnostic, ...]

    def at(self, share: float) -> dict[str, dict[str, float]]:
        """The values that are prescribed at a path parameter, by kind and name."""
        return {
            kind: {name: (1 - share) * first + share * last for name, (first, last) in ends.items()}
            for kind, ends in self.ends.items()
        }

    def text(self, share: float, of_first: float = 1.0) -> str:
        """These values in words, times a part of the way from the undeformed configuration to there."""
        values = {name: of_first * value for kind in self.at(share).values() for name, value in kind.items()}
        return values_text(values, self.units)

    def point(self, share: float) -> Point:
        """The point at a path parameter."""
        return self.first.between(self.last, share)

    @property
    def nearest(self) -> int:
        """Number of the pose that is nearest to the undeformed configuration, from which paths go to both sides."""
        ends = np.array([end for kind in self.ends.values() for end in kind.values()]).reshape(-1, 2)
        values = (1 - self.shares) * ends[:, :1] + self.shares * ends[:, 1:]
        return int(np.argmin((np.abs(values) / np.maximum(np.abs(values).max(axis=1), 1e-300)[:, None]).sum(axis=0)))

    @property
    def is_loaded(self) -> bool:
        """Whether loads and commands alone change over the stroke: nothing says how far it moves."""
        return len(self.shares) > 1 and all(first == last for first, last in self.ends["move"].values())


def values_text(values: Mapping[str, float], units: Mapping[str, str]) -> str:
    """Values with their units; where nothing changes, the loads that are on."""
    if not values:
        return "these loads"
    return ", ".join(f"{name} = {value:.6g} {units[name]}" for name, value in values.items())


def driven_displacement(model: MovingModel, name: str) -> Drive:
    """The prescribed displacement of a name such as `carriage.y`. Raises OptionError where there is none."""
    node, _, axis = name.rpartition(".")
    if not node or axis not in AXES:
        raise OptionError(f"{name!r} is no displacement: write NODE.AXIS, an axis of {', '.join(AXES)}")
    number = int(model.design.plan.topology.numbers([node])[0])
    root, component = int(model.root[number]), AXES[axis]
    if model.dof[root, component] < 0:
        raise OptionError(f"{name} cannot move: it is held by the ground")
    return Drive(name, number, root, component)


class _Range(NamedTuple):
    """The first and the last value of what is constant or changes over a stroke, numbers or arrays."""

    first: Any
    last: Any
    changes: bool

    @staticmethod
    def of(name: str, given: FromTo, size: int | None = None) -> _Range:
        """Of a number, or of `size` numbers. Raises OptionError for what is neither finite numbers nor two of them."""
        try:
            values = np.asarray(np.nan if np.asarray(given).dtype == bool else given, dtype=float)
        except (TypeError, ValueError):
            values = np.array(np.nan)
        shape = () if size is None else (size,)
        changes = values.shape == (2, *shape)
        if not (changes or values.shape == shape) or not np.isfinite(values).all():
            what = "a number" if size is None else f"{size} finite numbers"
            raise OptionError(f"{name} is {what}, or goes from one to another, not {given!r}")
        first, last = values if changes else (values, values)
        return _Range(float(first), float(last), changes) if size is None else _Range(first, last, changes)

    @property
    def at_points(self) -> tuple[Any, Any, Any]:
        """The values in the undeformed configuration, where what changes is not on, and at the first and last pose."""
        return 0.0 * self.first if self.changes else self.first, self.first, self.last


def prescribed(model: MovingModel, inputs: Inputs, steps: int) -> Prescribed:
    """The points of a stroke. Raises OptionError for unknown names, what is held and what is no range."""
    if not inputs.any_but_gravity and inputs.gravity is None:
        raise OptionError("move names at least one displacement, as in {'carriage.y': (-0.01, 0.01)}; or put loads on")
    return _Reader(model).read(inputs, steps)


class _Reader:
    """Reads what is prescribed, one kind after another."""

    def __init__(self, model: MovingModel) -> None:
        self.model = model
        described = described_loads(model.design)
        self.loads: dict[str, tuple[Any, ...]] = {
            "dead": tuple(dict(described.dead) for _ in range(3)),
            "follower": ({}, {}, {}),
            "gravity": (described.gravity,) * 3,
            "actuators": ({}, {}, {}),
        }
        """What `Loads` takes, in the undeformed configuration, at the first and at the last pose."""
        self.ends: dict[str, dict[str, tuple[float, float]]] = {"move": {}, "load": {}, "actuators": {}}
        self.units: dict[str, str] = {}
        self.overdriven: list[Diagnostic] = []

    def read(self, inputs: Inputs, steps: int) -> Prescribed:
        drives = tuple(driven_displacement(self.model, name) for name in inputs.move)
        moves = [_Range.of(name, given) for name, given in inputs.move.items()]
        for drive, move in zip(drives, moves, strict=True):
            drive.refuse_half_turn(move.first, move.last)
            self.ends["move"][drive.name] = move.first, move.last
            self.units[drive.name] = "rad" if drive.component >= 3 else "m"
        if inputs.gravity is not None:
            gravity = _Range.of("gravity", inputs.gravity, 3)
            self.loads["gravity"] = gravity.at_points
            self._changing("gravity", "xyz", gravity, ["m/s^2"] * 3)
        self._wrenches("dead", inputs.loads)
        self._wrenches("follower", inputs.follower)
        self._commands(inputs.actuators)
        low, high = (np.array([move[k] for move in moves], dtype=float) for k in (0, 1))
        targets, loads = (0 * low, low, high), zip(*self.loads.values(), strict=True)
        undeformed, first, last = (Point(to, Loads(*at_point)) for to, at_point in zip(targets, loads, strict=True))
        changes = any(move.changes for move in moves) or self.ends["load"] or self.ends["actuators"]
        if changes and (not isinstance(steps, int | np.integer) or steps < 2):
            raise OptionError(f"a range has at least 2 steps, not {steps!r}")
        shares = np.linspace(0.0, 1.0, steps) if changes else np.ones(1)
        return Prescribed(drives, undeformed, first, last, shares, self.ends, self.units, tuple(self.overdriven))

    def _changing(self, name: str, axes: Sequence[str], load: _Range, units: Sequence[str]) -> None:
        """Take down the components of a load that change."""
        for axis, first, last, unit in zip(axes, load.first.tolist(), load.last.tolist(), units, strict=True):
            if first != last:
                self.ends["load"][f"{name}.{axis}"], self.units[f"{name}.{axis}"] = (first, last), unit

    def _add(self, kind: str, key: int | str, values: Sequence[Any]) -> None:
        for loads, value in zip(self.loads[kind], values, strict=True):
            loads[key] = loads.get(key, 0.0) + value

    def _wrenches(self, kind: str, wrenches: Mapping[str, FromTo]) -> None:
        """Dead or follower loads."""
        label, suffix = ("load", "") if kind == "dead" else ("follower load", ".follower")
        for node, given in wrenches.items():
            number = int(self.model.design.plan.topology.numbers([node])[0])
            wrench = _Range.of(f"{label} on {node}", given, 6)
            self._add(kind, number, wrench.at_points)
            if wrench.changes:
                self._changing(node + suffix, FORCES, wrench, ["N"] * 3 + ["N m"] * 3)

    def _commands(self, actuators: Mapping[str, FromTo]) -> None:
        """Commands of actuators: of stacks and what acts between two nodes, and dead loads at one node."""
        ports, seen = Ports(self.model.design), set[str]()
        for pattern, given in actuators.items():
            command = _Range.of(f"the command of {pattern}", given)
            for port in ports.commands([pattern]):
                name = port.channel.name
                lever = commanded(self.model, port)
                if name in seen:
                    raise OptionError(f"the input {name} is named twice")
                seen.add(name)
                self.overdriven += command_limits([port], np.array([[command.first, command.last]]))
                if command.changes:
                    self.ends["actuators"][name] = command.first, command.last
                    self.units[name] = port.channel.unit
                kind, key = ("actuators", name) if lever.node is None else ("dead", lever.node)
                self._add(kind, key, [value * lever.unit for value in command.at_points])


@dataclass
class Continuation:
    """The states of a stroke, continued from the one nearest to the undeformed configuration to both sides: those
    `before` and `after` it, why its paths were `stopped` and the states in which they `ended`, `critical` points where
    they turn back or branch, and the `interruption` that broke them off."""

    equations: Equations
    prescribed: Prescribed
    requested: Requested
    branch: int
    progress: Listener | None
    before: list[PathState] = field(default_factory=list)
    after: list[PathState] = field(default_factory=list)
    stopped: list[str] = field(default_factory=list)
    ended: list[Equilibrium] = field(default_factory=list)
    critical: list[Diagnostic] = field(default_factory=list)
    interruption: BaseException | None = None

    @property
    def states(self) -> list[PathState]:
        """All states in the order of the stroke."""
        return [*reversed(self.before), *self.after]

    def run(self) -> Continuation:
        """Follow the paths; what was found stays when they are interrupted.

        Raises SolverError where there is no equilibrium before anything moves, and what interrupted it when nothing was
        found.
        """
        try:
            self._follow()
        except (KeyboardInterrupt, OutOfTime) as error:
            count = len(self.states)
            if not count:
                raise
            self.interruption = error
            why = str(error) if isinstance(error, OutOfTime) else INTERRUPTED
            self.stopped.append(f"{why} after {count} of {len(self.prescribed.shares)} poses: the others are missing")
        return self

    def _follow(self) -> None:
        prescribed, nearest, shares = self.prescribed, self.prescribed.nearest, self.prescribed.shares.tolist()
        there = prescribed.point(shares[nearest])
        first = Path(self.equations, self._undeformed(), prescribed.undeformed).to(there)
        if isinstance(first, Stopped):
            text = prescribed.text(shares[nearest])
            self._end(first.last, prescribed.text(shares[nearest], first.share), text)
            return
        self._add(self.after, first, shares[nearest])
        for states, ahead in ((self.after, shares[nearest:]), (self.before, shares[nearest::-1])):
            if len(ahead) > 1:
                follow = self._by_arc_length if prescribed.is_loaded or self.branch else self._by_displacement
                follow(states, first, ahead)

    def _add(self, states: list[PathState], state: Equilibrium, share: float) -> None:
        values = self.prescribed.at(share)
        states.append(path_state(self.equations, state, share, values, self.requested))
        if self.progress is not None:
            count = len(self.before) + len(self.after)
            self.progress(Progress("poses", count, max(count, len(self.prescribed.shares))))

    def _undeformed(self) -> Equilibrium:
        """The state with nothing moved and the loads on that do not change. Raises SolverError where there is none."""
        return Path.resting(self.equations, self.prescribed.undeformed)

    def _by_displacement(self, states: list[PathState], first: Equilibrium, shares: list[float]) -> None:
        """States at path parameters, the first of which is there, by prescribed displacements."""
        path = Path(self.equations, first, self.prescribed.point(shares[0]))
        last, last_share = first, shares[0]
        buckled = self.after[0].buckling_modes
        points = [self.prescribed.point(share) for share in shares[1:]]
        for share, state in zip(shares[1:], path.through(points), strict=False):
            if isinstance(state, Stopped):
                part = last_share + state.share * (share - last_share)
                self._end(state.last, self.prescribed.text(part), self.prescribed.text(share))
                return
            self._add(states, state, share)
            if states[-1].buckling_modes != buckled:
                self._bifurcation_between((last, last_share), (state, share))
            last, last_share, buckled = state, share, states[-1].buckling_modes

    def _bifurcation_between(self, one: tuple[Equilibrium, float], other: tuple[Equilibrium, float]) -> None:
        """Report a bifurcation between two states of prescribed displacements, at their path parameters."""
        arc = Arc(self.equations, self.prescribed.first, self.prescribed.last, one[0])
        sense = float(np.sign(other[1] - one[1]))
        try:
            share = arc.fork(arc.start(*one, sense), arc.start(*other, sense)).share
            place = f"at {self.prescribed.text(share)}"
        except SolverError:
            place = f"between {self.prescribed.text(one[1])} and {self.prescribed.text(other[1])}"
        self._bifurcation(place)

    def _bifurcation(self, place: str) -> None:
        followed = "the buckled path is followed"
        rest = followed if self.branch else "branch = 1 or -1 follows the buckled path to either side"
        text = f"bifurcation {place}: another path of equilibria branches off, as in buckling; {rest}"
        self.critical.append(Diagnostic("bifurcation", "", np.nan, np.nan, "1", text))

    def _by_arc_length(self, states: list[PathState], first: Equilibrium, shares: list[float]) -> None:
        """States by arc length wherever the path passes a requested path parameter, and where this turns back."""
        sense, spacing = float(np.sign(shares[-1] - shares[0])), abs(shares[1] - shares[0])
        arc = Arc(self.equations, self.prescribed.first, self.prescribed.last, first)
        at = arc.start(first, shares[0], sense)
        branch, steps = self.branch, arc.through(at, spacing)
        try:
            for _ in range(ARC_STEPS_PER_POSE * len(shares)):
                there = next(steps)
                if isinstance(there, Lost):
                    break
                for share in _shares_between(at, there, spacing, shares):
                    self._add(states, arc.at(at, there, share).state, share)
                    if share == shares[-1]:
                        return
                at = there
                if there.kind == "limit":
                    self._add(states, there.state, there.share)
                    states[-1] = states[-1].without_mesh_error()
                    text = self.prescribed.text(there.share)
                    text = f"limit point at {text}: the path parameter turns back, beyond it the mechanism snaps"
                    self.critical.append(Diagnostic("limit point", "", there.share, np.nan, "1", text))
                if there.kind == "fork":
                    self._bifurcation(f"at {self.prescribed.text(there.share)}")
                    if branch:
                        steps, branch = arc.through(arc.branched(there, branch), spacing), 0
                if (there.share - shares[-1]) * sense < -abs(shares[-1] - shares[0]) - LARGEST_TURN_BACK:
                    break
        except SolverError:
            pass
        self._end(at.state, self.prescribed.text(at.share), self.prescribed.text(shares[-1]))

    def _end(self, last: Equilibrium, place: str, aim: str) -> None:
        """Report where a path ends, and why as far as that is known."""
        self.ended.append(last)
        stable = "unstable" if unstable(self.equations, last) else "stable"
        self.stopped.append(
            f"no equilibrium is found beyond {place}, on the path to {aim}: there it is {stable};"
            f" {why_it_ends(self.equations, last)}"
        )


def _shares_between(at: Along, there: Along, spacing: float, shares: list[float]) -> Iterator[float]:
    """Path parameters between two states that are requested, or as far from these beyond them."""
    sense = np.sign(there.share - at.share)
    if not sense:
        return
    low, high = ((along.share - shares[0]) / spacing for along in (at, there))
    first = np.floor(low) + 1 if sense > 0 else np.ceil(low) - 1
    for k in np.arange(first, high + sense * 1e-12, sense):
        regular = shares[0] + k * spacing
        share = next((share for share in shares if abs(share - shares[0] - k * spacing) < SAME_SHARE), regular)
        if abs(share - at.share) > SAME_SHARE:
            yield float(share)
