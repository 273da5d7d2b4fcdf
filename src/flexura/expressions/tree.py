"""Trees of which expressions are made: their names, values, dimensions and text."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Literal

import numpy as np

from flexura.errors import ExpressionError
from flexura.expressions.dimension import NUMBER, Dimension

Value = Any
"""A float, or an array whose leading axis counts designs."""

MAX_TREE_DEPTH = 200
MOST_PARTS = 256
"""Parts of a minimum or maximum at most; what would have more of them is one."""
NAME = re.compile(r"[^\W\d]\w*")

FUNCTIONS: dict[str, tuple[Callable[..., Value], int]] = {
    "sqrt": (np.sqrt, 1),
    "abs": (np.abs, 1),
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "tan": (np.tan, 1),
    "asin": (np.arcsin, 1),
    "acos": (np.arccos, 1),
    "atan": (np.arctan, 1),
    "atan2": (np.arctan2, 2),
    "min": (np.minimum, 2),
    "max": (np.maximum, 2),
}
CONSTANTS = {"pi": math.pi}


@dataclass(frozen=True)
class Number:
    """A literal in SI, not negative; `dimension` is None when it was written in Python, where SI is understood.

    Raises ExpressionError when it is negative (that is a Negative of a Number) or not finite.
    """

    value: float
    dimension: Dimension | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if not math.isfinite(self.value) or math.copysign(1.0, self.value) < 0:
            raise ExpressionError("a number in an expression must be finite and not negative")


@dataclass(frozen=True)
class Name:
    """A reference to a parameter or to a constant such as `pi`."""

    id: str


@dataclass(frozen=True)
class Negative:
    """Unary minus."""

    operand: Tree


@dataclass(frozen=True)
class Binary:
    """A sum, difference, product, quotient or power."""

    op: str
    left: Tree
    right: Tree


@dataclass(frozen=True)
class Call:
    """A function of `FUNCTIONS` applied to its arguments."""

    function: str
    arguments: tuple[Tree, ...]


Tree = Number | Name | Negative | Binary | Call


def checked(tree: Tree) -> Tree:
    """The tree itself; ExpressionError when it nests too deep, or uses a name that cannot be written."""
    pending = [(tree, 1)]
    while pending:
        node, depth = pending.pop()
        if depth > MAX_TREE_DEPTH:
            raise ExpressionError(
                f"an expression joins at most {MAX_TREE_DEPTH} operations in a row",
                "split it over several parameters",
            )
        if isinstance(node, Name) and (not NAME.fullmatch(node.id) or node.id in FUNCTIONS):
            raise ExpressionError(f"{node.id!r} cannot be the name of a parameter")
        pending += [(operand, depth + 1) for operand in operands(node)]
    return tree


def operands(tree: Tree) -> tuple[Tree, ...]:
    """The trees that the operation or the function at the root of a tree joins."""
    match tree:
        case Negative(operand):
            return (operand,)
        case Binary(_, left, right):
            return (left, right)
        case Call(_, arguments):
            return arguments
    return ()


def names_in(tree: Tree) -> Iterator[str]:
    """Names of parameters and constants in a tree."""
    pending = [tree]
    while pending:
        node = pending.pop()
        if isinstance(node, Name):
            yield node.id
        pending += operands(node)


def substituted(tree: Tree, values: Mapping[str, Tree]) -> Tree:
    """The same tree with others in the place of some names."""
    match tree:
        case Name(id):
            return values.get(id, tree)
        case Negative(operand):
            return Negative(substituted(operand, values))
        case Binary(op, left, right):
            return Binary(op, substituted(left, values), substituted(right, values))
        case Call(function, arguments):
            return Call(function, tuple(substituted(a, values) for a in arguments))
    return tree


def compiled(tree: Tree) -> Callable[[Mapping[str, Value]], Value]:
    """A tree as a function of the parameter values."""
    match tree:
        case Number(value):
            return lambda _: value
        case Name(id):
            if id in CONSTANTS:
                constant = CONSTANTS[id]
                return lambda _: constant

            def look_up(values: Mapping[str, Value]) -> Value:
                try:
                    return values[id]
                except KeyError:
                    raise ExpressionError(f"parameter {id!r} is not defined") from None

            return look_up
        case Negative(operand):
            inner = compiled(operand)
            return lambda values: -inner(values)
        case Binary(op, left, right):
            return _operation(op, compiled(left), compiled(right))
        case Call(function, arguments):
            call = FUNCTIONS[function][0]
            values_of = [compiled(a) for a in arguments]
            return lambda values: call(*(c(values) for c in values_of))
    raise ExpressionError(f"{tree!r} is not an expression")


def _operation(op: str, a: Callable[..., Value], b: Callable[..., Value]) -> Callable[..., Value]:
    if op == "+":
        return lambda values: a(values) + b(values)
    if op == "-":
        return lambda values: a(values) - b(values)
    if op == "*":
        return lambda values: a(values) * b(values)
    if op == "/":
        return lambda values: np.divide(a(values), b(values))
    return lambda values: np.power(a(values), b(values))


def dimension_of(tree: Tree, of: Mapping[str, Dimension | None]) -> Dimension | None:
    """Physical dimension of a tree, as `Expression.dimension`."""
    result: Dimension | None = None
    match tree:
        case Number(value, dimension):
            result = None if value == 0 and dimension == NUMBER else dimension
        case Name(id):
            result = NUMBER if id in CONSTANTS else of.get(id)
        case Negative(operand):
            result = dimension_of(operand, of)
        case Call(function, arguments):
            result = _call_dimension(function, [dimension_of(a, of) for a in arguments])
        case Binary(op, left, right):
            a, b = dimension_of(left, of), dimension_of(right, of)
            if op in "+-":
                result = _same_dimension(a, b, "+ and - join quantities of one dimension")
            elif op == "^":
                result = _power_dimension(a, b, right)
            elif a is not None and b is not None:
                result = a.times(b, 1 if op == "*" else -1)
    return result


def _same_dimension(a: Dimension | None, b: Dimension | None, rule: str) -> Dimension | None:
    if a is not None and b is not None and a != b:
        left, right = a.unit() or "a pure number", b.unit() or "a pure number"
        raise ExpressionError(f"{rule}; these are {left} and {right}", "give every number in the sum its unit")
    return b if a is None else a


def _power_dimension(base: Dimension | None, exponent: Dimension | None, tree: Tree) -> Dimension | None:
    if exponent not in (None, NUMBER):
        raise ExpressionError("an exponent is a pure number")
    if base in (None, NUMBER):
        return base
    number = tree.operand if isinstance(tree, Negative) else tree
    if not isinstance(number, Number):
        raise ExpressionError("a quantity with a unit is raised to a literal power only")
    power = Fraction(number.value).limit_denominator(12)
    return base.power(-power if isinstance(tree, Negative) else power)


def _call_dimension(function: str, arguments: list[Dimension | None]) -> Dimension | None:
    first = arguments[0]
    if function == "sqrt":
        return None if first is None else first.power(Fraction(1, 2))
    if function == "abs":
        return first
    if function in ("min", "max", "atan2"):
        same = _same_dimension(first, arguments[1], f"{function} compares quantities of one dimension")
        return NUMBER if function == "atan2" else same
    if first not in (None, NUMBER):
        raise ExpressionError(f"{function} takes a pure number or an angle")
    return NUMBER


_PRECEDENCE = {"+": 1, "-": 1, "*": 2, "/": 2, "^": 4}


def _si_literal(number: Number) -> str:
    return repr(number.value).removesuffix(".0")


def format_tree(tree: Tree, number: Callable[[Number], str] = _si_literal, above: int = 0) -> str:
    """Text of a tree with the fewest parentheses; `number` writes its literals."""
    match tree:
        case Number(value):
            text, precedence = number(tree), 5 if value >= 0 else 3
        case Name(id):
            text, precedence = id, 5
        case Negative(operand):
            text, precedence = f"-{format_tree(operand, number, 3)}", 3
        case Call(function, arguments):
            text, precedence = f"{function}({', '.join(format_tree(a, number) for a in arguments)})", 5
        case Binary(op, left, right):
            precedence = _PRECEDENCE[op]
            lhs = format_tree(left, number, precedence + (op == "^"))
            if op == "^" and isinstance(left, Number) and lhs[-1:].isalpha() | lhs.endswith("]"):
                lhs = f"({lhs})"
            text = f"{lhs} {op} {format_tree(right, number, precedence + 1)}"
    return f"({text})" if precedence < above else text


Choice = Literal["min", "max"]
_OTHER: dict[Choice, Choice] = {"min": "max", "max": "min"}


def parts_of(tree: Tree, function: Choice) -> list[Tree]:
    """Trees of which this one is the least (`min`) or the largest (`max`), whatever the parameters are; itself alone
    where it is neither: `2 * max(a, b) - min(c, d)` has four of which it is the largest."""
    found = _parts(tree, function)
    return found if len(found) <= MOST_PARTS else [tree]


def _parts(tree: Tree, function: Choice) -> list[Tree]:
    match tree:
        case Call(name, arguments) if name == function:
            return [part for argument in arguments for part in parts_of(argument, function)]
        case Negative(operand):
            return [Negative(part) for part in parts_of(operand, _OTHER[function])]
        case Binary("+" | "-" as op, left, right):
            others = parts_of(right, function if op == "+" else _OTHER[function])
            return [Binary(op, part, other) for part in parts_of(left, function) for other in others]
        case Binary("*" | "/" as op, left, right) if (size := _number(right)) is not None:
            return [Binary(op, part, right) for part in parts_of(left, function if size > 0 else _OTHER[function])]
        case Binary("*", left, right) if (size := _number(left)) is not None:
            return [Binary("*", left, part) for part in parts_of(right, function if size > 0 else _OTHER[function])]
    return [tree]


def _number(tree: Tree) -> float | None:
    """The value of a tree without parameters, where it is not zero; None of all others."""
    value = None if set(names_in(tree)) - CONSTANTS.keys() else float(compiled(tree)({}))
    return value if value is not None and abs(value) > 0 else None
