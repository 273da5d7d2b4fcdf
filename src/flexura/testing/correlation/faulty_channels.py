"""Channels that contradict all others in sign or scale, and pairs of modes without them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.modal import ModePairing, channel_gain, comac, in_space, pair_modes, trusted_channels
from flexura.testing.rig import ChannelMatch

Shapes = NDArray[np.inexact[Any]]
"""Shapes of modes, real or complex."""

RELIABLE = 0.8
"""CoMAC of a channel from which its gain says something."""

GAINS = (0.4, 2.5)
"""A channel with a gain outside is faulty."""

LEAST = 3
"""Sensors that have to be left when faulty ones are left out."""


@dataclass(frozen=True)
class CheckedPairing:
    """Pairs of modes over the channels that are `used` (q,), and CoMAC and gain (q,) of all channels over the pairs."""

    pairing: ModePairing
    comac: Array
    gain: Array
    used: NDArray[np.bool_]

    def notes(self, matched: tuple[ChannelMatch, ...]) -> list[str]:
        """What is wrong with the channels that are left out."""
        found = []
        for match, used, gain in zip(matched, self.used.tolist(), self.gain, strict=True):
            if not used:
                wrong = "is mounted the wrong way round" if gain < 0 else "has another unit or sensitivity"
                reads = f"{match.channel.name} reads {gain:.3g} times what the model has there, in all modes"
                found.append(f"{reads}: maybe it {wrong}; it takes no part in MAC, pairs and expansion")
        return found


def checked_pairing(test_hz: Array, x: Shapes, model_hz: Array, y: Array, close: float) -> CheckedPairing:
    """Pair modes with shapes x (q, n) and y (q, k); where a channel turns out to be faulty, again without it.

    A channel is faulty when it reads the same multiple of the model's shapes in all pairs (CoMAC above 0.8), and that
    is far from one (theory eqs. Q5, Q6): an error of the data, not of the model.
    """
    used: NDArray[np.bool_] = np.ones(len(x), dtype=np.bool_)
    pairing = pair_modes(test_hz, x, model_hz=model_hz, model_shapes=y, close=close)
    alike, gain = _agreement(x, y, pairing, used)
    faulty = (alike > RELIABLE) & ~((gain > GAINS[0]) & (gain < GAINS[1])) & np.isfinite(gain)
    if (pairing.partner >= 0).sum() < 2 or not faulty.any() or len(x) - faulty.sum() < LEAST:
        return CheckedPairing(pairing, alike, gain, used)
    used = np.asarray(~faulty, dtype=np.bool_)
    pairing = pair_modes(test_hz, x[used], model_hz=model_hz, model_shapes=y[used], close=close)
    return CheckedPairing(pairing, *_agreement(x, y, pairing, used), used)


def _agreement(x: Shapes, y: Array, pairing: ModePairing, used: NDArray[np.bool_]) -> tuple[Array, Array]:
    """CoMAC and gain (q,) over the pairs, mixed modes unmixed, every mode of length one at trusted channels."""
    paired = np.flatnonzero(pairing.partner >= 0)
    if not len(paired):
        return np.full(len(x), np.nan), np.full(len(x), np.nan)
    a, b = x[:, paired].astype(complex), y[:, pairing.partner[paired]].astype(complex)
    for c, k in enumerate(paired):
        tests, models = pairing.space_of(int(k))
        if 1 < len(models) < used.sum():
            b[:, [c]] = in_space(a[:, [c]], y[:, models], used)
        elif 1 < len(tests) < used.sum():
            a[:, [c]] = in_space(b[:, [c]], x[:, tests], used)
    own = (used & trusted_channels(a, b))[:, None]
    a, b = (s / np.maximum(np.linalg.norm(np.where(own, s, 0), axis=0), 1e-300) for s in (a, b))
    return comac(a, b), channel_gain(a, b)
