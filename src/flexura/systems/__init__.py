"""Models with named inputs and outputs: second-order systems, their modal form, and state space."""

from flexura.systems.channel import Channel
from flexura.systems.modal import ComplexModes, ModalSystem
from flexura.systems.neglected import Neglected
from flexura.systems.reduction import state_space
from flexura.systems.remainder import neglected_bound
from flexura.systems.state_space import StateSpace
from flexura.systems.system import System, system

__all__ = [
    "Channel",
    "ComplexModes",
    "ModalSystem",
    "Neglected",
    "StateSpace",
    "System",
    "neglected_bound",
    "state_space",
    "system",
]
