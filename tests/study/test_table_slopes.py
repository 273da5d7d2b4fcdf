"""Slopes of members whose thickness is given by a table: its ends are those of the member but for round-off, and where
they are not, beside one design, nothing is worked out without a word."""

import numpy as np
import pytest

import flexura as fx
from flexura.full_order import plan_of
from flexura.study.questions import questions
from helpers.shell import flexura

LEAF = """\
name: one leaf by a table
theory: euler_bernoulli
corrections: none
parameters: {{ahead: 15 mm, length: {{value: {length} mm, minimum: 30 mm, maximum: 60 mm}}}}
materials: {{own: {{E: 200 GPa, nu: 0.3, rho: 8000 kg/m^3}}}}
nodes: {{foot: [0, 0, -ahead - length], head: [0, 0, -ahead]}}
flexures:
  leaf:
    nodes: [foot, head]
    material: own
    reference: x
    profile: {{type: notch, width: 10 mm, contour: {{shape: table, positions: [{at}], thicknesses: [{thick}]}}}}
bodies: {{mass: {{centre: [0, 0, 5 mm - ahead], mass: 20 g, inertia: [1 g*mm^2, 1 g*mm^2, 1 g*mm^2], carries: [head]}}}}
ground: {{foot: clamped}}
"""
TWO = "0, length", "0.5 mm, 0.4 mm"
FIVE = "0, length/4, length/2, 3*length/4, length", "0.5 mm, 0.4 mm, 0.3 mm, 0.4 mm, 0.5 mm"


def leaf(length, at, thick):
    return LEAF.format(length=length, at=at, thick=thick)


@pytest.mark.parametrize("length", [33, 40, 45, 57])
@pytest.mark.parametrize("table", [TWO, FIVE])
def test_a_table_that_moves_with_its_member_has_slopes(length, table):
    """Bending stiffness is as length^-3 where the table is stretched with the member; the leaf's mass as it."""
    found = fx.sensitivity(fx.loads(leaf(length, *table)), ask="stiffness(head.x), stiffness(head.y), mass")
    stiff, across, mass = found.relative[:, found.parameters.index("length")]
    own = 8000 * 0.01 * (0.45e-3 if table is TWO else 0.4e-3) * length * 1e-3
    assert stiff == pytest.approx(-3, rel=1e-9) and across == pytest.approx(-3, rel=1e-9)
    assert mass == pytest.approx(own / (own + 0.02), rel=1e-9)
    ahead = found.relative[:, found.parameters.index("ahead")]
    np.testing.assert_allclose(ahead, 0, atol=1e-9)
    assert not found.warnings


def test_a_table_that_stays_has_no_slopes_and_says_why(tmp_path):
    file = tmp_path / "leaf.yaml"
    file.write_text(leaf(40, "0, 40 mm", "0.5 mm, 0.4 mm"))
    found = fx.sensitivity(fx.load(file), ask="f1, mass, length")
    at = found.parameters.index("length")
    assert np.isnan(found.slope[:2, at]).all() and found.slope[2, at] == 1
    assert [own.place for own in found.warnings] == ["f1, mass"]
    said = "by length, with which tables of leaf no longer end where the member does"
    assert all(said in own.text for own in found.warnings)
    printed = flexura("sensitivity", str(file), "--ask", "f1, mass").stdout
    assert "none" in printed and "no longer end where the member does" in " ".join(printed.split())
    with pytest.raises(fx.FlexuraError, match=f"f1.*: it has no derivative {said}"):
        fx.optimize(fx.load(file), vary="length", maximise="f1")


@pytest.mark.parametrize(
    ("contour", "place"),
    [
        ("shape: table, positions: [0, 40 mm], thicknesses: [0.5 mm, 0.4 mm]", "positions"),
        ("shape: circular, radius: 20 mm, web: 0.5 mm", "radius"),
        ("shape: corner_filleted, fillet_radius: 20 mm, web: 0.5 mm", "fillet_radius"),
    ],
)
def test_designs_with_a_contour_that_does_not_fit_are_refused_among_others(contour, place):
    text = leaf(40, *TWO)
    old = text[text.index("shape: table") : text.index("}}\nbodies")]
    model = fx.loads(text.replace(old, contour))
    found = questions(plan_of(model), "f1, mass").values({"length": np.array([0.035, 0.04, 0.045])})
    lost = np.isnan(found.value).any(axis=1)
    refused = {"positions": [True, False, True], "radius": [False, False, True], "fillet_radius": [True, False, False]}
    assert lost.tolist() == refused[place]
    assert all(f"contour.{place}" in str(found.reason[k]) for k in np.flatnonzero(lost))
