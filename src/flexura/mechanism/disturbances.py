"""What disturbs a mechanism: floors that shake, noise of actuators and sensors, random forces, by their densities."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from flexura.expressions import Dimension
from flexura.expressions import dimension as dim
from flexura.mechanism.base import Direction, Part, refuse
from flexura.mechanism.quantity import NonNegativeFrequency, PositiveFrequency

DENSITY_UNITS = ("m", "rad", "m/s", "rad/s", "m/s^2", "rad/s^2", "N", "N*m", "V", "K")
"""SI units of what a density may be of."""

FLOOR_UNITS = ("m/s^2", "m/s", "m")
"""Those of a floor: its acceleration, its velocity or its displacement."""

Floor = Literal[
    "ISO workshop", "ISO office", "ISO residential", "ISO operating theatre",
    "VC-A", "VC-B", "VC-C", "VC-D", "VC-E", "VC-F", "VC-G",
]  # fmt: skip
FLOORS: dict[Floor, tuple[float, bool]] = {
    "ISO workshop": (800e-6, True),
    "ISO office": (400e-6, True),
    "ISO residential": (200e-6, True),
    "ISO operating theatre": (100e-6, True),
    "VC-A": (50e-6, True),
    "VC-B": (25e-6, True),
    "VC-C": (12.5e-6, False),
    "VC-D": (6.25e-6, False),
    "VC-E": (3.12e-6, False),
    "VC-F": (1.56e-6, False),
    "VC-G": (0.78e-6, False),
}
"""RMS velocity, m/s, in every one-third octave band up to 80 Hz, and whether the curve is one of constant acceleration
from 4 to 8 Hz; others go down to 1 Hz at constant velocity (Gordon 1991, Proc. SPIE 1619, 22; Gordon 1999, Proc. SPIE
3786, 22; Amick, Gendreau, Busch and Gordon 2005, Proc. SPIE 5933; IEST-RP-CC012)."""

KNEE, FLOOR_TOP = 8.0, 80.0
"""Hz: up to where acceleration is constant, and where the curves end."""


def _of_density(unit: str) -> str:
    if unit not in DENSITY_UNITS:
        raise refuse(f"a density is of one of {', '.join(DENSITY_UNITS)}, in SI", "e.g. Density(value=5e-9, unit='V')")
    return unit


DensityUnit = Annotated[str, AfterValidator(_of_density)]
Size = Annotated[float, Field(ge=0, allow_inf_nan=False)]


def density_base(dimension: Dimension) -> tuple[str, bool] | None:
    """The unit of what a density of some dimension is of, and whether it is one of power, so that its root is that of
    amplitude; None where it is no density of anything that may disturb."""
    for unit in DENSITY_UNITS:
        base = Dimension.of_unit(unit)
        assert base is not None
        if dimension == base.times(dim.TIME.power(Fraction(1, 2))):
            return unit, False
        if dimension == base.times(base).times(dim.TIME):
            return unit, True
    return None


def _short(value: float) -> str:
    return repr(value).removesuffix(".0")


class Density(Part):
    """One amplitude density at all frequencies, one-sided: `value` in `unit` over the root of Hz."""

    value: Size
    unit: DensityUnit

    @property
    def written(self) -> str:
        """As a file has it, e.g. `5e-09 V/sqrt(Hz)`."""
        return f"{_short(self.value)} {self.unit}/sqrt(Hz)"


class DensityTable(Part):
    """Amplitude densities, one-sided, at frequencies, Hz, that rise: `values` in `unit` over the root of Hz. Between
    them the density of power goes on in straight lines; beyond them there is nothing."""

    frequency_hz: Annotated[tuple[Size, ...], Field(min_length=2)]
    values: tuple[Size, ...]
    unit: DensityUnit

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if len(self.values) != len(self.frequency_hz):
            raise refuse(f"{len(self.frequency_hz)} frequencies have {len(self.values)} densities: each has one")
        if any(low >= high for low, high in pairwise(self.frequency_hz)):
            raise refuse("the frequencies of a table rise from one to the next", "sort the rows, each frequency once")
        return self

    @property
    def written(self) -> list[list[str]]:
        """As a file has it."""
        rows = zip(self.frequency_hz, self.values, strict=True)
        return [[f"{_short(hz)} Hz", f"{_short(value)} {self.unit}/sqrt(Hz)"] for hz, value in rows]


class Disturbance(Part):
    """What acts where, and its density: the floor along `base`, noise of an `input` or of a `sensor`.

    Each has one of `spectrum`, `density` and `table`. Names may have wildcards: each match then has noise of its own,
    as dense as that of the others and independent of it.
    """

    base: Direction | None = None
    """Direction along which everything that is grounded moves."""
    input: str | None = None
    """An actuator, in the unit of its command, or a force or moment on a DOF such as `stage.tx`."""
    sensor: str | None = None
    """A sensor, or a DOF as it is read, whose reading has noise, which shakes nothing unless a loop is closed."""
    spectrum: Floor | None = None
    """A criterion for floors: exactly what it allows in every one-third octave band, as a density of acceleration."""
    density: Density | None = None
    """The same at all frequencies, or in a band."""
    table: DensityTable | None = None
    corner: PositiveFrequency | None = None
    """Frequency below which power rises as 1/f: the density is that far above it times 1 + corner/f."""
    band: tuple[NonNegativeFrequency, PositiveFrequency] | None = None
    """Frequencies between which there is any; all where it is left out, and those of the curve or the table."""

    @model_validator(mode="after")
    def _one(self) -> Self:
        if sum(where is not None for where in (self.base, self.input, self.sensor)) != 1:
            raise refuse("several, or none, are given: a disturbance has one of base, input, sensor", "e.g. base: z")
        given = [name for name in ("spectrum", "density", "table") if getattr(self, name) is not None]
        if len(given) != 1:
            raise refuse(
                "several, or none, are given: a disturbance has one of spectrum, density, table",
                "e.g. density: 5 nV/sqrt(Hz)",
            )
        if self.spectrum is not None and self.base is None:
            raise refuse("a criterion for floors is of the motion of the base", "e.g. {base: z, spectrum: VC-C}")
        low, high = self.band or (0.0, 1.0)
        if isinstance(low, float) and isinstance(high, float) and low >= high:
            raise refuse("it is empty: a band is from a lower to a higher frequency")
        if self.base is not None and self.density is not None and self.unit in FLOOR_UNITS[1:] and self.band is None:
            raise refuse("a floor with one density of velocity or displacement shakes without end: it has a band")
        if self.corner is not None and self.density is None:
            raise refuse("a corner belongs to a density", "e.g. {density: 5 nV/sqrt(Hz), corner: 10 Hz}")
        if self.corner is not None and (self.band is None or low == 0):
            raise refuse("1/f is infinite at zero: with a corner there is a band that begins above it")
        return self

    @property
    def unit(self) -> str:
        """SI unit of what the density is of."""
        of = self.density or self.table
        return "m/s" if of is None else of.unit
