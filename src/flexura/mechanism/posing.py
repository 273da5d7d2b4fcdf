"""Describing a mechanism at a pose."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.mechanism.layout import Layout, matching
from flexura.mechanism.pose import DISPLACEMENTS, Prescribed, command_of
from flexura.mechanism.substructure import Mechanism


@verb
def at(mechanism: Mechanism, move: Mapping[str, float]) -> Mechanism:
    """The mechanism described at a pose, about which everything linear then is.

    `move` prescribes displacements from rest by name, as `{"carriage.y": 5e-3}`, m, components of rotation vectors,
    `platform.rz`, rad, and commands of actuators, `*.piezo`, in the units of their inputs (wildcards allowed). An empty
    one leads back to rest.

    Raises OptionError for what is neither; nodes that are not there and what is held are named by whatever uses the
    mechanism.
    """
    actuators = Layout(mechanism).actuators()
    found: dict[str, dict[str, float]] = {}
    for name, value in move.items():
        if isinstance(value, str | bool) or np.ndim(value) != 0 or not np.isfinite(value):
            raise OptionError(f"{name}: {value!r} is refused; a pose takes finite numbers in SI")
        driven = matching(name, actuators)
        node, _, axis = name.rpartition(".")
        if driven:
            for own in driven:
                command = command_of(actuators[own])
                if command is None:
                    raise OptionError(
                        f"{own} has no place in a pose: it accelerates the base, which is at rest there; leave it out"
                    )
                found[own] = {command: float(value)}
        elif node and axis in DISPLACEMENTS:
            found.setdefault(node, {})[axis] = float(value)
        else:
            known = f", or one of the actuators {', '.join(actuators)}" if actuators else ""
            raise OptionError(
                f"{name!r} is no displacement: write NODE.AXIS, an axis of {', '.join(DISPLACEMENTS)}{known}"
            )
    return mechanism.replaced({"at": {name: Prescribed(**own) for name, own in found.items()}})
