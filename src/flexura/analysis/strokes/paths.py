"""The ways of a stroke from rest: prescribed displacements one after another, or loads by arc length, and where a way
ends, turns back, forks or is broken off."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from flexura.analysis.strokes.pose import Asked, Measured, measured
from flexura.analysis.strokes.ways import Course
from flexura.deadline import Listener, OutOfTime, Progress
from flexura.errors import Diagnostic, SolverError
from flexura.motion import (
    NO_LOADS,
    Along,
    Arc,
    Equations,
    Equilibrium,
    Lost,
    Path,
    Point,
    Stopped,
    unstable,
    why_it_ends,
)

INTERRUPTED = "interrupted"

LONGEST = 60
"""Steps by arc length for each pose that is asked for, after which a way is given up."""

BEYOND = 1.0
"""How far a share may turn back beyond the ends of a way before this is given up."""


class Found(NamedTuple):
    """A state of a stroke with what is worked out there, at a share of the way."""

    state: Equilibrium
    share: float
    measured: Measured

    def without_mesh_error(self) -> Found:
        """Where a stiffness vanishes, it is off by any factor however fine the mesh."""
        return self._replace(measured=self.measured._replace(pose=replace(self.measured.pose, mesh_error={})))


@dataclass
class Followed:
    """States in the order of the stroke, what ended its ways and in which states, where these turn back or fork, and
    what broke them off."""

    before: list[Found] = field(default_factory=list)
    after: list[Found] = field(default_factory=list)
    stopped: list[str] = field(default_factory=list)
    ended: list[Equilibrium] = field(default_factory=list)
    critical: list[Diagnostic] = field(default_factory=list)
    broken: BaseException | None = None

    @property
    def found(self) -> list[Found]:
        """All states in the order of the stroke."""
        return [*reversed(self.before), *self.after]


def follow(equations: Equations, planned: Course, asked: Asked, branch: int, progress: Listener | None) -> Followed:
    """The states of a stroke, with what is worked out there. What was found stays when it is interrupted.

    Raises SolverError where there is no state of rest, and what interrupted it when nothing was found.
    """
    out = Followed()
    try:
        _Follower(equations, planned, asked, branch, progress, out).run()
    except (KeyboardInterrupt, OutOfTime) as error:
        if not out.found:
            raise
        out.broken = error
        why = str(error) if isinstance(error, OutOfTime) else INTERRUPTED
        out.stopped.append(f"{why} after {len(out.found)} of {len(planned.shares)} poses: the others are missing")
    return out


@dataclass
class _Follower:
    """Goes the ways of a stroke and writes down what it finds."""

    equations: Equations
    planned: Course
    asked: Asked
    branch: int
    progress: Listener | None
    out: Followed

    def run(self) -> None:
        nearest, shares = self.planned.nearest, self.planned.shares
        start = self._rest()
        first = self._to_first(start, float(shares[nearest]))
        if first is None:
            return
        for own, numbers in ((self.out.after, range(nearest, len(shares))), (self.out.before, range(nearest, -1, -1))):
            if own is self.out.after:
                self._note(own, first, float(shares[nearest]))
            if len(numbers) < 2:
                continue
            if self.planned.is_loaded or self.branch:
                self._along(own, first, [float(shares[k]) for k in numbers])
            else:
                self._prescribed(own, first, [float(shares[k]) for k in numbers])

    def _note(self, own: list[Found], state: Equilibrium, share: float) -> None:
        """Write a state down."""
        own.append(Found(state, share, measured(self.equations, state, self.planned.at(share), self.asked)))
        if self.progress is not None:
            done = len(self.out.before) + len(self.out.after)
            self.progress(Progress("poses", done, max(done, len(self.planned.shares))))

    def _rest(self) -> Equilibrium:
        """The state with nothing moved and the loads on that do not change. Raises SolverError where there is none."""
        rest = self.planned.rest
        start = self.equations.at_rest()
        if not rest.loads.any:
            return start
        state = next(iter(Path(self.equations, start, Point(rest.targets, NO_LOADS)).through([rest])))
        if isinstance(state, Stopped):
            part = 100 * state.share
            raise SolverError(f"the loads are too large: no equilibrium is found beyond {part:.3g} % of them")
        return state

    def _to_first(self, start: Equilibrium, share: float) -> Equilibrium | None:
        """The state of the pose that is nearest to rest."""
        state = next(iter(Path(self.equations, start, self.planned.rest).through([self.planned.point(share)])))
        if isinstance(state, Stopped):
            self._end(state.last, self.planned.words(share, state.share), self.planned.words(share))
            return None
        return state

    def _prescribed(self, own: list[Found], first: Equilibrium, shares: list[float]) -> None:
        """States at shares of the way, the first of which is there."""
        path = Path(self.equations, first, self.planned.point(shares[0]))
        last, last_share, count = first, shares[0], self._count(own or self.out.after)
        for share, state in zip(shares[1:], path.through([self.planned.point(k) for k in shares[1:]]), strict=False):
            if isinstance(state, Stopped):
                part = last_share + state.share * (share - last_share)
                self._end(state.last, self.planned.words(part), self.planned.words(share))
                return
            self._note(own, state, share)
            now = self._count(own)
            if now != count:
                self._fork_between(last, last_share, state, share)
            last, last_share, count = state, share, now

    @staticmethod
    def _count(own: list[Found]) -> int:
        """How many ways of buckling there are, actuators locked, at the state that was written down last."""
        found = own[-1] if len(own) else None
        return 0 if found is None else sum(hertz < 0 for hertz in found.measured.pose.frequency_hz_held)

    def _fork_between(self, one: Equilibrium, low: float, other: Equilibrium, high: float) -> None:
        """Tell of a bifurcation between two states of prescribed displacements."""
        arc = Arc(self.equations, self.planned.first, self.planned.last, one)
        sense = float(np.sign(high - low))
        at, there = arc.start(one, low, sense), arc.start(other, high, sense)
        try:
            share = arc.fork(at, there).share
            where = f"at {self.planned.words(share)}"
        except SolverError:
            where = f"between {self.planned.words(low)} and {self.planned.words(high)}"
        self._fork(where)

    def _fork(self, where: str) -> None:
        followed = "the buckled path is followed"
        rest = followed if self.branch else "branch = 1 or -1 follows the buckled path to either side"
        text = f"bifurcation {where}: another path of equilibria branches off, as in buckling; {rest}"
        self.out.critical.append(Diagnostic("bifurcation", "", np.nan, np.nan, "1", text))

    def _along(self, own: list[Found], first: Equilibrium, shares: list[float]) -> None:
        """States by arc length wherever the way comes by one of the shares, and where the share turns back."""
        sense, spacing = float(np.sign(shares[-1] - shares[0])), abs(shares[1] - shares[0])
        arc = Arc(self.equations, self.planned.first, self.planned.last, first)
        at = arc.start(first, shares[0], sense)
        branch, steps = self.branch, arc.through(at, spacing)
        try:
            for _ in range(LONGEST * len(shares)):
                there = next(steps)
                if isinstance(there, Lost):
                    break
                for crossed in self._crossed(arc, at, there, spacing, shares):
                    self._note(own, crossed.state, crossed.share)
                    if crossed.share == shares[-1]:
                        return
                at = there
                if there.kind == "limit":
                    self._note(own, there.state, there.share)
                    own[-1] = own[-1].without_mesh_error()
                    self._turn(there)
                if there.kind == "fork":
                    self._fork(f"at {self.planned.words(there.share)}")
                    if branch:
                        steps, branch = arc.through(arc.branched(there, branch), spacing), 0
                if (there.share - shares[-1]) * sense < -abs(shares[-1] - shares[0]) - BEYOND:
                    break
        except SolverError:
            pass
        self._end(at.state, self.planned.words(at.share), self.planned.words(shares[-1]))

    def _crossed(self, arc: Arc, at: Along, there: Along, spacing: float, shares: list[float]) -> Iterator[Along]:
        """The states between two at which the share is one that is asked for, or as far from these beyond them."""
        origin, sense = shares[0], np.sign(there.share - at.share)
        if not sense:
            return
        low, high = ((own.share - origin) / spacing for own in (at, there))
        first = np.floor(low) + 1 if sense > 0 else np.ceil(low) - 1
        for k in np.arange(first, high + sense * 1e-12, sense):
            share = next((own for own in shares if abs(own - origin - k * spacing) < 1e-9), origin + k * spacing)
            if abs(share - at.share) > 1e-9:
                yield arc.at(at, there, float(share))

    def _turn(self, at: Along) -> None:
        where = self.planned.words(at.share)
        text = f"limit point at {where}: the path parameter turns back, beyond it the mechanism snaps"
        self.out.critical.append(Diagnostic("limit point", "", at.share, np.nan, "1", text))

    def _end(self, last: Equilibrium, at: str, aim: str) -> None:
        """Tell where a way ends, and why as far as that is known."""
        self.out.ended.append(last)
        stable = "unstable" if unstable(self.equations, last) else "stable"
        self.out.stopped.append(
            f"no equilibrium is found beyond {at}, on the path to {aim}: there it is {stable};"
            f" {why_it_ends(self.equations, last)}"
        )
