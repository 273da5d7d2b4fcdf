"""Simulated modal tests: hits against integration in time, masses of sensors against hand and independent models,
identified modes against the truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import flexura as fx
from flexura.testing.rig.test_points import ModalTestRig
from flexura.testing.virtual.virtual_test import convolved, hammer_pulse, response_to_pulse
from helpers.tested_stage import STAGE, TEST

EXAMPLE = Path(__file__).parents[2] / "examples" / "rpr" / "rpr_test.yaml"


@pytest.fixture(scope="module")
def stage() -> fx.Mechanism:
    return fx.loads(STAGE + TEST)


@pytest.fixture(scope="module")
def result(stage) -> fx.VirtualTest:
    return fx.virtual_test(stage, seed=1)


@pytest.fixture(scope="module")
def rpr() -> fx.VirtualTest:
    return fx.virtual_test(fx.load(EXAMPLE))


@pytest.mark.parametrize("pole", [-3 + 50j, -0.0 + 2j * np.pi / 0.02, -400.0 + 0j, -5000 + 100j, 0j])
def test_convolution_against_quadrature(pole):
    length = 0.02
    for t in (0.004, 0.02, 0.031):

        def part(tau, which, t=t):
            return getattr(np.exp(pole * (t - tau)) * (0.5 - 0.5 * np.cos(2 * np.pi * tau / length)), which)

        top = min(t, length)
        wanted = complex(*(quad(part, 0, top, args=(w,), limit=400, epsabs=1e-13)[0] for w in ("real", "imag")))
        found = convolved(np.array([pole]), np.array([t]), length)[0, 0]
        assert found == pytest.approx(wanted, abs=1e-9 * length)


def test_hit_against_integration_in_time(stage):
    """The whole stage, six coordinates with the sensors' mass, integrated as a differential equation."""
    rig = ModalTestRig(stage)
    modes = rig.modes("first")
    assert modes.order == 6
    time = np.arange(200) / 400
    y = response_to_pulse(modes, time, 0.05, 0.012)
    built = rig.system("first")
    M, K = (np.asarray(A.toarray()) for A in (built.M, built.K))
    V = modes.shapes
    C = M @ V @ modes.damping @ V.T @ M

    def motion(t, s):
        force = built.B[:, 1] * hammer_pulse(np.array([t]), 0.05, 0.012)[0]
        return np.concatenate([s[6:], np.linalg.solve(M, force - C @ s[6:] - K @ s[:6])])

    states = solve_ivp(motion, (0, time[-1]), np.zeros(12), "DOP853", time, rtol=1e-9, atol=1e-13, max_step=1e-3).y
    wanted = built.rows @ np.stack([motion(t, s)[6:] for t, s in zip(time, states.T, strict=True)], axis=1)
    assert np.abs(y[:, 1] - wanted).max() < 1e-6 * np.abs(wanted).max()


def test_modes_left_out_follow_the_force(stage):
    """Six modes, or three with what the others add at once: the same below the frequencies left out."""
    built = ModalTestRig(stage, damping=0.3).system(None)
    time = np.arange(2000) / 2000
    slow = 0.4
    three, six = (response_to_pulse(built.modal(n=n), time, 0.01, slow) for n in (3, 6))
    bare = response_to_pulse(replace(built.modal(n=3), residual=0 * built.residual), time, 0.01, slow)
    during = (time > 0.15) & (time < 0.4)
    error, without = (np.abs(y - six)[..., during].max() for y in (three, bare))
    assert error < 0.1 * without


def test_mass_on_one_axis_by_hand():
    slider = fx.loads("""
flexura: 1
bodies: {stage: {centre: [0, 0, 0], mass: 0.4 kg, inertia: [1 kg*mm^2, 1 kg*mm^2, 1 kg*mm^2]}}
springs: {mount: {nodes: [stage], stiffness: {tx: 4 kN/m}}}
ground: {stage: {free: [tx]}}
damping: 0.01
test:
  sample_rate: 300 Hz
  duration: 8 s
  pulse: 15 ms
  hammer: {h: {node: stage, direction: x}}
  accelerometers: {a: {node: stage, direction: [-2, 0, 0], at: [10 mm, 4 mm, 0], mass: 12 g}}
  acceleration_noise: 0.01 m/s^2
""")
    found = fx.virtual_test(slider)
    (mode,) = found.modes
    assert mode.bare_hz == pytest.approx(np.sqrt(4000 / 0.4) / (2 * np.pi), rel=1e-12)
    assert mode.mass_loaded_hz == pytest.approx(np.sqrt(4000 / 0.412) / (2 * np.pi), rel=1e-12)
    assert mode.mass_effect == pytest.approx(np.sqrt(0.4 / 0.412) - 1, rel=1e-9)
    assert mode.identified_hz == pytest.approx(mode.mass_loaded_hz, rel=1e-3)
    assert mode.identified_damping == pytest.approx(0.01, rel=0.05)
    (frf,) = found.measurement.frfs
    s = 2j * np.pi * frf.frequency_hz
    exact = -(s**2) / (0.412 * s**2 + 2 * 0.01 * np.sqrt(4000 * 0.412) * s + 4000)
    near = np.abs(frf.frequency_hz - mode.mass_loaded_hz) < 3
    assert np.abs(frf.response[near, 0, 0] / exact[near] - 1).max() < 0.02


@pytest.mark.parametrize("placement", ["first", "second"])
def test_masses_against_point_masses_on_the_body(stage, result, placement):
    """The same sensors as point masses on nodes that the body carries."""
    own = {name: stage.test.accelerometers[name] for name in stage.test.placements[placement]}
    body = stage.bodies["stage"].model_copy(update={"carries": tuple(own)})
    weighed = stage.model_copy(
        update={
            "test": None,
            "nodes": {name: a.at for name, a in own.items()},
            "bodies": {"stage": body},
            "masses": {f"m_{name}": fx.describe.PointMass(node=name, mass=a.mass) for name, a in own.items()},
        }
    )
    wanted = fx.modes(weighed, n=6, order="full").frequency_hz
    loaded = next(t for t in result.mass_loaded if t.placement == placement)
    assert loaded.frequency_hz == pytest.approx(wanted, rel=1e-9)
    assert (loaded.frequency_hz < result.bare.frequency_hz).all()
    assert result.bare.frequency_hz == pytest.approx(fx.modes(stage, n=6, order="full").frequency_hz, rel=1e-9)


def test_described_sensors_weigh_in_their_placement_only():
    with_channels = (
        STAGE
        + """
actuators: {shaker: {type: force, nodes: [stage], direction: z}}
sensors:
  up: {type: acceleration, nodes: [stage], direction: z, mass: 20 g}
  along: {type: acceleration, nodes: [stage], direction: x, mass: 30 g}
  scale: {type: displacement, nodes: [stage], direction: x, mass: 10 g}
test:
  sample_rate: 400 Hz
  duration: 5 s
  pulse: 12 ms
  hammer: {h: shaker}
  accelerometers: {a: up, b: along}
  placements: {first: [a], second: [b]}
"""
    )
    found = fx.virtual_test(fx.loads(with_channels))
    always = 0.4 + 0.01
    for modes, mass in (
        (found.bare, always),
        (found.mass_loaded[0], always + 0.02),
        (found.mass_loaded[1], always + 0.03),
    ):
        expected = np.sqrt(9000 / mass) / (2 * np.pi)
        assert np.min(np.abs(modes.frequency_hz / expected - 1)) < 1e-9
    channel = found.measurement.recordings[0].channels[0]
    assert (channel.name, channel.node, channel.direction, channel.quantity) == ("h", "stage", (0, 0, 1), "force")


def test_identified_modes_of_the_stage(result):
    """At least 26 dB of signal to noise in every channel: frequencies within 0.1 %, damping within 5 %.

    Sensors along z alone see neither tx, ty (modes 1, 2) nor rz (mode 6)."""
    noise = result.test.acceleration_noise
    assert min(r.samples[1:].std(axis=1).min() for r in result.measurement.recordings) > 10 ** (26 / 20) * noise
    assert [m.number for m in result.modes] == [1, 2, 3, 4, 5, 6]
    for mode in result.modes:
        assert abs(mode.error) < 1e-3
        assert abs(mode.damping_error) < 0.05
        for placement, (true, found) in mode.placement_hz.items():
            if placement == "second" and mode.number in (1, 2, 6):
                assert found is None
            else:
                assert found == pytest.approx(true, rel=1e-3)
    assert result.false_hz == ()
    assert len(result.measurement.recordings) == 2 * 3 * 5


def test_frequency_responses_are_those_of_the_placement(stage, result):
    for frf in result.measurement.frfs:
        modes = ModalTestRig(stage).modes(frf.setup).selected(outputs=[c.name for c in frf.outputs])
        near = (frf.frequency_hz > 8) & (frf.frequency_hz < 60)
        exact = modes.response(frf.frequency_hz[near])
        off = np.linalg.norm(frf.response[near] - exact, axis=0) / np.linalg.norm(exact, axis=0)
        assert off.max() < 0.02


def test_example_of_the_paper(rpr):
    """Six modes of the platform, two sensors at a time, at least 22 dB of signal to noise in every channel."""
    noise = rpr.test.acceleration_noise
    assert min(r.samples[1:].std(axis=1).min() for r in rpr.measurement.recordings) > 10 ** (22 / 20) * noise
    assert len(rpr.modes) == 6
    assert len(rpr.measurement.recordings) == 4 * 3 * 5
    for mode in rpr.modes:
        assert abs(mode.error) < 1e-3
        assert abs(mode.damping_error) < 0.05
        assert mode.mac > 0.95
        assert -0.015 < mode.mass_effect < -0.003
        # the sensors of the third step look along x, which the first mode leaves almost still
        assert all(found == pytest.approx(true, rel=2e-3) for true, found in mode.placement_hz.values())
    assert rpr.false_hz == ()
    assert len(rpr.identified.outputs) == 8


def test_example_with_weightless_sensors():
    found = fx.virtual_test(fx.load(EXAMPLE), {"sensor_mass": 0.0})
    assert [m.mass_effect for m in found.modes] == pytest.approx(np.zeros(6), abs=1e-7)


def test_shift_is_that_of_the_modal_mass(rpr):
    """To first order the shift is -m phi^2 / 2, phi the mass-normalised shape at the sensors (Rayleigh's quotient)."""
    rig = ModalTestRig(fx.load(EXAMPLE))
    u = rig.modes(None).shapes
    for own in rpr.mass_loaded:
        wanted = [
            -sum(a.mass * np.sum((a.motion @ u[:, k]) ** 2) for a in rig.placements[own.placement]) / 2
            for k in range(6)
        ]
        shift = np.log(own.frequency_hz[:6] / rpr.bare.frequency_hz[:6])
        assert shift.sum() == pytest.approx(sum(wanted), rel=0.06)


def test_written_and_read_again(rpr, tmp_path):
    path = fx.write_measurement(rpr.measurement, tmp_path / "test.uff")
    again = fx.read_measurement(path)
    assert len(again.recordings) == 60
    assert [f.setup for f in again.frfs] == ["step1", "step2", "step3", "step4"]
    found = fx.identify(again)
    assert found.frequency_hz == pytest.approx(rpr.identified.frequency_hz, rel=1e-6)
    places = {c.name: c.position for c in found.outputs}
    assert places["p2z"] == pytest.approx((-0.063, 0.063, rpr.identified.outputs[0].position[2]))
    paired = fx.correlate(fx.load(EXAMPLE), test=found)
    assert [(p.test, p.model) for p in paired.pairs] == [(k, k) for k in range(1, 7)]
    assert [p.error for p in paired.pairs] == pytest.approx(
        [np.mean([true / own - 1 for true, own in m.placement_hz.values()]) for m in rpr.modes], abs=5e-6
    )


def test_double_hits_are_left_out(stage, result):
    found = fx.virtual_test(stage, seed=1, double_hits=2)
    assert len(found.measurement.recordings) == 2 * 3 * 7
    notes = " ".join(n for f in found.measurement.frfs for n in f.notes)
    assert notes.count("left out 2 of 7 records") == 6
    assert notes.count("2 pulses") == 12
    assert all(f.averages == 5 for f in found.measurement.frfs)
    assert all(abs(m.error) < 1e-3 for m in found.modes)


def test_repeatable_by_seed(stage, result):
    again = fx.virtual_test(stage, seed=1)
    other = fx.virtual_test(stage, seed=2)
    first, second, third = (r.measurement.recordings[7].samples for r in (result, again, other))
    assert (first == second).all()
    assert not np.allclose(first, third, rtol=1e-3)


def test_windows_of_the_file(stage):
    """Records that end before the motion does are refused without a window, and right with one."""
    short = stage.test.model_copy(update={"duration": 1.5})
    assert "still at" in fx.virtual_test(stage, test=short).notes[0]
    windowed = short.model_copy(update={"exponential": 0.01, "force_window": 0.03})
    found = fx.virtual_test(stage, test=windowed)
    assert all(f.decay == pytest.approx(np.log(100) / 1.5) for f in found.measurement.frfs)
    assert all(abs(m.error) < 1e-3 and abs(m.damping_error) < 0.05 for m in found.modes)


def test_damping_that_couples_modes():
    dashpot = "dashpots: {d: {nodes: [stage], at: [20 mm, 10 mm, 5 mm], damping: {tz: 3 N*s/m, tx: 1 N*s/m}}}\n"
    found = fx.virtual_test(fx.loads(STAGE + dashpot + TEST))
    assert not ModalTestRig(fx.loads(STAGE + dashpot + TEST)).modes("first").is_proportional
    assert max(m.damping_ratio for m in found.modes) > 0.02
    assert all(abs(m.error) < 1e-3 and abs(m.damping_error) < 0.05 for m in found.modes)


def test_repeated_modes_with_weightless_sensors():
    """Two pairs of equal frequencies, three hammer points; in the first placement both of the first pair are seen."""
    text = STAGE.replace("ty: 6 kN/m", "ty: 4 kN/m").replace("200 kg*mm^2, 300", "300 kg*mm^2, 300")
    text = (text.replace("ry: 20", "ry: 9")) + TEST.replace("8 g", "0 g").replace("5 g", "0 g")
    found = fx.virtual_test(fx.loads(text))
    hz = [m.bare_hz for m in found.modes]
    pairs = [(0, 1), (3, 4)]
    assert all(hz[a] == pytest.approx(hz[b], rel=1e-9) for a, b in pairs)
    for mode in found.modes:
        assert abs(mode.error) < 1e-3
        assert mode.mac > 0.99
        assert mode.mass_effect == pytest.approx(0, abs=1e-12)


def test_too_much_noise_is_said_and_not_fitted(stage):
    loud = stage.test.model_copy(update={"acceleration_noise": 1e4, "duration": 1.0})
    found = fx.virtual_test(stage, test=loud)
    assert found.identified is None
    assert all(m.identified_hz is None and m.error is None for m in found.modes)
    assert "no frequency responses" in found.notes[0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"test": None}, "describes no test"),
        ({"ground": {"stage": fx.describe.Support(fixed=("tx", "ty", "tz", "rx", "ry"))}}, "held"),
    ],
)
def test_impossible_stands(stage, change, words):
    with pytest.raises(fx.OptionError, match=words):
        fx.virtual_test(stage.model_copy(update=change))


@pytest.mark.parametrize("how", [{"seed": -1}, {"seed": 1.5}, {"double_hits": -1}, {"double_hits": True}])
def test_impossible_options(stage, how):
    with pytest.raises(fx.OptionError, match="not"):
        fx.virtual_test(stage, **how)


def test_a_floating_mechanism_is_refused(stage):
    free = stage.model_copy(update={"springs": {}})
    with pytest.raises(fx.SolverError):
        fx.virtual_test(free)
