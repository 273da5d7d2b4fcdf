"""Expressions that are the largest, or the least, of several."""

from __future__ import annotations

from typing import Literal

from flexura.expressions.expression import Binary, Call, Expression, Negative, Tree

MOST = 256
"""Parts at most; what would have more of them is one."""

Choice = Literal["min", "max"]
_OTHER: dict[Choice, Choice] = {"min": "max", "max": "min"}


def parts_of(tree: Tree, function: Choice) -> list[Tree]:
    """Trees of which this one is the least (`min`) or the largest (`max`), whatever the parameters are; itself alone
    where it is neither: `2 * max(a, b) - min(c, d)` has four of which it is the largest."""
    found = _parts(tree, function)
    return found if len(found) <= MOST else [tree]


def _parts(tree: Tree, function: Choice) -> list[Tree]:
    match tree:
        case Call(name, arguments) if name == function:
            return [own for argument in arguments for own in parts_of(argument, function)]
        case Negative(operand):
            return [Negative(own) for own in parts_of(operand, _OTHER[function])]
        case Binary("+" | "-" as op, left, right):
            others = parts_of(right, function if op == "+" else _OTHER[function])
            return [Binary(op, own, other) for own in parts_of(left, function) for other in others]
        case Binary("*" | "/" as op, left, right) if (size := _number(right)) is not None:
            return [Binary(op, own, right) for own in parts_of(left, function if size > 0 else _OTHER[function])]
        case Binary("*", left, right) if (size := _number(left)) is not None:
            return [Binary("*", left, own) for own in parts_of(right, function if size > 0 else _OTHER[function])]
    return [tree]


def _number(tree: Tree) -> float | None:
    """The value of a tree without parameters, where it is not zero; None of all others."""
    expression = Expression(tree)
    value = None if expression.names else float(expression.evaluate({}))
    return value if value is not None and abs(value) > 0 else None
