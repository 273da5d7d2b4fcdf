"""Closed forms of beams, rods, rings and simple flexure mechanisms.

Euler-Bernoulli wave numbers, rods with end discs, beams with end masses: Blevins, Formulas for Natural Frequency and
Mode Shape (1979), chapter 8; Rayleigh beam on simple supports: Rayleigh, The Theory of Sound (1877), sec. 186;
Timoshenko beam: Timoshenko, Phil. Mag. 41 (1921) 744-746; rings: Love, The Mathematical Theory of Elasticity (1927),
sec. 293; parallel and crossed leaf springs: Jones, J. Sci. Instrum. 28 (1951) 38-41, Wittrick, Aeronautical Quarterly
2 (1951) 272-292.

Tolerances: 1e-5 for cubic elements, more where convergence is of second order (rods, shear, polygons instead of rings);
1e-8 for static stiffness, which elements give exactly.
"""

import numpy as np
import pytest

from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.mechanism import Circle, Link, Material, Mechanism, PointMass, Rectangle, RigidBody
from flexura.reduction.low_order import reduce
from helpers.beam_models import HELD, XY, frequencies, in_plane, roots, straight
from helpers.verification_report import Case

E, NU, RHO = 200e9, 0.3, 7800.0
STEEL = Material(E=E, nu=NU, rho=RHO)
LENGTH, B, H = 0.5, 0.012, 0.008
BAR = Rectangle(width=H, thickness=B)  # H lies in the xy plane
A, I = B * H, B * H**3 / 12  # noqa: E741
BENDING = ("ty", "rz")
SLIDING = {"fixed": ("tx", "tz", "rx", "ry", "rz")}
EXTENSION, TORSION = ("tx",), ("rx",)

ENDS = {  # frequency equation of kL, scaled by cosh, and what is held at the two ends
    "clamped-free": (lambda k: np.cos(k) + 1 / np.cosh(k), {"a": "clamped"}),
    "clamped-clamped": (lambda k: np.cos(k) - 1 / np.cosh(k), {"a": "clamped", "b": "clamped"}),
    "free-free": (lambda k: np.cos(k) - 1 / np.cosh(k), {}),
    "pinned-pinned": (np.sin, {"a": {"fixed": HELD["pinned"]}, "b": {"fixed": HELD["rolls"]}}),
    "clamped-pinned": (
        lambda k: np.sin(k) - np.cos(k) * np.tanh(k),
        {"a": "clamped", "b": {"fixed": HELD["rolls"]}},
    ),
    "clamped-sliding": (lambda k: np.tan(k) + np.tanh(k), {"a": "clamped", "b": SLIDING}),
}
PRINTED = {  # kL as tabulated by Blevins, table 8-1
    "clamped-free": [1.87510407, 4.69409113, 7.85475744],
    "clamped-clamped": [4.73004074, 7.85320462, 10.9956079],
    "free-free": [4.73004074, 7.85320462, 10.9956079],
    "pinned-pinned": [np.pi, 2 * np.pi, 3 * np.pi],
    "clamped-pinned": [3.92660231, 7.06858275, 10.21017612],
    "clamped-sliding": [2.36502037, 5.49780392, 8.63937983],
}


@pytest.mark.parametrize("ends", ENDS)
def test_uniform_beam(verify, ends):
    case = Case("Uniform beam", "Blevins 1979, table 8-1", "Euler-Bernoulli")
    equation, ground = ENDS[ends]
    k = roots(equation, 1.0, 0.3, 5)
    np.testing.assert_allclose(k[:3], PRINTED[ends], rtol=1e-8)
    exact = (k / LENGTH) ** 2 * np.sqrt(E * I / (RHO * A)) / (2 * np.pi)
    beam = straight(BAR, STEEL, LENGTH, 64, ground)
    f = in_plane(beam, 5, BENDING, rigid=2 if not ground else 0)
    verify(case, f"{ends}, mode", f, exact, 1e-5)
    frequencies(beam, 6, rigid=6 if not ground else 0)


@pytest.mark.parametrize("theory", ["rayleigh", "timoshenko"])
def test_simply_supported_thick_beam(verify, theory):
    case = Case(
        f"Simply supported thick beam, {theory}",
        "Rayleigh 1877, sec. 186; Timoshenko 1921",
        theory.capitalize(),
    )
    length, n = 0.05, np.arange(1, 5)
    p2, r2, k = (n * np.pi / length) ** 2, I / A, 10 * (1 + NU) / (12 + 11 * NU)
    s = 2 * (1 + NU) / k if theory == "timoshenko" else 0.0  # E / kG
    a, b, c = RHO * r2 * s / E, 1 + r2 * p2 * (1 + s), E * r2 * p2**2 / RHO
    exact = np.sqrt(2 * c / (b + np.sqrt(b * b - 4 * a * c))) / (2 * np.pi)
    beam = straight(BAR, STEEL, length, 100, ENDS["pinned-pinned"][1], theory)
    verify(case, "mode", in_plane(beam, 4, BENDING), exact, 1e-5 if theory == "rayleigh" else 5e-4)


@pytest.mark.parametrize("ratio", [0.25, 1.0, 4.0])
def test_cantilever_with_a_mass_at_its_end(verify, ratio):
    case = Case("Cantilever with a mass at its end", "Blevins 1979, table 8-8", "Euler-Bernoulli")
    k = roots(lambda k: 1 / np.cosh(k) + np.cos(k) + ratio * k * (np.cos(k) * np.tanh(k) - np.sin(k)), 0.5, 0.2, 3)
    exact = (k / LENGTH) ** 2 * np.sqrt(E * I / (RHO * A)) / (2 * np.pi)
    mass = {"end": PointMass(node="b", mass=ratio * RHO * A * LENGTH)}
    beam = straight(BAR, STEEL, LENGTH, 24, {"a": "clamped"}, masses=mass)
    verify(case, f"mass ratio {ratio:g}, mode", in_plane(beam, 3, BENDING), exact, 1e-5)
    frequencies(beam, 4)


@pytest.mark.parametrize("ratio", [0.0, 0.5, 2.0])
def test_rods_with_a_mass_or_disc_at_the_end(verify, ratio):
    case = Case(
        "Rod in extension and torsion",
        "Blevins 1979, sec. 8.4: kL tan kL = rod / end mass, clamped at the other end",
        "Linear rod; torsion of a round bar",
    )
    k = roots(lambda k: np.cos(k) - ratio * k * np.sin(k), 0.1, 0.2, 3)
    d = 0.01
    area, polar = np.pi * d**2 / 4, np.pi * d**4 / 32
    disc = ratio * RHO * polar * LENGTH
    end = PointMass(node="b", mass=ratio * RHO * area * LENGTH, inertia=(disc, disc, disc)) if ratio else None
    masses = {"end": end} if end else {}
    rod = straight(Circle(diameter=d), STEEL, LENGTH, 200, {"a": "clamped"}, masses=masses)
    for name, dofs, modulus in (("extension", EXTENSION, E), ("torsion", TORSION, E / (2 * (1 + NU)))):
        exact = k / LENGTH * np.sqrt(modulus / RHO) / (2 * np.pi)
        verify(case, f"{name}, end to rod {ratio:g}, mode", in_plane(rod, 3, dofs), exact, 1e-4)


def ring(radius, diameter, sides):
    """Return a free ring as a polygon of straight beams whose perimeter is that of the circle."""
    angle = 2 * np.pi * np.arange(sides) / sides
    reach = radius * (np.pi / sides) / np.sin(np.pi / sides)
    corners = {f"n{k}": (reach * np.cos(a), reach * np.sin(a), 0) for k, a in enumerate(angle)}
    side = {"material": "steel", "section": Circle(diameter=diameter), "elements": 1}
    return Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"steel": STEEL},
        nodes=corners,
        links={f"side{k}": Link(nodes=(f"n{k}", f"n{(k + 1) % sides}"), **side) for k in range(sides)},
    )


def test_free_ring(verify):
    case = Case(
        "Free circular ring",
        "Love 1927, sec. 293, inextensional flexure in the plane and normal to it; round section",
        "Euler-Bernoulli, thin ring",
        "A polygon of 120 beams; the section is 1/500 of the radius thick. All frequencies come in pairs.",
    )
    radius, d, n = 0.1, 2e-4, np.array([2, 3, 4])
    area, inertia = np.pi * d**2 / 4, np.pi * d**4 / 64
    unit = np.sqrt(E * inertia / (RHO * area * radius**4)) / (2 * np.pi)
    inside = unit * n * (n**2 - 1) / np.sqrt(n**2 + 1)
    outside = unit * n * (n**2 - 1) / np.sqrt(n**2 + 1 + NU)
    polygon = ring(radius, d, 120)
    verify(case, "in the plane, mode", in_plane(polygon, 6, XY, rigid=3), np.repeat(inside, 2), 1e-3)
    across = in_plane(polygon, 6, ("tz", "rx", "ry"), rigid=3)
    verify(case, "normal to the plane, mode", across, np.repeat(outside, 2), 1e-3)


def guide(leaves, rho, mass):
    """Return a stage on leaves (start, end), all thin in the xy plane, and one stage node at the origin."""
    nodes, links = {}, {}
    for k, (start, end) in enumerate(leaves):
        nodes |= {f"ground{k}": start, f"end{k}": end}
        leaf = {"section": Rectangle(width=0.3e-3, thickness=10e-3), "reference": "z", "material": "leaf"}
        links[f"leaf{k}"] = Link(nodes=(f"ground{k}", f"end{k}"), elements=2, **leaf)
    body = RigidBody(mass=mass, inertia=(mass * 1e-4,) * 3, carries=("end*",))
    return Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"leaf": Material(E=E, nu=NU, rho=rho)},
        nodes=nodes,
        links=links,
        bodies={"stage": body},
        ground={"ground*": "clamped"},
    )


LEAF = E * 10e-3 * (0.3e-3) ** 3 / 12


def stage_compliance(mechanism, dof):
    """Return the compliance of the stage in one DOF; the reduced model must have the same."""
    model, low = assemble(mechanism), reduce(mechanism)
    unit = np.array([name == f"stage.{dof}" for name in model.dof_names], dtype=float)
    full = unit @ np.linalg.solve(model.K.toarray(), unit)
    at = low.coordinate_names.index(f"stage.{dof}")
    assert np.linalg.inv(low.K)[at, at] == pytest.approx(full, rel=1e-8)
    return full


def test_parallel_leaf_spring_guide(verify):
    case = Case(
        "Parallel leaf-spring guide",
        "Jones 1951: two leaves in parallel guide, 2 x 12 E I / L^3",
        "Euler-Bernoulli leaves, rigid stage",
        "The stage may turn by the extension of the leaves; they stand far apart, so that it does so by 1e-5 only.",
    )
    L, apart, mass = 40e-3, 0.4, 0.5
    leaves = [((x, -L, 0.0), (x, 0.0, 0.0)) for x in (-apart / 2, apart / 2)]
    parallel = guide(leaves, 1e-6, mass)
    verify(case, "stiffness", 1 / stage_compliance(parallel, "tx"), 24 * LEAF / L**3, 1e-5, "N/m")
    exact = np.sqrt(24 * LEAF / L**3 / mass) / (2 * np.pi)
    verify(case, "first frequency", frequencies(parallel, 1)[0], exact, 1e-5)


@pytest.mark.parametrize("crossing", [0.5, 0.127322])
def test_cross_spring_pivot(verify, crossing):
    case = Case(
        "Cross-spring pivot",
        "Wittrick 1951: 8 E I / L (1 - 3 c + 3 c^2) for leaves of length L that cross at c L, at a right angle",
        "Euler-Bernoulli leaves, rigid stage",
        "For leaves that do not extend. Where the crossing does not halve them their extension matters a little.",
    )
    L = 40e-3
    diagonal = np.array([1.0, 1.0, 0.0]) / np.sqrt(2)
    leaves = []
    for direction in (diagonal, diagonal * [1, -1, 1]):
        end = -direction * crossing * L
        leaves.append((tuple(end + direction * L), tuple(end)))
    stiffness = 1 / stage_compliance(guide(leaves, 1e-6, 0.5), "rz")
    exact = 8 * LEAF / L * (1 - 3 * crossing + 3 * crossing**2)
    verify(
        case,
        f"rotational stiffness, c = {crossing:g}",
        stiffness,
        exact,
        1e-8 if crossing == 0.5 else 2e-4,
        "N m",
    )


def test_ungrounded_beam_has_six_zero_frequencies():
    model = assemble(straight(BAR, STEEL, LENGTH, 8))
    values = lowest(model.K, model.M, 8).values
    assert (values[:6] == 0).all() and values[6] > 1e3
    assert abs(model.K @ model.rigid_body_motions()).max() < 1e-9 * abs(model.K).max()


def test_static_cantilever(verify):
    case = Case("Cantilever under end loads", "elementary beam theory", "Euler-Bernoulli and Timoshenko")
    for theory in ("euler_bernoulli", "timoshenko"):
        beam = straight(BAR, STEEL, LENGTH, 3, {"a": "clamped"}, theory)
        K = reduce(beam).K
        C = np.linalg.inv(K)
        shear = LENGTH / (10 * (1 + NU) / (12 + 11 * NU) * E / (2 * (1 + NU)) * A) if theory == "timoshenko" else 0.0
        name = theory.replace("_", "-").title()
        verify(case, f"{name}, deflection per force", C[1, 1], LENGTH**3 / (3 * E * I) + shear, 1e-8, "m/N")
        verify(case, f"{name}, rotation per force", C[1, 5], LENGTH**2 / (2 * E * I), 1e-8, "1/N")
        verify(case, f"{name}, rotation per moment", C[5, 5], LENGTH / (E * I), 1e-8, "1/(N m)")
        verify(case, f"{name}, extension per force", C[0, 0], LENGTH / (E * A), 1e-8, "m/N")
