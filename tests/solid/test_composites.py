"""Bodies that are unions and differences of boxes, plates and cylinders."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.fem.solid_mesh import SolidMesh, outer_sides

pytest.importorskip("gmsh")

BOX = "{shape: box, size: [12 mm, 30 mm, 12 mm]}"


def guide(solid: str, more: str = "") -> str:
    return f"""
flexura: 1
materials: {{al: {{E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3}}}}
parameters: {{thickness: 0.5 mm, hole: 6 mm}}
nodes:
  a0: [8 mm, 2.25 mm, 6 mm]
  a1: [28 mm, 2.25 mm, 6 mm]
  b0: [8 mm, 27.75 mm, 6 mm]
  b1: [28 mm, 27.75 mm, 6 mm]
flexures:
  a: {{nodes: [a0, a1], material: al, reference: y, profile: {{type: leaf, width: 12 mm, thickness: thickness}}}}
  b: {{nodes: [b0, b1], material: al, reference: y, profile: {{type: leaf, width: 12 mm, thickness: thickness}}}}
bodies:
  block: {{centre: [4 mm, 15 mm, 6 mm], solid: {{shape: box, size: [8 mm, 30 mm, 12 mm], material: al}},
    carries: [a0, b0], held: {{face: x-}}}}
  table: {{centre: [34 mm, 15 mm, 6 mm], carries: [a1, b1], solid: {{material: al, {solid}}}{more}}}
"""


def composite(add: str = BOX, cut: str = "", more: str = "") -> str:
    return guide(f"shape: composite, add: [{add}], cut: [{cut}]", more)


HOLE = "{shape: cylinder, diameter: hole, length: 20 mm, axis: z}"
POCKET = f"{HOLE}, {{shape: box, size: [8 mm, 8 mm, 8 mm], at: [2 mm, 9 mm, 4 mm]}}"


def hz(text: str, n: int = 6) -> np.ndarray:
    return fx.modes(fx.loads(text), n=n).frequency_hz


def test_a_box_as_a_composite_is_the_box() -> None:
    same = hz(guide("shape: box, size: [12 mm, 30 mm, 12 mm]"))
    np.testing.assert_allclose(hz(composite()), same, rtol=2.5e-3)
    halves = "{shape: box, size: [12 mm, 15 mm, 12 mm], at: [0 mm, 7.5 mm, 0 mm]}"
    halves += ", {shape: plate, length: 12 mm, width: 15 mm, thickness: 12 mm, at: [0 mm, -7.5 mm, 0 mm]}"
    np.testing.assert_allclose(hz(composite(halves)), same, rtol=2.5e-3)


@pytest.mark.parametrize(
    ("add", "cut", "whole"),
    [
        # by `flexura verify --whole` (NGSolve, curved tetrahedra of order 3): 111 882, 97 128 and 100 482 DOFs
        (BOX, POCKET, (258.65, 1808.1, 4559.6, 6433.2, 6444, 9383.4)),
        (
            "{shape: box, size: [4 mm, 30 mm, 12 mm], at: [-4 mm, 0 mm, 0 mm]},"
            " {shape: box, size: [12 mm, 4 mm, 12 mm], at: [0 mm, 13 mm, 0 mm]}",
            "",
            (358.83, 2778.4, 5239.3, 6390.2, 6471.3, 9384.1),
        ),
        (
            "{shape: box, size: [16 mm, 30 mm, 12 mm], at: [2 mm, 0 mm, 0 mm]}",
            "{shape: box, size: [8 mm, 22 mm, 20 mm], at: [2 mm, 0 mm, 0 mm]}",
            (256.67, 1604.4, 3788.3, 6416.3, 6419.1, 9353.5),
        ),
    ],
    ids=["pocket", "L", "frame"],
)
def test_guides_against_their_whole_solids(add: str, cut: str, whole: tuple[float, ...]) -> None:
    np.testing.assert_allclose(hz(composite(add, cut)), whole, rtol=0.015)


def test_mass_and_inertia_are_those_of_the_solid() -> None:
    model = fx.assemble(fx.loads(composite(cut=HOLE, more=", elastic: false")))
    rho, hole = 2810.0, np.pi * 3e-3**2 * 12e-3
    own = model.plan.parts[""].bodies["table"][1].matrix(model.values)
    assert own[0, 0] == pytest.approx(rho * (12e-3 * 30e-3 * 12e-3 - hole), rel=1e-9)
    about_z = rho * (12e-3 * 30e-3 * 12e-3 * (12e-3**2 + 30e-3**2) / 12 - hole * 3e-3**2 / 2)
    assert own[5, 5] == pytest.approx(about_z, rel=1e-9)


def test_what_a_composite_depends_on_is_held() -> None:
    plan = fx.loads(composite(cut=HOLE))
    thickness = np.array([0.4e-3, 0.5e-3])
    batch = fx.natural_frequencies(plan, {"thickness": thickness}, n=3, tolerance=1e-6).frequency_hz
    alone = [fx.modes(plan, {"thickness": t}, n=3, order="full").frequency_hz for t in thickness]
    np.testing.assert_allclose(batch, alone, rtol=1e-4)
    with pytest.raises(fx.OptionError, match="hole"):
        fx.natural_frequencies(plan, {"hole": np.array([4e-3, 5e-3])}, n=3)


def test_over_a_stroke_and_as_text() -> None:
    model = fx.loads(composite(cut=HOLE))
    assert hz(fx.dumps(model), 3) == pytest.approx(fx.modes(model, n=3).frequency_hz, rel=1e-12)
    found = fx.stroke(model, move={"table.y": (0, 1e-3)}, steps=2, n=2)
    assert found.poses[0].frequency_hz == pytest.approx(fx.modes(model, n=2, order="full").frequency_hz, rel=1e-4)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (composite(cut="{shape: box, size: [20 mm, 40 mm, 20 mm]}"), "solid.cut.0: nothing of the solid is left"),
        (composite(f"{BOX}, {{shape: box, size: [2 mm, 2 mm, 2 mm], at: [50 mm, 0, 0]}}"), "add.1: the piece does not"),
        (composite(cut="{shape: box, size: [20 mm, 2 mm, 20 mm]}"), "cut.0: it cuts the solid into 2 parts"),
        (composite(cut="{shape: box, size: [4 mm, 6 mm, 20 mm], at: [-5 mm, 12.75 mm, 0]}"), "finds no solid"),
        (
            composite(cut="{shape: box, size: [4 mm, 40 mm, 20 mm], at: [5 mm, 0, 0]}", more=", held: {face: x+}"),
            "nothing is left of the face",
        ),
    ],
    ids=["nothing", "apart", "in two", "over a hole", "no face"],
)
def test_what_is_no_solid_is_named(text: str, said: str) -> None:
    with pytest.raises(fx.ModelError, match=said):
        fx.modes(fx.loads(text), n=1)


def test_outer_sides_of_tetrahedra_are_those_of_one_cell() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
    for shared in ([1, 2, 3, 4], [2, 3, 1, 4], [3, 1, 2, 4]):
        cells = np.array([[0, 1, 2, 3], shared])
        _, facets = outer_sides(SolidMesh(points, {"tetra": cells}, {"tetra": np.zeros(2, dtype=np.intp)}, ()))
        assert len(facets) == 6
