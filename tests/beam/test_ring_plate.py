"""Ring plates against Roark's and Timoshenko's formulas, solids, and exact vibrations by Bessel functions."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import iv, jv, kn, yn

from flexura.beam import ring_plate
from flexura.beam.ring_plate import RingPlate
from flexura.duals import Dual

PLATE = RingPlate(30e-3, 10e-3, 0.3e-3, 71.7e9, 0.33, 2810.0)


def roark(plate: RingPlate) -> float:
    """Axial stiffness by W. C. Young and R. G. Budynas, Roark's formulas for stress and strain, 7th ed., table 11.2,
    case 1f: outer edge fixed, inner edge guided, line load at the inner edge."""
    a, b = plate.rim, plate.hub
    C2, C5 = (1 - (b / a) ** 2 * (1 + 2 * np.log(a / b))) / 4, (1 - (b / a) ** 2) / 2
    L3 = b / (4 * a) * (((b / a) ** 2 + 1) * np.log(a / b) + (b / a) ** 2 - 1)
    L6 = b / (4 * a) * ((b / a) ** 2 - 1 + 2 * np.log(a / b))
    return float(2 * np.pi * b * plate.bending / (a**3 * (C2 * L6 / C5 - L3)))


@pytest.mark.parametrize("hub", [1e-3, 10e-3, 27e-3])
def test_the_axial_stiffness_is_roark_s(hub):
    plate = PLATE._replace(hub=hub)
    assert ring_plate.stiffnesses(plate)[2] == pytest.approx(roark(plate), rel=1e-10)


def test_all_directions_are_those_of_a_solid():
    """Fourier rings of the solid, edges held rigidly: netgen 6.2, NGSolve, order 8, 120 267 DOFs, cells of 0.1 mm;
    the twist 27-node and of order 4 in three dimensions, 174 036 DOFs."""
    k = ring_plate.stiffnesses(PLATE)
    assert k[0] == k[1] == pytest.approx(8.46189e7, rel=1e-3)
    assert k[2] == pytest.approx(35438.03, rel=1e-3)
    assert k[3] == k[4] == pytest.approx(7.619752, rel=1e-3)
    assert k[5] == pytest.approx(11431.97, rel=1e-4)


def test_stretching_is_that_of_a_solid_in_large_motion():
    """A St. Venant-Kirchhoff solid in three dimensions, its hub at 0.3 thicknesses and as much by tilt, at 1 um in the
    plane: NGSolve, order 4, 51 870 DOFs, cells of 4 mm; over the linear stiffness of the same mesh where bending has
    to do with it."""
    k, more = ring_plate.stiffnesses(PLATE), ring_plate.membrane(PLATE)
    assert more.axial / k[2] == pytest.approx(1.307716e11 / 35885.90, rel=3e-3)
    assert more.tilt / k[3] == pytest.approx(4843.548 / 7.704023, rel=3e-3)
    assert more.mixed == pytest.approx(1.354240e8, rel=3e-3)
    assert more.shift == pytest.approx(7.979732e7, rel=3e-3)


def test_a_small_hub_stiffens_as_timoshenko_s_plate():
    """S. Timoshenko and S. Woinowsky-Krieger, Theory of plates and shells, 1959, table 82: a plate clamped at an
    immovable edge, load at the centre, nu = 0.3: w + 0.443 w^3/t^2 = 0.217 P a^2/E t^3."""
    plate = PLATE._replace(hub=30e-6, nu=0.3)
    k = ring_plate.stiffnesses(plate)[2]
    assert plate.E * plate.thickness**3 / (k * plate.rim**2) == pytest.approx(0.217, abs=5e-4)
    assert 2 * ring_plate.membrane(plate).axial * plate.thickness**2 / k == pytest.approx(0.443, abs=3e-3)


def test_a_narrow_ring_stiffens_as_a_strip():
    """A strip clamped at both edges: 18/25 w^2/t^2, as members between ends that cannot come nearer."""
    plate = PLATE._replace(hub=29e-3)
    k = ring_plate.stiffnesses(plate)[2]
    assert 2 * ring_plate.membrane(plate).axial * plate.thickness**2 / k == pytest.approx(0.72, rel=1e-3)


def test_the_mass_is_exact_in_rigid_motions():
    M = ring_plate.mass(PLATE)
    mass, inertia = ring_plate.described_mass(PLATE)
    R = np.vstack([np.eye(6), np.eye(6)])
    np.testing.assert_allclose(R.T @ M @ R, np.diag([mass, mass, mass, *inertia]), rtol=1e-12, atol=1e-20)


def waves(plate: RingPlate, hz: float, r: float) -> np.ndarray:
    """The four solutions of order zero at a radius: w, its slope, and Kirchhoff's shear force over -D."""
    k = np.sqrt(2 * np.pi * hz * np.sqrt(plate.rho * plate.thickness / plate.bending))
    w = [jv(0, k * r), yn(0, k * r), iv(0, k * r), kn(0, k * r)]
    slope = [-k * jv(1, k * r), -k * yn(1, k * r), k * iv(1, k * r), -k * kn(1, k * r)]
    return np.array([w, slope, k**2 * np.array([-1, -1, 1, 1]) * slope])


def lowest(determinant) -> float:
    """The lowest zero of a determinant of the frequency, Hz."""
    hz = np.linspace(20.0, 8000.0, 160)
    values = np.array([determinant(f) for f in hz])
    first = int(np.flatnonzero(np.diff(np.sign(values)))[0])
    return brentq(determinant, hz[first], hz[first + 1])


@pytest.mark.parametrize(("share", "most"), [(0.0, 0.03), (1.0, 0.002)])
def test_the_frequency_of_a_guided_hub_is_that_of_bessel_functions(share, most):
    """Hubs of no mass, and of the mass of the plate: static shapes bound the frequency from above."""
    hub = share * float(ring_plate.described_mass(PLATE)[0])

    def determinant(hz: float) -> float:
        out, inn = waves(PLATE, hz, PLATE.rim), waves(PLATE, hz, PLATE.hub)
        pull = 2 * np.pi * PLATE.hub * PLATE.bending * inn[2] - hub * (2 * np.pi * hz) ** 2 * inn[0]
        rows = np.array([out[0], out[1], inn[1], pull])
        return float(np.linalg.det(rows / np.abs(rows).max(axis=1, keepdims=True)))

    k, M = ring_plate.stiffnesses(PLATE)[2], ring_plate.mass(PLATE)[8, 8] + hub
    assert 0 < np.sqrt(k / M) / (2 * np.pi) / lowest(determinant) - 1 < most


@pytest.mark.parametrize("hub", [3e-3, 10e-3, 24e-3])
def test_its_own_vibrations_begin_where_they_are_told(hub):
    plate = PLATE._replace(hub=hub, thickness=0.05e-3)

    def determinant(hz: float) -> float:
        rows = np.concatenate([waves(plate, hz, r)[:2] for r in (plate.rim, plate.hub)])
        return float(np.linalg.det(rows / np.abs(rows).max(axis=1, keepdims=True)))

    assert plate.lowest_hz == pytest.approx(lowest(determinant), rel=0.03)


def test_slopes_are_differences():
    """Of all matrices and of stretching, by the hub's radius."""

    def numbers(hub):
        plate = PLATE._replace(hub=hub)
        parts = (ring_plate.stiffnesses(plate), ring_plate.mass(plate).ravel(), np.stack(ring_plate.membrane(plate)))
        return np.concatenate(parts)

    step = 1e-8
    slope = numbers(Dual(np.array(10e-3), np.ones(1))).slope[0]
    difference = (numbers(10e-3 + step) - numbers(10e-3 - step)) / (2 * step)
    np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-9)
