"""What textbooks hold a platform by is found, among the first, from what is to be free alone."""

import numpy as np
import pytest

from flexura.synthesis import Wish, room_of, topologies
from flexura.synthesis.fitting import as_drawn
from flexura.synthesis.patterns import RADII

FIRST = 10


def layer(freedoms, height=0.001):
    """A box that fills a thin layer, in the middle of it."""
    own = wish(freedoms, (0.0, 0.0, height / 2), "box", process="printed")
    platform = own.platform.model_copy(update={"size": (0.03, 0.015, height), "at": (0.0, 0.0, height / 2)})
    return own.model_copy(update={"envelope": (0.05, 0.06, height), "platform": platform})


def wish(freedoms, about=(0.0, 0.0, 0.0), shape="cylinder", plane="z-", process="assembled"):
    return Wish.model_validate(
        {
            "freedoms": {"platform": freedoms},
            "about": about,
            "envelope": (0.06, 0.06, 0.04),
            "base": {"plane": plane},
            "platform": {"shape": shape},
            "make": {"process": process},
        }
    )


def listed(*args, **more):
    own = wish(*args, **more)
    return topologies(room_of(own), own.make.process, 3e-4)


def has(found, *patterns):
    """Whether one of the first has these patterns and no others, each as how many, of what, in words of its name."""
    return any(
        len(own.patterns) == len(patterns)
        and all(
            all(word in name for word in words) for name, words in zip(own.name.split(" and "), patterns, strict=True)
        )
        for own in found[:FIRST]
    )


WIRE_CUT, MILLED = "wire-cut", "milled"


@pytest.mark.parametrize(
    ("asked", "classics"),
    [
        pytest.param((["x"],), [[["2 upright leaves below, wide tang"]], [["folded guide"]]], id="x"),
        pytest.param(
            (["x"], (0, 0, 0), "box"), [[["2 upright leaves below, wide tang"]], [["folded guide"]]], id="x of a box"
        ),
        pytest.param((["ry"], (0, 0, 0.06)), [[["2 radial-upright leaves below, wide tang"]]], id="trapezoid"),
        pytest.param((["ry"], (0, 0, 0.02)), [[["2 inward-upright leaves below, wide tang"]]], id="crossed leaves"),
        pytest.param(
            (["rx", "ry", "z"], (0, 0, 0.036)), [[["3 tangential wires"]], [["3", "folded leaves"]]], id="tilts"
        ),
        pytest.param(
            (["rx", "ry"], (0, 0, 0.032)), [[["1 upright wire in the middle"], ["3 tangential wires"]]], id="two tilts"
        ),
        pytest.param(([],), [[["3 upright wires"], ["3 tangential wires"]]], id="six wires"),
        pytest.param(
            (["rz"],), [[["3 radial leaves", "wide upright"]], [["4 radial leaves", "wide upright"]]], id="wheel"
        ),
        pytest.param((["x", "y"],), [[["4 radial crossed guides", "wide upright"]]], id="table"),
        pytest.param(
            (["x", "y", "rz"],), [[["3 upright wires"]], [["3", "folded leaves", "wide upright"]]], id="planar"
        ),
        pytest.param(
            (["x"], (0, 0, 0), "cylinder", "z-", WIRE_CUT),
            [[["2 upright notched links below"]], [["2 upright leaves below"]]],
            id="parallelogram of notches",
        ),
        pytest.param(
            (["x", "y", "rz"], (0, 0, 0), "cylinder", "z-", WIRE_CUT),
            [[["3 radial three-notch chains", "wide upright"]], [["3 radial folded leaves", "wide upright"]]],
            id="3-RRR",
        ),
        pytest.param(
            (["x", "y", "z"], (0, 0, 0), "cylinder", "z-", MILLED), [[["3 inward-upright delta arms"]]], id="delta"
        ),
        pytest.param((["x", "y", "z"],), [[["3 radial-upright linear delta arms"]]], id="linear delta"),
        pytest.param(
            (["ry"], (0, 0, 0.02)),
            [[["1 upright crossed pivot in the middle below"]], [["2 upright crossed pivots below from 90 deg on"]]],
            id="cross pivots",
        ),
        pytest.param(
            (["ry"], (0, 0, 0.02), "cylinder", "z-", WIRE_CUT),
            [[["1 upright post on a notch in the middle"]], [["1 upright cartwheel in the middle below"]]],
            id="notch",
        ),
        pytest.param(
            (["rx", "ry", "rz"], (0, 0, 0.02), "cylinder", "z-", MILLED),
            [[["1 upright post on a round neck in the middle"]], [["3 inward-upright necked rods"]]],
            id="ball",
        ),
    ],
)
def test_classic_answers_are_among_the_first(asked, classics):
    found = listed(*asked)
    for patterns in classics:
        assert has(found, *patterns), [own.name for own in found[:FIRST]]


@pytest.mark.parametrize(
    ("freedoms", "classics"),
    [
        (["x"], [["1 radial leaf pair"], ["2 radial leaf pairs"], ["2 radial folded guides"]]),
        (["x", "y", "rz"], [["2 radial folded leaf pairs"]]),
    ],
)
def test_classic_suspensions_of_thin_layers_are_found_and_stay_in_the_layer(freedoms, classics):
    own = layer(freedoms)
    room = room_of(own)
    found = topologies(room, "printed", 2e-5)
    for patterns in classics:
        assert has(found, patterns), [each.name for each in found[:FIRST]]
    for each in found:
        for pattern in each.patterns:
            assert room.outside(as_drawn(pattern, room, 2e-5).all.reshape(-1, 3)).max() < 1e-9, each.name


def test_leaves_of_a_trapezoid_and_of_a_cross_pivot_meet_on_the_axis():
    for height in (0.06, 0.02):
        room = room_of(wish(["ry"], (0, 0, height)))
        (pattern,) = next(own for own in topologies(room, "assembled", 3e-4) if "leaves below" in own.name).patterns
        head = pattern.site.head(room)
        way = (height - head[2]) / pattern.axes[2, 2]
        np.testing.assert_allclose(head + way * pattern.axes[:, 2], [0.0, 0.0, height], atol=1e-12)
        assert pattern.pinned


def test_two_tilts_and_a_piston_about_a_point_at_which_no_limb_can_begin_are_left_by_leaves_folded_there_alone():
    found = listed(["rx", "ry", "z"], (0.0, 0.0, 0.01))
    assert "3 upright leaves folded on the axis below" in found[0].name
    assert {pattern.kind.name for own in found for pattern in own.patterns} == {"leaf folded on the axis"}


def test_a_hexapod_of_three_pairs_of_wires_that_lean_to_each_other_is_among_those_that_hold_all():
    """Of a pair the one wire leans to one side, the other, halfway to the next, to the other, as far."""
    room = room_of(wish([]))
    hexapods = [
        own.patterns
        for own in topologies(room, "assembled", 3e-4)
        if not own.over and [(p.kind.name, p.count) for p in own.patterns] == [("wire", 3), ("wire", 3)]
    ]
    ways = [[p.site.axes.T @ p.axes[:, 2] for p in own] for own in hexapods]
    mirrored = np.array([1.0, -1.0, 1.0])
    assert any(
        np.allclose(one, mirrored * other, atol=1e-9) and abs(one[1]) > 0.1 and abs(a.site.azimuth - b.site.azimuth) > 1
        for (one, other), (a, b) in zip(ways, hexapods, strict=True)
    )


def test_limbs_that_lean_towards_a_centre_begin_at_several_distances():
    """All of them point at it, and those nearer the middle are the steeper ones."""
    found = listed(["ry"], (0.0, 0.0, 0.06))
    leaning = [own.patterns[0] for own in found if own.name.startswith("2 radial-upright leaves below")]
    room = room_of(wish(["ry"], (0.0, 0.0, 0.06)))
    out = [own.site.out for own in leaning]
    assert sorted(out) == sorted(RADII)
    for own in leaning:
        away = room.about - own.site.head(room)
        np.testing.assert_allclose(np.cross(own.axes[:, 2], away), 0.0, atol=1e-9)
    rise = [-own.axes[2, 2] for own in leaning]
    assert np.all(np.diff(np.array(rise)[np.argsort(out)]) < 0)


def test_a_layer_a_hundred_times_as_long_as_thin_is_answered():
    own = wish(["x"], shape="box", process="printed")
    own = own.model_copy(
        update={"envelope": (2e-4, 4e-4, 2e-6), "make": own.make.model_copy(update={"thinnest": 5e-7})}
    )
    assert topologies(room_of(own), own.make.process, 5e-7)
