"""STEP files of a mechanism's members and rigid bodies."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import OptionError, SolverError
from flexura.files import complete_file
from flexura.mechanism import Box, Cylinder, Plate, evaluated, rotation_matrix
from flexura.solid.geometry import MILLIMETRE, joints, occ, solids
from flexura.structure import FullOrderModel


@verb
def write_step(model: FullOrderModel, path: str | Path, *, only: str | None = None) -> Path:
    """Write members and bodies as named solids to a STEP file, in millimetres.

    Members that are one piece are one solid, `leaf1 + arm1`. Bodies that have a form are solids of their own, which may
    overlap members on them; those of mass and inertia alone, point masses and rigid arms have none. The file appears
    complete or not at all. `only` is the path of an instance or member. Raises OptionError when the file cannot be
    written or a section has no solid, ModelError when members intersect, and SolverError when a solid has not the
    volume of its member.
    """
    if Path(path).suffix.lower() not in (".step", ".stp"):
        raise OptionError(f"{path}: a STEP file is named .step or .stp")
    members = solids(model, only)
    bodies = body_solids(model, only)
    groups = joints(model, members).groups
    occ.check_intersections(members)
    with complete_file(path) as temporary:
        with occ.session() as gmsh:
            tags = [occ.volume(gmsh, member, occ.modelled(member)) for member in members]
            occ.check_volumes(gmsh, members, tags, 1e-3)
            names = {body.volume(gmsh): body.name for body in bodies}
            for group in groups:
                first, *rest = ((3, tags[k]) for k in group)
                piece = gmsh.model.occ.fuse([first], rest)[0] if rest else [first]
                names[occ.only_volume(piece)] = " + ".join(members[k].name for k in group)
            gmsh.model.occ.synchronize()
            _remove_loose(gmsh)
            ordered = [names[tag] for _, tag in gmsh.model.getEntities(3)]
            occ.write(gmsh, temporary)
        text = temporary.read_text(encoding="ascii")
        temporary.write_text(_named(text, ordered, model.plan.mechanism.name or "mechanism"), encoding="ascii")
    return Path(path)


@dataclass(frozen=True)
class BodySolid:
    """A rigid body with a form: its centre (3,), m, and right-handed axes (3, 3) as columns, global frame."""

    name: str
    form: Box | Plate | Cylinder
    centre: Array
    axes: Array

    def volume(self, gmsh: ModuleType) -> int:
        """The body as one volume."""
        centre = self.centre / MILLIMETRE
        if isinstance(self.form, Cylinder):
            axis = np.array(self.form.axis, dtype=float)
            along = self.axes @ axis / np.linalg.norm(axis) * float(np.array(self.form.length)) / MILLIMETRE
            radius = float(np.array(self.form.diameter)) / 2 / MILLIMETRE
            return gmsh.model.occ.addCylinder(*(centre - along / 2), *along, radius)
        plate = (self.form.length, self.form.width, self.form.thickness) if isinstance(self.form, Plate) else ()
        x, y, z = (self.axes * np.array(plate or getattr(self.form, "size", ()), dtype=float) / MILLIMETRE).T
        corners = [centre + (i * x + j * y - z) / 2 for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        sides = [np.array([corners[k], corners[(k + 1) % 4]]) for k in range(4)]
        face = gmsh.model.occ.addPlaneSurface([occ.outline(gmsh, sides)])
        return occ.only_volume(gmsh.model.occ.extrude([(2, face)], *z))


def body_solids(model: FullOrderModel, only: str | None = None) -> tuple[BodySolid, ...]:
    """All placed bodies that have a form, or those of the instance with the path `only`."""
    plan, geometry = model.plan, model.geometry
    values = {key: float(np.array(value)) for key, value in plan.scoped_values(model.parameters).items()}
    found = []
    for prototype, placed in plan.topology.copies.items():
        part = plan.parts[prototype]
        for key, body in plan.layout.prototypes[prototype].bodies.items():
            own = evaluated(body, values)
            if own.solid is None:
                continue
            turn = np.eye(3)
            if own.rotate is not None:
                turn = rotation_matrix(np.array(own.rotate.axis, dtype=float), np.array(own.rotate.angle, dtype=float))
            for path, number, offset in zip(placed.paths, placed.number, placed.offset, strict=True):
                axes = geometry.Q[number] @ turn
                name = ".".join((*path, key))
                if only is None or name == only or name.startswith(f"{only}."):
                    axes = axes * np.array([1.0, 1.0, np.sign(np.linalg.det(axes))])
                    found.append(BodySolid(name, own.solid, geometry.positions[offset + part.bodies[key][0]], axes))
    return tuple(found)


def _remove_loose(gmsh: ModuleType) -> None:
    """Remove points and lines of construction, on which no volume stands."""
    kept = gmsh.model.getEntities(3)
    for dim in (2, 1, 0):
        kept = gmsh.model.getBoundary(kept, combined=False, oriented=False)
        gmsh.model.occ.remove(sorted(set(gmsh.model.getEntities(dim)) - set(kept)))
    gmsh.model.occ.synchronize()


_PRODUCT = re.compile(r"PRODUCT\('(Open CASCADE[^']*)',\s*'\1'")


def _named(text: str, names: Sequence[str], whole: str) -> str:
    """The file with the names of its solids, in their order, instead of those that the kernel makes up."""
    wanted = [*([whole] if len(names) > 1 else []), *names]
    if len(_PRODUCT.findall(text)) != len(wanted):
        raise SolverError(f"the STEP file does not list {len(names)} solids one by one; the kernel wrote another form")
    rest = iter(wanted)
    return _PRODUCT.sub(lambda _: "PRODUCT('{0}','{0}'".format(_encoded(next(rest))), text)


def _encoded(name: str) -> str:
    """A string of ISO 10303-21: quotes and backslashes doubled, other characters than ASCII by number."""
    plain = name.replace("\\", "\\\\").replace("'", "''")
    return "".join(c if " " <= c <= "~" else f"\\X4\\{ord(c):08X}\\X0\\" for c in plain)
