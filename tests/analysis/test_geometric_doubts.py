"""What a person would see at a glance: parts in each other or in the air, leaves the wrong way round, wrong units."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.analysis.checks import clashes as rules
from flexura.cli.app import app
from flexura.modelfile import load, save

STEEL = fx.describe.Material(E=200e9, nu=0.3, rho=7800.0)
GEOMETRIC = {"clash", "deep", "touch", "gap", "unseen", "reference", "thick", "unit"}
EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*/*.yaml"))
HALF = 0.02 * np.sin(np.pi / 4)


def geometric(mechanism, **parameters):
    return [doubt for doubt in fx.check(mechanism, parameters or None).warnings if doubt.kind in GEOMETRIC]


def leaf(a, b, reference="z", width=12e-3, thickness=0.4e-3, **more):
    profile = fx.describe.Leaf(width=width, thickness=thickness)
    return fx.describe.Flexure(nodes=(a, b), material="steel", reference=reference, profile=profile, **more)


def pivot(y=12e-3, references=("z", "z"), thickness=0.4e-3, size=36e-3):
    """Two leaves, 40 mm long, that cross at right angles, `y` to both sides of the middle, under a block."""
    return fx.Mechanism(
        materials={"steel": STEEL},
        nodes={"fl": (-HALF, -y, -HALF), "hr": (HALF, -y, HALF), "fr": (HALF, y, -HALF), "hl": (-HALF, y, HALF)},
        flexures={
            "rising": leaf("fl", "hr", references[0], thickness=thickness),
            "falling": leaf("fr", "hl", references[1], thickness=thickness),
        },
        bodies={
            "arm": fx.describe.RigidBody(
                centre=(0, 0, HALF + 0.01),
                solid=fx.describe.Box(size=(2 * HALF + 0.01, size, 0.02), material="steel"),
                carries=("hl", "hr"),
            )
        },
        ground={"fl": "clamped", "fr": "clamped"},
    )


STIFF = fx.describe.DiagonalStiffness(tx=1e6, ty=1e6, tz=1e6, rx=1e3, ry=1e3, rz=1e3)


def blocks(*bodies):
    """Bodies on springs: (centre, solid, carried nodes, rotation)."""
    return fx.Mechanism(
        materials={"steel": STEEL},
        bodies={
            f"b{k}": fx.describe.RigidBody(centre=centre, solid=solid, carries=carries, rotate=rotate)
            for k, (centre, solid, carries, rotate) in enumerate(bodies)
        },
        springs={
            "ground": fx.describe.Spring(nodes=("b0",), stiffness=STIFF),
            **{f"s{k}": fx.describe.Spring(nodes=("b0", f"b{k}"), stiffness=STIFF) for k in range(1, len(bodies))},
        },
    )


def cube(x, size=0.01, carries=(), rotate=None):
    return (x, fx.describe.Box(size=(size, size, size), material="steel"), carries, rotate)


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_no_example_is_in_doubt(file) -> None:
    assert geometric(load(file)) == []


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_doubts_do_not_depend_on_size(size) -> None:
    """Boxes 10 um to 10 m long."""
    for x, kinds in ((1.001, []), (1.0, ["touch"]), (0.9, ["clash"])):
        m = blocks(cube((0, 0, 0), 0.01 * size), cube((0.01 * size * x, 0, 0.002 * size), 0.01 * size))
        assert [c.kind for c in fx.check(m).clashes] == kinds


def test_leaves_side_by_side_are_in_no_doubt() -> None:
    assert geometric(pivot()) == []


def test_leaves_that_cross_in_one_plane_share_a_rod() -> None:
    report = fx.check(pivot(y=0.0, size=12e-3))
    (clash,) = report.clashes
    assert (clash.kind, clash.first, clash.second) == ("clash", "rising", "falling")
    assert clash.volume == pytest.approx(0.4e-3**2 * 12e-3)
    np.testing.assert_allclose(clash.at, 0, atol=1e-9)
    (doubt,) = (d for d in report.warnings if d.kind in GEOMETRIC)
    assert doubt.kind == "clash" and "1.92 mm³" in doubt.text


@pytest.mark.parametrize(("y", "kinds"), [(5.9e-3, ["clash"]), (6e-3, ["touch"]), (6.001e-3, [])])
def test_leaves_that_just_meet_touch(y, kinds) -> None:
    assert [d.kind for d in geometric(pivot(y=y))] == kinds


def test_one_leaf_twice_is_seen() -> None:
    m = pivot()
    twice = m.model_copy(update={"flexures": {**m.flexures, "again": m.flexures["rising"]}})
    (clash,) = fx.check(twice).clashes
    assert (clash.first, clash.second) == ("rising", "again")


@pytest.mark.parametrize("gap", [2e-6, 0.0, -1e-3])
def test_bodies_that_nothing_joins(gap) -> None:
    found = fx.check(blocks(cube((0, 0, 0)), cube((0.01 + gap, 0.002, 0)))).clashes
    assert [c.kind for c in found] == ([] if gap > 0 else ["touch"] if gap == 0 else ["clash"])
    if gap < 0:
        assert found[0].volume == pytest.approx(-gap * 8e-3 * 10e-3)


def test_a_turned_body_and_a_cylinder_in_closed_form() -> None:
    turned = fx.describe.Rotation(axis=(0, 0, 1), angle=np.pi / 4)
    found = fx.check(blocks(cube((0, 0, 0)), cube((0, 0, 0), rotate=turned))).clashes
    assert found[0].volume == pytest.approx(0.01**3 * 2 * (np.sqrt(2) - 1))
    rod = fx.describe.Cylinder(diameter=4e-3, length=0.05, axis=(1, 0, 0), material="steel")
    plate = fx.describe.Plate(length=0.02, width=0.03, thickness=5e-3, material="steel")
    found = fx.check(blocks(((0, 0, 0), rod, (), None), ((0, 0, 0), plate, (), None))).clashes
    assert found[0].volume == pytest.approx(np.pi * 2e-3**2 * 0.02, rel=0.004)


def test_bodies_on_one_cluster_may_touch_but_not_count_twice() -> None:
    assert fx.check(blocks(cube((0, 0, 0), carries=("b1",)), cube((0.01, 0, 0)))).clashes == ()
    (found,) = fx.check(blocks(cube((0, 0, 0), carries=("b1",)), cube((0.007, 0, 0)))).clashes
    assert found.volume == pytest.approx(0.3 * 0.01**3) and "twice" in found.text


def guide(length=0.06, table=0.065, width=0.02, thickness=0.5e-3, references=("x", "x"), mass=None, **ends):
    solid = None if mass else fx.describe.Box(size=(0.07, 0.02, 0.01), material="steel")
    inertia = (1e-5, 1e-5, 1e-5) if mass else None
    nodes = {"f1": (0, 0, 0), "h1": (0, 0, length), "f2": (0.05, 0, 0), "h2": (0.05, 0, length)}
    return fx.Mechanism(
        materials={"steel": STEEL},
        nodes=nodes,
        flexures={
            f"leaf{k}": leaf(f"f{k}", f"h{k}", reference, width, thickness, **ends)
            for k, reference in zip((1, 2), references, strict=True)
        },
        bodies={
            "table": fx.describe.RigidBody(
                centre=(0.025, 0, table), solid=solid, mass=mass, inertia=inertia, carries=("h*",)
            )
        },
        ground={"f*": "clamped"},
    )


@pytest.mark.parametrize(("table", "kind"), [(0.065, None), (0.0646, None), (0.062, "deep"), (0.06503, None)])
def test_how_deep_a_leaf_may_stand_in_its_table(table, kind) -> None:
    found = fx.check(guide(table=table)).clashes
    assert {c.kind for c in found} == ({kind} if kind else set())
    if kind == "deep":
        assert found[0].volume == pytest.approx(3e-3 * 20e-3 * 0.5e-3)
        assert "runs 3 mm inside table" in found[0].text


def test_a_leaf_that_ends_in_the_air() -> None:
    (found,) = fx.check(guide(table=0.083)).clashes
    assert (found.kind, found.first, found.second, found.copies) == ("gap", "table", "leaf1", (("table", "leaf2"),))
    assert found.gap == pytest.approx(18e-3)
    assert found.text.startswith("carried node h1 is 18 mm from its solid: leaf1 ends in the air")
    assert fx.check(guide(table=0.083, mass=0.1)).clashes == ()  # whose solid is not known


def test_offsets_lead_to_the_surface() -> None:
    assert fx.check(guide(table=0.06, end_offset=(0, 0, -5e-3))).clashes == ()


def test_turned_at_will_the_doubts_are_the_same() -> None:
    """A substructure that is mirrored and turned about clashes as it does in place."""
    nodes = {"a": (0, 0, 0), "b": (0.04, 0, 0), "c": (0.02, -0.02, 0), "d": (0.02, 0.02, 0)}
    cross = fx.describe.Substructure(
        nodes=nodes, flexures={"one": leaf("a", "b"), "two": leaf("c", "d")}, interface=("a", "b", "c", "d")
    )
    for steps in ({}, {"rotate": fx.describe.Rotation(axis=(1, 2, 3), angle=1.0), "at": (1.0, -2.0, 0.5)}):
        own = fx.describe.Instance(
            of="cross", pattern=(fx.describe.MirrorPattern(normal=(1, 1, 0), point=(0.1, 0, 0)),), **steps
        )
        m = fx.Mechanism(
            materials={"steel": STEEL},
            substructures={"cross": cross},
            instances={"x": own},
            springs={
                f"s{k}": fx.describe.Spring(nodes=("x1.a", n), stiffness=STIFF)
                for k, n in enumerate(("x1.c", "x2.a", "x2.c"))
            },
            ground={"x1.a": "clamped"},
        )
        (clash,) = fx.check(m).clashes
        assert clash.volume == pytest.approx(12e-3**2 * 0.4e-3)
        assert clash.parts == {"x1.one", "x1.two", "x2.one", "x2.two"}
        assert clash.text.endswith("(and 1 more alike)")


@pytest.mark.parametrize("angle", [15.0, 60.0, 90.0, 120.0, 165.0])
@pytest.mark.parametrize("offset", [0.0, 0.01])
def test_links_that_meet_at_any_angle_are_in_no_doubt(angle, offset) -> None:
    way = np.deg2rad(angle)
    bar = {"material": "steel", "reference": (0, 0, 1), "section": fx.describe.Rectangle(width=6e-3, thickness=4e-3)}
    m = fx.Mechanism(
        materials={"steel": STEEL},
        nodes={"a": (0, 0, 0), "b": (0.08, 0, 0), "c": (0.08 - 0.08 * np.cos(way), 0.08 * np.sin(way), offset)},
        links={
            "one": fx.describe.Link(nodes=("a", "b"), **bar),
            "two": fx.describe.Link(nodes=("b", "c"), start_offset=(0, 0, offset), **bar),
        },
        ground={"a": "clamped"},
    )
    assert geometric(m) == []


def test_true_contours_decide() -> None:
    """A rod through the waist of a notch, where a box around the notch would be in the way."""
    waist = fx.describe.Notch(width=10e-3, contour=fx.describe.CircularContour(radius=10e-3, web=0.5e-3))
    notch = fx.describe.Flexure(nodes=("a", "b"), material="steel", reference=(0, 0, 1), profile=waist)
    for z, clear in ((1.3e-3, True), (1.2e-3, False)):
        m = fx.Mechanism(
            materials={"steel": STEEL},
            nodes={"a": (0, 0, 0), "b": (0.02, 0, 0), "c": (0.01, -0.02, z), "d": (0.01, 0.02, z)},
            flexures={"notch": notch},
            links={
                "rod": fx.describe.Link(nodes=("c", "d"), material="steel", section=fx.describe.Circle(diameter=2e-3))
            },
            springs={"s": fx.describe.Spring(nodes=("a", "c"), stiffness=STIFF)},
            ground={"a": "clamped"},
        )
        assert (fx.check(m).clashes == ()) is clear


def test_a_rod_in_a_tube_is_clear_of_it() -> None:
    for diameter, clear in ((7.8e-3, True), (8.4e-3, False)):
        m = fx.Mechanism(
            materials={"steel": STEEL},
            nodes={"a": (0, 0, 0), "b": (0.05, 0, 0), "c": (-0.01, 0, 0), "d": (0.06, 0, 0)},
            links={
                "rod": fx.describe.Link(
                    nodes=("c", "d"), material="steel", section=fx.describe.Circle(diameter=diameter)
                ),
                "tube": fx.describe.Link(
                    nodes=("a", "b"),
                    material="steel",
                    section=fx.describe.Tube(outer_diameter=0.01, inner_diameter=8e-3),
                ),
            },
            springs={"s": fx.describe.Spring(nodes=("a", "c"), stiffness=STIFF)},
            ground={"a": "clamped"},
        )
        assert (fx.check(m).clashes == ()) is clear


def test_what_is_beyond_the_budget_is_said(monkeypatch) -> None:
    monkeypatch.setattr(rules, "MOST_PIECES", 0)
    assert [d.kind for d in geometric(pivot(y=0.0, size=12e-3))] == ["unseen"]
    monkeypatch.setattr(rules, "MOST_PAIRS", 0)
    assert [d.kind for d in geometric(pivot(y=0.0, size=12e-3))] == ["unseen"]


def test_a_leaf_of_a_pivot_turned_the_wrong_way() -> None:
    for references, place in ((("y", "z"), "rising"), (("z", "y"), "falling")):
        (doubt,) = geometric(pivot(references=references))
        assert (doubt.kind, doubt.place) == ("reference", place)
        assert "times softer" in doubt.text


def test_a_leaf_of_a_guide_turned_the_wrong_way() -> None:
    assert geometric(guide()) == []
    assert geometric(guide(references=("y", "y"))) == []  # both alike: no neighbour says otherwise
    (doubt,) = geometric(guide(references=("y", "x")))
    assert doubt.kind == "reference" and doubt.place in ("leaf1", "leaf2")


def test_leaves_that_make_a_cross_or_an_angle_are_meant() -> None:
    """The planes of both run through one line: a hinge that twists."""
    for x in (0.0, 10e-3):
        m = guide(references=("y", "x"))
        nodes = {"f1": (x, 0, 0), "h1": (x, 0, 0.06), "f2": (0, 0, 0), "h2": (0, 0, 0.06)}
        assert not [d for d in geometric(m.model_copy(update={"nodes": nodes})) if d.kind == "reference"]


def test_thicker_than_long() -> None:
    found = [d for d in geometric(pivot(thickness=0.06)) if d.kind == "thick"]
    assert [d.places for d in found] == [("rising", "falling")]
    assert found[0].text.startswith("60 mm thick but 40 mm long") and "exchanged" in found[0].text
    found = [d for d in geometric(pivot(thickness=0.4)) if d.kind == "thick"]
    assert "0.4 mm meant?" in found[0].text


@pytest.mark.parametrize(("factor", "seen"), [(1000.0, True), (1e-3, True), (1250.0, True), (100.0, False)])
def test_a_size_a_unit_away_from_its_siblings(factor, seen) -> None:
    m = guide()
    leaves = {"leaf1": leaf("f1", "h1", "x", 20e-3 * factor), **{f"more{k}": m.flexures["leaf2"] for k in (1, 2)}}
    m = m.model_copy(update={"flexures": {**m.flexures, **leaves}})
    found = [d for d in geometric(m) if d.kind == "unit"]
    assert [d.place for d in found] == (["leaf1"] if seen else [])
    if seen:
        assert "20 mm of other flexures" in found[0].text


def test_the_command_tells_and_draws(tmp_path) -> None:
    path = tmp_path / "pivot.yaml"
    save(pivot(y=0.0, size=12e-3), path)
    assert load(path).flexures.keys() == {"rising", "falling"}
    text = CliRunner().invoke(app, ["check", str(path), "--plot", str(tmp_path / "p")]).output
    assert "rising: shares 1.92 mm³ with falling at (0, 0, 0) mm" in " ".join(text.split())
    assert (tmp_path / "p" / "warnings.png").stat().st_size > 10_000
    data = json.loads(CliRunner().invoke(app, ["check", str(path), "--json"]).output)
    assert data["clashes"][0]["volume"] == pytest.approx(1.92e-9)
    assert [d["kind"] for d in data["doubts"] if d["kind"] in GEOMETRIC] == ["clash"]
