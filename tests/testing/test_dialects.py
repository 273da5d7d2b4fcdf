"""Universal files and tables as other programs write them: units, exponents, long names, repeats, outputs alone."""

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.testing.measurement.channels import quantity_of

pyuff = pytest.importorskip("pyuff")

HZ = np.linspace(0, 200, 101)
UNIT, UNDER = "ordinate_axis_units_lab", "orddenom_axis_units_lab"


def accelerance(k=0):
    """Accelerance of three modes, at line 50 of size that tells units apart."""
    w = 2 * np.pi * HZ
    modes = ((40, 1), (90, 0.5 * k), (150, -0.7 + 0.3 * k))
    return sum(-(w**2) * a / ((2 * np.pi * f) ** 2 - w**2 + 0.02j * w * 2 * np.pi * f) for f, a in modes)


def written(path, count=1, each=lambda k: {}, **more):
    """A universal file with a response of every node to node 1, with some fields of its headers set."""
    for k in range(count):
        fields = {
            "type": 58,
            "func_type": 4,
            "rsp_dir": 3,
            "ref_dir": 3,
            "ref_node": 1,
            "rsp_node": k + 1,
            "x": HZ,
            "data": accelerance(k),
            "rsp_ent_name": "A",
            "ref_ent_name": "A",
            "abscissa_spacing": 1,
            "abscissa_spec_data_type": 18,
            "ord_data_type": 5,
            "ordinate_spec_data_type": 12,
            "orddenom_spec_data_type": 13,
            "id1": "NONE",
        }
        pyuff.UFF(str(path)).write_sets(fields | more | each(k), "add")
    return path


def factor(measurement, of=0):
    """How much larger what was read is than what was written."""
    (frf,) = measurement.frfs
    return abs(frf.response[50, of, 0] / accelerance(of)[50])


@pytest.mark.parametrize(
    ("label", "hz"), [("Hz", 1), ("kHz", 1e3), ("rad/s", 1 / (2 * np.pi)), ("RPM", 1 / 60), ("NONE", 1)]
)
def test_frequencies_are_in_the_unit_of_their_label(tmp_path, label, hz):
    found = fx.read_measurement(written(tmp_path / "a.uff", abscissa_axis_units_lab=label))
    assert found.frfs[0].frequency_hz == pytest.approx(HZ * hz, rel=1e-5)
    assert any(label in note for note in found.notes) == (hz != 1)


def test_an_abscissa_that_is_no_known_frequency_is_refused_by_name(tmp_path):
    rpm = fx.read_measurement(written(tmp_path / "rpm.uff", abscissa_spec_data_type=19))
    assert rpm.frfs[0].frequency_hz[-1] == pytest.approx(200 / 60)
    for k, (more, words) in enumerate(
        (
            ({"abscissa_axis_units_lab": "orders"}, "dataset 1: abscissa: frequencies are in .* not in 'orders'"),
            ({"abscissa_axis_units_lab": "1/s"}, "not in '1/s'"),
            ({"abscissa_spec_data_type": 20}, "data type 20"),
        )
    ):
        with pytest.raises(fx.OptionError, match=words):
            fx.read_measurement(written(tmp_path / f"{k}.uff", **more))
    table = tmp_path / "t.csv"
    rows = "".join(f"{x},1,0\n" for x in range(1, 6))
    table.write_text(f"frequency [rad/s],a / b [m/N] real,a / b [m/N] imag\n{rows}", encoding="utf-8")
    assert fx.read_measurement(table).frfs[0].frequency_hz[-1] == pytest.approx(5 / (2 * np.pi))
    table.write_text(f"frequency [1/s],a / b [m/N] real,a / b [m/N] imag\n{rows}", encoding="utf-8")
    with pytest.raises(fx.OptionError, match="1/s"):
        fx.read_measurement(table)


POUND = 4.4482216152605


@pytest.mark.parametrize(
    ("over", "under", "expected"),
    [
        ("(m/s²)/N", "NONE", 1),
        ("(1/N)*(m/s²)", "NONE", 1),
        ("m/s^2/N", "N", 1),
        ("1/kg", "NONE", 1),
        ("g/N", "NONE", 9.80665),
        ("g/lbf", "LBF", 9.80665 / POUND),
        ("G", "LBF", 9.80665 / POUND),
        ("g", "lb", 9.80665 / POUND),
        ("M/SEC^2", "Newton", 1),
        ("ms-2", "newtons", 1),
        ("meter/sec2", "kN", 1e-3),
        ("mg", "N", 9.80665e-3),
    ],
)
def test_units_as_others_write_them(tmp_path, over, under, expected):
    found = fx.read_measurement(written(tmp_path / "a.uff", **{UNIT: over, UNDER: under}))
    assert factor(found) == pytest.approx(expected, rel=1e-6)
    assert not found.notes


@pytest.mark.parametrize(
    ("over", "under", "words"),
    [
        ("EU", "EU", "A:1.tz: EU is not a unit.*a file of channels may give it"),
        ("V", "V", "V is no unit of acceleration"),
        ("Pa", "N", "Pa is no unit"),
        ("g/N", "lbf", "per N by its label, but its reference in lbf"),
        ("g", "kg", "kg is no unit of force"),
    ],
)
def test_units_that_are_not_known_are_refused_by_name(tmp_path, over, under, words):
    with pytest.raises(fx.OptionError, match=words):
        fx.read_measurement(written(tmp_path / "a.uff", **{UNIT: over, UNDER: under}))


@pytest.mark.parametrize(
    "more", [{UNIT: "EU", UNDER: "EU"}, {"ordinate_spec_data_type": 0, "orddenom_spec_data_type": 0}]
)
def test_a_file_of_channels_gives_units_that_the_data_lack(tmp_path, more):
    """Of a driving point the response and the force have one name."""
    path = written(tmp_path / "a.uff", 2, **more)
    with pytest.raises(fx.OptionError, match="a file of channels"):
        fx.read_measurement(path)
    channels = tmp_path / "c.yaml"
    channels.write_text('channels:\n  "A:1.tz": {unit: g, force: lbf}\n  "A:2.tz": {unit: g}\n', encoding="utf-8")
    found = fx.read_measurement(path, channels)
    assert factor(found, 1) == pytest.approx(9.80665 / POUND, rel=1e-6)
    assert found.frfs[0].inputs[0].quantity == "force"
    channels.write_text('channels:\n  "A:1.tz": {unit: g, force: mm}\n', encoding="utf-8")
    with pytest.raises(fx.OptionError, match="mm is no unit of a force"):
        fx.read_measurement(path, channels)


def test_labels_without_a_data_type_decide(tmp_path):
    more = {"ordinate_spec_data_type": 0, "orddenom_spec_data_type": 0, UNIT: "g", UNDER: "N"}
    assert factor(fx.read_measurement(written(tmp_path / "a.uff", **more))) == pytest.approx(9.80665)
    assert quantity_of("g") == ("acceleration", 9.80665)
    with pytest.raises(fx.OptionError, match="lb is no unit"):
        quantity_of("lb")


def test_a_response_given_twice_is_refused_by_name(tmp_path):
    path = written(tmp_path / "a.uff", 3, each=lambda k: {"rsp_node": 1})
    with pytest.raises(fx.OptionError, match=r"A:1\.tz / A:1\.tz is given more than once, in datasets 1 and 2"):
        fx.read_measurement(path)
    scalars = written(tmp_path / "b.uff", 2, each=lambda k: {"rsp_node": 0, "rsp_dir": 0})
    with pytest.raises(fx.OptionError, match="cannot be distinguished"):
        fx.read_measurement(scalars)
    scalar = fx.read_measurement(written(tmp_path / "c.uff", 2, rsp_dir=0))
    assert "scalar channels, of which no direction is known: A:1, A:2" in scalar.notes


@pytest.mark.parametrize(("how", "expected"), [("average", 2.0), ("first", 1.0), ("last", 4.0)])
def test_responses_given_more_than_once_are_merged_on_request(tmp_path, how, expected):
    sizes = (1.0, 1.0, 4.0)
    each = lambda k: {"rsp_node": 1 + (k == 3), "data": accelerance() * (*sizes, 1.0)[k]}  # noqa: E731
    path = written(tmp_path / "a.uff", 4, each=each)
    found = fx.read_measurement(path, repeated=how)
    (frf,) = found.frfs
    assert frf.response.shape == (101, 2, 1)
    assert np.allclose(frf.response[:, 0, 0], expected * frf.response[:, 1, 0], rtol=1e-5)
    said = [note for note in found.notes if "given more than once" in note]
    assert said and "A:1.tz / A:1.tz (3 times)" in said[0] and "A:2" not in said[0]
    assert said[0] in fx.identify(found).notes
    shown = CliRunner().invoke(app, ["identify", str(path), "--repeated", how])
    assert shown.exit_code == 0 and "given more than once" in shown.output


def test_coherence_follows_the_response_that_is_used(tmp_path):
    def each(k):
        gamma = {"func_type": 6, "data": np.full(101, (0.9, 0.5)[k % 2]), "ord_data_type": 2}
        return {"rsp_node": 1} | (gamma if k > 1 else {"data": accelerance() * (k + 1)})

    path = written(tmp_path / "a.uff", 4, each=each)
    for how, gamma in (("first", 0.9), ("last", 0.5)):
        (frf,) = fx.read_measurement(path, repeated=how).frfs
        assert np.allclose(frf.coherence, gamma, rtol=1e-5)
    found = fx.read_measurement(path, repeated="average")
    assert found.frfs[0].coherence is None and any("coherences of 1 responses" in note for note in found.notes)
    with pytest.raises(fx.OptionError, match="average, first, last"):
        fx.read_measurement(path, repeated="middle")


@pytest.mark.parametrize("form", [5, 6])
def test_fortran_exponents(tmp_path, form):
    path = written(tmp_path / "a.uff", 2, ord_data_type=form)
    plain = fx.read_measurement(path).frfs[0].response
    text = path.read_bytes()
    for sign in (b"+0", b"-0"):
        text = text.replace(b"e" + sign, b"D" + sign).replace(b"E" + sign, b"D" + sign)
    assert b"D+0" in text
    path.write_bytes(text)
    assert fx.read_measurement(path).frfs[0].response == pytest.approx(plain)


def test_long_names_that_move_the_columns_behind_them(tmp_path):
    """pyuff writes names of more than ten letters whole, and reads the columns behind them wrong."""
    path = written(tmp_path / "a.uff", 2, rsp_ent_name="Wing_left tip_7", ref_ent_name="Hammer at root")
    (frf,) = fx.read_measurement(path).frfs
    assert [c.name for c in frf.outputs] == ["Wing_left tip_7:1.tz", "Wing_left tip_7:2.tz"]
    assert [c.name for c in frf.inputs] == ["Hammer at root:1.tz"]
    assert abs(frf.response[50, :, 0]) == pytest.approx([abs(accelerance(k)[50]) for k in (0, 1)])


def test_data_without_a_force_are_called_so(tmp_path):
    spectra = written(tmp_path / "s.uff", func_type=2, ord_data_type=2, data=abs(accelerance()))
    with pytest.raises(fx.OptionError, match="spectra of outputs only"):
        fx.read_measurement(spectra)
    table = tmp_path / "t.csv"
    rows = "".join(f"{0.01 * k},{np.sin(k)},{np.cos(k)}\n" for k in range(64))
    table.write_text(f"time [s],a [m/s^2],b [m/s^2]\n{rows}", encoding="utf-8")
    with pytest.raises(fx.OptionError, match="output-only data"):
        fx.testing.estimate_frf(fx.read_measurement(table))
    inverted = written(tmp_path / "i.uff", ordinate_spec_data_type=13, orddenom_spec_data_type=12)
    with pytest.raises(fx.OptionError, match="force per motion"):
        fx.identify(fx.read_measurement(inverted))


def test_some_coherences_are_said(tmp_path):
    path = written(tmp_path / "a.uff", 2)
    written(path, func_type=6, ord_data_type=2, data=np.full(101, 0.9))
    assert any("1 of 2 responses have a coherence" in note for note in fx.read_measurement(path).notes)
