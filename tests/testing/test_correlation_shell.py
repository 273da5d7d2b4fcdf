"""From a file of measured data to a table and pictures, and sensors from the shell."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
import helpers.correlated as c
from flexura.cli import main
from flexura.errors import OptionError
from flexura.testing.correlation.correlation import correlate
from flexura.testing.measurement.measurement import MeasuredFRF, Measurement
from flexura.view.mechanisms.comparisons import (
    draw_correlation,
    draw_frf_overlay,
    draw_sensors,
    draw_shape_pair,
    save_correlation,
)

STIFFER = 1.02
"""Frequencies of the test over those of the model."""


@pytest.fixture(scope="module")
def bar():
    return c.cantilever(section=fx.describe.Rectangle(width=3e-3, thickness=2.2e-3))


@pytest.fixture(scope="module")
def measured(bar):
    """Accelerances of the first four modes at the grid, hit along y and z at the end, two percent higher than the
    model's, with one sensor mounted the wrong way round."""
    full, hz, vectors = c.modes_of(bar, 4)
    outputs = c.grid()
    inputs = tuple(c.channel(f"hit {k}", d, (0.1, 0, 0), quantity="force") for k, d in (("y", c.Y), ("z", c.Z)))
    x, b = (fx.testing.pair_channels(full, channels).rows @ vectors for channels in (outputs, inputs))
    x[4] *= -1
    line = np.linspace(20.0, 1.2 * STIFFER * hz[3], 1200)
    w, own = 2 * np.pi * line[:, None], 2 * np.pi * STIFFER * hz
    H = -(w[..., None] ** 2) * np.einsum("pr,mr,fr->fpm", x, b, 1 / (own**2 - w**2 + 0.02j * own * w))
    return Measurement("bar", frfs=(MeasuredFRF(line, H, inputs, outputs),))


@pytest.fixture(scope="module")
def result(bar, measured):
    return correlate(bar, test=measured)


def test_a_measurement_is_identified_and_paired(result):
    assert [(p.test, p.model) for p in result.pairs] == [(k, k) for k in range(1, 5)]
    assert [p.error for p in result.pairs] == pytest.approx([1 / STIFFER - 1] * 4, abs=1e-4)
    assert sum("wrong way round" in note for note in result.notes) == 1
    assert result.frfs[0].frac.shape == (10, 2)


def test_pictures_show_what_the_result_says(result):
    figure = draw_correlation(result)
    panels = figure.axes
    framed = [p for p in panels[0].patches if not p.get_fill()]
    assert sorted(p.get_xy() for p in framed) == [(k - 0.5, k - 0.5) for k in range(4)]
    numbers = [t.get_text() for t in panels[0].texts]
    assert numbers[0] == f"{result.mac[0, 0]:.2f}"
    bars = [bar.get_width() for bar in panels[3].patches]
    assert bars == pytest.approx(result.comac.tolist())
    overlay = draw_frf_overlay(result)
    assert len([a for a in overlay.axes if a.lines]) == 20
    assert f"FRAC {result.frfs[0].frac[0, 0]:.2f}" in overlay.axes[0].get_title()
    with pytest.raises(OptionError, match="no set of responses 1"):
        draw_frf_overlay(result, 1)


def test_a_pair_is_drawn_with_its_readings(result):
    figure = draw_shape_pair(result, 1)
    texts = " ".join(t.get_text() for t in figure.texts)
    assert f"{result.pairs[0].test_hz:.5g} Hz" in texts
    assert f"MAC {result.pairs[0].mac:.3f}" in texts
    dots = [line for axes in figure.axes for line in axes.lines if line.get_marker() == "o"]
    assert len(dots) == 10
    with pytest.raises(OptionError, match="test mode 9"):
        draw_shape_pair(result, 9)


@pytest.mark.slow
def test_all_pictures_are_written(result, tmp_path):
    both = result.frfs[0]
    measured = replace(both.measured, outputs=both.measured.outputs[:1], response=both.measured.response[:, :1])
    one = replace(both, measured=measured, response=both.response[:, :1], frac=both.frac[:1])
    few = replace(result, pairs=result.pairs[2:3], frfs=(one,))
    written = save_correlation(few, tmp_path)
    assert [p.name for p in written] == ["correlation.png", "pair_03.png", "frf_01.png"]
    assert all(p.read_bytes().startswith(b"\x89PNG") for p in written)


def test_sensors_are_drawn_where_they_are(bar):
    placement = fx.place_sensors(bar, sensors=3, n=2)
    figure = draw_sensors(placement)
    texts = [t.get_text() for axes in figure.axes for t in axes.texts]
    assert {"1", "2", "3"} <= set(texts)
    assert all(name in " ".join(t.get_text() for t in figure.texts) for name in placement.sensors)


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command in this process, as the shell would."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["flexura", *map(str, arguments)])
        try:
            main()
            status = 0
        except SystemExit as end:
            status = end.code
        return status, *capsys.readouterr()

    return call


def test_correlate_from_the_shell(run, bar, measured, tmp_path):
    fx.save(bar, tmp_path / "bar.yaml")
    data = fx.write_measurement(measured, tmp_path / "bar.npz")
    status, out, err = run("correlate", tmp_path / "bar.yaml", data)
    assert status == 0, err
    assert "4 of 4 test modes paired" in out
    assert "-1.96 %" in out
    assert "wrong way round" in out
    status, out, _ = run("correlate", tmp_path / "bar.yaml", data, "--json", "-n", "3", "--within", "1 mm")
    assert status == 0
    assert [p["model"] for p in json.loads(out)["pairs"]] == [1, 2, 3]
    status, _, err = run("correlate", tmp_path / "bar.yaml", data, "--within", "1 Hz")
    assert status == 2 and "length" in err


def test_place_sensors_from_the_shell(run, bar, tmp_path):
    fx.save(bar, tmp_path / "bar.yaml")
    status, out, err = run(
        "place-sensors", tmp_path / "bar.yaml", "--sensors", "3", "-n", "2", "--plot", tmp_path / "pictures"
    )
    assert status == 0, err
    assert "n5.t" in out
    assert (tmp_path / "pictures" / "sensors.png").exists()
    status, out, _ = run(
        "place-sensors", tmp_path / "bar.yaml", "--sensors", "2", "-n", "2", "--candidate", "n5.t*", "--json"
    )
    assert {s["name"] for s in json.loads(out)["sensors"]} == {"n5.ty", "n5.tz"}
    status, _, err = run("place-sensors", tmp_path / "bar.yaml", "--sensors", "1", "-n", "2")
    assert status == 2 and "at least 2 sensors" in err
