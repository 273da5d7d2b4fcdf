"""Formulas over asked names, and relations between them, with units."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.full_order import plan_of
from flexura.study.questions import formula, questions, relation

GUIDE = plan_of(fx.load(Path(__file__).parents[2] / "examples" / "guide" / "guide.yaml"))
DESIGNS = {"thickness": np.array([4e-4, 5e-4, 9.0]), "width": np.array([0.02, 0.03, 0.02])}


def asked(text):
    return questions(GUIDE, text).values(DESIGNS).value[:, 0]


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("f1", "Hz", lambda: asked("f1")),
        ("f2 - f1", "Hz", lambda: asked("f2") - asked("f1")),
        ("2*mass", "kg", lambda: 2 * asked("mass")),
        ("f1/100 Hz", "1", lambda: asked("f1") / 100),
        ("sqrt(f1*f2)", "Hz", lambda: np.sqrt(asked("f1") * asked("f2"))),
        ("min(f1, 50 Hz) + max(f2, 0.6 kHz)", "Hz", lambda: np.fmin(asked("f1"), 50) + np.maximum(asked("f2"), 600)),
        ("mass*f1^2", "N/m", lambda: asked("mass") * asked("f1") ** 2),
        ("length/thickness", "1", lambda: np.where(DESIGNS["thickness"] < 1, 0.06 / DESIGNS["thickness"], np.nan)),
    ],
)
def test_formulas_follow_from_what_is_asked(text, unit, expected):
    own = formula(GUIDE, text)
    assert own.unit == unit
    found, wanted = own.values(DESIGNS), expected()
    np.testing.assert_allclose(found[:2], wanted[:2], rtol=1e-6)
    assert np.isnan(found[2])
    assert np.array_equal(pickle.loads(pickle.dumps(own)).values(DESIGNS), found, equal_nan=True)


@pytest.mark.parametrize(
    ("text", "scale", "expected"),
    [
        ("f1 >= 20 Hz", 20, lambda: asked("f1") / 20 - 1),
        ("20 Hz <= f1", 20, lambda: asked("f1") / 20 - 1),
        ("mass <= 50 g", 0.05, lambda: 1 - asked("mass") / 0.05),
        ("f1 >= 0", 1, lambda: asked("f1")),
        ("mass <= 50000 kg*mm/m", 50, lambda: 1 - asked("mass") / 50),
        ("mass/thickness <= 1 kg/m", 1, lambda: 1 - asked("mass") / DESIGNS["thickness"]),
        ("mass <= 1 kg/m*thickness", 5e-4, lambda: DESIGNS["thickness"] / 5e-4 - asked("mass") / 5e-4),
        ("mass*1000 mm^2/s^2 >= 2e-6 N*m", 2e-6, lambda: asked("mass") * 500 - 1),
        ("stiffness(carriage.y) >= 200 N/mm", 2e5, lambda: asked("stiffness(carriage.y)") / 2e5 - 1),
        ("stiffness(carriage.y) >= 200 [N/mm]", 2e5, lambda: asked("stiffness(carriage.y)") / 2e5 - 1),
        ("length ≥ 100*thickness", 0.05, lambda: 0.06 / 0.05 - 100 * DESIGNS["thickness"] / 0.05),
    ],
)
def test_margins_are_positive_where_relations_are_met(text, scale, expected):
    own = relation(GUIDE, text)
    assert own.scale == pytest.approx(scale)
    np.testing.assert_allclose(own.margin(DESIGNS)[:2], expected()[:2], rtol=1e-12)
    assert np.isnan(own.margin(DESIGNS)[2])


def test_a_margin_of_two_asked_sides_is_relative_to_the_default_design():
    own = relation(GUIDE, "2*f1 <= f2")
    assert own.scale == pytest.approx(questions(GUIDE, "f2").values({}).value[0, 0], rel=1e-6)
    np.testing.assert_allclose(own.margin(DESIGNS)[:2], ((asked("f2") - 2 * asked("f1")) / own.scale)[:2], rtol=1e-6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("f1 + mass", "f1 in Hz and mass in kg"),
        ("f1 + 3", "f1 in Hz and 3 without unit"),
        ("max(f1, 400 MPa)", "f1 in Hz and 400 MPa in Pa"),
        ("f1 +", "ends too early"),
        ("2 f1", "by an operator"),
        ("max(f1)", "2 argument"),
        ("foo + f1", "'foo' is no quantity"),
        ("f1^f2", "an exponent is a pure number"),
        ("f1 / 3 Hzz", "not a unit"),
        ("f1 <= 3 Hz", "cannot stand"),
        ("", "ends too early"),
    ],
)
def test_formulas_that_mean_nothing_are_told_why(text, said):
    with pytest.raises(fx.OptionError, match=said):
        formula(GUIDE, text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("f1", "no relation"),
        ("f1 >= 20", "f1 is in Hz and 20 without unit"),
        ("f1 <= 400 MPa", "f1 is in Hz and 400 MPa in Pa"),
        ("10 Hz <= f1 <= 20 Hz", "two relations"),
        ("f1 == 20 Hz", "no relation"),
        ("f1 < 20 Hz", "no relation"),
        ("3 <= 4", "asks nothing"),
        ("f1 >=", "ends too early"),
    ],
)
def test_relations_that_mean_nothing_are_told_why(text, said):
    with pytest.raises(fx.OptionError, match=said):
        relation(GUIDE, text)


WORDS = st.sampled_from(
    [
        *(
            "f1",
            "f2",
            "mass",
            "(",
            ")",
            "carriage.x",
            " at ",
            "=",
            "2 mm",
            "400 MPa",
            ",",
            " ",
            "stroke",
            "+",
            "-",
            "*",
        ),
        *("/", "^", "<=", ">=", "<", "max", "sqrt", "pi", "[N/m]", "1e999", "²", "thickness", "length", "3"),
    ]
)


@settings(max_examples=400, deadline=None)
@given(st.one_of(st.text(max_size=40), st.lists(WORDS, max_size=14).map("".join)), st.sampled_from([formula, relation]))
def test_any_text_is_read_or_refused(text, read):
    try:
        own = read(GUIDE, text)
    except fx.OptionError as error:
        assert str(error)
    else:
        assert read(GUIDE, own.text).quantities == own.quantities
