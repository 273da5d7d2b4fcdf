"""Poles by poly-reference least squares at every model order, which of them stay where they are from one order to the
next, and which are modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from operator import index
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, eig, solve_triangular, toeplitz

from flexura.arrays import Array, Complex
from flexura.errors import OptionError, SolverError
from flexura.modal import best_pairs, mac
from flexura.testing.measurement import Poles, ResponseMatrix


@dataclass(frozen=True)
class OrderPoles:
    """What one model order has: `poles` (r,), rad/s, ascending, `shapes` (p, r) and `participation` (m, r), scaled."""

    order: int
    poles: Complex
    shapes: Complex
    participation: Complex


def poles_by_order(matrix: ResponseMatrix, order: int, most_damped: float) -> list[OrderPoles]:
    """Poles of a right matrix-fraction model in z = exp(i (omega - omega_0) dt), of every order up to `order`.

    theory eqs. I2-I6; Peeters, Van der Auweraer, Guillaume and Leuridan (2004), Shock and Vibration 11. The lowest
    coefficient of the denominator is fixed, so that poles which only follow noise come out unstable and are dropped, as
    are those outside the band or with a damping ratio above `most_damped`. Raises SolverError when the lines are too
    few for the order.
    """
    omega = matrix.s.imag
    start, dt = omega[0], np.pi / (omega[-1] - omega[0])
    M, numerator = _normal_equations(matrix.scaled, matrix.weight, (omega - start) * dt, order)
    decay = matrix.s.real[0]
    by_order = []
    for n in range(1, order + 1):
        alpha = _denominator(M, matrix.response.shape[2], n)
        z, right, left = _zeros(alpha)
        with np.errstate(divide="ignore"):
            poles = np.log(z) / dt + 1j * start + decay
        is_mode = (np.abs(z) < 1) & (z.imag > 0) & np.isfinite(poles)
        is_mode &= (-poles.real > 0) & (-poles.real < most_damped * np.abs(poles))
        at = np.flatnonzero(is_mode)[np.argsort(np.abs(poles[is_mode]))]
        beta = np.tensordot(numerator[:, :, : len(alpha)], alpha, 1)
        powers = z[at] ** np.arange(order + 1)[:, None]
        shapes = np.einsum("ar,apm,mr->pr", powers, beta, right[:, at], optimize=True)
        by_order.append(OrderPoles(n, poles[at], shapes, left[:, at].conj()))
    return by_order


def _normal_equations(H: Complex, weight: Array, angle: Array, n: int) -> tuple[Array, Array]:
    """Normal equations for the denominator, (n + 1) m square, and the numerator (n + 1, p, (n + 1) m) of it.

    The numerators are eliminated (theory eqs. I4, I5); all blocks are Toeplitz in the powers.
    """
    _, p, m = H.shape
    lags = np.exp(1j * angle * np.arange(-n, n + 1)[:, None]) * weight
    r = lags.real.sum(axis=1)
    S = -(lags @ H.reshape(len(angle), -1)).real.reshape(-1, p, m)
    T = (lags @ (H.conj().transpose(0, 2, 1) @ H).reshape(len(angle), -1)).real.reshape(-1, m, m)
    lag = np.arange(n + 1) - np.arange(n + 1)[:, None] + n
    try:
        R = cholesky(toeplitz(r[n:]), lower=True)
    except np.linalg.LinAlgError:
        raise SolverError(
            f"{len(angle)} spectral lines do not determine a model of order {n}; lower the order or widen the band"
        ) from None
    S = S[lag].transpose(0, 2, 1, 3).reshape(n + 1, -1)
    half = solve_triangular(R, S, lower=True).reshape(-1, (n + 1) * m)
    M = T[lag].transpose(0, 2, 1, 3).reshape((n + 1) * m, -1) - half.T @ half
    return (M + M.T) / 2, -cho_solve((R, True), S).reshape(n + 1, p, (n + 1) * m)


def _denominator(normal: Array, m: int, n: int) -> Array:
    """Coefficients (n + 1) m x m of the denominator, the lowest of them the identity (theory eq. I5)."""
    size = (n + 1) * m
    M, b = normal[m:size, m:size], -normal[m:size, :m]
    try:
        alpha = np.linalg.solve(M, b)
    except np.linalg.LinAlgError:
        alpha = np.linalg.lstsq(M, b)[0]
    return np.concatenate([np.eye(m), alpha]).astype(np.float64)


def _zeros(alpha: Array) -> tuple[Complex, Complex, Complex]:
    """z at which the denominator is singular (r,), with its right and left null vectors (m, r) (theory eq. I6)."""
    m = alpha.shape[1]
    size = len(alpha) - m
    companion = np.eye(size, k=-m)
    companion[:m] = -alpha[m:].reshape(-1, m, m).transpose(1, 0, 2).reshape(m, size)
    x, left, right = (np.asarray(part, dtype=np.complex128) for part in eig(companion, left=True, right=True))
    with np.errstate(divide="ignore", invalid="ignore"):
        return 1 / x, right[-m:], left[:m]


FREQUENCY_BIT, DAMPING_BIT, SHAPE_BIT = 1, 2, 4
"""Bits of a pole that is stable in this."""

SAME_FREQUENCY = 0.01
"""Frequencies of one mode at two orders differ by less, relative."""

SAME_DAMPING = 0.1
"""Damping ratios differ by less, relative."""

SAME_SHAPE = 0.95
"""A shape lies by so much, squared, in the space of those near it at the order before."""

LEAST_SHARE_OF_ORDERS = 0.5
"""A mode is found at so many of the orders from the first at which it is found."""

LEAST_LENGTH_OF_TRACK = 0.2
"""A mode is found at so many of all orders."""

PARALLEL_PARTICIPATION = 0.99
"""Participations of neighbours that are more alike, as MAC, are a poor start for telling them apart."""

PRICE_OF_ABSENCE = 10.0
"""Price of an order that has not a mode, in tolerances of its frequency."""

PICKED_WITHIN = 0.02
"""A frequency that a user picks may be off by so much, relative."""


class Pick(NamedTuple):
    """What a user picks: the pole of a model order that is nearest to a frequency, Hz; without an order that at which
    poles stay."""

    hz: float
    order: int | None = None

    def __str__(self) -> str:
        return f"{self.hz:.9g}" if self.order is None else f"{self.hz:.9g}@{self.order}"


def picks_of(select: Sequence[float | tuple[float, int]]) -> list[Pick]:
    """Picks of frequencies, Hz, and of pairs of a frequency and an order. Raises OptionError for anything else."""
    try:
        pairs = [one if isinstance(one, list | tuple) else (one, None) for one in select]
        picks = [Pick(float(hz), None if order is None else index(order)) for hz, order in pairs]
    except (TypeError, ValueError):
        picks = []
    if not picks or not all(np.isfinite(p.hz) and p.hz > 0 for p in picks):
        raise OptionError(
            f"picked frequencies are positive numbers in Hz, or pairs of one and a model order, not {select}"
        )
    return sorted(picks, key=lambda p: (p.order is None, p.hz))


@dataclass
class Track:
    """One pole tracked over the orders: positions in the orders, and positions of the pole in each."""

    at: list[int] = field(default_factory=list)
    which: list[int] = field(default_factory=list)
    poles: list[complex] = field(default_factory=list)
    picked: Pick | None = None
    """What a user has picked it by, if one has."""
    start: int | None = None
    """Which of its poles was picked, if one was, by its position in them."""

    def has_pole_of(self, other: Track) -> bool:
        """Whether a pole is in both."""
        return not {*zip(self.at, self.which, strict=True)}.isdisjoint(zip(other.at, other.which, strict=True))

    @property
    def late(self) -> Complex:
        """The poles of the later half of its orders, which are less biased (n,), rad/s."""
        return np.array(self.poles[len(self.poles) // 2 :])

    @property
    def pole(self) -> complex:
        """That which was picked, else the median of the late poles, rad/s."""
        if self.start is not None:
            return self.poles[self.start]
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
    bits = [np.zeros(len(order.poles), dtype=np.intp) for order in orders]
    for k, (before, order) in enumerate(pairwise(orders), 1):
        if not (len(before.poles) and len(order.poles)):
            continue
        (f0, z0), (f, z) = _moduli(before.poles), _moduli(order.poles)
        near = np.abs(f0 - f[:, None]) < SAME_FREQUENCY * f[:, None]
        alike = near & (np.abs(z0 - z[:, None]) < SAME_DAMPING * z[:, None])
        inside = np.array([_within(order.shapes[:, r], before.shapes[:, near[r]]) for r in range(len(f))])
        bits[k] = FREQUENCY_BIT * near.any(axis=1) + DAMPING_BIT * alike.any(axis=1) + SHAPE_BIT * (inside > SAME_SHAPE)
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
    size, ratio = _moduli(np.concatenate([order.poles for order in orders]))
    numbers = np.repeat([order.order for order in orders], [len(order.poles) for order in orders])
    return Poles(numbers, size / (2 * np.pi), ratio, np.concatenate(bits))


def tracks(orders: Sequence[OrderPoles], bits: Sequence[NDArray[np.intp]]) -> list[Track]:
    """Poles stable in frequency and damping tracked over the orders, two of one order never in one track.

    That is what tells repeated modes apart: two poles of one place at every order make two tracks.
    """
    tracked: list[Track] = []
    both = FREQUENCY_BIT | DAMPING_BIT
    for k, order in enumerate(orders):
        stable = np.flatnonzero((bits[k] & both) == both)
        partner = np.full(len(stable), -1)
        if len(stable) and tracked:
            last = np.array([t.pole for t in tracked])
            apart = np.abs(order.poles[stable][:, None] - last) / (SAME_FREQUENCY * np.abs(last))
            partner = best_pairs(np.maximum(1.0 - apart, 0.0))
        for r, number in zip(stable, partner, strict=True):
            track = tracked[number] if number >= 0 else Track()
            if number < 0:
                tracked.append(track)
            track.at.append(k)
            track.which.append(int(r))
            track.poles.append(complex(order.poles[r]))
    return tracked


def chosen(tracked: Sequence[Track], orders: int, share: float = LEAST_SHARE_OF_ORDERS) -> list[Track]:
    """Tracks that are long and dense enough to be modes, at a share of the orders from the first, by frequency."""
    least = max(3, LEAST_LENGTH_OF_TRACK * orders)
    modes = (t for t in tracked if len(t.at) >= least and t.share(orders) >= share)
    return sorted(modes, key=lambda t: abs(t.pole))


def picked(
    tracked: Sequence[Track], picks: Sequence[Pick], orders: Sequence[OrderPoles]
) -> tuple[list[Track], dict[Pick, str]]:
    """The tracks that a user picks, each once; and the picks that are not there, each with why.

    A pick with an order is the track of that pole, or the pole alone, and the fit starts from it. One without is the
    track nearest to its frequency, longer ones before shorter, or where there is none the pole of the highest order
    that is near. Raises OptionError for orders that there are not, and for two picks of one mode.
    """
    modes: list[Track] = []
    lost: dict[Pick, str] = {}
    for pick in picks:
        track = _nearest(tracked, pick, orders, modes) if pick.order is None else _at_order(tracked, pick, orders)
        if track is None:
            lost[pick] = _absent(pick, orders)
            continue
        twin = next((t for t in modes if track.has_pole_of(t)), None)
        if twin is not None:
            raise OptionError(
                f"{twin.picked} and {pick} Hz are one mode: its poles stay there from order to order; pick one of them"
            )
        track.picked = pick
        modes.append(track)
    return sorted(modes, key=lambda t: abs(t.pole)), lost


def _nearest(
    tracked: Sequence[Track], pick: Pick, orders: Sequence[OrderPoles], taken: Sequence[Track]
) -> Track | None:
    """The track nearest to a frequency that is not taken, or a pole that is in none of these."""
    w, longest = 2 * np.pi * pick.hz, max((len(t.at) for t in tracked), default=1)
    near = [(abs(abs(t.pole) - w) / (PICKED_WITHIN * w), t) for t in tracked if not any(t is own for own in taken)]
    prices = [(away - len(t.at) / longest, k) for k, (away, t) in enumerate(near) if away < 1]
    return near[min(prices)[1]][1] if prices else _single(w, orders, taken)


def _at_order(tracked: Sequence[Track], pick: Pick, orders: Sequence[OrderPoles]) -> Track | None:
    """The track of the pole of an order nearest to a frequency, which starts from this pole. Raises OptionError."""
    k = next((k for k, own in enumerate(orders) if own.order == pick.order), None)
    if k is None:
        numbers = [own.order for own in orders]
        listed = f"{numbers[0]} to {numbers[-1]}" + ("" if len(numbers) == numbers[-1] else ", each second")
        raise OptionError(f"{pick} Hz: there is no model order {pick.order}; orders: {listed}")
    apart = np.abs(np.abs(orders[k].poles) / (2 * np.pi) - pick.hz)
    if not len(apart) or apart.min() >= SAME_FREQUENCY * pick.hz:
        return None
    pole = k, int(np.argmin(apart))
    alone = Track([k], [pole[1]], [complex(orders[k].poles[pole[1]])])
    track = next((t for t in tracked if pole in zip(t.at, t.which, strict=True)), alone)
    if track.picked is None:
        track.start = track.at.index(k)
    return track


def _absent(pick: Pick, orders: Sequence[OrderPoles]) -> str:
    """What is said of a pick where there is no pole."""
    if pick.order is None:
        return f"there is no pole near {pick} Hz"
    size = next(np.abs(own.poles) / (2 * np.pi) for own in orders if own.order == pick.order)
    nearest = f"the nearest is at {size[np.argmin(np.abs(size - pick.hz))]:.5g} Hz" if len(size) else "it has none"
    return f"there is no pole near {pick.hz:.9g} Hz at order {pick.order}: {nearest}"


def _single(w: float, orders: Sequence[OrderPoles], taken: Sequence[Track]) -> Track | None:
    """The pole of the highest order near an angular frequency, if it is not in a track that is taken."""
    used = {(k, r) for t in taken for k, r in zip(t.at, t.which, strict=True)}
    for k in range(len(orders) - 1, -1, -1):
        apart = np.abs(np.abs(orders[k].poles) - w)
        for r in np.argsort(apart):
            if apart[r] < PICKED_WITHIN * w and (k, int(r)) not in used:
                return Track([k], [int(r)], [complex(orders[k].poles[r])])
    return None


def start_values(modes: Sequence[Track], orders: Sequence[OrderPoles]) -> tuple[Complex, Complex]:
    """Poles (n,) and participation (m, n) to start from: medians, and vectors of the order that fits these best.

    Vectors come from one order as far as it has the modes, so that those of repeated modes differ from each other;
    where they do not, the second starts across the first.
    """
    poles = np.array([t.pole for t in modes])
    cost = np.full((len(modes), len(orders)), PRICE_OF_ABSENCE)
    for row, t, pole in zip(cost, modes, poles, strict=True):
        row[t.at] = np.abs(np.array(t.poles) - pole) / (SAME_FREQUENCY * abs(pole))
    best = int(np.argmin(cost.sum(axis=0)))
    nearest = [int(np.argmin(np.abs(np.array(t.at) - best))) if t.start is None else t.start for t in modes]
    columns = [orders[t.at[k]].participation[:, t.which[k]] for t, k in zip(modes, nearest, strict=True)]
    participation = np.array(columns).T
    for r in range(1, len(poles)):
        near = np.flatnonzero(np.abs(poles[:r] - poles[r]) < SAME_FREQUENCY * abs(poles[r]))
        if len(near) and np.max(mac(participation[:, near], participation[:, [r]])) > PARALLEL_PARTICIPATION:
            rows = np.linalg.svd(participation[:, near].T)[2]
            if len(rows) > len(near):
                participation[:, r] = rows[-1].conj()
    return poles, participation
