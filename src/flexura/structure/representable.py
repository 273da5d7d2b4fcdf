"""What double precision cannot hold is refused by name before any solver meets it; what has no slopes is named."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from flexura.duals import Dual, slope_of
from flexura.errors import ModelError, Path, Problem
from flexura.mechanism import TOP, origin_of
from flexura.structure.design import Design
from flexura.structure.part import PartMatrices
from flexura.structure.plan import Plan

ALIKE = 1e-7
"""Relative difference of slopes that is round-off."""

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
    prototype = plan.layout.prototypes[name]
    above: Path = () if name == TOP else ("substructures", origin_of(name))
    for key in _lost(plan, name, own, lambda A: A):
        kind = next(kind for kind in KINDS if key in getattr(prototype, kind))
        yield Problem((*above, kind, key), "", RULE, "check its sizes and their units")


def _lost(plan: Plan, name: str, own: PartMatrices, read: Callable[[Any], Any]) -> Iterator[str]:
    """Members and discrete elements of a prototype with matrices of which `read` finds what is not finite."""
    part = plan.parts[name]
    if len(part.connectivity):
        bad = ~np.isfinite(read(own.elements.K + own.elements.M)) | ~np.isfinite(read(own.T))
        lost = np.unique(np.nonzero(bad)[0])
        for k, member in enumerate(part.members):
            if ((lost >= part.first[k]) & (lost < part.first[k + 1])).any():
                yield member
    for discrete in own.discrete_elements:
        if not all(A is None or np.isfinite(read(A)).all() for A in (discrete.K, discrete.M)):
            yield discrete.name


def kinks(design: Design, number: int) -> list[str]:
    """Members and other parts, as described, whose matrices have no slope by the parameter with a number.

    The design is one made `with_slopes`.
    """

    def read(A: Any) -> Any:
        return slope_of(A)[number] if isinstance(A, Dual) else A

    with np.errstate(all="ignore"):
        return [
            _said(name, key) for name, own in design.matrices.items() for key in _lost(design.plan, name, own, read)
        ]


def tables_left(design: Design, number: int) -> list[str]:
    """Notches by a table, as described, whose last position does not move with the end of the member by the parameter
    with a number: they fit at this design alone, which is one made `with_slopes`."""
    found = []
    for name, part in design.plan.parts.items():
        for group, _, _ in part.table.groups:
            for last in group.table_ends(design.values):
                length = design.geometry.parts[name].length[group.index]
                one, other = (slope_of(x)[number] if isinstance(x, Dual) else 0 * x for x in (last, length))
                away = np.abs(one - other) > ALIKE * np.maximum(np.abs(one), np.abs(other))
                found += [_said(name, list(part.members)[k]) for k in group.index[away]]
    return found


def _said(prototype: str, key: str) -> str:
    return ".".join(filter(None, (origin_of(prototype), key)))


KINDS = ("flexures", "links", "bodies", "masses", "springs", "superelements", "actuators", "sensors")
"""Where what has matrices may be described."""
