"""Masses of designs, all at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.structure import Design, PartMatrices

Array = NDArray[np.float64]


def total_mass(design: Design) -> Array:
    """Mass of everything (...), kg: what meets a unit acceleration, r' M r, of all copies of all prototypes."""
    total = np.zeros(design.values.shape[:-1])
    for name, own in design.matrices.items():
        total = total + len(design.plan.topology.copies[name].paths) * _part_mass(design, name, own)
    return total


def body_mass(design: Design, body: str) -> Array:
    """Mass (...) of a rigid body as placed, kg, without what it carries."""
    *path, key = body.split(".")
    for copies in design.plan.topology.copies.values():
        if tuple(path) in copies.paths and key in copies.part.bodies:
            own = copies.part.bodies[key][1].matrix(design.values)[..., 0, 0]
            return np.broadcast_to(own, design.values.shape[:-1])
    raise KeyError(body)


def _part_mass(design: Design, name: str, matrices: PartMatrices) -> Array:
    """Mass (...) of one copy of a prototype."""
    M = matrices.elements.M
    found = (M[..., 0, 0] + M[..., 0, 6] + M[..., 6, 0] + M[..., 6, 6]).sum(axis=-1)
    positioned = design.plan.parts[name].n_positioned
    for discrete in matrices.discrete_elements:
        if discrete.M is not None:
            at = 6 * np.array([k for k, node in enumerate(discrete.nodes) if node < positioned], dtype=np.intp)
            along = [discrete.M[..., at[:, None] + axis, at + axis].sum(axis=(-1, -2)) for axis in range(3)]
            found = found + (along[0] + along[1] + along[2]) / 3
    return found
