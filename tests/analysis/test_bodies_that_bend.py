"""Bodies that bend: parts of one piece against whole solids of another program, and what must not depend on how they
are described."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.mechanism import with_rigid_bodies

AL = "materials: {al: {E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3}}"


def joint(y: str) -> str:
    """A leaf 3 x 10 x 0.5 mm between blocks 8 x 3 x 10 mm, of which one is held, at a height in them."""
    return f"""
flexura: 1
{AL}
nodes:
  a: [8 mm, {y}, 5 mm]
  b: [11 mm, {y}, 5 mm]
flexures:
  leaf: {{nodes: [a, b], material: al, reference: y, elements: 8,
    profile: {{type: leaf, width: 10 mm, thickness: 0.5 mm}}}}
bodies:
  block: {{centre: [4 mm, 1.5 mm, 5 mm], solid: {{shape: box, size: [8 mm, 3 mm, 10 mm], material: al}}, carries: [a],
    held: {{face: x-}}}}
  table: {{centre: [15 mm, 1.5 mm, 5 mm], solid: {{shape: box, size: [8 mm, 3 mm, 10 mm], material: al}}, carries: [b]}}
"""


NOTCHES = f"""
flexura: 1
{AL}
substructures:
  arm:
    nodes: {{a0: [0, 0, 0], a1: [3 mm, 0, 0], a2: [9 mm, 0, 0], a3: [31 mm, 0, 0], a4: [37 mm, 0, 0],
      a5: [40 mm, 0, 0]}}
    links:
      l0: &l {{nodes: [a0, a1], material: al, reference: y,
        section: {{shape: rectangle, width: 10 mm, thickness: 6.3 mm}}}}
      l1: {{<<: *l, nodes: [a2, a3]}}
      l2: {{<<: *l, nodes: [a4, a5]}}
    flexures:
      n0: &n {{nodes: [a1, a2], material: al, reference: y, integration: tapered,
        profile: {{type: notch, width: 10 mm, contour: {{shape: circular, radius: 3 mm, web: 0.3 mm}}}}}}
      n1: {{<<: *n, nodes: [a3, a4]}}
    interface: [a0, a5]
instances:
  low: {{of: arm, at: [10 mm, 3.15 mm, 5 mm]}}
  high: {{of: arm, at: [10 mm, 36.85 mm, 5 mm]}}
bodies:
  block: {{centre: [5 mm, 20 mm, 5 mm], solid: {{shape: box, size: [10 mm, 40 mm, 10 mm], material: al}},
    carries: [low.a0, high.a0], held: {{face: x-}}}}
  table: {{centre: [55 mm, 20 mm, 5 mm], solid: {{shape: box, size: [10 mm, 40 mm, 10 mm], material: al}},
    carries: [low.a5, high.a5]}}
"""

GUIDE = f"""
flexura: 1
{AL}
parameters:
  deep: 8 mm
  tall: 30 mm
nodes:
  a0: [8 mm, 2.25 mm, 6 mm]
  a1: [28 mm, 2.25 mm, 6 mm]
  b0: [8 mm, tall - 2.25 mm, 6 mm]
  b1: [28 mm, tall - 2.25 mm, 6 mm]
flexures:
  a: {{nodes: [a0, a1], material: al, reference: y, profile: {{type: leaf, width: 12 mm, thickness: 0.5 mm}}}}
  b: {{nodes: [b0, b1], material: al, reference: y, profile: {{type: leaf, width: 12 mm, thickness: 0.5 mm}}}}
bodies:
  block: {{centre: [4 mm, tall/2, 6 mm], solid: {{shape: box, size: [8 mm, tall, 12 mm], material: al}},
    carries: [a0, b0], held: {{face: x-}}}}
  table: {{centre: [28 mm + deep/2, tall/2, 6 mm], solid: {{shape: box, size: [deep, tall, 12 mm], material: al}},
    carries: [a1, b1]}}
"""


def hz(model: fx.Mechanism | fx.Plan, n: int = 3, **parameters: float) -> np.ndarray:
    return fx.modes(model, parameters or None, n=n, order="full").frequency_hz


def bodies_that_bend(model: fx.Mechanism) -> set[str]:
    return {key for part in fx.Plan(model).parts.values() for key in part.elastic}


@pytest.mark.parametrize(
    ("text", "whole", "within"),
    [
        # NGSolve, curved tetrahedra of order 4, sharp corners
        (joint("1.5 mm"), (1544.2, 9048.6, 15301, 18144), 0.02),
        (joint("2.75 mm"), (1464.1, 7530.6, 14970, 15191), 0.02),
        # order 4, 233 037 DOFs
        (NOTCHES, (115.04, 1035.4, 2280.5, 6388, 6430, 6536), 0.01),
        # order 4, 134 319 DOFs; the leaves twist by themselves in the last one
        (GUIDE, (290.7, 2222.9, 5250, 6513, 6558, 9483), 0.015),
    ],
    ids=["joint in the middle", "joint at the edge", "notch guide", "leaf guide"],
)
def test_parts_of_one_piece_against_their_whole_solids(text: str, whole: tuple[float, ...], within: float) -> None:
    model = fx.loads(text)
    found = hz(model, len(whole))
    np.testing.assert_allclose(found, whole, rtol=within)
    rigid = hz(with_rigid_bodies(model), len(whole))
    assert np.abs(rigid / whole - 1).max() > 0.1


def test_a_clamped_node_on_a_face_holds_it() -> None:
    held = GUIDE.replace(", held: {face: x-}", "").replace("carries: [a0, b0]", "carries: [a0, b0, wall]")
    held = held.replace("nodes:\n", "nodes:\n  wall: [0, tall/2, 6 mm]\n", 1) + "ground: {wall: clamped}\n"
    np.testing.assert_allclose(hz(fx.loads(held)), hz(fx.loads(GUIDE)), rtol=1e-9)


def test_slopes_by_the_sizes_of_a_body_are_those_of_differences() -> None:
    plan = fx.Plan(fx.loads(GUIDE))
    found = fx.sensitivity(plan, ask=["f1", "f2", "f3"])
    for name, value in plan.parameter_values().items():
        step = 1e-4 * value
        difference = (hz(plan, **{name: value + step}) - hz(plan, **{name: value - step})) / (2 * step)
        column = found.slope[:, list(plan.parameter_values()).index(name)]
        np.testing.assert_allclose(column, difference, rtol=1e-4)


def test_a_batch_over_sizes_of_a_body_is_one_design_after_another() -> None:
    plan, deep = fx.Plan(fx.loads(GUIDE)), np.array([6e-3, 8e-3, 10e-3])
    batch = fx.natural_frequencies(plan, {"deep": deep}, n=3).frequency_hz
    np.testing.assert_allclose(batch, [hz(plan, deep=value) for value in deep], rtol=1e-4)


def test_two_halves_that_share_a_face_are_one_body() -> None:
    """A table of two boxes that sit on each other, by the name of the second or by a node on the face, and of one."""
    table = GUIDE[GUIDE.index("  table:") :]
    low = table.replace("tall/2, 6 mm]", "tall/4, 6 mm]").replace("[deep, tall,", "[deep, tall/2,")
    high = low.replace("tall/4", "3*tall/4").replace("  table:", "  upper:").replace("[a1, b1]", "[b1]")
    by_name = GUIDE.replace(table, low.replace("[a1, b1]", "[a1, upper]") + high)
    by_node = GUIDE.replace(table, low.replace("[a1, b1]", "[a1, mid]") + high.replace("[b1]", "[b1, mid]"))
    by_node = by_node.replace("nodes:\n", "nodes:\n  mid: [28 mm + deep/2, tall/2, 6 mm]\n", 1)
    for text in (by_name, by_node):
        assert bodies_that_bend(fx.loads(text)) == {"block", "table", "upper"}
        np.testing.assert_allclose(hz(fx.loads(text)), hz(fx.loads(GUIDE)), rtol=0.01)


def test_flexures_that_are_soft_beside_a_body_leave_it_rigid() -> None:
    soft = GUIDE.replace("width: 12 mm, thickness: 0.5 mm", "width: 10 um, thickness: 5 um")
    assert bodies_that_bend(fx.loads(soft)) == set()
    assert bodies_that_bend(fx.loads(soft.replace("held:", "elastic: true, held:"))) == {"block"}


def test_over_a_short_stroke_a_body_bends_as_it_does_at_rest() -> None:
    model = fx.loads(GUIDE)
    rigid = with_rigid_bodies(model)
    one, other = (
        fx.stroke(own, move={"table.y": (0.0, 2e-4)}, steps=2).frequencies_hz[-1][:3] for own in (model, rigid)
    )
    np.testing.assert_allclose(np.divide(one, other), hz(model) / hz(rigid), rtol=1e-3)


def test_a_body_that_does_not_touch_what_it_carries_stays_rigid_or_is_named() -> None:
    far = GUIDE.replace("centre: [4 mm, tall/2, 6 mm]", "centre: [4 mm, tall/2, 60 mm]")
    assert bodies_that_bend(fx.loads(far)) == {"table"}
    with pytest.raises(fx.ModelError, match="carries a0, which is 48 mm from its solid"):
        fx.Plan(fx.loads(far.replace("held:", "elastic: true, held:")))
