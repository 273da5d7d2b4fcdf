"""Checks of parameters and expressions: names, cycles, bounds, dimensions, and values at the defaults."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from flexura.errors import Path, Problem
from flexura.expressions import CONSTANTS, FUNCTIONS, Expression
from flexura.mechanism.base import Part, Vector, entry_of, problems_of, validated
from flexura.mechanism.checks.dimensions import undefined, wrong_dimensions
from flexura.mechanism.checks.survey import shown
from flexura.mechanism.evaluation import evaluated, parameter_order, scalars
from flexura.mechanism.parameters import Parameter
from flexura.mechanism.quantity import Scalar
from flexura.mechanism.substructure import Mechanism, Substructure


class Known(dict[str, float]):
    """Parameter values that are NaN where they could not be worked out."""

    def __missing__(self, _: str) -> float:
        return math.nan


def check_values(mechanism: Mechanism, ignored: Collection[str]) -> tuple[Known, list[Problem]]:
    """Values of the parameters as far as they have any, and what is wrong with parameters and expressions."""
    found = [*_names(mechanism), *undefined(mechanism, ignored), *wrong_dimensions(mechanism)]
    values, problems = defaults(mechanism.parameters)
    found += problems
    found += [p for name in values for p in outside_bounds(name, mechanism.parameters[name], values)]
    found += invalid_at(mechanism, (), values)
    return values, found


def _names(mechanism: Mechanism) -> Iterator[Problem]:
    for name in mechanism.parameters:
        if name in FUNCTIONS or name in CONSTANTS:
            kind = "function" if name in FUNCTIONS else "constant"
            yield Problem(("parameters", name), "", f"{name} is the name of a {kind}", "choose another name")


def defaults(parameters: Mapping[str, Parameter]) -> tuple[Known, list[Problem]]:
    """Values of parameters as far as they have any, and those that have none."""
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


def outside_bounds(name: str, parameter: Parameter, values: Known) -> Iterator[Problem]:
    """What is wrong with the bounds of a parameter, or with its value between them."""
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


def invalid_at(prototype: Substructure, above: Path, values: Known) -> Iterator[Problem]:
    """What the parts at a path themselves refuse once their expressions have values."""
    for path, entry in _entries(prototype, above):
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
            validated(type(entry), data)
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
        data = entry_of(data, str(key)) if isinstance(data, Part) else data[key]  # type: ignore[index]
    return data
