"""Ties between faces of a solid and nodes: rigid, averaged or flexible faces as a transformation of the mesh's DOFs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.mechanism import Faces
from flexura.solid.mesh import SolidMesh, face_rule, faces_of, rigid_motions, shape_of

KINDS = ("rigid", "averaged", "flexible")

DEPENDENT = 1e-6
"""Part of a deformation of a face that others lack, below which it is made of these."""

SPREAD = 1e-9
"""Points of a set lie on a line when the smallest eigenvalue of their second moments is this small."""

DEGREE = 2
"""Highest degree of the deformations of a flexible face in its coordinates."""


class Face(NamedTuple):
    """Points of a face that follows a node: the node's number, its place (3,), m, and how."""

    points: Index
    place: Array
    node: int
    kind: Faces = "rigid"


@dataclass(frozen=True)
class SolidTies:
    """u (3 points,) = T q: DOFs `free` of the mesh first, then six of every node, then amplitudes of flexible faces."""

    T: sp.csc_matrix
    free: Index

    @property
    def boundary(self) -> Index:
        """Numbers in q of the coordinates of nodes and amplitudes."""
        return np.arange(len(self.free), self.T.shape[1])


class _Tie(NamedTuple):
    """Dependent DOFs (r,) as `of_others` (r, o) of the free DOFs `others` (o,) and `of_node` (r, 6 + amplitudes)."""

    rows: Index
    others: Index
    of_others: Array
    of_node: Array
    node: int


def face_ties(mesh: SolidMesh, faces: Sequence[Face], degree: int = DEGREE) -> SolidTies:
    """Faces tied to nodes, which are numbered from zero.

    `rigid` (theory eq. B2): all points follow; those of several rigid faces follow the first. `averaged` (eq. B3): six
    DOFs of the face, chosen by pivoting, follow the mean motion of the face and its other DOFs. `flexible` (eq. B4): as
    rigid, with amplitudes of all deformations up to `degree` in the coordinates of the face that have no mean motion.
    Raises OptionError for other kinds, and faces of these kinds that share points.
    """
    ties, owner = [], np.full(len(mesh.points), -1)
    for k, face in enumerate(faces):
        points = np.unique(face.points)
        before = owner[points]
        kinds = {face.kind, *(faces[j].kind for j in before[before >= 0])}
        if (before >= 0).any() and kinds != {"rigid"}:
            raise OptionError("faces that are averaged or flexible may not share points with others")
        points = points[before < 0]
        owner[points] = k
        ties.append(_tie(mesh, face._replace(points=points), degree))
    dependent = np.concatenate([tie.rows for tie in ties]) if ties else np.empty(0, np.intp)
    free = np.setdiff1d(np.arange(mesh.order), dependent)
    column = np.full(mesh.order, -1)
    column[free] = np.arange(len(free))
    first = len(free)
    amplitude = first + 6 * (max((face.node for face in faces), default=-1) + 1)
    entries = [(np.ones(len(free)), free, np.arange(len(free)))]
    for tie in ties:
        own = np.arange(tie.of_node.shape[1])
        own = np.where(own < 6, first + 6 * tie.node + own, amplitude + own - 6)
        amplitude += len(own) - 6
        for block, columns in ((tie.of_others, column[tie.others]), (tie.of_node, own)):
            i, j = np.nonzero(block)
            entries.append((block[i, j], tie.rows[i], columns[j]))
    data, row, col = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    return SolidTies(sp.csc_matrix((data, (row, col)), shape=(mesh.order, amplitude)), free)


def _tie(mesh: SolidMesh, face: Face, degree: int) -> _Tie:
    rows = _dofs(face.points)
    nothing = np.empty(0, np.intp)
    if face.kind == "averaged":
        W = averaged_rows(mesh, face.points, face.place)[:, rows].toarray()
        size = float(np.ptp(mesh.points[face.points], axis=0).max())
        pivots = la.qr(W * np.repeat([1.0, size], 3)[:, None], mode="r", pivoting=True)[1][:6]
        rest = np.setdiff1d(np.arange(len(rows)), pivots)
        inverse = np.linalg.inv(W[:, pivots])
        return _Tie(rows[pivots], rows[rest], -inverse @ W[:, rest], inverse, face.node)
    R = rigid_motions(mesh.points[face.points], face.place)
    if face.kind == "flexible":
        R = np.hstack([R, deformations(mesh, face.points, degree)])
    elif face.kind != "rigid":
        raise OptionError(f"faces = {face.kind!r}: {', '.join(KINDS[:-1])} or {KINDS[-1]}")
    return _Tie(rows, nothing, np.empty((len(rows), 0)), R, face.node)


def deformations(mesh: SolidMesh, points: Index, degree: int = DEGREE) -> Array:
    """Deformations (3 p, b) of a face (p,) that have no mean motion: polynomials up to a degree in its coordinates.

    They are the same on every mesh of the face, so that amplitudes of two meshes mean the same.
    """
    box = mesh.points[points]
    x = box - (box.min(axis=0) + box.max(axis=0)) / 2
    normal = np.linalg.svd(x, full_matrices=False)[2][2].round(6)
    across = np.eye(3)[np.abs(normal).argmin()]
    across = across - (across @ normal) * normal / (normal @ normal)
    axes = across, np.cross(normal * np.sign(normal[np.abs(normal).argmax()]), across)
    y, z = ((x @ axis) / abs(x @ axis).max() for axis in axes)
    powers = [(i, j) for i, j in product(range(degree + 1), repeat=2) if i + j <= degree]
    B = np.kron(np.column_stack([y**i * z**j for i, j in powers]), np.eye(3))
    centre = mesh.points[points].mean(axis=0)
    mean = averaged_rows(mesh, points, centre)[:, _dofs(points)]
    B = B - rigid_motions(mesh.points[points], centre) @ (mean @ B)
    return B[:, _independent(B)]


def _independent(B: Array) -> Index:
    """Columns of B (n, k) that do not depend on those before them."""
    Q, kept, size = np.zeros((len(B), 0)), [], np.linalg.norm(B, axis=0).max(initial=0.0)
    for k, column in enumerate(B.T):
        rest = column - Q @ (Q.T @ column)
        rest = rest - Q @ (Q.T @ rest)
        if np.linalg.norm(rest) > DEPENDENT * size:
            Q = np.column_stack([Q, rest / np.linalg.norm(rest)])
            kept.append(k)
    return np.array(kept, dtype=np.intp)


def averaged_rows(mesh: SolidMesh, points: Index, about: ArrayLike) -> sp.csr_matrix:
    """W (6, 3 points of the mesh): the rigid motion about a place that is nearest to the displacements of a face.

    W = (G' S G)^-1 G' S with G its rigid motions and S the integral of products of shape functions over the face, which
    makes the integral of |u - G W u|^2 least (theory eq. B3). Cell faces whose points all belong to `points` make up
    the face; where there are none all points count alike. Raises OptionError for points on a line.
    """
    points = np.unique(points)
    x = mesh.points[points]
    S = face_products(mesh, points)
    S = S[points][:, points] if S.nnz else sp.eye_array(len(points), format="csr")
    G = rigid_motions(x, np.asarray(about, dtype=float))
    SG = np.asarray(sp.kron(S, np.eye(3)) @ G)
    gram = G.T @ SG
    size = max(float(np.ptp(x, axis=0).max()), np.finfo(float).tiny)
    scale = np.repeat([1.0, 1 / size], 3)
    if np.linalg.eigvalsh(gram * scale[:, None] * scale)[0] < SPREAD * gram[0, 0]:
        raise OptionError(f"{len(points)} points that lie on a line have no rotation: tie them by a face")
    W = scale[:, None] * np.linalg.solve(gram * scale[:, None] * scale, (SG * scale).T)
    columns = _dofs(points)
    return sp.csr_matrix((W.ravel(), (np.repeat(np.arange(6), len(columns)), np.tile(columns, 6))), (6, mesh.order))


def face_products(mesh: SolidMesh, points: Index) -> sp.csr_matrix:
    """S (points, points) = int N' N dA, m^2, over the cell faces whose points all belong to `points`."""
    inside = np.zeros(len(mesh.points), bool)
    inside[points] = True
    n = len(mesh.points)
    found = [(np.empty(0), np.empty(0, np.intp), np.empty(0, np.intp))]
    for kind, cells in mesh.cells.items():
        shape = shape_of(kind)
        for number, local in enumerate(faces_of(kind)):
            chosen = cells[inside[cells[:, local]].all(axis=1)]
            if not len(chosen):
                continue
            xi, tangents, w = face_rule(kind, number)
            N = shape.values(xi)[:, local]
            slope = np.einsum("ti,qin,cnj->cqtj", tangents, shape.gradients(xi), mesh.points[chosen], optimize=True)
            dA = w * np.linalg.norm(np.cross(slope[:, :, 0], slope[:, :, 1]), axis=-1)
            S = np.einsum("cq,qa,qb->cab", dA, N, N, optimize=True)
            at = chosen[:, local]
            found.append((S.ravel(), np.repeat(at, len(local), axis=1).ravel(), np.tile(at, len(local)).ravel()))
    data, row, column = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return sp.csr_matrix((data, (row, column)), shape=(n, n))


def _dofs(points: Index) -> Index:
    return (3 * points[:, None] + np.arange(3)).ravel()
