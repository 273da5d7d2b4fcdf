"""What a per cent of every parameter does, as tornado charts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from flexura.arguments import verb
from flexura.study.influence import Sensitivity
from flexura.tables import quantity
from flexura.view.drawing import DPI, INK, Bar, bar, draw_bars, foot, headline, new_chart, ranked, shortened
from flexura.view.mechanisms import save_figures

MOST_PANELS = 6
"""Quantities of a picture."""


@verb
def save_sensitivity(result: Sensitivity, folder: Path | str, *, dpi: float = DPI) -> list[Path]:
    """Write the picture of `draw_sensitivity` as `sensitivity.png`. Raises OptionError when the folder cannot be
    written to."""
    return save_figures({"sensitivity.png": draw_sensitivity(result, dpi=dpi)}, folder)


@verb
def draw_sensitivity(result: Sensitivity, *, dpi: float = DPI) -> Figure:
    """A tornado chart of each of the first six quantities: its change in per cent when a parameter rises by 1 %, the
    largest first, after twelve the others added up.

    Frequencies that coincide have a line from the lowest to the highest slope. Slopes without a per cent, of what is
    zero, are named below. dpi as in `draw_mechanism`. Returns a Figure.
    """
    count = min(len(result.quantities), MOST_PANELS)
    columns = min(max(count, 1), 2 if count in (1, 2, 4) else 3)
    rows = -(-max(count, 1) // columns)
    bars = [ranked(list(_bars(result, k))) for k in range(count)]
    most = max((len(own) for own in bars), default=1)
    figure = new_chart((3.9 * columns if columns > 1 else 6.0, rows * (1.1 + 0.21 * max(most, 3)) + 0.6), dpi)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for k, axes in enumerate(panels):
        if k >= count:
            axes.set_visible(False)
            continue
        draw_bars(axes, bars[k], "change per +1 %, %", most)
        value, unit = float(result.value[k]), result.units[k]
        told = quantity(value, unit, 4) if np.isfinite(value) else "no value"
        title = f"{shortened(result.quantities[k], 40)}: {told}"
        axes.set_title(title, fontsize=8.5, color=INK, loc="left", parse_math=False)
        if not bars[k]:
            axes.set_axis_off()
            axes.text(0.0, 0.8, "no slope has a per cent", size=8, color=INK, transform=axes.transAxes)
    headline(figure, f"{result.name}: what a per cent of each parameter does")
    left = [f"{len(result.quantities) - count} more quantities are not drawn"] if len(result.quantities) > count else []
    foot(figure, result.warnings, [*left, *result.notes])
    return figure


def _bars(result: Sensitivity, k: int) -> Iterator[Bar]:
    """Changes of a quantity in per cent; what has none is left out."""
    value = float(result.value[k])
    for p, name in enumerate(result.parameters):
        share = float(result.relative[k, p])
        if np.isfinite(share):
            ends = (result.nominal[p] / value * result.lowest[k, p], result.nominal[p] / value * result.highest[k, p])
            yield bar(name, share, "%", (float(ends[0]), float(ends[1])))
