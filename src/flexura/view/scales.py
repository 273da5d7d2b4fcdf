"""Scales in which quantities stand on axes: mm, MPa, degrees, or the SI prefix that suits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import LogNorm, Normalize
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike

from flexura.tables import number, suited
from flexura.view.charts import plain
from flexura.view.palette import INK

CUSTOMARY: dict[str, tuple[tuple[str, float, float], ...]] = {
    "m": (("mm", 1e-3, 5e-5), ("µm", 1e-6, 5e-8), ("nm", 1e-9, 0.0)),
    "Pa": (("GPa", 1e9, 2e9), ("MPa", 1e6, 1e5), ("kPa", 1e3, 1e2), ("Pa", 1.0, 0.0)),
    "rad": (("°", np.pi / 180, 0.02), ("mrad", 1e-3, 2e-5), ("µrad", 1e-6, 0.0)),
    "Hz": (("Hz", 1.0, 0.0),),
}
"""Units of engineering drawings for an SI unit: their size in it, and from which largest value on each is taken."""


class Scale(NamedTuple):
    """The unit that an axis has, and its size in SI."""

    unit: str
    size: float

    def said(self, value: float, digits: int = 4) -> str:
        """An SI value in this unit."""
        return f"{number(value / self.size, digits)} {self.unit}".strip()

    def label(self, name: str) -> str:
        """What an axis is called."""
        return f"{name}, {self.unit}" if self.unit else name


def scale_for(values: ArrayLike, unit: str) -> Scale:
    """The scale that suits SI values, of which those count that are finite."""
    own = np.abs(np.asarray(values, dtype=float)).ravel()
    own = own[np.isfinite(own)]
    largest = float(own.max(initial=0.0)) or 1.0
    for name, size, least in CUSTOMARY.get(unit, ()):
        if largest >= least:
            return Scale(name, size)
    size, name = suited([own.tolist()], unit)
    return Scale(name, size)


def named(heading: str) -> tuple[str, str]:
    """A heading of a column as its name and its SI unit, empty without one."""
    name, bracket, unit = heading.rpartition(" [")
    return (name, unit.removesuffix("]")) if bracket and heading.endswith("]") else (heading, "")


def ticks_within(axis: Axis, low: float, high: float, room: int = 6, logarithmic: bool = False) -> None:
    """Round numbers between the ends of an axis and none beyond, for about `room` of them."""
    wide = logarithmic and high > 4 * low
    ticks = (
        LogLocator(subs=(1.0, 2.0, 5.0)).tick_values(low, high) if wide else MaxNLocator(room).tick_values(low, high)
    )
    axis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
    axis.set_major_formatter(FuncFormatter(plain))
    axis.set_minor_formatter(NullFormatter())


def colour_axis(bar: Axes, limits: Normalize, label: str) -> None:
    """Round numbers beside a scale of colours."""
    low, high = float(limits.vmin or 0.0), float(limits.vmax or 0.0)
    ticks_within(bar.yaxis, low, high, logarithmic=isinstance(limits, LogNorm))
    bar.minorticks_off()
    bar.tick_params(labelsize=7, colors=INK)
    bar.set_ylabel(label, fontsize=8, parse_math=False)


def limits_of(values: ArrayLike) -> Normalize:
    """From the lowest to the highest finite value, in equal ratios where they are far apart."""
    own = np.asarray(values, dtype=float)
    own = own[np.isfinite(own)]
    if not len(own):
        return Normalize(0.0, 1.0)
    low, high = float(own.min()), float(own.max())
    return LogNorm(low, high) if low > 0 and WIDE * low < high else Normalize(low, high)


WIDE = 30.0
"""Ratio of positive values from which their scale is logarithmic."""
