"""Time response to signals at named inputs: exact recursions in modal coordinates, or generalised-alpha."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis.model_error import interval_text, model_errors_near
from flexura.analysis.responses.blocks import block_response, suits_blocks
from flexura.analysis.responses.frequency_response import proven
from flexura.analysis.responses.integration import generalised_alpha
from flexura.analysis.responses.large_time_response import Asked, large_time_response
from flexura.analysis.responses.left_out import LeftOut, left_out, references
from flexura.analysis.responses.peaks import Run, integrated_warnings
from flexura.analysis.responses.recurrences import Hold
from flexura.analysis.responses.recurrences import motion as modal_motion
from flexura.analysis.strain import Stresses, member_stresses
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError
from flexura.mechanism import Damping, Mechanism
from flexura.reduction import LowOrderModel, Reduction, state_of
from flexura.results import Tabular
from flexura.structure import FullOrderModel, Plan, plan_of
from flexura.systems import Channel, ModalSystem, Order, System, actuator_names, matched, system, with_residual_modes
from flexura.tables import ROUND_OFF, Facts, Table, counted, in_hz, quantity

Method = Literal["exact", "generalised_alpha"]
Motion = Literal["small", "large"]
Samples = ArrayLike | Callable[[Array], ArrayLike]

PER_PERIOD = 10
"""Steps per period of the highest kept mode below which a step counts as coarse."""

LACKING = 1e-6
"""Share of a static correction that is left when residual modes carry it."""

NOTED = 6
"""Lowest modes whose model errors are told."""

STATES = 50_000_000
"""Most values of modal coordinates that are kept."""


@dataclass(frozen=True, repr=False)
class TimeResponse(Tabular):
    """Outputs `response` (p, N) at `time` (N,), s, under `signals` (m, N) at the inputs.

    `modal` (r, N) are the modal coordinates of `modes` where these were kept; `notes` say how this was computed.
    `warnings` are worked out from its `run` when they are first asked for, or `known`.
    """

    _shown = ("name", "time", "inputs", "outputs")

    name: str
    time: Array
    response: Array
    signals: Array
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    notes: tuple[str, ...]
    modes: ModalSystem | None = None
    modal: Array | None = None
    run: Run | None = None
    known: tuple[Diagnostic, ...] = ()

    def of(self, output: str) -> Array:
        """One output (N,) by name. Raises OptionError for others."""
        names = [c.name for c in self.outputs]
        if output not in names:
            raise OptionError(f"there is no output {output!r}; known: {', '.join(names)}")
        return self.response[names.index(output)]

    @cached_property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Where this response stops holding: largest motion, stress and force, and inputs beyond their range."""
        if self.run is None:
            return self.known
        lost = () if self.neglected is None else self.neglected.warnings
        return (*self.run.warnings(self.time, self.signals), *lost)

    @cached_property
    def neglected(self) -> LeftOut | None:
        """A bound on what modes left out would change; None where there are none. Worked out when first asked for."""
        run = self.run
        if run is None or not np.isfinite(run.plain.next_omega):
            return None
        dt, plain = float(self.time[1] - self.time[0]), run.plain
        own = _outputs(plain, self.signals, dt, run.hold, _static(plain, run.start), plain.B @ run.impulses)
        for k, follow in enumerate(zip(*(references(u, dt) for u in self.signals), strict=True), 1):
            at = plain.derivative == k
            own[at] += plain.residual[at] @ np.stack(follow)
        dynamic, peak = np.abs(self.response - own).max(axis=1), np.abs(self.response).max(axis=1)
        return left_out(plain, dynamic, peak, self.signals, dt, run.hold, run.impulses, run.start)

    @cached_property
    def model_error_notes(self) -> tuple[str, ...]:
        """How far the part may be from the lowest modes below 1/(10 dt), in one note; none without modes. Worked out
        when first asked for."""
        if self.run is None:
            return ()
        own = self.run.plain
        hz = own.frequency_hz[(own.frequency_hz > 0) & (PER_PERIOD * own.frequency_hz * self.time[1] < 1)][:NOTED]
        errors = model_errors_near(own.system.full_order, hz)
        told = [f"{in_hz(f)} {interval_text(error)}" for f, (error, _) in zip(hz.tolist(), errors, strict=True)]
        return (f"model error of modes: {', '.join(told)}",) if told else ()

    def displacements(self, at: int | Sequence[int]) -> Array:
        """DOF vectors (n, k) of the full-order model at samples `at`, for shapes and stresses.

        Raises OptionError when modal coordinates were not kept.
        """
        if self.modes is None or self.modal is None:
            raise OptionError("ask for keep_modes=True to recover the motion of everything")
        q = self.modes.shapes @ self.modal[:, np.atleast_1d(np.asarray(at, dtype=np.intp))]
        model = self.modes.system.model
        return q if isinstance(model, FullOrderModel) else model.recover(q)

    def stresses(self, at: int | Sequence[int] | None = None) -> Stresses:
        """The largest stress in every link and flexure over samples `at`, by default all.

        From the modes that are kept, so that it lacks what stiffer modes carry statically. Raises OptionError when
        modal coordinates were not kept.
        """
        u = self.displacements(range(len(self.time)) if at is None else at)
        assert self.modes is not None
        return member_stresses(self.modes.system.full_order, u)

    def _title(self) -> str:
        return f"{counted(len(self.time), 'sample')} up to {quantity(float(self.time[-1]), 's')}"

    def _view(self) -> Iterator[Facts | Table]:
        yield Table(
            {"input": [c.name for c in self.inputs], **_extremes(self.inputs, self.signals, self.time)}, "inputs"
        )
        yield Table(self.output_columns(), "outputs")

    def output_columns(self) -> dict[str, Any]:
        """Least, largest and last value of every output, and when."""
        return {"output": [c.name for c in self.outputs], **_extremes(self.outputs, self.response, self.time)}

    def _data(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "time_s": self.time,
            "outputs": {str(c): y for c, y in zip(self.outputs, self.response, strict=True)},
            "inputs": {str(c): u for c, u in zip(self.inputs, self.signals, strict=True)},
            "neglected": self.neglected,
            "model_error_notes": self.model_error_notes,
        }

    def _columns(self) -> dict[str, Any]:
        ends = zip((*self.inputs, *self.outputs), (*self.signals, *self.response), strict=True)
        return {"time [s]": self.time, **{str(c): own for c, own in ends}}


def _extremes(channels: Sequence[Channel], signals: Array, time: Array) -> dict[str, list[str]]:
    """Least, largest and last value of signals (c, N), each with its unit, and the times of the first two."""
    units = [c.unit for c in channels]
    found: dict[str, list[str]] = {}
    for name, at in (("least", signals.argmin(axis=1)), ("largest", signals.argmax(axis=1))):
        own = [quantity(_clean(y, k), unit) for y, k, unit in zip(signals, at, units, strict=True)]
        found[name] = [f"{text} at {quantity(float(time[k]), 's')}" for text, k in zip(own, at, strict=True)]
    return {**found, "last": [quantity(_clean(y, -1), unit) for y, unit in zip(signals, units, strict=True)]}


def _clean(signal: Array, at: int) -> float:
    """A value of a signal (N,), zero where it is round-off beside the largest."""
    return float(signal[at]) if abs(signal[at]) > ROUND_OFF * np.abs(signal).max() else 0.0


@verb
def time_response(
    model: Mechanism | Plan | FullOrderModel | LowOrderModel | System | ModalSystem,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    inputs: Mapping[str, Samples] | None = None,
    outputs: Sequence[str] | None = None,
    dt: float,
    duration: float | None = None,
    hold: Hold = "foh",
    impulses: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    method: Method = "exact",
    rho_infinity: float = 0.9,
    keep_modes: bool = False,
    damping: Damping | float | Mapping[str, Any] | None = None,
    order: Order = "low",
    motion: Motion = "small",
    keep: int | Mapping[str, int] | None = None,
    keep_below: float | None = None,
    reduction: Reduction | None = None,
    tolerance: float | None = None,
    up_to: float | None = None,
) -> TimeResponse:
    """Response from time zero in steps of `dt`, s, to signals at named `inputs`, read at `outputs`, as in `system`.

    A signal is a list of samples (N,) at 0, dt, 2 dt, ... or a function of time (of `flexura.signals`, or your own)
    over a `duration`. Between samples inputs go on in straight lines (`foh`) or are held (`zoh`), for which the result
    is exact whatever the step (theory eqs. T15-T17). `impulses` act at time zero, N s or N m s by input; `start` is a
    static state under constant inputs, let go at time zero.

    A mechanism is reduced until its frequencies below 1/(10 dt) are proven, or by `keep`, `keep_below`,
    `reduction`, `tolerance`, `up_to` as in `reduce`, or taken at `order="full"`; structural damping
    becomes viscous damping that dissipates the same at each resonance. `generalised_alpha` (Chung and Hulbert 1993,
    with `rho_infinity`) integrates M, C, K as they are, for any damping, with an error of order dt^2.

    In `large` motion displacements and rotations are as large as they get, of all elements at `order="full"` or of
    corotational superelements, which are made as fine as the motion asks for (theory eqs. G28-G35). It is integrated by
    the generalised-alpha method on frames that turn (Brüls, Cardona, Arnold 2012); loads and gravity that are described
    are on all the time, and damping is that of dashpots and Rayleigh's.

    Raises ModelError, and OptionError for unknown names, impossible steps, and signals that differ in length or are not
    finite.
    """
    if not (np.isfinite(dt) and dt > 0):
        raise OptionError(f"dt is a positive time in s, not {dt}")
    if hold not in get_args(Hold):
        raise OptionError(f"hold is zoh or foh, not {hold!r}")
    if method not in get_args(Method):
        raise OptionError(f"method is one of {', '.join(get_args(Method))}, not {method!r}")
    ways = {"keep": keep, "keep_below": keep_below, "reduction": reduction, "tolerance": tolerance, "up_to": up_to}
    how = {name: value for name, value in ways.items() if value is not None}
    if isinstance(model, Mechanism):
        model = plan_of(model, parameters)
    if motion not in get_args(Motion):
        raise OptionError(f"motion is small or large, not {motion!r}")
    known = _known_inputs(model)
    inputs, impulses, start = (_spread(given or {}, known) for given in (inputs, impulses, start))
    names: list[str] = list(dict.fromkeys([*inputs, *impulses, *start]))
    if not names:
        raise OptionError("nothing acts on the mechanism: give inputs, impulses or a state to start from")
    time, u = _signals(inputs, names, dt, duration)
    if motion == "large":
        if how or keep_modes or hold != "foh":
            raise OptionError("hold, keep_modes and methods of reduction belong to small motion")
        asked = Asked(u, dt, _by_name(names, impulses), _by_name(names, start), rho_infinity)
        return _large(_moving(model, parameters, names, outputs, damping), asked, time, order)
    built = _built(model, parameters, names, outputs, dt, order, damping, how)
    if method == "generalised_alpha":
        if isinstance(built, ModalSystem):
            raise OptionError("generalised_alpha integrates a mechanism, a model or a System, not its modal form")
        return _integrated(built, time, u, dt, rho_infinity, _by_name(names, impulses), _by_name(names, start))
    modes = built if isinstance(built, ModalSystem) else _modes(built, dt, model)
    return _exact(modes, time, u, dt, hold, _by_name(names, impulses), _by_name(names, start), keep_modes)


def _moving(
    model: Any,
    parameters: Mapping[str, ArrayLike] | None,
    names: list[str],
    outputs: Sequence[str] | None,
    damping: Any,
) -> System:
    """The system of full order with inputs and outputs. Raises OptionError for what cannot move far."""
    if not isinstance(model, Plan | FullOrderModel) or (model if isinstance(model, Plan) else model.plan).is_posed:
        raise OptionError("large motion is that of an undeformed mechanism, not of a reduced model, a system or a pose")
    return system(model, parameters, inputs=names, outputs=outputs, order="full", damping=damping)


def _large(built: System, asked: Asked, time: Array, order: Order) -> TimeResponse:
    if not 0 <= asked.rho <= 1:
        raise OptionError(f"rho_infinity lies between 0 and 1, not {asked.rho}")
    found = large_time_response(built, asked, order)
    notes, known = found.notes, found.warnings
    return TimeResponse(built.name, time, found.response, asked.u, built.inputs, built.outputs, notes, known=known)


def _known_inputs(model: Any) -> list[str]:
    """Names that wildcards may stand for."""
    if isinstance(model, System | ModalSystem):
        return [c.name for c in model.inputs]
    return actuator_names(model.plan if isinstance(model, FullOrderModel | LowOrderModel) else plan_of(model))


def _spread(given: Mapping[str, Any], known: list[str]) -> dict[str, Any]:
    """Values by name with wildcards written out."""
    names = matched(given, known)
    return {own: value for name, value in given.items() for own in names[name]}


def _by_name(names: list[str], given: Mapping[str, float] | None) -> Array:
    found = np.zeros(len(names))
    for name, value in (given or {}).items():
        try:
            found[names.index(name)] = float(value)
        except (TypeError, ValueError):
            raise OptionError(f"{name}: a number is expected, not {value!r}") from None
    if not np.isfinite(found).all():
        raise OptionError("impulses and states to start from are finite numbers")
    return found


def _signals(inputs: Mapping[str, Samples], names: list[str], dt: float, duration: float | None) -> tuple[Array, Array]:
    """Times (N,) and samples (m, N) of all inputs. Raises OptionError where they do not fit."""
    sampled = {name: _numbers(name, s) for name, s in inputs.items() if not callable(s)}
    if duration is not None and not (np.isfinite(duration) and duration > 0):
        raise OptionError(f"duration is a positive time in s, not {duration}")
    lengths = {name: s.shape for name, s in sampled.items()}
    if any(len(shape) != 1 for shape in lengths.values()) or len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} has {'x'.join(map(str, shape))}" for name, shape in lengths.items())
        raise OptionError(f"signals are lists of samples of one length: {listed}")
    if sampled:
        count = len(next(iter(sampled.values())))
        if duration is not None and count < round(duration / dt) + 1:
            raise OptionError(
                f"the signals end after {counted(count, 'sample')}; {duration:g} s in steps of {dt:g} s need more"
            )
        if duration is not None:
            count = round(duration / dt) + 1
    elif duration is None:
        raise OptionError("a duration in s is needed: the inputs are functions of time")
    else:
        count = round(duration / dt) + 1
    if count < 2:
        raise OptionError("a time response has at least two samples: shorten dt or lengthen the signals")
    time: Array = dt * np.arange(count, dtype=float)
    u = np.zeros((len(names), count))
    for k, name in enumerate(names):
        own = inputs.get(name)
        if own is not None:
            u[k] = _called(name, own, time) if callable(own) else sampled[name][:count]
            if not np.isfinite(u[k]).all():
                first = int(np.flatnonzero(~np.isfinite(u[k]))[0])
                raise OptionError(f"the signal of {name} is not finite at sample {first}")
    return time, u


def _numbers(name: str, samples: Any) -> Array:
    try:
        return np.asarray(samples, dtype=float)
    except (TypeError, ValueError):
        raise OptionError(
            f"the signal of {name} is a list of numbers, or a function of time that returns one"
        ) from None


def _called(name: str, signal: Callable[[Array], ArrayLike], time: Array) -> Array:
    """Samples (N,) of a function of time."""
    found = _numbers(name, signal(time))
    if found.shape not in ((), time.shape):
        raise OptionError(f"the signal of {name} returns {len(time)} values for as many times, not {found.shape}")
    return found


def _built(
    model: Any,
    parameters: Mapping[str, ArrayLike] | None,
    inputs: list[str],
    outputs: Sequence[str] | None,
    dt: float,
    order: Order,
    damping: Any,
    how: dict[str, Any],
) -> System | ModalSystem:
    if isinstance(model, System | ModalSystem):
        if damping is not None or parameters or how or order != "low":
            raise OptionError(
                "order, damping, parameters and methods of reduction belong to a mechanism, not to a finished system"
            )
        return model.selected(inputs, outputs)
    if isinstance(model, Plan) and order == "low" and not how:
        model, parameters = proven(model, parameters, 1 / (PER_PERIOD * dt)), None
    return system(model, parameters, inputs=inputs, outputs=outputs, order=order, damping=damping, **how)


def _modes(built: System, dt: float, model: Any) -> ModalSystem:
    """All modes of a low-order system that the caller chose, else those that the step resolves."""
    if isinstance(built.model, FullOrderModel) or isinstance(model, Plan):
        return built.modal(up_to=1 / (PER_PERIOD * dt))
    return built.modal()


def _exact(
    modes: ModalSystem, time: Array, u: Array, dt: float, hold: Hold, impulses: Array, start: Array, keep: bool
) -> TimeResponse:
    whole = with_residual_modes(modes) if modes.order else modes
    notes = _notes(modes, whole, dt, hold)
    plain, modes = modes.viscous(), whole.viscous()
    eta0, rate0 = _static(modes, start), modes.B @ impulses
    run = Run(modes, hold, eta0, rate0, plain, impulses, start)
    if not keep:
        y = _outputs(modes, u, dt, hold, eta0, rate0)
        return TimeResponse(modes.system.name, time, y, u, modes.inputs, modes.outputs, notes, run=run)
    if modes.order * len(time) > STATES:
        raise OptionError(f"keep_modes keeps at most {STATES} values: ask for fewer modes or samples")
    eta, rate = modal_motion(modes, u, dt, hold, eta0, rate0, {0} | {min(k, 1) for k in modes.derivative.tolist()})
    y = _read_all(modes, eta, rate, u)
    return TimeResponse(modes.system.name, time, y, u, modes.inputs, modes.outputs, notes, modes, eta, run)


def _outputs(modes: ModalSystem, u: Array, dt: float, hold: Hold, eta0: Array, rate0: Array) -> Array:
    """Outputs (p, N), by whichever recursion is the shorter way."""
    if suits_blocks(modes, len(u)):
        y = modes.D @ u + block_response(modes, u, dt, hold, eta0, rate0)
        return y + np.where(modes.derivative[:, None] == 0, modes.residual, 0.0) @ u
    orders = set(modes.derivative.tolist())
    wanted = {min(k, 1) for k in orders} | ({0} if 2 in orders else set())
    eta, rate = modal_motion(modes, u, dt, hold, eta0, rate0, wanted)
    return _read_all(modes, eta, rate, u)


def _read_all(modes: ModalSystem, eta: Array | None, rate: Array | None, u: Array) -> Array:
    """Outputs (p, N) from modal coordinates."""
    y = modes.D @ u
    for order in set(modes.derivative.tolist()):
        at = np.flatnonzero(modes.derivative == order)
        y[at] += _read(modes, eta, rate, u, modes.C[at], order)
        if order == 0:
            y[at] += modes.residual[at] @ u
    return y


def _read(modes: ModalSystem, eta: Array | None, rate: Array | None, u: Array, C: Array, order: int) -> Array:
    """C eta, C eta' or C eta'' (o, N), the last from the equation of motion."""
    if order == 0:
        assert eta is not None
        return C @ eta
    assert rate is not None
    if order == 1:
        return C @ rate
    assert eta is not None
    return (C @ modes.B) @ u - (C @ modes.damping) @ rate - (C * modes.omega**2) @ eta


def _static(modes: ModalSystem, start: Array) -> Array:
    """Modal coordinates (r,) of the static state under constant inputs."""
    if not start.any():
        return np.zeros(modes.order)
    if (modes.omega == 0).any():
        raise OptionError("there is no static state to start from: something can move freely")
    return modes.B @ start / modes.omega**2


def _notes(modes: ModalSystem, whole: ModalSystem, dt: float, hold: Hold) -> tuple[str, ...]:
    shape = "straight lines between samples" if hold == "foh" else "samples held"
    more = whole.order - modes.order
    residual = f" and {more} residual mode{'s' if more > 1 else ''}" if more else ""
    notes = [f"{modes.order} modes{residual}, exact for {shape}", *state_of(modes.system.model.design)]
    if modes.loss is not None:
        notes.append("structural damping taken as viscous damping that dissipates the same at each resonance")
    highest = float(modes.frequency_hz[-1]) if modes.order else 0.0
    if dt * highest * PER_PERIOD > 1 + 1e-9:
        needed = 1 / (PER_PERIOD * highest)
        notes.append(
            f"the step is coarse for the highest kept mode, {in_hz(highest)}: what happens between samples is not seen;"
            f" {quantity(needed, 's', 2)} would do, or keep fewer modes"
        )
    later = [c.name for c, k in zip(modes.outputs, modes.derivative, strict=True) if k]
    lacking = np.abs(whole.residual) > LACKING * np.abs(modes.residual)
    if later and lacking[modes.derivative > 0].any():
        notes.append(f"velocities and accelerations lack the static correction of modes left out: {', '.join(later)}")
    return tuple(notes)


def _integrated(
    built: System, time: Array, u: Array, dt: float, rho: float, impulses: Array, start: Array
) -> TimeResponse:
    if built.H is not None:
        raise OptionError("structural damping has no causal time response: use method exact, or viscous damping")
    M, C, K, _ = built.matrices()
    q, v, a = generalised_alpha(M, C, K, built.B, u, dt, rho, start, impulses)
    y = built.D @ u
    for order, own in enumerate((q, v, a)):
        at = built.derivative == order
        y[at] += built.rows[at] @ own
    y[built.derivative == 0] += built.residual[built.derivative == 0] @ u
    notes = (f"generalised-alpha, rho_infinity {rho:g}, {built.order} coordinates: error of order dt^2",)
    notes = (*notes, *state_of(built.model.design))
    known = integrated_warnings(built, q, time, u)
    return TimeResponse(built.name, time, y, u, built.inputs, built.outputs, notes, known=known)
