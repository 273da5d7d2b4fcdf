"""Elastic roots by solid finite elements: what a leaf and the block it ends in give together beyond each alone.

Writes src/flexura/beam/roots.csv, a row for each pair of distances from the leaf's faces to the block's, each width and
each Poisson's ratio; rows that are there already are kept, so that it goes on where it was interrupted. With --wide
prints what blocks give that reach beyond the sides of the leaf too, over those as wide as it. With --errors writes
src/flexura/analysis/model_error/root_errors.csv: how far off what is interpolated is for roots that lie between those
rows, where the block is wider or narrower than the leaf, and outside of the table.

The solid is meshed with 27-node bricks on a grid that is graded to the corners of the joint. Its flexibility under a
rigid face at the end of the leaf, less that of the same leaf on a rigid block, less that of the same block under a
rigid face, is that of the root.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

import argparse
import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from pypardiso import PyPardisoSolver

from flexura.beam import rigid_arm
from flexura.files import write_file

TABLE = Path(__file__).parent.parent / "src/flexura/beam/roots.csv"
RATIOS = (0.2, 0.4)
BESIDE = (0.0, 0.15, 0.5, 1.3, 3.5, 11.5)
"""Block beside the leaf's face, over its thickness."""
WIDTHS = (0.7, 3.0, 12.0, 40.0)
"""Width over thickness."""
NAMES = ("u_u", "rx_rx", "v_v", "v_rz", "rz_rz", "w_w", "w_ry", "ry_ry", "u_w", "u_ry", "v_rx", "rx_rz")
PLACES = ((0, 0), (3, 3), (1, 1), (1, 5), (5, 5), (2, 2), (2, 4), (4, 4), (0, 2), (0, 4), (1, 3), (3, 5))
ERRORS = Path(__file__).parent.parent / "src/flexura/analysis/model_error/root_errors.csv"
DOMINANT = ("u_u", "rx_rx", "ry_ry", "rz_rz")
DIAGONAL = (0, 1, 2, 4, 5, 7)
WIDE = (0.7, 1.0, 2.0, 3.0, 10.0)
GAUSS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True)
class Joint:
    """A leaf of thickness 1 on a block that reaches `up` and `down` beyond its faces, `wider` beyond its sides; below
    zero the leaf reaches beyond those of the block."""

    up: float
    down: float
    width: float
    nu: float
    wider: float = 0.0
    longer: float = 1.0
    fine: int = 1

    @property
    def leaf(self) -> float:
        """Length of the leaf: of wide ones, that of common flexures."""
        return self.longer * max(6.0, 0.4 * self.width)


def graded(length: float, first: float, growth: float = 1.7, largest: float = np.inf) -> np.ndarray:
    """Points from 0 to a length, cells of which grow from the first."""
    points, step = [0.0], first
    while points[-1] + 1.4 * step < length:
        points.append(points[-1] + step)
        step = min(step * growth, largest)
    return np.array([*points, length])


def grid(joint: Joint) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges of cells along x, y (half, from the middle), and z, the leaf's middle at zero."""
    first = 0.06 / joint.fine
    growth = 1.9 if joint.fine == 1 else 1.5
    height = 1 + joint.up + joint.down
    block = graded(max(1.5 * height, 4.0), first, growth)
    leaf = graded(joint.leaf / 2, first, growth, 1.0)
    x = np.concatenate([-block[::-1], leaf[1:], joint.leaf - leaf[-2::-1]])
    half = graded(0.5, first, growth)
    inner = np.concatenate([-0.5 + half, 0.5 - half[-2::-1]])
    up = 0.5 + graded(joint.up, first, growth)[1:] if joint.up else []
    down = -0.5 - graded(joint.down, first, growth)[1:][::-1] if joint.down else []
    z = np.concatenate([down, inner, up])
    side = graded(joint.width / 2, min(0.25, joint.width / 6) / joint.fine, 2.0)
    y = joint.width / 2 - side[::-1]
    if joint.wider > 0:
        y = np.concatenate([y, joint.width / 2 + graded(joint.wider, 0.25, 2.0)[1:]])
    elif joint.wider:  # graded to the side of the block, on both sides of it
        at = joint.width / 2 + joint.wider
        inner, outer = (graded(own, min(0.25, own / 3) / joint.fine, 2.0) for own in (at, -joint.wider))
        y = np.concatenate([at - inner[::-1], at + outer[1:]])
    return x, y, z


def one_dimensional(edges: np.ndarray) -> dict[str, np.ndarray]:
    """Integrals (cells, 3, 3) of quadratic functions and their slopes on every cell: mm, md, dd."""
    s, w = GAUSS
    N = np.stack([s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2])
    D = np.stack([s - 0.5, -2 * s, s + 0.5])
    h = np.diff(edges)[:, None, None] / 2
    return {"mm": (N * w) @ N.T * h, "md": (N * w) @ D.T + 0 * h, "dm": (D * w) @ N.T + 0 * h, "dd": (D * w) @ D.T / h}


def stiffness(edges: Sequence[np.ndarray], cells: np.ndarray, nu: float) -> sp.csr_matrix:
    """K of the cells, of Young's modulus 1, over all nodes of the grid, three freedoms each."""
    own = [one_dimensional(e) for e in edges]
    shape = [2 * len(e) - 1 for e in edges]
    lame, mu = nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu))
    i, j, k = np.nonzero(cells)

    def integral(a: int, b: int) -> np.ndarray:
        """Of the slope along a of one function and along b of the other."""
        parts = []
        for axis, at in enumerate((i, j, k)):
            parts.append(own[axis][("d" if axis == a else "m") + ("d" if axis == b else "m")][at])
        return np.einsum("eab,ecd,efg->eacfbdg", *parts).reshape(len(i), 27, 27)

    S = {(a, b): integral(a, b) for a in range(3) for b in range(3)}
    trace = S[0, 0] + S[1, 1] + S[2, 2]
    K = np.empty((len(i), 27, 3, 27, 3))
    for a, b in product(range(3), repeat=2):
        K[:, :, a, :, b] = lame * S[a, b] + mu * S[b, a] + (mu * trace if a == b else 0)
    local = np.arange(3)
    node = (2 * i[:, None] + local)[:, :, None, None] * shape[1] * shape[2]
    node = node + (2 * j[:, None] + local)[:, None, :, None] * shape[2] + (2 * k[:, None] + local)[:, None, None, :]
    dof = (3 * node.reshape(len(i), 27, 1) + np.arange(3)).reshape(len(i), 81)
    rows, columns = np.repeat(dof, 81, axis=1).ravel(), np.tile(dof, (1, 81)).ravel()
    n = 3 * int(np.prod(shape))
    return sp.csr_matrix((K.ravel(), (rows, columns)), shape=(n, n))


@cache
def _solver() -> PyPardisoSolver:
    return PyPardisoSolver(mtype=-2)  # looks for its library all over the place


def flexibility(
    edges: Sequence[np.ndarray], cells: np.ndarray, nu: float, held: np.ndarray, face: np.ndarray, centre: np.ndarray
) -> np.ndarray:
    """C (6, 6) at a point of a rigid face of the whole solid, of which half is meshed; held and face: nodes."""
    points = [np.sort(np.concatenate([e, (e[1:] + e[:-1]) / 2])) for e in edges]
    X = np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, 3)
    K = stiffness(edges, cells, nu)
    used = np.asarray(np.abs(K).sum(axis=1)).ravel() > 0
    C = np.zeros((6, 6))
    middle = np.abs(X[:, 1]) < 1e-12
    for kinds, across in (((0, 2, 4), (1,)), ((1, 3, 5), (0, 2))):
        free = used.copy().reshape(-1, 3)
        free[held] = False
        free[np.ix_(middle, across)] = False
        free[face] = False
        rows = np.flatnonzero(free.ravel())
        D = rigid_arm(X[face] - centre)[:, :3][..., list(kinds)].reshape(-1, 3)
        on_face = (3 * np.flatnonzero(face)[:, None] + np.arange(3)).ravel()
        kept = K[on_face][:, on_face]
        coupling = K[rows][:, on_face] @ D
        solver = _solver()
        inner = solver.solve(sp.triu(K[rows][:, rows]).tocsr(), np.ascontiguousarray(coupling))
        solver.free_memory()
        half = D.T @ (kept @ D) - coupling.T @ inner
        C[np.ix_(kinds, kinds)] = np.linalg.inv(2 * half)
    return C


def root(joint: Joint) -> np.ndarray:
    """Flexibilities (12,) of a root in order of NAMES, E = 1, thickness 1."""
    edges = grid(joint)
    x, y, z = ((e[1:] + e[:-1]) / 2 for e in edges)
    in_leaf = (x > 0)[:, None, None] & (y < joint.width / 2)[:, None] & (np.abs(z) < 0.5)
    in_block = (x < 0)[:, None, None] & (y < joint.width / 2 + joint.wider)[:, None] & np.ones(len(z), dtype=bool)
    points = [np.sort(np.concatenate([e, (e[1:] + e[:-1]) / 2])) for e in edges]
    X = np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, 3)
    eps = 1e-9
    on_leaf = (X[:, 1] < joint.width / 2 + eps) & (np.abs(X[:, 2]) < 0.5 + eps)
    start, joined, end = (np.abs(X[:, 0] - at) < eps for at in (edges[0][0], 0.0, joint.leaf))
    tip = np.array([joint.leaf, 0.0, 0.0])
    middle = np.array([0.0, 0.0, (joint.up - joint.down) / 2])
    whole = flexibility(edges, in_leaf | in_block, joint.nu, start, end & on_leaf, tip)
    leaf = flexibility(edges, in_leaf, joint.nu, joined & on_leaf, end & on_leaf, tip)
    block = flexibility(edges, in_block, joint.nu, start, joined, middle)
    D, arm = rigid_arm(tip), rigid_arm(tip - middle)
    inverse = np.linalg.inv(D)
    C = inverse @ (whole - leaf - arm @ block @ arm.T) @ inverse.T
    return np.array([C[place] for place in PLACES])


def wanted() -> list[Joint]:
    """The joints of the table."""
    pairs = [(up, down) for up in BESIDE for down in BESIDE if down <= up and up > 0]
    return [Joint(up, down, width, nu) for nu in RATIOS for width in WIDTHS for up, down in pairs]


def compared() -> list[Joint]:
    """Joints that are not in the table: between its rows, with blocks that are wider or narrower than the leaf, and
    outside of it."""
    between = [
        Joint(2.0, 1.0, 8.0, 0.3), Joint(7.0, 0.3, 3.0, 0.3), Joint(2.5, 2.5, 20.0, 0.33), Joint(5.0, 0.0, 20.0, 0.33),
        Joint(0.3, 0.3, 10.0, 0.3), Joint(11.0, 11.0, 1.0, 0.25), Joint(0.8, 0.8, 1.5, 0.3), Joint(6.0, 6.0, 6.0, 0.3),
        Joint(2.2, 0.05, 12.0, 0.3), Joint(0.25, 0.0, 5.0, 0.3), Joint(2.0, 2.0, 2.0, 0.3), Joint(9.0, 0.9, 20.0, 0.3),
        Joint(0.8, 0.3, 25.0, 0.3), Joint(6.0, 2.2, 8.0, 0.35), Joint(0.07, 0.07, 5.0, 0.3),
    ]  # fmt: skip
    beside = [
        Joint(2.0, 2.0, width, 0.3, wider)
        for width, wider in ((1.0, 0.5), (1.0, 1.0), (1.0, 5.0), (5.0, 1.0), (5.0, 2.0), (5.0, 5.0), (5.0, 15.0))
    ]
    beside += [Joint(2.0, 2.0, 20.0, 0.3, wider) for wider in (1.0, 5.0)]
    return [
        *between,
        *beside,
        Joint(5.0, 0.0, 5.0, 0.3, 5.0),
        Joint(0.5, 0.5, 5.0, 0.3, 5.0),
        Joint(11.0, 11.0, 5.0, 0.3, 5.0),
        *(Joint(2.0, 2.0, width, 0.3, -share * width) for width in (5.0, 20.0) for share in (0.05, 0.125, 0.25)),
        *(Joint(2.0, 2.0, width, 0.3) for width in (0.4, 60.0, 100.0)),
        Joint(2.0, 2.0, 0.4, 0.3, 2.0),
        *(Joint(2.0, 2.0, width, nu) for width in (3.0, 12.0) for nu in (0.05, 0.1, 0.45, 0.48)),
        Joint(0.07, 0.0, 5.0, 0.3),
        Joint(0.07, 0.07, 20.0, 0.3),
    ]


def compare() -> None:
    """Complete the errors of what is interpolated: flexibility over that of the solid, less 1."""
    from flexura.beam import root_flexibility

    columns = ["nu", "width", "up", "down", "wider"]
    rows: dict[tuple[str, ...], list[str]] = {}
    if ERRORS.exists():
        with ERRORS.open() as file:
            for row in csv.DictReader(line for line in file if not line.startswith("#")):
                rows[tuple(row[key] for key in columns)] = list(row.values())
    for joint in compared():
        key = tuple(f"{getattr(joint, name):g}" for name in columns)
        if key in rows:
            continue
        fit = root_flexibility(1.0, joint.nu, joint.width, 1.0, joint.leaf, joint.up, joint.down, joint.wider)
        off = dict(zip(NAMES, fit / root(joint) - 1, strict=True))
        rows[key] = [*key, *(f"{off[name]:.4f}" for name in DOMINANT), Path(__file__).name]
        text = io.StringIO()
        text.write("# Relative errors of the flexibility of elastic roots that are interpolated, against solids.\n")
        text.write("# Sizes over the leaf's thickness; wider: the block beside each of its sides, below 0 narrower.\n")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerows([[*columns, *DOMINANT, "script"], *rows.values()])
        write_file(ERRORS, lambda path, text=text: path.write_text(text.getvalue()))
        print(*rows[key], flush=True)


def main() -> None:
    """Complete a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--errors", action="store_true", help="errors between the rows and of wider blocks")
    parser.add_argument("--nu", type=float, help="rows of one Poisson's ratio alone, into a table of their own")
    parser.add_argument("--wide", action="store_true", help="blocks that are wider than the leaf, over those as wide")
    chosen = parser.parse_args()
    if chosen.wide:
        print("width", " ".join(f"{NAMES[k]:>6}" for k in DIAGONAL))
        for width in WIDE:
            wide, own = (root(Joint(2.0, 2.0, width, 0.3, wider)) for wider in (2.0, 0.0))
            print(f"{width:5g}", " ".join(f"{wide[k] / own[k]:6.3f}" for k in DIAGONAL), flush=True)
        return
    if chosen.errors:
        compare()
        return
    done: dict[tuple[float, ...], list[str]] = {}
    table = TABLE if chosen.nu is None else TABLE.with_name(f"roots-{chosen.nu:g}.csv")
    for known in sorted(TABLE.parent.glob("roots*.csv")):
        with known.open() as file:
            for line in csv.reader(row for row in file if not row.startswith("#")):
                if line[0] != "nu":
                    done[tuple(map(float, line[:4]))] = line
    joints = [joint for joint in wanted() if chosen.nu in (None, joint.nu)]
    for number, joint in enumerate(joints):
        key = (joint.nu, joint.width, joint.up, joint.down)
        if key not in done:
            done[key] = [f"{v:g}" for v in key] + [f"{v:.5g}" for v in root(joint)]
            write(table, done)
            print(f"{number + 1} of {len(joints)}: {joint}", flush=True)
    write(table, done)


def write(table: Path, rows: dict[tuple[float, ...], list[str]]) -> None:
    """The table, in one step."""
    partial = table.with_suffix(".part")
    with partial.open("w", newline="") as file:
        file.write(
            "# Flexibility of elastic roots by solid elements (benchmarks/roots.py): Young's modulus 1, thickness 1.\n"
        )
        file.write("# width: of leaf and block; up, down: block beyond the leaf's faces; x leads out of the block.\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["nu", "width", "up", "down", *NAMES])
        writer.writerows(rows[key] for key in sorted(rows))
    partial.replace(table)


if __name__ == "__main__":
    main()
