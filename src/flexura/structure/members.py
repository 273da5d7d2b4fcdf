"""The members of one part or of several in one table: materials, sections and element matrices without Python loops."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.beam import (
    SectionProperties,
    UniformBeam,
    element,
    gauss_stations,
    geometric_basis,
    tapered,
    tapered_geometric_basis,
)
from flexura.errors import OptionError
from flexura.mechanism import Flexure, Link, Mechanism
from flexura.structure.corrections import Factors, MemberCorrections, Torsion
from flexura.structure.sections import FAMILY_SIZES, SectionGroup, SectionGroups, family_properties
from flexura.structure.value_table import Index, ValueTable

Array = NDArray[np.float64]
Stations = list[tuple[Index, SectionProperties]]
"""Tapered elements and their sections (..., e', stations)."""

STATIONS, WEIGHTS = gauss_stations(6)
"""Gauss rule of a tapered element."""

TAPERED_PIECES = 16
"""Most uniform steps that stand for a tapered element."""

CHANGE = 0.02
"""Most relative change of a rigidity or mass along a step of a tapered element, as long as it has fewer steps."""

STEP_ERROR = 1e-5
"""Most relative error of the lowest frequencies that the steps of a tapered member cause, as long as its elements have
fewer."""


class Cut(NamedTuple):
    """Elements cut into pieces: the distinct beams, for every piece in order which of them it is, and the number of
    pieces of every element."""

    beam: UniformBeam
    kind: Index
    counts: Index


class Elements:
    """Matrices of beam elements in their own axes, each worked out when first asked for.

    Mass follows from the sections themselves, stiffness from the effective ones that corrections make of them.
    K, M: (..., e, 12, 12); flexibility C: (..., e, 6, 6), end j loaded with end i clamped; length: (..., e), m; share:
    (e,), that of an element in the length of its member.
    """

    def __init__(
        self,
        moduli: tuple[Array, Array, Array],
        sections: SectionProperties,
        finer: Callable[[Array], Stations],
        length: Array,
        share: Array,
        flags: tuple[Array, Array],
        torsion: Callable[[], Torsion],
        factors: Factors | None = None,
    ) -> None:
        self._E, self._G, self._rho = moduli
        self._sections, self._finer, self._torsion, self._factors = sections, finer, torsion, factors
        self._stiff = sections if factors is None else factors.applied(sections, slice(None))
        self._stations = finer(STATIONS)
        self.length, self._share = length, share
        self._shear, self._rotary = flags

    @cached_property
    def _tapered(self) -> list[tuple[Index, Array, Array]]:
        """Flexibility and mass of the tapered elements."""
        found = []
        for at, sections in self._stations:
            moduli = (self._E[..., at], self._G[..., at], self._rho[..., at])
            flags = (self._shear[at], self._rotary[at])
            stiff = self._effective(sections, at)
            found.append((at, *tapered(*moduli, stiff, self.length[..., at], *flags, STATIONS, WEIGHTS, sections)))
        return found

    def _effective(self, sections: SectionProperties, at: Index) -> SectionProperties:
        """Effective sections (..., e', stations) of tapered elements."""
        return sections if self._factors is None else self._factors.applied(sections, at, stations=True)

    @cached_property
    def _phi(self) -> tuple[Array | float, Array | float]:
        """Shear parameters of the two planes, zero where no element shears."""
        if not self._shear.any():
            return 0.0, 0.0
        return element.phi(self._E, self._G, self._stiff, self.length, self._shear)

    @cached_property
    def K(self) -> Array:
        """Stiffness (..., e, 12, 12)."""
        K = element.stiffness(self._E, self._G, self._stiff, self.length, self._shear)
        for at, C, _ in self._tapered:
            K[..., at, :, :] = element.stiffness_from_flexibility(C, self.length[..., at])
        return K

    @cached_property
    def M(self) -> Array:
        """Mass (..., e, 12, 12)."""
        M = element.mass(self._rho, self._sections, self.length, *self._phi, self._rotary)
        for at, _, own in self._tapered:
            M[..., at, :, :] = own
        return M

    @cached_property
    def geometric(self) -> Array:
        """Geometric stiffness (..., e, 2, 12, 12) per axial force at both ends, linear between them."""
        found = geometric_basis(self.uniform)
        for at, sections in self._stations:
            stiff, moduli = self._effective(sections, at), (self._E[..., at], self._G[..., at])
            own = (stiff, sections, self.length[..., at], self._shear[at])
            found[..., at, :, :, :] = tapered_geometric_basis(*moduli, *own, STATIONS, WEIGHTS)
        return found

    @cached_property
    def torsion(self) -> Torsion:
        """How the elements (..., e) twist, beyond what K says."""
        return self._torsion()

    def coefficients(self) -> tuple[Array, Array]:
        """Coefficients (..., e, 10) of K in `STIFFNESS_BASIS` and (..., e, 14) of M in `MASS_BASIS`.

        Raises OptionError when there are tapered elements, whose matrices are no such combination.
        """
        if self._stations:
            raise OptionError("elements with integration: tapered have no coefficients; use stepped ones")
        K = element.stiffness_coefficients(self._E, self._G, self._stiff, self.length, self._shear)
        return K, element.mass_coefficients(self._rho, self._sections, self.length, *self._phi, self._rotary)

    @cached_property
    def uniform(self) -> UniformBeam:
        """The elements (..., e) as uniform beams, with the section at the middle of each."""
        moduli, flags = (self._E, self._G, self._rho), (self._shear, self._rotary)
        return _uniform(moduli, self._stiff, self._sections, self.length, flags)

    def cut(self, own: slice, pieces: int, tapered_pieces: int = TAPERED_PIECES) -> Cut:
        """A run of elements cut into uniform pieces of equal length.

        A tapered element is first cut into at most `tapered_pieces` steps, as many as its change of section asks for,
        with the section at the middle of each; then every element or step is cut into `pieces`, so that all numbers of
        pieces stand for one and the same structure. One design.
        """
        kinds: list[Index] = [np.full(pieces, k) for k in range(own.stop - own.start)]
        beams = [self.uniform.take(own).cut(pieces)]
        first = len(kinds)
        for group, steps in enumerate(self._steps(tapered_pieces)):
            at = self._stations[group][0]
            mine = (at >= own.start) & (at < own.stop)
            for count in np.unique(steps[mine]):
                chosen = np.flatnonzero(mine & (steps == count))
                beam = self._stepped(group, chosen, (np.arange(count) + 0.5) / count)
                beams.append(UniformBeam(*(f.ravel() for f in beam)).cut(count * pieces))
                for element_number in at[chosen]:
                    kinds[element_number - own.start] = np.repeat(first + np.arange(count), pieces)
                    first += count
        beam = UniformBeam(*(np.concatenate(fields) for fields in zip(*beams, strict=True)))
        counts = np.array([len(k) for k in kinds], dtype=np.intp)
        return Cut(beam, np.concatenate(kinds), counts)

    def _steps(self, most: int) -> list[Index]:
        """Numbers of steps (e',) of the tapered elements of every group, at most so many; one design.

        Along a step of length h = b L of a member, whose flexibility f changes by d = ln(f2/f1), the energy int f m^2
        of a moment m is taken with f at the middle. The midpoint rule leaves d^2/24 + d b L (m^2)'/(12 m^2) of it. As
        int f (m^2)' is what m^2 is at a clamped end, some 4 times its mean, a frequency is off by half the mean of
        d^2/24 + d b/3: CHANGE bounds the first term, STEP_ERROR the second.
        """
        found = []
        count = max(most, TAPERED_PIECES)
        for group in range(len(self._stations)):
            beam = self._stepped(group, slice(None), np.linspace(0.0, 1.0, count + 1))
            sizes = np.stack([beam.EA, beam.GJ, beam.EIy, beam.EIz, beam.mass])
            with np.errstate(divide="ignore", invalid="ignore"):  # without mass nothing of it changes
                change = np.nan_to_num(np.abs(np.diff(np.log(sizes), axis=-1))).max(axis=(0, -1))
            whole = count * change
            wanted = np.maximum(
                whole / CHANGE, np.sqrt(whole * self._share[self._stations[group][0]] / (6 * STEP_ERROR))
            )
            found.append(np.clip(np.ceil(wanted - 1e-6), 1, most).astype(np.intp))
        return found

    def _stepped(self, group: int, chosen: Index | slice, points: Array) -> UniformBeam:
        """Sections at `points` (stations,) of chosen tapered elements of a group as beams (e', stations) of their full
        length; one design."""
        at, sections = self._finer(points)[group]
        e = at[chosen]
        moduli = tuple(m[e][:, None] for m in (self._E, self._G, self._rho))
        flags = (self._shear[e][:, None], self._rotary[e][:, None])
        own = SectionProperties(*(f[chosen] for f in sections))
        return _uniform(moduli, self._effective(own, e), own, self.length[e][:, None], flags)

    @cached_property
    def C(self) -> Array:
        """Flexibility (..., e, 6, 6)."""
        C = element.flexibility(self._E, self._G, self._stiff, self.length, self._shear)
        for at, own, _ in self._tapered:
            C[..., at, :, :] = own
        return C


class ElementSlice:
    """A run of consecutive elements of a larger table."""

    def __init__(self, whole: Elements, start: int, stop: int) -> None:
        self._whole, self._own = whole, slice(start, stop)

    @property
    def K(self) -> Array:
        """Stiffness (..., e, 12, 12)."""
        return self._whole.K[..., self._own, :, :]

    @property
    def M(self) -> Array:
        """Mass (..., e, 12, 12)."""
        return self._whole.M[..., self._own, :, :]

    @property
    def C(self) -> Array:
        """Flexibility (..., e, 6, 6)."""
        return self._whole.C[..., self._own, :, :]

    @property
    def geometric(self) -> Array:
        """Geometric stiffness (..., e, 2, 12, 12) per axial force at both ends."""
        return self._whole.geometric[..., self._own, :, :, :]

    @property
    def torsion(self) -> Torsion:
        """How the elements (..., e) twist, beyond what K says."""
        return self._whole.torsion.taken(self._own)

    @property
    def length(self) -> Array:
        """Lengths (..., e), m."""
        return self._whole.length[..., self._own]

    def cut(self, pieces: int, tapered_pieces: int = TAPERED_PIECES) -> Cut:
        """The elements cut into uniform pieces; arguments as in `Elements.cut`."""
        return self._whole.cut(self._own, pieces, tapered_pieces)


def _uniform(
    moduli: tuple[Array, ...],
    stiff: SectionProperties,
    section: SectionProperties,
    length: Array,
    flags: tuple[Array, Array],
) -> UniformBeam:
    """Rigidities of the effective section and inertias of the actual one, with shear and rotary inertia as flagged."""
    E, G, rho = moduli
    A, Iy, Iz, J, ky, kz = stiff
    shear, rotary = flags
    slide, mass, polar = shear / (G * A), rho * section.A, rho * (section.Iy + section.Iz)
    turn_y, turn_z = rho * rotary * section.Iy, rho * rotary * section.Iz
    fields = (E * A, G * J, E * Iy, E * Iz, slide / ky, slide / kz, mass, polar, turn_y, turn_z)
    return UniformBeam(*np.broadcast_arrays(*fields, length))


class Members:
    """Entries and groups of a list of members; elements are numbered member by member."""

    def __init__(self, members: Sequence[Link | Flexure], mechanism: Mechanism, table: ValueTable) -> None:
        self.counts = np.array([m.elements for m in members], dtype=np.intp)
        self.first = np.concatenate([[0], np.cumsum(self.counts)]).astype(np.intp)
        self.element_member = np.repeat(np.arange(len(self.counts)), self.counts)
        materials = [mechanism.material(m.material) for m in members]
        self._E = np.array([table.add(m.E) for m in materials], dtype=np.intp)
        self._rho = np.array([table.add(m.rho) for m in materials], dtype=np.intp)
        loss = [
            m.loss_factor if m.loss_factor is not None else own.loss_factor
            for m, own in zip(members, materials, strict=True)
        ]
        self._loss = np.array([table.add(np.nan if eta is None else eta) for eta in loss], dtype=np.intp)
        self._has_nu = np.array([m.nu is not None for m in materials], dtype=bool)
        elastic = [m.nu if m.nu is not None else m.G for m in materials]
        self._nu_or_G = np.array([table.add(v) for v in elastic if v is not None], dtype=np.intp)
        strength = [np.nan if m.yield_stress is None else m.yield_stress for m in materials]
        self._yield = np.array([table.add(value) for value in strength], dtype=np.intp)
        groups = SectionGroups(table)
        for position, member in enumerate(members):
            own = member.section if isinstance(member, Link) else None
            groups.add(position, member, mechanism.sections[own] if isinstance(own, str) else own)
        self.groups = groups.freeze()
        self._collect_families()
        self.is_round = np.zeros(len(self.counts), dtype=bool)
        for group, _, _ in self.groups:
            self.is_round[group.index] = group.kind[0] in ("round", "circle", "tube")
        theories = [m.theory or mechanism.theory for m in members]
        self.corrections = MemberCorrections(members, mechanism, self.groups)
        self.shear = np.array([t == "timoshenko" for t in theories], dtype=float)
        self.shear[self.corrections.shear] = 1.0
        self.rotary = np.array([t != "euler_bernoulli" for t in theories], dtype=float)
        self._flags = (self.shear[self.element_member], self.rotary[self.element_member])

    def _collect_families(self) -> None:
        """For every section formula: its groups with their run of elements in the formula's arguments and stations at
        the elements' middles; the elements; and the member of each."""
        self._families: dict[str, tuple[list[tuple[SectionGroup, slice, Array]], Index, Index]] = {}
        for group, n, _ in self.groups:
            runs, elements, owner = self._families.get(group.family, ([], np.empty(0, int), np.empty(0, int)))
            at = (self.first[group.index][:, None] + np.arange(n)).ravel()
            runs.append((group, slice(len(elements), len(elements) + len(at)), (np.arange(n) + 0.5) / n))
            elements, owner = np.concatenate([elements, at]), np.concatenate([owner, np.repeat(group.index, n)])
            self._families[group.family] = (runs, elements, owner)

    def moduli(self, values: Array) -> tuple[Array, Array, Array, Array]:
        """E (Pa), rho (kg/m^3), nu, G (Pa) of the members, each (..., m)."""
        E, rho, other = values[..., self._E], values[..., self._rho], values[..., self._nu_or_G]
        if self._has_nu.all():
            return E, rho, other, E / (2 * (1 + other))
        nu = np.where(self._has_nu, other, E / (2 * np.where(self._has_nu, 1.0, other)) - 1)
        return E, rho, nu, np.where(self._has_nu, E / (2 * (1 + nu)), other)

    def loss_factors(self, values: Array, default: float = 0.0) -> Array:
        """Structural loss factors of the elements (..., e); `default` for members and materials without any."""
        own = values[..., self._loss]
        return np.where(np.isnan(own), default, own)[..., self.element_member]

    def yield_stress(self, values: Array) -> Array:
        """Yield stress of the members (..., m), Pa; NaN where the material has none."""
        return values[..., self._yield]

    def section_properties(self, values: Array, nu: Array, length: Array) -> SectionProperties:
        """Sections (..., e) at the middle of every element."""
        lead = np.broadcast_shapes(values.shape[:-1], length.shape[:-1])
        table = np.empty((6, *lead, self.first[-1]))
        for family, (groups, elements, owner) in self._families.items():
            sizes = np.empty((FAMILY_SIZES[family], *lead, len(elements)))
            for group, own, middle in groups:
                shape = (*lead, len(group.index), len(middle))
                for row, value in zip(sizes, group.sizes(values, length[..., group.index], middle), strict=True):
                    row[..., own].reshape(shape)[...] = value
            table[..., elements] = family_properties(family, list(sizes), nu[..., owner])
        return SectionProperties(*table)

    def stations(self, values: Array, nu: Array, length: Array, points: Array = STATIONS) -> Stations:
        """Sections of tapered elements at `points` (stations,) of each element's length."""
        lead = np.broadcast_shapes(values.shape[:-1], length.shape[:-1])
        stations: Stations = []
        for group, n, is_tapered in self.groups:
            if is_tapered:
                at = self.first[group.index][:, None] + np.arange(n)
                fractions = ((np.arange(n)[:, None] + points) / n).ravel()
                fields = group.properties(values, nu[..., group.index], length[..., group.index], fractions)
                shape, every = (*lead, at.size, len(points)), (*lead, len(group.index), fractions.size)
                at_stations = SectionProperties(*(np.broadcast_to(f, every).reshape(shape) for f in fields))
                stations.append((at.ravel(), at_stations))
        return stations

    def elements(self, values: Array, length: Array) -> Elements:
        """Elements for values (..., s) and member lengths (..., m), m."""
        E, rho, nu, G = self.moduli(values)
        sections = self.section_properties(values, nu, length)
        m = self.element_member
        moduli = (E[..., m], G[..., m], rho[..., m])
        finer = partial(self.stations, values, nu, length)
        factors = self.corrections.factors(values, nu, length, self.first) if self.corrections.any else None
        torsion = partial(self._torsion, values, nu, length, moduli[0], sections)
        return Elements(
            moduli, sections, finer, (length / self.counts)[..., m], 1 / self.counts[m], self._flags, torsion, factors
        )

    def _torsion(self, values: Array, nu: Array, length: Array, E: Array, sections: SectionProperties) -> Torsion:
        """How elements (..., e) with sections of Young's modulus E (..., e) twist.

        Only rectangles warp. With Ip = Iy + Iz, Irr - Ip^2/A of theirs is 4 (Iy^2 + Iz^2)/5A (theory eq. G24).
        """
        moments = self.corrections.torsion(values, nu, length, self.first)
        wanted = self.corrections.warping[self.element_member]
        A, Iy, Iz = sections.A, sections.Iy, sections.Iz
        return Torsion(moments, wanted * (Iy + Iz) / A, wanted * E * 0.8 * (Iy * Iy + Iz * Iz) / A)

    def bulk(self, values: Array, length: Array) -> tuple[Array, Array, Array]:
        """Torsion constants at both ends (m, 2) and the least along the member (m,), m^4; the least thickness (m,), m.

        One design.
        """
        _, _, nu, _ = self.moduli(values)
        ends, least, thickness = np.empty((len(self.counts), 2)), np.empty(len(self.counts)), np.empty(len(self.counts))
        for group, _, _ in self.groups:
            at = group.index
            own = group.properties(values, nu[at], length[at], np.linspace(0, 1, 41))
            J, depth = (np.broadcast_to(f, (len(at), 41)) for f in (own.J, np.sqrt(12 * own.Iy / own.A)))
            ends[at], least[at] = J[:, [0, -1]], J.min(axis=1)
            thickness[at] = np.minimum(depth, np.sqrt(12 * own.Iz / own.A)).min(axis=1)
        return ends, least, thickness
