"""What is written around and into a picture so that no text meets another: coordinate box, names, arrows, triad."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.errors import OptionError
from flexura.mechanism import matching
from flexura.tables import scale_for
from flexura.view.drawing.figures import DPI, EM, INK, Box, pixel_axes, shortened
from flexura.view.drawing.painting import Camera, View, view_of
from flexura.view.scene import Array, Index, Kind, Solids

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
        extent = float(np.abs(outward) @ text.half())
        deepest = max(deepest, 11 + 2 * extent)
        texts.append(text._replace(at=at + (10 + extent) * outward))
    name = _Text(label, pixels.mean(axis=0), 9.0, True)
    extent = float(np.abs(outward) @ name.half())
    return [name._replace(at=name.at + (deepest + 4 + extent) * outward), *texts]


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


LABEL_AREA: Box = (0.235, 0.175, 0.445, 0.725)
"""Where a mechanism is drawn with names on both sides of it."""

COLUMNS = (0.215, 0.785)
"""Where names end on the left and begin on the right, of the width of a picture."""

SPAN = (0.14, 0.87)
"""Between which heights they stand, of that of the picture."""

SIZE = 7.0
"""Size of the type of names, points."""

CHARACTERS = 31
"""Of a name with what is said of it."""

ARROW = 85.0
"""Length of an arrow that lies in the picture, pixels."""

FORCE = "#b0124b"
"""Colour of loads."""

HELD = {Kind.CLAMP: " (clamped)", Kind.PARTLY_HELD: " (partly held)"}


class Label(NamedTuple):
    """A name and the place, m, that it belongs to."""

    text: str
    at: Array


class Arrow(NamedTuple):
    """A force, or a moment, which has two heads: what it acts on, m, its direction (3,), and what is written at it."""

    at: Array
    direction: Array
    text: str
    turns: bool = False


def part_labels(parts: Solids, points: Array, names: bool | Sequence[str]) -> tuple[list[Label], str]:
    """Labels of parts whose points are at `points` (v, 3), m, and how many are left out, in words.

    names: True for as many as there is room for, bodies first, or names, where `*` matches any letters. Raises
    OptionError for names that are not there.
    """
    if isinstance(names, str) or not (names is True or all(isinstance(name, str) for name in names or ())):
        raise OptionError(f"`names` is True or a list of names of parts, not {names!r}")
    if not names:
        return [], ""
    kinds, cells = _cells(parts)
    wanted = list(kinds) if names is True else []
    for text in () if names is True else names:
        matches = [k for k in kinds if parts.names[k] in matching(text, [parts.names[k]])]
        if not matches:
            known = ", ".join(parts.names[k] for k in list(kinds)[:8])
            raise OptionError(f"there is no part {text!r} in the picture; there are {known} and so on")
        wanted += [k for k in matches if k not in wanted]
    if names is True:
        wanted = sorted((k for k in wanted if kinds[k] is not Kind.NODE), key=lambda k: _RANK.get(kinds[k], 5))
    room = 2 * int((SPAN[1] - SPAN[0]) * 6.0 / (1.45 * SIZE / 72))
    labels = []
    for k in wanted[:room]:
        part_points = points[cells[k]]
        middle = (part_points.min(axis=0) + part_points.max(axis=0)) / 2
        nearest = part_points[np.linalg.norm(part_points - middle, axis=1).argmin()]
        at = middle if kinds[k] not in (Kind.BODY, Kind.EQUIVALENT_BODY) else nearest
        held = HELD.get(kinds[k], "")
        labels.append(Label(shortened(parts.names[k], CHARACTERS - len(held)) + held, at))
    return labels, "" if len(wanted) <= room else f"{room} of {len(wanted)} names are shown"


_RANK = {Kind.BODY: 0, Kind.EQUIVALENT_BODY: 0, Kind.CLAMP: 1, Kind.PARTLY_HELD: 1, Kind.PIEZO: 2, Kind.ACTUATOR: 2}
_RANK |= {Kind.SENSOR: 3, Kind.FLEXURE: 4}


def _cells(parts: Solids) -> tuple[dict[int, Kind], dict[int, Index]]:
    """What each part is that is drawn, by number, and which points it has; faces count before lines and dots."""
    kinds: dict[int, Kind] = {}
    cells: dict[int, Index] = {}
    every = (
        (parts.faces, parts.face_parts, parts.face_kinds),
        (parts.lines, parts.line_parts, parts.line_kinds),
        (parts.dots[:, None], parts.dot_parts, parts.dot_kinds),
    )
    for indices, numbers, kind in every:
        order = np.argsort(numbers, kind="stable")
        starts = np.flatnonzero(np.diff(numbers[order], prepend=-1))
        for rows in np.split(order, starts[1:]) if len(order) else ():
            part = int(numbers[rows[0]])
            if part not in kinds:
                kinds[part], cells[part] = Kind(kind[rows[0]]), np.unique(indices[rows])
    return kinds, cells


def write_labels(axes: Axes, view: View, labels: Sequence[Label]) -> None:
    """Write names in columns on both sides, each with a leader to its place; no two meet."""
    if not labels:
        return
    at = view.pixels(np.array([label.at for label in labels]))[:, :2]
    width, height = axes.get_xlim()[1], axes.get_ylim()[1]
    order = np.argsort(at[:, 0], kind="stable")
    line = 1.45 * SIZE * DPI / 72
    for column, x, side in (
        (order[: len(order) // 2], COLUMNS[0], "right"),
        (order[len(order) // 2 :], COLUMNS[1], "left"),
    ):
        rows = column[np.argsort(at[column, 1], kind="stable")]
        heights = _apart(at[rows, 1], line, SPAN[0] * height, SPAN[1] * height)
        sign = 1 if side == "right" else -1
        for k, y in zip(rows, heights, strict=True):
            style = {"size": SIZE, "color": INK, "va": "center", "ha": side, "parse_math": False, "zorder": 9}
            axes.text(x * width, y, labels[k].text, **style)
            path = [(x * width + 5 * sign, y), (x * width + 18 * sign, y), tuple(at[k])]
            axes.plot(*zip(*path, strict=True), color="0.45", linewidth=0.5, zorder=8)
            axes.plot(*at[k], marker="o", markersize=1.8, color=INK, zorder=8)


def _apart(wanted: Array, least: float, low: float, high: float) -> Array:
    """Heights in order (n,), as near to those wanted as is possible in so much room, no two nearer than `least`."""
    n = len(wanted)
    least = min(least, (high - low) / max(n - 1, 1))
    heights = wanted.clip(low, high)
    for k in range(1, n):
        heights[k] = max(heights[k], heights[k - 1] + least)
    if n and heights[-1] > high:
        heights[-1] = high
        for k in range(n - 2, -1, -1):
            heights[k] = min(heights[k], heights[k + 1] - least)
    return heights


def draw_arrows(axes: Axes, view: View, arrows: Sequence[Arrow], colour: str = FORCE) -> None:
    """Arrows whose tips are at what they act on, with what is written at their tails; those towards the viewer, and
    away from him, are a ring with a dot or a cross. No two words meet."""
    written: list[tuple[Array, Array]] = []
    for arrow in arrows:
        tip = view.pixels(arrow.at[None])[0, :2]
        seen = view.camera.axes @ (arrow.direction / np.linalg.norm(arrow.direction))
        along = seen[:2]
        if np.linalg.norm(along) < 0.2:
            axes.plot(
                *tip, marker="o", markersize=9, color="white", markeredgecolor=colour, markeredgewidth=1.6, zorder=10
            )
            axes.plot(*tip, marker="." if seen[2] > 0 else "x", markersize=5, color=colour, zorder=11)
            tail, outward = tip, np.array([0.0, 1.0])
        else:
            tail, outward = tip - ARROW * along, -along / np.linalg.norm(along)
            heads = (tip, tip + 0.16 * (tail - tip)) if arrow.turns else (tip,)
            for head in heads:
                style = {"arrowstyle": "-|>,head_width=0.28,head_length=0.55", "color": colour, "linewidth": 1.8}
                style |= {"shrinkA": 0, "shrinkB": 0}
                axes.annotate("", tuple(head), tuple(tail), arrowprops=style, annotation_clip=False, zorder=10)
        text = shortened(arrow.text, 34)
        half = np.array([EM * len(text) / 2, 0.75]) * 8 * DPI / 72
        at = tail + (8 + np.abs(outward) @ half) * outward
        most = np.array([axes.get_xlim()[1], axes.get_ylim()[1]])
        at = np.clip(at, half + 4, most - half - 4)
        while (
            any((np.abs(at - other) < half + other_half).all() for other, other_half in written)
            and at[1] < most[1] - half[1] - 8
        ):
            at = at + np.array([0.0, 4.0])
        written.append((at, half))
        style = {"size": 8, "color": colour, "ha": "center", "va": "center", "parse_math": False, "zorder": 11}
        halo = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}
        axes.text(float(at[0]), float(at[1]), text, bbox=halo, **style)


def triad(figure: Figure, camera: Camera, area: Box = (0.875, 0.03, 0.10, 0.133)) -> None:
    """The directions of x, y and z, as seen by the camera."""
    axes = figure.add_axes(area)
    axes.set(xlim=(-1.35, 1.35), ylim=(-1.35, 1.35), aspect="equal")
    axes.axis("off")
    right, up, towards = camera.axes
    for k in np.argsort(towards):
        tip = np.array([right[k], up[k]])
        axes.plot([0, tip[0]], [0, tip[1]], color="0.35", linewidth=1.0, solid_capstyle="round")
        if np.linalg.norm(tip) > 0.15:
            at = tip * (1 + 0.28 / np.linalg.norm(tip))
            axes.text(at[0], at[1], "xyz"[k], size=8, ha="center", va="center", color=INK)
