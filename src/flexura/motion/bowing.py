"""Strips that bend so far that they stay flat across.

A strip that bends bows across, until its fibres would be stretched more by the bow than the plate resists being flat.
Then it is stiffer in bending, and in twist too, since a bent strip that twists without stretching has to bow.

Sources: Lamb (1891), Proc. London Math. Soc. 21; Ashwell (1950), J. R. Aeronaut. Soc. 54.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexura.arrays import Array
from flexura.duals import plain

POINTS, WEIGHTS = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]), np.array([5.0, 8.0, 5.0]) / 18
"""Gauss's points along an element, -1 to 1, and their weights."""

_FREE_BEAM = np.append([4.730040745, 10.995607838], (2 * np.arange(3, 25) - 0.5) * np.pi)
"""Roots of tan(x/2) = -tanh(x/2), of the even modes of a beam that is free at both ends; they carry the bow across."""
SHARES = 16 * np.tanh(_FREE_BEAM / 2) ** 2 / _FREE_BEAM**2
SHARES[-1] += 1 - SHARES.sum()
ROOTS = _FREE_BEAM**4

SLENDER = 720.0
"""The y at which curvature resists a bow of one parabola as much as the plate does (theory eqs. F3, G40)."""

HELD = 1e-9
"""Share of the bow below which it counts as none."""


@dataclass(frozen=True)
class Bowing:
    """What it takes to keep elements (e,) flat across.

    `plate`, N m, is plate stiffness times width over length, `nu` Poisson's ratio, `searle` 12 (1 - nu^2) b^4/t^2
    L^2, `free` (e, 3) the share of its free bow that a strip has at `POINTS` between ends that are held
    flat. `rows` (e, 3, 2, s) make of
    strains (e, s) curvature where the strip bows and rate of twist at `POINTS`, both times length.
    """

    plate: Array
    nu: Array
    searle: Array
    free: Array
    rows: Array

    @cached_property
    def any(self) -> bool:
        """Whether any strip bows."""
        return bool(plain(self.plate).any())

    def added(self, strain: Array) -> tuple[Array, Array, Array]:
        """Energy (e,), force (e, s) and stiffness (e, s, s) by the strains (e, s) (theory eq. G40)."""
        plate, nu, searle = (each[:, None] for each in (self.plate, self.nu, self.searle))
        bent, twist = np.moveaxis((self.rows @ strain[:, None, :, None])[..., 0], -1, 0)
        lost, by_y, by_yy = _lost(searle * bent**2, self.free)
        change, weight = 2 * searle * bent, plate * WEIGHTS
        first, second = by_y * change, by_yy * change**2 + by_y * 2 * searle
        square, mixed = np.stack([nu**2 * bent**2 / 2, nu * twist**2]), 2 * nu * twist * first[1]
        by_bent = nu**2 * bent * lost[0] + (square * first).sum(axis=0)
        by_both = nu**2 * (lost[0] + 2 * bent * first[0]) + (square * second).sum(axis=0)
        force = np.stack([by_bent, 2 * nu * twist * lost[1]], axis=-1)
        k = np.stack([by_both, mixed, mixed, 2 * nu * lost[1]], axis=-1).reshape(*bent.shape, 2, 2)
        turned = weight[..., None, None] * np.swapaxes(self.rows, -1, -2)
        force = (turned @ force[..., None])[..., 0].sum(axis=1)
        return (weight * (square * lost).sum(axis=0)).sum(axis=1), force, (turned @ k @ self.rows).sum(axis=1)


def _lost(y: Array, free: Array) -> tuple[Array, Array, Array]:
    """The shares of its free bow (2, e, p) that a strip loses by its curvature, y (e, p), in bending and in twist, and
    their first and second derivatives by y, of `free` (e, p) (theory eqs. G39-G40)."""
    part = SHARES / (1 + y[..., None] / ROOTS)
    bow, first = part.sum(axis=-1), -(part**2 / SHARES / ROOTS).sum(axis=-1)
    second = 2 * (part**3 / (SHARES * ROOTS) ** 2).sum(axis=-1)
    left = free / (1 + free * (1 / bow - 1))
    by_y = left**2 * first / bow**2
    by_yy = left**2 * (second / bow**2 - 2 * first**2 / bow**3) + 2 * by_y**2 / np.maximum(left, HELD)
    quicker, held = np.sqrt(1 + y / SLENDER), np.log(np.maximum(1 - free, HELD))
    flat, slope = np.exp(quicker * held), held / (2 * SLENDER * quicker)
    return (
        np.stack([free - left, 1 - flat - left]),
        np.stack([-by_y, -flat * slope - by_y]),
        np.stack([-by_yy, -flat * slope * (slope - 1 / (2 * SLENDER * quicker**2)) - by_yy]),
    )
