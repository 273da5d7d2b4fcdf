"""Checks of disturbances: what they name is there, and their densities are of what acts or is read there."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from flexura.errors import Path
from flexura.mechanism.channels import BaseMotion, BaseRotation, ForceSensor
from flexura.mechanism.checks.survey import Survey, suggestion
from flexura.mechanism.description import DOF_NAMES, is_rotation
from flexura.mechanism.disturbances import FLOOR_UNITS, Disturbance
from flexura.mechanism.layout import is_pattern, matching
from flexura.mechanism.loads import command_of

_COMMANDS = {"expansion": "m", "voltage": "V", "force": "N", "moment": "N*m", "temperature": "K"}
_MOTIONS = {
    "displacement": "m", "velocity": "m/s", "acceleration": "m/s^2",
    "rotation": "rad", "angular_velocity": "rad/s", "angular_acceleration": "rad/s^2",
}  # fmt: skip


def check_disturbances(survey: Survey, nodes: Collection[str]) -> None:
    """Report disturbances of what is not there among the channels and the `nodes`, and densities of something else."""
    known = {kind: _placed(survey, kind) for kind in ("actuators", "sensors")}
    for name, disturbance in survey.layout.mechanism.disturbances.items():
        path = ("disturbances", name)
        units = _units(survey, path, disturbance, known, nodes)
        key = "density" if disturbance.density is not None else "table"
        unit = disturbance.unit
        for where, allowed in units:
            if disturbance.spectrum is None and unit not in allowed:
                hint = f"the density of {where} is in {' or '.join(f'{own}/sqrt(Hz)' for own in allowed)}"
                survey.report((*path, key), f"{unit}/sqrt(Hz)", f"this is no density of {where}", hint)
                break


def _placed(survey: Survey, kind: str) -> dict[str, Any]:
    return {
        ".".join((*place, key)): part
        for place, prototype in survey.layout.instances()
        for key, part in getattr(survey.layout.prototypes[prototype], kind).items()
    }


def _units(
    survey: Survey, path: Path, of: Disturbance, known: Mapping[str, Mapping[str, Any]], nodes: Collection[str]
) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Where it acts, and the units that its density may be of."""
    if of.base is not None:
        yield "the floor", FLOOR_UNITS
        return
    key = "input" if of.input is not None else "sensor"
    text = str(of.input if of.input is not None else of.sensor)
    channels = known[f"{key if key == 'sensor' else 'actuator'}s"]
    for name in matching(text, channels) if is_pattern(text) else [text] if text in channels else []:
        yield name, (_of_sensor(channels[name]) if key == "sensor" else _of_actuator(channels[name]))
    if text in channels or (is_pattern(text) and matching(text, channels)):
        return
    where, _, word = text.partition(":")
    node, _, dof = where.rpartition(".")
    if dof in DOF_NAMES and (node in nodes or (node == "ground" and key == "input")):
        turns = is_rotation(where)
        if key == "input":
            own = ("rad/s^2" if turns else "m/s^2") if node == "ground" else "N*m" if turns else "N"
        else:
            own = (
                list(_MOTIONS.values())[3 * turns + ("", "velocity", "acceleration").index(word)]
                if word in ("", "velocity", "acceleration")
                else "m"
            )
        yield text, (own,)
    elif not {text, *text.split(".")} & set(survey.ignored):
        what = "actuator" if key == "input" else "sensor"
        hint = suggestion(text, channels, f"{what}s")
        survey.report((*path, key), text, f"there is no such {what}, and no DOF NODE.tx of that name", hint)


def _of_actuator(part: Any) -> tuple[str, ...]:
    if isinstance(part, BaseMotion | BaseRotation):
        return ("rad/s^2",) if isinstance(part, BaseRotation) else FLOOR_UNITS
    command = command_of(part)
    return (_COMMANDS[str(command)],)


def _of_sensor(part: Any) -> tuple[str, ...]:
    return ("N",) if isinstance(part, ForceSensor) else (_MOTIONS[part.type],)
