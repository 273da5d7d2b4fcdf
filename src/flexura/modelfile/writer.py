"""Writing a Mechanism as a model file that reads back to the same description.

Quantities and expressions as they are written in a model file.
"""

from __future__ import annotations

import io
import re
from pathlib import Path as FilePath
from typing import Any

from flexura.arguments import verb
from flexura.errors import ModelError, Path, Problem
from flexura.expressions import NUMBER, Dimension, Expression, Number, format_tree
from flexura.files import write_file
from flexura.mechanism import (
    DOF_NAMES,
    Matrix,
    Mechanism,
    Parameter,
    Part,
    Quantity,
    Scalar,
    Substructure,
    Support,
    key_of,
    parameter_at,
    scalars,
)
from flexura.modelfile.document import resolve
from flexura.modelfile.inference import Inference
from flexura.modelfile.reader import VERSION
from flexura.units import format_number, format_quantity


def written_scalars(mechanism: Mechanism) -> dict[Path, Any]:
    """Every scalar of a mechanism, by its path, as the number or the text that stands for it in a file.

    Raises ModelError when the unit of a parameter cannot be told.
    """
    inference = Inference(mechanism)
    dimensions = inference.known
    _settle(mechanism, dimensions)
    written: dict[Path, Any] = {}
    for path, quantity, value in scalars(mechanism):
        dimension = dimensions.get(parameter_at(path)) if quantity.dimension is None else quantity.dimension
        if isinstance(value, Expression):
            tree = inference.annotated(value.tree, dimension)
            written[path] = format_tree(tree, _literal)
        else:
            written[path] = _number(value, quantity, dimension or NUMBER, dimensions)
    return written


def _settle(mechanism: Mechanism, dimensions: dict[str, Dimension | None]) -> None:
    """Parameters that no part depends on may count as pure numbers; the others need a dimension."""
    needed: set[str] = set()
    pending = [
        name
        for path, quantity, value in scalars(mechanism)
        if (quantity.dimension is not None or path[0] != "parameters") and isinstance(value, Expression)
        for name in value.names
    ]
    while pending:
        name = pending.pop()
        if name not in needed and name in mechanism.parameters:
            needed.add(name)
            value = mechanism.parameters[name].value
            pending += value.names if isinstance(value, Expression) else ()
    problems = []
    for name, dimension in dimensions.items():
        if dimension is not None:
            continue
        if name in needed:
            rule = "the unit of this parameter is neither given nor follows from where it is used"
            value = str(mechanism.parameters[name].value)
            problems.append(Problem(("parameters", name, "unit"), value, rule, "e.g. Parameter(..., unit='m')"))
        else:
            dimensions[name] = NUMBER
    if problems:
        raise ModelError(problems)


def _number(value: float, quantity: Quantity, dimension: Dimension, names: dict[str, Any]) -> int | float | str:
    if dimension == NUMBER and not quantity.angle:
        return _plain(value)
    if value == 0 and quantity.dimension is not None:
        return 0
    number, _, unit = format_quantity(value, dimension, angle=quantity.angle).partition(" ")
    shadowed = any(name in names for name in re.findall(r"[^\W\d]\w*", unit)[1:])
    return f"{number} [{unit}]" if shadowed else f"{number} {unit}"


def _plain(value: Scalar) -> int | float:
    number = float(value)  # type: ignore[arg-type]
    return int(number) if number.is_integer() and abs(number) < 1e15 else number


def _literal(number: Number) -> str:
    """A literal of an expression; compound units stand in brackets."""
    if number.dimension is None or number.dimension == NUMBER:
        return format_number(number.value)
    text, _, unit = format_quantity(number.value, number.dimension).partition(" ")
    return f"{text} {unit}" if unit.isidentifier() else f"{text} [{unit}]"


MAX_FLOW = 88
"""Longest mapping that is written on one line, in characters."""
_AXES = {(1.0, 0.0, 0.0): "x", (0.0, 1.0, 0.0): "y", (0.0, 0.0, 1.0): "z"}
_AXES |= {(-x, -y, -z): f"-{name}" for (x, y, z), name in _AXES.items()}
_DIRECTIONS = frozenset({"axis", "normal", "reference", "direction"})
_ONE_OR_MORE = frozenset({"rotate", "pattern"})
_INDICATORS = ":#?&!|>%@`"
"""Characters that may end a plain scalar, or begin something else, depending on where they stand."""
_KINDS = frozenset({"type", "shape"})
_ORDER = (
    *("name", "description", "theory", "corrections", "damping", "reduction"),
    *("parameters", "materials", "sections", "substructures"),
    *Substructure.model_fields,
    *("ground", "gravity", "loads", "at", "motion", "test", "studies", "published"),
)
_NAMED = frozenset(_ORDER)


@verb
def dumps(mechanism: Mechanism) -> str:
    """Text of a model file for the mechanism: `loads(dumps(m)) == m`.

    Defaults are left out, and quantities carry a customary unit in which they are exact. Raises ModelError
    when the unit of a parameter is neither given nor follows from where the parameter is used.
    """
    from ruamel.yaml import YAML

    written = written_scalars(mechanism)
    content = _part(mechanism, (), written)
    document = {"flexura": VERSION, **{key: content[key] for key in _ORDER if key in content}}
    yaml = YAML()
    yaml.width = 10**6
    yaml.indent(mapping=2, sequence=4, offset=2)
    stream = io.StringIO()
    yaml.dump(_styled(document), stream)
    return stream.getvalue()


@verb
def save(mechanism: Mechanism, path: str | FilePath) -> None:
    """Write a model file in one step: what was there before stays until the new file is complete.

    Raises ModelError as `dumps` does, and OptionError when the file cannot be written.
    """
    text = dumps(mechanism)
    write_file(path, lambda file: file.write_text(text, encoding="utf-8", newline="\n"))


def _part(part: Part, path: Path, written: dict[Path, Any]) -> dict[str, Any]:
    """Keys of a part in the order of its fields, without those at their defaults; those that were given, as the zero
    force of a load, where all are."""
    fields = type(part).model_fields
    told = [n for n, own in fields.items() if n in _KINDS or own.is_required() or getattr(part, n) != own.default]
    result: dict[str, Any] = {}
    for name in told or [name for name in fields if name in part.model_fields_set]:
        key = key_of(type(part), name)
        result[key] = _data(getattr(part, name), (*path, key), written)
    return result


def _data(value: Any, path: Path, written: dict[Path, Any]) -> Any:
    if path in written:
        return written[path]
    if isinstance(value, dict):
        return {key: _data(entry, (*path, key), written) for key, entry in value.items()}
    if isinstance(value, tuple):
        return _list(value, path, written)
    if isinstance(value, Part):
        if value == _CLAMPED:
            return "clamped"
        entry = _part(value, path, written)
        return _short(entry) if isinstance(value, Parameter) else entry
    return value.array.tolist() if isinstance(value, Matrix) else value


_CLAMPED = Support(fixed=DOF_NAMES)


def _list(value: tuple, path: Path, written: dict[Path, Any]) -> Any:
    if path[-1] in _DIRECTIONS and value in _AXES:
        return _AXES[value]
    entries = [_data(entry, (*path, i), written) for i, entry in enumerate(value)]
    return entries[0] if path[-1] in _ONE_OR_MORE and len(entries) == 1 else entries


def _short(parameter: dict[str, Any]) -> Any:
    """Shorthand of a parameter that has only a value; its unit stands in the text."""
    parameter.pop("unit", None)
    return parameter["value"] if parameter.keys() == {"value"} else parameter


def _styled(data: Any, key: str = "") -> Any:
    """Data for the YAML emitter: short mappings and lists on one line, ambiguous text in quotes."""
    from ruamel.yaml.comments import CommentedMap, CommentedSeq

    if isinstance(data, dict):
        mapping = CommentedMap({_text(name): _styled(entry, name) for name, entry in data.items()})
        if key and key not in _NAMED and _width(data) <= MAX_FLOW and not _has_line_break(data):
            mapping.fa.set_flow_style()
        return mapping
    if isinstance(data, list):
        sequence = CommentedSeq([_styled(entry, key) for entry in data])
        if not any(isinstance(entry, dict | list) for entry in data):
            sequence.fa.set_flow_style()
        return sequence
    return _text(data) if isinstance(data, str) else data


def _width(data: Any) -> int:
    if isinstance(data, dict):
        return 2 + sum(len(str(key)) + 4 + _width(entry) for key, entry in data.items())
    if isinstance(data, list):
        return 2 + sum(2 + _width(entry) for entry in data)
    return len(str(data))


def _has_line_break(data: Any) -> bool:
    if isinstance(data, dict):
        return any(map(_has_line_break, data.values()))
    return isinstance(data, str) and "\n" in data


def _text(text: str) -> Any:
    """Text that is certain to be read as the same text."""
    from ruamel.yaml.scalarstring import DoubleQuotedScalarString, LiteralScalarString

    lines = text.split("\n")
    if len(lines) > 1 and all(line.isprintable() and line == line.strip() and line for line in lines):
        return LiteralScalarString(text)
    if not text.isprintable() or not isinstance(resolve(text), str) or set(text) & set(_INDICATORS):
        return DoubleQuotedScalarString(text)
    return text
