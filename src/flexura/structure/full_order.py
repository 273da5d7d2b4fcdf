"""The full-order model of a design: every node of every placed part (the RPR paper, eqs. 19-20).

What double precision cannot hold is refused by name before any solver meets it; what has no slopes is named.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.duals import Dual, slope_of
from flexura.errors import ModelError, Path, Problem
from flexura.mechanism import TOP, origin_of
from flexura.records import Latest
from flexura.structure.assembly import full_order
from flexura.structure.design import Design
from flexura.structure.model import FullOrderModel, Prestress, prestress, refuse_buckled
from flexura.structure.part import PartMatrices
from flexura.structure.plan import Plan, one_design


def full_order_model(design: Design) -> FullOrderModel:
    """The full-order model of one design. Raises SolverError beyond buckling, and as `prestress` does."""
    return FullOrderModel(design, *stiffness_and_mass(design))


def stiffness_and_mass(design: Design) -> tuple[sp.csc_matrix, sp.csc_matrix]:
    """K (N/m, N, N m) and M (kg, kg m, kg m^2), both (n, n), of one design, about the pose (theory eq. G14) or the
    state of load (theory eq. P6) that is described.

    Raises SolverError beyond buckling, where no equilibrium leads to the pose, and as `prestress` does.
    """
    if (posed := design.posed) is not None:
        return posed.K, posed.M
    K, M = full_order(design.plan).elastic(design)
    return (K + described_prestress(design).K_g if design.plan.is_loaded else K).tocsc(), M


def dissipation(design: Design, default: float = 0.0) -> tuple[sp.csc_matrix, sp.csc_matrix]:
    """C (N s/m, N s, N m s) of dashpots and H (N/m, N, N m) of structural damping, K + i H, both (n, n), of one design:
    at rest (theory eq. T5), or at the pose that is described (theory eq. G25)."""
    posed = design.posed
    return full_order(design.plan).dissipation(design, default) if posed is None else posed.dissipation(default)


def described_prestress(design: Design) -> Prestress:
    """The state of one design under the loads and gravity that are described, the last one kept with the plan.

    Raises SolverError beyond buckling, and as `prestress` does.
    """
    plan, values = design.plan, design.values

    def found() -> Prestress:
        model = FullOrderModel(design, *full_order(plan).elastic(design))
        state = prestress(model, plan.loads.gravity(values), plan.loads.wrenches(values))
        refuse_buckled(model.K, state.K_g)
        return state

    latest: Latest[Prestress] = plan.prepared.once("described prestress", Latest)
    return latest.get(values.tobytes(), found)


def checked_design(plan: Plan, parameters: Mapping[str, ArrayLike] | None = None) -> Design:
    """One design that can be assembled, not yet at the pose that may be described.

    Raises ModelError for what its parameters break and for what double precision cannot hold, and OptionError for
    unknown ones and arrays.
    """
    single = one_design(parameters)
    plan.verify(single)
    design = Design.of(plan, single)
    refuse_unrepresentable(design)
    return design


SAME_SLOPE = 1e-7
"""Relative difference of slopes that is round-off."""

RULE = "stiffness or mass is not finite: sizes here lie further apart than double precision can hold"


def refuse_unrepresentable(design: Design) -> None:
    """Raise ModelError that names every member, body, spring and superelement with a matrix that is not finite.

    One design.
    """
    with np.errstate(all="ignore"):  # what is not finite is refused by name
        matrices = design.matrices
        wrong = [
            problem
            for name, part_matrices in matrices.items()
            for problem in _problems(design.plan, name, part_matrices)
        ]
    if wrong:
        raise ModelError(wrong)


def _problems(plan: Plan, name: str, matrices: PartMatrices) -> Iterator[Problem]:
    prototype = plan.layout.prototypes[name]
    above: Path = () if name == TOP else ("substructures", origin_of(name))
    for key in _lost(plan, name, matrices, lambda A: A):
        kind = next(kind for kind in KINDS if key in getattr(prototype, kind))
        yield Problem((*above, kind, key), "", RULE, "check its sizes and their units")


def _lost(plan: Plan, name: str, matrices: PartMatrices, read: Callable[[Any], Any]) -> Iterator[str]:
    """Members and discrete elements of a prototype with matrices of which `read` finds what is not finite."""
    part = plan.parts[name]
    if len(part.connectivity):
        bad = ~np.isfinite(read(matrices.elements.K + matrices.elements.M)) | ~np.isfinite(read(matrices.T))
        lost = np.unique(np.nonzero(bad)[0])
        for k, member in enumerate(part.members):
            if ((lost >= part.first[k]) & (lost < part.first[k + 1])).any():
                yield member
    for discrete in matrices.discrete_elements:
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
            _described(name, key)
            for name, matrices in design.matrices.items()
            for key in _lost(design.plan, name, matrices, read)
        ]


def tables_left(design: Design, number: int) -> list[str]:
    """Notches by a table, as described, whose last position does not move with the end of the member by the parameter
    with a number: they fit at this design alone, which is one made `with_slopes`."""
    names = []
    for name, part in design.plan.parts.items():
        for group, _, _ in part.table.groups:
            for last in group.table_ends(design.values):
                length = design.geometry.parts[name].length[group.index]
                one, other = (slope_of(x)[number] if isinstance(x, Dual) else 0 * x for x in (last, length))
                away = np.abs(one - other) > SAME_SLOPE * np.maximum(np.abs(one), np.abs(other))
                names += [_described(name, list(part.members)[k]) for k in group.index[away]]
    return names


def _described(prototype: str, key: str) -> str:
    """The name of something, as described."""
    return ".".join(filter(None, (origin_of(prototype), key)))


KINDS = (
    "flexures",
    "diaphragms",
    "flat_springs",
    "links",
    "bodies",
    "masses",
    "springs",
    "superelements",
    "actuators",
    "sensors",
)
"""Where what has matrices may be described."""
