"""Stiffness of single members between rigid faces by solids: an eighth of each, which is enough by symmetry, or a
quarter of those that taper.

Cells of 27 nodes are graded to the edges of the held face, where stresses are singular: meshes of the same count that
are not are some per cent too stiff.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.sparse as sp
from pypardiso import PyPardisoSolver

from flexura.fem.geometry import MemberSolid
from flexura.fem.matrices import elastic_matrices
from flexura.fem.solid_mesh import SolidMesh, shape_of

KIND = "hexahedron27"
SAMPLES = 400
NEAR = 0.03
"""Distance from an edge, over the size of what meets there, within which cells shrink no further."""
STRETCH = lambda y, z: (1 + 0 * y, 0 * y, 0 * z)  # noqa: E731
TWIST = lambda y, z: (0 * y, -z, y)  # noqa: E731
TURN_Y, SHIFT_Z = lambda y, z: (z, 0 * y, 0 * z), lambda y, z: (0 * y, 0 * y, 1 + 0 * z)
TURN_Z, SHIFT_Y = lambda y, z: (y, 0 * y, 0 * z), lambda y, z: (0 * y, 1 + 0 * y, 0 * z)
EIGHTH = (
    ("sss", STRETCH),
    ("aaa", TWIST),
    ("ssa", TURN_Y),
    ("asa", SHIFT_Z),
    ("sas", TURN_Z),
    ("aas", SHIFT_Y),
)
"""Symmetric (s) or antisymmetric (a) about the middle planes across x, y and z, and how the end face moves: stretch,
twist, bending about y by moments and between parallel ends, about z likewise."""
QUARTER = (("hss", STRETCH), ("haa", TWIST), ("hsa", TURN_Y, SHIFT_Z), ("has", TURN_Z, SHIFT_Y))
"""The same of members that are not symmetric along x, whose first face is held (h)."""


def _points(density: np.ndarray, x: np.ndarray, fine: float) -> np.ndarray:
    """Points (2 n + 1,) of n cells along x, as many of which to a length as the density says."""
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(x))])
    cells = max(1, round(fine * count[-1]))
    corners = np.interp(np.linspace(0, count[-1], cells + 1), count, x)
    points = np.empty(2 * cells + 1)
    points[::2], points[1::2] = corners, (corners[1:] + corners[:-1]) / 2
    return points


def _to_edge(least: float, fine: float, smooth: float) -> np.ndarray:
    """Points from 0 to 1, dense at 1 down to the distance `least`."""
    d = np.geomspace(1.0 + least, least, SAMPLES) - least
    d[0], d[-1] = 1.0, 0.0
    return _points(smooth + 1.2 / (d + least), 1 - d, fine)


def _block(length: float, height: float, fine: float) -> np.ndarray:
    """Points from 0 to the end of a block, as far apart as its height and the way from its start ask for."""
    x = np.linspace(0.0, length, SAMPLES)
    return _points(3.0 / (0.2 * height + x), x, fine)


def _along(member: MemberSolid, fine: float) -> np.ndarray:
    """Points from 0.5 to 1 along a member of unit length, or from 0 to 1 where it tapers."""
    shape = member.shape
    inner = sorted({0.5, *(b for b in shape.breaks if 0.5 < b < 1 - 1e-9), 1.0})
    found = [np.array([0.5])]
    for first, last in pairwise(inner):
        x = last - (last - first) * (1 - np.sin(np.linspace(0, np.pi / 2, SAMPLES)))
        y, z = shape.at(np.clip(x, first + 1e-12, last - 1e-12))
        end_y, end_z = (float(s[0]) for s in shape.at(np.array([1.0])))
        rise = np.maximum(abs(np.diff(y)), abs(np.diff(z))) / 2
        step = np.hypot(np.diff(x), rise)
        depth = np.minimum(y, z)
        depth, s = (depth[1:] + depth[:-1]) / 2, 1 - (x[1:] + x[:-1]) / 2
        turned = np.zeros(len(step))
        for side in (y, z):
            angle = np.arctan2(np.diff(side) / 2, np.diff(x))
            turned += abs(np.gradient(angle))
        density = np.minimum(7 / np.sqrt(depth), 60) + 1.2 / (s + NEAR * min(end_y, end_z))
        count = np.concatenate([[0.0], np.cumsum(density * step + 3 * turned)])
        cells = max(1, round(fine * count[-1]))
        at = np.interp(np.linspace(0, count[-1], 2 * cells + 1), count, x)
        # cells that hardly rise have their middle points in their middle, so that they bend well
        high = shape.at(np.clip(at[::2], first, last))
        flat = np.maximum(*(abs(np.diff(h)) for h in high)) / 2 < np.diff(at[::2])
        at[1::2] = np.where(flat, (at[::2][1:] + at[::2][:-1]) / 2, at[1::2])
        found.append(at[1:])
    half = np.concatenate(found)
    return np.concatenate([1 - half[:0:-1], half]) if shape.kind == ("tapered",) else half


def _section(member: MemberSolid, fine: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (m, n) along y and z of the quarter of the section, over its sizes, and which of them (m, n) lie in the
    two middle planes: 1 across y, 2 across z, 3 both."""
    shape = member.shape
    y, z = (float(h.min()) for h in shape.at(np.linspace(0, 1, 201)))
    if shape.family == "rectangle":
        u = _to_edge(NEAR * min(1.0, z / y), fine, 2.0) / 2
        v = _to_edge(NEAR * min(1.0, y / z), fine, 2.0) / 2
        Y, Z = np.meshgrid(u, v, indexing="ij")
        return Y, Z, 1 * (u == 0)[:, None] + 2 * (v == 0)
    u = _to_edge(NEAR, fine, 3.0)
    if shape.family == "circle":
        U, V = np.meshgrid(u, u, indexing="ij")
        return U * np.sqrt(1 - V**2 / 2) / 2, V * np.sqrt(1 - U**2 / 2) / 2, 1 * (u == 0)[:, None] + 2 * (u == 0)
    angle = np.linspace(0, np.pi / 2, 2 * max(2, round(6 * fine)) + 1)
    r = np.concatenate([0.5 - u[::-1] / 2, 0.5 + u[1:] / 2])
    r = (shape.bore + (1 - shape.bore) * r) / 2
    A, Q = np.meshgrid(r, angle, indexing="ij")
    return A * np.cos(Q), A * np.sin(Q), 1 * (angle == angle[-1]) + 2 * (angle == 0) + 0 * A.astype(int)


@cache
def _solver() -> Any:
    return PyPardisoSolver(mtype=2)  # looks for its library all over the place


def stiffnesses(member: MemberSolid, fine: float = 1.0, block: float = 0.0, is_bar: bool = False) -> np.ndarray:
    """Stretch, twist, and bending about y and z by moments and between parallel ends, (6,), N/m and N m.

    With blocks of the length `block`, over that of the member, as large as its ends, between them and the rigid faces;
    or, `is_bar`, of such a block all along.
    """
    x = _along(member, fine)
    Y, Z, planes = _section(member, fine)
    size_y, size_z = member.shape.at(x)
    if block:
        beyond = _block(block, float(size_z[-1]), fine)[1:]
        x = np.concatenate([x, 1.0 + beyond])
        size_y, size_z = (np.concatenate([size, np.full(len(beyond), size[-1])]) for size in (size_y, size_z))
    if is_bar:
        size_y, size_z = (np.full(len(x), size[-1]) for size in (size_y, size_z))
    shape = (len(x), *Y.shape)
    points = np.empty((*shape, 3))
    points[..., 0] = (x - x[0])[:, None, None]
    points[..., 1] = size_y[:, None, None] * Y
    points[..., 2] = size_z[:, None, None] * Z
    across, up, on = (shape_of(KIND).points.astype(int) + 1).T
    i, j, k = (2 * a.reshape(-1, 1) for a in np.indices([n // 2 for n in shape]))
    cells = ((i + on) * shape[1] + j + across) * shape[2] + k + up
    X = member.length * points.reshape(-1, 3)
    mesh = SolidMesh(X, {KIND: cells}, {KIND: np.zeros(len(cells), dtype=np.intp)}, (member.material,))
    K = elastic_matrices(mesh)[0].tocsr()
    where = np.broadcast_to(planes, shape).ravel()
    middles = (np.arange(len(X)) < planes.size, where % 2 == 1, where >= 2)
    end = np.arange(len(X)) >= len(X) - planes.size
    found, solver = list[float](), _solver()
    for parity, *motions in QUARTER if x[0] == 0 else EIGHTH:
        free = np.ones((len(X), 3), dtype=bool)
        for axis, (sign, on_plane) in enumerate(zip(parity, middles, strict=True)):
            fixed = [other for other in range(3) if sign == "h" or (other == axis) == (sign == "s")]
            free[np.ix_(on_plane, fixed)] = False
        free[end] = False
        u = np.zeros((*X.shape, len(motions)))
        u[end] = np.stack([np.stack(motion(*X[end, 1:].T), axis=-1) for motion in motions], axis=-1)
        u = u.reshape(X.size, -1)
        rows = np.flatnonzero(free.ravel())
        force = K @ u
        inner = solver.solve(sp.triu(K[rows][:, rows]).tocsr(), -force[rows]).reshape(len(rows), -1)
        solver.free_memory()
        # where ends part by two, the solid is eight such pieces
        energy = (4 if x[0] == 0 else 2) * (u.T @ force + inner.T @ force[rows])
        turn, *shift = energy.diagonal()
        found += [1 / np.linalg.inv(energy)[0, 0], *shift] if shift else [turn]
    return np.array(found)
