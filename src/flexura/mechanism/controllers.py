"""Controllers between a sensor and an actuator: what they are, and in which order their filters follow each other."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from flexura.expressions import Dimension
from flexura.mechanism.base import Part, refuse
from flexura.mechanism.quantity import AnyQuantity, DampingRatio, NonNegativeNumber, PositiveFrequency, PositiveTime

GAINS = {"proportional": 0, "integral": -1, "derivative": 1, "gain": 0}
"""Gains of controllers, with the power of time by which their unit differs from actuator over sensor."""


def _coherent(unit: str) -> str:
    if unit and Dimension.of_unit(unit) is None:
        raise refuse("the unit of a gain is a coherent SI unit, e.g. N/m or V/m/s", "values are in SI")
    return unit


def _number_alone(raw: Any) -> Any:
    return raw if isinstance(raw, dict | Part) else {"value": raw}


class GainValue(Part):
    """A gain, SI: what the actuator gets per unit of what the sensor reads, per second or times one for integrals and
    derivatives. `unit` says in which unit that is; a file sets it, Python may leave it out."""

    value: AnyQuantity
    unit: Annotated[str, AfterValidator(_coherent)] = ""


Gain = Annotated[GainValue, BeforeValidator(_number_alone)]


class NotchFilter(Part):
    """(s^2 + 2 depth zeta w s + w^2)/(s^2 + 2 zeta w s + w^2): what is left at its frequency is its depth."""

    frequency: PositiveFrequency
    ratio: DampingRatio = 0.5
    """Damping ratio zeta of the denominator, which makes it wide."""
    depth: NonNegativeNumber = 0.1


class Controller(Part):
    """u = K(s) (reference - reading) at an actuator; with positive position feedback u = K(s) reading.

    `pid`: proportional + integral/s + derivative s, with only those that are given. `iff`, integral force feedback:
    gain/(s + 2 pi leak). `ppf`, positive position feedback: gain w^2/(s^2 + 2 ratio w s + w^2). `lead`: a gain and its
    filter. Filters come behind each of these, then the dead time.
    """

    type: Literal["pid", "lead", "iff", "ppf"] = "pid"
    sensor: str
    actuator: str
    proportional: Gain | None = None
    integral: Gain | None = None
    derivative: Gain | None = None
    gain: Gain | None = None
    """Of types other than `pid`; of integral force feedback per second."""
    leak: PositiveFrequency | None = None
    """Frequency below which force feedback does not integrate, Hz."""
    frequency: PositiveFrequency | None = None
    """That of positive position feedback, Hz."""
    ratio: DampingRatio = 0.3
    """Damping ratio of positive position feedback."""
    lead: tuple[PositiveFrequency, PositiveFrequency] | None = None
    """Frequencies of the zero and of the pole of (1 + s/zero)/(1 + s/pole), Hz; a lag where the pole comes first."""
    low_pass: PositiveFrequency | None = None
    """Frequency of a Butterworth filter of second order, Hz."""
    notches: tuple[NotchFilter, ...] = ()
    delay: PositiveTime | None = None
    """Dead time, s."""
    sample_time: PositiveTime | None = None
    """Step of a sampled controller, whose output is held over each, s."""
    pade: Annotated[int, Field(ge=1, le=8, strict=True)] = 4
    """Order of the rational function that stands for the dead time in states (Pade)."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        pid = [name for name in ("proportional", "integral", "derivative") if getattr(self, name) is not None]
        if self.type == "pid" and not pid:
            raise refuse("no gain is given: a pid has proportional, integral or derivative", "e.g. integral: 40 N/m/s")
        if self.type == "pid" and self.gain is not None:
            raise refuse("a gain belongs to other types: a pid has proportional, integral, derivative")
        if self.type != "pid" and (pid or self.gain is None):
            raise refuse(f"a controller of type {self.type} has one gain, called gain")
        if self.derivative is not None and self.low_pass is None:
            raise refuse("a derivative grows without end: it has a low_pass", "e.g. low_pass: 1 kHz")
        if self.type == "ppf" and self.frequency is None:
            raise refuse("positive position feedback has a frequency", "e.g. that of the mode that it damps")
        if self.type == "lead" and self.lead is None:
            raise refuse("a lead has frequencies of its zero and its pole", "e.g. lead: [30 Hz, 300 Hz]")
        return self

    @property
    def sign(self) -> float:
        """Of the feedback: -1, or 1 where it is positive."""
        return 1.0 if self.type == "ppf" else -1.0

    def order_in_time(self, name: str) -> int:
        """Power of time by which the unit of a gain differs from actuator over sensor."""
        return -1 if self.type == "iff" else GAINS[name]
