"""Superelements that turn: against published beams, the linear reduction, and the full order."""

from functools import cache
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.motion import Equilibrium, MovingModel, Pose, TurningModel, against_full, kept_frames
from flexura.motion.expansion import expanded
from flexura.motion.path import displacement
from flexura.motion.se3 import Logarithm, exponential, rotation
from flexura.motion.substructures import partition
from flexura.motion.superelements import Polynomial
from helpers.large_motion import Moved, straight_beams

EXAMPLES = Path(__file__).parents[2] / "examples"
RPR = {"platform.z": 3e-4, "platform.rx": 4e-3, "platform.ry": 4e-3}


@cache
def rpr() -> MovingModel:
    return MovingModel.of(fx.assemble(fx.load(EXAMPLES / "rpr/rpr.yaml")).design)


def moved(order: int) -> tuple[TurningModel, Moved, Moved, list[Equilibrium], list[Equilibrium]]:
    """The paper's platform moved in full and at low order: states at half the way and at its end."""
    full = Moved(fx.load(EXAMPLES / "rpr/rpr.yaml"), *RPR)
    turning = TurningModel.of(full.model, kept_frames(full.model), order)
    low = full.at_low_order(turning.low)
    targets = [[share * own for own in RPR.values()] for share in (0.5, 1.0)]
    states, exact = ([pose.state for pose in own.through(targets)] for own in (low, full))
    return turning, low, full, states, exact


def symmetric(tensors: np.ndarray) -> np.ndarray:
    """The mean over all orders of the indices but the first."""
    orders = list(permutations(range(1, tensors.ndim)))
    return sum((tensors.transpose(0, *own) for own in orders), np.zeros(tensors.shape)) / len(orders)


def test_energy_of_a_leaf_is_that_of_the_beam_constraint_model() -> None:
    """Third and fourth derivatives of a leaf 100 x 5 x 0.5 mm: W = EA/2L (u + 3s^2/5L)^2 (1 - 12/700 (s/t)^2) at
    leading order (Awtar, Slocum, Sevincer 2007). The slenderness leaves 1e-4 for shear."""
    L, t, w, E = 0.1, 0.5e-3, 5e-3, 210e9
    section = f"A: {w * t!r} m^2, Iy: {t * w**3 / 12!r} m^4, Iz: {w * t**3 / 12!r} m^4, J: {w * t**3 / 3!r} m^4"
    ground: dict[str, object] = {"p0": "clamped"}
    mechanism = straight_beams([[0, 0, 0], [L, 0, 0]], section, 16, E=E, G=E / 2.6, ground=ground)
    model = MovingModel.of(fx.assemble(mechanism).design)
    ((leaf,),) = partition(model, kept_frames(model))
    energy = expanded(leaf, 3)
    axial = E * w * t / L
    assert energy.cubic[0, 0, 1, 1] == pytest.approx(axial * 1.2 / L, rel=1e-3)
    assert energy.quartic[0, 0, 0, 1, 1] == pytest.approx(-axial * 2 * 12 / 700 / t**2, rel=1e-2)
    assert abs(energy.cubic[0, 0, 0, 1]) < 1e-6 * axial / L


def test_at_rest_it_is_the_linear_reduction() -> None:
    mechanism = fx.load(EXAMPLES / "rpr/rpr.yaml")
    linear = fx.modes(mechanism, n=6, keep=0)
    full = rpr()
    turning = TurningModel.of(full, kept_frames(full))
    assert turning.low.n_dof == 54
    own = Moved(mechanism).at_low_order(turning.low)
    pose = Pose(own.equations, own.equations.solve(turning.low.rest))
    assert np.sqrt(pose.modes(6).values) / (2 * np.pi) == pytest.approx(linear.frequency_hz, rel=1e-5)


def test_each_order_of_forces_is_nearer_to_the_full_order() -> None:
    off = []
    for order in (1, 2, 3):
        *_, states, exact = moved(order)
        off.append(np.abs(states[-1].drive / exact[-1].drive - 1).max())
    assert off[0] > 5 * off[1] > 25 * off[2]
    assert off[2] < 1e-5


def test_error_estimate_is_the_error() -> None:
    for order in (1, 2, 3):
        turning, low, full, states, exact = moved(order)
        compared = against_full(turning, low.equations, full.equations, states)
        for k, (state, reference) in enumerate(zip(states, exact, strict=True)):
            travel = low.equations.travelled(reference.frames)
            work = np.abs((state.drive - reference.drive) * travel).sum() / np.abs(reference.drive * travel).sum()
            steps = [displacement(reference.frames, state.frames), displacement(turning.low.rest, state.frames)]
            off, moved_by = (np.abs(low.equations.free(own) * low.equations.scale).max() for own in steps)
            true = max(work, off / moved_by)
            assert compared.error[k] == pytest.approx(true, rel=0.3)
            on_full = compared.states[k].frames
            assert np.abs(on_full.x - reference.frames.x).max() < 5 * true * np.abs(reference.frames.x).max()


def test_turning_everything_changes_nothing() -> None:
    turning, _, _, states, _ = moved(3)
    frames, R = states[-1].frames, rotation(np.array([0.7, -1.9, 1.1]))
    turned = frames._replace(x=frames.x @ R.T + 1.0, R=R @ frames.R)
    before, after = (turning.low.forces(own, np.zeros(3)) for own in (frames, turned))
    assert after.energy == pytest.approx(before.energy, rel=1e-9)
    for own in range(2):
        part = slice(3 * own, 3 * own + 3)
        assert after.force[:, part] == pytest.approx(before.force[:, part] @ R.T, abs=1e-7 * np.abs(before.force).max())


def test_forces_are_derivatives_of_the_energy() -> None:
    rng = np.random.default_rng(3)
    terms = [rng.normal(size=(2, *(4,) * order)) for order in (2, 3, 4)]
    energy = Polynomial(*(symmetric(own) for own in terms)).with_amplitudes(np.array([2.0, 0.0]))
    d, step = rng.normal(size=(2, 6)), 1e-5
    _, gradient, hessian = energy.response(d)
    for k in range(6):
        h = step * np.eye(6)[k]
        (up, g_up, _), (down, g_down, _) = energy.response(d + h), energy.response(d - h)
        assert (up - down) / (2 * step) == pytest.approx(gradient[:, k], rel=1e-7, abs=1e-8)
        assert (g_up - g_down) / (2 * step) == pytest.approx(hessian[:, k], rel=1e-7, abs=1e-8)


def test_exponential_is_the_inverse_of_the_logarithm() -> None:
    rng = np.random.default_rng(5)
    e = rng.normal(size=(6, 6)) * np.array([1e-9, 1e-5, 1e-2, 0.1, 0.5, 1.0])[:, None]
    assert Logarithm(*exponential(e)).e == pytest.approx(e, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(
    "file", ["rpr/rpr.yaml", "rpr/rpr_piezo.yaml", "xy_stage/xy_stage.yaml", "imported/guide.yaml"]
)
def test_mass_and_weight_stay(file: str) -> None:
    full = MovingModel.of(fx.assemble(fx.load(EXAMPLES / file)).design)
    low = TurningModel.of(full, kept_frames(full)).low
    assert low.weight[:, :3].sum(axis=0) == pytest.approx(full.weight[:, :3].sum(axis=0), rel=1e-9)
    moments = [
        (own.weight[:, 3:] + np.cross(full.rest.x[:, :, None], own.weight[:, :3], axis=1)).sum(axis=0)
        for own in (low, full)
    ]
    assert moments[0] == pytest.approx(moments[1], abs=1e-9 * np.trace(full.weight[:, :3].sum(axis=0)))


def test_equal_substructures_are_worked_out_once() -> None:
    kinds = partition(rpr(), kept_frames(rpr()))
    assert sorted(len(own) for own in kinds) == [4, 4, 8]
