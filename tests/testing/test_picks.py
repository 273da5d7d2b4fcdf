"""Poles that are picked of a stabilisation diagram, by frequency and order, in Python and in the shell.

Poles of reference are those of a dense state matrix, and of sdypy-EMA at the same order.
"""

import json

import numpy as np
import pytest

import flexura as fx
from flexura.cli.amounts import selected
from flexura.testing.identification import stabilisation
from flexura.testing.measurement import Measurement
from helpers.ema import poles_by_ema
from helpers.modal_systems import measured, modal
from helpers.shell import flexura
from helpers.tested_frame import frame, measured_frame

HZ = np.arange(0.0, 60.0, 0.125)
SYSTEM = modal([11.0, 19.0, 19.4, 32.0], [0.01, 0.01, 0.012, 0.008], outputs=5, seed=1)


@pytest.fixture(scope="module")
def poles():
    return stabilisation(measured(SYSTEM, HZ, decibels=40), band=(3, 55))


def test_picked_modes_are_those_of_the_system_and_no_others(poles):
    picked = poles.modes([(19.4, 30), (32.0, 40), (19.0, 36)])
    assert picked.frequency_hz == pytest.approx(SYSTEM.frequency_hz[1:4], rel=1e-3)
    assert picked.damping_ratio == pytest.approx(SYSTEM.damping_ratio[1:4], rel=0.05)
    assert np.diag(fx.modal.mac(picked.shapes, SYSTEM.shapes[:, 1:4])).min() > 0.999
    assert "picked, as frequency@order: 19@36, 19.4@30, 32@40 Hz" in picked.notes
    assert any(note.startswith("poles at 11") and "not picked" in note for note in picked.notes)


def test_without_the_fit_a_pick_is_the_very_pole_of_that_order_which_another_program_finds_too():
    frf = measured(SYSTEM, HZ, inputs=(0,), decibels=60)
    poles = stabilisation(frf, band=(3, 55), order=30)
    other = poles_by_ema(frf, (3, 55), 30)
    for order in (12, 30):
        (own,) = poles.modes([(32.0, order)], refine=False).poles
        there = other.order == order
        k = np.flatnonzero(there)[np.argmin(np.abs(other.frequency_hz[there] - 32.0))]
        assert abs(own) / (2 * np.pi) == pytest.approx(other.frequency_hz[k], rel=1e-4)  # lines weigh otherwise there
        assert -own.real / abs(own) == pytest.approx(other.damping_ratio[k], rel=5e-2)


def test_a_fit_ends_at_one_place_wherever_it_starts(poles):
    first, last = (poles.modes([(11.0, order)]).poles for order in (14, 56))
    assert first == pytest.approx(last, rel=1e-7)


def test_picks_leave_the_poles_as_they_were(poles):
    before = poles.modes().poles
    poles.modes([(11.0, 14)])
    assert poles.modes().poles == pytest.approx(before, rel=0, abs=0)


@pytest.mark.parametrize(
    ("select", "said"),
    [
        ([(11.0, 30), (11.0, 34)], r"11@30 and 11@34 Hz are one mode"),
        ([(11.0, 30), (11.0, 30)], r"11@30 and 11@30 Hz are one mode"),
        ([(25.0, 30)], r"there is no pole near 25 Hz at order 30: the nearest is at \d+\.\d+ Hz; see the stab"),
        ([(11.3, 30)], r"there is no pole near 11.3 Hz at order 30: the nearest is at 11\.\d+ Hz"),
        ([(11.0, 300)], r"there is no model order 300; orders: 1 to 60"),
        ([(11.0, 0)], r"there is no model order 0"),
        ([(11.0, 1)], r"there is no pole near 11 Hz at order 1"),
        ([(11.0, 30.5)], "positive numbers in Hz, or pairs"),
        ([(11.0, 30, 2)], "positive numbers in Hz, or pairs"),
        ([(-11.0, 30)], "positive numbers in Hz, or pairs"),
        (["11@30"], "positive numbers in Hz, or pairs"),
        ([], "positive numbers in Hz, or pairs"),
    ],
)
def test_bad_picks_are_refused(poles, select, said):
    with pytest.raises(fx.OptionError, match=said):
        poles.modes(select)


def test_a_pole_beside_a_mode_that_is_picked_already_is_refused():
    """Pole and mode are 0.1 % apart, and not linked from order to order."""
    poles = stabilisation(measured_frame())
    found = poles.setups[0].diagram
    first = float(fx.modes(frame(), n=1, order="full").frequency_hz[0])
    near = np.abs(found.frequency_hz / first - 1) < 0.01
    alone = found.order[near & (found.stable & 3 != 3)].max()
    for refine in (True, False):
        assert len(poles.modes([(first, int(alone))], refine=refine).poles) == 1
        with pytest.raises(fx.OptionError, match="adds no more than noise does"):
            poles.modes([(first, int(alone)), (first, 24)], refine=refine)


def test_a_pick_that_some_setups_have_not_is_noted_and_one_that_none_has_is_refused():
    setups = [measured(SYSTEM, HZ, (0, 1), at, 40, k, setup=f"step {k}") for k, at in enumerate(((0, 1), (2, 3)))]
    both = fx.identify(setups, band=(3, 55), select=[(11.0, 30)])
    assert both.frequency_hz == pytest.approx([SYSTEM.frequency_hz[0]], rel=1e-3)
    assert [len(own.poles) for own in both.setups] == [1, 1]
    with pytest.raises(fx.OptionError, match="no pole near 25 Hz at order 30"):
        fx.identify(setups, band=(3, 55), select=[(25.0, 30)])


def test_the_shell_picks_the_same_and_writes_it(tmp_path):
    data = Measurement("rig", (), (measured(SYSTEM, HZ, decibels=40),))
    fx.write_measurement(data, tmp_path / "rig.uff")
    modes = fx.identify(fx.read_measurement(tmp_path / "rig.uff"), band=(3, 55), select=[(11.0, 30), 32.0])
    options = ("identify", tmp_path / "rig.uff", "--band", "3,55 Hz", "--select", "11@30,32 Hz")
    out = flexura(*options, "--json", "--out", tmp_path / "modes.json")
    shown, written = json.loads(out.stdout), json.loads((tmp_path / "modes.json").read_text())
    assert shown.pop("files") == [str(tmp_path / "modes.json")]
    assert shown == written == json.loads(json.dumps(modes.to_dict()))
    rows = fx.write_modes(modes, tmp_path / "modes.csv").read_text().splitlines()
    assert [float(row.split(",")[1]) for row in rows[1:]] == pytest.approx(modes.frequency_hz, rel=1e-15)
    again = fx.read_measurement(fx.write_modes(modes, tmp_path / "modes.uff")).modes
    assert again is not None
    assert again.poles == pytest.approx(modes.poles, rel=1e-4)
    assert np.diag(fx.modal.mac(again.shapes, modes.shapes)).min() > 0.9999


def test_modes_are_written_in_formats_that_hold_them_alone(poles, tmp_path):
    modes = poles.modes()
    with pytest.raises(fx.OptionError, match=r"\.png is no format of identified modes; known: .json, .csv"):
        fx.write_modes(modes, tmp_path / "modes.png")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text", ["11@,32 Hz", "@30 Hz", "11@30", "11@x Hz", "11 Hz@", "11@30.5 Hz"])
def test_a_text_that_is_no_pick_is_refused(text):
    with pytest.raises(fx.OptionError, match="--select"):
        selected(text)


def test_a_text_of_picks():
    assert selected("12@24, 0.04 kHz, 40@7 Hz") == [(12000.0, 24), 40.0, (40.0, 7)]
    assert selected("12@24,40 Hz") == [(12.0, 24), 40.0]
