"""Drawings of monoliths as mechanisms: against whole solids of another program, and what must not change them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.describe import Material
from flexura.outlines import Outline, Segment, outline_of, read_dxf
from helpers.monoliths import GUIDES, Piece, bridge, drawn, elliptic, folded

ezdxf = pytest.importorskip("ezdxf")
pytest.importorskip("shapely")

AL = Material(E=71.7e9, nu=0.33, rho=2810.0)
THICKNESS = {"A": 10e-3, "B": 12e-3}
# whole solids, NGSolve, curved tetrahedra of order 4: 233 037 and 134 319 DOFs
WHOLE = {"A": (115.04, 1035.4, 2280.5, 6388, 6430, 6536), "B": (290.7, 2222.9, 5250, 6513, 6558, 9483)}


def outline_from(loops: list[list[Piece]]) -> Outline:
    return outline_of(
        Segment((1e-3 * a[0], 1e-3 * a[1]), (1e-3 * b[0], 1e-3 * b[1]), a[2])
        for points in loops
        for a, b in zip(points, [*points[1:], points[0]], strict=True)
    )


def hz(mechanism: fx.Mechanism, n: int) -> np.ndarray:
    return fx.modes(mechanism, n=n, order="full").frequency_hz


@pytest.mark.parametrize("kind", ["lines", "polyline", "svg"])
@pytest.mark.parametrize("guide", ["A", "B"])
def test_guides_that_are_drawn_against_their_whole_solids(tmp_path: Path, guide: str, kind: str) -> None:
    path = drawn(GUIDES[guide], kind, tmp_path)
    result = fx.understand(path, thickness=THICKNESS[guide], material=AL, hold="x = 0 mm", with_solid=False)
    model = fx.loads(fx.dumps(result.mechanism))
    modes = fx.modes(model, n=6, order="full")
    np.testing.assert_allclose(modes.frequency_hz, WHOLE[guide], rtol=0.015)
    for value, whole, margin in zip(modes.frequency_hz, WHOLE[guide], modes.model_error, strict=True):
        assert margin is not None
        assert margin[0] <= whole / value - 1 <= margin[1]


def test_what_a_guide_consists_of(tmp_path: Path) -> None:
    result = fx.understand(
        drawn(GUIDES["A"], "lines", tmp_path), thickness=10e-3, material=AL, hold="x = 0 mm", with_solid=False
    )
    assert {own.kind for own in result.flexures} == {"circular"}
    places = sorted((round(own.place[0], 8), round(own.place[1], 8)) for own in result.flexures)
    assert places == [(0.016, 0.00315), (0.016, 0.03685), (0.044, 0.00315), (0.044, 0.03685)]
    for own in result.flexures:
        assert (own.web, own.length, own.radius) == pytest.approx((0.3e-3, 6e-3, 3e-3))
        assert own.direction == (1.0, 0.0)
        assert any(name.startswith("arm") for name in own.joins)
    assert [own.kind for own in result.blocks] == ["box", "box"]
    assert sorted(own.is_held for own in result.blocks) == [False, True]
    area = 60 * 40 - 40 * 27.4 - 8 * math.pi * 9 / 2
    assert result.mass == pytest.approx(area * 1e-6 * 10e-3 * 2810)
    data = json.loads(json.dumps(result.to_dict()))
    assert len(data["flexures"]) == 4
    assert data["notes"] == []


def test_the_solid_of_a_drawing_stands_beside_its_description(tmp_path: Path) -> None:
    pytest.importorskip("ngsolve")
    result = fx.understand(drawn(GUIDES["A"], "lines", tmp_path), thickness=10e-3, material=AL, hold="x=0 mm")
    solid = [mode.solid_hz for mode in result.modes]
    np.testing.assert_allclose(solid, WHOLE["A"], rtol=0.005)
    for mode in result.modes:
        assert mode.mac is not None and mode.mac > 0.9
        assert mode.difference is not None and abs(mode.difference) < 0.015
        assert mode.is_within
    assert result.warnings == ()
    assert len(result.to_columns()["mode"]) == 6
    assert "4 flexures, 2 blocks" in repr(result)


def test_a_bridge_amplifier_turned_by_30_degrees_is_the_same() -> None:
    """Held by a layer of its lines, since its base is across no axis."""
    straight = fx.understand(outline_from(bridge(1.0)), thickness=10e-3, material=AL, hold="y = 0 mm", with_solid=False)
    turned = outline_from(bridge(1.0, 30.0))
    right = np.array([math.sin(math.radians(30)), -math.cos(math.radians(30))])

    def named(own: Segment) -> Segment:
        on_base = max(abs(np.array(at) @ right) for at in (own.start, own.end)) < 1e-9
        return replace(own, layer="base") if on_base else own

    outline = outline_of(map(named, turned.segments))
    result = fx.understand(outline, thickness=10e-3, material=AL, hold="base", with_solid=False)
    assert {own.kind for own in result.flexures} == {"corner_filleted"}
    assert len(result.flexures) == len(result.blocks) == 8
    np.testing.assert_allclose(hz(result.mechanism, 8), hz(straight.mechanism, 8), rtol=5e-3)


# order 3 of the solid of the same drawing (this room's own mesh): a difference, not a truth
@pytest.mark.slow
@pytest.mark.parametrize(
    ("loops", "thickness", "kind", "within"),
    [(bridge(1.0), 10e-3, "corner_filleted", 0.03), (folded(0.3), 8e-3, "leaf", 0.015)],
    ids=["bridge", "folded leaves"],
)
def test_drawings_that_nobody_prepared(loops: list[list[Piece]], thickness: float, kind: str, within: float) -> None:
    result = fx.understand(outline_from(loops), thickness=thickness, material=AL, hold="y = 0 mm", n=8)
    assert {own.kind for own in result.flexures} == {kind}
    for mode in result.modes:
        assert mode.difference is not None and abs(mode.difference) < within
        assert mode.is_within


def test_a_notch_in_one_face_is_simplified_with_a_word_and_a_warning() -> None:
    """Arms 3.5 mm high with right-circular notches of radius 3 mm from outside alone."""
    pytest.importorskip("ngsolve")
    outer: list[Piece] = [(0, 0, 0), (13, 0, -1), (19, 0, 0), (41, 0, -1), (47, 0, 0), (60, 0, 0)]
    outer += [(60, 30, 0), (47, 30, -1), (41, 30, 0), (19, 30, -1), (13, 30, 0), (0, 30, 0)]
    window: list[Piece] = [(10, 3.5, 0), (50, 3.5, 0), (50, 26.5, 0), (10, 26.5, 0)]
    result = fx.understand(outline_from([outer, window]), thickness=10e-3, material=AL, hold="x = 0 mm", n=3)
    assert len(result.flexures) == 4
    assert sum("its faces are unlike" in note for note in result.notes) == 4
    assert abs(result.modes[0].difference or 1) < 0.05
    off = [k for k, mode in enumerate(result.modes) if mode.is_within is False]
    assert [own.place for own in result.warnings] == [f"mode {k + 1}" for k in off]
    assert off


def test_arcs_that_are_short_lines_are_notches_all_the_same() -> None:
    """Half circles of 60 lines each: as CAM programs and meshes draw them."""

    def broken(own: Segment) -> list[Segment]:
        points = [(float(x), float(y)) for x, y in own.at(np.linspace(0, 1, 2 if own.is_line else 61))]
        return [Segment(a, b) for a, b in pairwise(points)]

    lines = [own for segment in outline_from(GUIDES["A"]).segments for own in broken(segment)]
    result = fx.understand(outline_of(lines), thickness=10e-3, material=AL, hold="x = 0 mm", with_solid=False)
    assert [own.web for own in result.flexures] == pytest.approx([0.3e-3] * 4, rel=1e-6)
    np.testing.assert_allclose(hz(result.mechanism, 6), WHOLE["A"], rtol=0.015)


@pytest.mark.parametrize("size", [1e-11, 1e-9, 1e-8])
def test_nodes_that_are_off_by_nothing_change_nothing(size: float) -> None:
    """Arms that are thinner than the hinges that end in them: whether lines run along or beside them was round-off."""
    options = {"thickness": 10e-3, "material": AL, "hold": "y = 0 mm", "with_solid": False}
    mechanism = fx.understand(outline_from(bridge(1.0)), **options).mechanism
    random = np.random.default_rng(1)
    nodes = {key: tuple(np.array(at) + size * random.uniform(-1, 1, 3)) for key, at in mechanism.nodes.items()}
    moved = mechanism.replaced({"nodes": {key: tuple(map(float, at)) for key, at in nodes.items()}})
    np.testing.assert_allclose(hz(moved, 8), hz(mechanism, 8), rtol=3e-3)


@pytest.mark.parametrize(
    ("radius", "whole"),
    [
        (0.4, (125.52, 206.39, 396.61, 861.37, 1199.3, 1457.2)),
        (1.0, (144.73, 237.51, 533.72, 989.64, 1391.5, 1670.7)),
    ],
)
def test_hinges_with_fillets_against_the_solid_of_the_same_drawing(radius: float, whole: tuple[float, ...]) -> None:
    """NGSolve, order 3, 354 474 and 166 083 DOFs, known to 0.6 and 1 %."""
    result = fx.understand(
        outline_from(bridge(radius)), thickness=10e-3, material=AL, hold="y = 0 mm", with_solid=False
    )
    assert {own.kind for own in result.flexures} == {"corner_filleted"}
    np.testing.assert_allclose(hz(result.mechanism, 6), whole, rtol=0.025)


def test_drawings_of_very_many_lines_are_refused() -> None:
    angles = np.linspace(0, 2 * np.pi, 6001)[:-1]
    corners = [(0.05 * float(np.cos(t)), 0.05 * float(np.sin(t))) for t in angles]
    disc = outline_of(Segment(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True))
    with pytest.raises(fx.OptionError, match="draw arcs as arcs"):
        fx.understand(disc, thickness=10e-3, material=AL, hold="x = 0 mm")


def test_a_leaf_that_tapers_has_two_thicknesses() -> None:
    sides: list[Piece] = [
        (0, 0, 0),
        (8, 0, 0),
        (8, 2, 0),
        (28, 2.2, 0),
        (28, 0, 0),
        (36, 0, 0),
        (36, 10, 0),
        (28, 10, 0),
    ]
    sides += [(28, 2.6, 0), (8, 2.8, 0), (8, 10, 0), (0, 10, 0)]
    result = fx.understand(outline_from([sides]), thickness=12e-3, material=AL, hold="x = 0 mm", with_solid=False)
    (own,) = result.flexures
    assert own.kind == "tapered"
    profile = result.mechanism.flexures[own.name].profile
    assert profile.thickness == pytest.approx((0.8e-3, 0.4e-3), rel=1e-3)


def test_ellipses_of_a_drawing_are_elliptical_notches(tmp_path: Path) -> None:
    drawing = ezdxf.new()
    drawing.units = ezdxf.units.MM
    elliptic(drawing)
    drawing.saveas(tmp_path / "part.dxf")
    result = fx.understand(
        tmp_path / "part.dxf", thickness=10e-3, material="Al-7075-T6", hold="x = 0 mm", with_solid=False
    )
    assert [own.kind for own in result.flexures] == ["elliptical"] * 4
    for own in result.flexures:
        assert (own.web, own.length) == pytest.approx((0.4e-3, 8e-3), rel=1e-3)
    assert [own.kind for own in result.blocks] == ["composite"] * 2
    assert any("arcs at most 1e-05" in note for note in result.notes)
    # the same as one solid, NGSolve, order 3, 247 809 DOFs, known to 0.3 %
    np.testing.assert_allclose(hz(result.mechanism, 4), (111.47, 806.17, 1796.2, 4998.4), rtol=0.015)


@pytest.mark.parametrize(
    ("hold", "options", "found"),
    [
        ("x = 0", {}, None),
        ("x = 1 mm", {}, "nothing of the part lies on x = 1 mm"),
        ("x = 3 kg", {}, "a length with its unit"),
        ("x = three", {}, "is not a number"),
        ("bolts", {}, "neither a plane, as 'x = 0 mm', nor a layer"),
        ("x = 0 mm", {"thickness": 0.0}, "thickness is a positive length"),
        ("x = 0 mm", {"thickness": math.nan}, "thickness is a positive length"),
        ("x = 0 mm", {"material": "Al-7075"}, "did you mean 'Al-7075-T6'"),
        ("x = 0 mm", {"material": "E: 3 GPa, nu: 0.3"}, "rho: required, but missing"),
        ("x = 0 mm", {"material": "E: 3 GPa, nu: 0.3, rho: 1 m"}, "rho"),
        ("x = 0 mm", {"material": "E: 3 GPa}, x: {y: 1"}, "a material is its constants"),
    ],
)
def test_what_is_asked_for_and_is_not_there_is_refused(
    tmp_path: Path, hold: str, options: dict[str, object], found: str | None
) -> None:
    given: dict[str, object] = {"thickness": 12e-3, "material": AL, "with_solid": False, **options}
    path = drawn(GUIDES["B"], "lines", tmp_path)
    if found is None:
        assert fx.understand(path, hold=hold, **given).flexures
        return
    with pytest.raises(fx.OptionError, match=found):
        fx.understand(path, hold=hold, **given)


def test_what_is_no_flexure_mechanism_is_refused(tmp_path: Path) -> None:
    plate = [[(0.0, 0.0, 0.0), (40.0, 0.0, 0.0), (40.0, 30.0, 0.0), (0.0, 30.0, 0.0)]]
    with pytest.raises(fx.OptionError, match="no flexure was recognised"):
        fx.understand(outline_from(plate), thickness=1e-2, material=AL, hold="x = 0 mm")
    with pytest.raises(fx.OptionError, match=r"a drawing is named \.dxf or \.svg"):
        fx.understand(tmp_path / "part.step", thickness=1e-2, material=AL, hold="x = 0 mm")


def test_a_layer_is_held_where_its_lines_are_on_one_line(tmp_path: Path) -> None:
    outline = read_dxf(drawn(GUIDES["B"], "lines", tmp_path))
    named = [replace(own, layer="wall" if own.start[0] == own.end[0] == 0 else "x") for own in outline.segments]
    one, other = (
        fx.understand(outline_of(named), thickness=12e-3, material=AL, hold=hold, with_solid=False)
        for hold in ("wall", "x = 0 mm")
    )
    np.testing.assert_allclose(hz(one.mechanism, 3), hz(other.mechanism, 3), rtol=1e-9)
    with pytest.raises(fx.OptionError, match="lines on one line"):
        fx.understand(outline_of(named), thickness=12e-3, material=AL, hold="x", with_solid=False)
