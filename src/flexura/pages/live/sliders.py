"""Sliders of a mechanism: between what each parameter moves, and the unit that it is shown in."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from flexura.errors import ExpressionError, FlexuraError, OptionError
from flexura.expressions import NUMBER, Expression
from flexura.mechanism import Mechanism, bounds, parameter_dimensions, parameter_order, scalars
from flexura.structure import Plan
from flexura.units import format_quantity, parse_quantity, split_quantity

DECADES = 30.0
"""Ratio of the ends of a range from which its slider is logarithmic."""

REACH = 3.0
"""Where no bounds are given, a slider goes from the value over this to the value times this, and around zero as far as
the largest parameter of the kind over this."""


@dataclass(frozen=True)
class Slider:
    """A parameter: its number `value` in `unit`, and the ends `low` and `high` of its slider in the same unit.

    `minimum` and `maximum` say which of the ends are given; the others are assumed. `expression` is what the value
    follows from, of a parameter that is no slider but moves with others.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float
    minimum: bool
    maximum: bool
    is_log: bool
    source: str
    expression: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)

    def si(self, number: float) -> float:
        """The value in SI of a number in the unit of the slider: the one that its text stands for."""
        return parse_quantity(f"{number!r} {self.unit}".strip())[0]

    def shown(self, value: float) -> float:
        """The number in the unit of the slider of a value in SI, to what a page shows of it."""
        return float(f"{value / self.si(1.0):.9g}")


def sliders_of(plan: Plan) -> dict[str, Slider]:
    """The sliders of all parameters at their default values, by name."""
    mechanism, values = plan.mechanism, plan.parameter_values()
    dimensions, angles = parameter_dimensions(mechanism.parameters), _angles(mechanism)
    found = {}
    for name, parameter in mechanism.parameters.items():
        value = float(values[name])
        low, high = (float(end) for end in bounds(name, parameter, values))
        kind = dimensions[name], name in angles
        alike = [abs(float(values[other])) for other in values if (dimensions[other], other in angles) == kind]
        size = next((own for own in (value, high, low) if own and math.isfinite(own)), max(alike) / REACH)
        text = format_quantity(value or _round(size) or 1.0, dimensions[name] or NUMBER, angle=name in angles)
        number, unit = split_quantity(text)
        shown = float(number) if value else 0.0
        own = Slider(name, shown, unit, low, high, math.isfinite(low), math.isfinite(high), False, "")
        below, above = (own.shown(end) if math.isfinite(end) else end for end in (low, high))
        below, above = _ends(shown, below, above, float(number))
        expression = str(parameter.value) if isinstance(parameter.value, Expression) else ""
        found[name] = replace(
            own,
            low=below,
            high=above,
            is_log=below > 0 and above / below >= DECADES,
            source=parameter.source,
            expression=expression,
        )
    return found


def _angles(mechanism: Mechanism) -> set[str]:
    """Parameters that stand alone where an angle is expected."""
    return {
        str(value)
        for _, quantity, value in scalars(mechanism)
        if quantity.angle and isinstance(value, Expression) and str(value) in mechanism.parameters
    }


def _ends(value: float, low: float, high: float, size: float) -> tuple[float, float]:
    """Ends of a slider around a value; those that are not finite are assumed, around zero by a `size`."""
    span = abs(value or size)
    below, above = (value / REACH, value * REACH) if value > 0 else (value - span, value + span)
    if value < 0:
        below, above = value * REACH, value / REACH
    if not math.isfinite(low):
        low = _round(below if not math.isfinite(high) else min(below, high - span / REACH))
    if not math.isfinite(high):
        high = _round(max(above, low + span / REACH))
    return low, high


def _round(number: float) -> float:
    return float(f"{number:.3g}")


def parameters_of(sliders: Mapping[str, Slider], numbers: Mapping[str, float]) -> dict[str, float]:
    """Parameters in SI of numbers in the units of their sliders. Raises OptionError for one that is not known."""
    found = {}
    for name, number in numbers.items():
        if name not in sliders:
            raise OptionError(f"there is no parameter {name!r}")
        try:
            found[name] = sliders[name].si(number)
        except ExpressionError as error:
            raise OptionError(f"parameter {name}: {error}") from None
    return found


def moved_bounds(plan: Plan, sliders: Mapping[str, Slider], parameters: Mapping[str, float]) -> dict[str, Any]:
    """What follows the sliders: numbers of dependent parameters, and [low, high] where bounds depend on others."""
    values = plan.parameter_values(parameters)
    derived, ends = {}, {}
    for name, parameter in plan.mechanism.parameters.items():
        own = sliders[name]
        if own.expression and name not in parameters:
            derived[name] = own.shown(float(values[name]))
        if any(isinstance(end, Expression) for end in (parameter.minimum, parameter.maximum)):
            low, high = (float(end) for end in bounds(name, parameter, values))
            ends[name] = [
                own.shown(end) if math.isfinite(end) else assumed for end, assumed in ((low, own.low), (high, own.high))
            ]
    return {"derived": derived, "bounds": ends}


def blamed(
    plan: Plan,
    sliders: Mapping[str, Slider],
    parameters: Mapping[str, float],
    error: FlexuraError,
    moved: set[str],
) -> list[dict[str, Any]]:
    """What is wrong with a design, each with the sliders that it is said at: of those that were `moved`, the ones on
    which it depends, or else all."""
    problems = getattr(error, "problems", ())
    if not problems:
        named = {name for name in plan.mechanism.parameters if str(error).startswith(f"parameter {name} ")}
        texts = [text for name in sorted(named) if (text := _beyond(plan, sliders[name], parameters))]
        text = "; ".join(texts) or str(error)
        return [{"text": text, "sliders": sorted((_needed(plan, named) & moved) or named or moved)}]
    found = []
    for problem in problems:
        names = _needed(plan, _names_at(plan.mechanism, problem.path))
        found.append({"text": f"{problem.place}: {problem.rule}", "sliders": sorted((names & moved) or moved)})
    return found


def _beyond(plan: Plan, slider: Slider, parameters: Mapping[str, float]) -> str:
    """Of a parameter beyond one of its bounds that it is so, in the unit of its slider; else nothing."""
    known = plan.mechanism.parameters
    values = {name: float(value) for name, value in plan.parameter_values().items()} | dict(parameters)
    for name in parameter_order(known)[0]:
        if isinstance(own := known[name].value, Expression) and name not in parameters:
            values[name] = float(own.evaluate(values))
    value = values[slider.name]
    low, high = (float(end) for end in bounds(slider.name, known[slider.name], values))
    if low <= value <= high:
        return ""
    side, end = ("below its minimum", low) if value < low else ("above its maximum", high)
    found, limit = (f"{slider.shown(own):g} {slider.unit}".rstrip() for own in (value, end))
    return f"parameter {slider.name} = {found} is {side} {limit}"


def _names_at(mechanism: Mechanism, path: tuple[str | int, ...]) -> set[str]:
    """Parameters that numbers at a path, or below it, are made of."""
    if len(path) > 1 and path[0] == "parameters":
        return {str(path[1])}
    return {
        name
        for own, _, value in scalars(mechanism)
        if isinstance(value, Expression) and own[: len(path)] == path
        for name in value.names
    }


def _needed(plan: Plan, names: set[str]) -> set[str]:
    """Parameters that others are worked out from, and these themselves."""
    found, todo = set[str](), list(names)
    while todo:
        name = todo.pop()
        if name in found or name not in plan.mechanism.parameters:
            continue
        found.add(name)
        value = plan.mechanism.parameters[name].value
        todo += value.names if isinstance(value, Expression) else ()
    return found
