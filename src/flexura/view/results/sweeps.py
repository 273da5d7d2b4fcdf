"""Sweeps in pictures: curves over one parameter, maps over two, and parallel coordinates over more."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.arguments import verb
from flexura.errors import OptionError, foremost
from flexura.study.engine import StudyTable
from flexura.tables import Scale, counted, scale_for
from flexura.view.drawing import (
    DPI,
    SERIES,
    WIDE,
    Coordinate,
    draw_parallel,
    foot,
    headline,
    legend_above,
    named,
    new_chart,
    style,
    ticks_within,
    value_axis,
)
from flexura.view.mechanisms import save_figures
from flexura.view.results.design_maps import draw_map, legible
from flexura.view.results.designs_shown import DesignsShown, designs_shown
from flexura.view.scene import Array

FAILED, DOUBTED = "#c2182b", "#8a5a00"
"""Colours of designs without a value, and of those that are not proven."""

BY_NUMBER = "#9aa3ad"
"""Frequencies by number where others are followed by what moves."""

ELSEWHERE: dict[str, Any] = {"ls": ":", "lw": 1.0, "marker": "o", "mfc": "white", "ms": 4.5}
"""Where a frequency that is followed goes over to another mode."""

MOST_PANELS = 6

FEW = 40
"""Designs up to which each has a dot on its curve."""


@verb
def save_sweep(table: StudyTable, folder: Path | str, *, dpi: float = DPI) -> list[Path]:
    """Write the picture of `draw_sweep` as `sweep.png`. Raises OptionError as that, and when the folder cannot be
    written to."""
    return save_figures({"sweep.png": draw_sweep(table, dpi=dpi)}, folder)


@verb
def draw_sweep(table: StudyTable, *, dpi: float = DPI) -> Figure:
    """Draw what a sweep found: curves over one parameter that varies, a map of each quantity over two, and parallel
    coordinates of more.

    Curves have a panel for each unit, bands between proven bounds, a gap and a cross where a design failed, and rings
    where it is not proven; one that is followed by what moves breaks where it goes over to another mode, dots leading
    to where it goes on; where frequencies are followed by what moves, those by number are grey behind them. Maps
    have level lines over a grid, dots over samples; where a design failed nothing is interpolated and the area is
    hatched. Of parallel coordinates, coloured by the first quantity, failed designs are left out and counted. Of very
    many designs one of so many is drawn, which is said. dpi as in `draw_mechanism`. Returns a Figure. Raises
    OptionError for a study without designs.
    """
    shown = designs_shown(table)
    if not len(shown.is_proven):
        raise OptionError("no design of the study is worked out yet: there is nothing to draw")
    count = len(shown.varied)
    notes = [*shown.notes]
    if count == 1:
        figure = _curves(shown, dpi)
    elif count == 2:
        figure = _maps(shown, dpi)
        if len(shown.asked) > MOST_PANELS:
            notes.append(f"{len(shown.asked) - MOST_PANELS} more quantities are not drawn")
    else:
        figure, said = _lines(shown, dpi)
        notes += said
    over = ", ".join(named(name)[0] for name in shown.varied)
    headline(figure, f"{table.name}: {counted(table.done, 'design')} over {over}")
    foot(figure, foremost(table.warnings, 1), [*notes, *table.notes])
    return legible(figure, figure.axes) if count == 2 else figure


def _curves(shown: DesignsShown, dpi: float) -> Figure:
    """A panel for each unit of what is asked, over the parameter."""
    (name, x), *_ = shown.varied.items()
    order = np.argsort(x, kind="stable")
    across = scale_for(x, named(name)[1])
    units: dict[str, list[str]] = {}
    for heading in shown.asked:
        units.setdefault(named(heading)[1], []).append(heading)
    columns = 1 if len(units) == 1 else 2
    rows = -(-len(units) // columns)
    figure = new_chart((8.0 if columns == 1 else 10.0, 4.8 if rows == 1 else 3.6 * rows), dpi)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, (unit, headings) in zip(panels, units.items(), strict=False):
        _panel(axes, shown, headings, unit, x[order] / across.size, order)
        axes.set_xlabel(across.label(named(name)[0]), fontsize=8, parse_math=False)
        low, high = float(x.min()) / across.size, float(x.max()) / across.size
        if low < high:
            axes.set_xlim(low, high)
            axes.set_xscale("log" if name in shown.logarithmic else "linear")
            ticks_within(axes.xaxis, low, high, logarithmic=name in shown.logarithmic)
    for axes in panels[len(units) :]:
        axes.set_visible(False)
    return figure


def _panel(axes: Axes, shown: DesignsShown, headings: list[str], unit: str, x: Array, order: np.ndarray) -> None:
    """Curves of quantities of one unit, with bands, rings and crosses."""
    values = np.array([shown.asked[heading] for heading in headings])
    scale = scale_for(values, unit)
    followed = [heading for heading in headings if heading.startswith("f(")]
    colours = iter(np.resize(np.array(SERIES), len(headings)).tolist())
    first, has_leapt = True, False
    for heading in sorted(headings, key=lambda own: own in followed):
        own = shown.asked[heading][order] / scale.size
        own[~np.isfinite(own)] = np.nan
        if followed and unit == "Hz" and heading not in followed and _is_number(heading):
            label = "by number" if first else None
            axes.plot(x, own, color=BY_NUMBER, lw=3.2, alpha=0.6, label=label, gid=heading, solid_capstyle="butt")
            first = False
            continue
        colour = next(colours)
        leaps = shown.leaps.get(heading, np.zeros(len(x), dtype=bool))[order]
        leaps[-1] = False
        behind = 1 + np.flatnonzero(leaps)
        along, line = (np.insert(values, behind, np.nan) for values in (x, own))
        gap = np.isnan(np.concatenate([[np.nan], line, [np.nan]]))
        alone = np.flatnonzero(gap[:-2] & gap[2:])
        dots = range(len(line)) if len(own) <= FEW else alone
        mark: dict[str, Any] = {"marker": "o", "ms": 2.6, "markevery": [*dots]}
        axes.plot(along, line, color=colour, lw=1.4, label=named(heading)[0], gid=heading, **mark)
        for k in behind:
            axes.plot(x[k - 1 : k + 1], own[k - 1 : k + 1], color=colour, gid=f"other mode {heading}", **ELSEWHERE)
        has_leapt |= bool(len(behind))
        if heading in shown.lower:
            bounds = (bound[heading][order] / scale.size for bound in (shown.lower, shown.upper))
            low, high = (np.insert(bound, behind, np.nan) for bound in bounds)
            axes.fill_between(along, low, high, color=colour, alpha=0.25, lw=0, gid=f"bounds of {heading}")
            doubted = shown.is_doubted(heading)[order]
            axes.plot(x[doubted], own[doubted], "o", mfc="none", mec=DOUBTED, ms=6, gid=f"not proven {heading}")
    if has_leapt:
        axes.plot([], [], color=DOUBTED, label="goes over to another mode", **ELSEWHERE)
    _crosses(axes, x[np.isnan(values[:, order]).any(axis=0)])
    finite = values[np.isfinite(values)] / scale.size
    if not len(finite):
        axes.set_yticks([])
    elif finite.min() > 0 and finite.max() > WIDE * finite.min():
        value_axis(axes, finite)
    else:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high)
        ticks_within(axes.yaxis, low, high)
    axes.set_ylabel(_called(headings, scale), fontsize=8, parse_math=False)
    style(axes)
    legend_above(axes)


def _is_number(heading: str) -> bool:
    return heading[:1] == "f" and heading[1:2].isdigit()


def _crosses(axes: Axes, x: Array) -> None:
    """Crosses on the lower edge where designs failed."""
    if len(x):
        axes.plot(
            x, np.full(len(x), 0.025), "x", color=FAILED, ms=5, transform=axes.get_xaxis_transform(), gid="failed"
        )
        axes.plot([], [], "x", color=FAILED, ms=5, label="failed")


def _called(headings: list[str], scale: Scale) -> str:
    """What an axis of several quantities is called."""
    words = {named(own)[0].split("(")[0].split(" at ")[0] for own in headings}
    if all(_is_number(own) or own.startswith("f(") for own in headings):
        return scale.label("natural frequency")
    return scale.label(words.pop() if len(words) == 1 else "")


def _maps(shown: DesignsShown, dpi: float) -> Figure:
    """A map of each quantity over two parameters."""
    headings = list(shown.asked)[:MOST_PANELS]
    columns = min(len(headings), 3 if len(headings) > 4 else 2)
    rows = -(-len(headings) // columns)
    figure = new_chart((6.6 if columns == 1 else 4.6 * columns, 4.9 if columns == 1 else 3.9 * rows + 0.4), dpi)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, heading in zip(panels, headings, strict=False):
        draw_map(axes, shown, heading)
    for axes in panels[len(headings) :]:
        axes.set_visible(False)
    return figure


def _lines(shown: DesignsShown, dpi: float) -> tuple[Figure, list[str]]:
    """Parallel coordinates of all parameters and what is asked, and what they leave out."""
    there = ~shown.is_failed
    all_columns = [*shown.varied.items(), *shown.asked.items()]
    coordinates = [Coordinate(*named(heading), own[there]) for heading, own in all_columns]
    heading = next(iter(shown.asked))
    figure = draw_parallel(coordinates, Coordinate(*named(heading), shown.asked[heading][there]), dpi)
    failed = int(shown.is_failed.sum())
    return figure, [f"{counted(failed, 'failed design')} left out"] if failed else []
