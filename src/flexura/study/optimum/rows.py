"""Goals and limits as functions of what is asked of designs, and what becomes of them where frequencies coincide."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import NamedTuple, Protocol, Self

import numpy as np

from flexura.arrays import Array, Index
from flexura.duals import Dual
from flexura.errors import SolverError
from flexura.records import Latest
from flexura.structure import Plan
from flexura.study.questions import Formula, Pose, Quantity, Questions, by_members

NEIGHBOURS = 2
"""Frequencies beside one that is asked for which may coincide with it."""

MOST_VERSIONS = 512
"""Versions of a row at most; what would make more of them stands for itself."""

MOST_ROW_PARTS = 32
"""Parts of a row at most; what would have more of them stands for itself."""


class Point(NamedTuple):
    """Quantities (q,) of one design and their derivatives (q, P) in SI, at places `differenced` by differences; of
    frequencies that coincide `repeated` are groups, `directional` the derivatives (m, m, P) of the space of each."""

    value: Array
    slope: Array
    repeated: tuple[tuple[int, ...], ...] = ()
    directional: tuple[Array, ...] = ()
    differenced: tuple[int, ...] = ()


class Designs(Protocol):
    """What is known of designs: N values (N, q) with a reason for each that failed, and one design with slopes."""

    def values(self, x: Array) -> tuple[Array, Sequence[str]]:
        """Quantities (N, q) of designs (N, P), and why each has none, empty where it has."""
        ...

    def point(self, x: Array) -> Point:
        """Quantities and slopes of one design (P,). Raises FlexuraError when it fails."""
        ...


class Function(Protocol):
    """A function of quantities and its partial derivatives."""

    def value(self, quantities: Array) -> Array:
        """Values (...) at quantities (..., q)."""
        ...

    def slope(self, quantities: Array) -> Array:
        """Partial derivatives (q,) at quantities (q,)."""
        ...


class Frequency(NamedTuple):
    """A natural frequency that a row depends on: which it is of the `ascending` frequencies of its state, by their
    places among the quantities."""

    ascending: tuple[int, ...]
    number: int

    def beside(self, steps: int) -> int:
        """The place of the frequency so many numbers higher, or lower, as far as there are some."""
        return self.ascending[min(max(self.number + steps, 0), len(self.ascending) - 1)]


class Worst(NamedTuple):
    """A quantity that a row depends on, and that is the largest (`sign` 1) or the least (-1) of `parts`: places among
    the quantities."""

    place: int
    parts: tuple[int, ...]
    sign: float


class Version(NamedTuple):
    """A row that has to hold with quantities from `places` (q,) in the place of its own."""

    row: Row
    places: Index


@dataclass(frozen=True)
class Row:
    """A function less a `level`, over `scale`, at least 0 where it is a limit, made as large as can be where it is a
    goal; where it is the least of several, these are its `parts`."""

    function: Function
    scale: float = 1.0
    frequencies: tuple[Frequency, ...] = ()
    worsts: tuple[Worst, ...] = ()
    parts: tuple[Row, ...] = ()
    level: float = 0.0

    def above(self, level: float) -> Self:
        """The row less a level, over its scale."""
        parts = tuple(part.above(level) for part in self.parts)
        return replace(self, level=self.level + level * self.scale, parts=parts)

    def versions(self, quantities: Array) -> list[Version]:
        """Each version of the row that has to hold: those of its parts, or of itself, the row as it is first."""
        return [Version(part, places) for part in self.parts or (self,) for places in part._places(quantities)]

    def _places(self, quantities: Array) -> list[Index]:
        """Places (q,) of the quantities in each version.

        A frequency f_k that should be higher is the least of f_k, f_(k+1) ..., one that should be lower the greatest of
        f_k, f_(k-1) ...: each of them smooth where their order is not (bound formulation: Olhoff 1989, "Multicriterion
        structural optimization via bound formulation and mathematical programming"). So it is with the largest of
        several stresses: all of them are to be small.
        """
        same = np.arange(len(quantities), dtype=np.intp)
        if not (self.frequencies or self.worsts):
            return [same]
        slope = self.function.slope(quantities)
        moved = [*(frequency.beside(0) for frequency in self.frequencies), *(worst.place for worst in self.worsts)]
        choices = [
            tuple(frequency.beside(k if slope[frequency.beside(0)] > 0 else -k) for k in range(NEIGHBOURS + 1))
            for frequency in self.frequencies
        ]
        choices += [
            worst.parts if slope[worst.place] * worst.sign < 0 else (worst.place,) * len(worst.parts)
            for worst in self.worsts
        ]
        versions = []
        for chosen in product(*choices):
            versions.append(same.copy())
            versions[-1][moved] = chosen
        return versions

    def values(self, quantities: Array) -> Array:
        """The row (...), over its scale, at quantities (..., q)."""
        return (np.asarray(self.function.value(quantities)) - self.level) / self.scale

    def gradient(self, point: Point, places: Index) -> Array:
        """Derivatives (P,) of a version, with quantities from these places, by the variables."""
        return self.function.slope(point.value[places]) @ point.slope[places] / self.scale


@dataclass(frozen=True)
class FormulaSum:
    """A sum of formulas, each times a sign, as a function of all quantities, whose `places` are known by their text."""

    terms: tuple[tuple[float, Formula], ...]
    places: Mapping[str, int]

    def parts(self) -> list[FormulaSum]:
        """Functions of which this is the least."""
        parts = [[(sign, f) for f in formula.parts("min" if sign > 0 else "max")] for sign, formula in self.terms]
        return [replace(self, terms=terms) for terms in product(*parts)]

    @property
    def used(self) -> set[int]:
        """Places of the quantities that it depends on."""
        return {place for _, formula in self.terms for place in self._places(formula).values()}

    def _places(self, formula: Formula) -> dict[str, int]:
        return {quantity.text: self.places[quantity.text] for quantity in formula.quantities}

    def value(self, quantities: Array) -> Array:
        """Values (...), SI, at quantities (..., q)."""
        values = np.zeros(quantities.shape[:-1])
        for sign, formula in self.terms:
            known = {text: quantities[..., place] for text, place in self._places(formula).items()}
            values = values + sign * np.asarray(formula.evaluate(known))
        return values

    def slope(self, quantities: Array) -> Array:
        """Partial derivatives (q,) at quantities (q,)."""
        slope, eye = np.zeros(len(quantities)), np.eye(len(quantities))
        for sign, formula in self.terms:
            known = {text: Dual(quantities[place], eye[place]) for text, place in self._places(formula).items()}
            value = formula.evaluate(known)
            slope = slope + sign * value.slope if isinstance(value, Dual) else slope
        return slope


@dataclass(frozen=True)
class Wording:
    """What is asked of designs for formulas, and where each quantity stands; `ascending` are frequencies of one state
    each, as places; `parts` of `worsts` stand behind the questions."""

    questions: Questions
    places: Mapping[str, int]
    ascending: tuple[tuple[int, ...], ...]
    parts: tuple[Quantity, ...] = ()
    worsts: tuple[Worst, ...] = ()

    def function(self, *terms: tuple[float, Formula]) -> FormulaSum:
        """A sum of formulas, each times a sign, as a function of all quantities."""
        return FormulaSum(terms, self.places)

    def row(self, function: FormulaSum, scale: float = 1.0) -> Row:
        """A row of the function, with the parts that it is the least of, or the frequencies and the worst of several
        that it depends on."""
        parts = function.parts()
        if 1 < len(parts) <= MOST_ROW_PARTS:
            most = MOST_VERSIONS // len(parts)
            return Row(function, scale, parts=tuple(self._smooth(part, scale, most) for part in parts))
        return self._smooth(function, scale, MOST_VERSIONS)

    def _smooth(self, function: FormulaSum, scale: float, most: int) -> Row:
        """A row of one function with so many versions at most."""
        used = function.used
        frequencies = [Frequency(places, k) for places in self.ascending for k, p in enumerate(places) if p in used]
        room, worsts = most // (NEIGHBOURS + 1) ** len(frequencies), list[Worst]()
        for worst in self.worsts:
            if worst.place in used and len(worst.parts) <= room:
                worsts.append(worst)
                room //= len(worst.parts)
        return Row(function, scale, tuple(frequencies), tuple(worsts))

    @property
    def count(self) -> int:
        """How many quantities a point has."""
        return len(self.questions.quantities) + len(self.parts)

    def behind(self, count: int) -> Wording:
        """The same with all quantities behind so many others."""
        ascending = tuple(tuple(place + count for place in own) for own in self.ascending)
        worsts = tuple(
            own._replace(place=own.place + count, parts=tuple(part + count for part in own.parts))
            for own in self.worsts
        )
        places = {text: place + count for text, place in self.places.items()}
        return replace(self, places=places, ascending=ascending, worsts=worsts)


def wording(plan: Plan, formulas: Iterable[Formula]) -> Wording:
    """The questions that formulas need, with the frequencies beside those that they ask for by number, and the members
    that a stress is the largest of."""
    asked = {quantity.text: quantity for formula in formulas for quantity in formula.quantities}
    highest: dict[Pose, Quantity] = {}
    for quantity in asked.values():
        if (number := numbered(quantity)) is not None:
            before = highest.get(quantity.pose)
            highest[quantity.pose] = quantity if before is None or number > (numbered(before) or 0) else before
    ascending = list[list[str]]()
    for top in highest.values():
        last = min((numbered(top) or 0) + NEIGHBOURS, plan.topology.n_dof)
        beside = [replace(top, text=f"f{k}{top.where}", arguments=(k,)) for k in range(1, last + 1)]
        asked |= {own.text: own for own in beside if own.text not in asked}
        ascending.append([own.text for own in beside])
    texts, asked_of_all = list(asked), Questions(plan, tuple(asked.values()))
    places, parts, worsts = {text: k for k, text in enumerate(texts)}, list[Quantity](), list[Worst]()
    for quantity in asked_of_all.quantities:
        if len(members := by_members(plan, quantity)) > 1:
            first = len(texts) + len(parts)
            sign = 1 if quantity.kind == "stress" else -1
            worsts.append(Worst(places[quantity.text], tuple(range(first, first + len(members))), sign))
            parts += members
    ordered = tuple(tuple(places[text] for text in own) for own in ascending)
    return Wording(asked_of_all, places, ordered, tuple(parts), tuple(worsts))


def numbered(quantity: Quantity) -> int | None:
    """The number of a natural frequency that is asked for by it; None of anything else."""
    first = quantity.arguments[0] if quantity.arguments else None
    return first if quantity.kind == "f" and isinstance(first, int) else None


@dataclass(frozen=True)
class AskedDesigns:
    """Answers to what is asked where parameters `names` vary and those of `fixed` have values; of a point also of the
    parts of which some are the worst."""

    wording: Wording
    names: tuple[str, ...]
    fixed: Mapping[str, float]
    _latest: Latest[Point] = field(default_factory=Latest, compare=False)

    def values(self, x: Array) -> tuple[Array, Sequence[str]]:
        """Quantities (N, q) of designs (N, P), and why each has none, empty where it has."""
        designs = {name: x[:, k] for k, name in enumerate(self.names)}
        answers = self.wording.questions.values({**self.fixed, **designs})
        failed = ~np.isfinite(answers.value).all(axis=1)
        reasons = np.where(failed & (answers.reason == ""), "a quantity is not finite", answers.reason)
        return answers.value, list(np.where(failed, reasons, ""))

    def point(self, x: Array) -> Point:
        """Quantities and slopes of one design (P,), the latest kept. Raises FlexuraError when it fails."""
        return self._latest.get(x.tobytes(), lambda: self._point(x))

    def _point(self, x: Array) -> Point:
        asked = self.wording.questions
        whole = Questions(asked.plan, (*asked.quantities, *self.wording.parts))
        slopes = whole.slopes({**self.fixed, **dict(zip(self.names, map(float, x), strict=True))}, self.names)
        value, slope = slopes.value.copy(), slopes.slope.copy()
        for worst in self.wording.worsts:
            _stand_in(worst, value, slope)
        groups = [
            (group, matrices)
            for group, matrices in zip(slopes.repeated, slopes.directional, strict=True)
            if len(group) == len(matrices)
        ]
        for group, matrices in groups:  # the slopes along one parameter each are of other shapes for each
            slope[list(group)] = np.einsum("iip->ip", matrices)
        lost = dict[str, list[str]]()
        for k in np.flatnonzero(~(np.isfinite(value) & np.isfinite(slope).all(axis=1))):
            text = whole.quantities[k].text
            lost.setdefault(slopes.reason[k].removeprefix(f"{text}: ") or "it is not finite", []).append(text)
        if lost:
            raise SolverError("; ".join(f"{', '.join(texts)}: {why}" for why, texts in lost.items()))
        differenced = np.flatnonzero(~slopes.is_exact[: len(asked.quantities)])
        repeated, directional = tuple(group for group, _ in groups), tuple(matrices for _, matrices in groups)
        return Point(value, slope, repeated, directional, tuple(differenced.tolist()))


def _stand_in(worst: Worst, value: Array, slope: Array) -> None:
    """Parts that are nothing, as where no force goes, are as the worst; where that has no slope, since parts are alike,
    it has the slope of one of them."""
    parts = np.array(worst.parts)
    known = np.isfinite(value[parts]) & np.isfinite(slope[parts]).all(axis=1)
    if known.any():
        first = parts[known][np.argmax(worst.sign * value[parts[known]])]
        missing = np.isnan(slope[worst.place])
        slope[worst.place, missing] = slope[first, missing]
    value[parts[~known]], slope[parts[~known]] = value[worst.place], slope[worst.place]


@dataclass(frozen=True)
class BothDesigns:
    """Answers of two mechanisms to what each is asked, those of the second, whose parameters are among those of the
    first, behind the others."""

    first: AskedDesigns
    second: AskedDesigns

    def values(self, x: Array) -> tuple[Array, Sequence[str]]:
        """As `Designs.values`, with the parts of which some are the worst."""
        return np.array([self.point(own).value for own in x]), [""] * len(x)

    def point(self, x: Array) -> Point:
        """As `Designs.point`."""
        among = [self.first.names.index(name) for name in self.second.names]
        one, other = self.first.point(x), self.second.point(x[among])
        slope = np.zeros((len(other.value), len(x)))
        slope[:, among] = other.slope
        return one._replace(value=np.concatenate([one.value, other.value]), slope=np.concatenate([one.slope, slope]))
