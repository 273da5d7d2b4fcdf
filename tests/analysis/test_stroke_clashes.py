"""Solids that meet in poses of a stroke, by gaps that are known."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx

EXAMPLES = Path(__file__).parents[2] / "examples"

STAGE = """
flexura: 1
name: leaf beside a post
nodes: {{a: [0, 0, 0], b: [100 mm, 0, 0]}}
flexures:
  leaf:
    nodes: [a, b]
    material: spring-steel
    reference: z
    elements: {elements}
    profile: {{type: leaf, width: 10 mm, thickness: 0.4 mm}}
bodies:
  post:
    centre: [{at} mm, 0, 10 mm]
    carries: [a]
    solid: {{shape: box, size: [2 mm, 20 mm, 4 mm], material: spring-steel}}
masses: {{tip: {{node: b, mass: 1 g}}}}
ground: {{post: clamped}}
corrections: none
"""


def test_blocks_of_a_stage_meet_where_their_gap_is_closed():
    """There is 1 mm between the table and the blocks beside it, of which one does not move along."""
    stage = fx.load(EXAMPLES / "xy_stage" / "xy_stage.yaml")
    near = fx.stroke(stage, move={"table.x": (0, 0.99e-3)}, steps=3, n=1)
    assert not [own for own in near.warnings if own.kind == "contact"]
    far = fx.stroke(stage, move={"table.x": (-1.2e-3, 1.2e-3)}, steps=25, n=1)
    said = [str(own) for own in far.warnings if own.kind == "contact"]
    assert len(said) == 2
    assert all("table meet, first at table.x = " in text for text in said)
    assert all(1e-3 <= abs(float(text.split(" = ")[1].split(" m")[0])) <= 1.1e-3 for text in said)


@pytest.mark.parametrize("at", [50.0, 70.0])
def test_a_leaf_bends_into_a_post(at):
    """The deflection of a cantilever, w = f (3 s^2 - s^3)/2 at s of its length, closes a gap of 7.8 mm."""
    s = np.array([at - 1, at + 1]) / 100
    bent = ((3 * s**2 - s**3) / 2).max()
    tip = 7.8e-3 / bent
    steps = np.linspace(0.6, 1.4, 81)
    found = fx.stroke(
        fx.loads(STAGE.format(at=at, elements=10)), move={"b.z": (0.6 * tip, 1.4 * tip)}, steps=len(steps), n=1
    )
    (said,) = [str(own) for own in found.warnings if own.kind == "contact"]
    assert said.startswith("leaf and post meet")
    first = float(said.split(" = ")[1].split(" m")[0])
    # shortening by large deflection and the turned thickness, some per cent
    assert first == pytest.approx(tip, rel=0.06)


@pytest.mark.parametrize(
    ("file", "move"),
    [
        ("guide/guide.yaml", {"carriage.x": (-0.02, 0.02)}),
        ("pivot/pivot.yaml", {"arm.ry": (-0.5, 0.5)}),
        ("rpr/rpr.yaml", {"platform.rx": (-0.05, 0.05)}),
        ("tip_tilt/tip_tilt.yaml", {"mirror.rx": (-0.01, 0.01)}),
        ("amplifier/amplifier.yaml", {"output.z": (0, 2e-4)}),
    ],
)
def test_parts_that_are_joined_or_pass_beside_do_not_meet(file, move):
    found = fx.stroke(fx.load(EXAMPLES / file), move=move, steps=5, n=1)
    assert not [own for own in found.warnings if own.kind == "contact"]


def test_what_is_left_out_is_noted():
    found = fx.stroke(fx.load(EXAMPLES / "guide" / "guide.yaml"), move={"carriage.x": 1e-3}, n=1)
    assert found.notes[0] == "not modelled: contact, plasticity, distortion of sections"
