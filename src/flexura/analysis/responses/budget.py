"""Dynamic error budget: what disturbances make of outputs, by source, by mode and over frequency, exactly."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis.responses.closed_loop import OF_CONTROLLERS, LoopState, closed_loop, is_closed
from flexura.analysis.responses.frequency_response import (
    BEYOND,
    RequestedBand,
    known_limits,
    resonances_of,
    system_up_to,
)
from flexura.analysis.responses.settling import Moves, Settling, settled
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import plan_of
from flexura.linalg import count_below
from flexura.mechanism import Damping, Disturbance, Mechanism, evaluated
from flexura.reduction import LowOrderModel, Reduction, state_of
from flexura.results import Tabular
from flexura.structure import Channel, FullOrderModel, Plan, actuator_names, channel_positions, matched, sensor_names
from flexura.systems import (
    MeanSquares,
    ModalSystem,
    Order,
    PoleForm,
    SecondOrder,
    Spectrum,
    System,
    mean_squares,
    pole_form,
    proof_limits,
    spectrum_of,
    with_residual_modes,
)
from flexura.tables import Item, Line, Table, counted, in_hz, percent, quantity

SMALL = 0.01
"""Share of a mean square below which a part is not listed by itself."""

UNSEEN = 1e-6
"""Share of a root mean square that is shown as zero."""

LOST = 1e-6
"""Round-off of a mean square, relative, from which it is said."""

LEAST_MODES = 12
"""Modes of a full-order model that are kept at least."""


@dataclass(frozen=True, repr=False)
class Budget(Tabular):
    """Root mean squares of `outputs` (p,) under `sources` (s,), which are independent of each other.

    `mean_square` (s, p) is that of every source, `by_part` (s, g, p) its shares by the `parts` (g,) of the response:
    modes, those left out and what goes directly; they add up to the whole, and may be negative where modes oppose each
    other. `density` (s, f, p) is one-sided, squared units per Hz, at `frequency_hz` (f,), and `up_to` (s, f, p) the
    mean square of frequencies up to there. `settling` is that after moves; `notes` say what it was worked out from.
    """

    _shown = ("name", "outputs", "sources")

    name: str
    outputs: tuple[Channel, ...]
    sources: tuple[str, ...]
    parts: tuple[str, ...]
    mean_square: Array
    by_part: Array
    frequency_hz: Array
    density: Array
    up_to: Array
    loop: LoopState = "open"
    notes: tuple[str, ...] = ()
    known: tuple[Diagnostic, ...] = ()
    unproven: SecondOrder | None = None
    settling: tuple[Settling, ...] = ()

    @property
    def rms(self) -> Array:
        """Root mean squares (p,) under all sources."""
        return np.sqrt(self.mean_square.sum(axis=0))

    @property
    def three_sigma(self) -> Array:
        """Three times these (p,): of Gaussian motion all but 0.27 % is within."""
        return 3 * self.rms

    @property
    def rms_by_source(self) -> Array:
        """Root mean squares (s, p) of every source by itself; they add up in squares."""
        return np.sqrt(self.mean_square)

    @property
    def shares(self) -> Array:
        """Shares (s, p) of sources in the mean squares, which add up to one."""
        return _over(self.mean_square, self.mean_square.sum(axis=0))

    @property
    def part_shares(self) -> Array:
        """Shares (g, p) of parts in the mean squares, which add up to one."""
        return _over(self.by_part.sum(axis=0), self.mean_square.sum(axis=0))

    @property
    def amplitude_density(self) -> Array:
        """One-sided amplitude density (f, p) under all sources, units per root of Hz."""
        return np.sqrt(self.density.sum(axis=0))

    @property
    def cumulative(self) -> Array:
        """Cumulative amplitude (f, p): the root mean square of frequencies up to each."""
        return np.sqrt(self.up_to.sum(axis=0))

    @cached_property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Where the budget stops holding: no finite mean square, coarse meshes, frequencies beyond what is proven."""
        if self.unproven is None:
            return self.known
        return (*self.known, *proof_limits(self.unproven, float(self.frequency_hz.max())))

    def of(self, output: str) -> float:
        """The root mean square of one output, by name. Raises OptionError for others."""
        return float(self.rms[self._number(output)])

    def _number(self, output: str) -> int:
        names = [c.name for c in self.outputs]
        if output not in names:
            raise OptionError(f"there is no output {output!r}; known: {', '.join(names)}")
        return names.index(output)

    def _title(self) -> str:
        low, high = self.frequency_hz[[0, -1]]
        ends = f"{in_hz(low)} to {in_hz(high)}, {self.loop} loop"
        return f"{counted(len(self.sources), 'source')} at {counted(len(self.outputs), 'point')}, {ends}"

    def presentation(self) -> Iterator[Item]:
        """The table of a design review: points, what each source does there, the whole, 3 sigma; then parts."""

        def texts(values: Array) -> list[str]:
            seen = np.where(values > UNSEEN * self.rms, values, 0.0)
            return [quantity(float(v), c.unit, 4) for v, c in zip(seen, self.outputs, strict=True)]

        columns: dict[str, Any] = {"point": [c.name for c in self.outputs], "rms": texts(self.rms)}
        columns |= {"3 sigma": texts(self.three_sigma)}
        columns |= {name: texts(rms) for name, rms in zip(self.sources, self.rms_by_source, strict=True)}
        yield Table(columns, "points", title="root mean squares")
        listed = np.flatnonzero((np.abs(self.part_shares) >= SMALL).any(axis=1))
        rows: dict[str, Any] = {"part": [self.parts[k] for k in listed]}
        for number, channel in enumerate(self.outputs):
            rows[channel.name] = [
                percent(x if abs(x) > UNSEEN else 0.0) for x in self.part_shares[listed, number].tolist()
            ]
        yield Table(rows, "parts", title="shares of mean squares by mode")
        if len(listed) < len(self.parts):
            yield Line(f"{len(self.parts) - len(listed)} parts below {100 * SMALL:g} % everywhere are not listed")
        if own := self.settling:
            units = {c.name: c.unit for c in self.outputs}
            yield Table(
                {
                    "after a move": [s.words for s in own],
                    "point": [s.point for s in own],
                    "ends at": [quantity(s.final, units[s.point], 4) for s in own],
                    "within": [quantity(s.within, units[s.point], 3) for s in own],
                    "after": ["never" if np.isposinf(s.time_s) else quantity(s.time_s, "s", 3) for s in own],
                },
                "moves",
                title="settling",
            )

    def _data(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "loop": self.loop,
            "points": [self._point(k, channel) for k, channel in enumerate(self.outputs)],
            "frequency_hz": self.frequency_hz,
        }

    def _point(self, k: int, channel: Channel) -> dict[str, Any]:
        shares, rms = self.part_shares[:, k], self.rms_by_source[:, k]
        return {
            "name": channel.name,
            "unit": channel.unit,
            "rms": float(self.rms[k]),
            "three_sigma": float(self.three_sigma[k]),
            "sources": [
                {"name": name, "rms": float(own), "share": float(share)}
                for name, own, share in zip(self.sources, rms, self.shares[:, k], strict=True)
            ],
            "modes": [{"name": name, "share": float(own)} for name, own in zip(self.parts, shares, strict=True)],
            "amplitude_density": self.amplitude_density[:, k],
            "cumulative": self.cumulative[:, k],
            "settling": [own for own in self.settling if own.point == channel.name],
        }

    def _columns(self) -> dict[str, Any]:
        """Frequency, then amplitude density and cumulative amplitude of every output."""
        columns: dict[str, Any] = {"frequency [Hz]": self.frequency_hz}
        for k, channel in enumerate(self.outputs):
            columns[f"density of {channel.name} [{channel.unit}/sqrt(Hz)]"] = self.amplitude_density[:, k]
            columns[f"cumulative {channel}"] = self.cumulative[:, k]
        return columns


def _over(shares: Array, total: Array) -> Array:
    """Shares of a total; none where that is zero or without end."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.isfinite(total) & (total > 0), shares / total, np.nan)


class Source(NamedTuple):
    """A disturbance: its density, the inputs that it acts by, each with the columns of noise (s,) that it gets, and the
    sensors whose readings have noise."""

    name: str
    spectrum: Spectrum
    inputs: dict[str, Array]
    sensors: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Noises that are independent of each other."""
        return next((len(row) for row in self.inputs.values()), len(self.sensors))

    def weights(self, inputs: Sequence[Channel]) -> Array:
        """What each noise is of each input (m, s)."""
        return np.array([self.inputs.get(c.name, np.zeros(self.count)) for c in inputs]).reshape(-1, self.count)

    def read(self, outputs: Sequence[Channel]) -> Array:
        """Which noise each output has (p, s)."""
        names = [c.name for c in outputs]
        own = np.zeros((len(names), self.count))
        for k, name in enumerate(self.sensors):
            if name in names:
                own[names.index(name), k] = 1.0
        return own


def sources_of(
    described: Mapping[str, Disturbance], values: Mapping[str, Any], actuators: Sequence[str], sensors: Sequence[str]
) -> list[Source]:
    """Disturbances at parameter values. Raises OptionError for patterns that match nothing."""
    found = []
    for name, disturbance in described.items():
        of = evaluated(disturbance, dict(values))
        spectrum = spectrum_of(of)
        if of.base is not None:
            along = np.array(of.base, dtype=float)
            along /= np.linalg.norm(along)
            rows = {f"ground.t{axis}": np.array([x]) for axis, x in zip("xyz", along, strict=True) if x}
            found.append(Source(name, spectrum, rows))
        elif of.input is not None:
            names = matched([of.input], actuators)[of.input]
            found.append(Source(name, spectrum, dict(zip(names, np.eye(len(names)), strict=True))))
        else:
            assert of.sensor is not None
            found.append(Source(name, spectrum, {}, tuple(matched([of.sensor], sensors)[of.sensor])))
    return found


class RequestedCurves(NamedTuple):
    """Frequencies at which curves are read, or a band of at least so many points."""

    frequency_hz: ArrayLike | None
    band: tuple[float, float] | None
    points: int


def chosen_disturbances(
    mechanism: Mechanism, given: Mapping[str, Disturbance] | None, names: Sequence[str] | None
) -> dict[str, Disturbance]:
    """Disturbances that are described, or given in their place, or some of them. Raises OptionError without any."""
    known = dict(mechanism.disturbances if given is None else given)
    if not known:
        raise OptionError("nothing disturbs it: describe `disturbances`, e.g. floor: {base: z, spectrum: VC-C}")
    if names is None:
        return known
    wanted = [n for own in matched([names] if isinstance(names, str) else names, list(known)).values() for n in own]
    unknown = next((name for name in wanted if name not in known), None)
    if unknown is not None:
        raise OptionError(f"there is no disturbance {unknown!r}; known: {', '.join(known)}")
    return {name: known[name] for name in wanted}


@verb
def budget(
    model: Mechanism | Plan | FullOrderModel | LowOrderModel | System | ModalSystem,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    outputs: Sequence[str] | None = None,
    disturbances: Mapping[str, Disturbance] | None = None,
    sources: Sequence[str] | None = None,
    moves: Mapping[str, float] | None = None,
    over: float = 0.0,
    within: Mapping[str, float] | None = None,
    loop: LoopState | None = None,
    frequency_hz: ArrayLike | None = None,
    band: tuple[float, float] | None = None,
    points: int = 400,
    order: Order = "low",
    damping: Damping | float | Mapping[str, Any] | None = None,
    keep: int | Mapping[str, int] | None = None,
    keep_below: float | None = None,
    reduction: Reduction | None = None,
    tolerance: float | None = None,
    up_to: float | None = None,
) -> Budget:
    """Root mean squares of outputs under `disturbances`, by source, by mode and over frequency (theory eqs. T31-T35).

    Of the disturbances that are described, or those given in their place by name, all or the `sources` that are named;
    `outputs` and `damping` as in `system`. Mean squares are integrals over all frequencies of each density, in closed
    form, whatever the frequencies at which curves are read: `frequency_hz` (f,), or a `band` (from, to), Hz, as in
    `frequency_response`. Sources are independent, so that they add up in squares.

    The `loop` is closed where `controllers` are described, around modes of the full-order model as in `closed_loop`,
    unless it is to be `open`; only then noise of a sensor in a loop shakes anything, and outputs are what moves. Noise
    of sensors in no loop is in what they read. Outputs may be commands, `NAME.command`.

    `moves` are inputs, references of controllers `NAME.reference` among them, and by how much each is moved, SI, at
    constant speed `over` so many s, at once by default: then the time is told that every output takes from the end of
    the move until it stays within a band about where it ends, exactly (eq. T40), three sigma or that of `within`, by
    output, SI.

    `order`: low (reduced until frequencies up to twice the highest one of the densities are proven, or by `keep`,
    `keep_below`, `reduction`, `tolerance`, `up_to` as in `reduce`), or full. Structural damping becomes viscous as in
    time response, and modes left out act by residual modes and their static gain.

    Raises ModelError, and OptionError for names that are not there; SolverError where nothing damps what moves.
    """
    given = {"keep": keep, "keep_below": keep_below, "reduction": reduction, "tolerance": tolerance, "up_to": up_to}
    reducing = {name: value for name, value in given.items() if value is not None}
    if order not in ("low", "full"):
        raise OptionError(f"order is low or full, not {order!r}")
    if isinstance(model, Mechanism):
        model = plan_of(model, parameters)
    if isinstance(model, ModalSystem) and (order != "low" or damping is not None or parameters or reducing):
        raise OptionError("order, damping, parameters and methods of reduction belong to a mechanism")
    is_whole = isinstance(model, Plan | FullOrderModel)
    closes = bool(is_whole and _plan(model).mechanism.controllers) if loop is None else is_closed(loop)
    if closes and (reducing or not is_whole):
        raise OptionError("loops are closed around the full-order model of a mechanism: it is not reduced")
    found = sources_in(model, parameters, chosen_disturbances(_plan(model).mechanism, disturbances, sources))
    moving, read = Moves.of(moves, over, within), RequestedCurves(frequency_hz, band, points)
    inputs = list(dict.fromkeys([*(name for source in found for name in source.inputs), *moving.by]))
    if closes:
        return _closed_budget(model, parameters, outputs, found, inputs, damping, read, moving)
    ends = [float(s.spectrum.stop[-1]) for s in found]
    top = max((end for end in ends if np.isfinite(end)), default=0.0)
    if isinstance(model, ModalSystem):
        modes = model.selected(inputs, outputs)
        unproven: SecondOrder | None = modes.system
    else:
        channels = {"inputs": inputs, "outputs": outputs, "damping": damping}
        built = system_up_to(model, parameters, top=top, order=order, reducing=reducing, **channels)
        unproven = None if isinstance(model, Plan) and not reducing else built
        modes = disturbed_modes(built, found)
    return _budget(modes, found, _band(modes, found, read), moving, unproven)


def _plan(model: Any) -> Plan:
    if isinstance(model, Plan):
        return model
    of: Any = model.system if isinstance(model, ModalSystem) else model
    return (of.model if isinstance(of, System) else of).plan


def sources_in(
    model: Any, parameters: Mapping[str, ArrayLike] | None, described: Mapping[str, Disturbance]
) -> list[Source]:
    """The disturbances at the parameter values of a model."""
    plan = _plan(model)
    if isinstance(model, System | ModalSystem):
        of = (model.system if isinstance(model, ModalSystem) else model).model
        own = of.parameters
    else:
        own = model.parameters if isinstance(model, FullOrderModel | LowOrderModel) else parameters
    return sources_of(described, plan.parameter_values(own), actuator_names(plan), sensor_names(plan))


def disturbed_modes(built: System, found: Sequence[Source]) -> ModalSystem:
    """The modes that matter: all of a low-order system, and of a full-order one at least so many, and all of some
    times the highest frequency where densities end."""
    if not isinstance(built.model, FullOrderModel):
        return built.modal()
    count = min(LEAST_MODES, built.order)
    if all(source.spectrum.is_bounded for source in found):
        top = 2 * np.pi * BEYOND * max(float(source.spectrum.stop[-1]) for source in found)
        count = max(count, count_below(built.K, built.M, top**2))
    return built.modal(n=count)


def disturbed(modes: ModalSystem, found: Sequence[Source]) -> list[PoleForm]:
    """The response of the outputs to the noises of each source, modes left out by residual ones, damping viscous."""
    return _disturbed(_form(modes), modes, found)


def _form(modes: ModalSystem) -> PoleForm:
    return pole_form((with_residual_modes(modes) if modes.order else modes).viscous(), modes.order)


def _disturbed(form: PoleForm, modes: ModalSystem, found: Sequence[Source]) -> list[PoleForm]:
    return [form.driven_by(s.weights(modes.inputs), s.read(modes.outputs), s.spectrum.is_bounded) for s in found]


def _band(modes: ModalSystem, found: list[Source], curves: RequestedCurves) -> Array:
    """Frequencies at which curves are read: all of the densities by default, and of those that do not end up to where
    the modes end."""
    frequency_hz, band, points = curves
    if frequency_hz is None and band is None:
        starts = [float(s.spectrum.start[0]) for s in found]
        stops = [float(s.spectrum.stop[-1]) for s in found]
        hz = modes.frequency_hz[modes.frequency_hz > 0]
        high = max((end for end in stops if np.isfinite(end)), default=0.0)
        if not all(map(np.isfinite, stops)):
            high = max(high, 2 * float(hz.max(initial=1.0)))
        low = min((start for start in starts if start > 0), default=high)
        band = (min(low, 0.1 * float(hz.min(initial=high)), 0.1 * high) if 0 in starts else low, high)
    requested = RequestedBand.of(frequency_hz, band, points)
    return requested.grid(resonances_of(modes, requested.hz))


def _budget(modes: ModalSystem, found: list[Source], hz: Array, moves: Moves, unproven: SecondOrder | None) -> Budget:
    """With loops open."""
    model = modes.system.model
    kind = "full-order" if isinstance(model, FullOrderModel) else "low-order"
    notes = [f"{kind} model, order {model.order}, {modes.order} modes; closed-form integrals over all frequencies"]
    notes += model.steps if isinstance(model, LowOrderModel) else state_of(model.design)
    if modes.loss is not None:
        notes.append("structural damping taken as viscous damping that dissipates the same at each resonance")
    if not all(s.spectrum.is_bounded for s in found) and modes.system.residual.any():
        notes.append("static gain that the modes lack is left out of densities without an end")
    known = known_limits(modes, hz[[0, -1]])
    form = _form(modes)
    told = _told(
        modes, _disturbed(form, modes, found), found, modes.outputs, hz, tuple(notes), known=known, unproven=unproven
    )
    return _with_settling(told, form, modes.inputs, moves)


def _closed_budget(
    model: Any,
    parameters: Mapping[str, ArrayLike] | None,
    outputs: Sequence[str] | None,
    found: list[Source],
    inputs: list[str],
    damping: Any,
    curves: RequestedCurves,
    moves: Moves,
) -> Budget:
    """With loops closed: noises of their sensors are inputs, and outputs are what moves."""
    outputs = [outputs] if isinstance(outputs, str) else outputs
    inputs = [name for name in inputs if not name.endswith(OF_CONTROLLERS)]
    outside = None if outputs is None else [name for name in outputs if not name.endswith(OF_CONTROLLERS)]
    closed = closed_loop(model, parameters, inputs=inputs, outputs=outside, damping=damping)
    whole, own = closed.model, closed.sensors
    read = [c.name for c in whole.outputs if not c.name.endswith(OF_CONTROLLERS)] if outputs is None else list(outputs)
    form = closed.closing.pole_form(closed.modes, closed.modes.order)
    at = channel_positions(whole.outputs, read)
    form = replace(form, parts=form.parts[:, at], direct=form.direct[:, at], static=form.static[at])
    chosen = tuple(whole.outputs[k] for k in at)
    forms = []
    for source in found:
        weights = source.weights(whole.inputs)
        for k, sensor in enumerate(source.sensors):
            for name in (name for name, its in own.items() if its == sensor):
                weights[[c.name for c in whole.inputs].index(f"{name}.noise"), k] = 1.0
        apart = source.read(chosen) * [sensor not in own.values() for sensor in source.sensors or [""] * source.count]
        forms.append(form.driven_by(weights, apart))
    known = (*closed.warnings, *known_limits(closed.modes, np.array([0.0, closed.modes.frequency_hz[-1]])))
    hz = _band(closed.modes, found, curves)
    told = _told(closed.modes, forms, found, chosen, hz, closed.notes, loop="closed", known=known)
    return _with_settling(told, form, whole.inputs, moves)


def _with_settling(told: Budget, form: PoleForm, inputs: Sequence[Channel], moves: Moves) -> Budget:
    return replace(told, settling=settled(form, inputs, told.outputs, moves, told.three_sigma))


def _told(
    modes: ModalSystem,
    forms: Sequence[PoleForm],
    found: Sequence[Source],
    outputs: tuple[Channel, ...],
    hz: Array,
    notes: tuple[str, ...],
    known: Sequence[Diagnostic] = (),
    **more: Any,
) -> Budget:
    squares = mean_squares(forms, [s.spectrum for s in found], hz)
    return Budget(
        modes.name,
        outputs,
        tuple(s.name for s in found),
        forms[0].names,
        np.stack([own.total for own in squares]),
        np.stack([own.parts for own in squares]),
        hz,
        np.stack([own.density for own in squares]),
        np.stack([own.up_to for own in squares]),
        notes=notes,
        known=(*_endless(squares, found, outputs), *known),
        **more,
    )


def _endless(squares: Sequence[MeanSquares], found: Sequence[Source], outputs: Sequence[Channel]) -> list[Diagnostic]:
    """Mean squares that have no bound, and those whose digits are lost."""
    said = []
    for own, source in zip(squares, found, strict=True):
        for k in np.flatnonzero(~np.isfinite(own.total)).tolist():
            text = f"{outputs[k].name}: the density of {source.name} does not end, and reaches it directly: give a band"
            said.append(Diagnostic("convergence", outputs[k].name, np.inf, np.inf, outputs[k].unit, text))
        for k in np.flatnonzero(own.lost > LOST).tolist():
            text = f"{outputs[k].name} under {source.name}: round-off may change the mean square by {own.lost[k]:.1g}"
            said.append(Diagnostic("proof", outputs[k].name, float(own.lost[k]), LOST, "1", text))
    return said
