"""Optima that a model file describes under `studies`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexura.errors import OptionError
from flexura.expressions import Expression
from flexura.mechanism import OptimumStudy, Range, bounds
from flexura.structure import Plan
from flexura.study.space import Variable


def described(plan: Plan, name: str | None, fixed: Mapping[str, float]) -> dict[str, Any]:
    """What the study of a name, or the only one that is an optimum, says: arguments of the verb by their names; none
    where there is no such study and none is named. Raises OptionError for unknown names, and several without one."""
    studies = plan.mechanism.studies
    known = [key for key, own in studies.items() if isinstance(own.own, OptimumStudy)]
    if name is None:
        if len(known) > 1:
            raise OptionError(f"the file describes {len(known)} optima; name a study: {', '.join(known)}")
        if not known:
            return {}
        name = known[0]
    if name not in known:
        kind = f"{name!r} is a {studies[name].kind}" if name in studies else f"there is no study {name!r}"
        raise OptionError(f"{kind}; optima: {', '.join(known) or 'none'}")
    own = studies[name].own
    assert isinstance(own, OptimumStudy)
    goals = own.goals or ()
    values = {key: float(value) for key, value in plan.parameter_values(dict(fixed)).items()}
    return {
        "vary": [_variable(plan, key, variation, values) for key, variation in own.vary.items()],
        "maximise": [text for text in (own.maximise, *(goal.maximise for goal in goals)) if text],
        "minimise": [text for text in (own.minimise, *(goal.minimise for goal in goals)) if text],
        "subject_to": list(own.subject_to),
        "starts": own.starts,
        "seed": own.seed,
    }


def _variable(plan: Plan, name: str, variation: Any, values: Mapping[str, float]) -> Variable:
    parameter = plan.mechanism.parameters[name]

    def number(value: Any) -> float:
        return float(value.evaluate(values)) if isinstance(value, Expression) else float(value)

    if not isinstance(variation, Range):
        return Variable.of(name, [number(own) for own in variation], parameter.unit)
    low, high = (float(end) for end in bounds(name, parameter, values))
    low = low if variation.from_ is None else number(variation.from_)
    high = high if variation.to is None else number(variation.to)
    if not np.isfinite(low + high):
        raise OptionError(f"{name} has no minimum and maximum in the file; give its range both ends")
    kind = "integer" if variation.integer else "continuous"
    return Variable(name, low, high, kind, scale=variation.scale, unit=parameter.unit)
