"""What is read of a model: the motion of a point that moves rigidly with a node, in one direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.duals import zeros
from flexura.errors import OptionError
from flexura.mechanism import DOF_NAMES
from flexura.sensitivity.variation import Rows
from flexura.structure import Design


@dataclass(frozen=True)
class Reading:
    """Displacement, or rotation, along a unit direction (3,) of the point at `arm` (3,), m, from a node.

    A `row` (n,) over the DOFs of the full-order model stands in place of all that, whatever the sizes are.
    """

    node: str
    direction: Array
    turns: bool
    arm: Array
    row: Array | None = None

    @classmethod
    def of_dof(cls, name: str) -> Reading:
        """From the name of a DOF such as `platform.tz`. Raises OptionError for others."""
        node, _, dof = name.rpartition(".")
        if not node or dof not in DOF_NAMES:
            raise OptionError(f"a DOF is written NODE.tx to NODE.rz, not {name!r}")
        k = DOF_NAMES.index(dof)
        return cls(node, np.eye(3)[k % 3], k >= 3, np.zeros(3))


def displacement_rows(places: Sequence[Reading]) -> Rows:
    """Rows (o, n) over the DOFs of a full-order model that give the displacement or rotation at places."""
    own = [k for k, place in enumerate(places) if place.row is None]
    six = np.zeros((len(own), 6))
    for at, k in enumerate(own):
        place = places[k]
        if place.turns:
            six[at, 3:] = place.direction
        else:
            six[at, :3], six[at, 3:] = place.direction, np.cross(place.arm, place.direction)

    def rows(design: Design) -> Any:
        topology = design.plan.topology
        D, dof = design.node_arms(topology.numbers([places[k].node for k in own]))
        found = zeros((len(places), topology.n_dof + 1), D)
        found[np.array(own, dtype=np.intp)[:, None], dof] = np.einsum("oi,oij->oj", six, D)
        for k, place in enumerate(places):
            if place.row is not None:
                found[k, :-1] = place.row
        return found[:, :-1]

    return rows
