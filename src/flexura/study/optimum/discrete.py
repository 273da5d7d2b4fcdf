"""Variables that take some values alone: every combination where there are few, else those around the optimum."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, islice, product
from math import prod

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.deadline import Listener, Progress, unheard
from flexura.study.optimum.climb import FEASIBLE, Method, Solved, best_of, is_better
from flexura.study.optimum.landscape import Box, FailedDesign, Landscape, Sample
from flexura.study.optimum.rows import Designs, Point

Levels = tuple[int, ...]

FEW, FEW_ALONE = 24, 20_000
"""Combinations that are all solved, and that are all worked out where nothing else varies."""

CERTIFIED = 1e-3
"""How far values of many designs at once may be from those of full order, over their scale."""

TIES = 64
"""Designs as good within `CERTIFIED` of which the best is told by their values of full order."""

BLOCK = 256
"""Designs that are worked out at once."""


@dataclass(frozen=True)
class Fixed:
    """Designs of which the variables at places `at` have `values`, seen as those of the others alone."""

    designs: Designs
    at: NDArray[np.intp]
    fixed: Array
    others: NDArray[np.intp]

    def values(self, x: Array) -> tuple[Array, Sequence[str]]:
        """Quantities (N, q) of designs (N, others), and why each has none."""
        return self.designs.values(self.whole(x))

    def point(self, x: Array) -> Point:
        """Quantities of one design and their slopes by the others. Raises FlexuraError when it fails."""
        found = self.designs.point(self.whole(x))
        spaces = tuple(own[..., self.others] for own in found.directional)
        return found._replace(slope=found.slope[:, self.others], directional=spaces)

    def whole(self, x: Array) -> Array:
        """All variables (..., P) where the others have values (..., others)."""
        found = np.empty((*x.shape[:-1], len(self.at) + len(self.others)))
        found[..., self.at], found[..., self.others] = self.fixed, x
        return found


@dataclass(frozen=True)
class Chosen:
    """The best design over all variables `x` (P,): what was solved with the discrete ones held (None where nothing
    else varies), how it was found in a sentence, and whether no other combination can be better."""

    x: Array
    solved: Solved | None
    land: Landscape
    said: str
    is_every: bool


@dataclass(frozen=True)
class Mixed:
    """A landscape of which the variables at places `at` take ascending `levels` alone; `known` (N, q) are quantities of
    the designs that searches start from."""

    land: Landscape
    at: NDArray[np.intp]
    levels: tuple[Array, ...]
    known: Array = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def others(self) -> NDArray[np.intp]:
        """Places of the variables that are continuous."""
        return np.setdiff1d(np.arange(len(self.land.box.names)), self.at)

    @property
    def count(self) -> int:
        """How many combinations there are."""
        return prod(len(own) for own in self.levels)

    def values(self, chosen: Levels) -> Array:
        """Values (discrete,) of a combination."""
        return np.array([own[k] for own, k in zip(self.levels, chosen, strict=True)])

    def held(self, chosen: Levels) -> tuple[Landscape, Fixed]:
        """The landscape of the other variables at a combination; it counts together with the whole one."""
        box, others = self.land.box, self.others
        fixed = Fixed(self.land.designs, self.at, self.values(chosen), others)
        own = Box(tuple(box.names[k] for k in others), box.low[others], box.high[others])
        return replace(self.land, designs=fixed, box=own, evaluations=0, tried=0, _latest={}), fixed

    def nearest(self, x: Array) -> Levels:
        """The combination whose levels are nearest to values (P,)."""
        return tuple(int(np.abs(own - x[k]).argmin()) for own, k in zip(self.levels, self.at, strict=True))

    def beside(self, chosen: Levels) -> Iterator[Levels]:
        """Combinations with one or two discrete variables a level up or down."""
        for size in (1, 2):
            for moved in combinations(range(len(chosen)), min(size, len(chosen))):
                for steps in product((-1, 1), repeat=len(moved)):
                    own = list(chosen)
                    for k, step in zip(moved, steps, strict=True):
                        own[k] += step
                    if all(0 <= own[k] < len(self.levels[k]) for k in moved):
                        yield tuple(own)


def chosen_alone(mixed: Mixed, starts: Array, told: Listener = unheard) -> Chosen | None:
    """The best combination where nothing else varies: of all, or where no neighbour of it is better; None where all
    failed."""
    if mixed.count <= FEW_ALONE:
        every = product(*(range(len(own)) for own in mixed.levels))
        found = _best_among(mixed, every, told=told)
        said = f"all {mixed.count} combinations were worked out"
        return None if found is None else Chosen(mixed.values(found), None, mixed.land, said, True)
    known: dict[Levels, tuple[float, float]] = {}
    best: Levels | None = None
    for start in starts:
        at = _best_among(mixed, [mixed.nearest(start)], known)
        while at is not None:
            better = _best_among(mixed, [at, *mixed.beside(at)], known)
            if better == at:
                break
            at = better
        both = [own for own in (best, at) if own is not None]
        best = _best_among(mixed, both, known) if both else None
    said = f"{len(known)} of {mixed.count} combinations were worked out: no step in one or two of them is better"
    return None if best is None else Chosen(mixed.values(best), None, mixed.land, said, False)


def _best_among(
    mixed: Mixed,
    some: Sequence[Levels] | Iterator[Levels],
    known: dict[Levels, tuple[float, float]] | None = None,
    told: Listener = unheard,
) -> Levels | None:
    """The best of some combinations; the first of those that are as good."""
    judged: dict[Levels, tuple[float, float]] = {}
    waiting, done = iter(some), 0
    while block := list(islice(waiting, BLOCK)):
        told(Progress("combinations", done, mixed.count))
        done += len(block)
        new = [own for own in block if known is None or own not in known]
        x = np.array([mixed.values(own) for own in new]).reshape(len(new), len(mixed.levels))
        goals, missed = mixed.land.many(x) if new else (np.empty(0), np.empty(0))
        found = dict(zip(new, zip(goals.tolist(), missed.tolist(), strict=True), strict=True))
        if known is not None:
            known |= found
            found = {own: known[own] for own in block}
        judged |= {own: both for own, both in found.items() if np.isfinite(both).all()}
    return _best_in_full(mixed, judged)


def _best_in_full(mixed: Mixed, judged: dict[Levels, tuple[float, float]]) -> Levels | None:
    """The best of combinations by values of full order, where goals and violations are known but for `CERTIFIED`."""

    def rank(own: Levels) -> tuple[bool, float]:
        goal, violation = judged[own]
        return violation <= CERTIFIED, goal if violation <= CERTIFIED else -violation

    ranked = sorted(judged, key=rank, reverse=True)
    best: tuple[Levels, Sample] | None = None
    for own in ranked[:TIES]:
        if best is not None:
            feasible = best[1].violation <= FEASIBLE
            least = feasible, (best[1].goal if feasible else -best[1].violation) - CERTIFIED
            if rank(own) < least:
                break
        try:
            sample = mixed.land.at(mixed.land.box.positions(mixed.values(own)))
        except FailedDesign:
            continue
        if best is None or is_better(sample, best[1]):
            best = own, sample
    return best[0] if best is not None else next(iter(ranked), None)


def chosen_with_others(mixed: Mixed, starts: Array, method: Method, told: Listener = unheard) -> Chosen | None:
    """The best combination and the best values of the continuous variables with it; None where all failed."""
    known: dict[Levels, Solved | None] = {}

    def solved(chosen: Levels, x: Array) -> Solved | None:
        if chosen not in known:
            land, _ = mixed.held(chosen)
            known[chosen] = best_of(land, list(land.box.positions(x[:, mixed.others])), method)
            mixed.land.evaluations += land.evaluations
        return known[chosen]

    relaxed = None
    if mixed.count <= FEW:
        for k, combination in enumerate(product(*(range(len(own)) for own in mixed.levels))):
            told(Progress("combinations", k, mixed.count))
            solved(combination, starts)
        said = f"each of {mixed.count} combinations was solved"
    else:
        relaxed = best_of(mixed.land, list(mixed.land.box.positions(starts)), method, told)
        if relaxed is None:
            return None
        first = mixed.land.box.values(relaxed.best.z)
        _descend(mixed, mixed.nearest(first), first, solved, known)
        said = f"{len(known)} of {mixed.count} combinations were solved: no step in one or two of them is better"
    best = _best_known(known)
    if best is None:
        return None
    found = known[best]
    assert found is not None
    land, fixed = mixed.held(best)
    if relaxed is not None and relaxed.is_feasible:
        lost = relaxed.best.goal - found.best.goal
        said += f"; between its levels the goal would be better by {100 * max(lost, 0.0):.3g} % of its size"
    return Chosen(fixed.whole(land.box.values(found.best.z)), found, land, said, mixed.count <= FEW)


def _descend(
    mixed: Mixed,
    at: Levels,
    x: Array,
    solved: Callable[[Levels, Array], Solved | None],
    known: dict[Levels, Solved | None],
) -> None:
    """Solve neighbours until none is better than the combination that they are around."""
    solved(at, x[None])
    while True:
        around = list(mixed.beside(at))
        for own in around:
            solved(own, x[None])
        better = _best_known({own: known[own] for own in (at, *around)})
        if better is None or better == at:
            return
        at, found = better, known[better]
        assert found is not None
        x = mixed.held(at)[1].whole(mixed.held(at)[0].box.values(found.best.z))


def _best_known(known: dict[Levels, Solved | None]) -> Levels | None:
    best: Levels | None = None
    for own, found in known.items():
        if found is None:
            continue
        other = None if best is None else known[best]
        if other is None or is_better(found.best, other.best):
            best = own
    return best
