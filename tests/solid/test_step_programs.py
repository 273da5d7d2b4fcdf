"""STEP files of other programs, in other units and of assemblies: they are read as the same parts.

The frame with notches is that of `test_cad_parts`, solved by NGSolve directly, known to 0.2 % and from above. The free
plate by NGSolve with curved tetrahedra of order 6 on a mesh of its own (228 087 DOFs, aluminium 6061: E 68.9 GPa, nu
0.33, rho 2700 kg/m^3), from above, by about 0.02 %, by which order 5 is off that. Bars are beams (Timoshenko and
Goodier 1970).
"""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.errors import OptionError
from flexura.mechanism import Interface
from helpers.shell import flexura
from helpers.step_files import METAL, bar

occ = pytest.importorskip("netgen.occ")

DATA = Path(__file__).parent / "data"
NOTCHES = [115.04, 1035.4, 2280.5, 6388.0, 6430.0, 6536.0]
PLATE = [52.2322, 60.8172, 102.8483, 123.5569, 152.8156, 211.0265]

NO_CONTRACTION = "E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3"
FIRST = 1.8751**2 / (2 * np.pi) * np.sqrt(71.7e9 / 2810) / 60e-3**2 * np.array([4e-3, 6e-3]) / np.sqrt(12)
"""Of a clamped bar 60 x 6 x 4 mm after Euler and Bernoulli, Hz; shear and rotary inertia take 0.2 and 0.5 %."""


def first_two(path: Path) -> np.ndarray:
    """Of a bar that is clamped at x = 0."""
    return fx.modes(
        fx.part_model(path, material=NO_CONTRACTION, hold="plane x = 0 mm", mesh_tolerance=0.05), n=2
    ).frequency_hz


def proven(result: fx.Modes, known: list[float], least: float) -> None:
    """The known numbers, from above but for `least`, lie where the result says, and it within its own proof."""
    elastic = [k for k, mode in enumerate(result.modes) if not mode.is_rigid]
    assert len(elastic) == len(known)
    for k, hz in zip(elastic, known, strict=True):
        mode, margin = result.modes[k], result.model_error[k]
        assert margin is not None and mode.interval_hz[0] <= mode.full_frequency_hz <= mode.interval_hz[1]
        low, high = margin
        assert mode.frequency_hz * (1 + low) <= hz <= mode.frequency_hz * (1 + high + least)


def test_a_frame_by_gmsh():
    path = DATA / "frame_by_gmsh.step"
    model = fx.part_model(
        path, material=METAL, hold="plane x = 0 mm", interface="table: plane x = 60 mm", mesh_tolerance=0.03
    )
    result = fx.modes(model)
    proven(result, NOTCHES, 2e-3)
    assert result.frequency_hz == pytest.approx(NOTCHES, rel=5e-3)


def test_a_bar_that_flexura_has_written(tmp_path):
    text = """
nodes: {foot: [0, 3 mm, 2 mm], head: [60 mm, 3 mm, 2 mm]}
links:
  bar:
    nodes: [foot, head]
    material: Al-7075-T6
    reference: y
    section: {shape: rectangle, width: 4 mm, thickness: 6 mm}
ground: {foot: clamped}
"""
    own = tmp_path / "own.step"
    fx.solid.write_step(fx.assemble(fx.loads(text)), own)
    assert fx.faces(own).box == pytest.approx(np.array([[0, 0, 0], [60e-3, 6e-3, 4e-3]]), abs=1e-8)
    found = first_two(own)
    assert found / FIRST - 1 == pytest.approx([-0.002, -0.005], abs=2e-3)
    assert found == pytest.approx(first_two(bar(tmp_path / "bar.step")), rel=2e-4)


MILLIMETRE = "SI_UNIT(.MILLI.,.METRE.)"
INCH = """#9000 = ( CONVERSION_BASED_UNIT('INCH',#9001) LENGTH_UNIT() NAMED_UNIT(#9002) );
#9001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#9003);
#9002 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
#9003 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );
"""


def in_unit(path: Path, unit: str) -> Path:
    """The bar, drawn in a unit."""
    size = {"mm": 1.0, "m": 1e3, "inch": 25.4}[unit]
    occ.Box((0, 0, 0), (60 / size, 6 / size, 4 / size)).WriteStep(str(path))
    text = path.read_text()
    assert text.count(MILLIMETRE) == 1
    if unit == "m":
        text = text.replace(MILLIMETRE, "SI_UNIT($,.METRE.)")
    if unit == "inch":
        (own,) = [line.split(" = ")[0] for line in text.splitlines() if MILLIMETRE in line]
        lines = [line for line in text.splitlines(keepends=True) if MILLIMETRE not in line]
        text = (
            "".join(lines).replace(f"{own},#", "#9000,#").replace(f",{own},", ",#9000,").replace(f"({own},", "(#9000,")
        )
        text = text.replace("ENDSEC;\nEND-ISO", f"{INCH}ENDSEC;\nEND-ISO")
    path.write_text(text)
    return path


@pytest.mark.parametrize("unit", ["m", "inch"])
def test_a_bar_in_another_unit_is_the_same(tmp_path, unit):
    one, other = in_unit(tmp_path / "mm.step", "mm"), in_unit(tmp_path / "other.step", unit)
    drawn, again = fx.faces(one), fx.faces(other)
    assert again.box == pytest.approx(drawn.box, abs=1e-9)
    assert [face.form for face in again.faces] == [face.form for face in drawn.faces]
    assert [face.area for face in again.faces] == pytest.approx([face.area for face in drawn.faces], rel=1e-9)
    assert len(again.chosen(Interface(x=60e-3))) == 1
    assert first_two(other) == pytest.approx(first_two(one), rel=2e-4)


def test_a_plate_by_solidworks():
    """In inches, with a suffix in capitals, and faces of which each is called NONE."""
    path = DATA / "plate_by_solidworks.STEP"
    drawing = fx.faces(path)
    assert drawing.solids == ("CirPattern1",) and len(drawing.faces) == 30
    assert {face.name for face in drawing.faces} == {""} and {face.colour for face in drawing.faces} == {"#97a3da"}
    inch = 25.4e-3
    assert np.ptp(drawing.box[:, 2]) == pytest.approx(0.1875 * inch, abs=1e-8)
    radii = sorted(face.radius / inch for face in drawing.faces if face.radius and face.radius < 0.1)
    assert radii == pytest.approx([0.13] * 8 + [0.25] * 4 + [0.5] * 4 + [3.0] * 2, rel=1e-6)
    holes = drawing.chosen(Interface(radius=0.13 * inch))
    assert len(holes) == 8


@pytest.fixture(scope="module")
def free_plate():
    """It with its eight holes as one interface, free."""
    path = DATA / "plate_by_solidworks.STEP"
    model = fx.part_model(path, material="Al-6061-T6", interface="feet: radius 3.302 mm", mesh_tolerance=0.05)
    return fx.modes(model, n=12)


def test_a_free_plate_by_solidworks_vibrates_as_an_independent_mesh_says(free_plate):
    assert [mode.is_rigid for mode in free_plate.modes] == [True] * 6 + [False] * 6
    assert free_plate.frequency_hz[6:] == pytest.approx(PLATE, rel=1e-3)
    for mode in free_plate.modes[6:]:
        assert mode.interval_hz[0] <= mode.full_frequency_hz <= mode.interval_hz[1]


def test_margins_of_the_mesh_hold_for_a_free_plate(free_plate):
    proven(free_plate, PLATE, 2e-4)


ASSEMBLY = """#{0} = PRODUCT('pair','pair','',(#8));
#{1} = PRODUCT_DEFINITION_FORMATION('','',#{0});
#{2} = PRODUCT_DEFINITION('design','',#{1},#9);
#{3} = PRODUCT_DEFINITION_SHAPE('','',#{2});
#{4} = SHAPE_REPRESENTATION('',(#11,#{6}),#{context});
#{5} = SHAPE_DEFINITION_REPRESENTATION(#{3},#{4});
#{6} = AXIS2_PLACEMENT_3D('',#{7},#13,#14);
#{7} = CARTESIAN_POINT('',(30.,0.,0.));
"""
INSTANCE = """#{0} = NEXT_ASSEMBLY_USAGE_OCCURRENCE('{0}','{name}','',#9502,#5,$);
#{1} = PRODUCT_DEFINITION_SHAPE('','',#{0});
#{2} = ( REPRESENTATION_RELATIONSHIP('','',#10,#9504)
REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{3}) SHAPE_REPRESENTATION_RELATIONSHIP() );
#{3} = ITEM_DEFINED_TRANSFORMATION('','',#11,{place});
#{4} = CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{2},#{1});
"""


def test_two_instances_of_a_solid_are_one_part(tmp_path):
    """An assembly of a bar of 30 mm that is placed twice, end to end, is the bar of 60 mm."""
    half = bar(tmp_path / "half.step", 30.0)
    text = half.read_text()
    context = text.split("ADVANCED_BREP_SHAPE_REPRESENTATION('',(#11,#15),#")[1].split(")")[0]
    more = ASSEMBLY.format(*range(9500, 9508), context=context)
    more += INSTANCE.format(*range(9510, 9515), name="first", place="#11")
    more += INSTANCE.format(*range(9520, 9525), name="second", place="#9506")
    pair = tmp_path / "pair.step"
    pair.write_text(text.replace("ENDSEC;\nEND-ISO", f"{more}ENDSEC;\nEND-ISO"))
    drawing = fx.faces(pair)
    assert len(set(drawing.solids)) == 2 and np.ptp(drawing.box, axis=0) == pytest.approx([60e-3, 6e-3, 4e-3], abs=1e-8)
    assert first_two(pair) == pytest.approx(first_two(bar(tmp_path / "bar.step")), rel=5e-4)


def test_loose_faces_are_sewn_without_a_word_on_stdout(tmp_path):
    """The healing of the kernel prints; a document has nothing beside it."""
    sides = list(occ.Box((0, 0, 0), (10, 10, 10)).faces)
    occ.Compound(sides).WriteStep(str(tmp_path / "six.step"))
    done = flexura("faces", tmp_path / "six.step", "--json")
    assert done.stdout.startswith("{") and done.stdout.endswith("}\n")
    assert fx.faces(tmp_path / "six.step").notes == ("6 loose faces sewn to 1 solid",)
    occ.Compound(sides[:5]).WriteStep(str(tmp_path / "five.step"))
    with pytest.raises(OptionError, match="it has 5 faces and no solid"):
        fx.faces(tmp_path / "five.step")


def test_files_that_are_too_large_are_not_read(tmp_path):
    file = tmp_path / "large.step"
    with file.open("wb") as stream:
        stream.truncate(200_000_000)
    with pytest.raises(OptionError, match="at most 100 000 000 bytes"):
        fx.faces(file)
