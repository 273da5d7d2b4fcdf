"""Isotropic linear-elastic materials, and a small catalogue with sources."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Self

from pydantic import model_validator

from flexura.mechanism.base import Part, Text, refuse
from flexura.mechanism.quantity import (
    Conductivity,
    Density,
    ExpansionCoefficient,
    HeatCapacity,
    NonNegativeNumber,
    Number,
    PerKelvin,
    PositivePressure,
)


class Material(Part):
    """An isotropic material: E and rho with either nu or G, the other elastic constant follows from E = 2G(1 + nu)."""

    E: PositivePressure
    """Young's modulus, Pa."""
    rho: Density
    """Mass density, kg/m^3."""
    nu: Number | None = None
    """Poisson's ratio, -1 < nu <= 0.5."""
    G: PositivePressure | None = None
    """Shear modulus, Pa."""
    loss_factor: NonNegativeNumber | None = None
    """Structural loss factor eta of the complex modulus E(1 + i eta)."""
    yield_stress: PositivePressure | None = None
    """Yield stress (0.2 % proof stress), or the strength of a brittle material, Pa."""
    expansion: ExpansionCoefficient | None = None
    """Coefficient of thermal expansion, 1/K."""
    softening: PerKelvin | None = None
    """Relative change of E and G with temperature, 1/K; negative where a material gets softer."""
    conductivity: Conductivity | None = None
    """Thermal conductivity, W/(m K)."""
    heat_capacity: HeatCapacity | None = None
    """Specific heat capacity, J/(kg K)."""
    source: Text = ""
    """Where the values come from."""

    @model_validator(mode="after")
    def _one_of_nu_and_G(self) -> Self:
        if (self.nu is None) == (self.G is None):
            raise refuse(
                "both, or neither, is given: a material has exactly one of nu and G",
                "the other follows from E = 2 G (1 + nu)",
            )
        if isinstance(self.nu, float) and not -1 < self.nu <= 0.5:
            raise refuse("Poisson's ratio lies in -1 < nu <= 0.5")
        return self


_MMPDS = "room-temperature design values as in MIL-HDBK-5J (2003)"

_ASM = "ASM Aerospace Specification Metals data sheet"
_ASME = "ASME B31.1"

CATALOGUE: dict[str, Material] = {
    "Al-7075-T6": Material(
        E=71.7e9, nu=0.33, rho=2810.0, yield_stress=503e6, expansion=23.6e-6, conductivity=130.0, heat_capacity=960.0,
        source=f"{_ASM}, aluminium 7075-T6 (expansion 20 to 100 C)",
    ),
    "Al-6061-T6": Material(
        E=68.9e9, nu=0.33, rho=2700.0, yield_stress=276e6, expansion=23.6e-6, softening=-5.0e-4, conductivity=167.0,
        heat_capacity=896.0,
        source=f"{_ASM}, aluminium 6061-T6 (expansion 20 to 100 C); softening: slope of NIST's fit of E, 250 to 295 K",
    ),
    "Ti-6Al-4V": Material(
        E=113.8e9, nu=0.342, rho=4430.0, yield_stress=880e6, expansion=8.6e-6, conductivity=6.7, heat_capacity=526.0,
        source=f"{_ASM}, Ti-6Al-4V (grade 5), annealed (expansion 20 to 100 C)",
    ),
    "spring-steel": Material(
        E=206e9, G=79.5e9, rho=7850.0, yield_stress=1400e6, expansion=11.6e-6, softening=-2.5e-4, conductivity=49.0,
        heat_capacity=486.0,
        source="EN 10270-2 moduli for oil-hardened and tempered spring wire; yield typical of hardened C75S strip;"
        f" thermal values of unhardened C70, softening as {_ASME} has it for carbon steel",
    ),
    "17-4PH": Material(
        E=196.5e9, G=77.2e9, rho=7810.0, yield_stress=1172e6, expansion=10.8e-6, softening=-3.3e-4, conductivity=17.9,
        heat_capacity=460.0,
        source=f"stainless 17-4PH, condition H900; {_MMPDS}; AK Steel product bulletin (expansion 21 to 93 C,"
        f" conductivity at 149 C); softening that of chromium steels in {_ASME}",
    ),
    "Invar-36": Material(
        E=141e9, nu=0.29, rho=8050.0, yield_stress=276e6, expansion=1.2e-6, softening=5e-4, conductivity=10.0,
        heat_capacity=515.0,
        source="Carpenter Technology data sheet, Invar 36 alloy, annealed (expansion 25 to 100 C, which depends on the"
        " batch); softening: slope of NIST's fit of E of Fe-36Ni at 293 K, about",
    ),
    "beryllium-copper": Material(
        E=131e9, nu=0.30, rho=8250.0, yield_stress=1130e6, expansion=17e-6, softening=-3.5e-4, conductivity=105.0,
        heat_capacity=420.0,
        source="Materion data sheet, Alloy 25 (C17200), AT temper strip; thermal values: Copper Development Association"
        " publication 54 (1962), softening from -50 to 50 C",
    ),
    "fused-silica": Material(
        E=72.7e9, nu=0.16, rho=2200.0, yield_stress=54e6, expansion=0.52e-6, softening=2.0e-4, conductivity=1.3,
        heat_capacity=770.0,
        source="Corning HPFS 7980 data sheet (expansion 5 to 35 C); the strength is the modulus of rupture of an"
        " abraded surface; softening, which is a stiffening, from Spinner, J. Am. Ceram. Soc. 45 (1962)",
    ),
    "silicon": Material(
        E=169e9, nu=0.064, rho=2329.0, expansion=2.59e-6, softening=-6.4e-5, conductivity=148.0, heat_capacity=712.0,
        source="Hopcroft, Nix, Kenny, J. MEMS 19 (2010) 229-238: <110> direction in a (100) wafer, taken as isotropic,"
        " and its change with temperature; expansion at 25 C; conductivity: Glassbrenner and Slack (1964)",
    ),
}  # fmt: skip
"""Materials that a description may name without defining them."""


def expanding(materials: Iterable[Material]) -> dict[str, Any]:
    """How a part of some materials expands and softens; None where these differ."""
    names, own = ("expansion", "softening"), list(materials)
    each = {name: {getattr(material, name) for material in own} for name in names}
    return {name: next(iter(found)) if len(found) == 1 else None for name, found in each.items()}
