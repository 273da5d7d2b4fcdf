"""The outcome of a calibration: what the data say of each parameter, and the frequencies before and after."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from flexura.arguments import verb
from flexura.testing.updating import Calibration
from flexura.view.drawing import INK, foot, new_chart
from flexura.view.mechanisms import save_figures

BEFORE, AFTER = "#c9ced6", "#1f5fa8"


@verb
def draw_calibration(result: Calibration) -> Figure:
    """Prior and posterior intervals of the parameters in prior standard deviations, and errors of the frequencies."""
    count = len(result.parameters)
    figure = new_chart((8.4, 1.4 + 0.3 * max(count, 6)))
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    own, deviation = result.z, np.sqrt(np.minimum(np.diagonal(result.covariance), 1e6))
    y = np.arange(count)[::-1]
    low, high = result.problem.unknown.z_bounds
    for k, p in enumerate(result.parameters):
        ends = np.clip([own[k] - 1.96 * deviation[k], own[k] + 1.96 * deviation[k]], low[k], high[k])
        left.plot(np.clip([-1.96, 1.96], low[k], high[k]), [y[k]] * 2, color=BEFORE, linewidth=7, solid_capstyle="butt")
        left.plot(ends, [y[k]] * 2, color=AFTER, linewidth=2.5, solid_capstyle="butt")
        left.plot([own[k]], [y[k]], "D" if p.at_bound else "o", color=AFTER, markersize=5)
    left.set_yticks(y, [p.name for p in result.parameters], fontsize=8)
    left.set_xlabel("prior standard deviations from the prior's middle")
    left.set_title("grey: 95 % before; blue: after; diamond: at a bound", fontsize=8, color=INK)
    measured = np.array([m.number for m in result.modes])
    for errors, colour, shift, label in (
        ([m.start_error for m in result.modes], BEFORE, -0.2, "before"),
        ([m.error for m in result.modes], AFTER, 0.2, "after"),
    ):
        right.bar(np.arange(len(measured)) + shift, 100 * np.array(errors), 0.38, color=colour, label=label)
    right.axhline(0, color=INK, linewidth=0.8)
    right.set_xticks(np.arange(len(measured)), [str(n) for n in measured])
    right.set_xlabel("measured mode")
    right.set_ylabel("error of frequency, %")
    if result.modes:
        right.legend(fontsize=8, frameon=False)
    for axes in (left, right):
        axes.tick_params(labelsize=8, colors=INK)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    figure.suptitle(result.mechanism.name, fontsize=10, color=INK)
    foot(figure, result.warnings, result.notes)
    return figure


@verb
def save_calibration(result: Calibration, folder: Path | str) -> list[Path]:
    """Write `calibration.png` into a folder, complete or not at all.

    Raises OptionError when the folder cannot be written to.
    """
    return save_figures({"calibration.png": draw_calibration(result)}, folder)
