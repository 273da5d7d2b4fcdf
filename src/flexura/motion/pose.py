"""What a mechanism is about a state of equilibrium: stiffness, compliance, modes, buckling, internal forces."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm, skew
from flexura.errors import SolverError
from flexura.linalg import (
    Eigenpairs,
    Factor,
    Matrix,
    critical_factors,
    critical_shapes,
    factorise,
    is_definite,
    next_to,
    scaled,
    unit_scale,
)
from flexura.motion.elements import PoseElements, Rates
from flexura.motion.equilibrium import Equations, Equilibrium
from flexura.motion.layout import MIRRORED
from flexura.motion.model import MovingModel
from flexura.motion.se3 import rotation_vector
from flexura.motion.superelements import Superelements
from flexura.records import Record

SHIFTS = 60
"""Doublings of the shift below the lowest eigenvalue of a state that is unstable."""


class Holding(NamedTuple):
    """The displacements that are `left` (n - d,) where d combinations of all (n,) are held: those at `pivots` (d,) are
    `ratio` (d, n - d) times them."""

    left: Index
    pivots: Index
    ratio: Array

    @staticmethod
    def of(rows: Array, scale: Array) -> Holding:
        """With rows (d, n) held at zero; displacements times `scale` (n,) have one unit."""
        reduced, pivots = rows / scale, np.zeros(len(rows), dtype=np.intp)
        for i in range(len(rows)):
            pivots[i] = pivot = int(np.argmax(np.abs(reduced[i])))
            reduced[i] /= reduced[i, pivot]
            for j in range(len(rows)):
                if j != i:
                    reduced[j] -= reduced[j, pivot] * reduced[i]
        left = np.delete(np.arange(rows.shape[1]), pivots)
        return Holding(left, pivots, -reduced[:, left] * scale[left] / scale[pivots, None])

    def matrix(self, A: Matrix) -> Matrix:
        """A symmetric matrix (n, n) by what is left (n - d, n - d)."""
        ratio = self.ratio if isinstance(A, np.ndarray) else sp.csr_matrix(self.ratio)
        B = A[:, self.left] + A[:, self.pivots] @ ratio
        return B[self.left] + ratio.T @ B[self.pivots]

    def rows(self, G: Array) -> Array:
        """Rows (k, n) by what is left (k, n - d)."""
        return G[:, self.left] + G[:, self.pivots] @ self.ratio

    def motions(self, x: Array) -> Array:
        """All displacements (n, k) of those that are left (n - d, k)."""
        out = np.empty((len(self.left) + len(self.pivots), x.shape[1]))
        out[self.left], out[self.pivots] = x, self.ratio @ x
        return out


@dataclass(frozen=True)
class Pose(Record):
    """A state of equilibrium, with everything that is linear about it.

    Displacements are those of frames, m and rotation vectors, rad, global axes, from the state.
    """

    equations: Equations
    state: Equilibrium

    @cached_property
    def K(self) -> Matrix:
        """Tangent stiffness (n, n) with loads and drives on, N/m, N, N m; symmetric, as `MovingModel.matrix`.

        Of moments about fixed axes the part counts that derives from an energy: half of it turns with what it acts on
        (Argyris, Dunne, Scharpf 1978).
        """
        return self.equations.model.matrix(self.state.tangent.forces.blocks)

    @cached_property
    def M(self) -> Matrix:
        """Mass (n, n), kg, kg m, kg m^2."""
        return self.equations.model.mass(self.state.frames)

    @cached_property
    def holding(self) -> Holding:
        """What is left where the actuators are locked."""
        return Holding.of(self.state.tangent.rows, self.equations.scale)

    def matrices(self, held: bool) -> tuple[Matrix, Matrix]:
        """K and M, with actuators locked or free."""
        return (self.held_K, self.holding.matrix(self.M)) if held else (self.K, self.M)

    @cached_property
    def held_K(self) -> Matrix:
        """K (n - d, n - d) of what is left with actuators locked."""
        return self.holding.matrix(self.K)

    @cached_property
    def _free_factor(self) -> Factor:
        return factorise(self.K)

    @cached_property
    def _held_factor(self) -> Factor:
        return factorise(self.held_K)

    def modes(self, n: int) -> Eigenpairs:
        """The n lowest eigenpairs with actuators free, none missed: values, (rad/s)^2, negative where the state is not
        stable, and vectors (n_dof, n), orthonormal by M."""
        return lowest_of_any(self.K, self.M, min(n, self.K.shape[0]))

    def held_values(self, n: int) -> Array:
        """The n lowest eigenvalues with actuators locked, (rad/s)^2, none missed."""
        K, M = self.matrices(held=True)
        return lowest_of_any(K, M, min(n, K.shape[0]), shapes=False).values

    def rows(self, node: int) -> Array:
        """Displacements (6, n) of a node from the free displacements."""
        model = self.equations.model
        root = int(model.root[node])
        G = rigid_arm(self.state.frames.R[root] @ model.arm[node])
        dof = model.dof[root]
        out = np.zeros((6, model.n_dof), like=G)
        out[:, dof[dof >= 0]] = G[:, dof >= 0]
        return out

    def compliance(self, node: int, held: bool = False) -> Array:
        """Displacements (6, 6) of a node per force and moment on it: m/N, 1/N and 1/(N m).

        Raises SolverError where the state has lost its stiffness.
        """
        C = self.rows(node) @ self.pushed(node, held)
        return (C + C.T) / 2

    def pushed(self, node: int, held: bool = False) -> Array:
        """Free displacements (n, 6) per force and moment on a node. Raises SolverError as `compliance`."""
        G = self.rows(node)
        if not held:
            return self._free_factor.solve(np.ascontiguousarray(G.T))
        return self.held_response(G.T)

    def held_response(self, forces: Array) -> Array:
        """Free displacements (n, k) under forces (n, k) with actuators locked."""
        left = np.ascontiguousarray(self.holding.rows(forces.T).T)
        return self.holding.motions(self._held_factor.solve(left))

    def drive_stiffness(self) -> Array:
        """Derivatives (d,) of the forces of the drives by their own displacements, the others held."""
        return np.diag(self._following[0])

    def following(self, drive: int) -> Array:
        """How the node of a drive moves (6,) per displacement of this drive, the others held (theory eq. G18)."""
        motion = self._following[1][:, drive]
        return np.asarray(self.rows(self.equations.drives[drive].node) @ motion, dtype=float)

    @cached_property
    def _following(self) -> tuple[Array, Array]:
        """Derivatives by the driven displacements of the forces of the drives (d, d), and of all free displacements
        (n, d)."""
        rows = self.state.tangent.rows
        flexible = self._free_factor.solve(np.ascontiguousarray(rows.T))
        stiffness = np.asarray(np.linalg.inv(rows @ flexible), dtype=float)
        return stiffness, flexible @ stiffness

    def inertia_forces(self, velocity: Array, acceleration: Array) -> Array:
        """Forces (n,) that it takes to move everything with velocities and accelerations (n,) of the free
        displacements, dashpots left out (theory eq. G33)."""
        equations, loads = self.equations, self.state.loads

        def held(ahead: float, faster: float) -> Array:
            rates = Rates(
                ahead * equations.displacements(velocity), faster * equations.displacements(acceleration), 0.0
            )
            return equations.model.kinetics(self.state.frames, rates, loads.gravity, loads.actuators).force

        return equations.free((held(1.0, 1.0) + held(-1.0, 1.0)) / 2 - held(0.0, 0.0))

    def displacement(self, node: int) -> Array:
        """Displacement (6,) of a node from rest: m, and its rotation vector, rad."""
        model, frames = self.equations.model, self.state.frames
        root = int(model.root[node])
        grown = model.growth(self.state.loads.actuators)[node]
        moved = frames.x[root] - model.rest.x[root] + (frames.R[root] - np.eye(3)) @ model.arm[node]
        turned = rotation_vector(frames.R[root]) + frames.R[root] @ grown[3:]
        return np.concatenate([moved + frames.R[root] @ grown[:3], turned])


def lowest_of_any(K: Matrix, M: Matrix, n: int, shapes: bool = True) -> Eigenpairs:
    """The n lowest eigenpairs of K x = lambda M x, M positive semidefinite, K of any inertia; as `next_to`.

    Raises SolverError when there is no shift that makes K definite.
    """
    if is_definite(K):
        return next_to(K, M, n, 0.0, shapes=shapes)
    shift = 1e-6 * float(K.diagonal().max()) / max(float(M.diagonal().max()), 1e-300)
    for _ in range(SHIFTS):
        if is_definite(K + shift * M):
            return next_to(K, M, n, -shift, shapes=shapes)
        shift *= 2
    raise SolverError("something without mass is unstable")


LARGEST_FACTOR = 1e6
"""Factors beyond this are round-off: nothing buckles."""

UNLOADED_STIFFNESS = 1e-12
"""Entries of the geometric stiffness, beside a diagonal of ones of the other, that are round-off."""


def buckling_factor(pose: Pose) -> float | None:
    """The factor on all loads and drive forces of a state at which it would buckle with actuators locked, linear from
    the state (theory eqs. G16-G17).

    None where nothing buckles, and where the state has no stiffness of its own without these forces. None at low
    order, whose superelements do not tell these apart.
    """
    parts = _parts(pose)
    if parts is None:
        return None
    try:
        factors = critical_factors(*parts, 1)
    except SolverError:
        return None
    return float(factors[0]) if len(factors) and factors[0] < LARGEST_FACTOR else None


def critical_state(pose: Pose, n: int) -> tuple[Array, Array] | None:
    """The n lowest of these factors (k,), with shapes x (m, k) of what is left with actuators locked, x' K x = 1 of its
    stiffness K without forces; None where `buckling_factor` is. Raises SolverError where shapes are not found."""
    parts = _parts(pose)
    if parts is None or buckling_factor(pose) is None:
        return None
    return critical_shapes(*parts, min(n, parts[0].shape[0]))


def material_at(pose: Pose) -> Matrix:
    """The stiffness (n, n) at a state as if nothing were under force there, actuators free."""
    return pose.equations.model.material(pose.state.frames, pose.state.loads.actuators)


def _parts(pose: Pose) -> tuple[Matrix, Matrix] | None:
    """Stiffness at a state with actuators locked: what is there without forces, and what forces add."""
    groups = pose.equations.model.elements
    if any(isinstance(group, Superelements) and group.energy.cubic.size for group in groups):
        return None
    total, _ = pose.matrices(held=True)
    material = pose.holding.matrix(material_at(pose))
    geometric = total - material
    if not material.shape[0] or abs(scaled(geometric, unit_scale(material))).max() < UNLOADED_STIFFNESS:
        return None
    return material, geometric


Ends = tuple[Array, Array]


def end_forces(model: MovingModel, states: Sequence[Equilibrium]) -> dict[str, Ends]:
    """Internal forces (i, e, 6, k) at the first and the second end of the elements of the i copies of each prototype
    with members in k states (theory eq. G15).

    They are N, Vy, Vz, N, and T, My, Mz, N m, in the axes of the members, which turn with the ends of elements, on the
    face towards the second end of the member.
    """
    if not states or not with_members(model):
        return {}
    elements = model.elements[0]
    assert isinstance(elements, PoseElements)
    return _by_prototype(model, *_in_own_axes(elements, states))


def end_force_changes(model: MovingModel, state: Equilibrium, moved: Array) -> dict[str, Ends]:
    """What small displacements (n + 1, 6, k) of the frames from a state change of `end_forces` (theory eq. G26)."""
    if not with_members(model):
        return {}
    elements, frames = model.elements[0], state.frames
    assert isinstance(elements, PoseElements)
    R = frames.R[elements.node]
    u = moved[elements.node].reshape(len(R), 12, moved.shape[-1])
    # derivatives leave out that forces turn with their frames: what is left is seen from axes that turn along
    held = elements.end_force_changes(state.tangent.forces.responses[0], frames, u).reshape(len(R), 2, 6, u.shape[-1])
    back, arm = np.swapaxes(R @ elements.axes, -1, -2), (R @ elements.arm[..., None])[..., 0]
    moment = held[:, :, 3:] - np.cross(arm[..., None], held[:, :, :3], axis=2)
    changes = np.concatenate([back @ held[:, :, :3], back @ moment], axis=2)
    gravity = state.loads.gravity
    if gravity.any():
        turning = moved[elements.node][:, :, 3:]
        per_fall = elements.mass.reshape(-1, 2, 6, 2, 6)[..., :3].sum(axis=3)
        changes = changes - per_fall @ (back @ skew(gravity) @ turning)
    return _by_prototype(model, -changes[:, 0], changes[:, 1])


def member_force_changes(pose: Pose, moved: Array) -> Array | None:
    """What small displacements (n + 1, 6, k) of the frames from a pose change of the forces (e, 12, k) on the frames of
    members, global axes; None without members."""
    state, model = pose.state, pose.equations.model
    if not with_members(model):
        return None
    elements = model.commanded(state.loads.actuators)[0]
    assert isinstance(elements, PoseElements)
    motions = moved[elements.node].reshape(len(elements.node), 12, -1)
    return elements.held_changes(state.tangent.forces.responses[0], state.frames, motions)


def part_motions(model: MovingModel, states: Sequence[Equilibrium], names: Collection[str]) -> dict[str, Array]:
    """By superelement of some names, displacements and rotations of its nodes as seen from the first, and amplitudes,
    (d, k) in k states, in right-handed axes."""
    return {
        name: np.stack([_motions(model, k, state) for state in states], axis=-1)
        for k, name, _ in _superelements(model, names)
    }


def part_motion_changes(
    model: MovingModel, state: Equilibrium, moved: Array, names: Collection[str]
) -> dict[str, Array]:
    """What small displacements (n + 1, 6, k) of the frames from a state change of `part_motions`."""
    return {
        name: group.motion_changes(state.frames, model.rest, moved[group.node].reshape(1, -1, moved.shape[-1]))[0]
        for _, name, group in _superelements(model, names)
    }


def _motions(model: MovingModel, number: int, state: Equilibrium) -> Array:
    """How one superelement is deformed (d,), beyond what it expands freely."""
    group: Any = model.commanded(state.loads.actuators)[number]
    return group.motions(state.frames, model.rest)[0]


def _superelements(model: MovingModel, names: Collection[str]) -> Iterator[tuple[int, str, Superelements]]:
    """Those of some names, with their numbers."""
    for k, (group, (name, *_)) in enumerate(zip(model.elements, model.names, strict=True)):
        if name in names and isinstance(group, Superelements):
            yield k, name, group


def with_members(model: MovingModel) -> list[str]:
    """Names of the prototypes that have members."""
    parts = model.design.plan.parts
    return [name for name in model.design.matrices if len(parts[name].connectivity)]


def _by_prototype(model: MovingModel, start: Array, end: Array) -> dict[str, Ends]:
    """Forces (e, 6, k) at both ends of all elements, in right-handed axes, as those of the copies of prototypes."""
    topology, parts = model.design.plan.topology, model.design.plan.parts
    forces, first = {}, 0
    for name in with_members(model):
        placed, count = topology.copies[name], len(parts[name].connectivity)
        rows = slice(first, first + len(placed.paths) * count)
        mirrored = np.linalg.det(model.design.geometry.Q[placed.number]) < 0
        sign = np.where(mirrored[:, None], MIRRORED, 1.0)[:, None, :, None]
        shape = (len(placed.paths), count, 6, start.shape[-1])
        forces[name] = (sign * start[rows].reshape(shape), sign * end[rows].reshape(shape))
        first = rows.stop
    return forces


def _in_own_axes(elements: PoseElements, states: Sequence[Equilibrium]) -> tuple[Array, Array]:
    """Internal forces (e, 6, k) at both ends of elements, in the right-handed axes of these ends."""
    R = np.stack([state.frames.R[elements.node] for state in states])
    held = np.stack([state.held for state in states]).reshape(len(states), -1, 2, 6)
    arm = (R @ elements.arm[..., None])[..., 0]
    back = np.swapaxes(R @ elements.axes, -1, -2)
    moment = held[..., 3:] - np.cross(arm, held[..., :3])
    forces = np.concatenate([(back @ part[..., None])[..., 0] for part in (held[..., :3], moment)], axis=-1)
    gravity = np.stack([state.loads.gravity for state in states])[:, None, None, :, None]
    if gravity.any():
        per_fall = elements.mass.reshape(-1, 2, 6, 2, 6)[..., :3].sum(axis=3)
        forces = forces - (per_fall @ (back @ gravity))[..., 0]
    start, end = np.swapaxes(np.moveaxis(forces, 0, -1), 0, 1)
    return -start, end
