"""Large motion by the kernels beside NumPy: forces, tangents and masses of elements, frames, and motion over time."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.motion import (
    Damping,
    Equations,
    Frames,
    Integrator,
    Loads,
    MovingModel,
    TurningModel,
    kept_frames,
)
from flexura.motion.elements import PoseElements, Rates
from flexura.motion.newton import Attempt, MotionState, Newton, Scheme
from flexura.motion.path import displacement
from flexura.motion.se3 import rotation
from flexura.motion.substructures import taken
from flexura.motion.superelements import Polynomial, Superelements
from helpers.kernels import both, compiled

EXAMPLES = Path(__file__).parents[2] / "examples"
MODELS = {
    "no warping": "rpr/rpr.yaml",
    "warping and bowing": "guide/guide.yaml",
    "warping of three cases": "rpr/start_corrected.yaml",
    "warping, bars": "amplifier/amplifier.yaml",
    "superelements of solids": "imported/guide.yaml",
    "actuators": "tip_tilt/tip_tilt.yaml",
}
rng = np.random.default_rng(5)
BEGUN = rng.bit_generator.state


@pytest.fixture(autouse=True)
def _numbers_of_its_own():
    """The same numbers for a test, whichever others run."""
    rng.bit_generator.state = BEGUN


def model_of(name):
    return MovingModel.of(fx.assemble(fx.load(EXAMPLES / name)).design)


def displaced(model, turn):
    step = rng.standard_normal(model.dof.shape) * turn
    step[:, :3] *= 0.02 * Equations(model).size
    return model.rest.moved(np.where(model.rest.placed[:, None], step, 0.1 * step))


def agree(kernel, numpy, tolerance=1e-13):
    for one, other in zip(map(np.asarray, kernel), map(np.asarray, numpy), strict=True):
        assert one.shape == other.shape
        assert np.abs(one - other).max(initial=0.0) <= tolerance * np.abs(other).max(initial=0.0)


def everything(group, frames, rates):
    response = group.response(frames)
    return [*response[:3], *response.coupled, group.masses(frames), *group.material(frames),
            *group.kinetics(frames, rates), *group.kinetics(frames, rates._replace(damping=0.0))]  # fmt: skip


def rates_of(model, damping=1e-3):
    return Rates(rng.standard_normal(model.dof.shape), 1e3 * rng.standard_normal(model.dof.shape), damping)


@compiled
@pytest.mark.parametrize("name", MODELS.values(), ids=MODELS.keys())
def test_elements_of_models(name):
    model = model_of(name)
    rates, frames = rates_of(model), displaced(model, 3e-3)
    for group in model.elements:
        # deformations are differences of logarithms, a hundredth of these: two digits are lost to round-off
        agree(*both(lambda group=group: everything(group, frames, rates)), tolerance=1e-12)
    gravity = np.array([0.0, -9.81, 1.0])
    agree(*both(lambda: model.kinetics(frames, rates, gravity)), tolerance=1e-12)


@compiled
def test_any_number_of_elements_and_none_moved():
    model = model_of("guide/guide.yaml")
    beams, frames, rates = model.elements[0], displaced(model, 3e-3), rates_of(model)
    assert isinstance(beams, PoseElements)
    alone = replace(beams.strain, place=np.zeros_like(beams.strain.place))
    for count in (1, 2, 3, 4, 5):
        few = taken(replace(beams, strain=alone), np.arange(count))
        agree(*both(lambda few=few: everything(few, frames, rates)), tolerance=1e-12)
    assert all(np.abs(force).max() < 1e-9 for force in both(lambda: beams.response(model.rest).force))


def superelements(e, k, count, order):
    """Superelements between frames (e, k) of their own, energies of an order up to 4."""
    d, m = 6 * k - 6, 6 * count - 6
    root = rng.standard_normal((e, d, d))
    terms = [symmetric(rng.standard_normal((e, *(m,) * n))) if n <= order else np.empty((0,) * (n + 1)) for n in (3, 4)]
    mass = rng.standard_normal((e, 6 * k, 6 * k))
    frames = Frames(
        rng.standard_normal((e * k, 3)),
        rotations(e * k),
        rng.standard_normal((e * k, 6)),
        np.tile(np.arange(k) < count, e),
    )
    axes, arm = frames.R[rng.integers(e * k, size=e)], 0.1 * rng.standard_normal((e, count, 3))
    node = np.arange(e * k).reshape(e, k)
    energy = Polynomial(root + np.swapaxes(root, 1, 2), *terms)
    return frames, Superelements(
        node, count, axes, arm, rng.standard_normal((e, count - 1, 6)), energy, mass + np.swapaxes(mass, 1, 2)
    )


def rotations(n):
    """Rotations (n, 3, 3) of any axis and by up to 1.4 rad, of which two are apart by less than half a turn."""
    w = rng.standard_normal((n, 3))
    return rotation(w * (rng.uniform(0.0, 1.4, n) / np.linalg.norm(w, axis=1))[:, None])


def symmetric(full):
    """The mean over all orders of the axes but the first."""
    orders = list(permutations(range(1, full.ndim)))
    return np.mean([np.transpose(full, (0, *order)) for order in orders], axis=0)


@compiled
@pytest.mark.parametrize(
    ("e", "k", "count", "order"), [(1, 2, 2, 2), (3, 2, 2, 4), (9, 3, 2, 4), (2, 3, 3, 3), (5, 4, 3, 2), (1, 2, 1, 2)]
)
def test_superelements_of_any_kind(e, k, count, order):
    frames, group = superelements(e, k, count, order)
    turned = np.linalg.norm(group.logs_at(frames).e[..., 3:], axis=-1)
    assert e < 5 or turned.max() > 1.5
    rates = Rates(rng.standard_normal((e * k, 6)), rng.standard_normal((e * k, 6)), 0.1)
    agree(*both(lambda: everything(group, frames, rates)))


@compiled
def test_frames_that_move_and_hold_amplitudes():
    n = 11
    frames = Frames(rng.standard_normal((n, 3)), rotations(n), rng.standard_normal((n, 6)), np.arange(n) % 4 > 0)
    step = rng.standard_normal((n, 6))
    step[:, 3:] *= np.minimum(1, 3 / np.linalg.norm(step[:, 3:], axis=1))[:, None]  # less than half a turn
    step[5], step[6, 3:] = 0.0, 0.0
    kernel, numpy = both(lambda: frames.moved(step))
    agree(kernel[:3], numpy[:3], 1e-15)
    agree(*both(lambda: [displacement(frames, kernel)]))
    # those that are not placed do not turn
    agree([displacement(frames, kernel)], [step], 1e-14)


@compiled
@pytest.mark.parametrize("name", ["no warping", "warping and bowing", "superelements of solids"])
@pytest.mark.parametrize("is_smooth", [True, False])
def test_a_step_and_looks_at_it(name, is_smooth):
    model = model_of(MODELS[name])
    # amplitudes of what is alike on both sides would weigh nothing
    weight = rng.standard_normal(model.sagging.weight.shape)
    model = replace(model, sagging=replace(model.sagging, weight=weight))
    equations, n, named = Equations(model), model.n_dof, model.design.plan.topology.node_names
    nodes = [k for k, node in enumerate(named) if node and (model.dof[model.root[k]] >= 0).all()]
    dead, follower = ({k: 1e-2 * rng.standard_normal(6) for k in nodes[at : at + 2]} for at in (0, 1))
    loads = Loads(dead, follower, np.array([0.5, 0.3, -9.81]))
    newton = Newton(equations, Damping(2.0, 1e-5), Scheme.of(0.8, 1e-3))
    motion = rng.standard_normal((5, n)) * np.array([1e-6, 1e-3, 1.0, 1.0, 1e3])[:, None] * 1e-2 / equations.scale
    frames = displaced(model, 1e-4)
    last = MotionState(frames._replace(z=10 * frames.z), motion, np.empty(0))
    newton.renew(last, loads)
    kinds = set()

    def looks():
        at = Attempt(last, loads, np.empty(0))
        step = newton.looked_at(at)
        kinds.add(type(step))
        step.begin(is_smooth)
        found = [*at.frames.copy()[:3], at.motion[:4].copy(), at.led]
        sizes = step.look()
        return [*found, *at.frames[:3], *at.motion, at.correction, *sizes]

    agree(*both(looks), tolerance=1e-10)
    assert len(kinds) == 2


@compiled
def test_motion_over_time_in_full_and_at_low_order():
    full = model_of("guide/guide.yaml")
    for model in (full, TurningModel.of(full, kept_frames(full)).low):
        node = int(model.design.plan.topology.numbers(["carriage"])[0])
        loads = Loads({node: np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.01])}, {}, np.array([0.0, 0.0, -9.81]))

        def states(model=model, loads=loads):
            equations = Equations(model)
            integrator = Integrator(equations, Damping(1.0, 1e-5), 1e-3, 0.8)
            end = list(integrator.through(model.rest, np.zeros(model.n_dof), lambda _: loads, 12))[-1]
            return equations.free(displacement(model.rest, end.frames)), end.velocity

        agree(*both(states), tolerance=1e-9)
