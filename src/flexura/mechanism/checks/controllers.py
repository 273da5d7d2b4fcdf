"""Checks of controllers: their sensor and actuator are there, and gains are in units of one over the other."""

from __future__ import annotations

from collections.abc import Collection
from fractions import Fraction
from typing import Any

from flexura.errors import Path
from flexura.expressions import Dimension
from flexura.expressions import dimension as dim
from flexura.mechanism.checks.disturbances import channel_unit, placed_channels
from flexura.mechanism.checks.survey import Survey, suggestion
from flexura.mechanism.controllers import GAINS, Controller
from flexura.mechanism.layout import is_pattern, matching


def check_controllers(survey: Survey, nodes: Collection[str]) -> None:
    """Report controllers without a sensor or an actuator that is there, and gains in other units."""
    known = {"sensor": placed_channels(survey, "sensors"), "actuator": placed_channels(survey, "actuators")}
    for name, controller in survey.layout.mechanism.controllers.items():
        path, units = ("controllers", name), []
        for key, channels in known.items():
            text = getattr(controller, key)
            first = next(iter(matching(text, channels)), text) if is_pattern(text) else text
            unit = channel_unit(first, key, channels, nodes)
            if unit is not None and (key == "sensor" or not unit.endswith("/s^2")):
                units.append(unit)
            elif unit is not None:
                survey.report((*path, key), text, "a controller moves no base", "name an actuator, or a DOF NODE.tx")
            elif not {text, *text.split(".")} & set(survey.ignored):
                hint = suggestion(text, channels, f"{key}s")
                survey.report((*path, key), text, f"there is no such {key}, and no DOF NODE.tx of that name", hint)
        if len(units) == 2:
            _gains(survey, path, controller, units[0], units[1])


def _gains(survey: Survey, path: Path, controller: Controller, sensor: str, actuator: str) -> None:
    above, below = Dimension.of_unit(actuator), Dimension.of_unit(sensor)
    assert above is not None and below is not None
    for name in GAINS:
        gain: Any = getattr(controller, name)
        if gain is None or not gain.unit:
            continue
        power = controller.order_in_time(name)
        if Dimension.of_unit(gain.unit) != above.times(below, -1).times(dim.TIME.power(Fraction(power))):
            per = {-1: "/s", 0: "", 1: "*s"}[power]
            hint = f"from {sensor} to {actuator}: in ({actuator})/({sensor}){per}"
            survey.report((*path, name), gain.unit, "a gain of other units is expected here", hint)
