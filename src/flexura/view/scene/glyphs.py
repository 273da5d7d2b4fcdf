"""Springs as coils and dashpots as pistons in pots, of lines."""

from __future__ import annotations

import numpy as np

from flexura.view.scene.meshes import Array
from flexura.view.scene.scene import Collector, Kind

_SIDES = 16
"""Corners of the rings of a dashpot."""


def add_glyph(
    collector: Collector, kind: Kind, name: str, ends: Array, motions: Array, size: float, grounded: bool = False
) -> None:
    """Add a spring or a dashpot between two ends (2, 3), m, that move by `motions` (2, 3), with a square at the second
    where it is `grounded`."""
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    if length == 0:
        return
    x = along / length
    side = np.cross(x, np.eye(3)[np.argmin(abs(x))])
    side /= np.linalg.norm(side)
    across = np.stack([side, np.cross(x, side)])
    width = min(0.022 * size, 0.2 * length)
    for share, swing, follows in _coil(length, width) if kind is Kind.SPRING else _pot(width):
        path = ends[0] + share[:, None] * along + swing @ across
        collector.path(path, motions[0] + follows[:, None] * (motions[1] - motions[0]), kind, name)
    if grounded:
        cross = 1.4 * width * np.stack([side, across[1], -side, -across[1], side])
        collector.path(ends[1] + cross, np.zeros((5, 3)) + motions[1], kind, name)


_Paths = list[tuple[Array, Array, Array]]
"""Paths: of every point the share (p,) of the way, the distances (p, 2) from the axis, m, and how far it follows the
second end, (p,)."""


def _coil(length: float, width: float) -> _Paths:
    """The whole of it is stretched."""
    coils = int(np.clip(0.7 * length / (1.6 * width), 4, 16))
    turns = np.arange(8 * coils + 1) / (8 * coils)
    angle = 2 * np.pi * coils * turns
    share = np.concatenate([[0, 0.15], 0.15 + 0.7 * turns, [0.85, 1.0]])
    swing = np.concatenate([np.zeros((2, 2)), np.stack([np.cos(angle), np.sin(angle)], axis=1), np.zeros((2, 2))])
    return [(share, width * swing, share)]


def _pot(width: float) -> _Paths:
    """A rod with its piston moves with the first end, the pot around it with the second."""
    angle = 2 * np.pi * np.arange(_SIDES + 1) / _SIDES
    ring = width * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    axis, own, other = np.zeros((2, 2)), np.zeros, np.ones
    bottom = np.concatenate([axis[:1], ring])
    paths = [
        (np.array([0.0, 0.5]), axis, own(2)),
        (np.full(_SIDES + 2, 0.5), 0.75 * bottom, own(_SIDES + 2)),
        (np.full(_SIDES + 1, 0.3), ring, other(_SIDES + 1)),
        (np.full(_SIDES + 2, 0.75), bottom, other(_SIDES + 2)),
        (np.array([0.75, 1.0]), axis, other(2)),
    ]
    walls = [(np.array([0.3, 0.75]), ring[[k, k]], other(2)) for k in range(0, _SIDES, _SIDES // 4)]
    return paths + walls
