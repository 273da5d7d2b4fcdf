"""The members of one part or of several in one table: materials, sections and elements without Python loops."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import SectionProperties, blocking, fillet_shares
from flexura.duals import with_slopes_of, zeros
from flexura.kernels import Kernel, is_compiled, packed
from flexura.mechanism import Flexure, Layered, Link, Mechanism
from flexura.structure.corrections import STRIPS, Distortion, Factors, MemberCorrections, Strips
from flexura.structure.elements import STATIONS, Elements, Stations
from flexura.structure.sections import FAMILY_SIZES, SectionGroup, family_properties, section_groups
from flexura.structure.values import ValueTable
from flexura.structure.warping import shared_warping

_compiled = Kernel("section_sizes", "aaaaaaaaa")

SQUARE = (3 * np.pi / 16) ** 0.25
"""Side of the square that bends like a rod, over the diameter."""


class _Family(NamedTuple):
    """The elements `at` which one section formula applies, and groups with their places (m, n) among these elements and
    the fractions (n,) of the member where these are; `by_kernel` says how sizes follow from entries, as the kernel
    takes it, for all groups but `others`, which are left to NumPy."""

    formula: str
    at: Index | slice
    groups: list[tuple[SectionGroup, Index, Array]]
    by_kernel: tuple[Index, Index, Array, Array, Index]
    others: list[tuple[SectionGroup, Index, Array]]


class Members:
    """Entries and groups of a list of members; elements are numbered member by member."""

    def __init__(
        self, members: Sequence[Link | Flexure], mechanism: Mechanism, table: ValueTable, driven: Sequence[bool]
    ) -> None:
        self.counts: Index = np.array([m.elements for m in members], dtype=np.intp)
        self.first: Index = np.concatenate([[0], np.cumsum(self.counts)]).astype(np.intp)
        self.element_member: Index = np.repeat(np.arange(len(self.counts)), self.counts)
        materials = [mechanism.material(m.material) for m in members]
        self._E = np.array([table.add(m.E) for m in materials], dtype=np.intp)
        self._rho = np.array([table.add(m.rho) for m in materials], dtype=np.intp)
        loss = [
            m.loss_factor if m.loss_factor is not None else own.loss_factor
            for m, own in zip(members, materials, strict=True)
        ]
        self._loss = np.array([table.add(np.nan if eta is None else eta) for eta in loss], dtype=np.intp)
        self._has_nu = np.array([m.nu is not None for m in materials], dtype=bool)
        self._have_nu = bool(self._has_nu.all())
        elastic = [m.nu if m.nu is not None else m.G for m in materials]
        self._nu_or_G = np.array([table.add(v) for v in elastic if v is not None], dtype=np.intp)
        strength = [
            np.nan if own.yield_stress is None or _is_mixed(m) else own.yield_stress
            for m, own in zip(members, materials, strict=True)
        ]
        self._yield = np.array([table.add(value) for value in strength], dtype=np.intp)
        radii = [member.fillet for member in members]
        self._fillets: Index = np.array([[table.add(r) for r in pair] for pair in radii], dtype=np.intp).reshape(-1, 2)
        self.filleted: NDArray[np.bool_] = np.array([[r != 0 for r in pair] for pair in radii], dtype=bool).reshape(
            -1, 2
        )
        self.groups: list[tuple[SectionGroup, int, bool]] = section_groups(members, mechanism, table, driven)
        self._layered = [group for group, _, _ in self.groups if group.family == "layered"]
        self._collect_families()
        self.is_round: NDArray[np.bool_] = np.zeros(len(self.counts), dtype=bool)
        for group, _, _ in self.groups:
            self.is_round[group.index] = group.kind[0] in ("round", "circle", "tube")
        theories = [m.theory or mechanism.theory for m in members]
        self.corrections: MemberCorrections = MemberCorrections(members, mechanism, self.groups)
        self.shear: Array = np.array([t == "timoshenko" for t in theories], dtype=float)
        self.shear[self.corrections.shear] = 1.0
        self.rotary: Array = np.array([t != "euler_bernoulli" for t in theories], dtype=float)
        self._flags = (self.shear[self.element_member], self.rotary[self.element_member])

    def _collect_families(self) -> None:
        self._families: list[_Family] = []
        for family in dict.fromkeys(group.family for group, _, _ in self.groups):
            own = [(group, n) for group, n, _ in self.groups if group.family == family]
            places = [self.first[group.index][:, None] + np.arange(n) for group, n in own]
            elements = np.sort(np.concatenate([place.ravel() for place in places]))
            k, e = FAMILY_SIZES[family], len(elements)
            shape, entries, side, fraction = (
                np.zeros((k, e), dtype=np.int64),
                np.zeros((k, e, 4), dtype=np.int64),
                np.zeros((k, e)),
                np.zeros(e),
            )
            groups, others = [], []
            for (group, n), place in zip(own, places, strict=True):
                groups.append((group, np.searchsorted(elements, place), (np.arange(n) + 0.5) / n))
                _, run, fraction[run] = groups[-1]
                for j, contour in enumerate(group.contours):
                    shape[j, run], entries[j, run], side[j, run] = contour.shape, contour.entries[:, None], contour.side
                if not group.contours:
                    others.append(groups[-1])
            at = elements if e < self.first[-1] else slice(None)
            by_kernel = (shape, entries, side, fraction, self.element_member[elements])
            self._families.append(_Family(family, at, groups, by_kernel, others))

    def moduli(self, values: Array) -> tuple[Array, Array, Array, Array]:
        """E (Pa), rho (kg/m^3), nu, G (Pa) of the members, each (..., m)."""
        E, rho, other = values[..., self._E], values[..., self._rho], values[..., self._nu_or_G]
        if self._have_nu:
            nu, G = other, E / (2 * (1 + other))
        else:
            nu = np.where(self._has_nu, other, E / (2 * np.where(self._has_nu, 1.0, other)) - 1)
            G = np.where(self._has_nu, E / (2 * (1 + nu)), other)
        for group in self._layered:
            own = group.laminate(values)
            for moduli, mean in ((E, own.E), (rho, own.rho), (nu, own.nu), (G, own.G)):
                moduli[..., group.index] = mean
        return E, rho, nu, G

    def axis_shift(self, values: Array) -> Array | None:
        """How far the neutral axis of the members (..., m) is from their middle, m, towards local z; None where no
        member is layered."""
        if not self._layered:
            return None
        shift = np.zeros((*values.shape[:-1], len(self.counts)), like=values)
        for group in self._layered:
            shift[..., group.index] = group.laminate(values).axis
        return shift

    @property
    def shift_entries(self) -> Index:
        """Entries on which `axis_shift` depends."""
        own = [np.ravel(group.entries[name]) for group in self._layered for name in ("thicknesses", "E")]
        return np.concatenate([np.empty(0, dtype=np.intp), *own]).astype(np.intp)

    def blocking(self, member: int, by: str, values: Array) -> tuple[Array, Array]:
        """Force along the axis and moment about local y (...), N and N m, that block a layered member per volt, or
        kelvin."""
        group = next(group for group in self._layered if member in group.index)
        at = int(np.flatnonzero(group.index == member)[0])
        force, moment = blocking(group.laminate(values), group.width(values), group.layers(values, by))
        return force[..., at], moment[..., at]

    def fillets(self, values: Array) -> Array:
        """Radius of the fillets at both ends of the members (..., m, 2), m."""
        return values[..., self._fillets]

    def loss_factors(self, values: Array, default: Any = 0.0) -> Array:
        """Structural loss factors of the elements (..., e); `default` for members and materials without any."""
        loss = values[..., self._loss]
        return np.where(np.isnan(loss), default, loss)[..., self.element_member]

    def yield_stress(self, values: Array) -> Array:
        """Yield stress of the members (..., m), Pa; NaN where the material has none, and of layers of several."""
        return values[..., self._yield]

    def section_properties(self, values: Array, nu: Array, length: Array) -> SectionProperties:
        """Sections (..., e) at the middle of every element."""
        return SectionProperties(*self._section_table(values, nu[..., self.element_member], length))

    def _section_table(self, values: Array, nu: Array, length: Array) -> Array:
        """The same as a table (6, ..., e), for Poisson's ratios (..., e)."""
        lead = values.shape[:-1]
        table = np.empty((6, *lead, self.first[-1]), like=values)
        is_left = not is_compiled() or with_slopes_of(values, length) is not None
        for family, at, groups, by_kernel, others in self._families:
            k, e = by_kernel[0].shape
            sizes: Array = np.empty((k, *lead, e), like=values)
            if not is_left:
                step = length.shape[-1] if length.ndim > 1 else 0
                numbers = packed(values.size // values.shape[-1], values.shape[-1], step, k, e)
                _compiled(np.ascontiguousarray(values), np.ascontiguousarray(length), *by_kernel, numbers, sizes)
            for group, run, middle in groups if is_left else others:
                for size, value in zip(sizes, group.sizes(values, length[..., group.index], middle), strict=True):
                    size[..., run] = value
            for row, own in zip(table, family_properties(family, list(sizes), nu[..., at]), strict=True):
                row[..., at] = own
        return table

    def stations(self, values: Array, nu: Array, length: Array, points: Array = STATIONS) -> Stations:
        """Sections of tapered elements at `points` (stations,) of each element's length."""
        stations: Stations = []
        for group, n, is_tapered in self.groups:
            if is_tapered:
                lead = np.broadcast_shapes(values.shape[:-1], length.shape[:-1])
                at = self.first[group.index][:, None] + np.arange(n)
                fractions = ((np.arange(n)[:, None] + points) / n).ravel()
                fields = group.properties(values, nu[..., group.index], length[..., group.index], fractions)
                shape, every = (*lead, at.size, len(points)), (*lead, len(group.index), fractions.size)
                at_stations = SectionProperties(*(np.broadcast_to(f, every).reshape(shape) for f in fields))
                stations.append((at.ravel(), at_stations))
        return stations

    def end_sizes(self, values: Array, length: Array) -> tuple[Array, Array]:
        """Width and thickness (..., m, 2), m, at both ends of the members; of rods those of a square of equal bending
        stiffness, and 1 m where a section has no sizes."""
        lead = np.broadcast_shapes(values.shape[:-1], length.shape[:-1])
        table = np.ones((2, *lead, len(self.counts), 2), like=values)
        for group, _, _ in self.groups:
            if group.family in ("rectangle", "circle", "layered"):
                sizes = group.sizes(values, length[..., group.index], np.array([0.0, 1.0]))
                for out, size in zip(table, (sizes[0], sizes[-1]), strict=True):
                    out[..., group.index, :] = size * (SQUARE if group.family == "circle" else 1.0)
        return table[0], table[1]

    def elements(
        self,
        values: Array,
        length: Array,
        roots: tuple[Index, Index, Array] | None = None,
        fillets: tuple[Index, Index, Array] | None = None,
    ) -> Elements:
        """Elements for values (..., s) and member lengths (..., m), m, with `roots` as `Elements` takes them, and with
        fillets: members and ends (k,), and radius over thickness on both sides (..., k, 2)."""
        E, rho, nu, G = self.moduli(values)
        m = self.element_member
        table = self._section_table(values, nu[..., m], length)
        moduli, sections = np.empty((3, *table.shape[1:]), like=values), SectionProperties(*table)
        for k, own in enumerate((E, G, rho)):
            moduli[k] = own[..., m]
        finer = partial(self.stations, values, nu, length)
        strips = Strips(values, nu, length)
        factors = self.corrections.factors(strips, self.first) if self.corrections.any else None
        homogeneous = factors
        if self._layered:
            factors = self._of_layers(factors, values, length)
        if fillets is not None:
            factors = self._filleted(factors, values, length, fillets)
        torsion = partial(self._torsion, strips, moduli, sections, (homogeneous, factors))
        stiffer = None if factors is homogeneous or factors is None else factors.twist
        stiffer = stiffer if stiffer is None or homogeneous is None else stiffer / homogeneous.twist
        shared = shared_warping(self.corrections, strips, (G, stiffer), roots, first=self.first)
        if shared.compliance is not None:
            twist = 1.0 if factors is None else factors.twist
            rigid = moduli[1] * sections.J * (self.counts / length)[..., m]
            shares = np.ones((len(Factors._fields), *np.shape(shared.compliance)), like=shared.compliance)
            shares[3] = 1 / (1 + shared.compliance * twist * rigid)
            factors = _times(factors, shares)
        return Elements(
            moduli,
            table,
            finer,
            (length / self.counts)[..., m],
            share=1 / self.counts[m],
            flags=self._flags,
            torsion=torsion,
            couplings=shared.couplings,
            factors=factors,
            roots=shared.roots,
        )

    def _filleted(
        self, factors: Factors | None, values: Array, length: Array, fillets: tuple[Index, Index, Array]
    ) -> Factors:
        """Factors of elements with those of the sections in fillets, which are thicker; mass stays as it is."""
        lead = np.broadcast_shapes(values.shape[:-1], length.shape[:-1])
        table = np.ones((len(Factors._fields), *lead, self.first[-1]), like=values)
        _, t = self.end_sizes(values, length)
        for k, (member, end) in enumerate(zip(fillets[0].tolist(), fillets[1].tolist(), strict=True)):
            elements = np.arange(int(self.first[member]), int(self.first[member + 1]))[:: -1 if end else 1]
            step = length[..., member] / self.counts[member] / t[..., member, end]
            thin, thick = fillet_shares(fillets[2][..., k, :], step, len(elements))
            for row, share in zip(table[:4], (thin, thick, thin, thick), strict=True):
                row[..., elements] = row[..., elements] / share
        return _times(factors, table)

    def _of_layers(self, factors: Factors | None, values: Array, length: Array) -> Factors:
        """Factors of elements with those of layers, whose bending and twist are not those of their mean moduli."""
        lead = np.broadcast_shapes(values.shape[:-1], length.shape[:-1])
        table = np.ones((len(Factors._fields), *lead, len(self.counts)), like=values)
        for group in self._layered:
            own = group.laminate(values)
            table[1][..., group.index], table[3][..., group.index] = own.bend, own.twist
        return _times(factors, table[..., self.element_member])

    def _torsion(
        self,
        strips: Strips,
        moduli: Array,
        sections: SectionProperties,
        factors: tuple[Factors | None, Factors | None],
    ) -> Distortion:
        """How elements (..., e) with `sections` and moduli E, G, rho (..., e) twist, whose `factors` are those without
        and with layers and fillets.

        Only rectangles warp. With Ip = Iy + Iz, Irr - Ip^2/A of theirs is 4 (Iy^2 + Iz^2)/5A (theory eq. G24).
        """
        E, G, _ = moduli
        without, whole = (1.0 if each is None else each.twist for each in factors)
        wanted, bows = (own[self.element_member] for own in (self.corrections.warping, self.corrections.bows))
        A, Iy, Iz = sections.A, sections.Iy, sections.Iz
        nu = strips.nu
        of_element, plane = nu[..., self.element_member], np.where(Iy <= Iz, 0, 1)
        weak, strong = np.where(plane == 0, Iy, Iz), np.where(plane == 0, Iz, Iy)
        factor, layered = (1.0 if each is None else np.where(plane == 0, each.bend_y, each.bend_z) for each in factors)
        rest = 1 - of_element**2
        plate = E * weak * (layered / factor) / rest
        free = np.where(of_element == 0, 1.0, (1 - rest * factor) / np.where(of_element == 0, 1.0, of_element**2))
        own = (bows * plate, of_element, 144 * rest * strong**2 / (A * weak), free)
        bow = zeros((*np.broadcast_shapes(*map(np.shape, own)), len(own)), *own)
        for k, numbers in enumerate(own):
            bow[..., k] = numbers
        return self.corrections.torsion(strips, self.first)._replace(
            stiffness=G * sections.J * (whole / without) / (strips.length / self.counts)[..., self.element_member],
            mean=1 / without + np.zeros(len(wanted)),
            polar=wanted * (Iy + Iz) / A,
            wagner=wanted * E * 0.8 * (Iy * Iy + Iz * Iz) / A,
            bow=bow,
            plane=plane,
        )

    def bulk(self, values: Array, length: Array) -> tuple[Array, Array, Array]:
        """Torsion constants (m, 2), m^4, at both ends and where what the ends hold is, in the web of notches; the least
        thickness (m,), m.

        One design.
        """
        _, _, nu, _ = self.moduli(values)
        ends, web = np.empty((2, len(self.counts), 2))
        thickness = np.empty(len(self.counts))
        for group, _, _ in self.groups:
            at = group.index
            section = group.properties(values, nu[at], length[at], np.linspace(0, 1, 41))
            J, depth = (np.broadcast_to(f, (len(at), 41)) for f in (section.J, np.sqrt(12 * section.Iy / section.A)))
            ends[at] = J[:, [0, -1]]
            web[at] = ends[at] if group.kind[0] in STRIPS else J.min(axis=1)[:, None]
            thickness[at] = np.minimum(depth, np.sqrt(12 * section.Iz / section.A)).min(axis=1)
        return ends, web, thickness


def _is_mixed(member: Link | Flexure) -> bool:
    """Whether a member has layers of other materials than its own."""
    layers = member.profile.layers if isinstance(member, Flexure) and isinstance(member.profile, Layered) else ()
    return any(layer.material not in (None, member.material) for layer in layers)


def _times(factors: Factors | None, table: Array) -> Factors:
    """Factors times those of a table (4, ..., e)."""
    return Factors(*table) if factors is None else Factors(*(a * b for a, b in zip(factors, table, strict=True)))
