"""Derivatives at poses of large displacements, against differences of high order of what has no slopes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.derivatives import DisplacedState, displaced_state
from flexura.mechanism import with_rigid_bodies
from flexura.structure import Design, Plan
from helpers.richardson import derivative

EXAMPLES = Path(__file__).parents[2] / "examples"

POSES = {
    "guide": {"x": 2e-3},
    "pivot": {"rz": 0.05},
    "xy_stage": {"x": 1e-4, "y": -5e-5},
    "tip_tilt": {"rx": 5e-4},
}

SMALL = 1e-2
"""Size of readings, beside the largest of their kind, below which errors are told over this size."""

STEPS = (0.01, 0.009, 0.0075)
"""Steps of differences: small beside the twentieth of the thickness of its leaves over which the lowest buckling factor
of the XY stage veers from its third. The pivot, whose compliances with free drives carry round-off of 3e-9, takes steps
twice as large."""

MANY = 4
"""Parameters from which all are changed at once."""


def unbounded(example: str) -> Plan:
    own = with_rigid_bodies(fx.load(EXAMPLES / example / f"{example}.yaml"))
    free = {key: p.replaced({"minimum": None, "maximum": None}) for key, p in own.parameters.items()}
    return Plan(own.replaced({"parameters": free, "gravity": (0.5, -1.0, -9.81)}))


def readings(at: DisplacedState, node: str) -> list[object]:
    """Numbers of one kind each: forces, motions and rotations, stresses, compliances with the drives held and free."""
    held, free = (np.diagonal(at.flexibility(at.rows(node), own)) for own in (list(at.move), ()))
    u = at.displacement(node)
    return [*at.forces.values(), u[:3], u[3:], at.stresses.von_mises, held[:3], held[3:], free[:3], free[3:]]


def single(at: DisplacedState) -> list[list[object]]:
    """Frequencies with the drives free and held and the buckling factor, those that are not repeated."""
    groups = at.frequencies(4), at.frequencies(4, held=True), [at.buckling_factor]
    return [[own for own in group if own is not None and len(own.at) == 1] for group in groups]


def numbers(at: DisplacedState, node: str, of: list[list[object]]) -> np.ndarray:
    found = [np.ravel(own) for own in readings(at, node)]
    groups = at.frequencies(5), at.frequencies(5, held=True), [at.buckling_factor]
    flat = [{j: own.value for own in group if own is not None for j in own.at} for group in groups]
    return np.concatenate([*found, *([f[o.at[0]] for o in own] for f, own in zip(flat, of, strict=True))])


def ways(names: list[str]) -> np.ndarray:
    """Directions in which each parameter changes by so much of itself: each alone, or all at once where there are many
    and equilibria take long."""
    count = len(names)
    return np.eye(count) if count < MANY else np.random.default_rng(1).uniform(0.5, 1.0, (1, count))


@pytest.mark.parametrize(
    "example", ["guide", "pivot", *(pytest.param(own, marks=pytest.mark.slow) for own in ("xy_stage", "tip_tilt"))]
)
def test_readings_at_a_pose_have_the_derivatives_of_differences(example):
    plan = unbounded(example)
    node = plan.body_names[0]
    move = {f"{node}.{axis}": value for axis, value in POSES[example].items()}
    names = [key for key, p in plan.mechanism.parameters.items() if isinstance(p.value, float)]
    values = np.array([float(plan.parameter_values()[name]) for name in names])
    own = displaced_state(Design.with_slopes(plan, {}, names), move)
    found, alone = readings(own, node), single(own)
    assert all(alone[:2])
    kinds = [np.abs(np.ravel(kind.value)) for kind in found]
    sizes = np.concatenate([*(np.maximum(k, SMALL * k.max()) for k in kinds), [abs(o.value) for s in alone for o in s]])
    slopes = [np.reshape(kind.slope, (len(names), -1)) for kind in found]
    slopes = np.concatenate([*slopes, *(o.slope[:, :, 0] for s in alone for o in s)], axis=1)
    for way in ways(names) * values:
        there = lambda x, way=way: numbers(  # noqa: E731
            displaced_state(Design.of(plan, dict(zip(names, values + x * way, strict=True))), move), node, alone
        )
        steps = tuple((2 if example == "pivot" else 1) * step for step in STEPS)
        slope, apart = (own / sizes for own in derivative(there, 0.0, steps))
        allowed = 1e-7 * np.maximum(1.0, np.abs(slope))
        assert (apart < 10 * allowed).all(), way
        assert (np.abs(way @ slopes / sizes - slope) < allowed + 2 * apart).all(), way
