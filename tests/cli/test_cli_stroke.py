"""`flexura stroke`: what it prints and writes, and what it says of ranges that are none."""

import csv
import json
from pathlib import Path

import pytest

import flexura as fx
from helpers.shell import flexura, refused

EXAMPLES = Path(__file__).parents[2] / "examples"
GUIDE = EXAMPLES / "guide" / "guide.yaml"


def test_poses_are_those_of_python(tmp_path):
    table = tmp_path / "poses.csv"
    options = ("--move", "carriage.x=-4mm:4mm", "--steps", "5", "-n", "3")
    told = json.loads(flexura("stroke", GUIDE, *options, "--out", table, "--json").stdout)
    own = fx.stroke(fx.load(GUIDE), move={"carriage.x": (-0.004, 0.004)}, steps=5, n=3)
    assert told["poses"] == own.to_dict()["poses"]
    assert told["files"] == [str(table)]
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    assert [float(row["carriage.x [m]"]) for row in rows] == pytest.approx([-0.004, -0.002, 0, 0.002, 0.004])
    assert [float(row["f2 [Hz]"]) for row in rows] == pytest.approx([p.frequency_hz[1] for p in own.poses])


def test_nodes_that_are_asked_for_are_printed():
    """In mm and rad, where they are at each pose; a guide sinks by 3/5 of the stroke squared over its leaves."""
    options = ("--move", "carriage.x=0:4mm", "--steps", "2", "-n", "1", "--node", "carriage")
    lines = flexura("stroke", GUIDE, *options).stdout.splitlines()
    heads = next(k for k, line in enumerate(lines) if "carriage.z [mm]" in line)
    x, y, z, *_ = (float(word) for word in lines[heads + 2].split())
    assert x == 4.0 and y == 0.0
    assert z == pytest.approx(-0.6 * 16 / 60, rel=0.01)


def test_nodes_that_the_motion_names_are_printed(tmp_path):
    """As by `--node`, where the motion of the file is followed; another motion has nodes of its own."""
    file = tmp_path / "guide.yaml"
    file.write_text(
        f"extends: {GUIDE}\nmotion: {{move: {{carriage: {{x: [0, 4 mm]}}}}, steps: 2, modes: 1, nodes: [leaf1.head]}}\n"
    )
    printed = flexura("stroke", file).stdout
    assert "leaf1.head.z" in printed
    assert printed == flexura("stroke", file, "--node", "leaf1.head").stdout
    assert "leaf1.head" not in flexura("stroke", file, "--move", "carriage.x=0:4mm", "--steps", 2, "-n", 1).stdout


def test_what_loads_move_shows_how_far_it_goes():
    """F / k of two leaves with ends that stay parallel: k = 24 E I / L^3 to a few per cent."""
    told = flexura("stroke", GUIDE, "--load", "carriage=0,0,0:1,0,0 N", "--steps", "2", "-n", "1").stdout.splitlines()
    assert told[1].split()[:5] == ["carriage.Fx", "[N]", "carriage.x", "[mm]", "f1"]
    thickness, width, length, E = 0.5e-3, 20e-3, 60e-3, 206e9
    k = 24 * E * (width * thickness**3 / 12) / length**3
    assert float(told[3].split()[1]) == pytest.approx(1e3 / k, rel=0.06)


def test_a_rotation_is_in_degrees_and_held_by_a_moment():
    options = ("--move", "arm.ry=5deg", "-n", 2)
    heads, row = flexura("stroke", EXAMPLES / "pivot" / "pivot.yaml", *options).stdout.splitlines()[1:3]
    assert "arm.ry [deg]" in heads and "N m]" in heads and "rad]" not in heads and row.split()[0] == "5"


@pytest.mark.parametrize(
    ("move", "said"),
    [
        ("carriage.x=3", "has no unit; a length with its unit is expected"),
        ("carriage.x=3mm:", "NODE.AXIS=FROM:TO or NODE.AXIS=TO is expected"),
        ("carriage.ry=3mm", "is no"),
        ("carriage=3mm", "is no displacement: write NODE.AXIS"),
        ("leaf1.foot.x=3mm", "it is held by the ground"),
        ("wagon.x=3mm", "wagon"),
    ],
)
def test_what_is_no_range_is_named(move, said):
    refused(flexura("stroke", GUIDE, "--move", move), said)


def test_a_way_that_ends_is_said_with_what_was_reached():
    way = ("stroke", GUIDE, "--move", "carriage.x=0:90mm", "--steps", 4, "-n", 1)
    assert "no equilibrium is found beyond carriage.x = 0.0" in flexura(*way).stdout.replace("\n", " ")
    strict = flexura(*way, "--strict")
    assert strict.returncode == 1
    assert "no equilibrium" in strict.stderr
