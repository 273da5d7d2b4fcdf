"""Studies in model files: values in the units of their parameters, short forms of spreads, and what is refused."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML

from flexura.describe import DescribedStudy, OptimumStudy, Range, Spread, SweepStudy, ToleranceStudy, parameter
from flexura.mechanism import evaluated
from flexura.modelfile import dumps, load, loads, schema
from helpers.modelfile_samples import AMPLIFIER, only_problem_in, problems_in
from helpers.over import over

SCHEMA = Draft202012Validator(schema())

STUDIES = """
studies:
  sizes:
    sweep:
      vary: {t: {from: 0.2 mm, to: 0.6 mm, steps: 5, scale: log}, m: [10 g, 0.02 kg], phi: {from: 0, to: 1, steps: 2}}
      ask: "f1, f2"
  best:
    optimize:
      vary: {L: {from: L/2, to: 20 mm}}
      goals: [{maximise: f1}, {minimise: mass}]
      subject_to: mass <= 0.3 kg
  spread:
    tolerance:
      vary: {t: ± 20 um, L: {normal: 0.05 mm, within: 3, each: false}, m: {measured: [19 g, 21 g]}}
      ask: [f1]
      require: [f1 >= 20 Hz]
"""


def test_values_have_the_units_of_their_parameters():
    studies = loads(AMPLIFIER + STUDIES).studies
    sweep, best, spread = (studies[name].own for name in ("sizes", "best", "spread"))
    assert sweep.vary["t"] == Range(from_=0.2e-3, to=0.6e-3, steps=5, scale="log")
    assert sweep.vary["m"] == (0.01, 0.02)
    assert sweep.ask == ("f1, f2",)
    assert best.vary["L"] == Range(from_=parameter("L") / 2, to=0.02)
    assert best.subject_to == ("mass <= 0.3 kg",)
    assert spread.vary["t"].uniform == pytest.approx((-20e-6, 20e-6), rel=1e-15)
    assert spread.vary["L"] == Spread(normal=0.05e-3, within=3, each=False)
    assert spread.vary["m"].measured == pytest.approx((0.019, 0.021), rel=1e-15)


def test_they_are_written_and_read_again():
    mechanism = loads(AMPLIFIER + STUDIES)
    text = dumps(mechanism)
    assert loads(text) == mechanism
    assert "from: 0.2 mm" in text
    data = [YAML(typ="safe", pure=True).load(own) for own in (AMPLIFIER + STUDIES, text)]
    assert [error.message for own in data for error in SCHEMA.iter_errors(own)] == []


def test_a_file_that_extends_another_takes_a_study_out(tmp_path):
    (tmp_path / "base.yaml").write_text(AMPLIFIER + STUDIES, encoding="utf-8")
    variant = "extends: base.yaml\nstudies:\n  spread: null\n  sizes: {sweep: {ask: mass}}\n"
    (tmp_path / "variant.yaml").write_text(variant, encoding="utf-8")
    studies = load(tmp_path / "variant.yaml").studies
    assert list(studies) == ["sizes", "best"]
    assert studies["sizes"].own.ask == ("mass",)


def spread_of(text: str) -> tuple[float, float]:
    study = f"studies: {{s: {{tolerance: {{vary: {{L: {text}}}, ask: f1}}}}}}\n"
    own = loads(AMPLIFIER + study).studies["s"].own.vary["L"]
    return evaluated(own, {"L": 10e-3}).uniform


@over(
    ("text", "deviations"),
    [
        ("± 0.02 mm", (-2e-5, 2e-5)),
        ("±20um", (-2e-5, 2e-5)),
        ("+- 0.02 mm", (-2e-5, 2e-5)),
        ("+/-0.02 mm", (-2e-5, 2e-5)),
        ("+0.01/-0.03 mm", (-3e-5, 1e-5)),
        ("-0.03/+0.01 mm", (-3e-5, 1e-5)),
        ("+10 um / -0.03 mm", (-3e-5, 1e-5)),
        ("+0.03/+0.01 mm", (1e-5, 3e-5)),
        ("0/-0.03 mm", (-3e-5, 0.0)),
        ("+0.03 mm/0", (0.0, 3e-5)),
        ("± 2 %", (-2e-4, 2e-4)),
        ("+1/-2 %", (-2e-4, 1e-4)),
        ("± L/100", (-1e-4, 1e-4)),
        ("{uniform: [-0.03 mm, 0.01 mm]}", (-3e-5, 1e-5)),
        ("{uniform: 0.02 mm}", (-2e-5, 2e-5)),
        ("{uniform: 2 %}", (-2e-4, 2e-4)),
        ("{uniform: [-2 %, +1 %]}", (-2e-4, 1e-4)),
    ],
)
def test_short_forms_of_spreads(text, deviations):
    assert spread_of(text) == pytest.approx(deviations, rel=1e-14, abs=0)


@over(
    ("study", "place", "rule", "hint"),
    [
        ("{sweep: {vary: {tt: [1 mm]}, ask: f1}}", "sweep.vary.tt", "no such parameter", "did you mean t?"),
        ("{sweep: {vary: {t: [1 kg]}, ask: f1}}", "sweep.vary.t.0", "in m; this is in kg", "1 mm"),
        ("{sweep: {vary: {t: [1]}, ask: f1}}", "sweep.vary.t.0", "carries a unit", ""),
        ("{sweep: {vary: {t: [1 mm]}, ask: f1, seeds: 1}}", "sweep.seeds", "unknown key", "did you mean seed"),
        ("{sweep: {vary: {t: [1 mm]}}}", "sweep.ask", "required, but missing", ""),
        ("{sweep: {vary: {t: 1 mm}, ask: f1}}", "sweep.vary.t", "a list is expected", ""),
        (
            "{optimize: {vary: {L: {form: 1 mm, from: 6 mm, to: 1 m}}, maximise: f1}}",
            "optimize.vary.L.form",
            "unknown key",
            "did you mean from?",
        ),
        (
            "{sweep: {vary: {t: {from: 2 mm, to: 1 mm, steps: 3}}, ask: f1}}",
            *("sweep.vary.t", "from the smaller value to the larger one", ""),
        ),
        (
            "{sweep: {vary: {t: {from: no, to: 1 mm, steps: 2}}, ask: f1}}",
            "sweep.vary.t.from",
            "'no' is not defined",
            "",
        ),
        ("{optimize: {vary: {m: {from: 5 g}}, maximise: f1}}", "optimize.vary.m.from", "below the minimum 0.01 kg", ""),
        ("{tolerance: {vary: {t: 0.02 mm}, ask: f1}}", "tolerance.vary.t", "± 0.02 mm", "normal"),
        (
            "{tolerance: {vary: {t: 0.01/0.03 mm}, ask: f1}}",
            "tolerance.vary.t",
            "each side of a spread has its sign",
            "",
        ),
        ("{tolerance: {vary: {t: ± 2 kg}, ask: f1}}", "tolerance.vary.t", "in m; this is in kg", ""),
        ("{tolerance: {vary: {t: ± 0 %}, ask: f1}}", "tolerance.vary.t", "deviations of zero are none", ""),
        (
            "{tolerance: {vary: {t: {normal: 0 mm}}, ask: f1}}",
            "tolerance.vary.t",
            "per cent of a value that is zero",
            "",
        ),
        ("{tolerance: {vary: {t: ± -2 um}, ask: f1}}", "tolerance.vary.t", "the lower deviation is below", ""),
        ("{tolerance: {vary: {t: {normal: -1 um}}, ask: f1}}", "tolerance.vary.t", "must be positive", ""),
        ("{}", "", "one of sweep, optimize, tolerance", "sweep"),
        ("3", "", "a mapping of keys to values", ""),
    ],
)
def test_what_is_refused_says_where_and_why(study, place, rule, hint):
    problem = only_problem_in(AMPLIFIER + f"studies:\n  s: {study}\n")
    assert problem.place == f"studies.s.{place}".rstrip(".")
    assert rule in problem.rule
    assert hint in problem.hint
    assert problem.where.endswith(f":{len(AMPLIFIER.splitlines()) + 2}")


def test_the_rest_of_a_file_is_checked_beside_a_faulty_study():
    text = AMPLIFIER.replace("section: bar, reference", "section: bra, reference")
    assert text != AMPLIFIER
    found = problems_in(text + "studies: {s: {sweep: {vary: {t: [1 kg]}, ask: f1}}}\n")
    assert [p.place for p in found] == ["substructures.amp.links.bar.section", "studies.s.sweep.vary.t.0"]


lengths = st.floats(1e-6, 1.0)
ends = st.tuples(lengths, lengths).filter(lambda pair: pair[0] < pair[1])
texts = st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1).map(str.strip).filter(len)
choices = st.lists(lengths | st.just(parameter("half") * 2), min_size=1, max_size=4).map(tuple)
spreads = st.one_of(
    st.builds(lambda pair, each: Spread(uniform=(-pair[1], pair[0]), each=each), ends, st.booleans()),
    st.builds(lambda s, n: Spread(normal=s, within=n), lengths, st.none() | st.floats(0.1, 9)),
    st.builds(lambda v: Spread(measured=v), st.lists(lengths, min_size=2, max_size=5).map(tuple)),
)
studies = st.one_of(
    st.builds(
        lambda pair, steps, scale, values, ask: DescribedStudy(
            sweep=SweepStudy(
                vary={"t": Range(from_=pair[0], to=pair[1], steps=steps, scale=scale), "half": values}, ask=ask
            )
        ),
        *(
            ends,
            st.integers(1, 99),
            st.sampled_from(["linear", "log"]),
            choices,
            st.lists(texts, min_size=1).map(tuple),
        ),
    ),
    st.builds(
        lambda pair, aim, held, starts: DescribedStudy(
            optimize=OptimumStudy(vary={"t": Range(from_=pair[0], to=pair[1])}, **aim, subject_to=held, starts=starts)
        ),
        ends,
        texts.map(lambda own: {"maximise": own}) | texts.map(lambda own: {"minimise": own}),
        st.lists(texts).map(tuple),
        st.integers(1, 99),
    ),
    st.builds(
        lambda own, ask, seed: DescribedStudy(tolerance=ToleranceStudy(vary={"t": own}, ask=ask, seed=seed)),
        *(spreads, st.lists(texts, min_size=1).map(tuple), st.integers(0, 2**63 - 1)),
    ),
)
PLAIN = AMPLIFIER.replace("t: 0.3 mm", "t: {value: 0.3 mm}")


@settings(deadline=None)
@given(st.dictionaries(st.sampled_from(["a", "b", "null", "on"]), studies, max_size=3))
def test_studies_from_python_survive_a_file(found):
    mechanism = loads(PLAIN).replaced({"studies": found})
    text = dumps(mechanism)
    assert loads(text).studies == found
    assert not list(SCHEMA.iter_errors(YAML(typ="safe", pure=True).load(text)))
