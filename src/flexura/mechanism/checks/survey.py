"""What the checks share: the description in numbers, how it is laid out, and where it could not be followed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

from flexura.errors import Path, Problem
from flexura.mechanism.description import Instance, Mechanism, Substructure
from flexura.mechanism.evaluation import dependency_order
from flexura.mechanism.instances import origin_of
from flexura.mechanism.layout import TOP, Layout, Point
from flexura.mechanism.patterns import MirrorPattern
from flexura.sizes import beyond

MAX_SUGGESTIONS_FROM = 2000
"""Names among which a close match is sought: a mechanism may have tens of thousands."""


@dataclass(frozen=True)
class Use:
    """Nodes that a part of a prototype refers to; `joins` tells whether it ties them together."""

    path: Path
    nodes: list[str]
    joins: bool


@dataclass
class Survey:
    """A mechanism under check.

    `layout` holds the mechanism with numbers for expressions (NaN where one has no value) and without the
    instances that cannot be followed, whose names are in `lost` by prototype. `ignored` are names that are
    known to be missing.
    """

    layout: Layout
    lost: dict[str, set[str]]
    ignored: Collection[str]
    partial: bool
    positions: dict[str, dict[str, Point]] = field(default_factory=dict)
    uses: dict[str, list[Use]] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    size: float = 0.0

    def report(self, path: Path, value: Any, rule: str, hint: str = "") -> None:
        """Note one problem."""
        self.problems.append(Problem(path, shown(value), rule, hint))


def prefix(prototype: str) -> Path:
    """Path of a prototype in the description."""
    return () if prototype == TOP else ("substructures", origin_of(prototype))


def shown(value: Any) -> str:
    """A value as it stands in a message."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def suggestion(name: str, known: Iterable[str], what: str) -> str:
    """A hint towards the name that was meant."""
    names = list(dict.fromkeys(known))
    if len(names) > MAX_SUGGESTIONS_FROM:
        names = [n for n in names if n[:1] == name[:1]][:MAX_SUGGESTIONS_FROM]
    close = get_close_matches(name, names, n=3)
    if close:
        return f"did you mean {' or '.join(close)}?"
    if not names:
        return f"there are no {what}"
    return f"{what}: {', '.join(names[:12])}{', ...' if len(names) > 12 else ''}"


MAX_NESTING = 100


def check_assembly(
    mechanism: Mechanism, ignored: Collection[str]
) -> tuple[Layout | None, dict[str, set[str]], list[Problem]]:
    """Lay the mechanism out without the instances that cannot be followed.

    Returns the layout (None when it would be too large), the names left out by prototype, and what is wrong.
    """
    prototypes: dict[str, Substructure] = {TOP: mechanism, **mechanism.substructures}
    lost, found = _unknown(prototypes, ignored)
    while True:
        graph = {
            name: {i.of for key, i in prototype.instances.items() if key not in lost[name]}
            for name, prototype in prototypes.items()
        }
        order, cycles = dependency_order(graph)
        if not cycles:
            break
        for cycle in cycles:
            for name, needed in zip(cycle, [*cycle[1:], cycle[0]], strict=True):
                keys = [key for key, i in prototypes[name].instances.items() if i.of == needed]
                lost[name].update(keys)
                if name == cycle[0]:
                    path, chain = (*prefix(name), "instances", keys[0], "of"), " -> ".join([*cycle, cycle[0]])
                    found.append(Problem(path, chain, "a substructure cannot contain itself"))
    kept: dict[str, Any] = {
        name: prototype.replaced({"instances": {k: i for k, i in prototype.instances.items() if k not in lost[name]}})
        if lost[name]
        else prototype
        for name, prototype in prototypes.items()
    }
    too_large = _too_large(kept, order)
    if too_large:
        return None, lost, [*found, too_large]
    top = kept.pop(TOP)
    layout = Layout(top.replaced({"substructures": kept}))
    for name in mechanism.substructures:
        layout.include(name)
    return layout, lost, found


def _unknown(
    prototypes: dict[str, Substructure], ignored: Collection[str]
) -> tuple[dict[str, set[str]], list[Problem]]:
    lost: dict[str, set[str]] = {name: set() for name in prototypes}
    found = []
    known = [name for name in prototypes if name != TOP]
    for name, prototype in prototypes.items():
        for key, instance in prototype.instances.items():
            if instance.of == TOP or instance.of not in prototypes:
                lost[name].add(key)
                if instance.of not in ignored:
                    path = (*prefix(name), "instances", key, "of")
                    hint = suggestion(instance.of, known, "substructures")
                    found.append(Problem(path, instance.of, "there is no such substructure", hint))
    return lost, found


def _too_large(prototypes: dict[str, Substructure], order: list[str]) -> Problem | None:
    placed: dict[str, Counter[str]] = {}
    depth: dict[str, int] = {}
    for name in order:
        instances = prototypes[name].instances
        depth[name] = 1 + max((depth[i.of] for i in instances.values()), default=0)
        placed[name] = _own_sizes(prototypes[name])
        for instance in instances.values():
            count = number_of_copies(instance)
            placed[name] += Counter({what: count * size for what, size in placed[instance.of].items()})
        if depth[name] > MAX_NESTING:
            return Problem((*prefix(name), "instances"), "", f"substructures nest at most {MAX_NESTING} deep")
        for what, size in placed[name].items():
            if found := beyond(what, size):
                return Problem((*prefix(name), "instances") if instances else prefix(name), *found)
    return None


def _own_sizes(prototype: Substructure) -> Counter[str]:
    """What one copy of a prototype adds to the limits of size, before any of it is laid out."""
    cut = [member.elements for _, _, member in prototype.members()]
    amplitudes = sum(-(-part.amplitudes // 6) for part in prototype.superelements.values())
    nodes = len(prototype.nodes) + len(prototype.bodies) + sum(cut) - len(cut) + amplitudes
    return Counter({"copies": 1, "nodes": nodes, "elements": sum(cut)})


def number_of_copies(instance: Instance) -> int:
    """How many times an instance is placed by its patterns."""
    return math.prod(2 if isinstance(p, MirrorPattern) else p.count for p in instance.pattern)
