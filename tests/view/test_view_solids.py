"""Solids stand where the description puts them, have its sections, and move with the nodes."""

import numpy as np
import pytest

from flexura.errors import OptionError
from flexura.expressions import parameter
from flexura.full_order import assemble
from flexura.mechanism import (
    Box,
    Circle,
    CircularContour,
    Cylinder,
    Dashpot,
    DiagonalDamping,
    DiagonalStiffness,
    Flexure,
    Instance,
    Leaf,
    LinearPattern,
    Link,
    Mechanism,
    MirrorPattern,
    Notch,
    Parameter,
    Plate,
    PointMass,
    Rectangle,
    RigidBody,
    Rotation,
    RoundNotch,
    SectionConstants,
    Spring,
    Stop,
    Substructure,
    Superelement,
    Support,
    Tube,
    TwoAxisNotch,
)
from flexura.view import Kind, draw_mechanism, solids
from flexura.view.drawing.painting import MODE_SIZE, MOST_TURN, mode_scale
from flexura.view.scene.discrete_elements import body_mesh, equivalent_box
from flexura.view.scene.meshes import box, cylinder, normals, sphere
from flexura.view.scene.solids import PICTURE

AL = "Al-7075-T6"
L = 0.04


def one_member(member, **more):
    kind = "flexures" if isinstance(member, Flexure) else "links"
    parts = {"nodes": {"a": (0, 0, 0), "b": (L, 0, 0)}, kind: {"m": member}, "ground": {"a": "clamped"}}
    return Mechanism(**(parts | more))


def leaf(profile, **more):
    return Flexure(nodes=("a", "b"), material=AL, reference="z", profile=profile, **more)


def bar(section, **more):
    reference = None if isinstance(section, Circle | Tube) else "z"
    return Link(nodes=("a", "b"), material=AL, reference=reference, section=section, **more)


def of_kind(parts, *kinds):
    """Points of the faces of some kinds."""
    return parts.points[np.unique(parts.faces[np.isin(parts.face_kinds, kinds)])]


def volume(points, faces):
    """Enclosed volume by the divergence theorem; negative when faces look inwards."""
    return float(np.einsum("ij,ij->", points[faces].mean(axis=1), normals(points, faces)) / 6)


def menagerie():
    """One of everything, with offsets, mirror images and rotated frames."""
    eye = np.eye(6) * [1e5, 1e5, 1e5, 10, 10, 10]
    K = np.block([[eye, -eye], [-eye, eye]])
    notch = Notch(width=0.006, contour=CircularContour(radius=0.003, web=0.0005))
    arm = Substructure(
        nodes={"p": (0.02, 0.01, 0), "q": (0.024, 0.012, 0.001), "r": (0.05, 0.02, 0.01)},
        flexures={
            "h": Flexure(nodes=("p", "q"), material=AL, reference="y", profile=notch, end_offset=(0.0, 0.001, 0.0))
        },
        links={"l": Link(nodes=("q", "r"), material=AL, section=Tube(outer_diameter=0.004, inner_diameter=0.003))},
        masses={"m": PointMass(node="r", mass=0.01, offset=(0.002, 0.004, 0.001))},
        interface=("p", "r"),
    )
    return Mechanism(
        substructures={"arm": arm},
        instances={"arm": Instance(of="arm", rotate=Rotation(axis="z", angle=0.3), pattern=MirrorPattern(normal="x"))},
        nodes={"s": (0, 0, 0.03)},
        bodies={
            "base": RigidBody(
                centre=(0, 0.02, 0), carries=("arm*.p",), solid=Box(size=(0.02, 0.01, 0.01), material=AL)
            ),
            "top": RigidBody(centre=(0, 0, 0.02), mass=0.1, inertia=(2e-6, 3e-6, 4e-6, 1e-6, 0, 0), carries=("s",)),
        },
        superelements={"se": Superelement(nodes=("base", "s"), stiffness=K.tolist(), mass=np.eye(12).tolist())},
        springs={"k": Spring(nodes=("arm1.r", "s"), stiffness=DiagonalStiffness(tx=1e4))},
    )


def test_a_leaf_fills_its_length_width_and_thickness():
    parts = solids(assemble(one_member(leaf(Leaf(width=0.01, thickness=0.0005)))))
    x = of_kind(parts, Kind.FLEXURE)
    np.testing.assert_allclose(x.min(axis=0), [0, -0.005, -0.00025], atol=1e-12)
    np.testing.assert_allclose(x.max(axis=0), [L, 0.005, 0.00025], atol=1e-12)


def test_a_circular_notch_follows_its_contour():
    R, web = 0.003, 0.0006
    ends = {"nodes": {"a": (0, 0, 0), "b": (2 * R, 0, 0)}}
    notch = leaf(Notch(width=0.008, contour=CircularContour(radius=R, web=web)))
    x = of_kind(solids(assemble(one_member(notch, **ends))), Kind.FLEXURE)
    surface = x[np.abs(x[:, 2]) > 1e-9]
    expected = web / 2 + R - np.sqrt(np.maximum(R**2 - (surface[:, 0] - R) ** 2, 0))
    np.testing.assert_allclose(np.abs(surface[:, 2]), expected, atol=1e-9)
    assert np.abs(surface[:, 2]).min() == pytest.approx(web / 2)
    assert np.ptp(x[:, 1]) == pytest.approx(0.008)


def test_a_two_axis_notch_narrows_in_one_direction_after_the_other():
    contour = CircularContour(radius=0.01, web=0.002)
    profile = TwoAxisNotch(y_contour=contour, z_contour=contour, shift=0.02)
    x = of_kind(solids(assemble(one_member(leaf(profile)))), Kind.FLEXURE)
    near, far = (x[np.abs(x[:, 0] - at) < 2e-4] for at in (0.01, 0.03))
    assert np.ptp(near[:, 1]) == pytest.approx(0.002, rel=0.02)
    assert np.ptp(near[:, 2]) == pytest.approx(0.022, rel=0.02)
    assert np.ptp(far[:, 2]) == pytest.approx(0.002, rel=0.02)


@pytest.mark.parametrize(
    ("member", "outer", "inner"),
    [
        (bar(Circle(diameter=0.006)), 0.003, 0.0),
        (bar(Tube(outer_diameter=0.006, inner_diameter=0.004)), 0.003, 0.002),
        (bar(SectionConstants(A=np.pi * 9e-6, Iy=1e-10, Iz=2e-10, J=1e-10)), 0.003, 0.0),
        (leaf(RoundNotch(contour=CircularContour(radius=0.02, web=0.001))), 0.0205, 0.0),
    ],
)
def test_round_sections_have_their_radii(member, outer, inner):
    x = of_kind(solids(assemble(one_member(member))), Kind.LINK, Kind.FLEXURE)
    radius = np.hypot(x[:, 1], x[:, 2])
    assert radius.max() == pytest.approx(outer)
    assert radius.min() == pytest.approx(inner, abs=1e-12)


def bar_volume(section, area):
    parts = solids(assemble(one_member(bar(section))))
    return volume(parts.points, parts.faces[parts.face_kinds == Kind.LINK]) / (area * L)


def test_members_are_closed_and_look_outwards():
    assert bar_volume(Rectangle(width=0.01, thickness=0.004), 4e-5) == pytest.approx(1)
    assert bar_volume(Circle(diameter=0.006), np.pi * 9e-6) == pytest.approx(1, abs=0.02)
    tube = Tube(outer_diameter=0.006, inner_diameter=0.004)
    assert bar_volume(tube, np.pi * 5e-6) == pytest.approx(1, abs=0.02)


def test_primitives_are_closed_and_look_outwards():
    assert volume(*box(np.array([1.0, 2.0, 3.0]), 0.5)) == pytest.approx(6)
    assert volume(*cylinder(2.0, 3.0, np.array([1.0, 2.0, 2.0]), 0.5)) == pytest.approx(3 * np.pi, rel=0.01)
    assert volume(*sphere(1.0)) == pytest.approx(4 / 3 * np.pi, rel=0.05)


def test_a_mirror_image_is_the_mirror_image_and_looks_outwards():
    sub = Substructure(
        nodes={"a": (0.01, 0, 0), "b": (0.03, 0.01, 0.005)},
        links={
            "l": Link(nodes=("a", "b"), material=AL, reference="z", section=Rectangle(width=0.004, thickness=0.002))
        },
        bodies={
            "m": RigidBody(centre=(0.03, 0.01, 0.005), carries=("b",), solid=Box(size=(0.01, 0.02, 0.03), material=AL))
        },
        interface=("a",),
    )
    both = Mechanism(
        substructures={"s": sub},
        instances={"s": Instance(of="s", pattern=MirrorPattern(normal="x"))},
        bodies={"base": RigidBody(carries=("s*.a",), mass=1.0, inertia=(1e-5, 1e-5, 1e-5))},
        ground={"base": "clamped"},
    )
    parts = solids(assemble(both))
    for kind, size in ((Kind.LINK, 8e-6 * np.sqrt(0.02**2 + 0.01**2 + 0.005**2)), (Kind.BODY, 6e-6)):
        assert volume(parts.points, parts.faces[parts.face_kinds == kind]) == pytest.approx(2 * size)
        x = of_kind(parts, kind).round(9)
        assert {tuple(p) for p in x} == {(-p[0] + 0.0, p[1], p[2]) for p in x}


@pytest.mark.parametrize("motion", range(6))
def test_everything_moves_rigidly_with_the_nodes(motion):
    model = assemble(menagerie())
    t, w = np.eye(6)[motion, :3], np.eye(6)[motion, 3:]
    x = model.geometry.positions
    u = np.concatenate([t + np.cross(w, x), np.broadcast_to(w, x.shape)], axis=1)
    parts = solids(model, u)
    assert parts.kinds >= {Kind.FLEXURE, Kind.LINK, Kind.BODY, Kind.SPRING, Kind.MASS, Kind.SUPERELEMENT, Kind.ARM}
    expected = t + np.cross(w, parts.points)
    coil = np.unique(parts.lines[parts.line_kinds == Kind.SPRING])
    others = np.setdiff1d(np.arange(len(parts.points)), coil)
    np.testing.assert_allclose(parts.motions[others], expected[others], atol=1e-12)
    if motion < 3:
        np.testing.assert_allclose(parts.motions, expected, atol=1e-12)


def test_a_member_passes_through_its_nodes():
    model = assemble(one_member(bar(Rectangle(width=0.004, thickness=0.002), elements=3)))
    u = np.random.default_rng(3).normal(size=(model.plan.topology.n_nodes, 6))
    parts = solids(model, u)
    for node, x in enumerate(model.geometry.positions):
        ring = np.unique(parts.faces[parts.face_kinds == Kind.LINK])
        ring = ring[np.abs(parts.points[ring, 0] - x[0]) < 1e-9]
        y = parts.points[ring] - x
        moved = u[node, :3] + np.cross(u[node, 3:], y)
        assert len(ring) >= 4
        np.testing.assert_allclose(parts.motions[ring], moved, atol=1e-9)


def test_a_cantilever_bends_in_its_exact_shape():
    model = assemble(one_member(bar(Rectangle(width=0.004, thickness=0.002), elements=2)))
    x = model.geometry.positions[:, 0]
    u = np.zeros((3, 6))
    u[:, 2], u[:, 4] = x**2 * (3 * L - x), -(6 * L * x - 3 * x**2)
    parts = solids(model, u)
    own = np.unique(parts.faces[parts.face_kinds == Kind.LINK])
    s, z = parts.points[own, 0], parts.points[own, 2]
    np.testing.assert_allclose(parts.motions[own, 2], s**2 * (3 * L - s), atol=1e-12)
    np.testing.assert_allclose(parts.motions[own, 0], -z * (6 * L * s - 3 * s**2), atol=1e-12)


def test_a_solid_body_has_its_size_and_rotation():
    turned = RigidBody(
        solid=Plate(length=0.04, width=0.02, thickness=0.01, material=AL), rotate=Rotation(axis="z", angle=np.pi / 2)
    )
    mesh, kind = body_mesh(turned, 0.01)
    assert kind is Kind.BODY
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), [0.02, 0.04, 0.01])
    mesh, _ = body_mesh(RigidBody(solid=Cylinder(diameter=0.02, length=0.05, axis="x", material=AL)), 0.01)
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), [0.05, 0.02, 0.02], rtol=2e-3)


def test_mass_and_inertia_give_the_box_they_came_from():
    a, m = np.array([0.03, 0.05, 0.02]), 0.4
    inertia = np.diag(m / 12 * ((a**2).sum() - a**2))
    size, axes = equivalent_box(m, inertia)
    np.testing.assert_allclose(size, a)
    np.testing.assert_allclose(axes, np.eye(3))
    Q = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    size, axes = equivalent_box(m, Q @ inertia @ Q.T)
    np.testing.assert_allclose(axes @ np.diag(size**2) @ axes.T, Q @ np.diag(a**2) @ Q.T, atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert np.isfinite(equivalent_box(m, np.diag([1e-5, 1e-5, 9e-5]))[0]).all()


def test_supports_stand_behind_the_ends_they_hold():
    parts = solids(assemble(one_member(bar(Rectangle(width=0.01, thickness=0.004)), ground={"a": "clamped"})))
    wall = of_kind(parts, Kind.CLAMP)
    assert wall[:, 0].max() == pytest.approx(0, abs=1e-9)
    assert np.ptp(wall[:, 1]) > 0.01
    held = Support(fixed=("tx", "ty", "tz", "rx"))
    parts = solids(
        assemble(one_member(bar(Circle(diameter=0.004)), ground={"a": held, "b": Support(fixed=("ty", "tz"))}))
    )
    tips = of_kind(parts, Kind.PARTLY_HELD)
    assert tips[:, 0].min() < 0 and tips[:, 0].max() > L
    assert Kind.CLAMP not in parts.kinds


def test_a_clamped_body_is_drawn_as_ground():
    body = {"b0": RigidBody(carries=("a",), solid=Box(size=(0.01, 0.01, 0.01), material=AL))}
    parts = solids(assemble(one_member(bar(Circle(diameter=0.004)), bodies=body, ground={"b0": "clamped"})))
    assert Kind.BODY not in parts.kinds
    np.testing.assert_allclose(np.ptp(of_kind(parts, Kind.CLAMP), axis=0), 0.01)


def test_a_grounded_spring_starts_at_the_surface_of_its_body_and_its_far_end_stays():
    body = {"m": RigidBody(centre=(L, 0, 0), carries=("b",), solid=Box(size=(0.02, 0.02, 0.02), material=AL))}
    spring = {"s": Spring(nodes=("m",), stiffness=DiagonalStiffness(tz=1e4))}
    model = assemble(one_member(bar(Circle(diameter=0.004)), bodies=body, springs=spring))
    u = np.zeros((model.plan.topology.n_nodes, 6))
    u[:, 2] = 1.0
    parts = solids(model, u)
    coil = np.unique(parts.lines[parts.line_kinds == Kind.SPRING])
    assert np.abs(parts.points[coil, 2]).min() == pytest.approx(0.01)
    far = np.abs(parts.points[coil, 2]).argmax()
    assert parts.motions[coil[far], 2] == 0
    assert parts.motions[coil].max() == pytest.approx(1)


def test_the_piston_of_a_dashpot_moves_with_its_node_and_the_pot_stays():
    dashpot = {"d": Dashpot(nodes=("b",), damping=DiagonalDamping(ty=3.0))}
    model = assemble(one_member(bar(Circle(diameter=0.004)), dashpots=dashpot))
    u = np.zeros((model.plan.topology.n_nodes, 6))
    u[:, 1] = 1.0
    parts = solids(model, u)
    drawn = np.unique(parts.lines[parts.line_kinds == Kind.DASHPOT])
    moved = parts.motions[drawn, 1]
    assert set(moved) == {0.0, 1.0}
    np.testing.assert_allclose(parts.points[drawn, [0]], L, atol=0.05 * L)
    away = np.abs(parts.points[drawn, 1])
    assert away[moved == 1].min() == pytest.approx(0, abs=1e-12) and away[moved == 0].max() == away.max()


def test_the_plate_of_a_stop_stands_a_gap_ahead_and_stays_or_goes_with_the_first_node():
    for nodes, moved in ((("b",), 0.0), (("a", "b"), 1.0)):
        stop = {"s": Stop(nodes=nodes, direction="y", gap=2e-3, stiffness=1e6)}
        model = assemble(one_member(bar(Circle(diameter=0.004)), stops=stop))
        u = np.zeros((model.plan.topology.n_nodes, 6))
        u[model.plan.topology.numbers(["a"])[0], 1] = 1.0
        parts = solids(model, u)
        plate = np.unique(parts.faces[parts.face_kinds == Kind.STOP])
        assert parts.points[plate, 1].min() == pytest.approx(2e-3)
        assert set(parts.motions[plate, 1]) == {moved}


def test_a_dashpot_between_nodes_is_drawn_between_them():
    dashpot = {"d": Dashpot(nodes=("a", "b"), damping=DiagonalDamping(ty=3.0))}
    parts = solids(assemble(one_member(bar(Circle(diameter=0.004)), dashpots=dashpot)))
    x = parts.points[np.unique(parts.lines[parts.line_kinds == Kind.DASHPOT]), 0]
    assert (x.min(), x.max()) == (0.0, L)


def test_sizes_follow_parameters():
    sized = one_member(bar(Rectangle(width=parameter("w"), thickness=0.002)), parameters={"w": Parameter(value=0.004)})
    model = assemble(sized, {"w": 0.008})
    assert np.ptp(of_kind(solids(model), Kind.LINK)[:, 1]) == pytest.approx(0.008)
    body = {"m": RigidBody(carries=("b",), centre=(L, 0, 0), solid=Box(size=(parameter("w"), 0.02, 0.02), material=AL))}
    sized = one_member(bar(Circle(diameter=0.002)), bodies=body, parameters={"w": Parameter(value=0.004)})
    assert np.ptp(of_kind(solids(assemble(sized, {"w": 0.03})), Kind.BODY)[:, 0]) == pytest.approx(0.03)


def many(count):
    sub = Substructure(
        nodes={"a": (0, 0, 0), "b": (0, 0, 0.02)},
        flexures={
            "f": Flexure(
                nodes=("a", "b"), reference="x", material=AL, elements=2, profile=Leaf(width=0.004, thickness=0.001)
            )
        },
        interface=("a",),
    )
    pattern = LinearPattern(count=count, step=(0.01, 0, 0))
    base = RigidBody(carries=("s*.a",), mass=1.0, inertia=(1e-3, 1e-3, 1e-3))
    return Mechanism(
        substructures={"s": sub},
        instances={"s": Instance(of="s", pattern=pattern)},
        bodies={"base": base},
        ground={"base": "clamped"},
    )


def test_large_mechanisms_are_drawn_with_less_detail():
    few, more, most = (solids(assemble(many(n))) for n in (3, 400, 3000))
    per_member = [np.sum(p.face_kinds == Kind.FLEXURE) / n for p, n in ((few, 3), (more, 400))]
    assert per_member[0] > per_member[1] > 0
    assert len(more.faces) <= PICTURE.faces
    assert Kind.FLEXURE not in most.face_kinds
    assert Kind.FLEXURE in most.line_kinds


def test_the_largest_motion_becomes_an_eighth_of_the_size_unless_something_turns_far():
    model = assemble(one_member(bar(Circle(diameter=0.004))))
    u = np.zeros((model.plan.topology.n_nodes, 6))
    assert mode_scale(solids(model, u)) == 0
    u[:, 1] = 3.0
    parts = solids(model, u)
    assert mode_scale(parts) * parts.largest_motion() == pytest.approx(MODE_SIZE * parts.size())
    u[:, 3] = 1e9
    assert mode_scale(solids(model, u)) == pytest.approx(MOST_TURN / 1e9)


def test_displacements_of_the_wrong_form_are_refused():
    mechanism = one_member(
        bar(Rectangle(width=parameter("w"), thickness=0.002)), parameters={"w": Parameter(value=0.004)}
    )
    model = assemble(mechanism)
    n = model.plan.topology.n_nodes
    with pytest.raises(OptionError, match=rf"\({n}, 6\)"):
        solids(model, np.zeros((n + 1, 6)))
    with pytest.raises(OptionError, match="finite"):
        solids(model, np.full((n, 6), np.nan))


def test_of_very_many_parts_so_many_are_drawn_and_it_is_said():
    mechanism = many(PICTURE.most + 500)
    sub = mechanism.substructures["s"]
    more = {
        "bodies": {"m": RigidBody(carries=("b",), mass=0.01, inertia=(1e-6, 1e-6, 1e-6))},
        "springs": {"k": Spring(nodes=("b",), stiffness=DiagonalStiffness(tx=1e3))},
    }
    mechanism = mechanism.model_copy(update={"substructures": {"s": sub.model_copy(update=more)}})
    model = assemble(mechanism)
    parts = solids(model)
    count = PICTURE.most + 500
    assert f"{PICTURE.most} of {count} members are drawn" in parts.notes
    told = f"{2 * PICTURE.most + 1} of {2 * count + 1} bodies, masses, springs, dashpots and stops are drawn"
    assert told in parts.notes
    springs = {name for name in parts.names if name.endswith(".k")}
    assert len(springs) == PICTURE.most
    figure = draw_mechanism(model)
    assert f"{PICTURE.most} of {count} members" in " ".join(own.get_text() for own in figure.texts).replace("\n", " ")
