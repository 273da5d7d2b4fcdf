"""Frequency response between named inputs and outputs, of the low-order, full-order and exact models."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
import scipy.sparse.linalg as spla
from numpy.typing import ArrayLike

from flexura.analysis.limits import pose_limits
from flexura.analysis.model_error import Interval, interval_text, model_errors_near
from flexura.analysis.responses.closed_loop import LoopState, closed_model, is_closed
from flexura.analysis.strain import frequency_errors, mesh_warning, motion_meshes, motions, part_meshes, plate_warnings
from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.full_order import assemble, plan_of
from flexura.linalg import count_below, inverse_roots, scaled
from flexura.mechanism import Damping, Mechanism
from flexura.methods import ExactResponse
from flexura.motion import at_pose
from flexura.reduction import LowOrderModel, Reduction, lost_work, reduce, state_of
from flexura.results import Tabular
from flexura.structure import (
    Channel,
    Design,
    FullOrderModel,
    Plan,
    one_design,
    response_columns,
    stiffness_and_mass,
    unit_of_response,
)
from flexura.systems import (
    NEAR,
    ModalSystem,
    Order,
    SecondOrder,
    StateSpace,
    System,
    as_quantity,
    band_limits,
    input_loads,
    proof_limits,
    reduced,
    remainder_of_response,
    resonance_limits,
    stiffening,
    system,
    truncation_limits,
)
from flexura.tables import Item, Table, counted, ends, in_hz, percent, quantity

ResponseOrder = Literal["low", "full", "exact"]
Method = Literal["modal", "direct"]
Quantity = Literal["receptance", "mobility", "accelerance", "transmissibility"]

MOST_PAIRS = 12
"""Pairs of channels that are listed."""

BEYOND = 4.0
"""Modes up to so many times the highest frequency asked for are in the modal sum of a full-order model."""

MARGIN = 2.0
"""Frequencies of the low-order model are proven up to so many times the highest one asked for."""

TOLERANCE = 1e-4
"""Relative error to which frequencies of the low-order model are proven when nothing else is said."""

PEAK_POINTS = 32
"""Points beside every resonance on each of its sides, equally far from each other on its circle of Nyquist."""

SEEN = 1e-4
"""Part of a response from which its round-off is said."""

SILENT = 1e-9
"""Responses that stay below so much of the largest of their input and output are nothing: symmetry, and round-off."""

SHARPEST = 1e-5
"""Damping ratio with which the grid is refined around undamped resonances."""


@dataclass(frozen=True, repr=False)
class FrequencyResponse(Tabular):
    """H (f, p, m) at `frequency_hz` (f,): complex amplitude of each output per unit of each input, e^(+i omega t).

    `resonances_hz` (k,) are the natural frequencies in the range and `ratios` (k,) their damping ratios; `notes` say
    which model was used. `warnings` are what is `known`, and what the model of the system `unproven` is not proven to
    contain up to the highest frequency, which is worked out when they are first asked for. `modes` are those of the
    resonances, None where there are only poles.
    """

    _shown = ("name", "frequency_hz", "inputs", "outputs", "order")

    name: str
    frequency_hz: Array
    response: Complex
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    resonances_hz: Array
    ratios: Array
    order: int
    notes: tuple[str, ...] = ()
    known: tuple[Diagnostic, ...] = ()
    unproven: SecondOrder | None = None
    modes: ModalSystem | None = field(default=None, repr=False)

    @cached_property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Where this response stops holding: undamped resonances, coarse meshes, frequencies beyond what is proven."""
        if self.unproven is None:
            return self.known
        return (*self.known, *proof_limits(self.unproven, float(self.frequency_hz.max())))

    def of(self, output: str, input: str) -> Complex:
        """The response (f,) of one output to one input, by name. Raises OptionError for others."""
        at = []
        for channels, name, what in ((self.outputs, output, "output"), (self.inputs, input, "input")):
            names = [c.name for c in channels]
            if name not in names:
                raise OptionError(f"there is no {what} {name!r}; known: {', '.join(names)}")
            at.append(names.index(name))
        return self.response[:, at[0], at[1]]

    def unit(self, output: str, input: str) -> str:
        """Unit of a response, e.g. `m/N`."""
        out, into = {c.name: c for c in self.outputs}[output], {c.name: c for c in self.inputs}[input]
        return unit_of_response(out, into)

    @cached_property
    def resonance_motions(self) -> tuple[str, ...]:
        """What moves at each of the resonances (k,), in words; none where only poles are known of the model. Worked out
        when first asked for."""
        if self.modes is None:
            return ()
        nearest = [int(np.abs(self.modes.frequency_hz - hz).argmin()) for hz in self.resonances_hz]
        q, model = self.modes.shapes[:, nearest], self.modes.system.model
        u = q if isinstance(model, FullOrderModel) else model.recover(q)
        full = self.modes.system.full_order
        return tuple(motion.summary for motion in motions(full, full.node_displacements(u)))

    @cached_property
    def _model_errors(self) -> list[tuple[Interval | None, str]]:
        if self.modes is None:
            return [(None, "poles alone are known")] * len(self.resonances_hz)
        return model_errors_near(self.modes.system.full_order, self.resonances_hz)

    @property
    def model_error(self) -> tuple[Interval | None, ...]:
        """Of the resonances (k,), where those of the part lie: between 1 + low and 1 + high times their frequencies;
        None where there is no evidence. Worked out when first asked for."""
        return tuple(interval for interval, _ in self._model_errors)

    def _title(self) -> str:
        p, m, hz = len(self.outputs), len(self.inputs), self.frequency_hz
        return (
            f"{p} x {m} responses at {counted(len(hz), 'frequency')}, {ends((hz[0], hz[-1]), 'Hz')}, order {self.order}"
        )

    def presentation(self) -> Iterator[Item]:
        """The resonances, and the gains and peaks of the pairs."""
        columns: dict[str, Any] = {
            "resonance": range(1, len(self.resonances_hz) + 1),
            "frequency [Hz]": self.resonances_hz,
            "model error": [interval_text(error) for error in self.model_error],
            "damping ratio": [percent(float(zeta), 4) for zeta in self.ratios],
        }
        moving = {"what moves": self.resonance_motions} if self.resonance_motions else {}
        yield Table({**columns, **moving}, "resonances")
        yield Table(self.gain_columns(), "pairs", most=MOST_PAIRS)

    def gain_columns(self) -> dict[str, Any]:
        """A row for each pair of an output and an input that is no round-off: its gain at the first frequency, and its
        peak."""
        H, hz = np.abs(self.response), self.frequency_hz
        pairs = [(i, j) for i in range(len(self.outputs)) for j in range(len(self.inputs))]
        scale = np.sqrt(H.max(axis=(0, 2), initial=0.0)[:, None] * H.max(axis=(0, 1), initial=0.0))
        shown = [(i, j) for i, j in pairs if H[:, i, j].max() > SILENT * scale[i, j]]
        units = [unit_of_response(self.outputs[i], self.inputs[j]) for i, j in shown]
        gains = [H[:, i, j] for i, j in shown]
        first = f"at {in_hz(float(hz[0]))}"
        return {
            "output": [self.outputs[i].name for i, _ in shown],
            "input": [self.inputs[j].name for _, j in shown],
            first: [quantity(float(h[0]), unit) for h, unit in zip(gains, units, strict=True)],
            "peak": [quantity(float(h.max()), unit) for h, unit in zip(gains, units, strict=True)],
            "peak at [Hz]": [float(hz[h.argmax()]) for h in gains],
        }

    def _data(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "frequency_hz": self.frequency_hz,
            "real": self.response.real,
            "imaginary": self.response.imag,
            "inputs": self.inputs,
            "outputs": self.outputs,
            "resonances_hz": self.resonances_hz,
            "damping_ratios": self.ratios,
            "model_error": self.model_error,
            "model_error_reason": [reason for _, reason in self._model_errors],
            "order": self.order,
        }

    def _columns(self) -> dict[str, Any]:
        """Frequency, then magnitude and phase of every pair."""
        return response_columns(self.frequency_hz, self.response, self.inputs, self.outputs)


@verb
def frequency_response(
    model: Mechanism | Plan | FullOrderModel | LowOrderModel | System | ModalSystem | StateSpace,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    frequency_hz: ArrayLike | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    band: tuple[float, float] | None = None,
    points: int = 400,
    quantity: Quantity | None = None,
    order: ResponseOrder = "low",
    method: Method = "modal",
    damping: Damping | float | Mapping[str, Any] | None = None,
    loop: LoopState = "open",
    keep: int | Mapping[str, int] | None = None,
    keep_below: float | None = None,
    reduction: Reduction | None = None,
    tolerance: float | None = None,
    up_to: float | None = None,
) -> FrequencyResponse:
    """Frequency response between named inputs and outputs (theory eqs. T10-T14).

    At `frequency_hz` (f,), or over a `band` (from, to) Hz, with at least `points` of them, to which points around every
    resonance are added. `inputs`, `outputs` and `damping` as in `system`. `quantity` reads all motions as receptance,
    mobility, accelerance, or, with inputs such as `ground.tx`, as transmissibility: absolute motion over that of the
    base.

    `order`: low (a mechanism is reduced until its frequencies up to twice the highest one asked for are proven to
    0.01 %, or by `keep`, `keep_below`, `reduction`, `tolerance`, `up_to` as in `reduce`), full, or exact (dynamic
    stiffness, no mesh). `method`: modal sum with static correction, or direct solution at every frequency, which takes
    any damping, modal ratios by their matrix (`System.damping_matrix`).

    With the `loop` closed, that of the `controllers` described, around modes of the full-order model as in
    `closed_loop`; inputs and outputs are then references, noises and commands of controllers as well.

    Raises ModelError, and OptionError for frequencies that are not positive and finite, unknown channels and
    combinations that make no sense; SolverError at an undamped resonance.
    """
    requested = RequestedBand.of(frequency_hz, band, points)
    if order not in get_args(ResponseOrder):
        raise OptionError(f"order is low, full or exact, not {order!r}")
    if method not in get_args(Method):
        raise OptionError(f"method is modal or direct, not {method!r}")
    given = {"keep": keep, "keep_below": keep_below, "reduction": reduction, "tolerance": tolerance, "up_to": up_to}
    reducing = {name: value for name, value in given.items() if value is not None}
    if isinstance(model, Mechanism):
        model = plan_of(model, parameters)
    if is_closed(loop):
        if order == "exact" or method != "modal" or quantity or reducing:
            raise OptionError("order, method, quantity and methods of reduction belong to open loops")
        return _of_state_space(closed_model(model, parameters, inputs, outputs, damping=damping), requested)
    of_mechanism = (order != "low", method != "modal", quantity, damping is not None, parameters, reducing)
    if isinstance(model, StateSpace | ModalSystem) and any(of_mechanism):
        raise OptionError("order, method, quantity, damping, parameters and methods of reduction belong to a mechanism")
    if isinstance(model, StateSpace):
        return _of_state_space(model.selected(_listed(inputs), _listed(outputs)), requested)
    if isinstance(model, ModalSystem):
        modes = model.selected(inputs, outputs)
        response = _modal(modes, requested, modes.system)
        return replace(response, known=(*response.known, *truncation_limits(modes, requested.top)))
    channels = {"inputs": inputs, "outputs": outputs, "damping": damping}
    built = system_up_to(model, parameters, top=requested.top, order=order, reducing=reducing, **channels)
    built = as_quantity(built, quantity)
    if order == "exact":
        return _exact(built, requested)
    # of a mechanism that was reduced as need be, its model is proven already
    unproven = None if isinstance(model, Plan) and not reducing else built
    if method == "direct":
        return _direct(built, requested, unproven)
    is_full = isinstance(built.model, FullOrderModel)
    modes = built.modal(up_to=BEYOND * requested.top) if is_full else built.modal()
    return _modal(modes, requested, unproven)


def _listed(names: Sequence[str] | None) -> list[str] | None:
    return None if names is None else [names] if isinstance(names, str) else list(names)


class Resonances(NamedTuple):
    """Natural frequencies (k,), Hz, and their damping ratios (k,)."""

    hz: Array
    ratios: Array


class RequestedBand(NamedTuple):
    """The frequencies (f,), Hz, that are asked for, in order, and over a band the step between their logarithms, to
    which points around resonances are added; zero where frequencies are given one by one."""

    hz: Array
    step: float

    @classmethod
    def of(cls, frequency_hz: ArrayLike | None, band: tuple[float, float] | None, points: int) -> RequestedBand:
        """Those that a caller gave. Raises OptionError for impossible ones."""
        if (frequency_hz is None) == (band is None):
            raise OptionError("give either frequencies or a band (from, to), Hz")
        if band is not None:
            low, high = (float(x) for x in band)
            if not (np.isfinite(high) and 0 < low < high):
                raise OptionError(f"a band is two frequencies in Hz, 0 < from < to, not {low:g}, {high:g}")
            if not 2 <= points <= 10_000_000:
                raise OptionError(f"a band has between 2 and 10 million points, not {points}")
            hz = np.geomspace(low, high, points)
            return cls(hz, float(np.log(hz[-1] / hz[0]) / (points - 1)))
        hz = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
        bad = hz[~(np.isfinite(hz) & (hz > 0))]
        if hz.ndim != 1 or not len(hz) or len(bad):
            what = f"{bad.flat[0]:g}" if bad.size else "none"
            raise OptionError(f"frequencies are positive finite numbers in Hz; found {what}")
        return cls(np.sort(hz), 0.0)

    @property
    def top(self) -> float:
        """The highest of them."""
        return self.hz[-1]

    def grid(self, resonances: Resonances) -> Array:
        """These frequencies, and of a band points on both sides of every resonance, equally far from each other on its
        circle of Nyquist, and from there outwards to the spacing of the others."""
        if not self.step or not len(resonances.hz):
            return self.hz
        grids = [self.hz]
        for f, zeta in zip(*resonances, strict=True):
            width = max(float(zeta), SHARPEST)
            apart = width * np.tan(np.pi / 2 * np.arange(1, PEAK_POINTS) / PEAK_POINTS)
            if self.step > apart[-1]:
                apart = np.append(apart, np.geomspace(apart[-1], self.step, PEAK_POINTS // 4)[1:])
            grids += [f * np.exp(apart), f * np.exp(-apart)]
            if zeta > 0:
                grids.append(np.array([f]))
        hz = np.unique(np.concatenate(grids))
        return hz[(hz >= self.hz[0]) & (hz <= self.hz[-1])]


def _of_state_space(model: StateSpace, requested: RequestedBand) -> FrequencyResponse:
    def resonances_up_to(top: float) -> Resonances:
        poles = model.poles()
        if model.dt is not None:
            poles = np.log(poles[np.abs(poles) > 1e-12]) / model.dt
        hz = np.abs(poles) / (2 * np.pi)
        chosen = np.flatnonzero((poles.imag > 0) & (hz <= top))
        chosen = chosen[np.argsort(hz[chosen])]
        return Resonances(hz[chosen], (-poles.real / np.abs(poles))[chosen])

    resonances = resonances_up_to(requested.top)
    hz = requested.grid(resonances)
    undamped = resonance_limits(hz, *resonances_up_to(requested.top * (1 + NEAR)))
    known = (*undamped, *band_limits(model, requested.top))
    H, channels = model.frequency_response(hz), (model.inputs, model.outputs)
    return FrequencyResponse(model.name, hz, H, *channels, *resonances, model.order, model.notes, known)


def _modal(modes: ModalSystem, requested: RequestedBand, unproven: SecondOrder | None) -> FrequencyResponse:
    """The modal sum with static correction."""
    resonances = resonances_of(modes, requested.hz)
    hz = requested.grid(resonances)
    H = modes.response(hz)
    _refuse_infinite(H, hz)
    remainder, warnings = remainder_of_response(modes, H, hz)
    return FrequencyResponse(
        *(modes.system.name, hz, H, modes.inputs, modes.outputs, resonances.hz, resonances.ratios, modes.order),
        notes=(*_notes(modes, hz, resonances), *remainder),
        known=(*known_limits(modes, hz), *warnings),
        unproven=unproven,
        modes=modes,
    )


def system_up_to(
    model: Any,
    parameters: Mapping[str, ArrayLike] | None,
    *,
    top: float,
    order: ResponseOrder,
    reducing: Mapping[str, Any],
    **channels: Any,
) -> System:
    """The system with inputs, outputs and damping, of a mechanism reduced to what is proven up to MARGIN times the
    highest frequency unless something is said of its reduction."""
    if isinstance(model, System):
        if channels["damping"] is not None or parameters or reducing:
            raise OptionError(
                "damping, parameters and methods of reduction belong to a mechanism, not to a finished system"
            )
        return model.selected(channels["inputs"], channels["outputs"])
    if order == "low" and isinstance(model, Plan) and not reducing:
        model, parameters = proven(model, parameters, MARGIN * top), None
    if order == "exact" and isinstance(model, Plan):
        model, parameters = assemble(model, parameters), None
    if order != "low" and isinstance(model, LowOrderModel):
        raise OptionError(f"order {order} needs the mechanism, not a model reduced from it")
    kind: Order = "low" if order == "low" else "full"
    return system(model, parameters, order=kind, static_correction=order != "exact", **channels, **reducing)


def proven(plan: Plan, parameters: Mapping[str, ArrayLike] | None, top: float) -> LowOrderModel:
    """The low-order model whose frequencies up to the highest one are proven, to the mechanism's own tolerance where it
    has one; without frequencies up to there, reduced as `system` reduces a mechanism of which nothing is said."""
    described = plan.mechanism.reduction
    tolerance = TOLERANCE if described is None or described.tolerance is None else described.tolerance
    K, M = stiffness_and_mass(at_pose(Design.of(plan, parameters)))
    single = one_design(parameters)
    if count_below(K, M, (2 * np.pi * top) ** 2):
        return reduce(plan, single, tolerance=tolerance, up_to=top, coordinates="substructures")
    return reduced(plan, single, {})


def known_limits(modes: ModalSystem, hz: Array) -> tuple[Diagnostic, ...]:
    """Undamped resonances in the range, and meshes that leave the response uncertain."""
    undamped = resonance_limits(hz, *resonances_of(modes, hz[[0, -1]] * (1 - NEAR, 1 + NEAR)))
    return (*undamped, *response_meshes(modes.system, modes, float(hz[-1])))


def response_meshes(
    system: SecondOrder, modes: ModalSystem | None = None, up_to_hz: float = np.inf
) -> tuple[Diagnostic, ...]:
    """Warnings of what meshes leave uncertain of the static deflection by inputs, and of the `modes` up to a frequency:
    the worst of each; and of the pose, where one is described."""
    full = system.full_order
    posed = (*pose_limits(full), *plate_warnings(full, up_to_hz if np.isfinite(up_to_hz) else 0.0))
    if not part_meshes(full):
        return posed
    static = np.zeros((full.order, 0))
    if system.inputs:
        static = system.full_flexibility(input_loads(system))
    warnings = (*posed, *motion_meshes(full, static, [f"by {c.name}" for c in system.inputs]))
    if modes is None or not (modes.frequency_hz <= up_to_hz).any():
        return warnings
    below = np.flatnonzero(modes.frequency_hz <= up_to_hz)
    shapes, hz = modes.shapes[:, below], modes.frequency_hz[below]
    shapes = shapes if isinstance(system.model, FullOrderModel) else system.model.recover(shapes)
    errors = frequency_errors(full, full.node_displacements(shapes), hz)
    assert errors is not None
    k = int(errors.share.argmax())
    warning = mesh_warning("", f"the resonance at {in_hz(hz[k], 4)}", float(errors.share[k] / 2), errors.part[k])
    return warnings if warning is None else (*warnings, warning)


def resonances_of(modes: ModalSystem, hz: Array) -> Resonances:
    """Natural frequencies in the range of some frequencies, and their damping ratios."""
    if not modes.is_proportional:
        try:
            poles = modes.complex_modes
        except SolverError:
            pass
        else:
            own = (poles.poles.imag > 0) & (poles.frequency_hz >= hz[0]) & (poles.frequency_hz <= hz[-1])
            return Resonances(poles.frequency_hz[own], poles.ratios[own])
    own = (modes.frequency_hz >= hz[0]) & (modes.frequency_hz <= hz[-1])
    return Resonances(modes.frequency_hz[own], modes.total_ratios[own])


def _notes(modes: ModalSystem, hz: Array, resonances: Resonances) -> tuple[str, ...]:
    model = modes.system.model
    kind = "full-order" if isinstance(model, FullOrderModel) else "low-order"
    notes = [f"{kind} model, order {model.order}, {modes.order} modes with static correction"]
    notes += model.steps if isinstance(model, LowOrderModel) else state_of(model.design)
    if not modes.system.is_damped:
        notes.append("no damping is given: resonances are infinitely high")
    # resonances with no frequency within their half-power width
    after = np.searchsorted(hz, resonances.hz)
    sides = (hz[np.clip(after - 1, 0, None)], hz[np.clip(after, None, len(hz) - 1)])
    nearest = np.min([np.abs(resonances.hz - side) for side in sides], axis=0)
    missed = resonances.hz[nearest > np.maximum(resonances.ratios, SHARPEST) * resonances.hz]
    if len(missed):
        listed = ", ".join(f"{f:.5g}" for f in missed[:5])
        notes.append(
            f"{len(missed)} resonance(s) fall between the frequencies given, at {listed} Hz; a band adds points"
        )
    return tuple(notes)


def _refuse_infinite(H: Complex, hz: Array) -> None:
    # sums of what is finite are quicker than asking each; a sum of all alone may overflow
    with np.errstate(invalid="ignore", over="ignore"):
        is_finite = np.isfinite(H.sum(axis=0)).all()
    if not is_finite and (bad := ~np.isfinite(H).all(axis=(1, 2))).any():
        f = hz[bad][0]
        raise SolverError(f"{in_hz(f, 6)} is an undamped resonance, where the response is infinite: give some damping")


def _direct(built: System, requested: RequestedBand, unproven: SecondOrder | None) -> FrequencyResponse:
    """K + i H + i omega C - omega^2 M solved at every frequency (theory eq. T14)."""
    M, C, K, lossy = built.matrices()
    modes = built.modal(up_to=BEYOND * requested.top)
    resonances = resonances_of(modes, requested.hz)
    hz = requested.grid(resonances)
    H = np.empty((len(hz), len(built.outputs), len(built.inputs)), dtype=complex)
    K = K if lossy is None else K + 1j * lossy
    stiff, heavy = np.abs(K.diagonal()), np.abs(M.diagonal())
    for k, f in enumerate(hz):
        w = 2 * np.pi * f
        Z = K + 1j * w * C - w * w * M
        d = inverse_roots(stiff + w * w * heavy)
        try:
            if isinstance(Z, np.ndarray):
                q = d[:, None] * np.linalg.solve(scaled(Z, d), d[:, None] * built.B.astype(complex))
            else:
                q = d[:, None] * spla.splu(scaled(Z.tocsc(), d)).solve(d[:, None] * built.B.astype(complex))
        except (np.linalg.LinAlgError, RuntimeError):
            q = np.full(built.B.shape, np.nan, dtype=complex)
        read = built.rows @ q + built.residual / stiffening(built, np.array(w))
        H[k] = read * ((1j * w) ** built.derivative)[:, None] + built.D
    _refuse_infinite(H, hz)
    notes = (f"solved directly at every frequency, order {built.order}", *state_of(built.model.design))
    known = (*known_limits(modes, hz), *_lost_digits(built))
    about = (built.inputs, built.outputs, resonances.hz, resonances.ratios, built.order)
    return FrequencyResponse(built.name, hz, H, *about, notes, known, unproven, modes)


def lost_digits(built: System) -> float:
    """The most that round-off in the stiffness, which a direct solution takes as it is stored, changes static
    responses, relative."""
    return min(lost_work(built.K, built.flexibility(built.B), built.B), 1.0)


def _lost_digits(built: System) -> tuple[Diagnostic, ...]:
    """That round-off in the stiffness may be seen."""
    if built.flexibility.shift or (lost := lost_digits(built)) < SEEN:
        return ()
    text = (
        f"so much is soft beside stiff elements that round-off may change a direct solution by {100 * lost:.1g} %"
        " below the first resonance; method modal keeps the digits"
    )
    return (Diagnostic("proof", "", lost, SEEN, "1", text),)


def _exact(built: System, requested: RequestedBand) -> FrequencyResponse:
    if not isinstance(built.model, FullOrderModel):
        raise OptionError("order exact needs the mechanism, not a system reduced from it")
    exact = ExactResponse(built.model, built.law, built.input_ports, built.output_ports, built.D)
    modes = built.modal(up_to=BEYOND * requested.top)
    resonances = resonances_of(modes, requested.hz)
    hz = requested.grid(resonances)
    H = np.stack([exact.at(2 * np.pi * f) for f in hz])
    _refuse_infinite(H, hz)
    n = len(exact.kept)
    notes = (f"exact dynamic stiffness over {n} kept DOFs; resonances are those of the finite elements",)
    about = (built.inputs, built.outputs, resonances.hz, resonances.ratios, n)
    return FrequencyResponse(built.name, hz, H, *about, notes, known_limits(modes, hz), modes=modes)
