"""Stresses of links, flexures and parts from displacements of the full-order model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.analysis.strain.internal_forces import (
    end_forces,
    find_member,
    finite_numbers,
    internal_force_rows,
    unknown_member,
)
from flexura.analysis.strain.part_stress import (
    Deformations,
    PartStress,
    deformations,
    edge_notes,
    largest_in_parts,
    part_stresses,
    surface_stresses,
)
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.beam import flat_notch_factors, layer_stresses, rectangle_von_mises, round_notch_factors, round_von_mises
from flexura.duals import plain
from flexura.errors import OptionError
from flexura.linalg import leading, ranked
from flexura.records import Record
from flexura.results import Tabular
from flexura.structure import Design, FullOrderModel, Part, SectionGroup
from flexura.tables import ROWS, Item, Table, number
from flexura.thresholds import ROUND_OFF

Model = FullOrderModel | Design

STATIONS = 41
"""Stations along every member, both ends included."""

BLOCK = 2_000_000
"""Internal forces that are held at a time."""

Pair = tuple[Array, Array]
EndForces = Callable[[str], Pair]
"""Internal forces (i, e, 6, k) at the first and the second end of the elements of all copies of a prototype, in the
axes of the members on the face towards the second end, in k states."""

Rounding = Callable[[Array, Array], Array]
"""What rounds slopes of internal forces (i, m, stations, k, 6) of members of lengths (m,)."""


@dataclass(frozen=True, repr=False)
class MemberStress(Record):
    """The largest stress in a placed link or flexure.

    `von_mises` is the largest von Mises stress with notch factors, `nominal` that without, Pa; both are None where
    the section is given by constants. The rest is said of the section with the largest: `position` as a fraction of the
    length, `force` (N, Vy, Vz), N, and `moment` (T, My, Mz), N m, in the member's axes on the face towards its second
    end, and `state`, the column of the displacements. `yield_stress` is that of the material, Pa, or None.
    """

    name: str
    is_flexure: bool
    von_mises: float | None
    nominal: float | None
    position: float
    force: tuple[float, float, float]
    moment: tuple[float, float, float]
    state: int
    yield_stress: float | None

    @property
    def factor_to_yield(self) -> float | None:
        """Yield stress over largest stress; infinite without stress, None where either is not known."""
        if self.von_mises is None or self.yield_stress is None:
            return None
        return self.yield_stress / self.von_mises if self.von_mises else np.inf

    @property
    def at(self) -> str:
        """Where the largest stress is, in words."""
        return f"{self.position:.2f} of its length"


@dataclass(frozen=True, repr=False)
class Stresses(Tabular):
    """Stresses of all placed links, flexures and parts from CAD, the largest first, those that are not known last."""

    members: tuple[MemberStress | PartStress, ...]

    @cached_property
    def _by_name(self) -> dict[str, MemberStress | PartStress]:
        return {member.name: member for member in self.members}

    def __getitem__(self, name: str) -> MemberStress | PartStress:
        """The stress of a placed member or part, e.g. `branch1.hinge`. Raises OptionError for unknown names."""
        if name not in self._by_name:
            raise OptionError(unknown_member(name, list(self._by_name)))
        return self._by_name[name]

    @property
    def factor_to_yield(self) -> float | None:
        """The least factor of all members that have one."""
        factors = [f for member in self.members if (f := member.factor_to_yield) is not None]
        return min(factors, default=None)

    @property
    def notes(self) -> tuple[str, ...]:
        """Where stresses of parts are infinite."""
        return edge_notes(self.members)

    def _title(self) -> str:
        factor = self.factor_to_yield
        return "" if factor is None else f"least factor to yield {number(factor, 4)}"

    def presentation(self) -> Iterator[Item]:
        yield self.most_loaded()

    def most_loaded(self, most: int = ROWS) -> Table:
        """A row for each of the members with the largest stress, the first to yield first."""

        def margin(member: MemberStress | PartStress) -> float:
            return np.inf if member.factor_to_yield is None else member.factor_to_yield

        rows = sorted(self.members, key=margin)[:most]
        columns = {
            "member": [m.name for m in rows],
            "von Mises [Pa]": [m.von_mises for m in rows],
            "without notch factor [Pa]": [m.nominal if isinstance(m, MemberStress) else None for m in rows],
            "yield stress [Pa]": [m.yield_stress for m in rows],
            "factor to yield": [m.factor_to_yield for m in rows],
            "at": [m.at for m in rows],
        }
        return Table(columns, "members", count=len(self.members))

    def _columns(self) -> dict[str, Any]:
        """The largest stress in every member, with its forces there in the member's axes, and in every part."""
        rows = self.members
        of_members = [m if isinstance(m, MemberStress) else None for m in rows]
        columns = {
            "member": [m.name for m in rows],
            "von mises [Pa]": [m.von_mises for m in rows],
            "nominal [Pa]": [m and m.nominal for m in of_members],
            "yield stress [Pa]": [m.yield_stress for m in rows],
            "factor to yield": [m.factor_to_yield for m in rows],
            "position": [m and m.position for m in of_members],
            **{f"{name} [N]": [m and m.force[k] for m in of_members] for k, name in enumerate(("N", "Vy", "Vz"))},
            **{f"{name} [N m]": [m and m.moment[k] for m in of_members] for k, name in enumerate(("T", "My", "Mz"))},
        }
        parts = [m if isinstance(m, PartStress) else None for m in rows]
        if not any(parts):
            return columns
        return {
            **columns,
            **{f"{axis} [m]": [m and m.place and m.place[k] for m in parts] for k, axis in enumerate("xyz")},
            "principal [Pa]": [m and m.principal for m in parts],
            "mesh error": [m and m.error for m in parts],
            "infinite": [m.edge if m else "" for m in parts],
        }


class _Worst(NamedTuple):
    """Of the members (i, m) of a group: largest stresses, and where along the member, forces (i, m, 6) and state."""

    von_mises: Array
    nominal: Array
    position: Array
    force: Array
    state: NDArray[np.intp]


@verb
def member_stresses(model: FullOrderModel, u: ArrayLike, *, gravity: Sequence[float] | None = None) -> Stresses:
    """The largest stress in every placed link, flexure and part from CAD (theory eqs. S1-S12).

    u: displacements (n,) of the model's DOFs, or (n, k) for k states, of which the worst counts; m and rad. gravity:
    (3,) m/s^2, when members bend under their own weight. Internal forces are those of the beams, so that they hold
    for static states, and for motions as far as a single element's own inertia forces are small.

    Linear: factors to yield scale with the loads, but not about a pose that is described, whose own stress is in them.
    Raises OptionError for displacements that do not fit.
    """
    states = _states(model, u)
    g = None if gravity is None else finite_numbers("gravity", gravity, 3)
    return worst_stresses(model, lambda name: end_forces(model, name, states, g), deformations(model, states))


def worst_stresses(model: FullOrderModel, forces: EndForces, deformed: Deformations) -> Stresses:
    """The largest stress in every placed link and flexure under internal forces of some states, and in every part as
    `deformed` there."""
    members: list[MemberStress | PartStress] = [*part_stresses(model, deformed)]
    for name in model.matrices:
        part = model.plan.parts[name]
        if part.members:
            ends = forces(name)
            for group, n, _ in part.table.groups:
                members += _reported(model, part, group, _worst_of(model, part, group, n, ends))
    least = ROUND_OFF * max((m.von_mises for m in members if m.von_mises and isfinite(m.von_mises)), default=0.0)
    members = [m if m.von_mises is None or m.von_mises > least else _unstressed(m) for m in members]
    order = ranked([-1.0 if m.von_mises is None else m.von_mises for m in members])
    return Stresses(tuple(members[i] for i in order))


def _unstressed(own: MemberStress | PartStress) -> MemberStress | PartStress:
    """Without what is round-off."""
    if isinstance(own, MemberStress):
        return replace(own, von_mises=0.0, nominal=0.0)
    return replace(own, von_mises=0.0, principal=0.0, edge="")


def _reported(model: FullOrderModel, part: Part, group: SectionGroup, worst: _Worst) -> Iterator[MemberStress]:
    names, known = list(part.members), group.has_stress
    strength = part.table.yield_stress(model.values)
    flexures = model.plan.layout.prototypes[part.name].flexures
    for copy, path in enumerate(model.plan.topology.copies[part.name].paths):
        for k, member in enumerate(group.index):
            N, Vy, Vz, T, My, Mz = worst.force[copy, k].tolist()
            yield MemberStress(
                name=".".join((*path, names[member])),
                is_flexure=names[member] in flexures,
                von_mises=float(worst.von_mises[copy, k]) if known else None,
                nominal=float(worst.nominal[copy, k]) if known else None,
                position=float(worst.position[copy, k]),
                force=(N, Vy, Vz),
                moment=(T, My, Mz),
                state=int(worst.state[copy, k]),
                yield_stress=None if np.isnan(strength[member]) else float(strength[member]),
            )


def _states(model: FullOrderModel, u: ArrayLike) -> Array:
    states = np.asarray(u, dtype=float)
    if states.ndim not in (1, 2) or states.shape[0] != model.order or not states.size:
        raise OptionError(f"displacements are ({model.order},) or ({model.order}, states), not {states.shape}")
    if not np.isfinite(states).all():
        raise OptionError("displacements are finite numbers")
    return states.reshape(model.order, -1)


def _worst_of(model: FullOrderModel, part: Part, group: SectionGroup, n: int, ends: Pair) -> _Worst:
    """The worst station and state of the members of a group, which have `n` elements each."""
    copy, member = np.ogrid[: ends[0].shape[0], : len(group.index)]
    blocks: list[_Worst] = []
    for first, x, force, raised, nominal in _stresses(model, part, group, n, ends):
        best = leading(raised.reshape(*raised.shape[:2], -1))
        station, state = np.divmod(best, raised.shape[-1])
        there = x[member, station], force[copy, member, station, state], state + first
        blocks.append(_Worst(raised.max(axis=(2, 3)), nominal.max(axis=(2, 3)), *there))
    worst = leading(np.stack([block.von_mises for block in blocks]), axis=0)
    nominal = np.max([block.nominal for block in blocks], axis=0)
    return _Worst(*(np.stack(own)[worst, copy, member] for own in zip(*blocks, strict=True)))._replace(nominal=nominal)


class StressProfile(NamedTuple):
    """Largest von Mises stresses (i, m, stations, k), Pa, with notch factors, in the sections of `members` (m,) of the
    i copies of a prototype in k states, at `fractions` (m, stations) of their lengths."""

    members: NDArray[np.intp]
    fractions: Array
    von_mises: Array


class StressProfiles(NamedTuple):
    """Stresses along members, by prototype, and von Mises stresses (q, k), Pa, over the surfaces of parts, by the names
    of their superelements as placed."""

    members: Mapping[str, Sequence[StressProfile]]
    surfaces: Mapping[str, Array]


def stress_profiles(
    model: FullOrderModel, names: Iterable[str], forces: EndForces, deformed: Deformations
) -> StressProfiles:
    """Stresses along the members of some prototypes, and over all parts as `deformed`."""
    return StressProfiles(
        {name: tuple(_profiles(model, name, forces)) for name in names}, surface_stresses(model, deformed)
    )


def _profiles(model: FullOrderModel, name: str, forces: EndForces) -> Iterator[StressProfile]:
    """Stresses along the members of a prototype, group by group; none of sections given by constants."""
    part = model.plan.parts[name]
    for group, n, _ in part.table.groups:
        if group.has_stress:
            blocks = [(x, raised) for _, x, _, raised, _ in _stresses(model, part, group, n, forces(name))]
            yield StressProfile(group.index, blocks[0][0], np.concatenate([raised for _, raised in blocks], axis=-1))


class YieldRatios(NamedTuple):
    """Of the placed members and parts (m,) whose yield stress is known: `names`, and in each of k states the largest
    von Mises stress with notch factors over it, `ratio` (m, k), where along the member that is, `position` (m, k), NaN
    for parts, and where in space in a part, `place` (m, k, 3), m, NaN for members."""

    names: tuple[str, ...]
    ratio: Array
    position: Array
    place: Array


def yield_ratios(model: FullOrderModel, u: Array, gravity: Sequence[float] | None = None) -> YieldRatios:
    """How near the members come to yield in each of the states u (n, k), as in `member_stresses`."""
    g = None if gravity is None else finite_numbers("gravity", gravity, 3)
    return ratios_to_yield(model, lambda name: end_forces(model, name, u, g), deformations(model, u), u.shape[1])


def ratios_to_yield(model: FullOrderModel, forces: EndForces, deformed: Deformations, count: int) -> YieldRatios:
    """How near the members come to yield under internal forces of `count` states, and parts as `deformed` there."""
    names, stress, position, place, limit = largest_stresses(model, forces, deformed, count, yielding=True)
    return YieldRatios(names, stress / limit[:, None], position, place)


class LargestStresses(NamedTuple):
    """Of placed members and parts (m,): `names`, and in each of k states the largest von Mises stress with notch
    factors, Pa, `von_mises` (m, k), where along the member that is, `position` (m, k), NaN for parts, and where in
    space in a part, `place` (m, k, 3), m, NaN for members; yield stresses (m,), NaN without one."""

    names: tuple[str, ...]
    von_mises: Array
    position: Array
    place: Array
    yield_stress: Array


def largest_stresses(
    model: Model,
    forces: EndForces,
    deformed: Deformations,
    count: int,
    *,
    yielding: bool = False,
    rounding: Rounding | None = None,
) -> LargestStresses:
    """The largest stresses under internal forces of `count` states, of all members whose section is known, or of those
    whose yield stress is known too, and of parts as `deformed` there. With slopes where the forces and the design have
    them, rounded by `rounding`."""
    names: list[str] = []
    columns: list[tuple[Array, ...]] = [
        (np.empty((0, count)), np.empty((0, count)), np.empty((0, count, 3)), np.empty(0))
    ]
    for name in model.matrices:
        part = model.plan.parts[name]
        limit = part.table.yield_stress(model.values) if part.members else np.empty(0)
        wanted = ~np.isnan(limit) | (not yielding)
        known = [(group, n) for group, n, _ in part.table.groups if group.has_stress]
        known = [(group, n) for group, n in known if wanted[group.index].any()]
        if not known:
            continue
        ends, keys = forces(name), list(part.members)
        paths = model.plan.topology.copies[name].paths
        for group, n in known:
            has = np.flatnonzero(wanted[group.index])
            largest = _largest(model, part, group, n, ends, rounding)
            of_states = (values[:, has].reshape(-1, count) for values in largest)
            limits = np.tile(limit[group.index[has]], len(paths))
            columns.append((*of_states, np.full((len(limits), count, 3), np.nan), limits))
            names += [".".join((*path, keys[k])) for path in paths for k in group.index[has]]
    for name, sizes, place, limit in largest_in_parts(model, deformed):
        if not (yielding and np.isnan(limit)):
            columns.append((sizes[None], np.full((1, count), np.nan), place[None], np.array([limit])))
            names.append(name)
    return LargestStresses(tuple(names), *(np.concatenate(column) for column in zip(*columns, strict=True)))


def _largest(model: Model, part: Part, group: SectionGroup, n: int, ends: Pair, rounding: Rounding | None) -> Pair:
    """Largest von Mises stresses (i, m, k) of the members of a group in each state, and where they are along them."""
    largest, position = [], []
    for _, x, _, raised, _ in _stresses(model, part, group, n, ends, rounding):
        station = leading(plain(raised), axis=2)
        largest.append(raised.max(axis=2))
        position.append(x[np.arange(len(x))[None, :, None], station])
    return np.concatenate(largest, axis=-1), np.concatenate(position, axis=-1)


def _stresses(
    model: Model, part: Part, group: SectionGroup, n: int, ends: Pair, rounding: Rounding | None = None
) -> Iterator[tuple[int, Array, Array, Array, Array]]:
    """Blocks of states: the first of them, stations x (m, stations), internal forces (i, m, stations, k, 6), and von
    Mises stresses (i, m, stations, k) with notch factors and without."""
    length = model.geometry.parts[part.name].length[group.index]
    regular = np.broadcast_to(np.linspace(0, 1, STATIONS), (len(group.index), STATIONS))
    x = np.concatenate([regular, group.corners(model.values, length)], axis=1)
    x = x[np.arange(len(x))[:, None], np.argsort(x, axis=1)]
    copies, _, _, states = ends[0].shape
    element = np.minimum(plain(x * n).astype(int), n - 1)
    share = (x * n - element)[..., None]
    at = part.table.first[group.index][:, None] + element
    step = max(1, BLOCK // (6 * copies * x.size))
    for first in range(0, states, step):
        block = slice(first, min(first + step, states))
        start, end = (np.moveaxis(forces[:, at, :, block], -1, -2) for forces in ends)
        force = _at_stations(start, end, share, length, n)
        force = force if rounding is None else rounding(force, length)
        yield first, x, force, *_von_mises(model, part, group, length, x, force)


def _at_stations(start: Array, end: Array, share: Array, length: Array, n: int) -> Array:
    """Internal forces (i, m, stations, k, 6) inside elements: linear, and moments parabolic where shear is not constant
    (theory eq. S1)."""
    share = share[..., None]
    force = (1 - share) * start + share * end
    bulge = (share * (1 - share))[..., 0] * (length / n / 2)[:, None, None]
    change = end - start
    force[..., 4] -= bulge * change[..., 2]
    force[..., 5] += bulge * change[..., 1]
    return force


def _von_mises(model: Model, part: Part, group: SectionGroup, length: Array, x: Array, force: Array) -> Pair:
    """Stresses (i, m, stations, k), with notch factors and without, under internal forces at fractions x."""
    if not group.has_stress:
        size = np.zeros(force.shape[:-1])
        return size, size
    if group.family == "layered":
        of_layers = _layer_von_mises(group, model.values, force)
        return of_layers, of_layers
    sizes = [np.broadcast_to(s, x.shape)[..., None] for s in group.sizes(model.values, length, x)]
    of_y, of_z = (np.broadcast_to(r, x.shape)[..., None] for r in group.notch_ratios(model.values, length, x))
    if group.family == "rectangle":
        (pull_y, bend_y), (pull_z, bend_z) = flat_notch_factors(of_y), flat_notch_factors(of_z)
        factors = (pull_y * pull_z, pull_y * bend_z, bend_y * pull_z)
        von_mises, outer, inner = rectangle_von_mises, sizes[0], sizes[1]
    else:
        nu = part.table.moduli(model.values)[2][group.index][:, None, None]
        factors = round_notch_factors(of_y, nu)
        von_mises, outer, inner = round_von_mises, sizes[0], sizes[1] if len(sizes) > 1 else 0.0
    nominal = von_mises(force, outer, inner)
    notched = bool((of_y > 0).any() or (of_z > 0).any())
    return von_mises(force, outer, inner, factors) if notched else nominal, nominal


def _layer_von_mises(group: SectionGroup, values: Array, force: Array) -> Array:
    """The largest stress (i, m, stations, k) in the faces of layers, of stretch, bending and torsion."""
    layers = group.laminate(values)
    normal, slide = layer_stresses(layers, group.width(values))
    largest = np.zeros(force.shape[:-1])
    own = force[..., [0, 4, 5]]
    for k in range(slide.shape[-2]):
        for corner in range(4):
            stress = (own * normal[:, None, None, k, corner]).sum(axis=-1)
            largest = np.maximum(largest, stress**2 + 3 * (slide[:, None, None, k, corner] * force[..., 3]) ** 2)
    return np.sqrt(largest)


@verb
def stress_rows(model: FullOrderModel, member: str, *, position: float = 0.5) -> sp.csr_matrix:
    """The map (4, n) from the model's DOFs to the nominal normal stress, Pa, of four fibres (theory eq. S2).

    Rectangles: the corners (+b/2, +t/2), (+b/2, -t/2), (-b/2, -t/2), (-b/2, +t/2); round sections: the ends of their
    diameters along y, z, -y, -z; layers (4 k, n): the corners of each, from the face towards -z on. Arguments as in
    `internal_force_rows`; sections by constants and layers that strain freely raise as well.
    """
    name, _, k = find_member(model, member, position)
    part = model.plan.parts[name]
    group = next(group for group, _, _ in part.table.groups if k in group.index)
    if not group.has_stress:
        what = "a section by constants" if group.family == "constants" else "layers that an actuator strains"
        raise OptionError(f"{member} has {what}, whose stress is not known")
    forces = internal_force_rows(model, member, position=position)
    is_member = group.index == k
    if group.family == "layered":
        normal, _ = layer_stresses(group.laminate(model.values), group.width(model.values))
        return sp.csr_matrix(normal[is_member].reshape(-1, 3) @ forces[[0, 4, 5]])
    length, nu = model.geometry.parts[name].length, part.table.moduli(model.values)[2]
    at = np.array([position])
    sizes = group.sizes(model.values, length[group.index], at)
    A, Iy, Iz, *_ = group.properties(model.values, nu[group.index], length[group.index], at)
    shape = (len(is_member), 1)
    A, Iy, Iz, width, depth = (
        float(np.broadcast_to(f, shape)[is_member][0, 0]) for f in (A, Iy, Iz, sizes[0], sizes[-1])
    )
    if group.family == "rectangle":
        y, z = width / 2 * np.array([1, 1, -1, -1]), depth / 2 * np.array([1, -1, -1, 1])
    else:
        y, z = width / 2 * np.array([1, 0, -1, 0]), width / 2 * np.array([0, 1, 0, -1])
    S = np.zeros((4, 6))
    S[:, 0], S[:, 4], S[:, 5] = 1 / A, z / Iy, -y / Iz
    return sp.csr_matrix(S @ forces)
