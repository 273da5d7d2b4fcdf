"""Figures and what is written into them: colours and names of parts, wrapped text, headings, legends, colour scales.

All sizes suit 150 dpi.
"""

from __future__ import annotations

import io
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.image import AxesImage
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.textpath import text_to_path
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox
from numpy.typing import ArrayLike, NDArray

from flexura.view.scene import Array, Kind, Solids

DPI = 150
"""Pixels per inch of pictures on screens; print wants 300."""


_PNG = {"compress_level": 3}


class Canvas(FigureCanvasAgg):
    """An Agg canvas that takes half as long over a PNG file, which is then a quarter larger."""

    def print_png(self, filename_or_obj: Any, *, metadata: Any = None, pil_kwargs: Any = None, **_: Any) -> None:
        """As Matplotlib's, which has drawn with the other options; `pil_kwargs` may ask for a smaller file."""
        super().print_png(filename_or_obj, metadata=metadata, pil_kwargs=_PNG | (pil_kwargs or {}))


class _Pixels(AxesImage):
    """An image that is copied where its pixels are those of the canvas, and interpolated elsewhere."""

    def make_image(self, renderer: Any, magnification: float = 1.0, unsampled: bool = False) -> Any:
        """As Matplotlib's: pixels, where they begin, and how to transform them."""
        image, area = np.asarray(self.get_array()), self.get_window_extent()
        if np.allclose(magnification * np.array(area.size), image.shape[1::-1], rtol=0, atol=0.01):
            whole = magnification == 1.0
            return image, *((round(area.x0), round(area.y0)) if whole else (area.x0, area.y0)), None
        return super().make_image(renderer, magnification, unsampled)


def lay_image(axes: Axes, image: NDArray[np.uint8], pixel: float) -> None:
    """Lay an image (h, w, 4), RGBA with the lowest row first, over axes from their origin, without the transparent
    rows and columns around it; pixel: how large one is on the axes."""
    shown = image[..., 3] > 0
    rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
    if not len(rows):
        return
    low, high, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    extent = pixel * float(left), pixel * float(right), pixel * float(low), pixel * float(high)
    pixels = _Pixels(axes, origin="lower", extent=extent, interpolation="antialiased")
    pixels.set_data(np.ascontiguousarray(image[low:high, left:right]))
    axes.add_image(pixels)


class ShownFigure(Figure):
    """A figure that shows itself at the end of a notebook's cell, whatever backend pyplot has there.

    Where Matplotlib's inline backend shows figures by themselves, it does so in place of this.
    """

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


def new_figure(size: tuple[float, float], dpi: float = DPI) -> Figure:
    """A white figure on an Agg canvas, width and height in inches; pyplot is not involved."""
    figure = ShownFigure(figsize=size, dpi=dpi, facecolor="white")
    Canvas(figure)
    return figure


class _MeasuredOnce(ConstrainedLayoutEngine):
    """Matplotlib's constrained layout, which measures what stands around panels a second time once they have been
    moved; here it is as wide the second time as it was the first, but for panels that keep an aspect."""

    def execute(self, fig: Figure) -> Any:
        """Lay out a figure."""
        panels = [axes for axes in fig.axes if axes.get_aspect() == "auto"]
        for axes in panels:
            vars(axes)["get_tightbbox"] = _remembered(axes)
        try:
            return super().execute(fig)
        finally:
            for axes in panels:
                del vars(axes)["get_tightbbox"]


def _remembered(axes: Axes) -> Callable[..., Any]:
    """The `get_tightbbox` of axes, as far beyond their place as it was at the first call."""
    measure, beyond = axes.get_tightbbox, None

    def box(renderer: Any, **how: Any) -> Any:
        nonlocal beyond
        place = np.array(axes.get_position(original=True).transformed(axes.figure.transSubfigure).extents)
        if beyond is None and (first := measure(renderer, **how)) is not None:
            beyond = first.extents - place
        return None if beyond is None else Bbox.from_extents(*(place + beyond))

    return box


def new_chart(size: tuple[float, float], dpi: float = DPI) -> Figure:
    """The same for curves, which lay themselves out."""
    figure = new_figure(size, dpi)
    figure.set_layout_engine(_MeasuredOnce())
    return figure


RGB = tuple[float, float, float]


class KindStyle(NamedTuple):
    """How parts of a kind look: name in legends, colour, and width of their lines, points."""

    name: str
    colour: RGB
    width: float = 1.0


STYLES = {
    Kind.FLEXURE: KindStyle("flexure", (0.93, 0.42, 0.10), 1.6),
    Kind.LINK: KindStyle("link", (0.42, 0.64, 0.84)),
    Kind.BODY: KindStyle("rigid body", (0.78, 0.79, 0.81)),
    Kind.EQUIVALENT_BODY: KindStyle("rigid body (box of equal inertia)", (0.66, 0.70, 0.62)),
    Kind.SPRING: KindStyle("spring", (0.05, 0.52, 0.36), 1.2),
    Kind.MASS: KindStyle("point mass", (0.45, 0.25, 0.60)),
    Kind.SUPERELEMENT: KindStyle("superelement", (0.80, 0.20, 0.52), 1.1),
    Kind.CLAMP: KindStyle("clamped", (0.30, 0.32, 0.36)),
    Kind.PARTLY_HELD: KindStyle("partly held", (0.95, 0.80, 0.25)),
    Kind.ARM: KindStyle("rigid arm", (0.20, 0.20, 0.22), 0.8),
    Kind.NODE: KindStyle("node", (1.0, 1.0, 1.0)),
    Kind.CENTRE: KindStyle("centre of mass", (0.10, 0.10, 0.10)),
    Kind.PIEZO: KindStyle("piezo stack", (0.35, 0.75, 0.78)),
    Kind.FLAGGED: KindStyle("member with a warning", (0.84, 0.05, 0.15), 1.6),
    Kind.FLAGGED_BODY: KindStyle("rigid body with a warning", (0.93, 0.45, 0.50)),
    Kind.ACTUATOR: KindStyle("actuator", (0.60, 0.05, 0.25)),
    Kind.SENSOR: KindStyle("sensor", (0.13, 0.30, 0.75)),
    Kind.DASHPOT: KindStyle("dashpot", (0.52, 0.30, 0.12), 1.2),
    Kind.STOP: KindStyle("stop", (0.62, 0.16, 0.10)),
}
COLOURS: dict[Kind, RGB] = {kind: style.colour for kind, style in STYLES.items()}
"""Colour of each kind of part, RGB."""
NAMES: dict[Kind, str] = {kind: style.name for kind, style in STYLES.items()}
INK, GREY = "#22262b", "0.35"
WARNING = "#8a5a00"
GHOST = (0.90, 0.91, 0.92)


def displacement_colours(share: ArrayLike) -> Array:
    """Colours (..., 3), RGB, of displacements (...) relative to the largest."""
    return colormaps["viridis"](0.04 + 0.92 * np.clip(share, 0.0, 1.0))[..., :3]


def stress_colours(share: ArrayLike) -> Array:
    """Colours (..., 3), RGB, of stresses (...) relative to the largest."""
    return colormaps["YlOrRd"](0.98 * np.clip(share, 0.0, 1.0))[..., :3]


def force_colours(share: ArrayLike) -> Array:
    """Colours (..., 3), RGB, of axial forces (...) from -1, compression, to 1, tension."""
    return colormaps["RdBu_r"](0.5 + 0.46 * np.clip(np.asarray(share, dtype=float), -1.0, 1.0)[..., None])[..., 0, :3]


SPARE = 1.03
"""How much wider letters may become that are fitted to pixels."""

CUT = " ..."
"""What ends the last line of a text that is longer."""


def wrapped(text: str, width: float, size: float, most: int, weight: str = "normal") -> list[str]:
    """At most so many lines of a text, none wider than a width in inches in type of a size in points."""
    room = 72 * width / (SPARE * size)
    words = [word for word in re.split(r"[ \t\n]+", text) if word]
    lines = [""] if words else []
    for word in words:
        rest = f" {word}" if lines[-1] else word
        if lines[-1] and _width(lines[-1] + rest, weight) > room:
            lines.append("")
            rest = word
        while rest:
            count = _fitting(lines[-1] + rest, room, weight) - len(lines[-1])
            lines[-1] += rest[:count]
            rest = rest[count:]
            lines += [""] if rest else []
        if len(lines) > most:
            last = lines[most - 1]
            return [*lines[: most - 1], last[: _fitting(last, room - _width(CUT, weight), weight)].rstrip() + CUT]
    return lines


NAME = 44
"""Characters of a name in a legend."""


def shortened(name: str, most: int = NAME) -> str:
    """A name that is too long without its middle."""
    return name if len(name) <= most else f"{name[: most // 2 - 1]} ... {name[-(most - most // 2 - 4) :]}"


def _fitting(text: str, room: float, weight: str) -> int:
    """How many letters of a text, one at least, fit into a room in sizes of the type."""
    if _width(text, weight) <= room:
        return len(text)
    return max(1, bisect_right(range(1, len(text)), room, key=lambda count: _width(text[:count], weight)))


@lru_cache(maxsize=4096)
def _width(text: str, weight: str) -> float:
    """Width of a text over the size of its type."""
    return text_to_path.get_text_width_height_descent(text, FontProperties(size=1.0, weight=weight), False)[0]


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

SPACING = 1.35
"""Height of a line of text over the size of the type."""


def write(figure: Figure, x: float, y: float, text: str | Sequence[str], **style: Any) -> None:
    """Write a text, or lines with more space between them, into a figure at a place in fractions of it; nothing is read
    as mathematics."""
    if not isinstance(text, str):
        text, style = "\n".join(text), {"linespacing": SPACING} | style
    if text:
        figure.text(x, y, text, **{"color": INK, "parse_math": False} | style)


def heading(figure: Figure, title: str, subtitle: str, warnings: Iterable[object] = ()) -> float:
    """Title, subtitle and warnings at the top left; returns where they end, as a fraction of the height."""
    width = 0.93 * figure.get_figwidth()
    lines = wrapped(title, width, 14, 2, "bold")
    write(figure, 0.035, 0.965, "\n".join(lines), size=14, weight="bold", va="top")
    top = 0.965 - 0.045 * max(len(lines), 1)
    lines = wrapped(subtitle, width, 9.5, 3)
    write(figure, 0.035, top, lines, size=9.5, color=GREY, va="top")
    top -= len(lines) * line_height(figure, 9.5)
    lines = remark_lines(warnings, "warning", width, 8.5, most=2)
    if lines:
        top -= 0.006
        write(figure, 0.035, top, lines, size=8.5, color=WARNING, va="top")
    return top - len(lines) * line_height(figure, 8.5)


def line_height(figure: Figure, size: float) -> float:
    """Height of a line of type of a size in points, as a fraction of the height of the figure."""
    return SPACING * size / 72 / figure.get_figheight()


def remark_lines(
    remarks: Iterable[object], kind: str, width: float, size: float, most: int = MOST_REMARKS
) -> list[str]:
    """The first few remarks, each after its kind, wrapped to a width in inches of type of a size in points; how many
    more there are."""
    texts = list(dict.fromkeys(map(str, remarks)))
    lines = [line for text in texts[:most] for line in wrapped(f"{kind}: {text}", width, size, MOST_LINES)]
    rest = len(texts) - most
    return lines + ([f"and {rest} more {kind}{'s' if rest > 1 else ''}"] if rest > 0 else [])


def headline(figure: Figure, title: str, warnings: Sequence[object] = (), notes: Sequence[object] = ()) -> None:
    """Write a title over all axes of a figure whose layout is constrained, and along its lower edge warnings, then
    notes."""
    figure.suptitle(shortened(title, 90), fontsize=10, color=INK, parse_math=False)
    width = 0.97 * figure.get_figwidth()
    written_below(figure, remark_lines(notes, "note", width, 6.5), 6.5, GREY)
    written_below(figure, remark_lines(warnings, "warning", width, 6.5), 6.5, WARNING)


def written_below(figure: Figure, lines: Sequence[str], size: float = 7.0, colour: str = INK) -> None:
    """Lines of text along the lower edge of a figure whose layout is constrained, above what is there already."""
    engine = figure.get_layout_engine()
    if not lines or engine is None:
        return
    left, bottom, width, height = engine.get()["rect"]  # type: ignore[index]
    gap = 0.04 / figure.get_figheight()
    total = len(lines) * line_height(figure, size) + 2 * gap
    engine.set(rect=(left, bottom + total, width, height - total))  # type: ignore[call-arg]
    write(figure, 0.015, bottom + gap, lines, size=size, color=colour, va="bottom")


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


def colour_bar(figure: Figure, area: Box) -> None:
    """Scale of displacements relative to the largest."""
    colours = displacement_colours(np.linspace(0, 1, 256))
    colour_scale(figure, area, colours, [0, 0.5, 1], ["0", "½", "max"], "displacement")


def stress_bar(figure: Figure, largest: float, area: Box) -> None:
    """The scale of stress, MPa, unless the largest, Pa, is nothing."""
    if not largest > 0:
        return
    top = largest / 1e6
    ticks = [tick for tick in MaxNLocator(5).tick_values(0.0, top) if 0 <= tick <= top]
    colours, texts = stress_colours(np.linspace(0, 1, 256)), [f"{tick:g}" for tick in ticks]
    colour_scale(figure, area, colours, [tick / top for tick in ticks], texts, "largest stress\nin section, MPa")


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
