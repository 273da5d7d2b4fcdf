"""How far elements bend and superelements turn within themselves, and how far that is accurate."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.motion.bars import Bars
from flexura.motion.clusters import Superelements
from flexura.motion.elements import Frames, PoseElements
from flexura.motion.model import MovingModel

Array = NDArray[np.float64]

LIMITS = {1: 0.005, 2: 0.05}
"""Largest angles, rad, between sections of an element of members of one and of two elements: a single element of a wide
leaf cannot bend as it has to."""

LIMIT = 0.5
"""That of members of more elements. Stiffnesses are within 1 % below it, forces within 0.1 %: see the table of the
theory page."""

LINEAR = 0.1
"""Largest rotation, rad, of a superelement within itself: that of linear analysis."""


class Bend(NamedTuple):
    """The largest angle, rad, within an element of a member, its limit, and how many elements the member has, 0 for a
    superelement."""

    name: str
    angle: float
    limit: float
    elements: int

    @property
    def share(self) -> float:
        """Angle over limit."""
        return self.angle / self.limit


def bends(model: MovingModel, frames: Frames) -> list[Bend]:
    """The largest angles within members and superelements in a state, each over its limit."""
    worst: dict[str, Bend] = {}
    for group, names in zip(model.elements, model.names, strict=True):
        if isinstance(group, Bars):
            continue
        if isinstance(group, Superelements):
            turns = np.linalg.norm(group.deformation(frames).reshape(-1, 6)[: group.own - 1, 3:], axis=1)
            found = [Bend(names[0], float(turns.max(initial=0.0)), LINEAR, 0)]
        elif isinstance(group, PoseElements) and group.strain.curvature.shape[-1] > 6:
            counts = Counter(names)
            angles = _angles(group, frames).tolist()
            found = [
                Bend(name, angle, LIMITS.get(counts[name], LIMIT), counts[name])
                for name, angle in zip(names, angles, strict=True)
            ]
        else:
            found = []
        for own in found:
            if own.share > max(1.0, worst[own.name].share if own.name in worst else 0.0):
                worst[own.name] = own
    return list(worst.values())


def _angles(group: PoseElements, frames: Frames) -> Array:
    """The largest angle (e,), rad, between two sections of elements: that between the ends, and that between the middle
    and an end, where curvature varies linearly and s = L^3 c/12 (theory eq. G9)."""
    d = group.deformation(frames)
    ends = np.linalg.norm(d[:, 3:], axis=1)
    length = np.linalg.norm(group.rest[:, :3], axis=1)
    across = np.linalg.norm(d[:, 1:3], axis=1) / length
    return np.maximum(ends, ends / 2 + 1.5 * across)
