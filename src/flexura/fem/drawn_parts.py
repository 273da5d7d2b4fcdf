"""Parts from CAD or of meshes in a mechanism: each becomes a substructure of its interfaces and one superelement."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import ModelError, OptionError, Path, Problem
from flexura.expressions import Expression, parameter
from flexura.fem.cad import Drawing, drawn_outline, faces, is_called, planar
from flexura.fem.geometry import SolidMaterial
from flexura.fem.monoliths import Joint, ReducedPart, joint_of, reduced_part
from flexura.fem.surfaces import Surface
from flexura.fem.varying import Family, Span, Varied
from flexura.mechanism import (
    Corners,
    Interface,
    Matrix,
    Mechanism,
    Meshed,
    Opening,
    Scalar,
    SolidPart,
    Substructure,
    Superelement,
    Variation,
    copies,
    edges_of,
    evaluated,
    expanding,
    matching,
    parameter_values,
    scalars,
    with_parts_placed,
)
from flexura.outlines import Loop, Outline, Segment, bulge_through

SOLID = "solid"
"""Name of the superelement in the substructure that stands for a part."""

SHAPE = ("thickness", "offset", "outline", "holes")
"""What of a planar part may vary."""

MOST_SIZES = 3
"""Parameters with which the shape of a part may vary."""

STEPS = 5
"""Values of each parameter at which what follows from it is looked at."""

NOWHERE = 1e-12
"""Distance, m, that is none."""

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
    key = next(name for name in ("step", "drawing", "outline", "mesh") if getattr(part, name) is not None)
    known: Any = parameter_values(model)
    own: Any = evaluated(part, known)
    spans = _spans(model, part, path, known)
    read = f"{part.file} {own.thickness} {own.offset} {part.unit}"
    try:
        if part.outline is not None:
            drawing = planar(_outline(own.outline, own.holes), own.thickness, own.offset, str(path[-1]))
        elif read in drawings:
            drawing = drawings[read]
        else:
            announce("reading")
            drawing = faces(part.file, thickness=own.thickness, offset=own.offset, unit=part.unit)
            drawings[read] = drawing
            for note in drawing.notes:
                announce(note)
    except OptionError as error:
        rule, _, hint = str(error).removeprefix(f"{part.file}: ").partition("\n    hint: ")
        raise ModelError([Problem((*path, key), part.file, rule, hint)]) from None
    except ModelError as error:
        raise _placed(error, path, key) from None
    materials = _materials(model, part, path, drawing, known)
    joints = _joints(part, path, drawing)
    loss = model.material(part.material).loss_factor
    base = drawn_outline(part.file) if part.drawing and spans else None

    def shape(at: Mapping[str, float]) -> tuple[Outline, float]:
        now: Any = evaluated(part, {**known, **at})
        outline = base or _outline(now.outline, now.holes)
        return outline.offset(now.offset) if now.offset else outline, now.thickness

    shaping = _shaping(part)
    held = sorted({name for _, own in shaping for name in own.names} - spans.keys())
    texts = [*map(str, shaping), *(f"{name} = {known[name]!r}" for name in held)]
    varied = Varied(spans, shape, texts) if spans else None
    try:
        reduced = reduced_part(drawing, materials, joints, part.mesh_tolerance, own.up_to, announce, varied)
    except ModelError as error:  # of the outlines that it becomes
        raise _placed(error, path, "offset" if part.drawing else key) from None
    strength = (model.material(metal.name).yield_stress for metal in materials.values())
    limits = tuple(own if isinstance(own, float) else np.nan for own in strength)
    names = tuple(part.interfaces)
    variation = _variation(model, part, materials, spans, joints, reduced)
    # stresses are those of one shape and one material
    stress = None if variation else reduced.stress and replace(reduced.stress, yield_stress=limits)
    surface = Surface(reduced.points, reduced.facets, reduced.rows, stress)
    element = Superelement(
        **expanding([model.material(metal.name) for metal in materials.values()]),
        nodes=names,
        amplitudes=len(reduced.K) - 6 * len(names),
        stiffness=Matrix(reduced.K, surface),
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
    ).replaced({"variation": variation})
    nodes: dict[str, tuple[Scalar, Scalar, Scalar]] = {
        name: joint.place for name, joint in zip(names, joints, strict=True)
    }
    if reduced.family is not None:
        nodes |= _moving(part, names, spans, reduced.family)
    return Substructure(
        nodes=nodes,
        superelements={SOLID: element},
        interface=names,
    )


def _outline(corners: Corners, holes: tuple[Any, ...]) -> Outline:
    """The outline that a file describes, in numbers. Raises ModelError, at a place below `outline` or `holes`."""
    loops = [_loop(corners, ("outline",))]
    for k, hole in enumerate(holes):
        if isinstance(hole, Opening):
            loops.append(_loop(hole.outline, ("holes", k, "outline")))
            continue
        (x, y), radius = hole.centre, hole.diameter / 2
        ends = (x - radius, y), (x + radius, y)
        loops.append(Loop(tuple(Segment(a, b, 1.0, hole.name or "") for a, b in (ends, ends[::-1]))))
    return Outline(tuple(loops))


def _loop(corners: Corners, path: Path) -> Loop:
    try:
        edges = edges_of(corners)
    except ModelError as error:
        raise ModelError([replace(own, path=(*path, *own.path)) for own in error.problems]) from None
    segments = []
    for k, (start, through, end, name) in enumerate(edges):
        if start == end or through in (start, end):
            rule = "a side has a length: its ends are at one place"
            raise ModelError([Problem((*path, (k + 1) % len(edges)), "", rule)])
        bulge = 0.0 if through is None else bulge_through(*(np.array(at) for at in (start, through, end)))
        segments.append(Segment(start, end, bulge, name))
    return Loop(tuple(segments))


def _placed(error: ModelError, path: Path, key: str) -> ModelError:
    """The error with the place of the part before that in its outline, or of a key where that is in a drawing."""
    found = [(own, own.path if key == "outline" else (key,)) for own in error.problems]
    return ModelError([replace(own, path=(*path, *place)) for own, place in found])


def _shaping(part: SolidPart) -> list[tuple[Path, Expression]]:
    """What the shape of a planar part varies with, and where that stands."""
    return [(place, own) for place, _, own in scalars(part) if place[0] in SHAPE and isinstance(own, Expression)]


def _spans(model: Mechanism, part: SolidPart, path: Path, known: Mapping[str, Any]) -> dict[str, Span]:
    """What the parameters that shape a part are, and become. Raises ModelError for too many, and without bounds."""
    places = {name: place for place, value in reversed(_shaping(part)) for name in value.names}
    names = sorted(places)
    if len(names) > MOST_SIZES:
        rule = f"its shape varies with {len(names)} parameters, and {MOST_SIZES} are the most"
        raise ModelError([Problem(path, ", ".join(names), rule, "write numbers in place of some")])
    parameters, spans = model.parameters, {}
    for name in names:
        roots = {name}
        while derived := {own for own in roots if isinstance(parameters[own].value, Expression)}:
            roots = (roots - derived) | {own for key in derived for own in parameters[key].value.names}  # type: ignore[union-attr]
        grids = []
        for root in sorted(roots):
            bounds: Any = evaluated(parameters[root], known)
            if bounds.minimum is None or bounds.maximum is None:
                rule = f"the part is meshed for all that it becomes, and parameter {root} has no minimum and maximum"
                hint = "say from what to what it goes, or write a number"
                raise ModelError([Problem((*path, *places[name]), name, rule, hint)])
            grids.append(np.linspace(bounds.minimum, bounds.maximum, STEPS))
        points = np.array(list(product(*grids))).T
        every = parameter_values(model, dict(zip(sorted(roots), points, strict=True)))[name]
        if np.ptp(every) > 0:
            spans[name] = Span(float(known[name]), float(np.min(every)), float(np.max(every)))
    return spans


def _moving(
    part: SolidPart, names: Sequence[str], spans: Mapping[str, Span], family: Family
) -> dict[str, tuple[Scalar, Scalar, Scalar]]:
    """Where the middles of faces go, as expressions, where nothing says that their nodes are elsewhere."""
    spread = zip(spans.items(), family.reach.tolist(), strict=True)
    x = [(parameter(name) - span.nominal) / reach for (name, span), reach in spread]
    middles = np.moveaxis(family.middles, 0, -1)
    return {
        name: tuple(_polynomial(x, family.powers, along) for along in middle)  # type: ignore[misc]
        for name, middle in zip(names, middles, strict=True)
        if part.interfaces[name].at is None
    }


def _polynomial(x: Sequence[Expression], powers: Index, shares: Array) -> Scalar:
    """The sum of powers of numbers times their shares, without what is nothing."""
    total: Any = float(shares[0])
    for own, share in zip(powers[1:].tolist(), shares[1:].tolist(), strict=True):
        if abs(share) > NOWHERE:
            term: Any = share
            for one, power in zip(x, own, strict=True):
                term = term * one**power if power else term
            total = total + term
    return total


def _variation(
    model: Mechanism,
    part: SolidPart,
    materials: Mapping[str, SolidMaterial],
    spans: Mapping[str, Span],
    joints: Sequence[Joint],
    reduced: ReducedPart,
) -> Variation | None:
    """How the matrices of a part vary; None where they do not."""
    of, metal = next(iter(materials.values())), model.material(part.material)
    is_one = len({own.name for own in materials.values()}) == 1
    material = (metal.E, metal.rho) if is_one else (of.E, of.rho)
    if not spans and not any(isinstance(own, Expression) for own in material):
        return None
    alone = np.empty(0), np.empty((1, 0), dtype=np.intp)
    family = reduced.family or Family(*alone, reduced.K[None], reduced.M[None], np.empty((1, len(joints), 3)))
    return Variation(
        names=tuple(spans),
        sizes=tuple(map(parameter, spans)),
        units=tuple(model.parameters[name].unit for name in spans),
        centre=tuple(span.nominal for span in spans.values()),
        reach=tuple(family.reach.tolist()),
        least=tuple(span.least for span in spans.values()),
        most=tuple(span.most for span in spans.values()),
        powers=tuple(map(tuple, family.powers.tolist())),
        stiffness=tuple(map(Matrix, family.K)),
        mass=tuple(map(Matrix, family.M)),
        material=material,
        nominal=(of.E, of.rho),
        places=tuple(joint.place for joint in joints),
    )


def _materials(
    model: Mechanism, part: SolidPart, path: Path, drawing: Drawing, values: Mapping[str, Any]
) -> dict[str, SolidMaterial]:
    """Materials by solid, at the values of the parameters."""
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
    names = {solid: chosen.get(solid, part.material) for solid in drawing.solids}
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
        if isinstance(described.yield_stress, Expression):
            rule = "the margin of a part is that of one material, whose values are numbers"
            raise ModelError([Problem((*path, "material"), name, rule, "write yield_stress as a number")])
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
