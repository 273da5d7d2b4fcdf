"""Reducing a mechanism: every prototype once, placed many times (the RPR paper, eqs. 27-35), or to a tolerance.

The smallest model that is proven to meet a tolerance keeps more and more fixed-interface modes. Constraint modes pay
where few nodes hold much together. A part of which almost every node is kept, such as a mesh of links described node by
node, has as many of them as degrees of freedom, in a full matrix. Its lowest modes come from sparse factors (Ericsson
and Ruhe 1980), and the same certificate proves them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import checkpoint, stage
from flexura.errors import OptionError, SolverError
from flexura.full_order import design_of, plan_of
from flexura.linalg import Eigenpairs, bracket, lowest, lowest_modes
from flexura.mechanism import Mechanism, origin_of
from flexura.motion import at_pose
from flexura.reduction.assembly import LowOrderAssembler, low_order
from flexura.reduction.certificates import (
    HERTZ,
    SPARE_PAIRS,
    Certificate,
    certificate,
    cluster_end,
    lowest_pairs,
    proof,
)
from flexura.reduction.chained_model import ChainedModel, chained
from flexura.reduction.condensation import condense
from flexura.reduction.model import (
    FullBasis,
    LowOrderModel,
    assembled,
    model_pairs,
    state_of,
    static_nodes,
    substructures,
)
from flexura.reduction.parts import free_interface
from flexura.sizes import within
from flexura.structure import FullOrderModel, Plan, full_order_model
from flexura.tables import counted, in_hz
from flexura.thresholds import PROVEN

Reduction = Literal["craig_bampton", "rubin"]

Coordinates = Literal["modal", "physical", "substructures"]

KEPT_AT_FIRST = 1.5
"""Fixed-interface modes below so many times the highest frequency asked for are kept from the start."""

ADDED_TOGETHER = 1.3
"""Modes below so many times the frequency of the first one left out are added together."""

REFINED_SHARE = 0.1
"""A substructure is refined when it holds at least this part of the largest share of the residual."""

PAIRS_AT_FIRST = 8
"""Eigenpairs computed at first where a frequency is the limit."""


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
    design = design_of(model if isinstance(model, FullOrderModel) else plan, parameters)
    exact_at = static_nodes(assembler, static_at)
    if tolerance is not None:
        goal = Goal(tolerance, up_to, n, best_effort)
        stage("assembling the full order")
        full = model if isinstance(model, FullOrderModel) else full_order_model(at_pose(design))
        return reduce_to_tolerance(assembler, chained(full), exact_at, goal, coordinates)
    if reduction == "rubin":
        plan.refuse_pose("free interfaces")
        parts = {
            name: free_interface(
                reducer.craig_bampton(design.matrices[name], design.geometry), counts[name], keep_below
            )
            for name, reducer in assembler.reducers.items()
        }
        return assembled(assembler, design, parts, exact_at)
    substructure = substructures(assembler, at_pose(design))
    wanted = substructure.counts(counts)
    kept = {
        name: modes.whole(max(wanted[name], modes.count_below(keep_below)))
        for name, modes in substructure.modes.items()
    }
    return substructure.model(kept, exact_at)


def reduction_of(
    plan: Plan, asked: Mapping[str, Any], n: int | None = None, up_to: float | None = None
) -> dict[str, Any]:
    """Arguments of `reduce` for what is asked for, else for the mechanism's own `reduction`, else to a tolerance.

    A tolerance is for the lowest `n` modes, or for all up to `up_to` Hz, unless `asked` names another limit.
    """
    given = {key: value for key, value in asked.items() if value is not None}
    described = plan.mechanism.reduction
    if not given and described is not None:
        if described.tolerance is None:
            return {"keep": described.keep or 0}
        given = {"tolerance": described.tolerance}
    if given.keys() & {"keep", "keep_below", "reduction"}:
        return given
    if "tolerance" not in asked or asked["tolerance"] is None:
        given["best_effort"] = True
    limit = {"n": n} if up_to is None else {"up_to": up_to}
    if given.get("up_to") is not None or given.get("n") is not None:
        limit = {}
    return {"tolerance": PROVEN, **limit, **given}


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


@dataclass(frozen=True)
class Goal:
    """What a reduced model must get right within `tolerance`: the lowest `modes`, or all up to `up_to` Hz.

    Where round-off stands in the way, the closest model is good enough for `best_effort`. Raises OptionError for
    numbers that cannot be met.
    """

    tolerance: float
    up_to: float | None = None
    modes: int | None = None
    best_effort: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite(self.tolerance) and 0 < self.tolerance < 1):
            raise OptionError(f"tolerance is a relative error between 0 and 1, such as 1e-3, not {self.tolerance}")
        if self.up_to is not None and not (np.isfinite(self.up_to) and self.up_to > 0):
            raise OptionError(f"up_to is a positive frequency in Hz, not {self.up_to}")
        if self.modes is not None and self.modes < 1:
            raise OptionError(f"the number of modes is a whole number, at least 1, not {self.modes!r}")

    @property
    def limit(self) -> float:
        """The squared frequency up to which everything is asked for, (rad/s)^2."""
        return (HERTZ * (self.up_to or 0.0)) ** 2

    def count(self, values: Array) -> int:
        """How many of ascending squared frequencies (k,) are asked for."""
        if self.modes is not None:
            return min(self.modes, len(values))
        return int((values <= self.limit).sum())

    def missed(self, proof: Certificate) -> NDArray[np.bool_]:
        """Which frequencies (k,) of a certificate are not proven to the tolerance."""
        return (proof.error_bound > self.tolerance) & (proof.lower_hz > 0)

    def refuse_empty(self, full: ChainedModel) -> None:
        """Raise OptionError where no frequency lies up to the limit."""
        if self.up_to is not None and bracket(full.pencil, self.limit).most == 0:
            first = np.sqrt(lowest_modes(full.pencil, 1, full.rigid_motions).values[0]) / HERTZ
            raise OptionError(f"no natural frequency lies below {self.up_to:g} Hz: the lowest is {in_hz(first)}")


def reduce_to_tolerance(
    assembler: LowOrderAssembler,
    full: ChainedModel,
    exact_at: tuple[str, ...],
    goal: Goal,
    coordinates: Coordinates,
) -> LowOrderModel:
    """The smallest model of which every frequency of a goal is proven to be within its tolerance, relative.

    Raises OptionError for impossible options, or when there is no frequency up to the goal's, and SolverError when the
    tolerance is beyond round-off.
    """
    wide = [reducer.kept_nodes for reducer in assembler.reducers.values() if reducer.is_wide]
    if wide and coordinates != "substructures":
        return _from_full_order(full, goal, exact_at, wide, coordinates)
    stage("reducing")
    work = _Refinement(assembler, full, goal)
    refined: set[str] = set()
    while True:
        checkpoint()
        low = work.parts.model(work.counts, exact_at)
        pairs, n = work.pairs(low)
        if not n:
            if goal.modes is not None and work.is_whole:
                raise OptionError("the mechanism has no mass")
            goal.refuse_empty(full)
            refined.update(work.refine(None))
            continue
        proven, enclosures = proof(full, pairs, n, goal.up_to)
        failing = goal.missed(proven)
        short = goal.modes is not None and n < goal.modes and not work.is_whole
        met = proven.is_complete and not failing.any() and not short
        if met or (goal.best_effort and (work.is_whole or not proven.is_counted)):
            n = len(proven.frequency_hz)
            low = replace(low, steps=(*low.steps, _kept_text(work.counts, refined, proven)))
            return replace(
                _in_coordinates(low, full, pairs.first(n), len(pairs.values), coordinates), certificate=proven
            )
        if not proven.is_complete and goal.up_to is None and work.keep_below(float(proven.frequency_hz[-1])):
            continue
        known = proven.is_complete and not short
        refined.update(work.refine(enclosures.remainder[:, failing] if known else enclosures.remainder))


def _from_full_order(
    full: ChainedModel, goal: Goal, exact_at: tuple[str, ...], wide: list[str], coordinates: Coordinates
) -> LowOrderModel:
    """The lowest modes of the full order that a goal asks for, proven, as a low-order model; `wide` says why these.

    Raises OptionError where no frequency lies up to the goal's, or there are too many, and SolverError when the
    tolerance is beyond round-off.
    """
    model = full.model
    goal.refuse_empty(full)
    n = goal.modes or bracket(full.pencil, goal.limit).most
    within("dense_entries", model.order * n, f"{n} modes of the full order, {model.order}")
    stage("searching the lowest modes")
    pairs = lowest_pairs(full, n)
    stage("proving them")
    proven = certificate(full, pairs, min(n, len(pairs.values)), goal.up_to)
    if not goal.best_effort and (not proven.is_complete or goal.missed(proven).any()):
        raise _out_of_reach("these are modes of the full order")
    n = len(proven.frequency_hz)
    reason = f"modes of the full order, not constraint modes: {'; '.join(wide)}"
    steps = (reason, *state_of(model.design), _proven_text(proven))
    whole = LowOrderModel(model.design, model.K, model.M, FullBasis(model.plan), steps, exact_at)
    if coordinates == "modal":
        shapes = full.recover(pairs.vectors[:, :n])
        small = whole.in_modes(pairs.values[:n], shapes, f"modal coordinates; {_smallest(n)}")
    else:
        small = _in_displacements(whole, n)
    return replace(small, certificate=proven)


class _Refinement:
    """Craig-Bampton models of one design with more and more fixed-interface modes, checked against the full order."""

    def __init__(self, assembler: LowOrderAssembler, full: ChainedModel, goal: Goal) -> None:
        self.assembler, self.full, self.goal = assembler, full, goal
        self.parts = substructures(assembler, full.model.design)
        self.modes = self.parts.modes
        self.counts = dict.fromkeys(self.modes, 0)
        self.keep_below(goal.up_to or 0.0)

    def keep_below(self, hz: float) -> bool:
        """Keep the fixed-interface modes that models up to `hz` need from the start; True when there are more."""
        before = dict(self.counts)
        for name, modes in self.modes.items():
            self.counts[name] = max(before[name], modes.count_below(KEPT_AT_FIRST * hz))
        return self.counts != before

    def pairs(self, low: LowOrderModel) -> tuple[Eigenpairs, int]:
        """The lowest pairs of a model and how many of them count: all that are asked for, and what is repeated."""
        if low.order == 0:
            return Eigenpairs(np.empty(0), np.empty((self.full.pencil.order, 0))), 0
        wanted = self.goal.modes or PAIRS_AT_FIRST
        while True:
            pairs = model_pairs(low, self.full, wanted)
            n = self.goal.count(pairs.values)
            if n < len(pairs.values) or wanted >= low.order:
                return pairs, cluster_end(pairs.values, n) if n else 0
            wanted *= 2

    @property
    def is_whole(self) -> bool:
        """True when every fixed-interface mode is kept."""
        return all(self.counts[name] >= len(modes.interior) for name, modes in self.modes.items())

    def refine(self, remainder: Array | None) -> list[str]:
        """Keep more modes of the prototypes that hold most of the residual, of all where nothing is known.

        Returns the names of those that have grown; raises SolverError when none can.
        """
        shares = dict.fromkeys(self.modes, 1.0) if remainder is None else self._shares(remainder)
        shares = {name: share for name, share in shares.items() if self.counts[name] < len(self.modes[name].interior)}
        if not shares:
            raise _out_of_reach("every fixed-interface mode is kept")
        largest = max(shares.values())
        grown = [name for name, share in shares.items() if share >= REFINED_SHARE * largest]
        for name in grown:
            modes, count = self.modes[name], self.counts[name]
            values = modes.normal_modes(count + 1).values
            following = np.sqrt(values[-1]) / HERTZ if len(values) > count else np.inf
            below = modes.count_below(ADDED_TOGETHER * following) if np.isfinite(following) else len(modes.interior)
            self.counts[name] = max(below, count + 1)
        return grown

    def _shares(self, remainder: Array) -> dict[str, float]:
        """Share of residuals (n, k) in the interior of each prototype, all its copies together (theory eq. C6)."""
        shapes = self.full.recover(remainder)
        density = np.append(np.einsum("ik,ik->i", shapes, self.full.model.M @ shapes), 0.0)
        dof = self.assembler.plan.topology.dof
        inside = {
            name: self.assembler.numbers(name, reducer.part.interior)
            for name, reducer in self.assembler.reducers.items()
        }
        return {name: abs(float(density[dof[number].ravel()].sum())) for name, number in inside.items()}


def _out_of_reach(why: str) -> SolverError:
    advice = "ask for order full, or a larger tolerance"
    return SolverError(f"the tolerance is out of reach of order low: {why}, round-off remains; {advice}")


def _in_coordinates(
    low: LowOrderModel, full: ChainedModel, pairs: Eigenpairs, known: int, coordinates: Coordinates
) -> LowOrderModel:
    """The model in the coordinates asked for, from its proven pairs, of as many as are `known`; no model with fewer
    coordinates has as many frequencies."""
    n = len(pairs.values)
    if coordinates == "substructures":
        return low
    if coordinates == "physical":
        return _in_displacements(low, n)
    vectors = lowest(low.K, low.M, min(n + SPARE_PAIRS, low.order)).vectors
    vectors = vectors if known <= vectors.shape[1] else np.eye(low.order)
    shapes = full.coordinates(low.recover(vectors))
    M = full.pencil.M
    T = vectors @ np.linalg.lstsq(shapes.T @ (M @ shapes), shapes.T @ (M @ pairs.vectors))[0]
    return low.in_modes(pairs.values, T, f"modal coordinates; {_smallest(n)}")


def _in_displacements(low: LowOrderModel, n: int) -> LowOrderModel:
    """The model in n of its displacements (SEREP)."""
    small = condense(low, n, method="serep")
    return replace(small, steps=(*small.steps, _smallest(n)))


def _kept_text(counts: Mapping[str, int], refined: Iterable[str], proven: Certificate) -> str:
    """What was kept of each prototype and why, in words."""
    kept = [f"{name or 'mechanism'} {count}" for name, count in counts.items() if count]
    modes = f"fixed-interface modes kept: {', '.join(kept)}" if kept else "constraint modes suffice"
    names = ", ".join(sorted({name or "mechanism" for name in refined}))
    return f"{modes}{f' (refined for the tolerance: {names})' if names else ''}; {_proven_text(proven)}"


def _proven_text(proven: Certificate) -> str:
    """How many frequencies a certificate has proven, and how closely, in words."""
    worst = float(proven.error_bound[proven.frequency_hz > 0].max(initial=0.0))
    return f"{counted(proven.count, 'frequency')} below {in_hz(proven.below_hz)}, proven within {worst:.1g}"


def _smallest(n: int) -> str:
    """Why a model of order n is the smallest, in words."""
    return f"order {n}: no smaller model has the {counted(n, 'frequency')} that the inertia count proves"
