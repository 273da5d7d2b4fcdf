"""Stiffness and consistent mass of a solid mesh, and faces of it tied to nodes as a transformation of its DOFs.

Isotropic linear elasticity, isoparametric displacement elements with quadratic cells (Zienkiewicz, Taylor and Zhu 2013,
ch. 6); no reduced integration. Small strains and rotations about the unloaded shape. Cells are worked out many at once:
K and M are those of scikit-fem to 1e-12, made 41 to 45 times (27-node hexahedra) and 7 times (quadratic tetrahedra) as
quickly (`benchmarks/solid.py --assembly`). Faces follow nodes rigidly, in the mean, or with deformations of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.fem.solid_mesh import CELLS, SolidMesh, dofs_of, face_rule, faces_of, quadrature, rigid_motions, shape_of
from flexura.mechanism import Faces

NUMBERS_AT_ONCE = 4_000_000
"""Numbers of element stiffnesses worked out at a time, which bounds the memory."""

STRAIGHT = 1e-9
"""Distance of the points of a cell from their affine places, over its size, below which it counts as straight."""


KINDS = ("rigid", "averaged", "flexible")

DEPENDENT = 1e-6
"""Part of a deformation of a face that others lack, below which it is made of these."""

IN_LINE = 1e-9
"""Points of a set lie on a line when the smallest eigenvalue of their second moments is this small."""

DEGREE = 2
"""Highest degree of the deformations of a flexible face in its coordinates."""


class MassProperties(NamedTuple):
    """Mass, kg; centre (3,), m; inertia (3, 3) about the centre, kg m^2; volume, m^3."""

    mass: float
    centre: Array
    inertia: Array
    volume: float


class _Batch(NamedTuple):
    """Cells of one kind: their places in the list of the kind, point coordinates (c, n, 3), and whether affine."""

    kind: str
    chosen: Index
    x: Array
    is_straight: bool


def elastic_matrices(mesh: SolidMesh) -> tuple[sp.csc_matrix, sp.csc_matrix]:
    """K, N/m, and M, kg, both (3 points, 3 points), symmetric, by columns: three DOFs x y z of every point in turn.

    K = int B' D B dV, M = int rho N' N dV (theory eq. E1). Integration is exact for affine cells; for others M, and the
    sum of forces that a uniform stress makes, is exact. Raises OptionError for a mesh with turned-over cells, points of
    no cell or impossible materials.
    """
    _check(mesh)
    n = len(mesh.points)
    keys = [
        (np.repeat(cells, cells.shape[1], axis=1) * n + np.tile(cells, cells.shape[1])).ravel()
        for cells in mesh.cells.values()
    ]
    pattern, slot = np.unique(np.concatenate(keys), return_inverse=True)
    slots, at = {}, 0
    for kind, cells in mesh.cells.items():
        size = cells.shape[1]
        slots[kind] = slot[at : at + cells.size * size].reshape(-1, size * size)
        at += cells.size * size
    K, M = np.zeros((len(pattern), 3, 3)), np.zeros(len(pattern))
    for batch in _batches(mesh):
        place = slots[batch.kind][batch.chosen].ravel()
        material = mesh.cell_materials[batch.kind][batch.chosen]
        E, nu, rho = (np.array([getattr(m, key) for m in mesh.materials])[material] for key in ("E", "nu", "rho"))
        k = _stiffness(batch, E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu)))
        for i, j in np.ndindex(3, 3):
            K[:, i, j] += np.bincount(place, k[:, i, :, j, :].ravel(), minlength=len(K))
        M += np.bincount(place, (rho[:, None, None] * _unit_mass(batch)).ravel(), minlength=len(M))
    first = np.searchsorted(pattern, n * np.arange(n + 1))
    columns = pattern % n
    stiffness = sp.bsr_matrix((K, columns, first), shape=(3 * n, 3 * n)).tocsr()
    mass = sp.kron(sp.csr_matrix((M, columns, first), shape=(n, n)), sp.eye_array(3), format="csr")
    return _by_columns(stiffness), _by_columns(mass)


def _by_columns(A: Any) -> sp.csc_matrix:
    """The same symmetric matrix, whose rows are its columns."""
    return sp.csc_matrix((A.data, A.indices, A.indptr), shape=A.shape)


def mesh_mass(mesh: SolidMesh) -> MassProperties:
    """Mass, centre, inertia and volume of a mesh, exact for its cells, curved ones too."""
    rows = []
    for batch in _batches(mesh):
        xi, w = quadrature(batch.kind, 5)
        shape = shape_of(batch.kind)
        dV = w * _jacobian(batch, shape.gradients(xi))[1]
        material = mesh.cell_materials[batch.kind][batch.chosen]
        dm = dV * np.array([m.rho for m in mesh.materials])[material][:, None]
        X = shape.values(xi) @ batch.x
        second = np.einsum("cq,cqi,cqj->ij", dm, X, X, optimize=True)
        rows.append((dm.sum(), np.einsum("cq,cqi->i", dm, X), second, dV.sum()))
    mass, volume = (float(sum(row[k] for row in rows)) for k in (0, 3))
    first, second = (np.sum([row[k] for row in rows], axis=0) for k in (1, 2))
    centre = first / mass
    second = second - mass * np.outer(centre, centre)
    return MassProperties(mass, centre, np.trace(second) * np.eye(3) - second, volume)


def _check(mesh: SolidMesh) -> None:
    if not mesh.cells or not all(len(cells) for cells in mesh.cells.values()):
        raise OptionError("a solid mesh needs at least one cell of every kind it lists")
    for kind, cells in mesh.cells.items():
        if kind not in CELLS or cells.ndim != 2 or cells.shape[1] != CELLS[kind]:
            raise OptionError(f"cells {kind!r} have shape {cells.shape}; kinds and their points: {CELLS}")
        if cells.min() < 0 or cells.max() >= len(mesh.points):
            raise OptionError(f"cells {kind!r} name points outside 0 .. {len(mesh.points) - 1}")
    used = np.zeros(len(mesh.points), bool)
    for cells in mesh.cells.values():
        used[cells] = True
    if not used.all():
        raise OptionError(f"{(~used).sum()} points of the mesh belong to no cell, the first is {np.argmin(used)}")
    for m in mesh.materials:
        if not (m.E > 0 and -1 < m.nu < 0.5 and m.rho > 0):
            raise OptionError(
                f"material {m.name!r}: E {m.E:g} > 0, -1 < nu {m.nu:g} < 0.5, rho {m.rho:g} > 0 are needed"
            )


def _batches(mesh: SolidMesh) -> Iterator[_Batch]:
    """Cells by kind, affine ones apart from others, few at a time."""
    for kind, cells in mesh.cells.items():
        shape = shape_of(kind)
        corners = shape.points[: shape.corners]
        linear = np.column_stack([np.ones(len(corners)), corners])
        onto = np.column_stack([np.ones(len(shape.points)), shape.points]) @ np.linalg.pinv(linear)
        size = max(1, NUMBERS_AT_ONCE // (9 * cells.shape[1] ** 2))
        for start in range(0, len(cells), size):
            x = mesh.points[cells[start : start + size]]
            off = np.abs(x - onto @ x[:, : shape.corners]).max(axis=(1, 2))
            straight = off <= STRAIGHT * np.ptp(x, axis=1).max(axis=1)
            for is_straight in (True, False):
                chosen = np.flatnonzero(straight == is_straight)
                if len(chosen):
                    yield _Batch(kind, start + chosen, x[chosen], is_straight)


def _jacobian(batch: _Batch, dN: Array) -> tuple[Array, Array]:
    """J (c, q, 3, 3) and det J (c, q) for dN/dxi (q, 3, n); one q for affine cells."""
    J = np.einsum("qin,cnj->cqij", dN[:1] if batch.is_straight else dN, batch.x, optimize=True)
    det = np.linalg.det(J)
    if not (det > 0).all():
        worst = batch.chosen[np.argmin(det.min(axis=1))]
        raise OptionError(f"{(det <= 0).any(axis=1).sum()} {batch.kind} cells are turned over or flat, such as {worst}")
    return J, det


def _gradients(batch: _Batch, xi: Array) -> tuple[Array, Array]:
    """dN/dx (c, q, 3, n) and det J (c, q or 1) at xi (q, 3)."""
    dN = shape_of(batch.kind).gradients(xi)
    J, det = _jacobian(batch, dN)
    return np.linalg.inv(J) @ dN, det


def _stiffness(batch: _Batch, lame: Array, shear: Array) -> Array:
    """Element stiffness (c, 3, n, 3, n), component before point, for Lame's constants (c,)."""
    xi, w = quadrature(batch.kind, 2 if batch.kind == "tetra10" and batch.is_straight else 3)
    D, det = _gradients(batch, xi)
    c, q, _, n = D.shape
    D = D.reshape(c, q, 3 * n)
    G = np.swapaxes(D * (w * det)[..., None], -1, -2) @ D
    G = ((G + np.swapaxes(G, -1, -2)) / 2).reshape(c, 3, n, 3, n)
    lame, mu = lame[:, None, None, None, None], shear[:, None, None, None, None]
    K = lame * G + mu * G.transpose(0, 3, 2, 1, 4)
    trace = shear[:, None, None] * (G[:, 0, :, 0] + G[:, 1, :, 1] + G[:, 2, :, 2])
    for i in range(3):
        K[:, i, :, i, :] += trace
    return K


def _unit_mass(batch: _Batch) -> Array:
    """int N' N dV (c, n, n)."""
    points = 3 if batch.is_straight else 4 if batch.kind == "tetra10" else 5
    xi, w = quadrature(batch.kind, points)
    shape = shape_of(batch.kind)
    N = shape.values(xi)
    det = _jacobian(batch, shape.gradients(xi))[1]
    n = N.shape[1]
    both = N[:, :, None] * N[:, None, :]
    if batch.is_straight:
        return det[:, :1, None] * (w @ both.reshape(len(w), -1)).reshape(n, n)
    return ((w * det) @ both.reshape(len(w), -1)).reshape(-1, n, n)


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
        k = np.arange(tie.of_node.shape[1])
        of_node = np.where(k < 6, first + 6 * tie.node + k, amplitude + k - 6)
        amplitude += len(k) - 6
        for block, columns in ((tie.of_others, column[tie.others]), (tie.of_node, of_node)):
            i, j = np.nonzero(block)
            entries.append((block[i, j], tie.rows[i], columns[j]))
    data, row, col = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    return SolidTies(sp.csc_matrix((data, (row, col)), shape=(mesh.order, amplitude)), free)


def _tie(mesh: SolidMesh, face: Face, degree: int) -> _Tie:
    rows = dofs_of(face.points)
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
    mean = averaged_rows(mesh, points, centre)[:, dofs_of(points)]
    B = B - rigid_motions(mesh.points[points], centre) @ (mean @ B)
    # columns that do not depend on those before them
    Q, kept, size = np.zeros((len(B), 0)), [], np.linalg.norm(B, axis=0).max(initial=0.0)
    for k, column in enumerate(B.T):
        rest = column - Q @ (Q.T @ column)
        rest = rest - Q @ (Q.T @ rest)
        if np.linalg.norm(rest) > DEPENDENT * size:
            Q = np.column_stack([Q, rest / np.linalg.norm(rest)])
            kept.append(k)
    return B[:, np.array(kept, dtype=np.intp)]


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
    if np.linalg.eigvalsh(gram * scale[:, None] * scale)[0] < IN_LINE * gram[0, 0]:
        raise OptionError(f"{len(points)} points that lie on a line have no rotation: tie them by a face")
    W = scale[:, None] * np.linalg.solve(gram * scale[:, None] * scale, (SG * scale).T)
    columns = dofs_of(points)
    return sp.csr_matrix((W.ravel(), (np.repeat(np.arange(6), len(columns)), np.tile(columns, 6))), (6, mesh.order))


def face_products(mesh: SolidMesh, points: Index) -> sp.csr_matrix:
    """S (points, points) = int N' N dA, m^2, over the cell faces whose points all belong to `points`."""
    inside = np.zeros(len(mesh.points), bool)
    inside[points] = True
    n = len(mesh.points)
    entries = [(np.empty(0), np.empty(0, np.intp), np.empty(0, np.intp))]
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
            entries.append((S.ravel(), np.repeat(at, len(local), axis=1).ravel(), np.tile(at, len(local)).ravel()))
    data, row, column = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    return sp.csr_matrix((data, (row, column)), shape=(n, n))
