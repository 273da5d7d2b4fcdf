"""`flexura estimate-frf`: from files of hits to a file of responses."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from helpers.hits import hit, receptance


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_records_become_responses(tmp_path):
    hits = tuple(hit(6.0, name=f"hit {k}", setup="left", scale=1 + k) for k in range(3))
    silent = replace(hits[0], samples=hits[0].samples * [[1], [1], [0]], name="the loose one")
    data = fx.write_measurement(fx.Measurement("stage", (*hits, silent)), tmp_path / "hits.uff")
    target = tmp_path / "frf.uff"
    done = run("estimate-frf", data, "--out", target, "--exponential", "1e-6", "--band", "5,60 Hz")
    assert done.exit_code == 0, done.output
    assert "left out 1 of 4 records: the loose one: p2.tz: all samples are 0" in " ".join(done.output.split())
    (frf,) = fx.read_measurement(target).frfs
    assert (frf.setup, frf.averages, frf.estimator) == ("left", 3, "H1")
    exact = receptance(2j * np.pi * frf.frequency_hz + frf.decay)
    assert np.max(np.abs(frf.response[:, :, 0] - exact)) < 1e-6 * np.abs(exact).max()
    shown = json.loads(run("estimate-frf", data, "--exponential", "1e-6", "--duration", "3s", "--json").stdout)
    assert shown["responses"][0]["averages"] == 3
    assert shown["responses"][0]["decay"] == np.log(1e6) / 3


def test_a_refusal_names_the_record(tmp_path):
    data = fx.write_measurement(fx.Measurement("stage", (hit(2.0, name="short"),)), tmp_path / "hits.npz")
    done = run("estimate-frf", data)
    assert done.exit_code != 0
    assert "short: p1.tz: still at 2" in str(done.exception)
    assert run("estimate-frf", data, "--accept", "leakage").exit_code == 0
