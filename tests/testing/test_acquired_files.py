"""Measured data of MATLAB, LabVIEW and sound recorders, written by SciPy, npTDMS and byte by byte."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.io import savemat, wavfile

import flexura as fx
from flexura.io import read_measurement, write_measurement
from flexura.sizes import size_limits

RATE = 2048.0
N = 300
SAMPLES = np.random.default_rng(1).normal(size=(3, N))
HEADINGS = np.array(["hammer [lbf]", "p1.z [g]", "p2.z [mm]"], dtype=object)
FACTORS = np.array([4.4482216152605, 9.80665, 1e-3])[:, None]
UNITS = "channels: {hammer: {unit: lbf}, p1: {unit: g, direction: z}, p2: {unit: mm}}\n"


def refused(path, message, **options):
    with pytest.raises(fx.OptionError, match=message):
        read_measurement(path, **options)


def same(record, inputs=(0,)):
    assert record.sample_rate == pytest.approx(RATE, rel=1e-9) and record.inputs == inputs
    np.testing.assert_allclose(record.samples, SAMPLES * FACTORS, rtol=1e-12)
    assert [c.quantity for c in record.channels] == ["force", "acceleration", "displacement"]


@pytest.mark.parametrize("compressed", [True, False])
@pytest.mark.parametrize(
    "held",
    [
        {"samples": SAMPLES, "sample_rate": RATE, "channels": HEADINGS},
        {"data": SAMPLES.T, "Fs": RATE, "names": np.array(["hammer", "p1.z", "p2.z"], dtype=object),
         "units": np.array(["lbf", "g", "mm"], dtype=object)},
        {"hit": {"data": SAMPLES.T, "t": np.arange(N) / RATE, "channels": HEADINGS}},
    ],
)  # fmt: skip
def test_arrays_of_matlab(held, compressed, tmp_path):
    savemat(tmp_path / "t.mat", held, do_compression=compressed)
    (record,) = read_measurement(tmp_path / "t.mat").recordings
    same(record)
    assert [c.name for c in record.channels] == ["hammer", "p1.z", "p2.z"]


def test_a_variable_for_every_channel(tmp_path):
    own = dict(zip(("hammer", "p1", "p2"), SAMPLES, strict=True))
    savemat(tmp_path / "t.mat", own | {"fs": RATE, "comment": "first hit", "table": np.eye(3)})
    refused(tmp_path / "t.mat", r"hammer has no unit in the file: a file of channels says it, as hammer: \{unit: m/s")
    (tmp_path / "channels.yaml").write_text(UNITS)
    read = read_measurement(tmp_path / "t.mat")
    same(read.recordings[0])
    assert read.recordings[0].channels[1].direction == (0.0, 0.0, 1.0)
    assert "no vectors of samples: table" in read.notes[0]
    savemat(tmp_path / "t.mat", own | {"p2": SAMPLES[2, :-1], "fs": RATE})
    refused(tmp_path / "t.mat", "p2 has 299 samples and hammer has 300")
    savemat(tmp_path / "t.mat", own)
    refused(tmp_path / "t.mat", "nor `time` or `fs` beside variables of channels; found hammer, p1, p2")
    savemat(tmp_path / "t.mat", own | {"time": np.arange(N) ** 1.1})
    refused(tmp_path / "t.mat", "time is not evenly spaced")


def test_several_hits_in_an_array_of_structs(tmp_path):
    one = {"fs": RATE, "hammer": SAMPLES[0], "p1": SAMPLES[1], "p2": SAMPLES[2]}
    hits = np.array([tuple(x for x in one.values())] * 2, dtype=[(name, object) for name in one])
    savemat(tmp_path / "t.mat", {"hits": hits})
    (tmp_path / "t.channels.yaml").write_text(UNITS)
    read = read_measurement(tmp_path / "t.mat")
    assert [r.name for r in read.recordings] == ["hits1", "hits2"]
    same(read.recordings[1])


def test_responses_of_matlab(tmp_path):
    H = np.arange(40.0).reshape(20, 2, 1) * (1 + 2j)
    ends = {"output_channels": np.array(["a [g]", "b [mm]"], dtype=object), "input_channels": "f [N]"}
    savemat(tmp_path / "t.mat", {"H": H[..., 0], "freq": np.arange(1.0, 21.0), "coherence": np.ones((20, 2)), **ends})
    (frf,) = read_measurement(tmp_path / "t.mat").frfs
    np.testing.assert_allclose(frf.response, H * np.array([[9.80665], [1e-3]]), rtol=1e-14)
    assert frf.coherence.shape == (20, 2, 1)


def test_what_matlab_leaves_open(tmp_path):
    savemat(tmp_path / "t.mat", {"data": SAMPLES, "fs": RATE})
    refused(tmp_path / "t.mat", "have no .channels.: give a file of channels that names them")
    (tmp_path / "t.channels.yaml").write_text(UNITS)
    same(read_measurement(tmp_path / "t.mat").recordings[0])
    savemat(tmp_path / "t.mat", {"data": SAMPLES[:, :3], "fs": RATE})
    refused(tmp_path / "t.mat", "which are rows cannot be told")
    savemat(tmp_path / "t.mat", {"data": SAMPLES, "channels": HEADINGS})
    refused(tmp_path / "t.mat", "there is no array 'time'")
    with pytest.raises(fx.OptionError, match=r"no format of measured data to write; known: \.npz"):
        write_measurement(fx.Measurement("t"), tmp_path / "w.mat")


@pytest.mark.parametrize("compressed", [True, False])
def test_a_matlab_file_that_is_cut_off(compressed, tmp_path):
    savemat(tmp_path / "t.mat", {"fs": RATE, "hammer": SAMPLES[0]}, do_compression=compressed)
    whole = (tmp_path / "t.mat").read_bytes()
    (tmp_path / "t.mat").write_bytes(whole[:-10])
    refused(tmp_path / "t.mat", "the file ends 10 bytes too soon: is it complete")
    for cut in (0, 50, 127):
        (tmp_path / "t.mat").write_bytes(whole[:cut])
        refused(tmp_path / "t.mat", "not a MATLAB file, or (cut off in its first bytes|damaged)")


def test_a_matlab_file_that_unpacks_to_too_much(tmp_path):
    savemat(tmp_path / "t.mat", {"fs": RATE, "hammer": np.zeros(300_000)}, do_compression=True)
    with size_limits(file_bytes=100_000):
        refused(tmp_path / "t.mat", "t.mat, unpacked")


def _matlab73(path, own):
    """A file as version 7.3 has it: a block of text before the HDF5, dimensions backwards, texts as numbers."""
    h5py = pytest.importorskip("h5py")

    def put(group, name, value):
        if isinstance(value, list):
            cells = [put(file.require_group("#refs#"), f"c{len(file['#refs#'])}", text).ref for text in value]
            item = group.create_dataset(name, data=np.array(cells, dtype=h5py.ref_dtype)[:, None], dtype=h5py.ref_dtype)
            kind = b"cell"
        elif isinstance(value, str):
            item = group.create_dataset(name, data=np.array([[ord(c)] for c in value], dtype=np.uint16))
            kind = b"char"
        else:
            item = group.create_dataset(name, data=np.atleast_2d(value).T)
            kind = b"double"
        item.attrs["MATLAB_class"] = np.bytes_(kind)
        return item

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in own.items():
            at, _, last = name.rpartition(".")
            group = file.require_group(at) if at else file
            if at:
                group.attrs["MATLAB_class"] = np.bytes_(b"struct")
            put(group, last, value)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\0\x02IM")


@pytest.mark.parametrize("lead", ["", "hit."])
def test_version_7_3(lead, tmp_path):
    own = {f"{lead}data": SAMPLES.T, f"{lead}fs": RATE, f"{lead}names": ["hammer", "p1.z", "p2.z"]}
    _matlab73(tmp_path / "t.mat", own | {f"{lead}units": ["lbf", "g", "mm"], f"{lead}setup": "left"})
    (record,) = read_measurement(tmp_path / "t.mat").recordings
    same(record)
    assert (record.setup, record.channels[1].name) == ("left", "p1.z")
    (tmp_path / "t.mat").write_bytes((tmp_path / "t.mat").read_bytes()[:3000])
    refused(tmp_path / "t.mat", "damaged")


def test_volts_become_what_a_sensor_senses(tmp_path):
    time = np.arange(N) / RATE
    volts = SAMPLES * np.array([[0.01], [0.1], [1.0]])
    rows = "\n".join(",".join(map(repr, row)) for row in np.vstack([time, volts]).T.tolist())
    (tmp_path / "t.csv").write_text(f"time [s],hammer [V],p1 [V],p2 [mm]\n{rows}\n")
    entries = "hammer: {sensitivity: 10 mV/lbf}, p1: {sensitivity: 100 mV/g}"
    (tmp_path / "t.channels.yaml").write_text(f"channels: {{{entries}}}\n")
    same(read_measurement(tmp_path / "t.csv").recordings[0])
    for wrong, message in (
        ("p2: {sensitivity: 10 mV/um}", "p2 is displacement in the data: a sensitivity is for a voltage"),
        ("p1: {sensitivity: 100 mA/g}", "a sensitivity is volts per unit, e.g. 100 mV/g"),
        ("p1: {sensitivity: 100 mV/K}", "K is no unit of a force or a motion"),
        ("p1: {full_scale: 50}", "a full scale is a value with its unit"),
        ("p1: {full_scale: 50 g}", "p1 has a full scale, and only the samples of WAV files are shares of one"),
    ):
        (tmp_path / "t.channels.yaml").write_text(f"channels: {{{wrong}}}\n")
        refused(tmp_path / "t.csv", message)


@pytest.mark.parametrize(("kind", "steps"), [("<i2", 2**15), ("<i4", 2**31), ("u1", 2**7), ("<f4", None)])
def test_sound_recorders(kind, steps, tmp_path):
    shares = SAMPLES / 8
    written = shares * (steps or 1) + (128 if kind == "u1" else 0)
    wavfile.write(tmp_path / "t.wav", int(RATE), (np.round(written) if steps else written).astype(kind).T)
    refused(tmp_path / "t.wav", "names its 3 in their order")
    scales = "hammer: {full_scale: 8 lbf}, p1: {full_scale: 0.8 V, sensitivity: 100 mV/g}, p2: {full_scale: 8 mm}"
    (tmp_path / "t.channels.yaml").write_text(f"channels: {{{scales}}}\n")
    (record,) = read_measurement(tmp_path / "t.wav").recordings
    assert np.abs(record.samples / FACTORS - SAMPLES).max() < (1e-6 if steps is None else 8 / steps)
    assert record.inputs == (0,) and record.sample_rate == RATE
    assert [c.quantity for c in record.channels] == ["force", "acceleration", "displacement"]
    whole = (tmp_path / "t.wav").read_bytes()
    for cut in (len(whole) - 24, 30, 5):
        (tmp_path / "t.wav").write_bytes(whole[:cut])
        refused(tmp_path / "t.wav", "too soon: is it complete|not a WAV file, or damaged")


def test_shares_need_their_full_scale(tmp_path):
    wavfile.write(tmp_path / "t.wav", 1000, (1000 * SAMPLES.T).astype("<i2"))
    (tmp_path / "t.channels.yaml").write_text(UNITS)
    refused(tmp_path / "t.wav", "hammer: integers are shares of a full scale")


def _tdms(path, rates=(RATE, RATE, RATE), lengths=(N, N, N), units=("lbf", "g", "mm")):
    nptdms = pytest.importorskip("nptdms")
    channels = []
    for name, x, rate, n, unit in zip(("hammer", "p1", "p2"), SAMPLES, rates, lengths, units, strict=True):
        properties = {"wf_increment": 1 / rate} if rate else {}
        properties |= {"unit_string": unit} if unit else {}
        channels.append(nptdms.ChannelObject("hit", name, x[:n], properties=properties))
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(channels)


def test_waveforms_of_labview(tmp_path):
    path = tmp_path / "t.tdms"
    _tdms(path)
    (record,) = read_measurement(path).recordings
    same(record)
    assert record.name == "hit"
    _tdms(path, units=("", "g", "mm"))
    refused(path, "hit: hammer has no unit in the file")
    (tmp_path / "channels.yaml").write_text(UNITS)
    same(read_measurement(path).recordings[0])
    _tdms(path, rates=(RATE, 0, RATE))
    refused(path, r"hit: p1 has no sample rate \(wf_increment\)")
    _tdms(path, rates=(RATE, 2 * RATE, RATE))
    refused(path, "hammer is sampled at 2048 Hz and p1 at 4096 Hz")
    _tdms(path, lengths=(N, N, N - 1))
    refused(path, "p2 has 299 samples and hammer has 300")
    _tdms(path)
    whole = path.read_bytes()
    for cut in (len(whole) - 100, 200, 20, 3):
        path.write_bytes(whole[:cut])
        refused(path, "the file ends within its last segment|not a TDMS file, or damaged|there are no signals")
