"""Warnings of superelements, of strokes at yield, of many states, beyond buckling, and as errors of the commands."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.analysis.limits import limits
from flexura.analysis.limits.limits import States, stress_limits
from flexura.analysis.strain.stress import yield_ratios
from flexura.cli.app import app
from flexura.modelfile import save
from helpers.warned_statics import E, cantilever, warned

EXAMPLES = Path(__file__).parents[2] / "examples"
RUN = CliRunner()


def test_superelements_are_deflected_too():
    """Leaves that are given as matrices: as far as beams may go."""
    guide = fx.load(EXAMPLES / "imported" / "guide.yaml")
    small, large = (fx.statics(guide, loads={"carriage": (force, 0, 0, 0, 0, 0)}) for force in (1.0, 1e4))
    assert "displacement" not in warned(small)
    found = warned(large)["displacement"]
    assert found.place.startswith("leaf")
    # the leaves of a parallel guide are deflected by as much as it moves
    assert found.value == pytest.approx(abs(large.displacement("carriage")[0]), rel=1e-2)
    assert found.limit == pytest.approx(0.006)


def test_rigid_motions_deflect_no_superelement():
    guide = fx.load(EXAMPLES / "imported" / "guide.yaml")
    model = fx.assemble(guide.model_copy(update={"ground": {}}))
    found = limits.motion_limits(States(model, 1e3 * model.rigid_body_motions()))
    assert {w.kind for w in found} == {"rotation"}


def test_states_that_are_not_looked_at_are_said(monkeypatch):
    """Bent about one axis, then about the other, which together would yield."""
    model = fx.assemble(cantilever())
    loads = [{"b": (0, *force, 0, 0, 0)} for force in ((0.1, 0), (0, 0.1))]
    u = np.stack([fx.statics(model, loads=own).displacement_vector for own in loads], axis=1)
    u = np.tile(0.9 * u / yield_ratios(model, u).ratio.max(axis=0), 150)
    full = stress_limits(States(model, u))
    monkeypatch.setattr(limits, "MOST_STATES", 128)
    (few,) = stress_limits(States(model, u))
    assert full == () and few.kind == "stress"
    assert "172 other states" in few.text and "not known" in few.text
    (beyond,) = stress_limits(States(model, 2 * u))
    assert beyond.value > 1 and "172 other states" in beyond.text


@pytest.mark.parametrize(("yield_stress", "in_range"), [(200e6, True), (2e9, False)])
def test_strokes_at_yield_beyond_small_motion_are_marked(yield_stress, in_range):
    """Guided leaves yield at s L^2 / (3 E t): at 2.4 mm of 60 mm, or at 24 mm."""
    guide = fx.load(EXAMPLES / "guide" / "guide.yaml")
    steel = fx.describe.Material(E=E, nu=0.3, rho=7800.0, yield_stress=yield_stress)
    own = guide.replaced({"materials": {"spring-steel": steel}})
    (one,) = fx.kinetostatics(own, platform="carriage").freedoms
    assert one.yield_stroke == pytest.approx(yield_stress * 0.06**2 / (3 * E * 0.0005), rel=0.1)
    assert one.yields_in_range is in_range


def column(force):
    """A bar of 100 x 10 x 1 mm under a force along it at its free end."""
    return cantilever(loads={} if not force else {"b": fx.describe.Load(force=(-force, 0, 0))})


EULER = np.pi**2 * 200e9 * 0.01 * 0.001**3 / 12 / (4 * 0.1**2)


def test_buckling_beyond_the_load_still_answers(tmp_path):
    path = tmp_path / "column.yaml"
    save(column(0.0), path)
    run = ["buckling", str(path), "--load", f"b={-2 * EULER},0,0 N"]
    result = RUN.invoke(app, run)
    assert result.exit_code == 0, result.output
    assert "warning: buckled: the loads are 2" in result.stdout
    data = json.loads(RUN.invoke(app, [*run, "--json"]).stdout)
    assert data["loaded"] is None and len(data["unloaded"]["frequency_hz"]) >= 6
    assert data["buckling_factors"][0] == pytest.approx(0.5, rel=1e-3)
    strict = RUN.invoke(app, [*run, "--strict"])
    assert strict.exit_code == 1 and isinstance(strict.exception, fx.LimitError) and not strict.stdout


def test_strict_modes(tmp_path):
    rpr = str(EXAMPLES / "rpr" / "rpr.yaml")
    strict = RUN.invoke(app, ["modes", rpr, "-n", "14", "--keep", "0", "--strict", "--plot", str(tmp_path / "no")])
    assert strict.exit_code == 1 and isinstance(strict.exception, fx.LimitError) and not strict.stdout
    assert not (tmp_path / "no").exists()
    assert RUN.invoke(app, ["modes", str(EXAMPLES / "guide" / "guide.yaml"), "--strict"]).exit_code == 0


def test_kinetostatics_feel_and_say_loads():
    body = {"tip": fx.describe.RigidBody(centre=(0.1, 0, 0), mass=0.1, inertia=(1e-5, 1e-5, 1e-5), carries=("b",))}
    loads = {"b": fx.describe.Load(force=(-0.5 * EULER, 0, 0))}
    bare = fx.kinetostatics(cantilever(bodies=body), platform="tip")
    loaded = fx.kinetostatics(cantilever(bodies=body, loads=loads), platform="tip")
    assert np.diagonal(loaded.compliance)[1:3].max() > 1.5 * np.diagonal(bare.compliance)[1:3].max()
    assert any("loads" in note for note in loaded.notes) and not any("loads" in note for note in bare.notes)


@pytest.mark.parametrize("file", ["rpr/rpr.yaml", "rpr/start.yaml", "guide/guide.yaml", "tip_tilt/tip_tilt.yaml"])
def test_states_are_ruled_out_together_only_where_none_yields(file):
    """Of random states, with all internal forces at once and under single loads, one just yields: it is found."""
    model, rng = fx.assemble(fx.load(EXAMPLES / file)), np.random.default_rng(7)
    alone = np.eye(model.order)[:, rng.choice(model.order, 24, replace=False)]
    states: list[np.ndarray] = [
        rng.standard_normal((model.order, 24)),
        np.linalg.solve(model.K.toarray(), alone),
        alone,
    ]
    for u in states:
        for gravity in (None, (0.0, -3.0, 9.81)):
            assert limits._together(model, u, gravity).max() > yield_ratios(model, u, gravity).ratio.max()
        own = u / yield_ratios(model, u).ratio.max()
        (found,) = stress_limits(States(model, 1.0001 * own))
        assert found.value == pytest.approx(1.0001)
        assert stress_limits(States(model, 0.1 * own)) == ()
