"""Values of parameters given on a command line."""

from __future__ import annotations

import math
from difflib import get_close_matches

import numpy as np

from flexura.errors import ExpressionError, OptionError
from flexura.expressions import Expression
from flexura.mechanism import Mechanism, Quantity, parameter_dimensions
from flexura.modelfile.parameters import ANY, measure
from flexura.modelfile.quantities import QuantityReader
from flexura.units import format_quantity


def parse_override(mechanism: Mechanism, text: str) -> tuple[str, float]:
    """Read `name=0.3 mm`: the name of a parameter and a value in SI of its dimension.

    Raises OptionError when the parameter does not exist, or the value cannot be read or has another
    dimension.
    """
    name, equals, written = (part.strip() for part in text.partition("="))
    if not equals or not written:
        raise OptionError(f"{text!r} sets no parameter; write NAME=VALUE, e.g. thickness=0.3 mm")
    if name not in mechanism.parameters:
        close = get_close_matches(name, mechanism.parameters, n=1)
        known = ", ".join(mechanism.parameters) or "none"
        hint = f"did you mean {close[0]!r}?" if close else f"parameters: {known}"
        raise OptionError(f"{name!r} is not a parameter; {hint}")
    dimension = parameter_dimensions(mechanism.parameters)[name]
    example = format_quantity(_example(mechanism, name), dimension) if dimension is not None else "0.3 mm"
    quantity = ANY if dimension is None else Quantity(f"value of {name}", dimension, example)
    reader = QuantityReader({})
    try:
        value, _ = measure(reader, written) if dimension is None else (reader.text(written, quantity), None)
        with np.errstate(all="ignore"):
            number = float(value.evaluate({}) if isinstance(value, Expression) else value)
    except ExpressionError as error:
        raise OptionError(str(error)) from None
    if not math.isfinite(number):
        raise OptionError(f"{name}: a parameter must be finite")
    return name, number


def _example(mechanism: Mechanism, name: str) -> float:
    value = mechanism.parameters[name].value
    return value if isinstance(value, float) and value else 1.0
