"""Which mode of one model or test is which mode of another: by shape, with close modes compared as a space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.modal.assignment import best_pairs
from flexura.modal.close_modes import close_groups
from flexura.modal.criteria import mac, space_mac
from flexura.modal.frequency_pairing import in_order
from flexura.results import Tabular

SAME_MODE = 0.5
"""Least modal assurance criterion of a pair of two models of one mechanism, whose shapes are known throughout."""

REPEATED = 1e-5
"""Frequencies of a model closer than this, relative, are taken as repeated: their shapes are compared as a space."""

CLOSE = 0.02
"""Modes whose frequencies differ by less than this, relative, may have mixed: they are compared as a space."""

HALF_WAY = 0.5
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
    found = mac(x, shapes, weight=weight)
    for group in groups:
        if len(group) > 1:
            found[group] = space_mac(shapes, x[:, group], weight)
    return found


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
    own, spaces = mac(x, y), (close_groups(f, close), close_groups(g, close))
    if len(x) == 1:
        order = np.argsort(f)
        partner = np.full(len(f), -1, dtype=np.intp)
        partner[order] = np.array(in_order(np.sort(g), f[order]), dtype=np.intp)
        return ModePairing(np.where(partner < 0, -1, np.argsort(g)[partner]), own, own, *spaces)
    likeness = _likeness(x, y, own, *spaces)
    distance = np.abs(np.log(np.maximum(f, 1e-300))[:, None] - np.log(np.maximum(g, 1e-300)))
    gain = np.maximum(likeness + MAC_SHARE * own - FREQUENCY_SHARE * distance, 1e-6)
    partner = best_pairs(np.where(likeness >= HALF_WAY, gain, 0.0))
    return ModePairing(partner, own, likeness, *spaces)


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
