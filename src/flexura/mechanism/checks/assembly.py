"""Checks of how substructures are put together, and the description reduced to what can be laid out."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection
from typing import Any

from flexura.errors import Problem
from flexura.mechanism.checks.survey import prefix, suggestion
from flexura.mechanism.evaluation import dependency_order
from flexura.mechanism.layout import TOP, Layout
from flexura.mechanism.substructure import Instance, Mechanism, MirrorPattern, Substructure
from flexura.sizes import beyond

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
        order, cycles = dependency_order(_graph(prototypes, lost))
        if not cycles:
            break
        for cycle in cycles:
            found.append(_cycle(prototypes[cycle[0]], cycle))
            for name, needed in zip(cycle, [*cycle[1:], cycle[0]], strict=True):
                lost[name] |= {key for key, i in prototypes[name].instances.items() if i.of == needed}
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


def _graph(prototypes: dict[str, Substructure], lost: dict[str, set[str]]) -> dict[str, set[str]]:
    return {
        name: {i.of for key, i in prototype.instances.items() if key not in lost[name]}
        for name, prototype in prototypes.items()
    }


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


def _cycle(prototype: Substructure, cycle: list[str]) -> Problem:
    key = next(k for k, i in prototype.instances.items() if i.of == cycle[1 % len(cycle)])
    chain = " -> ".join([*cycle, cycle[0]])
    return Problem((*prefix(cycle[0]), "instances", key, "of"), chain, "a substructure cannot contain itself")


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
    cut = [member.elements for member in (*prototype.links.values(), *prototype.flexures.values())]
    amplitudes = sum(-(-part.amplitudes // 6) for part in prototype.superelements.values())
    nodes = len(prototype.nodes) + len(prototype.bodies) + sum(cut) - len(cut) + amplitudes
    return Counter({"copies": 1, "nodes": nodes, "elements": sum(cut)})


def number_of_copies(instance: Instance) -> int:
    """How many times an instance is placed by its patterns."""
    return math.prod(2 if isinstance(p, MirrorPattern) else p.count for p in instance.pattern)
