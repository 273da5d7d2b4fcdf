"""The low-order model that turns: each substructure a superelement in its own frame, with an energy of fourth order.

The energy by the deformation of a substructure is expanded with all inside in equilibrium (Koiter 1945). What the full
order says in states of the low one tells how far this is off.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.beam import skew
from flexura.errors import SolverError
from flexura.motion.elements import Frames, Group
from flexura.motion.equilibrium import Equations, Equilibrium
from flexura.motion.layout import add_weight
from flexura.motion.model import MovingModel
from flexura.motion.path import displacement
from flexura.motion.substructures import Condensed, Flags, Substructure, middle, partition, sixes, taken
from flexura.motion.superelements import Polynomial, Sagging, Superelements

MOST_DEFORMATIONS = {2: 60, 3: 30}
"""Deformations of a substructure up to which terms of forces of an order are worked out."""

STIFFNESS_CHANGE = 0.01
"""Relative change of the stiffness at the deformations from which derivatives are differences."""

LARGEST_TURN = 0.02
"""Rotations there at most, rad, and displacements over the size of the substructure."""

SOFTEST = 1e-10
"""Stiffness over the largest one, of what deforms without resistance."""

ATTEMPTS = 6


def expanded(substructure: Substructure, order: int) -> Polynomial:
    """The energy with forces of so high an order, 1 to 3, in the deformations.

    Third and fourth derivatives are central differences of exact condensed stiffnesses, in directions of equal energy
    and symmetrised (theory eq. G28). Raises SolverError when there is no equilibrium inside near rest.
    """
    n = 6 * (substructure.k - 1)
    undeformed = substructure.condensed(np.zeros((1, n))).tangent[0]
    if not np.isfinite(undeformed).all():
        raise SolverError(f"{substructure.name} has no equilibrium inside, undeformed already")
    if order < 2 or n > MOST_DEFORMATIONS[2]:
        return Polynomial.linear(undeformed[None])
    unit = np.tile([substructure.size] * 3 + [1.0] * 3, substructure.k - 1)
    values, vectors = np.linalg.eigh(unit[:, None] * undeformed * unit)
    root = np.sqrt(np.maximum(values, SOFTEST * values[-1]))
    V, back = unit[:, None] * vectors / root, (vectors * root).T / unit
    none = V.T @ undeformed @ V
    size, sides = _amplitude(substructure, V, unit, none)
    cubic = (sides[0] - sides[1]) / (2 * size)
    c = _symmetric(np.moveaxis(cubic, 0, -1))
    for axis in range(3):
        c = np.moveaxis(np.tensordot(c, back, axes=(axis, 0)), -1, axis)
    if order < 3 or n > MOST_DEFORMATIONS[3]:
        return Polynomial(undeformed[None], c[None], np.empty((0,) * 5))
    q = _quartic(substructure, V, size, sides, none)
    for axis in range(4):
        q = np.moveaxis(np.tensordot(q, back, axes=(axis, 0)), -1, axis)
    return Polynomial(undeformed[None], c[None], q[None])


def _amplitude(substructure: Substructure, V: Array, unit: Array, none: Array) -> tuple[float, Array]:
    """How far to go along the columns of V, and stiffnesses (2, d, d, d) that far to both sides."""
    size = LARGEST_TURN / float(np.abs(V / unit[:, None]).max())
    for _ in range(ATTEMPTS):
        sides = _stiffness(substructure, np.concatenate([size * V.T, -size * V.T]), V).reshape(2, *(len(V),) * 3)
        change = float(np.abs(sides - none).max())
        if change < 2 * STIFFNESS_CHANGE:
            return size, sides
        size *= 0.1 if not np.isfinite(change) else max(STIFFNESS_CHANGE / change, 0.1)
    raise SolverError(f"{substructure.name} changes its stiffness at once as it deforms")


def _stiffness(substructure: Substructure, d: Array, V: Array) -> Array:
    """Stiffnesses at deformations (m, d) by the columns of V."""
    return V.T @ substructure.condensed(d).tangent @ V


def _quartic(substructure: Substructure, V: Array, size: float, sides: Array, none: Array) -> Array:
    """Fourth derivatives (d, d, d, d) by the columns of V.

    Indices fall into three classes, so that of any four two are of one class: stiffnesses along the sums of such pairs
    are enough.
    """
    n = len(V)
    pairs = [(i, j) for i, j in combinations(range(n), 2) if i % 3 == j % 3]
    both = np.array([V[:, i] + V[:, j] for i, j in pairs]).reshape(-1, n)
    mixed = _stiffness(substructure, size * np.concatenate([both, -both]), V).reshape(2, -1, n, n)
    q, known = np.zeros((n,) * 4), np.zeros((n, n))
    second = sides.sum(axis=0) - 2 * none
    for i in range(n):
        q[i, i], known[i, i] = second[i] / size**2, 1.0
    for (i, j), one, other in zip(pairs, *mixed, strict=True):
        q[i, j] = q[j, i] = (one + other - 2 * none - second[i] - second[j]) / (2 * size**2)
        known[i, j] = known[j, i] = 1.0
    weight = _symmetric(np.broadcast_to(known[:, :, None, None], q.shape))
    return _symmetric(q) / weight


def _symmetric(tensor: Array) -> Array:
    """The mean over all orders of the indices."""
    orders: Iterable[tuple[int, ...]] = permutations(range(tensor.ndim))
    transposed = [np.transpose(tensor, order) for order in orders]
    return np.asarray(sum(transposed) / len(transposed))


SAME_FREQUENCY = 1.001
"""Modes of frequencies this near are kept together."""


@dataclass(frozen=True)
class TurningModel:
    """A moving model of low order and the one of full order that it stands for.

    `low` has the frames of `full`, of which those inside substructures stay where they are and have no displacements.
    `kinds` are the substructures, equal ones together, and `groups` the superelements of `low` that stand for them,
    each with the kind and the number among its equals of every element. `kept` (n + 1,) are the frames between; modes
    of substructures by themselves are kept `up_to` a frequency, rad/s, and `made_finer` names what was divided.
    The first frames inside hold the amplitudes of modes.
    """

    full: MovingModel
    low: MovingModel
    kinds: tuple[tuple[Substructure, ...], ...]
    groups: tuple[tuple[Superelements, tuple[tuple[int, int], ...]], ...]

    kept: Flags
    up_to: float
    made_finer: tuple[str, ...] = ()

    @staticmethod
    def of(full: MovingModel, kept: Flags, order: int = 3, up_to: float = 0.0) -> TurningModel:
        """Substructures between kept frames (n + 1,) with forces of so high an order in their deformations, 1 to 3, and
        the modes of each by itself up to a frequency, rad/s.

        Raises SolverError for one that has no equilibrium near rest.
        """
        kinds = tuple(tuple(own) for own in partition(full, kept))
        by_size: dict[tuple[int, int], list[int]] = {}
        modes = [int((own[0].frequencies <= up_to).sum()) for own in kinds]
        for kind, own in enumerate(kinds):
            by_size.setdefault((own[0].k, sixes(modes[kind])), []).append(kind)
        inertia = full.inertia.copy()
        inside = np.zeros(len(kept), dtype=bool)
        for own in (s for equal in kinds for s in equal):
            inside[own.frames[own.k :]] = True
            if own.k == 1:
                inertia[own.frames[0]] += _hanging(own)
        inertia[inside] = 0.0
        groups = tuple(
            _group([(kind, kinds[kind], modes[kind]) for kind in own], order)
            for (k, _), own in sorted(by_size.items())
            if k > 1
        )
        low = _low(full, kinds, modes, inside, inertia, groups)
        return TurningModel(full, low, kinds, groups, kept, up_to)

    def finer(self, kinds: Iterable[int]) -> TurningModel | None:
        """With the middle frame of all substructures of some kinds kept; None where none of them has any."""
        kept, names = self.kept.copy(), dict.fromkeys(self.made_finer)
        for kind in kinds:
            names |= dict.fromkeys(substructure.name for substructure in self.kinds[kind])
            for substructure in self.kinds[kind]:
                kept[middle(substructure, kept)] = True
        if kept.sum() == self.kept.sum():
            return None
        return replace(TurningModel.of(self.full, kept, up_to=self.up_to), made_finer=tuple(names))

    def quicker(self) -> TurningModel | None:
        """With the slowest modes of substructures by themselves that it has not, None where it has all."""
        inside = np.concatenate([np.empty(0), *(equal[0].frequencies for equal in self.kinds)])
        more = inside[inside > self.up_to]
        if not len(more):
            return None
        up_to = SAME_FREQUENCY * float(more.min())
        return replace(TurningModel.of(self.full, self.kept, up_to=up_to), made_finer=self.made_finer)


def _hanging(substructure: Substructure) -> Array:
    """Inertia (6, 6) of what hangs at one frame, in the axes of the frame at rest."""
    T = np.zeros((6, 6))
    T[:3, :3] = T[3:, 3:] = substructure.turn.T
    T[:3, 3:] = -substructure.turn.T @ skew(substructure.arm[0])
    return T.T @ substructure.with_modes(0) @ T


def _group(
    kinds: Sequence[tuple[int, Sequence[Substructure], int]], order: int
) -> tuple[Superelements, tuple[tuple[int, int], ...]]:
    """Superelements of substructures between equally many frames, with modes that take equally many."""
    energies, masses, places = [], [], []
    every: list[Substructure] = []
    k, frames = kinds[0][1][0].k, sixes(kinds[0][2])
    for kind, equal, modes in kinds:
        stiffness = np.append(equal[0].frequencies[:modes] ** 2, np.zeros(6 * frames - modes))
        energies.append(expanded(equal[0], order).with_amplitudes(stiffness).placed(len(equal)))
        masses.append(np.repeat(equal[0].with_modes(modes)[None], len(equal), axis=0))
        places += [(kind, copy) for copy in range(len(equal))]
        every += equal
    rest = np.zeros((len(every), k - 1, 6))
    rest[..., :3] = [substructure.rest[1:k] for substructure in every]
    node = np.array([substructure.frames[: k + frames] for substructure in every])
    axes, arm = (
        np.array([substructure.turn for substructure in every]),
        np.array([substructure.arm for substructure in every]),
    )
    group = Superelements(node, k, axes, arm, rest, Polynomial.joined(energies), np.concatenate(masses))
    return group, tuple(places)


def _low(
    full: MovingModel,
    kinds: Sequence[Sequence[Substructure]],
    modes: Sequence[int],
    inside: Flags,
    inertia: Array,
    groups: Sequence[tuple[Superelements, tuple[tuple[int, int], ...]]],
) -> MovingModel:
    """The model with superelements instead of substructures."""
    elements: list[Group] = []
    names: list[tuple[str, ...]] = []
    numbers: dict[int, int] = {}
    for g, group in enumerate(full.elements):
        gone = np.concatenate(
            [np.empty(0, dtype=np.intp), *(substructure.rows[g] for equal in kinds for substructure in equal)]
        )
        left = np.setdiff1d(np.arange(len(group.node)), gone)
        if len(left):
            numbers[g] = len(elements)
            elements.append(taken(group, left) if len(gone) else group)
            names.append(tuple(full.names[g][i] for i in left))
    for group, places in groups:
        elements.append(group)
        names.append(tuple(kinds[kind][copy].name for kind, copy in places))
    dof, placed = np.where(inside[:, None], -1, full.dof), full.rest.placed.copy()
    for equal, count in zip(kinds, modes, strict=True):
        for substructure in equal:
            amplitudes = substructure.frames[substructure.k : substructure.k + sixes(count)]
            dof[amplitudes] = np.where(np.arange(6 * len(amplitudes)).reshape(-1, 6) < count, 0, -1)
            placed[amplitudes] = False
    rest = full.rest._replace(placed=placed)
    dof[dof >= 0] = np.arange((dof >= 0).sum())
    weight = inertia[..., :3].copy()
    for group in elements:
        add_weight(weight, group, rest)
    sagging = Sagging.of([group for group in elements if isinstance(group, Superelements)], rest)
    return replace(
        full,
        rest=rest,
        dof=dof,
        elements=tuple(elements),
        names=tuple(names),
        actuators={name: numbers[g] for name, g in full.actuators.items()},
        inertia=inertia,
        weight=weight,
        sagging=sagging,
    )


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
    for equal in turning.kinds:
        if equal[0].k == 1:
            _place(equal, frames, _rigid(equal[0], len(frames) * len(equal)))
    error = [_error(equations, state, own) for state, own in zip(states, missing, strict=True)]
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
    exact = equal[0].condensed(d[:, at, :n].reshape(-1, n))
    off = force - exact.force.reshape(force.shape)
    for state, own, more in zip(states, off, missing, strict=True):
        held = (own[:, None] @ group.rows(state.frames)[at, :n])[:, 0]
        np.add.at(more, group.node[at].ravel(), held.reshape(-1, 6))
    _place(equal, frames, exact)
    energy = max((state.tangent.forces.energy for state in states), default=0.0) or 1.0
    root = _inverse_root(group.energy.stiffness[at[0], :n, :n])
    share = np.sqrt(((off @ root) ** 2).sum(axis=-1).max(axis=1) / (2 * energy))
    hessian = np.array([own[2][at, :n, :n] for own in responses]) - exact.tangent.reshape(*force.shape, -1)
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


def _error(equations: Equations, state: Equilibrium, missing: Array) -> float:
    """The step to equilibrium under forces (n + 1, 6) that are missing over the motion from rest, or what it changes
    in the work of the drives, whichever is larger."""
    if not np.isfinite(missing).all():
        return np.inf
    step, more = equations.solver(state.tangent)(equations.free(missing), np.zeros(len(state.drive)))
    moved = equations.free(displacement(equations.model.rest, state.frames))
    size = float(np.abs(moved * equations.scale).max(initial=0.0))
    if size == 0.0:
        return 0.0
    travel = equations.travelled(state.frames)
    work = float(np.abs(state.drive * travel).sum())
    of_drives = float(np.abs(more * travel).sum()) / work if work else 0.0
    return max(float(np.abs(step * equations.scale).max(initial=0.0)) / size, of_drives)
