"""Numbers with units in a model file: the reader that the description is validated with."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from flexura.errors import ExpressionError
from flexura.expressions import CONSTANTS, FREQUENCY, FUNCTIONS, NUMBER, Dimension, Expression
from flexura.mechanism import Quantity, Scalar, suggestion
from flexura.units import FAMILIAR, customary_unit, is_unit, parse_quantity

_LITERAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)", re.ASCII | re.DOTALL)
_FACTOR = r"[A-Za-zµμ°%]+(?:\s*(?:\^|\*\*)\s*(?:-?\d+|\(-?\d+(?:/\d+)?\)))?"
_PRODUCT = re.compile(rf"{_FACTOR}(?:\s*[*/]\s*(?:{_FACTOR}|\({_FACTOR}(?:\s*[*/]\s*{_FACTOR})*\)))*")
_BRACKETED = re.compile(r"\[[^\[\]]*\]")
_TURNS = re.compile(r"rad|deg|rpm|turn|rev")
_IDENTIFIER = re.compile(r"[^\W\d]\w*")


class QuantityReader:
    """Reads `0.3 mm`, `2*t + 1 mm` or the name of a parameter where a quantity is due.

    `dimensions` holds the declared parameters, with None for a dimension that is not known.
    """

    def __init__(self, dimensions: Mapping[str, Dimension | None]) -> None:
        self.dimensions = dimensions

    def __call__(self, raw: Any, quantity: Quantity) -> Scalar:
        """Read one value and check a literal's dimension; raises ExpressionError."""
        if isinstance(raw, Expression):
            return raw
        if isinstance(raw, str):
            return self.text(raw, quantity)
        if isinstance(raw, bool) or not isinstance(raw, int | float):
            raise ExpressionError(f"{quantity.a_kind} is expected here", f"write it like {quantity.example}")
        return self.bare(raw, quantity)

    def bare(self, raw: float, quantity: Quantity) -> float:
        """A number without a unit, which only pure numbers are; zero is zero in every unit."""
        try:
            value = float(raw)
        except OverflowError:
            value = math.inf
        if not math.isfinite(value):
            raise ExpressionError(f"{quantity.a_kind} must be finite")
        if value != 0 and (quantity.angle or quantity.dimension not in (None, NUMBER)):
            unit = quantity.example.partition(" ")[2]
            raise ExpressionError(f"{quantity.a_kind} carries a unit", f"write {value:g} {unit}")
        return value

    def text(self, raw: str, quantity: Quantity) -> Scalar:
        """A literal, or an expression over parameters."""
        literal = self.literal(raw)
        if literal is None:
            return self.expression(raw, quantity)
        value, dimension = literal
        if quantity.dimension == FREQUENCY and _TURNS.search(raw):
            raise ExpressionError("a frequency is in Hz here, not in rad/s or rpm", "divide rad/s by 2 pi")
        if dimension == NUMBER and _is_bare(raw):
            return self.bare(value, quantity)
        if quantity.dimension not in (None, dimension):
            unit = dimension.unit() or "a pure number"
            rule = f"{quantity.a_kind} is expected here, in {_expected(quantity)}; this is in {unit}"
            raise ExpressionError(rule, f"e.g. {quantity.example}")
        return value

    def literal(self, raw: str) -> tuple[float, Dimension] | None:
        """Value and dimension of a number followed by a unit; None when the text is not that.

        Raises ExpressionError when it looks like one, but the unit does not exist.
        """
        match = _LITERAL.fullmatch(raw.strip())
        if match is None:
            return None
        unit = match[2]
        if unit and not _BRACKETED.fullmatch(unit):
            first, *others = _IDENTIFIER.findall(unit) or [unit]
            meaningful = [name for name in others if self.is_declared(name)]
            if not _PRODUCT.fullmatch(unit) or (meaningful and self.is_expression(raw, meaningful == others)):
                return None
            self.explain(first)
            if meaningful and not is_unit(unit):
                return None
            self.known(others)
        return parse_quantity(raw)

    def is_expression(self, raw: str, otherwise: bool) -> bool:
        """Whether parameters are all that is named in a text beside units; `otherwise` where it cannot be read."""
        try:
            names = Expression.parse(raw, lambda *_: (0.0, NUMBER), self.is_unit).names
        except ExpressionError:
            return otherwise
        return all(map(self.is_declared, names))

    def is_unit(self, name: str) -> bool:
        """Whether a name is a unit and nothing else."""
        return not self.is_declared(name) and is_unit(name)

    def known(self, names: list[str]) -> None:
        """Refuse what might be a unit or a parameter, but is neither."""
        for name in names:
            if not is_unit(name):
                hint = suggestion(name, [*self.dimensions, *FAMILIAR], "known")
                raise ExpressionError(f"{name} is neither a unit nor a parameter", hint)

    def is_declared(self, name: str) -> bool:
        """Whether a name means something in an expression."""
        return name in self.dimensions or name in CONSTANTS or name in FUNCTIONS

    def explain(self, name: str) -> None:
        """Say more about a parameter or a constant that stands where a unit should."""
        if name in CONSTANTS:
            raise ExpressionError(f"{name} is a number, not a unit", f"join it with an operator, e.g. 2*{name}")
        if name in self.dimensions and not is_unit(name):
            rule = f"{name} is a parameter, not a unit"
            raise ExpressionError(rule, f"join it with an operator, e.g. 2*{name}")

    def expression(self, raw: str, quantity: Quantity) -> Scalar:
        """An expression whose literals carry units."""
        units: list[str] = []

        def unit(number: str, text: str) -> tuple[float, Dimension]:
            units.append(text)
            self.explain(text)
            return parse_quantity(f"{number} [{text}]")

        expression = Expression.parse(raw, unit, self.is_unit)
        literal = self.as_literal(raw, expression, quantity)
        if literal is not None:
            return literal
        if quantity.angle and not units and not _IDENTIFIER.search(raw):
            raise ExpressionError("an angle carries a unit", f"write it like {quantity.example}")
        if not expression.names:
            self.same_dimension(expression, quantity)
        return expression

    def same_dimension(self, expression: Expression, quantity: Quantity) -> None:
        """Check the dimension of an expression without parameters, which is about to become a number."""
        dimension = expression.dimension({})
        if quantity.dimension is not None and dimension not in (None, quantity.dimension):
            unit = dimension.unit() or "a pure number"
            rule = f"{quantity.a_kind} is expected here, in {_expected(quantity)}; this is in {unit}"
            raise ExpressionError(rule, f"e.g. {quantity.example}")

    def as_literal(self, raw: str, expression: Expression, quantity: Quantity) -> float | None:
        """Value of `2810 kg/m^3` where m is a parameter too, but only the unit gives the dimension expected."""
        try:
            value, dimension = parse_quantity(raw)
            if dimension != quantity.dimension:
                return None
        except ExpressionError:
            return None
        with suppress(ExpressionError):
            if expression.dimension(self.dimensions) in (None, quantity.dimension):
                return None
        return value


def _is_bare(raw: str) -> bool:
    match = _LITERAL.fullmatch(raw.strip())
    return match is not None and not match[2]


def _expected(quantity: Quantity) -> str:
    if quantity.angle:
        return "deg or rad"
    if quantity.dimension is None:
        return "1 (a pure number)"
    return customary_unit(quantity.dimension) or quantity.dimension.unit() or "1 (a pure number)"
