"""Where figures are made."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import NDArray

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


def new_chart(size: tuple[float, float], dpi: float = DPI) -> Figure:
    """The same for curves, which lay themselves out."""
    figure = new_figure(size, dpi)
    figure.set_layout_engine("constrained")
    return figure
