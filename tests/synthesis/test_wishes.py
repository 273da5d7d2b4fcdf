"""Wishes that are read off mechanisms of the gallery say what these are."""

import importlib
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.gallery import entry
from flexura.modelfile import read_as
from flexura.synthesis import WishFile, room_of, topologies


@pytest.fixture
def wishes(monkeypatch):
    """benchmarks/wishes.py"""
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
    return importlib.import_module("wishes")


def test_the_wish_of_the_parallelogram_is_its_stage_on_two_leaves(wishes):
    reading = wishes.read_off("parallelogram")
    file = read_as(WishFile, wishes.text_of_wish(reading.data), "wish")
    wish, room = file.wish, room_of(file.wish)
    assert [str(own) for own in wish.freedoms.platform] == ["x"]
    assert list(wish.envelope) == pytest.approx([0.05, 0.01, 0.062])  # leaves of 50 mm below a stage of 12 mm
    assert list(2 * room.platform) == pytest.approx([0.05, 0.01, 0.012])
    assert list(room.middle) == pytest.approx([0.0, 0.0, 0.056])
    assert wish.stroke_twist == pytest.approx([0.004, 0, 0, 0, 0, 0])
    assert float(wish.make.thinnest) == pytest.approx(0.4e-3)
    mechanism = fx.load(entry("parallelogram").path)
    [stage] = fx.free(mechanism).bodies
    assert stage.freedom.name == "translation" and stage.gap > 10
    limit = float(file.requirements["first mode"].split()[2])
    own = fx.modes(mechanism)
    surely = own.frequency_hz[0] * (1 + own.model_error[0][0])
    assert 0.99 < limit / surely <= 1.0
    listed = topologies(room, wish.make.process, float(wish.make.thinnest))
    assert listed[0].name == "2 upright leaves below, wide tangentially"


@pytest.mark.parametrize("name", ["cross_spring", "cartwheel", "infinity_hinge", "lever", "rpr", "tip_tilt"])
def test_no_wish_moves_less_than_its_mechanism_about_axes_that_are_free(wishes, name):
    assert all(own > 0.97 for own in wishes.read_off(name).inertia.values())


def test_the_wish_of_a_bridge_has_its_stack_and_the_stroke_that_it_gives(wishes):
    mechanism = fx.load(entry("bridge").path)
    reading = wishes.read_off("bridge")
    wish = read_as(WishFile, wishes.text_of_wish(reading.data), "wish").wish
    assert list(wish.freedoms.platform) == ["z"]
    assert wish.drives.count == 1 and wish.drives.stack == pytest.approx((36e-6, 30e6, 36e-3, 5e-3, 7e-3))
    given = abs(float(fx.questions(mechanism, "coupling(piezo, output.z)").values({}).value[0, 0])) * 150 / 2
    assert 0.9 < wish.stroke_twist[2] / given <= 1.0  # what it surely gives, to either side
    assert reading.data["wish"]["gap"] < 10  # without its stack it gives way across sooner than along
    assert not wishes.UNTOLD.keys() & wishes.WISHED.keys()


def test_strokes_of_several_stacks_are_given_all_at_once(wishes):
    reading = wishes.read_off("tip_tilt_piston")
    strokes = read_as(WishFile, wishes.text_of_wish(reading.data), "wish").wish.stroke_twist
    z, rx, ry = strokes[2], strokes[3], strokes[4]
    assert rx == pytest.approx(ry)
    angles = 2 * 3.141592653589793 / 3 * np.arange(3)
    ways = z + 0.015 * (rx * np.abs(np.sin(angles)) + ry * np.abs(np.cos(angles)))
    assert 0.93 < ways.max() / 15.5e-6 < 1.0
    assert all(own > 0.97 for own in reading.inertia.values())
