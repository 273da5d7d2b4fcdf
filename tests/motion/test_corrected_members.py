"""Large motion of members with corrections: twist that shortens and stiffens, held warping, convergence.

Timoshenko, Strength of materials, part II (1956): torsion of thin strips. Timoshenko, Gere, Theory of elastic stability
(1961), sec. 5.4: torsional buckling. The solid is of CalculiX 2.20, 36 x 12 elements C3D20R, NLGEOM.
"""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.motion import buckling_factor
from helpers.large_motion import Moved

EXAMPLES = Path(__file__).parents[2] / "examples"
E, G = 210e9, 210e9 / 2.6
STRIP = """
flexura: 1
name: strip
corrections: {corrections}
materials: {{m: {{E: 210 GPa, nu: 0.3, rho: 7800 kg/m^3}}}}
nodes: {{a: [0, 0, 0], b: [{length} mm, 0, 0]}}
flexures:
  leaf:
    {{nodes: [a, b], material: m, reference: y, elements: {elements}, ends: [{ends}, {ends}], root: rigid,
     profile: {{type: leaf, width: {width} mm, thickness: 0.4 mm}}}}
ground: {{a: clamped, b: {{fixed: [{held}]}}}}
"""
GUIDE = """
flexura: 1
name: guide
corrections: {corrections}
nodes: {{a0: [0, 0, 0], a1: [50 mm, 0, 0], b0: [0, 60 mm, 0], b1: [50 mm, 60 mm, 0]}}
flexures:
  one:
    {{nodes: [a0, a1], material: spring-steel, reference: y, elements: {elements}, root: rigid,
     profile: {{type: leaf, width: 15 mm, thickness: 0.4 mm}}}}
  two:
    {{nodes: [b0, b1], material: spring-steel, reference: y, elements: {elements}, root: rigid,
     profile: {{type: leaf, width: 15 mm, thickness: 0.4 mm}}}}
bodies:
  carriage:
    centre: [50 mm, 30 mm, 0]
    solid: {{shape: box, size: [10 mm, 80 mm, 20 mm], material: Al-6061-T6}}
    carries: [a1, b1]
ground: {{a0: clamped, b0: clamped}}
"""


def strip(corrections="auto", ends="clamped", held="ty, tz, ry, rz", elements=10, width=15, length=50):
    """A strip clamped at a; b turns about its axis where it is not held."""
    own = {"corrections": corrections, "ends": ends, "held": held, "elements": elements}
    return fx.loads(STRIP.format(**own, width=width, length=length))


def section(b, t):
    """A, Ip, Irr and Saint-Venant's J of a strip; J is the series of Timoshenko and Goodier."""
    odd = np.arange(1, 40, 2)
    J = b * t**3 / 3 * (1 - 192 * t / np.pi**5 / b * (np.tanh(odd * np.pi * b / 2 / t) / odd**5).sum())
    return b * t, (b**3 * t + b * t**3) / 12, b**5 * t / 80 + 2 * (b * t) ** 3 / 144 + b * t**5 / 80, J


@pytest.mark.parametrize("elements", [1, 5])
@pytest.mark.parametrize("pull", [0.0, 300.0, -40.0])
def test_a_strip_that_is_twisted_shortens_and_stiffens(elements, pull):
    """T = (GJ + N Ip/A) k + E (Irr - Ip^2/A) k^3/2 and a shortening of Ip k^2 L/2A, warping free."""
    A, Ip, Irr, J = section(15e-3, 0.4e-3)
    angle, L = np.radians(20), 50e-3
    mechanism = strip("[warping]", "free", elements=elements)
    (pose,) = fx.stroke(mechanism, move={"b.rx": angle}, n=1, loads={"b": [pull, 0, 0, 0, 0, 0]}).poses
    rate = angle / L
    torque = (G * J + pull * Ip / A) * rate + E * (Irr - Ip**2 / A) * rate**3 / 2
    assert pose.reaction["b.rx"] == pytest.approx(torque, rel=1e-6)
    assert pose.displacement["b"][0] == pytest.approx(pull * L / (E * A) - Ip / A * rate**2 * L / 2, rel=1e-6)
    (plain,) = fx.stroke(strip("none", elements=elements), move={"b.rx": angle}, n=1).poses
    assert plain.reaction["b.rx"] == pytest.approx(G * J * rate, rel=1e-6)
    assert plain.displacement["b"][0] == pytest.approx(0, abs=1e-12)


def test_a_strip_that_is_held_pulls():
    """E Ip k^2/2 of pull, and with it E Irr k^3/2 of torque."""
    _, Ip, Irr, J = section(15e-3, 0.4e-3)
    rate = np.radians(20) / 50e-3
    mechanism = strip("[warping]", "free", "tx, ty, tz, ry, rz")
    found = fx.stroke(mechanism, move={"b.rx": rate * 50e-3}, n=1)
    assert found.poses[0].reaction["b.rx"] == pytest.approx(G * J * rate + E * Irr * rate**3 / 2, rel=1e-6)
    ((start, _),) = found.end_forces.values()
    assert start[0, 0, 0, 0] == pytest.approx(E * Ip * rate**2 / 2, rel=1e-6)


@pytest.mark.parametrize(("degrees", "said"), [(8, False), (10, True), (20, True)])
def test_the_stretch_of_edges_is_told(degrees, said):
    """(b^2/4 + t^2/4 - Ip/A) k^2/2, which is k^2 Ip/A."""
    rate = np.radians(degrees) / 50e-3
    A, Ip, *_ = section(15e-3, 0.4e-3)
    stretch = ((15e-3**2 + 0.4e-3**2) / 4 - Ip / A) * rate**2 / 2
    assert (stretch > 2e-4) == said
    found = fx.stroke(strip("[warping]", "free"), move={"b.rx": rate * 50e-3}, n=1)
    told = [warning for warning in found.warnings if warning.kind == "twist"]
    assert [(own.place, own.value) for own in told] == [("leaf", pytest.approx(stretch, rel=1e-6))] * said


@pytest.mark.parametrize("angle", [0.1, 0.5, 2.0])
def test_a_strip_that_is_bent_far_stays_flat_across(angle):
    """M = d/dk of D b k^2 (1 - nu^2 F)/2, F = 2 (cosh a - cos a)/(sinh a + sin a)/a, a^4 = 3 (1 - nu^2) b^4 k^2/t^2
    (Ashwell 1950)."""
    b, t, L, nu = 15e-3, 0.4e-3, 50e-3, 0.3

    def energy(k: float) -> float:
        a = (3 * (1 - nu**2) * b**4 * k**2 / t**2) ** 0.25
        bow = 2 * (np.cosh(a) - np.cos(a)) / (np.sinh(a) + np.sin(a)) / a
        return E * b * t**3 / 24 / (1 - nu**2) * k**2 * (1 - nu**2 * bow)

    (pose,) = fx.stroke(strip("[plate]", "free", "tz, rx, ry"), move={"b.rz": angle}, n=1).poses
    k, step = angle / L, 1e-4 * angle / L
    assert pose.reaction["b.rz"] == pytest.approx((energy(k + step) - energy(k - step)) / (2 * step), rel=1e-6)


def test_torsional_buckling_of_a_short_wide_strip():
    """At GJ A/Ip, below Euler's load of this length."""
    A, Ip, _, J = section(15e-3, 0.4e-3)
    critical = G * J * A / Ip
    moved = Moved(strip("[warping]", "free", length=15))
    (pose,) = moved.loaded([{"b": [-0.9 * critical, 0, 0, 0, 0, 0]}])
    assert buckling_factor(pose) == pytest.approx(1 / 0.9, rel=2e-3)


# degrees, torque in N mm, shortening in mm; torque, pull in N with the ends held
SOLID = [
    (10, 113.346, 0.00604484, 123.888, 153.083),
    (20, 280.482, 0.0239377, 362.355, 604.149),
    (30, 549.504, 0.0533852, 819.895, 1344.871),
]


@pytest.mark.parametrize(("degrees", "torque", "short", "held", "pull"), SOLID)
def test_twist_between_flat_ends_against_a_solid(degrees, torque, short, held, pull):
    """Torque is up to 1.4 % high at 30 degrees: what fibres are stretched by does not change within a width."""
    move = {"b.rx": np.radians(degrees)}
    (pose,) = fx.stroke(strip(), move=move, n=1).poses
    assert 1e3 * pose.reaction["b.rx"] == pytest.approx(torque, rel=1.5e-2)
    assert -1e3 * pose.displacement["b"][0] == pytest.approx(short, rel=7.5e-3)
    found = fx.stroke(strip(held="tx, ty, tz, ry, rz"), move=move, n=1)
    assert 1e3 * found.poses[0].reaction["b.rx"] == pytest.approx(held, rel=1.2e-2)
    ((start, _),) = found.end_forces.values()
    assert start[0, 0, 0, 0] == pytest.approx(pull, rel=1e-3)


# mm of stroke; force in N, shortening in mm, stiffness across in N/mm of a leaf between parallel ends; how far off
# stiffness is, as at rest, and that of plain beams
SIDEWAYS = [
    (2, 3.39690, 0.0482658, 1483.33, -0.006, -0.065),
    (4, 6.84967, 0.193297, 983.495, -0.002, -0.348),
    (8, 14.0912, 0.777510, 433.188, 0.005, -0.528),
]


@pytest.mark.parametrize(("stroke", "force", "short", "across", "off", "plain"), SIDEWAYS)
def test_a_leaf_between_parallel_ends_against_a_solid(stroke, force, short, across, off, plain):
    for corrections, expected in (("auto", off), ("none", plain)):
        mechanism = strip(corrections, held="rx, ry, rz", elements=20)
        (pose,) = fx.stroke(mechanism, move={"b.y": stroke * 1e-3}, n=1).poses
        assert pose.support_stiffness[2] * 1e-3 / across - 1 == pytest.approx(expected, abs=4e-3)
        if corrections == "auto":
            assert pose.reaction["b.y"] == pytest.approx(force, rel=6e-3)
            assert -1e3 * pose.displacement["b"][0] == pytest.approx(short, rel=3e-3)


# length over width, width over thickness, and stiffness across over E t at a stroke of 0.2 of the length: NGSolve 6.2,
# hexahedra of order 3, St. Venant and Kirchhoff's material; 28 x 6, 20 x 6, 12 x 4 and 8 x 6 cells, 19380 to 5700 DOFs
WIDE = [(10, 200, 3.7744e-6), (10 / 3, 200, 1.7550e-4), (10 / 3, 10, 1.55924e-2), (1, 50, 0.150057)]


@pytest.mark.parametrize(("long", "wide", "across"), WIDE)
def test_wide_leaves_at_a_fifth_of_their_length(long, wide, across):
    mechanism = strip(held="rx, ry, rz", width=wide * 0.4, length=long * wide * 0.4)
    (pose,) = fx.stroke(mechanism, move={"b.y": 0.2 * long * wide * 0.4e-3}, n=1).poses
    assert pose.support_stiffness[2] / (E * 0.4e-3) == pytest.approx(across, rel=0.016 if long == 1 else 0.01)


@pytest.mark.parametrize(
    ("corrections", "elements", "close"),
    [("none", 10, 1e-3), ("[warping]", 4, 5e-3), ("[warping]", 10, 1.1e-3), ("auto", 10, 5e-3)],
)
def test_corrected_guides_converge(corrections, elements, close):
    """Against 64 elements: forces, parasitic modes and support stiffness at 0.16 of the length of leaves."""
    found = []
    for count in (elements, 64):
        mechanism = fx.loads(GUIDE.format(corrections=corrections, elements=count))
        (pose,) = fx.stroke(mechanism, move={"carriage.y": 8e-3}, n=3).poses
        held = [value for k, value in enumerate(pose.support_stiffness) if k in (0, 2, 3, 4)]
        found.append([pose.reaction["carriage.y"], *pose.frequency_hz, *held])
    np.testing.assert_allclose(found[0], found[1], rtol=close)


@pytest.mark.parametrize(("elements", "stroke"), [(1, 1e-4), (1, 1e-3), (1, 3e-3), (2, 8e-3)])
def test_errors_for_want_of_elements_are_estimated(elements, stroke):
    """Of the support stiffnesses, against 40 elements."""
    coarse, fine = (
        fx.stroke(fx.loads(GUIDE.format(corrections="none", elements=count)), move={"carriage.y": stroke}, n=1)
        for count in (elements, 40)
    )
    (own,), (other,) = coarse.poses, fine.poses
    held = [0, 2, 3, 4, 5]
    error = max(own.support_stiffness[k] / other.support_stiffness[k] - 1 for k in held)
    assert own.mesh_error == pytest.approx(dict.fromkeys(("one", "two"), error), rel=0.1)
    assert [w.place for w in coarse.warnings if w.kind == "mesh"] == ["one", "two"] * (error > 0.01)
    assert other.mesh_error == {}


def test_short_leaves_of_one_element_may_be_fine():
    """Those of the platform: with six times as many elements stiffnesses are the same within 2e-4."""
    rpr = fx.load(EXAMPLES / "rpr" / "rpr.yaml")
    for move in ({"platform.z": 5e-4}, {"platform.rx": 1e-2}):
        assert not [w for w in fx.stroke(rpr, move=move, n=1).warnings if w.kind == "mesh"]


def test_very_short_elements_still_have_their_modes():
    """Four hundred of a leaf lose digits, not modes."""
    coarse, fine = (
        fx.stroke(fx.loads(GUIDE.format(corrections="none", elements=count)), move={"carriage.y": 8e-3}, n=3)
        for count in (40, 400)
    )
    np.testing.assert_allclose(fine.poses[0].frequency_hz, coarse.poses[0].frequency_hz, rtol=1e-4)
