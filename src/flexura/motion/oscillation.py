"""A moving model as an oscillator about a state of equilibrium, at many instants side by side.

Its coordinates are a vector space: displacements of frames and rotation vectors w from the state, R = exp(w) R0, by
which forces are those of virtual work.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from math import factorial
from typing import Any, TypeVar

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.errors import OptionError
from flexura.linalg import is_definite
from flexura.motion.elements import Frames, Group, PoseElements, Rates, Response
from flexura.motion.equilibrium import Equations, Equilibrium
from flexura.motion.model import Loads, MovingModel
from flexura.motion.newton import Damping
from flexura.motion.posed import Lever
from flexura.motion.superelements import Superelements

T = TypeVar("T")

TERMS = 12
"""Terms of the power series of rotations: 1e-16 up to half a turn."""

AT_ONCE = 4000
"""Instants that are worked out together."""

DIFFERENCE = 1e-5
"""Change of coordinates, m over the size or rad, of differences."""

SMALL_RATE = 1e-4
"""Change of velocities over the largest ones."""

NO_DAMPING = Damping(0.0, 0.0)

_A = np.array([(-1) ** k / factorial(2 * k + 2) for k in range(TERMS)])
_B = np.array([(-1) ** k / factorial(2 * k + 3) for k in range(TERMS)])


def turning(w: Array, rate: Array, second: Array) -> tuple[Array, Array, Array]:
    """Matrices T (..., 3, 3) that make rates of turning T w' of rates of rotation vectors w (..., 3), these rates, and
    their own rates T w'' + T' w' (theory eq. G42)."""
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


def turning_slopes(w: Array, m: Array) -> Array:
    """Derivatives (..., 3, 3) of T' m by rotation vectors w (..., 3), for moments m (..., 3) that stay as they are."""
    W, M = skew(w), skew(m)
    powers = (w * w).sum(axis=-1)[..., None] ** np.arange(TERMS)
    k = np.arange(1, TERMS)
    a, b = (powers @ own for own in (_A, _B))
    slope = powers[..., :-1] @ (k * _A[1:]), powers[..., :-1] @ (k * _B[1:])
    once = (W @ m[..., None])[..., 0]
    twice = (W @ once[..., None])[..., 0]
    grown = slope[1][..., None] * twice - slope[0][..., None] * once
    along = 2 * grown[..., :, None] * w[..., None, :]
    return a[..., None, None] * M - b[..., None, None] * (skew(once) + W @ M) + along


def side_by_side(data: T, count: int) -> T:
    """Arrays of data so many times one after another."""
    if isinstance(data, np.ndarray):
        return np.tile(data, (count, *[1] * (data.ndim - 1)))  # type: ignore[return-value]
    if is_dataclass(data) and not isinstance(data, type):
        return replace(data, **{f.name: side_by_side(getattr(data, f.name), count) for f in fields(data)})
    return data


def _repeated_frames(frames: Frames, count: int) -> Frames:
    x, R, z, placed = (side_by_side(part, count) for part in frames)
    return Frames(x, R, z, placed)  # type: ignore[arg-type]


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
            rest=_repeated_frames(model.rest, count),
            dof=np.tile(model.dof, (count, 1)),
            elements=tuple(map(repeated, model.elements)),
            inertia=side_by_side(model.inertia, count),
            sagging=replace(sagging, node=node, weight=side_by_side(sagging.weight, count)),
            dashpots=tuple(map(repeated, model.dashpots)),
        )
        self.state = _repeated_frames(state, count)


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
    damping: Damping = NO_DAMPING
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
        spread = np.zeros((len(x), *dof.shape))
        spread[:, dof >= 0] = x[:, dof[dof >= 0]]
        return spread

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
        dead, commands = self._loads(drive)
        frames, J, rates = self._moving(q, v, a)
        model, moving = self.equations.model, self._at(len(q)).model
        force = moving.kinetics(frames, rates, self.state.loads.gravity, commands).force
        force -= self._pulled(frames, dead, len(q)).reshape(-1, 6)
        missing = self._by_coordinates(force.reshape(len(q), *model.dof.shape), J)
        return missing if self._dampers is None else missing + self._dampers * v

    def _moving(self, q: Array, v: Array, a: Array) -> tuple[Frames, Array, Rates]:
        """Frames at instants, what (s, t, 3, 3) makes rates of turning of rates of rotation vectors, and the rates."""
        x, rate, second = (self._spread(each @ self.shapes.T) for each in (q, v, a))
        turns = self._turning
        J, omega, turned = turning(x[:, turns, 3:], rate[:, turns, 3:], second[:, turns, 3:])
        rate[:, turns, 3:], second[:, turns, 3:] = omega, turned
        frames = self._at(len(q)).state.moved(x.reshape(-1, 6))
        return (
            frames,
            J,
            Rates(rate.reshape(-1, 6), (second + self.damping.alpha * rate).reshape(-1, 6), self.damping.beta),
        )

    def _pulled(self, frames: Frames, dead: Mapping[int, Array], count: int) -> Array:
        """Dead loads (s, n + 1, 6) on frames."""
        model = self.equations.model
        total = np.zeros((count, *model.dof.shape))
        for node, wrench in dead.items():
            root = int(model.root[node])
            arm = frames.R.reshape(count, -1, 3, 3)[:, root] @ model.arm[node]
            total[:, root] += wrench
            total[:, root, 3:] += np.cross(arm, wrench[:, :3])
        return total

    def _by_coordinates(self, force: Array, J: Array) -> Array:
        """Forces (s, n) by the coordinates from those (s, n + 1, 6) on frames."""
        model, turns = self.equations.model, self._turning
        force[:, turns, 3:] = (force[:, turns, None, 3:] @ J)[:, :, 0]
        out = np.zeros((len(force), model.n_dof))
        free = model.dof >= 0
        out[:, model.dof[free]] = force[:, free]
        return out @ self.shapes

    def _accelerating(self, q: Array, v: Array, a: Array) -> Array:
        """The part of `forces` that accelerates masses, Rayleigh's damping of these included, and what dashpots
        resist."""
        frames, J, rates = self._moving(q, v, a)
        force = self._at(len(q)).model.accelerating(frames, rates)
        return self._by_coordinates(force.reshape(len(q), *self.equations.model.dof.shape), J)

    @cached_property
    def _turning(self) -> Index:
        """Frames that turn."""
        model = self.equations.model
        return np.flatnonzero(model.rest.placed & (model.dof[:, 3:] >= 0).any(axis=1))

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

    def slopes(self, q: Array, v: Array, a: Array, drive: Array, slow: int) -> tuple[Array, Array, Array]:
        """Derivatives (s, n, n) of what is missing by displacements, velocities and accelerations.

        Those of forces at rest are exact, as are those by velocities. What inertia forces and damping change by
        displacements are differences along motions of the first `slow` coordinates that the others follow as in
        statics, by these alone.
        """
        K, viscous, other, M = self._tangents(q, drive)
        follow = -np.linalg.solve(K[:, slow:, slow:], K[:, slow:, :slow])
        T: Array = np.concatenate([np.tile(np.eye(slow), (len(q), 1, 1)), follow.astype(float)], axis=1)
        reach = np.abs(self._spread(self.shapes.T[:slow]) * np.append(np.full(3, 1 / self.equations.size), np.ones(3)))
        step = DIFFERENCE / reach.max(axis=(1, 2))
        fast = (SMALL_RATE * float(np.abs(v[:, :slow] / step).max()) or float(self.frequencies[0])) * step
        a, drive = (np.concatenate([own] * (2 * slow)) for own in (a, drive))

        def changing(q: Array, v: Array) -> Array:
            return self.forces(q, v, a, drive) if self._is_damped_by_place else self._accelerating(q, v, a)

        by_place = _differences(changing, q, v, T, step)
        C = viscous + other
        by_rate = _differences(lambda v, q: changing(q, v), v, q, T, fast)
        if self._is_damped_by_place:
            by_place -= K @ T
        else:
            by_rate += other @ T
        K[..., :slow] += by_place
        C[..., :slow] = by_rate - C[..., slow:] @ T[:, slow:]
        return K, C, M

    @property
    def _is_damped_by_place(self) -> bool:
        """Whether damping by stiffness or of stops changes with displacements."""
        return bool(self.damping.beta) or any(own.damping.any() for own in self.equations.model.stops)

    def _tangents(self, q: Array, drive: Array) -> tuple[Array, Array, Array, Array]:
        """Stiffness (s, n, n) by the coordinates in states, of forces at rest, damping in proportion to masses and by
        dashpots, the other damping, and mass."""
        s, at, model = len(q), self._at(len(q)), self.equations.model
        moving, turns = at.model, self._turning
        frames, J, _ = self._moving(q, np.zeros_like(q), np.zeros_like(q))
        dead, commands = self._loads(drive)
        X = np.tile(self._spread(self.shapes.T).transpose(1, 2, 0), (s, 1, 1, 1))
        X[:, turns, 3:] = J @ X[:, turns, 3:]
        X = X.reshape(-1, *X.shape[2:])
        held = moving.forces(frames, self.state.loads.gravity, commands)
        K, M = (self._summed(blocks, X, s) for blocks in (held.blocks, moving.mass_blocks(frames)))
        x = self._spread(q @ self.shapes.T)
        moments = held.force.reshape(x.shape)[:, turns, 3:] - self._pulled(frames, dead, s)[:, turns, 3:]
        still = self._spread(self.shapes.T)[:, turns, 3:]
        slope = turning_slopes(x[:, turns, 3:], moments) @ still.transpose(1, 2, 0)
        K += still.reshape(len(still), -1) @ slope.reshape(s, -1, len(still))
        for node, wrench in dead.items():
            root = int(model.root[node])
            turned = X.reshape(s, -1, 6, X.shape[-1])[:, root, 3:]
            arm = frames.R.reshape(s, -1, 3, 3)[:, root] @ model.arm[node]
            K -= np.swapaxes(turned, 1, 2) @ (skew(wrench[:, :3]) @ skew(arm) @ turned)
        viscous, other = self.damping.alpha * M, np.zeros_like(M)
        for dashpot in moving.dashpots:
            viscous = viscous + _projected(dashpot.material(frames)[0], X[dashpot.node], s)
        if self.damping.beta:
            blocks = _resisting(moving.commanded(commands), held.responses, frames)
            blocks += [0 * block for block in held.blocks[len(blocks) :]]
            other += self.damping.beta * self._summed(blocks, X, s)
        return K, viscous, other if self._dampers is None else other + np.diag(self._dampers), M

    def _summed(self, blocks: Sequence[Array], X: Array, count: int) -> Array:
        """Blocks in the order of a model's pattern by the coordinates (count, n, n), of which frames have motions X."""
        moving = self._at(count).model
        nodes = [node for group in moving.elements for node in (group.node, *group.coupled)]
        nodes += [moving.sagging.node, np.arange(len(moving.dof))[:, None]]
        return sum((_projected(block, X[node], count) for block, node in zip(blocks, nodes, strict=True)), np.zeros(()))

    def potential(self, q: Array) -> float:
        """Potential energy, J, of coordinates (n,) from the state, by the work along a straight line (Gauss)."""
        points, weights = np.polynomial.legendre.leggauss(6)
        along = (points[:, None] + 1) / 2 * q
        none = np.zeros_like(along)
        return float(weights / 2 @ (self.forces(along, none, none, np.zeros(6)) @ q))


def _projected(blocks: Array, X: Array, count: int) -> Array:
    """The sums X' A X (count, n, n) over elements of each instant, of their blocks (e, 6k, 6k) and X (e, k, 6, n)."""
    e, n = len(blocks), X.shape[-1]
    if not blocks.any():
        return np.zeros((count, n, n))
    X = X.reshape(e, -1, n)
    pushed = (blocks @ X).reshape(count, -1, n)
    return np.swapaxes(X.reshape(count, -1, n), 1, 2) @ pushed


def _differences(of: Callable[[Array, Array], Array], at: Array, other: Array, T: Array, step: Array) -> Array:
    """Derivatives (s, n, m) of what depends on two values (s, n) by one of them along directions T (s, n, m), by
    central differences of steps (m,)."""
    s, n, m = T.shape
    changes = np.moveaxis(T * step, -1, 0)
    changes = np.stack([changes, -changes])
    values = of((at + changes).reshape(-1, n), np.tile(other, (2 * m, 1))).reshape(2, m, s, n)
    return np.moveaxis((values[0] - values[1]) / (2 * step[:, None, None]), 0, -1)


def _resisting(elements: Sequence[Group], responses: Sequence[Response], frames: Frames) -> list[Array]:
    """Derivatives (e, 6k, 6k) by velocities of what elements of unit damping resist, and those of coupled members."""
    blocks = list[Array]()
    for own, response in zip(elements, responses, strict=True):
        if isinstance(own, PoseElements | Superelements):
            energy = own.strain if isinstance(own, PoseElements) else own.energy
            B = own.rows(frames)
            blocks.append(np.swapaxes(B, 1, 2) @ energy.response(own.deformation(frames))[2] @ B)
        else:
            blocks.append(own.material(frames)[0])
        blocks.extend(response.coupled)
    return blocks
