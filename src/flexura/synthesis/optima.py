"""Candidates with all that is asked of them worked out, and the best of their topology within what is required."""

from __future__ import annotations

import hashlib
import re
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flexura.arrays import Array
from flexura.errors import FlexuraError
from flexura.full_order import assemble, plan_of
from flexura.mechanism import Mechanism, with_rigid_bodies
from flexura.structure import Plan
from flexura.study.optimum import climbed
from flexura.study.questions import limits_at, poses_of, questions, relation
from flexura.study.requirements import Requirement, requirements
from flexura.synthesis.drafts import draft, ends_of, with_values
from flexura.synthesis.extents import beyond_envelope, extents_of
from flexura.synthesis.result import Candidate, freedoms_in_short, margin_of
from flexura.synthesis.screening import COMPLIANCES, AtRest, bases_of, clashes_of, matrices_of
from flexura.synthesis.wish import DOFS, Room

SPARE = 0.02
"""What optima are to have to spare, over the limits, beyond what bodies that bend and model errors take."""

AMPLE = 1.0
"""By how much of its limit a requirement over a stroke is met, at least, where a search may begin without it."""

MOST_TAKEN = 0.1
"""Of a number, at most, that is put down to these: with more an optimum of rigid bodies says little."""

ACCURACY = 1e-3
"""Of the first frequency, over itself, that a step promises where a search ends."""

SAME = 1e-3
"""Change of sizes, over themselves, from one search to the next that is none."""

OVER_STROKE = " over stroke"

ROUNDS = 4
"""Searches of an optimum, at most, each with limits moved by what is known of the last one."""

SECONDS = 60.0
"""Seconds for an optimum."""


@dataclass(frozen=True, eq=False)
class Judged:
    """A design of a topology, by its number, with its requirements worked out over strokes, with bodies that bend."""

    number: int
    mechanism: Mechanism
    candidate: Candidate

    @property
    def rank(self) -> tuple[float, float]:
        """First those that meet the most, of these those that meet them by the most."""
        return -self.candidate.n_met, -self.candidate.least_margin

    @property
    def sizes(self) -> Array:
        """Values (p,) of its parameters."""
        values = (own.value for own in self.mechanism.parameters.values())
        return np.array([float(x) for x in values])  # type: ignore[arg-type]

    @property
    def key(self) -> str:
        """A name for its topology and sizes."""
        return hashlib.sha256(f"{self.number} {self.sizes.tolist()}".encode()).hexdigest()[:16]


def judged(of: AtRest, number: int, values: Array) -> Judged:
    """A design of a topology, by the values of its parameters in their order."""
    own = of.listed[number]
    mechanism = draft(own, of.file, of.room, f"{of.file.name}, {own.name}")
    mechanism = with_values(mechanism, dict(zip(mechanism.parameters, values, strict=True)))
    plan = plan_of(mechanism)
    found = requirements(plan) if mechanism.requirements else None
    asked = questions(plan, "f1, mass").values({}).value[0]
    sizes = {name: np.array([float(p.value)]) for name, p in mechanism.parameters.items()}  # type: ignore[arg-type]
    meeting = [] if found is None else [own.text for own in found.limits if own.kind == "contact"]
    ends = ends_of(of.file.wish, of.room)
    if not any(" over " in text for text in mechanism.requirements.values()):
        meeting += _meeting_at(plan, ends)
    return Judged(
        number,
        mechanism,
        Candidate(
            file="",
            topology=own.name,
            freedoms=freedoms_in_short(of.room.freedoms),
            limbs=own.n_limbs,
            over=own.over,
            gap=float(of.gaps(own, plan, sizes, ends)[0]),
            least_gap=of.file.wish.gap,
            first_hz=float(asked[0]),
            mass=float(asked[1]),
            requirements=() if found is None else found.requirements,
            clashes=(*clashes_of(mechanism), *meeting, *beyond_envelope(assemble(plan), of.room)),
        ),
    )


def _meeting_at(plan: Plan, poses: Sequence[str]) -> Iterator[str]:
    """What meets at poses, in words."""
    for text in poses:
        for pose in poses_of(plan, {}, questions(plan, f"compliance(about.x) at {text}").quantities[0]):
            yield from (own.text for own in limits_at(plan, {}, pose) if own.kind == "contact")


@dataclass(frozen=True)
class Optima:
    """The highest first frequency of topologies within what is required, each from a design: what a worker is sent.

    A block has the `values` of an optimum, none, empty, where nothing is better, and whether the search `ended` in its
    time, or has the best so far.
    """

    at_rest: AtRest
    begun: tuple[Judged, ...]

    @property
    def blocks(self) -> int:
        """How many there are."""
        return len(self.begun)

    def designs(self, *numbers: int) -> str:
        """Topologies in words."""
        return self.at_rest.designs(*(self.begun[n].number for n in numbers))

    def __call__(self, number: int) -> dict[str, Array]:
        """The optimum from a design. Where what bodies that bend and model errors take is another there, limits are
        moved anew, and the search goes on from there. What is amply met over the stroke, which takes the most time, is
        asked of what comes out alone."""
        best = last = self.begun[number]
        ended, end = True, time.monotonic() + SECONDS
        for _ in range(ROUNDS):
            try:
                values, ended = self._from(last, end - time.monotonic())
                before, last = last.sizes, judged(self.at_rest, best.number, values)
            except FlexuraError:
                break
            if last.rank < best.rank:
                best = last
            elif best.candidate.meets_all:
                break
            if not ended or np.allclose(last.sizes, before, rtol=SAME, atol=0.0):
                break
        found = best.sizes if best is not self.begun[number] else np.array([])
        return {"values": found, "ended": np.array(ended)}

    @staticmethod
    def _ample(own: Judged) -> set[str]:
        """Names of requirements over strokes that are amply met."""
        return {each.name for each in own.candidate.requirements if " over " in each.text and margin_of(each) > AMPLE}

    def _at_ends(self, own: Judged, text: str) -> list[str]:
        """What is asked over the stroke as asked at its ends, where members are known one by one; not of what is led
        by its stacks."""
        by_stacks = self.at_rest.listed[own.number].drive is not None
        ends = [] if by_stacks else ends_of(self.at_rest.file.wish, self.at_rest.room)
        asked = text.removesuffix(OVER_STROKE)
        return [f"{asked} at {end}" for end in ends] if ends and asked != text else [text]

    def _from(self, own: Judged, seconds: float) -> tuple[Array, bool]:
        """Where a search from a design leads to, within what is required but for what is amply met over the stroke,
        and whether it came to its end. Raises FlexuraError."""
        stiff = with_rigid_bodies(own.mechanism)
        rigid = requirements(stiff).requirements if stiff.requirements else ()
        pairs = zip(own.candidate.requirements, rigid, strict=True)
        left_out = self._ample(own)
        limits = [with_spare(stiff, bending, of.value) for bending, of in pairs if bending.name not in left_out]
        limits = [each for text in limits for each in self._at_ends(own, text)]
        topology, sizes = self.at_rest.listed[own.number], dict(zip(stiff.parameters, own.sizes, strict=True))
        bare = self.at_rest.without_stacks(topology)
        bare = with_values(bare, {name: sizes[name] for name in bare.parameters})
        extents = extents_of(topology, self.at_rest.room, stiff)
        found, ended = climbed(
            stiff,
            maximise="f1",
            subject_to=limits,
            within=extents.limits(),
            besides=(bare, apart(bare, own.candidate.gap, self.at_rest.file.wish.gap, self.at_rest.room)),
            accuracy=ACCURACY,
            seconds=max(seconds, 1.0),
        )
        values = np.array([[found[name] for name in stiff.parameters]])
        return extents.within(own.sizes, values)[0], ended  # limits that are not linear in steps may be left a little


def with_spare(rigid: Mechanism, own: Requirement, promised: float) -> str:
    """A requirement as one of a mechanism with rigid bodies, which promises some value of what is worked out of a
    design: with its limit moved by what bodies that bend and model errors take of that, and something to spare."""
    asked = relation(rigid, own.text)
    _, _, is_below = asked.sides
    low, high = own.model_error or (0.0, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = float(np.divide(own.value, promised)) * (1 + (high if is_below else low))
    factor = 1.0
    if own.limit > 0 and np.isfinite(share) and share > 0:
        factor = (1 - SPARE if is_below else 1 + SPARE) / float(np.clip(share, MOST_TAKEN, 1 / MOST_TAKEN))
    sign = ">=" if ">=" in own.text else "<="
    left, right = own.text.split(sign)
    right, *where = re.split(r"(?= (?:over|at|under) )", right, maxsplit=1)
    left, right = left.strip(), right.strip()
    sides = [left, f"{factor:.6g}*({right})"] if asked.right.is_constant else [f"{factor:.6g}*({left})", right]
    return f"{sides[0]} {sign} {sides[1]}{''.join(where)}"


def apart(bare: Mechanism, gap: float, least: float, room: Room) -> list[str]:
    """That each freedom is so many times as compliant as each constraint, along principal directions of a design
    with rigid bodies and without stacks; and by as many times more as its `gap` is less than what that promises."""
    free, rest, scale = bases_of(room)
    C = matrices_of(questions(plan_of(bare), COMPLIANCES).values({}).value)[0] * scale[:, None] * scale
    (soft, R), (stiff, S) = (np.linalg.eigh(basis.T @ C @ basis) for basis in (free, rest))
    taken = soft.min(initial=np.inf) / stiff.max(initial=0.0) / gap
    most = least * (1 + SPARE) * (float(np.clip(taken, 1.0, 1 / MOST_TAKEN)) if np.isfinite(taken) else 1.0)
    a, b = ([_compliance(own * scale) for own in basis.T] for basis in (free @ R, rest @ S))
    return [f"({one})/({other}) >= {most:g}" for one in a for other in b]


def _compliance(v: Array) -> str:
    """Displacement along a motion (6,) of the point of the wish, rotations in m, by a unit load along it."""
    terms = [(i, j, float(v[i] * v[j]) * (2 if i < j else 1)) for i in range(6) for j in range(i, 6)]
    most, units = max(abs(c) for *_, c in terms), ("", " m", " m^2")
    return " + ".join(
        f"({c:.9g}{units[(i > 2) + (j > 2)]})*compliance(about.{DOFS[i]}, about.{DOFS[j]})"
        for i, j, c in terms
        if abs(c) > 1e-9 * most
    )
