"""Which mode of one method is which mode of another: by shape where both have shapes, else by frequency in order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.methods.solution import Solution
from flexura.modal.assignment import assigned, in_order
from flexura.structure.full_order import FullOrderModel
from flexura.structure.slots import Index

Array = NDArray[np.float64]

SAME_FREQUENCY = 1e-3
"""Frequencies that all agree so well, relative, need no shapes to be paired."""

REPEATED = 1e-5
"""Frequencies closer than this, relative, are taken as repeated: their shapes are compared as a space."""


def pair(model: FullOrderModel, reference: Solution, solution: Solution) -> list[int]:
    """For every frequency of a solution the number, from 0, of its counterpart in the reference, or -1.

    By `in_order` when all frequencies then agree within `SAME_FREQUENCY`, or when either has no shapes; else by the
    mass-weighted modal assurance criterion (theory eq. L11).
    """
    ordered = in_order(reference.frequency_hz, solution.frequency_hz)
    if agree(reference, solution, ordered) or reference.shapes is None or solution.shapes is None:
        return ordered
    overlap = mac_matrix(model, reference, solution)
    distance = np.abs(reference.frequency_hz[:, None] - solution.frequency_hz)
    partner = np.array(assigned(overlap, distance), dtype=np.intp)
    for at in _clusters(reference.frequency_hz):
        own = np.isin(partner, at)
        partner[own] = np.sort(partner[own])
    return [int(p) for p in partner]


def agree(reference: Solution, solution: Solution, partner: list[int]) -> bool:
    """Whether every frequency has a counterpart that it equals within `SAME_FREQUENCY`."""
    base = reference.frequency_hz[partner]
    return -1 not in partner and bool((np.abs(solution.frequency_hz - base) <= SAME_FREQUENCY * base).all())


def mac_matrix(model: FullOrderModel, reference: Solution, solution: Solution) -> Array:
    """MAC (reference, solution) with every reference mode's space of repeated frequency."""
    nodes, components = np.nonzero(model.plan.topology.dof >= 0)
    assert reference.shapes is not None and solution.shapes is not None
    base, own = reference.shapes[nodes, components], solution.shapes[nodes, components]
    size = np.einsum("ik,ik->k", own, model.M @ own)
    overlap = np.zeros((base.shape[1], own.shape[1]))
    for at in _clusters(reference.frequency_hz):
        space = base[:, at]
        gram = space.T @ (model.M @ space)
        along = space.T @ (model.M @ own)
        overlap[at] = np.einsum("ik,ik->k", along, np.linalg.lstsq(gram, along, rcond=1e-10)[0]) / size
    return np.clip(overlap, 0.0, 1.0)


def _clusters(frequency: Array) -> list[Index]:
    """Groups of consecutive frequencies that are repeated."""
    breaks = np.flatnonzero(np.diff(frequency) > REPEATED * np.abs(frequency[1:])) + 1
    return [part for part in np.split(np.arange(len(frequency)), breaks) if len(part)]
