"""Many designs at once without a proof: frequencies by constraint modes alone, motions in modes, static flexibility.

Constraint modes alone are the quickest there is. Nothing is proven of the shapes of modes. For the flexibility, chains
of elements are condensed to their ends and to the nodes that are asked of, which is exact for forces there; what is
left is factorised as it is, so that the pivots of this factorisation tell how many digits are lost.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import lapack

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError, SolverError
from flexura.full_order import plan_of
from flexura.linalg import lowest_pairs, lowest_values, scaled, unit_scale
from flexura.mechanism import Mechanism
from flexura.reduction.arrow_bounds import arrow_values
from flexura.reduction.assembly import (
    ImpossibleDesignError,
    LowOrderAssembler,
    independent_stacks,
    low_order,
    named,
    refuse_turned,
    some_of,
    stacks,
)
from flexura.reduction.batch import kept_chains
from flexura.reduction.certificates import HERTZ
from flexura.reduction.chain_assembler import ChainAssembler, chain_assembler
from flexura.reduction.chained_model import WELL
from flexura.structure import Design, Plan

MODES_SEARCHED = 1e-6
"""Relative error of an eigenvalue at which the search for modes ends."""

Rows = Callable[[Design, Array], Array]

LARGEST_STATIC = 300
"""Coordinates beyond which a design by itself, sparse, is quicker than dense matrices of a stack."""


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
    eigenvalues = np.empty((len(many), count))
    for designs in stacks(len(many), chains.order if chains.is_paper(count) else None):
        try:
            design = Design.at(plan, many[designs], some_of(parameters, designs))
            eigenvalues[designs] = (
                _by_branches(chains, design, count) if chains.is_paper(count) else _of(assembler, design, count)
            )
        except ImpossibleDesignError as error:
            raise named(error, designs.start, parameters) from None
    hz = np.sqrt(np.maximum(eigenvalues, 0.0)) / (2 * np.pi)
    return hz if values.ndim > 1 else hz[0]


def _of(assembler: LowOrderAssembler, design: Design, count: int) -> Array:
    """Lowest eigenvalues (designs, count) of a stack."""
    return lowest_values(*assembler.stack(design), count, assembler.start(count))


def _by_branches(chains: ChainAssembler, design: Design, count: int) -> Array:
    """The same from the core, and in one matrix for designs whose branches are not much stiffer by themselves."""
    arrow = chains.unproven(design)
    values, is_settled = arrow_values(arrow, count)
    if not is_settled.all():
        left = np.flatnonzero(~is_settled)
        dense = arrow.take(left).dense
        values[left] = lowest_values(dense.K, dense.M, count, chains.start(count))
    return values


class Moved(NamedTuple):
    """The lowest modes of designs, of unit modal mass: frequencies `hertz` (designs, count), displacements `nodes`
    (designs, k, 6, count) of some nodes, and `largest` (designs, 2), the largest translation and rotation of any root
    of the core."""

    hertz: Array
    nodes: Array
    largest: Array


def independent_motions(plan: Plan, parameters: Mapping[str, ArrayLike], nodes: Index, n: int) -> Moved | None:
    """How global `nodes` (k,) move in the `n` lowest modes of designs, to the last bit the same whatever other designs
    stand beside one.

    Chains keep as many modes as frequencies of the default design need that are proven within the usual tolerance.
    None where a node lies inside a branch, where there are fewer modes or free motions, and where designs by themselves
    are quicker. Raises OptionError for designs that cannot be, and for loads and poses that are described,
    and SolverError where something can move freely.
    """
    plan.refuse_loads("modes of many designs")
    chains = kept_chains(plan, n)
    if chains is None or not chains.in_core(nodes):
        return None
    moved = list[Moved]()
    for used, values, given in independent_stacks(plan, parameters):
        design, count = Design.at(plan, values, given), used.stop - used.start
        order = chains(design).dense
        pairs = lowest_pairs(order.K, order.M, n, chains.start(n), MODES_SEARCHED)
        if not np.isfinite(pairs.vectors).all():
            raise SolverError("the modes of a design cannot be found: something can move freely")
        X, rows = pairs.vectors[:, :, :n], chains.node_rows(design, nodes)
        hertz = np.sqrt(np.maximum(pairs.values[:, :n], 0)) / HERTZ
        sizes = [abs(X[:, at]).max(axis=(1, 2), initial=0.0) for at in chains.core_coordinates]
        moved.append(Moved(hertz[:count], (rows @ X[:, None])[:count], np.stack(sizes, axis=-1)[:count]))
    return Moved(*(np.concatenate(given) for given in zip(*moved, strict=True)))


def independent_flexibility(
    plan: Plan, parameters: Mapping[str, ArrayLike], nodes: Index, motions: Rows
) -> tuple[Array, NDArray[np.bool_]] | None:
    """Flexibility C (designs, k, k) of designs along k motions, each per unit force along another, to the last bit the
    same whatever other designs stand beside one; and for which designs (designs,) no digit that matters is lost.

    `motions` gives the rows (..., k, n) of a stack of designs from the displacements B (..., nodes, 6, n) of the global
    `nodes` (nodes,). None where so much is left behind the chains that designs by themselves are quicker. Raises
    OptionError for designs that cannot be, and for loads and poses that are described.
    """
    plan.refuse_loads("the flexibility of many designs")
    roots = plan.topology.root[nodes]
    assembler = plan.prepared.once(("static", tuple(np.unique(roots))), lambda: _keeping(plan, roots))
    if len(assembler.physical) > LARGEST_STATIC:
        return None
    flexibilities, settled = list[Array](), list[NDArray[np.bool_]]()
    for used, values, given in independent_stacks(plan, parameters):
        design = Design.at(plan, values, given)
        rows = motions(design, assembler.node_rows(design, nodes))
        C, is_settled = _flexibility(assembler.stiffness(design), rows, used.stop - used.start)
        flexibilities.append(C)
        settled.append(is_settled)
    return np.concatenate(flexibilities), np.concatenate(settled)


def _keeping(plan: Plan, roots: Index) -> LowOrderAssembler:
    """The assembly that keeps some nodes of a plan, and all that its chains leave."""
    assembler, more = low_order(plan), {}
    for name, reducer in assembler.reducers.items():
        number = assembler.numbers(name, np.arange(reducer.part.n_nodes))
        requested = np.isin(plan.topology.root[number], roots).any(axis=0)
        more[name] = np.union1d(reducer.remaining, np.flatnonzero(requested)).tolist()
    return LowOrderAssembler(plan, more)


def _flexibility(K: Array, rows: Array, count: int) -> tuple[Array, NDArray[np.bool_]]:
    """C (count, k, k) of the first designs of a stack, NaN where K is not positive definite, and where all of its
    pivots are large enough."""
    d = unit_scale(K)
    right = np.broadcast_to(rows, (len(K), *rows.shape[-2:])) * d[:, None, :]
    C, settled = np.full((count, *rows.shape[-2:-1] * 2), np.nan), np.zeros(count, dtype=bool)
    for k, (stiffness, b) in enumerate(zip(scaled(K, d)[:count], right[:count], strict=True)):
        factor, failed = lapack.dpotrf(stiffness.T, clean=False)
        if not failed and np.isfinite(stiffness).all():
            X = lapack.dpotrs(factor, b.T)[0]
            C[k], settled[k] = b @ X, factor.diagonal().min() ** 2 > WELL
    return (C + C.mT) / 2, settled
