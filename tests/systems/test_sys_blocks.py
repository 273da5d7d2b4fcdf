"""Outputs a block of steps at a time are those of matrix exponentials applied step by step to every mode."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la

import flexura as fx
from flexura.analysis.responses.stepping import Driven, block_response, suits_blocks

GUIDE = Path(__file__).parents[2] / "examples" / "guide" / "guide.yaml"
OMEGA = np.array([20.0, 35.0, 60.0, 60.0, 400.0, 2e3, 3e3, 9e3, 2e4, 1e5, 3e5, 8e5, 2e6])
RATIO = np.array([0.0, 1e-4, 0.01, 0.7, 0.99, 0.02, 1.01, 3.0, 0.01, 20.0, 0.003, 1.5, 0.01])
DERIVATIVE = np.array([0, 1, 2, 0, 2])


def modal(seed: int, inputs: int, ratio: np.ndarray = RATIO) -> fx.ModalSystem:
    """Modes under, over and hardly damped, from slow to far faster than a step, with random gains."""
    rng = np.random.default_rng(seed)
    base = fx.system(fx.load(GUIDE)).modal()
    r, p = len(OMEGA), len(DERIVATIVE)
    return replace(
        base,
        omega=OMEGA,
        damping=np.diag(2 * ratio * OMEGA),
        loss=None,
        B=rng.standard_normal((r, inputs)) * OMEGA[:, None],
        C=rng.standard_normal((p, r)),
        derivative=DERIVATIVE,
        D=np.zeros((p, inputs)),
        residual=np.zeros((p, inputs)),
        shapes=np.zeros((base.system.order, r)),
    )


def stepped(modes: fx.ModalSystem, u: np.ndarray, dt: float, hold: str, eta: np.ndarray, rate: np.ndarray):
    """The same by exponentials of (eta, eta'/omega, f, its slope) of every mode (Van Loan 1978), one step at a time."""
    w, d = modes.omega, modes.damping.diagonal()
    A = np.zeros((len(w), 4, 4))
    A[:, 0, 1], A[:, 1, 0], A[:, 1, 1], A[:, 1, 2], A[:, 2, 3] = w * dt, -w * dt, -d * dt, dt / w, 1.0
    E = la.expm(A)
    f = modes.B @ u
    slope = np.diff(f, axis=1, append=0.0) if hold == "foh" else np.zeros_like(f)
    x = np.stack([eta, rate / w, f[:, 0], slope[:, 0]], axis=1)
    y = np.empty((len(modes.C), u.shape[1]))
    for k in range(u.shape[1]):
        x[:, 2], x[:, 3] = f[:, k], slope[:, k]
        motion = np.stack([x[:, 0], w * x[:, 1], f[:, k] - w**2 * x[:, 0] - d * w * x[:, 1]])
        y[:, k] = (modes.C * motion[modes.derivative]).sum(axis=1)
        x = (E @ x[:, :, None])[:, :, 0]
    return y


@pytest.mark.parametrize("hold", ["zoh", "foh"])
@pytest.mark.parametrize("steps", [2, 64, 257, 700])
@pytest.mark.parametrize("inputs", [1, 3])
def test_blocks_are_exact_steps(hold: str, steps: int, inputs: int) -> None:
    modes, rng = modal(steps, inputs), np.random.default_rng(5)
    u = rng.standard_normal((inputs, steps))
    eta, rate = rng.standard_normal(len(OMEGA)) / OMEGA, rng.standard_normal(len(OMEGA))
    for dt in (1e-5, 1e-3):
        found = block_response(modes, Driven(u, dt, hold, eta, rate))
        expected = stepped(modes, u, dt, hold, eta, rate)
        assert (np.abs(found - expected).max(axis=1) / np.abs(expected).max(axis=1)).max() < 1e-10


def test_blocks_are_used_where_they_are_shorter_and_possible() -> None:
    assert suits_blocks(modal(0, 1), 1)
    assert not suits_blocks(modal(0, 1), 40)
    critical = RATIO.copy()
    critical[4] = 1.0
    assert not suits_blocks(modal(0, 1, critical), 1)
    coupled = modal(0, 1)
    coupled.damping[0, 1] = coupled.damping[1, 0] = 1.0
    assert not suits_blocks(coupled, 1)


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_keeping_modes_changes_nothing(hold: str) -> None:
    """Filters run mode by mode where modal coordinates are kept; outputs and static corrections are the same."""
    names = ["carriage.tx", "carriage.tx:velocity", "carriage.tx:acceleration"]
    modes = fx.system(fx.load(GUIDE), inputs=names[:1], outputs=names, damping=0.02, order="full").modal(n=8)
    u = np.random.default_rng(1).standard_normal(1000)
    kept, blocks = (
        fx.time_response(modes, inputs={names[0]: u}, dt=2e-4, hold=hold, start={names[0]: 3.0}, keep_modes=keep)
        for keep in (True, False)
    )
    assert suits_blocks(modes, 1)
    assert modes.residual.any()
    error = np.abs(kept.response - blocks.response).max(axis=1) / np.abs(kept.response).max(axis=1)
    assert error.max() < 1e-10
