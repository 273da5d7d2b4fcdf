"""What every method answers: natural frequencies, and where it has them mode shapes.

Which mode of one method is which mode of another follows from shapes where both have them, else from frequencies in
order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.modal import REPEATED, close_groups, in_order, mac_with_spaces, pair_by_mac
from flexura.structure import FullOrderModel

SAME_FREQUENCY = 1e-3
"""Frequencies that all agree so well, relative, need no shapes to be paired."""


@dataclass(frozen=True)
class Solution:
    """The lowest natural frequencies of a mechanism by one method.

    `order` is the number of coordinates of the eigenvalue problem, None for methods that have no finite one;
    `frequency_hz` (k,) ascending, repeated ones repeated; `shapes` (n_nodes, 6, k), displacements of all nodes of the
    full-order model, global frame, or None; `note` says what a reader should know about the numbers.
    """

    method: str
    order: int | None
    frequency_hz: Array
    shapes: Array | None = None
    note: str = ""


def pair(model: FullOrderModel, reference: Solution, solution: Solution) -> list[int]:
    """For every frequency of a solution the number, from 0, of its counterpart in the reference, or -1.

    By `in_order` when all frequencies then agree within `SAME_FREQUENCY`, or when either has no shapes; else by the
    mass-weighted modal assurance criterion (theory eq. L11).
    """
    ordered = in_order(reference.frequency_hz, solution.frequency_hz)
    if agree(reference, solution, ordered) or reference.shapes is None or solution.shapes is None:
        return ordered
    overlap = mac_matrix(model, reference, solution)
    partner = pair_by_mac(overlap, reference.frequency_hz, solution.frequency_hz)
    for at in close_groups(reference.frequency_hz, REPEATED):
        alike = np.isin(partner, at)
        partner[alike] = np.sort(partner[alike])
    return [int(p) for p in partner]


def agree(reference: Solution, solution: Solution, partner: list[int]) -> bool:
    """Whether every frequency has a counterpart that it equals within `SAME_FREQUENCY`."""
    base = reference.frequency_hz[partner]
    return -1 not in partner and bool((np.abs(solution.frequency_hz - base) <= SAME_FREQUENCY * base).all())


def mac_matrix(model: FullOrderModel, reference: Solution, solution: Solution) -> Array:
    """MAC (reference, solution), weighted by mass, with every reference mode's space of repeated frequency."""
    nodes, components = np.nonzero(model.plan.topology.dof >= 0)
    assert reference.shapes is not None and solution.shapes is not None
    base, other = reference.shapes[nodes, components], solution.shapes[nodes, components]
    return mac_with_spaces(base, other, close_groups(reference.frequency_hz, REPEATED), model.M)


class Counterpart(NamedTuple):
    """The mode of a solution that stands for a mode of another: its number, from 0, frequency, Hz, and MAC with it."""

    number: int
    frequency_hz: float
    mac: float


def counterparts(model: FullOrderModel, reference: Solution, solution: Solution, n: int) -> list[Counterpart | None]:
    """Counterparts of the first `n` reference modes, by shape alone (theory eq. E8); None where there is none."""
    mac, hz = mac_matrix(model, reference, solution), solution.frequency_hz
    partner = pair_by_mac(mac, reference.frequency_hz, hz).tolist()
    number = [partner.index(k) if k in partner else None for k in range(n)]
    return [None if j is None else Counterpart(j, float(hz[j]), float(mac[k, j])) for k, j in enumerate(number)]
