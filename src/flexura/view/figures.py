"""Where figures are made."""

from __future__ import annotations

import io

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

DPI = 150
"""Pixels per inch of pictures on screens; print wants 300."""


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
    FigureCanvasAgg(figure)
    return figure


def new_chart(size: tuple[float, float], dpi: float = DPI) -> Figure:
    """The same for curves, which lay themselves out."""
    figure = new_figure(size, dpi)
    figure.set_layout_engine("constrained")
    return figure
