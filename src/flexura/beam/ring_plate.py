"""Ring plates between a rigid rim and a rigid hub: stiffness, mass, and what membrane forces add as they bend.

Kirchhoff's plate and plane stress, in closed form for all six motions of the hub seen from the rim. Axes lie in the
middle of the plate, z along its normal. None of the functions raises anything.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.beam.frames import Real
from flexura.duals import real, zeros

POINTS, WEIGHTS = (x / 2 + half for x, half in zip(np.polynomial.legendre.leggauss(24), (0.5, 0.0), strict=True))
"""Gauss points and weights over the logarithm of the radius, from the hub to the rim."""

TERMS = 12
"""Polynomials in the logarithm of the radius that membrane displacements are made of."""

CLAMPED = 22.4
"""Of a strip clamped at both edges: omega L^2 sqrt(rho t/D). Rings of any hub are within 3 % of it (A. W. Leissa,
Vibration of plates, 1969, table 2.28)."""

SHEAR = 5 / 6
"""Mindlin's and Reissner's shear coefficient."""


class RingPlate(NamedTuple):
    """Radii of rim and hub (...), m, thickness (...), m, E (...), Pa, nu (...), rho (...), kg/m^3."""

    rim: Real
    hub: Real
    thickness: Real
    E: Real
    nu: Real
    rho: Real

    @property
    def bending(self) -> Real:
        """Bending stiffness D (...), N m."""
        return self.E * self.thickness**3 / (12 * (1 - self.nu**2))

    @property
    def lowest_hz(self) -> Real:
        """Lowest natural frequency (...), Hz, about, with rim and hub held."""
        wide = self.rim - self.hub
        return CLAMPED / (2 * np.pi * wide**2) * np.sqrt(self.bending / (self.rho * self.thickness))

    @property
    def shear(self) -> Real:
        """Share of shear in the axial flexibility (...) that Kirchhoff's plate leaves out (R. D. Mindlin, 1951)."""
        stiffness = 2 * np.pi * SHEAR * self.E / (2 * (1 + self.nu)) * self.thickness / np.log(self.rim / self.hub)
        return stiffnesses(self)[..., 2] / stiffness

    @property
    def lever(self) -> Real:
        """Length (...), m, by which a tilt of the hub stretches it as much as that deflection does."""
        k, more = stiffnesses(self), membrane(self)
        return np.sqrt(more.tilt / k[..., 3] / more.axial * k[..., 2])


class _Shapes(NamedTuple):
    """Motions (..., g) of the plate at radii r (..., g), m, with weights of integrals over r dr, per motion of the hub:
    w of a shift along z and its slope; of a tilt the same, to be multiplied by the sine of the angle from its axis; of
    a shift in the plane p and q, the displacement being p plus q turned to twice the angle; of a twist the displacement
    along the circle."""

    r: Array
    weight: Array
    axial: Array
    axial_slope: Array
    tilt: Array
    tilt_slope: Array
    p: Array
    q: Array
    twist: Array


def stiffnesses(plate: RingPlate) -> Array:
    """Stiffness (..., 6), N/m and N m/rad, of the hub along and about x, y and z (theory eqs. Z1-Z4).

    Axial: S. Timoshenko and S. Woinowsky-Krieger, Theory of plates and shells, 1959, art. 17. Tilt: H. Reissner,
    Ing.-Arch. 1 (1929) 72. In the plane: N. I. Muskhelishvili, Some basic problems, 1953.
    """
    a, b = plate.rim, plate.hub
    beta = b / a
    square, L = beta**2, np.log(beta)
    D, kappa = plate.bending, (3 - plate.nu) / (1 + plate.nu)
    axial = 16 * np.pi * D / (a**2 * (1 - square - 4 * square * L**2 / (1 - square)))
    tilt = 4 * np.pi * D * (1 + square) / (-(1 + square) * L - (1 - square))
    Et = plate.E * plate.thickness
    shift = 4 * np.pi * Et / (1 + plate.nu) ** 2 / (-kappa * L - (1 - square) / (kappa * (1 + square)))
    twist = 2 * np.pi * Et / (1 + plate.nu) * b**2 / (1 - square)
    k = zeros((*np.shape(axial), 6), axial, shift)
    for i, own in enumerate((shift, shift, axial, tilt, tilt, twist)):
        k[..., i] = own
    return k


def _shapes(plate: RingPlate, at: Array = POINTS, weights: Array = WEIGHTS) -> _Shapes:
    a, b = (np.expand_dims(radius, -1) for radius in (plate.rim, plate.hub))
    nu = np.expand_dims(plate.nu, -1)
    beta = b / a
    square, L, kappa = beta**2, np.log(beta), (3 - nu) / (1 + nu)
    ln = L * (1 - at)
    x = np.exp(ln)
    r = a * x
    scale = 1 / ((1 - square) / 2 - 2 * square * L**2 / (1 - square))
    even = square * L / (1 - square)
    axial = scale * ((even - 0.5) * (x**2 - 1) - 2 * even * ln + x**2 * ln)
    axial_slope = scale / a * (2 * (even - 0.5) * x - 2 * even / x + x * (2 * ln + 1))
    scale = a * square / (2 * (1 - square + (1 + square) * L))
    turn = 2 * (1 + 1 / square)
    tilt = scale * ((1 / square - 1) * x - x**3 / square + 1 / x + turn * x * ln)
    tilt_slope = scale / a * (1 / square - 1 - 3 * x**2 / square - 1 / x**2 + turn * (ln + 1))
    wide = kappa * (1 + square)
    scale = 1 / (2 * kappa * L + 2 * (1 - square) / wide)
    p = scale * (2 * kappa * ln + 2 * (1 - x**2) / wide)
    q = scale * (-1 + (x**2 + square / x**2) / (1 + square))
    twist = b * (1 / x - x) / (1 / beta - beta)
    return _Shapes(r, -L * weights * r**2, axial, axial_slope, tilt, tilt_slope, p, q, twist)


def mass(plate: RingPlate) -> Array:
    """Mass (..., 12, 12) of the motions of rim and hub, consistent with the static shapes, and exact in rigid motions
    (theory eq. Z5); rotary inertia is in it."""
    s = _shapes(plate)
    surface = np.expand_dims(2 * np.pi * plate.rho * plate.thickness, -1) * s.weight
    rotary = np.expand_dims(plate.thickness**2 / 12, -1)
    r = s.r

    def pairs(hub: list[Array], rigid: list[Array], weights: list[Array]) -> list[Array]:
        """Entries rim-rim, rim-hub and hub-hub from fields per motion of the hub and per rigid motion."""
        rim = [whole - own for whole, own in zip(rigid, hub, strict=True)]
        return [
            np.stack([(surface * w * f * g).sum(axis=-1) for w, f, g in zip(weights, one, other, strict=True)]).sum(0)
            for one, other in ((rim, rim), (rim, hub), (hub, hub))
        ]

    one, zero = np.ones_like(r), np.zeros_like(r)
    shift = pairs([s.p, s.q], [one, zero], [one, one])
    axial = pairs([s.axial, s.axial_slope], [one, zero], [one, rotary])
    tilt = pairs([s.tilt, s.tilt_slope, s.tilt / r], [r, one, one], [one / 2, rotary / 2, rotary / 2])
    twist = pairs([s.twist], [r], [one])
    M = zeros((*np.shape(shift[0]), 12, 12), shift[0])
    for i, (near, across, far) in enumerate((shift, shift, axial, tilt, tilt, twist)):
        M[..., i, i], M[..., i + 6, i + 6] = near, far
        M[..., i, i + 6] = M[..., i + 6, i] = across
    return M


def displacements(plate: RingPlate, at: Array, angle: Array, motion: Array) -> Array:
    """Displacements (g, m, 3), m, at fractions (g,) of the logarithm of the radius from hub to rim and angles (m,),
    rad, of one plate for a motion (6,) of the hub seen from the rim."""
    s = _shapes(plate, at, np.zeros_like(at))
    x, y, z, turn_x, turn_y, turn_z = motion
    c, n, twice, one = np.cos(angle), np.sin(angle), 2 * angle, np.ones_like(angle)
    across = x * np.cos(twice) + y * np.sin(twice), x * np.sin(twice) - y * np.cos(twice)
    plane = [np.outer(s.p, one * own) + np.outer(s.q, turned) for own, turned in zip((x, y), across, strict=True)]
    plane = [own + np.outer(s.twist, turn_z * along) for own, along in zip(plane, (-n, c), strict=True)]
    return real(np.stack([*plane, np.outer(s.axial, one * z) + np.outer(s.tilt, turn_x * n - turn_y * c)], axis=-1))


def described_mass(plate: RingPlate) -> tuple[Array, Array]:
    """Mass (...), kg, and moments of inertia (..., 3), kg m^2, about the centre, from density and size alone."""
    a, b, t = plate.rim, plate.hub, plate.thickness
    whole = plate.rho * np.pi * (a**2 - b**2) * t
    across = whole * ((a**2 + b**2) / 4 + t**2 / 12)
    return real(whole), np.stack([across, across, whole * (a**2 + b**2) / 2], axis=-1)


class Membrane(NamedTuple):
    """What stretching in the plane adds to the energy, with a shift s and a tilt of size phi of the hub (theory eq.
    Z7): axial s^4/2 + mixed s^2 phi^2/2 + tilt phi^4/2 + shift s (x turn_y - y turn_x), for shifts x, y in the plane;
    all (...), from N/m^3 on."""

    axial: Array
    mixed: Array
    tilt: Array
    shift: Array


def membrane(plate: RingPlate) -> Membrane:
    """The lowest order of stretching beyond bending, of the linear shapes (theory eqs. Z6-Z7): von Karman's strains,
    and the displacements in the plane that hold least energy, by polynomials in the logarithm of the radius."""
    s, b = _shapes(plate), np.expand_dims(plate.hub, -1)
    none, one = np.zeros_like(s.r), np.ones_like(b)
    W, F, T = s.axial_slope, s.tilt_slope, s.tilt / s.r
    sources = (
        (0, [(W**2 / 2, none, none), (F**2 / 4, T**2 / 4, none)], [(0 * b, 0 * b), (-b / 4, 0 * b)]),
        (1, [(none, none, none), (W * F, none, -W * T)], [(one, -one), (-one / 2, one / 2)]),
        (2, [(F**2 / 4, -(T**2) / 4, -F * T / 2)], [(-b / 4, b / 4)]),
    )
    round_, first, second = (_stretching(plate, s, *source) for source in sources)
    return Membrane(
        round_[..., 0, 0],
        2 * round_[..., 0, 1] + first[..., 1, 1],
        round_[..., 1, 1] + second[..., 0, 0],
        -stiffnesses(plate)[..., 2] / 2 - first[..., 0, 1],
    )


def _stretching(
    plate: RingPlate,
    s: _Shapes,
    wave: int,
    sources: list[tuple[Array, Array, Array]],
    edges: list[tuple[Array, Array]],
) -> Array:
    """H (..., k, k), twice the least energy of strains (er, et, shear) (..., g) of k sources that vary as so many waves
    around, with displacements (ur, ut) of the hub's edge."""
    xi, r = POINTS, s.r
    log = np.expand_dims(np.log(plate.rim / plate.hub), -1)
    bubbles = [(xi**k * (1 - xi) * xi, (k + 1) * xi**k - (k + 2) * xi ** (k + 1)) for k in range(TERMS)]
    shapes = [(f, slope, 0 * f, 0 * f) for f, slope in bubbles] + [(0 * f, 0 * f, f, slope) for f, slope in bubbles]
    fields = [(f + none, slope / log, g + none, of / log) for f, slope, g, of in shapes for none in [0 * r]]
    fields += [((1 - xi) * u, -u / log + 0 * r, (1 - xi) * v, -v / log + 0 * r) for u, v in edges]
    rows = [(du / r, (u + wave * v) / r, (dv - v - wave * u) / r) for u, du, v, dv in fields]
    strains = np.stack([np.stack(row, axis=-1) for row in rows], axis=-3)
    given = np.stack([np.stack(source, axis=-1) for source in sources], axis=-3)
    strains = np.concatenate([strains[..., : 2 * TERMS, :, :], strains[..., 2 * TERMS :, :, :] + given], axis=-3)
    nu = np.expand_dims(plate.nu, (-1, -2))
    er, et, shear = (strains[..., k] for k in range(3))
    weight = np.expand_dims(s.weight, -2) * (np.pi if wave else 2 * np.pi)
    stress = np.stack([weight * (er + nu * et), weight * (et + nu * er), weight * (1 - nu) / 2 * shear], axis=-1)
    lead = strains.shape[:-2]
    flat, pull = strains.reshape(*lead, -1), stress.reshape(*lead, -1)
    H = flat @ np.swapaxes(pull, -1, -2)
    n = 2 * TERMS
    H = H[..., n:, n:] - H[..., n:, :n] @ np.linalg.solve(H[..., :n, :n], H[..., :n, n:])
    return np.expand_dims(plate.E * plate.thickness / (1 - plate.nu**2), (-1, -2)) * H
