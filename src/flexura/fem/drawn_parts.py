"""Parts from CAD or of meshes in a mechanism: each becomes a substructure of its interfaces and one superelement."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexura.errors import ModelError, OptionError, Path, Problem
from flexura.expressions import Expression
from flexura.fem.cad import Drawing, faces, is_called
from flexura.fem.geometry import SolidMaterial
from flexura.fem.monoliths import Joint, joint_of, reduced_part
from flexura.fem.solid_mesh import SURFACES, Surface
from flexura.mechanism import (
    Interface,
    Matrix,
    Mechanism,
    Meshed,
    SolidPart,
    Substructure,
    Superelement,
    copies,
    matching,
    scalars,
    with_parts_placed,
)

SOLID = "solid"
"""Name of the superelement in the substructure that stands for a part."""

STIFFEST = 0.499
"""Poisson's ratios beyond this one lock the cells."""


def with_parts_reduced(model: Mechanism, announce: Callable[[str], None]) -> Mechanism:
    """The mechanism with instances of substructures in the place of its parts, the same substructure for equal parts.

    Raises ModelError with the place of what is wrong with a file or an interface, OptionError for want of memory, and
    SolverError.
    """
    if not any(part.parts for part in (model, *model.substructures.values())):
        return model
    drawings: dict[str, Drawing] = {}

    def made(name: str, key: str, part: SolidPart) -> Substructure:
        path = (*(("substructures", name) if name else ()), "parts", key)
        return _made(model, part, path, drawings, lambda text: announce(f"part {key}: {text}"))

    top = {key: _with_follow(model, key, part) for key, part in model.parts.items()}
    return with_parts_placed(model.replaced({"parts": top}), made)


def _with_follow(model: Mechanism, key: str, part: SolidPart) -> SolidPart:
    """A part each interface of which says how it follows: rigidly where the ground clamps it in all copies."""
    placed = [copy for copy, _ in copies(key, part)]
    held = [text for text, support in model.ground.items() if all(support.held)]

    def is_clamped(name: str) -> bool:
        return all(any(matching(text, [f"{copy}.{name}"]) for text in held) for copy in placed)

    changed = {
        name: own.replaced({"follow": own.follow or ("rigid" if is_clamped(name) else "averaged")})
        for name, own in part.interfaces.items()
    }
    return part.replaced({"interfaces": changed})


def _made(
    model: Mechanism, part: SolidPart, path: Path, drawings: dict[str, Drawing], announce: Callable[[str], None]
) -> Substructure:
    """The substructure that stands for a part."""
    key = "step" if part.step else "drawing" if part.drawing else "mesh"
    if any(isinstance(value, Expression) for value in (part.thickness, part.offset)):
        rule = "a part is meshed once, for one thickness and offset"
        raise ModelError([Problem((*path, "thickness"), "", rule, "write numbers in place of parameters")])
    thickness, offset = _number(part.thickness), _number(part.offset) or 0.0
    known = f"{part.file} {thickness} {offset} {part.unit}"
    if known not in drawings:
        announce("reading")
        try:
            drawings[known] = faces(part.file, thickness=thickness, offset=offset, unit=part.unit)
        except OptionError as error:
            rule, _, hint = str(error).removeprefix(f"{part.file}: ").partition("\n    hint: ")
            raise ModelError([Problem((*path, key), part.file, rule, hint)]) from None
        for note in drawings[known].notes:
            announce(note)
    drawing = drawings[known]
    materials = _materials(model, part, path, drawing)
    joints = _joints(part, path, drawing)
    loss = model.material(part.material).loss_factor
    reduced = reduced_part(drawing, materials, joints, part.mesh_tolerance, _number(part.up_to), announce)
    names = tuple(part.interfaces)
    element = Superelement(
        nodes=names,
        amplitudes=len(reduced.K) - 6 * len(names),
        stiffness=Matrix(reduced.K),
        mass=Matrix(reduced.M),
        loss_factor=loss if part.loss_factor is None else part.loss_factor,
        stiffness_error=Matrix(reduced.E),
        mesh=Meshed(
            size=1.0,
            dofs=reduced.dofs,
            complete_hz=reduced.complete_hz,
            error=reduced.mesh_error,
            tolerance=part.mesh_tolerance,
        ),
    )
    surface = Surface(reduced.points, reduced.facets, reduced.rows)
    SURFACES.once(element.stiffness, lambda: surface, lambda found: found is not None)
    return Substructure(
        nodes={name: joint.place for name, joint in zip(names, joints, strict=True)},
        superelements={SOLID: element},
        interface=names,
    )


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, float) else None


def _materials(model: Mechanism, part: SolidPart, path: Path, drawing: Drawing) -> dict[str, SolidMaterial]:
    """Materials by solid."""
    chosen: dict[str, str] = {}
    for wanted, name in part.solids.items():
        here = [solid for solid in drawing.solids if is_called(solid, wanted)]
        if not here:
            hint = f"solids: {', '.join(drawing.solids[:12])}"
            raise ModelError([Problem((*path, "solids", wanted), "", "the file has no such solid", hint)])
        for solid in here:
            if chosen.setdefault(solid, name) != name:
                rule = f"some of its cells have the material {chosen[solid]} already"
                raise ModelError([Problem((*path, "solids", wanted), name, rule)])
    found = {}
    for solid in drawing.solids:
        name = chosen.get(solid, part.material)
        material = model.material(name)
        E, nu, rho = material.E, material.nu, material.rho
        if isinstance(E, float) and isinstance(material.G, float):
            nu = E / (2 * material.G) - 1
        if not (isinstance(E, float) and isinstance(nu, float) and isinstance(rho, float)):
            rule = "a part is meshed for one material, whose values are numbers"
            raise ModelError([Problem((*path, "material"), name, rule, "write E, nu and rho as numbers")])
        if nu > STIFFEST:
            rule = f"nu = {nu:g} is too near 0.5 for a solid; at most {STIFFEST}"
            raise ModelError([Problem((*path, "material"), name, rule)])
        found[solid] = SolidMaterial(name, E, nu, rho)
    return found


def _joints(part: SolidPart, path: Path, drawing: Drawing) -> list[Joint]:
    """Faces and places of the interfaces. Raises ModelError for those that meet nothing or share a face."""
    joints, owner = [], dict[int, str]()
    for name, interface in part.interfaces.items():
        here = (*path, "interfaces", name)
        if any(isinstance(value, Expression) for _, _, value in scalars(interface)):
            rule = "a part is meshed once, so that its interfaces are where they are"
            raise ModelError([Problem(here, "", rule, "write numbers in place of parameters")])
        try:
            found = drawing.chosen(interface)
        except OptionError as error:
            rule, _, hint = str(error).partition("; ")
            raise ModelError([Problem(here, _words(interface), rule, hint)]) from None
        for face in found:
            if face.number in owner:
                rule = f"face {face.number} belongs to interface {owner[face.number]} as well"
                raise ModelError([Problem(here, _words(interface), rule, "a face moves with one node")])
            owner[face.number] = name
        place = None if interface.at is None else np.array(interface.at, dtype=float)
        joints.append(joint_of(found, drawing, interface.follow == "rigid", place))
    return joints


def _words(interface: Interface) -> str:
    given = {
        key: value for key, value in interface.model_dump(exclude_none=True).items() if key not in ("at", "follow")
    }
    return ", ".join(f"{key}: {value}" for key, value in given.items())
