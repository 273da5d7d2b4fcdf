"""Criteria of likeness against closed forms, numbers worked out by hand, and another implementation."""

import numpy as np
import pytest

from flexura.errors import OptionError
from flexura.modal.criteria import (
    channel_gain,
    comac,
    frac,
    in_space,
    mac,
    orthogonality,
    space_mac,
    trusted_channels,
)

TURN = 0.4


def plane(angle):
    """Two orthonormal shapes in five dimensions, and one at an angle to the first in their plane."""
    e = np.eye(5)
    return e[:, [0]], e[:, :2], (np.cos(angle) * e[:, 0] + np.sin(angle) * e[:, 1])[:, None]


def random_shapes(seed, p=7, n=3):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(p, n)) + 1j * rng.normal(size=(p, n))


def test_mac_is_the_squared_cosine():
    a, _, b = plane(TURN)
    assert mac(a, b)[0, 0] == pytest.approx(np.cos(TURN) ** 2, rel=1e-14)


def test_mac_of_a_simply_supported_beam_on_an_even_grid():
    """Sines on an even grid are orthogonal (discrete sine transform)."""
    k = np.arange(1, 10)
    shapes = np.sin(np.pi * np.outer(k, [1, 2, 3, 4]) / 10)
    assert np.allclose(mac(shapes, shapes), np.eye(4), atol=1e-14)


def test_mac_aliases_on_a_coarse_grid():
    """With three sensors at the quarter points modes 2 and 6 of that beam read the same up to the sign."""
    k = np.arange(1, 4)
    shapes = np.sin(np.pi * np.outer(k, [2, 6]) / 4)
    assert mac(shapes, shapes)[0, 1] == pytest.approx(1.0, abs=1e-14)


def test_mac_knows_no_complex_scale():
    a, scale = random_shapes(0), np.array([2.0j, -3.0, 0.1 + 5j])
    assert np.allclose(np.diag(mac(a, a * scale)), 1.0)


def test_mac_equals_that_of_sdypy():
    tools = pytest.importorskip("sdypy.EMA.tools")
    a, b = random_shapes(1).real, random_shapes(2).real
    assert np.allclose(mac(a, b), tools.MAC(a, b), atol=1e-14)


def test_weighted_mac_is_that_of_transformed_shapes():
    rng = np.random.default_rng(3)
    L = rng.normal(size=(7, 7))
    a, b = random_shapes(4), random_shapes(5)
    assert np.allclose(mac(a, b, weight=L.T @ L), mac(L @ a, L @ b), atol=1e-13)


def test_orthogonality_of_a_chain_with_unequal_masses():
    """Two masses m and 4m between equal springs: K-M modes are orthogonal over M, not without it."""
    M, K = np.diag([1.0, 4.0]), np.array([[2.0, -1.0], [-1.0, 2.0]])
    values, vectors = np.linalg.eig(np.linalg.solve(M, K))
    assert (values > 0).all()
    assert orthogonality(vectors, vectors, M)[0, 1] == pytest.approx(0.0, abs=1e-7)
    assert mac(vectors, vectors)[0, 1] > 0.05


def test_a_shape_that_is_zero_has_no_likeness():
    assert mac(np.zeros((4, 1)), np.ones((4, 1)))[0, 0] == 0.0


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2])
def test_share_in_a_space(angle):
    """A shape out of a plane by an angle has the share cos^2 in it, whatever basis the plane has."""
    _, two, _ = plane(0.0)
    basis = two @ np.array([[1.0, 1.0], [0.2, -3.0]])
    x = (np.cos(angle) * (two[:, 0] - two[:, 1]) / np.sqrt(2))[:, None] + np.sin(angle) * np.eye(5)[:, [3]]
    assert space_mac(x, basis)[0] == pytest.approx(np.cos(angle) ** 2, abs=1e-14)
    assert np.allclose(in_space(x, basis), x - np.sin(angle) * np.eye(5)[:, [3]], atol=1e-14)


def test_share_in_one_shape_is_the_mac():
    a, b = random_shapes(6), random_shapes(7)
    assert np.allclose(space_mac(a, b[:, [0]]), mac(a, b)[:, 0])


def test_share_in_dependent_shapes_counts_them_once():
    a, b = random_shapes(8), random_shapes(9)[:, [0]]
    assert np.allclose(space_mac(a, np.hstack([b, 2 * b])), space_mac(a, b))


def test_comac_by_hand():
    a, b = np.array([[1.0, 2.0], [3.0, 0.0], [0.0, 0.0]]), np.array([[2.0, -1.0], [3.0, 0.0], [1.0, 1.0]])
    assert np.allclose(comac(a, b), [(2 + 2) ** 2 / (5 * 5), 1.0, 0.0])


@pytest.mark.parametrize("factor", [-1.0, 9.81])
def test_gain_finds_a_wrong_channel_that_comac_cannot_see(factor):
    a = random_shapes(10, p=9, n=4)
    b = a.copy()
    b[4] *= factor
    b *= np.array([1.0, 2.0j, -1.0, 0.3])
    assert comac(np.abs(b) / np.abs([1.0, 2.0j, -1.0, 0.3]), a)[4] == pytest.approx(1.0)
    gain = channel_gain(b, a)
    assert gain[4] == pytest.approx(factor, rel=1e-12)
    assert np.allclose(np.delete(gain, 4), 1.0)
    assert np.flatnonzero(~trusted_channels(b, a)).tolist() == [4]


def test_noise_leaves_channels_trusted():
    a = random_shapes(12, p=12, n=4)
    assert trusted_channels(a + 0.1 * random_shapes(13, p=12, n=4), a).all()


def test_gain_of_equal_shapes_is_one():
    a = random_shapes(11)
    assert np.allclose(channel_gain(a * np.array([1j, 2, 3]), a), 1.0)


def test_frac_by_hand():
    H, G = np.array([1.0, 1j]).reshape(2, 1, 1), np.array([1.0, 0.0]).reshape(2, 1, 1)
    assert frac(H, G)[0, 0] == pytest.approx(0.5)
    assert frac(H, (3 - 4j) * H)[0, 0] == pytest.approx(1.0)


def test_frac_of_a_shifted_resonance():
    """1/(w0 - w + i d): the overlap of two such lines shifted by s, over all frequencies, is d^2/(d^2 + s^2/4)."""
    w, d, s = np.linspace(-4000, 4000, 400001), 1.0, 1.5
    H, G = (1 / (shift - w + 1j * d) for shift in (0.0, s))
    assert frac(H[:, None, None], G[:, None, None])[0, 0] == pytest.approx(d**2 / (d**2 + s**2 / 4), rel=1e-3)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: mac(np.ones((3, 1)), np.ones((4, 1))), "same sensors"),
        (lambda: mac(np.ones(3), np.ones((3, 1))), "same sensors"),
        (lambda: mac(np.array([[np.nan]]), np.ones((1, 1))), "not finite"),
        (lambda: comac(np.ones((3, 1)), np.ones((3, 2))), "equal numbers"),
        (lambda: frac(np.ones((3, 1, 1)), np.ones((4, 1, 1))), "one shape"),
    ],
)
def test_what_is_refused(call, words):
    with pytest.raises(OptionError, match=words):
        call()
