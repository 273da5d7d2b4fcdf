"""What a stroke leads through: displacements that are prescribed, loads and actuators that are constant or go from one
value to another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis.limits import command_limits
from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError
from flexura.mechanism import DOF_NAMES
from flexura.motion import Drive, Loads, MovingModel, Point, commanded
from flexura.structure import Design
from flexura.systems import Ports

AXES = {"x": 0, "y": 1, "z": 2, **{name: k for k, name in enumerate(DOF_NAMES)}}

FORCES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")

FromTo = ArrayLike
"""A constant, or the first and the last value of what changes over a stroke."""


class Given(NamedTuple):
    """What a stroke is asked for, as in `stroke`: by name or node, constant or from one value to another."""

    move: Mapping[str, FromTo]
    loads: Mapping[str, FromTo]
    follower: Mapping[str, FromTo]
    gravity: FromTo | None
    actuators: Mapping[str, FromTo]

    @property
    def anything(self) -> bool:
        """Whether anything at all moves or is loaded."""
        return self.changes or self.gravity is not None

    @property
    def changes(self) -> bool:
        """Whether anything moves or acts but gravity."""
        return bool(self.move or self.loads or self.follower or self.actuators)


def described(design: Design) -> Given:
    """The stroke that a description has."""
    motion, values = design.plan.motion, design.values
    loads, follower = (motion.wrenches(kind, values) for kind in ("loads", "follower"))
    return Given(motion.moved(values), loads, follower, None, motion.commands(values))


class Varied(NamedTuple):
    """What is prescribed at a share of the way, by name: displacements, loads that change, and commands that change."""

    share: float
    move: dict[str, float]
    load: dict[str, float]
    actuators: dict[str, float]

    @property
    def all(self) -> dict[str, float]:
        """All of it."""
        return {**self.move, **self.load, **self.actuators}


class Course(NamedTuple):
    """What a stroke leads through: `drives` (d,) whose displacements are prescribed, the point `rest` that its ways
    start from, the `first` and the `last` point, and the `shares` (p,) of the way between these at which poses are
    asked for.

    `move`, `loads` and `commands` are the first and the last values by name of displacements that are prescribed, m and
    rad, of loads that change, N, N m, m/s^2, and of commands that change, in the units of inputs; `units` has all.
    `overdriven` are commands beyond the range of their actuators.
    """

    drives: tuple[Drive, ...]
    rest: Point
    first: Point
    last: Point
    shares: Array
    move: dict[str, tuple[float, float]]
    loads: dict[str, tuple[float, float]]
    commands: dict[str, tuple[float, float]]
    units: dict[str, str]
    overdriven: tuple[Diagnostic, ...]

    def at(self, share: float) -> Varied:
        """What is prescribed at a share of the way."""
        kinds = (self.move, self.loads, self.commands)
        return Varied(share, *({name: (1 - share) * a + share * b for name, (a, b) in own.items()} for own in kinds))

    def words(self, share: float, of_first: float = 1.0) -> str:
        """What is prescribed at a share of the way, times a part of it on the way from rest to there."""
        values = {name: of_first * value for name, value in self.at(share).all.items()}
        return words(values, self.units)

    def point(self, share: float) -> Point:
        """The point at a share of the way."""
        return self.first.between(self.last, share)

    @property
    def nearest(self) -> int:
        """Number of the pose that is nearest to rest, from which the ways go to both sides."""
        ends = np.array([*self.move.values(), *self.loads.values(), *self.commands.values()]).reshape(-1, 2)
        values = (1 - self.shares) * ends[:, :1] + self.shares * ends[:, 1:]
        return int(np.argmin((np.abs(values) / np.maximum(np.abs(values).max(axis=1), 1e-300)[:, None]).sum(axis=0)))

    @property
    def is_loaded(self) -> bool:
        """Whether loads and commands alone change over the stroke: nothing says how far it moves."""
        return len(self.shares) > 1 and all(a == b for a, b in self.move.values())


def words(values: Mapping[str, float], units: Mapping[str, str]) -> str:
    """Values with their units; where nothing changes, the loads that are on."""
    if not values:
        return "these loads"
    return ", ".join(f"{name} = {value:.6g} {units[name]}" for name, value in values.items())


def course(model: MovingModel, given: Given, steps: int) -> Course:
    """The points of a stroke. Raises OptionError for unknown names, what is held and what is no range."""
    if not given.anything:
        raise OptionError("move names at least one displacement, as in {'carriage.y': (-0.01, 0.01)}; or put loads on")
    return _Courses(model, given).course(steps)


class _Courses:
    """Reads what is asked for, one kind after another; what does not change ends up in `rest`."""

    def __init__(self, model: MovingModel, given: Given) -> None:
        self.model, self.given = model, given
        self.ends: dict[str, list[Any]] = {name: [{}, {}, {}] for name in ("dead", "follower", "actuators")}
        """Loads at rest, at the first and at the last point."""
        self.loads: dict[str, tuple[float, float]] = {}
        self.commands: dict[str, tuple[float, float]] = {}
        self.overdriven: list[Diagnostic] = []
        self.units: dict[str, str] = {}

    def course(self, steps: int) -> Course:
        drives = tuple(_drive(self.model, name) for name in self.given.move)
        targets = [_range(name, own, ()) for name, own in self.given.move.items()]
        for drive, (low, high) in zip(drives, targets, strict=True):
            drive.refuse_half_turn(float(low), float(high))
            self.units[drive.name] = "rad" if drive.component >= 3 else "m"
        gravity = self._gravity()
        self._wrenches()
        self._actuators()
        kinds = zip(*(self.ends[kind] for kind in ("dead", "follower", "actuators")), strict=True)
        at = [Loads(dead, follower, g, own) for (dead, follower, own), g in zip(kinds, gravity, strict=True)]
        low, high = (np.array([float(own[k]) for own in targets]) for k in (0, 1))
        rest, first, last = (Point(to, own) for to, own in zip((0 * low, low, high), at, strict=True))
        moving = any(_pair(own, ()) for own in self.given.move.values()) or self.loads or self.commands
        if moving and (not isinstance(steps, int | np.integer) or steps < 2):
            raise OptionError(f"a range has at least 2 steps, not {steps!r}")
        shares = np.linspace(0.0, 1.0, steps) if moving else np.ones(1)
        move = dict(zip(self.given.move, zip(low.tolist(), high.tolist(), strict=True), strict=True))
        return Course(
            drives, rest, first, last, shares, move, self.loads, self.commands, self.units, tuple(self.overdriven)
        )

    def _gravity(self) -> list[Array]:
        """Gravity (3,), m/s^2, of the description or as given, at rest, at the first and at the last point."""
        design = self.model.design
        if self.given.gravity is None:
            return [design.plan.loads.gravity(design.values)] * 3
        low, high = _range("gravity", self.given.gravity, (3,))
        if not _pair(self.given.gravity, (3,)):
            return [low] * 3
        self._note("gravity", "xyz", low, high, ["m/s^2"] * 3)
        return [np.zeros(3), low, high]

    def _note(self, name: str, axes: Sequence[str], low: Array, high: Array, units: Sequence[str]) -> None:
        """Take down the components of a load that change."""
        for axis, a, b, unit in zip(axes, low.tolist(), high.tolist(), units, strict=True):
            if a != b:
                self.loads[f"{name}.{axis}"], self.units[f"{name}.{axis}"] = (a, b), unit

    def _wrenches(self) -> None:
        """Dead loads, those that are described and those that are given, and follower loads."""
        design = self.model.design
        described = design.plan.loads.wrenches(design.values)
        for kind, given, word in (
            ("dead", self.given.loads, "load"),
            ("follower", self.given.follower, "follower load"),
        ):
            own = described if kind == "dead" else {}
            for node in dict.fromkeys((*own, *given)):
                number = int(design.plan.topology.numbers([node])[0])
                low, high = _range(f"{word} on {node}", given.get(node, np.zeros(6)), (6,))
                changes = node in given and _pair(given[node], (6,))
                base = own.get(node, np.zeros(6))
                for at, value in zip(
                    self.ends[kind], (base if changes else base + low, base + low, base + high), strict=True
                ):
                    at[number] = at.get(number, 0.0) + value
                if changes:
                    name = node if kind == "dead" else f"{node}.follower"
                    self._note(name, FORCES, low, high, ["N"] * 3 + ["N m"] * 3)

    def _actuators(self) -> None:
        """Commands of actuators: of stacks and what acts between two nodes, and dead loads at one node."""
        ports, seen = Ports(self.model.design), set[str]()
        for pattern, given in self.given.actuators.items():
            low, high = (float(end) for end in _range(f"the command of {pattern}", given, ()))
            changes = _pair(given, ())
            ends = (0.0 if changes else low, low, high)
            for port in ports.inputs([pattern]):
                name = port.channel.name
                lever = commanded(self.model, port)
                if name in seen:
                    raise OptionError(f"the input {name} is named twice")
                seen.add(name)
                self.overdriven += command_limits([port], np.array([[low, high]]))
                if changes:
                    self.commands[name], self.units[name] = (low, high), port.channel.unit
                kind, key = ("actuators", name) if lever.node is None else ("dead", lever.node)
                for at, value in zip(self.ends[kind], ends, strict=True):
                    at[key] = at.get(key, 0.0) + value * lever.unit


def _drive(model: MovingModel, name: str) -> Drive:
    """The prescribed displacement of a name such as `carriage.y`. Raises OptionError where there is none."""
    node, _, axis = name.rpartition(".")
    if not node or axis not in AXES:
        raise OptionError(f"{name!r} is no displacement: write NODE.AXIS, an axis of {', '.join(AXES)}")
    number = int(model.design.plan.topology.numbers([node])[0])
    root, own = int(model.root[number]), AXES[axis]
    if model.dof[root, own] < 0:
        raise OptionError(f"{name} cannot move: it is held by the ground")
    return Drive(name, number, root, own)


def _pair(given: FromTo, shape: tuple[int, ...]) -> bool:
    """Whether something goes from one value to another."""
    return np.shape(given) == (2, *shape)


def _range(name: str, given: FromTo, shape: tuple[int, ...]) -> tuple[Any, Any]:
    """The first and the last value. Raises OptionError for what is neither finite numbers nor two of them."""
    try:
        values = np.asarray(np.nan if np.asarray(given).dtype == bool else given, dtype=float)
    except (TypeError, ValueError):
        values = np.array(np.nan)
    if values.shape not in (shape, (2, *shape)) or not np.isfinite(values).all():
        what = f"{shape[0]} finite numbers" if shape else "a number"
        raise OptionError(f"{name} is {what}, or goes from one to another, not {given!r}")
    return (values[0], values[1]) if values.shape == (2, *shape) else (values, values)
