"""Statics, kinetostatics, responses and hand-over from the command line: right numbers, whole files, clear refusals."""

import csv
import json

import numpy as np
import pytest

import flexura as fx
from flexura.cli import main

BEAM = """
flexura: 1
name: driven cantilever
corrections: none
damping: 0.02
parameters: {length: 100 mm}
nodes: {root: [0, 0, 0], tip: [length, 0, 0]}
links:
  beam:
    nodes: [root, tip]
    material: Al-6061-T6
    section: {shape: rectangle, width: 10 mm, thickness: 2 mm}
    reference: z
    theory: euler_bernoulli
    elements: 8
actuators:
  coil: {type: force, nodes: [tip], direction: z, limit: 2 N}
sensors:
  gap: {type: displacement, nodes: [tip], direction: z}
  accelerometer: {type: acceleration, nodes: [tip], direction: z}
ground: {root: clamped}
"""
E, L = 68.9e9, 0.1
I_Y = 10e-3 * (2e-3) ** 3 / 12


@pytest.fixture
def beam(tmp_path):
    path = tmp_path / "beam.yaml"
    path.write_text(BEAM, encoding="utf-8")
    return path


@pytest.fixture
def flexura(capsys, monkeypatch):
    """Run a command; returns exit status, stdout and stderr."""

    def run(*words):
        monkeypatch.setattr("sys.argv", ["flexura", *map(str, words)])
        status = 0
        try:
            main()
        except SystemExit as end:
            status = end.code or 0
        out = capsys.readouterr()
        return status, out.out, out.err

    return run


def test_statics_of_a_cantilever(beam, flexura):
    status, out, _ = flexura("statics", beam, "--actuator", "c*=1.5 N", "--node", "tip", "--json")
    data = json.loads(out)
    assert status == 0
    assert data["readings"]["gap"] == pytest.approx(1.5 * L**3 / (3 * E * I_Y), rel=1e-9)
    assert data["displacement"]["tip"][4] == pytest.approx(-1.5 * L**2 / (2 * E * I_Y), rel=1e-9)
    assert data["stress"][0]["von_mises_Pa"] == pytest.approx(1.5 * L * 1e-3 / I_Y, rel=1e-3)
    assert "yields at" in flexura("statics", beam, "--load", "tip=0,0,1 N")[1]


def test_kinetostatics_of_a_cantilever(beam, flexura):
    status, out, _ = flexura("kinetostatics", beam, "--platform", "tip", "--json")
    data = json.loads(out)
    assert status == 0
    assert data["kind"] == "1R" and data["freedoms"][0]["direction"] == pytest.approx([0, 1, 0], abs=1e-6)
    # a tip force turns the end of a cantilever about a point two thirds of the length behind it
    assert data["freedoms"][0]["point"][0] == pytest.approx(L / 3, rel=1e-6)
    assert data["workspace"][2] == pytest.approx([-2 * L**3 / (3 * E * I_Y), 2 * L**3 / (3 * E * I_Y)], rel=1e-9)
    assert "1R" in flexura("kinetostatics", beam, "--platform", "tip")[1]


def test_frequency_response_and_its_files(beam, flexura, tmp_path):
    table = tmp_path / "h.csv"
    words = ("frequency-response", beam, "--band", "20,400 Hz", "--out", table, "--plot", tmp_path / "out")
    status, out, _ = flexura(*words, "--json")
    data = json.loads(out)
    assert status == 0
    assert data["damping_ratios"][0] == pytest.approx(0.02)
    first = 1.8751040687**2 / (2 * np.pi) * np.sqrt(E * I_Y / (2700 * 20e-6 * L**4))
    assert data["resonances_hz"][0] == pytest.approx(first, rel=1e-3)  # proven to that
    with table.open(encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    assert rows[0][1] == "gap / coil [m/N]" and len(rows) == len(data["frequency_hz"]) + 1
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        *("bode_01.png", "bode_02.png", "matrix.png", "nyquist_01.png", "nyquist_02.png")
    ]
    assert "resonance" in flexura(*words)[1]


def test_time_response_and_its_file(beam, flexura, tmp_path):
    table = tmp_path / "y.csv"
    words = ("time-response", beam, "--dt", "50 us", "--step", "coil=1 N", "--duration", "2 s", "-o", "gap")
    status, out, _ = flexura(*words, "--out", table, "--json")
    data = json.loads(out)
    assert status == 0
    assert data["outputs"]["gap [m]"][-1] == pytest.approx(L**3 / (3 * E * I_Y), rel=1e-3)
    with table.open(encoding="utf-8") as stream:
        assert next(csv.reader(stream)) == ["time [s]", "coil [N]", "gap [m]"]
    assert "gap" in flexura(*words)[1]


def test_a_signal_file_drives_the_mechanism(beam, flexura, tmp_path):
    signal = tmp_path / "u.csv"
    time = np.arange(2001) * 1e-4
    rows = "\n".join(f"{t:.4f},{np.sin(60 * t):.9f}" for t in time)
    signal.write_text(f"time [s],coil [N]\n{rows}\n", encoding="utf-8")
    status, out, _ = flexura("time-response", beam, "--dt", "0.1ms", "--signals", signal, "-o", "gap", "--json")
    mechanism = fx.load(beam)
    ours = fx.time_response(mechanism, inputs={"coil": np.sin(60 * time)}, outputs=["gap"], dt=1e-4).of("gap")
    assert status == 0
    assert json.loads(out)["outputs"]["gap [m]"] == pytest.approx(ours, abs=1e-8 * abs(ours).max())


@pytest.mark.parametrize("name", ["b.npz", "b.mat", "b.h5", "b.mtx", "b.vtu", "b.uff"])
def test_every_format_is_written(beam, flexura, tmp_path, name):
    status, out, err = flexura("export", beam, "--out", tmp_path / name, "-n", "2", "-i", "coil", "-o", "gap")
    assert (status, err) == (0, "")
    assert out.count("wrote ") >= 1


def test_a_discrete_state_space_is_written(beam, flexura, tmp_path):
    words = (
        "export",
        beam,
        "--out",
        tmp_path / "d.npz",
        "-n",
        "2",
        "-i",
        "coil",
        "-o",
        "gap",
        "--dt",
        "0.1ms",
        "--delay",
        "50us",
    )
    assert flexura(*words)[0] == 0
    data = np.load(tmp_path / "d.npz")
    assert float(data["dt"]) == 1e-4
    gain = data["C"] @ np.linalg.solve(np.eye(len(data["A"])) - data["A"], data["B"]) + data["D"]
    assert gain[0, 0] == pytest.approx(L**3 / (3 * E * I_Y), rel=1e-8)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("frequency-response", "--band", "0,100 Hz"), "0 < from < to"),
        (("frequency-response", "--band", "100 Hz"), "FROM,TO"),
        (("frequency-response", "--band", "1,100 Hz", "-i", "coal"), "did you mean coil"),
        (("frequency-response", "--band", "1,100 Hz", "-o", "tip.tw"), "there is no output"),
        (("frequency-response", "--band", "1,100 Hz", "--damping", "1.0"), "below 1"),
        (("frequency-response", "--band", "1,100 Hz", "-o", "root.tz"), "held"),
        (("time-response", "--dt", "1", "--step", "coil=1 N", "--duration", "1s"), "time with its unit"),
        (("time-response", "--dt", "1ms", "--step", "coil=1 N"), "duration"),
        (("time-response", "--dt", "1ms", "--duration", "1 s"), "nothing acts"),
        (("time-response", "--dt", "1ms", "--signals", "nowhere.csv"), "does not exist"),
        (("statics", "--actuator", "coil"), "NAME=VALUE"),
        (("statics", "--actuator", "coil=nan N"), "finite"),
        (("kinetostatics", "--platform", "root"), "held"),
        (("frequency-response", "--band", "1,100 Hz", "--out", "h.uff"), "must be named .csv"),
        (("frequency-response", "--band", "1 Hz,2 s"), "no frequency"),
        (("export", "--out", "x.xyz"), "no known format"),
        (("export", "--out", "x.uff", "--what", "response"), "--band"),
    ],
)
def test_bad_input_is_refused_in_words(beam, flexura, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    status, out, err = flexura(words[0], beam, *words[1:])
    assert (status, out) == (2, "")
    assert said in err
    assert [p.name for p in tmp_path.iterdir()] == ["beam.yaml"]


def test_a_sensor_at_the_clamp_is_refused_at_its_line(beam, flexura):
    text = BEAM.replace("sensors:", "sensors:\n  stuck: {type: velocity, nodes: [root], direction: [1, 0, 1]}")
    beam.write_text(text, encoding="utf-8")
    status, _, err = flexura("check", beam)
    assert status == 2
    line = text.splitlines().index("  stuck: {type: velocity, nodes: [root], direction: [1, 0, 1]}") + 1
    assert f"beam.yaml:{line}: sensors.stuck: nothing can move here" in err


def test_a_partly_held_node_may_be_read_where_it_is_free(beam, flexura):
    text = BEAM.replace("ground: {root: clamped}", "ground: {root: clamped, tip: {fixed: [ty]}}")
    beam.write_text(text, encoding="utf-8")
    assert flexura("check", beam)[0] == 0
    beam.write_text(text.replace("fixed: [ty]", "fixed: [tz]"), encoding="utf-8")
    status, _, err = flexura("check", beam)
    assert status == 2 and err.count("nothing can move here") == 3


STACKED = BEAM.replace(
    "  coil:",
    """\
  stack: {type: piezo, nodes: [foot, tip], stiffness: 1 N/um, free_stroke: 20 um}
  amplified: {type: piezo, nodes: [foot, tip], stiffness: 1 N/um, free_stroke: 20 um, gain: 0.2 um/V}
  twist: {type: moment, nodes: [tip], direction: y}
  turntable: {type: base_rotation, direction: z}
  coil:""",
)
STACKED = STACKED.replace("tip: [length, 0, 0]}", "tip: [length, 0, 0], foot: [length, 0, -20 mm]}")
STACKED = STACKED.replace("{root: clamped}", "{root: clamped, foot: clamped}")


@pytest.fixture
def stacked(tmp_path):
    path = tmp_path / "stacked.yaml"
    path.write_text(STACKED, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("written", "other_unit"),
    [
        ("coil=1500 mN", "coil=1.5 N"),
        ("coil=1.5N", "coil=1.5 N"),
        ("stack=3 um", "stack=3e-6 m"),
        ("amplified=0.075 kV", "amplified=75 V"),
        ("twist=20 N*mm", "twist=0.02 N*m"),
        ("*oil=2 [N]", "coil=2 N"),
    ],
)
def test_a_command_is_the_same_in_every_unit(stacked, flexura, written, other_unit):
    one, other = (
        flexura("statics", stacked, "--actuator", text, "--node", "tip", "--json") for text in (written, other_unit)
    )
    assert one == other and one[0] == 0
    assert json.loads(one[1])["displacement"]["tip"][2] != 0


@pytest.mark.parametrize(
    ("option", "text", "said"),
    [
        ("--actuator", "stack=3 N", "--actuator 'stack=3 N': N is no unit of stack, which takes expansion in m; write"),
        ("--actuator", "amplified=3 um", "um is no unit of amplified, which takes voltage in V"),
        ("--actuator", "*a*=3 um", "um is no unit of amplified"),
        ("--actuator", "twist=3 N*m/deg", "N*m/deg is no unit of twist, which takes moment in N*m"),
        ("--actuator", "turntable=1 Hz^2", "Hz^2 is no unit of turntable, which takes angular_acceleration in rad/s^2"),
        ("--actuator", "coil=3 parsnips", "'parsnips' is not a unit"),
        ("--actuator", "stack=3", "'3' has no unit; stack takes expansion in m"),
        ("--actuator", "coil=-inf", "a number must be finite"),
        ("--actuator", "coil", "NAME=VALUE is expected"),
        ("--actuator", "coil=1,2", "NAME=VALUE is expected"),
        ("--actuator", "caul=1 N", "there is no input 'caul'"),
    ],
)
def test_a_command_in_a_unit_of_another_quantity_is_refused(stacked, flexura, option, text, said):
    status, out, err = flexura("statics", stacked, option, text)
    assert status == 2 and not out
    assert said in err and text in err


def test_a_command_given_twice_is_refused(beam, flexura):
    status, _, err = flexura("statics", beam, "--actuator", "coil=1 N", "--actuator", "coil=2 N")
    assert status == 2 and "coil has a value already" in err


def test_buckling_takes_commands_with_units(beam, flexura):
    one, other = (flexura("buckling", beam, "--actuator", text, "--json") for text in ("coil=500 mN", "coil=0.5 N"))
    assert one == other and one[0] == 0
    assert "um is no unit of coil" in flexura("buckling", beam, "--actuator", "coil=5 um")[2]


@pytest.mark.parametrize(
    ("option", "written", "other_unit"),
    [
        ("--step", "coil=500 mN", "coil=0.5 N"),
        ("--step", "twist=10 N*mm", "twist=0.01 N*m"),
        ("--step", "ground.tz=100 mm/s^2", "ground.tz=0.1 m/s^2"),
        ("--step", "turntable=180 deg/s^2", "turntable=3.141592653589793 rad/s^2"),
        ("--step", "turntable=2 1/s^2", "turntable=2 rad/s^2"),
        ("--impulse", "coil=5 mN*s", "coil=0.005 N*s"),
        ("--impulse", "ground.tz=10 mm/s", "ground.tz=0.01 m/s"),
        ("--impulse", "stack=10 um*ms", "stack=1e-8 m*s"),
        ("--start", "amplified=0.01 kV", "amplified=10 V"),
        ("--hammer", "coil=5000 mN,2 ms", "coil=5 N,0.002 s"),
        ("--sweep", "coil=1000 mN,10 Hz,0.1 kHz", "coil=1 N,10 Hz,100 Hz"),
        ("--noise", "coil=1000 mN,10 Hz,0.1 kHz", "coil=1 N,10 Hz,100 Hz"),
        ("--noise", "coil=1000 mN", "coil=1 N"),
    ],
)
def test_signals_are_the_same_in_every_unit(stacked, flexura, option, written, other_unit):
    one, other = (
        flexura("time-response", stacked, "--dt", "1ms", "--duration", "50ms", "-o", "gap", option, text, "--json")
        for text in (written, other_unit)
    )
    assert one == other and one[0] == 0


@pytest.mark.parametrize(
    ("option", "text", "said"),
    [
        ("--step", "coil=5 um", "um is no unit of coil, which takes force in N"),
        ("--impulse", "coil=5 N", "N is no unit of coil, which takes impulses of force in N*s"),
        (
            "--impulse",
            "turntable=5 Hz",
            "Hz is no unit of turntable, which takes impulses of angular_acceleration in rad/s",
        ),
        ("--start", "coil=5 V", "V is no unit of coil"),
        ("--hammer", "coil=5 m,2 ms", "m is no unit of coil"),
        ("--hammer", "coil=5 N,2 N", "is no time"),
        ("--hammer", "coil=5 N", "NAME=PEAK,WIDTH is expected"),
        ("--sweep", "coil=5 N,10 rad/s,100 rad/s", "'10 rad/s' is no frequency; it is written in Hz"),
        ("--sweep", "coil=5 Pa,10 Hz,100 Hz", "Pa is no unit of coil"),
        ("--noise", "coil=5 N,10", "NAME=RMS[,FROM,TO] is expected"),
        ("--noise", "coil=5 N,10 Hz,60 rpm", "'60 rpm' is no frequency"),
    ],
)
def test_signals_in_units_of_another_quantity_are_refused(stacked, flexura, option, text, said):
    status, out, err = flexura("time-response", stacked, "--dt", "1ms", "--duration", "50ms", "-o", "gap", option, text)
    assert status == 2 and not out
    assert f"{option} {text!r}: " in err and said in err
