"""Tapered element against the uniform element, closed forms and notch integrals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from flexura.beam import (
    SectionProperties,
    flexibility,
    gauss_stations,
    integration_matrices,
    mass,
    notch,
    phi,
    rectangle,
    rigid_arm,
    stiffness,
    stiffness_from_flexibility,
    tapered,
)

E, G, RHO, L = 71e9, 26.7e9, 2810.0, 12e-3
ODD = SectionProperties(*(np.float64(v) for v in (1.3e-5, 2.1e-11, 5.7e-11, 3.3e-11, 0.81, 0.67)))


def scaled(K, length=L):
    s = np.tile(np.repeat([1.0, 1 / length], 3), K.shape[-1] // 6)
    return K * np.outer(s, s)


@pytest.mark.parametrize("n", [1, 2, 5, 12])
def test_gauss_stations_are_exact_to_degree_2n_minus_1(n):
    x, w = gauss_stations(n)
    for degree in range(2 * n):
        assert_allclose(w @ x**degree, 1 / (degree + 1), rtol=1e-13)
    assert abs(w @ x ** (2 * n) * (2 * n + 1) - 1) > 1e-13 or n > 8


@pytest.mark.parametrize("points", [gauss_stations(7)[0], np.linspace(0, 1, 7)], ids=["gauss", "equidistant"])
def test_integration_matrices_are_exact_to_degree_n_minus_1(points):
    A1, A2 = integration_matrices(points)
    for d in range(len(points)):
        f = points**d
        assert_allclose(A1 @ f, points ** (d + 1) / (d + 1), rtol=0, atol=1e-14)
        assert_allclose(A2 @ f, points ** (d + 2) / (d + 1) / (d + 2), rtol=0, atol=1e-14)


@pytest.mark.parametrize("n", [4, 5, 9])
@pytest.mark.parametrize(("shear", "rotary"), [(0, 0), (0, 1), (1, 1)])
def test_uniform_section_gives_the_uniform_element(shear, rotary, n):
    points, weights = gauss_stations(n)
    along = SectionProperties(*(np.full(n, v) for v in ODD))
    C, M = tapered(E, G, RHO, along, L, shear, rotary, points, weights)
    assert_allclose(C, flexibility(E, G, ODD, L, shear), rtol=1e-12)
    K = stiffness(E, G, ODD, L, shear)
    assert_allclose(scaled(stiffness_from_flexibility(C, L)), scaled(K), rtol=0, atol=1e-11 * K.max())
    uniform = mass(RHO, ODD, L, *phi(E, G, ODD, L, shear), rotary)
    assert_allclose(scaled(M), scaled(uniform), rtol=0, atol=1e-11 * uniform.max())


def test_wedge_against_closed_forms():
    # h(x) = h0 + (h1 - h0) x/L, clamped at h0, width b: integrals of 1/h, 1/h^3, (L - x)^2/h^3
    b, h0, h1 = 6e-3, 3e-3, 1e-3
    points, weights = gauss_stations(30)
    section = rectangle(b, h0 + (h1 - h0) * points, 0.33)
    s = (h1 - h0) / L
    inverse = np.log(h1 / h0) / s
    cubed = (h0**-2 - h1**-2) / (2 * s)
    arm2 = (np.log(h1 / h0) + 2 * h1 * (1 / h1 - 1 / h0) - h1**2 / 2 * (h1**-2 - h0**-2)) / s**3
    for shear in (0, 1):
        C, _ = tapered(E, G, RHO, section, L, shear, 1, points, weights)
        slide = shear * inverse / (section.kz[0] * G * b)
        assert_allclose(C[0, 0], inverse / (E * b), rtol=1e-12)
        assert_allclose(C[4, 4], 12 * cubed / (E * b), rtol=1e-12)
        assert_allclose(C[2, 2], 12 * arm2 / (E * b) + slide, rtol=1e-11)
        assert_allclose(C, C.T, rtol=1e-14)


@pytest.mark.parametrize(
    ("R", "t", "rotation", "axial", "deflection"),
    [  # E = width = 1, force at the end xi = +R, bending only
        (4.0, 0.3, 568.113434957, 9.208600189, 9295.623094336),
        (5.0, 1.0, 30.799930062, 4.938822902, 810.89984228),
        (3.0, 0.5, 135.557013496, 5.570887661, 1275.749223521),
        (2.0, 1.0, 18.714616562, 2.592689581, 82.716359925),
    ],
)
def test_right_circular_notch_against_the_notch_integrals(R, t, rotation, axial, deflection):
    # Cutting at xi = R sin(theta) makes the elements short where the profile is steep.
    cuts = R * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 81))
    points, weights = gauss_stations(8)
    lengths = np.diff(cuts)
    xi = cuts[:-1, None] + lengths[:, None] * points
    section = rectangle(1.0, notch.circular(xi, R, t), 0.3)
    C, M = tapered(1.0, 0.4, 1.0, section, lengths, 0, 1, points, weights)
    to_end = rigid_arm(np.stack([R - cuts[1:], 0 * lengths, 0 * lengths], axis=-1))
    total = (to_end @ C @ np.swapaxes(to_end, -1, -2)).sum(axis=0)
    assert_allclose(total[4, 4], rotation, rtol=1e-9)
    assert_allclose(total[0, 0], axial, rtol=1e-6)
    assert_allclose(total[2, 2], deflection, rtol=1e-9)
    area = 2 * R * (t + 2 * R) - np.pi * R**2
    assert_allclose(M[:, 0, 0].sum() + 2 * M[:, 0, 6].sum() + M[:, 6, 6].sum(), area, rtol=1e-6)


@pytest.mark.parametrize("shear", [0, 1])
def test_rigid_motions_of_a_tapered_element(shear):
    points, weights = gauss_stations(6)
    b, h = 6e-3, 1e-3 * (1 + points + points**2)
    section = rectangle(b, h, 0.33)
    C, M = tapered(E, G, RHO, section, L, shear, 1, points, weights)
    K = stiffness_from_flexibility(C, L)
    rigid = np.vstack([np.eye(6), rigid_arm([L, 0, 0])])
    assert_allclose(scaled(rigid.T @ K @ rigid), 0, rtol=0, atol=1e-13 * K.max())
    assert np.abs(K @ rigid).max() < 1e-10 * K.max()
    m0 = RHO * b * 1e-3 * L * (1 + 1 / 2 + 1 / 3)
    m1 = RHO * b * 1e-3 * L**2 * (1 / 2 + 1 / 3 + 1 / 4)
    m2 = RHO * b * 1e-3 * L**3 * (1 / 3 + 1 / 4 + 1 / 5)
    Iy = RHO * L * weights @ section.Iy  # degree 6: exact
    Iz = RHO * L * weights @ section.Iz
    expected = np.diag([m0, m0, m0, Iy + Iz, m2 + Iy, m2 + Iz])
    expected[1, 5] = expected[5, 1] = m1
    expected[2, 4] = expected[4, 2] = -m1
    assert_allclose(rigid.T @ M @ rigid, expected, rtol=1e-10, atol=1e-10 * m0 * L**2)


def test_frequencies_of_a_tapered_cantilever_against_many_uniform_elements():
    b, length = 6e-3, 0.03

    def thickness(x):
        return 3e-3 - 2e-3 * x / length

    def frequencies(K, M):
        n = len(K)
        assembled = np.zeros((2, 6 * n + 6, 6 * n + 6))
        for i in range(n):
            assembled[:, 6 * i : 6 * i + 12, 6 * i : 6 * i + 12] += K[i], M[i]
        return np.sqrt(eigh(*assembled[:, 6:, 6:], eigvals_only=True)[:4])

    fine = rectangle(b, thickness((np.arange(200) + 0.5) * length / 200), 0.33)
    step = np.full(200, length / 200)
    K = stiffness(E, G, fine, step, 1)
    expected = frequencies(K, mass(RHO, fine, step, *phi(E, G, fine, step, 1), 1))
    points, weights = gauss_stations(6)
    x = length / 32 * (np.arange(32)[:, None] + points)
    C, M = tapered(E, G, RHO, rectangle(b, thickness(x), 0.33), length / 32, 1, 1, points, weights)
    assert_allclose(frequencies(stiffness_from_flexibility(C, length / 32), M), expected, rtol=5e-4)


def test_broadcasts_over_designs_and_elements():
    points, weights = gauss_stations(5)
    lengths = np.array([4e-3, 6e-3])
    web = np.array([2e-4, 3e-4, 5e-4])[:, None, None]
    xi = (points - 0.5) * lengths[:, None]
    section = rectangle(5e-3, notch.parabolic(xi, 5e-3, 1e-3, web), 0.33)
    shear, rho = np.array([0, 1]), np.array([[2700.0], [2800.0], [7800.0]])
    C, M = tapered(E, G, rho, section, lengths, shear, 1, points, weights)
    assert C.shape == (3, 2, 6, 6)
    assert M.shape == (3, 2, 12, 12)
    one = SectionProperties(*(field[2, 1] for field in section))
    C1, M1 = tapered(E, G, 7800.0, one, 6e-3, 1, 1, points, weights)
    assert_allclose(C[2, 1], C1, rtol=1e-13)
    assert_allclose(M[2, 1], M1, rtol=1e-10, atol=1e-10 * M1.max())
    designs = np.linspace(60e9, 80e9, 4)  # a design axis the section does not have
    assert_allclose(tapered(designs, G, 1.0, one, 6e-3, 1, 1, points, weights)[0][0, 0, 0] * 60, C1[0, 0] * 71)
