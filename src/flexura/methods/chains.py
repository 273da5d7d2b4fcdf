"""Serial chains of uniform segments: their exact static shape apart from what moves relative to it.

With all motions written as twists at one pole, the flexibilities of the segments of a chain add up (theory eqs. 46-50),
so that stiffness between its ends keeps its digits however finely the chain is cut.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.beam import element_mass, element_stiffness, flexibility, rigid_arm
from flexura.errors import OptionError
from flexura.reduction.chain import ChainGroup
from flexura.structure.full_order import FullOrderModel
from flexura.structure.members import TAPERED_PIECES, Cut, ElementSlice
from flexura.structure.scatter import block_diagonal
from flexura.structure.slots import Index

Array = NDArray[np.float64]

_SWAP = np.r_[6:12, 0:6]
"""The DOFs of the two ends of a segment the other way round."""


@dataclass(frozen=True)
class SegmentChains:
    """Chains of s segments each of one prototype, in the part's frame; the pole of each is its first node.

    `nodes` (c, e + 1) are the part's nodes that the chains pass, with `arms` (c, e + 1, 3) from the pole; they are the
    `passed`-th of the s + 1 segment ends. `X` (c, s, 12, 6) takes a twist to the displacements, in segment axes, of
    the segment's near and far end in walking order. Stiffness k and mass m (c, s, 12, 12) are over those ends.
    `running` (c, s + 1, 6, 6) are flexibilities from the first node to every segment end.
    """

    name: str
    nodes: Index
    arms: Array
    passed: Index
    X: Array
    k: Array
    m: Array
    running: Array

    def take(self, index: Any) -> SegmentChains:
        """The chains at an index of the leading axis."""
        topology = (self.nodes[index], self.arms[index], self.passed[index])
        return SegmentChains(self.name, *topology, self.X[index], self.k[index], self.m[index], self.running[index])

    @property
    def turning(self) -> Array:
        """Largest rotation per moment (c,) of one end against the other, rad/(N m), about any axis."""
        return np.linalg.norm(self.running[:, -1, 3:, 3:], ord=2, axis=(-2, -1))

    @cached_property
    def stiffness(self) -> Array:
        """Stiffness (c, 6, 6) against the relative twist of the ends: the inverse of all flexibilities summed."""
        k = np.linalg.inv(self.running[:, -1])
        return (k + np.swapaxes(k, -1, -2)) / 2

    @cached_property
    def shares(self) -> Array:
        """P (c, s + 1, 6, 6): relative twist of every segment end per relative twist of the last (theory eq. 50)."""
        return self.running @ self.stiffness[:, None]

    @cached_property
    def ends(self) -> Array:
        """B (c, 12, 12): twist of the first node and relative twist of the last from their displacements."""
        B = np.zeros((len(self.nodes), 12, 12))
        B[:, :6, :6] = np.eye(6)
        B[:, 6:, :6] = -np.eye(6)
        B[:, 6:, 6:] = rigid_arm(-self.arms[:, -1])
        return B

    @cached_property
    def end_stiffness(self) -> Array:
        """Static stiffness (c, 12, 12) over the two end nodes (theory eq. L1)."""
        Bd = self.ends[:, 6:]
        return np.swapaxes(Bd, -1, -2) @ self.stiffness @ Bd

    @cached_property
    def rigid_masses(self) -> Array:
        """Mass (c, s, 6, 6) of every segment moving as a rigid body with the chain's first node."""
        return np.swapaxes(self.X, -1, -2) @ self.m @ self.X

    @cached_property
    def interior_twists(self) -> Array:
        """(c, e - 1, 6, 12): static twists of the nodes between from the displacements of the two end nodes."""
        P = np.take_along_axis(self.shares, self.passed[:, 1:-1, None, None], axis=1)
        return np.concatenate([np.broadcast_to(np.eye(6), P.shape), P], axis=-1) @ self.ends[:, None]

    def numbers(self, model: FullOrderModel) -> Index:
        """Global numbers (copies, c, e + 1) of the nodes passed."""
        return np.array(model.plan.topology.placed[self.name].offset, dtype=np.intp)[:, None, None] + self.nodes

    def transforms(self, model: FullOrderModel) -> Array:
        """G (copies, c, 12, 12): displacements of the end nodes, part's frame, from those of their roots."""
        G = model.plan.node_transforms(self.name, self.nodes[:, [0, -1]].ravel(), model.geometry)
        return block_diagonal(G.reshape(len(G), -1, 2, 6, 6))

    def outward(self, model: FullOrderModel) -> Array:
        """(copies, c, e - 1, 6, 6): displacements of the nodes between, global frame, from twists in the part's."""
        number = self.nodes[:, 1:-1]
        G = model.plan.node_transforms(self.name, number.ravel(), model.geometry)
        return np.swapaxes(G.reshape(len(G), *number.shape, 6, 6), -1, -2) @ rigid_arm(self.arms[:, 1:-1])


def segment_chains(
    model: FullOrderModel, name: str, groups: list[ChainGroup], pieces: int = 1, tapered_pieces: int = TAPERED_PIECES
) -> Iterator[SegmentChains]:
    """Cut chains of elements of one prototype into uniform segments, chains of equal numbers together.

    Every element is cut into `pieces`; tapered ones keep their steps, at most `tapered_pieces`, so that all meshes
    stand for one and the same structure (`Elements.cut`). Raises OptionError for numbers below one.
    """
    if pieces < 1 or tapered_pieces < 1:
        raise OptionError("an element is cut into at least one piece")
    if not groups:
        return
    elements = model.matrices[name].elements
    assert isinstance(elements, ElementSlice)
    cut = elements.cut(pieces, tapered_pieces)
    for group in groups:
        total = cut.counts[group.elements].sum(axis=1)
        for s in np.unique(total):
            own = total == s
            yield _chains(model, name, ChainGroup(group.elements[own], group.reverse[own], group.nodes[own]), cut)


def _chains(model: FullOrderModel, name: str, group: ChainGroup, cut: Cut) -> SegmentChains:
    """Chains with equal numbers of segments."""
    part, positions = model.plan.parts[name], model.geometry.parts[name].positions
    c = len(group.nodes)
    element, place, reverse = _walk(group, cut)
    beam = cut.beam.take(cut.kind[np.cumsum(cut.counts)[element] - cut.counts[element] + place])
    pole = np.repeat(positions[group.nodes[:, 0]], len(element) // c, axis=0)
    X0 = model.matrices[name].T[element, :6, :6] @ rigid_arm(positions[part.connectivity[element, 0]] - pole)
    along = np.zeros((2, len(element), 3))
    along[:, :, 0] = place * beam.length, (place + 1) * beam.length
    Xi, Xj = rigid_arm(along) @ X0
    inverse = np.linalg.inv(Xj)
    F = inverse @ flexibility(1.0, 1.0, beam.section, beam.length, 1.0) @ np.swapaxes(inverse, -1, -2)
    X, k, m = np.concatenate([Xi, Xj], axis=-2), element_stiffness(beam), element_mass(beam)
    X[reverse] = X[reverse][:, _SWAP]
    for A in (k, m):
        A[reverse] = A[reverse][:, _SWAP][:, :, _SWAP]
    X, k, m, F = (A.reshape(c, -1, *A.shape[1:]) for A in (X, k, m, F))
    running = np.concatenate([np.zeros((c, 1, 6, 6)), np.cumsum(F, axis=1)], axis=1)
    steps = np.cumsum(cut.counts[group.elements], axis=1)
    passed = np.concatenate([np.zeros((c, 1), dtype=np.intp), steps], axis=1)
    arms = positions[group.nodes] - positions[group.nodes[:, :1]]
    return SegmentChains(name, group.nodes, arms, passed, X, k, m, running)


def _walk(group: ChainGroup, cut: Cut) -> tuple[Index, Index, NDArray[np.bool_]]:
    """Every segment in walking order: its element, its place in it from the element's start, and whether it is walked
    from j to i."""
    elements, reverse = group.elements.ravel(), group.reverse.ravel()
    count = cut.counts[elements]
    each = np.repeat(np.arange(len(elements)), count)
    walked = np.arange(len(each)) - np.repeat(np.cumsum(count) - count, count)
    element, backwards = elements[each], reverse[each]
    return element, np.where(backwards, count[each] - 1 - walked, walked), backwards
