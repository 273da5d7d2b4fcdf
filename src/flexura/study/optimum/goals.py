"""Goals that ask for nothing that could be reached."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexura.arrays import Array
from flexura.errors import Exceeded
from flexura.study.optimum.task import Task

DESIGNS = 4
"""Designs at which a goal is looked at, at least."""

SAME = 1e-12
"""Relative difference of goals that are the same."""


def goal_doubts(task: Task, known: Array) -> Iterator[Exceeded]:
    """Goals that contradict each other, and such as are the same whatever varies; quantities (N, q) of some designs are
    `known`."""
    for k, aim in enumerate(task.aims):
        if any(own.formula.text == aim.formula.text and own.sign != aim.sign for own in task.aims[:k]):
            text = (
                f"{aim.formula.text} is to be both large and small: of these goals every design is as good as another"
            )
            yield Exceeded("goal", aim.formula.text, float("nan"), 0.0, "1", text)
    quantities = known if len(known) >= DESIGNS else task.designs.values(task.starts(DESIGNS, seed=0))[0]
    for aim in task.aims:
        values = np.asarray(task.wording.combined(aim.formula).value(quantities))
        known = values[np.isfinite(values)]
        if len(known) > 1 and np.ptp(known) <= SAME * np.abs(known).max():
            varied = ", ".join(task.names)
            text = f"{aim.text}: the same in all {len(known)} designs looked at, whatever {varied} may be"
            yield Exceeded("goal", aim.text, float(np.ptp(known)), SAME, "1", text)
