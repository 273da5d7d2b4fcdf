"""Slopes of stresses that are alike but for the round-off of their slopes, as symmetry leaves them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.duals import Dual, plain, slope_of

SHARES = (1e-3, 1e-2, 1e-1, 1.0)
"""Shares of what is missing of equilibrium in which slopes of forces are told apart, the finest one first."""


class Missing(NamedTuple):
    """What round-off leaves missing of equilibrium: norms (1 + P,) of all `force`, N, and of all `moment`, N m, in a
    state and of their slopes by P parameters, which exact numbers would not have."""

    force: Array
    moment: Array

    @staticmethod
    def of(missing: Any, dof: NDArray[np.intp], share: float) -> Missing:
        """A share of what is missing (n,), with slopes, on the free displacements that `dof` (frames, 6) numbers;
        others have -1."""
        parts = share * np.concatenate([missing.value[None], slope_of(missing)])
        turns = np.zeros(parts.shape[1] + 1, dtype=bool)
        turns[dof[:, 3:]] = True
        return Missing(*(np.linalg.norm(parts[:, turns[:-1] == own], axis=1) for own in (False, True)))


def settled(read: Callable[[float], Any]) -> Any:
    """What is read of the stresses in a state whose slopes of forces are told apart in a share of what is missing of
    equilibrium, the least one, if any, at which it has a derivative by a parameter.

    Stresses that are alike have one where their slopes are; round-off parts these.
    """
    found = read(0.0)
    for share in SHARES:
        if not isinstance(found, Dual) or not np.isnan(found.slope).any():
            break
        found = Dual(found.value, np.where(np.isnan(found.slope), slope_of(read(share)), found.slope))
    return found


def told_apart(parameters: Mapping[str, Any], force: Any, length: Any, missing: Missing | None) -> Any:
    """Internal forces (i, m, stations, k, 6) of members (m,) with slopes rounded to what is `missing` of equilibrium.

    That is what the state misses over the size of the parameter, and what its slope misses, moments with a member's
    length for an arm; slopes are known to it upwards and downwards, so that steps are twice as large. By parameters
    that are zero slopes stay.
    """
    if missing is None:
        return force
    sizes = sum(np.abs(own.value * own.slope) for own in parameters.values() if isinstance(own, Dual))
    with np.errstate(divide="ignore"):
        lost, turned = (np.reshape(own[0] / sizes + own[1:], (-1, 1, 1, 1, 1, 1)) for own in missing)
    arm = plain(length)[:, None, None, None] * np.array([0.0, 0, 0, 1, 1, 1])
    forces = np.array([1.0, 1, 1, 0, 0, 0])
    step = 2 * np.where(forces > 0, lost, lost * arm + turned)
    known = np.isfinite(step) & (step > 0)
    step = np.where(known, step, 1.0)
    return Dual(force.value, np.where(known, np.round(force.slope / step) * step, force.slope))
