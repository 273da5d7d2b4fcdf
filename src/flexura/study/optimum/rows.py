"""Goals and limits as functions of what is asked of designs, and what becomes of them where frequencies coincide."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.duals import Dual
from flexura.errors import SolverError
from flexura.structure import Plan
from flexura.study.questions import Formula, Quantity, Questions, by_members, questions

Places = NDArray[np.intp]

NEIGHBOURS = 2
"""Frequencies beside one that is asked for which may coincide with it."""

VERSIONS = 512
"""Versions of a row at most; what would make more of them stands for itself."""


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
    """A natural frequency that a row depends on: its place in the ascending frequencies of its state, the `ladder`, as
    places among the quantities."""

    ladder: tuple[int, ...]
    rung: int

    def beside(self, steps: int) -> int:
        """The place of the frequency so many rungs above, or below, as far as the ladder goes."""
        return self.ladder[min(max(self.rung + steps, 0), len(self.ladder) - 1)]


class Worst(NamedTuple):
    """A quantity that a row depends on, and that is the largest (`sign` 1) or the least (-1) of `parts`: places among
    the quantities."""

    place: int
    parts: tuple[int, ...]
    sign: float


@dataclass(frozen=True)
class Above:
    """A function less a `level`."""

    function: Function
    level: float

    def value(self, quantities: Array) -> Array:
        """Values (...) at quantities (..., q)."""
        return np.asarray(self.function.value(quantities)) - self.level

    def slope(self, quantities: Array) -> Array:
        """Partial derivatives (q,) at quantities (q,)."""
        return self.function.slope(quantities)


class Version(NamedTuple):
    """A row that has to hold with quantities from `places` (q,) in the place of its own."""

    row: Row
    places: Places


@dataclass(frozen=True)
class Row:
    """A function over `scale`, at least 0 where it is a limit, made as large as can be where it is a goal; where it is
    the least of several, these are its `parts`."""

    function: Function
    scale: float = 1.0
    frequencies: tuple[Frequency, ...] = ()
    worsts: tuple[Worst, ...] = ()
    parts: tuple[Row, ...] = ()

    def above(self, level: float) -> Self:
        """The row less a level, over its scale."""
        function = Above(self.function, level * self.scale)
        return replace(self, function=function, parts=tuple(own.above(level) for own in self.parts))

    def versions(self, quantities: Array) -> list[Version]:
        """Each version of the row that has to hold: those of its parts, or of itself, the row as it is first."""
        return [Version(own, places) for own in self.parts or (self,) for places in own._places(quantities)]

    def _places(self, quantities: Array) -> list[Places]:
        """Places (q,) of the quantities in each version.

        A frequency f_k that should be higher is the least of f_k, f_(k+1) ..., one that should be lower the greatest of
        f_k, f_(k-1) ...: each of them smooth where their order is not (bound formulation: Olhoff 1989, "Multicriterion
        structural optimization via bound formulation and mathematical programming"). So it is with the largest of
        several stresses: all of them are to be small.
        """
        if not (self.frequencies or self.worsts):
            return [np.arange(len(quantities), dtype=np.intp)]
        slope = self.function.slope(quantities)
        rungs = [own.beside(0) for own in self.frequencies]
        steps = range(NEIGHBOURS + 1)
        choices = [
            tuple(own.beside(step if slope[rung] > 0 else -step) for step in steps)
            for own, rung in zip(self.frequencies, rungs, strict=True)
        ]
        choices += [
            own.parts if slope[own.place] * own.sign < 0 else (own.place,) * len(own.parts) for own in self.worsts
        ]
        found = []
        for chosen in product(*choices):
            places = np.arange(len(quantities), dtype=np.intp)
            places[[*rungs, *(own.place for own in self.worsts)]] = chosen
            found.append(places)
        return found

    def values(self, quantities: Array) -> Array:
        """The row (...), over its scale, at quantities (..., q)."""
        return np.asarray(self.function.value(quantities)) / self.scale

    def gradient(self, point: Point, places: Places) -> Array:
        """Derivatives (P,) of a version, with quantities from these places, by the variables."""
        return self.function.slope(point.value[places]) @ point.slope[places] / self.scale


PARTS = 32
"""Parts of a row at most; what would have more of them stands for itself."""


@dataclass(frozen=True)
class Combined:
    """A formula times a `sign`, as a function of all quantities, of which its own are at `places`, by their text."""

    formula: Formula
    places: Mapping[str, int]
    sign: float = 1.0

    def parts(self) -> list[Combined]:
        """Functions of which this is the least."""
        return [
            replace(self, formula=own, places={asked.text: self.places[asked.text] for asked in own.quantities})
            for own in self.formula.parts("min" if self.sign > 0 else "max")
        ]

    def value(self, quantities: Array) -> Array:
        """Values (...), SI, at quantities (..., q)."""
        own = {text: quantities[..., place] for text, place in self.places.items()}
        return self.sign * np.broadcast_to(np.asarray(self.formula.evaluate(own)), quantities.shape[:-1])

    def slope(self, quantities: Array) -> Array:
        """Partial derivatives (q,) at quantities (q,)."""
        eye = np.eye(len(quantities))
        own = {text: Dual(quantities[place], eye[place]) for text, place in self.places.items()}
        found = self.formula.evaluate(own)
        return self.sign * found.slope if isinstance(found, Dual) else np.zeros(len(quantities))


@dataclass(frozen=True)
class Difference:
    """One function less another."""

    first: Combined
    second: Combined

    def parts(self) -> list[Difference]:
        """Functions of which this is the least."""
        less = [replace(own, sign=-own.sign) for own in replace(self.second, sign=-self.second.sign).parts()]
        return [Difference(own, other) for own in self.first.parts() for other in less]

    def value(self, quantities: Array) -> Array:
        """Values (...), SI, at quantities (..., q)."""
        return self.first.value(quantities) - self.second.value(quantities)

    def slope(self, quantities: Array) -> Array:
        """Partial derivatives (q,) at quantities (q,)."""
        return self.first.slope(quantities) - self.second.slope(quantities)


@dataclass(frozen=True)
class AskedDesigns:
    """Answers of `questions` where parameters `names` vary and those of `fixed` have values; of a point also those of
    the `parts` of `worsts`, which stand behind."""

    questions: Questions
    parts: tuple[Quantity, ...]
    worsts: tuple[Worst, ...]
    names: tuple[str, ...]
    fixed: Mapping[str, float]

    def values(self, x: Array) -> tuple[Array, Sequence[str]]:
        """Quantities (N, q) of designs (N, P), and why each has none, empty where it has."""
        answers = self.questions.values({**self.fixed, **{name: x[:, k] for k, name in enumerate(self.names)}})
        failed = ~np.isfinite(answers.value).all(axis=1)
        words = np.where(failed & (answers.reason == ""), "a quantity is not finite", answers.reason)
        return answers.value, list(np.where(failed, words, ""))

    def point(self, x: Array) -> Point:
        """Quantities and slopes of one design (P,). Raises FlexuraError when it fails."""
        own = Questions(self.questions.plan, (*self.questions.quantities, *self.parts))
        found = own.slopes({**self.fixed, **dict(zip(self.names, map(float, x), strict=True))}, self.names)
        value, slope = found.value.copy(), found.slope.copy()
        for worst in self.worsts:
            _stand_in(worst, value, slope)
        whole = [k for k, own in enumerate(found.repeated) if len(own) == len(found.directional[k])]
        for k in whole:  # of a group the slopes along one parameter each are of other shapes for each
            slope[list(found.repeated[k])] = np.einsum("iip->ip", found.directional[k])
        repeated, spaces = tuple(found.repeated[k] for k in whole), tuple(found.directional[k] for k in whole)
        lost = dict[str, list[str]]()
        for k in np.flatnonzero(~(np.isfinite(value) & np.isfinite(slope).all(axis=1))):
            text = own.quantities[k].text
            lost.setdefault(found.reason[k].removeprefix(f"{text}: ") or "it is not finite", []).append(text)
        if lost:
            raise SolverError("; ".join(f"{', '.join(texts)}: {why}" for why, texts in lost.items()))
        differenced = np.flatnonzero(~found.is_exact[: len(self.questions.quantities)])
        return Point(value, slope, repeated, spaces, tuple(differenced.tolist()))


def _stand_in(worst: Worst, value: Array, slope: Array) -> None:
    """Parts that are nothing, as where no force goes, are as the worst; where that has no slope, since parts are alike,
    it has the slope of one of them."""
    parts = np.array(worst.parts)
    known = np.isfinite(value[parts]) & np.isfinite(slope[parts]).all(axis=1)
    if known.any():
        first = parts[known][np.argmax(worst.sign * value[parts[known]])]
        still = np.isnan(slope[worst.place])
        slope[worst.place, still] = slope[first, still]
    value[parts[~known]], slope[parts[~known]] = value[worst.place], slope[worst.place]


@dataclass(frozen=True)
class Wording:
    """What is asked of designs for formulas, and where each quantity stands; `ladders` are ascending frequencies of one
    state each, as places; `parts` of `worsts` stand behind the questions."""

    questions: Questions
    place: Mapping[str, int]
    ladders: tuple[tuple[int, ...], ...]
    parts: tuple[Quantity, ...] = ()
    worsts: tuple[Worst, ...] = ()

    def combined(self, formula: Formula, sign: float = 1.0) -> Combined:
        """A formula as a function of all quantities."""
        return Combined(formula, {own.text: self.place[own.text] for own in formula.quantities}, sign)

    def row(self, function: Combined | Difference, scale: float = 1.0) -> Row:
        """A row of the function, with the parts that it is the least of, or the frequencies and the worst of several
        that it depends on."""
        parts = function.parts()
        if 1 < len(parts) <= PARTS:
            return Row(function, scale, parts=tuple(self._smooth(own, scale, VERSIONS // len(parts)) for own in parts))
        return self._smooth(function, scale, VERSIONS)

    def _smooth(self, function: Combined | Difference, scale: float, most: int) -> Row:
        """A row of one function with so many versions at most."""
        own = (function,) if isinstance(function, Combined) else (function.first, function.second)
        used = {place for part in own for place in part.places.values()}
        frequencies = [Frequency(ladder, k) for ladder in self.ladders for k, p in enumerate(ladder) if p in used]
        room, worsts = most // (NEIGHBOURS + 1) ** len(frequencies), list[Worst]()
        for worst in self.worsts:
            if worst.place in used and len(worst.parts) <= room:
                worsts.append(worst)
                room //= len(worst.parts)
        return Row(function, scale, tuple(frequencies), tuple(worsts))


def wording(plan: Plan, formulas: Iterable[Formula]) -> Wording:
    """The questions that formulas need, with the frequencies beside those that they ask for by number, and the members
    that a stress is the largest of."""
    asked: dict[str, Quantity] = {own.text: own for formula in formulas for own in formula.quantities}
    highest: dict[str, int] = {}
    for own in asked.values():
        if (number := numbered(own)) is not None:
            tail = own.text.partition(" ")[2]
            highest[tail] = max(highest.get(tail, 0), number)
    texts, ladders = list(asked), []
    most = plan.topology.n_dof
    for tail, top in highest.items():
        names = [f"f{k} {tail}".strip() for k in range(1, min(top + NEIGHBOURS, most) + 1)]
        texts += [name for name in names if name not in texts]
        ladders.append(tuple(texts.index(name) for name in names))
    found = questions(plan, texts)
    place, parts, worsts = {text: k for k, text in enumerate(texts)}, list[Quantity](), list[Worst]()
    for own in found.quantities:
        if len(members := by_members(plan, own)) > 1:
            at = len(texts) + len(parts)
            worsts.append(
                Worst(place[own.text], tuple(range(at, at + len(members))), 1 if own.kind == "stress" else -1)
            )
            parts += members
    return Wording(found, place, tuple(ladders), tuple(parts), tuple(worsts))


def numbered(quantity: Quantity) -> int | None:
    """The number of a natural frequency that is asked for by it; None of anything else."""
    first = quantity.arguments[0] if quantity.arguments else None
    return first if quantity.kind == "f" and isinstance(first, int) else None
