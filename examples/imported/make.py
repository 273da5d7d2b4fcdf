"""Make the imported leaf: a deck, its matrices by CalculiX, and from these the superelement that guide.yaml uses.

    python examples/imported/make.py [FOLDER]

The leaf, 60 x 20 x 0.5 mm, stands along z, width along y, in mm, t, s, N, MPa, as most preprocessors have it. A deck
for matrices holds nothing, and asks for *FREQUENCY, SOLVER=MATRIXSTORAGE. With CalculiX (`ccx`) everything is made anew
in FOLDER; without it the superelement is, from the matrices that are there.
"""

from __future__ import annotations

import gzip
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

import flexura as fx

HERE = Path(__file__).parent
LENGTH, WIDTH, THICKNESS = 60.0, 20.0, 0.5  # mm
TICKS = (  # borders of cells along x, y, z, mm, closer where the ends hold the leaf flat
    (-THICKNESS / 2, THICKNESS / 2),
    (-WIDTH / 2, 0.0, WIDTH / 2),
    (0.0, 1.5, 5.0, 15.0, 30.0, 45.0, 55.0, 58.5, LENGTH),
)
E, NU, RHO = 206e3, 206.0 / (2 * 79.5) - 1, 7850e-12  # MPa, 1, t/mm^3: the spring steel of flexura
CORNERS = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2))
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
UNITS = {"length": "mm", "mass": "t", "time": "s"}


def deck() -> str:
    """Return the deck of the leaf.

    C3D20R, since fully integrated elements as thin as these make the guided motion 3.7 % too fast.
    """
    corners = np.array(CORNERS)
    local = np.vstack([corners, [(corners[a] + corners[b]) // 2 for a, b in EDGES]])
    first = np.meshgrid(*(2 * np.arange(len(ticks) - 1) for ticks in TICKS), indexing="ij")
    cells = np.stack(first, axis=-1).reshape(-1, 1, 3) + local
    grid, number = np.unique(cells.reshape(-1, 3), axis=0, return_inverse=True)
    places = [np.interp(grid[:, k], 2 * np.arange(len(ticks)), ticks) for k, ticks in enumerate(TICKS)]
    x = np.column_stack(places)
    lines = ["** leaf 60 x 20 x 0.5 mm; mm, t, s", "*NODE, NSET=ALL"]
    lines += [f"{k}, {a:.9g}, {b:.9g}, {c:.9g}" for k, (a, b, c) in enumerate(x.tolist(), 1)]
    lines.append("*ELEMENT, TYPE=C3D20R, ELSET=LEAF")
    for k, own in enumerate((number.reshape(-1, 20) + 1).tolist(), 1):
        lines += [", ".join(map(str, [k, *own[:10]])) + ",", ", ".join(map(str, own[10:]))]
    for name, z in (("FOOT", 0), ("HEAD", 2 * len(TICKS[2]) - 2)):
        lines += [f"*NSET, NSET={name}", *(f"{k}," for k in (np.flatnonzero(grid[:, 2] == z) + 1).tolist())]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{E:.9g}, {NU:.9g}", "*DENSITY", f"{RHO:.9g}"]
    lines += [
        "*SOLID SECTION, ELSET=LEAF, MATERIAL=STEEL",
        "*STEP",
        "*FREQUENCY, SOLVER=MATRIXSTORAGE",
        "6",
        "*END STEP",
    ]
    return "\n".join(lines) + "\n"


def run(folder: Path) -> None:
    """Write the deck, run CalculiX and keep its matrices, packed."""
    (folder / "leaf.inp").write_text(deck())
    subprocess.run(["ccx", "-i", "leaf"], cwd=folder, check=True, capture_output=True)
    for suffix in (".sti", ".mas"):
        file = folder / f"leaf{suffix}"
        with file.open("rb") as source, gzip.GzipFile(f"{file}.gz", "wb", mtime=0) as packed:
            shutil.copyfileobj(source, packed)
        file.unlink()
    for file in folder.glob("leaf.*"):
        if file.suffix not in (".inp", ".gz", ".dof"):
            file.unlink()


def leaf(folder: Path = HERE) -> fx.solid.ImportedPart:
    """Return the leaf of a folder as a superelement over the middles of its ends."""
    stored = fx.solid.read_calculix(folder / "leaf.inp", units=UNITS)
    return fx.solid.imported(stored, {"foot": "FOOT", "head": "HEAD"}, keep=2)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    if shutil.which("ccx"):
        run(target)
    part = leaf(target)
    part.write(target / "leaf.mtx")
    print(part.evidence)
