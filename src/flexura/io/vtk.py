"""VTK files of meshes and mode shapes, for ParaView and its relatives."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from flexura.analysis import Modes
from flexura.errors import OptionError
from flexura.extras import need
from flexura.files import complete_files
from flexura.io.lines import KINDS, Lines, lines_of
from flexura.structure import FullOrderModel


def write_vtu(what: Modes | FullOrderModel, path: str | Path, amplitude: float | None = None) -> list[Path]:
    """Write the full-order beam mesh as lines, with displacement (m) and rotation (rad) of every mode at its points.

    Point data `mode_01_displacement` and `mode_01_rotation`, 3 components each, are M-orthonormal, or of the largest
    displacement `amplitude`, m. Cell data `part` and `kind` are numbers that the table `NAME_parts.csv` explains, kind
    a position in link, flexure, body, spring, superelement. Returns both paths. Raises OptionError without meshio, for
    other objects, and when a file cannot be written.
    """
    if not isinstance(what, Modes | FullOrderModel):
        raise OptionError(f"a VTK file is of modes or of a full-order model, not of a {type(what).__name__}")
    if amplitude is not None and not (np.isfinite(amplitude) and amplitude > 0):
        raise OptionError(f"an amplitude is a positive length in m, not {amplitude}")
    meshio = need("meshio", "export")
    mesh = lines_of(what.model if isinstance(what, Modes) else what)
    data = _shapes(what, mesh, amplitude) if isinstance(what, Modes) else {}
    kinds = np.array([KINDS.index(kind) for kind in mesh.kinds], dtype=np.int32)
    cells = {"part": [mesh.part.astype(np.int32)], "kind": [kinds[mesh.part]]}
    path = Path(path)
    table = path.with_name(f"{path.stem}_parts.csv")
    with complete_files(path.parent) as scratch:
        blocks = [("line", mesh.lines)] if len(mesh.lines) else [("vertex", np.arange(len(mesh.points))[:, None])]
        own = meshio.Mesh(mesh.points, blocks, data, cells if len(mesh.lines) else None)
        meshio.write(scratch / path.name, own, file_format="vtu")
        with (scratch / table.name).open("w", newline="", encoding="utf-8") as stream:
            rows = zip(range(len(mesh.names)), mesh.names, kinds.tolist(), mesh.kinds, strict=True)
            csv.writer(stream, lineterminator="\n").writerows([("part", "name", "kind", "kind_name"), *rows])
    return [path, table]


def _shapes(modes: Modes, mesh: Lines, amplitude: float | None) -> dict[str, np.ndarray]:
    data = {}
    for k in range(len(modes.modes)):
        shape = modes.shapes[mesh.node, :, k]
        largest = np.linalg.norm(shape[:, :3], axis=1).max()
        if amplitude is not None and largest > 0:
            shape = shape * (amplitude / largest)
        data[f"mode_{k + 1:02d}_displacement"] = np.ascontiguousarray(shape[:, :3])
        data[f"mode_{k + 1:02d}_rotation"] = np.ascontiguousarray(shape[:, 3:])
    return data
