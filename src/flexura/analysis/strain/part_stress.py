"""Stresses over the surfaces of parts from CAD, from displacements of the full-order model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.duals import Dual, plain
from flexura.fem import EDGES, SurfaceStress, largest_principal, surface_of, von_mises
from flexura.linalg import leading
from flexura.motion import MIRRORED, Equilibrium, MovingModel, part_motions
from flexura.records import Record
from flexura.structure import Design, FullOrderModel, Plan
from flexura.tables import number

Model = FullOrderModel | Design

Deformations = Mapping[str, Array]
"""By part as placed, displacements and rotations of its nodes as seen from the first, m and rad, in its own axes, and
amplitudes, (d, k) in k states."""

BLOCK = 4_000_000
"""Stresses that are held at a time."""

TELLING = 0.5
"""Stress that a mesh shows near an edge where it is infinite, over the largest elsewhere, from which that is told."""

REMEDIES = ("", "a fillet gives a number", "what really holds it decides", "what joins them decides")
"""What makes the stress at an edge of each kind finite."""


@dataclass(frozen=True, repr=False)
class PartStress(Record):
    """The largest stress over the surface of a part from CAD as placed, or of one of its solids.

    `von_mises` is the largest von Mises stress away from edges with infinite stress, Pa, None where nothing else is
    there, and `error` how far off it may be for the mesh, relative. `place` (x, y, z), m, is where that is before
    anything moves, `principal` the principal stress of the largest size there, tension positive, Pa, and `state` the
    column of the displacements. `edge` says where the stress is infinite, in words, if it is not low around there.
    `yield_stress` is that of the material, Pa, or None, and `superelement` what the part is in the model.
    """

    name: str
    superelement: str
    von_mises: float | None
    principal: float | None
    place: tuple[float, float, float] | None
    error: float | None
    edge: str
    state: int
    yield_stress: float | None

    @property
    def factor_to_yield(self) -> float | None:
        """Yield stress over largest stress; infinite without stress, None where either is not known."""
        if self.von_mises is None or self.yield_stress is None:
            return None
        return self.yield_stress / self.von_mises if self.von_mises else np.inf

    def of_surface(self) -> dict[str, Any]:
        """Where the largest stress is and how far off it may be, as plain data."""
        return {
            "principal_Pa": self.principal,
            "place_m": self.place,
            "mesh_error": self.error,
            "infinite": self.edge or None,
        }

    @property
    def at(self) -> str:
        """Where the largest stress is, in words."""
        if self.place is None:
            return "not known: sharp edges everywhere"
        return _place_text(self.place) + (f", ±{100 * self.error:.2g} %" if self.error else "")


class PlacedPart(NamedTuple):
    """A part whose stresses are known, as placed: its name, that of its superelement, its stresses, places x (n, 3), m,
    of its nodes in its own axes, and Q (3, 3) and t (3,), m, that place it."""

    name: str
    superelement: str
    stress: SurfaceStress
    x: Array
    Q: Array
    t: Array

    def place(self, points: Any) -> Array:
        """Where some points (k,) of its surface are, (k, 3), m, before anything moves."""
        return self.stress.points[points] @ self.Q.T + self.t

    def seen(self, d: Array) -> Array:
        """Coordinates (d, k) in its own axes from those in right-handed ones."""
        if np.linalg.det(self.Q) > 0:
            return d
        return d * np.resize(MIRRORED, len(d))[:, None]

    @property
    def solids(self) -> Iterator[tuple[int, str, float]]:
        """Its solids: number, name as placed and yield stress, Pa, NaN where it is not known."""
        names = _solids(self.name, self.stress)
        return zip(range(len(names)), names, self.stress.yield_stress, strict=True)


def stressed_parts(model: Model) -> Iterator[PlacedPart]:
    """All placed parts whose stresses are known."""
    geometry, placed = model.geometry, model.plan.topology.copies
    for name, key, stress in _known(model.plan):
        part = model.plan.parts[name]
        nodes = [node for node in part.superelements[key].nodes if node < part.n_positioned]
        x = plain(geometry.parts[name].positions)[nodes]
        for path, copy in zip(placed[name].paths, placed[name].number, strict=True):
            Q, t = plain(geometry.Q[copy]), plain(geometry.t[copy])
            yield PlacedPart(".".join(path), ".".join((*path, key)), stress, x, Q, t)


def part_yield_stresses(plan: Plan) -> dict[str, float]:
    """Yield stresses, Pa, of the solids of parts as placed, NaN where they are not known."""
    return {
        name: limit
        for prototype, _, stress in _known(plan)
        for path in plan.topology.copies[prototype].paths
        for name, limit in zip(_solids(".".join(path), stress), stress.yield_stress, strict=True)
    }


def _known(plan: Plan) -> Iterator[tuple[str, str, SurfaceStress]]:
    """Prototype, key and stresses of superelements whose stresses are known."""
    for name in plan.parts:
        for key, described in plan.layout.prototypes[name].superelements.items():
            surface = surface_of(described)
            if surface is not None and surface.stress is not None:
                yield name, key, surface.stress


def _solids(part: str, stress: SurfaceStress) -> list[str]:
    """Names of the solids of a part as placed: its own, where there is one."""
    return [part] if len(stress.names) == 1 else [f"{part}.{solid}" for solid in stress.names]


def deformations(model: FullOrderModel, u: Array) -> Deformations:
    """How parts are deformed by displacements u (n, k), at a pose together with what is there."""
    parts = list(stressed_parts(model))
    if (posed := model.design.posed) is not None:
        names = [part.superelement for part in parts]
        there, added = posed.part_motions(names), posed.part_motion_changes(u, names)
        return {p.name: p.seen(_own(p, there[p.superelement] + added[p.superelement])) for p in parts}
    return {p.name: _seen_from_first(p, model.superelement_coordinates(u, p.superelement)) for p in parts}


def moved_deformations(model: Model, moving: MovingModel, states: Sequence[Equilibrium]) -> Deformations:
    """How parts are deformed in states of large motion."""
    parts = list(stressed_parts(model))
    if not parts or not states:
        return {}
    found = part_motions(moving, states, [part.superelement for part in parts])
    return {part.name: part.seen(_own(part, found[part.superelement])) for part in parts}


def _own(part: PlacedPart, d: Array) -> Array:
    """The coordinates behind those of the first node, where more are seen from the ground."""
    return d[len(d) - len(part.stress.parts) :]


def _seen_from_first(part: PlacedPart, q: Array) -> Array:
    """Coordinates (d, k) behind those of the first node, as seen from there, of a superelement with q (6 + d, k)."""
    d = 1.0 * q[6:]
    for k, arm in enumerate(part.x[1:] - part.x[0]):
        d[6 * k : 6 * k + 6] = d[6 * k : 6 * k + 6] - rigid_arm(arm) @ q[:6]
    return d


def part_stresses(model: Model, d: Deformations) -> Iterator[PartStress]:
    """The largest stress in every solid of all parts as they are deformed."""
    for part in stressed_parts(model) if d else ():
        own, stress = d[part.name], part.stress
        whole = _whole(stress, own)
        for k, name, limit in part.solids:
            size, at, edge_size, edge_at = (values[k] for values in whole)
            state, edge_state = int(leading(size)), int(leading(edge_size))
            point, worst = int(at[state]), float(size[state])
            is_high = edge_size[edge_state] > max(TELLING * worst, 0.0)
            there = _edge_text(part, int(edge_at[edge_state])) if is_high else ""
            known = worst >= 0
            error = stress.error_at(point, own[:, state]) / worst if worst > 0 else 0.0
            yield PartStress(
                name=name,
                superelement=part.superelement,
                von_mises=worst if known else None,
                principal=largest_principal(stress.stress_at(point, own[:, state])) if known else None,
                place=_triple(part.place(point)) if known else None,
                error=error if known else None,
                edge=there,
                state=state if known else edge_state,
                yield_stress=None if np.isnan(limit) else limit,
            )


def edge_notes(rows: Iterable[Any]) -> tuple[str, ...]:
    """Where stresses of parts are infinite."""
    return tuple(f"{own.name}: {own.edge}" for own in rows if isinstance(own, PartStress) and own.edge)


def largest_in_parts(model: Model, d: Deformations) -> Iterator[tuple[str, Any, Array, float]]:
    """By solid of a part, in each of k states the largest von Mises stress (k,), Pa, away from edges where it is
    infinite, with slopes where the deformations have some, and its place (k, 3), m; its yield stress, Pa."""
    for part in stressed_parts(model) if d else ():
        own = d[part.name]
        size, at, _, _ = _whole(part.stress, plain(own))
        for k, name, limit in part.solids:
            if (size[k] < 0).any():
                continue
            found = size[k]
            if isinstance(own, Dual):
                states = [von_mises(part.stress.stress_at(int(p), own[:, j])) for j, p in enumerate(at[k])]
                found = np.stack(states)
            yield name, found, part.place(at[k]), limit


def surface_stresses(model: Model, d: Deformations) -> dict[str, Array]:
    """Von Mises stresses (q, k), Pa, at the points of the surfaces of parts, by the names of their superelements."""
    return {part.superelement: von_mises(part.stress.stress(d[part.name])) for part in stressed_parts(model)}


def _whole(stress: SurfaceStress, d: Array) -> tuple[Array, Index, Array, Index]:
    """By solid and state (s, k), the largest von Mises stress where it is finite, at which point, and the same near
    edges where it is infinite; -1 where there is no such point."""
    groups = (stress.regular, stress.singular)
    found = [np.full((len(stress.names), d.shape[1]), -1.0) for _ in range(4)]
    step = max(1, BLOCK // stress.rows[..., 0].size)
    for first in range(0, d.shape[1], step):
        block = slice(first, first + step)
        sizes = von_mises(stress.stress(d[:, block]))
        for j, group in enumerate(groups):
            for k, points in enumerate(group):
                if len(points):
                    at = sizes[points].argmax(axis=0)
                    found[2 * j][k, block] = np.take_along_axis(sizes[points], at[None], axis=0)[0]
                    found[2 * j + 1][k, block] = points[at]
    size, at, edge_size, edge_at = found
    return size, at.astype(np.intp), edge_size, edge_at.astype(np.intp)


def _edge_text(part: PlacedPart, point: int) -> str:
    kind = int(part.stress.edge[point])
    place = _place_text(part.place(point))
    return f"at the {EDGES[kind]} at {place} it grows without limit as the mesh becomes finer: {REMEDIES[kind]}"


def _place_text(place: Iterable[float]) -> str:
    return f"({', '.join(number(1e3 * float(x) + 0.0, 4) for x in place)}) mm"


def _triple(place: Array) -> tuple[float, float, float]:
    x, y, z = place.tolist()
    return x, y, z
