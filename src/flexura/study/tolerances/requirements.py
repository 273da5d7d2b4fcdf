"""Which share of parts meets what is required."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexura.study.questions import Questions, Relation
from flexura.study.tolerances.intervals import share_interval
from flexura.study.tolerances.result import Yield

Array = NDArray[np.float64]

ALL = "all of them"
"""What the yield of all requirements together is called."""


def yields(
    relations: Sequence[Relation], values: Array, nominal: Array, asked: Questions, confidence: float
) -> tuple[Yield, ...]:
    """The yields of requirements, and of all together where there are several, from values (R, n, q) of what is asked
    and those of the nominal design (q,). A design without a value meets nothing."""
    names = [own.text for own in asked.quantities]
    found, passing = list[Yield](), np.ones(values.shape[:2], dtype=bool)
    for own in relations:
        passes = _margins(own, names, values) >= 0
        passing &= passes
        met = bool(_margins(own, names, nominal) >= 0) if np.isfinite(nominal).all() else None
        found.append(Yield(own.text, share_interval(passes, confidence), int(np.sum(~passes)), met))
    if len(found) > 1:
        known = [own.is_met_nominally for own in found]
        every = None if None in known else all(known)
        found.append(Yield(ALL, share_interval(passing, confidence), int(np.sum(~passing)), every))
    return tuple(found)


def _margins(own: Relation, names: Sequence[str], values: Array) -> Array:
    """Margins of designs with values (..., q), below zero where one is missing."""
    found = own.evaluate({name: values[..., k] for k, name in enumerate(names)})
    return np.nan_to_num(np.broadcast_to(found, values.shape[:-1]), nan=-1.0)
