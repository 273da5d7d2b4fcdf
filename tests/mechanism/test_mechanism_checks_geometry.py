"""Checks of geometry, inertia, stiffness and connection: place, rule and hint of each."""

from __future__ import annotations

import math

from flexura.mechanism import (
    CircularContour,
    CircularPattern,
    CornerFilletedContour,
    Instance,
    Leaf,
    Mechanism,
    Notch,
    Parameter,
    PointMass,
    RigidBody,
    RoundNotch,
    Spring,
    Substructure,
    TabulatedContour,
    TwoAxisNotch,
    VShapedContour,
)
from flexura.mechanism.checks import problems
from helpers.mechanism_samples import (
    A_TO_B,
    BAR,
    CLAMPED,
    UNIT_BODY,
    flexure,
    inside,
    link,
    mechanism,
    only,
    t,
    with_flexure,
    with_parameter,
)
from helpers.over import over

CASES = {
    "no length": (mechanism(nodes={"b": (0, 0, 0)}), "links.beam.nodes", "the member has no length", "offsets"),
    "no length by offsets": (
        mechanism(links={"beam": link(end_offset=(-0.1, 0, 0))}),
        "links.beam.nodes",
        "the member has no length",
        "",
    ),
    "no length by parameters": (
        with_parameter(0.0, nodes={"b": (t, 0, 0)}),
        "links.beam.nodes",
        "the member has no length",
        "",
    ),
    "no reference": (
        mechanism(links={"beam": link(section=BAR)}),
        "links.beam.reference",
        "required for a section that is not round",
        "",
    ),
    "no reference for a named section": (
        mechanism(links={"beam": link(section="bar")}, sections={"bar": BAR}),
        *("links.beam.reference", "required", ""),
    ),
    "parallel reference": (
        mechanism(links={"beam": link(section=BAR, reference=(-2, 1e-9, 0))}),
        "links.beam.reference",
        "parallel to the axis",
        "",
    ),
    "small radius": (
        with_flexure(Notch(width=1e-2, contour=CircularContour(radius=0.04, web=1e-3))),
        "flexures.f.profile.contour.radius",
        "at least half the length of the notch, 50 mm",
        "corner_filleted",
    ),
    "large fillet": (
        with_flexure(RoundNotch(contour=CornerFilletedContour(fillet_radius=0.06, web=1e-3)), reference=None),
        "flexures.f.profile.contour.fillet_radius",
        "at most half its length, 50 mm",
        "",
    ),
    "shift": (
        with_flexure(
            TwoAxisNotch(
                y_contour=CircularContour(radius=1, web=1), z_contour=CircularContour(radius=1, web=1), shift=-0.1
            )
        ),
        *("flexures.f.profile.shift", "less than the member's length", ""),
    ),
    "contour of a shifted notch": (
        with_flexure(
            TwoAxisNotch(
                y_contour=CircularContour(radius=0.02, web=1), z_contour=CircularContour(radius=0.03, web=1), shift=0.05
            )
        ),
        *("flexures.f.profile.y_contour.radius", "the notch, 25 mm", ""),
    ),
    "table": (
        with_flexure(Notch(width=1, contour=TabulatedContour(positions=(0, 0.09), thicknesses=(1, 1)))),
        *("flexures.f.profile.contour.positions", "from 0 to the length of the notch, 100 mm", ""),
    ),
    "table that does not increase": (
        mechanism(
            parameters={"t": Parameter(value=0)},
            links={},
            flexures={
                "f": flexure(Notch(width=1, contour=TabulatedContour(positions=(0, t, 0.1), thicknesses=(1, 1, 1))))
            },
        ),
        *("flexures.f.profile.contour", "positions of a table increase", ""),
    ),
    "steep flanks": (
        with_flexure(Notch(width=1, contour=VShapedContour(angle=math.pi / 2, root_radius=0, web=1))),
        *("flexures.f.profile.contour.angle", "less than 90 deg", ""),
    ),
    "inertia": (
        mechanism(bodies={"x": RigidBody(mass=1, inertia=(1, 1, -1), carries=("b",))}),
        "bodies.x.inertia",
        "positive definite",
        "Ixx",
    ),
    "products of inertia": (
        mechanism(bodies={"x": RigidBody(mass=1, inertia=(1, 1, 1, 2, 0, 0), carries=("b",))}),
        "bodies.x.inertia",
        "positive definite",
        "",
    ),
    "triangle inequality": (
        mechanism(masses={"m": PointMass(node="b", mass=1, inertia=(1, 1, 2.1))}),
        "masses.m.inertia",
        "larger than the sum of the other two",
        "",
    ),
    "asymmetric spring": (
        mechanism(
            springs={
                "k": Spring(
                    nodes=("b",), matrix=tuple(tuple(1.0 + (i == 0 and j == 1) for j in range(6)) for i in range(6))
                )
            }
        ),
        *("springs.k.matrix", "entries (1, 2) and (2, 1) differ", ""),
    ),
    "indefinite spring": (
        mechanism(
            springs={
                "k": Spring(
                    nodes=("b",),
                    matrix=tuple(tuple(float(i == j) + 2 * ({i, j} == {0, 3}) for j in range(6)) for i in range(6)),
                )
            }
        ),
        *("springs.k.matrix", "no negative eigenvalue", ""),
    ),
    "negative spring": (
        mechanism(
            springs={
                "k": Spring(nodes=("b",), matrix=tuple(tuple(-float(i == j == 2) for j in range(6)) for i in range(6)))
            }
        ),
        *("springs.k.matrix", "no negative eigenvalue", ""),
    ),
    "gaping joint": (
        mechanism(nodes={"c": (0.1, 2e-3, 0)}, joints=(("b", "c"),)),
        "joints.0",
        "these are 2 mm apart",
        "a rigid body carries nodes on arms",
    ),
    "held twice": (
        mechanism(ground={"a": CLAMPED, "?": CLAMPED}),
        "ground.?",
        "the node a is already held by a",
        "one support",
    ),
    "empty": (Mechanism(), "mechanism", "nothing here that can move", "at least one"),
    "unused node": (mechanism(nodes={"c": (0, 0, 0)}), "nodes.c", "the node c is used by nothing", "remove it"),
    "unused interface": (
        inside(
            Substructure(nodes={"x": (0, 0, 0)}, interface=("x",)),
            instances={"i": Instance(of="s", pattern=CircularPattern(count=3))},
        ),
        *("instances.i", "the node i1.x is used by nothing, and 2 more", ""),
    ),
    "island": (
        mechanism(
            nodes={"c": (1, 0, 0), "d": (2, 0, 0), "e": (3, 0, 0)},
            links={"beam": link(), "l": link("c", "d"), "m": link("d", "e")},
        ),
        *("nodes.a", "these nodes are not connected to c", "joint"),
    ),
    "loose copies": (
        inside(A_TO_B, instances={"i": Instance(of="s", pattern=CircularPattern(count=3))}, joints=(("a", "i2.a"),)),
        *("instances.i", "disconnected parts: these nodes are not connected to a, and 1 more", ""),
    ),
    "sealed copies": (
        inside(
            A_TO_B.model_copy(update={"interface": ()}),
            links={},
            nodes={},
            bodies={"x": RigidBody(carries=("a", "b"), **UNIT_BODY)},
            instances={"i": Instance(of="s", pattern=CircularPattern(count=3))},
        ),
        *("substructures.s.nodes.a", "disconnected parts", "give the substructure an interface"),
    ),
    "island within a substructure": (
        inside(
            A_TO_B.model_copy(update={"interface": ("a",), "bodies": {"x": RigidBody(**UNIT_BODY)}}),
            instances={"i": Instance(of="s")},
            joints=(("a", "i.a"),),
        ),
        *("substructures.s.bodies.x", "not connected to", ""),
    ),
}


@over("case", CASES)
def test_problem(case):
    described, place, rule, hint = CASES[case]
    problem = only(described)
    assert problem.place == place
    assert rule in problem.rule
    assert hint in problem.hint


def test_nothing_is_wrong_with_good_ones():
    assert problems(mechanism()) == []
    assert problems(with_flexure(Leaf(width=1e-2, thickness=1e-3))) == []
    ungrounded = mechanism(ground={}, bodies={"ball": RigidBody(carries=("b",), **UNIT_BODY)})
    assert problems(ungrounded) == []


def test_a_member_far_smaller_than_the_mechanism_has_a_length():
    """Only the digits of its own ends count, not how far others are."""
    far = mechanism(nodes={"far": (9e8, 0, 0)}, masses={"m": PointMass(node="far", mass=1.0)})
    assert not any("no length" in problem.rule for problem in problems(far))
    there = mechanism(nodes={"a": (9e8, 0, 0), "b": (9e8 + 1e-8, 0, 0)})
    assert any("no length" in problem.rule for problem in problems(there))
