"""The parameters that a calibration moves: their scale, bounds, and what is believed of them beforehand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.mechanism import bounds
from flexura.structure import Plan
from flexura.testing.updating.configuration import Configuration

Prior = float | tuple[float, float]
"""A relative standard deviation, or mean and standard deviation in SI."""

PRINTED = 0.02
"""Relative standard deviation of a size whose source says paper, measured, drawing or datasheet."""

UNKNOWN = 0.3
"""Relative standard deviation of a parameter without bounds."""

BOUND_SPREAD = 2.0
"""Standard deviations from the middle of a prior to its bounds, of a parameter that has both."""

KNOWN_SOURCES = ("paper", "printed", "measured", "drawing", "datasheet", "data sheet")


@dataclass(frozen=True)
class Unknowns:
    """P parameters in standard coordinates z = (theta - mean)/deviation, theta = ln p where `is_log` (theory eq. K16).

    `mean`, `deviation`, `low` and `high` are of theta, `limits` (2, P) in SI; `reason` is the origin of each prior.
    """

    names: tuple[str, ...]
    is_log: NDArray[np.bool_]
    mean: Array
    deviation: Array
    low: Array
    high: Array
    start: Array
    limits: Array
    reason: tuple[str, ...]

    def theta(self, values: Array) -> Array:
        """theta (P,) of values in SI."""
        return np.where(self.is_log, np.log(np.where(self.is_log, values, 1.0)), values)

    def values(self, z: Array) -> Array:
        """Values (..., P) in SI of standard coordinates, within the limits."""
        theta = self.mean + self.deviation * z
        found = np.where(self.is_log, np.exp(np.where(self.is_log, theta, 0.0)), theta)
        return np.clip(found, *self.limits)

    def z(self, values: Array) -> Array:
        """Standard coordinates (P,) of values in SI."""
        return (self.theta(values) - self.mean) / self.deviation

    def slope(self, z: Array) -> Array:
        """dp/dz (P,)."""
        return self.deviation * np.where(self.is_log, self.values(z), 1.0)

    @property
    def z_bounds(self) -> tuple[Array, Array]:
        """Bounds in standard coordinates."""
        return (self.low - self.mean) / self.deviation, (self.high - self.mean) / self.deviation


def unknowns(
    configurations: Sequence[Configuration], at: Mapping[str, float], priors: Mapping[str, Prior] | None = None
) -> Unknowns:
    """The unknowns at a start, with priors: as given, else tight for what is known, else from the bounds.

    The middle of a prior is the start, or the nearest bound. Raises OptionError for priors and bounds without room, and
    for parameters that start elsewhere or have other bounds or units in another configuration.
    """
    names = list(dict.fromkeys(name for own in configurations for name in own.free))
    given = dict(priors or {})
    strange = sorted(set(given) - set(names))
    if strange:
        raise OptionError(f"a prior is given for {strange[0]}, which is not free; free are {', '.join(names)}")
    values = [own.bounded.parameter_values({n: at[n] for n in at if n in own.known}) for own in configurations]
    rows = []
    for name in names:
        shared = [(own, v) for own, v in zip(configurations, values, strict=True) if name in own.free]
        for own, v in shared[1:]:
            _refuse_unequal(name, *shared[0], own, v)
        rows.append(_row(shared[0][0].bounded, name, shared[0][1], given.get(name)))
    is_log, mean, deviation, low, high, start, limits, reason = zip(*rows, strict=True)
    m, d, a, b, x = (np.array(x, dtype=float) for x in (mean, deviation, low, high, start))
    return Unknowns(tuple(names), np.array(is_log), m, d, a, b, x, np.array(limits, dtype=float).T, tuple(reason))


def _refuse_unequal(
    name: str, first: Configuration, values: Mapping[str, Any], other: Configuration, others: Mapping[str, Any]
) -> None:
    """Raise OptionError for a shared parameter that is not the same in two configurations."""
    p, q = (own.known[name] for own in (first, other))
    if p.unit and q.unit and p.dimension != q.dimension:
        raise OptionError(f"{name} is in {p.unit} in {first.label}, and in {q.unit} in {other.label}")
    one = (float(values[name]), *(float(np.asarray(b)) for b in bounds(name, p, values)))
    two = (float(others[name]), *(float(np.asarray(b)) for b in bounds(name, q, others)))
    if not np.allclose(one, two, rtol=1e-9, atol=0.0):
        said = [f"{x[0]:g} within {x[1]:g} to {x[2]:g} in {own.label}" for x, own in ((one, first), (two, other))]
        raise OptionError(f"{name} is {' and '.join(said)} (SI): give what is moved together one start and one range")


def _row(
    plan: Plan, name: str, values: Mapping[str, object], prior: Prior | None
) -> tuple[bool, float, float, float, float, float, tuple[float, float], str]:
    parameter = plan.mechanism.parameters[name]
    start = float(values[name])  # type: ignore[arg-type]
    low, high = (float(np.asarray(b)) for b in bounds(name, parameter, values))  # type: ignore[arg-type]
    if not low < high:
        raise OptionError(f"{name} has no room between its bounds {low:g} and {high:g}")
    is_log = start > 0 and not low < 0 < high and (low >= 0 or not np.isfinite(low))
    with np.errstate(divide="ignore"):
        own = np.log([max(start, low), max(low, 0.0), high]) if is_log else np.array([start, low, high])
    theta, bottom, top = (float(x) for x in own)
    mean, deviation, reason = _prior(name, parameter.source, prior, theta, bottom, top, is_log, start)
    return is_log, mean, deviation, bottom, top, start, (low, high), reason


def _prior(
    name: str, source: str, prior: Prior | None, theta: float, low: float, high: float, is_log: bool, start: float
) -> tuple[float, float, str]:
    scale = 1.0 if is_log else abs(start) or 1.0
    if isinstance(prior, tuple | list):
        mean, deviation = (float(x) for x in prior)
        if not (np.isfinite(mean) and 0 < deviation < np.inf) or (is_log and mean <= 0):
            raise OptionError(f"the prior of {name} is a mean and a positive standard deviation, not {prior}")
        return (np.log(mean), deviation / mean, "given") if is_log else (mean, deviation, "given")
    if prior is not None:
        if not 0 < float(prior) < np.inf:
            raise OptionError(f"the prior of {name} is a positive relative standard deviation, not {prior}")
        return theta, float(prior) * scale, "given"
    if source.strip().lower().startswith(KNOWN_SOURCES):
        return theta, PRINTED * scale, f"known ({source.strip().split(',')[0].split(';')[0]})"
    if np.isfinite(low) and np.isfinite(high):
        return theta, (high - low) / (2 * BOUND_SPREAD), "bounds"
    return theta, UNKNOWN * scale, "no bounds"
