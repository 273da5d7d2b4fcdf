"""Published cases by the dynamic stiffness method: one exact member between any two nodes, no mesh.

The cases are those of the other files here; sources stand there. Tolerances: half a unit of the last printed digit,
one unit for the four-digit values of Han et al.; 1e-9 against roots of frequency equations. Members that taper stand as
steps, with the second-order error of these: 5e-4 for 96 of them.
"""

import numpy as np
import pytest

from flexura.full_order import assemble
from flexura.mechanism import Link, Material, Mechanism, Rectangle, SectionConstants, Tube
from flexura.mechanism.description import DOF_NAMES
from flexura.methods.dynamic_stiffness import count_below, dynamic_stiffness
from helpers.beam_models import HELD, XY, last_decimal, last_digit, roots, straight
from helpers.literature_cases import HAN_RATIOS, LABUSCHAGNE
from helpers.nafems import (
    NAFEMS,
    STEEL,
    centre_stiffness,
    cross,
    exact_fv4,
    off_centre,
    timoshenko_on_supports,
)
from helpers.verification_report import Case
from helpers.vpcs import SDLL09, SDLX01, VPCS, XZ, exponential, frequency_equation, gantry, tapered_cantilever, wedge

EXACT = "exact dynamic stiffness"


def in_plane(mechanism, count, dofs=XY, rigid=0):
    """Return the lowest `count` elastic frequencies, Hz, of modes that move more in the given freedoms."""
    model = assemble(mechanism)
    size = np.ptp(model.geometry.positions, axis=0).max()
    weight = np.array([1.0, 1.0, 1.0, size, size, size])[:, None]
    own = np.isin(DOF_NAMES, dofs)
    asked = count + rigid
    while True:
        found = dynamic_stiffness(model, asked)
        motion = ((weight * found.shapes) ** 2).sum(axis=0)
        inside = (motion[own].sum(axis=0) > motion[~own].sum(axis=0)) & (found.frequency_hz > 0)
        if inside.sum() >= count:
            return found.frequency_hz[inside][:count]
        asked *= 2


@pytest.mark.parametrize("theory", HAN_RATIOS)
def test_han_cantilever_tube(verify, theory):
    case = Case(
        f"Han 1999, cantilever tube, {theory.capitalize()}, {EXACT}",
        "Han, Benaroya, Wei, J. Sound Vib. 225 (1999) 935-988, cantilever of slenderness 9.12",
        f"{theory.capitalize()}, one exact member",
    )
    first, ratios = HAN_RATIOS[theory]
    metal = Material(E=200e9, rho=7830.0, nu=0.29)
    tube = straight(Tube(outer_diameter=0.32, inner_diameter=0.30), metal, 1.0, 1, {"a": "clamped"}, theory)
    pairs = 2 * np.pi * in_plane(tube, 2 * (1 + len(ratios)), ("ty", "rz", "tz", "ry"))
    np.testing.assert_allclose(pairs[::2], pairs[1::2], rtol=1e-10)
    w = pairs[::2]
    verify(case, "first angular frequency", w[0], first, last_digit([first], 4, 1.0)[0], "rad/s")
    verify(case, "ratio to the first, mode 1 +", w[1:] / w[0], ratios, last_digit(ratios, 4, 1.0), "-")


@pytest.mark.parametrize(("theory", "h"), LABUSCHAGNE)
def test_labuschagne_cantilever(verify, theory, h):
    name = theory.replace("_", "-").title()
    case = Case(
        f"Labuschagne 2009, cantilever, {name}, {EXACT}",
        "Labuschagne, van Rensburg, van der Merwe, Math. Comput. Model. 49 (2009) 20-30",
        f"{name}; Poisson's ratio 0.3, shear coefficient 5/6; one exact member",
        "Dimensionless eigenvalues omega^2 rho L^2 / (5/6 G) for depth-to-length ratios h/L.",
    )
    printed = LABUSCHAGNE[theory, h]
    # too wide to bend sideways, to twist or to stretch at these frequencies
    section = SectionConstants(A=h, Iy=1e4 * h, Iz=h**3 / 12, J=1e6 * h**3, ky=5 / 6, kz=1e6)
    beam = straight(section, Material(E=1.0, rho=1.0, nu=0.3), 1.0, 1, {"a": "clamped"}, theory)
    eigenvalues = (2 * np.pi * in_plane(beam, len(printed), ("ty", "rz"))) ** 2 / (5 / 6 / 2.6)
    verify(case, f"h/L = {h}, eigenvalue", eigenvalues, printed, last_digit(printed, 3), "-")


def test_fv2_pin_ended_double_cross(verify):
    """Seven-fold frequencies at which the centre rests or all but rests; nodes inside the arms show how these move."""
    case = Case(
        f"NAFEMS FV2, pin-ended double cross, {EXACT}",
        f"{NAFEMS}, FV2",
        "Euler-Bernoulli beams with axial flexibility, in the plane; exact members",
        "At modes 4 to 8 and 12 to 16 the matrix over the centre's freedoms is infinite: every arm vibrates by itself.",
    )
    f = in_plane(cross(3), 16)
    printed = np.array([11.336, *[17.709] * 5, 45.345, *[57.39] * 5])
    at_rest = np.concatenate([f[:1], f[3:9], f[11:16]])
    verify(case, "centre at rest, mode", at_rest, printed, last_decimal(printed, 3))
    for number, (moving, near) in enumerate([(f[1:3], 17.6), (f[9:11], 57.0)], start=1):
        exact = roots(centre_stiffness, near, 0.02, 1)
        verify(case, f"centre moves, pair {number}, mode", moving, np.repeat(exact, 2), 1e-9)
    # the arms that vibrate alone are clamped and pinned: tan(x) = tanh(x)
    x = roots(lambda x: np.tan(x) - np.tanh(x), 3.0, 0.1, 2)
    alone = x**2 / (2 * np.pi * 25.0) * np.sqrt(200e9 * 0.125**2 / 12 / 8000.0)
    np.testing.assert_allclose(f[3:8], alone[0], rtol=1e-10)
    np.testing.assert_allclose(f[11:16], alone[1], rtol=1e-10)


def test_fv2_one_member_for_every_arm_has_the_same_frequencies_and_counts():
    model = assemble(cross(1))
    one, three = (dynamic_stiffness(own, 30).frequency_hz for own in (model, assemble(cross(3))))
    np.testing.assert_allclose(one, three, rtol=1e-10)
    pair = float(roots(centre_stiffness, 17.6, 0.02, 1)[0])
    below = [count_below(model, hz) for hz in (pair * (1 - 1e-9), pair * (1 + 1e-9), 17.7093, 17.7094)]
    assert np.diff(below).tolist() == [2, 0, 5]


def test_fv3_free_square_frame(verify):
    case = Case(
        f"NAFEMS FV3, free square frame, {EXACT}",
        f"{NAFEMS}, FV3, converged Euler-Bernoulli values",
        "Euler-Bernoulli beams with axial flexibility, in the plane; one exact member for every side",
    )
    corners = {"a": (0, 0, 0), "b": (10, 0, 0), "c": (10, 10, 0), "d": (0, 10, 0)}
    side = {"material": "steel", "section": Rectangle(width=0.25, thickness=0.25), "reference": "z"}
    frame = Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"steel": STEEL},
        nodes=corners,
        links={p + q: Link(nodes=(p, q), **side) for p, q in ("ab", "bc", "cd", "da")},
    )
    printed = [3.2616, 5.6652, 11.1424, 11.1424, 12.8201, 24.6001, 28.6665, 28.6665, 38.9328]
    verify(case, "elastic mode", in_plane(frame, 9, rigid=6), printed, last_decimal(printed, 4, 1.0))


def test_fv4_off_centre_masses(verify):
    case = Case(
        f"NAFEMS FV4, cantilever with off-centre masses, {EXACT}",
        "frequency equations of the Rayleigh beam with both masses",
        "Rayleigh beam (rotary inertia, no shear), Saint-Venant torsion; one exact member",
    )
    beam = off_centre("rayleigh")
    beam = beam.model_copy(update={"links": {"beam": beam.links["beam"].model_copy(update={"elements": 1})}})
    verify(case, "mode", dynamic_stiffness(assemble(beam), 6).frequency_hz, exact_fv4(), 1e-9)


def test_fv5_deep_beam(verify):
    case = Case(
        f"NAFEMS FV5, deep simply supported beam, {EXACT}",
        "frequency equation of the Timoshenko beam on simple supports (Timoshenko 1921); quarter waves",
        "Timoshenko, shear coefficient 0.85; one exact member",
    )
    A, I, L, k, J = 4.0, 16 / 12, 10.0, 0.85, 0.140577 * 2**4  # noqa: E741
    section = SectionConstants(A=A, Iy=I, Iz=I, J=J, ky=k, kz=k)
    ground = {"a": {"fixed": HELD["pinned"]}, "b": {"fixed": HELD["rolls"]}}
    model = assemble(straight(section, STEEL, L, 1, ground, "timoshenko"))
    bending = np.repeat([timoshenko_on_supports(n, L, A, I, k) for n in (1, 2, 3)], 2)
    waves = [np.sqrt(200e9 / 2.6 * J / (8000 * 2 * I)) / (4 * L) * n for n in (1, 3)] + [5000 / (4 * L)]
    exact = np.sort(np.concatenate([bending, waves]))
    verify(case, "mode", dynamic_stiffness(model, 9).frequency_hz, exact, 1e-9)


def test_sdlx01_gantry(verify):
    case = Case(
        f"VPCS SDLX01, two-storey gantry, {EXACT}",
        f"{VPCS}, SDLX01 (Piranda 1983)",
        "Euler-Bernoulli and Timoshenko, in the plane; one exact member for each of the six bars",
    )
    for theory, tolerance in (("euler_bernoulli", 1.5e-3), ("timoshenko", 1e-3)):
        allowed = np.maximum(last_decimal(SDLX01, 1), tolerance)
        found = in_plane(gantry(theory, (1, 1, 1)), 13)
        verify(case, f"{theory.replace('_', '-').title()}, mode", found, SDLX01, allowed)


@pytest.mark.parametrize("width", SDLL09)
def test_sdll09_steps_converge_to_the_tapered_cantilever(verify, width):
    case = Case(
        f"VPCS SDLL09, tapered cantilever, width {1e3 * width:.0f} mm, {EXACT}",
        "the beam equation integrated numerically",
        "Euler-Bernoulli; exact members in 96 steps, and 6 tapered elements of 16 steps",
    )
    exact = np.array([tapered_cantilever(width, near) for near in SDLL09[width][:3]])
    errors = [np.abs(in_plane(wedge(width, n, "stepped"), 3, XZ) / exact - 1) for n in (24, 48)]
    np.testing.assert_allclose(errors[0] / errors[1], 4.0, rtol=0.05)
    verify(case, "96 steps, mode", in_plane(wedge(width, 96, "stepped"), 3, XZ), exact, 5e-4)
    tapered = in_plane(wedge(width, 6, "tapered"), 3, XZ)
    verify(case, "6 tapered elements, mode", tapered, exact, 5e-4)


def test_sdll10_steps_converge_to_the_exponential_width(verify):
    case = Case(
        f"VPCS SDLL10, clamped beam of exponential width, corrected, {EXACT}",
        f"{VPCS}, SDLL10, roots of its frequency equation set right",
        "Euler-Bernoulli; exact members in steps",
    )
    correct = roots(frequency_equation, 100.0, 5.0, 4)
    errors = [np.abs(in_plane(exponential(n, "stepped"), 4) / correct - 1) for n in (10, 20, 40)]
    np.testing.assert_allclose(errors[0] / errors[1], 4.0, rtol=0.1)
    np.testing.assert_allclose(errors[1] / errors[2], 4.0, rtol=0.1)
    verify(case, "40 steps, mode", in_plane(exponential(40, "stepped"), 4), correct, 1e-4)
