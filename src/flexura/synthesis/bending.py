"""How far limbs are strained over a stroke, roughly: which designs are worth a stroke.

Blocks and nodes between members go where it takes the least energy. Of a uniform member of length L and thickness t
whose ends move by d across it against each other, without a turn, the strain is 3 t d / L^2, and t a / (2 L) where they
turn by a about its middle (any beam table); a notch of radius r bends over about 1.25 sqrt(r t). Limbs by themselves
are strained as in statics within a third; what is verified is the stroke itself.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexura.arrays import Array
from flexura.synthesis.limbs import LEAF, NECK, PROFILES, ROD, STOUT, WIDE, WIRE, seen_from
from flexura.synthesis.patterns import Pattern
from flexura.synthesis.topologies import Topology
from flexura.synthesis.wish import Room, Wish

BENDS_OVER = 1.25
"""Length over which a notch bends, over the root of its radius and web."""

SHEAR = 1 / 2.6
"""Shear modulus over Young's."""


def strain_over_stroke(topology: Topology, designs: Mapping[str, Array], wish: Wish, room: Room) -> Array:
    """The largest strain (n,) of the limbs at the end of the stroke, of designs by the names of their sizes."""
    ways = 2 if topology.drive is not None else 1  # the platform is drawn where its stacks are off, at one end
    twist = ways * wish.stroke_twist
    shift, turned = room.turn.T @ twist[:3], room.turn.T @ twist[3:]
    axis = np.array([*room.middle[:2], 0.0])
    n, strains = len(next(iter(designs.values()))), []
    for letter, own in zip("abc", topology.patterns, strict=False):
        sizes = {name: designs[f"{letter}_{name}"] for name in own.kind.sizes if name != own.kind.pinned}
        sizes |= {own.kind.pinned: np.full(n, own.held)} if own.kind.pinned else {}
        of_twist = _strains(own, sizes)
        for turn in own.turns():
            head, axes = turn @ (own.site.head(room) - axis) + axis, (turn @ own.axes).T
            moved = axes @ (shift + np.cross(turned, head - room.about))
            both = np.concatenate([moved, np.linalg.det(axes) * (axes @ turned)])
            strains.append(np.abs(of_twist @ both).sum(axis=-1).max(axis=0))
    return np.max([np.zeros(n), *strains], axis=0)


def _strains(own: Pattern, sizes: Mapping[str, Array]) -> Array:
    """Strains (members, n, 6, 6) of each member of designs, by what its ends do to each other about its middle along
    its (m, e, d), by twists of the head along axes of the limb."""
    kind = own.kind
    n = len(next(iter(sizes.values())))
    points = {
        name: sum((sizes[size][:, None] * np.array(c) for size, c in terms.items()), np.zeros((n, 3)))
        for name, terms in kind.nodes.items()
    }
    parts = ["platform", *sorted(set(kind.parts.values()) - {"platform", "base"}), "base"]
    K, members = np.zeros((n, 6 * len(parts), 6 * len(parts))), []
    for a, b, profile in kind.members.values():
        B, seen = np.zeros((n, 6, 6 * len(parts))), seen_from(points[a], points[b])
        for node, sign in ((a, 1.0), (b, -1.0)):
            k = 6 * parts.index(kind.parts[node])
            B[:, :, k : k + 6] += sign * seen
        stiffness, strain = _member(profile, sizes, np.linalg.norm(points[b] - points[a], axis=-1))
        K += B.transpose(0, 2, 1) @ (stiffness[:, :, None] * B)
        members.append((strain[:, :, None], B))
    unit = np.broadcast_to(np.eye(6), (n, 6, 6))
    inner = np.linalg.solve(K[:, 6:-6, 6:-6], -K[:, 6:-6, :6])
    moved = np.concatenate([unit, inner, np.zeros_like(unit)], axis=1)
    return np.array([strain * (B @ moved) for strain, B in members])


def _member(profile: str, sizes: Mapping[str, Array], length: Array) -> tuple[Array, Array]:
    """Stiffness (n, 6) of a uniform member against what its ends do to each other about its middle, along (m, e, d),
    over Young's modulus, and the strain (n, 6) that each of what it leaves free brings."""
    thin = sizes[PROFILES[profile].thin]
    free = np.isin(np.arange(6), PROFILES[profile].free)
    wide = sizes["width"] if profile in WIDE else thin
    if not free.any():
        thin = 3 * thin if profile == ROD else thin + STOUT * sizes["radius"]
        wide = wide if profile in WIDE else thin
    elif profile == NECK:
        length = length / 2
    elif profile not in (LEAF, WIRE):
        length = BENDS_OVER * np.sqrt(sizes["radius"] * thin)
    about_e, about_m, area = wide * thin**3 / 12, wide**3 * thin / 12, wide * thin
    twist = SHEAR * wide * np.minimum(thin, wide) ** 3 / 3
    stiffness = [12 * about_e / length**2, 12 * about_m / length**2, area, about_m, about_e, twist]
    turned = 3**0.5 * SHEAR * thin  # of which von Mises' stress is as large; edges of strips bend as beams do as well
    turned = np.hypot(turned, 1.2 * thin * wide / length) if profile in WIDE else turned / 2
    strain = [3 * thin / length, 3 * wide / length, np.ones_like(thin), wide / 2, thin / 2, turned]
    return np.stack(stiffness, axis=-1) / length[:, None], np.stack(strain, axis=-1) * free / length[:, None]
