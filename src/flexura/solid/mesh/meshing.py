"""Meshes of members, or of fused ones as one piece."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import OptionError, SolverError
from flexura.solid.geometry import ENDS, GROWTH, MILLIMETRE, MemberSolid, Outline, normalised, occ, swept
from flexura.solid.mesh.blocks import section_mesh, shape_cells, stations
from flexura.solid.mesh.shape_functions import quadrature, shape_of
from flexura.solid.mesh.solid_mesh import SolidMesh, rigid_motions
from flexura.solid.mesh.sweep import EDGES, swept_cells, turned
from flexura.tables import quantity

LIMIT = 200_000
"""Most points of a mesh, unless told otherwise."""
WORST = 0.05
"""Least Jacobian determinant of a cell over its mean below which its curved edges are moved."""
VOLUME = 0.01
"""Most relative difference between the volume of a mesh and that of its solid."""
THINNEST = 1e-3
"""Least thickness of a solid filled with tetrahedra over its size."""
STRAIN = 1e-8
"""Most strain of cells under rigid motions."""
_KINDS = {10: "tetra10", 27: "hexahedron27"}
_GMSH_ORDER = (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)
"""Points of a tetrahedron in gmsh's order for those of VTK."""


class PieceMesh(NamedTuple):
    """Points (n, 3), m, cells (c, 10 or 27), and the position in the group of each cell's member."""

    points: Array
    cells: Index
    owner: Index


def group_mesh(
    members: Sequence[MemberSolid], size: float = 1.0, *, hexahedra: bool = True, limit: int = LIMIT
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
    _check_size(members, size, hexahedra, limit)
    return _placed(_piece(normalised(members), size, hexahedra), members)


def _check_webs(group: Sequence[MemberSolid]) -> None:
    """Raise OptionError where tetrahedra would be too many orders smaller than their solid."""
    box = np.array([member.box for member in group])
    extent = float((box[:, 1].max(axis=0) - box[:, 0].min(axis=0)).max())
    for member in group:
        web = float(member.outline.web(member.outline.x).min())
        if web < THINNEST * extent:
            raise OptionError(
                f"{member.name}: its least thickness is {web / extent:.2g} of the size of its solid, and tetrahedra "
                f"need {THINNEST:g}; make it thicker, or a piece by itself, which hexahedra can fill"
            )


def _check_size(group: Sequence[MemberSolid], size: float, hexahedra: bool, limit: int) -> None:
    if not 0.05 <= size <= 5:
        raise OptionError(f"size = {size!r}: the relative size of cells lies between 0.05 and 5")
    estimate = estimated_points(group, size, hexahedra)
    if estimate > limit:
        raise OptionError(
            f"{group[0].name}{' and others' if len(group) > 1 else ''}: about {estimate:.2g} points would be needed, "
            f"more than {limit}; raise size"
        )


def _piece(group: Sequence[MemberSolid], size: float, hexahedra: bool) -> PieceMesh:
    """The mesh of one piece."""
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
    _check(piece, group[0].name, wanted)
    return piece


def _check(piece: PieceMesh, name: str, wanted: float) -> None:
    """Raise SolverError for folded cells, another volume than wanted, m^3, and cells that rigid motions strain."""
    least, volume = jacobians(piece.points, piece.cells)
    if least.min() <= 0 or abs(volume.sum() / wanted - 1) > VOLUME:
        raise SolverError(
            f"the mesh of {name} has {int((least <= 0).sum())} folded cells and {quantity(volume.sum(), 'm^3', 6)} "
            f"where its solid has {quantity(wanted, 'm^3', 6)}; try another size"
        )
    strain = rigid_strain(piece.points, piece.cells)
    if not strain < STRAIN:
        raise SolverError(
            f"the mesh of {name}: rigid motions strain cells by {strain:.2g}; it is too thin for its size"
        )


def _filled(gmsh: ModuleType, group: Sequence[MemberSolid], size: float) -> tuple[Array, Index, Index]:
    """Fill members of any shape with cells of the size of their webs."""
    _check_webs(group)
    model, outlines = gmsh.model, [member.outline.blunted() for member in group]
    tags = [occ.volume(gmsh, member, outline) for member, outline in zip(group, outlines, strict=True)]
    occ.check_volumes(gmsh, group, tags, 3e-3)
    pieces = [[(3, tag)] for tag in tags]
    if len(tags) > 1:
        _, pieces = model.occ.fragment([(3, tags[0])], [(3, tag) for tag in tags[1:]])
    model.occ.synchronize()

    def wanted(_dim: int, _tag: int, x: float, y: float, z: float, _lc: float) -> float:
        at = np.array([[x, y, z]]) * MILLIMETRE
        own = (_wanted(outline, member.local(at), size)[0] for member, outline in zip(group, outlines, strict=True))
        return float(min(own)) / MILLIMETRE

    model.mesh.setSizeCallback(wanted)
    model.mesh.generate(3)
    model.mesh.removeSizeCallback()
    model.mesh.setOrder(2)
    if (np.array(model.mesh.getElementQualities(model.mesh.getElementsByType(11)[0], "minSJ")) < WORST).any():
        model.mesh.optimize("HighOrder")
    numbers, flat, _ = model.mesh.getNodes()
    cells, owner, seen = [], [], set()
    for k, own in enumerate(pieces):
        for dim, tag in own:
            if dim == 3 and tag not in seen:
                seen.add(tag)
                _, nodes = model.mesh.getElementsByType(11, tag)
                cells.append(np.reshape(nodes, (-1, 10)).astype(np.intp)[:, _GMSH_ORDER])
                owner.append(np.full(len(cells[-1]), k))
    used, connected = np.unique(np.concatenate(cells), return_inverse=True)
    order = np.argsort(numbers)
    points = flat.reshape(-1, 3)[order[np.searchsorted(numbers[order], used)]] * MILLIMETRE
    return points, turned(points, connected.reshape(-1, 10)), np.concatenate(owner)


def _own_size(shape: Outline, x: Array) -> Array:
    """Size of cells along a shape that is filled, m."""
    web, L = shape.web(x), shape.length
    if shape.family in ("circle", "round"):
        return np.minimum(0.4 * web, L / 6 if shape.family == "round" else L / 2)
    if shape.family == "tube":
        return np.minimum(np.maximum(1.5 * web, 0.4 * shape.y[0]), L / 2)
    return np.minimum(0.7 * web, L / 6) if not shape.is_straight else np.minimum(0.7 * web, L / 2)


def _wanted(shape: Outline, local: Array, size: float) -> Array:
    """Size of cells, m, that a member wants at points (n, 3) of its own frame, within it and around it."""
    x, y, z = local.T
    half_y, half_z = shape.half(x)
    if shape.is_round:
        across = np.maximum(np.hypot(y, z) - half_y, 0.0)
    else:
        across = np.hypot(np.maximum(np.abs(y) - half_y, 0.0), np.maximum(np.abs(z) - half_z, 0.0))
    away = np.hypot(np.maximum(np.maximum(-x, x - shape.length), 0.0), across)
    return size * _own_size(shape, x) + GROWTH * away


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
        local = np.stack([x, 0 * x, 0 * x], axis=-1)
        others = [_wanted(o.outline, o.local(member.placed(local)), size) for o in group]
        points += 1.7 * float(np.trapezoid(area / (0.118 * np.min(others, axis=0) ** 3), x))
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
        bad = cells[jacobians(points, cells)[0] < WORST]
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
