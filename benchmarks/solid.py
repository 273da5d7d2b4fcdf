"""Time, memory and errors of `verify` on every example, with an empty cache and again; assembly against scikit-fem; a
mesh as a part against CalculiX.

    python benchmarks/solid.py [NAME ...]
    python benchmarks/solid.py --assembly
    python benchmarks/solid.py --mesh
    python benchmarks/solid.py --large [ROWS ...]

One BLAS thread, six modes, two meshes each, a process of its own for every run, one run each: two minutes in all. Times
are those of the processor, which other programs disturb least. `--assembly` makes K and M of
quadratic cells on the same mesh by both libraries, best of three; the time of scikit-fem has that of its bases, whose
order of integration is exact for straight cells, and as high as ours for others. `--mesh` writes decks of 10-node
tetrahedra of a frame with four notches, webs 0.3 mm, by netgen, and lets CalculiX and `flexura model` find six
frequencies of each: CalculiX those of the elements in the deck, flexura of order 3 on the same mesh, with what the mesh
may be off by, and proven for what is reduced. `--large` lets `flexura model` find six frequencies of meshes of a block
80 x 20 mm with so many rows of seven holes, 10 mm longer than these: by factors, and as if these did not fit into
memory, by conjugate gradients.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path

import numpy as np

EXAMPLES = Path(__file__).parents[1] / "examples"
NAMES = ("guide", "pivot", "amplifier", "tip_tilt", "xy_stage", "rpr")
FLEXURA = str(Path(sys.executable).with_name("flexura"))
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def run(name: str, cache: Path, out: Path) -> tuple[dict, float, float]:
    """Result, processor time, s, and peak memory, MiB, of `verify`."""
    spent = measured([FLEXURA, "verify", str(EXAMPLES / name / f"{name}.yaml"), "--json"], cache, out)
    return json.loads(out.read_text()), *spent


def measured(command: list[str], cache: Path, out: Path) -> tuple[float, float]:
    """Processor time, s, and peak memory, MiB, of one command, whose output goes to a file."""
    environment = os.environ | dict.fromkeys(THREADS, "1") | {"FLEXURA_CACHE": str(cache)}
    with out.open("wb") as stdout, Path(os.devnull).open("wb") as nothing:
        moves = [(os.POSIX_SPAWN_DUP2, stdout.fileno(), 1), (os.POSIX_SPAWN_DUP2, nothing.fileno(), 2)]
        _, status, usage = os.wait4(os.posix_spawnp(command[0], command, environment, file_actions=moves), 0)
    if status:
        raise SystemExit(f"{' '.join(command)} failed")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def percent(value: float | None) -> str:
    return "" if value is None else f"{100 * value:+.2g} %"


def main(names: list[str]) -> None:
    """One row of a table for every example."""
    print("| mechanism | meshes, DOFs | plain | corrected | uncertain by | first time | again |")
    print("|---|---|---|---|---|---|---|")
    for name in names or NAMES:
        with tempfile.TemporaryDirectory() as folder:
            cache, out = Path(folder) / "cache", Path(folder) / "out.json"
            result, first, memory = run(name, cache, out)
            _, again, _ = run(name, cache, out)
        worst = {row["model"]: row["worst_error"] for row in result["rows"]}
        dofs = " and ".join(f"{solid['dofs']:,}".replace(",", " ") for solid in result["solids"])
        unsure = max((u for u in result["uncertainty"] if u is not None), default=None)
        cells = [name, dofs, percent(worst["plain, full order"]), percent(worst["corrected, full order"])]
        cells += [percent(unsure).lstrip("+"), f"{first:.0f} s, {memory:.0f} MiB", f"{again:.1f} s"]
        print("| " + " | ".join(cells) + " |", flush=True)


FRAME = {"E": 71.7e9, "nu": 0.33, "rho": 2810.0}
"""Material of the frame."""

BY_WAY = """
from flexura.__main__ import main
from flexura.fem import curved
curved.memory_of = lambda dofs: float("{}")
main()
"""
"""The program, which believes that factors take so much memory."""


def meshes() -> None:
    """One row of a table for every mesh."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from netgen import occ

    from helpers.calculix import read_frequencies
    from helpers.solid_meshes import by_netgen, calculated, deck
    from helpers.step_files import notch_guide

    words = "E: {E} Pa, nu: {nu}, rho: {rho} kg/m^3".format(**FRAME)
    print("| cells | CalculiX | flexura | first frequencies | off for the mesh | others |")
    print("|---|---|---|---|---|---|")
    for size in (4.0, 3.0):
        with tempfile.TemporaryDirectory() as folder:
            shape = occ.OCCGeometry(str(notch_guide(Path(folder) / "frame.step"))).shape
            made = by_netgen(shape, size, 12.0 / size)
            file = Path(folder) / "frame.inp"
            deck(file, made, {"LEFT": made.on(0, 0.0)}, more=calculated(**FRAME))
            out = Path(folder) / "out"
            theirs = measured(["ccx", "-i", str(file.with_suffix(""))], Path(folder) / "cache", out)
            known = read_frequencies(file.with_suffix(".dat"))[:6]
            command = [FLEXURA, "model", str(file), "--unit", "mm", "--material", words, "--hold", "LEFT", "--json"]
            ours = measured(command, Path(folder) / "cache", out)
            modes = json.loads(out.read_text())["modes"]
        hz = np.array([mode["frequency_hz"] for mode in modes])
        spent = [f"{seconds:.1f} s, {memory:.0f} MiB" for seconds, memory in (theirs, ours)]
        off = max(mode["mesh_error"] for mode in modes)
        least, most = (hz / known - 1).min(), (hz / known - 1).max()
        first = f"{known[0]:.2f} and {hz[0]:.2f} Hz"
        cells = [str(len(made.cells)), *spent, first, percent(off).lstrip("+"), f"{percent(least)} to {percent(most)}"]
        print("| " + " | ".join(cells) + " |", flush=True)


def large(rows: list[int]) -> None:
    """Two lines of a table for every number of rows of holes."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from netgen import occ

    from helpers.solid_meshes import Made, by_netgen, deck

    words = "E: {E} Pa, nu: {nu}, rho: {rho} kg/m^3".format(**FRAME)
    print("| cells | DOFs | by | processor time | memory | frequencies | off for the mesh |")
    print("|---|---|---|---|---|---|---|")
    for length in (10 * (number + 1) for number in rows):
        block = occ.Box((0, 0, 0), (length, 80, 20))
        for x in range(10, length, 10):
            for y in range(10, 80, 10):
                block = block - occ.Cylinder(occ.Pnt(x, y, -1), occ.Z, 3, 22)
        made = by_netgen(block, 12.0, 2.0)
        used, at = np.unique(made.cells[:, :4], return_inverse=True)
        made = Made(made.points[used], at.reshape(-1, 4))  # straight, since curved ones may be folded
        edges, sides = (
            np.unique(np.sort(made.cells[:, list(combinations(range(4), k))], axis=2).reshape(-1, k), axis=0)
            for k in (2, 3)
        )
        sized = [str(len(made.cells)), str(3 * (len(made.points) + 2 * len(edges) + len(sides)))]
        for way, needed in (("factors", "0"), ("conjugate gradients", "inf")):
            command = [sys.executable, "-c", BY_WAY.format(needed)]
            with tempfile.TemporaryDirectory() as folder:
                faces = {"LEFT": made.on(0, 0.0), "RIGHT": made.on(0, float(length))}
                deck(file := Path(folder) / "block.inp", made, faces)
                command += ["model", str(file), "--unit", "mm", "--material", words, "--hold", "LEFT"]
                command += ["--interface", "tip: RIGHT", "--json"]
                seconds, memory = measured(command, Path(folder) / "cache", out := Path(folder) / "out")
                modes = json.loads(out.read_text())["modes"]
            cells = [*sized, way, f"{seconds:.0f} s", f"{memory / 1024:.1f} GiB"]
            cells += [f"{modes[k]['frequency_hz']:.3f} Hz" for k in (0, -1)]
            cells[-2:] = [" to ".join(cells[-2:]), percent(max(mode["mesh_error"] for mode in modes)).lstrip("+")]
            print("| " + " | ".join(cells) + " |", flush=True)


def best(make: Callable[[], object], runs: int = 3) -> float:
    """Least processor time of some runs, s."""
    found = []
    for _ in range(runs):
        begin = time.process_time()
        make()
        found.append(time.process_time() - begin)
    return min(found)


def assembled() -> Iterator[tuple[str, str, int, float, float, float]]:
    """Kind and shape of cells, DOFs, times of K and M by flexura and by scikit-fem, s, and how far traces are apart."""
    from skfem import Basis, BilinearForm, ElementHex2, ElementTetP2, ElementVector, MeshHex, MeshTet
    from skfem.helpers import ddot, dot, sym_grad, trace

    from flexura.fem.geometry import SolidMaterial
    from flexura.fem.matrices import elastic_matrices
    from flexura.fem.solid_mesh import SolidMesh, shape_of

    metal = SolidMaterial("unit", 1.0, 0.25, 1.0)
    lame, shear = 0.4, 0.4  # of E = 1, nu = 0.25

    @BilinearForm
    def stiffness(u, v, _):
        return 2 * shear * ddot(sym_grad(u), sym_grad(v)) + lame * trace(sym_grad(u)) * trace(sym_grad(v))

    @BilinearForm
    def mass(u, v, _):
        return dot(u, v)

    for kind, made, element, n in (
        ("tetra10", MeshTet, ElementTetP2(), 11),
        ("hexahedron27", MeshHex, ElementHex2(), 6),
    ):
        for shape in ("regular", "skewed"):
            mesh = made.init_tensor(*3 * [np.linspace(0, 1, n)])
            x = mesh.p.copy()
            if shape == "skewed":
                x[0] += 0.1 * x[1] * x[2] + 0.05 * x[1]
                x[2] += 0.2 * x[0] * x[1]
            mesh = made(x, mesh.t)
            straight = kind == "tetra10" or shape == "regular"
            orders = (2, 4) if kind == "tetra10" else (5, 5 if straight else 9)

            def theirs(mesh=mesh, element=element, orders=orders):
                bases = [Basis(mesh, ElementVector(element), intorder=order) for order in orders]
                return stiffness.assemble(bases[0]), mass.assemble(bases[1])

            ours = SolidMesh(
                *numbered(mesh, shape_of(kind).points, kind), {kind: np.zeros(mesh.nelements, int)}, (metal,)
            )
            K, other = elastic_matrices(ours)[0], theirs()[0]
            off = abs(K.trace() / other.trace() - 1)
            yield kind, shape, K.shape[0], best(lambda ours=ours: elastic_matrices(ours)), best(theirs), float(off)


def assembly() -> None:
    """Print them."""
    print("| cells | DOFs | scikit-fem | flexura | ratio | trace of K |")
    print("|---|---|---|---|---|---|")
    for kind, shape, dofs, own, other, off in assembled():
        print(f"| {kind}, {shape} | {dofs} | {other:.2f} s | {own:.2f} s | {other / own:.1f} | {off:.0e} |", flush=True)


def numbered(mesh, local: np.ndarray, kind: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Points and right-handed cells in our order: where the mapping puts the points of the reference cell."""
    x, y = ((own + 1) / 2 if kind == "hexahedron27" else own for own in (local, local[:, [1, 0, 2]]))
    right, left = (np.moveaxis(mesh.mapping().F(np.ascontiguousarray(own.T)), 0, -1) for own in (x, y))
    is_right = np.linalg.det(right[:, [1, 2, 3] if kind == "tetra10" else [1, 3, 4]] - right[:, :1]) > 0
    places = np.where(is_right[:, None, None], right, left)
    _, first, number = np.unique(places.reshape(-1, 3).round(9), axis=0, return_index=True, return_inverse=True)
    return places.reshape(-1, 3)[first], {kind: number.reshape(places.shape[:2])}


if __name__ == "__main__":
    if sys.argv[1:] == ["--assembly"]:
        assembly()
    elif sys.argv[1:] == ["--mesh"]:
        meshes()
    elif sys.argv[1:2] == ["--large"]:
        large([int(number) for number in sys.argv[2:]] or [1])
    else:
        main(sys.argv[1:])
