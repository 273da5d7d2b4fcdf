"""How far superelements of which no more is known than their stiffness at rest may be off where they are bent."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.beam import member_frame
from flexura.motion.clusters import Superelements
from flexura.motion.elements import Frames
from flexura.motion.layout import PLAIN
from flexura.motion.strain import beam_strain

STEPS = 4
"""Steps of Newton's method for the beam under the same forces."""

MEANT = 1e-9
"""Stiffness, over the largest with a diagonal of ones, below which a motion meets none."""


def softer_as_beams(group: Superelements, frames: Frames, motions: Array) -> Array:
    """Twice the energy (e, k), N m, that motions (e, 6f, k) of their f frames meet in superelements in a state, less
    what they would meet in uniform beams of the same stiffness at rest between the first node and each other one, the
    largest of these (theory eq. G32).

    Beams soften as they bend, by (G10)-(G12); superelements with a quadratic energy do not. Zero for those whose energy
    knows more, for nodes at one place, and where a beam would be stiffer: motions of it would not be these.
    """
    found = np.zeros((len(group.node), motions.shape[2]))
    if group.energy.cubic.size or group.own < 2:
        return found
    d, moved = group.deformation(frames), group.rows(frames) @ motions
    for e in range(len(found)):
        for i in range(group.own - 1):
            own = slice(6 * i, 6 * i + 6)
            change = _change(group.energy.stiffness[e], own, group.rest[e, i, :3], d[e, own])
            found[e] = np.maximum(found[e], np.einsum("ik,ij,jk->k", moved[e, own], change, moved[e, own]))
    return found


def _change(K: Array, own: slice, line: Array, d: Array) -> Array:
    """The stiffness (6, 6) of a node at `line` (3,) from the first, all others free, less that of a beam of this
    stiffness under the forces of the deformation d (6,)."""
    length = float(np.linalg.norm(line))
    if not length > 0 or not d.any():
        return np.zeros((6, 6))
    others = np.delete(np.arange(len(K)), np.arange(6) + own.start)
    coupled = K[own, others]
    k = K[own, own] - coupled @ np.linalg.pinv(K[np.ix_(others, others)], rcond=1e-12) @ coupled.T
    turn = _principal(k, line[None] / length)
    k, d = turn @ k @ turn.T, turn @ d
    k = (k + k.T) / 2
    if not (np.diag(k) > 0).all():
        return np.zeros((6, 6))
    scale = 1 / np.sqrt(np.diag(k))
    values, vectors = np.linalg.eigh(scale[:, None] * k * scale)
    meant = values > MEANT * values[-1]
    kept = scale[:, None] * vectors[:, meant] / np.sqrt(values[meant])
    beam, force, at = beam_strain(k[None], np.array([length]), PLAIN), kept.T @ k @ d, d
    for _ in range(STEPS):
        _, gradient, bent = beam.response(at[None])
        at = at + kept @ np.linalg.solve(kept.T @ bent[0] @ kept, force - kept.T @ gradient[0])
    return turn.T @ (k - beam.response(at[None])[2][0]) @ turn


def _principal(k: Array, axis: Array) -> Array:
    """Axes (6, 6), as rows for both halves: along a line (1, 3), and across it where bending stiffness is least and
    largest."""
    R = member_frame(axis, np.eye(3)[np.argmin(np.abs(axis), axis=-1)])[0]
    _, across = np.linalg.eigh(R[1:] @ k[3:, 3:] @ R[1:].T)
    R[1:] = (across * np.sign(np.linalg.det(across))).T @ R[1:]
    return np.kron(np.eye(2), R)
