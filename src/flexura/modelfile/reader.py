"""Reading a model file into a Mechanism, with everything that is wrong with it at once.

Which keys a place in a model file may have.

Values of parameters that stand elsewhere in a model file: each is read with the dimension of its parameter.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from pathlib import Path as FilePath
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import ValidationError

from flexura.arguments import verb
from flexura.errors import ExpressionError, ModelError, OptionError, Path, Problem
from flexura.expressions import Call, Dimension, Expression, Name
from flexura.mechanism import (
    CONTEXT_KEY,
    UNKNOWN_KEY,
    Mechanism,
    Parameter,
    Part,
    Quantity,
    Scalar,
    Superelement,
    entry_of,
    key_of,
    problems_of,
    suggestion,
    validated,
)
from flexura.mechanism import problems as problems_of_whole
from flexura.modelfile.document import Node, parse
from flexura.modelfile.extension import text_of, with_bases
from flexura.modelfile.parameters import measure, prepare_parameters
from flexura.modelfile.pruning import Pruned, entry_of_place
from flexura.modelfile.quantities import QuantityReader
from flexura.modelfile.superelements import prepare_superelement
from flexura.units import format_quantity

_SYMMETRIC = re.compile(r"\s*(?:±|\+\s*/?\s*-)\s*(\S.*)", re.DOTALL)
_SIDE = re.compile(r"([+-]?)\s*((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)", re.DOTALL)
_PERCENT = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*%\s*")
_DEVIATIONS = ("uniform", "triangular", "normal")
_VARIED = ("from", "to", "measured", *_DEVIATIONS)


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
    holders: list[tuple[Path, Any]] = [((), data)]
    holders += [(("substructures", name), holder) for name, holder in _entries(data, "substructures")]
    for path, holder in holders:
        for key, instance in _entries(holder, "instances"):
            above: Path = (*path, "instances", key)
            groups: dict[Path, Any] = {(*above, "copies", copy): own for copy, own in _entries(instance, "copies")}
            inside: Path = (*above, "with")
            groups[inside] = instance.get("with") if isinstance(instance, dict) else None
            yield from ((place, own) for place, own in groups.items() if isinstance(own, dict))


def _entries(holder: Any, key: str) -> list[tuple[str, Any]]:
    """The entries of a mapping below a key, as far as these are mappings."""
    own = holder.get(key) if isinstance(holder, dict) else None
    return list(own.items()) if isinstance(own, dict) else []


def _varied(data: dict[str, Any]) -> Iterator[tuple[Path, dict[str, Any]]]:
    """What varies in studies."""
    for name, study in _entries(data, "studies"):
        for kind, own in study.items() if isinstance(study, dict) else ():
            if isinstance(own, dict) and isinstance(own.get("vary"), dict):
                yield ("studies", name, kind, "vary"), own["vary"]


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
        sides = [_SIDE.fullmatch(own.strip()) for own in text.split("/")]
        if len(sides) != 2 or sides[0] is None or sides[1] is None:
            raise ExpressionError(
                "this is no spread, which is ± 0.02 mm, +0.01/-0.03 mm or a mapping", "e.g. {normal: 0.01 mm}"
            )
        both = sorted((float(sign + number), unit) for sign, number, unit in (own.groups() for own in sides if own))
        if any(own and not own[1] and float(own[2]) for own in sides):
            raise ExpressionError("a sign is missing: each side of a spread has its sign", "e.g. +0.01/-0.03 mm")
        shared = next((unit for _, unit in both if unit), "")
        return [self.deviation(f"{size!r} {unit or shared}".strip(), name) if size else 0.0 for size, unit in both]

    def deviation(self, text: str, name: str) -> Scalar:
        """A deviation of the parameter; in % it is a share of the parameter's value, whatever its dimension."""
        percent = _PERCENT.fullmatch(text.strip())
        if percent is not None:
            return float(percent[1]) / 100 * Expression(Call("abs", (Name(name),)))
        return self.value(text, name)


_KINDS = ("type", "shape")
FILE_ONLY: dict[type[Part], tuple[str, ...]] = {Mechanism: ("flexura", "extends"), Superelement: ("units",)}
_NOT_IN_FILES: dict[type[Part], tuple[str, ...]] = {Parameter: ("unit",)}


def unknown_key_hint(path: Path, data: Any) -> str:
    """What may stand instead of the last key of `path`, an unknown one; empty when that cannot be told."""
    part = _part_at(path[:-1], data)
    if part is None:
        return ""
    allowed = [key_of(part, name) for name in part.model_fields if name not in _NOT_IN_FILES.get(part, ())]
    allowed += FILE_ONLY.get(part, ())
    close = suggestion(str(path[-1]), allowed, "keys")
    listed = f"allowed: {', '.join(allowed)}"
    return f"{close} {listed}" if close.startswith("did you mean") else listed


def _part_at(path: Path, data: Any) -> type[Part] | None:
    annotation: Any = Mechanism
    for key in path:
        annotation = _inside(_chosen(annotation, data), key)
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return None
    part = _chosen(annotation, data)
    return part if isinstance(part, type) and issubclass(part, Part) else None


def _inside(annotation: Any, key: str | int) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, Part):
        fields = {key_of(annotation, name): field for name, field in annotation.model_fields.items()}
        return fields[str(key)].annotation if str(key) in fields else None
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is dict:
        return arguments[1]
    if origin is tuple:
        return arguments[0] if arguments[-1] is Ellipsis or not isinstance(key, int) else arguments[key]
    return None


def _chosen(annotation: Any, data: Any) -> Any:
    """The alternative of a union that the data are meant for."""
    while get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) is tuple and isinstance(data, dict):
        return _chosen(get_args(annotation)[0], data)
    if get_origin(annotation) not in (Union, UnionType):
        return annotation
    options = [_chosen(option, data) for option in get_args(annotation)]
    if not isinstance(data, dict):
        return next((o for o in options if get_origin(o) is tuple), None)
    parts = [o for o in options if isinstance(o, type) and issubclass(o, Part)]
    return next((part for part in parts if len(parts) == 1 or _is_kind(part, data)), None)


def _is_kind(part: type[Part], data: dict[str, Any]) -> bool:
    for key in _KINDS:
        field = part.model_fields.get(key)
        if field is not None and get_origin(field.annotation) is Literal:
            return data.get(key) in get_args(field.annotation)
    return False


VERSION = 1
MAX_ROUNDS = 10


@verb
def load(path: str | FilePath) -> Mechanism:
    """Read a model file.

    Raises ModelError listing every problem with its file and line.
    """
    try:
        file = FilePath(path)
    except TypeError:
        raise OptionError(f"the path of a model file is expected, not a {type(path).__name__}") from None
    return _read(text_of(file), str(path), file.parent)


@verb
def loads(text: str, name: str = "<text>") -> Mechanism:
    """Read a model from text; `name` represents the file in messages.

    Files that it names are sought in the working directory. Raises ModelError listing every problem with its line.
    """
    if not isinstance(text, str):
        raise OptionError(f"the text of a model is expected, not a {type(text).__name__}")
    return _read(text, name, FilePath())


def _read(text: str, name: str, directory: FilePath) -> Mechanism:
    root = with_bases(parse(text, name), directory)
    data = root.plain()
    pruned = Pruned(data)
    found = [*_version(data, pruned), *_superelements(data, pruned, directory)]
    dimensions, more = prepare_parameters(data["parameters"]) if _has_parameters(data) else ({}, [])
    for problem in more:
        if problem.path[2:] == ("unit",):
            pruned.remove_entry(problem.path[:2])
    found += more
    for problem in prepare_bound_values(data, dimensions):
        pruned.remove_entry(entry_of_place(problem.path))
        found.append(problem)
    mechanism, more = _validated(data, pruned, QuantityReader(dimensions))
    found += more
    if mechanism is not None:
        whole = problems_of_whole(mechanism, ignore_missing=_missing(pruned), partial=pruned.anything)
        for problem in whole:
            path = pruned.original(problem.path)
            if pruned.is_news(path):
                found.append(replace(problem, path=path, value=_as_written(problem, path, mechanism, root)))
    if found or mechanism is None:
        raise ModelError(_located(found, root, name))
    return mechanism


def _as_written(problem: Problem, path: Path, mechanism: Mechanism, root: Node) -> str:
    """The value of a problem with an expression as it stands in the file."""
    try:
        expression: Any = mechanism
        for key in problem.path:
            expression = entry_of(expression, str(key)) if isinstance(expression, Part) else expression[key]
        written: Any = root.at(path).value
    except (KeyError, IndexError, TypeError, AttributeError):
        return problem.value
    if isinstance(expression, Expression) and isinstance(written, str):
        return problem.value.replace(str(expression), written, 1)
    if isinstance(expression, float) and isinstance(written, str) and problem.value == str(expression):
        return written
    return problem.value


def _has_parameters(data: dict[str, Any]) -> bool:
    return isinstance(data.get("parameters"), dict)


def _version(data: dict[str, Any], pruned: Pruned) -> Iterator[Problem]:
    version = data.get("flexura", VERSION)
    if version is not True and version == VERSION and isinstance(version, int):
        data.pop("flexura", None)
        return
    rule = f"this is version {VERSION} of the format"
    yield Problem(("flexura",), repr(version), rule, f"write flexura: {VERSION}")
    pruned.remove(("flexura",))


def _superelements(data: dict[str, Any], pruned: Pruned, directory: FilePath) -> list[Problem]:
    substructures = data.get("substructures")
    holders: list[tuple[Path, Any]] = [((), data)]
    if isinstance(substructures, dict):
        holders += [(("substructures", name), holder) for name, holder in substructures.items()]
    found = []
    for path, holder in holders:
        entries = holder.get("superelements") if isinstance(holder, dict) else None
        for name, entry in list(entries.items()) if isinstance(entries, dict) else ():
            problem = prepare_superelement(entry, directory) if isinstance(entry, dict) else None
            if problem is not None:
                here = (*path, "superelements", name)
                found.append(replace(problem, path=(*here, *problem.path)))
                pruned.remove_entry(here)
    return found


def _validated(data: dict[str, Any], pruned: Pruned, reader: QuantityReader) -> tuple[Mechanism | None, list[Problem]]:
    """Validate the parts, removing and reporting what they refuse; None when nothing is left."""
    found: list[Problem] = []
    for _ in range(MAX_ROUNDS):
        try:
            return validated(Mechanism, data, {CONTEXT_KEY: reader}), found
        except ValidationError as error:
            problems = problems_of(error, data)
        for problem in problems:
            unknown = problem.rule == UNKNOWN_KEY
            hint = unknown_key_hint(problem.path, data) if unknown else problem.hint
            found.append(replace(problem, path=pruned.original(problem.path), hint=hint))
        pruned.remove_all([(p.path, p.rule == UNKNOWN_KEY) for p in problems])
        if pruned.everything:
            break
    return None, found


class _All(Collection[str]):
    """Holds every name."""

    def __contains__(self, _: object) -> bool:
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0


def _missing(pruned: Pruned) -> Collection[str]:
    return _All() if pruned.whole_kinds else pruned.names


def _located(problems: list[Problem], root: Node, name: str) -> list[Problem]:
    """Problems at their places and lines in the file, in that order and each once."""
    located: dict[Problem, tuple[bool, str, int]] = {}
    for problem in problems:
        path, (file, line) = root.locate(problem.path)
        located[replace(problem, path=path, where=f"{file}:{line}")] = (file != name, file, line)
    return sorted(located, key=lambda problem: located[problem])
