"""Models with named inputs and outputs: second-order systems, their modal form, and state space."""

from flexura.systems.bounds import neglected_bound
from flexura.systems.channel import Channel
from flexura.systems.complex_modes import ComplexModes
from flexura.systems.modal import ModalSystem
from flexura.systems.neglected import Neglected
from flexura.systems.reduction import state_space
from flexura.systems.second_order import SecondOrder
from flexura.systems.state_space import StateSpace
from flexura.systems.system import System, system

__all__ = [
    "Channel",
    "ComplexModes",
    "ModalSystem",
    "Neglected",
    "SecondOrder",
    "StateSpace",
    "System",
    "neglected_bound",
    "state_space",
    "system",
]
