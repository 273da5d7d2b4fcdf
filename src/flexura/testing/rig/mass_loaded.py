"""Models of a mechanism over its parameters with the sensors of a placement on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.duals import zeros
from flexura.records import Latest
from flexura.sensitivity import Change, Family, Matrices
from flexura.structure import Design, FullOrderModel
from flexura.testing.rig.test_points import TestPoints


class MassLoadedFamily:
    """A family with the mean mass of the sensors of some placements, where and as heavy as the test of a design says.

    theory eq. K20.
    """

    def __init__(self, family: Family, placements: Sequence[str]) -> None:
        self._family, self._placements = family, tuple(placements)
        self._latest: Latest[FullOrderModel | Matrices] = Latest()

    def model(self, parameters: Mapping[str, float]) -> FullOrderModel | Matrices:
        """The model for one design with the sensors; the last one is remembered."""
        at = dict(parameters)
        return self._latest.get(frozenset(at.items()), lambda: self._built(at))

    def _built(self, at: dict[str, float]) -> FullOrderModel | Matrices:
        own = self._family.model(at)
        added = self._points(at).added(self._placements)
        if isinstance(own, FullOrderModel):
            return replace(own, M=sp.csc_matrix(own.M + added.on()))
        return replace(own, M=own.M + added.on(self._family.over_coordinates(at, added.motion)))

    def changes(self, parameters: Mapping[str, float], names: Sequence[str], X: Array) -> list[Change]:
        """Derivatives by each of some parameters of K X and M X (n, k) with the sensors, and of readings."""
        return self._family.changes(parameters, names, X, self._sensors)

    def _sensors(self, design: Design, X: Array) -> Any:
        """The sensors' mass times displacements X (n, k) of the full-order model, of a design that may have slopes."""
        topology, x = design.plan.topology, design.geometry.positions
        padded = np.concatenate([X, np.zeros((1, X.shape[1]))])
        found = zeros(padded.shape, design.values)
        for mass, number, at in TestPoints(design).masses(self._placements):
            root = topology.root[number]
            D, dof = rigid_arm(at - x[root])[:3], topology.dof[root]
            found[dof] += D.T @ (mass * (D @ padded[dof]))
        return found[:-1]

    def readings(self, parameters: Mapping[str, float], X: Array) -> Array:
        """What the rows read off coordinate vectors X: (o, k)."""
        return self._family.readings(parameters, X)

    def rows(self, parameters: Mapping[str, float]) -> Array:
        """The rows themselves over the coordinates: (o, n)."""
        return self._family.rows(parameters)

    def _points(self, parameters: Mapping[str, float]) -> TestPoints:
        return TestPoints(Design.of(self._family.plan, parameters))


AnyFamily = Family | MassLoadedFamily
