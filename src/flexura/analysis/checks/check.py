"""The model summary of a mechanism, and every warning about it."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.analysis.checks.clashes import Clash, clashes, nodes_in_the_air
from flexura.analysis.checks.model_warnings import (
    assumed,
    coarse_meshes,
    free_motions,
    nodes_outside,
    overlapping_nodes,
    slender_members,
    turned_references,
)
from flexura.analysis.checks.slips import angle_warnings, material_warnings, size_warnings
from flexura.analysis.model_error import place_of
from flexura.analysis.natural_modes import MassProperties, mass_evidence, rigid_mass_of
from flexura.analysis.strain import PartMesh, part_meshes
from flexura.arguments import verb
from flexura.deadline import stage
from flexura.errors import Diagnostic
from flexura.full_order import assemble, plan_of
from flexura.mechanism import CORRECTIONS, DOF_NAMES, Mechanism
from flexura.reduction import low_order
from flexura.results import Result
from flexura.structure import FullOrderModel, Plan, Ports, full_order, solids_of
from flexura.systems import damping_law
from flexura.tables import Facts, Item, Table, counted, in_hz, in_mm, quantity, vector


@dataclass(frozen=True)
class SubstructureSummary:
    """One prototype: how often it is placed, its elements, nodes and DOFs, its interface, and its mass, kg, each."""

    name: str
    copies: int
    members: int
    elements: int
    nodes: int
    interior_dofs: int
    interface: tuple[str, ...]
    mass: float


MOST_NAMED = 4
"""Of each kind, in a notebook."""


@dataclass(frozen=True, repr=False)
class CheckReport(Result):
    """The model summary: orders of both models, substructures, masses, what is held, which members are corrected
    beyond beam theory, actuators, sensors, damping, loads, what is proven about free motions, and all warnings."""

    _shown = ("name", "full_order", "low_order", "warnings", "clashes")

    name: str
    full_order: int
    low_order: int
    mass: MassProperties
    substructures: tuple[SubstructureSummary, ...]
    held: dict[str, tuple[str, ...]]
    rigid_bodies: dict[str, float]
    parameters: dict[str, float]
    corrections: dict[str, tuple[str, ...]]
    """Corrections by member, those without any left out."""
    ends: dict[str, tuple[str, str]]
    """Whether the ends of corrected members are `clamped` or `free`, or how far, such as `60 % clamped`."""
    actuators: dict[str, str]
    """Inputs by name: quantity, unit and range."""
    solid_parts: dict[str, PartMesh]
    """Superelements of which the error of the stiffness is known: their meshes, and how large it is."""
    sensors: dict[str, str]
    """Outputs by name: quantity and unit."""
    damping: str
    """What dissipates, in words."""
    loads: dict[str, tuple[float, ...]]
    """Dead loads by node: force, N, and moment, N m, global axes."""
    gravity: tuple[float, float, float]
    """Acceleration of free fall, m/s^2, global axes."""
    is_preloaded: bool
    """Whether stiffness, and all that follows from it, is about the state under loads and gravity."""
    rigid_body_modes: int | None
    """Independent rigid motions that strain nothing; None where this is not known."""
    lowest_hz: tuple[float, float] | None
    """An interval that is proven to hold the lowest frequency that is not one of a rigid motion; None where there is
    none, or none is proven."""
    minor: tuple[Diagnostic, ...]
    """Assumptions that move the six lowest frequencies by less than 1 %."""
    studies: dict[str, str]
    """Studies of many designs by name, in words."""
    clashes: tuple[Clash, ...] = ()
    """Parts that share space, touch, or end in the air, with volumes, gaps and places; each is a warning as well."""
    warnings: tuple[Diagnostic, ...] = ()
    """What may not be meant, and assumptions that move one of the six lowest frequencies by 1 % or more, worst first.
    """

    @property
    def doubts(self) -> tuple[Diagnostic, ...]:
        """The older name of `warnings`."""
        text = "CheckReport.doubts is called warnings and goes with the next release"
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        return self.warnings

    def _data(self) -> dict[str, Any]:
        older = [{"kind": w.kind, "place": w.place, "text": w.text, "places": w.places} for w in self.warnings]
        return {**super()._data(), "doubts": older}

    def _warned(self) -> list[str]:
        return [str(warning) for warning in self.warnings]

    def _title(self) -> str:
        return counted(len(self.warnings), "warning")

    def presentation(self) -> Iterator[Item]:
        """What the mechanism is made of; warnings stand beside it."""
        loads = {node: (wrench[:3], wrench[3:]) for node, wrench in self.loads.items()}
        yield Facts(
            {
                "order": f"full {self.full_order}, low {self.low_order}",
                "mass": f"{quantity(self.mass.mass, 'kg')}, centre of mass ({in_mm(self.mass.centre)}) mm",
            }
        )
        yield Table(self.substructure_columns(), "substructures")
        yield Facts(
            {
                "body": {body: quantity(mass, "kg") for body, mass in self.rigid_bodies.items()},
                "held": {node: "clamped" if len(dofs) == 6 else " ".join(dofs) for node, dofs in self.held.items()},
                "corrected for": self._corrected(),
                "solid part": {name: str(mesh) for name, mesh in self.solid_parts.items()},
                "actuator": self.actuators,
                "sensor": self.sensors,
                "damping": self.damping if self.damping != "none" or self.actuators or self.sensors else "",
                "study": self.studies,
                "load on": {
                    node: ", ".join(vector(w, unit) for w, unit in zip(parts, ("N", "N*m"), strict=True) if any(w))
                    for node, parts in loads.items()
                },
                "gravity": vector(self.gravity, "m/s^2") if any(self.gravity) else "",
                "preloaded": "stiffness, and all that follows from it, is about the state under these"
                if self.is_preloaded
                else "",
                "rigid-body modes": self.rigid_body_modes or "",
                "lowest frequency": self.lowest_text if self.lowest_hz is not None else "",
            }
        )

    def _corrected(self) -> dict[str, str]:
        """Members by what they are corrected for, with their ends unless both are clamped."""
        members: dict[str, list[str]] = {}
        for place, names in self.corrections.items():
            strip = {"plate", "warping"} & set(names)
            ends = self.ends[place]
            shown = place if ends == ("clamped", "clamped") or not strip else f"{place} ({', '.join(ends)})"
            members.setdefault(", ".join(names), []).append(shown)
        return {names: _first(places) for names, places in members.items()}

    @property
    def lowest_text(self) -> str:
        """What is proven of the lowest frequency that is not one of a rigid motion, in words."""
        if self.lowest_hz is None:
            return ""
        lower, upper = (quantity(hz, "Hz") for hz in self.lowest_hz)
        if self.lowest_hz[0] <= 0:
            return f"below {in_hz(self.lowest_hz[1], 2)}, indistinguishable from zero"
        return f"{upper}, proven" if lower == upper else f"between {lower} and {upper}, proven"

    def substructure_columns(self) -> dict[str, Any]:
        """A row for each kind of substructure: how many copies, and what is in each."""
        rows = self.substructures
        return {
            "substructure": [s.name for s in rows],
            **{name: [getattr(s, name) for s in rows] for name in ("copies", "members", "elements", "nodes")},
            "interior DOFs": [s.interior_dofs for s in rows],
            "mass each [kg]": [s.mass for s in rows],
            "interface": [_first(s.interface) for s in rows],
        }


@verb
def check(model: Mechanism | Plan, parameters: Mapping[str, float] | None = None) -> CheckReport:
    """The model summary of a mechanism, and every warning about it.

    Raises ModelError when the description cannot be used at all, and OptionError for `temperatures` of what has no
    coefficient of expansion.
    """
    plan = plan_of(model, parameters).at_rest()
    stage("assembling the full order")
    full = assemble(plan, parameters)
    for state in plan.temperatures.described:
        plan.temperatures.of(state, full.design)
    used = plan.scoped_values(parameters)
    given, declared = parameters or {}, plan.mechanism.parameters
    corrections, ends = corrected(full)
    stage("proving what moves freely")
    free = free_motions(full)
    stage("working out how far the part may be")
    assumptions, minor = assumed(full, free.rigid_body_modes or 0)
    stage("looking at shapes and sizes")
    bars, bodies = solids_of(full)
    found, unseen = clashes(full, bars, bodies)
    x, y, z = map(float, plan.loads.gravity(full.values))
    return CheckReport(
        name=plan.mechanism.name,
        full_order=full.order,
        low_order=len(low_order(plan).physical),
        mass=mass_evidence(full)["model_mass"],
        substructures=tuple(_summary(full, name) for name in plan.parts if plan.parts[name].has_matrices),
        held=_held(full),
        rigid_bodies={
            ".".join((*path, key)): float(body.mass_and_inertia(full.values)[0])
            for name, part in plan.parts.items()
            for key, (_, body) in part.bodies.items()
            for path in plan.topology.copies[name].paths
        },
        parameters={k: float(used[k]) for k in declared if k in given or isinstance(declared[k].value, float)},
        corrections=corrections,
        ends=ends,
        solid_parts=part_meshes(full),
        **_channels(full),
        loads={node: tuple(map(float, wrench)) for node, wrench in plan.loads.wrenches(full.values).items()},
        gravity=(x, y, z),
        is_preloaded=plan.is_loaded,
        rigid_body_modes=free.rigid_body_modes,
        lowest_hz=free.lowest_hz,
        minor=tuple(minor),
        studies={key: study.words for key, study in plan.mechanism.studies.items()},
        clashes=tuple(found),
        warnings=_alike_once(
            (
                *assumptions,
                *material_warnings(plan.layout, used),
                *angle_warnings(plan.mechanism, used),
                *free.warnings,
                *slender_members(full),
                *nodes_outside(full, nodes_in_the_air(found, bars)),
                *overlapping_nodes(full),
                *coarse_meshes(full),
                *size_warnings(full),
                *turned_references(full, bars),
                *(Diagnostic.about(clash.kind, clash.text, clash.first) for clash in found),
                *([Diagnostic.about("unseen", unseen, "solids")] if unseen else []),
            )
        ),
    )


def _alike_once(warnings: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Warnings that say the same of several places as one."""
    places: dict[tuple[str, str], list[str]] = {}
    for warning in warnings:
        places.setdefault((warning.kind, warning.text), []).extend(warning.places)
    return tuple(Diagnostic.about(kind, text, *where) for (kind, text), where in places.items())


def corrected(full: FullOrderModel) -> tuple[dict[str, tuple[str, ...]], dict[str, tuple[str, str]]]:
    """Corrections of every member that has any, and how its ends are held, by `SUBSTRUCTURE.MEMBER`."""
    applied: dict[str, tuple[str, ...]] = {}
    ends: dict[str, tuple[str, str]] = {}
    for name, part in full.plan.parts.items():
        corrections = part.table.corrections
        for key, active, clamped in zip(part.members, corrections.active, corrections.clamped, strict=True):
            if active.any():
                place = place_of(name, key)
                applied[place] = tuple(c for c, is_active in zip(CORRECTIONS, active, strict=True) if is_active)
                percents = (round(100 * float(share)) for share in clamped)
                first, second = ({0: "free", 100: "clamped"}.get(k, f"{k} % clamped") for k in percents)
                ends[place] = (first, second)
    return applied, ends


def _summary(full: FullOrderModel, name: str) -> SubstructureSummary:
    part, placed = full.plan.parts[name], full.plan.topology.copies[name]
    x = np.zeros((6 * part.n_nodes, 1))
    x[: 6 * part.n_positioned : 6] = 1.0
    return SubstructureSummary(
        name=name or "mechanism",
        copies=len(placed.paths),
        members=len(part.members),
        elements=len(part.connectivity),
        nodes=part.n_positioned,
        interior_dofs=int((~part.unused[part.interior]).sum()),
        interface=tuple(part.node_names[k] for k in part.boundary),
        mass=float(rigid_mass_of(part, full.matrices[name], x)[0, 0]),
    )


def _channels(full: FullOrderModel) -> dict[str, Any]:
    """Actuators, sensors and damping in words."""
    plan = full.plan
    ports = Ports(full.design)
    law = damping_law(plan.mechanism.damping, plan.parameter_values(full.parameters), None)
    C, H = full_order(plan).dissipation(full.design, law.loss_factor)
    words = []
    if law.is_modal:
        ratios = sorted({law.ratio, *law.ratios, *(ratio for _, ratio in law.bands)} - {0.0})
        words.append(f"modal damping ratios {', '.join(f'{z:g}' for z in ratios)}")
    if law.alpha or law.beta:
        words.append(f"Rayleigh, alpha {law.alpha:.4g} 1/s, beta {quantity(law.beta, 's', 4)}")
    if H.nnz and abs(H).max() > 0:
        words.append("structural damping")
    if C.nnz:
        words.append("dashpots")
    ranges = {i.channel.name: (i.channel, i.limits) for i in ports.inputs()}
    return {
        "actuators": {
            name: f"{c.quantity} [{c.unit}]" + (f", {low:.5g} to {high:.5g}" if np.isfinite(high) else "")
            for name, (c, (low, high)) in ranges.items()
        },
        "sensors": {o.channel.name: f"{o.channel.quantity} [{o.channel.unit}]" for o in ports.outputs()},
        "damping": " and ".join(words) or "none",
    }


def _held(full: FullOrderModel) -> dict[str, tuple[str, ...]]:
    topology = full.plan.topology
    names = topology.node_names
    return {
        names[node]: tuple(d for d, held in zip(DOF_NAMES, topology.held[node], strict=True) if held)
        for node in np.flatnonzero(topology.held.any(axis=1))
    }


def _first(names: Iterable[str]) -> str:
    """The first few of some names, and how many more there are."""
    listed = list(names)
    more = f" and {len(listed) - MOST_NAMED} more" if len(listed) > MOST_NAMED else ""
    return ", ".join(listed[:MOST_NAMED]) + more
