"""The coordinate box around a mechanism: panes, grid, ticks and labels, laid out so that no text meets another."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.tables import scale_for
from flexura.view.drawing.annotations import Box, pixel_axes
from flexura.view.drawing.camera import Camera, View
from flexura.view.drawing.figures import DPI
from flexura.view.drawing.painting import view_of
from flexura.view.drawing.palette import INK
from flexura.view.scene import Array

_CLOSEST = 46.0
"""Least distance between ticks, pixels."""
_PANE, _GRID, _LINE = (0.972, 0.977, 0.983), "0.87", "0.6"


def frame(figure: Figure, camera: Camera, bounds: tuple[Array, Array], area: Box) -> View:
    """Draw the coordinate box of a bounding box (3,), (3,), m, so that it fills the area; the view it is drawn in."""
    low, high = bounds
    longest = float((high - low).max())
    low, high = low - 0.03 * longest, high + 0.03 * longest
    size, symbol = scale_for([longest], "m")
    factor = 1 / size
    view = view_of(figure, camera, _corners(low, high), area)
    axes = pixel_axes(figure, zorder=1)
    ticks = [_ticks(view, k, low[k], high[k], factor) for k in range(3)]
    _draw_panes(axes, view, low, high, ticks)
    texts: list[_Text] = []
    for k in range(3):
        if len(ticks[k]):
            texts += _draw_axis(axes, view, k, low, high, ticks[k], factor, f"{'xyz'[k]} / {symbol}")
    _write(axes, texts)
    return view


def _corners(low: Array, high: Array) -> Array:
    return np.array(list(itertools.product(*zip(low, high, strict=True))))


def _ticks(view: View, k: int, low: float, high: float, factor: float) -> Array:
    """Positions (t,), m, of ticks on axis k; none when it points almost at the viewer."""
    rate = view.scale * float(np.linalg.norm(view.camera.axes[:2, k]))
    if rate * (high - low) < 0.5 * _CLOSEST:
        return np.empty(0)
    step = _nice(max((high - low) / 5.5, _CLOSEST / rate) * factor) / factor
    return np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step


def _nice(step: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(step))
    return float(power * next(f for f in (1, 2, 5, 10) if f * power >= step * (1 - 1e-9)))


def _draw_panes(axes: Axes, view: View, low: Array, high: Array, ticks: list[Array]) -> None:
    """The three far sides of the box with grid lines at the ticks."""
    towards = view.camera.axes[2]
    for k in range(3):
        if abs(towards[k]) < 1e-3:
            continue
        i, j = (k + 1) % 3, (k + 2) % 3
        far = low[k] if towards[k] > 0 else high[k]

        def at(a: float, b: float, axis: tuple[int, int, int] = (k, i, j), depth: float = far) -> Array:
            point = np.empty(3)
            point[list(axis)] = depth, a, b
            return view.pixels(point)[:2]

        side = [at(low[i], low[j]), at(high[i], low[j]), at(high[i], high[j]), at(low[i], high[j])]
        axes.fill(*np.transpose(side), color=_PANE, linewidth=0, zorder=1)
        lines = [(at(t, low[j]), at(t, high[j])) for t in ticks[i]]
        lines += [(at(low[i], t), at(high[i], t)) for t in ticks[j]]
        for line in lines:
            axes.plot(*np.transpose(line), color=_GRID, linewidth=0.5, zorder=2)


class _Text(NamedTuple):
    """A text centred at a point (2,), pixels, of a size in points; labels of axes come before those of ticks."""

    text: str
    at: Array
    size: float
    is_label: bool

    def half(self) -> Array:
        """Half of its width and height, pixels, by rule of thumb."""
        return np.array([0.62 * len(self.text) + 0.2, 1.25]) * self.size * DPI / 72 / 2


def _draw_axis(
    axes: Axes, view: View, k: int, low: Array, high: Array, ticks: Array, factor: float, label: str
) -> list[_Text]:
    """Draw the line and the ticks of axis k on an outer edge of the box; its texts, still to be written."""
    ends = _edge(view, k, low, high)
    pixels = view.pixels(ends)[:, :2]
    axes.plot(*pixels.T, color=_LINE, linewidth=0.8, zorder=3)
    along = pixels[1] - pixels[0]
    outward = np.array([along[1], -along[0]]) / np.linalg.norm(along)
    centre = view.pixels((low + high) / 2)[:2]
    if (pixels.mean(axis=0) - centre) @ outward < 0:
        outward = -outward
    texts, deepest = [], 0.0
    for tick in ticks:
        at = pixels[0] + (tick - low[k]) / (high[k] - low[k]) * along
        axes.plot(*np.transpose([at, at + 6 * outward]), color=_LINE, linewidth=0.8, zorder=3)
        text = _Text(f"{round(tick * factor, 9) + 0.0:g}", at, 8.0, False)
        reach = float(np.abs(outward) @ text.half())
        deepest = max(deepest, 11 + 2 * reach)
        texts.append(text._replace(at=at + (10 + reach) * outward))
    name = _Text(label, pixels.mean(axis=0), 9.0, True)
    reach = float(np.abs(outward) @ name.half())
    return [name._replace(at=name.at + (deepest + 4 + reach) * outward), *texts]


def _edge(view: View, k: int, low: Array, high: Array) -> Array:
    """Ends (2, 3), m, of the edge along axis k that carries its ticks: on the outline of the box, as low as possible
    for x and y, as far right for z."""
    towards = view.camera.axes[2]
    i, j = (k + 1) % 3, (k + 2) % 3
    best, least = np.empty((2, 3)), np.inf
    for a, b in itertools.product((False, True), repeat=2):
        if (a == (towards[i] > 0)) == (b == (towards[j] > 0)):
            continue
        ends = np.stack([low, high])
        ends[:, i], ends[:, j] = (high if a else low)[i], (high if b else low)[j]
        x, y, _ = view.pixels(ends).mean(axis=0)
        rank = float(y - 0.01 * x if k < 2 else -x + 0.01 * y)
        if rank < least:
            best, least = ends, rank
    return best


def _write(axes: Axes, texts: list[_Text]) -> None:
    """Write texts, kept inside the picture, leaving out ticks that would meet another text."""
    written: list[_Text] = []
    most = np.array([axes.get_xlim()[1], axes.get_ylim()[1]])
    for wanted in sorted(texts, key=lambda t: not t.is_label):
        text = wanted._replace(at=np.clip(wanted.at, wanted.half() + 4, most - wanted.half() - 4))
        if text.is_label or all((np.abs(text.at - o.at) > text.half() + o.half()).any() for o in written):
            written.append(text)
            colour = INK if text.is_label else "0.3"
            axes.text(
                text.at[0], text.at[1], text.text, size=text.size, color=colour, ha="center", va="center", zorder=4
            )
