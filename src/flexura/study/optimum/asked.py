"""Goals and limits in the user's words, as functions of the quantities that are asked of designs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexura.arrays import Array
from flexura.duals import Dual
from flexura.errors import SolverError
from flexura.structure import Plan
from flexura.study.optimum.rows import NEIGHBOURS, VERSIONS, Frequency, Point, Row, Worst
from flexura.study.questions import Formula, Quantity, Questions, by_members, questions

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
