"""Where states lie beyond what is known of them: members bent or twisted too far, nodes half held by the ground."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from flexura.errors import Diagnostic
from flexura.motion.bending import bends, edge_strains
from flexura.motion.elements import Frames
from flexura.motion.model import MovingModel
from flexura.motion.se3 import rotation_vector

STRETCH = 2e-4
"""Strain of the edges of members by twist that is told: a tenth or less of what yields."""

HELD_TURN = 1e-3
"""Rotation, rad, that is told where the ground holds the one about its axis, and it depends on the way."""


def beyond(model: MovingModel, states: Sequence[Frames]) -> tuple[Diagnostic, ...]:
    """What is beyond its limit in some states, each place at its worst: elements that bend further than strains are
    known, superelements that turn within themselves, members whose edges twist stretches by what stresses should
    contain, and nodes of which the ground holds one rotation alone."""
    found: list[Diagnostic] = []
    for limits in (_bent, _stretched, _partly_held):
        worst: dict[str, Diagnostic] = {}
        for frames in states:
            for own in limits(model, frames):
                if own.place not in worst or own.value / own.limit > worst[own.place].value / worst[own.place].limit:
                    worst[own.place] = own
        found += worst.values()
    return tuple(found)


def _bent(model: MovingModel, frames: Frames) -> Iterator[Diagnostic]:
    """Members and superelements that bend further within an element than is accurate."""
    return (bend.exceeded for bend in bends(model, frames))


def _stretched(model: MovingModel, frames: Frames) -> Iterator[Diagnostic]:
    """Members whose edges twist stretches by what stresses should contain."""
    for name, strain in edge_strains(model, frames).items():
        if strain > STRETCH:
            text = f"member {name}: twist stretches its edges by a further {strain:.2g}, which stresses do not contain"
            yield Diagnostic("twist", name, strain, STRETCH, "1", text)


def _partly_held(model: MovingModel, frames: Frames) -> Iterator[Diagnostic]:
    """Nodes of which the ground holds one rotation alone and which turn about both other axes.

    How far they then turn about its axis depends on the way: by half the product of the other two between the straight
    way and one after the other.
    """
    held = model.dof[:-1, 3:] < 0
    nodes = np.flatnonzero((held.sum(axis=1) == 1) & (model.root[:-1] == np.arange(len(held))) & model.rest.placed[:-1])
    for node in nodes.tolist():
        axis = int(np.argmax(held[node]))
        turn = rotation_vector(frames.R[node])
        turned = max(abs(float(turn[axis])), abs(float(turn[axis - 1] * turn[axis - 2])) / 2)
        if turned > HELD_TURN:
            name = model.design.plan.topology.node_names[node]
            text = (
                f"{name}: the ground holds its rotation about {'xyz'[axis]} alone, at every instant; as it turns about"
                f" both other axes, {turned:.3g} rad of its rotation vector there depend on the path"
            )
            yield Diagnostic("rotation", name, turned, HELD_TURN, "rad", text)
