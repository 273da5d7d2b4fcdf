"""NAFEMS Selected Benchmarks for Natural Frequency Analysis (Abbassian, Dawswell, Knowles 1987), as mechanisms."""

import numpy as np

from flexura.mechanism import Circle, Link, Material, Mechanism, PointMass, Rectangle
from helpers.beam_models import roots, straight

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


def timoshenko_on_supports(n, L, A, I, k):  # noqa: E741
    """Return the lower root, Hz, of the frequency equation of the simply supported Timoshenko beam, n half waves.

    (rho/kG) r^2 w^4 - (A/I + p^2 (1 + E/kG)) r^2 w^2 + (E/rho) r^2 p^4 = 0, p = n pi/L, r^2 = I/A (Timoshenko 1921).
    """
    p2, r2, s = (n * np.pi / L) ** 2, I / A, E / (k * G)
    a, b, c = RHO * r2 / (k * G), 1 + r2 * p2 * (1 + s), E * r2 * p2**2 / RHO
    return np.sqrt(2 * c / (b + np.sqrt(b * b - 4 * a * c))) / (2 * np.pi)
