"""What is asked of a mechanism beside the numbers that others give of it, as its description lists them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexura.analysis import interval_text
from flexura.arguments import verb
from flexura.arrays import Array, Bools
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import plan_of
from flexura.mechanism import Mechanism, PublishedValue, evaluated, with_rigid_bodies, with_rigid_roots
from flexura.results import Tabular
from flexura.structure import Plan, one_design
from flexura.study.questions import Formula, Margins, Questions, formula
from flexura.tables import Item, Table, percent, quantity

LONGEST_SOURCE = 400
"""Characters of a source as a reader sees it."""


@dataclass(frozen=True, repr=False)
class Published(Tabular):
    """What is asked of a mechanism, `value` (n,), beside what others give for it, `published` (n,), SI, in `units`.

    `within` (n,) is the largest relative difference that the description grants; a warning tells of each that is
    larger, and of numbers that could not be worked out, which are NaN. `margins` (n,) have the model error of each,
    worked out when first asked for. `notes` say what answers leave out, and where a
    name of what is asked is that of a parameter, too.
    """

    _shown = ("name", "asked")
    _told = (
        *("name", "asked", "units", "value", "published", "difference", "within", "is_met", "source"),
        *("model_error", "model_error_reason"),
    )

    name: str
    asked: tuple[str, ...]
    units: tuple[str, ...]
    value: Array
    published: Array
    within: Array
    source: tuple[str, ...]
    margins: tuple[Margins, ...]
    warnings: tuple[Diagnostic, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def difference(self) -> Array:
        """Relative differences (n,) of the mechanism from what is published."""
        return self.value / self.published - 1

    @property
    def is_met(self) -> Bools:
        """Which (n,) differ by no more than `within`."""
        return np.abs(self.difference) <= self.within

    @property
    def model_error(self) -> tuple[tuple[float, float] | None, ...]:
        """Where the part's values lie: between 1 + low and 1 + high times `value`; None where there is no evidence."""
        return tuple(margins.intervals[text] for margins, text in zip(self.margins, self.asked, strict=True))

    @property
    def model_error_reason(self) -> tuple[str, ...]:
        """Why a number has no model error; empty where it has."""
        return tuple(margins.reasons.get(text, "") for margins, text in zip(self.margins, self.asked, strict=True))

    @property
    def cells(self) -> dict[str, tuple[str, ...]]:
        """Columns of text for readers, with units."""

        def with_units(values: Array) -> tuple[str, ...]:
            return tuple(quantity(x, unit) for x, unit in zip(values.tolist(), self.units, strict=True))

        return {
            "quantity": self.asked,
            "here": with_units(self.value),
            "published": with_units(self.published),
            "difference": tuple(map(percent, self.difference.tolist())),
            "within": tuple(map(percent, self.within.tolist())),
            "model error": tuple(map(interval_text, self.model_error)),
            "source": self.source,
        }

    def presentation(self) -> Iterator[Item]:
        yield Table(self.cells, longest=LONGEST_SOURCE)

    def _columns(self) -> dict[str, Any]:
        """A row for each number."""
        return {
            "asked": self.asked,
            "unit": self.units,
            "value [SI]": self.value,
            "published [SI]": self.published,
            "difference [1]": self.difference,
            "within [1]": self.within,
            "source": self.source,
        }


@verb
def published(model: Mechanism | Plan, parameters: Mapping[str, float] | None = None) -> Published:
    """What `published` of the description asks of the mechanism, beside the numbers that others give for it.

    Numbers hold at the parameters that their source had, as a rule the defaults of the description; closed forms over
    parameters follow these. Raises OptionError where the description has none, for what cannot be asked, for sides of
    different dimensions and numbers that are zero, and ModelError.
    """
    plan = plan_of(model, parameters)
    listed = plan.mechanism.published
    if not listed:
        raise OptionError(
            "the description has no `published` numbers; e.g. published: [{ask: f1, value: 55 Hz, source: ...}]"
        )
    at = one_design(parameters)
    pairs = [_pair(plan, entry, k) for k, entry in enumerate(listed)]
    here, given = np.empty((2, len(listed)))
    reasons, notes, margins = [""] * len(listed), list[str](), dict[str, Margins]()
    for root in dict.fromkeys(entry.root for entry in listed):
        of_root = (
            plan if root == "elastic" else plan_of(with_rigid_bodies(with_rigid_roots(plan.mechanism)), parameters)
        )
        numbers = [k for k, entry in enumerate(listed) if entry.root == root]
        asked = tuple(dict.fromkeys(quantity for k in numbers for side in pairs[k] for quantity in side.quantities))
        questions = Questions(of_root, asked)
        answers = questions.values(at)
        known = {quantity.text: answers.value[0, k] for k, quantity in enumerate(asked)}
        for k in numbers:
            here[k], given[k] = (float(side.evaluate(known)) for side in pairs[k])
            reasons[k] = str(answers.reason[0])
        margins[root] = Margins(of_root, at, (), "", [pairs[k][0] for k in numbers], known)
        notes += questions.notes
    for k, number in enumerate(given.tolist()):
        if not number:
            raise OptionError(f"published[{k}] {listed[k].value!r}: a number that is zero has no relative difference")
    values = {name: float(value) for name, value in plan.parameter_values(at).items()}
    result = Published(
        name=plan.mechanism.name,
        asked=tuple(entry.ask for entry in listed),
        units=tuple(left.unit for left, _ in pairs),
        value=here,
        published=given,
        within=np.array([evaluated(entry, values).within for entry in listed], dtype=float),
        source=tuple(entry.source for entry in listed),
        margins=tuple(margins[entry.root] for entry in listed),
        notes=tuple(dict.fromkeys(notes)),
    )
    return replace(result, warnings=tuple(_misfits(result, reasons)))


def _pair(plan: Plan, entry: PublishedValue, number: int) -> tuple[Formula, Formula]:
    """What is asked, and what is given for it."""
    left, right = formula(plan, entry.ask), formula(plan, entry.value)
    if left.is_constant:
        raise OptionError(f"published[{number}] {entry.ask!r} is no quantity of the mechanism, e.g. ask: f1")
    if left.dimension != right.dimension:
        raise OptionError(
            f"published[{number}]: {entry.ask!r} is in {left.unit or '1'},"
            f" and its value {entry.value!r} in {right.unit or '1'}"
        )
    return left, right


def _misfits(result: Published, reasons: Sequence[str]) -> Iterator[Diagnostic]:
    """What differs by more than it may, and what has no number."""
    numbers = zip(result.difference.tolist(), result.within.tolist(), strict=True)
    for text, source, reason, (difference, most) in zip(result.asked, result.source, reasons, numbers, strict=True):
        if not np.isfinite(difference):
            yield Diagnostic("misfit", text, difference, most, "1", reason or f"{text} has no number")
        elif abs(difference) > most:
            words = f"{text} differs by {percent(difference)}, more than {percent(most)}, from {source}"
            yield Diagnostic("misfit", text, abs(difference), most, "1", words)
