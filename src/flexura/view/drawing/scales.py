"""Ticks of axes and of scales of colours."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import LogNorm, Normalize
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike

from flexura.view.drawing.charts import plain
from flexura.view.drawing.palette import INK


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
