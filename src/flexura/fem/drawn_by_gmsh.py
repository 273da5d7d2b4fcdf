"""Members and bodies as gmsh draws them for its meshes, in millimetres."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from types import ModuleType

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import SolverError, need
from flexura.fem.geometry import MILLIMETRE, MemberSolid, Outline
from flexura.fem.occ import NOTHING, ShapeError
from flexura.structure import Pieces
from flexura.tables import quantity

Entity = tuple[int, int]


@contextmanager
def session() -> Iterator[ModuleType]:
    """A quiet gmsh session of its own, left as it was found.

    Within an open session of the caller a model is added and removed again. Raises OptionError when gmsh is missing and
    SolverError for whatever gmsh reports.
    """
    gmsh = need("gmsh", "solid")
    is_new = not gmsh.isInitialized()
    before = "" if is_new else gmsh.model.getCurrent()
    kept: dict[str, float] = {}
    if is_new:
        gmsh.initialize([], readConfigFiles=False, run=False, interruptible=False)
    try:
        for option, value in _OPTIONS.items():
            kept[option] = gmsh.option.getNumber(option)
            gmsh.option.setNumber(option, value)
        gmsh.model.add("flexura")
        try:
            yield gmsh
        except Exception as error:
            if type(error) is not Exception:  # as which gmsh raises all that it reports
                raise
            raise SolverError(f"gmsh: {error}; change sizes of the parts that touch, or the size of the mesh") from None
    finally:
        if is_new:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent("flexura")
            gmsh.model.remove()
            for option, value in kept.items():
                gmsh.option.setNumber(option, value)
            if before:
                gmsh.model.setCurrent(before)


_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.RandomSeed": 1,
    "Mesh.SecondOrderLinear": 0,
    "Mesh.TransfiniteTri": 0,
    "Mesh.Algorithm": 6,
    "Mesh.Algorithm3D": 1,
    "Mesh.MeshSizeMin": 0,
    "Mesh.MeshSizeMax": 1e22,
    "Mesh.SubdivisionAlgorithm": 0,
    "Mesh.HighOrderPassMax": 5,
    "Geometry.OCCBoundsUseStl": 0,
}


def outline(gmsh: ModuleType, points: Sequence[Array]) -> int:
    """A closed wire through runs of points (n, 3), mm: a line where a run has two or all are in line, else a spline.

    Each run starts where the one before it ended.
    """
    occ = gmsh.model.occ
    first = [occ.addPoint(*run[0]) for run in points]
    curves = []
    for run, a, b in zip(points, first, [*first[1:], first[0]], strict=True):
        along = run[-1] - run[0]
        off = np.linalg.norm(np.cross(run - run[0], along), axis=1).max() / (along @ along)
        if len(run) == 2 or off < 1e-9:
            curves.append(occ.addLine(a, b))
        else:
            curves.append(occ.addSpline([a, *(occ.addPoint(*p) for p in run[1:-1]), b]))
    return occ.addCurveLoop(curves)


def volume(gmsh: ModuleType, member: MemberSolid, shape: Outline) -> int:
    """The member with `shape` as one volume."""
    occ = gmsh.model.occ

    def placed(x: Array | float, y: Array | float, z: Array | float) -> Array:
        return member.placed(np.stack(np.broadcast_arrays(x, y, z), axis=-1)) / MILLIMETRE

    along = member.axes[0] / MILLIMETRE
    if shape.family in ("circle", "tube"):
        base = [*placed(0.0, 0.0, 0.0), *(shape.length * along)]
        outer = occ.addCylinder(*base, float(shape.y[0]) / MILLIMETRE)
        if shape.inner == 0:
            return outer
        inner = occ.addCylinder(*base, shape.inner / MILLIMETRE)
        return occ.cut([(3, outer)], [(3, inner)])[0][0][1]
    if shape.family == "round":
        wire = outline(gmsh, [placed(run[:, 0], 0.0, run[:, 1]) for run in shape.meridian()])
        face = occ.addPlaneSurface([wire])
        made = occ.revolve([(2, face)], *placed(0.0, 0.0, 0.0), *along, 2 * math.pi)
        return only_volume(made)
    y = float(shape.y.max())
    wire = outline(gmsh, [placed(run[:, 0], -y, run[:, 1]) for run in shape.runs(shape.z)])
    made = occ.extrude([(2, occ.addPlaneSurface([wire]))], *(2 * y * member.axes[1] / MILLIMETRE))
    first = only_volume(made)
    if np.ptp(shape.y) <= 1e-9 * y:
        return first
    z = float(shape.z.max())
    wire = outline(gmsh, [placed(run[:, 0], run[:, 1], -z) for run in shape.runs(shape.y)])
    made = occ.extrude([(2, occ.addPlaneSurface([wire]))], *(2 * z * member.axes[2] / MILLIMETRE))
    common, _ = occ.intersect([(3, first)], [(3, only_volume(made))])
    return only_volume(common)


def first_owners(pieces: Sequence[Sequence[Entity]], dim: int) -> dict[int, int]:
    """For every entity of a dimension, by tag, the first of some shapes that it is a fragment of."""
    owner: dict[int, int] = {}
    for k, fragments in enumerate(pieces):
        for tag in (tag for own_dim, tag in fragments if own_dim == dim):
            owner.setdefault(tag, k)
    return owner


def elements(gmsh: ModuleType, kind: int, count: int, owner: Mapping[int, int]) -> tuple[Array, Index, Index]:
    """Points (n, 3), m, elements (c, count) of a kind of gmsh's of some entities by tag, and the owner (c,) of each."""
    cells = {tag: np.reshape(gmsh.model.mesh.getElementsByType(kind, tag)[1], (-1, count)) for tag in owner}
    used, connected = np.unique(np.concatenate(list(cells.values())).astype(np.intp), return_inverse=True)
    numbers, flat, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(numbers)
    points = flat.reshape(-1, 3)[order[np.searchsorted(numbers[order], used)]] * MILLIMETRE
    owners = np.repeat(list(owner.values()), [len(of_entity) for of_entity in cells.values()])
    return points, connected.reshape(-1, count), owners


def only_volume(made: Iterable[Entity]) -> int:
    """The tag of the volume among what was made. Raises SolverError unless there is exactly one."""
    volumes = [tag for dim, tag in made if dim == 3]
    if len(volumes) != 1:
        raise SolverError(f"a solid became {len(volumes)} volumes instead of one; its contour is too sharp")
    return volumes[0]


def check_volumes(gmsh: ModuleType, members: Sequence[MemberSolid], tags: Sequence[int], tolerance: float) -> None:
    """Compare volumes with the integrals of the members' areas. Raises SolverError beyond a relative tolerance."""
    for member, tag in zip(members, tags, strict=True):
        in_kernel = gmsh.model.occ.getMass(3, tag) * MILLIMETRE**3
        if not abs(in_kernel / member.volume - 1) <= tolerance:
            rule = f"{member.name}: its solid has {quantity(in_kernel, 'm^3', 6)}"
            raise SolverError(f"{rule} where its sections give {quantity(member.volume, 'm^3', 6)}")


def _primitive(
    gmsh: ModuleType, centre: Array, axes: Array, half: Array, is_round: bool, outline_of: Array | None = None
) -> int:
    """A box, a cylinder about its first axis, or a prism of corners (n, 2), of half sizes (3,), m, with right-handed
    axes (3, 3) as rows."""
    x, y, z = 2 * half[:, None] * axes / MILLIMETRE
    corner = centre / MILLIMETRE - (x + y + z) / 2
    if is_round:
        return gmsh.model.occ.addCylinder(*(corner + (y + z) / 2), *x, float(half[1]) / MILLIMETRE)
    if outline_of is not None:
        base = (centre - half[2] * axes[2] + outline_of @ axes[:2]) / MILLIMETRE
        sides = [np.array(side) for side in pairwise([*base, base[0]])]
        return only_volume(gmsh.model.occ.extrude([(2, gmsh.model.occ.addPlaneSurface([outline(gmsh, sides)]))], *z))
    corners = [corner, corner + x, corner + x + y, corner + y, corner]
    face = gmsh.model.occ.addPlaneSurface([outline(gmsh, [np.array(side) for side in pairwise(corners)])])
    return only_volume(gmsh.model.occ.extrude([(2, face)], *z))


def composite_volume(gmsh: ModuleType, pieces: Pieces) -> int:
    """A composite as one volume, mm. Raises ShapeError where it is none."""
    model = gmsh.model.occ
    columns = pieces.centre, pieces.axes, pieces.half, pieces.is_round
    forms = enumerate(zip(*columns, strict=True))
    tags = [_primitive(gmsh, *piece, outline_of=pieces.outlines.get(k)) for k, piece in forms]
    made = [(3, tags[0])]
    if pieces.added > 1:
        made, origin = model.fuse(made, [(3, tag) for tag in tags[1 : pieces.added]])
        if len(made) > 1:
            loose = next(k for k, of_piece in enumerate(origin) if origin[0][0] not in of_piece)
            hint = "let it share a face or a volume with the others"
            raise ShapeError(("add", loose), "", "the piece does not touch the first one, or along an edge alone", hint)
    for k, tag in enumerate(tags[pieces.added :]):
        before = model.getMass(*made[0])
        made, _ = model.cut(made, [(3, tag)])
        made = [entity for entity in made if entity[0] == 3]
        place = "cut", k
        if not made:
            raise ShapeError(place, "", "nothing of the solid is left", "cut less, or add more")
        if len(made) > 1:
            raise ShapeError(place, "", f"it cuts the solid into {len(made)} parts", "let them hang together")
        if before - model.getMass(*made[0]) <= NOTHING * before:
            rule = "it cuts nothing away: it lies beside what is added"
            raise ShapeError(place, "", rule, "move it, or leave it out")
    return int(made[0][1])
