"""Waves on uniform beams: wavenumbers, and the displacement and internal force that travel with them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexura.beam.dynamic import Array
from flexura.beam.uniform import UniformBeam


class Waves(NamedTuple):
    """Six waves that travel or decay along +x: wavenumbers k (..., 6), exp(-i k x), and for unit amplitudes the
    displacements u and internal forces q (..., 6, 6) of a section, in local axes; columns are waves."""

    k: Array
    u: Array
    q: Array


def waves(beam: UniformBeam, lam: complex) -> Waves:
    """Axial, torsional and two pairs of bending waves of uniform beams (...) (theory eqs. W7-W9; Graff 1975).

    lam: squared angular frequency, rad^2/s^2, not zero. The second wave of a bending plane decays below the cut-off
    frequency of the Timoshenko beam; the branch of its wavenumber is continuous there only on one side.
    """
    shape = np.broadcast(*beam).shape
    k, u, q = np.zeros((*shape, 6), complex), np.zeros((*shape, 6, 6), complex), np.zeros((*shape, 6, 6), complex)
    for column, dof, stiff, inertia in ((0, 0, beam.EA, beam.mass), (3, 3, beam.GJ, beam.polar)):
        own = np.sqrt(lam * inertia / stiff + 0j)
        k[..., column], u[..., dof, column], q[..., dof, column] = own, 1.0, -1j * own * stiff
    planes = (
        (1, 5, 1.0, beam.EIz, beam.shear_y, beam.rotary_z),
        (2, 4, -1.0, beam.EIy, beam.shear_z, beam.rotary_y),
    )
    for v, turn, sign, EI, shear, rotary in planes:
        b = lam * (rotary + EI * shear * beam.mass)
        root = np.sqrt(b * b + 4 * EI * lam * beam.mass * (1 - lam * rotary * shear) + 0j)
        pair = (np.sqrt((b + root) / (2 * EI)), -1j * np.sqrt((root - b) / (2 * EI)))
        for column, own in zip((v, turn), pair, strict=True):
            V = -1j * lam * beam.mass / own
            theta = -1j * own - shear * V
            k[..., column] = own
            u[..., v, column], u[..., turn, column] = 1.0, sign * theta
            q[..., v, column], q[..., turn, column] = V, sign * -1j * own * EI * theta
    return Waves(k, u, q)


def reversed_waves(forward: Waves) -> Waves:
    """The same waves along -x, exp(+i k x): mirror images of those along +x."""
    mirror = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
    return Waves(forward.k, forward.u * mirror[:, None], -forward.q * mirror[:, None])
