"""What the inputs of a mechanism do to it where it moves."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from flexura.errors import OptionError
from flexura.motion.model import MovingModel
from flexura.systems import InputPort


class Lever(NamedTuple):
    """What one unit of an input is: of an actuator between frames by its name, or a dead load (6,) on a node."""

    name: str
    node: int | None
    unit: Any


def commanded(model: MovingModel, port: InputPort) -> Lever:
    """What an input does to a mechanism that moves. Raises OptionError for motions of the base."""
    name = port.channel.name
    if port.base is not None:
        raise OptionError(
            f"{name} accelerates the base, which is at rest here: commands are of forces, moments and piezo stacks; a"
            " steady acceleration is gravity the other way"
        )
    if name in model.actuators:
        return Lever(name, None, port.stroke if port.stiffness is not None else 1.0)
    d, none = np.array(port.channel.direction), np.zeros(3)
    return Lever(name, port.nodes[0], np.append(none, d) if port.channel.quantity == "moment" else np.append(d, none))
