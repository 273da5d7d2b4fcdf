"""Units and quantities as text."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexura.errors import ExpressionError
from flexura.units import format_number, format_quantity, parse, parse_quantity, parse_unit
from helpers.over import over

FLOATS = st.floats(allow_nan=False, allow_infinity=False)


@over(
    ("text", "factor", "exponents"),
    [
        ("mm", "1/1000", (1, 0, 0)),
        ("µm", "1/1000000", (1, 0, 0)),
        ("um", "1/1000000", (1, 0, 0)),
        ("in", "127/5000", (1, 0, 0)),
        ("GPa", "1000000000", (-1, 1, -2)),
        ("N*m/rad", "1", (2, 1, -2)),
        ("N/mm", "1000", (0, 1, -2)),
        ("kg/m^3", "1", (-3, 1, 0)),
        ("g/cm**3", "1000", (-3, 1, 0)),
        ("kg/(m*s^2)", "1", (-1, 1, -2)),
        ("mm^4", "1/1000000000000", (4, 0, 0)),
        ("1/s", "1", (0, 0, -1)),
        ("m^-2", "1", (-2, 0, 0)),
        ("m^(-1/2)", "1", (Fraction(-1, 2), 0, 0)),
        ("t", "1000", (0, 1, 0)),
        ("%", "1/100", (0, 0, 0)),
        ("rad", "1", (0, 0, 0)),
        (" kg * m ^ 2 ", "1", (2, 1, 0)),
    ],
)
def test_units(text, factor, exponents):
    assert parse_unit(text) == (Fraction(factor), (*exponents, 0, 0))


def test_degrees_are_those_of_the_standard_library():
    for degrees in (1, 7, 12.5, 30, 45, 60, 90, 180, 359):
        assert parse_quantity(f"{degrees} deg") == (math.radians(degrees), (0, 0, 0, 0, 0))
        assert parse_quantity(f"{degrees}°")[0] == math.radians(degrees)


@over(
    ("text", "rule", "hint"),
    [
        ("degC", "has an offset", "K"),
        ("°C", "has an offset", "K"),
        ("dB", "not a unit", ""),
        ("mmm", "not a unit", "did you mean mm"),
        ("Mpa", "not a unit", "MPa"),
        ("KG", "not a unit", "kg"),
        ("mol", "not a unit of mechanics", ""),
        ("", "not a unit", "written like"),
        ("m/", "not a unit", ""),
        ("*m", "not a unit", ""),
        ("(m", "not a unit", ""),
        ("m)", "not a unit", ""),
        ("m m", "not a unit", ""),
        ("2 m", "not a unit", ""),
        ("m^x", "not a unit", ""),
        ("m^1/0", "not a unit", ""),
        ("m^(1/0)", "not a unit", ""),
        ("(m^2)^2", "not a unit", ""),
        ("m^13", "at most 12", ""),
        ("m^12*m", "at most 12", ""),
        ("m\n", "not a unit", ""),
        ("m²", "not a unit", ""),
        ("os.system", "not a unit", ""),
        ("__import__", "not a unit", ""),
        ("m" * 61, "not a unit", ""),
        ("m^" + "9" * 30, "at most 12", ""),
    ],
)
def test_what_is_no_unit(text, rule, hint):
    with pytest.raises(ExpressionError) as caught:
        parse_unit(text)
    assert rule in caught.value.rule
    assert hint in caught.value.hint


@settings(max_examples=300)
@given(st.text(max_size=30) | st.text(alphabet="mkgNsPa*/^()-123 °%µ", max_size=12))
def test_any_text_is_a_unit_or_refused(text):
    try:
        factor, exponents = parse_unit(text)
    except ExpressionError as error:
        assert error.rule
    else:
        assert factor > 0
        assert len(exponents) == 5


@pytest.mark.parametrize(
    "text", ["", "mm", "1e999 mm", "nan mm", "inf", "0x10 m", "1_000 m", "٣ m", "1" * 2000, "1 [mm", "--1 m"]
)
def test_what_is_no_quantity(text):
    with pytest.raises(ExpressionError):
        parse_quantity(text)


@given(st.decimals(-(10**6), 10**6, places=3))
def test_decimal_prefixes_do_not_round_twice(number):
    assert parse_quantity(f"{number} mm")[0] == float(f"{number}e-3")
    assert parse_quantity(f"{number} GPa")[0] == float(f"{number}e9")


@over(
    ("value", "unit", "text"),
    [
        (0.3e-3, "m", "0.3 mm"),
        (0.01, "m", "10 mm"),
        (1.5, "m", "1.5 m"),
        (0.0, "m", "0 m"),
        (-5e-3, "m", "-5 mm"),
        (2e-7, "m", "0.2 um"),
        (71.7e9, "Pa", "71.7 GPa"),
        (503e6, "Pa", "503 MPa"),
        (2810.0, "kg/m^3", "2810 kg/m^3"),
        (0.02, "kg", "20 g"),
        (0.5, "kg", "0.5 kg"),
        (2e6, "N/m", "2 N/um"),
        (3.0, "N*m/rad", "3 N*m/rad"),
        (0.02e-12, "m^4", "0.02 mm^4"),
        (0.33, "1", "0.33"),
        (2.0, "1", "2"),
        (5.0, "kg^2/s^3", "5 kg^2*s^-3"),
        (1 / 3, "m^(1/2)", "0.3333333333333333 m^(1/2)"),
    ],
)
def test_pretty_units(value, unit, text):
    assert format_quantity(value, parse_unit(unit)[1]) == text


@pytest.mark.parametrize(("degrees", "text"), [(90, "90 deg"), (-33, "-33 deg"), (12.5, "12.5 deg"), (0, "0 deg")])
def test_pretty_angles(degrees, text):
    assert format_quantity(math.radians(degrees), parse_unit("rad")[1], angle=True) == text


UNITS = [
    "m",
    "kg",
    "kg/m^3",
    "Pa",
    "N",
    "N/m",
    "N*m/rad",
    "kg*m^2",
    "m^2",
    "m^4",
    "m^3",
    "s",
    "Hz",
    "K",
    "A",
    "W",
    "m/s",
    "m/s^2",
    "1",
    "kg^3",
]


@settings(max_examples=400)
@given(
    FLOATS | st.decimals(-1000, 1000, places=4).map(lambda d: float(d) * 1e-3), st.sampled_from(UNITS), st.booleans()
)
def test_what_is_written_reads_back_exactly(value, unit, angle):
    exponents = parse_unit(unit)[1]
    angle = angle and unit == "1"
    text = format_quantity(value, exponents, angle=angle)
    assert parse_quantity(text) == (value, exponents)


@given(FLOATS)
def test_numbers_read_back_exactly(value):
    assert float(format_number(value)) == value


@over("name", parse._SI)
def test_units_known_without_the_unit_library_are_those_of_the_library(name):
    assert parse._SI[name] == parse._of_library(name)
