"""Temperatures that a mechanism is brought to, by name, as differences from that at which it is described."""

from __future__ import annotations

from typing import Any, NamedTuple, Self

from pydantic import model_validator

from flexura.mechanism.base import Part, Vector, refuse
from flexura.mechanism.quantity import Conductance, HeatTransfer, PositiveArea, Power, Temperature, TemperatureGradient

GROUND = "ground"
"""What stands for all that is held, and has the material `ground_material`."""

AIR = "air"
"""What stands for the air around, which keeps its temperature."""

UNIFORM = "temperature"
"""Name of the state in which everything, the ground included, is warmer by 1 K."""


class Warmer(Part):
    """By how much something is warmer, K, and how that changes with place, K/m, global axes.

    The temperature is that at `about`, by default in the middle of the thing: of each member, body or part by itself.
    In a homogeneous body that nothing holds such temperatures make no stress.
    """

    temperature: Temperature | None = None
    power: Power | None = None
    """Heat that goes into it, W. What is said of no temperature takes that of steady conduction then, through members
    and contacts, to what is held at one: the ground and the air, at no difference where nothing else is said."""
    gradient: tuple[TemperatureGradient, TemperatureGradient, TemperatureGradient] = (0.0, 0.0, 0.0)
    about: Vector | None = None

    @model_validator(mode="before")
    @classmethod
    def _single(cls, raw: Any) -> Any:
        return {"temperature": raw} if isinstance(raw, int | float | str) and not isinstance(raw, bool) else raw

    @model_validator(mode="after")
    def _one(self) -> Self:
        if self.power is not None and (self.temperature is not None or any(self.gradient)):
            raise refuse("a power makes its temperature: give one of power, and temperature with gradient")
        if self.power is None and self.temperature is None and not any(self.gradient):
            raise refuse("nothing is given: a temperature, a gradient or a power", "e.g. 2 K, or {power: 2 W}")
        return self


class ThermalContact(Part):
    """What leads heat from one thing to another, to the `ground` or to the `air`, beside members: a `conductance`, W/K,
    or a `coefficient`, W/(m^2 K), and the `area`, m^2, that it is of."""

    between: tuple[str, str]
    conductance: Conductance | None = None
    coefficient: HeatTransfer | None = None
    area: PositiveArea | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.conductance is None) == (self.coefficient is None) or (self.coefficient is None) != (
            self.area is None
        ):
            raise refuse("either a conductance, or a coefficient and its area", "e.g. conductance: 0.5 W/K")
        if self.between[0] == self.between[1]:
            raise refuse("both ends are the same: heat goes from one thing to another")
        return self


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
