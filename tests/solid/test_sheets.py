"""Sheets: diaphragms with openings as solids of one layer, against plates, beams and other solids."""

import numpy as np
import pytest

import flexura as fx
from flexura.beam import ring_plate
from flexura.beam.ring_plate import RingPlate
from flexura.fem.figures import Curve
from flexura.view import Kind, solids

pytest.importorskip("netgen.occ")
METAL = fx.Mechanism().material("Al-7075-T6")
PLATE = RingPlate(30e-3, 10e-3, 0.3e-3, METAL.E, METAL.nu, METAL.rho)


def held(**more):
    """A diaphragm on a clamped rim, with a mass at its hub."""
    ring = fx.describe.Diaphragm(
        **{
            "nodes": ("rim", "hub"),
            "material": "Al-7075-T6",
            "reference": "x",
            "rim_diameter": 60e-3,
            "hub_diameter": 20e-3,
            "thickness": 0.3e-3,
            **more,
        }
    )
    return fx.Mechanism(
        nodes={"rim": (0, 0, 0), "hub": (0, 0, 0)},
        diaphragms={"ring": ring},
        masses={"mass": fx.describe.PointMass(node="hub", mass=0.1, inertia=(1e-5,) * 3)},
        ground={"rim": "clamped"},
    )


def stiffness(mechanism):
    """K (6, 6) at the hub."""
    return np.linalg.inv(fx.compliance(mechanism, nodes=["hub"]))


def test_a_whole_ring_is_the_plate_within_its_error():
    (sheet,) = fx.with_solid_parts(held(fidelity="solid", mesh_size=1.5)).superelements.values()
    K, E = (matrix.array[6:12, 6:12] for matrix in (sheet.stiffness, sheet.stiffness_error))
    off = np.diag(K) - ring_plate.stiffnesses(PLATE)
    assert (off > 0).all() and (off < 1.5 * np.diag(E) + 1e-3 * np.diag(K)).all()
    c = 2 * ring_plate.membrane(PLATE).axial * PLATE.thickness**2 / ring_plate.stiffnesses(PLATE)[2]
    assert sheet.sheet.stiffening == pytest.approx(float(c), rel=0.03)
    M = sheet.mass.array[:12, :12]
    rigid = np.vstack([np.eye(6), np.eye(6)])
    mass, inertia = ring_plate.described_mass(PLATE)
    np.testing.assert_allclose(np.diag(rigid.T @ M @ rigid), [mass, mass, mass, *inertia], rtol=1e-3)
    assert sheet.amplitudes == 2


def test_narrow_spokes_are_beams():
    """Three clamped beams of 20 mm in parallel, 12 EI/L^3 each, and EA/L along half of them; they stiffen as strips do,
    18/25."""
    b, L = 1e-3, 20e-3
    mechanism = held(spokes=fx.describe.Spokes(count=3, width=b), mesh_size=4.0)
    K = stiffness(mechanism)
    EI, EA = METAL.E * b * 0.3e-3**3 / 12, METAL.E * b * 0.3e-3
    assert K[2, 2] == pytest.approx(3 * 12 * EI / L**3, rel=0.02)
    assert K[0, 0] == pytest.approx(1.5 * EA / L, rel=0.02)
    sheet = fx.with_solid_parts(mechanism).superelements["ring"].sheet
    assert sheet.stiffening == pytest.approx(18 / 25, rel=0.02)


def test_spiral_slits_are_those_of_tetrahedra_within_their_error():
    """Tetrahedra of order 4 between rigid rim and hub: netgen 6.2, NGSolve, 287 601 DOFs, cells of 2 mm."""
    slits = (fx.describe.Slit(from_=(12e-3, 0.0), to=(28e-3, np.deg2rad(150)), width=0.5e-3, count=3),)
    (sheet,) = fx.with_solid_parts(held(slits=slits, mesh_size=2.0)).superelements.values()
    K, E = (np.diag(matrix.array)[6:12] for matrix in (sheet.stiffness, sheet.stiffness_error))
    solid = np.array([1.0204324e7, 1.0204324e7, 4634.053, 1.0115576, 1.0115576, 4147.401])
    assert (np.abs(K - solid) < E + 0.005 * solid).all() and (0.15 * solid > E).all()


def test_what_is_told_of_sheets():
    mechanism = held(spokes=fx.describe.Spokes(count=3, width=1e-3), mesh_size=4.0)
    push = stiffness(mechanism)[2, 2] * 0.3e-3
    (warning,) = fx.statics(mechanism, loads={"hub": (0, 0, push / 2, 0, 0, 0)}).warnings
    assert warning.place == "ring" and warning.value == pytest.approx(0.18, rel=0.02)
    path = fx.stroke(mechanism, move={"hub.z": (0, 0.3e-3)}, steps=2)
    assert [w.value for w in path.warnings if w.place == "ring"] == [pytest.approx(0.72, rel=0.02)]
    assert not [w for w in fx.check(mechanism).warnings if w.kind == "overlap"]
    whole = fx.with_solid_parts(mechanism)
    assert fx.loads(fx.dumps(whole)) == whole and fx.loads(fx.dumps(mechanism)) == mechanism


@pytest.mark.parametrize(
    ("slit", "place", "rule"),
    [
        ({"from": (15e-3, 0.0), "to": (15e-3, 2.2), "width": 1e-3, "count": 3}, "diaphragms.ring", "cut apart"),
        (
            {"from": (5e-3, 0.0), "to": (25e-3, 0.0), "width": 1e-3},
            "diaphragms.ring.slits.0.from",
            "between hub and rim",
        ),
        ({"from": (15e-3, 0.0), "to": (15e-3, 6.2), "width": 3e-3}, "diaphragms.ring.slits.0", "back to itself"),
        ({"from": (15e-3, 0.0), "to": (15e-3, 0.0), "width": 3e-3}, "diaphragms.ring.slits.0.to", "to another one"),
    ],
)
def test_slits_that_cannot_be_are_named(slit, place, rule):
    with pytest.raises(fx.ModelError) as error:
        fx.modes(held(slits=(fx.describe.Slit(**slit),)), n=1)
    assert place in str(error.value) and rule in str(error.value)


def test_distances_from_curves():
    arc = Curve(((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)))
    at = np.array([[0.0, 2.0], [0.0, -1.0], [np.sqrt(0.5), np.sqrt(0.5)], [3.0, 0.0]])
    np.testing.assert_allclose(arc.distance(at), [1.0, np.sqrt(2.0), 0.0, 2.0], atol=1e-12)
    other = Curve(tuple(reversed(arc.points)))
    np.testing.assert_allclose(other.distance(at), arc.distance(at), atol=1e-12)


def flat(outline, pads, nodes=((0, 0, 0), (0, 0, 0)), **more):
    """A flat spring of 0.3 mm from a clamped foot to a head."""
    described = {"material": "Al-7075-T6", "reference": "x", "thickness": 0.3e-3, "outline": outline, "pads": pads}
    return fx.Mechanism(
        nodes=dict(zip(("foot", "hub"), nodes, strict=True)),
        flat_springs={"spring": fx.describe.FlatSpring(**{**described, **more})},
        ground={"foot": "clamped"},
    )


def arc(through, to):
    return fx.describe.Side(through=through, to=to)


def test_a_quarter_circle_is_the_curved_beam():
    """S. Timoshenko, Strength of materials: a bar of a quarter circle, clamped at one end, a force at the other, which
    bends it in its plane, pi R^3/4EI, or out of it, R^3 (pi/4EI + (3 pi/4 - 2)/GJ)."""
    R, b, t = 20e-3, 1e-3, 0.3e-3
    low, high, c = R - b / 2, R + b / 2, np.sqrt(0.5)
    outline = (arc((low * c, low * c), (low, 0)), (high, 0), arc((high * c, high * c), (0, high)), (0, low))
    mechanism = flat(outline, {"foot": {"edges": [1]}, "hub": {"edges": [3]}}, ((R, 0, 0), (0, R, 0)), mesh_size=2.0)
    C = fx.compliance(mechanism, nodes=["hub"])
    EI, thin, GJ = METAL.E * t * b**3 / 12, METAL.E * b * t**3 / 12, METAL.E / (2 + 2 * METAL.nu) * b * t**3 / 3
    GJ *= 1 - 0.63 * t / b
    assert C[1, 1] == pytest.approx(np.pi * R**3 / (4 * EI), rel=0.02)
    assert C[2, 2] == pytest.approx(R**3 * (np.pi / (4 * thin) + (3 * np.pi / 4 - 2) / GJ), rel=0.02)


def test_a_round_outline_with_a_hole_is_a_ring():
    """In a plane that is turned and away from the origin, with a foot elsewhere."""
    a, normal, origin = 30e-3, np.array([1.0, 2.0, 2.0]) / 3, (0.01, 0.02, 0.03)
    mechanism = flat(
        (arc((0, -a), (a, 0)), arc((0, a), (-a, 0))),
        {"foot": {"edges": [1, 2]}, "hub": {"holes": [1]}},
        ((0, 0, 0.05), origin),
        holes=(fx.describe.Hole(centre=(0, 0), diameter=20e-3),),
        origin=origin,
        normal=tuple(normal),
        reference=(2, 1, -2),
        mesh_size=0.7,
    )
    K, k = stiffness(mechanism), ring_plate.stiffnesses(PLATE)
    assert normal @ K[:3, :3] @ normal == pytest.approx(k[2], rel=0.02)
    assert np.trace(K[:3, :3]) == pytest.approx(k[:3].sum(), rel=1e-3)
    assert np.trace(K[3:, 3:]) == pytest.approx(k[3:].sum(), rel=1e-3)


SQUARE = ((0, 0), (20e-3, 0), (20e-3, 20e-3), (0, 20e-3))
HELD = {"foot": {"edges": [4]}, "hub": {"edges": [2]}}


@pytest.mark.parametrize(
    ("outline", "pads", "holes", "place", "rule"),
    [
        ((*SQUARE[:2], SQUARE[3], SQUARE[2]), HELD, (), "outline", "edge 2 meets edge 4"),
        (SQUARE, {**HELD, "hub": {"edges": [5]}}, (), "pads.hub.edges.0", "has 4 edges"),
        (SQUARE, {**HELD, "hub": {"holes": [1]}}, (), "pads.hub.holes.0", "has no holes"),
        (SQUARE, HELD, ((0.05, 0.01),), "holes.0", "inside the outline"),
        ((SQUARE[0], *SQUARE), HELD, (), "outline.1", "no length"),
    ],
)
def test_outlines_and_pads_that_cannot_be_are_named(outline, pads, holes, place, rule):
    round_ = tuple(fx.describe.Hole(centre=centre, diameter=1e-3) for centre in holes)
    with pytest.raises(fx.ModelError) as error:
        fx.modes(flat(outline, pads, holes=round_), n=1)
    assert f"flat_springs.spring.{place}" in str(error.value) and rule in str(error.value)


def test_pictures_show_the_sheet_between_its_pads():
    """Rigid motions move all of it, a hub by itself the points at the hub and none at the rim."""
    model = fx.assemble(held(spokes=fx.describe.Spokes(count=3, width=1e-3), mesh_size=4.0))
    u = np.zeros((model.plan.topology.n_nodes, 6))
    u[:2] = [1e-3, 2e-3, 3e-3, 0.01, 0.02, 0.03]
    drawn = solids(model, u)
    on = drawn.face_kinds == Kind.SUPERELEMENT
    points = np.unique(drawn.faces[on])
    assert len(points) > 100 and np.ptp(drawn.points[points, 2]) == pytest.approx(0.3e-3)
    rigid = u[0, :3] + np.cross(u[0, 3:], drawn.points[points])
    np.testing.assert_allclose(drawn.motions[points], rigid, atol=1e-8)
    u[0] = 0.0
    bent, radius = solids(model, u).motions[points], np.hypot(*drawn.points[points, :2].T)
    at_hub, at_rim = (np.abs(radius - r) < 1e-9 for r in (10e-3, 30e-3))
    assert np.abs(bent[at_rim][:, :2]).max() < 1e-9
    np.testing.assert_allclose(bent[at_hub][:, :2], rigid[at_hub][:, :2], atol=1e-8)
