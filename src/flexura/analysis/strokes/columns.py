"""Poses of a stroke as a table: a row for each, columns with their SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, isnan
from typing import Any

import numpy as np

from flexura.analysis.model_error import ModelError
from flexura.analysis.strokes.pose import StrokePose
from flexura.analysis.strokes.ways import FORCES
from flexura.arrays import Array
from flexura.mechanism import DOF_NAMES, FORCE_UNITS, UNITS, ForceSensor, is_rotation
from flexura.structure import Plan
from flexura.tables import number


def stroke_columns(
    poses: Sequence[StrokePose], units: Mapping[str, str], errors: Sequence[ModelError]
) -> dict[str, Any]:
    """What each pose is, by heading; `units` are those of what is prescribed, `errors` how far the part may be from the
    model at each pose, none where that is not known."""
    if not poses:
        return {}
    return {
        **{f"{name} [{units[name]}]": [p.varied[name] for p in poses] for name in poses[0].varied},
        **_drive_columns(poses),
        **_frequency_columns(poses, errors),
        **{
            f"support {dof} [{'N/m' if k < 3 else 'N m/rad'}]": [p.support_stiffness[k] for p in poses]
            for k, dof in enumerate(DOF_NAMES)
        },
        **_displacement_columns(poses),
        **_state_columns(poses),
        **_compliance_columns(poses),
    }


MOST_MOVING = 2
"""Nodes that tell how far a mechanism goes, where commands and loads alone move it."""


def short_columns(poses: Sequence[StrokePose], units: Mapping[str, str], modes: int) -> dict[str, Any]:
    """What readers see of each pose, by heading: what is prescribed, what holds it, up to so many frequencies, support
    stiffness where there is any, and factors on what is there."""
    if not poses:
        return {}
    first = poses[0]
    columns: dict[str, Any] = {f"{name} [{units[name]}]": [p.varied[name] for p in poses] for name in first.varied}
    for node in list(first.displacement)[:MOST_MOVING] if not first.move else ():
        columns |= _largest(node, np.array([p.displacement[node] for p in poses]))
    for name in first.move:
        what = f"{'moment' if is_rotation(name) else 'force'}{f' {name}' if len(first.move) > 1 else ''}"
        columns[f"{what} [{FORCE_UNITS[is_rotation(name)]}]"] = [p.reaction[name] + 0.0 for p in poses]
    for k in range(min(max(len(p.frequency_hz) for p in poses), modes)):
        columns[f"f{k + 1} [Hz]"] = [p.frequency_hz[k] if k < len(p.frequency_hz) else None for p in poses]
    if any(not isnan(own) for p in poses for own in p.support_stiffness[:3]):
        for k, axis in enumerate("xyz"):
            own = [p.support_stiffness[k] for p in poses]
            columns[f"k{axis} [N/m]"] = ["driven" if isnan(value) else value for value in own]
    columns["to yield"] = [_factor(p.stress_margin) for p in poses]
    columns["to buckle"] = [_factor(p.buckling_factor) for p in poses]
    return columns


def _largest(node: str, moved: Array) -> dict[str, Any]:
    """Of the displacements (poses, 6) of a node the translation that is largest, else the rotation."""
    span = np.abs(moved).max(axis=0)
    k = int(span[:3].argmax() if span[:3].any() else 3 + span[3:].argmax())
    name = DOF_NAMES[k][1:] if k < 3 else DOF_NAMES[k]
    return {f"{node}.{name} [{UNITS[k > 2]}]": moved[:, k].tolist()}


def watched(plan: Plan) -> list[str]:
    """Nodes whose motion tells how far a mechanism goes: those of displacement and rotation sensors, else of the bodies
    that are not held, the first few."""
    read = [
        ".".join((*path, sensor.nodes[0]))
        for path, name in plan.layout.instances()
        for sensor in plan.layout.prototypes[name].sensors.values()
        if not isinstance(sensor, ForceSensor)
    ]
    topology = plan.topology
    free = [name for name in plan.body_names if not topology.held[topology.root[topology.numbers([name])]].all()]
    return list(dict.fromkeys(read)) or free[:MOST_MOVING]


def _factor(value: float | None) -> str:
    """A factor on what is there; empty where there is none, or nothing that it could multiply."""
    return "" if value is None or not isfinite(value) else number(value, 3)


def _drive_columns(poses: Sequence[StrokePose]) -> dict[str, Any]:
    """What holds the displacements that are prescribed, and how that grows."""
    columns: dict[str, Any] = {}
    for name in poses[0].move:
        unit, force = UNITS[is_rotation(name)], FORCE_UNITS[is_rotation(name)].replace("*", " ")
        columns[f"reaction {name} [{force}]"] = [p.reaction[name] for p in poses]
        columns[f"drive stiffness {name} [{force}/{unit}]"] = [p.drive_stiffness[name] for p in poses]
    return columns


def _frequency_columns(poses: Sequence[StrokePose], errors: Sequence[ModelError]) -> dict[str, Any]:
    """Frequencies, between which proven bounds they are, how far the part may be, and those with actuators locked."""
    columns: dict[str, Any] = {}
    for k in range(min(len(p.frequency_hz) for p in poses)):
        columns[f"f{k + 1} [Hz]"] = [p.frequency_hz[k] for p in poses]
        for end, name in enumerate(("lower", "upper")):
            columns[f"f{k + 1} {name} [Hz]"] = [p.frequency_interval_hz[k][end] for p in poses]
        if errors:
            for name in ("low", "high"):
                columns[f"f{k + 1} model error, {name}"] = [float(getattr(own, name)[k]) for own in errors]
    columns["proven"] = [p.proven for p in poses]
    for k in range(min(len(p.frequency_hz_held) for p in poses)):
        columns[f"f{k + 1} held [Hz]"] = [p.frequency_hz_held[k] for p in poses]
    return columns


def _displacement_columns(poses: Sequence[StrokePose]) -> dict[str, Any]:
    """How the nodes asked for move: all of it is parasitic but for what is driven."""
    return {
        f"{node} {dof} [{'m' if k < 3 else 'rad'}]": [p.displacement[node][k] for p in poses]
        for node in poses[0].displacement
        for k, dof in enumerate(DOF_NAMES)
    }


def _state_columns(poses: Sequence[StrokePose]) -> dict[str, Any]:
    """Stress, buckling, energy, axes and what the ground exerts."""
    columns: dict[str, Any] = {
        "stress margin": [p.stress_margin for p in poses],
        "stress member": [p.stress_member for p in poses],
        "stress position": [p.stress_position for p in poses],
        "buckling factor": [p.buckling_factor for p in poses],
        "energy [N m]": [p.energy for p in poses],
    }
    for name in poses[0].energy_by_part:
        columns[f"energy {name} [N m]"] = [p.energy_by_part[name] for p in poses]
    for name in poses[0].move:
        axes = [p.screw_axis[name] for p in poses]
        for k, axis in enumerate("xyz"):
            columns[f"axis {name} direction {axis} [1]"] = [own.direction[k] for own in axes]
            columns[f"axis {name} {axis} [m]"] = [own.point[k] for own in axes]
        columns[f"axis {name} pitch [m/rad]"] = [own.pitch for own in axes]
    for k, name in enumerate(FORCES):
        columns[f"ground {name} [{'N' if k < 3 else 'N m'}]"] = [p.ground_reaction[k] for p in poses]
    return columns


def _compliance_columns(poses: Sequence[StrokePose]) -> dict[str, Any]:
    """Compliances and stiffnesses of nodes where they are asked for, an entry above the diagonal each."""
    columns: dict[str, Any] = {}
    for what, units in (("compliance", ("m/N", "1/N", "rad/(N m)")), ("stiffness", ("N/m", "N", "N m/rad"))):
        for held in ("", "_held"):
            tables = [getattr(p, f"{what}{held}") for p in poses]
            for node in tables[0]:
                for i, row in enumerate(DOF_NAMES):
                    for j, column in enumerate(DOF_NAMES[i:], i):
                        heading = f"{what}{held.replace('_', ' ')} {node} {row} {column} [{units[(i > 2) + (j > 2)]}]"
                        columns[heading] = [table[node][i, j] for table in tables]
    return columns
