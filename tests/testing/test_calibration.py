"""Calibration against closed forms: exact recovery, coverage of intervals, what data cannot tell, modes that cross."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.testing.measurement.channels import MeasuredChannel
from flexura.testing.measurement.measurement import IdentifiedModes, MeasuredFRF, Measurement
from flexura.testing.updating.targets import targets_of
from helpers import samples

KX, KY, MASS = 4e3, 9e3, 0.4


def hz(k, m=MASS):
    """Frequency of a mass on a spring, Hz."""
    return np.sqrt(k / m) / (2 * np.pi)


def channels(*names, quantity="displacement"):
    """Channels of the stage along axes named tx, ty."""
    axes = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0)}
    return tuple(MeasuredChannel(f"stage.{n}", quantity, "stage", axes[n[1]]) for n in names)


def test_known_sizes_are_recovered_exactly_without_noise():
    """Frequencies of another design are met, of which the second and third mode have changed places."""
    truth = {"thickness": 1.3e-3, "tip_mass": 0.045}
    data = fx.modes(samples.beam(**truth), n=4, order="full").frequency_hz
    found = fx.calibrate(samples.beam(), data=data, free=list(truth), method="least_squares", pairing="in_order")
    assert found.values == pytest.approx(truth, rel=1e-6)
    assert found.converged
    assert found.chi_square < 1e-8 < found.start_chi_square
    again = fx.modes(found.mechanism, n=4, order="full").frequency_hz
    assert again == pytest.approx(data, rel=1e-6)
    low = fx.calibrate(
        samples.beam(),
        data=data,
        free=list(truth),
        method="least_squares",
        order="low",
        keep=8,
        pairing="in_order",
    )
    assert low.values == pytest.approx(truth, rel=1e-3)


def test_posterior_of_one_stiffness_in_closed_form():
    """ln f = (ln k - ln m)/2 is linear: the posterior of ln k is normal, with precision 1/s^2 + 1/(2 sigma)^2."""
    data, sigma, s = hz(5e3), 0.01, 0.05
    found = fx.calibrate(samples.body(), data=[data], free=["kx"], sigma=sigma, priors={"kx": s})
    precision = 1 / s**2 + 1 / (2 * sigma) ** 2
    mean = (np.log(KX) / s**2 + np.log(5e3) / (2 * sigma) ** 2) / precision
    (p,) = found.parameters
    assert p.value == pytest.approx(np.exp(mean), rel=1e-7)
    assert p.interval == pytest.approx(np.exp(mean + np.array([-1, 1]) * 1.959964 / np.sqrt(precision)), rel=1e-6)
    assert p.prior == pytest.approx(KX * np.exp(np.array([-1, 1]) * 1.959964 * s), rel=1e-6)
    assert p.variance_reduction == pytest.approx(1 - 1 / (s**2 * precision), rel=1e-6)
    drawn = found.sample(2000, seed=1)
    assert drawn.is_settled
    assert drawn.effective > 200
    error = 2.67 / np.sqrt(precision * drawn.effective)  # of a 2.5 % quantile: sqrt(0.025 0.975)/density
    assert drawn.interval[0] == pytest.approx(p.interval, rel=3 * error)


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    """200 mechanisms drawn from the prior and measured with noise: 95 % intervals hold 95 % of the true values, within
    what 400 draws can tell (a binomial deviation is 1.1 %)."""
    rng, sigma, spread = np.random.default_rng(5), 0.01, 0.08
    held = []
    plan = fx.Plan(samples.body())
    priors = dict.fromkeys(["kx", "mass"], spread)
    for _ in range(200):
        kx, mass = KX * np.exp(spread * rng.standard_normal()), MASS * np.exp(spread * rng.standard_normal())
        data = np.array([hz(kx, mass), hz(KY, mass)]) * np.exp(sigma * rng.standard_normal(2))
        found = fx.calibrate(plan, data=data, free=["kx", "mass"], sigma=sigma, priors=priors)
        for p, true in zip(found.parameters, (kx, mass), strict=True):
            held.append(p.interval[0] <= true <= p.interval[1])
    assert 0.92 <= np.mean(held) <= 0.98


def test_what_the_data_cannot_tell_is_named():
    """One frequency tells k/m and nothing of k m: with equal priors the directions are (1, -1) and (1, 1)/sqrt(2)."""
    found = fx.calibrate(samples.body(), data=[hz(KX)], free=["kx", "mass"], priors={"kx": 0.2, "mass": 0.2})
    best, worst = found.directions
    s = np.sqrt(2) * 0.2 / (2 * 0.01)
    assert best.variance_reduction == pytest.approx(s**2 / (1 + s**2), rel=1e-6)
    assert best.weights["kx"] == pytest.approx(-best.weights["mass"], rel=1e-6)
    assert worst.variance_reduction == pytest.approx(0, abs=1e-9)
    assert worst.weights["kx"] == pytest.approx(worst.weights["mass"], rel=1e-6)
    assert found.unresolved == (worst,)
    assert str(worst) == "0.71 kx + 0.71 mass"
    assert found.correlation[0, 1] > 0.98
    assert any("left to the prior" in note for note in found.notes)
    with pytest.raises(fx.OptionError, match="1 data cannot determine 2 parameters"):
        fx.calibrate(samples.body(), data=[hz(KX)], free=["kx", "mass"], method="least_squares")


def test_least_squares_says_infinite_where_data_say_nothing():
    found = fx.calibrate(samples.body(), data=[hz(5e3), hz(KY)], free=["kx", "ky"], method="least_squares")
    assert found.values == pytest.approx({"kx": 5e3, "ky": KY}, rel=1e-7)
    assert found.parameters[0].interval == pytest.approx(5e3 * np.exp(np.array([-1, 1]) * 1.959964 * 0.02), rel=1e-5)
    both = fx.calibrate(samples.body(), data=[hz(KX), hz(KY)], free=["kx", "mass"], method="least_squares")
    assert both.values == pytest.approx({"kx": KX, "mass": MASS}, rel=1e-7)
    data = fx.modes(samples.beam(), n=2, order="full").frequency_hz
    blind = fx.calibrate(samples.beam(), data=data, free=["thickness", "modulus"], method="least_squares")
    assert blind.parameters[0].interval != blind.parameters[0].prior


def shaped(kx, ky, names=("tx", "ty"), scale=(3.0, -0.2)):
    """Identified modes of the body: shapes along x and y, of any scale, a little mixed by noise."""
    shapes = np.array([[1.0, 0.02], [-0.02, 1.0]])[: len(names)] * scale
    found, order = np.array([hz(kx), hz(ky)]), np.argsort([kx, ky])
    poles = 2j * np.pi * found[order]
    shapes = shapes[:, order]
    sensors = channels(*names)
    return IdentifiedModes("test", poles, shapes + 0j, shapes, shapes.T + 0j, (), sensors, (), (), 0.0)


def test_modes_are_paired_by_shape_where_the_order_is_another():
    """The start has its x mode below; the measurement has it above."""
    data = shaped(1.2e4, 6e3)
    found = fx.calibrate(samples.body(), data=data, free=["kx", "ky"], method="least_squares")
    assert found.values == pytest.approx({"kx": 1.2e4, "ky": 6e3}, rel=1e-6)
    assert [m.model_mode for m in found.modes] == [1, 2]
    assert [m.start_hz for m in found.modes] == pytest.approx([hz(KY), hz(KX)], rel=1e-9)
    assert [m.mac for m in found.modes] == pytest.approx([1 / 1.0004] * 2, rel=1e-6)


def test_modes_are_followed_while_they_cross():
    """Without shapes measured mode 1 is the start's lowest, along x, wherever that goes; held at 20 Hz it crosses y."""
    found = fx.calibrate(samples.body(), data=[hz(1.6e4)], free=["kx"], method="least_squares")
    assert found.values["kx"] == pytest.approx(1.6e4, rel=1e-7)
    assert found.modes[0].model_mode == 2


def test_a_shape_alone_tells_the_direction_of_springs():
    """Residual of shapes: the stiffness coupling that turns the modes by 10 degrees is found from shapes alone."""
    zero = ["0 N/m"] * 2
    rows = [["k + c", "d", zero[0]], ["d", "k - c", zero[0]], [zero[0], zero[0], "5000 N/m"]]
    turn = [["0 N"] * 3 + [f"{5000 if i == j else 0} N*m/rad" for j in range(3)] for i in range(3)]
    matrix = "[" + ", ".join("[" + ", ".join(r) + "]" for r in [*[r + ["0 N/rad"] * 3 for r in rows], *turn]) + "]"
    mechanism = fx.loads(
        "flexura: 1\nparameters: {k: 100 N/m, c: 20 N/m, d: {value: 1 N/m, minimum: -50 N/m, maximum: 50 N/m}}\n"
        "bodies: {stage: {centre: [0, 0, 0], mass: 1 kg, inertia: [1 kg*m^2, 1 kg*m^2, 1 kg*m^2]}}\n"
        f"springs: {{plane: {{nodes: [stage], matrix: {matrix}}}}}\n"
    )
    angle, c = np.radians(10.0), 20.0
    d = c * np.tan(2 * angle)
    shapes = np.array([[-np.sin(angle), np.cos(angle)], [np.cos(angle), np.sin(angle)]])
    w = np.sqrt(100 + np.array([-1, 1]) * np.hypot(c, d))
    data = IdentifiedModes("t", 1j * w, shapes + 0j, shapes, shapes.T + 0j, (), channels("tx", "ty"), (), (), 0.0)
    found = fx.calibrate(mechanism, data=data, free=["d"], method="least_squares", sigma=1e3)
    assert found.values["d"] == pytest.approx(d, rel=1e-6)


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_sizes_from_frequency_responses(quantity):
    """Accelerances or receptances of the oscillator, 1/(k - m w^2 + 2 i zeta w sqrt(k m)), give stiffness and mass."""
    k, m, zeta, f = 4.4e3, 0.43, 0.02, np.linspace(4, 30, 300)
    w = 2 * np.pi * f
    H = 1 / (k - m * w**2 + 2j * zeta * w * np.sqrt(k * m)) * ((1j * w) ** 2 if quantity == "acceleration" else 1)
    coherence = np.full((300, 1, 1), 0.999)
    coherence[:20], H[5] = 0.1, 0.0
    hammer = MeasuredChannel("hammer", "force", "stage", (1.0, 0.0, 0.0))
    noise = 1e-5 * abs(H) * np.exp(1j * f)  # along y, where the model does not move at all
    both, sensors = np.stack([H, noise], axis=1)[:, :, None], channels("tx", "ty", quantity=quantity)
    frf = MeasuredFRF(f, both, (hammer,), sensors, np.repeat(coherence, 2, axis=1), 5)
    found = fx.calibrate(
        samples.body(),
        data=Measurement("t", (), (frf,)),
        free=["kx", "mass"],
        method="least_squares",
        damping=zeta,
    )
    assert found.values == pytest.approx({"kx": k, "mass": m}, rel=1e-5)


def test_a_bound_holds_and_is_said():
    found = fx.calibrate(samples.body(), data=[hz(64e3)], free=["kx"], method="least_squares")
    (p,) = found.parameters
    assert p.value == pytest.approx(32e3, rel=1e-6)
    assert p.at_bound
    assert any("at a bound" in n and "kx" in n for n in found.notes)
    assert fx.Plan(found.mechanism).parameter_values()["kx"] <= 32e3


def test_priors_follow_what_is_known_of_a_parameter():
    mechanism = samples.body()
    parameters = dict(mechanism.parameters)
    parameters["mass"] = parameters["mass"].model_copy(update={"source": "paper, Table 1"})
    parameters["ky"] = parameters["ky"].model_copy(update={"minimum": None, "maximum": None})
    found = fx.calibrate(
        mechanism.model_copy(update={"parameters": parameters}), data=[hz(KX), hz(KY)], free=["kx", "ky", "mass"]
    )
    reasons = {p.name: p.reason for p in found.parameters}
    assert reasons == {"kx": "bounds", "ky": "no bounds", "mass": "known (paper)"}
    assert found.parameters[2].prior == pytest.approx(MASS * np.exp(np.array([-1, 1]) * 1.959964 * 0.02), rel=1e-6)
    wide = found.parameters[0].prior
    assert np.log(wide[1] / wide[0]) == pytest.approx(1.959964 * np.log(64) / 2, rel=1e-6)


def test_the_calibrated_file_reads_back(tmp_path):
    (tmp_path / "body.yaml").write_text(samples.BODY, encoding="utf-8")
    (tmp_path / "out").mkdir()
    data = [hz(5e3), hz(KY)]
    found = fx.calibrate(fx.load(tmp_path / "body.yaml"), data=data, free=["kx"])
    path = fx.testing.save_calibrated(found, tmp_path / "out" / "new.yaml", base=tmp_path / "body.yaml")
    again = fx.load(path)
    assert again.parameters["kx"].value == pytest.approx(found.values["kx"], rel=1e-5)
    assert again.parameters["kx"].source == "calibrated to 2 measured frequencies"
    assert again.parameters["kx"].maximum == 32e3
    assert "95 %" in path.read_text(encoding="utf-8")


def test_lists_of_frequencies(tmp_path):
    csv = tmp_path / "f.csv"
    csv.write_text("frequency,unit,sigma\n46.861,rad/s,0.5\n8.5,Hz,2 %\n0.012,kHz,\n", encoding="utf-8")
    found = fx.testing.read_frequencies(csv)
    assert found.frequency_hz == pytest.approx([46.861 / (2 * np.pi), 8.5, 12.0])
    assert found.sigma[:2] == pytest.approx([0.5 / 46.861, 0.02])
    assert np.isnan(found.sigma[2])
    text = tmp_path / "f.yaml"
    text.write_text("frequencies: [{frequency: 46.861 rad/s, sigma: 1 %}, 8.5 Hz]\n", encoding="utf-8")
    assert fx.testing.read_frequencies(text).frequency_hz == pytest.approx([46.861 / (2 * np.pi), 8.5])
    for wrong, words in (
        ("[46.8]", "carries a unit"),
        ("[46 deg]", "carries a unit"),
        ("[-3 Hz]", "positive"),
        ("[nan Hz]", "is not a number"),
        ("[{f: 3 Hz}]", "keys are frequency"),
        ("{a: 1}", "a list of frequencies"),
        ("[3 Hz", "not valid YAML"),
        ("[]", "holds no frequencies"),
    ):
        text.write_text(wrong, encoding="utf-8")
        with pytest.raises(fx.OptionError, match=words):
            fx.testing.read_frequencies(text)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("f.csv", "frequency,unit\n,\n{0},Hz\n-,Hz\n"),
        ("f.csv", "frequency,unit,sigma\n-,,\n{0},Hz,1 %\n"),
        ("f.csv", "frequency,unit\n-\n{0},Hz\n"),
        ("f.yaml", "frequencies: [null, {0} Hz]"),
        ("f.yaml", "- '-'\n- {{frequency: {0} Hz}}\n- {{frequency: -}}"),
        ("f.yaml", "- {{frequency: null}}\n- {0} Hz"),
    ],
)
def test_modes_that_were_not_measured_keep_the_numbers_of_others(tmp_path, name, text):
    """The first mode, along x, was not measured: what there is tells the spring along y."""
    path = tmp_path / name
    path.write_text(text.format(hz(1.1e4)), encoding="utf-8")
    data = fx.testing.read_frequencies(path)
    assert data.by_number == pytest.approx({2: hz(1.1e4)})
    for how in ("tracked", "in_order"):
        for own in (data, [None, hz(1.1e4)]):
            found = fx.calibrate(samples.body(), data=own, free=["ky"], method="least_squares", pairing=how)
            assert found.values["ky"] == pytest.approx(1.1e4, rel=1e-6)
            assert [(m.number, m.model_mode) for m in found.modes] == [(2, 2)]


def test_gaps_that_cannot_be_counted_are_refused(tmp_path):
    path = tmp_path / "f.csv"
    for text, words in (
        ("frequency,unit\n3,Hz\n\n5,Hz\n", "line 3 is empty: write - for a mode"),
        ("frequency,unit\n-,\n5,Hz\n3,Hz\n", "listed ascending"),
        ("frequency,unit\n-,Hz\n,\n", "holds no frequencies"),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(fx.OptionError, match=words):
            fx.testing.read_frequencies(path)
    with pytest.raises(fx.OptionError, match="at least one frequency"):
        fx.calibrate(samples.body(), data=[None], free=["ky"])


def test_configurations_are_calibrated_together():
    """A known mass added tells stiffness and mass, which neither list tells: f1 = sqrt(k/m), f2 = sqrt(k/(m + m1))."""
    k, m, added = 5e3, 0.5, 0.1
    loaded = fx.loads(
        samples.BODY.replace("mass: mass,", "mass: mass + added,")
        .replace("body on springs", "body with a weight")
        .replace("parameters:", "parameters:\n  added: {value: 90 g, maximum: 1 kg, minimum: 1 g}")
    )
    data = ([hz(k, m)], [hz(k, m + added)])
    how = {"method": "least_squares"}
    found = fx.calibrate(
        samples.body(),
        data=data[0],
        free=["kx", "mass"],
        parameters={"added": added},
        also=[(loaded, data[1])],
        **how,
    )
    assert found.values == pytest.approx({"kx": k, "mass": m}, rel=1e-6)
    assert [(x.number, x.configuration) for x in found.modes] == [(1, "body on springs"), (1, "body with a weight")]
    assert found.also[0].parameters["mass"].value == pytest.approx(m, rel=1e-6)
    assert found.also[0].parameters["added"].value == added
    assert not any("below the one before" in note for note in found.notes)
    # a parameter of the second alone is one more unknown
    both = fx.calibrate(
        samples.body(mass=m),
        data=[*data[0], hz(KY, m)],
        free=["kx", "added", "ky"],
        also=[(with_mass(loaded, m), data[1])],
        **how,
    )
    assert both.values == pytest.approx({"kx": k, "ky": KY, "added": added}, rel=1e-6)
    for wrong, free, words in (
        (loaded, ["kx", "none"], "'none' is not a parameter"),
        (with_mass(loaded, 0.7), ["kx", "mass"], "give what is moved together one start"),
        (samples.beam(), ["kx"], "has none of the free parameters"),
    ):
        with pytest.raises(fx.OptionError, match=words):
            fx.calibrate(samples.body(), data=data[0], free=free, also=[(wrong, data[1])])
    with pytest.raises(fx.OptionError, match="nowhere"):
        fx.calibrate(samples.body(), data=data[0], free=["kx"], parameters={"nowhere": 1.0}, also=[(loaded, data[1])])


def with_mass(mechanism, mass):
    """A mechanism with another mass."""
    return samples.with_values(mechanism, {"mass": mass})


def test_configurations_are_calibrated_together_as_by_their_product():
    """Two models of one stiffness with equal data are one model with the square root of sigma: precisions add."""
    two = fx.calibrate(
        samples.body(),
        data=[hz(5e3)],
        free=["kx"],
        also=[(samples.body(), [hz(5e3)])],
        priors={"kx": 0.05},
    )
    one = fx.calibrate(samples.body(), data=[hz(5e3)], free=["kx"], priors={"kx": 0.05}, sigma=0.01 / np.sqrt(2))
    assert two.values == pytest.approx(one.values, rel=1e-7)
    assert two.parameters[0].interval == pytest.approx(one.parameters[0].interval, rel=1e-6)
    assert [m.configuration for m in two.modes] == ["body on springs", "body on springs (2)"]


def test_command_with_another_configuration(tmp_path):
    (tmp_path / "body.yaml").write_text(samples.BODY, encoding="utf-8")
    (tmp_path / "loaded.yaml").write_text(samples.BODY.replace("mass: mass,", "mass: mass + 100 g,"), encoding="utf-8")
    for name, f in (("a.csv", hz(5e3, 0.5)), ("b.csv", hz(5e3, 0.6))):
        (tmp_path / name).write_text(f"frequency,unit\n{f},Hz\n", encoding="utf-8")
    names = [str(tmp_path / n) for n in ("body.yaml", "a.csv")]
    also = ["--also", f"{tmp_path / 'loaded.yaml'}={tmp_path / 'b.csv'}", "--free", "kx,mass"]
    also += ["--method", "least_squares", "--set", "ky=8 N/mm"]
    run = CliRunner().invoke(app, ["calibrate", *names, *also, "--out", str(tmp_path / "new.yaml")])
    assert run.exit_code == 0, run.output
    assert "body on springs (2)" in run.output
    for path in ("new.yaml", "new-loaded.yaml"):
        again = fx.load(tmp_path / path).parameters
        assert (again["kx"].value, again["mass"].value) == pytest.approx((5e3, 0.5), rel=1e-5)
        assert again["ky"].value == pytest.approx(8e3)
    run = CliRunner().invoke(app, ["calibrate", *names, "--free", "kx", "--also", "loaded.yaml"])
    assert run.exit_code
    assert "FILE=DATA" in run.output + str(run.exception)


def test_what_can_be_wrong_is_named():
    body = samples.body()
    with pytest.raises(fx.OptionError, match="not str"):
        fx.calibrate(body, data="data.uff", free=["kx"])
    with pytest.raises(fx.OptionError, match="positive and finite, not nan"):
        fx.calibrate(body, data=[np.nan], free=["kx"])
    with pytest.raises(fx.OptionError, match="not free"):
        fx.calibrate(body, data=[10.0], free=["kx"], priors={"mass": 0.1})
    with pytest.raises(fx.OptionError, match="draws need a prior"):
        fx.calibrate(body, data=[10.0], free=["kx"], method="least_squares").sample()
    lost = MeasuredChannel("s", "displacement", "nowhere", (1.0, 0.0, 0.0))
    data = IdentifiedModes(
        "t", np.array([60j]), np.ones((2, 1)) + 0j, np.ones((2, 1)), np.ones((1, 2)) + 0j, (), (lost, lost), (), (), 0.0
    )
    with pytest.raises(fx.OptionError, match="s: "):
        fx.calibrate(body, data=data, free=["kx"])


def test_command(tmp_path):
    (tmp_path / "body.yaml").write_text(samples.BODY, encoding="utf-8")
    (tmp_path / "f.csv").write_text(f"frequency,unit\n{hz(5e3)},Hz\n{hz(KY)},Hz\n", encoding="utf-8")
    names = [str(tmp_path / n) for n in ("body.yaml", "f.csv")]
    out, pictures = tmp_path / "new.yaml", tmp_path / "pictures"
    more = ["--free", "kx,mass", "--out", str(out), "--plot", str(pictures), "--draws", "200"]
    run = CliRunner().invoke(app, ["calibrate", *names, *more])
    assert run.exit_code == 0, run.output
    for words in ("kx", "variance reduction", "measured [Hz]", "draws, worth", "wrote"):
        assert words in run.output
    assert fx.load(out).parameters["kx"].value == pytest.approx(5e3, rel=0.02)
    assert (pictures / "calibration.png").stat().st_size > 5000
    run = CliRunner().invoke(app, ["calibrate", *names, "--free", "kx", "--method", "least_squares", "--json"])
    data = json.loads(run.output)
    assert data["parameters"][0]["value"] == pytest.approx(5e3, rel=1e-6)


def test_standard_deviations_of_responses_weigh_as_the_coherence_that_says_the_same():
    hz, n = np.linspace(1.0, 50.0, 60), 8
    H = 1 / (900 - hz**2 + 2j * hz)[:, None, None]
    gamma = np.random.default_rng(0).uniform(0.9, 0.999, H.shape)
    channels = ((fx.testing.MeasuredChannel("hammer", "force"),), (fx.testing.MeasuredChannel("p", "displacement"),))
    by_coherence = fx.testing.MeasuredFRF(hz, H, *channels, gamma, n)
    by_sigma = fx.testing.MeasuredFRF(hz, H, *channels, sigma=np.abs(H) * np.sqrt((1 - gamma) / (n * gamma)))
    (first,), (second,) = (targets_of(frf, 0.01, 0.05, 0.02, 0.01) for frf in (by_coherence, by_sigma))
    np.testing.assert_allclose(second.sigma, first.sigma, rtol=1e-12)
    assert (first.sigma > 0.02).all()
