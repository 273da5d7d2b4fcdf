"""Elements between turning frames: forces, tangents and masses from the relative pose of their ends.

A frame has a position x and a rotation R, the identity at rest. Displacements of a frame are dx, m, and the rotation
vector dw, rad, both in global axes: R becomes rotation(dw) R. No element has axes of its own that turn: its strain
is the logarithm of the pose of end 2 seen from end 1, so that moving and turning everything changes nothing, the
order of the ends does not matter, and an element bent to an arc or wound to a helix is exact.

Sources: Borri, Bottasso (1994), Int. J. Numer. Meth. Engng 37 (helicoidal strain); Sonneville, Cardona, Bruls (2014).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.duals import zeros
from flexura.kernels import Kernel, Struct, is_compiled
from flexura.motion.lanes import abreast, are_plain, upper, whole
from flexura.motion.se3 import SERIES, Logarithm, rotation
from flexura.motion.strain import Strain

_moved = Kernel("frames_moved", "naaaaaa")
_response = Kernel("pose_elements_response", "aaanaaaaa")
_masses = Kernel("pose_elements_masses", "aaaaa")
_kinetics = Kernel("pose_elements_kinetics", "aaaaaxaaa")

HALVES = np.array([0.5, 0.5])


class Frames(NamedTuple):
    """Positions x (n, 3), m, and rotations R (n, 3, 3) of frames that are `placed` (n,).

    The others stand for amplitudes z (n, 6) of superelements, and neither move nor turn.
    """

    x: Array
    R: Array
    z: Array
    placed: NDArray[np.bool_]

    @staticmethod
    def at_rest(x: Array, placed: NDArray[np.bool_]) -> Frames:
        """Frames at x (n, 3), m, that have not turned."""
        return Frames(x, np.tile(np.eye(3), (len(x), 1, 1)), np.zeros((len(x), 6)), placed)

    def copy(self) -> Frames:
        """The same ones, to be moved."""
        return Frames(self.x.copy(), self.R.copy(), self.z.copy(), self.placed)

    def moved(self, step: Array) -> Frames:
        """After displacements (n, 6)."""
        if is_compiled() and are_plain(step, self.x, self.R, self.z):
            made = self.copy()
            _moved(len(step), 0, self.placed, step, *made[:3])
            return made
        x, R, z = self.x.copy(), self.R.copy(), self.z
        moving = np.flatnonzero(step.any(axis=1) & self.placed)
        x[moving] += step[moving, :3]
        R[moving] = rotation(step[moving, 3:]) @ R[moving]
        if not self.placed.all():
            z = z + np.where(self.placed[:, None], 0.0, step)
        return Frames(x, R, z, self.placed)


class Ends(NamedTuple):
    """Where the ends of elements are: axes (e, 2, 3, 3) as columns, arms from their frames (e, 2, 3) and their
    positions (e, 2, 3), m, global."""

    axes: Array
    arm: Array
    position: Array

    @staticmethod
    def of(frames: Frames, node: Index, axes: Array, arm: Array) -> Ends:
        """Ends with `axes` and `arm` as their frames carry them."""
        R = frames.R[node]
        turned = (R @ arm[..., None])[..., 0]
        return Ends(R @ axes, turned, frames.x[node] + turned)

    def relative(self) -> Logarithm:
        """The pose of end 2 seen from end 1."""
        back = np.swapaxes(self.axes[:, 0], -1, -2)
        apart = self.position[:, 1] - self.position[:, 0]
        return Logarithm(back @ self.axes[:, 1], (back @ apart[..., None])[..., 0])

    def twists(self, axes: Array | None = None) -> Array:
        """Matrices (e, 2, 6, 6) that make twists of the ends, in their own `axes`, of displacements of the frames."""
        back = np.swapaxes(self.axes if axes is None else axes, -1, -2)
        out = zeros((*back.shape[:-2], 6, 6), back, self.arm)
        out[..., :3, :3] = out[..., 3:, 3:] = back
        out[..., :3, 3:] = -back @ skew(self.arm)
        return out


class Response(NamedTuple):
    """Energy (e,), N m, of elements, forces (e, 6k) on their k frames that hold them in their state, and derivatives
    (e, 6k, 6k) of these by displacements of the frames.

    The derivatives leave out that forces turn with the frames they are in; `turned` adds it, frame by frame. `coupled`
    are those by all frames of members that a group couples.
    """

    energy: Array
    force: Array
    tangent: Array
    coupled: tuple[Array, ...] = ()


class Rates(NamedTuple):
    """Velocities and accelerations (n + 1, 6) of all frames, m/s and rad/s, m/s^2 and rad/s^2, global axes, and the
    time, s, by which stiffness is multiplied for damping."""

    velocity: Array
    acceleration: Array
    damping: float


class Kinetics(NamedTuple):
    """Forces (e, 6k) on the frames of elements that hold and accelerate them, N and N m, and their strain energy and
    kinetic energy, N m, all elements together."""

    force: Array
    strain: float
    kinetic: float


class Group(Protocol):
    """Elements (e,) of one kind between frames `node` (e, k)."""

    @property
    def node(self) -> Index:
        """The frames (e, k)."""
        ...

    @property
    def coupled(self) -> tuple[Index, ...]:
        """Frames (m, k) of members that are coupled by more than their elements."""
        ...

    def response(self, frames: Frames) -> Response:
        """Energies, forces and tangents in a state of the frames."""
        ...

    def material(self, frames: Frames) -> tuple[Array, ...]:
        """Derivatives (e, 6k, 6k) of the forces in a state, as if there were none in it (theory eq. G16), and those of
        the members that are `coupled`."""
        ...

    def masses(self, frames: Frames) -> Array:
        """Mass matrices (e, 6k, 6k) by velocities of the frames."""
        ...

    def kinetics(self, frames: Frames, rates: Rates) -> Kinetics:
        """What holds, damps and accelerates them in a state of motion (theory eqs. G33-G34)."""
        ...


@dataclass(frozen=True)
class PoseElements:
    """Elements (e,) between frames `node` (e, 2).

    `axes` (e, 2, 3, 3) holds the axes of the ends as columns, `arm` (e, 2, 3), m, leads to them, both as seen from
    their frames. `rest` (e, 6) is the logarithm of the relative pose without strain. `mass` (e, 12, 12) acts on the
    velocities of the ends in the axes of the element, halfway between those of its ends.
    """

    node: Index
    axes: Array
    arm: Array
    rest: Array
    strain: Strain
    mass: Array

    def driven(self, command: float | Array) -> PoseElements:
        """With free expansions along the first axis, m."""
        return replace(self, rest=self.rest + np.reshape(command, (-1, 1)) * np.eye(6)[0])

    @cached_property
    def struct(self) -> Struct:
        """As kernels take them."""
        parts = [abreast(part) for part in (self.axes, self.arm)]
        mass, rest = abreast(upper(self.mass)), np.ascontiguousarray(self.rest, dtype=float)
        return Struct(len(self.node), whole(self.node), *parts, rest, mass, SERIES, self.strain.struct)

    @cached_property
    def is_plain(self) -> bool:
        """Whether nothing of them has slopes."""
        return are_plain(self.axes, self.arm, self.rest, self.mass) and self.strain.is_plain

    @property
    def memory(self) -> int:
        """Numbers of scratch that kernels need."""
        return self.strain.memory

    def _by_kernel(self, frames: Frames) -> bool:
        """Whether kernels answer in a state."""
        return is_compiled() and self.is_plain and are_plain(frames.x, frames.R)

    def _answered(self, frames: Frames, is_material: bool) -> Response:
        """The `response` of the kernel, or the `material` for its tangents."""
        e = len(self.node)
        sizes = [(len(rows), *(6 * rows.shape[1] + 6,) * 2) for rows in self.strain.members]
        made = np.empty(e), np.empty((e, 12)), np.empty((e, 12, 12))
        coupled = np.empty(sum(math.prod(size) for size in sizes))
        scratch = np.empty(self.memory)
        _response(self.struct.address, frames.x, frames.R, is_material, scratch, *made, coupled)
        ends = np.cumsum([math.prod(size) for size in sizes])
        return Response(
            *made, tuple(coupled[:end][-math.prod(n) :].reshape(n) for end, n in zip(ends, sizes, strict=True))
        )

    def ends(self, frames: Frames) -> Ends:
        """Where the ends are."""
        return Ends.of(frames, self.node, self.axes, self.arm)

    def response(self, frames: Frames) -> Response:
        """Energies, forces and tangents in a state of the frames (theory eq. G7)."""
        if self._by_kernel(frames):
            return self._answered(frames, is_material=False)
        ends = self.ends(frames)
        log, twists = ends.relative(), ends.twists()
        energy, n, k, coupling = self.strain.response(log.e - self.rest)
        B = _rows(log, twists)
        before, after = log.second(n)
        turned = np.swapaxes(B, 1, 2)
        K = turned @ k
        K[:, :6] -= np.swapaxes(twists[:, 0], 1, 2) @ before
        K[:, 6:] += np.swapaxes(twists[:, 1], 1, 2) @ after
        return Response(energy, (turned @ n[..., None])[..., 0], K @ B, self._coupled(B, coupling))

    def held(self, frames: Frames) -> Array:
        """The forces (e, 12) of `response` alone."""
        if self._by_kernel(frames):
            return self._answered(frames, is_material=False).force
        ends = self.ends(frames)
        log = ends.relative()
        n = self.strain.force(log.e - self.rest)
        return (np.swapaxes(_rows(log, ends.twists()), 1, 2) @ n[..., None])[..., 0]

    @property
    def coupled(self) -> tuple[Index, ...]:
        """Frames (m, n + 1) of members with n elements that warp together."""
        return tuple(
            np.concatenate([self.node[rows[:, :1], 0], self.node[rows, 1]], axis=1) for rows in self.strain.members
        )

    def _coupled(self, B: Array, coupling: Sequence[Array]) -> tuple[Array, ...]:
        """Derivatives by all frames of `coupled` members from those by the deformations of their elements."""
        blocks = []
        for rows, own in zip(self.strain.members, coupling, strict=True):
            m, n = rows.shape
            T = np.zeros((m, 6 * n, 6 * n + 6), like=B)
            for i in range(n):
                T[:, 6 * i : 6 * i + 6, 6 * i : 6 * i + 12] = B[rows[:, i]]
            blocks.append(np.swapaxes(T, 1, 2) @ own @ T)
        return tuple(blocks)

    def end_force_changes(self, response: Response, frames: Frames, motions: Array) -> Array:
        """What small displacements (e, 12, k) of the frames change of the forces of a response, each element's own
        (e, 12, k), which turn with the frames."""
        B, (*_, coupling) = self.rows(frames), self.strain.response(self.deformation(frames))
        pushed = self.strain.pushed(np.zeros((len(B), 6, 6)), coupling, B @ motions)
        return response.tangent @ motions + np.swapaxes(B, 1, 2) @ pushed

    def held_changes(self, response: Response, frames: Frames, motions: Array) -> Array:
        """The same, in global axes."""
        turning = turned(response.force.reshape(-1, 6)) @ motions.reshape(2 * len(motions), 6, -1)
        return self.end_force_changes(response, frames, motions) + turning.reshape(motions.shape)

    def refinement_energy(self, frames: Frames, motions: Array) -> Array:
        """Twice the energies (e, k), N m, that finer elements would take off small displacements (e, 12, k) of the
        frames in a state, estimated (theory eq. G27)."""
        ends = self.ends(frames)
        log = ends.relative()
        return self.strain.refinement_energy(log.e - self.rest, _rows(log, ends.twists()) @ motions)

    def material(self, frames: Frames) -> tuple[Array, ...]:
        """Derivatives (e, 12, 12) of the forces in a state, as if there were none in it (theory eq. G16), and those of
        `coupled` members."""
        if self._by_kernel(frames):
            answer = self._answered(frames, is_material=True)
            return (answer.tangent, *answer.coupled)
        B, (k, coupling) = self.rows(frames), self.strain.material(self.deformation(frames))
        return (np.swapaxes(B, 1, 2) @ k @ B, *self._coupled(B, coupling))

    def works(self, frames: Frames, motions: Array) -> Array:
        """Energies (e, 6, k), J, by the components of the deformation, of small displacements (e, 12, k) of the frames,
        but for what forces add."""
        d = self.rows(frames) @ motions
        return d * self.strain.pushed(*self.strain.material(self.deformation(frames)), d) / 2

    @property
    def are_beams(self) -> bool:
        """Whether anything moves inside them."""
        return self.strain.curvature.shape[-1] > 6

    def turns(self, frames: Frames) -> Array:
        """Rotations (e,), rad, between their ends."""
        return np.linalg.norm(self.ends(frames).relative().e[:, 3:], axis=1)

    def deformation(self, frames: Frames) -> Array:
        """Changes d (e, 6) of the logarithms of the relative poses (theory eq. G3)."""
        return self.ends(frames).relative().e - self.rest

    def rows(self, frames: Frames) -> Array:
        """Derivatives (e, 6, 12) of the deformations d by displacements of the frames (theory eq. G4)."""
        ends = self.ends(frames)
        return _rows(ends.relative(), ends.twists())

    def masses(self, frames: Frames) -> Array:
        """Mass matrices (e, 12, 12) by velocities of the frames."""
        if self._by_kernel(frames):
            M = np.empty((len(self.node), 12, 12))
            _masses(self.struct.address, frames.x, frames.R, np.empty(self.memory), M)
            return M
        ends = self.ends(frames)
        middle = _middle(ends, ends.relative())
        return carried(self.mass, ends.twists(np.stack([middle, middle], axis=1)))

    def kinetics(self, frames: Frames, rates: Rates) -> Kinetics:
        """What holds, damps and accelerates them in a state of motion (theory eqs. G33-G34)."""
        if self._by_kernel(frames):
            force, energies = np.empty((len(self.node), 12)), np.empty(2)
            moving, scratch = (rates.velocity, rates.acceleration, rates.damping), np.empty(self.memory)
            _kinetics(self.struct.address, frames.x, frames.R, *moving, scratch, force, energies)
            return Kinetics(force, float(energies[0]), float(energies[1]))
        ends = self.ends(frames)
        log, e = ends.relative(), len(self.node)
        velocity = rates.velocity[self.node]
        energy, n, k, coupling = self.strain.response(log.e - self.rest)
        B = _rows(log, ends.twists())
        if rates.damping:
            n = n + rates.damping * self.strain.pushed(k, coupling, B @ velocity.reshape(e, 12, 1))[..., 0]
        held = (n[:, None] @ B)[:, 0]
        acceleration = rates.acceleration[self.node]
        inertial, kinetic = accelerating(self.mass, _middle(ends, log), ends.arm, HALVES, velocity, acceleration)
        return Kinetics(held + inertial, float(energy.sum()), kinetic)


def _middle(ends: Ends, log: Logarithm) -> Array:
    """Axes (e, 3, 3) halfway between those of the ends."""
    return ends.axes[:, 0] @ rotation(log.e[:, 3:] / 2)


def carried(mass: Array, twists: Array) -> Array:
    """Mass matrices (e, 12, 12) by velocities of the frames, from those by twists (e, 2, 6, 6) of the ends."""
    ends = np.swapaxes(mass.reshape(-1, 2, 6, 2, 6), 2, 3)
    blocks = np.swapaxes(twists, -1, -2)[:, :, None] @ ends @ twists[:, None]
    return np.swapaxes(blocks, 2, 3).reshape(-1, 12, 12)


def _rows(log: Logarithm, twists: Array) -> Array:
    """Derivatives (e, 6, 12) of the logarithm by displacements of the frames (theory eq. G4)."""
    B = np.empty((len(twists), 6, 12), like=twists)
    B[..., :6] = -log.before @ twists[:, 0]
    B[..., 6:] = log.after @ twists[:, 1]
    return B


def turned(force: Array) -> Array:
    """Derivatives (n, 6, 6) by the rotations of frames of forces (n, 6) in them that turn along (theory eq. G7)."""
    out = np.zeros((len(force), 6, 6), like=force)
    out[:, :3, 3:] = -skew(force[:, :3])
    out[:, 3:, 3:] = -skew(force[:, 3:])
    return out


_FIRST = np.eye(3)[:, [1, 2, 0, 2, 0, 1]]
_SECOND = np.eye(3)[:, [2, 0, 1, 1, 2, 0]]
"""Components whose products are those of a vector product, those that count negative last."""


def accelerating(
    mass: Array, axes: Array, arm: Array, turning: Array, velocity: Array, acceleration: Array
) -> tuple[Array, float]:
    """Forces (e, 6k) on frames that accelerate masses (e, 6k, 6k), and their kinetic energy, N m.

    Masses act on the velocities of ends at arms (e, p, 3), m, global axes, from the first p of the k frames, and of the
    amplitudes in the others, in `axes` (e, 3, 3), whose rate of turning is that of the ends by weights `turning` (p,).
    `velocity` and `acceleration` (e, k, 6) are those of the frames, global axes. These are Lagrange's equations for
    velocities that are no derivatives (theory eq. G33).
    """
    e, k = velocity.shape[:2]
    p = arm.shape[1]
    rate = velocity[:, :p, 3:]
    mean = (turning @ rate)[:, None, None]
    rates = np.stack([velocity, acceleration], axis=1).reshape(e, 2, k, 2, 3)
    v, a = rates[:, 0, :p], rates[:, 1, :p]
    swing = products(rate, arm)
    v[:, :, 0] += swing
    a[:, :, 0] += products(rate, swing) + products(acceleration[:, :p, 3:], arm)
    a -= products(mean, v)
    moved = v.copy()
    rates[:, :, :p] = (rates[:, :, :p].reshape(e, -1, 3) @ axes).reshape(e, 2, p, 2, 3)
    forces = (rates.reshape(e, 2, 6 * k) @ np.swapaxes(mass, 1, 2)).reshape(e, 2, k, 2, 3)
    kinetic = 0.5 * float(np.vdot(forces[:, 0], rates[:, 0]))
    back = np.swapaxes(axes, 1, 2)
    if p < k:
        forces[:, :, :p] = (forces[:, :, :p].reshape(e, -1, 3) @ back).reshape(e, 2, p, 2, 3)
    else:
        forces = (forces.reshape(e, -1, 3) @ back).reshape(e, 2, k, 2, 3)
    momentum, force = forces[:, 0, :p], forces[:, 1]
    force[:, :p] += products(mean, momentum)
    turned = products(momentum, moved)
    force[:, :p, 1] += turned[:, :, 1] - turning[:, None] * turned.sum(axis=(1, 2))[:, None]
    force[:, :p, 1] += products(arm, force[:, :p, 0])
    return force.reshape(e, 6 * k), kinetic


def accelerating_bodies(inertia: Array, R: Array, velocity: Array, acceleration: Array) -> tuple[Array, float]:
    """Forces (e, 6) on frames with rotations R (e, 3, 3) that accelerate what they carry, `inertia` (e, 6, 6) in their
    own axes, and its kinetic energy, N m (theory eq. G33)."""
    v, a = velocity.reshape(-1, 2, 3), acceleration.reshape(-1, 2, 3)
    w = v[:, 1:]
    rates = np.concatenate([v, a - products(w, v)], axis=1) @ R
    own = rates.reshape(-1, 2, 6) @ np.swapaxes(inertia, 1, 2)
    kinetic = 0.5 * float(np.vdot(own[:, 0], rates[:, :2]))
    forces = own.reshape(-1, 4, 3) @ np.swapaxes(R, 1, 2)
    momentum = forces[:, :2]
    force = forces[:, 2:] + products(w, momentum)
    force[:, 1] += products(v[:, 0], momentum[:, 0])
    return force.reshape(-1, 6), kinetic


def products(a: Array, b: Array) -> Array:
    """Vector products along the last axis, quicker than those of NumPy where there are few."""
    both = (a @ _FIRST) * (b @ _SECOND)
    return both[..., :3] - both[..., 3:]
