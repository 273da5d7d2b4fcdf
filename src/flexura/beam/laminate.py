"""Leaves of bonded layers as beams about their neutral axis.

Layers lie across the thickness and strain as plane sections do (Timoshenko 1925), each with its own modulus. Arrays of
layers are (..., k), the first layer at the face towards -z; z is measured from the middle of the thickness.
"""

from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.beam.frames import Real
from flexura.beam.section import rectangle


class Laminate(NamedTuple):
    """What layers come to together; a rectangle of the same width and thickness with the means E, G and rho has their
    EA, EIz, GA and mass.

    thickness  of all layers (...), m
    E, G, rho  means over the thickness (...), Pa and kg/m^3; nu, -, weighted by Young's moduli
    axis       neutral axis of bending about y (...), z, m
    bend       EIy about it over that of the rectangle (...), -
    twist      GJ over that of the rectangle (...), -
    kz         coefficient of shear along z (...), -
    faces      faces of the layers (..., k + 1), z, m
    moduli     Young's and shear moduli of the layers (2, ..., k), Pa
    neutral    z about which layers shear as the leaf twists (...), m
    """

    thickness: Array
    E: Array
    G: Array
    rho: Array
    nu: Array
    axis: Array
    bend: Array
    twist: Array
    kz: Array
    faces: Array
    moduli: tuple[Array, Array]
    neutral: Array


def laminate(t: Array, E: Array, nu: Array, rho: Array) -> Laminate:
    """Return what layers of thickness t come to (theory eqs. J1-J4).

    With the means E, the neutral axis z0 = sum E_i t_i z_i / sum E_i t_i and EIy per width sum E_i (t_i^3/12 + t_i
    (z_i - z0)^2) (Timoshenko 1925); GJ of a thin strip per width 4 sum G_i (t_i^3/12 + t_i (z_i - zG)^2); shear by the
    stresses that balance those of bending (Jourawski), 1/(kz G A) = int (int E (z - z0) dz)^2 / G dz / (EIy)^2.

    t: m; E: Pa; nu: -; rho: kg/m^3; each (..., k).
    """
    G = E / (2 * (1 + nu))
    h = t.sum(axis=-1)
    none = 0.0 * h[..., None]
    faces = np.concatenate([none, np.cumsum(t, axis=-1)], axis=-1) - h[..., None] / 2
    middle = (faces[..., 1:] + faces[..., :-1]) / 2
    EA, GA = (E * t).sum(axis=-1), (G * t).sum(axis=-1)
    axis, neutral = (E * t * middle).sum(axis=-1) / EA, (G * t * middle).sum(axis=-1) / GA
    EI, GI = (
        (modulus * (t**3 / 12 + t * (middle - about[..., None]) ** 2)).sum(axis=-1)
        for modulus, about in ((E, axis), (G, neutral))
    )
    mean, nu_mean = EA / h, (E * t * nu).sum(axis=-1) / EA
    rest = faces - axis[..., None]
    steps = E * (rest[..., 1:] ** 2 - rest[..., :-1] ** 2) / 2
    below = np.concatenate([none, np.cumsum(steps, axis=-1)[..., :-1]], axis=-1)
    square = none[..., 0]
    for s, w in zip((0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)), (5 / 18, 8 / 18, 5 / 18), strict=True):
        z = rest[..., :-1] + s * t
        flow = below + E * (z**2 - rest[..., :-1] ** 2) / 2
        square = square + (w * t * flow**2 / G).sum(axis=-1)
    kz = EI**2 / (square * GA)
    rho_mean = (rho * t).sum(axis=-1) / h
    bend, twist = EI / (mean * h**3 / 12), GI / (GA * h**2 / 12)
    return Laminate(h, mean, GA / h, rho_mean, nu_mean, axis, bend, twist, kz, faces, (E, G), neutral)


def blocking(of: Laminate, width: Real, strain: Array) -> tuple[Array, Array]:
    """Return the force along x at the neutral axis and the moment about y that block free strains of the layers.

    N = b sum E_i t_i e_i, M = b sum E_i t_i e_i (z_i - z0) (theory eq. J5; Smits, Dalke and Cooney 1991). width b:
    (...) m; strain e: (..., k), -. Returns (...) N and N m.
    """
    push = of.moduli[0] * np.diff(of.faces, axis=-1) * strain
    middle = (of.faces[..., 1:] + of.faces[..., :-1]) / 2
    return width * push.sum(axis=-1), width * (push * (middle - of.axis[..., None])).sum(axis=-1)


def layer_stresses(of: Laminate, width: Real) -> tuple[Array, Array]:
    """Return normal stress per N, My and Mz (..., k, 4, 3), 1/m^2 and 1/m^3, at the four corners of every layer, and
    shear stress per torque (..., k, 4), 1/m^3, at its faces.

    Corners as of a rectangle: (+b/2, upper), (+b/2, lower), (-b/2, lower), (-b/2, upper). width: (...) m.
    """
    b, h = np.broadcast_arrays(width, of.thickness)
    A, Iy, Iz = b * h, of.bend * b * h**3 / 12, h * b**3 / 12
    z = np.stack([of.faces[..., 1:], of.faces[..., :-1], of.faces[..., :-1], of.faces[..., 1:]], axis=-1)
    y = (b / 2)[..., None, None] * np.array([1.0, 1.0, -1.0, -1.0])
    share, slide = (m[..., None] / mean[..., None, None] for m, mean in zip(of.moduli, (of.E, of.G), strict=True))
    A, Iy, Iz, J = (f[..., None, None] for f in (A, Iy, Iz, of.twist * rectangle(b, h, of.nu).J))
    lever = z - of.axis[..., None, None]
    normal = np.stack(np.broadcast_arrays(share / A + 0 * z, share * lever / Iy, -share * y / Iz), axis=-1)
    return normal, slide * 2 * (z - of.neutral[..., None, None]) / J
