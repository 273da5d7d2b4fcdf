"""Matrices that other programs have stored: CalculiX and Ansys."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from flexura.arguments import verb
from flexura.arrays import Index
from flexura.errors import OptionError
from flexura.extras import need
from flexura.files import read_bytes, read_text
from flexura.modelfile import unit_factors
from flexura.solid.interchange.deck import read_deck
from flexura.solid.interchange.stored import SYMMETRIC, StoredMatrices

STORED = (".sti", ".mas", ".dof")


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
    found = _blocks(path)
    try:
        node = np.array(found["NODES"], dtype=np.intp)
        direction = np.array([found["DIRECTIONS"][0], *found["DIRECTIONS"][2::2]], dtype=np.intp)
        n = len(node)
        if not n or len(direction) != n or not np.isin(direction, range(1, 7)).all():
            raise ValueError(f"{n} nodes, {len(direction)} directions")
        made = []
        for name in ("STIFFNESS", "MASS"):
            A = np.zeros((n, n))
            if name in found or name == "STIFFNESS":
                A[np.tril_indices(n)] = np.array(found[name], dtype=float)
            made.append(symmetrised(sp.csc_matrix(A))[0])
    except (ValueError, IndexError, KeyError) as error:
        raise OptionError(f"{path} is no matrix of *SUBSTRUCTURE GENERATE: {error}") from None
    return made[0], made[1], node, direction - 1, 0.0


def _blocks(path: Path) -> dict[str, list[str]]:
    """Entries of the lines by what they are: NODES, DIRECTIONS and the types of matrices."""
    lines = read_text(path, encoding="latin-1").upper().splitlines()
    found: dict[str, list[str]] = {}
    inside = ""
    for line in map(str.strip, lines):
        if line.startswith("** ELEMENT NODES"):
            inside = "NODES"
        elif line.startswith("*") and not line.startswith("**"):
            inside = line.partition("TYPE=")[2] if line.startswith("*MATRIX") else ""
        elif inside:
            inside = "DIRECTIONS" if inside == "NODES" and not line.startswith("**") else inside
            found.setdefault(inside, []).extend(part.strip() for part in line.strip("*").split(",") if part.strip())
    return found


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
    sets = {name.upper(): np.asarray(own, dtype=np.intp) for name, own in archive.node_components.items()}
    labels, points = np.asarray(archive.nnum, dtype=np.intp), np.asarray(archive.nodes, dtype=float)[:, :3]
    return StoredMatrices(K, M, node, component, labels, points, sets, asymmetry=max(skew, skew_M)).scaled(*factors)
