"""Geometric stiffness of beams under axial force, and of rigid arms."""

import numpy as np

from flexura.beam._columns import FloatArray, Real
from flexura.beam.element import shape_functions, stiffness_from_flexibility
from flexura.beam.section import SectionProperties
from flexura.beam.tapered import gauss_stations, station_shapes
from flexura.beam.uniform import UniformBeam, element_stiffness
from flexura.duals import real, zeros


def geometric_stiffness(force: FloatArray, beam: UniformBeam) -> FloatArray:
    """Return the stiffness (..., 12, 12) that an axial force adds to the beams as elements (theory eqs. P1-P3).

    P int (v'^2 + w'^2 + (Ip/A) phi'^2) dx with the element's own static shapes (Przemieniecki 1968, ch. 15; the twist
    term Wagner 1936): the slope v' is rotation and shear strain, so that a column with shear buckles at the load of
    Engesser. Exactly symmetric; order 4 of convergence without shear.

    force: (...) N, tension positive; UniformBeam fields (...). Holds for small displacements from a straight beam;
    bending moments and shear forces of the preloaded state add nothing here.
    """
    return real(force)[..., None, None] * geometric_basis(beam).sum(axis=-3)


def geometric_basis(beam: UniformBeam) -> FloatArray:
    """Return `geometric_stiffness` (..., 2, 12, 12) per axial force at the first and at the second end, linear between.

    1/N of stiffness: m, 1 and 1/m. Axial force under a uniform beam's own weight is linear (theory eq. P3).
    """
    section, L = beam.section, real(beam.length)
    K = element_stiffness(beam)
    out = zeros((*L.shape, 2, 12, 12), K)
    points, weights = gauss_stations(4)
    for x, w in zip(points, weights, strict=True):
        N = shape_functions(x * L, 1.0, 1.0, section, L, 1.0)
        slopes = (
            N[..., 5, :] + real(beam.shear_y)[..., None] * K[..., 7, :],
            -N[..., 4, :] + real(beam.shear_z)[..., None] * K[..., 8, :],
        )
        own = sum((w * L)[..., None, None] * row[..., :, None] * row[..., None, :] for row in slopes)
        out[..., 0, :, :] += (1 - x) * own
        out[..., 1, :, :] += x * own
    heavy = real(beam.mass) > 0
    radius2 = np.where(heavy, beam.polar, 0.0) / np.where(heavy, beam.mass, 1.0)
    twist = (radius2 / L / 2)[..., None]
    out[..., 3, 3] += twist
    out[..., 9, 9] += twist
    out[..., 3, 9] -= twist
    out[..., 9, 3] -= twist
    return (out + np.swapaxes(out, -1, -2)) / 2


def tapered_geometric_basis(
    E: Real,
    G: Real,
    section: SectionProperties,
    inertia: SectionProperties,
    length: Real,
    shear: Real,
    points: FloatArray,
    weights: FloatArray,
) -> FloatArray:
    """Return `geometric_basis` (..., 2, 12, 12) of elements whose section varies along them (theory eqs. P1-P3).

    The same integral over the stations, with the static shapes that the element's flexibility gives (theory eq. 16).
    section, inertia: fields (..., n) at the stations `points`, the sections that are elastic and those that are there;
    others as in `flexura.beam.tapered`. Raises numpy.linalg.LinAlgError as `tapered` does.
    """
    C, N = station_shapes(E, G, section, length, shear, points, weights)
    L = real(length)[..., None]
    K = stiffness_from_flexibility(C, length)[..., None, :, :]
    slide = real(shear)[..., None] / (real(G)[..., None] * section.A)
    rows = (
        N[..., 5, :] + (slide / section.ky)[..., None] * K[..., 7, :],
        -N[..., 4, :] + (slide / section.kz)[..., None] * K[..., 8, :],
        (np.sqrt((inertia.Iy + inertia.Iz) / inertia.A) / (real(G)[..., None] * section.J))[..., None] * K[..., 9, :],
    )
    ends = np.stack([weights * (1 - points), weights * points]) * L[..., None]
    out = sum(np.einsum("...bn,...ni,...nj->...bij", ends, row, row) for row in rows)
    return (out + np.swapaxes(out, -1, -2)) / 2


def arm_stiffness(force: FloatArray, arm: FloatArray) -> FloatArray:
    """Return the stiffness (f a' + a f')/2 - (f.a) I of the rotation of a rigid arm a that exerts a force f (theory eq.
    P5).

    force: (..., 3) N; arm: (..., 3) m. Returns (..., 3, 3), N m. Second order in the rotation, as a vector.
    """
    outer = force[..., :, None] * arm[..., None, :]
    return (outer + np.swapaxes(outer, -1, -2)) / 2 - (force * arm).sum(axis=-1)[..., None, None] * np.eye(3)
