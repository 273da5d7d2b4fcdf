"""Derivatives of what is asked of one design, by its parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.analysis import AtRest, at_pose, settled
from flexura.arrays import Array
from flexura.duals import Dual, plain
from flexura.errors import SolverError
from flexura.motion import Repeated
from flexura.records import Record
from flexura.reduction import flexibility
from flexura.sensitivity import Reading, displacement_rows, family_of, frequency_slopes
from flexura.structure import Design, Plan, assemble, kinks, tables_left
from flexura.study.questions.blocks import FAILURES, body_mass, reason_of, total_mass
from flexura.study.questions.grammar import FREQUENCY, Quantity
from flexura.study.questions.reading import Freedom, Members, Port, Reader, pose_text
from flexura.study.questions.single import OneDesign, sloped_magnitude, sloped_reach
from flexura.study.questions.states import MODES, UNKNOWN

ALIKE = 1e-12
"""Relative difference up to which members are stressed alike."""


def worst(state: Any, asked: Quantity) -> Any:
    """The largest stress, or the margin to yield, of the members asked for, in a state with slopes.

    Raises SolverError where no stress is known; a margin is infinite where no yield stress is.
    """
    members, _ = _asked(state, asked)
    if not members and asked.kind == "margin":
        return np.inf
    if not members:
        raise SolverError(UNKNOWN)
    largest = _largest(state, asked)
    return largest if asked.kind == "stress" else 1 / largest


def by_members(plan: Plan, asked: Quantity) -> list[Quantity]:
    """Of a stress or a margin that of each member it is the worst of; nothing of all else."""
    if asked.kind not in ("stress", "margin"):
        return []
    of, known = next(iter(asked.arguments), None), Reader(plan).yield_stresses
    names = (
        of.members
        if isinstance(of, Members)
        else [name for name, limit in known.items() if asked.kind == "stress" or not np.isnan(limit)]
    )
    _, at, pose = asked.text.partition(" at ")
    return [
        replace(asked, text=f"{asked.kind}({name}){at}{pose}", arguments=(Members(name, (name,)),)) for name in names
    ]


def parting(state: Any, asked: Quantity, names: Sequence[str]) -> str:
    """Why a stress or margin has no derivative by some of the parameters `names`, with those on either side where
    members that are stressed alike part; empty where it has all."""
    largest = _largest(state, asked) if _asked(state, asked)[0] else np.inf
    if not isinstance(largest, Dual) or not np.isnan(largest.slope).any():
        return ""
    members, own = _asked(state, asked, share=1.0)
    tied = np.flatnonzero(plain(own) >= plain(largest) * (1 - ALIKE))
    said = []
    for p in np.flatnonzero(np.isnan(largest.slope)).tolist():
        sides = own.slope[p, tied] / (1 if asked.kind == "stress" else -(plain(largest) ** 2))
        if np.isnan(sides).any():
            said.append(f"sections of {members[tied[0]]} part with {names[p]}, or it is at a kink")
        else:
            ends = sorted((sides.max(), sides.min()), reverse=asked.kind == "stress")
            said.append(f"by {names[p]} it is {ends[0]:.6g} upwards and {ends[1]:.6g} downwards, per SI unit")
    alike = f"{', '.join(members[k] for k in tied[:4])}{' ...' if len(tied) > 4 else ''} are stressed alike: "
    return f"{asked.text}: {alike if len(tied) > 1 else ''}{'; '.join(said)}"


def _largest(state: Any, asked: Quantity) -> Any:
    """The largest stress of the members asked for, for a margin over yield stresses."""
    return settled(lambda share: np.max(_asked(state, asked, share)[1]))


def _asked(state: Any, asked: Quantity, share: float = 0.0) -> tuple[list[str], Any]:
    """Members asked for and their stresses (m,), for a margin over their yield stresses."""
    largest, of = state.stresses_within(share) if share else state.stresses, next(iter(asked.arguments), None)
    chosen = [k for k, name in enumerate(largest.names) if not isinstance(of, Members) or name in of.members]
    if asked.kind == "stress":
        return [largest.names[k] for k in chosen], largest.von_mises[chosen, 0]
    limit = largest.yield_stress
    chosen = [k for k in chosen if not np.isnan(plain(limit)[k])]
    return [largest.names[k] for k in chosen], largest.von_mises[chosen, 0] / limit[chosen]


LINEAR = ("stress", "margin", "buckling", "coupling", "amplification")
"""What is read at rest of `flexura.analysis.AtRest`."""

HELD = ("compliance", "stiffness", "coupling", "amplification")
"""What a pose may hold: read without slopes first, where that is said."""

STEP = 1e-3
"""Relative step of differences."""


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
    is_exact: NDArray[np.bool_]
    reason: list[str]
    repeated: tuple[tuple[int, ...], ...] = ()
    directional: tuple[Array, ...] = field(default=(), compare=False)
    least: Array = field(default_factory=lambda: np.zeros(0), compare=False)

    @property
    def numbers(self) -> dict[str, Dual]:
        """Values with their slopes by the text of what was asked, as `Formula.evaluate` takes them."""
        return {own.text: Dual(np.array(self.value[k]), self.slope[k].copy()) for k, own in enumerate(self.quantities)}


class Exact:
    """What is asked of one design with exact derivatives; what has none is left NaN in `value` (q,)."""

    def __init__(
        self, plan: Plan, parameters: Mapping[str, float], names: Sequence[str], asked: tuple[Quantity, ...]
    ) -> None:
        self.plan = plan
        self.parameters: dict[str, float] = dict(parameters)
        self.names: list[str] = list(names)
        self.asked = asked
        self.value: Array = np.full(len(asked), np.nan)
        self.slope: Array = np.full((len(asked), len(names)), np.nan)
        self.is_exact: NDArray[np.bool_] = np.zeros(len(asked), dtype=bool)
        self.least: Array = np.zeros(len(asked))
        self.reason: list[str] = [""] * len(asked)
        self.repeated: list[tuple[int, ...]] = []
        self.directional: list[Array] = []
        for kinds, work in ((("mass", "parameter"), self._numbers), (("compliance", "stiffness"), self._compliances)):
            self._try([k for k, own in enumerate(asked) if own.kind in kinds and not own.pose], work)
        self._try([k for k, own in enumerate(asked) if own.kind == FREQUENCY and not own.pose], self._frequencies)
        linear = [k for k, own in enumerate(asked) if own.kind in LINEAR and not own.pose]
        self._try(linear, self._at_rest)
        self._try([k for k, own in enumerate(asked) if own.kind == "reach"], self._reaches)
        for k in (k for k, own in enumerate(asked) if own.kind in ("frf", "frf_peak") and not own.pose):
            self._try([k], self._responses)
        for pose in dict.fromkeys(own.pose for own in asked if own.pose):
            self._try([k for k, own in enumerate(asked) if own.pose == pose and is_sloped(own)], self._at_pose)

        elsewhere = [k for k, own in enumerate(asked) if own.kind in ("compliance", "coupling", "amplification")]
        self._try([k for k in elsewhere if np.isfinite(self.value[k])], self._clear)
        self._try([k for k in range(len(asked)) if self.is_exact[k] and not self.reason[k]], self._explain)

    def _clear(self, places: list[int]) -> None:
        """Make zero what is round-off of motions by forces elsewhere, and of their slopes over a whole parameter."""
        single, values = OneDesign(self.plan, self.parameters, self.asked), self.plan.parameter_values(self.parameters)
        sizes = np.array([abs(float(values[name])) for name in self.names])
        for k in places:
            self.least[k] = least = single.round_off(self.asked[k])
            if abs(self.value[k]) < least:
                self.value[k] = 0.0
                self.slope[k][abs(self.slope[k]) * sizes < least] = 0.0

    def _explain(self, places: list[int]) -> None:
        """Say why derivatives are missing, where nothing did; by what makes every other design impossible there are
        none."""
        left = [tables_left(self._design, p) for p in range(len(self.names))]
        moved = [p for p, own in enumerate(left) if own]
        for k in places:
            if self.asked[k].kind != "parameter":
                self.slope[k, moved] = np.nan
            missing = np.flatnonzero(~np.isfinite(self.slope[k])).tolist()
            if missing:
                said = [f"by {self.names[p]}, {_why(left[p], kinks(self._design, p))}" for p in missing]
                self.reason[k] = f"{self.asked[k].text}: it has no derivative {'; '.join(said)}"

    @cached_property
    def _design(self) -> Design:
        """The design with slopes, without the pose that may be described."""
        return Design.with_slopes(self.plan.at_rest(), self.parameters, self.names)

    def _try(self, places: list[int], work: Any) -> None:
        if not places or (self.plan.is_posed and work != self._at_pose):
            return
        try:
            with np.errstate(all="ignore"):
                work(places)
        except FAILURES as error:
            for k in places:
                self.reason[k] = f"{self.asked[k].text}: {reason_of(error)}"
                self.is_exact[k] = True

    def _tell(self, place: int, found: Any) -> None:
        """Take a number, with slopes or without, as an answer."""
        with_slopes = isinstance(found, Dual)
        self.value[place] = float(found.value if with_slopes else found)
        self.slope[place] = found.slope if with_slopes else 0.0
        self.is_exact[place] = True

    def _read(self, place: int, state: Any) -> None:
        """Take what is asked of a state as an answer."""
        asked = self.asked[place]
        self._tell(place, read_of(state, asked))
        if asked.kind in ("stress", "margin"):
            self.reason[place] = parting(state, asked, self.names)

    def _numbers(self, places: list[int]) -> None:
        """Masses and parameters."""
        design = self._design
        values = self.plan.parameter_values(design.parameters)
        for k in places:
            of = next(iter(self.asked[k].arguments), None)
            if self.asked[k].kind == "parameter":
                self._tell(k, values[str(of)])
            else:
                self._tell(k, body_mass(design, of) if isinstance(of, str) else total_mass(design))

    def _compliances(self, places: list[int]) -> None:
        """Of r K^-1 s with rows r and s: r' K^-1 s + r K^-1 s' - r K^-1 K' K^-1 s."""
        pairs = {k: (own[0], own[-1]) for k in places if (own := self.asked[k].arguments)}
        freedoms = list(dict.fromkeys(of for pair in pairs.values() for of in pair if isinstance(of, Freedom)))
        rows = displacement_rows(
            [Reading(of.node, np.eye(3)[of.component % 3], of.turns, np.zeros(3)) for of in freedoms]
        )
        model = assemble(self.plan, self.parameters)
        R = rows(model.design)
        X = flexibility(model).held(np.ascontiguousarray(R.T))
        C = R @ X
        changes = family_of(self.plan, "full", self.parameters, rows=rows).changes(self.parameters, self.names, X)
        kinked = np.array([not change.is_smooth for change in changes], dtype=bool)
        dC = np.array([change.Y + change.Y.T - X.T @ change.K for change in changes]).reshape(-1, *C.shape)
        for k, pair in pairs.items():
            i, j = (freedoms.index(of) for of in pair if isinstance(of, Freedom))
            value, slope = (C[i, j] + C[j, i]) / 2, np.where(kinked, np.nan, (dC[:, i, j] + dC[:, j, i]) / 2)
            if self.asked[k].kind == "stiffness":
                value, slope = 1 / value, -slope / value**2
            self._tell(k, Dual(np.array(value), slope))

    def _at_rest(self, places: list[int]) -> None:
        """What is linear under the loads that are described."""
        state = AtRest(self.plan, self.parameters, self.names)
        for k in places:
            self._read(k, state)

    def _reaches(self, places: list[int]) -> None:
        """Strokes until something yields."""
        for k in places:
            [of] = self.asked[k].arguments
            assert isinstance(of, Freedom)
            self._tell(k, sloped_reach(self.plan, self.parameters, self.names, of))
            if np.isnan(self.slope[k]).any():
                self.reason[k] = f"{self.asked[k].text}: it yields alike at several places that part as parameters move"

    def _responses(self, places: list[int]) -> None:
        """Magnitudes of responses, where exact slopes of them are known."""
        for k in places:
            found = sloped_magnitude(self.plan, self.parameters, self.names, self.asked[k].arguments)
            if found is None:
                continue
            self._tell(k, found)
            if np.isnan(self.slope[k]).any():
                none = "it is zero" if not self.value[k] else "the design is at a kink"
                self.reason[k] = f"{self.asked[k].text}: {none}, and has no derivative"

    def _frequencies(self, places: list[int]) -> None:
        single = OneDesign(self.plan, self.parameters, self.asked)
        numbers = dict[int, int]()
        for k in places:
            numbers[k], self.reason[k] = single.mode(self.asked[k])
        followed = any(isinstance(self.asked[k].arguments[0], Freedom) for k in places)
        count = max(MODES if followed else 0, *(n + 1 for n in numbers.values()))
        found = frequency_slopes(self._design, min(count, self.plan.topology.n_dof))
        for k, number in numbers.items():
            self._tell(k, Dual(np.array(found.frequency_hz[number]), found.slope[number]))
        for group, matrix in zip(found.repeated, found.directional, strict=True):
            own = tuple(k for k, number in numbers.items() if number in group)
            if own:
                self._tell_group(own, matrix)

    def _at_pose(self, places: list[int]) -> None:
        """What is asked at one pose; what cannot be answered there has the reason for it."""
        single, pose = OneDesign(self.plan, self.parameters, self.asked), self.asked[places[0]].pose
        state = at_pose(self._design, dict(pose))
        if not state.is_stable:
            raise SolverError(f"at {pose_text(pose)} it is unstable")
        numbers = dict[int, int]()
        for k in places:
            own = self.asked[k]
            try:
                if own.kind == FREQUENCY:
                    numbers[k], self.reason[k] = single.mode(own)
                    continue
                if own.kind in HELD:
                    single.read(own)
                self._read(k, state)
            except FAILURES as error:
                self.reason[k], self.is_exact[k] = f"{own.text}: {reason_of(error)}", True
        for own in state.frequencies(max(numbers.values()) + 1) if numbers else ():
            self._tell_repeated(own, {k: number for k, number in numbers.items() if number in own.at})

    def _tell_repeated(self, found: Repeated, numbers: Mapping[int, int]) -> None:
        """Take a frequency, or several that coincide, as the answers at some places."""
        branches = np.linalg.eigvalsh(found.slope)
        for k, number in numbers.items():
            self._tell(k, Dual(np.array(found.value), branches[:, found.at.index(number)]))
        if numbers and len(found.at) > 1:
            self._tell_group(tuple(numbers), np.moveaxis(found.slope, 0, -1))

    def _tell_group(self, places: tuple[int, ...], matrix: Array) -> None:
        """Take frequencies as one group; one that is followed by what moves has no derivative of its own there."""
        self.repeated.append(places)
        self.directional.append(matrix)
        for k in places:
            if isinstance(self.asked[k].arguments[0], Freedom):
                self.slope[k] = np.nan
                self.reason[k] = f"{self.asked[k].text}: it coincides with others, and has no derivative by itself"


def _why(tables: Sequence[str], kinked: Sequence[str]) -> str:
    """Why there is no derivative, with the parts that it is for."""
    own = list(tables or kinked)
    named = f"{', '.join(own[:4])}{' ...' if len(own) > 4 else ''}"
    if tables:
        return f"with which tables of {named} no longer end where the member does"
    return f"by which {named or 'it'} is at a kink"


def is_sloped(asked: Quantity) -> bool:
    """Whether exact derivatives of what is asked at a pose are known."""
    return asked.kind not in ("frf", "frf_peak", "reach")


def read_of(state: Any, asked: Quantity) -> Any:
    """What is asked of a state with slopes, at rest or at a pose, but for frequencies."""
    match asked.kind:
        case "force":
            return state.forces[str(asked.arguments[0])]
        case "buckling":
            factor = state.buckling_factor
            return np.inf if factor is None else Dual(np.array(factor.value), np.linalg.eigvalsh(factor.slope)[:, 0])
        case "coupling" | "amplification":
            actuator, to = asked.arguments
            assert isinstance(actuator, Port)
            assert isinstance(to, Freedom)
            moved, elongation = state.coupling(actuator.known, to.node)
            return moved[to.component] / (1.0 if asked.kind == "coupling" else abs(elongation))
        case "stiffness" | "compliance":
            of = [own for own in (asked.arguments[0], asked.arguments[-1]) if isinstance(own, Freedom)]
            rows = np.stack([state.rows(own.node)[own.component] for own in of])
            names = {own.name for own in of}
            found = state.flexibility(rows, [name for name in state.move if name not in names])[0, 1]
            return 1 / found if asked.kind == "stiffness" else found
    return worst(state, asked)


def steps(at: Mapping[str, float], names: Iterable[str]) -> tuple[dict[str, Array], Array]:
    """Designs beside one, four for each parameter, by name, and the steps (P,) that they are apart."""
    names = list(names)
    h = np.array([STEP * (abs(at[name]) or 1.0) for name in names])
    out = {name: np.full(4 * len(names), value) for name, value in at.items()}
    for p, name in enumerate(names):
        out[name][4 * p : 4 * p + 4] += h[p] * np.array([-2.0, -1.0, 1.0, 2.0])
    return out, h


def differences(values: Array, h: Array) -> Array:
    """Derivatives (q, P) from values (4 P, q) at the designs of `steps`, of fourth order in the steps."""
    own = values.reshape(len(h), 4, -1)
    weights = np.array([1.0, -8.0, 8.0, -1.0]) / 12
    return (np.einsum("s,psq->pq", weights, own) / h[:, None]).T
