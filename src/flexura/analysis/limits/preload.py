"""Statics under dead loads and gravity, stiffness and frequencies about that state, and where it buckles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.analysis.limits.limits import States, motion_limits
from flexura.analysis.strain import finite_numbers
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.full_order import unloaded
from flexura.linalg import critical_factors, critical_shapes, is_definite, ranked
from flexura.mechanism import Mechanism
from flexura.reduction import Certificate, certificate, chained, lowest_pairs
from flexura.results import Tabular, plain
from flexura.structure import Drive, FullOrderModel, InputPort, Plan, Ports, Pushes, prestress, solve_definite
from flexura.tables import Facts, Item, Table, number

MOST_MEMBERS = 10
"""Members that carry most, in a notebook."""


@dataclass(frozen=True, repr=False)
class Preload(Tabular):
    """A mechanism under dead loads.

    `load` (n,) acts on the DOFs of `model`, `displacement_vector` (n,) is the linear static response, `K_g` (n, n) the
    geometric stiffness of that state, and `axial_force` the least and the largest axial force of every member, N,
    tension positive. `loads` (6,) are those by node, N and N m, and `actuators` the commands by name.
    """

    _shown = ("model", "axial_force")
    _told = ("axial_force",)

    model: FullOrderModel
    load: Array
    displacement_vector: Array
    K_g: sp.csc_matrix
    axial_force: dict[str, tuple[float, float]]
    loads: dict[str, Array] = field(default_factory=dict)
    actuators: dict[str, float] = field(default_factory=dict)

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Where this state stops holding: large motion, and loads beyond buckling."""
        return (*motion_limits(States(self.model, self.displacement_vector[:, None])), *self.buckled)

    @cached_property
    def buckled(self) -> tuple[Diagnostic, ...]:
        """That the loads are beyond buckling, when they are."""
        if not is_definite(self.model.K) or is_definite(self.stiffness()):
            return ()
        factor = self.buckling_factor
        text = f"buckled: the loads are {1 / factor:.3g} times those at which the mechanism buckles"
        return (Diagnostic("buckling", "", 1 / factor, 1.0, "1", text),)

    def to_dict(self, n: int = 6) -> dict[str, Any]:
        """Plain data for JSON, with up to `n` buckling factors and frequencies; under loads beyond buckling there are
        no frequencies."""
        values = {
            "buckling_factors": self.buckling_factors(n),
            "loaded": None if self.buckled else self.natural_frequencies(n),
            "unloaded": self.natural_frequencies(n, 0.0),
        }
        return {**plain(values), **super().to_dict()}

    def _title(self) -> str:
        return f"{self.model.plan.name} under dead loads"

    def presentation(self, n: int = 6) -> Iterator[Item]:
        """`n` frequencies with and without load, none of them beyond buckling, buckling factors, and the members that
        carry most."""
        loaded = {} if self.buckled else self.natural_frequencies(n).proven_columns()
        columns = loaded | self.natural_frequencies(n, 0.0).proven_columns("unloaded ")
        count = min(map(len, columns.values()))
        columns = {name: column[:count] for name, column in columns.items()}
        yield Table({"mode": range(1, count + 1), **columns}, "modes")
        factors = ", ".join(number(float(f)) for f in self.buckling_factors(n))
        yield Facts({"buckling factors on all loads": factors or "none: no load of this direction buckles it"})
        forces = list(self.axial_force.items())
        most = dict(forces[i] for i in ranked([max(map(abs, ends)) for _, ends in forces])[:MOST_MEMBERS])
        yield Table(_force_columns(most), "members", count=len(forces))

    def _columns(self) -> dict[str, Any]:
        return _force_columns(self.axial_force)

    def stiffness(self, factor: float = 1.0) -> sp.csc_matrix:
        """K (n, n) about the state under `factor` times the loads."""
        return (self.model.K + factor * self.K_g).tocsc()

    def displacement(self, node: str, factor: float | None = None) -> Array:
        """Displacement (6,) of a node, m and rad, global frame: linear, or with the stiffness about the state under
        `factor` times the loads. Raises OptionError for unknown nodes and SolverError beyond buckling."""
        u = self.displacement_vector
        if factor is not None:
            u = factor * solve_definite(self._definite(factor), self.load)
        plan = self.model.plan
        return np.asarray(self.model.design.node_rows(plan.topology.numbers([node])) @ u)

    def natural_frequencies(self, n: int = 6, factor: float = 1.0) -> Certificate:
        """The `n` lowest natural frequencies, Hz, about the state under `factor` times the loads, each with a proven
        interval.

        Raises SolverError when that state is beyond buckling.
        """
        self._definite(factor)
        full = chained(self.model, geometric=factor * self.K_g)
        return certificate(full, lowest_pairs(full, n), n)

    @cached_property
    def buckling_factor(self) -> float:
        """The lowest factor on all loads together at which the mechanism buckles; infinite when it does not."""
        factors = self.buckling_factors(1)
        return float(factors[0]) if len(factors) else np.inf

    def buckling_factors(self, n: int = 3) -> Array:
        """The `n` lowest positive factors (k,) on all loads at which K + factor K_g is singular (theory eq. P7).

        Fewer when there are fewer. The first is confirmed by inertia counts. Raises OptionError for n below one,
        SolverError when the unloaded mechanism can move freely or the counts contradict.
        """
        return critical_factors(self.model.K, self.K_g, _count(n))

    def buckling_shapes(self, n: int = 3) -> Array:
        """The displacements (order, k) on the DOFs of `model`, m and rad, in which it buckles at `buckling_factors(n)`.

        The largest component of each is 1, the first of several that are as large. Where factors are equal they are
        some shapes that span all. Raises as `buckling_factors`, and SolverError when a shape is not one of equilibrium.
        """
        _, shapes = critical_shapes(self.model.K, self.K_g, _count(n))
        sizes = np.abs(shapes)
        largest = np.argmax(sizes >= (1 - 1e-6) * sizes.max(axis=0, initial=0.0), axis=0)
        return shapes / np.take_along_axis(shapes, largest[None], axis=0)

    @cached_property
    def buckling_shape(self) -> Array | None:
        """The first of these shapes (order,); None when it does not buckle."""
        shapes = self.buckling_shapes(1)
        return shapes[:, 0] if shapes.shape[1] else None

    def _definite(self, factor: float) -> sp.csc_matrix:
        K = self.stiffness(factor)
        if is_definite(self.model.K) and not is_definite(K):
            first = self.buckling_factor
            raise SolverError(f"buckled under {factor:g} times the loads: it buckles at {first:.5g} times")
        return K


def _force_columns(forces: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """Axial forces of members, tension positive."""
    least, largest = ([ends[k] for ends in forces.values()] for k in (0, 1))
    return {"member": list(forces), "least axial force [N]": least, "largest axial force [N]": largest}


@verb
def preload(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, float] | None = None,
    *,
    gravity: Sequence[float] | None = None,
    loads: Mapping[str, ArrayLike] | None = None,
    actuators: Mapping[str, float] | None = None,
) -> Preload:
    """The state of a mechanism under gravity, (3,) m/s^2, dead loads, (6,) N and N m by node, global frame, and
    actuator commands in the units of their inputs, by name.

    Gravity is that of the description unless it is given; loads add to those described. Axial forces of the linear
    static response give the geometric stiffness of members and, as of strings, of piezo stacks; forces on rigid arms,
    of members, springs, loads and weights, add the stiffness that turning these arms takes (theory eqs. P3-P8).

    Raises ModelError; OptionError for unknown nodes and actuators, impossible loads, moved bases and superelements
    between nodes; SolverError when something can move freely under the load.
    """
    given = {node: finite_numbers(f"load on {node}", value, 6) for node, value in (loads or {}).items()}
    model = unloaded(model, parameters)
    described = model.plan.loads
    g = described.gravity(model.values) if gravity is None else finite_numbers("gravity", gravity, 3)
    wrenches = described.wrenches(model.values)
    for node, wrench in given.items():
        wrenches[node] = wrenches.get(node, 0.0) + wrench
    commands = {name: float(value) for name, value in (actuators or {}).items()}
    state = prestress(model, g, wrenches, _drive(model, commands))
    return Preload(model, state.load, state.displacement, state.K_g, state.axial_force, wrenches, commands)


def _count(n: int) -> int:
    """How many buckling factors are asked for. Raises OptionError."""
    if n < 1:
        raise OptionError(f"the number of buckling factors is at least 1, not {n}")
    return n


def _drive(model: FullOrderModel, actuators: Mapping[str, float]) -> Drive:
    """What actuator commands do to a state."""
    ports = Ports(model.design)
    driven = [(port, value) for name, value in actuators.items() for port in ports.inputs([name])]
    if any(port.base is not None or not np.isfinite(value) for port, value in driven):
        raise OptionError("commands are finite numbers of forces, moments and piezo stacks; a base at rest is assumed")
    for port, value in driven:
        if value:
            ports.refuse_stretching(port)
    load = sum((value * port.load for port, value in driven), np.zeros(model.order))
    expansion = {port.channel.name: port.stroke * value for port, value in driven if port.stiffness is not None}
    pushes = [push for port, value in driven if port.stiffness is None for push in _pushes(model, port, value)]
    return Drive(load, tuple(pushes), expansion)


def _pushes(model: FullOrderModel, port: InputPort, force: float) -> Iterator[Pushes]:
    """Rigid arms that a force pushes on."""
    topology, x = model.plan.topology, model.geometry.positions
    for node in port.nodes:
        root = topology.root[node]
        if topology.is_rigid[node] and root != node:
            dof = topology.dof[root]
            yield Pushes.of(dof, -force * np.append(port.row, 0.0)[dof[:3]], x[node] - x[root])
