"""The low-order model that turns: each substructure a superelement in its own frame, with an energy of fourth order,
or, where a leaf moves too far for that, a few elements that bend."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexura.arrays import Array
from flexura.beam import skew
from flexura.motion.elements import Group, PoseElements
from flexura.motion.expansion import expanded
from flexura.motion.layout import joined, taken
from flexura.motion.leaves import Leaf, Meshes, beams_of
from flexura.motion.model import MovingModel
from flexura.motion.substructures import Flags, Substructure, middle, partition, sixes
from flexura.motion.superelements import Polynomial, Sagging, Superelements

SAME_FREQUENCY = 1.001
"""Modes of frequencies this near are kept together."""

FIRST_PIECES = 2
"""Elements of a leaf for which its series does not do."""


@dataclass(frozen=True)
class TurningModel:
    """A moving model of low order and the one of full order that it stands for.

    `low` has the frames of `full`, of which those inside substructures stay where they are and have no displacements.
    `kinds` are the substructures, equal ones together, and `groups` the superelements of `low` that stand for them,
    each with the kind and the number among its equals of every element. `leaves` are those of kinds that are a few
    elements instead, as many as `pieces` says by name. `kept` (n + 1,) are the frames between; modes of substructures
    by themselves are kept `up_to` a frequency, rad/s, and `made_finer` names what was divided. Where `amplitudes` are
    not kept, those of bodies and of other superelements of the full order stand still. The first frames inside hold
    the amplitudes of modes, or are those between the elements of leaves.
    """

    full: MovingModel
    low: MovingModel
    kinds: tuple[tuple[Substructure, ...], ...]
    groups: tuple[tuple[Superelements, tuple[tuple[int, int], ...]], ...]
    leaves: Mapping[int, tuple[Leaf, ...]]

    kept: Flags
    up_to: float
    pieces: Mapping[str, int]
    meshes: Meshes
    amplitudes: bool = True
    made_finer: tuple[str, ...] = ()

    @staticmethod
    def of(
        full: MovingModel,
        kept: Flags,
        order: int = 3,
        up_to: float = 0.0,
        pieces: Mapping[str, int] | None = None,
        meshes: Meshes | None = None,
        amplitudes: bool = True,
    ) -> TurningModel:
        """Substructures between kept frames (n + 1,) with forces of so high an order in their deformations, 1 to 3, and
        the modes of each by itself up to a frequency, rad/s; leaves are so many `pieces` by name, in `meshes`, and
        `amplitudes` of the full order are kept or stand still.

        Raises SolverError for one that has no equilibrium near rest.
        """
        kinds = tuple(tuple(own) for own in partition(full, kept))
        pieces, meshes = pieces or {}, meshes or Meshes(full, {})
        leaves = {
            kind: tuple(meshes.leaf(own, pieces[own.name]) for own in equal)
            for kind, equal in enumerate(kinds)
            if equal[0].name in pieces and beams_of(equal[0]) is not None
        }
        by_size: dict[tuple[int, int], list[int]] = {}
        modes = [0 if kind in leaves else int((own[0].frequencies <= up_to).sum()) for kind, own in enumerate(kinds)]
        for kind, own in enumerate(kinds):
            if kind not in leaves:
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
        gone = inside if amplitudes else inside | ~full.rest.placed
        low = _low(full, kinds, modes, gone, inertia, groups, [leaf for own in leaves.values() for leaf in own])
        return TurningModel(full, low, kinds, groups, leaves, kept, up_to, pieces, meshes, amplitudes)

    def finer(self, kinds: Iterable[int], off: float = np.inf) -> TurningModel | None:
        """With all substructures of some kinds finer, which are `off` by so many times what is wanted: leaves of more
        elements, by the fourth power of their length, the middle frame of others kept; None where none of them has
        any."""
        kept, pieces, names = self.kept.copy(), dict(self.pieces), dict.fromkeys(self.made_finer)
        for kind in kinds:
            names |= dict.fromkeys(substructure.name for substructure in self.kinds[kind])
            for substructure in self.kinds[kind]:
                found, now = beams_of(substructure), pieces.pop(substructure.name, 0)
                more = min(max(now + 1, math.ceil(now * min(off, 1e3) ** 0.25)), 2 * now) if now else FIRST_PIECES
                if found is None:
                    kept[middle(substructure, kept)] = True
                elif more < len(found[1]):
                    pieces[substructure.name] = more
                else:
                    kept[substructure.frames] = True
        if kept.sum() == self.kept.sum() and pieces == self.pieces:
            return None
        return self._made(kept, self.up_to, pieces, self.amplitudes, tuple(names))

    def quicker(self) -> TurningModel | None:
        """With the slowest modes of substructures by themselves that it has not, None where it has all."""
        own = [equal[0].frequencies for kind, equal in enumerate(self.kinds) if kind not in self.leaves]
        inside = np.concatenate([np.empty(0), *own])
        more = inside[inside > self.up_to]
        if not len(more):
            return None
        up_to = SAME_FREQUENCY * float(more.min())
        return self._made(self.kept, up_to, self.pieces, self.amplitudes, self.made_finer)

    def without_amplitudes(self) -> TurningModel:
        """With those of bodies and of other superelements of the full order standing still."""
        return self._made(self.kept, self.up_to, self.pieces, False, self.made_finer)

    def _made(
        self, kept: Flags, up_to: float, pieces: Mapping[str, int], amplitudes: bool, finer: tuple[str, ...]
    ) -> TurningModel:
        made = TurningModel.of(self.full, kept, up_to=up_to, pieces=pieces, meshes=self.meshes, amplitudes=amplitudes)
        return replace(made, made_finer=finer)

    @staticmethod
    def is_leaf(substructure: Substructure) -> bool:
        """Whether it is a member, which fewer elements may stand for."""
        return beams_of(substructure) is not None

    def as_substructure(self, leaf: Leaf) -> Substructure:
        """A leaf as it is in `low`, of few elements."""
        names = [np.array(own) == leaf.of.name for own in self.low.names]
        beams = [isinstance(group, PoseElements) and group.are_beams for group in self.low.elements]
        rows = tuple(np.flatnonzero(own & beam) for own, beam in zip(names, beams, strict=True))
        return Substructure(self.low, leaf.frames, 2, rows, leaf.of.name, leaf.of.turn)


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
    leaves: Sequence[Leaf],
) -> MovingModel:
    """The model with superelements, and leaves of few elements, instead of substructures."""
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
    if leaves:
        elements.append(joined([leaf.elements for leaf in leaves]))
        names.append(tuple(leaf.of.name for leaf in leaves for _ in leaf.elements.node))
    dof, placed, x = np.where(inside[:, None], -1, full.dof), full.rest.placed.copy(), full.rest.x.copy()
    for equal, count in zip(kinds, modes, strict=True):
        for substructure in equal:
            amplitudes = substructure.frames[substructure.k : substructure.k + sixes(count)]
            dof[amplitudes] = np.where(np.arange(6 * len(amplitudes)).reshape(-1, 6) < count, 0, -1)
            placed[amplitudes] = False
    for leaf in leaves:
        own = leaf.frames[2:]
        dof[own], x[own] = 0, leaf.inside
    rest = full.rest._replace(x=x, placed=placed)
    dof[dof >= 0] = np.arange((dof >= 0).sum())
    sagging = Sagging.of([group for group in elements if isinstance(group, Superelements)], rest)
    return replace(
        full,
        rest=rest,
        dof=dof,
        elements=tuple(elements),
        names=tuple(names),
        actuators={name: numbers[g] for name, g in full.actuators.items()},
        inertia=inertia,
        sagging=sagging,
    )
