"""Members as boundary representations in gmsh's OpenCASCADE kernel, in millimetres."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import combinations, pairwise
from pathlib import Path
from types import ModuleType

import numpy as np

from flexura.arrays import Array
from flexura.errors import ModelError, Problem, SolverError
from flexura.extras import need
from flexura.solid.geometry.contours import MODELLED, Outline
from flexura.solid.geometry.members import MemberSolid
from flexura.tables import quantity

Entity = tuple[int, int]

MILLIMETRE = 1e-3
OVERLAP = 1e-3
"""Share of the smaller member's volume that another may take up before they count as intersecting."""
BURIED = 0.6
"""The same share for members that meet at a node, whose corners may overlap."""


@contextmanager
def session() -> Iterator[ModuleType]:
    """A quiet gmsh session of its own, left as it was found.

    Within an open session of the caller a model is added and removed again. Raises OptionError when gmsh is missing and
    SolverError for whatever gmsh reports.
    """
    gmsh = need("gmsh", "solid")
    own = not gmsh.isInitialized()
    before = "" if own else gmsh.model.getCurrent()
    kept: dict[str, float] = {}
    if own:
        gmsh.initialize([], readConfigFiles=False, run=False, interruptible=False)
    try:
        for option, value in _OPTIONS.items():
            kept[option] = gmsh.option.getNumber(option)
            gmsh.option.setNumber(option, value)
        gmsh.model.add("flexura")
        try:
            yield gmsh
        except Exception as error:
            if type(error) is Exception:
                raise SolverError(
                    f"gmsh: {error}; change sizes of the parts that touch, or the size of the mesh"
                ) from None
            raise
    finally:
        if own:
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


def runs(shape: Outline, half: Array) -> list[Array]:
    """The outline of a contour as runs of points (n, 2), m: along x at +half, back at -half, and both end lines."""
    there = [np.stack([shape.x[a : b + 1], half[a : b + 1]], axis=-1) for a, b in pairwise(shape.breaks)]
    back = [(run * [1.0, -1.0])[::-1] for run in reversed(there)]
    last, first = there[-1][-1], there[0][0]
    return [*there, np.array([last, last * [1.0, -1.0]]), *back, np.array([first * [1.0, -1.0], first])]


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
        upper = [np.stack([shape.x[a : b + 1], shape.z[a : b + 1]], axis=-1) for a, b in pairwise(shape.breaks)]
        end, start = upper[-1][-1], upper[0][0]
        axis = [np.array([end, [end[0], 0]]), np.array([[end[0], 0], [start[0], 0]]), np.array([[start[0], 0], start])]
        wire = outline(gmsh, [placed(run[:, 0], 0.0, run[:, 1]) for run in (*upper, *axis)])
        face = occ.addPlaneSurface([wire])
        made = occ.revolve([(2, face)], *placed(0.0, 0.0, 0.0), *along, 2 * math.pi)
        return only_volume(made)
    y = float(shape.y.max())
    wire = outline(gmsh, [placed(run[:, 0], -y, run[:, 1]) for run in runs(shape, shape.z)])
    made = occ.extrude([(2, occ.addPlaneSurface([wire]))], *(2 * y * member.axes[1] / MILLIMETRE))
    first = only_volume(made)
    if np.ptp(shape.y) <= 1e-9 * y:
        return first
    z = float(shape.z.max())
    wire = outline(gmsh, [placed(run[:, 0], run[:, 1], -z) for run in runs(shape, shape.y)])
    made = occ.extrude([(2, occ.addPlaneSurface([wire]))], *(2 * z * member.axes[2] / MILLIMETRE))
    common, _ = occ.intersect([(3, first)], [(3, only_volume(made))])
    return only_volume(common)


def only_volume(made: Iterable[Entity]) -> int:
    """The tag of the volume among what was made. Raises SolverError unless there is exactly one."""
    volumes = [tag for dim, tag in made if dim == 3]
    if len(volumes) != 1:
        raise SolverError(f"a solid became {len(volumes)} volumes instead of one; its contour is too sharp")
    return volumes[0]


def check_volumes(gmsh: ModuleType, members: Sequence[MemberSolid], tags: Sequence[int], tolerance: float) -> None:
    """Compare volumes with the integrals of the members' areas. Raises SolverError beyond a relative tolerance."""
    for member, tag in zip(members, tags, strict=True):
        found = gmsh.model.occ.getMass(3, tag) * MILLIMETRE**3
        if not abs(found / member.volume - 1) <= tolerance:
            raise SolverError(
                f"{member.name}: its solid has {quantity(found, 'm^3', 6)}"
                f" where its sections give {quantity(member.volume, 'm^3', 6)}"
            )


def check_intersections(members: Sequence[MemberSolid]) -> None:
    """Refuse members that take up the same space without meeting at a node, or most of it where they do.

    Members that touch, or that are carried by one body, may lie side by side. Raises ModelError naming all pairs.
    gmsh is needed where bounding boxes overlap.
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
        share = float(large.outline.holds(large.local(small.samples()), 0.0).mean())
        if share > BURIED:
            clashes.append(_clash(one, other, share * small.volume))
    if apart:
        with session() as gmsh:
            clashes += _clashes(gmsh, apart)
    if clashes:
        raise ModelError(clashes)


def _clashes(gmsh: ModuleType, pairs: Sequence[tuple[MemberSolid, MemberSolid]]) -> list[Problem]:
    occ = gmsh.model.occ
    found: list[Problem] = []
    tag_of = {
        name: volume(gmsh, member, modelled(member)) for name, member in {m.name: m for p in pairs for m in p}.items()
    }
    for one, other in pairs:
        shared, _ = occ.intersect(
            [(3, tag_of[one.name])], [(3, tag_of[other.name])], removeObject=False, removeTool=False
        )
        common = sum(occ.getMass(3, tag) for dim, tag in shared if dim == 3) * MILLIMETRE**3
        occ.remove(shared, recursive=True)
        if common > OVERLAP * min(one.volume, other.volume):
            found.append(_clash(one, other, common))
    return found


def _boxes_overlap(one: MemberSolid, other: MemberSolid) -> bool:
    shared = np.minimum(one.box[1], other.box[1]) - np.maximum(one.box[0], other.box[0])
    return bool((shared > 1e-6 * min(one.length, other.length)).all()) and _near(one, other)


def modelled(member: MemberSolid) -> Outline:
    """The shape that the kernel can handle: that of the member, without the thinnest tips where two contours cross."""
    return member.outline.blunted(MODELLED) if member.shape.kind[0] == "two_axis" else member.outline


def write(gmsh: ModuleType, path: Path) -> None:
    """Write the model to a file, without what the kernel prints on the way."""
    sys.stdout.flush()
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        gmsh.write(str(path))
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def _near(a: MemberSolid, b: MemberSolid) -> bool:
    """Whether the boxes around two members overlap along all axes of both (separating planes of their faces)."""
    for one, other in ((a, b), (b, a)):
        y, z, L = one.outline.y.max(), one.outline.z.max(), one.length
        low, high = np.array([0.0, -y, -z]), np.array([L, y, z])
        yo, zo = other.outline.y.max(), other.outline.z.max()
        corners = np.array([[x, s * yo, t * zo] for x in (0.0, other.length) for s in (-1, 1) for t in (-1, 1)])
        local = one.local(other.placed(corners))
        margin = 1e-6 * min(y, z)
        if (local.min(axis=0) >= high - margin).any() or (local.max(axis=0) <= low + margin).any():
            return False
    return True


def _clash(one: MemberSolid, other: MemberSolid, common: float) -> Problem:
    return Problem(
        path=(one.name,),
        value=f"{common * 1e9:.4g} mm^3 in common with {other.name}",
        rule="two members do not take up the same space but for corners where they meet at a node",
        hint="move them apart, or join the nodes at which they are one part",
    )
