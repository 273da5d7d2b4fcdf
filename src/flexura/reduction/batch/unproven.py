"""Natural frequencies by constraint modes alone, many designs at once and without a proof: the quickest there is."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.linalg import lowest_values
from flexura.mechanism import Mechanism
from flexura.reduction.batch.arrow_certificate import arrow_values
from flexura.reduction.batch.chain_assembler import ChainAssembler, chain_assembler
from flexura.reduction.chains import ImpossibleDesignError, named, refuse_turned, some_of, stacks
from flexura.reduction.single import LowOrderAssembler, low_order
from flexura.structure import Design, Plan, plan_of


@verb
def unproven_frequencies(
    model: Mechanism | Plan, parameters: Mapping[str, ArrayLike] | None = None, *, n: int = 6
) -> Array:
    """Lowest natural frequencies, Hz, of the low-order model with constraint modes alone, whose error nobody knows.

    The model of the RPR paper is blind to motions inside its substructures: a frequency may be far too high and a mode
    missing. `natural_frequencies` gives the same numbers with proven intervals at half the speed. Parameters may be
    arrays over designs; the result is (n,) or (designs, n). Raises OptionError and SolverError.
    """
    plan = plan_of(model, parameters)
    parameters = parameters or {}
    values = plan.values(parameters)
    plan.refuse_loads("frequencies of many designs", values)
    refuse_turned(plan, values, parameters)
    assembler, chains = low_order(plan), chain_assembler(plan)
    if n < 1:
        raise OptionError(f"the number of frequencies is at least 1, not {n}")
    count = min(n, len(assembler.physical))
    many = values if values.ndim > 1 else values[None]
    found = np.empty((len(many), count))
    for own in stacks(len(many)):
        try:
            design = Design.at(plan, many[own], some_of(parameters, own))
            found[own] = (
                _by_branches(chains, design, count) if chains.is_paper(count) else _of(assembler, design, count)
            )
        except ImpossibleDesignError as error:
            raise named(error, own.start, parameters) from None
    hz = np.sqrt(np.maximum(found, 0.0)) / (2 * np.pi)
    return hz if values.ndim > 1 else hz[0]


def _of(assembler: LowOrderAssembler, design: Design, count: int) -> Array:
    """Lowest eigenvalues (designs, count) of a stack."""
    return lowest_values(*assembler.stack(design), count, assembler.start(count))


def _by_branches(chains: ChainAssembler, design: Design, count: int) -> Array:
    """The same from the core, and in one matrix for designs whose branches are not much stiffer by themselves."""
    arrow = chains.unproven(design)
    values, is_settled = arrow_values(arrow, count)
    left = np.flatnonzero(~is_settled)
    if len(left):
        own = arrow.take(left).dense
        values[left] = lowest_values(own.K, own.M, count, chains.start(count))
    return values
