"""Solid members reduced to superelements.

References: wide leaves between flat ends and plane-stress notches, 27-node hexahedra and nine-node quadrilaterals of
scikit-fem 12.0.2 as in tests/literature/test_lit_flexures.py; a leaf with a block, quadratic tetrahedra, 192 000 DOFs;
the clamped-clamped Euler-Bernoulli beam (first root 4.7300, Blevins, Formulas for Natural Frequency and Mode Shape,
1979, table 8-1). Tolerances: rigid faces are stiffer than the straight ends of the notches, 1 % for rotations; 2 % for
the torsion of leaves, in which the reference is itself an upper bound of stiffness.
"""

import json
from itertools import pairwise

import numpy as np
import pytest

import flexura as fx
from flexura.beam import member_frame, rectangle, rigid_arm
from flexura.cli import main
from flexura.errors import ModelError, OptionError
from flexura.fem import reduced
from flexura.fem.cache import cache_folder
from flexura.fem.geometry import MemberShape, MemberSolid, SolidMaterial
from flexura.fem.matrices import Face, elastic_matrices, face_ties
from flexura.fem.meshing import group_mesh
from flexura.fem.parts import as_beams, with_solid_parts
from flexura.fem.reduced import EndTie, Piece, Section, constraint_modes, reduced_piece
from flexura.full_order import assemble
from flexura.mechanism import with_rigid_bodies, with_rigid_roots
from flexura.solid.modes import solid_modes

BLOCK_HZ = np.array([127.1, 607.0, 1399, 3696])
LEAVES = {  # L/b, t/b: compliance times EI under a constant moment, torsional stiffness over GJ/L
    (0.5, 0.03): (0.9247, 4.016),
    (1.0, 0.1): (0.9441, 1.844),
    (3.0, 0.3): (0.9832, 1.135),
    (5.0, 1.0): (0.9909, 1.007),
}
CIRCULAR = {(4.0, 0.3): 585.0, (3.0, 0.5): 144.4}


@pytest.fixture(autouse=True)
def own_cache(monkeypatch, tmp_path):
    """Keep what the tests compute out of the user's cache, and what others have computed out of the tests."""
    monkeypatch.setenv("FLEXURA_CACHE", str(tmp_path / "cache"))
    reduced.IN_MEMORY.clear()


def shape(*kind, **sizes):
    """Describe a shape of unit length."""
    return MemberShape(kind, tuple(sorted((name, (float(size),)) for name, size in sizes.items())))


LEAF = shape("leaf", width=1.0, thickness=0.03)


def piece(form, nu=0.3, faces="rigid", sections=()):
    """Describe a member by itself."""
    metal = SolidMaterial("unit", 1.0, nu, 1.0)
    member = MemberSolid("0", form, 1.0, metal, np.zeros(3), np.eye(3), (0, 1), (0, 1))
    return Piece((member,), (EndTie(0, 0, 0, faces), EndTie(1, 0, 1, faces)), sections)


def stiffness(form, nu=0.3, faces="rigid", size=1.0):
    """Return 1/compliance along and about x y z at the middle of a part of unit length, E = 1."""
    own = reduced_piece(piece(form, nu, faces), size, 0)
    K = own.K
    D = np.linalg.inv(rigid_arm(np.array([0.5, 0, 0])))
    return 1 / np.diag(D @ np.linalg.inv(K[6:, 6:])[:6, :6] @ D.T)


def leaf_with_block(turned=None, faces="rigid", body=True, **member):
    """Describe a leaf of 10 x 10 x 0.3 mm with a block of 10 x 10 x 8 mm, a rigid body or a solid."""
    Q = np.eye(3) if turned is None else turned
    shared = {"material": "Al-7075-T6", "reference": tuple(Q[:, 2]), "fidelity": "solid", "faces": faces}
    leaf = fx.describe.Leaf(width=10e-3, thickness=0.3e-3)
    nodes = {key: tuple(Q[:, 0] * x) for key, x in (("a", 0.0), ("b", 10e-3), ("c", 20e-3))}
    flexures = {"leaf": fx.describe.Flexure(nodes=("a", "b"), profile=leaf, **shared, **member)}
    if not body:
        block = fx.describe.Link(nodes=("b", "c"), section=fx.describe.Rectangle(width=10e-3, thickness=8e-3), **shared)
        return fx.Mechanism(nodes=nodes, flexures=flexures, links={"block": block}, ground={"a": "clamped"})
    del nodes["c"]
    angle = float(np.arccos((np.trace(Q) - 1) / 2))
    axis = (1.0, 0.0, 0.0) if angle == 0 else (Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1])
    block = fx.describe.RigidBody(
        centre=tuple(Q[:, 0] * 15e-3),
        solid=fx.describe.Box(size=(10e-3, 10e-3, 8e-3), material="Al-7075-T6"),
        rotate=fx.describe.Rotation(axis=axis, angle=angle),
        carries=("b",),
    )
    return fx.Mechanism(nodes=nodes, flexures=flexures, bodies={"block": block}, ground={"a": "clamped"})


@pytest.mark.parametrize("faces", ["rigid", "averaged", "flexible"])
def test_rigid_motions_and_mass(faces):
    part = reduced_piece(piece(LEAF, 0.33, faces)).scaled(10e-3, 71.7e9, 2810.0)
    rigid = np.vstack([np.eye(6), rigid_arm(np.array([10e-3, 0, 0])), np.zeros((len(part.K) - 12, 6))])
    assert np.abs(part.K @ rigid).max() < 1e-12 * np.abs(part.K).max()
    scale = 1 / np.sqrt(np.diag(part.K))
    values = np.linalg.eigvalsh(scale[:, None] * part.K * scale)
    assert np.abs(values[:6]).max() < 1e-12
    assert values[6] > 1e-9
    carried = rigid.T @ part.M @ rigid
    assert part.mass == pytest.approx(2810 * 3e-8)
    np.testing.assert_allclose(carried[:3, :3], part.mass * np.eye(3), atol=1e-10 * part.mass)
    size = np.array([10e-3, 10e-3, 0.3e-3])
    inertia = part.mass / 12 * np.diag((size**2).sum() - size**2)
    arm = rigid_arm(np.array([5e-3, 0, 0]))
    about = arm.T @ np.block([[part.mass * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), inertia]]) @ arm
    np.testing.assert_allclose(carried, about, atol=1e-9 * np.abs(about).max())
    assert np.linalg.eigvalsh(part.M).min() > 0


def test_mass_of_a_notch_is_that_of_its_contour():
    part = reduced_piece(piece(shape("notch", "circular", width=1.2, radius=0.5, web=0.05)), 1.5, 0)
    rigid = np.vstack([np.eye(6), rigid_arm(np.array([1.0, 0, 0]))])
    assert (rigid.T @ part.M @ rigid)[0, 0] == pytest.approx(1.2 * (1.05 - np.pi / 4), rel=1e-9)


@pytest.mark.parametrize("faces", ["rigid", "averaged", "flexible"])
def test_means_and_surfaces_follow_rigid_motions(faces):
    sections = (Section(0, 1, 4), Section(0, 2, 4))
    part = reduced_piece(piece(LEAF, 0.33, faces, sections), 2.0).scaled(10e-3, 71.7e9, 2810.0)
    rigid = np.vstack([np.eye(6), rigid_arm(np.array([10e-3, 0, 0])), np.zeros((len(part.K) - 12, 6))])
    wanted = np.vstack([rigid_arm(np.array([x, 0, 0])) for x in (2.5e-3, 5e-3)])
    np.testing.assert_allclose(part.average @ rigid, wanted, atol=1e-7)
    moved = np.vstack([rigid_arm(x)[:3] for x in part.surface.points])
    np.testing.assert_allclose(part.surface.rows @ rigid, moved, atol=3e-6)
    assert np.ptp(part.surface.points, axis=0) == pytest.approx([10e-3, 10e-3, 0.3e-3])


def test_a_surface_is_closed_and_looks_outwards():
    surface = reduced_piece(piece(LEAF), 2.0, 0).surface
    a, b, c, d = np.moveaxis(surface.points[surface.facets], 1, 0)
    areas = np.cross(c - a, d - b) / 2
    np.testing.assert_allclose(areas.sum(axis=0), 0, atol=1e-12)
    assert np.einsum("fi,fi->", areas, (a + b + c + d) / 4) / 3 == pytest.approx(0.03)


@pytest.mark.parametrize("case", LEAVES)
def test_leaves_between_flat_ends(case):
    (L, t), (bending, torsion) = case, LEAVES[case]
    found = stiffness(shape("leaf", width=1 / L, thickness=t / L))
    section = rectangle(1 / L, t / L, 0.3)
    assert section.Iy / found[4] == pytest.approx(bending, rel=4e-3)
    assert found[3] / (section.J / 2.6) == pytest.approx(torsion, rel=0.02)


@pytest.mark.parametrize("case", CIRCULAR)
def test_notches_in_plane_stress(case):
    R, t = case
    found = stiffness(shape("notch", "circular", width=0.125, radius=0.5, web=t / (2 * R)), nu=0.0)
    rotation = 0.125 / found[4] / (2 * R) ** 2
    assert rotation == pytest.approx(CIRCULAR[case], rel=0.01)
    assert rotation < CIRCULAR[case]


def test_averaged_faces_stretch_as_a_bar_and_rigid_ones_are_stiffer():
    form = shape("leaf", width=1.0, thickness=0.25)
    rigid, flexible, averaged = (stiffness(form, faces=kind) for kind in ("rigid", "flexible", "averaged"))
    assert averaged[0] == pytest.approx(0.25, rel=1e-9)
    assert averaged[4] == pytest.approx(0.25**3 / 12, rel=1e-9)
    assert (averaged <= flexible * (1 + 1e-9)).all()
    assert (flexible <= rigid).all()
    assert rigid[0] > 1.02 * averaged[0]


def test_more_deformations_of_a_face_make_it_softer():
    own = piece(LEAF, 0.33)
    mesh = group_mesh(own.members, 2.0)
    torsion = []
    for kind, degree in (("rigid", 0), ("flexible", 1), ("flexible", 2), ("flexible", 3), ("averaged", 0)):
        ends = zip(("0 start", "0 end"), own.places, strict=True)
        ties = face_ties(mesh, [Face(mesh.point_sets[n], at, k, kind) for k, (n, at) in enumerate(ends)], degree)
        K = constraint_modes(*(ties.T.T @ A @ ties.T for A in elastic_matrices(mesh)), ties.boundary).K
        torsion.append(1 / np.linalg.inv(K[6:, 6:])[3, 3])
    assert all(a >= b * (1 - 1e-9) for a, b in pairwise(torsion))
    assert torsion[0] > torsion[-1]


def test_fixed_interface_modes_of_a_slender_leaf():
    part = reduced_piece(piece(shape("leaf", width=0.05, thickness=0.01), 0.0), 1.0, 1)
    beam = 4.7300407**4 * 0.01**2 / 12
    assert part.K[-1, -1] / part.M[-1, -1] == pytest.approx(beam, rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("body", [True, False], ids=["rigid block", "solid block"])
def test_leaf_with_a_block(body):
    hz = fx.modes(with_solid_parts(leaf_with_block(body=body)), n=4).frequency_hz
    np.testing.assert_allclose(hz, BLOCK_HZ, rtol=0.02)


def test_frame_does_not_matter():
    turn = member_frame(np.array([1.0, 2.0, -0.5]), np.array([0.3, 0.1, 1.0])).T
    plain, turned = (fx.modes(with_solid_parts(leaf_with_block(Q)), n=4).frequency_hz for Q in (None, turn))
    np.testing.assert_allclose(turned, plain, rtol=1e-7)


def test_arms_reach_the_ends():
    plain = with_solid_parts(leaf_with_block())
    offset = leaf_with_block(start_offset=(0.0, 1e-3, 2e-3), end_offset=(0.0, 1e-3, 2e-3))
    shifted = with_solid_parts(offset)
    K, expected = (m.superelements["leaf"].stiffness.array for m in (shifted, plain))
    D = rigid_arm(np.array([0, 1e-3, 2e-3]))
    T = np.kron(np.eye(2), D)
    np.testing.assert_allclose(K[:12, :12], T.T @ expected[:12, :12] @ T, atol=1e-9 * np.abs(expected).max())


def test_similarity_is_exact():
    unit = piece(LEAF, 0.33)
    metal = SolidMaterial("metal", 71.7e9, 0.33, 2810.0)
    member = MemberSolid("0", LEAF, 10e-3, metal, np.zeros(3), np.eye(3), (0, 1), (0, 1))
    mesh = group_mesh([member])
    faces = [
        Face(mesh.point_sets[f"0 {word}"], np.array([x, 0, 0]), k)
        for k, word, x in ((0, "start", 0), (1, "end", 10e-3))
    ]
    ties = face_ties(mesh, faces)
    direct = constraint_modes(*(ties.T.T @ A @ ties.T for A in elastic_matrices(mesh)), ties.boundary, 2)
    scaled = reduced_piece(unit).scaled(10e-3, 71.7e9, 2810.0)
    for own, other in ((scaled.K, direct.K), (scaled.M, direct.M)):
        d = 1 / np.sqrt(np.diag(other))[:12]
        np.testing.assert_allclose(d[:, None] * own[:12, :12] * d, d[:, None] * other[:12, :12] * d, atol=1e-7)
    omega = [part.K[12:, 12:].diagonal() / part.M[12:, 12:].diagonal() for part in (scaled, direct)]
    np.testing.assert_allclose(*omega, rtol=1e-6)


def of_material(material):
    """The leaf with its block of another material under the name of one that is known."""
    return leaf_with_block().replaced({"materials": {"Al-7075-T6": material}})


def test_equal_pieces_are_worked_out_once(monkeypatch):
    made = []
    monkeypatch.setattr(reduced, "group_mesh", lambda *a, **k: made.append(a) or group_mesh(*a, **k))
    with_solid_parts(leaf_with_block(), size=2.5, keep=1)
    thick = of_material(fx.describe.Material(E=2e11, nu=0.33, rho=7800))
    again = with_solid_parts(thick, size=2.5, keep=3)
    assert len(made) == 2, "the mesh, and the second one that tells how fine it is"
    assert again.superelements["leaf"].amplitudes == 3
    reduced.IN_MEMORY.clear()
    with_solid_parts(thick, size=2.5)
    solid_modes(assemble(as_beams(thick)), 2, 2.5)
    folder = cache_folder()
    assert folder is not None
    assert len(made) == len(list(folder.glob("*"))) == 2
    with_solid_parts(thick, size=2.5, keep=20)
    assert len(made) == 4


def test_the_cache_does_not_change_results(monkeypatch):
    few = with_solid_parts(leaf_with_block(), size=3.0).superelements["leaf"]
    with_solid_parts(leaf_with_block(), size=3.0, keep=20)
    truncated = with_solid_parts(leaf_with_block(), size=3.0).superelements["leaf"]
    assert truncated.amplitudes == 2
    largest = np.abs(few.stiffness.array).max()
    np.testing.assert_allclose(truncated.stiffness.array, few.stiffness.array, atol=1e-9 * largest)
    monkeypatch.setenv("FLEXURA_CACHE", "off")
    reduced.IN_MEMORY.clear()
    again = with_solid_parts(leaf_with_block(), size=3.0).superelements["leaf"]
    np.testing.assert_array_equal(few.stiffness.array, again.stiffness.array)


def test_verbs_reduce_solid_members_by_themselves():
    mechanism, t = leaf_with_block(), {}
    solid = with_solid_parts(mechanism)
    assert (fx.assemble(mechanism, t).K != fx.assemble(solid, t).K).nnz == 0
    np.testing.assert_array_equal(fx.modes(mechanism, n=2).frequency_hz, fx.modes(solid, n=2).frequency_hz)
    pushed = [fx.statics(m, loads={"block": (0, 0, 1, 0, 0, 0)}).displacement("block") for m in (mechanism, solid)]
    np.testing.assert_array_equal(*pushed)
    responses = [
        fx.frequency_response(m, frequency_hz=[20.0], inputs=["block.tz"], outputs=["block.tz"], damping=0.01).response
        for m in (mechanism, solid)
    ]
    np.testing.assert_array_equal(*responses)
    assert fx.check(mechanism).solid_parts.keys() == {"leaf"}


def test_a_plan_is_of_a_mechanism_without_solid_members():
    mechanism = leaf_with_block()
    with pytest.raises(ModelError, match=r"flexures\.leaf\.fidelity(.|\n)*flexura\.with_solid_parts\(mechanism\)"):
        fx.Plan(mechanism)
    beams = mechanism.model_copy(update={"flexures": {}, "bodies": {}})
    assert with_solid_parts(beams) is beams


def test_what_is_replaced_and_what_stays():
    mechanism = leaf_with_block()
    found = with_solid_parts(mechanism, keep=3)
    assert found.flexures == {}
    assert found.superelements["leaf"].nodes == ("a", "b")
    assert found.superelements["leaf"].amplitudes == 3
    assert found.bodies == mechanism.bodies
    assert fx.loads(fx.dumps(mechanism)) == mechanism
    np.testing.assert_allclose(
        fx.modes(fx.loads(fx.dumps(found)), n=3).frequency_hz, fx.modes(found, n=3).frequency_hz, rtol=1e-9
    )


def with_parameter():
    """Describe a leaf in a placed substructure, as thick as a parameter says."""
    t = fx.describe.parameter("t")
    leaf = fx.describe.Flexure(
        nodes=("a", "b"),
        material="Al-7075-T6",
        reference="z",
        profile=fx.describe.Leaf(width=10e-3, thickness=t),
        fidelity="solid",
    )
    arm = fx.describe.Substructure(
        nodes={"a": (0, 0, 0), "b": (10e-3, 0, 0)}, flexures={"leaf": leaf}, interface=("a", "b")
    )
    return fx.Mechanism(
        parameters={
            "half": fx.describe.Parameter(value=0.15e-3, unit="m"),
            "t": fx.describe.Parameter(value=2 * fx.describe.parameter("half"), unit="m"),
            "m": fx.describe.Parameter(value=0.01, unit="kg"),
        },
        substructures={"arm": arm},
        instances={"arm": fx.describe.Instance(of="arm", pattern=fx.describe.MirrorPattern(normal=(1.0, 0.0, 0.0)))},
        joints=(("arm1.a", "arm2.a"),),
        masses={"tip": fx.describe.PointMass(node="arm1.a", mass=fx.describe.parameter("m"))},
        ground={"arm*.b": "clamped"},
    )


def test_parameters():
    mechanism = with_parameter()
    thin, thick = with_solid_parts(mechanism), with_solid_parts(mechanism, {"half": 0.2e-3})
    K = [m.substructures["arm"].superelements["leaf"].stiffness.array for m in (thin, thick)]
    C = [np.linalg.inv(k[6:12, 6:12])[4, 4] for k in K]
    assert C[0] / C[1] == pytest.approx((4 / 3) ** 3, rel=5e-3)
    assert thick.parameters["half"].value == 0.2e-3
    for fixed in ("half", "t"):
        with pytest.raises(OptionError, match=f"parameter {fixed}"):
            fx.modes(thick, {fixed: 0.25e-3})
    assert fx.modes(thick, {"half": 0.2e-3}).frequency_hz[0] == fx.modes(thick).frequency_hz[0]
    heavy, light = (fx.modes(thick, {"m": m}, n=1).frequency_hz[0] for m in (1.0, 0.25))
    assert light / heavy == pytest.approx(2, rel=1e-2)


def test_loss_factors_stay():
    losses = [
        with_solid_parts(leaf_with_block(**own), size=3.0).superelements["leaf"].loss_factor
        for own in ({}, {"loss_factor": 0.02})
    ]
    assert losses == [None, 0.02]
    damped = with_solid_parts(leaf_with_block(loss_factor=0.02), size=3.0)
    found = fx.frequency_response(damped, frequency_hz=[1.0], inputs=["block.tz"], outputs=["block.tz"])
    response = np.ravel(np.asarray(found.response))[0]
    assert -response.imag / response.real == pytest.approx(0.02, rel=0.01)


def test_a_mirrored_pair_is_symmetric():
    found = with_solid_parts(with_parameter())
    C = fx.compliance(found, nodes=["arm1.a"])
    matrix = np.asarray(C if isinstance(C, np.ndarray) else C.matrix).reshape(6, 6)
    assert abs(matrix[2, 4]) < 1e-9 * np.sqrt(matrix[2, 2] * matrix[4, 4])
    K = reduced_piece(piece(LEAF, 0.33)).scaled(10e-3, 71.7e9, 2810.0).K
    assert 1 / matrix[2, 2] == pytest.approx(2 * K[2, 2], rel=1e-6)


def stepped(fidelity="solid", **more):
    """Describe a cantilever of a thin and a thick leaf, which meet at `b`; its face at `a` is rigid."""
    shared = {"material": "Al-7075-T6", "reference": "z"}
    return fx.Mechanism(
        fidelity=fidelity,
        nodes={"a": (0, 0, 0), "b": (10e-3, 0, 0), "c": (20e-3, 0, 0)},
        flexures={
            "thin": fx.describe.Flexure(
                nodes=("a", "b"),
                profile=fx.describe.Leaf(width=8e-3, thickness=1e-3),
                root=("rigid", "elastic"),
                **shared,
            ),
            "thick": fx.describe.Flexure(
                nodes=("b", "c"), profile=fx.describe.Leaf(width=8e-3, thickness=2e-3), **shared
            ),
        },
        ground={"a": "clamped"},
        **more,
    )


def test_members_that_meet_are_one_superelement():
    found = with_solid_parts(stepped(), size=2.0, keep=8)
    assert list(found.superelements) == ["thin"]
    assert found.superelements["thin"].nodes == ("a", "c")
    assert list(found.nodes) == ["a", "c"]
    assert not found.flexures
    beam = fx.modes(stepped(None), n=1).frequency_hz[0]
    hz = fx.modes(found, n=3, order="full").frequency_hz
    assert hz[0] == pytest.approx(beam, rel=0.01)
    whole = solid_modes(assemble(stepped(None)), 3, 2.0).solution.frequency_hz
    np.testing.assert_allclose(hz, whole, rtol=1e-6)


@pytest.mark.parametrize(
    "more",
    [
        {"sensors": {"tip": fx.describe.MotionSensor(type="displacement", nodes=("b",), direction="z")}},
        {"interface": ("b",)},
        {"masses": {"tip": fx.describe.PointMass(node="b", mass=1e-6)}},
    ],
    ids=["sensor", "interface", "mass"],
)
def test_nodes_that_are_needed_stay(more):
    found = with_solid_parts(stepped(**more), size=2.0)
    assert found.superelements["thin"].nodes == ("a", "b", "c")
    assert list(found.nodes) == ["a", "b", "c"]
    free = with_solid_parts(stepped(), size=2.0)
    stiff, soft = (fx.modes(m, n=1).frequency_hz[0] for m in (found, free))
    assert 1 < stiff / soft < 1.03


def test_beams_among_solids_keep_their_nodes():
    mechanism = stepped()
    beam = mechanism.flexures["thick"].model_copy(update={"fidelity": "beam"})
    found = with_solid_parts(mechanism.model_copy(update={"flexures": {**mechanism.flexures, "thick": beam}}), size=2.0)
    assert found.superelements["thin"].nodes == ("a", "b")
    assert list(found.flexures) == ["thick"]


def test_fidelity_is_that_of_the_substructure_then_of_the_mechanism():
    mechanism = with_parameter()
    plain = mechanism.substructures["arm"]
    leaf = plain.flexures["leaf"].model_copy(update={"fidelity": None})
    for own, above, solid in ((None, None, 0), ("solid", None, 1), (None, "solid", 1), ("beam", "solid", 0)):
        arm = plain.model_copy(update={"flexures": {"leaf": leaf}, "fidelity": own})
        described = mechanism.model_copy(update={"substructures": {"arm": arm}, "fidelity": above})
        assert len(with_solid_parts(described, size=3.0).substructures["arm"].superelements) == solid


def test_amplifier_halves_are_those_of_the_whole_solid():
    mechanism = with_rigid_bodies(fx.load("examples/amplifier/amplifier.yaml"))
    found = with_solid_parts(mechanism.model_copy(update={"fidelity": "solid"}), size=2.0)
    quarter = found.substructures["quarter"]
    assert {key: part.nodes for key, part in quarter.superelements.items()} == {
        "arm": ("outer", "output"),
        "outer_leaf": ("outer", "input"),
    }
    assert list(quarter.nodes) == ["output", "outer", "input"]
    whole = solid_modes(assemble(mechanism), 5, 2.0).solution.frequency_hz
    np.testing.assert_allclose(fx.modes(found, n=5).frequency_hz, whole, rtol=2e-3)


def test_parts_of_the_rpr_mechanism():
    """Faces of parts are rigid, and so are the joints of the corrected beams."""
    mechanism = with_rigid_roots(fx.load("examples/rpr/rpr.yaml"))

    def solid(members, names):
        update = {"fidelity": "solid"}
        return {key: m.model_copy(update=update) if key.startswith(names) else m for key, m in members.items()}

    substructures = {
        name: part.model_copy(update={"links": solid(part.links, "leaf"), "flexures": solid(part.flexures, "notch")})
        for name, part in mechanism.substructures.items()
    }
    found = with_solid_parts(mechanism.model_copy(update={"substructures": substructures}), size=1.6)
    corrected = fx.modes(mechanism.model_copy(update={"corrections": "auto"}), n=6).frequency_hz
    hz = fx.modes(found, n=6).frequency_hz
    np.testing.assert_allclose(hz, corrected, rtol=0.015)
    assert fx.reduce(found, keep=2).order <= 100
    assert hz[0] > 1.05 * fx.modes(mechanism, n=1).frequency_hz[0]


def test_refusals():
    with pytest.raises(OptionError, match="no mesh is fine enough; faces: rigid"):
        notch = fx.describe.Notch(width=5e-3, contour=fx.describe.CircularContour(radius=5e-3, web=1e-3))
        member = leaf_with_block(faces="averaged").flexures["leaf"].model_copy(update={"profile": notch})
        with_solid_parts(leaf_with_block().model_copy(update={"flexures": {"leaf": member}}))
    soft = of_material(fx.describe.Material(E=1e9, nu=0.5, rho=1e3))
    with pytest.raises(OptionError, match=r"too near 0\.5"):
        with_solid_parts(soft)
    with pytest.raises(OptionError, match="keep"):
        with_solid_parts(leaf_with_block(), keep=-1, size=3.0)
    with pytest.raises(OptionError, match="Mechanism is expected"):
        with_solid_parts("rpr.yaml")
    losses = stepped().flexures
    losses["thin"] = losses["thin"].model_copy(update={"loss_factor": 0.1})
    with pytest.raises(OptionError, match="member thin and those fused with it have different loss factors"):
        with_solid_parts(stepped().model_copy(update={"flexures": losses}), size=3.0)
    taken = with_solid_parts(leaf_with_block()).superelements
    with pytest.raises(ModelError, match="name of a solid member"):
        with_solid_parts(leaf_with_block().model_copy(update={"superelements": taken}))


def test_command_line(tmp_path, capsys, monkeypatch):
    path = tmp_path / "leaf.yaml"
    fx.save(leaf_with_block(), path)
    assert "fidelity: solid" in path.read_text(encoding="utf-8")
    monkeypatch.setattr("sys.argv", ["flexura", "modes", str(path), "--json", "-n", "4"])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code in (0, None)
    hz = [mode["frequency_hz"] for mode in json.loads(capsys.readouterr().out)["modes"]]
    np.testing.assert_allclose(hz, BLOCK_HZ, rtol=0.02)


def test_interrupted_work_leaves_nothing_half_done():
    told = []

    def stop(at):
        text = str(at)
        told.append(text)
        if text.endswith("constraint modes"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        with_solid_parts(leaf_with_block(), size=3.0, progress=stop)
    folder = cache_folder()
    assert folder is not None
    assert not folder.exists() or not list(folder.iterdir())
    assert [text.split(": ")[-1] for text in told][::2] == ["mesh", "factorisation"]
    assert all(text.startswith("solid of leaf, size 3") for text in told)
