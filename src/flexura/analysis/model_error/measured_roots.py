"""How far off the flexibility of elastic roots is, as measured against solids, and which joints are beyond the table.

`root_errors.csv` has the errors (benchmarks/roots.py --errors): of roots between the rows that are interpolated, of
blocks wider and narrower than the leaf, and of ratios outside of the table.
"""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files

import numpy as np

from flexura.arrays import Array
from flexura.beam import RATIOS, THINNEST, WIDTHS

Interval = tuple[float, float]

NEAREST = 3
"""Rows of most like joints of which the worst error is taken."""

SIDE, EDGE = 0.7, 0.1
"""Block beside the faces over the thickness, and beside the sides over the width, in the middle of their scales."""

STEEP = 8.0
"""Weight of Poisson's ratio, and of how far a member reaches beyond its block, beside the scales."""

DIRECTIONS = ("u_u", "rx_rx", "ry_ry", "rz_rz")
"""Columns with the errors in stretch, twist, thickness bending and width bending."""


def root_shares(ratios: Array) -> Array:
    """Return what is to be added, least and most (k, 4, 2), to the flexibility of roots in DIRECTIONS, relative: the
    worst errors of the NEAREST rows.

    ratios: (k, 5), Poisson's ratio, width, larger and smaller distance from the faces of the member to those of the
    block, and how far the block reaches beyond its sides, sizes over the thickness.
    """
    measured, errors = _measured()
    far = ((_scaled(ratios)[:, None] - measured) ** 2).sum(axis=-1)
    own = (1 / (1 + errors) - 1)[np.argsort(far, axis=1, kind="stable")[:, :NEAREST]]
    return np.stack([own.min(axis=1), own.max(axis=1)], axis=-1)


def unlike(ratios: Array) -> list[str]:
    """Return what is unlike the joints in the table (k,), in words, for ratios as above: empty where nothing is. All of
    one sort are told alike, by the ratio that is farthest out."""
    nu, width, larger, _, wider = ratios.T
    held = 1 + 2 * np.minimum(wider, 0.0) / width
    sorts = (
        (held < 1 - 1e-6, held, "narrower than the member: {:.0%} of its width at least"),
        (width > WIDTHS[1], -width, f"of a member up to {{:.3g}} times as wide as thick, where {WIDTHS[1]:g} is known"),
        (
            width < WIDTHS[0],
            width,
            f"of a member only {{:.3g}} times as wide as thick, where {WIDTHS[0]:g} is known",
        ),
        (nu > RATIOS[1], -nu, f"of a Poisson's ratio up to {{:.3g}}, where {RATIOS[1]:g} is known"),
        (nu < RATIOS[0], nu, f"of a Poisson's ratio down to {{:.3g}}, where {RATIOS[0]:g} is known"),
        (
            larger < THINNEST,
            larger,
            f"that reaches down to {{:.2g}} thicknesses beyond the member, where {THINNEST:g} is known",
        ),
    )
    words = np.full(len(ratios), "", dtype=object)
    for is_so, out, text in reversed(sorts):
        if is_so.any():
            words[is_so] = text.format(abs(out[is_so].min()))
    return words.tolist()


def _scaled(ratios: Array) -> Array:
    """Ratios (k, 5) on scales on which a step of one is a joint of another kind."""
    nu, width, larger, smaller, wider = ratios.T
    beside, over = np.maximum(wider, 0.0) / width, np.minimum(wider, 0.0) / width
    faces = [1 - 1 / (1 + np.maximum(own, 0.0) / SIDE) for own in (larger, smaller)]
    return np.stack([STEEP * nu, np.log(width) / 2, *faces, 1 - 1 / (1 + beside / EDGE), STEEP * over], axis=-1)


@cache
def _measured() -> tuple[Array, Array]:
    """Scaled ratios (n, 6) of all rows, and their errors (n, 4) in DIRECTIONS."""
    with files("flexura.analysis.model_error").joinpath("root_errors.csv").open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    ratios = np.array([[float(row[key]) for key in ("nu", "width", "up", "down", "wider")] for row in rows])
    return _scaled(ratios), np.array([[float(row[key]) for key in DIRECTIONS] for row in rows])
