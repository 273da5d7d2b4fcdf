"""Reducing a mechanism: every prototype once, placed many times (the RPR paper, eqs. 27-35)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.deadline import stage
from flexura.errors import OptionError
from flexura.mechanism import Mechanism, origin_of
from flexura.reduction.proven.adaptive import reduce_to_tolerance
from flexura.reduction.proven.goal import Coordinates, Goal
from flexura.reduction.single import (
    LowOrderAssembler,
    LowOrderModel,
    assembled,
    free_interface,
    low_order,
    static_nodes,
    substructures,
)
from flexura.structure import FullOrderModel, Plan, checked_design, full_order_model, plan_of

Reduction = Literal["craig_bampton", "rubin"]


@verb
def reduce(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    keep: int | Mapping[str, int] = 0,
    keep_below: float = 0.0,
    reduction: Reduction = "craig_bampton",
    static_at: Sequence[str] | None = None,
    tolerance: float | None = None,
    up_to: float | None = None,
    n: int | None = None,
    best_effort: bool = False,
    coordinates: Coordinates = "modal",
) -> LowOrderModel:
    """Reduce a mechanism: constraint modes of every substructure, and normal modes on request.

    `keep` is the number of normal modes kept in each substructure (or a number by prototype name); `keep_below` keeps
    all below that frequency, Hz. With neither this is the model of the RPR paper. The normal modes are those with the
    interface held (`craig_bampton`; a repeated frequency is kept whole), or the elastic ones of the free substructure
    with residual flexibility (`rubin`).

    With a `tolerance` the modes to keep are found: the result is the smallest model of which every natural frequency up
    to `up_to` Hz, or each of the lowest `n`, is proven to be within `tolerance`, relative, of the full-order
    model's, none missing.
    Where round-off stands in the way that is an error, or, with `best_effort`, the closest model, whose `certificate`
    says what is proven. Its `coordinates` are modal, physical displacements (SEREP), or those of the substructures;
    `certificate` holds the proof and `steps` say what was kept and why.

    The lowest modes of the full order are that model where so many nodes of a part are kept that constraint modes do
    not pay. An assembled model may stand in place of the mechanism.

    Static response at the nodes `static_at` stays that of the full-order model through every further step; they must
    be kept, and are by default the mechanism's interface, or else its rigid bodies.
    Raises ModelError for a description that cannot be used, OptionError for impossible options, SolverError for a
    tolerance beyond round-off.
    """
    plan = model.plan if isinstance(model, FullOrderModel) else plan_of(model, parameters)
    assembler = low_order(plan)
    if tolerance is None:
        for reducer in assembler.reducers.values():
            reducer.refuse_too_large()
    counts = kept_counts(assembler, keep)
    if not (np.isfinite(keep_below) and keep_below >= 0):
        raise OptionError(f"keep_below is a frequency in Hz, zero or more, not {keep_below}")
    if (tolerance is None) != (up_to is None and n is None) or (up_to is not None and n is not None):
        raise OptionError(
            "tolerance and up_to, or n, belong together: a relative error, and the frequency in Hz or the number of"
            " modes it holds to"
        )
    if tolerance is not None and (keep or keep_below or reduction != "craig_bampton"):
        raise OptionError("give either a tolerance and what it is for, or what to keep and how")
    if reduction not in get_args(Reduction):
        raise OptionError(f"reduction is one of {', '.join(get_args(Reduction))}, not {reduction!r}")
    if coordinates not in get_args(Coordinates):
        raise OptionError(f"coordinates are modal, physical or substructures, not {coordinates!r}")
    design = checked_design(model if isinstance(model, FullOrderModel) else plan, parameters)
    exact_at = static_nodes(assembler, static_at)
    if tolerance is not None:
        goal = Goal(tolerance, up_to, n, best_effort)
        stage("assembling the full order")
        full = model if isinstance(model, FullOrderModel) else full_order_model(design)
        return reduce_to_tolerance(assembler, full, exact_at, goal, coordinates)
    if reduction == "rubin":
        plan.refuse_pose("free interfaces")
        parts = {
            name: free_interface(
                reducer.craig_bampton(design.matrices[name], design.geometry), counts[name], keep_below
            )
            for name, reducer in assembler.reducers.items()
        }
        return assembled(assembler, design, parts, exact_at)
    own = substructures(assembler, design)
    wanted = own.counts(counts)
    kept = {name: modes.whole(max(wanted[name], modes.count_below(keep_below))) for name, modes in own.modes.items()}
    return own.model(kept, exact_at)


TOLERANCE = 1e-3
"""Relative error that what is asked for is proven to where nothing says otherwise."""


def reduction_of(
    plan: Plan, asked: Mapping[str, Any], n: int | None = None, up_to: float | None = None
) -> dict[str, Any]:
    """Arguments of `reduce` for what is asked for, else for the mechanism's own `reduction`, else to a tolerance.

    A tolerance is for the lowest `n` modes, or for all up to `up_to` Hz, unless `asked` names another limit.
    """
    given = {key: value for key, value in asked.items() if value is not None}
    own = plan.mechanism.reduction
    if not given and own is not None:
        if own.tolerance is None:
            return {"keep": own.keep or 0}
        given = {"tolerance": own.tolerance}
    if given.keys() & {"keep", "keep_below", "reduction"}:
        return given
    if "tolerance" not in asked or asked["tolerance"] is None:
        given["best_effort"] = True
    limit = {"n": n} if up_to is None else {"up_to": up_to}
    if given.get("up_to") is not None or given.get("n") is not None:
        limit = {}
    return {"tolerance": TOLERANCE, **limit, **given}


def kept_counts(assembler: LowOrderAssembler, keep: int | Mapping[str, int]) -> dict[str, int]:
    """Kept normal modes by prototype. Raises OptionError for unknown names and impossible numbers."""
    names = list(assembler.reducers)
    if isinstance(keep, Mapping):
        labels = [name or "mechanism" for name in names]
        unknown = sorted(set(keep) - {*labels, *map(origin_of, labels)})
        if unknown:
            known = ", ".join(labels)
            raise OptionError(f"keep names {unknown[0]!r}, which is no substructure with members; there are {known}")
        counts = {
            name: keep.get(label, keep.get(origin_of(label), 0)) for name, label in zip(names, labels, strict=True)
        }
    else:
        counts = dict.fromkeys(names, keep)
    for name, count in counts.items():
        if not isinstance(count, int | np.integer) or count < 0:
            raise OptionError(f"the number of kept modes is a whole number, zero or more, not {count!r} ({name})")
    return counts
