"""Parameters that can be changed in a finished linear model: damping ratios of its modes, and masses added to it.

Each acts through ports of the model, inside of which w = slope (parameter - start) z: a modal force from the velocity
of its mode, or forces at a node from the accelerations there (theory eq. X17). So parameters of a model whose loops are
closed are those of its plant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.records import Record
from flexura.structure import FullOrderModel, Ports
from flexura.systems.modal import ModalSystem
from flexura.systems.system import load_of

TRANSLATIONS = ("tx", "ty", "tz")


Matrices = tuple[Array, Array, Array]


class Parameter(NamedTuple):
    """A parameter, not negative, by its name and unit, and its value in the matrices of the model."""

    name: str
    unit: str
    start: float


@dataclass(frozen=True, repr=False)
class Tuning(Record):
    """Ports of a model, x' = A x + B u + into w, y = C x + D u + onto w, z = of_states x + of_inputs u + around w, and
    w_k = slope_k (p - start) z_k for the parameter p of number `parameter_k`.

    into (n, r), onto (p, r), of_states (r, n), of_inputs (r, m), around (r, r), slope and parameter (r,). They hold in
    the states of which `A` is.
    """

    _shown = ("parameters",)

    parameters: tuple[Parameter, ...]
    parameter: Index
    slope: Array
    A: Array
    into: Array
    onto: Array
    of_states: Array
    of_inputs: Array
    around: Array

    @property
    def masses(self) -> tuple[str, ...]:
        """Names of the parameters that are masses."""
        return tuple(own.name for own in self.parameters if own.unit == "kg")

    def selected(self, inputs: list[int], outputs: list[int]) -> Tuning:
        """With some of the inputs and outputs of the model, by position."""
        return replace(self, onto=self.onto[outputs], of_inputs=self.of_inputs[:, inputs])

    def joined(self, B: Array, C: Array, D: Array) -> Matrices:
        """B, C and D of a model with the ports as its first inputs and outputs."""
        direct = np.block([[self.around, self.of_inputs], [self.onto, D]])
        return np.hstack([self.into, B]), np.vstack([self.of_states, C]), direct

    def parted(self, A: Array, B: Array, C: Array, D: Array) -> tuple[Tuning, Matrices]:
        """The tuning, and the matrices, of a model whose first inputs and outputs are the ports."""
        k = len(self.slope)
        ports = {"into": B[:, :k], "onto": D[k:, :k], "of_states": C[:k], "of_inputs": D[:k, k:], "around": D[:k, :k]}
        return replace(self, A=A, **ports), (B[:, k:], C[k:], D[k:, k:])


class PortsOfModes(NamedTuple):
    """Parameters of a modal system, the number of that of each port (r,), its slope (r,), the modal forces of the
    ports (k, r) and whether they read velocities (1) or accelerations (2), (r,)."""

    parameters: tuple[Parameter, ...]
    parameter: Index
    slope: Array
    forces: Array
    derivative: Index


def ports_of_modes(modes: ModalSystem, payloads: Sequence[str] = ()) -> PortsOfModes:
    """Damping ratios of the elastic modes, and masses at nodes, which are names. Raises OptionError for others."""
    if isinstance(payloads, str) or len(set(payloads)) < len(payloads):
        raise OptionError("payloads are a list of nodes, each once")
    damped = np.flatnonzero((modes.omega > 0) & (modes.ratios >= 0))
    ratios = [Parameter(f"mode {k + 1} damping ratio", "1", float(modes.ratios[k])) for k in damped]
    masses = [Parameter(f"{node} payload", "kg", 0.0) for node in payloads]
    shapes = [_translations(modes, node) for node in payloads]
    forces = np.hstack([np.eye(modes.order)[:, damped], *shapes])
    slope = np.concatenate([-2 * modes.omega[damped], np.full(3 * len(masses), -1.0)])
    places = np.concatenate([np.arange(len(damped)), len(damped) + np.repeat(np.arange(len(masses)), 3)])
    derivative = np.repeat([1, 2], [len(damped), 3 * len(masses)])
    return PortsOfModes((*ratios, *masses), places.astype(np.intp), slope, forces, derivative)


def _translations(modes: ModalSystem, node: str) -> Array:
    """Modal forces (r, 3) of unit forces at a node."""
    system = modes.system
    placed = Ports(system.model.design).inputs([f"{node}.{dof}" for dof in TRANSLATIONS])
    if any(own.base is not None for own in placed):
        raise OptionError(f"{node}: a payload is carried by a node of the mechanism, not by what holds it")
    loads = np.stack([load_of(own, system.full_order) for own in placed], axis=1)
    own = loads if isinstance(system.model, FullOrderModel) else system.model.recovery.T @ loads
    return np.asarray(modes.shapes.T @ own)
