"""An optimum worked out anew: the mechanism with its values, asked by the verbs, at full order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from flexura.analysis import Modes, Stroke, modes, stroke
from flexura.errors import Diagnostic, FlexuraError
from flexura.mechanism import Mechanism
from flexura.structure import Plan, plan_of
from flexura.study.optimum.asked import numbered
from flexura.study.optimum.results import Proof
from flexura.study.questions import Quantity, questions

DIFFERS = 1e-3
"""Relative difference between the search and what is worked out anew from which on it is a warning."""


@dataclass
class Anew:
    """A mechanism whose parameters are those of a design, and what the verbs say of it; `warnings` are theirs."""

    mechanism: Mechanism
    quantities: Sequence[Quantity]
    warnings: list[Diagnostic] = field(default_factory=list)
    _strokes: dict[tuple[tuple[str, float], ...], Stroke] = field(default_factory=dict)

    @cached_property
    def plan(self) -> Plan:
        """Its plan, in which the ends that corrections hold clamped are those of this design."""
        return plan_of(self.mechanism)

    @cached_property
    def modes(self) -> Modes:
        """Its modes, as many as are asked for, with proven intervals."""
        found = modes(self.plan, n=max(numbered(own) or 1 for own in self.quantities))
        self.warnings += found.warnings
        return found

    def stroke(self, own: Quantity) -> Stroke:
        """Its pose that a quantity is asked at, reached from rest."""
        if own.pose not in self._strokes:
            move = dict(own.pose)
            asked = [numbered(q) or 1 for q in self.quantities if q.pose == own.pose]
            found = stroke(self.plan, move=move, steps=2, n=max(asked))
            self._strokes[own.pose] = found
            self.warnings += found.warnings
        return self._strokes[own.pose]

    def checked(self, own: Quantity, value: float) -> Proof:
        """A quantity worked out anew by the verb that has it, or else by the mechanism with these values."""
        number = numbered(own)
        if number is not None and not own.pose:
            mode = self.modes.modes[number - 1]
            low, high = mode.interval_hz
            hz = mode.frequency_hz if mode.full_frequency_hz is None else mode.full_frequency_hz
            interval = (low, high) if mode.is_indexed and low is not None and high is not None else None
            return Proof(own.text, own.unit, value, float(hz), "modes", interval)
        if own.pose and (number is not None or own.kind == "stress"):
            found = self.stroke(own)
            if number is not None:
                pose = found.poses[-1]
                interval = pose.frequency_interval_hz[number - 1] if pose.proven else None
                return Proof(own.text, own.unit, value, pose.frequency_hz[number - 1], "stroke", interval)
            members = found.stresses(len(found.poses) - 1).members
            asked = getattr(own.arguments[0], "members", ()) if own.arguments else [m.name for m in members]
            stresses = [m.von_mises for m in members if m.von_mises is not None and m.name in asked]
            if stresses:
                return Proof(own.text, own.unit, value, max(stresses), "stroke")
        answer = questions(self.plan, own.text).values({})
        return Proof(own.text, own.unit, value, float(answer.value[0, 0]), "a plan of its own")


def proof(
    mechanism: Mechanism, values: Mapping[str, float], quantities: Sequence[Quantity], found: Mapping[str, float]
) -> tuple[tuple[Proof, ...], list[Diagnostic]]:
    """Every quantity of a design anew beside the value that was `found`, and warnings: those of the verbs, what differs
    by more than `DIFFERS` and is not within its interval, and what could not be worked out."""
    parameters = dict(mechanism.parameters)
    for name, value in values.items():
        parameters[name] = parameters[name].model_copy(update={"value": value})
    anew = Anew(mechanism.model_copy(update={"parameters": parameters}), quantities)
    proofs, missing = [], []
    for own in quantities:
        try:
            proofs.append(anew.checked(own, found[own.text]))
        except FlexuraError as error:
            text = f"{own.text} could not be worked out anew at the optimum: {error}"
            missing.append(Diagnostic("proof", own.text, float("nan"), DIFFERS, "1", text))
    for own in proofs:
        low, high = own.interval or (own.checked, own.checked)
        if own.difference > DIFFERS and not low <= own.value <= high:
            text = (
                f"{own.text} is {own.checked:.6g} {own.unit} by {own.by} and was {own.value:.6g} in the search:"
                " the optimum is that of the search, which differs"
            )
            missing.append(Diagnostic("proof", own.text, own.difference, DIFFERS, "1", text))
    return tuple(proofs), [*missing, *anew.warnings]
