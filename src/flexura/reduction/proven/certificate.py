"""Certificates: for every reduced frequency an interval that is proven to contain one of the full-order model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import OptionError, SolverError
from flexura.linalg import (
    Eigenpairs,
    Enclosures,
    Pencil,
    bracket,
    count_below,
    enclose,
    lowest,
    lowest_modes,
    residual_intervals,
    ritz_pairs,
)
from flexura.reduction.chains import ChainedModel, chained
from flexura.reduction.single import HERTZ, Certificate, LowOrderModel
from flexura.structure import FullOrderModel, full_order_model

CLUSTER = 1e-4
"""Relative distance of two eigenvalues below which no shift is set between them: so close to both it loses digits."""

REACH = (1.5, 1e2, 1e4, 1e6, 1e8)
"""Ratios of the shift to the last eigenvalue that is certified, tried in turn: a distant one widens the intervals."""

DECADES = 1e3
"""Eigenvalues that so much higher ones are certified with get a shift of their own, at a gap of at least `GAP`."""

GAP = 1.2

SPARE = 4
"""Eigenpairs beyond those asked for, to see the gap that follows."""

MOST_COPIES = 150
"""Modes of nearly one frequency that are certified as a whole."""

LOST = 1e-6
"""Relative difference of squared frequencies from those in energies at which K of a model has lost too many digits."""

WHOLE = 400
"""Up to this order a model whose K has lost its digits is solved in energies."""


@verb
def certify(
    low: LowOrderModel, full: FullOrderModel | None = None, *, n: int = 6, up_to: float | None = None
) -> Certificate:
    """Prove intervals for the `n` lowest frequencies of a low-order model, or for all up to `up_to` Hz.

    Upper bounds are Ritz values, lower bounds those of Lehmann and Maehly; where the low-order model misses a mode
    the intervals of Krylov and Weinstein remain (theory eqs. C1-C5). The frequencies are Rayleigh quotients of the
    model's shapes in energies, which K of the model has but for round-off. `full` is assembled when it is not given.
    Raises OptionError for impossible options and SolverError when a factorisation fails.
    """
    if n < 1 or (up_to is not None and not (np.isfinite(up_to) and up_to > 0)):
        raise OptionError("a certificate is for at least one mode, and up to a positive frequency")
    if up_to is not None:
        n = max(count_below(low.K, low.M, (HERTZ * up_to) ** 2), 1)
    own = chained(full_order_model(low.design) if full is None else full)
    return certificate(own, model_pairs(low, own, n), n, up_to)


def model_pairs(low: LowOrderModel, full: ChainedModel, n: int) -> Eigenpairs:
    """The lowest modes of a low-order model as Ritz pairs of the full-order one in its chained coordinates: `n`, all of
    a cluster that n cuts, and the next, which show the gap that follows."""
    pencil = full.pencil
    rigid = full.rigid_motions
    count = min(n + SPARE, low.order)
    while True:
        own = lowest(low.K, low.M, count)
        finite = np.isfinite(own.values)
        pairs = ritz_pairs(pencil, full.coordinates(low.recover(own.vectors[:, finite])), rigid)
        k = len(pairs.values)
        off = np.abs(own.values[finite][:k] - pairs.values) > LOST * pairs.values
        if (off & (pairs.values > 0)).any() and low.order <= WHOLE:
            pairs = ritz_pairs(pencil, full.coordinates(low.recover(np.eye(low.order))), rigid)
        if count >= low.order or cluster_end(pairs.values, min(n, k)) < k:
            return pairs
        count = min(_more(count, n), low.order)


def lowest_pairs(full: ChainedModel, n: int) -> Eigenpairs:
    """The `n` lowest modes of the full-order model, all of a cluster that n cuts, and the next, in its coordinates."""
    count = min(n + SPARE, full.pencil.order)
    while True:
        pairs = lowest_modes(full.pencil, count, full.rigid_motions)
        k = len(pairs.values)
        if k == 0:
            raise OptionError("the mechanism has no mass")
        if count >= full.pencil.order or k < count or cluster_end(pairs.values, min(n, k)) < k:
            return pairs
        count = min(_more(count, n), full.pencil.order)


def _more(count: int, n: int) -> int:
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
    own = chained(model)
    pairs = lowest_modes(own.pencil, n, own.rigid_motions)
    return Eigenpairs(pairs.values, own.recover(pairs.vectors))


def low_order_modes(low: LowOrderModel, model: FullOrderModel, n: int) -> Eigenpairs:
    """The `n` lowest modes (full order, n) of a low-order model of `model`, as `full_order_modes`."""
    own = chained(model)
    pairs = model_pairs(low, own, min(n, low.order))
    return Eigenpairs(pairs.values[:n], own.recover(pairs.vectors[:, :n]))


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
    whole = _enclosed(pencil, values, vectors, up_to)
    lower, upper, indexed = whole.lower.copy(), whole.upper.copy(), np.ones(n, dtype=bool)
    own, complete = whole.values, n
    if not whole.is_complete and whole.is_counted:
        own = values[:n]
        lower, upper = residual_intervals(pencil, own, vectors)
        complete = _complete_prefix(pencil, values, n)
        indexed[complete:] = False
    for p in _levels(values[:complete], complete < n):
        part = _enclosed(pencil, values, vectors[:, :p])
        if part.is_complete:
            better = part.lower > lower[:p]
            lower[:p], upper[:p] = np.where(better, part.lower, lower[:p]), np.minimum(part.upper, upper[:p])
            if complete < n:
                lower[:p], upper[:p] = part.lower, part.upper
    own = np.where((values[:n] == 0) & (lower <= 0), 0.0, np.clip(own, lower, upper))
    return _certificate(own, (lower, upper, indexed), whole), whole


def _enclosed(pencil: Pencil, values: Array, vectors: Array, up_to: float | None = None) -> Enclosures:
    """Enclosures of all modes given, with the nearest shift beyond them whose count can be told from round-off."""
    found = None
    for reach in REACH:
        rho = shift_beyond(values, vectors.shape[1], up_to, reach)
        if found is not None and rho <= found.rho * (1 + CLUSTER):
            break
        found = enclose(pencil, vectors, rho)
        if found.is_counted and (not found.is_complete or np.isfinite(found.lower[-1])):
            break
    assert found is not None
    return found


def _levels(values: Array, with_end: bool) -> list[int]:
    """Numbers of the lowest modes that get a shift of their own, descending, since one far above them costs digits: at
    gaps, so that none has to reach over more decades than that; and all of them."""
    found = [len(values)] if with_end and len(values) else []
    top = float(values[-1]) if len(values) else 0.0
    for k in range(len(values) - 1, 0, -1):
        if values[k - 1] * DECADES < top and values[k - 1] * GAP < values[k]:
            found.append(k)
            top = float(values[k - 1])
    return found


def _certificate(values: Array, bounds: tuple[Array, Array, NDArray[np.bool_]], whole: Enclosures) -> Certificate:
    if whole.most < len(values):
        raise SolverError("the inertia count contradicts the Ritz values: the stiffness has lost all its digits")
    lower, upper = (np.where(np.isfinite(b), np.sqrt(np.maximum(b, 0)), b) / HERTZ for b in bounds[:2])
    hz = np.sqrt(np.maximum(values, 0)) / HERTZ
    below = float(np.sqrt(whole.rho)) / HERTZ
    return Certificate(hz, np.maximum(lower, 0.0), upper, bounds[2], below, whole.most, len(values), whole.is_counted)


def shift_beyond(values: Array, n: int, up_to: float | None = None, reach: float = REACH[0]) -> float:
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
    while n < len(values) and values[n] - values[n - 1] <= CLUSTER * values[n]:
        n += 1
    return n


def _complete_prefix(pencil: Pencil, values: Array, n: int) -> int:
    """How many of the lowest Ritz values are proven to have every eigenvalue below them, by bisection over the gaps."""
    gaps = [k for k in range(1, n) if values[k] - values[k - 1] > CLUSTER * values[k]]
    low, high = 0, len(gaps)
    while low < high:
        middle = (low + high) // 2
        p = gaps[middle]
        low, high = (middle + 1, high) if bracket(pencil, shift_beyond(values, p)).most == p else (low, middle)
    return gaps[low - 1] if low else 0
