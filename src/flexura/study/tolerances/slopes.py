"""Values and slopes of what is asked at sizes within tolerances, each design once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from flexura.arrays import Array
from flexura.duals import Dual
from flexura.study.questions import Questions, Relation, Slopes

ALIKE = 1e-6
"""Relative difference of the slopes of frequencies that coincide up to which they stay together."""


class SlopesOf:
    """Values (q,) and slopes (q, d) of questions in the parameters `names`, with others at their values."""

    def __init__(self, asked: Questions, parameters: Mapping[str, float], names: Sequence[str]) -> None:
        self.asked = asked
        self._parameters, self._names = parameters, tuple(names)
        self._found: dict[bytes, tuple[Array, Array, list[str]]] = {}

    def at(self, sizes: Array) -> tuple[Array, Array, list[str]]:
        """Values, slopes at sizes (d,), and why slopes are NaN where they are."""
        key = sizes.tobytes()
        if key not in self._found:
            design = {**self._parameters, **dict(zip(self._names, map(float, sizes), strict=True))}
            self._found[key] = _usable(self.asked.slopes(design, self._names))
        return self._found[key]

    def quantity(self, k: int) -> Callable[[Array], tuple[float, Array]]:
        """Value and slopes (d,) of quantity k by sizes (d,)."""

        def evaluate(sizes: Array) -> tuple[float, Array]:
            value, slope, _ = self.at(sizes)
            return float(value[k]), slope[k]

        return evaluate

    def margin(self, of: Relation) -> Callable[[Array], tuple[float, Array]]:
        """Margin of a requirement and its slopes (d,) by sizes (d,)."""

        def evaluate(sizes: Array) -> tuple[float, Array]:
            value, slope, _ = self.at(sizes)
            asked = enumerate(self.asked.quantities)
            found = of.evaluate({own.text: Dual(np.array(value[k]), slope[k].copy()) for k, own in asked})
            return float(found.value), np.asarray(found.slope, dtype=float)

        return evaluate


def _usable(found: Slopes) -> tuple[Array, Array, list[str]]:
    """Values, slopes without those of frequencies that coincide and part, and why there are none."""
    slope = np.array(found.slope, dtype=float)
    reason = [why or "no slope" for why in found.reason]
    for group, matrix in zip(found.repeated, found.directional, strict=True):
        mean = np.trace(matrix) / len(matrix)
        parted = np.abs(matrix - np.eye(len(matrix))[:, :, None] * mean).max(initial=0.0)
        if parted <= ALIKE * np.abs(matrix).max(initial=0.0):
            continue
        for k in group:
            slope[k] = np.nan
            reason[k] = "it coincides with another frequency, from which it parts: no slope"
    there = [bool(np.isfinite(own).all()) for own in slope]
    return found.value, slope, ["" if own else why for own, why in zip(there, reason, strict=True)]
