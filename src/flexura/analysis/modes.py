"""Natural frequencies and mode shapes, low-order and full-order side by side, with evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.evidence import Evidence, MissedMode, mass_evidence
from flexura.analysis.mesh_errors import LIMIT, frequency_errors, mesh_warning
from flexura.analysis.motion import Motion, motions
from flexura.arguments import verb
from flexura.deadline import stage
from flexura.errors import Exceeded, OptionError, Warned
from flexura.linalg import Eigenpairs, Pencil, lowest, residuals
from flexura.mechanism.substructure import Mechanism
from flexura.reduction import Certificate, LowOrderModel, reduce
from flexura.reduction.certificate import HERTZ, certificate, design_of, lowest_pairs, model_pairs
from flexura.reduction.chained import ChainedModel, chained
from flexura.reduction.equal_branches import split
from flexura.reduction.low_order import TOLERANCE, Method, reduction_of
from flexura.reduction.model import STATE
from flexura.structure import FullOrderModel, Plan, assemble
from flexura.structure.plan import one_design, plan_of

Array = NDArray[np.float64]

LARGEST = 30_000
"""Up to this full order its own modes are worked out beside those of the low order."""

EXTRA = 60
"""At most so many full-order modes beyond the reported ones are computed to name what a reduction misses."""

SAME_MODE = 0.5
"""Least modal assurance criterion at which a low-order mode counts as the counterpart of a full-order one."""

REPEATED = 1e-5
"""Frequencies closer than this, relative, are taken as repeated when modes are paired."""


@dataclass(frozen=True)
class Mode:
    """One mode.

    `relative_error` is the low-order frequency over the full-order one, less one; `mac` the mass-weighted modal
    assurance criterion of the pair. All three are None when the low-order mode has no counterpart, or the full-order
    model was too large to be solved beside it. `interval_hz` is proven to contain a full-order frequency, that of the
    same number where `is_indexed` (see `Certificate`); an end that is not proven is None. `is_rigid` says that the
    frequency is zero: its interval holds zero, and a rigid motion that strains nothing stands for it. `missed` says
    that the interval is wider than the tolerance that was asked for. `mesh_error` estimates how far off, relative, the
    frequency may be for the meshes of solid parts, which no interval knows of; None where no part tells.
    """

    number: int
    frequency_hz: float
    angular_frequency: float
    full_frequency_hz: float | None
    relative_error: float | None
    mac: float | None
    interval_hz: tuple[float | None, float | None]
    is_indexed: bool
    motion: Motion
    is_rigid: bool = False
    missed: bool = False
    mesh_error: float | None = None

    @property
    def frequency_text(self) -> str:
        """The frequency in words: five digits, `0`, or a bound where round-off hides whether it is zero."""
        if self.frequency_hz > 0 or self.is_rigid:
            return f"{self.frequency_hz:.5g}"
        upper = self.interval_hz[1]
        return "unknown" if upper is None else f"below {upper:.2g}"

    @property
    def flag(self) -> str:
        """What is wrong with the frequency, in a few words; empty where it is within its limits."""
        if self.frequency_hz == 0 and not self.is_rigid:
            return "cannot be told from zero"
        if not self.missed:
            off = self.mesh_error or 0.0
            return f"meshes leave {_percent(off)} open" if off > LIMIT else ""
        lower, upper = self.interval_hz
        if not (self.is_indexed and lower and upper is not None):
            return "not proven"
        return f"proven only within {_percent(max(upper - self.frequency_hz, self.frequency_hz - lower) / lower)}"


@dataclass(frozen=True)
class Modes(Warned):
    """The lowest natural modes of a mechanism.

    `order` is that of the model solved, `full_order` that of the full model. `shapes` (n_nodes, 6, n), M-orthonormal,
    are displacements of all nodes, global frame, m and rad; nodes follow `node_names`.
    """

    name: str
    order: int
    full_order: int
    modes: tuple[Mode, ...]
    evidence: Evidence
    shapes: Array
    node_names: tuple[str, ...]
    parameters: dict[str, float]
    model: FullOrderModel
    certificate: Certificate
    steps: tuple[str, ...] = ()
    """What the reduction kept and why."""
    tolerance: float = TOLERANCE
    """Relative error that every frequency is held against."""
    warnings: tuple[Exceeded, ...] = ()
    """What is missing, not proven, or beyond the tolerance."""

    def __repr__(self) -> str:
        hz = ", ".join(f"{mode.frequency_hz:.5g}" for mode in self.modes)
        missing = "" if self.evidence.complete else ", modes missing"
        return f"Modes({self.name!r}, order {self.order} of {self.full_order}, {hz} Hz{missing})"

    @property
    def frequency_hz(self) -> Array:
        """Natural frequencies (n,), Hz."""
        return np.array([mode.frequency_hz for mode in self.modes])

    @property
    def angular_frequency(self) -> Array:
        """Natural frequencies (n,), rad/s."""
        return np.array([mode.angular_frequency for mode in self.modes])

    @property
    def full_frequency_hz(self) -> Array:
        """Full-order frequencies (n,) of the counterparts, Hz; nan where there is none."""
        return np.array([np.nan if m.full_frequency_hz is None else m.full_frequency_hz for m in self.modes])

    def to_dict(self) -> dict[str, Any]:
        """Everything but the shapes, as plain data for JSON."""
        return {
            "mechanism": self.name,
            "order": self.order,
            "full_order": self.full_order,
            "parameters": self.parameters,
            "steps": list(self.steps),
            "tolerance": self.tolerance,
            "modes": [asdict(mode) for mode in self.modes],
            "certificate": self.certificate.to_dict(),
            "evidence": {**asdict(self.evidence), "complete": self.evidence.complete},
            "warnings": [w.to_dict() for w in self.warnings],
        }


@verb
def modes(
    mechanism: Mechanism | Plan | LowOrderModel,
    parameters: Mapping[str, float] | None = None,
    *,
    n: int = 6,
    order: Literal["low", "full"] = "low",
    keep: int | Mapping[str, int] | None = None,
    keep_below: float | None = None,
    reduction: Method | None = None,
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
    given = {"keep": keep, "keep_below": keep_below, "method": reduction, "tolerance": tolerance, "up_to": up_to}
    given = {name: value for name, value in given.items() if value is not None}
    if isinstance(mechanism, LowOrderModel):
        if parameters or order == "full" or given:
            raise OptionError("a reduced model has its design and its reduction already; only n can be asked of it")
        full = chained(design_of(mechanism))
        return _low_modes(full, mechanism, min(n, mechanism.order), dict(mechanism.parameters), TOLERANCE)
    plan, single = plan_of(mechanism), one_design(parameters)
    stage("assembling the full order")
    model = assemble(plan, single)
    if model.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    if order == "full" and given:
        raise OptionError(f"{next(iter(given))} belongs to order low")
    if order == "full" and (parts := split(model)) is not None:
        from flexura.analysis.split_modes import split_modes

        return split_modes(parts, n, single)
    if order == "full":
        return _full_modes(chained(model), min(n, model.order), single)
    how = reduction_of(plan, given, n)
    low = reduce(model, **how)
    if how.get("up_to") is not None:
        n = low.order
    if low.order == 0:
        raise OptionError("every node that the low-order model keeps is held; keep normal modes, or ask for order full")
    return _low_modes(chained(model), low, min(n, low.order), single, how.get("tolerance", TOLERANCE))


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
    steps = (STATE,) if full.model.plan.is_loaded else ()
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


def certified_mode(
    k: int,
    proof: tuple[Certificate, int, float],
    beside: tuple[float | None, float | None, float | None],
    motion: Motion,
) -> Mode:
    """Mode k from the certificate, how many rigid motions are free, and the tolerance."""
    certified, free, tolerance = proof
    hz, indexed = float(certified.frequency_hz[k]), bool(certified.is_indexed[k])
    lower, upper = (float(b[k]) if np.isfinite(b[k]) else None for b in (certified.lower_hz, certified.upper_hz))
    is_rigid = hz == 0.0 and k < free and lower == 0.0
    missed = not is_rigid and not (indexed and certified.error_bound[k] <= tolerance)
    return Mode(
        k + 1, hz, HERTZ * hz, *beside, (lower, upper), indexed, motion, is_rigid, missed and tolerance < np.inf
    )


def _pair(M: Any, shapes: Array, values: Array, reference: Eigenpairs) -> tuple[Array, list[float]]:
    """For each low-order mode the full-order one that it stands for (-1: none), and their MAC (theory eq. 57).

    Modes of a repeated frequency are compared as a space: any rotation within it is the same motion.
    """
    from scipy.optimize import linear_sum_assignment

    overlap = (reference.vectors.T @ (M @ shapes)) ** 2 / np.einsum("ik,ik->k", shapes, M @ shapes)
    close = np.abs(reference.values[:, None] - reference.values) <= REPEATED * np.abs(reference.values)
    close &= np.abs(reference.values[:, None] - reference.values) <= REPEATED * np.abs(reference.values[:, None])
    space = np.minimum(close @ overlap, 1.0)
    distance = np.abs(np.sqrt(np.abs(reference.values))[:, None] - np.sqrt(np.abs(values)))
    cost = -space + 1e-6 * distance / max(float(distance.max(initial=0.0)), np.finfo(float).tiny)
    rows, columns = linear_sum_assignment(cost)
    partner = np.full(len(values), -1)
    for row, column in zip(rows, columns, strict=True):
        if space[row, column] >= SAME_MODE:
            partner[column] = row
    return partner, [float(space[partner[k], k]) if partner[k] >= 0 else 0.0 for k in range(len(values))]


def unproven(modes: tuple[Mode, ...], certified: Certificate, tolerance: float) -> tuple[Exceeded, ...]:
    """What is beyond the tolerance, missing or not proven."""
    found = []
    for mode in modes:
        if mode.missed:
            bound = float(certified.error_bound[mode.number - 1]) if mode.is_indexed else np.inf
            how = f"only within {_percent(bound)}" if np.isfinite(bound) else "not"
            text = (
                f"mode {mode.number}: {mode.frequency_text} Hz is {how} proven, not within the {tolerance:g} asked for;"
                " reduce to a tolerance, or keep more modes"
            )
            found.append(Exceeded("tolerance", f"mode {mode.number}", bound, tolerance, "1", text))
        if mode.frequency_hz == 0 and not mode.is_rigid:
            text = (
                f"mode {mode.number}: {mode.frequency_text} Hz cannot be told from zero, and is no rigid motion of the"
                " mechanism; look for a spring or a member softer than round-off of what is beside it"
            )
            found.append(Exceeded("proof", f"mode {mode.number}", mode.interval_hz[1] or np.inf, 0.0, "Hz", text))
    below, count = certified.below_hz, float(certified.count)
    if not certified.is_counted:
        text = f"round-off hides how many modes lie below {below:.5g} Hz: {certified.count} at most"
        found.append(Exceeded("proof", "", count, float(certified.found), "1", text))
    elif certified.missing > 0:
        text = f"the model lacks {certified.missing} of the {certified.count} modes below {below:.5g} Hz"
        found.append(Exceeded("proof", "", count, float(certified.found), "1", text))
    return tuple(found)


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"


def with_mesh_errors(
    model: FullOrderModel, found: tuple[Mode, ...], u: Array
) -> tuple[tuple[Mode, ...], tuple[Exceeded, ...]]:
    """The modes of shapes u (n_nodes, 6, n) with what the meshes of solid parts leave uncertain, and warnings of it."""
    errors = frequency_errors(model, u, np.array([mode.frequency_hz for mode in found]))
    if errors is None:
        return found, ()
    off = (errors.share / 2).tolist()
    told = tuple(replace(mode, mesh_error=error) for mode, error in zip(found, off, strict=True))
    places = [f"mode {mode.number}" for mode in found]
    said = [
        mesh_warning(place, f"{place}: {mode.frequency_text} Hz", error, part)
        for place, mode, error, part in zip(places, found, off, errors.part, strict=True)
    ]
    return told, tuple(w for w in said if w is not None)


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
    said = (*unproven(found, certified, tolerance), *meshes)
    limit = min(tolerance, TOLERANCE)
    return Modes(name, order, model.order, found, evidence, u, names, parameters, model, certified, steps, limit, said)
