"""Temperatures that a mechanism is brought to, by name, as differences from that at which it is described."""

from __future__ import annotations

from typing import Any, NamedTuple

from pydantic import model_validator

from flexura.mechanism.base import Part, Vector
from flexura.mechanism.quantity import Temperature, TemperatureGradient

GROUND = "ground"
"""What stands for all that is held, and has the material `ground_material`."""

UNIFORM = "temperature"
"""Name of the state in which everything, the ground included, is warmer by 1 K."""


class Warmer(Part):
    """By how much something is warmer, K, and how that changes with place, K/m, global axes.

    The temperature is that at `about`, by default in the middle of the thing: of each member, body or part by itself.
    In a homogeneous body that nothing holds such temperatures make no stress.
    """

    temperature: Temperature = 0.0
    gradient: tuple[TemperatureGradient, TemperatureGradient, TemperatureGradient] = (0.0, 0.0, 0.0)
    about: Vector | None = None

    @model_validator(mode="before")
    @classmethod
    def _single(cls, raw: Any) -> Any:
        return {"temperature": raw} if isinstance(raw, int | float | str) and not isinstance(raw, bool) else raw


class Warming(NamedTuple):
    """A state of temperature that is brought on by a command: `share` of what is described, or the `temperature` of
    everything."""

    command: str
    """Name of the command in a description."""
    quantity: str
    """What it is as an input."""


def warmings(described: Any) -> dict[str, Warming]:
    """All states of temperature of a description by name."""
    uniform = {} if UNIFORM in described else {UNIFORM: Warming("temperature", "temperature")}
    return {name: Warming("share", "share") for name in described} | uniform
