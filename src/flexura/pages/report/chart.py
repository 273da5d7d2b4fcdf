"""Charts as data: what the script of the pages zooms and reads out, and what is drawn without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from flexura.arrays import Array
from flexura.results import plain
from flexura.tables import suited

DIGITS = 7
"""Significant digits of the values in a page."""


@dataclass(frozen=True)
class Curve:
    """Values (n,) over those of x; a `bound` with `upper` (n,) is the band between the two."""

    name: str
    values: Array
    style: Literal["line", "pinned", "bound"] = "line"
    upper: Array | None = None

    def scaled(self, factor: float) -> Curve:
        """The same, all values times a factor."""
        upper = None if self.upper is None else factor * self.upper
        return replace(self, values=factor * self.values, upper=upper)

    def to_data(self) -> dict[str, Any]:
        """Plain data; None where there is no value."""
        found: dict[str, Any] = {"name": self.name, "values": _short(self.values), "style": self.style}
        return found if self.upper is None else found | {"upper": _short(self.upper)}


@dataclass(frozen=True)
class Mark:
    """A vertical line with a label; `short` stands for it where there is no room."""

    x: float
    label: str
    short: str = ""


@dataclass(frozen=True)
class Panel:
    """Curves of one SI unit over the x axis of the chart, which are shown in the unit that suits them."""

    label: str
    unit: str
    log: bool
    curves: Sequence[Curve]

    def __post_init__(self) -> None:
        scale = suited([own.values[np.isfinite(own.values)].tolist() for own in self.curves], self.unit)
        object.__setattr__(self, "unit", scale.unit)
        object.__setattr__(self, "curves", [own.scaled(1 / scale.size) for own in self.curves])


@dataclass(frozen=True)
class Chart:
    """Panels below one another over x (n,), which ascends, and what is said of them to those who do not see them."""

    id: str
    title: str
    description: str
    label: str
    unit: str
    log: bool
    x: Array
    panels: Sequence[Panel]
    marks: Sequence[Mark] = ()

    def to_data(self) -> dict[str, Any]:
        """What the script takes."""
        marks = [{"x": own.x, "label": own.label, "short": own.short} for own in self.marks]
        panels = [
            {"label": own.label, "unit": own.unit, "log": own.log, "curves": [c.to_data() for c in own.curves]}
            for own in self.panels
        ]
        if panels:
            panels[0]["marks"] = marks
        axis = {"label": self.label, "unit": self.unit, "log": self.log, "values": _short(self.x)}
        return {"id": self.id, "title": self.title, "description": self.description, "x": axis, "panels": panels}


def _short(values: Array) -> list[Any]:
    return plain(np.array([float(f"{value:.{DIGITS}g}") for value in values]))
