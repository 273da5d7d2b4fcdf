"""Poses of a stroke and what is linear about each: samples of a scheduled plant, and what it is held against."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from flexura.analysis.responses.large_time_response import Reading
from flexura.analysis.strokes import FromTo, driven_displacement
from flexura.arrays import Array, Complex
from flexura.deadline import checkpoint
from flexura.errors import OptionError, SolverError
from flexura.linalg import is_definite
from flexura.motion import (
    Equations,
    Equilibrium,
    MovingModel,
    Path,
    Point,
    Pose,
    PosedDesign,
    Stopped,
    described_loads,
    lowest_of_any,
)
from flexura.records import Record
from flexura.structure import FullOrderModel, full_order_model
from flexura.systems import UNDAMPED, DampingLaw, Frozen, ScheduledSystem, System, aligned, symmetric, system
from flexura.tables import quantity
from flexura.thresholds import STATIC_ROUND_OFF

SPARE = 1.0
"""How far beyond the band modes of the exact model are summed one by one, relative."""

IN_BAND = 0.5
"""Up to which part of the highest frequency that is kept the plant is for, unless it is said."""

COMPARED = 60
"""Frequencies of a comparison, beside those of resonances."""

ASSUMED_RATIO = 0.01
"""Damping ratio with which models are compared where nothing damps them."""

SILENT = 1e-9
"""Share of the largest response of its kind below which that of a channel is none."""

SPEEDS = 12
"""Frequencies at which inertia forces that are left out are compared with those that are there."""

OF_SPEED = 0.01
"""Part of inertia forces that what is left out of them may reach at the speed that is told."""


class At(NamedTuple):
    """What is known of a pose: its equilibrium, coordinates V (n, r) of the plant and the least part of the modes in
    the middle of the stroke that these span; the natural frequencies in the band, `exact_hz`, and the response `exact`
    (f, p, m) at frequencies hz (f,) of the full order; the plant."""

    p: float
    pose: Pose
    V: Array
    overlap: float
    hz: Array
    exact_hz: Array
    exact: Complex
    plant: Frozen


@dataclass(frozen=True, repr=False)
class PoseCheck(Record):
    """A pose at which the plant is held against the model about it: its natural frequencies and the exact ones, Hz, the
    largest relative difference of those in the band, the largest difference of responses there, over the largest of
    each channel, and of the force and the readings of the equilibrium, over their largest. `between`: the polynomials
    do not go through it."""

    _shown = ("at", "frequency_error", "response_error")

    at: float
    force: float
    between: bool
    frequency_hz: tuple[float, ...]
    exact_hz: tuple[float, ...]
    frequency_error: float
    response_error: float
    static_error: float

    @property
    def error(self) -> float:
        """The largest of these."""
        return max(self.frequency_error, self.response_error, self.static_error)


class SingleStroke(NamedTuple):
    """Equations of a mechanism with one displacement prescribed, and its range."""

    full: FullOrderModel
    equations: Equations
    range: tuple[float, float]

    @staticmethod
    def of(full: FullOrderModel, move: Mapping[str, FromTo]) -> SingleStroke:
        """Raises OptionError for what is no range of one displacement."""
        if not isinstance(move, Mapping) or len(move) != 1:
            raise OptionError(
                "move names one displacement and its range, as in {'carriage.x': (0, 9e-3)}: a plant is scheduled by"
                " one parameter"
            )
        ((name, given),) = move.items()
        values = np.asarray(given, dtype=float) if np.asarray(given).dtype.kind in "if" else np.empty(0)
        if values.shape != (2,) or not np.isfinite(values).all() or values[0] == values[1]:
            raise OptionError(f"{name} goes from one number to another, m or rad, not {given!r}")
        moving = MovingModel.of(full.design)
        drive = driven_displacement(moving, name)
        drive.refuse_half_turn(*values.tolist())
        equations = Equations(moving, [drive])
        equations.independent()
        return SingleStroke(full, equations, (float(values.min()), float(values.max())))

    @property
    def unit(self) -> str:
        """Unit of the displacement."""
        return "rad" if self.equations.drives[0].component >= 3 else "m"

    def words(self, p: float) -> str:
        """A pose in words."""
        return f"{self.equations.drives[0].name} = {quantity(p, self.unit)}"


class StrokePoses:
    """What is known of poses of a stroke, each worked out once."""

    def __init__(self, stroke: SingleStroke, channels: dict[str, Any], n: int, up_to: float | None) -> None:
        self.stroke: SingleStroke = stroke
        self.n: int = n
        self._loads = described_loads(stroke.full.design)
        rest = Path.resting(stroke.equations, Point(np.zeros(1), self._loads))
        self._states: dict[float, Equilibrium] = {0.0: rest}
        self._known: dict[float, At] = {}
        self._channels = channels
        middle = sum(stroke.range) / 2
        pose = Pose(stroke.equations, self._equilibrium(middle))
        K, M = pose.matrices(held=True)
        pairs = lowest_of_any(K, M, min(n, K.shape[0]))
        self._modes = pose.holding.motions(pairs.vectors)
        self.system: System = self._system(pose, middle)
        highest = float(np.sqrt(max(pairs.values[-1], 0.0))) / (2 * np.pi)
        self.up_to: float = IN_BAND * highest if up_to is None else up_to
        undeformed = system(stroke.full, order="full", **channels)
        ratios = undeformed.modal(up_to=self.up_to).total_ratios
        self.is_assumed: bool = bool(not undeformed.is_damped or ratios.min(initial=1.0) < UNDAMPED)
        ports = self.system.output_ports
        self._readings = [Reading.of(stroke.equations.model, port) for port in ports]

    def at(self, p: float) -> At:
        """What is known of a pose. Raises SolverError where it is not reached."""
        if p not in self._known:
            checkpoint()
            self._known[p] = self._worked_out(p)
        return self._known[p]

    def _equilibrium(self, p: float) -> Equilibrium:
        """The state at a pose, from the nearest that is known."""
        if p not in self._states:
            near = min(self._states, key=lambda q: abs(q - p))
            there, point = self._states[near], Point(np.array([near]), self._loads)
            state = Path(self.stroke.equations, there, point).to(Point(np.array([p]), self._loads))
            if isinstance(state, Stopped):
                reached = self.stroke.words(near + state.share * (p - near))
                raise SolverError(
                    f"no equilibrium is found beyond {reached}, on the path to {self.stroke.words(p)}; flexura stroke"
                    " shows how far it goes"
                )
            self._states[p] = state
        return self._states[p]

    def _system(self, pose: Pose, p: float) -> System:
        """The system of full order about a pose."""
        design = replace(self.stroke.full.design, pose=PosedDesign(pose, f"about the pose {self.stroke.words(p)}"))
        return system(full_order_model(design), order="full", **self._channels)

    def _worked_out(self, p: float) -> At:
        equations = self.stroke.equations
        pose = Pose(equations, self._equilibrium(p))
        built = self._system(pose, p)
        along, slope = equations.solver(pose.state.tangent)(np.zeros(len(self._modes)), np.ones(1))
        W, overlap = aligned(pose.held_response(pose.M @ self._modes), self._modes, pose.M)
        V = np.hstack([along[:, None], W])
        plant = self._reduced(pose, built, V, float(slope[0]))
        if not is_definite(pose.K):
            values = lowest_of_any(pose.K, pose.M, V.shape[1]).values
            own = np.sign(values) * np.sqrt(np.abs(values)) / (2 * np.pi)
            return At(
                p, pose, V, overlap, np.empty(0), own[own <= self.up_to], np.empty((0, *built.D.shape), complex), plant
            )
        compared = _as_compared(built) if self.is_assumed else built
        exact = compared.modal(up_to=(1 + SPARE) * self.up_to)
        own = exact.frequency_hz[exact.frequency_hz <= self.up_to]
        widths = np.multiply.outer(exact.total_ratios[: len(own)], np.arange(-2.0, 3.0))
        near = own[:, None] * (1 + widths)
        hz = np.unique(np.concatenate([np.geomspace(self.up_to / 1000, self.up_to, COMPARED), near.ravel()]))
        hz = hz[(hz > 0) & (hz <= self.up_to)]
        return At(p, pose, V, overlap, hz, own, exact.response(hz), plant)

    def _reduced(self, pose: Pose, built: System, V: Array, slope: float) -> Frozen:
        """The plant at a pose, without its forces of speed; `slope` is that of the force of the drive.

        With the drive held and free, what the coordinates lack of static responses is the same.
        """
        M, K = (symmetric(V.T @ (A @ V)) for A in (pose.M, pose.K))
        K[0, 1:] = K[1:, 0] = 0.0
        K[0, 0] = slope
        B, rows = V.T @ built.B, built.rows @ V
        residual = built.rows @ pose.held_response(built.B) - rows[:, 1:] @ np.linalg.solve(K[1:, 1:], B[1:])
        size = np.abs(rows[:, 1:]) @ np.abs(np.linalg.solve(K[1:, 1:], B[1:])) + np.abs(rows[:, :1] @ B[:1] / slope)
        residual[np.abs(residual) <= STATIC_ROUND_OFF * size] = 0.0
        frames, model = pose.state.frames, self.stroke.equations.model
        readings = np.array([reading.of_place(model, frames) for reading in self._readings])
        C = _viscous(built, V, M, K)
        return Frozen(M, C, K, B, rows, residual, pose.state.drive[0], readings, np.zeros(len(M)))

    def family(self, points: Array) -> ScheduledSystem:
        """The plant with polynomials through points, with its forces of speed."""
        known = [self.at(float(p)) for p in points]
        samples = Frozen(*(np.stack(values) for values in zip(*(own.plant for own in known), strict=True)))
        built, drive = self.system, self.stroke.equations.drives[0].name
        family = ScheduledSystem(drive, self.stroke.unit, points, samples, built.derivative, built.D)
        turning = family.slopes(np.stack([own.V[:, 0] for own in known]))
        swing = [own.V.T @ own.pose.inertia_forces(own.V[:, 0], a) for own, a in zip(known, turning, strict=True)]
        return replace(family, samples=samples._replace(swing=np.stack(swing)))

    def speed(self, family: ScheduledSystem) -> float:
        """The speed up to which inertia forces of modes that change with the pose are small (theory eq. T46)."""
        known = [self.at(float(p)) for p in family.points]
        slopes, most = family.slopes(np.stack([own.V for own in known])), 0.0
        for own, slope in zip(known, slopes, strict=True):
            coupling = own.V.T @ (own.pose.M @ slope)
            coupling[:, 0] = 0.0  # what p itself does to the motion along the stroke is in the forces of speed
            for w in 2 * np.pi * np.geomspace(self.up_to / 1000, self.up_to, SPEEDS):
                values, X = la.eigh(own.plant.K, own.plant.M)
                size = X / np.sqrt(np.abs(values) + w**2)
                most = max(most, 2 * w * float(np.linalg.norm(size.T @ coupling @ size, 2)))
        return OF_SPEED / most if most > 0 else np.inf

    def checks(self, family: ScheduledSystem, places: Sequence[float]) -> tuple[PoseCheck, ...]:
        """The plant against the models about poses, by pose."""
        known = {p: self.at(float(p)) for p in sorted(map(float, places))}
        size = np.max([np.abs(own.exact).max(axis=0, initial=0.0) for own in known.values()], axis=0)
        kinds = np.array([[f"{o.quantity} {i.quantity}" for i in self.system.inputs] for o in self.system.outputs])
        heard = size > SILENT * np.array([[size[kinds == kind].max() for kind in row] for row in kinds])
        static = np.max([np.abs([*own.plant.readings, own.plant.force]) for own in known.values()], axis=0)
        what = np.array([*(o.quantity for o in self.system.outputs), ""])
        read = static > SILENT * np.array([static[what == own].max() for own in what])
        scales = _Scales(size, heard, static, read)
        return tuple(self._check(family, own, scales) for own in known.values())

    def _check(self, family: ScheduledSystem, own: At, scales: _Scales) -> PoseCheck:
        plant = family.at(own.p)
        hz, exact = plant.frequencies_hz(), own.exact_hz
        compared = plant
        if self.is_assumed:  # as `_as_compared`
            values, X = la.eigh(plant.K, plant.M)
            back = plant.M @ X
            compared = plant._replace(C=(back * (2 * ASSUMED_RATIO * np.sqrt(np.maximum(values, 0.0)))) @ back.T)
        response = compared.response(own.hz, family.derivative, family.D)
        apart = np.abs(response - own.exact).max(axis=0, initial=0.0)
        there = np.pad(hz, (0, max(len(exact) - len(hz), 0)))[: len(exact)]
        relative = np.abs(there - exact)[exact != 0] / np.abs(exact[exact != 0])
        still = np.abs(np.append(plant.readings - own.plant.readings, plant.force - own.plant.force))[scales.read]
        static = float(np.max(still / scales.static[scales.read], initial=0.0))
        return PoseCheck(
            at=own.p,
            force=float(own.plant.force),
            between=bool(np.abs(family.points - own.p).min() > 0),
            frequency_hz=tuple(hz.tolist()),
            exact_hz=tuple(exact.tolist()),
            frequency_error=float(relative.max(initial=0.0)),
            response_error=float(np.max(apart[scales.heard] / scales.response[scales.heard], initial=0.0)),
            static_error=static if static > STATIC_ROUND_OFF else 0.0,
        )


class _Scales(NamedTuple):
    """The largest response (p, m) of each channel over all poses, and whether there is any; the largest readings of
    equilibria and the force (p + 1,), and whether there are any."""

    response: Array
    heard: NDArray[np.bool_]
    static: Array
    read: NDArray[np.bool_]


def _viscous(built: System, V: Array, M: Array, K: Array) -> Array:
    """Damping (r, r) in coordinates V (n, r), structural one as much as dissipates the same at each resonance; modes
    that are unstable have that of their rate."""
    law = built.law
    values, X = la.eigh(K, M)
    omega = np.sqrt(np.abs(values))
    damping = np.diag(2 * law.modal_ratios(omega / (2 * np.pi)) * omega + law.alpha + law.beta * values)
    damping += X.T @ (V.T @ (built.dashpots @ V)) @ X
    if built.uniform_loss is not None:
        damping += np.diag(built.uniform_loss * omega)
    elif built.H is not None:
        root = np.sqrt(np.where(omega > 0, omega, np.inf))
        damping += X.T @ (V.T @ (built.H @ V)) @ X / np.multiply.outer(root, root)
    back = M @ X
    return symmetric(back @ damping @ back.T)


def _as_compared(built: System) -> System:
    """A system with the damping ratio that is assumed, and without any other damping."""
    law, none = DampingLaw(ratio=ASSUMED_RATIO), 0 * built.C
    return replace(built, law=law, C=none, dashpots=none, H=None, uniform_loss=0.0)
