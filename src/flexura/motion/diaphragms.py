"""Diaphragms in large motion: superelements whose membrane forces grow with the square of what bends them."""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import permutations

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import ring_plate
from flexura.duals import zeros
from flexura.motion.elements import Frames
from flexura.motion.superelements import Polynomial, Superelements

THICKNESSES = 1.25
"""Deflection over thickness up to which the stiffening is 2 % off at most: 1 % at 1, 6 % at 2, 22 % at 5 (von Karman's
equations, hub over rim 0.1 to 0.8)."""


@dataclass(frozen=True)
class BentRings(Superelements):
    """Diaphragms between the frames of rim and hub, axes along the normal last; thickness (e,), m, and the length (e,),
    m, by which a tilt of the hub stretches it as that deflection does."""

    thickness: Array
    lever: Array

    @staticmethod
    def bent(rest: Frames, frames: Index, axes: Array, arm: Array, plate: ring_plate.RingPlate) -> BentRings:
        """One diaphragm, its frames reaching its centre by arms (2, 3), m, its axes (3, 3) as columns."""
        k, M, more = np.diag(ring_plate.stiffnesses(plate)), ring_plate.mass(plate), ring_plate.membrane(plate)
        K = np.concatenate([np.concatenate([k, -k], axis=1), np.concatenate([-k, k], axis=1)])
        linear = Superelements.of(rest, -1, frames, np.array([True, True]), axes, arm, K, M)
        own = {field.name: getattr(linear, field.name) for field in fields(linear)}
        own["energy"] = Polynomial(linear.energy.stiffness, *stretching(more))
        return BentRings(**own, thickness=np.reshape(plate.thickness, 1), lever=np.reshape(plate.lever, 1))

    def deflections(self, frames: Frames) -> Array:
        """Deflections (e,) of the hub over the thickness, tilts at their levers."""
        d = self.deformation(frames)
        tilt = np.linalg.norm(d[:, 3:5], axis=1) * self.lever
        return np.hypot(d[:, 2], tilt) / self.thickness


def stretching(more: ring_plate.Membrane) -> tuple[Array, Array]:
    """Third (1, 6, 6, 6) and fourth derivatives (1, 6, 6, 6, 6) of the energy of stretching by the motion of the hub
    (theory eq. Z7)."""
    cubic, quartic = zeros((6,) * 3, more.axial), zeros((6,) * 4, more.axial)
    for at, value in (((0, 2, 4), more.shift), ((1, 2, 3), -more.shift)):
        for order in permutations(at):
            cubic[order] = value
    terms = [((2, 2, 2, 2), 12 * more.axial), ((3, 3, 4, 4), 4 * more.tilt)]
    terms += [((i, i, i, i), 12 * more.tilt) for i in (3, 4)] + [((2, 2, i, i), 2 * more.mixed) for i in (3, 4)]
    for at, value in terms:
        for order in set(permutations(at)):
            quartic[order] = value
    return cubic[None], quartic[None]
