"""Writing a Mechanism as a model file that reads back to the same description, and files on top of others.

Dimensions of parameters and literals that Python code left out are inferred from where they are used.
"""

from __future__ import annotations

import io
import json
import os
import re
from collections.abc import Mapping
from contextlib import suppress
from fractions import Fraction
from pathlib import Path as FilePath
from typing import Any, NamedTuple

from flexura.arguments import verb
from flexura.errors import ExpressionError, ModelError, OptionError, Path, Problem
from flexura.expressions import NUMBER, Binary, Call, Dimension, Expression, Name, Negative, Number, Tree, format_tree
from flexura.files import write_file
from flexura.mechanism import (
    DOF_NAMES,
    Density,
    DensityTable,
    GainValue,
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
    parameter_dimensions,
    scalars,
)
from flexura.modelfile.document import VERSION, files_of, resolve
from flexura.units import format_number, format_quantity

MaybeDimension = Dimension | None


class Inference:
    """Dimensions of the parameters of a mechanism, as far as units and the fields they are used in tell.

    `known` holds them (None: open). Bare literals in a product count as pure numbers unless that cannot be.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.known: dict[str, MaybeDimension] = parameter_dimensions(mechanism.parameters)
        uses: list[tuple[Tree, Dimension | str]] = []
        for path, quantity, value in scalars(mechanism):
            if isinstance(value, Expression):
                uses.append((value.tree, parameter_at(path) if quantity.dimension is None else quantity.dimension))
        before = None
        while before != self.known:
            before = dict(self.known)
            for tree, expected in uses:
                self._learn(tree, expected)

    def _learn(self, tree: Tree, expected: Dimension | str) -> None:
        if isinstance(expected, str):
            if self.known.get(expected) is None:
                self.known[expected] = self._likely(tree)
            self.annotated(tree, self.known[expected])
        else:
            self.annotated(tree, expected)

    def annotated(self, tree: Tree, expected: MaybeDimension) -> Tree:
        """The same tree with dimensions for its literals, given that of the whole; learns those of names."""
        match tree:
            case Number(value, dimension):
                return tree if dimension is not None else Number(value, expected)
            case Name(id):
                if expected is not None and id in self.known and self.known[id] is None:
                    self.known[id] = expected
                return tree
            case Negative(operand):
                return Negative(self.annotated(operand, expected))
            case Call(function, arguments):
                dimension = self._argument(function, arguments, expected)
                return Call(function, tuple(self.annotated(a, dimension) for a in arguments))
            case Binary(op, left, right):
                a, b = self._sides(op, left, right, expected)
                return Binary(op, self.annotated(left, a), self.annotated(right, b))

    def _argument(self, function: str, arguments: tuple[Tree, ...], expected: MaybeDimension) -> MaybeDimension:
        if function == "abs":
            return expected
        if function in ("min", "max"):
            return expected or self._likely(arguments[0]) or self._likely(arguments[1])
        if function == "sqrt":
            return expected.power(Fraction(2)) if expected is not None else None
        if function == "atan2":
            return self._likely(arguments[0]) or self._likely(arguments[1])
        return NUMBER

    def _sides(
        self, op: str, left: Tree, right: Tree, expected: MaybeDimension
    ) -> tuple[MaybeDimension, MaybeDimension]:
        """Dimensions of the two sides of an operation."""
        if op in "+-":
            both = expected or self._likely(left) or self._likely(right)
            return both, both
        if op == "^":
            return self._base(left, right, expected), NUMBER
        sign = 1 if op == "*" else -1
        a, b = self._likely(_pure(left)), self._likely(_pure(right))
        if expected is None:
            return a, b
        clash = a is not None and b is not None and a.times(b, sign) != expected
        if b is not None and (a is None or (clash and not _is_bare(right) and _has_bare_factor(left))):
            return expected.times(b, -sign), b
        if a is not None and (b is None or clash):
            return a, expected.times(a, -1) if sign > 0 else a.times(expected, -1)
        return a, b

    def _base(self, base: Tree, exponent: Tree, expected: MaybeDimension) -> MaybeDimension:
        literal = exponent.operand if isinstance(exponent, Negative) else exponent
        if not isinstance(literal, Number):
            return NUMBER
        power = Fraction(literal.value).limit_denominator(12) * (-1 if isinstance(exponent, Negative) else 1)
        return expected.power(1 / power) if expected is not None and power else self._likely(base)

    def _likely(self, tree: Tree) -> MaybeDimension:
        """Dimension of a tree with bare factors taken for pure numbers; None where it is open."""
        try:
            return Expression(_with_pure_factors(tree)).dimension(self.known)
        except ExpressionError:
            return None


def _with_pure_factors(tree: Tree) -> Tree:
    match tree:
        case Binary(op, left, right) if op in "*/":
            return Binary(op, _pure(left), _pure(right))
        case Binary(op, left, right):
            return Binary(op, _with_pure_factors(left), _with_pure_factors(right))
        case Negative(operand):
            return Negative(_with_pure_factors(operand))
        case Call(function, arguments):
            return Call(function, tuple(_with_pure_factors(a) for a in arguments))
    return tree


def _pure(tree: Tree) -> Tree:
    return Number(1.0, NUMBER) if _is_bare(tree) else _with_pure_factors(tree)


def _is_bare(tree: Tree) -> bool:
    """True for literals without dimension, and what is made of them alone."""
    match tree:
        case Number(_, dimension):
            return dimension is None
        case Negative(operand):
            return _is_bare(operand)
        case Binary(_, left, right):
            return _is_bare(left) and _is_bare(right)
        case Call(_, arguments):
            return all(map(_is_bare, arguments))
    return False


def _has_bare_factor(tree: Tree) -> bool:
    match tree:
        case Negative(operand):
            return _has_bare_factor(operand)
        case Binary(op, left, right) if op in "*/":
            return _has_bare_factor(left) or _has_bare_factor(right)
    return _is_bare(tree)


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
_DIRECTIONS = frozenset({"axis", "normal", "reference", "direction", "base"})
_ONE_OR_MORE = frozenset({"rotate", "pattern"})
_INDICATORS = ":#?&!|>%@`"
"""Characters that may end a plain scalar, or begin something else, depending on where they stand."""
_KINDS = frozenset({"type", "shape"})
_ORDER = (
    *("name", "description", "theory", "corrections", "damping", "reduction"),
    *("parameters", "materials", "sections", "substructures"),
    *Substructure.model_fields,
    *("ground", "gravity", "loads", "at", "motion", "disturbances", "controllers", "test", "requirements", "studies"),
    "published",
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
    given = [
        n
        for n, field in fields.items()
        if not field.exclude and (n in _KINDS or field.is_required() or getattr(part, n) != field.default)
    ]
    result: dict[str, Any] = {}
    for name in given or [name for name in fields if name in part.model_fields_set]:
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
    if isinstance(value, Density | DensityTable):
        return value.written
    if isinstance(value, GainValue) and value.unit:
        own, dimension = value.value, Dimension.of_unit(value.unit)
        assert dimension is not None
        return format_quantity(own, dimension) if isinstance(own, float) else written[(*path, "value")]
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


class Changed(NamedTuple):
    """A new value of a parameter, SI, where it comes from, and a comment on its line."""

    value: float
    source: str
    comment: str = ""


def refuse_base(target: FilePath, base: FilePath) -> None:
    """Raise OptionError where `target` is the model file `base`, or one that this extends: nothing would be left."""
    for file in files_of(base):
        with suppress(OSError):
            if target.samefile(file):
                raise OptionError(f"{target} is the model file that is read, or one that it extends: give another name")


def variant_text(
    mechanism: Mechanism, name: str, base: FilePath, target: FilePath, changed: Mapping[str, Changed]
) -> str:
    """The text of a model file `target` with a name of its own that extends `base`, the file of `mechanism`, with
    `changed` values of parameters; what `base` says of their bounds stays. Raises OptionError as `refuse_base`."""
    refuse_base(target, base)
    dimensions = parameter_dimensions(mechanism.parameters)
    above = FilePath(os.path.relpath(base.resolve(), target.resolve().parent)).as_posix()
    lines = [f"flexura: {VERSION}", f"extends: {_quoted(above)}", f"name: {_quoted(name)}", "", "parameters:"]
    for key, change in changed.items():
        number = format_quantity(change.value, dimensions[key] or NUMBER)
        comment = f"  # {change.comment}" if change.comment else ""
        lines.append(f"  {key}: {{value: {number}, source: {_quoted(change.source)}}}{comment}")
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
