"""Motions of a scene: modes, statics, preload, freedoms of a platform, spaces, drifting axes, poses of a stroke."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from flexura.analysis import (
    ActuatorState,
    BodySpaces,
    Drift,
    Freedom,
    FreedomSpaces,
    Kinetostatics,
    Mode,
    Modes,
    Preload,
    ScrewAxis,
    Statics,
    Stroke,
    StrokePose,
    compliance,
    response_to,
)
from flexura.arrays import Array
from flexura.errors import foremost
from flexura.mechanism import FORCE_UNITS, GROUND, STIFFNESS_UNITS, is_rotation
from flexura.pages.viewer.geometry import (
    DISPLACEMENT,
    HEAVY,
    LEAST,
    MEMBERS,
    PAGE,
    Drawing,
    Energy,
    Moving,
    by_part,
    displaced,
    still,
    stress_by_part,
    stress_colouring,
    vibrating,
)
from flexura.pages.viewer.scene import (
    Arrow,
    Axis,
    Fact,
    Poses,
    ShownMotion,
    Triple,
)
from flexura.structure import Ports
from flexura.tables import counted, ends, in_hz, number, percent, quantity, scale_for
from flexura.view import (
    Solids,
    mode_scale,
    moved_solids,
    stresses_along,
)

SHAPES = 3
"""Buckling shapes that are shown."""


def mode_motions(drawing: Drawing, result: Modes) -> Iterator[ShownMotion]:
    """Every mode, with what is proven of its frequency and where its strain energy is."""
    energy = Energy(drawing, result.shapes)
    common = [str(own) for own in result.warnings if not own.place]
    for k, mode in enumerate(result.modes):
        u = result.shapes[:, :, k]
        own = [str(w) for w in result.warnings if w.place == f"mode {mode.number}"]
        moved = drawing.moved(u)
        kinetic = {body.body: body.kinetic_share for body in (*mode.motion.bodies, *mode.motion.masses)}
        told = {name: percent(share) for name, share in kinetic.items() if share >= LEAST}
        coloured = energy.colouring(k)
        yield ShownMotion(
            id=f"mode-{mode.number}",
            group="modes",
            title=f"mode {mode.number}: {frequency(mode)}",
            **vibrating(moved),
            subtitle=mode.motion.summary,
            flag=mode.flag,
            colours=(DISPLACEMENT, *([coloured] if coloured else [])),
            facts=tuple(mode_facts(mode, result.model_errors.texts[k])),
            by_part=(energy.by_part(k), by_part(drawing, "kinetic energy", HEAVY, told)),
            warnings=(*own, *common),
        )


def frequency(mode: Mode) -> str:
    """The frequency of a mode in words, as far as it is proven."""
    if mode.is_rigid:
        return "0 Hz, rigid motion"
    return "frequency unknown" if mode.frequency_text == "unknown" else mode.frequency_text


def mode_facts(mode: Mode, model_error: str) -> list[Fact]:
    """What is proven of a mode, how far the part may be from it, and what it is like at full order."""
    lower, upper = mode.interval_hz
    found: list[Fact] = [("frequency", frequency(mode) + (f" ({mode.flag})" if mode.flag else ""))]
    if lower is not None and upper is not None and not mode.is_rigid:
        width = (upper - lower) / upper if upper > 0 else 0.0
        found.append(("proven to be", f"from {ends((lower, upper), 'Hz', 7)}, {width:.1g} of it wide"))
    found.append(("model error", model_error))
    if mode.full_frequency_hz is not None:
        found.append(("full order", in_hz(mode.full_frequency_hz, 7)))
    if mode.mac is not None:
        found.append(("MAC with it", f"{mode.mac:.6f}"))
    found += [(f"strain energy of {name}", percent(share)) for name, share in list(mode.motion.deformation.items())[:4]]
    return found


def static_motions(drawing: Drawing, result: Statics) -> Iterator[ShownMotion]:
    """The response to loads and commands, true to scale at a factor of one."""
    u = drawing.model.node_displacements(result.displacement_vector[:, None])
    moved, stresses = drawing.moved(u[:, :, 0]), result.stresses()
    values = stresses_along(drawing.solids, result.stress_profiles())
    largest = moved.largest_motion()
    driven = [own for own in result.actuators if own.command]
    units = {out.channel.name: out.channel.unit for out in Ports(drawing.model.design).outputs()}
    facts: list[Fact] = [("largest displacement", quantity(largest, "m", 4))]
    facts += [(f"{own.name}: command", quantity(own.command, own.unit, 4)) for own in driven]
    facts += [(own.name, _state(own)) for own in driven]
    facts += [(name, quantity(value, units[name], 4)) for name, value in result.readings.items()]
    margin = stresses.factor_to_yield
    if margin is not None and np.isfinite(margin):
        facts.append(("something yields at", f"{number(margin, 4)} times these loads"))
    energy = Energy(drawing, u)
    loads = [f"{name}: {quantity(own.command, own.unit, 4)}" for name, own in ((o.name, o) for o in driven)]
    colours = (DISPLACEMENT, stress_colouring(values), energy.colouring(0))
    yield ShownMotion(
        id="statics",
        group="statics",
        title="statics: " + (", ".join([*loads, *result.loads][:3]) or "loads and gravity"),
        **displaced(moved, visible_factor(moved), largest),
        colours=tuple(own for own in colours if own is not None),
        arrows=tuple(load_arrows(drawing, result)),
        facts=tuple(facts),
        by_part=(*stress_by_part(drawing, stresses), energy.by_part(0)),
        warnings=tuple(str(own) for own in result.warnings),
    )


def _state(own: ActuatorState) -> str:
    """What an actuator does."""
    if own.force is None:
        return quantity(own.command, own.unit, 4)
    if own.unit == "N*m":
        return f"turns by {quantity(own.elongation, 'rad', 4)}, moment {quantity(own.force, 'N*m', 4)}"
    return f"elongation {quantity(own.elongation, 'm', 4)}, force {quantity(own.force, 'N', 4)}"


def load_arrows(drawing: Drawing, result: Statics) -> Iterator[Arrow]:
    """Forces and moments on nodes, and gravity."""
    model = drawing.model
    wrenches = dict(result.loads)
    for node, wrench in model.plan.loads.wrenches(model.values).items():
        wrenches[node] = wrenches.get(node, 0.0) + wrench
    for node, wrench in wrenches.items():
        at = triple(model.positions[model.plan.topology.numbers([node])[0]])
        for own, unit in ((wrench[:3], "N"), (wrench[3:], "N·m")):
            if np.any(own):
                yield Arrow(at, unit_vector(own), f"{node}: {quantity(float(np.linalg.norm(own)), unit, 4)}")
    if any(result.gravity):
        g = np.array(result.gravity)
        low, high = drawing.solids.bounds()
        label = f"gravity {quantity(float(np.linalg.norm(g)), 'm/s^2', 4)}"
        yield Arrow(triple(np.array([*((low + high) / 2)[:2], high[2]])), unit_vector(g), label)


def preload_motions(drawing: Drawing, result: Preload) -> Iterator[ShownMotion]:
    """The linear state under dead loads."""
    u = drawing.model.node_displacements(result.displacement_vector[:, None])[:, :, 0]
    moved = drawing.moved(u)
    factor = result.buckling_factor
    told = f"buckles at {number(factor, 4)} times these loads" if np.isfinite(factor) else "does not buckle"
    forces = {
        name: quantity(least if abs(least) > abs(most) else most, "N", 4)
        for name, (least, most) in result.axial_force.items()
    }
    yield ShownMotion(
        id="preload",
        group="preload",
        title="preload",
        **displaced(moved, visible_factor(moved)),
        subtitle=told,
        colours=(DISPLACEMENT,),
        facts=(("buckling", told), ("largest displacement", quantity(moved.largest_motion(), "m", 4))),
        by_part=(by_part(drawing, "axial force", MEMBERS, forces),),
        warnings=tuple(str(own) for own in result.warnings),
    )
    yield from _buckling(drawing, result, forces)


def _buckling(drawing: Drawing, result: Preload, forces: Mapping[str, str]) -> Iterator[ShownMotion]:
    """The shapes in which a mechanism buckles first."""
    shapes = drawing.model.node_displacements(result.buckling_shapes(SHAPES))
    for k, factor in enumerate(result.buckling_factors(SHAPES)):
        moved = drawing.moved(shapes[:, :, k])
        told = f"{number(factor, 4)} times these loads"
        yield ShownMotion(
            id=f"buckling-{k + 1}",
            group="buckling",
            title=f"buckles at {told}",
            **vibrating(moved),
            subtitle="this shape, in any size and either way" if not k else "if held against those before",
            flag="loaded beyond" if factor <= 1 else "",
            colours=(DISPLACEMENT,),
            facts=(("buckling", told), ("shape", "linear, about the undeformed configuration")),
            by_part=(by_part(drawing, "axial force", MEMBERS, forces),),
        )


def visible_factor(moved: Solids) -> float:
    """A round factor of at least one at which a small displacement is seen."""
    wanted = mode_scale(moved)
    if wanted <= 1:
        return 1.0
    decade = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= wanted))


def shown_axis(axis: ScrewAxis, label: str) -> Axis:
    """A screw axis as pages have it."""
    pitch = None if axis.is_translation else axis.pitch
    return Axis(triple(axis.point), triple(axis.direction), pitch, label)


def unit_vector(vector: Array) -> Triple:
    """A vector (3,) of length 1 in the same direction; zero stays as it is."""
    length = float(np.linalg.norm(vector))
    return triple(vector / length if length else vector)


def triple(vector: Sequence[float] | Array) -> Triple:
    """A vector (3,) as plain numbers, none of them -0."""
    x, y, z = (float(own) + 0.0 for own in vector)
    return x, y, z


WORDS = {"R": "rotation", "T": "translation"}


def freedom_motions(drawing: Drawing, result: Kinetostatics) -> Iterator[ShownMotion]:
    """Every freedom of the platform, as its actuators make it, or a wrench at it where there are none."""
    for k, freedom in enumerate(result.freedoms):
        u = drawing.model.node_displacements(_response(drawing, result, freedom)[:, None])
        moved, energy = drawing.moved(u[:, :, 0]), Energy(drawing, u)
        coloured = energy.colouring(0)
        yield ShownMotion(
            id=f"freedom-{k + 1}",
            group="freedoms",
            title=f"freedom {k + 1}: {WORDS[freedom.kind]} of {result.platform}",
            **vibrating(moved),
            subtitle=f"freedoms of {result.platform}: {result.kind}",
            colours=(DISPLACEMENT, *([coloured] if coloured else [])),
            axes=(shown_axis(freedom.axis, f"freedom {k + 1}"),),
            facts=tuple(_freedom_facts(result, freedom)),
            by_part=(energy.by_part(0),),
            warnings=tuple(str(own) for own in result.warnings),
        )


def space_motions(drawing: Drawing, result: FreedomSpaces) -> Iterator[ShownMotion]:
    """Every freedom of every body, as a wrench at it makes it, with axes of what is free and arrows of what is borne;
    nothing moves where there is none, or where the body is not relative to the ground."""
    for body in result.bodies:
        axes = tuple(shown_axis(own.axis, own.told) for own in body.freedom.screws)
        arrows = tuple(
            Arrow(triple(own.axis.point), triple(own.axis.direction), own.told) for own in body.constraint.screws
        )
        facts = (
            ("free in", body.freedom.name),
            ("held by", body.constraint.name),
            ("lines make", f"{body.constraint.by_lines} of {body.constraint.dimension} constraints"),
            ("gap in compliance", "" if body.gap is None else number(body.gap, 4)),
        )
        moving = [*_spaces_move(drawing, result, body)]
        for k, (title, moved) in enumerate(moving or [("constraints", still(drawing))]):
            yield ShownMotion(
                id=f"space-{body.body}-{k + 1}",
                group="freedom and constraint spaces",
                title=f"{body.body}: {title}",
                **moved,
                subtitle=f"{counted(body.freedom.dimension, 'freedom')} relative to {result.held}: {body.freedom.name}",
                colours=(DISPLACEMENT,),
                axes=axes,
                arrows=arrows,
                facts=tuple(own for own in facts if own[1]),
                warnings=tuple(str(own) for own in result.warnings if own.place == body.body),
            )


def _spaces_move(drawing: Drawing, result: FreedomSpaces, body: BodySpaces) -> Iterator[tuple[str, Moving]]:
    """Each freedom of a body with how the mechanism moves in it, of any size."""
    if result.held != GROUND or body.compliance is None:
        return
    C = compliance(result.model, nodes=[body.body])
    at = result.model.positions[result.model.plan.topology.numbers([body.body])[0]]
    for own in body.freedom.screws:
        direction, arm = np.array(own.axis.direction), at - np.array(own.axis.point)
        turning = np.concatenate([np.cross(direction, arm) + own.axis.pitch * direction, direction])
        twist = np.append(direction, np.zeros(3)) if own.axis.is_translation else turning
        wrench = np.linalg.lstsq(C, twist, rcond=1e-12)[0]
        moved = response_to(result.model, loads={body.body: wrench}).displacement_vector
        u = drawing.model.node_displacements(moved[:, None])
        yield own.kind, vibrating(drawing.moved(u[:, :, 0]))


def drift_motions(drawing: Drawing, result: Drift) -> Iterator[ShownMotion]:
    """The screw axis at rest and the displaced one; nothing moves."""
    facts: list[Fact] = [("shift", quantity(result.distance, "m", 4)), ("tilt", quantity(result.tilt, "rad", 4))]
    yield ShownMotion(
        id="drift",
        group="drift",
        title=f"drift of the axis: {quantity(result.distance, 'm', 4)}, {quantity(result.tilt, 'rad', 4)}",
        **still(drawing),
        colours=(DISPLACEMENT,),
        axes=(shown_axis(result.rest, "undeformed"), shown_axis(result.displaced, "displaced")),
        facts=tuple(facts),
    )


def _response(drawing: Drawing, result: Kinetostatics, freedom: Freedom) -> np.ndarray:
    """Displacements (n,) of the freedom, of any size."""
    if any(freedom.command):
        commands = {own.name: value for own, value in zip(result.inputs, freedom.command, strict=True) if value}
        return response_to(drawing.model, commands).displacement_vector
    wrench = np.linalg.lstsq(result.compliance, np.array(freedom.twist), rcond=1e-12)[0]
    return response_to(drawing.model, loads={result.platform: wrench}).displacement_vector


def _freedom_facts(result: Kinetostatics, freedom: Freedom) -> list[Fact]:
    unit = "rad" if freedom.kind == "R" else "m"
    found: list[Fact] = [("twist", ", ".join(number(own, 4) for own in freedom.twist))]
    if np.isfinite(freedom.share):
        found.append(("share that the actuators own", percent(freedom.share)))
    if freedom.stroke is not None:
        found.append(("stroke to either side", quantity(freedom.stroke, unit, 4)))
    if freedom.yield_stroke is not None:
        beyond = "" if freedom.yields_in_range else ", beyond what linear theory holds for"
        found.append(("something yields at", quantity(freedom.yield_stroke, unit, 4) + beyond))
    if freedom.shift is not None:
        found.append(("axis shifts at the end of the stroke", quantity(freedom.shift, "m", 4)))
    if freedom.tilt is not None:
        found.append(("axis tilts there", quantity(freedom.tilt, "rad", 4)))
    found += [
        (f"command of {own.name}", quantity(value, f"{own.unit}/{unit}", 4))
        for own, value in zip(result.inputs, freedom.command, strict=False)
        if value
    ]
    return found


MOST_POSES = 11
"""Poses of a stroke that a page moves through."""

DOFS = ("x", "y", "z", "about x", "about y", "about z")


def stroke_poses(drawing: Drawing, result: Stroke) -> tuple[list[ShownMotion], list[Poses], list[str]]:
    """Poses as motions from rest, the way through them, and what is to be said of what is left out.

    `drawing` is of the mechanism at rest.
    """
    count = len(result.poses)
    if not count:
        return [], [], ["the stroke has no pose that could be shown"]
    chosen = np.unique(np.round(np.linspace(0, count - 1, min(count, MOST_POSES))).astype(int)).tolist()
    frames, doubted = result.frames, drawing.doubted
    scenes = [moved_solids(result.model, frames[k], result.stress_profiles(k), doubted, PAGE) for k in chosen]
    most = max(float(np.nanmax(parts.values, initial=0.0)) for parts in scenes)
    said = tuple(foremost(result.warnings, 1))
    motions = []
    for k, parts in zip(chosen, scenes, strict=True):
        pose = result.poses[k]
        stress = stress_colouring(parts.values, most)
        motions.append(
            ShownMotion(
                id=f"pose-{k + 1}",
                group="stroke",
                title=f"pose {k + 1}: {_where(result, pose)}",
                **displaced(parts, 1.0),
                subtitle="to scale",
                flag="not proven" if not pose.proven else "",
                colours=(DISPLACEMENT, *([stress] if stress else [])),
                axes=tuple(shown_axis(own, f"screw axis of {name}") for name, own in pose.screw_axis.items()),
                facts=tuple(_pose_facts(pose)),
                by_part=stress_by_part(drawing, result.stresses(k)),
                warnings=said,
            )
        )
    first = next(iter(result.poses[0].varied), "share")
    along = [result.poses[k].varied.get(first, result.poses[k].share) for k in chosen]
    scale = scale_for(along, result.units.get(first, ""))
    values, unit = tuple((np.array(along) / scale.size).tolist()), scale.unit
    way = Poses("stroke", f"stroke: {first}", tuple(own.id for own in motions), first, values, unit)
    notes = [f"{len(chosen)} of {count} poses of the stroke are shown"] if len(chosen) < count else []
    return motions, [way], notes


def _where(result: Stroke, pose: StrokePose) -> str:
    """What is prescribed at a pose."""
    told = [f"{name} = {quantity(value, result.units[name], 4)}" for name, value in pose.varied.items()]
    return ", ".join(told[:3]) + (f" and {len(told) - 3} more" if len(told) > 3 else "")


def _pose_facts(pose: StrokePose) -> list[Fact]:
    """What holds a pose, its frequencies, its support stiffness, how far it is from yield."""
    found: list[Fact] = []
    for name, force in pose.reaction.items():
        found.append((f"force at {name}", quantity(force, FORCE_UNITS[is_rotation(name)], 4)))
    hertz = [quantity(own, "Hz") for own in pose.frequency_hz[:3]]
    found.append(("natural frequencies", ", ".join(hertz) + ("" if pose.proven else " (not proven)")))
    for k, stiffness in enumerate(pose.support_stiffness):
        if np.isfinite(stiffness):
            found.append((f"support stiffness {DOFS[k]}", quantity(stiffness, STIFFNESS_UNITS[k > 2], 4)))
    found.append(("strain energy", quantity(pose.energy, "J", 4)))
    if pose.stress_margin is not None and np.isfinite(pose.stress_margin):
        found.append(("yields", f"at {number(pose.stress_margin, 4)} times this stress, in {pose.stress_member}"))
    return found
