"""CalculiX as a second solver: meshes written as input decks, decks and matrices read back; and matrices of Ansys.

CalculiX (Dhondt and Wittig) is a program of its own, run in a temporary folder. Stiffness and the mass of C3D20 are
integrated as in `elastic_matrices` for affine cells. The mass of C3D10 is integrated at the 4 points of the stiffness
(found in the matrices that version 2.20 stores), which is not exact: frequencies differ by some 1e-4, less with finer
meshes. Numbers of at most 20 characters are read. Decks are those of Abaqus as well.
"""

from __future__ import annotations

import io
import shutil
import subprocess
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError, SolverError, need
from flexura.fem import Card, SolidMaterial, SolidMesh, deck_cards, deck_nodes, deck_sets, mesh_mass
from flexura.files import complete_file, read_bytes, read_text, scratch_folder
from flexura.modelfile import unit_factors
from flexura.solid.interchange.imported import SYMMETRIC, StoredMatrices

ELEMENTS = {"tetra10": "C3D10", "hexahedron20": "C3D20"}
"""CalculiX's names of the cells it has; their points come in the same order."""

READ_AS = {"C3D10": "tetra10", "C3D20": "hexahedron20", "C3D20R": "hexahedron20"}
"""Elements that are read as cells."""

PER_LINE = 8
"""Numbers per line of a list; at most 16 are read."""

INSTALL = "install CalculiX, on Debian and Ubuntu by `apt-get install calculix-ccx`"

STORED = (".sti", ".mas", ".dof")


@dataclass(frozen=True)
class Deck:
    """Numbers (p,) and places (p, 3) of nodes, numbers of nodes by set, and mass, in the units of the deck.

    `cells` are the points of elements by position, as in a `SolidMesh`; `mass` is density times volume, None where
    there are elements of other kinds or without density. `rotations` are nodes whose translations stand for the
    rotation of another, by number: ROT NODE and REF NODE of a *RIGID BODY.
    """

    labels: Index
    points: Array
    sets: dict[str, Index]
    cells: dict[str, Index]
    mass: float | None
    rotations: dict[int, int]


def read_deck(path: str | Path) -> Deck:
    """Read a deck, with the decks it includes; whatever else is in it is passed over.

    Names of sets are in capitals, as CalculiX has them. Raises OptionError for files that cannot be read, decks without
    nodes, and those with parts and instances, which number nodes anew.
    """
    path = Path(path)
    try:
        return _deck(deck_cards(path))
    except (ValueError, IndexError, KeyError) as error:
        raise OptionError(f"{path} is no input deck that can be read: {error}") from None


def _deck(cards: list[Card]) -> Deck:
    labels, points = deck_nodes(cards)
    cells, densities = _cells(cards, labels)
    mass = None
    if cells and all(card.kind in READ_AS for card in cards if card.name == "*ELEMENT"):
        values = np.unique(np.concatenate(list(densities.values())))
        if np.isfinite(values).all():
            materials = tuple(SolidMaterial("", 1.0, 0.0, rho) for rho in values.tolist())
            of_cells = {kind: np.searchsorted(values, density) for kind, density in densities.items()}
            mass = mesh_mass(SolidMesh(points, cells, of_cells, materials)).mass
    bodies = [card.options for card in cards if card.name == "*RIGIDBODY" and "ROTNODE" in card.options]
    rotations = {int(body["ROTNODE"]): int(body["REFNODE"]) for body in bodies}
    return Deck(labels, points, deck_sets(cards, "NSET"), cells, mass, rotations)


def _cells(cards: list[Card], labels: Index) -> tuple[dict[str, Index], dict[str, Array]]:
    """Points of elements of known shape, by position, and their densities, nan where there is none, by kind of cell."""
    density: dict[str, float] = {}
    material = ""
    for card in cards:
        if card.name == "*MATERIAL":
            material = card.options["NAME"].upper()
        elif card.name == "*DENSITY":
            density[material] = float(card.numbers()[0])
    members = deck_sets(cards, "ELSET")
    tables_of: dict[str, list[Index]] = defaultdict(list)
    for card in cards:
        if card.name == "*ELEMENT" and card.kind in READ_AS and card.lines:
            tables_of[READ_AS[card.kind]].append(np.array(card.numbers(), dtype=np.intp).reshape(-1, 1 + card.points))
    cells, densities = {}, {}
    for kind, tables in tables_of.items():
        table = np.concatenate(tables)
        if not np.isin(table[:, 1:], labels).all():
            raise ValueError("an element has a node that is not defined")
        cells[kind] = np.searchsorted(labels, table[:, 1:])
        densities[kind] = np.full(len(table), np.nan)
        for card in cards:
            if card.name == "*SOLIDSECTION":
                inside = np.isin(table[:, 0], members.get(card.options["ELSET"].upper(), []))
                densities[kind][inside] = density.get(card.options["MATERIAL"].upper(), np.nan)
    return cells, densities


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
        message = " ".join(wrong) or done.stderr.strip()[-300:] or f"it ended with code {done.returncode}"
        raise SolverError(f"CalculiX failed: {message}")
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
        material = mesh.materials[m]
        lines += [f"** {material.name}", f"*MATERIAL,NAME=MATERIAL{m + 1}"]
        lines += ["*ELASTIC", f"{material.E:.13e},{material.nu:.13e}"]
        lines += ["*DENSITY", f"{material.rho:.13e}", f"*SOLID SECTION,ELSET=CELLS{m + 1},MATERIAL=MATERIAL{m + 1}"]
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


@verb
def read_calculix(
    path: str | Path, deck: str | Path | None = None, *, units: Mapping[str, str] | None = None
) -> StoredMatrices:
    """K, M, nodes and sets of a solid that CalculiX has put together.

    `path` is the deck JOB.inp or JOB, beside which `*FREQUENCY, SOLVER=MATRIXSTORAGE` has written JOB.sti, JOB.mas and
    JOB.dof, packed (.gz) or not; or NAME.mtx of `*SUBSTRUCTURE GENERATE`, whose `deck` is to be named. `units` are
    those of the deck, such as `{"length": "mm", "mass": "t", "time": "s"}`; by default SI. The rotation of a
    *RIGID BODY with REF NODE and ROT NODE is that of its reference node. Raises OptionError for files that are missing,
    cannot be read or do not fit together.
    """
    path = Path(path)
    factors = unit_factors(units)
    if path.suffix == ".mtx":
        if deck is None:
            raise OptionError(f"{path}: name the deck with the places of the nodes, deck=...")
        K, M, node, component, skew = _substructure(path)
    else:
        stem = path.with_suffix("") if path.suffix == ".inp" else path
        deck = stem.with_name(stem.name + ".inp") if deck is None else deck
        K, M, node, component, skew = _matrix_storage(stem)
    nodes = read_deck(deck)
    for rotation, reference in nodes.rotations.items():
        component = np.where(node == rotation, component + 3, component)
        node = np.where(node == rotation, reference, node)
    stored = StoredMatrices(
        K, M, node, component, nodes.labels, nodes.points, nodes.sets, nodes.cells, nodes.mass, skew
    )
    return stored.scaled(*factors)


def _matrix_storage(stem: Path) -> tuple[sp.csc_matrix, sp.csc_matrix, Index, Index, float]:
    """K, M, node and component of every row, and asymmetry.

    The first two files hold lines `row column value`, of one triangle or both, the third NODE.DIRECTION for every row.
    """
    paths = [stem.with_name(stem.name + suffix) for suffix in STORED]
    packed = [path.with_name(path.name + ".gz") for path in paths]
    paths = [gz if gz.is_file() and not path.exists() else path for path, gz in zip(paths, packed, strict=True)]
    for path in paths:
        if not path.is_file() or not path.stat().st_size:
            raise OptionError(f"{path} is missing or empty: it is written by *FREQUENCY, SOLVER=MATRIXSTORAGE")
    try:
        dofs = np.array([line.split(".") for line in read_text(paths[2]).split()], dtype=np.intp).reshape(-1, 2)
        (K, skew), (M, skew_M) = (_symmetric_matrix(path, len(dofs)) for path in paths[:2])
    except (ValueError, IndexError, OSError, EOFError) as error:
        raise OptionError(f"{stem}{', '.join(STORED)} do not fit together: {error}") from None
    if not len(dofs) or dofs[:, 0].min() < 1 or not np.isin(dofs[:, 1], (1, 2, 3)).all():
        raise OptionError(f"{paths[2]} holds lines other than NODE.DIRECTION with directions 1, 2, 3")
    return K, M, dofs[:, 0], dofs[:, 1] - 1, max(skew, skew_M)


def _symmetric_matrix(path: Path, n: int) -> tuple[sp.csc_matrix, float]:
    """The matrix of lines `row column value` and its relative asymmetry; a single triangle is mirrored."""
    table = np.loadtxt(io.BytesIO(read_bytes(path)), ndmin=2)
    if table.shape[1] != 3:
        raise ValueError(f"{path.name} has {table.shape[1]} numbers per line instead of 3")
    row, column = (table[:, k].astype(np.intp) - 1 for k in (0, 1))
    if len(row) and (min(row.min(), column.min()) < 0 or max(row.max(), column.max()) >= n):
        raise ValueError(f"an entry lies outside {n} rows and columns")
    return symmetrised(sp.csc_matrix((table[:, 2], (row, column)), shape=(n, n)))


def symmetrised(A: sp.csc_matrix) -> tuple[sp.csc_matrix, float]:
    """A matrix of which both triangles or one are given, and its relative asymmetry; ValueError for others."""
    below, above = sp.tril(A, -1), sp.triu(A, 1)
    if below.nnz and above.nnz:
        skew = float(abs(A - A.T).max() / abs(A).max())
        if skew > SYMMETRIC:
            raise ValueError(f"a matrix differs from its transpose by {skew:.1e} of its largest entry")
        return sp.csc_matrix((A + A.T) / 2), skew
    return sp.csc_matrix(A + A.T - sp.diags_array(A.diagonal())), 0.0


def _substructure(path: Path) -> tuple[sp.csc_matrix, sp.csc_matrix, Index, Index, float]:
    """K and M, without entries where it is not there, of a *USER ELEMENT, and node and component of every row.

    The node of every row stands in comments below `ELEMENT NODES`, directions in lines `row, direction` below
    *USER ELEMENT, and lower triangles, row by row, below *MATRIX.
    """
    blocks = _blocks(path)
    try:
        node = np.array(blocks["NODES"], dtype=np.intp)
        direction = np.array([blocks["DIRECTIONS"][0], *blocks["DIRECTIONS"][2::2]], dtype=np.intp)
        n = len(node)
        if not n or len(direction) != n or not np.isin(direction, range(1, 7)).all():
            raise ValueError(f"{n} nodes, {len(direction)} directions")
        made = []
        for name in ("STIFFNESS", "MASS"):
            A = np.zeros((n, n))
            if name in blocks or name == "STIFFNESS":
                A[np.tril_indices(n)] = np.array(blocks[name], dtype=float)
            made.append(symmetrised(sp.csc_matrix(A))[0])
    except (ValueError, IndexError, KeyError) as error:
        raise OptionError(f"{path} is no matrix of *SUBSTRUCTURE GENERATE: {error}") from None
    return made[0], made[1], node, direction - 1, 0.0


def _blocks(path: Path) -> dict[str, list[str]]:
    """Entries of the lines by what they are: NODES, DIRECTIONS and the types of matrices."""
    lines = read_text(path, encoding="latin-1").upper().splitlines()
    blocks: dict[str, list[str]] = {}
    inside = ""
    for line in map(str.strip, lines):
        if line.startswith("** ELEMENT NODES"):
            inside = "NODES"
        elif line.startswith("*") and not line.startswith("**"):
            inside = line.partition("TYPE=")[2] if line.startswith("*MATRIX") else ""
        elif inside:
            inside = "DIRECTIONS" if inside == "NODES" and not line.startswith("**") else inside
            blocks.setdefault(inside, []).extend(part.strip() for part in line.strip("*").split(",") if part.strip())
    return blocks


@verb
def read_ansys(path: str | Path, nodes: str | Path, *, units: Mapping[str, str] | None = None) -> StoredMatrices:
    """K, M, nodes and sets of a solid from an Ansys file JOB.full, whose `nodes` are in an archive JOB.cdb.

    Names of sets are those of node components. Held DOFs have no rows. `units` as in `read_calculix`. Distributed files
    are combined in Ansys first (COMBINE, FULL). Raises OptionError when the package ansys-mapdl-reader is missing, and
    for files that are missing, cannot be read, or hold unsymmetric or lumped matrices.
    """
    reader = need("ansys.mapdl.reader", "ansys")
    factors = unit_factors(units)
    for file in (path, nodes):
        if not Path(file).is_file():
            raise OptionError(f"{file} is missing")
    try:
        archive = reader.Archive(str(nodes), parse_vtk=False)
        full = reader.read_binary(str(path))
        dofs, K, M = full.load_km(sort=False)
        held = {tuple(dof) for dof in full.const.tolist()}
    except Exception as error:  # whatever the package raises
        raise OptionError(f"{path} and {nodes} cannot be read: {' '.join(str(error).split())[:200]}") from None
    try:
        (K, skew), (M, skew_M) = symmetrised(sp.csc_matrix(K)), symmetrised(sp.csc_matrix(M))
    except ValueError as error:
        raise OptionError(f"{path}: {error}") from None
    free = np.flatnonzero([tuple(dof) not in held for dof in dofs.tolist()])
    K, M = (sp.csc_matrix(A[free][:, free]) for A in (K, M))
    node, component = (dofs[free, k].astype(np.intp) for k in (0, 1))
    sets = {name.upper(): np.asarray(labels, dtype=np.intp) for name, labels in archive.node_components.items()}
    labels, points = np.asarray(archive.nnum, dtype=np.intp), np.asarray(archive.nodes, dtype=float)[:, :3]
    return StoredMatrices(K, M, node, component, labels, points, sets, asymmetry=max(skew, skew_M)).scaled(*factors)
