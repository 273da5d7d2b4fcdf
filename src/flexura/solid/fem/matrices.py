"""Stiffness and consistent mass of a solid mesh: isotropic linear elasticity with quadratic cells.

Isoparametric displacement elements (Zienkiewicz, Taylor and Zhu 2013, ch. 6); no reduced integration. Small strains and
rotations about the unloaded shape. Cells are worked out many at once: K and M are those of scikit-fem to 1e-12, made 41
to 45 times (27-node hexahedra) and 7 times (quadratic tetrahedra) as quickly (`benchmarks/solid.py --assembly`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.solid.mesh import CELLS, SolidMesh, quadrature, shape_of

CHUNK = 4_000_000
"""Numbers of element stiffnesses worked out at a time, which bounds the memory."""

STRAIGHT = 1e-9
"""Distance of the points of a cell from their affine places, over its size, below which it counts as straight."""


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
        size = max(1, CHUNK // (9 * cells.shape[1] ** 2))
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
