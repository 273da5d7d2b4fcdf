"""Rate and time left of studies, as they are shown."""

import io
import time

from rich.console import Console

import flexura.cli.progress as module
from flexura.cli.progress import Pace
from flexura.deadline import Progress as Step


def told(*seen):
    pace = Pace()
    for seconds, done in seen:
        pace.add(seconds, done)
    return pace


def test_nothing_is_known_at_first():
    pace = told((5.0, 1000))
    assert (pace.words, pace.left(9.0, 2000)) == ("", "")


def test_designs_that_were_there_before_do_not_count():
    pace = told((0.0, 5000), (2.0, 9000))
    assert pace.words == "2,000/s"
    assert pace.left(2.0, 10_000_000) == "1:23:16 left"
    assert pace.left(5.0, 15_000) == "0:00:00 left"


def test_the_rate_is_that_of_the_last_half_minute():
    pace = told(*((float(k), min(k, 50) + 100 * max(k - 50, 0)) for k in range(101)))
    assert pace.words == "100/s"


def test_blocks_of_minutes_have_a_rate_too():
    pace = told(*((100.0 * k, 4 * k) for k in range(10)))
    assert pace.words == "2.4/min"
    assert pace.left(940.0, 56) == "0:07:40 left"


def test_designs_that_take_long_are_announced_once_after_the_first_of_them(monkeypatch, capsys):
    """64 of 4096 designs in 4.5 s: 14 a second, some five minutes; what takes a moment says nothing."""
    clock = iter((0.0, 4.5, 9.0, 0.0, 0.1))
    monkeypatch.setattr(module.time, "monotonic", lambda: next(clock))
    with module.designs_shown() as tell:
        for done in (0, 64, 128):
            tell(Step("designs", done, 4096))
    assert capsys.readouterr().err == "4,096 designs at 14/s take about 5 minutes\n"
    with module.designs_shown() as tell:
        for done in (0, 64):
            tell(Step("designs", done, 4096))
    assert not capsys.readouterr().err


def test_rounds_are_shown_on_a_terminal_alone(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(module, "Console", lambda **_: Console(file=stream, force_terminal=True, width=100))
    with module.rounds_shown() as show:
        for step in (Step("searches", 1, 8), Step("proof")):
            show(step)
            time.sleep(0.15)
    assert "searches" in stream.getvalue() and "1/8" in stream.getvalue() and "proof" in stream.getvalue()
    monkeypatch.undo()
    with module.rounds_shown() as show:
        assert show is None
