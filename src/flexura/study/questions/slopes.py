"""Derivatives of what is asked of one design, by its parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexura.arrays import Array, Bools
from flexura.derivatives import LinearState, State, displaced_state, frequency_slopes
from flexura.duals import Dual, plain
from flexura.errors import SolverError
from flexura.mechanism import bounds
from flexura.records import Record
from flexura.structure import Design, Plan, kinks, tables_left
from flexura.study.questions.blocks import FAILURES, STATIC, reason_of
from flexura.study.questions.kinds import FREQUENCY, WORST, Quantity, Worst, pose_text
from flexura.study.questions.reading import Members, Reader
from flexura.study.questions.single import OneDesign, reading
from flexura.study.questions.states import MODES_FOLLOWED
from flexura.study.questions.strokes import StrokeLine
from flexura.thresholds import ROUND_OFF

DIFFERENCE_STEP = 1e-3
"""Relative step of differences."""

CROSS_MOTIONS = ("compliance", "coupling", "amplification")
"""Kinds that may be of a motion by a force elsewhere."""

MOST_IN_REASON = 4
"""Members or parts that a reason names."""


@dataclass(frozen=True, repr=False)
class Slopes(Record):
    """What was asked of one design, `value` (q,), and derivatives `slope` (q, P) by P parameters, all SI.

    `is_exact` (q,) says which are exact; others are differences of high order, of values at nearby designs. Of
    frequencies that coincide `repeated` has the places of those that were asked for, and `directional` for each such
    group the matrix (m, m, P), Hz per SI unit, whose eigenvalues along a direction in the space of parameters are the
    derivatives of the m frequencies along it; their rows of `slope` are those along one parameter each, ascending.
    Where something has no derivative it is NaN, and `reason` (q,) has the words. Motions by forces elsewhere below
    `least` (q,) are round-off, and zero.
    """

    _shown = ("quantities", "names")

    quantities: tuple[Quantity, ...]
    names: tuple[str, ...]
    value: Array
    slope: Array
    is_exact: Bools
    reason: list[str]
    repeated: tuple[tuple[int, ...], ...] = ()
    directional: tuple[Array, ...] = field(default=(), compare=False)
    least: Array = field(default_factory=lambda: np.zeros(0), compare=False)

    @property
    def numbers(self) -> dict[str, Dual]:
        """Values with their slopes by the text of what was asked, as `Formula.evaluate` takes them."""
        return {
            quantity.text: Dual(np.array(self.value[k]), self.slope[k].copy())
            for k, quantity in enumerate(self.quantities)
        }


class Exact:
    """What is asked of one design with exact derivatives; what has none is left NaN in `value` (q,)."""

    def __init__(
        self, plan: Plan, parameters: Mapping[str, float], names: Sequence[str], quantities: tuple[Quantity, ...]
    ) -> None:
        self.plan = plan
        self.parameters: dict[str, float] = dict(parameters)
        self.names: list[str] = list(names)
        self.quantities = quantities
        self.value: Array = np.full(len(quantities), np.nan)
        self.slope: Array = np.full((len(quantities), len(names)), np.nan)
        self.is_exact: Bools = np.zeros(len(quantities), dtype=bool)
        self.least: Array = np.zeros(len(quantities))
        self.reason: list[str] = [""] * len(quantities)
        self.repeated: list[tuple[int, ...]] = []
        self.directional: list[Array] = []
        self._single = OneDesign(plan, self.parameters, quantities)
        if not plan.is_posed:
            self._try_worst([k for k, quantity in enumerate(quantities) if quantity.kind == WORST])
            at_rest = [k for k, quantity in enumerate(quantities) if not (quantity.pose or quantity.kind == WORST)]
            self._try([k for k in at_rest if quantities[k].kind == FREQUENCY], self._frequencies)
            for k in at_rest:
                if quantities[k].kind != FREQUENCY:
                    self._try([k], lambda places: self._read(places[0], self._at_rest))
        for pose in dict.fromkeys(quantity.pose for quantity in quantities if quantity.pose):
            at_it = [k for k, quantity in enumerate(quantities) if quantity.pose == pose]
            self._try([k for k in at_it if quantities[k].kind not in ("frf", "frf_peak", "rms", "reach")], self._posed)
        if not plan.is_posed:
            elsewhere = [k for k, quantity in enumerate(quantities) if quantity.kind in CROSS_MOTIONS]
            self._try([k for k in elsewhere if np.isfinite(self.value[k])], self._clear)
            self._try([k for k in range(len(quantities)) if self.is_exact[k] and not self.reason[k]], self._explain)

    def _try(self, places: list[int], work: Callable[[list[int]], None]) -> None:
        if not places:
            return
        try:
            with np.errstate(all="ignore"):
                work(places)
        except FAILURES as error:
            for k in places:
                self._fail(k, error)

    def _try_worst(self, places: list[int]) -> None:
        """Slopes of what is asked at the worst pose of a stroke: there, where its poses stay as parameters move, and it
        is at an end of the stroke or as bad to both sides (the envelope theorem)."""
        for k in places:
            try:
                worst = self._single.worst(self.quantities[k])
                [of] = self.quantities[k].arguments
                assert isinstance(of, Worst)
                if self._moves(of.over):
                    continue
                there = Exact(self.plan, self.parameters, self.names, worst.quantities)
                if not there.is_exact.all():
                    continue
                numbers = {
                    own.text: Dual(np.array(there.value[q]), there.slope[q]) for q, own in enumerate(of.quantities)
                }
                self._take(k, of.evaluate(numbers))
                self.reason[k] = next(filter(None, there.reason), "")
            except FAILURES as error:
                self._fail(k, error)

    def _moves(self, over: str) -> bool:
        """Whether the poses of a stroke move as parameters do."""
        here, known = StrokeLine.of(self.plan, over, self.parameters), self.plan.parameter_values(self.parameters)
        at = {**self.parameters, **{name: float(known[name]) for name in self.names}}
        designs, _ = steps(self.plan, at, self.names)
        beside = ({name: float(values[4 * p]) for name, values in designs.items()} for p in range(len(self.names)))
        return any(StrokeLine.of(self.plan, over, one) != here for one in beside)

    def _fail(self, place: int, error: Exception) -> None:
        self.reason[place] = f"{self.quantities[place].text}: {reason_of(error)}"
        self.is_exact[place] = True

    def _clear(self, places: list[int]) -> None:
        """Make zero what is round-off of motions by forces elsewhere, and of their slopes over a whole parameter."""
        values = self.plan.parameter_values(self.parameters)
        sizes = np.array([abs(float(values[name])) for name in self.names])
        for k in places:
            self.least[k] = least = self._single.round_off(self.quantities[k])
            if abs(self.value[k]) < least:
                self.value[k] = 0.0
                self.slope[k][abs(self.slope[k]) * sizes < least] = 0.0

    def _explain(self, places: list[int]) -> None:
        """Say why derivatives are missing, where nothing did; by what makes every other design impossible there are
        none."""
        left = [tables_left(self._design, p) for p in range(len(self.names))]
        moved = [p for p, tables in enumerate(left) if tables]
        for k in places:
            if self.quantities[k].kind != "parameter":
                self.slope[k, moved] = np.nan
            missing = np.flatnonzero(~np.isfinite(self.slope[k])).tolist()
            if missing:
                why = [f"by {self.names[p]}, {_why(left[p], kinks(self._design, p))}" for p in missing]
                self.reason[k] = f"{self.quantities[k].text}: it has no derivative {'; '.join(why)}"

    @cached_property
    def _design(self) -> Design:
        """The design with slopes, without the pose that may be described."""
        return Design.with_slopes(self.plan.at_rest(), self.parameters, self.names)

    @cached_property
    def _at_rest(self) -> LinearState:
        return LinearState(self._design)

    def _take(self, place: int, number: Any) -> None:
        """Take a number, with slopes or without, as an answer."""
        self.value[place] = float(plain(number))
        self.slope[place] = number.slope if isinstance(number, Dual) else 0.0
        self.is_exact[place] = True

    def _read(self, place: int, state: State) -> None:
        """Take what is asked of a state, but for frequencies, as an answer, where exact slopes of it are known, and say
        why it has none."""
        quantity = self.quantities[place]
        number = reading(state, quantity)
        if number is None:
            return
        self._take(place, number)
        if not np.isnan(self.slope[place]).any():
            return
        if quantity.kind in ("stress", "margin"):
            self.reason[place] = self._parting(place, state)
        elif quantity.kind == "reach":
            self.reason[place] = f"{quantity.text}: it yields alike at several places that part as parameters move"
        elif quantity.kind in ("frf", "frf_peak", "rms"):
            why = "the design is at a kink" if self.value[place] else "it is zero"
            self.reason[place] = f"{quantity.text}: {why}, and has no derivative"

    def _parting(self, place: int, state: State) -> str:
        """Why a stress or margin has no derivative by some of the parameters, with those on either side where members
        that are stressed alike part."""
        quantity, worst = self.quantities[place], self.value[place]
        of, is_stress = next(iter(quantity.arguments), None), quantity.kind == "stress"
        members, stress, limit = state.stressed(
            of.members if isinstance(of, Members) else None, over_yield=not is_stress, share=1.0
        )
        numbers = stress if is_stress else limit / stress
        is_tied = plain(numbers) >= worst * (1 - ROUND_OFF) if is_stress else plain(numbers) <= worst * (1 + ROUND_OFF)
        tied, reasons = np.flatnonzero(is_tied), []
        for p in np.flatnonzero(np.isnan(self.slope[place])).tolist():
            name, sides = self.names[p], numbers.slope[p, tied]
            if np.isnan(sides).any():
                reasons.append(f"sections of {members[tied[0]]} part with {name}, or it is at a kink")
            else:
                ends = sorted((sides.max(), sides.min()), reverse=is_stress)
                reasons.append(f"by {name} it is {ends[0]:.6g} upwards and {ends[1]:.6g} downwards, per SI unit")
        alike = f"{_listed([members[k] for k in tied])} are stressed alike: " if len(tied) > 1 else ""
        return f"{quantity.text}: {alike}{'; '.join(reasons)}"

    def _frequencies(self, places: list[int]) -> None:
        numbers = dict[int, int]()
        for k in places:
            numbers[k], self.reason[k] = self._single.mode(self.quantities[k])
        followed = any(self.quantities[k].is_followed for k in places)
        count = max(MODES_FOLLOWED if followed else 0, *(number + 1 for number in numbers.values()))
        slopes = frequency_slopes(self._design, min(count, self.plan.topology.n_dof))
        for k, number in numbers.items():
            self._take(k, Dual(np.array(slopes.frequency_hz[number]), slopes.slope[number]))
        for group, matrix in zip(slopes.repeated, slopes.directional, strict=True):
            if of_group := tuple(k for k, number in numbers.items() if number in group):
                self._take_group(of_group, matrix)

    def _posed(self, places: list[int]) -> None:
        """What is asked at one pose; what cannot be answered there has the reason for it."""
        pose = self.quantities[places[0]].pose
        move, force, command = (
            {own.name: own.value for own in pose if own.kind == kind} for kind in ("move", "force", "command")
        )
        state = displaced_state(self._design, move, force, command)
        if not state.is_stable:
            raise SolverError(f"{pose_text(pose)} it is unstable")
        numbers = dict[int, int]()
        for k in places:
            quantity = self.quantities[k]
            try:
                if quantity.kind == FREQUENCY:
                    numbers[k], self.reason[k] = self._single.mode(quantity)
                    continue
                if quantity.kind in STATIC:
                    self._single.read(quantity)  # which says where the pose holds it
                self._read(k, state)
            except FAILURES as error:
                self._fail(k, error)
        for repeated in state.frequencies(max(numbers.values()) + 1) if numbers else ():
            group = {k: number for k, number in numbers.items() if number in repeated.at}
            branches = np.linalg.eigvalsh(repeated.slope)
            for k, number in group.items():
                self._take(k, Dual(np.array(repeated.value), branches[:, repeated.at.index(number)]))
            if group and len(repeated.at) > 1:
                self._take_group(tuple(group), np.moveaxis(repeated.slope, 0, -1))

    def _take_group(self, places: tuple[int, ...], matrix: Array) -> None:
        """Take frequencies as one group; one that is followed by what moves has no derivative of its own there."""
        self.repeated.append(places)
        self.directional.append(matrix)
        for k in places:
            if self.quantities[k].is_followed:
                self.slope[k] = np.nan
                text = self.quantities[k].text
                self.reason[k] = f"{text}: it coincides with others, and has no derivative by itself"


def _why(tables: Sequence[str], kinked: Sequence[str]) -> str:
    """Why there is no derivative, with the parts that it is for."""
    parts = _listed(list(tables or kinked))
    if tables:
        return f"with which tables of {parts} no longer end where the member does"
    return f"by which {parts or 'it'} is at a kink"


def _listed(names: Sequence[str]) -> str:
    return f"{', '.join(names[:MOST_IN_REASON])}{' ...' if len(names) > MOST_IN_REASON else ''}"


def by_members(plan: Plan, quantity: Quantity) -> list[Quantity]:
    """Of a stress or a margin that of each member it is the worst of; nothing of all else."""
    kind = quantity.kind
    if kind not in ("stress", "margin"):
        return []
    of, known = next(iter(quantity.arguments), None), Reader(plan).yield_stresses
    names = [name for name, limit in known.items() if kind == "stress" or not np.isnan(limit)]
    return [
        replace(quantity, text=f"{kind}({name}){quantity.where}", arguments=(Members(name, (name,)),))
        for name in (of.members if isinstance(of, Members) else names)
    ]


def steps(plan: Plan, at: Mapping[str, float], names: Iterable[str]) -> tuple[dict[str, Array], Array]:
    """Designs beside one, four for each parameter, by name, and how far they are from it (P, 4): to both sides where
    the limits of the parameter allow that, else to one, the last of them the design itself."""
    names, known = list(names), plan.parameter_values(at)
    away = np.tile([-2.0, -1.0, 1.0, 2.0], (len(names), 1))
    for p, name in enumerate(names):
        h = DIFFERENCE_STEP * (abs(float(known[name])) or 1.0)
        low, high = (float(plain(own)) for own in bounds(name, plan.mechanism.parameters[name], known))
        if float(known[name]) + 2 * h > high:
            away[p] = [-3.0, -2.0, -1.0, 0.0]
        elif float(known[name]) - 2 * h < low:
            away[p] = [3.0, 2.0, 1.0, 0.0]
        away[p] *= h
    designs = {name: np.full(4 * len(names), value) for name, value in at.items()}
    for p, name in enumerate(names):
        designs[name][4 * p : 4 * p + 4] += away[p]
    return designs, away


def differences(values: Array, away: Array) -> Array:
    """Derivatives (q, P) from values (4 P, q) at the designs of `steps`, of fourth order in steps to both sides and of
    third in steps to one: those of the polynomial through them."""
    h = np.abs(away).max(axis=1)
    powers = (away / h[:, None])[:, None, :] ** np.arange(4)[:, None]
    weights = np.linalg.solve(powers, np.broadcast_to(np.eye(4)[1], (len(h), 4))[..., None])[..., 0]
    return np.einsum("ps,psq->qp", weights / h[:, None], values.reshape(len(h), 4, -1))
