"""Masses of designs, all at once."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.structure import Design, DiscreteElement, Part


def total_mass(design: Design) -> Array:
    """Mass of everything (...), kg: what meets a unit acceleration, r' M r, of all copies of all prototypes."""
    B = design.elements.mass_basis.reshape(-1, 12, 12)
    along = B[:, 0, 0] + B[:, 0, 6] + B[:, 6, 0] + B[:, 6, 6]
    elements = (design.elements.mass_coefficients * along).sum(axis=-1)
    discrete_elements, start = design.discrete_elements(), 0
    total = np.zeros(design.values.shape[:-1])
    for name, part in design.plan.parts.items():
        stop = start + len(part.connectivity)
        own = elements[..., start:stop].sum(axis=-1) + _discrete_mass(part, discrete_elements.get(name, []))
        total = total + len(design.plan.topology.copies[name].paths) * own
        start = stop
    return total


def body_mass(design: Design, body: str) -> Array:
    """Mass (...) of a rigid body as placed, kg, without what it carries."""
    *path, key = body.split(".")
    for copies in design.plan.topology.copies.values():
        if tuple(path) in copies.paths and key in copies.part.bodies:
            own = copies.part.bodies[key][1].matrix(design.values)[..., 0, 0]
            return np.broadcast_to(own, design.values.shape[:-1])
    raise KeyError(body)


def _discrete_mass(part: Part, discrete_elements: list[DiscreteElement]) -> Array | float:
    """Mass (...) of the discrete elements of one copy of a part."""
    found: Array | float = 0.0
    for discrete in discrete_elements:
        if discrete.M is not None:
            at = 6 * np.array([k for k, node in enumerate(discrete.nodes) if node < part.n_positioned], dtype=np.intp)
            along = [discrete.M[..., at[:, None] + axis, at + axis].sum(axis=(-1, -2)) for axis in range(3)]
            found = found + (along[0] + along[1] + along[2]) / 3
    return found
