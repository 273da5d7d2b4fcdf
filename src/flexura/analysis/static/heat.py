"""What states of temperature do: drift of points, frequencies, stress, buckling, and how soon they are reached."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis.limits import pose_limits
from flexura.analysis.static.statics import response_to
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.beam import skew
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.full_order import assemble
from flexura.mechanism import DOF_NAMES, GROUND, UNIFORM, Mechanism, Prescribed, matching, warmings
from flexura.motion import buckling_factor, pose_of, warming_load
from flexura.records import Record
from flexura.reduction import flexibility
from flexura.results import Tabular
from flexura.structure import FullOrderModel, Plan, Warmth, one_design
from flexura.tables import Facts, Item, Table, in_hz, number, percent, quantity

SINGULAR = 1e-9
"""Of what a body expands and turns by the least share of the most at which it has a point that stays."""

MOST_THINGS = 8
"""Things whose temperatures a notebook shows."""

MOST_NAMED = 4
"""Members that a note names."""

NEAR_ROOM = 100.0
"""K, within which coefficients are taken for constant."""

UNSTRESSED = 1e9
"""Yield stress over what is round-off."""

NOWHERE = 1e-8
"""Coordinate over the size of the mechanism that is zero."""

FAR = 1e3
"""Sizes of the mechanism within which points that stay are told."""


@dataclass(frozen=True, repr=False)
class WarmState(Record):
    """A state of temperature: what one unit of it does at first, and what all of it does with large displacements.

    `drift` (6,) by node is per `unit`, m and rad, linear. `temperatures`, K, are those by which things are warmer, on
    the mean. `athermal` (3,) by body is the point, m, that does not move with it, on the body or beyond; None where
    none is near. `frequency_hz` (n,), `factor_to_yield` (None where none is known or nothing is
    stressed) and `buckling_factor`
    (None where nothing buckles) are those of the state, or of 1 K; None where there is no equilibrium.
    """

    _shown = ("name", "frequency_hz")

    name: str
    unit: str
    temperatures: dict[str, float]
    drift: dict[str, Array]
    athermal: dict[str, tuple[float, float, float] | None]
    frequency_hz: Array | None = None
    factor_to_yield: float | None = None
    buckling_factor: float | None = None


@dataclass(frozen=True, repr=False)
class Heat(Tabular):
    """What states of temperature do to a mechanism (theory eqs. W13-W18).

    `frequency_hz` (n,) are those before it is warmer, `time_constants_s` those with which temperatures settle, the
    slowest first; none where nothing conducts.
    """

    _shown = ("name", "states")

    name: str
    frequency_hz: Array
    states: tuple[WarmState, ...]
    time_constants_s: Array = field(default_factory=lambda: np.zeros(0))
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()

    def state(self, name: str) -> WarmState:
        """One of the states by its name. Raises OptionError for others."""
        for own in self.states:
            if own.name == name:
                return own
        raise OptionError(f"there is no state {name!r}; there are {', '.join(own.name for own in self.states)}")

    def _title(self) -> str:
        return "states of temperature"

    def presentation(self) -> Iterator[Item]:
        for own in self.states:
            drift = np.array([*own.drift.values()]).reshape(-1, 6)
            columns: dict[str, Any] = {"node": list(own.drift)}
            for k, dof in enumerate(DOF_NAMES):
                unit = ("m", "rad")[k > 2]
                least = 1e-9 * np.abs(drift[:, 3 * (k > 2) : 3 * (k > 2) + 3]).max(initial=0.0)
                columns[dof] = [quantity(x if abs(x) > least else 0.0, unit, 3) for x in drift[:, k]]
            per = "per kelvin" if own.unit == "K" else "in all"
            yield Table(columns, "nodes", f"{own.name}: drift {per}")
            athermal = {name: point for name, point in own.athermal.items() if point is not None}
            facts: dict[str, Any] = {
                "warmer by": _told(own.temperatures),
                "stays where": {
                    name: ", ".join(quantity(x, "m", 4) for x in point) for name, point in athermal.items()
                },
            }
            if own.frequency_hz is not None:
                change = own.frequency_hz / self.frequency_hz - 1
                facts["frequencies"] = ", ".join(
                    f"{in_hz(f)} ({'+' if c > 0 else '-'}{percent(abs(c))})"
                    for f, c in zip(own.frequency_hz, change, strict=True)
                )
                facts["yields at"] = (
                    "" if own.factor_to_yield is None else f"{number(own.factor_to_yield, 4)} times this"
                )
                buckles = own.buckling_factor
                facts["buckles at"] = "nothing that is known" if buckles is None else f"{number(buckles, 4)} times this"
            yield Facts({name: text for name, text in facts.items() if text})
        if len(self.time_constants_s):
            yield Facts({"time constants": ", ".join(quantity(t, "s", 3) for t in self.time_constants_s)})

    def _columns(self) -> dict[str, Any]:
        rows = [(own.name, own.unit, node, drift) for own in self.states for node, drift in own.drift.items()]
        moved = np.array([drift for *_, drift in rows]).reshape(-1, 6)
        columns = {f"{dof} [{('m', 'rad')[k > 2]}]": moved[:, k] for k, dof in enumerate(DOF_NAMES)}
        return {
            "state": [name for name, *_ in rows],
            "per": [unit or "all of it" for _, unit, *_ in rows],
            "node": [node for _, _, node, _ in rows],
            **columns,
        }


@verb
def heat(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    states: Sequence[str] | None = None,
    nodes: Sequence[str] | None = None,
    n: int = 3,
) -> Heat:
    """What states of temperature do to a mechanism: those that are described, or `states` by name (wildcards allowed),
    `temperature` being that everything is 1 K warmer (theory eqs. W13-W18).

    Of each the drift of `nodes`, by default of all moving bodies, linear, the points of bodies that stay where they
    are, and with large displacements the `n` lowest frequencies, and what is left until it yields and buckles; of those
    in which heat flows the temperatures that last, and the time constants of the way there.

    Raises ModelError; OptionError for unknown names, and for coefficients that are missing; SolverError where something
    can move freely.
    """
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise OptionError(f"n is a whole number, at least 1, not {n!r}")
    full = assemble(model, parameters)
    plan = full.plan
    known = plan.temperatures.names
    chosen = plan.temperatures.described or [UNIFORM]
    if states is not None:
        found = {text: matching(text, known) for text in states}
        lost = next((text for text, names in found.items() if not names), None)
        if lost is not None or not found:
            raise OptionError(f"there is no state of temperature {lost!r}; there are {', '.join(known)}")
        chosen = list(dict.fromkeys(name for names in found.values() for name in names))
    shown = list(nodes) if nodes is not None else plan.moving_bodies
    plan.topology.numbers(shown)
    n = min(n, full.order)
    cold = _frequencies(_at(full, chosen[0], 0.0), n)
    warm, warnings = list[WarmState](), list[Diagnostic]()
    for name in chosen:
        first = _linear(full, name, shown)
        try:
            there = _at(full, name, 1.0)
        except SolverError as error:
            warnings.append(Diagnostic("no equilibrium", name, np.nan, np.nan, "1", f"{name}: {error}"))
            warm.append(first)
            continue
        pose = pose_of(there)
        assert pose is not None
        margin = response_to(there).stresses().factor_to_yield
        warm.append(
            replace(
                first,
                frequency_hz=_frequencies(there, n),
                factor_to_yield=margin if margin is not None and margin < UNSTRESSED else None,
                buckling_factor=buckling_factor(pose.pose),
            )
        )
        warnings += [replace(own, text=f"{name}: {own.text}") for own in pose_limits(there)]
    constants, notes = np.zeros(0), list[str]()
    if any(plan.temperatures.flows(name) for name in chosen):
        constants, unknown = plan.temperatures.network.time_constants(full.design)
        if unknown:
            more = " and others" if len(unknown) > 5 else ""
            notes.append(f"time constants leave out {', '.join(unknown[:5])}{more}: no heat capacity is known")
        notes.append("heat flows through members and thermal contacts; bodies and parts have one temperature each")
    notes += _left_out(
        plan, {name: own for state in chosen for name, own in plan.temperatures.of(state, full.design).items()}
    )
    if plan.mechanism.ground_material is None:
        notes.append("the ground keeps its size: `ground_material` says what it expands as")
    return Heat(plan.name, cold, tuple(warm), constants, tuple(notes), tuple(warnings))


def _at(full: FullOrderModel, state: str, share: float) -> FullOrderModel:
    """The mechanism in a share of a state, beside the pose that is described, with large displacements."""
    mechanism = full.plan.mechanism
    command = warmings(mechanism.temperatures)[state].command
    warmer = {**mechanism.at, state: Prescribed(**{command: share})}
    return assemble(mechanism.replaced({"at": warmer}), one_design(full.design.parameters))


def _frequencies(full: FullOrderModel, n: int) -> Array:
    """The lowest natural frequencies (n,), Hz, negative where it is unstable."""
    posed = pose_of(full)
    assert posed is not None
    values = posed.pose.modes(n).values
    return np.sign(values) * np.sqrt(np.abs(values)) / (2 * np.pi)


def _linear(full: FullOrderModel, state: str, nodes: Sequence[str]) -> WarmState:
    """What one unit of a state does at first."""
    design, plan = full.design, full.plan
    load, beside = warming_load(design, state)
    u = flexibility(full).held(load[:, None])[:, 0]
    moved = full.node_displacements(u[:, None])[:, :, 0] + beside
    size = float(np.ptp(design.positions[plan.topology.has_position], axis=0).max())
    least = SINGULAR * np.abs(moved[:, :3]).max(initial=0.0)
    moved = np.where(np.abs(moved) > least / np.repeat([1.0, size], 3), moved, 0.0)
    numbers = dict(zip(plan.topology.node_names, range(plan.topology.n_nodes), strict=True))
    warm = plan.temperatures.of(state, design)
    temperatures = {name: float(own.temperature) for name, own in warm.items()}
    athermal: dict[str, tuple[float, float, float] | None] = {}
    for body in plan.moving_bodies:
        strain, gradient = 0.0, np.zeros(3)
        if body in warm:
            strain, gradient = float(warm[body].expansion * warm[body].temperature), warm[body].gradient
        point = None if gradient.any() else _still(moved[numbers[body]], strain, size)
        if point is not None:
            place = design.positions[numbers[body]] + point
            point = np.where(np.abs(place) > NOWHERE * size, place, 0.0)
        athermal[body] = None if point is None else _triple(point)
    unit = "K" if warmings(plan.mechanism.temperatures)[state].quantity == "temperature" else ""
    return WarmState(state, unit, temperatures, {node: moved[numbers[node]] for node in nodes}, athermal)


def _still(moved: Array, strain: float, size: float) -> Array | None:
    """From a node of a body that moves (6,) and expands alike all over, the point (3,) that stays where it is, the
    nearest of several (theory eq. W17); None where there is none near."""
    spread = strain * np.eye(3) + skew(moved[3:])
    left, sizes, right = np.linalg.svd(spread)
    kept = sizes > SINGULAR * sizes.max(initial=0.0)
    if not kept.any():
        return None
    point = -right[kept].T @ ((left[:, kept].T @ moved[:3]) / sizes[kept])
    lost = moved[:3] + spread @ point
    if np.linalg.norm(point) > FAR * size:
        return None
    return point if np.linalg.norm(lost) <= SINGULAR * np.linalg.norm(moved[:3]) else None


def _left_out(plan: Plan, warm: Mapping[str, Warmth]) -> Iterator[str]:
    """What of warm things is not in it."""
    stiff = [name for name, own in warm.items() if own.kind not in (GROUND, "body") and np.isnan(own.softening)]
    if stiff:
        more = f" and {len(stiff) - MOST_NAMED} more" if len(stiff) > MOST_NAMED else ""
        yield f"moduli stay of {', '.join(stiff[:MOST_NAMED])}{more}: their materials have no `softening`"
    if any(part.springs or part.channels.piezos for part in plan.parts.values()):
        yield "springs and piezo stacks keep their size"
    if max((abs(float(own.temperature)) for own in warm.values()), default=0.0) > NEAR_ROOM:
        yield f"coefficients are those near room temperature, and some of this is more than {NEAR_ROOM:g} K from it"


def _told(temperatures: Mapping[str, float]) -> str | dict[str, str]:
    """How much warmer things are; in one word where all are alike."""
    if len(temperatures) > 1 and np.ptp(list(temperatures.values())) == 0:
        return f"all {len(temperatures)} by {quantity(next(iter(temperatures.values())), 'K', 3)}"
    shown = dict(list(temperatures.items())[:MOST_THINGS])
    more = {"...": f"{len(temperatures) - MOST_THINGS} more"} if len(temperatures) > MOST_THINGS else {}
    return {name: quantity(t, "K", 3) for name, t in shown.items()} | more


def _triple(point: Array) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z
