"""What double precision cannot hold is refused, by name, before any solver meets it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexura.errors import ModelError, Path, Problem
from flexura.mechanism import TOP
from flexura.structure.design import Design
from flexura.structure.part import PartMatrices
from flexura.structure.plan import Plan

RULE = "stiffness or mass is not finite: sizes here lie further apart than double precision can hold"


def refuse_unrepresentable(design: Design) -> None:
    """Raise ModelError that names every member, body, spring and superelement with a matrix that is not finite.

    One design.
    """
    with np.errstate(all="ignore"):  # what is not finite is refused by name
        matrices = design.matrices
        found = [problem for name, own in matrices.items() for problem in _problems(design.plan, name, own)]
    if found:
        raise ModelError(found)


def _problems(plan: Plan, name: str, own: PartMatrices) -> Iterator[Problem]:
    part, prototype = plan.parts[name], plan.layout.prototypes[name]
    above: Path = () if name == TOP else ("substructures", name)
    if len(part.connectivity):
        lost = np.unique(np.nonzero(~np.isfinite(own.elements.K + own.elements.M))[0])
        for k, member in enumerate(part.members):
            if ((lost >= part.first[k]) & (lost < part.first[k + 1])).any():
                kind = "flexures" if member in prototype.flexures else "links"
                yield Problem((*above, kind, member), "", RULE, "check its sizes and their units")
    for discrete in own.discrete_elements:
        if not all(A is None or np.isfinite(A).all() for A in (discrete.K, discrete.M)):
            kind = next(kind for kind in KINDS if discrete.name in getattr(prototype, kind))
            yield Problem((*above, kind, discrete.name), "", RULE, "check its sizes and their units")


KINDS = ("bodies", "masses", "springs", "superelements", "actuators", "sensors")
"""Where a discrete element may be described."""
