"""Measured data from and to files, against pyuff, its sample files, and files made byte by byte."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.io import read_measurement, write_measurement

DATA = Path(__file__).parent / "data"
OBLIQUE = (2 / 7, -3 / 7, 6 / 7)
HAMMER = fx.testing.MeasuredChannel("hammer", "force", "p1", (0.0, 0.0, -1.0), (0.01, 0.02, 0.03))
OUTPUTS = (
    fx.testing.MeasuredChannel("p1.tz", "acceleration", "p1", (0.0, 0.0, 1.0), (0.01, 0.02, 0.03)),
    fx.testing.MeasuredChannel("tilt", "angular_velocity", "platform.corner.far", (-1.0, 0.0, 0.0), (0.1, 1 / 3, 0.0)),
    fx.testing.MeasuredChannel("oblique", "acceleration", "q", OBLIQUE, (0.0, 0.1, 0.0)),
)


def measurement():
    rng = np.random.default_rng(1)
    channels = (HAMMER, *OUTPUTS, fx.testing.MeasuredChannel("somewhere", "velocity"))
    records = [
        fx.testing.Recording(51200.0, rng.normal(size=(5, 37)), channels, (0,), f"step {k // 2}", f"hit {k}")
        for k in range(3)
    ]
    inputs = (HAMMER, fx.testing.MeasuredChannel("p3.fy", "force", "p3", (0.0, 1.0, 0.0)))
    H = rng.normal(size=(37, 3, 2)) + 1j * rng.normal(size=(37, 3, 2))
    even = np.arange(3, 40) * 0.1234567890123
    gamma = rng.uniform(size=H.shape)
    first = fx.testing.MeasuredFRF(
        even, H, inputs, OUTPUTS, gamma, 5, "H1", 0.123456789012, "step 0", ("a note of it",)
    )
    second = fx.testing.MeasuredFRF(even**1.1, 2 * H, inputs, OUTPUTS, None, None, "Hv", 0.0, "step 1")
    return fx.Measurement("platform test", tuple(records), (first, second), ("a note",))


def same_place(a, b, tolerance):
    for x, y in zip(a, b, strict=True):
        assert (x.name, x.quantity, x.node, x.position) == (y.name, y.quantity, y.node, y.position)
        assert (x.direction is None) == (y.direction is None)
        if x.direction is not None:
            np.testing.assert_allclose(x.direction, y.direction, atol=tolerance)


@pytest.mark.parametrize(
    ("name", "options", "digits"),
    [("t.uff", {}, 0.0), ("t.unv", {"binary": False}, 1e-11), ("t.npz", {}, 0.0), ("t.h5", {}, 0.0)],
)
def test_everything_comes_back(name, options, digits, tmp_path):
    own = measurement()
    back = read_measurement(write_measurement(own, tmp_path / name, **options))
    is_uff = name.startswith("t.u")
    assert back.name == own.name
    assert len(back.recordings) == 3 and len(back.frfs) == 2
    for a, b in zip(own.recordings, back.recordings, strict=True):
        np.testing.assert_allclose(b.samples, a.samples, rtol=digits, atol=digits)
        assert (b.sample_rate, b.inputs, b.setup, b.name) == (a.sample_rate, a.inputs, a.setup, a.name)
        same_place(a.channels, b.channels, 1e-5 if is_uff else 0)
    for a, b in zip(own.frfs, back.frfs, strict=True):
        np.testing.assert_allclose(b.response, a.response, rtol=digits, atol=digits)
        uneven = a.coherence is None
        # ASCII files have 6 digits of uneven abscissae
        np.testing.assert_allclose(b.frequency_hz, a.frequency_hz, rtol=5e-6 if uneven and digits else 1e-14)
        if a.coherence is not None:
            np.testing.assert_allclose(b.coherence, a.coherence, rtol=digits, atol=digits)
        assert (b.estimator, b.averages, b.decay, b.setup) == (a.estimator, a.averages, a.decay, a.setup)
        same_place((*a.inputs, *a.outputs), (*b.inputs, *b.outputs), 1e-5 if is_uff else 0)
    assert is_uff or (back.notes == own.notes and back.frfs[0].notes == own.frfs[0].notes)


@pytest.mark.parametrize("node", ["platform", "12"])
def test_several_positions_at_one_node(node, tmp_path):
    places = [(0.1, 0.0, 0.0), (-0.1, 0.0, 0.0), (0.0, 0.2, 0.01)]
    outputs = tuple(
        fx.testing.MeasuredChannel(f"a{k}", "acceleration", node, (0.0, 0.0, 1.0), at) for k, at in enumerate(places)
    )
    inputs = (fx.testing.MeasuredChannel("h", "force", node, (0.0, 0.0, -1.0), (0.0, -0.2, 0.01)),)
    rng = np.random.default_rng(2)
    H = rng.normal(size=(20, 3, 1)) + 1j * rng.normal(size=(20, 3, 1))
    own = fx.Measurement(
        "t", frfs=(fx.testing.MeasuredFRF(np.arange(20.0), H, inputs, outputs, rng.uniform(size=H.shape)),)
    )
    (frf,) = read_measurement(write_measurement(own, tmp_path / "t.uff")).frfs
    same_place((*inputs, *outputs), (*frf.inputs, *frf.outputs), 1e-12)
    np.testing.assert_array_equal(frf.response, H)
    np.testing.assert_array_equal(frf.coherence, own.frfs[0].coherence)
    pyuff = pytest.importorskip("pyuff")
    file = pyuff.UFF(str(tmp_path / "t.uff"))
    sets = [file.read_sets(k) for k in range(file.get_n_sets())]
    ends = [(s["rsp_node"], s["ref_node"]) for s in sets if s["type"] == 58 and s["func_type"] == 4]
    assert len({n for pair in ends for n in pair}) == 4
    assert (12 in [n for pair in ends for n in pair]) == (node == "12")


@pytest.mark.parametrize("binary", [True, False])
def test_pyuff_reads_what_is_written(binary, tmp_path):
    pyuff = pytest.importorskip("pyuff")
    own = measurement()
    path = write_measurement(own, tmp_path / "t.uff", binary=binary)
    file = pyuff.UFF(str(path))
    sets = [file.read_sets(k) for k in range(file.get_n_sets())]
    assert [s["type"] for s in sets] == [151, 164, 18, 2411] + [58] * (3 * 5 + 6 * 2 + 6)
    times = [s for s in sets if s["type"] == 58 and s["func_type"] == 1]
    assert [s["binary"] for s in times] == [int(binary)] * 15
    np.testing.assert_allclose(times[5]["data"], own.recordings[1].samples[0], rtol=1e-11, atol=1e-11)
    assert times[5]["abscissa_inc"] == pytest.approx(1 / 51200, rel=5e-6)
    responses = [s for s in sets if s["type"] == 58 and s["func_type"] == 4]
    np.testing.assert_allclose(responses[3]["data"], own.frfs[0].response[:, 1, 1], rtol=1e-11, atol=1e-11)
    assert (responses[0]["rsp_dir"], responses[0]["ref_dir"], responses[2]["rsp_dir"]) == (3, -3, -4)
    assert responses[0]["rsp_node"] == responses[0]["ref_node"] != responses[2]["rsp_node"]
    assert (responses[0]["ordinate_axis_units_lab"], responses[0]["orddenom_axis_units_lab"]) == ("m/s^2", "N")
    assert (responses[0]["ordinate_spec_data_type"], responses[0]["orddenom_spec_data_type"]) == (12, 13)
    gammas = [s for s in sets if s["type"] == 58 and s["func_type"] == 6]
    np.testing.assert_allclose(gammas[3]["data"], own.frfs[0].coherence[:, 1, 1], rtol=1e-11, atol=1e-11)
    nodes = sets[3]
    at = list(nodes["node_nums"]).index(responses[2]["rsp_node"])
    assert (nodes["x"][at], nodes["y"][at]) == (0.1, 1 / 3)


def test_the_size_of_binary_data_stands_in_their_header(tmp_path):
    path = write_measurement(measurement(), tmp_path / "t.uff")
    content = path.read_bytes()
    at, count = 0, 0
    while (at := content.find(b"\n    58b", at)) >= 0:
        line = content[at + 1 : content.index(b"\n", at + 1)]
        size = int(line[31:43])
        assert (int(line[7:13]), int(line[13:19]), int(line[19:31])) == (1, 2, 11)
        start = at + 1
        for _ in range(12):
            start = content.index(b"\n", start) + 1
        assert content[start + size : start + size + 7] == b"    -1\n"
        at, count = start + size, count + 1
    assert count == 33


def block(kind, unit, denominator, data, *, binary=None, code=3, node=7, form=None, entity="NONE", units=("m", "N")):
    """A dataset 58 byte by byte, as the format has it: response along `code` of node 7 to a force at node 2."""
    mark = (
        "    58" if binary is None else f"    58b{binary[0]:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    )
    head = [
        *("    -1", mark, "made by hand", "NONE", "NONE", "NONE", "NONE"),
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {entity:<10}{node:10d}{code:4d} {'NONE':<10}{2:10d}{-1:4d}",
        f"{form[0]:10d}{form[1]:10d}{1:10d}{1.0:13.5E}{0.5:13.5E}{0.0:13.5E}",
        f"{18 if kind == 4 else 17:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}",
        f"{unit[0]:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {unit[1]:<20}",
        f"{denominator[0]:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {denominator[1]:<20}",
        f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}",
    ]
    return "\n".join(head).encode() + b"\n" + data + b"    -1\n"


@pytest.mark.parametrize(("order", "letter"), [(1, "<"), (2, ">")])
@pytest.mark.parametrize(("precision", "number"), [(5, "f"), (6, "d")])
def test_binary_of_other_programs(order, letter, precision, number, tmp_path):
    H = np.array([1 + 2j, 3 - 4j, -0.5 + 0.25j])
    raw = struct.pack(f"{letter}6{number}", *(v for h in H for v in (h.real, h.imag)))
    path = tmp_path / "x.uff"
    path.write_bytes(block(4, (12, "g"), (13, "lbf"), raw, binary=(order,), form=(precision, 3), code=-2))
    (frf,) = read_measurement(path).frfs
    np.testing.assert_allclose(frf.response[:, 0, 0], H * 9.80665 / 4.4482216152605, rtol=1e-14)
    np.testing.assert_allclose(frf.frequency_hz, [1.0, 1.5, 2.0])
    (out,), (into,) = frf.outputs, frf.inputs
    assert (out.name, out.node, out.direction, out.quantity) == ("7.-ty", "7", (0.0, -1.0, 0.0), "acceleration")
    assert (into.name, into.node, into.direction, into.quantity) == ("2.-tx", "2", (-1.0, 0.0, 0.0), "force")


UNITS = "    -1\n   164\n        10mm (newton)                  2\n"
UNITS += "  1.00000000000000000D+03  1.0D+00  1.0D+00\n  2.7315D+02\n    -1\n"
ONE = b"  1.00000E+00\n"


def test_units_of_the_file_count_where_a_channel_has_none(tmp_path):
    text = b"  1.00000E+00 -2.00000E+00  3.00000E+00\n"
    path = tmp_path / "x.unv"
    nodes = b"    -1\n    15\n         7         0         0         8  1.00000E+01  2.00000E+01  0.00000E+00\n    -1\n"
    path.write_bytes(UNITS.encode() + nodes + block(1, (8, "NONE"), (0, "NONE"), text, form=(2, 3)))
    found = read_measurement(path)
    assert found.notes == ()
    np.testing.assert_allclose(found.recordings[0].samples, [[1e-3, -2e-3, 3e-3]], rtol=1e-15)
    assert found.recordings[0].sample_rate == 2.0
    assert found.recordings[0].channels[0].position == pytest.approx((0.01, 0.02, 0.0), rel=1e-15)
    path.write_bytes(block(1, (8, "NONE"), (0, "NONE"), text, form=(2, 3)))
    assert read_measurement(path).notes == ("1 datasets give no unit: taken as SI",)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (block(1, (12, "N"), (0, "NONE"), ONE, form=(2, 1)), r"dataset 1: 7\.tz: N is no unit of acceleration"),
        (block(1, (12, "m/s2/"), (0, "NONE"), ONE, form=(2, 1)), r"dataset 1: 7\.tz: .*is not a unit"),
        (block(1, (0, "NONE"), (0, "NONE"), ONE, form=(2, 1)), "neither its unit nor what it measures"),
        (block(1, (15, "kg"), (0, "NONE"), ONE, form=(2, 1)), "kg is no unit of a force or a motion"),
        (
            block(1, (12, "NONE"), (0, "NONE"), b"  1.00000E+00  1.00000E+00\n", form=(2, 3)),
            "dataset 1: 2 values, but its header says 3: is the file complete",
        ),
        (b"frequency,level\n1,2\n", "not a universal file: its first line is not -1"),
        (b"    -1\n", "no datasets in the file"),
        (b"    -1\n    58\nonly a head\n    -1\n", "dataset 1 of 1, type 58, cannot be read: is the file complete"),
        (
            b"    -1\n  2414\nsomething\n    -1\n",
            "no time records, frequency responses or modes; datasets of type 2414",
        ),
    ],
)
def test_universal_files_that_cannot_be_used(data, message, tmp_path):
    path = tmp_path / "x.uff"
    path.write_bytes(data)
    with pytest.raises(fx.OptionError, match=message):
        read_measurement(path)


def test_channels_of_unequal_rates_are_named(tmp_path):
    row = b"  1.00000E+00  1.00000E+00\n"
    slow = block(1, (13, "N"), (0, "NONE"), row, form=(2, 2), node=1)
    fast = block(1, (12, "m/s^2"), (0, "NONE"), row, form=(2, 2), node=2).replace(b"5.00000E-01", b"2.50000E-01")
    (tmp_path / "x.uff").write_bytes(slow + fast)
    with pytest.raises(fx.OptionError, match=r"sampled unequally \(1\.tz: 2 at 2 Hz, 2\.tz: 2 at 4 Hz\)"):
        read_measurement(tmp_path / "x.uff")


def test_sample_files_of_pyuff():
    modes = read_measurement(DATA / "pyuff_uff55_translation.uff").modes
    np.testing.assert_allclose(modes.frequency_hz, [10, 12, 13])
    np.testing.assert_allclose(modes.shapes[[0, 3, 6, 9], 1], [1.82904, -0.0398226, -0.500397, 1.98289])
    assert [c.name for c in modes.outputs[:4]] == ["1.tx", "1.ty", "1.tz", "2.tx"]
    (record,) = read_measurement(DATA / "pyuff_time_history.uff").recordings
    assert record.sample_rate == 20000.0 and record.samples.shape == (1, 13)
    assert record.samples[0, [0, -1]].tolist() == [-3.81956, -5.84096]
    assert record.channels[0].quantity == "acceleration"
    (frf,) = read_measurement(DATA / "pyuff_measurement.uff").frfs
    assert frf.response[1, 0, 0] == -1.75151154918e-01 - 1.20423720701e-01j
    assert frf.outputs[0].node == "TestCase:1" and frf.outputs[0].quantity == "acceleration"
    with pytest.raises(fx.OptionError, match="no time records, frequency responses or modes"):
        read_measurement(DATA / "pyuff_testlab_geometry.uff")


def test_directions_are_those_of_the_axes_of_the_node(tmp_path):
    """Node 7 of the sample has its x axis along global z, node 1 along -x."""
    row = b"  1.00000E+00  1.00000E+00\n"
    geometry = (DATA / "pyuff_testlab_geometry.uff").read_bytes()
    kinds = [
        block(1, (12, "NONE"), (0, "NONE"), row, form=(2, 2), node=n, code=c) for n, c in ((7, 1), (7, -3), (1, 1))
    ]
    (tmp_path / "x.uff").write_bytes(geometry + b"".join(kinds))
    (record,) = read_measurement(tmp_path / "x.uff").recordings
    expected = [(0, 0, 1), (0, 1, 0), (-1, 0, 0)]
    np.testing.assert_allclose([c.direction for c in record.channels], expected, atol=1e-7)
    assert record.channels[0].position == (-1.75, 0.0, 0.1)


@pytest.mark.parametrize("is_complex", [False, True])
def test_modes_come_back(is_complex, tmp_path):
    source = read_measurement(DATA / "pyuff_uff55_translation.uff")
    damped = source.modes.poles * np.exp(1j * 0.02)
    shapes = source.modes.shapes * (np.exp(0.1j * np.arange(12))[:, None] if is_complex else 1)
    own = replace(source, modes=replace(source.modes, poles=damped, shapes=shapes))
    back = read_measurement(write_measurement(own, tmp_path / "m.uff")).modes
    np.testing.assert_allclose(back.poles, damped, rtol=1e-5)
    np.testing.assert_allclose(back.shapes, shapes, rtol=1e-5, atol=1e-5)
    assert [c.name for c in back.outputs] == [c.name for c in own.modes.outputs]
    with pytest.raises(fx.OptionError, match="identified modes are written to universal files"):
        write_measurement(own, tmp_path / "m.npz")


CSV = "time [ms];hammer [N];p1.z [g];dial [um]\n" + "".join(f"{0.5 * k};{k % 3};{0.1 * k};{2 * k}\n" for k in range(20))


def test_csv_with_a_file_of_channels(tmp_path):
    (tmp_path / "hit.csv").write_text(CSV)
    places = "channels:\n  hammer: {node: p2, direction: -z, position: [40 mm, 0 mm, 1 cm]}\n"
    places += "  p1.z: {node: p1, direction: [3, 0, 4]}\n  dial: {quantity: displacement}\n"
    (tmp_path / "hit.channels.yaml").write_text(places)
    (record,) = read_measurement(tmp_path / "hit.csv", setup="first").recordings
    assert (record.sample_rate, record.inputs, record.setup) == (2000.0, (0,), "first")
    np.testing.assert_allclose(record.samples[:, 3], [0.0, 0.3 * 9.80665, 6e-6], rtol=1e-14)
    assert record.channels == (
        fx.testing.MeasuredChannel("hammer", "force", "p2", (0.0, 0.0, -1.0), (0.04, 0.0, 0.01)),
        fx.testing.MeasuredChannel("p1.z", "acceleration", "p1", (0.6, 0.0, 0.8)),
        fx.testing.MeasuredChannel("dial", "displacement"),
    )


def test_scatter_comes_back(tmp_path):
    whole = measurement()
    frf = whole.frfs[0]
    sigma = np.random.default_rng(3).uniform(0.01, 0.1, frf.response.shape)
    own = replace(whole, recordings=(), frfs=(replace(frf, sigma=sigma),))
    for name in ("x.npz", "x.csv"):
        (back,) = read_measurement(write_measurement(own, tmp_path / name)).frfs
        np.testing.assert_allclose(back.sigma, sigma, rtol=1e-14)
    spoilt = replace(own, frfs=(replace(frf, sigma=-sigma),))
    with pytest.raises(fx.OptionError, match="sigma is a standard deviation, at least 0"):
        read_measurement(write_measurement(spoilt, tmp_path / "y.npz"))
    scaled = "channels: {" + ", ".join(f"{c.name}: {{unit: {c.unit}}}" for c in frf.outputs) + "}\n"
    (tmp_path / "x.channels.yaml").write_text(scaled)
    (given,) = read_measurement(tmp_path / "x.npz").frfs
    np.testing.assert_allclose(given.sigma, sigma, rtol=1e-14)


@pytest.mark.parametrize("part", ["record", "response"])
def test_csv_comes_back(part, tmp_path):
    whole = measurement()
    own = replace(whole, frfs=()) if part == "record" else replace(whole, recordings=())
    with pytest.raises(fx.OptionError, match="one time record or one set of responses"):
        write_measurement(own, tmp_path / "x.csv")
    own = replace(own, recordings=own.recordings[:1], frfs=own.frfs[:1])
    back = read_measurement(write_measurement(own, tmp_path / "x.csv"))
    if part == "record":
        assert np.array_equal(back.recordings[0].samples, own.recordings[0].samples)
        assert (back.recordings[0].sample_rate, back.recordings[0].setup) == (51200.0, "step 0")
    else:
        a, b = own.frfs[0], back.frfs[0]
        assert np.array_equal(b.response, a.response) and np.array_equal(b.coherence, a.coherence)
        assert (b.decay, b.averages, b.estimator) == (a.decay, a.averages, a.estimator)
        assert [c.name for c in (*b.inputs, *b.outputs)] == [c.name for c in (*a.inputs, *a.outputs)]


def edited(old, new):
    return CSV.replace(old, new, 1)


def test_csv_tells_response_and_force_of_a_driving_point_apart(tmp_path):
    """Both have one name; a file of channels may give units to either."""
    path = tmp_path / "x.csv"
    path.write_text("frequency [Hz],p / p [g/N] real,p / p [g/N] imag\n10,1,0\n20,2,0\n")
    (frf,) = read_measurement(path).frfs
    assert [c.quantity for c in (*frf.outputs, *frf.inputs)] == ["acceleration", "force"]
    (tmp_path / "x.channels.yaml").write_text("p: {node: a, direction: z, unit: g, force: lbf}\n")
    (given,) = read_measurement(path).frfs
    assert [c.quantity for c in (*given.outputs, *given.inputs)] == ["acceleration", "force"]
    assert np.allclose(given.response, frf.response / 4.4482216152605)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            edited("\n2.0;", "\n2.3;"),
            r"x\.csv:\d+: sampling is not even: a step of 0\.\d+ ms among steps of 0\.5 ms",
        ),
        (edited("\n2.0;1;", "\n2.0;nan;"), r"x\.csv:6: hammer \[N\]: 'nan' is no finite number"),
        (edited("\n2.0;1;", "\n2.0;;"), r"x\.csv:6: hammer \[N\]: 'nothing' is no finite number"),
        (edited("\n2.0;1;", "\n2.0;"), r"x\.csv:6: 4 columns are expected, here are 3"),
        ("frequency,unit,sigma\n46.8,rad/s,1 %\n53.4,rad/s,1 %\n", "lists frequencies, and signals are expected"),
        ("mode, frequency [Hz]\n1, 46.8\n", "calibrate and virtual-test take lists"),
        ("46.8 Hz\n53.4 Hz\n", "lists frequencies"),
        ("46.8\n", "lists frequencies"),
        (edited("p1.z [g]", "p1.z"), "'p1.z' has no unit; write it as `name"),
        (edited("p1.z [g]", "p1.z [kg]"), r"p1\.z: kg is no unit of a force or a motion"),
        (edited("time [ms]", "time [Hz]"), "the first column is in s, not in Hz"),
        (edited("time [ms]", "steps [ms]"), r"the first column is time \[s\] or frequency \[Hz\]"),
        ("", "a header and at least two rows"),
        ("frequency [Hz],a / b [m/N] real\n1,2\n2,3\n", "there is no column a / b imag"),
        ("frequency [Hz],a\n1,2\n2,3\n", "a column is headed `OUT / IN"),
        ("frequency [Hz],a / b [m/N] real,a / b [m/N] imag\n2,2,1\n1,3,1\n", "frequencies do not increase"),
    ],
)
def test_csv_files_that_cannot_be_used(text, message, tmp_path):
    (tmp_path / "x.csv").write_text(text)
    with pytest.raises(fx.OptionError, match=message):
        read_measurement(tmp_path / "x.csv")


HZ = np.array([10.0, 20.0, 30.0])
VALUES = np.array([1 + 2j, -3 + 0.5j, 0.25 - 4j])
EXPORTED = "Header Size: 4\r\nTitle: mount, run 3\r\nAmplitudeUnit: (m/s²)/N\r\n\r\n"
RESPONSE = "p1.z / hammer [(m/s^2)/N]"


def exported(tmp_path, rows, columns, encoding="utf-8", above=EXPORTED):
    """The response of a table as other programs export it, below a header, with headings by a file of channels."""
    (tmp_path / "t.txt").write_bytes((above + "".join(f"{row}\r\n" for row in rows)).encode(encoding))
    listed = "".join(f"  - '{name}'\n" for name in columns)
    (tmp_path / "t.channels.yaml").write_text(f"columns:\n{listed}channels:\n  p1.z: {{node: p1, direction: z}}\n")
    return read_measurement(tmp_path / "t.txt")


def test_a_table_without_headings_takes_those_of_the_file_of_channels(tmp_path):
    """Ordinal, frequency, real and imaginary part, as text that PULSE exports is read by others."""
    rows = [f"{k}\t{f:g}\t{H.real:E}\t{H.imag:E}\t" for k, (f, H) in enumerate(zip(HZ, VALUES, strict=True), 1)]
    columns = ("-", "frequency [Hz]", f"{RESPONSE} real", f"{RESPONSE} imag")
    for encoding in ("utf-8", "utf-16", "cp1252"):
        measured = exported(tmp_path, rows, columns, encoding)
        (frf,) = measured.frfs
        np.testing.assert_allclose(frf.response[:, 0, 0], VALUES, rtol=1e-6)
        assert np.array_equal(frf.frequency_hz, HZ) and frf.outputs[0].direction == (0.0, 0.0, 1.0)
        assert "t.txt: 3 lines above the table left out" in measured.notes
        assert ("t.txt is no UTF-8: read as Windows-1252" in measured.notes) == (encoding == "cp1252")


@pytest.mark.parametrize("unit", ["deg", "rad"])
def test_magnitude_and_phase_with_decimal_commas(unit, tmp_path):
    angle = np.angle(VALUES, deg=unit == "deg")
    rows = [f"{f:g};{abs(H):.12g};{a:.12g}".replace(".", ",") for f, H, a in zip(HZ, VALUES, angle, strict=True)]
    columns = ("frequency [Hz]", f"{RESPONSE} magnitude", f"p1.z / hammer [{unit}] phase")
    measured = exported(tmp_path, rows, columns)
    np.testing.assert_allclose(measured.frfs[0].response[:, 0, 0], VALUES, rtol=1e-10)
    assert "commas in numbers are read as decimal signs" in measured.notes
    headed = EXPORTED + ";".join(columns) + "\n" + "\n".join(rows) + "\n"
    (tmp_path / "headed.csv").write_text(headed, encoding="utf-8")
    np.testing.assert_allclose(read_measurement(tmp_path / "headed.csv").frfs[0].response[:, 0, 0], VALUES, rtol=1e-10)


def test_a_record_in_columns_of_spaces(tmp_path):
    rows = [f"  {0.5 * k:.1f}   {k:d}  {k * k:d}" for k in range(4)]
    (record,) = exported(tmp_path, rows, ("time [ms]", "hammer [N]", "p1.z [m/s^2]")).recordings
    np.testing.assert_allclose(record.samples, [[0, 1, 2, 3], [0, 1, 4, 9]])
    assert (record.sample_rate, record.inputs) == (2000.0, (0,))


@pytest.mark.parametrize(
    ("rows", "columns", "message"),
    [
        (["1 2", "2 3"], ("frequency [Hz]",) * 3, "no line is 3 numbers, one for each of `columns`"),
        (["1 2", "2 3 4"], ("time [s]", "p1.z [g]"), r"t\.txt:6: 2 columns are named, here are 3"),
        (["1;2,5", "2;3.5"], ("time [s]", "p1.z [g]"), r"t\.txt:5: p1\.z \[g\]: '2,5' is no finite number"),
        (["1 2", "2 3", "next table"], ("time [s]", "p1.z [g]"), r"t\.txt:7: .* 'next' is no finite number"),
        (["1 2 3", "2 3 4"], ("frequency [Hz]", "a / b [m/N] magnitude", "a / b phase"), "a phase is in deg or rad"),
        (["1 2", "2 3"], ("frequency [Hz]", "a / b [m/N] magnitude"), "there is no column a / b phase"),
        (["1 2", "2 3"], ("", "x"), r"t\.channels\.yaml:2: columns is a list of headings"),
    ],
)  # fmt: skip
def test_tables_with_named_columns_that_cannot_be_used(rows, columns, message, tmp_path):
    with pytest.raises(fx.OptionError, match=message):
        exported(tmp_path, rows, columns)


def test_columns_are_of_text_alone(tmp_path):
    path = write_measurement(measurement(), tmp_path / "t.npz")
    (tmp_path / "t.channels.yaml").write_text("columns: ['time [s]', 'a [N]']\n")
    with pytest.raises(fx.OptionError, match=r"columns are those of a table of text, and t\.npz is none"):
        read_measurement(path)


@pytest.mark.parametrize(
    ("places", "message"),
    [
        ("p9.z: {direction: x}", r"channel 'p9\.z' is not in the data; there: hammer, p1\.z, dial"),
        ("dial: {quantity: velocity}", "dial: um is no unit of velocity, which is read in m/s"),
        ("dial: {quantity: length}", r"c\.yaml:1: channel dial: there is no quantity 'length'"),
        ("dial: {direction: q}", "a direction is x, -y, ... or three numbers, not 'q'"),
        ("dial: {position: [1, 2, 3]}", "1 is no length; write it with its unit"),
        ("dial: {place: x}", "unknown key 'place'; keys: node, direction, position, quantity, unit, force, input"),
        ("dial: x", "a mapping is expected"),
    ],
)
def test_files_of_channels_that_cannot_be_used(places, message, tmp_path):
    (tmp_path / "x.csv").write_text(CSV)
    (tmp_path / "c.yaml").write_text(places + "\n")
    with pytest.raises(fx.OptionError, match=message):
        read_measurement(tmp_path / "x.csv", tmp_path / "c.yaml")


def test_places_from_a_mechanism(tmp_path):
    mechanism = fx.loads(
        """
nodes: {root: [0 mm, 0 mm, 0 mm], tip: [100 mm, 0 mm, 20 mm]}
links: {bar: {nodes: [root, tip], material: Al-7075-T6, section: {shape: circle, diameter: 5 mm}}}
ground: {root: {fixed: [tx, ty, tz, rx, ry, rz]}}
actuators: {knock: {type: force, nodes: [tip], direction: [0, 3, 4]}}
sensors: {acc: {type: acceleration, nodes: [tip], direction: -z}}
"""
    )
    (tmp_path / "x.csv").write_text(
        "time [s],knock [N],acc [g],tip.ty [mm],other [m]\n0,0,1,2,3\n1,1,2,3,4\n2,0,1,1,1\n"
    )
    (record,) = read_measurement(tmp_path / "x.csv", mechanism).recordings
    at = (0.1, 0.0, 0.02)
    assert [c.position for c in record.channels] == [at, at, at, None]
    assert [c.node for c in record.channels] == ["tip", "tip", "tip", None]
    np.testing.assert_allclose(record.channels[0].direction, (0.0, 0.6, 0.8), atol=1e-15)
    assert [c.direction for c in record.channels[1:3]] == [(0.0, 0.0, -1.0), (0.0, 1.0, 0.0)]


def test_archives_made_by_hand(tmp_path):
    samples = np.arange(24.0).reshape(2, 2, 6)
    np.savez(tmp_path / "hits.npz", sample_rate=1000.0, samples=samples, channels=["hammer [N]", "a [mm/s^2]"])
    records = read_measurement(tmp_path / "hits.npz").recordings
    assert [r.inputs for r in records] == [(0,), (0,)]
    np.testing.assert_allclose(records[1].samples, samples[1] * [[1], [1e-3]], rtol=1e-15)
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "frf.h5", "w") as file:
        file["frequency_hz"], file["response"] = [1.0, 2.0], np.full((2, 1, 1), 3 + 4j)
        file["output_channels"], file["input_channels"] = ["a [um]"], ["f [kN]"]
        file.attrs["setup"] = "left"
    (frf,) = read_measurement(tmp_path / "frf.h5").frfs
    np.testing.assert_allclose(frf.response, (3 + 4j) * 1e-9, rtol=1e-14)
    assert frf.setup == "left"


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"x": np.zeros(3)}, "neither `samples` of a time record nor a `response`"),
        ({"samples": np.zeros((2, 5)), "channels": ["a [N]", "b [m]"]}, "there is no array 'time'"),
        ({"samples": np.zeros((3, 5)), "channels": ["a [N]", "b [m]"], "sample_rate": 1.0}, "not those of 2 channels"),
        (
            {"samples": np.zeros((2, 3)), "channels": ["a [N]", "b [m]"], "time": [0.0, 1.0, 3.0]},
            "time is not evenly spaced",
        ),
        (
            {"response": np.full((2, 1, 1), np.nan), "frequency_hz": [1.0, 2.0], "output_channels": ["a [m]"]}
            | {"input_channels": ["b [N]"]},
            "responses are finite numbers; these are not",
        ),
    ],
)
def test_archives_that_cannot_be_used(arrays, message, tmp_path):
    np.savez(tmp_path / "x.npz", **arrays)
    with pytest.raises(fx.OptionError, match=message):
        read_measurement(tmp_path / "x.npz")


def test_folders_and_lists_of_files_are_one_measurement(tmp_path):
    own = measurement()
    for k in range(2):
        write_measurement(replace(own, recordings=own.recordings[k : k + 1], frfs=()), tmp_path / f"{k}.uff")
    write_measurement(replace(own, recordings=()), tmp_path / "responses.npz")
    back = read_measurement(tmp_path)
    assert (len(back.recordings), len(back.frfs)) == (2, 2)
    assert len(read_measurement([tmp_path / "1.uff", tmp_path / "0.uff"]).recordings) == 2


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("missing.uff", "the file does not exist"),
        ("x.pdf", r"\.pdf is no format of measured data"),
        ("x.npz", "not a NumPy archive"),
        ("x.h5", "not an HDF5 file"),
        ("x.csv", "the file cannot be read"),
    ],
)
def test_files_that_are_something_else(name, message, tmp_path):
    if name != "missing.uff":
        (tmp_path / name).write_bytes(b"\xff\xfe\x00 nothing")
    with pytest.raises(fx.OptionError, match=message):
        read_measurement(tmp_path / name)


SLOW_H5 = pytest.param("t.h5", marks=pytest.mark.slow)  # each by a process of its own


@pytest.mark.parametrize("name", ["t.uff", "t.unv", "t.npz", SLOW_H5, "t.csv", "modes.uff", "geometry.uff"])
def test_damaged_files_are_read_or_refused(name, tmp_path):
    own = measurement()
    if name.startswith("t."):
        own = replace(own, recordings=own.recordings[:1], frfs=() if name == "t.csv" else own.frfs)
        options = {"binary": False} if name == "t.unv" else {}
        data = write_measurement(own, tmp_path / name, **options).read_bytes()
    else:
        data = (DATA / {"m": "pyuff_uff55_translation.uff", "g": "pyuff_testlab_geometry.uff"}[name[0]]).read_bytes()
    rng, refused = np.random.default_rng(7), 0
    for k in range(60):
        content = bytearray(data)
        at = int(rng.integers(len(data)))
        if k % 3 == 0:
            del content[at:]
        elif k % 3 == 1:
            content[at] = int(rng.integers(256))
        else:
            content[at : at + 1] = (b"nan", b"-", b"1e999", b" ", b"9999999999")[k % 5]
        (tmp_path / name).write_bytes(bytes(content))
        try:
            read_measurement(tmp_path / name)
        except fx.FlexuraError as error:
            refused += 1
            assert name in str(error)
    assert refused >= 5


def test_what_cannot_be_written_leaves_no_file(tmp_path):
    own = measurement()
    spoilt = replace(own, recordings=(replace(own.recordings[0], samples=np.full((5, 37), np.nan)),))
    for thing, name, options, message in (
        (spoilt, "x.uff", {}, "not finite, which universal files cannot hold"),
        (own, "x.xyz", {}, "is no format"),
        (own, "x.npz", {"binary": True}, "has no option 'binary'"),
        (1.0, "x.npz", {}, "a measurement is written, not a float"),
    ):
        with pytest.raises(fx.OptionError, match=message):
            write_measurement(thing, tmp_path / name, **options)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["t.uff", "t.csv", "t.txt", "t.npz", pytest.param("t.h5", marks=pytest.mark.slow)])
def test_a_file_of_channels_says_what_excites_in_every_format(name, tmp_path):
    own = replace(measurement(), frfs=())
    path = write_measurement(replace(own, recordings=own.recordings[:1]), tmp_path / name)
    assert read_measurement(path).recordings[0].inputs == (0,)
    (tmp_path / "t.channels.yaml").write_text("p1.tz: {input: true}\nhammer: {input: false}\n")
    assert read_measurement(path).recordings[0].inputs == (1,)


def test_stress_has_its_data_type_and_exponents(tmp_path):
    gauge = fx.testing.MeasuredChannel("gauge", "stress", "7", (1.0, 0.0, 0.0), None)
    record = fx.testing.Recording(1000.0, np.ones((2, 4)), (HAMMER, gauge), (0,), "", "")
    path = write_measurement(fx.Measurement("test", (record,)), tmp_path / "t.uff", binary=False)
    assert f"{2:10d}{-2:5d}{1:5d}{0:5d} {'stress':<20} {'Pa':<20}" in path.read_text()
    assert read_measurement(path).recordings[0].channels[1].quantity == "stress"
