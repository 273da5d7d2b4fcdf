"""What check and margins say of joints that are unlike those that elastic roots were measured of."""

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.model_error.measured import root_shares

LEAF = """
flexura: 1
materials: {{own: {{E: 70 GPa, nu: {nu}, rho: 2810 kg/m^3}}}}
nodes: {{a: [0, 0, 0], b: [8 mm, 0, 0]}}
flexures: {{leaf: {{nodes: [a, b], material: own, reference: y, {profile}}}}}
bodies:
  foot: {{centre: [-10 mm, 0, 0], carries: [a], solid: {{shape: box, size: [20 mm, {across}], material: own}}}}
  head: {{centre: [18 mm, 0, 0], carries: [b], solid: {{shape: box, size: [20 mm, {across}], material: own}}}}
ground: {{foot: clamped}}
"""


def joints(nu="0.3", width="12 mm", thickness="1 mm", across="20 mm, 20 mm"):
    """What check says of the joints: reference y, so that thickness is along y."""
    profile = f"profile: {{type: leaf, width: {width}, thickness: {thickness}}}"
    report = fx.check(fx.loads(LEAF.format(nu=nu, profile=profile, across=across)))
    return [d for d in (*report.warnings, *report.minor) if d.kind == "root"]


def test_joints_like_those_measured_are_told_without_a_reason():
    assert {d.text.split(";")[0] for d in joints()} == {"joint with a block", "joint with a block, in twist"}


@pytest.mark.parametrize(
    ("sizes", "said"),
    [
        ({"across": "20 mm, 10 mm"}, "narrower than the member: 83% of its width at least"),
        ({"width": "20 mm", "thickness": "0.3 mm"}, "of a member up to 66.7 times as wide as thick, where 40 is known"),
        ({"width": "1 mm", "thickness": "2 mm"}, "of a member only 0.5 times as wide as thick, where 0.7 is known"),
        ({"nu": "0.45"}, "of a Poisson's ratio up to 0.45, where 0.4 is known"),
        ({"nu": "0.1"}, "of a Poisson's ratio down to 0.1, where 0.2 is known"),
        ({"across": "1.2 mm, 12 mm"}, "reaches down to 0.1 thicknesses beyond the member, where 0.15 is known"),
    ],
)
def test_joints_unlike_those_measured_are_told_once_with_their_places(sizes, said):
    told = joints(**sizes)
    assert len(told) == 2 and all(said in d.text and "moves mode" in d.text and d.place == "leaf" for d in told)


def test_a_leaf_that_is_wider_than_its_block_is_a_warning():
    """Such roots are softer than the model's, by which modes move by more than 1 %."""
    report = fx.check(
        fx.loads(
            LEAF.format(nu="0.3", profile="profile: {type: leaf, width: 12 mm, thickness: 1 mm}", across="20 mm, 10 mm")
        )
    )
    assert any("narrower than the member" in d.text for d in report.warnings)


def test_shares_are_the_worst_of_solids_that_are_alike():
    """Solids: -26 % of bending where the leaf is a tenth wider than its block; 0.5 % at 60 times as wide as thick."""
    narrow, wide = root_shares(np.array([[0.3, 20, 2, 2, -1.0], [0.3, 60, 2, 2, 0.0]]))
    assert narrow[2, 1] >= 1 / (1 - 0.2504) - 1 and narrow[3, 1] >= 1 / (1 - 0.5161) - 1
    assert np.abs(wide[2]).max() < 0.05
