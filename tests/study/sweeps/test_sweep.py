"""Sweeps of mechanisms: what is asked of a design is what the verbs say of it alone."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx

GUIDE = "examples/guide/guide.yaml"
STUDIES = """
studies:
  sizes:
    sweep: {vary: {thickness: {from: 0.3 mm, to: 0.6 mm, steps: 4, scale: log}, length: [50 mm, 60 mm]}, ask: f1}
  samples:
    sweep:
      vary: {thickness: {}, width: {from: 0.5*distance, to: distance}}
      ask: [f1, mass]
      sampling: sobol
      samples: 8
  pairs:
    sweep:
      vary: {thickness: [0.3 mm, 0.4 mm, 0.5 mm], length: {from: 50 mm, to: 60 mm, steps: 3}}
      ask: mass
      sampling: list
  best:
    optimize: {vary: {thickness: {}}, maximise: f1}
"""


@pytest.fixture(scope="module")
def guide():
    return fx.load(GUIDE)


@pytest.fixture(scope="module")
def described(tmp_path_factory):
    return fx.loads(Path(GUIDE).read_text(encoding="utf-8").partition("studies:")[0] + STUDIES)


def test_each_design_is_what_modes_says_of_it_alone(guide):
    table = fx.sweep(
        guide, {"width": 0.03}, vary={"thickness": (3e-4, 6e-4, 3), "length": [0.05, 0.08]}, ask="f1, f2, f3"
    )
    assert (len(table), table.unproven, table.failed) == (6, 0, 0)
    for number in range(6):
        row = table.design(number)
        own = {"width": 0.03, "thickness": row["thickness [m]"], "length": row["length [m]"]}
        exact = fx.modes(guide, own, n=3, order="full").frequency_hz
        for k in range(3):
            assert row[f"f{k + 1} lower [Hz]"] * (1 - 1e-9) <= exact[k] <= row[f"f{k + 1} upper [Hz]"] * (1 + 1e-9)
            assert row[f"f{k + 1} [Hz]"] == pytest.approx(exact[k], rel=1e-3)


def test_the_mass_is_density_times_volume(guide):
    """Two leaves of thickness x width x length of spring steel, and a block that does not change."""
    t = np.linspace(3e-4, 6e-4, 7)
    table = fx.sweep(guide, vary={"thickness": t}, ask="mass").to_columns()
    slope = np.diff(table["mass [kg]"]) / np.diff(t)
    assert slope == pytest.approx(2 * 0.02 * 0.06 * 7850 * np.ones(6), rel=1e-9)


def test_samples_cover_their_ranges_and_are_named_by_their_seed(guide):
    def made(**how):
        own = {"vary": "thickness=0.2mm:0.6mm:log", "ask": "mass", "sampling": "sobol", "samples": 64}
        return fx.sweep(guide, **(own | how)).to_columns()["thickness [m]"]

    found = np.sort(np.log(made() / 2e-4) / np.log(3))
    assert np.array_equal(np.floor(found * 64), np.arange(64))
    assert np.array_equal(made(), made(seed=0))
    assert not np.isin(made(seed=1), made()).any()


def test_a_study_of_the_description(described):
    table = fx.sweep(described, study="sizes")
    assert table.asked == ("f1 [Hz]",)
    found = table.to_columns()
    assert found["thickness [m]"] == pytest.approx(np.repeat(np.geomspace(3e-4, 6e-4, 4), 2))
    assert found["length [m]"].tolist() == [0.05, 0.06] * 4
    assert fx.sweep(described, study="sizes", ask="mass").asked == ("mass [kg]",)


def test_the_only_sweep_of_a_description_needs_no_name(described):
    text = Path(GUIDE).read_text(encoding="utf-8").partition("studies:")[0]
    best = "  best: {optimize: {vary: {thickness: {}}, maximise: f1}}\n"
    one = "studies:\n  some: {sweep: {vary: {thickness: [0.3 mm, 0.5 mm]}, ask: mass}}\n" + best
    model = fx.loads(text + one)
    assert fx.sweep(model).to_columns()["thickness [m]"].tolist() == [0.3e-3, 0.5e-3]
    assert fx.sweep(model, ask="f1").asked == ("f1 [Hz]",)
    with pytest.raises(fx.OptionError, match=r"what to ask is missing.*or a study of the description: some$"):
        fx.sweep(model, vary={"thickness": [0.3e-3]})
    with pytest.raises(fx.OptionError, match=r"what to vary is missing.*: sizes, samples, pairs$"):
        fx.sweep(described)


def test_a_list_of_the_description_pairs_values(described):
    found = fx.sweep(described, study="pairs").to_columns()
    assert found["thickness [m]"].tolist() == pytest.approx([3e-4, 4e-4, 5e-4])
    assert found["length [m]"].tolist() == pytest.approx([0.05, 0.055, 0.06])


def test_ends_left_out_are_bounds_and_ends_may_be_expressions(described):
    table = fx.sweep(described, {"distance": 0.04}, study="samples")
    assert table.space["variables"][0] | {"low": 1e-4, "high": 2e-3} == table.space["variables"][0]
    assert table.space["variables"][1] | {"low": 0.02, "high": 0.04} == table.space["variables"][1]
    assert len(table) == 8


def test_designs_that_cannot_be_are_rows_with_a_reason(guide):
    own = guide.parameters["thickness"].replaced({"minimum": None})
    loose = guide.replaced({"parameters": {**guide.parameters, "thickness": own}})
    table = fx.sweep(loose, vary={"thickness": [-1e-4, 0.0, 4e-4]}, ask="f1, mass")
    assert table.failed == 2
    assert [bool(reason) for reason in table.to_columns()["reason"]] == [True, True, False]
    assert np.isnan(table.to_columns()["f1 [Hz]"]).tolist() == [True, True, False]
    assert sum(own.count for own in table.reasons) == 2
    assert table.highest("f1")["design"] == 2


def test_extremes(guide):
    table = fx.sweep(guide, vary={"thickness": [4e-4, 6e-4, 2e-4]}, ask="f1")
    assert (table.lowest("f1")["design"], table.highest("f1 [Hz]")["design"]) == (2, 1)
    with pytest.raises(fx.OptionError, match="is no quantity of this study"):
        table.lowest("thickness")


def test_a_folder_goes_on_with_another_version_of_itself(guide, tmp_path):
    how = {"vary": {"thickness": (3e-4, 6e-4, 100)}, "ask": "f1"}
    first = fx.sweep(guide, **how, folder=tmp_path / "s", workers=1)
    before = {file.name: file.read_bytes() for file in (tmp_path / "s").iterdir()}
    again = fx.sweep(fx.load(GUIDE), **how, folder=tmp_path / "s", workers=2)
    assert {file.name: file.read_bytes() for file in (tmp_path / "s").iterdir()} == before
    in_memory = fx.sweep(guide, **how)
    for name in first.columns:
        assert np.array_equal(first.to_columns()[name], again.to_columns()[name])
        assert np.array_equal(first.to_columns()[name], in_memory.to_columns()[name])


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({}, "what to vary is missing"),
        ({"vary": "thickness=1mm,2mm"}, "what to ask is missing"),
        ({"study": "none"}, "not a study of the description; studies: best"),
        ({"vary": "thickness=1mm,2mm", "ask": "f0"}, "f0"),
        ({"vary": "thickness=1mm,2mm", "ask": "f1", "samples": 3}, "samples belong to"),
        ({"vary": "thickness=1mm:2mm", "ask": "f1", "sampling": "sobol"}, "number of samples"),
        ({"vary": "thickness=1mm,2mm", "ask": "f1", "sampling": "random"}, "sampling is one of"),
        ({"vary": "thickness=1mm,2mm", "ask": "f1", "parameters": {"thickness": 1e-3}}, "has a value already"),
        ({"vary": "thickness=1mm,2mm", "ask": "f1", "parameters": {"thick": 1e-3}}, "thick"),
        ({"vary": "thickness=1mm,2mm", "ask": "f1", "parameters": {"width": [1e-3, 2e-3]}}, "one design is expected"),
        ({"vary": "thickness=1mm,2mm", "ask": "f1", "workers": 0}, "at least 1"),
    ],
)
def test_what_cannot_be_swept_is_said_before_anything_is_made(guide, tmp_path, how, said):
    parameters = how.pop("parameters", None)
    with pytest.raises(fx.OptionError, match=said):
        fx.sweep(guide, parameters, **how, folder=tmp_path / "study")
    assert not (tmp_path / "study").exists()


def test_a_study_of_another_kind(described):
    with pytest.raises(fx.OptionError, match="'best' is no sweep"):
        fx.sweep(described, study="best")
    with pytest.raises(fx.OptionError, match="did you mean 'sizes'"):
        fx.sweep(described, study="size")


def over_lengths(guide, lengths, ask="f(carriage.rx), f(carriage.ry)", **options):
    return fx.sweep(guide, vary={"length": lengths}, ask=ask, workers=1, **options)


def test_where_another_mode_takes_over_is_said_and_where_modes_cross_nothing_is(guide):
    """Between 69 and 70 mm two modes of the leaves take the rotation from one another without meeting; about x the
    frequency comes down through two others."""
    lengths = np.linspace(0.04, 0.1, 61)
    table = over_lengths(guide, lengths)
    columns = table.to_columns()
    assert not columns["f(carriage.rx) jumps"].any()
    modes = fx.questions(guide, "f(carriage.rx)").values({"length": lengths}).mode
    assert (modes.min(), modes.max()) == (1, 3)
    assert np.flatnonzero(columns["f(carriage.ry) jumps"]).tolist() == [29]
    step = np.abs(np.diff(columns["f(carriage.ry) [Hz]"]))
    assert step[29] > 900
    assert np.delete(step, 29).max() < 300
    (own,) = table.warnings
    assert own.text.startswith(
        "f(carriage.ry) goes over to another mode, from 1524.8 to 2888.8 Hz, between length = 69"
    )
    nearer = over_lengths(guide, (0.069, 0.07, 33)).to_columns()
    (at,) = np.flatnonzero(nearer["f(carriage.ry) jumps"])
    assert np.diff(nearer["f(carriage.ry) [Hz]"])[at] > 900


def test_a_jump_stands_before_the_design_with_the_next_larger_value(guide, tmp_path):
    table = over_lengths(guide, [0.072, 0.068, 0.071, 0.069, 0.07, 0.073], ask="f(carriage.ry)", folder=tmp_path)
    columns = fx.open_study(tmp_path).to_columns()
    assert np.flatnonzero(columns["f(carriage.ry) jumps"]).tolist() == [3]
    assert fx.open_study(tmp_path).warnings == table.warnings != ()


def test_blocks_see_the_jump_to_the_first_design_of_the_next(guide):
    first = np.linspace(0.05, 0.069, 128)  # as many as are worked out at once
    columns = over_lengths(guide, [*first, 0.07, 0.071], ask="f(carriage.ry)").to_columns()
    assert np.flatnonzero(columns["f(carriage.ry) jumps"]).tolist() == [127]


def test_over_two_parameters_nothing_stands_in_a_row(guide):
    table = fx.sweep(guide, vary={"length": [0.08, 0.081], "width": [0.02, 0.021]}, ask="f(carriage.ry)", workers=1)
    assert not [name for name in table.columns if name.endswith("jumps")]
