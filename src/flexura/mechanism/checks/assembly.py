"""Checks of how substructures are put together, and the description reduced to what can be laid out."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

from flexura.errors import Problem
from flexura.mechanism.checks.survey import prefix, suggestion
from flexura.mechanism.evaluation import dependency_order
from flexura.mechanism.layout import TOP, Layout
from flexura.mechanism.substructure import Instance, Mechanism, MirrorPattern, Substructure

MAX_INSTANCES = 200_000
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
    placed: dict[str, int] = {}
    depth: dict[str, int] = {}
    for name in order:
        instances = prototypes[name].instances
        depth[name] = 1 + max((depth[i.of] for i in instances.values()), default=0)
        placed[name] = 1 + sum(number_of_copies(i) * placed[i.of] for i in instances.values())
        path = (*prefix(name), "instances")
        if depth[name] > MAX_NESTING:
            return Problem(path, "", f"substructures nest at most {MAX_NESTING} deep")
        if placed[name] > MAX_INSTANCES:
            rule = f"at most {MAX_INSTANCES} substructures can be placed"
            return Problem(path, f"{placed[name]} of them" if placed[name] < 10**12 else "", rule)
    return None


def number_of_copies(instance: Instance) -> int:
    """How many times an instance is placed by its patterns."""
    return math.prod(2 if isinstance(p, MirrorPattern) else p.count for p in instance.pattern)
