"""The residuals of a calibration and their derivatives, with modes followed while parameters move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from flexura.errors import FlexuraError
from flexura.experiment.eigen_derivatives import clusters, moved_clusters, whole_clusters
from flexura.experiment.reading import displacement_rows, readings_of
from flexura.experiment.response_sensitivity import first_columns, static_vectors
from flexura.experiment.sensitivity import family_of
from flexura.experiment.targets import ModalTarget, ResponseTarget, State, Target
from flexura.experiment.unknowns import Unknowns
from flexura.experiment.variation import Order, changes_of, full_order
from flexura.linalg import Eigenpairs, count_below
from flexura.structure import Plan

Array = NDArray[np.float64]

EXTRA = 4
"""Modes computed beyond those compared, so that a mode that moves up in the order is still found."""

BEYOND = 2.0
"""Modes up to so many times the highest frequency of a response are in its modal sum."""

LEVELS = 2
"""Difference steps of the sensitivities: steps of the search need fewer digits than reported sensitivities."""

REFUSED = 1e4
"""Residual of a design that cannot be evaluated."""


class Problem:
    """Weighted residuals of targets over standard coordinates z of the unknowns.

    Modes are those of the start, followed by the modal assurance criterion from one accepted design to the next: the
    shapes at the last `jacobian` are those to compare with. Without `follow` they are those of the same number.
    """

    def __init__(
        self,
        plan: Plan,
        unknown: Unknowns,
        fixed: Mapping[str, float],
        targets: Sequence[Target],
        order: Order,
        keep: int | Mapping[str, int],
        reference: Array | None = None,
        follow: bool = True,
    ) -> None:
        self.plan, self.unknown, self.targets = plan, unknown, list(targets)
        self.fixed, self._follow = dict(fixed), follow
        start = self.point(unknown.z(unknown.start))
        channels = [c for t in targets for c in t.channels]
        places = readings_of(full_order(plan, start), channels) if channels else []
        ends = np.cumsum([0, *(len(t.channels) for t in targets)])
        self.rows = [slice(int(a), int(b)) for a, b in pairwise(ends)]
        self.family = family_of(plan, order, start, keep, displacement_rows(places))
        self._has_responses = any(isinstance(t, ResponseTarget) for t in targets)
        self._has_shapes = bool(channels)
        model = self.family.model(start)
        self.compared = max([len(t.frequency_hz) for t in targets if isinstance(t, ModalTarget)], default=0)
        self.count = self.compared + EXTRA
        for t in targets:
            if isinstance(t, ResponseTarget):
                limit = (2 * np.pi * BEYOND * float(t.hz.max())) ** 2
                self.count = max(self.count, count_below(model.K, model.M, limit) + EXTRA)
        self.count = min(self.count, model.order)
        self.refused: str | None = None
        self.evaluations = 0
        self.weakest = 1.0
        """Least modal assurance criterion of a mode between one accepted design and the next."""
        self._likeness = 1.0
        self._reference = reference
        self._remembered: tuple[bytes, State] | None = None
        if reference is None:
            self._accept(self.state(self.unknown.z(unknown.start)))

    def point(self, z: Array) -> dict[str, float]:
        """Parameters of a design."""
        values = self.unknown.values(z)
        return {**self.fixed, **{n: float(v) for n, v in zip(self.unknown.names, values, strict=True)}}

    def state(self, z: Array, derivatives: bool = False) -> State:
        """The model at a design, its modes followed. Raises FlexuraError when it cannot be solved."""
        key = np.asarray(z).tobytes()
        if not derivatives and self._remembered is not None and self._remembered[0] == key:
            return self._remembered[1]
        at = self.point(z)
        self.evaluations += 1
        model = self.family.model(at)
        pairs = whole_clusters(model.K, model.M, self.count)
        pairs, tracked = self._followed(pairs, model.M)
        G = static_vectors(self.family, at) if self._has_responses else np.zeros((model.order, 0))
        vectors = np.hstack([pairs.vectors, G])
        Y = self.family.readings(at, pairs.vectors) if self._has_shapes else np.zeros((0, len(pairs.values)))
        names = self.unknown.names if derivatives else ()
        changes = changes_of(self.family, at, names, vectors, LEVELS) if derivatives else []
        own = [first_columns(c, len(pairs.values)) for c in changes]
        moved = moved_clusters(model.K, model.M, pairs, own, shapes=self._has_shapes and derivatives)
        found = State(self.family, at, pairs, Y, tracked, G, moved, changes)
        self._remembered = (key, found)
        return found

    def _followed(self, pairs: Eigenpairs, M: Any) -> tuple[Eigenpairs, NDArray[np.intp]]:
        """Which modes are those compared, and vectors of repeated frequencies turned to meet them."""
        if self._reference is None:
            return pairs, np.arange(min(self.compared, len(pairs.values)))
        overlap = self._reference.T @ (M @ pairs.vectors)
        size = np.einsum("ik,ik->k", self._reference, M @ self._reference)
        overlap /= np.sqrt(size)[:, None]
        X = pairs.vectors.copy()
        for at in clusters(pairs.values):
            if len(at) > 1:
                nearest = np.sort(np.argsort(-(overlap[:, at] ** 2).sum(axis=1))[: len(at)])
                U, _, Vt = np.linalg.svd(overlap[nearest][:, at], full_matrices=True)
                Q = Vt.T[:, : len(nearest)] @ U.T if len(nearest) == len(at) else np.eye(len(at))
                X[:, at], overlap[:, at] = X[:, at] @ Q, overlap[:, at] @ Q
        rows, columns = linear_sum_assignment(-(overlap**2))
        tracked = np.zeros(len(overlap), dtype=np.intp)
        tracked[rows] = columns
        if len(rows):
            self._likeness = float((overlap[rows, columns] ** 2).min())
        return Eigenpairs(pairs.values, X), tracked if self._follow else np.arange(len(tracked))

    def _accept(self, state: State) -> None:
        self._reference = state.pairs.vectors[:, state.tracked].copy()
        self.weakest = min(self.weakest, self._likeness)

    @property
    def reference(self) -> Array | None:
        """Shapes (n, k) that modes are compared with."""
        return self._reference

    def residual(self, z: Array) -> Array:
        """Weighted residuals (r,) of all targets; large ones for a design that cannot be evaluated."""
        try:
            state = self.state(z)
            found = np.concatenate([t.residual(state, r) for t, r in zip(self.targets, self.rows, strict=True)])
            if np.isfinite(found).all():
                return found
            self.refused = "a residual that is not finite"
        except (FlexuraError, np.linalg.LinAlgError) as error:
            self.refused = str(error)
        return np.full(self.size, REFUSED)

    def jacobian(self, z: Array) -> Array:
        """d residual / dz (r, P); the modes found here are those followed from now on."""
        state = self.state(z, derivatives=True)
        found = np.concatenate([t.jacobian(state, r) for t, r in zip(self.targets, self.rows, strict=True)])
        self._accept(state)
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
