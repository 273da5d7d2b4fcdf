"""Modes and strokes in motion: frames of one view over one background, and files of them that loop without a seam."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from flexura.analysis import Stroke
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.files import complete_file, scratch_folder
from flexura.structure import FullOrderModel
from flexura.view.drawing import (
    DPI,
    HIDDEN,
    INK,
    Painting,
    camera_for,
    colour_bar,
    ghost,
    heading,
    mode_colours,
    mode_view,
    moved_painting,
    new_figure,
    paint,
    render,
    scale_of,
    triad,
    view_of,
    visible_flexures,
)
from flexura.view.mechanisms.poses import numbered, pose_colours, pose_title, stress_bar
from flexura.view.scene import moved_solids, solids

SIZE = (8.0, 6.0)
"""Width and height of an animation, inches."""

FRAME_DPI = 100
"""Pixels per inch of the frames, 800 x 600 of them: films of modes then stay below 2 MB."""

MOST_POSES = 40
"""Poses of a stroke that an animation goes through, to and fro."""

FPS = 20
"""Frames a second."""

Format = Literal["gif", "webp", "mp4"]
"""Files that animations are written as."""


@dataclass(frozen=True, repr=False)
class Animation:
    """Images (n, height, width, 3), RGB, that follow each other in a loop, and how many a second."""

    images: NDArray[np.uint8]
    fps: float = FPS

    def __repr__(self) -> str:
        n, height, width, _ = self.images.shape
        return f"Animation({n} frames of {width} x {height} pixels, {n / self.fps:.3g} s)"


@verb
def animate_mode(
    model: FullOrderModel,
    displacements: ArrayLike,
    *,
    title: str,
    subtitle: str = "",
    warnings: Sequence[object] = (),
    scale: float | None = None,
    elev: float | None = None,
    azim: float | None = None,
    frames: int = 24,
) -> Animation:
    """One period of a vibration: the picture of `draw_mode`, which swings from one side to the other and back.

    Arguments as in `draw_mode`; `frames` (at least 4) make one period, 20 a second. Raises OptionError as that does.
    """
    if not isinstance(frames, int | np.integer) or not 4 <= frames <= 240:
        raise OptionError(f"an animation of a mode has from 4 to 240 frames, not {frames!r}")
    parts = solids(model, displacements)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE, FRAME_DPI)
    factor = scale_of(parts, scale)
    top = min(heading(figure, title, subtitle, warnings) - 0.01, 0.84)
    area = (0.035, 0.05, 0.82, top - 0.05)
    there, back = (mode_view(figure, parts, camera, sign * factor, area) for sign in (1, -1))
    view = there if there.scale < back.scale else back
    if view is back or not np.allclose(there.origin, back.origin):
        swing = factor * parts.motions
        view = view_of(figure, camera, np.concatenate([parts.points, parts.points + swing, parts.points - swing]), area)
    triad(figure, camera, (0.875, 0.03, 0.10, 0.133))
    colour_bar(figure, (0.912, 0.27, 0.017, min(0.45, top - 0.34)))
    paint(figure, ghost(parts, view))
    behind, colours = _drawn(figure), mode_colours(parts)
    phases = np.cos(2 * np.pi * np.arange(frames) / frames)
    images = {}
    for share in np.unique(phases.round(9)):
        images[share] = _over(behind, moved_painting(parts, view, share * factor, *colours))
    return Animation(np.stack([images[share] for share in phases.round(9)]))


@verb
def animate_stroke(
    result: Stroke, poses: Sequence[int] | None = None, *, elev: float | None = None, azim: float | None = None
) -> Animation:
    """A mechanism that goes through poses of its stroke and back, to scale, coloured by stress as in `draw_poses`.

    poses: numbers in the order in which they are gone through, by default all, or 40 of them, evenly chosen. Raises
    OptionError for fewer than two poses, and for numbers that there are not.
    """
    count = len(result.poses)
    if count < 2:
        raise OptionError("a stroke is animated over at least two poses")
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_POSES)).round().astype(int)).tolist()
    numbers = chosen if poses is None else numbered(result, poses, MOST_POSES)
    scenes = [moved_solids(result.model, result.frames[k], result.stress_profiles(k)) for k in numbers]
    camera = camera_for(scenes[0], elev, azim)
    outline = np.concatenate([own for parts in scenes for own in (parts.points, parts.points + parts.motions)])
    figure = new_figure(SIZE, FRAME_DPI)
    top = min(heading(figure, result.name, "over its stroke, to scale; light grey: undeformed"), 0.84)
    view = view_of(figure, camera, outline, (0.035, 0.11, 0.82, top - 0.12))
    largest = max(float(np.nanmax(parts.values, initial=0.0)) for parts in scenes)
    clear = visible_flexures(scenes[0], camera) < HIDDEN
    triad(figure, camera, (0.875, 0.03, 0.10, 0.133))
    if largest > 0:
        stress_bar(figure, largest, (0.895, 0.27, 0.017, 0.45))
    style = {"va": "bottom", "size": 11, "weight": "bold", "color": INK, "parse_math": False}
    said = figure.text(0.035, 0.035, "", **style)
    paint(figure, ghost(scenes[0], view))
    images = []
    for k, parts in zip(numbers, scenes, strict=True):
        said.set_text(pose_title(result, result.poses[k]))
        painting = moved_painting(parts, view, 1.0, *pose_colours(parts, largest), clear)
        images.append(_over(_drawn(figure), painting))
    return Animation(np.stack([*images, *images[-2:0:-1]]))


def _drawn(figure: Figure) -> NDArray[np.uint8]:
    """A figure as an image (height, width, 3)."""
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _over(behind: NDArray[np.uint8], painting: Painting) -> NDArray[np.uint8]:
    """An image with a painting over it."""
    height, width, _ = behind.shape
    image, _ = render(painting.enlarged(FRAME_DPI / DPI), width, height)
    image = image[::-1]
    rows, columns = np.nonzero(image[..., 3])
    cover = image[rows, columns, 3:].astype(np.float32) / 255
    found = behind.copy()
    found[rows, columns] = (cover * image[rows, columns, :3] + (1 - cover) * behind[rows, columns] + 0.5).astype(
        np.uint8
    )
    return found


@verb
def save_animation(animation: Animation, path: Path | str) -> Path:
    """Write an animation as a GIF, WebP or MP4, by its suffix, which loops; the file appears complete or not at all.

    Raises OptionError for other suffixes, for files that cannot be written, and for MP4 without the program ffmpeg.
    """
    if not isinstance(animation, Animation):
        raise OptionError(
            f"save_animation: `animation` is what animate_mode or animate_stroke returns, not {animation!r}"
        )
    content = encoded(animation, Path(path).suffix[1:].lower())
    with complete_file(path) as scratch:
        scratch.write_bytes(content)
    return Path(path)


def writable(form: str) -> str:
    """The same form. Raises OptionError for one that is not known, and for MP4 without ffmpeg."""
    if form not in get_args(Format):
        raise OptionError(f"animations are written as gif, webp or mp4, not {form!r}")
    if form == "mp4" and shutil.which("ffmpeg") is None:
        raise OptionError(
            "MP4 needs the program ffmpeg, which is not there: install it (on Debian: apt-get install ffmpeg), or ask"
            " for gif or webp"
        )
    return form


def encoded(animation: Animation, form: str) -> bytes:
    """The content of a file of an animation. Raises OptionError as `writable` does."""
    if writable(form) == "mp4":
        return _mp4(animation)
    pictures = [Image.fromarray(image) for image in animation.images]
    buffer = io.BytesIO()
    times = {"save_all": True, "loop": 0, "duration": round(1000 / animation.fps)}
    if form == "webp":
        pictures[0].save(buffer, "WEBP", append_images=pictures[1:], quality=80, method=2, **times)
        return buffer.getvalue()
    # one palette for all, so that colours do not flicker and what stands still is stored once
    sample = Image.fromarray(np.concatenate(animation.images[:: max(1, len(pictures) // 4)][:4]))
    palette = sample.quantize(255, dither=Image.Dither.NONE)
    colours = np.array(palette.getpalette()).reshape(-1, 3)
    colours[colours.sum(axis=1).argmax()] = 255  # paper is white
    palette.putpalette(colours.ravel().tolist())
    flat = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    flat[0].save(buffer, "GIF", append_images=flat[1:], optimize=False, **times)
    return buffer.getvalue()


def _mp4(animation: Animation) -> bytes:
    """H.264 by ffmpeg; three loops, as players stop at the end."""
    _, height, width, _ = animation.images.shape
    with scratch_folder() as folder:
        target = Path(folder) / "film.mp4"
        size = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{animation.fps:g}", "-i", "-"]
        even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
        command = [shutil.which("ffmpeg") or "ffmpeg", "-v", "error", "-y", *size, *even, os.fspath(target)]
        done = subprocess.run(command, input=3 * animation.images.tobytes(), capture_output=True, check=False)
        if done.returncode or not target.exists():
            reason = done.stderr.decode(errors="replace").strip().splitlines()
            raise OptionError(f"ffmpeg cannot write MP4: {reason[-1] if reason else f'status {done.returncode}'}")
        return target.read_bytes()
