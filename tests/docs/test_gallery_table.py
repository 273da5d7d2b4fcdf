"""The table of the gallery says of every kind of mechanism how it moves and how far."""

import importlib
import re
import sys

import pytest

import flexura as fx
from flexura.gallery import entries
from helpers.doc_snippets import ROOT

MILLIMETRES = r" (-?[\d.]+) mm by piezo 150 V"


@pytest.fixture
def table(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "_ext"))
    yield importlib.import_module("gallery_table")
    sys.modules.pop("gallery_table")


def plan(name):
    return fx.Plan(fx.load(next(own.path for own in entries() if own.path.stem == name)))


def test_what_an_amplifier_gives_out_is_its_ratio_times_what_the_stack_elongates(table):
    """Within what finite turns and hinges that stretch take of the published ratio of the arms."""
    lever = plan("lever")
    found = re.fullmatch("tip.z" + MILLIMETRES, table.stroke(lever))
    assert found is not None
    own = fx.stroke(lever, steps=3, n=1, nodes=("stack_head", "tip")).poses[-1].displacement
    arms = lever.parameter_values()
    ratio = arms["output_arm"] / arms["input_arm"]
    assert float(found[1]) * 1e-3 == pytest.approx(ratio * own["stack_head"][2], rel=0.02)
    assert table.freedoms(lever) == "1R"


def test_two_jaws_tell_how_far_they_part(table):
    gripper = plan("gripper")
    found = re.fullmatch("opening" + MILLIMETRES, table.stroke(gripper))
    assert found is not None
    moved = fx.stroke(gripper, steps=3, n=1, nodes=("side1.tip", "side2.tip")).poses[-1].displacement
    assert float(found[1]) == pytest.approx(1e3 * (moved["side1.tip"][0] - moved["side2.tip"][0]), rel=5e-3)


def test_without_a_described_motion_the_stroke_is_what_actuators_reach(table):
    stroke = table.stroke(plan("tip_tilt_piston"))
    assert re.fullmatch(r"mirror\.z [\d.]+ µm, mirror\.rx ± [\d.]+ mrad, mirror\.ry ± [\d.]+ mrad", stroke)


def test_what_does_not_move_and_is_stiff_all_round_says_so(table):
    assert (table.freedoms(plan("wire_hexapod")), table.stroke(plan("wire_hexapod"))) == ("none stands out", "none")
    assert (table.freedoms(plan("xy_parallel")), table.stroke(plan("xy_parallel"))) == ("2T", "table.x ± 5 mm")
