"""Notches between blocks: what solids say of right-circular ones beyond wedge and plate theory.

The flanks of a notch end in the blocks on either side, and stresses leave the web through both. No field is known of
that in three dimensions: `blocks.csv` holds solid finite elements of notches between blocks as high as their ends
(benchmarks/notches.py), between which is interpolated here.
"""

from __future__ import annotations

import csv
import math
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.beam.fitted import Fit, fitted, within
from flexura.beam.frames import Real

SLENDER = (0.75, 50.0)
"""Least and largest radius over web that is known."""

BROAD = (0.1, 5.0)
"""Least and largest width over length that is known."""

VERY_BROAD = 1e9
"""Width over length that no notch has."""

POISSON = (0.05, 0.4)
"""Least and largest Poisson's ratio that is known."""

SLIM = 0.1
"""Square of the width over length of notches that give sideways, between parallel ends, about as much by bending as by
shear."""

LEAST = 1e-4
"""What keeps shear from nothing."""


class Powers(NamedTuple):
    """Powers (...) of factors: on EA, EIz and shear along y, on EIy and GJ, and on shear along z."""

    bulk: Array
    plate: Array
    slip: Array


class BlockFactors(NamedTuple):
    """Factors (...) on stiffness: EA, EIy, EIz, GJ, and shear along y and z."""

    axial: Array
    bend_y: Array
    bend_z: Array
    twist: Array
    shear_y: Array
    shear_z: Array


def block_factors(slender: Real, broad: Real, nu: Real, powers: Powers | None = None) -> BlockFactors:
    """Return what makes the stiffness of corrected notches that between blocks (theory eq. F26), as factors.

    Polynomials of the logarithms of both ratios and of Poisson's ratio go through all rows of `blocks.csv`: through the
    logarithms of factors and, along y, where narrow notches hardly shear, through the root of the flexibility in shear
    over that of the notch. Outside of `SLENDER`, `BROAD` and `POISSON` factors are those at their ends, but for EIy of
    narrower notches, which bend as in plane stress.

    slender: radius over web; broad: width over length; nu: Poisson's ratio; powers: what factors are raised to, 1 of
    right-circular notches; all (...), -. Returns factors (...). Raises nothing.
    """
    narrow = broad / within(broad, BROAD[0], VERY_BROAD)
    slender, broad = within(slender, *SLENDER), within(broad, *BROAD)
    *logarithms, root = _fit().at(within(nu, *POISSON), np.log(slender), np.log(broad))
    axial, bend_y, bend_z, twist, shear_z = logarithms
    shear_y = np.log(_shears(broad) / (root * root + LEAST))
    bulk, plate, slip = (1.0, 1.0, 1.0) if powers is None else powers
    shares = bulk * axial, plate * narrow * bend_y, bulk * bend_z, plate * twist, bulk * shear_y, slip * shear_z
    return BlockFactors(*map(np.exp, shares))


def _shears(broad: Real) -> Real:
    """About what share of what a notch gives sideways is shear."""
    return broad * broad / (broad * broad + SLIM)


@cache
def _fit() -> Fit:
    """The polynomials that go through all rows of the table."""
    with files("flexura.beam").joinpath("blocks.csv").open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    known = {}
    for row in rows:
        nu, slender, broad = (float(row[name]) for name in ("nu", "slender", "broad"))
        axial, bend_y, bend_z, twist, shear_y, shear_z = (float(row[name]) for name in BlockFactors._fields)
        root = math.sqrt(max(_shears(broad) / shear_y - LEAST, 0.0))
        known[nu, slender, broad] = np.array([*np.log([axial, bend_y, bend_z, twist, shear_z]), root])
    return fitted(known, len(BlockFactors._fields), (None, math.log, math.log))
