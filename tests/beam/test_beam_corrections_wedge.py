"""Wedge theory of notches against the stresses of wedges, closed integrals and beam theory."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import dblquad, quad

from flexura.beam import notch
from flexura.beam.notch import beam_flexibility, notch_flexibility, wedge_functions

EVERY = (0.05, 0.4, 1.0, np.pi / 2)


@pytest.mark.parametrize("a", EVERY)
def test_bending_and_stretching_of_a_wedge_in_closed_form(a):
    """Integrals over the angle by hand."""
    F, N, _, _ = wedge_functions(a)
    K = np.sin(2 * a) - 2 * a * np.cos(2 * a)
    radial = 4 * (a - np.sin(4 * a) / 4)
    shear = 2 * (a - 1.5 * np.sin(2 * a) * np.cos(2 * a) + 2 * a * np.cos(2 * a) ** 2)
    assert_allclose(F, 8 * np.sin(a) ** 3 * (radial + shear) / K**2, rtol=1e-9)
    assert_allclose(N, 4 * np.sin(a) / (2 * a + np.sin(2 * a)), rtol=1e-12)


def stresses(a):
    """Return radial and shear stress times r^2 under a unit moment, and radial stress times r under a unit force."""
    K = np.sin(2 * a) - 2 * a * np.cos(2 * a)

    def bend(q):
        return 2 * np.sin(2 * q) / K, (np.cos(2 * q) - np.cos(2 * a)) / K

    def pull(q):
        return 2 * np.cos(q) / (2 * a + np.sin(2 * a))

    return bend, pull


@pytest.mark.parametrize("a", [0.3, 1.2])
def test_functions_are_energies_of_stresses_that_carry_the_load(a):
    bend, pull = stresses(a)
    assert_allclose(quad(lambda q: bend(q)[1], -a, a)[0], 1.0, rtol=1e-12)
    assert bend(a)[1] == bend(-a)[1] == 0.0
    assert_allclose(quad(lambda q: pull(q) * np.cos(q), -a, a)[0], 1.0, rtol=1e-12)
    F, N, _, _ = wedge_functions(a)
    energy = quad(lambda q: bend(q)[0] ** 2 + 2 * bend(q)[1] ** 2, -a, a)[0]
    assert_allclose(F, 8 * np.sin(a) ** 3 * energy, rtol=1e-10)
    assert_allclose(N, 2 * np.sin(a) * quad(lambda q: pull(q) ** 2, -a, a)[0], rtol=1e-10)


@pytest.mark.parametrize("a", [0.3, 0.9, 1.4])
def test_straight_flanks_have_the_energy_between_two_arcs(a):
    """Inside a wedge there are no kinks: twice the energy by integration over the area in polar coordinates."""
    inner, outer = 1.0, 1.7
    bend, pull = stresses(a)
    bending = dblquad(lambda q, r: (bend(q)[0] ** 2 + 2 * bend(q)[1] ** 2) / r**3, inner, outer, -a, a)[0]
    stretch = dblquad(lambda q, r: pull(q) ** 2 / r, inner, outer, -a, a)[0]
    F, N, _, _ = wedge_functions(a)
    h0, h1 = 2 * inner * np.sin(a), 2 * outer * np.sin(a)
    dx = (outer - inner) * np.cos(a)
    beam = [float(s.sum()) for s in beam_flexibility(dx / 50, np.linspace(h0, h1, 51))]
    assert_allclose(F / 12 / np.cos(a) * beam[0], bending, rtol=1e-3)
    assert_allclose(N / np.cos(a) * beam[1], stretch, rtol=1e-3)


def test_fans_are_what_lies_between_arcs_of_a_turning_flank():
    """The distance of neighbouring arcs, for a circular contour, found from the arcs themselves."""
    R, t, d = 3.0, 0.5, 1e-6

    def arc(phi):
        h = t + 2 * R * (1 - np.cos(phi))
        r = h / 2 / np.sin(phi)
        return R * np.sin(phi) - r * np.cos(phi), r, h  # apex, radius, height

    for phi in (0.4, 1.1, 1.5):
        (apex0, r0, _), (apex1, r1, _), (_, _, h) = arc(phi - d), arc(phi + d), arc(phi)
        theta = np.array([0.0, 0.5, 0.9]) * phi
        distance = ((r1 - r0) + np.cos(theta) * (apex1 - apex0)) / (2 * d)
        assert_allclose(distance, R + h * (np.cos(theta) - np.cos(phi)) / (2 * np.sin(phi) ** 2), rtol=1e-6)


@pytest.mark.parametrize("a", [0.05, 0.7, np.pi / 2])
def test_series_are_the_functions(a):
    """A kink back and forth between flat flanks has the integrals of the fan functions."""
    h = np.array([1.0, 1.0, 1.0 + 2e-4 * np.tan(min(a, 1.5)), 1.0 + 2e-4 * np.tan(min(a, 1.5))])
    angle = np.arctan2(h[2] - h[1], 2e-4)
    rotation, stretch = notch_flexibility(1e-4, h)
    G, P = (quad(lambda q, k=k: float(wedge_functions(q)[k]), 1e-3, angle)[0] for k in (2, 3))
    beam = beam_flexibility(1e-4, h)
    F, N, _, _ = wedge_functions(angle)
    along = np.cos(angle)
    expected = (F / 12 / along - 1) * beam[0][1] + G * (1 - 1 / h[2] ** 2)
    assert_allclose((rotation - beam[0]).sum(), expected, rtol=0.03)
    assert_allclose((stretch - beam[1]).sum(), (N / along - 1) * beam[1][1], rtol=0.03)
    assert P > 0


def test_gentle_notches_follow_beam_theory():
    x = np.linspace(-1, 1, 201)
    for depth, limit in ((0.01, 2e-3), (0.001, 2e-5)):
        h = notch.parabolic(x, 1.0, depth, 0.1)
        for own, beam in zip(notch_flexibility(0.01, h), beam_flexibility(0.01, h), strict=True):
            assert 0 < own.sum() / beam.sum() - 1 < limit
    flat = np.full(11, 0.3)
    for own, beam in zip(notch_flexibility(0.1, flat), beam_flexibility(0.1, flat), strict=True):
        assert_allclose(own, beam, rtol=1e-10)  # the series in use are good to 1e-11


@pytest.mark.parametrize("kind", ["circular", "table"])
def test_no_slice_has_less_than_beam_theory(kind):
    x = np.linspace(-1, 1, 161)
    bumps = 0.3 + 0.1 * np.abs(np.sin(7 * x)) + 0.3 * (np.abs(x) > 0.5)
    h = notch.circular(x, 1.0, 0.1) if kind == "circular" else bumps
    for own, beam in zip(notch_flexibility(2 / 160, h), beam_flexibility(2 / 160, h), strict=True):
        assert (own >= beam * (1 - 1e-12)).all()


def test_notches_are_the_same_from_both_ends_and_at_every_size():
    x = np.linspace(0, 1, 81)
    h = 0.2 + x**2 + 0.3 * np.sin(3 * x)
    r, s = notch_flexibility(1 / 80, h)
    back = notch_flexibility(1 / 80, h[::-1])
    assert_allclose(r, back[0][::-1], rtol=1e-12)
    assert_allclose(s, back[1][::-1], rtol=1e-12)
    large = notch_flexibility(np.array([5 / 80, 1 / 80]), np.stack([5 * h, h]))
    assert_allclose(large[0], np.stack([r / 25, r]), rtol=1e-12)
    assert_allclose(large[1], np.stack([s, s]), rtol=1e-12)


def test_slices_converge():
    sums = []
    for n in (160, 320, 640):
        x = np.linspace(-4, 4, n + 1)
        sums.append([part.sum() for part in notch_flexibility(8 / n, notch.circular(x, 4.0, 0.3))])
    assert_allclose(sums[0], sums[2], rtol=1e-3)
    assert np.abs(np.subtract(sums[1], sums[2])).max() < 0.3 * np.abs(np.subtract(sums[0], sums[2])).max()
