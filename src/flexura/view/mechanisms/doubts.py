"""Pictures of what `check` warns about: the parts in colour, and where they clash."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.analysis import CheckReport
from flexura.arguments import verb
from flexura.structure import Bars, Bodies, FullOrderModel, solids_of
from flexura.tables import counted, quantity
from flexura.view.drawing import (
    COLOURS,
    INK,
    View,
    add_dots,
    camera_for,
    frame,
    heading,
    legend,
    new_figure,
    paint,
    rest_painting,
)
from flexura.view.mechanisms.files import save_figures
from flexura.view.mechanisms.pictures import SIZE
from flexura.view.scene import Array, Kind, solids

MOST_LABELS = 6
"""Doubts that are written into a picture."""

_WORDS = {"reference": "reference?", "thick": "thicker than long", "unit": "unit?"}
"""What is written beside a part in doubt."""


class _Label(NamedTuple):
    """A few words about a place, m, global frame."""

    text: str
    at: Array


@verb
def draw_warnings(
    model: FullOrderModel, report: CheckReport, *, elev: float | None = None, azim: float | None = None
) -> Figure:
    """Draw a mechanism with the parts that a check of it warns about in red, and a few words where they clash.

    Bodies with warnings are see-through. The first six warnings that have a place are labelled; their texts stand
    under the title. elev, azim and errors as in `draw_mechanism`.
    """
    names, labels, told = _marked(report, *solids_of(model))
    parts = solids(model, doubted=names)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE)
    count = len(report.warnings)
    subtitle = counted(count, "warning") if count else "no warnings"
    top = heading(figure, report.name, subtitle, told)
    view = frame(figure, camera, parts.bounds(), (0.07, 0.175, 0.81, min(0.725, top - 0.195)))
    axes, depth = paint(figure, rest_painting(parts, view, bool(labels)))
    add_dots(axes, parts, view, depth)
    _write(axes, view, parts.points, labels)
    legend(figure, parts)
    return figure


@verb
def save_warnings(report: CheckReport, folder: Path | str, *, model: FullOrderModel) -> list[Path]:
    """Write the picture of `draw_warnings` as `doubts.png`. Raises OptionError when the folder cannot be written to."""
    return save_figures({"doubts.png": draw_warnings(model, report)}, folder)


def _marked(report: CheckReport, bars: Bars, bodies: Bodies) -> tuple[set[str], list[_Label], list[str]]:
    """Names of the parts in doubt, labels with their places, and the doubts that these are about, in words."""
    names: set[str] = set()
    labels: list[_Label] = []
    for clash in report.clashes:
        names |= clash.parts
        words = {
            "clash": f"overlap {quantity(clash.volume, 'm^3', 3)}",
            "deep": f"inside {quantity(clash.volume, 'm^3', 3)}",
            "touch": "touch",
            "gap": f"gap {quantity(clash.gap, 'm', 3)}",
        }
        labels.append(_Label(words[clash.kind], np.array(clash.at)))
    middles = bars.origin + bars.axes[:, 0] * bars.length[:, None] / 2
    places = [*zip(bars.names, bars.labels, middles, strict=True)]
    places += zip(bodies.names, bodies.labels, bodies.origin, strict=True)
    for doubt in report.warnings:
        own = [(name, at) for name, label, at in places if doubt.kind in _WORDS and doubt.is_about(name, label)]
        if own:
            names |= {name for name, _ in own}
            labels.append(_Label(_WORDS[doubt.kind], own[0][1]))
    shown = {*_WORDS, "clash", "deep", "touch", "gap"}
    told = [str(doubt) for doubt in report.warnings if doubt.kind in shown]
    return names, labels[:MOST_LABELS], told


def _write(axes: Axes, view: View, points: Array, labels: list[_Label]) -> None:
    """Rings where the labels belong, and these beside the mechanism, none over another."""
    if not labels:
        return
    image = view.pixels(points)[:, :2]
    low, high = image.min(axis=0), image.max(axis=0)
    at = view.pixels(np.array([label.at for label in labels]))[:, :2]
    colour = COLOURS[Kind.DOUBTED]
    axes.plot(at[:, 0], at[:, 1], "o", color="none", markeredgecolor=colour, markeredgewidth=1.6, markersize=13)
    side = np.where(at[:, 0] < (low[0] + high[0]) / 2, -1, 1)
    for way in (-1, 1):
        mine = np.flatnonzero(side == way)
        mine = mine[np.argsort(-at[mine, 1])]
        floor = np.inf
        for k in mine:
            y = min(at[k, 1] + 40.0, floor - 34.0)
            floor = y
            x = (low[0] - 20 if way < 0 else high[0] + 20) * 0.35 + at[k, 0] * 0.65 + 60 * way
            x = float(np.clip(x, 130, axes.get_xlim()[1] - 130))
            style = {"ha": "center", "va": "center", "size": 8.5, "color": INK, "parse_math": False}
            box = {"boxstyle": "round,pad=0.3", "facecolor": "white", "edgecolor": colour, "linewidth": 1.0}
            line = {"arrowstyle": "-", "color": colour, "linewidth": 1.0, "shrinkB": 7}
            axes.annotate(labels[k].text, tuple(at[k]), (x, y), bbox=box, arrowprops=line, zorder=9, **style)
