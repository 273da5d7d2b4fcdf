"""Signals: what they are, and files of them with everything that can be wrong."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura import signals

T = np.linspace(0, 2, 4001)


def test_step_and_half_sine():
    """Amplitudes, places, and the impulse 2 A w/pi of a half sine."""
    assert np.array_equal(signals.step(3.0, 0.5)(np.array([0.0, 0.4999, 0.5, 1.0])), [0, 0, 3, 3])
    pulse = signals.half_sine(5.0, 0.4, at=0.3)(T)
    assert np.trapezoid(pulse, T) == pytest.approx(2 * 5 * 0.4 / np.pi, rel=1e-5)
    assert pulse.max() == pytest.approx(5.0) and T[pulse.argmax()] == pytest.approx(0.5)
    assert not pulse[(T < 0.3) | (T > 0.7001)].any()


def test_sine_and_sweep():
    """The instantaneous frequency of a sweep runs as its law says: its phase is the integral."""
    assert signals.sine(2.0, 3.0, 0.4)(T) == pytest.approx(2 * np.sin(2 * np.pi * 3 * T + 0.4))
    linear = signals.sweep(1.5, 2.0, 10.0, 1.5)(T)
    inside = T <= 1.5
    assert linear[inside] == pytest.approx(1.5 * np.sin(2 * np.pi * (2 * T + 8 / 3 * T**2))[inside], abs=1e-9)
    assert not linear[~inside].any()
    logarithmic = signals.sweep(1.0, 2.0, 32.0, 2.0, law="logarithmic")(T)
    assert logarithmic == pytest.approx(np.sin(2 * np.pi * 2 * 2 / np.log(16) * (16 ** (T / 2) - 1)), abs=1e-9)


def test_random():
    """Root mean square, band and seed."""
    noise = signals.random(0.7, (50.0, 120.0), seed=4)
    x = noise(T[:-1])
    assert np.sqrt(np.mean(x**2)) == pytest.approx(0.7)
    spectrum, hz = np.abs(np.fft.rfft(x)), np.fft.rfftfreq(4000, T[1])
    assert spectrum[(hz < 49.9) | (hz > 120.1)].max() < 1e-9 * spectrum.max()
    assert np.array_equal(x, noise(T[:-1])) and not np.array_equal(x, signals.random(0.7, (50.0, 120.0), 5)(T[:-1]))
    wide = signals.random(0.7, seed=1)(T)
    assert np.sqrt(np.mean(wide**2)) == pytest.approx(0.7)
    with pytest.raises(fx.OptionError, match="between the frequencies"):
        signals.random(1.0, (50.01, 50.02))(T)


@pytest.mark.parametrize(
    "make",
    [
        lambda: signals.step(np.nan),
        lambda: signals.step(1.0, np.inf),
        lambda: signals.half_sine(1.0, 0.0),
        lambda: signals.half_sine(np.inf, 1.0),
        lambda: signals.sine(1.0, -2.0),
        lambda: signals.sine(1.0, 2.0, np.nan),
        lambda: signals.sweep(1.0, 0.0, 2.0, 1.0),
        lambda: signals.sweep(1.0, 1.0, 2.0, 1.0, law="square"),
        lambda: signals.random(np.inf),
        lambda: signals.random(1.0, (5.0, 2.0)),
        lambda: signals.random(1.0, (-5.0, 2.0)),
        lambda: signals.random(1.0, (0.0, np.inf)),
    ],
)
def test_impossible_signals(make):
    """Numbers that are not finite or not positive."""
    with pytest.raises(fx.OptionError):
        make()


def written(folder, text, encoding="utf-8"):
    """A file with this text."""
    file = folder / "signals.csv"
    file.write_text(text, encoding=encoding)
    return file


@pytest.mark.parametrize("separator", [",", ";", "\t", " , "])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_files(tmp_path, separator, encoding):
    """Any separator, units in brackets, comments and empty lines; time starts where it starts."""
    lines = ["# measured", "stage.tz [N],Time [s],push", "", "1,0.5,-2e1", "2.5,0.75,0", "# pause", "3,1.0,4"]
    found = fx.read_signals(written(tmp_path, "\n".join(lines).replace(",", separator), encoding))
    assert found.dt == pytest.approx(0.25) and found.time == pytest.approx([0, 0.25, 0.5])
    assert list(found.signals) == ["stage.tz", "push"]
    assert found.signals["stage.tz"].tolist() == [1, 2.5, 3] and found.signals["push"].tolist() == [-20, 0, 4]


def test_times_that_were_rounded(tmp_path):
    """Times with four decimals of steps of a third of a millisecond are even."""
    rows = "\n".join(f"{k / 3000:.5f},{k}" for k in range(60))
    found = fx.read_signals(written(tmp_path, "time,u\n" + rows))
    assert found.dt == pytest.approx(1 / 3000, rel=1e-3)


def test_file_drives_a_mechanism(tmp_path):
    """Columns are inputs by name."""
    rows = "\n".join(f"{k * 1e-3},{k},1" for k in range(30))
    found = fx.read_signals(written(tmp_path, "t,mass.tx,mass.rz\n" + rows))
    described = fx.Mechanism(bodies={"mass": fx.describe.RigidBody(mass=0.5, inertia=(1, 1, 2))})
    moved = fx.time_response(described, inputs=found.signals, outputs="mass.rz", dt=found.dt)
    assert moved.response[0, -1] == pytest.approx((29e-3) ** 2 / 4, rel=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a header and at least two rows"),
        ("time,u\n0,1\n", "a header and at least two rows"),
        ("clock,u\n0,1\n1,2\n", ":1: the header has one column `time`"),
        ("time,t,u\n0,1,2\n1,2,3\n", ":1: the header has one column `time`"),
        ("time\n0\n1\n", ":1: beside time at least one column"),
        ("time,u,u\n0,1,2\n1,2,3\n", ":1: every column has a name of its own"),
        ("time,u,\n0,1,2\n1,2,3\n", ":1: every column has a name of its own"),
        ("# note\ntime,u\n0,1\n1,2,3\n", ":4: 2 columns are expected, here are 3"),
        ("time,u\n0,1\n1\n", ":3: 2 columns are expected, here are 1"),
        ("time,u\n0,1\n1,two\n", ":3: column u: 'two' is not a number"),
        ("time,u\n0,1\n1,\n", ":3: column u: is empty"),
        ("time,u\n0,1\n1,nan\n", ":3: column u: a finite number"),
        ("time,u\n0,1\ninf,2\n", ":3: column time: a finite number"),
        ("time,u\n0,1\n1,2\n2,3\n4,4\n5,5\n", ":5: a gap in time"),
        ("time,u\n0,1\n\n1,2\n# x\n2,3\n2.5,4\n", ":7: a gap in time"),
        ("time,u\n0,1\n0,2\n0,3\n", "time does not increase"),
        ("time,u\n2,1\n1,2\n0,3\n", "time does not increase"),
    ],
)
def test_files_with_errors(tmp_path, text, message):
    """Each is refused, with its line."""
    file = written(tmp_path, text)
    with pytest.raises(fx.OptionError) as caught:
        fx.read_signals(file)
    assert str(caught.value).startswith(str(file)) and message in str(caught.value)


def test_files_that_cannot_be_read(tmp_path):
    """Missing, a folder, or no text."""
    with pytest.raises(fx.OptionError, match="does not exist"):
        fx.read_signals(tmp_path / "none.csv")
    with pytest.raises(fx.OptionError, match="cannot be read"):
        fx.read_signals(tmp_path)
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"time,u\n\xff\xfe,1\n")
    with pytest.raises(fx.OptionError, match="cannot be read"):
        fx.read_signals(binary)
