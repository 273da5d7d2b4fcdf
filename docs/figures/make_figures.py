"""Draw the figures of the pages: python docs/figures/make_figures.py."""

import re
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import flexura as fx
from flexura.beam import contour

HERE = Path(__file__).parent


def contours() -> None:
    """Profiles of all contours over the length of a notch."""
    a, b, t = 5.0, 3.0, 1.0
    x = np.linspace(-a, a, 401)
    shapes = {
        "circular, R = a": contour.circular(x, a, t),
        "elliptical": contour.elliptical(x, a, b, t),
        "parabolic": contour.parabolic(x, a, b, t),
        "hyperbolic": contour.hyperbolic(x, a, b, t),
        "corner_filleted": contour.corner_filleted(x, a, 1.5, t),
        "v_shaped": contour.v_shaped(x, np.radians(35), 1.0, t),
        "table": contour.tabulated(x + a, np.array([0.0, 3, 6, 10]), np.array([5.0, 1.5, 1, 4])),
        "straight": t + 0 * x,
    }
    figure = Figure(figsize=(9.0, 4.2))
    FigureCanvasAgg(figure)
    for k, (name, h) in enumerate(shapes.items()):
        axes = figure.add_subplot(2, 4, k + 1)
        axes.fill_between(x, -h / 2, h / 2, color="#8fa8c8", edgecolor="#22344e", linewidth=0.8)
        axes.set(xlim=(-5.6, 5.6), ylim=(-6, 6), aspect="equal", title=name)
        axes.set_axis_off()
    figure.tight_layout()
    figure.savefig(HERE / "contours.svg", metadata={"Date": None})


def pivot() -> None:
    """The first mode of the tutorial's pivot."""
    page = (HERE.parent / "tutorial.md").read_text(encoding="utf-8")
    block = re.search(r"```yaml\n(# file: pivot.yaml\n.*?)```", page, re.DOTALL)
    result = fx.modes(fx.loads(block[1]), n=1)
    mode = result.modes[0]
    title = f"mode 1: {mode.frequency_hz:.4g} Hz"
    figure = fx.draw_mode(result.model, result.shapes[:, :, 0], title=title, subtitle=mode.motion.summary)
    figure.savefig(HERE / "pivot_mode_01.png", dpi=100)


if __name__ == "__main__":
    contours()
    pivot()
