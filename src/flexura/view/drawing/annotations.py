"""Annotations of a picture: headings, legend, axis cross, colour bar. All sizes suit 150 dpi."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from flexura.view.drawing.camera import Camera
from flexura.view.drawing.figures import DPI
from flexura.view.drawing.lettering import wrapped
from flexura.view.drawing.palette import COLOURS, INK, NAMES, WARNING, displacement_colours
from flexura.view.scene import Array, Kind, Solids

Box = tuple[float, float, float, float]
"""Left, bottom, width, height, in fractions of the figure."""


def pixel_axes(figure: Figure, zorder: float) -> Axes:
    """Invisible axes over the whole figure, in pixels of 150 dpi from its lower left corner, however fine it is."""
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), zorder=zorder)
    axes.set_axis_off()
    width, height = DPI * figure.get_size_inches()
    axes.set(xlim=(0, width), ylim=(0, height))
    return axes


MOST_REMARKS = 3
"""Warnings and notes that are written out in a picture."""

MOST_LINES = 3
"""Lines that each of them takes at most."""

EM = 0.57
"""Width of a character over the size of the type: more than a line of text has on average."""


def heading(figure: Figure, title: str, subtitle: str, warnings: Iterable[object] = ()) -> float:
    """Title, subtitle and warnings at the top left; returns where they end, as a fraction of the height."""
    width = 0.93 * figure.get_figwidth()
    lines = wrapped(title, width, 14, 2, "bold")
    figure.text(0.035, 0.965, "\n".join(lines), size=14, weight="bold", va="top", color=INK, parse_math=False)
    top = 0.965 - 0.045 * max(len(lines), 1)
    below = wrapped(subtitle, width, 9.5, 3)
    style = {"va": "top", "linespacing": 1.35, "parse_math": False}
    figure.text(0.035, top, "\n".join(below), size=9.5, color="0.35", **style)
    top -= len(below) * line_height(figure, 9.5)
    said = remark_lines(warnings, "warning", width, 8.5, most=2)
    if said:
        top -= 0.006
        figure.text(0.035, top, "\n".join(said), size=8.5, color=WARNING, **style)
    return top - len(said) * line_height(figure, 8.5)


def line_height(figure: Figure, size: float) -> float:
    """Height of a line of type of a size in points, spaced by 1.35, as a fraction of the height of the figure."""
    return 1.35 * size / 72 / figure.get_figheight()


def remark_lines(
    remarks: Iterable[object], kind: str, width: float, size: float, most: int = MOST_REMARKS
) -> list[str]:
    """The first few remarks, each after its kind, wrapped to a width in inches of type of a size in points; how many
    more there are."""
    own = list(dict.fromkeys(str(remark) for remark in remarks))
    lines = [line for text in own[:most] for line in wrapped(f"{kind}: {text}", width, size, MOST_LINES)]
    rest = len(own) - most
    return lines + ([f"and {rest} more {kind}{'s' if rest > 1 else ''}"] if rest > 0 else [])


def foot(figure: Figure, warnings: Sequence[object], notes: Sequence[object] = ()) -> None:
    """Warnings, then notes, along the lower edge of a figure whose layout is constrained."""
    width, size = 0.97 * figure.get_figwidth(), 6.5
    said = (remark_lines(warnings, "warning", width, size), remark_lines(notes, "note", width, size))
    count = sum(map(len, said))
    if not count:
        return
    line, gap = line_height(figure, size), 0.04 / figure.get_figheight()
    engine = figure.get_layout_engine()
    assert engine is not None
    engine.set(rect=(0.0, count * line + 2 * gap, 1.0, 1.0 - count * line - 2 * gap))  # type: ignore[call-arg]
    top = gap
    for lines, colour in zip(said[::-1], ("0.35", WARNING), strict=True):
        if lines:
            style = {"va": "bottom", "size": size, "color": colour, "linespacing": 1.35, "parse_math": False}
            figure.text(0.015, top, "\n".join(lines), **style)
            top += len(lines) * line


def legend(figure: Figure, parts: Solids) -> None:
    """One entry for each kind of part, along the lower edge."""
    handles = []
    for kind in sorted(parts.kinds):
        colour, name = COLOURS[kind], NAMES[kind]
        if kind in (Kind.SPRING, Kind.DASHPOT, Kind.SUPERELEMENT, Kind.ARM):
            handles.append(Line2D([], [], color=colour, linewidth=1.5, label=name))
        elif kind in (Kind.NODE, Kind.CENTRE):
            handles.append(Line2D([], [], linestyle="", marker="o", label=name, **dot_style(kind)))
        else:
            edge = (0.5 * colour[0], 0.5 * colour[1], 0.5 * colour[2])
            handles.append(Patch(facecolor=colour, edgecolor=edge, linewidth=0.6, label=name))
    columns = len(handles) if len(handles) <= 6 else -(-len(handles) // 2)
    figure.legend(
        handles=handles,
        loc="lower center",
        bbox_to_anchor=(0.5, 0.008),
        ncols=columns,
        frameon=False,
        fontsize=9,
        labelcolor=INK,
        handlelength=1.4,
        columnspacing=1.5,
    )


def dot_style(kind: Kind) -> dict[str, Any]:
    """Marker of a dot, as arguments of a Line2D."""
    size = 3.2 if kind is Kind.NODE else 4.2
    return {"color": COLOURS[kind], "markeredgecolor": INK, "markeredgewidth": 0.6, "markersize": size}


def triad(figure: Figure, camera: Camera, area: Box) -> None:
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


def colour_bar(figure: Figure, area: Box) -> None:
    """Scale of displacements relative to the largest."""
    colours = displacement_colours(np.linspace(0, 1, 256))
    colour_scale(figure, area, colours, [0, 0.5, 1], ["0", "½", "max"], "displacement")


def colour_scale(
    figure: Figure, area: Box, colours: Array, ticks: Sequence[float], labels: Sequence[str], title: str
) -> None:
    """A scale of colours (k, 3), with labels at ticks from 0 to 1."""
    axes = figure.add_axes(area)
    axes.imshow(colours[:, None], origin="lower", extent=(0, 1, 0, 1), aspect="auto")
    axes.set_xticks([])
    axes.yaxis.tick_right()
    axes.set_yticks(ticks, labels)
    axes.tick_params(labelsize=8.5, length=2, colors="0.3")
    for spine in axes.spines.values():
        spine.set_linewidth(0.4)
    axes.set_title(title, size=8.5, color="0.3", loc="center", pad=9)
