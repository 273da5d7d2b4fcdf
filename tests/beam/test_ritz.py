"""Elastic boxes and cylinders by Ritz functions: closed forms and published frequencies."""

from __future__ import annotations

import numpy as np
import pytest

from flexura.beam import ElasticSolid, Material, ModalSolid, Patches, RitzSolid, elastic_body, patch_flexibility

E, NU, RHO = 206e9, 0.3, 7850.0
STEEL = Material(np.array(E), np.array(NU), np.array(RHO))
FREE_BEAM = 4.730041  # first root of cos x cosh x = 1 (Blevins, Formulas for Natural Frequency and Mode Shape, 1979)


def solid(*size: float, held: tuple[int, int] | None = None, is_round: bool = False) -> ModalSolid:
    sides = np.array(size)
    return ModalSolid(RitzSolid.of(sides, is_round, held), sides, STEEL)


def hz(own: ModalSolid, count: int = 1) -> np.ndarray:
    return np.sqrt(own.modes(count)[0]) / (2 * np.pi)


def patches(*rectangles: tuple[tuple[float, ...], tuple[float, ...]]) -> Patches:
    """Patches by their centres and half sides along x, y, z, read at their centres."""
    t, w = np.polynomial.legendre.leggauss(5)
    grid = np.stack(np.meshgrid(t, t, t, indexing="ij"), axis=-1).reshape(-1, 3)
    weights = np.einsum("i,j,k->ijk", w, w, w).ravel() / 8
    centres = np.array([centre for centre, _ in rectangles])
    points = np.stack([np.array(centre) + grid * np.array(half) for centre, half in rectangles])
    return Patches(points, np.tile(weights, (len(rectangles), 1)), centres)


def test_a_cube_has_the_modes_of_lame() -> None:
    """G. Lame, Lecons sur la theorie mathematique de l'elasticite, 1852: shear that leaves all faces free of stress, at
    the square root of 2 times the speed of shear over twice the side, for any Poisson's ratio."""
    side = 0.02
    lame = np.sqrt(E / (2 * (1 + NU)) / RHO) / (np.sqrt(2) * side)
    found = hz(solid(side, side, side), 20)
    assert np.abs(found / lame - 1).min() < 1e-3


def test_a_square_plate_has_the_frequencies_of_leissa() -> None:
    """A. W. Leissa, J. Sound Vib. 31 (1973) 257: thin free square plate, nu = 0.3; upper bounds from beam functions."""
    a, h = 0.1, 0.001
    D = E * h**3 / 12 / (1 - NU**2)
    found = 2 * np.pi * hz(solid(a, a, h), 3) * a**2 * np.sqrt(RHO * h / D)
    leissa = np.array([13.489, 19.789, 24.432])
    assert np.all(found < leissa) and np.all(found > 0.985 * leissa)


def test_a_box_of_aluminium_has_the_frequencies_that_were_measured() -> None:
    """H. Ogi, K. Sato, T. Asada, M. Hirao, J. Acoust. Soc. Am. 112 (2002) 2553: a free box of 11.92 x 10.93 x 9.86 mm,
    its ten lowest frequencies as measured and as computed with the C11 and C44 that fit all of them, kHz."""
    measured = [116.716, 143.783, 158.081, 166.5, 169.523, 177.846, 183.875, 186.047, 190.341, 197.386]
    computed = [116.32, 143.186, 158.44, 166.113, 169.338, 178.36, 184.57, 185.078, 190.206, 197.692]
    lame, mu = 109.26e9 - 2 * 26.72e9, 26.72e9
    aluminium = Material(
        *(np.array(x) for x in (mu * (3 * lame + 2 * mu) / (lame + mu), lame / (2 * (lame + mu)), 2788.0))
    )
    sides = np.array([11.92e-3, 10.93e-3, 9.86e-3])
    for functions, off_measured, off_computed in (
        (RitzSolid.of(sides), 6e-3, 4e-3),
        (RitzSolid((10, 10, 10)), 5e-3, 1.6e-3),
    ):
        found = hz(ModalSolid(functions, sides, aluminium), 10) / 1e3
        np.testing.assert_allclose(found, measured, rtol=off_measured)
        np.testing.assert_allclose(found, computed, rtol=off_computed)


@pytest.mark.parametrize("is_round", [False, True])
def test_a_slender_one_has_the_frequency_of_a_free_beam(is_round: bool) -> None:
    L, h = 0.1, 0.004
    radius = h / 4 if is_round else h / np.sqrt(12)  # of gyration
    beam = FREE_BEAM**2 / (2 * np.pi * L**2) * np.sqrt(E / RHO) * radius
    assert hz(solid(L, h, h, is_round=is_round))[0] == pytest.approx(beam, rel=7e-3)


def test_a_box_that_is_held_yields_and_vibrates_as_a_cantilever() -> None:
    """Stretch L/(E A), and bending by a moment: rotation M L / (E I); wrenches over the whole end."""
    L, b = 0.1, 0.01
    own = solid(L, b, b, held=(0, -1))
    C = patch_flexibility(own, patches(((L / 2, 0.0, 0.0), (0.0, b / 2, b / 2))))
    np.testing.assert_allclose([C[0, 0], C[4, 4]], [L / (E * b**2), 12 * L / (E * b**4)], rtol=0.02)
    assert hz(own)[0] == pytest.approx(3.5160 / (2 * np.pi * L**2) * np.sqrt(E * b**2 / 12 / RHO), rel=0.02)


def test_a_box_yields_to_opposite_moments_as_a_beam_does() -> None:
    L, b = 0.1, 0.004
    ends = patches(*(((x, 0.0, 0.0), (0.0, b / 2, b / 2)) for x in (-L / 2, L / 2)))
    C = patch_flexibility(solid(L, b, b), ends)
    moment = np.zeros(12)
    moment[[4, 10]] = -1.0, 1.0
    assert moment @ C @ moment == pytest.approx(L / (E * b**4 / 12), rel=0.01)


@pytest.mark.parametrize("held", [None, (1, 1)])
def test_superelements_move_rigidly_without_strain_and_with_their_mass(held: tuple[int, int] | None) -> None:
    size = np.array([0.03, 0.02, 0.01])
    own = ModalSolid(RitzSolid.of(size, False, held, 2), size, STEEL)
    ends = patches(((0.015, 0.004, 0.0), (0.0, 0.002, 0.003)), ((-0.015, 0.0, 0.0), (0.0, 0.002, 0.003)))
    mass = RHO * size.prod()
    square = size**2 / 12
    rigid_mass = np.diag([mass] * 3 + list(mass * (square.sum() - square)))
    K, M = elastic_body(own, ends, own.modes(6)[1], rigid_mass)
    from flexura.beam import rigid_arm

    nodes = np.concatenate([np.zeros((1, 3)), ends.nodes, *([np.zeros((1, 3))] if held else [])])
    R = np.concatenate([rigid_arm(nodes).reshape(-1, 6), np.zeros((6, 6))])
    assert np.abs(K @ R).max() < 1e-9 * np.abs(K).max()
    np.testing.assert_allclose(R.T @ M @ R, rigid_mass, atol=1e-9 * mass)
    values = np.linalg.eigvalsh(M)
    assert values.min() > 0


def test_both_coordinates_give_the_same_matrices() -> None:
    size = np.array([0.03, 0.02, 0.01])
    functions = RitzSolid.of(size, True, (0, -1), 1)
    ends = patches(((0.015, 0.002, 0.0), (0.0, 0.002, 0.001)))
    plain, modal = ElasticSolid(functions, size, STEEL), ModalSolid(functions, size, STEEL)
    shapes = modal.modes(6)[1]
    for one, other in zip(*(elastic_body(own, ends, shapes, np.eye(6)) for own in (plain, modal)), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-8 * np.abs(other).max())
