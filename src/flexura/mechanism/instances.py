"""Instances with values of their own: prototypes of such instances, and parameters for every copy of a part.

Parameters of prototypes, and whatever follows from them, have names that no name that a user gives can equal."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from flexura.arguments import verb
from flexura.errors import Path
from flexura.expressions import Expression, Name
from flexura.mechanism.base import LONGEST_NAME
from flexura.mechanism.description import Instance, Mechanism, Parameter, Substructure, bindings
from flexura.mechanism.evaluation import expressions, parameter_order, renamed, substituted
from flexura.mechanism.material import Material
from flexura.mechanism.member import Flexure, Link
from flexura.mechanism.placement import copies
from flexura.mechanism.quantity import Scalar
from flexura.mechanism.section import Layered

AT = " at "
TOP = ""


def origin_of(prototype: str) -> str:
    """The substructure that a prototype is, whatever values of its own an instance gives it."""
    return prototype.partition(AT)[0]


@dataclass(frozen=True)
class _Scope:
    """What parameters are called inside a prototype: `names` of those that differ, `given` of those that do not follow
    from others."""

    names: Mapping[str, str] = field(default_factory=dict)
    given: frozenset[str] = frozenset()


class Specialised:
    """Substructures of a mechanism, and copies of them in which parameters have other values.

    `parameters` are those that instances have for themselves; `follows` says of which parameter each is that is worked
    out as it is; `places` where the values stand in the description. `materials` are those that depend on them.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.parameters: dict[str, Parameter] = {}
        self.follows: dict[str, str] = {}
        self.places: dict[str, Path] = {}
        self.materials: dict[str, Material] = {}
        self.substructures: dict[str, Substructure] = {}
        self.order: list[str] = parameter_order(mechanism.parameters)[0]
        self._scopes: dict[str, _Scope] = {}
        self._reads: dict[str, frozenset[str]] = {}
        self._interned: dict[tuple[object, ...], str] = {}
        self._known: dict[tuple[str, frozenset[tuple[str, str]]], str] = {}

    @property
    def whole(self) -> Mechanism:
        """The mechanism with all that instances have for themselves beside what it describes."""
        if not self.substructures:
            return self.mechanism
        described = self.mechanism
        return described.replaced(
            {
                "parameters": {**described.parameters, **self.parameters},
                "materials": {**described.materials, **self.materials},
                "substructures": {**described.substructures, **self.substructures},
            }
        )

    def prototype(self, name: str) -> Substructure:
        """The prototype of a name."""
        if name == TOP:
            return self.mechanism
        return self.substructures.get(name) or self.mechanism.substructures[name]

    def of_copy(self, parent: str, key: str, copy: str) -> str:
        """The prototype of one copy of an instance inside another prototype."""
        instance = self.prototype(parent).instances[key]
        if not (instance.with_ or instance.copies or parent in self._scopes):
            return instance.of
        label = f"{copy} of {parent}" if parent else copy
        path: Path = (*(("substructures", origin_of(parent)) if parent else ()), "instances", key)
        depends = self.depends(instance.of)
        values = {name: value for name, value in bindings(instance, copy).items() if name in depends}
        scope = self._inner(self._scopes.get(parent, _Scope()), values, label, path)
        names = {name: scope.names[name] for name in scope.names if name in depends}
        if not names:
            return instance.of
        found = self._known.get((instance.of, frozenset(names.items())))
        if found is None:
            found = self._known[instance.of, frozenset(names.items())] = f"{instance.of}{AT}{label}"
            self._scopes[found] = scope
            base = self.mechanism.substructures.get(found) or self.mechanism.substructures[instance.of]
            self.substructures[found] = self._renamed(base, names, label)
        return found

    def _inner(self, outer: _Scope, values: Mapping[str, Scalar], label: str, path: Path) -> _Scope:
        """The names inside an instance with some values of its own; derived parameters follow where none is given."""
        parameters = self.mechanism.parameters
        given = {n: v for n, v in values.items() if n in parameters and not _is_name(v, outer.names.get(n, n))}
        if not given:
            return outer
        kept = outer.given | given.keys()
        names = {name: inside for name, inside in outer.names.items() if name in outer.given}
        for name in self.order:
            value = parameters[name].value
            if name in given:
                names[name] = self._own(name, given[name], names, label, path)
            elif name not in kept and isinstance(value, Expression) and not value.names.isdisjoint(names):
                names[name] = self._own(name, renamed(value, names), names, label, path)
                self.follows[names[name]] = name
        return _Scope(names, kept)

    def _own(self, name: str, value: Scalar, names: Mapping[str, str], label: str, path: Path) -> str:
        """The name of a parameter with a value of its own; equal ones are one."""
        bounded = renamed(self.mechanism.parameters[name], {n: inside for n, inside in names.items() if n != name})
        if bounded.minimum is not None and bounded.minimum == bounded.maximum:  # held, which is said of its own value
            bounded = bounded.replaced({"minimum": None, "maximum": None})
        key = (name, value, bounded.minimum, bounded.maximum)
        found = self._interned.setdefault(key, f"{name}{AT}{label}")
        if found not in self.parameters:
            self.parameters[found] = bounded.replaced({"value": value})
            self.places[found] = path
        return found

    def _renamed(self, part: Substructure, names: Mapping[str, str], label: str) -> Substructure:
        part = renamed(part, names).with_members(lambda member: self._member(member, names, label))
        bodies = dict(part.bodies)
        for key, body in part.bodies.items():
            if body.solid is not None:
                material = self._material(body.solid.material, names, label)
                bodies[key] = body.replaced({"solid": body.solid.replaced({"material": material})})
        diaphragms = {
            key: diaphragm.replaced({"material": self._material(diaphragm.material, names, label)})
            for key, diaphragm in part.diaphragms.items()
        }
        springs = {
            key: spring.replaced({"material": self._material(spring.material, names, label)})
            for key, spring in part.flat_springs.items()
        }
        return part.replaced({"bodies": bodies, "diaphragms": diaphragms, "flat_springs": springs})

    def _member(self, member: Link | Flexure, names: Mapping[str, str], label: str) -> Link | Flexure:
        """A member with its material and its section as they are here."""
        update: dict[str, object] = {"material": self._material(member.material, names, label)}
        if isinstance(member, Flexure) and isinstance(member.profile, Layered):
            layers = tuple(
                layer
                if layer.material is None
                else layer.replaced({"material": self._material(layer.material, names, label)})
                for layer in member.profile.layers
            )
            update["profile"] = member.profile.replaced({"layers": layers})
        if isinstance(member, Link) and isinstance(member.section, str):
            section = self.mechanism.sections.get(member.section)
            if section is not None and any(not e.names.isdisjoint(names) for e in expressions(section)):
                update["section"] = renamed(section, names)
        return member.replaced(update)

    def _material(self, name: str, names: Mapping[str, str], label: str) -> str:
        material = self.mechanism.materials.get(name)
        if not isinstance(material, Material) or all(e.names.isdisjoint(names) for e in expressions(material)):
            return name
        changed = renamed(material, names)
        found = next((key for key, known in self.materials.items() if known == changed), f"{name}{AT}{label}")
        self.materials[found] = changed
        return found

    def depends(self, name: str) -> frozenset[str]:
        """Parameters that a substructure depends on, by itself or by what is nested in it."""
        return self._closure(self._read_in(name))

    def _closure(self, names: Iterable[str]) -> frozenset[str]:
        found: set[str] = set()
        pending = list(names)
        while pending:
            name = pending.pop()
            if name not in found and name in self.mechanism.parameters:
                found.add(name)
                value = self.mechanism.parameters[name].value
                pending += value.names if isinstance(value, Expression) else ()
        return frozenset(found)

    def _read_in(self, name: str) -> frozenset[str]:
        """Parameters that a substructure reads in its own scope."""
        if name not in self._reads:
            instances = self.prototype(name).instances.values()
            nested = [n for instance in instances for n in self._read_by_instance(instance)]
            self._reads[name] = frozenset({*self.read_by(name), *nested})
        return self._reads[name]

    def read_by(self, name: str) -> set[str]:
        """Parameters that a substructure reads by itself: in its parts, and where it places instances."""
        part = self.prototype(name)
        placing = [instance.replaced({"with_": {}, "copies": {}}) for instance in part.instances.values()]
        parts = [getattr(part, kind) for kind in Substructure.model_fields if kind != "instances"]
        return {n for e in expressions((*parts, *placing, *self._materials_and_sections(part))) for n in e.names}

    def _read_by_instance(self, instance: Instance) -> set[str]:
        """Parameters outside an instance that its inside reads, and its values of its own."""
        found: set[str] = set()
        for values in [bindings(instance, copy) for copy in ("", *instance.copies)]:
            inside = set(self._read_in(instance.of))
            seen: set[str] = set()
            while inside:
                name = inside.pop()
                seen.add(name)
                parameter = self.mechanism.parameters.get(name)
                derived = parameter.value if parameter is not None and isinstance(parameter.value, Expression) else None
                if name in values:
                    value = values[name]
                    found |= value.names if isinstance(value, Expression) else set()
                elif derived is not None and not self._closure([name]).isdisjoint(values):
                    inside |= derived.names - seen
                else:
                    found.add(name)
        return found

    def _materials_and_sections(self, part: Substructure) -> tuple[object, ...]:
        described = self.mechanism
        members = [member for _, _, member in part.members()]
        solids = [body.solid for body in part.bodies.values() if body.solid is not None]
        layers = [layer for m in part.flexures.values() if isinstance(m.profile, Layered) for layer in m.profile.layers]
        named = (*members, *part.diaphragms.values(), *part.flat_springs.values(), *solids, *layers)
        materials = [described.materials.get(item.material or "") for item in named]
        sections = [described.sections.get(m.section) for m in part.links.values() if isinstance(m.section, str)]
        return tuple(item for item in (*materials, *sections) if item is not None and not isinstance(item, str))


def _is_name(value: Scalar, name: str) -> bool:
    return isinstance(value, Expression) and value.tree == Name(name)


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
        mechanism.parameter(name)
    return _Copied(mechanism, chosen).result()


@dataclass(frozen=True)
class _Values:
    """Values of parameters inside a copy that are not those outside, over the parameters of the mechanism, and the
    names of those `given`, which do not follow from others."""

    values: Mapping[str, Scalar]
    given: frozenset[str]


class _Copied:
    """A mechanism whose copies are given parameters of their own."""

    def __init__(self, mechanism: Mechanism, names: tuple[str, ...]) -> None:
        self.mechanism, self.names = mechanism, names
        self.known = Specialised(mechanism)
        self.parameters = dict(mechanism.parameters)
        self.found: dict[str, dict[str, str]] = {name: {} for name in names}
        self.slots: dict[tuple[str, tuple[str, ...], str], str] = {}
        """The parameter that stands in a prototype for one of its own copies, by its path there."""
        self.given: dict[tuple[str, str], dict[str, dict[str, Scalar]]] = defaultdict(lambda: defaultdict(dict))
        """What instances of a prototype are given: by prototype and instance, then by copy."""

    def result(self) -> tuple[Mechanism, dict[str, dict[str, str]]]:
        """The mechanism and the names of the parameters of its copies."""
        self._walk(TOP, (), [TOP], _Values({}, frozenset()))
        for name in self.names:
            self.found[name] = self.found[name] or {"": name}
        parts = {name: self._changed(name, part) for name, part in self.mechanism.substructures.items()}
        top = self._changed(TOP, self.mechanism)
        return top.replaced({"substructures": parts, "parameters": self.parameters}), self.found

    def _walk(self, prototype: str, path: tuple[str, ...], above: list[str], scope: _Values) -> None:
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

    def _reads(self, prototype: str, part: Substructure, scope: _Values) -> set[str]:
        """Parameters that a part depends on by itself, or hands on to values that instances in it have."""
        read = self.known.read_by(prototype)
        for key, instance in part.instances.items():
            for copy, _ in copies(key, instance):
                values = bindings(instance, copy).items()
                read |= {n for name, v in values if name not in self.names for e in expressions(v) for n in e.names}
        found: set[str] = set()
        pending = list(read)
        while pending:
            name = pending.pop()
            if name in found or name not in self.mechanism.parameters:
                continue
            found.add(name)
            if name not in scope.given and name not in self.names:
                pending += [n for e in expressions(self.mechanism.parameters[name].value) for n in e.names]
        return found

    def _inner(self, outer: _Values, values: Mapping[str, Scalar]) -> _Values:
        """The scope inside a copy with some values of its own."""
        given_values = {name: substituted(value, outer.values) for name, value in values.items()}
        given = outer.given | given_values.keys()
        found = {name: value for name, value in outer.values.items() if name in outer.given} | given_values
        for name in self.known.order:
            value = self.mechanism.parameters[name].value
            if name not in given and isinstance(value, Expression) and not value.names.isdisjoint(found):
                found[name] = substituted(value, found)
        return _Values(found, given)

    def _give(self, name: str, path: tuple[str, ...], above: list[str], scope: _Values) -> None:
        """Give the copy at a path a parameter of its own, through the prototypes along the path."""
        inside = name
        for level in reversed(range(len(path))):
            rest, prototype = path[level:], above[level]
            slot = self.slots.get((prototype, rest, name))
            if slot is None:
                value = scope.values.get(name, Expression(Name(name))) if prototype == TOP else Expression(Name(name))
                slot = self.slots[prototype, rest, name] = self._add(name, prototype, rest, value)
            part = self.known.prototype(prototype)
            key = next(k for k, instance in part.instances.items() if rest[0] in dict(copies(k, instance)))
            self.given[prototype, key][rest[0]][inside] = Expression(Name(slot))
            inside = slot
        self.found[name][".".join(path)] = inside

    def _add(self, name: str, prototype: str, path: tuple[str, ...], value: Scalar) -> str:
        """Add a parameter with a legal name that is not taken."""
        text = "_".join((name, *(("in", prototype) if prototype else ()), *path))
        new, count = text[:LONGEST_NAME], 1
        while new in self.parameters:
            count += 1
            new = f"{text[: LONGEST_NAME - 6]}_{count}"
        update: dict[str, Any] = {"value": value, "source": f"{name} of {'.'.join(path)}"}
        if prototype:
            update |= {"minimum": None, "maximum": None}
        parameter: Parameter = self.mechanism.parameters[name]
        self.parameters[new] = parameter.replaced(update)
        return new

    def _changed(self, prototype: str, part: Any) -> Any:
        """A prototype with what its instances are given."""
        instances = dict(part.instances)
        for key, instance in part.instances.items():
            values_of = self.given.get((prototype, key))
            if values_of:
                joined = {
                    copy: instance.copies.get(copy, {}) | values_of.get(copy, {}) for copy, _ in copies(key, instance)
                }
                given = {copy: values for copy, values in joined.items() if values}
                instances[key] = instance.replaced({"copies": given})
        return part.replaced({"instances": instances})
