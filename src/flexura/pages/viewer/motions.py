"""Motions of a scene: from modes, statics, poses of a stroke, freedoms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from flexura.analysis import ActuatorState, Mode, Modes, Preload, ScrewAxis, Statics
from flexura.arrays import Array
from flexura.pages.viewer.fields import (
    DISPLACEMENT,
    HEAVY,
    LEAST,
    MEMBERS,
    Energy,
    by_part,
    percent,
    stress_by_part,
    stress_colouring,
)
from flexura.pages.viewer.geometry import Drawing, displaced, vibrating
from flexura.pages.viewer.scene import Arrow, Axis, Fact, ShownMotion, Triple
from flexura.structure import Ports
from flexura.tables import ends, in_hz, number, quantity
from flexura.view import Solids, mode_scale, stresses_along

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
