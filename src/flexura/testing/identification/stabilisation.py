"""Which poles stay where they are from one model order to the next, and which of them are modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.modal import best_pairs, mac
from flexura.testing.identification.lscf import OrderPoles
from flexura.testing.measurement import Poles

FREQUENCY, DAMPING, SHAPE = 1, 2, 4
"""Bits of a pole that is stable in this."""

SAME_FREQUENCY = 0.01
"""Frequencies of one mode at two orders differ by less, relative."""

SAME_DAMPING = 0.1
"""Damping ratios differ by less, relative."""

SAME_SHAPE = 0.95
"""A shape lies by so much, squared, in the space of those near it at the order before."""

LEAST_SHARE = 0.5
"""A mode is found at so many of the orders from the first at which it is found."""

LEAST_LENGTH = 0.2
"""A mode is found at so many of all orders."""

PARALLEL = 0.99
"""Participations of neighbours that are more alike, as MAC, are a poor start for telling them apart."""

REACH = 0.02
"""A frequency that a user picks may be off by so much, relative."""


@dataclass
class Track:
    """One pole tracked over the orders: positions in the orders, and positions of the pole in each."""

    at: list[int] = field(default_factory=list)
    which: list[int] = field(default_factory=list)
    poles: list[complex] = field(default_factory=list)
    asked: float = 0.0
    """Frequency, Hz, for which a user has picked it; zero where none has."""

    @property
    def late(self) -> Complex:
        """The poles of the later half of its orders, which are less biased (n,), rad/s."""
        return np.array(self.poles[len(self.poles) // 2 :])

    @property
    def pole(self) -> complex:
        """Median of the late poles, rad/s."""
        return complex(np.median(self.late.real), np.median(self.late.imag))

    @property
    def frequency_scatter(self) -> float:
        """Standard deviation of the late frequencies, relative."""
        size = np.abs(self.late)
        return float(size.std() / size.mean())

    @property
    def damping_scatter(self) -> float:
        """Standard deviation of the late damping ratios, relative."""
        ratio = -self.late.real / np.abs(self.late)
        return float(ratio.std() / ratio.mean())

    def share(self, orders: int) -> float:
        """Share of the orders, from the first at which it is found, that have it."""
        return len(self.at) / (orders - self.at[0])


def stability(orders: Sequence[OrderPoles]) -> list[NDArray[np.intp]]:
    """Bits of every pole of every order, against the poles of the order before (theory eqs. I7, I8)."""
    bits = [np.zeros(len(own.poles), dtype=np.intp) for own in orders]
    for k in range(1, len(orders)):
        before, own = orders[k - 1], orders[k]
        if not (len(before.poles) and len(own.poles)):
            continue
        (f0, z0), (f, z) = _moduli(before.poles), _moduli(own.poles)
        near = np.abs(f0 - f[:, None]) < SAME_FREQUENCY * f[:, None]
        alike = near & (np.abs(z0 - z[:, None]) < SAME_DAMPING * z[:, None])
        inside = np.array([_within(own.shapes[:, r], before.shapes[:, near[r]]) for r in range(len(f))])
        bits[k] = FREQUENCY * near.any(axis=1) + DAMPING * alike.any(axis=1) + SHAPE * (inside > SAME_SHAPE)
    return bits


def _moduli(poles: Complex) -> tuple[Array, Array]:
    return np.abs(poles), -poles.real / np.abs(poles)


def _within(shape: Complex, space: Complex) -> float:
    """Squared share of a shape that lies in a space."""
    if not space.shape[1]:
        return 0.0
    basis, size, _ = np.linalg.svd(space / np.linalg.norm(space, axis=0), full_matrices=False)
    inside = basis[:, size > 1e-6 * size[0]].conj().T @ shape
    return float(np.linalg.norm(inside) ** 2 / np.linalg.norm(shape) ** 2)


def diagram(orders: Sequence[OrderPoles], bits: Sequence[NDArray[np.intp]]) -> Poles:
    """All poles of all orders."""
    poles = np.concatenate([own.poles for own in orders])
    count = [len(own.poles) for own in orders]
    order = np.repeat([own.order for own in orders], count)
    size, ratio = _moduli(poles)
    return Poles(order, size / (2 * np.pi), ratio, np.concatenate(bits))


def tracks(orders: Sequence[OrderPoles], bits: Sequence[NDArray[np.intp]]) -> list[Track]:
    """Poles stable in frequency and damping tracked over the orders, two of one order never in one track.

    That is what tells repeated modes apart: two poles of one place at every order make two tracks.
    """
    found: list[Track] = []
    wanted = FREQUENCY | DAMPING
    for k, own in enumerate(orders):
        stable = np.flatnonzero((bits[k] & wanted) == wanted)
        partner = np.full(len(stable), -1)
        if len(stable) and found:
            last = np.array([t.pole for t in found])
            apart = np.abs(own.poles[stable][:, None] - last) / (SAME_FREQUENCY * np.abs(last))
            partner = best_pairs(np.maximum(1.0 - apart, 0.0))
        for r, number in zip(stable, partner, strict=True):
            track = found[number] if number >= 0 else Track()
            if number < 0:
                found.append(track)
            track.at.append(k)
            track.which.append(int(r))
            track.poles.append(complex(own.poles[r]))
    return found


def chosen(found: Sequence[Track], orders: int) -> list[Track]:
    """Tracks that are long and dense enough to be modes, ascending in frequency."""
    least = max(3, LEAST_LENGTH * orders)
    own = [t for t in found if len(t.at) >= least and t.share(orders) >= LEAST_SHARE]
    return sorted(own, key=lambda t: abs(t.pole))


def picked(
    found: Sequence[Track], wanted_hz: Sequence[float], orders: Sequence[OrderPoles]
) -> tuple[list[Track], list[float]]:
    """The tracks nearest to frequencies that a user picks, Hz, each once, longer ones before shorter; and what is lost.

    Where there is no track, the pole of the highest order that is near. Raises OptionError for impossible frequencies.
    """
    size = np.array([abs(t.pole) for t in found])
    wanted = 2 * np.pi * np.asarray(wanted_hz, dtype=float)
    if wanted.ndim != 1 or not len(wanted) or not (np.isfinite(wanted) & (wanted > 0)).all():
        raise OptionError(f"picked frequencies are positive numbers in Hz, not {wanted_hz}")
    result: list[Track] = []
    lost: list[float] = []
    free = np.ones(len(found), dtype=bool)
    length = np.array([len(t.at) for t in found])
    for w in np.sort(wanted):
        near = free & (np.abs(size - w) < REACH * w)
        if near.any():
            price = np.abs(size - w) / (REACH * w) - length / max(length.max(), 1)
            best = int(np.argmin(np.where(near, price, np.inf)))
            free[best] = False
            found[best].asked = w / (2 * np.pi)
            result.append(found[best])
            continue
        single = _single(w, orders, result)
        if single is None:
            lost.append(w / (2 * np.pi))
        else:
            single.asked = w / (2 * np.pi)
            result.append(single)
    return sorted(result, key=lambda t: abs(t.pole)), lost


def _single(w: float, orders: Sequence[OrderPoles], taken: Sequence[Track]) -> Track | None:
    """The pole of the highest order near an angular frequency, if it is not in a track that is taken."""
    used = {(k, r) for t in taken for k, r in zip(t.at, t.which, strict=True)}
    for k in range(len(orders) - 1, -1, -1):
        apart = np.abs(np.abs(orders[k].poles) - w)
        for r in np.argsort(apart):
            if apart[r] < REACH * w and (k, int(r)) not in used:
                return Track([k], [int(r)], [complex(orders[k].poles[r])])
    return None


def start_values(own: Sequence[Track], orders: Sequence[OrderPoles]) -> tuple[Complex, Complex]:
    """Poles (n,) and participation (m, n) to start from: medians, and vectors of the order that fits these best.

    Vectors come from one order as far as it has the modes, so that those of repeated modes differ from each other;
    where they do not, the second starts across the first.
    """
    poles = np.array([t.pole for t in own])
    misfit = np.full(len(orders), 0.0)
    for t, pole in zip(own, poles, strict=True):
        cost = np.full(len(orders), 10.0)
        cost[t.at] = np.abs(np.array(t.poles) - pole) / (SAME_FREQUENCY * abs(pole))
        misfit += cost
    best = int(np.argmin(misfit))
    columns = []
    for t in own:
        k = int(np.argmin(np.abs(np.array(t.at) - best)))
        columns.append(orders[t.at[k]].participation[:, t.which[k]])
    participation = np.array(columns).T
    for r in range(1, len(poles)):
        near = np.flatnonzero(np.abs(poles[:r] - poles[r]) < SAME_FREQUENCY * abs(poles[r]))
        if len(near) and np.max(mac(participation[:, near], participation[:, [r]])) > PARALLEL:
            rows = np.linalg.svd(participation[:, near].T)[2]
            participation[:, r] = rows[-1].conj() if len(rows) > len(near) else participation[:, r]
    return poles, participation
