"""Sequential linear programming on problems with known optima: far from what is required, at kinks, within what is to
be kept."""

from __future__ import annotations

import numpy as np
import pytest

from flexura.deadline import OutOfTime
from flexura.errors import SolverError
from flexura.full_order import plan_of
from flexura.modelfile import loads
from flexura.study.optimum.landscape import Landscape, Sample
from flexura.study.optimum.linear import Steps
from flexura.study.optimum.optimize import climbed
from flexura.study.optimum.rows import AskedDesigns, BothDesigns, Point, wording
from flexura.study.questions import formula, questions
from study.optimum.test_optimum_search import Smooth, Variables, box, rosen_suzuki, row


def steps(land: Landscape, logs: tuple[int, ...] = (), kept: tuple[int, ...] = ()) -> Steps:
    numbers = np.arange(len(land.limits))
    return Steps(land, np.isin(numbers, logs), np.isin(numbers, kept))


@pytest.mark.parametrize("start", [0.0, 0.5, 0.95])
def test_published_optimum(start):
    found = steps(rosen_suzuki(44.0)).climb(np.full(4, start), 1e-7)
    assert found.converged and found.best is not None and found.best.violation < 1e-5
    assert 44 * found.best.goal == pytest.approx(44, abs=1e-3)


def cantilever() -> Landscape:
    """The lightest beam of square section b and length a with b^4 / a^3 >= 1 and a >= 1: both are 1."""
    goal = row(lambda b, a: -a * b**2, lambda b, a: [-2 * a * b, -(b**2)])
    stiff = row(lambda b, a: b**4 / a**3 - 1, lambda b, a: [4 * b**3 / a**3, -3 * b**4 / a**4])
    long = row(lambda b, a: a - 1, lambda b, a: [0.0, 1.0])
    return Landscape(Variables(), box((0.01, 4.0), (0.2, 1.0)), goal, [stiff, long])


def test_what_is_missed_by_orders_of_magnitude_is_met_in_a_few_steps():
    land = cantilever()
    start = land.box.positions(np.array([0.02, 1.0]))  # a stiffness of 1.6e-7 of what is asked
    found = steps(land, logs=(0,)).climb(start, 1e-6)
    assert found.is_feasible and found.best is not None and found.evaluations < 40
    assert land.box.values(found.best.z) == pytest.approx([1, 1], abs=2e-3)


def test_the_least_of_many_is_raised_at_its_kink():
    """min(x, 2 - x) is largest at 1, where a step along either slope alone leads down."""
    goal = row(lambda x, y: y, lambda x, y: [0.0, 1.0])
    limits = [row(lambda x, y: x - y, lambda x, y: [1.0, -1.0]), row(lambda x, y: 2 - x - y, lambda x, y: [-1.0, -1.0])]
    land = Landscape(Variables(), box((0.0, 2.0), (0.0, 2.0)), goal, limits)
    found = steps(land).climb(land.box.positions(np.array([0.1, 0.0])), 1e-9)
    assert found.best is not None and land.box.values(found.best.z) == pytest.approx([1, 1], abs=1e-6)


def test_what_is_kept_is_never_left():
    """x + y <= 1.5 is kept while x >= 2, which cannot be, is missed as little as can be: by 0.5."""
    goal = row(lambda x, y: -y, lambda x, y: [0.0, -1.0])
    wanted = row(lambda x, y: x / 2 - 1, lambda x, y: [0.5, 0.0])
    kept = row(lambda x, y: 1.5 - x - y, lambda x, y: [-1.0, -1.0])
    land = Landscape(Variables(), box((0.0, 3.0), (0.0, 1.0)), goal, [wanted, kept])
    seen = list[float]()
    at = land.at
    land.at = lambda z: seen.append(float(at(z).margins[1])) or at(z)  # type: ignore[method-assign]
    found = steps(land, logs=(0,), kept=(1,)).climb(land.box.positions(np.array([0.1, 0.5])), 1e-9)
    assert min(seen) > -1e-9 and len(seen) > 2
    assert found.best is not None and land.box.values(found.best.z) == pytest.approx([1.5, 0], abs=1e-6)


class Broken(Variables):
    """Designs of which those with x > 1 have no answer."""

    def point(self, x: np.ndarray) -> Point:
        if x[0] > 1:
            raise SolverError("it buckles")
        return super().point(x)


def test_designs_beyond_that_have_no_answer_are_told():
    land = Landscape(Broken(), box((0.0, 2.0)), row(lambda x: x, lambda x: [1.0]))
    found = steps(land).climb(np.array([0.0]), 1e-9)
    assert found.best is not None and land.box.values(found.best.z)[0] == pytest.approx(1.0, abs=5e-3)
    assert not found.converged and "no answer" in found.message
    assert steps(land).climb(np.array([0.9]), 1e-9).best is None


def test_a_search_that_is_cut_short_has_the_best_so_far():
    land = Landscape(Variables(), box((0.0, 2.0)), row(lambda x: x, lambda x: [1.0]))
    at, left = land.at, [1, 2]

    def timed(z: np.ndarray) -> Sample:
        if not left:
            raise OutOfTime(1.0)
        left.pop()
        return at(z)

    land.at = timed  # type: ignore[method-assign]
    found = steps(land).climb(np.array([0.0]), 1e-9)
    assert found.best is not None and found.best.z[0] > 0 and not found.in_time


def test_rows_are_as_their_helper_says():
    """Slopes of the problems above against differences."""
    land = cantilever()
    for own in [land.goal, *land.limits]:
        assert isinstance(own.function, Smooth)
        x, h = np.array([0.7, 0.6]), 1e-6
        slope = [(own.values(x + h * e) - own.values(x - h * e)) / (2 * h) for e in np.eye(2)]
        assert own.function.slope(x) == pytest.approx(slope, rel=1e-6)


GUIDE = """
parameters:
  length: {value: 30 mm, minimum: 20 mm, maximum: 60 mm}
  thickness: {value: 0.5 mm, minimum: 0.2 mm, maximum: 1 mm}
  added: {value: 0.1 kg, minimum: 0.01 kg, maximum: 1 kg}
nodes: {foot: [0, 0, 0], head: [0, 0, length]}
flexures:
  leaf:
    nodes: [foot, head]
    material: spring-steel
    reference: x
    profile: {type: leaf, width: 10 mm, thickness: thickness}
bodies:
  stage: {centre: [0, 0, length], mass: added, inertia: [1 kg*mm^2, 1 kg*mm^2, 1 kg*mm^2], carries: [head]}
ground: {foot: clamped}
"""


def test_what_is_asked_besides_of_another_mechanism_is_kept():
    """The stiffest leaf, which leads to its limits, is held back by one twice as wide that must not be stiffer than
    3 (E I/L^3 with twice the width): the stiffness of the first is then half of that."""
    own, other = loads(GUIDE), loads(GUIDE.replace("width: 10 mm", "width: 20 mm"))
    asked = "stiffness(stage.x)"
    found, in_time = climbed(
        own,
        maximise=asked,
        subject_to=["mass <= 0.2 kg"],
        besides=(other, [f"{asked} <= 4000 N/m"]),
        accuracy=1e-6,
        seconds=60,
    )
    alone, _ = climbed(own, maximise=asked, subject_to=[], accuracy=1e-6, seconds=60)
    (held,), (free,) = (questions(own, asked).values(each).value[0] for each in (found, alone))
    (most,) = questions(other, asked).values(found).value[0]
    assert in_time and most == pytest.approx(4000, rel=1e-3)
    assert held == pytest.approx(most / 2, rel=0.02) and free > 5 * held  # wide strips are a little stiffer


def test_slopes_of_two_mechanisms_are_those_of_each():
    without = GUIDE.replace("  added: {value: 0.1 kg, minimum: 0.01 kg, maximum: 1 kg}\n", "")
    own, other = plan_of(loads(GUIDE)), plan_of(loads(without.replace("mass: added", "mass: 1 kg")))
    one = AskedDesigns(wording(own, [formula(own, "f1")]), ("length", "thickness", "added"), {})
    two = AskedDesigns(wording(other, [formula(other, "stiffness(stage.x)")]), ("thickness", "length"), {})
    both, x = BothDesigns(one, two), np.array([30e-3, 0.5e-3, 0.2])
    point, h = both.point(x), 1e-6
    count = one.wording.count
    assert len(point.value) == count + two.wording.count
    for p in range(3):
        step = h * x[p] * np.eye(3)[p]
        slope = (both.point(x + step).value - both.point(x - step).value) / (2 * h * x[p])
        assert point.slope[:, p] == pytest.approx(slope, rel=1e-4, abs=1e-6 * np.abs(slope).max())
    assert point.slope[count:, 2] == pytest.approx(0.0)
