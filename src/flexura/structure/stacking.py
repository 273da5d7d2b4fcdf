"""Stacks of designs in which only what varies has a design axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexura.arrays import Array
from flexura.duals import moves, plain
from flexura.structure.value_table import Index


def picked(values: Array, entries: Index) -> Array:
    """Values (..., *entries.shape) of some entries of (..., s); without the design axis where none of them varies, and
    without slopes where none of them has any."""
    return common(values[..., entries], entries.ndim)


def common(own: Array, axes: int) -> Array:
    """An array of so many axes and that of designs before them; without the latter where all designs are the same, and
    without slopes that are zero."""
    own = own if moves(own) else plain(own)
    return own[0] if own.ndim > axes and (own == own[:1]).all() else own


def joined_along(arrays: Sequence[Array], axis: int) -> Array:
    """Arrays one behind the other along an axis, counted from the last; some may lack the design axis before it."""
    leads = {own.shape[:axis] for own in arrays}
    if len(leads) > 1:
        lead = np.broadcast_shapes(*leads)
        some = [own for own in arrays if own.shape[axis]] or arrays[:1]
        arrays = [own if own.shape[:axis] == lead else np.broadcast_to(own, (*lead, *own.shape[axis:])) for own in some]
    return np.concatenate(arrays, axis=axis)
