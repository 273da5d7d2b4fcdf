"""Every option names itself in its error, with what it was given and what is expected."""

from __future__ import annotations

import sys

import pytest

from flexura.cli.app import COMMANDS, loaded, main
from flexura.cli.naming import with_option
from flexura.cli.options import band_of, limit_of, picked

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
    (("statics", GUIDE, "--gravity", "0,0,g"), "--gravity '0,0,g'", "'g' is no number"),
    (("buckling", GUIDE, "--gravity=0,0,nan"), "--gravity '0,0,nan'", "finite"),
    (("statics", GUIDE, "--load", "table=1,2"), "--load 'table=1,2'", "NODE=FX,FY,FZ"),
    (("statics", GUIDE, "--load", "=1,2,3"), "--load '=1,2,3'", "NODE=FX,FY,FZ"),
    (("statics", GUIDE, "--load", "table=1,x,2"), "--load 'table=1,x,2'", "'x' is no number"),
    (("statics", GUIDE, "--load", "tabel=1,2,3"), "--load 'tabel=1,2,3'", "there is no node 'tabel'"),
    (("statics", GUIDE, "--load", "table=1,2,3", "--load", "table=1,2,4"), "--load 'table=1,2,4'", "already"),
    (("statics", GUIDE, "--actuator", "coil=3"), "--actuator 'coil=3'", "there is no input 'coil'"),
    (("statics", GUIDE, "--set", "width"), "--set 'width'", "NAME=VALUE"),
    (("statics", GUIDE, "--set", "wdith=3 mm"), "--set 'wdith=3 mm'", "did you mean 'width'"),
    (("statics", GUIDE, "--set", "length=3 m"), "--set 'length=3 m'", "above its maximum"),
    (("statics", GUIDE, "--set", "width=3"), "--set 'width=3'", "carries a unit"),
    (("statics", GUIDE, "--set", "width=3 mm", "--set", "width=4 mm"), "--set 'width=4 mm'", "already"),
    (("frequency-response", GUIDE, "--band", "1"), "--band '1'", "FROM,TO in Hz"),
    (("frequency-response", GUIDE, "--band", "10,1"), "--band '10,1'", "lower"),
    (("frequency-response", GUIDE, "--band", "1,9", "-i", "coil"), "-i 'coil'", "there is no input"),
    (("frequency-response", GUIDE, "--band", "1,9", "--output", "x"), "--output 'x'", "there is no output"),
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
    (("modes", GUIDE, "--keep-below", "-3 Hz"), "--keep-below '-3 Hz'", "positive frequency"),
    (("modes", GUIDE, "--up-to", "nan"), "--up-to 'nan'", "positive frequency"),
    (("calibrate", GUIDE, "examples/rpr/table5.csv", "--free", "width,x"), "--free 'width,x'", "not a parameter"),
]


@pytest.mark.parametrize(("words", "head", "rule"), CASES, ids=lambda v: v if isinstance(v, str) else None)
def test_errors_name_their_option(monkeypatch, capsys, words, head, rule) -> None:
    err = error_of(monkeypatch, capsys, *words)
    assert err.startswith(f"flexura: {head}: ")
    assert rule in err


def test_an_error_about_no_option_stays_as_it_is(monkeypatch, capsys) -> None:
    assert error_of(monkeypatch, capsys, "kinetostatics", GUIDE, "nothing").startswith("flexura: there is no node")


def test_an_error_that_two_options_may_have_caused_stays_as_it_is() -> None:
    text = "there is no node 'a'"
    assert with_option(text, ["--load", "a=1,2,3", "--node", "a"]) == text
    assert with_option(text, ["--load", "a=1,2,3", "--node", "b"]) == f"--load 'a=1,2,3': {text}"


def test_frequencies_may_carry_their_unit() -> None:
    assert band_of("20,0.4 kHz") == band_of("20 Hz,400") == (20.0, 400.0)
    assert picked("12,0.3kHz") == [12.0, 300.0]
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
