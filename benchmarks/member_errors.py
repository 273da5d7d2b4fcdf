"""How far beams are off single members: six stiffnesses against flexura's own solids with rigid end faces.

Writes src/flexura/analysis/member_errors.csv, three rows for each solid: the beam with all corrections, the plain beam
that shears, and the plain one that does not. Rows that are there already are kept, so that it goes on where it was
interrupted; --only KIND makes those of one kind.

The kinds and their ratios are those of `flexura.analysis.measured_members`.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

import argparse
import csv
import io
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.analysis.measured_members import BEAMS, ERRORS, KINDS_OF_MEMBERS
from flexura.beam import rigid_arm
from flexura.files import write_file
from flexura.solid.fem import with_solid_parts

D = fx.describe
TABLE = Path(__file__).parent.parent / "src/flexura/analysis/member_errors.csv"
COLUMNS = ("kind", "beam", "nu", "first", "second", "third", *ERRORS, "mesh", "script")
GRIDS: dict[str, tuple[tuple[float, ...], ...]] = {
    "leaf": ((1, 2, 5, 15, 30, 60), (0.15, 0.3, 0.6, 1, 2, 5, 10, 20)),
    "right-circular notch": ((0.75, 1.5, 3, 7, 18, 50), (0.1, 0.25, 0.6, 1.5, 5)),
}
RATIOS = {"leaf": ((1, 0.3), (5, 1), (30, 0.3), (30, 2)), "right-circular notch": ((1.5, 1.5), (7, 0.25), (7, 1.5))}
"""Where Poisson's ratios other than 0.3 are measured."""
OTHERS = (0.1, 0.45)


def described(kind: str, ratios: tuple[float, ...]) -> tuple[Any, float]:
    """Section or profile of a member, and its length, m."""
    match kind, ratios:
        case "leaf", (slender, short):
            return D.Leaf(width=10e-3, thickness=10e-3 / slender), 10e-3 * short
        case "right-circular notch", (deep, broad):
            return D.Notch(width=6e-3 * broad, contour=D.CircularContour(radius=3e-3, web=3e-3 / deep)), 6e-3
    raise KeyError(kind)


def mechanism(form: Any, length: float, nu: float, **more: Any) -> fx.Mechanism:
    """The member between rigid faces, clamped at one end."""
    rigid = {"ends": ("clamped", "clamped"), "root": "rigid", "nodes": ("a", "b"), "material": "metal"}
    is_link = isinstance(form, D.Circle | D.Tube)
    own = {"section": form} if is_link else {"profile": form, "elements": 100, "integration": "tapered"}
    member = (D.Link if is_link else D.Flexure)(reference="z", **rigid, **own)
    return fx.Mechanism(
        materials={"metal": D.Material(E=200e9, nu=nu, rho=7800.0)},
        nodes={"a": (0.0, 0.0, 0.0), "b": (length, 0.0, 0.0)},
        **{"links" if is_link else "flexures": {"member": member}},
        ground={"a": "clamped"},
        **more,
    )


def stiffnesses(C: np.ndarray, length: float) -> np.ndarray:
    """Stretch, twist, and bending about y and z by moments and between parallel ends, (6,), of the compliance (6, 6) of
    an end: about the middle of a symmetric member these part."""
    inverse = np.linalg.inv(rigid_arm(np.array([length / 2, 0, 0])))
    return 1 / np.diag(inverse @ C @ inverse.T)[[0, 3, 4, 2, 5, 1]]


def solid(form: Any, length: float, nu: float) -> tuple[np.ndarray, float]:
    """Six stiffnesses (6,) of the solid, and how far one may be off for the mesh, relative."""
    meshed = with_solid_parts(mechanism(form, length, nu, fidelity="solid"), keep=0)
    (element,) = meshed.superelements.values()
    K, E = (matrix.array[-6:, -6:] for matrix in (element.stiffness, element.stiffness_error))
    C = np.linalg.inv(K)
    own = stiffnesses(C, length)
    return own, float((own / stiffnesses(C @ E @ C, length)).max())


def beam(form: Any, length: float, nu: float, name: str) -> np.ndarray:
    """Six stiffnesses (6,) of a beam."""
    model = mechanism(form, length, nu, **BEAMS[name])
    return stiffnesses(np.reshape(fx.compliance(model, nodes=["b"]), (6, 6)), length)


def wanted(kind: str) -> list[tuple[float, tuple[float, ...]]]:
    """Poisson's and other ratios of the rows of a kind."""
    return [(0.3, at) for at in product(*GRIDS[kind])] + [(nu, at) for at in RATIOS.get(kind, ()) for nu in OTHERS]


def main() -> None:
    """Complete the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=list(GRIDS), help="one kind of member")
    only = parser.parse_args().only
    rows: dict[tuple[str, ...], list[str]] = {}
    if TABLE.exists():
        with TABLE.open() as file:
            for line in csv.reader(row for row in file if not row.startswith("#")):
                rows[tuple(line[:6])] = line
    rows.pop(COLUMNS[:6], None)
    for kind in (only,) if only else GRIDS:
        for nu, ratios in wanted(kind):
            at = [f"{x:g}" for x in (nu, *ratios)] + [""] * (3 - len(ratios))
            if all((kind, name, *at) in rows for name in BEAMS):
                continue
            form, length = described(kind, ratios)
            true, mesh = solid(form, length, nu)
            for name in BEAMS:
                errors = [f"{x:.5f}" for x in beam(form, length, nu, name) / true - 1]
                rows[kind, name, *at] = [kind, name, *at, *errors, f"{mesh:.4f}", Path(__file__).name]
            write(rows)
            print(kind, *at, *rows[kind, "auto", *at][6:-1], flush=True)


def write(rows: dict[tuple[str, ...], list[str]]) -> None:
    """The table, in one step."""
    text = io.StringIO()
    text.write(
        "# Relative errors of the stiffness of beams against solids with rigid end faces: beam over solid, less 1.\n"
    )
    for kind, own in KINDS_OF_MEMBERS.items():
        text.write(f"# {kind}: {', '.join(own)}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    kinds, beams = list(KINDS_OF_MEMBERS), list(BEAMS)

    def order(key: tuple[str, ...]) -> tuple[float, ...]:
        return kinds.index(key[0]), beams.index(key[1]), *(float(x or 0) for x in key[2:])

    writer.writerows(rows[key] for key in sorted(rows, key=order))
    write_file(TABLE, lambda path: path.write_text(text.getvalue()))


if __name__ == "__main__":
    main()
