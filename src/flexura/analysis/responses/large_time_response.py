"""Time response with large displacements and rotations: signals in, readings of a mechanism that turns out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from flexura.analysis.limits import command_limits
from flexura.analysis.responses.time_limits import Excitation
from flexura.analysis.strokes import LowOrderMotion, driven_displacement, low_order_motion
from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.linalg import factorise
from flexura.mechanism import DOF_NAMES
from flexura.motion import (
    NOTHING_MOVED,
    Contact,
    Damping,
    Drive,
    Equations,
    Equilibrium,
    Frames,
    Integrator,
    Loads,
    MotionState,
    Moved,
    MovingModel,
    Path,
    Point,
    Pose,
    StepsTaken,
    Stopped,
    commanded,
    described_loads,
    rotation_vector,
)
from flexura.structure import Channel, FullOrderModel, InputPort, OutputPort
from flexura.systems import System
from flexura.tables import counted, in_hz, quantity

MODES = 6
"""Frequencies at rest by which the low order is judged at most, and to which damping ratios are fitted."""

COMPARED = 12
"""States that are compared with the full order."""

CALM = 0.6
"""Spectral radius up to which what steps of other lengths set swinging in forces of drives dies out at once."""

FEW = 8
"""Steps of a contact below which its force and its rebound are rough."""

COARSE = 20
"""Steps per period of the motion below which they count as coarse: periods are then off by 1 %."""


class Stepping(NamedTuple):
    """The spectral radius `rho_infinity` of the method, and the `local_error` of a step, over the largest motion, above
    which it is taken in shorter ones."""

    rho_infinity: float
    local_error: float | None

    def refuse_impossible(self) -> None:
        """Raise OptionError for numbers that no step can have."""
        if not 0 <= self.rho_infinity <= 1:
            raise OptionError(f"rho_infinity lies between 0 and 1, not {self.rho_infinity}")
        if self.local_error is not None and not 0 < self.local_error < 1:
            raise OptionError(f"local_error is a share of the motion, between 0 and 1, not {self.local_error}")


class LargeMotion(NamedTuple):
    """Outputs (p, N) and, after them, forces of drives (d, N), whose channels are `reactions`, those of the driven
    displacements `moved`, and notes and warnings."""

    response: Array
    moved: tuple[Channel, ...]
    reactions: tuple[Channel, ...]
    notes: tuple[str, ...]
    warnings: tuple[Diagnostic, ...]


def large_time_response(
    built: System, excitation: Excitation, stepping: Stepping, order: str, moves: Mapping[str, Array] | None = None
) -> LargeMotion:
    """Outputs of a system of full order with large displacements and rotations (theory eqs. G33-G35), `moves` (N,) by
    name, m and rad, being prescribed, on splines between samples.

    Loads and gravity that are described are on all the time; the base that is accelerated is gravity the other way.
    Raises OptionError for damping that has no motion over time, for readings that are none of nodes and for a base that
    turns, SolverError where a step does not settle.
    """
    stepping.refuse_impossible()
    full = built.model
    assert isinstance(full, FullOrderModel)
    moving = MovingModel.of(full.design)
    readings = [Reading.of(moving, port) for port in built.output_ports]
    moves = moves or {}
    loads = _LoadsOverTime(
        moving, built, excitation, np.array([*moves.values()]).reshape(len(moves), excitation.u.shape[1])
    )
    equations = Equations(moving, [driven_displacement(moving, name) for name in moves])
    equations.independent()
    if moves and stepping.rho_infinity == 1:
        raise OptionError("rho_infinity is below 1 where displacements are prescribed: their forces swing without end")
    damping, damped = _damping(built, Equations(moving))
    runs: list[_Run] = []

    def run(equations: Equations) -> list[Equilibrium]:
        runs.append(_integrated(equations, loads, damping, readings, stepping))
        return runs[-1].samples

    low_order: LowOrderMotion | None = None
    if order == "low":
        nodes = [*loads.nodes, *(node for reading in readings for node in reading.nodes)]

        def probe(equations: Equations) -> list[Equilibrium]:
            return [_resting(equations, *own) for own in loads.like_those_of_the_motion()]

        found = low_order_motion(equations, nodes, run, _resolved(Equations(moving), excitation.dt), probe)
        low_order, chosen = found.motion, runs[found.run]
    else:
        run(equations)
        chosen = runs[-1]
    notes = [
        f"large displacements and rotations, generalised-alpha, rho_infinity {stepping.rho_infinity:g}, error of order"
        f" dt^2, {chosen.per_period:.3g} steps in a period of the motion",
        *_steps_taken(chosen.steps, len(excitation.time) - 1),
        *map(_met, chosen.contacts),
        *damped,
        *([] if low_order is None else [low_order.note]),
    ]
    u, dt = excitation.u, excitation.dt
    warnings = list(command_limits(built.input_ports, u, lambda k: f" at {quantity(k * dt, 's', 6)}"))
    if chosen.per_period < COARSE:
        damps = ", or damp what is too quick for it with a rho_infinity below 1" if stepping.rho_infinity == 1 else ""
        text = f"the motion has {chosen.per_period:.3g} steps in a period, less than {COARSE}: shorten dt{damps}"
        warnings.append(Diagnostic("step", "", chosen.per_period, COARSE, "1", text))
    if moves and chosen.steps.taken != len(excitation.time) - 1 and stepping.rho_infinity > CALM:
        text = f"forces of drives swing where steps change their length: take a rho_infinity of {CALM:g} or less"
        warnings.append(Diagnostic("step", "", stepping.rho_infinity, CALM, "1", text))
    warnings += [own for contact in chosen.contacts for own in _coarse_contact(contact)]
    warnings += () if low_order is None else low_order.warnings
    channels = [_channels(moving, drive) for drive in equations.drives]
    moved, reactions = (tuple(own[k] for own in channels) for k in (0, 1))
    return LargeMotion(chosen.response, moved, reactions, tuple(notes), tuple(warnings))


def _channels(model: MovingModel, drive: Drive) -> tuple[Channel, Channel]:
    """What a drive moves, and the force or moment with which it does."""
    turns, topology = drive.component >= 3, model.design.plan.topology
    direction = tuple(np.eye(3)[drive.component % 3].tolist())
    place = topology.node_names[drive.node], direction, tuple(model.positions(model.rest)[drive.node].tolist())
    kinds = ("rotation", "moment") if turns else ("displacement", "force")
    return Channel(drive.name, kinds[0], *place), Channel(f"{drive.name}:{kinds[1]}", kinds[1], *place)


def _resolved(equations: Equations, dt: float) -> int:
    """How many of the lowest frequencies at rest have enough steps in a period, at least one."""
    values = Pose(equations, equations.solve(equations.model.rest)).modes(MODES).values
    return max(int((values < (2 * np.pi / (COARSE * dt)) ** 2).sum()), 1)


class _LoadsOverTime:
    """Loads that are described, and those of the inputs at each time."""

    def __init__(self, model: MovingModel, built: System, excitation: Excitation, moves: Array) -> None:
        from scipy.interpolate import make_interp_spline  # slow to import

        self.excitation = excitation
        self._moves = moves
        degree = next((k for k in (5, 3) if moves.shape[1] > k), 1)
        times = excitation.dt * np.arange(moves.shape[1])
        spline = make_interp_spline(times, moves, degree, axis=1) if len(moves) else None
        self._splines = [] if spline is None else [spline, *(spline.derivative(k) for k in (1, 2, 3))]
        described = described_loads(model.design)
        self._dead: dict[int, Any] = dict(described.dead)
        self._gravity = described.gravity
        ports = built.input_ports
        self._base = np.array([_base(port) for port in ports])
        self._levers = [commanded(model, port) if port.base is None else None for port in ports]
        self.nodes = [*self._dead, *(own.node for own in self._levers if own is not None and own.node is not None)]

    def under(self, values: Array) -> Loads:
        """Loads under inputs (m,)."""
        dead, actuators = dict(self._dead), dict[str, float]()
        for lever, value in zip(self._levers, values.tolist(), strict=True):
            if lever is None:
                continue
            if lever.node is not None:
                dead[lever.node] = dead.get(lever.node, 0.0) + value * lever.unit
            else:
                actuators[lever.name] = value * lever.unit
        return Loads(dead, {}, self._gravity - values @ self._base, actuators)

    def base_at(self, number: int) -> Array:
        """Accelerations (3,) of the base at the time with a number, m/s^2."""
        return self.excitation.u[:, number] @ self._base

    def moved(self, number: float) -> Moved:
        """What is prescribed of displacements at the time with a number."""
        return (
            Moved(*(spline(number * self.excitation.dt) for spline in self._splines))
            if self._splines
            else NOTHING_MOVED
        )

    def at_start(self) -> tuple[Loads, Array]:
        """Loads and driven displacements of the state to start from."""
        return self.under(self.excitation.start), self.moved(0).place

    def like_those_of_the_motion(self) -> list[tuple[Loads, Array]]:
        """Loads and driven displacements at the start, and where each of them is at its largest."""
        every = np.concatenate([self.excitation.u, self._moves]) if len(self._moves) else self.excitation.u
        largest = sorted({int(np.abs(row).argmax()) for row in every})
        there = [(self.under(self.excitation.u[:, k]), self.moved(k).place) for k in largest if every[:, k].any()]
        return [self.at_start(), *there]

    def at(self, number: float) -> Loads:
        """Loads at the time with a number, on straight lines between whole ones."""
        u, first = self.excitation.u, int(number)
        share = number - first
        return self.under(u[:, first] if not share else (1 - share) * u[:, first] + share * u[:, first + 1])


def _base(port: InputPort) -> Array:
    """The acceleration (3,) of the base by one unit of an input. Raises OptionError where it turns."""
    if port.base is None:
        return np.zeros(3)
    if port.base[3:].any():
        raise OptionError(f"{port.channel.name} turns the base: in large motion the base moves without turning")
    return np.array(port.base[:3], dtype=float)


class _Run(NamedTuple):
    """A motion on one model: outputs (p, N), some of the states, how many steps a period of the motion has, the steps
    that were taken, and what stops have met."""

    response: Array
    samples: list[Equilibrium]
    per_period: float
    steps: StepsTaken
    contacts: list[Contact]


def _met(contact: Contact) -> str:
    """A note of what a stop has met."""
    return (
        f"the stop {contact.name} is met {counted(contact.count, 'time')}, {quantity(contact.depth, 'm', 3)} deep"
        f" at most, with {quantity(contact.force, 'N', 3)}"
    )


def _coarse_contact(contact: Contact) -> Iterator[Diagnostic]:
    """A warning where a contact has few steps."""
    if contact.fewest is not None and contact.fewest < FEW:
        text = (
            f"a contact with the stop {contact.name} lasts {counted(contact.fewest, 'step')}, less than {FEW}: its"
            " force and its rebound are rough; shorten dt"
        )
        yield Diagnostic("contact", contact.name, contact.fewest, FEW, "1", text)


def _steps_taken(steps: StepsTaken, samples: int) -> list[str]:
    """A note where steps were shorter than samples are apart."""
    if steps.taken == samples:
        return []
    why = {"did not settle": steps.not_settled, "had a larger local error": steps.not_accurate}
    reasons = " and ".join(f"{count} {what}" for what, count in why.items() if count)
    return [
        f"{counted(steps.taken, 'step')} for {counted(samples, 'sample')}, the shortest"
        f" {quantity(steps.shortest, 's', 3)}: {reasons} and were halved"
    ]


def _integrated(
    equations: Equations, loads: _LoadsOverTime, damping: Damping, readings: list[Reading], stepping: Stepping
) -> _Run:
    """The motion on a model, step by step."""
    model, (u, dt, impulses, *_) = equations.model, loads.excitation
    count = u.shape[1]
    at_start, still = _resting(equations, *loads.at_start()), np.zeros(len(equations.drives))
    M = model.mass(at_start.frames)
    velocity = np.zeros(model.n_dof)
    if impulses.any():  # momentum, by what impulses act on at the start
        pushed = (loads.under(values) for values in (impulses, 0 * impulses))
        acting, none = (equations.tangent(at_start.frames, own, still)[1] for own in pushed)
        velocity = factorise(M).solve(acting - none)
    response = np.zeros((len(readings) + len(still), count))
    compared = {int(k) for k in np.linspace(0, count - 1, COMPARED)}
    samples, speed, force = list[Equilibrium](), 0.0, 0.0
    integrator = Integrator(equations, damping, dt, stepping.rho_infinity, stepping.local_error)
    for number, state in enumerate(integrator.through(at_start.frames, velocity, loads.at, count, loads.moved)):
        checkpoint()
        rate, growth = (equations.displacements(own) for own in (state.velocity, state.acceleration))
        for k, reading in enumerate(readings):
            response[k, number] = reading.read(model, state, rate, growth, loads.base_at(number))
        response[len(readings) :, number] = state.drive
        speed += float(state.velocity @ (M @ state.velocity))
        force += float(state.acceleration @ (M @ state.acceleration))
        if number in compared:
            there = loads.at(number)
            tangent = equations.tangent(state.frames, there, state.drive)[0]
            samples.append(Equilibrium(state.frames, state.drive, there, tangent, 0))
    pace = np.sqrt(force / speed) if speed > 0 else 0.0
    per_period = 2 * np.pi * integrator.steps.taken / (pace * dt * (count - 1)) if pace > 0 else np.inf
    met = [contact for own in integrator.contacts for contact in own.found()]
    return _Run(response, samples, per_period, integrator.steps, met)


class Reading(NamedTuple):
    """What an output reads: of a node, or of a second one seen from the first, along a direction, so often
    differentiated; rotations where it `turns`, in axes that turn with the node where it is `mounted` there."""

    nodes: tuple[int, ...]
    direction: Array
    derivative: int
    turns: bool
    mounted: bool

    @staticmethod
    def of(model: MovingModel, port: OutputPort) -> Reading:
        """The reading of a port. Raises OptionError for forces, and for rates between two nodes."""
        channel: Channel = port.channel
        words = channel.quantity.split("_")
        turns = words[0] in ("rotation", "angular")
        if channel.quantity in ("force", "moment") or channel.node is None:
            raise OptionError(f"{channel.name} reads a {channel.quantity}: in large motion outputs are those of nodes")
        names = [channel.node] if channel.against is None else [channel.against, channel.node]
        if len(names) == 2 and port.derivative:
            raise OptionError(f"{channel.name} reads a rate between two nodes: in large motion name a single node")
        nodes = tuple(model.design.plan.topology.numbers(names).tolist())
        described = channel.name.rpartition(".")[2].partition(":")[0] not in DOF_NAMES
        mounted = port.derivative == 2 and described
        return Reading(nodes, np.array(channel.direction, dtype=float), port.derivative, turns, mounted)

    def read(
        self, model: MovingModel, state: MotionState, velocity: Array, acceleration: Array, of_base: Array
    ) -> float:
        """What is read in a state with velocities and accelerations (n + 1, 6) of the frames, and accelerations (3,) of
        the base, which are read as well."""
        frames, roots = state.frames, [int(model.root[node]) for node in self.nodes]
        R = [frames.R[root] for root in roots]
        if self.derivative:
            (root,), arm = roots, R[0] @ model.arm[self.nodes[0]]
            value = (velocity if self.derivative == 1 else acceleration)[root]
            swing = np.cross(value[3:], arm)
            if self.derivative == 2:
                swing = swing + np.cross(velocity[root, 3:], np.cross(velocity[root, 3:], arm)) + of_base
            vector = value[3:] if self.turns else value[:3] + swing
            return float((R[0] @ self.direction if self.mounted else self.direction) @ vector)
        return self.of_place(model, frames)

    def of_place(self, model: MovingModel, frames: Frames) -> float:
        """What is read of where nodes are; zero of rates."""
        if self.derivative:
            return 0.0
        roots = [int(model.root[node]) for node in self.nodes]
        R = [frames.R[root] for root in roots]
        if self.turns:
            turn = R[0] if len(R) == 1 else R[0].T @ R[1]
            return float(self.direction @ rotation_vector(turn))
        x, rest = (
            [placed.x[r] + placed.R[r] @ model.arm[n] for r, n in zip(roots, self.nodes, strict=True)]
            for placed in (frames, model.rest)
        )
        moved = x[0] - rest[0] if len(x) == 1 else R[0].T @ (x[1] - x[0]) - (rest[1] - rest[0])
        return float(self.direction @ moved)


def _resting(equations: Equations, loads: Loads, targets: Array) -> Equilibrium:
    """The static state under loads, with the driven displacements at their targets. Raises SolverError where there is
    none."""
    rest = equations.model.rest
    if not loads.any and not targets.any():
        tangent = equations.tangent(rest, loads, 0 * targets)[0]
        return Equilibrium(rest, 0 * targets, loads, tangent, 0)
    state = Path.from_rest(equations, Point(targets, loads))
    if isinstance(state, Stopped):
        raise SolverError(f"there is no static state to start from beyond {100 * state.share:.3g} % of the loads")
    return state


def _damping(built: System, equations: Equations) -> tuple[Damping, list[str]]:
    """Rayleigh damping, as it is described or near to damping ratios, and notes on it.

    Raises OptionError for structural damping.
    """
    law = built.law
    if built.H is not None:
        raise OptionError("structural damping has no response over time: give damping ratios or Rayleigh damping")
    if not law.is_modal:
        return Damping(law.alpha, law.beta), []
    values = Pose(equations, equations.solve(equations.model.rest)).modes(MODES).values
    w = np.sqrt(values[values > 0])[[0, -1]]
    zeta = law.modal_ratios(w / (2 * np.pi))
    if w[1] < 1.01 * w[0]:
        alpha, beta = w[0] * zeta[0], zeta[0] / w[0]
    else:
        alpha, beta = np.maximum(np.linalg.solve(np.stack([1 / w, w], axis=1) / 2, zeta), 0.0)
    hertz, ratio = w / (2 * np.pi), (alpha / w + beta * w) / 2
    lowest = float(np.sqrt(alpha * beta)) if alpha and beta else float(ratio.min())
    note = (
        f"damping ratios are taken as Rayleigh damping, {ratio[0]:.3g} at {in_hz(hertz[0], 4)} and {ratio[1]:.3g} at"
        f" {in_hz(hertz[1], 4)}, {lowest:.3g} between at least and more beyond"
    )
    return Damping(law.alpha + float(alpha), law.beta + float(beta)), [note]
