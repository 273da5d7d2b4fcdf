"""Motion over time against closed forms: tops, pendulums, beams that stretch as they vibrate."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ellipk

import flexura as fx
from flexura.motion import NO_LOADS, Damping, Equations, Integrator, Loads, MotionState, MovingModel
from flexura.motion.se3 import rotation
from helpers.large_motion import straight_beams

Array = NDArray[np.float64]

UNDAMPED = Damping(0.0, 0.0)

TOP = """
flexura: 1
name: top
bodies:
  top: {centre: [0, 0, 0], mass: 2 kg, inertia: [0.01 kg*m^2, 0.02 kg*m^2, 0.025 kg*m^2], carries: [p]}
nodes: {p: [0.1 m, 0, 0]}
springs: {weak: {nodes: [p], stiffness: {tx: 1e-12 N/m}}}
"""

PENDULUM = """
flexura: 1
name: pendulum
bodies:
  bob: {centre: [0, 0, -0.2 m], mass: 0.5 kg, inertia: [1e-3 kg*m^2, 2e-3 kg*m^2, 1.5e-3 kg*m^2], carries: [pivot]}
nodes: {pivot: [0, 0, 0]}
springs: {pin: {nodes: [pivot], stiffness: {tx: 1e7 N/m, ty: 1e7 N/m, tz: 1e7 N/m, rx: 1e4 N*m/rad, rz: 1e4 N*m/rad}}}
"""


def at_constant(loads: Loads) -> Callable[[int], Loads]:
    return lambda _: loads


def test_a_free_top_keeps_energy_and_momentum() -> None:
    """About its middle axis it tumbles: exact turns have constant angular momentum and energy (Euler 1758)."""
    model = MovingModel.of(fx.assemble(fx.loads(TOP)).design)
    J, start = np.array([0.01, 0.02, 0.025]), np.array([0.02, 5.0, 0.01])
    velocity = np.zeros(model.n_dof)
    root = int(np.flatnonzero(model.dof[:, 3] >= 0)[0])
    velocity[model.dof[root]] = [0.3, 0.0, -0.1, *start]
    drift = []
    for dt in (4e-3, 2e-3):
        integrator = Integrator(Equations(model), UNDAMPED, dt, 1.0)
        count = round(4.0 / dt) + 1
        *_, last = integrator.through(model.rest, velocity, at_constant(NO_LOADS), count)
        R, w = last.frames.R[root], last.velocity[model.dof[root, 3:]]
        momentum = R @ (J * (R.T @ w))
        drift.append(np.abs(momentum - J * start).max() / np.abs(J * start).max())
        assert last.frames.x[root] - model.rest.x[root] == pytest.approx([1.2, 0.0, -0.4], abs=1e-9)
    assert np.abs(R - np.eye(3)).max() > 0.5
    assert drift[1] < 1e-5
    assert drift[0] / drift[1] == pytest.approx(4.0, rel=0.15)


def period(times: Array, values: Array) -> float:
    """From rest on one side to rest there again: twice the time between two zeros."""
    at = np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:]))[:2]
    zeros = [times[k] - values[k] * (times[k + 1] - times[k]) / (values[k + 1] - values[k]) for k in at]
    return float(2 * (zeros[1] - zeros[0]))


def test_a_pendulum_that_swings_far() -> None:
    """Period 4 sqrt(I / m g l) K(sin(angle / 2)), here with 120 degrees to either side."""
    model = MovingModel.of(fx.assemble(fx.loads(PENDULUM)).design)
    swing, g, inertia = np.radians(120), 9.81, 2e-3 + 0.5 * 0.2**2
    exact = 4 * np.sqrt(inertia / (0.5 * g * 0.2)) * ellipk(np.sin(swing / 2) ** 2)
    R = rotation(np.array([0.0, swing, 0.0]))
    start = model.rest._replace(x=model.rest.x @ R.T, R=np.broadcast_to(R, model.rest.R.shape).copy())
    start.R[-1] = np.eye(3)
    root = int(np.flatnonzero(model.dof[:, 3] >= 0)[0])
    errors = []
    for steps in (200, 400):
        dt = exact / steps
        integrator = Integrator(Equations(model), UNDAMPED, dt, 0.8)
        states = integrator.through(
            start, np.zeros(model.n_dof), at_constant(Loads({}, {}, np.array([0, 0, -g]))), steps + 1
        )
        x = np.array([state.frames.x[root, 0] for state in states])
        errors.append(period(dt * np.arange(len(x)), x) / exact - 1)
    assert abs(errors[1]) < 2e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


@pytest.mark.parametrize(("amplitude", "ratio"), [(1.0, 1.089158), (2.0, 1.317776)])
def test_a_beam_between_immovable_hinges(amplitude: float, ratio: float) -> None:
    """Frequencies over those of small vibrations at amplitudes over the radius of gyration (Woinowsky-Krieger 1950).

    The sine is an exact motion of his beam, whose axial inertia is none; here axial waves are 400 times as quick.
    """
    L, E, r, n = 1.0, 210e9, 1e-3, 8
    A, rho = 1e-4, 7800.0
    section = f"A: {A!r} m^2, Iy: {A * r**2!r} m^4, Iz: {A * r**2!r} m^4, J: {A * r**2!r} m^4"
    hinge = "{fixed: [tx, ty, tz, rx, ry]}"
    beam = straight_beams(
        [(0, 0, 0), (L, 0, 0)], section, n, E=E, G=E / 2.6, ground={"p0": hinge, "p1": hinge}, rho=rho
    )
    model = MovingModel.of(fx.assemble(beam).design)
    small = (np.pi / L) ** 2 * np.sqrt(E * r**2 / rho)
    a = amplitude * r
    x = model.rest.x[:, 0]
    step = np.zeros(model.dof.shape)
    step[:, 1], step[:, 5] = a * np.sin(np.pi * x / L), a * np.pi / L * np.cos(np.pi * x / L)
    step[:, 0] = -(a**2) * np.pi / (8 * L) * np.sin(2 * np.pi * x / L)
    step[model.dof < 0] = 0.0
    middle = int(np.argmin(np.abs(x[:-1] - L / 2)))
    dt = 2 * np.pi / small / 400
    integrator = Integrator(Equations(model), UNDAMPED, dt, 0.8)
    states = integrator.through(model.rest.moved(step), np.zeros(model.n_dof), at_constant(NO_LOADS), 340)
    y = np.array([state.frames.x[middle, 1] for state in states])
    assert 2 * np.pi / period(dt * np.arange(len(y)), y) / small == pytest.approx(ratio, rel=1e-3)


def test_damping_acts_on_deformation_not_on_turning() -> None:
    """Stiffness-proportional damping leaves a top alone that spins about a fixed axis."""
    model = MovingModel.of(fx.assemble(fx.loads(TOP)).design)
    velocity = np.zeros(model.n_dof)
    root = int(np.flatnonzero(model.dof[:, 3] >= 0)[0])
    velocity[model.dof[root, 5]] = 10.0
    last: MotionState
    *_, last = Integrator(Equations(model), Damping(0.0, 1e-2), 1e-3, 1.0).through(
        model.rest, velocity, at_constant(NO_LOADS), 200
    )
    assert last.velocity == pytest.approx(velocity, abs=1e-9)
    *_, last = Integrator(Equations(model), Damping(0.5, 0.0), 1e-3, 1.0).through(
        model.rest, velocity, at_constant(NO_LOADS), 201
    )
    assert last.velocity[model.dof[root, 5]] == pytest.approx(10 * np.exp(-0.5 * 0.2), rel=1e-6)


def test_local_errors_choose_the_steps() -> None:
    """The pendulum of 120 degrees in samples of a tenth of its period: the tolerance takes as many steps as it needs,
    and what is left of the period falls with it."""
    model = MovingModel.of(fx.assemble(fx.loads(PENDULUM)).design)
    swing, g, inertia = np.radians(120), 9.81, 2e-3 + 0.5 * 0.2**2
    exact = 4 * np.sqrt(inertia / (0.5 * g * 0.2)) * ellipk(np.sin(swing / 2) ** 2)
    R = rotation(np.array([0.0, swing, 0.0]))
    start = model.rest._replace(x=model.rest.x @ R.T, R=np.broadcast_to(R, model.rest.R.shape).copy())
    start.R[-1] = np.eye(3)
    root = int(np.flatnonzero(model.dof[:, 3] >= 0)[0])
    off, taken = [], []
    for tolerance in (1e-3, 1e-5):  # of a method of second order: global errors fall with the power 2/3
        integrator = Integrator(Equations(model), UNDAMPED, exact / 10, 0.8, tolerance)
        loads = at_constant(Loads({}, {}, np.array([0, 0, -g])))
        *_, last = integrator.through(start, np.zeros(model.n_dof), loads, 11)
        off.append(np.abs(last.frames.x[root] - start.x[root]).max() / 0.2)
        taken.append(integrator.steps.taken)
        assert integrator.steps.not_accurate > 0
        assert integrator.steps.shortest < exact / 10
    assert off[1] < 1e-3
    assert off[1] < off[0] / 10
    assert 10 < taken[0] < taken[1] < 4000
