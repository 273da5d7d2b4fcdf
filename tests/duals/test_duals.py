"""Slopes of numbers with slopes are those of central differences and of 40 digits; none is lost or made up."""

import mpmath
import numpy as np
import pytest

from flexura.duals import Dual
from helpers.over import over

P, STEP = 3, 1e-6


def numbers(shapes, seed=0):
    rng = np.random.default_rng(seed)
    return [rng.random(s) + 0.5 for s in shapes], [rng.standard_normal((P, *s)) for s in shapes]


def zeros(shape, *like):
    return np.zeros(shape, like=next((x for x in like if isinstance(x, Dual)), np.zeros(1)))


def agrees(function, *shapes):
    xs, slopes = numbers(shapes)
    for fixed in [frozenset(), *({k} for k in range(len(shapes)) if len(shapes) > 1)]:
        free = [k not in fixed for k in range(len(shapes))]
        found = function(*(Dual(x, s) if f else x for x, s, f in zip(xs, slopes, free, strict=True)))
        np.testing.assert_allclose(found.value, function(*xs), rtol=1e-14)
        assert found.slope.shape == (P, *np.shape(found.value))
        for p in range(P):
            up, down = (
                function(*(x + sign * STEP * s[p] * f for x, s, f in zip(xs, slopes, free, strict=True)))
                for sign in (1, -1)
            )
            np.testing.assert_allclose(found.slope[p], (up - down) / (2 * STEP), rtol=2e-7, atol=2e-8)


@over("shapes", [((2, 3), (3,)), ((3,), (4, 2, 3)), ((), (2,)), ((2, 1), (1, 3)), ((2,), ())])
@over(
    "function",
    [np.add, np.subtract, np.multiply, np.divide, np.power, np.maximum, np.minimum, np.arctan2, np.hypot],
)
def test_functions_of_two_broadcast(function, shapes):
    agrees(function, *shapes)


ELEMENTARY = "sqrt exp expm1 log log1p sin cos tan asin acos atan sinh cosh tanh atanh"


@over("name", ELEMENTARY.split())
def test_functions_of_one_to_their_last_digits(name):
    x = np.array([0.1, 0.45, 0.8])
    numpy_name = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atanh": "arctanh"}.get(name, name)
    found = getattr(np, numpy_name)(Dual(x, np.array([[1.0, 1.0, -2.0]])))
    with mpmath.workdps(40):
        exact = [float(mpmath.diff(getattr(mpmath, name), mpmath.mpf(float(at)))) for at in x]
    np.testing.assert_allclose(found.slope[0], np.array(exact) * [1, 1, -2], rtol=1e-14)


@over(
    ("function", "shapes"),
    [
        (np.matmul, ((4, 2, 3), (3, 2))),
        (np.matmul, ((2, 3), (4, 3, 2))),
        (np.matmul, ((2, 3), (3,))),
        (np.matmul, ((3,), (5, 3, 2))),
        (np.matmul, ((3,), (3,))),
        (lambda a, b: np.einsum("...nij,...j->...ni", a, b), ((5, 2, 3, 3), (5, 3))),
        (lambda a, b: np.linalg.solve(a + 3 * np.eye(3), b), ((2, 3, 3), (2, 3, 1))),
        (lambda a, b: np.linalg.solve(a + 3 * np.eye(3), b), ((3, 3), (3,))),
        (lambda a: np.linalg.inv(a + 3 * np.eye(3)), ((2, 3, 3),)),
        (np.linalg.det, ((2, 3, 3),)),
        (np.linalg.norm, ((3,),)),
        (lambda a: np.linalg.norm(a, axis=0, keepdims=True), ((2, 3),)),
        (np.cross, ((2, 3), (3,))),
        (np.outer, ((2,), (3,))),
    ],
)
def test_products_and_solutions(function, shapes):
    agrees(function, *shapes)


@over("axis", [None, 0, 1, -1])
@over("function", [np.sum, np.mean, np.max, np.min, np.prod, np.cumsum, np.cumprod])
def test_functions_along_axes(function, axis):
    agrees(lambda a: function(a, axis=axis), (3, 4))


@over(
    ("function", "shapes"),
    [
        (lambda a, b: np.where(np.array([True, False, True]), a, b), ((2, 3), ())),
        (lambda a, b: np.concatenate([a, b], axis=-1), ((2, 3), (2, 1))),
        (lambda a, b: np.stack([a, b, a], axis=1), ((2, 3), (2, 3))),
        (lambda a, b: np.hstack([a, b]), ((3,), (2,))),
        (lambda a, b: np.vstack([a, b]), ((3,), (3,))),
        (lambda a, b: np.column_stack([a, b]), ((3,), (3,))),
        (lambda a: np.moveaxis(a, -1, 0), ((2, 3, 4),)),
        (lambda a: np.swapaxes(a, -1, -2), ((2, 3, 4),)),
        (lambda a: a.T, ((2, 3),)),
        (lambda a: np.tile(a, (2, 1)), ((3,),)),
        (lambda a: np.repeat(a, 2, axis=0), ((3, 2),)),
        (lambda a: np.diff(a, axis=-1), ((3, 4),)),
        (np.diag, ((3,),)),
        (np.diag, ((3, 3),)),
        (lambda a: a.reshape(2, -1), ((4, 3),)),
        (lambda a: np.broadcast_to(a, (4, 3)), ((3,),)),
        (lambda a: a.sum(axis=(0, -1), keepdims=True), ((2, 3, 4),)),
    ],
)
def test_what_moves_and_joins(function, shapes):
    agrees(function, *shapes)


@pytest.mark.parametrize(
    "at",
    [
        (..., 0),
        (..., [0, 2]),
        (..., [0, 2], [1, 1]),
        ([0, 2], ..., [1, 1]),
        (slice(None), 1, [0, 2]),
        (..., [1, 2], slice(0, 2)),
        (None, ..., 0),
        (0,),
        0,
        (..., np.array([[0, 1], [1, 2]]), 0, slice(None)),
        np.array([True, False, True]),
    ],
)
def test_indexing_and_assignment_are_those_of_arrays(at):
    agrees(lambda a: a[at], (3, 3, 3))

    def assigned(a, b):
        out = zeros((3, 3, 3), a, b)
        out[...] = a
        out[at] = b
        out[at] *= 2
        np.add.at(out, at, b)
        return out

    agrees(assigned, (3, 3, 3), ())


def test_views_share_memory():
    x = Dual(np.arange(6.0), np.zeros((1, 6)))
    x[1:5].reshape(2, 2)[...] = Dual(np.ones((2, 2)), np.full((1, 2, 2), 7.0))
    np.testing.assert_array_equal(x.slope[0], [0, 7, 7, 7, 7, 0])
    y = x + 0.0
    y[0] = 3.0
    assert x.value[0] == 0.0


def test_second_slopes_are_slopes_of_slopes():
    at = Dual(Dual(np.array(3.0), np.array([1.0])), Dual(np.array([1.0]), np.zeros((1, 1))))
    found = np.sqrt(at) * at**3 + np.sin(at) / at
    with mpmath.workdps(40):
        exact = [float(mpmath.diff(lambda x: mpmath.sqrt(x) * x**3 + mpmath.sin(x) / x, 3, n)) for n in range(3)]
    np.testing.assert_allclose([found.value.value, found.slope.value[0], found.slope.slope[0, 0]], exact, rtol=1e-13)


def test_products_of_entries_have_second_slopes():
    x = Dual(Dual(np.array([2.0, 3.0, 5.0]), np.eye(3)), Dual(np.eye(3), np.zeros((3, 3, 3))))
    found = np.prod(x)
    assert found.value.value == 30.0
    np.testing.assert_array_equal(found.slope.value, [15.0, 10.0, 6.0])
    np.testing.assert_array_equal(found.slope.slope, [[0, 5, 3], [5, 0, 2], [3, 2, 0]])


def test_no_slope_where_there_is_none():
    moving, still = Dual(np.zeros(1), np.ones((1, 1))), Dual(np.zeros(1), np.zeros((1, 1)))
    for function in (np.abs, np.sqrt, lambda x: np.maximum(x, 0.0), lambda x: np.minimum(0.0, x)):
        assert np.isnan(function(moving).slope).all()
        assert (function(still).slope == 0).all()
    for function in (np.arctan2, np.hypot):
        assert np.isnan(function(moving, 0.0).slope).all()
    assert np.isnan(np.linalg.norm(moving, axis=0).slope).all()
    ahead = Dual(np.array([1.0, 1.0, 0.0]), np.array([[1.0, 1.0, 5.0], [1.0, 2.0, 5.0]]))
    np.testing.assert_array_equal(ahead.max().slope, [1.0, np.nan])
    np.testing.assert_array_equal((still**2).slope, [[0.0]])
    assert ((moving**0).slope == 0).all()


@pytest.mark.parametrize("apart", [0.0, 1e-16, -3e-14])
def test_numbers_equal_but_for_round_off_have_a_slope_where_all_of_theirs_agree(apart):
    slope = np.array([[1.0, 1.0 + 1e-12, 5.0], [1.0, 2.0, 5.0], [0.0, 1e-20, 5.0], [3.0, 3.0, 5.0]])
    tied = Dual(np.array([4.0, 4.0 * (1 + apart), 0.0]), slope)
    expected = [1.0, np.nan, 0.0, 3.0]
    np.testing.assert_allclose(tied.max().slope, expected, rtol=1e-11, atol=1e-19)
    np.testing.assert_allclose((-tied).min().slope, np.negative(expected), rtol=1e-11, atol=1e-19)
    np.testing.assert_allclose(np.maximum(tied[:1], tied[1:2]).slope[[0, 1, 3], 0], [1.0, np.nan, 3.0], rtol=1e-11)


def test_numbers_that_differ_by_more_than_round_off_are_not_tied():
    near = Dual(np.array([4.0, 4.0 * (1 + 1e-9)]), np.array([[1.0, 2.0]]))
    np.testing.assert_array_equal(near.max().slope, [2.0])
    np.testing.assert_array_equal(near.min().slope, [1.0])
    np.testing.assert_array_equal(np.maximum(Dual(np.array([1e-30]), np.ones((1, 1))), 0.0).slope, [[1.0]])


@pytest.mark.parametrize(
    "lost",
    [
        lambda x: float(x[0]),
        np.asarray,
        np.sort,
        np.linalg.svd,
        lambda x: np.array([x[0], x[1]]),
        lambda x: np.zeros(3).__setitem__(0, x[0]),
        lambda x: np.add(x, 1.0, out=np.zeros(3)),
        lambda x: np.einsum("i,i", x, x),
        lambda x: Dual(x.value, x.slope[:, :2]),
    ],
)
def test_slopes_are_never_lost_without_a_word(lost):
    with pytest.raises((TypeError, ValueError)):
        lost(Dual(np.ones(3), np.ones((2, 3))))


def test_values_alone_are_compared():
    x = Dual(np.array([1.0, -2.0]), np.ones((2, 2)))
    assert isinstance(x > 0, np.ndarray) and (x > 0).tolist() == [True, False]
    assert np.sign(x).tolist() == [1.0, -1.0] and np.isfinite(x).all() and np.argmax(x) == 0
    assert "2 parameters" in repr(x) and [float(k.value) for k in x] == [1.0, -2.0]
