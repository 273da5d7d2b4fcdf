"""The parameters of a model file: shorthand, and the unit that each value is understood in."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from flexura.errors import ExpressionError, ModelError, Problem
from flexura.expressions import NUMBER, Dimension, Expression
from flexura.mechanism import Parameter, Quantity, Scalar, parameter_dimensions
from flexura.modelfile.quantities import QuantityReader

ANY = Quantity("quantity", None, "0.3 mm")


def prepare_parameters(raw: dict[str, Any]) -> tuple[dict[str, Dimension | None], list[Problem]]:
    """Write parameters out in full, in place: `t: 0.3 mm` is `t: {value: 0.3 mm}`, and note their units.

    Returns the dimension of every parameter that is declared (None where it cannot be told), and problems
    that would not show once units are gone. What cannot be read is left for validation to report.
    """
    reader = QuantityReader(dict.fromkeys(raw))
    problems: list[Problem] = []
    known: dict[str, Parameter] = {}
    raw.update({name: {"value": entry} for name, entry in raw.items() if not isinstance(entry, dict)})
    for name, entry in raw.items():
        if "unit" in entry:
            del entry["unit"]
            hint = "write value: 0.3 mm"
            problems.append(Problem(("parameters", name, "unit"), "", "the unit stands beside the number", hint))
        with suppress(ExpressionError, ModelError):
            entry["value"], dimension = measure(reader, entry.get("value"))
            unit = (dimension.unit() or "1") if dimension is not None else ""
            known[name] = Parameter(value=entry["value"], unit=unit)
    dimensions = {**dict.fromkeys(raw), **parameter_dimensions(known)}
    for name, dimension in dimensions.items():
        if dimension is not None:
            raw[name]["unit"] = dimension.unit() or "1"
            problems += _bounds(name, raw[name], dimension, reader)
    return dimensions, problems


def measure(reader: QuantityReader, raw: Any) -> tuple[Scalar, Dimension | None]:
    """Value and dimension of a quantity of any kind; None for an expression over parameters.

    Raises ExpressionError when it cannot be read.
    """
    if isinstance(raw, str):
        literal = reader.literal(raw)
        if literal is not None:
            return literal
    value = reader(raw, ANY)
    if isinstance(value, Expression):
        return value, None if value.names else value.dimension({})
    return value, NUMBER


def _bounds(name: str, entry: dict[str, Any], dimension: Dimension, reader: QuantityReader) -> list[Problem]:
    problems = []
    for key in ("minimum", "maximum"):
        with suppress(ExpressionError):
            if entry.get(key) is None:
                continue
            value, found = measure(reader, entry[key])
            if found not in (None, dimension) and value != 0:
                expected, other = dimension.unit() or "a pure number", found.unit() or "a pure number"
                rule = f"a bound has the dimension of its parameter, {expected}; this is in {other}"
                problems.append(Problem(("parameters", name, key), repr(entry[key]), rule))
                del entry[key]
            else:
                entry[key] = value
    return problems
