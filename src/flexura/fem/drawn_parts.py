"""Parts from CAD in a mechanism: each becomes a substructure of its interfaces and one superelement."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from flexura.errors import ModelError, OptionError, Path, Problem
from flexura.expressions import Expression
from flexura.fem.cad import Drawing, faces
from flexura.fem.geometry import SolidMaterial
from flexura.fem.monoliths import Joint, ReducedPart, joint_of, reduced_part
from flexura.fem.solid_mesh import SURFACES, Surface
from flexura.fem.varying import Family, Span
from flexura.mechanism import (
    Interface,
    Material,
    Matrix,
    Mechanism,
    Meshed,
    Scalar,
    SolidPart,
    Substructure,
    Superelement,
    Variation,
    copies,
    evaluated,
    matching,
    parameter_values,
    scalars,
    with_parts_placed,
)

SOLID = "solid"
"""Name of the superelement in the substructure that stands for a part."""

SIZES = ("thickness", "offset")
"""What of a planar part may vary."""

STEPS = 5
"""Values of each parameter at which a size is looked at."""

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
    key = "step" if part.step else "drawing"
    values: Any = parameter_values(model)
    own: Any = evaluated(part, values)
    thickness, offset = own.thickness, own.offset
    sizes = {name: size for name in SIZES if isinstance(size := getattr(part, name), Expression)}
    spans = {name: _span(model, (*path, name), size) for name, size in sizes.items()}
    known = f"{part.file} {thickness} {offset}"
    if known not in drawings:
        announce("reading")
        try:
            drawings[known] = faces(part.file, thickness=thickness, offset=offset)
        except OptionError as error:
            rule, _, hint = str(error).removeprefix(f"{part.file}: ").partition("\n    hint: ")
            raise ModelError([Problem((*path, key), part.file, rule, hint)]) from None
    drawing = drawings[known]
    materials = _materials(model, part, path, drawing, values)
    joints = _joints(part, path, drawing)
    loss = model.material(part.material).loss_factor
    try:
        reduced = reduced_part(drawing, materials, joints, part.mesh_tolerance, own.up_to, announce, spans)
    except ModelError as error:  # of the outlines that it becomes
        raise ModelError(replace(problem, path=(*path, "offset")) for problem in error.problems) from None
    names = tuple(part.interfaces)
    element = Superelement(
        nodes=names,
        amplitudes=len(reduced.K) - 6 * len(names),
        stiffness=Matrix(reduced.K),
        mass=Matrix(reduced.M),
        loss_factor=loss if part.loss_factor is None else part.loss_factor,
        stiffness_error=Matrix(reduced.E),
        mesh=Meshed(size=1.0, dofs=reduced.dofs, complete_hz=reduced.complete_hz),
    ).replaced({"variation": _variation(model.material(part.material), materials, sizes, spans, joints, reduced)})
    surface = Surface(reduced.points, reduced.facets, reduced.rows)
    SURFACES.once(element.stiffness, lambda: surface, lambda found: found is not None)
    nodes: dict[str, tuple[Scalar, Scalar, Scalar]] = {
        name: joint.place for name, joint in zip(names, joints, strict=True)
    }
    for name, (x, y, z) in nodes.items() if "thickness" in sizes else ():
        if part.interfaces[name].at is None and z:
            nodes[name] = (x, y, sizes["thickness"] * (z / thickness))
    return Substructure(
        nodes=nodes,
        superelements={SOLID: element},
        interface=names,
    )


def _span(model: Mechanism, path: Path, size: Expression) -> Span:
    """What a size is, and becomes between the bounds of the parameters that it depends on. Raises ModelError where one
    of these has no bounds."""
    roots, parameters = set(size.names), model.parameters
    while derived := {name for name in roots if isinstance(parameters[name].value, Expression)}:
        roots = (roots - derived) | {name for key in derived for name in parameters[key].value.names}  # type: ignore[union-attr]
    values: Any = parameter_values(model)
    grids = []
    for name in sorted(roots):
        bounds: Any = evaluated(parameters[name], values)
        if bounds.minimum is None or bounds.maximum is None:
            rule = f"the part is meshed for all that it becomes, and parameter {name} has no minimum and maximum"
            raise ModelError([Problem(path, str(size), rule, "say from what to what it goes, or write a number")])
        grids.append(np.linspace(bounds.minimum, bounds.maximum, STEPS))
    points = np.array(list(product(*grids))).T
    every = size.evaluate(parameter_values(model, dict(zip(sorted(roots), points, strict=True))))
    return Span(float(size.evaluate(values)), float(np.min(every)), float(np.max(every)))


def _variation(
    metal: Material,
    materials: Mapping[str, SolidMaterial],
    sizes: Mapping[str, Expression],
    spans: Mapping[str, Span],
    joints: Sequence[Joint],
    reduced: ReducedPart,
) -> Variation | None:
    """How the matrices of a part vary; None where they do not."""
    if not sizes and not isinstance(metal.E, Expression) and not isinstance(metal.rho, Expression):
        return None
    of, alone = next(iter(materials.values())), (np.empty(0), np.empty((1, 0), dtype=np.intp))
    family = reduced.family or Family(*alone, reduced.K[None], reduced.M[None])
    return Variation(
        names=tuple(sizes),
        sizes=tuple(sizes.values()),
        centre=tuple(span.nominal for span in spans.values()),
        reach=tuple(family.reach.tolist()),
        least=tuple(span.least for span in spans.values()),
        most=tuple(span.most for span in spans.values()),
        powers=tuple(map(tuple, family.powers.tolist())),
        stiffness=tuple(map(Matrix, family.K)),
        mass=tuple(map(Matrix, family.M)),
        material=(metal.E, metal.rho) if len({own.name for own in materials.values()}) == 1 else (of.E, of.rho),
        nominal=(of.E, of.rho),
        places=tuple(joint.place for joint in joints),
    )


def _materials(
    model: Mechanism, part: SolidPart, path: Path, drawing: Drawing, values: Mapping[str, Any]
) -> dict[str, SolidMaterial]:
    """Materials by solid, at the values of the parameters."""
    if unknown := [name for name in part.solids if name not in drawing.solids]:
        hint = f"solids: {', '.join(drawing.solids[:12])}"
        raise ModelError([Problem((*path, "solids", unknown[0]), "", "the file has no such solid", hint)])
    names = {solid: part.solids.get(solid, part.material) for solid in drawing.solids}
    is_one = len({*names.values()}) == 1
    found = {}
    for solid, name in names.items():
        described = model.material(name)
        fixed = (described.nu, described.G) if is_one else (described.nu, described.G, described.E, described.rho)
        if any(isinstance(value, Expression) for value in fixed):
            rule = "a part is meshed for one nu, and where it has two materials for these"
            raise ModelError([Problem((*path, "material"), name, rule, "write numbers in place of parameters")])
        own: Any = evaluated(described, values)
        nu = own.nu if own.nu is not None else own.E / (2 * own.G) - 1
        if isinstance(described.E, Expression) and own.nu is None:
            rule = "where E varies, nu is given, not G"
            raise ModelError([Problem((*path, "material"), name, rule, "write nu in place of G")])
        if nu > STIFFEST:
            rule = f"nu = {nu:g} is too near 0.5 for a solid; at most {STIFFEST}"
            raise ModelError([Problem((*path, "material"), name, rule)])
        found[solid] = SolidMaterial(name, own.E, nu, own.rho)
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
