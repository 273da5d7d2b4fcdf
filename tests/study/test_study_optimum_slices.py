"""Designs around an optimum: asked as anywhere, or interpolated within what is told."""

import re

import numpy as np
import pytest

import flexura as fx
from flexura.study.optimum import slice_of
from flexura.study.optimum.slices import Axis, Fit
from helpers.shell import GUIDE

SAID = re.compile(r"(.*) is interpolated between \d+ designs, ([\d.e-]+) % off")
STRESS = "stress <= 400 MPa at carriage.x = 2 mm"


@pytest.fixture(scope="module")
def best():
    return fx.optimize(fx.load(GUIDE), starts=1)


@pytest.fixture(scope="module")
def around(best):
    return slice_of(best)


def test_the_optimum_is_one_of_the_designs_around_it_and_at_the_edge_of_its_limit(best, around):
    assert [own.name for own in around.along] == ["thickness", "length"]
    place = tuple(
        int(np.flatnonzero(x == best.optimum[v.name])[0]) for x, v in zip(around.x, around.along, strict=True)
    )
    assert around.goal[place] == pytest.approx(best.value, rel=1e-6)
    assert abs(around.margins[STRESS][place]) < 1e-3
    assert around.goal.shape == around.margins[STRESS].shape == tuple(map(len, around.x))


def test_what_is_interpolated_is_as_near_as_is_told(best, around):
    said = {own[1]: float(own[2]) / 100 for note in around.notes if (own := re.search(SAID, note))}
    assert list(said) == ["f1", "stress at carriage.x = 2 mm"]
    of_goal, off = said.values()
    rng = np.random.default_rng(3)
    i, j = (rng.integers(0, len(x), 6) for x in around.x)
    designs = {"thickness": around.x[0][i], "length": around.x[1][j]}
    found = fx.questions(best.mechanism, "f1, stress at carriage.x = 2 mm").values(designs).value
    assert of_goal <= 1e-5
    np.testing.assert_allclose(around.goal[i, j], found[:, 0], rtol=5 * of_goal)
    stress = 400e6 * (1 - around.margins[STRESS][i, j])
    assert 0 < off < 2e-3
    np.testing.assert_allclose(stress, found[:, 1], rtol=5 * off)


def test_of_many_variables_those_two_are_shown_that_matter_most():
    ranges = {"width": (15e-3, 25e-3), "thickness": (0.4e-3, 0.6e-3), "length": (50e-3, 70e-3)}
    found = fx.optimize(fx.load(GUIDE), vary=ranges, maximise="f1", subject_to="f1 <= 60 Hz", starts=1)
    own = slice_of(found)
    assert [v.name for v in own.along] == ["thickness", "length"]
    assert [v.name for v in own.held] == ["width"]
    width = np.full(len(own.x[0]), found.optimum["width"])
    designs = {"thickness": own.x[0], "length": np.full(len(width), own.x[1][4]), "width": width}
    values = fx.questions(found.mechanism, "f1").values(designs).value[:, 0]
    np.testing.assert_allclose(own.goal[:, 4], values, rtol=1e-5)


AXES = [Axis.of(1.0, 16.0), Axis.of(-1.0, 1.0)]


def fit(function, counts):
    """A fit of a function (x, y) to values at nodes."""
    parts = [0.5 - 0.5 * np.cos(np.pi * np.arange(n) / (n - 1)) for n in counts]
    nodes = [axis.values(part) for axis, part in zip(AXES, parts, strict=True)]
    return Fit(AXES, nodes, function(*np.meshgrid(*nodes, indexing="ij")))


def test_powers_and_exponentials_are_fitted_by_few_nodes():
    def function(x, y):
        return 3 * x**-2.5 * np.exp(0.7 * y)

    own = fit(function, (2, 3))
    x, y = np.linspace(1, 16, 9), np.linspace(-1, 1, 7)
    np.testing.assert_allclose(own.at([x, y]), function(x[:, None], y), rtol=1e-12)
    assert own.off([x[:7], y], function(x[:7], y)) < 1e-12


def test_how_far_a_fit_is_off_is_relative_to_the_answers():
    own = fit(lambda x, y: 0 * x + y, (2, 2))
    probes = [np.array([2.0, 3.0]), np.array([0.5, -0.5])]
    assert own.off(probes, np.array([0.5, -0.4])) == pytest.approx(0.2)


def test_beside_nodes_without_an_answer_there_is_none_and_lines_are_straight():
    own = fit(lambda x, y: np.where((x > 10) & (y > 0), np.nan, np.log(x) + np.abs(y)), (3, 5))
    x, y = np.array([2.0, 8.0]), np.array([-0.9, -0.1, 0.9])
    nodes = np.sort(own.nodes[1])
    expected = np.log(x)[:, None] + np.interp(y, nodes, np.abs(nodes))
    expected[1, 2] = np.nan
    np.testing.assert_allclose(own.at([x, y], is_smooth=True), expected, rtol=1e-12)
    assert own.off([x, y[:2]], np.array([1.0, 1.0])) == np.inf
