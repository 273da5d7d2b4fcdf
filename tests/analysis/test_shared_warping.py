"""Wide leaves that twist by themselves: the elements of a strip share their warping."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.strain import end_forces
from flexura.derivatives import frequency_slopes
from flexura.structure import Design


def strip(length: str = "30 mm", width: str = "40 mm", elements: int = 24, held: str = "b: clamped") -> fx.Mechanism:
    return fx.loads(f"""
flexura: 1
materials: {{steel: {{E: 200 GPa, nu: 0.3, rho: 7800 kg/m^3}}}}
parameters: {{length: {length}, thickness: 0.1 mm}}
nodes: {{a: [0, 0, 0], b: [length, 0, 0]}}
flexures:
  strip: {{nodes: [a, b], material: steel, reference: z, elements: {elements}, root: rigid, ends: [clamped, clamped],
    profile: {{type: leaf, width: {width}, thickness: thickness}}}}
masses: {{m: {{node: b, mass: 1 g, inertia: [1 kg*mm^2, 1 kg*mm^2, 1 kg*mm^2]}}}}
ground: {{{", ".join(filter(None, ["a: clamped", held]))}}}
""")


def first_twist(model: fx.Mechanism) -> float:
    found = fx.modes(model, n=8, order="full")
    return next(mode.frequency_hz for mode in found.modes if "twist 100%" in mode.motion.summary)


@pytest.mark.parametrize("length", [12, 30, 60])
def test_a_strip_between_clamps_twists_as_a_clamped_beam_bends(length: float) -> None:
    """By Rayleigh's quotient with the first mode of a clamped beam and its integrals (Blevins 1979)."""
    E, nu, rho, b, t, L = 200e9, 0.3, 7800.0, 40e-3, 0.1e-3, length * 1e-3
    warping = E / (1 - nu**2) * (b * t) ** 3 / 144
    torsion = E / (2 * (1 + nu)) * b * t**3 / 3 * (1 - 0.63 * t / b)
    squared = (500.564 * warping / L**4 + 12.303 * torsion / L**2) / (rho * b * t * (b * b + t * t) / 12)
    found = first_twist(strip(f"{length} mm"))
    assert found == pytest.approx(np.sqrt(squared) / (2 * np.pi), rel=0.006)


def test_loads_at_its_ends_move_a_strip_by_any_number_of_elements_alike() -> None:
    one, many = (fx.compliance(fx.assemble(strip(elements=n, held="")), nodes=["b"])[3, 3] for n in (1, 24))
    assert many == pytest.approx(one, rel=1e-9)


def test_torque_at_a_node_inside_is_met_on_both_sides() -> None:
    model = fx.assemble(strip(elements=6))
    found = fx.statics(model, loads={"strip[2]": [0, 0, 0, 1e-3, 0, 0]})
    start, end = (forces[0, :, 3, 0] for forces in end_forces(model, "", found.displacement_vector[:, None], None))
    np.testing.assert_allclose(start, end, rtol=1e-9)
    np.testing.assert_allclose(end[:2], end[0], rtol=1e-9)
    assert end[0] - end[2] == pytest.approx(1e-3, rel=1e-9)


def test_slopes_of_twist_are_those_of_differences() -> None:
    plan = fx.Plan(strip(elements=8, held=""))
    found = frequency_slopes(Design.with_slopes(plan, {}, ["length", "thickness"]), 8)
    for k, (name, value) in enumerate((("length", 30e-3), ("thickness", 0.1e-3))):
        step = 1e-4 * value
        up, down = (
            frequency_slopes(Design.with_slopes(plan, {name: value + s * step}, [name]), 8).frequency_hz
            for s in (1, -1)
        )
        np.testing.assert_allclose(found.slope[:, k], (up - down) / (2 * step), rtol=2e-6)


def test_many_elements_twist_evenly_and_the_margin_says_so() -> None:
    """Each element is coupled with all others, so that long rows are left out; what is lost is in the model error."""
    shared, even = (fx.modes(strip("60 mm", "20 mm", n), n=8, order="full") for n in (64, 65))
    twists = [
        next(k for k, mode in enumerate(found.modes) if "twist 100%" in mode.motion.summary) for found in (shared, even)
    ]
    ratio = shared.frequency_hz[twists[0]] / even.frequency_hz[twists[1]]
    margin = even.model_error[twists[1]]
    assert margin is not None and 1.02 < ratio < 1 + margin[1]
    narrow = shared.model_error[twists[0]]
    assert narrow is not None and narrow[1] < margin[1] / 2
