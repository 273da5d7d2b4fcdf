"""The mesh of a full-order model as points and lines, and VTK files of it with mode shapes, for ParaView."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexura.analysis import Modes
from flexura.arrays import Array, Index
from flexura.errors import OptionError, need
from flexura.files import complete_files
from flexura.structure import FullOrderModel

KINDS = ("link", "flexure", "body", "spring", "superelement")


@dataclass(frozen=True)
class Lines:
    """Points (n, 3), m, which are the nodes with a place; lines (e, 2) between them, each with the number of its part.

    `node` (n,) are the numbers of the points among all nodes of the model. `names` and `kinds` are those of the parts:
    a member is a chain of lines, a body a star of them from its centre to the nodes that it carries.
    """

    points: Array
    node: Index
    lines: Index
    part: Index
    names: list[str]
    kinds: list[str]


def lines_of(model: FullOrderModel) -> Lines:
    """Points and lines of a full-order model; arms from members' ends to nodes that stand apart are not drawn."""
    topology = model.plan.topology
    node = np.flatnonzero(topology.has_position)
    point = np.cumsum(topology.has_position) - 1
    placed_lines: list[tuple[str, str, Index]] = []
    for name, placed in topology.copies.items():
        part = model.plan.parts[name]
        flexures = set(model.plan.layout.prototypes[name].flexures)
        part_lines = [
            (m, "flexure" if m in flexures else "link", part.connectivity[part.first[k] : part.first[k + 1]])
            for k, m in enumerate(part.members)
        ]
        part_lines += [(b, "body", _star(n, part.carried.get(n, []))) for b, (n, _) in part.bodies.items()]
        part_lines += [(key, "flexure", np.array([d.nodes])) for key, d in part.diaphragms.items()]
        part_lines += [(key, "spring", _star(s.nodes[0], s.nodes[1:])) for key, s in part.springs.items()]
        part_lines += [
            (s, "superelement", _star(n[0], [k for k in n[1:] if k < part.n_positioned]))
            for s, n in ((s, own.nodes) for s, own in part.superelements.items())
        ]
        for path, offset in zip(placed.paths, placed.offset, strict=True):
            placed_lines += [
                (".".join((*path, key)), kind, point[offset + ends]) for key, kind, ends in part_lines if len(ends)
            ]
    part_of = np.repeat(np.arange(len(placed_lines)), [len(ends) for _, _, ends in placed_lines])
    ends = np.concatenate([ends for _, _, ends in placed_lines]) if placed_lines else np.empty((0, 2), dtype=np.intp)
    names, kinds = [name for name, _, _ in placed_lines], [kind for _, kind, _ in placed_lines]
    return Lines(model.positions[node], node, ends, part_of, names, kinds)


def _star(centre: int, others: list[int]) -> Index:
    return np.array([(centre, k) for k in others if k != centre], dtype=np.intp).reshape(-1, 2)


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
        written = meshio.Mesh(mesh.points, blocks, data, cells if len(mesh.lines) else None)
        meshio.write(scratch / path.name, written, file_format="vtu")
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
