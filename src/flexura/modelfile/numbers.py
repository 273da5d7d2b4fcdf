"""Quantities and expressions as they are written in a model file."""

from __future__ import annotations

import re
from typing import Any

from flexura.errors import ModelError, Path, Problem
from flexura.expressions import NUMBER, Dimension, Expression, Number, format_tree
from flexura.mechanism import Mechanism, Quantity, Scalar, parameter_at, scalars
from flexura.modelfile.inference import Inference
from flexura.units import format_number, format_quantity


def written_scalars(mechanism: Mechanism) -> dict[Path, Any]:
    """Every scalar of a mechanism, by its path, as the number or the text that stands for it in a file.

    Raises ModelError when the unit of a parameter cannot be told.
    """
    inference = Inference(mechanism)
    dimensions = inference.known
    _settle(mechanism, dimensions)
    written: dict[Path, Any] = {}
    for path, quantity, value in scalars(mechanism):
        dimension = dimensions.get(parameter_at(path)) if quantity.dimension is None else quantity.dimension
        if isinstance(value, Expression):
            tree = inference.annotated(value.tree, dimension)
            written[path] = format_tree(tree, _literal)
        else:
            written[path] = _number(value, quantity, dimension or NUMBER, dimensions)
    return written


def _settle(mechanism: Mechanism, dimensions: dict[str, Dimension | None]) -> None:
    """Parameters that no part depends on may count as pure numbers; the others need a dimension."""
    needed: set[str] = set()
    pending = [
        name
        for path, quantity, value in scalars(mechanism)
        if (quantity.dimension is not None or path[0] != "parameters") and isinstance(value, Expression)
        for name in value.names
    ]
    while pending:
        name = pending.pop()
        if name not in needed and name in mechanism.parameters:
            needed.add(name)
            value = mechanism.parameters[name].value
            pending += value.names if isinstance(value, Expression) else ()
    problems = []
    for name, dimension in dimensions.items():
        if dimension is not None:
            continue
        if name in needed:
            rule = "the unit of this parameter is neither given nor follows from where it is used"
            value = str(mechanism.parameters[name].value)
            problems.append(Problem(("parameters", name, "unit"), value, rule, "e.g. Parameter(..., unit='m')"))
        else:
            dimensions[name] = NUMBER
    if problems:
        raise ModelError(problems)


def _number(value: float, quantity: Quantity, dimension: Dimension, names: dict[str, Any]) -> int | float | str:
    if dimension == NUMBER and not quantity.angle:
        return _plain(value)
    if value == 0 and quantity.dimension is not None:
        return 0
    number, _, unit = format_quantity(value, dimension, angle=quantity.angle).partition(" ")
    shadowed = any(name in names for name in re.findall(r"[^\W\d]\w*", unit)[1:])
    return f"{number} [{unit}]" if shadowed else f"{number} {unit}"


def _plain(value: Scalar) -> int | float:
    number = float(value)  # type: ignore[arg-type]
    return int(number) if number.is_integer() and abs(number) < 1e15 else number


def _literal(number: Number) -> str:
    """A literal of an expression; compound units stand in brackets."""
    if number.dimension is None or number.dimension == NUMBER:
        return format_number(number.value)
    text, _, unit = format_quantity(number.value, number.dimension).partition(" ")
    return f"{text} {unit}" if unit.isidentifier() else f"{text} [{unit}]"
