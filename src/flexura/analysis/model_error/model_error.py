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

MOST_COORDINATES = 30_000
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
        return tuple(interval_text(interval) for interval in self.intervals)

    @property
    def causes(self) -> tuple[str, ...]:
        """Of each number in words why there is no evidence, or else the assumptions that are worst for it, the worst
        first."""
        return tuple(reason or self._worst(k) for k, reason in enumerate(self.reason))

    def _worst(self, k: int) -> str:
        size = np.array([max(-effect.low[k], effect.high[k]) for effect in self.effects])
        texts = []
        for i in np.argsort(-size, kind="stable")[:MOST_CAUSES]:
            if size[i] >= LEAST:
                effect, others = self.effects[i], len(self.effects[i].places) - 1
                place = effect.places[0] + f" and {others} more" * (others > 0)
                interval = float(effect.low[k]), float(effect.high[k])
                texts.append(f"{place}: {effect.text}, {interval_text(interval)}")
        return "; ".join(texts)


NO_ERRORS = ModelError(np.empty(0), np.empty(0), (), ())


def interval_text(interval: Interval | None) -> str:
    """A model error in words."""
    if interval is None:
        return "no evidence"
    if max(map(abs, interval)) < LEAST:
        return f"below {100 * LEAST:g} %"
    digits = 1 if max(map(abs, interval)) < 0.0995 else 0
    low, high = (f"{100 * end:+.{digits}f}" for end in interval)
    return f"{low} %" if low == high else f"{low} to {high} %"


def model_errors_of_modes(full: FullOrderModel, n: int) -> tuple[ModelError, Array]:
    """Model errors of the first `n` frequencies, and these, Hz. Errors of rigid motions, and all beyond
    MOST_COORDINATES or without modes, are NaN."""
    nothing = np.full(n, np.nan)
    if full.order > MOST_COORDINATES:
        return ModelError(nothing, nothing, (f"not worked out beyond {MOST_COORDINATES} coordinates",) * n, ()), nothing
    chains = chained(full)
    try:
        pairs = lowest_pairs(chains, min(n + MORE, full.order))
    except SolverError as error:
        return ModelError(nothing, nothing, (str(error),) * n, ()), nothing
    elastic = np.flatnonzero(pairs.values > 0)
    vectors = chains.recover(pairs.vectors[:, elastic])
    vectors = vectors / np.sqrt(np.einsum("ik,ik->k", vectors, full.M @ vectors))
    rigid = min(n, len(pairs.values) - len(elastic))
    errors = frequency_errors(full, pairs.values[elastic], vectors, min(n - rigid, len(elastic)))

    def padded(values: Array, of_rigid: float = np.nan) -> Array:
        return np.append(np.full(rigid, of_rigid), values)

    return ModelError(
        padded(errors.low),
        padded(errors.high),
        ("a rigid motion, whose frequency is zero",) * rigid + errors.reason,
        tuple(replace(effect, low=padded(effect.low), high=padded(effect.high)) for effect in errors.effects),
        tuple(replace(unknown, share=padded(unknown.share, 0.0)) for unknown in errors.unknown),
        padded(errors.middle),
        {group: padded(spread) for group, spread in errors.spread.items()},
    ), np.sqrt(np.maximum(pairs.values, 0.0)) / (2 * np.pi)


def model_errors_near(full: FullOrderModel, hz: Array) -> list[tuple[Interval | None, str]]:
    """The model error of the mode whose frequency is nearest to each of some (k,), Hz, or why there is none."""
    if not len(hz):
        return []
    within = count_below(full.K, full.M, (2 * np.pi * (1 + NEAR) * hz.max()) ** 2)
    errors, modes_hz = model_errors_of_modes(full, min(max(within, FEWEST), MOST_MODES, full.order))
    near: list[tuple[Interval | None, str]] = []
    for f in hz.tolist():
        k = int(np.abs(modes_hz - f).argmin())
        is_mode = k < len(errors.reason) and not abs(modes_hz[k] - f) > NEAR * f
        near.append((errors.intervals[k], errors.reason[k]) if is_mode else (None, "no mode that is looked at is near"))
    return near


def frequency_errors(
    full: FullOrderModel, squared: Array, states: Array, n: int, assumptions: Sequence[Assumption] | None = None
) -> ModelError:
    """Model errors of the first `n` frequencies, from squared angular frequencies (k,) and M-orthonormal vectors
    (order, k) of the lowest elastic modes; the more there are, the better they show what bodies do (theory eq. A2,
    after S. Dunkerley, Phil. Trans. R. Soc. A 185 (1894) 279).

    Modes that all assumptions together mix have the margins of all that they are mixed of.
    """
    if not len(squared):
        return NO_ERRORS
    scale, base = 1 / np.outer(squared, squared), np.diag(1 / squared)
    assumptions = Assumptions(full).of(force_changes(full, states), states) if assumptions is None else assumptions

    def periods(flexibility: Array) -> Array:
        """1/omega^2 (n,) with a flexibility, in the order of shapes without it."""
        values, shapes = np.linalg.eigh(base + scale * flexibility)
        mode, number = assignment(-(shapes**2))
        order = np.empty(len(squared), dtype=np.intp)
        order[mode] = number
        return values[order][:n]

    errors = errors_of(full, states, periods, lambda x: 1 / np.sqrt(np.maximum(1 + x, 1e-3)) - 1, assumptions)
    likely = np.sum([sum(a.share) / 2 * a.flexibility for a in assumptions if a.share], axis=0)
    values, shapes = np.linalg.eigh(base + scale * likely)
    # of each mode, the frequencies of those that it has become a part of
    is_part = shapes**2 >= np.minimum(MIXED, (shapes**2).max(axis=1, keepdims=True))
    ratio = np.where(is_part, 1 / np.sqrt(squared[:, None] * np.maximum(values, 1e-300)) - 1, np.nan)[:n]
    low, high = np.fmin(errors.low, np.nanmin(ratio, axis=1)), np.fmax(errors.high, np.nanmax(ratio, axis=1))
    is_known = np.isfinite(errors.low)
    return replace(errors, low=np.where(is_known, low, np.nan), high=np.where(is_known, high, np.nan))


def errors_of(
    full: FullOrderModel,
    states: Array,
    numbers: Callable[[Array], Array],
    value: Callable[[Array], Array] = lambda x: x,
    assumptions: Sequence[Assumption] | None = None,
) -> ModelError:
    """Model errors of n numbers that follow from the compliances between k load vectors (theory eq. A1).

    states: displacements (order, k) under these loads; numbers: the n numbers when a flexibility (k, k) is added to
    these compliances; value: what relative changes of them are of the numbers asked for. Assumptions of one group add,
    groups their squares; equal ones are taken at once, so that modes of equal frequencies are not told apart by them.
    `assumptions` are those for the states, where they are worked out already.
    """
    assumptions = Assumptions(full).of(force_changes(full, states), states) if assumptions is None else assumptions
    base = numbers(np.zeros((states.shape[1],) * 2))
    n, size = len(base), np.where(base == 0, np.inf, base)

    def added(flexibility: Array) -> Array:
        return (numbers(flexibility) - base) / size

    alike: dict[tuple[str, str, str], list[Assumption]] = {}
    for one in assumptions:
        by_itself = one.place if one.kind in ("body", "ground") else ""
        alike.setdefault((one.kind, one.reason or one.text, by_itself), []).append(one)
    middle, spread = np.zeros(n), {one.group: np.zeros(n) for one in assumptions}
    effects, unknown, least = [], [], np.ones(n)
    for (kind, text, _), same in alike.items():
        places = tuple(dict.fromkeys(one.place for one in same))
        if same[0].share is None:
            part = np.abs(added(np.sum([one.flexibility for one in same], axis=0)))
            unknown.append(Unknown(places, text, np.minimum(part, 1.0)))
            continue
        pairs = [(one.share or (0.0, 0.0), one.flexibility) for one in same]
        low, high = (added(np.sum([share[k] * E for share, E in pairs], axis=0)) for k in (0, 1))
        middle += (low + high) / 2
        least *= np.maximum(1 + COVERAGE * np.minimum(low, 0.0), SOFTEST)
        spread[same[0].group] += (high - low) / 2
        effects.append(Effect(kind, places, text, *np.sort([value(low), value(high)], axis=0)))
    drawn = [one.whole for one in assumptions if one.whole is not None]
    left = LEFT * (1 - np.minimum(np.abs(added(np.sum(drawn, axis=0))), 1.0)) if drawn else np.full(n, LEFT)
    spread[NO_GROUP] = left
    spread = {group: COVERAGE * width for group, width in spread.items()}
    half = np.sqrt(sum(width**2 for width in spread.values()))
    low = middle - half
    # sums end where all assumptions at their least multiply
    low = np.where(low < STIFF, np.maximum(low, np.minimum(least / (1 + left) - 1, STIFF)), low)
    ends = np.sort([value(low), value(middle + half)], axis=0)
    is_uncovered = sum((members.share for members in unknown), np.zeros(n)) >= UNCOVERED
    ends[:, is_uncovered] = np.nan
    reasons = tuple(
        max(unknown, key=lambda members: members.share[k]).reason if is_uncovered[k] else "" for k in range(n)
    )
    effects.sort(key=lambda effect: -float(np.abs([effect.low, effect.high]).max(initial=0.0)))
    return ModelError(ends[0], ends[1], reasons, tuple(effects), tuple(unknown), middle, spread)
