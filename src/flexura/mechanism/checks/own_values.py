"""Checks of values that instances have of their own, and of the parts with these values."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from flexura.errors import Path, Problem
from flexura.mechanism.checks.survey import prefix, suggestion
from flexura.mechanism.checks.values import Known, defaults, invalid_at, outside_bounds
from flexura.mechanism.layout import Layout
from flexura.mechanism.placement import copies
from flexura.mechanism.substructure import Instance


def check_own_values(layout: Layout, values: Known, ignored: Collection[str]) -> list[Problem]:
    """What is wrong with values that instances have of their own; these are added to the values of parameters."""
    described = layout.specialised.mechanism
    found = [
        problem
        for name, part in {"": described, **described.substructures}.items()
        for key, instance in part.instances.items()
        for problem in _of_instance(layout, (*prefix(name), "instances", key), instance, ignored)
    ]
    own = layout.specialised.parameters
    known, _ = defaults({**layout.mechanism.parameters, **own})
    for name in own:
        if name in known:
            values[name] = known[name]
            for problem in outside_bounds(name, own[name], known):
                found.append(Problem(layout.specialised.places[name], problem.value, problem.rule, problem.hint))
    for name, part in layout.specialised.substructures.items():
        found += invalid_at(part, prefix(name), values)
    return found


def _of_instance(layout: Layout, path: Path, instance: Instance, ignored: Collection[str]) -> Iterator[Problem]:
    names = [copy for copy, _ in copies(str(path[-1]), instance)] if instance.copies else []
    for copy in instance.copies:
        if copy not in names:
            hint = suggestion(copy, names, "copies")
            yield Problem((*path, "copies", copy), copy, "there is no such copy", hint)
    depends = layout.specialised.depends(instance.of)
    groups = {(*path, "with"): instance.with_, **{(*path, "copies", c): own for c, own in instance.copies.items()}}
    for place, own in groups.items():
        for name in own:
            if name in ignored:
                continue
            if name not in layout.mechanism.parameters:
                hint = suggestion(name, layout.mechanism.parameters, "parameters")
                yield Problem((*place, name), name, "there is no such parameter", hint)
            elif name not in depends:
                hint = suggestion(name, sorted(depends), "parameters that it depends on")
                yield Problem((*place, name), name, f"the substructure {instance.of} does not depend on it", hint)
