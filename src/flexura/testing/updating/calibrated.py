"""The outcome of a calibration: parameters with intervals, modes before and after, what the data cannot determine.

And the model file of the calibrated mechanism.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener
from flexura.errors import Diagnostic, OptionError
from flexura.expressions import NUMBER
from flexura.files import write_file
from flexura.mechanism import Mechanism, parameter_dimensions
from flexura.modelfile import Changed, variant_text
from flexura.results import Tabular
from flexura.tables import Facts, Item, Line, Table, quantity
from flexura.testing.updating.posterior import (
    LEAST_REDUCTION,
    Direction,
    Misfit,
    Sample,
    effective_draws,
    metropolis,
    split_r_hat,
)
from flexura.testing.updating.problem import CalibrationProblem
from flexura.units import format_quantity

Method = Literal["map", "least_squares"]


@dataclass(frozen=True)
class CalibratedParameter:
    """One parameter, SI: `start` and calibrated `value`, and the `interval` that holds it with 95 %, infinite where
    the data say nothing and there is no prior.

    `prior` is the same interval beforehand and `reason` its origin. `variance_reduction` is the share of
    the prior variance that the data took away. At a bound the Gaussian approximation is not valid.
    """

    name: str
    unit: str
    start: float
    value: float
    interval: tuple[float, float]
    prior: tuple[float, float]
    reason: str
    variance_reduction: float
    at_bound: bool


@dataclass(frozen=True)
class CalibratedMode:
    """One measured frequency, Hz, with its relative standard deviation, and the model's before and after.

    `model_mode` counts from 1; MAC where shapes were measured. `configuration` says of which mechanism, where several
    were calibrated together.
    """

    number: int
    measured_hz: float
    sigma: float
    start_hz: float
    calibrated_hz: float
    model_mode: int
    start_mac: float | None
    mac: float | None
    configuration: str = ""

    @property
    def start_error(self) -> float:
        """Relative error before."""
        return self.start_hz / self.measured_hz - 1

    @property
    def error(self) -> float:
        """Relative error after."""
        return self.calibrated_hz / self.measured_hz - 1


@dataclass(frozen=True, repr=False)
class Calibration(Tabular):
    """The outcome of a calibration: the `mechanism` with its new values, and their uncertainties.

    `also` are the other mechanisms that were calibrated with it. `directions` are combinations of parameters, best
    known first; `correlation` (P, P) is that of the posterior. `chi_square` of `residuals` data says whether the model
    can meet them within their standard deviations, `misfits` how far it does for each kind of data beyond what the
    parameters take up, with which intervals are widened.
    """

    mechanism: Mechanism
    method: Method
    parameters: tuple[CalibratedParameter, ...]
    modes: tuple[CalibratedMode, ...]
    directions: tuple[Direction, ...]
    correlation: Array
    chi_square: float
    start_chi_square: float
    residuals: int
    evaluations: int
    converged: bool
    problem: CalibrationProblem = field(repr=False)
    z: Array = field(repr=False)
    covariance: Array = field(repr=False)
    also: tuple[Mechanism, ...] = ()
    misfits: tuple[Misfit, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()

    _shown = ("name", "method", "parameters", "chi_square")
    _plain = (
        *("directions", "correlation", "chi_square", "start_chi_square"),
        *("residuals", "evaluations", "converged", "misfits"),
    )

    @property
    def name(self) -> str:
        """Name of the first mechanism."""
        return self.mechanism.name

    @property
    def values(self) -> dict[str, float]:
        """The calibrated values by name, SI."""
        return {p.name: p.value for p in self.parameters}

    @property
    def unresolved(self) -> tuple[Direction, ...]:
        """Combinations of parameters that the data cannot determine."""
        return tuple(d for d in self.directions if d.variance_reduction < LEAST_REDUCTION)

    def sample(self, draws: int = 1000, seed: int = 0, progress: Listener | None = None) -> Sample:
        """Draws of the posterior with the model itself, which check the Gaussian intervals (theory eq. K19).

        They take the standard deviations of the data as they are, without an error of the model.

        `progress` is told of steps done and to do. Raises OptionError without a prior, when the posterior need not be
        proper.
        """
        if self.method != "map":
            raise OptionError("draws need a prior: calibrate with method map")
        if draws < 1:
            raise OptionError(f"the number of draws is at least 1, not {draws}")
        problem = self.problem

        def cost(z: Array) -> float:
            r = problem.residual(z)
            return float(r @ r + z @ z) / 2

        chains = metropolis(self.z, self.covariance, problem.unknown.z_bounds, cost, draws, seed, progress)
        values = problem.unknown.values(chains.z)
        flat = values.reshape(-1, len(self.z))
        return Sample(
            tuple(p.name for p in self.parameters),
            values,
            float(effective_draws(chains.z).min()),
            float(split_r_hat(chains.z).max()),
            chains.acceptance,
            flat.mean(axis=0),
            np.quantile(flat, [0.025, 0.975], axis=0).T,
            chains.is_whole,
            tuple(p.unit for p in self.parameters),
        )

    def _data(self) -> dict[str, Any]:
        """Everything but the mechanisms."""
        return {
            "name": self.name,
            "also": [mechanism.name for mechanism in self.also],
            "method": self.method,
            "parameters": self.parameters,
            "modes": [{**vars(m), "start_error": m.start_error, "error": m.error} for m in self.modes],
            **{name: getattr(self, name) for name in self._plain},
        }

    def _title(self) -> str:
        method = "maximum of the posterior" if self.method == "map" else "least squares"
        others = "".join(f", with {mechanism.name}" for mechanism in self.also)
        return f"calibrated{others}, {method}{'' if self.converged else ', not converged'}"

    def presentation(self) -> Iterator[Item]:
        """Parameters with intervals, frequencies before and after, and what the data cannot determine."""
        parameters, modes = self.parameters, self.modes
        columns = {
            "parameter": [p.name for p in parameters],
            "start": [quantity(p.start, p.unit, 4) for p in parameters],
            "calibrated": [quantity(p.value, p.unit, 4) + " at bound" * p.at_bound for p in parameters],
            "95 % interval": [" to ".join(quantity(end, p.unit, 4) for end in p.interval) for p in parameters],
            "variance reduction": [f"{100 * p.variance_reduction:.0f} %" for p in parameters],
            "prior from": [p.reason for p in parameters],
        }
        yield Table(columns, "parameters")
        of_modes: dict[str, list[Any]] = {
            "mode": [m.number for m in modes],
            "measured [Hz]": [m.measured_hz for m in modes],
            "start": [f"{100 * m.start_error:+.2f} %" for m in modes],
            "calibrated [Hz]": [m.calibrated_hz for m in modes],
            "error": [f"{100 * m.error:+.2f} %" for m in modes],
            "in sigma": [f"{m.error / m.sigma:+.1f}" for m in modes],
        }
        if any(m.mac is not None for m in modes):
            of_modes["MAC"] = ["" if m.mac is None else f"{m.mac:.3f}" for m in modes]
        if self.also:
            of_modes["of"] = [m.configuration for m in modes]
        yield Table(of_modes, "modes")
        chi_square = f"{self.start_chi_square:.4g} before, {self.chi_square:.4g} after, {self.residuals} data"
        yield Facts({"chi-square": f"{chi_square}; {self.evaluations} evaluations"})
        if self.unresolved:
            yield Line("the data cannot determine (weights in prior standard deviations):")
        for direction in self.unresolved:
            yield Line(f"  {direction}  ({100 * direction.variance_reduction:.0f} % variance reduction)")
        for misfit in self.misfits:
            if misfit.is_testable:
                missed = f"{misfit.ratio:.2g} standard deviations, {misfit.spare:.2g} of {misfit.data} to spare"
                yield Line(f"{misfit.kind}: missed by {missed}, probability {misfit.probability:.2g}")
        if self.is_model_wrong:
            yield Line("draws take sigma as it is: they do not have the error of the model that widens the intervals")

    @property
    def is_model_wrong(self) -> bool:
        """Whether the data are missed by more than their standard deviations."""
        return any(misfit.is_testable and misfit.ratio > 1 for misfit in self.misfits)

    def _columns(self) -> dict[str, Any]:
        """A row for each parameter, in the unit of its own."""
        parameters = self.parameters
        return {
            "parameter": [p.name for p in parameters],
            "unit": [p.unit for p in parameters],
            "start [SI]": [p.start for p in parameters],
            "value [SI]": [p.value for p in parameters],
            "lower [SI]": [p.interval[0] for p in parameters],
            "upper [SI]": [p.interval[1] for p in parameters],
            "variance reduction": [p.variance_reduction for p in parameters],
            "at bound": [p.at_bound for p in parameters],
        }


DIGITS = 6
"""Significant digits of calibrated values."""


@verb
def save_calibrated(calibration: Calibration, path: str | Path, *, base: str | Path, configuration: int = 0) -> Path:
    """Write a model file that extends `base`, the file that was calibrated, with the new values and what they rest on.

    Values have six digits. `configuration` counts the mechanisms that were calibrated together. Raises OptionError when
    it cannot be written.
    """
    mechanism = (calibration.mechanism, *calibration.also)[configuration]
    calibrated = calibration.problem.configurations[configuration]
    dimensions = parameter_dimensions(mechanism.parameters)
    moved = {p.name: p for p in calibration.parameters}
    changed = {}
    for name, value in calibrated.point(calibration.values).items():
        comment, digits = "", None
        if name in calibrated.free:
            p, exponents = moved[name], dimensions[name] or NUMBER
            low, high = (format_quantity(float(f"{x:.3g}"), exponents) for x in p.interval)
            comment = f"95 %: {low} to {high}" + (", at its bound" if p.at_bound else "")
            digits = None if p.at_bound else DIGITS
        written = value if digits is None else float(f"{value:.{digits}g}")
        changed[name] = Changed(written, mechanism.parameters[name].source, comment)
    text = variant_text(mechanism, f"{mechanism.name}, calibrated", Path(base), Path(path), changed)
    return write_file(Path(path), lambda file: file.write_text(text, encoding="utf-8", newline="\n"))
