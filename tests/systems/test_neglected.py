"""A state space holds a bound on what it leaves out in its band: true, not far above the error, and said when large."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.systems.reduction import with_residual_modes

EXAMPLES = Path(__file__).parents[2] / "examples"
PORTS = {
    "tip_tilt/tip_tilt": (["leg1.piezo", "mirror.rx"], ["mirror.tz", "mirror.rx", "mirror.tz:velocity"]),
    "rpr/rpr_piezo": (["rpu1.c.piezo", "platform.tz"], ["rpu1.c.force", "lift", "platform.tz:acceleration"]),
    "xy_stage/xy_stage": (["table.tx", "ground.tx"], ["table.tx", "table.ty:velocity", "table.tx:acceleration"]),
    "amplifier/amplifier": (["piezo"], ["motion", "output.tz:acceleration"]),
}
WAYS = [{}, {"residual_modes": True}, {"balanced": 8}, {"balanced": 8, "residual_modes": True}]


@pytest.fixture(scope="module", params=PORTS)
def whole(request):
    """An example at full order with all of its modes, which answers frequency by frequency like a direct solution."""
    inputs, outputs = PORTS[request.param]
    built = fx.system(
        fx.load(EXAMPLES / f"{request.param}.yaml"), inputs=inputs, outputs=outputs, order="full", damping=0.01
    )
    return built, built.modal()


def lost_of(model: fx.StateSpace) -> fx.types.Neglected:
    """What a model holds."""
    assert model.neglected is not None
    return model.neglected


def shares(model, reference, hz):
    """The largest difference of each channel beside the size that it is held against."""
    apart = np.abs(model.frequency_response(hz) - reference.response(hz)).max(axis=0)
    return apart / lost_of(model).scale


@pytest.mark.parametrize("how", WAYS, ids=str)
@pytest.mark.parametrize("n", [5, 8])
def test_the_error_is_below_the_bound_and_not_far(whole, how, n):
    """Against all modes of the full order, on frequencies that the bound was not worked out at."""
    built, every = whole
    few = built.modal(n)
    for top in np.array([0.4, 0.8]) * few.next_omega / 2 / np.pi:
        model = fx.state_space(few, band=(0.0, top), **how)
        lost = lost_of(model)
        hz = np.concatenate([np.geomspace(*lost.band, 150), few.frequency_hz[few.frequency_hz < top]])
        share = shares(model, every, hz)
        assert (share <= lost.shares * 1.02 + 1e-9).all()
        if "residual_modes" not in how:
            assert lost.share <= max(100 * share.max(), 1e-3)
        assert (lost.share > 0.01) == ("tolerance" in {w.kind for w in model.warnings})
        assert lost.text in model.notes
        if how == {}:
            assert lost.holds_up_to <= top and (lost.holds_up_to == pytest.approx(top)) == (lost.share <= 0.01)


@pytest.mark.parametrize("name", PORTS)
def test_residual_modes_give_what_static_terms_cannot(name):
    """Velocity and acceleration at a third of the first frequency left out: percents without, 1e-3 with them."""
    inputs, _ = PORTS[name]
    node = {"rpr": "platform", "tip": "mirror", "xy_": "table", "amp": "output"}[name[:3]]
    outputs = [f"{node}.{dof}:{word}" for dof in ("tz", "tx") for word in ("velocity", "acceleration")]
    built = fx.system(fx.load(EXAMPLES / f"{name}.yaml"), inputs=inputs, outputs=outputs, order="full", damping=0.01)
    every, few = built.modal(), built.modal(4)
    hz = np.geomspace(0.01, 0.33, 100) * few.next_omega / 2 / np.pi
    plain = shares(fx.state_space(few, band=(hz[0], hz[-1])), every, hz).max()
    better = shares(fx.state_space(few, band=(hz[0], hz[-1]), residual_modes=True), every, hz).max()
    assert better < 0.05 and better < 0.2 * plain


def test_residual_modes_are_modes():
    """Orthogonal with unit mass, above what is left out, with exact static gains, damped and stable."""
    inputs, outputs = PORTS["rpr/rpr_piezo"]
    built = fx.system(
        fx.load(EXAMPLES / "rpr/rpr_piezo.yaml"), inputs=inputs, outputs=outputs, order="full", damping=0.01
    )
    few = built.modal(5)
    more = with_residual_modes(few)
    V = more.shapes
    assert more.order == 7 and (more.omega[5:] >= few.next_omega).all() and (np.diff(more.omega) > 0).all()
    assert np.abs(V.T @ (built.M @ V) - np.eye(7)).max() < 1e-7
    assert np.abs(more.residual).max() < 1e-6 * np.abs(few.residual).max()
    model = fx.state_space(few, residual_modes=True)
    assert model.order == 14 and model.poles().real.max() < 0
    assert model.notes[0].startswith("5 modes and 2 residual modes of the full-order model")
    assert with_residual_modes(built.modal()).order == built.modal().order


def test_units_do_not_hide_an_error():
    """Force in N beside rotation in rad: each is held against its own, whatever the sizes of the others."""
    built = fx.system(
        fx.load(EXAMPLES / "rpr/rpr_piezo.yaml"),
        inputs=["rpu1.c.piezo"],
        outputs=["rpu1.c.force", "lift"],
        order="full",
        damping=0.01,
    )
    few = built.modal(3)
    both, alone = lost_of(fx.state_space(few)), lost_of(fx.state_space(few.selected(None, ["lift"])))
    assert both.shares[1, 0] == pytest.approx(alone.shares[0, 0], rel=1e-9) and alone.share > 0.01
    picked = lost_of(fx.state_space(few).selected(None, ["lift"]))
    assert picked.shares == pytest.approx(alone.shares, rel=1e-9) and picked.worst == "lift / rpu1.c.piezo"


def test_modes_that_nothing_damps_are_said():
    """Their poles stay on the axis; the bound is of what lies beside them."""
    built = fx.system(fx.load(EXAMPLES / "guide/guide.yaml"), inputs="carriage.tx", outputs="carriage.tx", order="full")
    model = fx.state_space(built, n=4)
    assert "nothing damps 4 of the modes" in " ".join(model.notes)
    assert np.isfinite(lost_of(model).share) and np.abs(model.poles().real).max() < 1e-9 * np.abs(model.poles()).max()


def test_beyond_its_band():
    """A response of a state space says where nothing is known of it, and carries what the model warns of."""
    built = fx.system(
        fx.load(EXAMPLES / "guide/guide.yaml"), inputs="carriage.tz", outputs="carriage.tz", order="full", damping=0.01
    )
    model = fx.state_space(built, n=8, band=(1.0, 100.0))
    assert not {w.kind for w in fx.frequency_response(model, frequency_hz=[50.0]).warnings} - {
        w.kind for w in model.warnings
    }
    assert "proof" in {w.kind for w in fx.frequency_response(model, frequency_hz=[500.0]).warnings}
    poor = fx.state_space(built, n=2)
    assert "tolerance" in {w.kind for w in poor.warnings}
    assert poor.discretised(1e-4).warnings == poor.warnings == fx.frequency_response(poor, frequency_hz=[50.0]).warnings
    with pytest.raises(fx.OptionError, match="band"):
        fx.state_space(built, n=2, band=(10.0, 1.0))


def test_a_model_without_all_modes_of_its_band_is_no_proof():
    """Low order by constraint modes alone misses modes: the state space says so."""
    blind = fx.reduce(fx.load(EXAMPLES / "rpr/rpr.yaml"))
    built = fx.system(blind, inputs=["platform.tz"], outputs=["platform.tz"], damping=0.01)
    assert "proof" in {w.kind for w in fx.state_space(built, band=(1.0, 600.0)).warnings}
    assert not fx.state_space(built, band=(1.0, 22.0)).warnings


def test_shell(tmp_path):
    """Notes, warning, JSON and the file hold it; --strict writes nothing."""
    words = [
        "export",
        str(EXAMPLES / "tip_tilt/tip_tilt.yaml"),
        "--out",
        str(tmp_path / "t.npz"),
        "-n",
        "3",
        "--damping",
        "0.01",
    ]
    run = CliRunner().invoke(app, words)
    assert run.exit_code == 0 and "warning: at most" in run.output
    with np.load(tmp_path / "t.npz") as file:
        assert any("warning: at most" in str(note) for note in file["notes"])
    data = json.loads(CliRunner().invoke(app, [*words, "--json"]).stdout)
    assert data["warnings"][0]["kind"] == "tolerance" and data["neglected"]["band_hz"][1] > 1000
    (tmp_path / "t.npz").unlink()
    refused = CliRunner().invoke(app, [*words, "--strict"])
    assert refused.exit_code == 1 and not (tmp_path / "t.npz").exists()
    fine = CliRunner().invoke(app, [*words, "--strict", "-n", "12", "--residual-modes", "--band", "1,1000 Hz"])
    assert fine.exit_code == 0, fine.output
