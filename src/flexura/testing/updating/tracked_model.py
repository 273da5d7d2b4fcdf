"""A model whose modes are tracked by their shapes while its parameters move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg import Eigenpairs, count_below
from flexura.modal import track_modes
from flexura.sensitivity import (
    ModelOrder,
    displacement_rows,
    family_of,
    first_columns,
    moved_clusters,
    static_vectors,
    whole_clusters,
)
from flexura.structure import Design, Plan, full_order_model
from flexura.testing.rig import AnyFamily, MassLoadedFamily, readings_of
from flexura.testing.updating.targets import ModalTarget, ResponseTarget, State, Target

EXTRA = 4
"""Modes computed beyond those compared, so that a mode that moves up in the order is still found."""

BEYOND = 2.0
"""Modes up to so many times the highest frequency of a response are in its modal sum."""


class TrackedModel:
    """The model under one load of sensors, compared with the targets that were measured with it.

    `rows` are those of each target's channels among all readings.
    """

    def __init__(
        self,
        plan: Plan,
        start: Mapping[str, float],
        targets: Sequence[Target],
        placements: Sequence[str],
        order: ModelOrder,
        keep: int | Mapping[str, int],
        reference: Array | None,
        tracked: bool,
    ) -> None:
        self._is_tracked, self._reference = tracked, reference
        channels = [c for t in targets for c in t.channels]
        readings = readings_of(full_order_model(Design.of(plan, start)), channels) if channels else []
        ends = np.cumsum([0, *(len(t.channels) for t in targets)])
        self.rows: list[slice] = [slice(int(a), int(b)) for a, b in pairwise(ends)]
        bare = family_of(plan, order, start, keep, displacement_rows(readings))
        self.family: AnyFamily = MassLoadedFamily(bare, placements) if placements else bare
        self._has_responses = any(isinstance(t, ResponseTarget) for t in targets)
        self._has_shapes = bool(channels)
        model = self.family.model(start)
        self.compared: int = max([max(t.numbers) for t in targets if isinstance(t, ModalTarget)], default=0)
        self.count: int = self.compared + EXTRA
        for t in targets:
            if isinstance(t, ResponseTarget):
                limit = (2 * np.pi * BEYOND * float(t.hz.max())) ** 2
                self.count = max(self.count, count_below(model.K, model.M, limit) + EXTRA)
        self.count = min(self.count, model.order)
        self.weakest: float = 1.0
        """Least modal assurance criterion of a mode between one accepted design and the next."""
        self._mac = 1.0
        if reference is None:
            self.accept(self.state(start))

    @property
    def reference(self) -> Array | None:
        """Shapes (n, k) that modes are compared with."""
        return self._reference

    def state(self, at: Mapping[str, float], names: Sequence[str] = ()) -> State:
        """The model at a design, its modes tracked, with derivatives by named parameters.

        Raises FlexuraError when it cannot be solved.
        """
        model = self.family.model(at)
        pairs = whole_clusters(model.K, model.M, self.count)
        pairs, tracked = self._tracked(pairs, model.M)
        G = static_vectors(self.family, at) if self._has_responses else np.zeros((model.order, 0))
        vectors = np.hstack([pairs.vectors, G])
        Y = self.family.readings(at, pairs.vectors) if self._has_shapes else np.zeros((0, len(pairs.values)))
        changes = self.family.changes(at, names, vectors) if names else []
        for name, change in zip(names, changes, strict=True):
            if not change.is_smooth:
                raise SolverError(f"{name}: the design is at a kink, where nothing has a derivative by it")
        own = [first_columns(c, len(pairs.values)) for c in changes]
        moved = moved_clusters(model.K, model.M, pairs, own, shapes=self._has_shapes and bool(names))
        return State(self.family, dict(at), pairs, Y, tracked, G, moved, changes)

    def accept(self, state: State) -> None:
        """Take the modes of a design as those to track from now on."""
        self._reference = state.pairs.vectors[:, state.tracked].copy()
        self.weakest = min(self.weakest, self._mac)

    def _tracked(self, pairs: Eigenpairs, M: Any) -> tuple[Eigenpairs, NDArray[np.intp]]:
        """Which modes are those compared, and vectors of repeated frequencies turned to meet them."""
        if self._reference is None:
            return pairs, np.arange(min(self.compared, len(pairs.values)))
        found = track_modes(self._reference, pairs.values, pairs.vectors, M)
        self._mac = float(found.mac.min(initial=1.0))
        number = found.number if self._is_tracked else np.arange(len(found.number))
        return Eigenpairs(pairs.values, found.shapes), number
