"""How well `check` estimates what elastic bodies do: frequencies with solid blocks against rigid ones.

Prints a table: the lowering of each mode, %, measured with flexura's own solids and estimated.
"""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.analysis import lowered_by_bodies
from flexura.fem.parts import with_solid_parts
from flexura.full_order import assemble
from flexura.solid.modes import solid_modes

STEEL = "spring-steel"
CLAMPED = fx.describe.Support(fixed=fx.describe.DOF_NAMES)
Case = tuple[dict[str, fx.describe.Flexure], dict[str, tuple[float, float, float]], tuple[float, float, float]]


def notch(radius: float, web: float, width: float, block: float) -> Case:
    """A right-circular notch with a block of its own section, `block` long."""
    profile = fx.describe.Notch(width=width, contour=fx.describe.CircularContour(radius=radius, web=web))
    member = fx.describe.Flexure(nodes=("a", "b"), material=STEEL, reference="z", profile=profile, elements=40)
    nodes = {"a": (0.0, 0.0, 0.0), "b": (2 * radius, 0.0, 0.0)}
    return {"member": member}, nodes, (block, width, 2 * radius + web)


def leaf(length: float, width: float, thickness: float, block: tuple[float, float]) -> Case:
    """A leaf with a block, its length and thickness given."""
    profile = fx.describe.Leaf(width=width, thickness=thickness)
    member = fx.describe.Flexure(nodes=("a", "b"), material=STEEL, reference="z", profile=profile)
    return {"member": member}, {"a": (0.0, 0.0, 0.0), "b": (length, 0.0, 0.0)}, (block[0], width, block[1])


CASES = {
    "notch R 3, t 0.5, b 8 on a block 20 x 8 x 6.5": notch(3e-3, 0.5e-3, 8e-3, 20e-3),
    "notch R 1, t 0.5, b 10 on a block 20 x 10 x 2.5": notch(1e-3, 0.5e-3, 10e-3, 20e-3),
    "leaf 10 x 10 x 0.3 on a block 10 x 10 x 8": leaf(10e-3, 10e-3, 0.3e-3, (10e-3, 8e-3)),
    "leaf 10 x 10 x 1 on a block 30 x 10 x 3": leaf(10e-3, 10e-3, 1e-3, (30e-3, 3e-3)),
}


def lowering(case: Case, n: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies (n,), Hz, with a rigid block, and their lowering (n,) by an elastic one, measured and estimated."""
    members, nodes, size = case
    b = nodes["b"]
    end = (b[0] + size[0], b[1], b[2])
    centre = (b[0] + size[0] / 2, b[1], b[2])
    body = fx.describe.RigidBody(centre=centre, solid=fx.describe.Box(size=size, material=STEEL), carries=("b",))
    rigid = fx.Mechanism(nodes=nodes, flexures=members, bodies={"block": body}, ground={"a": CLAMPED})
    link = fx.describe.Link(
        nodes=("b", "c"), material=STEEL, reference="z", section=fx.describe.Rectangle(width=size[1], thickness=size[2])
    )
    whole = rigid.model_copy(update={"bodies": {}, "nodes": {**nodes, "c": end}, "links": {"block": link}})
    hz = solid_modes(assemble(whole), n).solution.frequency_hz[:n]
    stiff = with_solid_parts(rigid.model_copy(update={"fidelity": "solid"}))
    held = fx.modes(stiff, n=n, order="full").frequency_hz
    estimate = lowered_by_bodies(assemble(rigid)).lowering[:n]
    return held, 1 - hz / held, estimate


def main() -> None:
    """Print one row for each case."""
    for name, case in CASES.items():
        held, measured, estimated = lowering(case)
        for label, row in (("Hz", held), ("measured", 100 * measured), ("estimated", 100 * estimated)):
            print(
                f"| {name} | {label} | " + " | ".join(f"{x:.4g}" if label == "Hz" else f"{x:.1f}" for x in row) + " |"
            )


if __name__ == "__main__":
    main()
