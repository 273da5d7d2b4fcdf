"""Static quantities at rest of blocks of designs: compliance, stiffness, coupling and amplification."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from flexura.arrays import Array, Index
from flexura.reduction import independent_flexibility
from flexura.structure import Design, Plan
from flexura.study.questions.catalogue import Quantity
from flexura.study.questions.designs import Block
from flexura.study.questions.reading import Freedom, Port
from flexura.systems import Action, Ports

STATIC = ("compliance", "stiffness", "coupling", "amplification")
"""What is asked here."""

ROUNDING = 1e-8
"""Compliances below so much of their bound, sqrt(C_ii C_jj), are round-off."""


def without_round_off(moved: Any, bound: Any) -> Any:
    """Motions by forces elsewhere, zero where they are round-off of the bound that stands for C_ii C_jj."""
    return np.where(abs(moved) < ROUNDING * np.sqrt(abs(bound)), 0.0, moved)


class Statics:
    """What is asked of static kinds, answered for designs at rest without loads: `value` (designs, q), NaN where a
    design has to be worked out by itself."""

    def __init__(self, block: Block, asked: Sequence[Quantity]) -> None:
        self.plan: Plan = block.plan
        self.asked = asked
        self.value: Array = np.full((block.count, len(asked)), np.nan)
        block.divided(lambda designs: self._solve(block, designs))

    @cached_property
    def _names(self) -> list[Freedom | Port]:
        """What moves or is moved, each once."""
        return list(dict.fromkeys(own for quantity in self.asked for own in ends_of(quantity)))

    @cached_property
    def _nodes(self) -> Index:
        """The global nodes of all of them."""
        design = Design.of(self.plan)
        return np.unique([node for own in self._names for node in _action(design, own).nodes])

    def _motions(self, design: Design, B: Array) -> Array:
        """Rows (..., 2 k, n) of all that moves, then of the loads that a unit of each puts on."""
        actions = [_action(design, own) for own in self._names]
        rows = [own.row(B[..., np.searchsorted(self._nodes, own.nodes), :, :]) for own in actions]
        loads = [np.asarray(own.gain)[..., None] * row for own, row in zip(actions, rows, strict=True)]
        return np.stack(np.broadcast_arrays(*rows, *loads), axis=-2)

    def _solve(self, block: Block, designs: Index) -> None:
        found = independent_flexibility(self.plan, block.some(designs), self._nodes, self._motions)
        if found is None:
            return
        C, settled = found
        for q, quantity in enumerate(self.asked):
            self.value[designs[settled], q] = self._read(C[settled], quantity)

    def _read(self, C: Array, asked: Quantity) -> Array:
        """A quantity (designs,) from the flexibility (designs, 2 k, 2 k) along all rows."""
        to, by = (self._names.index(own) for own in ends_of(asked))
        moved = without_round_off(C[:, to, by], C[:, to, to] * C[:, by, by])
        if asked.kind in ("compliance", "stiffness"):
            return np.asarray(1 / moved if asked.kind == "stiffness" else moved)
        load = len(self._names) + by
        moved = np.where(moved == 0.0, 0.0, C[:, to, load])
        return np.asarray(moved if asked.kind == "coupling" else moved / abs(C[:, by, load]))


def ends_of(asked: Quantity) -> tuple[Freedom | Port, Freedom | Port]:
    """What is moved, and by what."""
    first, last = asked.arguments[0], asked.arguments[-1]
    assert isinstance(first, Freedom | Port)
    assert isinstance(last, Freedom | Port)
    return (first, last) if asked.kind in ("compliance", "stiffness") else (last, first)


def _action(design: Design, own: Freedom | Port) -> Action:
    if isinstance(own, Port):
        return Ports(design).action(own.known)
    node = int(design.plan.topology.numbers([own.node])[0])
    return Action([node], np.eye(3)[own.component % 3], own.turns, 1.0)
