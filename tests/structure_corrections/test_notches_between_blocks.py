"""Notches between blocks: against whole solids of another program, curved tetrahedra of order 4 (NGSolve).

A notch is what notch and blocks in one piece give, less a bar as long, plus the bar's section as a beam as long as the
notch; its blocks are as high and as long as the notch is high at its ends, between rigid faces.
"""

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.model_error.measured import EXACT, beam_stiffness
from flexura.beam import block_factors
from flexura.duals import Dual


def circular(radius, web, width):
    return fx.describe.Notch(width=width, contour=fx.describe.CircularContour(radius=radius, web=web))


SOLIDS = {
    (5.0, 5.0): (0.83623, 0.35746, 0.15672, 0.082394, 1.78248, 0.12779),
    (2.5, 1.0): (0.25789, 0.020814, 0.041233, 0.042032, 0.023311, 0.0090131),
}
"""Radius and width over web: stiffness in stretch, twist, bending about y by moments and between parallel ends, and
about z; E = web = 1, Poisson's ratio 0.3. 268 000 and 29 000 DOFs; order 3 of the first is within 0.06 %."""

LEVER = (422.69, 3637.1, 6277.4, 15342, 23713, 24781)
"""Hz, of a steel bar 8 mm wide and 6.5 mm high, held at one end, with a notch of radius 3 mm and web 0.5 mm from 6.5 to
12.5 of its 32.5 mm; 186 000 DOFs, order 3 within 0.11 %."""


@pytest.mark.parametrize("sizes", SOLIDS)
def test_all_six_stiffnesses_are_those_of_solids(sizes):
    radius, width = sizes
    found = beam_stiffness(circular(radius, 1.0, width), 2 * radius, 0.3, "auto", *EXACT)
    np.testing.assert_allclose(found, SOLIDS[sizes], rtol=0.01)


def test_a_lever_vibrates_as_the_solid_in_all_six_directions():
    own = {"material": "steel", "reference": "z"}
    bar = fx.describe.Rectangle(width=8e-3, thickness=6.5e-3)
    notch = {"profile": circular(3e-3, 0.5e-3, 8e-3), "elements": 20, "integration": "tapered"}
    lever = fx.Mechanism(
        materials={"steel": fx.describe.Material(E=200e9, nu=0.3, rho=7850)},
        nodes={"wall": (0, 0, 0), "a": (6.5e-3, 0, 0), "b": (12.5e-3, 0, 0), "tip": (32.5e-3, 0, 0)},
        flexures={"notch": fx.describe.Flexure(nodes=("a", "b"), **notch, **own)},
        links={
            "foot": fx.describe.Link(nodes=("wall", "a"), section=bar, root="rigid", **own),
            "arm": fx.describe.Link(nodes=("b", "tip"), section=bar, elements=10, **own),
        },
        ground={"wall": "clamped"},
    )
    np.testing.assert_allclose(fx.modes(lever, n=6).frequency_hz, LEVER, rtol=0.005)


@pytest.mark.parametrize("at", [(6.0, 0.6, 0.31), (45.6, 5.0, 0.4), (60.0, 0.09, 0.04), (0.7, 0.105, 0.43)])
def test_factors_have_the_slopes_of_their_differences(at):
    """Also at the ends of what is known and beyond them."""
    found = block_factors(*(Dual(np.array(x), np.eye(3)[:, k]) for k, x in enumerate(at)))
    for k, x in enumerate(at):
        step = 1e-6 * x
        there, here = (block_factors(*at[:k], x + s, *at[k + 1 :]) for s in (step, -step))
        slopes = [(float(a) - float(b)) / (2 * step) for a, b in zip(there, here, strict=True)]
        np.testing.assert_allclose([float(f.slope[k]) for f in found], slopes, rtol=1e-5, atol=1e-7)


def test_a_round_ellipse_is_an_arc_and_a_flat_one_is_straight():
    ellipse = fx.describe.Notch(width=5.0, contour=fx.describe.EllipticalContour(depth=5.0, web=1.0))
    flat = fx.describe.Notch(width=5.0, contour=fx.describe.EllipticalContour(depth=1e-9, web=1.0))
    straight = fx.describe.Notch(width=5.0, contour=fx.describe.StraightContour(web=1.0))
    for one, other in ((ellipse, circular(5.0, 1.0, 5.0)), (flat, straight)):
        pair = [beam_stiffness(form, 10.0, 0.3, "auto", *EXACT) for form in (one, other)]
        np.testing.assert_allclose(*pair, rtol=1e-3)
