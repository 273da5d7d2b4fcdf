"""How far the described model may be from the part that is drawn: the second margin of every number.

Proven intervals say how near a number is to that of the description; whether the part is like the description is
physics: beams are not solids, roots and bodies give. Every assumption is a flexibility E that is left out or uncertain,
of which a share s, from measured errors, is to be added. A number that the forces f of the model make is changed by
s f'E f (theory eq. A1), so that each assumption is weighted by the energy that it holds of that very number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from flexura.analysis.model_error.assumptions import Assumption, Assumptions, Interval
from flexura.analysis.strain import force_changes
from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg import count_below
from flexura.modal import assignment
from flexura.reduction import chained, lowest_pairs
from flexura.structure import FullOrderModel

MIXED = 0.15
"""Part of a shape in another one from which the modes are mixed."""

COVERAGE = 1.3
"""By how much half widths that are added are widened, so that 95 % of frequencies of whole solids lie inside."""

STIFF = -0.5
"""Relative change of a compliance up to which effects add."""

SOFTEST = 0.1
"""The least that an assumption may leave of a compliance."""

LEFT = 0.035
"""How far off, relative, a compliance may be by what no evidence is kept of: where members meet, and their mass."""

NO_GROUP = ""
"""Group of what is off of every number by itself."""

LEAST = 5e-4
"""Model errors below which their size is not told."""

UNCOVERED = 0.1
"""Part of the energy of a number in members without evidence from which its model error is not known."""

MORE = 8
"""Modes that are taken beside those that are asked for, to show how these change."""

MOST = 30_000
"""Coordinates up to which model errors of modes are worked out."""

FEWEST, MOST_MODES, NEAR = 6, 60, 0.03
"""Modes that are looked at for resonances at least and at most, and how near, relative, one of them is."""

MOST_CAUSES = 3
"""Assumptions that are told of a number."""


@dataclass(frozen=True)
class Effect:
    """Where one assumption, the same of all `places`, alone puts the part's values: between 1 + `low` and 1 + `high`
    (n,) times the printed ones."""

    kind: str
    places: tuple[str, ...]
    text: str
    low: Array
    high: Array


@dataclass(frozen=True)
class Unknown:
    """Members without evidence: why, and the part (n,) of the energy of each number that they hold."""

    places: tuple[str, ...]
    reason: str
    share: Array


@dataclass(frozen=True)
class ModelError:
    """Where the part's values lie: between 1 + `low` and 1 + `high` (n,) times the printed ones, NaN where evidence is
    missing, for a `reason` (n,). `effects` are those of every assumption by itself, the largest first; `unknown` are
    members without evidence. Relative changes `middle` (n,) and, by group of assumptions, plus and minus `spread` (n,)
    are those that the ends follow from, of frequencies the ones of 1/omega^2."""

    low: Array
    high: Array
    reason: tuple[str, ...]
    effects: tuple[Effect, ...]
    unknown: tuple[Unknown, ...] = ()
    middle: Array = field(default_factory=lambda: np.zeros(0))
    spread: Mapping[str, Array] = field(default_factory=dict)

    @property
    def intervals(self) -> tuple[Interval | None, ...]:
        """Least and largest relative difference of each number; None where evidence is missing."""
        both = zip(self.low.tolist(), self.high.tolist(), strict=True)
        return tuple((low, high) if np.isfinite(low) and np.isfinite(high) else None for low, high in both)

    @property
    def texts(self) -> tuple[str, ...]:
        """The intervals in words, such as `-6.2 to +1.1 %`."""
        return tuple(interval_text(own) for own in self.intervals)

    @property
    def causes(self) -> tuple[str, ...]:
        """Of each number in words why there is no evidence, or else the assumptions that are worst for it, the worst
        first."""
        return tuple(own or self._worst(k) for k, own in enumerate(self.reason))

    def _worst(self, k: int) -> str:
        size = np.array([max(-own.low[k], own.high[k]) for own in self.effects])
        found = [self.effects[i] for i in np.argsort(-size, kind="stable")[:MOST_CAUSES] if size[i] >= LEAST]
        more = [f" and {len(own.places) - 1} more" * (len(own.places) > 1) for own in found]
        return "; ".join(
            f"{own.places[0]}{rest}: {own.text}, {interval_text((float(own.low[k]), float(own.high[k])))}"
            for own, rest in zip(found, more, strict=True)
        )


NO_ERRORS = ModelError(np.empty(0), np.empty(0), (), ())


def interval_text(interval: Interval | None) -> str:
    """A model error in words."""
    if interval is None:
        return "no evidence"
    if max(map(abs, interval)) < LEAST:
        return f"below {100 * LEAST:g} %"
    digits = 1 if max(map(abs, interval)) < 0.0995 else 0
    low, high = (f"{100 * own:+.{digits}f}" for own in interval)
    return f"{low} %" if low == high else f"{low} to {high} %"


def model_errors_of_modes(full: FullOrderModel, n: int) -> tuple[ModelError, Array]:
    """Model errors of the first `n` frequencies, and these, Hz. Errors of rigid motions, and all beyond MOST
    coordinates or without modes, are NaN."""
    nothing = np.full(n, np.nan)
    if full.order > MOST:
        return ModelError(nothing, nothing, (f"not worked out beyond {MOST} coordinates",) * n, ()), nothing
    apart = chained(full)
    try:
        pairs = lowest_pairs(apart, min(n + MORE, full.order))
    except SolverError as error:
        return ModelError(nothing, nothing, (str(error),) * n, ()), nothing
    at = np.flatnonzero(pairs.values > 0)
    vectors = apart.recover(pairs.vectors[:, at])
    vectors = vectors / np.sqrt(np.einsum("ik,ik->k", vectors, full.M @ vectors))
    rigid = min(n, len(pairs.values) - len(at))
    found = frequency_errors(full, pairs.values[at], vectors, min(n - rigid, len(at)))
    still = nothing[:rigid]
    return ModelError(
        np.append(still, found.low),
        np.append(still, found.high),
        ("a rigid motion, whose frequency is zero",) * rigid + found.reason,
        tuple(replace(e, low=np.append(still, e.low), high=np.append(still, e.high)) for e in found.effects),
        tuple(replace(own, share=np.append(np.zeros(rigid), own.share)) for own in found.unknown),
        np.append(still, found.middle),
        {group: np.append(still, own) for group, own in found.spread.items()},
    ), np.sqrt(np.maximum(pairs.values, 0.0)) / (2 * np.pi)


def model_errors_near(full: FullOrderModel, hz: Array) -> list[tuple[Interval | None, str]]:
    """The model error of the mode whose frequency is nearest to each of some (k,), Hz, or why there is none."""
    if not len(hz):
        return []
    within = count_below(full.K, full.M, (2 * np.pi * (1 + NEAR) * hz.max()) ** 2)
    errors, own = model_errors_of_modes(full, min(max(within, FEWEST), MOST_MODES, full.order))
    found: list[tuple[Interval | None, str]] = []
    for f in hz.tolist():
        k = int(np.abs(own - f).argmin())
        is_mode = k < len(errors.reason) and not abs(own[k] - f) > NEAR * f
        found.append(
            (errors.intervals[k], errors.reason[k]) if is_mode else (None, "no mode that is looked at is near")
        )
    return found


def frequency_errors(
    full: FullOrderModel, squared: Array, states: Array, n: int, found: Sequence[Assumption] | None = None
) -> ModelError:
    """Model errors of the first `n` frequencies, from squared angular frequencies (k,) and M-orthonormal vectors
    (order, k) of the lowest elastic modes; the more there are, the better they show what bodies do (theory eq. A2,
    after S. Dunkerley, Phil. Trans. R. Soc. A 185 (1894) 279).

    Modes that all assumptions together mix have the margins of all that they are mixed of.
    """
    if not len(squared):
        return NO_ERRORS
    scale, base = 1 / np.outer(squared, squared), np.diag(1 / squared)
    found = Assumptions(full).of(force_changes(full, states)) if found is None else found

    def periods(flexibility: Array) -> Array:
        """1/omega^2 (n,) with a flexibility, in the order of shapes without it."""
        values, shapes = np.linalg.eigh(base + scale * flexibility)
        mode, number = assignment(-(shapes**2))
        order = np.empty(len(squared), dtype=np.intp)
        order[mode] = number
        return values[order][:n]

    own = errors_of(full, states, periods, lambda x: 1 / np.sqrt(np.maximum(1 + x, 1e-3)) - 1, found)
    likely = np.sum([sum(a.share) / 2 * a.flexibility for a in found if a.share], axis=0)
    values, shapes = np.linalg.eigh(base + scale * likely)
    # of each mode, the frequencies of those that it has become a part of
    is_part = shapes**2 >= np.minimum(MIXED, (shapes**2).max(axis=1, keepdims=True))
    ratio = np.where(is_part, 1 / np.sqrt(squared[:, None] * np.maximum(values, 1e-300)) - 1, np.nan)[:n]
    low, high = np.fmin(own.low, np.nanmin(ratio, axis=1)), np.fmax(own.high, np.nanmax(ratio, axis=1))
    is_known = np.isfinite(own.low)
    return replace(own, low=np.where(is_known, low, np.nan), high=np.where(is_known, high, np.nan))


def errors_of(
    full: FullOrderModel,
    states: Array,
    numbers: Callable[[Array], Array],
    value: Callable[[Array], Array] = lambda x: x,
    found: Sequence[Assumption] | None = None,
) -> ModelError:
    """Model errors of n numbers that follow from the compliances between k load vectors (theory eq. A1).

    states: displacements (order, k) under these loads; numbers: the n numbers when a flexibility (k, k) is added to
    these compliances; value: what relative changes of them are of the numbers asked for. Assumptions of one group add,
    groups their squares; equal ones are taken at once, so that modes of equal frequencies are not told apart by them.
    `found` are the assumptions for the states, where they are worked out already.
    """
    found = Assumptions(full).of(force_changes(full, states)) if found is None else found
    base = numbers(np.zeros((states.shape[1],) * 2))
    n, size = len(base), np.where(base == 0, np.inf, base)

    def added(flexibility: Array) -> Array:
        return (numbers(flexibility) - base) / size

    alike: dict[tuple[str, str, str], list[Assumption]] = {}
    for own in found:
        by_itself = own.place if own.kind in ("body", "ground") else ""
        alike.setdefault((own.kind, own.reason or own.text, by_itself), []).append(own)
    middle, spread = np.zeros(n), {own.group: np.zeros(n) for own in found}
    effects, unknown, least = [], [], np.ones(n)
    for (kind, text, _), same in alike.items():
        places = tuple(dict.fromkeys(own.place for own in same))
        if same[0].share is None:
            part = np.abs(added(np.sum([own.flexibility for own in same], axis=0)))
            unknown.append(Unknown(places, text, np.minimum(part, 1.0)))
            continue
        pairs = [(own.share or (0.0, 0.0), own.flexibility) for own in same]
        low, high = (added(np.sum([share[k] * E for share, E in pairs], axis=0)) for k in (0, 1))
        middle += (low + high) / 2
        least *= np.maximum(1 + COVERAGE * np.minimum(low, 0.0), SOFTEST)
        spread[same[0].group] += (high - low) / 2
        effects.append(Effect(kind, places, text, *np.sort([value(low), value(high)], axis=0)))
    spread[NO_GROUP] = np.full(n, LEFT)
    spread = {group: COVERAGE * own for group, own in spread.items()}
    half = np.sqrt(sum(own**2 for own in spread.values()))
    low = middle - half
    # sums end where all assumptions at their least multiply
    low = np.where(low < STIFF, np.maximum(low, np.minimum(least / (1 + LEFT) - 1, STIFF)), low)
    ends = np.sort([value(low), value(middle + half)], axis=0)
    without = sum((own.share for own in unknown), np.zeros(n))
    ends[:, without >= UNCOVERED] = np.nan
    most = [max(unknown, key=lambda own: own.share[k], default=None) for k in range(n)]
    reasons = tuple(own.reason if own and bad else "" for own, bad in zip(most, without >= UNCOVERED, strict=True))
    effects.sort(key=lambda own: -float(np.abs([own.low, own.high]).max(initial=0.0)))
    return ModelError(ends[0], ends[1], reasons, tuple(effects), tuple(unknown), middle, spread)
