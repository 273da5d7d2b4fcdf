"""Leaves of a low order that turns: members between two kept frames as few beam elements, with motions inside.

Energies of a leaf have no series that reaches far: one that moves by many thicknesses softens along, and one that is
wide flattens, by functions with poles. Elements that bend (theory eqs. G9-G12, G40) have both exactly, and few of them
do. Their stiffness at rest is that of the elements that they stand for (theory eq. G41).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.polynomial import legendre

from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.mechanism import with_elements
from flexura.motion.bowing import POINTS
from flexura.motion.elements import Ends, Frames, PoseElements
from flexura.motion.layout import taken
from flexura.motion.model import MovingModel
from flexura.motion.se3 import exponential
from flexura.motion.strain import CURVATURES, linear_strain
from flexura.motion.substructures import Substructure
from flexura.structure import EVEN, Design, Plan

FEWEST = 3
"""Elements of a member from which fewer are tried."""

SAMPLES = 60
"""Places in a piece at which what varies along a member is taken."""

NOT_TWIST = np.array([0, 1, 2, 4, 5])
"""Deformations whose stiffness is summed over elements; twist has that of the mesh, with its warping."""


def beams_of(substructure: Substructure) -> tuple[int, Index] | None:
    """The group and the rows of a whole member that a substructure consists of, from end to end; None for others."""
    own = [(g, rows) for g, rows in enumerate(substructure.rows) if len(rows)]
    if substructure.k != 2 or len(own) != 1 or substructure.inertia.any():
        return None
    g, rows = own[0]
    group, names = substructure.model.elements[g], substructure.model.names[g]
    if not isinstance(group, PoseElements) or not group.are_beams or len(rows) < FEWEST:
        return None
    is_chain = (np.diff(rows) == 1).all() and (group.node[rows[1:], 0] == group.node[rows[:-1], 1]).all()
    is_whole = {names[row] for row in rows.tolist()} == {substructure.name} and names.count(substructure.name) == len(
        rows
    )
    return (g, rows) if is_chain and is_whole else None


@dataclass(frozen=True)
class Meshes:
    """Members of the full order in fewer elements, so many in all of them, by number."""

    full: MovingModel
    _made: dict[int, MovingModel]

    def of(self, n: int) -> MovingModel:
        """The moving model whose members have n elements."""
        if n not in self._made:
            design = self.full.design
            plan = Plan(with_elements(design.plan.mechanism, n))
            self._made[n] = MovingModel.of(Design.of(plan, design.parameters))
        return self._made[n]

    def leaf(self, substructure: Substructure, n: int) -> Leaf:
        """A member in n elements."""
        found = beams_of(substructure)
        assert found is not None
        g, rows = found
        fine = taken(substructure.model.elements[g], rows)
        mesh = self.of(n)
        at = next(
            (own, np.flatnonzero(np.array(mesh.names[own]) == substructure.name))
            for own, group in enumerate(mesh.elements)
            if isinstance(group, PoseElements) and substructure.name in mesh.names[own]
        )
        coarse = taken(mesh.elements[at[0]], at[1])
        inside = mesh.rest.x[coarse.node[:-1, 1]]
        frames = np.concatenate([fine.node[:1, 0], substructure.frames[2 : n + 1], fine.node[-1:, 1]])
        node = np.stack([frames[:-1], frames[1:]], axis=1)
        return Leaf(substructure, fine, replace(_equally_stiff(coarse, fine), node=node), inside)


@dataclass(frozen=True)
class Leaf:
    """A member, `of` the full order with elements `fine`, as few `elements` whose inner frames lie at `inside`."""

    of: Substructure
    fine: PoseElements
    elements: PoseElements
    inside: Array

    @property
    def frames(self) -> Index:
        """The frames between which it lies, as those of the substructure, then its own."""
        return np.concatenate([self.of.frames[:2], self.elements.node[:-1, 1]])

    @cached_property
    def ends(self) -> PoseElements:
        """A single element between its ends, for the deformation as its substructure takes it."""
        axes, rest = np.stack([self.of.turn, self.of.turn])[None], np.append(self.of.rest[1], np.zeros(3))
        none = np.zeros((1, 6, 6))
        return PoseElements(
            self.of.frames[None, :2], axes, self.of.arm[None], rest[None], linear_strain(none), np.zeros((1, 12, 12))
        )

    def fine_inside(self, frames: Frames) -> tuple[Array, Array]:
        """Where frames inside the member of full order are about, x (i, 3) and R (i, 3, 3), at constant strain within
        each element, seen from the first frame of its substructure."""
        count = len(self.fine.node)
        place = np.arange(1, count) * len(self.elements.node) / count
        element = np.minimum(place.astype(np.intp), len(self.elements.node) - 1)
        ends = Ends.of(frames, self.elements.node, self.elements.axes, self.elements.arm)
        R, x = exponential((place - element)[:, None] * ends.relative().e[element])
        start = ends.axes[element, 0]
        R = start @ R @ np.swapaxes(self.fine.axes[1:, 0], -1, -2)
        x = ends.position[element, 0] + (start @ x[..., None])[..., 0]
        order = {int(frame): k for k, frame in enumerate(self.fine.node[1:, 0].tolist())}
        at = [order[frame] for frame in self.of.frames[2:].tolist()]
        return self.of.seen(frames, x[at], R[at])

    def few_inside(self, frames: Frames) -> tuple[Array, Array]:
        """Where its own inner frames are, likewise."""
        own = self.elements.node[:-1, 1]
        return self.of.seen(frames, frames.x[own], frames.R[own])


def _equally_stiff(coarse: PoseElements, fine: PoseElements) -> PoseElements:
    """Few elements with the stiffness at rest, but for twist, of those that they stand for (theory eq. G41), and with
    masses along and about the axis halfway between consistent ones and lumped ones."""
    k, index = _summed(fine, len(coarse.node)), np.ix_(np.arange(len(coarse.node)), NOT_TWIST, NOT_TWIST)
    stiffness, mass = coarse.strain.stiffness.copy(), coarse.mass.copy()
    stiffness[index] = k
    for at, bends in CURVATURES:
        stiffness[:, at, at] = stiffness[:, bends, bends] * EVEN[2]
    for i in (0, 3):
        moved = mass[:, i, i + 6] / 2
        for a, b, sign in ((i, i, 1), (i + 6, i + 6, 1), (i, i + 6, -1), (i + 6, i, -1)):
            mass[:, a, b] += sign * moved
    bowing = replace(coarse.strain.bowing, free=_spread(fine.strain.bowing.free.mean(axis=1), len(coarse.node)))
    return replace(coarse, strain=replace(coarse.strain, stiffness=stiffness, bowing=bowing), mass=mass)


def _spread(values: Array, n: int) -> Array:
    """Values (n, 3) at Gauss's points of n equal pieces of what is constant in elements (e,): of the parabolas next to
    it."""
    at = (np.arange(SAMPLES) + 0.5) / SAMPLES
    of_piece = values[((np.arange(n)[:, None] + at) * len(values) / n).astype(np.intp)]
    means = of_piece @ legendre.legvander(2 * at - 1, 2) / SAMPLES
    parabola = np.moveaxis(means * [1, 3, 5], -1, 0)
    return np.asarray(np.clip(legendre.legval(POINTS, parabola), values.min(), values.max()), dtype=float)


def _summed(fine: PoseElements, n: int) -> Array:
    """Stiffness (n, 5, 5), but for twist, of n equal pieces of a member in elements (e,) of equal length: those of
    elements in each, one after another, of which some are cut.

    The deformation of a straight element is the relative twist of its ends at its middle, so that compliances are
    summed once they are carried from one middle to the other.
    """
    e, h = len(fine.node), fine.rest[:, 0]
    c = np.linalg.inv(fine.strain.stiffness[:, NOT_TWIST[:, None], NOT_TWIST])
    cuts = np.unique(np.concatenate([np.arange(e + 1) / e, np.arange(n + 1) / n]).round(12))
    middle, share = (cuts[1:] + cuts[:-1]) / 2, np.diff(cuts) * e
    total = np.zeros((n, 5, 5))
    for at, part in zip(middle.tolist(), share.tolist(), strict=True):
        element, piece = min(int(at * e), e - 1), min(int(at * n), n - 1)
        own = c[element] * part
        if part < 1 - 1e-9:  # of a uniform element
            for s, theta in ((1, 4), (2, 3)):
                own[s, s] += (part**3 - part) * h[element] ** 2 / 12 * c[element, theta, theta]
        reach = np.zeros(3)
        reach[0] = ((piece + 0.5) / n - at) * h.sum()
        X = np.eye(6)
        X[:3, 3:] = -skew(reach)
        X = X[np.ix_(NOT_TWIST, NOT_TWIST)]
        total[piece] += X @ own @ X.T
    return np.asarray(np.linalg.inv(total), dtype=float)
