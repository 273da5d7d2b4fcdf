"""Natural frequencies and mode shapes, low-order and full-order side by side, each with its proven interval, and what
is missing, not proven, or beyond the tolerance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from flexura.analysis.limits import pose_limits
from flexura.analysis.model_error import ModelError, model_errors_of_modes
from flexura.analysis.natural_modes.evidence import Evidence, MissedMode, mass_evidence
from flexura.analysis.strain import LIMIT, Motion, frequency_errors, mesh_warning, motions
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import stage
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import assemble, plan_of
from flexura.linalg import Eigenpairs, Pencil, lowest, residuals
from flexura.mechanism import Mechanism
from flexura.modal import REPEATED, close_groups, mac_with_spaces, pair_by_mac
from flexura.records import Record
from flexura.reduction import (
    HERTZ,
    RESOLVED,
    Certificate,
    ChainedModel,
    LowOrderModel,
    Reduction,
    SplitModel,
    certificate,
    chained,
    lowest_pairs,
    model_pairs,
    proven_text,
    reduce,
    reduction_of,
    split,
    state_of,
)
from flexura.results import Tabular, plain
from flexura.structure import FullOrderModel, Plan, full_order_model, one_design
from flexura.tables import Facts, Table, in_hz, quantity
from flexura.thresholds import PROVEN

LARGEST = 30_000
"""Up to this full order its own modes are worked out beside those of the low order."""

EXTRA = 60
"""At most so many full-order modes beyond the reported ones are computed to name what a reduction misses."""


@dataclass(frozen=True, repr=False)
class Mode(Record):
    """One mode.

    `relative_error` is the low-order frequency over the full-order one, less one; `mac` the mass-weighted modal
    assurance criterion of the pair. All three are None when the low-order mode has no counterpart, or the full-order
    model was too large to be solved beside it. `interval_hz` is proven to contain a full-order frequency, that of the
    same number where `is_indexed` (see `Certificate`); an end that is not proven is None. `is_rigid` says that the
    frequency is zero: its interval holds zero, and a rigid motion that strains nothing represents it. `missed` says
    that the interval is wider than the tolerance that was asked for. `mesh_error` estimates how far off, relative, the
    frequency may be for the meshes of solid parts, which no interval knows of; None where no part tells.
    """

    _shown = ("number", "frequency_text", "motion")

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
        """The frequency in five digits with its unit, or a bound where round-off hides whether it is zero."""
        if self.frequency_hz > 0 or self.is_rigid:
            return quantity(self.frequency_hz, "Hz")
        upper = self.interval_hz[1]
        return "unknown" if upper is None else f"below {in_hz(upper, 2)}"

    @property
    def frequency_cell(self) -> float | str:
        """The frequency, Hz, where it is known, and else `frequency_text`: for a column of frequencies."""
        return self.frequency_hz if self.frequency_hz > 0 or self.is_rigid else self.frequency_text

    @property
    def proven_text(self) -> str:
        """How far the frequency can be from that of the full order, in words."""
        return proven_text(self.frequency_hz, self.interval_hz, self.is_indexed, self.is_rigid)

    @property
    def difference_text(self) -> str:
        """Relative difference of the pair, with its MAC where the two shapes differ visibly; empty without a pair."""
        if self.relative_error is None or self.mac is None:
            return ""
        if abs(self.relative_error) < RESOLVED:
            return f"below {100 * RESOLVED:g} %"
        return f"{100 * self.relative_error:+.2g} %" + (f" (MAC {self.mac:.2f})" if self.mac < 0.98 else "")

    @property
    def flag(self) -> str:
        """What is wrong with the frequency, in a few words; empty where it is within its limits."""
        if self.frequency_hz == 0 and not self.is_rigid:
            return "is indistinguishable from zero"
        if not self.missed:
            off = self.mesh_error or 0.0
            return f"meshes leave {_percent(off)} open" if off > LIMIT else ""
        lower, upper = self.interval_hz
        if not (self.is_indexed and lower and upper is not None):
            return "not proven"
        return f"proven only within {_percent(max(upper - self.frequency_hz, self.frequency_hz - lower) / lower)}"


@dataclass(frozen=True)
class Modes(Tabular):
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
    tolerance: float = PROVEN
    """Relative error that every frequency is held against."""
    warnings: tuple[Diagnostic, ...] = ()
    """What is missing, not proven, or beyond the tolerance."""

    @cached_property
    def model_errors(self) -> ModelError:
        """How far the part that is drawn may be from the description, mode by mode, with what makes it so."""
        return model_errors_of_modes(self.model, len(self.modes))[0]

    @property
    def model_error(self) -> tuple[tuple[float, float] | None, ...]:
        """Of each mode, where the frequency of the part lies: between 1 + low and 1 + high times the one given; None
        where there is no evidence."""
        return self.model_errors.intervals

    def __repr__(self) -> str:
        hz = ", ".join(f"{mode.frequency_hz:.5g}" for mode in self.modes)
        missing = "" if self.evidence.complete else ", modes missing"
        return f"Modes({self.name!r}, order {self.order} of {self.full_order}, {hz} Hz{missing})"

    @property
    def notes(self) -> tuple[str, ...]:
        """The steps of the reduction."""
        return self.steps

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

    def _data(self) -> dict[str, Any]:
        """Everything but the shapes."""
        return {
            "name": self.name,
            "order": self.order,
            "full_order": self.full_order,
            "parameters": self.parameters,
            "tolerance": self.tolerance,
            "modes": [
                {**plain(mode), "model_error": error, "model_error_reason": reason}
                for mode, error, reason in zip(self.modes, self.model_error, self.model_errors.reason, strict=True)
            ],
            "certificate": self.certificate,
            "evidence": {**asdict(self.evidence), "complete": self.evidence.complete},
        }

    def _columns(self) -> dict[str, Any]:
        return {
            "mode": [m.number for m in self.modes],
            "frequency [Hz]": self.frequency_hz,
            "full frequency [Hz]": self.full_frequency_hz,
            "relative error": [m.relative_error for m in self.modes],
            "lower [Hz]": [m.interval_hz[0] for m in self.modes],
            "upper [Hz]": [m.interval_hz[1] for m in self.modes],
            "model error, lower": self.model_errors.low,
            "model error, upper": self.model_errors.high,
            "mac": [m.mac for m in self.modes],
            "what moves": [m.motion.summary for m in self.modes],
        }

    def _title(self) -> str:
        full = self.evidence.low_residual is None
        return f"full order {self.order}" if full else f"order {self.order}, full order {self.full_order}"

    def _view(self) -> Iterator[Facts | Table]:
        rows: dict[str, list[Any]] = {
            "mode": [m.number for m in self.modes],
            "frequency [Hz]": [m.frequency_cell for m in self.modes],
            "proven": [m.proven_text for m in self.modes],
            "model error": list(self.model_errors.texts),
            "what moves": [m.motion.summary for m in self.modes],
        }
        if any(flags := [m.flag for m in self.modes]):
            rows["flag"] = flags
        yield Table(rows, "modes")
        mass = self.evidence.model_mass.mass
        yield Facts({"mass": quantity(mass, "kg"), "completeness": self.certificate.text})


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
        return _low_modes(full, model, min(n, model.order), one_design(model.parameters), PROVEN)
    plan, single = plan_of(model, parameters), one_design(parameters)
    stage("assembling the full order")
    full = assemble(plan, single)
    if full.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    if order == "full" and given:
        raise OptionError(f"{next(iter(given))} belongs to order low")
    if order == "full" and (parts := split(full)) is not None:
        return _split_modes(parts, n, single)
    if order == "full":
        return _full_modes(chained(full), min(n, full.order), single)
    wanted = reduction_of(plan, given, n)
    low = reduce(full, **wanted)
    if wanted.get("up_to") is not None:
        n = low.order
    if low.order == 0:
        raise OptionError("every node that the low-order model keeps is held; keep normal modes, or ask for order full")
    return _low_modes(chained(full), low, min(n, low.order), single, wanted.get("tolerance", PROVEN))


def _split_modes(parts: SplitModel, n: int, parameters: dict[str, float]) -> Modes:
    """The `n` lowest modes of a full-order model that is split by its equal branches."""
    proof, pairs, full = parts.certificate(n), parts.lowest(n), parts.model
    u = full.node_displacements(pairs.vectors)
    modes = [  # a model is split only where its stiffness is definite: nothing is rigid
        _mode(k, proof, motion, (float(proof.frequency_hz[k]), 0.0, 1.0), free=0, tolerance=PROVEN)
        for k, motion in enumerate(motions(full, u))
    ]
    return _result(
        full,
        proof,
        modes,
        u,
        order=full.order,
        parameters=parameters,
        steps=(parts.summary, *state_of(full.design)),
        tolerance=PROVEN,
        full_residual=parts.residual(n),
    )


def _full_modes(full: ChainedModel, n: int, parameters: dict[str, float]) -> Modes:
    pairs = lowest_pairs(full, n)
    proof = certificate(full, pairs, n)
    u = full.model.node_displacements(full.recover(pairs.vectors[:, :n]))
    modes = [
        _mode(k, proof, motion, (float(proof.frequency_hz[k]), 0.0, 1.0), free=full.free_motions, tolerance=np.inf)
        for k, motion in enumerate(motions(full.model, u))
    ]
    return _result(
        full.model,
        proof,
        modes,
        u,
        order=full.model.order,
        parameters=parameters,
        steps=state_of(full.model.design),
        tolerance=np.inf,
        full_residual=_residual(full.pencil, pairs),
    )


def _low_modes(full: ChainedModel, low: LowOrderModel, n: int, parameters: dict[str, float], tolerance: float) -> Modes:
    pairs = model_pairs(low, full, n)
    n = min(n, len(pairs.values))
    if n == 0:
        raise OptionError("the mechanism has no mass")
    proof = low.certificate
    if proof is None or len(proof.frequency_hz) < n:
        proof = certificate(full, pairs, n)
    # full-order modes to stand beside the low-order ones, none where the full order is too large
    reference = Eigenpairs(np.empty(0), np.empty((full.pencil.order, 0)))
    if full.model.order <= LARGEST:
        reference = lowest_pairs(full, min(max(proof.count, len(proof.frequency_hz)), n + EXTRA))
    full_hz = np.sqrt(reference.values) / HERTZ
    count = max(n, len(proof.frequency_hz))
    pairs = Eigenpairs(pairs.values[:count], pairs.vectors[:, :count])
    # of each low-order mode the full-order one that it represents (-1: none), and their MAC (theory eq. 57)
    omega, full_omega = (np.sqrt(np.abs(own.values)) for own in (pairs, reference))
    overlap = mac_with_spaces(reference.vectors, pairs.vectors, close_groups(full_omega, REPEATED), full.pencil.M)
    partner = pair_by_mac(overlap, full_omega, omega)
    u = full.model.node_displacements(full.recover(pairs.vectors[:, :n]))
    modes = []
    for k, motion in enumerate(motions(full.model, u)):
        counterpart = None
        if partner[k] >= 0:
            hz, other = float(proof.frequency_hz[k]), float(full_hz[partner[k]])
            counterpart = (other, hz / other - 1 if other else 0.0, float(overlap[partner[k], k]))
        modes.append(_mode(k, proof, motion, counterpart, free=full.free_motions, tolerance=tolerance))
    lost = np.setdiff1d(np.flatnonzero(full_hz <= proof.below_hz), partner) if proof.missing > 0 else []
    lost_motions = motions(full.model, full.model.node_displacements(full.recover(reference.vectors[:, lost])))
    missed = tuple(MissedMode(float(full_hz[i]), m.summary) for i, m in zip(lost, lost_motions, strict=True))
    return _result(
        full.model,
        proof,
        modes,
        u,
        order=low.order,
        parameters=parameters,
        steps=low.steps,
        tolerance=tolerance,
        full_residual=_residual(full.pencil, reference),
        low_residual=_residual(Pencil.of(low.K, low.M), lowest(low.K, low.M, n)),
        missed=missed,
    )


def _mode(
    k: int,
    proof: Certificate,
    motion: Motion,
    counterpart: tuple[float, float, float] | None,
    *,
    free: int,
    tolerance: float,
) -> Mode:
    """Mode k of a certificate, with the frequency, the relative error and the MAC of its full-order counterpart, where
    `free` rigid motions strain nothing."""
    hz, indexed = float(proof.frequency_hz[k]), bool(proof.is_indexed[k])
    lower, upper = (float(end[k]) if np.isfinite(end[k]) else None for end in (proof.lower_hz, proof.upper_hz))
    is_rigid = hz == 0.0 and k < free and lower == 0.0
    is_within = is_rigid or tolerance == np.inf or (indexed and proof.error_bound[k] <= tolerance)
    full_hz, error, mac = counterpart or (None, None, None)
    return Mode(
        k + 1, hz, HERTZ * hz, full_hz, error, mac, (lower, upper), indexed, motion, is_rigid, missed=not is_within
    )


def _residual(pencil: Pencil, pairs: Eigenpairs) -> float | None:
    return float(residuals(pencil, pairs).max()) if len(pairs.values) else None


def _result(
    full: FullOrderModel,
    proof: Certificate,
    modes: Sequence[Mode],
    u: Array,
    *,
    order: int,
    parameters: dict[str, float],
    steps: tuple[str, ...],
    tolerance: float,
    full_residual: float | None,
    low_residual: float | None = None,
    missed: tuple[MissedMode, ...] = (),
) -> Modes:
    """The result of modes of shapes u (n_nodes, 6, n), with its evidence and warnings."""
    evidence = Evidence(
        **mass_evidence(full),
        rigid_body_modes=sum(mode.is_rigid for mode in modes),
        full_residual=full_residual,
        low_residual=low_residual,
        sturm_below_hz=proof.below_hz,
        sturm_count=proof.count,
        reported_below=proof.found,
        missed=missed,
        more_missed=max(proof.missing - len(missed), 0),
        is_counted=proof.is_counted,
    )
    modes, mesh_warnings = _with_mesh_errors(full, modes, u)
    return Modes(
        name=full.plan.mechanism.name,
        order=order,
        full_order=full.order,
        modes=tuple(modes),
        evidence=evidence,
        shapes=u,
        node_names=tuple(full.plan.topology.node_names),
        parameters=parameters,
        model=full,
        certificate=proof,
        steps=steps,
        tolerance=min(tolerance, PROVEN),
        warnings=(*_unproven(modes, proof, tolerance), *mesh_warnings, *pose_limits(full)),
    )


def _unproven(modes: Sequence[Mode], proof: Certificate, tolerance: float) -> Iterator[Diagnostic]:
    """What is beyond the tolerance, missing or not proven."""
    for mode in modes:
        place = f"mode {mode.number}"
        if mode.missed:
            bound = float(proof.error_bound[mode.number - 1]) if mode.is_indexed else np.inf
            within = f"only within {_percent(bound)}" if np.isfinite(bound) else "not"
            text = (
                f"{place}: {mode.frequency_text} is {within} proven, not within the {tolerance:g} asked for;"
                " reduce to a tolerance, or keep more modes"
            )
            yield Diagnostic("tolerance", place, bound, tolerance, "1", text)
        if mode.frequency_hz == 0 and not mode.is_rigid:
            text = (
                f"{place}: {mode.frequency_text} is indistinguishable from zero, and is no rigid motion"
                " of the mechanism; look for a spring or a member softer than round-off of what is beside it"
            )
            yield Diagnostic("proof", place, mode.interval_hz[1] or np.inf, 0.0, "Hz", text)
    text = ""
    if not proof.is_counted:
        text = f"round-off hides how many modes lie below {in_hz(proof.below_hz)}: {proof.count} at most"
    elif proof.missing > 0:
        text = f"the model lacks {proof.missing} of the {proof.count} modes below {in_hz(proof.below_hz)}"
    if text:
        yield Diagnostic("proof", "", float(proof.count), float(proof.found), "1", text)


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"


def _with_mesh_errors(
    model: FullOrderModel, modes: Sequence[Mode], u: Array
) -> tuple[Sequence[Mode], list[Diagnostic]]:
    """The modes of shapes u (n_nodes, 6, n) with what the meshes of solid parts leave uncertain, and warnings of it."""
    errors = frequency_errors(model, u, np.array([mode.frequency_hz for mode in modes]))
    if errors is None:
        return modes, []
    modes = [replace(mode, mesh_error=share / 2) for mode, share in zip(modes, errors.share.tolist(), strict=True)]
    warnings = []
    for mode, part in zip(modes, errors.part, strict=True):
        place = f"mode {mode.number}"
        warnings.append(mesh_warning(place, f"{place}: {mode.frequency_text}", mode.mesh_error or 0.0, part))
    return modes, [warning for warning in warnings if warning is not None]
