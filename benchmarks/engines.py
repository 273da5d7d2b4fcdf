"""Two kinds of solid elements side by side: 27-node hexahedra of our own, and curved tetrahedra of NGSolve.

Five parts, held at one face, six lowest modes. Errors are the largest of the six against tetrahedra of a higher order;
each run is a process of its own, whose peak of memory is that above what is imported. Composites have ten-node
tetrahedra in the place of hexahedra. Takes a quarter of an hour; `--only` takes one part.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from flexura.fem.bodies import MeshedBody
from flexura.fem.geometry import MemberShape, MemberSolid, SolidMaterial
from flexura.fem.matrices import elastic_matrices
from flexura.fem.meshing import group_mesh
from flexura.fem.solid_mesh import SolidMesh, dofs_of
from flexura.mechanism import BoxPiece, Composite, PlatePiece
from flexura.solid.whole import lowest_of_solid
from flexura.solid.whole.elements import Elements, meshed
from flexura.solid.whole.pieces import Block, Held, Pieces
from flexura.solid.whole.shapes import part_of
from flexura.structure import Pieces as Forms

MM, WIDTH, MODES = 1e-3, 10.0, 6
METAL = SolidMaterial("al", 71.7e9, 0.33, 2810.0)
OWN, CURVED = (2.0, 1.4, 1.0, 0.7), ((2, 1.0), (3, 2.0), (3, 1.0))
"""Sizes of our own cells, and orders and sizes of tetrahedra."""
REFERENCE = {"notch": (5, 0.6), "quarter of an amplifier": (5, 0.6)}
"""Order and size of the references, of others 4 and 1."""


def member(name: str, start: tuple[float, float], end: tuple[float, float], *kind: str, **sizes: float) -> MemberSolid:
    """A member of some width in the plane x z, mm; its roots are told apart by the members that it is between."""
    a, b = (np.array([x, 0.0, z]) * MM for x, z in (start, end))
    length = float(np.linalg.norm(b - a))
    along = (b - a) / length
    axes = np.stack([along, [0.0, 1.0, 0.0], np.cross(along, [0.0, 1.0, 0.0])])
    relative = {key: size * MM / length for key, size in {"width": WIDTH, **sizes}.items()}
    shape = MemberShape(kind, tuple(sorted((key, (size,)) for key, size in relative.items())))
    return MemberSolid(name, shape, length, METAL, a, axes, (0, 0), (0, 0))


def bar(name: str, start: tuple[float, float], end: tuple[float, float], thickness: float) -> MemberSolid:
    return member(name, start, end, "rectangle", thickness=thickness)


def guide(blocks: tuple[float, float, float, float], top: float, arms: list[MemberSolid]) -> list[MemberSolid]:
    """Arms between two upright blocks, the first of which stands on the ground."""
    a, b, c, d = blocks
    return [bar("base", ((a + b) / 2, 0), ((a + b) / 2, top), b - a),
            bar("table", ((c + d) / 2, 0), ((c + d) / 2, top), d - c), *arms]  # fmt: skip


def notched(z: float) -> list[MemberSolid]:
    cuts = [(10, 13), (13, 19), (19, 41), (41, 47), (47, 50)]
    arms = [bar(f"{z}{k}", (a, z), (b, z), 6.3) for k, (a, b) in enumerate(cuts) if k % 2 == 0]
    hinges = [member(f"{z}{k}", (a, z), (b, z), "notch", "circular", radius=3.0, web=0.3)
              for k, (a, b) in enumerate(cuts) if k % 2]  # fmt: skip
    return [*arms, *hinges]


PARTS: dict[str, list[MemberSolid] | Composite] = {
    "notch": [member("hinge", (0, 0), (6, 0), "notch", "circular", radius=3.0, web=0.4)],
    "quarter of an amplifier": [bar("arm", (5, 0), (20, 0), 3.0), bar("inner", (0, 0), (5, 0), 0.5),
                                bar("outer", (20, -1.25), (25, -1.25), 0.5)],
    "composite": Composite(
        material="al",
        add=(BoxPiece(size=(20e-3, 30e-3, 12e-3)),),
        cut=(PlatePiece(length=12e-3, width=22e-3, thickness=13e-3),),
    ),
    "monolith A": guide((0, 10, 50, 60), 40, [*notched(3.15), *notched(36.85)]),
    "monolith B": guide((0, 8, 28, 36), 30, [bar(str(z), (8, z), (28, z), 0.5) for z in (2.25, 27.75)]),
}  # fmt: skip

Modes = tuple[np.ndarray, int]


def own(name: str, size: float) -> Modes:
    """Frequencies, Hz, and DOFs by our own cells."""
    part = PARTS[name]
    if isinstance(part, Composite):
        body = MeshedBody(Forms.of(part), (METAL.E, METAL.nu, METAL.rho))
        points, cells = body._mesh["points"], body._mesh["tetrahedra"]
        mesh = SolidMesh(points, {"tetra10": cells}, {"tetra10": np.zeros(len(cells), dtype=np.intp)}, (METAL,))
        held = body.held_points((0, -1))
    else:
        mesh = group_mesh(part, size)
        held = mesh.point_sets[f"{'inner' if len(part) == 3 else part[0].name} start"]
    free = dofs_of(np.setdiff1d(np.arange(len(mesh.points)), held))
    K, M = (A[free][:, free].tocsr() for A in elastic_matrices(mesh))
    return np.sqrt(lowest_of_solid(K, M, MODES)[0]) / (2 * np.pi), len(free)


def curved(name: str, order: int, size: float) -> Modes:
    """The same by curved tetrahedra."""
    part = PARTS[name]
    if isinstance(part, Composite):
        forms = Forms.of(part)
        body: Any = MeshedBody(forms, (METAL.E, METAL.nu, METAL.rho))
        half = (forms.box[1] - forms.box[0]) / 2
        block = Block(name, 0, np.zeros(3), np.eye(3), half, False, METAL, forms, body, root=0)
        pieces = Pieces((block,), (), (Held(0, 0, -1),))
    else:
        pieces = Pieces((), tuple(part), (Held(1 if len(part) == 3 else 0, 0, -1),))
    drawn = part_of(pieces)
    elements = Elements(drawn, meshed(drawn, order, size, lambda _: None), order, lambda _: None, {})
    return np.sqrt(lowest_of_solid(elements.K, elements.M, MODES)[0]) / (2 * np.pi), elements.dofs


def measured(solve: Callable[..., Modes], *args: object) -> tuple[np.ndarray, int, float, float]:
    """Frequencies, DOFs, seconds and GB of a run in this process."""
    import netgen.occ  # noqa: F401 -- not in the time
    import ngsolve  # noqa: F401

    before, begin = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
    hz, dofs = solve(*args)
    return hz, dofs, time.perf_counter() - begin, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=PARTS, help="one part")
    args = parser.parse_args()
    print(f"{'part':24s} {'cells':22s} {'DOFs':>8s} {'error':>8s} {'s':>6s} {'GB':>6s}")
    for name in [args.only] if args.only else PARTS:
        sizes = OWN if isinstance(PARTS[name], list) else OWN[2:3]
        runs = [(f"own, size {size:g}", own, (name, size)) for size in sizes]
        runs += [(f"order {order}, size {size:g}", curved, (name, order, size)) for order, size in CURVED]
        with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
            exact = pool.apply(measured, (curved, name, *REFERENCE.get(name, (4, 1.0))))
            print(f"{name:24s} {'reference':22s} {exact[1]:8d} {'':8s} {exact[2]:6.1f} {exact[3]:6.2f}", flush=True)
            for label, solve, given in runs:
                hz, dofs, seconds, memory = pool.apply(measured, (solve, *given))
                worst = max(hz / exact[0] - 1, key=abs)
                print(f"{name:24s} {label:22s} {dofs:8d} {100 * worst:+7.3f}% {seconds:6.1f} {memory:6.2f}", flush=True)


if __name__ == "__main__":
    main()
