"""The model summary of a mechanism, and every warning about it."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.analysis.checks.angle_doubts import angle_doubts
from flexura.analysis.checks.clashes import Clash, clash_doubts, clashes, ends_in_the_air
from flexura.analysis.checks.doubts import as_one, assumed, corrected, member_doubts, outside_doubts
from flexura.analysis.checks.free_motions import free_motions
from flexura.analysis.checks.material_doubts import material_doubts
from flexura.analysis.checks.references import reference_doubts
from flexura.analysis.checks.sizes import size_doubts
from flexura.analysis.model_error import model_errors_of_modes
from flexura.analysis.natural_modes import MassProperties, mass_evidence, rigid_mass_of
from flexura.analysis.strain import PartMesh, frequency_errors, mesh_warning, part_meshes
from flexura.arguments import verb
from flexura.deadline import stage
from flexura.errors import Diagnostic, SolverError
from flexura.linalg import lowest
from flexura.mechanism import DOF_NAMES, Mechanism
from flexura.reduction import low_order
from flexura.results import Result
from flexura.structure import FullOrderModel, Plan, assemble, full_order, plan_of, solids_of
from flexura.systems import Ports, damping_law
from flexura.tables import Facts, Table, counted, in_hz, number, quantity


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


MODES = 6
"""Lowest modes beyond rigid motions, one of which what is taken for granted must move to be a doubt."""

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

    def _view(self) -> Iterator[Facts | Table]:
        centre = ", ".join(number(1e3 * round(c, 9)) for c in self.mass.centre)
        yield Facts(
            {
                "mass": f"{quantity(self.mass.mass, 'kg')}, centre of mass ({centre}) mm",
                "full order": self.full_order,
                "low order": self.low_order,
                "held": _first(f"{n} ({' '.join(dofs)})" if len(dofs) < 6 else n for n, dofs in self.held.items()),
                "rigid bodies": _first(f"{name} {quantity(own, 'kg')}" for name, own in self.rigid_bodies.items()),
                "rigid-body modes": self.rigid_body_modes or None,
                "lowest frequency": self.lowest_text,
                "corrected": _first(self.corrections),
                "actuators": _first(f"{name} ({text})" for name, text in self.actuators.items()),
                "sensors": _first(f"{name} ({text})" for name, text in self.sensors.items()),
                "damping": self.damping,
                "loads": _first(self.loads),
                "studies": _first(f"{name} ({text})" for name, text in self.studies.items()),
                "preloaded": "stiffness is about the state under loads and gravity" if self.is_preloaded else "",
            }
        )
        yield Table(self.substructure_columns(), "substructures")

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
        own = self.substructures
        counts = {name: [getattr(s, name) for s in own] for name in ("copies", "members", "elements", "nodes")}
        return {
            "substructure": [s.name for s in own],
            **counts,
            "interior DOFs": [s.interior_dofs for s in own],
            "mass each [kg]": [s.mass for s in own],
            "interface": [_first(s.interface) for s in own],
        }


@verb
def check(model: Mechanism | Plan, parameters: Mapping[str, float] | None = None) -> CheckReport:
    """The model summary of a mechanism, and every warning about it.

    Raises ModelError when the description cannot be used at all.
    """
    plan = plan_of(model, parameters).at_rest()
    stage("assembling the full order")
    full = assemble(plan, parameters)
    assembler = low_order(plan)
    bodies = {
        ".".join((*path, key)): float(body.mass_and_inertia(full.values)[0])
        for name, part in plan.parts.items()
        for key, (_, body) in part.bodies.items()
        for path in plan.topology.copies[name].paths
    }
    used = plan.scoped_values(parameters)
    given, own = parameters or {}, plan.mechanism.parameters
    corrections, ends = corrected(full)
    stage("proving what moves freely")
    free, dead = free_motions(full), plan.loads
    stage("working out how far the part may be")
    worth, minor = _assumed(full, free.rigid_body_modes or 0)
    stage("looking at shapes and sizes")
    bars, solid_bodies = solids_of(full)
    found, unseen = clashes(full, bars, solid_bodies)
    drawn = (*size_doubts(full), *reference_doubts(full, bars), *clash_doubts(found, unseen))
    x, y, z = map(float, dead.gravity(full.values))
    return CheckReport(
        name=plan.mechanism.name,
        full_order=full.order,
        low_order=len(assembler.physical),
        mass=mass_evidence(full)["model_mass"],
        substructures=tuple(_summary(full, name) for name in plan.parts if plan.parts[name].has_matrices),
        held=_held(full),
        rigid_bodies=bodies,
        parameters={k: float(used[k]) for k in own if k in given or isinstance(own[k].value, float)},
        corrections=corrections,
        ends=ends,
        solid_parts=part_meshes(full),
        **_channels(full),
        loads={node: tuple(map(float, wrench)) for node, wrench in dead.wrenches(full.values).items()},
        gravity=(x, y, z),
        is_preloaded=plan.is_loaded,
        rigid_body_modes=free.rigid_body_modes,
        lowest_hz=free.lowest_hz,
        warnings=as_one(
            (
                *worth,
                *material_doubts(plan.layout, used),
                *angle_doubts(plan.mechanism, used),
                *free.doubts,
                *member_doubts(full),
                *outside_doubts(full, used, ends_in_the_air(found, bars)),
                *_overlapping(full),
                *_coarse_meshes(full),
                *drawn,
            )
        ),
        minor=tuple(minor),
        studies={key: study.words for key, study in plan.mechanism.studies.items()},
        clashes=tuple(found),
    )


def _assumed(full: FullOrderModel, rigid: int) -> tuple[list[Diagnostic], list[Diagnostic]]:
    """What is taken for granted, by whether it moves one of the six lowest frequencies beyond those of `rigid` motions
    by 1 % or not."""
    if not full.order:
        return [], []
    try:
        errors, hz = model_errors_of_modes(full, min(rigid + MODES, full.order))
    except SolverError as error:
        text = f"how far the part may be from the model is not known: {error}"
        return [Diagnostic.about("proof", text, "mechanism")], []
    return assumed(errors, hz)


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


def _coarse_meshes(full: FullOrderModel) -> list[Diagnostic]:
    """Meshes of solid parts that leave one of the lowest frequencies uncertain."""
    if not full.order or not part_meshes(full):
        return []
    pairs = lowest(full.K, full.M, min(6, full.order))
    finite = np.flatnonzero(np.isfinite(pairs.values) & (pairs.values > 0))
    hz, u = np.sqrt(pairs.values[finite]) / (2 * np.pi), full.node_displacements(pairs.vectors[:, finite])
    errors = frequency_errors(full, u, hz)
    doubts: dict[str, Diagnostic] = {}
    for f, error, part in zip(hz, errors.share / 2, errors.part, strict=True) if errors else ():
        warning = mesh_warning("", f"a mode at {in_hz(f, 4)}", error, part)
        if warning is not None:
            doubts.setdefault(part, Diagnostic.about("mesh", warning.text, part))
    return list(doubts.values())


def _overlapping(full: FullOrderModel) -> list[Diagnostic]:
    """Named nodes of different rigid clusters at one place: perhaps a joint was forgotten."""
    topology = full.plan.topology
    named = np.concatenate(
        [
            (np.array(placed.offset, dtype=np.intp)[:, None] + np.arange(placed.part.n_named)).ravel()
            for placed in topology.copies.values()
        ]
    )
    x = full.geometry.positions[named]
    size = float(np.ptp(full.geometry.positions, axis=0).max()) or 1.0
    cell = np.round(x / (1e-6 * size)).astype(np.int64)
    order = np.lexsort(cell.T)
    same = (cell[order][1:] == cell[order][:-1]).all(axis=1)
    names, doubts = topology.node_names, []
    for a, b in zip(named[order][:-1][same], named[order][1:][same], strict=True):
        if topology.root[a] != topology.root[b]:
            text = f"at the same place as {names[b]}, but not joined to it"
            doubts.append(Diagnostic.about("overlap", text, names[a]))
    return doubts


def _first(names: Iterable[str]) -> str:
    """The first few of some names, and how many more there are."""
    own = list(names)
    more = f" and {len(own) - MOST_NAMED} more" if len(own) > MOST_NAMED else ""
    return ", ".join(own[:MOST_NAMED]) + more
