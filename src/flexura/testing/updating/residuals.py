"""The residuals of a calibration and their derivatives, each with the model as it was when it was measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from flexura.arrays import Array
from flexura.errors import FlexuraError
from flexura.records import Latest
from flexura.sensitivity import ModelOrder
from flexura.testing.rig import placements_of
from flexura.testing.updating.configuration import Configuration
from flexura.testing.updating.targets import ModalTarget, State, Target
from flexura.testing.updating.tracked_model import TrackedModel
from flexura.testing.updating.unknowns import Unknowns

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
