"""Strips whose elements share their warping: how they twist where torque varies, and what roots do to that.

A bar twists by theta' = [(1 - kappa) t + kappa w]/GJ with w - w''/lambda^2 = t (Vlasov 1961), so that a torque in one
element twists others of the same strip. Under a torque that is the same all along nothing of that is seen: it is in the
compliance of each (theory eqs. F27-F28).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import rectangle, warping_coupling, warping_shares
from flexura.duals import plain, zeros
from flexura.structure.corrections import MemberCorrections, held_cases, warping_along
from flexura.structure.values import common

RX, W, COUPLED_TWIST = 1, 5, (10, 11)
"""Entries of a root's flexibility: twist, shift along the thickness, and what is coupled with twist."""

Roots = tuple[Index, Index, Array]
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
    values: Array,
    moduli: tuple[Array, Array, Array | None],
    length: Array,
    roots: Roots | None,
    *,
    first: Index,
) -> SharedWarping:
    """Of all strips whose warping is held, in the order of `corrections.coupled`, for lengths (..., m), m; `first` is
    the first element of every member.

    `moduli` are G, Pa, and nu (..., m), and factors on GJ of elements (..., e) beside those of `corrections`, of which
    the larger counts of two elements. A root gives to the bimoment that a torque makes at it (theory eq. F29).
    """
    G, nu, stiffer = moduli
    if roots is not None and corrections.coupled:
        lead = np.broadcast_shapes(values.shape[:-1], roots[2].shape[:-2])
        compliance, flexibility = zeros((*lead, first[-1]), roots[2]), roots[2] + 0.0
    else:
        compliance = flexibility = None
    couplings = []
    for group, n, own in corrections.coupled:
        members = group.index[own]
        own_G, own_nu, L = (every[..., members, None] for every in (G, nu, length))
        sizes = group.sizes(values, length[..., group.index], np.arange(n + 1) / n)
        b, t = (common(size, 2)[..., own, :] for size in (sizes[0], sizes[-1]))
        middle = [size if size.shape[-1] == 1 else (size[..., 1:] + size[..., :-1]) / 2 for size in (b, t)]
        GJ = own_G * rectangle(*middle, own_nu).J
        elements, soft = first[members][:, None] + np.arange(n), 0.0
        at_ends: list[Array | float] = [0.0, 0.0]
        for share, times, start in held_cases(corrections.clamped[members]):
            kappa, x = warping_along(b, t, own_nu, L, n, times)
            held = start != 0.0, start != -1.0
            root = np.sqrt(L / (n * GJ * (x[..., 1:] - x[..., :-1])))
            soft = soft + share[..., None] * root[..., :, None] * warping_coupling(x, kappa, held) * root[..., None, :]
            for end in np.flatnonzero(held):
                at_ends[end] = at_ends[end] + share * warping_shares(x, int(end), all(held))
        if stiffer is not None:
            one, other = stiffer[..., elements][..., :, None], stiffer[..., elements][..., None, :]
            soft = soft / np.where(plain(one) < plain(other), other, one)
        S = soft.sum(axis=-1)[..., None] * np.eye(n) - soft
        if roots is not None and flexibility is not None and compliance is not None:
            for end in (0, 1):
                place = {int(e): k for k, e in enumerate(roots[0]) if roots[1][k] == end}
                row = np.array([place.get(int(e), -1) for e in elements[:, -end]])
                rooted, shares = np.flatnonzero(row >= 0), at_ends[end]
                if not len(rooted) or isinstance(shares, float):
                    continue
                C = flexibility[..., row[rooted], :]
                width = np.broadcast_to(b[..., -end], (*b.shape[:-2], len(members)))[..., rooted]
                r = C[..., RX] - 12 * C[..., W] / width**2
                v, total = shares[..., rooted, :], shares[..., rooted, :].sum(axis=-1)
                r = np.where((plain(r) > 0) & (plain(total) > 0), r, 0.0 * r)
                v = v / np.where(plain(total) > 0, total, 1.0)[..., None]
                more = r[..., None, None] * (v[..., :, None] * np.eye(n) - v[..., :, None] * v[..., None, :])
                whole = zeros((*np.broadcast_shapes(S.shape[:-3], more.shape[:-3]), len(members), n, n), S, more)
                whole[...] = S
                whole[..., rooted, :, :] = whole[..., rooted, :, :] + more
                S = whole
                compliance[..., elements[rooted]] = compliance[..., elements[rooted]] + r[..., None] * v
                flexibility[..., row[rooted], RX] = left = C[..., RX] - r
                needed = _coupled(C) / np.where(plain(left) > 0, left, 1.0)
                for entry in COUPLED_TWIST:  # as much as what is left of the twist can be coupled
                    flexibility[..., row[rooted], entry] = C[..., entry] / (1 + needed * needed) ** 0.25
        couplings.append(Coupling(elements, S))
    if roots is None or flexibility is None:
        return SharedWarping(couplings, roots, None)
    return SharedWarping(couplings, (roots[0], roots[1], flexibility), compliance)


def _coupled(C: Array) -> Array:
    """The least twist (...) that roots C (..., 12) need for what is coupled with it."""
    v, turn, r, v_twist, r_twist = (C[..., k] for k in (2, 3, 4, 10, 11))
    minor = v * r - turn * turn
    coupled = v_twist * (v_twist * r - 2 * r_twist * turn) + r_twist * r_twist * v
    return coupled / np.where(plain(minor) > 0, minor, 1.0)
