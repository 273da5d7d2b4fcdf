"""A stroke as poses that are played one after another, everything where it is and not exaggerated."""

from __future__ import annotations

import numpy as np

from flexura.analysis import Stroke, StrokePose
from flexura.errors import foremost
from flexura.mechanism import FORCE_UNITS, STIFFNESS_UNITS, is_rotation
from flexura.pages.viewer.fields import DISPLACEMENT, stress_by_part, stress_colouring
from flexura.pages.viewer.geometry import PAGE, Drawing, displaced
from flexura.pages.viewer.motions import shown_axis
from flexura.pages.viewer.scene import Fact, Poses, ShownMotion
from flexura.tables import number, quantity, scale_for
from flexura.view import moved_solids

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
                facts=tuple(_facts(pose)),
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


def _facts(pose: StrokePose) -> list[Fact]:
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
