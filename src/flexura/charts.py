"""Charts as data: curves over an axis, in panels. Pictures draw them with Matplotlib, pages in SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.tables import suited

WIDE = 30.0
"""Ratio of positive values from which their axis is logarithmic."""


@dataclass(frozen=True)
class Axis:
    """A quantity and its unit, empty where there is none, in even steps or in equal ratios."""

    quantity: str = ""
    unit: str = ""
    log: bool = False

    @property
    def label(self) -> str:
        """What stands at the axis."""
        return ", ".join(part for part in (self.quantity, self.unit) if part)


@dataclass(frozen=True)
class Curve:
    """Values y (n,) over x (n,), NaN where there is none, with a name in the legend unless it is empty; with `upper`
    (n,) the band between the two. `style` are options of a line in Matplotlib that differ from those of its panel."""

    x: NDArray[Any]
    y: NDArray[Any]
    name: str = ""
    line: Literal["solid", "dashed", "dotted"] = "solid"
    upper: Array | None = None
    style: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Mark:
    """A vertical line with a label; `short` stands for it where there is no room."""

    x: float
    label: str = ""
    short: str = ""


@dataclass(frozen=True)
class Panel:
    """Curves over one pair of axes, in their units, and vertical lines."""

    curves: Sequence[Curve]
    x: Axis = Axis()
    y: Axis = Axis()
    title: str = ""
    marks: Sequence[Mark] = ()

    def suited(self) -> Panel:
        """The same with SI values y in the unit that suits them."""
        scale = suited([curve.y[np.isfinite(curve.y)].tolist() for curve in self.curves], self.y.unit)
        factor = 1 / scale.size
        curves = [
            replace(own, y=factor * own.y, upper=own.upper if own.upper is None else factor * own.upper)
            for own in self.curves
        ]
        return replace(self, curves=curves, y=replace(self.y, unit=scale.unit))


@dataclass(frozen=True)
class Chart:
    """Panels whose curves are all over one x (n,), with the marks of the first one, and what is said of them to those
    who do not see them."""

    id: str
    title: str
    description: str
    panels: Sequence[Panel]

    @property
    def x(self) -> Array:
        """What all curves are over."""
        return self.panels[0].curves[0].x

    def suited(self) -> Chart:
        """The same, every panel in the unit that suits it."""
        return replace(self, panels=[panel.suited() for panel in self.panels])


def is_wide(curves: Sequence[Curve]) -> bool:
    """Whether values are positive and so far apart that their axis is logarithmic."""
    values = np.concatenate([np.empty(0), *(curve.y for curve in curves)])
    values = values[np.isfinite(values)]
    return len(values) > 0 and bool(0 < WIDE * values.min() < values.max())
