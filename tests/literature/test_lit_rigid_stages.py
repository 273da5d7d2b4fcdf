"""Rigid stages on flexures without mass, against screw theory.

Spatial stage on four blades: P. Siva, design of a micromirror (UCLA MAE C294A; script and report in the public
repository premkumar22siva/C294A_Micromirror_Design), frequencies printed by the report. One blade and one wire: the
data of a homework of the course on flexure systems by J. B. Hopkins (UCLA MAE 294; script by Yuan Hung Lo), which
prints no frequencies.

The reference is computed here by the screw theory of the scripts: the stiffness of every flexure, by beam formulas in
a frame at its end, carried to the centre of mass by the adjoint of that frame (Hopkins and Culpepper, Precision
Engineering 34 (2010) 259-270). It shares no code with flexura. Flexures have a density of 1e-6 kg/m^3, so that their
mass changes no digit compared. Tolerance 1e-6, and half a unit of the last digit for the report's figures.
"""

import numpy as np
import pytest

from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.mechanism import Box, Link, Material, Mechanism, Rectangle, RigidBody
from flexura.reduction import certify, reduce
from helpers.beam_models import EVERY_MODE, frequencies, hertz, last_digit
from helpers.verification_report import Case


def series_torsion(a, b):
    """Return J of a rectangle a x b by the series of Saint-Venant (Timoshenko and Goodier 1970, sec. 109)."""
    b, t = max(a, b), min(a, b)
    n = np.arange(1, 200, 2)
    return b * t**3 / 3 * (1 - 192 / np.pi**5 * t / b * np.sum(np.tanh(n * np.pi * b / (2 * t)) / n**5))


def cross_matrix(v):
    """Return the matrix of the cross product with v."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def screw_frequencies(flexures, E, G, mass, inertia, centre):
    """Return frequencies, Hz, of a stage on flexures (ground end, stage end, direction of t, width b, thickness t)."""
    K = np.zeros((6, 6))
    for *places, b, t in flexures:
        ground, stage, thin = (np.asarray(v, dtype=float) for v in places)
        L = np.linalg.norm(stage - ground)
        x = (stage - ground) / L
        axes = np.array([x, np.cross(thin, x), thin])
        compliance = np.diag([L / (E * b * t), 0, 0, L / (G * series_torsion(b, t)), 0, 0])
        by, bz = E * b * t**3 / 12, E * t * b**3 / 12
        compliance[np.ix_([1, 5], [1, 5])] = [[L**3 / (3 * bz), L**2 / (2 * bz)], [L**2 / (2 * bz), L / bz]]
        compliance[np.ix_([2, 4], [2, 4])] = [
            [L**3 / (3 * by), -(L**2) / (2 * by)],
            [-(L**2) / (2 * by), L / by],
        ]
        to_end = np.block([[axes, -axes @ cross_matrix(stage - centre)], [np.zeros((3, 3)), axes]])
        K += to_end.T @ np.linalg.inv(compliance) @ to_end
    M = np.diag([mass] * 3 + list(inertia))
    scale = 1 / np.sqrt(np.diag(M))
    return np.sqrt(np.linalg.eigvalsh(K * np.outer(scale, scale))) / (2 * np.pi)


def stage_on(flexures, metal, stage_metal, size, centre, elements=1):
    """Describe the same as a mechanism."""
    nodes, links = {}, {}
    for k, (ground, stage, thin, b, t) in enumerate(flexures):
        nodes |= {f"ground{k}": tuple(ground), f"end{k}": tuple(stage)}
        section = {"section": Rectangle(width=b, thickness=t), "reference": tuple(thin)}
        links[f"blade{k}"] = Link(nodes=(f"ground{k}", f"end{k}"), material="metal", elements=elements, **section)
    body = RigidBody(centre=centre, carries=("end*",), solid=Box(size=size, material="stage"), elastic=False)
    return Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"metal": metal, "stage": stage_metal},
        nodes=nodes,
        links=links,
        bodies={"stage": body},
        ground={"ground*": "clamped"},
    )


def box(size, mass):
    """Return principal moments of inertia of a box."""
    x, y, z = np.asarray(size) ** 2
    return mass / 12 * np.array([y + z, x + z, x + y])


Z, X = (0, 0, 1), (1, 0, 0)
UM = 1e-6
MIRROR = [
    ((1500 * UM, 0, -5 * UM), (1500 * UM, 1000 * UM, -5 * UM), Z, 1000 * UM, 10 * UM),
    ((0, 1500 * UM, -195 * UM), (1000 * UM, 1500 * UM, -195 * UM), Z, 1000 * UM, 10 * UM),
    ((1500 * UM, 3000 * UM, -5 * UM), (1500 * UM, 2000 * UM, -5 * UM), Z, 1000 * UM, 10 * UM),
    ((3000 * UM, 1500 * UM, -195 * UM), (2000 * UM, 1500 * UM, -195 * UM), Z, 1000 * UM, 10 * UM),
]
MIRROR_SIZE, MIRROR_CENTRE = (1000 * UM, 1000 * UM, 200 * UM), np.array([1500, 1500, -100]) * UM


def mirror(density, elements):
    """Return the stage on four blades of the given density."""
    blade = Material(E=130e9, G=50e9, rho=density)
    stage = Material(E=130e9, G=50e9, rho=2330.0)
    return stage_on(MIRROR, blade, stage, MIRROR_SIZE, tuple(MIRROR_CENTRE), elements)


def test_stage_on_four_blades(verify):
    case = Case(
        "Stage on four blades",
        "P. Siva, C294A_Micromirror_Design (UCLA MAE C294A), report and script; screw theory computed in the test",
        "Euler-Bernoulli blades without mass, rigid stage",
        "Holds for massless blades only: with their own mass the torsion of the blades themselves comes near 46 kHz.",
    )
    f = frequencies(mirror(1e-6, 1), 6)
    mass = 2330 * np.prod(MIRROR_SIZE)
    screw = screw_frequencies(MIRROR, 130e9, 50e9, mass, box(MIRROR_SIZE, mass), MIRROR_CENTRE)
    verify(case, "screw theory, mode", f, screw, 1e-6)
    printed = np.array([33_400.0, 1_081_600.0])
    tolerance = [last_digit(printed[:1], 3)[0], last_digit(printed[1:], 5)[0]]
    verify(case, "report, mode", 2 * np.pi * f[:2], printed, tolerance, "rad/s")


def test_constraint_modes_alone_miss_the_blades_own_modes(verify):
    """With the mass of its blades the stage has its second mode in the blades, which six coordinates cannot show."""
    case = Case(
        "Stage on four blades that have mass",
        "torsion of a clamped-clamped blade, sqrt(G J / rho Ip) / 2L (Blevins 1979, table 8-19)",
        "Euler-Bernoulli blades with mass, rigid stage",
        "A reduction to constraint modes alone has six frequencies, none of which is near; see the tests.",
    )
    heavy = mirror(2330.0, 16)
    full = frequencies(heavy, 12)
    b, t, L = 1e-3, 1e-5, 1e-3
    polar = (b * t**3 + t * b**3) / 12
    own = np.sqrt(50e9 * series_torsion(b, t) / (2330 * polar)) / (2 * L)
    near = full[np.abs(full / own - 1) < 0.02]
    assert len(near) >= 2
    verify(case, "two torsional modes of the blades", near[:2], [own, own], 5e-3)

    paper = reduce(heavy)
    assert paper.order == 6
    six = hertz(paper.K, paper.M, 6)
    assert six[0] == pytest.approx(full[0], rel=1e-3)
    assert six[1] > 2 * full[1]
    assert not ((six > 0.5 * own) & (six < 2 * own)).any()
    proof = certify(paper, n=6)
    assert proof.missing == int((frequencies(heavy, 100) < proof.below_hz).sum()) - 6 == 80
    assert proof.lower_hz[0] <= full[0] <= proof.upper_hz[0]
    assert proof.is_indexed.tolist() == [True] + [False] * 5
    small = reduce(heavy, tolerance=1e-3, up_to=1.2 * own)
    found = hertz(small.K, small.M, small.order)
    expected = full[full < 1.2 * own]
    assert small.order == len(expected)
    np.testing.assert_allclose(found, expected, rtol=1e-3)
    every = reduce(heavy, keep=EVERY_MODE)
    np.testing.assert_allclose(np.sqrt(lowest(every.K, every.M, 12).values) / (2 * np.pi), full, rtol=1e-7)


def test_stage_on_blade_and_wire(verify):
    case = Case(
        "Stage on a blade and a wire",
        "data of a homework of UCLA MAE 294 (script by Yuan Hung Lo); screw theory computed in the test",
        "Euler-Bernoulli flexures without mass, rigid stage",
        "A check of one method against another; the source prints no frequencies.",
    )
    flexures = [
        ((0.09875, 0.05, 0.025), (0.09875, 0.2, 0.025), X, 0.05, 0.0025),
        ((0.00125, 0.05, 0.04875), (0.00125, 0.2, 0.04875), X, 0.0025, 0.0025),
    ]
    size, centre = (0.1, 0.05, 0.05), np.array([0.05, 0.225, 0.025])
    light, stage = (Material(E=68e9, G=25e9, rho=rho) for rho in (1e-6, 2698.9))
    mechanism = stage_on(flexures, light, stage, size, tuple(centre))
    mass = 2698.9 * np.prod(size)
    screw = 2 * np.pi * screw_frequencies(flexures, 68e9, 25e9, mass, box(size, mass), centre)
    # the six figures that a second, independent evaluation of the script's data gave
    np.testing.assert_allclose(
        screw, [147.551476, 156.140564, 2040.803677, 3499.165575, 16655.45069, 17267.827627], rtol=1e-8
    )
    verify(case, "mode", 2 * np.pi * frequencies(mechanism, 6), screw, 1e-6, "rad/s")
    assert assemble(mechanism).order == 6
