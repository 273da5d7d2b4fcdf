"""A wish comes to candidates that are worked out as their files say, gone on with, and kept where nothing is better."""

import json

import numpy as np
import pytest

import flexura as fx
from flexura.errors import OptionError
from flexura.full_order import plan_of
from flexura.mechanism import with_rigid_bodies
from flexura.modelfile import read_as, text_of
from flexura.study.questions import questions, relation
from flexura.study.requirements import requirements
from flexura.synthesis import WishFile, design, room_of
from flexura.synthesis.optima import SPARE, apart, with_spare
from flexura.synthesis.screening import COMPLIANCES, gap_of

WISH = """\
name: guide
wish:
  freedoms: {platform: [x]}
  stroke: {x: 0.5 mm}
  envelope: [60 mm, 60 mm, 40 mm]
  platform: {shape: box}
  make: {thinnest: 0.3 mm, process: wire-cut}
requirements: {first mode: f1 >= 20 Hz, stiff: stiffness(platform.z) >= 1 N/um}
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    (folder / "wish.yaml").write_text(WISH, encoding="utf-8")
    seen = []
    found = design(
        folder / "wish.yaml", folder=folder / "out", most=1, samples=8, verify=False, workers=1, found=seen.append
    )
    return folder, found, seen


def test_candidates_are_as_their_files_are(made):
    folder, found, seen = made
    assert 1 <= len(seen[0].candidates) <= len(found.candidates) == 1
    for own in found.candidates:
        mechanism = fx.load(folder / "out" / own.file)
        again = fx.requirements(mechanism)
        assert [r.name for r in again.requirements] == ["first mode", "stiff", "within yield"]
        for one, other in zip(own.requirements, again.requirements, strict=True):
            assert one.verdict == other.verdict and one.value == pytest.approx(other.value, rel=1e-9)
        assert own.first_hz == pytest.approx(fx.modes(mechanism, n=1).full_frequency_hz[0], rel=1e-6)
        clashes = fx.check(mechanism).clashes
        assert own.clashes == () and all(".base" in name for each in clashes for name in (each.first, each.second))
    assert found.candidates[0].meets_all
    assert json.loads((folder / "out/design.json").read_text())["candidates"][0]["clashes"] == []


def test_what_was_worked_out_is_not_worked_out_again(made, monkeypatch):
    folder, found, _ = made

    def never(*_):
        raise AssertionError

    monkeypatch.setattr("flexura.synthesis.search.blocks_of", never)
    again = design(folder / "wish.yaml", folder=folder / "out", most=1, samples=8, verify=False)
    assert again == found


def test_a_folder_of_another_wish_is_left_alone(made):
    folder, *_ = made
    (folder / "other.yaml").write_text(WISH.replace("20 Hz", "30 Hz"), encoding="utf-8")
    with pytest.raises(OptionError, match="another wish"):
        design(folder / "other.yaml", folder=folder / "out", most=1, samples=8, verify=False)


@pytest.mark.parametrize("text", ["f1 >= 20 Hz", "20 Hz <= f1", "mass <= 5 kg", "margin >= 1 over stroke"])
def test_limits_of_optima_are_moved_by_what_rigid_bodies_promise_too_much(made, text):
    """A design whose part, bodies that bend and model errors included, is right at a limit misses the moved one by what
    is to spare."""
    folder, found, _ = made
    mechanism = fx.load(folder / "out" / found.candidates[0].file)
    mechanism = mechanism.replaced({"requirements": {"own": text}})
    (bending,), rigid = requirements(mechanism).requirements, with_rigid_bodies(mechanism)
    (promised,) = requirements(rigid).requirements
    moved = relation(plan_of(rigid), with_spare(rigid, bending, promised.value))
    low, high = bending.model_error or (0.0, 0.0)
    is_below = moved.sides[2]
    at_worst = bending.value * (1 + (high if is_below else low)) / bending.limit
    asked = promised.value / float(moved.sides[1].values({})[0])
    assert asked == pytest.approx(at_worst / (1 - SPARE if is_below else 1 + SPARE), rel=1e-5)
    assert np.sign(bending.least_margin) == np.sign((1 - at_worst) if is_below else (at_worst - 1))


def test_optima_keep_the_gap_of_where_they_begin(made):
    """The tightest limit on compliances is as tight as the gap, and tighter where that is less over the stroke."""
    folder, found, _ = made
    rigid = with_rigid_bodies(fx.load(folder / "out" / found.candidates[0].file))
    room = room_of(read_as(WishFile, text_of(folder / "wish.yaml"), "wish").wish)
    plan = plan_of(rigid)
    gap = float(gap_of(questions(plan, COMPLIANCES).values({}).value, room)[0])
    for over_stroke, more in ((gap, 1.0), (gap / 2, 2.0), (2 * gap, 1.0), (np.nan, 1.0)):
        limits = [relation(plan, text) for text in apart(rigid, over_stroke, 10.0, room)]
        ratios = [float(own.left.values({})[0] / own.right.values({})[0]) for own in limits]
        assert min(ratios) == pytest.approx(gap / (10 * (1 + SPARE) * more), rel=1e-6)
