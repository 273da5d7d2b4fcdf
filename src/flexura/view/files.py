"""Pictures as PNG files, each written whole or not at all."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from flexura.analysis import Mode, Modes
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.files import complete_files
from flexura.structure import FullOrderModel
from flexura.view.pictures import draw_mechanism, draw_mode, draw_sheet
from flexura.view.solids import node_motions, solids
from flexura.view.viewpoint import good_camera


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
) -> list[Path]:
    """Write `mechanism.png`, `mode_01.png` and so on, and `modes.png` with the first six modes on one sheet.

    shapes: (n_nodes, 6, k), displacements of all nodes in k modes, global frame, in any scale; titles and subtitles:
    k each; or None and no titles for the mechanism alone. `warnings` of each mode and those `common` to all stand in
    its picture; `flags`, which say the same of each in a few words, and `common` on the sheet. The folder is made when
    it is missing. All pictures are drawn before any is written, and every file appears complete or not at all; files of
    the same names are replaced. Returns the paths in the order above; there is no sheet without modes. Raises
    OptionError when the folder cannot be written to, or when shapes, titles and the rest do not fit together.
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
    rest = solids(model, np.zeros((nodes, 6)))
    for k in range(u.shape[2]):
        node_motions(model, u[:, :, k])
    target = _folder(Path(folder))
    camera = good_camera(rest)
    elev, azim = camera.elev, camera.azim
    pictures = {"mechanism.png": _png(draw_mechanism(model, elev=elev, azim=azim))}
    for k, (title, subtitle, own) in enumerate(zip(titles, subtitles, warnings, strict=True)):
        said = [*own, *common]
        mode = draw_mode(model, u[:, :, k], title=title, subtitle=subtitle, warnings=said, elev=elev, azim=azim)
        pictures[f"mode_{k + 1:02d}.png"] = _png(mode)
    if titles:
        sheet = draw_sheet(model, u, titles, subtitles, flags=flags, warnings=common, elev=elev, azim=azim)
        pictures["modes.png"] = _png(sheet)
    return write_files(pictures, target)


@verb
def save_modes(result: Modes, folder: Path | str) -> list[Path]:
    """Write the pictures of `save_pictures` for modes: every frequency as it is proven, and all warnings.

    Raises OptionError when the folder cannot be written to.
    """
    own, common = [f"mode {mode.number}" for mode in result.modes], [w for w in result.warnings if not w.place]
    return save_pictures(
        result.model,
        folder,
        shapes=result.shapes,
        titles=[f"mode {mode.number}: {_frequency(mode)}" for mode in result.modes],
        subtitles=[mode.motion.summary for mode in result.modes],
        flags=[mode.flag for mode in result.modes],
        warnings=[[w for w in result.warnings if w.place == place] for place in own],
        common=common,
    )


def _frequency(mode: Mode) -> str:
    """The frequency of a mode as a title says it."""
    if mode.is_rigid:
        return "0 Hz, rigid motion"
    text = mode.frequency_text
    return "frequency unknown" if text == "unknown" else f"{text} Hz"


@verb
def save_figures(figures: Mapping[str, Figure], folder: Path | str) -> list[Path]:
    """Write figures by file name, such as `bode.png`, into a folder, which is made when it is missing.

    All are drawn before any is written, and every file appears complete or not at all. Raises OptionError when the
    folder cannot be written to, and for anything but figures.
    """
    if any(not hasattr(figure, "savefig") for figure in figures.values()):
        raise OptionError("save_figures: `figures` holds figures of Matplotlib by file name")
    contents = {name: _png(figure) for name, figure in figures.items()}
    return write_files(contents, _folder(Path(folder)))


def write_files(contents: dict[str, bytes], folder: Path) -> list[Path]:
    """Write files into a folder, each of which appears complete or not at all.

    Raises OptionError when the folder cannot be written to.
    """
    with complete_files(folder) as scratch:
        for name, content in contents.items():
            (scratch / name).write_bytes(content)
    return [folder / name for name in contents]


def _folder(folder: Path) -> Path:
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
    figure.savefig(buffer, format="png", dpi=figure.dpi)
    return buffer.getvalue()
