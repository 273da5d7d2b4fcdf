"""Sensors by effective independence against exhaustive search, determinants, and what is plain to see."""

import itertools
import json

import numpy as np
import pytest

import flexura as fx
import helpers.correlated as c
from flexura.errors import OptionError
from flexura.mechanism import with_rigid_roots
from flexura.testing.virtual.sensor_placement import (
    candidate_names,
    effective_independence,
    exchanged,
    log_determinant,
    place_sensors,
)

RNG = np.random.default_rng(3)


def best_of_all(shapes, k):
    """Largest ln det of all sets of k rows."""
    return max(log_determinant(shapes[list(own)]) for own in itertools.combinations(range(len(shapes)), k))


@pytest.mark.parametrize("seed", range(8))
def test_against_exhaustive_search_of_random_shapes(seed):
    """With exchanges the best of all 495 sets of 8 out of 12 is met within 2 % of information per mode."""
    shapes = np.random.default_rng(seed).normal(size=(12, 4))
    own, _ = exchanged(shapes, effective_independence(shapes, 8))
    best = best_of_all(shapes, 8)
    assert log_determinant(shapes[own]) <= best + 1e-9
    assert np.exp((log_determinant(shapes[own]) - best) / 4) > 0.98


@pytest.mark.parametrize("seed", range(4))
def test_exchanges_only_improve_and_end_at_a_local_best(seed):
    shapes = np.random.default_rng(seed).normal(size=(15, 3))
    start = np.arange(5)
    own, count = exchanged(shapes, start)
    assert count > 0
    value = log_determinant(shapes[own])
    assert value > log_determinant(shapes[start])
    for i, j in itertools.product(range(5), np.setdiff1d(np.arange(15), own)):
        other = own.copy()
        other[i] = j
        assert log_determinant(shapes[other]) <= value + 1e-8


def test_each_step_leaves_out_the_least_determinant():
    """The first row left out is that without which the determinant of all others is largest."""
    shapes = RNG.normal(size=(9, 3))
    own = effective_independence(shapes, 8)
    (lost,) = np.setdiff1d(np.arange(9), own)
    values = [log_determinant(np.delete(shapes, k, axis=0)) for k in range(9)]
    assert lost == int(np.argmax(values))


def test_against_exhaustive_search_on_a_mechanism():
    """Four of the fifteen displacements of a bar for three modes."""
    bar = c.cantilever(section=fx.describe.Rectangle(width=3e-3, thickness=2e-3))
    full, _, vectors = c.modes_of(bar, 3)
    names = [f"n{k}.{dof}" for k in range(1, 6) for dof in ("tx", "ty", "tz")]
    rows = np.array([full.dof_names.index(name) for name in names])
    shapes = vectors[rows] / np.linalg.norm(vectors[rows], axis=0)
    found = place_sensors(full, sensors=4, n=3, candidates=names)
    own = [names.index(name) for name in found.sensors]
    assert log_determinant(shapes[own]) == pytest.approx(best_of_all(shapes, 4), abs=1e-9)
    assert found.information == pytest.approx(
        np.exp((log_determinant(shapes[own]) - log_determinant(shapes)) / 3), rel=1e-6
    )
    assert found.independence.sum() == pytest.approx(3.0)
    assert not any(name.endswith("tx") for name in found.sensors)


def test_the_first_mode_of_a_cantilever_is_seen_best_at_its_end():
    bar = c.cantilever(section=fx.describe.Rectangle(width=3e-3, thickness=2e-3))
    assert place_sensors(bar, sensors=1, n=1, candidates=["*.t*"]).sensors == ("n5.tz",)


def test_one_sensor_a_place_and_no_basis_of_repeated_modes():
    """Joined nodes are one place, and a repeated frequency has two modes in any basis: one sensor in each direction."""
    names = place_sensors(c.cantilever(), sensors=2, n=2).sensors
    assert sorted(names) == ["n5.ty", "n5.tz"]
    rpr = fx.load(f"{c.EXAMPLES}/rpr/rpr.yaml")
    found = place_sensors(rpr, sensors=8, n=6)
    assert len({(*np.round(x, 9), *d) for x, d in zip(found.positions, found.directions, strict=True)}) == 8
    assert found.worst_mac < 0.2
    assert found.condition < 5


def test_candidates_by_name_pattern_and_default():
    sensors = {
        "tip": fx.describe.MotionSensor(type="acceleration", nodes=("n5",), direction=(0, 1, 0)),
        "mid": fx.describe.MotionSensor(type="velocity", nodes=("n3",), direction=(0, 0, 1)),
        "slope": fx.describe.MotionSensor(type="rotation", nodes=("n5",), direction=(0, 1, 0)),
    }
    full = fx.assemble(c.cantilever(sensors=sensors))
    assert set(candidate_names(full)) == {"tip", "mid", "slope"}
    assert candidate_names(full, ["n5.t*", "tip"]) == ("n5.tx", "n5.ty", "n5.tz", "tip")
    assert len(candidate_names(full, ["bar*.t*"])) == 5 * 3
    found = place_sensors(full, sensors=3, n=2)
    assert set(found.sensors) == {"tip", "mid", "slope"}
    assert found.turns.sum() == 1
    assert any("50 mm" in note for note in found.notes)
    plain = fx.assemble(c.cantilever())
    assert len(candidate_names(plain)) == 5 * 3


def test_plain_data():
    found = place_sensors(c.cantilever(), sensors=3, n=2)
    data = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert [s["name"] for s in data["sensors"]] == list(found.sensors)


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"sensors": 1, "n": 2}, "at least 2 sensors"),
        ({"sensors": 1, "n": 0}, "at least one mode"),
        ({"sensors": 4, "n": 2, "candidates": ["n5.t*"]}, "only 2 candidates"),
        ({"sensors": 2, "n": 2, "candidates": ["n5.tx", "n4.tx"]}, "only 0 candidates"),
        ({"sensors": 2, "n": 3, "candidates": ["n5.tz", "n4.tz", "n3.tz"]}, "at least 3 sensors"),
        ({"sensors": 2, "n": 2, "candidates": ["nothing*"]}, "no sensor or DOF matches"),
        ({"sensors": 2, "n": 2, "candidates": ["n5.sideways", "n5.tz"]}, "neither"),
        ({"sensors": 2, "n": 2, "candidates": ["n9.tz", "n5.tz"]}, "no node"),
        ({"sensors": 2, "n": 500}, "at least 500"),
    ],
)
def test_what_is_refused(how, words):
    with pytest.raises(OptionError, match=words):
        place_sensors(c.cantilever(), **how)


def test_modes_that_no_candidate_sees_are_named():
    bar = c.cantilever(section=fx.describe.Rectangle(width=3e-3, thickness=2e-3))
    with pytest.raises(OptionError, match="moves in mode 2:"):
        place_sensors(bar, sensors=3, n=3, candidates=["n3.tz", "n4.tz", "n5.tz"])


def test_modes_that_all_candidates_confuse_are_named():
    """Sensors at 45 degrees read bending in both planes alike."""
    sensors = {
        f"s{k}": fx.describe.MotionSensor(type="displacement", nodes=(f"n{k}",), direction=(0, 1, 1)) for k in (3, 4, 5)
    }
    bar = c.cantilever(sensors=sensors, section=fx.describe.Rectangle(width=3e-3, thickness=2.999999e-3))
    bar = with_rigid_roots(bar)  # with an elastic root beside its block, bending in the two planes differs
    with pytest.raises(OptionError, match="distinguish modes 1, 2"):
        place_sensors(bar, sensors=2, n=2)
