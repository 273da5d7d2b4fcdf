"""Doubts about materials: constants that no material has, and the unit that was probably meant."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flexura.errors import Diagnostic
from flexura.mechanism import Layout, Material, Scalar, evaluated
from flexura.tables import quantity


@dataclass(frozen=True)
class _Class:
    """Ranges of Young's modulus, Pa, and density, kg/m^3, that a class of materials fills together."""

    name: str
    modulus: tuple[float, float]
    density: tuple[float, float]
    specific: float = math.inf
    """Largest ratio of the two, m^2/s^2."""

    def holds(self, E: float, rho: float) -> bool:
        """Whether a modulus and a density lie within the class together."""
        return (
            self.modulus[0] <= E <= self.modulus[1]
            and self.density[0] <= rho <= self.density[1]
            and self.specific * rho >= E
        )


# M. F. Ashby, Materials Selection in Mechanical Design, 4th ed. (2011), charts of modulus and density; dense solids
CLASSES = (
    _Class("metals", (10e9, 580e9), (1600.0, 23000.0)),
    _Class("ceramics, glasses and silicon", (40e9, 1250e9), (1700.0, 16500.0)),
    _Class("composites and woods", (0.5e9, 500e9), (100.0, 2300.0), 2.3e8),
    _Class("polymers and elastomers", (0.3e6, 25e9), (750.0, 2400.0)),
    _Class("foams", (1e4, 2e9), (5.0, 1000.0), 3e6),
)

KNOWN = {
    "steel": (206e9, 7850.0),
    "aluminium": (70e9, 2700.0),
    "titanium": (114e9, 4430.0),
    "copper alloy": (125e9, 8500.0),
    "magnesium": (45e9, 1780.0),
    "tungsten": (400e9, 19300.0),
    "silicon": (169e9, 2329.0),
    "fused silica": (72.7e9, 2200.0),
    "alumina": (380e9, 3900.0),
    "zirconia": (205e9, 6050.0),
    "PEEK": (3.6e9, 1300.0),
}
"""Young's moduli, Pa, and densities, kg/m^3, to name a material that was probably meant."""

MODULUS_UNITS = {1e9: "GPa", 1e6: "MPa", 1e3: "kPa", 1.0: "Pa"}
DENSITY_UNITS = {1e3: "g/cm^3", 1.0: "kg/m^3", 1e12: "t/mm^3", 1e9: "kg/mm^3", 1e6: "g/mm^3", 1e-3: "g/m^3"}
PSI = 6894.757
NEAR = 0.35
"""Relative distance in E and rho within which a material is named."""

POISSON = (0.0, 0.5)
"""Poisson's ratios of ordinary isotropic materials."""

STRENGTH = (3e-5, 0.08)
"""Yield stress over Young's modulus of metals, ceramics, silicon and stiff polymers."""


def material_doubts(layout: Layout, values: Mapping[str, Any]) -> list[Diagnostic]:
    """Doubts about the materials of a mechanism, its own and those in use, at parameter values in SI."""
    doubts: list[Diagnostic] = []
    for name in dict.fromkeys([*layout.mechanism.materials, *_used(layout)]):
        material = evaluated(layout.mechanism.material(name), values)
        doubts += _of_material(f"materials.{name}", material)
    return doubts


def _used(layout: Layout) -> Iterator[str]:
    """Names of materials of members and solids."""
    for part in layout.prototypes.values():
        for member in (*part.links.values(), *part.flexures.values()):
            yield member.material
        for body in part.bodies.values():
            if body.solid is not None:
                yield body.solid.material


def _of_material(place: str, material: Material) -> Iterator[Diagnostic]:
    E, rho = _number(material.E), _number(material.rho)
    if not any(c.holds(E, rho) for c in CLASSES):
        text = f"no metal, ceramic, polymer, composite or silicon has E = {_modulus(E)} with rho = {rho:.4g} kg/m^3"
        yield Diagnostic.about("material", text + _meant(E, rho), place)
    if material.G is not None:
        G = _number(material.G)
        nu = E / (2 * G) - 1
        if not POISSON[0] <= nu <= POISSON[1]:
            usual = f"{_modulus(E / 3)} to {_modulus(E / 2)}"
            factor = _slip(G, (E / 3.2, E / 1.9), MODULUS_UNITS)
            hint = f"; did you mean G = {factor}?" if factor else f"; with this E, G lies between {usual}"
            text = f"E = {_modulus(E)} and G = {_modulus(G)} give Poisson's ratio {nu:.3g}{hint}"
            yield Diagnostic.about("material", text, place)
    elif material.nu is not None and not POISSON[0] <= _number(material.nu) <= POISSON[1]:
        text = f"Poisson's ratio {_number(material.nu):.3g}: ordinary materials have 0 to 0.5"
        yield Diagnostic.about("material", text, place)
    if material.yield_stress is not None:
        stress = _number(material.yield_stress)
        if E >= 0.5e9 and not STRENGTH[0] <= stress / E <= STRENGTH[1]:
            meant = _slip(stress, (3e-4 * E, 0.06 * E), MODULUS_UNITS)
            hint = f"; did you mean {meant}?" if meant else ""
            ratio = f"{stress / E:.2g} of E = {_modulus(E)}, where materials have {STRENGTH[0]:g} to {STRENGTH[1]:g}"
            yield Diagnostic.about("material", f"yield stress {_modulus(stress)} is {ratio}{hint}", place)


def _meant(E: float, rho: float) -> str:
    """What was probably meant: another unit of the modulus, of the density, or both, that makes a known material."""
    choices = []
    for modulus, modulus_text in _readings(E, MODULUS_UNITS):
        for density, density_text in _readings(rho, DENSITY_UNITS):
            for name, (known_E, known_rho) in KNOWN.items():
                off = max(abs(math.log(modulus / known_E)), abs(math.log(density / known_rho)))
                if off < math.log(1 + NEAR):
                    changes = (modulus_text != "") + (density_text != "")
                    written = [
                        *([f"E = {modulus_text}"] if modulus_text else []),
                        *([f"rho = {density_text}"] if density_text else []),
                    ]
                    has = f"{name} has E = {_modulus(known_E)} and rho = {known_rho:.4g} kg/m^3"
                    odd = _odd(modulus_text) + _odd(density_text)
                    choices.append((changes, odd, off, f"; {has}: did you mean {' and '.join(written)}?"))
    return min(choices)[3] if choices else "; check the units of both"


def _readings(value: float, units: Mapping[float, str]) -> Iterator[tuple[float, str]]:
    """A value, and the same number in other units, with the text that says so."""
    yield value, ""
    for factor, unit in units.items():
        number = value / factor
        if units is DENSITY_UNITS and unit not in ("kg/m^3", "g/cm^3"):
            continue
        if not 1e-12 < abs(number) < 1e13:
            continue
        for other, name in units.items():
            if other != factor:
                yield number * other, f"{number:.4g} {name} in place of {number:.4g} {unit}"
    if units is MODULUS_UNITS:
        for factor, unit in units.items():
            yield value / factor * PSI, f"{value / factor:.4g} psi in place of {value / factor:.4g} {unit}"


def _slip(value: float, span: tuple[float, float], units: Mapping[float, str]) -> str:
    """The reading of a value in another unit that lies within a span; empty where there is none."""
    fitting = [(_odd(text), text) for v, text in _readings(value, units) if text and span[0] <= v <= span[1]]
    return min(fitting)[1] if fitting else ""


def _odd(text: str) -> float:
    """How unlikely it is that somebody wrote a number: decades from 30."""
    return abs(math.log10(float(text.rpartition("in place of ")[2].partition(" ")[0])) - 1.5) if text else 0.0


def _modulus(value: float) -> str:
    """A modulus or stress in the unit that reads best."""
    for factor, unit in MODULUS_UNITS.items():
        if value >= factor:
            return f"{value / factor:.4g} {unit}"
    return quantity(value, "Pa", 4)


def _number(value: Scalar) -> float:
    return float(value)  # type: ignore[arg-type]
