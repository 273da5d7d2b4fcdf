"""Drawings that are read: areas and places by closed forms, what is healed, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flexura as fx
from flexura.outlines import Outline, Segment, outline_of, read_dxf, read_svg
from helpers.monoliths import GUIDES, drawn

ezdxf = pytest.importorskip("ezdxf")
pytest.importorskip("shapely")

SQUARE = [(0, 0), (40, 0), (40, 30), (0, 30)]


def lines(points: list[tuple[float, float]]) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    return list(zip(points, [*points[1:], points[0]], strict=True))


def dxf(path: Path, draw: Callable[[Any, Any], object], units: int = 4, **header: int) -> Path:
    document = ezdxf.new()
    document.header["$INSUNITS"] = units
    for name, value in header.items():
        document.header[f"${name}"] = value
    draw(document.modelspace(), document)
    document.saveas(path / "part.dxf")
    return path / "part.dxf"


def square(space: Any, _: Any, points: list[tuple[float, float]] = SQUARE, **attributes: Any) -> None:
    for a, b in lines(points):
        space.add_line(a, b, dxfattribs=attributes)


@pytest.mark.parametrize("kind", ["lines", "polyline", "svg"])
@pytest.mark.parametrize("guide", ["A", "B"])
def test_drawings_of_guides_have_their_areas(tmp_path: Path, guide: str, kind: str) -> None:
    """Each of the notches takes two half circles of radius 3; blocks, leaves and the window are rectangles."""
    window, notches = (40 * 27.4, 8 * math.pi * 9 / 2) if guide == "A" else (0.0, 0.0)
    area = 60 * 40 - window - notches if guide == "A" else 2 * 8 * 30 + 2 * 20 * 0.5
    read = read_svg if kind == "svg" else read_dxf
    outline = read(drawn(GUIDES[guide], kind, tmp_path))
    assert outline.area == pytest.approx(area * 1e-6, rel=1e-9)
    assert outline.outer.area > 0 > outline.holes[0].area
    np.testing.assert_allclose(np.ptp(outline.box, axis=0), [0.06, 0.04] if guide == "A" else [0.036, 0.03])


@pytest.mark.parametrize(("units", "metre"), [(1, 0.0254), (4, 1e-3), (5, 1e-2), (13, 1e-6)])
def test_units_are_those_of_the_file(tmp_path: Path, units: int, metre: float) -> None:
    path = dxf(tmp_path, square, units)
    if metre == 1e-6:
        with pytest.raises(fx.ModelError, match=r"a part is from 0\.2 mm to 3 m long"):
            read_dxf(path)
        return
    np.testing.assert_allclose(read_dxf(path).box[1], [40 * metre, 30 * metre])


def test_a_drawing_without_a_unit_is_mm_where_it_is_metric_and_refused_otherwise(tmp_path: Path) -> None:
    metric = read_dxf(dxf(tmp_path, square, 0, MEASUREMENT=1))
    assert metric.size == pytest.approx(0.04)
    assert "mm" in metric.notes[0]
    path = dxf(tmp_path, square, 0, MEASUREMENT=0)
    with pytest.raises(fx.OptionError, match="has no unit"):
        read_dxf(path)
    assert read_dxf(path, units="in").size == pytest.approx(40 * 0.0254)
    with pytest.raises(fx.OptionError, match="units of a drawing are one of mm"):
        read_dxf(path, units="furlong")


def test_a_stage_of_60_m_is_refused(tmp_path: Path) -> None:
    with pytest.raises(fx.ModelError, match=r"60 m.*\n.*units of the drawing") as caught:
        read_dxf(dxf(tmp_path, lambda space, d: square(space, d, [(0, 0), (60, 0), (60, 9), (0, 9)]), 6))
    assert caught.value.problems[0].value == "60 m"


def test_curves_and_blocks_are_written_out(tmp_path: Path) -> None:
    """A plate of four by two copies of a block that is mirrored, with an ellipse and a closed spline as holes."""

    def draw(space: Any, document: Any) -> None:
        square(space, document, layer="base")
        block = document.blocks.new("hole")
        block.add_circle((0, 0), 1)
        block.add_text("hole")
        space.add_blockref("hole", (5, 5), {"xscale": -1, "layer": "bolts"}).grid((2, 2), (20, 30))
        space.add_ellipse((20, 22), (6, 0), 0.5)
        angles = np.linspace(0, 2 * math.pi, 25)
        space.add_spline_control_frame([(10 + 3 * math.cos(a), 17 + 3 * math.sin(a)) for a in angles])
        space.add_point((3, 3))

    outline = read_dxf(dxf(tmp_path, draw))
    assert [round(loop.area * 1e6, 3) for loop in outline.holes][:1] == [round(-math.pi * 18, 3)]
    assert sum(loop.circle is not None and abs(loop.circle[1] - 1e-3) < 1e-12 for loop in outline.holes) == 4
    assert outline.holes[1].area == pytest.approx(-math.pi * 9e-6, rel=0.01)
    assert {"base", "bolts"} <= set(outline.layers)
    assert any("1 POINT, 4 TEXT" in note for note in outline.notes)
    assert any("1e-05" in note for note in outline.notes)


def test_mirrored_arcs_and_bulges_turn_the_other_way(tmp_path: Path) -> None:
    def draw(space: Any, document: Any) -> None:
        block = document.blocks.new("d")
        block.add_lwpolyline([(0, 0, 0), (10, 0, 0.5), (10, 10, 0), (0, 10, 0)], format="xyb", close=True)
        space.add_blockref("d", (0, 0), {"xscale": -1})

    theta = 4 * math.atan(0.5)
    r = 10 / (2 * math.sin(theta / 2))
    outline = read_dxf(dxf(tmp_path, draw))
    assert outline.area == pytest.approx((100 + r * r * (theta - math.sin(theta)) / 2) * 1e-6)
    np.testing.assert_allclose(outline.box[0, 0], -12.5e-3)


def test_layers_are_chosen_or_off(tmp_path: Path) -> None:
    def draw(space: Any, document: Any) -> None:
        square(space, document, layer="part")
        document.layers.add("frame").off()
        square(space, document, [(-9, -9), (90, -9), (90, 90), (-9, 90)], layer="frame")

    path = dxf(tmp_path, draw)
    assert read_dxf(path).size == read_dxf(path, layers=["part"]).size == pytest.approx(0.04)
    with pytest.raises(fx.OptionError, match="did you mean 'part'"):
        read_dxf(path, layers=["parts"])


def test_gaps_copies_and_points_are_healed_with_a_word(tmp_path: Path) -> None:
    def draw(space: Any, document: Any) -> None:
        square(space, document, [(0, 0), (40, 0), (40, 30), (0, 30)])
        space.add_line((40, 30), (40, 0))
        space.add_line((3, 3), (3, 3))

    outline = read_dxf(dxf(tmp_path, draw))
    assert outline.area == pytest.approx(1200e-6)
    assert sorted(outline.notes) == [
        "1 segment drawn twice left out, the first at (40, 15) mm",
        "1 segment without length left out, the first at (3, 3) mm",
    ]
    pieces = [Segment(a, b) for a, b in lines([(0, 0), (0.04, 0), (0.04, 0.03), (0, 0.03)])]
    pieces[2] = Segment((0.04, 0.030002), (0, 0.03))
    assert outline_of(pieces).notes == ("1 gap closed, the widest of 2 µm at (40, 30) mm",)


def bad(*more: Segment, without: int = -1) -> list[Segment]:
    pieces = [Segment(a, b) for a, b in lines([(0, 0), (0.04, 0), (0.04, 0.03), (0, 0.03)])]
    return [own for k, own in enumerate(pieces) if k != without] + list(more)


def ring(*points: tuple[float, float]) -> list[Segment]:
    return [Segment(a, b) for a, b in lines([(x * 1e-3, y * 1e-3) for x, y in points])]


@pytest.mark.parametrize(
    ("segments", "found"),
    [
        ([], "a drawing has lines or arcs"),
        ([Segment((0.001, 0.002), (0.001, 0.002))], r"lines and arcs have a length \(found \(1, 2\) mm\)"),
        (bad(without=1), r"a gap of 30 mm at \(40, (0|30)\) mm"),
        (
            bad(Segment((0, 0), (0.04, 0.03))),
            r"two segments end at each point of a loop \(found 3 at \((0, 0|40, 30)\)",
        ),
        (ring((0, 0), (40, 30), (40, 0), (0, 30)), r"does not cross or touch itself \(found \(20, 15\) mm"),
        (ring((0, 0), (40, 0), (0, 0.0001)), "a loop encloses an area"),
        (bad(*ring((50, 0), (60, 0), (60, 9))), r"one loop is around all others \(found \(5[67]"),
        (bad(*ring((30, 5), (60, 5), (60, 9), (30, 9))), r"loops do not touch or cross each other \(found \(40, 7\)"),
        (bad(*ring((5, 5), (20, 5), (20, 20), (5, 20)), *ring((8, 8), (9, 8), (9, 9))), "a hole has no islands"),
        (bad(*ring((5, 5), (20, 5), (20, 20), (5, 20)), *ring((10, 8), (30, 8), (30, 9))), "holes do not touch"),
        (bad(Segment((0, 0), (math.inf, 1))), "coordinates are finite"),
    ],
)
def test_what_is_no_outline_is_refused_with_its_place(segments: list[Segment], found: str) -> None:
    with pytest.raises(fx.ModelError, match=found):
        outline_of(segments)


def test_what_is_no_dxf_or_svg_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "part.dxf"
    for content in (b"", b"no drawing", b"0\nSECTION\n2\nENTITIES\n0\nLINE\n10\nx\n", bytes(range(256)) * 9):
        path.write_bytes(content)
        with pytest.raises(fx.FlexuraError):
            read_dxf(path)
    svg = tmp_path / "part.svg"
    for text, found in [
        ("<svg", "no SVG file"),
        ("<html/>", "its root is <html>"),
        ('<!DOCTYPE s [<!ENTITY a "b">]><svg>&a;</svg>', "defines entities"),
        ('<svg><path d="M 0 0 L 1"/></svg>', "numbers are missing behind 'L'"),
        ('<svg><path d="M 0 0 X 1"/></svg>', "no path command: 'X'"),
        ('<svg><rect width="3 furlong"/></svg>', "no length"),
        ('<svg><g transform="turn(3)"/></svg>', "no transform: turn"),
        ("<svg/>", "a drawing has lines or arcs"),
    ]:
        svg.write_text(text)
        with pytest.raises(fx.FlexuraError, match=found):
            read_svg(svg)
    with pytest.raises(fx.OptionError, match="does not exist"):
        read_dxf(tmp_path / "none.dxf")
    with fx.size_limits(drawing_segments=3), pytest.raises(fx.ModelError, match="at most 3 lines and arcs"):
        read_dxf(dxf(tmp_path, square))


def test_a_block_that_holds_itself_is_refused(tmp_path: Path) -> None:
    def draw(space: Any, document: Any) -> None:
        block = document.blocks.new("a")
        block.add_line((0, 0), (1, 0))
        block.add_blockref("a", (1, 1))
        space.add_blockref("a", (0, 0))

    with pytest.raises(fx.ModelError, match="blocks are within blocks at most 20 deep"):
        read_dxf(dxf(tmp_path, draw))


def test_svg_paths_shapes_and_transforms(tmp_path: Path) -> None:
    """A plate with a rounded slot, a turned ellipse, a circle by arcs, and what is between two parabolas."""
    path = tmp_path / "part.svg"
    path.write_text(
        """<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="60mm" viewBox="0 0 40 30">
        <g transform="scale(0.5) translate(0 30)"><title>plate</title>
        <path id="plate" d="m0 0h80v-30 -30H0z" transform="translate(0,30)"/>
        <rect x="4" y="-20" width="10" height="4" rx="1"/>
        <ellipse rx="6" ry="3" transform="translate(30 0) rotate(30)"/>
        <path d="M 50,0 a 4 4 0 0 1 8,0 A 4,4 0 1 1 50 0 Z"/>
        <path d="M60-10q5 5 10 0t-1e1 0"/>
        <text>no part</text></g></svg>""".replace("t-1e1 0", "Q 65 -15 60 -10")
    )
    outline = read_svg(path)
    np.testing.assert_allclose(outline.box, [[0, -0.06], [0.08, 0]], atol=1e-12)
    areas = sorted(-loop.area * 1e6 for loop in outline.holes)
    known = sorted([40 - (4 - math.pi), math.pi * 18, math.pi * 16, 2 * 2 / 3 * 10 * 2.5])
    np.testing.assert_allclose(areas, known, rtol=2e-5)
    assert "plate" in outline.layers
    assert outline.notes == ("left out: 1 text",)


def test_offsets_grow_and_shrink_by_exact_lines_and_arcs() -> None:
    slot = [Segment((0, 0), (0.03, 0)), Segment((0.03, 0), (0.03, 0.01), 1.0), Segment((0.03, 0.01), (0, 0.01))]
    outer = outline_of([*slot, Segment((0, 0.01), (0, 0), 1.0)])
    for by in (1e-3, -1e-3):
        r = 0.005 + by
        grown = outer.offset(by)
        assert grown.area == pytest.approx(0.03 * 2 * r + math.pi * r * r, rel=1e-12)
    frame = outline_of([*bad(), *ring((10, 10), (20, 10), (20, 20), (10, 20))])
    assert frame.offset(-1e-3).area == pytest.approx((38 * 28 - 12 * 12) * 1e-6)
    with pytest.raises(fx.ModelError, match="vanishes in the offset"):
        outer.offset(-6e-3)
    with pytest.raises(fx.ModelError, match=r"loops do not touch|one loop is around"):
        frame.offset(-6e-3)


def test_an_offset_corner_between_a_line_and_an_arc_is_where_they_meet() -> None:
    half = Outline(outline_of([Segment((-0.01, 0), (0.01, 0)), Segment((0.01, 0), (-0.01, 0), 1.0)]).loops)
    grown = half.offset(1e-3)
    x = math.sqrt(0.011**2 - 1e-6)
    np.testing.assert_allclose(sorted(own.start[0] for own in grown.segments), [-x, x])
    turned = math.pi + 2 * math.asin(1 / 11)
    assert grown.area == pytest.approx(0.011**2 / 2 * (turned - math.sin(turned)), rel=1e-9)
