"""Mechanisms that tests start from, and how to look at what is wrong with one."""

from __future__ import annotations

from flexura.errors import Problem
from flexura.expressions import parameter
from flexura.mechanism import Circle, Flexure, Link, Mechanism, Parameter, Rectangle, Substructure, Support
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


A_TO_B = Substructure(nodes={"a": (0, 0, 0), "b": (0.1, 0, 0)}, links={"beam": link()}, interface=("a", "b"))
