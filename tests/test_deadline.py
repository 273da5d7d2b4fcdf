"""Time limits: who is stopped, who is not, and what is reported."""

import pytest

from flexura.deadline import OutOfTime, checkpoint, time_limit


def test_nothing_stops_without_a_limit() -> None:
    checkpoint()
    with time_limit(None):
        checkpoint()


def test_work_stops_at_its_next_checkpoint() -> None:
    with pytest.raises(OutOfTime, match="stopped after 1e-09 s"), time_limit(1e-9):
        while True:
            checkpoint()
    checkpoint()  # the limit has ended with its block


def test_an_inner_limit_cannot_outlast_the_outer_one() -> None:
    with pytest.raises(OutOfTime) as caught, time_limit(1e-9), time_limit(1e9):
        while True:
            checkpoint()
    assert caught.value.seconds == 1e-9


def test_what_is_done_is_reported_to_the_innermost() -> None:
    outer, inner = [], []
    with time_limit(1e9, outer.append):
        checkpoint(0.25)
        with time_limit(None, inner.append):
            checkpoint(0.5)
            checkpoint()
    assert (outer, inner) == ([0.25], [0.5])
