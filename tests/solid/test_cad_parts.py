"""Parts from STEP files: what is chosen of them, what they are reduced to, and what is refused.

Bars against Timoshenko's beam and Saint-Venant's torsion (Timoshenko and Goodier 1970: beta = 0.196 at a ratio of
1.5); guides in one piece, E 71.7 GPa, nu 0.33, rho 2810 kg/m^3, one face held, solved by NGSolve directly with curved
tetrahedra of order 4, known to 0.2 % (notches) and from above, up to 0.9 % at sharp corners (leaves).
"""

import json

import numpy as np
import pytest

import flexura as fx
from flexura.errors import ModelError, OptionError
from flexura.fem import cad
from flexura.full_order import assemble
from flexura.mechanism import Interface, with_parts_placed
from helpers.shell import flexura
from helpers.step_files import METAL, bar, leaf_guide, notch_guide, written

occ = pytest.importorskip("netgen.occ")

E, NU, RHO = 71.7e9, 0.33, 2810.0
LEAVES = [290.7, 2222.9, 5250.0, 6513.0, 6558.0, 9483.0]
NOTCHES = [115.04, 1035.4, 2280.5, 6388.0, 6430.0, 6536.0]


def relative(found, known):
    return np.asarray(found) / np.asarray(known) - 1


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """A bar, as a STEP file."""
    return bar(tmp_path_factory.mktemp("bar") / "bar.step")


@pytest.fixture(scope="module")
def held_bar(drawn):
    """The bar of a material that does not contract, so that a rigid end is that of beam theory."""
    material = "E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3"
    return fx.with_solid_parts(fx.part_model(drawn, material=material, hold="base", interface="tip"))


def test_a_bar_bends_and_twists_as_beams_do(held_bar):
    L, b, h = 60e-3, 6e-3, 4e-3
    u = fx.statics(held_bar, loads={"bar.tip": [1.0, 1.0, 1.0, 1e-3, 0.0, 0.0]}).displacement("bar.tip")
    shear = 6 / 5 * L / (E / 2 * b * h)
    along_y = L**3 / 3 / (E * h * b**3 / 12) + shear
    along_z = L**3 / 3 / (E * b * h**3 / 12) + shear
    assert u[:3] == pytest.approx([L / E / b / h, along_y, along_z], rel=2e-3)
    # the held end cannot warp, the other one is pulled at otherwise than Saint-Venant's bar
    twist = 1e-3 * L / (E / 2 * 0.196 * b * h**3)
    assert 0.99 < u[3] / twist < 1.01


def test_a_bar_vibrates_as_a_beam_does(held_bar):
    hz = [mode.frequency_hz for mode in fx.modes(held_bar, n=4).modes]
    first = 1.8751**2 / (2 * np.pi) * np.sqrt(E / RHO) / 60e-3**2 * np.array([4e-3, 6e-3]) / np.sqrt(12)
    # shear and rotary inertia lower them by (1 + E / kG) (pi r / 2 L)^2 and half as much, about
    assert relative(hz[:2], first) == pytest.approx([-0.002, -0.005], abs=2e-3)


def test_modes_beyond_what_a_part_was_reduced_for_are_warned_of(drawn, held_bar):
    """Errors above are those against a part that is reduced for three times the frequency."""
    few = fx.modes(held_bar, n=24)
    (warning,) = [own for own in few.warnings if "has all of its own modes" in str(own)]
    material = "E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3"
    finer = fx.with_solid_parts(
        fx.part_model(drawn, material=material, hold="base", interface="tip", up_to=3 * warning.limit)
    )
    many = fx.modes(finer, n=24)
    off = few.frequency_hz / many.frequency_hz - 1
    assert (np.abs(off[few.frequency_hz < warning.limit]) < 3e-4).all() and off.max() > 1e-3
    assert not any("has all of its own modes" in str(own) for own in many.warnings)


@pytest.mark.parametrize(("part", "known", "most"), [(notch_guide, NOTCHES, 4e-3), (leaf_guide, LEAVES, 4e-3)])
def test_guides_in_one_piece(tmp_path, part, known, most):
    file = part(tmp_path / "stage.step")
    result = fx.modes(fx.part_model(file, material=METAL, hold="base", interface="table"))
    off = relative([mode.frequency_hz for mode in result.modes], known)
    assert (np.abs(off) < most).all()
    intervals = result.model_error
    for mode, difference, (low, high) in zip(result.modes, off, intervals, strict=True):
        assert -0.02 < low < high < 4e-3
        # the numbers are known from above
        assert difference <= -low + 2e-3
        assert mode.interval_hz[0] <= mode.full_frequency_hz <= mode.interval_hz[1]


def test_a_free_part_has_the_mass_and_the_rigid_motions_of_its_solid(drawn):
    free = fx.with_solid_parts(fx.part_model(drawn, material=METAL, interface="tip", mesh_tolerance="2 %"))
    result = fx.modes(free, n=8)
    assert [mode.is_rigid for mode in result.modes] == [True] * 6 + [False] * 2
    assert fx.check(free).mass.mass == pytest.approx(RHO * 60e-3 * 6e-3 * 4e-3, rel=1e-6)
    first = 4.7300**2 / (2 * np.pi) * np.sqrt(E / RHO) / 60e-3**2 * 4e-3 / np.sqrt(12)
    # lower than that of Euler and Bernoulli, for shear and rotary inertia, by 1.4 % (Timoshenko)
    assert result.modes[6].frequency_hz == pytest.approx(0.986 * first, rel=3e-3)


def test_two_parts_in_line_are_one(drawn, tmp_path):
    """Half bars joined at averaged faces are the whole one, but for what their ends bulge."""
    half = bar(tmp_path / "half.step", 30.0)
    text = f"""
name: halves
parts:
  left: {{step: {half}, material: {METAL}, interfaces: {{base: {{face: base}}, tip: {{face: tip}}}}}}
  right:
    step: {half}
    material: {METAL}
    at: [30 mm, 0 mm, 0 mm]
    interfaces: {{base: {{face: base, follow: rigid}}, tip: {{face: tip}}}}
joints: [[left.tip, right.base]]
ground: {{left.base: clamped}}
"""
    halves = [mode.frequency_hz for mode in fx.modes(fx.loads(text)).modes]
    whole = [mode.frequency_hz for mode in fx.modes(fx.part_model(drawn, material=METAL, hold="base")).modes]
    assert relative(halves[:4], whole[:4]) == pytest.approx(np.zeros(4), abs=5e-3)


def test_parts_stand_beside_members_in_patterns_and_mirrors(drawn, tmp_path):
    """Two bars that carry a block by leaves; the mirror image is reduced once and moves alike."""
    text = f"""
name: pair
nodes: {{middle: [0 mm, 0 mm, 80 mm]}}
parts:
  post:
    step: {drawn}
    material: {METAL}
    at: [-20 mm, -3 mm, 0 mm]
    rotate: {{axis: y, angle: -90 deg}}
    pattern: {{type: mirror, normal: x}}
    interfaces: {{base: {{face: base}}, tip: {{face: tip}}}}
bodies:
  table: {{solid: {{shape: box, size: [60 mm, 10 mm, 6 mm], material: {METAL}}}, centre: [0 mm, 0 mm, 63 mm],
    carries: [post1.tip, post2.tip]}}
masses: {{tool: {{node: middle, mass: 5 g}}}}
springs: {{mount: {{nodes: [middle, table], stiffness: {{tx: 1 MN/m, ty: 1 MN/m, tz: 1 MN/m, rx: 1 kN*m/rad,
  ry: 1 kN*m/rad, rz: 1 kN*m/rad}}}}}}
ground: {{'post*.base': clamped}}
"""
    mechanism = fx.loads(text)
    reduced = fx.with_solid_parts(mechanism)
    assert set(reduced.substructures) == {"post"} and not reduced.parts
    result = fx.modes(reduced)
    assert result.modes[0].frequency_hz > 100
    file = tmp_path / "pair.yaml"
    fx.save(mechanism, file)
    assert fx.load(file) == mechanism
    x = assemble(reduced)
    names = x.plan.topology.node_names
    at = {name: x.positions[names.index(name)] for name in ("post1.tip", "post2.tip")}
    assert at["post1.tip"] == pytest.approx(at["post2.tip"] * [-1, 1, 1])


def drawn_plate(path):
    """A drawing of a bar 60 x 6 mm whose ends are on layers of their own."""
    import ezdxf

    drawing = ezdxf.new(units=ezdxf.units.MM)
    corners = [(0, 0), (60, 0), (60, 6), (0, 6), (0, 0)]
    for start, end, layer in zip(corners, corners[1:], ("0", "tip", "0", "base"), strict=False):
        drawing.modelspace().add_line(start, end, dxfattribs={"layer": layer})
    drawing.saveas(path)
    return path


def test_a_drawing_with_a_thickness_is_the_same_part(drawn, tmp_path):
    file = drawn_plate(tmp_path / "plate.dxf")
    flat, solid = fx.faces(file, thickness=4e-3), fx.faces(drawn)
    assert sorted(face.name for face in flat.faces) == sorted(face.name for face in solid.faces)
    assert flat.box == pytest.approx(solid.box, abs=1e-8)
    larger = fx.faces(file, thickness=4e-3, offset=0.5e-3)
    assert np.ptp(larger.box, axis=0) == pytest.approx([61e-3, 7e-3, 4e-3], abs=1e-8)
    hz = [
        [mode.frequency_hz for mode in fx.modes(part, n=2).modes]
        for part in (
            fx.part_model(file, thickness=4e-3, material=METAL, hold="base"),
            fx.part_model(drawn, material=METAL, hold="base"),
        )
    ]
    assert hz[0] == pytest.approx(hz[1], rel=1e-3)
    part = {"drawing": str(file), "material": METAL, "interfaces": {"base": {"face": "base"}}}
    with pytest.raises(ModelError, match="a drawing or an outline has a thickness"):
        fx.loads(json.dumps({"parts": {"bar": part}, "ground": {"bar.base": "clamped"}}))
    with pytest.raises(OptionError, match="a drawing needs a thickness"):
        fx.faces(file)
    with pytest.raises(OptionError, match="a thickness belongs to a drawing"):
        fx.faces(drawn, thickness=4e-3)


def test_a_part_that_bends_far_says_that_it_is_linear_inside(held_bar):
    """A cantilever pushed by 0.06 of its length turns by 0.09 rad at its tip, by 0.12 its length by 0.18."""
    for far, is_warned in ((3.6e-3, False), (7.2e-3, True)):
        said = [str(w) for w in fx.stroke(held_bar, move={"bar.tip.z": far}, steps=2).warnings]
        assert any("within itself" in text and "describe it by flexures" in text for text in said) is is_warned


def test_a_part_that_is_held_alone_vibrates(drawn):
    (mode,) = fx.modes(fx.part_model(drawn, material=METAL, hold="base"), n=1).modes
    assert mode.motion.summary.startswith("bar vibrates")


def test_faces_are_chosen_in_words(drawn):
    drawing = fx.faces(drawn)
    assert [face.kind for face in drawing.faces] == ["plane"] * 6

    def number(**choice):
        return [face.number for face in drawing.chosen(Interface(**choice))]

    tip = number(face="tip")
    assert len(tip) == 1
    assert number(x=60e-3) == number(normal=(1.0, 0.0, 0.0)) == number(near=(0.1, 3e-3, 2e-3)) == tip
    assert number(face=tip[0]) == tip and number(face=(1, 2)) == [1, 2]
    assert number(z=4e-3, near=(0.0, 0.0, 0.0)) == number(z=4e-3)
    assert "plane +x" in [face.form for face in drawing.faces]


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        ("top", "no face is called 'top'"),
        ("plane x = 59 mm", "no face lies in the plane x = 59 mm"),
        ("radius 3 mm", "no face is part of a cylinder of radius 3 mm"),
        ("7", "there is no face 7"),
        ("colour #123456", "no face has the colour #123456"),
        ("normal 1, 1, 0", "no face is plane and looks along"),
        ("tip and plane x = 0 mm", "no face lies in the plane"),
    ],
)
def test_faces_that_are_not_there_are_refused_with_their_place(drawn, words, rule):
    with pytest.raises(ModelError, match=rule) as refused:
        fx.with_solid_parts(fx.part_model(drawn, material=METAL, hold=words))
    assert refused.value.problems[0].path[:3] == ("parts", "bar", "interfaces")


@pytest.mark.parametrize("words", ["x = 1 mm, y", "", "radius x", "a = b"])
def test_words_that_choose_nothing_are_refused(drawn, words):
    with pytest.raises((OptionError, ModelError)):
        fx.part_model(drawn, material=METAL, hold=words)


def test_a_face_moves_with_one_node(drawn):
    with pytest.raises(ModelError, match="belongs to interface base as well"):
        fx.with_solid_parts(fx.part_model(drawn, material=METAL, hold="base", interface="again: plane x = 0 mm"))


def touching(tmp_path, gap: float):
    """Two cubes, the second of them beginning a gap, mm, behind the first."""
    first, second = occ.Box((0, 0, 0), (10, 10, 10)), occ.Box((10 + gap, 0, 0), (20 + gap, 10, 10))
    first.name, second.name = "steel", "aluminium"
    return written(occ.Compound([first, second]), tmp_path / "two.step")


def test_solids_that_touch_are_one_part_of_two_materials(tmp_path):
    file = touching(tmp_path, 0.0)
    text = f"""
materials: {{hard: {{E: 200 GPa, nu: 0.3, rho: 7800 kg/m^3}}}}
parts:
  two:
    step: {file}
    material: {METAL}
    solids: {{steel: hard}}
    mesh_tolerance: 0.02
    interfaces: {{base: {{x: 0 mm}}, tip: {{x: 20 mm}}}}
ground: {{two.base: clamped}}
"""
    drawing = fx.faces(file)
    assert drawing.solids == ("steel", "aluminium") and len(drawing.faces) == 10
    model = fx.with_solid_parts(fx.loads(text))
    assert fx.check(model).mass.mass == pytest.approx((7800 + RHO) * 1e-6, rel=1e-6)
    stretch = fx.statics(model, loads={"two.tip": [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]}).displacement("two.tip")[0]
    assert stretch == pytest.approx(100 * (1 / 200e9 + 1 / E), rel=0.05)


@pytest.mark.parametrize(("gap", "rule"), [(0.5, "touches none of those"), (-1.0, "overlap by 100 mm")])
def test_solids_that_do_not_touch_or_overlap_are_refused(tmp_path, gap, rule):
    with pytest.raises(OptionError, match=rule):
        fx.faces(touching(tmp_path, gap))


def test_files_that_are_no_parts_are_refused(tmp_path, drawn):
    with pytest.raises(OptionError, match=r"no such file|does not exist"):
        fx.faces(tmp_path / "absent.step")
    (text := tmp_path / "text.step").write_text("solid cube")
    with pytest.raises(OptionError, match="does not begin with ISO-10303-21"):
        fx.faces(text)
    content = drawn.read_text()
    (broken := tmp_path / "broken.step").write_text(content[: len(content) // 2])
    with pytest.raises(OptionError, match=r"OpenCASCADE cannot read it|no solid"):
        fx.faces(broken)
    (huge := tmp_path / "huge.step").write_text(content.replace(".MILLI.,.METRE.", "$,.METRE."))
    with pytest.raises(OptionError, match="the unit that the file names"):
        fx.faces(huge)
    face = next(iter(occ.Box((0, 0, 0), (1, 1, 1)).faces))
    face.WriteStep(str(tmp_path / "face.step"))
    with pytest.raises(OptionError, match="no solid"):
        fx.faces(tmp_path / "face.step")


def test_what_does_not_fit_into_memory_is_refused_before_it_is_made(drawn, monkeypatch):
    from flexura.fem import curved

    monkeypatch.setenv("FLEXURA_CACHE", "off")
    monkeypatch.setattr(curved, "available_memory", lambda: 1e6)
    with pytest.raises(OptionError, match=r"DOFs, which take some .* GB are free"):
        fx.with_solid_parts(fx.part_model(drawn, material=METAL, hold="base", mesh_tolerance=0.011))


def test_descriptions_say_what_is_wrong_with_parts(drawn):
    def wrong(**changes):
        part = {"step": str(drawn), "material": METAL, "interfaces": {"base": {"face": "base"}}, **changes}
        text = json.dumps({"parts": {"bar": part}, "ground": {"bar.base": "clamped"}})
        with pytest.raises(ModelError) as refused:
            fx.with_solid_parts(fx.loads(text))
        return str(refused.value)

    assert "there is no such material" in wrong(material="cheese")
    assert "nothing says which face it is" in wrong(interfaces={"base": {}})
    assert "the file has no such solid" in wrong(solids={"other": METAL})
    assert "does not exist" in wrong(step="absent.step") or "no such file" in wrong(step="absent.step")
    assert "unknown key" in wrong(sides={})
    assert "bar.top" in str(_refused(drawn, ground={"bar.top": "clamped"}))
    assert "the name bar is taken" in str(_refused(drawn, nodes={"bar": ["0 mm", "0 mm", "0 mm"]}))


def _refused(drawn, **changes) -> ModelError:
    part = {"step": str(drawn), "material": METAL, "interfaces": {"base": {"face": "base"}}}
    with pytest.raises(ModelError) as refused:
        fx.loads(json.dumps({"parts": {"bar": part}, "ground": {"bar.base": "clamped"}, **changes}))
    return refused.value


def test_equal_parts_are_made_once(drawn):
    part = {"step": str(drawn), "material": METAL, "interfaces": {"base": {"face": "base"}}}
    parts = {"one": part, "two": {**part, "at": ["0 mm", "1 m", "0 mm"]}, "three": {**part, "material": "Ti-6Al-4V"}}
    joints = [["one.base", "two.base"], ["one.base", "three.base"]]
    made = []
    placed = with_parts_placed(
        fx.loads(json.dumps({"parts": parts, "joints": joints})),
        lambda name, key, own: made.append(key) or fx.describe.Substructure(interface=("base",)),
    )
    assert made == ["one", "three"]
    assert [placed.instances[key].of for key in parts] == ["one", "one", "three"]


def test_the_shell_makes_a_model_of_a_part(drawn, tmp_path):
    out = [option for name in ("bar.yaml", "bar.mat", "bar.html") for option in ("--out", str(tmp_path / name))]
    done = flexura(
        "model", drawn, "--material", f"E: 71.7 GPa, nu: {NU}, rho: 2810 kg/m^3", "--hold", "plane x = 0 mm",
        "--interface", "tip", "--mesh-tolerance", "1 %", "-n", "3", "--json", *out,
    )  # fmt: skip
    data = json.loads(done.stdout)
    first = 1.8751**2 / (2 * np.pi) * np.sqrt(E / RHO) / 60e-3**2 * 4e-3 / np.sqrt(12)
    assert data["modes"][0]["frequency_hz"] == pytest.approx(first, rel=1e-2)
    assert {"interval_hz", "model_error", "mesh_error"} <= set(data["modes"][0])
    assert len(data["files"]) == 3
    again = fx.modes(fx.load(tmp_path / "bar.yaml"), n=3)
    assert again.modes[0].frequency_hz == pytest.approx(data["modes"][0]["frequency_hz"], rel=1e-9)


def test_the_shell_lists_and_draws_faces(drawn, tmp_path):
    done = flexura("faces", drawn, "--plot", tmp_path, "--out", tmp_path / "faces.csv")
    assert "plane -x" in done.stdout and (tmp_path / "faces.png").stat().st_size > 10_000
    data = json.loads(flexura("faces", drawn, "--json").stdout)
    assert data["faces"][0]["text"] == "{face: base}"


def test_cylinders_are_known_by_their_radius():
    plate = occ.Box((0, 0, 0), (30, 20, 5)) - occ.Cylinder(occ.Pnt(10, 10, -1), occ.Z, 3, 7)
    triangles = cad._faces(occ, plate, ("part",), 36e-3, "plate")[0]
    (bore,) = [face for face in triangles if face.kind == "cylinder"]
    assert bore.radius == pytest.approx(3e-3, rel=1e-9)
    assert abs(bore.direction[2]) == pytest.approx(1.0)
