"""Stresses of parts from STEP files against what is published, within the margin that each states.

Bars against beam theory; a hole in a strip in tension (Howland 1930, as fitted in Young and Budynas 2002, table 17.1); a
shoulder fillet in tension and bending (Peterson, as fitted in Pilkey 1997, charts 3.2 and 3.7, to some 3 %); a circular
notch hinge in bending (Smith, Badami, Dale and Xu 1997: (1 + t/2R)^(9/20)); a rectangular bar in torsion (Timoshenko
and Goodier 1970: 0.231 at a ratio of 1.5). None of them contracts (nu = 0), so that planes stay in plane stress.
"""

import json

import numpy as np
import pytest

import flexura as fx
from flexura.analysis import deformations
from flexura.full_order import plan_of
from flexura.view.scene import solids, stresses_along
from helpers.shell import flexura
from helpers.step_files import METAL, bar, leaf_guide, written

occ = pytest.importorskip("netgen.occ")

STRENGTH = 500e6
E = 71.7e9
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


def peak(mechanism, *load):
    ((name, _),) = [text.split(".") for text in fx.assemble(mechanism).plan.topology.node_names if text.endswith(".tip")]
    return fx.statics(mechanism, loads={f"{name}.tip": load}).stresses().members[0]


def test_a_cantilever_is_stressed_as_a_beam_is(held_bar):
    result = fx.statics(held_bar, loads={"bar.tip": [0, 0, 1.0, 0, 0, 0]})
    (found,) = result.stresses().members
    x = found.place[0]
    assert 0.4 * 4e-3 <= x < 0.6 * 4e-3 and found.place[2] in (pytest.approx(0), pytest.approx(4e-3))
    assert found.von_mises == pytest.approx(6 * (60e-3 - x) / (6e-3 * 4e-3**2), rel=found.error)
    assert abs(found.principal) == pytest.approx(found.von_mises, rel=0.01)
    assert found.error < 0.02
    assert found.factor_to_yield == pytest.approx(STRENGTH / found.von_mises)
    (note,) = [text for text in result.notes if text.startswith("bar: at the edge of the rigid interface")]
    assert "(0, " in note and "grows without limit" in note


def test_a_bar_in_torsion(held_bar):
    """In the middle, away from how its ends are held and turned."""
    state = fx.statics(held_bar, loads={"bar.tip": [0, 0, 0, TORQUE, 0, 0]})
    drawn = solids(state.model)
    stress = stresses_along(drawn, state.stress_profiles())
    middle = (abs(drawn.points[:, 0] - 30e-3) < 8e-3) & np.isfinite(stress)
    assert stress[middle].max() == pytest.approx(np.sqrt(3) * TORQUE / (0.231 * 6e-3 * 4e-3**2), rel=0.02)


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
        corner = occ.Box((25, low, 0), (25 + r, high, t)) - occ.Cylinder(occ.Pnt(25 + r, y + side * r, -1), occ.Z, r, t + 2)
        shape = shape + corner
    return cut(path, shape, 60.0)


@pytest.mark.parametrize(
    ("load", "nominal", "rows"),
    [
        (0, 1 / 36e-6, [(1.006, 1.008, -0.044), (-0.115, -0.584, 0.315), (0.245, -1.006, -0.257), (-0.135, 0.582, -0.017)]),
        (5, 6e-3 / 432e-9, [(1.007, 1.000, -0.031), (-0.270, -2.404, 0.749), (0.677, 1.133, -0.904), (-0.414, 0.271, 0.186)]),
    ],
)  # fmt: skip
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
    (found,) = result.stresses().members
    assert "at the sharp corner at (" in found.edge and "a fillet gives a number" in found.edge
    corner = found.edge.partition("(")[2].partition(",")[0]
    assert min(abs(float(corner) - x) for x in (8, 28)) < 0.3
    assert any(found.edge in note for note in result.notes)
    assert min(abs(found.place[0] - x) for x in (8e-3, 28e-3)) >= 0.4 * 0.5e-3 * (1 - 1e-6)
    # two leaves that carry 0.5 N each between parallel blocks, at their roots
    nominal = 6 * 0.5 * 10e-3 / (12e-3 * 0.5e-3**2)
    assert 0.85 * nominal < found.von_mises < 1.3 * nominal


def described_bar(rotation=""):
    return fx.loads(f"""
materials: {{metal: {{E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3, yield_stress: 500 MPa}}}}
nodes: {{root: [0, 0, 0], tip: [60 mm, 0, 0]}}
links: {{bar: {{nodes: [root, tip], material: metal, reference: z, section: {{type: rectangle, width: 6 mm, height: 4 mm}}}}}}
ground: {{root: clamped}}
""")


def test_a_bar_that_is_moved_is_stressed_as_a_beam_is_where_the_largest_stress_is_read(held_bar):
    """The stress of a cantilever falls linearly to its tip."""
    moved = {"bar.tip.z": 2e-3}
    of_part = fx.stroke(held_bar, move=moved, steps=2)
    beam = fx.stroke(described_bar(), move={"tip.z": 2e-3}, steps=2)
    pose = of_part.poses[-1]
    share = 1 - pose.stress_place[0] / 60e-3
    assert pose.stress_member == "bar" and pose.stress_position is None
    assert pose.stress_margin == pytest.approx(beam.poses[-1].stress_margin / share, rel=0.02)
    assert of_part.stresses(1)["bar"].von_mises == pytest.approx(STRENGTH / pose.stress_margin)


def test_linear_stress_about_a_pose_goes_on_from_there(held_bar):
    posed = fx.assemble(plan_of(fx.models_at(held_bar)) if False else held_bar)
    u = np.zeros((posed.order, 1))
    assert np.abs(deformations(posed, u)["bar"]).max() == 0
