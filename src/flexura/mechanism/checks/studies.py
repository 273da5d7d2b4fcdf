"""Checks of studies: the parameters that vary exist, their ranges hold something, and their bounds are kept."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator

from flexura.errors import Path, Problem
from flexura.expressions import Expression
from flexura.mechanism.checks.survey import shown, suggestion
from flexura.mechanism.checks.values import Known
from flexura.mechanism.evaluation import evaluated
from flexura.mechanism.parameters import Parameter
from flexura.mechanism.studies import Range, Spread
from flexura.mechanism.substructure import Mechanism


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
            own = evaluated(varied, values) if isinstance(varied, Range | Spread) else varied
            bounded = evaluated(parameter, values)
            if isinstance(own, Range):
                found += _range(path, own, bounded)
            elif isinstance(own, Spread):
                found += _spread(path, own, bounded)
            else:
                numbers = [float(x.evaluate(values)) if isinstance(x, Expression) else float(x) for x in own]
                found += [p for i, x in enumerate(numbers) for p in _outside((*path, i), x, bounded)]
    return found


def _range(path: Path, own: Range, parameter: Parameter) -> Iterator[Problem]:
    ends = {"from": own.from_, "to": own.to}
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
        elif own.scale == "log" and low <= 0:
            yield Problem(path, shown(low), "a range with equal ratios has positive ends", "write scale: linear")
        elif own.integer and math.ceil(low) > math.floor(high):
            yield Problem(path, "", f"there is no whole number between {shown(low)} and {shown(high)}")


def _spread(path: Path, own: Spread, parameter: Parameter) -> Iterator[Problem]:
    """Deviations move with the value of the parameter: how far they reach is a question when the study is asked."""
    for i, value in enumerate(own.measured or ()):
        if isinstance(value, float):
            yield from _outside((*path, "measured", i), value, parameter)


def _outside(path: Path, value: float, parameter: Parameter) -> Iterator[Problem]:
    """The problem of a value that the bounds of the parameter leave out."""
    low, high = parameter.minimum, parameter.maximum
    unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
    if isinstance(low, float) and value < low:
        yield Problem(path, f"{value:g}{unit}", f"this is below the minimum {low:g}{unit} of the parameter")
    elif isinstance(high, float) and value > high:
        yield Problem(path, f"{value:g}{unit}", f"this is above the maximum {high:g}{unit} of the parameter")
