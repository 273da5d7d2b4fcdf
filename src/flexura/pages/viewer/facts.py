"""What there is to know of every part: kind, sizes, material, mass, stiffness."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from flexura.beam import ring_plate
from flexura.mechanism import (
    DOF_NAMES,
    STIFFNESS_UNITS,
    Box,
    Composite,
    Cylinder,
    Dashpot,
    Flexure,
    ForceSensor,
    Layered,
    Link,
    PiezoStack,
    Plate,
    Rectangle,
    Spring,
    Stop,
    StrainActuator,
    Tube,
    evaluated,
    is_rotation,
)
from flexura.pages.viewer.scene import Fact
from flexura.structure import FullOrderModel, Part, Plan
from flexura.tables import number, quantity, scale_for
from flexura.view import Kind

PROFILES = {
    "leaf": "leaf flexure",
    "layered": "layered leaf",
    "notch": "notch flexure",
    "two_axis": "two-axis notch",
    "round": "round notch",
}


class Facts:
    """Facts of the parts of one design by name and kind."""

    def __init__(self, model: FullOrderModel) -> None:
        self.model = model
        self.plan: Plan = model.plan
        numbers = self.plan.scoped_values(model.parameters).items()
        self.values: dict[str, float] = {name: float(np.asarray(value)) for name, value in numbers}
        self._found: dict[tuple[str, str, Kind], tuple[Fact, ...]] = {}

    def of(self, name: str, kind: Kind) -> tuple[Fact, ...]:
        """Facts of a part."""
        if kind in (Kind.NODE, Kind.CLAMP, Kind.PARTLY_HELD, Kind.ARM):
            return self._of_place(name, kind)
        path, _, key = name.rpartition(".")
        prototype = self._prototypes[path]
        if (prototype, key, kind) not in self._found:
            self._found[prototype, key, kind] = tuple(self._own(prototype, key, kind))
        return self._found[prototype, key, kind]

    @cached_property
    def _prototypes(self) -> dict[str, str]:
        copies = self.plan.topology.copies.items()
        return {".".join(path): name for name, own in copies for path in own.paths}

    @cached_property
    def _nodes(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.plan.topology.node_names)}

    def _of_place(self, name: str, kind: Kind) -> tuple[Fact, ...]:
        """Of a node, of what holds it, or of a rigid arm, which has the name of what it belongs to."""
        node = self._nodes.get(name)
        if kind is Kind.ARM:
            return (("kind", "rigid arm, without mass"),)
        found: list[Fact] = [("kind", "node" if kind is Kind.NODE else "ground")]
        if node is not None:
            if kind is not Kind.NODE:
                held = self.plan.topology.held[self.plan.topology.root[node]]
                dofs = " ".join(dof for dof, own in zip(DOF_NAMES, held, strict=True) if own)
                found.append(("held", "in all directions" if held.all() else dofs))
            at = 1e3 * self.model.geometry.positions[node]
            found.append(("at", f"{', '.join(number(x + 0.0, 4) for x in at)} mm"))
        return tuple(found)

    def _own(self, prototype: str, key: str, kind: Kind) -> list[Fact]:
        part, described = self.plan.parts[prototype], self.plan.layout.prototypes[prototype]
        match kind:
            case Kind.BODY | Kind.EQUIVALENT_BODY | Kind.FLAGGED_BODY | Kind.CENTRE:
                return self._body(part, key, evaluated(described.bodies[key], self.values))
            case Kind.MASS:
                mass = evaluated(described.masses[key], self.values)
                return [("kind", "point mass"), ("mass", quantity(_number(mass.mass), "kg", 4)), ("at", mass.node)]
            case Kind.SPRING:
                return _coupling("spring", evaluated(described.springs[key], self.values))
            case Kind.DASHPOT:
                return _coupling("dashpot", evaluated(described.dashpots[key], self.values))
            case Kind.STOP:
                return _stop(evaluated(described.stops[key], self.values))
            case Kind.SUPERELEMENT:
                nodes = [part.node_names[k] for k in part.superelements[key].nodes if k < part.n_positioned]
                return [("kind", "superelement, linear inside"), ("nodes", _listed(nodes))]
            case Kind.SENSOR:
                return self._sensor(described.sensors[key])
            case Kind.ACTUATOR | Kind.PIEZO:
                return self._actuator(evaluated(described.actuators[key], self.values))
        return self._member(part, key)

    def _diaphragm(self, part: Part, key: str) -> list[Fact]:
        described = evaluated(self.plan.layout.prototypes[part.name].diaphragms[key], self.values)
        mass, _ = ring_plate.described_mass(part.diaphragms[key].plate(self.model.values))
        return [
            ("kind", "diaphragm"),
            *_sizes(described),
            ("material", described.material),
            ("mass", quantity(float(mass), "kg", 4)),
            ("between", " and ".join(described.nodes)),
        ]

    def _member(self, part: Part, key: str) -> list[Fact]:
        if key in part.diaphragms:
            return self._diaphragm(part, key)
        member: Flexure | Link = part.members[key]
        k = list(part.members).index(key)
        if isinstance(member, Flexure):
            profile = evaluated(member.profile, self.values)
            contours = [
                getattr(profile, name) for name in ("contour", "y_contour", "z_contour") if hasattr(profile, name)
            ]
            shapes = ", ".join(dict.fromkeys(own.shape.replace("_", " ") for own in contours))
            found = [("kind", PROFILES[profile.type] + (f", {shapes}" if shapes else "")), *_sizes(profile)]
            for own in contours:
                found += _sizes(own)
        else:
            own = (
                self.plan.layout.mechanism.sections[member.section]
                if isinstance(member.section, str)
                else member.section
            )
            section = evaluated(own, self.values)
            found = [("kind", f"link, {section.shape}"), *_sizes(section)]
        found.append(("length", quantity(float(self.model.geometry.parts[part.name].length[k]), "m", 4)))
        found.append(("material", member.material))
        if part.name in self.model.matrices:
            elements = slice(part.first[k], part.first[k] + part.counts[k])
            M = self.model.matrices[part.name].elements.M[elements]
            found.append(("mass", quantity(float((M[:, 0, 0] + 2 * M[:, 0, 6] + M[:, 6, 6]).sum()), "kg", 4)))
        found.append(("between", " and ".join(member.nodes)))
        return found

    def _body(self, part: Part, key: str, body: Any) -> list[Fact]:
        mass, inertia = part.bodies[key][1].mass_and_inertia(self.model.values)
        found: list[Fact] = [("kind", "body, elastic" if key in part.elastic else "rigid body")]
        match body.solid:
            case Box(size=size):
                found.append(("box", _product(size)))
            case Plate(length=a, width=b, thickness=c):
                found.append(("plate", _product((a, b, c))))
            case Cylinder(diameter=d, length=length):
                sizes = (quantity(_number(size), "m", 4) for size in (d, length))
                found.append(("cylinder", "diameter {}, length {}".format(*sizes)))
            case Composite(add=add, cut=cut):
                found.append(("composite", f"{len(add)} added, {len(cut)} cut"))
            case _:
                found.append(("drawn as", "the box of this mass and inertia"))
        if body.solid is not None:
            found.append(("material", body.solid.material))
        moments = np.linalg.eigvalsh(np.asarray(inertia, dtype=float))
        scale = scale_for(moments, "kg*m^2")
        found.append(("mass", quantity(float(mass), "kg", 4)))
        told = ", ".join(number(own / scale.size, 4) for own in moments)
        found.append(("principal inertias", f"{told} {scale.unit}"))
        return found

    def _actuator(self, actuator: Any) -> list[Fact]:
        found: list[Fact] = [("kind", f"actuator: {actuator.type.replace('_', ' ')}")]
        if isinstance(actuator, PiezoStack):
            found = [("kind", "piezo stack"), ("stiffness", quantity(_number(actuator.stiffness), "N/m", 4))]
            units = {"free_stroke": "m", "blocked_force": "N", "gain": "m/V", "mass": "kg"}
        else:
            units = {"limit": {"moment": "N·m", "strain": "V"}.get(actuator.type, "N")}
            if isinstance(actuator, StrainActuator):
                found.append(("of", f"the layers of {actuator.member}, by {actuator.by}"))
        for name, unit in units.items():
            if value := getattr(actuator, name, None):
                found.append((name.replace("_", " "), quantity(_number(value), unit, 4)))
        if nodes := getattr(actuator, "nodes", ()):
            found.append(("at" if len(nodes) == 1 else "between", " and ".join(nodes)))
        return found

    def _sensor(self, sensor: Any) -> list[Fact]:
        where = (
            ("of", sensor.actuator) if isinstance(sensor, ForceSensor) else ("at", " against ".join(sensor.nodes[::-1]))
        )
        return [("kind", f"sensor: {sensor.type.replace('_', ' ')}"), where]


def _coupling(word: str, element: Spring | Dashpot) -> list[Fact]:
    """Of a spring or a dashpot whose numbers are resolved."""
    found: list[Fact] = [("kind", word)]
    if isinstance(element, Dashpot):
        own, what, units = element.damping, "damping", ("N*s/m", "N*m*s/rad")
    else:
        own, what, units = element.stiffness, "stiffness", STIFFNESS_UNITS
    for name in DOF_NAMES if own is not None else ():
        if value := _number(getattr(own, name)):
            found.append((f"{what} {name}", quantity(value, units[is_rotation(name)], 4)))
    if own is None:
        found.append((what, "a 6 x 6 matrix"))
    found.append(("between", " and ".join([*element.nodes, "ground"][:2])))
    return found


def _stop(stop: Stop) -> list[Fact]:
    """Of a stop whose numbers are resolved."""
    found: list[Fact] = [("kind", "stop"), ("gap", quantity(_number(stop.gap), "m", 4))]
    found.append(("stiffness", quantity(_number(stop.stiffness), "N/m", 4)))
    if damping := _number(stop.damping):
        found.append(("damping", quantity(damping, "s/m", 4)))
    found.append(("between", " and ".join([*stop.nodes, "ground"][:2])))
    return found


def _sizes(described: Any) -> list[Fact]:
    """Sizes of a section, a profile or a contour."""
    if isinstance(described, Rectangle) or getattr(described, "type", "") == "leaf":
        ends = np.broadcast_arrays(*(getattr(described, name) for name in ("thickness", "width")))
        return [("section", " to ".join(dict.fromkeys(map(_product, np.reshape(ends, (2, -1)).T))))]
    if isinstance(described, Layered):
        total = sum(_number(layer.thickness) for layer in described.layers)
        return [("section", _product((total, described.width))), ("layers", str(len(described.layers)))]
    if isinstance(described, Tube):
        return [("section", f"outer {quantity(_number(described.outer_diameter), 'm', 4)}, inner "
                            f"{quantity(_number(described.inner_diameter), 'm', 4)}")]  # fmt: skip
    found: list[Fact] = []
    for name in type(described).model_fields:
        value = getattr(described, name)
        if isinstance(value, float) and (value or name != "shift"):
            unit = {
                "angle": "rad",
                "A": "m^2",
                "Iy": "m^4",
                "Iz": "m^4",
                "J": "m^4",
                "ky": "",
                "kz": "",
                "loss_factor": "",
            }.get(name, "m")
            found.append((name.replace("_", " "), quantity(value, unit, 4)))
    return found


def _product(sizes: Any) -> str:
    """Sizes of a box, mm."""
    return f"{' x '.join(number(1e3 * _number(size), 4) for size in sizes)} mm"


def _listed(names: list[str]) -> str:
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")


def _number(value: object) -> float:
    return float(np.asarray(value, dtype=float))
