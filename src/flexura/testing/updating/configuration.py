"""Mechanisms that are calibrated together: each with its data, sharing the parameters of the same names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from flexura.errors import OptionError
from flexura.mechanism import Mechanism, Parameter
from flexura.sensitivity import free_names
from flexura.structure import Plan, plan_of
from flexura.testing.updating.targets import Target


@dataclass(frozen=True)
class Configuration:
    """A mechanism with what was measured on it, under a `label` that no other has.

    `bounded` has the parameters' bounds, `plan` has none. Of the parameters `free` are moved, `fixed` ones replaced.
    """

    label: str
    bounded: Plan
    plan: Plan
    free: tuple[str, ...]
    fixed: Mapping[str, float]
    targets: tuple[Target, ...]

    @property
    def known(self) -> Mapping[str, Parameter]:
        """All parameters by name."""
        return self.bounded.mechanism.parameters

    def point(self, values: Mapping[str, float]) -> dict[str, float]:
        """Parameters of a design with some values of free ones, of which there may be more."""
        return {**self.fixed, **{name: values[name] for name in self.free}}

    def settled(self, mechanism: Mechanism) -> Configuration:
        """The same with its ends settled anew at the sizes of a mechanism."""
        return replace(self, plan=_unbounded(plan_of(mechanism)))


def configurations(
    pairs: Sequence[tuple[Mechanism | Plan, Sequence[Target]]], free: Sequence[str], at: Mapping[str, float]
) -> tuple[Configuration, ...]:
    """Mechanisms with their targets, of which each has those of the parameters `free` and `at` that it knows.

    Raises ModelError for a description that cannot be used, and OptionError for parameters that none knows and a
    mechanism with nothing to move.
    """
    plans = [_plan(mechanism, at) for mechanism, _ in pairs]
    known = [plan.mechanism.parameters for plan in plans]
    chosen = list(free_names(plans[0], free) if len(plans) == 1 or isinstance(free, str) else free)
    for name in chosen:
        if not any(name in own for own in known):
            free_names(plans[0], [name])
    for name, value in at.items():
        if not any(name in own for own in known):
            plans[0].verify({name: value})
    found: list[Configuration] = []
    for plan, (_, targets), own in zip(plans, pairs, known, strict=True):
        names = [n for n in chosen if n in own]
        label = plan.mechanism.name
        if chosen and not names:
            raise OptionError(f"{label} has none of the free parameters {', '.join(chosen)}: it would add nothing")
        moved = free_names(plan, names)
        values = {n: v for n, v in at.items() if n in own}
        plan.verify(values)
        fixed = {n: v for n, v in values.items() if n not in moved}
        taken = {c.label for c in found}
        label = next(s for s in (label, *(f"{label} ({k})" for k in range(2, 99))) if s not in taken)
        found.append(Configuration(label, plan, _unbounded(plan), moved, fixed, tuple(targets)))
    return tuple(found)


def _unbounded(plan: Plan) -> Plan:
    """A plan whose parameters have no bounds: a search may look beyond them on its way."""
    plan.refuse_pose("calibration")
    own = plan.mechanism
    if all(p.minimum is None and p.maximum is None for p in own.parameters.values()):
        return plan
    free = {name: p.model_copy(update={"minimum": None, "maximum": None}) for name, p in own.parameters.items()}
    return Plan(own.model_copy(update={"parameters": free}))


def _plan(mechanism: Mechanism | Plan, at: Mapping[str, float]) -> Plan:
    """The plan of a mechanism, its solid members at those of the parameters `at` that it has."""
    if isinstance(mechanism, Mechanism):
        at = {name: value for name, value in at.items() if name in mechanism.parameters}
    plan = plan_of(mechanism, at)
    plan.refuse_pose("calibration")
    return plan
