"""What stands around a picture: headings, legend, axis cross, colour bar; all sizes suit 150 dpi."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from flexura.view.camera import Camera
from flexura.view.palette import COLOURS, INK, NAMES, displacement_colours
from flexura.view.scene import Kind, Solids

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Box = tuple[float, float, float, float]
"""Left, bottom, width, height, in fractions of the figure."""


def pixel_axes(figure: Figure, zorder: float) -> Axes:
    """Invisible axes over the whole figure, in pixels from its lower left corner."""
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), zorder=zorder)
    axes.set_axis_off()
    axes.set(xlim=(0, figure.bbox.width), ylim=(0, figure.bbox.height))
    return axes


def heading(figure: Figure, title: str, subtitle: str) -> None:
    """Title and subtitle at the top left."""
    lines = textwrap.wrap(title, 60)[:2]
    figure.text(0.035, 0.965, "\n".join(lines), size=14, weight="bold", va="top", color=INK, parse_math=False)
    top = 0.965 - 0.045 * max(len(lines), 1)
    text = "\n".join(textwrap.wrap(subtitle, 105)[:3])
    figure.text(0.035, top, text, size=9.5, va="top", color="0.35", linespacing=1.35, parse_math=False)


def legend(figure: Figure, parts: Solids) -> None:
    """One entry for each kind of part, along the lower edge."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = []
    for kind in sorted(parts.kinds):
        colour, name = COLOURS[kind], NAMES[kind]
        if kind in (Kind.SPRING, Kind.SUPERELEMENT, Kind.ARM):
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
    axes = figure.add_axes(area)
    axes.imshow(
        displacement_colours(np.linspace(0, 1, 256))[:, None], origin="lower", extent=(0, 1, 0, 1), aspect="auto"
    )
    axes.set_xticks([])
    axes.yaxis.tick_right()
    axes.set_yticks([0, 0.5, 1], ["0", "½", "max"])
    axes.tick_params(labelsize=8.5, length=2, colors="0.3")
    for spine in axes.spines.values():
        spine.set_linewidth(0.4)
    axes.set_title("displacement", size=8.5, color="0.3", loc="center", pad=6)
