"""What may be a slip of the description: constants that no material has, degrees that count as radians, sizes that are
a unit away from those of the parts beside them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from flexura.analysis.model_error import place_of
from flexura.errors import Diagnostic, Path
from flexura.expressions import Binary, Call, Expression, Folded, Name, Negative, Tree
from flexura.mechanism import Layout, Material, Mechanism, Scalar, evaluated, scalars
from flexura.structure import FullOrderModel
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

NEAR_KNOWN = 0.35
"""Relative distance in E and rho within which a material is named."""

MODULUS_UNITS = {"GPa": 1e9, "MPa": 1e6, "kPa": 1e3, "Pa": 1.0}
MEANT_MODULUS_UNITS = {**MODULUS_UNITS, "psi": 6894.757}
DENSITY_UNITS = {"g/cm^3": 1e3, "kg/m^3": 1.0}
MEANT_DENSITY_UNITS = {**DENSITY_UNITS, "t/mm^3": 1e12, "kg/mm^3": 1e9, "g/mm^3": 1e6, "g/m^3": 1e-3}

WRITTEN = (1e-12, 1e13)
"""Numbers that somebody may have written."""

USUAL_DECADE = 1.5
"""Decimal logarithm of the number that somebody has most likely written."""

POISSON = (0.0, 0.5)
"""Poisson's ratios of ordinary isotropic materials."""

STRENGTH = (3e-5, 0.08)
"""Yield stress over Young's modulus of metals, ceramics, silicon and stiff polymers."""


def material_warnings(layout: Layout, values: Mapping[str, Any]) -> list[Diagnostic]:
    """Warnings about the materials of a mechanism, its own and those in use, at parameter values in SI."""
    parts = layout.prototypes.values()
    used = [member.material for part in parts for _, _, member in part.members()]
    used += [body.solid.material for part in parts for body in part.bodies.values() if body.solid is not None]
    return [
        Diagnostic.about("material", text, f"materials.{name}")
        for name in dict.fromkeys([*layout.mechanism.materials, *used])
        for text in _doubtful_constants(evaluated(layout.mechanism.material(name), values))
    ]


def _doubtful_constants(material: Material) -> Iterator[str]:
    """What is doubtful of the constants of a material."""
    E, rho = _number(material.E), _number(material.rho)
    if not any(c.holds(E, rho) for c in CLASSES):
        text = f"no metal, ceramic, polymer, composite or silicon has E = {_modulus(E)} with rho = {rho:.4g} kg/m^3"
        yield text + _meant_material(E, rho)
    if material.G is not None:
        G = _number(material.G)
        nu = E / (2 * G) - 1
        if not POISSON[0] <= nu <= POISSON[1]:
            meant = _meant_modulus(G, (E / 3.2, E / 1.9))
            usual = f"{_modulus(E / 3)} to {_modulus(E / 2)}"
            hint = f"; did you mean G = {meant}?" if meant else f"; with this E, G lies between {usual}"
            yield f"E = {_modulus(E)} and G = {_modulus(G)} give Poisson's ratio {nu:.3g}{hint}"
    elif material.nu is not None and not POISSON[0] <= _number(material.nu) <= POISSON[1]:
        yield f"Poisson's ratio {_number(material.nu):.3g}: ordinary materials have 0 to 0.5"
    if material.yield_stress is not None:
        stress = _number(material.yield_stress)
        if E >= 0.5e9 and not STRENGTH[0] <= stress / E <= STRENGTH[1]:
            meant = _meant_modulus(stress, (3e-4 * E, 0.06 * E))
            hint = f"; did you mean {meant}?" if meant else ""
            ratio = f"{stress / E:.2g} of E = {_modulus(E)}, where materials have {STRENGTH[0]:g} to {STRENGTH[1]:g}"
            yield f"yield stress {_modulus(stress)} is {ratio}{hint}"


class _Reading(NamedTuple):
    """What a number is in another unit, which a text says; empty for the number as it stands. `oddity` is how unlikely
    it is that somebody wrote the number, in decades."""

    value: float
    text: str = ""
    oddity: float = 0.0


def _readings(value: float, units: Mapping[str, float], meant_units: Mapping[str, float]) -> Iterator[_Reading]:
    """Readings of a value that was written in one of some units where another one was meant."""
    for unit, factor in units.items():
        number = value / factor
        if WRITTEN[0] < abs(number) < WRITTEN[1]:
            oddity = abs(math.log10(float(f"{number:.4g}")) - USUAL_DECADE)
            for meant, meant_factor in meant_units.items():
                if meant != unit:
                    text = f"{number:.4g} {meant} in place of {number:.4g} {unit}"
                    yield _Reading(number * meant_factor, text, oddity)


def _meant_material(E: float, rho: float) -> str:
    """What was probably meant: another unit of the modulus, of the density, or both, that makes a known material."""
    choices = []
    for modulus in (_Reading(E), *_readings(E, MODULUS_UNITS, MEANT_MODULUS_UNITS)):
        for density in (_Reading(rho), *_readings(rho, DENSITY_UNITS, MEANT_DENSITY_UNITS)):
            for name, (known_E, known_rho) in KNOWN.items():
                distance = max(abs(math.log(modulus.value / known_E)), abs(math.log(density.value / known_rho)))
                if distance < math.log(1 + NEAR_KNOWN):
                    readings = (("E", modulus), ("rho", density))
                    changes = [f"{symbol} = {reading.text}" for symbol, reading in readings if reading.text]
                    has = f"{name} has E = {_modulus(known_E)} and rho = {known_rho:.4g} kg/m^3"
                    hint = f"; {has}: did you mean {' and '.join(changes)}?"
                    choices.append((len(changes), modulus.oddity + density.oddity, distance, hint))
    return min(choices)[3] if choices else "; check the units of both"


def _meant_modulus(value: float, span: tuple[float, float]) -> str:
    """The reading of a modulus or stress in another unit that lies within a span; empty where there is none."""
    readings = _readings(value, MODULUS_UNITS, MEANT_MODULUS_UNITS)
    return min(((own.oddity, own.text) for own in readings if span[0] <= own.value <= span[1]), default=(0.0, ""))[1]


def _modulus(value: float) -> str:
    """A modulus or stress in the unit that reads best."""
    for unit, factor in MODULUS_UNITS.items():
        if value >= factor:
            return f"{value / factor:.4g} {unit}"
    return quantity(value, "Pa", 4)


def _number(value: Scalar) -> float:
    return float(value)  # type: ignore[arg-type]


TURN = 2 * math.pi
"""An angle beyond a full turn, rad, is hardly one in radians."""


def angle_warnings(mechanism: Mechanism, values: Mapping[str, Any]) -> list[Diagnostic]:
    """Arguments of sin, cos and tan, and angles, beyond a full turn that neither have a unit nor are made from pi, for
    parameter values in SI; each once, at the parameter that it comes from where there is one."""
    warnings: dict[str, Diagnostic] = {}
    for path, kind, value in scalars(mechanism):
        tree = value.tree if isinstance(value, Expression | Folded) else None
        angles: list[tuple[str, Tree | None, float]] = []
        for call in _nodes(tree) if tree is not None else ():
            if isinstance(call, Call) and call.function in ("sin", "cos", "tan"):
                argument = Expression(call.arguments[0])
                size = float(argument.evaluate(values))
                angles.append((f"{call.function}({argument})", argument.tree, size))
        if kind.angle:
            size = float(value.evaluate(values) if isinstance(value, Expression) else value)
            angles.append(("the angle" if tree is None else str(Expression(tree)), tree, size))
        for what, angle, size in angles:
            degrees = math.degrees(size)
            is_beyond = math.isfinite(size) and abs(size) > TURN * (1 + 1e-9)
            # one that has a unit is a whole number of degrees
            if is_beyond and abs(degrees - round(degrees)) > 1e-9 * abs(degrees) and not _has_pi(angle, mechanism):
                text = f"{what}: {size:g} without a unit is in radians, {size / TURN:.3g} turns"
                place = _place_of_unit(path, angle, mechanism)
                warnings.setdefault(place, Diagnostic.about("angle", f"{text}; did you mean {size:g} deg?", place))
    return list(warnings.values())


def _nodes(tree: Tree) -> Iterator[Tree]:
    """A tree and all below it."""
    yield tree
    match tree:
        case Negative(operand):
            yield from _nodes(operand)
        case Binary(_, left, right):
            yield from _nodes(left)
            yield from _nodes(right)
        case Call(_, arguments):
            for argument in arguments:
                yield from _nodes(argument)


def _has_pi(tree: Tree | None, mechanism: Mechanism) -> bool:
    """Whether pi stands in a tree, or in the parameters that it refers to."""
    pending, seen = [tree] if tree is not None else [], set[str]()
    while pending:
        names = {node.id for node in _nodes(pending.pop()) if isinstance(node, Name)} - seen
        if "pi" in names:
            return True
        seen |= names
        for name in names & {*mechanism.parameters}:
            value = mechanism.parameters[name].value
            pending += [value.tree] if isinstance(value, Expression | Folded) else []
    return False


def _place_of_unit(path: Path, tree: Tree | None, mechanism: Mechanism) -> str:
    """Where to write the unit: at the parameter, where one alone is meant, or at the expression."""
    if isinstance(tree, Name) and not isinstance(mechanism.parameters[tree.id].value, Expression):
        return f"parameters.{tree.id}"
    keys = path[:-1] if path[0] == "parameters" and path[-1] == "value" else path
    return ".".join(map(str, keys))


SLIP = 0.3
"""A size is a unit off when it is within this share of a power of UNIT_STEPS times that of others."""

UNIT_STEPS = (1e3, 1e6, 1e-3, 1e-6)
"""From one unit to the next: um, mm, m."""


class _Size(NamedTuple):
    """A length, m, of a part, by its name in the description; `sort` is what it is compared within."""

    sort: str
    place: str
    name: str
    value: float


def size_warnings(full: FullOrderModel) -> Iterator[Diagnostic]:
    """Leaves thicker than long, and lengths that differ from the median of others like them by a change of unit."""
    yield from _thicker_than_long(full)
    sorts: dict[str, list[_Size]] = {}
    for size in _sizes(full):
        if size.value > 0:
            sorts.setdefault(size.sort, []).append(size)
    for sort, sizes in sorts.items():
        values = np.array([size.value for size in sizes])
        if len(sizes) == 2:  # the larger one beside the other
            larger = int(np.argmax(values))
            compared, typical = [sizes[larger]], float(values[1 - larger])
        else:
            compared, typical = sizes, float(np.median(values))
        for size in compared:
            ratio = size.value / typical
            if any(abs(ratio / step - 1) <= SLIP for step in UNIT_STEPS):
                times = f"{ratio:.4g} times" if ratio > 1 else f"1/{1 / ratio:.4g} of"
                others = "bodies" if sort == "body" else f"{sort.split()[0]}s"
                text = f"{size.name} {_length(size.value)}, {times} the {_length(typical)} of other {others}"
                yield Diagnostic.about("unit", f"{text}: a slip of unit?", size.place)


def _thicker_than_long(full: FullOrderModel) -> Iterator[Diagnostic]:
    """Warnings about leaves that are thicker than long."""
    for name, part in full.plan.parts.items():
        keys = list(part.members)
        for group, _, _ in part.table.groups:
            if group.kind[0] not in ("leaf", "tapered"):
                continue
            lengths = full.geometry.parts[name].length[group.index]
            sizes = group.sizes(full.values, lengths, np.array([0.0, 1.0]))
            widths, thicknesses = (np.broadcast_to(size.min(axis=-1), lengths.shape) for size in sizes)
            for k, width, thickness, length in zip(group.index, widths, thicknesses, lengths, strict=True):
                if thickness > length:
                    hint = "; width and thickness exchanged?" if width < length else ""
                    if 5 * length < thickness < 100 * length:
                        hint = f"; {_length(1e-3 * thickness)} meant?"
                    text = f"{_length(thickness)} thick but {_length(length)} long: no leaf, and no beam{hint}"
                    yield Diagnostic.about("thick", text, place_of(name, keys[k]))


def _sizes(full: FullOrderModel) -> Iterator[_Size]:
    """Lengths, sizes of sections and bodies, everywhere they are described."""
    for name, part in full.plan.parts.items():
        places = [place_of(name, key) for key in part.members]
        kinds = ["flexure" if hasattr(member, "profile") else "link" for member in part.members.values()]
        for place, kind, length in zip(places, kinds, full.geometry.parts[name].length if places else (), strict=True):
            yield _Size(f"{kind} length", place, "length", float(length))
        for group, _, _ in part.table.groups:
            if group.family == "constants":
                continue
            for size, entries in group.entries.items():
                if size.endswith(("angle", "positions", "thicknesses", "shift")) or group.family == "layered":
                    continue
                for k, entry in zip(group.index, entries, strict=True):
                    for value in np.unique(full.values[np.array(entry)]).tolist():
                        yield _Size(f"{kinds[k]} {size}", places[k], size, value)
        for key, (_, body) in part.bodies.items():
            form = body.form(full.values)
            if form is not None:
                yield _Size("body", place_of(name, key), "largest size", 2 * float(form.half.max()))


def _length(length: float) -> str:
    """A length in the unit that suits it."""
    unit, scale = next(((u, s) for u, s in (("m", 1.0), ("mm", 1e3), ("um", 1e6)) if length * s >= 0.1), ("nm", 1e9))
    return f"{length * scale:.4g} {unit}"
