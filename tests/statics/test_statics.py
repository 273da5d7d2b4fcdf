"""Static response and compliance against closed forms, in any number of elements."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx

E, NU, RHO, YIELD = 200e9, 0.3, 7800.0, 500e6
G = E / (2 * (1 + NU))
L, DIAMETER = 0.15, 4e-3
A, I_ROUND, J = np.pi / 4 * DIAMETER**2, np.pi / 64 * DIAMETER**4, np.pi / 32 * DIAMETER**4
GRAVITY = 9.81
INERTIA = (1e-4, 2e-4, 3e-4)


def rod(elements=1, ground=None, end=(L, 0, 0), **more):
    """A round rod from a to b, clamped at a."""
    section, across = fx.describe.Circle(diameter=DIAMETER), (0.1, 0.2, 1)
    link = fx.describe.Link(nodes=("a", "b"), material="steel", section=section, reference=across, elements=elements)
    return fx.Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"steel": fx.describe.Material(E=E, nu=NU, rho=RHO, yield_stress=YIELD)},
        nodes={"a": (0, 0, 0), "b": end},
        links={"rod": link},
        ground={"a": "clamped"} if ground is None else ground,
        **more,
    )


@pytest.mark.parametrize("elements", [1, 2, 7])
def test_rod_under_its_own_weight(elements):
    """w L^4/8 EI and w L^3/6 EI across, rho g L^2/2 E along, at every number of elements."""
    w = RHO * A * GRAVITY
    down = fx.statics(rod(elements), gravity=(0, 0, -GRAVITY)).displacement("b")
    assert down[2] == pytest.approx(-w * L**4 / (8 * E * I_ROUND), rel=1e-9)
    assert down[4] == pytest.approx(w * L**3 / (6 * E * I_ROUND), rel=1e-9)
    along = fx.statics(rod(elements), gravity=(-GRAVITY, 0, 0)).displacement("b")
    assert along[0] == pytest.approx(-RHO * GRAVITY * L**2 / (2 * E), rel=1e-9)


def test_rod_held_at_both_ends_under_its_own_weight():
    """5 w L^4/384 EI between pinned ends and w L^4/384 EI between clamps, in the middle of two elements."""
    w = RHO * A * GRAVITY
    pinned = {"a": fx.describe.Support(free=("ry", "rz")), "b": fx.describe.Support(free=("tx", "ry", "rz"))}
    for ground, factor in ((pinned, 5 / 384), ({"a": "clamped", "b": "clamped"}, 1 / 384)):
        state = fx.statics(rod(2, ground), gravity=(0, 0, -GRAVITY))
        names = state.model.dof_names
        middle = [k for k, name in enumerate(names) if name.endswith(".tz") and not name.startswith(("a.", "b."))]
        assert len(middle) == 1
        assert state.displacement_vector[middle[0]] == pytest.approx(-factor * w * L**4 / (E * I_ROUND), rel=1e-9)


def test_accelerated_base_is_gravity_the_other_way():
    """Steady acceleration of the ground, along and about an axis through the clamp, by hand."""
    state = fx.statics(rod(3), actuators={"ground.tz": 4.0})
    same = fx.statics(rod(3), gravity=(0, 0, -4.0))
    assert state.displacement_vector == pytest.approx(same.displacement_vector, rel=1e-12)
    turned = fx.statics(rod(5), actuators={"ground.ry": 30.0}).displacement("b")
    # a load 30 rho A x along z: 11 q L^4/120 EI at the tip
    assert turned[2] == pytest.approx(11 * 30 * RHO * A * L * L**4 / (120 * E * I_ROUND), rel=1e-9)


def body_on_springs(**more):
    """A body on a spring, with a node on an arm."""
    spring = fx.describe.Spring(
        nodes=("mass",), stiffness=fx.describe.DiagonalStiffness(tx=4e3, ty=9e3, tz=1e4, rx=3, ry=7, rz=8)
    )
    return fx.Mechanism(
        nodes={"tip": (0.02, 0.01, -0.03)},
        bodies={"mass": fx.describe.RigidBody(mass=0.4, inertia=INERTIA, carries=("tip",))},
        springs={"spring": spring},
        **more,
    )


def test_body_under_gravity_and_loads():
    """m g/k, and a load on an arm that also turns the body."""
    state = fx.statics(body_on_springs(), gravity=(1.0, -2.0, -GRAVITY))
    u = 0.4 * np.array([1 / 4e3, -2 / 9e3, -GRAVITY / 1e4])
    assert state.displacement("mass") == pytest.approx([*u, 0, 0, 0], rel=1e-12)
    force, arm = np.array([0.3, -0.2, 0.5]), np.array([0.02, 0.01, -0.03])
    state = fx.statics(body_on_springs(), loads={"tip": (*force, 0.01, 0, 0)})
    u, turn = force / [4e3, 9e3, 1e4], (np.cross(arm, force) + np.array([0.01, 0, 0])) / [3, 7, 8]
    assert state.displacement("mass") == pytest.approx([*u, *turn], rel=1e-12)
    assert state.displacement("tip") == pytest.approx([*(u + np.cross(turn, arm)), *turn], rel=1e-12)


def test_loads_add_up():
    """Two loads, gravity and a command give the sum of what each does alone."""
    push = {"push": fx.describe.ForceActuator(nodes=("mass",), direction="y")}
    parts = [
        {"loads": {"tip": (1, 2, 3, 0.1, 0.2, 0.3)}},
        {"loads": {"mass": (0, 1, 0, 0, 0, 0.5)}},
        {"gravity": (0, 0, -9.0)},
        {"actuators": {"push": 3.0, "mass.rz": 0.2}},
    ]
    every = {"loads": {**parts[0]["loads"], **parts[1]["loads"]}, **parts[2], **parts[3]}
    described = body_on_springs(actuators=push)
    total = sum(fx.statics(described, **part).displacement_vector for part in parts)
    found = fx.statics(described, **every)
    assert found.displacement_vector == pytest.approx(total, rel=1e-12)
    command = next(a for a in found.actuators if a.name == "push")
    assert (command.command, command.unit, command.force) == (3.0, "N", 3.0)
    assert command.elongation == pytest.approx(found.displacement("mass")[1], rel=1e-12)


@pytest.mark.parametrize("gain", [None, 0.2e-6])
def test_stack_on_a_spring(gain):
    """x = kp s/(kp + k): near the free stroke on a soft spring, near the blocked force kp s on a stiff one."""
    kp, s = 3e4, 20e-6
    command = s if gain is None else s / gain
    for k in (10.0, 4e3, 1e9):
        stiffness = fx.describe.DiagonalStiffness(tx=k, ty=1e4, tz=1e4, rx=5, ry=5, rz=5)
        described = fx.Mechanism(
            nodes={"foot": (-0.05, 0, 0)},
            bodies={"mass": fx.describe.RigidBody(mass=0.4, inertia=INERTIA)},
            springs={"spring": fx.describe.Spring(nodes=("mass",), stiffness=stiffness)},
            actuators={"stack": fx.describe.PiezoStack(nodes=("foot", "mass"), stiffness=kp, gain=gain)},
            sensors={
                "force": fx.describe.ForceSensor(actuator="stack"),
                "x": fx.describe.MotionSensor(type="displacement", nodes=("mass",), direction="-x"),
                "v": fx.describe.MotionSensor(type="velocity", nodes=("mass",), direction="x"),
            },
            ground={"foot": "clamped"},
        )
        state = fx.statics(described, actuators={"stack": command})
        x = kp * s / (kp + k)
        assert state.readings == {"force": pytest.approx(k * x, rel=1e-9), "x": pytest.approx(-x, rel=1e-12)}
        stack = state.actuators[0]
        assert stack.elongation == pytest.approx(x, rel=1e-12) and stack.force == pytest.approx(k * x, rel=1e-9)
        assert (stack.command, stack.unit) == (command, "m" if gain is None else "V")
    assert k * x == pytest.approx(kp * s, rel=1e-4)
    at_rest = fx.statics(described, loads={"mass": (5.0, 0, 0, 0, 0, 0)}).actuators[0]
    assert at_rest.command == 0 and at_rest.force == pytest.approx(-5.0 * kp / (kp + k), rel=1e-9)


@pytest.mark.parametrize("elements", [1, 3])
def test_compliance_of_a_cantilever(elements):
    """L/EA, L/GJ, L^3/3EI, L/EI and +-L^2/2EI."""
    C = np.zeros((6, 6))
    C[0, 0], C[3, 3] = L / (E * A), L / (G * J)
    C[1, 1] = C[2, 2] = L**3 / (3 * E * I_ROUND)
    C[4, 4] = C[5, 5] = L / (E * I_ROUND)
    C[1, 5] = C[5, 1] = L**2 / (2 * E * I_ROUND)
    C[2, 4] = C[4, 2] = -C[1, 5]
    found = fx.compliance(rod(elements), nodes=["b"])
    scale = np.sqrt(np.outer(C.diagonal(), C.diagonal()))
    assert np.abs((found - C) / scale).max() < 1e-9


def test_compliance_of_a_turned_cantilever():
    """Its own compliance, turned."""
    straight = fx.compliance(rod(2), nodes=["b"])
    x = np.array([0.2, -0.7, 0.4]) / np.linalg.norm([0.2, -0.7, 0.4])
    y = np.cross([0, 0, 1], x) / np.linalg.norm(np.cross([0, 0, 1], x))
    Q = np.kron(np.eye(2), np.stack([x, y, np.cross(x, y)], axis=1))
    found = fx.compliance(rod(2, end=tuple(L * x)), nodes=["b"])
    scale = np.sqrt(np.outer(found.diagonal(), found.diagonal()))
    assert np.abs((found - Q @ straight @ Q.T) / scale).max() < 1e-9


def test_compliance_of_two_nodes():
    """Symmetric, positive, and the displacement of one under a load at the other (Maxwell)."""
    described = rod(
        2, bodies={"end": fx.describe.RigidBody(centre=(L, 0.02, 0.01), mass=0.1, inertia=INERTIA, carries=("b",))}
    )
    nodes = ["end", "b"]
    C = fx.compliance(described, nodes=nodes)
    assert C.shape == (12, 12) and np.array_equal(C, C.T)
    model = fx.assemble(described)
    for k in (1, 4, 8, 11):
        load = np.zeros(6)
        load[k % 6] = 1.0
        state = fx.statics(model, loads={nodes[k // 6]: load})
        assert np.concatenate([state.displacement(n) for n in nodes]) == pytest.approx(C[:, k], rel=1e-7, abs=1e-12)


def test_stress_at_the_clamp():
    """Bending stress 32 F L/(pi d^3) at the clamp under a force at the tip."""
    state = fx.statics(rod(2), loads={"b": (0, 0, 1.5, 0, 0, 0)})
    sigma = 32 * 1.5 * L / (np.pi * DIAMETER**3)
    own = state.stresses().members[0]
    assert own.von_mises == pytest.approx(sigma, rel=1e-4)
    data = state.to_dict(["b"])
    assert data["factor_to_yield"] == pytest.approx(YIELD / sigma, rel=1e-4)
    assert data["displacement"]["b"] == state.displacement("b").tolist()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"loads": {"c": np.ones(6)}}, "c"),
        ({"loads": {"b": np.ones(5)}}, "load on b"),
        ({"loads": {"b": [np.nan] * 6}}, "load on b"),
        ({"loads": {"b": "heavy"}}, "load on b"),
        ({"gravity": (0, 0)}, "gravity"),
        ({"gravity": (0, 0, np.inf)}, "gravity"),
        ({"actuators": {"push": 1.0}}, "no input 'push'"),
        ({"actuators": {"b.tz": np.nan}}, "command of b.tz"),
        ({"actuators": {"b.tz": "much"}}, "command of b.tz"),
        ({"actuators": {"b.tz": [1, 2]}}, "command of b.tz"),
        ({"actuators": {"a.tz": 1.0}}, "held"),
        ({"parameters": {"p": 1.0}}, "p"),
    ],
)
def test_impossible_arguments(arguments, message):
    """Each is refused with what is wrong with it."""
    with pytest.raises(fx.OptionError) as caught:
        fx.statics(rod(), **arguments)
    assert message in str(caught.value)


def test_what_floats_has_no_static_state():
    """Neither displacements nor compliance."""
    with pytest.raises(fx.SolverError, match="move freely"):
        fx.statics(rod(ground={}), gravity=(0, 0, -9.81))
    with pytest.raises(fx.SolverError, match="move freely"):
        fx.compliance(rod(ground={}), nodes=["b"])
    with pytest.raises(fx.OptionError, match="assembled model"):
        fx.statics(fx.assemble(rod()), parameters={"p": 1})
    with pytest.raises(fx.OptionError, match="nowhere"):
        fx.compliance(rod(), nodes=["nowhere"])
    with pytest.raises(fx.OptionError, match="nowhere"):
        fx.statics(rod()).displacement("nowhere")
