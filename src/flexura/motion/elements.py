"""Elements between turning frames: forces, tangents and masses from the relative pose of their ends.

A frame has a position x and a rotation R, the identity at rest. Displacements of a frame are dx, m, and the rotation
vector dw, rad, both in global axes: R becomes rotation(dw) R. No element has axes of its own that turn: its strain
is the logarithm of the pose of end 2 seen from end 1, so that moving and turning everything changes nothing, the
order of the ends does not matter, and an element bent to an arc or wound to a helix is exact. Beside beams and springs
there are bars that are pinned at both ends, and actuators that push between two frames.

Sources: Borri, Bottasso (1994), Int. J. Numer. Meth. Engng 37 (helicoidal strain); Sonneville, Cardona, Bruls (2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.duals import zeros
from flexura.motion.se3 import Logarithm, rotation
from flexura.motion.strain import Strain

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

    def moved(self, step: Array) -> Frames:
        """After displacements (n, 6)."""
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

    def ends(self, frames: Frames) -> Ends:
        """Where the ends are."""
        return Ends.of(frames, self.node, self.axes, self.arm)

    def response(self, frames: Frames) -> Response:
        """Energies, forces and tangents in a state of the frames (theory eq. G7)."""
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

    def refinement_energy(self, frames: Frames, motions: Array) -> Array:
        """Twice the energies (e, k), N m, that finer elements would take off small displacements (e, 12, k) of the
        frames in a state, estimated (theory eq. G27)."""
        ends = self.ends(frames)
        log = ends.relative()
        return self.strain.refinement_energy(log.e - self.rest, _rows(log, ends.twists()) @ motions)

    def material(self, frames: Frames) -> tuple[Array, ...]:
        """Derivatives (e, 12, 12) of the forces in a state, as if there were none in it (theory eq. G16), and those of
        `coupled` members."""
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
        ends = self.ends(frames)
        middle = _middle(ends, ends.relative())
        return carried(self.mass, ends.twists(np.stack([middle, middle], axis=1)))

    def kinetics(self, frames: Frames, rates: Rates) -> Kinetics:
        """What holds, damps and accelerates them in a state of motion (theory eqs. G33-G34)."""
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


@dataclass(frozen=True)
class Bars:
    """Bars (e,) between frames `node` (e, 2).

    `arm` (e, 2, 3), m, leads to their ends as seen from the frames, `length` (e,), m, is that without strain,
    `stiffness` (e,) in N/m; `mass` (e, 12, 12) acts on the velocities of the ends and is the same in all axes.
    """

    node: Index
    arm: Array
    length: Array
    stiffness: Array
    mass: Array

    @property
    def coupled(self) -> tuple[Index, ...]:
        """No members."""
        return ()

    def _ends(self, frames: Frames) -> Ends:
        return Ends.of(frames, self.node, np.tile(np.eye(3), (len(self.node), 2, 1, 1)), self.arm)

    def response(self, frames: Frames) -> Response:
        """Energies, forces and tangents in a state of the frames (theory eq. G13)."""
        ends = self._ends(frames)
        stretch = np.linalg.norm(ends.position[:, 1] - ends.position[:, 0], axis=1) - self.length
        pull = self.stiffness * stretch
        return Response(0.5 * pull * stretch, *pulled(ends, pull, self.stiffness))

    def driven(self, command: float | Array) -> Bars:
        """As long without strain as after free expansions, m."""
        return replace(self, length=self.length + command)

    def material(self, frames: Frames) -> tuple[Array]:
        """Derivatives (e, 12, 12) of the forces in a state, as if there were none in it (theory eq. G16)."""
        ends = self._ends(frames)
        line = ends.position[:, 1] - ends.position[:, 0]
        along = ((line / np.linalg.norm(line, axis=1)[:, None])[:, None] @ _stretch_rows(ends))[:, 0]
        return (self.stiffness[:, None, None] * along[:, :, None] * along[:, None],)

    def masses(self, frames: Frames) -> Array:
        """Mass matrices (e, 12, 12) by velocities of the frames."""
        return carried(self.mass, self._ends(frames).twists())

    def kinetics(self, frames: Frames, rates: Rates) -> Kinetics:
        """What holds, damps and accelerates them in a state of motion (theory eqs. G33-G34)."""
        held, ends = self.response(frames), self._ends(frames)
        velocity, acceleration = rates.velocity[self.node], rates.acceleration[self.node]
        axes = np.tile(np.eye(3), (len(self.node), 1, 1))
        force, kinetic = accelerating(self.mass, axes, ends.arm, np.zeros(2), velocity, acceleration)
        if rates.damping:
            damped = self.material(frames)[0] @ velocity.reshape(len(velocity), 12, 1)
            force = force + rates.damping * damped[..., 0]
        return Kinetics(held.force + force, float(held.energy.sum()), kinetic)


def pulled(ends: Ends, pull: Array, stiffness: Array) -> tuple[Array, Array]:
    """Forces (e, 12) on the frames that hold `ends` against a pull (e,), N, along the line between them, which grows
    with its length by `stiffness` (e,), N/m, and their tangents (e, 12, 12)."""
    line = ends.position[:, 1] - ends.position[:, 0]
    now = np.linalg.norm(line, axis=1)
    n = line / now[:, None]
    B = _stretch_rows(ends)
    across = (np.eye(3) - n[:, :, None] * n[:, None]) * (pull / now)[:, None, None]
    along = stiffness[:, None, None] * n[:, :, None] * n[:, None]
    force = pull[:, None] * (n[:, None] @ B)[:, 0]
    tangent = np.swapaxes(B, 1, 2) @ (along + across) @ B
    for end, sign in ((0, -1.0), (1, 1.0)):
        six = slice(6 * end, 6 * end + 6)
        rotations = slice(6 * end + 3, 6 * end + 6)
        tangent[:, rotations, rotations] += skew(sign * pull[:, None] * n) @ skew(ends.arm[:, end])
        tangent[:, six, six] -= turned(force[:, six])
    return force, tangent


def _stretch_rows(ends: Ends) -> Array:
    """Displacements (e, 3, 12) of end 2 from end 1 by those of the frames."""
    B = np.zeros((len(ends.arm), 3, 12), like=ends.arm)
    for end, sign in ((0, -1.0), (1, 1.0)):
        B[:, :, 6 * end : 6 * end + 3] = sign * np.eye(3)
        B[:, :, 6 * end + 3 : 6 * end + 6] = -sign * skew(ends.arm[:, end])
    return B


@dataclass(frozen=True)
class Push:
    """Actuators (e,) between frames `node` (e, 2): each acts on the second, and the opposite on the first.

    `arm` (e, 2, 3), m, leads to where it acts, as seen from the frames. Of size one it exerts `wrench` (e, 6), N and
    N m, in axes that turn with the first frame; without, a force along the line from the first end to the second.
    """

    node: Index
    arm: Array
    wrench: Array | None
    size: float | Array = 0.0

    @property
    def coupled(self) -> tuple[Index, ...]:
        """No members."""
        return ()

    def driven(self, command: float | Array) -> Push:
        """With forces or moments, N or N m."""
        return replace(self, size=command)

    def response(self, frames: Frames) -> Response:
        """No energy, and the forces and tangents of what it exerts (theory eq. G21)."""
        e = len(self.node)
        ends = Ends.of(frames, self.node, np.tile(np.eye(3), (e, 2, 1, 1)), self.arm)
        size = np.reshape(self.size, -1) * np.ones(e)
        if self.wrench is None:
            return Response(np.zeros(e), *pulled(ends, -size, np.zeros(e)))
        R, wrench = frames.R[self.node[:, 0]], size[:, None] * self.wrench
        f, m = ((R @ own[:, :, None])[..., 0] for own in (wrench[:, :3], wrench[:, 3:]))
        force, tangent = (np.zeros((e, *shape), like=f) for shape in ((2, 6), (2, 6, 2, 6)))
        for end, sign in ((0, 1.0), (1, -1.0)):
            a = ends.arm[:, end]
            force[:, end, :3], force[:, end, 3:] = sign * f, sign * (m + np.cross(a, f))
            tangent[:, end, :3, 0, 3:] -= sign * skew(f)
            tangent[:, end, 3:, 0, 3:] -= sign * (skew(m) + skew(a) @ skew(f))
            tangent[:, end, 3:, end, 3:] += sign * skew(f) @ skew(a)
            tangent[:, end, :, end] -= turned(force[:, end])
        return Response(np.zeros(e), force.reshape(e, 12), tangent.reshape(e, 12, 12))

    def material(self, frames: Frames) -> tuple[Array]:
        """They have no stiffness (e, 12, 12) of their own."""
        del frames
        return (np.zeros((len(self.node), 12, 12)),)

    def masses(self, frames: Frames) -> Array:
        """Nor mass (e, 12, 12)."""
        return self.material(frames)[0]

    def kinetics(self, frames: Frames, rates: Rates) -> Kinetics:
        """What they exert in a state of motion."""
        del rates
        return Kinetics(self.response(frames).force, 0.0, 0.0)
