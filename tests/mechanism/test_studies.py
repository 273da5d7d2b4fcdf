"""Studies as they are described: in Python, and held against the parameters of the mechanism."""

from __future__ import annotations

import pytest

from flexura.describe import DescribedStudy, Goal, OptimumStudy, Range, Spread, SweepStudy, ToleranceStudy, parameter
from flexura.errors import ModelError
from flexura.mechanism import evaluated, problems
from flexura.modelfile import loads
from helpers.modelfile_samples import BEAM
from helpers.over import over

MECHANISM = loads(BEAM)


def found(**study) -> list[tuple[str, str]]:
    mechanism = MECHANISM.model_copy(update={"studies": {"s": DescribedStudy(**study)}})
    return [(p.place, p.rule) for p in problems(mechanism)]


def test_a_study_is_one_of_three():
    sweep = SweepStudy(vary={"t": [1e-3]}, ask="f1")
    assert DescribedStudy(sweep=sweep).kind == "sweep"
    assert DescribedStudy(sweep=sweep).own == sweep
    for both in ({}, {"sweep": sweep, "optimize": OptimumStudy(vary={"t": [1e-3]}, maximise="f1")}):
        with pytest.raises(ModelError, match="one of sweep, optimize, tolerance"):
            DescribedStudy(**both)


def test_one_question_stands_for_a_list_of_them():
    assert SweepStudy(vary={"t": [1e-3]}, ask="f1, mass").ask == ("f1, mass",)
    assert SweepStudy(vary={"t": [1e-3]}, ask=["f1", " mass "]).ask == ("f1", "mass")


@over(
    ("kind", "data", "rule"),
    [
        (Range, {"from": 2.0, "to": 1.0}, "from the smaller value to the larger"),
        (Range, {"from": 1.0, "to": 1.0}, "from the smaller value to the larger"),
        (Range, {"from": 0.0, "to": 1.0, "scale": "log"}, "positive ends"),
        (Range, {"from": 0.5, "to": 2.0, "integer": True}, "whole ends"),
        (Range, {"from": float("nan"), "to": 2.0}, "must be finite"),
        (SweepStudy, {"vary": {}, "ask": "f1"}, "at least"),
        (SweepStudy, {"vary": {"t": []}, "ask": "f1"}, "at least 1"),
        (SweepStudy, {"vary": {"t": [1e-3]}, "ask": []}, "at least 1"),
        (SweepStudy, {"vary": {"t": [1e-3]}, "ask": " "}, "text is expected"),
        (SweepStudy, {"vary": {"t": {"from": 1.0, "to": 2.0}}, "ask": "f1"}, "t has no steps on the grid"),
        (SweepStudy, {"vary": {"t": [1e-3]}, "ask": "f1", "samples": 5}, "samples are those of"),
        (SweepStudy, {"vary": {"t": [1e-3]}, "ask": "f1", "sampling": "list", "samples": 5}, "samples are those of"),
        (SweepStudy, {"vary": {"t": {"from": 1.0}}, "ask": "f1", "sampling": "list"}, "t has no steps on the list"),
        (
            SweepStudy,
            {"vary": {"t": [1e-3, 2e-3], "w": {"steps": 3}}, "ask": "f1", "sampling": "list"},
            r"every parameter has as many \(t has 2, w has 3\)",
        ),
        (SweepStudy, {"vary": {"t": [1e-3]}, "ask": "f1", "sampling": "sobol"}, "how many designs"),
        (
            SweepStudy,
            {"vary": {"t": {"steps": 3}}, "ask": "f1", "sampling": "sobol", "samples": 8},
            "t has steps, but no grid",
        ),
        (OptimumStudy, {"vary": {"t": {"steps": 3}}, "maximise": "f1"}, "sought between the ends"),
        (OptimumStudy, {"vary": {"t": [1.0]}}, "one of maximise, minimise, goals"),
        (OptimumStudy, {"vary": {"t": [1.0]}, "maximise": "f1", "minimise": "mass"}, "one of maximise, minimise"),
        (OptimumStudy, {"vary": {"t": [1.0]}, "goals": [{"maximise": "f1"}]}, "at least 2"),
        (Goal, {"maximise": "f1", "minimise": "f2"}, "either maximise or minimise"),
        (Spread, {}, "one of uniform, triangular, normal, measured"),
        (Spread, {"uniform": 1e-5, "normal": 1e-5}, "one of uniform, triangular, normal, measured"),
        (Spread, {"uniform": 1e-5, "within": 3}, "within belongs to a normal"),
        (Spread, {"uniform": (1e-5, -1e-5)}, "below the upper one"),
        (Spread, {"uniform": 0.0}, "deviations of zero are none"),
        (Spread, {"normal": 0.0}, "deviations of zero are none"),
        (Spread, {"normal": -1e-5}, "must be positive"),
        (Spread, {"normal": 1.0, "within": -1}, "must be positive"),
        (Spread, {"measured": [1e-3]}, "at least 2"),
        (ToleranceStudy, {"vary": {"t": {"normal": 1e-5}}}, "ask or require"),
    ],
)
def test_what_a_part_refuses(kind, data, rule):
    with pytest.raises(ModelError, match=rule):
        kind(**data)


def test_one_deviation_stands_for_as_far_down_as_up():
    assert Spread(uniform=1e-5).uniform == (-1e-5, 1e-5)
    share = evaluated(Spread(uniform=0.1 * parameter("t")), {"t": 2e-3})
    assert share.uniform == pytest.approx((-2e-4, 2e-4), rel=1e-15)


def test_unknown_parameters_are_named_with_what_was_meant():
    assert found(sweep=SweepStudy(vary={"tt": [1e-3]}, ask="f1")) == [
        ("studies.s.sweep.vary.tt", "there is no such parameter")
    ]


def test_expressions_have_the_dimension_of_the_parameter():
    length = MECHANISM.model_copy(update={"studies": {"s": _sweep(parameter("t") * parameter("t"))}})
    assert [p.rule for p in problems(length)] == ["a quantity is expected here, in m; this is in m**2"]


def _sweep(value) -> DescribedStudy:
    return DescribedStudy(sweep=SweepStudy(vary={"t": [value]}, ask="f1"))


BOUNDED = {"minimum": 1e-4, "maximum": 5e-3}


@pytest.mark.parametrize(
    ("study", "place", "rule"),
    [
        ({"sweep": {"vary": {"t": [1e-3, 6e-3]}, "ask": "f1"}}, "sweep.vary.t.1", "above the maximum 0.005 m"),
        (
            {"optimize": {"vary": {"t": {"from": 5e-5}}, "minimise": "mass"}},
            "optimize.vary.t.from",
            "below the minimum",
        ),
        ({"optimize": {"vary": {"t": {"to": 5e-5}}, "minimise": "mass"}}, "optimize.vary.t.to", "below the minimum"),
        ({"tolerance": {"vary": {"t": {"measured": [1e-3, 1]}}, "ask": "f1"}}, "tolerance.vary.t.measured.1", "above"),
    ],
)
def test_bounds_of_parameters_are_kept(study, place, rule):
    bounded = MECHANISM.parameters["t"].model_copy(update=BOUNDED)
    studies = {"s": DescribedStudy(**study)}
    mechanism = MECHANISM.model_copy(update={"parameters": {"t": bounded}, "studies": studies})
    assert bounded.value == 1e-3
    first = problems(mechanism)[0]
    assert first.place == f"studies.s.{place}"
    assert rule in first.rule


def test_ends_that_are_left_out_are_the_bounds():
    study = DescribedStudy(optimize=OptimumStudy(vary={"t": Range()}, minimise="mass"))
    rules = [p.rule for p in problems(MECHANISM.model_copy(update={"studies": {"s": study}}))]
    assert rules == [
        "the range has no from, and the parameter no minimum",
        "the range has no to, and the parameter no maximum",
    ]
    bounded = MECHANISM.parameters["t"].model_copy(update=BOUNDED)
    assert not problems(MECHANISM.model_copy(update={"parameters": {"t": bounded}, "studies": {"s": study}}))
    low = OptimumStudy(vary={"t": Range(from_=parameter("t") * 5)}, minimise="mass")
    beyond = {"parameters": {"t": bounded}, "studies": {"s": DescribedStudy(optimize=low)}}
    assert "nothing between 0.005 and 0.005" in str(problems(MECHANISM.model_copy(update=beyond))[0])


def test_ranges_of_computed_ends_are_held_against_their_scale():
    t = parameter("t")
    for own, rule in (
        (Range(from_=-t, to=1.0, scale="log"), "positive ends"),
        (Range(from_=t, to=3 * t, integer=True), "no whole number between"),
        (Range(from_=3 * t, to=t), "there is nothing between"),
    ):
        optimize = OptimumStudy(vary={"t": own}, minimise="mass")
        assert any(rule in told or "whole" in told for _, told in found(optimize=optimize)), rule


def test_a_study_is_told_in_words():
    optimum = OptimumStudy(vary={"t": Range()}, maximise="f1", subject_to="mass <= 1 kg")
    assert DescribedStudy(optimize=optimum).words == "optimize over t: maximise f1, subject to mass <= 1 kg"
    spread = ToleranceStudy(vary={"t": {"normal": 1e-5}}, ask="f1", require="f1 >= 1 Hz")
    assert DescribedStudy(tolerance=spread).words == "tolerance over t: f1, f1 >= 1 Hz"


@pytest.mark.parametrize("value", [1.1e-4, 1e-3, 4.9e-3])
def test_deviations_do_not_narrow_what_a_parameter_may_be(value):
    """The value of a parameter may lie at its bounds, as an optimum's does, whatever its tolerance."""
    bounded = MECHANISM.parameters["t"].model_copy(update={**BOUNDED, "value": value})
    studies = {"s": DescribedStudy(tolerance=ToleranceStudy(vary={"t": Spread(uniform=0.95e-3)}, ask="f1"))}
    assert problems(MECHANISM.model_copy(update={"parameters": {"t": bounded}, "studies": studies})) == []
