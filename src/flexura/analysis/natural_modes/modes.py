"""Natural frequencies and mode shapes, low-order and full-order side by side, with evidence.

Modes of the full order where many branches are equal, from the small problems that it splits into.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from flexura.analysis.natural_modes.evidence import Evidence, MissedMode, mass_evidence
from flexura.analysis.natural_modes.proven_modes import Mode, Modes, certified_mode, unproven, with_mesh_errors
from flexura.analysis.strain import motions
from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.deadline import stage
from flexura.errors import Diagnostic, OptionError
from flexura.linalg import Eigenpairs, Pencil, lowest, residuals
from flexura.mechanism import Mechanism
from flexura.modal import REPEATED, close_groups, mac_with_spaces, pair_by_mac
from flexura.reduction import (
    HERTZ,
    TOLERANCE,
    Certificate,
    ChainedModel,
    LowOrderModel,
    Reduction,
    SplitModel,
    certificate,
    chained,
    lowest_pairs,
    model_pairs,
    reduce,
    reduction_of,
    split,
    state_of,
)
from flexura.registry import registered
from flexura.structure import FullOrderModel, Plan, assemble, full_order_model, one_design, plan_of


def split_modes(split: SplitModel, n: int, parameters: dict[str, float]) -> Modes:
    """The `n` lowest modes of a full-order model that is split by its equal branches."""
    full = split.model
    proof, pairs = split.certificate(n), split.lowest(n)
    u = full.node_displacements(pairs.vectors)
    found = tuple(  # a model is split only where its stiffness is definite: nothing is rigid
        certified_mode(k, (proof, 0, TOLERANCE), (float(proof.frequency_hz[k]), 0.0, 1.0), motion)
        for k, motion in enumerate(motions(full, u))
    )
    evidence = Evidence(
        **mass_evidence(full),
        rigid_body_modes=0,
        full_residual=split.residual(n),
        low_residual=None,
        sturm_below_hz=proof.below_hz,
        sturm_count=proof.count,
        reported_below=proof.found,
        missed=(),
        more_missed=proof.missing,
        is_counted=proof.is_counted,
    )
    names = tuple(full.plan.topology.node_names)
    name = full.plan.mechanism.name
    steps = (split.summary, *state_of(full.design))
    told, meshes = with_mesh_errors(full, found, u)
    said = (*unproven(told, proof, TOLERANCE), *meshes)
    return Modes(
        name, full.order, full.order, told, evidence, u, names, parameters, full, proof, steps, TOLERANCE, said
    )  # fmt: skip


LARGEST = 30_000
"""Up to this full order its own modes are worked out beside those of the low order."""

EXTRA = 60
"""At most so many full-order modes beyond the reported ones are computed to name what a reduction misses."""


@verb
def modes(
    model: Mechanism | Plan | LowOrderModel,
    parameters: Mapping[str, float] | None = None,
    *,
    n: int = 6,
    order: Literal["low", "full"] = "low",
    keep: int | Mapping[str, int] | None = None,
    keep_below: float | None = None,
    reduction: Reduction | None = None,
    tolerance: float | None = None,
    up_to: float | None = None,
) -> Modes:
    """The `n` lowest modes of the low-order model beside their full-order counterparts, or of the full model alone.

    `parameters` replace default values. The low-order model is the smallest that is proven to be within 1e-3 for these
    modes, unless the mechanism's `reduction` or arguments say otherwise: `tolerance` with or without `up_to` (Hz, for
    all modes up to there whatever n is), or `keep`, `keep_below` (Hz) and the method `reduction` as in `reduce`;
    `keep=0` is the model of constraint modes alone. A model that `reduce` has made may stand in place of the mechanism.
    Every frequency lies in its own proven interval; what is missing, not
    proven, or off by more than the tolerance is in `warnings`. Raises ModelError, OptionError and SolverError.
    """
    if not isinstance(n, int | np.integer) or n < 1:
        raise OptionError(f"the number of modes is a whole number, at least 1, not {n!r}")
    if order not in ("low", "full"):
        raise OptionError(f"order is low or full, not {order!r}")
    given = {"keep": keep, "keep_below": keep_below, "reduction": reduction, "tolerance": tolerance, "up_to": up_to}
    given = {name: value for name, value in given.items() if value is not None}
    if isinstance(model, LowOrderModel):
        if parameters or order == "full" or given:
            raise OptionError("a reduced model has its design and its reduction already; only n can be asked of it")
        full = chained(full_order_model(model.design))
        return _low_modes(full, model, min(n, model.order), one_design(model.parameters), TOLERANCE)
    plan, single = plan_of(model, parameters), one_design(parameters)
    stage("assembling the full order")
    full = assemble(plan, single)
    if full.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    if order == "full" and given:
        raise OptionError(f"{next(iter(given))} belongs to order low")
    if order == "full" and (parts := split(full)) is not None:
        return split_modes(parts, n, single)
    if order == "full":
        return _full_modes(chained(full), min(n, full.order), single)
    how = reduction_of(plan, given, n)
    low = reduce(full, **how)
    if how.get("up_to") is not None:
        n = low.order
    if low.order == 0:
        raise OptionError("every node that the low-order model keeps is held; keep normal modes, or ask for order full")
    return _low_modes(chained(full), low, min(n, low.order), single, how.get("tolerance", TOLERANCE))


def _full_modes(full: ChainedModel, n: int, parameters: dict[str, float]) -> Modes:
    found = lowest_pairs(full, n)
    certified = certificate(full, found, n)
    n = min(n, len(found.values))
    vectors = full.recover(found.vectors[:, :n])
    u = full.model.node_displacements(vectors)
    reported = tuple(
        certified_mode(k, (certified, full.free_motions, np.inf), (float(certified.frequency_hz[k]), 0.0, 1.0), motion)
        for k, motion in enumerate(motions(full.model, u))
    )
    evidence = _evidence(full, certified, reported, found)
    steps = state_of(full.model.design)
    return _result(full, full.model.order, reported, evidence, u, parameters, certified, steps, np.inf)


def _low_modes(full: ChainedModel, low: LowOrderModel, n: int, parameters: dict[str, float], tolerance: float) -> Modes:
    pairs = model_pairs(low, full, n)
    n = min(n, len(pairs.values))
    if n == 0:
        raise OptionError("the mechanism has no mass")
    certified = low.certificate
    if certified is None or len(certified.frequency_hz) < n:
        certified = certificate(full, pairs, n)
    reference = _reference(full, certified, n)
    shapes = pairs.vectors[:, : max(n, len(certified.frequency_hz))]
    partner, mac = _pair(full.pencil.M, shapes, pairs.values[: shapes.shape[1]], reference)
    u = full.model.node_displacements(full.recover(shapes[:, :n]))
    beside = np.sqrt(reference.values) / HERTZ
    reported = []
    for k, motion in enumerate(motions(full.model, u)):
        own, other = float(certified.frequency_hz[k]), float(beside[partner[k]]) if partner[k] >= 0 else None
        pair = (None, None, None) if other is None else (other, own / other - 1 if other else 0.0, mac[k])
        reported.append(certified_mode(k, (certified, full.free_motions, tolerance), pair, motion))
    lost = np.setdiff1d(np.flatnonzero(beside <= certified.below_hz), partner) if certified.missing > 0 else []
    lost_motions = motions(full.model, full.model.node_displacements(full.recover(reference.vectors[:, lost])))
    missed = tuple(MissedMode(float(beside[i]), m.summary) for i, m in zip(lost, lost_motions, strict=True))
    evidence = _evidence(full, certified, tuple(reported), reference, low, missed)
    return _result(full, low.order, tuple(reported), evidence, u, parameters, certified, low.steps, tolerance)


def _reference(full: ChainedModel, certified: Certificate, n: int) -> Eigenpairs:
    """Full-order modes to stand beside those of a low-order model, none where the full order is too large."""
    if full.model.order > LARGEST:
        return Eigenpairs(np.empty(0), np.empty((full.pencil.order, 0)))
    wanted = min(max(certified.count, len(certified.frequency_hz)), n + EXTRA)
    return lowest_pairs(full, wanted)


def _evidence(
    full: ChainedModel,
    certified: Certificate,
    reported: tuple[Mode, ...],
    reference: Eigenpairs,
    low: LowOrderModel | None = None,
    missed: tuple[MissedMode, ...] = (),
) -> Evidence:
    residual = float(residuals(full.pencil, reference).max()) if len(reference.values) else None
    own = None
    if low is not None:
        stored = Pencil.of(low.K, low.M)
        own = float(residuals(stored, lowest(low.K, low.M, len(reported))).max())
    return Evidence(
        **mass_evidence(full.model),
        rigid_body_modes=sum(mode.is_rigid for mode in reported),
        full_residual=residual,
        low_residual=own,
        sturm_below_hz=certified.below_hz,
        sturm_count=certified.count,
        reported_below=certified.found,
        missed=missed,
        more_missed=max(certified.missing - len(missed), 0),
        is_counted=certified.is_counted,
    )


def _pair(M: Any, shapes: Array, values: Array, reference: Eigenpairs) -> tuple[Index, list[float]]:
    """For each low-order mode the full-order one that it represents (-1: none), and their MAC (theory eq. 57)."""
    beside, own = np.sqrt(np.abs(reference.values)), np.sqrt(np.abs(values))
    overlap = mac_with_spaces(reference.vectors, shapes, close_groups(beside, REPEATED), M)
    partner = pair_by_mac(overlap, beside, own)
    return partner, [float(overlap[partner[k], k]) if partner[k] >= 0 else 0.0 for k in range(len(own))]


def _result(
    full: ChainedModel,
    order: int,
    found: tuple[Mode, ...],
    evidence: Evidence,
    u: Array,
    parameters: dict[str, float],
    certified: Certificate,
    steps: tuple[str, ...],
    tolerance: float,
) -> Modes:
    model = full.model
    names, name = tuple(model.plan.topology.node_names), model.plan.mechanism.name
    found, meshes = with_mesh_errors(model, found, u)
    said = (*unproven(found, certified, tolerance), *meshes, *_pose_limits(model))
    limit = min(tolerance, TOLERANCE)
    return Modes(name, order, model.order, found, evidence, u, names, parameters, model, certified, steps, limit, said)


def _pose_limits(model: FullOrderModel) -> tuple[Diagnostic, ...]:
    """What is doubtful of a pose that is described; large motion is imported for that alone."""
    return registered("pose_limits")(model) if model.plan.is_posed else ()
