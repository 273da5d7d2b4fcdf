"""Static flexibility of many designs at once.

Chains of elements are condensed to their ends and to the nodes that are asked of, which is exact for forces there. What
is left is factorised as it is, so that the pivots of this factorisation tell how many digits are lost.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import lapack

from flexura.arrays import Array, Index
from flexura.linalg import scaled, unit_scale
from flexura.reduction.chains import WELL, independent_stacks
from flexura.reduction.single import LowOrderAssembler, low_order
from flexura.structure import Design, Plan

Rows = Callable[[Design, Array], Array]

LARGEST_ORDER = 300
"""Coordinates beyond which a design by itself, sparse, is quicker than dense matrices of a stack."""


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
    if len(assembler.physical) > LARGEST_ORDER:
        return None
    found, settled = list[Array](), list[NDArray[np.bool_]]()
    for used, values, own in independent_stacks(plan, parameters):
        design = Design.at(plan, values, own)
        rows = motions(design, assembler.node_rows(design, nodes))
        C, is_settled = _flexibility(assembler.stiffness(design), rows, used.stop - used.start)
        found.append(C)
        settled.append(is_settled)
    return np.concatenate(found), np.concatenate(settled)


def _keeping(plan: Plan, roots: Index) -> LowOrderAssembler:
    """The assembly that keeps some nodes of a plan, and all that its chains leave."""
    more = {}
    for name, reducer in low_order(plan).reducers.items():
        number = np.array(plan.topology.copies[name].offset, dtype=np.intp)[:, None] + np.arange(reducer.part.n_nodes)
        asked = np.isin(plan.topology.root[number], roots).any(axis=0)
        more[name] = np.union1d(reducer.remaining, np.flatnonzero(asked)).tolist()
    return LowOrderAssembler(plan, more)


def _flexibility(K: Array, rows: Array, count: int) -> tuple[Array, NDArray[np.bool_]]:
    """C (count, k, k) of the first designs of a stack, NaN where K is not positive definite, and where all of its
    pivots are large enough."""
    d = unit_scale(K)
    right = np.broadcast_to(rows, (len(K), *rows.shape[-2:])) * d[:, None, :]
    C, settled = np.full((count, *rows.shape[-2:-1] * 2), np.nan), np.zeros(count, dtype=bool)
    for k, (own, b) in enumerate(zip(scaled(K, d)[:count], right[:count], strict=True)):
        factor, failed = lapack.dpotrf(own.T, clean=False)
        if not failed and np.isfinite(own).all():
            X = lapack.dpotrs(factor, b.T)[0]
            C[k], settled[k] = b @ X, factor.diagonal().min() ** 2 > WELL
    return (C + np.swapaxes(C, -1, -2)) / 2, settled
