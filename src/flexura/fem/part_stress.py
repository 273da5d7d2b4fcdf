"""Stresses over the surface of a part from its curved tetrahedra: how far off they are, and where they are infinite.

Stresses of cells are averaged at the corners of their outer sides and in the middles of edges, where those of order 3
are quadratic. How far off they are is told by what cells differ by (Zienkiewicz and Zhu 1987), and by the forces that
are left on faces which nothing touches.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from flexura.arrays import Array, Bools, Index
from flexura.errors import need
from flexura.fem.curved import CurvedElements
from flexura.fem.geometry import MILLIMETRE
from flexura.fem.surfaces import STORED

LOCAL = np.array([(1, 0), (0, 1), (0, 0), (0, 0.5), (0.5, 0), (0.5, 0.5)])
"""Corners of a side, and the middles of the edges that lie opposite to them, in its own coordinates."""

OPPOSITE = [[1, 2], [2, 0], [0, 1]]
"""Corners at both ends of these edges."""

SHARP = np.radians(15.0)
"""Angle of normals from which two faces meet at an edge that is not smooth."""

NEAR = 0.4
"""Distance from an edge with infinite stress over the thickness of the wall there, up to which stresses are of the
edge: the nearer one at which structural stresses are read (Hobbacher 2016, Recommendations of the IIW, 2.2.3.4)."""

FACING = -0.7
"""Cosine of normals, at most, of sides of a wall."""

PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))
"""Components of stress: xx, yy, zz, yz, zx, xy."""


def surface_stress(
    elements: CurvedElements, basis: Array, K: Array, met: Collection[str], rigid: Collection[str], inner: str
) -> Mapping[str, NDArray[Any]]:
    """The arrays of `SurfaceStress` of a part with shapes (n, 6 + c) for its coordinates, `basis`, and stiffness K
    (6 + c,) of these. Others meet faces of names in `met`, of which those in `rigid` move rigidly, and `inner` ones lie
    between solids."""
    facets = _Facets.of(elements, inner, met)
    size = 1 / np.sqrt(np.diagonal(K)[6:])
    values, turn = la.eigh(K[6:, 6:] * np.outer(size, size))
    parts = np.sqrt(values)[:, None] * turn.T / size
    count, c = len(facets.points), len(size)
    rows, error = np.empty((6, count, c)), np.empty((count, c))
    for k, shape in enumerate((basis[:, 6:] @ (size[:, None] * turn / np.sqrt(values))).T):
        stress = facets.stresses(shape)
        rows[..., k] = facets.averaged(stress)
        error[:, k] = facets.errors(stress, rows[..., k])
    edge, solid = facets.near_edges(rigid).astype(np.int8), facets.solid_of_points.astype(np.int16)
    found = (facets.points * MILLIMETRE, rows.astype(np.float32), error.astype(np.float32), parts, edge, solid)
    return {f"stress_{name}": array for name, array in zip(STORED, found, strict=True)}


class _Facets(NamedTuple):
    """Outer sides of a mesh: `points` (q, 3), mm, of their corners and the middles of their edges, `at` (f, 6) by side,
    normals there (f, 6, 3), names of faces, whether they are free, and numbers of solids (f,)."""

    elements: CurvedElements
    mapped: Any
    points: Array
    at: Index
    normals: Array
    face: NDArray[Any]
    free: Bools
    solid: Index

    @staticmethod
    def of(elements: CurvedElements, inner: str, met: Collection[str]) -> _Facets:
        ng, mesh = need("ngsolve", "solid"), elements.mesh
        outer = mesh.Boundaries("|".join(dict.fromkeys(name for name in mesh.GetBoundaries() if name != inner)))
        corners = np.array([[v.nr for v in side.vertices] for side in outer.Elements()])
        face = np.array([side.mat for side in outer.Elements()])
        mapped = mesh.MapToAllElements(ng.IntegrationRule(LOCAL.tolist(), [0.0] * len(LOCAL)), outer)
        ends = np.sort(corners[:, OPPOSITE], axis=2)
        keys = np.concatenate([corners, mesh.nv * (1 + ends[..., 0]) + ends[..., 1]], axis=1)
        _, first, at = np.unique(keys, return_index=True, return_inverse=True)
        points = np.asarray(ng.CoefficientFunction((ng.x, ng.y, ng.z))(mapped))
        normals = np.asarray(ng.specialcf.normal(3)(mapped)).reshape(-1, 6, 3)
        names = list(elements.materials)
        number = ng.CF([float(names.index(name)) for name in mesh.GetMaterials()])
        solid = np.asarray(ng.BoundaryFromVolumeCF(number)(mapped)).reshape(-1, 6)[:, 3].round().astype(np.intp)
        free = ~np.isin(face, list(met))
        return _Facets(elements, mapped, points[first], at.reshape(keys.shape), normals, face, free, solid)

    def stresses(self, vector: Array) -> Array:
        """Stresses (6 f, 6), Pa, of the cells behind the sides in a shape (n,)."""
        ng, elements = need("ngsolve", "solid"), self.elements
        strain = ng.Sym(ng.Grad(elements.field(vector)))
        stress = ng.BoundaryFromVolumeCF(elements.stress(strain))
        found = np.asarray(stress(self.mapped)).reshape(-1, 3, 3) / MILLIMETRE
        return np.stack([found[:, i, j] for i, j in PAIRS], axis=-1)

    def averaged(self, values: Array) -> Array:
        """Means (m, q) of values (6 f, m)."""
        at, count = self.at.ravel(), len(self.points)
        return np.stack([np.bincount(at, own, count) for own in values.T]) / np.bincount(at, minlength=count)

    def errors(self, stress: Array, mean: Array) -> Array:
        """How far off (q,) averages (6, q) of stresses (6 f, 6) may be, Pa: the root mean square over sides there."""
        once_twice = np.array([1.0, 1, 1, 2, 2, 2])
        jump = ((stress - mean.T[self.at.ravel()]) ** 2 @ once_twice).reshape(-1, 6)
        xx, yy, zz, yz, zx, xy = mean[:, self.at]
        nx, ny, nz = np.moveaxis(self.normals, -1, 0)
        pulls = (xx * nx + xy * ny + zx * nz, xy * nx + yy * ny + yz * nz, zx * nx + yz * ny + zz * nz)
        left = sum(pull**2 for pull in pulls) * self.free[:, None]
        own = np.repeat((jump + left).mean(axis=1), 6)
        return np.sqrt(self.averaged(own[:, None])[0])

    @property
    def solid_of_points(self) -> Index:
        """Numbers (q,) of the solids to which points belong, of one where several meet."""
        found = np.empty(len(self.points), dtype=np.intp)
        found[self.at.ravel()] = np.repeat(self.solid, 6)
        return found

    def near_edges(self, rigid: Collection[str]) -> Index:
        """Numbers (q,) of `EDGES`: what points are near to where stresses are infinite."""
        from scipy.spatial import KDTree  # slow to import

        found = np.zeros(len(self.points), dtype=np.intp)
        tree = KDTree(self.points)
        for kind, edges in self._edges(rigid):
            first, local = edges.side[:, 0], edges.local[:, 0]
            ends = self.points[self.at[first[:, None], np.array(OPPOSITE)[local - 3]]]
            middle = self.points[self.at[first, local]]
            near = NEAR * self._walls(middle, edges)
            for place, reach, (start, end) in zip(middle, near, ends, strict=True):
                steps = np.linspace(0, 1, 1 + int(np.ceil(np.linalg.norm(end - start) / reach)))[:, None]
                halves = [start + steps * (place - start), place + steps * (end - place)]
                hits = tree.query_ball_point(np.concatenate(halves), reach)
                found[np.concatenate([np.array(hit, dtype=np.intp) for hit in hits])] = kind
        return found

    def _edges(self, rigid: Collection[str]) -> list[tuple[int, _Edges]]:
        """Edges with infinite stress, those of each kind of `EDGES` from the least to the most certain to be it."""
        middles = self.at[:, 3:].ravel()
        order = np.argsort(middles, kind="stable")
        second = np.flatnonzero(middles[order][1:] == middles[order][:-1]) + 1
        pair = np.stack([order[second - 1], order[second]], axis=1)
        side, local = pair // 3, 3 + pair % 3
        normals = self.normals[side, local]
        turn = np.arccos(np.clip((normals[:, 0] * normals[:, 1]).sum(axis=1), -1, 1))
        rise = self.points[self.at[side[:, 1], local[:, 1] - 3]] - self.points[self.at[side[:, 0], local[:, 0]]]
        is_inward = (turn > SHARP) & ((rise * normals[:, 0]).sum(axis=1) > 0)
        held = np.isin(self.face, list(rigid))[side]
        alike = [(m.E, m.nu) for m in self.elements.materials.values()]
        kinds = np.array([alike.index(moduli) for moduli in alike])[self.solid[side]]
        of_kind = (kinds[:, 0] != kinds[:, 1], held[:, 0] != held[:, 1], is_inward & ~held.all(axis=1))
        return [
            (kind, _Edges(side[at], local[at], normals[at]))
            for kind, at in zip((3, 2, 1), of_kind, strict=True)
            if at.any()
        ]

    def _walls(self, middle: Array, edges: _Edges) -> Array:
        """Thicknesses (s,), mm, of the walls behind edges: the least distance to a side that looks the other way."""
        centre, normal = self.points[self.at[:, 3:]].mean(axis=1), self.normals[:, 3:].mean(axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        least = np.full(len(middle), float(np.ptp(self.points, axis=0).min()))
        for k, (place, pair) in enumerate(zip(middle, edges.normals, strict=True)):
            away = centre - place
            distance = np.linalg.norm(away, axis=1)
            is_behind = ((normal @ pair.T < FACING) & (away @ pair.T < 0)).any(axis=1)
            least[k] = min(least[k], distance[is_behind].min(initial=np.inf))
        return least


class _Edges(NamedTuple):
    """Edges between two outer sides: numbers of these (s, 2), of their middles there (s, 2), and normals (s, 2, 3)."""

    side: Index
    local: Index
    normals: Array
