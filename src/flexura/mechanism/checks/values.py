"""Checks of numbers: parameters and expressions with their units and bounds, studies, values that instances have of
their own, and the parts with these values."""

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
from flexura.mechanism.checks.survey import prefix, shown, suggestion
from flexura.mechanism.description import Instance, Mechanism, Parameter, Substructure
from flexura.mechanism.evaluation import (
    evaluated,
    expressions,
    parameter_at,
    parameter_dimensions,
    parameter_order,
    scalars,
)
from flexura.mechanism.layout import Layout
from flexura.mechanism.placement import copies
from flexura.mechanism.quantity import Quantity, Scalar
from flexura.mechanism.studies import Range, Spread

SYMBOLS = frozenset(("m", "mm", "um", "s", "kg", "g", "N", "rad", "deg", "V"))
"""Symbols of units that stand in expressions where no number with a unit is before them."""
COMPOUND = "a unit stands right behind its number, e.g. 2700 kg/m^3"

Dimensions = Mapping[str, Dimension | None]


class Known(dict[str, float]):
    """Parameter values that are NaN where they could not be worked out."""

    def __missing__(self, _: str) -> float:
        return math.nan


def check_values(mechanism: Mechanism, ignored: Collection[str]) -> tuple[Known, list[Problem]]:
    """Values of the parameters as far as they have any, and what is wrong with parameters and expressions; names
    `ignored` are known to be missing."""
    found = []
    for name in mechanism.parameters:
        if name in FUNCTIONS or name in CONSTANTS:
            kind = "function" if name in FUNCTIONS else "constant"
            found.append(Problem(("parameters", name), "", f"{name} is the name of a {kind}", "choose another name"))
    for path, _, value in scalars(mechanism):
        names = value.names - mechanism.parameters.keys() if isinstance(value, Expression) else ()
        for name in sorted(set(names).difference(ignored)):
            hint = COMPOUND if name in SYMBOLS else suggestion(name, mechanism.parameters, "parameters")
            found.append(Problem(path, str(value), f"parameter {name!r} is not defined", hint))
    found += wrong_dimensions(mechanism)
    values, problems = defaults(mechanism.parameters)
    found += problems
    found += [p for name in values for p in outside_bounds(name, mechanism.parameters[name], values)]
    found += invalid_at(mechanism, (), values)
    return values, found


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
    found = []
    while True:
        of = parameter_dimensions(parameters)
        broken = [(use, problem) for use in uses if (problem := use.problem(parameters, of)) is not None]
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
        changing = pending.pop()
        unit = (dimension.unit() or "1") if changing == name else ""
        changed[changing] = changed[changing].replaced({"unit": unit})
        for other, parameter in changed.items():
            if isinstance(parameter.value, Expression) and changing in parameter.value.names and other != name:
                pending += [other] if parameter.unit else []
    return changed


def named(dimension: Dimension) -> str:
    """The SI unit of a dimension as it stands in a message."""
    return dimension.unit() or "1 (a pure number)"


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
        given = parameters[name].value
        value = _number(given, values)
        if math.isfinite(value):
            values[name] = value
        elif isinstance(given, Expression) and given.names <= values.keys():
            found.append(Problem(("parameters", name, "value"), str(given), "has no finite value"))
    return values, found


def _number(value: Scalar, values: Known) -> float:
    if not isinstance(value, Expression):
        return value
    with np.errstate(all="ignore"):
        return float(value.evaluate(values))


def outside_bounds(name: str, parameter: Parameter, values: Known) -> Iterator[Problem]:
    """What is wrong with the bounds of a parameter, or with its value between them."""
    low = -math.inf if parameter.minimum is None else _number(parameter.minimum, values)
    high = math.inf if parameter.maximum is None else _number(parameter.maximum, values)
    least, most = parameter.written(low), parameter.written(high)
    path, value = ("parameters", name, "value"), parameter.written(values[name])
    if low > high:
        yield Problem(("parameters", name, "minimum"), "", f"the minimum {least} is above the maximum {most}")
    elif values[name] < low:
        yield Problem(path, value, f"the value is below the minimum {least}")
    elif values[name] > high:
        yield Problem(path, value, f"the value is above the maximum {most}")


def invalid_at(prototype: Substructure, above: Path, values: Known) -> Iterator[Problem]:
    """What the parts at a path themselves refuse once their expressions have values."""
    for path, entry in _entries(prototype, above):
        written = list(expressions(entry))
        if written and all(e.names <= values.keys() for e in written):
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
            if isinstance(written, Expression):
                found = f"{written} = {shown(value)}"
            else:  # a whole part is not repeated
                found = problem.value if isinstance(value, float | int | str) else ""
            yield Problem((*path, *problem.path), found, problem.rule, problem.hint or "at the default parameters")


def _at(data: Any, path: Path) -> Any:
    for key in path:
        data = entry_of(data, str(key)) if isinstance(data, Part) else data[key]  # type: ignore[index]
    return data


def check_studies(mechanism: Mechanism, values: Known, ignored: Collection[str]) -> list[Problem]:
    """What is wrong with the studies of a mechanism at the default values of its parameters."""
    found: list[Problem] = []
    for name, study in mechanism.studies.items():
        for key, varied in study.own.vary.items():
            path = ("studies", name, study.kind, "vary", key)
            parameter = mechanism.parameters.get(key)
            if parameter is None:
                if key not in ignored:
                    hint = suggestion(key, mechanism.parameters, "parameters")
                    found.append(Problem(path, key, "there is no such parameter", hint))
                continue
            variation = evaluated(varied, values) if isinstance(varied, Range | Spread) else varied
            bounded = evaluated(parameter, values)
            if isinstance(variation, Range):
                found += _range(path, variation, bounded)
            elif isinstance(variation, Spread):  # how far deviations reach is a question when the study is asked
                measured = [(i, value) for i, value in enumerate(variation.measured or ()) if isinstance(value, float)]
                found += [p for i, value in measured for p in _outside((*path, "measured", i), value, bounded)]
            else:
                numbers = [_number(x, values) for x in variation]
                found += [p for i, x in enumerate(numbers) for p in _outside((*path, i), x, bounded)]
    return found


def _range(path: Path, varied: Range, parameter: Parameter) -> Iterator[Problem]:
    ends = {"from": varied.from_, "to": varied.to}
    bounds = {"from": parameter.minimum, "to": parameter.maximum}
    for key, end in ends.items():
        if end is None and bounds[key] is None:
            side = "minimum" if key == "from" else "maximum"
            yield Problem(path, "", f"the range has no {key}, and the parameter no {side}", "e.g. {from: ..., to: ...}")
        elif isinstance(end, float):
            yield from _outside((*path, key), end, parameter)
    low, high = (bounds[key] if end is None else end for key, end in ends.items())
    if isinstance(low, float) and isinstance(high, float):
        if low >= high:
            rule = f"there is nothing between {shown(low)} and {shown(high)}"
            yield Problem(path, "", rule, "a range goes from the smaller value to the larger one")
        elif varied.scale == "log" and low <= 0:
            yield Problem(path, shown(low), "a range with equal ratios has positive ends", "write scale: linear")
        elif varied.integer and math.ceil(low) > math.floor(high):
            yield Problem(path, "", f"there is no whole number between {shown(low)} and {shown(high)}")


def _outside(path: Path, value: float, parameter: Parameter) -> Iterator[Problem]:
    """The problem of a value that the bounds of the parameter leave out."""
    low, high, written = parameter.minimum, parameter.maximum, parameter.written
    if isinstance(low, float) and value < low:
        yield Problem(path, written(value), f"this is below the minimum {written(low)} of the parameter")
    elif isinstance(high, float) and value > high:
        yield Problem(path, written(value), f"this is above the maximum {written(high)} of the parameter")


def check_own_values(layout: Layout, values: Known, ignored: Collection[str]) -> list[Problem]:
    """What is wrong with values that instances have of their own; these are added to the values of parameters."""
    described = layout.specialised.mechanism
    found = [
        problem
        for name, part in {"": described, **described.substructures}.items()
        for key, instance in part.instances.items()
        for problem in _of_instance(layout, (*prefix(name), "instances", key), instance, ignored)
    ]
    parameters = layout.specialised.parameters
    known, _ = defaults({**layout.mechanism.parameters, **parameters})
    for name in parameters:
        if name in known:
            values[name] = known[name]
            for problem in outside_bounds(name, parameters[name], known):
                found.append(Problem(layout.specialised.places[name], problem.value, problem.rule, problem.hint))
    for name, part in layout.specialised.substructures.items():
        found += invalid_at(part, prefix(name), values)
    return found


def _of_instance(layout: Layout, path: Path, instance: Instance, ignored: Collection[str]) -> Iterator[Problem]:
    names = [copy for copy, _ in copies(str(path[-1]), instance)] if instance.copies else []
    for copy in instance.copies:
        if copy not in names:
            hint = suggestion(copy, names, "copies")
            yield Problem((*path, "copies", copy), copy, "there is no such copy", hint)
    depends = layout.specialised.depends(instance.of)
    groups = {(*path, "with"): instance.with_, **{(*path, "copies", c): given for c, given in instance.copies.items()}}
    for place, given in groups.items():
        for name in given:
            if name in ignored:
                continue
            if name not in layout.mechanism.parameters:
                hint = suggestion(name, layout.mechanism.parameters, "parameters")
                yield Problem((*place, name), name, "there is no such parameter", hint)
            elif name not in depends:
                hint = suggestion(name, sorted(depends), "parameters that it depends on")
                yield Problem((*place, name), name, f"the substructure {instance.of} does not depend on it", hint)
