"""Parameters: those of a file, the values that they have elsewhere in it, and on a command line."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from flexura.errors import ExpressionError, ModelError, OptionError, Path, Problem
from flexura.expressions import NUMBER, Call, Dimension, Expression, Name
from flexura.mechanism import Mechanism, Parameter, Quantity, Scalar, parameter_dimensions
from flexura.modelfile.quantities import QuantityReader
from flexura.units import format_quantity

_SYMMETRIC = re.compile(r"\s*(?:±|\+\s*/?\s*-)\s*(\S.*)", re.DOTALL)
_SIDE = re.compile(r"([+-]?)\s*((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)", re.DOTALL)
_PERCENT = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*%\s*")
_DEVIATIONS = ("uniform", "triangular", "normal")
_VARIED = ("from", "to", "measured", *_DEVIATIONS)


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
            value, measured = measure(reader, entry[key])
            if measured not in (None, dimension) and value != 0:
                expected, other = dimension.unit() or "a pure number", measured.unit() or "a pure number"
                rule = f"a bound has the dimension of its parameter, {expected}; this is in {other}"
                problems.append(Problem(("parameters", name, key), repr(entry[key]), rule))
                del entry[key]
            else:
                entry[key] = value
    return problems


def prepare_bound_values(data: dict[str, Any], dimensions: Mapping[str, Dimension | None]) -> list[Problem]:
    """Replace values of parameters in studies and instances by numbers in SI and expressions, in place, and short
    forms of spreads by long ones. Returns what cannot be read."""
    reader = _Values(dimensions)
    for path, values in _of_instances(data):
        for name in values:
            values[name] = reader.read((*path, name), values[name], name)
    for path, vary in _varied(data):
        for name, entry in vary.items():
            if isinstance(entry, str) and path[2] == "tolerance":
                vary[name] = reader.spread((*path, name), entry, name)
                continue
            holders = [(entry, key) for key in _VARIED if key in entry] if isinstance(entry, dict) else [(vary, name)]
            for holder, key in holders:
                at = (*path, name) if holder is vary else (*path, name, key)
                holder[key] = reader.read(at, holder[key], name, key in _DEVIATIONS and holder is entry)
    return reader.problems


def _of_instances(data: dict[str, Any]) -> Iterator[tuple[Path, dict[str, Any]]]:
    """The values that instances have of their own."""
    for path, holder in holders(data):
        for key, instance in entries(holder, "instances"):
            above: Path = (*path, "instances", key)
            groups: dict[Path, Any] = {(*above, "copies", copy): values for copy, values in entries(instance, "copies")}
            inside: Path = (*above, "with")
            groups[inside] = instance.get("with") if isinstance(instance, dict) else None
            yield from ((place, values) for place, values in groups.items() if isinstance(values, dict))


def holders(data: dict[str, Any]) -> list[tuple[Path, Any]]:
    """What has members: the whole and its substructures, with their paths."""
    return [
        ((), data),
        *((("substructures", name), substructure) for name, substructure in entries(data, "substructures")),
    ]


def entries(holder: Any, key: str) -> list[tuple[str, Any]]:
    """The entries of a mapping below a key, as far as these are mappings."""
    mapping = holder.get(key) if isinstance(holder, dict) else None
    return list(mapping.items()) if isinstance(mapping, dict) else []


def _varied(data: dict[str, Any]) -> Iterator[tuple[Path, dict[str, Any]]]:
    """What varies in studies."""
    for name, study in entries(data, "studies"):
        for kind, question in study.items() if isinstance(study, dict) else ():
            if isinstance(question, dict) and isinstance(question.get("vary"), dict):
                yield ("studies", name, kind, "vary"), question["vary"]


class _Values:
    """Reads values of parameters, and notes what cannot be read."""

    def __init__(self, dimensions: Mapping[str, Dimension | None]) -> None:
        self.reader, self.dimensions = QuantityReader(dimensions), dimensions
        self.problems: list[Problem] = []

    def read(self, path: Path, raw: Any, name: str, is_deviation: bool = False) -> Any:
        """A value of the parameter, or a deviation from it, or several; what is no number stays as it is."""
        if isinstance(raw, list):
            return [self.read((*path, i), entry, name, is_deviation) for i, entry in enumerate(raw)]
        if raw is None or isinstance(raw, dict | bool | Expression):
            return raw
        try:
            return self.deviation(raw, name) if is_deviation and isinstance(raw, str) else self.value(raw, name)
        except ExpressionError as error:
            self.problems.append(Problem(path, repr(raw), error.rule, error.hint))
            return raw

    def value(self, raw: Any, name: str) -> Scalar:
        """One value of the parameter, SI; raises ExpressionError."""
        dimension = self.dimensions.get(name)
        if dimension is None:
            return measure(self.reader, raw)[0]
        return self.reader(raw, Quantity(f"value of {name}", dimension, format_quantity(1e-3, dimension)))

    def spread(self, path: Path, text: str, name: str) -> Any:
        """The long form of `± 0.02 mm`, `± 5 %` or `+0.01/-0.03 mm`; other text stays as it is."""
        try:
            return {"uniform": self.deviations(text, name)}
        except ExpressionError as error:
            self.problems.append(Problem(path, repr(text), error.rule, error.hint))
            return text

    def deviations(self, text: str, name: str) -> list[Scalar]:
        """The lower and the upper deviation that a text gives; raises ExpressionError."""
        symmetric = _SYMMETRIC.fullmatch(text)
        if symmetric is not None:
            high = self.deviation(symmetric[1], name)
            return [-high, high]
        sides = [_SIDE.fullmatch(side.strip()) for side in text.split("/")]
        if len(sides) != 2 or sides[0] is None or sides[1] is None:
            raise ExpressionError(
                "this is no spread, which is ± 0.02 mm, +0.01/-0.03 mm or a mapping", "e.g. {normal: 0.01 mm}"
            )
        both = sorted((float(sign + number), unit) for sign, number, unit in (side.groups() for side in sides if side))
        if any(side and not side[1] and float(side[2]) for side in sides):
            raise ExpressionError("a sign is missing: each side of a spread has its sign", "e.g. +0.01/-0.03 mm")
        shared = next((unit for _, unit in both if unit), "")
        return [self.deviation(f"{size!r} {unit or shared}".strip(), name) if size else 0.0 for size, unit in both]

    def deviation(self, text: str, name: str) -> Scalar:
        """A deviation of the parameter; in % it is a share of the parameter's value, whatever its dimension."""
        percent = _PERCENT.fullmatch(text.strip())
        if percent is not None:
            return float(percent[1]) / 100 * Expression(Call("abs", (Name(name),)))
        return self.value(text, name)


def parse_override(mechanism: Mechanism, text: str) -> tuple[str, float]:
    """Read `name=0.3 mm`: the name of a parameter and a value in SI of its dimension.

    Raises OptionError when the parameter does not exist, or the value cannot be read or has another
    dimension.
    """
    name, equals, written = (part.strip() for part in text.partition("="))
    if not equals or not written:
        raise OptionError(f"{text!r} sets no parameter; write NAME=VALUE, e.g. thickness=0.3 mm")
    mechanism.parameter(name)
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
