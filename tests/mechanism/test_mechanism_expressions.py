"""Expressions: grammar, values over designs, dimensions, and text that reads back."""

from __future__ import annotations

import ast
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexura.errors import ExpressionError, ModelError
from flexura.expressions import Expression, parameter, parts_of
from flexura.expressions.dimension import AREA, INERTIA, LENGTH, MASS, NUMBER, PRESSURE, Dimension
from flexura.expressions.tree import Binary, Call, Name, Negative, Number, Tree
from flexura.mechanism import Circle, Parameter
from helpers.over import over

VALUES = {"x": 2.0, "y": 3.0, "z": -0.5}


@over(
    ("text", "value"),
    [
        ("x + y*z", 0.5),
        ("x - y - z", -0.5),
        ("x/y/z", 2 / 3 / -0.5),
        ("-x^2", -4.0),
        ("(-x)^2", 4.0),
        ("2^y^2", 512.0),
        ("x^-1", 0.5),
        ("x**y", 8.0),
        ("--x", 2.0),
        ("+x", 2.0),
        ("1.5e1*x", 30.0),
        (".5*x", 1.0),
        ("sqrt(x*8)", 4.0),
        ("max(x, y) - min(x, y)", 1.0),
        ("atan2(x, x)*4/pi", 1.0),
        ("abs(z) + sin(0) + cos(0)", 1.5),
    ],
)
def test_values(text, value):
    assert Expression.parse(text).evaluate(VALUES) == pytest.approx(value, rel=1e-15)


NAMES = st.sampled_from([Name(n) for n in VALUES])
NUMBERS = st.floats(0, 1e6).map(Number)


def larger(inner: st.SearchStrategy[Tree]) -> st.SearchStrategy[Tree]:
    return st.one_of(
        st.builds(Negative, inner),
        st.builds(Binary, st.sampled_from(["+", "-", "*", "/"]), inner, inner),
        st.builds(lambda b, e: Binary("^", b, Number(float(e))), inner, st.integers(0, 3)),
        st.builds(lambda a: Call("abs", (a,)), inner),
        st.builds(lambda a, b: Call("max", (a, b)), inner, inner),
    )


TREES = st.recursive(NAMES | NUMBERS, larger, max_leaves=12)


@given(TREES)
def test_text_reads_back_as_the_same_tree(tree):
    assert Expression.parse(str(Expression(tree))).tree == tree


@given(TREES)
def test_values_are_those_of_python(tree):
    """Independent reading: Python's own parser, with its own precedence."""
    text = str(Expression(tree)).replace("^", "**")
    read = ast.parse(text, mode="eval")
    for node in ast.walk(read):
        if isinstance(node, ast.Constant):
            node.value = float(node.value)  # -0 is 0 among whole numbers
    code = compile(read, "expression", "eval")
    with np.errstate(all="ignore"):
        scope = {n: np.float64(v) for n, v in VALUES.items()} | {"abs": np.abs, "max": np.maximum}
        try:
            expected = float(eval(code, {"__builtins__": {}}, scope))  # noqa: S307
        except (ZeroDivisionError, OverflowError):
            return
        got = Expression(tree).evaluate(VALUES)
    np.testing.assert_allclose(got, expected, rtol=1e-12)


def test_text_is_not_taken_for_a_tree():
    with pytest.raises(ExpressionError, match=r"Expression.parse\('t'\) reads one"):
        Expression("t")  # type: ignore[arg-type]


def test_values_broadcast_over_designs():
    designs = np.linspace(1, 2, 5)
    got = Expression.parse("max(x, 1.5)*y + sqrt(x)").evaluate({"x": designs, "y": 2.0})
    np.testing.assert_array_equal(got, np.maximum(designs, 1.5) * 2 + np.sqrt(designs))


def test_python_builds_the_trees_that_text_reads_as():
    x, y = parameter("x"), parameter("y")
    built = [2 * x + y / 3 - 1, -(x**-2) * (1 - y), x - -1, (-1 + x) ** 2, x * np.float64(0.5)]
    for expression in built:
        assert Expression.parse(str(expression)) == expression


@over(
    ("text", "rule"),
    [
        ("", "too early"),
        ("x +", "too early"),
        ("(x", "not closed"),
        ("x)", "not expected"),
        ("x y", "not expected"),
        ("f(x)", "not a function"),
        ("sqrt", "is a function"),
        ("max(x)", "takes 2"),
        ("x.y", "cannot stand"),
        ("x[0]", "not expected"),
        ("x == y", "cannot stand"),
        ("x^17", "at most 16"),
        ("x^-17", "at most 16"),
        ("1e999", "finite"),
        ("3 mm", "carry no unit"),
        ("(" * 61 + "x" + ")" * 61, "nests at most"),
        ("+".join("x" * 250), "in a row"),
        ("+".join("x" * 400), "at most 300"),
        (" " * 30_000, "characters"),
    ],
)
def test_what_is_no_expression(text, rule):
    with pytest.raises(ExpressionError, match=rule):
        Expression.parse(text)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 10**400, "text", None, True, [1], 1j])
def test_what_cannot_stand_in_an_expression(value):
    with pytest.raises(ExpressionError):
        parameter("x") * value


def test_what_cannot_be_written_is_refused_by_the_parts():
    total = parameter("x")
    for _ in range(400):
        total = total + 1
    deep = parameter("x")
    for _ in range(100):
        deep = 1 / (1 + deep)
    for expression in (total, deep, parameter("a b"), parameter("sqrt"), parameter("℘")):
        with pytest.raises(ModelError):
            Circle(diameter=expression)


def test_an_expression_without_parameters_is_a_number():
    assert Circle(diameter="3*pi/pi").diameter == 3.0
    with pytest.raises(ModelError, match="finite"):
        Circle(diameter="1/0")
    with pytest.raises(ModelError, match="positive"):
        Circle(diameter="1-1")


DIMENSIONS = {"L": LENGTH, "M": MASS, "n": NUMBER, "open": None}


@over(
    ("text", "dimension"),
    [
        ("L", LENGTH),
        ("L*L", AREA),
        ("M*L^2", INERTIA),
        ("sqrt(L*L)", LENGTH),
        ("L^-2*M", INERTIA.times(LENGTH.power(4), -1)),
        ("L + 0", LENGTH),
        ("max(L, 0)", LENGTH),
        ("atan2(L, L)", NUMBER),
        ("sin(L/L)", NUMBER),
        ("n^n", NUMBER),
        ("pi*L", LENGTH),
        ("-abs(L)", LENGTH),
        ("L*open", None),
    ],
)
def test_dimensions(text, dimension):
    expression = Expression.parse(text, lambda number, _: (float(number), LENGTH))
    assert expression.dimension(DIMENSIONS) == dimension


def in_millimetres(number, unit):
    powers = {"mm": 1, "mm^2": 2, "mm^-1": -1}
    return float(number) * 1e-3 ** powers[unit], LENGTH.power(powers[unit])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("9 mm^2", 9e-6),
        ("9 mm**2", 9e-6),
        ("9 [mm]^2", 9e-6),
        ("(9 mm)^2", 81e-6),
        ("3 mm^-1", 3e3),
        ("2*9 mm^2/3 mm", 6e-3),
        ("L*4 mm - 9 mm^2", -1e-6),
        ("2^3*1 mm", 8e-3),
    ],
)
def test_a_power_behind_a_unit_is_the_units(text, value):
    expression = Expression.parse(text, in_millimetres)
    assert expression.evaluate({"L": 2e-3}) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("200 mm/s", 0.2),
        ("2 mm*mm/s*L", 2e-6 * 2e-3),
        ("2 mm^2/s^-1", 2e-6),
        ("2 mm*L/s", 4e-6 / 3),  # behind a name that is no unit, s is a name as well
        ("2 [mm]/s", 2e-3 / 3),
        ("2 mm/2/s", 1e-3 / 3),
    ],
)
def test_units_of_several(text, value):
    def read(number, unit):
        powers = {"mm/s": 1e-3, "mm*mm/s": 1e-6, "mm^2/s^-1": 1e-6, "mm": 1e-3}
        return float(number) * powers[unit], NUMBER

    expression = Expression.parse(text, read, lambda name: name in ("mm", "s"))
    assert expression.evaluate({"L": 2e-3, "s": 3.0}) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("text", ["2 mm^L", "2 mm^2.5", "2 mm^2^2", "2 mm^2 mm", "2 [N/mm]^2", "2 mm^(2)", "2 mm^"])
def test_powers_of_units_that_cannot_be_told(text):
    with pytest.raises(ExpressionError, match=r"\(9 "):
        Expression.parse(text, in_millimetres)


@pytest.mark.parametrize("text", ["L + M", "L + 1", "sin(L)", "2^L", "L^n", "max(L, M)", "atan2(L, M)", "L - 1 [m]*L"])
def test_dimensions_that_clash(text):
    expression = Expression.parse(text, lambda number, _: (float(number), LENGTH))
    with pytest.raises(ExpressionError):
        expression.dimension(DIMENSIONS)


def test_bare_literals_of_python_leave_the_dimension_open():
    L = parameter("L")
    assert (2 * L).dimension(DIMENSIONS) is None
    assert (L + 0.1).dimension(DIMENSIONS) == LENGTH


@pytest.mark.parametrize(("own", "said"), [(PRESSURE, "Pa"), (PRESSURE.times(LENGTH), "N/m"), (INERTIA, "kg*m**2")])
def test_units_are_derived_ones_where_there_are_some(own, said):
    assert own.unit() == said


@pytest.mark.parametrize("dimension", [NUMBER, LENGTH, PRESSURE, INERTIA, AREA.power(Fraction(1, 4))])
def test_units_name_their_dimensions(dimension):
    assert Dimension.of_unit(dimension.unit() or "1") == dimension


@pytest.mark.parametrize(
    ("unit", "dimension"),
    [
        ("N/m", PRESSURE.times(LENGTH)),
        ("Pa", PRESSURE),
        ("kg*m**-1*s**-2", PRESSURE),
        ("kg*m^2", INERTIA),
        ("rad", NUMBER),
    ],
)
def test_coherent_units(unit, dimension):
    assert Dimension.of_unit(unit) == dimension
    assert Parameter(value=1.0, unit=unit).dimension == dimension


@pytest.mark.parametrize("unit", ["mm", "GPa", "m**", "m**(1/0)", "m*", "m**99", "m m", "2"])
def test_units_that_are_not_coherent(unit):
    assert Dimension.of_unit(unit) is None
    with pytest.raises(ModelError, match="coherent SI unit"):
        Parameter(value=1.0, unit=unit)


@pytest.mark.parametrize(
    ("text", "largest", "least"),
    [
        ("max(x, y)", 2, 1),
        ("min(x, y)", 1, 2),
        ("max(x, max(y, z))", 3, 1),
        ("z - min(x, y)", 2, 1),
        ("-2*max(x, y)", 1, 2),
        ("3 - max(x, y)/(1 - 3)", 2, 1),
        ("max(x, y) + max(y, z) - min(x, z)", 8, 1),
        ("max(x, y)*z", 1, 1),
        ("1/max(x, y)", 1, 1),
        ("max(x, y)*0", 1, 1),
        ("x + y", 1, 1),
        (" + ".join(["max(x, y)"] * 20), 4, 1),
    ],
)
def test_an_expression_is_the_largest_or_the_least_of_its_parts(text, largest, least):
    """Whatever the values, and with as many parts as can be told apart by hand."""
    own = Expression.parse(text)
    values = dict(zip("xyz", np.random.default_rng(3).normal(size=(3, 50)), strict=True))
    for function, count in (("max", largest), ("min", least)):
        parts = parts_of(own.tree, function)
        assert len(parts) == count
        choose = np.max if function == "max" else np.min
        found = choose([np.broadcast_to(Expression(part).evaluate(values), 50) for part in parts], axis=0)
        np.testing.assert_allclose(found, own.evaluate(values), rtol=1e-13, atol=1e-13)
