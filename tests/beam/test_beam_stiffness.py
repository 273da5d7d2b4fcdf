"""Stiffness and flexibility of the uniform element."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from flexura.beam import (
    STIFFNESS_BASIS,
    SectionProperties,
    block_rotation,
    circle,
    flexibility,
    partial_flexibility,
    phi,
    rectangle,
    rigid_arm,
    stiffness,
    stiffness_coefficients,
    stiffness_from_flexibility,
)
from flexura.mechanism.placement import rotation_matrix

E, G, L = 71e9, 26.7e9, 12e-3
SECTION = rectangle(8e-3, 2e-3, 0.33)
# Six unrelated numbers, so that no two entries can be mistaken for each other
ODD = SectionProperties(*(np.float64(v) for v in (1.3e-5, 2.1e-11, 5.7e-11, 3.3e-11, 0.81, 0.67)))


def scaled(K, length=L):
    """Rotations in units of 1/length, so that all entries compare in N/m."""
    s = np.tile(np.repeat([1.0, 1 / length], 3), len(K) // 6)
    return K * np.outer(s, s)


@pytest.mark.parametrize("shear", [0, 1])
def test_symmetric_semidefinite_with_six_rigid_motions(shear):
    K = stiffness(E, G, ODD, L, shear)
    assert_array_equal(K, K.T)
    rigid = np.vstack([np.eye(6), rigid_arm([L, 0, 0])])
    assert_allclose(K @ rigid / np.abs(K).max(axis=1, keepdims=True), 0, rtol=0, atol=1e-14)
    values = np.linalg.eigvalsh(scaled(K))
    assert np.all(np.abs(values[:6]) < 1e-13 * values[-1])
    assert values[6] > 1e-5 * values[-1]


@pytest.mark.parametrize("shear", [0, 1])
def test_closed_form_is_eq_18_of_the_flexibility(shear):
    K = stiffness(E, G, ODD, L, shear)
    C = flexibility(E, G, ODD, L, shear)
    assert_allclose(scaled(stiffness_from_flexibility(C, L)), scaled(K), rtol=1e-12, atol=1e-12 * K.max())
    assert_allclose(C @ K[6:, 6:], np.eye(6), rtol=0, atol=1e-10)


def test_cantilever_tip_against_closed_forms():
    A, Iy, Iz, J, ky, kz = ODD
    load = 3.0
    for shear in (0, 1):
        C = flexibility(E, G, ODD, L, shear) * load
        assert_allclose(C[0, 0], load * L / (E * A), rtol=1e-14)
        assert_allclose(C[3, 3], load * L / (G * J), rtol=1e-14)
        assert_allclose(C[1, 1], load * L**3 / (3 * E * Iz) + shear * load * L / (ky * G * A), rtol=1e-14)
        assert_allclose(C[2, 2], load * L**3 / (3 * E * Iy) + shear * load * L / (kz * G * A), rtol=1e-14)
        # up (+z) at the tip turns the tip about -y; up (+y) turns it about +z
        assert_allclose(C[4, 2], -load * L**2 / (2 * E * Iy), rtol=1e-14)
        assert_allclose(C[5, 1], load * L**2 / (2 * E * Iz), rtol=1e-14)
        assert_allclose(C, C.T, rtol=1e-15)
        assert np.count_nonzero(C) == 10


def test_partial_flexibility_is_the_cantilever_deflection_line():
    x, ky = 0.3 * L, ODD.ky
    S = partial_flexibility(x, E, G, ODD, L, 1)
    EI = E * ODD.Iz
    assert_allclose(S[1, 1], x**2 * (3 * L - x) / (6 * EI) + x / (ky * G * ODD.A), rtol=1e-14)
    assert_allclose(S[5, 1], x * (2 * L - x) / (2 * EI), rtol=1e-14)
    assert_allclose(S[1, 5], x**2 / (2 * EI), rtol=1e-14)
    assert_allclose(S[2, 4], -(x**2) / (2 * E * ODD.Iy), rtol=1e-14)
    assert_allclose(S[0, 0], x / (E * ODD.A), rtol=1e-14)


def test_phi_and_its_switch():
    phi_y, phi_z = phi(E, G, ODD, L, np.array([0, 1]))
    assert_allclose(phi_y, [0, 12 * E * ODD.Iz / (ODD.ky * G * ODD.A * L**2)], rtol=1e-14)
    assert_allclose(phi_z, [0, 12 * E * ODD.Iy / (ODD.kz * G * ODD.A * L**2)], rtol=1e-14)


def test_printed_entries_of_the_textbook_matrix():
    # Przemieniecki (1968), Sec. 5.6: signs and places of one bending plane each
    K = stiffness(E, G, ODD, L, 1)
    phi_y, phi_z = phi(E, G, ODD, L, 1)
    y, z = E * ODD.Iz / (1 + phi_y), E * ODD.Iy / (1 + phi_z)
    assert_allclose(K[1, [1, 5, 7, 11]], [12 * y / L**3, 6 * y / L**2, -12 * y / L**3, 6 * y / L**2])
    assert_allclose(K[5, [5, 7, 11]], [(4 + phi_y) * y / L, -6 * y / L**2, (2 - phi_y) * y / L])
    assert_allclose(K[2, [2, 4, 8, 10]], [12 * z / L**3, -6 * z / L**2, -12 * z / L**3, -6 * z / L**2])
    assert_allclose(K[4, [4, 8, 10]], [(4 + phi_z) * z / L, 6 * z / L**2, (2 - phi_z) * z / L])
    assert np.count_nonzero(K) == 2 * 4 + 2 * 16


@pytest.mark.parametrize("shear", [0, 1])
def test_circular_section_has_no_preferred_plane(shear):
    K = stiffness(E, G, circle(3e-3, 0.33), L, shear)
    T = np.kron(np.eye(2), block_rotation(rotation_matrix([1.0, 0, 0], 0.7)))
    assert_allclose(scaled(T.T @ K @ T), scaled(K), rtol=0, atol=1e-13 * K.max())


@pytest.mark.parametrize("shear", [0, 1])
def test_element_turned_end_for_end_is_the_same(shear):
    K = stiffness(E, G, ODD, L, shear)
    swap = np.kron([[0, 1], [1, 0]], block_rotation(rotation_matrix([0, 0, 1.0], np.pi)))
    assert_allclose(scaled(swap.T @ K @ swap), scaled(K), rtol=0, atol=1e-13 * K.max())


def chain(lengths, section, shear):
    K = np.zeros((6 * len(lengths) + 6,) * 2)
    for i, block in enumerate(stiffness(E, G, section, np.asarray(lengths), shear)):
        K[6 * i : 6 * i + 12, 6 * i : 6 * i + 12] += block
    return K


@pytest.mark.parametrize("shear", [0, 1])
@pytest.mark.parametrize("column", range(6))
def test_patch_of_unequal_elements_is_nodally_exact(column, shear):
    lengths = [2e-3, 0.7e-3, 5e-3, 1.1e-3]
    x = np.cumsum(lengths)
    K = chain(lengths, ODD, shear)
    load = np.zeros(len(K))
    load[-6 + column] = 1.0
    u = np.linalg.solve(K[6:, 6:], load[6:]).reshape(-1, 6)
    exact = partial_flexibility(x, E, G, ODD, x[-1], shear)[..., column]
    assert_allclose(u, exact, rtol=1e-9, atol=1e-12 * np.abs(exact).max())


def test_linear_in_the_coefficients_and_broadcasting():
    lengths = np.array([[1e-3], [2e-3], [4e-3]])
    shear = np.array([0, 1, 1, 0])
    K = stiffness(E, G, SECTION, lengths, shear)
    c = stiffness_coefficients(E, G, SECTION, lengths, shear)
    assert K.shape == (3, 4, 12, 12)
    assert c.shape == (3, 4, len(STIFFNESS_BASIS)) == (3, 4, 10)
    assert STIFFNESS_BASIS.shape == (10, 144)
    assert_array_equal(K, (c @ STIFFNESS_BASIS).reshape(3, 4, 12, 12))
    assert_allclose(K[2, 1], stiffness(E, G, SECTION, 4e-3, 1), rtol=1e-14)
    wide = rectangle(np.array([4e-3, 8e-3]), 1e-3, 0.33)
    assert_allclose(stiffness(E, G, wide, L, 1)[1], stiffness(E, G, rectangle(8e-3, 1e-3, 0.33), L, 1))
    C = flexibility(E, G, SECTION, lengths, shear)
    assert_allclose(stiffness_from_flexibility(C, lengths)[1, 2], K[1, 2], rtol=1e-9, atol=1e-9 * K[1, 2].max())


def test_timoshenko_element_does_not_lock():
    leaf = rectangle(1e-2, 1e-6, 0.33)
    soft = np.ix_([2, 4, 8, 10], [2, 4, 8, 10])
    slender = stiffness(E, G, leaf, 1e-2, 1)[soft]
    assert_allclose(slender, stiffness(E, G, leaf, 1e-2, 0)[soft], rtol=1e-6)
    assert_allclose(slender[0, 0], 12 * E * 1e-2 * 1e-6**3 / 12 / 1e-2**3, rtol=1e-6)
