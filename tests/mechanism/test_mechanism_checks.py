"""What is wrong with a mechanism that was built in Python: place, rule and hint of every check."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from flexura.errors import ModelError, Problem
from flexura.mechanism import (
    Box,
    Circle,
    CircularContour,
    CircularPattern,
    CornerFilletedContour,
    Cylinder,
    Flexure,
    Instance,
    Leaf,
    LinearPattern,
    Link,
    Material,
    Mechanism,
    Notch,
    Parameter,
    PointMass,
    Rectangle,
    RigidBody,
    Rotation,
    RoundNotch,
    Spring,
    Substructure,
    Superelement,
    Support,
    TabulatedContour,
    Tube,
    TwoAxisNotch,
    VShapedContour,
    parameter,
)
from flexura.mechanism.checks import problems

t = parameter("t")
ROUND = Circle(diameter=1e-3)
BAR = Rectangle(width=1e-3, thickness=2e-3)
CLAMPED = Support.model_validate("clamped")
UNIT_BODY = {"mass": 1.0, "inertia": (1.0, 1.0, 1.0)}


def link(a: str = "a", b: str = "b", **keys) -> Link:
    return Link(**{"nodes": (a, b), "material": "silicon", "section": ROUND} | keys)


def flexure(profile, **keys) -> Flexure:
    return Flexure(**{"nodes": ("a", "b"), "material": "silicon", "reference": (0, 0, 1), "profile": profile} | keys)


def mechanism(**keys) -> Mechanism:
    """A beam along x from a to b, 0.1 m long, and what the test adds or replaces."""
    nodes = {"a": (0, 0, 0), "b": (0.1, 0, 0), **keys.pop("nodes", {})}
    return Mechanism(**{"nodes": nodes, "links": {"beam": link()}, "ground": {"a": CLAMPED}} | keys)


def with_parameter(value: float = 0.1, **keys) -> Mechanism:
    return mechanism(parameters={"t": Parameter(value=value)}, **keys)


def with_flexure(profile, **keys) -> Mechanism:
    return mechanism(links={}, flexures={"f": flexure(profile, **keys)})


def inside(substructure: Substructure, **keys) -> Mechanism:
    return mechanism(substructures={"s": substructure}, **keys)


def only(described: Mechanism) -> Problem:
    found = problems(described)
    assert len(found) == 1, "\n".join(map(str, found))
    return found[0]


def test_nothing_is_wrong_with_good_ones():
    assert problems(mechanism()) == []
    assert problems(with_flexure(Leaf(width=1e-2, thickness=1e-3))) == []
    ungrounded = mechanism(ground={}, bodies={"ball": RigidBody(carries=("b",), **UNIT_BODY)})
    assert problems(ungrounded) == []


A_TO_B = Substructure(nodes={"a": (0, 0, 0), "b": (0.1, 0, 0)}, links={"beam": link()}, interface=("a", "b"))

CASES = {
    "undefined parameter": (
        with_parameter(nodes={"b": (0.1, parameter("tt") * 0, 0)}),
        *("nodes.b.1", "parameter 'tt' is not defined", "did you mean t?"),
    ),
    "undefined parameter in an unused substructure": (
        inside(Substructure(nodes={"x": (t, 0, 0)})),
        *("substructures.s.nodes.x.0", "'t' is not defined", "no parameters"),
    ),
    "cycle": (
        mechanism(parameters={"p": Parameter(value=parameter("q")), "q": Parameter(value=2 * parameter("p"))}),
        *("parameters.p.value", "depends on itself: p -> q -> p", ""),
    ),
    "name of a function": (
        mechanism(parameters={"sin": Parameter(value=1)}),
        "parameters.sin",
        "name of a function",
        "",
    ),
    "name of a constant": (mechanism(parameters={"pi": Parameter(value=3)}), "parameters.pi", "name of a constant", ""),
    "no finite parameter": (
        mechanism(parameters={"t": Parameter(value=0), "u": Parameter(value=1 / t)}),
        *("parameters.u.value", "no finite value", ""),
    ),
    "below": (
        mechanism(parameters={"t": Parameter(value=1, minimum=2, unit="m")}),
        *("parameters.t.value", "below the minimum 2 m", ""),
    ),
    "above": (
        mechanism(parameters={"t": Parameter(value=1, maximum=0.5 * t)}),
        *("parameters.t.value", "above the maximum 0.5", ""),
    ),
    "no room": (
        mechanism(parameters={"t": Parameter(value=1, minimum=3, maximum=2)}),
        *("parameters.t.minimum", "minimum 3 is above the maximum 2", ""),
    ),
    "dimension": (
        mechanism(parameters={"t": Parameter(value=0.1, unit="kg")}, nodes={"b": (t, 0, 0)}),
        *("nodes.b.0", "in m; this is in kg", "10 mm"),
    ),
    "dimension of a derived parameter": (
        mechanism(parameters={"t": Parameter(value=1, unit="m"), "u": Parameter(value=t, unit="kg")}),
        *("parameters.u.value", "in kg; this is in m", ""),
    ),
    "sign": (
        with_parameter(links={"beam": link(section=Circle(diameter=t - 0.2))}),
        *("links.beam.section.diameter", "a length must be positive", "default parameters"),
    ),
    "not finite": (
        with_parameter(
            0.0,
            nodes={"c": (1 / t, 0, 0)},
            masses={"m": PointMass(node="c", mass=1)},
            links={"beam": link(), "l": link("b", "c")},
        ),
        *("nodes.c.0", "a length must be finite", ""),
    ),
    "nu": (
        with_parameter(0.6, materials={"own": Material(E=1e9, rho=1e3, nu=t)}),
        *("materials.own", "Poisson's ratio", "default parameters"),
    ),
    "tube": (
        with_parameter(links={"beam": link(section=Tube(outer_diameter=t, inner_diameter=2 * t))}),
        *("links.beam.section", "inner diameter", ""),
    ),
    "null direction": (
        with_parameter(0.0, links={"beam": link(section=BAR, reference=(0, t, 0))}),
        *("links.beam.reference", "not zero", ""),
    ),
    "alias": (
        mechanism(materials={"al": "Al-7075"}),
        "materials.al",
        "the catalogue has no such material",
        "Al-7075-T6",
    ),
    "material": (
        mechanism(links={"beam": link(material="steel")}),
        "links.beam.material",
        "no such material",
        "spring-steel",
    ),
    "material of a solid": (
        mechanism(bodies={"x": RigidBody(solid=Box(size=(1, 1, 1), material="wood"), carries=("b",))}),
        *("bodies.x.solid.material", "no such material", ""),
    ),
    "section": (
        mechanism(links={"beam": link(section="bar")}),
        "links.beam.section",
        "no such section",
        "there are no sections",
    ),
    "substructure": (
        inside(A_TO_B, instances={"i": Instance(of="ss")}),
        "instances.i.of",
        "no such substructure",
        "did you mean s?",
    ),
    "substructure in itself": (
        inside(Substructure(instances={"x": Instance(of="s")})),
        *("substructures.s.instances.x.of", "cannot contain itself", ""),
    ),
    "too many instances": (
        inside(A_TO_B, instances={"i": Instance(of="s", pattern=(LinearPattern(count=100_000, step=(1, 0, 0)),) * 2)}),
        *("instances", "at most 200000", ""),
    ),
    "node of a link": (
        mechanism(links={"beam": link("a", "bb")}, masses={"m": PointMass(node="b", mass=1)}),
        "links.beam.nodes.1",
        "no such node",
        "did you mean b?",
    ),
    "node of a spring": (
        mechanism(springs={"k": Spring(nodes=("c",), stiffness={})}),
        "springs.k.nodes.0",
        "no such node",
        "nodes: a, b",
    ),
    "node of a mass": (mechanism(masses={"m": PointMass(node="*", mass=1)}), "masses.m.node", "no such node", ""),
    "node of a joint": (mechanism(joints=(("a", "c"),)), "joints.0.1", "no such node", ""),
    "node of a body": (
        mechanism(bodies={"x": RigidBody(carries=("b", "c"), **UNIT_BODY)}),
        "bodies.x.carries.1",
        "no such node",
        "",
    ),
    "node of the ground": (mechanism(ground={"a": CLAMPED, "c": CLAMPED}), "ground.c", "no such node", ""),
    "node of an interface": (
        inside(Substructure(interface=("x",))),
        "substructures.s.interface.0",
        "no such node",
        "there are no nodes",
    ),
    "node of a superelement": (
        mechanism(superelements={"e": Superelement(nodes=("b", "c"), stiffness=np.eye(12), mass=np.eye(12))}),
        *("superelements.e.nodes.1", "no such node", ""),
    ),
    "hidden node": (
        inside(Substructure(nodes={"x": (0, 0, 0)}), instances={"i": Instance(of="s")}, joints=(("a", "i.x"),)),
        *("joints.0.1", "no such node", "add x to the interface of substructure s"),
    ),
    "instance for a node": (
        inside(A_TO_B, instances={"i": Instance(of="s")}, joints=(("a", "i"),)),
        "joints.0.1",
        "no such node",
        "i.a, i.b",
    ),
    "pattern": (
        inside(
            A_TO_B,
            instances={"i": Instance(of="s", pattern=LinearPattern(count=2, step=(0, 0, 0)))},
            joints=(("a", "i.a"),),
        ),
        *("joints.0.1", "no such node", "i1.a"),
    ),
    "wildcard": (mechanism(ground={"a": CLAMPED, "x*": CLAMPED}), "ground.x*", "no node matches", ""),
    "node and body": (
        mechanism(bodies={"b": RigidBody(centre=(0.1, 0, 0), **UNIT_BODY)}),
        "bodies.b",
        "the name b is taken by a node",
        "",
    ),
    "body and instance": (
        inside(
            A_TO_B,
            bodies={"i": RigidBody(carries=("b",), **UNIT_BODY)},
            instances={"i": Instance(of="s")},
            joints=(("a", "i.a"),),
        ),
        *("instances.i", "the name i is taken by a body", ""),
    ),
    "copy and node": (
        inside(
            A_TO_B,
            nodes={"i2": (0, 0, 0)},
            joints=(("a", "i1.a"), ("i2", "i2.a"), ("i2", "a")),
            instances={"i": Instance(of="s", pattern=CircularPattern(count=2))},
        ),
        *("instances.i", "its copy i2 is taken by a node", ""),
    ),
    "carried twice": (
        mechanism(
            bodies={"x": RigidBody(carries=("a", "b"), **UNIT_BODY), "yy": RigidBody(carries=("[ab]*",), **UNIT_BODY)},
            links={},
            nodes={"long": (0, 0, 0)},
            joints=(("long", "a"),),
        ),
        *("bodies.yy.carries.0", "", ""),
    ),
    "carries itself": (
        mechanism(bodies={"x": RigidBody(carries=("b", "x"), **UNIT_BODY)}),
        "bodies.x.carries.1",
        "carries its own node",
        "",
    ),
    "in a circle": (
        mechanism(
            bodies={"x": RigidBody(carries=("y", "b"), **UNIT_BODY), "y": RigidBody(carries=("x",), **UNIT_BODY)}
        ),
        *("bodies.x.carries", "carry each other", ""),
    ),
    "one node twice": (
        mechanism(links={"beam": link(), "l": link("b", "b")}),
        "links.l.nodes",
        "the node b is named twice",
        "",
    ),
    "superelement node twice": (
        mechanism(superelements={"e": Superelement(nodes=("b", "b"), stiffness=np.eye(12), mass=np.eye(12))}),
        *("superelements.e.nodes", "the node b is named twice", ""),
    ),
    "joint of one node": (mechanism(joints=(("a", "a"),)), "joints.0", "two different nodes", ""),
    "interface twice": (
        inside(Substructure(nodes={"x": (0, 0, 0)}, interface=("x", "x"))),
        "substructures.s.interface.1",
        "already in the interface",
        "",
    ),
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


@pytest.mark.parametrize("case", CASES)
def test_problem(case):
    described, place, rule, hint = CASES[case]
    if case == "carried twice":
        found = problems(described)
        assert [p.rule for p in found] == [f"the node {n} is already carried by body x" for n in "ab"]
        return
    problem = only(described)
    assert problem.place == place
    assert rule in problem.rule
    assert hint in problem.hint


def test_the_best_of_contours_just_fit():
    table = TabulatedContour(positions=(0, 0.1 * (1 + 1e-12)), thicknesses=(1, 1))
    for contour in (CircularContour(radius=0.05, web=1), CornerFilletedContour(fillet_radius=0.05, web=1), table):
        assert problems(with_flexure(Notch(width=1, contour=contour))) == []


def test_joined_nodes_may_differ_by_rounding():
    third = (0.1 + 0.2 - 0.3) + 0.1
    assert problems(mechanism(nodes={"c": (third, 0, 0)}, joints=(("b", "c"),))) == []
    turned = Instance(of="s", at=(0.1, 0, 0), rotate=Rotation(axis=(1, 2, 3), angle=1.0))
    assert problems(inside(A_TO_B, instances={"i": turned}, joints=(("b", "i.a"),))) == []


def test_singular_springs_and_thin_rods_are_fine():
    spring = Spring(
        nodes=("b",), matrix=tuple(tuple(5.0 if {i, j} <= {0, 4} else 0.0 for j in range(6)) for i in range(6))
    )
    mass = PointMass(node="b", mass=1, inertia=(1e-9, 1, 1))
    assert problems(mechanism(springs={"k": spring}, masses={"m": mass})) == []


def test_cylinders_need_no_reference_and_solids_no_inertia():
    solid = RigidBody(solid=Cylinder(diameter=1, length=1, material="silicon"), carries=("b",))
    assert problems(mechanism(bodies={"x": solid})) == []


def test_connected_inside_is_connected():
    """Interface nodes that nothing uses do no harm when they hang together within."""
    assert (
        problems(inside(A_TO_B, instances={"i": Instance(of="s", at=(0.1, 0, 0))}, joints=(("b", "i.a"),), ground={}))
        == []
    )
    nested = Substructure(
        instances={"x": Instance(of="s"), "y": Instance(of="s", at=(0.1, 0, 0))},
        joints=(("x.b", "y.a"),),
        interface=("x.a",),
    )
    described = mechanism(
        substructures={"s": A_TO_B, "n": nested}, instances={"i": Instance(of="n")}, joints=(("a", "i.x.a"),)
    )
    assert problems(described) == []


def test_what_is_known_to_be_missing_is_not_reported():
    described = mechanism(
        links={"beam": link(material="own"), "l": link("b", "c", section="bar")},
        masses={"m": PointMass(node="i2.x", mass=parameter("q"))},
        instances={"j": Instance(of="gone")},
        joints=(("a", "j.x"), ("b", "k.x")),
    )
    assert len(problems(described)) == 7
    missing = {"own", "c", "bar", "i", "q", "gone", "k"}
    assert problems(described, ignore_missing=missing, partial=True) == []


def test_partial_descriptions_need_not_hang_together():
    described = mechanism(nodes={"c": (0, 0, 0)}, ground={"a": CLAMPED, "x*": CLAMPED})
    assert problems(described, partial=True) == []
    assert problems(Mechanism(), partial=True) == []


def test_one_error_does_not_hide_another():
    broken = with_parameter(
        nodes={"c": (t / 0, 0, 0), "d": (parameter("u"), 0, 0)},
        links={"beam": link(), "x": link("c", "d", section=BAR), "y": link("b", "zz", material="wood")},
        substructures={
            "s": Substructure(instances={"x": Instance(of="r")}),
            "r": Substructure(instances={"y": Instance(of="s"), "z": Instance(of="r")}),
        },
    )
    rules = sorted(p.place for p in problems(broken))
    assert rules == sorted(
        ["nodes.c.0", "nodes.d.0", "links.x.reference", "links.y.nodes.1", "links.y.material"]
        + ["substructures.r.instances.y.of", "substructures.r.instances.z.of"]
    )


def test_extreme_numbers_are_no_reason_to_fail():
    huge = 1e308
    spring = tuple(tuple(huge if i == j else 0.0 for j in range(6)) for i in range(6))
    described = mechanism(
        nodes={"b": (huge, -huge, huge), "c": (-huge, huge, 0)},
        links={"beam": link(), "l": link("b", "c", section=BAR, reference=(huge, huge, 0), start_offset=(huge, 0, 0))},
        springs={"k": Spring(nodes=("b",), matrix=spring)},
        bodies={"x": RigidBody(mass=huge, inertia=(huge, huge, huge), centre=(5e-324, 0, 0), carries=("c",))},
        instances={},
        joints=(("a", "b"),),
    )
    assert all(isinstance(p, Problem) for p in problems(described))
    for scale in (1e308, 1e-320):
        assert Superelement(nodes=("a",), stiffness=np.eye(6) * scale, mass=np.eye(6) * scale)


def test_parts_report_where_and_what():
    with pytest.raises(ModelError) as caught:
        Flexure(
            nodes=("a",), material="silicon", profile={"type": "notch", "width": -1, "contour": {"shape": "circle"}}
        )
    found = {p.place: p.rule for p in caught.value.problems}
    assert found["nodes"] == "a list of 2 entries is expected here"
    assert found["profile.width"] == "a length must be positive"
    assert found["profile.contour"].startswith("shape is one of 'circular'")
    with pytest.raises(ModelError, match="real"):
        Superelement(nodes=("a",), stiffness=1j * np.eye(6), mass=np.eye(6))


def test_thousands_of_copies_are_checked_quickly():
    step = LinearPattern(count=126, step=(0.1, 0, 0)), LinearPattern(count=126, step=(0, 0.1, 0))
    plate = RigidBody(carries=("cell*.a",), **UNIT_BODY)
    described = mechanism(
        substructures={"s": A_TO_B},
        instances={"cell": Instance(of="s", pattern=step)},
        bodies={"plate": plate},
        joints=(("a", "cell1.a"),),
    )
    start = time.perf_counter()
    assert problems(described) == []
    assert time.perf_counter() - start < 2
