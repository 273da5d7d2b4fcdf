"""Parts from CAD or of meshes: their solids and faces, STEP files read by OpenCASCADE, and which faces are meant.

Lengths are in metres in whatever unit the file is; meshes and shapes of netgen are in millimetres.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError, did_you_mean, need
from flexura.fem.cache import content_key
from flexura.fem.geometry import MILLIMETRE
from flexura.fem.given_meshes import given_mesh
from flexura.fem.mesh_files import BULK, DECKS
from flexura.files import read_bytes, scratch_folder
from flexura.mechanism import MESH_UNITS, Interface
from flexura.outlines import Outline, Segment, read_dxf, read_svg
from flexura.results import Tabular
from flexura.tables import Facts, Item, Table, counted, in_mm, number, quantity

ROUGH = 1e-5
"""Distance of points from a plane or a cylinder, over the size of the part, up to which they lie on it."""

ALONG = 1e-3
"""Sine of the angle between directions up to which they are one."""

COARSE = 8.0
"""Size of a part over that of the triangles by which its faces are shown."""

SMALLEST, LARGEST = 1e-4, 30.0
"""Sizes of parts, m, beyond which the unit of a file is doubted."""

OVERLAPPING = 1e-6
"""Common volume of two solids over that of the smaller one, above which they overlap."""

JOINS = " + "
"""What stands between names of faces and solids that have several, as in sets of meshes."""

MESHES = (*DECKS, *BULK, ".med", ".vtu", ".vtk", ".msh", ".mesh")
"""Names of files that are meshes; with a unit of length others are, too."""

MOST_FITTED = 500
"""Points of a face by which a cylinder is fitted, about."""

MOST_LISTED = 12

PLAIN = re.compile(r"[^\W\d][\w .-]*(?<! )")
"""Names that YAML takes for text without quotation marks."""

NO_LAYERS = ("", "0")
"""Layers of drawings that name nothing."""

NO_NAMES = ("", "NONE")
"""Names of faces and solids that are none: some programs call every face NONE."""


@dataclass(frozen=True)
class PartFace:
    """A face of a part: its `number`, from 1, name and colour in the file, and `solid`, by its name.

    `kind` is plane, cylinder or other; `area`, m^2; `centre` (3,), m; `direction` (3,), of a plane outwards, of a
    cylinder along its axis; `radius`, m, of a cylinder; `triangles` (t, 3, 3), m, their corners from outside
    anticlockwise.
    """

    number: int
    name: str
    colour: str
    solid: str
    kind: str
    area: float
    centre: Array
    direction: Array | None
    radius: float | None
    triangles: Array = field(repr=False)

    @property
    def form(self) -> str:
        """Its kind in words."""
        if self.direction is None:
            return self.kind
        along = _axis(self.direction)
        return f"cylinder {quantity(self.radius, 'm', 5)}" if self.radius else f"plane {along}".strip()

    @property
    def text(self) -> str:
        """What chooses it in a file, by name or number."""
        is_plain = PLAIN.fullmatch(self.name) and self.name not in ("true", "false", "null")
        name = self.name if is_plain else json.dumps(self.name, ensure_ascii=False)
        return f"{{face: {name if self.name else self.number}}}"

    @property
    def choices(self) -> dict[str, Interface]:
        """What chooses it in a file, and what that says: by name or number, then by its plane, or its radius, which
        may choose others with it."""
        found: dict[str, dict[str, Any]] = {self.text: {"face": self.name or self.number}}
        if self.radius:
            radius = float(f"{self.radius:.6g}")
            found[f"{{radius: {quantity(radius, 'm', 6)}}}"] = {"radius": radius}
        elif self.direction is not None:
            normal = np.round(self.direction, 6).tolist()
            if along := _axis(self.direction):
                at = round(float(self.centre["xyz".index(along[1])]), 12)
                found[f"{{{along[1]}: {quantity(at, 'm', 9)}, normal: {along}}}"] = {along[1]: at, "normal": normal}
            else:
                found[f"{{normal: [{', '.join(number(x, 6) for x in normal)}]}}"] = {"normal": normal}
        return {text: Interface(**given) for text, given in found.items()}


@dataclass(frozen=True, repr=False)
class Drawing(Tabular):
    """What a file has of a part: `faces` on the outside, `solids` by name, in order, and the `shape` of OpenCASCADE, or
    the mesh of others.

    Solids that touch are glued. `size`, m, is the diagonal of the box around it; `digest` that of the file; `notes` say
    what was mended or left out. `order` holds the places of `faces` among all those of the shape; `outline` and
    `thickness`, m, are those of a planar part. `empty` are names of sets of a mesh that have no outer side, with what
    they hold.
    """

    path: str
    shape: Any = field(repr=False)
    solids: tuple[str, ...]
    faces: tuple[PartFace, ...]
    box: Array
    digest: str
    order: tuple[int, ...] = field(repr=False)
    notes: tuple[str, ...] = ()
    outline: Outline | None = field(default=None, repr=False)
    thickness: float | None = None
    empty: Mapping[str, str] = field(default_factory=dict, repr=False)

    def presentation(self) -> Iterator[Item]:
        """Solids, and a row for every face with the text that chooses it."""
        low, high = self.box
        size = " x ".join(quantity(float(x), "m", 5) for x in high - low)
        facts = {"solids": ", ".join(self.solids[:MOST_LISTED]), "faces": len(self.faces), "size": size}
        yield Facts({**facts, "corner": in_mm(low) + " mm"})
        yield Table(self._columns(), "faces")

    def _title(self) -> str:
        return f"{len(self.faces)} faces"

    @property
    def name(self) -> str:
        """That of the file."""
        return Path(self.path).name

    def _columns(self) -> dict[str, Any]:
        faces = self.faces
        return {
            "face": [face.number for face in faces],
            "name": [face.name for face in faces],
            "colour": [face.colour for face in faces],
            **({"solid": [face.solid for face in faces]} if len(self.solids) > 1 else {}),
            "kind": [face.form for face in faces],
            "area [mm^2]": [1e6 * face.area for face in faces],
            "middle [mm]": [in_mm(face.centre) for face in faces],
        }

    def _data(self) -> dict[str, Any]:
        return {
            "path": self.path,
            "solids": self.solids,
            "box": self.box,
            "faces": [
                {
                    "number": face.number,
                    "name": face.name,
                    "colour": face.colour,
                    "solid": face.solid,
                    "kind": face.kind,
                    "area": face.area,
                    "centre": face.centre,
                    "direction": face.direction,
                    "radius": face.radius,
                    "text": face.text,
                }
                for face in self.faces
            ],
        }

    @property
    def size(self) -> float:
        """Diagonal of the box around it, m."""
        return float(np.linalg.norm(self.box[1] - self.box[0]))

    def chosen(self, choice: Interface) -> list[PartFace]:
        """The faces that are meant. Raises OptionError where there are none, with those that are near."""
        given: Any = choice  # numbers, no expressions
        found = list(self.faces) if choice.face is None else self._named(choice.face)
        if choice.colour is not None:
            colours = sorted({face.colour for face in self.faces if face.colour})
            fits = [face.colour == choice.colour.lower() for face in found]
            found = _kept(found, fits, f"has the colour {choice.colour}", f"colours: {', '.join(colours) or 'none'}")
        for axis, name in enumerate("xyz"):
            if (at := getattr(given, name)) is not None:
                found = self._in_plane(found, axis, at)
        if choice.normal is not None:
            normal = np.array(given.normal) / np.linalg.norm(given.normal)
            fits = [
                face.kind == "plane" and face.direction is not None and float(normal @ face.direction) > 1 - ALONG**2
                for face in found
            ]
            found = _kept(found, fits, f"is plane and looks along {choice.normal}")
        if choice.radius is not None:
            radii = sorted({float(f"{face.radius:.6g}") for face in self.faces if face.radius})
            listed = ", ".join(quantity(r, "m", 6) for r in radii[:MOST_LISTED])
            fits = [face.radius is not None and abs(face.radius / given.radius - 1) <= ALONG for face in found]
            wanted = f"is part of a cylinder of radius {quantity(given.radius, 'm', 6)}"
            found = _kept(found, fits, wanted, f"radii: {listed or 'none'}")
        if choice.near is not None:
            point = np.array(given.near)
            found = [min(found, key=lambda face: _distance(face.triangles, point))]
        return found

    def _in_plane(self, found: list[PartFace], axis: int, at: float) -> list[PartFace]:
        """Those faces that lie in a plane square to an axis."""
        near = ROUGH * self.size
        fits = [float(np.abs(face.triangles[..., axis] - at).max()) <= near for face in found]
        flat = [] if any(fits) else [face for face in self.faces if np.ptp(face.triangles[..., axis]) <= near]
        planes = sorted({round(float(face.centre[axis]), 9) for face in flat}, key=lambda x: abs(x - at))
        nearest = ", ".join(quantity(x, "m", 6) for x in planes[:3])
        wanted = f"lies in the plane {'xyz'[axis]} = {quantity(at, 'm', 6)}"
        return _kept(found, fits, wanted, f"nearest planes: {'xyz'[axis]} = {nearest}" if planes else "")

    def _named(self, wanted: int | Sequence[int] | str) -> list[PartFace]:
        """Faces by name, or by numbers."""
        if isinstance(wanted, str):
            found = [face for face in self.faces if is_called(face.name, wanted)]
            if wanted in self.empty:
                raise OptionError(f"the set {wanted} has no outer side of the mesh: {self.empty[wanted]}")
            if not found:
                names = sorted({name for face in self.faces if face.name for name in face.name.split(JOINS)})
                none = f"the file names no face: choose by number ({len(self.faces)} faces), plane, radius or point"
                hint = did_you_mean(wanted, names, f"names: {', '.join(names[:MOST_LISTED])}") if names else none
                raise OptionError(f"no face is called {wanted!r}; {hint}")
            return found
        numbers = [wanted] if isinstance(wanted, int) else list(wanted)
        for own in numbers:
            if not 1 <= own <= len(self.faces):
                raise OptionError(f"there is no face {own}; faces have the numbers 1 to {len(self.faces)}")
        return [self.faces[own - 1] for own in numbers]


def is_called(whole: str, name: str) -> bool:
    """Whether a face or a solid has a name, or is in a set of that name."""
    return name == whole or name in whole.split(JOINS)


def _kept(faces: list[PartFace], fits: list[bool], wanted: str, hint: str = "") -> list[PartFace]:
    """Those faces that fit. Raises OptionError where none does."""
    kept = [face for face, fit in zip(faces, fits, strict=True) if fit]
    if not kept:
        raise OptionError(f"no face {wanted}" + (f"; {hint}" if hint else ""))
    return kept


@verb
def faces(path: str | Path, *, thickness: float | None = None, offset: float = 0.0, unit: str | None = None) -> Drawing:
    """The solids and faces of a STEP file, in metres, with what chooses them; solids that touch are glued.

    With a `thickness`, m, those of a DXF or SVG drawing of a planar part, from z = 0 up, whose outline is `offset`, m,
    larger than drawn on all sides; faces have the names of the layers of their lines. With a `unit` of length, mm, um,
    cm, m or in, those of a solid mesh: its outer side, parted where it bends by 30 degrees and by sets of points, sides
    and flat elements, whose names faces have.

    Raises OptionError for files that cannot be read, have no solid, or solids that overlap or do not touch, and for
    cells that are wrong; ModelError for outlines that enclose nothing.
    """
    suffix = Path(path).suffix.lower()
    if unit is not None or suffix in MESHES:
        return _of_mesh(path, unit, thickness)
    is_planar = suffix in (".dxf", ".svg")
    if is_planar != (thickness is not None):
        rule = "a drawing needs a thickness" if is_planar else "a thickness belongs to a drawing, .dxf or .svg"
        raise OptionError(f"{path}: {rule}")
    if thickness is not None:
        return planar(drawn_outline(path), thickness, offset, str(path))
    content = read_bytes(Path(path), "solid_bytes")
    occ = need("netgen.occ", "solid")
    notes: list[str] = []
    solids = _solids_of_step(occ, path, content, notes)
    return _drawing(solids, str(path), hashlib.sha256(content).hexdigest(), tuple(notes))


def drawn_outline(path: str | Path) -> Outline:
    """The outline in a DXF or SVG drawing. Raises ModelError where it encloses nothing, and OptionError."""
    return read_dxf(path) if Path(path).suffix.lower() == ".dxf" else read_svg(path)


def planar(outline: Outline, thickness: float, offset: float, path: str) -> Drawing:
    """The solid and the faces of a planar part, as `faces` has them, of an outline that is to be larger by `offset`, m.

    Raises ModelError where the offset is too large.
    """
    outline = (outline.offset(offset) if offset else outline).rounded()
    digest = content_key((outline.loops, thickness))
    drawing = _drawing([extruded(outline, thickness)], path, digest, outline.notes)
    return replace(drawing, outline=outline, thickness=thickness)


def _drawing(solids: list[Any], path: str, digest: str, notes: tuple[str, ...]) -> Drawing:
    """What solids in mm make together. Raises OptionError for sizes that no part has."""
    occ = need("netgen.occ", "solid")
    names = _names(solids)
    boxes = np.array([[[p.x, p.y, p.z] for p in solid.bounding_box] for solid in solids]) * MILLIMETRE
    box = np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    size = _size(path, box, "the unit that the file names is not the one it was drawn in")
    shape = _glued(occ, solids, names, path) if len(solids) > 1 else solids[0]
    outer, order = _faces(occ, shape, names, size, path)
    return Drawing(path, shape, names, outer, box, digest, order, notes)


def _size(path: str | Path, box: Array, hint: str) -> float:
    """Diagonal of a box, m. Raises OptionError where it is none of a part."""
    size = float(np.linalg.norm(box[1] - box[0]))
    if not SMALLEST < size < LARGEST:
        rule = f"the part would be {quantity(size, 'm', 3)} long; parts are from 0.1 mm to 30 m"
        raise OptionError(f"{path}: {rule}: {hint}")
    return size


def _of_mesh(path: str | Path, unit: str | None, thickness: float | None) -> Drawing:
    """A mesh of others with its faces."""
    if Path(path).suffix.lower() in (".step", ".stp", ".dxf", ".svg"):
        raise OptionError(f"{path}: a unit belongs to a mesh")
    if thickness is not None:
        raise OptionError(f"{path}: a thickness belongs to a drawing, .dxf or .svg")
    if unit not in MESH_UNITS:
        given = "its file does not say it" if unit is None else f"{unit!r} is none"
        rule = f"a mesh has a unit of length, {', '.join(MESH_UNITS)}: {given}"
        raise OptionError(f"{path}: {rule}; most are in mm: `mesh` with `unit: mm`, or --unit mm")
    mesh = given_mesh(Path(path), MESH_UNITS[unit])
    box = np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)])
    size = _size(path, box, f"its unit of length is not {unit}")
    found = []
    for place, own in enumerate(mesh.faces(), 1):
        kind, direction, radius = _form(own.triangles, size)
        about = own.area, own.centre, direction, radius, own.triangles
        found.append(PartFace(place, own.name, "", own.solid, kind, *about))
    order = tuple(range(len(found)))
    return Drawing(str(path), mesh, mesh.solids, tuple(found), box, mesh.digest, order, mesh.notes, empty=mesh.empty)


def _solids_of_step(occ: Any, path: str | Path, content: bytes, notes: list[str]) -> list[Any]:
    """The solids of a STEP file, sewn of loose faces where there are no others."""
    if b"ISO-10303-21" not in content[:4096]:
        raise OptionError(f"{path}: this is no STEP file: it does not begin with ISO-10303-21")
    try:
        with ExitStack() as stack:
            readable = Path(path)
            if readable.suffix not in (".step", ".stp"):  # others it does not take for STEP, .STEP included
                readable = stack.enter_context(scratch_folder()) / "part.step"
                readable.write_bytes(content)
            geometry = occ.OCCGeometry(str(readable))
        solids = list(geometry.shape.solids)
    except Exception as error:
        raise OptionError(f"{path}: OpenCASCADE cannot read it: {' '.join(str(error).split())[:200]}") from None
    if solids:
        return solids
    count = len(list(geometry.shape.faces))
    if count:
        with _silent():
            geometry.Heal()
        solids = list(geometry.shape.solids)
    if not solids:
        rule = f"it has {count} faces and no solid" if count else "it has no solid"
        raise OptionError(f"{path}: {rule}: export the part as a solid body, closed")
    notes.append(f"{counted(count, 'loose face')} sewn to {counted(len(solids), 'solid')}")
    return solids


@contextmanager
def _silent() -> Iterator[None]:
    """Nowhere goes what a library prints on its own to stdout."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def extruded(outline: Outline, thickness: float) -> Any:
    """The solid, in mm, of an outline and a thickness, m, from z = 0 up; layers of lines name its faces."""
    occ = need("netgen.occ", "solid")

    def point(at: Any) -> Any:
        return occ.gp_Pnt(at[0] / MILLIMETRE, at[1] / MILLIMETRE, 0.0)

    def edge(own: Segment) -> Any:
        if own.is_line:
            return occ.Segment(point(own.start), point(own.end))
        return occ.ArcOfCircle(point(own.start), point(own.at(0.5).tolist()), point(own.end))

    flat = [occ.Face(occ.Wire([edge(own) for own in loop.segments])) for loop in outline.loops]
    face = flat[0]
    for hole in flat[1:]:
        face = face - hole
    (solid,) = face.Extrude(occ.gp_Vec(0.0, 0.0, thickness / MILLIMETRE)).solids
    named = [own for own in outline.segments if own.layer not in NO_LAYERS]
    middles = np.array([own.at((np.arange(200) + 0.5) / 200).mean(axis=0) for own in named]).reshape(-1, 2)
    for side in solid.faces:
        at = np.array([side.center.x, side.center.y]) * MILLIMETRE
        away = np.linalg.norm(middles - at, axis=1)
        if named and away.min() < 1e-4 * outline.size and abs(side.center.z * MILLIMETRE / thickness - 0.5) < 1e-6:
            side.name = named[int(away.argmin())].layer
    return solid


def _axis(direction: Array) -> str:
    """A direction in words, where it lies along an axis."""
    k = int(np.abs(direction).argmax())
    return f"{'-+'[int(direction[k] > 0)]}{'xyz'[k]}" if abs(direction[k]) > 1 - ALONG**2 else ""


def _name_of(shape: Any) -> str:
    """The name of a shape in its file; empty where it has none."""
    name = str(shape.name or "")
    return "" if name in NO_NAMES else name


def _names(solids: list[Any]) -> tuple[str, ...]:
    """Names of solids, made different where they are not."""
    found: list[str] = []
    for k, solid in enumerate(solids, 1):
        name = _name_of(solid) or f"solid {k}"
        while name in found:
            name = f"{name} {k}"
        found.append(name)
    return tuple(found)


def _glued(occ: Any, solids: list[Any], names: tuple[str, ...], path: str) -> Any:
    """Solids in one piece that share faces where they touch. Raises OptionError where they overlap or do not touch."""
    for a in range(len(solids)):
        for b in range(a):
            boxes = [[np.array([p.x, p.y, p.z]) for p in solids[k].bounding_box] for k in (a, b)]
            if (boxes[0][0] > boxes[1][1]).any() or (boxes[1][0] > boxes[0][1]).any():
                continue
            common = (solids[a] * solids[b]).mass
            if common > OVERLAPPING * min(solids[a].mass, solids[b].mass):
                rule = f"solids {names[b]} and {names[a]} overlap by {common:.3g} mm^3"
                raise OptionError(f"{path}: {rule}: cut one out of the other")
    for solid, name in zip(solids, names, strict=True):
        solid.name = name
        solid.mat(name)
    shape = occ.Glue(solids)
    pieces = list(shape.solids)
    owners: dict[int, list[int]] = {}
    for k, piece in enumerate(pieces):
        for face in piece.faces:
            owners.setdefault(hash(face), []).append(k)
    group = list(range(len(pieces)))
    for shared in owners.values():
        for other in shared[1:]:
            old, new = group[other], group[shared[0]]
            group = [new if g == old else g for g in group]
    if len(set(group)) > 1:
        apart = next(k for k, g in enumerate(group) if g != group[0])
        rule = f"solid {names[apart]} touches none of those that hang on {names[0]}"
        raise OptionError(f"{path}: {rule}: solids of one part share faces; make two parts of it, or mend the gap")
    return shape


def mesh_name(place: int) -> str:
    """What the face at a place in a shape is called in its mesh."""
    return f"face{place}"


def faces_of(shape: Any) -> list[Any]:
    """The faces of a shape in the order of netgen's, those between two solids once."""
    return list({hash(face): face for face in shape.faces}.values())


def _faces(
    occ: Any, shape: Any, names: tuple[str, ...], size: float, path: str
) -> tuple[tuple[PartFace, ...], tuple[int, ...]]:
    """The outer faces of a shape, and their places among all."""
    meshing = need("netgen.meshing", "solid")
    try:
        mesh = occ.OCCGeometry(shape).GenerateMesh(
            maxh=size / MILLIMETRE / COARSE, perfstepsend=meshing.MeshingStep.MESHSURFACE, curvaturesafety=2.0
        )
    except Exception as error:
        raise OptionError(f"{path}: its faces cannot be meshed: {' '.join(str(error).split())[:200]}") from None
    points = np.array([list(p) for p in mesh.Points()]) * MILLIMETRE
    cells = mesh.Elements2D().NumPy()
    corners = points[cells["nodes"][:, :3].astype(np.intp) - 1]
    index: Index = cells["index"].astype(np.intp)
    found, order = [], []
    for place, face in enumerate(faces_of(shape)):
        triangles = corners[index == place + 1]
        if not len(triangles):
            continue
        sides = mesh.FaceDescriptor(place + 1)
        if sides.domin and sides.domout:
            continue  # between two solids
        of = max(sides.domin, sides.domout, 1) - 1
        colour = "" if face.col is None else "#" + "".join(f"{round(255 * c):02x}" for c in list(face.col)[:3])
        centre = np.array([face.center.x, face.center.y, face.center.z]) * MILLIMETRE
        form = _form(triangles, size)
        about = names[of], form[0], float(face.mass) * MILLIMETRE**2, centre, *form[1:], triangles
        found.append(PartFace(len(found) + 1, _name_of(face), colour, *about))
        order.append(place)
    return tuple(found), tuple(order)


def _form(triangles: Array, size: float) -> tuple[str, Array | None, float | None]:
    """Kind, direction and radius of a face."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    points = np.unique(triangles.reshape(-1, 3), axis=0)
    mean = normals.sum(axis=0)
    length = float(np.linalg.norm(mean))
    if length > 0 and float(np.ptp(points @ mean)) <= ROUGH * size * length:
        return "plane", mean / length, None
    cylinder = _cylinder(points[:: 1 + len(points) // MOST_FITTED], normals, size)
    return ("other", None, None) if cylinder is None else ("cylinder", *cylinder)


def _cylinder(points: Array, normals: Array, size: float) -> tuple[Array, float] | None:
    """Axis (3,) and radius of the cylinder on which points (p, 3) lie; None where they lie on none."""
    from scipy.optimize import least_squares  # slow to import

    if len(points) < 6:
        return None
    axis = la.svd(normals / np.linalg.norm(normals, axis=1, keepdims=True), full_matrices=False)[2][2]
    middle = points.mean(axis=0)
    x = (points - middle) / size

    def around(tilt: Array) -> tuple[Array, Array, float]:
        """Axis, distances of the points from the circle around it that fits them, and its radius."""
        along = axis + la.null_space(axis[None]) @ tilt
        along = along / np.linalg.norm(along)
        flat = x @ la.null_space(along[None])
        A = np.column_stack([2 * flat, np.ones(len(x))])
        solution = np.linalg.lstsq(A, (flat**2).sum(axis=1), rcond=None)[0]
        radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 0.0)))
        return along, np.linalg.norm(flat - solution[:2], axis=1) - radius, radius

    tilt = least_squares(lambda tilt: around(tilt)[1], np.zeros(2), xtol=1e-14, ftol=1e-14).x
    along, off, radius = around(tilt)
    if not 0 < radius < 10 or np.abs(off).max() > ROUGH:
        return None
    return np.where(np.abs(along) < ROUGH, 0.0, along), radius * size


def _distance(triangles: Array, point: Array) -> float:
    """Distance of a point (3,) from triangles (t, 3, 3), by that from points spread over them."""
    n = 8
    grid = [(i / n, j / n, 1 - (i + j) / n) for i in range(n + 1) for j in range(n + 1 - i)]
    spread: NDArray[np.float64] = np.einsum("gk,tkx->tgx", np.array(grid), triangles)
    return float(np.sqrt(((spread - point) ** 2).sum(axis=-1).min()))
