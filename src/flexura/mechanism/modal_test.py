"""A modal test of the mechanism: where it is hit, where accelerometers sit and what they weigh, how it is recorded."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from flexura.mechanism.base import Direction, Name, Part, Vector, refuse
from flexura.mechanism.quantity import (
    NonNegativeAcceleration,
    NonNegativeForce,
    NonNegativeMass,
    NonNegativeNumber,
    PositiveForce,
    PositiveFrequency,
    PositiveNumber,
    PositiveTime,
)
from flexura.tables import quantity

LEAST_SAMPLES = 64
"""Samples in a record at least."""

LEAST_IN_PULSE = 4
"""Samples in a pulse at least."""


def _in_units(duration: float, rate: float) -> str:
    """A time at a sample rate, and how many samples it has."""
    count = f"{math.floor(1e3 * duration * rate * (1 + 1e-9)) / 1e3:.5g}"
    return f"{quantity(duration, 's')} at {quantity(rate, 'Hz')} has {count}"


class HammerPoint(Part):
    """Where a hammer hits: a place that moves rigidly with a node, and the direction of the force.

    `at` is a position in the axes of the mechanism; the node itself where it is left out.
    """

    node: str
    direction: Direction
    at: Vector | None = None


class Accelerometer(Part):
    """A sensor of acceleration along `direction` at a place that moves rigidly with a node, and its mass, kg."""

    node: str
    direction: Direction
    at: Vector | None = None
    mass: NonNegativeMass = 0.0


class ModalTest(Part):
    """A hammer test. Sensors are on the mechanism, with their mass, in their own placements only.

    Entries of `hammer` and `accelerometers` may also be names of forces among the actuators, and of sensors of
    acceleration, of the mechanism.
    """

    sample_rate: PositiveFrequency
    duration: PositiveTime
    """Length of a record, s."""
    pulse: PositiveTime
    """Length of the hammer pulse from zero to zero, s."""
    hammer: Annotated[dict[Name, HammerPoint | str], Field(min_length=1)]
    accelerometers: Annotated[dict[Name, Accelerometer | str], Field(min_length=1)]
    placements: dict[Name, tuple[str, ...]] = {}
    """Accelerometers of each step of the test; one placement of all where it is left out."""
    hits: Annotated[int, Field(ge=1, le=1000, strict=True)] = 5
    """Hits at every hammer point in every placement."""
    peak: PositiveForce = 10.0
    """Peak of the force, N."""
    peak_scatter: NonNegativeNumber = 0.1
    """Standard deviation of the peak from hit to hit, relative."""
    force_noise: NonNegativeForce = 0.0
    """Standard deviation of the noise of the hammer, N."""
    acceleration_noise: NonNegativeAcceleration = 0.0
    """Standard deviation of the noise of accelerometers, m/s^2."""
    exponential: PositiveNumber | None = None
    """Value at the end of the record of an exponential window."""
    force_window: PositiveTime | None = None
    """How long the force counts from the beginning of the pulse, s."""
    band: tuple[PositiveFrequency, PositiveFrequency] | None = None
    """Frequencies between which modes are identified, Hz."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        rate, duration, pulse = self.sample_rate, self.duration, self.pulse
        if isinstance(rate, float) and isinstance(duration, float) and rate * duration < LEAST_SAMPLES:
            text = f"a record of {_in_units(duration, rate)} samples; at least {LEAST_SAMPLES} are needed"
            raise refuse(text, "record longer or faster")
        if isinstance(rate, float) and isinstance(pulse, float) and rate * pulse < LEAST_IN_PULSE:
            text = f"a pulse of {_in_units(pulse, rate)} samples; at least {LEAST_IN_PULSE} are needed"
            raise refuse(text, "sample faster, or give a longer pulse")
        if isinstance(duration, float) and isinstance(pulse, float) and pulse > duration / 4:
            share = f"a pulse of {quantity(pulse, 's')} in a record of {quantity(duration, 's')}"
            raise refuse(f"{share}: it takes at most a quarter of it", "record longer, or give a shorter pulse")
        if isinstance(self.exponential, float) and self.exponential > 1:
            raise refuse("above 1 it would grow: the exponential window ends between 0 and 1", "e.g. exponential: 0.01")
        low, high = self.band or (0.0, 1.0)
        if isinstance(low, float) and isinstance(high, float) and low >= high:
            raise refuse("it is empty: a band is from a lower to a higher frequency")
        for name, members in self.placements.items():
            if not members:
                raise refuse(f"placement {name} holds no accelerometer")
            if len(set(members)) < len(members):
                raise refuse(f"placement {name} holds an accelerometer twice")
        return self

    def placed(self) -> dict[str, tuple[str, ...]]:
        """Accelerometers of every placement."""
        return dict(self.placements) or {"": tuple(self.accelerometers)}
