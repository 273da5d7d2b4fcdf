"""Sweeps that a model file describes, as what the verb is called with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from flexura.errors import OptionError
from flexura.mechanism import Mechanism, Parameter, Range, SweepStudy, evaluated, parameter_values
from flexura.study.space import Variable


def described_sweep(mechanism: Mechanism, name: str, parameters: Mapping[str, float]) -> dict[str, Any]:
    """The arguments `vary`, `ask`, `sampling`, `samples` and `seed` of a study of the description, by its name.

    Raises OptionError where there is no such study, or one of another kind.
    """
    known = mechanism.studies
    if name not in known:
        close = get_close_matches(str(name), known, n=1)
        hint = f"did you mean {close[0]!r}?" if close else f"studies: {', '.join(known) or 'none'}"
        raise OptionError(f"{name!r} is not a study of the description; {hint}")
    own = known[name].own
    if not isinstance(own, SweepStudy):
        raise OptionError(f"the study {name!r} is no sweep; {known[name].words}")
    vary = [variable_of(mechanism, key, varied, parameters) for key, varied in own.vary.items()]
    return {"vary": vary, "ask": own.ask, "sampling": own.sampling, "samples": own.samples, "seed": own.seed}


def variable_of(mechanism: Mechanism, name: str, varied: Any, parameters: Mapping[str, float]) -> Variable:
    """The variable that a study of the description names, at values of the other parameters; an end that is left out is
    the bound of the parameter."""
    values = {key: float(own) for key, own in parameter_values(mechanism, parameters).items()}
    parameter: Parameter = evaluated(mechanism.parameters[name], values)
    if not isinstance(varied, Range):
        return Variable.of(name, [_number(own, values) for own in varied], parameter.unit)
    own = evaluated(varied, values)
    low = _number(parameter.minimum if own.from_ is None else own.from_, values)
    high = _number(parameter.maximum if own.to is None else own.to, values)
    if own.integer:
        low, high = float(math.ceil(low)), float(math.floor(high))
    kind = "integer" if own.integer else "continuous"
    return Variable(name, low, high, kind, own.steps, own.scale, unit=parameter.unit)


def _number(value: Any, values: Mapping[str, float]) -> float:
    return float(value.evaluate(values)) if hasattr(value, "evaluate") else float(value)
