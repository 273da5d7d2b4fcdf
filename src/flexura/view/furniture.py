"""What stands around a picture: axes, headings, legend, axis cross, colour bar; all sizes suit 150 dpi."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from flexura.view.camera import Camera, View
from flexura.view.meshes import Array
from flexura.view.palette import COLOURS, INK, NAMES, displacement_colours
from flexura.view.scene import Kind, Solids

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Box = tuple[float, float, float, float]
"""Left, bottom, width, height, in fractions of the figure."""


def length_unit(size: float) -> tuple[str, float]:
    """Unit that suits a size in m, and how many of it make one metre."""
    if size >= 3.0:
        return "m", 1.0
    return ("mm", 1e3) if size >= 3e-3 else ("µm", 1e6)


def frame(figure: Figure, camera: Camera, bounds: tuple[Array, Array], area: Box) -> View:
    """Draw axes with ticks in a suitable unit around a bounding box (3,), (3,), m, filling the area.

    Returns the view that lays the mechanism into them.
    """
    from mpl_toolkits.mplot3d import Axes3D

    axes = Axes3D(figure, proj_type="ortho", computed_zorder=False)
    figure.add_axes(axes)
    axes.view_init(elev=camera.elev, azim=camera.azim)
    low, high = bounds
    longest = float((high - low).max())
    low, high = low - 0.03 * longest, high + 0.03 * longest
    symbol, factor = length_unit(longest)
    extent = high - low
    limits = (axes.set_xlim3d, axes.set_ylim3d, axes.set_zlim3d)
    labels = (axes.set_xlabel, axes.set_ylabel, axes.set_zlabel)
    drawn: list[Any] = [axes.xaxis, axes.yaxis, axes.zaxis]
    for k, axis in enumerate(drawn):
        limits[k](low[k], high[k], view_margin=0)
        step = _nice(max(extent[k] / 4.5, longest / 14) * factor) / factor
        ticks = np.arange(np.ceil(low[k] / step), np.floor(high[k] / step) + 1) * step
        axis.set_ticks(ticks, [f"{tick:g}" for tick in (ticks * factor).round(9) + 0.0])
        axis.set_tick_params(labelsize=8, labelcolor="0.3", pad=-1)
        axis.set_pane_color((0.975, 0.98, 0.985, 1.0))
        axis.line.set_color("0.6")
        axis._axinfo["grid"].update(color="0.88", linewidth=0.5)
        axis._axinfo["tick"].update(inward_factor=0.0, outward_factor=0.15)
        labels[k](f"{'xyz'[k]} / {symbol}", size=9, color=INK, labelpad=3)
    corners = np.array([[(low, high)[b >> k & 1][k] for k in range(3)] for b in range(8)])
    return _fit(figure, axes, corners, camera, area)


def _fit(figure: Figure, axes: Any, points: Array, camera: Camera, area: Box) -> View:
    """Zoom and shift axes so that points (n, 3), m, fill the area; the view that goes with them."""
    from mpl_toolkits.mplot3d import proj3d

    aspect = tuple(np.ptp(points, axis=0))
    size = np.array([figure.bbox.width, figure.bbox.height])
    corner, extent = np.array(area[:2]) * size, np.array(area[2:]) * size

    def image() -> Array:
        axes.apply_aspect()
        x, y, _ = proj3d.proj_transform(points[:, 0], points[:, 1], points[:, 2], axes.get_proj())
        return axes.transData.transform(np.column_stack([x, y]))

    axes.set_position((0.0, 0.0, 1.0, 1.0))
    axes.set_box_aspect(aspect)
    axes.set_box_aspect(aspect, zoom=float((extent / np.ptp(image(), axis=0)).min()))
    pixels = image()
    shift = corner + extent / 2 - (pixels.min(axis=0) + pixels.max(axis=0)) / 2
    axes.set_position((*(shift / size), 1.0, 1.0))
    pixels += shift
    own = points @ camera.axes[:2].T
    scale = float(np.ptp(pixels, axis=0).max() / np.ptp(own, axis=0)[np.ptp(pixels, axis=0).argmax()])
    return View(camera, scale, (pixels - scale * own).mean(axis=0))


def _nice(step: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(step))
    return float(power * next(f for f in (1, 2, 5, 10) if f * power >= step * (1 - 1e-9)))


def heading(figure: Figure, title: str, subtitle: str) -> None:
    """Title and subtitle at the top left."""
    lines = textwrap.wrap(title, 60)[:2]
    figure.text(0.035, 0.965, "\n".join(lines), size=14, weight="bold", va="top", color=INK)
    top = 0.965 - 0.045 * max(len(lines), 1)
    text = "\n".join(textwrap.wrap(subtitle, 105)[:3])
    figure.text(0.035, top, text, size=9.5, va="top", color="0.35", linespacing=1.35)


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
