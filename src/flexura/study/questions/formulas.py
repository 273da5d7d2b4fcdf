"""Formulas over asked names, and relations between them, with units.

A pose that a formula ends with holds for all names in it that have none of their own, as in
`stress(left) / 400 MPa + 2 * stress(right) / 400 MPa at stroke 2 mm`; elsewhere a pose belongs to the name before it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.duals import Dual
from flexura.errors import ExpressionError, OptionError
from flexura.expressions import NUMBER, Binary, Call, Dimension, Expression, Negative, Tree, parts_of
from flexura.expressions import format_tree as text_of
from flexura.full_order import plan_of
from flexura.mechanism import Mechanism
from flexura.records import Record
from flexura.structure import Plan
from flexura.study.questions.grammar import Where, names_in, trailing, with_fractions
from flexura.study.questions.kinds import WORST, Quantity, Worse, unit_of
from flexura.study.questions.questions import Questions
from flexura.study.questions.reading import Reader
from flexura.units import format_quantity, parse_quantity

_RELATION = re.compile(r"<=|>=|=<|=>|==|!=|<|>|≤|≥")
_SENSES = {"<=": 1, ">=": -1, "≤": 1, "≥": -1}


class Sloped(NamedTuple):
    """A number of one design, SI, and its derivatives `slope` (P,) by P parameters."""

    value: float
    slope: Array


class _Evaluated(Record):
    """What follows from what is asked of a design."""

    questions: Any

    def evaluate(self, values: Mapping[str, Any]) -> Any:
        """The number from the values of what is asked by text."""
        raise NotImplementedError

    def _values(self, parameters: Mapping[str, ArrayLike]) -> Array:
        """The number (designs,) of designs, SI; NaN where it cannot be worked out."""
        answers, quantities = self.questions.values(parameters), self.questions.quantities
        values = self.evaluate({quantity.text: answers.value[:, k] for k, quantity in enumerate(quantities)})
        return np.broadcast_to(np.asarray(values, dtype=float), answers.value.shape[:1]).copy()

    def slopes(self, parameters: Mapping[str, float], names: Sequence[str]) -> Sloped:
        """The number of one design with its derivatives by the parameters `names`, as `Questions.slopes`.

        Where `min` or `max` has the choice between equal numbers that part as a parameter moves, the derivative by it
        is NaN.
        """
        number = self.evaluate(self.questions.slopes(parameters, names).numbers)
        if isinstance(number, Dual):
            return Sloped(float(number.value), np.array(number.slope, dtype=float))
        return Sloped(float(number), np.zeros(len(names)))


@dataclass(frozen=True, repr=False)
class Formula(_Evaluated):
    """A number that follows from what is asked of a design: `text` as written, `questions` that it is made of, and
    physical dimension."""

    _shown = ("text",)

    text: str
    questions: Questions
    expression: Expression
    dimension: Dimension

    @property
    def unit(self) -> str:
        """SI unit."""
        return unit_of(self.dimension)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What is asked in it."""
        return self.questions.quantities

    @property
    def canonical(self) -> str:
        """Its text with names as they are shown."""
        return _shown(self.expression.tree, self.quantities)

    @property
    def is_worst(self) -> bool:
        """Whether it is the worst of a stroke, or of commands."""
        return len(self.quantities) == 1 and self.quantities[0].kind == WORST

    @property
    def is_constant(self) -> bool:
        """Whether it asks nothing."""
        return not self.quantities

    def parts(self, function: Literal["min", "max"]) -> list[Formula]:
        """Formulas of which this is the least (`min`) or the largest (`max`): itself alone where it is neither."""
        trees = parts_of(self.expression.tree, function)
        if len(trees) == 1:
            return [self]
        formulas = []
        for part in map(Expression, trees):
            used = [k for k in range(len(self.quantities)) if _placeholder(k) in part.names]
            questions = Questions(self.questions.plan, tuple(self.quantities[k] for k in used))
            renamed = part.renamed({_placeholder(k): _placeholder(number) for number, k in enumerate(used)})
            formulas.append(Formula(_shown(part.tree, self.quantities), questions, renamed, self.dimension))
        return formulas

    def evaluate(self, values: Mapping[str, Any]) -> Any:
        """The number from the values of what is asked by text, e.g. `f1`, SI: floats, arrays, or numbers with slopes.

        Nothing is proven of it, and it is NaN where one of them is.
        """
        named = {_placeholder(k): values[quantity.text] for k, quantity in enumerate(self.quantities)}
        with np.errstate(all="ignore"):
            return self._compiled(named)

    @cached_property
    def _compiled(self) -> Callable[[Mapping[str, Any]], Any]:
        return self.expression.compiled()

    def values(self, parameters: Mapping[str, ArrayLike]) -> Array:
        """The number (designs,) of designs, SI, as `Questions.values`; NaN where it cannot be worked out."""
        return self._values(parameters)


@dataclass(frozen=True, repr=False)
class Relation(_Evaluated):
    """That one formula is at most, or at least, another; `margin` is positive or zero where it is met.

    Margins are the difference of the sides over `scale`: the size of the side that asks nothing, or else that of the
    right side at the default parameters; 1 where that is zero.
    """

    _shown = ("text",)

    text: str
    left: Formula
    right: Formula
    sense: int = field(repr=False)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What is asked in it, each once."""
        return tuple(dict.fromkeys((*self.left.quantities, *self.right.quantities)))

    @property
    def canonical(self) -> str:
        """Its text with names as they are shown."""
        return f"{self.left.canonical} {'<=' if self.sense > 0 else '>='} {self.right.canonical}"

    @property
    def sides(self) -> tuple[Formula, Formula, bool]:
        """The side that is asked, the left one where both are, the other one, and whether it is to be below that."""
        is_left = not self.left.is_constant
        first, second = (self.left, self.right) if is_left else (self.right, self.left)
        return first, second, (self.sense > 0) is is_left

    @cached_property
    def questions(self) -> Questions:
        """The questions that it is made of."""
        return Questions(self.left.questions.plan, self.quantities)

    @cached_property
    def scale(self) -> float:
        """What margins are relative to, SI."""
        side = self.left if self.left.is_constant else self.right
        size = abs(float(side.values({})[0]))
        return size if np.isfinite(size) and size > 0 else 1.0

    def evaluate(self, values: Mapping[str, Any]) -> Any:
        """The margin from the values of what is asked, as `Formula.evaluate`."""
        return self.sense * (self.right.evaluate(values) - self.left.evaluate(values)) / self.scale

    def margin(self, parameters: Mapping[str, ArrayLike]) -> Array:
        """The margin (designs,) of designs, NaN where it cannot be worked out."""
        return self._values(parameters)


@verb
def formula(model: Mechanism | Plan, text: str) -> Formula:
    """A formula over what may be asked of a mechanism, with units, e.g. `f2 - f1` or `stress(left) / 400 MPa`.

    Raises OptionError for text that cannot be read, names that the mechanism lacks and dimensions that clash.
    """
    head, where = trailing(with_fractions(text))
    found = _formula(plan_of(model), head, text.strip(), where)
    return _worst(found, head, where.over, "larger") if where.over else found


@verb
def relation(model: Mechanism | Plan, text: str) -> Relation:
    """That a formula is at most or at least another, e.g. `stress(left) <= 400 MPa at platform.x = 2 mm`.

    Raises OptionError as `formula`, for no or several signs, and for sides of different dimensions.
    """
    head, where = trailing(with_fractions(text))
    signs = _RELATION.findall(re.sub(r"(?<![<>=!])=(?![<>=])", " ", head))
    if len(signs) != 1 or signs[0] not in _SENSES:
        form = "two relations" if len(signs) > 1 else "FORMULA <= FORMULA or FORMULA >= FORMULA"
        raise OptionError(f"{text.strip()!r} is no relation: write {form}, e.g. stress(left) <= 400 MPa")
    plan = plan_of(model)
    parts = head.split(signs[0])
    left, right = (_formula(plan, part, part.strip(), where) for part in parts)
    one, other = (side.expression.dimension(_dimensions(side.quantities)) for side in (left, right))
    if one is not None and other is not None and one != other:
        raise OptionError(
            f"{text.strip()!r}: both sides of a relation have one dimension;"
            f" {left.text} is {_in(left.dimension)} and {right.text} {_in(right.dimension)}"
        )
    if left.is_constant and right.is_constant:
        raise OptionError(f"{text.strip()!r} asks nothing: both sides are numbers")
    sense = _SENSES[signs[0]]
    if where.over:
        if not (left.is_constant or right.is_constant):
            left = _formula(plan, f"({parts[0]}) - ({parts[1]})", f"{left.text} - {right.text}", where)
            right = Formula("0", Questions(plan, ()), Expression.parse("0"), left.dimension)
        side: Worse = "larger" if (sense > 0) is right.is_constant else "smaller"
        left, right = (own if own.is_constant else _worst(own, own.text, where.over, side) for own in (left, right))
    return Relation(text.strip(), left, right, sense)


def _worst(of: Formula, text: str, over: str, worse: Worse) -> Formula:
    """The worst of a formula over a stroke, or all commands."""
    plan = of.questions.plan
    worst = Reader(plan).worst(text, of.quantities, of.evaluate, worse, over, of.unit)
    return Formula(worst.text, Questions(plan, (worst,)), Expression.parse(_placeholder(0)), of.dimension)


def _formula(plan: Plan, text: str, shown: str, where: Where) -> Formula:
    """The formula of a text without what it says at its end of where it is asked."""
    reader, quantities, written, last = Reader(plan), list[Quantity](), "", 0
    for span in names_in(text, reader.is_unit):
        quantity = reader.quantity(span.asked, where)
        if quantity not in quantities:
            quantities.append(quantity)
        written += f"{text[last : span.start]} {_placeholder(quantities.index(quantity))} "
        last = span.stop
    expression = None
    try:
        expression = Expression.parse(written + text[last:], _unit, reader.is_unit)
        dimension = expression.dimension(_dimensions(quantities))
    except ExpressionError as error:
        clash = "" if expression is None else _clash(expression.tree, quantities)
        raise OptionError(f"{shown!r}: {clash or error}") from None
    return Formula(shown, Questions(plan, tuple(quantities)), expression, NUMBER if dimension is None else dimension)


def _placeholder(number: int) -> str:
    return f"_{number}"


def _dimensions(quantities: Sequence[Quantity]) -> dict[str, Dimension | None]:
    return {_placeholder(k): quantity.dimension for k, quantity in enumerate(quantities)}


def _unit(number: str, text: str) -> tuple[float, Dimension]:
    return parse_quantity(f"{number} [{text}]")


def _clash(tree: Tree, quantities: Sequence[Quantity]) -> str:
    """The first sum, or comparison, of terms of different dimensions, in words; nothing where there is none."""
    pairs: tuple[Tree, ...] = ()
    match tree:
        case Negative(operand):
            return _clash(operand, quantities)
        case Binary(op, left, right):
            pairs = (left, right)
            joins = op in "+-"
        case Call(function, arguments):
            pairs, joins = arguments, function in ("min", "max", "atan2")
        case _:
            return ""
    for part in pairs:
        if found := _clash(part, quantities):
            return found
    if not joins:
        return ""
    known = _dimensions(quantities)
    sizes = [Expression(part).dimension(known) for part in pairs]
    if None in sizes or sizes[0] == sizes[1]:
        return ""
    terms = " and ".join(
        f"{_shown(part, quantities)} {_in(size)}" for part, size in zip(pairs, sizes, strict=True) if size
    )
    return f"terms of a sum, and what is compared, have one dimension; these are {terms}"


def _in(dimension: Dimension) -> str:
    return "without unit" if dimension == NUMBER else f"in {unit_of(dimension)}"


def _shown(tree: Tree, quantities: Sequence[Quantity]) -> str:
    """Text of a part of a formula."""
    names = {_placeholder(k): quantity.text for k, quantity in enumerate(quantities)}
    written = text_of(tree, lambda number: format_quantity(number.value, number.dimension or NUMBER))
    return re.sub(r"\b_\d+\b", lambda match: names.get(match[0], match[0]), written)
