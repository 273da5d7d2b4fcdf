"""Where the children of a prototype are placed in it, those that are placed alike worked out together."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.duals import plain, with_slopes_of
from flexura.expressions import Expression
from flexura.mechanism import IDENTITY, Affine, Child, Move, Reflect, Turn, reflect, turn
from flexura.records import Kept, Latest
from flexura.structure.values import ValueTable, picked


class _AlikeChildren:
    """Entries of the placing steps of some children of a prototype whose steps are alike; `entries` are all of them."""

    def __init__(self, steps: Sequence[_Steps]) -> None:
        self._kinds, self._varies = steps[0].kinds, steps[0].varies
        self._fields: list[list[Index]] = [
            [np.array(field) for field in zip(*step, strict=True)]
            for step in zip(*(own.fields for own in steps), strict=True)
        ]
        """Entries (children, k) of each field of each step."""
        self._count = len(steps)
        self._fixed = Kept()
        self._latest: Latest[Affine] = Latest()
        entries = [field.ravel() for step in self._fields for field in step]
        self.entries: Index = np.concatenate([np.empty(0, dtype=np.intp), *entries])

    def affine(self, values: Array) -> Affine:
        """Placements (..., children) in their parent for values (..., s); remembered while they are the same in all
        designs."""
        numbers = picked(values, self.entries)
        if numbers.ndim > 1 or with_slopes_of(numbers) is not None:
            return self._affine(values)
        return self._latest.get(numbers.tobytes(), lambda: self._affine(values))

    def _affine(self, values: Array) -> Affine:
        result = Affine(np.broadcast_to(IDENTITY.Q, (self._count, 3, 3)), np.zeros((self._count, 3)))
        constant = plain(values).reshape(-1, values.shape[-1])[0]
        for k, (kind, fields, varies) in enumerate(zip(self._kinds, self._fields, self._varies, strict=True)):
            if varies:
                step = _step(kind, [picked(values, f) for f in fields])
            else:
                step = self._fixed.once(k, partial(_step, kind, [constant[f] for f in fields]))
            result = Affine(result.Q, result.t + step.t) if kind is Move else result.then(step)
        return result


class _Steps(NamedTuple):
    """The placing steps of a child: their kinds, whether they vary, and the entries of their fields."""

    kinds: tuple[type, ...]
    varies: tuple[bool, ...]
    fields: list[list[list[int]]]

    @staticmethod
    def of(child: Child, table: ValueTable) -> _Steps:
        """Those of a child, whose values are added to the table."""
        numbers = [[f if isinstance(f, tuple) else (f,) for f in step] for step in child.steps]
        varies = tuple(any(isinstance(x, Expression) for field in step for x in field) for step in numbers)
        entries = [[table.add_all(field) for field in step] for step in numbers]
        return _Steps(tuple(type(step) for step in child.steps), varies, entries)


class Children:
    """The placed children of a prototype, those whose steps are alike together."""

    def __init__(self, children: Sequence[Child], table: ValueTable) -> None:
        self.prototype: dict[str, str] = {child.name: child.prototype for child in children}
        self.place: dict[str, tuple[int, int]] = {}
        """The group of each child, and its place there."""
        groups: dict[tuple[Any, ...], list[_Steps]] = {}
        for child in children:
            steps = _Steps.of(child, table)
            group = groups.setdefault((steps.kinds, steps.varies), [])
            self.place[child.name] = list(groups).index((steps.kinds, steps.varies)), len(group)
            group.append(steps)
        self.groups: list[_AlikeChildren] = [_AlikeChildren(steps) for steps in groups.values()]

    def placement(self, child: str, placed: Sequence[Affine]) -> Affine:
        """That of one child (...), from those of all groups (..., children)."""
        group, place = self.place[child]
        Q, t = placed[group]
        return Affine(Q[..., place, :, :], t[..., place, :])


def _step(kind: type, numbers: list[Array]) -> Affine:
    """One placing step."""
    if kind is Turn:
        return turn(numbers[0], numbers[1][..., 0], numbers[2])
    return reflect(*numbers) if kind is Reflect else Affine(IDENTITY.Q, numbers[0])
