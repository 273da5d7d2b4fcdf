"""What tolerances do to mechanisms whose answers follow by hand: spreads, yields, worst cases, indices, failures."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.errors import OptionError
from helpers.shell import GUIDE

RHO, LENGTH, WIDTH, THICKNESS = 7850.0, 60e-3, 20e-3, 0.5e-3
LEAF = RHO * LENGTH * WIDTH
"""Mass of a leaf per metre of its thickness: the mass of the guide is linear in it."""


def guide(studies: str = "") -> fx.Mechanism:
    return fx.loads(GUIDE.read_text(encoding="utf-8").partition("studies:")[0] + studies)


@cache
def alike() -> fx.Tolerance:
    """Leaves that are cut from one sheet."""
    return fx.tolerance(
        guide(),
        vary={"thickness": "± 0.02 mm"},
        each=False,
        ask="mass, f1",
        require=["mass <= 47.5 g", "f1 >= 50 Hz"],
        samples=1024,
        workers=1,
    )


@cache
def apart() -> fx.Tolerance:
    """Leaves that are machined one by one."""
    return fx.tolerance(guide(), vary={"thickness": "± 0.02 mm"}, ask="mass", samples=1024, workers=1)


def test_leaves_of_one_sheet_scatter_together() -> None:
    mass, half = alike().of("mass"), 2 * LEAF * 0.02e-3
    assert [size.name for size in alike().sizes] == ["thickness"]
    assert mass.deviation == pytest.approx(half / np.sqrt(3), rel=1e-3)
    assert mass.linear_deviation == pytest.approx(half / np.sqrt(3), rel=1e-9)
    assert mass.mean.value == pytest.approx(mass.nominal, rel=1e-6)
    assert mass.worst_high.value - mass.nominal == pytest.approx(half, rel=1e-9)
    assert mass.worst_low.value - mass.nominal == pytest.approx(-half, rel=1e-9)
    assert mass.worst_low.is_vertex and mass.worst_high.is_vertex
    for share, own in zip(alike().shares, mass.percentiles, strict=True):
        truth = mass.nominal + half * (2 * share - 1)
        assert own.low <= truth <= own.high
        assert own.value == pytest.approx(truth, abs=5e-3 * half)


def test_leaves_machined_one_by_one_scatter_less_together() -> None:
    mass, half = apart().of("mass"), 2 * LEAF * 0.02e-3
    assert len(apart().sizes) == 2
    assert {size.tolerance for size in apart().sizes} == {"thickness"}
    assert mass.deviation == pytest.approx(half / np.sqrt(6), rel=5e-3)
    assert mass.linear_deviation == pytest.approx(half / np.sqrt(6), rel=1e-9)
    np.testing.assert_allclose(mass.variance_share, [0.5, 0.5], rtol=1e-9)
    for share, own in zip(apart().shares, mass.percentiles, strict=True):
        tail = np.sqrt(2 * min(share, 1 - share)) - 1  # a sum of two uniform numbers is triangular
        truth = mass.nominal + half * (tail if share <= 0.5 else -tail)
        assert own.low <= truth <= own.high
    assert mass.worst_high.value - mass.nominal == pytest.approx(half, rel=1e-9)


def test_the_share_of_parts_that_meet_a_limit() -> None:
    first, second, both = alike().yields
    nominal = alike().of("mass").nominal
    truth = 0.5 + (47.5e-3 - nominal) / (2 * 2 * LEAF * 0.02e-3)
    assert first.share.low <= truth <= first.share.high
    assert first.share.value == pytest.approx(truth, abs=2e-3)
    assert first.failing == round((1 - first.share.value) * 1024)
    assert (first.is_met_nominally, first.is_met_at_worst) == (True, False)
    assert (second.share.value, second.share.high, second.failing) == (1.0, 1.0, 0)
    assert second.share.low == pytest.approx(0.025 ** (1 / 1024))
    assert second.share.method == "Clopper-Pearson"
    assert (second.is_met_nominally, second.is_met_at_worst) == (True, True)
    assert both.share == first.share


def test_of_two_tolerances_that_which_does_most_is_to_be_tightened_first() -> None:
    found = fx.tolerance(
        guide(), vary={"thickness": "± 0.02 mm", "length": "± 0.4 mm"}, each=False, ask="mass", samples=4096, workers=1
    )
    parts = np.array([LENGTH * 0.02e-3, THICKNESS * 0.4e-3]) ** 2
    truth = parts / parts.sum()
    assert found.indices is not None
    np.testing.assert_allclose(found.indices.first[:, 0], truth, atol=5e-3)
    np.testing.assert_allclose(found.indices.total[:, 0], truth, atol=5e-3)
    np.testing.assert_allclose(found.quantities[0].variance_share, truth, rtol=1e-9)
    assert found.tighten_first == {"mass": "thickness"}
    assert list(found.influence("mass")) == ["thickness", "length"]
    without = fx.tolerance(
        guide(),
        vary=["thickness=± 0.02 mm", "length=± 0.4 mm"],
        each=False,
        ask="mass",
        samples=24,
        indices=False,
        workers=1,
    )
    assert without.indices is None
    assert without.influence("mass")["length"] == pytest.approx(truth[1], rel=1e-9)


def test_designs_that_fail_are_said_and_meet_nothing() -> None:
    """Thickness below its minimum is no design: one in four."""
    text = GUIDE.read_text(encoding="utf-8").partition("studies:")[0].replace("minimum: 0.1 mm", "minimum: 0.49 mm")
    found = fx.tolerance(
        fx.loads(text),
        vary={"thickness": "normal 14.826 um"},  # a quarter of a normal distribution lies below -0.6745 sigma
        each=False,
        ask="mass",
        require="mass <= 1 kg",
        samples=1024,
        workers=1,
    )
    assert found.failed == pytest.approx(256, abs=8)
    assert found.yields[0].share.value == pytest.approx(0.75, abs=0.01)
    assert "minimum" in next(iter(found.reasons))
    assert [own.kind for own in found.warnings] == ["study"]
    assert np.isfinite(found.of("mass").deviation)


def test_the_study_of_a_file_and_what_is_given_in_its_place() -> None:
    model = guide(
        "studies:\n"
        "  sheet:\n"
        "    tolerance: {vary: {thickness: {uniform: 0.02 mm, each: false}}, ask: mass, samples: 256}\n"
        "  other:\n    tolerance: {vary: {length: {triangular: 0.4 mm, each: false}}, require: mass <= 47.2 g}\n"
    )
    found = fx.tolerance(model, study="sheet", seed=3, workers=1)
    assert (found.samples, found.seed, found.tolerances) == (256, 3, ("thickness",))
    assert [size.name for size in found.sizes] == ["thickness"]
    other = fx.tolerance(model, study="other", samples=100, workers=1)
    assert other.sizes[0].distribution["kind"] == "triangular"
    assert (other.sizes[0].low, other.sizes[0].high) == (pytest.approx(59.6e-3), pytest.approx(60.4e-3))
    assert [own.text for own in other.yields] == ["mass <= 47.2 g"]
    with pytest.raises(OptionError, match="sheet, other"):
        fx.tolerance(model)
    with pytest.raises(OptionError, match="sheet, other"):
        fx.tolerance(model, study="none")
    assert fx.tolerance(model, vary={"width": "± 1 %"}, each=False, ask="mass", samples=24).tolerances == ("width",)


@pytest.mark.parametrize("value", [0.5, -0.5, 40.0])
def test_per_cent_are_of_the_value_of_pure_numbers_too(value: float) -> None:
    """In files as in texts, whatever the sign."""
    distance = "  distance: {value: 50 mm, source: example}\n"
    for text in ("± 2 %", "{uniform: 2 %, each: false}"):
        study = f"studies: {{s: {{tolerance: {{vary: {{part: {text}}}, ask: part, samples: 24}}}}}}\n"
        bare = GUIDE.read_text(encoding="utf-8").partition("studies:")[0]
        model = fx.loads(bare.replace(distance, f"{distance}  part: {value}\n") + study)
        found = [
            fx.tolerance(model, workers=1),
            fx.tolerance(model, vary="part=± 2 %", ask="part", samples=24, workers=1),
        ]
        for own in found:
            assert own.sizes[0].low == pytest.approx(value - 0.02 * abs(value))
            assert own.sizes[0].high == pytest.approx(value + 0.02 * abs(value))
            assert own.quantities[0].worst_high.value == pytest.approx(value + 0.02 * abs(value))


def test_a_nominal_value_that_is_set_moves_the_tolerance() -> None:
    found = fx.tolerance(
        guide(), {"thickness": 0.4e-3}, vary="thickness=± 0.02 mm", each=False, ask="mass", samples=24, workers=1
    )
    assert (found.sizes[0].low, found.sizes[0].high) == (pytest.approx(0.38e-3), pytest.approx(0.42e-3))


def test_copies_with_values_of_their_own_scatter_about_these() -> None:
    """The first leaf is 0.4 mm thick, the second as thick as the parameter says, 0.45 mm."""
    text = GUIDE.read_text(encoding="utf-8")
    pattern = "pattern: {type: linear, count: 2, step: [distance, 0, 0]}"
    own = fx.loads(text.replace(pattern, pattern + "\n    copies: {leaf1: {thickness: 0.4 mm}}"))
    found = fx.tolerance(own, {"thickness": 0.45e-3}, vary="thickness=± 5 %", ask="mass", samples=24, workers=1)
    assert [size.nominal for size in found.sizes] == pytest.approx([0.4e-3, 0.45e-3])
    assert [size.high - size.nominal for size in found.sizes] == pytest.approx([0.02e-3, 0.0225e-3])
    mass = found.quantities[0]
    assert mass.nominal - alike().of("mass").nominal == pytest.approx(-LEAF * 0.15e-3)
    assert mass.worst_high.value - mass.nominal == pytest.approx(LEAF * 0.0425e-3)
    assert mass.mean.value == pytest.approx(mass.nominal, rel=1e-3)


def test_what_is_highest_within_the_tolerances_is_no_corner() -> None:
    """A product of the distance and what the distance leaves of a metre has its highest value in between."""
    distance = "  distance: {value: 50 mm, source: example}\n"
    text = GUIDE.read_text(encoding="utf-8").replace(distance, distance + "  hill: distance*(0.1 m - distance)\n")
    model = fx.loads(text)
    found = fx.tolerance(model, vary="distance=± 10 mm", ask="hill", require="hill >= 0.002 m^2", samples=48, workers=1)
    hill = found.quantities[0]
    assert hill.worst_low.value == pytest.approx(0.04 * 0.06)
    assert not hill.worst_high.is_vertex
    assert hill.worst_high.value <= 0.05**2
    assert any("highest value" in note for note in found.notes)
    assert any("far from linear" in note for note in found.notes)
    assert found.yields[0].is_met_at_worst is True


def test_frequencies_that_coincide_have_no_shares_unless_sizes_keep_them_together() -> None:
    """A square bar bends in two directions at one frequency; its sides part them, its length does not."""
    bar = fx.loads(
        "flexura: 1\nname: square bar\nparameters: {b: 10 mm, length: 1 m}\ncorrections: none\n"
        "nodes: {foot: [0, 0, 0], tip: [0, 0, length]}\n"
        "links:\n  bar:\n    nodes: [foot, tip]\n    material: spring-steel\n    reference: x\n    elements: 2\n"
        "    section: {shape: rectangle, width: b, thickness: 10 mm}\nground: {foot: clamped}\n"
    )
    apart = fx.tolerance(bar, vary="b=± 0.1 mm", ask="f1, f2", samples=24, workers=1)
    assert np.isnan(apart.of("f1").variance_share).all()
    assert "coincides" in apart.of("f1").no_slope
    assert apart.of("f1").worst_low.value == pytest.approx(0.99 * apart.of("f1").nominal, rel=1e-3)
    assert apart.of("f2").worst_high.value == pytest.approx(1.01 * apart.of("f1").nominal, rel=1e-3)
    kept = fx.tolerance(bar, vary="length=± 1 mm", ask="f1, f2", samples=24, workers=1)
    for own in kept.quantities:
        assert own.no_slope == ""
        assert own.slope[0] == pytest.approx(-2 * own.nominal, rel=1e-3)
        assert own.worst_low.is_vertex


def test_seeds_name_samples() -> None:
    def drawn(seed: int) -> np.ndarray:
        return fx.tolerance(
            guide(), vary="thickness=± 1 %", each=False, ask="mass", samples=48, seed=seed, indices=False, workers=1
        ).values

    np.testing.assert_array_equal(drawn(1), drawn(1))
    assert not np.array_equal(drawn(1), drawn(2))


def test_curves_for_pictures() -> None:
    found = alike()
    edges, counts = found.histogram("mass")
    assert counts.sum() == 1024
    assert len(edges) == len(counts) + 1
    limits, share = found.yield_curve("mass", points=11)
    assert share[0] == 1.0
    assert share[-1] == pytest.approx(1 / 1024)
    np.testing.assert_allclose(share, np.linspace(1, 0, 11), atol=3e-3)
    assert found.tornado("mass")["thickness"] == (
        pytest.approx(found.of("mass").worst_low.value),
        pytest.approx(found.of("mass").worst_high.value),
    )
    assert limits[0] == found.of("mass").smallest


def test_plain_data_and_table() -> None:
    data = apart().to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert "values" not in data
    table = alike().to_columns()
    assert table["quantity"] == ["mass", "f1"]
    assert {len(column) for column in table.values()} == {2}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"vary": {}}, "no size has a tolerance"),
        ({"vary": {"thikness": "± 1 %"}}, "did you mean 'thickness'"),
        ({"vary": "thickness"}, "NAME=TOLERANCE"),
        ({"vary": ["thickness=± 1 %", "thickness=± 2 %"]}, "already"),
        ({"vary": {"thickness": "± 0.45 mm"}}, "below the minimum"),
        ({"vary": {"thickness": "+1.6/-0 mm"}}, "above the maximum"),
        ({"ask": ()}, "no quantity is named"),
        ({"ask": "f0"}, "f0"),
        ({"require": "f1 >= 20 mm"}, "dimension"),
        ({"each": ["length"]}, "length"),
        ({"samples": 3}, "from 24"),
        ({"samples": 0}, "from 24"),
        ({"seed": -1}, "seed"),
        ({"percentiles": [0]}, "percentile"),
        ({"confidence": 1.0}, "confidence"),
    ],
)
def test_what_cannot_be_meant_is_named_before_work_starts(options: dict[str, object], words: str) -> None:
    given: dict[str, object] = {"vary": {"thickness": "± 1 %"}, "ask": "mass"}
    with pytest.raises(OptionError, match=words):
        fx.tolerance(guide(), **{**given, **options})  # type: ignore[arg-type]


def test_a_folder_keeps_the_designs(tmp_path: Path) -> None:
    def again() -> fx.Tolerance:
        return fx.tolerance(
            guide(), vary="thickness=± 1 %", each=False, ask="mass", samples=48, folder=tmp_path / "study", workers=1
        )

    first = again()
    files = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "study").glob("*.parquet")}
    assert files
    np.testing.assert_array_equal(again().values, first.values)
    assert files == {path.name: path.stat().st_mtime_ns for path in (tmp_path / "study").glob("*.parquet")}


def side_by_side() -> fx.Mechanism:
    """Leaves beside each other across the motion: what makes them differ turns the carriage."""
    text = GUIDE.read_text(encoding="utf-8")
    text = text.replace("at: [-distance/2, 0, 0]", "at: [0, -distance/2, 0]")
    return fx.loads(text.replace("step: [distance, 0, 0]", "step: [0, distance, 0]") + "corrections: none\n")


def test_leaves_that_differ_turn_a_pure_motion_into_a_parasitic_rotation() -> None:
    """To first order, rz per force along x is 3 d/4 (t2 - t1)/t / (6 E Iy d^2/L^3 + 2 G J/L), from each leaf's shear
    force (1 + 3 dt/t) F/2 at its distance from the middle, against the leaves' bending and torsion."""
    E, G, d, reach = 206e9, 79.5e9, 50e-3, 1e-6
    Iy, J = WIDTH * THICKNESS**3 / 12, WIDTH * THICKNESS**3 / 3 * (1 - 0.63025 * THICKNESS / WIDTH)
    per_share = 0.75 * d / (6 * E * Iy * d**2 / LENGTH**3 + 2 * G * J / LENGTH)
    half = 2 * per_share * reach / THICKNESS
    question = "compliance(carriage.rz, carriage.tx)"
    found = fx.tolerance(
        side_by_side(), vary={"thickness": f"± {reach} m"}, ask=question, samples=192, indices=False, workers=1
    ).quantities[0]
    assert found.nominal == pytest.approx(0.0, abs=1e-9 * half)
    assert found.deviation == pytest.approx(half / np.sqrt(6), rel=2e-2)
    assert found.linear_deviation == pytest.approx(half / np.sqrt(6), rel=2e-2)
    np.testing.assert_allclose(found.variance_share, [0.5, 0.5], rtol=1e-6)
    np.testing.assert_allclose([found.worst_low.value, found.worst_high.value], [-half, half], rtol=2e-2)
    assert found.worst_low.is_vertex
    assert found.percentiles[1].low <= half * (np.sqrt(2 * 0.05) - 1) <= found.percentiles[1].high
    assert found.mean.low <= 0 <= found.mean.high
    alike = fx.tolerance(
        side_by_side(), vary={"thickness": f"± {reach} m"}, each=False, ask=question, samples=24, workers=1
    ).quantities[0]
    assert alike.deviation <= 1e-9 * half
    assert abs(alike.worst_high.value - alike.worst_low.value) <= 1e-9 * half


MIRRORED = """
flexura: 1
name: mirrored leaves
parameters: {tilt: 1 mm}
substructures:
  leaf:
    nodes: {foot: [25 mm, 0, 0], head: [25 mm + tilt, 2 mm, 60 mm]}
    flexures: {blade: {nodes: [foot, head], material: spring-steel, reference: x, profile: PROFILE}}
    interface: [foot, head]
instances: {leaf: {of: leaf, pattern: {type: mirror, normal: x}}}
bodies: {block: {centre: [3 mm, 5 mm, 65 mm], mass: 1 kg, inertia: INERTIA, carries: ["leaf*.head"]}}
ground: {"leaf*.foot": clamped}
"""
BY_HAND = """
flexura: 1
name: each leaf by itself
parameters: {right: 1 mm, left: 1 mm}
nodes: {a: [25 mm, 0, 0], b: [25 mm + right, 2 mm, 60 mm], c: [-25 mm, 0, 0], d: [-25 mm - left, 2 mm, 60 mm]}
flexures:
  right: {nodes: [a, b], material: spring-steel, reference: x, profile: PROFILE}
  left: {nodes: [c, d], material: spring-steel, reference: x, profile: PROFILE}
bodies: {block: {centre: [3 mm, 5 mm, 65 mm], mass: 1 kg, inertia: INERTIA, carries: [b, d]}}
ground: {a: clamped, c: clamped}
"""


def test_mirrored_copies_have_their_values_in_their_own_frames() -> None:
    """A parasitic rotation that mirrored leaves bring about by their differences alone has the right sign."""
    common = {"PROFILE": "{type: leaf, width: 20 mm, thickness: 0.5 mm}"}
    common["INERTIA"] = "[0.1 g*m^2, 0.2 g*m^2, 0.3 g*m^2]"
    mirrored, by_hand = MIRRORED, BY_HAND
    for word, text in common.items():
        mirrored, by_hand = mirrored.replace(word, text), by_hand.replace(word, text)
    asked = "compliance(block.x, block.z), compliance(block.x, block.ry), f1"
    found = fx.tolerance(fx.loads(mirrored), vary={"tilt": "± 0.3 mm"}, ask=asked, samples=32, workers=1)
    assert [size.name for size in found.sizes] == ["tilt_leaf1", "tilt_leaf2"]
    hand = fx.questions(fx.loads(by_hand), asked)
    for q, own in enumerate(found.quantities):
        for end in (own.worst_low, own.worst_high):
            right, left = end.sizes
            assert end.value == pytest.approx(hand.values({"right": [right], "left": [left]}).value[0, q], rel=1e-8)
    parasitic = found.quantities[0]
    assert parasitic.worst_low.sizes[0] != parasitic.worst_low.sizes[1]
    assert parasitic.worst_low.value < 0 < parasitic.worst_high.value
