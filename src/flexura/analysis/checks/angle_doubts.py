"""Doubts about angles: degrees that count as radians because no unit was written."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from flexura.errors import Diagnostic, Path
from flexura.expressions import Binary, Call, Expression, Folded, Name, Negative, Tree
from flexura.mechanism import Mechanism, scalars

TURN = 2 * math.pi
"""An angle beyond a full turn, rad, is hardly one in radians."""

_OF_ANGLES = ("sin", "cos", "tan")


def angle_doubts(mechanism: Mechanism, values: Mapping[str, Any]) -> list[Diagnostic]:
    """Arguments of sin, cos and tan, and angles, beyond a full turn that neither have a unit nor are made from pi, for
    parameter values in SI; each once, at the parameter that it comes from where there is one."""
    found: dict[str, Diagnostic] = {}
    for path, quantity, value in scalars(mechanism):
        tree = value.tree if isinstance(value, Expression | Folded) else None
        for function, argument in _arguments(tree) if tree is not None else ():
            size = _size(argument, values)
            if _is_doubtful(size) and not _from_pi(argument, mechanism):
                where = _place(path, argument, mechanism)
                found.setdefault(where, _doubt(where, f"{function}({Expression(argument)})", size))
        if quantity.angle:
            size = _size(value.tree, values) if isinstance(value, Expression) else float(value)
            if _is_doubtful(size) and not (tree is not None and _from_pi(tree, mechanism)):
                where = _place(path, tree, mechanism)
                found.setdefault(where, _doubt(where, "the angle" if tree is None else str(Expression(tree)), size))
    return list(found.values())


def _doubt(place: str, what: str, size: float) -> Diagnostic:
    text = f"{what}: {size:g} without a unit is in radians, {size / TURN:.3g} turns; did you mean {size:g} deg?"
    return Diagnostic.about("angle", text, place)


def _arguments(tree: Tree) -> Iterator[tuple[str, Tree]]:
    """Every call of a function of an angle in a tree, with its argument."""
    match tree:
        case Negative(operand):
            yield from _arguments(operand)
        case Binary(_, left, right):
            yield from _arguments(left)
            yield from _arguments(right)
        case Call(function, arguments):
            if function in _OF_ANGLES:
                yield function, arguments[0]
            for argument in arguments:
                yield from _arguments(argument)


def _size(tree: Tree, values: Mapping[str, Any]) -> float:
    return float(Expression(tree).evaluate(values))


def _is_doubtful(size: float) -> bool:
    """Whether an angle, rad, lies beyond a full turn and is no whole number of degrees, as one with a unit is."""
    degrees = math.degrees(size)
    return math.isfinite(size) and abs(size) > TURN * (1 + 1e-9) and abs(degrees - round(degrees)) > 1e-9 * abs(degrees)


def _from_pi(tree: Tree, mechanism: Mechanism) -> bool:
    """Whether pi stands in a tree, or in the parameters that it refers to."""
    pending, seen = [tree], set[str]()
    while pending:
        match pending.pop():
            case Name(id):
                parameter = mechanism.parameters.get(id)
                if id == "pi":
                    return True
                if parameter is not None and id not in seen and isinstance(parameter.value, Expression | Folded):
                    pending.append(parameter.value.tree)
                seen.add(id)
            case Negative(operand):
                pending.append(operand)
            case Binary(_, left, right):
                pending += [left, right]
            case Call(_, arguments):
                pending += arguments
    return False


def _place(path: Path, tree: Tree | None, mechanism: Mechanism) -> str:
    """Where to write the unit: at the parameter, where one alone is meant, or at the expression."""
    if isinstance(tree, Name) and not isinstance(mechanism.parameters[tree.id].value, Expression):
        return f"parameters.{tree.id}"
    keys = path[:-1] if path[0] == "parameters" and path[-1] == "value" else path
    return ".".join(map(str, keys))
