"""How far corrected beams were measured to be off: stiffness of single members against solids, and doubts from that.

The tables are those that benchmarks/member_errors.py prints: steel-like members, nu = 0.3, with rigid end faces.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.doubts import Doubt, place_of
from flexura.analysis.energy import KINDS, energies
from flexura.linalg import lowest
from flexura.mechanism import CircularContour, Flexure, Leaf, Notch, evaluated
from flexura.structure import FullOrderModel

Array = NDArray[np.float64]
Table = Mapping[tuple[float, float], tuple[float, ...]]

LEAVES: Table = {  # (b/t, L/b): stretch, twist, about y by moments and between parallel ends, about z likewise, %
    (5, 0.3): (-9.9, -8.0, -0.1, -10.8, -1.8, -9.1),
    (5, 0.6): (-5.9, -3.3, 1.4, -5.3, -0.8, -5.0),
    (5, 1): (-3.6, -1.7, 1.7, -2.3, -0.5, -2.9),
    (5, 2): (-1.8, -1.6, 1.0, -0.5, -0.3, -1.3),
    (5, 5): (-0.7, -1.7, 0.4, 0.2, -0.1, -0.5),
    (15, 0.3): (-7.7, -2.7, 0.5, -3.5, -3.1, -8.4),
    (15, 0.6): (-4.8, -0.5, 1.2, -1.0, -1.6, -4.7),
    (15, 1): (-2.9, -0.3, 1.1, -0.4, -1.0, -2.8),
    (15, 2): (-1.4, -0.7, 0.5, -0.4, -0.5, -1.4),
    (15, 5): (-0.6, -0.9, 0.2, -0.0, -0.2, -0.6),
}
NOTCHES: Table = {  # right-circular, (R/t, b/2R): the same
    (2, 0.2): (-21.6, -5.3, -4.1, -24.3, -22.5, -40.5),
    (2, 1): (-23.7, 3.3, -3.5, -25.2, -22.2, -10.3),
    (2, 3): (-27.4, -8.6, -5.0, -26.1, -24.7, -3.6),
    (5, 0.2): (-14.0, 3.5, 0.7, -14.5, -14.7, -32.4),
    (5, 1): (-16.3, 1.9, 0.5, -15.3, -14.6, -6.4),
    (5, 3): (-20.1, -4.3, -0.6, -16.5, -17.3, -4.1),
    (15, 0.2): (-8.1, 7.9, 0.9, -5.4, -8.5, -26.3),
    (15, 1): (-11.0, 1.8, 0.7, -6.3, -8.9, -4.7),
    (15, 3): (-14.7, -1.1, -0.2, -7.4, -12.1, -6.1),
    (50, 0.2): (-4.6, 5.0, -0.5, -1.7, -4.6, -21.4),
    (50, 1): (-8.5, -0.0, -1.0, -3.1, -6.0, -5.4),
    (50, 3): (-11.6, -1.5, -1.4, -3.7, -9.3, -8.5),
}

OFF = 5.0
"""Error, %, of a stiffness from which it is a doubt."""

SHARE = 0.1
"""Part of the strain energy of a mode from which a direction of a member counts."""

MODES = 6

NEAR = 1.5
"""Ratios of sizes so many times beyond those that were measured are not covered by them."""

MOST_NAMED = 3
"""Members that are named beside the first of a sort."""


def interpolated(table: Table, first: float, second: float) -> Array:
    """Errors (6,), %, of the nearest measured ratios, linear in their logarithms between these."""
    own, other = (np.unique([key[k] for key in table]) for k in (0, 1))
    grid = np.array([[table[a, b] for b in other] for a in own])
    along = np.array([[np.interp(np.log(second), np.log(other), g[:, k]) for k in range(6)] for g in grid])
    return np.array([np.interp(np.log(first), np.log(own), along[:, k]) for k in range(6)])


def expected_errors(member: Flexure, length: float) -> Array | None:
    """Errors (6,), %, of the stiffness of a corrected member of that length, m; None where nothing was measured."""
    match member.profile:
        case Leaf(width=float(b), thickness=float(t)):
            small, large = sorted((b, t))
            errors = interpolated(LEAVES, large / small, length / large)
            return errors if t <= b else errors[[0, 1, 4, 5, 2, 3]]
        case Notch(width=float(b), contour=CircularContour(radius=float(R), web=float(t))) if (
            abs(2 * R - length) < 1e-6 * R
        ):
            return interpolated(NOTCHES, R / t, b / (2 * R))
    return None


def not_measured(member: Flexure, length: float) -> str:
    """What a corrected member of that length, m, is, in words, where no measured one comes near it; empty where one
    does."""
    match member.profile:
        case Leaf(width=float(b), thickness=float(t)):
            beyond = length / max(b, t) < min(key[1] for key in LEAVES) / NEAR
            return "leaf so short for its width" if beyond else ""
        case Notch(width=float(b), contour=CircularContour(radius=float(R), web=float(t))) if (
            abs(2 * R - length) < 1e-6 * R
        ):
            steep, wide = (sorted({key[k] for key in NOTCHES}) for k in (0, 1))
            if R / t < steep[0] / NEAR:
                return "right-circular notch so steep"
            if not wide[0] / NEAR <= b / (2 * R) <= wide[-1] * NEAR:
                return f"right-circular notch so {'narrow' if b < R else 'wide'}"
            return ""
        case Notch(contour=contour):
            shape = contour.shape.replace("_", "-")
            return f"{'circular notch that is not right-circular' if shape == 'circular' else f'{shape} notch'}"
        case profile:
            return f"{profile.type.replace('_', '-')} notch"


def measured_doubts(full: FullOrderModel, values: Mapping[str, float]) -> list[Doubt]:
    """Corrected members that were measured to be off by 5 % or more in a direction that carries a tenth or more of the
    energy of one of the first modes, bending with the lesser of its two errors, and those of a sort that carries as
    much and was not measured; for parameter values in SI."""
    expected: dict[tuple[str, str], Array] = {}
    unknown: dict[tuple[str, str], str] = {}
    for name, part in full.plan.parts.items():
        for k, (key, member) in enumerate(part.members.items()):
            if isinstance(member, Flexure) and part.table.corrections.active[k].any():
                own, length = evaluated(member, values), float(full.geometry.parts[name].length[k])
                if words := not_measured(own, length):
                    unknown[name, key] = words
                errors = expected_errors(own, length)
                if errors is not None and abs(errors).max() >= OFF:
                    expected[name, key] = errors
    if not (expected or unknown) or not full.order:
        return []
    pairs = lowest(full.K, full.M, min(MODES, full.order))
    parts = energies(full, full.node_displacements(pairs.vectors))
    total = sum(s.sum(axis=0) for part in parts for s in part.strain.values())

    def share(name: str, key: str) -> Array:
        """Parts (kinds, k) of the energy of each mode that all copies of a member hold."""
        own = sum(part.strain[key] for part in parts if part.prototype == name)
        return np.asarray(own / np.maximum(total, 1e-300))

    off = [_off(name, key, errors, share(name, key)) for (name, key), errors in expected.items()]
    of_sort: dict[str, list[tuple[str, str]]] = {}
    for member, words in unknown.items():
        of_sort.setdefault(words, []).append(member)
    bare = [
        _uncovered(words, [place_of(*member) for member in members])
        for words, members in of_sort.items()
        if np.sum([share(*member).sum(axis=0) for member in members], axis=0).max() >= SHARE
    ]
    return [*(doubt for doubt in off if doubt is not None), *bare]


def _off(name: str, key: str, errors: Array, share: Array) -> Doubt | None:
    """A doubt about a member with measured errors (6,), %, that holds parts (kinds, k) of the energy of modes."""
    bending = [min(pair, key=abs) for pair in (errors[2:4], errors[4:6])]
    by_kind = {"stretch": errors[0], "twist": errors[1], "thickness bending": bending[0], "width bending": bending[1]}
    said = []
    for kind, error in by_kind.items():
        most = int(share[KINDS.index(kind)].argmax())
        part_of = float(share[KINDS.index(kind), most])
        if abs(error) >= OFF and part_of >= SHARE:
            said.append(f"{error:+.0f} % in {kind} ({part_of:.0%} of the energy of mode {most + 1})")
    if not said:
        return None
    text = f"its corrected stiffness is off by about {', '.join(said)}, as measured against solids; "
    return Doubt("measured", place_of(name, key), text + "fidelity: solid does without the error, verify shows it")


def _uncovered(words: str, places: list[str]) -> Doubt:
    """One doubt about all members of a sort of which none was measured."""
    others = places[1 : 1 + MOST_NAMED]
    more = len(places) - 1 - len(others)
    also = f" (so of {', '.join(others)}{f' and {more} more' if more else ''})" if others else ""
    text = f"no evidence covers its corrected stiffness in every direction{also}"
    text += f": no {words} was measured against solids so"
    return Doubt("evidence", places[0], f"{text}; verify shows how far it is off, fidelity: solid does without it")
