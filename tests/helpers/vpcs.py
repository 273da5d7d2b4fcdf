"""Guide de validation des progiciels de calcul de structures (AFNOR/SFM 1990), as mechanisms."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from flexura.mechanism import (
    Flexure,
    Leaf,
    Link,
    Material,
    Mechanism,
    Notch,
    SectionConstants,
    TabulatedContour,
)

STEEL = Material(E=200e9, rho=7800.0, nu=0.3)
VPCS = "AFNOR/SFM, Guide de validation des progiciels de calcul de structures (1990)"
SDLX01 = [8.8, 29.4, 43.8, 56.3, 96.2, 102.6, 147.1, 174.8, 178.8, 206.0, 266.4, 320.0, 335.0]


def gantry(theory, elements):
    """Return SDLX01 with so many elements in each lower column, upper column and beam."""
    nodes = {
        "a": (-0.3, 0),
        "b": (0.3, 0),
        "c": (-0.3, 0.36),
        "d": (0.3, 0.36),
        "e": (-0.3, 0.81),
        "f": (0.3, 0.81),
    }
    h, b = 0.0048, 0.029  # in the plane and normal to it
    thin = SectionConstants(A=b * h, Iy=h * b**3 / 12, Iz=b * h**3 / 12, J=b * h**3 / 3, ky=5 / 6, kz=5 / 6)
    bar = {"material": "steel", "section": thin, "reference": "z"}
    count = dict(zip(("ac", "db", "ce", "fd", "cd", "ef"), np.repeat(elements, 2).tolist(), strict=True))
    return Mechanism(
        theory=theory,
        corrections="none",
        materials={"steel": Material(E=210e9, rho=7800.0, nu=0.3)},
        nodes={name: (*at, 0) for name, at in nodes.items()},
        links={name: Link(nodes=(name[0], name[1]), elements=n, **bar) for name, n in count.items()},
        ground={"a": "clamped", "b": "clamped"},
    )


def flexure(profile, length, ground, elements, integration):
    """Describe a flexure along x from `a` to `b`."""
    shape = {"profile": profile, "elements": elements, "integration": integration}
    return Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        nodes={"a": (0, 0, 0), "b": (length, 0, 0)},
        materials={"steel": STEEL},
        flexures={"beam": Flexure(nodes=("a", "b"), material="steel", reference="z", **shape)},
        ground=ground,
    )


def wedge(width, elements, integration):
    """Return SDLL09 with the given greatest width; the height, along z, tapers from 40 to 10 mm."""
    return flexure(Leaf(width=(width, 0.01), thickness=(0.04, 0.01)), 1.0, {"a": "clamped"}, elements, integration)


XZ = ("tz", "ry")
SDLL09 = {
    0.04: [54.18, 171.94, 384.40, 697.24, 1112.28],
    0.05: [56.55, 175.79, 389.01, 702.36, 1117.63],
}


def tapered_cantilever(width, near):
    """Return the exact frequency, Hz, near `near`: (E I v'')'' = w^2 rho A v integrated from the tip to the clamp."""

    def clamp(hz):
        inertia = (2 * np.pi * hz) ** 2 * STEEL.rho

        def derivatives(x, y):
            h, b = 0.01 + 0.03 * x, 0.01 + (width - 0.01) * x
            v, slope, moment, shear = y.reshape(4, 2)
            return np.concatenate([slope, moment / (STEEL.E * b * h**3 / 12), shear, inertia * b * h * v])

        start = np.concatenate([np.eye(2), np.zeros((2, 2))]).ravel()
        end = solve_ivp(derivatives, (0, 1), start, method="DOP853", rtol=1e-11, atol=1e-14).y[:4, -1]
        return np.linalg.det(end.reshape(2, 2))

    return brentq(clamp, 0.998 * near, 1.002 * near, xtol=1e-9)


ALPHA, LENGTH, DEPTH = 1.0, 0.6, 0.01


def frequency_equation(hz, swapped=False):
    """Return the frequency equation of SDLL10.

    With b = b0 exp(-2 a x), (b v'')'' = l^4 b v has the solutions v = exp(a x) w, w = cosh, sinh(p x), cos, sin(q x)
    with p^2 = l^2 + a^2 and q^2 = l^2 - a^2; clamped ends give
    2 p q (1 - cos qL cosh pL) + (p^2 - q^2) sin qL sinh pL = 0.
    """
    l2 = 2 * np.pi * hz * np.sqrt(12 * 7800 / 200e9) / DEPTH
    p, q = np.sqrt(l2 + ALPHA**2), np.sqrt(l2 - ALPHA**2)
    if swapped:
        p, q = q, p
    pL, qL = p * LENGTH, q * LENGTH
    return 2 * p * q * (1 / np.cosh(pL) - np.cos(qL)) + (p * p - q * q) * np.sin(qL) * np.tanh(pL)


def exponential(elements, integration):
    """Return SDLL10: width 30 mm exp(-2 a x) along z, tabulated, and depth 10 mm along y, in which it bends."""
    x = np.linspace(0, LENGTH, 481)
    table = TabulatedContour(positions=tuple(x), thicknesses=tuple(0.03 * np.exp(-2 * ALPHA * x)))
    profile = Notch(width=DEPTH, contour=table)
    return flexure(profile, LENGTH, {"a": "clamped", "b": "clamped"}, elements, integration)
