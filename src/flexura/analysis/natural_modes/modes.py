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
from flexura.analysis.natural_modes.evidence import Evidence, mass_evidence
from flexura.analysis.natural_modes.solved import Solved, solved_full, solved_low
from flexura.analysis.strain import (
    LIMIT,
    Motion,
    frequency_errors,
    mesh_warning,
    motions,
    part_warnings,
    plate_warnings,
)
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import stage
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import assemble, plan_of
from flexura.mechanism import Mechanism
from flexura.records import Record
from flexura.reduction import (
    HERTZ,
    RESOLVED,
    Certificate,
    LowOrderModel,
    Reduction,
    proven_text,
    reduce,
    reduction_of,
)
from flexura.results import Tabular, plain
from flexura.structure import FullOrderModel, Plan, full_order_model, one_design
from flexura.tables import Item, Table, in_hz, quantity
from flexura.thresholds import PROVEN


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
        return (
            f"full model, order {self.order}" if full else f"low-order model, order {self.order} of {self.full_order}"
        )

    def presentation(self) -> Iterator[Item]:
        """Frequencies of both models, what moves, and the evidence."""
        modes = self.modes
        rows: dict[str, list[Any]] = {
            "mode": [m.number for m in modes],
            "frequency [Hz]": [m.frequency_cell for m in modes],
            "rad/s": [m.angular_frequency for m in modes],
        }
        if self.evidence.low_residual is not None and any(m.full_frequency_hz is not None for m in modes):
            rows["full [Hz]"] = ["none" if m.full_frequency_hz is None else m.full_frequency_hz for m in modes]
            rows["difference"] = [m.difference_text for m in modes]
        rows |= {"proven": [m.proven_text for m in modes], "model error": [*self.model_errors.texts]}
        if any(m.mesh_error is not None for m in modes):
            rows["meshes"] = ["" if m.mesh_error is None else f"within {_percent(m.mesh_error)}" for m in modes]
        yield Table({**rows, "what moves": [m.motion.summary for m in modes]}, "modes")
        yield from self.evidence.presentation()


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
        solved = solved_low(full_order_model(model.design), model, min(n, model.order), PROVEN)
        return _result(solved, one_design(model.parameters))
    plan, single = plan_of(model, parameters), one_design(parameters)
    stage("assembling the full order")
    full = assemble(plan, single)
    if full.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    if order == "full" and given:
        raise OptionError(f"{next(iter(given))} belongs to order low")
    if order == "full":
        return _result(solved_full(full, n), single)
    wanted = reduction_of(plan, given, n)
    low = reduce(full, **wanted)
    if wanted.get("up_to") is not None:
        n = low.order
    if low.order == 0:
        raise OptionError("every node that the low-order model keeps is held; keep normal modes, or ask for order full")
    return _result(solved_low(full, low, min(n, low.order), wanted.get("tolerance", PROVEN)), single)


def _result(solved: Solved, parameters: dict[str, float]) -> Modes:
    """The modes that are solved, with what moves in them, evidence and warnings."""
    full, proof, u = solved.model, solved.proof, solved.shapes
    modes = [_mode(k, solved, motion) for k, motion in enumerate(motions(full, u))]
    evidence = Evidence(
        **mass_evidence(full),
        rigid_body_modes=sum(mode.is_rigid for mode in modes),
        full_residual=solved.full_residual,
        low_residual=solved.low_residual,
        sturm_below_hz=proof.below_hz,
        sturm_count=proof.count,
        reported_below=proof.found,
        missed=solved.missed,
        more_missed=max(proof.missing - len(solved.missed), 0),
        is_counted=proof.is_counted,
    )
    modes, mesh_warnings = _with_mesh_errors(full, modes, u)
    return Modes(
        name=full.plan.mechanism.name,
        order=solved.order,
        full_order=full.order,
        modes=tuple(modes),
        evidence=evidence,
        shapes=u,
        node_names=tuple(full.plan.topology.node_names),
        parameters=parameters,
        model=full,
        certificate=proof,
        steps=solved.steps,
        tolerance=min(solved.tolerance, PROVEN),
        warnings=(
            *_unproven(modes, proof, solved.tolerance),
            *mesh_warnings,
            *part_warnings(full, np.array([mode.frequency_hz for mode in modes])),
            *plate_warnings(full, max(mode.frequency_hz for mode in modes)),
            *pose_limits(full),
        ),
    )


def _mode(k: int, solved: Solved, motion: Motion) -> Mode:
    """Mode k of those that are solved."""
    proof, tolerance = solved.proof, solved.tolerance
    hz, indexed = float(proof.frequency_hz[k]), bool(proof.is_indexed[k])
    lower, upper = (float(end[k]) if np.isfinite(end[k]) else None for end in (proof.lower_hz, proof.upper_hz))
    is_rigid = hz == 0.0 and k < solved.free and lower == 0.0
    is_within = is_rigid or tolerance == np.inf or (indexed and proof.error_bound[k] <= tolerance)
    full_hz, error, mac = solved.counterparts[k] or (None, None, None)
    return Mode(
        k + 1, hz, HERTZ * hz, full_hz, error, mac, (lower, upper), indexed, motion, is_rigid, missed=not is_within
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
