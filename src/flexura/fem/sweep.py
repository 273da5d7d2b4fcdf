"""Fused members that are one plane figure swept through a common width, meshed by quadratic hexahedra or tetrahedra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from types import ModuleType

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from flexura.arrays import Array, Index
from flexura.errors import SolverError
from flexura.fem import drawn_by_gmsh as occ
from flexura.fem.geometry import MILLIMETRE, MemberSolid, Outline

GROWTH = 0.4
"""How fast cells grow away from a thin member."""
ASPECT = (3.0, np.inf)
"""Most length of tetrahedra and hexahedra over the thickness: long tetrahedra are too stiff in bending and torsion."""


NEAR = (0.3, 1.0, 3.0)
"""Distances from corners and ends at which figures are cut, over the thickness that ends there."""

EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
"""Corners next to the points 4 to 9 of a quadratic tetrahedron."""


@dataclass(frozen=True)
class Profile:
    """A member in the plane of its group: `start` (2,), `along` (2,), its outline and its half size across, x by x."""

    outline: Outline
    half: Array
    start: Array
    along: Array

    def placed(self, x: Array) -> Array:
        """Plane coordinates (n, 2) of points along and across the member."""
        return self.start + x[:, :1] * self.along + x[:, 1:] * np.array([-self.along[1], self.along[0]])

    def size(self, points: Array, size: float) -> Array:
        """Wanted size of triangles, m, at plane points (n, 2)."""
        local = points - self.start
        x, z = local @ self.along, local @ np.array([-self.along[1], self.along[0]])
        half = np.interp(x, self.outline.x, self.half)
        L = self.outline.length
        away = np.hypot(np.maximum(np.maximum(-x, x - L), 0.0), np.maximum(np.abs(z) - half, 0.0))
        within = np.minimum(half, L / 4) if self.outline.is_straight else np.minimum(1.2 * half, L / 8)
        return size * within + GROWTH * away

    def steps(self, width: float, size: float, aspect: float) -> tuple[float, float]:
        """Lengths of cells along and across a straight member, m; `aspect` bounds the first over the thickness."""
        t, L = 2 * float(self.half[0]), self.outline.length
        along = size * min(max(1.5 * t, min(L / 8, width / 4)), L / 2, aspect * t)
        return along, size * (t if t < width / 4 or t < L / 8 else t / 2)

    def cuts(self, size: float) -> list[tuple[Array, Array]]:
        """Runs of x and half size (n,), m, between which a contour is cut into single cells."""
        cells = []
        for a, b in pairwise(self.outline.breaks):
            x, half = self.outline.x[a : b + 1], self.half[a : b + 1]
            if len(x) == 2:
                count = count_of(float(np.hypot(*np.diff([x, half])[:, 0]) / self._step(half, size).max()))
                ends = np.linspace(0, 1, count + 1)
                cells += [(x[0] + np.array(e) * np.ptp(x), np.interp(e, [0, 1], half)) for e in pairwise(ends)]
                continue
            k = np.arange(len(x))
            along, across = CubicSpline(k, x), CubicSpline(k, half)
            fine = np.linspace(0, len(x) - 1, 400)
            rate = np.hypot(along(fine, 1), across(fine, 1)) / self._step(across(fine), size)
            number = cumulative_trapezoid(rate, fine, initial=0)
            ends = np.interp(np.linspace(0, number[-1], count_of(number[-1]) + 1), number, fine)
            for e in pairwise(ends):
                at = np.linspace(*e, 7)
                cells.append((along(at), across(at)))
        return cells

    def _step(self, half: Array, size: float) -> Array:
        return size * np.minimum(1.2 * half, self.outline.length / 8)


@dataclass(frozen=True)
class Swept:
    """Members of one width: `frame` (3, 3) holds the two axes of their plane and the direction of the sweep as rows."""

    profiles: tuple[Profile, ...]
    origin: Array
    frame: Array
    width: float

    def heights(self, size: float, aspect: float) -> Array:
        """Positions from 0 to the width between layers of cells, m, closer at the free edges of wide thin figures.

        `aspect` bounds the thickness of layers over the least thickness of the figure.
        """
        w, thinnest = self.width, min(2 * float(p.half.min()) for p in self.profiles)
        step = size * min(max(w / 6, thinnest), aspect * thinnest)
        graded = 12 * thinnest < w and step > 2 * thinnest and any(p.outline.is_straight for p in self.profiles)
        edge = np.array([0.0, thinnest, 3 * thinnest]) if graded else np.zeros(1)
        inner = np.linspace(edge[-1], w - edge[-1], max(2, count_of((w - 2 * edge[-1]) / step)) + 1)
        return np.concatenate([edge[:-1], inner, w - edge[:-1][::-1]])

    def estimate(self, size: float, hexahedra: bool) -> float:
        """About how many points a mesh will have."""
        points, aspect = 0.0, ASPECT[hexahedra]
        for profile in self.profiles:
            if profile.outline.is_straight:
                along, across = profile.steps(self.width, size, aspect)
                columns, rows = profile.outline.length / along, 2 * float(profile.half[0]) / across
                thinner = sum(other.half.min() < profile.half[0] / 2 for other in self.profiles)
                rows += 7.0 * min(thinner, 2)
                columns += 6.0
            else:
                columns, rows = len(profile.cuts(size)), 2 / size
            points += (2 * np.ceil(columns) + 1) * (2 * np.ceil(rows) + 1)
        return points * (2 * len(self.heights(size, aspect)) - 1)


def count_of(number: float) -> int:
    """A number of cells, rounded up, at least one."""
    return max(1, int(np.ceil(number - 1e-6)))


def swept(members: Sequence[MemberSolid]) -> Swept | None:
    """The members as one plane figure swept through one width; None when they are not that."""
    outlines = [member.outline.blunted() for member in members]
    for k in _directions(outlines[0]):
        direction, half = members[0].axes[k], _end_size(outlines[0], k)
        chosen = [k]
        for member, outline in zip(members[1:], outlines[1:], strict=True):
            off = abs((member.start - members[0].start) @ direction)
            fits = [
                j
                for j in _directions(outline)
                if abs(member.axes[j] @ direction) > 1 - 1e-9
                and abs(_end_size(outline, j) - half) < 1e-6 * half
                and off < 1e-6 * half
            ]
            if not fits:
                break
            chosen.append(fits[0])
        else:
            frame = np.stack([members[0].axes[0], np.cross(direction, members[0].axes[0]), direction])
            origin = members[0].start - half * direction
            profiles = tuple(
                Profile(s, s.z if j == 1 else s.y, frame[:2] @ (m.start - origin), frame[:2] @ m.axes[0])
                for m, s, j in zip(members, outlines, chosen, strict=True)
            )
            return Swept(profiles, origin, frame, 2 * half)
    return None


def _directions(outline: Outline) -> list[int]:
    """Local axes along which a member is as wide everywhere, the widest first."""
    match outline.family:
        case "rectangle":
            return [1, 2] if outline.y[0] >= outline.z[0] else [2, 1]
        case "notch":
            return [1]
        case "tapered":
            return [k for k, half in ((1, outline.y), (2, outline.z)) if np.ptp(half) <= 1e-9 * half.max()]
    return []


def _end_size(outline: Outline, axis: int) -> float:
    return float((outline.y if axis == 1 else outline.z)[0])


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
    points, faces, owner = occ.elements(gmsh, *((10, 9) if quadrilaterals else (9, 6)), surfaces)
    sweep = sweep_quadrilaterals if quadrilaterals else sweep_triangles
    return sweep(points[:, :2], faces, owner, group, group.heights(size, ASPECT[quadrilaterals]))


def _surfaces(gmsh: ModuleType, group: Swept) -> dict[int, int]:
    """Plane surfaces of the members, cut where they meet: the position of the member of each."""
    made = [(_face(gmsh, p, p.outline.runs(p.half)), k) for k, p in enumerate(group.profiles)]
    return _fragments(gmsh, made, [])


def _blocks(gmsh: ModuleType, group: Swept, size: float) -> dict[int, int]:
    """The members cut into four-sided surfaces: contours cell by cell, straight ones where others meet them."""
    made, lines = [], []
    for k, profile in enumerate(group.profiles):
        if profile.outline.is_straight:
            made.append((_face(gmsh, profile, profile.outline.runs(profile.half)), k))
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
    profile = group.profiles[k]
    L, half = profile.outline.length, float(profile.half[0])
    turn = np.array([profile.along, [-profile.along[1], profile.along[0]]])
    low, high = np.array([0.0, -half]), np.array([L, half])
    near = 1e-6 * min(L, half)
    levels: tuple[list[float], list[float]] = ([0.0, L], [-half, half])
    close: list[tuple[int, float, float]] = []
    if 2 * half < L / 8:
        close += [(0, at, 2 * half * n) for n in NEAR for at in (2 * half * n, L - 2 * half * n)]
    for other in (p for j, p in enumerate(group.profiles) if j != k):
        for end, sign in ((0, -1.0), (-1, 1.0)):
            h = float(other.half[end])
            centre = turn @ (other.start + (other.outline.length * other.along if end else 0.0) - profile.start)
            inward, outward = sign * turn @ other.along, turn @ np.array([-other.along[1], other.along[0]])
            for side in (-1.0, 1.0):
                corner = centre + side * h * outward
                if (corner < low - near).any() or (corner > high + near).any():
                    continue
                levels[0].append(float(corner[0]))
                levels[1].append(float(corner[1]))
                if h < half / 2:
                    for n, axis, sense in product(NEAR, (0, 1), (inward, side * outward)):
                        if abs(sense[axis]) > 0.99:
                            close.append((axis, float(corner[axis] + 2 * h * n * sense[axis]), 2 * h * n))
    kept = tuple(_apart(sorted(values), near) for values in levels)
    for axis, at, gap in close:
        if np.abs(np.array(kept[axis]) - at).min() > 0.5 * gap and low[axis] < at < high[axis]:
            kept[axis].append(at)
    runs = [np.array([[x, -half], [x, half]]) for x in kept[0] if near < x < L - near]
    runs += [np.array([[0.0, z], [L, z]]) for z in kept[1] if abs(z) < half - near]
    made = []
    for run in runs:
        a, b = (gmsh.model.occ.addPoint(*p, 0.0) for p in profile.placed(run) / MILLIMETRE)
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
    first = occ.first_owners(pieces[: len(made)], 2)
    return {tag: made[k][1] for tag, k in first.items()}


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
