"""CalculiX as a second solver: meshes written as input decks, matrices read back.

CalculiX (Dhondt and Wittig) is a program of its own, run in a temporary folder. Stiffness and the mass of C3D20 are
integrated as in `elastic_matrices` for affine cells. The mass of C3D10 is integrated at the 4 points of the stiffness
(found in the matrices that version 2.20 stores), which is not exact: frequencies differ by some 1e-4, less with finer
meshes. Numbers of at most 20 characters are read.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from flexura.errors import OptionError, SolverError
from flexura.files import complete_file, scratch_folder
from flexura.solid.interchange.readers import read_calculix
from flexura.solid.interchange.stored import StoredMatrices
from flexura.solid.mesh import SolidMesh

ELEMENTS = {"tetra10": "C3D10", "hexahedron20": "C3D20"}
"""CalculiX's names of the cells it has; their points come in the same order."""

PER_LINE = 8
"""Numbers per line of a list; at most 16 are read."""

INSTALL = "install CalculiX, on Debian and Ubuntu by `apt-get install calculix-ccx`"


def write_calculix(
    mesh: SolidMesh,
    path: str | Path,
    *,
    fixed: Sequence[str] = (),
    rigid: Mapping[str, ArrayLike] | None = None,
) -> Path:
    """Write a deck that asks for K and M; SI units.

    All points of the sets `fixed` are held; those of each set of `rigid` follow a reference point (3,), m, rigidly, of
    two further nodes for its translation and rotation. Raises OptionError for hexahedron27, for which CalculiX has no
    element, and for unknown sets.
    """
    lines = [*_mesh_lines(mesh), *_set_lines(mesh, fixed, rigid or {})]
    lines += ["*STEP", "*FREQUENCY,SOLVER=MATRIXSTORAGE", "6", "*END STEP", ""]
    with complete_file(path) as temporary:
        temporary.write_text("\n".join(lines))
    return Path(path)


def calculix_matrices(
    mesh: SolidMesh,
    *,
    fixed: Sequence[str] = (),
    rigid: Mapping[str, ArrayLike] | None = None,
    timeout: float = 600.0,
    program: str = "ccx",
) -> StoredMatrices:
    """K and M of a mesh by CalculiX, to some 14 digits; nodes are its points, from 1 on, then references of `rigid`.

    Arguments as in `write_calculix`. Raises OptionError when the program is not installed, and SolverError when it
    fails or takes longer than `timeout`.
    """
    with scratch_folder() as folder:
        deck = write_calculix(mesh, folder / "solid.inp", fixed=fixed, rigid=rigid)
        run_calculix(deck, timeout, program)
        stored = read_calculix(deck)
    sets = {name: points + 1 for name, points in mesh.point_sets.items()}
    return replace(stored, sets=sets)


def need_program(program: str = "ccx") -> None:
    """Raise OptionError when CalculiX is not installed."""
    if shutil.which(program) is None:
        raise OptionError(f"the program {program!r} was not found: {INSTALL}")


def run_calculix(deck: Path, timeout: float = 600.0, program: str = "ccx") -> str:
    """Run a deck in its own folder and return what the program says. Errors as in `calculix_matrices`."""
    need_program(program)
    try:
        done = subprocess.run(
            [program, "-i", deck.stem], cwd=deck.parent, capture_output=True, text=True, timeout=timeout, check=False
        )
    except subprocess.TimeoutExpired:
        raise SolverError(f"CalculiX took longer than {timeout:g} s: allow it more or take a coarser mesh") from None
    wrong = [line.strip() for line in done.stdout.splitlines() if "*ERROR" in line]
    if done.returncode != 0 or wrong or "Job finished" not in done.stdout:
        told = " ".join(wrong) or done.stderr.strip()[-300:] or f"it ended with code {done.returncode}"
        raise SolverError(f"CalculiX failed: {told}")
    return done.stdout


def _mesh_lines(mesh: SolidMesh) -> list[str]:
    """Nodes, elements and materials."""
    for kind in mesh.cells:
        if kind not in ELEMENTS:
            raise OptionError(f"CalculiX has no element for {kind} cells, only for {', '.join(ELEMENTS)}")
    lines = ["** nodes, elements and materials; m, kg, s", "*NODE"]
    lines += [f"{k},{x:.13e},{y:.13e},{z:.13e}" for k, (x, y, z) in enumerate(mesh.points.tolist(), 1)]
    first = 1
    used: set[int] = set()
    for kind, cells in mesh.cells.items():
        of_material = np.asarray(mesh.cell_materials[kind])
        for m in np.unique(of_material).tolist():
            chosen = cells[of_material == m] + 1
            lines.append(f"*ELEMENT,TYPE={ELEMENTS[kind]},ELSET=CELLS{m + 1}")
            for number, points in enumerate(chosen.tolist(), first):
                lines += _listed([number, *points])
            first += len(chosen)
            used.add(m)
    for m in sorted(used):
        own = mesh.materials[m]
        lines += [f"** {own.name}", f"*MATERIAL,NAME=MATERIAL{m + 1}", "*ELASTIC", f"{own.E:.13e},{own.nu:.13e}"]
        lines += ["*DENSITY", f"{own.rho:.13e}", f"*SOLID SECTION,ELSET=CELLS{m + 1},MATERIAL=MATERIAL{m + 1}"]
    return lines


def _set_lines(mesh: SolidMesh, fixed: Sequence[str], rigid: Mapping[str, ArrayLike]) -> list[str]:
    """Held sets and rigid bodies, whose reference nodes are numbered after the points."""
    for name in (*fixed, *rigid):
        if name not in mesh.point_sets or not len(mesh.point_sets[name]):
            raise OptionError(f"there is no set of points {name!r}; there are {', '.join(mesh.point_sets) or 'none'}")
    lines = []
    for k, name in enumerate(fixed, 1):
        lines += [f"** {name}", f"*NSET,NSET=HELD{k}", *_listed(mesh.point_sets[name] + 1)]
        lines += ["*BOUNDARY", f"HELD{k},1,3"]
    number = len(mesh.points)
    for k, (name, place) in enumerate(rigid.items(), 1):
        x, y, z = (float(value) for value in np.asarray(place, dtype=float))
        lines += ["*NODE", *(f"{number + j},{x:.13e},{y:.13e},{z:.13e}" for j in (1, 2))]
        lines += [f"** {name}", f"*NSET,NSET=RIGID{k}", *_listed(mesh.point_sets[name] + 1)]
        lines.append(f"*RIGID BODY,NSET=RIGID{k},REF NODE={number + 1},ROT NODE={number + 2}")
        number += 2
    return lines


def _listed(numbers: Iterable[int]) -> list[str]:
    """Lines of a list, each but the last ending in a comma."""
    texts = [str(k) for k in numbers]
    rows = [",".join(texts[k : k + PER_LINE]) for k in range(0, len(texts), PER_LINE)]
    return [*(row + "," for row in rows[:-1]), *rows[-1:]]
