"""Time response to signals at named inputs: exact recursions in modal coordinates, or generalised-alpha."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis.model_error import interval_text, model_errors_near
from flexura.analysis.responses.closed_loop import LoopState, closed_model, is_closed
from flexura.analysis.responses.frequency_response import proven
from flexura.analysis.responses.large_time_response import Stepping, large_time_response
from flexura.analysis.responses.sampling import Samples, by_name, sampled
from flexura.analysis.responses.stepping import (
    Driven,
    Hold,
    block_response,
    generalised_alpha,
    modal_motion,
    suits_blocks,
)
from flexura.analysis.responses.time_limits import (
    Excitation,
    LeftOut,
    Run,
    integrated_warnings,
    left_out,
    references,
)
from flexura.analysis.strain import Stresses, member_stresses
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import plan_of
from flexura.mechanism import Damping, Mechanism
from flexura.reduction import LowOrderModel, Reduction, state_of
from flexura.results import Tabular
from flexura.structure import Channel, FullOrderModel, Plan, actuator_names, matched
from flexura.systems import ModalSystem, Order, StateSpace, System, held_exponentials, system, with_residual_modes
from flexura.tables import SHOWN_AS_ZERO, Item, Line, Table, counted, in_hz, quantity

Method = Literal["exact", "generalised_alpha"]
Motion = Literal["small", "large"]

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
        return (*self.run.warnings, *(() if self.neglected is None else self.neglected.warnings))

    @cached_property
    def neglected(self) -> LeftOut | None:
        """A bound on what modes left out would change; None where there are none. Worked out when first asked for."""
        run = self.run
        if run is None or not np.isfinite(run.plain.next_omega):
            return None
        plain, excitation = run.plain, run.excitation
        carried = _outputs(plain, _driven(plain, excitation))
        for k, follow in enumerate(zip(*(references(u, excitation.dt) for u in excitation.u), strict=True), 1):
            at = plain.derivative == k
            carried[at] += plain.residual[at] @ np.stack(follow)
        return left_out(run, np.abs(self.response - carried).max(axis=1), np.abs(self.response).max(axis=1))

    @cached_property
    def model_error_notes(self) -> tuple[str, ...]:
        """How far the part may be from the lowest modes below 1/(10 dt), in one note; none without modes. Worked out
        when first asked for."""
        if self.run is None:
            return ()
        hz = self.run.plain.frequency_hz
        hz = hz[(hz > 0) & (PER_PERIOD * hz * self.time[1] < 1)][:NOTED]
        errors = model_errors_near(self.run.plain.system.full_order, hz)
        texts = [f"{in_hz(f)} {interval_text(error)}" for f, (error, _) in zip(hz.tolist(), errors, strict=True)]
        return (f"model error of modes: {', '.join(texts)}",) if texts else ()

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

    def presentation(self) -> Iterator[Item]:
        """Extremes and final values of inputs and outputs, and what is not in them."""
        for what, channels, signals in (("input", self.inputs, self.signals), ("output", self.outputs, self.response)):
            yield Table({what: [c.name for c in channels], **_extremes(channels, signals, self.time)}, f"{what}s")
        if self.neglected is not None:
            yield Line(self.neglected.text)
        yield from map(Line, self.model_error_notes)

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
        channels = zip((*self.inputs, *self.outputs), (*self.signals, *self.response), strict=True)
        return {"time [s]": self.time, **{str(channel): values for channel, values in channels}}


def _extremes(channels: Sequence[Channel], signals: Array, time: Array) -> dict[str, list[str]]:
    """Least, largest and last value of signals (c, N), each with its unit and zero where it is round-off beside the
    largest, and the times of the first two."""

    def texts(at: Any) -> list[str]:
        values = [
            y[k] if abs(y[k]) > SHOWN_AS_ZERO * np.abs(y).max() else 0.0 for y, k in zip(signals, at, strict=True)
        ]
        return [quantity(float(value), channel.unit) for value, channel in zip(values, channels, strict=True)]

    columns: dict[str, list[str]] = {}
    for name, at in (("least", signals.argmin(axis=1)), ("largest", signals.argmax(axis=1))):
        times = [quantity(float(time[k]), "s") for k in at]
        columns[name] = [f"{text} at {when}" for text, when in zip(texts(at), times, strict=True)]
    return {**columns, "last": texts([-1] * len(signals))}


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
    move: Mapping[str, Samples] | None = None,
    method: Method = "exact",
    rho_infinity: float = 0.9,
    local_error: float | None = None,
    keep_modes: bool = False,
    damping: Damping | float | Mapping[str, Any] | None = None,
    order: Order = "low",
    motion: Motion = "small",
    loop: LoopState = "open",
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

    With the `loop` closed, that of the `controllers` described, around modes of the full-order model as in
    `closed_loop`: signals may be references and noises of controllers, `NAME.reference`, outputs their commands.

    In `large` motion displacements and rotations are as large as they get, of all elements at `order="full"` or of
    corotational superelements, which are made as fine as the motion asks for (theory eqs. G28-G35). It is integrated by
    the generalised-alpha method on frames that turn (Brüls, Cardona, Arnold 2012); loads and gravity that are described
    are on all the time, and damping is that of dashpots and Rayleigh's. Steps that do not settle are halved, as often
    as they need, and those of a larger `local_error`, a share of the largest motion so far, or in contact with a stop
    (eqs. G49-G51); a note says so. Displacements may be prescribed, `move` by names such as `carriage.x`, m and rad,
    on splines between samples; the forces that this takes follow the outputs, `carriage.x:force` (eq. G52). The
    base may be accelerated along axes, which is gravity the other way.

    Raises ModelError, and OptionError for unknown names, impossible steps, and signals that differ in length or are not
    finite.
    """
    _refuse_unknown(dt, hold, method, motion)
    given = {"keep": keep, "keep_below": keep_below, "reduction": reduction, "tolerance": tolerance, "up_to": up_to}
    reducing = {name: value for name, value in given.items() if value is not None}
    if isinstance(model, Mechanism):
        model = plan_of(model, parameters)
    known = _known_inputs(model)
    inputs, impulses, start = (_spread(values or {}, known) for values in (inputs, impulses, start))
    names: list[str] = list(dict.fromkeys([*inputs, *impulses, *start]))
    moves = dict(move or {})
    if not names and not moves:
        raise OptionError("nothing acts on the mechanism: give inputs, impulses, moves or a state to start from")
    if moves and motion != "large":
        raise OptionError("move prescribes displacements of large motion: motion='large'")
    signals, places = _sampled_together(inputs, names, moves, dt, duration)
    excitation = Excitation(signals, dt, by_name(names, impulses), by_name(names, start), hold)
    channels: dict[str, Any] = {"inputs": names, "outputs": outputs, "damping": damping}
    if is_closed(loop):
        if reducing or keep_modes or method != "exact" or motion != "small" or excitation.start.any():
            raise OptionError("start, keep_modes, method, large motion and methods of reduction belong to open loops")
        return _of_state_space(closed_model(model, parameters, names, outputs, damping=damping), excitation)
    if local_error is not None and motion != "large":
        raise OptionError("local_error chooses the steps of large motion: motion='large'")
    if motion == "large":
        if reducing or keep_modes or hold != "foh":
            raise OptionError("hold, keep_modes and methods of reduction belong to small motion")
        built = moving_system(model, parameters, **channels)
        found = large_time_response(
            built, excitation, Stepping(rho_infinity, local_error), order, dict(zip(moves, places, strict=True))
        )
        return TimeResponse(
            built.name,
            excitation.time,
            found.response,
            np.concatenate([excitation.u, places]) if moves else excitation.u,
            (*built.inputs, *found.moved),
            (*built.outputs, *found.reactions),
            found.notes,
            known=found.warnings,
        )
    chosen = _small_motion_system(model, parameters, dt=dt, order=order, reducing=reducing, **channels)
    if method == "generalised_alpha":
        if isinstance(chosen, ModalSystem):
            raise OptionError("generalised_alpha integrates a mechanism, a model or a System, not its modal form")
        return _integrated(chosen, excitation, rho_infinity)
    if isinstance(chosen, System):
        # all modes of a low-order system that the caller chose, else those that the step resolves
        is_resolved = isinstance(chosen.model, FullOrderModel) or isinstance(model, Plan)
        chosen = chosen.modal(up_to=1 / (PER_PERIOD * dt)) if is_resolved else chosen.modal()
    return _exact(chosen, excitation, keep_modes)


def _sampled_together(
    inputs: Mapping[str, Samples], names: list[str], moves: Mapping[str, Samples], dt: float, duration: float | None
) -> tuple[Array, Array]:
    """Samples (m, N) of inputs and (d, N) of prescribed displacements. Raises OptionError where they do not fit."""
    if set(names) & set(moves):
        raise OptionError(f"{', '.join(sorted(set(names) & set(moves)))} is prescribed and loaded by one name")
    every = sampled({**inputs, **moves}, [*names, *moves], dt, duration)
    return every[: len(names)], every[len(names) :]


def _refuse_unknown(dt: float, hold: str, method: str, motion: str) -> None:
    """Raise OptionError for steps and words that mean nothing."""
    if not (np.isfinite(dt) and dt > 0):
        raise OptionError(f"dt is a positive time in s, not {dt}")
    if hold not in get_args(Hold):
        raise OptionError(f"hold is zoh or foh, not {hold!r}")
    if method not in get_args(Method):
        raise OptionError(f"method is one of {', '.join(get_args(Method))}, not {method!r}")
    if motion not in get_args(Motion):
        raise OptionError(f"motion is small or large, not {motion!r}")


def _of_state_space(model: StateSpace, excitation: Excitation) -> TimeResponse:
    """The response of a state space, exact for signals held or linear between samples."""
    u, dt, impulses, _, hold = excitation
    stepped = model.discretised(dt, hold)
    x = model.B @ impulses
    if hold == "foh":
        x = x - held_exponentials(model.A, model.B, dt)[2] @ u[:, 0]
    driven, states = stepped.B @ u, np.empty((model.order, u.shape[1]))
    for k in range(u.shape[1]):
        states[:, k] = x
        x = stepped.A @ x + driven[:, k]
    y = stepped.C @ states + stepped.D @ u
    return TimeResponse(
        model.name, excitation.time, y, u, model.inputs, model.outputs, model.notes, known=model.warnings
    )


def moving_system(model: Any, parameters: Mapping[str, ArrayLike] | None, **channels: Any) -> System:
    """The system of full order with inputs and outputs. Raises OptionError for what cannot move far."""
    if not isinstance(model, Plan | FullOrderModel) or (model if isinstance(model, Plan) else model.plan).is_posed:
        raise OptionError("large motion is that of an undeformed mechanism, not of a reduced model, a system or a pose")
    return system(model, parameters, order="full", **channels)


def _small_motion_system(
    model: Any,
    parameters: Mapping[str, ArrayLike] | None,
    *,
    dt: float,
    order: Order,
    reducing: Mapping[str, Any],
    **channels: Any,
) -> System | ModalSystem:
    """The system with inputs, outputs and damping, of a mechanism reduced to what the step resolves unless something is
    said of its reduction."""
    if isinstance(model, System | ModalSystem):
        if channels["damping"] is not None or parameters or reducing or order != "low":
            raise OptionError(
                "order, damping, parameters and methods of reduction belong to a mechanism, not to a finished system"
            )
        return model.selected(channels["inputs"], channels["outputs"])
    if isinstance(model, Plan) and order == "low" and not reducing:
        model, parameters = proven(model, parameters, 1 / (PER_PERIOD * dt)), None
    return system(model, parameters, order=order, **channels, **reducing)


def _result(
    built: System | ModalSystem, excitation: Excitation, response: Array, notes: tuple[str, ...], **more: Any
) -> TimeResponse:
    name = (built.system if isinstance(built, ModalSystem) else built).name
    return TimeResponse(name, excitation.time, response, excitation.u, built.inputs, built.outputs, notes, **more)


def _known_inputs(model: Any) -> list[str]:
    """Names that wildcards may stand for."""
    if isinstance(model, System | ModalSystem):
        return [c.name for c in model.inputs]
    return actuator_names(model.plan if isinstance(model, FullOrderModel | LowOrderModel) else plan_of(model))


def _spread(given: Mapping[str, Any], known: list[str]) -> dict[str, Any]:
    """Values by name with wildcards written out."""
    names = matched(given, known)
    return {name: value for pattern, value in given.items() for name in names[pattern]}


def _exact(modes: ModalSystem, excitation: Excitation, keep: bool) -> TimeResponse:
    whole = with_residual_modes(modes) if modes.order else modes
    notes = _notes(modes, whole, excitation)
    plain, modes = modes.viscous(), whole.viscous()
    driven = _driven(modes, excitation)
    run = Run(modes, driven, plain, excitation)
    if not keep:
        return _result(modes, excitation, _outputs(modes, driven), notes, run=run)
    if modes.order * excitation.u.shape[1] > STATES:
        raise OptionError(f"keep_modes keeps at most {STATES} values: ask for fewer modes or samples")
    orders = sorted({0, *np.minimum(modes.derivative, 1).tolist()})
    moved = dict(zip(orders, modal_motion(modes, driven, orders), strict=True))
    return _result(modes, excitation, _read(modes, moved, driven.u), notes, modes=modes, modal=moved[0], run=run)


def _driven(modes: ModalSystem, excitation: Excitation) -> Driven:
    """What drives modes, from the static state that they start from. Raises OptionError where there is none."""
    u, dt, impulses, start, hold = excitation
    if start.any() and (modes.omega == 0).any():
        raise OptionError("there is no static state to start from: something can move freely")
    eta = modes.B @ start / modes.omega**2 if start.any() else np.zeros(modes.order)
    return Driven(u, dt, hold, eta, modes.B @ impulses)


def _outputs(modes: ModalSystem, driven: Driven) -> Array:
    """Outputs (p, N), by whichever recursion is the shorter way."""
    u = driven.u
    if suits_blocks(modes, len(u)):
        y = modes.D @ u + block_response(modes, driven)
        return y + np.where(modes.derivative[:, None] == 0, modes.residual, 0.0) @ u
    derivatives = set(modes.derivative.tolist())
    orders = sorted({min(k, 1) for k in derivatives} | ({0} if 2 in derivatives else set()))
    return _read(modes, dict(zip(orders, modal_motion(modes, driven, orders), strict=True)), u)


def _read(modes: ModalSystem, moved: Mapping[int, Array], u: Array) -> Array:
    """Outputs (p, N) from modal coordinates and their rates, second derivatives from the equation of motion."""
    y = modes.D @ u
    for order in set(modes.derivative.tolist()):
        at = np.flatnonzero(modes.derivative == order)
        C = modes.C[at]
        if order < 2:
            y[at] += C @ moved[order]
        else:
            y[at] += (C @ modes.B) @ u - (C @ modes.damping) @ moved[1] - (C * modes.omega**2) @ moved[0]
        if order == 0:
            y[at] += modes.residual[at] @ u
    return y


def _notes(modes: ModalSystem, whole: ModalSystem, excitation: Excitation) -> tuple[str, ...]:
    shape = "straight lines between samples" if excitation.hold == "foh" else "samples held"
    more = whole.order - modes.order
    residual = f" and {more} residual mode{'s' if more > 1 else ''}" if more else ""
    notes = [f"{modes.order} modes{residual}, exact for {shape}", *state_of(modes.system.model.design)]
    if modes.loss is not None:
        notes.append("structural damping taken as viscous damping that dissipates the same at each resonance")
    highest = float(modes.frequency_hz[-1]) if modes.order else 0.0
    if excitation.dt * highest * PER_PERIOD > 1 + 1e-9:
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


def _integrated(built: System, excitation: Excitation, rho_infinity: float) -> TimeResponse:
    if built.H is not None:
        raise OptionError("structural damping has no causal time response: use method exact, or viscous damping")
    (M, C, K, _), u = built.matrices(), excitation.u
    motion = generalised_alpha(
        *(M, C, K, built.B, u),
        dt=excitation.dt,
        rho_infinity=rho_infinity,
        start=excitation.start,
        impulses=excitation.impulses,
    )
    y = built.D @ u
    for order, moved in enumerate(motion):
        at = built.derivative == order
        y[at] += built.rows[at] @ moved
    y[built.derivative == 0] += built.residual[built.derivative == 0] @ u
    notes = (
        f"generalised-alpha, rho_infinity {rho_infinity:g}, {built.order} coordinates: error of order dt^2",
        *state_of(built.model.design),
    )
    return _result(built, excitation, y, notes, known=integrated_warnings(built, motion[0], excitation))
