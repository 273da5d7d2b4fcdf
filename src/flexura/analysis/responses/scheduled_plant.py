"""A plant that knows its pose: state spaces of a mechanism along a stroke, between poses by polynomials."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from flexura.analysis.limits import command_limits
from flexura.analysis.responses.posed_systems import ASSUMED_RATIO, OF_SPEED, At, PoseCheck, SingleStroke, StrokePoses
from flexura.analysis.responses.sampling import Samples, by_name, sampled
from flexura.analysis.responses.time_response import TimeResponse
from flexura.analysis.strokes import FromTo
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener, Progress
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import at_rest
from flexura.mechanism import Damping, Mechanism
from flexura.results import Tabular
from flexura.structure import Channel, FullOrderModel, Plan
from flexura.systems import Frozen, ScheduledSystem, StateSpace, System, chebyshev_points
from flexura.tables import Facts, Item, Table, counted, ends, in_hz, percent, quantity

MODES = 6
"""Deviations from the equilibria that are kept, where nothing else is requested."""

FIRST, MOST = 5, 33
"""Poses that the first polynomials go through, and the last."""

SAME_SPACE = 0.2
"""Least part of the modes in the middle of the stroke that those elsewhere must span."""


@dataclass(frozen=True, repr=False)
class ScheduledPlant(Tabular):
    """State spaces of a mechanism along the stroke of one displacement, the scheduling parameter (gain scheduling,
    linear parameter varying, LPV).

    `family` has the second-order matrices at its points and between. `checks` hold it against the model about poses, at
    its points and between them; `error` is the largest of responses, `frequency_error` of frequencies up to `up_to`,
    Hz, and `static_error` of equilibria, estimates of what the error is anywhere. `speed`, in units of the parameter
    per second, is that up to which inertia forces that are left out, those of modes that change with the pose, stay
    below 1 %. `overlap` (k,) is how much of the modes in the middle of the stroke the deviations at the points span, at
    least.
    """

    _shown = ("name", "family", "error")
    model: FullOrderModel
    system: System
    family: ScheduledSystem
    checks: tuple[PoseCheck, ...]
    up_to: float
    speed: float
    overlap: Array
    warnings: tuple[Diagnostic, ...]
    notes: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.model.name

    @property
    def inputs(self) -> tuple[Channel, ...]:
        """What drives it."""
        return self.system.inputs

    @property
    def outputs(self) -> tuple[Channel, ...]:
        """What is read of it."""
        return self.system.outputs

    @cached_property
    def error(self) -> float:
        """Largest difference of responses, over the largest of each channel."""
        return max(own.response_error for own in self.checks)

    @cached_property
    def frequency_error(self) -> float:
        """Largest relative difference of natural frequencies in the band."""
        return max(own.frequency_error for own in self.checks)

    @cached_property
    def static_error(self) -> float:
        """Largest difference of the force and of readings of equilibria, over their largest."""
        return max(own.static_error for own in self.checks)

    def at(self, pose: float) -> Frozen:
        """M, C, K, B, outputs, and the equilibrium, force and readings, at a pose, m or rad. Raises OptionError for
        one that is not on the stroke."""
        return self.family.at(pose)

    def state_space(self, pose: float) -> StateSpace:
        """The state space about a pose, m or rad: deviations from the equilibrium there, under what is added to the
        force that holds it. Raises OptionError for one that is not on the stroke."""
        own, family = self.family.at(pose), self.family
        A, B, C, D = own.first_order(family.derivative, family.D)
        notes = (f"about {family.text(pose)}, deviations from the equilibrium there", *self.notes)
        ends = self.inputs, self.outputs
        return StateSpace(A, B, C, D, *ends, self.state_names, name=self.name, notes=notes, warnings=self.warnings)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states: the parameter, deviations, and the rates of both."""
        order = self.family.samples.M.shape[-1]
        names = [self.family.parameter, *(f"deviation {k}" for k in range(1, order))]
        return (*names, *(f"{name} rate" for name in names))

    def time_response(
        self,
        *,
        inputs: Mapping[str, Samples],
        dt: float,
        duration: float | None = None,
        start: Mapping[str, float] | None = None,
    ) -> TimeResponse:
        """The plant over time, its parameter the displacement that it has: as far as it moves, from the static state
        under the inputs `start`, signals as in `time_response`, straight lines between samples.

        Raises OptionError for unknown names, impossible signals, and where no static state is on the stroke, and
        SolverError where the motion leaves the stroke.
        """
        if not (np.isfinite(dt) and dt > 0):
            raise OptionError(f"dt is a positive time in s, not {dt}")
        names = [channel.name for channel in self.inputs]
        unknown = next((name for name in (*inputs, *(start or {})) if name not in names), None)
        if unknown is not None:
            raise OptionError(f"there is no input {unknown!r}; known: {', '.join(names)}")
        u = sampled(inputs, names, dt, duration)
        time = dt * np.arange(u.shape[1])
        resting = self.family.resting(by_name(names, start or {}))
        moved = self.family.motion(lambda t: _between(u, t / dt), dt, u.shape[1], resting)
        fastest = float(np.abs(moved.rates[0]).max())
        warnings = command_limits(self.system.input_ports, u, lambda k: f" at {quantity(k * dt, 's', 6)}")
        if fastest > self.speed:
            text = (
                f"{self.family.parameter} moves with up to {quantity(fastest, f'{self.family.unit}/s')}: inertia forces"
                f" of modes that change with the pose, which are left out, stay below {percent(OF_SPEED)} up to"
                f" {quantity(self.speed, f'{self.family.unit}/s')}"
            )
            warnings = (*warnings, Diagnostic("speed", self.family.parameter, fastest, self.speed, "m/s", text))
        known = (*self.warnings, *warnings)
        return TimeResponse(self.name, time, moved.outputs, u, self.inputs, self.outputs, self.notes, known=known)

    def arrays(self) -> dict[str, Array]:
        """What files have of it, at the k poses `pose` that polynomials go through: `weights` (k,) by which these are
        evaluated between (Berrut and Trefethen 2004), A, B, C, D (k, ...) of x' = dx0 + dx2 v^2 + A (x - x0) + B u,
        y = y0 + y2 v^2 + C (x - x0) + D u, where x0 is the pose and zeros and v its rate; M, damping, K, loads, the
        `force` that holds the pose and `swing`, forces by the square of the speed, of the second-order form."""
        family, count = self.family, len(self.family.points)
        at, turned = [family.at(float(p)) for p in family.points], family.slopes(family.samples.rows)
        frozen = [own.first_order(family.derivative, family.D) for own in at]
        forces = (np.stack([np.append(own.force, np.zeros(len(own.M) - 1)) for own in at]), family.samples.swing)
        rates = [
            np.stack([-np.linalg.solve(own.M, held) for own, held in zip(at, force, strict=True)]) for force in forces
        ]
        faster = [np.einsum("kpr,kr->kp", family.samples.rows, a) * (family.derivative == 2) for a in rates]
        known: dict[str, Any] = {
            "pose": family.points,
            "weights": (-1.0) ** np.arange(count) * np.where(np.arange(count) % (count - 1) == 0, 0.5, 1.0),
            **{name: np.stack(values) for name, values in zip("ABCD", zip(*frozen, strict=True), strict=True)},
            **{name: np.hstack([0 * a, a]) for name, a in zip(("dx0", "dx2"), rates, strict=True)},
            "y0": family.samples.readings + faster[0],
            "y2": faster[1] + turned[:, :, 0] * (family.derivative == 2),
        }
        second = {"M": "M", "damping": "C", "K": "K", "loads": "B", "force": "force", "swing": "swing"}
        return known | {name: np.stack([getattr(own, key) for own in at]) for name, key in second.items()}

    def _data(self) -> dict[str, Any]:
        names = ("name", "inputs", "outputs", "checks", "error", "frequency_error", "static_error", "up_to")
        found = {name: getattr(self, name) for name in (*names, "speed", "overlap")}
        return {**found, "parameter": self.family.parameter, "unit": self.family.unit, **self.arrays()}

    def _title(self) -> str:
        low_high = ends(self.family.ends, self.family.unit)
        return f"{self.family.parameter} from {low_high}, {counted(self.family.samples.M.shape[-1], 'coordinate')}"

    def presentation(self) -> Iterator[Item]:
        """How far it is off at poses, and what it is for."""
        yield Facts(
            {
                "polynomials through": counted(len(self.family.points), "pose"),
                "for": f"up to {in_hz(self.up_to)}",
                "responses off by, at most": percent(self.error, 2),
                "frequencies off by, at most": percent(self.frequency_error, 2),
                "equilibria off by, at most": percent(self.static_error, 2),
                "inertia forces left out below 1 % up to": quantity(self.speed, f"{self.family.unit}/s", 3),
            }
        )
        every = self._columns()
        shown = {name: values for name, values in every.items() if "exact" not in name and "error" not in name}
        kinds = ("frequency", "response", "static")
        off = {f"{kind} off by": [percent(value, 2) for value in every[f"{kind} error"]] for kind in kinds}
        between = shown.pop("between")
        yield Table({**shown, **off, "between": between}, "poses")

    def _columns(self) -> dict[str, Any]:
        family, checks = self.family, self.checks
        force = {"m": "N", "rad": "N*m"}[family.unit]
        shown = min(3, *(len(own.exact_hz) for own in checks))
        return {
            f"{family.parameter} [{family.unit}]": [own.at for own in checks],
            f"force [{force}]": [own.force for own in checks],
            **{f"f{k + 1} [Hz]": [own.frequency_hz[k] for own in checks] for k in range(shown)},
            **{f"f{k + 1} exact [Hz]": [own.exact_hz[k] for own in checks] for k in range(shown)},
            "frequency error": [own.frequency_error for own in checks],
            "response error": [own.response_error for own in checks],
            "static error": [own.static_error for own in checks],
            "between": [own.between for own in checks],
        }


def _between(u: Array, place: float) -> Array:
    """Samples (m, N) at a place among them, on straight lines."""
    k = min(int(place), u.shape[1] - 1)
    after = min(k + 1, u.shape[1] - 1)
    return u[:, k] + (place - k) * (u[:, after] - u[:, k])


@verb
def scheduled_plant(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    move: Mapping[str, FromTo],
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    n: int = MODES,
    up_to: float | None = None,
    tolerance: float = 0.01,
    damping: Damping | float | Mapping[str, Any] | None = None,
    progress: Listener | None = None,
) -> ScheduledPlant:
    """A gain-scheduled plant (LPV): state spaces along the stroke of one displacement, with errors between poses.

    `move` is the displacement, the scheduling parameter, and its range, as {"carriage.x": (0, 9e-3)}, m or rad, that
    of the node on which the drive acts. At each pose the coordinates are the displacement itself, with the motion that
    equilibria have along the stroke, and `n` deviations from it with the drive held: what the pose answers to inertia
    forces of the lowest modes in the middle of the stroke, orthonormal and as near to these as they get, so that they
    keep their meaning (Bathe and Wilson 1972; Amsallem and Farhat 2011). Matrices, the force of the drive and what the
    outputs read are polynomials through Chebyshev points of the stroke, as many as it takes until, at poses between,
    natural frequencies up to `up_to`, Hz, and responses, over the largest of their channel, and statics are within
    `tolerance`, relative, of those of the full order about the pose. Inputs, outputs and `damping` are those of
    `system` (theory eqs. T41-T46).

    Raises ModelError, OptionError for more than one displacement and for impossible numbers, and SolverError where a
    pose of the stroke is not reached.
    """
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise OptionError(f"the number of modes is a whole number, at least 1, not {n!r}")
    if up_to is not None and not (np.isfinite(up_to) and up_to > 0):
        raise OptionError(f"up_to is a positive frequency in Hz, not {up_to}")
    if not (np.isfinite(tolerance) and tolerance > 0):
        raise OptionError(f"tolerance is a positive relative error, not {tolerance}")
    stroke = SingleStroke.of(at_rest(model, parameters), move)
    poses = StrokePoses(stroke, {"inputs": inputs, "outputs": outputs, "damping": damping}, int(n), up_to)
    count, (low, high) = FIRST, stroke.range
    while True:
        points, between = chebyshev_points(low, high, count), chebyshev_points(low, high, 2 * count - 1)[1::2]
        for number, p in enumerate((*points, *between)):
            poses.at(float(p))
            if progress is not None:
                progress(Progress("poses", number + 1, 2 * count - 1))
        family = poses.family(points)
        checks = poses.checks(family, [*points, *between])
        at, off = (max(own.error for own in checks if own.between is kind) for kind in (False, True))
        if off <= tolerance or tolerance < at >= off / 2 or 2 * count - 1 > MOST:
            return _plant(stroke, poses, family, checks, tolerance)
        count = 2 * count - 1


def _plant(
    stroke: SingleStroke, poses: StrokePoses, family: ScheduledSystem, checks: tuple[PoseCheck, ...], tolerance: float
) -> ScheduledPlant:
    """The plant with its warnings and notes."""
    known = [poses.at(float(p)) for p in family.points]
    overlap = np.array([own.overlap for own in known])
    warnings = list[Diagnostic]()
    worst = max(checks, key=lambda own: own.error)
    if worst.error > tolerance:
        why = "between its poses polynomials do not follow" if worst.between else "keep more modes (n), or lower up_to"
        text = (
            f"up to {in_hz(poses.up_to)} responses are off by up to {percent(worst.response_error, 2)} of the largest,"
            f" frequencies by {percent(worst.frequency_error, 2)}, statics by {percent(worst.static_error, 2)}, most at"
            f" {stroke.words(worst.at)}, more than {percent(tolerance)}: {why}"
        )
        warnings.append(Diagnostic("tolerance", family.parameter, worst.error, tolerance, "1", text))
    everywhere = [poses.at(own.at) for own in checks]
    for own, check in zip(everywhere, checks, strict=True):
        lowest = min(check.frequency_hz)
        if lowest < 0:
            held = la.eigvalsh(own.plant.K[1:, 1:], own.plant.M[1:, 1:])[0] < 0
            how = ", even with its drive held" if held else " under the force that holds it"
            text = f"at {stroke.words(own.p)} the plant is unstable{how}, {lowest:.4g} Hz"
            warnings.append(Diagnostic("buckling", family.parameter, lowest, 0.0, "Hz", text))
            break
    if overlap.min() < SAME_SPACE:
        k = int(overlap.argmin())
        text = (
            f"at {stroke.words(known[k].p)} the {counted(poses.n, 'deviation')} that are kept span {overlap[k]:.2g} of"
            " the modes in the middle of the stroke, and mean something else: keep more modes (n), or fewer"
        )
        warnings.append(Diagnostic("modes", family.parameter, float(overlap[k]), SAME_SPACE, "1", text))
    notes = [
        "deviations from the equilibria along the stroke, inertia forces of modes that change with the pose left out",
        *_crossings(stroke, everywhere, checks, poses.up_to),
    ]
    if any(not len(own.hz) for own in everywhere):
        notes.append("where it is unstable, responses are not compared with those of the full order")
    if poses.is_assumed:
        notes.append(
            f"nothing damps some or all of it: responses are compared with a damping ratio of {ASSUMED_RATIO:g}"
        )
    return ScheduledPlant(
        stroke.full, poses.system, family, checks, poses.up_to, poses.speed(family), overlap,
        tuple(warnings), tuple(notes),
    )  # fmt: skip


def _crossings(stroke: SingleStroke, known: Sequence[At], checks: Sequence[PoseCheck], up_to: float) -> Iterator[str]:
    """Where modes of the plant change places, in words."""
    shapes = [la.eigh(own.plant.K, own.plant.M)[1] for own in known]
    for (one, X, check), (other, Y, _) in pairwise(zip(known, shapes, checks, strict=True)):
        number = np.abs(X.T @ one.plant.M @ Y).argmax(axis=1)
        heard = int((np.array(check.frequency_hz) <= up_to).sum())
        for a in range(heard):
            for b in (b for b in range(a + 1, heard) if number[a] > number[b]):
                yield f"modes {a + 1} and {b + 1} cross between {stroke.words(one.p)} and {stroke.words(other.p)}"
