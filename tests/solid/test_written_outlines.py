"""Planar parts whose outlines stand in the mechanism file, against drawings of the same, and what is refused.

The frame with notches is that of `test_cad_parts`, solved by NGSolve directly, known to 0.2 % and from above.
"""

import math

import numpy as np
import pytest

import flexura as fx
from flexura.errors import ModelError
from flexura.fem.figures import outlined
from flexura.full_order import assemble
from helpers.step_files import METAL

pytest.importorskip("netgen.occ")

RHO = 2810.0
NOTCHES = [115.04, 1035.4, 2280.5, 6388.0, 6430.0, 6536.0]

FRAME = f"""
name: frame
parts:
  frame:
    outline:
      - {{to: [0, 0], name: base}}
      - [13 mm, 0]
      - {{to: [19 mm, 0], through: [16 mm, 3 mm]}}
      - [41 mm, 0]
      - {{to: [47 mm, 0], radius: -3 mm}}
      - [60 mm, 0]
      - {{to: [60 mm, 40 mm], name: table}}
      - [47 mm, 40 mm]
      - {{to: [41 mm, 40 mm], radius: -3 mm}}
      - [19 mm, 40 mm]
      - {{to: [13 mm, 40 mm], radius: -3 mm}}
      - [0, 40 mm]
    holes:
      - outline:
        - [10 mm, 6.3 mm]
        - [13 mm, 6.3 mm]
        - {{to: [19 mm, 6.3 mm], radius: 3 mm}}
        - [41 mm, 6.3 mm]
        - {{to: [47 mm, 6.3 mm], radius: 3 mm}}
        - [50 mm, 6.3 mm]
        - [50 mm, 33.7 mm]
        - [47 mm, 33.7 mm]
        - {{to: [41 mm, 33.7 mm], through: [44 mm, 36.7 mm]}}
        - [19 mm, 33.7 mm]
        - {{to: [13 mm, 33.7 mm], radius: 3 mm}}
        - [10 mm, 33.7 mm]
    thickness: 10 mm
    material: {METAL}
    mesh_tolerance: 0.03
    interfaces: {{base: {{face: base}}, table: {{face: table}}}}
ground: {{frame.base: clamped}}
"""


def drawn_frame(path):
    """The same as a DXF drawing, by bulges."""
    import ezdxf

    drawing = ezdxf.new(units=ezdxf.units.MM)
    space = drawing.modelspace()
    x = [0, 13, 19, 41, 47, 60]
    outer = [(a, 0, -(k in (1, 3))) for k, a in enumerate(x)] + [(a, 40, -(k in (1, 3))) for k, a in enumerate(x[::-1])]
    for k, (a, b) in enumerate(zip(outer, outer[1:] + outer[:1], strict=True)):
        layer = {5: "table", 11: "base"}.get(k, "0")
        space.add_lwpolyline([a, (*b[:2], 0)], format="xyb", dxfattribs={"layer": layer})
    x = [10, 13, 19, 41, 47, 50]
    inner = [(a, 6.3, k in (1, 3)) for k, a in enumerate(x)] + [(a, 33.7, k in (1, 3)) for k, a in enumerate(x[::-1])]
    space.add_lwpolyline(inner, format="xyb", close=True)
    drawing.saveas(path)
    return path


def test_a_frame_with_notches_by_its_outline_and_by_a_drawing(tmp_path):
    written = fx.loads(FRAME)
    result = fx.modes(written)
    off = result.frequency_hz / NOTCHES - 1
    assert (np.abs(off) < 1e-2).all()
    for mode, difference, (low, _) in zip(result.modes, off, result.model_error, strict=True):
        assert difference <= -low + 2e-3
        assert mode.interval_hz[0] <= mode.full_frequency_hz <= mode.interval_hz[1]
    area = 60 * 40 - 40 * 27.4 - 8 * math.pi * 9 / 2
    assert fx.check(written).mass.mass == pytest.approx(RHO * 1e-2 * area * 1e-6, rel=1e-5)
    dxf = drawn_frame(tmp_path / "frame.dxf")
    names = {"base": {"face": "base"}, "table": {"face": "table"}}
    part = {"drawing": str(dxf), "thickness": 10e-3, "material": METAL, "mesh_tolerance": 0.03, "interfaces": names}
    drawn = fx.Mechanism(name="frame", parts={"frame": part}, ground={"frame.base": "clamped"})
    assert fx.modes(drawn).frequency_hz == pytest.approx(result.frequency_hz, rel=1e-9)


def test_it_is_saved_as_it_was_read(tmp_path):
    mechanism = fx.loads(FRAME)
    fx.save(mechanism, tmp_path / "frame.yaml")
    assert fx.load(tmp_path / "frame.yaml") == mechanism


PLATE = """
name: plate
parameters: {{edge: 20 mm}}
parts:
  plate:
    outline: {outline}
    {more}
    thickness: 4 mm
    material: Al-7075-T6
    mesh_tolerance: 0.05
    interfaces: {{foot: {{x: 0 mm}}, head: {head}}}
ground: {{plate.foot: clamped}}
"""
SQUARE = "[[0, 0], [20 mm, 0], [20 mm, 20 mm], [0, 20 mm]]"


def plate(outline: str = SQUARE, more: str = "", head: str = "{face: tip}") -> fx.Mechanism:
    return fx.loads(PLATE.format(outline=outline, more=more, head=head))


def mass_of(mechanism: fx.Mechanism) -> float:
    return fx.check(mechanism).mass.mass


def test_an_offset_names_and_round_holes():
    """A quarter disc of radius 19.5 mm with a bore, and a square drawn 1 mm too small on all sides."""
    outline = "[[0, 0], [19.5 mm, 0], {to: [0, 19.5 mm], radius: 19.5 mm, name: tip}]"
    more = "holes: [{centre: [6 mm, 6 mm], diameter: 5 mm, name: bore}]"
    hole = math.pi * 2.5**2
    found = mass_of(plate(outline, more))
    assert found == pytest.approx(RHO * 4e-3 * (math.pi / 4 * 19.5**2 - hole) * 1e-6, rel=1e-5)
    model = assemble(fx.with_solid_parts(plate(outline, more, "{face: bore}")))
    at = model.positions[model.plan.topology.node_names.index("plate.head")]
    assert at == pytest.approx([6e-3, 6e-3, 2e-3], abs=1e-9)
    larger = "[[1 mm, 1 mm], {to: [20 mm, 1 mm]}, {to: [20 mm, 20 mm], name: tip}, [1 mm, 20 mm]]"
    assert mass_of(plate(larger, "offset: 1 mm")) == pytest.approx(RHO * 4e-3 * 21e-3**2, rel=1e-6)


@pytest.mark.parametrize(
    ("outline", "more", "place", "rule"),
    [
        ("[[0, 0], [20 mm, 20 mm], [20 mm, 0], [0, 20 mm]]", "", "outline", r"touch itself \(found \(10, 10\)"),
        ("[[0, 0], [20 mm, 0]]", "", "outline", "encloses an area"),
        ("[[0, 0], [20 mm, 0], [20 mm, 0], [0, 20 mm]]", "", "outline.2", "a side has a length"),
        ("[[0, 0], [20 mm, 0], {to: [0, 20 mm], radius: 9 mm}]", "", "outline.2.radius", "does not reach over 28.28"),
        ("[[0, 0], [edge, 0], [20 mm, 20 mm]]", "", "outline.1.0", "edge has no minimum and maximum"),
        ("[[0, 0], [20 m, 0], [20 m, 20 m]]", "", "outline", "to 3 m long"),
        (SQUARE, "holes: [{centre: [30 mm, 5 mm], diameter: 1 mm}]", "outline", r"around all others \(found \(30, 5\)"),
        (SQUARE, "holes: [{centre: [20 mm, 5 mm], diameter: 1 mm}]", "outline", "do not touch or cross each other"),
        (SQUARE, "holes: [{outline: [[1 mm, 1 mm], [1 mm, 1 mm], [2 mm, 2 mm]]}]", "holes.0.outline.1", "has a length"),
        (SQUARE, "offset: -10 mm", "outline", "vanishes in the offset"),
    ],
)  # fmt: skip
def test_outlines_that_are_none_are_refused_with_their_place(outline, more, place, rule):
    with pytest.raises(ModelError, match=rule) as refused:
        fx.with_solid_parts(plate(outline, more, "{x: 20 mm}"))
    assert ".".join(map(str, refused.value.problems[0].path)) == f"parts.plate.{place}"


@pytest.mark.parametrize(
    ("outline", "more", "rule"),
    [
        ("[[0, 0], [20 mm, 0], {to: [0, 20 mm], through: [9 mm, 9 mm], radius: 9 mm}]", "", "either a point"),
        ("[[0, 0], [20 mm, 0], {too: [0, 20 mm]}]", "", "did you mean to"),
        ("[[0, 0], [20 mm, 0], [20 mm]]", "", "a list of 2 entries"),
        ("[[0, 0]]", "", "at least 2 entries"),
        (SQUARE, "step: plate.step", "a part has one of these"),
        (SQUARE, "holes: [{dia: 2 mm}]", "unknown key"),
    ],
)
def test_what_cannot_be_read_is_refused_at_its_line(outline, more, rule):
    with pytest.raises(ModelError, match=rule):
        plate(outline, more)


def test_holes_belong_to_an_outline():
    part = {"step": "a.step", "material": METAL, "interfaces": {"a": {"x": 0.0}}}
    with pytest.raises(ModelError, match="holes are those of an outline"):
        fx.describe.SolidPart(**part, holes=({"centre": (0.0, 0.0), "diameter": 1e-3},))


def test_edges_of_flat_springs_may_have_radii_and_no_names():
    """The circle through three points of it has the radius that is written."""
    spring = {"material": METAL, "reference": "x", "thickness": 1e-4, "pads": {"a": {"edges": [1]}}}
    side = fx.describe.Side
    for radius, above in ((5e-3, -1.0), (-5e-3, 1.0)):
        described = fx.describe.FlatSpring(**spring, outline=((0, 0), side(to=(8e-3, 0), radius=radius), (4e-3, -9e-3)))
        (start, middle, end) = outlined(described).outline[0].points
        # its height over a chord of 8 mm is 5 - 3 mm
        assert middle == pytest.approx((4e-3, above * 2e-3)) and (start, end) == ((0, 0), (8e-3, 0))
    with pytest.raises(ModelError, match="does not reach over 8 mm"):
        wrong = fx.describe.FlatSpring(**spring, outline=((0, 0), side(to=(8e-3, 0), radius=3e-3), (4e-3, -9e-3)))
        fx.modes(fx.Mechanism(nodes={"a": (0, 0, 0)}, flat_springs={"spring": wrong}, ground={"a": "clamped"}))
    with pytest.raises(ModelError, match="have numbers"):
        fx.describe.FlatSpring(**spring, outline=((0, 0), side(to=(8e-3, 0), name="tip"), (4e-3, -9e-3)))
