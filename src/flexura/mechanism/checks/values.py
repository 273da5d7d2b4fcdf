"""Checks of parameters and expressions: names, cycles, bounds, dimensions, and values at the defaults.

Checks of what expressions are made of: that their parameters exist, and that their units make sense.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from flexura.errors import ExpressionError, Path, Problem
from flexura.expressions import CONSTANTS, FUNCTIONS, Dimension, Expression
from flexura.mechanism.base import Part, Vector, entry_of, problems_of, validated
from flexura.mechanism.checks.survey import shown, suggestion
from flexura.mechanism.evaluation import evaluated, parameter_at, parameter_dimensions, parameter_order, scalars
from flexura.mechanism.parameters import Parameter
from flexura.mechanism.quantity import Quantity, Scalar
from flexura.mechanism.substructure import Mechanism, Substructure

SYMBOLS = frozenset(("m", "mm", "um", "s", "kg", "g", "N", "rad", "deg", "V"))
"""Symbols of units that stand in expressions where no number with a unit is before them."""
COMPOUND = "a unit stands right behind its number, e.g. 2700 kg/m^3"

Dimensions = Mapping[str, Dimension | None]


def undefined(mechanism: Mechanism, ignored: Collection[str]) -> Iterator[Problem]:
    """Parameters that expressions name and nobody defines; `ignored` are known to be missing."""
    for path, _, value in scalars(mechanism):
        if isinstance(value, Expression):
            for name in sorted(value.names - mechanism.parameters.keys()):
                if name not in ignored:
                    hint = COMPOUND if name in SYMBOLS else suggestion(name, mechanism.parameters, "parameters")
                    yield Problem(path, str(value), f"parameter {name!r} is not defined", hint)


@dataclass(frozen=True)
class _Use:
    """An expression in its place; it is in order while `problem` is None."""

    path: Path
    quantity: Quantity
    value: Expression

    def expected(self, parameters: Mapping[str, Parameter], of: Dimensions) -> Dimension | None:
        """The dimension that is due here."""
        if self.quantity.dimension is not None:
            return self.quantity.dimension
        name = parameter_at(self.path)
        is_value = self.path == ("parameters", name, "value")
        return parameters[name].dimension if is_value else of.get(name)

    def problem(self, parameters: Mapping[str, Parameter], of: Dimensions) -> Problem | None:
        """What is wrong with the units of the expression when the parameters have these dimensions."""
        try:
            dimension = self.value.dimension(of)
        except ExpressionError as error:
            return Problem(self.path, str(self.value), error.rule, error.hint)
        expected = self.expected(parameters, of)
        if expected is None or dimension is None or dimension == expected:
            return None
        rule = f"{self.quantity.a_kind} is expected here, in {named(expected)}; this is in {named(dimension)}"
        return Problem(
            self.path, str(self.value), rule, f"e.g. {self.quantity.example}" if self.quantity.dimension else ""
        )


def wrong_dimensions(mechanism: Mechanism) -> list[Problem]:
    """Expressions with units that do not fit: those that one parameter with another unit would mend count as one
    problem, which is that parameter's."""
    parameters = mechanism.parameters
    uses = [
        _Use(path, quantity, value)
        for path, quantity, value in scalars(mechanism)
        if isinstance(value, Expression) and value.names <= parameters.keys()
    ]
    of = parameter_dimensions(parameters)
    found = []
    broken = [(use, problem) for use in uses if (problem := use.problem(parameters, of)) is not None]
    while broken:
        culprit = _culprit(parameters, uses, [use for use, _ in broken])
        if culprit is None:
            return [*found, *(problem for _, problem in broken)]
        name, meant, first = culprit
        others = f" and {len(broken) - 1} other places" if len(broken) > 1 else ""
        place = f"{'.'.join(map(str, first.path))}{others}"
        given = of[name]
        assert given is not None
        rule = f"{first.quantity.a_kind} is expected by {place}, in {named(meant)}; this is in {named(given)}"
        path, value = ("parameters", name, "value"), parameters[name].value
        found.append(Problem(path, str(value), rule, f"e.g. {first.quantity.example}"))
        parameters = _with_unit(parameters, name, meant)
        of = parameter_dimensions(parameters)
        broken = [(use, problem) for use in uses if (problem := use.problem(parameters, of)) is not None]
    return found


def _culprit(
    parameters: Mapping[str, Parameter], uses: list[_Use], broken: list[_Use]
) -> tuple[str, Dimension, _Use] | None:
    """The parameter that mends two broken uses or more, and breaks none, when it has another dimension; which one, and
    the first that it mends. None where there is no such parameter."""
    best: tuple[int, str, Dimension, _Use] | None = None
    of = parameter_dimensions(parameters)
    # only a number with a unit can have the wrong one
    for name in [n for n, p in parameters.items() if of[n] is not None and not isinstance(p.value, Expression)]:
        for meant in dict.fromkeys(u.quantity.dimension for u in broken):
            if meant is None or meant == of[name]:
                continue
            changed = _with_unit(parameters, name, meant)
            then = parameter_dimensions(changed)
            still = {use.path for use in uses if use.problem(changed, then) is not None}
            mended = [use for use in broken if use.path not in still]
            if len(mended) < 2 or still - {use.path for use in broken}:
                continue
            if best is None or len(mended) > best[0]:
                first = next((u for u in mended if u.quantity.dimension == meant), mended[0])
                best = len(mended), name, meant, first
    return None if best is None else best[1:]


def _with_unit(parameters: Mapping[str, Parameter], name: str, dimension: Dimension) -> dict[str, Parameter]:
    """The parameters with another dimension of one, and of those that follow from it."""
    changed = dict(parameters)
    pending = [name]
    while pending:
        own = pending.pop()
        unit = (dimension.unit() or "1") if own == name else ""
        changed[own] = changed[own].replaced({"unit": unit})
        for other, parameter in changed.items():
            if isinstance(parameter.value, Expression) and own in parameter.value.names and other != name:
                pending += [other] if parameter.unit else []
    return changed


def named(dimension: Dimension) -> str:
    """The SI unit of a dimension as it stands in a message."""
    return dimension.unit() or "1 (a pure number)"


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
