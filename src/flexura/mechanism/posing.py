"""Describing a mechanism at a pose."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.mechanism.pose import DISPLACEMENTS, Displacement
from flexura.mechanism.substructure import Mechanism


@verb
def at(mechanism: Mechanism, move: Mapping[str, float]) -> Mechanism:
    """The mechanism described at a pose, about which everything linear then is: displacements from rest by name, as
    `{"carriage.y": 5e-3}`, m, and components of rotation vectors, `platform.rz`, rad. An empty mapping leads back to
    rest.

    Raises OptionError for what is no displacement; nodes that are not there and what is held are named by whatever uses
    the mechanism.
    """
    found: dict[str, dict[str, float]] = {}
    for name, value in move.items():
        node, _, axis = name.rpartition(".")
        if not node or axis not in DISPLACEMENTS:
            raise OptionError(f"{name!r} is no displacement: write NODE.AXIS, an axis of {', '.join(DISPLACEMENTS)}")
        if isinstance(value, str) or not np.ndim(value) == 0 or not np.isfinite(value):
            raise OptionError(f"{name} moves to a finite number, m or rad, not {value!r}")
        found.setdefault(node, {})[axis] = float(value)
    return mechanism.replaced({"at": {node: Displacement(**moved) for node, moved in found.items()}})
