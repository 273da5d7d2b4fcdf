"""What a range of commands reaches, against the limits of linear results."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexura.analysis.limits.limits import States, motion_limits, stress_limits
from flexura.analysis.limits.stiffening import bent_most, stiffening_limits
from flexura.arrays import Array
from flexura.errors import Diagnostic
from flexura.structure import FullOrderModel
from flexura.systems import InputPort

MOST_COMMANDS = 12
"""Commands of which all combinations of least and largest are looked at."""


def workspace_limits(model: FullOrderModel, columns: Array, inputs: Sequence[InputPort]) -> tuple[Diagnostic, ...]:
    """Motion and stress at the corners of the range of inputs, `columns` (n, a) being displacements per command.

    These are largest at corners, as they are convex. Nothing is said without limits, nor for more than twelve inputs.
    """
    box = np.array([own.limits for own in inputs]).reshape(-1, 2)
    if not len(box) or len(box) > MOST_COMMANDS or not np.isfinite(box).all():
        return ()
    corners = np.stack(np.meshgrid(*box, indexing="ij"), axis=0).reshape(len(box), -1)
    states = States(model, columns, corners, lambda _: " at a corner of the range of commands")
    bent = None if model.plan.is_loaded else bent_most(states)  # commands move it from where loads have moved it
    commands = corners[:, bent.state] if bent is not None else corners[:, 0]
    return (*motion_limits(states), *stiffening_limits(model, bent, inputs, commands), *stress_limits(states))
