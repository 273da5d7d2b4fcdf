"""Expressions over named parameters: built in Python or read from text, evaluated over a design axis."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.arguments import verb
from flexura.errors import ExpressionError
from flexura.expressions.dimension import Dimension
from flexura.expressions.parser import UnitReader, parsed
from flexura.expressions.tree import (
    CONSTANTS,
    Binary,
    Name,
    Negative,
    Number,
    Tree,
    Value,
    checked,
    compiled,
    dimension_of,
    format_tree,
    names_in,
    substituted,
)


@dataclass(frozen=True)
class Expression:
    """A number that depends on parameters. Build it with `parameter("t") / 2` or `Expression.parse("t/2")`."""

    tree: Tree

    def __post_init__(self) -> None:
        if not isinstance(self.tree, Tree):
            raise ExpressionError(
                "this is no expression", hint=f"Expression.parse({str(self.tree)!r}) reads one from text"
            )

    @staticmethod
    def parse(
        text: str, unit: UnitReader | None = None, is_unit: Callable[[str], bool] = lambda _: False
    ) -> Expression:
        """Read an expression; `unit` reads the units of its literals (None: units are refused, numbers are SI), and
        `is_unit` says of a name whether it is a unit and nothing else.

        Raises ExpressionError with the rule that was broken.
        """
        return Expression(checked(parsed(text, unit, is_unit)))

    @property
    def names(self) -> frozenset[str]:
        """Names of the parameters it depends on."""
        return frozenset(names_in(self.tree)) - CONSTANTS.keys()

    def evaluate(self, values: Mapping[str, Value]) -> Value:
        """Value in SI for parameter values that are floats or arrays sharing a design axis.

        Raises ExpressionError when a parameter is missing.
        """
        return self.compiled()(values)

    def compiled(self) -> Callable[[Mapping[str, Value]], Value]:
        """The expression as a function of the parameter values, for repeated evaluation."""
        return compiled(self.tree)

    def dimension(self, of: Mapping[str, Dimension | None]) -> Dimension | None:
        """Physical dimension, given those of the parameters; None where a bare Python number leaves it open.

        Raises ExpressionError where dimensions clash.
        """
        return dimension_of(self.tree, of)

    def renamed(self, names: Mapping[str, str]) -> Expression:
        """The same expression with other names for some parameters."""
        return self.substituted({name: Expression(Name(other)) for name, other in names.items()})

    def substituted(self, values: Mapping[str, float | Expression]) -> Expression:
        """The same expression with numbers in SI and expressions in the place of some parameters."""
        if self.names.isdisjoint(values):
            return self
        return Expression(substituted(self.tree, {name: _tree(value) for name, value in values.items()}))

    def __add__(self, other: Any) -> Expression:
        return Expression(Binary("+", self.tree, _tree(other)))

    def __radd__(self, other: Any) -> Expression:
        return Expression(Binary("+", _tree(other), self.tree))

    def __sub__(self, other: Any) -> Expression:
        return Expression(Binary("-", self.tree, _tree(other)))

    def __rsub__(self, other: Any) -> Expression:
        return Expression(Binary("-", _tree(other), self.tree))

    def __mul__(self, other: Any) -> Expression:
        return Expression(Binary("*", self.tree, _tree(other)))

    def __rmul__(self, other: Any) -> Expression:
        return Expression(Binary("*", _tree(other), self.tree))

    def __truediv__(self, other: Any) -> Expression:
        return Expression(Binary("/", self.tree, _tree(other)))

    def __rtruediv__(self, other: Any) -> Expression:
        return Expression(Binary("/", _tree(other), self.tree))

    def __pow__(self, other: Any) -> Expression:
        return Expression(Binary("^", self.tree, _tree(other)))

    def __neg__(self) -> Expression:
        return Expression(Negative(self.tree))

    def __str__(self) -> str:
        return format_tree(self.tree)


_ZERO = Number(0.0)


class Folded(float):
    """The number that an expression without parameters comes to, which remembers the expression."""

    tree: Tree

    def __new__(cls, value: float, tree: Tree = _ZERO) -> Folded:
        """The value with its tree."""
        self = super().__new__(cls, value)
        self.tree = tree
        return self


@verb
def parameter(name: str) -> Expression:
    """Refer to a parameter by name, to be joined with + - * / ** into expressions; ExpressionError for no text."""
    if not isinstance(name, str):
        raise ExpressionError(f"the name of a parameter is text, not {type(name).__name__}")
    return Expression(Name(name))


def _tree(value: Any) -> Tree:
    if isinstance(value, Expression):
        return value.tree
    if isinstance(value, int | float | np.floating | np.integer) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        return Negative(Number(-number)) if math.copysign(1.0, number) < 0 else Number(number)
    raise ExpressionError(f"{value!r} cannot stand in an expression", "use numbers and parameters")
