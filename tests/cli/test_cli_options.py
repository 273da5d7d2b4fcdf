"""Every option names itself in its error, with what it was given and what is expected."""

from __future__ import annotations

import sys

import pytest

from flexura.cli.amounts import band_of, gravity_of, limit_of, loads_of, selected
from flexura.cli.app import COMMANDS, loaded, main
from flexura.cli.guard import with_option

GUIDE = "examples/guide/guide.yaml"


def error_of(monkeypatch, capsys, *words: str) -> str:
    monkeypatch.setattr(sys, "argv", ["flexura", *words])
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == 2
    out, err = capsys.readouterr()
    assert out == ""
    return err


CASES = [
    (("statics", GUIDE, "--gravity", "0,0"), "--gravity '0,0'", "3 numbers; 2 found"),
    (("statics", GUIDE, "--gravity", "0,0,g"), "--gravity '0,0,g'", "an acceleration with its unit is expected"),
    (("statics", GUIDE, "--gravity", "0,0,-9.81"), "--gravity '0,0,-9.81'", "e.g. '0,0,-9.81 m/s^2'"),
    (("statics", GUIDE, "--gravity", "0,0,-9.81 m/s"), "--gravity '0,0,-9.81 m/s'", "is no acceleration"),
    (("statics", GUIDE, "--load", "carriage=1,2,3"), "--load 'carriage=1,2,3'", "e.g. 'table=0,0,-5 N'"),
    (("statics", GUIDE, "--load", "carriage=0,0,1,0,0,2 N*m"), "--load 'carriage=0,0,1,0,0,2 N*m'", "no force"),
    (("statics", GUIDE, "--actuator", "carriage.tx=3"), "--actuator 'carriage.tx=3'", "takes force in N"),
    (("buckling", GUIDE, "--gravity=0,0,nan m/s^2"), "--gravity '0,0,nan m/s^2'", "finite"),
    (("statics", GUIDE, "--load", "table=1,2"), "--load 'table=1,2'", "NODE=FX,FY,FZ"),
    (("statics", GUIDE, "--load", "=1,2,3"), "--load '=1,2,3'", "NODE=FX,FY,FZ"),
    (("statics", GUIDE, "--load", "table=1,x,2 N"), "--load 'table=1,x,2 N'", "a force with its unit"),
    (("statics", GUIDE, "--load", "tabel=1,2,3 N"), "--load 'tabel=1,2,3 N'", "there is no node 'tabel'"),
    (("statics", GUIDE, "--load", "table=1,2,3 N", "--load", "table=1,2,4 N"), "--load 'table=1,2,4 N'", "already"),
    (("statics", GUIDE, "--actuator", "coil=3 N"), "--actuator 'coil=3 N'", "there is no input 'coil'"),
    (("statics", GUIDE, "--set", "width"), "--set 'width'", "NAME=VALUE"),
    (("statics", GUIDE, "--set", "wdith=3 mm"), "--set 'wdith=3 mm'", "did you mean 'width'"),
    (("statics", GUIDE, "--set", "length=3 m"), "--set 'length=3 m'", "above its maximum"),
    (("statics", GUIDE, "--set", "width=3"), "--set 'width=3'", "carries a unit"),
    (("statics", GUIDE, "--set", "width=3 mm", "--set", "width=4 mm"), "--set 'width=4 mm'", "already"),
    (("frequency-response", GUIDE, "--band", "1 Hz"), "--band '1 Hz'", "FROM,TO with a unit"),
    (("frequency-response", GUIDE, "--band", "10,1 Hz"), "--band '10,1 Hz'", "lower"),
    (("frequency-response", GUIDE, "--band", "1,9"), "--band '1,9'", "e.g. '5,200 Hz'"),
    (("frequency-response", GUIDE, "--band", "1,9 Hz", "-i", "coil"), "-i 'coil'", "there is no input"),
    (("frequency-response", GUIDE, "--band", "1,9 Hz", "--output", "x"), "--output 'x'", "there is no output"),
    (("time-response", GUIDE, "--dt", "1"), "--dt '1'", "a time with its unit"),
    (("time-response", GUIDE, "--dt", "1 kg"), "--dt '1 kg'", "in s"),
    (("time-response", GUIDE, "--dt", "x"), "--dt 'x'", "0.1ms"),
    (("time-response", GUIDE, "--dt", "1ms", "--duration", "2"), "--duration '2'", "a time with its unit"),
    (("compare", GUIDE, "--budget", "3 deg"), "--budget '3 deg'", "10 s or 5 min"),
    (("compare", GUIDE, "--methods", "magic"), "--methods 'magic'", "there is no method"),
    (("export", GUIDE, "--out", "o.mat", "--delay", "3"), "--delay '3'", "a time with its unit"),
    (("export", GUIDE, "--out", "o.mat", "--format", "foo"), "--format 'foo'", "there is no format"),
    (("modes", GUIDE, "--tolerance", "7"), "--tolerance '7'", "between 0 and 1"),
    (("modes", GUIDE, "--up-to", "3 rad/s"), "--up-to '3 rad/s'", "no frequency"),
    (("modes", GUIDE, "--up-to", "300"), "--up-to '300'", "has no unit"),
    (("compare", GUIDE, "--budget", "20"), "--budget '20'", "has no unit"),
    (("modes", GUIDE, "--keep-below", "-3 Hz"), "--keep-below '-3 Hz'", "positive frequency"),
    (("modes", GUIDE, "--up-to", "nan"), "--up-to 'nan'", "positive frequency"),
    (("calibrate", GUIDE, "examples/rpr/table5.csv", "--free", "width,x"), "--free 'width,x'", "not a parameter"),
]


@pytest.mark.parametrize(("words", "head", "rule"), CASES, ids=lambda v: v if isinstance(v, str) else None)
def test_errors_name_their_option(monkeypatch, capsys, words, head, rule) -> None:
    err = error_of(monkeypatch, capsys, *words)
    assert err.startswith(f"flexura: {head}: ")
    assert rule in err


def test_the_whole_part_has_no_pictures(monkeypatch, capsys, tmp_path) -> None:
    assert "leave --plot out" in error_of(monkeypatch, capsys, "verify", GUIDE, "--whole", "--plot", str(tmp_path))


def test_an_error_about_no_option_stays_as_it_is(monkeypatch, capsys) -> None:
    assert error_of(monkeypatch, capsys, "identify", "nothing.csv").startswith(
        "flexura: nothing.csv: the file does not"
    )


def test_an_error_that_two_options_may_have_caused_stays_as_it_is() -> None:
    text = "there is no node 'a'"
    assert with_option(text, ["--load", "a=1,2,3", "--node", "a"]) == text
    assert with_option(text, ["--load", "a=1,2,3", "--node", "b"]) == f"--load 'a=1,2,3': {text}"


def test_numbers_have_the_unit_of_the_next_that_has_one() -> None:
    assert band_of("20,400 Hz") == band_of("20 Hz, 0.4 kHz") == (20.0, 400.0)
    assert selected("12 Hz,0.2,0.3kHz") == [12.0, 200.0, 300.0]
    assert gravity_of("0,0,-9810 mm/s^2") == gravity_of("0 m/s^2,0,-9.81 m/s^2") == [0.0, 0.0, -9.81]
    assert loads_of(["a=0,0,-5 N", "b=1 N,2,3 kN,0,0,1 N*mm"]) == {
        "a": [0.0, 0.0, -5.0, 0.0, 0.0, 0.0],
        "b": [1.0, 2000.0, 3000.0, 0.0, 0.0, pytest.approx(1e-3)],
    }
    assert limit_of("--up-to", "1.5 kHz") == 1500.0 and limit_of("--up-to", None) is None


def test_what_a_command_makes_goes_to_one_option() -> None:
    """Files go to --out, pictures to --plot: no other option says that it writes."""
    writing = {
        option.opts[-1]
        for name in COMMANDS
        for option in loaded(name).params
        if (getattr(option, "help", None) or "").startswith("Write ")
    }
    assert writing == {"--out", "--plot"}
