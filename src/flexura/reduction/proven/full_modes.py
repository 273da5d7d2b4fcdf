"""The smallest low-order model proven to a tolerance, from the lowest modes of the full order.

Constraint modes pay where few nodes hold much together. A part of which almost every node is kept, such as a mesh of
links described node by node, has as many of them as degrees of freedom, in a full matrix. Its lowest modes come from
sparse factors (Ericsson and Ruhe 1980), and the same certificate proves them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from flexura.deadline import stage
from flexura.errors import SolverError
from flexura.linalg import bracket
from flexura.reduction.chains.chained import ChainedModel
from flexura.reduction.proven.certificate import certificate, lowest_pairs
from flexura.reduction.proven.goal import Goal, proven, smallest
from flexura.reduction.single.assembler import LowOrderAssembler
from flexura.reduction.single.condensation import condense
from flexura.reduction.single.model import FullBasis, LowOrderModel, state_of
from flexura.sizes import within


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
