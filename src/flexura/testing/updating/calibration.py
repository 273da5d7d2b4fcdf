"""Calibration: the parameters of a mechanism found from measured frequencies, shapes and frequency responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.derivatives import ModelOrder
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.mechanism import Mechanism
from flexura.structure import Plan, one_design
from flexura.testing.updating.calibrated import CalibratedMode, CalibratedParameter, Calibration, Method
from flexura.testing.updating.posterior import (
    LEAST_REDUCTION,
    QUANTILE,
    UNLIKELY_MISFIT,
    Direction,
    Misfit,
    covariance,
    directions,
    misfits,
    widening,
)
from flexura.testing.updating.problem import (
    CalibrationProblem,
    Configuration,
    ModelOptions,
    Prior,
    Unknowns,
    configurations,
    unknowns,
)
from flexura.testing.updating.targets import ModalTarget, Target, targets_of

Pairing = Literal["tracked", "in_order"]

SETTLING_ROUNDS = 4
"""Times that the ends which corrections hold clamped are settled anew at the sizes found."""

SETTLED_ENDS = 1e-6
"""Change of the residuals, in standard deviations, below which these ends have been settled."""

AT_BOUND = 1e-3
"""Distance in prior standard deviations within which a parameter counts as at its bound."""


@verb
def calibrate(
    model: Mechanism | Plan,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    data: Any,
    free: Sequence[str],
    also: Sequence[tuple[Mechanism | Plan, Any]] = (),
    method: Method = "map",
    sigma: float = 0.01,
    shape_sigma: float = 0.1,
    response_sigma: float = 0.1,
    damping: float = 0.01,
    priors: Mapping[str, Prior] | None = None,
    order: ModelOrder = "full",
    keep: int | Mapping[str, int] = 0,
    pairing: Pairing = "tracked",
    max_steps: int = 60,
) -> Calibration:
    """Find the parameters `free` with which a mechanism meets a measurement (theory eqs. K13-K18).

    `data`: frequencies in Hz, `MeasuredFrequencies`, `IdentifiedModes`, `MeasuredFRF`, a `Measurement`, or a list of
    these. Frequencies are compared by their logarithm with the relative standard deviation `sigma` where the data bring
    none or less, shapes by what no scaling of the model's explains with `shape_sigma` of their length, frequency
    responses by the logarithm of their ratio with `response_sigma`, modes having the ratio `damping`.

    `also` are further mechanisms with data of their own, as of the same design with other sensors or other loads: a
    parameter is one unknown for all that have one of its name, with one start and one range. `parameters` replaces
    values in each mechanism that has them.

    `method`: map weighs the data against priors, which are given (a relative standard deviation, or mean and standard
    deviation, by name), or follow from each parameter's bounds and `source`; least_squares has bounds alone. The search
    makes Gauss-Newton steps within a trust region (Branch, Coleman and Li 1999) with analytic sensitivities. `order`
    and `keep` as in `mode_sensitivities`. The standard deviations have to cover what the model leaves out, too.

    Modes with measured shapes are paired by these. Frequencies alone belong to the start's modes of the same number,
    which are tracked by their shapes while parameters move (`pairing="tracked"`), or to whichever modes have that
    number (`in_order`).

    Raises ModelError for a description that cannot be used, OptionError for impossible arguments and SolverError when
    the start cannot be solved.
    """
    if method not in get_args(Method):
        raise OptionError(f"method is map or least_squares, not {method!r}")
    for name, x in (("sigma", sigma), ("shape_sigma", shape_sigma), ("response_sigma", response_sigma)):
        if not 0 < x < np.inf:
            raise OptionError(f"{name} is positive and finite, not {x}")
    if pairing not in get_args(Pairing):
        raise OptionError(f"pairing is tracked or in_order, not {pairing!r}")
    if not 0 < damping < 1:
        raise OptionError(f"damping is a ratio between 0 and 1, not {damping}")
    at = one_design(parameters)
    pairs = [
        (mechanism, targets_of(measured, sigma, shape_sigma, response_sigma, damping))
        for mechanism, measured in ((model, data), *also)
    ]
    together = configurations(pairs, free, at)
    unknown = unknowns(together, at, priors)
    if method == "least_squares":
        _refuse_undetermined([t for c in together for t in c.targets], unknown.names)
    first = CalibrationProblem(together, unknown, ModelOptions(order, keep, pairing == "tracked"))
    before = first.residual(unknown.z_start)
    if first.refused is not None:
        raise SolverError(f"the start cannot be compared with the data: {first.refused}")
    return _outcome(first, before, _compared(first, unknown.z_start), _search(first, method, max_steps))


def _refuse_undetermined(targets: Sequence[Target], chosen: Sequence[str]) -> None:
    count = sum(
        len(t.frequency_hz) * (1 if t.shapes is None else len(t.channels)) if isinstance(t, ModalTarget) else 10**6
        for t in targets
    )
    if count < len(chosen):
        raise OptionError(
            f"{count} data cannot determine {len(chosen)} parameters by least squares: free fewer, or use method map"
        )


@dataclass(frozen=True)
class _Search:
    """Where a search has ended: at z of the problem whose ends are those of the sizes found, with the mechanisms."""

    method: Method
    problem: CalibrationProblem
    z: Array
    mechanisms: list[Mechanism]
    evaluations: int
    converged: bool
    notes: list[str]


def _search(first: CalibrationProblem, method: Method, max_steps: int) -> _Search:
    """The minimum, its ends settled anew at the sizes found until that changes nothing."""
    together, unknown = first.configurations, first.unknown
    problem, z, evaluations, converged = first, unknown.z_start, 0, False
    mechanisms: list[Mechanism] = []
    notes: list[str] = []
    for turn in range(SETTLING_ROUNDS):
        z, converged = _minimum(problem, z, method, max_steps)
        evaluations += problem.evaluations
        mechanisms = [_with_values(c, unknown.named(z), first.targets) for c in together]
        if not any(part.table.corrections.wanted.any() for c in together for part in c.plan.parts.values()):
            break
        anew = [c.settled(mechanism) for c, mechanism in zip(together, mechanisms, strict=True)]
        settled = CalibrationProblem(anew, unknown, first.options, problem.references)
        moved = float(np.abs(settled.residual(z) - problem.residual(z)).max(initial=0.0))
        problem = settled
        if moved < SETTLED_ENDS:
            break
        if turn == SETTLING_ROUNDS - 1:
            notes.append("which ends count as clamped depends on the sizes: the residuals jump there")
    for c in together:
        c.bounded.verify(c.point(unknown.named(z)))
    return _Search(method, problem, z, mechanisms, evaluations, converged, notes)


def _minimum(problem: CalibrationProblem, z: Array, method: Method, max_steps: int) -> tuple[Array, bool]:
    """The minimum of |r|^2, plus |z|^2 with a prior, within the bounds, and whether it was reached."""
    from scipy.optimize import least_squares  # slow to import

    with_prior = method == "map"
    low, high = problem.unknown.z_bounds
    room = 1e-9 * np.where(np.isfinite(high - low), high - low, 1.0)
    start = np.clip(z, low + room, high - room)

    def residual(z: Array) -> Array:
        r = problem.residual(z)
        return np.concatenate([r, z]) if with_prior else r

    def jacobian(z: Array) -> Array:
        J = problem.jacobian(z)
        return np.concatenate([J, np.eye(len(z))]) if with_prior else J

    minimum = least_squares(
        residual, start, jacobian, bounds=(low, high), xtol=1e-9, ftol=1e-10, gtol=1e-9, max_nfev=max_steps
    )
    return np.clip(minimum.x, low, high), minimum.status > 0


def _with_values(configuration: Configuration, values: Mapping[str, float], targets: Sequence[Target]) -> Mechanism:
    """A mechanism with calibrated values as its own, their sources saying so."""
    described = configuration.bounded.mechanism
    parameters = dict(described.parameters)
    what = _in_words(targets)
    for name in configuration.free:
        known = parameters[name].source
        source = f"calibrated to {what}" + (f"; before: {known}" if known else "")
        parameters[name] = parameters[name].model_copy(update={"value": values[name], "source": source})
    for name, value in configuration.fixed.items():
        parameters[name] = parameters[name].model_copy(update={"value": value})
    return described.model_copy(update={"parameters": parameters})


def _in_words(targets: Sequence[Target]) -> str:
    """What was measured."""
    frequencies = sum(len(t.frequency_hz) for t in targets if isinstance(t, ModalTarget))
    shapes = any(isinstance(t, ModalTarget) and t.shapes is not None for t in targets)
    responses = sum(not isinstance(t, ModalTarget) for t in targets)
    parts = [f"{frequencies} measured frequencies" + (" and shapes" if shapes else "")] if frequencies else []
    parts += [f"{responses} sets of frequency responses"] if responses else []
    names = ", ".join(dict.fromkeys(t.name for t in targets if isinstance(t, ModalTarget) and t.name))
    return " and ".join(parts) + (f" of {names}" if names else "")


class _ModelMode(NamedTuple):
    """The model's mode for a measured one: its frequency, Hz, its number, from 0, and the MAC with it."""

    hz: float
    number: int
    mac: float | None


def _compared(problem: CalibrationProblem, z: Array) -> list[_ModelMode]:
    """The model's mode for every measured one of all targets."""
    modes: list[_ModelMode] = []
    for target, state, rows in problem.compared(z):
        if isinstance(target, ModalTarget):
            partner = target.partner(state, rows)
            hz = state.frequency_hz[partner]
            modes += map(_ModelMode, hz.tolist(), partner.tolist(), target.mac(state, rows))
    return modes


def _outcome(first: CalibrationProblem, before: Array, start: Sequence[_ModelMode], search: _Search) -> Calibration:
    """What a search from the residuals `before` and the modes of the `start` has found, with its uncertainty."""
    problem, z, with_prior = search.problem, search.z, search.method == "map"
    unknown = problem.unknown
    J, after = problem.jacobian(z), problem.residual(z)
    missed = misfits(problem.targets, after, J, with_prior)
    cov = covariance(J, with_prior) + widening(missed, J, with_prior)
    informed = np.diagonal(covariance(J, True) + widening(missed, J, True))
    deviation = np.sqrt(np.diagonal(cov))
    low, high = unknown.z_bounds
    at_bound = (z - low < AT_BOUND) | (high - z < AT_BOUND)
    values, intervals = unknown.values(z), _interval(unknown, z, deviation)
    priors = _interval(unknown, np.zeros_like(z), np.ones_like(z))
    parameters = tuple(
        CalibratedParameter(
            name,
            next(c.known[name].unit for c in problem.configurations if name in c.free),
            float(unknown.start[k]),
            float(values[k]),
            intervals[k],
            priors[k],
            unknown.reason[k],
            float(np.clip(1 - informed[k], 0.0, 1.0)),
            bool(at_bound[k]),
        )
        for k, name in enumerate(unknown.names)
    )
    modes = _modes(problem, start, _compared(problem, z))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = np.nan_to_num(cov / np.outer(deviation, deviation), nan=0.0)
    np.fill_diagonal(correlation, 1.0)
    combinations = directions(J, unknown.names)
    weakest = min(problem.weakest, first.weakest)
    return Calibration(
        search.mechanisms[0],
        search.method,
        parameters,
        modes,
        combinations,
        correlation,
        float(after @ after),
        float(before @ before),
        int((np.abs(J).sum(axis=1) > 0).sum()),
        search.evaluations + problem.evaluations,
        search.converged,
        problem,
        z,
        cov,
        tuple(search.mechanisms[1:]),
        missed,
        (*search.notes, *_notes(parameters, combinations, modes, missed, weakest)),
        tuple(_warnings(missed, None if search.converged else search.evaluations)),
    )


def _interval(unknown: Unknowns, z: Array, deviation: Array) -> list[tuple[float, float]]:
    """95 % intervals in SI, cut at the bounds."""
    low, high = unknown.z_bounds
    with np.errstate(over="ignore"):
        ends = [unknown.values(np.clip(z + side * QUANTILE * deviation, low, high)) for side in (-1, 1)]
    return [(float(a), float(b)) for a, b in zip(*ends, strict=True)]


def _modes(
    problem: CalibrationProblem, start: Sequence[_ModelMode], now: Sequence[_ModelMode]
) -> tuple[CalibratedMode, ...]:
    """Every measured mode beside the model's, before and after."""
    several = len(problem.configurations) > 1
    measured = [
        (t, k, c.label if several else "")
        for c in problem.configurations
        for t in c.targets
        if isinstance(t, ModalTarget)
        for k in range(len(t.frequency_hz))
    ]
    return tuple(
        CalibratedMode(
            *(t.numbers[k], float(t.frequency_hz[k]), float(t.sigma[k])),
            *(before.hz, after.hz, after.number + 1, before.mac, after.mac, label),
        )
        for (t, k, label), before, after in zip(measured, start, now, strict=True)
    )


def _warnings(missed: Sequence[Misfit], stopped: int | None) -> list[Diagnostic]:
    """What the data contradict, and that the search `stopped` after so many steps where it did not converge."""
    warnings = []
    if stopped is not None:
        text = "the search stopped before it converged: allow more steps, or start nearer"
        warnings.append(Diagnostic("convergence", "", float(stopped), float(stopped), "1", text))
    for misfit in missed:
        if misfit.is_unlikely:
            text = (
                f"the model misses the data: {misfit.kind} by {misfit.ratio:.2g} standard deviations where"
                f" {misfit.spare:.2g} of {misfit.data} are to spare (probability {misfit.probability:.1g}): it lacks"
                " something that the freed parameters cannot make up, or sigma is too small; intervals are widened for"
                " an error of that size, not for one that the parameters have taken up"
            )
            warnings.append(Diagnostic("misfit", misfit.kind, misfit.probability, UNLIKELY_MISFIT, "1", text))
    return warnings


def _notes(
    parameters: Sequence[CalibratedParameter],
    combinations: Sequence[Direction],
    modes: Sequence[CalibratedMode],
    missed: Sequence[Misfit],
    weakest: float,
) -> list[str]:
    """What to beware of; `weakest` is the least MAC of a mode between one step and the next."""
    notes = []
    held = [p.name for p in parameters if p.at_bound]
    if held:
        notes.append(f"at a bound, where there is no interval: {', '.join(held)}")
    unresolved = [d for d in combinations if d.variance_reduction < LEAST_REDUCTION]
    if unresolved:
        notes.append(f"{len(unresolved)} of {len(combinations)} combinations of parameters are left to the prior")
    for misfit in missed:
        if not misfit.is_testable:
            notes.append(
                f"the parameters take up all {misfit.data} {misfit.kind}: nothing is left to check the model by, and"
                " intervals hold if sigma covers what it leaves out"
            )
        elif misfit.ratio > 1 and not misfit.is_unlikely:
            notes.append(
                f"{misfit.kind} are met to {misfit.ratio:.2g} standard deviations: intervals are widened as if the"
                " model were off by the rest"
            )
    if weakest < 0.5:
        notes.append(f"modes changed a lot from one step to the next (MAC {weakest:.2f}): check which is which")
    swapped = [m.number for last, m in pairwise(modes) if m.number > last.number and m.model_mode < last.model_mode]
    if swapped:
        notes.append(f"the model has measured mode {swapped[0]} below the one before it")
    return notes
