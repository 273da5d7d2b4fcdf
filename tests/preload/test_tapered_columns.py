"""Buckling of columns whose section varies, against Dinnik's solutions (1929; Timoshenko and Gere 1961, sec. 2.14).

A cantilever along x from its clamped, thick end, pushed at its thin end; s runs from where the taper would end.
"""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import j0, j1, y0, y1

import flexura as fx

E, L = 200e9, 0.2
THICK, THIN, WIDTH = 6e-3, 3e-3, 60e-3
STEEL = fx.describe.Material(E=E, nu=0.3, rho=7800.0)
S0, S1 = L * THIN / (THICK - THIN), L * THICK / (THICK - THIN)


def tapered_column(profile, elements, integration="tapered", theory="euler_bernoulli"):
    hinge = fx.describe.Flexure(
        nodes=("a", "b"), material="steel", profile=profile, reference=(0, 0, 1), elements=elements,
        integration=integration,
    )  # fmt: skip
    nodes = {"a": (0, 0, 0), "b": (L, 0, 0)}
    return fx.Mechanism(
        theory=theory, corrections="none", materials={"steel": STEEL}, nodes=nodes, flexures={"bar": hinge},
        ground={"a": "clamped"},
    )  # fmt: skip


CONTOUR = fx.describe.TabulatedContour(positions=(0.0, L), thicknesses=(THICK, THIN))
WEDGE, CONE = fx.describe.Notch(width=WIDTH, contour=CONTOUR), fx.describe.RoundNotch(contour=CONTOUR)


def dinnik_wedge() -> float:
    """I ~ s^3: v = sqrt(s) Z_1(2 k / sqrt(s)), v(s0) = 0 beside the load, v'(s1) = 0."""

    def slope_at_clamp(k):
        z = [2 * k / np.sqrt(s) for s in (S0, S1)]
        a, b = y1(z[0]), -j1(z[0])  # v(s0) = 0
        # d/ds [sqrt(s) Z_1(z)] = (2 Z_1 - z Z_0) / (2 sqrt(s))
        return a * (2 * j1(z[1]) - z[1] * j0(z[1])) + b * (2 * y1(z[1]) - z[1] * y0(z[1]))

    grid = np.linspace(0.1, 20.0, 4000) * np.sqrt(S0)
    values = slope_at_clamp(grid)
    first = int(np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:]))[0])
    k = brentq(slope_at_clamp, grid[first], grid[first + 1], xtol=1e-15)
    return k**2 * E * WIDTH * THIN**3 / 12 / S0**3


def dinnik_cone() -> float:
    """I ~ s^4: v = s sin(k/s - k/s0), v'(s1) = 0."""
    k = brentq(lambda k: np.tan(k / S0 - k / S1) + k / S1, 1.6 / (1 / S0 - 1 / S1), 3.1 / (1 / S0 - 1 / S1))
    return k**2 * E * np.pi * THIN**4 / 64 / S0**4


def push(mechanism):
    return fx.preload(mechanism, loads={"b": (-1, 0, 0, 0, 0, 0)}).buckling_factor


@pytest.mark.parametrize(("profile", "exact"), [(WEDGE, dinnik_wedge()), (CONE, dinnik_cone())], ids=["wedge", "cone"])
def test_tapered_elements_buckle_at_dinnik_s_load(profile, exact):
    errors = np.array([push(tapered_column(profile, n)) / exact - 1 for n in (1, 2, 4, 8)])
    assert (errors > 0).all() and errors[0] < 0.03 and errors[3] < 1e-5
    assert np.log2(errors[2] / errors[3]) == pytest.approx(4, abs=0.1)
    stepped = abs(push(tapered_column(profile, 8, "stepped")) / exact - 1)
    assert stepped > 100 * errors[3]
    assert abs(push(tapered_column(profile, 64, "stepped")) / exact - 1) < stepped / 50
