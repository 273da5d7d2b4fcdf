"""Strips whose elements share their warping: how they twist where torque varies, and what roots do to that.

A bar twists by theta' = [(1 - kappa) t + kappa w]/GJ with w - w''/lambda^2 = t (Vlasov 1961), so that a torque in one
element twists others of the same strip. Under a torque that is the same all along nothing of that is seen: it is in the
compliance of each (theory eqs. F27-F28).
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import rectangle, warping_coupling, warping_shares
from flexura.duals import plain, zeros
from flexura.structure.corrections import MemberCorrections, Strips, held_cases
from flexura.structure.sections import SectionGroup

RX, W, COUPLED_TWIST = 1, 5, (10, 11)
"""Entries of a root's flexibility: twist, shift along the thickness, and what is coupled with twist."""

Roots: TypeAlias = tuple[Index, Index, Array]
"""Elements and ends (r,) that have roots, and their flexibilities (..., r, 12)."""


class Coupling(NamedTuple):
    """How torques in the elements (m, n) of m strips twist the others of the same strip by the warping that they share.

    S (..., m, n, n), rad/(N m), is positive semidefinite: torques t (n,) twist the elements by - S t, beside what the
    flexibility of each says, and those that are the same all along by nothing (theory eq. F27).
    """

    elements: Index
    S: Array

    def within(self, run: slice) -> Coupling | None:
        """That of strips in a run of elements, numbered from its first; None without any."""
        own = (self.elements[:, 0] >= run.start) & (self.elements[:, 0] < run.stop)
        return Coupling(self.elements[own] - run.start, self.S[..., own, :, :]) if own.any() else None


class SharedWarping(NamedTuple):
    """How the elements of strips twist each other; the roots without what gives by warping; and that, rad/(N m), as a
    compliance of the elements (..., e), None where there is none."""

    couplings: list[Coupling]
    roots: Roots | None
    compliance: Array | None


def shared_warping(
    corrections: MemberCorrections,
    strips: Strips,
    moduli: tuple[Array, Array | None],
    roots: Roots | None,
    *,
    first: Index,
) -> SharedWarping:
    """Of all `strips` whose warping is held, in the order of `corrections.coupled`; `first` is the first element of
    every member.

    `moduli` are G, Pa, (..., m), and factors on GJ of elements (..., e) beside those of `corrections`, of which the
    larger counts of two elements. A root gives to the bimoment that a torque makes at it (theory eq. F29).
    """
    G, stiffer = moduli
    couplings: list[Coupling] = []
    giving = None if roots is None or not corrections.coupled else _GivingRoots(roots, strips.values, int(first[-1]))
    for group, n, own in corrections.coupled:
        members = group.index[own]
        b, _ = strips.sides(group, n)
        soft, shares = _softened(strips, group, n, own, G[..., members, None], corrections.clamped[members])
        elements = first[members][:, None] + np.arange(n)
        if stiffer is not None:
            one, other = stiffer[..., elements, None], stiffer[..., elements][..., None, :]
            soft = soft / np.where(plain(one) < plain(other), other, one)
        S = soft.sum(axis=-1)[..., None] * np.eye(n) - soft
        if giving is not None:
            S = giving.taken(S, elements, b[..., own, :], shares)
        couplings.append(Coupling(elements, S))
    if giving is None:
        return SharedWarping(couplings, roots, None)
    return SharedWarping(couplings, giving.left, giving.compliance)


def _softened(
    strips: Strips, group: SectionGroup, n: int, rows: Index, G: Array, clamped: Array
) -> tuple[Array, list[Array | None]]:
    """Twist of each element per torque in others (..., m, n, n) of some strips of a group, of n elements, and for each
    end the shares (..., m, n) of the bimoment there, times how far it is held, None where it is of no strip; G
    (..., m, 1)."""
    b, t = (side[..., rows, :] for side in strips.sides(group, n))
    nu, L = (each[..., group.index[rows], None] for each in (strips.nu, strips.length))
    b_mid, t_mid = (size if size.shape[-1] == 1 else (size[..., 1:] + size[..., :-1]) / 2 for size in (b, t))
    GJ, soft, shares = G * rectangle(b_mid, t_mid, nu).J, np.zeros((len(clamped), n, n)), list[Array | None]([None] * 2)
    for share, times, start in held_cases(clamped):
        kappa, x = (along[..., rows, :] for along in strips.warping(group, n, times))
        held = start != 0.0, start != -1.0
        root = np.sqrt(L / (n * GJ * (x[..., 1:] - x[..., :-1])))
        soft = soft + share[..., None] * root[..., :, None] * warping_coupling(x, kappa, held) * root[..., None, :]
        for end in (0, 1):
            if held[end]:
                own, before = share * warping_shares(x, end, all(held)), shares[end]
                shares[end] = own if before is None else before + own
    return soft, shares


class _GivingRoots:
    """Roots of which what gives by warping goes over to the elements of their strips."""

    def __init__(self, roots: Roots, values: Array, elements: int) -> None:
        self._elements, self._ends, given = roots
        self._flexibility = given + 0.0
        lead = np.broadcast_shapes(values.shape[:-1], given.shape[:-2])
        self.compliance: Array = zeros((*lead, elements), given)
        self._place = {key: k for k, key in enumerate(zip(roots[0].tolist(), roots[1].tolist(), strict=True))}

    @property
    def left(self) -> Roots:
        """What is left of the roots."""
        return self._elements, self._ends, self._flexibility

    def taken(self, S: Array, elements: Index, b: Array, shares: list[Array | None]) -> Array:
        """S (..., m, n, n) with what the roots of strips (m, n) of widths b give; it is their elements' from now on."""
        m, n = elements.shape
        for end, share in enumerate(shares):
            row = np.array([self._place.get((e, end), -1) for e in elements[:, -end].tolist()])
            own = np.flatnonzero(row >= 0)
            if not len(own) or share is None:
                continue
            C = self._flexibility[..., row[own], :]
            width = np.broadcast_to(b[..., -end], (*b.shape[:-2], m))[..., own]
            v, total = share[..., own, :], share[..., own, :].sum(axis=-1)
            r = C[..., RX] - 12 * C[..., W] / width**2
            r = np.where((plain(r) > 0) & (plain(total) > 0), r, 0.0 * r)
            v = v / np.where(plain(total) > 0, total, 1.0)[..., None]
            more = r[..., None, None] * (v[..., :, None] * np.eye(n) - v[..., :, None] * v[..., None, :])
            before, S = S, zeros((*np.broadcast_shapes(S.shape[:-3], more.shape[:-3]), m, n, n), S, more)
            S[...] = before
            S[..., own, :, :] = S[..., own, :, :] + more
            self.compliance[..., elements[own]] = self.compliance[..., elements[own]] + r[..., None] * v
            self._flexibility[..., row[own], RX] = left = C[..., RX] - r
            needed = _coupled(C) / np.where(plain(left) > 0, left, 1.0)
            for entry in COUPLED_TWIST:  # as much as what is left of the twist can be coupled
                self._flexibility[..., row[own], entry] = C[..., entry] / (1 + needed * needed) ** 0.25
        return S


def _coupled(C: Array) -> Array:
    """The least twist (...) that roots C (..., 12) need for what is coupled with it."""
    v, turn, r, v_twist, r_twist = (C[..., k] for k in (2, 3, 4, 10, 11))
    minor = v * r - turn * turn
    coupled = v_twist * (v_twist * r - 2 * r_twist * turn) + r_twist * r_twist * v
    return coupled / np.where(plain(minor) > 0, minor, 1.0)
