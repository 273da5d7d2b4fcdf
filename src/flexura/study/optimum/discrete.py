"""Variables that take some values alone: every combination where there are few, else those around the optimum."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, islice, product
from math import prod

import numpy as np

from flexura.arrays import Array, Index
from flexura.deadline import Listener, Progress, no_listener
from flexura.study.optimum.climb import FEASIBLE_VIOLATION, Method, Solved, best_of, is_better
from flexura.study.optimum.landscape import Box, FailedDesign, Landscape, Sample
from flexura.study.optimum.rows import Designs, Point
from flexura.thresholds import PROVEN

Levels = tuple[int, ...]
"""A combination: numbers of the levels of all discrete variables."""

FEW_SOLVED, FEW_ALONE = 24, 20_000
"""Combinations that are all solved, and that are all worked out where nothing else varies."""

MOST_TIES = 64
"""Designs as good within `PROVEN` of which the best is found by their values of full order."""

COMBINATIONS_AT_ONCE = 256
"""Designs that are worked out at once."""


@dataclass(frozen=True)
class Fixed:
    """Designs of which the variables at places `at` have `values`, seen as those of the others alone."""

    designs: Designs
    at: Index
    fixed: Array
    others: Index

    def values(self, x: Array) -> tuple[Array, Sequence[str]]:
        """Quantities (N, q) of designs (N, others), and why each has none."""
        return self.designs.values(self.whole(x))

    def point(self, x: Array) -> Point:
        """Quantities of one design and their slopes by the others. Raises FlexuraError when it fails."""
        point = self.designs.point(self.whole(x))
        spaces = tuple(matrices[..., self.others] for matrices in point.directional)
        return point._replace(slope=point.slope[:, self.others], directional=spaces)

    def whole(self, x: Array) -> Array:
        """All variables (..., P) where the others have values (..., others)."""
        whole = np.empty((*x.shape[:-1], len(self.at) + len(self.others)))
        whole[..., self.at], whole[..., self.others] = self.fixed, x
        return whole


@dataclass(frozen=True)
class Chosen:
    """The best design over all variables `x` (P,): what was solved with the discrete ones held (None where nothing
    else varies), how it was found in a sentence, and whether no other combination can be better."""

    x: Array
    solved: Solved | None
    land: Landscape
    text: str
    is_every: bool


@dataclass(frozen=True)
class Mixed:
    """A landscape of which the variables at places `at` take ascending `levels` alone; `known` (N, q) are quantities of
    the designs that searches start from."""

    land: Landscape
    at: Index
    levels: tuple[Array, ...]
    known: Array = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def others(self) -> Index:
        """Places of the variables that are continuous."""
        return np.setdiff1d(np.arange(len(self.land.box.names)), self.at)

    @property
    def count(self) -> int:
        """How many combinations there are."""
        return prod(len(values) for values in self.levels)

    def every(self) -> Iterator[Levels]:
        """All combinations."""
        return product(*(range(len(values)) for values in self.levels))

    def values(self, chosen: Levels) -> Array:
        """Values (discrete,) of a combination."""
        return np.array([values[k] for values, k in zip(self.levels, chosen, strict=True)])

    def held(self, chosen: Levels) -> tuple[Landscape, Fixed]:
        """The landscape of the other variables at a combination; it counts together with the whole one."""
        box, others = self.land.box, self.others
        fixed = Fixed(self.land.designs, self.at, self.values(chosen), others)
        free = Box(tuple(box.names[k] for k in others), box.low[others], box.high[others])
        return replace(self.land, designs=fixed, box=free, evaluations=0, tried=0, _latest={}), fixed

    def nearest(self, x: Array) -> Levels:
        """The combination whose levels are nearest to values (P,)."""
        return tuple(int(np.abs(values - x[k]).argmin()) for values, k in zip(self.levels, self.at, strict=True))

    def beside(self, chosen: Levels) -> Iterator[Levels]:
        """Combinations with one or two discrete variables a level up or down."""
        for size in (1, 2):
            for moved in combinations(range(len(chosen)), min(size, len(chosen))):
                for steps in product((-1, 1), repeat=len(moved)):
                    levels = list(chosen)
                    for k, step in zip(moved, steps, strict=True):
                        levels[k] += step
                    if all(0 <= levels[k] < len(self.levels[k]) for k in moved):
                        yield tuple(levels)


def chosen_alone(mixed: Mixed, starts: Array, report: Listener = no_listener) -> Chosen | None:
    """The best combination where nothing else varies: of all, or where no neighbour of it is better; None where all
    failed."""
    known: dict[Levels, tuple[float, float]] = {}
    best: Levels | None = None
    is_every = mixed.count <= FEW_ALONE
    if is_every:
        best = _best_among(mixed, mixed.every(), known, report)
        text = f"all {mixed.count} combinations were worked out"
    else:
        for start in starts:
            at, better = None, _best_among(mixed, [mixed.nearest(start)], known)
            while better is not None and better != at:
                at = better
                better = _best_among(mixed, [at, *mixed.beside(at)], known)
            best = _best_among(mixed, [levels for levels in (best, at) if levels is not None], known)
        text = f"{len(known)} of {mixed.count} combinations were worked out: no step in one or two of them is better"
    return None if best is None else Chosen(mixed.values(best), None, mixed.land, text, is_every)


def _best_among(
    mixed: Mixed, some: Iterable[Levels], known: dict[Levels, tuple[float, float]], report: Listener = no_listener
) -> Levels | None:
    """The best of some combinations, the first of those that are as good; goals and violations are added to those that
    are `known`, which they are but for `PROVEN`."""
    ranked, waiting = list[Levels](), iter(some)
    while block := list(islice(waiting, COMBINATIONS_AT_ONCE)):
        report(Progress("combinations", len(ranked), mixed.count))
        if new := [levels for levels in block if levels not in known]:
            goals, violations = mixed.land.many(np.array([mixed.values(levels) for levels in new]))
            known |= zip(new, zip(goals.tolist(), violations.tolist(), strict=True), strict=True)
        ranked += block

    def rank(levels: Levels) -> tuple[bool, float]:
        goal, violation = known[levels]
        return violation <= PROVEN, goal if violation <= PROVEN else -violation

    ranked = [levels for levels in dict.fromkeys(ranked) if np.isfinite(known[levels]).all()]
    ranked.sort(key=rank, reverse=True)
    best: tuple[Levels, Sample] | None = None
    for levels in ranked[:MOST_TIES]:
        if best is not None:
            feasible = best[1].violation <= FEASIBLE_VIOLATION
            if rank(levels) < (feasible, (best[1].goal if feasible else -best[1].violation) - PROVEN):
                break
        try:
            sample = mixed.land.at(mixed.land.box.positions(mixed.values(levels)))
        except FailedDesign:
            continue
        if best is None or is_better(sample, best[1]):
            best = levels, sample
    return best[0] if best is not None else next(iter(ranked), None)


def chosen_with_others(mixed: Mixed, starts: Array, method: Method, report: Listener = no_listener) -> Chosen | None:
    """The best combination and the best values of the continuous variables with it; None where all failed."""
    known: dict[Levels, Solved | None] = {}

    def solve(levels: Levels, x: Array) -> None:
        if levels not in known:
            land, _ = mixed.held(levels)
            known[levels] = best_of(land, list(land.box.positions(x[:, mixed.others])), method)
            mixed.land.evaluations += land.evaluations

    relaxed, is_every = None, mixed.count <= FEW_SOLVED
    if is_every:
        for k, levels in enumerate(mixed.every()):
            report(Progress("combinations", k, mixed.count))
            solve(levels, starts)
        text = f"each of {mixed.count} combinations was solved"
    else:
        relaxed = best_of(mixed.land, list(mixed.land.box.positions(starts)), method, report)
        if relaxed is None:
            return None
        x = mixed.land.box.values(relaxed.best.z)
        at, better = None, mixed.nearest(x)
        solve(better, x[None])
        while better is not None and better != at:  # neighbours, until none is better than what they are around
            if at is not None:
                x = _whole(mixed, better, known)
            at = better
            around = [at, *mixed.beside(at)]
            for levels in around:
                solve(levels, x[None])
            better = _best_solved({levels: known[levels] for levels in around})
        text = f"{len(known)} of {mixed.count} combinations were solved: no step in one or two of them is better"
    best = _best_solved(known)
    if best is None:
        return None
    solved = known[best]
    assert solved is not None
    if relaxed is not None and relaxed.is_feasible:
        lost = relaxed.best.goal - solved.best.goal
        text += f"; between its levels the goal would be better by {100 * max(lost, 0.0):.3g} % of its size"
    return Chosen(_whole(mixed, best, known), solved, mixed.held(best)[0], text, is_every)


def _whole(mixed: Mixed, levels: Levels, known: dict[Levels, Solved | None]) -> Array:
    """All variables (P,) of a combination that was solved."""
    (land, fixed), solved = mixed.held(levels), known[levels]
    assert solved is not None
    return fixed.whole(land.box.values(solved.best.z))


def _best_solved(known: dict[Levels, Solved | None]) -> Levels | None:
    best: tuple[Levels, Sample] | None = None
    for levels, solved in known.items():
        if solved is not None and (best is None or is_better(solved.best, best[1])):
            best = levels, solved.best
    return None if best is None else best[0]
