"""The residuals of a calibration and their derivatives, each with the model as it was when it was measured.

A model whose modes are tracked by their shapes while its parameters move.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import FlexuraError, SolverError
from flexura.linalg import Eigenpairs, count_below
from flexura.modal import track_modes
from flexura.records import Latest
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
from flexura.testing.rig import AnyFamily, MassLoadedFamily, placements_of, readings_of
from flexura.testing.updating.configuration import Configuration
from flexura.testing.updating.targets import ModalTarget, ResponseTarget, State, Target
from flexura.testing.updating.unknowns import Unknowns

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


REFUSED = 1e4
"""Residual of a design that cannot be evaluated."""


class CalibrationProblem:
    """Weighted residuals of targets over standard coordinates z of the unknowns.

    Targets of one configuration that were measured with the sensors of the same placements share a model with their
    mass. Modes are those of the start, tracked by the modal assurance criterion from one accepted design to the next:
    the shapes at the last `jacobian` are those to compare with. Without `tracked` they are those of the same number.
    """

    def __init__(
        self,
        configurations: Sequence[Configuration],
        unknown: Unknowns,
        order: ModelOrder,
        keep: int | Mapping[str, int],
        references: Sequence[Array | None] | None = None,
        tracked: bool = True,
    ) -> None:
        self.configurations: tuple[Configuration, ...] = tuple(configurations)
        self.unknown = unknown
        self.targets: list[Target] = [t for own in configurations for t in own.targets]
        start = self._named(unknown.z(unknown.start))
        loads = [(own, placements_of(own.plan, t.setups)) for own in configurations for t in own.targets]
        keys = [(own.label, load) for own, load in loads]
        self._members = list(dict(zip(keys, loads, strict=True)).values())
        numbers = {key: g for g, key in enumerate(dict.fromkeys(keys))}
        self._group = [numbers[key] for key in keys]
        known = references or [None] * len(self._members)
        self.models: list[TrackedModel] = [
            TrackedModel(
                own.plan,
                own.point(start),
                [t for t, group in zip(self.targets, self._group, strict=True) if group == g],
                load,
                order,
                keep,
                reference,
                tracked,
            )
            for g, ((own, load), reference) in enumerate(zip(self._members, known, strict=True))
        ]
        """Each with the sensors of some placements, with their mean mass."""
        each = [iter(m.rows) for m in self.models]
        self.rows: list[slice] = [next(each[g]) for g in self._group]
        self.refused: str | None = None
        self.evaluations: int = 0
        self._latest: Latest[list[State]] = Latest()

    def _named(self, z: Array) -> dict[str, float]:
        """Values of the unknowns by name."""
        return dict(zip(self.unknown.names, map(float, self.unknown.values(z)), strict=True))

    def compared(self, z: Array) -> Iterator[tuple[Target, State, slice]]:
        """Every target with the model that it is compared with, and the rows of its channels.

        Raises FlexuraError when a model cannot be solved.
        """
        return self._with(self._states(z))

    def _with(self, states: Sequence[State]) -> Iterator[tuple[Target, State, slice]]:
        return zip(self.targets, (states[g] for g in self._group), self.rows, strict=True)

    def _states(self, z: Array) -> list[State]:
        def found() -> list[State]:
            values = self._named(z)
            self.evaluations += 1
            return [m.state(c.point(values)) for m, (c, _) in zip(self.models, self._members, strict=True)]

        return self._latest.get(np.asarray(z).tobytes(), found)

    @property
    def references(self) -> list[Array | None]:
        """Shapes (n, k) that modes of every model are compared with."""
        return [m.reference for m in self.models]

    @property
    def weakest(self) -> float:
        """Least modal assurance criterion of a mode between one accepted design and the next."""
        return min(m.weakest for m in self.models)

    def residual(self, z: Array) -> Array:
        """Weighted residuals (r,) of all targets; large ones for a design that cannot be evaluated."""
        try:
            found = np.concatenate([t.residual(state, r) for t, state, r in self.compared(z)])
            if np.isfinite(found).all():
                return found
            self.refused = "a residual that is not finite"
        except (FlexuraError, np.linalg.LinAlgError) as error:
            self.refused = str(error)
        return np.full(self.size, REFUSED)

    def jacobian(self, z: Array) -> Array:
        """d residual / dz (r, P); the modes found here are those tracked from now on."""
        values = self._named(z)
        self.evaluations += 1
        states = [m.state(c.point(values), c.free) for m, (c, _) in zip(self.models, self._members, strict=True)]
        found = []
        for (t, state, rows), g in zip(self._with(states), self._group, strict=True):
            own = t.jacobian(state, rows)
            wide = np.zeros((len(own), len(self.unknown.names)))
            wide[:, [self.unknown.names.index(n) for n in self._members[g][0].free]] = own
            found.append(wide)
        for model, state in zip(self.models, states, strict=True):
            model.accept(state)
        self._latest.clear()
        return np.concatenate(found) * self.unknown.slope(z)

    @property
    def size(self) -> int:
        """Number of residuals."""
        count = 0
        for t in self.targets:
            if isinstance(t, ModalTarget):
                count += len(t.frequency_hz) * (1 + (len(t.channels) if t.shapes is not None else 0))
            else:
                count += 2 * t.sigma.size
        return count
