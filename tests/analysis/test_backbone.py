"""Backbones and nonlinear responses of beams between immovable ends, against one-mode and several-mode theory (von
Karman), an integration over time, and what is said of bad input."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import fsolve
from scipy.special import ellipk

import flexura as fx
from helpers.over import over

LENGTH, WIDTH, THICKNESS = 0.4, 4e-3, 1e-3
ENDS = {"hinged": "{free: [ry]}", "clamped": "clamped"}
CLAMPED = np.array([4.730040744862704, 10.995607838001671, 17.27875965739948])
"""Roots of the symmetric modes of a clamped beam."""


def beam(ends: str, elements: int, more: str = "") -> fx.Mechanism:
    """A slender beam between immovable ends with a node in its middle; z is the soft direction."""
    member = (
        f"material: spring-steel, reference: z, elements: {elements},"
        f" profile: {{type: leaf, width: {WIDTH} m, thickness: {THICKNESS} m}}"
    )
    return fx.loads(
        f"""
flexura: 1
name: {ends} beam
theory: euler_bernoulli
corrections: none
nodes: {{a: [0, 0, 0], m: [{LENGTH / 2} m, 0, 0], b: [{LENGTH} m, 0, 0]}}
flexures:
  left: {{nodes: [a, m], {member}}}
  right: {{nodes: [m, b], {member}}}
ground: {{a: {ENDS[ends]}, b: {ENDS[ends]}}}
{more}"""
    )


@cache
def backbone(ends: str, elements: int, amplitude: float) -> fx.Backbone:
    up_to = {"m.tz": amplitude * THICKNESS}
    return fx.backbone(beam(ends, elements), up_to=up_to, order="full", harmonics=3)


def woinowsky_krieger(amplitude: np.ndarray) -> np.ndarray:
    """Frequency over that of small motions, of hinged beams, by amplitudes over the thickness (Woinowsky-Krieger 1950,
    J. Appl. Mech. 17): q'' + w^2 (q + q^3 / 4 r^2) = 0, r^2 = t^2 / 12."""
    square = 3 * amplitude**2
    return np.pi * np.sqrt(1 + square) / (2 * ellipk(square / (2 + 2 * square)))


def test_a_hinged_beam_is_that_of_woinowsky_krieger():
    """Exact for von Karman's beam, whose shape stays a sine: what is left goes with the fourth power of elements."""
    off = []
    for elements in (2, 3):
        found = backbone("hinged", elements, 0.4)
        expected = woinowsky_krieger(found.amplitude / THICKNESS)
        off.append(np.abs(found.frequency_hz / found.linear_hz - expected).max())
        assert found.kind == "hardening"
        assert found.stable.all()
        assert not found.warnings
    assert off[1] < 1e-4
    assert off[0] / off[1] == pytest.approx((3 / 2) ** 4, rel=0.25)


def von_karman(count: int, amplitude: float) -> float:
    """Frequency over that of small motions of a clamped beam in so many symmetric modes, by shooting (SciPy)."""
    roots = CLAMPED[:count]
    s = (np.cosh(roots) - np.cos(roots)) / (np.sinh(roots) - np.sin(roots))

    def shape(x):
        return np.cosh(roots * x) - np.cos(roots * x) - s * (np.sinh(roots * x) - np.sin(roots * x))

    def slope(x):
        return roots * (np.sinh(roots * x) + np.sin(roots * x) - s * (np.cosh(roots * x) - np.cos(roots * x)))

    G = np.array([[quad(lambda x, i=i, j=j: slope(x)[i] * slope(x)[j], 0, 1)[0] for j in range(count)] for i in range(count)])
    middle = shape(0.5)

    def rate(_, y):
        q, v = y[:count], y[count:]
        return np.concatenate([v, -(roots**4) * q - 6 * (q @ G @ q) * (G @ q)])  # q over t, E A t^2 / 2 E I = 6

    def after(unknown):
        """Velocities a quarter of a period after rest; and the amplitude that is missing."""
        q, period = unknown[:count], unknown[-1]
        end = solve_ivp(rate, (0, period / 4), [*q, *np.zeros(count)], method="DOP853", rtol=1e-10, atol=1e-13)
        return [*end.y[:count, -1], middle @ q - amplitude]

    guess = [amplitude / middle[0], *np.zeros(count - 1), 2 * np.pi / roots[0] ** 2 / (1 + 0.2 * amplitude**2)]
    return float(2 * np.pi / fsolve(after, guess, xtol=1e-11)[-1] / roots[0] ** 2)


def test_a_clamped_beam_is_that_of_its_von_karman_modes():
    """One mode is 2e-4 off here, three are not."""
    found = backbone("clamped", 3, 0.5)
    ratio, amplitude = found.frequency_hz[-1] / found.linear_hz, found.amplitude[-1] / THICKNESS
    assert ratio == pytest.approx(von_karman(3, amplitude), abs=1e-4)
    assert abs(von_karman(1, amplitude) - von_karman(3, amplitude)) > 1e-4


def test_where_the_frequency_has_changed_by_a_percent():
    found = backbone("hinged", 3, 0.4)
    assert found.shifted_at is not None
    assert woinowsky_krieger(np.array(found.shifted_at / THICKNESS)) == pytest.approx(1.01, abs=2e-4)
    assert found.energy[0] == pytest.approx(
        _modal_energy(found.amplitude[0], found.linear_hz), rel=0.01
    )


def _modal_energy(amplitude: float, hz: float) -> float:
    """Of a sine half wave: half the mass of the beam moves."""
    return 0.25 * 7850.0 * WIDTH * THICKNESS * LENGTH * (2 * np.pi * hz * amplitude) ** 2
