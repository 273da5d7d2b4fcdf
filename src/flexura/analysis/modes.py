"""Natural frequencies and mode shapes, low-order and full-order side by side, with evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.evidence import Evidence, MissedMode, mass_evidence
from flexura.analysis.motion import Motion, motions
from flexura.errors import Exceeded, OptionError, Warned
from flexura.linalg import Eigenpairs, count_below, lowest, residuals
from flexura.mechanism.substructure import Mechanism
from flexura.reduction import Certificate, LowOrderModel, certify, reduce
from flexura.reduction.certificate import certificate
from flexura.reduction.equal_branches import split
from flexura.reduction.low_order import Method
from flexura.reduction.model import STATE
from flexura.structure import FullOrderModel, Plan, assemble
from flexura.structure.plan import one_design, plan_of

Array = NDArray[np.float64]

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
    assurance criterion of the pair. All three are None when the low-order mode has no counterpart. `interval_hz` is
    proven to contain a full-order frequency, that of the same number where `is_indexed` (see `Certificate`); an end
    that is not proven is None.
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
    warnings: tuple[Exceeded, ...] = ()

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
            "modes": [asdict(mode) for mode in self.modes],
            "certificate": self.certificate.to_dict(),
            "evidence": {**asdict(self.evidence), "complete": self.evidence.complete},
            "warnings": [w.to_dict() for w in self.warnings],
        }


def modes(
    mechanism: Mechanism | Plan | LowOrderModel,
    parameters: Mapping[str, float] | None = None,
    *,
    n: int = 6,
    order: Literal["low", "full"] = "low",
    keep: int | Mapping[str, int] = 0,
    keep_below: float = 0.0,
    reduction: Method = "craig_bampton",
    tolerance: float | None = None,
    up_to: float | None = None,
) -> Modes:
    """The `n` lowest modes of the low-order model beside their full-order counterparts, or of the full model alone.

    `parameters` replace default values; `keep`, `keep_below` (Hz), `tolerance`, `up_to` (Hz) and the method `reduction`
    as in `reduce`. With a tolerance the modes are all those up to `up_to`, whatever n is. A model that `reduce` has
    made may stand in place of the mechanism. Raises ModelError, OptionError and SolverError.
    """
    if not isinstance(n, int | np.integer) or n < 1:
        raise OptionError(f"the number of modes is a whole number, at least 1, not {n!r}")
    if order not in ("low", "full"):
        raise OptionError(f"order is low or full, not {order!r}")
    if isinstance(mechanism, LowOrderModel):
        reduced = keep or keep_below or reduction != "craig_bampton" or tolerance is not None or up_to is not None
        if parameters or order == "full" or reduced:
            raise OptionError("a reduced model has its design and its reduction already; only n can be asked of it")
        full = assemble(mechanism.plan, mechanism.parameters)
        return _low_modes(full, mechanism, min(n, mechanism.order), dict(mechanism.parameters))
    plan, single = plan_of(mechanism), one_design(parameters)
    full = assemble(plan, single)
    if full.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    if order == "full" and (parts := split(full)) is not None:
        from flexura.analysis.split_modes import split_modes

        return split_modes(parts, n, single)
    if order == "full":
        return _full_modes(full, min(n, full.order), single)
    low = reduce(plan, single, keep=keep, keep_below=keep_below, method=reduction, tolerance=tolerance, up_to=up_to)
    if tolerance is not None:
        n = low.order
    if low.order == 0:
        raise OptionError("every node that the low-order model keeps is held; keep normal modes, or ask for order full")
    return _low_modes(full, low, min(n, low.order), single)


def _full_modes(full: FullOrderModel, n: int, parameters: dict[str, float]) -> Modes:
    more = _finite(lowest(full.K, full.M, n + 2))
    proof = certificate(full.K, full.M, more, n)
    pairs = Eigenpairs(more.values[:n], more.vectors[:, :n])
    u = full.node_displacements(pairs.vectors)
    hz = np.sqrt(np.maximum(pairs.values, 0)) / (2 * np.pi)
    found = tuple(
        Mode(k + 1, float(f), float(2 * np.pi * f), float(f), 0.0, 1.0, *_interval(proof, k), motion)
        for k, (f, motion) in enumerate(zip(hz, motions(full, u), strict=True))
    )
    below, count = _sturm(full, pairs.values, -1)
    reported = int((hz < below).sum())
    evidence = Evidence(
        **mass_evidence(full),
        rigid_body_modes=int((pairs.values == 0).sum()),
        full_residual=float(residuals(full.K, full.M, pairs).max()),
        low_residual=None,
        sturm_below_hz=below,
        sturm_count=count,
        reported_below=reported,
        missed=(),
        more_missed=count - reported,
    )
    steps = (STATE,) if full.plan.is_loaded else ()
    return _result(full, full.order, found, evidence, u, parameters, proof, steps)


def _low_modes(full: FullOrderModel, low: LowOrderModel, n: int, parameters: dict[str, float]) -> Modes:
    pairs = _finite(lowest(low.K, low.M, n))
    below, count = _sturm(full, pairs.values, 1)
    # low-order modes that share the last frequency reported are needed to tell which full-order modes have none
    limit = (2 * np.pi * below) ** 2
    low_count = min(max(count_below(low.K, low.M, limit), len(pairs.values)), count)
    if low_count > len(pairs.values):
        pairs = _finite(lowest(low.K, low.M, min(low_count, n + EXTRA)))
    reference = _finite(lowest(full.K, full.M, min(max(count, len(pairs.values)), n + EXTRA)))
    shapes = low.recover(pairs.vectors)
    partner, mac = _pair(full, shapes, pairs.values, reference)
    full_hz = np.sqrt(np.maximum(reference.values, 0)) / (2 * np.pi)
    u = full.node_displacements(shapes[:, :n])
    proof = low.certificate
    if proof is None or len(proof.frequency_hz) < n:
        proof = certify(low, full, n=n)
    found = tuple(_mode(k, pairs, full_hz, partner, mac, proof, motion) for k, motion in enumerate(motions(full, u)))
    lost = np.setdiff1d(np.flatnonzero(full_hz <= below), partner) if count > low_count else np.empty(0, dtype=np.intp)
    lost_motions = motions(full, full.node_displacements(reference.vectors[:, lost]))
    evidence = Evidence(
        **mass_evidence(full),
        rigid_body_modes=int((reference.values == 0).sum()),
        full_residual=float(residuals(full.K, full.M, reference).max()),
        low_residual=float(residuals(low.K, low.M, pairs).max()),
        sturm_below_hz=below,
        sturm_count=count,
        reported_below=low_count,
        missed=tuple(
            MissedMode(float(full_hz[i]), motion.summary) for i, motion in zip(lost, lost_motions, strict=True)
        ),
        more_missed=max(count - low_count - len(lost), 0),
    )
    return _result(full, low.order, found, evidence, u, parameters, proof, low.steps)


def _mode(
    k: int, pairs: Eigenpairs, full_hz: Array, partner: Array, mac: list[float], proof: Certificate, motion: Motion
) -> Mode:
    hz = float(np.sqrt(max(pairs.values[k], 0.0)) / (2 * np.pi))
    if partner[k] < 0:
        return Mode(k + 1, hz, 2 * np.pi * hz, None, None, None, *_interval(proof, k), motion)
    beside = float(full_hz[partner[k]])
    error = hz / beside - 1 if beside else 0.0
    return Mode(k + 1, hz, 2 * np.pi * hz, beside, error, mac[k], *_interval(proof, k), motion)


def _interval(proof: Certificate, k: int) -> tuple[tuple[float | None, float | None], bool]:
    """The proven interval of a frequency, and whether it is for that of the same number."""
    lower, upper = (float(bound[k]) if np.isfinite(bound[k]) else None for bound in (proof.lower_hz, proof.upper_hz))
    return (lower, upper), bool(proof.is_indexed[k])


def _finite(pairs: Eigenpairs) -> Eigenpairs:
    """Leave out infinite eigenvalues, which belong to DOFs without mass."""
    finite = np.isfinite(pairs.values)
    if not finite.any():
        raise OptionError("the mechanism has no mass")
    return Eigenpairs(pairs.values[finite], pairs.vectors[:, finite])


def _sturm(full: FullOrderModel, values: Array, side: int) -> tuple[float, int]:
    """A frequency, Hz, just above (side 1) or below (-1) the highest of `values`, and the number of full-order
    eigenvalues below it."""
    top = float(values.max())
    limit = top * (1 + 2 * side * REPEATED)
    if top == 0.0:
        d = full.K.diagonal()
        limit = 1e-12 * float(d.sum() / full.M.diagonal().sum())
    return float(np.sqrt(limit) / (2 * np.pi)), count_below(full.K, full.M, limit)


def _pair(full: FullOrderModel, shapes: Array, values: Array, reference: Eigenpairs) -> tuple[Array, list[float]]:
    """For each low-order mode the full-order one that it stands for (-1: none), and their MAC (theory eq. 57).

    Modes of a repeated frequency are compared as a space: any rotation within it is the same motion.
    """
    from scipy.optimize import linear_sum_assignment

    overlap = (reference.vectors.T @ (full.M @ shapes)) ** 2 / np.einsum("ik,ik->k", shapes, full.M @ shapes)
    close = np.abs(reference.values[:, None] - reference.values) <= REPEATED * np.abs(reference.values)
    close &= np.abs(reference.values[:, None] - reference.values) <= REPEATED * np.abs(reference.values[:, None])
    space = np.minimum(close @ overlap, 1.0)
    distance = np.abs(np.sqrt(np.abs(reference.values))[:, None] - np.sqrt(np.abs(values)))
    cost = -space + 1e-6 * distance / max(float(distance.max()), np.finfo(float).tiny)
    rows, columns = linear_sum_assignment(cost)
    partner = np.full(len(values), -1)
    for row, column in zip(rows, columns, strict=True):
        if space[row, column] >= SAME_MODE:
            partner[column] = row
    return partner, [float(space[partner[k], k]) for k in range(len(values))]


def _result(
    full: FullOrderModel,
    order: int,
    found: tuple[Mode, ...],
    evidence: Evidence,
    u: Array,
    parameters: dict[str, float],
    proof: Certificate,
    steps: tuple[str, ...],
) -> Modes:
    names = tuple(full.plan.topology.node_names)
    name = full.plan.mechanism.name
    return Modes(name, order, full.order, found, evidence, u, names, parameters, full, proof, steps)
