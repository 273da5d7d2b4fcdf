"""Certificates: for every frequency an interval that is proven to contain one of the full-order model."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import OptionError, SolverError
from flexura.linalg import (
    Eigenpairs,
    Enclosures,
    Pencil,
    bracket,
    enclose,
    lowest_modes,
    residual_intervals,
)
from flexura.reduction.chained_model import ChainedModel, chained
from flexura.results import Tabular
from flexura.structure import FullOrderModel
from flexura.tables import Item, Table, counted, in_hz

HERTZ = 2 * np.pi

RESOLVED = 1e-6
"""Relative differences below this are lost in the round-off of the full-order solution."""

CLUSTERED = 1e-4
"""Relative distance of two eigenvalues below which no shift is set between them: so close to both it loses digits."""

SHIFT_RATIOS = (1.5, 1e2, 1e4, 1e6, 1e8)
"""Ratios of the shift to the last eigenvalue that is certified, tried in turn: a distant one widens the intervals."""

FAR_APART = 1e3
"""Eigenvalues that so much higher ones are certified with get a shift of their own, at a gap of `SHIFT_GAP` or more."""

SHIFT_GAP = 1.2

SPARE_PAIRS = 4
"""Eigenpairs beyond those asked for, to see the gap that follows."""

MOST_COPIES = 150
"""Modes of nearly one frequency that are certified as a whole."""


@dataclass(frozen=True, repr=False)
class Certificate(Tabular):
    """What is proven about the frequencies of a low-order model against its full-order model.

    `lower_hz` and `upper_hz` (k,) enclose a frequency of the full-order model for each of `frequency_hz` (k,): where
    `is_indexed`, the frequency of the same number, counted from the lowest; elsewhere some frequency. `count`
    frequencies of the full-order model lie below `below_hz`, and `found` of the low-order model; where not
    `is_counted`, round-off hides how many, and `count` is the most there can be.
    """

    _shown = ("count", "below_hz", "is_complete")

    frequency_hz: Array
    lower_hz: Array
    upper_hz: Array
    is_indexed: NDArray[np.bool_]
    below_hz: float
    count: int
    found: int
    is_counted: bool = True

    @property
    def missing(self) -> int:
        """How many frequencies below `below_hz` the low-order model lacks."""
        return self.count - self.found

    @property
    def is_complete(self) -> bool:
        """True when it is proven that no frequency below `below_hz` is missing."""
        return self.is_counted and self.missing == 0

    @property
    def error_bound(self) -> Array:
        """Proven bound (k,) on the relative distance of each frequency from the full-order one in its interval."""
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.maximum(self.upper_hz - self.frequency_hz, self.frequency_hz - self.lower_hz) / self.lower_hz
        return np.where(self.upper_hz == self.lower_hz, 0.0, np.where(self.lower_hz > 0, off, np.inf))

    @property
    def text(self) -> str:
        """Whether anything is missing, in words."""
        if not self.is_counted:
            return f"round-off hides whether a mode below {in_hz(self.below_hz)} is missing"
        if not self.missing:
            return f"no mode is missing below {in_hz(self.below_hz)}"
        return f"{counted(self.missing, 'mode')} MISSING below {in_hz(self.below_hz)}"

    def _data(self) -> dict[str, Any]:
        return {**super()._data(), "missing": self.missing, "is_complete": self.is_complete}

    def _title(self) -> str:
        return self.text

    def presentation(self) -> Iterator[Item]:
        yield Table({"mode": range(1, len(self.frequency_hz) + 1), **self.proven_columns()}, "frequencies")

    def proven_columns(self, prefix: str = "") -> dict[str, list[Any]]:
        """The frequencies and how far each is proven, in words, by headings that begin with `prefix`."""
        rows = (self.frequency_hz.tolist(), self.lower_hz, self.upper_hz, self.is_indexed)
        proofs = [
            proven_text(hz, (float(lower), float(upper) if np.isfinite(upper) else None), bool(indexed), upper == 0)
            for hz, lower, upper, indexed in zip(*rows, strict=True)
        ]
        return {f"{prefix}frequency [Hz]": self.frequency_hz.tolist(), f"{prefix}proven": proofs}

    def _columns(self) -> dict[str, Any]:
        return {
            "frequency [Hz]": self.frequency_hz,
            "lower [Hz]": self.lower_hz,
            "upper [Hz]": self.upper_hz,
            "is indexed": self.is_indexed,
        }


def proven_text(hz: float, interval: tuple[float | None, float | None], is_indexed: bool, is_rigid: bool) -> str:
    """How far from a full-order frequency of the same number a frequency can be; else the interval that has some."""
    lower, upper = interval
    if not is_indexed:
        return f"{lower or 0:.4g} to {'?' if upper is None else f'{upper:.4g}'} Hz"
    if is_rigid:
        return "rigid motion"
    if not lower or upper is None or not hz:
        return "not proven"
    error = 100 * max(upper / hz - 1, 1 - lower / hz, RESOLVED)
    digit = 10.0 ** (math.floor(math.log10(error)) - 1)
    error = math.ceil(error / digit) * digit
    return f"within {error:.2g} %" if error < 99.5 else f"within {error:.0f} %"


def lowest_pairs(full: ChainedModel, n: int) -> Eigenpairs:
    """The `n` lowest modes of the full-order model, all of a cluster that n cuts, and the next, in its coordinates."""
    count = min(n + SPARE_PAIRS, full.pencil.order)
    while True:
        pairs = lowest_modes(full.pencil, count, full.rigid_motions)
        k = len(pairs.values)
        if k == 0:
            raise OptionError("the mechanism has no mass")
        if count >= full.pencil.order or k < count or cluster_end(pairs.values, min(n, k)) < k:
            return pairs
        count = min(more_pairs(count, n), full.pencil.order)


def more_pairs(count: int, n: int) -> int:
    """Twice as many pairs to look for the end of a cluster that n cuts."""
    if count > n + MOST_COPIES:
        raise SolverError(
            f"mode {n} is one of more than {MOST_COPIES} of nearly one frequency: a low-order model would have to keep"
            " them all; the full order, which splits equal branches, has them"
        )
    return 2 * count


def full_order_modes(model: FullOrderModel, n: int) -> Eigenpairs:
    """The `n` lowest modes (full order, n) of the full-order model, or fewer where no more have mass; eigenvalues are
    quotients of energies, zero only where these are not above their own round-off. Raises SolverError.
    """
    full = chained(model)
    pairs = lowest_modes(full.pencil, n, full.rigid_motions)
    return Eigenpairs(pairs.values, full.recover(pairs.vectors))


def certificate(full: ChainedModel, pairs: Eigenpairs, n: int, up_to: float | None = None) -> Certificate:
    """Certificate of the `n` lowest of some Ritz pairs of the full-order model, the next ones known to see the gaps.

    A cluster that n cuts is certified as a whole. The shift is beyond `up_to` Hz if that is given.
    """
    return proof(full, pairs, n, up_to)[0]


def proof(full: ChainedModel, pairs: Eigenpairs, n: int, up_to: float | None = None) -> tuple[Certificate, Enclosures]:
    """The certificate, and what the shift beyond all of its frequencies has proven."""
    pencil, values = full.pencil, pairs.values
    n = cluster_end(values, min(n, len(values)))
    vectors = pairs.vectors[:, :n]
    whole = _enclosures(pencil, values, vectors, up_to)
    lower, upper, indexed = whole.lower.copy(), whole.upper.copy(), np.ones(n, dtype=bool)
    quotients, complete = whole.values, n
    if not whole.is_complete and whole.is_counted:
        quotients = values[:n]
        lower, upper = residual_intervals(pencil, quotients, vectors)
        complete = _complete_prefix(pencil, values, n)
        indexed[complete:] = False
    for p in _prefixes(values[:complete], complete < n):
        part = _enclosures(pencil, values, vectors[:, :p])
        if part.is_complete:
            better = part.lower > lower[:p]
            lower[:p], upper[:p] = np.where(better, part.lower, lower[:p]), np.minimum(part.upper, upper[:p])
            if complete < n:
                lower[:p], upper[:p] = part.lower, part.upper
    quotients = np.where((values[:n] == 0) & (lower <= 0), 0.0, np.clip(quotients, lower, upper))
    if whole.most < n:
        raise SolverError("the inertia count contradicts the Ritz values: the stiffness has lost all its digits")
    lower, upper = (np.where(np.isfinite(b), np.sqrt(np.maximum(b, 0)), b) / HERTZ for b in (lower, upper))
    hz, below = np.sqrt(np.maximum(quotients, 0)) / HERTZ, float(np.sqrt(whole.rho)) / HERTZ
    bounds = np.maximum(lower, 0.0), upper, indexed
    return Certificate(hz, *bounds, below, whole.most, n, whole.is_counted), whole


def _enclosures(pencil: Pencil, values: Array, vectors: Array, up_to: float | None = None) -> Enclosures:
    """Enclosures of all modes given, with the nearest shift beyond them whose count can be told from round-off."""
    enclosures = None
    for reach in SHIFT_RATIOS:
        rho = shift_beyond(values, vectors.shape[1], up_to, reach)
        if enclosures is not None and rho <= enclosures.rho * (1 + CLUSTERED):
            break
        enclosures = enclose(pencil, vectors, rho)
        if enclosures.is_counted and (not enclosures.is_complete or np.isfinite(enclosures.lower[-1])):
            break
    assert enclosures is not None
    return enclosures


def _prefixes(values: Array, with_end: bool) -> list[int]:
    """Numbers of the lowest modes that get a shift of their own, descending, since one far above them costs digits: at
    gaps, so that none has to reach over more decades than that; and all of them."""
    prefixes = [len(values)] if with_end and len(values) else []
    top = float(values[-1]) if len(values) else 0.0
    for k in range(len(values) - 1, 0, -1):
        if values[k - 1] * FAR_APART < top and values[k - 1] * SHIFT_GAP < values[k]:
            prefixes.append(k)
            top = float(values[k - 1])
    return prefixes


def shift_beyond(values: Array, n: int, up_to: float | None = None, reach: float = SHIFT_RATIOS[0]) -> float:
    """A shift between eigenvalue n and the next of ascending `values`, not far beyond the former or `up_to` Hz."""
    base = float(values[n - 1])
    if up_to is not None:
        base = max(base, (HERTZ * up_to) ** 2)
    following = float(values[n]) if n < len(values) else np.inf
    if base <= 0:
        return following / 2 if np.isfinite(following) else 1.0
    return (base + min(max(following, base), reach * base)) / 2


def cluster_end(values: Array, n: int) -> int:
    """The least number from n on after which there is a gap."""
    while n < len(values) and values[n] - values[n - 1] <= CLUSTERED * values[n]:
        n += 1
    return n


def _complete_prefix(pencil: Pencil, values: Array, n: int) -> int:
    """How many of the lowest Ritz values are proven to have every eigenvalue below them, by bisection over the gaps."""
    gaps = [k for k in range(1, n) if values[k] - values[k - 1] > CLUSTERED * values[k]]
    low, high = 0, len(gaps)
    while low < high:
        middle = (low + high) // 2
        p = gaps[middle]
        low, high = (middle + 1, high) if bracket(pencil, shift_beyond(values, p)).most == p else (low, middle)
    return gaps[low - 1] if low else 0
