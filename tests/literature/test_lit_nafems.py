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
from beam_models import HELD, frequencies, in_plane, last_decimal, roots, straight
from verification_report import Case

from flexura.mechanism import Circle, Link, Material, Mechanism, PointMass, Rectangle, SectionConstants

E, RHO, G = 200e9, 8000.0, 200e9 / 2.6
STEEL = Material(E=E, rho=RHO, nu=0.3)
NAFEMS = "NAFEMS R0015 (1987)"


def cross(elements):
    """Return FV2: eight arms from a free centre to pinned tips."""
    angles = np.arange(8) * np.pi / 4
    square = Rectangle(width=0.125, thickness=0.125)
    arm = {"material": "steel", "section": square, "elements": elements, "reference": "z"}
    return Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"steel": STEEL},
        nodes={
            "centre": (0, 0, 0),
            **{f"tip{k}": (5 * np.cos(a), 5 * np.sin(a), 0) for k, a in enumerate(angles)},
        },
        links={f"arm{k}": Link(nodes=("centre", f"tip{k}"), **arm) for k in range(8)},
        ground={"tip*": {"free": ("rz",)}},
    )


def centre_stiffness(hz):
    """Return the exact dynamic stiffness of one arm of FV2, along it plus across it, its inner end not turning.

    Half of eight arms at equal angles pull along and half across: the roots are the modes in which the centre moves.
    """
    A, I, w = 0.125**2, 0.125**4 / 12, 2 * np.pi * hz  # noqa: E741
    k_axial, k = w * np.sqrt(RHO / E), np.sqrt(w * np.sqrt(RHO * A / (E * I)))
    along = E * A * k_axial / np.tan(5 * k_axial)
    # v = sin(kx)/cos(kL) - sinh(kx)/cosh(kL) is pinned at the tip and does not turn at the centre
    across = E * I * k**3 * 2 / (np.tan(5 * k) - np.tanh(5 * k))
    return along + across


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


def off_centre(theory):
    """Return FV4: masses at the tip, 2 m to either side."""
    masses = {
        "heavy": PointMass(node="b", mass=10_000.0, offset=(0, 2, 0)),
        "light": PointMass(node="b", mass=1_000.0, offset=(0, -2, 0)),
    }
    return straight(Circle(diameter=0.5), STEEL, 10.0, 20, {"a": "clamped"}, theory, masses=masses)


def rayleigh_tip(omega, L, A, I):  # noqa: E741
    """Return displacements and loads (2, 2) of a Rayleigh cantilever at its tip, deflection and slope, by motion.

    E I v'''' + rho I w^2 v'' - rho A w^2 v = 0, shear force -(E I v''' + rho I w^2 v') (Rayleigh 1877, sec. 186).
    """
    p, q = RHO * omega**2 / (2 * E), RHO * A * omega**2 / (E * I)
    a, b = np.sqrt(np.sqrt(p * p + q) - p), np.sqrt(np.sqrt(p * p + q) + p)
    ch, sh, c, s = np.cosh(a * L), np.sinh(a * L), np.cos(b * L), np.sin(b * L)
    v = np.array([ch - c, sh / a - s / b])  # the two solutions that are clamped at the root, and their derivatives
    v1 = np.array([a * sh + b * s, ch - c])
    v2 = np.array([a * a * ch + b * b * c, a * sh + b * s])
    v3 = np.array([a**3 * sh - b**3 * s, a * a * ch + b * b * c])
    load = np.array([-E * I * v3 - RHO * I * omega**2 * v1, E * I * v2])
    return np.array([v, v1]), load


def exact_fv4():
    """Return the six lowest frequencies, Hz, at which tip loads and both masses' inertia balance; no poles this way."""
    L, d, mass, first, second = 10.0, 0.5, 11_000.0, 2 * 9_000.0, 4 * 11_000.0
    A, I = np.pi * d**2 / 4, np.pi * d**4 / 64  # noqa: E741

    def tip(hz, stiffness, line):
        w = 2 * np.pi * hz
        moved, load = np.zeros((2, 3, 3))
        moved[:2, :2], load[:2, :2] = rayleigh_tip(w, L, A, I)
        k = w * np.sqrt(line / stiffness)
        moved[2, 2], load[2, 2] = np.sin(k * L), stiffness * k * np.cos(k * L)
        return load, w * w * moved

    def bending_with_torsion(hz):
        load, moved = tip(hz, G * 2 * I, RHO * 2 * I)  # tz, slope, rx: a mass moves by tz + y rx
        return np.linalg.det((load - np.array([[mass, 0, first], [0, 0, 0], [first, 0, second]]) @ moved) / 1e8)

    def bending_with_extension(hz):
        load, moved = tip(hz, E * A, RHO * A)  # ty, rz, tx: a mass moves by tx - y rz and ty
        return np.linalg.det((load - np.array([[mass, 0, 0], [0, second, -first], [0, -first, mass]]) @ moved) / 1e8)

    both = [roots(f, 0.5, 0.05, 4) for f in (bending_with_torsion, bending_with_extension)]
    return np.sort(np.concatenate(both))[:6]


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


def timoshenko_on_supports(n, L, A, I, k):  # noqa: E741
    """Return the lower root, Hz, of the frequency equation of the simply supported Timoshenko beam, n half waves.

    (rho/kG) r^2 w^4 - (A/I + p^2 (1 + E/kG)) r^2 w^2 + (E/rho) r^2 p^4 = 0, p = n pi/L, r^2 = I/A (Timoshenko 1921).
    """
    p2, r2, s = (n * np.pi / L) ** 2, I / A, E / (k * G)
    a, b, c = RHO * r2 / (k * G), 1 + r2 * p2 * (1 + s), E * r2 * p2**2 / RHO
    return np.sqrt(2 * c / (b + np.sqrt(b * b - 4 * a * c))) / (2 * np.pi)


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
