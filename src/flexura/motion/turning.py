"""The low-order model that turns: each substructure a superelement in its own frame, with an energy of fourth order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexura.arrays import Array
from flexura.beam import skew
from flexura.motion.clusters import Sagging, Superelements
from flexura.motion.elements import Group
from flexura.motion.expansion import expanded
from flexura.motion.layout import add_weight
from flexura.motion.model import MovingModel
from flexura.motion.polynomial import Polynomial
from flexura.motion.substructures import Flags, Substructure, middle, partition, sixes, taken

ALIKE = 1.001
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
            names |= dict.fromkeys(own.name for own in self.kinds[kind])
            for own in self.kinds[kind]:
                kept[middle(own, kept)] = True
        if kept.sum() == self.kept.sum():
            return None
        return replace(TurningModel.of(self.full, kept, up_to=self.up_to), made_finer=tuple(names))

    def quicker(self) -> TurningModel | None:
        """With the slowest modes of substructures by themselves that it has not, None where it has all."""
        inside = np.concatenate([np.empty(0), *(equal[0].frequencies for equal in self.kinds)])
        more = inside[inside > self.up_to]
        if not len(more):
            return None
        up_to = ALIKE * float(more.min())
        return replace(TurningModel.of(self.full, self.kept, up_to=up_to), made_finer=self.made_finer)


def _hanging(own: Substructure) -> Array:
    """Inertia (6, 6) of what hangs at one frame, in the axes of the frame at rest."""
    T = np.zeros((6, 6))
    T[:3, :3] = T[3:, 3:] = own.turn.T
    T[:3, 3:] = -own.turn.T @ skew(own.arm[0])
    return T.T @ own.with_modes(0) @ T


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
    rest[..., :3] = [own.rest[1:k] for own in every]
    node = np.array([own.frames[: k + frames] for own in every])
    axes, arm = np.array([own.turn for own in every]), np.array([own.arm for own in every])
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
        gone = np.concatenate([np.empty(0, dtype=np.intp), *(own.rows[g] for equal in kinds for own in equal)])
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
        for own in equal:
            amplitudes = own.frames[own.k : own.k + sixes(count)]
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
