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
  mean: {{value: ({" + ".join(f"s{k}" for k in range(pieces))}) / {pieces}}}
  squares: {{value: ({" + ".join(f"s{k}^2" for k in range(pieces))}) / {pieces}}}
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


def column(pieces: int, section: str) -> fx.Mechanism:
    """A column along x, clamped at its foot and free at its head, which bears a thrust: half of one that is hinged."""
    return stepped(pieces, section, f"ground: {{n0: clamped}}\nloads: {{n{pieces}: {{force: [-1 N, 0, 0]}}}}", "1 mm")


@pytest.mark.parametrize(
    ("section", "volume", "factor", "power"),
    [
        # all sections alike, I ~ A^2: Clausen 1851; Tadjbakhsh and Keller 1962
        ("{shape: rectangle, width: 3*S, thickness: S}", "squares <= 1 [mm^2]", 4 / 3, 2),
        # strips of one thickness, I ~ A: the moment, and so the width, is a parabola; 3 E I / L^2
        pytest.param(
            *("{shape: rectangle, width: 10*S, thickness: 0.5 mm}", "mean <= 1 mm", 12 / np.pi**2, 1),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_the_strongest_column(section, volume, factor, power):
    """Buckling of steps stays below the closed form of the smooth column, and comes near it as they become many; the
    factor grows with that power of the volume."""
    lost = []
    for pieces in (2, 4):
        mechanism = column(pieces, section)
        vary = dict.fromkeys((f"s{k}" for k in range(pieces)), (0.05e-3, 3e-3))
        found = best(mechanism, vary, maximise="buckling", subject_to=volume, starts=1)
        uniform = fx.preload(mechanism).buckling_factor
        lost.append(1 - found.value / uniform / factor)
        assert found.active[0].per_percent == pytest.approx(0.01 * power * found.value, rel=1e-3)
        assert found.kkt_residual < 1e-6 and found.evaluations < 40
    assert 0 < lost[1] < 0.5 * lost[0] < 0.08


def test_the_bar_of_greatest_frequency_along_its_axis():
    """A ~ 1 / cosh^2(b x), b = w / c, carries a tip mass M on a bar of mass m at w = c asinh((m / M)^(1/2)) / L (Turner
    1967; Taylor 1967); the uniform one at b L tan(b L) = m / M. Steps stay below the first."""
    pieces, mean = 4, 2e-3
    mass = RHO * LENGTH * WIDTH * mean
    sides = "\n".join(f"  n{k}: {{free: [tx]}}" for k in range(1, pieces + 1))
    mechanism = stepped(
        pieces, DEPTH, f"ground:\n  n0: clamped\n{sides}\nmasses: {{m: {{node: n{pieces}, mass: {mass} kg}}}}"
    )
    mechanism = fx.loads(fx.dumps(mechanism).replace("elements: 2", "elements: 8"))
    vary = dict.fromkeys((f"s{k}" for k in range(pieces)), (0.5e-3, 10e-3))
    found = best(mechanism, vary, maximise="f1", subject_to="mean <= 2 mm", starts=1)
    root = 0.8603335890193798  # of x tan x = 1
    hertz = np.sqrt(E / RHO) / LENGTH / (2 * np.pi)
    gain = np.arcsinh(1) / root - 1
    assert 0.9 * gain < found.value / (hertz * root) - 1 < gain
    assert all(a > b for a, b in zip(found.optimum.values(), list(found.optimum.values())[1:], strict=False))
    # d ln w / d ln m of the closed form
    assert found.active[0].per_percent == pytest.approx(0.01 * found.value * np.sqrt(1 / 8) / np.arcsinh(1), rel=0.02)


PORTAL = """
flexura: 1
name: portal
theory: euler_bernoulli
corrections: none
parameters: {s0: 1 mm, s1: 1 mm, s2: 1 mm, mean: (s0 + s1 + s2) / 3}
materials:
  m: {E: 200 GPa, nu: 0.3, rho: 1e-3 kg/m^3}
substructures:
  column:
    nodes: {n0: [0, 0, 0], n1: [0, 0, 30 mm], n2: [0, 0, 60 mm], n3: [0, 0, 90 mm]}
    links:
LINKS
    interface: [n0, n3]
instances:
  column: {of: column, at: [-200 mm, 0, 0], pattern: {type: linear, count: 2, step: [400 mm, 0, 0]}}
bodies:
  beam:
    centre: [0, 0, 90 mm]
    mass: 2 kg
    inertia: [1e-6 kg*m^2, 1e-6 kg*m^2, 1e-6 kg*m^2]
    carries: ["column*.n3"]
ground: {"column*.n0": clamped}
"""


def test_the_portal_frame_that_sways_highest():
    """Columns between the ground and a rigid beam bend with M ~ x - a. Of depths with a given mean the stiffest have
    A_j ~ m_j^(1/4), m_j the mean square of M in piece j (I ~ A^3, from stationarity), so that the frequency rises by
    (mean m at L/2)^(1/2) / (mean m^(1/4))^2, where a is that for which this is most: L/2 of three pieces. It goes with
    the mean to 3/2."""
    links = "\n".join(
        f"      l{k}: {{nodes: [n{k}, n{k + 1}], material: m, reference: x, elements: 1,"
        f" section: {{shape: rectangle, width: 20 mm, thickness: s{k}}}}}"
        for k in range(3)
    )
    vary = dict.fromkeys((f"s{k}" for k in range(3)), (0.2e-3, 3e-3))
    found = best(fx.loads(PORTAL.replace("LINKS", links)), vary, maximise="f1", subject_to="mean <= 1 mm", starts=1)
    turning = np.linspace(0, 1, 101)
    m = np.diff((np.linspace(0, 1, 4) - turning[:, None]) ** 3) / 3 * 3
    assert turning[np.argmin(np.mean(m**0.25, axis=1))] == 0.5
    m = m[50]
    uniform = np.sqrt(2 * 12 * 200e9 * 20e-3 * 1e-3**3 / 12 / 0.09**3 / 2) / (2 * np.pi)
    assert found.value / uniform == pytest.approx(np.sqrt(m.mean()) / np.mean(m**0.25) ** 2, rel=1e-4)
    assert np.array(list(found.optimum.values())) == pytest.approx(1e-3 * m**0.25 / np.mean(m**0.25), rel=1e-3)
    assert found.active[0].per_percent == pytest.approx(0.015 * found.value, rel=1e-3)


@pytest.mark.slow
def test_multipliers_are_what_the_verbs_and_new_searches_say():
    """Of the guide with its thickness at a bound, 1 % of stress buys (df/dL) / (dS/dL), by differences of `modes` and
    `stroke`, and what searches with limits 1 % apart gain."""
    guide = fx.load("examples/guide/guide.yaml")
    vary = {"thickness": (0.2e-3, 0.6e-3), "length": (30e-3, 100e-3)}

    def search(limit: float) -> fx.Optimum:
        asked = f"stress <= {limit} MPa at carriage.x = 2 mm"
        return best(guide, vary, maximise="f1", subject_to=asked, starts=1)

    def told(length: float) -> tuple[float, float]:
        sizes = {"thickness": 0.6e-3, "length": length}
        pose = fx.stroke(guide, sizes, move={"carriage.x": 2e-3}, steps=1)
        members = pose.stresses(len(pose.poses) - 1).members
        hertz = fx.modes(guide, sizes, n=1, order="full").modes[0].frequency_hz
        return hertz, max(own.von_mises for own in members if own.von_mises is not None)

    found = search(400)
    length = found.optimum["length"]
    (hertz, stress), (other_hertz, other_stress) = told(0.9999 * length), told(1.0001 * length)
    stressed = found.active[0]
    assert stressed.multiplier == pytest.approx((other_hertz - hertz) / (other_stress - stress), rel=1e-6)
    assert stressed.per_percent == pytest.approx((search(404).value - search(396).value) / 2, rel=1e-4)
