"""What a design is at rest, or about the state under described loads, with exact derivatives by parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexura.analysis.limits import preload
from flexura.analysis.strain import LargestStresses, Missing, end_forces, largest_stresses
from flexura.arrays import Array
from flexura.duals import Dual, plain
from flexura.linalg import critical_shapes
from flexura.motion import Repeated
from flexura.records import Record
from flexura.reduction import Flexibility, flexibility
from flexura.sensitivity import FullOrderFamily, clusters
from flexura.structure import Design, FullOrderModel, Plan, assemble, dead_load
from flexura.systems import InputPort, Ports

FACTORS = 4
"""Buckling factors that are looked at, to see whether the lowest is repeated."""


@dataclass(frozen=True, repr=False)
class AtRest(Record):
    """A design of a plan, linear about rest or about the loads and gravity that are described, with derivatives by the
    parameters `names`; m, rad, N, N m, Pa.

    A slope is NaN where members or sections are stressed alike and part as a parameter moves, where something is zero
    of which the size counts, and at kinks of a description. Raises OptionError where a pose is described, and
    SolverError where something can move freely or loads are beyond buckling.
    """

    _shown = ("names",)

    plan: Plan
    parameters: Mapping[str, float]
    names: Sequence[str]

    @cached_property
    def model(self) -> FullOrderModel:
        """The full-order model, the design of which has slopes, its matrices not."""
        self.plan.refuse_pose("derivatives of what is linear")
        return replace(self._plain, design=Design.with_slopes(self.plan, self.parameters, self.names))

    @cached_property
    def _plain(self) -> FullOrderModel:
        return assemble(self.plan, self.parameters)

    @cached_property
    def _flexibility(self) -> Flexibility:
        return flexibility(self._plain)

    def response(self, load: Any) -> Any:
        """Displacements (n, k) under loads (n, k), with slopes (theory eq. V1)."""
        u = self._flexibility.held(plain(load))
        missing = -self._stiffness_changes(u, loaded=True)
        if isinstance(load, Dual):
            missing = missing + load.slope
        columns = np.moveaxis(missing, 0, 1).reshape(len(u), -1)
        slope = self._flexibility.held(columns).reshape(len(u), len(self.names), -1)
        return Dual(u, np.moveaxis(slope, 1, 0))

    def _stiffness_changes(self, X: Array, loaded: bool) -> Array:
        """K' X (P, n, k), with or without what described loads add; NaN at kinks."""
        family = FullOrderFamily(self.plan, loaded=loaded)
        changes = family.changes(self.parameters, list(self.names), X)
        return np.stack([own.K if own.is_smooth else own.K * np.nan for own in changes])

    @cached_property
    def stresses(self) -> LargestStresses:
        """The largest stresses, (m, 1), under the loads and gravity that are described."""
        return self.stresses_within(0.0)

    def stresses_within(self, share: float) -> LargestStresses:
        """As `stresses`, with slopes of forces told apart in a share of what is missing of equilibrium."""
        missing = Missing.of(self._missing, self.plan.topology.dof, share) if share else None
        gravity = self.plan.loads.gravity(self.model.values)
        weight = gravity if gravity.any() else None

        def forces(name: str) -> tuple[Array, Array]:
            return end_forces(self.model, name, self._loaded, weight)

        return largest_stresses(self.model, forces, 1, missing=missing)

    @cached_property
    def _load(self) -> Any:
        """The loads and gravity (n, 1) that are described, with slopes."""
        loads, values = self.plan.loads, self.model.values
        return dead_load(self.model, loads.gravity(values), loads.wrenches(values))[:, None]

    @cached_property
    def _loaded(self) -> Any:
        """Displacements (n, 1) under them, with slopes."""
        return self.response(self._load)

    @cached_property
    def _missing(self) -> Any:
        """What these miss of equilibrium (n,), with slopes."""
        return (self._load - FullOrderFamily(self.plan).products_of(self.model.design, self._loaded)[0])[:, 0]

    def coupling(self, actuator: str, node: str) -> tuple[Any, Any]:
        """Displacements (6,) of a node per unit of a command, and the elongation of the actuator, with slopes. Raises
        OptionError for unknown names."""
        design = self.model.design
        port: InputPort = Ports(design).inputs([actuator])[0]
        u = self.response(port.load[:, None])
        rows = design.dense_rows(self.plan.topology.numbers([node]))
        return (rows @ u)[:, 0], (port.row @ u)[0]

    @property
    def buckling_factor(self) -> Repeated | None:
        """The factor on the described loads and gravity at which it buckles, with slopes (theory eq. V4); None where it
        does not."""
        own = preload(self.plan, self.parameters)
        factors, shapes = critical_shapes(own.model.K, own.K_g, FACTORS)
        if not len(factors):
            return None
        at = clusters(factors)[0]
        value, x = float(np.mean(factors[at])), shapes[:, at]
        elastic, whole = (self._stiffness_changes(x, loaded) for loaded in (False, True))
        slope = value * (x.T @ ((1 - value) * elastic + value * whole))
        return Repeated(at, value, (slope + np.swapaxes(slope, 1, 2)) / 2)
