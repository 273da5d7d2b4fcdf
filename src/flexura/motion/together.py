"""Elements of all kinds that a kernel takes together, with the bodies that frames carry."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from flexura.kernels import Struct
from flexura.motion.elements import PoseElements
from flexura.motion.lanes import abreast, upper, whole
from flexura.motion.layout import Laid
from flexura.motion.superelements import Superelements


class Together(NamedTuple):
    """Elements by their numbers among those of a model, with the bodies, as a `struct`, and the `memory` that kernels
    need."""

    numbers: tuple[int, ...]
    struct: Struct
    memory: int

    @staticmethod
    def of(model: Laid, numbers: Iterable[int]) -> Together:
        """Those of some numbers that are beams, springs or superelements without slopes."""
        every = [(number, model.elements[number]) for number in numbers]
        taken = [(k, own) for k, own in every if isinstance(own, PoseElements | Superelements) and own.is_plain]
        fields = [
            field
            for _, own in taken
            for field in (isinstance(own, Superelements), *own.node.shape, whole(own.node), own.struct)
        ]
        memory = max((own.memory for _, own in taken), default=0)
        forces = max((6 * own.node.size for _, own in taken), default=0)
        heavy = whole(np.flatnonzero(model.inertia.any(axis=(1, 2))))
        inertia = abreast(upper(model.inertia[heavy]))
        dof, placed = whole(model.dof), np.ascontiguousarray(model.rest.placed)
        free, hangs = whole(np.flatnonzero((dof >= 0).any(axis=1))), whole(model.sagging.node)
        sizes = len(taken), len(heavy), memory, len(dof), int(dof.max(initial=-1)) + 1, len(free), len(hangs)
        weight, inside, arm = (
            np.ascontiguousarray(own, dtype=float) for own in (model.weight, model.sagging.weight, model.arm)
        )
        where = heavy, inertia, dof, free, placed, weight, hangs, inside, whole(model.root), arm
        struct = Struct(*sizes, Struct(*fields), *where)
        return Together(tuple(k for k, _ in taken), struct, 2 + memory + forces)
