"""Checks of values and of names: place, rule and hint of each."""

from __future__ import annotations

import numpy as np

from flexura.expressions import parameter
from flexura.mechanism import (
    Box,
    Circle,
    CircularPattern,
    Instance,
    LinearPattern,
    Material,
    Parameter,
    PointMass,
    RigidBody,
    Spring,
    Substructure,
    Superelement,
    Tube,
)
from flexura.mechanism.checks import problems
from helpers.mechanism_samples import (
    A_TO_B,
    BAR,
    CLAMPED,
    UNIT_BODY,
    inside,
    link,
    mechanism,
    only,
    t,
    with_parameter,
)
from helpers.over import over

CASES = {
    "undefined parameter": (
        with_parameter(nodes={"b": (0.1, parameter("tt") * 0, 0)}),
        *("nodes.b.1", "parameter 'tt' is not defined", "did you mean t?"),
    ),
    "unit that stands alone": (
        with_parameter(nodes={"b": (0.1, t / parameter("m"), 0)}),
        *("nodes.b.1", "parameter 'm' is not defined", "right behind its number, e.g. 2700 kg/m^3"),
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
        *("instances", "at most 200 000", ""),
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
}


@over("case", CASES)
def test_problem(case):
    described, place, rule, hint = CASES[case]
    problem = only(described)
    assert problem.place == place
    assert rule in problem.rule
    assert hint in problem.hint


def test_a_node_is_carried_once():
    described = mechanism(
        bodies={"x": RigidBody(carries=("a", "b"), **UNIT_BODY), "yy": RigidBody(carries=("[ab]*",), **UNIT_BODY)},
        links={},
        nodes={"long": (0, 0, 0)},
        joints=(("long", "a"),),
    )
    assert [p.rule for p in problems(described) if "already" in p.rule] == [
        f"the node {n} is already carried by body x" for n in "ab"
    ]
