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
    known = {kind: placed_channels(survey, kind) for kind in ("actuators", "sensors")}
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


def placed_channels(survey: Survey, kind: str) -> dict[str, Any]:
    """Actuators or sensors as placed, by name."""
    return {
        ".".join((*place, key)): part
        for place, prototype in survey.layout.instances()
        for key, part in getattr(survey.layout.prototypes[prototype], kind).items()
    }


def channel_unit(text: str, kind: str, channels: Mapping[str, Any], nodes: Collection[str]) -> str | None:
    """SI unit of a sensor, or of the command of an actuator or of an input, by name; None where it is not there."""
    if text in channels:
        return _of_sensor(channels[text]) if kind == "sensor" else _of_actuator(channels[text])
    where, _, word = text.partition(":")
    node, _, dof = where.rpartition(".")
    if dof not in DOF_NAMES or word not in _WORDS or not (node in nodes or (node == "ground" and kind != "sensor")):
        return None
    turns = is_rotation(where)
    if kind == "sensor":
        return list(_MOTIONS.values())[3 * turns + _WORDS.index(word)]
    if node == "ground":
        return "rad/s^2" if turns else "m/s^2"
    return "N*m" if turns else "N"


_WORDS = ("", "velocity", "acceleration")


def _units(
    survey: Survey, path: Path, of: Disturbance, known: Mapping[str, Mapping[str, Any]], nodes: Collection[str]
) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Where it acts, and the units that its density may be of."""
    if of.base is not None:
        yield "the floor", FLOOR_UNITS
        return
    key, text = ("input", of.input) if of.input is not None else ("sensor", str(of.sensor))
    what = "sensor" if key == "sensor" else "actuator"
    channels = known[f"{what}s"]
    names = matching(text, channels) if is_pattern(text) else [text]
    found = [(name, unit) for name in names if (unit := channel_unit(name, what, channels, nodes)) is not None]
    yield from ((name, (unit,)) for name, unit in found)
    if not found and not {text, *text.split(".")} & set(survey.ignored):
        hint = suggestion(text, channels, f"{what}s")
        survey.report((*path, key), text, f"there is no such {what}, and no DOF NODE.tx of that name", hint)


def _of_actuator(part: Any) -> str:
    if isinstance(part, BaseMotion | BaseRotation):
        return "rad/s^2" if isinstance(part, BaseRotation) else "m/s^2"
    return _COMMANDS[str(command_of(part))]


def _of_sensor(part: Any) -> str:
    return "N" if isinstance(part, ForceSensor) else _MOTIONS[part.type]
