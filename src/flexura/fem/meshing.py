"""Meshes of members, or of fused ones as one piece.

Single members are mapped meshes of 27-node hexahedra, from their true contours: a mesh of the section, of the unit
square or disc, is carried along the member and scaled with its sizes at every station. Axes are those of the member: x
from its first end, y along the width, z along the thickness. Fused members are swept, or filled with tetrahedra.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from types import ModuleType
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import OptionError, SolverError
from flexura.fem import drawn_by_gmsh as occ
from flexura.fem.geometry import ENDS, MILLIMETRE, MemberShape, MemberSolid, Outline, normalised
from flexura.fem.solid_mesh import SolidMesh, quadrature, rigid_motions, shape_of
from flexura.fem.sweep import EDGES, GROWTH, swept, swept_cells, turned
from flexura.tables import quantity

KIND = "hexahedron27"
CONTOUR_SAMPLES = 4000
"""Points at which a contour is followed to place the stations of the mesh."""
THIN_STRIP = 0.25
"""A strip thinner than so many times its width has one cell across its thickness: 27-node cells bend as they should."""
CELLS_PER_RADIAN = 3.0
"""Cells along an arc for every radian that it turns."""
UNEVEN = 0.27
"""Least part of a cell's length on one side of its middle."""


SIZES = (0.05, 5.0)
"""Smallest and largest relative size of cells."""
MOST_POINTS = 200_000
"""Most points of a mesh, unless told otherwise."""

LEAST_JACOBIAN = 0.05
"""Least Jacobian determinant of a cell over its mean below which its curved edges are moved."""

VOLUME_ERROR = 0.01
"""Most relative difference between the volume of a mesh and that of its solid."""

THINNEST = 1e-3
"""Least thickness of a solid filled with tetrahedra over its size."""

RIGID_STRAIN = 1e-8
"""Most strain of cells under rigid motions."""


def shape_cells(shape: MemberShape, size: float = 1.0) -> tuple[Array, Index]:
    """Points (n, 3) and cells (c, 27) of a member of unit length; `size` scales the cells."""
    face, quads = section_mesh(shape, size)
    x = stations(shape, size)
    along_y, along_z = shape.at(x)
    n = len(face)
    points = np.empty((len(x), n, 3))
    points[..., 0] = x[:, None]
    points[..., 1] = along_y[:, None] * face[:, 0]
    points[..., 2] = along_z[:, None] * face[:, 1]
    across, up, on = (shape_of(KIND).points.astype(int) + 1).T
    slices = 2 * np.arange(len(x) // 2)
    cells = quads[:, 3 * up + across] + n * (slices[:, None, None] + on)
    return points.reshape(-1, 3), cells.reshape(-1, 27)


def stations(shape: MemberShape, size: float = 1.0) -> Array:
    """Fractions (2 n + 1,) of the length at which the points of n cells lie.

    Cells are as long along the contour as sqrt(h L)/3, h the lesser size of the section and L the length: a notch of
    radius R with the web t is at its thinnest over about sqrt(R t). Towards the ends they shrink to the size of the
    end.
    """
    breaks, stations = shape.breaks, [np.zeros(1)]
    turn = (1 - np.cos(np.pi * np.arange(CONTOUR_SAMPLES + 1) / CONTOUR_SAMPLES)) / 2
    for first, last in pairwise(breaks):
        x = first + (last - first) * turn
        y, z = shape.at(np.clip(x, first + 1e-12, last - 1e-12))
        h = np.minimum(y, z)
        step = np.sqrt(np.diff(x) ** 2 + (np.diff(y) ** 2 + np.diff(z) ** 2) / 4)
        middle, depth = (x[1:] + x[:-1]) / 2, (h[1:] + h[:-1]) / 2
        end_y, end_z = shape.at(np.array([0.0, 1.0]))
        end = np.minimum(end_y, end_z)
        density = 3 / np.sqrt(depth) + 0.7 / (middle + end[0]) + 0.7 / (1 - middle + end[1])
        turned = sum(abs(np.gradient(np.arctan2(np.diff(side) / 2, np.diff(x)))) for side in (y, z))
        count = np.concatenate([[0.0], np.cumsum(density * step + CELLS_PER_RADIAN * turned)])
        cells = max(1, round(count[-1] / size))
        stations.append(np.interp(np.linspace(0, count[-1], 2 * cells + 1)[1:], count, x))
    return _centred(shape, np.concatenate(stations))


def _centred(shape: MemberShape, x: Array) -> Array:
    """Stations with the middle points of cells in their middle, but for those on flanks steeper than 45 degrees.

    Cells that are stretched unevenly cannot bend as well as others, and at a quarter of their length they fold.
    """
    x = x.copy()
    y, z = shape.at(x)
    rise = np.maximum(abs(y[2::2] - y[:-2:2]), abs(z[2::2] - z[:-2:2])) / 2
    is_flat = rise < x[2::2] - x[:-2:2]
    step = x[2::2] - x[:-2:2]
    part = np.clip((x[1::2] - x[:-2:2]) / step, UNEVEN, 1 - UNEVEN)
    x[1::2] = x[:-2:2] + np.where(is_flat, 0.5, part) * step
    return x


def section_mesh(shape: MemberShape, size: float = 1.0) -> tuple[Array, Index]:
    """Points (n, 2) of the section in units of its sizes along y and z, and quadrilaterals (q, 9), three rows of three
    points each along y."""
    if shape.family == "rectangle":
        x = stations(shape)
        y, z = shape.at(x)
        thin = np.argmin(np.minimum(y, z))
        aspect = float(y[thin] / z[thin])
        notched = (bool(np.ptp(y) > 0), bool(np.ptp(z) > 0))
        cells = [_across(*each, size) for each in zip((aspect, 1 / aspect), notched, strict=True)]
        return _patch(*(_towards_edges(n) for n in cells))
    round_cells = max(1, round(1 / size))
    return _ring(shape.bore, round_cells) if shape.bore else _disc(1 + 2 * round_cells, round_cells)


def _across(ratio: float, notched: bool, size: float) -> int:
    """Cells along a side of the section that is `ratio` times the other."""
    least = 3 if notched else 1 if ratio < THIN_STRIP else 2
    return max(1, round((least + np.log2(max(ratio, 1.0))) / size))


def _towards_edges(cells: int) -> Array:
    """Positions (2 cells + 1,) from -1/2 to 1/2, closer at both; every other one is in the middle of its neighbours."""
    s = np.linspace(-1, 1, cells + 1)
    lines = (0.5 * s + 0.5 * np.sin(np.pi * s / 2)) / 2
    return np.interp(np.arange(2 * cells + 1) / 2, np.arange(cells + 1), lines)


def _patch(y: Array, z: Array) -> tuple[Array, Index]:
    """A grid of quadrilaterals on lines (2 n + 1,) and (2 m + 1,)."""
    points = np.stack(np.meshgrid(y, z, indexing="xy"), axis=-1).reshape(-1, 2)
    return points, _grid(len(y) // 2, len(z) // 2)


def _grid(n: int, m: int) -> Index:
    """Quadrilaterals (n m, 9) on a grid of (2 m + 1) rows of 2 n + 1 points."""
    row = 2 * n + 1
    corner = (2 * row * np.arange(m)[:, None] + 2 * np.arange(n)).reshape(-1, 1)
    return corner + (row * np.arange(3)[:, None] + np.arange(3)).ravel()


def _ring(bore: float, cells: int) -> tuple[Array, Index]:
    """An annulus of outer diameter one."""
    n = 12 * cells
    angle = 2 * np.pi * np.linspace(0, 1, 2 * n + 1)
    radius = np.linspace(1, bore, 2 * cells + 1)[:, None] / 2
    return _merged(np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1).reshape(-1, 2), _grid(n, cells))


def _disc(n: int, cells: int) -> tuple[Array, Index]:
    """A disc of diameter one: a square of n x n cells with four patches of n x cells around it."""
    s = np.linspace(-1, 1, 2 * n + 1)
    inner = 0.25 * s
    points, quads = _patch(inner, inner)
    pieces, cell_list = [points], [quads]
    side = np.column_stack([inner, np.full(len(s), inner[-1])])
    arc = np.column_stack([np.sin(np.pi / 4 * s), np.cos(np.pi / 4 * s)]) / 2
    out = np.linspace(0, 1, 2 * cells + 1)[:, None, None]
    patch = (out * arc + (1 - out) * side).reshape(-1, 2)
    for quarter in range(4):
        angle = quarter * np.pi / 2
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        cell_list.append(_grid(n, cells) + sum(map(len, pieces)))
        pieces.append(patch @ turn)
    return _merged(np.concatenate(pieces), np.concatenate(cell_list))


def _merged(points: Array, quads: Index) -> tuple[Array, Index]:
    """Points that coincide made one."""
    _, first, number = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    return points[first], number.ravel()[quads]


_KINDS = {10: "tetra10", 27: "hexahedron27"}
GMSH_ORDER = (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)
"""Points of a tetrahedron in gmsh's order for those of VTK."""


class PieceMesh(NamedTuple):
    """Points (n, 3), m, cells (c, 10 or 27), and the position in the group of each cell's member."""

    points: Array
    cells: Index
    owner: Index


def group_mesh(
    members: Sequence[MemberSolid], size: float = 1.0, *, hexahedra: bool = True, limit: int = MOST_POINTS
) -> SolidMesh:
    """Mesh members that are one piece, in the frame in which they are given.

    A member by itself is mapped (`blocks`). Fused ones share points where they meet: figures of one width that can be
    cut into blocks are swept through it by 27-node hexahedra, long where a member is wide and thin; other shapes are
    filled with ten-node tetrahedra of the size of their webs, and so is everything without `hexahedra`; leaves need
    many of these, for by Mindlin's shear constraint ten-node cells much longer than thick are too stiff. `size`
    multiplies all sizes. Point sets are the end faces, such as `branch1.hinge start`. Tips steeper than 70 degrees are
    cut short at equal volume where members are not mapped. Raises OptionError for other sizes than 0.05 to 5 and when
    about more than `limit` points would be needed, and SolverError when a mesh is not that of its solid.
    """
    least, largest = SIZES
    if not least <= size <= largest:
        raise OptionError(f"size = {size!r}: the relative size of cells lies between {least:g} and {largest:g}")
    estimate = estimated_points(members, size, hexahedra)
    if estimate > limit:
        raise OptionError(
            f"{members[0].name}{' and others' if len(members) > 1 else ''}: about {estimate:.2g} points would be "
            f"needed, more than {limit}; raise size"
        )
    return _placed(_piece(normalised(members), size, hexahedra), members)


def _piece(group: Sequence[MemberSolid], size: float, hexahedra: bool) -> PieceMesh:
    """The mesh of one piece. Raises SolverError for folded cells, another volume than that of the solid, and cells that
    rigid motions strain."""
    if len(group) == 1 and hexahedra:
        (member,) = group
        points, cells = shape_cells(member.shape, size)
        piece = PieceMesh(member.placed(member.length * points), cells, np.zeros(len(cells), dtype=np.intp))
        wanted = member.volume
    else:
        with occ.session() as gmsh:
            figure = swept(group)
            if figure is not None:
                piece = PieceMesh(*swept_cells(gmsh, figure, size, hexahedra))
                area = sum(gmsh.model.occ.getMass(2, tag) for _, tag in gmsh.model.getEntities(2))
                wanted = figure.width * area * MILLIMETRE**2
            else:
                piece = PieceMesh(*_filled(gmsh, group, size))
                wanted = sum(gmsh.model.occ.getMass(3, tag) for _, tag in gmsh.model.getEntities(3)) * MILLIMETRE**3
        if piece.cells.shape[1] == 10:
            piece = piece._replace(points=_straightened(piece.points, piece.cells))
    name = group[0].name
    least, volume = jacobians(piece.points, piece.cells)
    if least.min() <= 0 or abs(volume.sum() / wanted - 1) > VOLUME_ERROR:
        raise SolverError(
            f"the mesh of {name} has {int((least <= 0).sum())} folded cells and {quantity(volume.sum(), 'm^3', 6)} "
            f"where its solid has {quantity(wanted, 'm^3', 6)}; try another size"
        )
    strain = rigid_strain(piece.points, piece.cells)
    if not strain < RIGID_STRAIN:
        raise SolverError(
            f"the mesh of {name}: rigid motions strain cells by {strain:.2g}; it is too thin for its size"
        )
    return piece


def _filled(gmsh: ModuleType, group: Sequence[MemberSolid], size: float) -> tuple[Array, Index, Index]:
    """Fill members of any shape with cells of the size of their webs. Raises OptionError where these would be too many
    orders smaller than the solid."""
    box = np.array([member.box for member in group])
    extent = float((box[:, 1].max(axis=0) - box[:, 0].min(axis=0)).max())
    for member in group:
        if member.thickness < THINNEST * extent:
            rule = f"{member.name}: its least thickness is {member.thickness / extent:.2g} of the size of its solid"
            hint = "make it thicker, or a piece by itself, which hexahedra can fill"
            raise OptionError(f"{rule}, and tetrahedra need {THINNEST:g}; {hint}")
    model, outlines = gmsh.model, [member.outline.blunted() for member in group]
    tags = [occ.volume(gmsh, member, outline) for member, outline in zip(group, outlines, strict=True)]
    occ.check_volumes(gmsh, group, tags, 3e-3)
    pieces = [[(3, tag)] for tag in tags]
    if len(tags) > 1:
        _, pieces = model.occ.fragment([(3, tags[0])], [(3, tag) for tag in tags[1:]])
    model.occ.synchronize()

    def wanted(_dim: int, _tag: int, x: float, y: float, z: float, _lc: float) -> float:
        at = np.array([[x, y, z]]) * MILLIMETRE
        sizes = (_cell_size(o, member.local(at), size)[0] for member, o in zip(group, outlines, strict=True))
        return float(min(sizes)) / MILLIMETRE

    model.mesh.setSizeCallback(wanted)
    model.mesh.generate(3)
    model.mesh.removeSizeCallback()
    model.mesh.setOrder(2)
    if (np.array(model.mesh.getElementQualities(model.mesh.getElementsByType(11)[0], "minSJ")) < LEAST_JACOBIAN).any():
        model.mesh.optimize("HighOrder")
    owner = occ.first_owners(pieces, 3)
    points, cells, member = occ.elements(gmsh, 11, 10, owner)
    return points, turned(points, cells[:, GMSH_ORDER]), member


def _cell_size(shape: Outline, local: Array, size: float) -> Array:
    """Size of cells, m, that a member wants at points (n, 3) of its own frame, within it and around it."""
    x, y, z = local.T
    half_y, half_z = shape.half(x)
    if shape.is_round:
        across = np.maximum(np.hypot(y, z) - half_y, 0.0)
    else:
        across = np.hypot(np.maximum(np.abs(y) - half_y, 0.0), np.maximum(np.abs(z) - half_z, 0.0))
    away = np.hypot(np.maximum(np.maximum(-x, x - shape.length), 0.0), across)
    web, L = shape.web(x), shape.length
    if shape.family == "tube":
        within = np.minimum(np.maximum(1.5 * web, 0.4 * shape.y[0]), L / 2)
    else:
        within = np.minimum((0.4 if shape.is_round else 0.7) * web, L / (2 if shape.is_straight else 6))
    return size * within + GROWTH * away


def estimated_points(group: Sequence[MemberSolid], size: float, hexahedra: bool) -> float:
    """About how many points a piece will have."""
    if len(group) == 1 and hexahedra:
        shape = group[0].shape
        return float(len(stations(shape, size)) * len(section_mesh(shape, size)[0]))
    figure = swept(group)
    if figure is not None:
        return figure.estimate(size, hexahedra)
    points = 0.0
    for member in group:
        outline = member.outline
        x = np.linspace(0.0, member.length, 400)
        half_y, half_z = outline.half(x)
        area = np.pi * (half_y**2 - outline.inner**2) if outline.is_round else 4 * half_y * half_z
        axis = member.placed(np.stack([x, 0 * x, 0 * x], axis=-1))
        sizes = [_cell_size(other.outline, other.local(axis), size) for other in group]
        points += 1.7 * float(np.trapezoid(area / (0.118 * np.min(sizes, axis=0) ** 3), x))
    return points


def jacobians(points: Array, cells: Index) -> tuple[Array, Array]:
    """Least Jacobian determinant at the points of each cell over its mean, and volumes (c,), m^3.

    Tetrahedra (c, 10) or hexahedra (c, 27).
    """
    kind = _KINDS[cells.shape[1]]
    shape, x = shape_of(kind), points[cells]
    places, weights = quadrature(kind, 3)
    at_points = np.stack([np.linalg.det(dN @ x) for dN in shape.gradients(shape.points)])
    volume = weights @ np.stack([np.linalg.det(dN @ x) for dN in shape.gradients(places)])
    return at_points.min(axis=0) / np.abs(volume / weights.sum()), volume


def rigid_strain(points: Array, cells: Index) -> float:
    """The largest strain in cells (c, 10 or 27) under the six rigid motions, for a motion of one over the whole."""
    kind = _KINDS[cells.shape[1]]
    centre, size = points.mean(axis=0), float(np.ptp(points, axis=0).max())
    motions = rigid_motions(points, centre).reshape(len(points), 18)[cells]
    x, most = points[cells], 0.0
    for dN in shape_of(kind).gradients(quadrature(kind, 2)[0]):
        rate = np.linalg.solve(dN @ x, dN @ motions).reshape(len(cells), 3, 3, 6)
        strain = np.abs(rate + np.swapaxes(rate, 1, 2)).max(axis=(0, 1, 2))
        most = max(most, float((strain * [size, size, size, 1, 1, 1]).max()))
    return most


def _straightened(points: Array, cells: Index) -> Array:
    """Points, with the edges of folded cells made straighter, half of the way at a time."""
    points = points.copy()
    for _ in range(10):
        bad = cells[jacobians(points, cells)[0] < LEAST_JACOBIAN]
        if not len(bad):
            break
        edges = np.unique(np.concatenate([bad[:, [4 + k, i, j]] for k, (i, j) in enumerate(EDGES)]), axis=0)
        middle, i, j = edges.T
        points[middle] = points[middle] / 2 + (points[i] + points[j]) / 4
    return points


def _placed(piece: PieceMesh, group: Sequence[MemberSolid]) -> SolidMesh:
    """A normalised piece in the place of its group, with its materials, members and end faces."""
    materials = tuple(dict.fromkeys(member.material for member in group))
    kind = _KINDS[piece.cells.shape[1]]
    points = group[0].placed(group[0].length * piece.points)
    sets: dict[str, Index] = {}
    for member in group:
        near = 1e-6 * max(member.length, float(member.outline.y.max()))
        for end, word in enumerate(ENDS):
            on = np.flatnonzero(member.on_end(end, points, near))
            if not len(on):
                raise SolverError(f"no point of the mesh lies on the face {member.name} {word}; try a smaller size")
            sets[f"{member.name} {word}"] = on
    return SolidMesh(
        points,
        {kind: piece.cells},
        {kind: np.array([materials.index(member.material) for member in group])[piece.owner]},
        materials,
        sets,
        {kind: tuple(group[k].name for k in piece.owner)},
    )
