"""Which mode of one model or test is which of another: by shape, close modes compared as a space; by frequency alone;
and from one step of a model to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.modal.criteria import mac, space_mac
from flexura.results import Tabular
from flexura.thresholds import REPEATED_EIGENVALUES


def assignment(cost: NDArray[Any]) -> tuple[Index, Index]:
    """Rows and columns, one to one, with the least sum of `cost`, rows ascending; as many as the shorter side has.

    Where the least of every row lies in a column of its own no other choice is less; else the algorithm of Jonker and
    Volgenant (1987) decides.
    """
    if cost.shape[0] > cost.shape[1]:
        columns, rows = assignment(cost.T)
        order = np.argsort(rows)
        return rows[order], columns[order]
    least = cost.argmin(axis=1) if cost.size else np.zeros(cost.shape[0], dtype=np.intp)
    if len(np.unique(least)) == len(least):
        return np.arange(len(least)), least
    from scipy.optimize import linear_sum_assignment  # slow to import

    return linear_sum_assignment(cost)


def best_pairs(gain: NDArray[Any]) -> Index:
    """For every row (n,) the column that it is paired with, one to one, so that the sum of `gain` is largest.

    A pair whose gain is not positive is none: such rows have -1.
    """
    rows, columns = assignment(-gain)
    is_pair = gain[rows, columns] > 0
    partner = np.full(len(gain), -1, dtype=np.intp)
    partner[rows[is_pair]] = columns[is_pair]
    return partner


def close_groups(frequency: Array, gap: float) -> tuple[Index, ...]:
    """Groups of modes with no gap wider than `gap`, relative, in order of frequency or of eigenvalue."""
    if not len(frequency):
        return ()
    order = np.argsort(frequency, kind="stable")
    ascending = frequency[order]
    return tuple(np.split(order, np.flatnonzero(np.diff(ascending) > gap * np.abs(ascending[1:])) + 1))


SKIP_PRICE = 0.02
"""Price of a reference mode without a partner, as a logarithm of frequency."""

STRAY_PRICE = 0.2
"""Price of a frequency without a partner."""


def in_order(reference: Array, frequencies: Array) -> list[int]:
    """Pair ascending frequencies without crossing, so that the sum of |ln f/f_ref| is least.

    Modes on either side may be left out at a price, which is low for the reference's: a method is more likely to miss a
    mode than to invent one. Reference frequencies beyond the last pair cost nothing.
    """
    floor = 1e-6 * float(max(np.max(reference, initial=0.0), np.max(frequencies, initial=0.0), 1e-300))
    far = np.abs(np.log(np.asarray(frequencies) + floor)[:, None] - np.log(np.asarray(reference) + floor))
    k, n = far.shape
    cost = np.full((k + 1, n + 1), np.inf)
    step = np.zeros((k + 1, n + 1), dtype=int)  # 0 a pair, 1 a reference skipped, 2 a frequency skipped
    cost[0], step[0] = SKIP_PRICE * np.arange(n + 1), 1
    cost[:, 0], step[:, 0] = STRAY_PRICE * np.arange(k + 1), 2
    for i in range(1, k + 1):
        for j in range(1, n + 1):
            choices = (
                cost[i - 1, j - 1] + far[i - 1, j - 1],
                cost[i, j - 1] + SKIP_PRICE,
                cost[i - 1, j] + STRAY_PRICE,
            )
            step[i, j] = int(np.argmin(choices))
            cost[i, j] = choices[step[i, j]]
    partner = [-1] * k
    i, j = k, int(np.argmin(cost[k]))
    while i > 0:
        taken = step[i, j]
        if taken == 0:
            partner[i - 1] = j - 1
        i, j = i - int(taken != 1), j - int(taken != 2)
    return partner


SAME_MODE = 0.5
"""Least modal assurance criterion of a pair of two models of one mechanism, whose shapes are known throughout."""

REPEATED = 1e-5
"""Frequencies of a model closer than this, relative, are taken as repeated: their shapes are compared as a space."""

CLOSE = 0.02
"""Modes whose frequencies differ by less than this, relative, may have mixed: they are compared as a space."""

LEAST_LIKENESS = 0.5
"""Least likeness of a pair beyond chance: 0 is what random shapes have on average, 1 the same shape."""

FREQUENCY_SHARE = 0.1
"""What a distance of one in the logarithm of frequency costs, beside a likeness of one."""

MAC_SHARE = 0.1
"""What the shapes one by one count beside the spaces, where modes are close."""


def mac_with_spaces(reference: ArrayLike, shapes: ArrayLike, groups: Sequence[Index], weight: Any = None) -> Array:
    """MAC (k, n) of reference shapes (p, k) and shapes (p, n); reference modes of one group stand as their space.

    Any mixture of modes of a repeated frequency is a mode as well (theory eqs. 57, L11). `weight` as in `mac`.
    """
    x = np.asarray(reference)
    overlap = mac(x, shapes, weight=weight)
    for group in groups:
        if len(group) > 1:
            overlap[group] = space_mac(shapes, x[:, group], weight)
    return overlap


def pair_by_mac(overlap: Array, reference_hz: Array, frequency_hz: Array) -> Index:
    """For every mode (n,) the reference mode with which the sum of their MACs `overlap` (k, n) is largest, or -1.

    A pair has a MAC of one half or more. Nearer frequencies go first among equal MACs.
    """
    distance = np.abs(reference_hz[:, None] - frequency_hz)
    nearness = 1e-6 * distance / max(float(distance.max(initial=0.0)), np.finfo(float).tiny)
    return best_pairs(np.where(overlap >= SAME_MODE, overlap - nearness, 0.0).T)


@dataclass(frozen=True, repr=False)
class ModePairing(Tabular):
    """Pairs of test and model modes.

    `partner` (n,) is the model's mode for every test mode, -1 without; `mac` (n, k) compares the shapes one by one, and
    `likeness` (n, k) is the best agreement beyond chance of shapes or spaces. `test_spaces` and `model_spaces` are the
    groups of close modes, each mode in one.
    """

    partner: Index
    mac: Array
    likeness: Array
    test_spaces: tuple[Index, ...]
    model_spaces: tuple[Index, ...]

    def _title(self) -> str:
        return f"{np.count_nonzero(self.partner >= 0)} of {len(self.partner)} test modes have a counterpart"

    def _columns(self) -> dict[str, Any]:
        """Pairs, both numbered from 1."""
        test = np.flatnonzero(self.partner >= 0)
        model = self.partner[test]
        return {
            "test mode": test + 1,
            "model mode": model + 1,
            "mac": self.mac[test, model],
            "likeness": self.likeness[test, model],
        }

    def space_of(self, test: int) -> tuple[Index, Index]:
        """The groups of close modes, test and model, that a pair lies in."""
        model = self.partner[test]
        return (
            next(s for s in self.test_spaces if test in s),
            next((s for s in self.model_spaces if model in s), np.empty(0, dtype=np.intp)),
        )


@verb
def pair_modes(
    test_hz: ArrayLike,
    test_shapes: ArrayLike,
    *,
    model_hz: ArrayLike,
    model_shapes: ArrayLike,
    close: float = CLOSE,
) -> ModePairing:
    """Pair modes of a test (n,), (p, n) with those of a model (k,), (p, k), frequencies in Hz.

    Modes closer than `close` on either side can be any mixture of each other: a shape is then compared with the space
    of all of them. Of p sensors, random shapes have the share c/p in a space of c, which is taken off; a pair must
    be half way from there to one. Among these the assignment with the largest sum is taken, nearer frequencies first
    where shapes leave it open (theory eqs. Q4, Q8). A single sensor has no shapes: modes are then paired in order of
    frequency. Raises OptionError for arrays that do not fit together, and a `close` that is not in 0 <= close < 1.
    """
    f, g = np.asarray(test_hz, dtype=float), np.asarray(model_hz, dtype=float)
    x, y = np.asarray(test_shapes), np.asarray(model_shapes)
    if x.ndim != 2 or y.ndim != 2 or x.shape[1:] != f.shape or y.shape[1:] != g.shape or len(x) != len(y):
        raise OptionError(
            f"shapes are (sensors, modes) with a frequency for every mode; found {x.shape} with {f.shape} and"
            f" {y.shape} with {g.shape}"
        )
    if not 0 <= close < 1:
        raise OptionError(f"close is a relative difference of frequencies, 0 <= close < 1, not {close}")
    alone, spaces = mac(x, y), (close_groups(f, close), close_groups(g, close))
    if len(x) == 1:
        order = np.argsort(f)
        partner = np.full(len(f), -1, dtype=np.intp)
        partner[order] = np.array(in_order(np.sort(g), f[order]), dtype=np.intp)
        return ModePairing(np.where(partner < 0, -1, np.argsort(g)[partner]), alone, alone, *spaces)
    likeness = _likeness(x, y, alone, *spaces)
    distance = np.abs(np.log(np.maximum(f, 1e-300))[:, None] - np.log(np.maximum(g, 1e-300)))
    gain = np.maximum(likeness + MAC_SHARE * alone - FREQUENCY_SHARE * distance, 1e-6)
    partner = best_pairs(np.where(likeness >= LEAST_LIKENESS, gain, 0.0))
    return ModePairing(partner, alone, likeness, *spaces)


def _likeness(x: NDArray, y: NDArray, alone: Array, tests: tuple[Index, ...], models: tuple[Index, ...]) -> Array:
    """The best of shape by shape, test shape in the model's space, and model shape in the test's, beyond chance."""
    likeness = _beyond_chance(alone, 1, len(x))
    for group in models:
        if 1 < len(group) < len(x):
            share = _beyond_chance(space_mac(x, y[:, group]), len(group), len(x))
            likeness[:, group] = np.maximum(likeness[:, group], share[:, None])
    for group in tests:
        if 1 < len(group) < len(x):
            share = _beyond_chance(space_mac(y, x[:, group]), len(group), len(x))
            likeness[group] = np.maximum(likeness[group], share)
    return likeness


def _beyond_chance(share: Array, size: int, sensors: int) -> Array:
    chance = size / sensors
    return np.maximum(share - chance, 0.0) / (1 - chance)


ALONE_SHARE = 1e-3
"""What the shapes one by one count beside the spaces, where modes are close: they decide within a space."""


@dataclass(frozen=True)
class TrackedModes:
    """What the modes of the step before have become.

    `number` (k,): the mode of this step, from 0, for every one of the step before; -1 where this step has too few.
    `mac` (k,): its modal assurance criterion, of close modes that of their space; 0 without one. `sense` (k,): -1 where
    its shape points against the one before, else 1. `shapes` (p, n): all shapes of this step, those of repeated
    frequencies turned to be most like the step before.
    """

    number: Index
    mac: Array
    sense: Array
    shapes: Array


def track_modes(
    before: ArrayLike, values: ArrayLike, shapes: ArrayLike, mass: Any = None, *, close: float = 0.0
) -> TrackedModes:
    """Which of the modes of this step each mode of the step before, with shapes `before` (p, k), has become.

    `values` (n,) are this step's eigenvalues in ascending order, and `shapes` (p, n) its shapes, which are orthonormal
    with respect to `mass` (p, p), or to the identity without it. Tracked modes go one to one where the sum of their
    MACs is largest, so that two of them may cross. Shapes of repeated eigenvalues are arbitrary in their space: they
    are turned to be nearest to those before (the orthogonal Procrustes problem, Schoenemann 1966). With `close` modes
    whose eigenvalues differ by no more than this, relative, may have mixed, as where frequencies veer: they are
    compared as a space, and within it by their own shapes.
    """
    x, lam, y = np.asarray(before, dtype=float), np.asarray(values, dtype=float), np.array(shapes, dtype=float)
    weighted = x if mass is None else mass @ x
    overlap = weighted.T @ y / np.sqrt(np.einsum("ik,ik->k", x, weighted))[:, None]
    for group in close_groups(lam, REPEATED_EIGENVALUES):
        if len(group) > 1 and len(overlap):
            turn = _turn(overlap[:, group])
            y[:, group], overlap[:, group] = y[:, group] @ turn, overlap[:, group] @ turn
    likeness = overlap**2
    gain = likeness.copy()
    for group in close_groups(lam, close):
        if len(group) > 1:
            gain[:, group] = ALONE_SHARE * likeness[:, group]
            likeness[:, group] = likeness[:, group].sum(axis=1, keepdims=True)
            gain[:, group] += likeness[:, group]
    rows, columns = assignment(-gain)
    number, mac_of_pair = np.full(len(overlap), -1, dtype=np.intp), np.zeros(len(overlap))
    sense = np.ones(len(overlap))
    number[rows], mac_of_pair[rows] = columns, likeness[rows, columns]
    sense[rows] = np.where(overlap[rows, columns] < 0, -1.0, 1.0)
    return TrackedModes(number, mac_of_pair, sense, y)


def _turn(overlap: Array) -> Array:
    """Rotation (m, m) of shapes of one eigenvalue that brings them nearest to the modes before, overlap (k, m).

    Those of the k modes that lie most in the space have a part in it.
    """
    nearest = np.sort(np.argsort(-(overlap**2).sum(axis=1))[: overlap.shape[1]])
    U, _, Vt = np.linalg.svd(overlap[nearest], full_matrices=True)
    turn = Vt.T.copy()
    turn[:, : len(nearest)] = turn[:, : len(nearest)] @ U.T
    return turn
