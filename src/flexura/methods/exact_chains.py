"""Serial chains of uniform beams, each joined to one exact dynamic stiffness between its end nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Index
from flexura.beam import DynamicBeam, Joint, UniformBeam, at_pole, dynamic_beam, join, rigid_arm, rooted, turned
from flexura.reduction import ChainGroup, kinematics
from flexura.structure import Cut, Geometry, Part

Array = NDArray[Any]


@dataclass(frozen=True)
class ExactChains:
    """Chains (c,) of a part that have the same number of uniform pieces (s,), in walking order.

    They are the `members` (c,) of a group; `beam` are all different pieces of the part, `kind` (c, s) says which of
    them each is, and `reverse` (c, s) marks those walked from end to start. `X` (c, s, 6, 6) takes twists at the
    chain's pole, its first node, to those at the start of the piece in its own axes. `B` (c, 12, 12) takes the
    displacements of the two end nodes to [t, e], and `nodes` (c, e + 1), with `arms` (c, e + 1, 3) from the pole, are
    the nodes passed, after `passed` (e + 1,) pieces. `root` (c, s, 2) says which of the flexibilities
    `roots` (k, 6, 6) are elastic roots at the ends of a piece, -1 for none, and `is_rooted` (c, s) marks all pieces of
    elements that have any.
    """

    members: Index
    beam: UniformBeam
    kind: Index
    reverse: NDArray[np.bool_]
    X: Array
    B: Array
    nodes: Index
    arms: Array
    passed: Index
    root: Index
    roots: Array
    is_rooted: NDArray[np.bool_]

    def pieces(self, lam: float | complex) -> DynamicBeam:
        """All pieces (c, s), twists at the poles of their chains."""
        own = dynamic_beam(self.beam, lam)
        placed = at_pole(self.with_roots(DynamicBeam(*(field[self.kind] for field in own))), self.X)
        if not self.reverse.any():
            return placed
        back = turned(placed)
        pick = self.reverse[..., None, None]
        return DynamicBeam(np.where(pick, back.K, placed.K), np.where(pick, back.slope, placed.slope), placed.J0)

    def with_roots(self, pieces: DynamicBeam) -> DynamicBeam:
        """Pieces (c, s), in their own axes, with the roots at their ends."""
        if not len(self.roots):
            return pieces
        shape = pieces.J0.shape
        flat = DynamicBeam(*(field.reshape(-1, *field.shape[2:]) for field in pieces))
        found = rooted(flat, self.root.reshape(-1, 2), self.roots, self.beam.length[self.kind].ravel())
        return DynamicBeam(*(field.reshape(*shape, *field.shape[1:]) for field in found))

    def joined(self, lam: float | complex) -> tuple[DynamicBeam, list[Joint]]:
        """The chains (c,), and the joints of every level, each (c, pairs), lowest first."""
        return in_series(self.pieces(lam))

    def split(self, lam: float | complex) -> tuple[DynamicBeam, DynamicBeam]:
        """The first two fifths (c,) of the pieces and the others, each joined; there are at least three pieces.

        Modes of a uniform chain with held ends have nodes at halves, thirds and quarters, where a joint does not move.
        """
        pieces = self.pieces(lam)
        middle = 2 * pieces.J0.shape[-1] // 5
        first, second = (
            in_series(DynamicBeam(*(f[:, own] for f in pieces)))[0] for own in (slice(middle), slice(middle, None))
        )
        return first, second


def in_series(level: DynamicBeam) -> tuple[DynamicBeam, list[Joint]]:
    """Beams (c, s) joined along the last axis to (c,), and the joints of every level."""
    levels = []
    while level.J0.shape[-1] > 1:
        pairs = level.J0.shape[-1] // 2
        first, second = (DynamicBeam(*(f[:, k : 2 * pairs : 2] for f in level)) for k in (0, 1))
        joint = join(first, second)
        levels.append(joint)
        rest = DynamicBeam(*(f[:, 2 * pairs :] for f in level))
        level = DynamicBeam(*(np.concatenate(f, axis=1) for f in zip(joint.beam, rest, strict=True)))
    return DynamicBeam(*(f[:, 0] for f in level)), levels


def twists_inside(levels: list[Joint], motion: Array) -> Array:
    """Twists (c, s + 1, 6, k) of all ends of beams in series from [t, e] (c, 12, k) of the whole, and the joints that
    `in_series` made at the same frequency."""
    motion = motion[:, None]
    for joint in reversed(levels):
        pairs = joint.P.shape[1]
        t, e = motion[:, :pairs, :6], motion[:, :pairs, 6:]
        first = joint.P @ motion[:, :pairs]
        below = np.empty((len(motion), 2 * pairs, *motion.shape[2:]), dtype=motion.dtype)
        below[:, ::2] = np.concatenate([t, first], axis=2)
        below[:, 1::2] = np.concatenate([t + first, e - first], axis=2)
        motion = np.concatenate([below, motion[:, pairs:]], axis=1)
    return np.concatenate([motion[:, :1, :6], motion[:, :, :6] + motion[:, :, 6:]], axis=1)


def exact_chains(part: Part, group: ChainGroup, geometry: Geometry, cut: Cut) -> list[ExactChains]:
    """The chains of a group cut into uniform pieces, those of equal numbers of pieces together."""
    kin = kinematics(part, group, geometry.parts[part.name])
    first = np.concatenate([[0], np.cumsum(cut.counts)])
    per_chain = cut.counts[group.elements]
    positions = geometry.parts[part.name].positions
    found: dict[tuple[int, ...], list[int]] = {}
    for c, counts in enumerate(per_chain.tolist()):
        found.setdefault(tuple(counts), []).append(c)
    chains = []
    for counts, members in found.items():
        elements, back = group.elements[members], group.reverse[members]
        e = np.repeat(np.arange(len(counts)), counts)
        place = np.concatenate([np.arange(n) for n in counts])
        # pieces of an element that is walked backwards come in the opposite order
        place = np.where(back[:, e], np.array(counts)[e] - 1 - place, place)
        kind = cut.kind[first[elements[:, e]] + place]
        along = np.zeros((*kind.shape, 3))
        along[..., 0] = place * cut.beam.length[kind]
        X = rigid_arm(along) @ kin.X[np.array(members)[:, None], e, :6]
        nodes = group.nodes[members]
        arms = positions[nodes] - positions[nodes[:, :1]]
        passed = np.concatenate([[0], np.cumsum(counts)])
        own = cut.root[elements[:, e]]
        at_ends = np.stack([place == 0, place == np.array(counts)[e] - 1], axis=-1)
        root, is_rooted = np.where(at_ends, own, -1), np.asarray((own >= 0).any(axis=-1))
        chains.append(
            ExactChains(
                *(np.array(members), cut.beam, kind, back[:, e], X, kin.B[members], nodes, arms, passed),
                *(root, cut.roots, is_rooted),
            )
        )
    return chains
