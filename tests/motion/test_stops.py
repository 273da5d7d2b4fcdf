"""Stops against closed forms: contacts on springs, restitution of Hunt and Crossley, momentum, and derivatives."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

import flexura as fx
from flexura.motion import MovingModel
from flexura.motion.elements import Frames, Rates, turned
from flexura.motion.stops import Stops

Array = NDArray[np.float64]

EXAMPLES = Path(__file__).parents[2] / "examples"
MASS, STIFFNESS, GAP = 0.1, 1e5, 0.5e-3

BALL = """
flexura: 1
name: ball
bodies: {{ball: {{centre: [0, 0, 20 mm], mass: 0.1 kg, inertia: [1e-5 kg*m^2, 1e-5 kg*m^2, 1e-5 kg*m^2]}}}}
springs:
  guide:
    nodes: [ball]
    stiffness: {{tx: 1 N/mm, ty: 1 N/mm, tz: {guide} N/m, rx: 1 N*m/rad, ry: 1 N*m/rad, rz: 1 N*m/rad}}
stops:
  end: {{nodes: [ball], direction: {direction}, gap: 0.5 mm, stiffness: {stiffness} N/mm, damping: {damping} s/m}}
actuators: {{push: {{type: force, nodes: [ball], direction: z}}}}
"""

PAIR = """
flexura: 1
name: pair
bodies:
  left: {centre: [0, 0, 0], mass: 0.2 kg, inertia: [1e-5 kg*m^2, 2e-5 kg*m^2, 3e-5 kg*m^2], carries: [tip]}
  right: {centre: [30 mm, 5 mm, 0], mass: 0.3 kg, inertia: [1e-5 kg*m^2, 2e-5 kg*m^2, 3e-5 kg*m^2], carries: [head]}
nodes: {tip: [10 mm, 5 mm, 2 mm], head: [20 mm, 5 mm, -1 mm]}
springs: {weak: {nodes: [tip], stiffness: {tx: 1e-9 N/m}}, tie: {nodes: [tip, head], stiffness: {tx: 1e-9 N/m}}}
stops: {buffer: {nodes: [tip, head], direction: -x, gap: 2 mm, stiffness: 20 N/mm, damping: 0.4 s/m}}
"""


def ball(guide: float = 1e-3, damping: float = 0.0, direction: str = "z", stiffness: float = 100.0) -> fx.Mechanism:
    return fx.loads(BALL.format(guide=guide, damping=damping, direction=direction, stiffness=stiffness))


class Flight(NamedTuple):
    """Times, positions and speeds of the ball, and the result."""

    t: Array
    x: Array
    v: Array
    result: fx.TimeResponse


def flight(mechanism: fx.Mechanism, duration: float, dt: float = 1e-4, **options: object) -> Flight:
    result = fx.time_response(
        mechanism,
        outputs=["ball.tz", "ball.tz:velocity"],
        dt=dt,
        duration=duration,
        motion="large",
        order="full",
        **{"rho_infinity": 1.0, "damping": 0.0, "local_error": 1e-5, **options},
    )
    x, v = result.response
    return Flight(result.time, x, v, result)


def told(result: fx.TimeResponse) -> tuple[float, float]:
    """Depth, m, and force, N, of the note of the only stop that is met."""
    (note,) = (note for note in result.notes if note.startswith("the stop"))
    words = note.replace(",", "").split()
    depth, force = (words.index(own) for own in ("deep", "with"))
    unit = {"mm": 1e-3, "µm": 1e-6}[words[depth - 1]]
    return float(words[depth - 2]) * unit, float(words[force + 1])


def test_contact_on_a_guide_has_its_time_its_depth_and_its_energy() -> None:
    """On the stop the ball swings about x0 with (k + k1)/m: harmonic between entry and exit."""
    k1, v0 = 1e3, 0.2
    W, w = np.sqrt((STIFFNESS + k1) / MASS), np.sqrt(k1 / MASS)
    v = np.sqrt(v0**2 - (w * GAP) ** 2)
    off = k1 * GAP / (STIFFNESS + k1)
    deepest, lasting = np.hypot(off, v / W) - off, 2 * np.arctan2(v / W, off) / W
    entry = np.arcsin(w * GAP / v0) / w
    found = flight(ball(k1), 0.0125, impulses={"push": MASS * v0})
    depth, force = told(found.result)
    assert depth == pytest.approx(deepest, rel=5e-3)  # three digits are told
    assert force == pytest.approx(STIFFNESS * deepest, rel=5e-3)
    assert found.x.max() - GAP == pytest.approx(deepest, rel=2e-3)
    energy = MASS * found.v**2 / 2 + k1 * found.x**2 / 2 + STIFFNESS * np.maximum(found.x - GAP, 0) ** 2 / 2
    assert energy == pytest.approx(MASS * v0**2 / 2, rel=2e-4)
    back = entry + lasting  # when it leaves, at the speed with which it came
    leaving = np.interp(back, found.t, found.v), np.interp(back, found.t, found.x)
    assert leaving == (pytest.approx(-v, rel=1e-3), pytest.approx(GAP, rel=2e-3))
    assert not found.result.warnings


def test_a_mass_that_falls_on_a_spring() -> None:
    """Its peak force is F (1 + sqrt(1 + 2 k h/F)), twice the weight without a fall, whatever its mass."""
    push = 2.0
    found = flight(ball(), 0.022, inputs={"push": np.full(221, push)})
    peak = push * (1 + np.sqrt(1 + 2 * STIFFNESS * GAP / push))
    assert told(found.result)[1] == pytest.approx(peak, rel=5e-3)
    assert STIFFNESS * (found.x.max() - GAP) == pytest.approx(peak, rel=1e-3)
    fall = np.sqrt(2 * GAP * MASS / push)
    W, v = np.sqrt(STIFFNESS / MASS), push * fall / MASS
    lasting = 2 * (np.pi - np.arctan2(v * W * MASS, push)) / W
    period = 2 * fall + lasting
    top = 150 + int(np.argmin(found.x[150:200]))  # where it has come to rest again, at the height from which it fell
    assert found.t[top] == pytest.approx(period, abs=1e-4)
    assert found.x[top] == pytest.approx(0.0, abs=1e-3 * GAP)


@pytest.mark.parametrize("loss", (0.05, 0.5, 2.0))
def test_restitution_is_that_of_hunt_and_crossley(loss: float) -> None:
    """m v dv/dp = - k p (1 + c v) has G(v) = c v - ln(1 + c v) the same on entry and on exit; for slow impacts the
    coefficient of restitution is 1 - 2 c v/3."""
    v = 0.25
    c = loss / v

    def G(speed: float) -> float:
        return c * speed - np.log1p(c * speed)

    exit_speed = brentq(lambda out: G(-out) - G(v), 1e-9, min(v, (1 - 1e-9) / c))
    found = flight(ball(damping=c), 0.01, impulses={"push": MASS * v})
    assert -found.v[-1] == pytest.approx(exit_speed, rel=1e-3)
    if loss < 0.1:
        assert -found.v[-1] / v == pytest.approx(1 - 2 * loss / 3, abs=loss**2)
    assert found.x[-1] < GAP


def test_steps_in_contact_follow_its_error() -> None:
    """A sample in all of the contact would do without: the energy is kept to 2e-3, and a tighter error to less."""
    off = []
    for local_error in (None, 1e-4, 1e-5):
        found = flight(ball(), 0.02, dt=2e-3, impulses={"push": MASS * 0.2}, local_error=local_error)
        off.append(abs(found.v[-1] / 0.2 + 1))
        assert not found.result.warnings
    assert off[0] < 2e-3
    assert off[2] < off[0] / 20


def test_contacts_of_few_steps_are_told() -> None:
    """A stop so stiff that the shortest steps pass its contact by."""
    found = flight(ball(stiffness=1e13), 0.02, dt=1e-3, impulses={"push": MASS * 0.2}, local_error=None)
    (warning,) = found.result.warnings
    assert (warning.kind, warning.place, warning.limit) == ("contact", "end", 8)
    assert warning.value < 8
    assert "lasts" in warning.text


def test_the_other_side_is_free() -> None:
    """A stop against -z lets the ball go to z, and is met on its way back."""
    k1 = 1e3
    found = flight(ball(k1, direction="-z"), 0.06, impulses={"push": MASS * 0.2})
    free = 0.2 * np.sqrt(MASS / k1)
    assert found.x.max() == pytest.approx(free, rel=1e-3)
    assert -GAP - 0.25e-3 < found.x.min() < -GAP


def stops_of(mechanism: fx.Mechanism) -> tuple[MovingModel, Stops]:
    model = MovingModel.of(fx.assemble(mechanism).design)
    (stops,) = model.stops
    return model, stops


def pressed() -> tuple[MovingModel, Stops, Frames, Array]:
    """The pair, turned at random and pressed together, with velocities."""
    model, stops = stops_of(fx.loads(PAIR))
    rng = np.random.default_rng(3)
    step, velocity = (rng.normal(size=(len(model.dof), 6)) for _ in range(2))
    step[:, :3] *= 2e-3
    step[:, 3:] *= 0.3
    first, second = stops.node[0]
    frames = model.rest.moved(step * (model.dof >= 0))
    depth, rows = stops.depths(frames)
    closer = np.zeros_like(step)
    closer[second, :3] = (1e-3 - depth[0]) * rows[0, 6:9]
    frames = frames.moved(closer)
    assert stops.depths(frames)[0] == pytest.approx(1e-3)
    assert first != second
    return model, stops, frames, velocity


def test_derivatives_are_those_of_the_forces() -> None:
    """Of the force by displacements and, with damping, by velocities: central differences."""
    model, stops, frames, velocity = pressed()
    response = stops.response(frames)
    tangent = response.tangent[0].copy()
    rates = Rates(velocity, np.zeros_like(velocity), 0.0)
    more, by_rate = (own[0] for own in stops.rate_tangents(frames, velocity))
    h = 1e-7
    numeric, numeric_rate, energy = np.zeros((12, 12)), np.zeros((12, 12)), np.zeros(12)
    for k in range(12):
        node, component = stops.node[0, k // 6], k % 6
        unit = np.zeros((len(model.dof), 6))
        unit[node, component] = h
        ahead, behind = (stops.response(frames.moved(sign * unit)) for sign in (1, -1))
        numeric[:, k] = (ahead.force[0] - behind.force[0]) / (2 * h)
        energy[k] = (ahead.energy[0] - behind.energy[0]) / (2 * h)
        faster, slower = (
            stops.kinetics(frames, rates._replace(velocity=velocity + sign * unit)).force[0] for sign in (1, -1)
        )
        numeric_rate[:, k] = (faster - slower) / (2 * h)
    for six in (slice(0, 6), slice(6, 12)):
        tangent[six, six] += turned(response.force[:, six])[0]
    size = np.abs(numeric).max()
    assert np.abs(numeric - tangent).max() < 1e-6 * size
    assert response.force[0] == pytest.approx(energy, rel=1e-5, abs=1e-6 * np.abs(energy).max())
    assert np.abs(numeric_rate - by_rate).max() < 1e-5 * np.abs(by_rate).max()
    share = stops.pushes(frames, velocity)[0] / (2e4 * 1e-3) - 1
    assert more == pytest.approx(share * 2e4 * np.outer(stops.depths(frames)[1], stops.depths(frames)[1]))


def test_it_never_pulls_and_balances() -> None:
    """Whatever the velocities: no pull, and forces and moments of both ends cancel."""
    _, stops, frames, velocity = pressed()
    pushes = [stops.pushes(frames, size * velocity)[0] for size in np.linspace(-1e3, 1e3, 41)]
    assert min(pushes) == 0.0
    assert max(pushes) > 100
    force = stops.kinetics(frames, Rates(velocity, 0 * velocity, 0.0)).force[0].reshape(2, 6)
    assert force[:, :3].sum(axis=0) == pytest.approx(0.0, abs=1e-12)
    moments = force[:, 3:] + np.cross(frames.x[stops.node[0]], force[:, :3])
    assert moments.sum(axis=0) == pytest.approx(0.0, abs=1e-12 * np.abs(force).max() + 1e-13)


def test_a_stroke_meets_them() -> None:
    """The force of the drive is that of the guide, and beyond the gap that of the stop besides."""
    result = fx.stroke(ball(1e3), move={"ball.z": (0, 0.7e-3)}, steps=8, n=1)
    x = np.array([pose.move["ball.z"] for pose in result.poses])
    force = np.array([pose.reaction["ball.z"] for pose in result.poses])
    assert force == pytest.approx(1e3 * x + STIFFNESS * np.maximum(x - GAP, 0), rel=1e-9)
    assert result.poses[-1].drive_stiffness["ball.z"] == pytest.approx(STIFFNESS + 1e3, rel=1e-9)
    assert any("the stop end is met, 0.2 mm deep at most, with 20 N, first at" in note for note in result.notes)


def test_loads_press_on_them() -> None:
    result = fx.stroke(ball(1e3), loads={"ball": ([0.0] * 6, [0, 0, 30, 0, 0, 0])}, steps=5, n=1, nodes=["ball"])
    x = (30 + STIFFNESS * GAP) / (STIFFNESS + 1e3)
    assert result.poses[-1].displacement["ball"][2] == pytest.approx(x, rel=1e-9)
    assert not result.stopped
    assert not result.warnings


def test_linear_motion_passes_them_with_a_warning() -> None:
    mechanism = ball(1e3)
    assert fx.statics(mechanism, actuators={"push": 0.4}).warnings == ()
    pushed = fx.statics(mechanism, actuators={"push": 1.0})
    assert pushed.displacement("ball")[2] == pytest.approx(1e-3)
    moved = fx.time_response(mechanism, impulses={"push": MASS * 0.2}, outputs=["ball.tz"], dt=1e-3, duration=0.05)
    for warnings, travel in ((pushed.warnings, 1e-3), (moved.warnings, 0.2 * np.sqrt(MASS / 1e3))):
        (warning,) = (own for own in warnings if own.kind == "contact")
        assert (warning.place, warning.limit) == ("end", pytest.approx(GAP))
        assert warning.value == pytest.approx(travel, rel=0.01)
        assert "is not met" in warning.text


def test_about_a_pose_that_presses_it_is_a_spring() -> None:
    """It holds on, and a warning says where it would let go."""
    posed = fx.loads(BALL.format(guide=1e3, damping=0, direction="z", stiffness=100) + "at: {ball: {z: 0.6 mm}}\n")
    assert fx.modes(posed, n=6).frequency_hz[5] == pytest.approx(np.sqrt((STIFFNESS + 1e3) / MASS) / (2 * np.pi))
    pulled = fx.statics(posed, actuators={"push": -15.0})
    (warning,) = (own for own in pulled.warnings if own.kind == "contact")
    assert warning.value == pytest.approx(15 / (STIFFNESS + 1e3))
    assert "is left by" in warning.text
    assert not [own for own in fx.statics(posed, actuators={"push": -5.0}).warnings if own.kind == "contact"]


MIRRORED = """
flexura: 1
name: two
parameters: {g: 0.5 mm}
substructures:
  half:
    bodies: {b: {centre: [0, 0, 0], mass: 0.1 kg, inertia: [1e-5 kg*m^2, 1e-5 kg*m^2, 1e-5 kg*m^2]}}
    springs: {k: {nodes: [b], stiffness: {tx: 1 N/mm, ty: 1 N/mm, tz: 1 N/mm, rx: 1 N*m/rad, ry: 1 N*m/rad, rz: 1 N*m}}}
    stops: {end: {nodes: [b], direction: x, gap: g, stiffness: 1 kN/mm}}
    interface: [b]
instances:
  half: {of: half, pattern: {type: mirror, normal: x, point: [50 mm, 0, 0]}}
springs: {tie: {nodes: [half1.b, half2.b], stiffness: {tx: 1e-9 N/m}}}
stops: {buffer: {nodes: [half1.b, half2.b], direction: -x, gap: 1.1 mm, stiffness: 2 N/um}}
"""


def test_copies_have_their_own() -> None:
    """A mirrored copy meets its stop in the mirrored direction, and the file is written as it was read."""
    mechanism = fx.loads(MIRRORED)
    assert fx.loads(fx.dumps(mechanism)) == mechanism
    move = {"half1.b.x": (0, 0.6e-3), "half2.b.x": (0, -0.6e-3)}
    last = fx.stroke(mechanism, move=move, steps=3, n=1).poses[-1]
    force = 1e3 * 0.6e-3 + 1e6 * 0.1e-3 + 2e6 * 0.1e-3
    assert list(last.reaction.values()) == pytest.approx([force, -force], rel=1e-6)


def test_low_order_meets_them() -> None:
    """The guide against a stop on its carriage: reactions of the low order are those of the full order."""
    text = (EXAMPLES / "guide/guide.yaml").read_text(encoding="utf-8")
    guide = fx.loads(text + "\nstops: {end: {nodes: [carriage], direction: x, gap: 1 mm, stiffness: 20 N/mm}}\n")
    move = {"carriage.x": (0, 2e-3)}
    low, full = (fx.stroke(guide, move=move, steps=3, n=1, order=order) for order in ("low", "full"))
    forces = [[pose.reaction["carriage.x"] for pose in own.poses] for own in (low, full)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-3)
    assert forces[1][2] > 20.0
    assert all(any("the stop end is met, 1 mm deep" in note for note in own.notes) for own in (low, full))
