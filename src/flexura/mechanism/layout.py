"""Who is who in a description: prototypes, instances, node references. Names only, no numbers.

The mechanism itself is the prototype with the empty name.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

from flexura.mechanism.channels import Actuator
from flexura.mechanism.evaluation import evaluated
from flexura.mechanism.placement import Step, copies
from flexura.mechanism.specialised import TOP, Specialised
from flexura.mechanism.substructure import Mechanism, Substructure


@dataclass(frozen=True)
class Child:
    """One placed copy of a prototype inside another."""

    name: str
    prototype: str
    steps: tuple[Step, ...]


@dataclass
class Layout:
    """Prototypes of a mechanism that are in use, children before parents, and what each exposes.

    A prototype is a substructure, or one with the values that an instance has of its own (`origin_of`); copies with
    equal values share one. `mechanism` holds these beside what is described, and the parameters and materials that are
    theirs.

    Raises KeyError when a prototype is not defined and RecursionError when one contains itself; a description that
    passed its checks does neither.
    """

    mechanism: Mechanism
    prototypes: dict[str, Substructure] = field(init=False, default_factory=dict)
    children: dict[str, list[Child]] = field(init=False, default_factory=dict)
    specialised: Specialised = field(init=False)

    def __post_init__(self) -> None:
        self.specialised = Specialised(self.mechanism)
        self.include(TOP)

    def include(self, name: str) -> None:
        """Add a prototype and those inside it, whether or not the mechanism uses it."""
        self._include(name, ())
        self.mechanism = self.specialised.whole

    def _include(self, name: str, above: tuple[str, ...]) -> None:
        if name in above:
            raise RecursionError(f"substructure {name} contains itself")
        if name in self.prototypes:
            return
        prototype = self.specialised.prototype(name)
        found = []
        for key, instance in prototype.instances.items():
            for copy, steps in copies(key, instance):
                of = self.specialised.of_copy(name, key, copy)
                self._include(of, (*above, name))
                found.append(Child(copy, of, steps))
        self.children[name] = found
        self.prototypes[name] = prototype

    def evaluate(self, values: Mapping[str, float]) -> None:
        """Put numbers in the place of all expressions of the prototypes, which belong to one design from then on."""
        self.mechanism = evaluated(self.mechanism, values)
        self.prototypes = {name: evaluated(part, values) for name, part in self.prototypes.items()}

    def own_nodes(self, name: str) -> list[str]:
        """Nodes declared in a prototype, and its bodies, which are nodes too."""
        prototype = self.prototypes[name]
        return [*prototype.nodes, *prototype.bodies]

    def exposed(self, name: str) -> list[str]:
        """Nodes that a prototype's own parts may refer to: its own and the interfaces of its instances."""
        of_children = [
            f"{child.name}.{node}" for child in self.children[name] for node in self.interface(child.prototype)
        ]
        return self.own_nodes(name) + of_children

    def interface(self, name: str) -> list[str]:
        """Interface nodes of a prototype, as its parent writes them behind the instance's name."""
        return list(self.prototypes[name].interface)

    def actuators(self) -> dict[str, Actuator]:
        """Actuators as placed, by `NAME` or `INSTANCE.NAME`."""
        return {
            ".".join((*path, key)): actuator
            for path, name in self.instances()
            for key, actuator in self.prototypes[name].actuators.items()
        }

    def instances(self) -> Iterator[tuple[tuple[str, ...], str]]:
        """Every placed prototype as (path, prototype), parents before children; the mechanism has the empty path."""
        stack: list[tuple[tuple[str, ...], str]] = [((), TOP)]
        while stack:
            path, name = stack.pop()
            yield path, name
            stack.extend(((*path, c.name), c.prototype) for c in reversed(self.children[name]))


def is_pattern(text: str) -> bool:
    """True when a node reference holds wildcards."""
    return re.search(r"[*?]", text) is not None


def matching(text: str, names: Iterable[str]) -> list[str]:
    """Names that a reference stands for, in natural order of appearance."""
    if not is_pattern(text):
        return [name for name in names if name == text]
    return [name for name in names if fnmatchcase(name, text)]
