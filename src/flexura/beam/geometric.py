"""Geometric stiffness of uniform beams under axial force, and of rigid arms."""

import numpy as np

from flexura.beam._columns import FloatArray
from flexura.beam.element import shape_functions
from flexura.beam.tapered import gauss_stations
from flexura.beam.uniform import UniformBeam, element_stiffness


def geometric_stiffness(force: FloatArray, beam: UniformBeam) -> FloatArray:
    """Return the stiffness (..., 12, 12) that an axial force adds to the beams as elements (theory eqs. P1-P3).

    P int (v'^2 + w'^2 + (Ip/A) phi'^2) dx with the element's own static shapes (Przemieniecki 1968, ch. 15; the twist
    term Wagner 1936): the slope v' is rotation and shear strain, so that a column with shear buckles at the load of
    Engesser. Exactly symmetric; order 4 of convergence without shear.

    force: (...) N, tension positive; UniformBeam fields (...). Holds for small displacements from a straight beam;
    bending moments and shear forces of the preloaded state add nothing here.
    """
    section, L = beam.section, np.asarray(beam.length)
    K = element_stiffness(beam)
    shape = np.broadcast(force, L).shape
    out = np.zeros((*shape, 12, 12))
    points, weights = gauss_stations(4)
    for x, w in zip(points, weights, strict=True):
        N = shape_functions(x * L, 1.0, 1.0, section, L, 1.0)
        slopes = (
            N[..., 5, :] + np.asarray(beam.shear_y)[..., None] * K[..., 7, :],
            -N[..., 4, :] + np.asarray(beam.shear_z)[..., None] * K[..., 8, :],
        )
        for row in slopes:
            out += (w * L * force)[..., None, None] * row[..., :, None] * row[..., None, :]
    radius2 = np.divide(beam.polar, beam.mass, out=np.zeros(np.shape(beam.mass)), where=np.asarray(beam.mass) > 0)
    twist = force * radius2 / L
    out[..., 3, 3] += twist
    out[..., 9, 9] += twist
    out[..., 3, 9] -= twist
    out[..., 9, 3] -= twist
    return (out + np.swapaxes(out, -1, -2)) / 2


def arm_stiffness(force: FloatArray, arm: FloatArray) -> FloatArray:
    """Return the stiffness (f a' + a f')/2 - (f.a) I of the rotation of a rigid arm a that exerts a force f (theory eq.
    P5).

    force: (..., 3) N; arm: (..., 3) m. Returns (..., 3, 3), N m. Second order in the rotation, as a vector.
    """
    outer = force[..., :, None] * arm[..., None, :]
    return (outer + np.swapaxes(outer, -1, -2)) / 2 - (force * arm).sum(axis=-1)[..., None, None] * np.eye(3)
