"""Corrections of members beyond beam theory, as factors on the stiffness of their elements."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Bools, Index
from flexura.beam import (
    SectionProperties,
    anticlastic_compliance,
    beam_flexibility,
    block_factors,
    notch_flexibility,
    rectangle,
    secondary_constant,
    warping_compliance,
    warping_constant,
    warping_decay,
    warping_element,
)
from flexura.duals import with_slopes_of, zeros
from flexura.mechanism import CORRECTIONS, Flexure, Link, Mechanism, possible_corrections
from flexura.structure.sections import SectionGroup
from flexura.structure.values import common

UNIFORM = ("leaf", "rectangle", "layered")
STRIPS = (*UNIFORM, "tapered")
"""Kinds of sections of which the whole member is a strip, not a web."""

MOST_SHARING = 64
"""Elements of a strip that share their warping, at most: each is coupled with all others. Longer rows twist evenly."""

SLICES = 160
"""Slices into which a notch is cut at least; its flexibility is then integrated within 0.1 %."""

EVEN = np.array([1.0, 1 / 3, 1 / 5])
"""Means of the squares of Legendre's polynomials of degree 0 to 2."""


class Factors(NamedTuple):
    """Factors (..., e) on the stiffness of elements: EA, EIy, EIz, GJ, and shear along y and z. Mass stays as it is."""

    axial: Array
    bend_y: Array
    bend_z: Array
    twist: Array
    shear_y: Array
    shear_z: Array

    def applied(self, sections: SectionProperties, at: Index | slice, stations: bool = False) -> SectionProperties:
        """Effective section of the elements `at`, whose sections are (..., e') or (..., e', stations)."""
        a, y, z, t, along_y, along_z = (f[..., at, None] if stations else f[..., at] for f in self)
        A, Iy, Iz, J, ky, kz = sections
        return SectionProperties(A * a, Iy * y, Iz * z, J * t, ky * along_y / a, kz * along_z / a)


class Distortion(NamedTuple):
    """How sections of the elements (..., e) warp and bow; the leading axes are those of designs, which `place` lacks.

    `place` (e,): 1 in the first element of a strip whose warping is held, 2 in its others, 0 in those of members that
    have one compliance in torsion all along. `stiffness` (e,), N m, is GJ over length where it is needed, `mean` (e,)
    the mean compliance under a constant torque, over that of it. Ends warp at rates of their own in f cases, by how the
    ends of members are held (theory eq. F19), both ends in one case and then in the next; A (e, 3, 3), B (e, 3, 2f) and
    Z (e, 2f, 2f) are those of `warping_element`, and what is held is decoupled. `polar` (e,), m^2: polar second moment
    over area. `wagner` (e,), N m^4: E (Irr - Ip^2/A) of the fourth and second polar moments. Both are 0 where no
    correction for warping is asked for. `bow` (e, 4) is plate stiffness times width, N m^2, 0 where no correction for
    plates is asked for, Poisson's ratio, 12 (1 - nu^2) b^4/t^2, m^2, and the share of its free bow that the strip has;
    it bows as it bends about y or z, 0 or 1 in `plane` (e,).
    """

    place: Index
    stiffness: Array
    mean: Array
    A: Array
    B: Array
    Z: Array
    polar: Array
    wagner: Array
    bow: Array
    plane: Index

    @staticmethod
    def even(place: Index, cases: int, *sources: Any, lead: tuple[int, ...] = ()) -> Distortion:
        """Of elements that have one compliance all along, for numbers that are worked out of `sources`."""
        e, sizes = len(place), ((3, 3), (3, 2 * cases), (2 * cases, 2 * cases))
        A, B, Z = (zeros((*lead, e, *size), *sources) for size in sizes)
        A[...], Z[...] = np.diag(EVEN), np.eye(2 * cases)
        return Distortion(place, np.ones(e), np.ones(e), A, B, Z, np.zeros(e), np.zeros(e), np.zeros((e, 4)), place)

    @property
    def cases(self) -> int:
        """The number f of cases of held ends."""
        return self.Z.shape[-1] // 2

    def taken(self, elements: slice | Index) -> Distortion:
        """Those of some elements."""
        return self.each(lambda field, own: field[(..., elements, *(slice(None),) * own)])

    def each(self, change: Callable[[Any, int], Any]) -> Distortion:
        """With each field changed, told how many axes of its own an element has in it."""
        own = {"A": 2, "B": 2, "Z": 2, "bow": 1}
        return Distortion(*(change(field, own.get(name, 0)) for name, field in self._asdict().items()))

    def padded(self, cases: int) -> Distortion:
        """With ends that resist warping in further cases alone, so many in all."""
        if cases == self.cases:
            return self
        lead, own = self.Z.shape[:-3], slice(0, self.Z.shape[-1])
        whole = Distortion.even(self.place, cases, self.B, self.Z, lead=lead)
        whole.B[..., own], whole.Z[..., own, own] = self.B, self.Z
        return self._replace(B=whole.B, Z=whole.Z)


class Strips:
    """Strips for values (..., s), Poisson's ratio (..., m) and lengths (..., m), m, of members, by their group and the
    number of their elements; what several corrections ask of them is worked out once."""

    def __init__(self, values: Array, nu: Array, length: Array) -> None:
        self.values: Array = values
        self.nu: Array = nu
        self.length: Array = length
        self._warping: dict[tuple[int, float], tuple[Array, Array]] = {}

    def sides(self, group: SectionGroup, n: int) -> tuple[Array, Array]:
        """Width and thickness (..., m, n + 1) at the edges of elements, or (..., m, 1) of those that do not taper, m;
        without the axis of designs where they do not vary."""
        sizes = group.sizes(self.values, self.length[..., group.index], np.arange(n + 1) / n)
        return common(sizes[0], 2), common(sizes[-1], 2)

    def warping(self, group: SectionGroup, n: int, times: float) -> tuple[Array, Array]:
        """As `warping_along`, of a span so many times as long as the member."""
        key = int(group.index[0]), times
        if key not in self._warping:
            b, t = self.sides(group, n)
            nu, L = (own[..., group.index, None] for own in (self.nu, self.length))
            self._warping[key] = warping_along(b, t, nu, L, n, times)
        return self._warping[key]


class MemberCorrections:
    """Which corrections the members of a list have, and the factors that they come to.

    `active` (m, 5), in the order of CORRECTIONS, and `clamped` (m, 2), how far from free (0) to held flat (1) the ends
    are, hold once `settle` has been called: they depend on the sizes at the default parameters. `rooted` (m, 2) are
    ends whose root is elastic where they are in something, `unrooted` (m, 2) those whose root corrections leave out,
    though nothing says that it is rigid.
    """

    def __init__(
        self, members: Sequence[Link | Flexure], mechanism: Mechanism, groups: list[tuple[SectionGroup, int, bool]]
    ) -> None:
        self._groups = groups
        self.wanted: Bools = np.zeros((len(members), len(CORRECTIONS)), dtype=bool)
        gives: Bools = np.zeros((len(members), 2), dtype=bool)
        for row, member in enumerate(members):
            chosen = mechanism.corrections if member.corrections is None else member.corrections
            form = member.section if isinstance(member, Link) else member.profile
            form = mechanism.sections[form] if isinstance(form, str) else form
            possible = possible_corrections(form, member.theory or mechanism.theory)
            names = possible if chosen == "auto" else possible & set(() if chosen == "none" else chosen)
            self.wanted[row] = [name in names for name in CORRECTIONS]
            gives[row] = ["root" in possible and root == "elastic" for root in member.root]
        self.rooted: Bools = self.wanted[:, -1:] & gives
        self.unrooted: Bools = gives & ~self.rooted
        self.shear: Bools = self.wanted[:, CORRECTIONS.index("shear")]
        self.warping: Bools = self.wanted[:, CORRECTIONS.index("warping")]
        self.bows: Bools = self.wanted[:, CORRECTIONS.index("plate")].copy()
        for group, _, _ in groups:
            self.bows[group.index] &= group.kind[0] in STRIPS
        self.settle(np.zeros((len(members), 2)), np.zeros(len(members), dtype=bool))

    def settle(self, clamped: Array, has_root: Bools) -> None:
        """Take in how far the ends are clamped (m, 2), from 0 to 1, and which members (m,) end in something thicker."""
        self.clamped = clamped
        plate, warping, shear, notch, _ = self.wanted.T
        holds = (clamped > 0).any(axis=1)
        self.active: Bools = np.stack([plate & holds, warping & holds, shear, notch, has_root], axis=1)
        plate, warping, _, notch, _ = self.active.T
        self.any: bool = bool((plate | warping | notch).any())
        self.coupled: list[tuple[SectionGroup, int, Index]] = self._coupled()
        """Strips whose warping is held and whose elements, several but not too many, share it: their group, how many
        elements, and which of it."""

    def held(self, values: Array, length: Array) -> Array:
        """How far (m,) notches are held flat by the blocks that their factors are for. One design."""
        held = np.zeros(len(self.wanted))
        for group, _, _ in self._groups:
            if place := group.between_blocks(values, length[group.index]):
                notch = self.wanted[group.index, CORRECTIONS.index("notch")]
                held[group.index] = notch * place[2].plate[:, 0]
        return held

    def torsion(self, strips: Strips, first: Index) -> Distortion:
        """`Distortion` of all elements, but for stiffness and what twist stretches; arguments as in `factors`."""
        values, nu, length = strips.values, strips.nu, strips.length
        warping = self.active[:, CORRECTIONS.index("warping")]
        groups = [(group, n) for group, n, _ in self._groups if group.kind[0] in STRIPS]
        held = np.concatenate([np.empty(0, dtype=np.intp), *(group.index for group, _ in groups)])
        held = held[warping[held]]
        used = [case for case, (share, *_) in enumerate(_holds(self.clamped)) if share[held].any()]
        lead = np.broadcast_shapes(values.shape[:-1], length.shape[:-1])
        torsion = Distortion.even(np.zeros(first[-1], dtype=np.intp), len(used), values, nu, length, lead=lead)
        for group, n in groups:
            own = np.flatnonzero(warping[group.index])
            members = group.index[own]
            at, cases = first[members][:, None] + np.arange(n), _holds(self.clamped[members])
            torsion.place[at] = np.where(np.arange(n), 2, 1)
            A = (1 - sum((share for share, *_ in cases), np.zeros((len(own), 1))))[..., None, None] * np.diag(EVEN)
            for k, (share, times, start) in enumerate(cases[case] for case in used):
                kappa, x = (along[..., own, :] for along in strips.warping(group, n, times))
                matrices = warping_element(x[..., 1:] - x[..., :-1], kappa)
                own_A, B, Z = (share[..., None, None] * matrix for matrix in matrices)
                free = np.repeat((share > 0)[..., None], n, axis=1) & np.ones(2, dtype=bool)
                free[:, 0, 0] &= start == 0
                free[:, -1, 1] &= start == -1
                both, columns = free[..., None] & free[..., None, :], slice(2 * k, 2 * k + 2)
                A = A + own_A
                torsion.B[..., at, :, columns] = np.where(free[..., None, :], B, 0.0)
                torsion.Z[..., at, columns, columns] = np.where(both, Z, ~both * np.eye(2))
            torsion.A[..., at, :, :] = A
        return torsion

    def _coupled(self) -> list[tuple[SectionGroup, int, Index]]:
        warping = self.active[:, CORRECTIONS.index("warping")]
        found = [(group, n, np.flatnonzero(warping[group.index])) for group, n, _ in self._groups]
        return [(g, n, own) for g, n, own in found if 1 < n <= MOST_SHARING and len(own) and g.kind[0] in STRIPS]

    def factors(self, strips: Strips, first: Index) -> Factors:
        """Factors of all elements, for what `strips` are for; `first` (m + 1,) is the first element of every member."""
        values, nu, length = strips.values, strips.nu, strips.length
        lead = np.broadcast_shapes(values.shape[:-1], length.shape[:-1])
        factors = Factors(*np.ones((len(Factors._fields), *lead, first[-1]), like=values))
        for group, n, is_tapered in self._groups:
            active = self.active[group.index]
            if not active[:, [0, 1, 3]].any():
                continue
            L, own_nu = length[..., group.index], nu[..., group.index]
            clamped = self.clamped[group.index]
            flanks: tuple[Array | float, ...] = (1.0,) * len(Factors._fields)
            held = blocks = flanks
            if group.kind[0] not in UNIFORM:
                cut, flanks = _flanks(group, values, L, n, is_tapered, active[:, 3:4])
            if not active[:, :2].any():
                pass
            elif group.kind[0] in STRIPS:
                held = _strip(strips, group, n, active, clamped)
            else:
                held = _web(cut, own_nu[..., None], active, clamped)
            if active[:, 3].any() and (place := group.between_blocks(values, L)):
                slender, broad, powers = place
                blocks = _blocks(block_factors(slender, broad, own_nu[..., None], powers), active)
            at = first[group.index][:, None] + np.arange(n)
            for target, *own in zip(factors, flanks, held, blocks, strict=True):
                target[..., at] = math.prod(own)
        return factors


def _strip(strips: Strips, group: SectionGroup, n: int, active: Bools, clamped: Array) -> tuple[Array | float, ...]:
    """Factors, (..., m, n) or 1, of strips, along which x/b is the integral of dx/b (theory eq. F5)."""
    plate, warping = active[:, :1], active[:, 1:2]
    nu, L = (own[..., group.index, None] for own in (strips.nu, strips.length))
    over_b, over_t = (_over(side, L, n) for side in strips.sides(group, n)) if plate.any() else (L, L)
    every = []
    for share, times, start in held_cases(clamped):
        case: list[Array | float] = [1.0, 1.0, 1.0]
        if plate.any():
            case[:2] = [anticlastic_compliance(nu, 1.0, *_place(x, times, start)) for x in (over_b, over_t)]
        if warping.any():
            kappa, x = strips.warping(group, n, times)
            case[2] = warping_compliance(1.0, kappa, *_place(x, times, start))
        every.append([share * (1 - c) for c in case])
    bend_y, bend_z, twist = (1 / (1 - sum(terms)) for terms in zip(*every, strict=True))
    bend_y, bend_z = (np.where(plate, bend, 1.0) for bend in (bend_y, bend_z))
    return 1.0, bend_y, bend_z, np.where(warping, twist, 1.0), 1.0, 1.0


def _over(size: Array, L: Array, n: int) -> Array:
    """The integral (..., m, n + 1) of dx/size from the first end to the edges of the elements, for a size that is the
    same all along (..., m, 1) or given at the edges, linear in between."""
    if size.shape[-1] == 1:
        return np.arange(n + 1) / n * (L / size)
    inner = np.cumsum(beam_flexibility(L[..., 0] / n, size)[1], axis=-1)
    return np.concatenate([0.0 * inner[..., :1], inner], axis=-1)


def _place(x: Array, times: float, start: float) -> tuple[Array, Array, Array]:
    """Span, starts and stops of the elements whose edges are at x (..., m, n + 1), from the middle of the span."""
    at = start * x[..., -1:] + x
    return times * x[..., -1:], at[..., :-1], at[..., 1:]


def warping_along(b: Array, t: Array, nu: Array, L: Array, n: int, times: float) -> tuple[Array, Array]:
    """Kappa (..., m, n) of theory eq. F8, or (..., m, 1), and the integral (..., m, n + 1) of lambda up to the edges of
    the elements of strips with sides b and t as of `Strips`; nu, L: (..., m, 1)."""
    J = rectangle(b, t, nu).J
    decay, kappa = warping_decay(nu, J, warping_constant(b, t), secondary_constant(nu, J, b, t, times * L))
    return kappa if kappa.shape[-1] == 1 else (kappa[..., 1:] + kappa[..., :-1]) / 2, _over(1 / decay, L, n)


def held_cases(clamped: Array) -> list[tuple[Array, float, float]]:
    """Those of `_holds` that some member has."""
    return [case for case in _holds(clamped) if case[0].any()]


def _holds(clamped: Array) -> list[tuple[Array, float, float]]:
    """Shares (m, 1) of members held flat at both ends, at the first and at the second one, with the span and where the
    member begins in it, from its middle, in units of its length.

    Held ends take off flexibility in proportion to how far they are held (theory eq. F19).
    """
    first, second = clamped[:, :1], clamped[:, 1:]
    both = (first * second, 1.0, -0.5)
    return [both, (first * (1 - second), 2.0, -1.0), (second * (1 - first), 2.0, 0.0)]


class _Slices(NamedTuple):
    """A notch in slices (..., m, k) of equal length dx (..., m, 1).

    Rotation per moment and stretch per force with the section's extent across the plane equal to 1, for the profiles
    along y and z: what the active theory says, and beam theory; sizes at the middles.
    """

    dx: Array
    y: tuple[Array, Array]
    z: tuple[Array, Array]
    beam_y: tuple[Array, Array]
    beam_z: tuple[Array, Array]
    width: Array
    thickness: Array


def _slices(group: SectionGroup, values: Array, L: Array, count: int, notch: Bools) -> _Slices:
    """Cut notches into `count` slices; `notch` (m, 1) tells which follow wedge theory."""
    sizes = group.sizes(values, L, np.arange(count + 1) / count)
    dx, profiles = common(L, 1) / count, []
    for extent in (common(sizes[0], 2), common(sizes[-1], 2)):
        if profiles and with_slopes_of(extent, profiles[0][-1]) is None and np.array_equal(extent, profiles[0][-1]):
            profiles.append(profiles[0])
            continue
        lead = np.broadcast_shapes(extent.shape[:-2], dx.shape[:-1])
        h = np.broadcast_to(extent, (*lead, len(group.index), count + 1))
        flexibility = beam = beam_flexibility(dx, h)
        if notch.any():
            steep = notch_flexibility(dx, h, beam)
            flexibility = np.where(notch, steep[0], beam[0]), np.where(notch, steep[1], beam[1])
        profiles.append((flexibility, beam, (h[..., 1:] + h[..., :-1]) / 2, h))
    (y, beam_y, width, _), (z, beam_z, thickness, _) = profiles
    return _Slices(dx[..., None], y, z, beam_y, beam_z, width, thickness)


def _flanks(
    group: SectionGroup, values: Array, L: Array, n: int, is_tapered: bool, notch: Bools
) -> tuple[_Slices, tuple[Array | float, ...]]:
    """Members of varying section in slices, and the factors (..., m, n) of those of them (m, 1) with the correction
    `notch`, relative to the section in the middle of every element or, for tapered ones, to the integral over it
    (theory eqs. F15-F18). L: (..., m)."""
    per = -(-SLICES // n)
    cut = _slices(group, values, L, n * per, notch)
    pairs = ((1, 1), (1, 0), (0, 1))  # rotation or stretch of the profiles along y and z: EA, EIy, EIz
    beam, corrected = [], []
    for y, z in pairs:
        plain = cut.beam_y[y] * cut.beam_z[z] / cut.dx
        of_y, of_z = cut.y[y] / cut.beam_y[y] - 1, cut.z[z] / cut.beam_z[z] - 1
        if group.kind == ("tapered",):  # a thin strip that bends is a plate, to which the slope of its edges is little
            of_y = of_y if z else of_y * np.minimum(cut.thickness / cut.width, 1.0)
            of_z = of_z if y else of_z * np.minimum(cut.width / cut.thickness, 1.0)
        excess = _together(of_y, of_z)
        for out, slices in ((beam, plain), (corrected, plain * (1 + excess))):
            out.append(slices.reshape(*slices.shape[:-1], n, per).sum(axis=-1))
    if not is_tapered:
        sizes = group.sizes(values, L, (np.arange(n) + 0.5) / n)
        b, t, dx = sizes[0], sizes[-1], per * cut.dx
        stepped = (dx / (b * t), 12 * dx / (b * t**3), 12 * dx / (b**3 * t))
        beam = [np.where(notch, s, o) for s, o in zip(stepped, corrected, strict=True)]
    return cut, (*(base / o for base, o in zip(beam, corrected, strict=True)), 1.0, 1.0, 1.0)


def _blocks(factors: Iterable[Array], active: Bools) -> tuple[Array, ...]:
    """Factors (..., m, 1) of notches between blocks (theory eq. F26), 1 where what they add to is left out."""
    plate, warping, notch = (active[:, k : k + 1] for k in (0, 1, 3))
    asked = notch, notch & plate, notch, notch & warping, notch, notch
    return tuple(np.where(of, factor, 1.0) for of, factor in zip(asked, factors, strict=True))


def _together(y: Array, z: Array) -> Array:
    """Excess over beam theory of a slice whose profiles along y and z exceed it by `y` and `z` (theory eq. F18)."""
    both = y + z
    return (y * y + z * z) / np.where(both > 0, both, 1.0)


def _web(cut: _Slices, nu: Array, active: Bools, clamped: Array) -> tuple[Array | float, ...]:
    """Factors, (..., m, 1) or 1, of notches whose web is wide, as of a leaf of an equivalent length (theory eqs.
    F16-F17)."""
    plate, warping = active[:, :1], active[:, 1:2]
    dx, rotation, stretch = cut.dx, cut.z[0], cut.z[1]
    b = cut.width[..., :1]
    web = cut.thickness.min(axis=-1, keepdims=True)
    x = dx * (np.arange(rotation.shape[-1]) + 0.5)
    weight = web**3 / 12 * rotation
    area, first, second = ((weight * x**k).sum(axis=-1, keepdims=True) for k in (0, 1, 2))
    J = rectangle(cut.width, cut.thickness, nu).J
    J_web = rectangle(b, web, nu).J
    length = (J_web * dx / J).sum(axis=-1, keepdims=True)
    constant = warping_constant(b, web)
    poles = {-0.5: first / area, -1.0: dx * rotation.shape[-1], 0.0: 0.0 * dx}
    bend, turn = np.zeros_like(b * web), np.zeros_like(b * web)
    for share, times, start in held_cases(clamped):
        span = times * web * stretch.sum(axis=-1, keepdims=True)
        bend = bend + share * (1 - anticlastic_compliance(nu, b, span, -span / 2, 0.0))
        pole = poles[start]
        inertia = second - 2 * pole * first + pole * pole * area
        decay, kappa = warping_decay(nu, J_web, constant, secondary_constant(nu, J_web, b, web, span))
        z = decay * np.sqrt(3 * inertia / length)
        turn = turn + share * kappa * np.tanh(z) / z
    return 1.0, np.where(plate, 1 / (1 - bend), 1.0), 1.0, np.where(warping, 1 / (1 - turn), 1.0), 1.0, 1.0
