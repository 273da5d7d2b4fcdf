"""Stresses of links and flexures from displacements of the full-order model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.analysis.numbers import finite_numbers
from flexura.arguments import verb
from flexura.beam import rigid_arm
from flexura.beam.stress import flat_notch_factors, rectangle_von_mises, round_notch_factors, round_von_mises
from flexura.errors import OptionError
from flexura.linalg import leading, ranked
from flexura.records import Record
from flexura.results import Tabular
from flexura.structure import FullOrderModel
from flexura.structure.part import Part, PartMatrices
from flexura.structure.sections import SectionGroup
from flexura.structure.value_table import Index

Array = NDArray[np.float64]

STATIONS = 41
"""Stations along every member, both ends included."""

BLOCK = 2_000_000
"""Internal forces that are held at a time."""


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


@dataclass(frozen=True, repr=False)
class Stresses(Tabular):
    """Stresses of all placed links and flexures, the largest first, those of sections by constants last."""

    members: tuple[MemberStress, ...]

    @cached_property
    def _by_name(self) -> dict[str, MemberStress]:
        return {member.name: member for member in self.members}

    def __getitem__(self, name: str) -> MemberStress:
        """The stress of a placed member, e.g. `branch1.hinge`. Raises OptionError for unknown names."""
        if name not in self._by_name:
            raise OptionError(_unknown(name, list(self._by_name)))
        return self._by_name[name]

    @property
    def factor_to_yield(self) -> float | None:
        """The least factor of all members that have one."""
        factors = [f for member in self.members if (f := member.factor_to_yield) is not None]
        return min(factors, default=None)

    def _columns(self) -> dict[str, Any]:
        """The largest stress in every member, with its forces there in the member's axes."""
        own = self.members
        columns: dict[str, Any] = {
            "member": [m.name for m in own],
            "von mises [Pa]": [m.von_mises for m in own],
            "nominal [Pa]": [m.nominal for m in own],
            "yield stress [Pa]": [m.yield_stress for m in own],
            "factor to yield": [m.factor_to_yield for m in own],
            "position": [m.position for m in own],
        }
        columns |= {f"{name} [N]": [m.force[k] for m in own] for k, name in enumerate(("N", "Vy", "Vz"))}
        return columns | {f"{name} [N m]": [m.moment[k] for m in own] for k, name in enumerate(("T", "My", "Mz"))}


class _Worst(NamedTuple):
    """Of the members (i, m) of a group: largest stresses, and where along the member, forces (i, m, 6) and state."""

    von_mises: Array
    nominal: Array
    position: Array
    force: Array
    state: NDArray[np.intp]


@verb
def member_stresses(model: FullOrderModel, u: ArrayLike, *, gravity: Sequence[float] | None = None) -> Stresses:
    """The largest stress in every placed link and flexure (theory eqs. S1-S12).

    u: displacements (n,) of the model's DOFs, or (n, k) for k states, of which the worst counts; m and rad. gravity:
    (3,) m/s^2, when members bend under their own weight. Internal forces are those of the beams, so that they hold
    for static states, and for motions as far as a single element's own inertia forces are small.

    Linear: factors to yield scale with the loads. Raises OptionError for displacements that do not fit.
    """
    states = _states(model, u)
    g = None if gravity is None else finite_numbers("gravity", gravity, 3)
    found: list[MemberStress] = []
    for name, matrices in model.matrices.items():
        part = model.plan.parts[name]
        if part.members:
            ends = _end_forces(model, name, matrices, states, g)
            for group, n, _ in part.table.groups:
                found += _reported(model, part, group, _worst_of(model, part, group, n, ends))
    order = ranked([-1.0 if m.von_mises is None else m.von_mises for m in found])
    return Stresses(tuple(found[i] for i in order))


def _reported(model: FullOrderModel, part: Part, group: SectionGroup, worst: _Worst) -> Iterator[MemberStress]:
    names, known = list(part.members), group.family != "constants"
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


def _end_forces(
    model: FullOrderModel, name: str, matrices: PartMatrices, states: Array, g: Array | None
) -> tuple[Array, Array]:
    """Internal forces (i, e, 6, k) at the first and the second end of the elements of all copies (theory eq. S1)."""
    placed = model.plan.topology.copies[name]
    v = element_motions(model, name, states)
    arm = np.zeros((v.shape[1], 3))
    arm[:, 0] = matrices.elements.length
    D = rigid_arm(arm)
    at_end = np.linalg.inv(matrices.elements.C) @ (v[:, :, 6:] - D @ v[:, :, :6])
    at_start = np.swapaxes(D, -1, -2) @ at_end
    if g is not None:
        local = np.zeros((len(placed.paths), v.shape[1], 12, 1))
        Q = np.swapaxes(model.geometry.Q[placed.number], -1, -2)[:, None]
        R = np.stack([matrices.T[:, :3, :3], matrices.T[:, 6:9, 6:9]], axis=1)
        local.reshape(*local.shape[:2], 2, 6)[..., :3] = (R @ (Q[:, :, None] @ g[:, None]))[..., 0]
        weight = matrices.elements.M @ local
        at_start, at_end = at_start + weight[:, :, :6], at_end - weight[:, :, 6:]
    return at_start, at_end


def element_motions(model: FullOrderModel, name: str, states: Array, at: Index | slice = slice(None)) -> Array:
    """Motions (i, e, 12, k) of both ends of elements `at` of all copies of a prototype, element axes."""
    part, placed = model.plan.parts[name], model.plan.topology.copies[name]
    number = np.array(placed.offset)[:, None] + np.arange(part.n_named + len(part.mesh_member))
    Q = np.swapaxes(model.geometry.Q[placed.number], -1, -2)[:, None]
    axial = np.linalg.det(Q).round()[..., None, None] * Q
    whole = model.node_displacements(states)[number]
    own = np.concatenate([Q @ whole[:, :, :3], axial @ whole[:, :, 3:]], axis=2)
    v = own[:, part.connectivity[at]]
    return np.asarray(model.matrices[name].T[at] @ v.reshape(*v.shape[:2], 12, states.shape[1]))


def _worst_of(model: FullOrderModel, part: Part, group: SectionGroup, n: int, ends: tuple[Array, Array]) -> _Worst:
    """The worst station and state of the members of a group, which have `n` elements each."""
    worst: _Worst | None = None
    for first, x, force, raised, nominal in _stresses(model, part, group, n, ends):
        block = _pick(raised, nominal, x, force)
        worst = _worse(worst, block._replace(state=block.state + first))
    assert worst is not None
    return worst


def yield_ratios(
    model: FullOrderModel, u: Array, gravity: Sequence[float] | None = None
) -> tuple[list[str], NDArray[np.float64]]:
    """Names of all placed members whose yield stress is known, and their largest von Mises stress over it (members, k)
    in each of the states u (n, k), as in `member_stresses`."""
    g = None if gravity is None else finite_numbers("gravity", gravity, 3)
    names: list[str] = []
    ratios = [np.empty((0, u.shape[1]))]
    for name, matrices in model.matrices.items():
        part = model.plan.parts[name]
        limit = part.table.yield_stress(model.values) if part.members else np.empty(0)
        known = [group for group in part.table.groups if not np.isnan(limit[group[0].index]).all()]
        known = [(group, n) for group, n, _ in known if group.family != "constants"]
        if not known:
            continue
        ends, keys = _end_forces(model, name, matrices, u, g), list(part.members)
        for group, n in known:
            blocks = [raised.max(axis=2) for *_, raised, _ in _stresses(model, part, group, n, ends)]
            ratio = np.concatenate(blocks, axis=-1) / limit[group.index][:, None]
            has = np.flatnonzero(~np.isnan(limit[group.index]))
            ratios.append(ratio[:, has].reshape(-1, u.shape[1]))
            paths = model.plan.topology.copies[name].paths
            names += [".".join((*path, keys[k])) for path in paths for k in group.index[has]]
    return names, np.concatenate(ratios)


def _stresses(
    model: FullOrderModel, part: Part, group: SectionGroup, n: int, ends: tuple[Array, Array]
) -> Iterator[tuple[int, Array, Array, Array, Array]]:
    """Blocks of states: the first of them, stations x (m, stations), internal forces (i, m, stations, k, 6), and von
    Mises stresses (i, m, stations, k) with notch factors and without."""
    length = model.geometry.parts[part.name].length[group.index]
    regular = np.broadcast_to(np.linspace(0, 1, STATIONS), (len(group.index), STATIONS))
    x = np.sort(np.concatenate([regular, group.corners(model.values, length)], axis=1), axis=1)
    copies, _, _, states = ends[0].shape
    element = np.minimum((x * n).astype(int), n - 1)
    share = (x * n - element)[..., None]
    at = part.table.first[group.index][:, None] + element
    step = max(1, BLOCK // (6 * copies * x.size))
    for first in range(0, states, step):
        own = slice(first, min(first + step, states))
        start, end = (np.moveaxis(forces[:, at, :, own], -1, -2) for forces in ends)
        force = _at_stations(start, end, share, length, n)
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


def _von_mises(
    model: FullOrderModel, part: Part, group: SectionGroup, length: Array, x: Array, force: Array
) -> tuple[Array, Array]:
    """Stresses (i, m, stations, k), with notch factors and without, under internal forces at fractions x."""
    if group.family == "constants":
        size = np.zeros(force.shape[:-1])
        return size, size
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


def _pick(raised: Array, nominal: Array, x: Array, force: Array) -> _Worst:
    """The largest of stresses (i, m, stations, k)."""
    i, m = raised.shape[:2]
    best = leading(raised.reshape(i, m, -1))
    copy, member = np.ogrid[:i, :m]
    station, state = np.divmod(best, raised.shape[-1])
    where = (copy, member, station, state)
    return _Worst(raised.max(axis=(2, 3)), nominal.max(axis=(2, 3)), x[member, station], force[where], state)


def _worse(one: _Worst | None, other: _Worst) -> _Worst:
    if one is None:
        return other
    more = leading(np.stack([one.von_mises, other.von_mises]), axis=0) > 0
    chosen = [np.where(more[..., None] if a.ndim == 3 else more, b, a) for a, b in zip(one, other, strict=True)]
    return _Worst(*chosen)._replace(nominal=np.maximum(one.nominal, other.nominal))


@verb
def internal_force_rows(model: FullOrderModel, member: str, *, position: float = 0.5) -> sp.csr_matrix:
    """The map (6, n) from the model's DOFs to N, Vy, Vz, N, and T, My, Mz, N m, of a section (theory eq. S1).

    member: as placed, e.g. `branch1.hinge`; position: fraction of its length. Raises OptionError for unknown
    members and positions outside.
    """
    name, copy, k = _find(model, member, position)
    part, matrices = model.plan.parts[name], model.matrices[name]
    n = int(part.counts[k])
    element = min(int(position * n), n - 1)
    e = int(part.first[k]) + element
    length = float(matrices.elements.length[e])
    rest = length * (element + 1 - position * n)
    to_end, to_section = rigid_arm((length, 0.0, 0.0)), rigid_arm((rest, 0.0, 0.0))
    P = to_section.T @ np.linalg.solve(matrices.elements.C[e], np.hstack([-to_end, np.eye(6)])) @ matrices.T[e]
    nodes = part.connectivity[e]
    G = model.design.node_transforms(name, nodes)[copy]
    topology = model.plan.topology
    dof = topology.dof[topology.root[topology.copies[name].offset[copy] + nodes]].ravel()
    rows = np.hstack([P[:, :6] @ G[0], P[:, 6:] @ G[1]])[:, dof >= 0]
    dof = np.broadcast_to(dof[dof >= 0], rows.shape)
    at = np.broadcast_to(np.arange(6)[:, None], rows.shape)
    return sp.csr_matrix((rows.ravel(), (at.ravel(), dof.ravel())), shape=(6, model.order))


@verb
def stress_rows(model: FullOrderModel, member: str, *, position: float = 0.5) -> sp.csr_matrix:
    """The map (4, n) from the model's DOFs to the nominal normal stress, Pa, of four fibres (theory eq. S2).

    Rectangles: the corners (+b/2, +t/2), (+b/2, -t/2), (-b/2, -t/2), (-b/2, +t/2); round sections: the ends of their
    diameters along y, z, -y, -z. Arguments as in `internal_force_rows`, and sections by constants raise as well.
    """
    name, _, k = _find(model, member, position)
    part = model.plan.parts[name]
    group = next(group for group, _, _ in part.table.groups if k in group.index)
    if group.family == "constants":
        raise OptionError(f"{member} has a section by constants, whose stress is not known")
    own = group.index == k
    length, nu = model.geometry.parts[name].length, part.table.moduli(model.values)[2]
    at = np.array([position])
    sizes = group.sizes(model.values, length[group.index], at)
    A, Iy, Iz, *_ = group.properties(model.values, nu[group.index], length[group.index], at)
    shape = (len(own), 1)
    A, Iy, Iz, width, depth = (float(np.broadcast_to(f, shape)[own][0, 0]) for f in (A, Iy, Iz, sizes[0], sizes[-1]))
    if group.family == "rectangle":
        y, z = width / 2 * np.array([1, 1, -1, -1]), depth / 2 * np.array([1, -1, -1, 1])
    else:
        y, z = width / 2 * np.array([1, 0, -1, 0]), width / 2 * np.array([0, 1, 0, -1])
    S = np.zeros((4, 6))
    S[:, 0], S[:, 4], S[:, 5] = 1 / A, z / Iy, -y / Iz
    return sp.csr_matrix(S @ internal_force_rows(model, member, position=position))


def _find(model: FullOrderModel, member: str, position: float) -> tuple[str, int, int]:
    """Prototype, copy and number of a placed member."""
    if not 0 <= position <= 1:
        raise OptionError(f"a position is a fraction of the member's length, from 0 to 1, not {position!r}")
    *path, key = member.split(".")
    for name, placed in model.plan.topology.copies.items():
        if tuple(path) in placed.paths and key in placed.part.members:
            return name, placed.paths.index(tuple(path)), list(placed.part.members).index(key)
    raise OptionError(_unknown(member, list(_names(model))))


def _names(model: FullOrderModel) -> Iterator[str]:
    for placed in model.plan.topology.copies.values():
        for path in placed.paths:
            yield from (".".join((*path, member)) for member in placed.part.members)


def _unknown(name: str, known: list[str]) -> str:
    shown = ", ".join(known[:4]) + (", ..." if len(known) > 4 else "")
    return f"there is no link or flexure {name!r}; there are {shown or 'none'}"
