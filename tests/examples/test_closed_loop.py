"""The closed loop of the RPR platform: what the twelve-state model promises holds on the full-order one.

Stability and gain margins are checked by eigenvalues of closed loops put together here, not from frequency responses.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy.linalg import matrix_balance

pytest.importorskip("control")

SCRIPT = Path(__file__).parents[2] / "examples" / "rpr" / "closed_loop.py"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("closed_loop", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["closed_loop"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def found(script: ModuleType) -> Any:
    return script.study()


def largest_pole(model: Any, controller: Any, gain: np.ndarray) -> float:
    """Largest eigenvalue of x+ = A x + B u, u = -(force F + position gain y), from the matrices."""
    A, B, F, Y = model.A, model.B, model.C[:4], np.diag(gain) @ model.C[4:]
    f, p = controller.force, controller.position
    assert not model.D.any()
    n, k, m = len(A), len(f.A), len(p.A)
    whole = np.zeros((n + k + m, n + k + m))
    whole[:n] = np.hstack([A - B @ (f.D @ F + p.D @ Y), -B @ f.C, -B @ p.C])
    whole[n : n + k, :n], whole[n : n + k, n : n + k] = f.B @ F, f.A
    whole[n + k :, :n], whole[n + k :, n + k :] = p.B @ Y, p.A
    return float(np.abs(np.linalg.eigvals(whole)).max())


def at_rest(loop: Any) -> np.ndarray:
    """Static gain C (I - A)^-1 B + D, with states scaled alike: units so mixed cost a plain solution all digits."""
    alike, (scale, _) = matrix_balance(np.eye(len(loop.A)) - loop.A, permute=False, separate=True)
    return loop.C @ (scale[:, None] * np.linalg.solve(alike, loop.B / scale[:, None])) + loop.D


def test_margins_of_twelve_states_are_those_of_the_full_order(script: ModuleType, found: Any) -> None:
    """To 0.1 % in gain, 0.1 degrees in phase; and in the distance of all loops together from instability."""
    hz = found.loops[script.FULL].hz
    for axis in range(3):
        small, full = (
            script.margins(found.loops[n].position[:, axis, axis], hz) for n in (script.REDUCED, script.FULL)
        )
        assert small.gain == pytest.approx(full.gain, rel=1e-3)
        assert small.phase == pytest.approx(full.phase, abs=0.1)
        assert small.distance == pytest.approx(full.distance, rel=1e-3)
        assert full.gain > 2 and full.phase > 60 and full.distance > script.LEAST
    for kind in ("position", "actuators"):
        small, full = (script.distance(getattr(found.loops[n], kind)) for n in (script.REDUCED, script.FULL))
        assert small == pytest.approx(full, rel=2e-3)
        assert full > script.LEAST
    assert 0 < found.neglected < 3e-3


def test_closed_loop_of_the_full_order_is_stable_as_far_as_the_margins_say(script: ModuleType, found: Any) -> None:
    model = found.models[script.FULL]
    assert model.order == 2 * script.FULL + 4
    here = largest_pole(model, found.controller, np.ones(3))
    assert here < 1
    assert np.abs(script.closed(model, found.controller).poles()).max() == pytest.approx(here, abs=1e-9)
    for axis in range(3):
        margin = script.margins(found.loops[script.FULL].position[:, axis, axis], found.loops[script.FULL].hz).gain
        for share, stable in ((0.99, True), (1.01, False)):
            gain = np.ones(3)
            gain[axis] = share * margin
            assert (largest_pole(model, found.controller, gain) < 1) is stable


def test_force_feedback_is_needed(script: ModuleType, found: Any) -> None:
    bare = script.replace(found.controller, force=0 * found.controller.force)
    assert largest_pole(found.models[script.FULL], bare, np.ones(3)) > 1


def test_steps_settle_alike(script: ModuleType, found: Any) -> None:
    for axis in range(3):
        (_, small, _), (time, full, volts) = (found.steps[n][axis] for n in (script.REDUCED, script.FULL))
        assert np.abs(small - full).max() < 1e-3 * script.STEP[axis]
        assert np.abs(volts).max() < 75
        assert script.settled(time, full, axis) < 0.2
    closed = script.closed(found.models[script.FULL], found.controller)
    assert at_rest(closed)[4:, 4:] == pytest.approx(np.eye(3), abs=1e-9)


def test_parasitic_modes_limit_the_rotations_and_not_the_lift(found: Any) -> None:
    own, free, bare = found.limits.values()
    assert own[0] == pytest.approx(free[0], rel=1e-2)
    assert (free[1:] > 2 * own[1:]).all()
    assert (bare < own / 5).all()


def test_report_and_picture(script: ModuleType, found: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    script.report(found)
    printed = capsys.readouterr().out
    assert all(name in printed for name in script.AXES) and "largest pole 0.99" in printed
    script.draw(found, tmp_path / "closed_loop.png")
    assert (tmp_path / "closed_loop.png").stat().st_size > 50_000
