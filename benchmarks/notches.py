"""Right-circular notches between blocks by solid finite elements: factors on the stiffness of corrected beams.

Writes src/flexura/beam/blocks.csv, a row for each radius over web, each width over length and each Poisson's ratio;
rows that are there already are kept, so that it goes on where it was interrupted.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

import csv
import io
from itertools import product
from pathlib import Path

import numpy as np
from member_errors import described, solid

from flexura.analysis.model_error.measured import EXACT, beam_stiffness
from flexura.beam import block_factors, notch, rectangle
from flexura.beam.blocks import BlockFactors
from flexura.files import write_file

TABLE = Path(__file__).parent.parent / "src/flexura/beam/blocks.csv"
RATIOS = (0.05, 0.2, 0.3, 0.4)
SLENDER = (0.75, 1.1, 3.0, 12.0, 34.0, 50.0)
BROAD = (0.1, 0.15, 0.4, 1.3, 3.5, 5.0)

LEAST = 1e-3
"""Least flexibility in shear, over that of a beam: bending alone gives narrow notches more than solids have."""


def factors(nu: float, slender: float, broad: float) -> tuple[BlockFactors, float]:
    """What makes a beam as stiff as the solid, and how far the mesh may be off."""
    form, length = described("right-circular notch", (slender, broad))
    true, mesh = solid(form, length, nu)
    beam = beam_stiffness(form, length, nu, "auto", *EXACT)
    known = block_factors(slender, broad, nu)
    stretch, twist, bend_y, _, bend_z, _ = true / beam
    # between parallel ends a beam bends and shears
    x = np.linspace(-length / 2, length / 2, 4001)
    h = notch.circular(x, form.contour.radius, form.contour.web)
    _, slid = notch.beam_flexibility(x[1] - x[0], h)
    shear = slid.sum() * 2 * (1 + nu) / (rectangle(form.width, 1.0, nu).ky * form.width)
    shears = []
    for place, bend, own in ((5, bend_z, known.shear_y), (3, bend_y, known.shear_z)):
        left = 1 / true[place] - (1 / beam[place] - shear / own) / bend
        shears.append(shear / max(left, LEAST * shear))
    found = (known.axial * stretch, known.bend_y * bend_y, known.bend_z * bend_z, known.twist * twist, *shears)
    return BlockFactors(*found), mesh


def main() -> None:
    """Complete the table."""
    with TABLE.open() as file:
        lines = list(csv.reader(row for row in file if not row.startswith(("#", "nu"))))
    rows = {tuple(map(float, line[:3])): line for line in lines}
    for at in product(RATIOS, SLENDER, BROAD):
        if at not in rows:
            found, mesh = factors(*at)
            rows[at] = [f"{x:g}" for x in at] + [f"{float(x):.5f}" for x in found]
            print(*rows[at], f"mesh {mesh:.5f}", flush=True)
            write(rows)


def write(rows: dict[tuple[float, ...], list[str]]) -> None:
    """The table, in one step."""
    text = io.StringIO()
    text.write("# Factors on the stiffness of corrected right-circular notches: solids between blocks over beams.\n")
    text.write("# slender: radius over web; broad: width over length (benchmarks/notches.py).\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([["nu", "slender", "broad", *BlockFactors._fields], *(rows[at] for at in sorted(rows))])
    write_file(TABLE, lambda path: path.write_text(text.getvalue()))


if __name__ == "__main__":
    main()
