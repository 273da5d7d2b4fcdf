"""A cantilever that is pushed too far, and what a result says of it."""

from __future__ import annotations

import flexura as fx

E, YIELD = 200e9, 500e6


LEAF = {"material": "steel", "reference": (0, 1, 0)}


def cantilever(size=1.0, **more):
    """A bar of 100 x 10 x 1 times `size`, m/1000, along x, clamped at a."""
    L, b, t = 0.1 * size, 0.01 * size, 0.001 * size
    link = fx.describe.Link(nodes=("a", "b"), section=fx.describe.Rectangle(width=b, thickness=t), elements=8, **LEAF)
    return fx.Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"steel": fx.describe.Material(E=E, nu=0.3, rho=7800.0, yield_stress=YIELD)},
        nodes={"a": (0, 0, 0), "b": (L, 0, 0)},
        links={"bar": link},
        ground={"a": "clamped"},
        **more,
    )


def warned(result):
    return {w.kind: w for w in result.warnings}
