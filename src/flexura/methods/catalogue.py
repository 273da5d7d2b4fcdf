"""The methods that can be set side by side, each as a function of one task."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexura.errors import OptionError
from flexura.methods.dynamic_stiffness import dynamic_stiffness
from flexura.methods.finite_elements import finite_elements
from flexura.methods.lumped import lumped_parameter
from flexura.methods.pseudo_rigid_body import pseudo_rigid_body
from flexura.methods.reverberation_ray import reverberation_ray
from flexura.methods.solution import Solution
from flexura.methods.spectral import spectral_element
from flexura.methods.transfer_matrix import transfer_matrix
from flexura.reduction import low_order_modes, reduce
from flexura.structure import FullOrderModel, Plan, assemble

TOLERANCE = 1e-3
"""Relative error that the certified reduction is asked for."""

MARGIN = 1.01
"""The certified reduction reaches so many times the highest frequency compared."""


@dataclass(frozen=True)
class Task:
    """What is asked of every method; `model` serves to make shapes, and is not what a method solves."""

    plan: Plan
    parameters: dict[str, float]
    n: int
    model: FullOrderModel
    top_hz: float = 0.0

    def assembled(self) -> FullOrderModel:
        """The full-order model, assembled anew."""
        return assemble(self.plan, self.parameters)


@dataclass(frozen=True)
class Method:
    """A method under its key, with its name in words."""

    key: str
    label: str
    solve: Callable[[Task], Solution]


def _of(method: Callable[[FullOrderModel, int], Solution]) -> Callable[[Task], Solution]:
    """A method of a full-order model, asked of a task."""
    return lambda task: method(task.assembled(), task.n)


def _refined(pieces: int) -> Callable[[Task], Solution]:
    return lambda task: finite_elements(task.assembled(), task.n, pieces)


def _constraint_modes(task: Task) -> Solution:
    """The RPR paper's model."""
    return _of_low_order(task, reduce(task.plan, task.parameters))


def _certified(task: Task) -> Solution:
    """The smallest model that is proven to be within the tolerance of the full-order one."""
    low = reduce(task.plan, task.parameters, tolerance=TOLERANCE, up_to=MARGIN * task.top_hz)
    solution = _of_low_order(task, low)
    worst = float(low.certificate.error_bound.max()) if low.certificate is not None else TOLERANCE
    return replace(solution, note=f"proven within {worst:.1g} of the full-order model; {low.steps[0]}")


def _of_low_order(task: Task, low: Any) -> Solution:
    if low.order == 0:
        raise OptionError("every node that the low-order model keeps is held")
    pairs = low_order_modes(low, task.model, task.n)
    hz = np.sqrt(pairs.values) / (2 * np.pi)
    shapes = task.model.node_displacements(pairs.vectors)
    return Solution("low order", low.order, hz, shapes)


EXACT = Method("dynamic_stiffness", "dynamic stiffness", _of(dynamic_stiffness))
MESHES = tuple(Method("finite_elements", f"finite elements {pieces}x", _refined(pieces)) for pieces in (1, 2, 4))
FINEST = MESHES[-1]
METHODS = (
    EXACT,
    Method("transfer_matrix", "transfer matrix", _of(transfer_matrix)),
    Method("spectral_element", "spectral element", _of(spectral_element)),
    Method("reverberation_ray", "reverberation-ray", _of(reverberation_ray)),
    *MESHES,
    Method("constraint_modes", "constraint modes alone", _constraint_modes),
    Method("certified_reduction", "certified reduction", _certified),
    Method("pseudo_rigid_body", "pseudo-rigid-body", _of(pseudo_rigid_body)),
    Method("lumped_parameter", "lumped parameter", _of(lumped_parameter)),
)
"""All methods, in the order of the rows."""
