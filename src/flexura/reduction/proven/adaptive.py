"""The smallest low-order model that is proven to meet a tolerance.

The smallest low-order model proven to a tolerance, from the lowest modes of the full order.

Constraint modes pay where few nodes hold much together. A part of which almost every node is kept, such as a mesh of
links described node by node, has as many of them as degrees of freedom, in a full matrix. Its lowest modes come from
sparse factors (Ericsson and Ruhe 1980), and the same certificate proves them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from flexura.arrays import Array
from flexura.deadline import checkpoint, stage
from flexura.errors import OptionError, SolverError
from flexura.linalg import Eigenpairs, bracket, lowest
from flexura.reduction.chains import ChainedModel, chained
from flexura.reduction.proven.certificate import (
    HERTZ,
    SPARE,
    Certificate,
    certificate,
    cluster_end,
    lowest_pairs,
    model_pairs,
    proof,
)
from flexura.reduction.proven.goal import Coordinates, Goal, proven, smallest
from flexura.reduction.single import FullBasis, LowOrderAssembler, LowOrderModel, condense, state_of, substructures
from flexura.sizes import within
from flexura.structure import FullOrderModel


def wide_parts(assembler: LowOrderAssembler) -> list[str]:
    """What is said of each part of which so many nodes are kept that its constraint modes do not pay."""
    return [reducer.kept_nodes for reducer in assembler.reducers.values() if reducer.is_wide]


def reduce_by_modes(
    full: ChainedModel,
    goal: Goal,
    exact_at: tuple[str, ...],
    wide: list[str],
    coordinates: Literal["modal", "physical"],
) -> LowOrderModel:
    """The lowest modes of the full order that a goal asks for, proven, as a low-order model; `wide` says why these.

    Raises OptionError where no frequency lies up to the goal's, or there are too many, and SolverError when the
    tolerance is beyond round-off.
    """
    model = full.model
    goal.refuse_empty(full)
    n = goal.modes or bracket(full.pencil, goal.limit).most
    within("dense_entries", model.order * n, f"{n} modes of the full order, {model.order}")
    stage("searching the lowest modes")
    pairs = lowest_pairs(full, n)
    stage("proving them")
    found = certificate(full, pairs, min(n, len(pairs.values)), goal.up_to)
    if not goal.best_effort and (not found.is_complete or goal.missed(found).any()):
        why = "these are modes of the full order, round-off remains"
        raise SolverError(
            f"the tolerance is out of reach of order low: {why}; ask for order full, or a larger tolerance"
        )
    n = len(found.frequency_hz)
    reason = f"modes of the full order, not constraint modes: {'; '.join(wide)}"
    steps = (reason, *state_of(model.design), proven(found))
    whole = LowOrderModel(model.design, model.K, model.M, FullBasis(model.plan), steps, exact_at)
    if coordinates == "modal":
        shapes = full.recover(pairs.vectors[:, :n])
        small = whole.in_modes(pairs.values[:n], shapes, f"modal coordinates; {smallest(n)}")
    else:
        small = condense(whole, n, method="serep")
        small = replace(small, steps=(*small.steps, smallest(n)))
    return replace(small, certificate=found)


START = 1.5
"""Fixed-interface modes below so many times the highest frequency asked for are kept from the start."""

GROWTH = 1.3
"""Modes below so many times the frequency of the first one left out are added together."""

SHARE = 0.1
"""A substructure is refined when it holds at least this part of the largest share of the residual."""

GUESS = 8
"""Eigenpairs computed at first where a frequency is the limit."""


class _Refinement:
    """Craig-Bampton models of one design with more and more fixed-interface modes, checked against the full order."""

    def __init__(self, assembler: LowOrderAssembler, full: ChainedModel, exact_at: tuple[str, ...], goal: Goal) -> None:
        self.assembler, self.exact_at, self.goal = assembler, exact_at, goal
        self.chained, self.parts = full, substructures(assembler, full.model.design)
        self.modes = self.parts.modes
        self.counts = dict.fromkeys(self.modes, 0)
        self.reach(goal.up_to or 0.0)

    def reach(self, hz: float) -> bool:
        """Keep the fixed-interface modes that models up to `hz` need from the start; True when there are more."""
        before = dict(self.counts)
        for name, modes in self.modes.items():
            self.counts[name] = max(before[name], modes.count_below(START * hz))
        return self.counts != before

    def model(self) -> LowOrderModel:
        """The low-order model with the modes kept so far."""
        return self.parts.model(self.counts, self.exact_at)

    def below(self, low: LowOrderModel) -> tuple[Eigenpairs, int]:
        """The lowest pairs of a model and how many of them count: all that are asked for, and what is repeated."""
        if low.order == 0:
            return Eigenpairs(np.empty(0), np.empty((self.chained.pencil.order, 0))), 0
        wanted = self.goal.modes or GUESS
        while True:
            pairs = model_pairs(low, self.chained, wanted)
            n = self.goal.count(pairs.values)
            if n < len(pairs.values) or wanted >= low.order:
                return pairs, cluster_end(pairs.values, n) if n else 0
            wanted *= 2

    def is_whole(self) -> bool:
        """True when every fixed-interface mode is kept."""
        return all(self.counts[name] >= len(modes.interior) for name, modes in self.modes.items())

    def shares(self, remainder: Array) -> dict[str, float]:
        """Share of residuals (n, k) in the interior of each prototype, all its copies together (theory eq. C6)."""
        shapes = self.chained.recover(remainder)
        density = np.append(np.einsum("ik,ik->i", shapes, self.chained.model.M @ shapes), 0.0)
        topology = self.assembler.plan.topology
        found = {}
        for name, reducer in self.assembler.reducers.items():
            number = np.array(topology.copies[name].offset, dtype=np.intp)[:, None] + reducer.part.interior
            found[name] = abs(float(density[topology.dof[number].ravel()].sum()))
        return found

    def refine(self, remainder: Array | None) -> list[str]:
        """Keep more modes of the prototypes that hold most of the residual, of all where nothing is known.

        Returns the names of those that have grown; raises SolverError when none can.
        """
        shares = dict.fromkeys(self.modes, 1.0) if remainder is None else self.shares(remainder)
        open_ = {name: share for name, share in shares.items() if self.counts[name] < len(self.modes[name].interior)}
        if not open_:
            why = "every fixed-interface mode is kept, round-off remains"
            raise SolverError(
                f"the tolerance is out of reach of order low: {why}; ask for order full, or a larger tolerance"
            )
        largest = max(open_.values())
        grown = [name for name, share in open_.items() if share >= SHARE * largest]
        for name in grown:
            modes, count = self.modes[name], self.counts[name]
            found = modes.normal_modes(count + 1).values
            following = np.sqrt(found[-1]) / HERTZ if len(found) > count else np.inf
            below = modes.count_below(GROWTH * following) if np.isfinite(following) else len(modes.interior)
            self.counts[name] = max(below, count + 1)
        return grown


def reduce_to_tolerance(
    assembler: LowOrderAssembler,
    model: FullOrderModel,
    exact_at: tuple[str, ...],
    goal: Goal,
    coordinates: Coordinates,
) -> LowOrderModel:
    """The smallest model of which every frequency of a goal is proven to be within its tolerance, relative.

    Raises OptionError for impossible options, or when there is no frequency up to the goal's, and SolverError when the
    tolerance is beyond round-off.
    """
    full = chained(model)
    if coordinates != "substructures" and (wide := wide_parts(assembler)):
        return reduce_by_modes(full, goal, exact_at, wide, coordinates)
    stage("reducing")
    work = _Refinement(assembler, full, exact_at, goal)
    grown: list[str] = []
    while True:
        checkpoint()
        low = work.model()
        pairs, n = work.below(low)
        if not n:
            if goal.modes is not None and work.is_whole():
                raise OptionError("the mechanism has no mass")
            goal.refuse_empty(full)
            grown += work.refine(None)
            continue
        found, enclosures = proof(work.chained, pairs, n, goal.up_to)
        failing = goal.missed(found)
        short = goal.modes is not None and n < goal.modes and not work.is_whole()
        met = found.is_complete and not failing.any() and not short
        if met or (goal.best_effort and (work.is_whole() or not found.is_counted)):
            n = len(found.frequency_hz)
            return _in_coordinates(
                replace(low, certificate=found), pairs, n, _reason(work, grown, found), work, coordinates
            )
        if not found.is_complete and goal.up_to is None and work.reach(float(found.frequency_hz[-1])):
            continue
        known = found.is_complete and not short
        grown += work.refine(enclosures.remainder[:, failing] if known else enclosures.remainder)


def _reason(work: _Refinement, grown: list[str], proof: Certificate) -> str:
    kept = {name: count for name, count in work.counts.items() if count}
    words = [f"{name or 'mechanism'} {count}" for name, count in kept.items()]
    modes = f"fixed-interface modes kept: {', '.join(words)}" if words else "constraint modes suffice"
    refined = f" (refined for the tolerance: {', '.join(sorted({g or 'mechanism' for g in grown}))})" if grown else ""
    return f"{modes}{refined}; {proven(proof)}"


def _in_coordinates(
    low: LowOrderModel,
    pairs: Eigenpairs,
    n: int,
    reason: str,
    work: _Refinement,
    coordinates: Coordinates,
) -> LowOrderModel:
    """The model in the coordinates asked for; no model with fewer than n of them has n frequencies."""
    low = replace(low, steps=(*low.steps, reason))
    if coordinates == "substructures":
        return low
    step = smallest(n)
    if coordinates == "modal":
        own = lowest(low.K, low.M, min(n + SPARE, low.order)).vectors
        own = own if len(pairs.values) <= own.shape[1] else np.eye(low.order)
        shapes = work.chained.coordinates(low.recover(own))
        M = work.chained.pencil.M
        T = own @ np.linalg.lstsq(shapes.T @ (M @ shapes), shapes.T @ (M @ pairs.vectors[:, :n]))[0]
        small = low.in_modes(pairs.values[:n], T, f"modal coordinates; {step}")
    else:
        small = condense(low, n, method="serep")
        small = replace(small, steps=(*small.steps, step))
    return replace(small, certificate=low.certificate)
