"""The search on problems with known optima: multipliers, eigenvalues that coalesce, designs that fail, integers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
import pytest
from scipy.optimize import nnls

from flexura.errors import SolverError
from flexura.study.optimum.climb import Method, best_of, climb
from flexura.study.optimum.discrete import Mixed, chosen_alone, chosen_with_others
from flexura.study.optimum.front import front, not_dominated
from flexura.study.optimum.landscape import Box, Landscape, stationarity
from flexura.study.optimum.rows import Frequency, Point, Row

METHODS: tuple[Method, ...] = ("slsqp", "trust-constr")


class Variables:
    """Designs whose quantities are the variables themselves."""

    def values(self, x: np.ndarray) -> tuple[np.ndarray, Sequence[str]]:
        return x, [""] * len(x)

    def point(self, x: np.ndarray) -> Point:
        return Point(x, np.eye(len(x)))


class Smooth:
    def __init__(self, value: Callable[..., object], slope: Callable[..., Sequence[float]]) -> None:
        self._value, self._slope = value, slope

    def value(self, quantities: np.ndarray) -> np.ndarray:
        return np.asarray(self._value(*np.moveaxis(quantities, -1, 0)))

    def slope(self, quantities: np.ndarray) -> np.ndarray:
        return np.array(self._slope(*quantities), dtype=float)


def row(value: Callable[..., object], slope: Callable[..., Sequence[float]], scale: float = 1.0) -> Row:
    return Row(Smooth(value, slope), scale)


def box(*ends: tuple[float, float]) -> Box:
    low, high = np.array(ends, dtype=float).T
    return Box(tuple(f"x{k}" for k in range(len(ends))), low, high)


def rosen_suzuki(scale: float = 1.0) -> Landscape:
    """Problem 43 of Hock and Schittkowski 1981, "Test examples for nonlinear programming codes": f = -44 at (0, 1, 2,
    -1); the multipliers (1, 0, 2) follow from the gradients there by hand."""
    goal = row(
        lambda a, b, c, d: -(a**2 + b**2 + 2 * c**2 + d**2 - 5 * a - 5 * b - 21 * c + 7 * d),
        lambda a, b, c, d: [5 - 2 * a, 5 - 2 * b, 21 - 4 * c, -7 - 2 * d],
        scale,
    )
    limits = [
        row(
            lambda a, b, c, d: 8 - a**2 - b**2 - c**2 - d**2 - a + b - c + d,
            lambda a, b, c, d: [-2 * a - 1, -2 * b + 1, -2 * c - 1, -2 * d + 1],
            8.0,
        ),
        row(
            lambda a, b, c, d: 10 - a**2 - 2 * b**2 - c**2 - 2 * d**2 + a + d,
            lambda a, b, c, d: [-2 * a + 1, -4 * b, -2 * c, -4 * d + 1],
            10.0,
        ),
        row(
            lambda a, b, c, d: 5 - 2 * a**2 - b**2 - c**2 - 2 * a + b + d,
            lambda a, b, c, d: [-4 * a - 2, -2 * b + 1, -2 * c, 1.0],
            5.0,
        ),
    ]
    return Landscape(Variables(), box(*[(-3, 4)] * 4), goal, limits)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("start", [0.0, 0.5, 0.95])
def test_published_optimum_and_its_multipliers(method, start):
    land = rosen_suzuki(44.0)
    found = climb(land, np.full(4, start), method)
    assert found.is_feasible and found.best is not None
    assert land.box.values(found.best.z) == pytest.approx([0, 1, 2, -1], abs=2e-4)
    assert 44 * found.best.goal == pytest.approx(44, abs=1e-5)
    own = stationarity(land, found.best)
    assert own.active == (0, 2)
    assert own.limits * 44 / np.array([8, 10, 5]) == pytest.approx([1, 0, 2], abs=1e-3)
    assert own.residual < 1e-4


def test_the_residual_is_that_of_another_code():
    """Gradients by differences in the test, multipliers by SciPy's non-negative least squares, at a design that is no
    optimum and at one that is."""
    land = rosen_suzuki()
    rows = [land.goal, *land.limits]
    for x in (np.array([0.0, 1.0, 2.0, -1.0]), np.array([0.1, 1.0, 1.9, -1.0])):
        h = 1e-6
        slopes = [[(r.values(x + h * e) - r.values(x - h * e)) / (2 * h) * 7 for e in np.eye(4)] for r in rows]
        goal, limits = np.array(slopes[0]), np.array(slopes[1:])
        near = [k for k, r in enumerate(land.limits) if r.values(x) <= 1e-4]
        _, left = nnls(limits[near].T, -goal) if near else (None, np.linalg.norm(goal))
        sample = land.at(land.box.positions(x))
        assert stationarity(land, sample).residual == pytest.approx(left / np.linalg.norm(goal), abs=1e-6)


def test_bounds_have_multipliers():
    """x + 2 y - (x - 1)^2 between 0 and 3: y at 3 with the multiplier 2, x free at 3/2."""
    land = Landscape(
        Variables(), box((0, 3), (0, 3)), row(lambda x, y: x + 2 * y - (x - 1) ** 2, lambda x, y: [1 - 2 * (x - 1), 2])
    )
    found = climb(land, np.array([0.2, 0.1]))
    assert found.best is not None
    own = stationarity(land, found.best)
    assert land.box.values(found.best.z) == pytest.approx([1.5, 3])
    assert own.high / 3 == pytest.approx([0, 2], abs=1e-6)
    assert own.low == pytest.approx([0, 0], abs=1e-9) and own.residual < 1e-6


def test_what_cannot_be_met_ends_where_it_is_missed_least():
    """x + 2 y >= 3.5 and x - y >= 1/2 in the unit square: both are missed by as much at x = 1, 2.5 - 2 y = y - 1/2."""
    land = Landscape(
        Variables(),
        box((0, 1), (0, 1)),
        row(lambda x, y: -x, lambda x, y: [-1, 0]),
        [
            row(lambda x, y: x + 2 * y - 3.5, lambda x, y: [1, 2]),
            row(lambda x, y: x - y - 0.5, lambda x, y: [1, -1]),
        ],
    )
    found = climb(land, np.array([0.3, 0.6]))
    assert not found.is_feasible and found.best is not None
    assert found.best.z == pytest.approx([1, 1], abs=1e-6)
    assert found.best.violation == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_start_that_meets_no_limit_finds_those_that_do(method):
    """A thin feasible crescent between two circles; the farthest point along x + y is on the outer one."""
    limits = [
        row(lambda x, y: 1 - x**2 - y**2, lambda x, y: [-2 * x, -2 * y]),
        row(lambda x, y: (x - 0.1) ** 2 + y**2 - 1, lambda x, y: [2 * (x - 0.1), 2 * y]),
    ]
    land = Landscape(Variables(), box((-2, 2), (-2, 2)), row(lambda x, y: x + y, lambda x, y: [1, 1]), limits)
    found = climb(land, np.array([0.95, 0.95]), method)
    assert found.best is not None and found.is_feasible
    x, y = land.box.values(found.best.z)
    # circles meet where x = 1/20; beyond it lies nothing feasible
    assert (x, y) == pytest.approx((0.05, np.sqrt(1 - 0.05**2)), abs=2e-4)


class Failing(Variables):
    """Designs with x0 > 0.6 have no answer."""

    def point(self, x: np.ndarray) -> Point:
        if x[0] > 0.6:
            raise SolverError("no equilibrium")
        return super().point(x)


def test_designs_that_fail_are_kept_off_and_counted():
    goal = row(lambda x, y: x - (y - 0.3) ** 2, lambda x, y: [1, -2 * (y - 0.3)])
    land = Landscape(Failing(), box((0, 1), (0, 1)), goal)
    found = climb(land, np.array([0.2, 0.2]))
    assert found.best is not None and not found.converged
    assert found.best.z == pytest.approx([0.6, 0.3], abs=1e-3)
    assert "no answer" in found.message and land.failures["no equilibrium"] > 0
    nowhere = climb(land, np.array([0.9, 0.2]))
    assert nowhere.best is None and not nowhere.is_feasible


def test_an_optimum_short_of_failing_designs_is_reached():
    """The first step goes where designs fail, the optimum does not lie there."""
    goal = row(lambda x, y: -((x - 0.55) ** 2) - (y - 0.3) ** 4, lambda x, y: [-2 * (x - 0.55), -4 * (y - 0.3) ** 3])
    land = Landscape(Failing(), box((0, 1), (0, 1)), goal, [row(lambda x, y: y - 0.3, lambda x, y: [0, 1])])
    found = climb(land, np.array([0.2, 0.9]))
    assert found.best is not None and land.box.values(found.best.z)[0] == pytest.approx(0.55, abs=1e-4)


class Eigenvalues:
    """Eigenvalues of A(x) = diag(a - x, b + x) coupled by y, plus a share of x and y: both meet at the optimum."""

    def __init__(self, tilt: tuple[float, float]) -> None:
        self.tilt = np.array(tilt)
        self.slopes = np.stack([np.diag([-1.0, 1.0]), np.array([[0.0, 1.0], [1.0, 0.0]])], axis=-1)
        self.slopes = self.slopes + np.eye(2)[..., None] * self.tilt

    def matrix(self, x: np.ndarray) -> np.ndarray:
        return np.diag([3.0, 1.0]) + self.slopes @ x

    def values(self, x: np.ndarray) -> tuple[np.ndarray, Sequence[str]]:
        return np.linalg.eigvalsh(np.array([self.matrix(own) for own in x])), [""] * len(x)

    def point(self, x: np.ndarray) -> Point:
        values, V = np.linalg.eigh(self.matrix(x))
        space = np.einsum("ia,ijp,jb->abp", V, self.slopes, V)
        slope = np.einsum("aap->ap", space)
        return Point(values, slope, ((0, 1),), (space,)) if np.ptp(values) < 1e-6 else Point(values, slope)


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.3, 0.2), (0.0, 0.9)])
def test_eigenvalues_that_coalesce_are_bounded_together(tilt):
    """The lower eigenvalue 2 - sqrt((1 - x)^2 + y^2) + tilt.x is a cone with its top at (1, 0), whichever way it leans
    by less than 1; both eigenvalues are 2 + tilt there."""
    land = Landscape(
        Eigenvalues(tilt),
        box((-1, 3), (-2, 2)),
        Row(Smooth(lambda low, high: low, lambda low, high: [1, 0]), 1.0, (Frequency((0, 1), 0),)),
    )
    found = best_of(land, [np.array([0.2, 0.8]), np.array([0.9, 0.1])], "slsqp")
    assert found is not None
    assert land.box.values(found.best.z) == pytest.approx([1, 0], abs=1e-5)
    assert found.best.goal == pytest.approx(2 + tilt[0], abs=1e-5)
    assert found.stationarity.coalesced and found.stationarity.residual < 0.02


def test_a_saddle_is_left():
    """The start is stationary, and the least along y: 1 - x^2 + y^2 - y^4 is greatest at y^2 = 1/2."""
    goal = row(lambda x, y: 1 - x**2 + y**2 - y**4, lambda x, y: [-2 * x, 2 * y - 4 * y**3])
    land = Landscape(Variables(), box((-1, 1), (-1, 1)), goal)
    found = best_of(land, [np.array([0.5, 0.5])], "slsqp")
    assert found is not None
    assert abs(land.box.values(found.best.z)[1]) == pytest.approx(np.sqrt(0.5), abs=1e-4)
    assert found.curvature <= 0


def peaks() -> Landscape:
    """Two hills over a line, the lower one where the first start lies."""
    x0 = 0.15, 0.85
    goal = row(
        lambda x: np.exp(-(((x - x0[0]) / 0.1) ** 2)) + 2 * np.exp(-(((x - x0[1]) / 0.1) ** 2)),
        lambda x: [-200 * sum(h * (x - c) * np.exp(-(((x - c) / 0.1) ** 2)) for h, c in zip((1, 2), x0, strict=True))],
    )
    return Landscape(Variables(), box((0, 1)), goal)


def test_starts_beside_a_better_one_are_passed_over():
    """Of sixteen starts most lie beside a better one; each hill is climbed all the same."""
    starts = [np.array([own]) for own in (0.1, *np.linspace(0.02, 0.98, 15))]
    found = best_of(peaks(), starts, "slsqp")
    assert found is not None
    ends = [own.best.z[0] for own in found.climbs if own.best is not None]
    assert ends[0] == pytest.approx(0.15, abs=1e-4) and max(ends) == pytest.approx(0.85, abs=1e-4)
    assert found.best.z == pytest.approx([0.85], abs=1e-4)
    assert 2 <= len(found.climbs) < 10 and found.passed == 16 - len(found.climbs)


def test_all_starts_are_searched_from_until_one_meets_the_limits():
    """Nothing below 1/2 of x + y is allowed, and no design meets that: no start is passed over."""
    land = Landscape(
        Variables(),
        box((0, 1), (0, 1)),
        row(lambda x, y: x, lambda x, y: [1, 0]),
        [row(lambda x, y: -1 - x - y, lambda x, y: [-1, -1])],
    )
    found = best_of(land, [np.array([own, own]) for own in np.linspace(0, 1, 5)], "slsqp")
    assert found is not None and not found.is_feasible
    assert len(found.climbs) == 5 and found.passed == 0


class Certified(Variables):
    """Values of many designs are off by as much as they may be, those with slopes are right."""

    def values(self, x: np.ndarray) -> tuple[np.ndarray, Sequence[str]]:
        return np.stack([x[:, 0], np.where(x[:, 0] % 2 == 0, 4e-4, -4e-4)], axis=1), [""] * len(x)


def test_ties_are_told_by_values_of_full_order():
    """An even x seems better than it is, or to meet a limit that it misses, by less than what is certified."""
    goal = row(lambda x, y: -1e-4 * (x - 7) ** 2 + y, lambda x, y: [-2e-4 * (x - 7), 1])
    mixed = Mixed(Landscape(Certified(), box((0, 9), (0, 1)), goal), np.array([0, 1]), (np.arange(10.0), np.zeros(1)))
    found = chosen_alone(mixed, np.array([[0.0, 0.0]]))
    assert found is not None and tuple(found.x) == (7, 0)
    limited = Landscape(
        Certified(),
        box((0, 9), (0, 1)),
        row(lambda x, y: x, lambda x, y: [1, 0]),
        [row(lambda x, y: (7.999 - x) / 10 + y, lambda x, y: [-0.1, 1])],
    )
    found = chosen_alone(Mixed(limited, mixed.at, mixed.levels), np.array([[0.0, 0.0]]))
    assert found is not None and tuple(found.x) == (7, 0)


def bowl(x0: float, y0: float, coupling: float) -> Row:
    return row(
        lambda x, y: -((x - x0) ** 2 + (y - y0) ** 2 + coupling * (x - x0) * (y - y0)),
        lambda x, y: [-2 * (x - x0) - coupling * (y - y0), -2 * (y - y0) - coupling * (x - x0)],
    )


@pytest.mark.parametrize("size", [(40, 10), (400, 100)])
def test_integers_alone(size):
    """Few combinations are all worked out; of many the neighbours of each start's best."""
    land = Landscape(Variables(), box((0, size[0]), (0, size[1])), bowl(7.6, 3.4, 1.9))
    levels = tuple(np.arange(n + 1.0) for n in size)
    found = chosen_alone(Mixed(land, np.array([0, 1]), levels), np.array([[5.0, 1.0], [20.0, 9.0]]))
    best = max(product(range(31), range(11)), key=lambda own: float(land.goal.values(np.array(own, dtype=float))))
    assert found is not None and tuple(found.x) == best
    assert found.is_every == (size == (40, 10))


@pytest.mark.parametrize("last", [9, 40])
def test_an_integer_with_a_continuous_variable(last):
    """The best y to an n is by hand y0 - c (n - x0) / 2, and n the better of the integers about x0 = 7.6."""
    land = Landscape(Variables(), box((0, last), (-20, 20)), bowl(7.6, 3.4, 1.0))
    mixed = Mixed(land, np.array([0]), (np.arange(last + 1.0),))
    found = chosen_with_others(mixed, np.array([[2.0, 0.0], [9.0, 5.0]]), "slsqp")
    assert found is not None and found.x == pytest.approx([8, 3.4 - 0.2], abs=1e-6)
    assert found.is_every == (last == 9)


def test_the_front_of_two_distances_is_the_line_between():
    goals = [
        row(lambda x, y: -(x**2 + y**2), lambda x, y: [-2 * x, -2 * y]),
        row(lambda x, y: -((x - 1) ** 2 + (y - 1) ** 2), lambda x, y: [-2 * (x - 1), -2 * (y - 1)]),
    ]
    land = Landscape(Variables(), box((-1, 2), (-1, 2)), goals[0])
    nothing = Mixed(land, np.array([], dtype=np.intp), ())
    found = front(nothing, goals, 9, 3, "slsqp")
    assert len(found.designs) >= 8
    assert found.designs[:, 0] == pytest.approx(found.designs[:, 1], abs=1e-3)
    assert np.sqrt(-found.goals).sum(axis=1) == pytest.approx(np.sqrt(2), abs=1e-5)
    assert np.diff(found.goals[:, 0]).min() >= 0 and np.ptp(found.goals[:, 0]) == pytest.approx(2, abs=1e-3)
    again = front(Mixed(Landscape(Variables(), land.box, goals[0]), nothing.at, ()), goals, 9, 3, "slsqp")
    assert np.array_equal(again.designs, found.designs)


def test_not_dominated():
    values = np.array([[0, 3], [1, 2], [1, 1], [2, 0], [2, 0], [-1, 3]], dtype=float)
    assert not_dominated(values).tolist() == [0, 1, 3, 4]


def test_positions_and_values_are_inverse():
    own = box((1e-9, 1.0), (-2.0, 5.0), (0.3e-3, 0.5e-3))
    assert own.by_logarithm.tolist() == [True, False, False]
    z = np.random.default_rng(1).random((50, 3))
    assert own.positions(own.values(z)) == pytest.approx(z, abs=1e-12)
    assert np.array_equal(own.values(np.ones(3)), own.high) and np.array_equal(own.values(np.zeros(3)), own.low)
    h = 1e-6
    differences = (own.values(z[0] + h) - own.values(z[0] - h)) / (2 * h)
    assert own.rates(z[0]) == pytest.approx(differences, rel=1e-6)
