"""How far limbs are strained over a stroke, roughly: which designs are worth a stroke.

A member of length L and thickness t that is clamped at both ends is strained by 3 t d / L^2 where its end moves by d
across it, and by 2 t a / L where it turns by a (any beam table); a notch of radius r bends over about 2.5 sqrt(r t).
What is verified is the stroke itself; here designs are only told apart.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexura.arrays import Array
from flexura.synthesis.patterns import Pattern
from flexura.synthesis.topologies import Topology
from flexura.synthesis.wish import DOFS, Room, Wish

NOTCH = 2.5


def strain_over_stroke(topology: Topology, designs: Mapping[str, Array], wish: Wish, room: Room) -> Array:
    """The largest strain (n,) of the limbs at the end of the stroke, of designs by the names of their sizes."""
    twist = np.zeros(6)
    for name, amount in wish.strokes.items():
        twist[DOFS.index(name)] = amount
    shift, turned = room.turn.T @ twist[:3], room.turn.T @ twist[3:]
    strains = []
    for letter, own in zip("abc", topology.patterns, strict=False):
        sizes = {name: designs[f"{letter}_{name}"] for name in own.kind.sizes}
        strains += [_strain(own, sizes, turn, room, shift, turned) for turn in own.turns()]
    return np.max(strains, axis=0)


def _strain(own: Pattern, sizes: Mapping[str, Array], turn: Array, room: Room, shift: Array, turned: Array) -> Array:
    """Of one copy."""
    axis = np.array([*room.middle[:2], 0.0])
    head = turn @ (own.site.head(room) - axis) + axis
    axes = (turn @ own.axes).T
    moved, rotated = np.abs(axes @ (shift + np.cross(turned, head - room.about))), np.abs(axes @ turned)
    thin = sizes[next(name for name in ("thickness", "diameter", "web") if name in sizes)]
    if "radius" in sizes:
        return thin * (rotated[1] + (0.0 if own.kind.width else rotated[0])) / (NOTCH * np.sqrt(sizes["radius"] * thin))
    length = sizes["length"]
    bent = 3 * moved[0] / length**2 + 2 * rotated[1] / length
    if own.kind.is_round:
        bent = bent + 3 * moved[1] / length**2 + 2 * rotated[0] / length
    return thin * (bent + rotated[2] / length)
