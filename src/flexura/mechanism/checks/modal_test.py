"""Checks of the names in a modal test."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from flexura.errors import Path
from flexura.mechanism.channels import ForceActuator, MotionSensor
from flexura.mechanism.checks.survey import Survey, Use, suggestion
from flexura.mechanism.modal_test import Accelerometer, HammerPoint

_TYPES = ("force", "acceleration")
Find = Callable[[Path, str], list[str]]


def check_test(survey: Survey, find: Find) -> Iterator[Use]:
    """Report nodes, actuators, sensors and accelerometers of a test that are not there; `find` resolves nodes."""
    test = survey.layout.mechanism.test
    if test is None:
        return
    for key, point in test.hammer.items():
        path: Path = ("test", "hammer", key)
        if isinstance(point, HammerPoint):
            yield Use(path, find((*path, "node"), point.node), joins=False)
        else:
            _described(survey, path, point, "actuators")
    for key, sensor in test.accelerometers.items():
        path = ("test", "accelerometers", key)
        if isinstance(sensor, Accelerometer):
            yield Use(path, find((*path, "node"), sensor.node), joins=False)
        else:
            _described(survey, path, sensor, "sensors")
    for key, members in test.placements.items():
        for i, member in enumerate(members):
            if member not in test.accelerometers:
                hint = suggestion(member, test.accelerometers, "accelerometers")
                survey.report(("test", "placements", key, i), member, "the test has no such accelerometer", hint)


def _described(survey: Survey, path: Path, name: str, kind: str) -> None:
    """Report a name that is no force, or no sensor of acceleration at one node, of the mechanism or an instance."""
    what = "a force at one node" if kind == "actuators" else "a sensor of acceleration at one node"
    *inside, key = name.split(".")
    known: dict[str, object] = {}
    for place, prototype in survey.layout.instances() if inside else [((), "")]:
        own = getattr(survey.layout.prototypes[prototype], kind)
        known |= {".".join((*place, k)): part for k, part in own.items()}
    found = known.get(name)
    if found is None:
        if key not in survey.ignored and not (set(inside) & survey.lost[""]):
            survey.report(path, name, f"this is the name of none of the {kind}", suggestion(name, known, kind))
    elif not isinstance(found, ForceActuator | MotionSensor) or len(found.nodes) > 1 or found.type not in _TYPES:
        survey.report(path, name, f"{what} is expected here", "or a mapping with node and direction")
