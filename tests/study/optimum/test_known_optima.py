"""Optima that are known in closed form: sizes, goal, and what giving way buys, by hand."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx

E, RHO, LENGTH, WIDTH = 200e9, 7800.0, 0.1, 10e-3


def stepped(pieces: int, section: str, rest: str, start: str = "8 mm") -> fx.Mechanism:
    """A Bernoulli beam along x of `pieces` equal lengths; the size `S` of their sections is `s0`, `s1`, ..."""
    sizes = "\n".join(f"  s{k}: {{value: {start}, minimum: 0.01 mm, maximum: 100 mm}}" for k in range(pieces))
    nodes = "\n".join(f"  n{k}: [{LENGTH} m * {k} / {pieces}, 0, 0]" for k in range(pieces + 1))
    sections = [section.replace("S", f"s{k}") for k in range(pieces)]
    links = "\n".join(
        f"  l{k}: {{nodes: [n{k}, n{k + 1}], material: m, reference: z, elements: 2, section: {own}}}"
        for k, own in enumerate(sections)
    )
    return fx.loads(
        f"""
flexura: 1
name: stepped
theory: euler_bernoulli
corrections: none
parameters:
{sizes}
  volume: {{value: ({" + ".join(f"s{k}" for k in range(pieces))}) / {pieces}}}
materials:
  m: {{E: {E} Pa, nu: 0.3, rho: {RHO} kg/m^3, yield_stress: 300 MPa}}
nodes:
{nodes}
links:
{links}
{rest}
"""
    )


def best(mechanism: fx.Mechanism, vary: dict[str, tuple[float, float]], **asked: object) -> fx.Optimum:
    found = fx.optimize(mechanism, vary=vary, **asked)  # type: ignore[arg-type]
    assert isinstance(found, fx.Optimum)
    assert not found.warnings
    return found


DEPTH = "{shape: rectangle, width: 10 mm, thickness: S}"
FORCE = "ground: {n0: clamped}\nloads: {n4: {force: [0, 0, -100 N]}}"


@pytest.mark.parametrize("asked", ["stress <= 100 MPa", "margin >= 3"])
def test_the_lightest_cantilever_is_stressed_alike_everywhere(asked):
    """Depth where 6 P x / (b h^2) = S at the inner end of each piece, so that all four bind at once (Galilei 1638: a
    parabola in the limit, of 2/3 the mass); mass ~ S^(-1/2)."""
    pieces, S = 4, 100e6
    mechanism = stepped(pieces, DEPTH, FORCE)
    names = [f"s{k}" for k in range(pieces)]
    found = best(mechanism, dict.fromkeys(names, (1e-3, 20e-3)), minimise="mass", subject_to=asked, starts=1)
    depth = np.sqrt(6 * 100 * LENGTH * (1 - np.arange(pieces) / pieces) / (WIDTH * S))
    mass = RHO * WIDTH * LENGTH / pieces * depth.sum()
    assert [found.optimum[name] for name in names] == pytest.approx(depth, rel=1e-6)
    assert found.value == pytest.approx(mass, rel=1e-7)
    assert found.active[0].per_percent == pytest.approx(0.01 * mass / 2, rel=1e-5)
    assert found.kkt_residual < 1e-6 and found.evaluations < 40
