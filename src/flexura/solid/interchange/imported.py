"""Matrices of solids from other programs, the proof that their rows are the DOFs given for them, and superelements.

Faces are tied to nodes, then follows the reduction of Craig and Bampton (1968).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.fem import KINDS, Face, SolidMesh, balanced, constraint_modes, face_ties, rigid_motions
from flexura.files import complete_files
from flexura.mechanism import Faces, Matrix, Substructure, Superelement
from flexura.results import Result
from flexura.tables import Facts, Item, Table, in_mm, quantity

STRAINLESS = 2e-5
"""Largest |K r| over |K| |r| of a rigid motion r: coordinates of six digits make some 1e-6, a wrong row 1e-3."""

CARRIED = 1e-5
"""Largest departure of the mass that rigid motions carry from that of a rigid body."""

SYMMETRIC = 1e-9
"""Largest difference of a matrix from its transpose over its largest entry."""

MASS_AGREES = 1e-2
"""Relative difference of masses that curved cells and drawings may have; a wrong unit makes at least 10."""

WAVE_SPEEDS = (200.0, 20e3)
"""Speeds of pressure waves, m/s, beyond those of solids: rubber 1500, metals 3000 to 7000, diamond 18 000."""

DENSEST = 23e3
"""Density of osmium, the densest solid, rounded up, kg/m^3."""

UNITS = 'say the units, such as {"length": "mm", "mass": "t", "time": "s"} for N, mm and MPa'
DIRECTIONS = "xyz"


MOST_NAMED = 6
"""Sets that a notebook names."""

PART = "part"
"""Name of the superelement in the substructure that is made of an imported solid."""

NO_ROTATION = 1e-6
"""Least singular value of a face's rigid motions over the largest, below which it has no rotation of its own."""

TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class MatrixEvidence:
    """What rigid motions and uniform stretches say about matrices and the numbers of their DOFs (theory eqs. M1-M3).

    `strain` (6,) is |K r| over |K| |r| for rigid motions r, zero but for round-off when nothing is held. `mass` (3,),
    kg, is that of the three translations; `cross` the largest departure of the mass that rigid motions carry from that
    of a rigid body. `wave_speed`, m/s, is that of pressure waves, nan without mass. `asymmetry` is the largest
    difference from the transpose over the largest entry, as found.
    """

    strain: Array
    mass: Array
    cross: float
    wave_speed: float
    asymmetry: float


@dataclass(frozen=True, repr=False)
class StoredMatrices(Result):
    """K and M (n, n), SI, of a solid, from another program.

    Row k is the displacement (`component` 0, 1, 2) or rotation (3, 4, 5) of node number `node`. `labels` (p,) are
    numbers of nodes, `points` (p, 3), m, their places, `sets` numbers of nodes by name, `cells` points of elements by
    kind and position, where they are known. M without entries comes with stiffness that is condensed to some nodes.
    `density_mass`, kg, is density times volume where the source has both.
    """

    K: sp.csc_matrix
    M: sp.csc_matrix
    node: Index
    component: Index
    labels: Index
    points: Array
    sets: Mapping[str, Index] = field(default_factory=dict)
    cells: Mapping[str, Index] = field(default_factory=dict)
    density_mass: float | None = None
    asymmetry: float = 0.0

    def presentation(self) -> Iterator[Item]:
        sets = ", ".join(islice(self.sets, MOST_NAMED))
        facts = {"rows": self.K.shape[0], "nodes": len(self.labels), "sets": sets}
        mass = quantity(self.density_mass, "kg")
        yield Facts({**facts, "density times volume": mass, "asymmetry": f"{self.asymmetry:.1g}"})

    def __post_init__(self) -> None:
        n = len(self.node)
        shapes = [A.shape for A in (self.K, self.M)]
        if not n or shapes != [(n, n)] * 2 or len(self.component) != n:
            raise OptionError(
                f"K and M are {shapes[0]} and {shapes[1]} for {n} nodes and {len(self.component)} components"
            )
        if self.points.shape != (len(self.labels), 3) or len(np.unique(self.labels)) < len(self.labels):
            raise OptionError(f"{len(self.labels)} nodes, each named once, have places {self.points.shape}")
        if not np.isin(self.component, range(6)).all():
            raise OptionError("components are 0, 1, 2 for displacements along x, y, z and 3, 4, 5 for rotations")
        both, count = np.unique(np.stack([self.node, self.component]), axis=1, return_counts=True)
        if count.max() > 1:
            node, component = both[:, count.argmax()].tolist()
            raise OptionError(f"component {component} of node {node} has {count.max()} rows, instead of one")
        if not all(np.isfinite(A.data).all() for A in (self.K, self.M)) or not np.isfinite(self.points).all():
            raise OptionError("matrices and places are finite numbers")

    def positions(self, nodes: Index) -> Index:
        """Positions of nodes by number. Raises OptionError for nodes that have no place."""
        unknown = np.setdiff1d(nodes, self.labels)
        if len(unknown):
            rule = f"node {unknown[0]} has rows in the matrices and no place: is the list of nodes theirs?"
            raise OptionError(f"{rule} CalculiX expands shells and beams into nodes of its own; take solid elements")
        order = np.argsort(self.labels)
        return order[np.searchsorted(self.labels, nodes, sorter=order)]

    def places(self, nodes: Index) -> Array:
        """Places (k, 3), m, of nodes by number. Raises OptionError for nodes that have none."""
        return self.points[self.positions(nodes)]

    def rigid(self, about: Array, rows: Index | None = None) -> Array:
        """Rigid motions (n, 6) about a place, or some rows of them; translations before rotations."""
        node, component = (a if rows is None else a[rows] for a in (self.node, self.component))
        turns = np.tile(np.eye(3, 6, k=3), (len(node), 1, 1))
        moves = rigid_motions(self.places(node), about).reshape(-1, 3, 6)
        return np.concatenate([moves, turns], axis=1)[np.arange(len(node)), component]

    def evidence(self) -> MatrixEvidence:
        """What rigid motions and uniform stretches say. Raises OptionError for nodes without a position."""
        x = self.places(self.node)
        low, high = x.min(axis=0), x.max(axis=0)
        size, centre = float((high - low).max()) or 1.0, (low + high) / 2
        R = self.rigid(centre) / np.repeat([1.0, size], 3)
        strain = np.linalg.norm(self.K @ R, axis=0) / np.linalg.norm(abs(self.K) @ abs(R), axis=0)
        asymmetry = max(self.asymmetry, *(_asymmetry(A) for A in (self.K, self.M)))
        carried = R[:, :3].T @ (self.M @ R)
        mass = np.diagonal(carried).copy()
        if not mass.max() > 0:
            return MatrixEvidence(strain, mass, 0.0, float("nan"), asymmetry)
        straight, coupling = carried[:, :3] - mass.mean() * np.eye(3), carried[:, 3:]
        cross = float(abs(np.stack([straight, coupling + coupling.T])).max() / mass.max())
        stretch = (x - centre) * (self.component[:, None] == np.arange(3))
        energy = np.einsum("ik,ik->k", stretch, self.K @ stretch).max()
        return MatrixEvidence(strain, mass, cross, float(np.sqrt(max(energy, 0.0) / mass.mean())), asymmetry)

    def proven(self, mass: float | None = None) -> MatrixEvidence:
        """The evidence, when it proves the matrices; `mass`, kg, is known from elsewhere.

        Raises OptionError, with the place and the likely reason, when a rigid motion strains the solid or does not
        carry the mass of a rigid body, and when mass or wave speed are not those of the solid: a wrong unit.
        """
        evidence = self.evidence()
        if evidence.asymmetry > SYMMETRIC:
            raise OptionError(f"a matrix differs from its transpose by {evidence.asymmetry:.1e} of its largest entry")
        if evidence.strain.max() > STRAINLESS:
            raise OptionError(self._held_or_mixed(evidence.strain))
        if not evidence.mass.max() > 0:
            return evidence
        if evidence.cross > CARRIED:
            rule = "the mass that rigid motions carry is not that of a rigid body"
            share = f"{evidence.cross:.1e} of {quantity(evidence.mass.max(), 'kg', 6)}"
            raise OptionError(f"{rule}, by {share}: M has not the rows of K")
        slow, fast = WAVE_SPEEDS
        if not slow < evidence.wave_speed < fast:
            rule = f"pressure waves at {evidence.wave_speed:.3g} m/s, in solids {slow:g} to {fast:g}"
            raise OptionError(f"{rule}: length or time are not in the units given; {UNITS}")
        mean = float(evidence.mass.mean())
        box = float(np.prod(np.ptp(self.places(self.node), axis=0)))
        if mean > DENSEST * box > 0:
            rule = f"{quantity(mean, 'kg', 3)} in a box of {quantity(box, 'm^3', 3)}"
            raise OptionError(f"{rule}: mass is not in the unit given; {UNITS}")
        for other, source in ((mass, "given"), (self.density_mass, "density times volume")):
            if other is not None and abs(mean / other - 1) > MASS_AGREES:
                rule = f"the matrices have a mass of {quantity(mean, 'kg', 6)}"
                raise OptionError(f"{rule}, {source} is {quantity(other, 'kg', 6)}; {UNITS}")
        return evidence

    def _held_or_mixed(self, strain: Array) -> str:
        """Why rigid motions strain the solid, as far as rows say it."""
        worst = int(strain[:3].argmax()) if strain[:3].max() > STRAINLESS else int(strain.argmax())
        named = f"a {'translation along' if worst < 3 else 'rotation about'} {DIRECTIONS[worst % 3]}"
        strained = f"{named} strains the solid, |K r| / |K||r| = {strain[worst]:.1e}"
        there = np.zeros((len(self.labels), 3), dtype=bool)
        moves = self.component < 3
        there[self.positions(self.node[moves]), self.component[moves]] = True
        partly = np.flatnonzero(there.any(axis=1) & ~there.all(axis=1))
        without = np.setdiff1d(self.labels, self.node)
        if len(partly):
            missing = DIRECTIONS[int(there[partly[0]].argmin())]
            label = self.labels[partly[0]]
            return f"{strained}: node {label} has no row for {missing}; leave out what holds it (*BOUNDARY, D)"
        if len(without):
            rule = f"{len(without)} of {len(self.labels)} nodes have no rows, such as {without[0]}"
            return f"{strained}: {rule}; leave out what holds them (*BOUNDARY, D), or the rows are not the DOFs given"
        R = self.rigid(self.places(self.node).mean(axis=0))[:, worst]
        force = abs(self.K @ R)
        place = f"most at node {self.node[force.argmax()]}"
        if worst < 3:
            return f"{strained}, {place}: something holds it, or the rows are not the DOFs given for them"
        return f"{strained}, {place}: the rows are not the DOFs, or the nodes not in the places, given for them"

    def scaled(self, length: float, mass: float, time: float) -> StoredMatrices:
        """The same matrices in SI when they are in units of so many m, kg and s (theory eq. 34)."""
        arms = np.where(self.component < 3, 1.0, length)
        scale = sp.diags_array(arms)
        K, M = (sp.csc_matrix(factor * (scale @ A @ scale)) for A, factor in ((self.K, mass / time**2), (self.M, mass)))
        density_mass = None if self.density_mass is None else mass * self.density_mass
        return replace(self, K=K, M=M, points=length * self.points, density_mass=density_mass)


def _asymmetry(A: sp.csc_matrix) -> float:
    return float(abs(A - A.T).max() / abs(A).max()) if A.nnz else 0.0


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

    def presentation(self) -> Iterator[Item]:
        mass = float(np.max(self.evidence.mass))
        facts = {"mass": quantity(mass, "kg"), "order": self.order, "amplitudes": self.superelement.amplitudes}
        yield Facts({**facts, "rigid motions strain it": f"{np.max(self.evidence.strain):.1g}"})
        yield Table({"node": list(self.places), "at [mm]": [in_mm(x) for x in self.places.values()]}, "nodes")

    def _data(self) -> dict[str, Any]:
        element = self.superelement
        matrices = {"amplitudes": element.amplitudes, "stiffness": element.stiffness.array, "mass": element.mass.array}
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
        matrices = {"K": self.superelement.stiffness.array, "M": self.superelement.mass.array}
        comment = f"nodes {', '.join(self.superelement.nodes)}, amplitudes {self.superelement.amplitudes}, SI"
        with complete_files(path.parent) as scratch:
            for letter, A in matrices.items():
                with (scratch / f"{name}_{letter}.mtx").open("wb") as stream:
                    mmwrite(stream, A, f"{letter}: {comment}", symmetry="symmetric", precision=17)
        return [path.with_name(f"{name}_{letter}.mtx") for letter in matrices]


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
    at = at or {}
    if not nodes or set(at) - set(nodes):
        raise OptionError(f"`nodes` names at least one node, and `at` some of these; found {', '.join(at) or 'none'}")
    evidence = stored.proven(mass)
    rows = {name: _rows(stored, name, given) for name, given in nodes.items()}
    owner: dict[int, str] = {}
    for name, of_node in rows.items():
        for label in np.unique(stored.node[of_node]).tolist():
            if label in owner:
                raise OptionError(f"nodes {owner[label]} and {name} share point {label}: a point follows one node")
            owner[label] = name
    places = {name: _place(stored, of_node, at.get(name)) for name, of_node in rows.items()}
    T, boundary = _ties(stored, rows, places, faces)
    K, M = (sp.csc_matrix(T.T @ A @ T) for A in (stored.K, stored.M))
    if inside := K.shape[0] - len(boundary):  # Craig-Bampton (theory eq. B5), without modes where there is no mass
        count = min(keep, inside - 1) if M[:inside, :inside].nnz else 0
        solid = constraint_modes(K, M, boundary, count)
        K, M = solid.K, solid.M
    else:
        K, M = K.toarray(), M.toarray()
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
        sets = {key.upper(): labels for key, labels in stored.sets.items()}
        if given.upper() not in sets:
            known = ", ".join(stored.sets) or "none"
            raise OptionError(f"node {name}: there is no set of nodes {given!r}; there are {known}")
        labels = sets[given.upper()]
    else:
        labels = np.unique(np.asarray(given, dtype=np.intp))
    missing = np.setdiff1d(labels, stored.node)
    if len(missing) or not len(labels):
        rule = f"{len(missing)} of the {len(labels)} points have no rows in the matrices"
        which = f", such as number {missing[0]}: it is held, or follows others" if len(missing) else ""
        raise OptionError(f"node {name}: {rule}{which}")
    return np.flatnonzero(np.isin(stored.node, labels))


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
    for k, (name, of_node) in enumerate(rows.items()):
        G = stored.rigid(places[name], of_node)
        s = np.linalg.svd(G / np.repeat([1.0, max(float(abs(G[:, 3:]).max()), TINY)], 3), compute_uv=False)
        if len(of_node) < 6 or s[-1] < NO_ROTATION * s[0]:
            rule = f"node {name}: its {len(of_node)} rows have no rotation of their own"
            raise OptionError(f"{rule}; take the points of a face")
        points = np.unique(stored.positions(stored.node[of_node]))
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
    of_loose = sp.csr_matrix((np.ones(len(loose)), (loose, np.arange(len(loose)))), shape=(n, len(loose)))
    inside = sp.csc_matrix(follow @ ties.T + of_nodes)
    used = np.flatnonzero(np.diff(inside[:, : len(ties.free)].tocsc().indptr))
    T = sp.csc_matrix(sp.hstack([of_loose, inside[:, used], inside[:, ties.boundary]]))
    return T, np.arange(T.shape[1] - len(ties.boundary), T.shape[1])
