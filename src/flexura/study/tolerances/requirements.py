"""Which share of parts meets what is required, and whether the worst case does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from flexura.arrays import Array
from flexura.study.questions import Relation
from flexura.study.tolerances.intervals import share_interval
from flexura.study.tolerances.linear import Box, extreme
from flexura.study.tolerances.result import Yield
from flexura.study.tolerances.slopes import SlopesOf

ALL = "all of them"
"""What the yield of all requirements together is called."""


def yields(
    relations: Sequence[Relation], values: Array, slopes: SlopesOf, box: Box, confidence: float
) -> tuple[Yield, ...]:
    """The yields of requirements, and of all together where there are several, from values (R, n, q) of what is asked.

    A design without a value meets nothing.
    """
    names = [own.text for own in slopes.asked.quantities]
    by_name = {name: values[..., k] for k, name in enumerate(names)}
    found, passing = list[Yield](), np.ones(values.shape[:2], dtype=bool)
    for own in relations:
        margins = np.broadcast_to(own.evaluate(by_name), passing.shape)
        passes = np.nan_to_num(margins, nan=-1.0) >= 0
        passing &= passes
        margin = slopes.margin(own)
        nominal = margin(box.nominal)[0]
        is_met = bool(nominal >= 0) if np.isfinite(nominal) else None
        worst = _is_met_at_worst(margin, margins.ravel(), box)
        found.append(
            Yield(own.text, share_interval(passes, confidence), int(np.sum(~passes)), is_met, worst, *_limit(own))
        )
    if len(found) > 1:
        nominal, worst = _every(own.is_met_nominally for own in found), _every(own.is_met_at_worst for own in found)
        found.append(Yield(ALL, share_interval(passing, confidence), int(np.sum(~passing)), nominal, worst))
    return tuple(found)


def _is_met_at_worst(margin: Callable[[Array], tuple[float, Array]], margins: Array, box: Box) -> bool | None:
    """Whether a margin is positive at the worst corner; None where that is not found, or a sample has no margin."""
    worst = extreme(margin, box.starts(margins, -1), box.low, box.high, -1)
    if worst.value < 0:
        return False
    return True if worst.is_vertex and np.isfinite(margins[box.inside]).all() else None


def _every(known: Iterable[bool | None]) -> bool | None:
    known = list(known)
    if any(own is False for own in known):
        return False
    return None if any(own is None for own in known) else True


def _limit(own: Relation) -> tuple[str, float | None]:
    """The quantity that a relation holds against a number, and that; none where it is no plain limit."""
    for side, other in ((own.left, own.right), (own.right, own.left)):
        names = [asked.text for asked in side.quantities]
        if other.is_constant and len(names) == 1 and all(side.evaluate({names[0]: x}) == x for x in (1.0, 3.0)):
            return names[0], float(other.values({})[0])
    return "", None
