"""A moving model as an oscillator about a state of equilibrium, at many instants side by side.

Its coordinates are a vector space: displacements of frames and rotation vectors w from the state, R = exp(w) R0, by
which forces are those of virtual work.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from math import factorial
from typing import Any, TypeVar

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array
from flexura.beam import skew
from flexura.errors import OptionError
from flexura.linalg import is_definite
from flexura.motion.elements import Frames, Rates
from flexura.motion.equilibrium import Equations, Equilibrium
from flexura.motion.integration import Damping
from flexura.motion.model import Loads, MovingModel
from flexura.motion.posed import Lever

T = TypeVar("T")

TERMS = 12
"""Terms of the power series of rotations: 1e-16 up to half a turn."""

AT_ONCE = 4000
"""Instants that are worked out together."""

DIFFERENCE = 1e-4
"""Change of coordinates, m over the size or rad, and of rates likewise over those of the fastest, of differences."""

_A = np.array([(-1) ** k / factorial(2 * k + 2) for k in range(TERMS)])
_B = np.array([(-1) ** k / factorial(2 * k + 3) for k in range(TERMS)])


def turning(w: Array, rate: Array, second: Array) -> tuple[Array, Array, Array]:
    """Matrices T (..., 3, 3) that make rates of turning T w' of rates of rotation vectors w (..., 3), these rates, and
    their own rates T w'' + T' w' (theory eq. G41)."""
    W, V = skew(w), skew(rate)
    y = (w * w).sum(axis=-1)
    powers = y[..., None] ** np.arange(TERMS)
    a, b = powers @ _A, powers @ _B
    k = np.arange(1, TERMS)
    slope = powers[..., :-1] @ (k * _A[1:]), powers[..., :-1] @ (k * _B[1:])
    grown = 2 * (w * rate).sum(axis=-1)
    J = np.eye(3) + a[..., None, None] * W + b[..., None, None] * (W @ W)
    across = (W @ rate[..., None])[..., 0]
    twice = (W @ across[..., None])[..., 0]
    more = (grown * slope[0])[..., None] * across + (grown * slope[1])[..., None] * twice
    more += b[..., None] * (V @ across[..., None])[..., 0]
    return J, (J @ rate[..., None])[..., 0], (J @ second[..., None])[..., 0] + more


def side_by_side(data: T, count: int) -> T:
    """Arrays of data so many times one after another."""
    if isinstance(data, np.ndarray):
        return np.tile(data, (count, *[1] * (data.ndim - 1)))  # type: ignore[return-value]
    if is_dataclass(data) and not isinstance(data, type):
        return replace(data, **{f.name: side_by_side(getattr(data, f.name), count) for f in fields(data)})
    return data


class _Instants:
    """So many copies of a model, each at an instant of its own."""

    def __init__(self, model: MovingModel, state: Frames, count: int) -> None:
        n = len(model.dof)

        def repeated(group: Any) -> Any:
            tiled = side_by_side(group, count)
            return replace(tiled, node=tiled.node + n * np.repeat(np.arange(count), len(group.node))[:, None])

        sagging = model.sagging
        node = np.tile(sagging.node, (count, 1)) + n * np.repeat(np.arange(count), len(sagging.node))[:, None]
        self.model = replace(
            model,
            rest=Frames(*(side_by_side(part, count) for part in model.rest)),
            dof=np.tile(model.dof, (count, 1)),
            elements=tuple(map(repeated, model.elements)),
            inertia=side_by_side(model.inertia, count),
            weight=side_by_side(model.weight, count),
            sagging=replace(sagging, node=node, weight=side_by_side(sagging.weight, count)),
            dashpots=tuple(map(repeated, model.dashpots)),
        )
        self.state = Frames(*(side_by_side(part, count) for part in state))


@dataclass(frozen=True)
class Oscillation:
    """A model about a state of equilibrium, in combinations of its displacements of unit stiffness.

    `levers` are what is driven, with the `amounts` at share one; `damping` is Rayleigh's, and `modal` (n,) are further
    damping ratios of its modes. Raises OptionError where the state is not stable.
    """

    equations: Equations
    state: Equilibrium
    levers: Sequence[Lever] = ()
    amounts: Sequence[float] = ()
    damping: Damping = Damping(0.0, 0.0)
    modal: Array | None = None

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        model = self.equations.model
        K = model.matrix(self.state.tangent.forces.blocks)
        M = model.mass(self.state.frames)
        K, M = (A if isinstance(A, np.ndarray) else A.toarray() for A in (K, M))
        if not is_definite(K):
            raise OptionError("the state about which it is to oscillate is not stable, or free to move")
        d = 1 / np.sqrt(K.diagonal())
        values, vectors = la.eigh(d[:, None] * M * d, d[:, None] * K * d)
        order = np.argsort(-values)
        with np.errstate(divide="ignore"):
            return 1 / np.sqrt(np.maximum(values[order], 0.0)), d[:, None] * vectors[:, order]

    @property
    def frequencies(self) -> Array:
        """Natural frequencies (n,), rad/s, ascending; infinite without mass."""
        return self._modes[0]

    @property
    def shapes(self) -> Array:
        """Displacements (n, n) by the coordinates, the modes with unit stiffness."""
        return self._modes[1]

    @cached_property
    def _dampers(self) -> Array | None:
        """Damping of coordinates, whose stiffness is one, by ratios."""
        return None if self.modal is None else 2 * self.modal / self.frequencies

    def frames(self, q: Array) -> Frames:
        """Frames (s (n + 1),) one instant after another, of coordinates (s, n)."""
        return self._at(len(q)).state.moved(self._spread(q @ self.shapes.T).reshape(-1, 6))

    def _spread(self, x: Array) -> Array:
        """Displacements (s, n + 1, 6) of all frames from free ones (s, n)."""
        dof = self.equations.model.dof
        return np.where(dof >= 0, x[:, np.maximum(dof, 0)], 0.0)

    @cached_property
    def _copies(self) -> dict[int, _Instants]:
        return {}

    def _at(self, count: int) -> _Instants:
        if count not in self._copies:
            self._copies[count] = _Instants(self.equations.model, self.state.frames, count)
        return self._copies[count]

    def forces(self, q: Array, v: Array, a: Array, drive: Array) -> Array:
        """What is missing (s, n) for motions at instants (s,): forces that hold, damp and accelerate less loads."""
        parts = [slice(k, k + AT_ONCE) for k in range(0, len(q), AT_ONCE)]
        return np.concatenate([self._forces(q[own], v[own], a[own], drive[own]) for own in parts])

    def _forces(self, q: Array, v: Array, a: Array, drive: Array) -> Array:
        at, model, shapes = self._at(len(q)), self.equations.model, self.shapes
        x, rate, second = (self._spread(each @ shapes.T) for each in (q, v, a))
        placed = np.broadcast_to(model.rest.placed, x.shape[:2])
        J, omega, turned = turning(x[placed, 3:], rate[placed, 3:], second[placed, 3:])
        rate[placed, 3:], second[placed, 3:] = omega, turned
        frames = at.state.moved(x.reshape(-1, 6))
        rates = Rates(rate.reshape(-1, 6), (second + self.damping.alpha * rate).reshape(-1, 6), self.damping.beta)
        dead, commands = self._loads(drive)
        force = at.model.kinetics(frames, rates, self.state.loads.gravity, commands).force.reshape(x.shape)
        for node, wrench in dead.items():
            root = int(model.root[node])
            arm = frames.R.reshape(*x.shape[:2], 3, 3)[:, root] @ model.arm[node]
            force[:, root, :3] -= wrench[:, :3]
            force[:, root, 3:] -= wrench[:, 3:] + np.cross(arm, wrench[:, :3])
        force[placed, 3:] = (force[placed, None, 3:] @ J)[:, 0]
        missing = np.zeros((len(q), model.n_dof))
        free = model.dof >= 0
        missing[:, model.dof[free]] = force[:, free]
        missing = missing @ shapes
        return missing if self._dampers is None else missing + self._dampers * v

    def _loads(self, drive: Array) -> tuple[dict[int, Array], Mapping[str, Any]]:
        """Dead loads (s, 6) by node and commands (s,) by actuator, under shares (s,) of what is driven."""
        loads: Loads = self.state.loads
        dead = {node: np.tile(wrench, (len(drive), 1)) for node, wrench in loads.dead.items()}
        commands: dict[str, Any] = {name: np.full(len(drive), value) for name, value in loads.actuators.items()}
        for lever, amount in zip(self.levers, self.amounts, strict=True):
            own = np.multiply.outer(amount * drive, lever.unit)
            if lever.node is None:
                commands[lever.name] = commands.get(lever.name, 0.0) + own
            else:
                dead[lever.node] = dead.get(lever.node, 0.0) + own
        return dead, commands

    def slopes(self, q: Array, v: Array, a: Array, drive: Array) -> tuple[Array, Array, Array]:
        """Derivatives (s, n, n) of what is missing by displacements, velocities and accelerations: central differences,
        exact but for the first ones."""
        s, n = q.shape
        reach = np.abs(self._spread(self.shapes.T) * np.append(np.full(3, 1 / self.equations.size), np.ones(3)))
        step = DIFFERENCE / reach.max(axis=(1, 2))
        fast = np.abs(v / step).max(initial=0.0), np.abs(a / step).max(initial=0.0)
        found = []
        for k, by in enumerate((np.ones(n), *(np.full(n, max(each, 1.0)) for each in fast))):
            size = step * by
            moved = [np.repeat(each[None], 2 * n, axis=0) for each in (q, v, a)]
            moved[k] = moved[k] + np.concatenate([np.diag(size), -np.diag(size)])[:, None]
            values = self.forces(*(each.reshape(-1, n) for each in moved), np.tile(drive, 2 * n))
            more, less = values.reshape(2, n, s, n)
            found.append(np.moveaxis((more - less) / (2 * size[:, None, None]), 0, -1))
        return found[0], found[1], found[2]

    def potential(self, q: Array) -> float:
        """Potential energy, J, of coordinates (n,) from the state, by the work along a straight line (Gauss)."""
        points, weights = np.polynomial.legendre.leggauss(6)
        along = (points[:, None] + 1) / 2 * q
        none = np.zeros_like(along)
        return float(weights / 2 @ (self.forces(along, none, none, np.zeros(6)) @ q))
