"""Dynamic error budgets: closed forms of one and two masses (Crandall and Mark 1963), Lyapunov's equation by SciPy,
quadrature, simulation, and that shares are the whole."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import solve_continuous_lyapunov

import flexura as fx
from flexura.systems import pole_form, spectrum_of, spectrum_panels
from helpers.disturbed import one_mass, two_masses

M, K, C = 2.0, 800.0, 4.0


def rms(mechanism: fx.Mechanism, *outputs: str, **options) -> np.ndarray:
    return fx.budget(mechanism, outputs=list(outputs) or None, **options).rms


def test_one_mass_under_a_white_force():
    """sigma_x^2 = S/(4 k c), sigma_v^2 = S/(4 m c) of a one-sided density S (Crandall and Mark 1963)."""
    found = rms(one_mass("{air: {input: block.tx, density: 3 N/sqrt(Hz)}}"), "x", "v")
    assert found == pytest.approx([3 / np.sqrt(4 * K * C), 3 / np.sqrt(4 * M * C)], rel=1e-12)


def test_one_mass_on_a_white_floor():
    """Relative displacement: S m^2/(4 k c)."""
    found = rms(one_mass("{floor: {base: [3, 0, 4], density: 1 m/s^2/sqrt(Hz)}}"), "x")
    assert found == pytest.approx([0.6 * M / np.sqrt(4 * K * C)], rel=1e-12)


def quartic(B: list[float], A: list[float]) -> float:
    """Integral of |H|^2 over all angular frequencies, H = sum B_k (i w)^k / sum A_k (i w)^k of order four (James,
    Nichols and Phillips 1947; Newland 1993, appendix 1)."""
    b0, b1, b2, b3 = B
    a0, a1, a2, a3, a4 = A
    above = a0 * b3**2 * (a0 * a3 - a1 * a2) + a0 * a1 * a4 * (2 * b1 * b3 - b2**2)
    above += -a0 * a3 * a4 * (b1**2 - 2 * b0 * b2) + a4 * b0**2 * (a1 * a4 - a2 * a3)
    return np.pi * above / (a0 * a4 * (a0 * a3**2 + a1**2 * a4 - a1 * a2 * a3))


def test_two_masses_under_a_white_force():
    m1, m2, k1, k2, c1, c2 = 2.0, 0.5, 800.0, 300.0, 4.0, 0.7
    mass, damping = np.diag([m1, m2]), np.array([[c1 + c2, -c2], [-c2, c2]])
    stiffness = np.array([[k1 + k2, -k2], [-k2, k2]])
    A = np.polynomial.polynomial.polymul([k1 + k2, c1 + c2, m1], [k2, c2, m2])
    A = np.polynomial.polynomial.polysub(A, np.polynomial.polynomial.polymul([k2, c2], [k2, c2]))
    found = fx.budget(two_masses("{amplifier: {input: coil, density: 3 N/sqrt(Hz)}}"), order="full")
    closed = 9 * quartic([k2, c2, 0, 0], list(A)) / (4 * np.pi)
    assert found.rms[0] ** 2 == pytest.approx(closed, rel=1e-11)
    inverse = np.linalg.inv(mass)
    whole = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ stiffness, -inverse @ damping]])
    b = np.concatenate([np.zeros(2), inverse @ [1.0, 0.0]])[:, None]
    P = solve_continuous_lyapunov(whole, -9 / 2 * b @ b.T)
    assert found.rms**2 == pytest.approx([P[1, 1], P[3, 3]], rel=1e-11)


SOURCES = {
    "white in a band": "{input: coil, density: 3 N/sqrt(Hz), band: [2 Hz, 5 Hz]}",
    "white from zero": "{input: coil, density: 3 N/sqrt(Hz), band: [0, 3 Hz]}",
    "corner": "{input: coil, density: 3 N/sqrt(Hz), corner: 4 Hz, band: [0.1 Hz, 50 Hz]}",
    "table": "{input: coil, table: [[0 Hz, 1 N^2/Hz], [3 Hz, 4 N^2/Hz], [3.1 Hz, 0 N^2/Hz], [9 Hz, 1 N^2/Hz]]}",
    "table in a band": "{input: coil, table: [[1 Hz, 1 N/sqrt(Hz)], [9 Hz, 4 N/sqrt(Hz)]], band: [2 Hz, 4 Hz]}",
    "floor": "{base: x, spectrum: VC-A}",
    "floor without a knee": "{base: x, spectrum: VC-D}",
    "velocity": "{base: x, density: 1 mm/s/sqrt(Hz), band: [0, 10 Hz]}",
    "displacement": "{base: x, table: [[0.5 Hz, 1 um/sqrt(Hz)], [10 Hz, 2 um/sqrt(Hz)]]}",
}


@pytest.mark.parametrize("source", SOURCES)
def test_every_density_is_integrated(source):
    """Against adaptive quadrature of the frequency response of the same model."""
    mechanism = two_masses(f"{{source: {SOURCES[source]}}}")
    [disturbance] = mechanism.disturbances.values()
    spectrum, into = spectrum_of(disturbance), "ground.tx" if disturbance.base else "coil"
    modes = fx.system(mechanism, inputs=[into], order="full").modal()
    found = fx.budget(mechanism, order="full")
    near = sorted(modes.frequency_hz)
    for k in range(2):
        parts = [
            quad(
                lambda f, k=k: abs(modes.response(f)[0, k, 0]) ** 2 * spectrum.at(np.array([f]))[0],
                *ends,
                points=[f for f in near if ends[0] < f < ends[1]] or None,
                epsabs=0,
                epsrel=1e-11,
                limit=400,
            )[0]
            for ends in zip(spectrum.start, spectrum.stop, strict=True)
        ]
        assert found.mean_square[0, k] == pytest.approx(sum(parts), rel=1e-8)


def test_criteria_for_floors_have_the_published_velocity_in_every_band():
    """RMS velocity in third octaves from 8 to 80 Hz; of VC-A 260 micro-g from 4 to 8 Hz, to its two digits."""
    for name, velocity in {"VC-A": 50e-6, "VC-C": 12.5e-6, "ISO office": 400e-6, "VC-E": 3.12e-6}.items():
        spectrum = spectrum_of(fx.describe.Disturbance(base="x", spectrum=name))
        for centre in (10.0, 25.0, 63.0):
            low, high = centre * 2 ** (-1 / 6), centre * 2 ** (1 / 6)
            own = quad(lambda f, s=spectrum: s.at(np.array([f]))[0] / (2 * np.pi * f) ** 2, low, high)[0]
            assert np.sqrt(own) == pytest.approx(velocity, rel=1e-9)
    spectrum = spectrum_of(fx.describe.Disturbance(base="x", spectrum="VC-A"))
    own = quad(lambda f: spectrum.at(np.array([f]))[0], 5 * 2 ** (-1 / 6), 5 * 2 ** (1 / 6))[0]
    assert np.sqrt(own) / 9.80665 == pytest.approx(260e-6, rel=0.02)


ALL = """{floor: {base: x, spectrum: VC-A}, amplifier: {input: coil, density: 3 mN/sqrt(Hz)},
  air: {input: top.tx, table: [[1 Hz, 1 mN/sqrt(Hz)], [9 Hz, 4 mN/sqrt(Hz)]]},
  gauge: {sensor: x, density: 1 um/sqrt(Hz), band: [0, 100 Hz]}}"""


def test_shares_are_the_whole():
    found = fx.budget(two_masses(ALL), order="full")
    assert found.shares.sum(axis=0) == pytest.approx([1, 1], abs=1e-12)
    assert found.part_shares.sum(axis=0) == pytest.approx([1, 1], abs=1e-12)
    assert found.by_part.sum(axis=1) == pytest.approx(found.mean_square, rel=1e-12)
    assert np.sqrt((found.rms_by_source**2).sum(axis=0)) == pytest.approx(found.rms, rel=1e-12)
    assert found.three_sigma == pytest.approx(3 * found.rms)
    alone = [fx.budget(two_masses(ALL), order="full", sources=[name]).rms for name in found.sources]
    assert np.stack(alone) == pytest.approx(found.rms_by_source, rel=1e-12)
    assert found.of("x") == found.rms[0]


def test_cumulative_amplitude_grows_to_the_whole_whatever_the_frequencies():
    mechanism = two_masses(ALL)
    few, many = (fx.budget(mechanism, frequency_hz=hz) for hz in ([2.0, 3.2, 100.0], np.geomspace(0.1, 100, 700)))
    assert few.rms == pytest.approx(many.rms, rel=1e-12)
    assert (np.diff(many.cumulative, axis=0) >= -1e-15).all()
    bounded = fx.budget(mechanism, sources=["floor", "air", "gauge"], frequency_hz=[4.0, 80.0, 100.0])
    assert bounded.cumulative[-1] == pytest.approx(bounded.rms, rel=1e-12)
    hz = many.frequency_hz
    ends = many.amplitude_density**2
    middle = fx.budget(mechanism, frequency_hz=(hz[1:] + hz[:-1]) / 2).amplitude_density ** 2
    simpson = (ends[1:] + 4 * middle + ends[:-1]) / 6 * np.diff(hz)[:, None]
    inside = (hz[:-1] > 4.1) & (hz[1:] < 8) | (hz[:-1] > 9.1) & (hz[1:] < 80)
    assert np.diff(many.cumulative**2, axis=0)[inside] == pytest.approx(simpson[inside], rel=1e-3)


def test_noise_of_a_sensor_is_read_and_shakes_nothing():
    found = fx.budget(two_masses(ALL), sources=["gauge"])
    assert found.rms == pytest.approx([1e-6 * np.sqrt(100), 0])
    assert found.part_shares[found.parts.index("direct"), 0] == 1


def test_a_density_without_an_end_that_reaches_an_output_directly_has_no_mean_square():
    found = fx.budget(one_mass("{air: {input: block.tx, density: 3 N/sqrt(Hz)}}"))
    assert np.isinf(found.rms[2]) and np.isfinite(found.rms[:2]).all()
    [warning] = found.warnings
    assert "a: the density of air does not end" in warning.text
    assert found.to_dict()["points"][2]["rms"] is None


def test_nothing_that_is_not_damped_has_a_mean_square():
    with pytest.raises(fx.SolverError, match=r"nothing damps what moves at 3\.18"):
        fx.budget(one_mass("{air: {input: block.tx, density: 3 N/sqrt(Hz)}}").replaced({"dashpots": {}}))


def test_noises_of_a_pattern_are_independent():
    text = "{one: {input: co*, density: 3 N/sqrt(Hz)}}"
    mechanism = two_masses(text)
    second = mechanism.actuators["coil"].model_copy(update={"nodes": ("top",)})
    both = mechanism.model_copy(update={"actuators": {**mechanism.actuators, "coil2": second}})
    squares = [
        fx.budget(mechanism.model_copy(update={"actuators": {"coil": own}})).rms[0] for own in both.actuators.values()
    ]
    assert fx.budget(both).rms[0] ** 2 == pytest.approx(sum(x**2 for x in squares), rel=1e-10)


def test_poles_that_all_but_coincide_are_integrated_by_panels():
    """Critical damping: sigma^2 = S/(4 k c) too."""
    critical = 2 * np.sqrt(K * M)
    mechanism = one_mass("{air: {input: block.tx, density: 3 N/sqrt(Hz)}}")
    damper = mechanism.dashpots["damper"].model_copy(update={"damping": {"tx": critical}})
    found = rms(mechanism.model_copy(update={"dashpots": {"damper": damper}}), "x")
    assert found == pytest.approx([3 / np.sqrt(4 * K * critical)], rel=1e-7)


def test_panels_agree_with_closed_forms():
    mechanism = two_masses(ALL)
    for name, disturbance in mechanism.disturbances.items():
        if disturbance.sensor is None:
            found, spectrum = fx.budget(mechanism, sources=[name], order="full"), spectrum_of(disturbance)
            into = {"floor": "ground.tx", "amplifier": "coil", "air": "top.tx"}[name]
            form = pole_form(fx.system(mechanism, inputs=[into], order="full").modal())
            f, weight = spectrum_panels(form.z, spectrum)
            own = weight @ np.abs(form.response(f)[:, :, 0]) ** 2
            assert own == pytest.approx(found.mean_square[0], rel=1e-11)


def test_a_simulation_has_the_same_mean_square():
    """Noise held over steps of 2 ms, whose density is flat up to far beyond the modes: within five standard errors of
    40 stretches."""
    mechanism, dt, n = two_masses("{amplifier: {input: coil, density: 3 N/sqrt(Hz)}}"), 2e-3, 400_000
    noise = np.random.default_rng(7).standard_normal(n) * 3 / np.sqrt(2 * dt)
    moved = fx.time_response(mechanism, inputs={"coil": noise}, dt=dt, hold="zoh", order="full").response[0]
    stretches = (moved[n // 41 :] ** 2)[: 40 * (n // 41)].reshape(40, -1).mean(axis=1)
    error = stretches.std(ddof=1) / np.sqrt(40)
    assert abs(stretches.mean() - fx.budget(mechanism).mean_square[0, 0]) < 5 * error
    assert error < 0.1 * stretches.mean()


def test_what_disturbs_may_be_given():
    mechanism = two_masses("{amplifier: {input: coil, density: 3 N/sqrt(Hz)}}")
    air = fx.describe.Disturbance(input="top.tx", density={"value": 2.0, "unit": "N"})
    found = fx.budget(mechanism, disturbances={"air": air})
    assert found.sources == ("air",)
    plain = fx.budget(mechanism.model_copy(update={"disturbances": {"air": air}}))
    assert found.rms == pytest.approx(plain.rms)


def test_models_that_are_finished_answer_the_same():
    mechanism = two_masses(ALL)
    built = fx.system(mechanism, inputs=["ground.tx", "coil", "top.tx"], order="full")
    for model in (built, built.modal(), fx.assemble(mechanism), fx.reduce(mechanism, keep=2), fx.Plan(mechanism)):
        assert fx.budget(model).rms == pytest.approx(fx.budget(mechanism).rms, rel=1e-9)


def test_what_is_refused():
    mechanism = two_masses(ALL)
    with pytest.raises(fx.OptionError, match="there is no disturbance 'flor'; known: floor"):
        fx.budget(mechanism, sources=["flor"])
    with pytest.raises(fx.OptionError, match="nothing disturbs it"):
        fx.budget(mechanism.replaced({"disturbances": {}}))
    with pytest.raises(fx.OptionError, match="order is low or full"):
        fx.budget(mechanism, order="exact")
    with pytest.raises(fx.OptionError, match="there is no output 'y'"):
        fx.budget(mechanism).of("y")


@pytest.mark.parametrize(
    "damping",
    ["0.01", "{loss_factor: 0.03}", "{rayleigh: {frequencies: [2 Hz, 9 Hz], ratios: [0.01, 0.03]}}", "{ratio: 0}"],
)
def test_root_mean_squares_have_exact_slopes(damping):
    """Against differences of fourth order, and of the whole of the system: nothing is left out of two masses."""
    mechanism = two_masses(ALL)
    mechanism = fx.loads(fx.dumps(mechanism) + f"damping: {damping}\n")
    asked = fx.questions(mechanism, "rms(x), rms(v), rms(x, floor), rms(x, gauge), rms(top.tx, air)")
    exact = asked.slopes({}, ["k2"])
    assert exact.is_exact.all() and exact.quantities[0].unit == "m" and exact.quantities[1].unit == "m/s"
    h = 0.5
    values = [
        [fx.budget(mechanism, {"k2": 300 + k * h}, order="full", outputs=[o], sources=s).rms[0] for o, s in PAIRS]
        for k in (-2, -1, 1, 2)
    ]
    a, b, c, d = np.array(values)
    assert exact.slope[:, 0] == pytest.approx((a - 8 * b + 8 * c - d) / (12 * h), rel=1e-6, abs=1e-15)


PAIRS = [("x", None), ("v", None), ("x", ["floor"]), ("x", ["gauge"]), ("top.tx", ["air"])]
