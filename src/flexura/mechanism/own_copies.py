"""Giving every copy of a part parameters of its own, as parts have that were made one by one."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.expressions import Expression, Name
from flexura.mechanism.base import LONGEST_NAME
from flexura.mechanism.evaluation import expressions, substituted
from flexura.mechanism.parameters import Parameter
from flexura.mechanism.placement import copies
from flexura.mechanism.quantity import Scalar
from flexura.mechanism.specialised import TOP, Specialised
from flexura.mechanism.substructure import Instance, Mechanism, Substructure, bindings

Path = tuple[str, ...]


@verb
def with_own_copies(mechanism: Mechanism, names: Iterable[str]) -> tuple[Mechanism, dict[str, dict[str, str]]]:
    """The mechanism with parameters of its own for every placed copy of a part that depends on one of some parameters.

    Returns with it, for each of `names`, the parameter of every instance by its path, such as
    `{"thickness": {"leaf1": "thickness_leaf1", "half2.leaf1": "thickness_half2_leaf1"}}`. The path of the mechanism's
    own parts is empty; these keep the parameter itself, and so does a parameter that no instance depends on. Values are
    what they were: they follow from the parameter until they are replaced. Bounds are those of the parameter.

    Raises OptionError for names that are no parameters.
    """
    chosen = tuple(dict.fromkeys(names))
    for name in chosen:
        if name not in mechanism.parameters:
            close = get_close_matches(name, mechanism.parameters, n=1)
            known = ", ".join(mechanism.parameters) or "none"
            hint = f"did you mean {close[0]!r}?" if close else f"parameters: {known}"
            raise OptionError(f"{name!r} is not a parameter; {hint}")
    return _Copied(mechanism, chosen).result()


@dataclass(frozen=True)
class _Scope:
    """Parameters inside a copy that are not those outside, over the parameters of the mechanism, and those of them
    that do not follow from others."""

    values: Mapping[str, Scalar]
    given: frozenset[str]


class _Copied:
    """A mechanism whose copies are given parameters of their own."""

    def __init__(self, mechanism: Mechanism, names: tuple[str, ...]) -> None:
        self.mechanism, self.names = mechanism, names
        self.known = Specialised(mechanism)
        self.parameters = dict(mechanism.parameters)
        self.found: dict[str, dict[str, str]] = {name: {} for name in names}
        self.slots: dict[tuple[str, Path, str], str] = {}
        """The parameter that stands in a prototype for one of its own copies, by its path there."""
        self.given: dict[tuple[str, str], dict[str, dict[str, Scalar]]] = defaultdict(lambda: defaultdict(dict))
        """What instances of a prototype are given: by prototype and instance, then by copy."""

    def result(self) -> tuple[Mechanism, dict[str, dict[str, str]]]:
        """The mechanism and the names of the parameters of its copies."""
        self._walk(TOP, (), [TOP], _Scope({}, frozenset()))
        for name in self.names:
            self.found[name] = self.found[name] or {"": name}
        parts = {name: self._changed(name, part) for name, part in self.mechanism.substructures.items()}
        top = self._changed(TOP, self.mechanism)
        return top.replaced({"substructures": parts, "parameters": self.parameters}), self.found

    def _walk(self, prototype: str, path: Path, above: list[str], scope: _Scope) -> None:
        """Give parameters to what is placed at a path and below; `above` are the prototypes along the path."""
        part = self.known.prototype(prototype)
        reads = self._reads(prototype, part, scope)
        for name in self.names:
            if name in reads and not path:
                self.found[name][""] = name
            elif name in reads:
                self._give(name, path, above, scope)
        for key, instance in part.instances.items():
            for copy, _ in copies(key, instance):
                inner = self._inner(scope, bindings(instance, copy))
                self._walk(instance.of, (*path, copy), [*above, instance.of], inner)

    def _reads(self, prototype: str, part: Substructure, scope: _Scope) -> set[str]:
        """Parameters that a part depends on by itself, or hands on to values that instances in it have."""
        own = self.known.read_by(prototype)
        for key, instance in part.instances.items():
            for copy, _ in copies(key, instance):
                values = bindings(instance, copy).items()
                own |= {n for name, v in values if name not in self.names for e in expressions(v) for n in e.names}
        found: set[str] = set()
        pending = list(own)
        while pending:
            name = pending.pop()
            if name in found or name not in self.mechanism.parameters:
                continue
            found.add(name)
            if name not in scope.given and name not in self.names:
                pending += [n for e in expressions(self.mechanism.parameters[name].value) for n in e.names]
        return found

    def _inner(self, outer: _Scope, values: Mapping[str, Scalar]) -> _Scope:
        """The scope inside a copy with some values of its own."""
        own = {name: substituted(value, outer.values) for name, value in values.items()}
        given = outer.given | own.keys()
        found = {name: value for name, value in outer.values.items() if name in outer.given} | own
        for name in self.known.order:
            value = self.mechanism.parameters[name].value
            if name not in given and isinstance(value, Expression) and not value.names.isdisjoint(found):
                found[name] = substituted(value, found)
        return _Scope(found, given)

    def _give(self, name: str, path: Path, above: list[str], scope: _Scope) -> None:
        """Give the copy at a path a parameter of its own, through the prototypes along the path."""
        inside = name
        for level in reversed(range(len(path))):
            rest, prototype = path[level:], above[level]
            slot = self.slots.get((prototype, rest, name))
            if slot is None:
                value = scope.values.get(name, Expression(Name(name))) if prototype == TOP else Expression(Name(name))
                slot = self.slots[prototype, rest, name] = self._add(name, prototype, rest, value)
            part = self.known.prototype(prototype)
            key = next(k for k, own in part.instances.items() if rest[0] in _names(k, own))
            self.given[prototype, key][rest[0]][inside] = Expression(Name(slot))
            inside = slot
        self.found[name][".".join(path)] = inside

    def _add(self, name: str, prototype: str, path: Path, value: Scalar) -> str:
        """Add a parameter with a legal name that is not taken."""
        text = "_".join((name, *(("in", prototype) if prototype else ()), *path))
        own, count = text[:LONGEST_NAME], 1
        while own in self.parameters:
            count += 1
            own = f"{text[: LONGEST_NAME - 6]}_{count}"
        update: dict[str, Any] = {"value": value, "source": f"{name} of {'.'.join(path)}"}
        if prototype:
            update |= {"minimum": None, "maximum": None}
        parameter: Parameter = self.mechanism.parameters[name]
        self.parameters[own] = parameter.replaced(update)
        return own

    def _changed(self, prototype: str, part: Any) -> Any:
        """A prototype with what its instances are given."""
        instances = dict(part.instances)
        for key, instance in part.instances.items():
            own = self.given.get((prototype, key))
            if own:
                joined = {copy: instance.copies.get(copy, {}) | own.get(copy, {}) for copy, _ in copies(key, instance)}
                given = {copy: values for copy, values in joined.items() if values}
                instances[key] = instance.replaced({"copies": given})
        return part.replaced({"instances": instances})


def _names(key: str, instance: Instance) -> set[str]:
    return {copy for copy, _ in copies(key, instance)}
