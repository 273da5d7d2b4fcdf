"""Superelements in large motion: energies of their own deformation, in frames that turn with them.

Energies are polynomials of the deformation, up to the fourth order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.duals import plain, zeros
from flexura.kernels import Kernel, Struct, is_compiled
from flexura.motion.elements import Ends, Frames, Kinetics, Rates, Response, accelerating, products
from flexura.motion.lanes import abreast, are_plain, different, joined_by, upper, whole
from flexura.motion.se3 import SERIES, Logarithm

_response = Kernel("superelements_response", "aaaaaaaa")
_masses = Kernel("superelements_masses", "aaaaa")
_kinetics = Kernel("superelements_kinetics", "aaaaaaxaaa")


@dataclass(frozen=True)
class Polynomial:
    """Energies d'kd/2 + cddd/6 + qdddd/24 of elements by their deformations d (e, d).

    `stiffness` k (e, d, d), `cubic` c (e, m, m, m) and `quartic` q (e, m, m, m, m) are symmetric, of the first m of the
    deformations; empty from the order on that is left out.
    """

    stiffness: Array
    cubic: Array
    quartic: Array

    @staticmethod
    def linear(stiffness: Array) -> Polynomial:
        """Energies d'kd/2, k (e, d, d)."""
        return Polynomial(stiffness, np.empty((0,) * 4), np.empty((0,) * 5))

    def placed(self, count: int) -> Polynomial:
        """The energy of the only element, for `count` copies."""
        return Polynomial(*(term.repeat(count, axis=0) for term in (self.stiffness, self.cubic, self.quartic)))

    def with_amplitudes(self, stiffness: Array) -> Polynomial:
        """With further deformations of stiffnesses (a,), not coupled to anything, zero for those that stand still."""
        n, a = self.stiffness.shape[-1], len(stiffness)
        k = np.pad(self.stiffness, ((0, 0), (0, a), (0, a)))
        k[:, range(n, n + a), range(n, n + a)] = stiffness
        return Polynomial(k, self.cubic, self.quartic)

    @staticmethod
    def joined(parts: list[Polynomial]) -> Polynomial:
        """Energies of elements of equally many deformations, one after another."""
        poses = max(part.cubic.shape[1] for part in parts)
        return Polynomial(
            np.concatenate([part.stiffness for part in parts]),
            _joined([part.cubic for part in parts], [len(part.stiffness) for part in parts], poses),
            _joined([part.quartic for part in parts], [len(part.stiffness) for part in parts], poses),
        )

    def scaled(self, moduli: Array, length: Array, turns: NDArray[np.bool_]) -> Polynomial:
        """Of elements (e,) whose moduli and all whose lengths are so many times as large: strains are as large by
        deformations (d,) that grow along, but for those that `turns` says are rotations."""

        def grown(term: Array) -> Array:
            if not term.size:
                return term
            term = term * (moduli * length**3).reshape(-1, *[1] * (term.ndim - 1))
            for axis in range(1, term.ndim):
                by = np.where(turns[: term.shape[axis]], 1.0, 1 / length[:, None])
                term = term * by.reshape(len(by), *[1] * (axis - 1), -1, *[1] * (term.ndim - axis - 1))
            return term

        return Polynomial(*(grown(term) for term in (self.stiffness, self.cubic, self.quartic)))

    def force(self, d: Array) -> tuple[Array, Array]:
        """Energies (e,), N m, and their gradients (e, d) at deformations (e, d)."""
        gradient = (self.stiffness @ d[..., None])[..., 0]
        energy = (d * gradient).sum(axis=1) / 2
        if not self.cubic.size:
            return energy, gradient
        e, n = d.shape[0], self.cubic.shape[-1]
        pose = d[:, :n]
        along, column = pose[:, None], pose[..., None]
        by_pose = along @ self.cubic.reshape(e, n, n * n)
        more = (by_pose.reshape(e, n, n) @ column)[..., 0] / 2
        energy = energy + (pose * more).sum(axis=1) / 3
        if self.quartic.size:
            by_pose = along @ (along @ self.quartic.reshape(e, n, n**3)).reshape(e, n, n * n)
            third = (by_pose.reshape(e, n, n) @ column)[..., 0] / 6
            energy, more = energy + (pose * third).sum(axis=1) / 4, more + third
        gradient[:, :n] += more
        return energy, gradient

    def response(self, d: Array) -> tuple[Array, Array, Array]:
        """Energies (e,), N m, their gradients (e, d) and Hessians (e, d, d) at deformations (e, d)."""
        gradient = (self.stiffness @ d[..., None])[..., 0]
        energy = np.einsum("en,en->e", d, gradient) / 2
        if not self.cubic.size:
            return energy, gradient, self.stiffness
        e, n = d.shape[0], self.cubic.shape[-1]
        pose, hessian = d[:, :n], self.stiffness.copy()
        slope = (pose[:, None] @ self.cubic.reshape(e, n, n * n)).reshape(e, n, n)
        hessian[:, :n, :n] += slope
        second, third = (slope @ pose[..., None])[..., 0], 0.0
        if self.quartic.size:
            along = (pose[:, None] @ self.quartic.reshape(e, n, n**3)).reshape(e, n, n * n)
            slope = (pose[:, None] @ along).reshape(e, n, n)
            hessian[:, :n, :n] += slope / 2
            third = (slope @ pose[..., None])[..., 0]
        gradient[:, :n] += second / 2 + third / 6
        return energy + np.einsum("en,en->e", pose, second / 6 + third / 24), gradient, hessian

    @cached_property
    def struct(self) -> Struct:
        """As kernels take it."""
        n, m = self.stiffness.shape[-1], self.cubic.shape[-1]
        orders = [different(term, order) for term, order in ((self.cubic, 3), (self.quartic, 4))]
        sizes = [term.shape[1] for term in orders]
        tables = [whole(joined_by(m, order)) if m else whole([]) for order in (1, 2, 3)]
        terms = [abreast(term) if term.size else np.empty(0) for term in (upper(self.stiffness), *orders)]
        return Struct(n, m, m * (m + 1) // 2, *sizes, *terms, *tables)


def _joined(terms: list[Array], counts: list[int], size: int) -> Array:
    """Terms of one order; zero where an element has none and another one has some."""
    order = terms[0].ndim - 1
    if not any(term.size for term in terms):
        return np.empty((0,) * (order + 1))
    zeros = [np.zeros((count, *(size,) * order)) for count in counts]
    return np.concatenate([term if term.size else zero for term, zero in zip(terms, zeros, strict=True)])


RIGID = 1e-6
"""Force of rigid motions over that of single displacements, from which a superelement is held by the ground."""


@dataclass(frozen=True)
class Superelements:
    """Superelements (e,) between frames `node` (e, k), whose deformation is the pose of all frames seen from the first.

    `count` frames come first, in axes (e, 3, 3) at arms (e, count, 3), m, from their frames; the other frames hold
    amplitudes. `rest` (e, count - 1, 6) are the logarithms of the relative poses without strain. `energy` is that of
    the changes of these logarithms and of the amplitudes; `mass` (e, 6k, 6k) acts on the velocities of the frames in
    the axes of the first.
    """

    node: Index
    count: int
    axes: Array
    arm: Array
    rest: Array
    energy: Polynomial
    mass: Array

    @property
    def coupled(self) -> tuple[Index, ...]:
        """No members."""
        return ()

    @staticmethod
    def of(
        rest: Frames, ground: int, frames: Index, placed: NDArray[np.bool_], axes: Array, arm: Array, K: Array, M: Array
    ) -> Superelements:
        """A superelement with K and M (6k, 6k) over frames (k,), those with amplitudes instead of a place last.

        Where rigid motions meet resistance, the ground becomes the first frame.
        """
        count = int(placed.sum())
        x = rest.x[frames[:count]] + arm[:count]
        rigid = np.zeros((len(K), 6), like=x)
        for i in range(count):
            rigid[6 * i : 6 * i + 6] = np.eye(6)
            rigid[6 * i : 6 * i + 3, 3:] = np.cross(np.eye(3), axes.T @ (x[i] - x[0])).T
        stiffness, motions = plain(K), plain(rigid)
        size = np.abs(stiffness).max(initial=0.0)
        if count < 2 or np.abs(stiffness @ motions).max() > RIGID * size * max(np.abs(motions).max(), 1.0):
            frames, arm = np.append(ground, frames), np.concatenate([x[:1], arm])
            K, M = (np.pad(matrix, ((6, 0), (6, 0))) for matrix in (K, M))
            count += 1
        placed_arm = arm[None, :count]
        logs = _seen_from_first(Ends.of(rest, frames[None, :count], axes[None, None], placed_arm))
        J = zeros((len(K) - 6,) * 2, logs.e)
        J[range(len(J)), range(len(J))] = 1.0
        for i, after in enumerate(logs.after[0]):
            J[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = np.linalg.inv(after)
        k = J.T @ K[6:, 6:] @ J
        energy = Polynomial.linear((k + k.T)[None] / 2)
        return Superelements(frames[None], count, axes[None], placed_arm, logs.e, energy, M[None])

    @cached_property
    def struct(self) -> Struct:
        """As kernels take them."""
        node, rest = whole(self.node), self.rest.reshape(len(self.node), -1)
        parts = [abreast(part) for part in (self.axes, self.arm, rest, upper(self.mass))]
        return Struct(*node.shape, self.count, node, *parts, SERIES, self.energy.struct)

    @cached_property
    def is_plain(self) -> bool:
        """Whether nothing of them has slopes."""
        energy = self.energy
        return are_plain(self.axes, self.arm, self.rest, self.mass, energy.stiffness, energy.cubic, energy.quartic)

    def _by_kernel(self, frames: Frames) -> bool:
        """Whether kernels answer in a state."""
        return is_compiled() and self.is_plain and are_plain(frames.x, frames.R)

    @property
    def memory(self) -> int:
        """Numbers of scratch that kernels need."""
        k, m = self.node.shape[1], self.energy.cubic.shape[-1]
        return 4 * (31 * self.count + 138 * k + 108 * k * k + m**3)

    def ends(self, frames: Frames) -> Ends:
        """Where these frames are, (e, count)."""
        return Ends.of(frames, self.node[:, : self.count], self.axes[:, None], self.arm)

    def logs_at(self, frames: Frames) -> Logarithm:
        """Poses of the other frames as seen from the first."""
        return _seen_from_first(self.ends(frames))

    def turns(self, frames: Frames) -> Array:
        """The largest rotations (e,), rad, of frames seen from the first."""
        return np.linalg.norm(_seen_from_first(self.ends(frames)).e[..., 3:], axis=-1).max(axis=1, initial=0.0)

    def deformation(self, frames: Frames) -> Array:
        """Changes (e, d) of the logarithms of the relative poses, and amplitudes."""
        return self._deformation(frames, _seen_from_first(self.ends(frames)))

    def motions(self, frames: Frames, rest: Frames) -> Array:
        """Displacements and rotations (e, d) of the other frames as seen from the first, which the same deformation has
        where it is small, and amplitudes."""
        return self._small(self.deformation(frames)[..., None], rest)[..., 0]

    def motion_changes(self, frames: Frames, rest: Frames, u: Array) -> Array:
        """What small displacements u (e, 6k, m) of the frames from a state change of `motions` (e, d, m)."""
        return self._small(self.rows(frames) @ u, rest)

    def _small(self, d: Array, rest: Frames) -> Array:
        """Small motions (e, d, m) with changes d of the logarithms from rest."""
        inner, after = 6 * (self.count - 1), _seen_from_first(self.ends(rest)).after
        moved = np.linalg.inv(after) @ d[:, :inner].reshape(*after.shape[:-1], d.shape[-1])
        return np.concatenate([moved.reshape(len(d), inner, -1), d[:, inner:]], axis=1)

    def _deformation(self, frames: Frames, log: Logarithm) -> Array:
        e = len(self.node)
        amplitudes = frames.z[self.node[:, self.count :]].reshape(e, -1)
        return np.concatenate([(log.e - self.rest).reshape(e, -1), amplitudes], axis=1)

    def response(self, frames: Frames) -> Response:
        """Energies, forces and tangents in a state of the frames (theory eq. G3)."""
        if self._by_kernel(frames):
            e, n = len(self.node), 6 * self.node.shape[1]
            made = np.empty(e), np.empty((e, n)), np.empty((e, n, n))
            _response(self.struct.address, frames.x, frames.R, frames.z, np.empty(self.memory), *made)
            return Response(*made)
        ends = self.ends(frames)
        log = _seen_from_first(ends)
        twists = ends.twists()
        energy, n, hessian = self.energy.response(self._deformation(frames, log))
        B, inner = self._rows(twists, log), 6 * (self.count - 1)
        turned = np.swapaxes(B, 1, 2)
        left = turned @ hessian
        if inner:
            before, after = log.second(n[:, :inner].reshape(len(n), -1, 6))
            first = np.swapaxes(twists[:, :1], -1, -2) @ before
            left[:, :6, :inner] -= np.swapaxes(first, 1, 2).reshape(len(n), 6, inner)
            for i, block in enumerate(np.moveaxis(np.swapaxes(twists[:, 1:], -1, -2) @ after, 1, 0)):
                left[:, 6 * i + 6 : 6 * i + 12, 6 * i : 6 * i + 6] += block
        return Response(energy, (turned @ n[..., None])[..., 0], left @ B)

    def held(self, frames: Frames) -> Array:
        """The forces (e, 6k) of `response` alone."""
        if self._by_kernel(frames):
            return self.response(frames).force
        ends = self.ends(frames)
        log = _seen_from_first(ends)
        n = self.energy.force(self._deformation(frames, log))[1]
        return (np.swapaxes(self._rows(ends.twists(), log), 1, 2) @ n[..., None])[..., 0]

    def rows(self, frames: Frames) -> Array:
        """Derivatives (e, d, 6k) of the deformation by displacements of the frames."""
        ends = self.ends(frames)
        return self._rows(ends.twists(), _seen_from_first(ends))

    def _rows(self, twists: Array, log: Logarithm) -> Array:
        e, size, inner = len(self.node), 6 * self.node.shape[1], 6 * (self.count - 1)
        B = np.zeros((e, size - 6, size), like=twists)
        B[:, range(inner, size - 6), range(inner + 6, size)] = 1.0
        B[:, :inner, :6] = (-log.before @ twists[:, :1]).reshape(e, inner, 6)
        for i, block in enumerate(np.moveaxis(log.after @ twists[:, 1:], 1, 0)):
            B[:, 6 * i : 6 * i + 6, 6 * i + 6 : 6 * i + 12] = block
        return B

    def material(self, frames: Frames) -> tuple[Array]:
        """Derivatives (e, 6k, 6k) of the forces in a state, as if there were none in it (theory eq. G16)."""
        B = self.rows(frames)
        return (np.swapaxes(B, 1, 2) @ self.energy.stiffness @ B,)

    def masses(self, frames: Frames) -> Array:
        """Mass matrices (e, 6k, 6k) by velocities of the frames."""
        e, k = self.node.shape
        if self._by_kernel(frames):
            M = np.empty((e, 6 * k, 6 * k))
            _masses(self.struct.address, frames.x, frames.R, np.empty(self.memory), M)
            return M
        ends = self.ends(frames)
        twists = ends.twists(np.repeat(ends.axes[:, :1], self.count, axis=1))
        seen = np.concatenate([twists, np.tile(np.eye(6), (e, k - self.count, 1, 1))], axis=1)
        M = np.swapaxes(seen, -1, -2)[:, :, None] @ np.swapaxes(self.mass.reshape(e, k, 6, k, 6), 2, 3) @ seen[:, None]
        return np.swapaxes(M, 2, 3).reshape(e, 6 * k, 6 * k)

    def kinetics(self, frames: Frames, rates: Rates) -> Kinetics:
        """What holds, damps and accelerates them in a state of motion (theory eqs. G33-G34)."""
        if self._by_kernel(frames):
            force, energies = np.empty((len(self.node), 6 * self.node.shape[1])), np.empty(2)
            state, moving = (frames.x, frames.R, frames.z), (rates.velocity, rates.acceleration, rates.damping)
            _kinetics(self.struct.address, *state, *moving, np.empty(self.memory), force, energies)
            return Kinetics(force, float(energies[0]), float(energies[1]))
        ends = self.ends(frames)
        log = _seen_from_first(ends)
        velocity, acceleration = rates.velocity[self.node], rates.acceleration[self.node]
        d, inner = self._deformation(frames, log), 6 * (self.count - 1)
        if rates.damping:
            energy, n, hessian = self.energy.response(d)
            n = n + rates.damping * (hessian @ self._deforming(ends, log, velocity)[..., None])[..., 0]
        else:
            energy, n = self.energy.force(d)
        held = self._at_frames(ends, log, n[:, :inner].reshape(len(n), -1, 6, 1))
        if inner < n.shape[1]:
            held = np.concatenate([held, n[:, inner:]], axis=1)
        first = np.eye(self.count)[0]
        inertial, kinetic = accelerating(self.mass, ends.axes[:, 0], ends.arm, first, velocity, acceleration)
        return Kinetics(held + inertial, float(energy.sum()), kinetic)

    def _deforming(self, ends: Ends, log: Logarithm, velocity: Array) -> Array:
        """Rates (e, d) of the deformation by velocities (e, k, 6) of the frames: the product with `rows`."""
        e, placed = len(velocity), velocity[:, : self.count].reshape(-1, self.count, 2, 3)
        moving = placed.copy()
        moving[:, :, 0] += products(placed[:, :, 1], ends.arm)
        h = (moving @ ends.axes).reshape(e, -1, 6, 1)
        rates = (log.after @ h[:, 1:] - log.before @ h[:, :1]).reshape(e, -1)
        return np.concatenate([rates, velocity[:, self.count :].reshape(e, -1)], axis=1)

    def _at_frames(self, ends: Ends, log: Logarithm, n: Array) -> Array:
        """Forces (e, 6 count) on the placed frames by those conjugate to the deformation, n (e, count - 1, 6, 1): the
        product with the transposed `rows`."""
        others = np.swapaxes(log.after, -1, -2) @ n
        first = -(np.swapaxes(log.before, -1, -2) @ n).sum(axis=1, keepdims=True)
        own = np.concatenate([first, others], axis=1).reshape(len(n), -1, 2, 3)
        forces = own @ np.swapaxes(ends.axes, -1, -2)
        forces[:, :, 1] += products(ends.arm, forces[:, :, 0])
        return forces.reshape(len(n), -1)


def _seen_from_first(ends: Ends) -> Logarithm:
    back = np.swapaxes(ends.axes[:, :1], -1, -2)
    apart = ends.position[:, 1:] - ends.position[:, :1]
    return Logarithm(back @ ends.axes[:, 1:], (back @ apart[..., None])[..., 0])


@dataclass(frozen=True)
class Sagging:
    """Weight of amplitudes of superelements, which act where these have turned.

    `node` (k, 2) holds the first frame of each superelement and one with amplitudes, `weight` (k, 6, 3) the forces on
    these per acceleration of free fall in the axes of the first, which have not turned at rest.
    """

    node: Index
    weight: Array

    @staticmethod
    def of(groups: Sequence[Superelements], rest: Frames) -> Sagging:
        """The weight of what moves inside superelements."""
        nodes, weights = [np.empty((0, 2), dtype=np.intp)], [np.empty((0, 6, 3))]
        for group in groups:
            e, k = group.node.shape
            amplitudes = group.node[:, group.count :]
            M = group.masses(rest).reshape(e, k, 6, k, 6)
            first = group.node[:, :1].repeat(k - group.count, axis=1)
            nodes.append(np.stack([first, amplitudes], axis=-1).reshape(-1, 2))
            weights.append(M[:, group.count :, :, : group.count, :3].sum(axis=3).reshape(-1, 6, 3))
        return Sagging(np.concatenate(nodes), np.concatenate(weights))

    def response(self, frames: Frames, gravity: Array) -> tuple[Array, Array]:
        """Forces (k, 12) of the weight, and their derivatives (k, 12, 12): those of the energy -z'WR'g."""
        first, amplitudes = self.node.T
        by_direction = self.weight @ np.swapaxes(frames.R[first], -1, -2)
        force, slope = (np.zeros((len(first), *size), like=by_direction) for size in ((12,), (12, 12)))
        centre = (frames.z[amplitudes][:, None] @ by_direction)[:, 0]
        force[:, 3:6], force[:, 6:] = np.cross(centre, gravity), by_direction @ gravity
        slope[:, 3:6, 3:6] = skew(gravity) @ skew(centre)
        slope[:, 6:, 3:6] = by_direction @ skew(gravity)
        slope[:, 3:6, 6:] = np.swapaxes(slope[:, 6:, 3:6], -1, -2)
        return force, slope
