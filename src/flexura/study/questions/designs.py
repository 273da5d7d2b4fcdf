"""Designs of a block, and those of them that cannot be, with why."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array, Index
from flexura.errors import FlexuraError, ModelError, OptionError
from flexura.structure import Plan

FAILURES = (FlexuraError, ArithmeticError, np.linalg.LinAlgError, ValueError)
"""What a design that cannot be worked out may end in."""


class Block:
    """Some designs of a plan: `parameters` (designs,) by name, `count` of them, and `refused`, why a design cannot be,
    by its number.

    Raises OptionError for unknown parameters and arrays that do not fit.
    """

    def __init__(self, plan: Plan, parameters: Mapping[str, ArrayLike]) -> None:
        self.plan = plan
        own = {name: _numbers(name, value) for name, value in parameters.items()}
        lengths = {len(value) for value in own.values() if value.ndim}
        if len(lengths) > 1:
            raise OptionError(f"arrays of parameters have one length, not {', '.join(map(str, sorted(lengths)))}")
        self.count: int = lengths.pop() if lengths else 1
        self.parameters: dict[str, Array] = {name: np.broadcast_to(value, self.count) for name, value in own.items()}
        plan.parameter_values(dict.fromkeys((name for name in own if name not in plan.mechanism.parameters), 0.0))
        with np.errstate(all="ignore"):
            self.refused: dict[int, str] = self._refused()

    def one(self, number: int) -> dict[str, float]:
        """Parameters of one design."""
        return {name: float(value[number]) for name, value in self.parameters.items()}

    def some(self, numbers: Index) -> dict[str, Array]:
        """Parameters of some designs."""
        return {name: value[numbers] for name, value in self.parameters.items()}

    @cached_property
    def possible(self) -> Index:
        """Numbers of the designs that are not refused."""
        return np.array([d for d in range(self.count) if d not in self.refused], dtype=np.intp)

    def divided(self, work: Callable[[Index], None], designs: Index | None = None) -> dict[int, str]:
        """Have some designs, by default all that are possible, worked on together, or each by itself where that fails;
        why some of them fail even so, by their numbers."""
        designs, failed = self.possible if designs is None else designs, dict[int, str]()
        try:
            work(designs)
        except FAILURES:
            for d in designs:
                try:
                    work(np.array([d]))
                except FAILURES as error:
                    failed[int(d)] = reason_of(error)
        return failed

    def _refused(self) -> dict[int, str]:
        """Designs with values out of bounds or not finite, or with a size that has gone through zero."""
        out = dict[int, str]()
        everyone = np.arange(self.count)
        try:
            values = np.atleast_2d(self.plan.values(self.some(everyone)))
            inside = everyone if len(values) == self.count else everyone[:1]
        except FlexuraError:
            rows, kept = [], []
            for d in everyone:
                try:
                    rows.append(self.plan.values(self.one(int(d))))
                    kept.append(d)
                except FlexuraError as error:
                    out[int(d)] = reason_of(error)
            inside, values = np.array(kept, dtype=np.intp), np.array(rows)
        known = np.isfinite(self.plan.values())
        broken = np.flatnonzero(~np.isfinite(values[:, known]).all(axis=1)) if len(values) else ()
        for k in np.union1d(broken, self.plan.turned(values)).astype(int) if len(values) else ():
            number = int(inside[k])
            try:
                self.plan.verify(self.one(number))
                if k in broken:
                    out[number] = "a number of the description has no finite value"
            except FlexuraError as error:
                out[number] = reason_of(error)
        return out


def reason_of(error: Exception) -> str:
    """Why a design could not be worked out, in one line."""
    if isinstance(error, ModelError):
        what = error.problems[0]
        return f"{what.place}: {what.rule} (found {what.value})"
    return " ".join(str(error).split()) or type(error).__name__


def _numbers(name: str, value: ArrayLike) -> Array:
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise OptionError(f"parameter {name}: {value!r} is neither a number nor an array of them") from None
    if found.ndim > 1:
        raise OptionError(f"parameter {name} is a number or an array (designs,), not of shape {found.shape}")
    return found
