"""Goals and limits in the user's words, as functions of the quantities that are asked of designs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.duals import Dual
from flexura.structure import Plan
from flexura.study.optimum.rows import NEIGHBOURS, Frequency, Point, Row
from flexura.study.questions import Formula, Quantity, Questions, questions

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Combined:
    """A formula times a `sign`, as a function of all quantities, of which its own are at `places`, by their text."""

    formula: Formula
    places: Mapping[str, int]
    sign: float = 1.0

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

    def value(self, quantities: Array) -> Array:
        """Values (...), SI, at quantities (..., q)."""
        return self.first.value(quantities) - self.second.value(quantities)

    def slope(self, quantities: Array) -> Array:
        """Partial derivatives (q,) at quantities (q,)."""
        return self.first.slope(quantities) - self.second.slope(quantities)


@dataclass(frozen=True)
class AskedDesigns:
    """Answers of `questions` where parameters `names` vary and those of `fixed` have values."""

    questions: Questions
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
        found = self.questions.slopes({**self.fixed, **dict(zip(self.names, map(float, x), strict=True))}, self.names)
        slope = found.slope.copy()
        whole = [k for k, own in enumerate(found.repeated) if len(own) == len(found.directional[k])]
        for k in whole:  # of a group the slopes along one parameter each are of other shapes for each
            slope[list(found.repeated[k])] = np.einsum("iip->ip", found.directional[k])
        repeated, spaces = tuple(found.repeated[k] for k in whole), tuple(found.directional[k] for k in whole)
        return Point(found.value, slope, repeated, spaces, tuple(np.flatnonzero(~found.is_exact).tolist()))


@dataclass(frozen=True)
class Wording:
    """What is asked of designs for formulas, and where each quantity stands; `ladders` are ascending frequencies of one
    state each, as places."""

    questions: Questions
    place: Mapping[str, int]
    ladders: tuple[tuple[int, ...], ...]

    def combined(self, formula: Formula, sign: float = 1.0) -> Combined:
        """A formula as a function of all quantities."""
        return Combined(formula, {own.text: self.place[own.text] for own in formula.quantities}, sign)

    def row(self, function: Combined | Difference, scale: float = 1.0) -> Row:
        """A row of the function, with the frequencies that it depends on."""
        own = (function,) if isinstance(function, Combined) else (function.first, function.second)
        used = {place for part in own for place in part.places.values()}
        frequencies = [Frequency(ladder, k) for ladder in self.ladders for k, p in enumerate(ladder) if p in used]
        return Row(function, scale, tuple(frequencies))


def wording(plan: Plan, formulas: Iterable[Formula]) -> Wording:
    """The questions that formulas need, with the frequencies beside those that they ask for by number."""
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
    return Wording(found, {text: k for k, text in enumerate(texts)}, tuple(ladders))


def numbered(quantity: Quantity) -> int | None:
    """The number of a natural frequency that is asked for by it; None of anything else."""
    first = quantity.arguments[0] if quantity.arguments else None
    return first if quantity.kind == "f" and isinstance(first, int) else None
