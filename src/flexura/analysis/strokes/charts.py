"""A stroke as curves: what pictures and pages draw of it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from flexura.analysis.strokes.stroke import Stroke
from flexura.arrays import Array
from flexura.charts import Axis, Chart, Curve, Panel, is_wide
from flexura.mechanism import FORCE_UNITS, is_rotation
from flexura.tables import counted, scale_for

LOCKED = 2
"""Frequencies with locked actuators."""

STIFFNESSES = ("kx", "ky", "kz", "k about x", "k about y", "k about z")


def stroke_chart(result: Stroke) -> Chart:
    """Forces of the drives, or how far driven forces displace their nodes, natural frequencies by shape and how they
    change, support stiffness, shifts of driven nodes where they are not driven, and the factor to yield, SI, all over
    the first drive in its unit. What is not known at any pose is left out.

    Full lines: actuators free under the forces that hold the pose; dashed ones: actuators locked.
    """
    poses = result.poses
    x, along = _along(result)
    tracked, count = len(poses[0].frequency_hz), result.frequencies_hz.shape[1]
    modes = [f"mode {k + 1}" if k < tracked else "another mode" for k in range(count)]

    def curves(values: Iterable[tuple[str, Array]]) -> list[Curve]:
        return [Curve(x, y, name) for name, y in values if np.isfinite(y).any()]

    def panel(quantity: str, unit: str, shown: list[Curve]) -> list[Panel]:
        return [Panel(shown, along, Axis(quantity, unit, is_wide(shown)))] if shown else []

    free = curves(zip(modes, result.frequencies_hz.T, strict=True))
    for k in range(min(LOCKED, *(len(pose.frequency_hz_held) for pose in poses))):
        hz = np.array([pose.frequency_hz_held[k] for pose in poses])
        free.append(Curve(x, hz, f"actuators locked, {k + 1}", "dashed"))
    panels: list[Panel] = []
    for turns, what in ((False, "force to hold"), (True, "moment to hold")):
        names = [name for name in poses[0].move if is_rotation(name) == turns]
        forces = ((name, np.array([pose.reaction[name] + 0.0 for pose in poses])) for name in names)
        panels += panel(what, FORCE_UNITS[turns], curves(forces))
    if not poses[0].move:
        moved = {node: np.array([pose.displacement[node][:3] for pose in poses]) for node in poses[0].displacement}
        panels += panel("displacement", "m", curves((node, np.sqrt((u**2).sum(axis=1))) for node, u in moved.items()))
    unstable = ", negative where unstable" if any((curve.y < 0).any() for curve in free) else ""
    panels += panel(f"natural frequency{unstable}", "Hz", free)
    panels += panel(
        "change of natural frequency", "%", curves(zip(modes, 100 * result.frequency_changes.T, strict=True))
    )
    stiffness = np.array([pose.support_stiffness for pose in poses], dtype=float).T
    panels += panel("support stiffness", "N/m", curves(zip(STIFFNESSES[:3], stiffness[:3], strict=True)))
    panels += panel("support stiffness, rotations", "N*m/rad", curves(zip(STIFFNESSES[3:], stiffness[3:], strict=True)))
    panels += panel("parasitic shift, not driven", "m", curves(result.parasitic_shifts.items()))
    margins = np.array([np.nan if pose.stress_margin is None else pose.stress_margin for pose in poses])
    if np.isfinite(margins).any():
        margin = Curve(x, np.where(np.isfinite(margins), margins, np.nan), "factor to yield")
        limit = Curve(x, np.ones(len(poses)), "yield", "dotted")
        panels.append(Panel([margin, limit], along, Axis("factor to yield", log=True)))
    said = f"{counted(len(poses), 'pose')}; panels: {', '.join(own.y.quantity for own in panels)}"
    title = f"{result.name} over {along.quantity}" if along.quantity != "pose" else f"{result.name} pose by pose"
    return Chart("stroke", title, said, panels)


def _along(result: Stroke) -> tuple[Array, Axis]:
    """What the first drive is at each pose, in the unit that suits it; the number of the pose where nothing varies."""
    name = next(iter(result.poses[0].varied), "")
    values = np.array([pose.varied.get(name, 0.0) for pose in result.poses])
    if not np.ptp(values) > 0:
        return np.arange(1.0, len(values) + 1), Axis("pose")
    scale = scale_for(values, result.units[name])
    return values / scale.size, Axis(name, scale.unit)
