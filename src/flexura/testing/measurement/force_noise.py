"""Noise of a force channel where the force is down, as of shakers at resonances, which makes H1 low.

A structure in resonance gives way, and the force that moves it falls towards the noise of its channel.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Complex, Index
from flexura.tables import in_hz, percent
from flexura.testing.measurement.spectra import Spectra, coherence, crossed, nonzero, partial_coherence

FEWEST_RECORDS = 8
"""Records from which noise is told from signal."""

MOST_OUTPUTS = 8
"""Outputs, those that go best with the force, by which its noise is estimated."""

DOWN = 0.25
"""Share of its median below which the power of a force is down, by 6 dB."""

NOTICEABLE = 0.05
"""Share of noise in the power of a force from which lines are named."""

BEYOND_SCATTER = 3.0
"""Times its standard deviation from which it is none of chance."""

MOST_NAMED = 4
"""Stretches of lines that are named."""


@dataclass(frozen=True)
class ForceNoise:
    """Power of forces over its median, `level` (f, m), and the `share` (f, m) of it that is noise; at most so much
    where it `is_bound`. `scatter` (f,) is the standard deviation of the share by noise of the outputs."""

    level: Array
    share: Array
    scatter: Array
    is_bound: bool

    @classmethod
    def of(cls, F: Complex, X: Complex, S: Spectra) -> ForceNoise | None:
        """From transforms of inputs (n, f, m) and outputs (n, f, p), and their spectra; None of too few records."""
        gamma = coherence(S) if S.ff.shape[1] == 1 else partial_coherence(S)
        if len(F) < FEWEST_RECORDS or gamma is None:
            return None
        power = np.einsum("fmm->fm", S.ff).real
        level = power / nonzero(np.median(power[1:], axis=0))
        if S.ff.shape[1] == 1 and S.xf.shape[1] > 1:
            best = np.argsort(-gamma[:, :, 0].mean(axis=0))[:MOST_OUTPUTS]
            share, scatter = _by_outputs(S, X[..., best], best)
            return cls(level, share[:, None], scatter, False)
        bound = 1 - gamma.max(axis=1)
        return cls(level, bound, np.zeros(len(bound)), True)

    def notes(self, names: Sequence[str], hz: Array, lines: Index, estimator: str) -> Iterator[str]:
        """A note for every force on the lines (Hz) at which an estimate is low, the worst stretches first."""
        if estimator not in ("H1", "Hv"):
            return
        for k, name in enumerate(names):
            level, share = self.level[lines, k], self.share[lines, k]
            low = (level < DOWN) & (share > NOTICEABLE) & (share > BEYOND_SCATTER * self.scatter[lines])
            runs = sorted(_runs(low), key=lambda run, share=share: -float(share[run].max()))
            named = []
            for run in runs[:MOST_NAMED]:
                first, last = (in_hz(hz[lines[k]], 4) for k in (run[0], run[-1]))
                down = -10 * np.log10(level[run].min())
                at = first if first == last else f"{first} to {last}"
                named.append(f"{at} ({down:.0f} dB down, {percent(float(share[run].max()), 2)})")
            if named:
                more = f" and {len(runs) - MOST_NAMED} more stretches" if len(runs) > MOST_NAMED else ""
                of = "at most so much of it is noise" if self.is_bound else "so much of it is noise"
                less = "" if estimator == "H1" else "half "
                hint = "take H2 there, or compare with it" if estimator == "Hv" else "take H2 there, or Hv"
                yield f"{name} is down, and {of}, at {', '.join(named)}{more}: {estimator} is {less}that low; {hint}"


def _by_outputs(S: Spectra, X: Complex, best: Index) -> tuple[Array, Array]:
    """Share of a force (f,) that no two outputs agree on, and its standard deviation by noise of the outputs.

    Of three channels with noise of their own, the signal of one has the power G_fa G_bf / G_ba (Sleeman, van Wettum
    and Trampert 2006), here by least squares over all pairs of outputs.
    """
    size = 1 / np.sqrt(nonzero(S.xx[:, best]))
    among = crossed(X, X) * size[:, :, None] * size[:, None, :]
    seen = S.xf[:, best, 0] * size
    apart = ~np.eye(len(best), dtype=bool)
    product = seen[:, :, None] * seen[:, None, :].conj()
    weight = np.sum(np.abs(among[:, apart]) ** 2, axis=1)
    signal = np.sum((product * among.conj())[:, apart].real, axis=1) / nonzero(weight)
    share = np.clip(1 - signal / nonzero(S.ff[:, 0, 0].real), 0.0, 1.0)
    agreed = np.clip(np.abs(among[:, apart]).max(axis=1) ** 2, 0.0, 1.0)
    return share, np.sqrt(2 * (1 - agreed) / S.averages)


def _runs(chosen: NDArray[np.bool_]) -> list[Index]:
    """Positions of True in stretches without a gap."""
    at = np.flatnonzero(chosen)
    return [] if not len(at) else np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
