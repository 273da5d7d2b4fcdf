"""The residuals of a calibration and their derivatives, each with the model as it was when it was measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from flexura.errors import FlexuraError
from flexura.experiment.followed import Followed
from flexura.experiment.places_of_test import placements_of
from flexura.experiment.targets import ModalTarget, State, Target
from flexura.experiment.unknowns import Unknowns
from flexura.experiment.variation import Order
from flexura.structure import Plan

Array = NDArray[np.float64]

REFUSED = 1e4
"""Residual of a design that cannot be evaluated."""


class Problem:
    """Weighted residuals of targets over standard coordinates z of the unknowns.

    Targets measured with the sensors of the same placements share a model with their mass. Modes are those of the
    start, followed by the modal assurance criterion from one accepted design to the next: the shapes at the last
    `jacobian` are those to compare with. Without `follow` they are those of the same number.
    """

    def __init__(
        self,
        plan: Plan,
        unknown: Unknowns,
        fixed: Mapping[str, float],
        targets: Sequence[Target],
        order: Order,
        keep: int | Mapping[str, int],
        references: Sequence[Array | None] | None = None,
        follow: bool = True,
    ) -> None:
        self.plan, self.unknown, self.targets, self.fixed = plan, unknown, list(targets), dict(fixed)
        start = self.point(unknown.z(unknown.start))
        loads = [placements_of(plan, t.setups) for t in targets]
        self.placements = list(dict.fromkeys(loads))
        """Placements of which each model carries the sensors, with their mean mass."""
        self._group = [self.placements.index(own) for own in loads]
        members = [[t for t, own in zip(targets, loads, strict=True) if own == load] for load in self.placements]
        known = references or [None] * len(self.placements)
        self.models = [
            Followed(plan, start, own, load, order, keep, reference, follow)
            for own, load, reference in zip(members, self.placements, known, strict=True)
        ]
        each = [iter(m.rows) for m in self.models]
        self.rows = [next(each[g]) for g in self._group]
        self.refused: str | None = None
        self.evaluations = 0
        self._remembered: tuple[bytes, list[State]] | None = None

    def point(self, z: Array) -> dict[str, float]:
        """Parameters of a design."""
        values = self.unknown.values(z)
        return {**self.fixed, **{n: float(v) for n, v in zip(self.unknown.names, values, strict=True)}}

    def compared(self, z: Array) -> Iterator[tuple[Target, State, slice]]:
        """Every target with the model that it is compared with, and the rows of its channels.

        Raises FlexuraError when a model cannot be solved.
        """
        return self._with(self._states(z))

    def _with(self, states: Sequence[State]) -> Iterator[tuple[Target, State, slice]]:
        return zip(self.targets, (states[g] for g in self._group), self.rows, strict=True)

    def _states(self, z: Array) -> list[State]:
        key = np.asarray(z).tobytes()
        if self._remembered is None or self._remembered[0] != key:
            at = self.point(z)
            self.evaluations += 1
            self._remembered = (key, [m.state(at) for m in self.models])
        return self._remembered[1]

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
        """d residual / dz (r, P); the modes found here are those followed from now on."""
        at = self.point(z)
        self.evaluations += 1
        states = [m.state(at, self.unknown.names) for m in self.models]
        found = np.concatenate([t.jacobian(state, r) for t, state, r in self._with(states)])
        for model, state in zip(self.models, states, strict=True):
            model.accept(state)
        self._remembered = None
        return found * self.unknown.slope(z)

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
