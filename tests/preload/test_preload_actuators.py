"""Actuators as loads of the preloaded state, against rigid bars on springs worked out by hand."""

import numpy as np
import pytest

import flexura as fx

K_TURN, ARM, FORCE = 50.0, 0.2, 40.0


def inverted_pendulum(**more):
    """A rigid bar that stands on a torsion spring, its mass at the top."""
    return fx.Mechanism(
        nodes={"foot": (0, 0, 0), "top": (0, 0, ARM)},
        bodies={
            "bar": fx.describe.RigidBody(centre=(0, 0, 0), mass=1e-3, inertia=(0.4, 0.4, 0.4), carries=("foot", "top"))
        },
        springs={
            "joint": fx.describe.Spring(nodes=("bar",), stiffness={"tz": 1e7, "rx": K_TURN, "ry": K_TURN, "rz": K_TURN})
        },
        ground={"bar": fx.describe.Support(fixed=("tx", "ty"))},
        **more,
    )


def test_a_force_actuator_on_an_arm_takes_stiffness_away() -> None:
    push = {"push": fx.describe.ForceActuator(nodes=("top",), direction=(0, 0, -1))}
    state = fx.preload(inverted_pendulum(actuators=push), actuators={"push": FORCE})
    expected = np.sqrt((K_TURN - FORCE * ARM) / 0.4) / (2 * np.pi)
    assert state.natural_frequencies(1).frequency_hz[0] == pytest.approx(expected, rel=1e-9)
    assert state.buckling_factor == pytest.approx(K_TURN / (FORCE * ARM), rel=1e-6)


def test_a_stack_between_two_plates_buckles_them_sideways() -> None:
    """A pushing strut of length L between a fixed plate and one on springs k across: it tips over at F = k L."""
    k_across, k_along, length, stiffness = 2e4, 1e7, 0.05, 2e7
    mechanism = fx.Mechanism(
        nodes={"base": (0, 0, 0)},
        bodies={"plate": fx.describe.RigidBody(centre=(0, 0, length), mass=0.1, inertia=(1e-4,) * 3)},
        springs={
            "guide": fx.describe.Spring(
                nodes=("plate",),
                stiffness={"tx": k_across, "ty": k_across, "tz": k_along} | dict.fromkeys(("rx", "ry", "rz"), 10.0),
            )
        },
        actuators={"stack": fx.describe.PiezoStack(nodes=("base", "plate"), stiffness=stiffness)},
        ground={"base": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
    )
    expansion = 1e-5
    state = fx.preload(mechanism, actuators={"stack": expansion})
    force = expansion / (1 / stiffness + 1 / k_along)
    assert state.displacement("plate")[2] == pytest.approx(force / k_along, rel=1e-12)
    assert state.buckling_factor == pytest.approx(k_across * length / force, rel=1e-9)


def test_a_moving_base_is_no_preload() -> None:
    shaker = {"shaker": fx.describe.BaseMotion(direction=(1, 0, 0))}
    with pytest.raises(fx.OptionError, match="base at rest"):
        fx.preload(inverted_pendulum(actuators=shaker), actuators={"shaker": 1.0})


def test_a_bonded_stack_under_thrust_and_weight_is_a_beam() -> None:
    length, area, k, mass = 0.03, 25e-6, 12e6, 0.012
    section = fx.describe.Rectangle(width=5e-3, thickness=5e-3)
    stack = fx.describe.PiezoStack(
        nodes=("foot", "top"), stiffness=k, free_stroke=60e-6, mass=mass, section=section, nu=0.3
    )
    link = fx.describe.Link(nodes=("foot", "top"), material="m", section=section, reference=(1, 0, 0), elements=1)
    description = {
        "nodes": {"foot": (0, 0, 0), "top": (0, 0, length)},
        "bodies": {"head": fx.describe.RigidBody(centre=(0, 0, 0.05), mass=0.2, inertia=(1e-5,) * 3, carries=("top",))},
        "ground": {"foot": "clamped"},
        "corrections": "none",
        "materials": {"m": fx.describe.Material(E=k * length / area, nu=0.3, rho=mass / (area * length))},
    }
    one, other = (
        fx.preload(fx.Mechanism(**description, **part), gravity=(200.0, 0, -900.0))
        for part in ({"actuators": {"stack": stack}}, {"links": {"stack": link}})
    )
    assert one.natural_frequencies(6).frequency_hz == pytest.approx(other.natural_frequencies(6).frequency_hz, rel=1e-9)
    assert one.buckling_factors(2) == pytest.approx(other.buckling_factors(2), rel=1e-7)
