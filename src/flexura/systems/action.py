"""What inputs act along, for one design or for many at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array


def signs_of(nodes: Sequence[int]) -> tuple[float, ...]:
    """How the motions of one node, or of the second of two against the first, are added."""
    return (1.0,) if len(nodes) == 1 else (-1.0, 1.0)


class Action(NamedTuple):
    """What an input acts along: global `nodes`, one, or two of which the second moves against the first, the
    `direction` (..., 3) in global axes along or about which, and the force or moment (...) of a unit of it, `gain`."""

    nodes: list[int]
    direction: Array
    turns: bool
    gain: Any

    def row(self, B: Array) -> Array:
        """The motion (..., n) that it works on, from the displacements B (..., k, 6, n) of its nodes."""
        at = slice(3, 6) if self.turns else slice(0, 3)
        along = (self.direction[..., None, None, :] @ B[..., at, :])[..., 0, :]
        return np.asarray(sum(sign * along[..., k, :] for k, sign in enumerate(signs_of(self.nodes))))
