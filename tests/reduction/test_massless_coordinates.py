"""Mechanisms with coordinates that have no mass: every mode can be asked for, as the full order has it."""

import pytest

import flexura as fx

TEXT = """
name: tool on a beam
nodes: {foot: [0 mm, 0 mm, 0 mm], top: [0 mm, 0 mm, 60 mm], tool: [0 mm, 0 mm, 80 mm]}
links:
  post: {nodes: [foot, top], material: Al-7075-T6, section: {shape: rectangle, width: 6 mm, thickness: 4 mm},
    elements: 4, reference: x}
masses: {mass: {node: tool, mass: 5 g}}
springs: {mount: {nodes: [tool, top], stiffness: {tx: 1 MN/m, ty: 1 MN/m, tz: 1 MN/m, rx: 1 kN*m/rad, ry: 1 kN*m/rad,
  rz: 1 kN*m/rad}}}
"""


@pytest.mark.parametrize("ground", ["ground: {foot: clamped}", ""], ids=["held", "free"])
@pytest.mark.parametrize("n", [8, 20, 30])
def test_all_modes_of_a_point_mass_that_can_turn(ground, n):
    mechanism = fx.loads(TEXT + ground)
    low, full = (fx.modes(mechanism, n=n, order=order) for order in ("low", "full"))
    assert len(low.modes) <= len(full.modes)
    known = [mode.frequency_hz for mode in full.modes][: len(low.modes)]
    assert [mode.frequency_hz for mode in low.modes] == pytest.approx(known, rel=2e-3, abs=1e-2)
