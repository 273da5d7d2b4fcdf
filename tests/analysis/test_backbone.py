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
    largest = {"m.tz": amplitude * THICKNESS}
    return fx.backbone(beam(ends, elements), amplitude=largest, order="full", harmonics=4)


def woinowsky_krieger(amplitude: np.ndarray) -> np.ndarray:
    """Frequency over that of small motions, of hinged beams, by amplitudes over the thickness (Woinowsky-Krieger 1950,
    J. Appl. Mech. 17): q'' + w^2 (q + q^3 / 4 r^2) = 0, r^2 = t^2 / 12."""
    square = 3 * amplitude**2
    return np.pi * np.sqrt(1 + square) / (2 * ellipk(square / (2 + 2 * square)))


def test_a_hinged_beam_is_that_of_woinowsky_krieger():
    """Exact for von Karman's beam, whose shape stays a sine: what is left is for want of elements."""
    off = []
    for elements in (1, 3):
        found = backbone("hinged", elements, 0.4)
        expected = woinowsky_krieger(found.amplitude / THICKNESS)
        off.append(np.abs(found.frequency_hz / found.linear_hz - expected).max())
        assert found.kind == "hardening"
        assert found.stable.all()
        assert not found.warnings
    assert off[1] < 5e-5
    assert off[0] > 10 * off[1]


def von_karman(count: int, amplitude: float) -> float:
    """Frequency over that of small motions of a clamped beam in so many symmetric modes, by shooting (SciPy)."""
    roots = CLAMPED[:count]
    s = (np.cosh(roots) - np.cos(roots)) / (np.sinh(roots) - np.sin(roots))

    def shape(x):
        return np.cosh(roots * x) - np.cos(roots * x) - s * (np.sinh(roots * x) - np.sin(roots * x))

    def slope(x):
        return roots * (np.sinh(roots * x) + np.sin(roots * x) - s * (np.cosh(roots * x) - np.cos(roots * x)))

    every = range(count)
    G = np.array([[quad(lambda x, i=i, j=j: slope(x)[i] * slope(x)[j], 0, 1)[0] for j in every] for i in every])
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
    moving = 0.25 * 7850.0 * WIDTH * THICKNESS * LENGTH  # a sine half wave: half the mass of the beam
    speed = 2 * np.pi * found.linear_hz * found.amplitude[0]
    assert found.energy[0] == pytest.approx(moving * speed**2, rel=0.01)


DAMPED = "damping: {rayleigh: {frequencies: [10 Hz, 100 Hz], ratios: [0.05, 0.05]}}"
FORCE = 4e-3


@pytest.fixture(scope="module")
def driven() -> fx.NonlinearResponse:
    model = beam("hinged", 1, DAMPED)
    return fx.nonlinear_response(
        model, inputs={"m.tz": FORCE}, outputs=["m.tz", "m.tz:velocity"], band=(13, 22), order="full", harmonics=3
    )


def test_a_hinged_beam_bends_over_between_two_folds(driven):
    """The upper one at the top of the resonance, where velocity is in phase with the force, on the backbone."""
    lower, upper = sorted(driven.folds, key=lambda fold: fold.largest["m.tz"])
    assert lower.frequency_hz < upper.frequency_hz
    between = ~driven.stable
    assert between.any()
    assert driven.frequency_hz[between].min() > lower.frequency_hz - 1e-6
    assert driven.frequency_hz[between].max() < upper.frequency_hz + 1e-6
    assert upper.largest["m.tz"] == pytest.approx(driven.largest[:, 0].max(), rel=1e-2)
    k = int(np.abs(driven.frequency_hz - upper.frequency_hz).argmin())
    amplitude = driven.largest[k, 0]
    free = fx.backbone(beam("hinged", 1), amplitude={"m.tz": amplitude}, order="full", harmonics=4)
    assert upper.frequency_hz == pytest.approx(free.frequency_hz[-1], rel=5e-3)
    assert driven.of("m.tz:velocity")[:, 1] == pytest.approx(
        2j * np.pi * driven.frequency_hz * driven.of("m.tz")[:, 1], rel=1e-9
    )


def test_steady_motion_is_that_of_an_integration_over_time(driven):
    """On the upper branch, reached from rest: the integration is of second order, its period off by less than 1e-3."""
    k = int(np.abs(driven.frequency_hz - 15.5).argmin())
    hz = driven.frequency_hz[k]
    dt = 1 / (hz * 60)
    signal = {"m.tz": lambda t: FORCE * np.cos(2 * np.pi * hz * t)}
    long = fx.time_response(
        beam("hinged", 1, DAMPED),
        inputs=signal,
        outputs=["m.tz"],
        dt=dt,
        duration=16 / hz,
        motion="large",
        order="full",
        rho_infinity=0.8,
    )
    last = long.response[0, -60:]
    assert np.abs(last).max() == pytest.approx(driven.largest[k, 0], rel=0.02)


@over(
    ("given", "words"),
    (
        ({"amplitude": {}}, "one output"),
        ({"amplitude": {"m.tz": 0.0}}, "positive number"),
        ({"amplitude": {"m.tz": np.nan}}, "positive number"),
        ({"amplitude": {"m.tz": 1e-3}, "mode": 0}, "mode is the number"),
        ({"amplitude": {"m.tz": 1e-3}, "mode": 2}, "does not move m.tz"),
        ({"amplitude": {"m.tz:velocity": 1e-3}}, "reads a velocity"),
        ({"amplitude": {"m.tz": 1e-3}, "harmonics": 0}, "harmonics are between"),
        ({"amplitude": {"m.tz": 1e-3}, "order": "exact"}, "order is low or full"),
        ({"amplitude": {"x.tz": 1e-3}}, "x"),
    ),
)
def test_impossible_backbones_are_refused(given, words):
    with pytest.raises(fx.OptionError, match=words):
        fx.backbone(beam("hinged", 1), **{"order": "full", **given})


@over(
    ("given", "words"),
    (
        ({"damping": None}, "without damping"),
        ({"inputs": {}}, "a name and an amplitude"),
        ({"inputs": {"m.tz": 0.0}}, "other than zero"),
        ({"band": (20, 10)}, "0 < from < to"),
        ({"outputs": ["nowhere.tz"]}, "nowhere"),
    ),
)
def test_impossible_responses_are_refused(given, words):
    good = {"inputs": {"m.tz": 1e-3}, "outputs": ["m.tz"], "band": (10, 20), "damping": 0.02, "order": "full"}
    with pytest.raises(fx.OptionError, match=words):
        fx.nonlinear_response(beam("hinged", 1), **{**good, **given})


def test_too_few_harmonics_are_said():
    found = fx.backbone(beam("hinged", 1), amplitude={"m.tz": 2 * THICKNESS}, order="full", harmonics=1)
    assert [warning.kind for warning in found.warnings] == ["convergence"]
    assert found.harmonic_error > 1e-3


def test_an_arch_of_loads_softens():
    """A beam that hangs under a dead load is stiffer one way than the other: the mean moves, and even harmonics are."""
    loaded = beam("clamped", 1, "loads: {m: {force: [0, 0, 0.05 N]}}")
    found = fx.backbone(loaded, amplitude={"m.tz": 0.3 * THICKNESS}, order="full", harmonics=4)
    assert np.abs(found.harmonics[-1, 2]) > 1e-2 * np.abs(found.harmonics[-1, 1])
    assert np.abs(found.harmonics[-1, 0]) > 1e-2 * np.abs(found.harmonics[-1, 1])


def heavy_beam(grams: float) -> fx.Mechanism:
    """A clamped beam with a mass beside its middle, by which its second frequency is some three times the first."""
    profile = f"{{type: leaf, width: {WIDTH} m, thickness: {THICKNESS} m}}"
    member = f"material: spring-steel, elements: 2, reference: z, profile: {profile}"
    return fx.loads(
        f"""
flexura: 1
name: beam with a mass
theory: euler_bernoulli
corrections: none
nodes: {{a: [0, 0, 0], m: [{0.45 * LENGTH} m, 0, 0], b: [{LENGTH} m, 0, 0]}}
flexures:
  left: {{nodes: [a, m], {member}}}
  right: {{nodes: [m, b], {member}}}
masses: {{load: {{node: m, mass: {grams} g}}}}
ground: {{a: clamped, b: clamped}}
"""
    )


def test_a_mode_at_three_times_the_frequency_is_named_where_it_joins():
    """At rest the second mode is at 3.32 times the first one, which stiffens quicker: they meet."""
    model = heavy_beam(2.5)
    first, second = fx.modes(model, n=2).frequency_hz
    found = fx.backbone(model, amplitude={"m.tz": 0.86e-3}, order="full", harmonics=4)
    (told,) = [warning for warning in found.warnings if warning.kind == "resonance"]
    assert "mode 2" in told.text
    assert "harmonic 3" in told.text
    at = found.frequency_hz[int((found.other_modes > 0.1).argmax())]
    assert first * 1.05 < at < second / 3 * 1.1
    assert found.other_modes[-1] > 0.1 > found.other_modes[2]


def test_a_mode_whose_resonance_steps_go_past_is_noted():
    """Where the third harmonic crosses the second mode after 0.9 % of stiffening, the curves of both pass so close that
    no step sees it but by the determinant."""
    found = fx.backbone(heavy_beam(1.1), amplitude={"m.tz": 0.4e-3}, order="full", harmonics=4)
    assert not found.warnings
    (note,) = [note for note in found.notes if "harmonic 3 is that of mode 2" in note]
    assert "near 30." in note
