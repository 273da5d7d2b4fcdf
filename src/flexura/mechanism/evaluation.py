"""The numbers of a description: every scalar with what is expected of it, and parameter values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from graphlib import CycleError, TopologicalSorter
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

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
Collect = Callable[[Any, Path, Found], None]


def scalars(part: Part) -> Iterator[tuple[Path, Quantity, Scalar]]:
    """Every number of a part and of the parts inside it: (path below the part, what is expected, value)."""
    found: Found = []
    _collect_part(part, (), found)
    return iter(found)


def _collect_part(part: Part, path: Path, found: Found) -> None:
    for name, key, collect in _plan(type(part)):
        value = getattr(part, name)
        if value is not None:
            collect(value, (*path, key), found)


@cache
def _plan(kind: type[Part]) -> tuple[tuple[str, str, Collect], ...]:
    plan = []
    for name, field in kind.model_fields.items():
        collect = _collector(field.annotation, tuple(field.metadata))
        if collect is not None:
            plan.append((name, key_of(kind, name), collect))
    return tuple(plan)


def _collector(annotation: Any, metadata: tuple[Any, ...] = ()) -> Collect | None:
    """How to find the scalars in a value of this type; None where there cannot be any."""
    quantity = next((m for m in metadata if isinstance(m, Quantity)), None)
    if quantity is not None:
        return lambda value, path, found: found.append((path, quantity, value))
    origin, arguments = get_origin(annotation), get_args(annotation)
    result: Collect | None = None
    if origin is Annotated:
        result = _collector(arguments[0], arguments[1:])
    elif origin is dict:
        result = _each(_collector(arguments[1]), dict.items)
    elif origin is tuple and arguments[-1] is Ellipsis:
        result = _each(_collector(arguments[0]), enumerate)
    elif origin is tuple:
        result = _entries([_collector(a) for a in arguments])
    elif origin in (Union, UnionType):
        result = _alternatives([a for a in arguments if a is not NoneType])
    elif isinstance(annotation, type) and issubclass(annotation, Part):
        result = _collect_part
    return result


def _each(inner: Collect | None, items: Callable[[Any], Any]) -> Collect | None:
    if inner is None:
        return None

    def collect(value: Any, path: Path, found: Found) -> None:
        for key, entry in items(value):
            inner(entry, (*path, key), found)

    return collect


def _entries(inner: list[Collect | None]) -> Collect | None:
    if not any(inner):
        return None

    def collect(value: Any, path: Path, found: Found) -> None:
        for i, (each, entry) in enumerate(zip(inner, value, strict=True)):
            if each is not None:
                each(entry, (*path, i), found)

    return collect


def _alternatives(kinds: list[Any]) -> Collect | None:
    """A union: parts find their own way, and tuples are told apart by their lengths."""
    tuples = {_length(_bare(kind)): _collector(kind) for kind in kinds if get_origin(_bare(kind)) is tuple}
    others = [c for c in map(_collector, kinds) if c is not None]
    if not others:
        return None
    first = others[0]

    def collect(value: Any, path: Path, found: Found) -> None:
        if isinstance(value, Part):
            _collect_part(value, path, found)
        elif isinstance(value, tuple):
            (tuples.get(len(value)) or tuples.get(ANY_LENGTH) or first)(value, path, found)
        elif isinstance(value, float | Expression):
            first(value, path, found)

    return collect


ANY_LENGTH = -1


def _length(kind: Any) -> int:
    """How many entries a tuple of a kind has."""
    return ANY_LENGTH if get_args(kind)[-1] is Ellipsis else len(get_args(kind))


def _bare(annotation: Any) -> Any:
    return get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation


def parameter_at(path: Path) -> str:
    """The parameter of which a number of any dimension at a path of a mechanism is a value, a bound or a deviation."""
    if path[0] == "studies":
        return str(path[4])
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

    def own(expression: Expression) -> Scalar:
        found = expression.substituted(values)
        return found if found.names else float(found.evaluate({}))

    return _with_expressions(item, own)


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
        own = item.__dict__.items()
        changed = {name: new for name, old in own if (new := _with_expressions(old, change)) is not old}
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
            if not np.all(np.isfinite(values[name])):
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
            if not np.all(np.isfinite(values[name])):
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


def _float_or_array(value: Any) -> Any:
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
        if not np.all(np.isfinite(value)):
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
        low, high = map(plain, bounds(name, parameter, values))
        value = np.asarray(plain(values[name]))
        for bound, broken in ((low, value < low), (high, value > high)):
            if np.any(broken):
                found = float(np.atleast_1d(value)[np.atleast_1d(broken)][0])
                limit = float(np.broadcast_to(bound, np.shape(broken))[broken].flat[0])
                side = "below its minimum" if bound is low else "above its maximum"
                raise OptionError(f"parameter {name} = {parameter.written(found)} is {side} {parameter.written(limit)}")


def bounds(name: str, parameter: Parameter, values: Mapping[str, Value]) -> tuple[Value, Value]:
    """Smallest and largest permitted value of a parameter, infinite where none is given."""
    low = -np.inf if parameter.minimum is None else _value(name, parameter.minimum, values)
    high = np.inf if parameter.maximum is None else _value(name, parameter.maximum, values)
    return low, high
