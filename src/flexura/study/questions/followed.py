"""Modes by what moves: which of the lowest modes of a design has most of a displacement in it.

In modes of unit modal mass a displacement x has a part m x^2 of the kinetic energy of each, m being what would move by
it alone, and a part x^2 / omega^2 of the static compliance there. The mode with the largest geometric mean of the two,
x^2 / omega, is the one: of a rigid body the one that has most of its energy, of a beam, whose tip has as much in every
mode, the lowest. That is a property of the design by itself, whichever designs stand beside it and however its modes
have crossed.
"""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.modal import REPEATED, close_groups

MODES = 12
"""So many of the lowest modes are looked at."""

AMBIGUOUS = 0.8
"""Share of a displacement, over that of the leading mode, from which another mode has nearly as much."""

STILL = 1e-7
"""Part of the largest motion of its kind below which something does not move."""

CLEARLY_STILL = 1e-4
"""The same, of modes that are a little off."""

CLEARLY = 0.5
"""Share of a displacement, over that of the leading mode, that others close to one another have at most."""

EXACTLY = 1e-6
"""Relative difference of frequencies that are equal in such modes."""

ORDERED = 2e-3
"""Least gap of others, relative, with which it is sure which of them is the lower one."""

APART, MIXED = 0.02, 1e-2
"""Modes closer than this may mix, which matters where the other one has more than this share of the displacement."""

SLOWEST = 1e-9
"""Part of the highest frequency below which a motion is rigid, and counts as one of this frequency."""


def leading_mode(hertz: Array, moved: Array, largest: float, name: str) -> tuple[int, str]:
    """The number, from 0, of the mode that has most of a displacement, and in words which others have nearly as much.

    Modes of frequencies (k,), Hz, have unit modal mass and the displacement (k,) in them; `largest` is the largest one
    of its kind anywhere. Frequencies that are equal count as one. Raises SolverError where it does not move.
    """
    groups = close_groups(hertz, REPEATED)
    squares = np.array([(moved[group] ** 2).sum() for group in groups])
    if not squares.max(initial=0.0) > (STILL * largest) ** 2:
        raise SolverError(f"{name} does not move in the lowest {len(hertz)} modes")
    shares = squares / np.maximum([hertz[group[0]] for group in groups], SLOWEST * hertz.max())
    first = int(np.argmax(shares))
    near = [k for k in range(len(groups)) if k != first and shares[k] >= AMBIGUOUS * shares[first]]
    if not near:
        return int(groups[first][0]), ""
    others = ", ".join(f"f{groups[k][0] + 1} has {shares[k] / shares[first]:.0%}" for k in near)
    return int(groups[first][0]), f"{name} moves in several modes: of its part in f{groups[first][0] + 1}, {others}"


def clear_mode(hertz: Array, moved: Array, largest: float, name: str) -> int | None:
    """The number, from 0, of the mode that has most of a displacement, from modes that are a little off, as
    `leading_mode`; None where the right ones may say otherwise, or say that there is doubt."""
    if not np.isfinite(hertz).all() or not np.abs(moved).max(initial=0.0) > CLEARLY_STILL * largest:
        return None
    number, _ = leading_mode(hertz, moved, largest, name)
    own, part = hertz[number], moved**2 / hertz
    alike = abs(hertz / own - 1) <= EXACTLY
    rest, most = np.where(alike, 0.0, part), part[alike].sum()
    gap = np.where(alike, np.inf, abs(hertz / own - 1))
    together = max(rest[group].sum() for group in close_groups(hertz, APART))
    mixes = (gap < APART) & (rest > MIXED * most)
    is_clear = together <= CLEARLY * most and gap.min(initial=np.inf) > ORDERED and not mixes.any()
    return number if is_clear else None
