"""Members and bodies as boundary representations of OpenCASCADE by netgen, in millimetres, and STEP files of them.

A STEP file has members and those rigid bodies that have a form, as named solids.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import reduce
from itertools import combinations, pairwise
from operator import add
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import ModelError, OptionError, Problem, SolverError, need
from flexura.fem.geometry import MILLIMETRE, BodySolid, MemberSolid, Outline, body_solids, filleted, joints, solids
from flexura.files import complete_file
from flexura.structure import FullOrderModel, Pieces
from flexura.tables import quantity

OVERLAP = 1e-3
"""Share of the smaller member's volume that another may take up before they count as intersecting."""
BURIED = 0.6
"""The same share for members that meet at a node, whose corners may overlap."""


NOTHING = 1e-9
"""Share of the volume below which nothing is cut away."""

GRADING = 0.4
"""How fast tetrahedra grow away from fine places (netgen's own measure)."""

ORDER = (0, 2, 1, 3, 5, 7, 4, 6, 9, 8)
"""Points of a tetrahedron in netgen's order for those of VTK."""


@contextmanager
def kernel() -> Iterator[ModuleType]:
    """OpenCASCADE by netgen. Raises OptionError where that is missing and SolverError for whatever it reports."""
    occ = need("netgen.occ", "solid")
    try:
        yield occ
    except (RuntimeError, occ.OCCException) as error:
        text = " ".join(str(error).split())[:200]
        raise SolverError(f"OpenCASCADE: {text}; change sizes of the parts that touch") from None


def plane_face(occ: ModuleType, runs: Sequence[Array]) -> Any:
    """A plane face within runs of points (n, 3), mm, that join: lines, arcs where the points lie on a circle, else
    splines."""
    edges = []
    for run in runs:
        points = [occ.gp_Pnt(*p) for p in run]
        along = run[-1] - run[0]
        off = np.linalg.norm(np.cross(run - run[0], along), axis=1).max() / (along @ along)
        if len(run) == 2 or off < 1e-9:
            edges.append(occ.Segment(points[0], points[-1]))
        elif _is_arc(run):
            edges.append(occ.ArcOfCircle(points[0], points[len(run) // 2], points[-1]))
        else:
            edges.append(occ.SplineApproximation(points, occ.ApproxParamType.IsoParametric, deg_max=3))
    return occ.Face(occ.Wire(edges))


def _is_arc(run: Array) -> bool:
    """Whether points (n, 3) lie on one circle."""
    a, b = run[len(run) // 2] - run[0], run[-1] - run[0]
    normal = np.cross(a, b)
    centre = run[0] + np.cross(a @ a * b - b @ b * a, normal) / (2 * normal @ normal)
    radius = np.linalg.norm(run - centre, axis=1)
    return bool(np.ptp(radius) < 1e-9 * radius[0])


def member_shape(occ: ModuleType, member: MemberSolid, shape: Outline | None = None) -> Any:
    """The member, with an outline of its own or another one."""
    shape = shape or member.outline
    start, along, length = member.start / MILLIMETRE, member.axes[0], shape.length / MILLIMETRE
    if shape.family in ("circle", "tube"):
        outer, inner = (
            occ.Cylinder(occ.gp_Pnt(*start), occ.gp_Vec(*along), radius / MILLIMETRE, length) if radius else None
            for radius in (float(shape.y[0]), shape.inner)
        )
        return outer - inner if inner else outer

    def placed(x: Array | float, y: Array | float, z: Array | float) -> Array:
        return member.placed(np.stack(np.broadcast_arrays(x, y, z), axis=-1)) / MILLIMETRE

    if shape.family == "round":
        face = plane_face(occ, [placed(run[:, 0], 0.0, run[:, 1]) for run in shape.meridian()])
        return face.Revolve(occ.Axis(occ.gp_Pnt(*start), occ.gp_Vec(*along)), 360)
    y, z = float(shape.y.max()), float(shape.z.max())
    runs = member.profile() if any(map(any, member.fillets)) else shape.runs(shape.z)
    face = plane_face(occ, [placed(run[:, 0], -y, run[:, 1]) for run in runs])
    solid = face.Extrude(occ.gp_Vec(*(2 * y / MILLIMETRE * member.axes[1])))
    if np.ptp(shape.y) > 1e-9 * y:
        face = plane_face(occ, [placed(run[:, 0], run[:, 1], -z) for run in shape.runs(shape.y)])
        solid = solid * face.Extrude(occ.gp_Vec(*(2 * z / MILLIMETRE * member.axes[2])))
    return solid


def box_shape(occ: ModuleType, centre: Array, axes: Array, half: Array) -> Any:
    """A box about a centre (3,), with half sizes (3,), mm, along right-handed axes (3, 3) as rows."""
    corner = centre - half @ axes
    plane = occ.WorkPlane(occ.Axes(occ.gp_Pnt(*corner), n=occ.gp_Vec(*axes[2]), h=occ.gp_Vec(*axes[0])))
    return plane.Rectangle(float(2 * half[0]), float(2 * half[1])).Face().Extrude(float(2 * half[2]))


def body_shape(occ: ModuleType, body: BodySolid) -> Any:
    """A body. Raises SolverError for a composite that is no solid."""
    if body.pieces is None:
        return _form(occ, body.centre, body.axes, body.half, body.is_round)
    try:
        return composite_shape(occ, body.pieces)
    except ShapeError as error:
        raise SolverError(f"{body.name}: {error}") from None


def _form(
    occ: ModuleType, centre: Array, axes: Array, half: Array, is_round: bool, outline: Array | None = None
) -> Any:
    """A box, a cylinder about its first axis, or a prism of corners (n, 2), of half sizes (3,), m, with right-handed
    axes (3, 3) as rows."""
    centre, half = centre / MILLIMETRE, half / MILLIMETRE
    if outline is not None:
        base = centre - half[2] * axes[2] + outline / MILLIMETRE @ axes[:2]
        face = plane_face(occ, [np.stack(side) for side in pairwise([*base, base[0]])])
        return face.Extrude(occ.gp_Vec(*(2 * half[2] * axes[2])))
    if not is_round:
        return box_shape(occ, centre, axes, half)
    base, along = occ.gp_Pnt(*(centre - half[0] * axes[0])), occ.gp_Vec(*axes[0])
    return occ.Cylinder(base, along, float(half[1]), 2 * float(half[0]))


class ShapeError(Exception):
    """A composite that is no solid: where in it, what stands there, the rule and a hint."""

    def __init__(self, path: tuple[str | int, ...], value: str, rule: str, hint: str) -> None:
        super().__init__(rule)
        self.path: tuple[str | int, ...] = path
        self.value: str = value
        self.rule: str = rule
        self.hint: str = hint


def composite_shape(occ: ModuleType, pieces: Pieces) -> Any:
    """A composite as one solid. Raises ShapeError where it is none."""
    columns = pieces.centre, pieces.axes, pieces.half, pieces.is_round
    forms = enumerate(zip(*columns, strict=True))
    made = [_form(occ, *piece, outline=pieces.outlines.get(k)) for k, piece in forms]
    solid, loose = made[0], list(range(1, pieces.added))
    while loose:
        both = ((k, solid + made[k]) for k in loose)
        k, solid = next(((k, whole) for k, whole in both if len(list(whole.solids)) == 1), (0, solid))
        if not k:
            hint = "let it share a face or a volume with the others"
            rule = "the piece does not touch the first one, or along an edge alone"
            raise ShapeError(("add", loose[0]), "", rule, hint)
        loose.remove(k)
    for k, away in enumerate(made[pieces.added :]):
        before, solid = float(solid.mass), solid - away
        place, parts = ("cut", k), len(list(solid.solids))
        if not parts:
            raise ShapeError(place, "", "nothing of the solid is left", "cut less, or add more")
        if parts > 1:
            raise ShapeError(place, "", f"it cuts the solid into {parts} parts", "let them hang together")
        if before - solid.mass <= NOTHING * before:
            rule = "it cuts nothing away: it lies beside what is added"
            raise ShapeError(place, "", rule, "move it, or leave it out")
    return only_solid(solid)


def only_solid(shape: Any) -> Any:
    """The solid of a shape. Raises SolverError unless there is exactly one."""
    found = list(shape.solids)
    if len(found) != 1:
        raise SolverError(f"a solid became {len(found)} volumes instead of one; its contour is too sharp")
    return found[0]


def tetrahedra(
    occ: ModuleType, shape: Any, longest: float, around: float, fine: tuple[Array, Array] | None = None
) -> tuple[Array, Index, Index]:
    """Points (n, 3), m, ten-node tetrahedra (c, 10) that follow the faces, and the solid (c,) of each by its place.

    Cells are at most `longest` long, m, and `around` of them make a full circle; `fine` are places (k, 3), m, at which
    they are as short as given (k,), m. Raises SolverError where netgen makes none.
    """
    meshing = need("netgen.meshing", "solid")
    parameters = meshing.MeshingParameters(
        maxh=longest / MILLIMETRE, grading=GRADING, curvaturesafety=around / (2 * np.pi)
    )
    places, sizes = fine or (np.empty((0, 3)), np.empty(0))
    for (x, y, z), h in zip((places / MILLIMETRE).tolist(), (sizes / MILLIMETRE).tolist(), strict=True):
        parameters.RestrictH(x=x, y=y, z=z, h=h)
    try:
        mesh = occ.OCCGeometry(shape).GenerateMesh(parameters)
        mesh.SecondOrder()
    except meshing.NgException as error:
        raise SolverError(f"netgen: {error}; change the size of the mesh, or of the parts that touch") from None
    cells = mesh.Elements3D().NumPy()
    ten = cells["nodes"].astype(np.intp)[:, ORDER] - 1
    return np.array(mesh.Coordinates()) * MILLIMETRE, ten, cells["index"].astype(np.intp) - 1


def check_volumes(members: Sequence[MemberSolid], shapes: Sequence[Any], tolerance: float) -> None:
    """Compare volumes with the integrals of the members' areas. Raises SolverError beyond a relative tolerance."""
    for member, shape in zip(members, shapes, strict=True):
        in_kernel = float(shape.mass) * MILLIMETRE**3
        if not abs(in_kernel / member.volume - 1) <= tolerance:
            rule = f"{member.name}: its solid has {quantity(in_kernel, 'm^3', 6)}"
            raise SolverError(f"{rule} where its sections give {quantity(member.volume, 'm^3', 6)}")


def check_intersections(members: Sequence[MemberSolid]) -> None:
    """Refuse members that take up the same space without meeting at a node, or most of it where they do.

    Members that touch, or that are carried by one body, may lie side by side. Raises ModelError naming all pairs.
    netgen is needed where bounding boxes overlap.
    """
    clashes: list[Problem] = []
    apart: list[tuple[MemberSolid, MemberSolid]] = []
    for one, other in combinations(members, 2):
        if not _boxes_overlap(one, other):
            continue
        if not set(one.roots) & set(other.roots):
            apart.append((one, other))
            continue
        small, large = sorted((one, other), key=lambda member: member.volume)
        share = float(large.holds(small.samples(), 0.0).mean())
        if share > BURIED:
            clashes.append(_clash(one, other, share * small.volume))
    if apart:
        with kernel() as occ:
            shape_of = {m.name: member_shape(occ, m) for m in {m.name: m for p in apart for m in p}.values()}
            for one, other in apart:
                common = float((shape_of[one.name] * shape_of[other.name]).mass) * MILLIMETRE**3
                if common > OVERLAP * min(one.volume, other.volume):
                    clashes.append(_clash(one, other, common))
    if clashes:
        raise ModelError(clashes)


def _boxes_overlap(one: MemberSolid, other: MemberSolid) -> bool:
    """Whether the boxes around two members overlap, along the global axes and those of both."""
    shared = np.minimum(one.box[1], other.box[1]) - np.maximum(one.box[0], other.box[0])
    if (shared <= 1e-6 * min(one.length, other.length)).any():
        return False
    for a, b in ((one, other), (other, one)):
        half = np.array([a.length / 2, a.outline.y.max(), a.outline.z.max()])
        corners = a.local(b.corners) - [a.length / 2, 0.0, 0.0]
        margin = 1e-6 * half[1:].min()
        if (corners.min(axis=0) >= half - margin).any() or (corners.max(axis=0) <= margin - half).any():
            return False
    return True


def _clash(one: MemberSolid, other: MemberSolid, common: float) -> Problem:
    return Problem(
        path=(one.name,),
        value=f"{common * 1e9:.4g} mm^3 in common with {other.name}",
        rule="two members do not take up the same space but for corners where they meet at a node",
        hint="move them apart, or join the nodes at which they are one part",
    )


@verb
def write_step(model: FullOrderModel, path: str | Path, *, only: str | None = None) -> Path:
    """Write members and bodies as named solids to a STEP file, in millimetres.

    Members that are one piece are one solid, `leaf1 + arm1`. Bodies that have a form are solids of their own, which may
    overlap members on them; those of mass and inertia alone, point masses, diaphragms, flat springs and rigid arms have
    none. The file appears complete or not at all. `only` is the path of an instance or member. Raises OptionError when
    the file cannot be written or a section has no solid, ModelError when members intersect, and SolverError when a
    solid has not the volume of its member.
    """
    if Path(path).suffix.lower() not in (".step", ".stp"):
        raise OptionError(f"{path}: a STEP file is named .step or .stp")
    members = filleted(model, solids(model, only))
    bodies = body_solids(model, only)
    groups = joints(model, members).groups
    check_intersections(members)
    with complete_file(path) as temporary, kernel() as occ:
        shapes = [member_shape(occ, member) for member in members]
        check_volumes(members, shapes, 1e-3)
        named = {
            " + ".join(members[k].name for k in group): reduce(add, (shapes[k] for k in group)) for group in groups
        }
        made = []
        for name, shape in {**named, **{body.name: body_shape(occ, body) for body in bodies}}.items():
            made.append(only_solid(shape))
            made[-1].name = name
        occ.Compound(made).WriteStep(str(temporary))
        text = temporary.read_text(encoding="utf-8")
        temporary.write_text(_finished(text, model.plan.mechanism.name or "mechanism"), encoding="ascii")
    return Path(path)


_PRODUCT = re.compile(r"PRODUCT\('Open CASCADE[^']*',\s*'[^']*'")


def _finished(text: str, whole: str) -> str:
    """The file with the name of the whole in the place of the kernel's own, and characters by number where they are not
    ASCII, as ISO 10303-21 has it. Raises OSError where its end is missing, as on a full disk."""
    if "END-ISO-10303-21;" not in text:
        raise OSError("the file is not complete")
    plain = " ".join(whole.split()).replace("\\", "\\\\").replace("'", "''")
    named = _PRODUCT.sub(lambda _: f"PRODUCT('{plain}','{plain}'", text, count=1)
    return "".join(c if c.isascii() else f"\\X4\\{ord(c):08X}\\X0\\" for c in named)
