"""Checks of parameters and expressions: names, cycles, bounds, dimensions, and values at the defaults."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from flexura.errors import ExpressionError, Path, Problem
from flexura.mechanism.base import Part, Vector, problems_of
from flexura.mechanism.checks.survey import shown, suggestion
from flexura.mechanism.dimension import Dimension
from flexura.mechanism.evaluation import evaluated, parameter_dimensions, parameter_order, scalars
from flexura.mechanism.expression import CONSTANTS, FUNCTIONS, Expression
from flexura.mechanism.parameters import Parameter
from flexura.mechanism.quantity import Quantity, Scalar
from flexura.mechanism.substructure import Mechanism, Substructure


class Known(dict[str, float]):
    """Parameter values that are NaN where they could not be worked out."""

    def __missing__(self, _: str) -> float:
        return math.nan


def check_values(mechanism: Mechanism, ignored: Collection[str]) -> tuple[Known, list[Problem]]:
    """Values of the parameters as far as they have any, and what is wrong with parameters and expressions."""
    found = [*_names(mechanism), *_undefined_and_dimensions(mechanism, ignored)]
    values, problems = _defaults(mechanism.parameters)
    found += problems
    found += [p for name in values for p in _outside_bounds(name, mechanism.parameters[name], values)]
    found += _invalid_at_defaults(mechanism, values)
    return values, found


def _names(mechanism: Mechanism) -> Iterator[Problem]:
    for name in mechanism.parameters:
        if name in FUNCTIONS or name in CONSTANTS:
            kind = "function" if name in FUNCTIONS else "constant"
            yield Problem(("parameters", name), "", f"{name} is the name of a {kind}", "choose another name")


def _defaults(parameters: Mapping[str, Parameter]) -> tuple[Known, list[Problem]]:
    order, cycles = parameter_order(parameters)
    found = [
        Problem(
            ("parameters", c[0], "value"),
            str(parameters[c[0]].value),
            f"depends on itself: {' -> '.join([*c, c[0]])}",
        )
        for c in cycles
    ]
    values = Known()
    for name in order:
        value = _number(parameters[name].value, values)
        if not math.isnan(value) and math.isfinite(value):
            values[name] = value
        elif isinstance(parameters[name].value, Expression) and _computable(parameters[name].value, values):
            found.append(Problem(("parameters", name, "value"), str(parameters[name].value), "has no finite value"))
    return values, found


def _computable(value: Scalar, values: Mapping[str, float]) -> bool:
    return not isinstance(value, Expression) or value.names <= values.keys()


def _number(value: Scalar, values: Known) -> float:
    if not isinstance(value, Expression):
        return value
    with np.errstate(all="ignore"):
        return float(value.evaluate(values))


def _outside_bounds(name: str, parameter: Parameter, values: Known) -> Iterator[Problem]:
    low = -math.inf if parameter.minimum is None else _number(parameter.minimum, values)
    high = math.inf if parameter.maximum is None else _number(parameter.maximum, values)
    unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
    path, value = ("parameters", name, "value"), f"{values[name]:g}{unit}"
    if low > high:
        rule = f"the minimum {low:g}{unit} is above the maximum {high:g}{unit}"
        yield Problem(("parameters", name, "minimum"), "", rule)
    elif values[name] < low:
        yield Problem(path, value, f"the value is below the minimum {low:g}{unit}")
    elif values[name] > high:
        yield Problem(path, value, f"the value is above the maximum {high:g}{unit}")


def _undefined_and_dimensions(mechanism: Mechanism, ignored: Collection[str]) -> Iterator[Problem]:
    parameters, dimensions = mechanism.parameters, parameter_dimensions(mechanism.parameters)
    for path, quantity, value in scalars(mechanism):
        if not isinstance(value, Expression):
            continue
        undefined = sorted(value.names - parameters.keys())
        for name in undefined:
            if name not in ignored:
                hint = suggestion(name, parameters, "parameters")
                yield Problem(path, str(value), f"parameter {name!r} is not defined", hint)
        if undefined:
            continue
        expected = _expected(path, quantity, parameters, dimensions)
        try:
            dimension = value.dimension(dimensions)
        except ExpressionError as error:
            yield Problem(path, str(value), error.rule, error.hint)
            continue
        if expected is not None and dimension is not None and dimension != expected:
            rule = f"{quantity.a_kind} is expected here, in {named(expected)}; this is in {named(dimension)}"
            yield Problem(path, str(value), rule, f"e.g. {quantity.example}" if quantity.dimension else "")


def _expected(
    path: Path, quantity: Quantity, parameters: Mapping[str, Parameter], of: Mapping[str, Dimension | None]
) -> Dimension | None:
    if quantity.dimension is not None or path[0] != "parameters":
        return quantity.dimension
    name = str(path[1])
    return parameters[name].dimension if path[-1] == "value" else of[name]


def named(dimension: Dimension) -> str:
    """The SI unit of a dimension as it stands in a message."""
    return dimension.unit() or "1 (a pure number)"


def _invalid_at_defaults(mechanism: Mechanism, values: Known) -> Iterator[Problem]:
    """What the parts themselves refuse once their expressions have values."""
    for path, entry in _entries(mechanism, ()):
        expressions = _expressions(entry)
        if expressions and all(e.names <= values.keys() for e in expressions):
            yield from _refused(path, entry, values)


def _entries(prototype: Substructure, path: Path) -> Iterator[tuple[Path, Any]]:
    for kind, entries in prototype.__dict__.items():
        if kind == "substructures":
            for name, inner in entries.items():
                yield from _entries(inner, (*path, kind, name))
        elif isinstance(entries, Part):
            yield (*path, kind), entries
        elif isinstance(entries, dict) and kind != "parameters":
            for name, entry in entries.items():
                yield (*path, kind, name), entry


def _expressions(entry: Any) -> list[Expression]:
    numbers = (
        entry if isinstance(entry, tuple) else (v for _, _, v in scalars(entry)) if isinstance(entry, Part) else ()
    )
    return [number for number in numbers if isinstance(number, Expression)]


_VECTOR = TypeAdapter(Vector)


def _refused(path: Path, entry: Any, values: Known) -> Iterator[Problem]:
    try:
        if isinstance(entry, tuple):
            data: Any = tuple(_number(v, values) for v in entry)
            _VECTOR.validate_python(data)
        else:
            data = evaluated(entry, values).model_dump()
            type(entry).model_validate(data)
    except ValidationError as error:
        for problem in problems_of(error, data):
            written, value = _at(entry, problem.path), _at(data, problem.path)
            found = (
                f"{written} = {shown(value)}" if isinstance(written, Expression) else shown_part(problem.value, value)
            )
            yield Problem((*path, *problem.path), found, problem.rule, problem.hint or "at the default parameters")


def shown_part(text: str, value: Any) -> str:
    """The text of a value that is no larger than a number or a name; a whole part is not repeated."""
    return text if isinstance(value, float | int | str) else ""


def _at(data: Any, path: Path) -> Any:
    for key in path:
        data = getattr(data, str(key)) if isinstance(data, Part) else data[key]  # type: ignore[index]
    return data
