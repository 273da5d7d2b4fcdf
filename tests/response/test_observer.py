"""Kalman observers: spectral factors of one mass in closed form, python-control, Van Loan's exponential, simulation."""

from __future__ import annotations

import control
import numpy as np
import pytest
import scipy.linalg as la

import flexura as fx
from flexura.systems import covariance_of_step
from helpers.disturbed import one_mass
from helpers.over import over

M, K, C = 2.0, 800.0, 4.0
FORCE, NOISE = 3.0, 2e-4
WHITE = f"air: {{input: block.tx, density: {FORCE} N/sqrt(Hz)}}, noise: {{sensor: x, density: {NOISE} m/sqrt(Hz)}}"
DT = 1e-3


def seen(disturbances: str = WHITE, dt: float = DT, **options) -> fx.Observer:
    return fx.observer(one_mass(f"{{{disturbances}}}"), dt=dt, **{"inputs": ["block.tx"], "outputs": ["x"], **options})


def test_poles_of_one_mass_are_those_of_its_spectral_factor():
    """In short steps those of s^2 + b s + a, with a^2 = w^4 + W/(m^2 V), b^2 = (c/m)^2 + 2 (a - w^2), W/V the ratio of
    densities of the force and the reading: |s^2 + b s + a|^2 is the density of what is read over that of its noise."""
    dt = 1e-5
    w2 = K / M
    a = np.sqrt(w2**2 + (FORCE / NOISE / M) ** 2)
    b = np.sqrt((C / M) ** 2 + 2 * (a - w2))
    found = np.log(seen(dt=dt).poles) / dt
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(np.roots([1, b, a])), rel=2e-3)


def test_gain_and_covariance_are_those_of_python_control():
    found = seen(delay=2 * DT)
    n = len(found.covariance)
    A, Cx = found.model.A[:n, :n], found.model.C[:, :n]
    gain, P, _ = control.dlqe(A, np.eye(n), Cx, found.noise.process, found.noise.reading)
    assert found.gain[:n] == pytest.approx(gain, rel=1e-7) and not found.gain[n:].any()
    assert found.covariance == pytest.approx(P, rel=1e-7)
    assert found.filter.mismatch < 1e-9


def test_noise_of_a_step_is_that_of_van_loans_exponential():
    A, B, W = np.array([[0, 1], [-K / M, -C / M]]), np.array([[0], [1 / M]]), np.array([[FORCE**2 / 2]])
    for dt in (1e-4, 0.3):
        E = la.expm(dt * np.block([[-A, B @ W @ B.T], [np.zeros((2, 2)), A.T]]))
        assert covariance_of_step(A, B, W, dt) == pytest.approx(E[2:, 2:].T @ E[:2, 2:], rel=1e-9)


def test_motion_without_sensors_is_that_of_the_budget():
    found = seen()
    assert found.motion[0] == pytest.approx(FORCE**2 / (4 * K * C), rel=1e-9)
    assert found.noise.reading[0, 0] == pytest.approx(NOISE**2 / (2 * DT), rel=1e-12)
    assert found.error_rms[0] < min(np.sqrt(found.motion[0]), np.sqrt(found.noise.reading[0, 0]))


def test_estimates_err_as_is_said_and_innovations_are_white():
    found, steps = seen(delay=1.5 * DT), 40_000
    rng = np.random.default_rng(0)
    n, m = len(found.covariance), found.model
    u = rng.standard_normal((steps, 1))
    w = rng.standard_normal((steps, n)) @ np.linalg.cholesky(found.noise.process).T
    v = rng.standard_normal(steps) * np.sqrt(found.noise.reading[0, 0])
    own = found.estimator
    x, z = np.zeros(m.order), np.zeros(own.order)
    off, innovation = np.empty((steps, n)), np.empty(steps)
    for k in range(steps):
        y = m.C @ x + m.D @ u[k] + v[k]
        innovation[k] = (y - m.C @ z - m.D @ u[k])[0]
        both = np.concatenate([u[k], y])
        estimate, z = own.C @ z + own.D @ both, own.A @ z + own.B @ both
        x = m.A @ x + m.B @ u[k]
        x[:n] += w[k]
        off[k] = x[:n] - estimate
    late = off[2000:]
    assert late.T @ late / len(late) == pytest.approx(found.covariance, rel=0.05)
    assert abs(innovation[1:] @ innovation[:-1]) < 3 / np.sqrt(steps) * (innovation @ innovation)


def test_a_density_that_is_read_directly_is_read_as_its_mean():
    """Of a block that nothing holds back but its own mass the acceleration is the force over it: of that only the mean
    over a step is there to be read."""
    noise = "noise: {sensor: 'block.tx:acceleration', density: 1e-9 m/s^2/sqrt(Hz)}"
    white = f"air: {{input: block.tx, density: {FORCE} N/sqrt(Hz)}}, {noise}"
    found = seen(white, outputs=["block.tx:acceleration"])
    assert found.noise.reading[0, 0] == pytest.approx((FORCE / M) ** 2 / (2 * DT), rel=1e-6)


def test_modes_that_rest_unseen_are_left_out_and_unseen_ones_that_move_are_told():
    base = fx.load("examples/xy_stage/xy_stage.yaml")
    De, Di = fx.describe.Density, fx.describe.Disturbance
    noise = {"noise": Di(sensor="table.tx", density=De(value=1e-10, unit="m"))}
    x = Di(input="table.tx", density=De(value=1e-5, unit="N"))
    y = Di(input="table.ty", density=De(value=1e-5, unit="N"))
    about = {"dt": 1e-4, "inputs": ["table.tx"], "outputs": ["table.tx"], "damping": 0.01, "n": 5}
    alone = fx.observer(base, disturbances={"x": x, **noise}, **about)
    assert not any("not seen by" in str(own) for own in alone.warnings)
    assert any("neither driven nor seen" in note for note in alone.notes)
    both = fx.observer(base, disturbances={"x": x, "y": y, **noise}, **about)
    assert any("is not seen by table.tx" in str(own) for own in both.warnings)
    with pytest.raises(fx.SolverError, match=r"nothing damps mode .* and no sensor sees it \(table.tx\)"):
        fx.observer(base, disturbances={"x": x, "y": y, **noise}, **{**about, "damping": None})


REFUSED = {
    "air is not white": (WHITE.replace("N/sqrt(Hz)", "N/sqrt(Hz), corner: 1 Hz, band: [0.1 Hz, 1 kHz]"), {}),
    "x has no noise": (WHITE[: WHITE.index(", noise")], {}),
    "no disturbance moves anything": (WHITE[WHITE.index("noise") :], {}),
    "a step is a positive time": (WHITE, {"dt": 0.0}),
}


@over("rule", REFUSED)
def test_what_is_refused(rule):
    disturbances, options = REFUSED[rule]
    with pytest.raises(fx.OptionError, match=rule):
        seen(disturbances, **options)


def test_a_band_that_ends_is_told():
    found = seen(WHITE.replace("m/sqrt(Hz)", "m/sqrt(Hz), band: [0, 100 Hz]"))
    assert any("noise: taken as white" in note for note in found.notes)
    wide = seen(WHITE.replace("m/sqrt(Hz)", "m/sqrt(Hz), band: [0, 2 kHz]"))
    assert wide.noise.reading[0, 0] == pytest.approx(NOISE**2 * 2000, rel=1e-12)
