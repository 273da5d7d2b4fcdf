"""Modes as results: each with its proven interval, and what is missing, not proven, or beyond the tolerance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexura.analysis.model_error import ModelError, model_errors_of_modes
from flexura.analysis.natural_modes.evidence import Evidence
from flexura.analysis.strain import LIMIT, Motion, frequency_errors, mesh_warning
from flexura.arrays import Array
from flexura.errors import Diagnostic
from flexura.records import Record
from flexura.reduction import HERTZ, RESOLVED, TOLERANCE, Certificate, proven_text
from flexura.results import Tabular, plain
from flexura.structure import FullOrderModel
from flexura.tables import Facts, Table, in_hz, quantity


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
    tolerance: float = TOLERANCE
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
                {**plain(mode), "model_error": own, "model_error_reason": reason}
                for mode, own, reason in zip(self.modes, self.model_error, self.model_errors.reason, strict=True)
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


def unproven(modes: tuple[Mode, ...], certified: Certificate, tolerance: float) -> tuple[Diagnostic, ...]:
    """What is beyond the tolerance, missing or not proven."""
    found = []
    for mode in modes:
        if mode.missed:
            bound = float(certified.error_bound[mode.number - 1]) if mode.is_indexed else np.inf
            how = f"only within {_percent(bound)}" if np.isfinite(bound) else "not"
            text = (
                f"mode {mode.number}: {mode.frequency_text} is {how} proven, not within the {tolerance:g} asked for;"
                " reduce to a tolerance, or keep more modes"
            )
            found.append(Diagnostic("tolerance", f"mode {mode.number}", bound, tolerance, "1", text))
        if mode.frequency_hz == 0 and not mode.is_rigid:
            text = (
                f"mode {mode.number}: {mode.frequency_text} is indistinguishable from zero, and is no rigid motion"
                " of the mechanism; look for a spring or a member softer than round-off of what is beside it"
            )
            found.append(Diagnostic("proof", f"mode {mode.number}", mode.interval_hz[1] or np.inf, 0.0, "Hz", text))
    below, count = certified.below_hz, float(certified.count)
    if not certified.is_counted:
        text = f"round-off hides how many modes lie below {in_hz(below)}: {certified.count} at most"
        found.append(Diagnostic("proof", "", count, float(certified.found), "1", text))
    elif certified.missing > 0:
        text = f"the model lacks {certified.missing} of the {certified.count} modes below {in_hz(below)}"
        found.append(Diagnostic("proof", "", count, float(certified.found), "1", text))
    return tuple(found)


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"


def with_mesh_errors(
    model: FullOrderModel, found: tuple[Mode, ...], u: Array
) -> tuple[tuple[Mode, ...], tuple[Diagnostic, ...]]:
    """The modes of shapes u (n_nodes, 6, n) with what the meshes of solid parts leave uncertain, and warnings of it."""
    errors = frequency_errors(model, u, np.array([mode.frequency_hz for mode in found]))
    if errors is None:
        return found, ()
    off = (errors.share / 2).tolist()
    told = tuple(replace(mode, mesh_error=error) for mode, error in zip(found, off, strict=True))
    places = [f"mode {mode.number}" for mode in found]
    said = [
        mesh_warning(place, f"{place}: {mode.frequency_text}", error, part)
        for place, mode, error, part in zip(places, found, off, errors.part, strict=True)
    ]
    return told, tuple(w for w in said if w is not None)
