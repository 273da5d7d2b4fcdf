"""Processor time of pictures: one, eight as `flexura modes --plot` writes them, one for print, and a mode in motion.

python benchmarks/pictures.py [FILE.yaml]
"""

from __future__ import annotations

import io
import sys
import tempfile
import time
from pathlib import Path

import flexura as fx

EXAMPLE = Path(__file__).parents[1] / "examples" / "rpr" / "rpr.yaml"


def timed(label: str, work, times: int = 3) -> None:  # type: ignore[no-untyped-def]
    """Print the least processor time of a few runs, in s."""
    least, told = float("inf"), ""
    for _ in range(times):
        begun = time.process_time()
        told = work() or ""
        least = min(least, time.process_time() - begun)
    print(f"{label:44s} {least:6.2f} s  {told}")


def png(figure) -> str:  # type: ignore[no-untyped-def]
    """A figure as a PNG; its size."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return f"{len(buffer.getvalue()) / 1024:.0f} kB"


def main() -> None:
    """Draw the modes of a mechanism in every way."""
    result = fx.modes(fx.load(Path(sys.argv[1]) if len(sys.argv) > 1 else EXAMPLE))
    model, u = result.model, result.shapes[:, :, 0]
    timed("first picture, Matplotlib loaded", lambda: png(fx.view.draw_mode(model, u, title="mode 1")), 1)
    timed("the mechanism, 1200 x 900", lambda: png(fx.view.draw_mechanism(model)))
    timed("a mode, 1200 x 900", lambda: png(fx.view.draw_mode(model, u, title="mode 1")))
    timed("a mode for print, 2400 x 1800", lambda: png(fx.view.draw_mode(model, u, title="mode 1", dpi=300)))
    with tempfile.TemporaryDirectory() as folder:
        timed("all pictures of six modes", lambda: f"{len(fx.view.save_modes(result, folder))} files")
        film = fx.view.animate_mode(model, u, title="mode 1")
        timed("24 frames of a mode, 800 x 600", lambda: str(fx.view.animate_mode(model, u, title="mode 1")))
        for form in ("gif", "webp"):
            path = Path(folder) / f"mode.{form}"
            timed(
                f"these as {form}",
                lambda path=path: f"{fx.view.save_animation(film, path).stat().st_size / 1024:.0f} kB",
            )


if __name__ == "__main__":
    main()
