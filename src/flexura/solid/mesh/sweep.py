"""Meshes of plane figures swept through a width: quadratic hexahedra or tetrahedra."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import SolverError
from flexura.solid.geometry import ASPECT, MILLIMETRE, Profile, Swept, count_of, occ

NEAR = (0.3, 1.0, 3.0)
"""Distances from corners and ends at which figures are cut, over the thickness that ends there."""


def swept_cells(gmsh: ModuleType, group: Swept, size: float, hexahedra: bool) -> tuple[Array, Index, Index]:
    """Points (n, 3), m, quadratic tetrahedra (c, 10) or hexahedra (c, 27), and the member of each cell (c,).

    Tetrahedra are made of figures that cannot be cut into four-sided blocks, whatever is asked for.
    """
    surfaces = _blocks(gmsh, group, size)
    regular = _regular(gmsh, group, surfaces, size, ASPECT[hexahedra]) if surfaces else False
    if not regular:
        gmsh.model.remove()
        gmsh.model.add("flexura")
        surfaces = _surfaces(gmsh, group)

    def wanted(_dim: int, _tag: int, x: float, y: float, _z: float, _lc: float) -> float:
        at = np.array([[x, y]]) * MILLIMETRE
        return min(float(p.size(at, size)[0]) for p in group.profiles) / MILLIMETRE

    gmsh.model.mesh.setSizeCallback(wanted)
    quadrilaterals = regular and hexahedra
    for surface in surfaces if quadrilaterals else ():
        gmsh.model.mesh.setRecombine(2, surface)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(2)
    gmsh.model.mesh.removeSizeCallback()
    tags, flat, _ = gmsh.model.mesh.getNodes()
    kind, count = (10, 9) if quadrilaterals else (9, 6)
    faces, owner = [], []
    for surface, profile in surfaces.items():
        _, own = gmsh.model.mesh.getElementsByType(kind, surface)
        faces.append(np.reshape(own, (-1, count)).astype(np.intp))
        owner.append(np.full(len(faces[-1]), profile))
    used, cells = np.unique(np.concatenate(faces), return_inverse=True)
    order = np.argsort(tags)
    plane = flat.reshape(-1, 3)[order[np.searchsorted(tags[order], used)], :2] * MILLIMETRE
    sweep = sweep_quadrilaterals if quadrilaterals else sweep_triangles
    heights = group.heights(size, ASPECT[quadrilaterals])
    return sweep(plane, cells.reshape(-1, count), np.concatenate(owner), group, heights)


def _surfaces(gmsh: ModuleType, group: Swept) -> dict[int, int]:
    """Plane surfaces of the members, cut where they meet: the position of the member of each."""
    made = [(_face(gmsh, p, occ.runs(p.outline, p.half)), k) for k, p in enumerate(group.profiles)]
    return _fragments(gmsh, made, [])


def _blocks(gmsh: ModuleType, group: Swept, size: float) -> dict[int, int]:
    """The members cut into four-sided surfaces: contours cell by cell, straight ones where others meet them."""
    made, lines = [], []
    for k, profile in enumerate(group.profiles):
        if profile.outline.is_straight:
            made.append((_face(gmsh, profile, occ.runs(profile.outline, profile.half)), k))
            lines += _cut_lines(gmsh, group, k)
            continue
        for x, half in profile.cuts(size):
            top = np.stack([x, half], axis=-1)
            back = (top * [1.0, -1.0])[::-1]
            sides = [top, np.array([top[-1], back[0]]), back, np.array([back[-1], top[0]])]
            made.append((_face(gmsh, profile, sides), k))
    return _fragments(gmsh, made, lines)


def _face(gmsh: ModuleType, profile: Profile, sides: Sequence[Array]) -> int:
    flat = [profile.placed(side) / MILLIMETRE for side in sides]
    wire = occ.outline(gmsh, [np.concatenate([run, np.zeros((len(run), 1))], axis=1) for run in flat])
    return gmsh.model.occ.addPlaneSurface([wire])


def _cut_lines(gmsh: ModuleType, group: Swept, k: int) -> list[int]:
    """Lines across a straight member, along and across it: through the end corners of others that lie on it, and `NEAR`
    these; the same near its own ends if it is thin. Stresses are infinite there."""
    own = group.profiles[k]
    L, half = own.outline.length, float(own.half[0])
    turn = np.array([own.along, [-own.along[1], own.along[0]]])
    low, high = np.array([0.0, -half]), np.array([L, half])
    near = 1e-6 * min(L, half)
    levels: tuple[list[float], list[float]] = ([0.0, L], [-half, half])
    close: list[tuple[int, float, float]] = []
    if 2 * half < L / 8:
        close += [(0, at, 2 * half * n) for n in NEAR for at in (2 * half * n, L - 2 * half * n)]
    for other in (p for j, p in enumerate(group.profiles) if j != k):
        for end, sign in ((0, -1.0), (-1, 1.0)):
            h = float(other.half[end])
            centre = turn @ (other.start + (other.outline.length * other.along if end else 0.0) - own.start)
            inward, outward = sign * turn @ other.along, turn @ np.array([-other.along[1], other.along[0]])
            for side in (-1.0, 1.0):
                corner = centre + side * h * outward
                if (corner < low - near).any() or (corner > high + near).any():
                    continue
                levels[0].append(float(corner[0]))
                levels[1].append(float(corner[1]))
                if h < half / 2:
                    for n, axis, way in ((n, a, w) for n in NEAR for a in (0, 1) for w in (inward, side * outward)):
                        if abs(way[axis]) > 0.99:
                            close.append((axis, float(corner[axis] + 2 * h * n * way[axis]), 2 * h * n))
    kept = tuple(_apart(sorted(own_levels), near) for own_levels in levels)
    for axis, at, gap in close:
        if np.abs(np.array(kept[axis]) - at).min() > 0.5 * gap and low[axis] < at < high[axis]:
            kept[axis].append(at)
    runs = [np.array([[x, -half], [x, half]]) for x in kept[0] if near < x < L - near]
    runs += [np.array([[0.0, z], [L, z]]) for z in kept[1] if abs(z) < half - near]
    made = []
    for run in runs:
        a, b = (gmsh.model.occ.addPoint(*p, 0.0) for p in own.placed(run) / MILLIMETRE)
        made.append(gmsh.model.occ.addLine(a, b))
    return made


def _apart(values: list[float], near: float) -> list[float]:
    """Sorted values, without those that hardly differ from the one before."""
    kept = values[:1]
    for value in values[1:]:
        if value - kept[-1] > near:
            kept.append(value)
    return kept


def _fragments(gmsh: ModuleType, made: Sequence[tuple[int, int]], lines: Sequence[int]) -> dict[int, int]:
    """Cut surfaces by one another and by lines; the member of each piece, the first of those that share it."""
    pieces = [[(2, tag)] for tag, _ in made]
    rest = [(2, tag) for tag, _ in made[1:]] + [(1, tag) for tag in lines]
    if rest:
        _, pieces = gmsh.model.occ.fragment([(2, made[0][0])], rest)
    gmsh.model.occ.synchronize()
    found: dict[int, int] = {}
    for (_, k), own in zip(made, pieces, strict=False):
        for dim, tag in own:
            if dim == 2:
                found.setdefault(tag, k)
    return found


def _regular(gmsh: ModuleType, group: Swept, surfaces: dict[int, int], size: float, aspect: float) -> bool:
    """Give four-sided surfaces regular meshes with as many cells on opposite sides; False when some are not such."""
    from scipy.cluster.hierarchy import DisjointSet  # a quarter of a second to import

    alike, wanted = DisjointSet(), dict[int, int]()
    for surface, k in surfaces.items():
        curves = [tag for _, tag in gmsh.model.getBoundary([(2, surface)], oriented=False)]
        points = {c: [tag for _, tag in gmsh.model.getBoundary([(1, c)], oriented=False)] for c in curves}
        opposite = [c for c in curves[1:] if not set(points[c]) & set(points[curves[0]])]
        if len(curves) != 4 or len(opposite) != 1:
            return False
        pairs = (curves[0], opposite[0]), tuple(c for c in curves[1:] if c != opposite[0])
        for a, b in pairs:
            alike.add(a)
            alike.add(b)
            alike.merge(a, b)
        for curve in curves:
            start, end = (np.array(gmsh.model.getValue(0, tag, []))[:2] * MILLIMETRE for tag in points[curve])
            count = _divisions(group.profiles[k], end - start, group.width, size, aspect)
            wanted[curve] = max(count, wanted.get(curve, 1))
    most: dict[int, int] = {}
    for curve, count in wanted.items():
        most[alike[curve]] = max(count, most.get(alike[curve], 1))
    for curve in wanted:
        gmsh.model.mesh.setTransfiniteCurve(curve, most[alike[curve]] + 1)
    for surface in surfaces:
        gmsh.model.mesh.setTransfiniteSurface(surface, "AlternateLeft")
    return True


def _divisions(profile: Profile, run: Array, width: float, size: float, aspect: float) -> int:
    """Cells along a side with the chord `run` of a block of a member."""
    length = float(np.linalg.norm(run))
    if not profile.outline.is_straight:
        return count_of(2 / size) if abs(run @ profile.along) < 1e-6 * length else 1
    along, across = profile.steps(width, size, aspect)
    return count_of(length / (along if abs(run @ profile.along) > 0.5 * length else across))


_MIDDLE = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
"""The point of a quadratic triangle at a corner or between two."""
_EVEN = ((0, 0), (1, 0), (2, 0), (2, 1)), ((0, 0), (1, 0), (1, 1), (2, 1)), ((0, 0), (0, 1), (1, 1), (2, 1))
"""Tetrahedra of a prism, corner and level, whose corners 0, 1, 2 are in order of number: all diagonals of its sides
start at the lower number below."""
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
"""Corners next to the points 4 to 9 of a quadratic tetrahedron."""


def sweep_triangles(
    plane: Array, triangles: Index, owner: Index, group: Swept, heights: Array
) -> tuple[Array, Index, Index]:
    """Quadratic tetrahedra from quadratic triangles (t, 6) over plane points (p, 2), in layers between `heights`, m.

    Prisms are cut into three tetrahedra by the numbers of their corners, so that cells match (Dompierre, Labbe, Vallet
    & Camarero 1999); every other layer is cut as the mirror image.
    """
    layers = len(heights) - 1
    levels = 2 * layers + 1
    order = np.argsort(triangles[:, :3], axis=1)
    place = _MIDDLE[order[:, :, None], order[:, None, :]]
    corner = np.take_along_axis(triangles, place.reshape(len(triangles), 9), axis=1).reshape(-1, 3, 3)
    cells, members = [], []
    for layer in range(layers):
        for tetrahedron in _EVEN:
            ends = [(c, 2 * layer + 2 * ((level + layer) % 2)) for c, level in tetrahedron]
            ten = [(c, c, 2 * level) for c, level in ends]
            ten += [(ends[i][0], ends[j][0], ends[i][1] + ends[j][1]) for i, j in EDGES]
            cells.append(np.stack([corner[:, a, b] * levels + level // 2 for a, b, level in ten], axis=-1))
            members.append(owner)
    points = _raised(plane, group, heights)
    tetrahedra = np.concatenate(cells)
    used, tetrahedra = np.unique(tetrahedra, return_inverse=True)
    return points[used], turned(points[used], tetrahedra.reshape(-1, 10)), np.concatenate(members)


_QUADRILATERAL = ((0, 1, 2, 3), (4, 5, 6, 7), (8,))
"""Corners, middles of sides, and centre of a quadrilateral of nine points."""


def sweep_quadrilaterals(
    plane: Array, faces: Index, owner: Index, group: Swept, heights: Array
) -> tuple[Array, Index, Index]:
    """Hexahedra (c, 27) from quadrilaterals of nine points (q, 9) over plane points (p, 2), in layers between
    `heights`, m."""
    a, b, c, d = np.moveaxis(plane[faces[:, :4]], 1, 0)
    across, other = c - a, d - b
    inverted = across[:, 0] * other[:, 1] - across[:, 1] * other[:, 0] < 0
    faces = faces.copy()
    faces[inverted] = faces[inverted][:, [0, 3, 2, 1, 7, 6, 5, 4, 8]]
    corner, side, _ = _QUADRILATERAL
    places = [*((p, 0) for p in corner), *((p, 2) for p in corner), *((p, 0) for p in side), *((p, 2) for p in side)]
    places += [*((p, 1) for p in corner), (7, 1), (5, 1), (4, 1), (6, 1), (8, 0), (8, 2), (8, 1)]
    layers = len(heights) - 1
    levels = 2 * layers + 1
    cells = [np.stack([faces[:, p] * levels + 2 * k + level for p, level in places], axis=-1) for k in range(layers)]
    return _raised(plane, group, heights), np.concatenate(cells), np.tile(owner, layers)


def _raised(plane: Array, group: Swept, heights: Array) -> Array:
    """Points, m, over plane points (p, 2), at `heights` and half way between."""
    flat = group.origin + plane @ group.frame[:2]
    height = np.interp(np.arange(2 * len(heights) - 1) / 2, np.arange(len(heights)), heights)
    return (flat[:, None] + height[:, None] * group.frame[2]).reshape(-1, 3)


def turned(points: Array, cells: Index) -> Index:
    """The cells, with two corners exchanged in those that are inside out."""
    x = points[cells[:, :4]]
    negative = np.linalg.det(x[:, 1:] - x[:, :1]) < 0
    cells = cells.copy()
    cells[negative] = cells[negative][:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    if len(cells) == 0:
        raise SolverError("gmsh made no cells; change the size of the mesh")
    return cells
