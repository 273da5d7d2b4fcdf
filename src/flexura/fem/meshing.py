"""Meshes of members, or of fused ones as one piece.

Single members are mapped hexahedra (`mapped`). Fused ones of one width, along and across each other, are hexahedra on a
grid (`sweep`); others are filled with tetrahedra by netgen.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import sub
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import OptionError, SolverError
from flexura.fem.geometry import ENDS, MILLIMETRE, MemberSolid, Outline, normalised
from flexura.fem.mapped import layered, section_mesh, shape_cells, stations
from flexura.fem.occ import check_volumes, kernel, member_shape, tetrahedra
from flexura.fem.solid_mesh import TETRA_EDGES, SolidMesh, quadrature, rigid_motions, shape_of
from flexura.fem.sweep import swept
from flexura.tables import quantity

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

LONGEST = 3.0
"""Most length of tetrahedra over the thickness: longer ones are too stiff in bending and torsion."""

AROUND = 20
"""Tetrahedra around a full circle."""

RIGID_STRAIN = 1e-8
"""Most strain of cells under rigid motions."""


_KINDS = {10: "tetra10", 27: "hexahedron27"}
GROWTH = 0.4
"""How fast cells grow away from a thin member."""


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
        piece, wanted = (_on_grid(group, size) if hexahedra else None) or _filled(group, size)
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


def _on_grid(group: Sequence[MemberSolid], size: float) -> tuple[PieceMesh, float] | None:
    """Hexahedra of a plane figure and the volume that they should have, m^3; None for other shapes."""
    figure = swept(group)
    flat = figure.plane_mesh(size) if figure is not None else None
    if figure is None or flat is None:
        return None
    plane, quads, owner = flat
    heights = figure.heights(size)
    levels = np.interp(np.arange(2 * len(heights) - 1) / 2, np.arange(len(heights)), heights)
    points = figure.origin + plane @ figure.frame[:2] + levels[:, None, None] * figure.frame[2]
    layers = len(heights) - 1
    x = plane[quads]
    areas = np.prod(x[:, 8] - x[:, 0], axis=1)
    curved = [k for k, bar in enumerate(figure.bars) if not bar.is_straight]
    volume = figure.width * float(areas[~np.isin(owner, curved)].sum()) + sum(group[k].volume for k in curved)
    mesh = PieceMesh(points.reshape(-1, 3), layered(quads, len(plane), layers), np.tile(owner, layers))
    return mesh, volume


def _filled(group: Sequence[MemberSolid], size: float) -> tuple[PieceMesh, float]:
    """Tetrahedra of the size of the webs in members of any shape, and the volume of their solid, m^3. Raises
    OptionError where these would be too many orders smaller than the solid."""
    box = np.array([member.box for member in group])
    extent = float((box[:, 1].max(axis=0) - box[:, 0].min(axis=0)).max())
    for member in group:
        if member.thickness < THINNEST * extent:
            rule = f"{member.name}: its least thickness is {member.thickness / extent:.2g} of the size of its solid"
            hint = "make it thicker, or a piece by itself, which hexahedra can fill"
            raise OptionError(f"{rule}, and tetrahedra need {THINNEST:g}; {hint}")
    outlines = [member.outline.blunted() for member in group]
    with kernel() as occ:
        shapes = [member_shape(occ, member, outline) for member, outline in zip(group, outlines, strict=True)]
        check_volumes(group, shapes, 3e-3)
        solids: list[Any] = []
        for k, shape in enumerate(shapes):
            rest = reduce(sub, solids, shape)
            solids = [piece for solid in solids for part in (solid - shape, solid * shape) for piece in part.solids]
            for piece in rest.solids:
                piece.mat(str(k))
                solids.append(piece)
        whole = occ.Glue(solids)
        places = np.concatenate([_spread(m, o, size) for m, o in zip(group, outlines, strict=True)])
        sizes = np.min([_cell_size(o, m.local(places), size) for m, o in zip(group, outlines, strict=True)], axis=0)
        points, cells, solid = tetrahedra(occ, whole, float(sizes.max()), AROUND, (places, sizes))
        owner = np.array([int(solid.name) for solid in whole.solids])[solid]
        volume = float(whole.mass) * MILLIMETRE**3
    return PieceMesh(_straightened(points, cells), cells, owner), volume


def _spread(member: MemberSolid, outline: Outline, size: float) -> Array:
    """Points (n, 3) spread over a member, about as far apart as its cells are long."""
    places, x = [], 0.0
    while x < member.length:
        step = float(_cell_size(outline, np.array([[x, 0.0, 0.0]]), size)[0])
        halves = [float(half[0]) for half in outline.half(np.array([x]))]
        y, z = (np.linspace(-half, half, int(2 * half / step) + 2) for half in halves)
        places.append(np.stack(np.meshgrid([x], y, z), axis=-1).reshape(-1, 3))
        x += step
    return member.placed(np.concatenate(places))


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
    elif shape.family == "rectangle":
        wide = 2 * float(max(shape.y[0], shape.z[0]))
        within = np.minimum(np.maximum(0.7 * web, min(L / 8, wide / 4, LONGEST * float(web.min()))), L / 2)
    else:
        within = np.minimum((0.4 if shape.is_round else 0.7) * web, L / (2 if shape.is_straight else 6))
    return size * within + GROWTH * away


def estimated_points(group: Sequence[MemberSolid], size: float, hexahedra: bool) -> float:
    """About how many points a piece will have."""
    if len(group) == 1 and hexahedra:
        shape = group[0].shape
        return float(len(stations(shape, size)) * len(section_mesh(shape, size)[0]))
    figure = swept(group) if hexahedra else None
    flat = figure.plane_mesh(size) if figure is not None else None
    if figure is not None and flat is not None:
        return float(len(flat[0]) * (2 * len(figure.heights(size)) - 1))
    points = 0.0
    for member in group:
        outline = member.outline
        x = np.linspace(0.0, member.length, 400)
        half_y, half_z = outline.half(x)
        area = np.pi * (half_y**2 - outline.inner**2) if outline.is_round else 4 * half_y * half_z
        axis = member.placed(np.stack([x, 0 * x, 0 * x], axis=-1))
        sizes = [_cell_size(other.outline, other.local(axis), size) for other in group]
        cell = np.min(sizes, axis=0)
        points += 1.7 * float(np.trapezoid(area / (0.118 * cell**2 * np.minimum(cell, outline.web(x))), x))
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
        edges = np.unique(np.concatenate([bad[:, [4 + k, i, j]] for k, (i, j) in enumerate(TETRA_EDGES)]), axis=0)
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
