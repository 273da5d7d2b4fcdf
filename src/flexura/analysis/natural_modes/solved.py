"""The lowest modes of a model, solved and proven: of the full order, also where equal branches split it, and of a low
order beside its full order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexura.analysis.natural_modes.evidence import MissedMode
from flexura.analysis.strain import motions
from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.linalg import Eigenpairs, Pencil, lowest, residuals
from flexura.modal import REPEATED, close_groups, mac_with_spaces, pair_by_mac
from flexura.reduction import (
    HERTZ,
    Certificate,
    LowOrderModel,
    certificate,
    chained,
    lowest_pairs,
    model_pairs,
    split,
    state_of,
)
from flexura.structure import FullOrderModel
from flexura.thresholds import PROVEN

LARGEST = 30_000
"""Up to this full order its own modes are worked out beside those of the low order."""

EXTRA = 60
"""At most so many full-order modes beyond the reported ones are computed to name what a reduction misses."""


class Counterpart(NamedTuple):
    """The full-order mode that a mode represents: its frequency, Hz, the relative error of the other, and their MAC."""

    hertz: float
    error: float
    mac: float


@dataclass(frozen=True)
class Solved:
    """The n lowest modes of a model of some `order` of the full-order `model`, with what proves them.

    `shapes` (n_nodes, 6, n) are displacements of all nodes, `counterparts` (n,) the full-order modes that they
    represent, None where there is none, and `missed` those without one. `free` rigid motions strain nothing. Every
    frequency is held against the `tolerance`. Residuals are those of `Evidence`.
    """

    model: FullOrderModel
    order: int
    proof: Certificate
    shapes: Array
    counterparts: tuple[Counterpart | None, ...]
    steps: tuple[str, ...]
    free: int
    tolerance: float
    full_residual: float | None
    low_residual: float | None = None
    missed: tuple[MissedMode, ...] = ()


def solved_full(model: FullOrderModel, n: int) -> Solved:
    """The `n` lowest modes of a full-order model, split by its equal branches where it has such."""
    if (parts := split(model)) is not None:
        # a model is split only where its stiffness is definite: nothing is rigid
        proof, vectors, free, tolerance = parts.certificate(n), parts.lowest(n).vectors, 0, PROVEN
        steps, residual = (parts.summary, *state_of(model.design)), parts.residual(n)
    else:
        full, n = chained(model), min(n, model.order)
        pairs = lowest_pairs(full, n)
        proof, vectors = certificate(full, pairs, n), full.recover(pairs.vectors[:, :n])
        steps, free, tolerance = state_of(model.design), full.free_motions, np.inf
        residual = _residual(full.pencil, pairs)
    shapes = model.node_displacements(vectors)
    itself = tuple(Counterpart(float(hz), 0.0, 1.0) for hz in proof.frequency_hz[: shapes.shape[-1]])
    return Solved(model, model.order, proof, shapes, itself, steps, free, tolerance, residual)


def solved_low(model: FullOrderModel, low: LowOrderModel, n: int, tolerance: float) -> Solved:
    """The `n` lowest modes of a low-order model beside the full-order ones. Raises OptionError without mass."""
    full = chained(model)
    pairs = model_pairs(low, full, n)
    n = min(n, len(pairs.values))
    if n == 0:
        raise OptionError("the mechanism has no mass")
    proof = low.certificate
    if proof is None or len(proof.frequency_hz) < n:
        proof = certificate(full, pairs, n)
    # full-order modes to stand beside the low-order ones, none where the full order is too large
    reference = Eigenpairs(np.empty(0), np.empty((full.pencil.order, 0)))
    if model.order <= LARGEST:
        reference = lowest_pairs(full, min(max(proof.count, len(proof.frequency_hz)), n + EXTRA))
    full_hz = np.sqrt(reference.values) / HERTZ
    count = max(n, len(proof.frequency_hz))
    pairs = Eigenpairs(pairs.values[:count], pairs.vectors[:, :count])
    # of each low-order mode the full-order one that it represents (-1: none), and their MAC (theory eq. 57)
    omega, full_omega = (np.sqrt(np.abs(own.values)) for own in (pairs, reference))
    overlap = mac_with_spaces(reference.vectors, pairs.vectors, close_groups(full_omega, REPEATED), full.pencil.M)
    partner = pair_by_mac(overlap, full_omega, omega)
    counterparts: list[Counterpart | None] = [None] * n
    for k, other in enumerate(partner[:n]):
        if other >= 0:
            hz, full_order_hz = float(proof.frequency_hz[k]), float(full_hz[other])
            error = hz / full_order_hz - 1 if full_order_hz else 0.0
            counterparts[k] = Counterpart(full_order_hz, error, float(overlap[other, k]))
    lost = np.setdiff1d(np.flatnonzero(full_hz <= proof.below_hz), partner) if proof.missing > 0 else []
    lost_motions = motions(model, model.node_displacements(full.recover(reference.vectors[:, lost])))
    return Solved(
        model=model,
        order=low.order,
        proof=proof,
        shapes=model.node_displacements(full.recover(pairs.vectors[:, :n])),
        counterparts=tuple(counterparts),
        steps=low.steps,
        free=full.free_motions,
        tolerance=tolerance,
        full_residual=_residual(full.pencil, reference),
        low_residual=_residual(Pencil.of(low.K, low.M), lowest(low.K, low.M, n)),
        missed=tuple(MissedMode(float(full_hz[i]), m.summary) for i, m in zip(lost, lost_motions, strict=True)),
    )


def _residual(pencil: Pencil, pairs: Eigenpairs) -> float | None:
    return float(residuals(pencil, pairs).max()) if len(pairs.values) else None
