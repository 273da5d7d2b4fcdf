"""Lowest modes of many designs at once, as far as nodes move in them; nothing is proven of shapes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array, Index
from flexura.errors import SolverError
from flexura.linalg import lowest_pairs
from flexura.reduction.batch.batch import kept_chains
from flexura.reduction.chains import independent_stacks
from flexura.reduction.proven import HERTZ
from flexura.structure import Design, Plan

SEARCHED = 1e-6
"""Relative error of an eigenvalue at which the search for modes ends."""


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
    found = list[Moved]()
    for used, values, own in independent_stacks(plan, parameters):
        design, count = Design.at(plan, values, own), used.stop - used.start
        order = chains(design).dense
        pairs = lowest_pairs(order.K, order.M, n, chains.start(n), SEARCHED)
        if not np.isfinite(pairs.vectors).all():
            raise SolverError("the modes of a design cannot be found: something can move freely")
        X, rows = pairs.vectors[:, :, :n], chains.node_rows(design, nodes)
        hertz = np.sqrt(np.maximum(pairs.values[:, :n], 0)) / HERTZ
        sizes = [abs(X[:, at]).max(axis=(1, 2), initial=0.0) for at in chains.core_coordinates]
        found.append(Moved(hertz[:count], (rows @ X[:, None])[:count], np.stack(sizes, axis=-1)[:count]))
    return Moved(*(np.concatenate(own) for own in zip(*found, strict=True)))
