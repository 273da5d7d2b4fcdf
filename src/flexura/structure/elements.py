"""Matrices of beam elements in their own axes, many at once."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import (
    COUPLED_FLEXIBILITY_BASIS,
    PLANE_BASIS,
    SectionProperties,
    UniformBeam,
    combine,
    element,
    gauss_stations,
    geometric_basis,
    in_planes,
    root_coefficients,
    root_mass,
    rooted_stiffness,
    tapered,
    tapered_geometric_basis,
)
from flexura.duals import without_slopes, zeros
from flexura.structure.corrections import Distortion, Factors
from flexura.structure.warping import Coupling

Stations = list[tuple[Index, SectionProperties]]
"""Tapered elements and their sections (..., e', stations)."""

STATIONS, WEIGHTS = gauss_stations(6)
"""Gauss rule of a tapered element."""

TAPERED_PIECES = 16
"""Most uniform steps that stand for a tapered element."""

STEP_CHANGE = 0.02
"""Most relative change of a rigidity or mass along a step of a tapered element, as long as it has fewer steps."""

STEP_ERROR = 1e-5
"""Most relative error of the lowest frequencies that the steps of a tapered member cause, as long as its elements have
fewer."""


class Cut(NamedTuple):
    """Elements cut into pieces: the distinct beams, for every piece in order which of them it is, and the number of
    pieces of every element; `root` (e, 2), which of the flexibilities `roots` (k, 6, 6), element axes, is between its
    first and its last piece and its ends, -1 for none."""

    beam: UniformBeam
    kind: Index
    counts: Index
    root: Index
    roots: Array


class Elements:
    """Matrices of beam elements in their own axes, each worked out when first asked for.

    Mass follows from the sections themselves, stiffness from the effective ones that corrections make of them.
    K, M: (..., e, 12, 12); flexibility C: (..., e, 6, 6), end j loaded with end i clamped; length: (..., e), m; share:
    (e,), that of an element in the length of its member. `couplings` say how elements of strips twist each other beyond
    what K says of each by itself. `roots`: elements (r,) with an elastic root, at which end
    (r,), and its flexibility (..., r, 12) as of `root_flexibility`, x leading into the member; it is part of K and C.
    """

    def __init__(
        self,
        moduli: Array,
        sections: Array,
        finer: Callable[[Array], Stations],
        length: Array,
        *,
        share: Array,
        flags: tuple[Array, Array],
        torsion: Callable[[], Distortion],
        couplings: list[Coupling],
        factors: Factors | None = None,
        roots: tuple[Index, Index, Array] | None = None,
    ) -> None:
        self._tables = moduli, sections
        self._E, self._G, self._rho = moduli
        self._sections, self._finer, self._factors = SectionProperties(*sections), finer, factors
        self._torsion = torsion
        self.couplings: list[Coupling] = couplings
        self._stiff = self._sections if factors is None else factors.applied(self._sections, slice(None))
        self._stations = finer(STATIONS)
        self.length = length
        self._share = share
        self._shear, self._rotary = flags
        self._roots = roots

    @property
    def still(self) -> Elements:
        """The same without slopes."""
        twin = object.__new__(Elements)
        vars(twin).update({name: without_slopes(own) for name, own in vars(self).items()})
        twin._finer, twin._torsion = partial(_still, self._finer), partial(_still, self._torsion)
        return twin

    @cached_property
    def _tapered(self) -> list[tuple[Index, Array, Array]]:
        """Flexibility and mass of the tapered elements."""
        elements = []
        for at, sections in self._stations:
            moduli = (self._E[..., at], self._G[..., at], self._rho[..., at])
            flags = (self._shear[at], self._rotary[at])
            stiff = self._effective(sections, at)
            elements.append((at, *tapered(*moduli, stiff, self.length[..., at], *flags, STATIONS, WEIGHTS, sections)))
        return elements

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
        if self._roots is None:
            return K
        soft = self._rooted_stiffness()
        whole = zeros((*np.broadcast_shapes(K.shape[:-3], soft.shape[:-2]), *K.shape[-3:]), K, soft)
        whole[...] = K
        whole[..., self.rooted, :, :] = combine(soft, PLANE_BASIS, 12)
        return whole

    @cached_property
    def rooted(self) -> Index:
        """Elements (r,) with elastic roots."""
        return np.empty(0, dtype=np.intp) if self._roots is None else np.unique(self._roots[0])

    def _rooted_stiffness(self) -> Array:
        """Stiffness (..., r, 72) of `rooted` elements in `PLANE_BASIS`."""
        C = self.flexibility_coefficients[..., self.rooted, :]
        L = np.broadcast_to(self.length[..., self.rooted], C.shape[:-1]).reshape(-1)
        K = rooted_stiffness(_in_planes(C, self.flexibility_basis), L)
        return np.moveaxis(K.reshape(72, *C.shape[:-1]), 0, -1)

    @cached_property
    def root_mass(self) -> Array:
        """What elastic roots change of the mass of `rooted` elements (..., r, 72), in `PLANE_BASIS`;
        `mass_coefficients` lack it."""
        assert self._roots is not None
        at, ends, flexibility = self._roots
        rooted = self.rooted
        C, M = (table[..., rooted, :] for table in (self.flexibility_coefficients, self.mass_coefficients))
        lead = np.broadcast_shapes(C.shape[:-1], M.shape[:-1])
        springs = []
        for end in (0, 1):
            here = np.flatnonzero(ends == end)
            root = zeros((*flexibility.shape[:-2], len(rooted), C.shape[-1]), flexibility)
            root[..., np.searchsorted(rooted, at[here]), :] = root_coefficients(flexibility[..., here, :], 0.0, end)
            springs.append(_in_planes(np.broadcast_to(root, (*lead, root.shape[-1])), self.flexibility_basis))
        C, M = (
            _in_planes(np.broadcast_to(table, (*lead, table.shape[-1])), basis)
            for table, basis in ((C, self.flexibility_basis), (M, self.mass_basis))
        )
        L = np.broadcast_to(self.length[..., rooted], lead).reshape(-1)
        return np.moveaxis(root_mass(C, M, L, np.stack(springs)).reshape(72, *lead), 0, -1)

    @cached_property
    def _own_mass(self) -> Array:
        """Mass (..., e, 12, 12) without what elastic roots change of it."""
        M = element.mass(self._rho, self._sections, self.length, *self._phi, self._rotary)
        for at, _, mass in self._tapered:
            M[..., at, :, :] = mass
        return M

    @cached_property
    def M(self) -> Array:
        """Mass (..., e, 12, 12)."""
        if self._roots is None:
            return self._own_mass
        change = self.root_mass
        lead = np.broadcast_shapes(self._own_mass.shape[:-3], change.shape[:-2])
        M = zeros((*lead, *self._own_mass.shape[-3:]), self._own_mass, change)
        M[...] = self._own_mass
        M[..., self.rooted, :, :] += combine(change, PLANE_BASIS, 12)
        return M

    @cached_property
    def geometric(self) -> Array:
        """Geometric stiffness (..., e, 2, 12, 12) per axial force at both ends, linear between them."""
        K_g = geometric_basis(self.uniform)
        for at, sections in self._stations:
            stiff, moduli = self._effective(sections, at), (self._E[..., at], self._G[..., at])
            arguments = (stiff, sections, self.length[..., at], self._shear[at])
            K_g[..., at, :, :, :] = tapered_geometric_basis(*moduli, *arguments, STATIONS, WEIGHTS)
        return K_g

    @property
    def volume(self) -> Array:
        """Volume of the elements (..., e), m^3."""
        return self._along(lambda area: area)

    @property
    def resistance(self) -> Array:
        """Length over area of the elements (..., e), 1/m, which resists what flows along them."""
        return self._along(lambda area: 1 / area)

    def _along(self, of: Callable[[Array], Array]) -> Array:
        """Integrals (..., e) along the elements of what follows from their area."""
        along = self.length * of(self._sections.A)
        for at, sections in self._stations:
            along[..., at] = self.length[..., at] * (of(sections.A) @ WEIGHTS)
        return along

    @cached_property
    def torsion(self) -> Distortion:
        """How the elements (..., e) twist, beyond what K says."""
        return self._torsion()

    @cached_property
    def flexibility_coefficients(self) -> Array:
        """Coefficients (..., e, k) of C in `flexibility_basis`."""
        of_members = self._coefficients[0]
        for at, C, _ in self._tapered:
            of_members[..., at, :] = _picked(C, element.END_FLEXIBILITY_BASIS)
        if self._roots is None:
            return of_members
        lead = np.broadcast_shapes(of_members.shape[:-2], self._roots[2].shape[:-2])
        whole = zeros((*lead, of_members.shape[-2], len(self.flexibility_basis)), of_members, self._roots[2])
        whole[..., : of_members.shape[-1]] = of_members
        at, ends, root = self._roots
        for end in (0, 1):  # one element may have both
            here = np.flatnonzero(ends == end)
            whole[..., at[here], :] += root_coefficients(root[..., here, :], self.length[..., at[here]], end)
        return whole

    @property
    def can_be(self) -> bool:
        """Whether flexibility and mass of all elements are known to be positive and finite; others may be, too."""
        return self._coefficients[2] and self._roots is None and not self._stations

    @property
    def flexibility_basis(self) -> Array:
        """The basis (k, 36) of the flexibility: `COUPLED_FLEXIBILITY_BASIS` where there are elastic roots."""
        return element.END_FLEXIBILITY_BASIS if self._roots is None else COUPLED_FLEXIBILITY_BASIS

    @property
    def mass_basis(self) -> Array:
        """The basis (k, 144) of the mass: `MASS_BASIS`, or with tapered elements `MASS_ENTRIES`."""
        return element.MASS_ENTRIES if self._stations else element.MASS_BASIS

    @cached_property
    def mass_coefficients(self) -> Array:
        """Coefficients (..., e, k) of M in `mass_basis`."""
        if self._stations:
            return _picked(self._own_mass, element.MASS_ENTRIES)
        return self._coefficients[1]

    @cached_property
    def _coefficients(self) -> tuple[Array, Array, bool]:
        """Coefficients of flexibility and mass of uniform elements, with the section at the middle of each, and whether
        these are known to be those of elements that can be."""
        moduli, actual = self._tables
        stiff = actual if self._factors is None else np.stack(np.broadcast_arrays(*self._stiff))
        return element.coefficients(moduli, stiff, actual, self.length, self._shear, self._rotary)

    @cached_property
    def uniform(self) -> UniformBeam:
        """The elements (..., e) as uniform beams, with the section at the middle of each."""
        moduli, flags = (self._E, self._G, self._rho), (self._shear, self._rotary)
        return _uniform(moduli, self._stiff, self._sections, self.length, flags)

    def cut(self, run: slice, pieces: int, tapered_pieces: int = TAPERED_PIECES) -> Cut:
        """A run of elements cut into uniform pieces of equal length.

        A tapered element is first cut into at most `tapered_pieces` steps, as many as its change of section asks for,
        with the section at the middle of each; then every element or step is cut into `pieces`, so that all numbers of
        pieces stand for one and the same structure. One design.
        """
        kinds: list[Index] = [np.full(pieces, k) for k in range(run.stop - run.start)]
        beams = [self.uniform.take(run).cut(pieces)]
        first = len(kinds)
        for group, steps in enumerate(self._steps(tapered_pieces)):
            at = self._stations[group][0]
            in_run = (at >= run.start) & (at < run.stop)
            for count in np.unique(steps[in_run]):
                chosen = np.flatnonzero(in_run & (steps == count))
                beam = self._stepped(group, chosen, (np.arange(count) + 0.5) / count)
                beams.append(UniformBeam(*(f.ravel() for f in beam)).cut(count * pieces))
                for element_number in at[chosen]:
                    kinds[element_number - run.start] = np.repeat(first + np.arange(count), pieces)
                    first += count
        beam = UniformBeam(*(np.concatenate(fields) for fields in zip(*beams, strict=True)))
        counts = np.array([len(k) for k in kinds], dtype=np.intp)
        return Cut(beam, np.concatenate(kinds), counts, *self._roots_of(run))

    def _roots_of(self, run: slice) -> tuple[Index, Array]:
        """Elastic roots of a run of elements, as of `Cut`; one design."""
        which = np.full((run.stop - run.start, 2), -1, dtype=np.intp)
        if self._roots is None:
            return which, np.empty((0, 6, 6))
        at, ends, flexibility = self._roots
        in_run = np.flatnonzero((at >= run.start) & (at < run.stop))
        which[at[in_run] - run.start, ends[in_run]] = np.arange(len(in_run))
        turned = [root_coefficients(flexibility[k], 0.0, int(ends[k])) for k in in_run]
        C = np.reshape(turned, (-1, len(COUPLED_FLEXIBILITY_BASIS)))
        return which, combine(C, COUPLED_FLEXIBILITY_BASIS, 6)

    def _steps(self, most: int) -> list[Index]:
        """Numbers of steps (e',) of the tapered elements of every group, at most so many; one design.

        Along a step of length h = b L of a member, whose flexibility f changes by d = ln(f2/f1), the energy int f m^2
        of a moment m is taken with f at the middle. The midpoint rule leaves d^2/24 + d b L (m^2)'/(12 m^2) of it. As
        int f (m^2)' is what m^2 is at a clamped end, some 4 times its mean, a frequency is off by half the mean of
        d^2/24 + d b/3: STEP_CHANGE bounds the first term, STEP_ERROR the second.
        """
        counts = []
        intervals = max(most, TAPERED_PIECES)
        for group in range(len(self._stations)):
            beam = self._stepped(group, slice(None), np.linspace(0.0, 1.0, intervals + 1))
            sizes = np.stack([beam.EA, beam.GJ, beam.EIy, beam.EIz, beam.mass])
            with np.errstate(divide="ignore", invalid="ignore"):  # without mass nothing of it changes
                change = np.nan_to_num(np.abs(np.diff(np.log(sizes), axis=-1))).max(axis=(0, -1))
            whole = intervals * change
            wanted = np.maximum(
                whole / STEP_CHANGE, np.sqrt(whole * self._share[self._stations[group][0]] / (6 * STEP_ERROR))
            )
            counts.append(np.clip(np.ceil(wanted - 1e-6), 1, most).astype(np.intp))
        return counts

    def _stepped(self, group: int, chosen: Index | slice, points: Array) -> UniformBeam:
        """Sections at `points` (stations,) of chosen tapered elements of a group as beams (e', stations) of their full
        length; one design."""
        at, sections = self._finer(points)[group]
        e = at[chosen]
        moduli = tuple(m[e][:, None] for m in (self._E, self._G, self._rho))
        flags = (self._shear[e][:, None], self._rotary[e][:, None])
        section = SectionProperties(*(f[chosen] for f in sections))
        return _uniform(moduli, self._effective(section, e), section, self.length[e][:, None], flags)

    @cached_property
    def C(self) -> Array:
        """Flexibility (..., e, 6, 6)."""
        if self._roots is not None:
            return combine(self.flexibility_coefficients, self.flexibility_basis, 6)
        return self.member_C

    @cached_property
    def member_C(self) -> Array:
        """Flexibility (..., e, 6, 6) without elastic roots."""
        C = element.flexibility(self._E, self._G, self._stiff, self.length, self._shear)
        for at, tapered_C, _ in self._tapered:
            C[..., at, :, :] = tapered_C
        return C


def _still(work: Callable[..., Any], *arguments: Any) -> Any:
    """What a function gives, without slopes."""
    return without_slopes(work(*arguments))


def _in_planes(coefficients: Array, basis: Array) -> Array:
    """Matrices `in_planes` of coefficients (..., k) of a basis (k, rows * columns)."""
    n = round(basis.shape[1] ** 0.5)
    planes = in_planes(basis.reshape(-1, n, n))
    flat = planes.reshape(-1, len(basis)) @ np.swapaxes(coefficients.reshape(-1, len(basis)), 0, 1)
    return flat.reshape(*planes.shape[:-1], -1)


class ElementSlice:
    """A run of consecutive elements of a larger table, which is worked out when first asked for."""

    def __init__(self, whole: Callable[[], Elements], start: int, stop: int) -> None:
        self._table, self._own = whole, slice(start, stop)

    @property
    def _whole(self) -> Elements:
        return self._table()

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
    def member_C(self) -> Array:
        """Flexibility (..., e, 6, 6) without elastic roots."""
        return self._whole.member_C[..., self._own, :, :]

    @property
    def geometric(self) -> Array:
        """Geometric stiffness (..., e, 2, 12, 12) per axial force at both ends."""
        return self._whole.geometric[..., self._own, :, :, :]

    @property
    def torsion(self) -> Distortion:
        """How the elements (..., e) twist, beyond what K says."""
        return self._whole.torsion.taken(self._own)

    @property
    def couplings(self) -> list[Coupling]:
        """How elements of strips twist each other, beyond what K says of each by itself."""
        found = (coupling.within(self._own) for coupling in self._whole.couplings)
        return [coupling for coupling in found if coupling is not None]

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


def _picked(matrices: Array, basis: Array) -> Array:
    """Coefficients (..., k) of matrices (..., m, m) in a basis (k, m m) whose terms share no entry."""
    at = np.argmax(basis != 0, axis=1)
    flat = matrices.reshape(*matrices.shape[:-2], basis.shape[1])
    return flat[..., at] * basis[np.arange(len(at)), at]
