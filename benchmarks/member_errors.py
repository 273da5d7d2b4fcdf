"""How far beams are off single members: six stiffnesses against solids (benchmarks/octants.py).

Solids have rigid end faces or, of notches whose flanks steepen to their ends, are between blocks.

Writes src/flexura/analysis/model_error/member_errors.csv, three rows for each solid: the beam with all corrections, the
plain beam that shears, and the plain one that does not. Rows that are there already are kept, so that it goes on where
it was interrupted; --only KIND makes those of one kind.

The kinds and their ratios are those of `flexura.analysis.model_error.measured`.
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
import octants

import flexura as fx
from flexura.analysis.model_error.measured import (
    BEAMS,
    BETWEEN_BLOCKS,
    ERRORS,
    EXACT,
    KINDS_OF_MEMBERS,
    NU,
    RATIOS_OF,
    beam_stiffness,
    member_between_faces,
    ratios_of,
)
from flexura.beam import rectangle
from flexura.fem.geometry import MemberSolid, solids
from flexura.files import write_file
from flexura.full_order import assemble
from flexura.structure import Plan, one_design

D = fx.describe
TABLE = Path(__file__).parent.parent / "src/flexura/analysis/model_error/member_errors.csv"
COLUMNS = ("kind", "beam", "nu", *RATIOS_OF, *ERRORS, "mesh", "script")
KEYS = COLUMNS.index(ERRORS[0])
GRIDS: dict[str, tuple[tuple[float, ...], ...]] = {
    "leaf": ((1, 2, 5, 15, 60), (0.15, 0.3, 0.6, 1, 2, 5, 20)),
    "tapered leaf": ((1, 3, 12, 50), (0.6, 1.2, 3, 10), (0.4, 0.7, 1), (0.5, 1, 2)),
    "right-circular notch": ((0.75, 2, 6, 18, 50), (0.1, 0.3, 1, 2, 5)),
    "corner-filleted notch": ((0.3, 1, 3), (8, 20, 60), (2, 10, 40)),
    "elliptical notch": ((0.5, 1.5, 5), (1, 5, 25), (0.2, 1, 4)),
    "rod": ((1, 2, 4, 10, 30),),
    "round right-circular notch": ((1, 4, 15, 50),),
    "circular notch": ((1, 5, 25), (0.2, 1, 4), (0.5, 0.8, 1)),
    "tube": ((0.5, 0.9), (1, 3, 10)),
    "two-axis right-circular notch": ((1, 4, 15),),
    "round corner-filleted notch": ((0.3, 2), (5, 12, 40)),
    "parabolic notch": ((0.7, 4), (1, 5, 20), (0.3, 2)),
    "hyperbolic notch": ((0.7, 4), (1, 5, 20), (0.3, 2)),
    "v-shaped notch": ((20, 45), (0.5, 2), (10, 40), (0.3, 2)),
}
OTHER = 0.4
"""Poisson's ratio of further rows, at some of the ratios."""
FINE, COARSE = 0.65, 0.45
ORDER = 3.4
"""With which the stiffness converges on meshes that are graded so."""


def described(kind: str, ratios: tuple[float, ...]) -> tuple[Any, float]:
    """Section or profile of a member whose web is 1 mm thick, and its length, m."""
    t = 1e-3
    match kind, ratios:
        case "leaf", (b, short):
            return D.Leaf(width=b * t, thickness=t), b * short * t
        case "tapered leaf", (b, short, narrow, thin):
            sizes = ((1, narrow, b), (1, thin, 1))
            width, thickness = ((mean * t * 2 / (x + y) * x, mean * t * 2 / (x + y) * y) for x, y, mean in sizes)
            return D.Leaf(width=width, thickness=thickness), b * short * t
        case "rod", (slender,):
            return D.Circle(diameter=t), slender * t
        case "tube", (bore, slender):
            return D.Tube(outer_diameter=t, inner_diameter=bore * t), slender * t
        case "right-circular notch", (R, broad):
            return D.Notch(width=2 * R * broad * t, contour=D.CircularContour(radius=R * t, web=t)), 2 * R * t
        case "circular notch", (R, broad, part):
            length = 2 * R * part * t
            return D.Notch(width=broad * length, contour=D.CircularContour(radius=R * t, web=t)), length
        case "round right-circular notch", (R,):
            return D.RoundNotch(contour=D.CircularContour(radius=R * t, web=t)), 2 * R * t
        case "two-axis right-circular notch", (R,):
            both = D.CircularContour(radius=R * t, web=t)
            return D.TwoAxisNotch(y_contour=both, z_contour=both), 2 * R * t
        case "corner-filleted notch", (r, long, b):
            return D.Notch(width=b * t, contour=D.CornerFilletedContour(fillet_radius=r * t, web=t)), long * t
        case "round corner-filleted notch", (r, long):
            return D.RoundNotch(contour=D.CornerFilletedContour(fillet_radius=r * t, web=t)), long * t
        case "v-shaped notch", (angle, r, long, broad):
            contour = D.VShapedContour(angle=np.radians(angle), root_radius=r * t, web=t)
            return D.Notch(width=broad * long * t, contour=contour), long * t
        case _, (long, deep, broad):
            contours = {"elliptical": D.EllipticalContour, "parabolic": D.ParabolicContour}
            own = contours.get(kind.split(maxsplit=1)[0], D.HyperbolicContour)
            length = 2 * long * deep * t
            return D.Notch(width=broad * length, contour=own(depth=deep * t, web=t)), length
    raise KeyError(kind)


def between_blocks(member: MemberSolid, fine: float) -> np.ndarray:
    """Six stiffnesses (6,) of a notch between blocks that are as high and as long as its ends are high, the flexibility
    of which is taken off: that of a bar as long as notch and blocks but for a beam as long as the notch."""
    b, h = (float(size[0]) * member.length for size in member.shape.at(np.zeros(1)))
    L, nu = member.length, member.material.nu
    whole, bar = (1 / octants.stiffnesses(member, fine, h / L, is_bar) for is_bar in (False, True))
    A, Iy, Iz, J, ky, kz = rectangle(b, h, nu)
    G = 1 / (2 * (1 + nu))
    beam = [L / A, L / (G * J), L / Iy, L**3 / (12 * Iy) + L / (G * kz * A)]
    beam += [L / Iz, L**3 / (12 * Iz) + L / (G * ky * A)]
    return 1 / (whole - bar + np.array(beam))


def solid(form: Any, length: float, nu: float) -> tuple[np.ndarray, float]:
    """Six stiffnesses (6,) of the solid, extrapolated from two meshes, and how far one may be off for these."""
    model = member_between_faces(form, length, nu, "none", *EXACT)
    (member,) = solids(assemble(Plan(model), one_design({})))
    kind, _ = ratios_of(form, length)
    own = between_blocks if kind in BETWEEN_BLOCKS else octants.stiffnesses
    fine, coarse = (own(member, cells) for cells in (FINE, COARSE))
    off = (coarse - fine) / ((FINE / COARSE) ** ORDER - 1)
    return fine - off, float(abs(off / fine).max())


def wanted(kind: str) -> list[tuple[float, tuple[float, ...]]]:
    """Poisson's and other ratios of the rows of a kind."""
    grid = GRIDS[kind]
    some = [axis[:: 2 if len(axis) % 2 else len(axis) - 1] for axis in grid]
    return [(NU, at) for at in product(*grid)] + [(OTHER, at) for at in product(*some)]


def main() -> None:
    """Complete the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=list(GRIDS), help="one kind of member")
    only = parser.parse_args().only
    rows: dict[tuple[str, ...], list[str]] = {}
    if TABLE.exists():
        with TABLE.open() as file:
            for line in csv.reader(row for row in file if not row.startswith("#")):
                rows[tuple(line[:KEYS])] = line
    rows.pop(COLUMNS[:KEYS], None)
    for kind in (only,) if only else GRIDS:
        for nu, ratios in wanted(kind):
            at = [f"{x:g}" for x in (nu, *ratios)] + [""] * (len(RATIOS_OF) - len(ratios))
            if all((kind, name, *at) in rows for name in BEAMS):
                continue
            form, length = described(kind, ratios)
            true, mesh = solid(form, length, nu)
            for name in BEAMS:
                errors = [f"{x:.5f}" for x in beam_stiffness(form, length, nu, name, *EXACT) / true - 1]
                rows[kind, name, *at] = [kind, name, *at, *errors, f"{mesh:.5f}", Path(__file__).name]
            write(rows)
            print(kind, *at, *rows[kind, "auto", *at][KEYS:-1], flush=True)


def write(rows: dict[tuple[str, ...], list[str]]) -> None:
    """The table, in one step."""
    text = io.StringIO()
    text.write("# Relative errors of the stiffness of beams against solids: beam over solid, less 1.\n")
    text.write(f"# Between blocks as high as their ends: {', '.join(BETWEEN_BLOCKS)}; others between rigid faces.\n")
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
