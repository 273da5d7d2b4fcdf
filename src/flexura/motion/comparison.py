"""States of the low order that turns beside the full one: what the full order lacks for equilibrium there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.motion.elements import Frames
from flexura.motion.equilibrium import Equations, Equilibrium
from flexura.motion.expansion import SOFTEST
from flexura.motion.leaves import Leaf
from flexura.motion.path import displacement
from flexura.motion.substructures import Condensed, Flags, Substructure
from flexura.motion.superelements import Superelements
from flexura.motion.turning import TurningModel

NO_WORK = 1e-9
"""Work of drives over the strain energy that counts as none: where loads alone are on, it is that of round-off."""


class Comparison(NamedTuple):
    """The `states` of the full order with the kept frames where the low one has them and all else in equilibrium,
    `error` (s,), the step to its own equilibrium that is left, over the motion from rest, and of every kind of
    substructure its `share` (s,) in this, in energy, and how far its `stiffness` (s,) is off, over that at rest (theory
    eqs. G29-G30)."""

    states: list[Equilibrium]
    error: Array
    share: dict[int, Array]
    stiffness: dict[int, Array]


def against_full(
    turning: TurningModel, equations: Equations, full: Equations, states: Sequence[Equilibrium]
) -> Comparison:
    """Compare states of equilibrium of the low order, those of `equations`, with the full one."""
    frames = [full.model.rest._replace(x=state.frames.x.copy(), R=state.frames.R.copy()) for state in states]
    missing = [np.zeros(turning.low.dof.shape) for _ in states]
    share: dict[int, Array] = {}
    stiffness: dict[int, Array] = {}
    for group, places in turning.groups:
        for kind in dict.fromkeys(kind for kind, _ in places):
            at = [i for i, (own, _) in enumerate(places) if own == kind]
            found = _compared(turning.kinds[kind], group, at, states, frames, missing)
            share[kind], stiffness[kind] = found
    for kind, leaves in turning.leaves.items():
        share[kind], stiffness[kind] = _compared_leaves(leaves, turning, states, frames, missing)
    for equal in turning.kinds:
        if equal[0].k == 1:
            _place(equal, frames, _rigid(equal[0], len(frames) * len(equal)))
    error = [_error(equations, turning.kept, state, own) for state, own in zip(states, missing, strict=True)]
    on_full = [
        state._replace(frames=own, tangent=full.tangent(own, state.loads, state.drive)[0])
        for state, own in zip(states, frames, strict=True)
    ]
    return Comparison(on_full, np.array(error), share, stiffness)


def _compared(
    equal: Sequence[Substructure],
    group: Superelements,
    at: list[int],
    states: Sequence[Equilibrium],
    frames: list[Frames],
    missing: list[Array],
) -> tuple[Array, Array]:
    """The share (s,) of equal substructures, elements `at` of a group, in the error of states, and how far their
    stiffness is off; adds to the forces that are missing for equilibrium of the full order, and puts the frames inside
    where they are."""
    n = 6 * (group.count - 1)
    d = np.array([group.deformation(state.frames) for state in states])
    responses = [group.energy.response(own) for own in d]
    force = np.array([own[1][at, :n] for own in responses])
    hessian = np.array([own[2][at, :n, :n] for own in responses])
    exact = equal[0].condensed(d[:, at, :n].reshape(-1, n))
    off = force - exact.force.reshape(force.shape)
    for state, own, more in zip(states, off, missing, strict=True):
        held = (own[:, None] @ group.rows(state.frames)[at, :n])[:, 0]
        np.add.at(more, group.node[at].ravel(), held.reshape(-1, 6))
    _place(equal, frames, exact)
    return _off(off, hessian, exact, group.energy.stiffness[at[0], :n, :n], states)


def _compared_leaves(
    leaves: Sequence[Leaf],
    turning: TurningModel,
    states: Sequence[Equilibrium],
    frames: list[Frames],
    missing: list[Array],
) -> tuple[Array, Array]:
    """Likewise of equal leaves, whose own inner frames are in equilibrium for this as those of the full order are."""
    few = turning.as_substructure(leaves[0])
    d = np.array([[leaf.ends.deformation(state.frames)[0] for leaf in leaves] for state in states])
    inside = [[(leaf.few_inside(state.frames), leaf.fine_inside(state.frames)) for leaf in leaves] for state in states]
    own, full = (
        (np.array([at[k][0] for row in inside for at in row]), np.array([at[k][1] for row in inside for at in row]))
        for k in (0, 1)
    )
    answer, exact = few.condensed(d.reshape(-1, 6), own), leaves[0].of.condensed(d.reshape(-1, 6), full)
    off = (answer.force - exact.force).reshape(d.shape)
    for state, of_state, more in zip(states, off, missing, strict=True):
        for leaf, force in zip(leaves, of_state, strict=True):
            more[leaf.of.frames[:2]] += (force @ leaf.ends.rows(state.frames)[0]).reshape(2, 6)
    _place([leaf.of for leaf in leaves], frames, exact)
    at_rest = leaves[0].of.condensed(np.zeros((1, 6))).tangent[0]
    return _off(off, answer.tangent.reshape(*d.shape, 6), exact, at_rest, states)


def _off(
    off: Array, hessian: Array, exact: Condensed, at_rest: Array, states: Sequence[Equilibrium]
) -> tuple[Array, Array]:
    """The share (s,) in the error of states by forces (s, e, d) that are off, and how far stiffnesses are off."""
    energy = max((state.tangent.forces.energy for state in states), default=0.0) or 1.0
    root = _inverse_root(at_rest)
    share = np.sqrt(((off @ root) ** 2).sum(axis=-1).max(axis=1) / (2 * energy))
    hessian = hessian - exact.tangent.reshape(hessian.shape)
    return share, np.abs(root.T @ hessian @ root).max(axis=(1, 2, 3))


def _inverse_root(k: Array) -> Array:
    """Columns X (d, d) for which X' k X = 1; zero for what has no stiffness."""
    size = np.sqrt(np.maximum(np.diag(k), 1e-300))
    values, vectors = np.linalg.eigh(k / size[:, None] / size)
    root = np.where(values > SOFTEST * values[-1], 1 / np.sqrt(np.maximum(values, 1e-300)), 0.0)
    return vectors * root / size[:, None]


def _rigid(substructure: Substructure, count: int) -> Condensed:
    """What hangs at a single frame goes along with it."""
    none = np.empty((count, 0))
    x = np.tile(substructure.rest, (count, 1))
    return Condensed(none, none, Frames.at_rest(x, np.ones(len(x), dtype=bool)))


def _place(equal: Sequence[Substructure], frames: list[Frames], exact: Condensed) -> None:
    """Put the frames inside equal substructures where they are, state by state and substructure by substructure."""
    count, k = len(equal[0].frames), equal[0].k
    x = exact.frames.x.reshape(len(frames), len(equal), count, 3)[:, :, k:]
    R = exact.frames.R.reshape(len(frames), len(equal), count, 3, 3)[:, :, k:]
    for s, state in enumerate(frames):
        for i, substructure in enumerate(equal):
            first, inside = substructure.frames[0], substructure.frames[k:]
            axes = state.R[first] @ substructure.turn
            state.x[inside] = state.x[first] + state.R[first] @ substructure.arm[0] + x[s, i] @ axes.T
            state.R[inside] = axes @ R[s, i] @ substructure.turn.T


def _error(equations: Equations, kept: Flags, state: Equilibrium, missing: Array) -> float:
    """The step of kept frames (n + 1,) to equilibrium under forces (n + 1, 6) that are missing over the motion from
    rest, or what it changes in the work of the drives, whichever is larger."""
    if not np.isfinite(missing).all():
        return np.inf
    step, more = equations.solver(state.tangent)(equations.free(missing), np.zeros(len(state.drive)))
    moved = equations.free(displacement(equations.model.rest, state.frames))
    scale = equations.scale * equations.free(np.repeat(kept[:, None].astype(float), 6, axis=1))
    size = float(np.abs(moved * scale).max(initial=0.0))
    if size == 0.0:
        return 0.0
    travel = equations.travelled(state.frames)
    work = max(float(np.abs(state.drive * travel).sum()), NO_WORK * state.tangent.forces.energy)
    of_drives = float(np.abs(more * travel).sum()) / work if work > 0 else 0.0
    return max(float(np.abs(step * scale).max(initial=0.0)) / size, of_drives)
