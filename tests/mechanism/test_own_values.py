"""Instances with values of their own: what follows inside, what is shared, and numbers against the same mechanism put
together from substructures of its own, bit by bit, and against closed form."""

from __future__ import annotations

import pickle
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.describe import Instance, LinearPattern, parameter, with_own_copies
from flexura.errors import ModelError, OptionError
from flexura.mechanism import Layout, origin_of, problems
from flexura.modelfile import dumps, load, loads

EXAMPLES = Path(__file__).parents[2] / "examples"
PLACED = [
    own if own.stem in ("guide", "rpr", "xy_stage") else pytest.param(own, marks=pytest.mark.slow)
    for own in sorted(EXAMPLES.rglob("*.yaml"))
]
"""Examples with and without instances; the others are slow."""

LEAF = """\
    nodes: {{foot: [0, 0, 0], head: [0, 0, L]}}
    flexures:
      blade:
        nodes: [foot, head]
        material: metal
        reference: x
        corrections: none
        profile: {{type: leaf, width: w, thickness: {t}}}
    interface: [foot, head]
"""
HEAD = """\
parameters: {L: {value: 60 mm, minimum: 10 mm}, w: 10 mm, t: {value: 0.5 mm, minimum: 0.1 mm, maximum: 2 mm}, b: 40 mm}
materials: {metal: {E: 200 GPa, rho: 7800 kg/m^3, nu: 0.3}}
bodies:
  table: {centre: [0, 0, L], mass: 0.2 kg, inertia: [1e-4 kg*m^2, 1e-4 kg*m^2, 1e-4 kg*m^2], carries: ["leaf*.head"]}
ground: {"leaf*.foot": clamped}
"""
PATTERN = "pattern: {type: circular, count: 4, axis: z}"


def four(own: str = "") -> str:
    """Four leaves around a table; `own` is what the instance has of its own."""
    placed = f"  leaf: {{of: leaf, at: [b/2, 0, 0], {PATTERN}{own}}}\n"
    return HEAD + "substructures:\n  leaf:\n" + LEAF.format(t="t") + "instances:\n" + placed


def apart(thicknesses: list[str]) -> str:
    """The same, each leaf of a substructure of its own."""
    parts = "".join(f"  of{k}:\n{LEAF.format(t=t)}" for k, t in enumerate(thicknesses))
    turn = "rotate: {{axis: z, angle: {0} deg}}, at: [b/2*cos({0} deg), b/2*sin({0} deg), 0]"
    placed = "".join(f"  leaf{k + 1}: {{of: of{k}, {turn.format(90 * k)}}}\n" for k in range(len(thicknesses)))
    return HEAD + "substructures:\n" + parts + "instances:\n" + placed


def frequencies(mechanism, parameters=None) -> np.ndarray:
    full = fx.assemble(mechanism, parameters)
    values = np.linalg.eigvals(np.linalg.solve(full.M.toarray(), full.K.toarray()))
    return np.sqrt(np.sort(values.real)[:12]) / (2 * np.pi)


def test_values_that_are_what_they_were_change_nothing():
    plain, given = loads(four()), loads(four(", with: {t: t}, copies: {leaf3: {L: L}}"))
    assert list(fx.Plan(given).parts) == list(fx.Plan(plain).parts) == ["leaf", ""]
    a, b = fx.modes(plain), fx.modes(given)
    np.testing.assert_array_equal(a.frequency_hz, b.frequency_hz)
    np.testing.assert_array_equal(fx.assemble(plain).K.toarray(), fx.assemble(given).K.toarray())


def test_one_branch_that_differs_is_one_with_a_substructure_of_its_own():
    given, separate = loads(four(", copies: {leaf3: {t: 0.42 mm}}")), loads(apart(["t", "t", "0.42 mm", "t"]))
    np.testing.assert_allclose(frequencies(given), frequencies(separate), rtol=1e-9)
    assert ["".join(path) for path, _ in Layout(given).instances()] == ["", "leaf1", "leaf2", "leaf3", "leaf4"]
    a, b = fx.modes(given, n=8), fx.modes(separate, n=8)
    np.testing.assert_allclose(a.frequency_hz, b.frequency_hz, rtol=2e-6)
    assert list(fx.Plan(given).parts) == ["leaf", "leaf at leaf3", ""]


def test_equal_values_share_one_prototype():
    plan = fx.Plan(loads(four(", copies: {leaf1: {t: 0.42 mm}, leaf3: {t: 0.42 mm}, leaf4: {t: 2*t}}")))
    assert [len(placed.paths) for placed in plan.topology.copies.values()] == [2, 1, 1, 1]
    assert [origin_of(name) for name in plan.parts] == ["leaf", "leaf", "leaf", ""]
    assert plan.layout.prototypes["leaf at leaf1"].interface == ("foot", "head")


def test_copies_go_before_all_of_them():
    table = fx.Plan(loads(four(", with: {t: 0.4 mm}, copies: {leaf2: {t: t/2}}"))).scoped_values()
    assert table["t"] == 0.5e-3
    assert table["t at leaf1"] == 0.4e-3
    assert table["t at leaf2"] == 0.25e-3


def test_overrides_of_parameters_outside_reach_inside():
    mechanism = loads(four(", copies: {leaf3: {t: 0.8*t}}"))
    changed = loads(apart(["t", "t", "0.8*t", "t"]))
    for t in (0.3e-3, 1e-3):
        np.testing.assert_allclose(frequencies(mechanism, {"t": t}), frequencies(changed, {"t": t}), rtol=1e-9)
    with pytest.raises(OptionError, match=r"t at leaf3 = 8e-05 m is below its minimum 0\.0001"):
        fx.assemble(mechanism, {"t": 0.1e-3})
    with pytest.raises(OptionError, match="is not a parameter"):
        fx.assemble(mechanism, {"t at leaf3": 0.3e-3})


def test_designs_in_a_stack_are_those_one_by_one():
    plan = fx.Plan(loads(four(", copies: {leaf3: {t: 0.8*t, w: w + 1 mm}}")))
    t = np.array([0.3e-3, 0.5e-3, 0.9e-3])
    stack = plan.values({"t": t})
    for k, own in enumerate(t):
        np.testing.assert_array_equal(stack[k], plan.values({"t": own}))
    again = pickle.loads(pickle.dumps(plan))
    np.testing.assert_array_equal(again.values({"t": 0.3e-3}), plan.values({"t": 0.3e-3}))


DERIVED = """\
parameters: {t: 1 mm, u: 2*t, w: 10 mm, L: 30 mm}
sections: {strip: {shape: rectangle, width: w, thickness: t}}
materials: {own: {E: "200 GPa * (t/1 mm)", rho: 7800 kg/m^3, nu: 0.3}}
substructures:
  leaf:
    nodes: {a: [0, 0, 0], b: [0, 0, L]}
    links: {l: {nodes: [a, b], material: own, section: strip, reference: x}}
    interface: [a, b]
  half:
    instances:
      leaf: {of: leaf, with: {t: u/4}, pattern: {type: linear, count: 2, step: [L, 0, 0]}}
    links:
      bar:
        nodes: [leaf1.b, leaf2.b]
        material: own
        section: {shape: rectangle, width: w, thickness: u}
        reference: z
    interface: [leaf1.a, leaf2.a, leaf1.b]
instances:
  half: {of: half, pattern: {type: linear, count: 2, step: [0, 40 mm, 0]}, copies: {half2: {t: 1.2 mm}}}
links: {c: {nodes: [half1.leaf1.b, half2.leaf1.b], material: own, section: strip, reference: z}}
ground: {"*a": clamped}
"""


def test_what_is_worked_out_follows_inside_in_nested_instances_sections_and_materials():
    plan = fx.Plan(loads(DERIVED))
    values = plan.scoped_values()
    assert values["u at half2"] == pytest.approx(2.4e-3, rel=1e-15)
    assert values["t at leaf1 of half at half2"] == pytest.approx(0.6e-3, rel=1e-15)
    assert values["t at leaf1 of half"] == pytest.approx(0.5e-3, rel=1e-15)
    assert list(plan.parameter_values()) == ["t", "u", "w", "L"]
    inner = plan.layout.prototypes["leaf at leaf1 of half at half2"].links["l"]
    table = plan.parts["leaf at leaf1 of half at half2"].table
    E, *_ = table.moduli(plan.values())
    assert E[0] == pytest.approx(0.6 * 200e9, rel=1e-14)
    assert str(inner.section.thickness) == "t at leaf1 of half at half2"


def test_a_derived_parameter_that_is_replaced_is_so_inside_too():
    plan = fx.Plan(loads(DERIVED))
    values = plan.scoped_values({"u": 3e-3})
    assert values["u at half2"] == 3e-3
    assert values["t at half2"] == 1.2e-3
    assert values["t at leaf1 of half at half2"] == pytest.approx(0.75e-3, rel=1e-15)


def test_keep_means_all_copies_of_a_substructure():
    mechanism = loads(four(", copies: {leaf3: {t: 0.42 mm}}"))
    low = fx.reduce(mechanism, keep={"leaf": 2})
    assert low.order == fx.reduce(loads(four()), keep={"leaf": 2}).order
    one = fx.reduce(mechanism, keep={"leaf at leaf3": 2})
    assert one.order < low.order
    with pytest.raises(OptionError, match="leafs"):
        fx.reduce(mechanism, keep={"leafs": 2})


@pytest.mark.parametrize(
    ("own", "place", "rule", "hint"),
    [
        (", with: {tt: 1 mm}", "with.tt", "there is no such parameter", "did you mean t?"),
        (", with: {b: 1 mm}", "with.b", "the substructure leaf does not depend on it", "L, t, w"),
        (", with: {t: 1 kg}", "with.t", "in m; this is in kg", "1 mm"),
        (", with: {t: 1}", "with.t", "carries a unit", "write 1 m"),
        (", with: {t: L*w}", "with.t", "in m; this is in m**2", ""),
        (", with: {t: tt}", "with.t", "'tt' is not defined", "did you mean t?"),
        (", copies: {leaf5: {t: 1 mm}}", "copies.leaf5", "there is no such copy", "leaf4"),
        (", copies: {leaf4: {tt: 1 mm}}", "copies.leaf4.tt", "there is no such parameter", "did you mean t?"),
    ],
)
def test_values_that_cannot_be_are_named(own, place, rule, hint):
    with pytest.raises(ModelError) as caught:
        loads(four(own))
    (problem,) = caught.value.problems
    assert problem.place == f"instances.leaf.{place}"
    assert rule in problem.rule
    assert hint in problem.hint
    assert problem.where.endswith(f":{len(four().splitlines())}")


def test_bounds_and_signs_hold_inside():
    with pytest.raises(ModelError, match=r"below the minimum 0\.0001 m"):
        loads(four(", copies: {leaf2: {t: 0.05 mm}}"))
    with pytest.raises(ModelError, match=r"above the maximum 0\.002 m"):
        loads(four(", with: {t: 5*t}"))
    with pytest.raises(ModelError, match="must be positive"):
        loads(four(", with: {w: -1 mm}"))
    with pytest.raises(ModelError, match=r"no length|same place"):
        loads(four(", with: {t: t}").replace("minimum: 10 mm", "minimum: 0 mm").replace("{t: t}", "{L: 0}"))


def test_python_says_the_same():
    mechanism = loads(four())
    leaf = mechanism.instances["leaf"]
    given = leaf.model_copy(update={"copies": {"leaf3": {"t": 0.8 * parameter("t")}}})
    changed = mechanism.model_copy(update={"instances": {"leaf": given}})
    assert not problems(changed)
    assert loads(dumps(changed)) == changed
    assert Instance(of="leaf", with_={"t": 1e-3}) == Instance(**{"of": "leaf", "with": {"t": 1e-3}})


def test_a_file_that_extends_another_gives_values(tmp_path):
    (tmp_path / "base.yaml").write_text(four(), encoding="utf-8")
    variant = "extends: base.yaml\ninstances: {leaf: {copies: {leaf3: {t: 0.42 mm}}}}\n"
    (tmp_path / "variant.yaml").write_text(variant, encoding="utf-8")
    assert load(tmp_path / "variant.yaml").instances["leaf"].copies == {"leaf3": {"t": 0.42e-3}}


GUIDE = HEAD + (
    "substructures:\n  leaf:\n" + LEAF.format(t="t") + "instances:\n"
    "  leaf: {of: leaf, at: [-b/2, 0, 0], pattern: {type: linear, count: 2, step: [b, 0, 0]},"
    " copies: {leaf2: {t: OWN}}}\n"
)


@pytest.mark.parametrize("share", [1.0, 1.01, 0.7, 1.9])
def test_unequal_leaves_turn_and_lift_the_table(share):
    """Euler-Bernoulli leaves clamped to a rigid table, loaded at its height: lateral stiffness 12 E I/L^3 with a couple
    6 E I/L^2, 4 E I/L, and axially E A/L (any text on matrix structural analysis, e.g. Przemieniecki 1968, ch. 5)."""
    t, L, w, b, E, force = 0.5e-3, 60e-3, 10e-3, 40e-3, 200e9, 1.0
    K = np.zeros((3, 3))  # x and z of the table, and its rotation about y
    for x, own in ((-b / 2, t), (b / 2, share * t)):
        bending, axial = E * w * own**3 / 12, E * w * own / L
        up = np.array([0.0, 1.0, -x])
        K += axial * np.outer(up, up)
        K[np.ix_([0, 2], [0, 2])] += bending * np.array([[12 / L**3, -6 / L**2], [-6 / L**2, 4 / L]])
    expected = np.linalg.solve(K, [force, 0.0, 0.0])
    mechanism = loads(GUIDE.replace("OWN", f"{share} * t"))
    u = fx.statics(mechanism, loads={"table": (force, 0, 0, 0, 0, 0)}).displacement("table")
    np.testing.assert_allclose(u[[0, 4]], expected[[0, 2]], rtol=1e-9)
    # the table lifts by the rotation about the point between the leaves that their axial stiffness weighs
    lift = b / 2 * (share - 1) / (share + 1) * expected[2]
    np.testing.assert_allclose(u[2], lift, rtol=1e-6, atol=1e-15 * abs(expected[0]) + 1e-18)


def test_every_copy_has_a_parameter_of_its_own():
    mechanism = loads(four())
    changed, names = with_own_copies(mechanism, ["t", "b"])
    assert names == {"t": {f"leaf{k}": f"t_leaf{k}" for k in (1, 2, 3, 4)}, "b": {"": "b"}}
    np.testing.assert_allclose(frequencies(changed), frequencies(mechanism), rtol=1e-9)
    one = frequencies(changed, {"t_leaf3": 0.42e-3})
    np.testing.assert_allclose(one, frequencies(loads(four(", copies: {leaf3: {t: 0.42 mm}}"))), rtol=1e-9)
    np.testing.assert_allclose(frequencies(changed, {"t": 1e-3}), frequencies(mechanism, {"t": 1e-3}), rtol=1e-9)
    with pytest.raises(OptionError, match="t_leaf3 = 5e-05 m is below its minimum"):
        fx.assemble(changed, {"t_leaf3": 0.05e-3})
    assert loads(dumps(changed)) == changed


def test_nested_copies_have_parameters_by_their_paths_and_keep_their_values():
    mechanism = loads(DERIVED)
    changed, names = with_own_copies(mechanism, ["t"])
    assert list(names["t"]) == ["", *(f"half{i}{leaf}" for i in (1, 2) for leaf in ("", ".leaf1", ".leaf2"))]
    assert names["t"]["half2.leaf1"] == "t_half2_leaf1"
    np.testing.assert_allclose(frequencies(changed), frequencies(mechanism), rtol=1e-9)
    plan = fx.Plan(changed)
    assert len(plan.parts) == 7
    own = plan.parameter_values({"t_half2_leaf1": 0.7e-3})
    assert own["t_half2_leaf1"] == 0.7e-3
    assert own["t_half2_leaf2"] == pytest.approx(0.6e-3, rel=1e-15)
    E = {name: part.table.moduli(plan.values({"t_half2_leaf1": 0.7e-3}))[0] for name, part in plan.parts.items()}
    assert sorted(round(float(e[0]) / 200e9, 12) for name, e in E.items() if origin_of(name) == "leaf") == [
        *(0.5, 0.5, 0.6, 0.7)
    ]
    assert loads(dumps(changed)) == changed


def test_names_of_parameters_of_copies_are_legal_and_their_own():
    mechanism = loads(four().replace("b: 40 mm}", "b: 40 mm, t_leaf1: 3 mm}"))
    _, names = with_own_copies(mechanism, ["t"])
    assert names["t"]["leaf1"] == "t_leaf1_2"
    assert len(set(names["t"].values())) == 4
    flat = loads(
        "parameters: {d: 1 mm}\nnodes: {a: [0, 0, 0], b: [1 m, 0, 0]}\nground: {a: clamped}\nlinks: {l: "
        "{nodes: [a, b], material: spring-steel, section: {shape: circle, diameter: d}}}\n"
    )
    same, names = with_own_copies(flat, ["d"])
    assert (same, names) == (flat, {"d": {"": "d"}})
    with pytest.raises(OptionError, match="did you mean 'd'"):
        with_own_copies(flat, ["dd"])


@pytest.mark.parametrize("file", PLACED, ids=lambda f: f.stem)
def test_examples_with_parameters_by_copy_are_the_same_mechanisms(file):
    mechanism = load(file)
    changed, names = with_own_copies(mechanism, mechanism.parameters)
    assert loads(dumps(changed), str(file)) == changed
    a, b = fx.assemble(mechanism), fx.assemble(changed)
    assert a.order == b.order
    difference = abs(a.K - b.K).max() / abs(a.K).max()
    assert difference < 1e-13
    assert any(len(own) > 1 for own in names.values()) == bool(mechanism.instances)
    assert all(len(set(own.values())) == len(own) for own in names.values())
    assert all(x != y for x, y in pairwise(sorted(changed.parameters)))


def test_a_pattern_of_python_gives_its_copies_values():
    mechanism = loads(four())
    step = LinearPattern(count=2, step=(0.04, 0.0, 0.0))
    row = Instance(of="leaf", pattern=step, with_={"t": 0.4e-3}, copies={"leaf2": {"w": 0.02}})
    plan = fx.Plan(mechanism.model_copy(update={"instances": {"leaf": row}}))
    assert plan.scoped_values()["w at leaf2"] == 0.02
    assert list(plan.parts) == ["leaf at leaf1", "leaf at leaf2", ""]


def test_solid_members_with_values_of_their_own_are_refused():
    solid = four(", copies: {leaf3: {t: 0.42 mm}}").replace("corrections: none", "fidelity: solid")
    with pytest.raises(ModelError, match=r"substructures\.leaf\.flexures\.blade: a solid has one form"):
        fx.with_solid_parts(loads(solid))


def test_what_check_and_modes_say_names_instances_and_substructures():
    mechanism = loads(four(", copies: {leaf3: {t: 0.42 mm}}"))
    report = fx.check(mechanism)
    assert [(s.name, s.copies) for s in report.substructures] == [("leaf", 3), ("leaf at leaf3", 1), ("mechanism", 1)]
    motion = fx.modes(mechanism, n=1).modes[0].motion
    assert motion.strain_by_substructure.keys() <= {"leaf", "mechanism"}
    assert {"leaf1", "leaf2", "leaf3", "leaf4"} <= motion.strain_share.keys()


def test_derivatives_go_through_values_of_instances():
    given = fx.models.mode_sensitivities(loads(four(", copies: {leaf3: {t: 0.8*t}}")), n=3)
    separate = fx.models.mode_sensitivities(loads(apart(["t", "t", "0.8*t", "t"])), n=3)
    assert given.free == separate.free
    np.testing.assert_allclose(given.relative, separate.relative, rtol=1e-6, atol=1e-7)
