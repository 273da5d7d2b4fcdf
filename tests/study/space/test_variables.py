"""What varies: ranges and lists from text and from Python, and what cannot be."""

import numpy as np
import pytest

import flexura as fx
from flexura.errors import OptionError
from flexura.study.space import Space, Variable, variables
from helpers.over import over


@pytest.fixture(scope="module")
def guide(tmp_path_factory):
    whole = fx.load("examples/guide/guide.yaml")
    own = fx.describe.Parameter
    more = {"leaves": own(value=4.0, unit="1"), "twice": own(value=2 * fx.describe.parameter("width"))}
    return whole.replaced({"parameters": {**whole.parameters, **more}})


def grid(mechanism, vary):
    space = Space(variables(mechanism, vary))
    return space.designs(0, space.size)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("thickness=0.2mm:0.6mm:3", [2e-4, 4e-4, 6e-4]),
        ("thickness = 0.2 : 0.6 mm : 3", [2e-4, 4e-4, 6e-4]),
        ("thickness=0.3mm, 400 um", [3e-4, 4e-4]),
        ("thickness=0.3,0.4mm", [3e-4, 4e-4]),
        ("thickness=2*0.1mm:0.6mm:2", [2e-4, 6e-4]),
        ("thickness=max(0.1 mm, 0.2 mm),0.4mm", [2e-4, 4e-4]),
        ("thickness=0.1mm:1.6mm:5:log", [1e-4, 2e-4, 4e-4, 8e-4, 16e-4]),
        ("thickness=0.4mm", [4e-4]),
        ("leaves=2:5:integer", [2, 3, 4, 5]),
        ("leaves=2:10:3:integer", [2, 6, 10]),
        ("leaves=-2:2:5", [-2, -1, 0, 1, 2]),
    ],
)
def test_text(guide, text, values):
    ((_, found),) = grid(guide, text).items()
    assert found == pytest.approx(values, rel=1e-12, abs=1e-15)
    assert (found[0], found[-1]) == (values[0], values[-1])


@pytest.mark.parametrize(
    ("given", "values"),
    [((2e-4, 6e-4, 3), [2e-4, 4e-4, 6e-4]), ([3e-4, 2e-4], [3e-4, 2e-4]), (np.array([3e-4]), [3e-4]), (3e-4, [3e-4])],
)
def test_python(guide, given, values):
    assert grid(guide, {"thickness": given})["thickness"] == pytest.approx(values, rel=1e-12)


def test_a_unit_is_that_of_the_parameter(guide):
    assert [own.unit for own in variables(guide, {"thickness": (2e-4, 6e-4), "leaves": [1, 2]})] == ["m", "1"]


@over(
    ("vary", "said"),
    [
        ("thickness", "NAME=LOW:HIGH"),
        ("thickness=", "NAME=LOW:HIGH"),
        ("thickness=0.2mm:", "a value is missing"),
        ("thickness=0.2mm,,0.3mm", "a value is missing"),
        ("thicknes=1mm:2mm:3", "did you mean 'thickness'"),
        ({"thicknes": [1.0]}, "did you mean 'thickness'"),
        ("thickness=0.6mm:0.2mm:4", "0.0006 to 0.0002 m runs backwards"),
        ("thickness=0.2mm:0.2mm:4", "is empty"),
        ("thickness=0.2mm:0.6mm:1", "at least 2 values"),
        ("thickness=0.2mm:0.6mm:-3", "at least 2 values"),
        ("thickness=0.2mm:0.6mm:2.5", "no count"),
        ("thickness=0.2mm:0.6mm:log:linear", "no count"),
        ("thickness=0.2mm:0.6kg:3", "in kg"),
        ("thickness=0.2:0.6:3", "carries a unit"),
        ("thickness=0.01mm:0.6mm:3", "below the minimum of the parameter, 0.0001 m"),
        ("thickness=0.2mm:3mm:3", "above the maximum of the parameter, 0.002 m"),
        ("thickness=0.2mm,inf mm", "thickness: 'inf mm': "),
        ("width=0:10mm:3:log", "above zero"),
        ("leaves=2.5:4:integer", "integers"),
        ("leaves=2:5:3:integer", "not all integers"),
        ("leaves=1e16:2e16:integer", "2^53"),
        ("twice=1mm:2mm:3", "follows from width"),
        ({"thickness": (1e-4, 2e-4, 2.5)}, "a count"),
        ({"thickness": (1e-4,)}, "a tuple is a range"),
        ({"thickness": (1e-4, float("nan"))}, "finite"),
        ({"width": (-1e308, 1e308)}, "too wide"),
        ({"thickness": [1e-4, float("nan")]}, "value 2 is not"),
        ({"thickness": []}, "at least one"),
        ({"thickness": [[1e-4]]}, "one axis"),
        ({"thickness": {"a": 1}}, "list of numbers"),
        ({"thickness": None}, "list of numbers"),
        ({}, "nothing varies"),
        ([], "nothing varies"),
        (3, "given by name"),
        ([3], "given by name"),
        (["thickness=1mm,2mm", "thickness=1mm,2mm"], "give it once"),
    ],
)
def test_what_cannot_vary(guide, vary, said):
    with pytest.raises(OptionError) as error:
        variables(guide, vary)
    assert said in str(error.value)


def test_what_is_fixed_cannot_vary(guide):
    with pytest.raises(OptionError, match="has a value already"):
        variables(guide, "thickness=1mm,2mm", fixed=("thickness",))


def test_choices_and_integers_are_taken_equally_often():
    u = (np.arange(1200) + 0.5) / 1200
    assert np.unique(Variable("n", 2, 5, "integer").at(u), return_counts=True)[1].tolist() == [300] * 4
    assert np.unique(Variable.of("n", [3.0, 1.0, 2.0]).at(u), return_counts=True)[1].tolist() == [400] * 3


def test_a_log_range_has_its_median_at_the_geometric_mean():
    assert Variable("k", 1e-3, 1e5, scale="log").at(np.array([0.5]))[0] == pytest.approx(10.0, rel=1e-12)
