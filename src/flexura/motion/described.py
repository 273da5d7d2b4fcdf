"""Designs and models at the pose that is described; what poses are is loaded where one is."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from flexura.errors import SolverError
from flexura.structure import Design, OfDesign

if TYPE_CHECKING:
    from flexura.motion.posed import PosedDesign


def at_pose(design: Design) -> Design:
    """One design at the pose that its description names; as it is where none is, or where it is at one already.

    Raises as `reached`, and SolverError where the pose is unstable with actuators free under the forces that hold it.
    """
    if design.pose is not None or not design.plan.is_posed:
        return design
    from flexura.motion.posed import reached

    there = reached(design)
    if not there.is_stable:
        place = there.words.removeprefix("about the pose ").partition(", actuators free")[0]
        raise SolverError(f"at {place} the mechanism is unstable: nothing stays linear about that pose for long")
    return replace(design, pose=there)


def pose_of(model: OfDesign) -> PosedDesign | None:
    """The pose about which a model is linear; None at rest."""
    posed = model.design.posed
    if posed is not None:
        from flexura.motion.posed import PosedDesign

        assert isinstance(posed, PosedDesign)
    return posed
