"""NAFEMS Selected Benchmarks for Natural Frequency Analysis (Abbassian, Dawswell, Knowles 1987, R0015), beams.

FV2 pin-ended double cross, FV3 free square frame: Euler-Bernoulli with axial flexibility.
FV4 cantilever with off-centre masses: Rayleigh; the printed digits tell it from Euler-Bernoulli and Timoshenko.
FV5 deep simply supported beam: Timoshenko with shear coefficient 0.85.

Tolerances: against printed numbers half a unit of the last digit, or one unit where the source itself is that far from
the exact solution (FV3, FV4); against exact solutions 1e-5, and 5e-4 for FV5, where the mesh of 80 elements converges
with second order only.
"""

import numpy as np
import pytest

from flexura.mechanism import Link, Mechanism, Rectangle, SectionConstants
from helpers.beam_models import HELD, frequencies, in_plane, last_decimal, roots, straight
from helpers.nafems import NAFEMS, STEEL, centre_stiffness, cross, exact_fv4, off_centre, timoshenko_on_supports
from helpers.verification_report import Case


def test_fv2_pin_ended_double_cross(verify):
    case = Case(
        "NAFEMS FV2, pin-ended double cross",
        f"{NAFEMS}, FV2",
        "Euler-Bernoulli beams with axial flexibility, in the plane",
        "The source prints 17.709 and 57.390 Hz seven times each, for a centre that cannot translate. It can: two of "
        "each seven involve the axial flexibility of the arms and are lower. They are compared with the roots of the "
        "exact dynamic stiffness of the centre.",
    )
    f = in_plane(cross(32), 16)
    printed = np.array([11.336, *[17.709] * 5, 45.345, *[57.39] * 5])
    centre_rests = np.concatenate([f[:1], f[3:9], f[11:16]])
    verify(case, "centre at rest, mode", centre_rests, printed, last_decimal(printed, 3))
    for number, (moving, near) in enumerate([(f[1:3], 17.6), (f[9:11], 57.0)], start=1):
        exact = roots(centre_stiffness, near, 0.02, 1)
        verify(case, f"centre moves, pair {number}, mode", moving, np.repeat(exact, 2), 1e-5)
        assert (moving < f[[3, 11][number - 1]] - 0.02).all()


def test_fv3_free_square_frame(verify):
    case = Case(
        "NAFEMS FV3, free square frame",
        f"{NAFEMS}, FV3, converged Euler-Bernoulli values",
        "Euler-Bernoulli beams with axial flexibility, in the plane",
    )
    corners = {"a": (0, 0, 0), "b": (10, 0, 0), "c": (10, 10, 0), "d": (0, 10, 0)}
    square = Rectangle(width=0.25, thickness=0.25)
    side = {"material": "steel", "section": square, "elements": 48, "reference": "z"}
    frame = Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"steel": STEEL},
        nodes=corners,
        links={p + q: Link(nodes=(p, q), **side) for p, q in ("ab", "bc", "cd", "da")},
    )
    printed = [3.2616, 5.6652, 11.1424, 11.1424, 12.8201, 24.6001, 28.6665, 28.6665, 38.9328]
    verify(case, "elastic mode", in_plane(frame, 9, rigid=3), printed, last_decimal(printed, 4, 1.0))


PRINTED_FV4 = np.array([1.723, 1.727, 7.413, 9.972, 18.155, 26.957])


def test_fv4_off_centre_masses(verify):
    case = Case(
        "NAFEMS FV4, cantilever with off-centre masses",
        f"{NAFEMS}, FV4; exact dynamic stiffness of the Rayleigh beam",
        "Rayleigh beam (rotary inertia, no shear), Saint-Venant torsion",
        "The source prints three decimals; its fourth number should be 9.971 by the exact solution. Euler-Bernoulli "
        "and Timoshenko beams miss its last number by more than ten times the tolerance.",
    )
    f = frequencies(off_centre("rayleigh"), 6)
    verify(case, "exact solution, mode", f, exact_fv4(), 1e-5)
    verify(case, "as printed, mode", f, PRINTED_FV4, last_decimal(PRINTED_FV4, 3, 1.0))


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
def test_fv4_tells_the_theories_apart(theory):
    miss = np.abs(frequencies(off_centre(theory), 6) / PRINTED_FV4 - 1)
    assert miss[5] > 10 * last_decimal(PRINTED_FV4, 3, 1.0)[5]


def test_fv5_deep_beam(verify):
    case = Case(
        "NAFEMS FV5, deep simply supported beam",
        f"{NAFEMS}, FV5; frequency equation of the Timoshenko beam on simple supports (Timoshenko 1921)",
        "Timoshenko, shear coefficient 0.85; Saint-Venant torsion",
        "A later republication prints E = 210 GPa; only 200 GPa gives the printed frequencies.",
    )
    A, I, L, k = 4.0, 16 / 12, 10.0, 0.85  # noqa: E741
    J = 0.140577 * 2**4  # of a square: Timoshenko and Goodier 1970, sec. 109
    section = SectionConstants(A=A, Iy=I, Iz=I, J=J, ky=k, kz=k)
    ground = {"a": {"fixed": HELD["pinned"]}, "b": {"fixed": HELD["rolls"]}}
    beam = straight(section, STEEL, L, 80, ground, "timoshenko")
    bending = in_plane(beam, 3, ("ty", "rz"))
    exact = [timoshenko_on_supports(n, L, A, I, k) for n in (1, 2, 3)]
    verify(case, "bending, frequency equation, mode", bending, exact, 5e-4)
    verify(case, "bending, printed, mode", bending, [42.65, 148.15, 283.47], 5e-4)
    verify(case, "torsion, printed, mode", in_plane(beam, 2, ("rx",)), [71.2, 213.61], 5e-4)
    verify(case, "extension, printed, mode", in_plane(beam, 1, ("tx",)), [125.0], 1e-4)
