"""How far corrected beams are off single members: stiffness against flexura's own solids with rigid end faces.

Prints rows of src/flexura/analysis/measured_members.py: for each kind and ratio, the errors of six stiffnesses, %:
stretch, twist, and for bending about local y and z the one by moments and the one between parallel ends.
"""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.beam import rigid_arm
from flexura.solid.fem import with_solid_parts

METAL = {"metal": fx.describe.Material(E=200e9, nu=0.3, rho=7800.0)}
NAMES = ("stretch", "twist", "y moment", "y parallel", "z moment", "z parallel")


def stiffnesses(profile: fx.describe.Leaf | fx.describe.Notch, length: float, is_solid: bool) -> np.ndarray:
    """Six stiffnesses (6,) of a member clamped at one end: stretch, twist, and bending in both planes."""
    how = {"ends": ("clamped", "clamped"), "elements": 100, "integration": "tapered"}
    member = fx.describe.Flexure(nodes=("a", "b"), material="metal", reference="z", profile=profile, **how)
    mechanism = fx.Mechanism(
        materials=METAL,
        nodes={"a": (0.0, 0.0, 0.0), "b": (length, 0.0, 0.0)},
        flexures={"member": member},
        ground={"a": "clamped"},
        fidelity="solid" if is_solid else None,
    )
    ready = with_solid_parts(mechanism, keep=0) if is_solid else mechanism
    C = np.reshape(fx.compliance(ready, nodes=["b"]), (6, 6))
    inverse = np.linalg.inv(rigid_arm(np.array([length / 2, 0, 0])))
    # about the middle of a symmetric member moments and parallel ends part
    own = np.diag(inverse @ C @ inverse.T)
    return 1 / own[[0, 3, 4, 2, 5, 1]]


def row(profile: fx.describe.Leaf | fx.describe.Notch, length: float) -> np.ndarray:
    """Errors (6,), %, of the corrected beam's stiffness."""
    return 100 * (stiffnesses(profile, length, False) / stiffnesses(profile, length, True) - 1)


def main() -> None:
    """Print the rows of leaves, by b/t and L/b, and of right-circular notches, by R/t and b/2R."""
    print("# " + ", ".join(NAMES))
    b = 10e-3
    for slender in (5.0, 15.0):
        for short in (0.3, 0.6, 1.0, 2.0, 5.0):
            errors = row(fx.describe.Leaf(width=b, thickness=b / slender), short * b)
            print(f"leaf ({slender:g}, {short:g}): (" + ", ".join(f"{e:.1f}" for e in errors) + "),", flush=True)
    R = 3e-3
    for deep in (2.0, 5.0, 15.0, 50.0):
        for broad in (0.2, 1.0, 3.0):
            notch = fx.describe.Notch(width=2 * R * broad, contour=fx.describe.CircularContour(radius=R, web=R / deep))
            errors = row(notch, 2 * R)
            print(f"notch ({deep:g}, {broad:g}): (" + ", ".join(f"{e:.1f}" for e in errors) + "),", flush=True)


if __name__ == "__main__":
    main()
