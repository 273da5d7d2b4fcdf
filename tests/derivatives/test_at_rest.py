"""Derivatives of linear answers: closed forms of beams, and differences of high order of what has no slopes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.derivatives import LinearState, displaced_state
from flexura.mechanism import with_rigid_bodies
from flexura.structure import Design, Plan
from helpers.richardson import derivative

EXAMPLES = Path(__file__).parents[2] / "examples"

BEAM = """
flexura: 1
name: beam
theory: euler_bernoulli
corrections: none
parameters:
  L: {value: 100 mm}
  b: {value: 20 mm}
  t: {value: 1 mm}
  E: {value: 70 GPa}
  Fx: {value: 0 N}
  Fz: {value: 2 N}
materials: {m: {E: E, nu: 0.3, rho: 2700 kg/m^3, yield_stress: 400 MPa}}
nodes: {a: [0, 0, 0], b: [L, 0, 0]}
flexures: {leaf: {nodes: [a, b], material: m, reference: z, elements: 4, profile: {type: leaf, width: b, thickness: t}}}
ground: {a: clamped%s}
loads: {b: {force: [Fx, 0 N, Fz]}}
"""

NAMES = ["L", "b", "t", "E"]


def per_cent(answer, values, names=NAMES):
    return answer.slope * [values[name] for name in names] / answer.value


def test_a_cantilever_has_the_derivatives_of_its_closed_forms():
    plan, values = Plan(fx.loads(BEAM % "")), {"L": 0.1, "b": 0.02, "t": 1e-3, "E": 70e9, "Fz": 2.0}
    own = LinearState(Design.with_slopes(plan, {"Fz": 2.0}, [*NAMES, "Fz"]))
    moved = own.coupling("b.tz", "b.z")
    slopes = moved.slope * [values[k] for k in (*NAMES, "Fz")] / moved.value
    np.testing.assert_allclose(slopes, [3, -1, -3, -1, 0], atol=1e-9)
    stress = own.stresses.von_mises[0, 0]
    assert stress.value == pytest.approx(6 * 2.0 * 0.1 / (0.02 * 1e-6), rel=1e-9)
    slopes = stress.slope * [values[k] for k in (*NAMES, "Fz")] / stress.value
    np.testing.assert_allclose(slopes, [1, -1, -2, 0, 1], atol=1e-9)


def test_the_load_of_a_column_has_the_derivatives_of_eulers():
    plan, values = Plan(fx.loads(BEAM % "")), {"L": 0.1, "b": 0.02, "t": 1e-3, "E": 70e9, "Fx": -1.0}
    names = [*NAMES, "Fx"]
    factor = LinearState(Design.with_slopes(plan, {"Fx": -1.0, "Fz": 0.0}, names)).buckling_factor
    assert factor is not None
    euler = np.pi**2 * 70e9 * 0.02 * 1e-9 / 12 / (4 * 0.1**2)
    assert factor.value == pytest.approx(euler, rel=1e-4)
    slopes = factor.slope[:, 0, 0] * [values[k] for k in names] / factor.value
    np.testing.assert_allclose(slopes, [-2, 1, 3, 1, -1], atol=1e-8)


def test_a_guided_leaf_has_the_derivatives_of_its_closed_forms():
    plan = Plan(fx.loads(BEAM.partition("loads:")[0] % ", b: {fixed: [ry]}"))
    own = displaced_state(Design.with_slopes(plan, {}, NAMES), {"b.z": 1e-7})
    values = {"L": 0.1, "b": 0.02, "t": 1e-3, "E": 70e9}
    force, stress = own.forces["b.z"], own.stresses.von_mises[0, 0]
    assert force.value == pytest.approx(12 * 70e9 * 0.02 * 1e-9 / 12 / 1e-3 * 1e-7, rel=1e-6)
    assert stress.value == pytest.approx(3 * 70e9 * 1e-3 * 1e-7 / 0.1**2, rel=1e-6)
    np.testing.assert_allclose(per_cent(force, values), [-3, 1, 3, 1], atol=1e-6)
    np.testing.assert_allclose(per_cent(stress, values), [-2, 0, 1, 1], atol=1e-6)


@pytest.mark.parametrize("example", ["guide", "pivot", pytest.param("xy_stage", marks=pytest.mark.slow)])
def test_linear_answers_have_the_derivatives_of_differences(example):
    described = with_rigid_bodies(fx.load(EXAMPLES / example / f"{example}.yaml"))
    free = {key: p.replaced({"minimum": None, "maximum": None}) for key, p in described.parameters.items()}
    plan = Plan(described.replaced({"parameters": free, "gravity": (3.0, -20.0, -50.0)}))
    names = [key for key, p in free.items() if isinstance(p.value, float)]
    values, node = plan.parameter_values(), plan.body_names[0]
    own = LinearState(Design.with_slopes(plan, {}, names))
    moved, travel = own.coupling(f"{node}.tz", f"{node}.z"), own.compliance(f"{node}.z", f"{node}.z")
    stress, factor = own.stresses.von_mises[:, 0], own.buckling_factor
    assert factor is not None and len(factor.at) == 1
    mine = np.concatenate([stress.slope.T, [moved.slope], [travel.slope], [factor.slope[:, 0, 0]]])
    size = np.array([*stress.value, moved.value, travel.value, factor.value])
    for k, name in enumerate(names):

        def there(x, name=name):
            found = fx.statics(plan, {name: x}).stresses()
            motion = fx.kinetostatics(plan, {name: x}, platform=node, actuators=[f"{node}.tz"])
            load = fx.preload(plan, {name: x}).buckling_factor
            return np.array(
                [
                    *(found[key].von_mises for key in own.stresses.names),
                    motion.coupling[2, 0],
                    motion.elongation[0, 0],
                    load,
                ]
            )

        slope, apart = derivative(there, values[name], steps=(0.02, 0.015))
        relative = abs(values[name]) / np.abs(size)
        assert (apart * relative < 1e-6 * np.maximum(1.0, np.abs(slope) * relative)).all(), name
        allowed = 1e-7 * np.maximum(1.0, np.abs(slope) * relative) + 2 * apart * relative
        assert (np.abs(mine[:, k] - slope) * relative < allowed).all(), name
