"""The numbers of a description, and the values of its parameters over designs."""

from __future__ import annotations

import numpy as np
import pytest

from flexura.errors import ExpressionError, ModelError, OptionError
from flexura.expressions import parameter
from flexura.mechanism import (
    Circle,
    CircularPattern,
    Flexure,
    Instance,
    Link,
    Mechanism,
    Parameter,
    PointMass,
    RigidBody,
    Rotation,
    Spring,
    Substructure,
    TabulatedContour,
    TwoAxisNotch,
    VShapedContour,
)
from flexura.mechanism.evaluation import evaluated, parameter_dimensions, parameter_order, parameter_values, scalars
from flexura.mechanism.layout import Layout, node_positions

t, w = parameter("t"), parameter("w")


def everything() -> Mechanism:
    profile = TwoAxisNotch(
        y_contour=TabulatedContour(positions=(0, t), thicknesses=(t, 2)),
        z_contour=VShapedContour(angle=0.3, root_radius=t, web=1),
        shift=t / 2,
    )
    branch = Substructure(
        nodes={"a": (0, 0, 0), "b": (t, 0, 0)},
        flexures={"f": Flexure(nodes=("a", "b"), material="silicon", reference=(0, t, 1), profile=profile)},
        interface=("b",),
    )
    return Mechanism(
        parameters={"t": Parameter(value=0.5, minimum=0.1), "w": Parameter(value=2 * t)},
        sections={"s": Circle(diameter=w)},
        substructures={"branch": branch},
        links={"l": Link(nodes=("x", "y"), material="silicon", section="s")},
        springs={
            "k": Spring(nodes=("x",), matrix=tuple(tuple(t if i == j else 0 for i in range(6)) for j in range(6)))
        },
        bodies={"body": RigidBody(mass=t, inertia=(1, 2, 2, 0, 0, t))},
        masses={"m": PointMass(node="x", mass=1, inertia=(1, 1, t))},
        instances={
            "i": Instance(
                of="branch", at=(0, 0, t), rotate=Rotation(axis="z", angle=t), pattern=CircularPattern(count=2, step=w)
            )
        },
    )


def test_scalars_are_found_wherever_they_are():
    found = {path: (quantity.kind, value) for path, quantity, value in scalars(everything())}
    expressions = {path for path, (_, value) in found.items() if not isinstance(value, float)}
    flexure = ("substructures", "branch", "flexures", "f")
    assert expressions == {
        ("parameters", "w", "value"),
        ("sections", "s", "diameter"),
        ("substructures", "branch", "nodes", "b", 0),
        (*flexure, "reference", 1),
        (*flexure, "profile", "y_contour", "positions", 1),
        (*flexure, "profile", "y_contour", "thicknesses", 0),
        (*flexure, "profile", "z_contour", "root_radius"),
        (*flexure, "profile", "shift"),
        *(("springs", "k", "matrix", i, i) for i in range(6)),
        ("bodies", "body", "mass"),
        ("bodies", "body", "inertia", 5),
        ("masses", "m", "inertia", 2),
        ("instances", "i", "at", 2),
        ("instances", "i", "rotate", 0, "angle"),
        ("instances", "i", "pattern", 0, "step"),
    }
    assert found["springs", "k", "matrix", 3, 3][0] == "rotational stiffness"
    assert found["springs", "k", "matrix", 0, 3] == ("coupling stiffness", 0.0)
    assert found[(*flexure, "profile", "z_contour", "angle")] == ("angle", 0.3)
    assert found["parameters", "t", "minimum"] == ("quantity", 0.1)
    assert found["bodies", "body", "inertia", 0] == ("moment of inertia", 1.0)


def test_evaluated_parts_hold_numbers_only_and_share_what_has_not_changed():
    mechanism = everything()
    numbers = evaluated(mechanism, {"t": 0.5, "w": 1.0})
    assert all(isinstance(value, float) for _, _, value in scalars(numbers))
    assert numbers.substructures["branch"].nodes["b"] == (0.5, 0.0, 0.0)
    assert numbers.links["l"] is mechanism.links["l"]
    with pytest.raises(ExpressionError, match="'w' is not defined"):
        evaluated(mechanism, {"t": 0.5})


def parameters(**values) -> Mechanism:
    return Mechanism(
        parameters={name: v if isinstance(v, Parameter) else Parameter(value=v) for name, v in values.items()}
    )


def test_values_follow_what_they_depend_on():
    mechanism = parameters(c=parameter("b") * 2, b=parameter("a") + 1, a=3.0)
    assert parameter_values(mechanism) == {"c": 8.0, "b": 4.0, "a": 3.0}
    assert parameter_values(mechanism, {"a": 1}) == {"c": 4.0, "b": 2.0, "a": 1.0}
    assert parameter_values(mechanism, {"b": 1}) == {"c": 2.0, "b": 1.0, "a": 3.0}
    assert list(parameter_values(mechanism)) == ["c", "b", "a"]


def test_values_over_designs():
    mechanism = parameters(a=1.0, b=2.0, c=parameter("a") * parameter("b"))
    values = parameter_values(mechanism, {"a": [1, 2, 3]})
    np.testing.assert_array_equal(values["c"], [2, 4, 6])
    assert values["b"] == 2.0


BOUNDED = parameters(
    a=Parameter(value=1.0, minimum=0.5, maximum=2.0, unit="m"),
    b=Parameter(value=parameter("a") * 2, maximum=3.0),
    free=1.0,
    inverse=1 / parameter("free"),
)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"aa": 1.0}, "'aa' is not a parameter; did you mean 'a'"),
        ({"zzz": 1.0}, "known: a, b"),
        ({"a": 0.4}, "parameter a = 0.4 m is below its minimum 0.5 m"),
        ({"a": [1.0, 2.5, 3.0]}, "parameter a = 2.5 m is above its maximum 2 m"),
        ({"a": 1.8}, "parameter b = 3.6 is above its maximum 3"),
        ({"a": np.nan}, "finite"),
        ({"a": [1.0, np.inf]}, "finite"),
        ({"a": "1 mm"}, "not a number in SI"),
        ({"a": None}, "finite"),
        ({"a": [[1.0]]}, "one axis"),
        ({"a": [1.0, 1.1], "free": [1.0, 2.0, 3.0]}, "all have one length: a has 2, free has 3"),
        ({"free": 0.0}, "parameter inverse = 1 / free has no finite value for this free"),
    ],
)
def test_overrides_that_are_refused(overrides, message):
    with pytest.raises(OptionError, match=message):
        parameter_values(BOUNDED, overrides)


def test_parameters_without_a_value():
    with pytest.raises(ModelError, match="a -> b -> a"):
        parameter_values(parameters(a=parameter("b"), b=parameter("a")))
    with pytest.raises(ModelError, match="'x' is not defined"):
        parameter_values(parameters(a=parameter("x")))
    with pytest.raises(ModelError, match="no finite value"):
        parameter_values(parameters(a=1 / parameter("b"), b=0.0))


def test_order_and_cycles():
    names = {"a": parameter("b"), "b": parameter("a"), "c": parameter("d"), "d": 1.0, "e": parameter("e")}
    order, cycles = parameter_order({name: Parameter(value=value) for name, value in names.items()})
    assert sorted(cycles) == [["a", "b"], ["e"]]
    assert order.index("d") < order.index("c")


def test_dimensions_of_derived_parameters():
    mechanism = parameters(a=Parameter(value=1.0, unit="m"), b=parameter("a") * parameter("a"), c=1.0)
    units = {name: d and d.unit() for name, d in parameter_dimensions(mechanism.parameters).items()}
    assert units == {"a": "m", "b": "m**2", "c": None}


def test_parameters_compare_by_their_numbers():
    assert Parameter(value=1.0, unit="m") == Parameter(value=1.0)
    assert hash(Parameter(value=1.0, unit="m")) == hash(Parameter(value=1.0))
    assert Parameter(value=1.0) != Parameter(value=2.0)
    assert Parameter(value=1.0) != Parameter(value=1.0, maximum=2.0)


def test_node_positions_of_nested_patterns():
    arm = Substructure(nodes={"tip": (t, 0, 0)}, interface=("tip",))
    pair = Substructure(
        instances={
            "arm": Instance(
                of="arm", rotate=Rotation(axis="z", angle=np.pi / 2), pattern={"type": "mirror", "normal": "y"}
            )
        },
        interface=("arm1.tip", "arm2.tip"),
    )
    row = Instance(of="pair", at=(0, 0, 1), pattern={"type": "linear", "count": 3, "step": (t, 0, 0)})
    mechanism = Mechanism(
        parameters={"t": Parameter(value=2.0)}, substructures={"arm": arm, "pair": pair}, instances={"row": row}
    )
    positions = node_positions(Layout(mechanism), {"t": 2.0})
    assert positions["pair"] == {"arm1.tip": (0.0, 2.0, 0.0), "arm2.tip": (0.0, -2.0, 0.0)}
    assert positions[""] == {
        f"row{k}.arm{i}.tip": (2.0 * (k - 1), y, 1.0) for k in (1, 2, 3) for i, y in ((1, 2.0), (2, -2.0))
    }
