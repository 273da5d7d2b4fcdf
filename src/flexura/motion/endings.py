"""Why no state follows on the last one of a way, as far as that can be told."""

from __future__ import annotations

import numpy as np

from flexura.errors import SolverError
from flexura.motion.clusters import Superelements
from flexura.motion.elements import Frames, PoseElements
from flexura.motion.equilibrium import Equations, Equilibrium
from flexura.motion.model import MovingModel
from flexura.motion.pose import Pose
from flexura.motion.se3 import LARGEST

NEARLY = 0.9
"""Part of the largest rotation within an element from which this is why a way ends."""

STIFFER = 30.0
"""By how much a drive has stiffened where its displacement turns back."""


def why_it_ends(equations: Equations, last: Equilibrium) -> str:
    """What is found in the last state of a way, in words, with what may help."""
    angle, name = _sharpest(equations.model, last.frames)
    if angle > NEARLY * LARGEST:
        return (
            f"{name} turns by {angle:.3g} rad between the ends of an element, and up to {LARGEST:.3g} rad are known:"
            " refine a member; a spring turns no further"
        )
    for k, drive in enumerate(equations.drives):
        if _stiffness(equations, last, k) > STIFFER * _stiffness(equations, _rest(equations), k) > 0:
            return (
                f"the force at {drive.name} grows without limit there, as where members are stretched straight or at a"
                " limit point of the displacement: prescribe another displacement, or a load"
            )
    return (
        "at a limit point of the displacement, as in a snap-through, prescribe another displacement; refine members"
        " that bend sharply"
    )


def _rest(equations: Equations) -> Equilibrium:
    return equations.solve(equations.model.rest, targets=np.zeros(len(equations.drives)))


def _stiffness(equations: Equations, state: Equilibrium, drive: int) -> float:
    """Size of the derivative of the force of a drive by its displacement, others held; zero where there is none."""
    try:
        return abs(float(Pose(equations, state).drive_stiffness()[drive]))
    except (SolverError, np.linalg.LinAlgError):
        return 0.0


def _sharpest(model: MovingModel, frames: Frames) -> tuple[float, str]:
    """The largest rotation, rad, between the ends of an element or the nodes of a superelement, and of which."""
    worst = (0.0, "")
    for group, names in zip(model.elements, model.names, strict=True):
        if isinstance(group, PoseElements | Superelements):
            turns = group.turns(frames)
            k = int(turns.argmax())
            worst = max(worst, (float(turns[k]), names[k]))
    return worst
