"""Stresses of parts from STEP files against what is published, within the margin that each states.

Bars against beam theory; a hole in a strip in tension (Howland 1930, fitted in Young and Budynas 2002, table 17.1); a
shoulder fillet in tension and bending (Peterson, fitted in Pilkey 1997, charts 3.2 and 3.7); a circular notch
hinge in bending (Smith, Badami, Dale and Xu 1997: (1 + t/2R)^(9/20)); a rectangular bar in torsion (Timoshenko and
Goodier 1970: 0.231 at a ratio of 1.5). None of them contracts (nu = 0), so that planes stay in plane stress.
"""

import json
import pickle
from typing import Any

import numpy as np
import pytest

import flexura as fx
from flexura.analysis import deformations
from flexura.analysis.strain.part_stress import stressed_parts
from flexura.errors import ModelError
from flexura.fem import von_mises
from flexura.mechanism import at
from flexura.study.questions import questions
from flexura.view import save_statics
from flexura.view.scene import solids, stresses_along
from helpers.shell import flexura
from helpers.step_files import METAL, bar, leaf_guide, written

occ = pytest.importorskip("netgen.occ")

STRENGTH = 500e6
MATERIAL = "E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3, yield_stress: 500 MPa"
TORQUE = 1e-3


def model(file, **options):
    return fx.with_solid_parts(fx.part_model(file, material=MATERIAL, hold="base", interface="tip", **options))


def cut(path, shape, length):
    return written(shape, path, base=("x", 0.0), tip=("x", length))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("stress")


@pytest.fixture(scope="module")
def held_bar(folder):
    """A bar 60 x 6 x 4 mm, held at x = 0."""
    return model(bar(folder / "bar.step"))


def row(stresses: fx.Stresses, name: str) -> Any:
    """What is known of a part."""
    return stresses[name]


def peak(mechanism, *load) -> Any:
    ((name, _),) = [
        text.split(".") for text in fx.assemble(mechanism).plan.topology.node_names if text.endswith(".tip")
    ]
    return fx.statics(mechanism, loads={f"{name}.tip": load}).stresses().members[0]


def test_a_cantilever_is_stressed_as_a_beam_is(held_bar):
    result = fx.statics(held_bar, loads={"bar.tip": [0, 0, 1.0, 0, 0, 0]})
    found = row(result.stresses(), "bar")
    x = found.place[0]
    assert 0.4 * 4e-3 <= x < 0.6 * 4e-3 and found.place[2] in (pytest.approx(0), pytest.approx(4e-3))
    assert found.von_mises == pytest.approx(6 * (60e-3 - x) / (6e-3 * 4e-3**2), rel=found.error)
    assert abs(found.principal) == pytest.approx(found.von_mises, rel=0.01)
    assert found.error < 0.02
    assert found.factor_to_yield == pytest.approx(STRENGTH / found.von_mises)
    (note,) = [text for text in result.notes if text.startswith("bar: at the edge of the rigid interface")]
    assert "(0, " in note and "grows without limit" in note


def torsion(y, z):
    """Shear stress of a section 6 x 4 mm at places about its middle (Timoshenko and Goodier 1970, art. 109)."""
    a, b = 2e-3, 3e-3
    n = np.arange(1, 80, 2)[:, None]
    w, sign = n * np.pi / (2 * a), (-1.0) ** ((n - 1) // 2)
    J = (2 * a) ** 3 * 2 * b / 3 * (1 - 192 * a / np.pi**5 / b * (np.tanh(w * b) / n**5).sum())
    scale = 32 * a**2 / np.pi**3 * sign / n**3 * w * TORQUE / J
    ratio = np.exp(w * (abs(y) - b)) / (1 + np.exp(-2 * w * b))
    along = (scale * np.sign(y) * ratio * (1 - np.exp(-2 * w * abs(y))) * np.cos(w * z)).sum(axis=0)
    across = (scale * (1 - ratio * (1 + np.exp(-2 * w * abs(y)))) * np.sin(w * z)).sum(axis=0)
    return np.hypot(along, across)


def test_a_bar_in_torsion(held_bar):
    """In the middle, away from how its ends are held and turned, where it is stressed most."""
    state = fx.statics(held_bar, loads={"bar.tip": [0, 0, 0, TORQUE, 0, 0]})
    (part,) = stressed_parts(state.model)
    d = deformations(state.model, state.displacement_vector[:, None])["bar"]
    points = part.stress.points
    middle = abs(points[:, 0] - 30e-3) < 10e-3
    found = von_mises(part.stress.stress(d))[middle, 0]
    known = np.sqrt(3) * torsion(*(points[middle, 1:] - [3e-3, 2e-3]).T)
    stated = [part.stress.error_at(point, d[:, 0]) for point in np.flatnonzero(middle).tolist()]
    assert known.max() == pytest.approx(np.sqrt(3) * TORQUE / (0.231 * 6e-3 * 4e-3**2), rel=1e-2)
    high = known > 0.6 * known.max()
    assert high.sum() > 50 and (abs(found - known) <= stated)[high].all()
    assert np.max(stated) < 0.1 * known.max()


def test_a_hole_in_a_strip(folder):
    strip = occ.Box((0, 0, 0), (60, 20, 4)) - occ.Cylinder(occ.Pnt(30, 10, -1), occ.Z, 3, 6)
    found = peak(model(cut(folder / "strip.step", strip, 60.0)), 1.0, 0, 0, 0, 0, 0)
    left = 1 - 6 / 20
    factor = 2 + 0.284 * left - 0.600 * left**2 + 1.32 * left**3
    assert found.principal == pytest.approx(factor / (14e-3 * 4e-3), rel=found.error)
    assert found.error < 0.08 and not found.edge
    assert abs(found.place[0] - 30e-3) < 0.3e-3 and abs(found.place[1] - 10e-3) == pytest.approx(3e-3, rel=0.01)


def shoulder(path, D=20.0, d=12.0, r=2.5, t=3.0):
    """A strip D wide that becomes d wide at x = 25 mm, with fillets."""
    shape = occ.Box((0, 0, 0), (25, D, t)) + occ.Box((25, (D - d) / 2, 0), (60, (D + d) / 2, t))
    for y, side in (((D - d) / 2, -1), ((D + d) / 2, 1)):
        low, high = sorted((y, y + side * r))
        corner = occ.Box((25, low, 0), (25 + r, high, t)) - occ.Cylinder(
            occ.Pnt(25 + r, y + side * r, -1), occ.Z, r, t + 2
        )
        shape = shape + corner
    return cut(path, shape, 60.0)


PULLED = ((1.006, 1.008, -0.044), (-0.115, -0.584, 0.315), (0.245, -1.006, -0.257), (-0.135, 0.582, -0.017))
BENT = ((1.007, 1.000, -0.031), (-0.270, -2.404, 0.749), (0.677, 1.133, -0.904), (-0.414, 0.271, 0.186))


@pytest.mark.parametrize(("load", "nominal", "rows"), [(0, 1 / 36e-6, PULLED), (5, 6e-3 / 432e-9, BENT)])
def test_a_shoulder_fillet(folder, load, nominal, rows):
    force = np.zeros(6)
    force[load] = 1.0 if load == 0 else TORQUE
    found = peak(model(shoulder(folder / "shoulder.step")), *force)
    height, width = 4.0 / 2.5, 2 * 4.0 / 20.0
    factor = sum(width**k * (a + b * np.sqrt(height) + c * height) for k, (a, b, c) in enumerate(rows))
    assert found.von_mises == pytest.approx(factor * nominal, rel=found.error)
    assert found.error < 0.1 and not found.edge


def test_a_circular_notch_hinge(folder):
    hinge = occ.Box((0, 0, 0), (30, 6.6, 6))
    for y in (0.0, 6.6):
        hinge = hinge - occ.Cylinder(occ.Pnt(15, y, -1), occ.Z, 3, 8)
    found = peak(model(cut(folder / "hinge.step", hinge, 30.0)), 0, 0, 0, 0, 0, TORQUE)
    assert found.von_mises == pytest.approx((1 + 0.6 / 6) ** 0.45 * 6 * TORQUE / (6e-3 * 0.6e-3**2), rel=found.error)
    assert found.error < 0.06


def test_sharp_corners_say_that_their_stress_is_infinite(folder):
    """Roots of leaves without fillets; 0.4 of their thickness away what is bent is stressed as leaves are, about."""
    file = leaf_guide(folder / "leaves.step")
    mechanism = fx.with_solid_parts(
        fx.part_model(file, material=METAL, hold="base", interface="table", mesh_tolerance="3 %")
    )
    result = fx.statics(mechanism, loads={"leaves.table": [0, 1.0, 0, 0, 0, 0]})
    found = row(result.stresses(), "leaves")
    assert "at the sharp corner at (" in found.edge and "a fillet gives a number" in found.edge
    corner = found.edge.partition("(")[2].partition(",")[0]
    assert min(abs(float(corner) - x) for x in (8, 28)) < 0.3
    assert any(found.edge in note for note in result.notes)
    assert min(abs(found.place[0] - x) for x in (8e-3, 28e-3)) >= 0.4 * 0.5e-3 * (1 - 1e-6)
    # two leaves that carry 0.5 N each between parallel blocks, at their roots
    nominal = 6 * 0.5 * 10e-3 / (12e-3 * 0.5e-3**2)
    assert 0.85 * nominal < found.von_mises < 1.3 * nominal


def described_bar():
    return fx.loads("""
materials: {metal: {E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3, yield_stress: 500 MPa}}
nodes: {root: [0, 0, 0], tip: [60 mm, 0, 0]}
links:
  bar:
    nodes: [root, tip]
    material: metal
    reference: z
    section: {shape: rectangle, width: 6 mm, thickness: 4 mm}
    root: rigid
ground: {root: clamped}
""")


def test_a_bar_that_is_moved_is_stressed_as_a_beam_is_where_the_largest_stress_is_read(held_bar):
    """The stress of a cantilever falls linearly to its tip."""
    moved = {"bar.tip.z": 2e-3}
    of_part = fx.stroke(held_bar, move=moved, steps=2)
    beam = fx.stroke(described_bar(), move={"tip.z": 2e-3}, steps=2)
    pose: Any = of_part.poses[-1]
    pose_of_beam: Any = beam.poses[-1]
    share = 1 - pose.stress_place[0] / 60e-3
    assert pose.stress_member == "bar" and pose.stress_position is None
    assert pose.stress_margin == pytest.approx(pose_of_beam.stress_margin / share, rel=0.02)
    assert row(of_part.stresses(0), "bar").von_mises == pytest.approx(STRENGTH / pose.stress_margin)


def test_stress_about_a_pose_is_what_is_there_and_what_is_added(held_bar):
    posed = fx.statics(at(held_bar, {"bar.tip.z": 2e-3}))
    there = row(fx.stroke(held_bar, move={"bar.tip.z": 2e-3}, steps=1).stresses(0), "bar")
    assert row(posed.stresses(), "bar").von_mises == pytest.approx(there.von_mises, rel=1e-6)
    force = [0, 0, 1.0, 0, 0, 0]
    more = row(fx.statics(at(held_bar, {"bar.tip.z": 2e-3}), loads={"bar.tip": force}).stresses(), "bar")
    alone = row(fx.statics(held_bar, loads={"bar.tip": force}).stresses(), "bar")
    assert more.von_mises == pytest.approx(there.von_mises + alone.von_mises, rel=2e-3)


def test_copies_that_are_mirrored_and_turned_are_stressed_alike(folder):
    """Two bars along y, mirror images; what twists and bends one does so mirrored to the other."""
    text = f"""
materials: {{metal: {{E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3, yield_stress: 500 MPa}}}}
parts:
  post:
    step: {bar(folder / "bar.step")}
    material: metal
    at: [20 mm, 0 mm, 5 mm]
    rotate: {{axis: z, angle: 90 deg}}
    pattern: {{type: mirror, normal: x}}
    interfaces: {{base: {{face: base}}, tip: {{face: tip}}}}
bodies:
  frame: {{solid: {{shape: box, size: [60 mm, 10 mm, 10 mm], material: metal}}, centre: [0 mm, -5 mm, 7 mm],
    carries: [post1.base, post2.base]}}
ground: {{'post*.base': clamped}}
"""
    force = np.array([1.0, 0.5, 2.0, 1e-3, 2e-3, -1e-3])
    result = fx.statics(fx.loads(text), loads={"post1.tip": force, "post2.tip": force * [-1, 1, 1, 1, -1, -1]})
    first, second = (row(result.stresses(), name) for name in ("post1", "post2"))
    assert first.von_mises == pytest.approx(second.von_mises, rel=1e-4)
    assert first.principal == pytest.approx(second.principal, rel=1e-4)
    assert first.place == pytest.approx(second.place * np.array([-1, 1, 1]), abs=1e-9)
    # the first moves from the file by a quarter of a turn about z
    turned = {"bar.tip": [0.5, -1.0, 2.0, 2e-3, -1e-3, -1e-3]}
    alone = row(fx.statics(model(folder / "bar.step"), loads=turned).stresses(), "bar")
    x, y, z = alone.place
    assert first.von_mises == pytest.approx(alone.von_mises, rel=1e-4)
    assert first.place == pytest.approx([20e-3 - y, x, 5e-3 + z], abs=1e-9)


def test_solids_of_a_part_are_told_apart(folder):
    """Two bars in line, the second of half the strength."""
    first, second = occ.Box((0, 0, 0), (30, 6, 4)), occ.Box((30, 0, 0), (60, 6, 4))
    first.name, second.name = "near", "far"
    text = f"""
materials:
  metal: {{E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3, yield_stress: 500 MPa}}
  soft: {{E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3, yield_stress: 100 MPa}}
parts:
  two:
    step: {written(occ.Glue([first, second]), folder / "two.step")}
    material: metal
    solids: {{far: soft}}
    interfaces: {{base: {{x: 0 mm}}, tip: {{x: 60 mm}}}}
ground: {{two.base: clamped}}
"""
    stresses = fx.statics(fx.loads(text), loads={"two.tip": [0, 0, 1.0, 0, 0, 0]}).stresses()
    far, near = row(stresses, "two.far"), row(stresses, "two.near")
    assert far.von_mises == pytest.approx(6 * 30e-3 / (6e-3 * 4e-3**2), rel=max(far.error, 0.01))
    assert near.von_mises > 1.8 * far.von_mises
    assert (far.yield_stress, near.yield_stress) == (100e6, 500e6)
    assert stresses.factor_to_yield == far.factor_to_yield


def driven(folder):
    return fx.loads(f"""
materials: {{metal: {{E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3, yield_stress: 500 MPa}}}}
nodes: {{end: [80 mm, 3 mm, 2 mm]}}
parameters: {{width: 2 mm}}
parts:
  bar: {{step: {bar(folder / "bar.step")}, material: metal, interfaces: {{base: {{face: base}}, tip: {{face: tip}}}}}}
links:
  pin:
    nodes: [bar.tip, end]
    material: metal
    reference: z
    section: {{shape: rectangle, width: width, thickness: 2 mm}}
ground: {{bar.base: clamped}}
""")


def test_studies_ask_for_the_stress_and_the_margin_of_parts(folder):
    """What a thin link pushes at its end bends the bar as much as the link allows."""
    mechanism = driven(folder)
    asked = questions(mechanism, "stress(bar) at end.z = 1 mm, margin(bar) at end.z = 1 mm, stress at end.z = 1 mm")
    found = asked.values({"width": [2e-3, 4e-3]}).value
    for width, (stress, margin, largest) in zip((2e-3, 4e-3), found, strict=True):
        assert stress * margin == pytest.approx(STRENGTH)
        path = fx.stroke(mechanism, {"width": width}, move={"end.z": 1e-3}, steps=1).stresses(0)
        assert stress == pytest.approx(path["bar"].von_mises, rel=1e-6)
        assert largest == pytest.approx(path["pin"].von_mises, rel=1e-6) and largest > stress
    # the whole is two springs in line, which share the force
    assert not any("nothing is known" in note for note in asked.notes)


def test_slopes_of_the_stress_of_parts_are_exact(folder):
    text = "stress(bar) at end.z = 1 mm"
    asked = questions(driven(folder), text)
    slope = asked.slopes({"width": 2e-3}, ["width"])
    beside = asked.values({"width": [1.99e-3, 2.01e-3]}).value[:, 0]
    assert slope.slope[0, 0] == pytest.approx((beside[1] - beside[0]) / 2e-5, rel=1e-3)


def test_what_is_far_from_yield_and_beyond_it_is_said(held_bar):
    def warned(force):
        found = fx.statics(held_bar, loads={"bar.tip": [0, 0, force, 0, 0, 0]})
        return [warning for warning in found.warnings if warning.kind == "stress"]

    assert not warned(1.0)
    (warning,) = warned(200.0)
    assert warning.place == "bar" and warning.value == pytest.approx(1.46, rel=0.02)


def test_steps_in_time_find_the_worst_stress_of_parts(held_bar):
    """A force that is put on at once, against a beam of twenty elements."""
    beam = described_bar()
    beam = beam.model_copy(update={"links": {"bar": beam.links["bar"].model_copy(update={"elements": 20})}})
    found = [
        row(
            fx.time_response(
                mechanism, inputs={node: np.ones(600)}, outputs=[node], dt=5e-6, damping=0.05, keep_modes=True
            ).stresses(),
            "bar",
        )
        for mechanism, node in ((held_bar, "bar.tip.tz"), (beam, "tip.tz"))
    ]
    share = 1 - found[0].place[0] / 60e-3
    assert found[0].von_mises == pytest.approx(share * found[1].von_mises, rel=0.03)


def test_a_yield_stress_that_is_a_parameter_is_refused(folder):
    text = f"""
parameters: {{limit: 500 MPa}}
materials: {{metal: {{E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3, yield_stress: limit}}}}
parts: {{bar: {{step: {bar(folder / "bar.step")}, material: metal, interfaces: {{base: {{face: base}}}}}}}}
ground: {{bar.base: clamped}}
"""
    with pytest.raises(ModelError, match="write yield_stress as a number"):
        fx.modes(fx.loads(text))


def test_stresses_go_with_a_model_to_other_processes(held_bar):
    there = pickle.loads(pickle.dumps(held_bar))
    force = {"bar.tip": [0, 0, 1.0, 0, 0, 0]}
    assert fx.statics(there, loads=force).stresses() == fx.statics(held_bar, loads=force).stresses()


def test_tables_files_and_pictures_have_parts(folder, tmp_path):
    file = tmp_path / "driven.yaml"
    fx.save(driven(folder), file)
    load = ("--load", "end=0,0,0.1 N", "--node", "end")
    rows = {row["member"]: row for row in json.loads(flexura("statics", file, *load, "--json").stdout)["stress"]}
    row = rows["bar"]
    assert row["place_m"][0] >= 1.6e-3 and row["mesh_error"] < 0.02
    assert "rigid interface" in row["infinite"] and "place_m" not in rows["pin"]
    assert "mm, ±" in flexura("statics", file, *load).stdout
    state = fx.statics(driven(folder), loads={"end": [0, 0, 0.1, 0, 0, 0]})
    table = state.stresses().to_columns()
    at = table["member"].index("bar")
    assert table["x [m]"][at] == pytest.approx(row["place_m"][0]) and table["x [m]"][1 - at] is None
    drawn = solids(state.model)
    stress = stresses_along(drawn, state.stress_profiles())
    _, first, count = next(own for own in drawn.surfaces if own[0] == "bar.solid")
    assert stress[first : first + count].max() == pytest.approx(row["von_mises_Pa"], rel=0.1)
    assert save_statics(state, tmp_path)[0].stat().st_size > 10_000
