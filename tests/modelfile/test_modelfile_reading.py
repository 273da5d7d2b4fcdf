"""What a model file says, and what each of its conveniences means."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import csc_array

from flexura.errors import ModelError
from flexura.expressions import parameter
from flexura.mechanism import CATALOGUE, Circle, Link, Mechanism, Parameter, Superelement, Support
from flexura.mechanism.evaluation import parameter_values
from flexura.modelfile import load, loads
from helpers.modelfile_samples import AMPLIFIER, BEAM, only_problem_in


def test_a_file_means_the_same_as_python_code():
    t = parameter("t")
    expected = Mechanism(
        parameters={"t": Parameter(value=1e-3)},
        nodes={"a": (0, 0, 0), "b": (0.1, 0, 0)},
        links={"beam": Link(nodes=("a", "b"), material="Al-6061-T6", section=Circle(diameter=t))},
        ground={"a": Support(fixed=("tx", "ty", "tz", "rx", "ry", "rz"))},
    )
    assert loads(BEAM) == expected


def test_parameters_know_their_units():
    read = loads(AMPLIFIER)
    units = {name: p.unit for name, p in read.parameters.items()}
    assert units == {"t": "m", "m": "kg", "L": "m", "half": "m", "phi": "1"}
    assert parameter_values(read) == {"t": 3e-4, "m": 0.02, "L": 0.01, "half": 0.005, "phi": math.radians(30)}
    assert read.parameters["m"].maximum == 0.05


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.3 mm", 0.3e-3),
        ("71.7 um", 71.7e-6),
        ("-5mm", -5e-3),
        ("0", 0.0),
        ("0.0", 0.0),
        ("2 * 5 mm", 10e-3),
        ("1 in", 0.0254),
        ("1e-3 m", 1e-3),
        ("sqrt(4 mm * 9 mm)", 6e-3),
        ("3 [N*m]/(2 N)", 1.5),
        ("(1 m + 20 cm) / 3", 0.4),
    ],
)
def test_lengths(text, value):
    read = loads(BEAM.replace("[100 mm, 0, 0]", f"[100 mm, '{text}', 0]"))
    assert read.nodes["b"][1] == pytest.approx(value, rel=1e-15)


def test_units_of_several_in_expressions():
    read = loads(BEAM.replace("t: 1 mm", "t: 1 mm, k: 2*t*3 N/mm, own: t*2 mm^2*2700 kg/m^3, w: 8 kg/m*t"))
    values = {"k": 6.0, "own": 1e-3 * 2e-6 * 2700, "w": 8e-3}
    for name, value in values.items():
        assert read.parameters[name].value.evaluate({"t": 1e-3}) == pytest.approx(value, rel=1e-14)


def test_decimal_units_are_exact():
    for number in range(1, 300):
        read = loads(BEAM.replace("100 mm", f"{number / 100} mm"))
        assert read.nodes["b"][0] == float(f"{number / 100}e-3")


@pytest.mark.parametrize("text", ["1e-3", "0.001", "'1e-3'", "1E-3", "0.1 %", "1e-3 m/m", "sin(0.001)+0*t/t"])
def test_pure_numbers(text):
    value = loads(AMPLIFIER.replace("loss_factor: 1e-3", f"loss_factor: {text}")).materials["mine"].loss_factor
    assert value == 1e-3 or value.evaluate({"t": 1.0}) == pytest.approx(1e-3)


@pytest.mark.parametrize("text", ["90 deg", "90°", "pi/2", "1.5707963267948966 rad", "3*30 deg", "0"])
def test_angles(text):
    angle = loads(AMPLIFIER.replace("angle: 90 deg", f"angle: {text}")).instances["amp"].rotate[0].angle
    assert angle in (math.pi / 2, 0.0)


def test_a_unit_wins_where_only_it_has_the_right_dimension():
    """`kg/m^3` is a density even when a mass is called m."""
    assert loads(AMPLIFIER).materials["mine"].rho == 2700.0
    assert loads(AMPLIFIER).springs["soft"].stiffness.rz == 3.0


def test_a_parameter_wins_where_it_has_the_right_dimension():
    text = BEAM.replace("{t: 1 mm}", "{t: 1 mm, m: 2}").replace("100 mm", "3 m*m")
    assert loads(text).nodes["b"][0].evaluate({"m": 2.0}) == 6.0


def test_axes_by_name():
    read = loads(AMPLIFIER)
    amp = read.substructures["amp"]
    assert amp.links["bar"].reference == (0.0, 0.0, -1.0)
    assert amp.flexures["leaf"].reference == (0.0, 0.0, 1.0)


def test_materials_may_be_other_names_for_the_catalogue():
    assert loads(AMPLIFIER).material("al") is CATALOGUE["Al-7075-T6"]


def test_the_format_version_is_written_but_not_kept():
    assert loads("flexura: 1\n" + BEAM) == loads(BEAM)


def test_aliases_stand_for_what_they_name():
    text = BEAM.replace("[0, 0, 0]", "&o [0, 0, 1 mm]") + "masses: {tip: {node: b, mass: 1 g, offset: *o}}\n"
    assert loads(text).masses["tip"].offset == (0.0, 0.0, 1e-3)


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path):
    file = tmp_path / "m.yaml"
    file.write_bytes(b"\xef\xbb\xbf" + BEAM.replace("\n", "\r\n").encode())
    assert load(file) == loads(BEAM)


SUPERELEMENT = """\
nodes: {{a: [0, 0, 0]}}
superelements:
  part: {{nodes: [a], {units}stiffness: {K}, mass: {M}}}
"""


def coupled_matrices() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    A, B = rng.normal(size=(2, 6, 6))
    return A @ A.T, B @ B.T


def test_superelements_are_read_from_matrix_market_files(tmp_path):
    K, M = coupled_matrices()
    mmwrite(tmp_path / "K.mtx", K)
    mmwrite(tmp_path / "M.mtx", csc_array(M))
    file = tmp_path / "m.yaml"
    file.write_text(SUPERELEMENT.format(units="", K="{file: K.mtx}", M="{file: M.mtx}"))
    part = load(file).superelements["part"]
    np.testing.assert_allclose(part.stiffness.array, K, rtol=1e-14)
    np.testing.assert_allclose(part.mass.array, M, rtol=1e-14)
    assert part == Superelement(nodes=("a",), stiffness=part.stiffness.array, mass=part.mass.array)


def test_superelement_units_scale_each_block():
    """With u = [mm, rad] and t mm/s^2 = N: forces in N, moments in N mm."""
    K, M = coupled_matrices()
    text = SUPERELEMENT.format(units="units: {length: mm, mass: t, time: s}, ", K=K.tolist(), M=M.tolist())
    part = loads(text).superelements["part"]
    for got, given, tt in ((part.stiffness.array, K, 1e3), (part.mass.array, M, 1e3)):
        np.testing.assert_allclose(got[:3, :3], given[:3, :3] * tt, rtol=1e-14)
        np.testing.assert_allclose(got[:3, 3:], given[:3, 3:] * tt * 1e-3, rtol=1e-14)
        np.testing.assert_allclose(got[3:, 3:], given[3:, 3:] * tt * 1e-6, rtol=1e-14)


def test_superelement_energy_does_not_depend_on_the_units():
    K, M = coupled_matrices()
    given = loads(SUPERELEMENT.format(units="units: {length: mm, time: ms}, ", K=K.tolist(), M=M.tolist()))
    u_mm = np.array([0.1, 0.2, -0.3, 0.01, 0.02, 0.03])
    u_si = u_mm * np.array([1e-3] * 3 + [1] * 3)
    part = given.superelements["part"]
    # kg mm^2 / ms^2 is a joule
    assert u_si @ part.stiffness.array @ u_si == pytest.approx(u_mm @ K @ u_mm, rel=1e-13)
    assert u_si @ part.mass.array @ u_si == pytest.approx(u_mm @ M @ u_mm * 1e-6, rel=1e-13)


@pytest.mark.parametrize("entry", ["1e151", "-1e300"])
def test_entries_whose_squares_are_no_numbers(entry):
    with pytest.raises(ModelError, match=r"at most 1e\+150 in size"):
        loads(SUPERELEMENT.format(units="", K=str(MATRIX).replace("1.0", entry), M=MATRIX))


COORDINATE = "%%MatrixMarket matrix coordinate real symmetric\n6 6 1\n{}"
MATRIX = [[float(i == j) for i in range(6)] for j in range(6)]


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        (None, "the file does not exist"),
        ("nonsense", "not a real square Matrix Market file"),
        ("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 2\n", "its entries are complex"),
        ("%%MatrixMarket matrix array real general\n2 3\n1\n1\n1\n1\n1\n1\n", "2 x 3"),
        ("%%MatrixMarket matrix array real general\n99999999 99999999\n1\n", "the matrices of this part are 6 x 6"),
        ("%%MatrixMarket matrix array real general\n6 6\n1\n", "not a real square Matrix Market file"),
        ("%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n", "its entries are pattern"),
        (COORDINATE.format("1 1 2.5p"), "line 3: row, column and number are expected, not '1 1 2.5p'"),
        (COORDINATE.format("1 1 1D3\n"), "line 3: row, column and number are expected, not '1 1 1D3'"),
        (COORDINATE.format("1 1 nan\n"), "line 3: row, column and number"),
        (COORDINATE.format("1 1 1e400\n"), "line 3: row, column and number"),
        (COORDINATE.format("7 1 1\n"), "lies outside 6 x 6"),
        (COORDINATE.format("1.5 1 1\n"), "lies outside 6 x 6"),
        (COORDINATE.format("1 1 1\n1 1 2\n"), "its header says 1 entries, there are 2"),
        (COORDINATE.replace(" 1\n", " 2\n").format("1 2 1\n2 1 1\n"), "an entry is given twice"),
        ("%%MatrixMarket matrix array real symmetric\n6 6\n" + 20 * "1\n", "21 entries, there are 20"),
        ("%%MatrixMarket matrix array real symmetric\n6 6\n" + 20 * "1\n" + "x", "line 23: one number is expected"),
    ],
)
def test_matrix_files_that_cannot_be_used(tmp_path, content, rule):
    if content is not None:
        (tmp_path / "K.mtx").write_text(content)
    file = tmp_path / "m.yaml"
    file.write_text(SUPERELEMENT.format(units="", K="{file: K.mtx}", M=MATRIX))
    with pytest.raises(ModelError) as caught:
        load(file)
    (problem,) = caught.value.problems
    assert problem.where == f"{file}:3"
    assert rule in problem.rule
    assert problem.path == ("superelements", "part", "stiffness", "file")


@pytest.mark.parametrize(
    ("units", "rule"),
    [
        ("{length: kg}", "a unit of length is expected here"),
        ("{size: mm}", "unknown key"),
        ("mm", "the units of a superelement are a mapping"),
        ("{length: mmm}", "is not a unit"),
    ],
)
def test_superelement_units_that_are_none(units, rule):
    problem = only_problem_in(SUPERELEMENT.format(units=f"units: {units}, ", K=MATRIX, M=MATRIX))
    assert rule in problem.rule
    assert problem.where == "model.yaml:3"
