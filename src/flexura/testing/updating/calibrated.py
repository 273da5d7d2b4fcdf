"""The outcome of a calibration: parameters with intervals, modes before and after, and what the data cannot tell."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from flexura.errors import OptionError, SolverError
from flexura.mechanism.substructure import Mechanism
from flexura.testing.updating.markov_chain import Progress
from flexura.testing.updating.misfit import Misfit
from flexura.testing.updating.posterior import LEAST_GAIN, Direction, Sample, draw
from flexura.testing.updating.residuals import Problem

Array = NDArray[np.float64]
Method = Literal["map", "least_squares"]


@dataclass(frozen=True)
class CalibratedParameter:
    """One parameter, SI: `start` and calibrated `value`, and the `interval` that holds it with 95 %, infinite where
    the data say nothing and there is no prior.

    `prior` is the same interval beforehand and `reason` its origin. `information_gain` is the share of
    the prior variance that the data took away. At a bound the Gaussian approximation is not valid.
    """

    name: str
    unit: str
    start: float
    value: float
    interval: tuple[float, float]
    prior: tuple[float, float]
    reason: str
    information_gain: float
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


@dataclass(frozen=True)
class Calibration:
    """The outcome of a calibration: the `mechanism` with its new values, and how far these can be trusted.

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
    notes: tuple[str, ...]
    problem: Problem = field(repr=False)
    z: Array = field(repr=False)
    covariance: Array = field(repr=False)
    also: tuple[Mechanism, ...] = ()
    misfits: tuple[Misfit, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """The calibrated values by name, SI."""
        return {p.name: p.value for p in self.parameters}

    @property
    def unresolved(self) -> tuple[Direction, ...]:
        """Combinations of parameters that the data cannot tell."""
        return tuple(d for d in self.directions if d.information_gain < LEAST_GAIN)

    def raise_warnings(self) -> None:
        """Raise SolverError with all warnings, if there are any."""
        if self.warnings:
            raise SolverError("; ".join(self.warnings))

    def sample(self, draws: int = 1000, seed: int = 0, progress: Progress | None = None) -> Sample:
        """Draws of the posterior with the model itself, which check the Gaussian intervals (theory eq. K19).

        They take the standard deviations of the data as they are, without an error of the model.

        `progress` is told of steps done and to do. Raises OptionError without a prior, when the posterior need not be
        proper.
        """
        if self.method != "map":
            raise OptionError("draws need a prior: calibrate with method map")
        if draws < 1:
            raise OptionError(f"the number of draws is at least 1, not {draws}")
        own = self.problem

        def cost(z: Array) -> float:
            r = own.residual(z)
            return float(r @ r + z @ z) / 2

        bounds, values = own.unknown.z_bounds, own.unknown.values
        return draw(self.z, self.covariance, bounds, cost, values, draws, seed, progress)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the mechanism, as plain data for JSON; infinite numbers are None."""

        def plain(x: Any) -> Any:
            if isinstance(x, dict):
                return {k: plain(v) for k, v in x.items()}
            if isinstance(x, list | tuple):
                return [plain(v) for v in x]
            return None if isinstance(x, float) and not np.isfinite(x) else x

        return plain(
            {
                "name": self.mechanism.name,
                "also": [own.name for own in self.also],
                "method": self.method,
                "parameters": [asdict(p) for p in self.parameters],
                "modes": [{**asdict(m), "start_error": m.start_error, "error": m.error} for m in self.modes],
                "directions": [asdict(d) for d in self.directions],
                "correlation": self.correlation.tolist(),
                "chi_square": self.chi_square,
                "start_chi_square": self.start_chi_square,
                "residuals": self.residuals,
                "evaluations": self.evaluations,
                "converged": self.converged,
                "misfits": [m.to_dict() for m in self.misfits],
                "warnings": list(self.warnings),
                "notes": list(self.notes),
            }
        )
