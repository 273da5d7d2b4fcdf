"""Numbers for readers: things that are counted, and SI values in the units of the field."""

from math import inf, nan, pi

import pytest

import flexura as fx
from flexura.tables import counted, number, quantity, scale_for, text_columns
from helpers.over import over


@pytest.mark.parametrize(
    ("count", "what", "said"),
    [
        (0, "warning", "0 warnings"),
        (1, "more pair", "1 more pair"),
        (2, "resonance", "2 resonances"),
        (1, "frequency", "1 frequency"),
        (3, "frequency", "3 frequencies"),
        (2, "assay", "2 assays"),
    ],
)
def test_one_is_singular(count, what, said):
    assert counted(count, what) == said


def test_one_frequency_is_told_as_one():
    found = fx.frequency_response(fx.load("examples/guide/guide.yaml"), frequency_hz=[10.0])
    assert "1 frequency, 10 to 10 Hz" in found._repr_html_()


@over(
    ("value", "unit", "said"),
    [
        (7.19e-3, "kg", "7.19 g"),
        (1.25, "kg", "1.25 kg"),
        (0.62e-6, "m/V", "0.62 µm/V"),
        (3.1e6, "N/m", "3.1 N/µm"),
        (5e7, "N/m", "50 N/µm"),
        (420.0, "N/m", "420 N/m"),
        (1.865, "N*m/rad", "1.865 N m/rad"),
        (1.865, "N·m/rad", "1.865 N m/rad"),
        (12345.0, "Hz", "12.345 kHz"),
        (9876.5, "Hz", "9876.5 Hz"),
        (0.3e-3, "rad", "0.3 mrad"),
        (-10 * pi / 180, "rad", "-10 deg"),
        (71.7e9, "Pa", "71.7 GPa"),
        (1.5e9, "Pa", "1500 MPa"),
        (503e6, "Pa", "503 MPa"),
        (20e-6, "m", "20 µm"),
        (0.3e-3, "m", "0.3 mm"),
        (0.25, "m", "250 mm"),
        (15.2e-3, "s", "15.2 ms"),
        (150.0, "V", "150 V"),
        (2810.0, "kg/m^3", "2810 kg/m³"),
        (9.81, "m/s^2", "9.81 m/s²"),
        (1.2e-6, "kg*m^2", "1200 g mm²"),
        (4e-6, "m^2", "4 mm²"),
        (0.0, "m", "0 m"),
        (123456.0, "", "123460"),
        (inf, "N/m", "∞ N/m"),
        (nan, "m", ""),
    ],
)
def test_a_number_has_the_unit_of_an_engineer(value, unit, said):
    assert quantity(value, unit) == said


@pytest.mark.parametrize("unit", ["m", "kg", "N", "N/m", "N*m/rad", "Pa", "Hz", "s", "V", "J", "m/N"])
def test_no_power_of_ten_where_a_prefix_does(unit):
    for power in range(-6, 7):
        assert "e+" not in quantity(1.2345678 * 10.0**power, unit, 4)


def test_a_column_has_one_unit_and_columns_of_a_unit_the_same():
    found = text_columns({"tip.x [m]": [0.0, 12e-3], "tip.y [m]": [0.0, 3e-6], "tip.rz [rad]": [0.0, 0.05]})
    assert found == {"tip.x [mm]": ["0", "12"], "tip.y [mm]": ["0", "0.003"], "tip.rz [deg]": ["0", "2.8648"]}


def test_frequencies_far_apart_stay_in_hertz():
    assert scale_for([95.1, 12345.0], "Hz") == (1.0, "Hz")
    assert text_columns({"f [Hz]": [95.123, 12345.0]}) == {"f [Hz]": ["95.123", "12345"]}


@pytest.mark.parametrize(("value", "digits", "said"), [(123456.7, 5, "123460"), (1e7, 5, "1e+07"), (-0.0, 4, "0")])
def test_plain_numbers(value, digits, said):
    assert number(value, digits) == said
