"""Meshes of solids for tests, made of a grid of hexahedra or by netgen, and files of them."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flexura.fem.solid_mesh import EDGES

SPLITS = {
    "hexahedron": ((0, 1, 2, 3, 4, 5, 6, 7),),
    "wedge": ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)),
    "tetra": ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)),
    "pyramid": ((0, 3, 2, 1, 8), (4, 5, 6, 7, 8), (0, 1, 5, 4, 8), (1, 2, 6, 5, 8), (2, 3, 7, 6, 8), (3, 0, 4, 7, 8)),
}
"""Cells by the corners of a hexahedron and its middle, the apex upwards from the base."""

NETGEN_TETRA10 = (0, 2, 1, 3, 5, 7, 4, 6, 9, 8)
"""Places in netgen's tetrahedra of the points of VTK's."""


class Made(NamedTuple):
    """Points (n, 3), mm, and cells of one shape."""

    points: np.ndarray
    cells: np.ndarray

    def on(self, axis: int, at: float) -> np.ndarray:
        """Points in a plane."""
        return np.flatnonzero(np.abs(self.points[:, axis] - at) < 1e-6)


def grid(
    shape: str,
    size: Sequence[float],
    counts: Sequence[int],
    place: Callable[[np.ndarray], np.ndarray] = lambda x: x,
    quadratic: bool = True,
) -> Made:
    """A block of hexahedra, each split into cells of a shape, with its points moved to their places."""
    axes = [np.linspace(0, length, n + 1) for length, n in zip(size, counts, strict=True)]
    X = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    nx, ny, nz = counts
    i, j, k = (a.ravel() for a in np.meshgrid(range(nx), range(ny), range(nz), indexing="ij"))

    def number(di: int, dj: int, dk: int) -> np.ndarray:
        return ((i + di) * (ny + 1) + j + dj) * (nz + 1) + k + dk

    ring = ((0, 0), (1, 0), (1, 1), (0, 1))
    eight = np.stack([number(*own, dk) for dk in (0, 1) for own in ring], axis=1)
    if shape == "pyramid":
        X = np.vstack([X, X[eight].mean(axis=1)])
        eight = np.column_stack([eight, len(X) - len(eight) + np.arange(len(eight))])
    cells = eight[:, np.array(SPLITS[shape])].reshape(-1, len(SPLITS[shape][0]))
    if not quadratic:
        return Made(place(X), cells)
    edges = np.sort(cells[:, np.array(EDGES[shape])], axis=-1)
    ends, middle = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    cells = np.column_stack([cells, len(X) + middle.reshape(edges.shape[:2])])
    return Made(place(np.vstack([X, X[ends].mean(axis=1)])), cells)


def by_netgen(shape: Any, size: float, curvature: float = 3.0) -> Made:
    """Quadratic tetrahedra of a shape of OpenCASCADE, with points in the middle of curved edges on its faces."""
    from netgen import occ

    mesh = occ.OCCGeometry(shape).GenerateMesh(maxh=size, curvaturesafety=curvature)
    mesh.SecondOrder()
    nodes = mesh.Elements3D().NumPy()["nodes"][:, :10].astype(int) - 1
    return Made(np.array([list(p) for p in mesh.Points()]), nodes[:, NETGEN_TETRA10])


TYPES = {4: "C3D4", 5: "C3D5", 6: "C3D6", 8: "C3D8", 10: "C3D10", 13: "C3D13", 15: "C3D15", 20: "C3D20"}


def deck(
    path: Path,
    made: Made,
    sets: Mapping[str, np.ndarray] | None = None,
    elsets: Mapping[str, np.ndarray] | None = None,
    more: str = "",
) -> Path:
    """A deck of Abaqus and CalculiX, with sets of points and cells, by position, and further lines."""
    kind = TYPES[made.cells.shape[1]]
    lines = ["*NODE", *(f"{k},{x!r},{y!r},{z!r}" for k, (x, y, z) in enumerate(made.points.tolist(), 1))]
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET=ALL")
    for k, row in enumerate((made.cells + 1).tolist(), 1):
        texts = [str(n) for n in (k, *row)]
        lines += [",".join(texts[:16]) + ","] * (len(texts) > 16) + [",".join(texts[16:] if len(texts) > 16 else texts)]
    for word, members in (("NSET", sets), ("ELSET", elsets)):
        for name, own in (members or {}).items():
            lines += [f"*{word}, {word}={name}", *(f"{n}," for n in (own + 1).tolist())]
    path.write_text("\n".join([*lines, more, ""]))
    return path


def calculated(E: float, nu: float, rho: float) -> str:
    """What follows in a deck, mm, for six frequencies with the points of LEFT held; SI."""
    lines = ["*MATERIAL,NAME=METAL", "*ELASTIC", f"{E / 1e6!r},{nu!r}", "*DENSITY", f"{rho * 1e-12!r}"]
    lines += [
        "*SOLID SECTION,ELSET=ALL,MATERIAL=METAL",
        "*BOUNDARY",
        "LEFT,1,3",
        "*STEP",
        "*FREQUENCY",
        "6",
        "*END STEP",
    ]
    return "\n".join(lines)


NASTRAN = {
    4: ("CTETRA", range(4)),
    10: ("CTETRA", range(10)),
    5: ("CPYRAM", range(5)),
    13: ("CPYRAM", range(13)),
    6: ("CPENTA", range(6)),
    15: ("CPENTA", (*range(9), 12, 13, 14, 9, 10, 11)),
    8: ("CHEXA", range(8)),
    20: ("CHEXA", (*range(12), 16, 17, 18, 19, 12, 13, 14, 15)),
}
"""Nastran's elements by number of points, with the places of theirs among VTK's (MSC Nastran Quick Reference Guide)."""


def bulk(path: Path, made: Made, form: str = "large") -> Path:
    """Bulk data of Nastran in the small, large or free format."""
    card, order = NASTRAN[made.cells.shape[1]]
    lines = ["SOL 103", "CEND", "BEGIN BULK"]
    for k, point in enumerate(made.points.tolist(), 1):
        if form == "free":
            lines.append(f"GRID,{k},," + ",".join(repr(x) for x in point))
        elif form == "large":
            x, y, z = (f"{x:16.9E}" for x in point)
            lines += [f"GRID*   {k:<16d}{'':16s}{x}{y}", f"*       {z}"]
        else:
            lines.append(f"GRID    {k:<8d}{'':8s}" + "".join(f"{x:8.5f}"[:8] for x in point))
    for k, row in enumerate((made.cells[:, list(order)] + 1).tolist(), 1):
        texts = [str(n) for n in (k, 7, *row)]
        if form == "free":
            pieces = [",".join(texts[n : n + 8]) for n in range(0, len(texts), 8)]
            lines += [f"{card if n == 0 else ''},{own}" for n, own in enumerate(pieces)]
        else:
            pieces = ["".join(f"{text:<8s}" for text in texts[n : n + 8]).rstrip() for n in range(0, len(texts), 8)]
            lines += [f"{card if n == 0 else '':<8s}{own}" for n, own in enumerate(pieces)]
    path.write_text("\n".join([*lines, "PSOLID,7,1", "ENDDATA", ""]))
    return path
