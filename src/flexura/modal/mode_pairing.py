"""Which mode of a test is which mode of the model: by shape, with close modes compared as a space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.modal.assignment import in_order
from flexura.modal.criteria import mac, space_mac

Array = NDArray[np.float64]
Index = NDArray[np.intp]

CLOSE = 0.02
"""Modes whose frequencies differ by less than this, relative, may have mixed: they are compared as a space."""

HALF_WAY = 0.5
"""Least likeness of a pair beyond chance: 0 is what random shapes have on average, 1 the same shape."""

FREQUENCY_SHARE = 0.1
"""What a distance of one in the logarithm of frequency costs, beside a likeness of one."""

MAC_SHARE = 0.1
"""What the shapes one by one count beside the spaces, where modes are close."""


@dataclass(frozen=True)
class ModePairing:
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
    from scipy.optimize import linear_sum_assignment

    f, g = np.asarray(test_hz, dtype=float), np.asarray(model_hz, dtype=float)
    x, y = np.asarray(test_shapes), np.asarray(model_shapes)
    if x.ndim != 2 or y.ndim != 2 or x.shape[1:] != f.shape or y.shape[1:] != g.shape or len(x) != len(y):
        raise OptionError(
            f"shapes are (sensors, modes) with a frequency for every mode; found {x.shape} with {f.shape} and"
            f" {y.shape} with {g.shape}"
        )
    if not 0 <= close < 1:
        raise OptionError(f"close is a relative difference of frequencies, 0 <= close < 1, not {close}")
    own, spaces = mac(x, y), (close_groups(f, close), close_groups(g, close))
    if len(x) == 1:
        order = np.argsort(f)
        partner = np.full(len(f), -1, dtype=np.intp)
        partner[order] = np.array(in_order(np.sort(g), f[order]), dtype=np.intp)
        return ModePairing(np.where(partner < 0, -1, np.argsort(g)[partner]), own, own, *spaces)
    likeness = _likeness(x, y, own, *spaces)
    distance = np.abs(np.log(np.maximum(f, 1e-300))[:, None] - np.log(np.maximum(g, 1e-300)))
    gain = np.maximum(likeness + MAC_SHARE * own - FREQUENCY_SHARE * distance, 1e-6)
    gain = np.where(likeness >= HALF_WAY, gain, 0.0)
    partner = np.full(len(f), -1, dtype=np.intp)
    for i, j in zip(*linear_sum_assignment(-gain), strict=True):
        if gain[i, j] > 0:
            partner[i] = j
    return ModePairing(partner, own, likeness, *spaces)


def close_groups(frequency_hz: Array, close: float) -> tuple[Index, ...]:
    """Groups of modes with no gap wider than `close`, relative, in order of frequency."""
    if not len(frequency_hz):
        return ()
    order = np.argsort(frequency_hz, kind="stable")
    f = frequency_hz[order]
    return tuple(np.split(order, np.flatnonzero(np.diff(f) > close * np.abs(f[1:])) + 1))


def _likeness(x: NDArray, y: NDArray, own: Array, tests: tuple[Index, ...], models: tuple[Index, ...]) -> Array:
    """The best of shape by shape, test shape in the model's space, and model shape in the test's, beyond chance."""
    found = _beyond_chance(own, 1, len(x))
    for group in models:
        if 1 < len(group) < len(x):
            share = _beyond_chance(space_mac(x, y[:, group]), len(group), len(x))
            found[:, group] = np.maximum(found[:, group], share[:, None])
    for group in tests:
        if 1 < len(group) < len(x):
            share = _beyond_chance(space_mac(y, x[:, group]), len(group), len(x))
            found[group] = np.maximum(found[group], share)
    return found


def _beyond_chance(share: Array, size: int, sensors: int) -> Array:
    chance = size / sensors
    return np.maximum(share - chance, 0.0) / (1 - chance)
