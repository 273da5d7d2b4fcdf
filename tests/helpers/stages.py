"""Rigid stages on leaves whose frequencies follow by hand; leaves weigh nothing unless told otherwise."""

from __future__ import annotations

import numpy as np

from flexura.mechanism import Flexure, Leaf, Material, Mechanism, RigidBody

E, G, RHO = 70e9, 27e9, 2700.0
WEIGHTLESS = 1e-6
"""kg/m^3"""
L, B, T = 60e-3, 20e-3, 0.5e-3
"""Length, width and thickness of a leaf, m."""
EI = E * B * T**3 / 12
STAGE_MASS, INERTIA = 0.05, (2e-5, 3e-5, 4e-5)


def hertz(stiffness: float, mass: float) -> float:
    """Return the frequency of one spring and one mass."""
    return float(np.sqrt(stiffness / mass) / (2 * np.pi))


def leaf(nodes, reference, elements=10, **sizes):
    """Return a leaf of the common sizes."""
    profile = Leaf(**({"width": B, "thickness": T} | sizes))
    return Flexure(nodes=nodes, material="metal", reference=reference, profile=profile, elements=elements)


def on_leaves(nodes, leaves, centre, density=WEIGHTLESS, **more):
    """Describe a stage on leaves from nodes g* on the ground to nodes e* on the stage."""
    stage = RigidBody(centre=centre, carries=("e*",), mass=STAGE_MASS, inertia=INERTIA)
    return Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"metal": Material(E=E, G=G, rho=density)},
        nodes=nodes,
        flexures=leaves,
        bodies={"stage": stage},
        ground={"g*": "clamped"},
        **more,
    )


def guide(density=WEIGHTLESS, elements=10):
    """Two parallel leaves along z, 50 mm apart; the centre of mass at half their height, where x and ry decouple."""
    nodes = {f"{end}{k}": (x, 0.0, z) for end, z in (("g", 0.0), ("e", L)) for k, x in enumerate((-25e-3, 25e-3))}
    leaves = {f"leaf{k}": leaf((f"g{k}", f"e{k}"), "x", elements) for k in range(2)}
    return on_leaves(nodes, leaves, (0.0, 0.0, L / 2), density)


def pivot(density=WEIGHTLESS, elements=10):
    """Two leaves that cross at right angles in the origin, the centre of mass there too; the stage turns about y."""
    h = L / 2 / np.sqrt(2)
    nodes = {"g0": (-h, 0, -h), "e0": (h, 0, h), "g1": (h, 0, -h), "e1": (-h, 0, h)}
    leaves = {f"leaf{k}": leaf((f"g{k}", f"e{k}"), "z", elements) for k in range(2)}
    return on_leaves(nodes, leaves, (0.0, 0.0, 0.0), density)
