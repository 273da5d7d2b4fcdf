"""Closed loops: closed forms of one mass under PID control, Lyapunov's equation by SciPy, margins by python-control's
definitions, simulation in steps, and loops that are unstable."""

import numpy as np
import pytest
from scipy.linalg import matrix_balance, solve_continuous_lyapunov

import flexura as fx
from flexura.systems import filter_of
from helpers.disturbed import one_mass, two_masses

FORCE = "{air: {input: block.tx, density: 3 N/sqrt(Hz)}}"
M, K, C = 2.0, 800.0, 4.0


def closed_with(mechanism: fx.Mechanism, **controllers: str) -> fx.Mechanism:
    """The mechanism with controllers, as a file has them."""
    listed = "\n".join(f"  {name}: {text}" for name, text in controllers.items())
    return fx.loads(f"{fx.dumps(mechanism)}controllers:\n{listed}\n")


def test_proportional_feedback_is_a_spring():
    """sigma^2 = S/(4 (k + kp) c)."""
    mechanism = closed_with(one_mass(FORCE), servo="{sensor: x, actuator: block.tx, proportional: 2400 N/m}")
    assert fx.budget(mechanism, outputs=["x"]).of("x") == pytest.approx(3 / np.sqrt(4 * (K + 2400) * C), rel=1e-11)
    assert fx.budget(mechanism, outputs=["x"], loop="open").of("x") == pytest.approx(3 / np.sqrt(4 * K * C), rel=1e-11)


def test_velocity_feedback_is_a_dashpot():
    """sigma^2 = S/(4 k (c + g)), and the loop comes no nearer to -1 than one."""
    mechanism = closed_with(one_mass(FORCE), damper="{sensor: v, actuator: block.tx, proportional: 12 N*s/m}")
    assert fx.budget(mechanism, outputs=["x"]).of("x") == pytest.approx(3 / np.sqrt(4 * K * (C + 12)), rel=1e-11)
    [loop] = fx.closed_loop(mechanism).loops
    assert loop.distance == pytest.approx(1, rel=1e-4) and np.isinf(loop.gain_margin)


def test_integral_control_by_the_routh_table():
    """m s^3 + c s^2 + k s + ki: sigma_x^2 = S/2 c/(2 m (...)) of order three (Newland 1993, appendix 1); stable up to
    ki = c k/m, which is the gain margin."""
    ki = 500.0
    mechanism = closed_with(one_mass(FORCE), servo="{sensor: x, actuator: block.tx, integral: 500 N/m/s}")
    a0, a1, a2, a3 = ki, K, C, M
    mean_square = np.pi * a0 * a3 / (a0 * a3 * (a1 * a2 - a0 * a3))  # H = i w/(...): B1 = 1
    found = fx.budget(mechanism, outputs=["x"])
    assert found.of("x") ** 2 == pytest.approx(9 * mean_square / (4 * np.pi), rel=1e-10)
    [loop] = fx.closed_loop(mechanism).loops
    assert loop.gain_margin == pytest.approx(C * K / M / ki, rel=1e-6)
    beyond = closed_with(one_mass(FORCE), servo="{sensor: x, actuator: block.tx, integral: 1700 N/m/s}")
    with pytest.raises(fx.SolverError, match=r"unstable: the pole at 3\.\d+ Hz grows by .* most of it mode 1, 3\.18"):
        fx.closed_loop(beyond)


def test_noise_of_the_sensor_moves_what_follows_it():
    """Far below the bandwidth of an integral loop |T| = 1: the motion is the noise of the sensor."""
    text = "{gauge: {sensor: x, density: 1 um/sqrt(Hz), band: [0, 1 mHz]}}"
    mechanism = closed_with(one_mass(text), servo="{sensor: x, actuator: block.tx, integral: 500 N/m/s}")
    assert fx.budget(mechanism).of("x") == pytest.approx(1e-6 * np.sqrt(1e-3), rel=1e-3)
    assert fx.budget(mechanism, loop="open").of("x") == pytest.approx(1e-6 * np.sqrt(1e-3))


SERVO = (
    "{sensor: low.tx, actuator: coil, proportional: 500 N/m, integral: 1000 N/m/s, derivative: 30 N*s/m,"
    " low_pass: 60 Hz, delay: 0.2 ms, sample_time: 0.2 ms, notches: [{frequency: 40 Hz, ratio: 0.4, depth: 0.2}]}"
)
ALL = """{amplifier: {input: coil, density: 3 mN/sqrt(Hz)}, floor: {base: x, spectrum: VC-A},
  gauge: {sensor: low.tx, density: 1 um/sqrt(Hz)}}"""


def test_a_loop_with_states_by_lyapunov():
    mechanism = closed_with(two_masses(ALL), servo=SERVO)
    model = fx.closed_loop(mechanism).model
    A, (scale, _) = matrix_balance(model.A, permute=False, separate=True)
    for source, name, density in (("amplifier", "coil", 3e-3), ("gauge", "servo.noise", 1e-6)):
        b = model.B[:, [[c.name for c in model.inputs].index(name)]] / scale[:, None]
        P = solve_continuous_lyapunov(A, -(density**2) / 2 * b @ b.T)
        found = fx.budget(mechanism, sources=[source])
        expected = np.sqrt(np.diag((model.C * scale) @ P @ (model.C * scale).T))[:2]
        assert found.rms == pytest.approx(expected, rel=1e-9)
        assert found.loop == "closed" and found.part_shares.sum(axis=0) == pytest.approx([1, 1], abs=1e-12)


def test_filters_are_what_they_say():
    """Responses by their formulas, and of the states with dead time, at frequencies that Pade's function is for."""
    hz = np.geomspace(0.1, 100, 50)
    s, w = 2j * np.pi * hz, 2 * np.pi * 60
    controller = fx.describe.Controller(
        sensor="x", actuator="y", proportional=5, integral=7, derivative=2, low_pass=60, delay=2e-4, sample_time=1e-4,
        lead=(3, 30), notches=({"frequency": 40, "ratio": 0.4, "depth": 0.2},),
    )  # fmt: skip
    notch = 2 * np.pi * 40
    formula = (5 + 7 / s + 2 * s) * w**2 / (s**2 + np.sqrt(2) * w * s + w**2)
    formula *= (1 + s / (6 * np.pi)) / (1 + s / (60 * np.pi))
    formula *= (s**2 + 0.16 * notch * s + notch**2) / (s**2 + 0.8 * notch * s + notch**2)
    formula *= np.exp(-2e-4 * s) * (1 - np.exp(-1e-4 * s)) / (1e-4 * s)
    own = filter_of(controller)
    assert own.response(hz) == pytest.approx(formula, rel=1e-12)
    A, B, C, D = own.with_dead_time
    states = np.array([(C @ np.linalg.solve(x * np.eye(len(A)) - A, B) + D)[0, 0] for x in s])
    assert states == pytest.approx(formula, rel=2e-4)  # of the hold's amplitude, (pi f T)^2/6
    for kind, extra, value in (
        ("iff", {"gain": 9, "leak": 2}, 9 / (s + 4 * np.pi)),
        ("ppf", {"gain": 0.3, "frequency": 60, "ratio": 0.2}, 0.3 * w**2 / (s**2 + 0.4 * w * s + w**2)),
        ("lead", {"gain": 3, "lead": (3, 30)}, 3 * (1 + s / (6 * np.pi)) / (1 + s / (60 * np.pi))),
        (
            "pid",
            {"proportional": 4, "derivative": 2, "low_pass": 60},
            (4 + 2 * s) / (s**2 / w**2 + np.sqrt(2) * s / w + 1),
        ),
        ("pid", {"integral": 4}, 4 / s),
        ("pid", {"proportional": 4, "low_pass": 60}, 4 / (s**2 / w**2 + np.sqrt(2) * s / w + 1)),
    ):
        own = filter_of(fx.describe.Controller(type=kind, sensor="x", actuator="y", **extra))
        assert own.response(hz) == pytest.approx(value, rel=1e-12)
        A, B, C, D = own.matrices
        states = np.array([(C @ np.linalg.solve(x * np.eye(len(A)) - A, B) + D)[0, 0] for x in s])
        assert states == pytest.approx(value, rel=1e-10)


def test_margins_by_their_definitions():
    """On a fine grid: where the loop is real, where it has the size one, where it is nearest to -1."""
    mechanism = closed_with(two_masses(ALL), servo=SERVO)
    [loop] = fx.closed_loop(mechanism).loops
    hz = np.geomspace(0.01, 1e4, 400_000)
    plant = (
        fx.system(mechanism, inputs=["coil"], outputs=["low.tx"], order="full").modal().viscous().response(hz)[:, 0, 0]
    )
    L = plant * filter_of(mechanism.controllers["servo"]).response(hz)
    assert loop.distance == pytest.approx(np.abs(1 + L).min(), rel=1e-6)
    assert loop.sensitivity_peak == pytest.approx(np.abs(1 / (1 + L)).max(), rel=1e-6)
    crosses = np.flatnonzero(np.diff(np.sign(np.abs(L) - 1)))
    assert loop.crossover_hz == pytest.approx(hz[crosses[-1]], rel=1e-4)
    assert loop.phase_margin == pytest.approx(np.abs(np.angle(-L[crosses])).min(), rel=1e-3)
    real = np.flatnonzero(np.diff(np.sign(L.imag)))
    gains = [max(-x, -1 / x) for x in L.real[real] if x < 0]
    assert loop.gain_margin == pytest.approx(min(gains), rel=1e-3)


def test_the_loop_is_at_its_margin_when_the_gain_is_raised_by_it():
    mechanism = closed_with(two_masses(ALL), servo=SERVO)
    [loop] = fx.closed_loop(mechanism).loops
    servo = mechanism.controllers["servo"]
    for factor in (0.99, 1.01):
        raised = {
            name: {"value": loop.gain_margin * factor * getattr(servo, name).value}
            for name in ("proportional", "integral", "derivative")
        }
        own = servo.model_copy(update=raised)
        if factor < 1:
            fx.closed_loop(mechanism, controllers={"servo": own})
        else:
            with pytest.raises(fx.SolverError, match="the closed loop is unstable"):
                fx.closed_loop(mechanism, controllers={"servo": own})


def test_a_sampled_loop_in_steps_is_what_its_states_say():
    """The controller by Tustin's rule around the plant held over steps, with a dead time of a step, against the
    response of the continuous model: a step of the reference, to 1 % of it."""
    text = "{sensor: low.tx, actuator: coil, proportional: 20 N/m, integral: 600 N/m/s, delay: 2 ms, sample_time: 2 ms}"
    mechanism, dt, n = closed_with(two_masses(ALL), servo=text), 2e-3, 1500
    plant = fx.state_space(fx.system(mechanism, inputs=["coil"], outputs=["low.tx"], order="full"), n=2)
    stepped = plant.discretised(dt, delay=dt)
    x, integral, before, read = np.zeros(stepped.order), 0.0, 1e-3, []
    for _ in range(n):
        y = float((stepped.C @ x)[0])
        read.append(y)
        e = 1e-3 - y
        integral += 600 * dt / 2 * (e + before)
        before = e
        x = stepped.A @ x + stepped.B[:, 0] * (20 * e + integral)
    found = fx.time_response(
        mechanism, inputs={"servo.reference": np.full(n, 1e-3)}, outputs=["low.tx"], dt=dt, hold="zoh", loop="closed"
    )
    assert found.response[0] == pytest.approx(np.array(read), abs=1e-5)


def test_the_loop_is_closed_in_every_verb():
    """A step settles at the static gain of the frequency response, which is one with an integrator; the export is the
    same model."""
    mechanism = closed_with(two_masses(ALL), servo=SERVO)
    ends = {"inputs": ["servo.reference"], "outputs": ["low.tx", "servo.command"], "loop": "closed"}
    response = fx.frequency_response(mechanism, frequency_hz=[1e-4, 3.0], **ends)
    assert abs(response.response[0, 0, 0]) == pytest.approx(1, rel=1e-5)
    model = fx.closed_loop(mechanism).model.selected(["servo.reference"], ["servo.command"])
    assert model.frequency_response([3.0])[0, 0, 0] == pytest.approx(response.response[1, 1, 0])
    t = np.arange(40_000) * 1e-3
    wave = fx.time_response(
        mechanism, inputs={"servo.reference": np.sin(2 * np.pi * 3 * t)}, outputs=["low.tx"], dt=1e-3, loop="closed"
    ).response[0]
    tail = t > 35
    fitted = 2 * np.mean(wave[tail] * np.exp(-2j * np.pi * 3 * t[tail])) * 1j
    assert fitted == pytest.approx(response.response[1, 0, 0], rel=2e-3)
    opened = fx.frequency_response(mechanism, frequency_hz=[3.0], inputs=["coil"], outputs=["low.tx"])
    both = fx.frequency_response(mechanism, frequency_hz=[3.0], inputs=["coil"], outputs=["low.tx"], loop="closed")
    assert abs(both.response[0, 0, 0]) < abs(opened.response[0, 0, 0])


def test_what_studies_ask_is_with_the_loop_closed():
    servo = fx.load("examples/guide/servo.yaml")
    closed, opened = fx.budget(servo, outputs=["gauge"]), fx.budget(servo, outputs=["gauge"], loop="open", order="full")
    asked = fx.questions(servo, "rms(gauge), rms(gauge, floor)")
    assert asked.values({}).value[0] == pytest.approx([closed.rms[0], closed.rms_by_source[0, 0]], rel=1e-9)
    assert closed.rms[0] < 0.05 * opened.rms[0]
    found = asked.slopes({}, ["thickness"])
    assert np.isfinite(found.slope).all() and not found.is_exact.any()


def test_passive_feedback_of_velocity_stays_passive():
    """Two loops of velocity at their own forces: the mobility between them is symmetric, its real part positive."""
    mechanism = closed_with(
        two_masses("{}"),
        a="{sensor: low.tx:velocity, actuator: low.tx, proportional: 3 N*s/m}",
        b="{sensor: top.tx:velocity, actuator: top.tx, proportional: 1 N*s/m}",
    )
    ends = {"inputs": ["low.tx", "top.tx"], "outputs": ["low.tx:velocity", "top.tx:velocity"]}
    H = fx.frequency_response(mechanism, band=(0.1, 30), loop="closed", **ends).response
    assert np.abs(H[:, 0, 1] - H[:, 1, 0]).max() < 1e-12 * np.abs(H).max()
    assert (np.linalg.eigvalsh((H + np.conj(np.swapaxes(H, 1, 2))) / 2) > 0).all()


def test_pairs_of_patterns_are_loops_of_their_own():
    mechanism = two_masses("{}")
    other = {name: own.model_copy(update={"nodes": ("low",)}) for name, own in (("v", mechanism.sensors["v"]),)}
    mechanism = mechanism.model_copy(
        update={
            "sensors": {"vel_a": other["v"], "vel_b": mechanism.sensors["v"]},
            "actuators": {
                "coil_a": mechanism.actuators["coil"],
                "coil_b": mechanism.actuators["coil"].model_copy(update={"nodes": ("top",)}),
            },
        }
    )
    paired = closed_with(mechanism, damper='{sensor: "vel_*", actuator: "coil_*", proportional: 2 N*s/m}')
    assert [loop.name for loop in fx.closed_loop(paired).loops] == ["damper1", "damper2"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{sensor: x, actuator: coil, proportional: 5 N}", r"controllers\.servo\.proportional: a gain of other units"),
        ("{sensor: y, actuator: coil, proportional: 5 N/m}", r"servo\.sensor: there is no such sensor"),
        ("{sensor: x, actuator: ground.tx, proportional: 5 N/m}", r"servo\.actuator: a controller moves no base"),
        ("{sensor: x, actuator: coil, derivative: 5 N*s/m}", "a derivative grows without end"),
        ("{sensor: x, actuator: coil}", "no gain is given"),
        ("{type: ppf, sensor: x, actuator: coil, gain: 5 N/m}", "positive position feedback has a frequency"),
        ("{type: iff, sensor: x, actuator: coil, proportional: 5 N/m}", "has one gain, called gain"),
        ("{sensor: x, actuator: coil, integral: 5 N/m}", r"servo\.integral: a gain of other units"),
    ],
)
def test_what_a_file_may_not_say(text, message):
    with pytest.raises(fx.ModelError, match=message) as refused:
        closed_with(two_masses("{}"), servo=text)
    assert all(":" in problem.where for problem in refused.value.problems)


def test_gains_are_expressions_over_parameters():
    mechanism = fx.loads(
        fx.dumps(two_masses(ALL)).replace("k2: 300 N/m", "k2: 300 N/m\n  kp: 100 N/m")
        + "controllers:\n  servo: {sensor: x, actuator: coil, proportional: 2*kp}\n"
    )
    assert fx.loads(fx.dumps(mechanism)) == mechanism
    plain = closed_with(two_masses(ALL), servo="{sensor: x, actuator: coil, proportional: 60 N/m}")
    assert fx.budget(mechanism, {"kp": 30.0}).rms == pytest.approx(fx.budget(plain).rms, rel=1e-12)


def test_what_loops_refuse():
    with pytest.raises(fx.OptionError, match="no loop can be closed: describe `controllers`"):
        fx.closed_loop(two_masses(ALL))
    mechanism = closed_with(two_masses(ALL), servo=SERVO)
    with pytest.raises(fx.OptionError, match="loop is open or closed, not 'shut'"):
        fx.budget(mechanism, loop="shut")
    with pytest.raises(fx.OptionError, match="it is not reduced"):
        fx.budget(mechanism, loop="closed", keep=2)
    with pytest.raises(fx.OptionError, match="belong to open loops"):
        fx.frequency_response(mechanism, frequency_hz=[1.0], loop="closed", order="exact")
    with pytest.raises(fx.OptionError, match="belong to open loops"):
        fx.time_response(mechanism, inputs={"coil": [1.0, 1.0]}, dt=1e-3, loop="closed", motion="large")
