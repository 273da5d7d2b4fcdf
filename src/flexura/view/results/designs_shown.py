"""Those designs of a study that a picture has room for, as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.study.engine import StudyTable, jumps_of
from flexura.view.drawing import named
from flexura.view.scene import Array

ALONG = 200
"""Values of a variable that a map or a curve has room for."""

PROVEN = 1e-3
"""Width of the interval of a proven value, over its lower end, is no more."""

LINES = 2000
"""Designs that are drawn one by one."""


@dataclass(frozen=True)
class DesignsShown:
    """Designs by heading (n,), SI: `varied` parameters, of more than one value, and what is `asked`; `lower` and
    `upper` proven bounds of some of it. `is_proven` (n,); `leaps` (n,) says of some of it where it goes over to another
    mode between a design and the one with the next larger value of the parameter."""

    varied: Mapping[str, Array]
    asked: Mapping[str, Array]
    lower: Mapping[str, Array]
    upper: Mapping[str, Array]
    is_proven: NDArray[np.bool_]
    leaps: Mapping[str, NDArray[np.bool_]]
    is_grid: bool
    logarithmic: frozenset[str]
    notes: tuple[str, ...]

    @cached_property
    def is_failed(self) -> NDArray[np.bool_]:
        """Designs (n,) of which something asked is missing."""
        return np.any([np.isnan(own) for own in self.asked.values()], axis=0)

    def is_doubted(self, heading: str) -> NDArray[np.bool_]:
        """Designs (n,) that have a value of something that can be proven, without an interval as narrow as that of a
        proven one."""
        value = self.asked[heading]
        with np.errstate(invalid="ignore"):
            narrow = self.upper[heading] - self.lower[heading] <= PROVEN * self.lower[heading]
        return np.isfinite(value) & ~self.is_proven & ~narrow


def designs_shown(table: StudyTable) -> DesignsShown:
    """The designs of a study, every so many where there are more than a picture has room for, which `notes` say.

    Raises OptionError for a shard that is damaged.
    """
    bounds = {own: _bounds(own) for own in table.asked}
    bounds = {own: both for own, both in bounds.items() if set(both) <= set(table.columns)}
    leaps = {own: found for own in table.asked if (found := jumps_of(own)) in table.columns}
    names = ["design", *table.parameters, *table.asked, *(name for both in bounds.values() for name in both)]
    names += leaps.values()
    steps = _steps(table)
    blocks = []
    for block in table.blocks([*names, "is proven"]):
        kept = _kept(block["design"], steps)
        blocks.append({name: own[kept] for name, own in block.items()})
    found = {name: np.concatenate([own[name] for own in blocks] or [np.empty(0)]) for name in (*names, "is proven")}
    several = [name for name in table.parameters if len(found["design"]) and np.ptp(found[name]) > 0]
    step = int(np.prod([step for _, step in steps]))
    return DesignsShown(
        {name: found[name] for name in several or table.parameters[:1]},
        {name: found[name] for name in table.asked},
        {name: found[both[0]] for name, both in bounds.items()},
        {name: found[both[1]] for name, both in bounds.items()},
        found["is proven"].astype(bool),
        {name: found[own].astype(bool) for name, own in leaps.items()},
        table.space.get("sampling") == "grid",
        frozenset(name for name in table.parameters if _variable(table, name).get("scale") == "log"),
        (f"one of {step} designs is drawn",) if step > 1 else (),
    )


def _bounds(heading: str) -> tuple[str, str]:
    name, unit = named(heading)
    tail = f" [{unit}]" if unit else ""
    return f"{name} lower{tail}", f"{name} upper{tail}"


def _variable(table: StudyTable, heading: str) -> Mapping[str, Any]:
    """The description of the variable of a column."""
    name = named(heading)[0].removeprefix("parameter ")
    return next((own for own in table.space.get("variables", ()) if own.get("name") == name), {})


def _steps(table: StudyTable) -> list[tuple[int, int]]:
    """How many values each variable of a grid takes, and of how many one is shown; all designs as one variable where
    they are drawn one by one."""
    variables = [_variable(table, name) for name in table.parameters]
    levels = [_levels(own) for own in variables]
    several = sum(own > 1 for own in levels)
    if table.space.get("sampling") == "grid" and np.prod(levels, dtype=float) == table.designs and several <= 2:
        most = ALONG if several == 2 else LINES
        return [(own, ceil(own / most)) for own in levels]
    return [(table.designs, ceil(table.designs / LINES))]


def _levels(variable: Mapping[str, Any]) -> int:
    if "values" in variable:
        return len(variable["values"])
    if variable.get("count") is None:
        return int(variable.get("high", 0) - variable.get("low", 0)) + 1 if variable.get("kind") == "integer" else 0
    return int(variable["count"])


def _kept(numbers: NDArray[np.int64], steps: list[tuple[int, int]]) -> NDArray[np.bool_]:
    kept = np.ones(len(numbers), dtype=bool)
    for levels, step in reversed(steps):
        numbers, place = np.divmod(numbers, max(levels, 1))
        kept &= place % step == 0
    return kept
