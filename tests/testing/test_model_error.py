"""Calibration of a model that cannot be right: a beam that is clamped in the model and on a soft base in truth."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from helpers import samples

SOFT = samples.BEAM.replace(
    "ground: {root: clamped}",
    "springs: {base: {nodes: [root], stiffness: {tx: 1 kN/um, ty: 1 kN/um, tz: 1 kN/um, rx: KR, ry: KR, rz: KR}}}",
)
SIZES = {"thickness": (1e-3, 0.08), "tip_mass": (20e-3, 0.15)}


def measured(base, noise, seed, free, n=6):
    """Sizes drawn about those of the file, and frequencies, Hz, with noise; `base` is in N m/rad, None for rigid."""
    rng = np.random.default_rng(seed)
    truth = {name: SIZES[name][0] * np.exp(SIZES[name][1] * rng.standard_normal()) for name in free}
    own = samples.BEAM if base is None else SOFT.replace("KR", f"{base} N*m/rad")
    hz = fx.modes(samples.with_values(fx.loads(own), truth), n=n, order="full").frequency_hz
    return truth, hz * np.exp(noise * rng.standard_normal(n))


def coverage(base, noise, seeds, free):
    """How many intervals hold the truth, of how many, how many results warn, and how many say anything."""
    plan, held, warned, said = fx.Plan(samples.beam()), [], 0, 0
    for seed in seeds:
        truth, hz = measured(base, noise, seed, free)
        found = fx.calibrate(plan, data=hz, free=free, sigma=noise, pairing="in_order")
        held += [p.interval[0] <= truth[p.name] <= p.interval[1] for p in found.parameters]
        warned += bool(found.warnings)
        said += bool(found.warnings) or any("widened" in note for note in found.notes)
    return sum(held), len(held), warned, said


@pytest.mark.parametrize("noise", [1e-4, 1e-3, 1e-2])
def test_an_error_of_the_model_is_said_and_in_the_intervals(noise):
    """The base takes 2 % off the frequencies: at noise of 0.01 % that is 200 standard deviations, at 1 % two."""
    held, count, _, said = coverage(500, noise, range(3), ["thickness"])
    assert (held, said) == (count, 3)


def test_a_model_without_error_is_left_alone():
    """Six frequencies and one size: the noise of each is what sigma says, and no warning is due."""
    truth, hz = measured(None, 1e-3, 1, ["thickness"])
    found = fx.calibrate(samples.beam(), data=hz, free=["thickness"], sigma=1e-3, pairing="in_order")
    (own,) = found.misfits
    assert (own.kind, own.data, round(own.spare, 6)) == ("frequencies", 6, 5)
    assert own.probability > 0.01
    assert not found.warnings
    assert found.parameters[0].value == pytest.approx(truth["thickness"], rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize("free", [["thickness"], ["thickness", "tip_mass"]])
@pytest.mark.parametrize("noise", [1e-4, 1e-3, 1e-2])
def test_coverage_with_and_without_an_error_of_the_model(noise, free):
    """95 % intervals hold at least nine in ten of the true sizes, whatever the noise: 40 mechanisms each."""
    for base in (None, 2000, 500):
        held, count, warned, _ = coverage(base, noise, range(40), free)
        assert held >= 0.9 * count
        assert warned <= 3 or base is not None
        assert warned == 40 or base is None or noise > 1e-3


def test_the_size_of_the_widening_in_closed_form():
    """ln f = (ln k - ln m)/2 twice, measured 4 sigma apart: s^2 = 8 with one datum to spare, t = 12.706."""
    sigma = 0.01
    f = np.sqrt(4e3 / 0.4) / (2 * np.pi) * np.exp(np.array([-2, 2]) * sigma)
    also = [(samples.body(), [f[1]])]
    found = fx.calibrate(samples.body(), data=[f[0]], free=["kx"], also=also, sigma=sigma, method="least_squares")
    noise = 2 * sigma / np.sqrt(2)
    added = 12.7062 / 1.959964 * np.sqrt(7 * 2) * noise
    half = np.log(found.parameters[0].interval[1] / 4e3)
    assert half == pytest.approx(1.959964 * np.hypot(noise, added), rel=1e-4)
    (own,) = found.misfits
    assert (own.ratio**2, own.spare) == pytest.approx((8, 1))
    assert found.values["kx"] == pytest.approx(4e3, rel=1e-6)


def test_data_and_prior_that_disagree_are_no_error_of_the_model():
    f = np.sqrt(8e3 / 0.4) / (2 * np.pi)
    also = [(samples.body(), [f])]
    found = fx.calibrate(samples.body(), data=[f], free=["kx"], also=also, priors={"kx": 0.05})
    assert found.misfits[0].chi_square < 1e-9
    assert not found.warnings


def test_nothing_to_spare_is_said():
    found = fx.calibrate(samples.body(), data=[15.0, 25.0], free=["kx", "ky"])
    assert any("take up all 2 frequencies" in note for note in found.notes)
    assert found.to_dict()["misfits"][0]["ratio"] is None


def test_the_command_warns_and_strict_refuses(tmp_path):
    (tmp_path / "beam.yaml").write_text(samples.BEAM, encoding="utf-8")
    _, hz = measured(500, 1e-3, 0, ["thickness"])
    (tmp_path / "f.csv").write_text("frequency\n" + "".join(f"{f} Hz\n" for f in hz), encoding="utf-8")
    names = ["calibrate", str(tmp_path / "beam.yaml"), str(tmp_path / "f.csv"), "--free", "thickness"]
    how = ["--sigma", "0.001", "--pairing", "in_order"]
    run = CliRunner().invoke(app, [*names, *how])
    assert run.exit_code == 0, run.output
    assert "warning: the model misses the data" in run.output
    assert "of 6 to spare" in run.output
    data = json.loads(CliRunner().invoke(app, [*names, *how, "--json"]).output)
    assert data["warnings"]
    assert data["misfits"][0]["ratio"] > 5
    run = CliRunner().invoke(app, [*names, *how, "--strict"])
    assert run.exit_code == 1
