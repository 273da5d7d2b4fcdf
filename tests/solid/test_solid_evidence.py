"""Solids against elasticity computed elsewhere and against exact solutions.

Notches: plane stress, nine-node quadrilaterals (scikit-fem 12.0.2, 24 elements over half the height, 170 along half the
length) between long straight ends whose share as beams is taken off; E = b = 1. A thin sheet of hexahedra between
straight ends as long as they are high is another element, mesh and program. Its cells make it too stiff, by less than
1 %. The leaves: 27-node hexahedra in an eighth of the leaf (the same program), nu = 0.3.
"""

import numpy as np
import pytest
import scipy.sparse as sp

import flexura as fx
from flexura.fem.components import components
from flexura.fem.geometry import solids
from flexura.fem.matrices import Face, elastic_matrices, face_ties
from flexura.full_order import assemble
from flexura.linalg.factor import factorise_large
from helpers.solid_wholes import solid_mesh

UNIT = {"unit": fx.describe.Material(E=1.0, nu=0.3, rho=1.0)}
WIDTH = 0.05

CIRCULAR = {(4.0, 0.3): (585.0, 10.50), (5.0, 1.0): (33.18, 5.97), (3.0, 0.5): (144.4, 6.66), (2.0, 1.0): (22.00, 3.32)}
"""(R, t): rotation per moment, stretch per force."""

OTHERS = {  # length, contour: rotation per moment, stretch per force
    "parabolic a 5, b 4, t 0.5": (10.0, fx.describe.ParabolicContour(depth=4.0, web=0.5), 149.355, 7.7171),
    "V 45 deg, r 1, t 0.5": (
        8.0,
        fx.describe.VShapedContour(angle=np.pi / 4, root_radius=1.0, web=0.5),
        90.585,
        5.4345,
    ),
    "corner-filleted a 3, r 0.5, t 1": (
        6.0,
        fx.describe.CornerFilletedContour(fillet_radius=0.5, web=1.0),
        71.156,
        6.1483,
    ),
}

LEAVES = {  # L/b, t/b: compliance times EI under a constant moment; torsional stiffness over G J / L
    (1.0, 0.03): (0.9404, 1.887),
    (2.0, 0.1): (0.9676, 1.310),
    (5.0, 1.0): (0.9909, 1.007),
}


def compliance(mechanism, node, mesh_of):
    """Return the displacements (6, 6) of a node under unit forces and moments at it."""
    model = assemble(mechanism)
    (component,) = components(model)
    mesh, numbers = mesh_of(model), model.plan.topology.numbers
    ends = {number: mesh.point_sets[name] for name, number in end_faces(component).items()}
    places = model.geometry.positions
    ties = face_ties(mesh, [Face(points, places[number], k) for k, (number, points) in enumerate(ends.items())])
    b = ties.boundary[6 * list(ends).index(numbers([node])[0]) :][:6]
    keep = np.append(np.arange(len(ties.free)), b)
    K = (ties.T.T @ elastic_matrices(mesh)[0] @ ties.T)[keep][:, keep]
    return factorise_large(sp.csc_matrix(K)).solve(np.eye(len(keep), 6, -len(ties.free)))[-6:]


def end_faces(component):
    """Return the nodes that the tied faces follow."""
    return {
        f"{component.members[tie.member].name} {('start', 'end')[tie.end]}": component.nodes[tie.node]
        for tie in component.piece.ties
    }


def between_straight_ends(contour, length, end):
    """Describe a narrow notch between straight ends as long as they are high."""
    shared = {"material": "unit", "reference": (0, 0, 1)}
    section = fx.describe.Rectangle(width=WIDTH, thickness=end)
    return fx.Mechanism(
        materials=UNIT,
        nodes={"foot": (0, 0, 0), "a": (end, 0, 0), "b": (end + length, 0, 0), "head": (2 * end + length, 0, 0)},
        links={
            "first": fx.describe.Link(nodes=("foot", "a"), section=section, **shared),
            "last": fx.describe.Link(nodes=("b", "head"), section=section, **shared),
        },
        flexures={
            "hinge": fx.describe.Flexure(
                nodes=("a", "b"), profile=fx.describe.Notch(width=WIDTH, contour=contour), **shared
            )
        },
        ground={"foot": "clamped"},
    )


def check_notch(contour, length, end, rotation, stretch, size=0.6):
    found = WIDTH * compliance(
        between_straight_ends(contour, length, end), "head", lambda model: solid_mesh(model, size)
    )
    assert found[4, 4] - 24 * end / end**3 == pytest.approx(rotation, rel=0.01)
    assert found[0, 0] - 2 == pytest.approx(stretch, rel=0.01)


@pytest.mark.parametrize(("R", "t"), CIRCULAR)
def test_thin_circular_notches_are_those_of_plane_stress(R, t):
    size = 1.5 if t < 0.1 * R else 0.6  # cells are as long as such a web is thick, all through
    check_notch(fx.describe.CircularContour(radius=R, web=t), 2 * R, 2 * R + t, *CIRCULAR[R, t], size)


@pytest.mark.parametrize("name", OTHERS)
def test_thin_notches_are_those_of_plane_stress(name):
    length, contour, rotation, stretch = OTHERS[name]
    profile = fx.describe.Notch(width=WIDTH, contour=contour)
    member = fx.describe.Flexure(nodes=("a", "b"), material="unit", reference=(0, 0, 1), profile=profile)
    alone = assemble(
        fx.Mechanism(
            materials=UNIT,
            nodes={"a": (0, 0, 0), "b": (length, 0, 0)},
            flexures={"hinge": member},
            ground={"a": "clamped"},
        )
    )
    end = 2 * float(solids(alone)[0].outline.z[0])
    check_notch(contour, length, end, rotation, stretch)


@pytest.mark.parametrize(("slenderness", "aspect"), LEAVES)
def test_leaves_with_flat_ends(slenderness, aspect):
    b, t = 1.0, aspect
    member = fx.describe.Flexure(
        nodes=("a", "b"), material="unit", reference=(0, 0, 1), profile=fx.describe.Leaf(width=b, thickness=t)
    )
    mechanism = fx.Mechanism(
        materials=UNIT,
        nodes={"a": (0, 0, 0), "b": (slenderness * b, 0, 0)},
        flexures={"leaf": member},
        ground={"a": "clamped"},
    )
    found = compliance(mechanism, "b", lambda model: solid_mesh(model, 0.7, "leaf"))
    bending, twist = LEAVES[slenderness, aspect]
    L, n = slenderness * b, np.arange(1, 200, 2)
    J = b * t**3 / 3 * (1 - 192 * t / (np.pi**5 * b) * (np.tanh(n * np.pi * b / (2 * t)) / n**5).sum())
    assert found[4, 4] * b * t**3 / 12 / L == pytest.approx(bending, rel=0.01)
    assert L / (found[3, 3] * J / 2.6) == pytest.approx(twist, rel=0.01)
