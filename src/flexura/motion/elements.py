"""Elements between two turning frames: forces, tangents and masses from the relative pose of their ends.

A frame has a position x and a rotation R, the identity at rest. Displacements of a frame are dx, m, and the rotation
vector dw, rad, both in global axes: R becomes rotation(dw) R. No element has axes of its own that turn: its strain
is the logarithm of the pose of end 2 seen from end 1, so that moving and turning everything changes nothing, the
order of the ends does not matter, and an element bent to an arc or wound to a helix is exact.

Sources: Borri, Bottasso (1994), Int. J. Numer. Meth. Engng 37 (helicoidal strain); Sonneville, Cardona, Bruls (2014).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.duals import zeros
from flexura.motion.inertia import accelerating
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
        own = np.flatnonzero(step.any(axis=1) & self.placed)
        x[own] += step[own, :3]
        R[own] = rotation(step[own, 3:]) @ R[own]
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

    The derivatives leave out that forces turn with the frames they are in; `turned` adds it, frame by frame.
    """

    energy: Array
    force: Array
    tangent: Array


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

    def response(self, frames: Frames) -> Response:
        """Energies, forces and tangents in a state of the frames."""
        ...

    def material(self, frames: Frames) -> Array:
        """Derivatives (e, 6k, 6k) of the forces in a state, as if there were none in it (theory eq. G16)."""
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

    def driven(self, command: float) -> PoseElements:
        """With a free expansion along the first axis, m."""
        return replace(self, rest=self.rest + np.append(command, np.zeros(5)))

    def ends(self, frames: Frames) -> Ends:
        """Where the ends are."""
        return Ends.of(frames, self.node, self.axes, self.arm)

    def response(self, frames: Frames) -> Response:
        """Energies, forces and tangents in a state of the frames (theory eq. G7)."""
        ends = self.ends(frames)
        log, twists = ends.relative(), ends.twists()
        energy, n, k = self.strain.response(log.e - self.rest)
        B = _rows(log, twists)
        before, after = log.second(n)
        turned = np.swapaxes(B, 1, 2)
        K = turned @ k
        K[:, :6] -= np.swapaxes(twists[:, 0], 1, 2) @ before
        K[:, 6:] += np.swapaxes(twists[:, 1], 1, 2) @ after
        return Response(energy, (turned @ n[..., None])[..., 0], K @ B)

    def relief(self, frames: Frames, motions: Array) -> Array:
        """Twice the energies (e, k), N m, that finer elements would take off small displacements (e, 12, k) of the
        frames in a state, estimated (theory eq. G27)."""
        ends = self.ends(frames)
        log = ends.relative()
        return self.strain.relief(log.e - self.rest, _rows(log, ends.twists()) @ motions)

    def material(self, frames: Frames) -> Array:
        """Derivatives (e, 12, 12) of the forces in a state, as if there were none in it (theory eq. G16)."""
        B = self.rows(frames)
        return np.swapaxes(B, 1, 2) @ self.strain.material(self.deformation(frames)) @ B

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
        energy, n, k = self.strain.response(log.e - self.rest)
        B = _rows(log, ends.twists())
        if rates.damping:
            n = n + rates.damping * (k @ (B @ velocity.reshape(e, 12, 1)))[..., 0]
        held = (n[:, None] @ B)[:, 0]
        acceleration = rates.acceleration[self.node]
        own, kinetic = accelerating(self.mass, _middle(ends, log), ends.arm, HALVES, velocity, acceleration)
        return Kinetics(held + own, float(energy.sum()), kinetic)


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
