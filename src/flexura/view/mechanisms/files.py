"""Pictures as PNG files and animations as GIF, WebP or MP4, each written whole or not at all."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from PIL import Image

from flexura.analysis import CheckReport, Mode, Modes
from flexura.arguments import verb
from flexura.deadline import stage
from flexura.errors import OptionError
from flexura.files import complete_file, complete_files, scratch_folder
from flexura.structure import FullOrderModel
from flexura.view.drawing import (
    DPI,
    Canvas,
    good_camera,
    mode_scale,
)
from flexura.view.mechanisms.pictures import (
    Animation,
    animate_mode,
    draw_mechanism,
    draw_mode,
    draw_sheet,
    draw_warnings,
)
from flexura.view.scene import Array, solids


@verb
def save_pictures(
    model: FullOrderModel,
    folder: Path | str,
    *,
    shapes: ArrayLike | None = None,
    titles: Sequence[str] = (),
    subtitles: Sequence[str] = (),
    flags: Sequence[str] = (),
    warnings: Sequence[Sequence[object]] = (),
    common: Sequence[object] = (),
    names: bool | Sequence[str] = False,
    magnify: float = 1.0,
    dpi: float = DPI,
) -> list[Path]:
    """Write `mechanism.png`, `mode_01.png` and so on, and `modes.png` with the first six modes on one sheet.

    shapes: (n_nodes, 6, k), displacements of all nodes in k modes, global frame, in any scale; titles and subtitles: k
    each; or None and no titles for the mechanism alone. `warnings` of each mode and those `common` to all stand in its
    picture; `flags`, which say the same of each in a few words, and `common` on the sheet. `names` of parts stand in
    the picture of the mechanism, as in `draw_mechanism`. Displacements are drawn `magnify` times as large as is usual,
    with `dpi` dots per inch. The folder is made when it is missing. All pictures are drawn before any is written, and
    every file appears complete or not at all; files of the same names are replaced. Returns the paths in the order
    above; there is no sheet without modes. Raises OptionError when the folder cannot be written to, or when shapes,
    titles and the rest do not fit together.
    """
    nodes = model.plan.topology.n_nodes
    u = np.empty((nodes, 6, 0)) if shapes is None else np.asarray(shapes, dtype=float)
    flags, warnings = flags or [""] * len(titles), warnings or [()] * len(titles)
    if u.ndim != 3 or {len(titles), len(subtitles), len(flags), len(warnings)} != {u.shape[2]}:
        raise OptionError(
            "shapes have shape (nodes, 6, modes), with a title and a subtitle for each mode, and flags and warnings of"
            f" each where there are any; found {u.shape}, {len(titles)} titles, {len(subtitles)} subtitles,"
            f" {len(flags)} flags and {len(warnings)} lists of warnings"
        )
    _check_factor(magnify)
    target = make_folder(Path(folder))
    captions = [_Caption(*caption) for caption in zip(titles, subtitles, flags, warnings, strict=True)]
    return write_files(_pictures(model, u, captions, common, names=names, magnify=magnify, dpi=dpi), target)


class _Caption(NamedTuple):
    """What is written above a mode: on the sheet the flag, in its own picture the warnings."""

    title: str
    subtitle: str
    flag: str
    warnings: Sequence[object]


def _pictures(
    model: FullOrderModel,
    shapes: Array,
    captions: Sequence[_Caption],
    common: Sequence[object],
    *,
    names: bool | Sequence[str],
    magnify: float,
    dpi: float,
) -> dict[str, bytes]:
    """The pictures of `save_pictures` by name."""
    camera = good_camera(solids(model))
    view: dict[str, Any] = {"elev": camera.elev, "azim": camera.azim, "dpi": dpi}
    pictures = {"mechanism.png": _png(draw_mechanism(model, names=names, **view))}
    for k, (title, subtitle, _, warnings) in enumerate(captions):
        stage(f"drawing mode {k + 1} of {len(captions)}")
        scale = magnify * mode_scale(solids(model, shapes[:, :, k]))
        texts: dict[str, Any] = {"title": title, "subtitle": subtitle, "warnings": [*warnings, *common]}
        pictures[f"mode_{k + 1:02d}.png"] = _png(draw_mode(model, shapes[:, :, k], scale=scale, **texts, **view))
    if captions:
        titles, subtitles, flags, _ = zip(*captions, strict=True)
        sheet = draw_sheet(model, shapes, titles, subtitles, flags=flags, warnings=common, magnify=magnify, **view)
        pictures["modes.png"] = _png(sheet)
    return pictures


@verb
def save_modes(
    result: Modes,
    folder: Path | str,
    *,
    animate: Format | None = None,
    names: bool | Sequence[str] = False,
    magnify: float = 1.0,
    dpi: float = DPI,
) -> list[Path]:
    """Write the pictures of `save_pictures` for modes: every frequency with how far it is proven and how far the part
    may be from it, and all warnings; and with
    `animate`, `gif`, `webp` or `mp4`, each mode in motion, such as `mode_01.gif`.

    `names`, `magnify` and `dpi` as in `save_pictures`. Raises OptionError when the folder cannot be written to, and as
    `save_animation` does.
    """
    form = None if animate is None else writable(animate)
    _check_factor(magnify)
    model, common = result.model, [warning for warning in result.warnings if not warning.place]
    target = make_folder(Path(folder))
    captions = [
        _Caption(
            f"mode {mode.number}: {_frequency(mode)}",
            f"proven: {mode.proven_text}, model error: {error}; {mode.motion.summary}",
            mode.flag,
            [warning for warning in result.warnings if warning.place == f"mode {mode.number}"],
        )
        for mode, error in zip(result.modes, result.model_errors.texts, strict=True)
    ]
    films: dict[str, bytes] = {}
    if form is not None:
        camera = good_camera(solids(model))
        for k, (title, subtitle, _, warnings) in enumerate(captions):
            stage(f"drawing mode {k + 1} of {len(captions)} in motion")
            shape = result.shapes[:, :, k]
            scale = magnify * mode_scale(solids(model, shape))
            texts: dict[str, Any] = {"title": title, "subtitle": subtitle, "warnings": [*warnings, *common]}
            film = animate_mode(model, shape, scale=scale, elev=camera.elev, azim=camera.azim, **texts)
            films[f"mode_{k + 1:02d}.{form}"] = encoded(film, form)
    pictures = _pictures(model, result.shapes, captions, common, names=names, magnify=magnify, dpi=dpi)
    return write_files(pictures | films, target)


def _check_factor(magnify: float) -> None:
    """Raises OptionError for what displacements cannot be magnified by."""
    if not (isinstance(magnify, int | float | np.number) and np.isfinite(magnify) and magnify > 0):
        raise OptionError(f"`magnify` is a positive number, not {magnify!r}")


def _frequency(mode: Mode) -> str:
    """The frequency of a mode as a title says it."""
    if mode.is_rigid:
        return "0 Hz, rigid motion"
    return "frequency unknown" if mode.frequency_text == "unknown" else mode.frequency_text


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


Format = Literal["gif", "webp", "mp4"]
"""Files that animations are written as."""


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


@verb
def save_warnings(report: CheckReport, folder: Path | str, *, model: FullOrderModel) -> list[Path]:
    """Write the picture of `draw_warnings` as `warnings.png`. Raises OptionError when it cannot be written."""
    return save_figures({"warnings.png": draw_warnings(model, report)}, folder)


@verb
def save_figures(figures: Mapping[str, Figure], folder: Path | str) -> list[Path]:
    """Write figures by file name, such as `bode.png`, into a folder, which is made when it is missing.

    All are drawn before any is written, and every file appears complete or not at all. Raises OptionError when the
    folder cannot be written to, and for anything but figures.
    """
    if any(not hasattr(figure, "savefig") for figure in figures.values()):
        raise OptionError("save_figures: `figures` holds figures of Matplotlib by file name")
    return write_files(figure_files(figures), make_folder(Path(folder)))


def figure_files(figures: Mapping[str, Figure]) -> dict[str, bytes]:
    """Contents of figures as files, by name."""
    return {name: _png(figure) for name, figure in figures.items()}


def write_files(contents: dict[str, bytes], folder: Path) -> list[Path]:
    """Write files into a folder, each of which appears complete or not at all.

    Raises OptionError when the folder cannot be written to.
    """
    with complete_files(folder) as scratch:
        for name, content in contents.items():
            (scratch / name).write_bytes(content)
    return [folder / name for name in contents]


def make_folder(folder: Path) -> Path:
    """The folder, made when it is missing."""
    if folder.exists() and not folder.is_dir():
        raise OptionError(f"pictures go to a folder, but {folder} is a file")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OptionError(f"cannot make the folder {folder}: {error.strerror or error}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OptionError(f"cannot write pictures to {folder}: permission denied")
    return folder


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    if isinstance(figure.canvas, Canvas):
        figure.canvas.print_png(buffer)  # laid out and drawn once, where `savefig` draws it a second time
    else:
        figure.savefig(buffer, format="png", dpi=figure.dpi)
    return buffer.getvalue()
