"""Rigid bodies on springs and dashpots, and cantilevers, whose responses follow by hand."""

from __future__ import annotations

import numpy as np

import flexura as fx

DOFS = ("tx", "ty", "tz", "rx", "ry", "rz")
MASS, INERTIA = 0.4, (2e-4, 3e-4, 5e-4)
K = (4e3, 9e3, 2.5e4, 3.0, 7.0, 8.0)
"""Stiffness along and about the axes, N/m and N m/rad."""
SIZE = dict(zip(DOFS, (MASS,) * 3 + INERTIA, strict=True))
STIFFNESS = dict(zip(DOFS, K, strict=True))

E, RHO = 70e9, 2700.0
LENGTH, WIDTH, THICKNESS = 0.12, 12e-3, 3e-3
AREA = WIDTH * THICKNESS
I_FLAT = WIDTH * THICKNESS**3 / 12


def stiffness(values=K):
    """A diagonal stiffness."""
    return fx.describe.DiagonalStiffness(**dict(zip(DOFS, values, strict=True)))


def dashes(values):
    """A diagonal damping."""
    return fx.describe.DiagonalDamping(**dict(zip(DOFS, values, strict=True)))


def body(at=(0.0, 0.0, 0.0), mass=MASS):
    """A rigid body at a place."""
    return fx.describe.RigidBody(centre=at, mass=mass, inertia=INERTIA)


def oscillator(c=None, at=(0.0, 0.0, 0.0), **more):
    """A body on a spring in all six directions, and on dashpots c (6,); all motions are decoupled."""
    dashpots = {} if c is None else {"dash": fx.describe.Dashpot(nodes=("mass",), damping=dashes(c))}
    parts = {
        "bodies": {"mass": body(at)},
        "springs": {"spring": fx.describe.Spring(nodes=("mass",), stiffness=stiffness())},
    }
    return fx.Mechanism(**(parts | {"dashpots": dashpots} | more))


def natural(dof):
    """Angular frequency of the oscillator in a DOF."""
    return float(np.sqrt(STIFFNESS[dof] / SIZE[dof]))


M1, M2, K1, K2, C1, C2 = 0.4, 0.15, 4e3, 2.5e3, 0.7, 6.0


def pair(c1=C1, c2=C2, grounded=True, **more):
    """Two bodies in line along x, the first on the ground; damping is not proportional to mass or stiffness."""
    ends = {"one": ("one",), "two": ("one", "two")}
    springs = {
        "one": fx.describe.Spring(nodes=ends["one"], stiffness=stiffness((K1, *K[1:]))),
        "two": fx.describe.Spring(nodes=ends["two"], stiffness=stiffness((K2, *K[1:]))),
    }
    dashpots = {
        key: fx.describe.Dashpot(nodes=ends[key], damping=dashes((c, 0, 0, 0, 0, 0)))
        for key, c in (("one", c1), ("two", c2))
    }
    if not grounded:
        springs.pop("one")
        dashpots.pop("one")
    bodies = {"one": body(mass=M1), "two": body((0.05, 0.0, 0.0), M2)}
    return fx.Mechanism(**({"bodies": bodies, "springs": springs, "dashpots": dashpots} | more))


def pair_receptance(w, c1=C1, c2=C2):
    """H (f, 2, 2) of the pair along x."""
    k1, k2 = K1 + 1j * w * c1, K2 + 1j * w * c2
    Z = np.array([[k1 + k2 - M1 * w**2, -k2], [-k2, k2 - M2 * w**2]])
    return np.linalg.inv(np.moveaxis(Z, -1, 0))


def pair_poles(c1=C1, c2=C2):
    """Roots of (m1 s^2 + (c1 + c2) s + k1 + k2)(m2 s^2 + c2 s + k2) - (c2 s + k2)^2, by |s|, upper half plane."""
    two = np.polymul([M1, c1 + c2, K1 + K2], [M2, c2, K2])
    roots = np.roots(np.polysub(two, np.polymul([c2, K2], [c2, K2])))
    return np.array(sorted(roots[roots.imag > 0], key=abs))


def beam(elements=8, eta=None, theory="euler_bernoulli", ground=None, **more):
    """A beam along x from a to b, clamped at a; its thickness is along z."""
    return fx.Mechanism(
        theory=theory,
        corrections="none",
        nodes={"a": (0, 0, 0), "b": (LENGTH, 0, 0)},
        materials={"metal": fx.describe.Material(E=E, nu=0.3, rho=RHO, loss_factor=eta)},
        links={
            "beam": fx.describe.Link(
                nodes=("a", "b"),
                material="metal",
                section=fx.describe.Rectangle(width=WIDTH, thickness=THICKNESS),
                reference="z",
                elements=elements,
            )
        },
        ground={"a": "clamped"} if ground is None else ground,
        **more,
    )


def tip_receptance(w, eta=0.0, alpha=0.0, beta=0.0):
    """Receptance of the tip of a cantilever across z (Bishop and Johnson 1960): with x = lambda,
    (sin x cosh x - cos x sinh x) / (EI (x/L)^3 (1 + cos x cosh x)), EI and mass complex with damping."""
    EI = E * I_FLAT * (1 + 1j * (eta + beta * w))
    x = ((RHO * AREA * w**2 * (1 - 1j * alpha / w)) / EI) ** 0.25 * LENGTH
    cosine, sine, cosh, sinh = np.cos(x), np.sin(x), np.cosh(x), np.sinh(x)
    return (sine * cosh - cosine * sinh) / (EI * (x / LENGTH) ** 3 * (1 + cosine * cosh))


def tip_transmissibility(w, eta=0.0):
    """Absolute motion of the tip of a cantilever over that of its clamp: (cos x + cosh x)/(1 + cos x cosh x)."""
    x = (RHO * AREA * w**2 / (E * I_FLAT * (1 + 1j * eta))) ** 0.25 * LENGTH
    return (np.cos(x) + np.cosh(x)) / (1 + np.cos(x) * np.cosh(x))


def dense(A):
    """A matrix as an array."""
    return A.toarray() if hasattr(A, "toarray") else np.asarray(A)
