"""Bodies that are unions and differences of pieces: against whole solids, polynomials and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.fem.solid_mesh import SolidMesh, outer_sides
from flexura.full_order import plan_of
from flexura.mechanism import with_rigid_bodies, with_rigid_roots

pytest.importorskip("netgen.occ")

TABLE = "{shape: box, size: [8 mm, 30 mm, 12 mm], at: [4 mm, 15 mm, 6 mm]}"
POCKET = "{shape: box, size: [8 mm, 14 mm, 8 mm], at: [7 mm, 15 mm, 6 mm]}"
HOLES = """{shape: cylinder, diameter: 3 mm, length: 10 mm, axis: x, at: [4 mm, 15 mm, 6 mm]},
  {shape: cylinder, diameter: 2 mm, length: 14 mm, at: [4 mm, 25.5 mm, 6 mm]}"""
BAR = "{shape: box, size: [4 mm, 30 mm, 12 mm], at: [2 mm, 15 mm, 6 mm]}"
ARM = "{shape: box, size: [16 mm, 4 mm, 12 mm], at: [12 mm, 28 mm, 6 mm]}"
OUTER = "{shape: box, size: [20 mm, 30 mm, 12 mm], at: [10 mm, 15 mm, 6 mm]}"
WINDOW = "{shape: plate, length: 12 mm, width: 22 mm, thickness: 13 mm, at: [10 mm, 15 mm, 6 mm]}"
SLOT = "{shape: box, size: [4 mm, 5 mm, 11 mm], at: [1 mm, 2.25 mm, 6 mm]}"
FAR = "{shape: box, size: [2 mm, 2 mm, 2 mm], at: [30 mm, 0, 0]}"


def guide(add: str, cut: str = "", block: str = "shape: box, size: [8 mm, 30 mm, 12 mm]", more: str = "") -> str:
    """A table on two leaves; its origin is in a corner."""
    return f"""
flexura: 1
materials: {{al: {{E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3}}}}
parameters: {{web: 0.5 mm, size: 12 mm}}
nodes:
  a0: [8 mm, 2.25 mm, 6 mm]
  a1: [28 mm, 2.25 mm, 6 mm]
  b0: [8 mm, 27.75 mm, 6 mm]
  b1: [28 mm, 27.75 mm, 6 mm]
flexures:
  a: {{nodes: [a0, a1], material: al, reference: y, profile: {{type: leaf, width: 12 mm, thickness: web}}}}
  b: {{nodes: [b0, b1], material: al, reference: y, profile: {{type: leaf, width: 12 mm, thickness: web}}}}
bodies:
  block: {{centre: [4 mm, 15 mm, 6 mm], solid: {{material: al, {block}}}, carries: [a0, b0], held: {{face: x-}}}}
  table:
    centre: [28 mm, 0, 0]
    solid: {{shape: composite, material: al, add: [{add}], cut: [{cut}]}}
    carries: [a1, b1]
{more}
"""


def hz(text: str, n: int = 6) -> np.ndarray:
    return fx.modes(fx.loads(text), n=n, order="full").frequency_hz


@pytest.mark.parametrize(
    ("add", "cut", "whole"),
    [
        # `verify --whole`: NGSolve, curved tetrahedra of order 3; 183 474, 94 608 and 101 124 DOFs
        (TABLE, f"{POCKET}, {HOLES}", (324.8, 2536.4, 4802.5, 6460.2, 6520.5, 9443.8)),
        (f"{BAR}, {ARM}", "", (328.1, 2115.1, 4938.5, 6101.8, 6471.2, 6922.7)),
        (OUTER, WINDOW, (244.9, 1386.0, 3395.3, 6390.8, 6464.3, 8396.4)),
    ],
    ids=["pocket and holes", "L", "frame"],
)
def test_guides_with_composites_against_their_whole_solids(add: str, cut: str, whole: tuple[float, ...]) -> None:
    text = guide(add, cut)
    np.testing.assert_allclose(hz(text), whole, rtol=0.01)
    rigid = fx.modes(with_rigid_bodies(fx.loads(text)), n=6, order="full").frequency_hz
    assert np.abs(rigid / whole - 1).max() > 0.1


def test_a_box_of_pieces_is_the_box_of_polynomials() -> None:
    box = "shape: box, material: al, size: [8 mm, 30 mm, 12 mm]"
    polynomials = guide(TABLE).replace("centre: [28 mm, 0, 0]", "centre: [32 mm, 15 mm, 6 mm]")
    polynomials = polynomials.replace(f"shape: composite, material: al, add: [{TABLE}], cut: []", box)
    block = "shape: composite, add: [{shape: box, size: [8 mm, 30 mm, 12 mm]}]"
    np.testing.assert_allclose(hz(guide(TABLE, block=block)), hz(polynomials), rtol=0.005)


def test_a_rigid_composite_has_the_mass_and_inertia_of_its_pieces() -> None:
    two = guide(f"{BAR}, {ARM}", more="    elastic: false")
    one = """    centre: [30 mm, 15 mm, 6 mm]
    solid: {shape: box, material: al, size: [4 mm, 30 mm, 12 mm]}
    elastic: false
    carries: [a1, b1, arm]
  arm: {centre: [40 mm, 28 mm, 6 mm], elastic: false, solid: {shape: box, material: al, size: [16 mm, 4 mm, 12 mm]}}
"""
    apart = two[: two.index("    centre: [28 mm")] + one
    found, known = (fx.modes(with_rigid_roots(fx.loads(text)), n=6, order="full").frequency_hz for text in (two, apart))
    np.testing.assert_allclose(found, known, rtol=1e-6)


def test_what_does_not_shape_a_composite_varies_and_what_does_is_held() -> None:
    text = guide(OUTER, WINDOW.replace("12 mm", "size"))
    plan, webs = plan_of(fx.loads(text)), np.array([0.45e-3, 0.55e-3])
    batch = fx.natural_frequencies(plan, {"web": webs}, n=3).frequency_hz
    one = [hz(text.replace("web: 0.5 mm", f"web: {1e3 * web} mm"), 3) for web in webs]
    np.testing.assert_allclose(batch, one, rtol=2e-4)
    slopes = fx.sensitivity(plan, ask=["f1", "f3"]).slope[:, list(plan.parameter_values()).index("web")]
    low, high = fx.natural_frequencies(plan, {"web": np.array([0.4999e-3, 0.5001e-3])}, n=3).frequency_hz
    np.testing.assert_allclose(slopes, ((high - low) / 2e-7)[[0, 2]], rtol=1e-4)
    with pytest.raises(fx.FlexuraError, match=r"size = 0\.013 m is above its maximum 0\.012 m"):
        fx.natural_frequencies(plan, {"size": np.array([12e-3, 13e-3])}, n=3)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (guide(TABLE, "{shape: box, size: [90 mm, 90 mm, 90 mm]}"), "table.solid.cut.0: nothing of the solid is left"),
        (guide(f"{TABLE}, {FAR}"), "table.solid.add.1: the piece does not touch the first one"),
        (guide(TABLE, FAR), "table.solid.cut.0: it cuts nothing away"),
        (guide(TABLE, "{shape: box, size: [90 mm, 2 mm, 90 mm], at: [0, 9 mm, 0]}"), "it cuts the solid into 2 parts"),
        (guide(TABLE).replace("cut: []", "meshed: 3"), "table.solid.meshed: unknown key"),
        (guide(TABLE, SLOT), r"table.carries: what pulls there finds no solid.*found a1"),
        (
            guide(TABLE, block="shape: composite, add: [{shape: box, size: [8 mm, 30 mm, 12 mm]}], "
            "cut: [{shape: box, size: [2 mm, 40 mm, 20 mm], at: [-4 mm, 0, 0]}]"),
            "block.held.face: nothing is left of the face that is held",
        ),
    ],
    ids=["all cut", "apart", "beside", "two parts", "no key of files", "over a slot", "held face"],
)  # fmt: skip
def test_what_is_no_solid_is_named_with_its_place(text: str, found: str) -> None:
    with pytest.raises(fx.ModelError, match=found):
        plan_of(fx.loads(text))


def test_without_netgen_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "netgen.occ", None)
    with pytest.raises(fx.FlexuraError, match=r"needs the package netgen.occ: pip install 'flexura\[solid\]'"):
        plan_of(fx.loads(guide(TABLE.replace("12 mm", "12.3 mm"))))


def test_a_composite_is_written_as_it_was_read() -> None:
    model = fx.loads(guide(OUTER, f"{WINDOW}, {HOLES}"))
    assert fx.loads(fx.dumps(plan_of(model).mechanism)).bodies == model.bodies


def test_outer_sides_of_tetrahedra_are_those_of_one_cell() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
    for shared in ([1, 2, 3, 4], [2, 3, 1, 4], [3, 1, 2, 4]):
        cells = np.array([[0, 1, 2, 3], shared])
        _, facets = outer_sides(SolidMesh(points, {"tetra": cells}, {"tetra": np.zeros(2, dtype=np.intp)}, ()))
        assert len(facets) == 6


def test_over_a_stroke_it_is_itself_at_the_start() -> None:
    model = fx.loads(guide(OUTER, WINDOW))
    found = fx.stroke(model, move={"table.y": (0, 1e-3)}, steps=2, n=2)
    known = fx.modes(model, n=2, order="full").frequency_hz
    np.testing.assert_allclose(found.poses[0].frequency_hz, known, rtol=1e-4)


def test_the_surface_of_a_composite_is_closed_and_holds_its_volume() -> None:
    body = plan_of(fx.loads(guide(OUTER, WINDOW))).mechanism.bodies["table"].solid.meshed
    points, triangles = body.surface
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    inside = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert inside == pytest.approx((20 * 30 - 12 * 22) * 12e-9, rel=1e-9)
    assert body.volume == pytest.approx(inside, rel=1e-9)


def prism(corners: list[tuple[float, float]], thickness: float, more: str = "") -> str:
    points = ", ".join(f"[{x} mm, {y} mm]" for x, y in corners)
    return f"{{shape: prism, outline: [{points}], thickness: {thickness} mm{more}}}"


L_SHAPE = [(0, 0), (4, 0), (4, 26), (20, 26), (20, 30), (0, 30)]


def test_a_prism_is_the_boxes_that_it_is_made_of() -> None:
    """Also in the other sense, turned from another plane, and with a pocket that is a prism."""
    known = hz(guide(f"{BAR}, {ARM}"))
    lying = prism([(y, x) for x, y in L_SHAPE], 12, ", at: [0, 0, 6 mm], rotate: {axis: [1, 1, 0], angle: 180 deg}")
    pocket = prism([(4, -1), (4, 26), (21, 26), (21, -1)], 14, ", at: [0, 0, 6 mm]")
    for add, cut in [
        (prism(L_SHAPE, 12, ", at: [0, 0, 6 mm]"), ""),
        (lying, ""),
        (OUTER, pocket),
    ]:
        np.testing.assert_allclose(hz(guide(add, cut)), known, rtol=2e-3)


def test_a_prism_as_one_solid_of_the_part() -> None:
    """Its mass in the solid of the whole part is that of its pieces, and so is the place of its centre."""
    model = fx.assemble(fx.loads(guide(prism(L_SHAPE, 12, ", at: [0, 0, 6 mm]"))))
    box = fx.assemble(fx.loads(guide(f"{BAR}, {ARM}")))
    from flexura.fem import body_solids

    one, two = (next(body for body in body_solids(own) if body.name == "table") for own in (model, box))
    assert one.volume == pytest.approx(two.volume, rel=1e-9)
    assert one.volume == pytest.approx((4 * 30 + 16 * 4) * 12e-9, rel=1e-9)


@pytest.mark.parametrize(
    ("corners", "found"),
    [
        ([(0, 0), (4, 0)], "outline"),
        ([(0, 0), (4, 4), (4, 0), (0, 4)], "sides 1 and 3 cross or touch"),
        ([(0, 0), (4, 0), (4, 0), (0, 4)], "two corners that follow each other are one"),
    ],
)
def test_outlines_of_prisms_are_simple(corners: list[tuple[float, float]], found: str) -> None:
    with pytest.raises(fx.ModelError, match=found):
        fx.loads(guide(prism(corners, 12)))


def test_where_lines_leave_a_prism_and_how_far_points_are_out_of_it() -> None:
    from flexura.mechanism import Composite, PrismPiece
    from flexura.structure import Pieces

    outline = tuple((1e-3 * x, 1e-3 * y) for x, y in L_SHAPE)
    pieces = Pieces.of(Composite(material="al", add=(PrismPiece(outline=outline, thickness=12e-3),)))
    points = np.array([[2.0, 5, 0], [2, 28, 1], [12, 10, 0], [2, 28, -1], [1, 1, 0]]) * 1e-3
    towards = np.array([[1.0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]])
    np.testing.assert_allclose(pieces.exits(points, towards), [2e-3, 18e-3, 0, 7e-3, 29e-3], atol=1e-9)
    np.testing.assert_allclose(pieces.beyond(points), [-2e-3, -2e-3, 8e-3, -2e-3, -1e-3], atol=1e-12)
    np.testing.assert_allclose(pieces.nearest(points)[2], [4e-3, 10e-3, 0], atol=1e-12)
    Q = np.diag([-1.0, 1, 1])
    mirrored = pieces.moved(Q, np.array([1.0, 0, 0]))
    np.testing.assert_allclose(mirrored.beyond(points @ Q + [1, 0, 0]), pieces.beyond(points), atol=1e-12)
