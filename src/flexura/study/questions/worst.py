"""The worst of what is asked over a stroke, or over all corners of commands: where it is, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from flexura.deadline import checkpoint
from flexura.errors import SolverError
from flexura.motion import MovingModel
from flexura.records import Latest
from flexura.structure import Plan
from flexura.study.questions.kinds import Held, Pose, Quantity, Worst, pose_text
from flexura.study.questions.states import PosedState
from flexura.study.questions.strokes import StrokeLine

REFINEMENTS = 2
"""Poses that are looked at beside the worst one of a stroke."""

LEAST_SHARE = 1e-4
"""Of a stroke, by which poses differ at least."""

EQUAL = 1e-7
"""Share of the worst number by which others differ that are as bad: of these the pose is the last one of the stroke."""

Numbers = Callable[[PosedState, tuple[Quantity, ...]], list[float]]


class WorstPose(NamedTuple):
    """The worst `value`, SI, of `count` poses, the `pose` that has it and the `quantities` of which it follows there,
    with their `numbers`; `unsettled` is by how much, SI, a pose between might be worse."""

    value: float
    pose: Pose
    quantities: tuple[Quantity, ...]
    numbers: tuple[float, ...]
    count: int = 1
    unsettled: float = 0.0

    @property
    def where(self) -> str:
        """The pose in words, to six digits."""
        return pose_text(tuple(own._replace(value=_rounded(own)) for own in self.pose))


def _rounded(own: Held) -> float:
    """A value to six digits, of an angle in degrees."""
    return math.radians(float(f"{math.degrees(own.value):.6g}")) if own.unit == "rad" else float(f"{own.value:.6g}")


class StrokeStates:
    """One design at the poses of a stroke, by their shares of the way, each reached from the one that is nearest; at
    corners of commands each from rest."""

    def __init__(
        self, plan: Plan, parameters: Mapping[str, float], over: str, model: Callable[[], MovingModel] | None = None
    ) -> None:
        self.plan: Plan = plan
        self.parameters: Mapping[str, float] = parameters
        self.line: StrokeLine = StrokeLine.of(plan, over, parameters)
        self.worst: dict[Quantity, WorstPose] = {}
        """What is known to be the worst of what was asked."""
        self._known: dict[float, PosedState] = {}
        self._model = model

    @staticmethod
    def of(
        plan: Plan, parameters: Mapping[str, float], quantity: Quantity, model: Callable[[], MovingModel] | None = None
    ) -> StrokeStates:
        """Those of a quantity that is asked over a stroke; the last design's are kept with the plan."""
        [of] = quantity.arguments
        assert isinstance(of, Worst)
        latest: Latest[StrokeStates] = plan.prepared.once(("stroke", of.over), Latest)
        key = frozenset((name, float(value)) for name, value in parameters.items())
        return latest.get(key, lambda: StrokeStates(plan, parameters, of.over, model))

    @property
    def shares(self) -> list[float]:
        """Shares of the poses that are described, from that next to the undeformed configuration to both ends."""
        count, nearest = len(self.line.poses), self.line.nearest
        shares = np.linspace(0.0, 1.0, count).tolist() if count > 1 else [1.0]
        return [*shares[nearest:], *shares[:nearest][::-1]]

    def state(self, share: float) -> PosedState:
        """The state at a share of the way, or at a corner of that number."""
        if share not in self._known:
            checkpoint()
            near = min(self._known, key=lambda known: abs(known - share), default=None)
            start = None if near is None or self.line.ends is None else self._known[near]
            self._known[share] = PosedState(self.plan, self.parameters, self.pose(share), start, self._model)
        return self._known[share]

    def pose(self, share: float) -> Pose:
        """The pose there."""
        return (
            self.line.poses[round(share * (len(self.line.poses) - 1))]
            if self.line.ends is None
            else self.line.at(share)
        )


def worst_of(quantity: Quantity, states: StrokeStates, numbers_of: Numbers) -> WorstPose:
    """The worst of all poses that are described, and of such as a parabola through the worst one and those beside it
    points to. Raises SolverError where one is not reached, or what is asked is not known there."""
    if quantity not in states.worst:
        states.worst[quantity] = _searched(quantity, states, numbers_of)
    return states.worst[quantity]


def _searched(quantity: Quantity, states: StrokeStates, numbers_of: Numbers) -> WorstPose:
    [of] = quantity.arguments
    assert isinstance(of, Worst)
    found = dict[float, WorstPose]()

    def look(share: float) -> None:
        state = states.state(share)
        asked = tuple(replace(own, text=own.bare, pose=state.pose if own.pose else ()) for own in of.quantities)
        numbers = numbers_of(state, asked)
        value = float(of.evaluate(dict(zip((own.text for own in of.quantities), numbers, strict=True))))
        if np.isnan(value):
            raise SolverError(f"it is not known {state.text}")
        found[share] = WorstPose(value, state.pose, asked, tuple(numbers))

    def worst() -> float:
        bad = {share: of.badness(own.value) for share, own in found.items()}
        most = max(bad.values())
        return max(share for share, own in bad.items() if own >= most - EQUAL * abs(most))

    for share in states.shares:
        look(share)
    unsettled = 0.0
    for _ in range(REFINEMENTS if states.line.ends is not None else 0):
        share, expected = _extremum({share: of.badness(own.value) for share, own in found.items()})
        if share is None:
            break
        look(share)
        unsettled = abs(expected - of.badness(found[share].value))
    return found[worst()]._replace(count=len(found), unsettled=unsettled)


def _extremum(bad: Mapping[float, float]) -> tuple[float | None, float]:
    """Where a parabola through the worst pose and those beside it is worst, and how bad it says that this is. None at
    an end of the stroke, and where it is known already."""
    shares = sorted(bad)
    k = max(range(len(shares)), key=lambda k: bad[shares[k]])
    if k in (0, len(shares) - 1):
        return None, 0.0
    at = np.array(shares[k - 1 : k + 2])
    curve, slope, level = np.polyfit(at - at[1], [bad[share] for share in at.tolist()], 2)
    step = -slope / (2 * curve) if curve < 0 else 0.0
    if np.abs(at - at[1] - step).min() < LEAST_SHARE:
        return None, 0.0
    return float(at[1] + step), float(level + slope * step + curve * step**2)
