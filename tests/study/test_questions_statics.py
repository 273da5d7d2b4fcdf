"""Static quantities of blocks of designs: as the verbs of one design have them, whatever stands beside."""

import re
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.full_order import plan_of
from flexura.study.questions import questions

EXAMPLES = Path(__file__).parents[2] / "examples"

CANTILEVER = """
flexura: 1
parameters:
  t: {value: 1 mm}
  side: {value: 1}
materials:
  steel: {E: 200 GPa, nu: 0.3, rho: 7800 kg/m^3}
nodes:
  foot: [0, 0, 0]
  tip: [side * 100 mm, 0, 0]
links:
  rod: {nodes: [foot, tip], material: steel, elements: 8, root: rigid, section: {shape: circle, diameter: t}}
ground: {foot: clamped}
"""

ASKED = {
    "guide/guide": "compliance(x), compliance(rz), compliance(x, ry), compliance(leaf1.blade[3].x), stiffness(y)",
    "rpr/rpr_piezo": "compliance(platform.x), compliance(platform.x, rpu1.c.half1.p.y), compliance(rpu1.c.half1.p.rz)",
    "imported/guide": "compliance(x), compliance(leaf1.head.x, x), stiffness(rz)",
    "tip_tilt/tip_tilt": "stiffness(mirror.rx), compliance(leg2.top.z, mirror.ry)",
}


def spread(plan, count, seed=0):
    rng, at = np.random.default_rng(seed), plan.parameter_values()
    own = plan.mechanism.parameters.items()
    names = [name for name, of in own if isinstance(of.value, float) and of.minimum is None][:4]
    return {name: at[name] * rng.uniform(0.97, 1.03, count) for name in names}


def nodes_of(plan, own):
    """Names of the nodes of what is asked, and which displacements of these."""
    arguments = (own.arguments[0], own.arguments[-1])
    return [of.node for of in arguments], [of.component for of in arguments]


@pytest.mark.parametrize("name", ASKED)
def test_compliances_are_those_of_the_verb(name):
    plan = plan_of(fx.load(EXAMPLES / f"{name}.yaml"))
    asked, designs = questions(plan, ASKED[name]), spread(plan, 3)
    assert asked.is_stacked
    found = asked.values(designs)
    assert set(found.reason) == {""}
    one = {key: float(own[2]) for key, own in designs.items()}
    for k, own in enumerate(asked.quantities):
        nodes, (i, j) = nodes_of(plan, own)
        C = fx.compliance(plan, one, nodes=list(dict.fromkeys(nodes)))
        j += 6 * (nodes[0] != nodes[1])
        expected = 1 / C[i, j] if own.kind == "stiffness" else C[i, j]
        size = expected if own.kind == "stiffness" else np.sqrt(C[i, i] * C[j, j])
        assert found.value[2, k] == pytest.approx(expected, rel=1e-6, abs=1e-7 * abs(size))
    for chosen in ([1], [2, 0]):
        some = asked.values({key: own[chosen] for key, own in designs.items()})
        assert np.array_equal(some.value, found.value[chosen])


def test_amplification_and_coupling_are_those_of_kinetostatics():
    plan = plan_of(fx.load(EXAMPLES / "rpr" / "rpr_piezo.yaml"))
    designs = spread(plan, 2)
    asked = questions(plan, "coupling(rpu1.c.piezo, x), amplification(rpu1.c.piezo, x), coupling(rpu2.c.piezo, y)")
    found = asked.values(designs)
    verb = fx.kinetostatics(plan, {key: float(own[1]) for key, own in designs.items()})
    names = [own.name for own in verb.inputs]
    at = [names.index(own) for own in ("rpu1.c.piezo", "rpu2.c.piezo")]
    assert found.value[1, 0] == pytest.approx(verb.coupling[0, at[0]], rel=1e-6)
    assert found.value[1, 2] == pytest.approx(verb.coupling[1, at[1]], rel=1e-6)
    assert asked.is_stacked


def test_a_cantilever_bends_as_its_closed_form_and_is_the_same_mirrored():
    plan = plan_of(fx.loads(CANTILEVER))
    asked = questions(plan, "compliance(tip.y), compliance(tip.y, tip.rz), stiffness(tip.x), compliance(rod[4].z)")
    t = np.array([1e-6, 1e-3, 1e-3, 3e-3])
    value = asked.values({"t": t, "side": [1.0, 1.0, -1.0, 1.0]}).value
    bending, length = 200e9 * np.pi * t**4 / 64, 0.1
    np.testing.assert_allclose(value[:, 0], length**3 / (3 * bending), rtol=1e-3)
    np.testing.assert_allclose(value[:, 1], length**2 / (2 * bending) * [1, 1, -1, 1], rtol=1e-9)
    np.testing.assert_allclose(value[:, 2], 200e9 * np.pi * t**2 / 4 / length, rtol=1e-9)
    np.testing.assert_allclose(value[:, 3], (length / 2) ** 3 / (3 * bending), rtol=3e-3)


def test_what_can_move_freely_has_no_compliance_and_says_so():
    free = fx.loads(CANTILEVER.replace("ground: {foot: clamped}", "ground: {foot: {free: [rx, ry, rz]}}"))
    found = questions(free, "compliance(tip.y)").values({"t": [1e-3, 2e-3]})
    assert np.isnan(found.value).all()
    assert all("freely" in own for own in found.reason)


def test_designs_that_cannot_be_leave_their_neighbours_alone():
    plan = plan_of(fx.loads(CANTILEVER))
    asked = questions(plan, "compliance(tip.y), mass")
    found = asked.values({"t": [1e-3, -1e-3, np.nan, 2e-3], "side": [1.0, 1.0, 1.0, 0.0]})
    alone = asked.values({"t": [1e-3], "side": [1.0]})
    assert np.array_equal(found.value[0], alone.value[0])
    assert np.isnan(found.value[1:, 0]).all()
    assert all(found.reason[1:])


def leaf(angle):
    """A leaf along z with a body on its end, turned about its axis by an angle, rad."""
    return fx.Mechanism(
        nodes={"foot": (0, 0, 0), "head": (0, 0, 60e-3)},
        flexures={
            "leaf": fx.describe.Flexure(
                nodes=("foot", "head"),
                material="spring-steel",
                reference=(np.cos(angle), np.sin(angle), 0),
                profile=fx.describe.Leaf(width=20e-3, thickness=0.5e-3),
            )
        },
        bodies={"table": fx.describe.RigidBody(centre=(0, 0, 60e-3), mass=0.1, inertia=(1e-5,) * 3, carries=("head",))},
        ground={"foot": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
        parameters={"free": fx.describe.Parameter(value=1.0)},
    )


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9, 1e-12])
def test_of_compliances_that_nearly_vanish_those_below_their_rounding_are_zero(angle):
    """C_xy of diagonal compliances that are turned is (C_x - C_y) times the angle."""
    found = fx.questions(leaf(angle), "compliance(x), compliance(y), compliance(x, y), coupling(x, y)")
    exact = found.slopes({}, ["free"])
    for cx, cy, cxy, moved in (found.values({}).value[0], exact.value):
        expected = (cx - cy) * angle
        is_there = abs(expected) > 1e-8 * np.sqrt(cx * cy)
        assert [cxy, moved] == pytest.approx([expected if is_there else 0.0] * 2, rel=1e-4, abs=0)
        np.testing.assert_allclose(exact.least[2:], 1e-8 * np.sqrt(cx * cy), rtol=1e-6)


def test_round_off_is_zero_in_tables_and_the_note_says_below_what():
    rpr = fx.load(EXAMPLES / "rpr/rpr.yaml")
    found = fx.sensitivity(rpr, ask="compliance(x, z)", free=["leaf_thickness", "plate"])
    assert found.value[0] == 0.0
    assert (found.slope == 0.0).all()
    below = re.match(r"compliance\(platform.x, platform.z\) is zero, below ([\d.]+) pm/N by round-off,", found.notes[0])
    cx, cz = fx.questions(rpr, "compliance(x), compliance(z)").values({}).value[0]
    assert float(below[1]) == pytest.approx(1e-8 * np.sqrt(cx * cz) * 1e12, rel=0.02)
