"""Responses that are measured both ways, and those that are filled: hits on a system known in closed form."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.testing import estimate_frf, fill_reciprocal, reciprocity
from helpers.hits import OUTPUTS, hit, receptance

BAND = (5, 60)


def hits(drive, n=1, **options):
    return [hit(8.0, drive, seed=10 * drive + k, name=f"hit {k}", **options) for k in range(n)]


def alone(record, output):
    """A record of the hammer and one output."""
    kept = [0, 1 + output]
    return replace(record, samples=record.samples[kept], channels=tuple(record.channels[k] for k in kept))


def exact(frf):
    s = 2j * np.pi * frf.frequency_hz + frf.decay
    return np.stack([receptance(s, drive) for drive in (0, 1)], axis=2)


def relative(H, reference):
    return np.linalg.norm(H - reference) / np.linalg.norm(reference)


def test_what_is_measured_both_ways_agrees():
    (frf,) = estimate_frf([*hits(0), *hits(1)], band=BAND)
    (pair,) = reciprocity(frf).pairs
    assert (pair.first, pair.second) == ("p1.tz / hammer2", "p2.tz / hammer")
    assert pair.deviation < 1e-6 and pair.scatter is None and pair.gain == pytest.approx(1, abs=1e-6)
    assert not pair.is_far and reciprocity([frf]).notes == ()


def test_deviation_of_noise_is_the_scatter_by_coherence():
    options = {"n": 12, "noise": (0.0, 2e-7)}
    (frf,) = estimate_frf([*hits(0, **options), *hits(1, **options)], band=(8, 40))
    (pair,) = reciprocity(frf).pairs
    assert pair.deviation > 0.001
    assert pair.deviation == pytest.approx(pair.scatter, rel=0.3)
    assert not pair.is_far


def test_sensitivities_and_signs_are_named():
    (frf,) = estimate_frf([*hits(0), *hits(1)], band=BAND)
    louder = replace(frf, response=frf.response * np.array([1.0, 1.2])[:, None])
    found = reciprocity(louder)
    assert found.pairs[0].gain == pytest.approx(1 / 1.2, rel=1e-6)
    assert found.pairs[0].deviation == pytest.approx(0.2 / 1.1, rel=1e-4)
    assert "one is 1.2 times the other: look at sensitivities" in found.notes[0]
    turned = replace(frf, response=frf.response * np.array([1.0, -1.0])[:, None])
    assert "their signs are opposite: look at the directions" in reciprocity(turned).notes[0]
    down = replace(OUTPUTS[1], direction=(0.0, 0.0, -1.0))
    assert reciprocity(replace(turned, outputs=(OUTPUTS[0], down))).pairs[0].deviation < 1e-6


def test_responses_are_filled():
    records = [*hits(0), alone(hits(1)[0], 1)]
    with pytest.raises(fx.OptionError, match=r"has no channel p1\.tz, which other records have"):
        estimate_frf(records, band=BAND)
    (frf,) = estimate_frf(records, band=BAND, exponential=1e-6, reciprocal=True)
    assert relative(frf.response, exact(frf)) < 1e-6
    assert frf.notes[-1] == "by reciprocity: p1.tz / hammer2 from p2.tz / hammer"
    assert fx.identify(frf).frequency_hz == pytest.approx([12, 31], rel=1e-4)


def test_accelerations_against_displacements_and_a_sensor_upside_down():
    (first,), (second,) = (estimate_frf(hits(k), band=BAND, exponential=1e-6) for k in (0, 1))
    s = 2j * np.pi * first.frequency_hz + first.decay
    up, down = OUTPUTS[0], replace(OUTPUTS[1], quantity="acceleration", direction=(0.0, 0.0, -1.0))
    H = first.response * np.stack([np.ones_like(s), -(s**2)], axis=1)[:, :, None]
    first = replace(first, response=H, outputs=(up, down))
    second = replace(second, response=-second.response[:, 1:] * s[:, None, None] ** 2, outputs=(down,))
    (full,) = fill_reciprocal([first, second])
    assert relative(full.response[:, 0, 1], receptance(s, 1)[:, 0]) < 1e-6


def test_what_cannot_be_filled():
    (first,), (second,) = (estimate_frf(alone(hits(k)[0], k), band=BAND) for k in (0, 1))
    with pytest.raises(fx.OptionError, match=r"p1\.tz / hammer2 is not measured, and no reciprocal of it either"):
        fill_reciprocal([first, second])
    with pytest.raises(fx.OptionError, match="no response is measured both ways"):
        reciprocity([first, second])
    with pytest.raises(fx.OptionError, match=r"p1\.tz / hammer is given 2 times"):
        fill_reciprocal([first, first])
    with pytest.raises(fx.OptionError, match="there are no frequency responses"):
        fill_reciprocal(())


def test_from_the_shell(tmp_path):
    data = fx.write_measurement(fx.Measurement("t", (*hits(0), alone(hits(1)[0], 1))), tmp_path / "hits.npz")
    out = tmp_path / "frf.npz"
    done = CliRunner().invoke(app, ["estimate-frf", str(data), "--reciprocal", "--band", "5,60 Hz", "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "by reciprocity: p1.tz / hammer2 from p2.tz / hammer" in " ".join(done.output.split())
    assert fx.read_measurement(out).frfs[0].response.shape[1:] == (2, 2)


def both_ways(tmp_path):
    frfs = estimate_frf([*hits(0), *hits(1)], band=BAND)
    return fx.write_measurement(fx.Measurement("t", (), frfs), tmp_path / "frf.npz"), frfs[0]


def parts_of(whole):
    """The first column, and what the second one has that is not in it."""
    column = replace(whole, response=whole.response[:, :, :1], inputs=whole.inputs[:1], coherence=None)
    ends = {"inputs": whole.inputs[1:], "outputs": whole.outputs[1:]}
    return column, replace(whole, response=whole.response[:, 1:, 1:], coherence=None, **ends)


def test_what_is_filled_is_identified_from_files_and_from_the_shell(tmp_path):
    path, whole = both_ways(tmp_path)
    column, corner = parts_of(whole)
    part = fx.write_measurement(fx.Measurement("t", (), (column, corner)), tmp_path / "part.npz")
    with pytest.raises(fx.OptionError, match="is missing"):
        fx.identify(fx.read_measurement(part))
    modes = fx.identify(fx.read_measurement(part), reciprocal=True)
    known = fx.identify(fx.read_measurement(path))
    np.testing.assert_allclose(modes.frequency_hz, known.frequency_hz, rtol=1e-4)
    assert any(note.startswith("by reciprocity: p1.tz / hammer2 from") for note in modes.notes)
    done = CliRunner().invoke(app, ["identify", str(part), "--reciprocal", "--plot", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "by reciprocity: p1.tz / hammer2 from p2.tz / hammer" in " ".join(done.output.split())
    assert len(list(tmp_path.glob("*.png"))) >= 2


@pytest.mark.parametrize("verb", ["estimate-frf", "identify"])
def test_the_shell_shows_the_pairs(verb, tmp_path):
    path = fx.write_measurement(fx.Measurement("t", (*hits(0), *hits(1))), tmp_path / "hits.npz")
    done = CliRunner().invoke(app, [verb, str(path), "--band", "5,60 Hz", "--reciprocity", "--json"])
    assert done.exit_code == 0, done.output
    (pair,) = json.loads(done.output)["reciprocity"]["pairs"]
    assert {pair["first"], pair["second"]} == {"p2.tz / hammer", "p1.tz / hammer2"} and pair["deviation"] < 0.01
    both = CliRunner().invoke(app, [verb, str(path), "--reciprocity", "--reciprocal"])
    assert "take one of them" in str(both.exception)


def test_outputs_alone_have_no_reciprocals():
    record = hits(0)[0]
    outputs = replace(record, samples=record.samples[1:], channels=record.channels[1:], inputs=())
    with pytest.raises(fx.OptionError, match="outputs alone have no reciprocals"):
        fx.identify(fx.Measurement("t", (outputs,)), reciprocal=True)


def test_scatter_that_is_known_is_what_noise_makes_of_a_pair():
    (whole,) = estimate_frf([*hits(0), *hits(1)], band=BAND)
    column, corner = parts_of(whole)
    (exact_one,) = fill_reciprocal([column, corner])
    sigma = np.broadcast_to(0.01 * np.abs(exact_one.response).mean(axis=0), exact_one.response.shape)
    noise = np.random.default_rng(0).standard_normal((2, *sigma.shape)) / np.sqrt(2)
    noisy = exact_one.response + sigma * (noise[0] + 1j * noise[1])
    (pair,) = reciprocity(replace(exact_one, response=noisy, sigma=sigma)).pairs
    assert pair.deviation == pytest.approx(pair.scatter, rel=0.15)
    (filled,) = fill_reciprocal([replace(f, sigma=0.01 * np.abs(f.response)) for f in (column, corner)])
    np.testing.assert_allclose(filled.sigma, 0.01 * np.abs(filled.response), rtol=1e-9)
