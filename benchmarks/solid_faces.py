"""How the faces of solid members should follow their nodes: members between blocks that are solids, too.

The reference is one solid of the member and the blocks at its ends; its compliance less that of the blocks alone is the
member's. Prints the tables of docs/theory/solid-parts.md. `--size` is the relative size of the reference's cells.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

import flexura as fx
from flexura.beam import rigid_arm
from flexura.fem.parts import with_solid_parts
from flexura.full_order import assemble
from flexura.mechanism import Faces
from flexura.solid.modes import solid_modes
from flexura.solid.verification import verify

METAL = {"metal": fx.describe.Material(E=71.7e9, nu=0.33, rho=2810.0)}
SHARED = {"material": "metal", "reference": "z"}
KINDS: tuple[Faces, ...] = ("rigid", "flexible", "averaged")
BLOCK = 10e-3

MEMBERS = {  # profile, length, thickness of the blocks
    "notch, circular R 4, t 0.3, width 10": (
        fx.describe.Notch(width=10e-3, contour=fx.describe.CircularContour(radius=4e-3, web=0.3e-3)),
        8e-3,
        8.3e-3,
    ),
    "notch, parabolic a 4, b 3, t 0.5, width 6": (
        fx.describe.Notch(width=6e-3, contour=fx.describe.ParabolicContour(depth=3e-3, web=0.5e-3)),
        8e-3,
        6.5e-3,
    ),
    "leaf 10 x 10 x 0.3 on blocks 8 thick": (fx.describe.Leaf(width=10e-3, thickness=0.3e-3), 10e-3, 8e-3),
}


def compliance(mechanism: fx.Mechanism, length: float) -> np.ndarray:
    """Stretch, twist and both bendings (4,) of what lies between `a`, which is clamped, and `b`, about its middle."""
    C = np.reshape(fx.compliance(mechanism, nodes=["b"]), (6, 6))
    to_middle = rigid_arm(np.array([length / 2, 0, 0]))
    inverse = np.linalg.inv(to_middle)
    return np.diag(inverse @ C @ inverse.T)[[0, 3, 4, 5]]


def between(
    links: dict[str, fx.describe.Link | fx.describe.Flexure], nodes: dict[str, float], **more: object
) -> fx.Mechanism:
    """Members along x from `a`, which is clamped, to `b`."""
    return fx.Mechanism(
        materials=METAL,
        nodes={key: (x, 0.0, 0.0) for key, x in nodes.items()},
        links={key: m for key, m in links.items() if isinstance(m, fx.describe.Link)},
        flexures={key: m for key, m in links.items() if isinstance(m, fx.describe.Flexure)},
        ground={"a": "clamped"},
        **more,
    )


def stiffness_rows(name: str, size: float) -> None:
    """Print the errors, %, of a member's stiffness."""
    profile, length, thickness = MEMBERS[name]
    width = profile.width
    section = fx.describe.Rectangle(width=width, thickness=thickness)
    ends = {"a": 0.0, "c": BLOCK, "d": BLOCK + length, "b": 2 * BLOCK + length}
    members = {
        "first": fx.describe.Link(nodes=("a", "c"), section=section, **SHARED),
        "last": fx.describe.Link(nodes=("d", "b"), section=section, **SHARED),
        "member": fx.describe.Flexure(nodes=("c", "d"), profile=profile, **SHARED),
    }
    joined = with_solid_parts(between(members, ends, fidelity="solid"), size=size, keep=0)
    bar = {"bar": fx.describe.Link(nodes=("a", "b"), section=section, **SHARED)}
    blocks = with_solid_parts(between(bar, {"a": 0.0, "b": 2 * BLOCK}, fidelity="solid"), size=size, keep=0)
    wanted = compliance(joined, ends["b"]) - compliance(blocks, 2 * BLOCK)
    alone = {"a": 0.0, "b": length}
    for kind in KINDS:
        member = fx.describe.Flexure(nodes=("a", "b"), profile=profile, faces=kind, **SHARED)
        try:
            part = with_solid_parts(between({"member": member}, alone, fidelity="solid"), keep=0)
        except fx.OptionError:
            print(f"| {name} | {kind} | refused |")
            continue
        order = 12 + part.superelements["member"].amplitudes
        print_row(name, kind, wanted / compliance(part, length) - 1, order)
    for label, corrections in (("beam, plain", "none"), ("beam, corrected", "auto")):
        member = fx.describe.Flexure(nodes=("a", "b"), profile=profile, ends=("clamped", "clamped"), **SHARED)
        beam = between({"member": member}, alone, corrections=corrections)
        print_row(name, label, wanted / compliance(beam, length) - 1, None)


def print_row(name: str, label: str, error: np.ndarray, order: int | None) -> None:
    """One row of a table in Markdown."""
    print(f"| {name} | {label} | " + " | ".join(f"{100 * e:+.2g}" for e in error) + f" | {order or ''} |", flush=True)


def bridge(solid_blocks: bool, faces: Faces = "rigid", fidelity: str | None = None) -> fx.Mechanism:
    """A bridge amplifier as in examples/amplifier, with its blocks centred on the leaves, rigid or solid."""
    leaf, arm, depth, rise, block, h = 5e-3, 15e-3, 10e-3, 1.5e-3, 5e-3, 8e-3
    x = block + 2 * leaf + arm
    thin = fx.describe.Leaf(width=depth, thickness=0.5e-3)
    shared = {**SHARED, "faces": faces}
    nodes = {
        "output": (0.0, 0.0, h),
        "root": (block, 0.0, h),
        "inner": (block + leaf, 0.0, h),
        "outer": (block + leaf + arm, 0.0, h),
        "input": (x + 3e-3, 0.0, h),
        "middle": (x + 3e-3, 0.0, 0.0),
    }
    start = (
        {"nodes": ("root", "inner")} if solid_blocks else {"nodes": ("output", "inner"), "start_offset": (block, 0, 0)}
    )
    flexures = {
        "inner_leaf": fx.describe.Flexure(profile=thin, **start, **shared),
        "outer_leaf": fx.describe.Flexure(
            nodes=("outer", "input"), start_offset=(0, 0, -rise), end_offset=(-3e-3, 0, -rise), profile=thin, **shared
        ),
    }
    section = fx.describe.Rectangle(width=depth, thickness=3e-3)
    links = {"arm": fx.describe.Link(nodes=("inner", "outer"), section=section, **shared)}
    interface = ("output", "middle") if solid_blocks else ("output", "input")
    if solid_blocks:
        upright = {**shared, "reference": "x"}
        links["out"] = fx.describe.Link(
            nodes=("output", "root"), section=fx.describe.Rectangle(width=depth, thickness=8e-3), **shared
        )
        links["in"] = fx.describe.Link(
            nodes=("input", "middle"), section=fx.describe.Rectangle(width=depth, thickness=6e-3), **upright
        )
    kept = nodes if solid_blocks else {key: at for key, at in nodes.items() if key not in ("root", "middle")}
    quarter = fx.describe.Substructure(nodes=kept, flexures=flexures, links=links, interface=interface)
    mirrors = (fx.describe.MirrorPattern(normal=(1, 0, 0)), fx.describe.MirrorPattern(normal=(0, 0, 1)))
    joints = [("quarter1.output", "quarter2.output"), ("quarter3.output", "quarter4.output")]
    bodies = {}
    if solid_blocks:
        joints += [("quarter1.middle", "quarter3.middle"), ("quarter2.middle", "quarter4.middle")]
    else:
        upper = fx.describe.Box(size=(2 * block, depth, 8e-3), material="metal")
        side = fx.describe.Box(size=(6e-3, depth, 2 * h), material="metal")
        carried = {"right": ("quarter1.input", "quarter3.input"), "left": ("quarter2.input", "quarter4.input")}
        bodies["upper"] = fx.describe.RigidBody(centre=(0, 0, h), solid=upper, carries=("quarter1.output",))
        for sign, key in ((1, "right"), (-1, "left")):
            bodies[key] = fx.describe.RigidBody(centre=(sign * (x + 3e-3), 0, 0), solid=side, carries=carried[key])
    return fx.Mechanism(
        materials=METAL,
        fidelity=fidelity,
        substructures={"quarter": quarter},
        instances={"quarter": fx.describe.Instance(of="quarter", pattern=mirrors)},
        joints=tuple(joints),
        bodies=bodies,
        ground={"quarter3.output": "clamped"},
    )


def bridge_rows(size: float) -> None:
    """Print frequencies, Hz, of the bridge."""
    begin = time.perf_counter()
    whole = solid_modes(assemble(bridge(True)), 6, size)
    hz = whole.solution.frequency_hz[:5]
    seconds = time.perf_counter() - begin
    print(
        f"| blocks solid, {whole.meshed_dofs} DOFs in a quarter, {seconds:.0f} s | | "
        + " | ".join(f"{f:.1f}" for f in hz)
    )
    for kind in KINDS:
        part = with_solid_parts(bridge(False, kind, "solid"))
        error = fx.modes(part, n=5, order="full").frequency_hz / hz - 1
        print(f"| {kind} | {fx.assemble(part).order} | " + " | ".join(f"{100 * e:+.2g}" for e in error))
    for label in ("none", "auto"):
        beams = bridge(False).model_copy(update={"corrections": label})
        error = fx.modes(beams, n=5, order="full").frequency_hz / hz - 1
        print(f"| beams, corrections {label} | | " + " | ".join(f"{100 * e:+.2g}" for e in error))


def leaf_rows() -> None:
    """Print errors, %, of a leaf with a block against quadratic tetrahedra of both (192 000 DOFs)."""
    wanted = np.array([127.1, 607.0, 1399.0, 3696.0])
    nodes = {"a": 0.0, "b": 10e-3, "c": 20e-3}
    box = fx.describe.Box(size=(10e-3, 10e-3, 8e-3), material="metal")
    body = {"block": fx.describe.RigidBody(centre=(15e-3, 0, 0), solid=box, carries=("b",))}
    solid = fx.describe.Link(nodes=("b", "c"), section=fx.describe.Rectangle(width=10e-3, thickness=8e-3), **SHARED)
    for kind, is_body in (("rigid", True), ("rigid", False), ("averaged", True)):
        leaf = fx.describe.Leaf(width=10e-3, thickness=0.3e-3)
        members = {"leaf": fx.describe.Flexure(nodes=("a", "b"), profile=leaf, faces=kind, **SHARED)}
        if is_body:
            described = between(members, {"a": 0.0, "b": 10e-3}, fidelity="solid", bodies=body)
        else:
            described = between({**members, "block": solid}, nodes, fidelity="solid")
        error = fx.modes(with_solid_parts(described), n=4, order="full").frequency_hz / wanted - 1
        label = "body" if is_body else "solid part"
        print(f"| {kind}, block as {label} | " + " | ".join(f"{100 * e:+.2g}" for e in error))


def rpr_rows() -> None:
    """Print frequencies, Hz, of the RPR mechanism with all members as solid parts, and what they cost."""
    plain = fx.load(Path(__file__).parents[1] / "examples" / "rpr" / "rpr.yaml")
    rows = [("plain beams", plain), ("corrected beams", plain.model_copy(update={"corrections": "auto"}))]
    described = plain.model_copy(update={"fidelity": "solid"})
    for size in (1.0, 0.7):
        begin = time.perf_counter()
        with_solid_parts(described, size=size)
        first = time.perf_counter() - begin
        begin = time.perf_counter()
        rows.append((f"solid parts, size {size:g}", with_solid_parts(described, size=size)))
        print(f"size {size:g}: {first:.0f} s, again {1e3 * (time.perf_counter() - begin):.0f} ms")
    for label, mechanism in rows:
        plan = fx.Plan(mechanism)
        fx.reduce(plan, keep=2)
        begin = time.perf_counter()
        low = fx.reduce(plan, keep=2)
        seconds = time.perf_counter() - begin
        hz = fx.modes(low, n=9).frequency_hz
        numbers = " | ".join(f"{f:.4g}" if f > 100 else f"{f:.3f}" for f in hz)
        print(f"| {label} | {low.order} | {numbers} | {1e3 * seconds:.1f} ms")
    found = verify(plain, n=9)
    for solid in found.solids:
        print(
            f"| whole solid, size {solid.size:g} | {solid.order} | "
            + " | ".join(f"{f:.3f}" for f in solid.frequency_hz)
        )
    print("| limit | | " + " | ".join(f"{f:.3f}" for f in found.frequency_hz))
    print("| within | | " + " | ".join(f"{100 * u:.2g} %" for u in found.uncertainty))


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=float, default=0.6)
    size = parser.parse_args().size
    for name in MEMBERS:
        stiffness_rows(name, size)
    bridge_rows(size)
    leaf_rows()
    rpr_rows()


if __name__ == "__main__":
    main()
