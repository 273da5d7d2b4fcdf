"""Distributed beam finite elements at any refinement, in coordinates that keep their digits (`reduction.chained`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.linalg import lowest_modes
from flexura.methods.solution import Solution
from flexura.reduction import chained
from flexura.structure import FullOrderModel

NOISE = 1e-9
"""Relative differences of frequencies below this may be round-off: no order is observed from them."""


def finite_elements(model: FullOrderModel, count: int, pieces: int = 1) -> Solution:
    """The `count` lowest natural frequencies with every element of the full-order model cut into `pieces`.

    Consistent mass matrices (theory eqs. 15, 19); a tapered element stands as up to 16 uniform ones, each cut so.
    Frequencies converge from above to those of the exact dynamic stiffness, to order 4 in bending without shear, else
    to order 2. Raises OptionError when nothing can move or has mass, and SolverError.
    """
    if model.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    own = chained(model, pieces)
    pairs = lowest_modes(own.pencil, count, own.rigid_motions)
    finite = np.isfinite(pairs.values)
    if not finite.any():
        raise OptionError("the mechanism has no mass")
    hz = np.sqrt(np.maximum(pairs.values[finite], 0.0)) / (2 * np.pi)
    shapes = model.node_displacements(own.recover(pairs.vectors[:, finite]))
    return Solution(f"finite elements {pieces}x", own.pencil.order, hz, shapes)


@dataclass(frozen=True)
class Convergence:
    """Observed order of convergence (k,), nan where differences are round-off or not monotone, and the frequencies
    (k,), Hz, extrapolated to elements of no length (theory eq. L3)."""

    order: Array
    frequency_hz: Array


def convergence(coarse: ArrayLike, medium: ArrayLike, fine: ArrayLike) -> Convergence:
    """Order of convergence and Richardson's estimate from the frequencies of three meshes, each twice as fine as the
    one before (Richardson 1911; Roache 1994)."""
    f1, f2, f4 = (np.asarray(f, dtype=float) for f in (coarse, medium, fine))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (f1 - f2) / (f2 - f4)
        seen = (np.abs(f2 - f4) > NOISE * f4) & (ratio > 1)
        order = np.where(seen, np.log2(np.where(seen, ratio, 1.0)), np.nan)
    return Convergence(order, np.where(seen, f4 + (f4 - f2) / np.where(seen, ratio - 1, 1.0), f4))
