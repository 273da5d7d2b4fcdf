"""A goal and its limits over the unit cube of the variables: each design worked out once, failures kept in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.errors import FlexuraError
from flexura.study.optimum.box import Box
from flexura.study.optimum.rows import Designs, Point, Row

Judged = tuple[Array, Array]
"""Goals (N,) and violations (N,) of designs, over their scales, NaN where one failed."""


class FailedDesign(Exception):  # noqa: N818  it is passed from a function to whoever searches, and never to a user
    """A design that has no answer, at a position `z`."""

    def __init__(self, z: Array) -> None:
        self.z = z
        super().__init__("a design failed")


@dataclass(frozen=True)
class Sample:
    """A design: position `z` (P,), quantities, versions of the goal (c,) and of the limits (l,) with their gradients
    (c, P) and (l, P) by position; `limit` (l,) is the number of the limit of each version."""

    z: Array
    point: Point
    goals: Array
    goal_slopes: Array
    margins: Array
    margin_slopes: Array
    limit: NDArray[np.intp]

    @cached_property
    def goal(self) -> float:
        """What is to be as large as can be, over its scale."""
        return float(self.goals.min())

    @cached_property
    def violation(self) -> float:
        """How far the worst limit is missed, over its scale; 0 where all are met."""
        return float(max(-self.margins.min(initial=0.0), 0.0))


@dataclass
class Landscape:
    """A goal and limits of designs in a box; counts the `evaluations` of a design with its slopes and the designs
    whose `values` alone were asked for, and collects why designs failed."""

    designs: Designs
    box: Box
    goal: Row
    limits: Sequence[Row] = ()
    evaluations: int = 0
    tried: int = 0
    failures: Counter[str] = field(default_factory=Counter)
    _latest: dict[bytes, Sample] = field(default_factory=dict)

    def at(self, z: Array) -> Sample:
        """The design at a position. Raises FailedDesign."""
        z = np.clip(np.asarray(z, dtype=float), 0.0, 1.0)
        key = z.tobytes()
        if key not in self._latest:
            checkpoint()
            if len(self._latest) > KEPT:
                self._latest.clear()
            self._latest[key] = self._sample(z)
        return self._latest[key]

    def _sample(self, z: Array) -> Sample:
        self.evaluations += 1
        try:
            point = self.designs.point(self.box.values(z))
        except FlexuraError as error:
            self.failures[str(error)] += 1
            raise FailedDesign(z) from None
        if not (np.isfinite(point.value).all() and np.isfinite(point.slope).all()):
            self.failures["a quantity, or its derivative, is not finite"] += 1
            raise FailedDesign(z)
        with np.errstate(all="ignore"):
            found = self._formulas(z, point)
        numbers = (found.goals, found.goal_slopes, found.margins, found.margin_slopes)
        if not all(np.isfinite(own).all() for own in numbers):
            self.failures["the goal or a limit, or its derivative, is not finite"] += 1
            raise FailedDesign(z)
        return found

    def _formulas(self, z: Array, point: Point) -> Sample:
        """What follows from the quantities of a design."""
        rate = self.box.rates(z)
        of_goal = self.goal.versions(point.value)
        of_limits = [(k, own.row, own.places) for k, row in enumerate(self.limits) for own in row.versions(point.value)]
        goals = np.array([float(row.values(point.value[places])) for row, places in of_goal])
        margins = np.array([float(row.values(point.value[places])) for _, row, places in of_limits])
        goal_slopes = np.array([row.gradient(point, places) * rate for row, places in of_goal])
        margin_slopes = np.array([row.gradient(point, places) * rate for _, row, places in of_limits])
        return Sample(
            z,
            point,
            goals,
            goal_slopes,
            margins,
            margin_slopes.reshape(len(of_limits), len(z)),
            np.array([k for k, _, _ in of_limits], dtype=np.intp),
        )

    def many(self, x: Array) -> Judged:
        """Goals (N,) and violations (N,) of designs (N, P), SI, NaN where one failed."""
        checkpoint()
        return self.judged(*self.designs.values(x))

    def judged(self, quantities: Array, reasons: Sequence[str]) -> Judged:
        """Goals (N,) and violations (N,) of quantities (N, q), NaN where there is a reason."""
        self.tried += len(quantities)
        self.failures.update(reason for reason in reasons if reason)
        with np.errstate(invalid="ignore"):
            goals = self.goal.values(quantities)
            margins = [row.values(quantities) for row in self.limits] or [np.ones(len(quantities))]
        return goals, np.maximum(-np.min(margins, axis=0), 0.0)


KEPT = 256
"""Designs with slopes that are kept."""
