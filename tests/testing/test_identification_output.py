"""Modes of a test as a table, as JSON and as pictures."""

import json

import matplotlib.image
import numpy as np
import pytest

import flexura as fx
from flexura.cli import main
from flexura.tables import significant
from flexura.testing.identification.evidence import collinearity, driving_points, phase, phase_deviation, real_shapes
from flexura.testing.identification.identification import mode_indicators
from flexura.testing.measurement.response_matrices import response_matrices
from helpers.hits import POLES_HZ, RATIOS, SHAPES, hit
from helpers.modal_systems import channels, measured, modal

HZ = np.arange(0.0, 60.0, 0.125)
SYSTEM = modal([11.0, 19.0, 32.0], [0.01, 0.01, 0.01], outputs=4, seed=1)


@pytest.fixture(scope="module")
def two():
    """Two setups."""
    return [measured(SYSTEM, HZ, (0, 1), at, 40, k, setup=f"step {k}") for k, at in enumerate(((0, 1), (2, 3)))]


def run(arguments, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["flexura", *map(str, arguments)])
    status = 0
    try:
        main()
    except SystemExit as stop:
        status = int(stop.code or 0)
    return status, *capsys.readouterr()


@pytest.mark.parametrize(
    ("value", "off", "shown"),
    [
        *((192.4837, 0.47, "192.5"), (667.20312, 0.006, "667.203"), (192.4837, 20.0, "190"), (1209.4, 2.9, "1209")),
        *((0.24376, 0.24376, "0.2"), (0.24376, 0.0, "0.243760"), (0.24376, 3.0, "0.2"), (0.0, 1.0, "0")),
    ],
)
def test_digits_that_an_uncertainty_leaves(value, off, shown):
    assert significant(value, off) == shown


@pytest.mark.slow
def test_command(tmp_path, two, monkeypatch, capsys):
    path = tmp_path / "test.npz"
    fx.write_measurement(fx.Measurement("plate", frfs=tuple(two)), path)
    status, out, err = run(["identify", path, "--plot", tmp_path / "pictures"], monkeypatch, capsys)
    assert (status, err) == (0, "")
    assert "3 modes from 4 outputs and 2 inputs" in out
    for hz in SYSTEM.frequency_hz[:3]:
        assert f"{hz:.4g}" in out
    assert "step 1" in out and "synthesis error" in out
    names = sorted(p.name for p in (tmp_path / "pictures").iterdir())
    assert names == ["stabilisation_01.png", "stabilisation_02.png", "synthesis_01.png", "synthesis_02.png"]
    for name in names:
        assert np.ptp(matplotlib.image.imread(tmp_path / "pictures" / name)[..., :3]) > 0.9
    status, out, err = run(["identify", path, "--select", "19 Hz", "--band", "5,50 Hz", "--json"], monkeypatch, capsys)
    data = json.loads(out)
    assert (status, err) == (0, "")
    assert data["frequency_hz"] == pytest.approx([19.0], rel=1e-3)
    assert len(data["setups"]) == 2
    status, out, err = run(["identify", path, "--select", "45 Hz"], monkeypatch, capsys)
    assert (status, out) == (2, "") and "no pole near 45 Hz" in err


def test_hits_become_modes():
    hits = [hit(noise=(1e-4, 2e-9), seed=k) for k in range(5)]
    for exponential in (None, 0.01):
        frfs = fx.testing.estimate_frf(hits, exponential=exponential, band=(2, 60))
        result = fx.identify(fx.Measurement("hits", frfs=frfs))
        assert (frfs[0].decay > 0.5) == (exponential is not None)
        assert result.frequency_hz == pytest.approx(POLES_HZ, rel=1e-4)
        assert result.damping_ratio == pytest.approx(RATIOS, rel=0.02)
        assert np.abs(result.real_shapes) == pytest.approx(np.abs(SHAPES), rel=0.02)
    same = fx.identify(fx.Measurement("hits", recordings=tuple(hits)), band=(2, 60))
    assert same.frequency_hz == pytest.approx(POLES_HZ, rel=1e-4)


def test_pictures_of_one_setup(two):
    result = fx.identify(two)
    figure = fx.view.draw_stabilisation(result.setups[0], two)
    axes = figure.axes[0]
    lines = [line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2]
    assert lines == pytest.approx(result.setups[0].frequency_hz)
    drawn = sum(len(line.get_xdata()) for line in axes.lines[: len(axes.lines) - len(lines)])
    assert drawn == len(result.setups[0].diagram[0].order)
    panels = fx.view.draw_synthesis(result.setups[1], two, pairs=[("acc2", "hit0")]).axes
    measured_line, given = (line.get_ydata() for line in panels[0].lines[:2])
    assert np.abs(given / measured_line - 1)[80:160].max() < 0.5
    with pytest.raises(fx.OptionError, match="modes of 2 setups"):
        fx.view.draw_stabilisation(result, two)
    with pytest.raises(fx.OptionError, match="no response"):
        fx.view.draw_synthesis(result.setups[1], two, pairs=[("acc0", "hit0")])
    with pytest.raises(fx.OptionError, match="no setup"):
        fx.view.draw_synthesis(result.setups[0], two[1])


def test_complexity_in_closed_form():
    line = np.exp(0.7j) * np.array([[1.0, -2.0, 0.5]]).T
    circle = np.exp(2j * np.pi * np.arange(3) / 3)[:, None]
    assert collinearity(line) == pytest.approx(1) and collinearity(circle) == pytest.approx(0, abs=1e-12)
    assert phase(line) == pytest.approx(0.7) and phase_deviation(line) == pytest.approx(0, abs=1e-6)
    assert real_shapes(line)[:, 0] == pytest.approx([-1, 2, -0.5])
    one = np.array([[2.0, np.exp(0.25j * np.pi), np.exp(-0.25j * np.pi)]]).T
    assert phase_deviation(one) == pytest.approx((1 + 1) * 45 / (2 + 1 + 1))
    assert collinearity(one) == pytest.approx((4 / 6) ** 2)


def test_driving_points_are_forces_and_motions_along_one_line():
    out = (
        *channels((0, 1), "acc", "acceleration"),
        fx.testing.MeasuredChannel("side", "acceleration", "n0", (1.0, 0.0, 0.0)),
        fx.testing.MeasuredChannel("down", "velocity", "n1", (0.0, 0.0, -1.0)),
        fx.testing.MeasuredChannel("turn", "rotation", "n0", (0.0, 0.0, 1.0)),
        fx.testing.MeasuredChannel("unknown", "acceleration"),
        fx.testing.MeasuredChannel("elsewhere", "acceleration", "n0", (0.0, 0.0, 1.0), (0.0, 0.1, 0.0)),
    )
    assert driving_points(channels((0, 1), "hit", "force"), out) == [(0, 0, 1.0), (1, 1, 1.0), (3, 1, -1.0)]


def test_mode_indicators_are_singular_values(two):
    matrix = response_matrices([two[0]])[0]
    values = mode_indicators(matrix)
    H = matrix.scaled
    assert (values**2).sum(axis=1) == pytest.approx((np.abs(H) ** 2).sum(axis=(1, 2)))
    assert values.prod(axis=1) == pytest.approx(np.abs(np.linalg.det(H)))
    assert (np.abs(H) ** 2).mean(axis=(0, 1)) == pytest.approx(1) and (np.abs(H) ** 2).mean(
        axis=(0, 2)
    ) == pytest.approx(1)
