"""Pictures as PNG files, each written whole or not at all."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from flexura.errors import OptionError
from flexura.files import complete_files
from flexura.structure import FullOrderModel
from flexura.view.pictures import DPI, draw_mechanism, draw_mode, draw_sheet
from flexura.view.solids import node_motions, solids
from flexura.view.viewpoint import good_camera

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save_pictures(
    model: FullOrderModel,
    shapes: ArrayLike | None,
    titles: Sequence[str],
    subtitles: Sequence[str],
    folder: Path | str,
) -> list[Path]:
    """Write `mechanism.png`, `mode_01.png` and so on, and `modes.png` with the first six modes on one sheet.

    shapes: (n_nodes, 6, k), displacements of all nodes in k modes, global frame, in any scale; titles and subtitles:
    k each; or None and no titles for the mechanism alone. The folder is made when it is missing. All pictures are
    drawn before any is written, and every file appears complete or not at all; files of the same names are replaced.
    Returns the paths in the order above; there is no sheet without modes. Raises OptionError when the folder cannot
    be written to, or when shapes, titles and subtitles do not fit together.
    """
    nodes = model.plan.topology.n_nodes
    u = np.empty((nodes, 6, 0)) if shapes is None else np.asarray(shapes, dtype=float)
    if u.ndim != 3 or not u.shape[2] == len(titles) == len(subtitles):
        raise OptionError(
            "shapes have shape (nodes, 6, modes), with a title and a subtitle for each mode; "
            f"found {u.shape}, {len(titles)} titles and {len(subtitles)} subtitles"
        )
    rest = solids(model, np.zeros((nodes, 6)))
    for k in range(u.shape[2]):
        node_motions(model, u[:, :, k])
    target = _folder(Path(folder))
    camera = good_camera(rest)
    elev, azim = camera.elev, camera.azim
    pictures = {"mechanism.png": _png(draw_mechanism(model, elev=elev, azim=azim))}
    for k, (title, subtitle) in enumerate(zip(titles, subtitles, strict=True)):
        mode = draw_mode(model, u[:, :, k], title=title, subtitle=subtitle, elev=elev, azim=azim)
        pictures[f"mode_{k + 1:02d}.png"] = _png(mode)
    if titles:
        pictures["modes.png"] = _png(draw_sheet(model, u, titles, subtitles, elev=elev, azim=azim))
    return write_files(pictures, target)


def save_figures(figures: Mapping[str, Figure], folder: Path | str) -> list[Path]:
    """Write figures by file name, such as `bode.png`, into a folder, which is made when it is missing.

    All are drawn before any is written, and every file appears complete or not at all. Raises OptionError when the
    folder cannot be written to.
    """
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
    figure.savefig(buffer, format="png", dpi=DPI)
    return buffer.getvalue()
