"""The numbers of a description: every scalar with what is expected of it, and parameter values."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from graphlib import CycleError, TopologicalSorter
from types import MappingProxyType, UnionType
from typing import Annotated, Any, NamedTuple, TypeVar, Union, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.duals import Dual, plain, real
from flexura.errors import ExpressionError, ModelError, OptionError, Path, Problem, did_you_mean
from flexura.expressions import Dimension, Expression
from flexura.mechanism.base import AnyPart, Part, key_of
from flexura.mechanism.description import Mechanism, Parameter
from flexura.mechanism.quantity import Quantity, Scalar

Value = float | NDArray[np.float64]
AnyItem = TypeVar("AnyItem")
Found = list[tuple[Path, Quantity, Scalar]]


class _Kind(NamedTuple):
    """What a value of a type may hold: a number, parts, entries of one kind, or entries of several by their count."""

    number: Quantity | None = None
    has_parts: bool = False
    each: _Kind | None = None
    entries: Mapping[int, tuple[_Kind, ...]] = MappingProxyType({})

    @property
    def has_numbers(self) -> bool:
        """Whether there may be a number in a value of this kind."""
        inner = [entry for entries in self.entries.values() for entry in entries]
        inner += [] if self.each is None else [self.each]
        return self.number is not None or self.has_parts or any(entry.has_numbers for entry in inner)


def scalars(part: Part) -> Iterator[tuple[Path, Quantity, Scalar]]:
    """Every number of a part and of the parts inside it: (path below the part, what is expected, value)."""
    found: Found = []
    _collect(part, _Kind(has_parts=True), (), found)
    return iter(found)


def _collect(value: Any, kind: _Kind, path: Path, found: Found) -> None:
    """Add the numbers in a value of a kind."""
    if isinstance(value, Part):
        for name, key, inner in _fields(type(value)):
            entry = getattr(value, name)
            if entry is not None:
                _collect(entry, inner, (*path, key), found)
    elif isinstance(value, tuple):
        kinds = kind.entries.get(len(value)) or (kind.each,) * len(value)
        for i, (entry, inner) in enumerate(zip(value, kinds, strict=True)):
            if inner is not None:
                _collect(entry, inner, (*path, i), found)
    elif isinstance(value, dict):
        if kind.each is not None:
            for key, entry in value.items():
                _collect(entry, kind.each, (*path, key), found)
    elif kind.number is not None:
        found.append((path, kind.number, value))


@cache
def _fields(kind: type[Part]) -> tuple[tuple[str, str, _Kind], ...]:
    """Fields of a part that may hold numbers: name, key in a file, and kind."""
    kinds = {name: _kind(field.annotation, tuple(field.metadata)) for name, field in kind.model_fields.items()}
    return tuple((name, key_of(kind, name), inner) for name, inner in kinds.items() if inner.has_numbers)


def _kind(annotation: Any, metadata: tuple[Any, ...] = ()) -> _Kind:
    """The kind of an annotation. In a union parts know theirs, and tuples are told apart by their lengths."""
    quantity = next((m for m in metadata if isinstance(m, Quantity)), None)
    origin, arguments = get_origin(annotation), get_args(annotation)
    if quantity is not None:
        return _Kind(quantity)
    if origin is Annotated:
        return _kind(arguments[0], arguments[1:])
    if origin in (Union, UnionType):
        kinds = [_kind(argument) for argument in arguments]
        return _Kind(
            next((kind.number for kind in kinds if kind.number is not None), None),
            any(kind.has_parts for kind in kinds),
            next((kind.each for kind in kinds if kind.each is not None), None),
            {count: entries for kind in kinds for count, entries in kind.entries.items()},
        )
    if origin is dict or (origin is tuple and arguments[-1] is Ellipsis):
        return _Kind(each=_kind(arguments[1 if origin is dict else 0]))
    if origin is tuple:
        return _Kind(entries={len(arguments): tuple(map(_kind, arguments))})
    return _Kind(has_parts=isinstance(annotation, type) and issubclass(annotation, Part))


def parameter_at(path: Path) -> str:
    """The parameter of which a number of any dimension at a path of a mechanism is a value, a bound or a deviation;
    none of a gain."""
    if path[0] == "studies":
        return str(path[4])
    if path[0] == "controllers":
        return ""
    return str(path[1] if path[0] == "parameters" else path[-1])


def evaluated(part: AnyPart, values: Mapping[str, float]) -> AnyPart:
    """The same part with every expression replaced by its value, which may have slopes; nothing is validated anew.

    Raises ExpressionError when `values` lacks a parameter.
    """
    with np.errstate(all="ignore"):
        return _with_expressions(part, lambda expression: _float_or_array(expression.evaluate(values)))


def renamed(item: AnyItem, names: Mapping[str, str]) -> AnyItem:
    """A part, or an expression, with other names for some parameters; nothing is validated anew."""
    return _with_expressions(item, lambda expression: expression.renamed(names))


def substituted(item: AnyItem, values: Mapping[str, Scalar]) -> AnyItem:
    """A part, or an expression, with values in the place of some parameters; nothing is validated anew."""

    def value(expression: Expression) -> Scalar:
        found = expression.substituted(values)
        return found if found.names else float(found.evaluate({}))

    return _with_expressions(item, value)


def expressions(item: Any) -> Iterator[Expression]:
    """Every expression in a part, a tuple or a mapping."""
    if isinstance(item, Expression):
        yield item
    elif isinstance(item, Part | dict):
        for entry in (item.__dict__ if isinstance(item, Part) else item).values():
            yield from expressions(entry)
    elif isinstance(item, tuple):
        for entry in item:
            yield from expressions(entry)


def _with_expressions(item: Any, change: Callable[[Expression], Any]) -> Any:
    """The same item with something else for every expression; it stays itself where there is none."""
    if isinstance(item, Expression):
        return change(item)
    if isinstance(item, Part):
        fields = item.__dict__.items()
        changed = {name: new for name, old in fields if (new := _with_expressions(old, change)) is not old}
        return item.replaced(changed) if changed else item
    if isinstance(item, tuple):
        entries = tuple(_with_expressions(entry, change) for entry in item)
        return entries if any(a is not b for a, b in zip(entries, item, strict=True)) else item
    if isinstance(item, dict):
        mapping = {key: _with_expressions(entry, change) for key, entry in item.items()}
        return mapping if any(mapping[key] is not item[key] for key in item) else item
    return item


def parameter_order(parameters: Mapping[str, Parameter]) -> tuple[list[str], list[list[str]]]:
    """Parameters with those they depend on first, and the cycles that had to be left out of that order.

    Names that are not defined are passed over.
    """
    return dependency_order(
        {
            name: {n for n in p.value.names if n in parameters} if isinstance(p.value, Expression) else set()
            for name, p in parameters.items()
        }
    )


def dependency_order(graph: Mapping[str, set[str]]) -> tuple[list[str], list[list[str]]]:
    """Names with those they need first, and the cycles that had to be left out of that order."""
    cycles: list[list[str]] = []
    while True:
        try:
            return list(TopologicalSorter(graph).static_order()), cycles
        except CycleError as error:
            cycle = _rotated(list(reversed(error.args[1][1:])))
            cycles.append(cycle)
            graph = {name: needs.difference(cycle) for name, needs in graph.items() if name not in cycle}


def _rotated(cycle: list[str]) -> list[str]:
    first = cycle.index(min(cycle))
    return cycle[first:] + cycle[:first]


def parameter_dimensions(parameters: Mapping[str, Parameter]) -> dict[str, Dimension | None]:
    """Dimension of every parameter: by its unit, or derived from those it depends on; None where unknown."""
    dimensions: dict[str, Dimension | None] = {name: p.dimension for name, p in parameters.items()}
    for name in parameter_order(parameters)[0]:
        value = parameters[name].value
        if dimensions[name] is None and isinstance(value, Expression):
            with suppress(ExpressionError):
                dimensions[name] = value.dimension(dimensions)
    return dimensions


def parameter_values(mechanism: Mechanism, overrides: Mapping[str, ArrayLike] | None = None) -> dict[str, Value]:
    """Values of all parameters in SI; an override replaces a value, and what depends on it follows.

    Overrides are floats or arrays (designs,); arrays all have one length, and what depends on one is an array.
    Raises OptionError for an override that is unknown, not finite or out of bounds, or that drives a
    dependent parameter there, and ModelError when the parameters themselves cannot be evaluated.
    """
    return ParameterTable(mechanism)(overrides or {})[0]


class ParameterTable:
    """The parameters of a mechanism with their defaults worked out, ready to be overridden many times.

    `added` are those that instances have for themselves. They cannot be overridden; those that are worked out as one of
    the mechanism's is have its value where that is overridden, as `follows` says. Raises ModelError when they cannot be
    evaluated.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        added: Mapping[str, Parameter] = MappingProxyType({}),
        follows: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self._own, self._follows = mechanism.parameters, dict(follows)
        self._parameters = {**mechanism.parameters, **added}
        order, cycles = parameter_order(self._parameters)
        if cycles:
            raise ModelError(
                Problem(("parameters", c[0]), " -> ".join([*c, c[0]]), "depends on itself") for c in cycles
            )
        values: dict[str, Value] = {}
        for name in order:
            value = self._parameters[name].value
            values[name] = _value(name, value, values)
            if not _is_finite(values[name]):
                raise ModelError([Problem(("parameters", name), str(value), "has no finite value")])
        self._derived = [(n, v, v.names) for n in order if isinstance(v := self._parameters[n].value, Expression)]
        self.defaults: dict[str, Value] = {name: values[name] for name in self._parameters}

    def __call__(self, overrides: Mapping[str, ArrayLike]) -> tuple[dict[str, Value], set[str]]:
        """Values of all parameters, and the names of those that the overrides changed; see `parameter_values`."""
        given = _overrides(self._own, overrides)
        given |= {name: given[root] for name, root in self._follows.items() if root in given}
        values, touched = {**self.defaults, **given}, set(given)
        for name, expression, needs in self._derived:
            if name in given or touched.isdisjoint(needs):
                continue
            values[name] = _value(name, expression, values)
            touched.add(name)
            if not _is_finite(values[name]):
                raise OptionError(f"parameter {name} = {expression} has no finite value for this {', '.join(given)}")
        followed = [name for name, _, _ in self._derived if name in touched and name not in given]
        _check_bounds(self._parameters, values, [*given, *followed])
        return values, touched


def _value(name: str, value: Scalar, values: Mapping[str, Value]) -> Value:
    if not isinstance(value, Expression):
        return value
    try:
        with np.errstate(all="ignore"):
            return _float_or_array(value.evaluate(values))
    except ExpressionError as error:
        raise ModelError([Problem(("parameters", name), str(value), error.rule, error.hint)]) from None


def _is_finite(value: Value) -> bool:
    return math.isfinite(value) if isinstance(value, float) else bool(np.all(np.isfinite(value)))


def _float_or_array(value: Any) -> Any:
    if isinstance(value, float):
        return float(value)
    array: Any = real(value)
    return float(array) if isinstance(array, np.ndarray) and not array.ndim else array


def _overrides(parameters: Mapping[str, Parameter], overrides: Mapping[str, ArrayLike]) -> dict[str, Value]:
    if not isinstance(overrides, Mapping):
        raise OptionError(f"parameters are given by name, as {{'width': 0.01}}; not as {overrides!r}")
    given: dict[str, Any] = {}
    lengths: dict[int, str] = {}
    for name, raw in overrides.items():
        if name not in parameters:
            known = f"known: {', '.join(parameters)}" if parameters else "the mechanism has no parameters"
            raise OptionError(f"{name!r} is not a parameter; {did_you_mean(name, parameters, known)}")
        try:
            value: Any = _float_or_array(raw)
        except (TypeError, ValueError, OverflowError):
            raise OptionError(f"parameter {name}: {raw!r} is not a number in SI, nor an array of them") from None
        if not _is_finite(value):
            raise OptionError(f"parameter {name}: an override must be finite (found {raw!r})")
        if isinstance(value, np.ndarray | Dual) and value.ndim:
            if value.ndim > 1:
                raise OptionError(f"parameter {name}: an override has one axis, the designs; not {value.ndim}")
            lengths.setdefault(len(value), name)
        given[name] = value
    if len(lengths) > 1:
        listed = ", ".join(f"{name} has {length}" for length, name in lengths.items())
        raise OptionError(f"overrides that are arrays all have one length: {listed}")
    return given


def _check_bounds(parameters: Mapping[str, Parameter], values: Mapping[str, Value], names: Iterable[str]) -> None:
    for name in names:
        parameter = parameters[name]
        if parameter.minimum is None and parameter.maximum is None:
            continue
        low, high, value = map(plain, (*bounds(name, parameter, values), values[name]))
        within = (low <= value) & (value <= high)
        if within is True or np.all(within):
            continue
        value = np.asarray(value)
        for side, bound, broken in (("below its minimum", low, value < low), ("above its maximum", high, value > high)):
            if np.any(broken):
                found = float(np.atleast_1d(value)[np.atleast_1d(broken)][0])
                limit = float(np.broadcast_to(bound, np.shape(broken))[broken].flat[0])
                raise OptionError(f"parameter {name} = {parameter.written(found)} is {side} {parameter.written(limit)}")


def bounds(name: str, parameter: Parameter, values: Mapping[str, Value]) -> tuple[Value, Value]:
    """Smallest and largest permitted value of a parameter, infinite where none is given."""
    low = -np.inf if parameter.minimum is None else _value(name, parameter.minimum, values)
    high = np.inf if parameter.maximum is None else _value(name, parameter.maximum, values)
    return low, high
