"""Loops closed around a mechanism: margins, bandwidths and poles, and the model that other verbs take."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import plan_of
from flexura.mechanism import Controller, Damping, Mechanism, evaluated
from flexura.results import Tabular
from flexura.structure import FullOrderModel, Plan, actuator_names, matched, sensor_names
from flexura.systems import (
    Closed,
    ModalSystem,
    StateSpace,
    closed,
    system,
    with_residual_modes,
)
from flexura.tables import Item, Table, in_hz, number

LoopState = Literal["open", "closed"]

LEAST_CLOSED = 30
"""Modes of the full-order model that loops are closed around, at least."""

LOWEST, DENSE, NEAR_POLE = 1e-3, 2000, 41
"""Lowest frequency of loops over that of the lowest mode; frequencies over all decades, and about every pole."""

OF_CONTROLLERS = (".reference", ".noise", ".command")
"""How inputs and outputs of controllers end."""

ROBUST = 0.5
"""Distance of a loop from -1 below which it is said to be near: a sensitivity of two."""


class Loop(NamedTuple):
    """How far one loop is from instability with the others closed: the least factor on its gain that is too much, up or
    down, its phase margin, rad, the least distance from -1 and the frequency, Hz, of that, the highest frequency at
    which its gain is one, and that up to which it halves the power of what disturbs."""

    name: str
    gain_margin: float
    phase_margin: float
    distance: float
    worst_hz: float
    crossover_hz: float
    bandwidth_hz: float

    @property
    def sensitivity_peak(self) -> float:
        """The largest factor by which the loop amplifies."""
        return 1 / self.distance


@dataclass(frozen=True, repr=False)
class ClosedLoop(Tabular):
    """Loops closed around modes of the full-order model: `model` from its inputs, and noises and references of
    controllers, `NAME.noise` and `NAME.reference`, to its outputs and the commands `NAME.command`, and `loops`.

    Other verbs take `model` as they take any state space.
    """

    _shown = ("name", "loops")

    name: str
    model: StateSpace
    loops: tuple[Loop, ...]
    closing: Closed
    modes: ModalSystem
    notes: tuple[str, ...] = ()

    @property
    def sensors(self) -> dict[str, str]:
        """The sensor of every loop, by the name of the loop."""
        names = [own.name for own in self.loops]
        return dict(zip(names, [c.name for c in self.closing.plant.outputs[-len(names) :]], strict=True))

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Loops that come near to -1."""
        return tuple(
            Diagnostic(
                "resonance",
                loop.name,
                loop.distance,
                ROBUST,
                "1",
                f"{loop.name}: the loop comes as near as {loop.distance:.2g} to -1, at {in_hz(loop.worst_hz)}:"
                f" it amplifies {loop.sensitivity_peak:.2g} times there",
            )
            for loop in self.loops
            if loop.distance < ROBUST
        )

    def presentation(self) -> Iterator[Item]:
        """Margins of every loop, then the slowest poles."""
        yield Table({k: v for k, v in self._columns().items() if k != "worst at [Hz]"}, "loops")
        poles = self.model.poles()
        poles = poles[poles.imag >= 0][np.argsort(np.abs(poles[poles.imag >= 0]))]
        columns: dict[str, Any] = {"closed-loop pole [Hz]": np.abs(poles) / (2 * np.pi)}
        yield Table({**columns, "damping": [number(float(-p.real / abs(p)), 3) for p in poles]}, "poles", most=12)

    def _columns(self) -> dict[str, Any]:
        return {
            "loop": [own.name for own in self.loops],
            "gain margin": [own.gain_margin for own in self.loops],
            "phase margin [deg]": [float(np.degrees(own.phase_margin)) for own in self.loops],
            "distance from -1": [own.distance for own in self.loops],
            "sensitivity peak": [own.sensitivity_peak for own in self.loops],
            "worst at [Hz]": [own.worst_hz for own in self.loops],
            "crosses one at [Hz]": [own.crossover_hz for own in self.loops],
            "bandwidth [Hz]": [own.bandwidth_hz for own in self.loops],
        }

    def _data(self) -> dict[str, Any]:
        loops = [{**own._asdict(), "sensitivity_peak": own.sensitivity_peak} for own in self.loops]
        return {"name": self.name, "loops": loops, "poles": self.model.poles(), "order": self.model.order}


@verb
def closed_loop(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    controllers: Mapping[str, Controller] | None = None,
    damping: Damping | float | Mapping[str, Any] | None = None,
    n: int | None = None,
) -> ClosedLoop:
    """The `controllers` that are described, or given in their place by name, closed around a mechanism (theory eqs.
    T37-T39).

    Around the `n` lowest modes of the full-order model, at least 30 by default, residual modes for the others and
    damping viscous as in time response. `inputs`, `outputs` and `damping` as in `system`. Where a sensor and an
    actuator have wildcards, each pair that matches, in order, is a loop of its own. Margins are of each loop with the
    others closed, dead time and hold exact; in the states of the model they are rational.

    Raises ModelError, and OptionError for names that are not there; SolverError for a loop that is unstable, by pole
    and mode.
    """
    if isinstance(model, Mechanism):
        model = plan_of(model, parameters)
    plan = model if isinstance(model, Plan) else model.plan
    values = plan.parameter_values(parameters if isinstance(model, Plan) else model.parameters)
    described = plan.mechanism.controllers if controllers is None else controllers
    if not described:
        raise OptionError("no loop can be closed: describe `controllers`, e.g. servo: {sensor: x, actuator: coil, ...}")
    loops = each_loop({name: evaluated(own, values) for name, own in described.items()}, plan)
    driven, read = [own.actuator for own in loops.values()], [own.sensor for own in loops.values()]
    outside = system(model, parameters, inputs=inputs, outputs=outputs, order="full", damping=damping)
    ins, outs = ([c.name for c in own] for own in (outside.inputs, outside.outputs))
    every = system(
        model,
        parameters,
        inputs=list(dict.fromkeys([*ins, *driven])),
        outputs=list(dict.fromkeys([*outs, *read])),
        order="full",
        damping=damping,
    )
    modes = every.modal(n=min(n or LEAST_CLOSED, every.order))
    whole = with_residual_modes(modes).viscous()
    closing = closed(_arranged(whole, [*ins, *driven], [*outs, *read]), loops)
    closing.refuse_unstable(whole.frequency_hz)
    hz = _grid(closing, modes)
    L = _open_loops(closing, hz)
    found = tuple(_loop(closing, name, k, hz, L[:, k]) for k, name in enumerate(loops))
    notes = (
        f"loops closed around {modes.order} modes of the full-order model, order {every.order}",
        *closing.model.notes[1:],
    )
    return ClosedLoop(every.name, closing.model, found, closing, modes, notes)


def is_closed(loop: str) -> bool:
    """Whether a loop is to be closed. Raises OptionError for other words than open and closed."""
    if loop not in get_args(LoopState):
        raise OptionError(f"loop is open or closed, not {loop!r}")
    return loop == "closed"


def closed_model(
    model: Any,
    parameters: Mapping[str, ArrayLike] | None,
    inputs: Sequence[str] | None,
    outputs: Sequence[str] | None,
    **options: Any,
) -> StateSpace:
    """The model of the closed loops with inputs and outputs in their order, references, noises and commands of
    controllers among them; all by default. Raises as `closed_loop`."""
    if not isinstance(model, Mechanism | Plan | FullOrderModel):
        raise OptionError("loops are closed around a mechanism, or its full-order model")
    names = [None if own is None else [own] if isinstance(own, str) else list(own) for own in (inputs, outputs)]
    outside = [None if own is None else [x for x in own if not x.endswith(OF_CONTROLLERS)] for own in names]
    found = closed_loop(model, parameters, inputs=outside[0], outputs=outside[1], **options)
    return replace(found.model, notes=found.notes, warnings=found.warnings).selected(*names)


def each_loop(described: Mapping[str, Controller], plan: Plan) -> dict[str, Controller]:
    """Controllers with wildcards as one for each pair. Raises OptionError where they do not pair."""
    found: dict[str, Controller] = {}
    for name, own in described.items():
        sensors = matched([own.sensor], sensor_names(plan))[own.sensor]
        actuators = matched([own.actuator], actuator_names(plan))[own.actuator]
        if len(sensors) != len(actuators):
            raise OptionError(f"{name}: {len(sensors)} sensors do not pair with {len(actuators)} actuators")
        pairs = list(zip(sensors, actuators, strict=True))
        for k, (sensor, actuator) in enumerate(pairs, 1):
            key = name if len(pairs) == 1 else f"{name}{k}"
            found[key] = own.replaced({"sensor": sensor, "actuator": actuator})
    return found


def _arranged(modes: ModalSystem, inputs: Sequence[str], outputs: Sequence[str]) -> ModalSystem:
    """Modes with inputs and outputs in an order, some of them twice."""
    i = [[c.name for c in modes.inputs].index(name) for name in inputs]
    o = [[c.name for c in modes.outputs].index(name) for name in outputs]
    at = np.ix_(o, i)
    return replace(
        modes,
        B=modes.B[:, i],
        C=modes.C[o],
        derivative=modes.derivative[o],
        D=modes.D[at],
        residual=modes.residual[at],
        inputs=tuple(modes.inputs[k] for k in i),
        outputs=tuple(modes.outputs[k] for k in o),
    )


def _grid(closing: Closed, modes: ModalSystem) -> Array:
    """Frequencies over all that a loop does, close about poles with loops open and closed."""
    hz = modes.frequency_hz[modes.frequency_hz > 0]
    high = max([2 * hz[-1], *(10 * w / (2 * np.pi) for own in closing.filters for _, _, w in own.sections)])
    grids = [np.geomspace(LOWEST * hz[0], high, DENSE)]
    for poles in (closing.model.poles(), closing.plant.poles()):
        upper = poles[(poles.imag > 0) & (np.abs(poles) < 4 * np.pi * hz[-1])]
        size = np.abs(upper) / (2 * np.pi)
        apart = np.tan(np.pi / 2 * np.linspace(-1, 1, NEAR_POLE + 2)[1:-1])
        grids += [
            f * np.exp(max(zeta, 1e-5) * apart) for f, zeta in zip(size, -upper.real / np.abs(upper), strict=True)
        ]
    found = np.unique(np.concatenate(grids))
    return found[(found >= LOWEST * hz[0]) & (found <= high)]


def _open_loops(closing: Closed, hz: Array) -> Complex:
    """L (f, c) of every loop with the others closed: det(I + G K)/det(I + G K without it) - 1."""
    c = len(closing.filters)
    G = closing.plant.frequency_response(hz)[:, -c:, -c:]
    K = np.stack([-own.sign * own.response(hz) for own in closing.filters], axis=1)
    GK = G * K[:, None, :]
    whole, found = np.linalg.det(np.eye(c) + GK), np.empty((len(hz), c), dtype=complex)
    for k in range(c):
        others = GK.copy()
        others[:, :, k] = 0
        found[:, k] = whole / np.linalg.det(np.eye(c) + others) - 1
    return found


def _loop(closing: Closed, name: str, k: int, hz: Array, L: Complex) -> Loop:
    """Margins of one loop, refined between the frequencies at which it is known."""
    from scipy.optimize import brentq, minimize_scalar  # slow to import

    def at(f: float) -> complex:
        return complex(_open_loops(closing, np.array([f]))[0, k])

    def crossings(values: Array, of: Any) -> list[float]:
        places = np.flatnonzero(np.diff(np.sign(values)) != 0)
        return [float(brentq(of, hz[j], hz[j + 1], xtol=1e-12 * hz[j])) for j in places.tolist()]

    real = [at(f).real for f in crossings(L.imag, lambda f: at(f).imag)]
    gains = [max(-x, -1 / x) for x in real if x < 0]
    ones = crossings(np.abs(L) - 1, lambda f: abs(at(f)) - 1)
    phases = [abs(np.angle(-at(f))) for f in ones]
    j = int(np.abs(1 + L).argmin())
    low, high = hz[max(j - 1, 0)], hz[min(j + 1, len(hz) - 1)]
    worst = minimize_scalar(
        lambda f: abs(1 + at(f)), bounds=(low, high), method="bounded", options={"xatol": 1e-9 * low}
    )
    halved = crossings(np.abs(1 + L) ** 2 - 2, lambda f: abs(1 + at(f)) ** 2 - 2) if abs(1 + L[0]) ** 2 > 2 else []
    return Loop(
        name,
        min(gains, default=np.inf),
        min(phases, default=np.inf),
        float(min(worst.fun, np.abs(1 + L[j]))),
        float(worst.x),
        max(ones, default=0.0),
        min(halved, default=0.0),
    )
