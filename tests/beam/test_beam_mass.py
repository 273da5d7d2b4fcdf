"""Consistent mass of the uniform element: rigid inertia, quadrature, frequencies."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eigh
from scipy.optimize import brentq

from flexura.beam import (
    MASS_BASIS,
    SectionProperties,
    block_rotation,
    circle,
    mass,
    mass_coefficients,
    phi,
    rectangle,
    rigid_arm,
    shape_functions,
    stiffness,
    tube,
)
from flexura.mechanism.placement import rotation_matrix

E, G, RHO, L = 71e9, 26.7e9, 2810.0, 12e-3
ODD = SectionProperties(*(np.float64(v) for v in (1.3e-5, 2.1e-11, 5.7e-11, 3.3e-11, 0.81, 0.67)))
THEORIES = [(0, 0), (0, 1), (1, 0), (1, 1)]  # shear, rotary


def scaled(M, length=L):
    s = np.tile(np.repeat([1.0, 1 / length], 3), len(M) // 6)
    return M * np.outer(s, s)


def element_mass(section, length, shear, rotary):
    return mass(RHO, section, length, *phi(E, G, section, length, shear), rotary)


def eq_12(x):
    """Return Nbar(x) = [D(x), 0] + N(x), N the printed polynomials of eq. 12 (x^3/L^2 - x^2/L in row 2)."""
    N = np.zeros((6, 12))
    a, b = 2 * x**3 / L**3 - 3 * x**2 / L**2, x**3 / L**2 - 2 * x**2 / L
    c, d = 3 * x**2 / L**2 - 2 * x**3 / L**3, x**3 / L**2 - x**2 / L
    e, f = 6 * x**2 / L**3 - 6 * x / L**2, 3 * x**2 / L**2 - 4 * x / L
    g, h = 6 * x / L**2 - 6 * x**2 / L**3, 3 * x**2 / L**2 - 2 * x / L
    N[0, [0, 6]] = N[3, [3, 9]] = -x / L, x / L
    N[1, [1, 5, 7, 11]] = a, b, c, d
    N[2, [2, 4, 8, 10]] = a, -b, c, -d
    N[4, [2, 4, 8, 10]] = -e, f, -g, h
    N[5, [1, 5, 7, 11]] = e, f, g, h
    D = np.eye(6)
    D[1, 5], D[2, 4] = x, -x
    N[:, :6] += D
    return N


def quadrature(shape, section, rotary):
    """Integrate eqs. 14-16 with ten Gauss points."""
    s, w = np.polynomial.legendre.leggauss(10)
    A, Iy, Iz = section[:3]
    dI = np.diag([Iy + Iz, rotary * Iy, rotary * Iz])
    M = np.zeros((12, 12))
    for x, weight in zip((1 + s) * L / 2, w * L / 2, strict=True):
        N = shape(x)
        M += RHO * weight * (A * N[:3].T @ N[:3] + N[3:].T @ dI @ N[3:])
    return M


def test_shape_functions_are_those_of_eq_12():
    for x in np.linspace(0, L, 7):
        N = shape_functions(x, E, G, ODD, L, 0)
        assert_allclose(N, eq_12(x), rtol=1e-10, atol=1e-10 * (1 + np.abs(eq_12(x))).max())
    ends = shape_functions(np.array([0.0, L]), E, G, ODD, L, 1)
    assert_allclose(ends[0], np.eye(12)[:6], rtol=0, atol=1e-12)
    assert_allclose(ends[1], np.eye(12)[6:], rtol=0, atol=1e-9)


@pytest.mark.parametrize("rotary", [0, 1])
def test_closed_form_is_the_quadrature_of_eqs_14_to_16(rotary):
    M = element_mass(ODD, L, 0, rotary)
    expected = quadrature(eq_12, ODD, rotary)
    assert_allclose(scaled(M), scaled(expected), rtol=0, atol=1e-14 * M.max())


@pytest.mark.parametrize(("shear", "rotary"), THEORIES)
def test_closed_form_is_the_quadrature_of_the_static_shape_functions(shear, rotary):
    M = element_mass(ODD, L, shear, rotary)
    expected = quadrature(lambda x: shape_functions(x, E, G, ODD, L, shear), ODD, rotary)
    assert_allclose(scaled(M), scaled(expected), rtol=0, atol=1e-12 * M.max())


@pytest.mark.parametrize(("shear", "rotary"), THEORIES)
def test_symmetric_positive_definite(shear, rotary):
    M = element_mass(ODD, L, shear, rotary)
    assert_array_equal(M, M.T)
    assert np.linalg.eigvalsh(scaled(M))[0] > 0


def about_centre(section, shear, rotary):
    """Return the 6x6 inertia that the element shows to rigid motions with its centre."""
    rigid = np.vstack([rigid_arm([-L / 2, 0, 0]), rigid_arm([L / 2, 0, 0])])
    return rigid.T @ element_mass(section, L, shear, rotary) @ rigid


@pytest.mark.parametrize("shear", [0, 1])
@pytest.mark.parametrize(
    ("section", "inertia_over_mass"),
    [
        (
            rectangle(8e-3, 2e-3, 0.33),
            [(8e-3**2 + 2e-3**2) / 12, (L**2 + 2e-3**2) / 12, (L**2 + 8e-3**2) / 12],
        ),
        (circle(5e-3, 0.33), [5e-3**2 / 8, L**2 / 12 + 5e-3**2 / 16, L**2 / 12 + 5e-3**2 / 16]),
        (tube(5e-3, 4e-3, 0.33), [41e-6 / 8, L**2 / 12 + 41e-6 / 16, L**2 / 12 + 41e-6 / 16]),
    ],
    ids=["cuboid", "cylinder", "hollow cylinder"],
)
def test_rigid_inertia_of_solids(section, inertia_over_mass, shear):
    m = RHO * section.A * L
    expected = m * np.diag([1, 1, 1, *inertia_over_mass])
    assert_allclose(about_centre(section, shear, 1), expected, rtol=1e-12, atol=1e-14 * m * L)


def test_rotary_switch_leaves_the_slender_rod_and_the_torsional_inertia():
    m = RHO * ODD.A * L
    polar = RHO * (ODD.Iy + ODD.Iz) * L
    expected = np.diag([m, m, m, polar, m * L**2 / 12, m * L**2 / 12])
    assert_allclose(about_centre(ODD, 0, 0), expected, rtol=1e-12, atol=1e-14 * m * L)


@pytest.mark.parametrize(("shear", "rotary"), THEORIES)
def test_frame_invariance(shear, rotary):
    round_mass = element_mass(circle(3e-3, 0.33), L, shear, rotary)
    turn = np.kron(np.eye(2), block_rotation(rotation_matrix([1.0, 0, 0], 0.7)))
    assert_allclose(scaled(turn.T @ round_mass @ turn), scaled(round_mass), rtol=0, atol=1e-14 * round_mass.max())
    M = element_mass(ODD, L, shear, rotary)
    swap = np.kron([[0, 1], [1, 0]], block_rotation(rotation_matrix([0, 0, 1.0], np.pi)))
    assert_allclose(scaled(swap.T @ M @ swap), scaled(M), rtol=0, atol=1e-14 * M.max())


def plane_frequencies(section, length, n, theory, pinned):
    """Return the bending frequencies, rad/s, in the soft plane (tz, ry) of a uniform beam of n elements."""
    shear, rotary = theory
    K, M = np.zeros((2, 2 * n + 2, 2 * n + 2))
    plane = np.ix_([2, 4, 8, 10], [2, 4, 8, 10])
    k = stiffness(E, G, section, length / n, shear)[plane]
    m = element_mass(section, length / n, shear, rotary)[plane]
    for i in range(0, 2 * n, 2):
        K[i : i + 4, i : i + 4] += k
        M[i : i + 4, i : i + 4] += m
    keep = np.setdiff1d(np.arange(2 * n + 2), [0, 2 * n] if pinned else [0, 1])
    # the largest periods keep the digits that the lowest eigenvalues of a stiff K lose
    return 1 / np.sqrt(eigh(M[np.ix_(keep, keep)], K[np.ix_(keep, keep)], eigvals_only=True)[::-1])


def test_clamped_free_frequencies_converge_with_order_four():
    section, length = rectangle(10e-3, 1e-3, 0.33), 0.1
    beta = [brentq(lambda b: np.cos(b) * np.cosh(b) + 1, *bracket) for bracket in ((1, 3), (4, 6))]
    exact = np.array(beta) ** 2 * np.sqrt(E * section.Iy / (RHO * section.A * length**4))
    errors = [plane_frequencies(section, length, n, (0, 0), False)[:2] / exact - 1 for n in (4, 8, 16)]
    assert np.all(np.array(errors) > 0)  # consistent masses bound the frequencies from above
    assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 4.0, rtol=0, atol=0.25)


@pytest.mark.parametrize(("shear", "rotary"), THEORIES)
def test_pinned_pinned_frequencies_of_all_four_theories(shear, rotary):
    # v = sin(kx), theta ~ cos(kx) solves Timoshenko's equations (1921): a omega^4 - b omega^2 + c = 0
    section, length = rectangle(5e-3, 8e-3, 0.33), 0.05
    k = np.pi * np.array([1, 2, 3]) / length
    line, turning, EI = RHO * section.A, rotary * RHO * section.Iy, E * section.Iy
    soft = shear / (section.kz * G * section.A)
    a = line * turning * soft
    b = line + turning * k**2 + line * EI * k**2 * soft
    exact = np.sqrt(2 * EI * k**4 / (b + np.sqrt(b * b - 4 * a * EI * k**4)))
    coarse, fine = (plane_frequencies(section, length, n, (shear, rotary), True)[:3] for n in (24, 48))
    order = 2 if shear else 4  # the shear strain is constant in the element
    assert_allclose(np.log2((coarse - exact) / (fine - exact)), order, rtol=0, atol=0.02)
    assert_allclose(fine + (fine - coarse) / (2**order - 1), exact, rtol=1e-5)


def test_linear_in_the_coefficients_and_broadcasting():
    section = rectangle(8e-3, np.array([1e-3, 2e-3, 3e-3, 4e-3]), 0.33)
    lengths, rotary = np.array([[5e-3], [9e-3]]), np.array([0, 1, 1, 0])
    phi_y, phi_z = phi(E, G, section, lengths, 1)
    M = mass(RHO, section, lengths, phi_y, phi_z, rotary)
    c = mass_coefficients(RHO, section, lengths, phi_y, phi_z, rotary)
    assert c.shape == (2, 4, len(MASS_BASIS)) == (2, 4, 14)
    assert MASS_BASIS.shape == (14, 144)
    assert_array_equal(M, (c @ MASS_BASIS).reshape(2, 4, 12, 12))
    one = rectangle(8e-3, 3e-3, 0.33)
    assert_allclose(M[1, 2], element_mass(one, 9e-3, 1, 1), rtol=1e-13)
    assert_array_equal(mass(2 * RHO, section, lengths, phi_y, phi_z, rotary), 2 * M)
