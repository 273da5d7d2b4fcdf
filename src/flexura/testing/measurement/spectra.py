"""Averaged spectra of records, and what is estimated from them: responses, and coherence of several kinds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.arrays import Array, Complex, Index
from flexura.errors import OptionError

LINES_BY_CHANCE = 0.05
"""Share of lines above its 95 % quantile that unrelated signals have."""

RELATED_LINES = 2 * LINES_BY_CHANCE
"""Share of such lines from which signals are related."""


@dataclass(frozen=True)
class Spectra:
    """Sums over `averages` records: `ff` (f, m, m) and `xf` (f, p, m), cross-spectra, and `xx` (f, p), auto-spectra.

    `among` (f, p, p) are the cross-spectra of the outputs, where they are asked for.
    """

    ff: Complex
    xf: Complex
    xx: Array
    averages: int
    among: Complex | None = None

    @classmethod
    def of(cls, F: Complex, X: Complex, among: bool = False) -> Spectra:
        """From transforms of inputs (n, f, m) and outputs (n, f, p) (theory eq. H1)."""
        ff, xf = crossed(F, F), crossed(X, F)
        return cls(ff, xf, np.sum(np.abs(X) ** 2, axis=0), len(F), crossed(X, X) if among else None)

    def at(self, lines: Index) -> Spectra:
        """The same at some lines."""
        among = None if self.among is None else self.among[lines]
        return Spectra(self.ff[lines], self.xf[lines], self.xx[lines], self.averages, among)


def crossed(X: Complex, Y: Complex) -> Complex:
    """Cross-spectra (f, p, q), summed over the records, of transforms (n, f, p) and (n, f, q)."""
    return np.einsum("nfi,nfj->fij", X, Y.conj(), optimize=True)


def transfer(S: Spectra, estimator: str) -> Complex:
    """Frequency responses (f, p, m) by H1, H2 or Hv (theory eqs. H2-H4).

    H2 of several inputs takes the cross-spectra among the outputs. Raises OptionError when there are
    fewer records than inputs, for H2 also fewer outputs, and when inputs go together at a line.
    """
    m = S.ff.shape[1]
    if S.averages < m:
        raise OptionError(f"{m} inputs at once need at least {m} records; there are {S.averages}")
    if estimator == "H2":
        return S.xx[:, :, None] / nonzero(S.xf.conj()) if m == 1 else _from_outputs(S)
    if estimator == "Hv":
        return _total_least_squares(S)
    return S.xf / nonzero(S.ff) if m == 1 else divided(S.xf, S.ff)


def divided(A: Complex, B: Complex) -> Complex:
    """A B^-1 (f, p, m) at every line. Raises OptionError where B (f, m, m) is singular."""
    try:
        X: Any = np.linalg.solve(B.transpose(0, 2, 1), A.transpose(0, 2, 1))
    except np.linalg.LinAlgError:
        raise OptionError("the inputs go together at some lines, so that they cannot be distinguished") from None
    return X.transpose(0, 2, 1)


def _from_outputs(S: Spectra) -> Complex:
    """H2 of several inputs: all outputs, each of power one, tell the inputs from their noise."""
    p, m = S.xf.shape[1:]
    if p < m or S.among is None:
        raise OptionError(f"H2 of {m} inputs at once takes as many outputs; there are {p}: take H1 or Hv")
    size = 1 / np.sqrt(nonzero(S.xx))
    fx = S.xf.conj().transpose(0, 2, 1) * size[:, None, :]
    return S.among * size[:, None, :] @ np.linalg.pinv(fx)


def _total_least_squares(S: Spectra) -> Complex:
    """Smallest principal component of inputs and one output, each scaled by its own power (theory eq. H4)."""
    f, p, m = S.xf.shape
    G = np.empty((f, p, m + 1, m + 1), dtype=complex)
    G[..., :m, :m] = S.ff[:, None]
    G[..., m, :m] = S.xf
    G[..., :m, m] = S.xf.conj()
    G[..., m, m] = S.xx
    d = 1 / np.sqrt(nonzero(np.einsum("fpii->fpi", G).real))
    _, vectors = np.linalg.eigh(d[..., :, None] * G * d[..., None, :])
    a = vectors[..., :, 0].conj() * d
    return -a[..., :m] / nonzero(a[..., m:])


def coherence(S: Spectra) -> Array | None:
    """Coherence (f, p, m) of every output with its input, or with all inputs at once (theory eq. H5).

    None when there are no more records than inputs, where it is 1 of anything.
    """
    m = S.ff.shape[1]
    if S.averages <= m:
        return None
    H = transfer(S, "H1")
    explained = np.einsum("fpm,fpm->fp", H, S.xf.conj()).real
    gamma = np.clip(explained / nonzero(S.xx), 0.0, 1.0)
    return np.repeat(gamma[:, :, None], m, axis=2)


def partial_coherence(S: Spectra) -> Array | None:
    """Coherence (f, p, m) of every output with every input, once all other inputs are taken out of both.

    None of a single input, and when there are no more records than inputs.
    """
    m = S.ff.shape[1]
    gamma = coherence(S)
    if m == 1 or gamma is None:
        return None
    alone = 1 / nonzero(np.einsum("fii->fi", np.linalg.pinv(S.ff, hermitian=True)).real)
    own = np.abs(transfer(S, "H1")) ** 2 * alone[:, None, :]
    rest = (1 - gamma) * S.xx[:, :, None]
    return np.clip(own / nonzero(own + rest), 0.0, 1.0)


def unrelated(gamma: Array, averages: int, inputs: int = 1) -> bool:
    """True when coherence (f,) is distributed as that of signals that have nothing to do with each other.

    Of n independent records of one input it exceeds x with probability (1 - x)^(n - 1) (Carter, Knapp and Nuttall
    1973; theory eq. H6); with m inputs the least of them has it with n - m.
    """
    free = averages - inputs
    if free < 1 or len(gamma) < 20:
        return False
    quantile = 1 - LINES_BY_CHANCE ** (1 / free)
    if inputs > 1:
        from scipy.stats import beta

        quantile = float(beta.ppf(1 - LINES_BY_CHANCE, inputs, free))
    return bool(np.mean(gamma > quantile) < RELATED_LINES)


def nonzero(values: Any) -> Any:
    """Zeros replaced by the smallest number, so that quotients stay finite."""
    return np.where(values == 0, np.finfo(float).tiny, values)
