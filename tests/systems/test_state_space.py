"""State space: poles, frequency response, steps, dead times, balancing."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
import scipy.signal as sg

import flexura as fx
from helpers.oscillators import DOFS, SIZE, STIFFNESS, beam, natural, oscillator, pair, pair_poles, pair_receptance

RPR = Path(__file__).parents[2] / "examples" / "rpr" / "rpr.yaml"
NODES = ["one.tx", "two.tx"]
EVERY = [f"{node}{word}" for node in NODES for word in ("", ":velocity", ":acceleration")]
HZ = np.array([0.3, 5.0, 11.0, 17.0, 24.0, 60.0, 400.0])


@pytest.fixture(scope="module")
def pair_model():
    """Two bodies with damping that couples modes, all kinds of outputs, one input with a base motion."""
    built = fx.system(pair(), inputs=[*NODES, "ground.tx"], outputs=EVERY)
    return built, fx.state_space(built)


def test_poles_of_the_pair(pair_model):
    """Roots of the characteristic polynomial, and conjugates."""
    for pole in pair_poles():
        for wanted in (pole, pole.conjugate()):
            assert np.abs(pair_model[1].poles() - wanted).min() < 1e-11 * abs(pole)


def test_states_are_those_of_modes(pair_model):
    """Two per mode, named, and channels with their quantities."""
    built, model = pair_model
    assert model.order == 2 * built.order == 24 and not model.is_discrete
    assert model.state_names[:3] == ("mode 1 displacement", "mode 1 velocity", "mode 2 displacement")
    assert [str(c) for c in model.outputs[:3]] == ["one.tx [m]", "one.tx:velocity [m/s]", "one.tx:acceleration [m/s^2]"]
    assert [c.unit for c in model.inputs] == ["N", "N", "m/s^2"]


def test_frequency_response_of_all_outputs(pair_model):
    """(i w)^p of the closed form, and what modes say for motion of the ground."""
    built, model = pair_model
    w = 2 * np.pi * HZ
    found, H = model.frequency_response(HZ), pair_receptance(w)
    for i in range(2):
        for p in range(3):
            reference = (1j * w[:, None]) ** p * H[:, i]
            assert np.abs(found[:, 3 * i + p, :2] / reference - 1).max() < 1e-9
    assert np.abs(found / built.modal().response(HZ) - 1).max() < 1e-9
    assert model.static_gain()[0, :2] == pytest.approx(pair_receptance(np.array([1e-9]))[0, 0].real, rel=1e-10)


def test_structural_damping_becomes_viscous():
    """Poles -eta/2 w +- i w sqrt(1 - eta^2/4)."""
    model = fx.state_space(fx.system(oscillator(damping={"loss_factor": 0.1})))
    for dof in DOFS:
        w = natural(dof)
        pole = w * (-0.05 + 1j * np.sqrt(1 - 0.05**2))
        assert np.abs(model.poles() - pole).min() < 1e-12 * w


def test_few_modes_keep_the_static_gain():
    """Displacements, with the rest as a direct term; velocities and accelerations have none at frequency zero."""
    described = fx.assemble(fx.load(RPR))
    names = ["platform.tx", "platform.tz", "platform.rx"]
    built = fx.system(described, inputs=names, outputs=names, damping=0.01)
    whole = fx.compliance(described, nodes=["platform"])[np.ix_([0, 2, 3], [0, 2, 3])]
    for n in (3, 6):
        model = fx.state_space(built, n=n)
        assert model.order == 2 * n
        scale = np.sqrt(np.outer(whole.diagonal(), whole.diagonal()))
        assert np.abs((model.static_gain() - whole) / scale).max() < 2e-8
    assert fx.state_space(built, up_to=20.0).order == 2 * int((fx.modes(fx.load(RPR), n=12).frequency_hz < 20).sum())


@pytest.mark.parametrize("hold", ["zoh", "foh"])
@pytest.mark.parametrize("dt", [1e-4, 3e-3, 0.2])
def test_steps_are_those_of_scipy(pair_model, hold, dt):
    """scipy.signal.cont2discrete, with an output that follows its input at once."""
    model = pair_model[1]
    own = model.discretised(dt, hold)
    A, B, C, D, _ = sg.cont2discrete((model.A, model.B, model.C, model.D), dt, hold)
    for found, reference in ((own.A, A), (own.B, B), (own.C, C), (own.D, D)):
        assert np.abs(found - reference).max() < 1e-10 * max(1e-300, np.abs(reference).max())
    assert own.dt == dt and own.is_discrete
    assert own.poles() == pytest.approx(own.poles()[np.newaxis][0])
    logs = np.log(np.abs(own.poles())) / dt
    assert sorted(logs) == pytest.approx(sorted(model.poles().real), abs=1e-6 * np.abs(model.poles()).max())


def stepped(model, u):
    """Outputs of a discrete model from rest."""
    x, y = np.zeros(model.order), []
    for now in u.T:
        y.append(model.C @ x + model.D @ now)
        x = model.A @ x + model.B @ now
    return np.array(y).T


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_steps_are_those_of_the_time_response(pair_model, hold):
    """Running the discrete model from rest gives what the recursion in modes does; foh starts from an input at zero."""
    built, model = pair_model
    u = np.random.default_rng(1).normal(size=(3, 200))
    u[:, 0] = 0
    found = stepped(model.discretised(2e-3, hold), u)
    names = [c.name for c in model.inputs]
    reference = fx.time_response(built, inputs=dict(zip(names, u, strict=True)), dt=2e-3, hold=hold).response
    assert (np.abs(found - reference).max(axis=1) < 1e-10 * np.abs(reference).max(axis=1)).all()


@pytest.mark.parametrize("delay", [0.0, 0.4e-3, 1e-3, 1.7e-3, 3e-3, 3.5e-3])
@pytest.mark.parametrize("given", ["model", "step"])
def test_dead_time_is_that_of_a_fine_simulation(pair_model, delay, given):
    """Held inputs that arrive late, whole and broken numbers of steps: a simulation in steps ten times as short."""
    built, model = pair_model
    dt, fine = 1e-3, 1e-4
    late = (
        fx.state_space(built, delay=delay).discretised(dt) if given == "model" else model.discretised(dt, delay=delay)
    )
    u = np.random.default_rng(2).normal(size=(3, 80))
    shift = round(delay / fine)
    held = np.repeat(u, 10, axis=1)
    delayed = np.hstack([np.zeros((3, shift)), held])[:, : held.shape[1]]
    reference = stepped(model.discretised(fine), delayed)[:, ::10]
    found = stepped(late, u)
    assert (np.abs(found - reference).max(axis=1) < 1e-9 * np.abs(reference).max(axis=1)).all()
    assert len(late.state_names) == late.order == len(set(late.state_names))
    whole = int(np.ceil(delay / dt - 1e-9))
    assert late.order == model.order + 3 * whole


def test_dead_time_in_frequency(pair_model):
    """e^(-s delay), of the continuous model, and for whole steps of the discrete one."""
    built, model = pair_model
    late = fx.state_space(built, delay=0.02)
    turn = np.exp(-2j * np.pi * HZ * 0.02)[:, None, None]
    assert np.abs(late.frequency_response(HZ) / (turn * model.frequency_response(HZ)) - 1).max() < 1e-12
    assert late.static_gain() == pytest.approx(model.static_gain(), rel=1e-12)
    low = HZ[HZ < 50]
    one, two = model.discretised(0.01), model.discretised(0.01, delay=0.02)
    assert np.abs(two.frequency_response(low) / (one.frequency_response(low) * turn[: len(low)]) - 1).max() < 1e-9
    foh = model.discretised(0.01, "foh", delay=0.03)
    assert foh.order == model.order + 9
    assert foh.static_gain() == pytest.approx(model.static_gain(), rel=1e-8)


def test_discrete_frequency_response_of_an_oscillator():
    """Held inputs: H(z) = (1 - e^(-s dt))/s sampled; checked by its sum over aliases for a first few."""
    model = fx.state_space(fx.system(oscillator(damping=0.05), inputs="mass.tx", outputs="mass.tx"))
    dt, f = 0.01, 7.0
    found = model.discretised(dt).frequency_response([f])[0, 0, 0]
    k = np.arange(-200_000, 200_001)
    s = 2j * np.pi * (f + k / dt)
    w = natural("tx")
    plain = 1 / (SIZE["tx"] * (s**2 + 0.1 * w * s + w**2))
    assert found == pytest.approx(((1 - np.exp(-2j * np.pi * f * dt)) / (s * dt) * plain).sum(), rel=1e-9)


@pytest.fixture(scope="module")
def platform():
    """Twenty modes of the example, damped."""
    names = ["platform.tx", "platform.tz", "platform.rx"]
    return fx.state_space(fx.system(fx.load(RPR), inputs=names, outputs=names, damping=0.02), n=20)


@pytest.mark.parametrize("keep", [4, 10, 12, 1e-3, 0.1])
def test_balanced_truncation(platform, keep):
    """Error at most twice the sum of the Hankel singular values left out, which SciPy finds; static gain kept."""
    built = fx.system(
        fx.load(RPR),
        inputs=["platform.tx", "platform.tz", "platform.rx"],
        outputs=["platform.tx", "platform.tz", "platform.rx"],
        damping=0.02,
    )
    small = fx.state_space(built, n=20, balanced=keep)
    sigma = hankel(platform)
    n = small.order
    bound = 2 * sigma[n:].sum()
    if isinstance(keep, int):
        assert n == keep
    else:
        assert bound <= keep * sigma[0] * (1 + 1e-6) < 2 * sigma[n - 1 :].sum() * (1 + 1e-5)
    hz = np.geomspace(0.5, 5000.0, 1200)
    error = np.linalg.norm(small.frequency_response(hz) - platform.frequency_response(hz), ord=2, axis=(1, 2))
    assert error.max() <= bound * (1 + 1e-6)
    assert error.max() > 0.01 * bound
    gain = platform.static_gain()
    assert np.abs(small.static_gain() - gain).max() < 1e-8 * np.abs(gain).max()
    assert small.poles().real.max() < 0
    stated = float(re.search(r"at most ([^ ]+) at", small.notes[-1])[1])
    assert bound <= stated < 1.011 * bound
    assert [str(c) for c in small.inputs] == [str(c) for c in platform.inputs]


def hankel(model):
    """Hankel singular values by the square root of the product of both Gramians, with states w eta and eta'."""
    d = np.ones(model.order)
    d[1::2] = np.sqrt(-model.A[np.arange(1, model.order, 2), np.arange(0, model.order, 2)])
    A, B, C = model.A * d / d[:, None], model.B / d[:, None], model.C * d
    size, w = np.linalg.norm(C) / np.linalg.norm(B), float(np.exp(np.log(d[1::2]).mean()))
    P = la.solve_continuous_lyapunov(A / w, -B @ B.T * size / w)
    Q = la.solve_continuous_lyapunov(A.T / w, -C.T @ C / size / w)
    return np.sort(np.sqrt(np.maximum(la.eigvals(P @ Q).real, 0)))[::-1]


def test_everything_kept_is_the_model(platform):
    """As many states as there are, or more."""
    built = fx.system(pair(20, 30), inputs=NODES, outputs=NODES, damping=0.01)
    model = fx.state_space(built)
    same = fx.state_space(built, balanced=model.order + 5)
    assert same.order <= model.order
    assert (
        np.abs(same.frequency_response(HZ) - model.frequency_response(HZ)).max()
        < 1e-9 * np.abs(model.static_gain()).max()
    )


def test_selected_channels(pair_model):
    """By name and in the order asked for."""
    model = pair_model[1]
    some = model.selected(["two.tx"], ["two.tx:velocity", "one.tx"])
    np.testing.assert_allclose(
        some.frequency_response(HZ), model.frequency_response(HZ)[:, [4, 0]][:, :, [1]], rtol=1e-11
    )
    assert [c.name for c in some.outputs] == ["two.tx:velocity", "one.tx"]
    with pytest.raises(fx.OptionError, match=r"no channel 'three\.tx'"):
        model.selected(["three.tx"])


def test_what_floats_has_no_static_gain():
    """And cannot be balanced."""
    built = fx.system(pair(0, 0, grounded=False), inputs="one.tx", outputs="one.tx")
    with pytest.raises(fx.OptionError, match="move freely"):
        fx.state_space(built).static_gain()
    with pytest.raises(fx.OptionError, match="floats"):
        fx.state_space(built, balanced=4)
    with pytest.raises(fx.OptionError, match="damped"):
        fx.state_space(fx.system(oscillator(), inputs="mass.tx", outputs="mass.tx"), balanced=2)


@pytest.mark.parametrize("value", [0, -1, 0.0, 1.0, 1.5, True, np.nan])
def test_impossible_balancing(pair_model, value):
    """A number of states, or a share."""
    with pytest.raises(fx.OptionError, match="balanced is"):
        fx.state_space(pair_model[0], balanced=value)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda m: m.discretised(0.0), "a step is"),
        (lambda m: m.discretised(np.inf), "a step is"),
        (lambda m: m.discretised(1e-3, "tustin"), "zoh or foh"),
        (lambda m: m.discretised(1e-3, delay=-1e-3), "delay"),
        (lambda m: m.discretised(1e-3, delay=np.nan), "delay"),
        (lambda m: m.discretised(1e-3, "foh", delay=0.5e-3), "whole number of steps"),
        (lambda m: m.discretised(1e-3).discretised(1e-3), "discrete already"),
        (lambda m: m.frequency_response([-1.0]), "not negative"),
        (lambda m: m.frequency_response([np.nan]), "not negative"),
        (lambda m: m.frequency_response([[1.0]]), "list"),
    ],
)
def test_impossible_steps_and_frequencies(pair_model, make, message):
    """Each is refused with what is wrong with it."""
    with pytest.raises(fx.OptionError, match=message):
        make(pair_model[1])


def test_impossible_models(pair_model):
    """Delays are times, and modes of a finished modal system are chosen."""
    built = pair_model[0]
    for delay in (-1e-3, np.nan, np.inf):
        with pytest.raises(fx.OptionError, match="delay"):
            fx.state_space(built, delay=delay)
    with pytest.raises(fx.OptionError, match="belong to a System"):
        fx.state_space(built.modal(), n=3)


def test_frequency_response_of_a_discrete_model_by_name():
    """The verb takes state spaces, and lists their resonances."""
    model = fx.state_space(fx.system(oscillator(damping=0.03), inputs="mass.tx", outputs="mass.tx"))
    for own in (model, model.discretised(1e-3)):
        found = fx.frequency_response(own, band=(1.0, 30.0), points=30)
        f = np.sqrt(STIFFNESS["tx"] / SIZE["tx"]) / (2 * np.pi)
        assert np.abs(found.resonances_hz / f - 1).min() < 1e-9
        assert found.ratios == pytest.approx(np.full(len(found.ratios), 0.03), rel=1e-8)


def test_full_order_beam_in_balanced_form():
    """A few states stand for forty modes, to a hundredth."""
    built = fx.system(beam(10, damping=0.02), inputs=["b.tz"], outputs=["b.tz", "b.ry"], order="full")
    model, small = fx.state_space(built, n=40), fx.state_space(built, n=40, balanced=1e-2)
    assert small.order < 20
    hz = np.geomspace(1, 2e4, 300)
    error = np.linalg.norm(small.frequency_response(hz) - model.frequency_response(hz), ord=2, axis=(1, 2))
    assert error.max() <= 2 * hankel(model)[small.order :].sum() * (1 + 1e-6)


def test_nearly_dependent_poles_are_solved_frequency_by_frequency():
    """A chain of four equal lags has one eigenvector: H = 1/(1 + s T)^4."""
    lag = 0.1
    A = (np.eye(4, k=-1) - np.eye(4)) / lag
    B, C = np.zeros((4, 1)), np.zeros((1, 4))
    B[0], C[0, 3] = 1 / lag, 1.0
    channels = (fx.types.Channel("u", "force"),), (fx.types.Channel("y", "displacement"),)
    chain = fx.StateSpace(A, B, C, np.zeros((1, 1)), *channels, ("a", "b", "c", "d"))
    hz = np.array([0.0, 0.3, 1.0, 20.0])
    expected = (1 + 2j * np.pi * hz * lag) ** -4
    np.testing.assert_allclose(chain.frequency_response(hz)[:, 0, 0], expected, rtol=1e-12)
