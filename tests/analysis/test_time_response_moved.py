"""Displacements that are prescribed over time: a mass on a cart, a pendulum on a pivot, a guide."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flexura as fx
from flexura.errors import OptionError

GUIDE = fx.load(Path(__file__).parents[2] / "examples/guide/guide.yaml")

STIFF = "ty: 1 N/um, tz: 1 N/um, rx: 1e4 N*m/rad, ry: 1e4 N*m/rad, rz: 1e4 N*m/rad"
CARTS = f"""
flexura: 1
name: carts
bodies:
  cart: {{centre: [0, 0, 0], mass: 0.3 kg, inertia: [1e-5 kg*m^2, 1e-5 kg*m^2, 1e-5 kg*m^2]}}
  mass: {{centre: [0, 0, 20 mm], mass: 0.1 kg, inertia: [1e-5 kg*m^2, 1e-5 kg*m^2, 1e-5 kg*m^2]}}
springs:
  ground: {{nodes: [cart], stiffness: {{tx: 100 N/m, {STIFF}}}}}
  link: {{nodes: [cart, mass], stiffness: {{tx: 1 N/mm, {STIFF}}}}}
"""

PENDULUM = f"""
flexura: 1
name: pendulum
bodies:
  cart: {{centre: [0, 0, 0], mass: 0.2 kg, inertia: [1e-5 kg*m^2, 1e-5 kg*m^2, 1e-5 kg*m^2]}}
  bob: {{centre: [0, 0, -0.2 m], mass: 0.5 kg, inertia: [1e-3 kg*m^2, 2e-3 kg*m^2, 1.5e-3 kg*m^2], carries: [pivot]}}
nodes: {{pivot: [0, 0, 0]}}
springs:
  rails: {{nodes: [cart], stiffness: {{tx: 1e-3 N/m, {STIFF}}}}}
  pin:
    nodes: [cart, pivot]
    stiffness: {{tx: 1e6 N/m, ty: 1e6 N/m, tz: 1e6 N/m, rx: 1e3 N*m, ry: 1e-6 N*m, rz: 1e3 N*m}}
gravity: [0, 0, -9.81 m/s^2]
"""


@pytest.mark.parametrize("rho", (0.5, 0.9))
def test_a_mass_on_a_cart_that_is_moved(rho: float) -> None:
    """Its motion and the force on the cart are those in closed form, with errors of second order."""
    amplitude, w, w0 = 2e-3, 2 * np.pi * 8, np.sqrt(1e3 / 0.1)
    off = []
    for dt in (1e-3, 5e-4):
        found = fx.time_response(
            fx.loads(CARTS),
            move={"cart.x": lambda t: amplitude * (1 - np.cos(w * t))},
            outputs=["mass.tx", "cart.tx:acceleration"],
            dt=dt,
            duration=0.1,
            motion="large",
            order="full",
            damping=0.0,
            rho_infinity=rho,
        )
        t = found.time
        cart = amplitude * (1 - np.cos(w * t))
        mass = amplitude * (1 + (w**2 * np.cos(w0 * t) - w0**2 * np.cos(w * t)) / (w0**2 - w**2))
        force = 0.3 * amplitude * w**2 * np.cos(w * t) + 100 * cart + 1e3 * (cart - mass)
        assert found.signals[0] == pytest.approx(cart)
        pairs = ((found.of("mass.tx"), mass), (found.of("cart.x:force"), force))
        off.append([np.abs(own - exact).max() / np.abs(exact).max() for own, exact in pairs])
    assert np.max(off[1]) < 3e-3
    assert np.divide(*off) == pytest.approx([4.0, 4.0], rel=0.1)


def test_a_pendulum_on_a_moving_pivot() -> None:
    """J th'' = - m l (g sin th + x'' cos th) about the pivot, swung by it to a large angle; the force of the drive is
    that of both masses along x."""
    m, length, J, g = 0.5, 0.2, 2e-3 + 0.5 * 0.2**2, 9.81
    amplitude, w = 0.1, 2 * np.pi * 1.1

    def pivot(t: np.ndarray) -> np.ndarray:
        return amplitude * np.sin(w * t) ** 3

    def second(t: Any) -> Any:
        return 3 * amplitude * w**2 * (2 * np.sin(w * t) * np.cos(w * t) ** 2 - np.sin(w * t) ** 3)

    def swing(t: float, y: np.ndarray) -> list[float]:
        # turning by ry > 0 takes the bob to -x
        return [y[1], -m * length * (g * np.sin(y[0]) - second(t) * np.cos(y[0])) / J]

    exact: Any = solve_ivp(swing, (0, 1.0), [0.0, 0.0], rtol=1e-10, atol=1e-12, dense_output=True).sol
    found = fx.time_response(
        fx.loads(PENDULUM),
        move={"cart.x": pivot},
        outputs=["bob.ry", "cart.tx"],
        dt=2e-3,
        duration=1.0,
        motion="large",
        order="full",
        damping=0.0,
        rho_infinity=0.8,
    )
    t = found.time
    angle, rate = exact(t)
    assert np.abs(angle).max() > 0.8
    assert np.abs(found.of("bob.ry") - angle).max() < 2e-3 * np.abs(angle).max()
    assert found.of("cart.tx") == pytest.approx(pivot(t), abs=1e-12)
    turning = np.array([swing(*own)[1] for own in zip(t, exact(t).T, strict=True)])
    force = 0.2 * second(t) + m * (second(t) - length * (turning * np.cos(angle) - rate**2 * np.sin(angle)))
    assert np.abs(found.of("cart.x:force") - force).max() < 0.01 * np.abs(force).max()


def test_shorter_steps_do_not_shake_the_force() -> None:
    """Where steps change their length, the force of the drive stays on its curve."""
    move = {"cart.x": lambda t: 2e-3 * np.sin(2 * np.pi * 8 * t) ** 3}
    options: dict[str, Any] = {
        "outputs": ["mass.tx"],
        "duration": 0.1,
        "motion": "large",
        "order": "full",
        "damping": 0.0,
        "rho_infinity": 0.5,
    }
    fine = fx.time_response(fx.loads(CARTS), move=move, dt=1e-4, **options)
    halved = fx.time_response(fx.loads(CARTS), move=move, dt=1e-3, local_error=2e-5, **options)
    assert any("halved" in note for note in halved.notes)
    force = fine.of("cart.x:force")[::10]
    assert np.abs(halved.of("cart.x:force") - force).max() < 0.01 * np.abs(force).max()
    assert not halved.warnings
    options["rho_infinity"] = 0.9
    swinging = fx.time_response(fx.loads(CARTS), move=move, dt=1e-3, local_error=2e-5, **options)
    assert any("take a rho_infinity of 0.6 or less" in warning.text for warning in swinging.warnings)


def test_low_order_and_small_motion_of_a_guide() -> None:
    """Its carriage is moved: low and full order need one force, in small motion m x'' + k x."""
    w, amplitude = 2 * np.pi * 15, 1e-4
    low, full = (
        fx.time_response(
            GUIDE,
            move={"carriage.x": lambda t: amplitude * (1 - np.cos(w * t))},
            outputs=["carriage.tz"],
            dt=1e-3,
            duration=0.06,
            damping=0.0,
            motion="large",
            order=order,
            rho_infinity=0.5,
        )
        for order in ("low", "full")
    )
    forces = [own.of("carriage.x:force") for own in (low, full)]
    assert np.abs(forces[0] - forces[1]).max() < 5e-3 * np.abs(forces[1]).max()
    pose = fx.stroke(GUIDE, move={"carriage.x": (0, 1e-6)}, steps=2, n=1).poses[0]
    k = pose.drive_stiffness["carriage.x"]
    m = k / (2 * np.pi * pose.frequency_hz[0]) ** 2
    steady = m * amplitude * w**2 * np.cos(w * full.time) + k * amplitude * (1 - np.cos(w * full.time))
    assert np.abs(forces[1] - steady)[5:].max() < 0.02 * np.abs(steady).max()


@pytest.mark.parametrize(
    ("options", "message"),
    (
        ({"motion": "small"}, "large motion"),
        ({"rho_infinity": 1.0}, "swing without end"),
        ({"move": {"cart.forward": np.zeros(9)}}, "is no displacement"),
        ({"move": {"cart.x": np.zeros(9), "nothing.x": np.zeros(9)}}, "there is no node"),
        ({"move": {"cart.x": np.full(9, np.nan)}}, "not finite"),
    ),
)
def test_what_is_refused(options: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"move": {"cart.x": np.zeros(9)}, "outputs": ["mass.tx"], "dt": 1e-3, "motion": "large"}
    with pytest.raises(OptionError, match=message):
        fx.time_response(fx.loads(CARTS), **given | options)
