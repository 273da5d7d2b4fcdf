"""Stops: where linear motion goes beyond their gaps, in which they do nothing, and where poses meet them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from flexura.analysis.limits.limits import LIMIT_ROUND_OFF, States
from flexura.errors import Diagnostic
from flexura.motion import Frames, MovingModel, pose_of
from flexura.structure import FullOrderModel
from flexura.tables import quantity


def has_stops(model: FullOrderModel) -> bool:
    """Whether a mechanism describes any."""
    return any(part.stops for part in model.plan.parts.values())


def stop_limits(states: States) -> Iterator[Diagnostic]:
    """Stops that linear motion closes without meeting them, or opens that it is held by at the pose that it is about:
    one warning for each, with the worst state."""
    model = states.model
    if not has_stops(model) or not states.columns.size:
        return
    posed = pose_of(model)
    moving = MovingModel.of(model.design) if posed is None else posed.model
    frames = moving.rest if posed is None else posed.pose.state.frames
    dof = moving.dof
    for stops in moving.stops:
        depth, rows = stops.depths(frames)
        places = dof[stops.node].reshape(len(depth), -1)
        numbers = zip(moving.names_of_stops, depth.tolist(), rows, places, strict=True)
        for name, before, row, place in numbers:
            on_free = np.zeros(model.order)
            np.add.at(on_free, place[place >= 0], row[place >= 0])
            is_closed = posed is not None and before > 0
            away = states.of(on_free) * (-1 if is_closed else 1)
            k = int(away.argmax())
            if away[k] > abs(before) * (1 + LIMIT_ROUND_OFF):
                yield _passed(name, is_closed, float(away[k]), abs(before), states.when(k))


def _passed(name: str, is_closed: bool, travel: float, room: float, when: str) -> Diagnostic:
    """The warning of a stop that travels, m, farther than there is room, m."""
    moved, limit = quantity(travel, "m", 4), quantity(room, "m", 4)
    if is_closed:
        what = f"is left by {moved}{when}, more than the {limit} by which the pose presses on it, and holds on"
    else:
        what = f"is approached by {moved}{when}, more than its gap of {limit}, and is not met"
    text = f"the stop {name} {what}: small motions are linear, large motion has it"
    return Diagnostic("contact", name, travel, room, "m", text)


class Met(NamedTuple):
    """A stop that poses meet, the numbers of these, and what is said of it."""

    poses: list[int]
    text: str


def stops_met(model: FullOrderModel, poses: Sequence[Frames]) -> Iterator[Met]:
    """The stops that poses meet."""
    if not has_stops(model) or not poses:
        return
    moving = MovingModel.of(model.design)
    for stops in moving.stops:
        depth = np.stack([stops.depths(frames)[0] for frames in poses], axis=1)
        for name, own, k in zip(moving.names_of_stops, depth, stops.stiffness.tolist(), strict=True):
            met = np.flatnonzero(own > 0)
            if len(met):
                deepest = float(own.max())
                text = f"the stop {name} is met, {quantity(deepest, 'm', 3)} deep at most, with"
                yield Met(met.tolist(), f"{text} {quantity(k * deepest, 'N', 3)}")
