"""What a wish comes to: mechanisms, best first, each with what it does of what is required."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.errors import Diagnostic
from flexura.records import Record
from flexura.results import Tabular
from flexura.screws import ScrewSpace
from flexura.study.requirements import Requirement
from flexura.tables import Facts, Item, Line, counted, number, quantity, signed_percent


@dataclass(frozen=True, repr=False)
class Candidate(Record):
    """A mechanism that was found: its `file` in the folder, its `topology` in words, and its `freedoms` in short, such
    as `2R1T`.

    `limbs` hold it, with `over` constraints more than are needed. `gap` is how many times as compliant its stiffest
    freedom is as its softest constraint, at rest or at an end of the stroke, where it is least, rotations counted
    at a quarter of the larger edge of the envelope, and `least_gap` what it is to be; `first_hz` and `mass` (kg)
    are those of the mechanism, and `requirements` have their verdicts, those over strokes among them. `clashes` are
    solids that meet, at rest or over the stroke, or are beyond the envelope, in words. `made` are files beside it
    for making it, and `not_made` says why there are no others; both are empty where nothing was tried.
    """

    _shown = ("file", "topology", "freedoms")

    file: str
    topology: str
    freedoms: str
    limbs: int
    over: int
    gap: float
    least_gap: float
    first_hz: float
    mass: float
    requirements: tuple[Requirement, ...]
    clashes: tuple[str, ...] = ()
    made: tuple[str, ...] = ()
    not_made: tuple[str, ...] = ()

    @property
    def n_met(self) -> int:
        """How many requirements are met; freedoms that are apart from constraints and solids that are apart from each
        other count as one each."""
        return (
            sum(own.verdict == "met" for own in self.requirements) + (self.gap >= self.least_gap) + (not self.clashes)
        )

    @property
    def gap_text(self) -> str:
        """Its gap in words."""
        return "a gap that is not known" if np.isnan(self.gap) else f"a gap of {number(self.gap, 3)}"

    @property
    def meets_all(self) -> bool:
        """Whether all requirements are met, freedoms are apart from constraints, and solids from each other."""
        return self.n_met == len(self.requirements) + 2

    @property
    def least_margin(self) -> float:
        """The least of the margins of the requirements, over the size of their limits, and of the logarithm of the gap
        over ten."""
        return min([*map(margin_of, self.requirements), float(np.log(max(1e-300, self.gap) / self.least_gap))])


def margin_of(own: Requirement) -> float:
    """How far a requirement is met over the size of its limit, wherever the part is; minus infinity where nothing is
    known."""
    return -np.inf if np.isnan(own.least_margin) else own.least_margin


@dataclass(frozen=True, repr=False)
class WholeCandidateMode(Record):
    """A mode of the part as one solid: `frequency_hz`, its counterpart in the described model, `described_hz`, and by
    what relative `difference` that is off. The part is expected from `low` to `high` beside what is described, relative
    (the model error); `is_within` says whether the solid lies there. None where there is no counterpart."""

    _shown = ("frequency_hz", "difference")

    frequency_hz: float
    described_hz: float | None
    difference: float | None
    low: float | None
    high: float | None
    is_within: bool | None


@dataclass(frozen=True, repr=False)
class WholeCandidate(Record):
    """The winner, by its `file`, as one solid beside its description, as `verify` with `whole` has it: modes, `seconds`
    that they took, and `notes`, among them why there are none where that is so."""

    _shown = ("file", "modes")

    file: str
    modes: tuple[WholeCandidateMode, ...]
    seconds: float
    notes: tuple[str, ...] = ()

    @property
    def said(self) -> str:
        """What came of it, in a sentence."""
        known = [own for own in self.modes if own.is_within is not None]
        if not known:
            return f"{self.file}: {self.notes[-1] if self.notes else 'no mode has a counterpart in its solid'}"
        within = sum(bool(own.is_within) for own in known)
        worst = max((own.difference or 0.0 for own in known), key=abs)
        return (
            f"{self.file} as one solid: {within} of {counted(len(known), 'mode')} within the model error, the described"
            f" ones off by at most {signed_percent(worst)} (worked out in {quantity(self.seconds, 's', 2)})"
        )


@dataclass(frozen=True, repr=False)
class Candidates(Tabular):
    """Mechanisms that were found for a wish, best first.

    `n_topologies` were listed, `n_at_rest` of them worked out in `n_designs` designs at rest. `ruled_out` counts by
    requirement the topologies that miss it at rest in the best design that was found; `freedoms` there are those whose
    freedoms and constraints are less than ten times apart. `whole` is the first candidate as one solid, where that was
    asked for.
    """

    _shown = ("name", "freedoms", "candidates")

    name: str
    freedoms: str
    n_topologies: int
    n_at_rest: int
    n_designs: int
    candidates: tuple[Candidate, ...]
    ruled_out: Mapping[str, int]
    notes: tuple[str, ...] = ()
    whole: WholeCandidate | None = None

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """A warning where no candidate meets all requirements, with the nearest miss."""
        best = self.candidates[0] if self.candidates else None
        if best is None or best.meets_all:
            return ()
        most = max(self.ruled_out.values())
        names = [name for name, count in self.ruled_out.items() if count == most] if most else []
        missed = [own for own in best.requirements if own.verdict != "met"]
        nears = [f"{own.name}: {own.state} ({own.text})" for own in missed]
        if not best.gap >= best.least_gap:
            nears.append(f"freedoms: {best.gap_text}, and not {best.least_gap:g}")
        if best.clashes:
            nears.append(best.clashes[0])
        near = ", ".join(nears)
        text = (
            f"no design meets all requirements; the nearest, {best.file}, misses {near};"
            f" most topologies are ruled out at rest by {' and '.join(names) or 'nothing'}: {most} of {self.n_at_rest}"
        )
        return (Diagnostic("limit", best.file, float(best.n_met), float(len(best.requirements) + 2), "1", text),)

    def _title(self) -> str:
        return f"{self.freedoms}: {counted(len(self.candidates), 'candidate')} of {self.n_topologies} topologies"

    def presentation(self) -> Iterator[Item]:
        yield Facts(
            {
                "topologies": f"{self.n_topologies}, {self.n_at_rest} of them at rest in {self.n_designs} designs",
                "ruled out at rest": ", ".join(f"{name} {count}" for name, count in self.ruled_out.items() if count),
            }
        )
        yield from super().presentation()
        if self.whole is not None:
            yield Line(self.whole.said)

    def _columns(self) -> dict[str, Any]:
        own = self.candidates
        names = [each.name for each in own[0].requirements] if own else []
        columns: dict[str, Any] = {
            "design": [c.file.removeprefix("candidate-").removesuffix(".yaml") for c in own],
            "held by": [c.topology for c in own],
            "freedoms": [c.freedoms for c in own],
            "over-constraints": [c.over for c in own],
            "gap": [number(c.gap, 3) for c in own],
            "f1": [quantity(c.first_hz, "Hz", 4) for c in own],
            "mass": [quantity(c.mass, "kg", 3) for c in own],
        }
        for k, name in enumerate(names):
            columns[name] = [_short(c.requirements[k]) for c in own]
        return columns


def _short(own: Requirement) -> str:
    return own.verdict if np.isnan(own.value) else f"{own.verdict}: {quantity(own.value, own.unit, 4)}"


def freedoms_in_short(space: ScrewSpace) -> str:
    """Such as `2R1T`: rotations, screws (H) and translations that span a space."""
    screws = space.simplest()
    counts = [
        ("R", sum(own.pitch == 0 for own in screws)),
        ("H", sum(own.pitch != 0 and np.isfinite(own.pitch) for own in screws)),
        ("T", sum(bool(np.isinf(own.pitch)) for own in screws)),
    ]
    return "".join(f"{count}{letter}" for letter, count in counts if count) or "none"
