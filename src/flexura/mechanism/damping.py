"""Damping: of the mechanism as a whole, and discrete dashpots."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, model_validator

from flexura.mechanism.base import Part, Vector, refuse
from flexura.mechanism.body import Rotation
from flexura.mechanism.quantity import (
    DampingRatio,
    NonNegativeNumber,
    PositiveFrequency,
    RotationalDamping,
    TranslationalDamping,
)


class DampingBand(Part):
    """One damping ratio for all modes up to a frequency."""

    up_to: PositiveFrequency
    ratio: DampingRatio


class Rayleigh(Part):
    """C = alpha M + beta K, from damping ratios at two frequencies (Rayleigh 1877)."""

    frequencies: tuple[PositiveFrequency, PositiveFrequency]
    """Hz, the lower one first."""
    ratios: tuple[DampingRatio, DampingRatio]

    @model_validator(mode="after")
    def _order(self) -> Self:
        low, high = self.frequencies
        if isinstance(low, float) and isinstance(high, float) and low >= high:
            raise refuse(
                "equal, or in the wrong order: the two frequencies of Rayleigh damping differ, the lower one first"
            )
        zeta_low, zeta_high = self.ratios
        if all(isinstance(x, float) for x in (low, high, zeta_low, zeta_high)) and not (
            zeta_low * high >= zeta_high * low and zeta_high * high >= zeta_low * low  # type: ignore[operator]
        ):
            raise refuse("these ratios need a negative alpha or beta", "bring the two ratios closer together")
        return self


class Damping(Part):
    """Damping of the mechanism as a whole; all that is given acts together, with dashpots and loss factors of parts.

    `ratio` is the modal damping ratio of all modes, `bands` and `ratios` those of the modes in frequency bands and of
    the lowest ones in order, where given instead.
    """

    ratio: DampingRatio = 0.0
    ratios: tuple[DampingRatio, ...] = ()
    bands: tuple[DampingBand, ...] = ()
    rayleigh: Rayleigh | None = None
    loss_factor: NonNegativeNumber | None = None
    """Structural loss factor of everything elastic that has none of its own."""

    @model_validator(mode="before")
    @classmethod
    def _single(cls, raw: Any) -> Any:
        return {"ratio": raw} if isinstance(raw, int | float | str) and not isinstance(raw, bool) else raw

    @model_validator(mode="after")
    def _rising(self) -> Self:
        limits = [band.up_to for band in self.bands if isinstance(band.up_to, float)]
        if any(a >= b for a, b in pairwise(limits)):
            raise refuse("one begins below the one before it: bands are in order of their frequencies")
        return self


class DiagonalDamping(Part):
    """Viscous coefficients along and about the three axes of a dashpot."""

    tx: TranslationalDamping = 0.0
    ty: TranslationalDamping = 0.0
    tz: TranslationalDamping = 0.0
    rx: RotationalDamping = 0.0
    ry: RotationalDamping = 0.0
    rz: RotationalDamping = 0.0


def _list(raw: Any) -> Any:
    return tuple(raw) if isinstance(raw, list) else raw


class Dashpot(Part):
    """A viscous damper from a node to ground, or between two nodes; it acts at `at` as a spring does."""

    nodes: Annotated[tuple[str, ...], BeforeValidator(_list), Field(min_length=1, max_length=2)]
    damping: DiagonalDamping
    at: Vector | None = None
    rotate: Rotation | None = None
    """Turns the axes of the dashpot."""
