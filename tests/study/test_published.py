"""Mechanisms beside the numbers that their descriptions have from others."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.errors import LimitError, ModelError, OptionError

GUIDE = "examples/guide/guide.yaml"
BEAMS = "24 * 206 GPa * width * thickness^3 / 12 / length^3"
"""Two clamped-guided leaves, Euler-Bernoulli."""


def guide(*listed):
    own = tuple(fx.describe.PublishedValue(**{"source": "A", **one}) for one in listed)
    return fx.load(GUIDE).replaced({"corrections": "none", "published": own})


def test_a_closed_form_over_parameters_follows_them():
    model = guide({"ask": "stiffness(carriage.x)", "value": BEAMS, "within": 0.03})
    for thickness in (0.2e-3, 0.5e-3):
        found = fx.published(model, {"thickness": thickness})
        assert found.is_met.all() and not found.warnings
        assert found.published == pytest.approx([24 * 206e9 * 20e-3 * thickness**3 / 12 / 60e-3**3], rel=1e-12)


def test_a_name_of_what_is_asked_and_of_a_parameter_is_told():
    text = Path(GUIDE).read_text(encoding="utf-8").partition("studies:")[0]
    own = text.replace("  thickness: {value", "  mass: {value").replace(": thickness}", ": mass}")
    found = fx.published(fx.loads(own + "published: [{ask: mass, value: 0.4 kg, source: A}]\n"))
    assert found.units == ("kg",) and "that is parameter(mass)" in found.notes[0]
    assert found.to_dict()["notes"] == list(found.notes)


def test_what_differs_by_more_than_it_may_is_a_warning():
    found = fx.published(guide({"ask": "f1", "value": "50 Hz"}, {"ask": "2 * f1", "value": "100 Hz", "within": 0.5}))
    assert found.is_met.tolist() == [False, True]
    assert found.difference[0] == pytest.approx(found.value[0] / 50 - 1, rel=1e-14)
    (warning,) = found.warnings
    assert warning.place == "f1" and "more than 1 %, from A" in warning.text
    with pytest.raises(LimitError):
        found.raise_warnings()


def test_numbers_have_the_model_error_of_the_verb_that_gives_them():
    found = fx.published(guide({"ask": "f1", "value": "50 Hz"}, {"ask": "reach(carriage.x)", "value": "2 mm"}))
    assert found.model_error[0] == pytest.approx(fx.modes(guide(), n=1).model_error[0], abs=1e-5)
    assert found.model_error[1] is None and "no evidence" in found.model_error_reason[1]
    assert found.to_dict()["model_error"][0] == list(found.model_error[0])


def test_what_has_no_answer_is_a_warning():
    found = fx.published(guide({"ask": "f1 at carriage.x = 500 mm", "value": "50 Hz"}))
    assert np.isnan(found.value[0]) and not found.is_met[0]
    assert len(found.warnings) == 1 and "no equilibrium" in found.warnings[0].text


@pytest.mark.parametrize(
    ("own", "words"),
    [
        ({"ask": "f1", "value": "50 mm"}, "is in Hz"),
        ({"ask": "f1", "value": "0 Hz"}, "zero"),
        ({"ask": "50 Hz", "value": "50 Hz"}, "is no quantity"),
        ({"ask": "stiffness(nothing.x)", "value": "1 N/m"}, "nothing"),
        ({"ask": "f1", "value": "50 Hz +"}, "50 Hz"),
    ],
)
def test_numbers_that_say_nothing_are_refused(own, words):
    with pytest.raises(OptionError, match=words):
        fx.published(guide(own))


def test_descriptions_without_numbers_are_told_how_they_are_written():
    with pytest.raises(OptionError, match="published:"):
        fx.published(fx.load(GUIDE))
    with pytest.raises(ModelError, match="source"):
        guide({"ask": "f1", "value": "50 Hz", "source": " "})
    with pytest.raises(ModelError, match="within"):
        guide({"ask": "f1", "value": "50 Hz", "within": 0})


def test_the_shell_prints_what_python_returns(tmp_path):
    file = tmp_path / "own.yaml"
    fx.save(guide({"ask": "f1", "value": "50 Hz"}), file)
    shell = CliRunner()
    told = shell.invoke(app, ["published", str(file), "--json"]).stdout
    assert json.loads(told) == fx.published(fx.load(file)).to_dict()
    assert "differs by" in shell.invoke(app, ["published", str(file)]).stdout
    strict = shell.invoke(app, ["published", str(file), "--strict", "--out", str(tmp_path / "own.csv")])
    assert isinstance(strict.exception, LimitError) and not (tmp_path / "own.csv").exists()
