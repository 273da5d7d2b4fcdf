"""What is asked of designs: read from text, and answered for blocks of them."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.full_order import plan_of
from flexura.mechanism.description import with_rigid_bodies
from flexura.study.questions import questions
from helpers.over import over

EXAMPLES = Path(__file__).parents[2] / "examples"
GUIDE = plan_of(fx.load(EXAMPLES / "guide" / "guide.yaml"))


def example(name):
    return fx.load(EXAMPLES / f"{name}.yaml")


def spread(plan, count, share, seed=0):
    """Designs around the default one, of the first parameters that are numbers."""
    rng, at = np.random.default_rng(seed), plan.parameter_values()
    names = [name for name, own in plan.mechanism.parameters.items() if isinstance(own.value, float)][:4]
    return {name: at[name] * rng.uniform(1 - share, 1 + share, count) for name in names}


def test_columns_carry_names_and_units():
    asked = questions(GUIDE, "f2 ,f1, mass,mass( carriage )")
    assert asked.columns == ("f2 [Hz]", "f1 [Hz]", "mass [kg]", "mass(carriage) [kg]")
    assert questions(GUIDE, ["f2", "f1, mass"]).columns == asked.columns[:3]


@pytest.mark.parametrize("name", ["guide/guide", "rpr/rpr_piezo", "tip_tilt/tip_tilt", "imported/guide"])
def test_masses_and_frequencies_are_those_of_modes(name):
    found = fx.modes(example(name), n=3)
    answers = questions(example(name), "f1, f2, f3, mass").values({})
    np.testing.assert_allclose(answers.value[0, :3], [mode.frequency_hz for mode in found.modes], rtol=1e-3)
    assert answers.value[0, 3] == pytest.approx(found.evidence.described_mass.mass, rel=1e-12)
    assert answers.is_proven.all()
    exact = fx.modes(example(name), n=3, order="full")
    for k, mode in enumerate(exact.modes):
        assert answers.lower[0, k] <= mode.frequency_hz * (1 + 1e-9)
        assert answers.upper[0, k] >= mode.frequency_hz * (1 - 1e-9)


def test_the_mass_of_a_body_is_density_times_volume():
    found = questions(GUIDE, "mass(carriage)").values({"width": [0.02, 0.03]})
    np.testing.assert_allclose(found.value[:, 0], 2700 * 0.07 * np.array([0.02, 0.03]) * 0.01, rtol=1e-12)


@pytest.mark.parametrize("name", ["guide/guide", "amplifier/amplifier", "tip_tilt/tip_tilt", "rpr/rpr"])
@pytest.mark.parametrize("share", [0.03, 0.25])
def test_answers_of_a_design_do_not_depend_on_its_neighbours(name, share):
    plan = plan_of(with_rigid_bodies(example(name)))
    asked, designs = questions(plan, "f1, f3, f4, mass"), spread(plan, 40, share)
    together = asked.values(designs)
    for chosen in ([0], [5, 5, 5], [39], [3, 17, 39, 0], range(8, 40)):
        some = asked.values({name: own[list(chosen)] for name, own in designs.items()})
        for of_some, of_all in zip(
            (some.value, some.lower, some.upper, some.is_proven, some.reason),
            (together.value, together.lower, together.upper, together.is_proven, together.reason),
            strict=True,
        ):
            assert np.array_equal(of_some, of_all[list(chosen)], equal_nan=of_some.dtype == float)


@pytest.mark.parametrize("name", ["guide/guide", "tip_tilt/tip_tilt"])
def test_answers_with_bodies_that_bend_stay_within_their_intervals_beside_other_neighbours(name):
    plan = plan_of(example(name))
    asked, designs = questions(plan, "f1, f3, f4, mass"), spread(plan, 40, 0.03)
    together = asked.values(designs)
    for chosen in ([0], [5, 5, 5], [3, 17, 39, 0]):
        some = asked.values({name: own[chosen] for name, own in designs.items()})
        for low, high in ((some.lower, together.upper[chosen]), (together.lower[chosen], some.upper)):
            assert (low[:, :3] <= high[:, :3]).all()
        np.testing.assert_allclose(some.value, together.value[chosen], rtol=1e-4)
        assert np.array_equal(some.is_proven, together.is_proven[chosen])


@pytest.mark.parametrize(
    ("name", "pose"),
    [
        ("guide/guide", "carriage.x = 1 mm"),
        ("amplifier/amplifier", "output.x = 10 um"),
        ("pivot/pivot", "arm.ry = 1 mrad"),
    ],
)
def test_stresses_at_poses_do_not_depend_on_neighbours_and_are_those_of_a_stroke(name, pose):
    mechanism = with_rigid_bodies(example(name))
    plan, (where, value, unit) = plan_of(mechanism), pose.replace(" =", "").split()
    asked, designs = questions(plan, f"stress at {pose}, margin at {pose}"), spread(plan, 5, 0.03)
    together = asked.values(designs)
    for chosen in ([0], [2, 2], [4, 1, 3]):
        some = asked.values({name: own[chosen] for name, own in designs.items()})
        assert np.array_equal(some.value, together.value[chosen])
        assert np.array_equal(some.reason, together.reason[chosen])
    one = {name: float(own[3]) for name, own in designs.items()}
    path = fx.stroke(plan, one, move={where: float(value) * {"mm": 1e-3, "um": 1e-6, "mrad": 1e-3}[unit]}, steps=1)
    stresses = [member.von_mises for member in path.stresses(0).members if member.von_mises is not None]
    assert together.value[3, 0] == pytest.approx(max(stresses), rel=1e-9)
    assert together.value[3, 1] == pytest.approx(path.poses[0].stress_margin, rel=1e-9)


def test_a_grid_does_not_differ_from_its_shuffled_designs():
    """Blocks of a grid have one geometry, those of a shuffled one many."""
    length, thickness = (own.ravel() for own in np.meshgrid([0.05, 0.06], np.linspace(4e-4, 6e-4, 32), indexing="ij"))
    order = np.random.default_rng(1).permutation(64)
    asked = questions(GUIDE, "f1, f2")
    rows = asked.values({"length": length, "thickness": thickness})
    shuffled = asked.values({"length": length[order], "thickness": thickness[order]})
    assert np.array_equal(shuffled.value, rows.value[order])
    assert np.array_equal(shuffled.lower, rows.lower[order])


def test_designs_that_cannot_be_are_rows_with_a_reason():
    asked = questions(GUIDE, "f1, mass")
    found = asked.values({"thickness": [4e-4, 9.0, np.nan, 5e-4, 1e-9], "distance": [0.05, 0.05, 0.05, -0.05, 0.05]})
    assert np.isfinite(found.value[0]).all()
    assert np.isnan(found.value[1:]).all()
    assert not found.is_proven[1:].any()
    assert found.is_proven[0]
    assert found.reason[0] == ""
    for word, reason in zip(("maximum", "finite", "distance", "minimum"), found.reason[1:], strict=True):
        assert word in reason
    alone = asked.values({"thickness": 4e-4, "distance": 0.05})
    assert np.array_equal(found.value[:1], alone.value)


def test_unknown_parameters_and_arrays_that_do_not_fit_are_errors():
    asked = questions(GUIDE, "f1")
    with pytest.raises(fx.OptionError, match="thicknes"):
        asked.values({"thicknes": [1e-3]})
    with pytest.raises(fx.OptionError, match="one length"):
        asked.values({"thickness": [4e-4, 5e-4], "length": [0.05, 0.06, 0.07]})
    with pytest.raises(fx.OptionError, match="thickness"):
        asked.values({"thickness": "thin"})


def test_questions_are_the_same_after_a_pickle():
    asked = questions(GUIDE, "f1, mass")
    again = pickle.loads(pickle.dumps(asked))
    assert again.columns == asked.columns
    assert np.array_equal(again.values({}).value, asked.values({}).value)


@over(
    ("text", "said"),
    [
        ("", "missing"),
        ("f0", "known: f1, f2"),
        ("f1,", "missing after 'f1,'"),
        ("f1 f2", "'f2' was not expected"),
        ("2*f1", r"'2\*f1' is a formula; quantities are names alone here"),
        ("f1, f2 / f1", "is a formula"),
        ("f1 <= 50 Hz", "is a formula"),
        ("mas", "did you mean mass"),
        ("mass(carriag)", "did you mean carriage"),
        ("mass(", "not closed"),
        ("mass(carriage, leaf1)", r"mass\[\(BODY\)\]"),
        ("f1, f1", "named twice"),
        ("f1000000", "from f1 to f132"),
        ("f1(carriage)", "no arguments"),
        ("f1 at", "a pose is expected"),
        ("f1 at carriage.x = 2", "a length is expected"),
        ("f1 at carriage.x = 2 kg", "a length is expected"),
        ("f1 at carriage.x = 2 mmm", "not a unit"),
        ("f1 at carriage.rz = 0.1", "an angle is expected"),
        ("f1 at carriag.x = 2 mm", "did you mean carriage"),
        ("f1 at carriage.q = 2 mm", "write NODE.DOF"),
        ("f1 at leaf1.foot.x = 2 mm", "held by the ground"),
        ("f1 at stroke 2 mm", "none is described"),
        ("f1 at carriage.x = 1 mm, carriage.tx = 2 mm", "given twice"),
        ("x" * 30_000, "20000 characters"),
    ],
)
def test_text_that_means_nothing_is_told_why(text, said):
    with pytest.raises(fx.OptionError, match=said):
        questions(GUIDE, text)


WORDS = st.sampled_from(
    ["f1", "f2", "mass", "(", ")", "carriage", ".x", " at ", "=", "2 mm", ",", " ", "stroke", "1e999 m", "-", "°", "*"]
)


@settings(max_examples=300, deadline=None)
@given(st.one_of(st.text(max_size=40), st.lists(WORDS, max_size=12).map("".join)))
def test_any_text_is_read_or_refused(text):
    try:
        asked = questions(GUIDE, text)
    except fx.OptionError as error:
        assert str(error)
    else:
        assert questions(GUIDE, [own.text for own in asked.quantities]).columns == asked.columns


def test_a_parameter_of_the_name_of_a_quantity_is_asked_as_a_parameter():
    text = Path(EXAMPLES / "guide" / "guide.yaml").read_text(encoding="utf-8").partition("studies:")[0]
    for name, unit in (("f1", "Hz"), ("mass", "kg")):
        own = text.replace("  thickness: {value", f"  {name}: {{value").replace(": thickness}", f": {name}}}")
        model = fx.loads(own)
        asked = questions(model, f"{name}, parameter({name})")
        assert asked.columns == (f"{name} [{unit}]", f"parameter({name}) [m]")
        assert asked.values({}).value[0, 1] == 0.5e-3
        assert asked.notes == (
            f"{name} is the quantity of this name, not the parameter that is called so: that is parameter({name})",
        )
        assert questions(model, f"parameter({name})").notes == ()


def test_a_name_that_wants_arguments_tells_of_the_parameter_that_is_called_so():
    text = Path(EXAMPLES / "guide" / "guide.yaml").read_text(encoding="utf-8").partition("studies:")[0]
    model = fx.loads(text.replace("  thickness: {value", "  reach: {value").replace(": thickness}", ": reach}"))
    with pytest.raises(fx.OptionError, match=r"reach\(NODE\.DOF\), not with \(\); the parameter is parameter\(reach\)"):
        questions(model, "reach")
