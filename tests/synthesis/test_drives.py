"""Piezo stacks move the platform as far as is wished, by amplifiers whose ratios are those of kinematics."""

import itertools
from typing import Any

import numpy as np
import pytest

import flexura as fx
from flexura.errors import ModelError, OptionError
from flexura.full_order import plan_of
from flexura.mechanism import with_rigid_bodies
from flexura.modelfile import described, dumps, loads
from flexura.study.questions import questions
from flexura.synthesis import Wish, WishFile, room_of, topologies
from flexura.synthesis.amplifiers import AMPLIFIERS, bridge_ratio, substructures
from flexura.synthesis.drafts import draft
from flexura.synthesis.drives import driven
from flexura.synthesis.optima import Optima, judged
from flexura.synthesis.screening import AtRest
from flexura.synthesis.wish import STACK, Stack

THINNEST = 1e-4
MILLED = {"thinnest": THINNEST, "process": "milled"}


def wish(freedoms, drives, stroke, about=(0.0, 0.0, 0.0), envelope=(0.1, 0.1, 0.06), **more):
    return Wish.model_validate(
        {"freedoms": {"platform": freedoms}, "drives": drives, "stroke": stroke, "about": about, "envelope": envelope}
        | {"make": {"thinnest": THINNEST}}
        | more
    )


PLANAR = wish(
    ["x", "y"],
    "2 piezo stacks along x and y",
    {"x": 6e-6, "y": 6e-6},
    envelope=(0.14, 0.14, 0.02),
    platform={"shape": "box", "size": (40e-3, 40e-3, 20e-3), "at": (0.0, 0.0, 0.01)},
    base={"plane": "z-", "frame": True},
)


def listed(own: Any, most: int = 4) -> Any:
    room = room_of(own)
    return room, driven(topologies(room, own.make.process, THINNEST)[:most], room, own, THINNEST)


def first(found, kind):
    return next(own for own in beside(found) if own.drive.kind == kind and own.drive.top is None)


def beside(found):
    """Those of limbs beside the drives."""
    return [own for own in found if own.patterns]


def slim(mechanism):
    """The same with its thinnest limbs."""
    thin = {
        name: own.model_copy(update={"value": own.minimum})
        for name, own in mechanism.parameters.items()
        if name.endswith(("_thickness", "_diameter", "_web")) and not name.startswith("drive_")
    }
    return mechanism.replaced({"parameters": mechanism.parameters | thin})


def reached(mechanism):
    """What is asked of the stacks."""
    asked = {name: text for name, text in mechanism.requirements.items() if name.startswith("reach")}
    return fx.requirements(mechanism.replaced({"requirements": asked})).requirements


def alone(amplifier, needed, stack=STACK):
    """A drive on the ground with its tip free, and its ratio by kinematics."""
    sizes = next(iter(amplifier.sizes(stack, 3e-4, 8e-3, needed, None)))
    parts = amplifier.parts(stack, "Al-7075-T6", sizes, None)
    data = {
        "name": amplifier.name,
        "parameters": {f"drive_{name}": f"{1e3 * own.value} mm" for name, own in sizes.items()},
        "substructures": substructures(parts, stack, parts.tips),
        "instances": {"drive": {"of": "drive"}},
        "ground": {f"drive.{held}": "clamped" for held in parts.held},
    }
    own = with_rigid_bodies(described({key: value for key, value in data.items() if value}, amplifier.name))
    return own, amplifier.ratio({name: size.value for name, size in sizes.items()}, stack, None), parts.sign


@pytest.mark.parametrize("amplifier", AMPLIFIERS[1:], ids=lambda own: own.name)
@pytest.mark.parametrize("needed", [3.0, 6.0, 10.0])
def test_ratios_are_those_of_kinematics(amplifier, needed):
    mechanism, ratio, sign = alone(amplifier, needed)
    found = questions(plan_of(mechanism), "amplification(drive.stack, drive.tip.z)").values({}).value[0, 0]
    assert ratio >= needed
    assert found * sign == pytest.approx(ratio, rel=0.1)


def test_the_ratio_of_a_bridge_is_that_of_the_literature():
    """Of thin leaves the cotangent of the angle of the arms; and that of the bridge of the gallery, whose published
    formula has its own sizes."""
    sizes = {"leaf": 4e-3, "seat": 0.0, "web": 0.02e-3, "offset": 1.5e-3}
    stack = Stack(36e-6, 30e6, 36e-3, 10e-3, 7e-3)  # of an edge that makes the output as wide as there
    assert bridge_ratio(sizes, stack) == pytest.approx(1 / np.tan(np.arctan2(1.5, 4 + 6)), rel=1e-3)
    gallery = fx.load("src/flexura/gallery/bridge.yaml")
    asked = fx.questions(with_rigid_bodies(gallery), "amplification(piezo, output.z)").values({}).value[0, 0]
    assert bridge_ratio(sizes | {"web": 0.5e-3}, stack) == pytest.approx(-asked, rel=0.03)


@pytest.mark.parametrize("kind", ["bridge", "lever"])
@pytest.mark.parametrize(
    "own",
    [
        wish(["z"], "1 piezo stack along z", {"z": 30e-6}),
        wish(["x"], "1 piezo stack along x", {"x": 30e-6}, platform={"shape": "box"}),
    ],
    ids=["z", "x"],
)
def test_one_stack_reaches_by_a_bridge_and_by_a_lever(own, kind):
    room, found = listed(own)
    topology = first(found, kind)
    assert topology.drive.needed == pytest.approx(4.0)  # 60 um by 15 um
    mechanism = slim(draft(topology, WishFile(wish=own), room, "draft"))
    assert dumps(loads(dumps(mechanism))) == dumps(mechanism)
    (reach,) = reached(mechanism)
    assert reach.verdict == "met"
    (freedom,) = own.stroke
    coupling = fx.questions(mechanism, f"coupling(drive1.stack, about.{freedom})").values({}).value[0, 0]
    assert reach.value == pytest.approx(abs(coupling) * STACK.free_stroke / 2, rel=1e-9)
    assert reach.value / (STACK.free_stroke / 2) == pytest.approx(topology.drive.ratio, rel=0.2)


@pytest.mark.parametrize(
    "own",
    [
        wish(["z"], "1 piezo stack along z", {"z": 30e-6}),
        wish(["x"], "1 piezo stack along x", {"x": 30e-6}, platform={"shape": "box"}),
        wish(["rx", "ry", "z"], "3 piezo stacks along z", {"z": 20e-6, "rx": 1e-3, "ry": 5e-4}, (0.0, 0.0, 0.054)),
        PLANAR,
        wish(
            ["x", "y", "rz"],
            "3 piezo stacks along x and y",
            {"x": 3e-6, "y": 3e-6, "rz": 1e-4},
            envelope=(0.2, 0.2, 0.03),
            platform={"shape": "box", "size": (44e-3, 44e-3, 12e-3), "at": (0.0, 0.0, 0.015)},
            base={"plane": "z-", "frame": True},
        ),
    ],
    ids=["z", "x", "tilts", "plane", "plane and turns"],
)
def test_drives_are_clear_of_all_else_and_in_the_envelope(own):
    room, found = listed(own)
    for topology in found:
        mechanism = draft(topology, WishFile(wish=own), room, "draft")
        assert not [each.text for each in fx.check(mechanism).clashes if each.kind == "clash"], topology.name
        middles, halves = topology.drive.boxes
        corners = np.concatenate([middles + halves * s for s in itertools.product((-1.0, 1.0), repeat=3)])
        for head, frame in zip(topology.drive.heads, topology.drive.frames, strict=True):
            assert room.outside(head + corners @ frame.T).max() < 1e-6


def test_a_stack_along_each_axis_moves_the_platform_along_that_alone():
    """By nearly what it expands, as limbs at their thinnest and necks are soft beside it."""
    room, found = listed(PLANAR)
    topology = next(own for own in found if own.drive.kind == "none")
    mechanism = with_rigid_bodies(slim(draft(topology, WishFile(wish=PLANAR), room, "draft")))
    asked = [f"coupling(drive{k}.stack, about.{axis})" for k in (1, 2) for axis in "xy"]
    moved = questions(plan_of(mechanism), ", ".join(asked)).values({}).value.reshape(2, 2)
    assert np.abs(np.diag(moved)) == pytest.approx([1, 1], abs=0.15)
    assert np.abs(moved - np.diag(np.diag(moved))).max() < 0.01


def test_a_gap_is_kept_without_stacks_that_push():
    """An optimum keeps it of the limbs alone, which stacks would hide."""
    file = WishFile(wish=PLANAR.replaced({"gap": 3.0}), requirements={"soft": "f1 >= 1 Hz"})
    room, found = listed(PLANAR, 2)
    work = AtRest(file, room, tuple(found[:1]), 4)
    begun = judged(work, 0, work(0)["values"][0])
    values = Optima(work, (begun,))(0)["values"]
    best = judged(work, 0, values) if len(values) else begun
    assert best.candidate.gap >= 3.0 and best.candidate.meets_all
    assert best.rank < begun.rank or begun.candidate.meets_all


@pytest.mark.parametrize("kind", ["bridge", "rhombus"])
@pytest.mark.parametrize(
    "platform",
    [
        {"shape": "box", "size": (6e-3, 8e-3, 5e-3), "at": (0.0, 0.0, 19e-3)},
        {"shape": "cylinder", "size": (20e-3, 4e-3), "at": (0.0, 0.0, 25e-3)},
    ],
    ids=["sides", "below"],
)
def test_arms_that_begin_at_the_platform_hold_it_and_move_it_by_their_ratio(kind, platform):
    """At the sides of a narrow platform, below a wide one: whatever the sizes are all is in one piece and in place."""
    own = wish(["z"], "1 piezo stack along z", {"z": 20e-6}, envelope=(0.05, 0.03, 0.03), platform=platform)
    room = room_of(own)
    found = driven([], room, own, THINNEST)
    (topology,) = (each for each in found if each.drive.kind == kind)
    drive = topology.drive
    assert topology.name == f"1 {kind} around a piezo stack" and not topology.patterns
    assert (drive.top.tall > 0) is (platform["shape"] == "box")
    mechanism = draft(topology, WishFile(wish=own), room, "draft")
    assert dumps(loads(dumps(mechanism))) == dumps(mechanism)
    asked = "amplification(drive1.stack, about.z)"
    ratio = questions(plan_of(with_rigid_bodies(mechanism)), asked).values({}).value[0, 0]
    assert -ratio == pytest.approx(drive.ratio, rel=0.1)
    assert drive.ratio >= drive.needed
    for end in ("minimum", "maximum"):
        sizes = {name: p.model_copy(update={"value": getattr(p, end)}) for name, p in mechanism.parameters.items()}
        assert all(float(p.minimum) < float(p.maximum) for p in sizes.values())
        clashes = fx.check(mechanism.replaced({"parameters": sizes})).clashes
        assert not [each.text for each in clashes if each.kind == "clash"]


def test_amplifiers_hold_nothing_that_may_tilt():
    """Where more is free than a translation along the stacks rods lead to the platform."""
    own = wish(["rx", "ry", "z"], "3 piezo stacks along z", {"z": 20e-6, "rx": 1e-3, "ry": 5e-4}, (0.0, 0.0, 0.054))
    assert all(each.drive.top is None for each in listed(own)[1])


def test_a_stack_by_itself_stands_where_it_just_reaches():
    """Beside the axis of a wished rotation, along a platform that is longer than wide."""
    platform = {"shape": "box", "size": (60e-3, 8e-3, 12e-3), "at": (0.0, 0.0, 52e-3)}
    about, stack = (-27e-3, 0.0, 43e-3), {"free_stroke": 36e-6, "stiffness": 3e7, "length": 36e-3, "edge": 5e-3}
    drives = {"kind": "piezo stack", "count": 1, "along": "z"} | stack
    own = wish(["ry"], drives, {"ry": 1.7e-3}, about, (66e-3, 8e-3, 58e-3), platform=platform, make=MILLED)
    _, found = listed(own)
    drive = found[0].drive
    assert drive.kind == "none"
    arm = abs(drive.heads[0, 0] - about[0])
    assert 0.87 < arm * 1.7e-3 / 18e-6 < 0.93
    assert "post on a notch" in found[0].name


def test_several_freedoms_are_reached_at_all_corners_where_it_is_said():
    """The stacks that lead to each corner, by inverting what they move, are within their strokes, and the least reach
    is no more than that."""
    own = wish(["rx", "ry", "z"], "3 piezo stacks along z", {"z": 20e-6, "rx": 1e-3, "ry": 5e-4}, (0.0, 0.0, 0.054))
    room, found = listed(own)
    mechanism = slim(draft(found[0], WishFile(wish=own), room, "draft"))
    asked = ", ".join(f"coupling(drive{k}.stack, about.{name})" for name in own.stroke for k in (1, 2, 3))
    C = fx.questions(mechanism, asked).values({}).value.reshape(3, 3)
    strokes = np.array([20e-6, 1e-3, 5e-4])
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * strokes
    most = np.abs(np.linalg.solve(C, corners.T)).max()
    found = reached(mechanism)
    least = min(each.value / stroke for each, stroke in zip(found, strokes, strict=True))
    assert [each.name for each in found] == [f"reach {name}" for name in own.stroke]
    assert 0.5 < least <= STACK.free_stroke / 2 / most * (1 + 1e-9)
    assert least > 0.98 * STACK.free_stroke / 2 / most  # stacks that are even around the axis move one by one


def test_without_stacks_a_topology_is_what_it_was():
    """What its freedoms are apart from is asked without them."""
    own = wish(["z"], "1 piezo stack along z", {"z": 30e-6})
    plain = own.replaced({"drives": None})
    room, found = listed(own)
    (of,) = topologies(room, own.make.process, THINNEST)[:1]
    bare = draft(of, WishFile(wish=own), room, "draft")
    assert dumps(bare) == dumps(draft(of, WishFile(wish=plain), room, "draft"))
    assert not set(bare.parameters) - set(draft(beside(found)[0], WishFile(wish=own), room, "draft").parameters)


def test_what_no_amplifier_reaches_is_told_with_the_ratio():
    own = wish(["z"], "1 piezo stack along z", {"z": 2e-3}, envelope=(0.06, 0.06, 0.04))
    with pytest.raises(
        OptionError, match=r"takes 4000 um .* a ratio of 267 .* a bridge gives \d+ at most, a rhombus .* a lever"
    ):
        listed(own)


def test_too_few_stacks_are_told():
    own = wish(["rx", "ry", "z"], "1 piezo stack along z", {"rx": 1e-3, "ry": 1e-3}, (0.0, 0.0, 0.054))
    with pytest.raises(OptionError, match="1 piezo stack along z cannot move each of rx, ry by itself"):
        listed(own)


def test_long_stacks_go_without_amplifiers():
    stack = {"kind": "piezo stack", "count": 1, "along": "z", "length": 20e-3, "edge": 5e-3}
    own = wish(["z"], stack | {"free_stroke": 30e-6, "blocked_force": 900.0}, {"z": 5e-6})
    assert own.drives is not None
    assert own.drives.stack.stiffness == pytest.approx(30e6)
    assert {each.drive.kind for each in listed(own)[1]} == {"none"}


@pytest.mark.parametrize(
    ("drives", "told"),
    [
        ({"kind": "voice coil", "count": 1, "along": "z", "length": 18e-3}, "voice coils have a count"),
        ({"kind": "piezo stack", "count": 1, "along": "z", "free_stroke": 15e-6}, "two of free_stroke"),
        ({"kind": "piezo stack", "count": 1, "along": "z", "free_stroke": 15e-6, "stiffness": 5e7}, "a length and"),
        ("3 levers along z", "3 piezo stacks along z"),
    ],
)
def test_what_is_wrong_with_stacks_is_told(drives, told):
    with pytest.raises(ModelError, match=told):
        wish(["z"], drives, {"z": 5e-6})


def test_stacks_without_a_stroke_are_told():
    with pytest.raises(ModelError, match="none is given"):
        wish(["z"], "1 piezo stack along z", {})
