"""What is to be said of the pose that a mechanism is described at, whatever is asked about it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexura.analysis.limits import EXACT, command_limits, times
from flexura.analysis.strain import yield_ratios
from flexura.analysis.strokes.clashes import solids_that_meet
from flexura.analysis.strokes.pose import coarse, mesh_errors_of
from flexura.errors import Diagnostic
from flexura.linalg import leading
from flexura.motion import PosedDesign, beyond, pose_of
from flexura.structure import FullOrderModel
from flexura.systems import Ports

LOWEST = 6
"""Modes whose stiffness is looked at for want of elements."""


def pose_limits(model: FullOrderModel) -> tuple[Diagnostic, ...]:
    """Where the pose itself is doubtful: members that bend too far for their elements or have too few of them,
    superelements that turn within themselves, edges that twist stretches, nodes of which one rotation is held, solids
    that meet, members beyond yield. Nothing at rest."""
    posed = pose_of(model)
    if posed is None:
        return ()
    return model.prepared.once("pose limits", lambda: tuple(_limits(model, posed)))


def _limits(model: FullOrderModel, posed: PosedDesign) -> Iterator[Diagnostic]:
    commands = model.plan.pose.commands(model.values)
    yield from command_limits(
        Ports(model.design).inputs(list(commands)), np.array([[own] for own in commands.values()])
    )
    yield from beyond(posed.model, [posed.pose.state.frames])
    for meeting in solids_that_meet(model, [posed.pose.state.frames])[0]:
        text = f"{meeting.first} and {meeting.second} meet at the pose, and go through each other"
        yield Diagnostic("contact", meeting.first, np.nan, np.nan, "m", text)
    modes = posed.pose.modes(min(LOWEST, model.order))
    for name, error in mesh_errors_of(posed.pose, modes.vectors, modes.values).items():
        if (found := coarse(model, name, error, "at the pose")) is not None:
            yield found
    yields = yield_ratios(model, np.zeros((model.order, 1)))
    if yields.names and float(yields.ratio.max()) > 1 + EXACT:
        worst = int(leading(yields.ratio[:, 0]))
        name, ratio = yields.names[worst], float(yields.ratio[worst, 0])
        text = f"{name} is stressed beyond its yield stress at the pose, {times(ratio)} times"
        yield Diagnostic("stress", name, ratio, 1.0, "1", text)
