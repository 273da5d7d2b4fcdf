"""Solids from other programs as superelements: faces tied to nodes, then Craig and Bampton (1968)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.files import complete_files
from flexura.mechanism import Faces, Matrix, Substructure, Superelement
from flexura.results import Result
from flexura.solid.fem import KINDS, Face, balanced, constraint_modes, face_ties
from flexura.solid.interchange.stored import MatrixEvidence, StoredMatrices
from flexura.solid.mesh import SolidMesh
from flexura.tables import Facts, Table, in_mm, quantity

PART = "part"
"""Name of the superelement in the substructure that is made of an imported solid."""

SPREAD = 1e-6
"""Least singular value of a face's rigid motions over the largest, below which it has no rotation of its own."""

TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, repr=False)
class ImportedPart(Result):
    """A solid of another program as a superelement in the axes of its own deck.

    `places` are those of the nodes, m, by name; `order` the number of rows of its matrices before reduction.
    """

    superelement: Superelement
    places: Mapping[str, tuple[float, float, float]]
    evidence: MatrixEvidence
    order: int

    _shown = ("places", "order", "evidence")

    def _view(self) -> Iterator[Facts | Table]:
        mass = float(np.max(self.evidence.mass))
        facts = {"mass": quantity(mass, "kg"), "order": self.order, "amplitudes": self.superelement.amplitudes}
        yield Facts({**facts, "rigid motions strain it": f"{np.max(self.evidence.strain):.1g}"})
        yield Table({"node": list(self.places), "at [mm]": [in_mm(x) for x in self.places.values()]}, "nodes")

    def _data(self) -> dict[str, Any]:
        own = self.superelement
        matrices = {"amplitudes": own.amplitudes, "stiffness": own.stiffness.array, "mass": own.mass.array}
        return {"order": self.order, "places": self.places, "evidence": self.evidence, **matrices}

    @property
    def substructure(self) -> Substructure:
        """The nodes where they are in the deck, with the superelement `part` between them, to be placed."""
        return Substructure(
            nodes=dict(self.places), superelements={PART: self.superelement}, interface=tuple(self.places)
        )

    def write(self, path: str | Path) -> list[Path]:
        """Write K and M for `stiffness: {file: NAME_K.mtx}` and `mass: {file: NAME_M.mtx}` of mechanism files.

        `path` is NAME.mtx, or NAME. Matrix Market, SI, all digits. Returns both paths. Raises OptionError when they
        cannot be written.
        """
        from scipy.io import mmwrite

        path = Path(path)
        name = path.stem if path.suffix == ".mtx" else path.name
        own = {"K": self.superelement.stiffness.array, "M": self.superelement.mass.array}
        comment = f"nodes {', '.join(self.superelement.nodes)}, amplitudes {self.superelement.amplitudes}, SI"
        with complete_files(path.parent) as scratch:
            for letter, A in own.items():
                with (scratch / f"{name}_{letter}.mtx").open("wb") as stream:
                    mmwrite(stream, A, f"{letter}: {comment}", symmetry="symmetric", precision=17)
        return [path.with_name(f"{name}_{letter}.mtx") for letter in own]


@verb
def imported(
    stored: StoredMatrices,
    nodes: Mapping[str, str | Sequence[int]],
    *,
    at: Mapping[str, ArrayLike] | None = None,
    faces: Faces = "rigid",
    keep: int = 2,
    mass: float | None = None,
    loss_factor: float | None = None,
) -> ImportedPart:
    """A solid of another program reduced to nodes and amplitudes of its `keep` lowest modes with these held.

    `nodes` gives the points of each node's face, as a set of the deck or numbers of nodes; `at` its place, (3,), m,
    where that is not midway between the outermost of them. `faces` follow their nodes as those of solid members do
    (theory eqs. B2-B4); means count all points alike where the matrices come without cells. A single point with
    rotations, such as a reference node, is a face as well. `mass`, kg, is compared with that of the matrices.

    Raises OptionError for unknown sets, faces that share points, have no rotation or lack rows, and for matrices that
    are not those of a free solid with such nodes in such units (`StoredMatrices.proven`); SolverError as `factorise`.
    """
    if faces not in KINDS:
        raise OptionError(f"faces = {faces!r}: {', '.join(KINDS)}")
    if not isinstance(keep, int) or keep < 0:
        raise OptionError(f"keep = {keep!r}: a whole number, zero or more")
    if not nodes or set(at or {}) - set(nodes):
        raise OptionError(
            f"`nodes` names at least one node, and `at` some of these; found {', '.join(at or {}) or 'none'}"
        )
    evidence = stored.proven(mass)
    rows = {name: _rows(stored, name, given) for name, given in nodes.items()}
    _apart(stored, rows)
    places = {name: _place(stored, own, (at or {}).get(name)) for name, own in rows.items()}
    T, boundary = _ties(stored, rows, places, faces)
    tied_K, tied_M = (sp.csc_matrix(T.T @ A @ T) for A in (stored.K, stored.M))
    K, M = _reduced(tied_K, tied_M, boundary, keep)
    superelement = Superelement(
        nodes=tuple(nodes),
        amplitudes=len(K) - 6 * len(nodes),
        stiffness=Matrix(balanced(K, np.array(list(places.values())))),
        mass=Matrix(M),
        loss_factor=loss_factor,
    )
    return ImportedPart(superelement, {k: tuple(x.tolist()) for k, x in places.items()}, evidence, len(stored.node))


def _rows(stored: StoredMatrices, name: str, given: str | Sequence[int]) -> Index:
    """Table of the matrices that belong to the face of a node."""
    if isinstance(given, str):
        of_case = {key.upper(): own for key, own in stored.sets.items()}
        if given.upper() not in of_case:
            there = ", ".join(stored.sets) or "none"
            raise OptionError(f"node {name}: there is no set of nodes {given!r}; there are {there}")
        labels = of_case[given.upper()]
    else:
        labels = np.unique(np.asarray(given, dtype=np.intp))
    missing = np.setdiff1d(labels, stored.node)
    if len(missing) or not len(labels):
        rule = f"{len(missing)} of the {len(labels)} points have no rows in the matrices"
        which = f", such as number {missing[0]}: it is held, or follows others" if len(missing) else ""
        raise OptionError(f"node {name}: {rule}{which}")
    return np.flatnonzero(np.isin(stored.node, labels))


def _apart(stored: StoredMatrices, rows: Mapping[str, Index]) -> None:
    owner: dict[int, str] = {}
    for name, own in rows.items():
        for label in np.unique(stored.node[own]).tolist():
            if label in owner:
                raise OptionError(f"nodes {owner[label]} and {name} share point {label}: a point follows one node")
            owner[label] = name


def _place(stored: StoredMatrices, rows: Index, given: ArrayLike | None) -> Array:
    if given is None:
        x = stored.places(stored.node[rows])
        return (x.min(axis=0) + x.max(axis=0)) / 2
    place = np.asarray(given, dtype=float)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise OptionError(f"a place is three numbers, m; found {given!r}")
    return place


def _ties(
    stored: StoredMatrices, rows: Mapping[str, Index], places: Mapping[str, Array], kind: Faces
) -> tuple[sp.csc_matrix, Index]:
    """T (n, m) of u = T q, and numbers in q of the displacements of nodes and the amplitudes of their faces."""
    mesh = SolidMesh(stored.points, dict(stored.cells), {}, ())
    faces = []
    for k, (name, own) in enumerate(rows.items()):
        G = stored.rigid(places[name], own)
        s = np.linalg.svd(G / np.repeat([1.0, max(float(abs(G[:, 3:]).max()), TINY)], 3), compute_uv=False)
        if len(own) < 6 or s[-1] < SPREAD * s[0]:
            raise OptionError(
                f"node {name}: its {len(own)} rows have no rotation of their own; take the points of a face"
            )
        points = np.unique(stored.positions(stored.node[own]))
        faces.append(Face(points, places[name], k, "rigid" if len(points) == 1 else kind))
    ties = face_ties(mesh, faces)
    at = stored.positions(stored.node)
    moves = np.flatnonzero(stored.component < 3)
    turns = np.flatnonzero(stored.component >= 3)
    n = len(at)
    follow = sp.csr_matrix(
        (np.ones(len(moves)), (moves, 3 * at[moves] + stored.component[moves])), shape=(n, mesh.order)
    )
    node = np.full(len(mesh.points), -1)
    for face in faces:
        node[face.points] = face.node
    tied = turns[node[at[turns]] >= 0]
    column = len(ties.free) + 6 * node[at[tied]] + stored.component[tied]
    of_nodes = sp.csr_matrix((np.ones(len(tied)), (tied, column)), shape=(n, ties.T.shape[1]))
    loose = np.setdiff1d(turns, tied)
    own = sp.csr_matrix((np.ones(len(loose)), (loose, np.arange(len(loose)))), shape=(n, len(loose)))
    inside = sp.csc_matrix(follow @ ties.T + of_nodes)
    used = np.flatnonzero(np.diff(inside[:, : len(ties.free)].tocsc().indptr))
    T = sp.csc_matrix(sp.hstack([own, inside[:, used], inside[:, ties.boundary]]))
    return T, np.arange(T.shape[1] - len(ties.boundary), T.shape[1])


def _reduced(K: sp.csc_matrix, M: sp.csc_matrix, boundary: Index, modes: int) -> tuple[Array, Array]:
    """K and M over the boundary and fixed-interface modes (theory eq. B5), none where the inside has no mass."""
    inside = K.shape[0] - len(boundary)
    if not inside:
        return K.toarray(), M.toarray()
    count = min(modes, inside - 1) if M[:inside, :inside].nnz else 0
    found = constraint_modes(K, M, boundary, count)
    return found.K, found.M
