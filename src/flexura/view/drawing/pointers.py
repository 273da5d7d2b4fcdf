"""What points into a picture: names of parts on leaders, none over another, and arrows of forces and moments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from flexura.errors import OptionError
from flexura.mechanism import matching
from flexura.view.drawing.annotations import EM, Box
from flexura.view.drawing.camera import View
from flexura.view.drawing.charts import shortened
from flexura.view.drawing.figures import DPI
from flexura.view.drawing.palette import INK
from flexura.view.scene import Array, Index, Kind, Solids

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
        own = [k for k in kinds if parts.names[k] in matching(text, [parts.names[k]])]
        if not own:
            known = ", ".join(parts.names[k] for k in list(kinds)[:8])
            raise OptionError(f"there is no part {text!r} in the picture; there are {known} and so on")
        wanted += [k for k in own if k not in wanted]
    if names is True:
        wanted = sorted((k for k in wanted if kinds[k] is not Kind.NODE), key=lambda k: _RANK.get(kinds[k], 5))
    room = 2 * int((SPAN[1] - SPAN[0]) * 6.0 / (1.45 * SIZE / 72))
    labels = []
    for k in wanted[:room]:
        own = points[cells[k]]
        middle = (own.min(axis=0) + own.max(axis=0)) / 2
        nearest = own[np.linalg.norm(own - middle, axis=1).argmin()]
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
    for own, numbers, kind in every:
        order = np.argsort(numbers, kind="stable")
        starts = np.flatnonzero(np.diff(numbers[order], prepend=-1))
        for rows in np.split(order, starts[1:]) if len(order) else ():
            part = int(numbers[rows[0]])
            if part not in kinds:
                kinds[part], cells[part] = Kind(kind[rows[0]]), np.unique(own[rows])
    return kinds, cells


def write_labels(axes: Axes, view: View, labels: Sequence[Label]) -> None:
    """Write names in columns on both sides, each with a leader to its place; no two meet."""
    if not labels:
        return
    at = view.pixels(np.array([label.at for label in labels]))[:, :2]
    width, height = axes.get_xlim()[1], axes.get_ylim()[1]
    order = np.argsort(at[:, 0], kind="stable")
    line = 1.45 * SIZE * DPI / 72
    for own, x, side in (
        (order[: len(order) // 2], COLUMNS[0], "right"),
        (order[len(order) // 2 :], COLUMNS[1], "left"),
    ):
        rows = own[np.argsort(at[own, 1], kind="stable")]
        heights = _apart(at[rows, 1], line, SPAN[0] * height, SPAN[1] * height)
        way = 1 if side == "right" else -1
        for k, y in zip(rows, heights, strict=True):
            style = {"size": SIZE, "color": INK, "va": "center", "ha": side, "parse_math": False, "zorder": 9}
            axes.text(x * width, y, labels[k].text, **style)
            path = [(x * width + 5 * way, y), (x * width + 18 * way, y), tuple(at[k])]
            axes.plot(*zip(*path, strict=True), color="0.45", linewidth=0.5, zorder=8)
            axes.plot(*at[k], marker="o", markersize=1.8, color=INK, zorder=8)


def _apart(wanted: Array, least: float, low: float, high: float) -> Array:
    """Heights in order (n,), as near to those wanted as is possible in so much room, no two nearer than `least`."""
    n = len(wanted)
    least = min(least, (high - low) / max(n - 1, 1))
    found = wanted.clip(low, high)
    for k in range(1, n):
        found[k] = max(found[k], found[k - 1] + least)
    if n and found[-1] > high:
        found[-1] = high
        for k in range(n - 2, -1, -1):
            found[k] = min(found[k], found[k + 1] - least)
    return found


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
            tail, way = tip, np.array([0.0, 1.0])
        else:
            tail, way = tip - ARROW * along, -along / np.linalg.norm(along)
            heads = (tip, tip + 0.16 * (tail - tip)) if arrow.turns else (tip,)
            for head in heads:
                style = {"arrowstyle": "-|>,head_width=0.28,head_length=0.55", "color": colour, "linewidth": 1.8}
                style |= {"shrinkA": 0, "shrinkB": 0}
                axes.annotate("", tuple(head), tuple(tail), arrowprops=style, annotation_clip=False, zorder=10)
        text = shortened(arrow.text, 34)
        half = np.array([EM * len(text) / 2, 0.75]) * 8 * DPI / 72
        at = tail + (8 + np.abs(way) @ half) * way
        most = np.array([axes.get_xlim()[1], axes.get_ylim()[1]])
        at = np.clip(at, half + 4, most - half - 4)
        while any((np.abs(at - other) < half + own).all() for other, own in written) and at[1] < most[1] - half[1] - 8:
            at = at + np.array([0.0, 4.0])
        written.append((at, half))
        style = {"size": 8, "color": colour, "ha": "center", "va": "center", "parse_math": False, "zorder": 11}
        halo = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}
        axes.text(float(at[0]), float(at[1]), text, bbox=halo, **style)
