"""Disturbances in files: densities with units, tables, CSV files, what is refused with its line, and back again."""

import pytest

import flexura as fx
from helpers.disturbed import TWO, two_masses


def disturbed(text: str) -> fx.describe.Disturbance:
    return two_masses(f"{{source: {text}}}").disturbances["source"]


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("5 uN/sqrt(Hz)", 5e-6, "N"),
        ("5 uN/√Hz", 5e-6, "N"),
        ("5 uN/Hz^(1/2)", 5e-6, "N"),
        ("25e-12 N^2/Hz", 5e-6, "N"),
        ("25 (uN)^2/Hz", 5e-6, "N"),
        ("0 N/sqrt(Hz)", 0.0, "N"),
    ],
)
def test_densities_of_amplitude_and_power(text, value, unit):
    own = disturbed(f'{{input: coil, density: "{text}"}}').density
    assert own.value == pytest.approx(value) and own.unit == unit


def test_densities_of_floors():
    for text, value, unit in (
        ("1e-12 (m/s^2)^2/Hz", 1e-6, "m/s^2"),
        ("2 um/s^2/sqrt(Hz)", 2e-6, "m/s^2"),
        ("3 nm/sqrt(Hz)", 3e-9, "m"),
        ("4 um/s/sqrt(Hz)", 4e-6, "m/s"),
    ):
        own = disturbed(f"{{base: x, density: {text}, band: [1 Hz, 10 Hz]}}").density
        assert (own.value, own.unit) == (pytest.approx(value), unit)


def test_a_table_stands_in_a_csv_file(tmp_path):
    (tmp_path / "floor.csv").write_text("# measured\nfrequency [Hz]; density [(mm/s^2)^2/Hz]\n1; 4\n10; 9\n")
    text = TWO.format(disturbances="{floor: {base: x, file: floor.csv}}")
    (tmp_path / "two.yaml").write_text(text)
    mechanism = fx.load(tmp_path / "two.yaml")
    table = mechanism.disturbances["floor"].table
    assert table.frequency_hz == (1.0, 10.0) and table.values == pytest.approx((2e-3, 3e-3))
    assert fx.loads(fx.dumps(mechanism)) == mechanism
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "over.yaml").write_text("flexura: 1\nextends: ../two.yaml\n")
    assert fx.load(tmp_path / "sub" / "over.yaml").disturbances == mechanism.disturbances


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("frequency [Hz],density [m/s^2]\n1,2\n2,3\n", r"line 1: 'm/s\^2' is no unit of a density"),
        ("frequency,density [(m/s^2)^2/Hz]\n1,2\n2,3\n", "line 1: the heading is expected"),
        ("frequency [Hz],density [(m/s^2)^2/Hz]\n1,2\n2,3,4\n", "line 3: two numbers are expected"),
        ("frequency [Hz],density [(m/s^2)^2/Hz]\n1,2\n2,-3\n", "line 3: a density is finite, and not negative"),
        ("frequency [Hz],density [(m/s^2)^2/Hz]\n2,2\n1,3\n", "line 3: frequencies are not negative and rise"),
        ("frequency [Hz],density [(m/s^2)^2/Hz]\n1,2\n", "a heading and at least two rows"),
        (None, "does not exist|cannot be|there is no"),
    ],
)
def test_files_that_are_no_tables(tmp_path, content, message):
    if content is not None:
        (tmp_path / "floor.csv").write_text(content)
    (tmp_path / "two.yaml").write_text(TWO.format(disturbances="{floor: {base: x, file: floor.csv}}"))
    with pytest.raises(fx.ModelError, match=message) as refused:
        fx.load(tmp_path / "two.yaml")
    assert refused.value.problems[0].place == "disturbances.floor.file"


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("{input: coil, density: 5 N}", "density", "is no unit of a density"),
        ("{input: coil, density: 5}", "density", "a density carries a unit"),
        ("{input: coil, density: -5 N/sqrt(Hz)}", "density", "finite, and not negative"),
        ("{input: coil, density: 5 nV/sqrt(Hz)}", "density", "this is no density of coil"),
        ("{input: top.tx, density: 5 nV/sqrt(Hz)}", "density", "this is no density of top.tx"),
        ("{base: x, density: 5 N/sqrt(Hz)}", "density", "this is no density of the floor"),
        ("{sensor: x, density: 5 N/sqrt(Hz)}", "density", "this is no density of x"),
        ("{input: cool, density: 5 N/sqrt(Hz)}", "input", "there is no such actuator"),
        ("{sensor: gap, density: 5 m/sqrt(Hz)}", "sensor", "there is no such sensor"),
        ("{input: coil}", "", "one of spectrum, density, table"),
        ("{input: coil, sensor: x, density: 5 N/sqrt(Hz)}", "", "one of base, input, sensor"),
        ("{input: coil, spectrum: VC-A}", "", "criterion for floors"),
        ("{base: x, spectrum: VC-Z}", "spectrum", "one of 'ISO workshop'"),
        ("{input: coil, density: 5 N/sqrt(Hz), band: [2 Hz, 1 Hz]}", "", "it is empty"),
        ("{input: coil, density: 5 N/sqrt(Hz), corner: 2 Hz}", "", "1/f is infinite at zero"),
        ("{base: x, density: 5 m/sqrt(Hz)}", "", "shakes without end"),
        ("{input: coil, table: [[1 Hz, 5 N/sqrt(Hz)]]}", "table", "two rows or more"),
        ("{input: coil, table: [[1 Hz, 5 N/sqrt(Hz)], [2 Hz]]}", "table.1", "a frequency and a density"),
        ("{input: coil, table: [[1 Hz, 5 N/sqrt(Hz)], [1 Hz, 5 N/sqrt(Hz)]]}", "table.1.0", "rise from row to row"),
        ("{input: coil, table: [[1 Hz, 5 N/sqrt(Hz)], [2 Hz, 5 V/sqrt(Hz)]]}", "table.1.1", "it is not of N"),
        ("{input: coil, table: [[1 s, 5 N/sqrt(Hz)], [2 Hz, 5 N/sqrt(Hz)]]}", "table.0.0", "a frequency in Hz"),
        ("{input: coil, table: [[1 Hz, nan N/sqrt(Hz)], [2 Hz, 5 N/sqrt(Hz)]]}", "table.0.1", "not a number"),
    ],
)
def test_what_is_refused_has_its_place_and_line(text, place, message):
    with pytest.raises(fx.ModelError, match=message) as refused:
        disturbed(text)
    [problem] = refused.value.problems
    assert problem.place == f"disturbances.source.{place}".rstrip(".")
    assert problem.where.startswith("<text>:")


def test_what_is_written_reads_back():
    mechanism = two_masses(
        "{a: {base: [1, 2, 0], spectrum: ISO operating theatre, band: [1 Hz, 200 Hz]},"
        " b: {input: coil, density: 0.3 mN/sqrt(Hz), corner: 3 Hz, band: [0.1 Hz, 1 kHz]},"
        " c: {sensor: x, table: [[0 Hz, 1 um/sqrt(Hz)], [3.3 Hz, 2e-13 m^2/Hz]]}}"
    )
    assert fx.loads(fx.dumps(mechanism)) == mechanism


def test_descriptions_in_python_are_checked_as_well():
    with pytest.raises(fx.ModelError, match="rise from one to the next"):
        fx.describe.DensityTable(frequency_hz=(2.0, 1.0), values=(1.0, 1.0), unit="N")
    with pytest.raises(fx.ModelError, match="2 frequencies have 1 densities"):
        fx.describe.DensityTable(frequency_hz=(1.0, 2.0), values=(1.0,), unit="N")
    with pytest.raises(fx.ModelError, match="a density is of one of"):
        fx.describe.Density(value=1.0, unit="kg")
