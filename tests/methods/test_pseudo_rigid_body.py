"""The pseudo-rigid-body model against closed forms, published rigid stages, and its limits of the full-order model."""

from pathlib import Path

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

import flexura as fx
from flexura.beam import rigid_arm
from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.mechanism import (
    Box,
    Flexure,
    Leaf,
    Link,
    Material,
    Mechanism,
    Rectangle,
    RigidBody,
    Support,
    with_rigid_bodies,
)
from flexura.methods.discrete_models import pseudo_rigid_body, pseudo_rigid_body_model
from helpers.stages import EI, INERTIA, RHO, STAGE_MASS, B, L, T, guide, hertz, leaf, on_leaves, pivot

EXAMPLES = ("guide", "pivot", "xy_stage", "amplifier", "rpr", "tip_tilt")


def load(name):
    """An example, in steps where it is tapered: the pseudo-rigid-body model integrates tapers in steps of its own."""
    text = (Path(__file__).parents[2] / "examples" / name / f"{name}.yaml").read_text()
    return with_rigid_bodies(fx.loads(text.replace("integration: tapered", "integration: stepped")))


def test_parallel_leaf_guide():
    """12 E I/L^3 for each leaf, and the carriage's mass."""
    found = pseudo_rigid_body(assemble(guide()), 1)
    assert found.order == 6
    assert found.frequency_hz[0] == pytest.approx(hertz(24 * EI / L**3, STAGE_MASS), rel=1e-7)


def test_half_of_a_flexure_moves_with_either_end():
    """Two leaves lend the carriage one leaf's mass in translation; along y nothing couples with it."""
    model = pseudo_rigid_body_model(assemble(guide(RHO)))
    own = RHO * L * B * T
    assert model.M.toarray()[1, 1] == pytest.approx(STAGE_MASS + own, rel=1e-12)
    # about z: halves at 25 mm from the middle, and their own inertia about a parallel axis
    about_z = INERTIA[2] + own * (25e-3**2 + (B**2 + T**2) / 12)
    assert model.M.toarray()[5, 5] == pytest.approx(about_z, rel=1e-12)


def test_cross_pivot():
    """A moment bends each leaf to a circle about the crossing: E I/L per leaf."""
    found = pseudo_rigid_body(assemble(pivot()), 1)
    assert found.frequency_hz[0] == pytest.approx(hertz(2 * EI / L, INERTIA[1]), rel=1e-7)


UM = 1e-6


def stage_on_blades(blades, E, G, stage, size, centre, elements):
    """Describe a box on blades (ground end, stage end, direction of the thickness, width, thickness) without weight."""
    nodes, flexures = {}, {}
    for k, (ground, end, thin, b, t) in enumerate(blades):
        nodes |= {f"g{k}": ground, f"e{k}": end}
        profile = Leaf(width=b, thickness=t)
        own = {"nodes": (f"g{k}", f"e{k}"), "material": "blade", "reference": thin, "profile": profile}
        flexures[f"blade{k}"] = Flexure(**own, elements=elements)
    metals = {"blade": Material(E=E, G=G, rho=1e-6), "stage": Material(E=E, G=G, rho=stage)}
    body = RigidBody(centre=centre, carries=("e*",), solid=Box(size=size, material="stage"), elastic=False)
    return Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials=metals,
        nodes=nodes,
        flexures=flexures,
        bodies={"stage": body},
        ground={"g*": "clamped"},
    )


@pytest.mark.parametrize("elements", [1, 5])
def test_stage_on_four_blades(elements):
    """P. Siva, C294A_Micromirror_Design (UCLA MAE C294A): data of the script; figures by its screw theory, to which the
    report's 33 400 and 1 081 600 rad/s are rounded."""
    blades = [
        ((1500 * UM, 0, -5 * UM), (1500 * UM, 1000 * UM, -5 * UM), "z", 1e-3, 1e-5),
        ((0, 1500 * UM, -195 * UM), (1000 * UM, 1500 * UM, -195 * UM), "z", 1e-3, 1e-5),
        ((1500 * UM, 3000 * UM, -5 * UM), (1500 * UM, 2000 * UM, -5 * UM), "z", 1e-3, 1e-5),
        ((3000 * UM, 1500 * UM, -195 * UM), (2000 * UM, 1500 * UM, -195 * UM), "z", 1e-3, 1e-5),
    ]
    centre = (1500 * UM, 1500 * UM, -100 * UM)
    mirror = stage_on_blades(blades, 130e9, 50e9, 2330.0, (1e-3, 1e-3, 0.2e-3), centre, elements)
    screw = [5316.537055, 172138.529136, 172138.529136, 531653.705453, 531653.705453, 1355456.309]
    found = pseudo_rigid_body(assemble(mirror), 6)
    np.testing.assert_allclose(found.frequency_hz, screw, rtol=1e-6)
    np.testing.assert_allclose(2 * np.pi * found.frequency_hz[:2], [33_400, 1_081_600], rtol=2e-3)


def test_stage_on_blade_and_wire():
    """Data of a homework of the course on flexure systems by J. B. Hopkins (UCLA MAE 294; script by Yuan Hung Lo);
    figures by its screw theory."""
    blades = [
        ((0.09875, 0.05, 0.025), (0.09875, 0.2, 0.025), "x", 0.05, 0.0025),
        ((0.00125, 0.05, 0.04875), (0.00125, 0.2, 0.04875), "x", 0.0025, 0.0025),
    ]
    stage = stage_on_blades(blades, 68e9, 25e9, 2698.9, (0.1, 0.05, 0.05), (0.05, 0.225, 0.025), 1)
    screw = [147.551476, 156.140564, 2040.803677, 3499.165575, 16655.45069, 17267.827627]
    found = pseudo_rigid_body(assemble(stage), 6)
    np.testing.assert_allclose(2 * np.pi * found.frequency_hz, screw, rtol=1e-6)


@pytest.mark.parametrize(("name", "order"), [("guide", 6), ("pivot", 6), ("xy_stage", 30), ("amplifier", 42)])
def test_order_is_six_for_every_free_body(name, order):
    """One carriage; one arm; a table and four blocks; output, two blocks and an arm in each quarter."""
    found = pseudo_rigid_body(assemble(load(name)), 1)
    assert found.order == order
    assert f"{order // 6} rigid bod" in found.note


def test_supports_take_their_dofs():
    """A carriage that may only move along x and turn about y."""
    ground = {"g*": Support(fixed=fx.describe.DOF_NAMES), "stage": Support(fixed=("ty", "tz", "rx", "rz"))}
    held = guide().model_copy(update={"ground": ground})
    found = pseudo_rigid_body(assemble(held), 6)
    assert found.order == 2
    assert found.frequency_hz[0] == pytest.approx(hertz(24 * EI / L**3, STAGE_MASS), rel=1e-7)


@pytest.mark.parametrize("name", ["guide", "pivot", "xy_stage"])
def test_static_compliance_of_the_bodies_is_exact(name):
    """Without links the model is the full-order one condensed to its bodies."""
    full, own = assemble(load(name)), pseudo_rigid_body_model(assemble(load(name)))
    force = np.zeros((full.order, 6))
    body = [k for k, dof in enumerate(full.dof_names) if dof.rsplit(".", 1)[0] in full.plan.mechanism.bodies]
    force[body[:6]] = np.eye(6)
    exact = spsolve(full.K, force)
    reduced = own.recovery @ spsolve(own.K, own.recovery.T @ force)
    for column, reference in zip(reduced.T, exact.T, strict=True):
        assert np.abs(column - reference).max() <= 1e-7 * np.abs(reference).max()


@pytest.mark.parametrize("name", EXAMPLES)
def test_ungrounded_it_moves_and_weighs_as_a_whole(name):
    """Rigid motions strain nothing and have the full-order model's mass and inertia, halves of flexures included."""
    full = assemble(load(name).model_copy(update={"ground": {}}))
    own = pseudo_rigid_body_model(full)
    rigid = full.rigid_body_motions()
    motions = rigid_arm(full.geometry.positions[own.bodies.reference]).reshape(-1, 6)
    np.testing.assert_allclose(own.recovery @ motions, rigid, atol=1e-12)
    mass = rigid.T @ (full.M @ rigid)
    scale = np.sqrt(np.outer(np.diag(mass), np.diag(mass)))
    assert (np.abs(motions.T @ (own.M @ motions) - mass) <= 1e-10 * scale).all()
    d = np.sqrt(own.K.diagonal())[:, None]
    if name != "xy_stage":  # which has springs to ground
        assert np.abs((own.K @ motions) / d).max() <= 1e-7 * np.abs(d * motions).max()


def test_it_is_the_limit_of_rigid_links_and_light_flexures():
    """The amplifier has offsets, mirror images, a loop, a spring; arms of a metal 10^4 times as stiff, rigid roots."""
    amplifier = load("amplifier")
    metal = amplifier.material("aluminium")
    quarter = amplifier.substructures["quarter"]
    light = {k: v.model_copy(update={"material": "light", "root": "rigid"}) for k, v in quarter.flexures.items()}
    stiff = {k: v.model_copy(update={"material": "stiff", "root": "rigid"}) for k, v in quarter.links.items()}
    limit = amplifier.model_copy(
        update={
            "materials": {
                "aluminium": metal,
                "light": metal.model_copy(update={"rho": 1e-3}),
                "stiff": metal.model_copy(update={"E": 1e4 * metal.E}),
            },
            "substructures": {"quarter": quarter.model_copy(update={"flexures": light, "links": stiff})},
        }
    )
    full = assemble(limit)
    exact = np.sqrt(lowest(full.K, full.M, 8).values) / (2 * np.pi)
    found = pseudo_rigid_body(full, 8)
    np.testing.assert_allclose(found.frequency_hz, exact, rtol=2e-5)
    shapes = full.node_displacements(lowest(full.K, full.M, 8).vectors)
    for k in range(8):
        a, b = shapes[..., k].ravel(), found.shapes[..., k].ravel()
        assert abs(a @ b) == pytest.approx(np.linalg.norm(a) * np.linalg.norm(b), rel=1e-4)


def test_links_as_compliant_as_flexures_are_springs():
    """In the paper's amplifiers the leaves are links, 32 of them; thick arms and input blocks stay rigid."""
    full = assemble(load("rpr"), {"arm_thickness": 8e-3})
    found = pseudo_rigid_body(full, 6)
    assert found.order == 6 * (4 * 8 + 1)
    assert "32 of them links" in found.note and "24 links taken as rigid" in found.note
    exact = np.sqrt(lowest(full.K, full.M, 6).values) / (2 * np.pi)
    np.testing.assert_allclose(found.frequency_hz, exact, rtol=1e-3)


def beam(**more):
    section = Rectangle(width=4e-3, thickness=3e-3)
    return Mechanism(
        materials={"metal": Material(E=70e9, nu=0.3, rho=2700.0)},
        nodes={"a": (0, 0, 0), "b": (0.1, 0, 0)},
        links={"bar": Link(nodes=("a", "b"), material="metal", section=section, reference="z")},
        **more,
    )


def test_links_alone_are_refused():
    with pytest.raises(fx.OptionError, match="describe its compliant members as flexures"):
        pseudo_rigid_body(assemble(beam(ground={"a": "clamped"})), 3)


def test_rigid_links_that_tie_everything_to_ground_are_refused():
    spring = {"tip": fx.describe.Spring(nodes=("b",), stiffness=fx.describe.DiagonalStiffness(tz=1e3))}
    with pytest.raises(fx.OptionError, match="nothing in this mechanism can move"):
        pseudo_rigid_body(assemble(beam(ground={"a": "clamped"}, springs=spring)), 3)


def test_a_rigid_bar_on_a_hinge_and_a_spring():
    """A bar that turns about y at one end, held by a spring at the other: f = sqrt(k L^2/(m L^2/3))/2 pi, slender."""
    spring = {"tip": fx.describe.Spring(nodes=("b",), stiffness=fx.describe.DiagonalStiffness(tz=1e3))}
    hinge = {"a": Support(fixed=("tx", "ty", "tz", "rx", "rz"))}
    found = pseudo_rigid_body(assemble(beam(ground=hinge, springs=spring, theory="euler_bernoulli")), 3)
    assert found.order == 1
    mass = 2700 * 0.1 * 4e-3 * 3e-3
    assert found.frequency_hz[0] == pytest.approx(hertz(1e3, mass / 3), rel=1e-9)


def test_partly_held_bars_share_their_supports():
    """The bar held along z at both ends keeps four motions, whichever node its displacement is that of."""
    ends = {"a": Support(fixed=("tx", "ty", "tz")), "b": Support(fixed=("tz",))}
    soft = {"k": fx.describe.Spring(nodes=("b",), stiffness=fx.describe.DiagonalStiffness(ty=1e3, rx=1.0))}
    found = pseudo_rigid_body_model(assemble(beam(ground=ends, springs=soft)))
    assert found.K.shape == (2, 2)
    moved = found.recovery.toarray()
    names = assemble(beam(ground=ends, springs=soft)).dof_names
    assert np.abs(moved[names.index("b.ry")]).max() <= 1e-12


def test_three_leaves():
    """A third leaf stiffens the guide by half."""
    nodes = {f"{end}{k}": (x, 0.0, z) for end, z in (("g", 0.0), ("e", L)) for k, x in enumerate((-25e-3, 0, 25e-3))}
    leaves = {f"leaf{k}": leaf((f"g{k}", f"e{k}"), "x") for k in range(3)}
    found = pseudo_rigid_body(assemble(on_leaves(nodes, leaves, (0.0, 0.0, L / 2))), 1)
    assert found.frequency_hz[0] == pytest.approx(hertz(36 * EI / L**3, STAGE_MASS), rel=1e-7)


def test_a_superelement_is_a_spring_with_mass():
    """Six springs k between a foot and a head, and a third of nothing but mass at the head."""
    k, m = np.diag([1e3, 2e3, 3e3, 4.0, 5.0, 6.0]), np.diag([0.2] * 3 + [1e-4] * 3)
    part = fx.describe.Superelement(
        nodes=("foot", "head"), stiffness=np.block([[k, -k], [-k, k]]), mass=np.block([[0 * m, 0 * m], [0 * m, m]])
    )
    mechanism = Mechanism(
        nodes={"foot": (0, 0, 0), "head": (0, 0, 0)}, superelements={"part": part}, ground={"foot": "clamped"}
    )
    found = pseudo_rigid_body(assemble(mechanism), 6)
    expected = np.sort(np.sqrt(np.diag(k) / np.diag(m))) / (2 * np.pi)
    np.testing.assert_allclose(found.frequency_hz, expected, rtol=1e-9)
